//! Triangles and where they are.

use crate::builder::*;
use serde_json::json;
use unweld::formats::{Coordinates, Format};

#[test]
fn indices_of_all_types_or_none() {
    let expected = triangle().read();
    assert_eq!(expected.mesh.positions, [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 2.0, 0.0]]);
    assert_eq!(expected.mesh.triangles, [[0, 1, 2]]);
    assert_eq!(
        (expected.format, expected.coordinates, expected.text),
        (Format::Gltf, Coordinates::Float32, false)
    );
    assert!(
        expected.dropped.is_empty()
            && expected.mesh.attributes.is_empty()
            && expected.mesh.part_names.is_empty()
    );
    for (component, bytes) in
        [(UNSIGNED_BYTE, &[0, 1, 2][..]), (UNSIGNED_INT, &[0, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0])]
    {
        let mut gltf = triangle();
        let indices = gltf.accessor("SCALAR", component, 3, bytes);
        gltf.json["meshes"][0]["primitives"][0]["indices"] = indices.into();
        assert_eq!(gltf.read(), expected);
    }
    let mut gltf = triangle();
    gltf.json["meshes"][0]["primitives"][0].as_object_mut().unwrap().remove("indices");
    assert_eq!(gltf.read(), expected);
}

/// Five vertices in a zigzag, all of them in order.
fn zigzag(mode: u32) -> Gltf {
    let mut gltf = Gltf::new();
    let points: Vec<f32> = (0..5).flat_map(|k| [k as f32, (k % 2) as f32, 0.0]).collect();
    let positions = gltf.floats("VEC3", &points);
    gltf.shown(json!({"attributes": {"POSITION": positions}, "mode": mode}));
    gltf
}

#[test]
fn strips_and_fans() {
    // glTF 2.0, §3.7.2.1: the strip's odd triangles are turned, the fan's begin behind the first vertex.
    assert_eq!(zigzag(5).read().mesh.triangles, [[0, 1, 2], [1, 3, 2], [2, 3, 4]]);
    assert_eq!(zigzag(6).read().mesh.triangles, [[1, 2, 0], [2, 3, 0], [3, 4, 0]]);
    let loose = zigzag(4).read();
    assert_eq!(
        (loose.mesh.triangles, &loose.dropped[..]),
        (vec![[0, 1, 2]], &["indices of no whole triangle (2)".to_owned()][..])
    );
}

#[test]
fn points_and_lines_are_named() {
    let mut gltf = triangle();
    for mode in [0, 0, 1, 2, 3] {
        let primitive = json!({"attributes": {"POSITION": 0}, "mode": mode});
        gltf.json["meshes"][0]["primitives"].as_array_mut().unwrap().push(primitive);
    }
    let source = gltf.read();
    assert_eq!(source.mesh.triangles.len(), 1);
    assert_eq!(source.dropped, ["primitives of points (2)", "primitives of lines (3)"]);
    assert_eq!(zigzag(0).refused(), "no triangles");
}

#[test]
fn nodes_move_their_meshes() {
    let mut gltf = triangle();
    // The triangle hangs at a node that is scaled, below one that turns x to y and is moved.
    let half = 0.5f64.sqrt();
    gltf.json["nodes"] = json!([
        {"children": [1], "rotation": [0, 0, half, half], "translation": [10, 0, 0]},
        {"mesh": 0, "scale": [3, 1, 1]},
        {"mesh": 0, "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 5, 1]},
    ]);
    gltf.json["scenes"] = json!([{"nodes": [2, 0]}, {"nodes": []}]);
    let source = gltf.read();
    let expected = [
        [0.0, 0.0, 5.0],
        [1.0, 0.0, 5.0],
        [0.0, 2.0, 5.0],
        [10.0, 0.0, 0.0],
        [10.0, 3.0, 0.0],
        [8.0, 0.0, 0.0],
    ];
    for (p, q) in source.mesh.positions.iter().zip(expected) {
        assert!(p.iter().zip(q).all(|(x, y)| (x - y).abs() < 1e-12), "{p:?} {q:?}");
    }
    assert_eq!(source.mesh.triangles, [[0, 1, 2], [3, 4, 5]]);
    assert_eq!(source.dropped, ["further scenes (1)", "nodes, flattened (3)"]);
}

#[test]
fn coordinates_that_are_no_binary32_numbers_stay_exact() {
    let mut gltf = triangle();
    gltf.json["nodes"][0]["translation"] = json!([6_378_137.25, 0, 0.1]);
    let source = gltf.read();
    assert_eq!(source.coordinates, Coordinates::Float64);
    assert_eq!(source.mesh.positions[1], [6_378_138.25, 0.0, 0.1]);
}

#[test]
fn a_mirror_turns_triangles_round() {
    let mut gltf = triangle();
    gltf.json["nodes"][0]["scale"] = json!([1, -1, 1]);
    assert_eq!(gltf.read().mesh.triangles, [[0, 2, 1]]);
    gltf.json["nodes"][0]["scale"] = json!([-1, -1, 1]);
    assert_eq!(gltf.read().mesh.triangles, [[0, 1, 2]]);
    // Two mirrors.
    gltf.json["nodes"] = json!([{"children": [1], "scale": [1, 1, -1]}, {"mesh": 0, "scale": [-1, 1, 1]}]);
    assert_eq!(gltf.read().mesh.triangles, [[0, 1, 2]]);
}

#[test]
fn which_scene_is_shown() {
    let mut gltf = triangle();
    gltf.shown(json!({"attributes": {"POSITION": 0}}));
    let names = |gltf: &Gltf| gltf.read().mesh.part_names;
    // Without scenes, all; with some, the first; or the one that is named.
    assert_eq!(names(&gltf), ["o mesh 0", "o mesh 1"]);
    gltf.json["scenes"] = json!([{"nodes": [0]}, {"nodes": [1]}]);
    gltf.json["meshes"][0]["name"] = "first".into();
    gltf.json["meshes"][1]["name"] = "second\n one".into();
    assert_eq!(names(&gltf), ["o first"]);
    assert_eq!(gltf.read().dropped, ["meshes that are not shown (1)", "further scenes (1)"]);
    gltf.json["scene"] = 1.into();
    assert_eq!(names(&gltf), ["o second one"]);
    // Nodes without meshes show them all.
    gltf.json["nodes"] = json!([{}, {}]);
    assert_eq!(names(&gltf), ["o first", "o second one"]);
}

#[test]
fn instances_by_accessors() {
    let mut gltf = triangle();
    let translations = gltf.floats("VEC3", &[0.0, 0.0, 0.0, 5.0, 0.0, 0.0]);
    // Half a turn about z, in 16 bits; and nothing.
    let bytes: Vec<u8> = [0i16, 0, 32_767, 0, 0, 0, 0, 32_767].iter().flat_map(|x| x.to_le_bytes()).collect();
    let rotations = gltf.accessor("VEC4", SHORT, 2, &bytes);
    let rotations = gltf.normalised(rotations);
    let scales = gltf.floats("VEC3", &[1.0, 1.0, 1.0, 2.0, 2.0, -2.0]);
    let ids = gltf.floats("SCALAR", &[1.0, 2.0]);
    let attributes = json!({"TRANSLATION": translations, "ROTATION": rotations, "SCALE": scales, "_ID": ids});
    gltf.json["nodes"][0]["translation"] = json!([0, 0, 1]);
    gltf.json["nodes"][0]["extensions"] = json!({"EXT_mesh_gpu_instancing": {"attributes": attributes}});
    gltf.json["extensionsRequired"] = json!(["EXT_mesh_gpu_instancing"]);
    let source = gltf.read();
    let expected = [
        [0.0, 0.0, 1.0],
        [-1.0, 0.0, 1.0],
        [0.0, -2.0, 1.0],
        [5.0, 0.0, 1.0],
        [7.0, 0.0, 1.0],
        [5.0, 4.0, 1.0],
    ];
    assert_eq!(source.mesh.positions, expected);
    assert_eq!(source.mesh.triangles, [[0, 1, 2], [3, 5, 4]]);
    assert_eq!(source.dropped, ["nodes, flattened (2)", "numbers of instances (1)"]);
    let one = gltf.floats("VEC3", &[1.0; 3]);
    gltf.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"]["SCALE"] = one.into();
    let pointer = "/nodes/0/extensions/EXT_mesh_gpu_instancing/attributes";
    assert_eq!(gltf.refused(), format!("{pointer}/SCALE: 1 of 2 instances"));
}

#[test]
fn vertices_that_primitives_share_are_there_once() {
    let mut gltf = triangle();
    let turned = gltf.indices(&[0, 2, 1]);
    let second = json!({"attributes": {"POSITION": 0}, "indices": turned});
    gltf.json["meshes"][0]["primitives"].as_array_mut().unwrap().push(second);
    gltf.push("nodes", json!({"mesh": 0}));
    let source = gltf.read();
    assert_eq!(source.mesh.positions.len(), 6);
    assert_eq!(source.mesh.triangles, [[0, 1, 2], [0, 2, 1], [3, 4, 5], [3, 5, 4]]);
    assert_eq!(source.mesh.part_names, ["o mesh 0\ng primitive 0", "o mesh 0\ng primitive 1"]);
    let [parts] = &source.mesh.attributes[..] else { panic!() };
    assert_eq!(parts.corners, [0, 1, 0, 1]);
}

#[test]
fn strides_offsets_and_sparse_numbers() {
    let expected = triangle().read().mesh.positions;
    // Each position behind eight bytes of something else.
    let mut gltf = triangle();
    let rows: Vec<u8> = expected
        .iter()
        .flat_map(|p| [[7.0f32, 8.0], [p[0] as f32, p[1] as f32], [p[2] as f32, 9.0]])
        .flatten()
        .flat_map(f32::to_le_bytes)
        .collect();
    let view = gltf.view(&rows);
    gltf.json["bufferViews"][view]["byteStride"] = 24.into();
    gltf.json["accessors"][0]["bufferView"] = view.into();
    gltf.json["accessors"][0]["byteOffset"] = 8.into();
    assert_eq!(gltf.read().mesh.positions, expected);
    // All zero, but for two.
    let mut gltf = triangle();
    let indices = gltf.view(&[1, 2]);
    let bytes: Vec<u8> = [1.0f32, 0.0, 0.0, 0.0, 2.0, 0.0].iter().flat_map(|x| x.to_le_bytes()).collect();
    let values = gltf.view(&bytes);
    let sparse = json!({"count": 2, "indices": {"bufferView": indices, "componentType": UNSIGNED_BYTE}, "values": {"bufferView": values}});
    gltf.json["accessors"][0] = json!({"componentType": FLOAT, "count": 3, "type": "VEC3", "sparse": sparse});
    assert_eq!(gltf.read().mesh.positions, expected);
    // One replaced.
    let mut sparse = gltf.json["accessors"][0]["sparse"].clone();
    sparse["count"] = 1.into();
    gltf.json["accessors"][0]["sparse"] = sparse;
    gltf.json["accessors"][0]["bufferView"] = 0.into();
    assert_eq!(gltf.read().mesh.positions, expected);
    gltf.json["accessors"][0]["sparse"]["indices"]["byteOffset"] = 1.into();
    assert_eq!(gltf.read().mesh.positions[2], [1.0, 0.0, 0.0]);
}

#[test]
fn quantised_positions() {
    let mut gltf = triangle();
    let bytes: Vec<u8> = [0i8, 0, 0, 0, 127, 0, 0, 0, 0, -128, 64, 0].iter().map(|x| *x as u8).collect();
    let view = gltf.view(&bytes);
    gltf.json["bufferViews"][view]["byteStride"] = 4.into();
    gltf.json["accessors"][0]["bufferView"] = view.into();
    gltf.json["accessors"][0]["componentType"] = BYTE.into();
    assert_eq!(gltf.read().mesh.positions, [[0.0; 3], [127.0, 0.0, 0.0], [0.0, -128.0, 64.0]]);
    gltf.json["accessors"][0]["normalized"] = true.into();
    assert_eq!(gltf.read().mesh.positions, [[0.0; 3], [1.0, 0.0, 0.0], [0.0, -1.0, 64.0 / 127.0]]);
}
