//! Scenes that stay scenes: meshes once and in their own coordinates, equal primitives once, and beside them all else.

use crate::builder::*;
use serde_json::{Value, json};
use unweld::Error;
use unweld::formats::{Coordinates, ReadOptions, Role, Scene, Source, read_with};
use unweld::mesh::attributes::{Attribute, Domain, Semantic, Values};

const EXTENSION: &str = "UNWELD_progressive_mesh";

pub fn options() -> ReadOptions {
    let mut options = ReadOptions::default();
    options.scenes = true;
    options
}

fn scene_of(gltf: &Gltf) -> (Source, Scene, Value) {
    let mut source = read_with(&gltf.glb(), &options()).unwrap();
    let scene = source.scene.take().unwrap();
    let json = serde_json::from_slice(&scene.json).unwrap();
    (source, scene, json)
}

fn refused(gltf: &Gltf) -> String {
    match read_with(&gltf.glb_as_it_is(), &options()) {
        Err(Error::Input(error)) => error.to_string(),
        other => panic!("{other:?}"),
    }
}

fn attribute<'a>(source: &'a Source, title: &str) -> &'a Attribute {
    source.mesh.attributes.iter().find(|attribute| attribute.title() == title).unwrap()
}

/// The part of each triangle.
fn parts(source: &Source) -> Vec<usize> {
    let parts = attribute(source, "part");
    assert_eq!((parts.semantic, parts.domain), (Semantic::Part, Domain::Triangle));
    (0..source.mesh.triangles.len()).map(|t| parts.values.number(parts.at(t, 0).unwrap()) as usize).collect()
}

/// The bytes of a view of the scene JSON.
pub fn view<'a>(scene: &'a Scene, json: &Value, view: &Value) -> &'a [u8] {
    let view = &json["bufferViews"][view.as_u64().unwrap() as usize];
    let number = |key: &str| view[key].as_u64().unwrap_or(0) as usize;
    let buffer = number("buffer");
    assert_eq!(json["buffers"][buffer]["byteLength"], scene.buffers[buffer].bytes.len());
    &scene.buffers[buffer].bytes[number("byteOffset")..][..number("byteLength")]
}

/// A triangle whose corner is at x.
fn corner(gltf: &mut Gltf, x: f32) -> Value {
    let positions = gltf.floats("VEC3", &[x, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 2.0, 0.0]);
    let indices = gltf.indices(&[0, 1, 2]);
    json!({"attributes": {"POSITION": positions}, "indices": indices})
}

#[test]
fn each_mesh_is_there_once_in_its_own_place() {
    let mut gltf = Gltf::new();
    let (first, second) = (corner(&mut gltf, -1.0), corner(&mut gltf, -3.0));
    gltf.push("meshes", json!({"name": "one", "primitives": [first.clone(), second]}));
    // The same numbers elsewhere, by other indices: the corner comes last in its accessors, and the first in its triangle.
    let positions = gltf.floats("VEC3", &[9.0, 9.0, 9.0, 1.0, 0.0, 0.0, 0.0, 2.0, 0.0, -1.0, 0.0, 0.0]);
    let indices = gltf.indices(&[3, 1, 2]);
    let equal = json!({"attributes": {"POSITION": positions}, "indices": indices, "material": 0});
    gltf.push("materials", json!({"name": "red"}));
    let other = corner(&mut gltf, -7.0);
    gltf.push("meshes", json!({"name": "two", "primitives": [equal, other]}));
    let third = corner(&mut gltf, -5.0);
    gltf.push("meshes", json!({"name": "unshown", "primitives": [third]}));
    for (mesh, scale) in [(0, [0.3, -0.1, 0.1]), (0, [0.2; 3]), (1, [3.0, 1.0, -1.0])] {
        gltf.push("nodes", json!({"mesh": mesh, "scale": scale, "translation": [5, 6, 7]}));
    }
    let (source, _, json) = scene_of(&gltf);
    // Of two meshes that share a part, the larger one says how it is scaled; what nobody shows stays as it is.
    let first_of = |part: usize| {
        let t = parts(&source).iter().position(|&other| other == part).unwrap();
        source.mesh.positions[source.mesh.triangles[t][0] as usize][0]
    };
    assert_eq!(parts(&source), [0, 1, 2, 3]);
    assert_eq!([0, 1, 2, 3].map(first_of), [-4.0, -12.0, -28.0, -5.0]);
    assert_eq!((&source.mesh.bodies[..], source.mesh.positions.len()), (&[0, 6, 9][..], 12));
    assert_eq!(source.mesh.part_names[2], "o two\ng primitive 1");
    assert_eq!(source.coordinates, Coordinates::Float32);
    let told = |mesh: usize, primitive: usize| {
        let extension = &json["meshes"][mesh]["primitives"][primitive]["extensions"][EXTENSION];
        (extension["part"].as_u64().unwrap(), extension["exponent"].as_i64().unwrap())
    };
    assert_eq!(
        [told(0, 0), told(0, 1), told(1, 0), told(1, 1), told(2, 0)],
        [(0, 2), (1, 2), (0, 2), (2, 2), (3, 0)]
    );
    assert_eq!(
        json["meshes"][1]["primitives"][0],
        json!({
            "attributes": {}, "material": 0,
            "extensions": {EXTENSION: {"part": 0, "exponent": 2, "attributes": {"POSITION": {"componentType": FLOAT, "type": "VEC3"}}}},
        })
    );
    assert_eq!(json["nodes"], gltf.json["nodes"]);
    for gone in ["accessors", "bufferViews", "buffers", "extensionsRequired"] {
        assert!(json.get(gone).is_none(), "{gone}");
    }
    assert_eq!(json["extensionsUsed"], json!([EXTENSION]));
    assert_eq!(source.dropped, ["vertices of no triangle (1)"]);
}

#[test]
fn numbers_outside_of_binary32_keep_their_scale() {
    let mut gltf = Gltf::new();
    let positions = gltf.floats("VEC3", &[f32::from_bits(3), 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 2.0, 0.0]);
    let mesh = gltf.mesh(json!({"attributes": {"POSITION": positions}}));
    gltf.push("nodes", json!({"mesh": mesh, "scale": [0.125, 0.125, 0.125]}));
    let (source, _, json) = scene_of(&gltf);
    assert_eq!(source.mesh.positions[0][0], f64::from(f32::from_bits(3)));
    assert_eq!(json["meshes"][0]["primitives"][0]["extensions"][EXTENSION]["exponent"], 0);
}

#[test]
fn all_else_stays_as_it_is() {
    let mut gltf = triangle();
    let [times, values] =
        [gltf.floats("SCALAR", &[0.0, 1.0]), gltf.floats("VEC3", &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0])];
    let matrices = {
        let mut matrix = [0.0f32; 16];
        [0, 5, 10, 15].iter().for_each(|&k| matrix[k] = 1.0);
        let bytes: Vec<u8> = matrix.iter().flat_map(|x| x.to_le_bytes()).collect();
        gltf.accessor("MAT4", FLOAT, 1, &bytes)
    };
    let points = gltf.floats("VEC3", &[0.25; 6]);
    let spare = gltf.floats("SCALAR", &[42.0]);
    gltf.push(
        "animations",
        json!({
            "samplers": [{"output": values, "input": times}],
            "channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}],
        }),
    );
    gltf.push(
        "skins",
        json!({"joints": [0], "inverseBindMatrices": matrices, "extras": {"zebra": 1, "ant": 2}}),
    );
    gltf.push("meshes", json!({"primitives": [{"mode": 0, "attributes": {"POSITION": points}}]}));
    gltf.json["meshes"][0]["primitives"][0]["extras"] = json!("kept");
    gltf.json["meshes"][0]["primitives"][0]["mode"] = json!(4);
    gltf.json["extensionsUsed"] = json!(["KHR_lights_punctual", "VENDOR_x"]);
    gltf.json["extensions"] = json!({"VENDOR_x": {"bufferView": spare, "accessor": spare, "what": 0.1}});
    gltf.json["accessors"][spare]["name"] = json!("spare");
    let (_, scene, json) = scene_of(&gltf);
    let numbers = |accessor: &Value| -> Vec<f32> {
        let accessor = &json["accessors"][accessor.as_u64().unwrap() as usize];
        let bytes = view(&scene, &json, &accessor["bufferView"]);
        bytes.as_chunks().0.iter().map(|&b| f32::from_le_bytes(b)).collect()
    };
    let sampler = &json["animations"][0]["samplers"][0];
    assert_eq!(numbers(&sampler["input"]), [0.0, 1.0]);
    assert_eq!(numbers(&sampler["output"]), [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
    assert_eq!(numbers(&json["skins"][0]["inverseBindMatrices"])[15], 1.0);
    assert_eq!(numbers(&json["meshes"][1]["primitives"][0]["attributes"]["POSITION"]), [0.25; 6]);
    let vendor = &json["extensions"]["VENDOR_x"];
    assert_eq!((numbers(&vendor["accessor"]), &vendor["what"]), (vec![42.0], &json!(0.1)));
    assert_eq!(view(&scene, &json, &vendor["bufferView"]), 42f32.to_le_bytes());
    // The triangle's have gone.
    assert_eq!(json["accessors"].as_array().unwrap().len(), 5);
    assert_eq!(json["bufferViews"].as_array().unwrap().len(), 5);
    assert_eq!(json["meshes"][0]["primitives"][0]["extras"], "kept");
    assert_eq!(json["extensionsUsed"], json!(["KHR_lights_punctual", "VENDOR_x", EXTENSION]));
    assert_eq!(scene.buffers.len(), 1);
    assert_eq!((scene.buffers[0].role, scene.buffers[0].useful_from), (Role::Binary, f64::INFINITY));
    // Keys are in their order.
    let text = String::from_utf8(scene.json.clone()).unwrap();
    let at = |word: &str| text.find(word).unwrap_or_else(|| panic!("{word}: {text}"));
    assert!(at("zebra") < at("ant") && at("\"output\"") < at("\"input\""));
}

/// Many samples stand in a buffer of their own, which levels as coarse as a picture of 64 pixels do not wait for; what something else has, too, does not.
#[test]
fn many_samples_come_later() {
    let mut gltf = triangle();
    let many: Vec<f32> = (0..6000u16).map(f32::from).collect();
    let [times, values] = [gltf.floats("SCALAR", &many[..2000]), gltf.floats("VEC3", &many)];
    let shared = gltf.floats("SCALAR", &many[..2000]);
    let sampler = |input| json!({"input": input, "output": values});
    let channel = |k| json!({"sampler": k, "target": {"node": 0, "path": "translation"}});
    let animation =
        json!({"samplers": [sampler(times), sampler(shared)], "channels": [channel(0), channel(1)]});
    gltf.push("animations", animation);
    gltf.json["extensions"] = json!({"VENDOR_x": {"accessor": shared}});
    let (_, scene, json) = scene_of(&gltf);
    let of = |name: &str, sampler: usize| {
        let accessor = &json["animations"][0]["samplers"][sampler][name];
        let accessor = &json["accessors"][accessor.as_u64().unwrap() as usize];
        let bytes = view(&scene, &json, &accessor["bufferView"]);
        let numbers: Vec<f32> = bytes.as_chunks().0.iter().map(|&b| f32::from_le_bytes(b)).collect();
        let number = accessor["bufferView"].as_u64().unwrap() as usize;
        (json["bufferViews"][number]["buffer"].clone(), numbers)
    };
    assert_eq!(of("input", 0), (json!(1), many[..2000].to_vec()));
    assert_eq!(of("output", 0), (json!(1), many.clone()));
    assert_eq!(of("input", 1), (json!(0), many[..2000].to_vec()));
    let places: Vec<_> = scene.buffers.iter().map(|buffer| (buffer.role, buffer.useful_from)).collect();
    // The triangle's longer side.
    assert_eq!(places, [(Role::Binary, f64::INFINITY), (Role::Binary, 2.0 / 64.0)]);
    // Without what is shared there is one buffer, and it is that.
    gltf.json["extensions"] = json!({});
    let (_, scene, json) = scene_of(&gltf);
    assert_eq!((scene.buffers.len(), &json["bufferViews"][0]["buffer"]), (1, &json!(0)));
    assert_eq!(scene.buffers[0].useful_from, 2.0 / 64.0);
}

/// Numbers come back through the type that the mesh has them in.
#[test]
fn types_that_differ_are_told() {
    let mut gltf = Gltf::new();
    let mut mesh = Vec::new();
    let positions = gltf.floats("VEC3", &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 2.0, 0.0]);
    let bytes = gltf.accessor("VEC4", UNSIGNED_BYTE, 3, &[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 255]);
    let bytes = gltf.normalised(bytes);
    mesh.push(json!({"attributes": {"POSITION": positions, "COLOR_0": bytes}}));
    let shorts: Vec<u8> = [0u16, 1, 65535, 3, 4, 5, 6, 7, 257].iter().flat_map(|x| x.to_le_bytes()).collect();
    let shorts = gltf.accessor("VEC3", UNSIGNED_SHORT, 3, &shorts);
    let shorts = gltf.normalised(shorts);
    mesh.push(json!({"attributes": {"POSITION": positions, "COLOR_0": shorts}}));
    let heat = gltf.floats("SCALAR", &[-0.0, f32::NAN, 1e30]);
    mesh.push(json!({"attributes": {"POSITION": positions, "_HEAT": heat}}));
    gltf.push("meshes", json!({"primitives": mesh}));
    gltf.push("nodes", json!({"mesh": 0}));
    let (source, _, json) = scene_of(&gltf);
    let types = |primitive: usize| {
        json["meshes"][0]["primitives"][primitive]["extensions"][EXTENSION]["attributes"].clone()
    };
    assert_eq!(
        types(0)["COLOR_0"],
        json!({"componentType": UNSIGNED_BYTE, "normalized": true, "type": "VEC4"})
    );
    assert_eq!(
        types(1)["COLOR_0"],
        json!({"componentType": UNSIGNED_SHORT, "normalized": true, "type": "VEC3"})
    );
    assert_eq!(types(2)["_HEAT"], json!({"componentType": FLOAT, "type": "SCALAR"}));
    let color = attribute(&source, "color");
    let of =
        |t: usize, place: usize, k: usize| color.values.number(4 * color.at(t, place).unwrap() + k) as u64;
    assert!(matches!(color.values, Values::U16(_)));
    assert_eq!([of(0, 0, 1) / 257, of(0, 2, 3) / 257, of(1, 0, 2), of(1, 2, 2)], [1, 255, 65535, 257]);
    assert_eq!(color.at(2, 0), None);
    let heat = attribute(&source, "_HEAT");
    assert_eq!((heat.semantic, heat.at(0, 0)), (Semantic::Generic, None));
    let bits = [0, 1, 2].map(|place| heat.values.bits(heat.at(2, place).unwrap()));
    assert_eq!(bits, [-0.0f32, f32::NAN, 1e30].map(|x| u64::from(x.to_bits())));
    assert!(source.dropped.is_empty(), "{:?}", source.dropped);
}

#[test]
fn skins_and_morphs_are_attributes() {
    let mut gltf = Gltf::new();
    let positions = gltf.floats("VEC3", &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 2.0, 0.0]);
    let joints = gltf.accessor("VEC4", UNSIGNED_BYTE, 3, &[0, 1, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0]);
    let weights = gltf.floats("VEC4", &[0.5, 0.5, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]);
    // The second target moves a vertex alone, sparsely.
    let moved = gltf.floats("VEC3", &[0.0, 0.0, 1.0, 0.0, 0.0, 2.0, 0.0, 0.0, 3.0]);
    let (places, value) = (gltf.view(&[1]), gltf.view(&[0.0f32, 7.0, 0.0].map(f32::to_le_bytes).concat()));
    let sparse = gltf.push("accessors", json!({
        "componentType": FLOAT, "count": 3, "type": "VEC3",
        "sparse": {"count": 1, "indices": {"bufferView": places, "componentType": UNSIGNED_BYTE}, "values": {"bufferView": value}},
    }));
    let primitive = json!({
        "attributes": {"POSITION": positions, "JOINTS_0": joints, "WEIGHTS_0": weights},
        "targets": [{"POSITION": moved}, {"NORMAL": moved, "POSITION": sparse}],
    });
    gltf.push("meshes", json!({"primitives": [primitive], "weights": [0, 0.5]}));
    gltf.push("nodes", json!({"mesh": 0, "skin": 0, "scale": [2, 2, 2]}));
    gltf.push("skins", json!({"joints": [0]}));
    let (source, _, json) = scene_of(&gltf);
    let titles: Vec<String> = source.mesh.attributes.iter().map(Attribute::title).collect();
    assert_eq!(
        titles,
        ["part", "joints", "weights", "TARGET0_POSITION", "TARGET1_NORMAL", "TARGET1_POSITION"]
    );
    // Displacements are those of the input, whatever the coordinates are scaled by.
    assert_eq!(source.mesh.positions[2], [0.0, 4.0, 0.0]);
    let target = attribute(&source, "TARGET1_POSITION");
    assert_eq!(
        [0, 1, 2].map(|place| target.values.number(3 * target.at(0, place).unwrap() + 1)),
        [0.0, 7.0, 0.0]
    );
    let told = &json["meshes"][0]["primitives"][0];
    assert!(told.get("targets").is_none());
    let vectors = json!({"componentType": FLOAT, "type": "VEC3"});
    assert_eq!(
        told["extensions"][EXTENSION]["targets"],
        json!([{"POSITION": vectors}, {"NORMAL": vectors, "POSITION": vectors}])
    );
    assert_eq!(json["meshes"][0]["weights"], json!([0, 0.5]));
    // What else would differ is another part.
    let mut other = gltf.json["meshes"][0].clone();
    other["primitives"][0]["targets"][0]["POSITION"] = sparse.into();
    gltf.push("meshes", other);
    let (source, ..) = scene_of(&gltf);
    assert_eq!(parts(&source), [0, 1]);
}

#[test]
fn more_attributes_than_a_file_has_are_told() {
    let mut gltf = Gltf::new();
    let positions = gltf.floats("VEC3", &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 2.0, 0.0]);
    let target = gltf.floats("VEC3", &[0.5; 9]);
    let targets: Vec<Value> = (0..70).map(|_| json!({"POSITION": target})).collect();
    gltf.shown(json!({"attributes": {"POSITION": positions, "NORMAL": target}, "targets": targets}));
    let (source, ..) = scene_of(&gltf);
    assert_eq!(source.mesh.attributes.len(), 64);
    // One is the part, one the normal.
    assert_eq!(source.dropped.len(), 70 - 62);
    assert!(
        source.dropped.iter().all(|dropped| dropped.starts_with("attribute TARGET")),
        "{:?}",
        source.dropped
    );
}

#[test]
fn strips_become_lists_and_the_rest_stays() {
    let mut gltf = Gltf::new();
    let positions = gltf.floats("VEC3", &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0]);
    let indices = gltf.indices(&[0, 1, 2, 3]);
    let list = gltf.indices(&[0, 1, 2, 1, 3, 2]);
    let of = |mode: u32, indices: usize| json!({"attributes": {"POSITION": positions}, "indices": indices, "mode": mode});
    gltf.push("meshes", json!({"primitives": [of(5, indices), of(3, indices), of(4, list)]}));
    gltf.push("nodes", json!({"mesh": 0}));
    let (source, scene, json) = scene_of(&gltf);
    // A strip of two triangles is the same as a list of them.
    assert_eq!(parts(&source), [0, 0]);
    let primitives = &json["meshes"][0]["primitives"];
    assert!(primitives[0].get("mode").is_none() && primitives[1]["mode"] == 3);
    assert_eq!(json["accessors"].as_array().unwrap().len(), 2);
    let line = &primitives[1];
    let accessor = &json["accessors"][line["indices"].as_u64().unwrap() as usize];
    assert_eq!(view(&scene, &json, &accessor["bufferView"]), [0, 0, 1, 0, 2, 0, 3, 0]);
}

#[test]
fn faults_of_what_is_carried_have_pointers() {
    for (pointer, value, expected) in [
        (
            "/animations/0/samplers/0/input",
            json!(9),
            "/animations/0/samplers/0/input: names item 9 of /accessors, which has 3",
        ),
        (
            "/animations/0/samplers/0/input",
            json!(-1),
            "/animations/0/samplers/0/input: not a whole number, 0 or more",
        ),
        (
            "/accessors/2/count",
            json!(50),
            "/accessors/2: 50 elements of 4 bytes, 4 apart, from byte 0 of a view of 8",
        ),
        (
            "/accessors/2/bufferView",
            json!(7),
            "/accessors/2/bufferView: names item 7 of /bufferViews, which has 3",
        ),
        ("/bufferViews/2/buffer", json!(1), "/bufferViews/2/buffer: names item 1 of /buffers, which has 1"),
        ("/images/0", json!({}), "/images/0: an image without `bufferView` and `uri`"),
        ("/images/0/bufferView", json!(3), "/images/0/bufferView: names item 3 of /bufferViews, which has 3"),
        (
            "/images/0",
            json!({"uri": "data:;base64,?"}),
            "/images/0: uri: letter 0 of the base64 data is none of base64",
        ),
        (
            "/materials/0/x/aTexture/index",
            json!(4),
            "/materials/0/x/aTexture/index: names item 4 of /textures, which has 1",
        ),
        ("/textures/0/source", json!(2), "/textures/0/source: names item 2 of /images, which has 1"),
        (
            "/meshes/0/primitives/0/material",
            json!(6),
            "/meshes/0/primitives/0/material: names item 6 of /materials, which has 1",
        ),
        (
            "/meshes/0/primitives/0/targets",
            json!([{"POSITION": 5}]),
            "/meshes/0/primitives/0/targets/0/POSITION: names item 5 of /accessors, which has 3",
        ),
        (
            "/meshes/0/primitives/0/targets",
            json!([{"POSITION": 2}]),
            "/meshes/0/primitives/0/attributes: POSITION of 2 vertices, POSITION of 3",
        ),
        (
            "/nodes/0/children",
            json!([0]),
            "/nodes/0/children/0: node 0 is reached twice: it has two parents, or is its own ancestor",
        ),
        ("/meshes/0/primitives/0/extensions", json!(3), "/meshes/0/primitives/0: `extensions` is no object"),
    ] {
        let mut gltf = triangle();
        let times = gltf.floats("SCALAR", &[0.0, 1.0]);
        gltf.push("animations", json!({"samplers": [{"input": times, "output": times}]}));
        gltf.push("scenes", json!({"nodes": [0]}));
        gltf.push("images", json!({"bufferView": 0}));
        gltf.push("textures", json!({"source": 0}));
        gltf.push("materials", json!({"x": {"aTexture": {"index": 0}}}));
        gltf.json["meshes"][0]["primitives"][0]["material"] = json!(0);
        gltf.json["buffers"][0]["byteLength"] = json!(gltf.binary.len());
        assert!(read_with(&gltf.glb_as_it_is(), &options()).is_ok());
        let (above, key) = pointer.rsplit_once('/').unwrap();
        match gltf.json.pointer_mut(above).unwrap() {
            Value::Array(list) => list[key.parse::<usize>().unwrap()] = value,
            object => object[key] = value,
        }
        assert_eq!(refused(&gltf), expected);
    }
}

/// What takes more than is allowed is refused, whatever part of it asks for it.
#[test]
fn memory_is_limited() {
    let mut gltf = triangle();
    let bytes = vec![0; 1 << 16];
    gltf.view(&bytes);
    for memory in [1 << 10, 1 << 14, 1 << 16] {
        let mut options = options();
        options.max_memory = memory;
        let outcome = read_with(&gltf.glb(), &options);
        assert!(matches!(outcome, Err(Error::Limit { .. })), "{memory}: {outcome:?}");
    }
    assert!(read_with(&gltf.glb(), &options()).is_ok());
}
