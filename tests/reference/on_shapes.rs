//! Both decoders on what the encoder makes of meshes.

use unweld::encoder::{Encoder, Keyframes, Options};
use unweld::mesh::{IndexedMesh, shapes};
use unweld::simplify::Method;

use super::agree::agree;

pub fn every_shape() -> Vec<IndexedMesh> {
    vec![
        shapes::tetrahedron(),
        shapes::disc_with_ears(),
        shapes::annulus(9),
        shapes::strip(12),
        shapes::grid(6, 5),
        shapes::torus(8, 7),
        shapes::torus_with_hole(9, 8),
        shapes::two_components(),
        shapes::handle_body(3),
        shapes::sphere(2),
        shapes::bumpy_sphere(2, 5),
    ]
}

#[test]
fn shapes_in_every_way() {
    let mut seed = 0;
    for mesh in every_shape() {
        for method in [Method::Stellar, Method::Ffc] {
            for keyframes in [Keyframes::None, Keyframes::Every(3), Keyframes::All] {
                for precision in [vec![], vec![1, 2, 5]] {
                    let mut options =
                        Options { keyframes: keyframes.clone(), precision, ..Options::default() };
                    options.simplify.method = method;
                    options.simplify.seed = seed;
                    options.simplify.base_vertices = Some([1, 10][seed as usize % 2]);
                    options.atom_bytes = [60, 1, 16 << 10][seed as usize % 3];
                    options.position_bits = [14, 8, 24][seed as usize / 3 % 3];
                    seed += 1;
                    let bytes = Encoder::new(options).encode_to_vec(&mesh).unwrap();
                    agree(&bytes).expect("the encoder writes what can be read");
                }
            }
        }
    }
}
