//! Values that are those of a neighbour, and numbers that stood behind the same ones before (spec §13.5).

use super::column::Column;
use super::ring::Ring;
use crate::entropy::{Bit, BitCoder};

/// Most different values of neighbours.
const DIFFERENT: usize = 8;
/// Places of numbers that are remembered.
const PLACES_BITS: u32 = 12;
/// Classes of how far a number remembered is from the one expected.
const DISTANCES: usize = 6;
/// Integers of a value that are told apart, the first not counted.
const INTEGERS: usize = 3;
/// How often in a row a number was right that are told apart.
const HITS: usize = 8;

/// Models of whether a value is that of a neighbour, and of which. For what is often the same round about, and else may be anything:
/// joints, flags, colours by parts.
#[derive(Clone, Debug)]
pub(super) struct Neighbours {
    /// By how many values they have, and how large residuals are there.
    is_one: [[Bit; 4]; DIFFERENT],
    which: [[Bit; DIFFERENT]; DIFFERENT],
}

impl Neighbours {
    pub(super) fn new() -> Self {
        Self { is_one: [[Bit::NEW; 4]; DIFFERENT], which: [[Bit::NEW; DIFFERENT]; DIFFERENT] }
    }

    /// Codes whether a value is one of those beside it, and which wedge has it. `round` tells how large residuals are there.
    pub(super) fn code<C: BitCoder>(
        &mut self,
        coder: &mut C,
        column: &Column,
        ring: &Ring,
        round: usize,
        truth: &[i32],
    ) -> Option<u32> {
        let (mut wedges, mut count) = ([0; DIFFERENT], 0);
        for wedge in ring.wedges() {
            let value = column.there(wedge);
            if count < DIFFERENT && wedges[..count].iter().all(|&other| column.there(other) != value) {
                wedges[count] = wedge;
                count += 1;
            }
        }
        let last = count.checked_sub(1)?;
        let wedges = &wedges[..count];
        let known = || wedges.iter().position(|&wedge| column.value(wedge) == Some(truth));
        let place = if C::ENCODES { known() } else { None };
        if !coder.bit(&mut self.is_one[last][round.min(3)], || place.is_some()) {
            return None;
        }
        let mut at = 0;
        while at < last && !coder.bit(&mut self.which[last][at], || place == Some(at)) {
            at += 1;
        }
        Some(wedges[at])
    }
}

/// Remembers for the integers of a value what stood behind the same ones before it. For colours of few kinds, such as those of a scale:
/// one of them tells most of the next.
#[derive(Clone, Debug)]
pub(super) struct Recall {
    /// The number, and how often in a row it was right; by a hash of the integers before it.
    places: Vec<Option<(i32, u8)>>,
    hits: [[[Bit; HITS]; DISTANCES]; INTEGERS],
}

impl Recall {
    /// Bytes that a table takes, which is made when it is first asked.
    pub(super) const BYTES: usize = size_of::<Self>() + (size_of::<Option<(i32, u8)>>() << PLACES_BITS);

    pub(super) fn new() -> Self {
        Self { places: Vec::new(), hits: [[[Bit::NEW; HITS]; DISTANCES]; INTEGERS] }
    }

    /// Codes whether the integer behind those of `before`, one at least, is what stood there last; and which it is, if so.
    pub(super) fn code<C: BitCoder>(
        &mut self,
        coder: &mut C,
        before: &[i32],
        expected: i32,
        truth: i32,
    ) -> Option<i32> {
        let &mut (number, times) = self.place(before).as_mut()?;
        let off = 32 - number.wrapping_sub(expected).unsigned_abs().leading_zeros();
        let distance = (off.min(9) as usize).div_ceil(2);
        let models = &mut self.hits[before.len().min(INTEGERS) - 1][distance];
        let is_it = coder.bit(&mut models[usize::from(times).min(HITS - 1)], || truth == number);
        if is_it {
            *self.place(before) = Some((number, times.saturating_add(1)));
        }
        is_it.then_some(number)
    }

    /// Another integer stands there.
    pub(super) fn learn(&mut self, before: &[i32], number: i32) {
        *self.place(before) = Some((number, 0));
    }

    fn place(&mut self, before: &[i32]) -> &mut Option<(i32, u8)> {
        if self.places.is_empty() {
            self.places.resize(1 << PLACES_BITS, None);
        }
        let mut hash = before.len() as u32;
        for &number in before {
            hash = (hash ^ number as u32).wrapping_mul(0x9E37_79B1);
            hash ^= hash >> 15;
        }
        &mut self.places[(hash >> (32 - PLACES_BITS)) as usize]
    }
}
