//! Real scenes that stay scenes: what accessors say at each corner is what the parts of the mesh say. They are not part of the
//! repository: they are looked for in the folder `gltf` of `$UNWELD_DATA` or `../shared/data`, and without them the test says so and passes.

use crate::scenes::options;
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use unweld::formats::{Format, Source, read_with};
use unweld::mesh::attributes::{Attribute, Semantic};

const EXTENSION: &str = "UNWELD_progressive_mesh";

pub fn folder() -> Option<PathBuf> {
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data");
    let folder = std::env::var_os("UNWELD_DATA").map_or_else(beside, PathBuf::from).join("gltf");
    if !folder.is_dir() {
        eprintln!("skipped: no folder {}", folder.display());
        return None;
    }
    Some(folder)
}

/// A binary file, taken apart by whoever trusts it.
struct File {
    json: Value,
    binary: Vec<u8>,
}

impl File {
    fn new(bytes: &[u8]) -> Self {
        let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
        let end = 20 + word(12);
        let binary = bytes.get(end + 8..).map_or(Vec::new(), <[u8]>::to_vec);
        Self { json: serde_json::from_slice(&bytes[20..end]).unwrap(), binary }
    }

    /// The numbers of an element of an accessor that is plain.
    fn element(&self, accessor: &Value, k: usize) -> Vec<f64> {
        let accessor = &self.json["accessors"][accessor.as_u64().unwrap() as usize];
        let view = &self.json["bufferViews"][accessor["bufferView"].as_u64().unwrap() as usize];
        let number = |value: &Value| value.as_u64().unwrap_or(0) as usize;
        let n = match accessor["type"].as_str().unwrap() {
            "SCALAR" => 1,
            kind => kind[3..].parse().unwrap(),
        };
        let size = [1, 1, 2, 2, 0, 4, 4][number(&accessor["componentType"]) - 5120];
        let stride = if view["byteStride"].is_null() { n * size } else { number(&view["byteStride"]) };
        let begin = number(&view["byteOffset"]) + number(&accessor["byteOffset"]) + k * stride;
        let bytes = |at: usize| &self.binary[begin + at * size..][..size];
        let read = |at: usize| match number(&accessor["componentType"]) {
            5120 => f64::from(bytes(at)[0] as i8),
            5121 => f64::from(bytes(at)[0]),
            5122 => i16::from_le_bytes(bytes(at).try_into().unwrap()).into(),
            5123 => u16::from_le_bytes(bytes(at).try_into().unwrap()).into(),
            5125 => u32::from_le_bytes(bytes(at).try_into().unwrap()).into(),
            _ => f32::from_le_bytes(bytes(at).try_into().unwrap()).into(),
        };
        (0..n).map(read).collect()
    }
}

/// What stands for 1 in a type.
fn one(told: &Value) -> f64 {
    let integers = [127.0, 255.0, 32767.0, 65535.0, 1.0, 4294967295.0, 1.0];
    if told["normalized"] == true {
        integers[told["componentType"].as_u64().unwrap() as usize - 5120]
    } else {
        1.0
    }
}

/// The attribute that a name of glTF stands for.
fn named<'a>(source: &'a Source, name: &str) -> &'a Attribute {
    let (word, set) = name.rsplit_once('_').unwrap_or((name, "0"));
    let semantic = match word {
        "NORMAL" => Semantic::Normal,
        "TANGENT" => Semantic::Tangent,
        "TEXCOORD" => Semantic::TexCoord,
        "COLOR" => Semantic::Color,
        "JOINTS" => Semantic::Joints,
        "WEIGHTS" => Semantic::Weights,
        _ => Semantic::Generic,
    };
    let is_it = |a: &&Attribute| {
        a.semantic == semantic && (a.name == name || a.name.is_empty() && a.set.to_string() == set)
    };
    source.mesh.attributes.iter().find(is_it).unwrap_or_else(|| panic!("{name}"))
}

#[test]
fn accessors_say_what_they_said_at_each_corner() {
    let Some(folder) = folder() else { return };
    let (mut files, mut corners) = (0, 0);
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if Format::from_path(&path) != Some(Format::Gltf) || path.extension().is_some_and(|e| e == "gltf") {
            continue;
        }
        let bytes = fs::read(&path).unwrap();
        let file = File::new(&bytes);
        let text = file.json.to_string();
        if ["_compression", "sparse"].iter().any(|word| text.contains(word)) {
            continue;
        }
        files += 1;
        let source = read_with(&bytes, &options()).unwrap();
        let json: Value = serde_json::from_slice(&source.scene.as_ref().unwrap().json).unwrap();
        let parts = source.mesh.attributes.iter().find(|a| a.semantic == Semantic::Part).unwrap();
        let mut of_part = vec![Vec::new(); source.mesh.part_names.len()];
        for t in 0..source.mesh.triangles.len() {
            of_part[parts.values.number(parts.at(t, 0).unwrap()) as usize].push(t);
        }
        for (m, mesh) in file.json["meshes"].as_array().unwrap().iter().enumerate() {
            for (p, primitive) in mesh["primitives"].as_array().unwrap().iter().enumerate() {
                if primitive["mode"].as_u64().unwrap_or(4) != 4 {
                    continue;
                }
                let told = &json["meshes"][m]["primitives"][p]["extensions"][EXTENSION];
                let scale = f64::from(told["exponent"].as_i64().unwrap() as i32).exp2();
                for (k, &t) in of_part[told["part"].as_u64().unwrap() as usize].iter().enumerate() {
                    for place in 0..3 {
                        let v = match &primitive["indices"] {
                            Value::Null => 3 * k + place,
                            indices => file.element(indices, 3 * k + place)[0] as usize,
                        };
                        let position = source.mesh.positions[source.mesh.triangles[t][place] as usize];
                        let said = file.element(&primitive["attributes"]["POSITION"], v);
                        let said: Vec<f64> =
                            said.iter().map(|x| x / one(&told["attributes"]["POSITION"]) * scale).collect();
                        assert_eq!(position[..], said[..], "{path:?} {m} {p} {t}");
                        let own = primitive["attributes"].as_object().unwrap().iter();
                        let own =
                            own.map(|(name, accessor)| (name.clone(), accessor, &told["attributes"][name]));
                        let targets = primitive["targets"].as_array().into_iter().flatten().enumerate();
                        let targets =
                            targets.flat_map(|(t, target)| {
                                let name = move |name: &String| format!("TARGET{t}_{name}");
                                target.as_object().unwrap().iter().map(move |(key, accessor)| {
                                    (name(key), accessor, &told["targets"][t][key])
                                })
                            });
                        for (name, accessor, told) in
                            own.chain(targets).filter(|(name, ..)| name != "POSITION")
                        {
                            let attribute = named(&source, &name);
                            let value = attribute.at(t, place).unwrap();
                            let stored = attribute.values.stored();
                            let most = match (attribute.normalised, stored.name()) {
                                (false, _) => 1.0,
                                (true, "u8") => 255.0,
                                (true, "u16") => 65535.0,
                                (true, "i8") => 127.0,
                                (true, _) => 32767.0,
                            };
                            for (c, x) in file.element(accessor, v).into_iter().enumerate() {
                                let y = attribute.values.number(attribute.components * value + c) / most
                                    * one(told);
                                let y = if told["componentType"] == 5126 { y } else { y.round() };
                                assert!(x == y || x.is_nan() && y.is_nan(), "{path:?} {name}: {x}, {y}");
                            }
                        }
                        corners += 1;
                    }
                }
            }
        }
    }
    assert!(files >= 20 && corners > 1_000_000, "{files} {corners}");
}
