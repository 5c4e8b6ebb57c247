//! The data of a PLY file as a run of numbers, in text or binary.

use std::marker::PhantomData;

use byteorder::ByteOrder;

use crate::error::{Error, InputError, Place, Result};

use super::decimals::attribute;
use super::ply_header::Scalar;
use super::text::{ENDS_EARLY, Words, binary32, number, quoted, whole};

/// Numbers one after the other. The header knows their types; in text they are words between blanks and line ends.
pub(super) trait Values {
    /// The next number.
    fn number(&mut self, scalar: Scalar) -> Result<f64>;
    /// The next number, which must be an integer, of whatever type it is.
    fn integer(&mut self, scalar: Scalar) -> Result<i64>;
    /// The next number of an attribute, which need not be finite, by its bits: as [`attributes::Values::bits`] tells them.
    ///
    /// [`attributes::Values::bits`]: crate::mesh::attributes::Values::bits
    fn bits(&mut self, scalar: Scalar) -> Result<u64>;
    /// Passes over `count` numbers.
    fn skip(&mut self, scalar: Scalar, count: u64) -> Result<()>;
    /// A fault in the number read last.
    fn fault(&self, what: impl Into<String>) -> Error;
    /// How many numbers of this type there can be at most in what is left.
    fn at_most(&self, scalar: Scalar) -> usize;
    /// What is left behind the last element, in words.
    fn rest(&mut self) -> Option<String>;
}

/// Binary numbers in the byte order B.
pub(super) struct Binary<'a, B> {
    bytes: &'a [u8],
    /// Where the number read last begins.
    at: usize,
    /// Where the next number begins, at most the length.
    next: usize,
    name: &'a str,
    order: PhantomData<B>,
}

impl<'a, B: ByteOrder> Binary<'a, B> {
    /// The data of `bytes` behind a header of `header` bytes.
    pub(super) fn new(bytes: &'a [u8], header: usize, name: &'a str) -> Self {
        Self { bytes, at: header, next: header, name, order: PhantomData }
    }

    /// The bytes of the next number.
    #[inline]
    fn take(&mut self, scalar: Scalar) -> Result<&'a [u8]> {
        self.at = self.next;
        let Some((taken, _)) = self.bytes[self.next..].split_at_checked(scalar.size()) else {
            return Err(self.fault(ENDS_EARLY));
        };
        self.next += taken.len();
        Ok(taken)
    }
}

impl<B: ByteOrder> Values for Binary<'_, B> {
    #[inline]
    fn number(&mut self, scalar: Scalar) -> Result<f64> {
        Ok(match scalar {
            Scalar::F32 => B::read_f32(self.take(scalar)?).into(),
            Scalar::F64 => B::read_f64(self.take(scalar)?),
            _ => self.integer(scalar)? as f64,
        })
    }

    #[inline]
    fn integer(&mut self, scalar: Scalar) -> Result<i64> {
        Ok(match scalar {
            Scalar::I8 => i64::from(self.take(scalar)?[0] as i8),
            Scalar::U8 => self.take(scalar)?[0].into(),
            Scalar::I16 => B::read_i16(self.take(scalar)?).into(),
            Scalar::U16 => B::read_u16(self.take(scalar)?).into(),
            Scalar::I32 => B::read_i32(self.take(scalar)?).into(),
            Scalar::U32 => B::read_u32(self.take(scalar)?).into(),
            Scalar::F32 | Scalar::F64 => {
                let x = self.number(scalar)?;
                whole(x).ok_or_else(|| self.fault(format!("{x} is not an integer")))?
            }
        })
    }

    #[inline]
    fn bits(&mut self, scalar: Scalar) -> Result<u64> {
        Ok(match scalar {
            Scalar::F32 => B::read_u32(self.take(scalar)?).into(),
            Scalar::F64 => B::read_u64(self.take(scalar)?),
            _ => self.integer(scalar)? as u64,
        })
    }

    fn skip(&mut self, scalar: Scalar, count: u64) -> Result<()> {
        let there = self.at_most(scalar);
        self.at = self.next;
        if count > there as u64 {
            self.at += there * scalar.size();
            return Err(self.fault(ENDS_EARLY));
        }
        self.next += count as usize * scalar.size();
        Ok(())
    }

    fn fault(&self, what: impl Into<String>) -> Error {
        InputError::new(self.name, Place::Byte(self.at as u64), what).into()
    }

    fn at_most(&self, scalar: Scalar) -> usize {
        (self.bytes.len() - self.next) / scalar.size()
    }

    fn rest(&mut self) -> Option<String> {
        let rest = self.bytes.len() - self.next;
        (rest > 0).then(|| format!("{rest} bytes after the last element"))
    }
}

/// Numbers in text.
pub(super) struct Text<'a>(Words<'a>);

impl<'a> Text<'a> {
    /// The data of `bytes` behind a header of `header` bytes and `lines` lines.
    pub(super) fn new(bytes: &'a [u8], header: usize, lines: u64, name: &'a str) -> Self {
        Self(Words::new(bytes, header, lines, name))
    }

    /// What there is to say of a word that is not a finite number of the declared type. What the word itself calls infinite
    /// or no number is left to the caller.
    #[cold]
    fn unsuitable(&self, word: &[u8], scalar: Scalar) -> Result<f64> {
        let what = match number(word) {
            None => "is not a number".to_owned(),
            Some(x) if !x.is_finite() => return Ok(x),
            Some(x) if scalar.integers().is_some() && x.fract() != 0.0 => {
                "is not an integer, as declared".to_owned()
            }
            Some(_) if scalar.integers().is_some() => {
                format!("is beyond the declared type, a {}-bit integer", 8 * scalar.size())
            }
            Some(_) => format!("is beyond the declared type, binary{}", 8 * scalar.size()),
        };
        Err(self.fault(format!("{} {what}", quoted(word))))
    }
}

impl Values for Text<'_> {
    #[inline]
    fn number(&mut self, scalar: Scalar) -> Result<f64> {
        let word = self.0.word().ok_or_else(|| self.fault(ENDS_EARLY))?;
        let value = match scalar {
            // Not by way of binary64, which would round twice.
            Scalar::F32 => binary32(word).map(f64::from),
            _ => number(word),
        };
        match (value, scalar.integers()) {
            (Some(x), None) if x.is_finite() || scalar == Scalar::F64 => Ok(x),
            (Some(x), Some((least, most))) if x.fract() == 0.0 && least <= x && x <= most => Ok(x),
            _ => self.unsuitable(word, scalar),
        }
    }

    fn bits(&mut self, scalar: Scalar) -> Result<u64> {
        let mut before = self.0.clone();
        // What C's libraries call no number is none.
        let x = self.number(scalar).or_else(|fault| {
            let read = before.word().and_then(attribute);
            read.filter(|x| x.is_nan() && scalar.integers().is_none()).ok_or(fault)
        })?;
        Ok(match scalar {
            Scalar::F32 => (x as f32).to_bits().into(),
            Scalar::F64 => x.to_bits(),
            _ => x as i64 as u64,
        })
    }

    #[inline]
    fn integer(&mut self, _: Scalar) -> Result<i64> {
        self.0.integer()
    }

    fn skip(&mut self, _: Scalar, count: u64) -> Result<()> {
        for _ in 0..count {
            self.0.word().ok_or_else(|| self.fault(ENDS_EARLY))?;
        }
        Ok(())
    }

    fn fault(&self, what: impl Into<String>) -> Error {
        self.0.fault(what)
    }

    fn at_most(&self, _: Scalar) -> usize {
        self.0.rest().len().div_ceil(2)
    }

    fn rest(&mut self) -> Option<String> {
        self.0.word().map(|_| "text after the last element".into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use byteorder::{BigEndian, LittleEndian};

    #[test]
    fn all_types_in_both_byte_orders() {
        let types = [
            (Scalar::I8, vec![0xfe], -2.0),
            (Scalar::U8, vec![0xfe], 254.0),
            (Scalar::I16, vec![0xff, 0xfe], -2.0),
            (Scalar::U16, vec![0xff, 0xfe], 65534.0),
            (Scalar::I32, vec![0x80, 0, 0, 1], -2147483647.0),
            (Scalar::U32, vec![0x80, 0, 0, 1], 2147483649.0),
            (Scalar::F32, vec![0xbf, 0xc0, 0, 0], -1.5),
            (Scalar::F64, vec![0xbf, 0xf8, 0, 0, 0, 0, 0, 0], -1.5),
        ];
        for (scalar, mut bytes, value) in types {
            assert_eq!(bytes.len(), scalar.size());
            assert_eq!(Binary::<BigEndian>::new(&bytes, 0, "").number(scalar).unwrap(), value);
            bytes.reverse();
            assert_eq!(Binary::<LittleEndian>::new(&bytes, 0, "").number(scalar).unwrap(), value);
        }
    }

    #[test]
    fn bits_are_those_of_the_file() {
        let signalling = [1, 0, 0xa0, 0xff];
        assert_eq!(Binary::<LittleEndian>::new(&signalling, 0, "").bits(Scalar::F32).unwrap(), 0xffa0_0001);
        let bytes = [0xfe, 0xfe, 0xff, 0x7f, 0xf0, 0, 0, 0, 0, 0, 1];
        let mut binary = Binary::<BigEndian>::new(&bytes, 0, "");
        let bits = [Scalar::I8, Scalar::U16, Scalar::F64].map(|scalar| binary.bits(scalar).unwrap());
        assert_eq!(bits, [-2i64 as u64, 0xfeff, 0x7ff0_0000_0000_0001]);

        let mut text = Text::new(b"-2 0.1 0.1 -nan(ind) inf 1e39", 0, 0, "a");
        assert_eq!(text.bits(Scalar::I16).unwrap(), -2i64 as u64);
        assert_eq!(text.bits(Scalar::F32).unwrap(), u64::from(0.1f32.to_bits()));
        assert_eq!(text.bits(Scalar::F64).unwrap(), 0.1f64.to_bits());
        assert!(f32::from_bits(text.bits(Scalar::F32).unwrap() as u32).is_nan());
        assert_eq!(text.bits(Scalar::F32).unwrap(), u64::from(f32::INFINITY.to_bits()));
        let error = text.bits(Scalar::F32).unwrap_err();
        assert_eq!(error.to_string(), "a: line 1: \"1e39\" is beyond the declared type, binary32");
    }

    #[test]
    fn indices_of_a_floating_point_type() {
        let bytes = [3.0f32, -1.0, 1.5, f32::NAN, 18446744073709551616.0].map(f32::to_le_bytes).concat();
        let mut binary = Binary::<LittleEndian>::new(&bytes, 0, "a");
        assert_eq!(binary.integer(Scalar::F32).unwrap(), 3);
        assert_eq!(binary.integer(Scalar::F32).unwrap(), -1);
        for (byte, number) in [(8, "1.5"), (12, "NaN"), (16, "18446744073709552000")] {
            let error = binary.integer(Scalar::F32).unwrap_err();
            assert_eq!(error.to_string(), format!("a: byte {byte}: {number} is not an integer"));
        }
        let mut text = Text::new(b"3.0 0 1. 2e0 -1.0 2.5 nan 1e30", 0, 0, "a");
        for n in [3, 0, 1, 2, -1] {
            assert_eq!(text.integer(Scalar::I32).unwrap(), n);
        }
        for word in ["2.5", "nan", "1e30"] {
            let error = text.integer(Scalar::I32).unwrap_err();
            assert_eq!(error.to_string(), format!("a: line 1: \"{word}\" is not an integer"));
        }
    }

    #[test]
    fn the_place_is_that_of_the_value() {
        let message = |result: Result<()>| result.unwrap_err().to_string();
        let mut binary = Binary::<LittleEndian>::new(&[9, 1, 0, 2, 0, 3], 1, "a");
        assert_eq!(binary.integer(Scalar::U16).unwrap(), 1);
        assert_eq!(message(binary.skip(Scalar::U16, u64::MAX)), "a: byte 5: the file ends early");
        assert_eq!(binary.integer(Scalar::U16).unwrap(), 2);
        assert_eq!(binary.fault("x").to_string(), "a: byte 3: x");
        assert_eq!(message(binary.number(Scalar::U16).map(drop)), "a: byte 5: the file ends early");
        assert_eq!(message(binary.integer(Scalar::F32).map(drop)), "a: byte 5: the file ends early");
        assert_eq!(binary.rest().unwrap(), "1 bytes after the last element");

        let mut text = Text::new(b"h 1\r\n 2.5\r\r3x\n", 1, 4, "a");
        assert_eq!(text.integer(Scalar::U8).unwrap(), 1);
        assert_eq!(message(text.integer(Scalar::U8).map(drop)), "a: line 6: \"2.5\" is not an integer");
        assert_eq!(message(text.number(Scalar::U8).map(drop)), "a: line 8: \"3x\" is not a number");
        assert_eq!(text.rest(), None);
        assert_eq!(message(text.skip(Scalar::U8, u64::MAX)), "a: line 9: the file ends early");
    }
}
