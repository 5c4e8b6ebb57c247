//! The readers of foreign meshes on hostile files.

use std::fmt::Write;

use crate::error::Error;
use crate::formats::{self, Coordinates, Format, Precision, ReadOptions, Source};
use crate::mesh::IndexedMesh;
use crate::mesh::attributes::NO_VALUE;

/// Reads `data` as each of the formats, also by force, and as the outline of a polygon. What is accepted is a mesh, and comes
/// back from the writers; what is read without force is read alike with it.
pub fn fuzz_formats(data: &[u8]) {
    let formats = [Format::Ply, Format::Obj, Format::Stl, Format::Off, Format::Gltf].map(Some);
    for format in formats.into_iter().chain([None]) {
        let read = |force| {
            let options = ReadOptions { format, max_memory: MOST_INFLATED, force, ..ReadOptions::default() };
            formats::read_with(data, &options)
        };
        match (read(false), read(true)) {
            (Ok(source), forced) => {
                check(&source);
                // Two numbers that are none are the same by their text.
                let (forced, plain) = (forced.expect("force refuses nothing"), &source);
                assert!(forced == *plain || format!("{forced:?}") == format!("{plain:?}"));
            }
            (Err(Error::Input(_) | Error::Limit { .. }), Ok(forced)) => check(&forced),
            (Err(Error::Input(_) | Error::Limit { .. }), Err(_)) => {}
            (Err(e), _) => panic!("{e}"),
        }
    }
    polygon(data);
}

/// Takes bytes for the corners of a polygon on a grid of 16 x 16, on a plane that the first byte tilts. Whatever its outline, the
/// triangles have its corners and its area, counted with their signs; where nothing is said of it, none is turned.
fn polygon(data: &[u8]) {
    let Some((&tilt, corners)) = data.split_first() else { return };
    let corners = &corners[..corners.len().min(MOST_CORNERS)];
    if corners.len() < 3 {
        return;
    }
    let flat: Vec<[i64; 2]> = corners.iter().map(|&b| [i64::from(b >> 4), i64::from(b & 15)]).collect();
    let slope = [i64::from(tilt % 5), i64::from(tilt / 5 % 5)];
    let mut text = String::new();
    for [x, y] in &flat {
        let z = slope[0] * x - slope[1] * y;
        writeln!(text, "v {x} {y} {z}").expect("strings take all");
    }
    let face: String = (1..=flat.len()).map(|k| format!(" {k}")).collect();
    let source = formats::read_bytes(format!("{text}f{face}\n").as_bytes(), None, "").expect("a polygon");
    let triangles = &source.mesh.triangles;
    assert_eq!(triangles.len(), flat.len() - 2);
    let mut used = vec![false; flat.len()];
    triangles.iter().flatten().for_each(|&v| used[v as usize] = true);
    assert!(used.iter().all(|&used| used));
    // Twice the areas as seen along z.
    let cross = |[a, b]: [[i64; 2]; 2]| a[0] * b[1] - a[1] * b[0];
    let area = |outline: &[[i64; 2]]| -> i64 {
        (0..outline.len()).map(|k| cross([outline[k], outline[(k + 1) % outline.len()]])).sum()
    };
    let (whole, areas) = (area(&flat), triangles.iter().map(|t| area(&t.map(|v| flat[v as usize]))));
    assert_eq!(areas.clone().sum::<i64>(), whole);
    if !source.dropped.iter().any(|note| note.contains("cross themselves")) {
        assert!(areas.clone().all(|area| area * whole.signum() >= 0), "{:?}", areas.collect::<Vec<_>>());
    }
}

/// Bytes that a compressed file may inflate to.
const MOST_INFLATED: u64 = 1 << 20;

const MOST_CORNERS: usize = 64;

fn check(source: &Source) {
    let mesh = &source.mesh;
    assert!(!mesh.triangles.is_empty());
    assert!(mesh.positions.iter().flatten().all(|x| x.is_finite()));
    assert!(mesh.triangles.iter().flatten().all(|&v| (v as usize) < mesh.positions.len()));
    check_attributes(mesh);
    let mut ply = Vec::new();
    formats::write_ply(mesh, Precision::Float64, &mut ply).expect("finite coordinates can be written");
    let mut obj = Vec::new();
    formats::write_obj(mesh, Precision::Float64, &mut obj).expect("finite coordinates can be written");
    for (bytes, format) in [(ply, Format::Ply), (obj, Format::Obj)] {
        let back = formats::read_bytes(&bytes, Some(format), "").expect("what was written can be read");
        check_attributes(&back.mesh);
        // A vertex may have been split for its attributes.
        let lost = formats::unwritten(mesh, format);
        if lost.iter().any(|lost| lost.contains("written once more")) {
            assert_eq!(corners(&back.mesh), corners(mesh));
        } else {
            assert_eq!(back.mesh.triangles, mesh.triangles);
            assert_eq!(back.mesh.positions, mesh.positions);
        }
    }
    if source.coordinates == Coordinates::Float32 {
        assert!(mesh.positions.iter().flatten().all(|&x| f64::from(x as f32) == x));
        let mut stl = Vec::new();
        formats::write_stl(mesh, &mut stl).expect("binary32 coordinates can be written");
        let back = formats::read_bytes(&stl, None, "").expect("what was written can be read");
        check_attributes(&back.mesh);
        assert_eq!((back.format, corners(&back.mesh)), (Format::Stl, corners(mesh)));
        let mut decimals = Vec::new();
        formats::write_obj(mesh, Precision::Float32, &mut decimals)
            .expect("binary32 coordinates can be written");
        let back =
            formats::read_bytes(&decimals, Some(Format::Obj), "").expect("what was written can be read");
        let rounded = |mesh: &IndexedMesh| -> Vec<f32> {
            mesh.positions.as_flattened().iter().map(|&x| x as f32).collect()
        };
        assert_eq!((rounded(&back.mesh), &back.mesh.triangles), (rounded(mesh), &mesh.triangles));
    }
}

/// Each is one of the mesh, and no value is one that nothing has.
fn check_attributes(mesh: &IndexedMesh) {
    for attribute in &mesh.attributes {
        assert_eq!(attribute.check(mesh.triangles.len()), Ok(()));
        let mut used = vec![false; attribute.count()];
        let values = attribute.corners.iter().filter(|&&value| value != NO_VALUE);
        values.for_each(|&value| used[value as usize] = true);
        assert!(!used.is_empty() && used.iter().all(|&used| used), "{}", attribute.title());
    }
}

fn corners(mesh: &IndexedMesh) -> Vec<[f64; 3]> {
    mesh.triangles.iter().flatten().map(|&v| mesh.positions[v as usize]).collect()
}
