//! Range coder, binary models, their mixing, numbers, symbols. Knows no mesh; takes slices (spec §6).

pub mod mix;
pub mod model;
pub mod number;
pub mod range;
pub mod symbol;
pub mod varint;

pub use mix::{Mixer, Outcomes};
pub use model::Bit;
pub use number::{NumberModel, uniform};
pub use range::RangeDecoder;
#[cfg(any(test, feature = "encode"))]
pub use range::RangeEncoder;
pub use symbol::SymbolModel;

/// One side of the range coder. The same code walks a payload for writing and for reading: where it writes, `known` gives the
/// decision; where it reads, `known` is not called and the decision comes from the bytes. So the two sides cannot drift apart.
pub trait BitCoder {
    /// Whether this side writes.
    const ENCODES: bool;

    /// Codes a decision under an adaptive model.
    fn bit(&mut self, model: &mut Bit, known: impl FnOnce() -> bool) -> bool;

    /// Codes a decision whose chance of being 0 is `zero`, in units of 2^-16, 32 to 65504.
    fn decide(&mut self, zero: u32, known: impl FnOnce() -> bool) -> bool;

    /// Codes a decision at an even chance.
    fn even(&mut self, known: impl FnOnce() -> bool) -> bool;

    /// Codes a symbol, 0 to 15, under an adaptive model.
    fn symbol(&mut self, model: &mut SymbolModel, known: impl FnOnce() -> usize) -> usize;

    /// Codes a number of `count` bits, 16 at most, each at an even chance.
    fn bits(&mut self, count: u32, known: impl FnOnce() -> u32) -> u32;

    /// Codes a number below `count`, which is 1 to 2^16, each at the same chance.
    fn below(&mut self, count: u32, known: impl FnOnce() -> u32) -> u32;

    /// Whether the decisions read so far can have come from the bytes at hand.
    ///
    /// # Errors
    /// [`CodingError::Truncated`] where far more was read than there is.
    fn check(&self) -> Result<(), CodingError>;

    /// Bits written so far, for statistics; 0 where this side reads.
    fn spent(&self) -> f64 {
        0.0
    }
}

/// A payload's code is longer or shorter than its content.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CodingError {
    /// Bytes are left over.
    #[error("bytes are left over at the end of the payload")]
    Trailing,
    /// Bytes are missing.
    #[error("the payload is too short for its content")]
    Truncated,
    /// A number has more bits than any valid one.
    #[error("a number in the payload is out of range")]
    Number,
}
