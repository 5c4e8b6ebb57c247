use super::*;
use crate::mesh::random::SplitMix64;
use crate::mesh::shapes;
use crate::mesh::topology::{Weld, census, condition};
use std::collections::BTreeSet;

/// Those that keep the topology.
pub(super) const METHODS: [Method; 3] = [Method::Hqms, Method::Qslim, Method::Mca];
pub(super) const ALL: [Method; 5] =
    [Method::Hqms, Method::Qslim, Method::Mca, Method::Octree, Method::Uniform];

pub(super) fn reduced(mesh: &IndexedMesh, faces: usize, options: &Options) -> Reduced {
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
                for (method, edition) in ALL.into_iter().map(|method| (method, None)).chain(published) {
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
fn ten_thousand_components() {
    let tetrahedron = shapes::tetrahedron();
    let mut mesh = IndexedMesh::default();
    for k in 0..10_000u32 {
        let at = [f64::from(k % 100) * 3.0, f64::from(k / 100) * 3.0, 0.0];
        mesh.positions.extend(tetrahedron.positions.iter().map(|p| [p[0] + at[0], p[1] + at[1], p[2]]));
        mesh.triangles.extend(tetrahedron.triangles.iter().map(|t| t.map(|v| v + 4 * k)));
    }
    let of = |method, topology| reduced(&mesh, 1_000, &Options { method, topology, ..Options::default() });
    for method in [Method::Hqms, Method::Octree, Method::Uniform] {
        assert!(of(method, Topology::Free).mesh.triangles.len() <= 1_000, "{method:?}");
    }
    for method in METHODS {
        // None of them has anything that could go.
        assert_eq!(of(method, Topology::Keep).mesh, mesh, "{method:?}");
    }
}

/// What became of the triangles' vertices leads to the triangles that are left: all of those, and by the methods that keep the topology no
/// others.
#[test]
fn parents_lead_to_what_is_left() {
    for mesh in [shapes::bumpy_sphere(3, 5), shapes::torus_with_hole(20, 12), shapes::two_components()] {
        let mut mesh = mesh;
        mesh.positions.push([9.0; 3]);
        let [a, b, _] = mesh.triangles[0];
        mesh.triangles.push([a, a, b]);
        for (method, faces) in ALL.into_iter().flat_map(|method| [(method, 60), (method, usize::MAX)]) {
            let result = reduced(&mesh, faces, &Options { method, parents: true, ..Options::default() });
            let first = |t: [u32; 3]| {
                let least = (0..3).min_by_key(|&k| t[k]).unwrap_or(0);
                [t[least], t[(least + 1) % 3], t[(least + 2) % 3]]
            };
            let is_triangle = |&[a, b, c]: &[u32; 3]| a != b && b != c && c != a;
            let led = mesh.triangles.iter().map(|t| t.map(|v| result.parents[v as usize]));
            let led: BTreeSet<[u32; 3]> = led.filter(is_triangle).map(first).collect();
            let left: BTreeSet<[u32; 3]> = result.mesh.triangles.iter().map(|&t| first(t)).collect();
            assert!(left.is_subset(&led), "{method:?}");
            assert!(left == led || !METHODS.contains(&method), "{method:?}");
            assert_eq!(result.parents.last(), Some(&NO_VERTEX));
            let reached: BTreeSet<u32> = result.parents.iter().copied().filter(|&v| v != NO_VERTEX).collect();
            assert!(reached.into_iter().eq(0..result.mesh.positions.len() as u32));
        }
    }
}

#[test]
fn a_vertex_with_very_many_triangles_takes_no_quadratic_time() {
    // A cone of so many triangles whose apex every vertex of the rim would like to join.
    let n = 20_000u32;
    let turn = |k: u32| f64::from(k) / f64::from(n) * std::f64::consts::TAU;
    let mut positions: Vec<[f64; 3]> = (0..n).map(|k| [turn(k).cos(), turn(k).sin(), 0.0]).collect();
    positions.push([0.0, 0.0, 3.0]);
    let mesh = IndexedMesh::new(positions, (0..n).map(|k| [k, (k + 1) % n, n]).collect());
    for method in ALL {
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
    for method in ALL {
        let cancelled = reduce(&mesh, 9, &Options { method, ..default() }, &mut |_, _| false);
        assert!(matches!(cancelled, Err(Error::Cancelled)), "{method:?}");
    }
}

#[test]
fn what_need_not_go_stays_as_it_is() {
    let mesh = shapes::torus(9, 7);
    for method in ALL {
        for faces in [mesh.triangles.len(), usize::MAX] {
            assert_eq!(reduced(&mesh, faces, &Options { method, ..Options::default() }).mesh, mesh);
        }
    }
}

#[test]
fn a_locked_boundary_stays() {
    let mesh = shapes::torus_with_hole(20, 12);
    let boundary = |mesh: &IndexedMesh| {
        let conditioned = condition(mesh, Weld::None);
        let locked = conditioned.manifold.locked_with_boundary();
        let at = |v: usize| conditioned.manifold.positions[v].map(f64::to_bits);
        let mut places: Vec<[u64; 3]> = locked.iter_ones().map(at).collect();
        places.sort_unstable();
        places
    };
    assert_eq!(boundary(&mesh).len(), 6);
    for method in METHODS {
        let small = reduced(&mesh, 60, &Options { method, lock_boundary: true, ..Options::default() }).mesh;
        assert!(small.triangles.len() <= 60);
        assert_eq!(boundary(&small), boundary(&mesh), "{method:?}");
    }
}

#[test]
fn clusters_of_an_octree_hold_together() {
    // Two sheets so near to each other that they share the cells: each stays a sheet of its own.
    let mut mesh = shapes::grid(24, 24);
    let n = mesh.positions.len() as u32;
    mesh.positions.extend(mesh.positions.clone().iter().map(|p| [p[0], p[1], p[2] + 0.001]));
    mesh.triangles.extend(mesh.triangles.clone().iter().map(|t| t.map(|v| v + n)));
    let with = |method| reduced(&mesh, 300, &Options { method, ..Options::default() }).mesh;
    let parts = |mesh: &IndexedMesh| census(&condition(mesh, Weld::None).manifold.table).components;
    let [octree, uniform] = [Method::Octree, Method::Uniform].map(with);
    assert!(octree.triangles.len() <= 300 && uniform.triangles.len() <= 300);
    assert_eq!((parts(&octree), parts(&uniform)), (2, 1));
}

#[test]
fn an_octree_is_fine_where_the_surface_is_bent() {
    // A square of which one quarter is rough: nearly all triangles end up there.
    let n = 48;
    let mut mesh = shapes::grid(n, n);
    let mut random = SplitMix64::new(7);
    for (k, p) in mesh.positions.iter_mut().enumerate() {
        let [x, y] = [k % (n as usize + 1), k / (n as usize + 1)];
        *p = [x as f64, y as f64, if x > 24 && y > 24 { random.unit() } else { 0.0 }];
    }
    let rough = |mesh: &IndexedMesh| {
        mesh.positions.iter().filter(|p| p[0] > 24.5 && p[1] > 24.5).count() as f64
            / mesh.positions.len() as f64
    };
    let with = |method| reduced(&mesh, 800, &Options { method, ..Options::default() }).mesh;
    assert!((0.2..0.3).contains(&rough(&mesh)));
    assert!((0.15..0.35).contains(&rough(&with(Method::Uniform))));
    assert!(rough(&with(Method::Octree)) > 0.8);
}

#[test]
fn a_corner_is_found_by_its_planes() {
    // Three sides of a cube: in the cell at the corner the planes meet in the corner itself, the centre is within.
    let n = 8;
    let side = |map: fn(f64, f64) -> [f64; 3]| {
        let mesh = shapes::grid(n, n);
        let at = |k: usize| map((k % 9) as f64 / 8.0, (k / 9) as f64 / 8.0);
        ((0..mesh.positions.len()).map(at).collect::<Vec<_>>(), mesh.triangles)
    };
    let mut mesh = IndexedMesh::default();
    for (positions, triangles) in
        [side(|x, y| [x, y, 0.0]), side(|x, y| [0.0, x, y]), side(|x, y| [y, 0.0, x])]
    {
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(positions);
        mesh.triangles.extend(triangles.iter().map(|t| t.map(|v| v + first)));
    }
    let same = Weld::Exact.representatives(&mesh, &crate::mesh::Lattice::over([0.0; 3], [1.0; 3], 12));
    mesh.triangles.iter_mut().flatten().for_each(|v| *v = same[*v as usize]);
    let nearest = |method, representative| {
        let options = Options { method, representative, ..Options::default() };
        let small = reduced(&mesh, 60, &options).mesh;
        small.positions.iter().map(|p| p.iter().map(|x| x * x).sum::<f64>()).fold(f64::MAX, f64::min)
    };
    assert!(nearest(Method::Octree, Representative::Quadric) < 1e-12);
    assert!(nearest(Method::Uniform, Representative::Quadric) < 1e-12);
    assert!(nearest(Method::Uniform, Representative::Centre) > 1e-4);
}
