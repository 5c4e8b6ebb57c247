//! Real scenes: each goes in and comes back. They are not part of the repository: they are looked for in the folder `gltf` of
//! `$UNWELD_DATA` or `../shared/data`, and without them the test says so and passes.

use crate::real_scenes::folder;
use serde_json::Value;
use std::fs;
use std::process::Command;
use unweld::formats::{Format, read};
use unweld::mesh::attributes::Semantic;

/// Triangles, attributes and extensions are those that the collection's own list has of each file.
#[test]
fn what_the_list_says() {
    let Some(folder) = folder() else { return };
    let list: Value = serde_json::from_slice(&fs::read(folder.join("MANIFEST.json")).unwrap()).unwrap();
    let mut checked = 0;
    for entry in list.as_array().unwrap() {
        let name = entry["file"].as_str().unwrap();
        let path = folder.join(name);
        if Format::from_path(&path) != Some(Format::Gltf) || !path.is_file() {
            continue;
        }
        let packed = entry["draco"].as_u64().unwrap_or(0) > 0;
        if packed && !cfg!(feature = "draco") {
            continue;
        }
        let source = read(&path).unwrap();
        checked += 1;
        if let Some(triangles) = entry["F"].as_u64().filter(|_| entry["instances"] == entry["meshes"]) {
            assert_eq!(source.mesh.triangles.len() as u64, triangles, "{name}");
        }
        let has = |semantic| source.mesh.attributes.iter().any(|a| a.semantic == semantic);
        let listed = |start: &str| {
            entry["attrs"].as_array().unwrap().iter().any(|a| a.as_str().unwrap().starts_with(start))
        };
        for (start, semantic) in [
            ("NORMAL", Semantic::Normal),
            ("TANGENT", Semantic::Tangent),
            ("TEXCOORD", Semantic::TexCoord),
            ("COLOR", Semantic::Color),
            ("JOINTS", Semantic::Joints),
            ("WEIGHTS", Semantic::Weights),
        ] {
            assert_eq!(has(semantic), listed(start), "{name}: {start}");
        }
        for (what, key) in
            [("skins", "skins"), ("animations", "anims"), ("materials", "materials"), ("images", "images")]
        {
            let count = entry[key].as_u64().unwrap();
            let told = source.dropped.iter().any(|dropped| *dropped == format!("{what} ({count})"));
            assert_eq!(told, count > 0, "{name}: {count} {what}: {:?}", source.dropped);
        }
    }
    assert!(checked >= 25, "{checked}");
}

/// Small ones through the program: they come back as they were, also to the last bit, and nothing is lost without a word.
#[test]
fn there_and_back() {
    let Some(folder) = folder() else { return };
    let results = tempfile::tempdir().unwrap();
    let run =
        |args: &[&str]| Command::new(env!("CARGO_BIN_EXE_unweld")).args(args).output().unwrap().status.code();
    for name in [
        "small_sparse",
        "small_texturetransform",
        "small_multiuv",
        "draco_heart",
        "meshopt_pirate",
        "skin_fox_noindices",
    ] {
        let input = folder.join(name).with_extension("glb");
        let (input, output) = (input.to_str().unwrap(), results.path().join(name).with_extension("uwm"));
        let output = output.to_str().unwrap();
        for further in [&[][..], &["--exact", "--keep-order"]] {
            assert_eq!(
                run(&[&["encode", input, "-o", output, "--force", "-q"], further].concat()),
                Some(0),
                "{name}"
            );
            assert_eq!(run(&["verify", output, input, "-q"]), Some(0), "{name} {further:?}");
        }
        assert_eq!(run(&["encode", input, "-o", output, "--force", "-q", "--strict"]), Some(0), "{name}");
    }
}

/// The same cat three ways: as it was, and compressed by gltfpack, whose positions are on a lattice of 14 bits.
#[test]
fn a_cat_and_its_compressed_copy() {
    let Some(folder) = folder() else { return };
    let [plain, packed] =
        ["tex_cat_statue.glb", "meshopt_cat.glb"].map(|name| read(&folder.join(name)).unwrap().mesh);
    assert_eq!(plain.triangles.len(), packed.triangles.len());
    let nearest = |p: [f64; 3]| {
        let distances =
            plain.positions.iter().map(|q| (0..3).map(|k| (p[k] - q[k]).powi(2)).sum::<f64>().sqrt());
        distances.fold(f64::INFINITY, f64::min)
    };
    let allowed = plain.diagonal() / f64::from(1 << 14);
    assert!(packed.positions.iter().step_by(7).all(|&p| nearest(p) < allowed));
}
