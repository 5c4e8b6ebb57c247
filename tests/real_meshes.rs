//! The loop on real meshes: every PLY, OBJ, STL, OFF and glTF of the data folder that is a mesh at all, both methods, welded and not.
//! The folder is `UNWELD_DATA`, or `../shared/data` beside the checkout; where there is none, the tests say so and pass.
#![cfg(all(feature = "encode", feature = "formats"))]

mod common;

use common::triangles;
use std::path::{Path, PathBuf};
use unweld::decoder::{self, Decoder, Event};
use unweld::encoder::{Encoder, Keyframes, Options};
use unweld::formats::{self, Format, Source};
use unweld::mesh::distance::{Sampling, SurfaceDistance, surface_distances};
use unweld::mesh::topology::Weld;
use unweld::simplify::Method;

fn data() -> Option<PathBuf> {
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data");
    let folder = std::env::var_os("UNWELD_DATA").map_or_else(beside, PathBuf::from);
    if folder.is_dir() {
        return Some(folder);
    }
    eprintln!("skipped: no folder of real meshes at {}", folder.display());
    None
}

/// All PLY, OBJ, STL, OFF and glTF files below `folder`, compressed or not, that can be read; small enough for a test.
fn meshes(folder: &Path) -> Vec<(String, Source)> {
    let mut found = Vec::new();
    for sub in ["", "nasty", "nasty_real", "tex_fuze", "tex_ico4uv", "tex_spot"] {
        let Ok(entries) = folder.join(sub).read_dir() else { continue };
        for entry in entries.flatten() {
            let path = entry.path();
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            if Format::from_path(&path).is_some() {
                // Whether a broken file is refused as it should be is another test's business.
                found.extend(formats::read(&path).ok().map(|source| (name, source)));
            }
        }
    }
    found.sort_by(|x, y| x.0.cmp(&y.0));
    found
}

#[test]
fn every_mesh_comes_back() {
    let Some(folder) = data() else { return };
    let all = meshes(&folder);
    assert!(all.len() > 100, "{} meshes in {}", all.len(), folder.display());
    for (name, source) in all {
        for (method, weld) in
            [(Method::Stellar, Weld::Exact), (Method::Ffc, Weld::Exact), (Method::Stellar, Weld::None)]
        {
            let mut options = Options { weld, keyframes: Keyframes::Every(4), ..Options::default() };
            options.simplify.method = method;
            // Small meshes get levels too.
            options.simplify.base_vertices = Some((source.mesh.positions.len() / 20).clamp(4, 500));
            let file =
                Encoder::new(options).encode_to_vec(&source.mesh).unwrap_or_else(|e| panic!("{name}: {e}"));
            let decoded = decoder::decode(&file, decoder::Options::default());
            let decoder = decoded.unwrap_or_else(|e| panic!("{name} {method:?} {weld:?}: {e}"));
            let lattice = decoder.contents().unwrap().header.lattice;
            let back = decoder.assembled().unwrap();
            assert!(
                triangles(&back, &lattice) == triangles(&source.mesh, &lattice),
                "{name} {method:?} {weld:?}: other triangles"
            );
        }
    }
}

/// The error told for a level is within a factor of two of the distance measured by sampling the surfaces.
#[test]
fn the_error_of_a_level_is_its_distance() {
    let Some(folder) = data() else { return };
    let names = [
        "cad_fandisk.obj.gz",
        "organic_cat.obj.gz",
        "genus1_rocker_arm.obj.gz",
        "comps_teapot.obj.gz",
        "synth_terrain.ply.gz",
    ];
    for name in names {
        let source = formats::read(&folder.join(name)).unwrap();
        for method in [Method::Stellar, Method::Ffc] {
            let mut options = Options::default();
            options.simplify.method = method;
            let file = Encoder::new(options).encode_to_vec(&source.mesh).unwrap();
            let mut decoder = Decoder::new(decoder::Options::default());
            decoder.push(&file);
            while let Some(event) = decoder.poll().unwrap() {
                let Event::Level { level, max_error, rms_error } = event else { continue };
                if level % 5 != 0 {
                    continue;
                }
                let sampling = Sampling { samples: 30_000, seed: 7, ..Sampling::default() };
                let level_mesh = decoder.assembled().unwrap();
                let ways = surface_distances(&source.mesh, &level_mesh, &sampling, &mut |_, _| {});
                let measured = SurfaceDistance::symmetric(ways.unwrap());
                let ratios = (max_error / measured.max, rms_error / measured.rms);
                for ratio in [ratios.0, ratios.1] {
                    assert!(
                        (0.5..=2.0).contains(&ratio),
                        "{name} {method:?} level {level}: told / measured {ratios:?}"
                    );
                }
            }
        }
    }
}
