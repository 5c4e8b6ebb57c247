//! Adaptive models of symbols 0 to 15, in integers (spec §6.4).

/// Number of symbols.
pub const SYMBOLS: usize = 16;

/// The sum of all frequencies that a coder sees is 2^SCALE.
pub const SCALE: u32 = 15;

/// Cumulative frequencies of symbols, learning fast at first and slowly later.
///
/// `sums[i]` is the sum of symbols 0 to i, without the floor of 1 that every symbol has, in units of 2^-`FINE`.
/// Invariant: the sums do not decrease, the first is at least 0, the last is `WHOLE`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SymbolModel {
    sums: [i32; SYMBOLS],
    count: u32,
}

const FINE: u32 = 12;
// `symbol & (SYMBOLS - 1)` is the symbol itself, since all are below SYMBOLS: those of a writer as `interval` asserts, those of a reader since
// `find` never counts the last sum, which is WHOLE. The mask spares a check where the compiler cannot know that.
const _: () = assert!(SYMBOLS.is_power_of_two());
// No sum, floor or target overflows, nor a value below 2^SCALE in their units.
const _: () = assert!(SCALE + FINE < i32::BITS - 1);
/// How many symbols a bell stands for.
const KNOWN: u32 = 48;
/// All frequencies but for the floors.
const WHOLE: i32 = ((1 << SCALE) - SYMBOLS as i32) << FINE;

impl SymbolModel {
    /// A bell of this variance, in units of a twelfth of a symbol, squared, whose middle lies `offset` twelfths before that of symbol 8:
    /// Student's distribution of five degrees of freedom, as if learnt from [`KNOWN`] symbols.
    pub const fn bell(variance: u64, offset: i32) -> Self {
        let spread = 5 * variance;
        let mut sums = [WHOLE; SYMBOLS];
        let (mut weights, mut whole) = ([0; SYMBOLS], 0);
        let mut i = 0;
        while i < SYMBOLS {
            let from_middle = 12 * (i as i32 - 8) + offset;
            let near = (spread << 10) / (spread + (from_middle * from_middle) as u64);
            weights[i] = ((near * near * near) >> 10) + 100;
            whole += weights[i];
            i += 1;
        }
        let mut below = 0;
        i = 0;
        while i < SYMBOLS - 1 {
            below += weights[i];
            sums[i] = (WHOLE as u64 * below / whole) as i32;
            i += 1;
        }
        Self { sums, count: KNOWN }
    }

    /// The frequencies of all symbols below `symbol`, and its own.
    #[inline]
    pub(super) fn interval(&self, symbol: usize) -> (u32, u32) {
        debug_assert!(symbol < SYMBOLS);
        let symbol = symbol & (SYMBOLS - 1);
        let end = (self.sums[symbol] >> FINE) as u32 + symbol as u32 + 1;
        let start = if symbol == 0 { 0 } else { (self.sums[symbol - 1] >> FINE) as u32 + symbol as u32 };
        (start, end - start)
    }

    /// The symbol that `value`, below 2^15, falls to.
    #[inline]
    pub(super) fn find(&self, value: u32) -> usize {
        // sum / 2^FINE + i < value, of all.
        below(&self.sums, (value as i32) << FINE)
    }

    /// Learns a symbol.
    #[inline]
    pub(super) fn learn(&mut self, symbol: usize) {
        let rate = RATES[(self.count as usize).min(RATES.len() - 1)];
        let targets = &TARGETS[symbol & (SYMBOLS - 1)];
        for (sum, target) in self.sums.iter_mut().zip(targets) {
            *sum += (target - *sum) >> rate;
        }
        self.count = self.count.saturating_add(1);
    }
}

/// How many sums and floors are together below a value; they do not decrease.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn below(sums: &[i32; SYMBOLS], value: i32) -> usize {
    use safe_arch::*;
    let value = set_splat_i32_m128i(value);
    let (sums, _) = sums.as_chunks::<4>();
    let (floors, _) = FLOORS.as_chunks::<4>();
    let a = cmp_gt_mask_i32_m128i(sub_i32_m128i(value, floors[0].into()), sums[0].into());
    let b = cmp_gt_mask_i32_m128i(sub_i32_m128i(value, floors[1].into()), sums[1].into());
    let c = cmp_gt_mask_i32_m128i(sub_i32_m128i(value, floors[2].into()), sums[2].into());
    let d = cmp_gt_mask_i32_m128i(sub_i32_m128i(value, floors[3].into()), sums[3].into());
    let are_below = pack_i16_to_i8_m128i(pack_i32_to_i16_m128i(a, b), pack_i32_to_i16_m128i(c, d));
    // The last sum is no smaller than any value.
    move_mask_i8_m128i(are_below).trailing_ones() as usize
}

/// The same, in fours.
#[cfg(not(target_arch = "x86_64"))]
fn below(sums: &[i32; SYMBOLS], value: i32) -> usize {
    let mut below = [0; 4];
    for (sums, floors) in sums.chunks_exact(4).zip(FLOORS.chunks_exact(4)) {
        for lane in 0..4 {
            below[lane] += i32::from(sums[lane] < value - floors[lane]);
        }
    }
    (below[0] + below[1] + below[2] + below[3]) as usize
}

/// The floors of the symbols before each, in the units of the sums.
const FLOORS: [i32; SYMBOLS] = {
    let mut floors = [0; SYMBOLS];
    let mut i = 0;
    while i < SYMBOLS {
        floors[i] = (i as i32) << FINE;
        i += 1;
    }
    floors
};

/// The sums that a symbol draws a model to: 0 below it, [`WHOLE`] from it on.
const TARGETS: [[i32; SYMBOLS]; SYMBOLS] = {
    let mut targets = [[0; SYMBOLS]; SYMBOLS];
    let mut i = 0;
    while i < SYMBOLS * SYMBOLS {
        if i % SYMBOLS >= i / SYMBOLS {
            targets[i / SYMBOLS][i % SYMBOLS] = WHOLE;
        }
        i += 1;
    }
    targets
};

/// A symbol weighs 2^-rate after so many others.
const RATES: [u8; 129] = {
    let mut rates = [7; 129];
    let mut n = 0;
    while n < 128 {
        rates[n] = if n < 24 {
            4
        } else if n < 48 {
            5
        } else {
            6
        };
        n += 1;
    }
    rates
};

#[cfg(test)]
mod tests {
    use super::*;
    use crate::entropy::{BitCoder, RangeDecoder, RangeEncoder};
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn symbols_and_bits_come_back(
            items in prop::collection::vec((0..16usize, 1..=16u32, any::<u32>()), 0..400),
        ) {
            let mut encoder = RangeEncoder::default();
            let mut model = SymbolModel::bell(1800, 0);
            for &(symbol, count, value) in &items {
                encoder.symbol(&mut model, || symbol);
                BitCoder::bits(&mut encoder, count, || value & ((1 << count) - 1));
            }
            let bytes = encoder.finish();
            let mut decoder = RangeDecoder::new(&bytes);
            let mut model = SymbolModel::bell(1800, 0);
            for &(symbol, count, value) in &items {
                prop_assert_eq!(decoder.symbol(&mut model, || 0), symbol);
                prop_assert_eq!(decoder.bits(count, || 0), value & ((1 << count) - 1));
            }
            decoder.finish().unwrap();
        }

        /// Whatever is learnt, the intervals of the symbols lie side by side, fill the whole, and none is empty.
        #[test]
        fn intervals_fill_the_whole(symbols in prop::collection::vec(0..16usize, 0..3000)) {
            let mut model = SymbolModel::bell(1800, 0);
            symbols.iter().for_each(|&symbol| model.learn(symbol));
            let mut start = 0;
            for symbol in 0..SYMBOLS {
                let (first, size) = model.interval(symbol);
                prop_assert_eq!(first, start);
                prop_assert!(size > 0);
                prop_assert_eq!(model.find(first), symbol);
                prop_assert_eq!(model.find(first + size - 1), symbol);
                start += size;
            }
            prop_assert_eq!(start, 1 << SCALE);
        }
    }

    #[test]
    fn what_always_comes_costs_next_to_nothing() {
        let mut encoder = RangeEncoder::default();
        let mut model = SymbolModel::bell(1800, 0);
        for _ in 0..10_000 {
            encoder.symbol(&mut model, || 3);
        }
        // About 15 of 32,768 parts stay with the other symbols.
        assert!(encoder.bits() < 180.0, "{}", encoder.bits());
    }
}
