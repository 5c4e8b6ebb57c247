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
            // Numbers so large that points of a lattice, or squares of what they lose, are none.
            let (quantisation, error) =
                if error.is_finite() { (quantisation, error) } else { (Quantisation::Raw, 0.0) };
            AttributeEntry::of(attribute, quantisation, error)
        })
    };
    mesh.attributes.iter().map(entry).collect()
}

/// The bits that are asked for.
fn bits(attribute: &Attribute, options: &Options) -> Option<u32> {
    named(attribute, &options.attribute_bits)
}

/// What a list says of an attribute by what it is called, or else by what it is; of several the last.
pub fn named<T: Copy>(attribute: &Attribute, list: &[(String, T)]) -> Option<T> {
    let of = |name: &str| list.iter().rev().find(|(other, _)| other == name).map(|&(_, said)| said);
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
    let names = options.attribute_bits.iter().map(|(name, _)| name);
    let names = names.chain(options.attribute_births.iter().map(|(name, _)| name));
    for name in names.chain(options.attribute_weights.iter().map(|(name, _)| name)) {
        let is_there =
            |attribute: &Attribute| attribute.title() == *name || attribute.semantic.name() == name;
        if !mesh.attributes.iter().any(is_there)
            && Semantic::ALL.iter().all(|semantic| semantic.name() != name)
        {
            return Err(Error::Parameter(format!("the mesh has no attribute {name}")));
        }
    }
    for (name, weight) in &options.attribute_weights {
        if !(weight.is_finite() && *weight >= 0.0) {
            return Err(Error::Parameter(format!(
                "{name}: a weight of {weight}, allowed is what is finite and at least 0"
            )));
        }
    }
    for (name, bits) in &options.attribute_bits {
        if !(1..=24).contains(bits) {
            return Err(Error::Parameter(format!("{name}: {bits} bits, allowed 1 to 24")));
        }
    }
    Ok(())
}

/// Most attributes of a file (spec §3.2).
const MAX_ATTRIBUTES: usize = 64;
