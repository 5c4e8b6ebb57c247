//! Random triangles, random orientations, random order.

use proptest::prelude::*;
use unweld::mesh::topology::Weld;
use unweld::mesh::{IndexedMesh, shapes};

use super::conditioned;

fn soup(vertices: u32, triangles: usize) -> impl Strategy<Value = Vec<[u32; 3]>> {
    prop::collection::vec(prop::array::uniform3(0..vertices), 0..triangles)
}

fn shape() -> impl Strategy<Value = IndexedMesh> {
    prop_oneof![
        (3..8u32, 3..8u32).prop_map(|(n, m)| shapes::torus(n, m)),
        (3..8u32).prop_map(shapes::annulus),
        (1..4u32).prop_map(shapes::handle_body),
        (1..6u32, 1..6u32).prop_map(|(n, m)| shapes::grid(n, m)),
        Just(shapes::two_components()),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(512))]

    #[test]
    fn any_soup_becomes_a_manifold(triangles in soup(9, 60)) {
        let positions: Vec<_> = (0..9).map(|i| [f64::from(i), 0.0, 0.0]).collect();
        let mesh = IndexedMesh::new(positions, triangles);
        let result = conditioned(&mesh, Weld::Exact);
        prop_assert_eq!(result, conditioned(&mesh, Weld::None));
    }

    #[test]
    fn any_soup_of_coinciding_vertices_becomes_a_manifold(
        triangles in soup(24, 80),
        places in prop::collection::vec(prop::sample::select(vec![-0.0, 0.0, 1.0, f64::MAX, 1e-310]), 72),
    ) {
        let positions = places.chunks(3).map(|p| [p[0], p[1], p[2]]).collect();
        conditioned(&IndexedMesh::new(positions, triangles), Weld::Exact);
    }

    #[test]
    fn an_orientable_mesh_is_never_cut(mesh in shape(), turns in prop::collection::vec(any::<bool>(), 256), by in any::<usize>()) {
        let census = conditioned(&mesh, Weld::Exact).report.census;
        let mut turned = mesh.clone();
        for (t, _) in turned.triangles.iter_mut().zip(turns.iter().cycle()).filter(|(_, turn)| **turn) {
            t.swap(1, 2);
        }
        let first = by % turned.triangles.len();
        turned.triangles.rotate_left(first);
        let result = conditioned(&turned, Weld::Exact);
        prop_assert_eq!(result.report.nonorientable_edges, 0);
        prop_assert_eq!(result.report.census, census);
        prop_assert!(result.manifold.locked.not_any());
    }

    #[test]
    fn a_soup_of_single_triangles_welds_to_the_shape(mesh in shape()) {
        let positions = mesh.triangles.iter().flatten().map(|&v| mesh.positions[v as usize]).collect();
        let triangles = (0..mesh.triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        let apart = conditioned(&IndexedMesh::new(positions, triangles), Weld::Exact);
        let whole = conditioned(&mesh, Weld::Exact);
        prop_assert_eq!(apart.manifold.table, whole.manifold.table);
        prop_assert_eq!(apart.manifold.positions, whole.manifold.positions);
    }
}
