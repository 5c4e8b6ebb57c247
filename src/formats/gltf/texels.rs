//! How dense images lie on the surface: from which error of a level on they are of use.

use std::collections::{BTreeMap, BTreeSet};

use serde_json::Value;

use super::document::Document;
use super::json::At;
use super::layout::Parts;
use crate::error::Result;
use crate::mesh::IndexedMesh;
use crate::mesh::attributes::{Attribute, Domain, Semantic};

/// A picture on a surface.
#[derive(Clone, Debug, Default)]
pub(super) struct Texels {
    /// The least length, in units of the mesh, of what a part has along which the whole picture lies, the middle of both its directions: 0
    /// where nothing tells. That over its width or height is how far apart its texels are.
    pub length: f64,
    /// Whether somebody looks at its alpha.
    pub has_alpha: bool,
    /// The sets of texture coordinates that lay it on triangles, and by how much their two directions are scaled.
    pub sets: Vec<(u32, [f64; 2])>,
}

/// What there is to say of each image of a document.
///
/// # Errors
/// At the pointer of a name of nothing.
pub(super) fn of_images(document: &Document<'_>, mesh: &IndexedMesh, parts: &Parts) -> Result<Vec<Texels>> {
    let root = document.root();
    let mut images = vec![Texels::default(); root.list("images")?.len()];
    let areas = Areas::new(mesh);
    let materials = root.list("materials")?;
    let mut looked: BTreeMap<usize, Vec<Look>> = BTreeMap::new();
    let mut done = BTreeSet::new();
    for (k, at) in root.list("meshes")?.iter().enumerate() {
        for (number, primitive) in at.list("primitives")?.iter().enumerate() {
            for material in materials_of(primitive)? {
                let material_number = material.number()?;
                document.named("materials", &material)?;
                if let std::collections::btree_map::Entry::Vacant(entry) = looked.entry(material_number) {
                    entry.insert(looks(document, &materials[material_number])?);
                }
                let Some(part) = parts.get(&(k, number)) else { continue };
                if !done.insert((material_number, part.number)) {
                    continue;
                }
                for look in &looked[&material_number] {
                    let [x, y] = look.scale;
                    let length = areas.length(part.number, look.set) / (x * y).sqrt();
                    for &image in &look.images {
                        if !images[image].sets.contains(&(look.set, look.scale)) {
                            images[image].sets.push((look.set, look.scale));
                        }
                        let known = &mut images[image].length;
                        if length > 0.0 && length.is_finite() && (*known == 0.0 || length < *known) {
                            *known = length;
                        }
                    }
                }
            }
        }
    }
    // Materials that are shown nowhere may be shown yet.
    for (k, material) in materials.iter().enumerate() {
        let of = match looked.remove(&k) {
            Some(of) => of,
            None => looks(document, material)?,
        };
        for look in of.iter().filter(|look| look.has_alpha) {
            look.images.iter().for_each(|&image| images[image].has_alpha = true);
        }
    }
    Ok(images)
}

/// The materials of a primitive, those of variants too.
fn materials_of<'d>(primitive: &At<'d>) -> Result<Vec<At<'d>>> {
    let mut all: Vec<At<'d>> = primitive.key("material").into_iter().collect();
    if let Some(variants) = primitive.extension("KHR_materials_variants") {
        all.extend(variants.list("mappings")?.iter().filter_map(|mapping| mapping.key("material")));
    }
    Ok(all)
}

/// What a material has a picture from.
struct Look {
    /// The images; several where extensions have the same picture in other formats.
    images: Vec<usize>,
    /// The set of texture coordinates.
    set: u32,
    /// By how much texture coordinates are scaled, neither of both below 0.
    scale: [f64; 2],
    has_alpha: bool,
}

/// All pictures of a material: objects named `…Texture` with the index of one, wherever they are.
fn looks(document: &Document<'_>, material: &At<'_>) -> Result<Vec<Look>> {
    let (mut found, mut open) = (Vec::new(), vec![material.clone()]);
    let is_opaque = material.key("alphaMode").is_none_or(|mode| mode.value == "OPAQUE");
    while let Some(at) = open.pop() {
        let Value::Object(object) = at.value else { continue };
        for key in object.keys().filter(|key| *key != "extras") {
            let Some(inner) = at.key(key) else { continue };
            let is_texture = key.ends_with("Texture") && inner.key("index").is_some();
            if is_texture {
                // The alpha of these is looked at by nobody.
                let core =
                    ["metallicRoughnessTexture", "normalTexture", "occlusionTexture", "emissiveTexture"];
                let has_alpha = !(core.contains(&key.as_str()) || key == "baseColorTexture" && is_opaque);
                found.push(look(document, &inner, has_alpha)?);
            } else {
                open.push(inner);
            }
        }
    }
    Ok(found)
}

fn look(document: &Document<'_>, info: &At<'_>, has_alpha: bool) -> Result<Look> {
    let texture = document.named("textures", &info.needed("index")?)?;
    let sources = texture.key("source").into_iter().chain(
        texture.object("extensions")?.into_iter().filter_map(|(_, extension)| extension.key("source")),
    );
    let mut images = Vec::new();
    for source in sources {
        document.named("images", &source)?;
        images.push(source.number()?);
    }
    let transform = info.extension("KHR_texture_transform");
    let scale = transform.as_ref().map(|transform| transform.numbers::<2>("scale")).transpose()?.flatten();
    let scale = scale.unwrap_or([1.0; 2]).map(f64::abs);
    let set = transform.as_ref().map(|transform| transform.count("texCoord")).transpose()?.flatten();
    let set = set.or(info.count("texCoord")?).unwrap_or(0);
    Ok(Look { images, set: u32::try_from(set).unwrap_or(u32::MAX), scale, has_alpha })
}

/// The areas of parts, on the surface and in each set of texture coordinates.
struct Areas {
    surface: Vec<f64>,
    sets: BTreeMap<u32, Vec<f64>>,
}

impl Areas {
    fn new(mesh: &IndexedMesh) -> Self {
        let count = mesh.part_names.len();
        let parts = mesh.attributes.iter().find(|attribute| attribute.semantic == Semantic::Part);
        let part = |t: usize| {
            let value =
                parts.and_then(|parts| parts.at(t, 0).map(|value| parts.values.number(value) as usize));
            value.unwrap_or(0).min(count.saturating_sub(1))
        };
        let mut surface = vec![0.0; count];
        for (t, triangle) in mesh.triangles.iter().enumerate() {
            surface[part(t)] += area(triangle.map(|v| mesh.positions[v as usize]));
        }
        let is_set =
            |a: &&Attribute| (a.semantic, a.domain, a.components) == (Semantic::TexCoord, Domain::Corner, 2);
        let mut sets = BTreeMap::new();
        for attribute in mesh.attributes.iter().filter(is_set) {
            let mut areas = vec![0.0; count];
            for t in 0..mesh.triangles.len() {
                let place = |value: usize| {
                    let number = |k: usize| attribute.values.fraction(2 * value + k, attribute.normalised);
                    [number(0), number(1), 0.0]
                };
                if let [Some(a), Some(b), Some(c)] = [0, 1, 2].map(|k| attribute.at(t, k)) {
                    areas[part(t)] += area([a, b, c].map(place));
                }
            }
            sets.insert(attribute.set, areas);
        }
        Self { surface, sets }
    }

    /// How long on a part the side of the unit square of texture coordinates is; not finite where it has none.
    fn length(&self, part: u32, set: u32) -> f64 {
        let areas = self.sets.get(&set).map_or(0.0, |areas| areas[part as usize]);
        (self.surface[part as usize] / areas).sqrt()
    }
}

fn area([a, b, c]: [[f64; 3]; 3]) -> f64 {
    let [u, v] = [b, c].map(|p| [0, 1, 2].map(|k| p[k] - a[k]));
    let cross = |k: usize, l: usize| u[k] * v[l] - u[l] * v[k];
    0.5 * [cross(1, 2), cross(2, 0), cross(0, 1)].map(|x| x * x).iter().sum::<f64>().sqrt()
}
