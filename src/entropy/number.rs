//! Integers as binary decisions: length, then leading bits under models, then even bits (spec §6.3).

use super::model::Bit;
use super::{BitCoder, CodingError};

/// Models for unsigned numbers below 2^32 (and signed ones within ±2^31) of one kind.
///
/// A number n is coded by the bit length L of n (0 for 0) in unary, then its bits below the leading one: the highest two of
/// them under models, the rest at an even chance.
#[derive(Clone, Debug)]
pub struct NumberModel {
    length: [Bit; 33],
    second: [Bit; 33],
    third: [[Bit; 2]; 33],
    sign: Bit,
}

impl Default for NumberModel {
    fn default() -> Self {
        Self { length: [Bit::NEW; 33], second: [Bit::NEW; 33], third: [[Bit::NEW; 2]; 33], sign: Bit::NEW }
    }
}

impl NumberModel {
    /// Codes an unsigned number.
    ///
    /// # Errors
    /// [`CodingError::Number`] where the length read is more than 32 bits.
    #[inline]
    pub fn unsigned<C: BitCoder>(
        &mut self,
        coder: &mut C,
        known: impl FnOnce() -> u32,
    ) -> Result<u32, CodingError> {
        let n = if C::ENCODES { known() } else { 0 };
        let target = 32 - n.leading_zeros();
        let mut length = 0;
        while coder.bit(&mut self.length[length as usize], || length < target) {
            length += 1;
            if length > 32 {
                return Err(CodingError::Number);
            }
        }
        if length < 2 {
            return Ok(length);
        }
        let mut value = 1u32;
        let mut push = |bit: bool| {
            value = value << 1 | u32::from(bit);
            bit
        };
        let second = push(coder.bit(&mut self.second[length as usize], || n >> (length - 2) & 1 == 1));
        if length > 2 {
            let model = &mut self.third[length as usize][usize::from(second)];
            push(coder.bit(model, || n >> (length - 3) & 1 == 1));
        }
        for k in (0..length.saturating_sub(3)).rev() {
            push(coder.even(|| n >> k & 1 == 1));
        }
        Ok(value)
    }

    /// Codes a signed number: its magnitude, then, unless it is 0, its sign.
    ///
    /// # Errors
    /// [`CodingError::Number`] where the magnitude is 2^31 or more.
    #[inline]
    pub fn signed<C: BitCoder>(
        &mut self,
        coder: &mut C,
        known: impl Fn() -> i32,
    ) -> Result<i32, CodingError> {
        let magnitude = self.unsigned(coder, || known().unsigned_abs())?;
        if magnitude > i32::MAX as u32 {
            return Err(CodingError::Number);
        }
        let negative = magnitude > 0 && coder.bit(&mut self.sign, || known() < 0);
        Ok(if negative { -(magnitude as i32) } else { magnitude as i32 })
    }
}

/// Codes a number below `count`, which is at least 1, each at the same chance: 16 bits at a time, the highest first.
///
/// # Errors
/// [`CodingError::Number`] where the number read is `count` or more.
pub fn uniform<C: BitCoder>(
    coder: &mut C,
    count: u64,
    known: impl FnOnce() -> u64,
) -> Result<u64, CodingError> {
    let n = if C::ENCODES { known() } else { 0 };
    let most = count - 1;
    let mut shift = (64 - most.leading_zeros()).saturating_sub(16);
    let mut value = u64::from(coder.below((most >> shift) as u32 + 1, || (n >> shift) as u32));
    while shift > 0 {
        let bits = shift.min(16);
        shift -= bits;
        let mask = (1u64 << bits) - 1;
        value = value << bits | u64::from(coder.bits(bits, || (n >> shift & mask) as u32));
    }
    if value > most { Err(CodingError::Number) } else { Ok(value) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::entropy::{RangeDecoder, RangeEncoder};
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn numbers_come_back(numbers in prop::collection::vec(
            prop_oneof![any::<i32>().prop_filter("", |&n| n != i32::MIN), -3..4i32, -1000..1000i32], 0..200)) {
            let mut encoder = RangeEncoder::default();
            let mut model = NumberModel::default();
            for &n in &numbers {
                model.signed(&mut encoder, || n).unwrap();
                model.unsigned(&mut encoder, || n as u32).unwrap();
            }
            let bytes = encoder.finish();
            let mut decoder = RangeDecoder::new(&bytes);
            let mut model = NumberModel::default();
            for &n in &numbers {
                prop_assert_eq!(model.signed(&mut decoder, || 0).unwrap(), n);
                prop_assert_eq!(model.unsigned(&mut decoder, || 0).unwrap(), n as u32);
            }
            decoder.finish().unwrap();
        }
    }

    proptest! {
        #[test]
        fn uniform_numbers_come_back(items in prop::collection::vec((any::<u64>(), 0..64u32, any::<u64>()), 0..100)) {
            let items: Vec<_> = items.into_iter().map(|(n, shift, x)| ((n >> shift).max(1), x)).collect();
            let mut encoder = RangeEncoder::default();
            for &(count, x) in &items {
                uniform(&mut encoder, count, || x % count).unwrap();
            }
            let bits: f64 = items.iter().map(|&(count, _)| (count as f64).log2()).sum();
            prop_assert!(encoder.bits() < 33.0 + bits * 1.001 + items.len() as f64 * 0.01, "what it must cost");
            let bytes = encoder.finish();
            let mut decoder = RangeDecoder::new(&bytes);
            for &(count, x) in &items {
                prop_assert_eq!(uniform(&mut decoder, count, || 0).unwrap(), x % count);
            }
            decoder.finish().unwrap();
        }
    }

    #[test]
    fn a_number_beyond_the_last_is_refused() {
        // 2^16 + 1 numbers by their high parts, two each: the last part has one number only.
        let count = (1 << 16) + 1;
        let mut encoder = RangeEncoder::default();
        encoder.below((1 << 15) + 1, || 1 << 15);
        BitCoder::bits(&mut encoder, 1, || 1);
        let bytes = encoder.finish();
        assert_eq!(uniform(&mut RangeDecoder::new(&bytes), count, || 0), Err(CodingError::Number));
    }

    #[test]
    fn an_endless_length_is_refused() {
        let bytes = [0xFF; 200];
        let mut decoder = RangeDecoder::new(&bytes);
        let mut model = NumberModel::default();
        let result = (0..100).try_for_each(|_| model.unsigned(&mut decoder, || 0).map(|_| ()));
        assert_eq!(result, Err(CodingError::Number));
    }
}
