//! Meshes whose vertices stand in rows, or nearly so, or in part.

use super::noise::{octaves, ridges, shift};
use super::sheet::{self, alternating, heights, one, random};
use super::{Made, isosurface, mixture, subdivision, tube};
use unweld::mesh::IndexedMesh;

/// All of them.
pub fn meshes() -> Vec<Made> {
    let waves =
        |x: f64, y: f64| 0.04 * (11.0 * x).sin() * (8.0 * y).cos() + 0.015 * (26.0 * x + 17.0 * y).sin();
    let fractal = |x: f64, y: f64| ridges(x, y, 3);
    let whole = |x: f64, y: f64| (600.0 * ridges(x, y, 4)).round() / 2600.0;
    vec![
        ("waves, one diagonal", heights(251, one, waves)),
        ("waves, alternating diagonals", heights(251, alternating, waves)),
        ("waves, random diagonals", heights(251, random(1), waves)),
        ("fractal terrain", heights(251, one, fractal)),
        ("fractal terrain, integer heights", heights(261, one, whole)),
        ("sphere of meridians", sheet::sphere(200, 160)),
        ("torus of quads", sheet::torus(240, 100)),
        ("Loop subdivision", loop_surface(0.0)),
        ("Loop subdivision, noisy", loop_surface(0.004)),
        ("Catmull-Clark subdivision", catmull_clark(0.0)),
        ("Catmull-Clark subdivision, noisy", catmull_clark(0.01)),
        ("marching cubes", gyroid()),
        ("tube with irregular caps", tube::with_domes(240, 100, 1)),
        ("half grid, half scan", mixture::half_scanned(180, 1)),
        ("half grid, half decimated", mixture::half_decimated(220, 30, 2)),
        ("half torus of quads, half decimated", mixture::half_decimated_torus(240, 100, 40)),
    ]
}

/// An icosahedron, stretched, subdivided six times, and as rough as told.
fn loop_surface(noise: f64) -> IndexedMesh {
    let p = (1.0 + 5f64.sqrt()) / 2.0;
    let corners = [[-1.0, p, 0.0], [1.0, p, 0.0], [-1.0, -p, 0.0], [1.0, -p, 0.0]];
    // Twelve corners: these four, and what their coordinates give when they change places, twice.
    let turned = |by: usize| corners.map(|c: [f64; 3]| [0, 1, 2].map(|k| c[(k + by) % 3]));
    let positions = (0..3).map(|k| turned([0, 2, 1][k])).collect::<Vec<_>>().concat();
    let stretched = positions.into_iter().map(|[x, y, z]| [x, 1.3 * y, 0.8 * z]).collect();
    let mut mesh = IndexedMesh::new(stretched, ICOSAHEDRON.to_vec());
    for _ in 0..6 {
        mesh = subdivision::triangles(&mesh);
    }
    if noise > 0.0 {
        for (v, p) in mesh.positions.iter_mut().enumerate() {
            let waves = 0.02 * (9.0 * p[0]).sin() * (7.0 * p[1]).cos() + noise * shift(1, v)[0];
            *p = p.map(|x| x * (1.0 + waves));
        }
    }
    mesh
}

/// A ring of cubes with a tower, subdivided five times, and as rough as told.
fn catmull_clark(noise: f64) -> IndexedMesh {
    let ring = [[0, 0, 0], [1, 0, 0], [2, 0, 0], [2, 1, 0], [2, 2, 0], [1, 2, 0], [0, 2, 0], [0, 1, 0]];
    let cubes: Vec<[i32; 3]> = ring.into_iter().chain([[0, 0, 1], [0, 0, 2]]).collect();
    let mut quads = subdivision::Quads::of_cubes(&cubes);
    for _ in 0..5 {
        quads = quads.subdivided();
    }
    for (v, p) in quads.positions.iter_mut().enumerate() {
        let s = shift(2, v);
        *p = [0, 1, 2].map(|k| p[k] + noise * s[k]);
    }
    quads.cut()
}

/// A gyroid in a ball, with some dents.
fn gyroid() -> IndexedMesh {
    isosurface::surface(72, |p| {
        let [x, y, z] = p.map(|x| 5.0 * x);
        let gyroid = x.sin() * y.cos() + y.sin() * z.cos() + z.sin() * x.cos() - 0.3;
        let outside = p.iter().map(|x| x * x).sum::<f64>().sqrt() - 0.85;
        gyroid.max(8.0 * outside) + 0.1 * octaves(p.map(|x| 3.0 * x), 2, 6)
    })
}

/// The faces of an icosahedron.
const ICOSAHEDRON: [[u32; 3]; 20] = [
    [0, 11, 5],
    [0, 5, 1],
    [0, 1, 7],
    [0, 7, 10],
    [0, 10, 11],
    [1, 5, 9],
    [5, 11, 4],
    [11, 10, 2],
    [10, 7, 6],
    [7, 1, 8],
    [3, 9, 4],
    [3, 4, 2],
    [3, 2, 6],
    [3, 6, 8],
    [3, 8, 9],
    [4, 9, 5],
    [2, 4, 11],
    [6, 2, 10],
    [8, 6, 7],
    [9, 8, 1],
];

#[cfg(test)]
mod tests {
    use super::*;
    use unweld::mesh::topology::{Weld, condition};

    #[test]
    fn all_are_manifolds_of_the_genus_meant() {
        for (name, mesh) in meshes() {
            let conditioned = condition(&mesh, Weld::Exact);
            let report = &conditioned.report;
            assert_eq!(conditioned.manifold.table.triangle_count(), mesh.triangles.len(), "{name}");
            assert_eq!((report.reoriented_triangles, report.cut_vertices), (0, 0), "{name}");
            let census = &report.census;
            let loops =
                usize::from(["waves", "fractal", "half grid"].iter().any(|start| name.starts_with(start)));
            // The ball cuts small pieces off the gyroid.
            let components = if name == "marching cubes" { census.components } else { 1 };
            assert_eq!((census.components, census.boundary_loops), (components, loops), "{name}");
            let handles = match name {
                _ if name.contains("torus") || name.starts_with("Catmull") => Some(1),
                "marching cubes" => None,
                _ => Some(0),
            };
            assert!(handles.is_none_or(|handles| census.handles == handles), "{name}: {}", census.handles);
        }
    }
}
