//! What several test programs want.

use unweld::mesh::{IndexedMesh, Lattice};

/// Triangles as lattice points, each in the smallest of its rotations, sorted: equal for equal surfaces.
pub fn triangles(mesh: &IndexedMesh, lattice: &Lattice) -> Vec<[[i32; 3]; 3]> {
    let rotated = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| lattice.quantise(mesh.positions[v as usize]));
        [[a, b, c], [b, c, a], [c, a, b]].into_iter().min().unwrap()
    };
    let mut all: Vec<_> = mesh.triangles.iter().map(rotated).collect();
    all.sort_unstable();
    all
}
