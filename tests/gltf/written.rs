//! Scenes out again: what is written of a scene is the scene that was read.

use crate::builder::*;
use crate::scenes::options;
use serde_json::{Value, json};
use unweld::formats::{Scene, SceneOptions, placed, read_bytes, read_with, write_progressive, write_scene};
use unweld::mesh::IndexedMesh;
use unweld::mesh::attributes::{Attribute, Semantic};

/// The bits of all that each corner has, by the titles of attributes.
pub fn corners(mesh: &IndexedMesh) -> Vec<Vec<(String, Option<Vec<u64>>)>> {
    let corner = |corner: usize| {
        let position = mesh.positions[mesh.triangles.as_flattened()[corner] as usize];
        let mut all = vec![("position".to_owned(), Some(position.map(f64::to_bits).to_vec()))];
        // Numbers of parts are anybody's own.
        for attribute in mesh.attributes.iter().filter(|attribute| attribute.semantic != Semantic::Part) {
            let n = attribute.components;
            let value = attribute.at(corner / 3, corner % 3);
            let bits =
                |value: usize| (value * n..(value + 1) * n).map(|at| attribute.values.bits(at)).collect();
            all.push((attribute.title(), value.map(bits)));
        }
        all
    };
    (0..3 * mesh.triangles.len()).map(corner).collect()
}

fn exact() -> SceneOptions {
    let mut options = SceneOptions::default();
    options.exact_weights = true;
    options
}

fn written(mesh: &IndexedMesh, scene: &Scene) -> Vec<u8> {
    let mut bytes = Vec::new();
    write_scene(mesh, scene, &exact(), &mut bytes).unwrap();
    bytes
}

/// The text of a binary file.
pub fn text(bytes: &[u8]) -> Value {
    let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    serde_json::from_slice(&bytes[20..20 + length]).unwrap()
}

/// Two meshes, one of them twice and mirrored, of two primitives: one with numbers of many types, a target and a skin.
pub fn scene() -> Gltf {
    let mut gltf = Gltf::new();
    let positions = gltf.floats("VEC3", &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 2.0, 0.0, 1.0, 1.0, 3.0]);
    let moves = gltf.floats("VEC3", &[0.0, 0.5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0]);
    let normals = gltf.floats("VEC3", &[0.0, 0.0, 1.0, 0.6, 0.0, 0.8, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0]);
    let uv = gltf.floats("VEC2", &[0.0, 0.25, 0.5, 0.0, 0.75, 1.0, 0.125, 0.1]);
    let weights = gltf
        .floats("VEC4", &[0.7, 0.2, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.5, 0.5, 0.0, 0.0]);
    let joints = gltf.floats("VEC4", &[0.0; 16]);
    let indices = gltf.indices(&[0, 1, 2, 1, 3, 2]);
    let first = json!({
        "attributes": {"POSITION": positions, "NORMAL": normals, "TEXCOORD_0": uv, "WEIGHTS_0": weights, "_HEAT": joints},
        "targets": [{"POSITION": moves}], "indices": indices, "material": 0,
    });
    let second = json!({"attributes": {"POSITION": positions}, "mode": 5, "extras": {"kept": true}});
    gltf.push("materials", json!({"name": "red"}));
    gltf.push("meshes", json!({"name": "one", "primitives": [first, second.clone()], "weights": [0.5]}));
    gltf.push("meshes", json!({"name": "two", "primitives": [second]}));
    for (mesh, scale) in [(0, [0.3, -0.1, 0.1]), (1, [3.0, 1.0, -1.0])] {
        gltf.push("nodes", json!({"mesh": mesh, "scale": scale, "translation": [5, 6, 7]}));
    }
    gltf
}

#[test]
fn what_is_read_is_written() {
    let bytes = scene().glb();
    let source = read_with(&bytes, &options()).unwrap();
    let again = written(&source.mesh, source.scene.as_ref().unwrap());
    // The same parts and the same JSON come of it, bit for bit.
    let source_again = read_with(&again, &options()).unwrap();
    assert_eq!(corners(&source_again.mesh), corners(&source.mesh));
    assert_eq!(source_again.mesh.part_names, source.mesh.part_names);
    let json =
        |scene: &Option<Scene>| -> Value { serde_json::from_slice(&scene.as_ref().unwrap().json).unwrap() };
    assert_eq!(json(&source_again.scene), json(&source.scene));
    // What the two primitives share is there once, and nothing says the extension's name.
    let text = text(&again);
    assert_eq!(
        text["meshes"][0]["primitives"][1]["attributes"],
        text["meshes"][1]["primitives"][0]["attributes"]
    );
    assert_eq!(text["meshes"][0]["primitives"][1]["extras"], json!({"kept": true}));
    assert!(!text.to_string().contains("UNWELD"), "{text}");
    // Shown, it is what is read of it flattened.
    let flat = read_bytes(&bytes, None, "").unwrap().mesh;
    assert_eq!(
        corners(&placed(&source.mesh, source.scene.as_ref().unwrap(), 1 << 30).unwrap().0),
        corners(&flat)
    );
}

#[test]
fn what_has_not_come_leaves_a_valid_scene() {
    let source = read_with(&scene().glb(), &options()).unwrap();
    let scene = source.scene.unwrap();
    let mut mesh = source.mesh;
    // The second part is not there, nor are texture coordinates, normals and displacements.
    let part = |t: usize| mesh.attributes.iter().find(|a| a.semantic == Semantic::Part).unwrap().at(t, 0);
    let there: Vec<usize> = (0..mesh.triangles.len()).filter(|&t| part(t) == Some(0)).collect();
    mesh.triangles = there.iter().map(|&t| mesh.triangles[t]).collect();
    let is_kept = |a: &Attribute| matches!(a.semantic, Semantic::Part | Semantic::Weights);
    mesh.attributes.retain(is_kept);
    for attribute in &mut mesh.attributes {
        let a = attribute.corners.len() / (there.len() + 2).max(1);
        let n = if a >= 3 { 3 } else { 1 };
        attribute.corners =
            there.iter().flat_map(|&t| attribute.corners[n * t..n * (t + 1)].to_vec()).collect();
    }
    let mut bytes = Vec::new();
    write_scene(&mesh, &scene, &SceneOptions::default(), &mut bytes).unwrap();
    let text = text(&bytes);
    let accessor = |number: &Value| &text["accessors"][number.as_u64().unwrap() as usize];
    let first = &text["meshes"][0]["primitives"][0];
    assert!(first["attributes"].get("NORMAL").is_none() && first["attributes"].get("_HEAT").is_none());
    assert!(accessor(&first["attributes"]["TEXCOORD_0"]).get("bufferView").is_none());
    assert_eq!(accessor(&first["targets"][0]["POSITION"])["max"], json!([0.0, 0.0, 0.0]));
    let second = &text["meshes"][0]["primitives"][1];
    assert_eq!(accessor(&second["indices"])["count"], 3);
    assert_eq!(accessor(&second["attributes"]["POSITION"])["count"], 1);
    // Weights sum up to 1 where they are not the source's own.
    let again = read_with(&bytes, &options()).unwrap().mesh;
    let weights = again.attributes.iter().find(|a| a.semantic == Semantic::Weights).unwrap();
    for corner in 0..3 * there.len() {
        let Some(value) = weights.at(corner / 3, corner % 3) else { continue };
        assert_eq!((0..4).map(|k| weights.values.number(4 * value + k) as f32).sum::<f32>(), 1.0);
    }
}

#[test]
fn a_progressive_file_lies_beside_its_base() {
    let source = read_with(&scene().glb(), &options()).unwrap();
    let mut bytes = Vec::new();
    write_progressive(&source.mesh, source.scene.as_ref().unwrap(), b"no .uwm", &mut bytes).unwrap();
    let text = text(&bytes);
    let view = text["extensions"]["UNWELD_progressive_mesh"]["bufferView"].as_u64().unwrap() as usize;
    let at = text["bufferViews"][view]["byteOffset"].as_u64().unwrap() as usize;
    let binary = 20 + u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize + 8;
    assert_eq!(&bytes[binary + at..][..7], b"no .uwm");
    assert_eq!(text["extensionsUsed"], json!(["UNWELD_progressive_mesh"]));
    let primitive = &text["meshes"][0]["primitives"][0];
    assert_eq!(primitive["extensions"]["UNWELD_progressive_mesh"]["part"], 0);
    assert!(primitive["attributes"]["POSITION"].is_u64());
}

/// A small scene of many primitives that are all one part, and of many attributes: what would be written is limited.
#[test]
fn memory_of_what_is_written_is_limited() {
    let source = read_with(&scene().glb(), &options()).unwrap();
    let of = source.scene.unwrap();
    let mut json: Value = serde_json::from_slice(&of.json).unwrap();
    let primitive = json["meshes"][0]["primitives"][0].clone();
    let other = |k: usize| {
        let mut primitive = primitive.clone();
        primitive["extensions"]["UNWELD_progressive_mesh"]["attributes"][format!("TEXCOORD_{k}")] =
            json!({"componentType": FLOAT, "type": "VEC2"});
        primitive
    };
    json["meshes"][0]["primitives"] = (0..2000).map(other).collect();
    let scene = Scene { json: serde_json::to_vec(&json).unwrap(), ..of };
    let mut options = exact();
    options.max_memory = 200 * scene.json.len() as u64;
    write_scene(&source.mesh, &scene, &options, &mut std::io::sink()).unwrap();
    options.max_memory = 75 * scene.json.len() as u64;
    let error = write_scene(&source.mesh, &scene, &options, &mut std::io::sink()).unwrap_err().to_string();
    assert!(error.starts_with("limit reached: memory in bytes"), "{error}");
}

#[test]
fn faults_of_scenes_are_told() {
    let source = read_with(&scene().glb(), &options()).unwrap();
    let scene = source.scene.unwrap();
    let says = |change: &dyn Fn(&mut Value)| {
        let mut json: Value = serde_json::from_slice(&scene.json).unwrap();
        change(&mut json);
        let scene = Scene { json: serde_json::to_vec(&json).unwrap(), ..scene.clone() };
        write_scene(&source.mesh, &scene, &exact(), &mut std::io::sink()).unwrap_err().to_string()
    };
    let pointer = "/meshes/0/primitives/0/extensions/UNWELD_progressive_mesh";
    let of = |json: &mut Value, key: &str, value: Value| {
        *json.pointer_mut(&format!("{pointer}/{key}")).unwrap() = value
    };
    assert_eq!(
        says(&|json| of(json, "exponent", json!(61))),
        format!("{pointer}/exponent: not a whole number of -60 to 60")
    );
    assert_eq!(
        says(&|json| of(json, "attributes", json!({}))),
        format!("{pointer}: no positions of three numbers")
    );
    assert_eq!(
        says(&|json| of(json, "part", json!(-1))),
        format!("{pointer}/part: not a whole number, 0 or more")
    );
    let views = |json: &mut Value| {
        json["bufferViews"] = json!([{"buffer": 7, "byteLength": 4}]);
        json["accessors"] = json!([{"bufferView": 0}]);
    };
    assert_eq!(says(&views), "/bufferViews/0: there is no buffer 7");
    // A number has no members.
    assert_eq!(says(&|json| json["bufferViews"] = json!([7])), "/bufferViews/0: not an object");
    let cut = Scene { json: scene.json[..9].to_vec(), ..scene.clone() };
    assert!(
        write_scene(&source.mesh, &cut, &exact(), &mut std::io::sink())
            .unwrap_err()
            .to_string()
            .starts_with("the scene's JSON: ")
    );
}
