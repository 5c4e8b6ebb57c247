//! Whether the attributes of a decoded mesh are those of the mesh it was made from.

use super::triangles::Zeros;
use anyhow::bail;
use std::hash::{DefaultHasher, Hash, Hasher};
use unweld::container::AttributeEntry;
use unweld::mesh::attributes::{Quantisation, Values};
use unweld::mesh::{Attribute, IndexedMesh};

/// The attributes of a mesh that a file has, by its table of contents, as it has them; and the titles of those that it has not.
///
/// # Errors
/// Where the file has one that the mesh has not.
pub fn as_coded(
    mesh: &IndexedMesh,
    entries: &[AttributeEntry],
) -> anyhow::Result<(Vec<Attribute>, Vec<String>)> {
    let mut left: Vec<&Attribute> = mesh.attributes.iter().collect();
    let mut coded = Vec::with_capacity(entries.len());
    for entry in entries {
        let is_it = |attribute: &&Attribute| {
            (attribute.title(), attribute.domain, attribute.components, attribute.values.stored())
                == (entry.title(), entry.domain, entry.components, entry.stored)
        };
        let Some(found) = left.iter().position(is_it) else {
            bail!("it has no attribute {} of that kind", entry.title())
        };
        coded.push(rounded(left.remove(found), entry));
    }
    Ok((coded, left.into_iter().map(Attribute::title).collect()))
}

/// An attribute with its values as quantisation leaves them.
fn rounded(attribute: &Attribute, entry: &AttributeEntry) -> Attribute {
    let mut values = Values::new(entry.stored);
    let mut integers = Vec::new();
    for k in 0..attribute.count() {
        // What is no such value would be made one: there is no other on its lattice.
        if matches!(entry.quantisation, Quantisation::Lattice { step: 0.0, .. })
            && lost(attribute, k, entry) > entry.error
        {
            (0..entry.components)
                .for_each(|i| values.push_bits(attribute.values.bits(entry.components * k + i)));
            continue;
        }
        integers.clear();
        entry.quantisation.quantise(attribute, k, &mut integers);
        entry.quantisation.value(&integers, entry.components, &mut values);
    }
    Attribute { values, ..attribute.clone() }
}

/// How far a value is from the one point of a lattice.
fn lost(attribute: &Attribute, value: usize, entry: &AttributeEntry) -> f64 {
    let Quantisation::Lattice { origin, .. } = &entry.quantisation else { return 0.0 };
    let mut point = Values::new(entry.stored);
    origin.iter().for_each(|&x| point.push(x));
    let n = entry.components;
    let off = |k: usize| attribute.values.number(n * value + k) - point.number(k);
    (0..n).map(|k| off(k) * off(k)).sum::<f64>().sqrt()
}

/// Which attribute differs between two meshes of the same triangles, and at how many of them, if one does. `ordered`: the triangles are in the
/// same order.
pub fn differ(mesh: &IndexedMesh, expected: &IndexedMesh, zeros: Zeros, ordered: bool) -> Option<String> {
    for (a, b) in mesh.attributes.iter().zip(&expected.attributes) {
        let [mut here, mut there] = [prints(mesh, a, zeros), prints(expected, b, zeros)];
        if !ordered {
            here.sort_unstable();
            there.sort_unstable();
        }
        let apart = if ordered {
            here.iter().zip(&there).filter(|(x, y)| x != y).count()
        } else {
            missing(&here, &there)
        };
        if apart > 0 {
            return Some(format!(
                "{} differs at {}",
                a.title(),
                super::numbers::count(apart as u64, "triangle")
            ));
        }
    }
    None
}

/// How many of the second list, sorted as the first, are not in the first.
fn missing(here: &[u64], there: &[u64]) -> usize {
    let mut here = here.iter().peekable();
    there
        .iter()
        .filter(|&print| {
            while here.next_if(|other| *other < print).is_some() {}
            here.next_if(|other| *other == print).is_none()
        })
        .count()
}

/// What tells triangles apart by their places and an attribute, from whichever corner they begin.
fn prints(mesh: &IndexedMesh, attribute: &Attribute, zeros: Zeros) -> Vec<u64> {
    let corner = |t: usize, k: usize| {
        let mut hasher = DefaultHasher::new();
        mesh.positions[mesh.triangles[t][k] as usize].map(|x| zeros.bits(x)).hash(&mut hasher);
        let n = attribute.components;
        let value = attribute
            .at(t, k)
            .map(|value| (0..n).map(|i| attribute.values.bits(n * value + i)).collect::<Vec<_>>());
        value.hash(&mut hasher);
        hasher.finish()
    };
    let print = |t: usize| {
        let [a, b, c] = [0, 1, 2].map(|k| corner(t, k));
        // Two corners may be alike.
        let least = [[a, b, c], [b, c, a], [c, a, b]].into_iter().min();
        let mut hasher = DefaultHasher::new();
        least.hash(&mut hasher);
        hasher.finish()
    };
    (0..mesh.triangles.len()).map(print).collect()
}
