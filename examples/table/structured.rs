//! Sizes of meshes whose vertices stand in rows: grids, a sphere of meridians, a torus of quads. The same on every machine.

use super::cases::Case;
use super::generate::unit;
use super::measure::geometric_mean;
use super::peers::Draco;
use super::tables::{Cell, Table};
use std::f64::consts::{PI, TAU};
use unweld::encoder::Encoder;
use unweld::mesh::IndexedMesh;

/// One row a mesh.
///
/// # Errors
/// Those of the coders.
pub fn table(bits: u32) -> anyhow::Result<Table> {
    let columns = ["mesh", "vertices", "triangles", "bytes", "bits/vertex", "Draco bytes", "bytes/Draco"];
    let mut table = Table::new("Structured meshes", &[NOTE], &columns);
    let mut ratios = Vec::new();
    for (name, mesh) in meshes() {
        let case = Case::of(name.to_owned(), mesh, bits)?;
        let report = Encoder::new(case.options()).encode(&case.mesh, &mut std::io::sink())?;
        let draco = Draco::new(&case.mesh, bits)?;
        let draco_bytes = draco.encode(draco.encoder())?.len() as u64;
        let vertices = case.mesh.positions.len();
        let ratio = report.bytes as f64 / draco_bytes as f64;
        ratios.push(ratio);
        table.rows.push(vec![
            Cell::text(&case.name),
            Cell::Count(vertices as u64),
            Cell::Count(case.mesh.triangles.len() as u64),
            Cell::Count(report.bytes),
            Cell::Number(report.bytes as f64 * 8.0 / vertices as f64, 2),
            Cell::Count(draco_bytes),
            Cell::Number(ratio, 3),
        ]);
    }
    let mut means = vec![Cell::None; columns.len()];
    means[0] = Cell::text("geometric mean");
    means[6] = Cell::number(geometric_mean(ratios.into_iter()), 3);
    table.rows.push(means);
    Ok(table)
}

fn meshes() -> Vec<(&'static str, IndexedMesh)> {
    let one = |_: u32, _: u32| false;
    let alternating = |i: u32, j: u32| !(i + j).is_multiple_of(2);
    let random = |i: u32, j: u32| unit(1, i, j, 3) < 0.0;
    let waves =
        |x: f64, y: f64| 0.04 * (11.0 * x).sin() * (8.0 * y).cos() + 0.015 * (26.0 * x + 17.0 * y).sin();
    let steps = |x: f64, y: f64| (400.0 * waves(x, y)).round() / 400.0;
    vec![
        ("waves, one diagonal", grid(one, waves)),
        ("waves, alternating diagonals", grid(alternating, waves)),
        ("waves, random diagonals", grid(random, waves)),
        ("waves in steps, one diagonal", grid(one, steps)),
        ("sphere of meridians", sphere(200, 160)),
        ("torus of quads", torus(240, 100)),
    ]
}

/// A height field over the unit square, of cells of two triangles each; `other` tells which cells are cut along the other diagonal.
fn grid(other: impl Fn(u32, u32) -> bool, height: impl Fn(f64, f64) -> f64) -> IndexedMesh {
    let place = |k: u32| f64::from(k) / f64::from(CELLS);
    let positions = (0..=CELLS).flat_map(|i| (0..=CELLS).map(move |j| (place(i), place(j))));
    let positions = positions.map(|(x, y)| [x, y, height(x, y)]).collect();
    let vertex = |i: u32, j: u32| i * (CELLS + 1) + j;
    let cells = (0..CELLS).flat_map(|i| (0..CELLS).map(move |j| (i, j)));
    let triangles = cells.flat_map(|(i, j)| {
        let corners = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)].map(|(i, j)| vertex(i, j));
        cut(corners, other(i, j))
    });
    IndexedMesh::new(positions, triangles.collect())
}

/// A sphere with a vertex at each pole.
fn sphere(meridians: u32, parallels: u32) -> IndexedMesh {
    let mut positions = vec![[0.0, 0.0, 1.0]];
    for j in 1..=parallels {
        let latitude = PI * f64::from(j) / f64::from(parallels + 1);
        for i in 0..meridians {
            let longitude = TAU * f64::from(i) / f64::from(meridians);
            positions.push([
                latitude.sin() * longitude.cos(),
                latitude.sin() * longitude.sin(),
                latitude.cos(),
            ]);
        }
    }
    positions.push([0.0, 0.0, -1.0]);
    let vertex = |i: u32, j: u32| 1 + (j - 1) * meridians + i % meridians;
    let south = positions.len() as u32 - 1;
    let mut triangles = Vec::new();
    for i in 0..meridians {
        triangles.push([0, vertex(i, 1), vertex(i + 1, 1)]);
        for j in 1..parallels {
            triangles
                .extend(cut([vertex(i, j), vertex(i, j + 1), vertex(i + 1, j + 1), vertex(i + 1, j)], false));
        }
        triangles.push([south, vertex(i + 1, parallels), vertex(i, parallels)]);
    }
    IndexedMesh::new(positions, triangles)
}

/// A torus of `along` by `around` quads, each cut along the same diagonal.
fn torus(along: u32, around: u32) -> IndexedMesh {
    let mut positions = Vec::new();
    for i in 0..along {
        let u = TAU * f64::from(i) / f64::from(along);
        for j in 0..around {
            let v = TAU * f64::from(j) / f64::from(around);
            let ring = 3.0 + v.cos();
            positions.push([ring * u.cos(), ring * u.sin(), v.sin()]);
        }
    }
    let vertex = |i: u32, j: u32| (i % along) * around + j % around;
    let cells = (0..along).flat_map(|i| (0..around).map(move |j| (i, j)));
    let triangles = cells.flat_map(|(i, j)| {
        cut([vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1)], false)
    });
    IndexedMesh::new(positions, triangles.collect())
}

fn cut([a, b, c, d]: [u32; 4], other: bool) -> [[u32; 3]; 2] {
    if other { [[a, b, d], [b, c, d]] } else { [[a, b, c], [a, c, d]] }
}

/// Cells along a side of a grid.
const CELLS: u32 = 250;

const NOTE: &str = "Generated by formulas, the same on every machine. Such meshes compress best where every decision follows the rows.";

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
            let expected = match name {
                "sphere of meridians" => (1, 0, 0),
                "torus of quads" => (1, 0, 1),
                _ => (1, 1, 0),
            };
            let census = &report.census;
            assert_eq!((census.components, census.boundary_loops, census.handles), expected, "{name}");
        }
    }
}
