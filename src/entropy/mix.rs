//! Logistic mixing of binary models, in integers (Mahoney 2005, PAQ; spec §6.5).
//!
//! Several models, each of another context, say how likely a decision is. What they say is stretched to ln(p / (1 - p)), summed with
//! weights, and squashed again; the weights learn which of the models is to be trusted. There are three sets of weights for each decision, which
//! are averaged; and what was thought so likely before has turned out more or less so.

use super::BitCoder;
use super::model::Bit;

/// 65536 / (1 + e^-x), rounded, for x from -8 to 8 in steps of a half.
const CURVE: [u16; 33] = [
    22, 36, 60, 98, 162, 267, 439, 720, 1179, 1921, 3108, 4971, 7812, 11955, 17625, 24743, 32768, 40793,
    47911, 53581, 57724, 60565, 62428, 63615, 64357, 64816, 65097, 65269, 65374, 65438, 65476, 65500, 65514,
];

/// Stretched probabilities are -LIMIT to LIMIT - 1, in units of 1/256.
const LIMIT: i32 = 2048;

/// How many stretched probabilities there are.
const PLACES: usize = 2 * LIMIT as usize;

#[inline]
fn stretch(model: Bit) -> i32 {
    i32::from(tables::stretched(model.zero() as usize >> 4 & 4095))
}

/// The probability of a stretched one, `x` in units of 1/256; beyond the table's ends that of the end.
#[inline]
fn squash(x: i32) -> u16 {
    tables::squashed(place_of(x))
}

/// The same, without the table.
pub const fn curve(x: i32) -> u16 {
    squashed(place_of(x))
}

const fn place_of(x: i32) -> usize {
    let x = if x < -LIMIT {
        -LIMIT
    } else if x > LIMIT - 1 {
        LIMIT - 1
    } else {
        x
    };
    (x + LIMIT) as usize
}

/// By stretched probability + LIMIT: the probability, in units of 2^-16.
const fn squashed(n: usize) -> u16 {
    let (place, part) = (n >> 7, (n & 127) as u32);
    let value = (CURVE[place] as u32 * (128 - part) + CURVE[place + 1] as u32 * part + 64) >> 7;
    // What a model may say: no more than that.
    if value < 32 {
        32
    } else if value > 65504 {
        65504
    } else {
        value as u16
    }
}

/// By the upper twelve bits of a probability: the least stretched one + LIMIT that squashes to the middle of those or more; it is no less than `x`.
const fn stretched(n: usize, mut x: usize) -> usize {
    while x < PLACES - 1 && (squashed(x) as usize) < 16 * n + 8 {
        x += 1;
    }
    x
}

/// `squashed` and `stretched` of all numbers.
#[cfg(not(unweld_surface))]
mod tables {
    use super::{LIMIT, PLACES};

    #[inline]
    pub fn squashed(n: usize) -> u16 {
        SQUASHED[n]
    }

    #[inline]
    pub fn stretched(n: usize) -> i16 {
        STRETCHED[n]
    }

    static SQUASHED: [u16; PLACES] = {
        let mut table = [0; PLACES];
        let mut n = 0;
        while n < PLACES {
            table[n] = super::squashed(n);
            n += 1;
        }
        table
    };

    static STRETCHED: [i16; 4096] = {
        let mut table = [0; 4096];
        let (mut n, mut x) = (0, 0);
        while n < table.len() {
            x = super::stretched(n, x);
            table[n] = (x as i32 - LIMIT) as i16;
            n += 1;
        }
        table
    };
}

/// The same in the module that pages fetch, which makes them when it begins: they cannot be compressed.
#[cfg(unweld_surface)]
pub mod tables {
    use super::{LIMIT, PLACES};
    use std::sync::atomic::{AtomicI16, AtomicU16, Ordering::Relaxed};

    #[inline]
    pub fn squashed(n: usize) -> u16 {
        SQUASHED[n].load(Relaxed)
    }

    #[inline]
    pub fn stretched(n: usize) -> i16 {
        STRETCHED[n].load(Relaxed)
    }

    /// Before anything is decoded.
    pub fn make() {
        let mut x = 0;
        for n in 0..PLACES {
            SQUASHED[n].store(super::squashed(n), Relaxed);
            x = super::stretched(n, x);
            STRETCHED[n].store((x as i32 - LIMIT) as i16, Relaxed);
        }
    }

    static SQUASHED: [AtomicU16; PLACES] = [const { AtomicU16::new(0) }; PLACES];
    static STRETCHED: [AtomicI16; PLACES] = [const { AtomicI16::new(0) }; PLACES];
}

/// How far each of some models is trusted.
///
/// Invariant: weights stay within ±[`HEAVIEST`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Mixer<const N: usize> {
    /// In units of 2^-16.
    weights: [i32; N],
}

const HEAVIEST: i32 = (1 << 18) - 1;
/// An error of a whole and a stretched probability of 1 change a weight by 2^-RATE * 2^8: 1/64.
const RATE: u32 = 14;
/// About how many decisions a mixed model remembers: there are others that remember longer what is rare.
const MEMORY: u8 = 30;

impl<const N: usize> Mixer<N> {
    /// One that trusts all alike, a little more than an average would: they do not all tell the same.
    pub const ALIKE: Self = Self { weights: [(6 << 16) / (5 * N as i32); N] };

    /// The sum of what models say, stretched.
    #[inline]
    fn mixed(&self, stretched: &[i32; N]) -> i32 {
        let products =
            self.weights.iter().zip(stretched).map(|(&weight, &x)| i64::from(weight) * i64::from(x));
        (products.sum::<i64>() >> 16).clamp(-i64::from(LIMIT), i64::from(LIMIT - 1)) as i32
    }

    /// Learns what came where it had `mixed` what models said.
    #[inline]
    fn learn(&mut self, stretched: &[i32; N], mixed: i32, bit: bool) {
        let error = (i32::from(!bit) << 16) - i32::from(squash(mixed));
        for (weight, x) in self.weights.iter_mut().zip(stretched) {
            *weight = (*weight + ((error * x + (1 << (RATE - 1))) >> RATE)).clamp(-HEAVIEST, HEAVIEST);
        }
    }
}

/// How decisions turn out that were thought to be so likely, by stretched probability in steps of 256 (secondary estimation, as in PAQ).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Outcomes([Bit; STEPS + 1]);

const STEPS: usize = 16;
const _: () = assert!(STEPS == 2 * LIMIT as usize / 256);

impl Outcomes {
    /// Before anything is known: as likely as thought.
    pub const NEW: Self = {
        let mut bits = [Bit::NEW; STEPS + 1];
        let mut step = 0;
        while step <= STEPS {
            bits[step] = Bit::known(curve(256 * step as i32 - LIMIT), 4);
            step += 1;
        }
        Self(bits)
    };
}

/// Codes a decision under all of `models`, which learn it: as the `mixers`, each picked by another context, have it in the mean, and half of
/// it as such decisions turned out before.
#[inline]
pub fn mixed<C: BitCoder, const N: usize>(
    coder: &mut C,
    mixers: [&mut Mixer<N>; 3],
    outcomes: &mut Outcomes,
    models: [&mut Bit; N],
    known: impl FnOnce() -> bool,
) -> bool {
    let stretched: [i32; N] = std::array::from_fn(|i| stretch(*models[i]));
    let each = [0, 1, 2].map(|k: usize| mixers[k].mixed(&stretched));
    let place = (each[0] + each[1] + each[2]).div_euclid(3) + LIMIT;
    // Within the steps: the mean of numbers below LIMIT is below it.
    let (step, part) = ((place >> 8) as usize & (STEPS - 1), place as u32 & 255);
    let [low, high] = [step, step + 1].map(|step| outcomes.0[step].zero());
    let turned_out = (low * (256 - part) + high * part) >> 8;
    let zero = (u32::from(squash(place - LIMIT)) + turned_out + 1) >> 1;
    let bit = coder.decide(zero, known);
    for (mixer, mixed) in mixers.into_iter().zip(each) {
        mixer.learn(&stretched, mixed, bit);
    }
    outcomes.0[step + usize::from(part >= 128)].learn(bit);
    for model in models {
        model.learn_as_one_of::<MEMORY>(bit);
    }
    bit
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
        assert!(
            (0..4096).is_sorted_by_key(tables::stretched) && (0..PLACES).is_sorted_by_key(tables::squashed)
        );
    }

    proptest! {
        #[test]
        fn decisions_come_back(items in prop::collection::vec((0..3usize, 0..5usize, any::<bool>()), 0..2000)) {
            let fresh = || ([Bit::NEW; 3], [Bit::NEW; 5], [Mixer::ALIKE; 5], Outcomes::NEW);
            let mut encoder = RangeEncoder::default();
            let (mut a, mut b, mut mixers, mut outcomes) = fresh();
            for &(i, j, bit) in &items {
                code(&mut encoder, &mut mixers, (i, j), &mut outcomes, [&mut a[i], &mut b[j]], || bit);
            }
            let bytes = encoder.finish();
            let mut decoder = RangeDecoder::new(&bytes);
            let (mut a, mut b, mut mixers, mut outcomes) = fresh();
            for &(i, j, bit) in &items {
                let models = [&mut a[i], &mut b[j]];
                prop_assert_eq!(code(&mut decoder, &mut mixers, (i, j), &mut outcomes, models, || unreachable!()), bit);
            }
            decoder.finish().unwrap();
        }
    }

    /// Under three of five mixers: two of them change with the contexts.
    fn code<C: BitCoder, const N: usize>(
        coder: &mut C,
        mixers: &mut [Mixer<N>; 5],
        (i, j): (usize, usize),
        outcomes: &mut Outcomes,
        models: [&mut Bit; N],
        known: impl FnOnce() -> bool,
    ) -> bool {
        let (left, right) = mixers.split_at_mut(2);
        let (middle, right) = right.split_at_mut(1);
        mixed(coder, [&mut left[i % 2], &mut middle[0], &mut right[j % 2]], outcomes, models, known)
    }

    /// Whatever is learnt, weights stay in bounds: a model that is always wrong, one that is always right, both turned round again
    /// and again.
    #[test]
    fn weights_stay_in_bounds() {
        let mut mixers = [Mixer::<6>::ALIKE; 3];
        let mut outcomes = Outcomes::NEW;
        let mut encoder = RangeEncoder::default();
        for k in 0..100_000u32 {
            let mut models = [32, 65504, 32, 65504, 32, 65504].map(|zero| Bit::known(zero, 0));
            mixed(&mut encoder, mixers.each_mut(), &mut outcomes, models.each_mut(), || k / 25_000 % 2 == 0);
            assert!(mixers[0].weights.iter().all(|w| w.abs() <= HEAVIEST));
        }
    }

    /// Of two models one knows and the other does not: the mix is nearly as good as the one that knows, whichever it is.
    #[test]
    fn the_better_model_is_trusted() {
        for better in [0, 1] {
            let mut encoder = RangeEncoder::default();
            let (mut mixers, mut outcomes) = ([Mixer::ALIKE; 3], Outcomes::NEW);
            let mut models = [[Bit::NEW; 2]; 2];
            for k in 0..4000usize {
                let bit = k % 7 < 3;
                let mut contexts = [k % 2; 2];
                contexts[better] = usize::from(bit);
                let [first, second] = &mut models;
                let chosen = [&mut first[contexts[0]], &mut second[contexts[1]]];
                mixed(&mut encoder, mixers.each_mut(), &mut outcomes, chosen, || bit);
            }
            assert!(encoder.bits() < 200.0, "{}", encoder.bits());
        }
    }

    /// A model that is sure where it ought not to be: outcomes tell, though no weight can.
    #[test]
    fn what_is_thought_too_likely_is_seen() {
        let bits = |learns: bool| {
            let mut encoder = RangeEncoder::default();
            let mut outcomes = Outcomes::NEW;
            for k in 0..4000u32 {
                let mut sure = Bit::known(60_000, 0);
                let mut mixers = [Mixer::ALIKE; 3];
                if !learns {
                    outcomes = Outcomes::NEW;
                }
                mixed(&mut encoder, mixers.each_mut(), &mut outcomes, [&mut sure], || k % 3 == 0);
            }
            encoder.bits()
        };
        assert!(bits(true) < 0.85 * bits(false));
    }
}
