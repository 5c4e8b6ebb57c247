//! Reads every file of the folder of real meshes and compares with the figures of its README.
#![cfg(feature = "formats")]

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use unweld::Error;
use unweld::error::Place;
use unweld::formats::{self, Coordinates, Format, Precision};
use unweld::mesh::attributes::NO_VALUE;
use unweld::mesh::{Attribute, IndexedMesh};

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
fn what_is_kept_and_what_is_lost_is_said() {
    let Some(folder) = data() else { return };
    for (file, format, polygons, coordinates, kept, dropped) in [
        (
            "scan_bunny.ply.gz",
            Format::Ply,
            0,
            Coordinates::Float32,
            "confidence 1 34834, intensity 1 34834",
            // The scan has vertices of no triangle.
            &[
                "vertex property confidence of no triangle (1113)",
                "vertex property intensity of no triangle (1113)",
            ][..],
        ),
        ("organic_horse.ply.gz", Format::Ply, 0, Coordinates::Float32, "normal 3 48485", &[]),
        ("synth_terrain_utm_f64_holes.ply.gz", Format::Ply, 0, Coordinates::Float64, "", &[]),
        (
            "poly_suzanne.obj",
            Format::Obj,
            468,
            Coordinates::Text,
            "normal 3 507",
            &["polygons (468, cut into triangles)"],
        ),
        ("tex_bunny10k_wedge.ply.gz", Format::Ply, 0, Coordinates::Float32, "uv 2 29997, color 4 9999", &[]),
        ("tex_fuze/fuze.obj", Format::Obj, 0, Coordinates::Text, "uv 2 664, normal 3 502, part 1 1", &[]),
        ("tex_spot/spot_triangulated.obj.gz", Format::Obj, 0, Coordinates::Text, "uv 2 3225", &[]),
        (
            "tex_ico4uv/ico4uv.obj",
            Format::Obj,
            0,
            Coordinates::Text,
            "uv 2 729, normal 3 1280, part 1 1",
            &[],
        ),
        (
            "colour_knot_quality.ply.gz",
            Format::Ply,
            0,
            Coordinates::Float32,
            "color 4 12800, quality 1 12800",
            &[],
        ),
        (
            "cad_tray.stl.gz",
            Format::Stl,
            0,
            Coordinates::Text,
            "part 1 1",
            &["facet normals other than the triangles' (1752)"],
        ),
        (
            "cad_plate_holes.stl",
            Format::Stl,
            0,
            Coordinates::Float32,
            "",
            &["facet normals other than the triangles' (868)"],
        ),
        ("colour_swirl_gradient.off.gz", Format::Off, 0, Coordinates::Text, "color 3 9216", &[]),
        (
            "nasty/polygons_odd.obj",
            Format::Obj,
            3,
            Coordinates::Text,
            "",
            &["faces with fewer than 3 corners (1)", "polygons (3, cut into triangles)"],
        ),
    ] {
        let source = formats::read(&folder.join(file)).unwrap();
        assert_eq!(source.format, format, "{file}");
        assert_eq!((source.polygons, source.coordinates), (polygons, coordinates), "{file}");
        let told = |a: &Attribute| format!("{} {} {}", a.title(), a.components, a.count());
        let attributes: Vec<String> = source.mesh.attributes.iter().map(told).collect();
        assert_eq!(
            (attributes.join(", ").as_str(), &source.dropped[..]),
            (kept, &dropped.iter().map(|d| d.to_string()).collect::<Vec<_>>()[..]),
            "{file}"
        );
    }
}

/// Numbers of each corner, or of each triangle.
fn numbers(attribute: &Attribute) -> Vec<Option<Vec<u64>>> {
    let value = |value: u32| -> Vec<u64> {
        let first = value as usize * attribute.components;
        (first..first + attribute.components).map(|at| attribute.values.bits(at)).collect()
    };
    attribute.corners.iter().map(|&at| (at != NO_VALUE).then(|| value(at))).collect()
}

#[test]
fn real_meshes_survive_writing() {
    let Some(folder) = data() else { return };
    for file in [
        "scan_bunny.ply.gz",
        "cad_fandisk.obj.gz",
        "nasty/denormal_coordinates.ply",
        "tex_fuze/fuze.obj",
        "tex_spot/spot_triangulated.obj.gz",
        "tex_bunny10k_wedge.ply.gz",
        "tex_ico4uv/ico4uv.obj",
        "colour_knot_quality.ply.gz",
        "comps_cycloidal_colour.ply.gz",
    ] {
        let mesh = formats::read(&folder.join(file)).unwrap().mesh;
        let corners = |mesh: &IndexedMesh| -> Vec<[f64; 3]> {
            mesh.triangles.iter().flatten().map(|&v| mesh.positions[v as usize]).collect()
        };
        for format in [Format::Ply, Format::Obj] {
            let mut bytes = Vec::new();
            match format {
                Format::Ply => formats::write_ply(&mesh, Precision::Float64, &mut bytes).unwrap(),
                _ => formats::write_obj(&mesh, Precision::Float64, &mut bytes).unwrap(),
            }
            let back = formats::read_bytes(&bytes, Some(format), file).unwrap().mesh;
            assert!(corners(&back) == corners(&mesh), "{file} {format:?}");
            let lost = formats::unwritten(&mesh, format);
            for attribute in &mesh.attributes {
                if lost.iter().any(|lost| lost.contains(&format!(" {}", attribute.title()))) {
                    continue;
                }
                let same = |a: &&Attribute| {
                    (a.semantic, a.domain, &a.name) == (attribute.semantic, attribute.domain, &attribute.name)
                };
                let back = back
                    .attributes
                    .iter()
                    .find(same)
                    .unwrap_or_else(|| panic!("{file} {format:?} {}", attribute.title()));
                // Fractions of text are the nearest to those of bytes.
                if format == Format::Obj && attribute.normalised {
                    continue;
                }
                assert!(numbers(back) == numbers(attribute), "{file} {format:?} {}", attribute.title());
            }
        }
    }
}
