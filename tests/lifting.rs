//! Lifting: levels lie nearer to the input for no bits, and everything comes back.
#![cfg(feature = "encode")]

mod common;

use common::triangles;
use unweld::container::{Want, parse_contents, plan, plan_from_keyframe};
use unweld::decoder::{self, Decoder, Event};
use unweld::encoder::{Encoder, Keyframes, LatticeChoice, Options, Preview};
use unweld::mesh::{IndexedMesh, Lattice, Vertex, shapes};
use unweld::refine::ProgressiveMesh;

/// Lifted as far as it goes, with coordinates of fewer bits in coarse levels, in small atoms.
fn options(base_vertices: usize) -> Options {
    let mut options =
        Options { keyframes: Keyframes::All, atom_bytes: 100, lifting: Some(32), ..Options::default() };
    options.preview = Preview::Schedule(vec![0, 1, 2, 4]);
    options.simplify.base_vertices = Some(base_vertices);
    options
}

fn encoded(mesh: &IndexedMesh, options: Options) -> Vec<u8> {
    Encoder::new(options).encode_to_vec(mesh).unwrap()
}

/// The mesh after each level, the base first.
fn levels(file: &[u8]) -> Vec<ProgressiveMesh> {
    let mut decoder = Decoder::new(decoder::Options::default());
    decoder.push(file);
    let mut levels = Vec::new();
    while let Some(event) = decoder.poll().unwrap() {
        if let Event::Level { .. } = event {
            levels.push(decoder.mesh().clone());
        }
    }
    levels
}

fn lifting(file: &[u8]) -> u8 {
    parse_contents(file).unwrap().unwrap().header.coding.lifting
}

#[test]
fn level_0_and_every_keyframe_are_what_they_were() {
    // A body of flat faces is not lifted: what is above its edges is not what lies beside them.
    let lifted = [
        (shapes::bumpy_sphere(3, 1), 32),
        (shapes::torus_with_hole(16, 12), 32),
        (shapes::handle_body(2), 0),
    ];
    for (mesh, factor) in lifted {
        let file = encoded(&mesh, options(20));
        assert_eq!(lifting(&file), factor);
        let contents = parse_contents(&file).unwrap().unwrap();
        let lattice = contents.header.lattice;
        let follow = |plan: unweld::container::Plan| {
            let mut decoder = Decoder::of_plan(contents.clone(), &plan, decoder::Options::default());
            for part in &plan.parts {
                decoder.push(&file[part.bytes.start as usize..part.bytes.end as usize]);
            }
            while decoder.poll().unwrap().is_some() {}
            decoder.finish().unwrap();
            triangles(&decoder.assembled().unwrap(), &lattice)
        };
        for j in 0..=contents.base_level() {
            let replayed = follow(plan(&contents, Want::Level(j)));
            assert_eq!(replayed, follow(plan_from_keyframe(&contents, j)), "level {j}");
            if j == 0 {
                assert_eq!(replayed, triangles(&mesh, &lattice));
            }
        }
    }
}

/// A sphere's levels lie within it, and lifted ones on both sides.
#[test]
fn a_lifted_level_is_nearer_to_the_input() {
    let mesh = shapes::sphere(4);
    let errors = |lifting: u8| {
        let mut options = Options { lifting: Some(lifting), preview: Preview::Off, ..Options::default() };
        options.simplify.base_vertices = Some(40);
        let contents = parse_contents(&encoded(&mesh, options)).unwrap().unwrap();
        // By what the table tells; `tests/level_errors.rs` measures whether that holds.
        contents.levels.iter().map(|level| level.rms_error).collect::<Vec<_>>()
    };
    let (plain, lifted) = (errors(0), errors(13));
    assert_eq!(plain.len(), lifted.len());
    let coarse = plain.len() / 2..plain.len();
    for (j, (plain, lifted)) in plain.iter().zip(&lifted).enumerate() {
        assert!(lifted <= &(1.01 * plain), "level {j}: {lifted} instead of {plain}");
        if coarse.contains(&j) {
            assert!(lifted < &(0.8 * plain), "level {j}: {lifted} instead of {plain}");
        }
    }
}

/// What is there twice, at a common boundary, is at the same place in both, whatever happens inside.
#[test]
fn boundary_vertices_stay() {
    let mesh = shapes::torus_with_hole(16, 12);
    let mut options = options(20);
    (options.preview, options.lock_boundary) = (Preview::Auto, true);
    let file = encoded(&mesh, options);
    assert_eq!(lifting(&file), 32);
    let levels = levels(&file);
    let last = levels.last().unwrap();
    let mut inside = 0;
    for level in &levels {
        for v in 0..level.positions.len() {
            let same = level.positions[v] == last.positions[v];
            if level.table.is_boundary(Vertex(v as u32)) {
                assert!(same, "vertex {v} of the boundary has moved");
            } else {
                inside += usize::from(!same);
            }
        }
    }
    assert!(inside > 0, "nothing is lifted");
}

/// By default coarse levels have coarse coordinates, but not where neighbours would come apart.
#[test]
fn tiles_have_all_bits_by_default() {
    let mesh = shapes::bumpy_sphere(4, 3);
    let coarsest = |options: Options| {
        parse_contents(&encoded(&mesh, options)).unwrap().unwrap().levels.last().unwrap().precision
    };
    assert!(coarsest(Options::default()) > 3);
    let lattice = LatticeChoice::Given { step: 1.0 / 4096.0, origin: [0.0; 3] };
    assert_eq!(coarsest(Options { lattice, ..Options::default() }), 0);
    assert_eq!(coarsest(Options { lock_boundary: true, ..Options::default() }), 0);
    assert!(coarsest(Options { lattice, preview: Preview::Fine, ..Options::default() }) > 3);
}

/// There is no room beyond a lattice of 24 bits for what binary32 can tell, and a mesh of few vertices may be lifted beyond any margin.
#[test]
fn what_has_no_room_is_lifted_less() {
    let mesh = shapes::sphere(4);
    let of = |options: Options| lifting(&encoded(&mesh, options));
    assert_eq!(of(Options { position_bits: 24, ..Options::default() }), 0);
    assert_eq!(of(Options { position_bits: 23, ..Options::default() }), 13);
    let mut tiny = options(4);
    tiny.preview = Preview::Schedule(vec![14]);
    // One cell for all: its margin is none.
    assert!(of(tiny) < 32);
}

#[test]
fn the_log_goes_down_from_anywhere_and_up_again() {
    let mesh = shapes::bumpy_sphere(3, 1);
    let file = encoded(&mesh, options(20));
    let of_level = levels(&file);
    let lattice: Lattice = parse_contents(&file).unwrap().unwrap().header.lattice;
    let mut decoder = Decoder::new(decoder::Options { undo: true, ..Default::default() });
    let mut stops = 0;
    for packet in file.chunks(80) {
        decoder.push(packet);
        while decoder.poll().unwrap().is_some() {
            let here = decoder.mesh().clone();
            let mut above = of_level.len();
            while decoder.coarsen().unwrap().is_some() {
                let there = decoder.mesh();
                let level = of_level.iter().position(|level| level.positions == there.positions);
                let level = level.expect("a level that has been");
                assert!(level < above && (above == of_level.len() || level + 1 == above), "a level left out");
                above = level;
                there.table.check().unwrap();
            }
            assert!(above == 0 || above == of_level.len(), "not down to the base");
            while decoder.restore().unwrap().is_some() {}
            assert_eq!(decoder.mesh().positions, here.positions);
            stops += 1;
        }
    }
    assert!(stops > 40, "{stops}");
    assert_eq!(triangles(&decoder.assembled().unwrap(), &lattice), triangles(&mesh, &lattice));
}
