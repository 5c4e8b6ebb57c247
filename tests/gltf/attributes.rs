//! What vertices have besides their places.

use crate::builder::*;
use serde_json::{Value, json};
use unweld::mesh::attributes::{Attribute, NO_VALUE, Semantic, Stored, Values};

/// A triangle with further attributes.
fn with(add: impl Fn(&mut Gltf) -> Value) -> Gltf {
    let mut gltf = triangle();
    let further = add(&mut gltf);
    let attributes = &mut gltf.json["meshes"][0]["primitives"][0]["attributes"];
    further.as_object().unwrap().iter().for_each(|(name, accessor)| attributes[name] = accessor.clone());
    gltf
}

fn near(values: &Values, expected: &[f64]) -> bool {
    values.len() == expected.len()
        && expected.iter().enumerate().all(|(k, x)| (values.number(k) - x).abs() < 1e-6)
}

#[test]
fn all_semantics_and_types() {
    let source = with(|gltf| {
        let colours = gltf.accessor("VEC4", UNSIGNED_BYTE, 3, &[1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12]);
        let weights = gltf.accessor("VEC4", UNSIGNED_SHORT, 3, &[0; 24]);
        json!({
            "NORMAL": gltf.floats("VEC3", &[0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0]),
            "TANGENT": gltf.floats("VEC4", &[1.0, 0.0, 0.0, -1.0].repeat(3)),
            "TEXCOORD_1": gltf.floats("VEC2", &[0.0, 0.25, 0.5, 0.75, 1.0, f32::NAN]),
            "COLOR_0": gltf.normalised(colours),
            "JOINTS_0": gltf.accessor("VEC4", UNSIGNED_SHORT, 3, &[7; 24]),
            "WEIGHTS_0": gltf.normalised(weights),
            "_ID": gltf.accessor("SCALAR", UNSIGNED_INT, 3, &[9, 0, 0, 1, 8, 0, 0, 0, 7, 0, 0, 0]),
            "ODD_01": gltf.floats("SCALAR", &[1.5, 2.5, 3.5]),
        })
    })
    .read();
    let told = |a: &Attribute| (a.title(), a.semantic, a.set, a.components, a.values.stored(), a.normalised);
    let all: Vec<_> = source.mesh.attributes.iter().map(told).collect();
    let expected = [
        ("normal", Semantic::Normal, 0, 3, Stored::F32, false),
        ("tangent", Semantic::Tangent, 0, 4, Stored::F32, false),
        ("uv1", Semantic::TexCoord, 1, 2, Stored::F32, false),
        ("color", Semantic::Color, 0, 4, Stored::U8, true),
        ("joints", Semantic::Joints, 0, 4, Stored::U16, false),
        ("weights", Semantic::Weights, 0, 4, Stored::U16, true),
        ("ODD_01", Semantic::Generic, 0, 1, Stored::F32, false),
        ("_ID", Semantic::Generic, 0, 1, Stored::U32, false),
    ];
    assert_eq!(all, expected.map(|(a, b, c, d, e, f)| (a.to_owned(), b, c, d, e, f)));
    assert!(source.mesh.attributes.iter().all(|a| a.corners == [0, 1, 2]));
    assert_eq!(source.mesh.attributes[7].values, Values::U32(vec![0x0100_0009, 8, 7]));
    assert!(source.dropped.is_empty());
}

#[test]
fn matrices_have_columns_of_four_bytes() {
    let rows = [1u8, 2, 3, 0, 4, 5, 6, 0, 7, 8, 9, 0].repeat(3);
    let gltf = with(|gltf| json!({"_M": gltf.accessor("MAT3", UNSIGNED_BYTE, 3, &rows)}));
    let expected = Values::U8([1, 2, 3, 4, 5, 6, 7, 8, 9].repeat(3));
    assert_eq!(gltf.read().mesh.attributes[0].values, expected);
    // The last column needs no padding behind it.
    let gltf =
        with(|gltf| json!({"_M": gltf.accessor("MAT2", BYTE, 3, &[1, 2, 0, 0, 3, 4, 0, 0].repeat(3)[..22])}));
    assert_eq!(gltf.read().mesh.attributes[0].values, Values::I8([1, 2, 3, 4].repeat(3)));
}

#[test]
fn directions_turn_with_their_nodes() {
    let mut gltf = with(|gltf| {
        json!({
            "NORMAL": gltf.floats("VEC3", &[0.6, 0.8, 0.0].repeat(3)),
            "TANGENT": gltf.floats("VEC4", &[0.8, -0.6, 0.0, 1.0].repeat(3)),
        })
    });
    let directions = |gltf: &Gltf| {
        let attributes = gltf.read().mesh.attributes;
        let [normal, tangent] = &attributes[..] else { panic!() };
        (normal.values.clone(), tangent.values.clone())
    };
    let plain = directions(&gltf);
    // Moved and scaled, they are the same bits.
    gltf.json["nodes"][0]["scale"] = json!([3, 3, 3]);
    gltf.json["nodes"][0]["translation"] = json!([3, 0, 0]);
    assert_eq!(directions(&gltf), plain);
    // Along x twice as long: a normal (0.6, 0.8) becomes (0.3, 0.8), a tangent (0.8, -0.6) becomes (1.6, -0.6).
    gltf.json["nodes"][0]["scale"] = json!([2, 1, 1]);
    let (normal, tangent) = directions(&gltf);
    let (n, t) = (0.73f64.sqrt(), 2.92f64.sqrt());
    assert!(near(&normal, &[0.3 / n, 0.8 / n, 0.0].repeat(3)));
    assert!(near(&tangent, &[1.6 / t, -0.6 / t, 0.0, 1.0].repeat(3)));
    // Mirrored along y: the bitangent n x t = (0, 0, -1) stays, but the new cross product is (0, 0, 1).
    gltf.json["nodes"][0]["scale"] = json!([1, -1, 1]);
    let (normal, tangent) = directions(&gltf);
    assert!(near(&normal, &[0.6, -0.8, 0.0].repeat(3)) && near(&tangent, &[0.8, 0.6, 0.0, -1.0].repeat(3)));
}

#[test]
fn instances_share_values_that_do_not_turn() {
    let mut gltf = with(|gltf| {
        json!({
            "NORMAL": gltf.floats("VEC3", &[0.0, 0.0, 1.0].repeat(3)),
            "TEXCOORD_0": gltf.floats("VEC2", &[0.0, 0.0, 1.0, 0.0, 0.0, 1.0]),
        })
    });
    gltf.json["nodes"] =
        json!([{"mesh": 0}, {"mesh": 0, "translation": [0, 0, 9]}, {"mesh": 0, "scale": [1, 1, -1]}]);
    let source = gltf.read();
    let [normal, uv] = &source.mesh.attributes[..] else { panic!() };
    assert_eq!((uv.count(), &uv.corners[..]), (3, &[0, 1, 2, 0, 1, 2, 0, 2, 1][..]));
    assert_eq!((normal.count(), &normal.corners[..]), (6, &[0, 1, 2, 0, 1, 2, 3, 5, 4][..]));
    assert_eq!(normal.values, Values::F32([[0.0, 0.0, 1.0].repeat(3), [0.0, 0.0, -1.0].repeat(3)].concat()));
}

/// Two primitives of one mesh with an attribute each, of which one may be another's type.
fn two(
    name: &str,
    first: impl Fn(&mut Gltf) -> Value,
    second: impl Fn(&mut Gltf) -> Value,
) -> (Attribute, Vec<String>) {
    let mut gltf = with(|gltf| json!({name: first(gltf)}));
    let accessor = second(&mut gltf);
    let mut primitive = json!({"attributes": {"POSITION": 0}, "indices": 1});
    if !accessor.is_null() {
        primitive["attributes"][name] = accessor;
    }
    gltf.json["meshes"][0]["primitives"].as_array_mut().unwrap().push(primitive);
    let source = gltf.read();
    let attribute = source.mesh.attributes.into_iter().find(|a| a.semantic != Semantic::Part).unwrap();
    (attribute, source.dropped)
}

#[test]
fn what_only_some_primitives_have_is_partial() {
    let (uv, dropped) = two(
        "TEXCOORD_0",
        |gltf| gltf.floats("VEC2", &[0.0, 0.0, 1.0, 0.0, 0.0, 1.0]).into(),
        |_| Value::Null,
    );
    assert_eq!(uv.corners, [0, 1, 2, NO_VALUE, NO_VALUE, NO_VALUE]);
    assert!(dropped.is_empty());
}

#[test]
fn types_that_differ_become_one_that_holds_both() {
    let bytes = |gltf: &mut Gltf, kind: &str, component, bytes: &[u8], normalised: bool| -> Value {
        let accessor = gltf.accessor(kind, component, 3, bytes);
        if normalised { gltf.normalised(accessor).into() } else { accessor.into() }
    };
    // 8 and 16 bits that stand for fractions: 257 for 1 of 255; and what has no alpha is opaque.
    let (color, dropped) = two(
        "COLOR_0",
        |gltf| bytes(gltf, "VEC3", UNSIGNED_BYTE, &[0, 1, 255, 4, 5, 6, 7, 8, 9], true),
        |gltf| bytes(gltf, "VEC4", UNSIGNED_SHORT, &[1, 0, 2, 0, 3, 0, 4, 0].repeat(3), true),
    );
    let Values::U16(list) = &color.values else { panic!("{color:?}") };
    assert_eq!(
        (&list[..4], &list[12..16], color.normalised),
        (&[0, 257, 65_535, 65_535][..], &[1, 2, 3, 4][..], true)
    );
    assert_eq!(
        dropped,
        ["types of COLOR_0 (3 u8 normalised, 4 u16 normalised; all are 4 u16 normalised now)"]
    );
    // Signs and sizes of integers.
    let (id, dropped) = two(
        "_ID",
        |gltf| bytes(gltf, "SCALAR", UNSIGNED_BYTE, &[200, 1, 2], false),
        |gltf| bytes(gltf, "SCALAR", BYTE, &[200, 1, 2], false),
    );
    assert_eq!(id.values, Values::I16(vec![200, 1, 2, -56, 1, 2]));
    assert_eq!(dropped, ["types of _ID (1 u8, 1 i8; all are 1 i16 now)"]);
    // Fractions beside floating-point numbers.
    let (weights, _) = two(
        "TEXCOORD_0",
        |gltf| bytes(gltf, "VEC2", UNSIGNED_BYTE, &[0, 51, 255, 0, 0, 0], true),
        |gltf| gltf.floats("VEC2", &[0.1, 0.2, 0.3, 0.4, 0.5, 0.6]).into(),
    );
    // v is turned round.
    let expected = [0.0, 0.8, 1.0, 1.0, 0.0, 1.0, 0.1, 0.8, 0.3, 0.6, 0.5, 0.4];
    assert!(
        weights.values.stored() == Stored::F32 && near(&weights.values, &expected) && !weights.normalised
    );
    // 32 bits are more than binary32 has.
    let (wide, _) = two(
        "_ID",
        |gltf| bytes(gltf, "SCALAR", UNSIGNED_INT, &[1, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0], false),
        |gltf| gltf.floats("SCALAR", &[0.5, 0.0, 0.0]).into(),
    );
    assert_eq!(wide.values, Values::F64(vec![16_777_217.0, 0.0, 0.0, 0.5, 0.0, 0.0]));
}

#[test]
fn values_of_no_triangle_are_named() {
    let mut gltf = with(|gltf| json!({"TEXCOORD_0": gltf.floats("VEC2", &[0.0; 8])}));
    let positions = gltf.floats("VEC3", &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 5.0, 5.0, 5.0]);
    gltf.json["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = positions.into();
    let source = gltf.read();
    assert_eq!((source.mesh.positions.len(), source.mesh.attributes[0].count()), (4, 3));
    assert_eq!(source.dropped, ["TEXCOORD_0 of no triangle (1)"]);
}

#[test]
fn parts_by_their_names() {
    let mut gltf = triangle();
    gltf.json["meshes"][0]["name"] = "Cart\nwheel".into();
    gltf.json["materials"] = json!([{"name": "steel"}, {}]);
    let primitive =
        |material: Value| json!({"attributes": {"POSITION": 0}, "indices": 1, "material": material});
    gltf.json["meshes"][0]["primitives"] = json!([primitive(0.into()), primitive(1.into())]);
    gltf.shown(primitive(1.into()));
    let source = gltf.read();
    let expected = [
        "o Cart wheel\ng primitive 0\nusemtl steel",
        "o Cart wheel\ng primitive 1\nusemtl material 1",
        "o mesh 1\nusemtl material 1",
    ];
    assert_eq!(source.mesh.part_names, expected);
    assert_eq!(source.mesh.attributes[0].corners, [0, 1, 2]);
    assert_eq!(source.dropped, ["materials (2)"]);
    gltf.json["meshes"][1]["primitives"][0]["material"] = 2.into();
    assert_eq!(gltf.refused(), "/meshes/1/primitives/0/material: names item 2 of /materials, which has 2");
}

#[test]
fn what_is_dropped_is_named() {
    let mut gltf = triangle();
    let primitive = &mut gltf.json["meshes"][0]["primitives"][0];
    primitive["targets"] = json!([{"POSITION": 0}, {"POSITION": 0}]);
    primitive["extras"] = json!({"extras": 3});
    primitive["extensions"] = json!({"KHR_materials_variants": {"mappings": []}});
    for (list, item) in [
        ("skins", json!({"joints": [0]})),
        ("animations", json!({})),
        ("cameras", json!({})),
        ("materials", json!({"extensions": {"KHR_materials_unlit": {}, "a\nb": {}}})),
        ("textures", json!({})),
        ("images", json!({})),
    ] {
        gltf.push(list, item);
    }
    gltf.json["nodes"][0]["skin"] = 0.into();
    gltf.json["extensionsUsed"] = json!(["KHR_materials_unlit", "KHR_mesh_quantization"]);
    gltf.json["extensionsRequired"] = json!(["KHR_materials_unlit", "KHR_mesh_quantization"]);
    let expected = [
        "morph targets (2)",
        "skins (1)",
        "animations (1)",
        "cameras (1)",
        "materials (1)",
        "textures (1)",
        "images (1)",
        "objects with extras (1)",
        "extension KHR_materials_unlit (1)",
        "extension KHR_materials_variants (1)",
        "extension a\\nb (1)",
    ];
    assert_eq!(gltf.read().dropped, expected);
}
