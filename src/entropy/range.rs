//! Range coder of decisions and symbols: 32-bit range, carry by a pending byte as in LZMA (Martin 1979; spec §6.1).

use super::model::Bit;
use super::symbol::{SCALE, SYMBOLS, SymbolModel};
use super::{BitCoder, CodingError};
use std::hint::select_unpredictable;

const TOP: u32 = 1 << 24;

/// Writes decisions to bytes.
#[cfg(any(test, feature = "encode"))]
#[derive(Debug)]
pub struct RangeEncoder {
    low: u64,
    range: u32,
    /// The last byte written but for a carry, and how many 0xFF follow it.
    pending: Option<u8>,
    full: usize,
    bytes: Vec<u8>,
}

#[cfg(any(test, feature = "encode"))]
impl Default for RangeEncoder {
    fn default() -> Self {
        Self { low: 0, range: u32::MAX, pending: None, full: 0, bytes: Vec::new() }
    }
}

#[cfg(any(test, feature = "encode"))]
impl RangeEncoder {
    /// Bytes written so far, those still to be settled included.
    #[cfg(feature = "encode")]
    pub fn size(&self) -> usize {
        self.bytes.len() + self.full + 5
    }

    /// Bits written so far, for statistics.
    pub fn bits(&self) -> f64 {
        (self.bytes.len() + self.full + usize::from(self.pending.is_some())) as f64 * 8.0 + 32.0
            - f64::from(self.range).log2()
    }

    /// Ends the code and returns its bytes, without the zeros at the end (32 at most), which a decoder supplies itself.
    pub fn finish(mut self) -> Vec<u8> {
        // The number in [low, low + range) with the most zero bits at its end.
        let last = self.low + u64::from(self.range) - 1;
        let mut value = last;
        for zeros in (0..=32).rev() {
            let candidate = last >> zeros << zeros;
            if candidate >= self.low {
                value = candidate;
                break;
            }
        }
        self.low = value;
        for _ in 0..5 {
            self.shift();
        }
        let zeros = self.bytes.iter().rev().take_while(|&&byte| byte == 0).count();
        let shortest = self.bytes.len() - zeros.min(MAX_ZEROS);
        // A payload of no bytes would be no payload (spec §3.3).
        self.bytes.truncate(shortest.max(1));
        self.bytes
    }

    fn shift(&mut self) {
        if self.low < 0xFF00_0000 || self.low > 0xFFFF_FFFF {
            let carry = (self.low >> 32) as u8;
            if let Some(byte) = self.pending {
                self.bytes.push(byte.wrapping_add(carry));
            }
            self.bytes.resize(self.bytes.len() + self.full, 0xFF_u8.wrapping_add(carry));
            self.full = 0;
            self.pending = Some((self.low >> 24) as u8);
        } else {
            self.full += 1;
        }
        self.low = (self.low & 0x00FF_FFFF) << 8;
    }

    #[inline]
    fn encode(&mut self, zero: u32, bit: bool) {
        let bound = (self.range >> 16) * zero;
        if bit {
            self.low += u64::from(bound);
            self.range -= bound;
        } else {
            self.range = bound;
        }
        self.renormalise();
    }

    /// Narrows the range to `size` parts from part `start` on; the last part of all has the rest.
    #[inline]
    fn narrow(&mut self, part: u32, start: u32, size: Option<u32>) {
        self.low += u64::from(part) * u64::from(start);
        self.range = match size {
            Some(size) => part * size,
            None => self.range - part * start,
        };
        self.renormalise();
    }

    #[inline]
    fn renormalise(&mut self) {
        while self.range < TOP {
            self.range <<= 8;
            self.shift();
        }
    }
}

#[cfg(any(test, feature = "encode"))]
impl BitCoder for RangeEncoder {
    const ENCODES: bool = true;

    #[inline]
    fn bit(&mut self, model: &mut Bit, known: impl FnOnce() -> bool) -> bool {
        let bit = known();
        self.encode(model.zero(), bit);
        model.learn(bit);
        bit
    }

    #[inline]
    fn decide(&mut self, zero: u32, known: impl FnOnce() -> bool) -> bool {
        let bit = known();
        self.encode(zero, bit);
        bit
    }

    #[inline]
    fn even(&mut self, known: impl FnOnce() -> bool) -> bool {
        let bit = known();
        self.encode(1 << 15, bit);
        bit
    }

    #[inline]
    fn symbol(&mut self, model: &mut SymbolModel, known: impl FnOnce() -> usize) -> usize {
        let symbol = known();
        let (start, size) = model.interval(symbol);
        self.narrow(self.range >> SCALE, start, (symbol + 1 < SYMBOLS).then_some(size));
        model.learn(symbol);
        symbol
    }

    #[inline]
    fn bits(&mut self, count: u32, known: impl FnOnce() -> u32) -> u32 {
        let value = known();
        self.narrow(self.range >> count, value, (value + 1 < 1 << count).then_some(1));
        value
    }

    #[inline]
    fn below(&mut self, count: u32, known: impl FnOnce() -> u32) -> u32 {
        let value = known();
        self.narrow(self.range / count, value, (value + 1 < count).then_some(1));
        value
    }

    fn check(&self) -> Result<(), CodingError> {
        Ok(())
    }

    fn spent(&self) -> f64 {
        self.bits()
    }
}

/// Reads decisions from bytes; past their end it reads zeros.
#[derive(Debug)]
pub struct RangeDecoder<'a> {
    bytes: &'a [u8],
    /// Bytes asked for, those past the end included.
    position: usize,
    range: u32,
    code: u32,
}

impl<'a> RangeDecoder<'a> {
    /// Starts at the first byte.
    pub fn new(bytes: &'a [u8]) -> Self {
        let mut decoder = Self { bytes, position: 0, range: u32::MAX, code: 0 };
        for _ in 0..4 {
            decoder.code = decoder.code << 8 | decoder.byte();
        }
        decoder
    }

    /// Ends the code.
    ///
    /// # Errors
    /// [`CodingError`] where bytes are left over, or were missing.
    pub fn finish(self) -> Result<(), CodingError> {
        if self.position < self.bytes.len() {
            return Err(CodingError::Trailing);
        }
        self.check()
    }

    #[inline]
    fn byte(&mut self) -> u32 {
        let byte = self.bytes.get(self.position).copied().unwrap_or(0);
        self.position += 1;
        u32::from(byte)
    }

    #[inline]
    fn decode(&mut self, zero: u32) -> bool {
        let bound = (self.range >> 16) * zero;
        let bit = self.code >= bound;
        // A branch here would be taken at random, as far as the code is a good one.
        self.code = select_unpredictable(bit, self.code.wrapping_sub(bound), self.code);
        self.range = select_unpredictable(bit, self.range - bound, bound);
        self.renormalise();
        bit
    }

    /// The counterpart of [`RangeEncoder::narrow`].
    #[inline]
    fn narrow(&mut self, part: u32, start: u32, size: Option<u32>) {
        self.code -= part * start;
        self.range = match size {
            Some(size) => part * size,
            None => self.range - part * start,
        };
        // A page fetches the code first: there the shorter one.
        if cfg!(target_family = "wasm") { self.renormalise() } else { self.renormalise_at_once() }
    }

    #[inline]
    fn renormalise(&mut self) {
        while self.range < TOP {
            self.range <<= 8;
            self.code = self.code << 8 | self.byte();
        }
    }

    /// The same without a branch, for steps behind which a byte is due about as often as not.
    #[inline]
    fn renormalise_at_once(&mut self) {
        // What is left of the range is at least 256 wide.
        let shift = self.range.leading_zeros() & !7;
        let ahead = self.bytes.get(self.position..).and_then(|bytes| bytes.first_chunk());
        let ahead = ahead.map_or_else(|| self.last_bytes(), |bytes| u32::from_be_bytes(*bytes));
        self.range <<= shift;
        self.code = ((u64::from(self.code) << 32 | u64::from(ahead)) << shift >> 32) as u32;
        self.position += shift as usize / 8;
    }

    /// The next four bytes, where the code ends before them.
    #[cold]
    fn last_bytes(&self) -> u32 {
        let byte = |k: usize| self.bytes.get(self.position + k).copied().unwrap_or(0);
        u32::from_be_bytes([0, 1, 2, 3].map(byte))
    }
}

impl BitCoder for RangeDecoder<'_> {
    const ENCODES: bool = false;

    #[inline]
    fn bit(&mut self, model: &mut Bit, _known: impl FnOnce() -> bool) -> bool {
        let bit = self.decode(model.zero());
        model.learn(bit);
        bit
    }

    #[inline]
    fn decide(&mut self, zero: u32, _known: impl FnOnce() -> bool) -> bool {
        self.decode(zero)
    }

    #[inline]
    fn even(&mut self, _known: impl FnOnce() -> bool) -> bool {
        self.decode(1 << 15)
    }

    #[inline]
    fn symbol(&mut self, model: &mut SymbolModel, _known: impl FnOnce() -> usize) -> usize {
        let part = self.range >> SCALE;
        let symbol = model.find((self.code / part).min((1 << SCALE) - 1));
        let (start, size) = model.interval(symbol);
        self.narrow(part, start, (symbol + 1 < SYMBOLS).then_some(size));
        model.learn(symbol);
        symbol
    }

    #[inline]
    fn bits(&mut self, count: u32, _known: impl FnOnce() -> u32) -> u32 {
        let part = self.range >> count;
        let value = (self.code / part).min((1 << count) - 1);
        self.narrow(part, value, (value + 1 < 1 << count).then_some(1));
        value
    }

    #[inline]
    fn below(&mut self, count: u32, _known: impl FnOnce() -> u32) -> u32 {
        let part = self.range / count;
        let value = (self.code / part).min(count - 1);
        self.narrow(part, value, (value + 1 < count).then_some(1));
        value
    }

    fn check(&self) -> Result<(), CodingError> {
        if self.position > self.bytes.len() + MAX_ZEROS { Err(CodingError::Truncated) } else { Ok(()) }
    }
}

/// Most zero bytes that an encoder leaves out at the end of a code. A decoder that has asked for more bytes past the end than
/// this reads a code that is too short: encoder and decoder move the same number of bytes (spec §6.1).
const MAX_ZEROS: usize = 32;

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn round_trip(bits: &[(usize, bool)]) -> Vec<u8> {
        let mut models = [Bit::NEW; 4];
        let mut encoder = RangeEncoder::default();
        for &(m, bit) in bits {
            if m == 4 {
                encoder.even(|| bit)
            } else {
                encoder.bit(&mut models[m], || bit)
            };
        }
        let bytes = encoder.finish();
        let mut models = [Bit::NEW; 4];
        let mut decoder = RangeDecoder::new(&bytes);
        for (k, &(m, bit)) in bits.iter().enumerate() {
            let unknown = || unreachable!();
            let decoded = if m == 4 { decoder.even(unknown) } else { decoder.bit(&mut models[m], unknown) };
            assert_eq!(decoded, bit, "decision {k}");
        }
        decoder.finish().unwrap();
        bytes
    }

    proptest! {
        #[test]
        fn decisions_come_back(bits in prop::collection::vec((0..5usize, any::<bool>()), 0..2000)) {
            round_trip(&bits);
        }

        #[test]
        fn skewed_decisions_come_back(ones in prop::collection::vec(0..3000usize, 0..4)) {
            let bits: Vec<_> = (0..3000).map(|k| (0, ones.contains(&k))).collect();
            let bytes = round_trip(&bits);
            prop_assert!(bytes.len() < 40);
        }
    }

    #[test]
    fn a_long_run_of_pending_bytes_carries() {
        // Ones at an even chance push low towards 0xFFFF…; a zero at the end settles them, a one carries.
        for last in [false, true] {
            let mut bits = vec![(4, true); 300];
            bits.extend([(4, last), (4, true), (4, last)]);
            round_trip(&bits);
        }
    }

    #[test]
    fn left_over_bytes_are_refused() {
        let mut bytes = round_trip(&[(4, true), (4, false), (4, true)]);
        bytes.extend([0, 0, 0, 0, 1]);
        assert_eq!(RangeDecoder::new(&bytes).finish(), Err(CodingError::Trailing));
    }
}
