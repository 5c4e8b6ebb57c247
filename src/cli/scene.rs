//! Scenes on the command line: what of them goes into a file, where, and what is told of it.

use super::numbers::{count, memory};
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;
use unweld::container::ResourceKind;
use unweld::encoder::{AttributeBirth, Place, Resource};
use unweld::formats::{Role, Scene};
use unweld::mesh::IndexedMesh;
use unweld::mesh::attributes::{Attribute, Domain, Semantic};

/// The resources of a file that has this scene.
pub fn resources(scene: &Scene) -> Vec<Resource> {
    let json = Resource { kind: ResourceKind::Scene, place: Place::Base, bytes: scene.json.clone() };
    let buffers = scene.buffers.iter().map(|buffer| {
        let place = match buffer.useful_from {
            f64::INFINITY => Place::Base,
            error if error > 0.0 => Place::Error(error),
            _ => Place::Finest,
        };
        Resource { kind: ResourceKind::Buffer, place, bytes: buffer.bytes.clone() }
    });
    std::iter::once(json).chain(buffers).collect()
}

/// Where attributes of a scene's mesh are born beside what is `said`: parts at the base, so that each level can be taken apart.
pub fn births(said: Vec<(String, AttributeBirth)>) -> Vec<(String, AttributeBirth)> {
    let mut births = said;
    births.push((Semantic::Part.name().to_owned(), AttributeBirth::Base));
    births
}

/// Bits of texture coordinates of a scene's mesh beside what is `said`: as many as each part would have by itself where it is not less than a
/// whole picture that it shows, for one part may have a picture many times over, and another one only once; and so many that a step of
/// their lattice is no longer than a texel of the finest picture, told by set, for half of that is how far off a picture may be.
pub fn bits(mesh: &IndexedMesh, texels: &BTreeMap<u32, f64>, said: Vec<(String, u32)>) -> Vec<(String, u32)> {
    let parts = mesh.attributes.iter().find(|attribute| attribute.semantic == Semantic::Part);
    let is_uv = |a: &&Attribute| {
        (a.semantic, a.domain) == (Semantic::TexCoord, Domain::Corner) && a.values.stored().is_float()
    };
    let wanted =
        mesh.attributes.iter().filter(is_uv).filter_map(|uv| {
            Some((uv.title(), wanted_bits(mesh, uv, parts?, texels.get(&uv.set).copied())?))
        });
    let mut all: Vec<(String, u32)> = wanted.filter(|(_, bits)| *bits > UV_BITS).collect();
    // Of several the last counts.
    all.retain(|(title, _)| said.iter().all(|(name, _)| name != Semantic::TexCoord.name() && name != title));
    all.extend(said);
    all
}

/// The bits that texture coordinates want, so that all parts have enough.
fn wanted_bits(mesh: &IndexedMesh, uv: &Attribute, parts: &Attribute, texel: Option<f64>) -> Option<u32> {
    let none = [f64::INFINITY, f64::NEG_INFINITY];
    let mut of_parts = vec![vec![none; uv.components]; parts.count()];
    for t in 0..mesh.triangles.len() {
        let Some(part) = parts.at(t, 0) else { continue };
        for value in (0..3).filter_map(|place| uv.at(t, place)) {
            for (k, [least, most]) in of_parts[part].iter_mut().enumerate() {
                let x = uv.values.number(uv.components * value + k);
                (*least, *most) = (least.min(x), most.max(x));
            }
        }
    }
    let range = |list: &[[f64; 2]]| list.iter().map(|[least, most]| most - least).fold(0.0, f64::max);
    let least =
        of_parts.iter().map(|of| range(of)).filter(|range| range.is_finite()).map(|range| range.max(1.0));
    let least = least.reduce(f64::min)?;
    let whole = |k: usize| {
        of_parts.iter().map(|of| of[k]).fold(none, |[a, b], [least, most]| [a.min(least), b.max(most)])
    };
    let whole = range(&(0..uv.components).map(whole).collect::<Vec<_>>());
    let of_parts = whole / (least * NEARLY);
    let of_texels = texel.map_or(0.0, |texel| whole / (texel * f64::from(1 << UV_BITS) * NEARLY));
    let further = of_parts.max(of_texels).log2().ceil();
    further.is_finite().then(|| UV_BITS + further.clamp(0.0, 8.0) as u32)
}

/// What a scene has beside its mesh.
pub struct Contents {
    /// How many of each, by the names of glTF's lists.
    counts: Vec<(&'static str, usize)>,
    parts: usize,
    /// Bytes of originals of images, of previews, and of all else.
    images: u64,
    previews: u64,
    binary: u64,
}

impl Contents {
    /// Looks at a scene; its mesh has so many parts.
    pub fn new(scene: &Scene, parts: usize) -> Self {
        let json: Value = serde_json::from_slice(&scene.json).unwrap_or_default();
        let counts = LISTS.map(|(list, _)| (list, json[list].as_array().map_or(0, Vec::len)));
        let mut contents = Self { counts: counts.to_vec(), parts, images: 0, previews: 0, binary: 0 };
        for buffer in &scene.buffers {
            let bytes = match buffer.role {
                Role::Original { .. } => &mut contents.images,
                Role::Preview { .. } => &mut contents.previews,
                Role::Binary => &mut contents.binary,
            };
            *bytes += buffer.bytes.len() as u64;
        }
        contents
    }

    /// For people.
    pub fn text(&self) -> String {
        let mut words = vec![count(self.parts as u64, "part")];
        for ((_, n), (_, noun)) in self.counts.iter().zip(LISTS).filter(|((_, n), _)| *n > 0) {
            words.push(count(*n as u64, noun));
        }
        let bytes = [("images", self.images), ("previews", self.previews), ("other buffers", self.binary)];
        let bytes = bytes.iter().filter(|(_, bytes)| *bytes > 0);
        words.extend(bytes.map(|(what, bytes)| format!("{what} of {}", memory(*bytes))));
        words.join(", ")
    }

    /// For programs.
    pub fn json(&self) -> Value {
        let counts = self.counts.iter().map(|(list, n)| ((*list).to_owned(), json!(n)));
        let mut object: Map<String, Value> = counts.collect();
        object.insert("parts".to_owned(), json!(self.parts));
        let bytes = json!({"images": self.images, "previews": self.previews, "other": self.binary});
        object.insert("bytes".to_owned(), bytes);
        Value::Object(object)
    }
}

/// Lists of a glTF, and what there is in each.
pub const LISTS: [(&str, &str); 8] = [
    ("nodes", "node"),
    ("meshes", "mesh"),
    ("materials", "material"),
    ("textures", "texture"),
    ("images", "image"),
    ("skins", "skin"),
    ("animations", "animation"),
    ("cameras", "camera"),
];
/// Bits of texture coordinates where nothing is said.
const UV_BITS: u32 = 12;
/// By how much steps may be longer than is wanted.
const NEARLY: f64 = 1.5;

#[cfg(test)]
mod tests {
    use super::*;
    use unweld::mesh::attributes::Values;

    #[test]
    fn tiles_do_not_take_bits_from_others() {
        let of = |ranges: &[f32]| {
            let mut mesh = IndexedMesh::new(vec![[0.0; 3]; 3], vec![[0, 1, 2]; ranges.len()]);
            let uv = ranges.iter().flat_map(|&range| [0.0, 0.0, range, 0.0, 0.0, range / 2.0]).collect();
            let corners = (0..3 * ranges.len() as u32).collect();
            mesh.attributes.push(Attribute::parts(&(0..ranges.len() as u32).collect::<Vec<_>>()));
            mesh.attributes.push(Attribute::new(Semantic::TexCoord, 2, Values::F32(uv), corners));
            mesh
        };
        let told =
            |ranges: &[f32]| bits(&of(ranges), &BTreeMap::new(), vec![]).first().map(|(_, bits)| *bits);
        assert_eq!((told(&[1.0]), told(&[40.0]), told(&[1.2, 0.1])), (None, None, None));
        // A step of a tile's 4,096th, or nearly: 2^5 times 1.5 is more than 40.
        assert_eq!(
            (told(&[40.0, 0.5]), told(&[40.0, 20.0]), told(&[1e6, 1.0])),
            (Some(17), Some(13), Some(20))
        );
        // A picture of 8,192 pixels, one of 4,096, one of 256 that lies there thirty times.
        let laid = |pixels: f64| bits(&of(&[1.0]), &BTreeMap::from([(0, 1.0 / pixels)]), vec![]);
        assert_eq!(laid(8192.0), [("uv".to_owned(), 13)]);
        assert_eq!((laid(4096.0), laid(30.0 * 256.0)), (vec![], laid(8192.0)));
        assert_eq!(bits(&of(&[40.0, 0.5]), &BTreeMap::new(), vec![("uv".into(), 9)]), [("uv".to_owned(), 9)]);
    }
}
