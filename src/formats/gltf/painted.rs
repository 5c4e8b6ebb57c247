//! What the parts of a flattened scene are painted with: base colours, and their pictures.

use std::path::PathBuf;

use super::document::Document;
use super::json::At;
use super::previews;
use crate::error::{Error, Result};
use crate::mesh::paint::{Image, Material, Paint};

/// The paint of parts that have these materials, by their numbers. `remarks` are told of pictures that cannot be had: their surfaces have their
/// colours alone.
///
/// # Errors
/// At the pointer where a material or what it names is at fault; [`Error::Limit`].
pub(super) fn paint(
    document: &Document<'_>,
    of_parts: Vec<Option<usize>>,
    remarks: &mut Vec<String>,
) -> Result<Paint> {
    let list = document.root().list("materials")?;
    let mut images = Images {
        places: Vec::new(),
        images: Vec::new(),
        missing: Vec::new(),
        files: Vec::new(),
        left: previews::ALL_PIXELS,
    };
    let mut materials = vec![Material::default(); list.len()];
    for (k, at) in list.iter().enumerate().filter(|(k, _)| of_parts.contains(&Some(*k))) {
        materials[k] = material(document, at, &mut images)?;
    }
    let (missing, files) = (images.missing, images.files);
    remarks.extend_from_slice(&missing);
    Ok(Paint {
        materials,
        of_parts,
        images: images.images,
        is_linear: true,
        missing,
        files,
        ..Paint::default()
    })
}

/// The pictures so far.
struct Images {
    /// By the numbers of the document's images that have been asked for, their places below, if they can be had.
    places: Vec<(usize, Option<usize>)>,
    images: Vec<Image>,
    /// Those that cannot be had, in words.
    missing: Vec<String>,
    /// The files they were read from.
    files: Vec<PathBuf>,
    /// Pixels that may yet be decoded.
    left: u64,
}

fn material(document: &Document<'_>, at: &At<'_>, images: &mut Images) -> Result<Material> {
    let specular = at.extension("KHR_materials_pbrSpecularGlossiness");
    let (base, names) = match (&specular, at.key("pbrMetallicRoughness")) {
        (Some(specular), _) => (Some(specular.clone()), ["diffuseFactor", "diffuseTexture"]),
        (None, base) => (base, ["baseColorFactor", "baseColorTexture"]),
    };
    let mut material = Material::default();
    let is = |mode: &str| at.key("alphaMode").is_some_and(|said| said.value == mode);
    if is("MASK") {
        let cutoff = at.key("alphaCutoff").and_then(|cutoff| cutoff.value.as_f64());
        material.cutoff = cutoff.unwrap_or(HALF) as f32;
    } else if is("BLEND") {
        material.cutoff = HALF as f32;
    }
    let Some(base) = base else { return Ok(material) };
    if let Some(colour) = base.numbers::<4>(names[0])? {
        material.colour = colour.map(|x| (x as f32).clamp(0.0, 1.0));
    }
    let Some(info) = base.key(names[1]) else { return Ok(material) };
    let texture = document.named("textures", &info.needed("index")?)?;
    // The same picture in a format that others may not know, where it is one.
    let webp = texture.extension("EXT_texture_webp").and_then(|webp| webp.key("source"));
    if let Some(source) = texture.key("source").or(webp) {
        material.image = images.place(document, &source)?;
    }
    let transform = info.extension("KHR_texture_transform");
    let set = transform.as_ref().map(|transform| transform.count("texCoord")).transpose()?.flatten();
    let set = set.or(info.count("texCoord")?).unwrap_or(0);
    material.set = u32::try_from(set).unwrap_or(u32::MAX);
    if let Some(transform) = transform {
        material.transform = rows(&transform)?;
    }
    Ok(material)
}

/// Scaled, then turned, then moved (KHR_texture_transform).
fn rows(transform: &At<'_>) -> Result<[[f32; 3]; 2]> {
    let [x, y] = transform.numbers("offset")?.unwrap_or([0.0; 2]);
    let [u, v] = transform.numbers("scale")?.unwrap_or([1.0; 2]);
    let angle = transform.key("rotation").and_then(|angle| angle.value.as_f64()).unwrap_or(0.0);
    let (sin, cos) = angle.sin_cos();
    Ok([[cos * u, sin * v, x], [-sin * u, cos * v, y]].map(|row| row.map(|x| x as f32)))
}

impl Images {
    /// The place of an image, by the number that names it.
    fn place(&mut self, document: &Document<'_>, number: &At<'_>) -> Result<Option<usize>> {
        let (at, number) = (document.named("images", number)?, number.number()?);
        if let Some((_, place)) = self.places.iter().find(|(known, _)| *known == number) {
            return Ok(*place);
        }
        let place = match self.read(document, &at)? {
            Ok(image) => {
                self.images.push(image);
                Some(self.images.len() - 1)
            }
            Err(why) => {
                self.missing.push(format!("image {number} is not shown: {why}"));
                None
            }
        };
        self.places.push((number, place));
        Ok(place)
    }

    /// An image, or why it cannot be had.
    fn read(&mut self, document: &Document<'_>, at: &At<'_>) -> Result<std::result::Result<Image, String>> {
        let loaded;
        let bytes = match (at.key("bufferView"), at.text("uri")?) {
            (Some(view), _) => document.view(&view)?.bytes,
            (None, Some(uri)) => match document.load(uri, at) {
                Ok(bytes) => {
                    loaded = bytes;
                    self.files.extend(document.path(uri));
                    &loaded
                }
                Err(error @ Error::Limit { .. }) => return Err(error),
                Err(error) => return Ok(Err(error.to_string())),
            },
            (None, None) => return Err(at.fault("an image without `bufferView` and `uri`")),
        };
        let outcome = previews::decoded(bytes, &mut self.left);
        if let Ok(image) = &outcome {
            document.take(image.pixels.len(), size_of::<[u8; 4]>())?;
        }
        Ok(outcome)
    }
}

/// The opacity from which on a surface is drawn that lets things shine through, and the usual cutoff (glTF 2.0, §5.19).
const HALF: f64 = 0.5;

#[cfg(test)]
mod tests {
    use crate::formats::{ReadOptions, read_painted};
    use serde_json::{Value, json};

    /// A triangle of a material.
    fn document(material: Value, more: Value) -> Vec<u8> {
        let zeros = format!("data:application/octet-stream;base64,{}", "A".repeat(48));
        let mut document = json!({
            "asset": { "version": "2.0" }, "scenes": [{ "nodes": [0] }], "scene": 0, "nodes": [{ "mesh": 0 }],
            "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 } }, { "attributes": { "POSITION": 0 }, "material": 1 }] }],
            "accessors": [{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3" }],
            "bufferViews": [{ "buffer": 0, "byteLength": 36 }], "buffers": [{ "uri": zeros, "byteLength": 36 }],
            "materials": [{}, material],
        });
        for (key, value) in more.as_object().unwrap() {
            document[key] = value.clone();
        }
        document.to_string().into_bytes()
    }

    #[test]
    fn parts_have_the_colours_of_their_materials() {
        let material = json!({
            "pbrMetallicRoughness": { "baseColorFactor": [0.25, 0.5, 2.0, 0.75] }, "alphaMode": "MASK", "alphaCutoff": 0.7 });
        let (source, paint) = read_painted(&document(material, json!({})), &ReadOptions::default()).unwrap();
        assert_eq!(source.mesh.triangles.len(), 2);
        assert_eq!((paint.of_parts, paint.images.len(), paint.is_linear), (vec![None, Some(1)], 0, true));
        assert_eq!((paint.materials[1].colour, paint.materials[1].cutoff), ([0.25, 0.5, 1.0, 0.75], 0.7));
        // Nobody has asked for the other one.
        assert_eq!(paint.materials[0], Default::default());
    }

    #[test]
    fn pictures_lie_as_they_are_transformed_and_what_is_none_is_told() {
        let transform = json!({ "offset": [0.5, 0.25], "scale": [2.0, 3.0], "rotation": std::f64::consts::FRAC_PI_2, "texCoord": 1 });
        let info = json!({ "index": 0, "extensions": { "KHR_texture_transform": transform } });
        let material = json!({ "pbrMetallicRoughness": { "baseColorTexture": info }, "alphaMode": "BLEND" });
        let more = |uri: &str| json!({ "textures": [{ "source": 0 }], "images": [{ "uri": uri }] });
        let (source, paint) = read_painted(
            &document(material.clone(), more("data:image/png;base64,AAAA")),
            &ReadOptions::default(),
        )
        .unwrap();
        let painted = paint.materials[1];
        assert_eq!((painted.set, painted.cutoff, painted.image), (1, 0.5, None));
        // (u, v) becomes (3 v + 1/2, 1/4 - 2 u): a quarter to the right of the axis that v goes down by.
        let near = |row: [f32; 3], other: [f32; 3]| row.iter().zip(other).all(|(x, y)| (x - y).abs() < 1e-6);
        assert!(near(painted.transform[0], [0.0, 3.0, 0.5]) && near(painted.transform[1], [-2.0, 0.0, 0.25]));
        assert!(source.remarks[0].starts_with("image 0 is not shown: "), "{:?}", source.remarks);
        let beside = read_painted(&document(material.clone(), more("none.png")), &ReadOptions::default());
        assert!(beside.unwrap().0.remarks[0].contains("none.png"));
        let none = json!({ "textures": [{ "source": 3 }], "images": [] });
        let error = read_painted(&document(material, none), &ReadOptions::default()).unwrap_err();
        assert!(error.to_string().contains("/textures/0/source: names item 3 of /images"), "{error}");
    }
}
