//! Numbers of an attribute as its source stores them.

/// How a source stores a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Stored {
    /// 8 bits, no sign.
    U8,
    /// 8 bits with a sign.
    I8,
    /// 16 bits, no sign.
    U16,
    /// 16 bits with a sign.
    I16,
    /// 32 bits, no sign.
    U32,
    /// 32 bits with a sign.
    I32,
    /// IEEE 754 binary32.
    F32,
    /// IEEE 754 binary64.
    F64,
}

impl Stored {
    /// All of them, in the order of their numbers in a file (spec §3.3).
    pub const ALL: [Self; 8] =
        [Self::U8, Self::I8, Self::U16, Self::I16, Self::U32, Self::I32, Self::F32, Self::F64];

    /// What it is called in reports, e.g. `"f32"`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::U8 => "u8",
            Self::I8 => "i8",
            Self::U16 => "u16",
            Self::I16 => "i16",
            Self::U32 => "u32",
            Self::I32 => "i32",
            Self::F32 => "f32",
            Self::F64 => "f64",
        }
    }

    /// Whether it is a floating-point number.
    pub const fn is_float(self) -> bool {
        matches!(self, Self::F32 | Self::F64)
    }

    /// The integer that stands for 1 where integers stand for fractions, the largest; none of floating-point numbers.
    pub const fn one(self) -> Option<f64> {
        match self {
            Self::U8 => Some(u8::MAX as f64),
            Self::I8 => Some(i8::MAX as f64),
            Self::U16 => Some(u16::MAX as f64),
            Self::I16 => Some(i16::MAX as f64),
            Self::U32 => Some(u32::MAX as f64),
            Self::I32 => Some(i32::MAX as f64),
            Self::F32 | Self::F64 => None,
        }
    }
}

/// Numbers as they are stored.
#[derive(Clone, Debug, PartialEq)]
pub enum Values {
    /// [`Stored::U8`].
    U8(Vec<u8>),
    /// [`Stored::I8`].
    I8(Vec<i8>),
    /// [`Stored::U16`].
    U16(Vec<u16>),
    /// [`Stored::I16`].
    I16(Vec<i16>),
    /// [`Stored::U32`].
    U32(Vec<u32>),
    /// [`Stored::I32`].
    I32(Vec<i32>),
    /// [`Stored::F32`].
    F32(Vec<f32>),
    /// [`Stored::F64`].
    F64(Vec<f64>),
}

impl Values {
    /// No numbers yet, of a type.
    pub fn new(stored: Stored) -> Self {
        match stored {
            Stored::U8 => Self::U8(Vec::new()),
            Stored::I8 => Self::I8(Vec::new()),
            Stored::U16 => Self::U16(Vec::new()),
            Stored::I16 => Self::I16(Vec::new()),
            Stored::U32 => Self::U32(Vec::new()),
            Stored::I32 => Self::I32(Vec::new()),
            Stored::F32 => Self::F32(Vec::new()),
            Stored::F64 => Self::F64(Vec::new()),
        }
    }

    /// Their type.
    pub fn stored(&self) -> Stored {
        match self {
            Self::U8(_) => Stored::U8,
            Self::I8(_) => Stored::I8,
            Self::U16(_) => Stored::U16,
            Self::I16(_) => Stored::I16,
            Self::U32(_) => Stored::U32,
            Self::I32(_) => Stored::I32,
            Self::F32(_) => Stored::F32,
            Self::F64(_) => Stored::F64,
        }
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        match self {
            Self::U8(list) => list.len(),
            Self::I8(list) => list.len(),
            Self::U16(list) => list.len(),
            Self::I16(list) => list.len(),
            Self::U32(list) => list.len(),
            Self::I32(list) => list.len(),
            Self::F32(list) => list.len(),
            Self::F64(list) => list.len(),
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// A number; all types are exact as binary64.
    ///
    /// # Panics
    /// Where there is no such number.
    pub fn number(&self, at: usize) -> f64 {
        match self {
            Self::F64(list) => list[at],
            Self::F32(list) => list[at].into(),
            Self::U8(list) => list[at].into(),
            Self::I8(list) => list[at].into(),
            Self::U16(list) => list[at].into(),
            Self::I16(list) => list[at].into(),
            Self::U32(list) => list[at].into(),
            Self::I32(list) => list[at].into(),
        }
    }

    /// A number as what it stands for: where integers stand for fractions (`normalised`), -1 to 1.
    ///
    /// # Panics
    /// Where there is no such number.
    pub fn fraction(&self, at: usize, normalised: bool) -> f64 {
        let x = self.number(at);
        match self.stored().one().filter(|_| normalised) {
            Some(one) => (x / one).max(-1.0),
            None => x,
        }
    }

    /// Its bits, those of an integer with its sign extended to 64 bits; what tells any two numbers apart.
    ///
    /// # Panics
    /// Where there is no such number.
    pub fn bits(&self, at: usize) -> u64 {
        match self {
            Self::F32(list) => list[at].to_bits().into(),
            Self::F64(list) => list[at].to_bits(),
            Self::U8(list) => list[at].into(),
            Self::U16(list) => list[at].into(),
            Self::U32(list) => list[at].into(),
            Self::I8(list) => i64::from(list[at]) as u64,
            Self::I16(list) => i64::from(list[at]) as u64,
            Self::I32(list) => i64::from(list[at]) as u64,
        }
    }

    /// Appends the number of these bits, as [`Values::bits`] tells them; bits that the type has not are cut off.
    pub fn push_bits(&mut self, bits: u64) {
        match self {
            Self::F32(list) => list.push(f32::from_bits(bits as u32)),
            Self::F64(list) => list.push(f64::from_bits(bits)),
            Self::U8(list) => list.push(bits as u8),
            Self::U16(list) => list.push(bits as u16),
            Self::U32(list) => list.push(bits as u32),
            Self::I8(list) => list.push(bits as i8),
            Self::I16(list) => list.push(bits as i16),
            Self::I32(list) => list.push(bits as i32),
        }
    }

    /// Appends the nearest number of the type: integers are rounded, halves away from zero, and kept in range; no number becomes 0 there.
    pub fn push(&mut self, x: f64) {
        match self {
            Self::F32(list) => list.push(x as f32),
            Self::F64(list) => list.push(x),
            Self::U8(list) => list.push(x.round() as u8),
            Self::U16(list) => list.push(x.round() as u16),
            Self::U32(list) => list.push(x.round() as u32),
            Self::I8(list) => list.push(x.round() as i8),
            Self::I16(list) => list.push(x.round() as i16),
            Self::I32(list) => list.push(x.round() as i32),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_bring_every_number_back() {
        for stored in Stored::ALL {
            let mut values = Values::new(stored);
            let all = [0u64, 1, 127, 128, 255, 0x7FC0_0001, 0xFFFF_FFFF, 0x7FF8_0000_0000_0001, u64::MAX];
            all.iter().for_each(|&bits| values.push_bits(bits));
            let mut again = Values::new(stored);
            (0..values.len()).for_each(|at| again.push_bits(values.bits(at)));
            let same = (0..values.len()).all(|at| values.bits(at) == again.bits(at));
            assert!(same && values.stored() == stored && again.len() == all.len(), "{stored:?}");
        }
    }

    #[test]
    fn numbers_are_rounded_and_kept_in_range() {
        for (stored, wanted) in [(Stored::U8, [0.0, 255.0, 3.0]), (Stored::I8, [-128.0, 127.0, 3.0])] {
            let mut values = Values::new(stored);
            [-1000.0, 1000.0, 2.5].into_iter().for_each(|x| values.push(x));
            assert_eq!([0, 1, 2].map(|at| values.number(at)), wanted, "{stored:?}");
        }
    }
}
