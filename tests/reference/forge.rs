//! Codes for any decisions, sensible or not.

use std::cell::RefCell;
use std::collections::VecDeque;

use super::container::{Atom, Level, REFINEMENT, Result};
use super::coordinates::Coordinate;
use super::entropy::{Code, Part, Tap};
use super::keyframe::read_code;
use super::lifting::Scale;
use super::refinement::{Models, bit_length, trace_pass};
use super::symbol::Symbol;
use super::trace::Step;
use super::walk::Mesh;

/// Lattice bits of the levels made here.
const BITS: u32 = 8;

/// The answers in the code of a sound base or keyframe: decisions, all of them.
pub fn answers(code: &[u8], boundary: u64, level: Level) -> Vec<u64> {
    let tap = RefCell::default();
    read_code(&mut Code::tapped(code, &tap), boundary, level, Scale::plain(BITS), [0; 3])
        .expect("a sound code");
    tap.into_inner().log.into_iter().map(|(_, answer)| answer).collect()
}

/// A code in which a reader of a base or keyframe finds these answers, then zeros, as far as it reads.
pub fn code(answers: &[u64], boundary: u64, level: Level) -> Vec<u8> {
    let tap = scripted(answers);
    // The verdict is of no interest here: the code goes to both decoders.
    let _ = read_code(&mut Code::tapped(&[], &tap), boundary, level, Scale::plain(BITS), [0; 3]);
    encode(tap.into_inner().log.into_iter().map(|(part, _)| part))
}

/// A level's refinement in one atom.
pub struct Forged {
    pub bytes: Vec<u8>,
    pub vertices: u64,
    pub triangles: u64,
    /// What its reader does, and how that ends.
    pub steps: Vec<Step>,
    pub verdict: Result<()>,
}

/// From this mesh, to a level of this scale, a code in which a reader finds these answers, then what `Tap::script` says:
/// for at most so many operations, and no more than there turn out to be.
pub fn refinement(mesh: impl Fn() -> Mesh, answers: &[u64], most: u64, scale: Scale) -> Forged {
    let pass = |items, triangles| {
        let (mut mesh, tap) = (mesh(), scripted(answers));
        let before = (mesh.points.len(), mesh.third.len());
        let atom = Atom { kind: REFINEMENT, level: 0, items, triangles, length: 0, sum: 0, bytes: vec![] };
        let models = &mut Models::fresh(false);
        let (steps, verdict) = trace_pass(&mut mesh, vec![&atom], scale, models, Some(&tap));
        let bytes = encode(tap.into_inner().log.into_iter().map(|(part, _)| part));
        let added = ((mesh.points.len() - before.0) as u64, (mesh.third.len() - before.1) as u64 / 3);
        (added, Forged { bytes, vertices: items, triangles, steps, verdict })
    };
    // Room enough; then just what was met, and the operation that was refused.
    let ((vertices, triangles), first) = pass(most, 2 * most);
    let refused = matches!(&first.verdict, Err(why) if !why.starts_with("§5.2"));
    let (vertices, triangles) = if refused { (vertices + 1, triangles + 2) } else { (vertices, triangles) };
    pass(vertices.max(1), triangles.max(1)).1
}

/// The answers to the questions about a coordinate, for another value of `found`, whatever it leads to.
pub fn coordinate(read: &Coordinate, found: i64) -> Vec<u64> {
    let high = (found - read.origin) >> read.shift;
    let mut answers = match high {
        -7..=6 => vec![(high + 8) as u64],
        ..-7 => [vec![0], number((-8 - high) as u64)].concat(),
        7.. => [vec![15], number((high - 7) as u64)].concat(),
    };
    if read.shift > 0 {
        answers.push((found - read.origin - (high << read.shift)) as u64);
    }
    answers
}

/// The decisions of a number (§6.3).
pub fn number(value: u64) -> Vec<u64> {
    let length = bit_length(value as i64);
    let below = (0..length.saturating_sub(1)).rev().map(|i| value >> i & 1);
    std::iter::repeat_n(1, length).chain([0]).chain(below).collect()
}

pub fn scripted(answers: &[u64]) -> RefCell<Tap> {
    RefCell::new(Tap { script: Some(VecDeque::from(answers.to_vec())), ..Tap::default() })
}

/// The inverse of §6.1: the smallest number in the last range, without the zeros at its end.
pub fn encode(parts: impl IntoIterator<Item = Part>) -> Vec<u8> {
    // The start of the range is `bytes` followed by the 32 bits of `low`.
    let (mut bytes, mut low, mut range) = (Vec::new(), 0u64, 0xFFFF_FFFFu64);
    for part in parts {
        low += (range / part.parts) * part.start;
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
    let mut model = Symbol::bell(300, 0);
    let tap = scripted(&(0..3000u64).map(|i| i * 7 % 67).collect::<Vec<_>>());
    let read = |code: &mut Code, model: &mut Symbol, i: u64| match i % 3 {
        0 => u64::from(code.decide(32 + i * i * 7919 % 65473).unwrap()),
        1 => code.bits(1 + (i % 16) as u32).unwrap(),
        _ => code.symbol(model).unwrap() as u64,
    };
    let mut code = Code::tapped(&[], &tap);
    let written: Vec<u64> = (0..3000).map(|i| read(&mut code, &mut model, i)).collect();
    let bytes = encode(tap.take().log.into_iter().map(|(part, _)| part));

    let mut model = Symbol::bell(300, 0);
    let mut code = Code::start(&bytes);
    assert_eq!((0..3000).map(|i| read(&mut code, &mut model, i)).collect::<Vec<_>>(), written);
    code.end().unwrap();
    assert!((0..16).all(|s| written.contains(&s)));
}
