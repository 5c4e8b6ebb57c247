//! The example of §13.10: the answers that its table tells, and the bytes that they are.

use std::cell::RefCell;

use super::agree::{agree, sorted};
use super::attribute::{Attribute, read_attributes};
use super::attributes::Attributes;
use super::container::{Atom, BASE, Fields, Level, REFINEMENT};
use super::draft::{Draft, Shape, atom};
use super::entropy::{Code, Part, Tap};
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
        // A: broken? breaks? a residual of 0: a symbol and three bits; same? again? a residual of 1: a symbol and a bit.
        &[1, 1, 8, 0, 0, 0, 8, 1][..],
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

/// What the base is, with its first byte.
fn base() -> Vec<u8> {
    let square = answers(&[0x6F, 0x5F, 0x63, 0x8C, 0x82], 4, SQUARE);
    let told = [square, of_base()].concat();
    let tap = scripted(&told);
    read_base(&[], &tap);
    let log = tap.into_inner().log;
    assert_eq!(log.len(), told.len());
    [&[4][..], &encode(log.into_iter().map(|(part, _)| part))].concat()
}

/// The split of §5.7.1 alone, and what is behind it: what is read of these bytes, or answered as told.
fn split(base: &[u8], bytes: &[u8], told: Option<Vec<u64>>, has_values: bool) -> Vec<(Part, u64)> {
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
}

/// Its answers, without attributes.
fn of_split_alone(base: &[u8]) -> Vec<u64> {
    split(base, &[0x61, 0x56, 0xD9], None, false).into_iter().map(|(_, answer)| answer).collect()
}

/// What both decoders find in level 0: the vertices of triangles, each with its number.
fn found(base: &[u8], refinement: &[u8]) -> Vec<[([f64; 3], u64); 3]> {
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
        atoms: vec![atom(BASE, 1, 0, 0, base), atom(REFINEMENT, 0, 1, 2, refinement)],
    };
    let whole = agree(&draft.bytes()).expect("a sound file").whole;
    let corners = whole.triangles.iter().zip(&whole.values);
    let corners = corners
        .map(|(t, values)| [0, 1, 2].map(|k| (whole.positions[t[k]], values[k][0].clone().unwrap()[0])));
    corners.collect()
}

const A: [f64; 3] = [0.0, 0.0, 0.0];
const B: [f64; 3] = [255.0, 0.0, 0.0];
const C: [f64; 3] = [255.0, 255.0, 0.0];
const D: [f64; 3] = [0.0, 255.0, 0.0];
const V: [f64; 3] = [130.0, 120.0, 9.0];

#[test]
fn the_square_with_a_seam() {
    let base = base();
    let told = [of_split_alone(&base), OF_SPLIT.to_vec()].concat();
    let log = split(&base, &[], Some(told.clone()), true);
    assert_eq!(log.len(), told.len());
    let refinement = encode(log.into_iter().map(|(part, _)| part));

    let expected = [([B, C, V], 0), ([A, B, V], 0), ([D, A, V], 1), ([C, D, V], 1)];
    let expected = expected.into_iter().map(|(t, value)| t.map(|p| (p, value)));
    assert_eq!(sorted(found(&base, &refinement).into_iter()), sorted(expected));

    let of_base = [0x04, 0x6F, 0x5F, 0x63, 0x8C, 0x82, 0x1A, 0x16, 0x84, 0x13, 0x6A, 0xEA, 0x80];
    assert_eq!((base, refinement), (of_base.to_vec(), vec![0x61, 0x56, 0xDA, 0x0F, 0xF3, 0x57]));
}

/// Whatever is told of the link, both decoders find it; and every corner can be told of, both at the ends of the split edge too.
#[test]
fn every_corner_of_a_link_may_part() {
    let base = base();
    let alone = of_split_alone(&base);
    let mut random = 1u32;
    let mut parted = [[0; 4]; 3];
    for _ in 0..300 {
        let mut told = alone.clone();
        // The link parts.
        told.push(1);
        told.extend((0..80).map(|_| {
            random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            u64::from(random >> 31)
        }));
        let log = split(&base, &[], Some(told), true);
        let found = found(&base, &encode(log.into_iter().map(|(part, _)| part)));
        // How many of both corners at each vertex of the link are not what they were, 0 or 1 by the side of the seam.
        for (k, p) in [A, B, C, D].into_iter().enumerate() {
            let is_other = |t: &&[([f64; 3], u64); 3]| {
                let was = u64::from(t.iter().any(|&(q, _)| q == D));
                t.iter().any(|&(q, value)| q == p && value != was)
            };
            parted[found.iter().filter(is_other).count()][k] += 1;
        }
    }
    assert!(parted.iter().flatten().all(|&times| times > 5), "{parted:?}");
}
