//! Triangles as sets of positions: whether two meshes are the same surface, however they are stored.

use unweld::mesh::{IndexedMesh, Lattice};
use unweld::refine::ProgressiveMesh;

/// Bits of the three coordinates of three corners, turned so that the least comes first.
type Key = [[u64; 3]; 3];

/// Number and sum of 128-bit hashes of oriented triangles: equal for equal multisets, and for others as good as never.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Fingerprint {
    count: u64,
    sum: u128,
}

/// Whether the two zeros are one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Zeros {
    Alike,
    Apart,
}

impl Zeros {
    /// The bits of a number.
    pub fn bits(self, x: f64) -> u64 {
        match self {
            // The sum is 0 for both.
            Self::Alike => (x + 0.0).to_bits(),
            Self::Apart => x.to_bits(),
        }
    }
}

/// Two multisets that differ.
#[derive(Clone, Debug, PartialEq)]
pub struct Difference {
    /// Triangles of the first that the second lacks.
    pub missing: usize,
    /// Triangles of the second that the first lacks.
    pub extra: usize,
    /// One of them.
    pub example: [[f64; 3]; 3],
    /// Whether it is a missing one.
    pub example_is_missing: bool,
}

impl Fingerprint {
    /// Of a mesh with positions.
    pub fn of(mesh: &IndexedMesh, zeros: Zeros) -> Self {
        corners(mesh).map(|t| key(t, zeros)).collect()
    }

    /// Of a mesh on a lattice.
    pub fn of_level(mesh: &ProgressiveMesh, lattice: &Lattice) -> Self {
        let position = |v: unweld::mesh::Vertex| lattice.position(mesh.positions[v.index()]);
        mesh.table.triangles().map(|t| key(mesh.table.triangle(t).map(position), Zeros::Alike)).collect()
    }
}

impl FromIterator<Key> for Fingerprint {
    fn from_iter<I: IntoIterator<Item = Key>>(keys: I) -> Self {
        keys.into_iter().fold(Self::default(), |f, key| {
            let halves = [0x243F_6A88_85A3_08D3, 0x1319_8A2E_0370_7344]
                .map(|seed| key.as_flattened().iter().fold(seed, |h, &x| mix(h ^ x)));
            let hash = u128::from(halves[0]) << 64 | u128::from(halves[1]);
            Self { count: f.count + 1, sum: f.sum.wrapping_add(hash) }
        })
    }
}

/// How the triangles of `second` differ from those of `first`; `None` where they do not.
pub fn difference(first: &IndexedMesh, second: &IndexedMesh, zeros: Zeros) -> Option<Difference> {
    let sorted = |mesh| {
        let mut keys: Vec<Key> = corners(mesh).map(|t| key(t, zeros)).collect();
        keys.sort_unstable();
        keys
    };
    let (first, second) = (sorted(first), sorted(second));
    let (missing, extra) = (lacking(&second, &first), lacking(&first, &second));
    let (&example, example_is_missing) =
        missing.first().map(|e| (e, true)).or(extra.first().map(|e| (e, false)))?;
    Some(Difference {
        missing: missing.len(),
        extra: extra.len(),
        example: example.map(|p| p.map(f64::from_bits)),
        example_is_missing,
    })
}

/// What sorted `others` have and sorted `keys` lack.
fn lacking(keys: &[Key], others: &[Key]) -> Vec<Key> {
    let mut keys = keys.iter().peekable();
    let mut lacking = Vec::new();
    for other in others {
        while keys.next_if(|key| *key < other).is_some() {}
        if keys.next_if(|key| *key == other).is_none() {
            lacking.push(*other);
        }
    }
    lacking
}

fn corners(mesh: &IndexedMesh) -> impl Iterator<Item = [[f64; 3]; 3]> + '_ {
    mesh.triangles.iter().map(|t| t.map(|v| mesh.positions[v as usize]))
}

fn key(corners: [[f64; 3]; 3], zeros: Zeros) -> Key {
    let [a, b, c] = corners.map(|p| p.map(|x| zeros.bits(x)));
    [[a, b, c], [b, c, a], [c, a, b]].into_iter().min().unwrap_or([a, b, c])
}

/// The output step of SplitMix64 (Steele, Lea, Flood 2014).
fn mix(x: u64) -> u64 {
    let x = x.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let x = (x ^ x >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let x = (x ^ x >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
    x ^ x >> 31
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(triangles: &[[u32; 3]]) -> IndexedMesh {
        let positions = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [-0.0, 1.0, 0.0]];
        IndexedMesh::new(positions, triangles.to_vec())
    }

    #[test]
    fn rotation_and_order_do_not_matter_but_all_else_does() {
        let one = square(&[[0, 1, 2], [2, 3, 0], [0, 0, 1]]);
        let same = square(&[[0, 1, 0], [3, 0, 2], [1, 2, 0]]);
        let print = |mesh: &IndexedMesh| Fingerprint::of(mesh, Zeros::Alike);
        assert_eq!(print(&one), print(&same));
        assert_eq!(difference(&one, &same, Zeros::Alike), None);
        for other in [
            square(&[[0, 2, 1], [2, 3, 0], [0, 0, 1]]),
            square(&[[0, 1, 2], [2, 3, 0]]),
            square(&[[0, 1, 2], [0, 1, 2], [2, 3, 0], [0, 0, 1]]),
            square(&[[0, 1, 2], [2, 3, 0], [0, 1, 1]]),
        ] {
            assert_ne!(print(&one), print(&other));
            assert!(difference(&one, &other, Zeros::Alike).is_some());
        }
    }

    #[test]
    fn zeros_are_one_or_two() {
        let one = square(&[[2, 3, 0]]);
        let mut other = one.clone();
        other.positions[3][0] = 0.0;
        assert_eq!(Fingerprint::of(&one, Zeros::Alike), Fingerprint::of(&other, Zeros::Alike));
        assert_ne!(Fingerprint::of(&one, Zeros::Apart), Fingerprint::of(&other, Zeros::Apart));
        assert_eq!(difference(&one, &other, Zeros::Apart).map(|d| (d.missing, d.extra)), Some((1, 1)));
    }

    #[test]
    fn differences_are_counted_with_repeats() {
        let first = square(&[[0, 1, 2], [0, 1, 2], [1, 2, 3]]);
        let second = square(&[[1, 2, 0], [3, 0, 1], [3, 0, 1], [1, 2, 3]]);
        let difference = difference(&first, &second, Zeros::Alike).unwrap();
        assert_eq!((difference.missing, difference.extra), (1, 2));
        assert!(difference.example_is_missing);
        assert_eq!(difference.example[0], [0.0; 3]);
    }
}
