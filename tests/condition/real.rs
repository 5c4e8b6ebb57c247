//! The ill-formed files of the test data, with the figures of their README.

use std::path::PathBuf;

use unweld::mesh::IndexedMesh;
use unweld::mesh::topology::{Conditioned, Weld, condition};

use super::conditioned;

/// The folder of test data, or `None` with a message.
fn data() -> Option<PathBuf> {
    let beside = || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared/data");
    let folder = std::env::var_os("UNWELD_DATA").map_or_else(beside, PathBuf::from);
    if !folder.join("nasty").is_dir() {
        eprintln!("skipped: no test data in {}", folder.display());
        return None;
    }
    Some(folder)
}

/// Positions and polygons of an OBJ file; polygons become fans of triangles. Only as much as the test data need.
fn read_obj(text: &str) -> IndexedMesh {
    let mut mesh = IndexedMesh::default();
    for line in text.replace("\\\r\n", " ").replace("\\\n", " ").lines() {
        let mut words = line.split_whitespace();
        match words.next() {
            Some("v") => {
                let mut coordinate = || words.next().unwrap().parse().unwrap();
                mesh.positions.push([coordinate(), coordinate(), coordinate()]);
            }
            Some("f") => {
                let count = mesh.positions.len() as i64;
                let index = |word: &str| match word.split('/').next().unwrap().parse::<i64>().unwrap() {
                    i if i < 0 => (count + i) as u32,
                    i => (i - 1) as u32,
                };
                let polygon: Vec<u32> = words.map(index).collect();
                mesh.triangles.extend(polygon.windows(2).skip(1).map(|pair| [polygon[0], pair[0], pair[1]]));
            }
            _ => {}
        }
    }
    mesh
}

fn read(name: &str) -> Option<IndexedMesh> {
    Some(read_obj(&std::fs::read_to_string(data()?.join("nasty").join(name)).unwrap()))
}

/// Components, boundary loops, boundary edges, handles.
fn census(result: &Conditioned) -> [usize; 4] {
    let census = result.report.census;
    [census.components, census.boundary_loops, census.boundary_edges, census.handles]
}

#[test]
fn every_ill_formed_file_becomes_a_manifold() {
    let Some(folder) = data() else { return };
    let mut files = 0;
    for folder in ["nasty", "nasty_real"].map(|name| folder.join(name)) {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.extension().is_some_and(|extension| extension == "obj") {
                let mesh = read_obj(&String::from_utf8_lossy(&std::fs::read(&path).unwrap()));
                conditioned(&mesh, Weld::Exact);
                assert_eq!(condition(&mesh, Weld::None).manifold.table.check(), Ok(()));
                files += 1;
            }
        }
    }
    assert!(files > 30, "{files} files");
}

#[test]
fn the_figures_are_those_of_the_readme() {
    // Name, vertices in triangles, [components, loops, boundary edges, handles], cut vertices without a cut edge.
    let whole = [
        ("2000_single_triangles.obj", 6000, [2000, 2000, 6000, 0], 0),
        ("300_closed_components.obj", 3600, [300, 0, 0, 0], 0),
        ("annulus.obj", 48, [1, 2, 48, 0], 0),
        ("checkerboard_bowties.obj", 79, [32, 32, 128, 0], 49),
        ("nested_spheres_inverted_inner.obj", 324, [2, 0, 0, 0], 0),
        ("nm_vertex_six_fans.obj", 13, [6, 6, 18, 0], 1),
        ("one_vertex_valence_800.obj", 802, [1, 0, 0, 0], 0),
        ("orientation_one_flipped.obj", 162, [1, 0, 0, 0], 0),
        ("orientation_random.obj", 162, [1, 0, 0, 0], 0),
        ("plate_9_holes.obj", 160, [1, 10, 102, 0], 0),
        ("thin_strip_4000.obj", 4002, [1, 1, 4002, 0], 0),
        ("triangle_soup_grid.obj", 144, [1, 1, 44, 0], 0),
        ("crlf_tabs_negative_indices.obj", 4, [1, 0, 0, 0], 0),
    ];
    for (name, vertices, expected, bow_ties) in whole {
        let Some(mesh) = read(name) else { return };
        let result = conditioned(&mesh, Weld::Exact);
        assert_eq!(census(&result), expected, "{name}");
        assert_eq!(result.report.nonmanifold_vertices, bow_ties, "{name}");
        let copies: usize = result.remainder.stitches.iter().map(|group| group.len() - 1).sum();
        assert_eq!(result.manifold.positions.len() - copies, vertices, "{name}");
    }
}

#[test]
fn a_cell_complex_comes_apart_into_walls_and_corners() {
    // 27 cubes have 3 * 4 * 9 = 108 different squares, 54 of them inside, where both cubes have one: 54 * 2 repeated
    // triangles. Of 144 grid edges the 36 along the edges of the whole are joined, 108 have three or four squares. So
    // the 54 squares inside are alone (4 vertices, 4 edges), and outside there are 8 corners of three squares
    // (7 vertices, 6 edges), 12 edges of two (6, 6) and 6 middles (4, 4).
    let Some(mesh) = read("cell_complex_3x3x3.obj") else { return };
    let result = conditioned(&mesh, Weld::Exact);
    assert_eq!((result.report.repeated_triangles, result.report.nonmanifold_edges), (108, 108));
    assert_eq!(census(&result), [54 + 8 + 12 + 6, 80, 54 * 4 + 8 * 6 + 12 * 6 + 6 * 4, 0]);
    assert_eq!(result.manifold.positions.len(), 54 * 4 + 8 * 7 + 12 * 6 + 6 * 4);
    // All but the corners of the whole.
    assert_eq!((result.report.cut_vertices, result.report.locked_vertices), (56, 360));
}

#[test]
fn what_cannot_be_oriented_or_is_no_manifold_is_cut() {
    // Name, [components, loops, boundary edges, handles], edges cut: non-manifold, non-orientable.
    let cut = [
        // One edge across the strip: 48 edges of boundary, and that edge twice.
        ("moebius.obj", [1, 1, 48 + 2, 0], (0, 1)),
        ("moebius_3_twists.obj", [1, 1, 96 + 2, 0], (0, 1)),
        // A page is a strip of four squares: four edges at the spine, four outside, one at either end.
        ("nm_edge_book4.obj", [4, 4, 4 * 10, 0], (4, 0)),
        ("nm_edge_fin.obj", [2, 1, 3, 0], (1, 0)),
    ];
    for (name, expected, edges) in cut {
        let Some(mesh) = read(name) else { return };
        let result = conditioned(&mesh, Weld::Exact);
        assert_eq!(census(&result), expected, "{name}");
        assert_eq!((result.report.nonmanifold_edges, result.report.nonorientable_edges), edges, "{name}");
    }
    let Some(mesh) = read("klein_bottle.obj") else { return };
    let result = conditioned(&mesh, Weld::Exact);
    let cuts = result.report.nonorientable_edges;
    assert!(cuts > 2);
    let [components, _, boundary_edges, handles] = census(&result);
    assert_eq!((components, boundary_edges, handles), (1, 2 * cuts, 0));
}

#[test]
fn residue_and_extras_have_the_numbers_of_the_readme() {
    // Name, degenerate, repeated, welded, isolated.
    let numbers = [
        ("degenerate_index.obj", [3, 0, 0, 0]),
        ("dup_faces.obj", [0, 40, 0, 0]),
        ("dup_faces_opposite.obj", [0, 320, 0, 0]),
        ("flat_single_point.obj", [20, 0, 11, 0]),
        ("degenerate_collinear.obj", [50, 0, 30, 0]),
        ("isolated_vertices.obj", [0, 0, 5, 2]),
        ("points_only.obj", [0, 0, 0, 162]),
        ("two_triangles_back_to_back.obj", [0, 1, 0, 0]),
        ("nm_vertex_bowtie.obj", [0, 0, 1, 0]),
    ];
    for (name, expected) in numbers {
        let Some(mesh) = read(name) else { return };
        let r = conditioned(&mesh, Weld::Exact).report;
        let found = [r.degenerate_triangles, r.repeated_triangles, r.welded_vertices, r.isolated_vertices];
        assert_eq!(found, expected, "{name}");
    }
}
