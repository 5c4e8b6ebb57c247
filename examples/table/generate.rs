//! Generated meshes of any size: no scan's, but irregular. The same arguments give the same mesh.

use super::made::noise::{ridges, unit};
use std::f64::consts::TAU;
use unweld::mesh::IndexedMesh;

/// A closed rough torus of `along` by `around` cells, two triangles each; both at least 3.
pub fn torus(along: u32, around: u32, seed: u64) -> IndexedMesh {
    let edge = TAU * TUBE / f64::from(around);
    let mut positions = Vec::with_capacity(along as usize * around as usize);
    for i in 0..along {
        for j in 0..around {
            let noise = |axis| JITTER * unit(seed, i, j, axis);
            let u = TAU * (f64::from(i) + noise(0)) / f64::from(along);
            let v = TAU * (f64::from(j) + noise(1)) / f64::from(around);
            let bumps = 0.1 * (3.0 * u + 2.0 * v).sin() + 0.06 * (7.0 * u - 5.0 * v).sin();
            let r = TUBE * (1.0 + bumps) + ROUGHNESS * edge * unit(seed, i, j, 2);
            let ring = 1.0 + r * v.cos();
            positions.push([ring * u.cos(), ring * u.sin(), r * v.sin()]);
        }
    }
    let vertex = |i: u32, j: u32| (i % along) * around + j % around;
    IndexedMesh::new(positions, cells(along, around, seed, vertex))
}

/// A height field of `width` by `depth` cells, two triangles each, with a boundary.
pub fn terrain(width: u32, depth: u32, seed: u64) -> IndexedMesh {
    let mut positions = Vec::with_capacity((width as usize + 1) * (depth as usize + 1));
    for i in 0..=width {
        for j in 0..=depth {
            let inside = |at: u32, end: u32| f64::from(u8::from(at > 0 && at < end));
            let x = f64::from(i) + JITTER * unit(seed, i, j, 0) * inside(i, width);
            let y = f64::from(j) + JITTER * unit(seed, i, j, 1) * inside(j, depth);
            positions.push([
                x,
                y,
                ridges(x / f64::from(width), y / f64::from(width), seed) * f64::from(width),
            ]);
        }
    }
    let vertex = |i: u32, j: u32| i * (depth + 1) + j;
    IndexedMesh::new(positions, cells(width, depth, seed, vertex))
}

/// Two triangles a cell, along one diagonal or the other.
fn cells(width: u32, depth: u32, seed: u64, vertex: impl Fn(u32, u32) -> u32) -> Vec<[u32; 3]> {
    let mut triangles = Vec::with_capacity(2 * width as usize * depth as usize);
    for i in 0..width {
        for j in 0..depth {
            let [a, b, c, d] = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)].map(|(i, j)| vertex(i, j));
            let other = unit(seed, i, j, 3) < 2.0 * OTHER_DIAGONAL - 1.0;
            triangles.extend(if other { [[a, b, d], [b, c, d]] } else { [[a, b, c], [a, c, d]] });
        }
    }
    triangles
}

/// Radius of the torus' tube; that of its ring is 1.
const TUBE: f64 = 0.35;
/// Largest shift of a vertex along the surface, in cells.
const JITTER: f64 = 0.2;
/// Largest shift of a vertex off the surface, in edges.
const ROUGHNESS: f64 = 0.08;
/// Share of cells that are cut along the other diagonal.
const OTHER_DIAGONAL: f64 = 0.35;

#[cfg(test)]
mod tests {
    use super::*;
    use unweld::mesh::topology::{Weld, condition};

    #[test]
    fn a_torus_is_closed_and_has_one_handle() {
        let conditioned = condition(&torus(20, 12, 1), Weld::Exact);
        let census = &conditioned.report.census;
        assert_eq!((census.components, census.boundary_loops, census.handles), (1, 0, 1));
        assert_eq!(conditioned.manifold.table.triangle_count(), 480);
        let valences: Vec<usize> =
            (0..240).map(|v| conditioned.manifold.table.valence(unweld::mesh::Vertex(v))).collect();
        assert!(valences.iter().any(|&n| n < 6) && valences.iter().any(|&n| n > 6));
    }

    #[test]
    fn a_terrain_is_a_disc() {
        let census = condition(&terrain(9, 7, 1), Weld::Exact).report.census;
        assert_eq!((census.components, census.boundary_loops, census.boundary_edges), (1, 1, 32));
        assert_eq!(census.handles, 0);
    }
}
