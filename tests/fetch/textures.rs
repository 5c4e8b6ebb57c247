//! Scenes with smaller pictures in the place of their images: what is asked for, what comes of it, how it goes on.

use super::command::Folder;
use super::script::{Asked, Script};
use serde_json::{Value, json};
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use unweld::container::{ResourceKind, parse_contents};
use unweld::encoder::{Encoder, Place, Resource};
use unweld::mesh::attributes::Attribute;
use unweld::mesh::shapes;

/// Bytes of the pictures: of image 0 with 64 and 256 pixels and itself, of image 1 with 64 pixels and itself, which is no longer than what is read
/// over.
const SIZES: [usize; 5] = [1000, 900, 20_000, 100_000, 30_000];
const SMALL: usize = 0;
const SMALL_OTHER: usize = 1;
const MIDDLE: usize = 2;
const LARGE: usize = 3;
const OTHER: usize = 4;

fn picture(number: usize) -> Vec<u8> {
    let mut state = number as u32;
    let mut noise = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 24) as u8
    };
    (0..SIZES[number]).map(|_| noise()).collect()
}

/// A ball in a scene of two images; where the first of them stands in the file, and behind which level its larger preview.
fn scene() -> (Vec<u8>, Range<usize>, u32) {
    let preview =
        |size: u32, view: usize| json!({ "size": size, "bufferView": view, "mimeType": "image/jpeg" });
    let image = |view: usize, previews: Vec<Value>| json!({ "bufferView": view, "mimeType": "image/png", "extensions": { "UNWELD_progressive_mesh": { "previews": previews } } });
    let part = json!({ "part": 0, "attributes": { "POSITION": { "componentType": 5126, "type": "VEC3" } } });
    let scene = json!({
        "asset": { "version": "2.0" },
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": [{ "attributes": {}, "extensions": { "UNWELD_progressive_mesh": part } }] }],
        "images": [image(LARGE, vec![preview(64, SMALL), preview(256, MIDDLE)]), image(OTHER, vec![preview(64, SMALL_OTHER)])],
        "bufferViews": SIZES.iter().enumerate().map(|(k, size)| json!({ "buffer": k, "byteLength": size })).collect::<Vec<_>>(),
        "buffers": SIZES.map(|size| json!({ "byteLength": size })),
        "extensionsUsed": ["UNWELD_progressive_mesh"],
    });
    let resource = |kind, place, bytes| Resource { kind, place, bytes };
    let mut resources = vec![resource(ResourceKind::Scene, Place::Base, scene.to_string().into_bytes())];
    let places = [Place::Base, Place::Base, Place::Error(0.1), Place::Error(0.05), Place::Error(0.05)];
    resources.extend(
        places.into_iter().enumerate().map(|(k, place)| resource(ResourceKind::Buffer, place, picture(k))),
    );
    let mut mesh = shapes::bumpy_sphere(4, 1);
    mesh.attributes = vec![Attribute::parts(&vec![0; mesh.triangles.len()])];
    let file = Encoder::default().resources(resources).encode_to_vec(&mesh).unwrap();
    let contents = parse_contents(&file).unwrap().unwrap();
    let bytes = contents.bytes(contents.resources[1 + LARGE].atoms.clone());
    (file, bytes.start as usize..bytes.end as usize, contents.resources[1 + MIDDLE].place)
}

fn has(bytes: &[u8], number: usize) -> bool {
    let picture = picture(number);
    bytes.windows(picture.len()).any(|window| window == picture)
}

/// Whether none of the requests is for a byte of these.
fn passed_over(asked: &[Asked], bytes: &Range<usize>) -> bool {
    asked.iter().all(|asked| asked.range().1 < bytes.start || asked.range().0 >= bytes.end)
}

#[test]
fn images_that_are_not_wanted_do_not_come() {
    let (file, large, level) = scene();
    let served = file.clone();
    let script = Script::answers(move |_, asked| asked.answer(&served, "\"one\""));
    let folder = Folder::new();
    std::fs::write(folder.path("whole.uwm"), &file).unwrap();
    folder.run("decode whole.uwm -o whole.ply").succeeded();
    for (pixels, there) in [(256, [false, true, true, false, false]), (64, [true, true, false, false, false])]
    {
        let before = script.asked().len();
        let fetch = |out: &str| folder.run(&format!("fetch {} --textures {pixels} -o {out}", script.url()));
        let told: Value = serde_json::from_slice(&fetch("light.uwm --json").succeeded().out).unwrap();
        assert!(passed_over(&script.asked()[before..], &large), "{:?}", script.asked());
        let left_out: usize = (0..5).filter(|&k| !there[k] && k != SMALL).map(|k| SIZES[k]).sum();
        assert_eq!(
            told["textures"],
            json!({ "pixels": pixels, "smaller_images": 2, "left_out_bytes": left_out })
        );
        assert_eq!(told["bytes"], file.len() - left_out);
        // It is a file like others, of the same mesh.
        folder.run("verify light.uwm").succeeded();
        folder.run("decode light.uwm -o light.ply").succeeded();
        assert!(folder.bytes("light.ply") == folder.bytes("whole.ply"));
        // But for what the scene says of images.
        assert!((file.len() - folder.bytes("light.uwm").len()).abs_diff(left_out) < 400);
        folder.run("decode light.uwm -o light.glb").succeeded();
        fetch("other.glb").succeeded();
        let glb = folder.bytes("light.glb");
        assert!(glb == folder.bytes("other.glb"));
        assert_eq!([0, 1, 2, 3, 4].map(|k| has(&glb, k)), there);
        assert!(fetch("-").succeeded().out == folder.bytes("light.uwm"));
    }
    let run = folder.run(&format!("fetch {} --textures 256 -o light.uwm", script.url()));
    assert!(
        run.succeeded().text().contains(
            "light.uwm: all of the mesh, with smaller pictures of 2 images in place of 130,000 bytes; "
        ),
        "{}",
        run.text()
    );
    // A level as a mesh, with what belongs to it.
    folder.run(&format!("fetch {} --textures 256 --level {level} -o level.glb", script.url())).succeeded();
    folder.run(&format!("decode light.uwm --level {level} -o other.glb")).succeeded();
    assert!(folder.bytes("level.glb") == folder.bytes("other.glb"));
}

#[test]
fn what_broke_off_goes_on() {
    let (file, large, _) = scene();
    let served = file.clone();
    // A byte behind the image is wrong, the first time.
    let is_mended = Arc::new(AtomicBool::new(false));
    let mended = is_mended.clone();
    let script = Script::answers(move |_, asked| {
        let mut file = served.clone();
        if !mended.load(Relaxed)
            && let Some(last) = file.last_mut()
        {
            *last ^= 1;
        }
        asked.answer(&file, "\"one\"")
    });
    let folder = Folder::new();
    let command = format!("fetch {} --textures 256 -o a.uwm --json", script.url());
    let run = folder.run(&command);
    assert!(run.code == 1 && run.err.contains("a.uwm.part has what came"), "{}", run.err);
    is_mended.store(true, Relaxed);
    let told: Value = serde_json::from_slice(&folder.run(&command).succeeded().out).unwrap();
    assert!(told["resumed_bytes"].as_u64().unwrap() as usize > file.len() - large.len() - 30_000 - 5000);
    assert!(passed_over(&script.asked(), &large), "{:?}", script.asked());
    let good = file.clone();
    let other = Script::answers(move |_, asked| asked.answer(&good, "\"one\""));
    folder.run(&format!("fetch {} --textures 256 -o b.uwm", other.url())).succeeded();
    assert!(folder.bytes("a.uwm") == folder.bytes("b.uwm"));
}

#[test]
fn where_there_is_nothing_of_the_kind() {
    let folder = Folder::new();
    let fails = |arguments: &str, what: &str| {
        let run = folder.run(&format!("fetch http://127.0.0.1:1/a.uwm {arguments}"));
        assert!(run.code == 2 && run.err.contains(what), "{}", run.err);
    };
    fails("-o a.ply --textures 64", "--textures is for .uwm, .glb and .gltf");
    fails("-o a.uwm --textures 64 --level 2", "with --textures a .uwm file has all of the mesh");
    fails("-o a.uwm --textures 0", "0 is not in 1..");
    let (file, _) = super::coded(1);
    let served = file.clone();
    let script = Script::answers(move |_, asked| asked.answer(&served, "\"one\""));
    folder.run(&format!("fetch {} -o a.uwm --textures 64", script.url())).succeeded();
    assert!(folder.bytes("a.uwm") == file, "a mesh without a scene is as it is");
}
