//! The coder of one value (spec §13.4, §13.5).

use super::column::Column;
use super::frame::Frame;
use super::numbers::{Integers, MOST};
use super::predict::{self, Guess, Memory};
use super::recall::{Neighbours, Recall};
use super::residual::ResidualModel;
use super::ring::Ring;
use crate::entropy::{Bit, BitCoder, CodingError};
use crate::mesh::attributes::{Domain, Kind, Quantisation, Semantic, quantise};
use crate::refine::{ProgressiveMesh, Wedges};

/// What is known round a wedge: all positions, and wedges as far as they have been coded.
pub struct Around<'a> {
    pub mesh: &'a ProgressiveMesh,
    pub wedges: &'a Wedges,
}

/// Models of an attribute's values.
#[derive(Debug)]
pub struct ValueModels {
    memory: Memory,
    /// Whether all values so far were the same.
    constant: bool,
    /// Whether another one is.
    again: Bit,
    /// Whether there has been one, or none where one might be.
    any: bool,
    /// Where values are often those of neighbours.
    neighbours: Option<Box<Neighbours>>,
    /// Where integers often stand behind the same ones.
    recall: Option<Box<Recall>>,
    numbers: Vec<ResidualModel>,
    guess: Box<Guess>,
    /// By value and integer, bit lengths of residuals.
    lengths: Vec<u8>,
}

impl ValueModels {
    /// Fresh ones.
    pub fn new(kind: &Kind) -> Self {
        let is_at_corners = kind.domain == Domain::Corner;
        let are_repeated = is_at_corners && kind.quantisation == Quantisation::Integer;
        let are_few = is_at_corners && kind.semantic == Semantic::Color;
        Self {
            memory: Memory::default(),
            constant: true,
            again: Bit::NEW,
            any: false,
            neighbours: are_repeated.then(|| Box::new(Neighbours::new())),
            recall: are_few.then(|| Box::new(Recall::new())),
            numbers: vec![ResidualModel::default(); kind.integers()],
            guess: Box::default(),
            lengths: Vec::new(),
        }
    }

    /// Codes the next value of a column: `truth` where it is written. `ring` is what is round its wedge; nothing where it is no wedge of
    /// the mesh. `before` is a value to start from where nothing round it is known.
    ///
    /// # Errors
    /// [`CodingError`] where the value is none.
    #[expect(clippy::too_many_arguments)]
    pub fn code<C: BitCoder>(
        &mut self,
        coder: &mut C,
        around: &Around,
        ring: &mut Ring,
        column: &Column,
        at: u32,
        before: Option<u32>,
        truth: &[i32],
    ) -> Result<&[i32], CodingError> {
        let n = column.kind.integers();
        if self.constant && self.any {
            self.constant = coder.bit(&mut self.again, || truth == &self.memory.last[..n]);
            if self.constant {
                self.skip(column, at);
                return Ok(&self.memory.last[..n]);
            }
        }
        let round = self.round(ring, n);
        self.skip(column, at);
        if let Some(neighbours) = &mut self.neighbours {
            let of_first = match round[0] {
                0 => 0,
                1..=5 => 1,
                UNKNOWN => 3,
                _ => 2,
            };
            if let Some(wedge) = neighbours.code(coder, column, ring, of_first, truth) {
                self.memory.last[..n].copy_from_slice(column.value(wedge).unwrap_or(&[0; MOST][..n]));
                return Ok(&self.memory.last[..n]);
            }
        }
        predict::guess(&mut self.guess, &mut self.memory, around, column, ring, before);
        self.residuals(coder, column, at, &round, truth)?;
        Ok(&self.memory.last[..n])
    }

    /// The value of a wedge is as expected, or none.
    #[inline]
    pub fn skip(&mut self, column: &Column, at: u32) {
        let n = column.kind.integers();
        let from = at as usize * n;
        if self.lengths.len() < from + n {
            self.lengths.resize(from + n, NOT_CODED);
        }
        self.lengths[from..from + n].fill(0);
        self.any = true;
    }

    /// Mean bit lengths of the residuals of known neighbours, in halves; [`UNKNOWN`] where there are none.
    #[inline]
    fn round(&self, ring: &Ring, n: usize) -> [u8; MOST] {
        let (mut sums, mut count) = ([0u16; MOST], 0u16);
        for beside in &ring.beside {
            let from = (beside.wedge as usize).saturating_mul(n);
            if let Some(lengths) = self.lengths.get(from..from.saturating_add(n))
                && lengths[0] != NOT_CODED
            {
                for (&length, sum) in lengths.iter().zip(&mut sums) {
                    *sum += u16::from(length);
                }
                count += 1;
            }
        }
        let mut means = [UNKNOWN; MOST];
        for (mean, sum) in means.iter_mut().zip(sums).take(n) {
            let known = (2 * sum + count / 2).checked_div(count);
            *mean = known.map_or(UNKNOWN, |known| known.min(UNKNOWN.into()) as u8);
        }
        means
    }

    /// Codes a value by what is missing to the one expected.
    #[inline]
    fn residuals<C: BitCoder>(
        &mut self,
        coder: &mut C,
        column: &Column,
        at: u32,
        round: &[u8; MOST],
        truth: &[i32],
    ) -> Result<(), CodingError> {
        let n = column.kind.integers();
        let from = at as usize * n;
        let guess = &mut *self.guess;
        let expected = &mut guess.value;
        let mut wanted = [0; MOST];
        if C::ENCODES {
            wanted[..n].copy_from_slice(&truth[..n]);
        }
        let frame = match column.kind.quantisation {
            Quantisation::Octahedral { bits } => {
                Some(Frame::new([expected[0], expected[1]], quantise::radius(bits)))
            }
            _ => None,
        };
        if let Some(frame) = &frame {
            for value in [&mut *expected, &mut wanted] {
                let at = frame.enter([value[0], value[1]]);
                value[..2].copy_from_slice(&at);
            }
        }
        let value: &mut Integers = &mut self.memory.last;
        let (mut before, mut mirrored) = (0, false);
        for k in 0..n {
            if k > 0
                && let Some(recall) = &mut self.recall
                && let Some(number) = recall.code(coder, &value[..k], expected[k], wanted[k])
            {
                value[k] = number;
                before = number.wrapping_sub(expected[k]).unsigned_abs();
                mirrored = false;
                self.lengths[from + k] = bit_length(before) as u8;
                continue;
            }
            let spread = bit_length(guess.spread[k]).min(12) as usize;
            let last = if k == 0 { usize::from(UNKNOWN) } else { bit_length(before) as usize };
            let contexts = [usize::from(round[k]), guess.sources.min(2) * 13 + spread, last];
            let off = wanted[k].wrapping_sub(expected[k]);
            let residual = self.numbers[k].code(coder, contexts, mirrored, off)?;
            before = residual.unsigned_abs();
            mirrored = residual < 0;
            self.lengths[from + k] = bit_length(before) as u8;
            value[k] = expected[k].wrapping_add(residual);
            if k > 0
                && let Some(recall) = &mut self.recall
            {
                let (before, number) = value.split_at(k);
                recall.learn(before, number[0]);
            }
        }
        if let Some(frame) = &frame {
            let at = frame.leave([value[0], value[1]]).ok_or(CodingError::Number)?;
            value[..2].copy_from_slice(&at);
        }
        coder.check()?;
        self.memory.judge(&guess.ways, n);
        Ok(())
    }
}

/// The length of what these models have not coded.
const NOT_CODED: u8 = u8::MAX;
/// A context of its own.
const UNKNOWN: u8 = super::residual::CONTEXTS as u8 - 1;

fn bit_length(x: u32) -> u32 {
    32 - x.leading_zeros()
}
