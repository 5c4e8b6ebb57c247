use super::super::tests::topology;
use super::super::{Options, Reduced, Strategy, reduce};
use super::*;
use crate::mesh::distance::surface_distance;
use crate::mesh::{IndexedMesh, shapes};

fn reduced(mesh: &IndexedMesh, faces: usize, options: &Options) -> Reduced {
    reduce(mesh, faces, options, &mut |_, _| true).unwrap()
}

#[test]
fn a_plane_keeps_its_corners_and_a_cube_its_faces() {
    let n = 12;
    let grid = |map: &dyn Fn(f64, f64) -> [f64; 3]| {
        let mesh = shapes::grid(n, n);
        let scale = |k: usize| (k as f64) / f64::from(n);
        let positions = (0..mesh.positions.len()).map(|k| map(scale(k % 13), scale(k / 13))).collect();
        IndexedMesh::new(positions, mesh.triangles)
    };
    // The square, and the same folded along its middle.
    for fold in [0.0, 1.0] {
        let mesh = grid(&|x, y| [x, y, fold * (x - 0.5).max(0.0)]);
        let small = reduced(&mesh, if fold == 0.0 { 2 } else { 4 }, &Options::default()).mesh;
        let area = |mesh: &IndexedMesh| -> f64 {
            let p = |v: u32| DVec3::from(mesh.positions[v as usize]);
            mesh.triangles.iter().map(|&[a, b, c]| (p(b) - p(a)).cross(p(c) - p(a)).length() / 2.0).sum()
        };
        assert!((area(&small) - area(&mesh)).abs() < 0.005, "{} instead of {}", area(&small), area(&mesh));
    }
}

/// Thin tips are little of the area: their planes cost next to nothing, wherever along them the tip goes.
#[test]
fn tips_are_not_worn_away() {
    let (height, width) = (0.5, 0.08);
    for seed in 1..4 {
        let mut random = SplitMix64::new(seed);
        let mut axis = || DVec3::from_array([0; 3].map(|_| random.unit() - 0.5)).normalize_or(DVec3::X);
        let axes: [DVec3; 12] = std::array::from_fn(|_| axis());
        let mut mesh = shapes::sphere(5);
        let up = |at: DVec3| axes.iter().map(|axis| 1.0 - axis.angle_between(at) / width).fold(0.0, f64::max);
        for p in &mut mesh.positions {
            let at = DVec3::from(*p);
            *p = (at * (1.0 + height * up(at))).to_array();
        }
        // Enough for three rings round each tip.
        let small = reduced(&mesh, 200, &Options::default()).mesh;
        let far = surface_distance(&mesh, &small, 0, 0).unwrap().max;
        assert!(far < height / 4.0, "{far} of {height}");
    }
}

#[test]
fn shares_of_the_strategies() {
    // All that can go in a pass, of a surface with valences around six.
    let mesh = shapes::bumpy_sphere(5, 3);
    let share = |strategy| {
        let options = Options { strategy, cap: 1.0, ..Options::default() };
        let pass = reduced(&mesh, mesh.triangles.len() / 10, &options).passes[0];
        pass.contractions as f64 / pass.vertices as f64
    };
    // At most a half, a quarter and a tenth (two vertices of valence six: 2, 4 and 10 rings), and maximal matchings reach half of that.
    for (strategy, most) in [(Strategy::One, 0.5), (Strategy::Two, 0.3), (Strategy::Three, 0.16)] {
        let share = share(strategy);
        assert!((most / 2.0..=most).contains(&share), "{share} for {strategy:?}");
    }
}

#[test]
fn holes_of_three_edges_are_shut_on_demand() {
    let mut mesh = shapes::bumpy_sphere(3, 1);
    // Every 40th triangle is missing.
    let mut number = 0;
    mesh.triangles.retain(|_| {
        number += 1;
        number % 40 != 0
    });
    let holes = topology(&mesh)[1];
    assert!(holes > 20);
    let with = |topology| reduced(&mesh, 300, &Options { topology, ..Options::default() }).mesh;
    assert_eq!(topology(&with(Topology::Keep)), [1, holes, 0]);
    let shut = topology(&with(Topology::Close));
    assert!(shut[0] == 1 && shut[1] < holes * 2 / 3 && shut[2] == 0, "{shut:?}");
}

#[test]
fn handles_go_where_topology_is_free() {
    let mesh = shapes::torus(40, 12);
    let options = |topology| Options { topology, ..Options::default() };
    // No torus has fewer than 14 triangles.
    assert!(reduced(&mesh, 6, &options(Topology::Keep)).mesh.triangles.len() >= 14);
    assert!(reduced(&mesh, 6, &options(Topology::Free)).mesh.triangles.len() < 14);
}

#[test]
fn the_editions_follow_the_papers() {
    let mesh = shapes::bumpy_sphere(4, 2);
    for edition in [Edition::Of2004, Edition::Of2006] {
        let options = Options { edition: Some(edition), ..Options::default() };
        let result = reduced(&mesh, 500, &options);
        assert!((499..=500).contains(&result.mesh.triangles.len()));
        // Nearly a half of the vertices a pass: from 2,562 to 252 vertices.
        assert!((4..=5).contains(&result.passes.len()), "{:?}", result.passes);
    }
}
