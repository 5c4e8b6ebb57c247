//! Codes for any decisions, sensible or not.

use std::cell::RefCell;

use super::container::Level;
use super::entropy::{Code, Tap};
use super::keyframe::read_code;

/// Lattice bits of the levels made here.
const BITS: u32 = 8;

/// The decisions in the code of a sound base or keyframe.
pub fn decisions(code: &[u8], boundary: u64, level: Level) -> Vec<bool> {
    let tap = RefCell::default();
    read_code(&mut Code::tapped(code, &tap), boundary, level, BITS).expect("a sound code");
    tap.into_inner().log.into_iter().map(|(_, bit)| bit).collect()
}

/// A code in which a reader of a base or keyframe finds these decisions, then zeros, as far as it reads.
pub fn code(decisions: &[bool], boundary: u64, level: Level) -> Vec<u8> {
    let tap = RefCell::new(Tap { script: Some(decisions.iter().copied().collect()), ..Tap::default() });
    // The verdict is of no interest here: the code goes to both decoders.
    let _ = read_code(&mut Code::tapped(&[], &tap), boundary, level, BITS);
    encode(&tap.into_inner().log)
}

/// The inverse of §6.1: the smallest number in the last range, without the zeros at its end.
pub fn encode(decisions: &[(u64, bool)]) -> Vec<u8> {
    // The start of the range is `bytes` followed by the 32 bits of `low`.
    let (mut bytes, mut low, mut range) = (Vec::new(), 0u64, 0xFFFF_FFFFu64);
    for &(zero, bit) in decisions {
        let bound = (range >> 16) * zero;
        if bit {
            low += bound;
            range -= bound;
        } else {
            range = bound;
        }
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
fn decisions_come_back() {
    let decisions: Vec<(u64, bool)> =
        (0..2000u64).map(|i| (32 + i * i * 7919 % 65473, i * i % 7 < 3)).collect();
    let bytes = encode(&decisions);
    let tap = RefCell::default();
    let mut code = Code::tapped(&bytes, &tap);
    for &(zero, bit) in &decisions {
        assert_eq!(code.decide(zero), Ok(bit));
    }
    code.end().unwrap();
}
