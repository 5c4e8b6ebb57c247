//! What of a glTF is not kept.

use std::collections::BTreeMap;

use serde_json::Value;

use super::document::Document;
use super::draco;
use super::json::At;
use super::meshopt;
use super::primitive::{self, Topology};
use super::scene::{DETAIL, INSTANCING, Scene};
use crate::error::Result;

/// Counts of what is not kept.
#[derive(Default)]
pub(super) struct Notes {
    /// Indices behind the last whole triangle.
    pub left_over: usize,
    /// Vertices of no triangle, where they are not kept.
    pub unused_vertices: usize,
    /// Extensions that name triangles or vertices by number.
    pub lost_extensions: BTreeMap<&'static str, usize>,
    /// Extras and extensions of what is not kept: accessors, buffer views and buffers.
    pub lost_extras: usize,
    /// Extensions that are not known and have numbers that may name accessors or buffer views, which have others now.
    pub unchecked: Vec<String>,
    /// Images that are not there, in words.
    pub lost_images: Vec<String>,
    /// Whether further levels of detail are kept elsewhere.
    pub keeps_detail: bool,
    /// What is no loss, in words.
    pub remarks: Vec<String>,
    /// As [`Source::texels`](crate::formats::Source::texels).
    pub texels: BTreeMap<u32, f64>,
    /// Attributes whose type or number of components is another one now, in words.
    pub retyped: Vec<String>,
}

impl Notes {
    /// What is not kept of a document whose scene is, in words for the user.
    pub(super) fn of_scene(self) -> Vec<String> {
        let counts = [
            ("indices of no whole triangle", self.left_over),
            ("vertices of no triangle", self.unused_vertices),
            ("extras and extensions of accessors, buffer views and buffers", self.lost_extras),
        ];
        let counts = counts.into_iter().filter(|(_, count)| *count > 0);
        let counts = counts.map(|(what, count)| format!("{what} ({count})"));
        let extensions =
            self.lost_extensions.iter().map(|(name, count)| format!("extension {name} ({count})"));
        let unchecked = self.unchecked.iter().map(|name| {
            let name = shortened(name);
            format!("what extension {name} names, if its numbers are those of accessors or buffer views (they have others now)")
        });
        counts.chain(extensions).chain(unchecked).chain(self.lost_images).collect()
    }

    /// What is not kept of a document that is flattened, in words for the user; these meshes of it are shown, here or elsewhere.
    ///
    /// # Errors
    /// Where a mode is none.
    pub(super) fn in_words(
        self,
        document: &Document<'_>,
        scene: &Scene,
        kept: &[usize],
    ) -> Result<Vec<String>> {
        let root = document.root();
        let (mut points, mut lines, mut targets) = (0, 0, 0);
        let meshes = root.list("meshes")?;
        let mut shown = vec![false; meshes.len()];
        scene.instances.iter().for_each(|instance| shown[instance.mesh] = true);
        for mesh in meshes.iter().zip(&shown).filter(|(_, shown)| **shown).map(|(mesh, _)| mesh) {
            for primitive in mesh.list("primitives")? {
                match primitive::topology(&primitive)? {
                    Topology::Points => points += 1,
                    Topology::Lines => lines += 1,
                    _ => targets += primitive.list("targets")?.len(),
                }
            }
        }
        kept.iter().for_each(|&mesh| shown[mesh] = true);
        let unshown = shown.iter().filter(|shown| !**shown).count();
        let listed = |list: &str| root.list(list).map(|list| list.len());
        let scenes = listed("scenes")?.saturating_sub(1);
        let mut found = Found::default();
        found.look(root.value, 0);
        // Of nodes it is kept, of materials not, whose numbers are those of other materials.
        let materials = root.list("materials")?;
        let details = materials.iter().filter(|material| material.extension(DETAIL).is_some()).count();
        if let Some(all) = found.extensions.get_mut(DETAIL) {
            *all = all.saturating_sub(details);
        }
        found.extensions.retain(|name, count| *name != DETAIL || *count > 0 && !self.keeps_detail);
        let counts = [
            ("primitives of points", points),
            ("primitives of lines", lines),
            ("indices of no whole triangle", self.left_over),
            ("meshes that are not shown", unshown),
            ("further scenes", scenes),
            ("nodes, flattened", scene.flattened),
            ("numbers of instances", scene.instance_numbers),
            ("morph targets", targets),
            ("skins", listed("skins")?),
            ("animations", listed("animations")?),
            ("cameras", listed("cameras")?),
            ("materials", listed("materials")?),
            ("levels of detail of materials", details),
            ("textures", listed("textures")?),
            ("images", listed("images")?),
            ("objects with extras", found.extras),
        ];
        let counts = counts.into_iter().filter(|(_, count)| *count > 0);
        let mut words: Vec<String> = counts.map(|(what, count)| format!("{what} ({count})")).collect();
        words.extend(self.retyped);
        let further = found.extensions.len().saturating_sub(MOST_NAMED);
        let named = found.extensions.iter().take(MOST_NAMED);
        words.extend(named.map(|(name, count)| format!("extension {} ({count})", shortened(name))));
        if further > 0 {
            words.push(format!("further extensions ({further})"));
        }
        Ok(words)
    }
}

/// Refuses a document that asks for an extension without which its geometry may be another one.
///
/// # Errors
/// At the extension.
pub(super) fn check_required(root: &At<'_>) -> Result<()> {
    for name in root.list("extensionsRequired")? {
        let text = name.value.as_str().ok_or_else(|| name.fault("not text"))?;
        let harmless = LOOKS.iter().any(|begin| text.starts_with(begin));
        if !harmless && !is_read(text) {
            return Err(name.fault(format!("the extension {} is required, and not read", shortened(text))));
        }
    }
    Ok(())
}

/// Extensions that are not lost.
fn is_read(name: &str) -> bool {
    name == INSTANCING
        || name == QUANTIZATION
        || name == draco::EXTENSION
        || meshopt::EXTENSIONS.contains(&name)
}

/// What an object and all in it have.
#[derive(Default)]
struct Found<'d> {
    extras: usize,
    extensions: BTreeMap<&'d str, usize>,
}

impl<'d> Found<'d> {
    fn look(&mut self, value: &'d Value, depth: usize) {
        // The parser goes no deeper.
        if depth > MOST_DEPTH {
            return;
        }
        match value {
            Value::Array(list) => list.iter().for_each(|value| self.look(value, depth + 1)),
            Value::Object(object) => {
                for (key, value) in object {
                    match key.as_str() {
                        "extras" => self.extras += 1,
                        "extensions" => {
                            let names =
                                value.as_object().into_iter().flatten().filter(|(name, _)| !is_read(name));
                            names.for_each(|(name, _)| *self.extensions.entry(name).or_default() += 1);
                        }
                        _ => self.look(value, depth + 1),
                    }
                }
            }
            _ => {}
        }
    }
}

/// A name of the file for messages: escaped, not too long.
pub(super) fn shortened(name: &str) -> String {
    let shown: String = name.chars().take(MOST_LETTERS).collect();
    let dots = if shown.len() < name.len() { "..." } else { "" };
    format!("{}{dots}", shown.escape_debug())
}

/// Beginnings of the names of extensions that say how things look, or what they are, but not what shape they have.
const LOOKS: [&str; 11] = [
    "KHR_materials_",
    "KHR_techniques_",
    "KHR_texture_",
    "EXT_mesh_features",
    "EXT_structural_metadata",
    "EXT_texture_",
    "MSFT_texture_",
    "KHR_lights_",
    "EXT_lights_",
    "KHR_xmp",
    "KHR_animation_",
];
pub(super) const QUANTIZATION: &str = "KHR_mesh_quantization";

const MOST_NAMED: usize = 24;
const MOST_LETTERS: usize = 80;
const MOST_DEPTH: usize = 128;
