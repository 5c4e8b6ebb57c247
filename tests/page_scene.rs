//! A small scene for the page's tests, made here by hand (feature `wasm`), and what a page gets of its resources.

use unweld::container::{ResourceKind, Want};
use unweld::encoder::{AttributeBirth, Encoder, Options, Place, Resource};
use unweld::mesh::attributes::{Attribute, NO_VALUE, Semantic, Values};
use unweld::mesh::{IndexedMesh, shapes};
use unweld::wasm::{Client, Settings};

/// A ball with a texture, shown twice and once as in a mirror; a worm with two joints that bends; a bud with a morph target. Positions are those of each, times 2,
/// 1/2 and 1.
struct Scene {
    mesh: IndexedMesh,
    resources: Vec<Resource>,
}

fn scene() -> Scene {
    let (ball, worm, bud) = (shapes::sphere(3), shapes::sphere(3), shapes::sphere(2));
    let mut mesh = IndexedMesh::default();
    let (mut uv, mut joints, mut weights, mut bulge) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let (mut normals, mut parts, mut corners) = (Vec::new(), Vec::new(), 0_u32);
    let mut of: [Vec<u32>; 4] = Default::default();
    for (part, (body, scale)) in [(ball, 2.0), (worm, 0.5), (bud, 1.0)].into_iter().enumerate() {
        let first = mesh.positions.len() as u32;
        mesh.bodies.push(first);
        let shape =
            |[x, y, z]: [f64; 3]| if part == 1 { [0.25 * x, 2.0 * y + 2.0, 0.25 * z] } else { [x, y, z] };
        for triangle in &body.triangles {
            mesh.triangles.push(triangle.map(|v| first + v));
            parts.push(part as u32);
            for &v in triangle {
                let normal = body.positions[v as usize];
                let [_, y, _] = shape(normal);
                normals.extend(normal.map(|x| x as f32));
                uv.extend([(0.5 + 0.5 * normal[0]) as f32, (0.5 + 0.5 * normal[1]) as f32]);
                joints.extend([0_u8, 1, 0, 0]);
                let bent = (y / 4.0).clamp(0.0, 1.0) as f32;
                weights.extend([1.0 - bent, bent, 0.0, 0.0]);
                bulge.extend(normal.map(|x| 0.5 * x as f32));
                for (of, has) in of.iter_mut().zip([true, part == 0, part == 1, part == 2]) {
                    of.push(if has { corners } else { NO_VALUE });
                }
                corners += 1;
            }
        }
        // Exact in binary32, as those of a glTF are.
        mesh.positions.extend(body.positions.iter().map(|&p| shape(p).map(|x| f64::from(x as f32) * scale)));
    }
    let [all, textured, skinned, morphed] = of;
    let generic = |name: &str, values, corners| Attribute {
        name: name.to_owned(),
        ..Attribute::new(Semantic::Generic, 3, values, corners)
    };
    mesh.attributes = vec![
        Attribute::parts(&parts),
        Attribute::new(Semantic::Normal, 3, Values::F32(normals), all),
        Attribute::new(Semantic::TexCoord, 2, Values::F32(uv), textured),
        Attribute::new(Semantic::Joints, 4, Values::U8(joints), skinned.clone()),
        Attribute::new(Semantic::Weights, 4, Values::F32(weights), skinned),
        generic("TARGET0_POSITION", Values::F32(bulge), morphed),
    ];
    Scene { mesh, resources: resources() }
}

fn resources() -> Vec<Resource> {
    let floats = |numbers: &[f32]| numbers.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<_>>();
    // Times 0 and 1; the joint turns by 90 degrees about z; the target's weight; the joints' places at rest.
    let half = std::f32::consts::FRAC_1_SQRT_2;
    let mut binary = floats(&[0.0, 1.0]);
    binary.extend(floats(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, half, half]));
    binary.extend(floats(&[0.0, 1.0]));
    let unmoved = |y: f32| [1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1., 0., 0., -y, 0., 1.];
    binary.extend(floats(&unmoved(0.0)));
    binary.extend(floats(&unmoved(2.0)));
    // Red as a preview of 2 pixels, orange of 16, green in the end: it is seen which is shown.
    let previews = [png(2, [200, 0, 0]), png(16, [200, 120, 0])];
    let original = png(150, [0, 160, 0]);
    let views: Vec<_> = [&previews[0], &previews[1], &original]
        .iter()
        .zip([1, 2, 3])
        .map(|(png, buffer)| serde_json::json!({ "buffer": buffer, "byteLength": png.len() }))
        .collect();
    let accessor = |view: usize, count: usize, kind: &str| serde_json::json!({ "bufferView": view, "componentType": 5126, "count": count, "type": kind });
    let part = |part: usize, exponent: i32, more: &[(&str, u32, &str)], targets: serde_json::Value| {
        let mut attributes = serde_json::json!({
            "POSITION": { "componentType": 5126, "type": "VEC3" }, "NORMAL": { "componentType": 5126, "type": "VEC3" } });
        for &(name, component, kind) in more {
            attributes[name] = serde_json::json!({ "componentType": component, "type": kind });
        }
        let mut told = serde_json::json!({ "part": part, "exponent": exponent, "attributes": attributes });
        if !targets.is_null() {
            told["targets"] = targets;
        }
        serde_json::json!({ "attributes": {}, "material": usize::from(part > 0), "extensions": { "UNWELD_progressive_mesh": told } })
    };
    let lengths = [&binary, &previews[0], &previews[1], &original]
        .map(|bytes| serde_json::json!({ "byteLength": bytes.len() }));
    let none = serde_json::Value::Null;
    let document = serde_json::json!({
        "asset": { "version": "2.0", "generator": "by hand" },
        "extensionsUsed": ["UNWELD_progressive_mesh", "KHR_materials_unlit"],
        "scene": 0,
        "scenes": [{ "nodes": [0, 1, 2, 3, 6], "extras": { "kept": true } }],
        "nodes": [
            { "mesh": 0, "scale": [2.0, 2.0, 2.0], "translation": [-5.0, 0.0, 0.0], "name": "ball" },
            { "mesh": 0, "scale": [-1.0, 1.0, 1.0], "translation": [-5.0, 4.0, 0.0], "name": "mirrored" },
            { "mesh": 0, "translation": [-5.0, -4.0, 0.0], "name": "small" },
            { "mesh": 1, "skin": 0, "name": "worm" },
            { "children": [5], "name": "root" },
            { "translation": [0.0, 2.0, 0.0], "name": "tip" },
            { "children": [4, 7], "name": "group" },
            { "mesh": 2, "translation": [5.0, 0.0, 0.0], "name": "bud" },
        ],
        "meshes": [
            { "primitives": [part(0, 1, &[("TEXCOORD_0", 5126, "VEC2")], none.clone())], "name": "ball" },
            { "primitives": [part(1, -1, &[("JOINTS_0", 5121, "VEC4"), ("WEIGHTS_0", 5126, "VEC4")], none)], "name": "worm" },
            { "primitives": [part(2, 0, &[], serde_json::json!([{ "POSITION": { "componentType": 5126, "type": "VEC3" } }]))],
              "weights": [0.0], "name": "bud" },
        ],
        "materials": [
            { "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } }, "extensions": { "KHR_materials_unlit": {} }, "name": "textured" },
            { "pbrMetallicRoughness": { "baseColorFactor": [0.2, 0.3, 0.9, 1.0], "metallicFactor": 0.0 }, "name": "plain" },
        ],
        "textures": [{ "source": 0, "sampler": 0 }],
        "samplers": [{ "magFilter": 9729 }],
        "images": [{ "bufferView": 7, "mimeType": "image/png", "extensions": { "UNWELD_progressive_mesh": { "previews": [
            { "size": 2, "bufferView": 5, "mimeType": "image/png" }, { "size": 16, "bufferView": 6, "mimeType": "image/png" } ] } } }],
        "skins": [{ "joints": [4, 5], "inverseBindMatrices": 3 }],
        "animations": [
            { "name": "bend", "channels": [{ "sampler": 0, "target": { "node": 5, "path": "rotation" } }],
              "samplers": [{ "input": 0, "output": 1 }] },
            { "name": "bulge", "channels": [{ "sampler": 0, "target": { "node": 7, "path": "weights" } }],
              "samplers": [{ "input": 0, "output": 2 }] },
        ],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": 2, "type": "SCALAR", "min": [0.0], "max": [1.0] },
            accessor(1, 2, "VEC4"), accessor(2, 2, "SCALAR"), accessor(4, 2, "MAT4"),
        ],
        "bufferViews": [
            { "buffer": 0, "byteOffset": 0, "byteLength": 8 }, { "buffer": 0, "byteOffset": 8, "byteLength": 32 },
            { "buffer": 0, "byteOffset": 40, "byteLength": 8 }, { "buffer": 0, "byteOffset": 0, "byteLength": 8 },
            { "buffer": 0, "byteOffset": 48, "byteLength": 128 }, views[0], views[1], views[2],
        ],
        "buffers": lengths,
    });
    let [small, large] = previews;
    let buffer = |place, bytes| Resource { kind: ResourceKind::Buffer, place, bytes };
    vec![
        Resource { kind: ResourceKind::Scene, place: Place::Base, bytes: text(&document).into_bytes() },
        buffer(Place::Base, binary),
        buffer(Place::Base, small),
        buffer(Place::Error(0.2), large),
        // Before the finest level is there: it lies between bytes that are wanted.
        buffer(Place::Error(0.05), original),
    ]
}

/// JSON with its keys in order, whichever map serde_json has for objects.
fn text(value: &serde_json::Value) -> String {
    use serde_json::Value;
    match value {
        Value::Object(members) => {
            let mut keys: Vec<_> = members.keys().collect();
            keys.sort();
            let told =
                keys.iter().map(|key| format!("{}:{}", Value::from(key.as_str()), text(&members[*key])));
            format!("{{{}}}", told.collect::<Vec<_>>().join(","))
        }
        Value::Array(items) => format!("[{}]", items.iter().map(text).collect::<Vec<_>>().join(",")),
        other => other.to_string(),
    }
}

/// A PNG of one colour, its data stored as they are (RFC 1950, 1951, 2083).
fn png(size: u32, rgb: [u8; 3]) -> Vec<u8> {
    let row = [vec![0], rgb.repeat(size as usize)].concat();
    let raw = row.repeat(size as usize);
    let mut data = vec![0x78, 0x01];
    let mut blocks = raw.chunks(65_535).peekable();
    while let Some(block) = blocks.next() {
        data.push(u8::from(blocks.peek().is_none()));
        let length = block.len() as u16;
        data.extend(length.to_le_bytes());
        data.extend((!length).to_le_bytes());
        data.extend(block);
    }
    let [mut a, mut b] = [1_u32, 0];
    for &byte in &raw {
        a = (a + u32::from(byte)) % 65_521;
        b = (b + a) % 65_521;
    }
    data.extend((b << 16 | a).to_be_bytes());
    let mut png = b"\x89PNG\r\n\x1a\n".to_vec();
    let mut chunk = |kind: &[u8; 4], body: &[u8]| {
        png.extend((body.len() as u32).to_be_bytes());
        let checked = [kind, body].concat();
        png.extend(&checked);
        let crc = checked.iter().fold(u32::MAX, |crc, &byte| {
            (0..8).fold(crc ^ u32::from(byte), |crc, _| crc >> 1 ^ if crc & 1 == 1 { 0xEDB8_8320 } else { 0 })
        });
        png.extend((!crc).to_be_bytes());
    };
    let [width, height] = [size.to_be_bytes(); 2];
    chunk(b"IHDR", &[&width[..], &height, &[8, 2, 0, 0, 0]].concat());
    chunk(b"IDAT", &data);
    chunk(b"IEND", &[]);
    png
}

fn file() -> Vec<u8> {
    let Scene { mesh, resources } = scene();
    let births = vec![("part".to_owned(), AttributeBirth::Base)];
    let options = Options { position_bits: 12, attribute_births: births, ..Options::default() };
    Encoder::new(options).resources(resources).encode_to_vec(&mesh).expect("it can be encoded")
}

/// What `web/tests/scene.uwm` is to be; UNWELD_BLESS=1 writes it anew.
#[test]
fn the_scene_for_the_page_is_what_the_encoder_writes() {
    let path = format!("{}/web/tests/scene.uwm", env!("CARGO_MANIFEST_DIR"));
    let written = file();
    if std::env::var_os("UNWELD_BLESS").is_some_and(|value| value == "1") {
        std::fs::write(&path, &written).unwrap();
    }
    assert!(std::fs::read(&path).is_ok_and(|bytes| bytes == written), "{path}: other bytes");
}

/// Hands over the bytes that are wanted, as the reports tell of holes, in pieces; what was told of resources.
fn follow(client: &mut Client, file: &[u8], piece: usize, at: &mut usize) -> Vec<(u32, Vec<u8>)> {
    let mut came = Vec::new();
    loop {
        while client.poll().expect("the file is well-formed") {}
        let reports: Vec<serde_json::Value> = serde_json::from_str(&client.report()).unwrap();
        for report in &reports {
            if report["type"] == "resource" {
                let number = report["number"].as_u64().unwrap() as u32;
                came.push((number, client.take_resource(number).expect("it is whole")));
            }
            if report["type"] == "wanted" {
                for hole in report["wanted"]["holes"].as_array().unwrap() {
                    let [from, to] = [0, 1].map(|k| hole[k].as_u64().unwrap() as usize);
                    if (from..to).contains(at) {
                        *at = to;
                    }
                }
            }
        }
        let end = client.end().map_or(file.len(), |end| end as usize);
        if *at >= end {
            return came;
        }
        let next = (*at + piece).min(end);
        client.push(*at as u64, &file[*at..next]);
        *at = next;
    }
}

#[test]
fn resources_come_as_they_are() {
    let (file, resources) = (file(), scene().resources);
    let whole = (0..).zip(resources.iter().map(|resource| resource.bytes.clone())).collect::<Vec<_>>();
    for piece in [1, 777, file.len()] {
        let mut client = Client::new(Settings { resources: true, ..Settings::default() });
        assert_eq!(follow(&mut client, &file, piece, &mut 0), whole, "pieces of {piece}");
        assert!(client.decoder().level() == Some(0) && client.finish().is_ok());
    }
}

/// Without them, and with one left out in the middle, the mesh is the same; fewer bytes are wanted.
#[test]
fn what_is_left_out_is_not_missed() {
    let (file, resources) = (file(), scene().resources);
    let soup = |client: &mut Client| {
        let changes = client.take();
        (changes.positions, changes.indices, changes.corners)
    };
    let mut complete = Client::new(Settings { resources: true, ..Settings::default() });
    follow(&mut complete, &file, file.len(), &mut 0);
    let complete = soup(&mut complete);
    // None is wanted: bytes of none need come. Those of large pieces are passed over.
    for piece in [1000, file.len()] {
        let mut client = Client::new(Settings::default());
        assert_eq!(follow(&mut client, &file, piece, &mut 0), []);
        assert_eq!(soup(&mut client), complete);
    }
    let contents = unweld::container::parse_contents(&file).unwrap().unwrap();
    let [start, end] = {
        let range = contents.bytes(contents.resources[4].atoms.clone());
        [range.start as usize, range.end as usize]
    };
    let mut damaged = file.clone();
    damaged[start..end].fill(0);
    let mut client = Client::new(Settings { resources: true, ..Settings::default() });
    let mut at = 20;
    while client.decoder().contents().is_none() {
        client.push(0, &damaged[at - 20..at]);
        client.poll().unwrap();
        at += 20;
    }
    let mut at = at - 20;
    client.skip(&[4]);
    let came = follow(&mut client, &damaged, 500, &mut at);
    let numbers: Vec<_> = came.iter().map(|(number, _)| *number).collect();
    assert_eq!((numbers, soup(&mut client)), (vec![0, 1, 2, 3], complete));
    // Later it may come after all; but not with other bytes.
    assert!(client.add_resource(4, &damaged[start..end]).is_err());
    client.add_resource(4, &file[start..end]).unwrap();
    assert_eq!(client.take_resource(4).as_ref(), Some(&resources[4].bytes));
    client.want(Want::All);
    assert!(!client.poll().unwrap());
}

/// Where the file has normals at every corner, those that triangles make can be done without; all else is the same.
#[test]
fn normals_of_the_file_are_enough() {
    let mut mesh = shapes::bumpy_sphere(3, 1);
    let normals = mesh.positions.iter().flat_map(|p| p.map(|x| x as f32)).collect();
    let corners = mesh.triangles.iter().flatten().copied().collect();
    mesh.attributes.push(Attribute::new(Semantic::Normal, 3, Values::F32(normals), corners));
    let attribute_births = vec![("normal".to_owned(), AttributeBirth::Base)];
    let options = Options { attribute_births, ..Options::default() };
    let file = Encoder::new(options).encode_to_vec(&mesh).unwrap();
    let half = file.len() / 2;
    let told = |own_normals| {
        let mut client = Client::new(Settings { own_normals, ..Settings::default() });
        [(0, half), (half, file.len())].map(|(from, to)| {
            client.push(from as u64, &file[from..to]);
            while client.poll().unwrap() {}
            client.take()
        })
    };
    for (mut own, mut plain) in told(true).into_iter().zip(told(false)) {
        assert!(
            own.normals.iter().all(|&x| x == 0.0) && own.turned.is_empty() && own.turned_normals.is_empty()
        );
        assert!(plain.normals.iter().any(|&x| x != 0.0) && !own.corners.values.is_empty());
        assert_eq!(plain.turned.is_empty(), plain.first_vertex == 0);
        for changes in [&mut own, &mut plain] {
            (changes.normals, changes.turned, changes.turned_normals) = Default::default();
        }
        assert_eq!(own, plain);
    }
}
