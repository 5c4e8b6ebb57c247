//! Reads fields one after the other and knows where in the file each one stands.

use byteorder::{LE, ReadBytesExt};

use crate::entropy::varint;
use crate::error::FormatError;

/// A cursor over the bytes of one part of a file.
pub(super) struct Fields<'a> {
    rest: &'a [u8],
    end: u64,
    section: &'static str,
}

impl<'a> Fields<'a> {
    /// Starts at the front of `bytes`, which stand at `offset` in the file and are described in spec §`section`.
    pub fn new(bytes: &'a [u8], offset: u64, section: &'static str) -> Self {
        Self { rest: bytes, end: offset + bytes.len() as u64, section }
    }

    /// Where the next field starts in the file, in bytes.
    pub fn offset(&self) -> u64 {
        self.end - self.rest.len() as u64
    }

    /// Bytes left.
    pub fn left(&self) -> usize {
        self.rest.len()
    }

    /// These.
    pub fn left_bytes(&self) -> &'a [u8] {
        self.rest
    }

    /// One byte.
    pub fn u8(&mut self) -> Result<u8, FormatError> {
        self.fixed(|rest| rest.read_u8())
    }

    /// Two bytes, low byte first.
    pub fn u16(&mut self) -> Result<u16, FormatError> {
        self.fixed(|rest| rest.read_u16::<LE>())
    }

    /// Four bytes, low byte first.
    pub fn u32(&mut self) -> Result<u32, FormatError> {
        self.fixed(|rest| rest.read_u32::<LE>())
    }

    /// A finite binary64.
    pub fn f64(&mut self, name: &str) -> Result<f64, FormatError> {
        let at = self.offset();
        let value = self.fixed(|rest| rest.read_f64::<LE>())?;
        self.require(value.is_finite(), at, || format!("{name} is not finite"))?;
        Ok(value)
    }

    /// A finite binary32.
    pub fn f32(&mut self, name: &str) -> Result<f64, FormatError> {
        let at = self.offset();
        let value = f64::from(self.fixed(|rest| rest.read_f32::<LE>())?);
        self.require(value.is_finite(), at, || format!("{name} is not finite"))?;
        Ok(value)
    }

    /// A finite binary32 where it is `short`, else a finite binary64.
    pub fn real(&mut self, short: bool, name: &str) -> Result<f64, FormatError> {
        if short { self.f32(name) } else { self.f64(name) }
    }

    /// So many bytes.
    pub fn bytes(&mut self, count: usize) -> Result<&'a [u8], FormatError> {
        let at = self.offset();
        let (taken, rest) =
            self.rest.split_at_checked(count).ok_or_else(|| self.fault(at, NO_ROOM.to_owned()))?;
        self.rest = rest;
        Ok(taken)
    }

    /// A variable-length integer of at most `limit` (spec §3.6).
    pub fn count(&mut self, limit: u32, name: &str) -> Result<u32, FormatError> {
        let at = self.offset();
        let value = varint::read(&mut self.rest)
            .ok_or_else(|| self.fault(at, format!("{name} is not an integer in its shortest form")))?;
        match u32::try_from(value) {
            Ok(value) if value <= limit => Ok(value),
            _ => Err(FormatError::new(at, "3.6", format!("{name} is {value}, allowed {limit}"))),
        }
    }

    /// A fault at `at` where `holds` is false.
    pub fn require(&self, holds: bool, at: u64, what: impl FnOnce() -> String) -> Result<(), FormatError> {
        if holds { Ok(()) } else { Err(self.fault(at, what())) }
    }

    /// A fault at `at`.
    pub fn fault(&self, at: u64, what: String) -> FormatError {
        FormatError::new(at, self.section, what)
    }

    fn fixed<T>(&mut self, read: impl FnOnce(&mut &[u8]) -> std::io::Result<T>) -> Result<T, FormatError> {
        let at = self.offset();
        read(&mut self.rest).map_err(|_| self.fault(at, NO_ROOM.to_owned()))
    }
}

/// Whether a binary32 holds it to the last bit, the sign of zero included.
pub(super) fn is_short(x: f64) -> bool {
    f64::from(x as f32).to_bits() == x.to_bits()
}

const NO_ROOM: &str = "a field has no room left";
