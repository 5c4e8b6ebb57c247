//! Numbers whose size is expected of what is round them (spec §13.5).

use crate::entropy::{BitCoder, CodingError, NumberModel, SymbolModel};

/// Contexts of each kind.
pub(super) const CONTEXTS: usize = 40;
/// The context of each kind where nothing is known, the last one.
pub(super) const UNKNOWN: usize = CONTEXTS - 1;
/// Kinds of contexts.
pub(super) const KINDS: usize = 3;

/// Models of signed numbers of one kind. Contexts of several kinds tell together how large a number is to be expected; that says what a
/// symbol stands for, and under which model it is.
#[derive(Clone, Debug)]
pub(super) struct ResidualModel {
    /// What a context adds to the logarithm of the size.
    parts: [[Part; CONTEXTS]; KINDS],
    symbols: [SymbolModel; SIZES],
    far: NumberModel,
}

/// What a context adds to the logarithm of a size, in units of 2^-12 octave, and how often it has been met.
#[derive(Clone, Copy, Debug)]
struct Part {
    octaves: i32,
    count: u8,
}

/// Units of an octave that logarithms have.
const OCTAVE: i32 = 16;
/// Finer ones that parts have, in units of these.
const FINE: u32 = 8;
/// The largest size.
const LARGEST: i32 = 32 * OCTAVE - 1;
/// Sizes that are told apart: halves of an octave, from one octave below 1 on.
const SIZES: usize = 66;

/// Before anything is learnt: about what real meshes teach of octahedral coordinates, and of anything else. A size grows with what is near,
/// if slower than that, and with the number before it; that of a direction also with how far what it is expected of lies apart.
fn parts(are_directions: bool) -> [[Part; CONTEXTS]; KINDS] {
    let octaves = |kind: usize, c: i32| match (kind, are_directions) {
        (0, true) => 36 + 3 * c,
        (0, false) => 14 + 5 * c,
        (1, true) if c >= 26 => 4 * (c % 13) - 30,
        (1, true) => 18,
        (1, false) => -6,
        (_, true) => (8 * c - 40).min(11),
        (_, false) => (3 * c - 21).min(11),
    };
    let unknown = if are_directions { [71, 0, -8] } else { [88, 0, -12] };
    std::array::from_fn(|kind| {
        std::array::from_fn(|c| {
            let octaves = if c < UNKNOWN { octaves(kind, c as i32) } else { unknown[kind] };
            Part { octaves: octaves << FINE, count: 0 }
        })
    })
}

/// Numbers are bells whose width is their size, in symbols.
const SYMBOLS: [SymbolModel; SIZES] = {
    let mut symbols = [SymbolModel::bell(92, 0); SIZES];
    let mut size = 1;
    while size < SIZES {
        let variance = match size {
            1 => 171,
            2 => 330,
            3 => 648,
            _ => [1284, 1636][size % 2],
        };
        // Of a symbol that stands for several numbers the middle lies behind the first.
        symbols[size] = SymbolModel::bell(variance, if size < 6 { 0 } else { 5 });
        size += 1;
    }
    symbols
};

impl ResidualModel {
    /// Fresh ones, of octahedral coordinates or of anything else.
    pub(super) fn new(are_directions: bool) -> Self {
        Self { parts: parts(are_directions), symbols: SYMBOLS, far: NumberModel::default() }
    }

    /// Codes a number in these contexts, each below [`CONTEXTS`]; `mirrored` where it is rather below 0 than above.
    #[inline]
    pub(super) fn code<C: BitCoder>(
        &mut self,
        coder: &mut C,
        contexts: [usize; KINDS],
        mirrored: bool,
        known: i32,
    ) -> Result<i32, CodingError> {
        let mut octaves = 0;
        for (parts, context) in self.parts.iter().zip(contexts) {
            octaves += parts[context].octaves;
        }
        let size = (octaves >> FINE).clamp(-OCTAVE, LARGEST);
        let shift = ((size - OCTAVE).max(0) / OCTAVE) as u32;
        let known = if mirrored { known.wrapping_neg() } else { known };
        let symbols = &mut self.symbols[((size + OCTAVE) / (OCTAVE / 2)) as usize];
        let symbol = coder.symbol(symbols, || (known >> shift).saturating_add(8).clamp(0, 15) as usize);
        let mut high = symbol as i64 - 8;
        if symbol == 0 || symbol == 15 {
            let beyond =
                self.far.unsigned(coder, || (i64::from(known >> shift) - high).unsigned_abs() as u32)?;
            high += if symbol == 0 { -i64::from(beyond) } else { i64::from(beyond) };
        }
        let mut low = 0;
        let mut left = shift;
        while left > 0 {
            let bits = left.min(16);
            left -= bits;
            low = low << bits | coder.bits(bits, || (known as u32) >> left & ((1 << bits) - 1));
        }
        let number = (high << shift | i64::from(low)) as i32;
        self.learn(contexts, size, number);
        Ok(if mirrored { number.wrapping_neg() } else { number })
    }

    #[inline]
    fn learn(&mut self, contexts: [usize; KINDS], size: i32, number: i32) {
        let off = (logarithm(number.unsigned_abs()) - size) << FINE;
        for (parts, context) in self.parts.iter_mut().zip(contexts) {
            let part = &mut parts[context];
            part.octaves += off >> RATES[usize::from(part.count & 63)];
            part.count += u8::from(part.count < 48);
        }
    }
}

/// What a number weighs to a context that has been met so often, 48 times at most: 2^-rate.
const RATES: [u8; 64] = {
    let mut rates = [6; 64];
    let mut n = 0;
    while n < 48 {
        rates[n] = match n {
            0..4 => 3,
            4..16 => 4,
            _ => 5,
        };
        n += 1;
    }
    rates
};

/// The logarithm of n + 1/2, in units of 1/16, rounded down.
#[inline]
fn logarithm(n: u32) -> i32 {
    let twice = 2 * u64::from(n) + 1;
    let exponent = 63 - twice.leading_zeros();
    let fraction = (twice << 4 >> exponent) & 15;
    OCTAVE * (exponent as i32 - 1) + fraction as i32
}

#[cfg(all(test, feature = "encode"))]
mod tests {
    use super::*;
    use crate::entropy::{RangeDecoder, RangeEncoder};
    use proptest::prelude::*;

    #[test]
    fn logarithms_of_numbers() {
        for n in (0..2000).chain([1 << 20, u32::MAX / 2, u32::MAX]) {
            let exact = (f64::from(n) + 0.5).log2() * 16.0;
            // Between two powers of 2 a straight line is below the logarithm, by at most 0.09.
            assert!((exact - 2.4..=exact + 1e-9).contains(&f64::from(logarithm(n))), "{n}");
        }
    }

    proptest! {
        #[test]
        fn numbers_come_back(items in prop::collection::vec(
            (prop_oneof![any::<i32>(), -3..4i32, -1000..1000i32, Just(i32::MIN)], 0..CONTEXTS, 0..CONTEXTS, any::<bool>()), 0..300), are_directions: bool) {
            let mut encoder = RangeEncoder::default();
            let mut model = ResidualModel::new(are_directions);
            for &(n, a, b, mirrored) in &items {
                prop_assert_eq!(model.code(&mut encoder, [a, b, 0], mirrored, n), Ok(n));
            }
            let bytes = encoder.finish();
            let mut decoder = RangeDecoder::new(&bytes);
            let mut model = ResidualModel::new(are_directions);
            for &(n, a, b, mirrored) in &items {
                prop_assert_eq!(model.code(&mut decoder, [a, b, 0], mirrored, 0), Ok(n));
            }
            decoder.finish().unwrap();
        }

        #[test]
        fn any_bytes_are_numbers_or_an_error(bytes in prop::collection::vec(any::<u8>(), 0..200), contexts in prop::array::uniform3(0..CONTEXTS), are_directions: bool) {
            let mut decoder = RangeDecoder::new(&bytes);
            let mut model = ResidualModel::new(are_directions);
            for _ in 0..100 {
                if model.code(&mut decoder, contexts, false, 0).is_err() {
                    break;
                }
            }
        }
    }

    /// What is of one size in a context costs little more than its entropy, once that is learnt.
    #[test]
    fn sizes_are_learnt() {
        let sizes = [(1, 2.0), (30, 6.4), (3000, 13.1)];
        for ((size, most), are_directions) in sizes.into_iter().flat_map(|size| [(size, false), (size, true)])
        {
            let mut encoder = RangeEncoder::default();
            let mut model = ResidualModel::new(are_directions);
            for k in 0..4000 {
                // All as likely, in some order.
                let n = k * 7919 % (2 * size + 1) - size;
                model.code(&mut encoder, [UNKNOWN; 3], false, n).unwrap();
            }
            let each = encoder.bits() / 4000.0;
            assert!(each < most, "{each} bits for numbers up to {size}");
        }
    }
}
