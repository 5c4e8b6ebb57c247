//! What fuzzing has found, one test each, named for its cause.
#![cfg(feature = "encode")]

use unweld::container::{AtomKind, FileBuilder, parse_contents};
use unweld::decoder::{self, Decoder, Event};
use unweld::encoder::{Encoder, Options, Preview};
use unweld::mesh::topology::Weld;
use unweld::mesh::{IndexedMesh, shapes};

/// Levels in atoms as small as they can be, coarse levels at a coarse precision.
fn small_atoms() -> Options {
    let mut options = Options { atom_bytes: 1, preview: Preview::Schedule(vec![1, 3]), ..Options::default() };
    options.simplify.base_vertices = Some(10);
    options
}

#[test]
fn a_precision_pass_in_atoms_shorter_than_the_coder_s_own_bytes_ends() {
    let file = Encoder::new(small_atoms()).encode_to_vec(&shapes::sphere(1)).unwrap();
    decoder::decode(&file, decoder::Options::default()).unwrap();
}

#[test]
fn down_and_up_again_in_the_middle_of_a_precision_pass() {
    let file = Encoder::new(small_atoms()).encode_to_vec(&shapes::sphere(2)).unwrap();
    let straight = decoder::decode(&file, decoder::Options::default()).unwrap();
    let mut decoder = Decoder::new(decoder::Options { undo: true, ..Default::default() });
    decoder.push(&file);
    let mut turns = 0;
    while let Some(event) = decoder.poll().unwrap() {
        if matches!(event, Event::Refined(delta) if !delta.moved.is_empty()) {
            decoder.coarsen().unwrap();
            decoder.restore().unwrap();
            turns += 1;
        }
    }
    assert!(turns > 10);
    assert_eq!(decoder.mesh().positions, straight.mesh().positions);
}

#[test]
fn decoding_does_not_go_on_behind_an_error() {
    let mut options = Options { atom_bytes: 40, ..Options::default() };
    options.simplify.base_vertices = Some(10);
    let file = Encoder::new(options).encode_to_vec(&shapes::sphere(2)).unwrap();
    let contents = parse_contents(&file).unwrap().unwrap();
    let victim =
        contents.atoms.iter().rposition(|atom| atom.kind == AtomKind::Refinement && !atom.last).unwrap();
    let mut changed =
        FileBuilder::new(contents.header.lattice, contents.header.maximum, contents.levels.clone());
    changed.coding = contents.header.coding;
    for (index, atom) in contents.atoms.iter().enumerate() {
        let mut bytes = file[atom.offset as usize..atom.end() as usize].to_vec();
        if index == victim {
            bytes.extend([0; 40]);
        }
        changed.atom(atom.kind, atom.level, atom.items, atom.triangles, bytes);
    }
    let mut file = Vec::new();
    changed.write(&mut file).unwrap();
    let mut decoder = Decoder::new(decoder::Options::default());
    decoder.push(&file);
    let mut last = None;
    // An atom gives a few events at most: what ends neither with an error nor with the last of them goes round in a circle.
    let mut polls = (0..10 * contents.atoms.len()).map(|_| decoder.poll());
    let fault = loop {
        match polls.next() {
            Some(Ok(Some(event))) => last = Some(event),
            Some(Err(fault)) => break fault.to_string(),
            Some(Ok(None)) => panic!("the file was decoded, error and all"),
            None => panic!("decoding does not end"),
        }
    };
    assert!(fault.contains("left over"), "{fault}");
    assert!(matches!(last, Some(Event::Refined(_))), "what was decoded before the error is told before it");
    assert_eq!(decoder.poll().unwrap_err().to_string(), fault);
    assert_eq!(decoder.finish().unwrap_err().to_string(), fault);
}

#[test]
fn errors_beyond_binary32_fit_the_table() {
    for scale in [1e60, 1e300, 1e-300] {
        let mut mesh = shapes::sphere(2);
        mesh.positions.iter_mut().flatten().for_each(|x| *x *= scale);
        let mut options = Options::default();
        options.simplify.base_vertices = Some(10);
        let file = Encoder::new(options).encode_to_vec(&mesh).unwrap();
        decoder::decode(&file, decoder::Options::default()).unwrap();
    }
}

#[test]
fn vertices_in_no_triangle_at_both_ends_of_what_a_lattice_can_name() {
    let far = f64::from(1 << 30);
    let mut mesh = IndexedMesh::new(vec![[0.0; 3], [255.0, 0.0, 0.0], [0.0, 255.0, 0.0]], vec![[0, 1, 2]]);
    mesh.positions.extend([[-far; 3], [far; 3]]);
    let options = Options { position_bits: 8, ..Options::default() };
    let file = Encoder::new(options).encode_to_vec(&mesh).unwrap();
    let back = decoder::decode(&file, decoder::Options::default()).unwrap().assembled().unwrap();
    assert!(back.positions.contains(&[-far; 3]) && back.positions.contains(&[far; 3]));
}

#[test]
fn many_groups_at_one_position() {
    // Bow-ties whose middles coincide without being one vertex.
    let count = 20_000;
    let mut mesh = IndexedMesh::default();
    for k in 0..count {
        let (n, x) = (5 * k, f64::from(k));
        mesh.positions.extend([[0.0; 3], [x, 1.0, 0.0], [x, 1.0, 1.0], [x, -1.0, 0.0], [x, -1.0, 1.0]]);
        mesh.triangles.extend([[n, n + 1, n + 2], [n, n + 3, n + 4]]);
    }
    let options = Options { weld: Weld::None, ..Options::default() };
    let file = Encoder::new(options).encode_to_vec(&mesh).unwrap();
    let back = decoder::decode(&file, decoder::Options::default()).unwrap().assembled().unwrap();
    assert_eq!((back.positions.len(), back.triangles.len()), (mesh.positions.len(), mesh.triangles.len()));
}

#[test]
fn two_apexes_over_one_long_rim() {
    // Whether the apexes share an edge is asked at every vertex of the rim; it took minutes.
    let count = 30_000;
    let rim = (0..count).map(|k| f64::from(k) / f64::from(count) * std::f64::consts::TAU);
    let mut mesh = IndexedMesh::default();
    mesh.positions.extend([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]]);
    mesh.positions.extend(rim.map(|angle| [angle.cos(), angle.sin(), 0.0]));
    for k in 0..count {
        let (a, b) = (2 + k, 2 + (k + 1) % count);
        mesh.triangles.extend([[0, a, b], [1, b, a]]);
    }
    let file = Encoder::default().encode_to_vec(&mesh).unwrap();
    let decoder = decoder::decode(&file, decoder::Options::default()).unwrap();
    assert!(decoder.contents().unwrap().header.base_vertices < 1000, "the rim can be simplified");
}
