//! `unweld fetch` and the library beneath it, with servers that do what they should and servers that do not.
#![cfg(feature = "cli")]

mod command;
mod connections;
mod nginx;
mod script;
mod streams;

use std::sync::Arc;

use unweld::container::{Contents, parse_contents};
use unweld::encoder::{Encoder, Keyframes, Options as Encoding};
use unweld::mesh::shapes;

/// A mesh of 5,120 triangles with keyframes, and what is in it.
fn coded(seed: u64) -> (Vec<u8>, Arc<Contents>) {
    let options = Encoding { keyframes: Keyframes::Every(4), ..Encoding::default() };
    let file = Encoder::new(options).encode_to_vec(&shapes::bumpy_sphere(4, seed)).unwrap();
    let contents = parse_contents(&file).unwrap().unwrap();
    (file, contents)
}
