//! What the command line says of attributes: which to leave out, and how exact the others are.

use unweld::mesh::IndexedMesh;
use unweld::mesh::attributes::{Attribute, Semantic};

/// Which attributes a file keeps, and how.
#[derive(clap::Args)]
pub struct Choice {
    /// Bits of the numbers of attributes, 1 to 24, by their names or by normal, tangent, uv, color, weights, generic; where not given, 12 for uv
    /// and weights, 10 for normals and tangents, and integers are kept as they are
    #[arg(long, value_name = "NAME=N,...", value_delimiter = ',', value_parser = bits)]
    bits: Vec<(String, u32)>,
    /// Attributes to leave out, by their names or by normal, tangent, uv, color, joints, weights, part, generic; all for all
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    drop: Vec<String>,
}

impl Choice {
    /// Bits as the library wants them, of those attributes that a mesh has: one command serves many meshes.
    pub fn bits(&self, mesh: &IndexedMesh) -> Vec<(String, u32)> {
        let is_there =
            |(name, _): &&(String, u32)| mesh.attributes.iter().any(|attribute| is(attribute, name));
        self.bits.iter().filter(is_there).cloned().collect()
    }

    /// Takes out what is to be left out. Returns what went, in words for the user.
    pub fn drop_from(&self, mesh: &mut IndexedMesh) -> Vec<String> {
        let goes = |attribute: &Attribute| self.drop.iter().any(|name| name == "all" || is(attribute, name));
        let (gone, kept) = std::mem::take(&mut mesh.attributes).into_iter().partition(goes);
        mesh.attributes = kept;
        let gone: Vec<Attribute> = gone;
        if gone.iter().any(|attribute| attribute.semantic == Semantic::Part) {
            mesh.part_names.clear();
            mesh.libraries.clear();
        }
        gone.iter().map(|attribute| format!("{} (as asked for)", attribute.title())).collect()
    }

    /// Names and values as they are given.
    pub fn settings(&self) -> Vec<(String, String)> {
        let bits: Vec<String> = self.bits.iter().map(|(name, bits)| format!("{name}={bits}")).collect();
        let lists = [("bits", bits.join(",")), ("drop", self.drop.join(","))];
        lists
            .into_iter()
            .filter(|(_, list)| !list.is_empty())
            .map(|(name, list)| (name.to_owned(), list))
            .collect()
    }
}

fn is(attribute: &Attribute, name: &str) -> bool {
    attribute.title() == name || attribute.semantic.name() == name
}

fn bits(text: &str) -> Result<(String, u32), String> {
    let (name, bits) = text.rsplit_once('=').ok_or("NAME=N is wanted, as in uv=12")?;
    let bits = bits.parse().ok().filter(|bits| (1..=24).contains(bits)).ok_or("allowed are 1 to 24 bits")?;
    Ok((name.to_owned(), bits))
}
