//! A mesh without a scene as a glTF of one material with a picture.

use std::io::{self, Write};

use serde_json::{Value, json};

use super::files::{self, File};
use super::write::GltfFiles;
use super::{glb, plain};
use crate::formats::write::check;
use crate::mesh::IndexedMesh;

/// A picture for a whole mesh, by its first texture coordinates.
#[derive(Clone, Copy, Debug)]
pub struct Texture<'a> {
    /// A PNG file.
    pub png: &'a [u8],
    /// The opacity below which nothing is seen; 0 where all is.
    pub cutoff: f32,
}

/// As [`write_glb`](super::write_glb), with a picture on it, which is in the file. Looks at it go from texel to texel, and not to smaller versions: it
/// is a map without room for these.
///
/// # Errors
/// As [`write_glb`](super::write_glb).
pub fn write_textured_glb(mesh: &IndexedMesh, texture: &Texture, out: &mut impl Write) -> io::Result<()> {
    check(mesh)?;
    let (mut json, mut binary) = plain::document(mesh)?;
    paint(&mut json, texture);
    binary.resize(binary.len().next_multiple_of(4), 0);
    let view = json!({ "buffer": 0, "byteOffset": binary.len(), "byteLength": texture.png.len() });
    binary.extend_from_slice(texture.png);
    let number = match &mut json["bufferViews"] {
        Value::Array(views) => {
            views.push(view);
            views.len() - 1
        }
        none => {
            *none = json!([view]);
            0
        }
    };
    json["images"] = json!([{ "bufferView": number, "mimeType": "image/png" }]);
    json["buffers"] = json!([{ "byteLength": binary.len() }]);
    glb::write(&json, &binary, out)
}

/// As [`gltf_files`](super::gltf_files), with a picture on it, of which `name` is the path from the glTF's folder; it is not among the files.
///
/// # Errors
/// As [`gltf_files`](super::gltf_files).
pub fn textured_gltf_files(
    mesh: &IndexedMesh,
    texture: &Texture,
    name: &str,
    stem: &str,
) -> io::Result<GltfFiles> {
    check(mesh)?;
    let (mut json, bytes) = plain::document(mesh)?;
    paint(&mut json, texture);
    let folders: Vec<String> = name.split('/').map(files::uri).collect();
    json["images"] = json!([{ "uri": folders.join("/") }]);
    let mut beside = Vec::new();
    if !bytes.is_empty() {
        let name = format!("{stem}.bin");
        json["buffers"][0]["uri"] = files::uri(&name).into();
        beside.push(File { name, bytes });
    }
    Ok(GltfFiles {
        json: serde_json::to_vec_pretty(&json).map_err(io::Error::other)?,
        beside,
        remarks: vec![],
    })
}

/// All primitives are of one material, and that has the first image.
fn paint(json: &mut Value, texture: &Texture) {
    let mut material = json!({
        "name": "baked",
        "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 }, "metallicFactor": 0.0, "roughnessFactor": 1.0 },
    });
    if texture.cutoff > 0.0 {
        material["alphaMode"] = "MASK".into();
        material["alphaCutoff"] = texture.cutoff.into();
    }
    json["materials"] = json!([material]);
    json["textures"] = json!([{ "sampler": 0, "source": 0 }]);
    json["samplers"] =
        json!([{ "magFilter": LINEAR, "minFilter": LINEAR, "wrapS": CLAMP_TO_EDGE, "wrapT": CLAMP_TO_EDGE }]);
    let meshes = json["meshes"].as_array_mut().into_iter().flatten();
    for primitive in meshes.filter_map(|mesh| mesh["primitives"].as_array_mut()).flatten() {
        primitive["material"] = 0.into();
    }
}

const LINEAR: u32 = 9729;
const CLAMP_TO_EDGE: u32 = 33071;
