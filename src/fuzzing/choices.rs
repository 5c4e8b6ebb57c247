//! Fuzz data as a series of choices.

/// What is left of the data. Where nothing is left, every choice is the first one.
#[derive(Clone, Debug)]
pub struct Choices<'a>(pub &'a [u8]);

impl<'a> Choices<'a> {
    /// The next byte.
    pub fn byte(&mut self) -> Option<u8> {
        let (&byte, rest) = self.0.split_first()?;
        self.0 = rest;
        Some(byte)
    }

    /// A number below `n`, or 0 for `n` = 0; one byte as long as that is enough, else two.
    pub fn below(&mut self, n: usize) -> usize {
        let mut value = usize::from(self.byte().unwrap_or(0));
        if n > 256 {
            value = value << 8 | usize::from(self.byte().unwrap_or(0));
        }
        value.checked_rem(n).unwrap_or(0)
    }

    /// Up to `n` bytes.
    pub fn bytes(&mut self, n: usize) -> &'a [u8] {
        let (taken, rest) = self.0.split_at(n.min(self.0.len()));
        self.0 = rest;
        taken
    }
}
