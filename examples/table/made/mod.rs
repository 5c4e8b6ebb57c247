//! Meshes made by code, the same on every machine.

pub mod fresh;
mod isosurface;
mod mixture;
pub mod noise;
pub mod parts;
mod sheet;
pub mod structured;
mod subdivision;
mod tube;
mod zip;

use std::collections::HashMap;
use unweld::mesh::IndexedMesh;
use zip::Facet;

/// A mesh and its name.
pub type Made = (&'static str, IndexedMesh);

/// A mesh of triangles by their corners' places; nearly equal ones are one vertex.
fn assemble(facets: &[Facet]) -> IndexedMesh {
    let (mut numbers, mut positions) = (HashMap::new(), Vec::new());
    let vertex = |p: [f64; 3]| {
        *numbers.entry(p.map(|x| (x * 1e9).round() as i64)).or_insert_with(|| {
            positions.push(p);
            positions.len() as u32 - 1
        })
    };
    let triangles = facets.as_flattened().iter().copied().map(vertex).collect::<Vec<u32>>();
    IndexedMesh::new(positions, triangles.as_chunks().0.to_vec())
}

/// A mesh without the vertices that are in no triangle.
pub fn compact(mesh: &IndexedMesh) -> IndexedMesh {
    let (mut numbers, mut positions) = (HashMap::new(), Vec::new());
    let vertex = |&v: &u32| {
        *numbers.entry(v).or_insert_with(|| {
            positions.push(mesh.positions[v as usize]);
            positions.len() as u32 - 1
        })
    };
    let triangles: Vec<u32> = mesh.triangles.as_flattened().iter().map(vertex).collect();
    IndexedMesh::new(positions, triangles.as_chunks().0.to_vec())
}
