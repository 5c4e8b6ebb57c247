//! glTF 2.0 (Khronos; ISO/IEC 12113), binary (`.glb`) or text with buffers beside it or in it: what shape its scene has.
//!
//! A [`Document`] is the file as it is, its JSON whole, and numbers are read through its accessors. From it comes one mesh in either of two
//! ways. As a scene (`layout`) every mesh is there once, in coordinates of its own, each primitive a part, and beside it are nodes, materials
//! and the rest of the JSON, with the buffers that it needs (`carried`; spec §14). Flattened, for whoever wants a mesh alone, every mesh is
//! there as often as the scene shows it and where it does, in binary64:
//!
//! - Triangles of a mesh that a negative scale mirrors are turned round; normals go by the inverse transpose, tangents by the matrix, the
//!   sign of the bitangent with the mirror. Where nodes move and scale alone, both stay bit for bit.
//! - A skinned mesh is where its node is, as it is stored; morphs are not applied.
//! - Texture coordinates have v upwards, as in all other formats: 1 - v of the glTF's.
//! - `_NAME` and other attributes that glTF gives no meaning are generic ones by their names. One that only some primitives have is partial.
//! - Each primitive is a part, by the names of its mesh and material.

mod accessor;
mod bodies;
mod canonical;
mod carried;
mod column;
mod composed;
mod document;
mod draco;
mod exponent;
mod files;
mod flatten;
mod geometry;
mod glb;
mod images;
mod json;
mod ktx;
mod layout;
mod lighter;
mod meshopt;
mod notes;
mod pack;
mod painted;
mod plain;
mod previews;
mod primitive;
mod quantised;
mod references;
#[cfg(feature = "encode")]
mod sample;
mod scene;
mod shaped;
mod texels;
mod textured;
mod transform;
mod turned;
mod unknown;
mod uri;
mod weights;
mod write;

use self::document::Document;
use self::flatten::Flattened;
use self::layout::Layout;
use self::notes::Notes;
use self::scene::Scene;
use super::{Coordinates, Format, ReadOptions, Source, text};
use crate::error::{Error, Result};
use crate::mesh::{IndexedMesh, Paint};

pub use bodies::in_bodies;
pub use files::File;
pub use lighter::{Lighter, lighter};
pub(super) use previews::{ALL_PIXELS, decoded};
#[cfg(feature = "encode")]
pub use sample::sample_scene;
pub use textured::{Texture, textured_gltf_files, write_textured_glb};
pub use turned::turn_v;
pub(super) use uri::within;
pub use write::{
    GltfFiles, SceneOptions, gltf_files, placed, write_glb, write_levels_of_detail, write_progressive,
    write_scene,
};

/// Whether the content is glTF: binary by its first bytes; text by its first object, which tells of an asset and its version.
pub(super) fn is_gltf(bytes: &[u8]) -> bool {
    if glb::is_glb(bytes) {
        return true;
    }
    let first = &bytes[text::byte_order_mark(bytes)..];
    let first = first[..first.len().min(LOOKED_AT)].trim_ascii_start();
    let has = |word: &[u8]| first.windows(word.len()).any(|window| window == word);
    // `asset` may stand at the end; other words of glTF seldom stand elsewhere.
    first.starts_with(b"{") && WORDS.iter().any(|word| has(word))
}

/// Reads the scene of a glTF file as one mesh; and what it is painted with, if that is wanted.
///
/// # Errors
/// At the byte, the line or the JSON pointer where the file is at fault; [`Error::Limit`] beyond the memory that is allowed.
pub(super) fn read(bytes: &[u8], options: &ReadOptions, paint: Option<&mut Paint>) -> Result<Source> {
    match scene(bytes, options, paint) {
        Err(Error::Input(mut fault)) => {
            fault.file.clone_from(&options.name);
            Err(fault.into())
        }
        outcome => outcome,
    }
}

fn scene(bytes: &[u8], options: &ReadOptions, paint: Option<&mut Paint>) -> Result<Source> {
    let document = Document::parse(bytes, options.folder.clone(), options.max_memory)?;
    if !options.force {
        notes::check_required(&document.root())?;
    }
    let scene = Scene::new(&document, options.detail.unwrap_or(0))?;
    let mut notes = Notes::default();
    if options.scenes {
        return kept(&document, &scene, notes);
    }
    let Flattened { mut mesh, left_out, materials } = flatten::flatten(&document, &scene, &mut notes)?;
    // Pictures lie as glTF has them.
    if paint.is_none() {
        turn_v(&mut mesh);
    }
    // What another level of detail shows is not lost, where there is to be one of each.
    let mut shown: Vec<usize> = scene.instances.iter().map(|instance| instance.mesh).collect();
    if options.detail.is_some() {
        for detail in 0..scene::levels_of_detail(&document)? {
            shown.extend(Scene::new(&document, detail)?.instances.iter().map(|instance| instance.mesh));
        }
        notes.keeps_detail = true;
    }
    let mut dropped = notes.in_words(&document, &scene, &shown)?;
    dropped.extend(left_out);
    let mut source = source(mesh, dropped);
    if let Some(paint) = paint {
        *paint = painted::paint(&document, materials, &mut source.remarks)?;
    }
    Ok(source)
}

/// See [`levels_of_detail`](super::levels_of_detail).
pub(super) fn levels_of_detail(bytes: &[u8], options: &ReadOptions) -> Result<usize> {
    scene::levels_of_detail(&Document::parse(bytes, options.folder.clone(), options.max_memory)?)
}

/// The scene as it is.
fn kept(document: &Document<'_>, scene: &Scene, mut notes: Notes) -> Result<Source> {
    let Layout { mesh, parts, left_out } = layout::lay_out(document, scene, &mut notes)?;
    let carried = carried::carry(document, &mesh, &parts, &mut notes)?;
    let remarks = std::mem::take(&mut notes.remarks);
    let texels = std::mem::take(&mut notes.texels);
    let mut dropped = notes.of_scene();
    dropped.extend(left_out);
    Ok(Source { remarks, scene: Some(carried), texels, ..source(mesh, dropped) })
}

fn source(mesh: IndexedMesh, dropped: Vec<String>) -> Source {
    let is_binary32 = mesh.positions.as_flattened().iter().all(|&x| f64::from(x as f32) == x);
    let coordinates = if is_binary32 { Coordinates::Float32 } else { Coordinates::Float64 };
    Source { dropped, ..Source::new(mesh, Format::Gltf, coordinates) }
}

/// See [`unwritten`](super::unwritten).
pub(super) fn unwritten(mesh: &IndexedMesh) -> Vec<String> {
    plain::unwritten(mesh)
}

const LOOKED_AT: usize = 4096;
const WORDS: [&[u8]; 4] = [b"\"asset\"", b"\"bufferViews\"", b"\"accessors\"", b"\"extensionsUsed\""];
