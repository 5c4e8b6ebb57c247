//! The ill-formed files of the test data: each is read, encoded, decoded and compared, or refused for a reason at a place.
//!
//! Figures are those of the data's README and of the files themselves, topology counted by another program from its
//! definitions. Bytes of the synthetic PLY files follow from their layout: a header of 199 bytes (206 in
//! `header_count_huge`), 162 vertices of 12 bytes, 320 faces of 13.
#![cfg(all(feature = "encode", feature = "formats"))]

mod common;

use common::triangles;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use Expected::{Fault, Mesh};
use unweld::decoder;
use unweld::encoder::{Encoder, Options};
use unweld::formats;
use unweld::mesh::IndexedMesh;
use unweld::mesh::topology::ConditioningReport;

/// What becomes of a file.
enum Expected {
    /// Vertices, triangles, what conditioning finds, what is dropped.
    Mesh(usize, usize, &'static str, &'static str),
    /// The error behind the name of the file.
    Fault(&'static str),
}

/// The folder of test data, or `None` with a message.
fn data() -> Option<PathBuf> {
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data");
    let folder = std::env::var_os("UNWELD_DATA").map_or_else(beside, PathBuf::from);
    if !folder.join("nasty").is_dir() {
        eprintln!("skipped: no test data in {}", folder.display());
        return None;
    }
    Some(folder)
}

#[test]
fn the_table_names_every_file() {
    let Some(folder) = data() else { return };
    let mut there = Vec::new();
    for sub in ["nasty", "nasty_real"] {
        for entry in folder.join(sub).read_dir().unwrap() {
            there.push(format!("{sub}/{}", entry.unwrap().file_name().to_string_lossy()));
        }
    }
    there.sort();
    assert_eq!(there, FILES.iter().map(|(name, _)| *name).collect::<Vec<_>>());
}

#[test]
fn every_file_does_what_the_table_says() {
    let Some(folder) = data() else { return };
    for (name, expected) in &FILES {
        let path = folder.join(name);
        match (expected, formats::read(&path)) {
            (Mesh(vertices, triangles, found, dropped), Ok(source)) => {
                let counts = (source.mesh.positions.len(), source.mesh.triangles.len());
                assert_eq!(counts, (*vertices, *triangles), "{name}");
                assert_eq!(source.dropped.join(", "), *dropped, "{name}");
                assert_eq!(findings(&there_and_back(name, &source.mesh)), *found, "{name}");
            }
            (Fault(what), Err(e)) => assert_eq!(e.to_string(), format!("{}: {what}", path.display())),
            (_, Ok(_)) => panic!("{name} was read"),
            (_, Err(e)) => panic!("{e}"),
        }
    }
}

/// Encodes, decodes and compares.
fn there_and_back(name: &str, mesh: &IndexedMesh) -> ConditioningReport {
    let mut file = Vec::new();
    let mut options = Options::default();
    options.simplify.base_vertices = Some(20);
    let report = Encoder::new(options).encode(mesh, &mut file).unwrap_or_else(|e| panic!("{name}: {e}"));
    let decoded = decoder::decode(&file, decoder::Options::default());
    let decoder = decoded.unwrap_or_else(|e| panic!("{name}: {e}"));
    let lattice = decoder.contents().unwrap().header.lattice;
    let back = decoder.assembled().unwrap();
    assert!(triangles(&back, &lattice) == triangles(mesh, &lattice), "{name}: other triangles");
    let places = |mesh: &IndexedMesh| -> BTreeSet<[i32; 3]> {
        mesh.positions.iter().map(|&p| lattice.quantise(p)).collect()
    };
    assert!(places(&back) == places(mesh), "{name}: other places");
    let welded = report.conditioning.welded_vertices;
    assert_eq!(back.positions.len(), mesh.positions.len() - welded, "{name}");
    report.conditioning
}

/// What conditioning found, in words. Where a surface is cut that has no orientation is the walk's choice, and what is
/// reversed follows from it.
fn findings(report: &ConditioningReport) -> String {
    let counts = [
        (report.welded_vertices, "welded"),
        (report.isolated_vertices, "isolated"),
        (report.degenerate_triangles, "degenerate"),
        (report.repeated_triangles, "repeated"),
        (report.nonmanifold_edges, "cut edges"),
        (report.nonmanifold_vertices, "cut vertices"),
    ];
    let mut words: Vec<String> =
        counts.iter().filter(|(n, _)| *n > 0).map(|(n, what)| format!("{n} {what}")).collect();
    match report.reoriented_triangles {
        _ if report.nonorientable_edges > 0 => words.push("not orientable".to_owned()),
        0 => {}
        n => words.push(format!("{n} reversed")),
    }
    if report.census.components != 1 {
        words.push(format!("{} pieces", report.census.components));
    }
    words.join(", ")
}

/// Every file of the two folders, in order.
#[rustfmt::skip]
const FILES: [(&str, Expected); 92] = [
    ("nasty/2000_single_triangles.obj", Mesh(6000, 2000, "2000 pieces", "")),
    ("nasty/300_closed_components.obj", Mesh(3600, 6000, "300 pieces", "")),
    ("nasty/annulus.obj", Mesh(48, 48, "", "")),
    ("nasty/attributes_on_some_faces.obj", Mesh(4, 3, "1 repeated", "")),
    ("nasty/cell_complex_3x3x3.obj", Mesh(64, 324, "108 repeated, 108 cut edges, 80 pieces", "")),
    ("nasty/checkerboard_bowties.obj", Mesh(81, 64, "2 isolated, 49 cut vertices, 32 pieces", "")),
    ("nasty/crlf_tabs_negative_indices.obj", Mesh(4, 4, "", "")),
    ("nasty/degenerate_collinear.obj", Mesh(36, 50, "30 welded, 50 degenerate, 0 pieces", "")),
    ("nasty/degenerate_index.obj", Mesh(162, 323, "3 degenerate", "")),
    ("nasty/degenerate_zero_area.obj", Mesh(36, 50, "2 welded, 4 degenerate", "")),
    ("nasty/denormal_coordinates.ply", Mesh(162, 320, "", "")),
    ("nasty/double_1e-9_detail.ply", Mesh(162, 320, "", "")),
    ("nasty/dup_faces.obj", Mesh(162, 360, "40 repeated", "")),
    ("nasty/dup_faces_opposite.obj", Mesh(162, 640, "320 repeated", "")),
    ("nasty/empty.obj", Fault("no triangles")),
    ("nasty/empty.off", Fault("no triangles")),
    ("nasty/empty.ply", Fault("no triangles")),
    ("nasty/far_from_origin_f64.ply", Mesh(162, 320, "", "")),
    ("nasty/flat_single_point.obj", Mesh(12, 20, "11 welded, 20 degenerate, 0 pieces", "")),
    ("nasty/header_count_huge.ply", Fault("byte 6310: the file ends early (element face)")),
    ("nasty/huge_coordinates.ply", Mesh(162, 320, "", "")),
    ("nasty/index_negative.ply", Fault("byte 6299: vertex index -1 is out of range: the file has 162 vertices (element face)")),
    ("nasty/index_out_of_range.ply", Fault("byte 6299: vertex index 5000 is out of range: the file has 162 vertices (element face)")),
    ("nasty/index_u16.ply", Mesh(162, 320, "", "")),
    ("nasty/inf_coordinate.ply", Fault("byte 407: y of vertex 17 is inf (element vertex)")),
    ("nasty/isolated_vertices.obj", Mesh(169, 320, "5 welded, 2 isolated", "")),
    ("nasty/klein_bottle.obj", Mesh(480, 960, "not orientable", "")),
    ("nasty/moebius.obj", Mesh(48, 48, "not orientable", "")),
    ("nasty/moebius_3_twists.obj", Mesh(96, 96, "not orientable", "")),
    ("nasty/nan_coordinate.obj", Fault("line 17: x of vertex 16 is NaN")),
    ("nasty/nan_coordinate.ply", Fault("byte 403: x of vertex 17 is NaN (element vertex)")),
    ("nasty/nested_spheres_inverted_inner.obj", Mesh(324, 640, "2 pieces", "")),
    ("nasty/nm_edge_book4.obj", Mesh(25, 32, "4 cut edges, 4 pieces", "")),
    ("nasty/nm_edge_fin.obj", Mesh(163, 321, "1 cut edges, 2 pieces", "")),
    ("nasty/nm_edge_tjunction_sheet.obj", Mesh(90, 144, "8 cut edges, 3 pieces", "")),
    ("nasty/nm_vertex_bowtie.obj", Mesh(84, 160, "1 welded, 1 cut vertices, 2 pieces", "")),
    ("nasty/nm_vertex_six_fans.obj", Mesh(13, 6, "1 cut vertices, 6 pieces", "")),
    ("nasty/one_vertex_valence_800.obj", Mesh(802, 1600, "", "")),
    ("nasty/orientation_one_flipped.obj", Mesh(162, 320, "1 reversed", "")),
    ("nasty/orientation_random.obj", Mesh(162, 320, "150 reversed", "")),
    ("nasty/plate_9_holes.obj", Mesh(169, 234, "9 isolated", "")),
    ("nasty/points_only.obj", Fault("no triangles, only vertices (162)")),
    ("nasty/polygons_odd.obj", Mesh(7, 7, "2 degenerate", "faces with fewer than 3 corners (1), polygons (3, cut into triangles)")),
    ("nasty/projective_plane_6v.obj", Mesh(6, 10, "not orientable", "")),
    ("nasty/single_triangle.obj", Mesh(3, 1, "", "")),
    ("nasty/tetrahedron.obj", Mesh(4, 4, "", "")),
    ("nasty/thin_strip_4000.obj", Mesh(4002, 4000, "", "")),
    ("nasty/tiny_coordinates.ply", Mesh(162, 320, "", "")),
    ("nasty/triangle_soup_grid.obj", Mesh(726, 242, "582 welded", "")),
    ("nasty/truncated.ply", Fault("byte 5801: the file ends early (element face)")),
    ("nasty/two_triangles_back_to_back.obj", Mesh(3, 2, "1 repeated", "")),
    ("nasty/uv_nan_and_huge.obj", Mesh(16, 18, "", "")),
    ("nasty/zero_bytes.ply", Fault("the file is empty")),
    ("nasty_real/bunny_res2_broken.ply.gz", Mesh(8171, 16301, "25 isolated, 87 repeated, 125 cut edges, 5 reversed, 69 pieces", "vertex property confidence of no triangle (25), vertex property intensity of no triangle (25)")),
    ("nasty_real/draco_Box_crlf_header.ply", Mesh(24, 12, "16 welded", "element material (1), polygons (4, cut into triangles)")),
    ("nasty_real/draco_cube_att.obj", Mesh(8, 12, "", "")),
    ("nasty_real/draco_cube_att_partial.obj", Mesh(8, 12, "", "normals of no triangle (1)")),
    ("nasty_real/draco_deg_faces.obj", Mesh(6, 4, "1 isolated, 1 degenerate", "")),
    ("nasty_real/draco_degenerate_mesh.obj", Mesh(3, 1, "2 welded, 1 degenerate, 0 pieces", "")),
    ("nasty_real/draco_extra_vertex.obj", Mesh(10, 3, "1 isolated, 3 pieces", "normals of no triangle (1)")),
    ("nasty_real/draco_inf_nan.obj", Fault("line 1: x of vertex 1 is inf")),
    ("nasty_real/draco_mat_test.obj", Mesh(3576, 1300, "2898 welded, 12 cut edges, 20 pieces", "")),
    ("nasty_real/draco_multiple_isolated_triangles.obj", Mesh(15, 5, "5 pieces", "")),
    ("nasty_real/draco_non_manifold_wrap.obj", Mesh(10, 12, "1 cut edges, 2 pieces", "")),
    ("nasty_real/draco_octagon_preserved.obj", Mesh(8, 6, "", "polygons (1, cut into triangles)")),
    ("nasty_real/draco_test_nm.obj", Mesh(114, 170, "17 isolated, 2 cut vertices", "normals of no triangle (17)")),
    ("nasty_real/draco_triangle_with_degenerate_tex_coords.obj", Mesh(3, 1, "", "")),
    ("nasty_real/mat_test.mtl", Fault("line 1: not an OBJ file: \"newmtl\" is no statement")),
    ("nasty_real/mepp_TriangleMeshCutVertices.off", Mesh(497, 648, "12 cut vertices, 96 reversed, 13 pieces", "")),
    ("nasty_real/mepp_cubeNonMan.off", Mesh(8, 14, "4 cut edges, 3 pieces", "")),
    ("nasty_real/mepp_dangling_edge2.off", Mesh(7, 8, "2 degenerate", "polygons (1, cut into triangles)")),
    ("nasty_real/mepp_goblet.off", Mesh(520, 1000, "18 welded", "polygons (490, cut into triangles)")),
    ("nasty_real/mepp_not_2_mani_complex_edge.off", Mesh(9, 11, "1 cut edges, 2 pieces", "polygons (4, cut into triangles)")),
    ("nasty_real/mepp_not_2_mani_complex_edge2.off", Mesh(9, 13, "3 cut edges, 3 pieces", "polygons (4, cut into triangles)")),
    ("nasty_real/mepp_not_2_mani_complex_edge3.off", Mesh(10, 13, "1 cut edges, 2 pieces", "polygons (5, cut into triangles)")),
    ("nasty_real/mepp_not_2_mani_hole.off", Mesh(9, 10, "1 reversed", "polygons (4, cut into triangles)")),
    ("nasty_real/mepp_not_2_mani_hole3.off", Mesh(9, 9, "2 cut vertices, 2 pieces", "polygons (4, cut into triangles)")),
    ("nasty_real/mepp_not_2_mani_hole4.off", Mesh(10, 10, "2 cut vertices, 2 pieces", "polygons (4, cut into triangles)")),
    ("nasty_real/mepp_tunnel4.off", Mesh(9, 13, "3 cut edges, 4 reversed, 3 pieces", "polygons (6, cut into triangles)")),
    ("nasty_real/trimesh_empty.ply", Fault("no triangles")),
    ("nasty_real/trimesh_empty.stl", Fault("no triangles")),
    ("nasty_real/trimesh_joined_tetrahedra.obj", Mesh(5, 8, "1 repeated, 3 cut edges, 3 pieces", "")),
    ("nasty_real/trimesh_multi.ply", Mesh(4, 2, "", "polygons (1, cut into triangles)")),
    ("nasty_real/trimesh_multibody.stl", Mesh(96, 32, "76 welded, 6 reversed, 2 pieces", "")),
    ("nasty_real/trimesh_nancolor.obj", Mesh(8, 12, "", "")),
    ("nasty_real/trimesh_not_convex.obj", Mesh(288, 96, "244 welded, 12 cut edges, 10 pieces", "")),
    ("nasty_real/trimesh_notenoughindices.obj", Mesh(3, 1, "", "faces with fewer than 3 corners (1)")),
    ("nasty_real/trimesh_shared.STL", Mesh(72, 24, "58 welded, 1 cut edges, 2 pieces", "")),
    ("nasty_real/trimesh_singlevn.obj", Mesh(4, 2, "", "")),
    ("nasty_real/trimesh_soup.stl", Mesh(300, 100, "100 pieces", "")),
    ("nasty_real/trimesh_two_objects.obj", Mesh(12, 16, "4 welded, 3 cut edges, 2 pieces", "")),
    ("nasty_real/trimesh_wallhole.obj", Mesh(92, 66, "57 welded, 1 repeated, 1 cut edges, 2 pieces", "polygons (13, cut into triangles)")),
];
