//! Which meshes a scene shows, and where (glTF 2.0, §3.5); at a coarser level of detail, where its nodes have some (`MSFT_lod`).

use super::accessor::Accessor;
use super::document::Document;
use super::json::{At, fault};
use super::transform::Matrix;
use crate::error::Result;

/// A mesh in its place.
#[derive(Clone, Copy, Debug)]
pub(super) struct Instance {
    pub mesh: usize,
    /// The node that has it.
    pub node: usize,
    /// From the mesh's coordinates to those of the scene.
    pub world: Matrix,
}

/// The meshes of a scene.
#[derive(Debug, Default)]
pub(super) struct Scene {
    /// By mesh, those of one in the order of the nodes.
    pub instances: Vec<Instance>,
    /// Nodes that say more than that there is a mesh: they are flattened.
    pub flattened: usize,
    /// Numbers of instances that are no part of where they are.
    pub instance_numbers: usize,
}

/// The name of the extension that has a mesh many times.
pub(super) const INSTANCING: &str = "EXT_mesh_gpu_instancing";

/// The name of the extension by which a node has coarser ones that may stand in its place.
pub(super) const DETAIL: &str = "MSFT_lod";
/// What the extras of such a node tell: for each level, itself first, down to which share of the screen it is meant to be shown.
pub(super) const COVERAGE: &str = "MSFT_screencoverage";

impl Scene {
    /// Walks the nodes of the scene that a document shows, or of all its roots where it has no scenes; where no node at all has a
    /// mesh, each mesh stands by itself. At a level of detail above 0 the node that is named for it stands in the place of each that has such, or the last
    /// one named.
    ///
    /// # Errors
    /// At a node that is reached twice, at a transformation that is none.
    pub(super) fn new(document: &Document<'_>, detail: usize) -> Result<Self> {
        let root = document.root();
        let nodes = root.list("nodes")?;
        document.take(nodes.len(), BYTES_A_NODE)?;
        let mut scene = Self::default();
        let mut seen = vec![false; nodes.len()];
        // Nodes and where they are named, which comes next last.
        let mut open: Vec<(usize, String, Matrix)> =
            roots(document, &nodes)?.into_iter().map(|(k, from)| (k, from, Matrix::IDENTITY)).rev().collect();
        while let Some((k, from, above)) = open.pop() {
            let coarser = nodes.get(k).filter(|_| detail > 0).map(coarser).transpose()?;
            let coarser = coarser.and_then(|list| list.into_iter().take(detail).next_back());
            let (k, from) = coarser.unwrap_or((k, from));
            let (Some(node), Some(seen)) = (nodes.get(k), seen.get_mut(k)) else {
                return Err(fault(&from, format!("names item {k} of /nodes, which has {}", nodes.len())));
            };
            if std::mem::replace(seen, true) {
                let what = format!("node {k} is reached twice: it has two parents, or is its own ancestor");
                return Err(fault(&from, what));
            }
            let own = Matrix::of_node(node)?;
            let world = above.after(&own);
            let children = references(node, "children")?;
            scene.flattened += usize::from(own != Matrix::IDENTITY || !children.is_empty());
            if let Some(mesh) = node.key("mesh") {
                document.named("meshes", &mesh)?;
                scene.place(document, node, Instance { mesh: mesh.number()?, node: k, world })?;
            }
            document.take(children.len(), BYTES_A_NODE)?;
            open.extend(children.into_iter().rev().map(|(child, from)| (child, from, world)));
        }
        if nodes.iter().all(|node| node.key("mesh").is_none()) {
            let meshes = root.list("meshes")?.len();
            scene.instances.extend((0..meshes).map(|mesh| Instance {
                mesh,
                node: 0,
                world: Matrix::IDENTITY,
            }));
        }
        scene.instances.sort_by_key(|instance| instance.mesh);
        Ok(scene)
    }

    /// A mesh of a node, once or as many times as its instances are.
    fn place(&mut self, document: &Document<'_>, node: &At<'_>, instance: Instance) -> Result<()> {
        let Some(instancing) = node.extension(INSTANCING) else {
            document.take(1, size_of::<Instance>())?;
            self.instances.push(instance);
            return Ok(());
        };
        let mut count = None;
        let mut parts: [Option<Vec<f64>>; 3] = [None, None, None];
        for (name, number) in instancing.object("attributes")? {
            let accessor = Accessor::new(document, &number)?;
            if *count.get_or_insert(accessor.count) != accessor.count {
                return Err(number.fault(format!("{} of {} instances", accessor.count, count.unwrap_or(0))));
            }
            let Some(k) = PARTS.iter().position(|(part, _)| *part == name) else {
                self.instance_numbers += 1;
                continue;
            };
            if accessor.shape.components != PARTS[k].1 {
                return Err(number.fault(format!(
                    "{} numbers an instance, not {}",
                    accessor.shape.components, PARTS[k].1
                )));
            }
            document.take(accessor.count, PARTS[k].1 * size_of::<f64>())?;
            let values = accessor.values()?;
            parts[k] =
                Some((0..values.len()).map(|at| values.fraction(at, accessor.shape.normalised)).collect());
        }
        let count = count.unwrap_or(0);
        document.take(count, size_of::<Instance>())?;
        let [translations, rotations, scales] = parts;
        self.flattened += 1;
        for k in 0..count {
            let own = Matrix::of_parts(
                part(&translations, k).unwrap_or([0.0; 3]),
                part(&rotations, k).unwrap_or([0.0, 0.0, 0.0, 1.0]),
                part(&scales, k).unwrap_or([1.0; 3]),
            );
            self.instances.push(Instance { world: instance.world.after(&own), ..instance });
        }
        Ok(())
    }
}

/// How many levels of detail a document has, that of its own nodes among them.
///
/// # Errors
/// Where a list of the extension is none.
pub(super) fn levels_of_detail(document: &Document<'_>) -> Result<usize> {
    let mut most = 0;
    for node in document.root().list("nodes")? {
        most = most.max(coarser(&node)?.len());
    }
    Ok(1 + most)
}

/// The coarser nodes that may stand in the place of a node, the finest first, and where they are named.
fn coarser(node: &At<'_>) -> Result<Vec<(usize, String)>> {
    node.extension(DETAIL).map_or_else(|| Ok(Vec::new()), |lod| references(&lod, "ids"))
}

/// The nodes that a scene begins with, and where they are named.
fn roots(document: &Document<'_>, nodes: &[At<'_>]) -> Result<Vec<(usize, String)>> {
    let root = document.root();
    let scene = match root.key("scene") {
        Some(number) => Some(document.named("scenes", &number)?),
        None => root.item("scenes", 0),
    };
    if let Some(scene) = scene {
        return references(&scene, "nodes");
    }
    // Without scenes, whatever is nobody's child and stands in nobody's place.
    let mut is_child = vec![false; nodes.len()];
    for node in nodes {
        for (k, _) in references(node, "children")?.into_iter().chain(coarser(node)?) {
            if let Some(is_child) = is_child.get_mut(k) {
                *is_child = true;
            }
        }
    }
    let free = nodes.iter().enumerate().filter(|(k, _)| !is_child[*k]);
    Ok(free.map(|(k, node)| (k, node.pointer.clone())).collect())
}

/// The numbers of a list, and where each stands.
fn references(at: &At<'_>, key: &str) -> Result<Vec<(usize, String)>> {
    at.list(key)?.into_iter().map(|item| Ok((item.number()?, item.pointer))).collect()
}

fn part<const N: usize>(list: &Option<Vec<f64>>, k: usize) -> Option<[f64; N]> {
    list.as_ref()?.get(N * k..)?.first_chunk().copied()
}

const PARTS: [(&str, usize); 3] = [("TRANSLATION", 3), ("ROTATION", 4), ("SCALE", 3)];

/// What the walk holds of a node, at most.
const BYTES_A_NODE: usize = 256;
