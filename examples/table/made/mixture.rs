//! Meshes of two halves: one in rows, the other not.

use super::noise::{plane, unit};
use super::sheet::{heights, random, sheet, torus};
use meshopt::SimplifyOptions;
use unweld::mesh::IndexedMesh;

/// Hills whose one half is a grid and whose other half is as a range scanner sees it: shifted samples, rough, cut by chance.
pub fn half_scanned(side: u32, seed: u64) -> IndexedMesh {
    let scanned = |i: u32| i > side / 2;
    let cut = random(seed);
    sheet(
        [side, side],
        [false, false],
        |i, j| scanned(i) && cut(i, j),
        |i, j| {
            let inside = scanned(i) && i + 1 < side && j > 0 && j + 1 < side;
            let [dx, dy, dz] = [0, 1, 2].map(|axis| if inside { unit(seed, i, j, axis) } else { 0.0 });
            let cell = 1.0 / f64::from(side - 1);
            let [x, y] = [f64::from(i) + 0.3 * dx, f64::from(j) + 0.3 * dy].map(|k| k * cell);
            [x, y, hills(x, y, seed) + 0.1 * cell * dz]
        },
    )
}

/// Hills whose one half is a grid, the other half decimated to `percent` of its triangles.
pub fn half_decimated(side: u32, percent: usize, seed: u64) -> IndexedMesh {
    let mesh = heights(side, super::sheet::one, |x, y| hills(x, y, seed));
    decimate(&mesh, percent, |p| p[0] <= 0.5)
}

/// A torus of quads, its one half decimated to `percent` of its triangles.
pub fn half_decimated_torus(along: u32, around: u32, percent: usize) -> IndexedMesh {
    decimate(&torus(along, around), percent, |p| p[0] <= 0.0)
}

/// Decimates a half of a mesh by `meshopt_simplify`; what `stays` is locked.
fn decimate(mesh: &IndexedMesh, percent: usize, stays: impl Fn([f64; 3]) -> bool) -> IndexedMesh {
    let positions: Vec<[f32; 3]> = mesh.positions.iter().map(|p| p.map(|x| x as f32)).collect();
    let locks: Vec<bool> = mesh.positions.iter().map(|&p| stays(p)).collect();
    let rest = mesh.triangles.iter().filter(|t| !t.iter().all(|&v| locks[v as usize])).count();
    let target = 3 * (mesh.triangles.len() - rest * (100 - percent) / 100);
    let flat = mesh.triangles.as_flattened();
    let indices = meshopt::simplify_with_locks_decoder(
        flat,
        &positions,
        &locks,
        target,
        f32::MAX,
        SimplifyOptions::None,
        None,
    );
    super::compact(&IndexedMesh::new(mesh.positions.clone(), indices.as_chunks().0.to_vec()))
}

fn hills(x: f64, y: f64, seed: u64) -> f64 {
    0.08 * plane(5.0 * x, 5.0 * y, seed) + 0.03 * plane(13.0 * x, 13.0 * y, seed + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_half_keeps_its_rows() {
        let mesh = half_decimated(41, 30, 1);
        let kept = mesh.positions.iter().filter(|p| p[0] <= 0.5).count();
        assert_eq!(kept, 21 * 41);
        let others = mesh.positions.len() - kept;
        assert!((150..450).contains(&others), "{others}");
    }
}
