//! Numbers by three contexts at once (spec §13.5).

use crate::entropy::{Bit, BitCoder, CodingError, Mixer};

/// Contexts of each kind.
pub(super) const CONTEXTS: usize = 40;
/// Kinds of contexts.
pub(super) const KINDS: usize = 3;

/// Models of signed numbers of one kind: bit length of the magnitude in unary, each decision mixed of as many models as there are
/// kinds of contexts; then its bits below the leading one, the highest two under models; then the sign.
#[derive(Clone, Debug)]
pub(super) struct ResidualModel {
    lengths: [Vec<[Bit; 33]>; KINDS],
    mixers: [Mixer<KINDS>; 33],
    second: [Bit; 33],
    third: [[Bit; 2]; 33],
    sign: [Bit; 3],
}

impl Default for ResidualModel {
    fn default() -> Self {
        Self {
            lengths: std::array::from_fn(|_| vec![[Bit::NEW; 33]; CONTEXTS]),
            mixers: [Mixer::new([26_000; KINDS]); 33],
            second: [Bit::NEW; 33],
            third: [[Bit::NEW; 2]; 33],
            sign: [Bit::NEW; 3],
        }
    }
}

impl ResidualModel {
    /// Codes a number in these contexts, each below [`CONTEXTS`]; `sign` is 0 to 2.
    pub(super) fn code<C: BitCoder>(
        &mut self,
        coder: &mut C,
        contexts: [usize; KINDS],
        sign: usize,
        known: i32,
    ) -> Result<i32, CodingError> {
        let n = if C::ENCODES { known.unsigned_abs() } else { 0 };
        let target = 32 - n.leading_zeros();
        let mut length = 0;
        loop {
            let at = length as usize;
            let [a, b, c] = &mut self.lengths;
            let models = [&mut a[contexts[0]][at], &mut b[contexts[1]][at], &mut c[contexts[2]][at]];
            let more = self.mixers[at].code(coder, models, || length < target);
            if !more {
                break;
            }
            length += 1;
            if length > 32 {
                return Err(CodingError::Number);
            }
        }
        if length == 0 {
            return Ok(0);
        }
        let mut value = 1u32;
        for k in (0..length - 1).rev() {
            let bit = || n >> k & 1 == 1;
            let at = length as usize;
            let bit = match length - 1 - k {
                1 => coder.bit(&mut self.second[at], bit),
                2 => coder.bit(&mut self.third[at][(value & 1) as usize], bit),
                _ => coder.even(bit),
            };
            value = value << 1 | u32::from(bit);
        }
        let negative = coder.bit(&mut self.sign[sign], || known < 0);
        Ok(if negative { value.wrapping_neg() } else { value } as i32)
    }
}
