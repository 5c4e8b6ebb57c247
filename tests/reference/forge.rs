//! Codes for any decisions, sensible or not.

use std::cell::RefCell;
use std::collections::VecDeque;

use super::container::{Atom, Level, REFINEMENT};
use super::entropy::{Code, Part, Tap};
use super::keyframe::read_code;
use super::refinement::{Models, trace_pass};
use super::symbol::Symbol;
use super::walk::Mesh;

/// Lattice bits of the levels made here.
const BITS: u32 = 8;

/// The answers in the code of a sound base or keyframe: decisions, all of them.
pub fn answers(code: &[u8], boundary: u64, level: Level) -> Vec<u64> {
    let tap = RefCell::default();
    read_code(&mut Code::tapped(code, &tap), boundary, level, BITS).expect("a sound code");
    tap.into_inner().log.into_iter().map(|(_, answer)| answer).collect()
}

/// A code in which a reader of a base or keyframe finds these answers, then zeros, as far as it reads.
pub fn code(answers: &[u64], boundary: u64, level: Level) -> Vec<u8> {
    let tap = scripted(answers);
    // The verdict is of no interest here: the code goes to both decoders.
    let _ = read_code(&mut Code::tapped(&[], &tap), boundary, level, BITS);
    encode(tap.into_inner().log.into_iter().map(|(part, _)| part))
}

/// The bytes of a refinement atom of so many operations, the first one on this mesh, in which a reader finds these
/// answers, then what a tap's script says. The mesh is that after the pass, as far as it came.
pub fn refinement(mesh: &mut Mesh, answers: &[u64], items: u64, bits: u32) -> Vec<u8> {
    let tap = scripted(answers);
    // Whatever number of triangles there will be.
    let triangles = 2 * items;
    let atom = Atom { kind: REFINEMENT, level: 0, items, triangles, length: 0, sum: 0, bytes: vec![] };
    let _ = trace_pass(mesh, vec![&atom], (0, bits), &mut Models::fresh(), Some(&tap));
    encode(tap.into_inner().log.into_iter().map(|(part, _)| part))
}

fn scripted(answers: &[u64]) -> RefCell<Tap> {
    RefCell::new(Tap { script: Some(VecDeque::from(answers.to_vec())), ..Tap::default() })
}

/// The inverse of §6.1: the smallest number in the last range, without the zeros at its end.
pub fn encode(parts: impl IntoIterator<Item = Part>) -> Vec<u8> {
    // The start of the range is `bytes` followed by the 32 bits of `low`.
    let (mut bytes, mut low, mut range) = (Vec::new(), 0u64, 0xFFFF_FFFFu64);
    for part in parts {
        low += (range >> part.shift) * part.start;
        range = part.width(range);
        carry(&mut bytes, &mut low);
        while range < 1 << 24 {
            bytes.push((low >> 24) as u8);
            low = (low << 8) % (1 << 32);
            range *= 256;
        }
    }
    bytes.extend((low as u32).to_be_bytes());
    while bytes.len() > 1 && bytes.ends_with(&[0]) {
        bytes.pop();
    }
    bytes
}

fn carry(bytes: &mut [u8], low: &mut u64) {
    if *low >= 1 << 32 {
        *low -= 1 << 32;
        for byte in bytes.iter_mut().rev() {
            *byte = byte.wrapping_add(1);
            if *byte != 0 {
                break;
            }
        }
    }
}

#[test]
fn answers_come_back() {
    let mut model = Symbol::FRESH;
    let tap = scripted(&(0..3000u64).map(|i| i * i % 67 * (i % 3)).collect::<Vec<_>>());
    let read = |code: &mut Code, model: &mut Symbol, i: u64| match i % 3 {
        0 => u64::from(code.decide(32 + i * i * 7919 % 65473).unwrap()),
        1 => code.bits(1 + (i % 16) as u32).unwrap(),
        _ => code.symbol(model).unwrap() as u64,
    };
    let mut code = Code::tapped(&[], &tap);
    let written: Vec<u64> = (0..3000).map(|i| read(&mut code, &mut model, i)).collect();
    let bytes = encode(tap.take().log.into_iter().map(|(part, _)| part));

    let mut model = Symbol::FRESH;
    let mut code = Code::start(&bytes);
    assert_eq!((0..3000).map(|i| read(&mut code, &mut model, i)).collect::<Vec<_>>(), written);
    code.end().unwrap();
    assert!((0..16).all(|s| written.contains(&s)));
}
