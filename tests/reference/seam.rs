//! The example of §13.10: the answers that its table tells, and the bytes that they are.

use std::cell::RefCell;

use super::agree::{agree, sorted};
use super::attribute::{Attribute, read_attributes};
use super::attributes::Attributes;
use super::container::{Atom, BASE, Fields, Level, REFINEMENT};
use super::draft::{Draft, Shape, atom};
use super::entropy::{Code, Tap};
use super::forge::{answers, encode, scripted};
use super::keyframe::read_code;
use super::lifting::Scale;
use super::refinement::{Models, trace_with};
use super::walk::Mesh;

const SQUARE: Level = Level { vertices: 4, triangles: 2, shift: 0, max_error: 0.0, rms_error: 0.0 };

/// The entry: a number of 8 bits that corners have, born at level 1.
const ENTRY: [u8; 7] = [0x07, 0x00, 0x00, 0x00, 0x01, 0x01, b'h'];

fn entry() -> Vec<Attribute> {
    read_attributes(&mut Fields(&ENTRY), 1).unwrap()
}

/// Reads the square and what it has, of this code or of its tap.
fn read_base(code: &[u8], tap: &RefCell<Tap>) -> (Mesh, Attributes) {
    let mut code = Code::tapped(code, tap);
    let mesh = read_code(&mut code, 4, SQUARE, Scale::plain(8), [0; 3]).unwrap();
    let mut attributes = Attributes::unborn(&entry());
    attributes.pass(&mut code, &mesh, &[0]).unwrap();
    (mesh, attributes)
}

/// Behind the positions, by vertex.
fn of_base() -> Vec<u64> {
    [
        // A: broken? breaks? a residual of 0: a symbol and a bit; same? again? a residual of 1.
        &[1, 1, 8, 0, 0, 0, 9][..],
        // B: broken? that of A?
        &[0, 1],
        // C: broken? breaks? that of A? same? that of A and B?
        &[1, 1, 1, 0, 1],
        // D: broken? that of A and C?
        &[0, 1],
    ]
    .concat()
}

/// Behind the split: parts? broken? breaks of four spokes; that of C, D and A? same? again? that of A, B and C?
const OF_SPLIT: [u64; 10] = [0, 1, 1, 0, 1, 0, 1, 0, 0, 1];

#[test]
fn the_square_with_a_seam() {
    let square = answers(&[0x6F, 0x5F, 0x63, 0x8C, 0x82], 4, SQUARE);
    let told = [square, of_base()].concat();
    let tap = scripted(&told);
    read_base(&[], &tap);
    let log = tap.into_inner().log;
    assert_eq!(log.len(), told.len());
    let base = [&[4][..], &encode(log.into_iter().map(|(part, _)| part))].concat();

    // The split of §5.7.1 alone, and what is behind it.
    let split = |bytes: &[u8], told: Option<Vec<u64>>, has_values: bool| {
        let (mut mesh, mut attributes) = read_base(&base[1..], &RefCell::default());
        if !has_values {
            attributes = Attributes::default();
        }
        let tap = told.map_or_else(RefCell::default, |told| scripted(&told));
        let atom = Atom { bytes: bytes.to_vec(), ..atom(REFINEMENT, 0, 1, 2, &[]) };
        let models = &mut Models::fresh(false);
        let pass = trace_with(&mut mesh, &mut attributes, vec![&atom], Scale::plain(8), models, Some(&tap));
        pass.1.unwrap();
        tap.into_inner().log
    };
    let of_split = split(&[0x61, 0x56, 0xD9], None, false).into_iter().map(|(_, answer)| answer);
    let told: Vec<u64> = of_split.chain(OF_SPLIT).collect();
    let log = split(&[], Some(told.clone()), true);
    assert_eq!(log.len(), told.len());
    let refinement = encode(log.into_iter().map(|(part, _)| part));

    let shape = |vertices, triangles| Shape { vertices, triangles, shift: 0, errors: [0; 2] };
    let draft = Draft {
        settings: [0, 0, 1],
        origin: [0.0; 3],
        step: 1.0,
        bits: 8,
        maximum: [255, 255, 9],
        attributes: ENTRY.to_vec(),
        resources: vec![],
        levels: vec![shape(5, 4), shape(4, 2)],
        attribute_errors: vec![vec![], vec![0; 4]],
        atoms: vec![atom(BASE, 1, 0, 0, &base), atom(REFINEMENT, 0, 1, 2, &refinement)],
    };
    let whole = agree(&draft.bytes()).expect("a sound file").whole;
    let [a, b, c, d, v] =
        [[0.0, 0.0, 0.0], [255.0, 0.0, 0.0], [255.0, 255.0, 0.0], [0.0, 255.0, 0.0], [130.0, 120.0, 9.0]];
    let found = whole
        .triangles
        .iter()
        .zip(&whole.values)
        .map(|(t, values)| [0, 1, 2].map(|k| (whole.positions[t[k]], values[k][0].clone().unwrap()[0])));
    let expected = [([b, c, v], 0), ([a, b, v], 0), ([d, a, v], 1), ([c, d, v], 1)];
    let expected = expected.into_iter().map(|(t, value)| t.map(|p| (p, value)));
    assert_eq!(sorted(found), sorted(expected));

    let of_base = [0x04, 0x6F, 0x5F, 0x63, 0x8C, 0x82, 0x1A, 0x29, 0xD2, 0x65, 0xB1, 0x40];
    assert_eq!((base, refinement), (of_base.to_vec(), vec![0x61, 0x56, 0xDA, 0x0F, 0xF3, 0x57]));
}
