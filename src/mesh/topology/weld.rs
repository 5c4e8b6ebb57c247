//! The first steps of conditioning: vertices in the same place become one; triangles no manifold can hold step aside.

use std::fmt;
use std::ops::Range;
use std::str::FromStr;

use bitvec::vec::BitVec;

use super::near;
use crate::error::Error;
use crate::mesh::index::Vertex;
use crate::mesh::{IndexedMesh, Lattice, buckets};

/// Which vertices of the input are the same vertex.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub enum Weld {
    /// Those with exactly equal coordinates; -0.0 equals 0.0, and a NaN equals a NaN of the same bits.
    #[default]
    Exact,
    /// Those with the same index.
    None,
    /// Those whose nearest lattice point is the same. Two vertices however close may lie on two sides of the middle between
    /// lattice points; where that must not matter, [`Weld::Within`] is for them.
    Lattice,
    /// Those that a chain of vertices joins, each at most so far from the next: finite, at least 0. (Where surfaces nearly
    /// that far apart are sampled very much more densely than that, a few links may be up to three times as long.)
    Within(f64),
}

impl Weld {
    /// For each vertex the one of its body that stands for it, itself or another one that is the same: the first of those with equal
    /// coordinates; of nearly equal ones the one with the least x, then y, then z, if possible one that is used by a triangle.
    /// So it does not hang on the order of the vertices. Takes time n log n.
    ///
    /// # Panics
    /// Where a triangle names a vertex that does not exist.
    pub fn representatives(self, mesh: &IndexedMesh, lattice: &Lattice) -> Vec<u32> {
        let positions = &mesh.positions;
        if self == Self::None {
            return (0..positions.len() as u32).collect();
        }
        let mut same = first_in_bodies(mesh);
        if matches!(self, Self::Exact) || self == Self::Within(0.0) {
            return same;
        }
        let mut used: BitVec = BitVec::repeat(false, positions.len());
        for &v in mesh.triangles.as_flattened() {
            used.set(same[v as usize] as usize, true);
        }
        for body in mesh.body_vertices() {
            self.join(body, positions, &used, lattice, &mut same);
        }
        same
    }

    /// Joins what is nearly equal of a body's vertices, of which those in one place are one already.
    fn join(
        self,
        body: Range<usize>,
        positions: &[[f64; 3]],
        used: &BitVec,
        lattice: &Lattice,
        same: &mut [u32],
    ) {
        let distinct: Vec<u32> = body.clone().filter(|&v| same[v] as usize == v).map(|v| v as u32).collect();
        let places: Vec<[f64; 3]> = distinct.iter().map(|&v| positions[v as usize]).collect();
        let mut sets = match self {
            Self::Lattice => near::on_lattice(&places, lattice),
            Self::Within(distance) if distance > 0.0 => near::within(&places, distance),
            _ => return,
        };
        let rank = |v: u32| (!used[v as usize], positions[v as usize].map(|x| x + 0.0));
        // For each set the number that stands for it has the vertex that does.
        let mut chosen = distinct.clone();
        for (k, &v) in (0..).zip(&distinct) {
            let best = &mut chosen[sets.find(k) as usize];
            if rank(v) < rank(*best) {
                *best = v;
            }
        }
        let mut stands_for = vec![0; body.len()];
        for (k, &v) in (0..).zip(&distinct) {
            stands_for[v as usize - body.start] = chosen[sets.find(k) as usize];
        }
        same[body.clone()].iter_mut().for_each(|v| *v = stands_for[*v as usize - body.start]);
    }
}

/// As it is given on the command line.
impl fmt::Display for Weld {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Exact => f.write_str("exact"),
            Self::None => f.write_str("none"),
            Self::Lattice => f.write_str("lattice"),
            Self::Within(distance) => write!(f, "{distance}"),
        }
    }
}

impl FromStr for Weld {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        match (text, text.parse::<f64>()) {
            ("exact", _) => Ok(Self::Exact),
            ("none", _) => Ok(Self::None),
            ("lattice", _) => Ok(Self::Lattice),
            (_, Ok(distance)) if distance.is_finite() && distance >= 0.0 => Ok(Self::Within(distance)),
            _ => Err(Error::Parameter(
                "exact, none, lattice, or a distance of at least 0 such as 0.001".into(),
            )),
        }
    }
}

/// For each vertex the first one of its body with equal coordinates.
pub(super) fn first_in_bodies(mesh: &IndexedMesh) -> Vec<u32> {
    let mut same = Vec::with_capacity(mesh.positions.len());
    for body in mesh.body_vertices() {
        let first = body.start as u32;
        same.extend(first_in_place(&mesh.positions[body]).into_iter().map(|v| first + v));
    }
    same
}

/// For each vertex the first one with equal coordinates.
pub(crate) fn first_in_place(positions: &[[f64; 3]]) -> Vec<u32> {
    let mut same: Vec<u32> = (0..positions.len() as u32).collect();
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
