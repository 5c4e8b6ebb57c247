//! Meshes that no surface was meant to be, made by rule: each comes back triangle by triangle, and the report tells what
//! was found. Numbers are counted by hand.
#![cfg(feature = "encode")]

mod common;

use common::triangles;
use std::collections::HashMap;
use std::f64::consts::TAU;

use unweld::decoder;
use unweld::encoder::{Encoder, Options, Source};
use unweld::mesh::topology::ConditioningReport;
use unweld::mesh::{IndexedMesh, shapes};

/// Encodes, decodes, compares; returns what conditioning found.
fn there_and_back(mesh: &IndexedMesh) -> ConditioningReport {
    let mut file = Vec::new();
    let mut options = Options::default();
    options.simplify.base_vertices = Some(20);
    let report = Encoder::new(options).encode(mesh, &mut file).unwrap();
    let decoder = decoder::decode(&file, decoder::Options::default()).unwrap();
    let lattice = decoder.contents().unwrap().header.lattice;
    assert_eq!(triangles(&decoder.assembled().unwrap(), &lattice), triangles(mesh, &lattice));
    let told = decoder.metadata().unwrap().findings(&decoder.contents().unwrap().header);
    let told: HashMap<&str, u64> = told.iter().map(|(name, n)| (name.as_str(), *n)).collect();
    let report = report.conditioning;
    for (name, found) in [
        ("welded_vertices", report.welded_vertices),
        ("degenerate_triangles", report.degenerate_triangles),
        ("repeated_triangles", report.repeated_triangles),
        ("isolated_vertices", report.isolated_vertices),
        ("nonmanifold_edges", report.nonmanifold_edges),
        ("nonorientable_edges", report.nonorientable_edges),
        ("nonmanifold_vertices", report.nonmanifold_vertices),
        ("reoriented_triangles", report.reoriented_triangles),
        ("components", report.census.components),
    ] {
        assert_eq!(told[name], found as u64, "{name}");
    }
    report
}

/// The report of a connected manifold of which nothing had to be changed.
fn is_sound(report: &ConditioningReport) -> bool {
    let census = report.census;
    let as_it_was = ConditioningReport {
        input_vertices: report.input_vertices,
        input_triangles: report.input_triangles,
        census,
        ..ConditioningReport::default()
    };
    *report == as_it_was && census.components == 1
}

/// All faces of n * n * n cubes, each cube with its own; walls inside are there twice.
fn cell_complex(n: u32) -> IndexedMesh {
    let at = |p: [u32; 3]| (p[2] * (n + 1) + p[1]) * (n + 1) + p[0];
    let cells = (0..n * n * n).map(|k| [k % n, k / n % n, k / n / n]);
    let sides = |cell: [u32; 3]| {
        (0..6).flat_map(move |side| {
            let (axis, far) = (side / 2, side as u32 % 2);
            let corner = |u: u32, v: u32| {
                let mut p = cell;
                p[axis] += far;
                p[(axis + 1) % 3] += u;
                p[(axis + 2) % 3] += v;
                at(p)
            };
            let [a, b, c, d] = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
            if far == 1 { [[a, b, c], [a, c, d]] } else { [[a, c, b], [a, d, c]] }
        })
    };
    let places = (0..(n + 1).pow(3)).map(|k| [k % (n + 1), k / (n + 1) % (n + 1), k / (n + 1).pow(2)]);
    IndexedMesh::new(places.map(|p| p.map(f64::from)).collect(), cells.flat_map(sides).collect())
}

/// A figure-eight immersion: a sheet of n * m squares, its left and right sides joined, the others joined turned round.
fn klein_bottle(n: u32, m: u32) -> IndexedMesh {
    let at = |i: u32, j: u32| if j < m { j * n + i % n } else { (n - i % n) % n };
    let place = |k: u32| {
        let (u, v) = (TAU * f64::from(k / n) / f64::from(m), TAU * f64::from(k % n) / f64::from(n));
        let r = 2.0 + (u / 2.0).cos() * v.sin() - (u / 2.0).sin() * (2.0 * v).sin();
        [r * u.cos(), r * u.sin(), (u / 2.0).sin() * v.sin() + (u / 2.0).cos() * (2.0 * v).sin()]
    };
    let squares = (0..n * m).map(|k| (k % n, k / n));
    let halves = |(i, j)| {
        let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
        [[a, b, c], [a, c, d]]
    };
    IndexedMesh::new((0..n * m).map(place).collect(), squares.flat_map(halves).collect())
}

/// Copies of a mesh in a row, 3 apart.
fn row_of(mesh: &IndexedMesh, copies: u32) -> IndexedMesh {
    let vertices = mesh.positions.len() as u32;
    let mut row = IndexedMesh::default();
    for k in 0..copies {
        row.positions.extend(mesh.positions.iter().map(|&[x, y, z]| [x + 3.0 * f64::from(k), y, z]));
        row.triangles.extend(mesh.triangles.iter().map(|t| t.map(|v| v + k * vertices)));
    }
    row
}

/// Two poles and a ring of n vertices between them.
fn bipyramid(n: u32) -> IndexedMesh {
    let ring = (0..n).map(|i| (TAU * f64::from(i) / f64::from(n)).sin_cos());
    let mut positions = vec![[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]];
    positions.extend(ring.map(|(sin, cos)| [cos, sin, 0.0]));
    let sides = (0..n).map(|i| (2 + i, 2 + (i + 1) % n));
    IndexedMesh::new(positions, sides.flat_map(|(a, b)| [[0, a, b], [1, b, a]]).collect())
}

fn scaled(mesh: &IndexedMesh, scale: f64, shift: [f64; 3]) -> IndexedMesh {
    let place = |p: &[f64; 3]| [0, 1, 2].map(|k| p[k] * scale + shift[k]);
    IndexedMesh::new(mesh.positions.iter().map(place).collect(), mesh.triangles.clone())
}

#[test]
fn a_cell_complex() {
    // 3 * 4 * 9 = 108 squares, 54 of them inside and there twice. Of the 144 edges of the grid 36 run along edges of the
    // whole and have two squares, the others three or four. What is left joined: the squares inside one by one, 8
    // corners, 12 edges and 6 middles of the outside.
    let report = there_and_back(&cell_complex(3));
    assert_eq!((report.input_vertices, report.input_triangles), (64, 27 * 12));
    assert_eq!((report.repeated_triangles, report.nonmanifold_edges), (54 * 2, 144 - 36));
    assert_eq!(report.census.components, 54 + 8 + 12 + 6);
}

#[test]
fn a_klein_bottle() {
    let mesh = klein_bottle(12, 20);
    let report = there_and_back(&mesh);
    // The sheet hangs together after the cut, which runs once round at least: 12 edges where it is joined turned round.
    assert!(report.nonorientable_edges >= 12);
    assert_eq!((report.census.components, report.census.boundary_edges), (1, 2 * report.nonorientable_edges));
    assert_eq!((report.nonmanifold_edges, report.repeated_triangles, report.census.handles), (0, 0, 0));
}

#[test]
fn very_many_pieces() {
    let triangle = IndexedMesh::new(vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.5]], vec![[0, 1, 2]]);
    let report = there_and_back(&row_of(&triangle, 2000));
    assert_eq!((report.census.components, report.census.boundary_loops), (2000, 2000));
    let report = there_and_back(&row_of(&shapes::sphere(1), 300));
    assert_eq!((report.census.components, report.census.boundary_loops, report.locked_vertices), (300, 0, 0));
}

#[test]
fn a_vertex_of_800_triangles() {
    assert!(is_sound(&there_and_back(&bipyramid(800))));
}

#[test]
fn coordinates_of_any_size() {
    let sphere = shapes::bumpy_sphere(3, 1);
    for scale in [1e-30, 1e-300, 5e-324 * 1e9, 1e30, 1e300] {
        assert!(is_sound(&there_and_back(&scaled(&sphere, scale, [0.0; 3]))), "{scale:e}");
    }
    // Numbers near 1e9 are 1.2e-7 apart, steps of the lattice 1.5e-4.
    assert!(is_sound(&there_and_back(&scaled(&sphere, 1.0, [1e9, -1e9, 1e9]))));
    // Here they are as far apart as the vertices are: which of them meet is theirs, not the encoder's choice.
    let far = scaled(&sphere, 1.0, [1e15, 0.0, 0.0]);
    assert_eq!(there_and_back(&far).input_triangles, 1280);
}

#[test]
fn all_vertices_in_one_point() {
    let mut mesh = shapes::sphere(2);
    mesh.positions.fill([1e9, -0.1, 1e-30]);
    let report = there_and_back(&mesh);
    assert_eq!((report.welded_vertices, report.degenerate_triangles), (162 - 1, 320));
    assert_eq!((report.census.components, report.isolated_vertices), (0, 0));
}

#[test]
fn random_orientations() {
    let mut mesh = shapes::torus(20, 15);
    let mut turned = 0;
    for (k, triangle) in mesh.triangles.iter_mut().enumerate() {
        // As good as random: every bit of a product that wraps.
        if (k as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 63 == 1 {
            triangle.swap(1, 2);
            turned += 1;
        }
    }
    assert!((200..400).contains(&turned));
    let report = there_and_back(&mesh);
    // The orientation of most of them wins.
    assert_eq!(report.reoriented_triangles, turned.min(600 - turned));
    assert_eq!((report.nonorientable_edges, report.census.handles), (0, 1));
}

#[test]
fn everything_at_once() {
    let mut mesh = cell_complex(2);
    let repeated = there_and_back(&mesh).repeated_triangles;
    let first = mesh.positions.len() as u32;
    let bottle = klein_bottle(9, 9);
    mesh.positions.extend(scaled(&bottle, 0.1, [5.0, 0.0, 0.0]).positions);
    mesh.triangles.extend(bottle.triangles.iter().map(|t| t.map(|v| v + first)));
    mesh.triangles.extend([
        [0, 0, 1],
        [3, 3, 3],
        [first, first + 1, first + 9],
        [first, first + 9, first + 1],
    ]);
    mesh.positions.extend([[7.0; 3], [0.0; 3], [7.0; 3]]);
    let report = there_and_back(&mesh);
    assert_eq!((report.degenerate_triangles, report.welded_vertices, report.isolated_vertices), (2, 2, 1));
    // The last two name the same three vertices: no triangle of the bottle's, whose squares are cut the other way.
    assert_eq!(report.repeated_triangles, repeated + 1);
    assert!(report.nonorientable_edges > 0);
}

#[test]
fn what_the_source_has_dropped_is_told() {
    let mesh = shapes::tetrahedron();
    let mut encoder = Encoder::default();
    encoder.source(Source { dropped: vec!["lines (2)".into()], ..Source::default() });
    let mut file = Vec::new();
    let report = encoder.encode(&mesh, &mut file).unwrap();
    assert_eq!(report.dropped, ["lines (2)"]);
    let decoder = decoder::decode(&file, decoder::Options::default()).unwrap();
    assert_eq!(decoder.metadata().unwrap().dropped, ["lines (2)"]);
}
