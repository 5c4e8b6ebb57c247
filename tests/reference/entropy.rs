//! Chapters 6.1 to 6.3: range coder, binary models, numbers.

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

/// What a step leaves of the range: from `start` to `end`, in so many equal parts of it, or all from `start` on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Part {
    pub parts: u64,
    pub start: u64,
    pub end: Option<u64>,
}

impl Part {
    /// How much of a range it is.
    pub fn width(&self, range: u64) -> u64 {
        let unit = range / self.parts;
        self.end.map_or(range - unit * self.start, |end| unit * (end - self.start))
    }
}

/// For forged codes: steps made, and answers to give in place of those of the bytes.
#[derive(Default)]
pub struct Tap {
    /// What was left of the range, and what that meant: a decision, a number of `bits`, or a symbol.
    pub log: Vec<(Part, u64)>,
    /// What is to be answered, then no to decisions, 0 to `bits`, and the symbol in the middle.
    pub script: Option<VecDeque<u64>>,
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
        m.learn(bit);
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
        let bit = self.answer(u64::from(self.value(1 << 16) >= zero), 0) > 0;
        let part = if bit { (zero, None) } else { (0, Some(zero)) };
        self.take(Part { parts: 1 << 16, start: part.0, end: part.1 }, u64::from(bit))?;
        Ok(bit)
    }

    /// A number below n, which is at most 2^16.
    pub fn below(&mut self, n: u64) -> Result<u64> {
        let value = self.answer(self.value(n), 0).min(n - 1);
        self.take(Part { parts: n, start: value, end: (value < n - 1).then_some(value + 1) }, value)?;
        Ok(value)
    }

    /// A number of n bits.
    pub fn bits(&mut self, n: u32) -> Result<u64> {
        self.below(1 << n)
    }

    /// A number below n (§6.3).
    pub fn uniform(&mut self, n: u64) -> Result<u64> {
        let mut s = 0;
        while (n - 1) >> s >= 1 << 16 {
            s += 1;
        }
        let mut value = u128::from(self.below(((n - 1) >> s) + 1)?);
        while s > 0 {
            let k = s.min(16);
            s -= k;
            value = (value << k) + u128::from(self.bits(k)?);
        }
        if value >= u128::from(n) { refuse("6.3: a number beyond the last") } else { Ok(value as u64) }
    }

    /// The place of the code in the range, in so many equal parts of it.
    pub fn value(&self, parts: u64) -> u64 {
        (self.code / (self.range / parts)).min(parts - 1)
    }

    /// The answer of the script, if there is one.
    pub fn answer(&self, found: u64, otherwise: u64) -> u64 {
        let Some(tap) = self.tap else { return found };
        let script = &mut tap.borrow_mut().script;
        script.as_mut().map_or(found, |script| script.pop_front().unwrap_or(otherwise))
    }

    /// Goes on in a part of the range.
    pub fn take(&mut self, part: Part, answer: u64) -> Result<()> {
        if let Some(tap) = self.tap {
            let Tap { log, script } = &mut *tap.borrow_mut();
            log.push((part, answer));
            if script.is_some() {
                return Ok(());
            }
        }
        let unit = self.range / part.parts;
        self.code -= unit * part.start;
        self.range = part.width(self.range);
        while self.range < 1 << 24 {
            self.range *= 256;
            self.code = (self.code * 256 + self.byte()) % (1 << 32);
        }
        if self.asked > self.bytes.len() + 32 {
            return refuse("6.1: the code is too short");
        }
        Ok(())
    }

    /// Bytes asked for.
    pub fn asked(&self) -> usize {
        self.asked
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

    /// One that is known beforehand, as if it had learnt from six decisions.
    pub fn known(zero: i64) -> Self {
        Self::known_from(zero, 6)
    }

    /// One that is known as if learnt from so many.
    pub fn known_from(zero: i64, count: i64) -> Self {
        Self { zero, count }
    }

    pub fn zero(&self) -> i64 {
        self.zero
    }

    pub fn learn(&mut self, bit: bool) {
        self.learn_up_to(bit, 60);
    }

    /// The same, but it counts up to `most`.
    pub fn learn_up_to(&mut self, bit: bool, most: i64) {
        let target = if bit { 32 } else { 65504 };
        let rate = (131_073 + self.count) / (2 * self.count + 3);
        self.zero += ((target - self.zero) * (rate >> 1)) >> 15;
        self.count = (self.count + 1).min(most);
    }
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
