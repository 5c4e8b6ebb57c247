//! What cannot be a mesh is refused, at its pointer, its byte or its line.

use crate::builder::*;
use proptest::prelude::*;
use serde_json::{Value, json};
use unweld::Error;
use unweld::error::Place;
use unweld::formats::{Format, ReadOptions, read_bytes, read_with};

/// A change to the triangle's JSON: a pointer and what stands there then.
fn refused(pointer: &str, value: Value) -> String {
    let mut gltf = triangle();
    let (above, key) = pointer.rsplit_once('/').unwrap();
    match gltf.json.pointer_mut(above).unwrap() {
        Value::Array(list) => list[key.parse::<usize>().unwrap()] = value,
        object => object[key] = value,
    }
    gltf.refused()
}

#[test]
fn faults_have_pointers() {
    let accessor = "/accessors/0";
    let view = "elements of 12 bytes, 12 apart, from byte 0 of a view of";
    for (pointer, value, expected) in [
        ("/asset/version", json!("1.0"), "/asset/version: version \"1.0\" of glTF, 2.0 is read"),
        ("/asset", json!({}), "/asset: `version` is missing"),
        ("/accessors/0/count", json!(0), "/accessors/0/count: 0 elements, allowed 1 to 1073741824"),
        ("/accessors/0/count", json!(-3), "/accessors/0/count: not a whole number, 0 or more"),
        ("/accessors/0/count", json!(4), &format!("{accessor}: 4 {view} 36")),
        ("/accessors/0/count", json!(2), "/accessors/1: index 2 names vertex 2, there are 2"),
        (
            "/accessors/0/count",
            json!(1u64 << 60),
            "/accessors/0/count: 1152921504606846976 elements, allowed 1 to 1073741824",
        ),
        ("/accessors/0/type", json!("VEC5"), "/accessors/0/type: \"VEC5\" is no type"),
        (
            "/accessors/0/type",
            json!("VEC2"),
            "/meshes/0/primitives/0/attributes/POSITION: positions of 2 numbers, not 3",
        ),
        ("/accessors/0/componentType", json!(5127), "/accessors/0/componentType: 5127 is no component type"),
        (
            "/accessors/0/bufferView",
            json!(9),
            "/accessors/0/bufferView: names item 9 of /bufferViews, which has 2",
        ),
        (
            "/accessors/0/byteOffset",
            json!(4),
            &format!("{accessor}: 3 {} 36", view.replace("byte 0", "byte 4")),
        ),
        (
            "/accessors/1/componentType",
            json!(FLOAT),
            "/accessors/1: 3 elements of 4 bytes, 4 apart, from byte 0 of a view of 6",
        ),
        ("/accessors/1/componentType", json!(SHORT), "/accessors/1: not a list of indices by its type"),
        ("/bufferViews/0/byteStride", json!(8), "/accessors/0: elements of 12 bytes, 8 apart"),
        ("/bufferViews/0/byteLength", json!(35), &format!("{accessor}: 3 {view} 35")),
        ("/bufferViews/0/byteLength", json!(300), "/bufferViews/0: 300 bytes from byte 0 of a buffer of 42"),
        (
            "/bufferViews/1/byteOffset",
            json!(u64::MAX),
            "/bufferViews/1: 6 bytes from byte 18446744073709551615 of a buffer of 42",
        ),
        ("/bufferViews/1/buffer", json!(1), "/bufferViews/1/buffer: names item 1 of /buffers, which has 1"),
        ("/buffers/0", json!({"byteLength": 45}), "/buffers/0: tells of 45 bytes, 44 are there"),
        (
            "/buffers/0",
            json!({"uri": "data:;base64,!", "byteLength": 1}),
            "/buffers/0: uri: letter 0 of the base64 data is none of base64",
        ),
        (
            "/buffers/0",
            json!({"uri": "data:;base64,AAAA", "byteLength": 42}),
            "/buffers/0: tells of 42 bytes, 3 are there",
        ),
        (
            "/buffers/0",
            json!({"uri": "a.bin", "byteLength": 42}),
            "/buffers/0: uri: the folder of a.bin is not known",
        ),
        ("/buffers/0", json!({"uri": 7, "byteLength": 42}), "/buffers/0/uri: not text"),
        ("/meshes/0/primitives/0/mode", json!(7), "/meshes/0/primitives/0/mode: 7 is no mode"),
        (
            "/meshes/0/primitives/0/indices",
            json!(2),
            "/meshes/0/primitives/0/indices: names item 2 of /accessors, which has 2",
        ),
        (
            "/meshes/0/primitives/0/attributes",
            json!({}),
            "/meshes/0/primitives/0/attributes: `POSITION` is missing",
        ),
        ("/meshes/0/primitives/0", json!({}), "/meshes/0/primitives/0: `attributes` is missing"),
        ("/meshes/0/primitives", json!({}), "/meshes/0/primitives: not a list"),
        ("/nodes/0/mesh", json!(1), "/nodes/0/mesh: names item 1 of /meshes, which has 1"),
        ("/nodes/0/matrix", json!([1, 2]), "/nodes/0/matrix: not a list of 16 numbers"),
        ("/nodes/0/scale", json!([1, "2", 3]), "/nodes/0/scale: not a list of 3 numbers"),
        (
            "/nodes/0/scale",
            json!([1e308, 1e308, 1e308]),
            "/nodes/0: it takes vertex 2 of /meshes/0 to [0.0, inf, 0.0]",
        ),
        ("/scene", json!(0), "/scene: names item 0 of /scenes, which has 0"),
        ("/scenes", json!([{"nodes": [0, 3]}]), "/scenes/0/nodes/1: names item 3 of /nodes, which has 1"),
        (
            "/extensionsRequired",
            json!(["EXT_unheard_of"]),
            "/extensionsRequired/0: the extension EXT_unheard_of is required, and not read",
        ),
    ] {
        assert_eq!(refused(pointer, value), expected, "{pointer}");
    }
}

#[test]
fn nodes_in_circles() {
    let twice = |k: u32| format!("node {k} is reached twice: it has two parents, or is its own ancestor");
    let mut gltf = triangle();
    gltf.json["scenes"] = json!([{"nodes": [0]}]);
    gltf.json["nodes"] = json!([{"children": [1], "mesh": 0}, {"children": [0]}]);
    assert_eq!(gltf.refused(), format!("/nodes/1/children/0: {}", twice(0)));
    gltf.json["nodes"] = json!([{"children": [1, 1]}, {"mesh": 0}]);
    assert_eq!(gltf.refused(), format!("/nodes/0/children/1: {}", twice(1)));
    // Without a scene nothing begins in a circle.
    gltf.json["nodes"] = json!([{"children": [1], "mesh": 0}, {"children": [0]}]);
    gltf.json.as_object_mut().unwrap().remove("scenes");
    assert_eq!(gltf.refused(), "no triangles");
}

#[test]
fn numbers_that_are_none() {
    let mut gltf = triangle();
    gltf.binary[16..20].copy_from_slice(&f32::NAN.to_le_bytes());
    assert_eq!(gltf.refused(), "/meshes/0/primitives/0/attributes/POSITION: y of vertex 1 is NaN");
}

#[test]
fn sparse_numbers_out_of_range() {
    let mut gltf = triangle();
    let at = gltf.view(&[0, 3]);
    let values = gltf.view(&[0; 24]);
    let mut sparse = |key: &str, value: Value| {
        let mut sparse = json!({
            "count": 2, "indices": {"bufferView": at, "componentType": UNSIGNED_BYTE}, "values": {"bufferView": values},
        });
        *sparse.pointer_mut(key).unwrap() = value;
        gltf.json["accessors"][0]["sparse"] = sparse;
        gltf.refused()
    };
    let indices = "/accessors/0/sparse/indices";
    assert_eq!(sparse("/count", 2.into()), format!("{indices}: index 1 names element 3 of 3"));
    assert_eq!(sparse("/count", 4.into()), "/accessors/0/sparse/count: 4 elements of 3 are replaced");
    assert_eq!(sparse("/count", 3.into()), format!("{indices}: 3 indices from byte 0 of a view of 2"));
    let short = "2 elements of 12 bytes, 12 apart, from byte 0 of a view of 2";
    assert_eq!(sparse("/values/bufferView", at.into()), format!("{indices}: index 1 names element 3 of 3"));
    gltf.binary[45] = 1;
    let mut sparse = gltf.json["accessors"][0]["sparse"].clone();
    sparse["values"]["bufferView"] = at.into();
    gltf.json["accessors"][0]["sparse"] = sparse;
    assert_eq!(gltf.refused(), format!("/accessors/0/sparse/values: {short}"));
}

#[test]
fn attributes_of_another_length() {
    let mut gltf = triangle();
    let uv = gltf.floats("VEC2", &[0.0; 8]);
    gltf.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = uv.into();
    assert_eq!(gltf.refused(), "/meshes/0/primitives/0/attributes: TEXCOORD_0 of 4 vertices, POSITION of 3");
}

#[test]
fn json_that_is_none() {
    let mut bytes = triangle().glb();
    bytes[60] = b'\x01';
    let place = |bytes: &[u8], hint| match read_bytes(bytes, hint, "") {
        Err(Error::Input(error)) if error.what.starts_with("JSON: ") => error.place,
        other => panic!("{other:?}"),
    };
    let Place::Byte(byte) = place(&bytes, None) else { panic!() };
    assert!((55..=61).contains(&byte), "{byte}");
    assert_eq!(place(b"{\"asset\":\n{\"version\": \"2.0\"}\n,}", None), Place::Line(3));
    let deep = [&b"{\"asset\": "[..], &[b'['; 1000]].concat();
    assert!(matches!(place(&deep, None), Place::Line(1)));
}

#[test]
fn a_claim_costs_nothing() {
    let with = |gltf: &Gltf, max_memory| {
        let mut options = ReadOptions::default();
        options.max_memory = max_memory;
        read_with(&gltf.glb(), &options)
    };
    let refused = |gltf: &Gltf| match with(gltf, 1 << 20) {
        Err(Error::Limit { what, needed, allowed }) => {
            assert_eq!((what, allowed), ("memory in bytes", 1 << 20));
            assert!(needed > allowed);
        }
        other => panic!("{other:?}"),
    };
    assert!(with(&triangle(), 1 << 20).is_ok());
    // Numbers that are nowhere are zeros.
    let mut gltf = triangle();
    gltf.json["accessors"][0] = json!({"componentType": FLOAT, "count": 1 << 30, "type": "VEC3"});
    refused(&gltf);
    // Few bytes that many instances show.
    let mut gltf = triangle();
    let places = gltf.push("accessors", json!({"componentType": FLOAT, "count": 1 << 16, "type": "VEC3"}));
    let instancing = json!({"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": places}}});
    gltf.json["nodes"][0]["extensions"] = instancing.clone();
    refused(&gltf);
    let mut gltf = triangle();
    let zeros =
        gltf.push("accessors", json!({"componentType": UNSIGNED_BYTE, "count": 4096, "type": "SCALAR"}));
    let places = gltf.push("accessors", json!({"componentType": FLOAT, "count": 100, "type": "VEC3"}));
    gltf.json["meshes"][0]["primitives"][0]["indices"] = zeros.into();
    gltf.json["nodes"][0]["extensions"] = instancing;
    gltf.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"]["TRANSLATION"] =
        places.into();
    refused(&gltf);
    // Compressed, a byte may be many.
    let mut gltf = triangle();
    let packed =
        json!({"buffer": 0, "byteLength": 42, "byteStride": 256, "count": 10_000, "mode": "ATTRIBUTES"});
    gltf.json["bufferViews"][0]["extensions"] = json!({"EXT_meshopt_compression": packed});
    refused(&gltf);
}

#[test]
fn force_reads_what_asks_for_the_unknown() {
    let mut gltf = triangle();
    gltf.json["extensionsRequired"] = json!(["EXT_unheard_of"]);
    let mut options = ReadOptions::default();
    options.force = true;
    assert_eq!(read_with(&gltf.glb(), &options).unwrap().mesh.triangles.len(), 1);
}

#[test]
fn every_length_of_a_cut_file() {
    let (binary, text) = (triangle().glb(), triangle().text());
    for bytes in [&binary, &text] {
        for length in 0..bytes.len() {
            let outcome = read_bytes(&bytes[..length], Some(Format::Gltf), "");
            assert!(matches!(outcome, Err(Error::Input(_))), "{length}: {outcome:?}");
        }
    }
}

/// A document with something of everything.
fn rich() -> Gltf {
    let mut gltf = triangle();
    let uv = gltf.accessor("VEC2", UNSIGNED_BYTE, 3, &[1, 2, 3, 4, 5, 6]);
    let normals = gltf.floats("VEC3", &[0.0, 0.0, 1.0].repeat(3));
    let (at, values) = (gltf.view(&[1]), gltf.view(&[0; 12]));
    gltf.json["accessors"][normals]["sparse"] = json!({
        "count": 1, "indices": {"bufferView": at, "componentType": UNSIGNED_BYTE}, "values": {"bufferView": values},
    });
    let attributes = &mut gltf.json["meshes"][0]["primitives"][0]["attributes"];
    attributes["TEXCOORD_0"] = uv.into();
    attributes["NORMAL"] = normals.into();
    let places = gltf.floats("VEC3", &[1.0; 6]);
    let instancing = json!({"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": places}}});
    gltf.json["nodes"] =
        json!([{"children": [1], "scale": [1, -2, 1]}, {"mesh": 0, "extensions": instancing}]);
    gltf.json["scenes"] = json!([{"nodes": [0]}]);
    gltf
}

proptest! {
    #[test]
    fn changed_values_do_no_harm(
        at in any::<prop::sample::Index>(),
        value in prop::sample::select(vec![
            json!(0), json!(1), json!(2), json!(-1), json!(1.5), json!(4_294_967_295u64), json!(u64::MAX), json!(1e308),
            json!(null), json!("x"), json!([]), json!({}), json!([0]), json!(true), json!(5125), json!("VEC4"),
        ]),
        binary: bool,
    ) {
        let mut gltf = rich();
        gltf.json["buffers"][0]["byteLength"] = gltf.binary.len().into();
        let mut pointers = Vec::new();
        collect(&gltf.json, String::new(), &mut pointers);
        *gltf.json.pointer_mut(&pointers[at.index(pointers.len())]).unwrap() = value;
        let mut options = ReadOptions::default();
        options.max_memory = 1 << 24;
        // Text would put a URI into what may be no object any more.
        let bytes = if binary || !gltf.json["buffers"][0].is_object() { gltf.glb_as_it_is() } else { gltf.text() };
        match read_with(&bytes, &options) {
            Ok(source) => {
                let n = source.mesh.positions.len() as u32;
                prop_assert!(source.mesh.triangles.iter().flatten().all(|&v| v < n));
                prop_assert!(source.mesh.positions.iter().flatten().all(|x| x.is_finite()));
                for attribute in &source.mesh.attributes {
                    prop_assert_eq!(attribute.check(source.mesh.triangles.len()), Ok(()));
                }
            }
            Err(e) => prop_assert!(matches!(e, Error::Input(_) | Error::Limit { .. }), "{e:?}"),
        }
    }
}

/// Pointers of all values below one.
fn collect(value: &Value, pointer: String, pointers: &mut Vec<String>) {
    match value {
        Value::Array(list) => {
            list.iter().enumerate().for_each(|(k, v)| collect(v, format!("{pointer}/{k}"), pointers))
        }
        Value::Object(object) => {
            object.iter().for_each(|(k, v)| collect(v, format!("{pointer}/{k}"), pointers))
        }
        _ => {}
    }
    pointers.push(pointer);
}
