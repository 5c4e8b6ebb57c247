//! The loop: what goes in comes out, at every level, by every road.

use unweld::decoder::{self, Decoder, Event};
use unweld::encoder::{Encoder, Keyframes, Options};
use unweld::mesh::{IndexedMesh, Lattice, shapes};

/// Triangles as lattice points, each in the smallest of its rotations, sorted: equal for equal surfaces.
fn triangles(mesh: &IndexedMesh, lattice: &Lattice) -> Vec<[[i32; 3]; 3]> {
    let rotated = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| lattice.quantise(mesh.positions[v as usize]));
        [[a, b, c], [b, c, a], [c, a, b]].into_iter().min().unwrap()
    };
    let mut all: Vec<_> = mesh.triangles.iter().map(rotated).collect();
    all.sort_unstable();
    all
}

fn small() -> Options {
    let mut options = Options { keyframes: Keyframes::All, atom_bytes: 100, ..Options::default() };
    options.simplify.base_vertices = Some(10);
    options
}

#[test]
fn shapes_come_back() {
    for mesh in
        [shapes::sphere(3), shapes::torus_with_hole(20, 14), shapes::handle_body(2), shapes::disc_with_ears()]
    {
        for precision in [vec![], vec![1, 2, 5]] {
            let file = Encoder::new(Options { precision, ..small() }).encode_to_vec(&mesh).unwrap();
            let decoder = decoder::decode(&file, decoder::Options::default()).unwrap();
            let lattice = decoder.contents().unwrap().header.lattice;
            assert_eq!(triangles(&decoder.assembled().unwrap(), &lattice), triangles(&mesh, &lattice));
        }
    }
}

#[test]
fn the_undo_log_goes_down_and_up_again() {
    let mut options = small();
    options.precision = vec![1, 3];
    let file = Encoder::new(options).encode_to_vec(&shapes::torus_with_hole(16, 12)).unwrap();
    let mut decoder = Decoder::new(decoder::Options { undo: true, ..Default::default() });
    decoder.push(&file);
    let mut seen = Vec::new();
    while let Some(event) = decoder.poll().unwrap() {
        if let Event::Level { level, .. } = event {
            seen.push((level, decoder.mesh().clone()));
        }
    }
    let mut down = seen.len() - 1;
    while let Some(level) = decoder.coarsen().unwrap() {
        down -= 1;
        assert_eq!(level, seen[down].0);
        assert_eq!(decoder.level(), Some(level));
        decoder.mesh().table.check().unwrap();
        assert_eq!(decoder.mesh().positions, seen[down].1.positions);
        assert_eq!(decoder.mesh().roots.edges(), seen[down].1.roots.edges());
    }
    assert_eq!(down, 0);
    while decoder.restore().unwrap().is_some() {
        down += 1;
        assert_eq!(decoder.mesh().positions, seen[down].1.positions);
    }
    assert_eq!(down, seen.len() - 1);
    let lattice = decoder.contents().unwrap().header.lattice;
    assert_eq!(
        triangles(&decoder.assembled().unwrap(), &lattice),
        triangles(&shapes::torus_with_hole(16, 12), &lattice)
    );
}

#[test]
fn bytes_behind_the_end_are_refused_whichever_push_brings_them() {
    let file = Encoder::new(small()).encode_to_vec(&shapes::sphere(2)).unwrap();
    let outcome = |pieces: &[&[u8]]| {
        let mut decoder = Decoder::new(decoder::Options::default());
        for piece in pieces {
            decoder.push(piece);
            while decoder.poll().unwrap().is_some() {}
        }
        decoder.finish().map_err(|e| e.to_string())
    };
    let at_once = outcome(&[&[&file[..], b"xyz"].concat()]);
    assert!(at_once.as_ref().unwrap_err().contains("3 bytes behind the last atom"), "{at_once:?}");
    assert_eq!(outcome(&[&file, b"xyz"]), at_once);
    assert_eq!(outcome(&[&file, b"x", b"yz"]), at_once);
    assert_eq!(outcome(&[&file]), Ok(()));
}
