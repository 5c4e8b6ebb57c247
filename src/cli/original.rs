//! Whether a decoded mesh is the one it was made from: as surfaces, or as lists; on the lattice, or to the last bit.

use super::attributes;
use super::numbers::{count, grouped};
use super::triangles::{Fingerprint, Zeros, difference};
use super::uwm::Uwm;
use anyhow::bail;
use std::collections::HashSet;
use unweld::container::Metadata;
use unweld::mesh::topology::Weld;
use unweld::mesh::{Attribute, IndexedMesh, Lattice};

/// Whether `mesh` is `original`, as exactly as the file claims; `lines` gets what was found.
///
/// # Errors
/// How they differ, with the name of the file.
pub fn compare(
    uwm: &mut Uwm,
    mesh: &IndexedMesh,
    original: &IndexedMesh,
    original_name: &str,
    lines: &mut Vec<String>,
) -> anyhow::Result<()> {
    let weld = welding(uwm.metadata()?.as_ref());
    let contents = &uwm.contents;
    let lattice = &contents.header.lattice;
    let (exact, ordered) = (!contents.correction().is_empty(), !contents.order().is_empty());
    let expected = if exact { None } else { Some(on_lattice(original, weld, lattice)) };
    let expected = expected.as_ref().unwrap_or(original);
    let differs = |what: String| anyhow::anyhow!("{}: not {original_name}: {what}", uwm.name);
    let zeros = if exact { Zeros::Apart } else { Zeros::Alike };
    if ordered && let Some(what) = lists_differ(mesh, expected, zeros) {
        return Err(differs(what));
    }
    if Fingerprint::of(mesh, zeros) != Fingerprint::of(expected, zeros) {
        let Some(d) = difference(expected, mesh, zeros) else { bail!("{}: not {original_name}", uwm.name) };
        let [a, b, c] = d.example.map(|[x, y, z]| format!("({x}, {y}, {z})"));
        let example = if d.example_is_missing { "missing" } else { "extra" };
        let (missing, extra) = (grouped(d.missing as u64), grouped(d.extra as u64));
        return Err(differs(format!(
            "{missing} triangles missing, {extra} extra; {example} for example {a} {b} {c}"
        )));
    }
    let (coded, left_out) =
        attributes::as_coded(original, &contents.attributes).map_err(|what| differs(what.to_string()))?;
    let names: Vec<String> = coded.iter().map(Attribute::title).collect();
    let expected = IndexedMesh { attributes: coded, ..expected.clone() };
    if let Some(what) = attributes::differ(mesh, &expected, zeros, ordered) {
        return Err(differs(what));
    }
    if exact && let Some([x, y, z]) = lost_vertex(mesh, original) {
        return Err(differs(format!("there is no vertex at ({x}, {y}, {z})")));
    }
    let triangles = count(original.triangles.len() as u64, "triangle");
    let what = match ordered {
        true => {
            format!("{} and {triangles}, in the same order", count(original.positions.len() as u64, "vertex"))
        }
        false => triangles,
    };
    let how = match weld {
        _ if exact => "bit for bit".to_owned(),
        Weld::Within(distance) => {
            format!(
                "to the lattice of {} bits, vertices within {distance} of each other being one",
                lattice.bits
            )
        }
        _ => format!("to the lattice of {} bits", lattice.bits),
    };
    lines.push(format!("original    {original_name}: the same {what}, {how}"));
    if !names.is_empty() {
        lines.push(format!("attributes  {}: the same at every corner, to their bits", names.join(", ")));
    }
    if !left_out.is_empty() {
        lines.push(format!("left out    {}", left_out.join(", ")));
    }
    Ok(())
}

/// Where the lists of two meshes differ.
pub fn lists_differ(mesh: &IndexedMesh, other: &IndexedMesh, zeros: Zeros) -> Option<String> {
    let counts = |mesh: &IndexedMesh| [mesh.positions.len(), mesh.triangles.len()];
    if counts(mesh) != counts(other) {
        let told = |[vertices, triangles]: [usize; 2]| {
            format!("{} and {}", count(vertices as u64, "vertex"), count(triangles as u64, "triangle"))
        };
        return Some(format!("{}, not {}", told(counts(mesh)), told(counts(other))));
    }
    let same = |x: &[f64; 3], y: &[f64; 3]| x.map(|x| zeros.bits(x)) == y.map(|y| zeros.bits(y));
    let positions = mesh.positions.iter().zip(&other.positions);
    if let Some((v, (x, y))) = positions.enumerate().find(|(_, (x, y))| !same(x, y)) {
        return Some(format!("vertex {v} is at {x:?}, not {y:?}"));
    }
    let triangles = mesh.triangles.iter().zip(&other.triangles);
    let (t, (x, y)) = triangles.enumerate().find(|(_, (x, y))| x != y)?;
    Some(format!("triangle {t} is {x:?}, not {y:?}"))
}

/// A position that no vertex has any more.
fn lost_vertex(mesh: &IndexedMesh, original: &IndexedMesh) -> Option<[f64; 3]> {
    // Vertices that differ in nothing but zeros were welded.
    let bits = |p: &[f64; 3]| p.map(|x| Zeros::Alike.bits(x));
    let mut used = vec![false; original.positions.len()];
    original.triangles.iter().flatten().for_each(|&v| used[v as usize] = true);
    let mut loose = original.positions.iter().zip(used).filter(|(_, used)| !used).map(|(p, _)| p).peekable();
    loose.peek()?;
    let there: HashSet<_> = mesh.positions.iter().map(bits).collect();
    loose.find(|p| !there.contains(&bits(p))).copied()
}

/// A mesh as the file has it, if it has no correction: nearly equal vertices are in one place, on the lattice.
fn on_lattice(mesh: &IndexedMesh, weld: Weld, lattice: &Lattice) -> IndexedMesh {
    let stand_for = weld.representatives(mesh, lattice);
    let positions = stand_for.iter().map(|&v| {
        let p = mesh.positions[v as usize];
        // What is far from the lattice, or has none, is kept as it is.
        lattice.point(p).map_or(p, |q| lattice.position(q))
    });
    IndexedMesh::new(positions.collect(), mesh.triangles.clone())
}

/// Which vertices of the input were one, as the file's settings have it.
fn welding(metadata: Option<&Metadata>) -> Weld {
    let settings = metadata.map_or(&[][..], |metadata| &metadata.settings);
    let told = settings.iter().find(|(name, _)| name == "weld");
    told.and_then(|(_, value)| value.parse().ok()).unwrap_or_default()
}
