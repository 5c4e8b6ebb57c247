//! Which vertices of a scene's mesh are of which of its meshes, as the parts that its JSON names tell (spec §14.2).

use std::collections::HashMap;

use serde_json::Value;

use super::carried::EXTENSION;
use crate::error::{Error, Place, Result};
use crate::formats::scene::Scene;
use crate::mesh::IndexedMesh;
use crate::mesh::attributes::Semantic;

/// The mesh of a scene as the reader of glTF has it: its vertices by bodies, each body told ([`IndexedMesh::bodies`]). They are those of `mesh`
/// in their order, where these are so already; one that triangles of several bodies have is one of each.
///
/// # Errors
/// [`Error::Input`] where the scene's JSON is none.
pub fn in_bodies(mesh: IndexedMesh, scene: &Scene) -> Result<IndexedMesh> {
    let json: Value = serde_json::from_slice(&scene.json).map_err(|e| {
        Error::from(crate::error::InputError::new("", Place::Whole, format!("the scene's JSON: {e}")))
    })?;
    let of_parts = bodies_of_parts(&json);
    let body = |part: Option<u32>| part.and_then(|part| of_parts.get(&part).copied()).unwrap_or(NOBODY);
    let parts = mesh.attributes.iter().find(|attribute| attribute.semantic == Semantic::Part);
    let part = |t: usize| {
        parts.and_then(|parts| Some(parts.values.number(parts.components * parts.at(t, 0)?) as u32))
    };
    // Each vertex in each body that has it, which is one but in files of others; those of no triangle come first.
    let mut places: Vec<(u32, u32)> = Vec::with_capacity(mesh.positions.len());
    let mut is_used = vec![false; mesh.positions.len()];
    let mut of_triangles = Vec::with_capacity(mesh.triangles.len());
    let mut last = vec![None; mesh.positions.len()];
    for (t, triangle) in mesh.triangles.iter().enumerate() {
        let body = body(part(t));
        of_triangles.push(body);
        for &v in triangle {
            is_used[v as usize] = true;
            if last[v as usize].replace(body) != Some(body) {
                places.push((body, v));
            }
        }
    }
    places.extend((0..).zip(&is_used).filter(|(_, used)| !**used).map(|(v, _)| (0, v)));
    places.sort_unstable();
    places.dedup();
    let mut bodies: Vec<u32> = Vec::new();
    let mut before = None;
    for (k, &(body, _)) in (0..).zip(&places) {
        if before.replace(body) != Some(body) {
            bodies.push(k);
        }
    }
    let number = |body: u32, v: u32| places.binary_search(&(body, v)).map_or(0, |k| k as u32);
    let triangles = mesh.triangles.iter().zip(&of_triangles).map(|(t, &body)| t.map(|v| number(body, v)));
    Ok(IndexedMesh {
        triangles: triangles.collect(),
        positions: places.iter().map(|&(_, v)| mesh.positions[v as usize]).collect(),
        bodies,
        ..mesh
    })
}

/// A part is of the body of the first mesh that has it; bodies are numbered as they come.
fn bodies_of_parts(json: &Value) -> HashMap<u32, u32> {
    let mut of_parts = HashMap::new();
    let mut next = 0;
    let list = |of: &Value, key: &str| of[key].as_array().cloned().unwrap_or_default();
    for mesh in list(json, "meshes") {
        let mut is_new = false;
        for primitive in list(&mesh, "primitives") {
            let part =
                primitive["extensions"][EXTENSION]["part"].as_u64().and_then(|part| u32::try_from(part).ok());
            let Some(part) = part else { continue };
            of_parts.entry(part).or_insert_with(|| {
                is_new = true;
                next
            });
        }
        next += u32::from(is_new);
    }
    of_parts
}

/// Of parts that no mesh names.
const NOBODY: u32 = u32::MAX;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::attributes::Attribute;
    use serde_json::json;

    #[test]
    fn vertices_by_the_meshes_that_have_their_parts() {
        let of = |part: u32| json!({"extensions": {EXTENSION: {"part": part}}});
        let json = json!({"meshes": [
            {"primitives": [of(0), of(2)]}, {"primitives": [of(2)]}, {"primitives": [of(0), of(1)]}, {"primitives": [{}]},
        ]});
        let scene = Scene { json: json.to_string().into_bytes(), buffers: vec![] };
        // Vertex 4 is of two bodies, vertex 1 of no triangle.
        let positions = (0..6).map(|k| [f64::from(k), 0.0, 0.0]).collect();
        let mut mesh = IndexedMesh::new(positions, vec![[0, 3, 4], [5, 4, 2], [3, 0, 4]]);
        mesh.attributes = vec![Attribute::parts(&[1, 0, 1])];
        let found = in_bodies(mesh.clone(), &scene).unwrap();
        let xs: Vec<f64> = found.positions.iter().map(|p| p[0]).collect();
        assert_eq!(xs, [1.0, 2.0, 4.0, 5.0, 0.0, 3.0, 4.0]);
        assert_eq!(
            (&found.triangles[..], &found.bodies[..]),
            (&[[4, 5, 6], [3, 2, 1], [5, 4, 6]][..], &[0, 4][..])
        );
        // What is in order stays.
        assert_eq!(in_bodies(found.clone(), &scene).unwrap(), found);
        assert!(in_bodies(mesh, &Scene { json: b"{".to_vec(), buffers: vec![] }).is_err());
    }
}
