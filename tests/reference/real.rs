//! Both decoders on real meshes, where they are at hand.
#![cfg(feature = "formats")]

use std::path::{Path, PathBuf};

use unweld::encoder::{Encoder, Keyframes, Options};
use unweld::formats;

use super::agree::agree;
use super::container::File;
use super::on_shapes::same_triangles;

fn both_read(name: &str, keyframes: Keyframes) {
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data");
    let path = std::env::var_os("UNWELD_DATA").map_or_else(beside, PathBuf::from).join(name);
    if !path.exists() {
        eprintln!("skipped: no {}", path.display());
        return;
    }
    let mesh = formats::read(&path).unwrap().mesh;
    let bytes = Encoder::new(Options { keyframes, ..Options::default() }).encode_to_vec(&mesh).unwrap();
    let seen = agree(&bytes).expect("the encoder writes what can be read");
    same_triangles(&mesh, &seen.whole, &File::read(&bytes).unwrap());
}

#[test]
fn bunny() {
    both_read("scan_bunny.ply.gz", Keyframes::Levels(vec![6]));
}

#[test]
fn fandisk() {
    both_read("cad_fandisk.obj.gz", Keyframes::Every(5));
}

#[test]
fn teapot() {
    both_read("comps_teapot.obj.gz", Keyframes::Every(4));
}

#[test]
fn nasty() {
    for name in ["checkerboard_bowties", "cell_complex_3x3x3", "klein_bottle", "one_vertex_valence_800"] {
        both_read(&format!("nasty/{name}.obj"), Keyframes::All);
    }
}
