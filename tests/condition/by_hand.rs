//! Small cases whose numbers follow from counting by hand.

use unweld::mesh::topology::{Census, Conditioned, Weld};
use unweld::mesh::{IndexedMesh, shapes};

use super::conditioned;

/// Points with different coordinates.
fn points(n: u32) -> Vec<[f64; 3]> {
    (0..n).map(|i| [f64::from(i), f64::from(i % 7), f64::from(i % 3)]).collect()
}

fn run(vertices: u32, triangles: &[[u32; 3]]) -> Conditioned {
    let mesh = IndexedMesh::new(points(vertices), triangles.to_vec());
    let result = conditioned(&mesh, Weld::Exact);
    assert_eq!(result, conditioned(&mesh, Weld::None), "there is nothing to weld");
    result
}

/// Components, boundary loops, boundary edges, handles.
fn census(result: &Conditioned) -> [usize; 4] {
    let Census { components, boundary_loops, boundary_edges, handles } = result.report.census;
    [components, boundary_loops, boundary_edges, handles]
}

const TETRAHEDRON: [[u32; 3]; 4] = [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]];

/// A tetrahedron on the given vertices.
fn tetrahedron(on: [u32; 4]) -> [[u32; 3]; 4] {
    TETRAHEDRON.map(|t| t.map(|v| on[v as usize]))
}

#[test]
fn a_manifold_comes_out_as_it_went_in() {
    let shapes = [
        (shapes::tetrahedron(), [1, 0, 0, 0]),
        (shapes::disc_with_ears(), [1, 1, 12, 0]),
        (shapes::annulus(7), [1, 2, 14, 0]),
        (shapes::strip(9), [1, 1, 11, 0]),
        (shapes::grid(4, 3), [1, 1, 14, 0]),
        (shapes::torus(6, 5), [1, 0, 0, 1]),
        (shapes::torus_with_hole(6, 5), [1, 1, 6, 1]),
        (shapes::two_components(), [2, 0, 0, 1]),
        (shapes::handle_body(3), [1, 0, 0, 3]),
        (shapes::sphere(2), [1, 0, 0, 0]),
    ];
    for (mesh, expected) in shapes {
        let result = conditioned(&mesh, Weld::Exact);
        assert_eq!(census(&result), expected);
        assert!(
            result.remainder.flipped.not_any()
                && result.manifold.locked.not_any()
                && result.remainder.stitches.is_empty()
        );
        assert_eq!(result.manifold.table.triangle_count(), mesh.triangles.len());
        assert_eq!(result.manifold.positions.len(), mesh.positions.len());
    }
}

#[test]
fn nothing_in_nothing_out() {
    let result = run(0, &[]);
    assert_eq!(result, Conditioned::default());
}

#[test]
fn vertices_are_numbered_by_first_use() {
    let mesh = IndexedMesh::new(points(6), vec![[5, 3, 1], [3, 5, 2]]);
    let result = conditioned(&mesh, Weld::Exact);
    assert_eq!(result.manifold.positions, [5, 3, 1, 2].map(|v| mesh.positions[v]));
    assert_eq!(result.remainder.extras, [0, 4].map(|v| mesh.positions[v]));
    assert_eq!(result.report.isolated_vertices, 2);
}

#[test]
fn a_moebius_strip_is_cut_across_once() {
    // Triangle i runs i, i+1, i+2 (mod 5): each meets the next one along an edge that both run in the same direction,
    // so every second one is turned, 1 and 4, and the cut falls between 2 and 3.
    let result = run(5, &[[0, 1, 2], [1, 2, 3], [2, 3, 4], [3, 4, 0], [4, 0, 1]]);
    assert_eq!(result.report.nonorientable_edges, 1);
    assert_eq!(result.remainder.flipped.iter_ones().collect::<Vec<_>>(), [1, 4]);
    // A disc: the boundary of five edges, and the cut edge twice; both its ends became two.
    assert_eq!(census(&result), [1, 1, 7, 0]);
    assert_eq!((result.report.cut_vertices, result.report.nonmanifold_vertices), (2, 0));
    assert_eq!((result.manifold.positions.len(), result.report.locked_vertices), (7, 4));
}

#[test]
fn a_projective_plane_is_cut_to_a_disc() {
    let triangles = [
        [0, 1, 4],
        [0, 4, 2],
        [0, 2, 5],
        [0, 5, 3],
        [0, 3, 1],
        [1, 2, 3],
        [2, 4, 3],
        [3, 4, 5],
        [4, 1, 5],
        [1, 2, 5],
    ];
    let result = run(6, &triangles);
    // Where it is cut is the walk's choice; what is left hangs together and can be oriented, so the cuts hold a closed
    // curve, and a characteristic of 1 leaves no room for a handle.
    let cuts = result.report.nonorientable_edges;
    assert!(cuts >= 3, "a closed curve has three edges at least");
    let [components, loops, edges, handles] = census(&result);
    assert_eq!((components, edges, handles), (1, 2 * cuts, 0));
    // V - E + F with F = 10 and 2 E = 30 + edges.
    assert_eq!(result.manifold.positions.len(), 2 - loops + 15 + cuts - 10);
}

#[test]
fn a_klein_bottle_is_cut_to_an_oriented_surface() {
    let (n, m) = (7, 5);
    // A square sheet whose left and right sides are joined straight, its lower and upper ones mirrored.
    let at = |i: u32, j: u32| if j < m { j * n + i % n } else { (n - i % n) % n };
    let mut triangles = Vec::new();
    for (i, j) in (0..m).flat_map(|j| (0..n).map(move |i| (i, j))) {
        let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
        triangles.extend([[a, b, c], [a, c, d]]);
    }
    let result = run(n * m, &triangles);
    let cuts = result.report.nonorientable_edges;
    assert!(cuts >= 3);
    let [components, loops, edges, handles] = census(&result);
    assert_eq!((components, edges, handles), (1, 2 * cuts, 0));
    assert_eq!(
        result.manifold.positions.len() + triangles.len(),
        (3 * triangles.len() + edges) / 2 + 2 - loops
    );
}

#[test]
fn a_book_of_four_pages_comes_apart() {
    let result = run(6, &[[0, 1, 2], [0, 1, 3], [1, 0, 4], [0, 1, 5]]);
    assert_eq!(census(&result), [4, 4, 12, 0]);
    assert_eq!(result.report.nonmanifold_edges, 1);
    assert_eq!((result.report.cut_vertices, result.report.nonmanifold_vertices), (2, 0));
    assert_eq!(result.remainder.stitches.iter().map(Vec::len).collect::<Vec<_>>(), [4, 4]);
    assert_eq!(result.report.locked_vertices, 8);
    assert_eq!(result.report.reoriented_triangles, 0, "pages without neighbours stay as they are");
}

#[test]
fn a_fin_comes_off_and_the_slit_closes() {
    let mut triangles = TETRAHEDRON.to_vec();
    triangles.push([0, 1, 4]);
    let result = run(5, &triangles);
    assert_eq!(census(&result), [2, 1, 3, 0]);
    assert_eq!(result.report.nonmanifold_edges, 1);
    assert_eq!(result.manifold.positions.len(), 4 + 3);
    assert_eq!(result.remainder.stitches.iter().map(Vec::len).collect::<Vec<_>>(), [2, 2]);
    assert_eq!(result.report.locked_vertices, 4);
}

#[test]
fn a_slit_of_two_edges_stays_open() {
    // A fin of two triangles along the path a, b, c of a sphere: b becomes two on the sphere, three with the fin's.
    let mut mesh = shapes::sphere(2);
    let (a, b) = (mesh.triangles[0][0], mesh.triangles[0][1]);
    let beside = |v: u32| mesh.triangles.iter().filter(move |t| t.contains(&v));
    let near_a: Vec<u32> = beside(a).flatten().copied().collect();
    let c = beside(b).flatten().copied().find(|v| !near_a.contains(v)).unwrap();
    let fin = mesh.positions.len() as u32;
    mesh.positions.push([9.0, 9.0, 9.0]);
    mesh.triangles.extend([[a, b, fin], [b, c, fin]]);
    let result = conditioned(&mesh, Weld::Exact);
    assert_eq!(census(&result), [2, 2, 8, 0]);
    let mut sizes: Vec<usize> = result.remainder.stitches.iter().map(Vec::len).collect();
    sizes.sort_unstable();
    assert_eq!(sizes, [2, 2, 3]);
    assert_eq!((result.report.nonmanifold_edges, result.report.locked_vertices), (2, 7));
}

#[test]
fn solids_that_touch_along_an_edge_stay_closed() {
    let triangles = [tetrahedron([0, 1, 2, 3]), tetrahedron([1, 0, 4, 5])].concat();
    let result = run(6, &triangles);
    assert_eq!(census(&result), [2, 0, 0, 0]);
    assert_eq!((result.report.nonmanifold_edges, result.report.cut_vertices), (1, 2));
    assert_eq!((result.manifold.positions.len(), result.report.locked_vertices), (8, 4));
}

#[test]
fn a_wall_between_two_cells_is_a_piece_of_its_own() {
    // Two tetrahedra share the face 0 1 2, present twice: once it is residue, once it meets both sides' triangles.
    let triangles = [tetrahedron([0, 1, 2, 3]), tetrahedron([0, 2, 1, 4])].concat();
    let result = run(5, &triangles);
    assert_eq!((result.report.repeated_triangles, result.report.nonmanifold_edges), (1, 3));
    assert_eq!(census(&result), [3, 3, 9, 0]);
    assert_eq!(result.manifold.positions.len(), 3 + 4 + 4);
    assert_eq!(result.remainder.stitches.iter().map(Vec::len).collect::<Vec<_>>(), [3, 3, 3]);
    assert_eq!(result.report.locked_vertices, 9);
}

#[test]
fn bow_ties_come_apart() {
    let open = run(5, &[[0, 1, 2], [0, 3, 4]]);
    assert_eq!(census(&open), [2, 2, 6, 0]);
    assert_eq!((open.report.nonmanifold_vertices, open.report.locked_vertices), (1, 2));
    let closed = run(7, &[tetrahedron([0, 1, 2, 3]), tetrahedron([4, 3, 5, 6])].concat());
    assert_eq!(census(&closed), [2, 0, 0, 0]);
    assert_eq!((closed.report.nonmanifold_vertices, closed.report.nonmanifold_edges), (1, 0));
    assert_eq!((closed.manifold.positions.len(), closed.report.locked_vertices), (8, 2));
}

#[test]
fn a_vertex_of_very_many_fans_and_one_of_very_many_triangles() {
    let n = 100_000;
    let fans: Vec<_> = (0..n).map(|i| [0, 2 * i + 1, 2 * i + 2]).collect();
    let result = run(2 * n + 1, &fans);
    assert_eq!(census(&result), [n as usize, n as usize, 3 * n as usize, 0]);
    assert_eq!(result.report.locked_vertices, n as usize);
    let umbrella: Vec<_> = (0..n).map(|i| [0, 1 + i, 1 + (i + 1) % n]).collect();
    assert_eq!(census(&run(n + 1, &umbrella)), [1, 1, n as usize, 0]);
    let book: Vec<_> = (0..n).map(|i| [0, 1, 2 + i]).collect();
    assert_eq!(census(&run(n + 2, &book)), [n as usize, n as usize, 3 * n as usize, 0]);
}

#[test]
fn repeated_triangles_keep_their_orientation_and_number() {
    let back_to_back = run(3, &[[0, 1, 2], [0, 2, 1]]);
    assert_eq!(back_to_back.remainder.residue, [[0, 2, 1]]);
    assert_eq!(census(&back_to_back), [1, 1, 3, 0]);

    let mut triangles = TETRAHEDRON.to_vec();
    triangles.extend([[3, 1, 2], [3, 2, 1], [1, 3, 2]]);
    let result = run(4, &triangles);
    assert_eq!(result.remainder.residue, [[3, 1, 2], [3, 2, 1], [1, 3, 2]]);
    assert_eq!((result.report.repeated_triangles, result.report.degenerate_triangles), (3, 0));
    assert_eq!(census(&result), [1, 0, 0, 0]);
    assert_eq!(result.report.locked_vertices, 0);
}

#[test]
fn the_orientation_of_most_triangles_wins() {
    let mut turned_one = TETRAHEDRON;
    turned_one[0].swap(0, 1);
    let result = run(4, &turned_one);
    assert_eq!(result.remainder.flipped.iter_ones().collect::<Vec<_>>(), [0]);
    let mut turned_two = TETRAHEDRON;
    turned_two[0].swap(0, 1);
    turned_two[2].swap(0, 1);
    let result = run(4, &turned_two);
    assert_eq!(
        result.remainder.flipped.iter_ones().collect::<Vec<_>>(),
        [1, 3],
        "in a tie the first one stays"
    );
}

#[test]
fn degenerate_triangles_name_vertices_of_the_table_and_extras() {
    // Vertex 4 is in a degenerate triangle only, 5 in none.
    let result = run(6, &[[3, 3, 4], [1, 2, 3], [4, 4, 4]]);
    assert_eq!(result.manifold.positions, [1, 2, 3].map(|v| points(6)[v]));
    assert_eq!(result.remainder.extras, [0, 4, 5].map(|v| points(6)[v]));
    assert_eq!(result.remainder.residue, [[2, 2, 4], [4, 4, 4]]);
    assert_eq!((result.report.degenerate_triangles, result.report.isolated_vertices), (2, 2));
}

#[test]
fn a_mesh_in_one_point_is_all_residue() {
    let mesh = IndexedMesh::new(vec![[1.0, 2.0, 3.0]; 4], TETRAHEDRON.to_vec());
    let result = conditioned(&mesh, Weld::Exact);
    assert_eq!((result.manifold.positions.len(), result.remainder.extras.len()), (0, 1));
    assert_eq!(result.remainder.residue, [[0, 0, 0]; 4]);
    assert_eq!((result.report.welded_vertices, result.report.isolated_vertices), (3, 0));
    let kept = unweld::mesh::topology::condition(&mesh, Weld::None);
    assert_eq!(census(&kept), [1, 0, 0, 0]);
}

#[test]
fn the_two_zeros_are_one_place() {
    let positions = vec![
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [-0.0, -0.0, 0.0],
        [1.0, -0.0, 0.0],
        [0.0, -1.0, 0.0],
    ];
    let mesh = IndexedMesh::new(positions, vec![[0, 1, 2], [4, 3, 5]]);
    let result = conditioned(&mesh, Weld::Exact);
    assert_eq!((result.report.welded_vertices, result.manifold.positions.len()), (2, 4));
    assert_eq!(census(&result), [1, 1, 4, 0]);
    assert_eq!(unweld::mesh::topology::condition(&mesh, Weld::None).manifold.positions.len(), 6);
}

#[test]
fn unused_copies_count_as_welded_and_not_as_isolated() {
    let mut positions = points(4);
    positions.extend([points(4)[2], points(5)[4], points(5)[4]]);
    let result = conditioned(&IndexedMesh::new(positions, TETRAHEDRON.to_vec()), Weld::Exact);
    assert_eq!((result.report.welded_vertices, result.report.isolated_vertices), (2, 1));
    assert_eq!(result.remainder.extras, [points(5)[4]]);
}
