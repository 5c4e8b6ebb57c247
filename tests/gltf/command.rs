//! Scenes through the commands: in, to coarser levels, out again in all forms, and back in.

use crate::builder::*;
use crate::scenes::options;
use crate::written::{corners, scene, text};
use serde_json::{Value, json};
use std::process::Command;
use tempfile::TempDir;
use unweld::formats::{self, Source, read_with};
use unweld::mesh::attributes::{Attribute, Semantic};

struct Folder(TempDir);

impl Folder {
    fn with(name: &str, bytes: impl AsRef<[u8]>) -> Self {
        let folder = Self(tempfile::tempdir().unwrap());
        std::fs::write(folder.0.path().join(name), bytes).unwrap();
        folder
    }

    /// The exit code, and what was said.
    fn run(&self, arguments: &str) -> (i32, String) {
        let mut command = Command::new(env!("CARGO_BIN_EXE_unweld"));
        let output = command.args(arguments.split_whitespace()).current_dir(self.0.path()).output().unwrap();
        let text = String::from_utf8([output.stdout, output.stderr].concat()).unwrap();
        (output.status.code().unwrap(), text)
    }

    fn done(&self, arguments: &str) -> String {
        let (code, text) = self.run(arguments);
        assert_eq!(code, 0, "{arguments}: {text}");
        text
    }

    fn bytes(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.0.path().join(name)).unwrap()
    }

    fn json(&self, name: &str) -> Value {
        text(&self.bytes(name))
    }

    fn scene(&self, name: &str) -> Source {
        let mut options = options();
        options.folder = Some(self.0.path().to_owned());
        read_with(&self.bytes(name), &options).unwrap()
    }

    fn flat(&self, name: &str) -> Source {
        formats::read(&self.0.path().join(name)).unwrap()
    }
}

/// A strip of 3 by 0.4 along x, of so many columns of 5 vertices, at height z.
fn strip(gltf: &mut Gltf, columns: usize, z: f32) -> (Vec<[f32; 3]>, Value) {
    let place = |k: usize| [3.0 * (k / 5) as f32 / (columns - 1) as f32, 0.1 * (k % 5) as f32, z];
    let places: Vec<[f32; 3]> = (0..5 * columns).map(place).collect();
    let positions = gltf.floats("VEC3", places.as_flattened());
    let quads = (0..columns - 1).flat_map(|i| (0..4).map(move |j| 5 * i as u16 + j));
    let indices = gltf.indices(&quads.flat_map(|k| [k, k + 5, k + 6, k, k + 6, k + 1]).collect::<Vec<_>>());
    (places, json!({"attributes": {"POSITION": positions}, "indices": indices}))
}

/// With a picture, a colour and texture coordinates, twice in the scene; and lines.
fn textured() -> Gltf {
    let mut gltf = Gltf::new();
    let (places, mut primitive) = strip(&mut gltf, 80, 0.25);
    let uv: Vec<f32> = places.iter().flat_map(|[x, y, _]| [x / 4.0, 2.0 * y]).collect();
    let normals: Vec<f32> = places.iter().flat_map(|_| [0.0, 0.0, 1.0]).collect();
    primitive["attributes"]["TEXCOORD_0"] = gltf.floats("VEC2", &uv).into();
    primitive["attributes"]["NORMAL"] = gltf.floats("VEC3", &normals).into();
    primitive["material"] = 0.into();
    let picture = gltf.view(b"\x89PNG\r\n\x1a\nno more");
    gltf.push("images", json!({"bufferView": picture, "mimeType": "image/png", "name": "../bark one"}));
    gltf.push("textures", json!({"source": 0}));
    gltf.push(
        "materials",
        json!({"name": "wood", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}),
    );
    gltf.push("meshes", json!({"primitives": [primitive]}));
    let ends = gltf.floats("VEC3", &[0.0, 0.0, 0.0, 1.0, 0.5, 0.25]);
    gltf.push("meshes", json!({"primitives": [{"attributes": {"POSITION": ends}, "mode": 1}]}));
    gltf.push("nodes", json!({"mesh": 0, "scale": [2, -1, 2], "children": [1, 2], "name": "top"}));
    gltf.push("nodes", json!({"mesh": 0, "translation": [0, 7, 0], "rotation": [0, 0.6, 0, 0.8]}));
    gltf.push("nodes", json!({"mesh": 1}));
    let [times, values] = [gltf.floats("SCALAR", &[0.0, 1.0]), gltf.floats("VEC3", &[0.0; 6])];
    gltf.push(
        "animations",
        json!({
            "samplers": [{"input": times, "output": values}],
            "channels": [{"sampler": 0, "target": {"node": 1, "path": "translation"}}],
        }),
    );
    gltf.json["scenes"] = json!([{"nodes": [0]}]);
    gltf.json["scene"] = 0.into();
    gltf
}

fn base(folder: &Folder, name: &str) -> u64 {
    let info: Value = serde_json::from_str(&folder.done(&format!("info {name} --json"))).unwrap();
    info["levels"].as_array().unwrap().len() as u64 - 1
}

/// Numbers of an attribute at a corner, as fractions.
fn value(source: &Source, semantic: Semantic, corner: usize) -> Vec<f64> {
    let of = |a: &&Attribute| a.semantic == semantic;
    let attribute = source.mesh.attributes.iter().find(of).unwrap();
    let at = attribute.at(corner / 3, corner % 3).unwrap() * attribute.components;
    (at..at + attribute.components).map(|at| attribute.values.fraction(at, attribute.normalised)).collect()
}

/// A node that two others may stand for, and one that is at all levels; a scene keeps all of that.
#[test]
fn levels_of_detail_of_nodes() {
    let mut gltf = Gltf::new();
    let meshes = [(20, 0.0), (10, 0.0), (4, 0.0), (5, 1.0)].map(|(columns, z)| {
        let (_, primitive) = strip(&mut gltf, columns, z);
        gltf.mesh(primitive)
    });
    let coarser = json!({"MSFT_lod": {"ids": [2, 3]}});
    let coverage = json!({"MSFT_screencoverage": [0.5, 0.2, 0.01]});
    gltf.push("nodes", json!({"children": [1, 4], "translation": [0, 0, 2]}));
    gltf.push("nodes", json!({"mesh": meshes[0], "extensions": coarser, "extras": coverage}));
    gltf.push("nodes", json!({"mesh": meshes[1]}));
    gltf.push("nodes", json!({"mesh": meshes[2], "translation": [0, 0, 1]}));
    gltf.push("nodes", json!({"mesh": meshes[3]}));
    // Those of materials are other things.
    gltf.push("materials", json!({"extensions": {"MSFT_lod": {"ids": [1]}}}));
    gltf.push("materials", json!({}));
    gltf.json["extensionsUsed"] = json!(["MSFT_lod"]);
    gltf.json["scenes"] = json!([{"nodes": [0]}]);
    let folder = Folder::with("a.glb", gltf.glb());
    folder.done("encode a.glb -o a.uwm -q");
    folder.done("decode a.uwm -o b.glb -q");
    for name in ["a.glb", "b.glb"] {
        let told = folder.done(&format!("pack {name} -o set.uwm --exact"));
        let materials = "materials (2), levels of detail of materials (1)";
        let all = format!("nodes, flattened (2), {materials}, objects with extras (1)");
        assert!(told.contains(&format!("{name}, level 2: dropped {all}\n")), "{told}");
        folder.done("unpack set.uwm -o out -q");
        // Two triangles for each of 4 quads between columns.
        for (level, columns, z) in [(0, 19 + 4, 2.0), (1, 9 + 4, 2.0), (2, 3 + 4, 3.0)] {
            let mesh = folder.flat(&format!("out/level-{level}.ply")).mesh;
            let least = mesh.positions.iter().map(|p| p[2]).fold(f64::MAX, f64::min);
            assert_eq!((mesh.triangles.len(), least), (8 * columns, z), "{name}, level {level}");
        }
    }
}

/// Joint j has weight 1 at x = j and 0 from the next one on.
#[test]
fn joints_and_weights_stay_together() {
    let mut gltf = Gltf::new();
    let (places, mut primitive) = strip(&mut gltf, 61, 0.0);
    let (mut joints, mut weights, mut told) = (Vec::new(), Vec::new(), Vec::new());
    for [x, ..] in &places {
        let first = x.floor().min(2.0);
        joints.extend([first as u8, first as u8 + 1, 0, 0]);
        weights.extend([1.0 - (x - first), x - first, 0.0, 0.0]);
        told.push([f64::from(first), f64::from(first) + 1.0, 0.0, 0.0]);
    }
    primitive["attributes"]["JOINTS_0"] = gltf.accessor("VEC4", UNSIGNED_BYTE, places.len(), &joints).into();
    primitive["attributes"]["WEIGHTS_0"] = gltf.floats("VEC4", &weights).into();
    gltf.push("meshes", json!({"primitives": [primitive]}));
    gltf.push("nodes", json!({"mesh": 0, "skin": 0}));
    for k in 0..4 {
        gltf.push("nodes", json!({"translation": [k, 0, 0]}));
    }
    gltf.push("skins", json!({"joints": [1, 2, 3, 4]}));
    let folder = Folder::with("a.glb", gltf.glb());
    folder.done("encode a.glb -o a.uwm -q");
    let base = base(&folder, "a.uwm");
    assert!(base > 1);
    for level in [0, base / 2, base] {
        folder.done(&format!("decode a.uwm -o b.glb --level {level} -q"));
        let source = folder.scene("b.glb");
        for corner in 0..3 * source.mesh.triangles.len() {
            let [joints, weights] = [Semantic::Joints, Semantic::Weights].map(|s| value(&source, s, corner));
            let joints: Vec<f64> = joints.iter().map(|j| j.round()).collect();
            assert!(told.iter().any(|told| told[..] == joints[..]), "{joints:?}");
            assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-6, "{weights:?}");
            let x = source.mesh.positions[source.mesh.triangles.as_flattened()[corner] as usize][0];
            let pulled: f64 = joints.iter().zip(&weights).map(|(j, w)| j * w).sum();
            assert!((pulled - x).abs() < 0.06, "level {level}: {pulled} at {x}");
        }
    }
}

#[test]
fn a_scene_is_encoded_anew_and_verified() {
    let gltf = textured();
    let folder = Folder::with("a.glb", gltf.glb());
    folder.done("encode a.glb -o a.uwm -q");
    folder.done("encode a.uwm -o b.uwm --strict -q");
    let text = folder.done("verify b.uwm a.glb");
    assert!(text.contains("scene ") && text.contains(": the same"), "{text}");
    // A level is one, too, with all that is no geometry.
    folder.done("encode a.uwm -o c.uwm --level 1 -q");
    folder.done("decode c.uwm -o c.glb -q");
    folder.done("decode a.uwm -o d.glb --level 1 -q");
    let [c, d] = ["c.glb", "d.glb"].map(|name| folder.scene(name));
    assert_eq!((c.mesh.triangles.len(), c.mesh.bodies), (d.mesh.triangles.len(), d.mesh.bodies));
    assert_eq!(folder.json("c.glb")["animations"], folder.json("d.glb")["animations"]);
    // What differs is named.
    let differs = |change: &dyn Fn(&mut Gltf)| {
        let mut other = textured();
        change(&mut other);
        std::fs::write(folder.0.path().join("x.glb"), other.glb()).unwrap();
        let (code, text) = folder.run("verify b.uwm x.glb");
        assert_eq!(code, 1, "{text}");
        text
    };
    let text = differs(&|gltf| gltf.json["materials"][0]["name"] = "stone".into());
    assert!(text.contains("/materials/0/name: \"wood\", not \"stone\""), "{text}");
    let at = gltf.binary.windows(7).position(|bytes| bytes == b"no more").unwrap();
    let text = differs(&|gltf| gltf.binary[at] = b'N');
    assert!(text.contains("/images/0/bufferView (../bark one): other bytes"), "{text}");
    let last = gltf.binary.len() - 1;
    let text = differs(&|gltf| gltf.binary[last] = 1);
    assert!(text.contains("/bufferView: other bytes"), "{text}");
    // Whoever wants a mesh alone is told what that has not.
    let text = folder.done("decode a.uwm -o a.ply");
    assert!(text.contains("of the scene it has not primitives of lines (1), nodes, flattened"), "{text}");
    let (code, text) = folder.run("simplify a.uwm -o s.ply --ratio 0.5 --strict");
    assert!(code == 1 && text.contains("animations (1)"), "{text}");
}

#[test]
fn text_with_files_beside_it() {
    let folder = Folder::with("a.glb", textured().glb());
    folder.done("encode a.glb -o a.uwm -q");
    folder.done("decode a.uwm -o out.glb -q");
    folder.done("decode a.uwm -o out.gltf -q");
    let text: Value = serde_json::from_slice(&folder.bytes("out.gltf")).unwrap();
    assert_eq!(text["buffers"][0]["uri"], "out.bin");
    assert_eq!(text["buffers"][0]["byteLength"].as_u64(), Some(folder.bytes("out.bin").len() as u64));
    assert_eq!(text["images"][0]["uri"], "out-bark_one.png");
    assert_eq!(folder.bytes("out-bark_one.png"), b"\x89PNG\r\n\x1a\nno more");
    let [one, other] = ["out.glb", "out.gltf"].map(|name| folder.scene(name));
    assert_eq!(corners(&one.mesh), corners(&other.mesh));
    // It must not be written over what is read.
    std::fs::write(folder.0.path().join("out.bin"), folder.bytes("a.uwm")).unwrap();
    let (code, text) = folder.run("decode out.bin -o out.gltf");
    assert!(code == 2 && text.contains("would be lost"), "{text}");
    let (code, _) = folder.run("simplify a.glb -o plain.gltf --ratio 0.5 -q");
    assert_eq!((code, folder.flat("plain.gltf").mesh.positions.is_empty()), (0, false));
}

/// Integers and the nodes below that put them in their places show what numbers of binary32 show.
#[test]
fn quantised_scenes_show_the_same() {
    let folder = Folder::with("a.glb", textured().glb());
    folder.done("encode a.glb -o a.uwm -q");
    for level in [0, base(&folder, "a.uwm")] {
        folder.done(&format!("decode a.uwm -o plain.glb --level {level} -q"));
        let text =
            folder.done(&format!("decode a.uwm -o small.glb --level {level} --gltf-compression quantize"));
        assert!(text.contains("mesh 1 stays in floating-point numbers: it has points or lines"), "{text}");
        let json = folder.json("small.glb");
        let primitive = &json["meshes"][0]["primitives"][0]["attributes"];
        let type_of =
            |name: &str| &json["accessors"][primitive[name].as_u64().unwrap() as usize]["componentType"];
        assert_eq!(["POSITION", "NORMAL", "TEXCOORD_0"].map(type_of), [5123, 5122, 5123]);
        assert_eq!(json["extensionsRequired"], json!(["KHR_mesh_quantization"]));
        let [plain, small] = ["plain.glb", "small.glb"].map(|name| folder.flat(name));
        assert_eq!(plain.mesh.triangles.len(), small.mesh.triangles.len());
        let apart = |list: &[Source; 2], of: &dyn Fn(&Source, usize) -> Vec<f64>| {
            let corners = 0..3 * list[0].mesh.triangles.len();
            let of_corner = |corner: usize| {
                let [x, y] = [0, 1].map(|k| of(&list[k], corner));
                x.iter().zip(&y).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max)
            };
            corners.map(of_corner).fold(0.0, f64::max)
        };
        let list = [plain, small];
        let place = |source: &Source, corner: usize| {
            source.mesh.positions[source.mesh.triangles.as_flattened()[corner] as usize].to_vec()
        };
        assert!(apart(&list, &place) < 2e-6, "{}", apart(&list, &place));
        for semantic in [Semantic::Normal, Semantic::TexCoord] {
            assert!(apart(&list, &|source, corner| value(source, semantic, corner)) < 1e-4);
        }
    }
}

/// What is compressed unpacks to what is quantised, in a smaller file; of exact numbers, to these.
#[test]
fn compressed_scenes_are_the_same() {
    let folder = Folder::with("a.glb", textured().glb());
    folder.done("encode a.glb -o a.uwm -q");
    folder.done("encode a.glb -o exact.uwm --exact -q");
    // Corners by bits, triangles with the least one first.
    let all = |source: &Source| -> Vec<Vec<Vec<u64>>> {
        let corner = |corner: usize| {
            let place = source.mesh.positions[source.mesh.triangles.as_flattened()[corner] as usize];
            let values = source.mesh.attributes.iter().flat_map(|attribute| {
                let of = |at| {
                    (0..attribute.components)
                        .map(move |k| attribute.values.number(at * attribute.components + k))
                };
                attribute.at(corner / 3, corner % 3).map_or(vec![], |at| of(at).collect::<Vec<f64>>())
            });
            place.into_iter().chain(values).map(f64::to_bits).collect::<Vec<u64>>()
        };
        let triangle = |t: usize| {
            let mut corners = [0, 1, 2].map(|k| corner(3 * t + k)).to_vec();
            let least = (0..3).min_by_key(|&k| &corners[k]).unwrap();
            corners.rotate_left(least);
            corners
        };
        (0..source.mesh.triangles.len()).map(triangle).collect()
    };
    for (file, plain, level) in
        [("a", "quantize", 0), ("a", "quantize", base(&folder, "a.uwm")), ("exact", "none", 0)]
    {
        let decode = format!("decode {file}.uwm --level {level} -q --gltf-compression");
        folder.done(&format!("{decode} {plain} -o plain.glb"));
        folder.done(&format!("{decode} meshopt -o small.glb"));
        folder.done(&format!("{decode} meshopt -o small.gltf"));
        let json = folder.json("small.glb");
        assert!(json["extensionsRequired"].as_array().unwrap().contains(&json!("EXT_meshopt_compression")));
        assert_eq!(
            json["buffers"][1]["extensions"],
            json!({ "EXT_meshopt_compression": { "fallback": true } })
        );
        let plain = folder.flat("plain.glb");
        for small in ["small.glb", "small.gltf"] {
            assert_eq!(all(&folder.flat(small)), all(&plain), "{small} of {file} at {level}");
        }
        if level == 0 {
            let [small, plain] = ["small.glb", "plain.glb"].map(|name| folder.bytes(name).len());
            assert!(small < plain, "{small} instead of {plain} bytes");
        }
    }
    let (code, text) = folder.run("decode a.uwm -o a.ply --gltf-compression meshopt");
    assert!(code == 2 && text.contains("is for .glb and .gltf"), "{text}");
}

/// In glTF v runs down, in OBJ up.
#[test]
fn pictures_lie_right_in_other_formats() {
    let folder = Folder::with("a.glb", textured().glb());
    folder.done("encode a.glb -o a.uwm -q");
    folder.done("decode a.uwm -o a.obj -q");
    let (scene, obj) = (folder.scene("a.glb"), folder.flat("a.obj"));
    let of = |source: &Source, corner: usize| {
        let y = source.mesh.positions[source.mesh.triangles.as_flattened()[corner] as usize][1];
        (y, value(source, Semantic::TexCoord, corner)[1])
    };
    // v is twice y in the mesh, and y is turned round by the first node.
    for corner in 0..3 * scene.mesh.triangles.len() {
        let (y, v) = of(&obj, corner);
        let own = if y <= 1e-4 { -y } else { y + 7.0 };
        assert!(!(-1.0..=1.0).contains(&y) || (1.0 - v - 2.0 * own).abs() < 1e-3, "{v} at {y}");
    }
    folder.done("encode a.obj -o b.uwm -q");
    folder.done("decode b.uwm -o b.glb -q");
    let back = folder.scene("b.glb");
    let range = |source: &Source| {
        let of_corner = |corner: usize| (of(source, corner).0.abs() < 0.9).then(|| of(source, corner));
        let found: Vec<_> = (0..3 * source.mesh.triangles.len()).filter_map(of_corner).collect();
        assert!(!found.is_empty());
        found.iter().map(|(y, v)| (v - 2.0 * y.abs()).abs()).fold(0.0, f64::max)
    };
    assert!(range(&back) < 1e-3, "{}", range(&back));
}

#[test]
fn points_alone_are_a_scene() {
    let mut gltf = Gltf::new();
    let places = [0.0, 0.5, 1.0, 2.0, 4.0, 8.0];
    let positions = gltf.floats("VEC3", &places);
    gltf.shown(json!({"attributes": {"POSITION": positions}, "mode": 0, "extras": "stars"}));
    let folder = Folder::with("a.glb", gltf.glb());
    folder.done("encode a.glb -o a.uwm --strict -q");
    folder.done("verify a.uwm a.glb -q");
    folder.done("decode a.uwm -o b.glb -q");
    let json = folder.json("b.glb");
    assert_eq!(json["meshes"][0]["primitives"][0]["extras"], "stars");
    assert_eq!(json["accessors"][0]["count"], 2);
    let bytes = folder.bytes("b.glb");
    let expected: Vec<u8> = places.iter().flat_map(|x| f32::to_le_bytes(*x)).collect();
    assert!(bytes.windows(expected.len()).any(|there| there == expected));
    let (code, text) = folder.run("decode a.uwm -o b.ply");
    assert!(code == 1 && text.contains("no triangles"), "{text}");
}

#[test]
fn what_nobody_knows_is_named() {
    let mut gltf = scene();
    gltf.json["extensions"] = json!({"VENDOR_a": {"of": [0]}, "VENDOR_b": {"of": [99], "bufferView": 1}});
    let folder = Folder::with("a.glb", gltf.glb());
    let text = folder.done("encode a.glb -o a.uwm");
    assert!(text.contains("what extension VENDOR_a names") && !text.contains("VENDOR_b"), "{text}");
    let (code, text) = folder.run("encode a.glb -o a.uwm --strict");
    assert!(code == 1 && text.contains("VENDOR_a"), "{text}");
}
