//! The reader and the writer of scenes on hostile files: a small scene with something of everything, changed.

use serde_json::{Value, json};

use crate::error::Error;
use crate::formats::{self, Format, ReadOptions, Role, Scene, SceneOptions, Source};
use crate::mesh::{IndexedMesh, Lattice};

/// Changes a scene in up to 16 places, of its JSON or of its bytes, and reads it, as a scene and flattened. What is accepted names nothing
/// that is not there.
pub fn fuzz_scenes(data: &[u8]) {
    let Some((&kind, changes)) = data.split_first() else { return };
    let mut json = seed();
    let changes: Vec<[u8; 3]> = changes.as_chunks().0.iter().copied().take(16).collect();
    if kind % 4 > 0 {
        for &[place, further, value] in &changes {
            let places = places(&json);
            let pointer = &places[usize::from(u16::from_be_bytes([place, further])) % places.len()][..];
            if let Some(value_there) = json.pointer_mut(pointer) {
                *value_there = self::value(value);
            }
        }
    }
    let mut file = framed(&json);
    if kind % 4 == 0 {
        let length = file.len();
        for &[high, low, value] in &changes {
            file[usize::from(u16::from_be_bytes([high, low])) % length] = value;
        }
    }
    let read = |scenes| {
        let mut options =
            ReadOptions { format: Some(Format::Gltf), max_memory: 1 << 22, ..ReadOptions::default() };
        options.scenes = scenes;
        formats::read_with(&file, &options)
    };
    for scenes in [false, true] {
        match read(scenes) {
            Ok(source) => {
                assert_eq!(source.scene.is_some(), scenes);
                source.scene.iter().for_each(|scene| check(&source.mesh, scene));
            }
            Err(Error::Input(_) | Error::Limit { .. }) => {}
            Err(e) => panic!("{e}"),
        }
    }
}

/// Changes the JSON of a scene that has been read in up to 16 places, or its text, and writes it, with its mesh and without, in all ways there
/// are: so it comes out of a hostile file. What is written is glTF that the reader takes, and not more than is allowed.
pub fn fuzz_scene_writer(data: &[u8]) {
    let Some((&kind, changes)) = data.split_first() else { return };
    let mut options = ReadOptions { format: Some(Format::Gltf), scenes: true, ..ReadOptions::default() };
    let Ok(Source { mesh, scene: Some(mut scene), .. }) = formats::read_with(&framed(&seed()), &options)
    else {
        panic!("the seed is a scene");
    };
    let mut json: Value = serde_json::from_slice(&scene.json).expect("it is JSON");
    let changes = changes.as_chunks::<3>().0.iter().take(16);
    for &[place, further, value] in changes.clone().filter(|_| kind % 4 > 0) {
        let places = places(&json);
        let pointer = &places[usize::from(u16::from_be_bytes([place, further])) % places.len()][..];
        if let Some(value_there) = json.pointer_mut(pointer) {
            *value_there = self::value(value);
        }
    }
    scene.json = json.to_string().into_bytes();
    for &[high, low, value] in changes.filter(|_| kind % 4 == 0) {
        let length = scene.json.len();
        scene.json[usize::from(u16::from_be_bytes([high, low])) % length] = value;
    }
    if kind & 4 > 0 {
        scene.buffers.iter_mut().skip(1).for_each(|buffer| buffer.bytes.clear());
    }
    let mesh = if kind & 8 > 0 { IndexedMesh::default() } else { mesh };
    let mut writing = SceneOptions { max_memory: 1 << 22, ..SceneOptions::default() };
    if kind & 16 > 0 {
        writing.quantise = Some(Lattice::over([-4.0; 3], [4.0; 3], 12));
    }
    writing.compress = kind & 32 > 0;
    let refused = |e: &std::io::Error| {
        let is_limit = e.get_ref().is_some_and(|e| matches!(e.downcast_ref(), Some(Error::Limit { .. })));
        assert!(is_limit || e.kind() == std::io::ErrorKind::InvalidInput, "{e}");
    };
    let mut bytes = Vec::new();
    match formats::write_scene(&mesh, &scene, &writing, &mut bytes) {
        Ok(_) => {
            assert!(bytes.len() <= 1 << 22);
            options.force = true;
            // What was not right in the JSON is not right again; but nothing else is.
            if let Err(e) = formats::read_with(&bytes, &options) {
                assert!(matches!(e, Error::Input(_) | Error::Limit { .. }), "{e}");
            }
        }
        Err(e) => refused(&e),
    }
    match formats::gltf_files(&mesh, Some(&scene), &writing, "x") {
        Ok(files) => {
            let names: std::collections::BTreeSet<_> = files.beside.iter().map(|file| &file.name).collect();
            assert_eq!(names.len(), files.beside.len());
            let is_safe = |name: &str| name.starts_with("x") && !name.contains(['/', '\\', '\0', ':']);
            assert!(names.iter().all(|name| is_safe(name)), "{names:?}");
        }
        Err(e) => refused(&e),
    }
    let _ = formats::placed(&mesh, &scene, 1 << 22);
    let _ = formats::in_bodies(mesh.clone(), &scene);
    if let Err(e) = formats::write_progressive(&mesh, &scene, b"file", &mut std::io::sink()) {
        refused(&e);
    }
}

fn check(mesh: &IndexedMesh, scene: &Scene) {
    mesh.attributes.iter().for_each(|attribute| assert_eq!(attribute.check(mesh.triangles.len()), Ok(())));
    assert!(mesh.positions.as_flattened().iter().all(|x| x.is_finite()));
    assert!(mesh.bodies.first() == Some(&0) && mesh.bodies.is_sorted());
    let json: Value = serde_json::from_slice(&scene.json).expect("what was written is JSON");
    let list = |name: &str| json[name].as_array().map_or(&[][..], Vec::as_slice);
    let number = |value: &Value| value.as_u64().expect("a number") as usize;
    let buffers = list("buffers");
    assert_eq!(buffers.len(), scene.buffers.len());
    for (buffer, told) in scene.buffers.iter().zip(buffers) {
        assert!(!buffer.bytes.is_empty());
        assert_eq!(told["byteLength"], buffer.bytes.len());
        if let Role::Preview { image, .. } | Role::Original { image } = buffer.role {
            assert!(image < list("images").len());
        }
    }
    assert!(scene.buffers.iter().all(|buffer| buffer.useful_from >= 0.0));
    assert!(scene.buffers.is_sorted_by(|x, y| x.useful_from >= y.useful_from));
    for view in list("bufferViews") {
        let end = view["byteOffset"].as_u64().unwrap_or(0) as usize + number(&view["byteLength"]);
        assert!(end <= scene.buffers[number(&view["buffer"])].bytes.len());
    }
    for mesh_told in list("meshes") {
        for primitive in mesh_told["primitives"].as_array().into_iter().flatten() {
            let told = &primitive["extensions"]["UNWELD_progressive_mesh"];
            if let Some(part) = told.get("part").and_then(Value::as_u64) {
                assert!((part as usize) < mesh.part_names.len());
                assert!((-60..=60).contains(&told["exponent"].as_i64().expect("a number")));
            }
        }
    }
}

/// The pointers to all values of a document, at least one.
fn places(json: &Value) -> Vec<String> {
    let (mut found, mut open) = (Vec::new(), vec![(String::new(), json)]);
    while let Some((pointer, value)) = open.pop() {
        match value {
            Value::Array(list) => {
                open.extend(list.iter().enumerate().map(|(k, value)| (format!("{pointer}/{k}"), value)))
            }
            Value::Object(object) => {
                open.extend(object.iter().map(|(key, value)| (format!("{pointer}/{key}"), value)))
            }
            _ => {}
        }
        if !pointer.is_empty() {
            found.push(pointer);
        }
    }
    if found.is_empty() {
        found.push(String::new());
    }
    found
}

fn value(choice: u8) -> Value {
    match choice {
        0..=31 => choice.into(),
        32 => json!(-1),
        33 => json!(u64::MAX),
        34 => json!(1e300),
        35 => json!(null),
        36 => json!([]),
        37 => json!({}),
        38 => json!("data:,x"),
        39 => json!("x.png"),
        40 => json!([0, 0]),
        41 => json!(true),
        42 => json!(1 << 30),
        43 => json!(0.5),
        44 => json!([{"POSITION": 0}]),
        45 => json!("VEC4"),
        46 => json!("MASK"),
        47 => json!({"a": {"bufferView": 1, "accessor": 7}}),
        _ => json!(5120 + u32::from(choice % 8)),
    }
}

/// Two meshes, of which one has two primitives and the other points, a skin, an animation, a target, pictures and what is not known.
fn seed() -> Value {
    let primitive = json!({
        "attributes": {"POSITION": 0, "TEXCOORD_0": 1, "JOINTS_0": 4}, "indices": 2, "material": 0, "targets": [{"POSITION": 3}],
        "extensions": {"KHR_materials_variants": {"mappings": [{"material": 0, "variants": [0]}]}},
    });
    json!({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "skin": 0, "children": [1], "scale": [1, -2, 3]}, {"mesh": 1, "extensions": {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 0}}}}],
        "meshes": [{"primitives": [primitive, {"attributes": {"POSITION": 0}, "mode": 5}]}, {"primitives": [{"attributes": {"POSITION": 0}, "mode": 0}, primitive]}],
        "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0, "texCoord": 0, "extensions": {"KHR_texture_transform": {"scale": [2, 2]}}}}}],
        "textures": [{"source": 0}], "images": [{"bufferView": 5}, {"uri": "data:image/png;base64,iVBORw0KGgo="}],
        "skins": [{"joints": [1], "inverseBindMatrices": 6}],
        "animations": [{"samplers": [{"input": 5, "output": 0}], "channels": []}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5121, "normalized": true, "count": 3, "type": "VEC2"},
            {"bufferView": 2, "componentType": 5123, "count": 3, "type": "SCALAR"},
            {"componentType": 5126, "count": 3, "type": "VEC3", "sparse": {"count": 1, "indices": {"bufferView": 3, "componentType": 5121}, "values": {"bufferView": 0}}},
            {"bufferView": 1, "componentType": 5121, "count": 3, "type": "VEC4", "byteOffset": 0},
            {"bufferView": 4, "componentType": 5126, "count": 3, "type": "SCALAR"},
            {"bufferView": 6, "componentType": 5126, "count": 1, "type": "MAT4"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": 36},
            {"buffer": 0, "byteOffset": 36, "byteLength": 12},
            {"buffer": 0, "byteOffset": 48, "byteLength": 6},
            {"buffer": 0, "byteOffset": 54, "byteLength": 1},
            {"buffer": 0, "byteOffset": 56, "byteLength": 12},
            {"buffer": 0, "byteOffset": 68, "byteLength": 8},
            {"buffer": 0, "byteOffset": 0, "byteLength": 64},
        ],
        "buffers": [{"byteLength": 76}],
        "extensions": {"VENDOR_any": {"bufferView": 6}},
    })
}

/// A binary file of a document; its triangle is that of the corners (0, 0, 0), (1, 0, 0), (0, 2, 0).
fn framed(json: &Value) -> Vec<u8> {
    let positions = [0.0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 2.0, 0.0];
    let mut binary: Vec<u8> = positions.iter().flat_map(|x| x.to_le_bytes()).collect();
    binary.extend([0, 0, 255, 0, 0, 255, 1, 2, 3, 4, 5, 6, 0, 0, 1, 0, 2, 0, 1, 0]);
    binary.extend([0.0f32, 1.0, 2.0].iter().flat_map(|x| x.to_le_bytes()));
    binary.extend(b"\x89PNG\r\n\x1a\n");
    let mut text = json.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let chunk = |kind: &[u8; 4], data: &[u8]| [&(data.len() as u32).to_le_bytes()[..], kind, data].concat();
    let body = [chunk(b"JSON", &text), chunk(b"BIN\0", &binary)].concat();
    [b"glTF", &2u32.to_le_bytes()[..], &(12 + body.len() as u32).to_le_bytes(), &body].concat()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_changed_is_a_scene() {
        let options = ReadOptions { scenes: true, ..ReadOptions::default() };
        let source = formats::read_with(&framed(&seed()), &options).unwrap();
        check(&source.mesh, &source.scene.unwrap());
        assert_eq!((source.mesh.triangles.len(), source.mesh.part_names.len()), (2, 2));
    }
}
