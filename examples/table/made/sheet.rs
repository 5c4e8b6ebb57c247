//! Sheets of rows and columns: height fields, tori, tubes, spheres.

use super::noise::unit;
use std::f64::consts::{PI, TAU};
use unweld::mesh::IndexedMesh;

/// Cells all cut along the same diagonal.
pub fn one(_: u32, _: u32) -> bool {
    false
}

/// Cells cut along one diagonal after the other, along rows and columns.
pub fn alternating(i: u32, j: u32) -> bool {
    !(i + j).is_multiple_of(2)
}

/// Cells cut along either, by chance.
pub fn random(seed: u64) -> impl Fn(u32, u32) -> bool {
    move |i, j| unit(seed, i, j, 3) < 0.0
}

/// A sheet of `rows` by `columns` vertices, closed to a ring along either or not, each at its place; `other` tells which cells are cut
/// along the other diagonal.
pub fn sheet(
    [rows, columns]: [u32; 2],
    closed: [bool; 2],
    other: impl Fn(u32, u32) -> bool,
    place: impl Fn(u32, u32) -> [f64; 3],
) -> IndexedMesh {
    let place = &place;
    let positions = (0..rows).flat_map(|i| (0..columns).map(move |j| place(i, j))).collect();
    let [along, across] = [(rows, closed[0]), (columns, closed[1])].map(|(n, ring)| n - u32::from(!ring));
    let vertex = |i: u32, j: u32| (i % rows) * columns + j % columns;
    let mut triangles = Vec::with_capacity(2 * along as usize * across as usize);
    for (i, j) in (0..along).flat_map(|i| (0..across).map(move |j| (i, j))) {
        let corners = [vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1)];
        triangles.extend(cut(corners, other(i, j)));
    }
    IndexedMesh::new(positions, triangles)
}

/// A height field over the unit square, of `side` by `side` vertices.
pub fn heights(side: u32, other: impl Fn(u32, u32) -> bool, height: impl Fn(f64, f64) -> f64) -> IndexedMesh {
    sheet([side, side], [false, false], other, |i, j| {
        let [x, y] = [i, j].map(|k| f64::from(k) / f64::from(side - 1));
        [x, y, height(x, y)]
    })
}

/// A sphere of meridians and parallels, with a vertex at each pole.
pub fn sphere(meridians: u32, parallels: u32) -> IndexedMesh {
    let mut mesh = sheet([parallels, meridians], [false, true], one, |i, j| {
        let latitude = PI * f64::from(i + 1) / f64::from(parallels + 1);
        let longitude = TAU * f64::from(j) / f64::from(meridians);
        [latitude.sin() * longitude.cos(), latitude.sin() * longitude.sin(), latitude.cos()]
    });
    let (north, last) = (mesh.positions.len() as u32, (parallels - 1) * meridians);
    mesh.positions.extend([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]]);
    for j in 0..meridians {
        let next = (j + 1) % meridians;
        mesh.triangles.extend([[north, j, next], [north + 1, last + next, last + j]]);
    }
    mesh
}

/// A torus of `along` by `around` quads; radius 3 and 1.
pub fn torus(along: u32, around: u32) -> IndexedMesh {
    sheet([along, around], [true, true], one, |i, j| {
        let [u, v] = [(i, along), (j, around)].map(|(k, n)| TAU * f64::from(k) / f64::from(n));
        let ring = 3.0 + v.cos();
        [ring * u.cos(), ring * u.sin(), v.sin()]
    })
}

/// The two triangles of a quad.
pub fn cut([a, b, c, d]: [u32; 4], other: bool) -> [[u32; 3]; 2] {
    if other { [[a, b, d], [b, c, d]] } else { [[a, b, c], [a, c, d]] }
}
