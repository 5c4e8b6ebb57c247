//! Meshes of the kinds that the codec is for, which no rule or threshold of it was chosen on: terrain, structured parts, scans, organic shapes. Another
//! seed gives others.

use super::noise::{octaves, ridges, shift, unit};
use super::sheet::{heights, one, random, sheet};
use super::{Made, compact, isosurface, parts, subdivision, tube};
use crate::peers::meshopt_simplify;
use std::f64::consts::TAU;
use unweld::mesh::IndexedMesh;

/// All of them, by names that tell their kinds.
pub fn meshes(seed: u64) -> Vec<Made> {
    vec![
        ("terrain: raster with lakes", raster(seed)),
        ("terrain: decimated raster", decimated(&heights(260, one, |x, y| ridges(x, y, seed)), 30)),
        ("part: spur gear", parts::gear(19 + (seed % 7) as u32)),
        ("part: spring of quads", spring()),
        ("part: pipe with domes", tube::with_domes(180, 90, seed + 40)),
        ("scan: merged", scan(seed)),
        ("scan: range image with holes", range_image(seed)),
        ("organic: blob, remeshed", decimated(&blob(110, seed), 35)),
        ("organic: sculpted on a subdivision", sculpted(seed)),
        ("organic: smooth subdivision", subdivided(seed)),
    ]
}

/// Heights in whole steps, as rasters come, nothing where there is water.
fn raster(seed: u64) -> IndexedMesh {
    let mut mesh = heights(230, one, |x, y| (ridges(x, y, seed + 1) * 2000.0).round() / 2000.0);
    let mut levels: Vec<f64> = mesh.positions.iter().map(|p| p[2]).collect();
    levels.sort_by(f64::total_cmp);
    let water = levels[levels.len() / 8];
    let positions = &mesh.positions;
    mesh.triangles.retain(|t| t.iter().any(|&v| positions[v as usize][2] > water));
    compact(&mesh)
}

/// A round wire, wound up.
fn spring() -> IndexedMesh {
    let (along, around) = (1400, 24);
    let mut mesh = sheet([along, around], [false, true], one, |i, j| {
        let [u, v] =
            [8.0 * f64::from(i) / f64::from(along), f64::from(j) / f64::from(around)].map(|x| TAU * x);
        let radius = 1.0 + 0.12 * v.cos();
        [radius * u.cos(), radius * u.sin(), 0.06 * u + 0.12 * v.sin()]
    });
    // Flat ends, cut from one vertex.
    for (first, turned) in [(0, false), ((along - 1) * around, true)] {
        let fan = (1..around - 1).map(|k| [first, first + k, first + k + 1]);
        mesh.triangles.extend(fan.map(|[a, b, c]| if turned { [a, c, b] } else { [a, b, c] }));
    }
    mesh
}

/// What a volume of merged range images gives: the rough surface of a rough body by marching cubes.
fn scan(seed: u64) -> IndexedMesh {
    let mesh = isosurface::surface(100, |p| {
        let length = p.iter().map(|x| x * x).sum::<f64>().sqrt();
        length - 0.66 - 0.14 * octaves(p.map(|x| 2.3 * x), 5, seed)
    });
    let mut mesh = compact(&mesh);
    for (v, p) in mesh.positions.iter_mut().enumerate() {
        let noise = shift(seed, v);
        *p = [0, 1, 2].map(|k| p[k] + 0.0012 * noise[k]);
    }
    mesh
}

/// One range image: rows of samples, jittered, gone where the surface is steep.
fn range_image(seed: u64) -> IndexedMesh {
    let side = 210;
    let depth = |x: f64, y: f64| 0.5 * octaves([3.0 * x, 3.0 * y, 0.5], 4, seed);
    let mut mesh = sheet([side, side], [false, false], random(seed), |i, j| {
        let [dx, dy, dz] = [0, 1, 2].map(|axis| unit(seed + 9, i, j, axis));
        let [x, y] = [f64::from(i) + 0.2 * dx, f64::from(j) + 0.2 * dy].map(|k| k / f64::from(side));
        [x, y, depth(x, y) + 0.0006 * dz]
    });
    let positions = &mesh.positions;
    mesh.triangles.retain(|t| {
        let [a, b, c] = t.map(|v| positions[v as usize][2]);
        a.max(b).max(c) - a.min(b).min(c) < 9.0 / f64::from(side)
    });
    compact(&mesh)
}

/// Balls that flow together.
fn blob(cells: usize, seed: u64) -> IndexedMesh {
    let balls: Vec<[f64; 3]> = (0..9).map(|k| shift(seed + 100, k).map(|x| 0.5 * x)).collect();
    let field = |p: [f64; 3]| {
        let of = |c: &[f64; 3]| 0.035 / (0.01 + (0..3).map(|k| (p[k] - c[k]).powi(2)).sum::<f64>());
        1.0 - balls.iter().map(of).sum::<f64>()
    };
    isosurface::surface(cells, |p| if p.iter().any(|x| x.abs() > 0.98) { 1.0 } else { field(p) })
}

/// A few hundred triangles of a blob, subdivided.
fn subdivided(seed: u64) -> IndexedMesh {
    let mut mesh = decimated(&blob(60, seed + 1), 8);
    for _ in 0..2 {
        mesh = subdivision::triangles(&mesh);
    }
    mesh
}

/// The same, with folds and pores.
fn sculpted(seed: u64) -> IndexedMesh {
    let mut mesh = subdivided(seed + 2);
    for p in &mut mesh.positions {
        let noise = octaves(p.map(|x| 9.0 * x), 3, seed);
        *p = p.map(|x| x * (1.0 + 0.02 * noise));
    }
    mesh
}

/// `percent` of the triangles, chosen by `meshopt_simplify`.
fn decimated(mesh: &IndexedMesh, percent: usize) -> IndexedMesh {
    let fewer = meshopt_simplify(mesh, mesh.triangles.len() * percent / 100);
    compact(&fewer.unwrap_or_else(|| mesh.clone()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use unweld::mesh::topology::{Weld, condition};

    #[test]
    fn all_are_meshes_of_a_fair_size_with_little_to_mend() {
        for (name, mesh) in meshes(1) {
            let report = condition(&mesh, Weld::Exact).report;
            assert!((3_000..80_000).contains(&mesh.positions.len()), "{name}: {}", mesh.positions.len());
            let mended = report.reoriented_triangles + report.degenerate_triangles + report.cut_vertices;
            assert!(mended * 50 < mesh.triangles.len(), "{name}: {mended}");
        }
    }

    #[test]
    fn another_seed_gives_others() {
        assert_ne!(raster(1).positions, raster(2).positions);
        assert_ne!(blob(20, 1).positions, blob(20, 2).positions);
    }
}
