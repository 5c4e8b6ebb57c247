//! Edgebreaker: the connectivity of a whole mesh as one symbol a triangle (spec §7.1).
//!
//! Symbols C, L, E, R, S as in Rossignac 1999 on a corner table; the string is written and read backwards (Isenburg and Snoeyink
//! 2000), which needs no table of offsets; an S whose left gate was closed from the other side names that side, two of them a
//! handle (Lopes et al. 2002); each boundary loop is closed beforehand by a cap, a fan round a vertex of its own.

#[cfg(feature = "encode")]
mod cap;
mod decode;
#[cfg(feature = "encode")]
mod encode;

pub use decode::{ConnectivityError, decode};
#[cfg(feature = "encode")]
pub use encode::{Bits, encode};

use crate::entropy::{Bit, BitCoder, CodingError, NumberModel};

/// What a triangle is to the part of the mesh visited before it; x is its tip, entered over the edge y→z.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Symbol {
    /// x is new.
    C,
    /// Beyond z→x lies nothing unvisited.
    R,
    /// Beyond x→y lies nothing unvisited.
    L,
    /// Both sides lead on.
    S,
    /// Neither does.
    E,
}

/// The models of one connectivity payload.
#[derive(Debug)]
struct Models {
    /// Three decisions a symbol (C?, then R?, then L?, then S?), by triangles round the start of the active edge and last symbol.
    symbols: Vec<[Bit; 4]>,
    handle: Bit,
    distance: NumberModel,
    side: Bit,
    cap: [Bit; 32],
}

/// Counts of triangles round a vertex are told apart up to here.
const COUNTS: usize = 16;

impl Default for Models {
    fn default() -> Self {
        Self {
            symbols: vec![[Bit::NEW; 4]; COUNTS * 5],
            handle: Bit::NEW,
            distance: NumberModel::default(),
            side: Bit::NEW,
            cap: [Bit::NEW; 32],
        }
    }
}

impl Models {
    fn symbol<C: BitCoder>(
        &mut self,
        coder: &mut C,
        count: u8,
        last: Symbol,
        known: Option<Symbol>,
    ) -> Symbol {
        let bits = &mut self.symbols[(count as usize).min(COUNTS - 1) * 5 + last as usize];
        for (bit, symbol) in bits.iter_mut().zip([Symbol::C, Symbol::R, Symbol::L, Symbol::S]) {
            if coder.bit(bit, || known == Some(symbol)) {
                return symbol;
            }
        }
        Symbol::E
    }

    /// For an S: `None` where its left gate is the next one on the stack, else how many symbols before (in reading order) the
    /// triangle stands that closed it, and whether over its left edge.
    fn handle<C: BitCoder>(
        &mut self,
        coder: &mut C,
        known: Option<(u32, bool)>,
    ) -> Result<Option<(u32, bool)>, CodingError> {
        if !coder.bit(&mut self.handle, || known.is_some()) {
            return Ok(None);
        }
        let distance = self.distance.unsigned(coder, || known.map_or(0, |k| k.0))?;
        let left = coder.bit(&mut self.side, || known.is_some_and(|k| k.1));
        Ok(Some((distance, left)))
    }

    fn is_cap<C: BitCoder>(&mut self, coder: &mut C, valence: usize, known: bool) -> bool {
        coder.bit(&mut self.cap[valence.min(31)], || known)
    }
}
