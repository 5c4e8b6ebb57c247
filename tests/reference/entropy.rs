//! Chapter 6: range coder, binary models, numbers.

use std::cell::RefCell;
use std::collections::VecDeque;

use super::container::{Result, refuse};

/// One code (§6.1).
pub struct Code<'a> {
    bytes: &'a [u8],
    asked: usize,
    range: u64,
    code: u64,
    tap: Option<&'a RefCell<Tap>>,
}

/// For forged codes: decisions made, and decisions to make in place of those of the bytes.
#[derive(Default)]
pub struct Tap {
    /// What `decide` was asked and answered.
    pub log: Vec<(u64, bool)>,
    /// What it is to answer, then 0.
    pub script: Option<VecDeque<bool>>,
}

impl<'a> Code<'a> {
    pub fn start(bytes: &'a [u8]) -> Self {
        let mut code = Self { bytes, asked: 0, range: 0xFFFF_FFFF, code: 0, tap: None };
        for _ in 0..4 {
            code.code = code.code * 256 + code.byte();
        }
        code
    }

    /// A code whose decisions are tapped.
    pub fn tapped(bytes: &'a [u8], tap: &'a RefCell<Tap>) -> Self {
        Self { tap: Some(tap), ..Self::start(bytes) }
    }

    /// A decision under a model (§6.2).
    pub fn read(&mut self, m: &mut Model) -> Result<bool> {
        let bit = self.decide(m.zero as u64)?;
        let target = if bit { 32 } else { 65504 };
        let rate = (131_073 + m.count) / (2 * m.count + 3);
        m.zero += ((target - m.zero) * (rate >> 1)) >> 15;
        m.count = (m.count + 1).min(60);
        Ok(bit)
    }

    /// A decision at an even chance.
    pub fn even(&mut self) -> Result<bool> {
        self.decide(32768)
    }

    /// A number, 0 to 2^32 - 1 (§6.3).
    pub fn unsigned(&mut self, n: &mut Number) -> Result<u64> {
        let mut length = 0;
        while self.read(&mut n.length[length])? {
            length += 1;
            if length > 32 {
                return refuse("6.3: a number of more than 32 bits");
            }
        }
        if length < 2 {
            return Ok(length as u64);
        }
        let b = self.read(&mut n.second[length])?;
        let mut value = 2 + u64::from(b);
        if length > 2 {
            value = 2 * value + u64::from(self.read(&mut n.third[length][usize::from(b)])?);
        }
        for _ in 3..length {
            value = 2 * value + u64::from(self.even()?);
        }
        Ok(value)
    }

    /// A number, -(2^31 - 1) to 2^31 - 1 (§6.3).
    pub fn signed(&mut self, n: &mut Number) -> Result<i64> {
        let m = self.unsigned(n)? as i64;
        if m >= 1 << 31 {
            return refuse("6.3: a signed number of more than 31 bits");
        }
        Ok(if m > 0 && self.read(&mut n.sign)? { -m } else { m })
    }

    /// Says that the last decision has been read.
    pub fn end(self) -> Result<()> {
        if self.asked < self.bytes.len() { refuse("6.1: bytes are left over") } else { Ok(()) }
    }

    pub fn decide(&mut self, zero: u64) -> Result<bool> {
        let bound = (self.range >> 16) * zero;
        let mut bit = self.code >= bound;
        if let Some(tap) = self.tap {
            let Tap { log, script } = &mut *tap.borrow_mut();
            bit = script.as_mut().map_or(bit, |script| script.pop_front().unwrap_or(false));
            log.push((zero, bit));
            if script.is_some() {
                return Ok(bit);
            }
        }
        if bit {
            self.range -= bound;
            self.code -= bound;
        } else {
            self.range = bound;
        }
        while self.range < 1 << 24 {
            self.range *= 256;
            self.code = (self.code * 256 + self.byte()) % (1 << 32);
        }
        if self.asked > self.bytes.len() + 32 {
            return refuse("6.1: the code is too short");
        }
        Ok(bit)
    }

    fn byte(&mut self) -> u64 {
        self.asked += 1;
        self.bytes.get(self.asked - 1).map_or(0, |&b| u64::from(b))
    }
}

/// A binary model (§6.2).
#[derive(Clone, Copy)]
pub struct Model {
    zero: i64,
    count: i64,
}

impl Model {
    pub const FRESH: Self = Self { zero: 32768, count: 0 };
}

/// A number model (§6.3).
#[derive(Clone)]
pub struct Number {
    length: [Model; 33],
    second: [Model; 33],
    third: [[Model; 2]; 33],
    sign: Model,
}

impl Number {
    pub const FRESH: Self = Self {
        length: [Model::FRESH; 33],
        second: [Model::FRESH; 33],
        third: [[Model::FRESH; 2]; 33],
        sign: Model::FRESH,
    };
}

#[test]
fn the_examples_of_the_chapter() {
    let mut m = Model::FRESH;
    let mut code = Code::start(&[0x5C, 0x1B]);
    let bits: Vec<_> = (0..9).map(|_| u8::from(code.read(&mut m).unwrap())).collect();
    assert_eq!(bits, [0, 0, 0, 1, 0, 0, 0, 1, 1]);
    assert_eq!(code.asked, 5);
    code.end().unwrap();

    let mut n = Number::FRESH;
    let mut code = Code::start(&[0xF0, 0x24, 0x3C]);
    let numbers: Vec<_> = (0..3).map(|_| code.signed(&mut n).unwrap()).collect();
    assert_eq!(numbers, [8, -1, 1]);
    code.end().unwrap();
}
