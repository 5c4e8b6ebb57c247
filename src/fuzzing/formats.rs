//! The readers of foreign meshes on hostile files.

use crate::formats::{self, Coordinates, Format, Precision, Source};
use crate::mesh::IndexedMesh;

/// Reads `data` as each of the formats. What is accepted is a mesh, and comes back from the writers.
pub fn fuzz_formats(data: &[u8]) {
    for hint in [None, Some(Format::Ply), Some(Format::Obj), Some(Format::Stl), Some(Format::Off)] {
        if let Ok(source) = formats::read_bytes(data, hint, "") {
            check(&source);
        }
    }
}

fn check(source: &Source) {
    let mesh = &source.mesh;
    assert!(!mesh.triangles.is_empty());
    assert!(mesh.positions.iter().flatten().all(|x| x.is_finite()));
    assert!(mesh.triangles.iter().flatten().all(|&v| (v as usize) < mesh.positions.len()));
    let mut ply = Vec::new();
    formats::write_ply(mesh, Precision::Float64, &mut ply).expect("finite coordinates can be written");
    let mut obj = Vec::new();
    formats::write_obj(mesh, &mut obj).expect("finite coordinates can be written");
    for (bytes, format) in [(ply, Format::Ply), (obj, Format::Obj)] {
        let back = formats::read_bytes(&bytes, Some(format), "").expect("what was written can be read");
        assert_eq!(back.mesh.triangles, mesh.triangles);
        assert_eq!(back.mesh.positions, mesh.positions);
    }
    if source.coordinates == Coordinates::Float32 {
        assert!(mesh.positions.iter().flatten().all(|&x| f64::from(x as f32) == x));
        let mut stl = Vec::new();
        formats::write_stl(mesh, &mut stl).expect("binary32 coordinates can be written");
        let back = formats::read_bytes(&stl, None, "").expect("what was written can be read");
        let corners = |mesh: &IndexedMesh| -> Vec<[f64; 3]> {
            mesh.triangles.iter().flatten().map(|&v| mesh.positions[v as usize]).collect()
        };
        assert_eq!((back.format, corners(&back.mesh)), (Format::Stl, corners(mesh)));
    }
}
