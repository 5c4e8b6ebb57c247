//! `unweld fetch` and the library beneath it, with servers that do what they should and servers that do not.
#![cfg(feature = "cli")]

mod command;
mod connections;
mod nginx;
mod script;
mod sets;
mod streams;
mod textures;

use std::sync::Arc;

use unweld::codec::grid::Real;
use unweld::container::{Contents, parse_contents};
use unweld::encoder::{Encoder, Keyframes, Options as Encoding};
use unweld::mesh::{IndexedMesh, shapes};

/// A mesh of 5,120 triangles with keyframes, and what is in it.
fn coded(seed: u64) -> (Vec<u8>, Arc<Contents>) {
    let options = Encoding { keyframes: Keyframes::Every(4), ..Encoding::default() };
    let file = Encoder::new(options).encode_to_vec(&shapes::bumpy_sphere(4, seed)).unwrap();
    let contents = parse_contents(&file).unwrap().unwrap();
    (file, contents)
}

/// Vertices and triangles in an order of their own, one vertex that no triangle uses, one triangle twice.
fn in_an_order() -> IndexedMesh {
    let mut mesh = shapes::bumpy_sphere(3, 2);
    mesh.triangles.reverse();
    mesh.triangles.iter_mut().step_by(3).for_each(|t| t.rotate_left(1));
    mesh.positions.push([0.1, -0.0, 7.5]);
    mesh.triangles.push(mesh.triangles[100]);
    mesh
}

/// A file with everything that belongs to level 0.
fn exact_and_ordered(mesh: &IndexedMesh) -> Vec<u8> {
    let (exact, keyframes) = (Some(Real::Binary64), Keyframes::Every(4));
    let options = Encoding { exact, keep_order: true, keyframes, ..Encoding::default() };
    Encoder::new(options).encode_to_vec(mesh).unwrap()
}
