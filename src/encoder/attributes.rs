//! The attributes of the input: how they are quantised.

use super::{Options, constant};
use crate::container::AttributeEntry;
use crate::error::{Error, Result};
use crate::mesh::IndexedMesh;
use crate::mesh::attributes::{Attribute, Quantisation, Semantic};

/// What the table of contents says of each attribute of a mesh.
pub fn entries(mesh: &IndexedMesh, options: &Options) -> Vec<AttributeEntry> {
    let entry = |attribute: &Attribute| {
        let bits = bits(attribute, options);
        let quantisation = Quantisation::choose(attribute, bits, options.exact.is_some());
        let lattice_bits = Quantisation::lattice_bits(attribute, bits);
        constant::entry(attribute, &quantisation, lattice_bits).unwrap_or_else(|| {
            let error = quantisation.error(attribute);
            AttributeEntry::of(attribute, quantisation, error)
        })
    };
    mesh.attributes.iter().map(entry).collect()
}

/// The bits that are asked for, by what the attribute is called, or else by what it is.
fn bits(attribute: &Attribute, options: &Options) -> Option<u32> {
    let of = |name: &str| {
        options.attribute_bits.iter().rev().find(|(other, _)| other == name).map(|&(_, bits)| bits)
    };
    of(&attribute.title()).or_else(|| of(attribute.semantic.name()))
}

/// Whether the mesh has attributes that fit it, and options name those.
///
/// # Errors
/// [`Error::Parameter`].
pub fn check(mesh: &IndexedMesh, options: &Options) -> Result<()> {
    if mesh.attributes.len() > MAX_ATTRIBUTES {
        let what = format!("{} attributes, allowed {MAX_ATTRIBUTES}", mesh.attributes.len());
        return Err(Error::Parameter(what));
    }
    for attribute in &mesh.attributes {
        attribute.check(mesh.triangles.len()).map_err(Error::Parameter)?;
    }
    for (name, bits) in &options.attribute_bits {
        let is_there =
            |attribute: &Attribute| attribute.title() == *name || attribute.semantic.name() == name;
        if !mesh.attributes.iter().any(is_there)
            && Semantic::ALL.iter().all(|semantic| semantic.name() != name)
        {
            return Err(Error::Parameter(format!("the mesh has no attribute {name}")));
        }
        if !(1..=24).contains(bits) {
            return Err(Error::Parameter(format!("{name}: {bits} bits, allowed 1 to 24")));
        }
    }
    Ok(())
}

/// Most attributes of a file (spec §3.2).
const MAX_ATTRIBUTES: usize = 64;
