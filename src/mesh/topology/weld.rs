//! The first steps of conditioning: vertices in the same place become one; triangles no manifold can hold step aside.

use bitvec::vec::BitVec;

use crate::mesh::buckets;
use crate::mesh::index::Vertex;

/// Which vertices of the input are the same vertex.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Weld {
    /// Those with exactly equal coordinates; -0.0 equals 0.0, and a NaN equals a NaN of the same bits.
    #[default]
    Exact,
    /// Those with the same index.
    None,
}

/// For each vertex the first one that is the same.
pub(crate) fn representatives(positions: &[[f64; 3]], weld: Weld) -> Vec<u32> {
    let mut same: Vec<u32> = (0..positions.len() as u32).collect();
    if weld == Weld::None {
        return same;
    }
    // Adding 0.0 turns -0.0 into 0.0 and leaves every other number as it is.
    let bits = |v: u32| positions[v as usize].map(|x| (x + 0.0).to_bits());
    let mut keys: Vec<(u64, u32)> = same.iter().map(|&v| (mix(bits(v)), v)).collect();
    keys.sort_unstable();
    for chunk in keys.chunk_by_mut(|x, y| x.0 == y.0) {
        // Positions with the same key are nearly always equal, but need not be.
        chunk.sort_unstable_by_key(|&(_, v)| (bits(v), v));
        for equal in chunk.chunk_by(|x, y| bits(x.1) == bits(y.1)) {
            for &(_, v) in equal {
                same[v as usize] = equal[0].1;
            }
        }
    }
    same
}

/// The triangles, sorted out; all vertices are representatives.
pub(super) struct SortedOut {
    /// Corners of the triangles with three different vertices, each set of vertices once; in the order of the input.
    pub kept: Vec<[Vertex; 3]>,
    /// The other triangles, in the order of the input.
    pub residue: Vec<[u32; 3]>,
    /// For each triangle of the input whether it is among the first.
    pub is_kept: BitVec,
    /// How many of the residue have two corners on one vertex.
    pub degenerate: usize,
    /// How many of the residue repeat another triangle.
    pub repeated: usize,
}

/// Sets aside triangles with two equal corners and those whose vertices, in any order, are those of an earlier one.
pub(super) fn set_aside(triangles: &[[u32; 3]], same: &[u32]) -> SortedOut {
    let welded = |t: usize| triangles[t].map(|v| same[v as usize]);
    let is_degenerate = |[a, b, c]: [u32; 3]| a == b || b == c || c == a;
    let ordinary = (0..triangles.len()).filter(|&t| !is_degenerate(welded(t)));
    let mut sets: Vec<([u32; 3], u32)> = ordinary.map(|t| (ascending(welded(t)), t as u32)).collect();
    buckets::sort(&mut sets, same.len(), |&([first, ..], _)| first as usize);
    let mut keep: BitVec = BitVec::repeat(false, triangles.len());
    for group in sets.chunk_by(|x, y| x.0 == y.0) {
        keep.set(group[0].1 as usize, true);
    }
    let ordinary = sets.len();
    drop(sets);

    let kept_triangles = keep.count_ones();
    let mut kept = Vec::with_capacity(kept_triangles);
    let mut residue = Vec::with_capacity(triangles.len() - kept_triangles);
    for t in 0..triangles.len() {
        if keep[t] {
            kept.push(welded(t).map(Vertex));
        } else {
            residue.push(welded(t));
        }
    }
    let (degenerate, repeated) = (triangles.len() - ordinary, ordinary - kept_triangles);
    SortedOut { kept, residue, is_kept: keep, degenerate, repeated }
}

fn ascending(mut vertices: [u32; 3]) -> [u32; 3] {
    vertices.sort_unstable();
    vertices
}

/// A key of a position; different positions seldom have the same one.
fn mix(bits: [u64; 3]) -> u64 {
    bits.into_iter().fold(0, |key: u64, x| {
        let key = (key.rotate_left(29) ^ x).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        key ^ key >> 32
    })
}
