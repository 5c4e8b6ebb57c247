//! Logistic mixing of binary models, in integers (Mahoney 2005, PAQ; spec §6.5).
//!
//! Several models, each of another context, say how likely a decision is. What they say is stretched to ln(p / (1 - p)), summed with
//! weights, and squashed again; the weights learn which of the models is to be trusted.

use super::BitCoder;
use super::model::Bit;

/// 65536 / (1 + e^-x), rounded, for x from -8 to 8 in steps of a half.
const CURVE: [u16; 33] = [
    22, 36, 60, 98, 162, 267, 439, 720, 1179, 1921, 3108, 4971, 7812, 11955, 17625, 24743, 32768, 40793,
    47911, 53581, 57724, 60565, 62428, 63615, 64357, 64816, 65097, 65269, 65374, 65438, 65476, 65500, 65514,
];

/// Stretched probabilities are -LIMIT to LIMIT - 1, in units of 1/256.
const LIMIT: i32 = 2048;

/// By stretched probability + LIMIT: the probability, in units of 2^-16.
static SQUASHED: [u16; 2 * LIMIT as usize] = SQUASHED_TABLE;

const SQUASHED_TABLE: [u16; 2 * LIMIT as usize] = {
    let mut table = [0; 2 * LIMIT as usize];
    let mut n = 0;
    while n < table.len() {
        let (place, part) = (n >> 7, (n & 127) as u32);
        let value = (CURVE[place] as u32 * (128 - part) + CURVE[place + 1] as u32 * part + 64) >> 7;
        // What a model may say: no more than that.
        table[n] = if value < 32 {
            32
        } else if value > 65504 {
            65504
        } else {
            value as u16
        };
        n += 1;
    }
    table
};

/// By the upper twelve bits of a probability: the least stretched one that squashes to the middle of those or more.
static STRETCHED: [i16; 4096] = {
    let mut table = [0; 4096];
    let mut n = 0;
    let mut x = 0;
    while n < table.len() {
        while x < 2 * LIMIT - 1 && (SQUASHED_TABLE[x as usize] as usize) < 16 * n + 8 {
            x += 1;
        }
        table[n] = (x - LIMIT) as i16;
        n += 1;
    }
    table
};

#[inline]
fn stretch(model: Bit) -> i32 {
    i32::from(STRETCHED[model.zero() as usize >> 4 & 4095])
}

/// The probability of a stretched one, `x` in units of 1/256; beyond the table's ends that of the end.
pub const fn squash(x: i32) -> u16 {
    let x = if x < -LIMIT {
        -LIMIT
    } else if x > LIMIT - 1 {
        LIMIT - 1
    } else {
        x
    };
    SQUASHED_TABLE[(x + LIMIT) as usize]
}

/// How far each of some models is trusted.
///
/// Invariant: weights stay within ±[`HEAVIEST`], so that sums of up to four products stay within 32 bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Mixer<const N: usize> {
    /// In units of 2^-16.
    weights: [i32; N],
}

const HEAVIEST: i32 = (1 << 18) - 1;
/// An error of a whole and a stretched probability of 1 change a weight by 2^-RATE * 2^8: 1/64.
const RATE: u32 = 14;

impl<const N: usize> Mixer<N> {
    /// One with these weights, in units of 2^-16.
    pub const fn new(weights: [i32; N]) -> Self {
        const { assert!(N <= 4) };
        Self { weights }
    }

    /// Codes a decision under all of `models`, which learn it.
    #[inline]
    pub fn code<C: BitCoder>(
        &mut self,
        coder: &mut C,
        models: [&mut Bit; N],
        known: impl FnOnce() -> bool,
    ) -> bool {
        let stretched: [i32; N] = std::array::from_fn(|i| stretch(*models[i]));
        let sum: i32 = (0..N).map(|i| self.weights[i] * stretched[i]).sum();
        let mixed = (sum >> 16).clamp(-LIMIT, LIMIT - 1);
        let zero = i32::from(SQUASHED[(mixed + LIMIT) as usize & (2 * LIMIT as usize - 1)]);
        let bit = coder.decide(zero as u32, known);
        let error = (i32::from(!bit) << 16) - zero;
        for (weight, x) in self.weights.iter_mut().zip(stretched) {
            *weight = (*weight + ((error * x + (1 << (RATE - 1))) >> RATE)).clamp(-HEAVIEST, HEAVIEST);
        }
        for model in models {
            model.learn(bit);
        }
        bit
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::entropy::{RangeDecoder, RangeEncoder};
    use proptest::prelude::*;

    #[test]
    fn the_curve_is_the_logistic_function() {
        for (i, &value) in CURVE.iter().enumerate() {
            let exact = 65536.0 / (1.0 + (-(i as f64 - 16.0) / 2.0).exp());
            assert_eq!(f64::from(value), exact.round(), "{i}");
        }
    }

    #[test]
    fn stretching_undoes_squashing() {
        for zero in (32..=65504u32).step_by(7) {
            let model = Bit::known(zero as u16, 0);
            let back = i32::from(squash(stretch(model)));
            // A step of the stretched scale is up to 64 wide.
            assert!((back - zero as i32).abs() <= 72, "{zero} became {back}");
        }
        assert_eq!([squash(-9999), squash(0), squash(9999)], [32, 32768, 65504]);
        assert!(STRETCHED.is_sorted() && SQUASHED.is_sorted());
    }

    proptest! {
        #[test]
        fn decisions_come_back(items in prop::collection::vec((0..3usize, 0..5usize, any::<bool>()), 0..2000)) {
            let fresh = || ([Bit::NEW; 3], [Bit::NEW; 5], Mixer::new([40_000, 40_000]));
            let mut encoder = RangeEncoder::default();
            let (mut a, mut b, mut mixer) = fresh();
            for &(i, j, bit) in &items {
                mixer.code(&mut encoder, [&mut a[i], &mut b[j]], || bit);
            }
            let bytes = encoder.finish();
            let mut decoder = RangeDecoder::new(&bytes);
            let (mut a, mut b, mut mixer) = fresh();
            for &(i, j, bit) in &items {
                prop_assert_eq!(mixer.code(&mut decoder, [&mut a[i], &mut b[j]], || unreachable!()), bit);
            }
            decoder.finish().unwrap();
        }
    }

    /// Whatever is learnt, weights stay in bounds: a model that is always wrong, one that is always right, both turned round again
    /// and again.
    #[test]
    fn weights_stay_in_bounds() {
        let mut mixer = Mixer::new([0; 4]);
        let mut encoder = RangeEncoder::default();
        for k in 0..200_000u32 {
            let sure = |zero: u16| Bit::known(zero, 0);
            let mut models = [sure(32), sure(65504), sure(32), sure(65504)];
            let [a, b, c, d] = &mut models;
            mixer.code(&mut encoder, [a, b, c, d], || k / 50_000 % 2 == 0);
            assert!(mixer.weights.iter().all(|w| w.abs() <= HEAVIEST));
        }
    }

    /// Of two models one knows and the other does not: the mix is nearly as good as the one that knows, whichever it is.
    #[test]
    fn the_better_model_is_trusted() {
        for better in [0, 1] {
            let mut encoder = RangeEncoder::default();
            let mut mixer = Mixer::new([40_000; 2]);
            let mut models = [[Bit::NEW; 2]; 2];
            for k in 0..4000usize {
                let bit = k % 7 < 3;
                let mut contexts = [k % 2; 2];
                contexts[better] = usize::from(bit);
                let [first, second] = &mut models;
                mixer.code(&mut encoder, [&mut first[contexts[0]], &mut second[contexts[1]]], || bit);
            }
            assert!(encoder.bits() < 200.0, "{}", encoder.bits());
        }
    }
}
