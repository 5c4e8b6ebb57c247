//! Adaptive models of binary decisions, in integers (spec §6.2).

use std::hint::select_unpredictable;

/// The probability that a decision is 0, in units of 2^-16, learning fast at first and slowly later.
///
/// Invariant: `zero` stays within 32 ..= 65504, so that neither side of a decision ever has an empty interval.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bit {
    zero: u16,
    count: u8,
}

/// After this many decisions the rate of learning stays at 1 / (LIMIT + 1.5), near enough.
const LIMIT: u8 = 60;

/// 65536 / (n + 1.5), rounded to nearest: the weight of a decision after n others.
const RATES: [u16; 64] = {
    let mut rates = [0; 64];
    let mut n = 0;
    while n <= LIMIT as usize {
        let twice = 2 * n as u32 + 3;
        rates[n] = ((2 * 65536 + twice / 2) / twice) as u16;
        n += 1;
    }
    rates
};

// A count is masked where it is looked up: it is at most LIMIT, the mask changes nothing, and spares a check.
const _: () = assert!((LIMIT as usize) < RATES.len() && RATES.len() == 64);

impl Bit {
    /// An even chance.
    pub const NEW: Self = Self { zero: 1 << 15, count: 0 };

    /// What is known beforehand: the probability of 0 in units of 2^-16, within 32 ..= 65504, as if learnt from `count` decisions,
    /// of which there are at most 60.
    pub const fn known(zero: u16, count: u8) -> Self {
        debug_assert!(zero >= 32 && zero <= 65504 && count <= LIMIT);
        Self { zero, count }
    }

    /// Probability of 0 in units of 2^-16, 32 ..= 65504.
    #[inline]
    pub const fn zero(self) -> u32 {
        self.zero as u32
    }

    /// What a decision costs, in units of 1/256 bit, nearly: the logarithm by leading zeros and the bits behind.
    pub fn cost(self, bit: bool) -> u32 {
        let chance = if bit { (1 << 16) - self.zero() } else { self.zero() };
        let exponent = 31 - chance.leading_zeros();
        (16 << 8) - (exponent << 8) - ((chance << (31 - exponent)) >> 23 & 255)
    }

    /// Learns a decision.
    #[inline]
    pub fn learn(&mut self, bit: bool) {
        self.learn_as_one_of::<LIMIT>(bit);
    }

    /// Learns a decision, and remembers about the last `MOST`, which are at most 60.
    #[inline]
    pub fn learn_as_one_of<const MOST: u8>(&mut self, bit: bool) {
        const { assert!(MOST <= LIMIT) };
        let rate = i32::from(RATES[self.count as usize & 63]);
        let target = select_unpredictable(bit, 32, 65504);
        let zero = i32::from(self.zero);
        self.zero = (zero + (((target - zero) * (rate >> 1)) >> 15)) as u16;
        self.count += u8::from(self.count < MOST);
    }
}

impl Default for Bit {
    fn default() -> Self {
        Self::NEW
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bounds_hold_whatever_is_learnt() {
        for bits in [[true; 4], [false; 4], [true, false, false, false], [false, true, true, true]] {
            let mut model = Bit::NEW;
            for k in 0..10_000 {
                model.learn(bits[k % 4]);
                assert!((32..=65504).contains(&model.zero()), "{model:?}");
            }
        }
    }

    #[test]
    fn costs_are_logarithms() {
        for (zero, zero_costs, one_costs) in [(32768, 256, 256), (49152, 128, 512), (32, 2816, 1)] {
            let model = Bit::known(zero, 0);
            assert_eq!([model.cost(false), model.cost(true)], [zero_costs, one_costs]);
        }
    }

    #[test]
    fn a_fair_share_is_learnt() {
        let mut model = Bit::NEW;
        for k in 0..4000 {
            model.learn(k % 4 == 0);
        }
        assert!((model.zero() as i32 - 49152).abs() < 2500, "{model:?}");
    }
}
