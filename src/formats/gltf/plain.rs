//! A mesh without a scene as a glTF: what is written where no scene is known.

use std::collections::{HashMap, HashSet};
use std::io;

use serde_json::{Map, Value, json};

use super::accessor::{Shape, type_of};
use super::geometry::{Column, Geometry};
use super::pack::Pack;
use super::primitive::POSITION;
use super::scene::{COVERAGE, DETAIL};
use super::turned::{has_v, turn_v};
use crate::formats::write::finite;
use crate::mesh::IndexedMesh;
use crate::mesh::attributes::{Attribute, Domain, NO_VALUE, Semantic, Stored, Values};

/// The JSON of a glTF that has the mesh, and its buffer. Objects, by what parts are called, are meshes, each of a node; parts are primitives, as
/// many each as there are sets of attributes that its triangles have at all their corners.
///
/// # Errors
/// [`io::ErrorKind::InvalidInput`] where a coordinate is not finite in binary32.
pub(super) fn document(mesh: &IndexedMesh) -> io::Result<(Value, Vec<u8>)> {
    let mut parts = Parts::default();
    let nodes = parts.add(mesh)?;
    let scene = (0..nodes.len()).collect();
    Ok(parts.finish(nodes, scene))
}

/// The same of levels of detail of one thing, the finest first (`MSFT_lod`): the node of the first one names those of the others. A level of
/// several objects is a node of theirs. `coverage` tells for each down to which share of the screen it is meant to be shown.
///
/// # Errors
/// As [`document`].
pub(super) fn levels(meshes: &[IndexedMesh], coverage: &[f64]) -> io::Result<(Value, Vec<u8>)> {
    let mut parts = Parts::default();
    let (mut nodes, mut objects) = (Vec::new(), Vec::new());
    for mesh in meshes {
        let mut own = parts.add(mesh)?;
        nodes.push(match own.len() {
            1 => own.remove(0),
            count => {
                let first = meshes.len() + objects.len();
                objects.extend(own);
                json!({ "children": (first..first + count).collect::<Vec<_>>() })
            }
        });
    }
    if let Some(finest) = nodes.first_mut().filter(|_| meshes.len() > 1) {
        finest["extensions"] = json!({ DETAIL: { "ids": (1..meshes.len()).collect::<Vec<_>>() } });
        finest["extras"] = json!({ COVERAGE: coverage });
    }
    nodes.extend(objects);
    let (mut root, binary) = parts.finish(nodes, vec![0]);
    if meshes.len() > 1 {
        root["extensionsUsed"] = json!([DETAIL]);
    }
    Ok((root, binary))
}

/// What meshes that are written have in common.
#[derive(Default)]
struct Parts<'a> {
    pack: Pack,
    materials: Named<'a, ()>,
    meshes: Vec<Value>,
}

impl<'a> Parts<'a> {
    /// Adds the objects of a mesh; a node for each.
    fn add(&mut self, mesh: &'a IndexedMesh) -> io::Result<Vec<Value>> {
        let names = &mesh.part_names;
        let turned = has_v(mesh).then(|| {
            let mut turned = mesh.clone();
            turn_v(&mut turned);
            turned
        });
        let mesh = turned.as_ref().unwrap_or(mesh);
        let (written, _) = sorted(mesh);
        let columns: Vec<Column<'_>> =
            written.iter().map(|(_, attribute, _)| Column::new(attribute)).collect();
        let mut objects: Named<'_, Vec<Value>> = Named::default();
        for group in groups(mesh, &written) {
            let own: Vec<usize> = (0..written.len()).filter(|k| group.attributes >> k & 1 == 1).collect();
            let geometry =
                Geometry::new(mesh, &group.triangles, &own.iter().map(|&k| &columns[k]).collect::<Vec<_>>());
            let mut attributes = Map::new();
            let places = positions(mesh, &geometry.vertices)?;
            attributes.insert(POSITION.to_owned(), self.pack.vertices(POSITIONS, &places, true).into());
            for (&k, values) in own.iter().zip(&geometry.values) {
                let (name, _, shape) = &written[k];
                let number = self.pack.vertices(*shape, &columns[k].values(values, *shape, &[]), false);
                attributes.insert(name.clone(), number.into());
            }
            let indices = self.pack.indices(&geometry.indices);
            let mut primitive = json!({ "attributes": attributes, "indices": indices });
            let name = group.part.and_then(|part| names.get(part as usize));
            let Names { object, material, .. } = Names::of(name.map_or("", String::as_str));
            if !material.is_empty() {
                primitive["material"] = self.materials.place(material).into();
            }
            let object = objects.place(object);
            objects.list[object].1.push(primitive);
        }
        let mut nodes = Vec::new();
        for (name, primitives) in objects.list {
            nodes.push(called(json!({ "mesh": self.meshes.len() }), name));
            self.meshes.push(called(json!({ "primitives": primitives }), name));
        }
        Ok(nodes)
    }

    /// The document, whose scene has some of the nodes.
    fn finish(self, nodes: Vec<Value>, scene: Vec<usize>) -> (Value, Vec<u8>) {
        let Self { mut pack, materials, meshes } = self;
        let mut root = Map::new();
        root.insert("asset".into(), json!({ "version": "2.0", "generator": GENERATOR }));
        if !meshes.is_empty() {
            root.insert("scene".into(), 0.into());
            root.insert("scenes".into(), json!([{ "nodes": scene }]));
            root.insert("nodes".into(), nodes.into());
            if !materials.list.is_empty() {
                let names = materials.list.iter().map(|(name, ())| json!({ "name": name }));
                root.insert("materials".into(), names.collect());
            }
            root.insert("meshes".into(), meshes.into());
        }
        pack.finish(&mut root);
        (root.into(), pack.bytes)
    }
}

fn called(mut value: Value, name: &str) -> Value {
    if !name.is_empty() {
        value["name"] = name.into();
    }
    value
}

/// See [`unwritten`](crate::formats::unwritten).
pub(super) fn unwritten(mesh: &IndexedMesh) -> Vec<String> {
    let (written, left) = sorted(mesh);
    let mut lost: Vec<String> =
        crate::formats::write::no_place(crate::formats::Format::Gltf, left.into_iter()).into_iter().collect();
    let named = |of: &dyn Fn(&(String, &Attribute, Shape)) -> bool| {
        let titles: Vec<String> =
            written.iter().filter(|column| of(column)).map(|(_, a, _)| a.title()).collect();
        (!titles.is_empty()).then(|| titles.join(", "))
    };
    let rounded = named(&|(_, attribute, shape)| !fits(attribute, *shape));
    lost.extend(rounded.map(|titles| format!("glTF has binary32 numbers: {titles} rounded")));
    let of_triangles = named(&|(_, attribute, _)| attribute.domain == Domain::Triangle);
    lost.extend(of_triangles.map(|titles| {
        format!("glTF has values of vertices alone: {titles} of triangles written at their corners")
    }));
    let torn = named(&|(_, attribute, _)| {
        let whole = |corners: &[u32]| corners.iter().all(|&v| v == NO_VALUE) || !corners.contains(&NO_VALUE);
        attribute.domain == Domain::Corner && !attribute.corners.chunks(3).all(whole)
    });
    lost.extend(torn.map(|titles| {
        format!("glTF has values at all corners of a triangle or at none: some {titles} left out")
    }));
    let groups = mesh.part_names.iter().filter(|name| Names::of(name).others).count();
    if groups > 0 {
        lost.push(format!("glTF has no place for names of groups ({groups})"));
    }
    if !mesh.libraries.is_empty() {
        lost.push(format!("glTF has no place for material libraries ({})", mesh.libraries.len()));
    }
    lost
}

/// Positions of vertices in binary32, to the nearest.
fn positions(mesh: &IndexedMesh, vertices: &[u32]) -> io::Result<Values> {
    let all = vertices.iter().flat_map(|&v| mesh.positions[v as usize]);
    let binary32 = all.map(|x| finite(f64::from(x as f32), x).map(|x| x as f32));
    Ok(Values::F32(binary32.collect::<io::Result<_>>()?))
}

/// Triangles that are a primitive.
struct Group {
    part: Option<u32>,
    /// A bit for each attribute that they have.
    attributes: u64,
    triangles: Vec<u32>,
}

fn groups(mesh: &IndexedMesh, written: &[(String, &Attribute, Shape)]) -> Vec<Group> {
    let parts = mesh.attributes.iter().find(|attribute| is_part(attribute));
    let mut groups: Vec<Group> = Vec::new();
    let mut known: HashMap<(Option<u32>, u64), usize> = HashMap::new();
    for t in 0..mesh.triangles.len() {
        let part = parts.and_then(|parts| Some(parts.values.number(parts.at(t, 0)?) as u32));
        let has = |attribute: &Attribute| (0..3).all(|place| attribute.at(t, place).is_some());
        let bits = written.iter().enumerate().map(|(k, (_, attribute, _))| u64::from(has(attribute)) << k);
        let attributes = bits.fold(0, |all, bit| all | bit);
        let group = *known.entry((part, attributes)).or_insert_with(|| {
            groups.push(Group { part, attributes, triangles: Vec::new() });
            groups.len() - 1
        });
        groups[group].triangles.push(t as u32);
    }
    groups
}

/// What glTF calls an attribute.
type Written<'a> = (String, &'a Attribute, Shape);

/// The attributes that are written, 64 at most, by which names and of which types; and those that are not.
fn sorted(mesh: &IndexedMesh) -> (Vec<Written<'_>>, Vec<&Attribute>) {
    let (mut written, mut left): (Vec<Written<'_>>, Vec<&Attribute>) = Default::default();
    let mut names = HashSet::from([POSITION.to_owned()]);
    let parts = mesh.attributes.iter().position(is_part);
    for (k, attribute) in mesh.attributes.iter().enumerate().filter(|(k, _)| Some(*k) != parts) {
        let at_corners = attribute.domain == Domain::Corner || attribute.semantic == Semantic::Color;
        match known(attribute).or_else(|| generic(attribute)).filter(|_| at_corners && k < u64::BITS as usize)
        {
            Some((mut name, shape)) => {
                while !names.insert(name.clone()) {
                    name = format!("_{name}_");
                }
                written.push((name, attribute, shape));
            }
            None => left.push(attribute),
        }
    }
    (written, left)
}

/// The name and the type of what glTF knows (2.0, §3.7.2.1).
fn known(attribute: &Attribute) -> Option<(String, Shape)> {
    let Attribute { semantic, set, components, normalised, .. } = *attribute;
    let stored = attribute.values.stored();
    let is_small = matches!(stored, Stored::U8 | Stored::U16);
    let (name, fits, integers) = match semantic {
        Semantic::Normal => ("NORMAL", components == 3 && set == 0, false),
        Semantic::Tangent => ("TANGENT", components == 4 && set == 0, false),
        Semantic::TexCoord => ("TEXCOORD", components == 2, normalised && is_small),
        Semantic::Color => ("COLOR", matches!(components, 3 | 4), normalised && is_small),
        Semantic::Joints => ("JOINTS", components == 4 && is_small && !normalised, true),
        Semantic::Weights => ("WEIGHTS", components == 4, normalised && is_small),
        Semantic::Part | Semantic::Generic => return None,
    };
    let one = matches!(semantic, Semantic::Normal | Semantic::Tangent);
    let name = if one { name.to_owned() } else { format!("{name}_{set}") };
    let shape = if integers { Shape { stored, normalised, components } } else { binary32(components) };
    fits.then_some((name, shape))
}

/// Those of what it does not know, for which names begin with `_`.
fn generic(attribute: &Attribute) -> Option<(String, Shape)> {
    let Attribute { components, normalised, .. } = *attribute;
    let stored = attribute.values.stored();
    type_of(components)?;
    let title = attribute.title();
    let name = if title.starts_with('_') { title } else { format!("_{title}") };
    let shape = match stored {
        Stored::U8 | Stored::I8 | Stored::U16 | Stored::I16 if components <= 4 => {
            Shape { stored, normalised, components }
        }
        _ => binary32(components),
    };
    Some((name, shape))
}

fn binary32(components: usize) -> Shape {
    Shape { stored: Stored::F32, normalised: false, components }
}

/// Whether a type tells all numbers.
fn fits(attribute: &Attribute, shape: Shape) -> bool {
    let number = |at: usize| crate::formats::write::fraction(attribute, at);
    let survives = |x: f64| f64::from(x as f32) == x || x.is_nan();
    match attribute.values.stored() {
        stored if stored == shape.stored && attribute.normalised == shape.normalised => true,
        // binary32 tells fractions of so few bits apart.
        Stored::U8 | Stored::I8 | Stored::U16 | Stored::I16 => true,
        _ => (0..attribute.values.len()).all(|at| survives(number(at))),
    }
}

fn is_part(attribute: &Attribute) -> bool {
    attribute.semantic == Semantic::Part && attribute.domain == Domain::Triangle && attribute.components == 1
}

/// What the name of a part says, by the statements of OBJ.
#[derive(Default)]
struct Names<'a> {
    object: &'a str,
    material: &'a str,
    /// Whether it says more.
    others: bool,
}

impl<'a> Names<'a> {
    fn of(name: &'a str) -> Self {
        let mut names = Self::default();
        for line in name.lines() {
            match line.split_once(' ') {
                Some(("o", object)) => names.object = object,
                Some(("usemtl", material)) => names.material = material,
                // Primitives are told by their numbers anyway.
                Some(("g", group)) => names.others |= !group.starts_with("primitive "),
                _ if names.object.is_empty() => names.object = line,
                _ => names.others = true,
            }
        }
        names
    }
}

/// Names, in the order in which they came, and what they have.
struct Named<'a, T> {
    list: Vec<(&'a str, T)>,
    places: HashMap<&'a str, usize>,
}

impl<T> Default for Named<'_, T> {
    fn default() -> Self {
        Self { list: Vec::new(), places: HashMap::new() }
    }
}

impl<'a, T: Default> Named<'a, T> {
    /// The place of a name, which is the next one where it is new.
    fn place(&mut self, name: &'a str) -> usize {
        *self.places.entry(name).or_insert_with(|| {
            self.list.push((name, T::default()));
            self.list.len() - 1
        })
    }
}

const POSITIONS: Shape = Shape { stored: Stored::F32, normalised: false, components: 3 };
const GENERATOR: &str = concat!("unweld ", env!("CARGO_PKG_VERSION"));
