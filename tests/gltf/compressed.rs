//! Compressed buffers. The bytes were written by meshoptimizer 1.0 (crate `meshopt` 0.7) and by the crate `draco-core` 2.3.3.

use crate::builder::*;
use serde_json::json;

/// 20 vertices of four 16-bit numbers: 300 k, k squared, 7 (k mod 3), 0.
fn vertices() -> Vec<[f64; 3]> {
    (0..20u16).map(|k| [300 * k, k * k, 7 * (k % 3)].map(f64::from)).collect()
}

const VERTICES_0: [u8; 125] = [
    160, 7, 0, 88, 88, 88, 88, 88, 88, 88, 88, 88, 88, 88, 88, 88, 88, 88, 255, 0, 0, 0, 88, 88, 88, 88, 5,
    42, 174, 170, 234, 4, 4, 174, 0, 0, 0, 4, 7, 0, 2, 6, 10, 14, 18, 22, 26, 30, 34, 38, 42, 46, 50, 54, 58,
    255, 0, 0, 0, 62, 66, 70, 74, 4, 128, 0, 0, 0, 6, 14, 239, 238, 254, 239, 238, 254, 239, 27, 27, 27, 27,
    27, 255, 0, 0, 0, 14, 14, 27, 14, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
    0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
];
const VERTICES_1: [u8; 91] = [
    161, 183, 169, 0, 88, 88, 88, 88, 88, 88, 88, 88, 88, 88, 88, 88, 88, 88, 88, 88, 88, 88, 88, 5, 42, 170,
    170, 170, 170, 0, 0, 0, 0, 2, 6, 10, 14, 18, 22, 26, 30, 34, 38, 42, 46, 50, 54, 58, 62, 66, 70, 74, 2,
    7, 158, 121, 231, 158, 121, 231, 158, 15, 0, 7, 9, 14, 7, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
    0, 0, 0, 0, 0, 0, 1, 2,
];
const INDICES: [u16; 18] = [0, 1, 2, 2, 1, 3, 4, 6, 5, 7, 8, 9, 2, 3, 9, 17, 3, 900];
const TRIANGLES: [u8; 34] = [
    225, 240, 16, 254, 255, 111, 255, 240, 12, 255, 2, 2, 2, 0, 143, 16, 230, 13, 0, 118, 135, 86, 103, 120,
    169, 134, 101, 137, 104, 152, 1, 105, 0, 0,
];
const SEQUENCE: [u8; 24] = [209, 0, 4, 4, 0, 2, 8, 4, 8, 2, 8, 4, 4, 26, 4, 24, 32, 54, 145, 28, 0, 0, 0, 0];

/// A view of compressed bytes, which lie in a buffer that is there; that of the view is not.
fn packed(gltf: &mut Gltf, bytes: &[u8], mode: &str, count: usize, stride: usize) -> usize {
    let view = gltf.view(bytes);
    let mut extension = gltf.json["bufferViews"][view].clone();
    extension["mode"] = mode.into();
    extension["count"] = count.into();
    extension["byteStride"] = stride.into();
    let fallback = gltf.push("buffers", json!({"byteLength": count * stride}));
    gltf.json["bufferViews"][view] = json!({
        "buffer": fallback, "byteLength": count * stride, "extensions": {"EXT_meshopt_compression": extension},
    });
    view
}

fn with_vertices(bytes: &[u8]) -> Gltf {
    let mut gltf = Gltf::new();
    let view = packed(&mut gltf, bytes, "ATTRIBUTES", 20, 8);
    gltf.json["bufferViews"][view]["byteStride"] = 8.into();
    gltf.push(
        "accessors",
        json!({"bufferView": view, "componentType": UNSIGNED_SHORT, "count": 20, "type": "VEC3"}),
    );
    gltf.shown(json!({"attributes": {"POSITION": 0}, "mode": 5}));
    gltf.json["extensionsRequired"] = json!(["EXT_meshopt_compression", "KHR_mesh_quantization"]);
    gltf
}

#[test]
fn vertices_of_meshoptimizer() {
    for bytes in [&VERTICES_0[..], &VERTICES_1] {
        assert_eq!(with_vertices(bytes).read().mesh.positions, vertices());
        for length in 0..bytes.len() {
            let says = with_vertices(&bytes[..length]).refused();
            let at = "/bufferViews/0/extensions/EXT_meshopt_compression: ";
            assert!(says.starts_with(at), "{length}: {says}");
        }
        let longer = with_vertices(&[bytes, &[0]].concat()).refused();
        assert!(longer.ends_with("the compressed data are damaged, or end early"), "{longer}");
    }
}

#[test]
fn indices_of_meshoptimizer() {
    let flat = |bytes: &[u8], mode, stride| {
        let mut gltf = Gltf::new();
        let points: Vec<f32> = (0..901).flat_map(|k| [k as f32, 0.0, 1.0]).collect();
        let positions = gltf.floats("VEC3", &points);
        let view = packed(&mut gltf, bytes, mode, INDICES.len(), stride);
        let component = if stride == 2 { UNSIGNED_SHORT } else { UNSIGNED_INT };
        let indices =
            json!({"bufferView": view, "componentType": component, "count": INDICES.len(), "type": "SCALAR"});
        let indices = gltf.push("accessors", indices);
        gltf.shown(json!({"attributes": {"POSITION": positions}, "indices": indices}));
        gltf
    };
    let expected: Vec<u32> = INDICES.iter().map(|&index| index.into()).collect();
    for stride in [2, 4] {
        for (bytes, mode) in [(&TRIANGLES[..], "TRIANGLES"), (&SEQUENCE, "INDICES")] {
            assert_eq!(flat(bytes, mode, stride).read().mesh.triangles.as_flattened(), expected);
            for length in 0..bytes.len() {
                flat(&bytes[..length], mode, stride).refused();
            }
        }
    }
    let at = "/bufferViews/1/extensions/EXT_meshopt_compression";
    assert_eq!(flat(&SEQUENCE, "ODD", 2).refused(), format!("{at}/mode: no mode that is known"));
    let stride = format!("{at}: elements of 8 bytes do not go with its mode and filter");
    assert_eq!(flat(&SEQUENCE, "INDICES", 8).refused(), stride);
}

#[test]
fn filters_of_meshoptimizer() {
    // One vertex, whose bytes are the last ones of the file: version 0, a group that does not differ.
    let unpacked = |bytes: [u8; 8], filter: &str| {
        let packed_bytes = [&[160u8][..], &[0; 8], &[0; 24], &bytes].concat();
        let mut gltf = triangle();
        let view = packed(&mut gltf, &packed_bytes, "ATTRIBUTES", 1, 8);
        gltf.json["bufferViews"][view]["extensions"]["EXT_meshopt_compression"]["filter"] = filter.into();
        let (component, kind) = if filter == "EXPONENTIAL" { (FLOAT, "VEC2") } else { (SHORT, "VEC4") };
        // The first vertex of three has it.
        let sparse = json!({
            "count": 1, "indices": {"bufferView": 1, "componentType": UNSIGNED_SHORT}, "values": {"bufferView": view},
        });
        let accessor = gltf.push(
            "accessors",
            json!({"componentType": component, "count": 3, "type": kind, "sparse": sparse}),
        );
        gltf.json["meshes"][0]["primitives"][0]["attributes"]["_A"] = accessor.into();
        let values = gltf.read().mesh.attributes[0].values.clone();
        (0..values.len() / 3).map(|k| values.number(k)).collect::<Vec<f64>>()
    };
    let words = |words: [i16; 4]| {
        let mut bytes = [0; 8];
        bytes.copy_from_slice(words.map(i16::to_le_bytes).as_flattened());
        bytes
    };
    // On an octahedron of 127: (127, 0) is x, (0, 0) is z, and the far corner is -z.
    assert_eq!(unpacked(words([127, 0, 127, 5]), "OCTAHEDRAL"), [32_767.0, 0.0, 0.0, 5.0]);
    assert_eq!(unpacked(words([0, 0, 127, 5]), "OCTAHEDRAL"), [0.0, 0.0, 32_767.0, 5.0]);
    assert_eq!(unpacked(words([127, -127, 127, 5]), "OCTAHEDRAL"), [0.0, 0.0, -32_767.0, 5.0]);
    // Nothing but the number left out, which is the second.
    assert_eq!(unpacked(words([0, 0, 0, 1021]), "QUATERNION"), [0.0, 32_767.0, 0.0, 0.0]);
    // 3 times 2 to the power of -2, and -5 times 2.
    let mut bytes = [0; 8];
    bytes[..4].copy_from_slice(&[3, 0, 0, 0xfe]);
    bytes[4..].copy_from_slice(&[0xfb, 0xff, 0xff, 1]);
    assert_eq!(unpacked(bytes, "EXPONENTIAL"), [0.75, -10.0]);
}

#[cfg(feature = "draco")]
mod draco {
    use super::*;
    use unweld::formats::Source;
    use unweld::mesh::attributes::Semantic;

    /// A tetrahedron of corners 0, x = 1, y = 2, z = 4, with texture coordinates (0, 0), (1, 0), (0, 1), (1, 1) there.
    const TETRAHEDRON: [u8; 128] = [
        68, 82, 65, 67, 79, 2, 2, 1, 1, 0, 0, 0, 4, 4, 1, 3, 0, 0, 1, 47, 1, 1, 16, 255, 2, 102, 64, 2, 255,
        0, 0, 0, 0, 0, 1, 0, 9, 3, 0, 0, 0, 1, 3, 9, 2, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 128, 64, 0, 0,
        0, 0, 0, 0, 0, 64, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 128, 63, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 128, 63, 0, 0, 128, 63, 0, 0, 0, 0, 0, 0, 128, 63, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 128, 63,
        0, 0, 0, 0,
    ];

    fn compressed(bytes: &[u8]) -> Gltf {
        let mut gltf = Gltf::new();
        let view = gltf.view(bytes);
        let position = gltf.push("accessors", json!({"componentType": FLOAT, "count": 4, "type": "VEC3"}));
        let uv = gltf.push("accessors", json!({"componentType": FLOAT, "count": 4, "type": "VEC2"}));
        let indices =
            gltf.push("accessors", json!({"componentType": UNSIGNED_INT, "count": 12, "type": "SCALAR"}));
        let extension = json!({"bufferView": view, "attributes": {"POSITION": 0, "TEXCOORD_0": 1}});
        gltf.shown(json!({
            "attributes": {"POSITION": position, "TEXCOORD_0": uv}, "indices": indices,
            "extensions": {"KHR_draco_mesh_compression": extension},
        }));
        gltf.json["extensionsRequired"] = json!(["KHR_draco_mesh_compression"]);
        gltf
    }

    /// The corners of all triangles, each beginning at its least.
    fn corners(source: &Source) -> Vec<[[i64; 5]; 3]> {
        let uv = source.mesh.attributes.iter().find(|a| a.semantic == Semantic::TexCoord).unwrap();
        let corner = |t: usize, k: usize| {
            let [x, y, z] = source.mesh.positions[source.mesh.triangles[t][k] as usize];
            let value = uv.at(t, k).unwrap();
            [x, y, z, uv.values.number(2 * value), uv.values.number(2 * value + 1)].map(|x| x as i64)
        };
        let mut all: Vec<_> = (0..source.mesh.triangles.len())
            .map(|t| {
                let mut corners = [0, 1, 2].map(|k| corner(t, k));
                let least = (0..3).min_by_key(|&k| corners[k]).unwrap();
                corners.rotate_left(least);
                corners
            })
            .collect();
        all.sort_unstable();
        all
    }

    #[test]
    fn a_primitive_of_draco() {
        // The last number is 1 - v of the file.
        let (o, x, y, z) = ([0, 0, 0, 0, 1], [1, 0, 0, 1, 1], [0, 2, 0, 0, 0], [0, 0, 4, 1, 0]);
        let source = compressed(&TETRAHEDRON).read();
        assert_eq!(corners(&source), [[o, z, y], [o, y, x], [o, x, z], [z, x, y]]);
        assert!(source.dropped.is_empty());
    }

    #[test]
    fn damaged_draco() {
        let at = "/meshes/0/primitives/0/extensions/KHR_draco_mesh_compression";
        for length in 1..TETRAHEDRON.len() {
            let says = compressed(&TETRAHEDRON[..length]).refused();
            assert!(says.starts_with(&format!("{at}: Draco: ")), "{length}: {says}");
        }
        for k in 0..TETRAHEDRON.len() {
            for value in [0, 1, 127, 128, 255] {
                let mut bytes = TETRAHEDRON;
                bytes[k] = value;
                let _ = compressed(&bytes).outcome();
            }
        }
        let mut gltf = compressed(&TETRAHEDRON);
        let extension =
            &mut gltf.json["meshes"][0]["primitives"][0]["extensions"]["KHR_draco_mesh_compression"];
        extension["attributes"]["TEXCOORD_0"] = 7.into();
        assert_eq!(gltf.refused(), format!("{at}/attributes/TEXCOORD_0: the Draco data have no attribute 7"));
        gltf.json["meshes"][0]["primitives"][0]["extensions"]["KHR_draco_mesh_compression"]["attributes"]["TEXCOORD_0"] =
            0.into();
        let what = "the Draco data have 3 numbers a vertex, the accessor 2";
        assert_eq!(gltf.refused(), format!("{at}/attributes/TEXCOORD_0: {what}"));
    }
}

#[cfg(not(feature = "draco"))]
#[test]
fn draco_is_named() {
    let mut gltf = triangle();
    let extension = json!({"KHR_draco_mesh_compression": {"bufferView": 0, "attributes": {}}});
    gltf.json["meshes"][0]["primitives"][0]["extensions"] = extension;
    assert_eq!(gltf.read().mesh.triangles.len(), 1);
    gltf.json["accessors"][0].as_object_mut().unwrap().remove("bufferView");
    assert!(gltf.refused().contains("built without the feature `draco`"));
}
