use super::*;
use crate::mesh::random::SplitMix64;
use crate::mesh::shapes;
use crate::mesh::topology::{Weld, census, condition};

/// Those that keep the topology.
const METHODS: [Method; 3] = [Method::Hqms, Method::Qslim, Method::Mca];

fn reduced(mesh: &IndexedMesh, faces: usize, options: &Options) -> Reduced {
    reduce(mesh, faces, options, &mut |_, _| true).unwrap()
}

/// Components, loops and handles; nothing that is no manifold is there.
pub(super) fn topology(mesh: &IndexedMesh) -> [usize; 3] {
    let conditioned = condition(mesh, Weld::None);
    let report = &conditioned.report;
    assert_eq!([report.nonmanifold_edges, report.cut_vertices, report.repeated_triangles], [0; 3]);
    let census = census(&conditioned.manifold.table);
    [census.components, census.boundary_loops, census.handles]
}

#[test]
fn topology_stays_down_to_the_last_triangle_that_can_go() {
    let shapes = [
        shapes::bumpy_sphere(3, 1),
        shapes::torus(30, 20),
        shapes::torus_with_hole(20, 12),
        shapes::grid(15, 9),
        shapes::annulus(40),
        shapes::handle_body(3),
        shapes::two_components(),
    ];
    for mesh in shapes {
        let before = topology(&mesh);
        for (method, faces) in
            METHODS.into_iter().flat_map(|method| [(method, mesh.triangles.len() / 3), (method, 0)])
        {
            let mut counted = (0, 0);
            let options = Options { method, ..Options::default() };
            let result = reduce(&mesh, faces, &options, &mut |done, total| {
                counted = (done, total);
                done <= total
            });
            let small = result.unwrap().mesh;
            assert_eq!(topology(&small), before);
            let least = 4 * before[0] + 14 * before[2];
            assert!(small.triangles.len() <= faces.max(3 * least), "{} of {faces}", small.triangles.len());
            assert!(small.triangles.len() + 2 > faces);
        }
    }
}

#[test]
fn odd_meshes() {
    let everywhere = |mesh: &IndexedMesh| {
        for faces in [0, 1, 2, 7, mesh.triangles.len(), usize::MAX] {
            for topology in [Topology::Keep, Topology::Close, Topology::Free] {
                let published =
                    [Edition::Of2004, Edition::Of2006].map(|edition| (Method::Hqms, Some(edition)));
                for (method, edition) in METHODS.into_iter().map(|method| (method, None)).chain(published) {
                    let options = Options { method, topology, edition, ..Options::default() };
                    let small = reduced(mesh, faces, &options).mesh;
                    assert!(small.triangles.len() <= mesh.triangles.len());
                    assert!(small.positions.iter().flatten().all(|x| x.is_finite()));
                    let clean = small.triangles.iter().all(|&[a, b, c]| a != b && b != c && c != a);
                    assert!(clean || edition.is_some());
                }
            }
        }
    };
    let mut random = SplitMix64::new(1);
    // A soup on few vertices, triangles that share nothing, all vertices in one place, a fan, a book of pages, nothing at all.
    let mut corner = || random.below(30);
    let soup: Vec<[u32; 3]> = (0..200).map(|_| [corner(), corner(), corner()]).collect();
    let mut place = || std::array::from_fn(|_| random.unit());
    let positions: Vec<[f64; 3]> = (0..300).map(|_| place()).collect();
    everywhere(&IndexedMesh::new(positions.clone(), soup.clone()));
    everywhere(&IndexedMesh::new(
        positions.clone(),
        (0..100).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect(),
    ));
    everywhere(&IndexedMesh::new(vec![[3.0; 3]; 300], soup));
    everywhere(&IndexedMesh::new(positions.clone(), (1..298).map(|k| [0, k, k + 1]).collect()));
    everywhere(&IndexedMesh::new(positions, (2..100).map(|k| [0, 1, k]).collect()));
    everywhere(&IndexedMesh::default());
    everywhere(&shapes::tetrahedron());
}

#[test]
fn a_vertex_with_very_many_triangles_takes_no_quadratic_time() {
    // A cone of so many triangles whose apex every vertex of the rim would like to join.
    let n = 20_000u32;
    let turn = |k: u32| f64::from(k) / f64::from(n) * std::f64::consts::TAU;
    let mut positions: Vec<[f64; 3]> = (0..n).map(|k| [turn(k).cos(), turn(k).sin(), 0.0]).collect();
    positions.push([0.0, 0.0, 3.0]);
    let mesh = IndexedMesh::new(positions, (0..n).map(|k| [k, (k + 1) % n, n]).collect());
    for method in METHODS {
        let small = reduced(&mesh, 100, &Options { method, ..Options::default() }).mesh;
        assert!(small.triangles.len() <= 100, "{method:?}");
    }
}

#[test]
fn who_asks_for_what_cannot_be_is_told() {
    let mesh = shapes::sphere(3);
    let default = Options::default;
    let refused = [
        Options { heap: 0, ..default() },
        Options { cap: 0.0, ..default() },
        Options { cap: f64::NAN, ..default() },
        Options { choices: 0, ..default() },
    ];
    for options in refused {
        assert!(matches!(reduce(&mesh, 9, &options, &mut |_, _| true), Err(Error::Parameter(_))));
    }
    for method in METHODS {
        let cancelled = reduce(&mesh, 9, &Options { method, ..default() }, &mut |_, _| false);
        assert!(matches!(cancelled, Err(Error::Cancelled)), "{method:?}");
    }
}

#[test]
fn what_need_not_go_stays_as_it_is() {
    let mesh = shapes::torus(9, 7);
    for method in METHODS {
        for faces in [mesh.triangles.len(), usize::MAX] {
            assert_eq!(reduced(&mesh, faces, &Options { method, ..Options::default() }).mesh, mesh);
        }
    }
}
