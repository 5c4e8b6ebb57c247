//! Reads every file of the folder of real meshes and compares with the figures of its README.
#![cfg(feature = "formats")]

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use unweld::Error;
use unweld::error::Place;
use unweld::formats::{self, Coordinates, Format, Precision};

/// The folder of real meshes, if it is there.
fn data() -> Option<PathBuf> {
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data");
    let folder = std::env::var_os("UNWELD_DATA").map_or_else(beside, PathBuf::from);
    if !folder.is_dir() {
        eprintln!("skipped: no folder {}", folder.display());
        return None;
    }
    Some(folder)
}

/// All files below a folder.
fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path());
    entries.flat_map(|path| if path.is_dir() { files(&path) } else { vec![path] }).collect()
}

/// Vertices and triangles of each file, as far as the README states them and does not call them faulty.
fn figures(folder: &Path) -> HashMap<String, (usize, usize)> {
    let readme = std::fs::read_to_string(folder.join("README.md")).unwrap();
    let figure = |row: &str| {
        let columns: Vec<&str> = row.split('|').map(str::trim).collect();
        let [_, file, _bytes, v, f, _, _, _, _, other, ..] = columns[..] else { return None };
        let sound = !other.contains("nonfinite") && !other.contains("badindex");
        // `2216 (13560 stored)`: the former after welding.
        let v = v.split_once('(').map_or(v, |(_, stored)| stored.trim_end_matches(" stored)"));
        sound.then_some((file.to_owned(), (v.parse().ok()?, f.parse().ok()?)))
    };
    readme.lines().filter_map(figure).collect()
}

#[test]
fn every_file_is_read_or_refused_at_a_place() {
    let Some(folder) = data() else { return };
    let figures = figures(&folder);
    let (mut read, mut refused) = (0, 0);
    for path in files(&folder).iter().filter(|p| Format::from_path(p).is_some()) {
        let relative = path.strip_prefix(&folder).unwrap().to_string_lossy();
        // They have expectations of their own.
        if ["field/", "hostile/", "gltf/"].iter().any(|folder| relative.starts_with(folder)) {
            continue;
        }
        // The tables of the folder `bench` give bare names.
        let stated = figures.get(relative.trim_start_matches("bench/")).copied();
        match formats::read(path) {
            Ok(source) => {
                let counts = (source.mesh.positions.len(), source.mesh.triangles.len());
                assert_eq!(Some(counts), stated, "{relative}");
                read += 1;
            }
            Err(Error::Input(e)) => {
                assert!(stated.is_none_or(|(_, triangles)| triangles == 0), "{e}");
                assert_eq!(e.file, path.to_string_lossy());
                let nothing = e.what.starts_with("no triangles") || e.what == "the file is empty";
                assert_eq!(e.place == Place::Whole, nothing, "{e}");
                refused += 1;
            }
            Err(e) => panic!("{relative}: {e}"),
        }
    }
    assert!(read > 100 && refused > 10, "{read} read, {refused} refused");
}

#[test]
fn figures_known_by_heart() {
    let Some(folder) = data() else { return };
    for (file, vertices, triangles) in [
        ("scan_bunny.ply.gz", 35947, 69451),
        ("bench/igea.ply.gz", 134345, 268686),
        ("bench/dragon_vrip.ply.gz", 437645, 871414),
        ("nasty/crlf_tabs_negative_indices.obj", 4, 4),
        ("nasty_real/draco_Box_crlf_header.ply", 24, 12),
    ] {
        let mesh = formats::read(&folder.join(file)).unwrap().mesh;
        assert_eq!((mesh.positions.len(), mesh.triangles.len()), (vertices, triangles), "{file}");
    }
}

#[test]
fn faults_are_placed() {
    let Some(folder) = data() else { return };
    for (file, place, what) in [
        ("nasty/truncated.ply", Place::Byte(5801), "the file ends early (element face)"),
        ("nasty/header_count_huge.ply", Place::Byte(6310), "the file ends early (element face)"),
        ("nasty/nan_coordinate.ply", Place::Byte(403), "x of vertex 17 is NaN (element vertex)"),
        ("nasty/inf_coordinate.ply", Place::Byte(407), "y of vertex 17 is inf (element vertex)"),
        (
            "nasty/index_negative.ply",
            Place::Byte(6299),
            "vertex index -1 is out of range: the file has 162 vertices (element face)",
        ),
        (
            "nasty/index_out_of_range.ply",
            Place::Byte(6299),
            "vertex index 5000 is out of range: the file has 162 vertices (element face)",
        ),
        ("nasty/zero_bytes.ply", Place::Whole, "the file is empty"),
        ("nasty/points_only.obj", Place::Whole, "no triangles, only vertices (162)"),
        ("nasty_real/draco_inf_nan.obj", Place::Line(1), "x of vertex 1 is inf"),
    ] {
        let Err(Error::Input(e)) = formats::read(&folder.join(file)) else { panic!("{file}") };
        assert_eq!((e.place, e.what.as_str()), (place, what), "{file}");
    }
}

#[test]
fn what_is_lost_is_said() {
    let Some(folder) = data() else { return };
    for (file, format, polygons, coordinates, dropped) in [
        (
            "scan_bunny.ply.gz",
            Format::Ply,
            0,
            Coordinates::Float32,
            &["vertex property confidence", "vertex property intensity"][..],
        ),
        ("organic_horse.ply.gz", Format::Ply, 0, Coordinates::Float32, &["vertex normals"]),
        ("synth_terrain_utm_f64_holes.ply.gz", Format::Ply, 0, Coordinates::Float64, &[]),
        (
            "poly_suzanne.obj",
            Format::Obj,
            468,
            Coordinates::Text,
            &["normals (507)", "polygons (468, cut into triangles)"],
        ),
        (
            "tex_bunny10k_wedge.ply.gz",
            Format::Ply,
            0,
            Coordinates::Float32,
            &["face texture coordinates", "face colours", "texture file names (1)"],
        ),
        ("cad_tray.stl.gz", Format::Stl, 0, Coordinates::Text, &["facet normals", "names of solids (1)"]),
        ("cad_plate_holes.stl", Format::Stl, 0, Coordinates::Float32, &["facet normals"]),
        ("colour_swirl_gradient.off.gz", Format::Off, 0, Coordinates::Text, &["vertex colours"]),
        (
            "nasty/polygons_odd.obj",
            Format::Obj,
            3,
            Coordinates::Text,
            &["faces with fewer than 3 corners (1)", "polygons (3, cut into triangles)"],
        ),
    ] {
        let source = formats::read(&folder.join(file)).unwrap();
        assert_eq!(source.format, format, "{file}");
        assert_eq!((source.polygons, source.coordinates), (polygons, coordinates), "{file}");
        assert_eq!(source.dropped, dropped, "{file}");
    }
}

#[test]
fn real_meshes_survive_writing() {
    let Some(folder) = data() else { return };
    for file in ["scan_bunny.ply.gz", "cad_fandisk.obj.gz", "nasty/denormal_coordinates.ply"] {
        let mesh = formats::read(&folder.join(file)).unwrap().mesh;
        let (mut ply, mut obj) = (Vec::new(), Vec::new());
        formats::write_ply(&mesh, Precision::Float64, &mut ply).unwrap();
        formats::write_obj(&mesh, Precision::Float64, &mut obj).unwrap();
        for bytes in [ply, obj] {
            assert_eq!(formats::read_bytes(&bytes, None, file).unwrap().mesh, mesh, "{file}");
        }
    }
}
