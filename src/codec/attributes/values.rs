//! The coder of one value (spec §13.4, §13.5).

use super::column::Column;
use super::frame::Frame;
use super::numbers::{Integers, MOST};
use super::predict::{self, Guess, Memory, WAYS};
use super::residual::ResidualModel;
use crate::entropy::{Bit, BitCoder, CodingError};
use crate::mesh::Corner;
use crate::mesh::attributes::{Kind, Quantisation, quantise};
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
    numbers: Vec<ResidualModel>,
    /// How well each way of guessing did, by integer: mean bit lengths of what was missing, in units of 1/32.
    costs: [[u32; WAYS]; MOST],
    /// By value and integer, bit lengths of residuals.
    lengths: Vec<u8>,
}

impl ValueModels {
    /// Fresh ones.
    pub fn new(kind: &Kind) -> Self {
        Self {
            memory: Memory::default(),
            constant: true,
            again: Bit::NEW,
            any: false,
            numbers: vec![ResidualModel::default(); kind.integers()],
            costs: [[0; WAYS]; MOST],
            lengths: Vec::new(),
        }
    }

    /// Codes the next value of a column: `truth` where it is written. `corners` are those of its wedge, a run of its vertex's fan,
    /// counter-clockwise; none where it is no wedge of the mesh. `before` is a value to start from where nothing round it is known.
    ///
    /// # Errors
    /// [`CodingError`] where the value is none.
    #[expect(clippy::too_many_arguments)]
    pub fn code<C: BitCoder>(
        &mut self,
        coder: &mut C,
        around: &Around,
        column: &Column,
        at: u32,
        corners: &[Corner],
        before: Option<u32>,
        truth: &[i32],
    ) -> Result<Vec<i32>, CodingError> {
        let n = column.kind.integers();
        if self.constant && self.any {
            self.constant = coder.bit(&mut self.again, || truth == &self.memory.last[..n]);
            if self.constant {
                self.skip(column, at);
                return Ok(self.memory.last[..n].to_vec());
            }
        }
        let guess = predict::guess(&mut self.memory, around, column, corners, before);
        let near = self.near(around, column, corners);
        let value = self.residuals(coder, column, at, &guess, &near, truth)?;
        self.memory.last[..n].copy_from_slice(&value[..n]);
        Ok(value[..n].to_vec())
    }

    /// The value of a wedge is as expected, or none.
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
    fn near(&self, around: &Around, column: &Column, corners: &[Corner]) -> [usize; MOST] {
        let n = column.kind.integers();
        let (mut sums, mut count) = ([0; MOST], 0);
        for c in corners.iter().flat_map(|c| [c.next(), c.prev()]) {
            let wedge = around.wedges.of(c) as usize;
            if let Some(lengths) = self.lengths.get(wedge.saturating_mul(n)..).and_then(|rest| rest.get(..n))
                && lengths[0] != NOT_CODED
            {
                lengths.iter().zip(&mut sums).for_each(|(&length, sum)| *sum += usize::from(length));
                count += 1;
            }
        }
        sums.map(|sum| (2 * sum + count / 2).checked_div(count).unwrap_or(UNKNOWN).min(UNKNOWN))
    }

    fn residuals<C: BitCoder>(
        &mut self,
        coder: &mut C,
        column: &Column,
        at: u32,
        guess: &Guess,
        near: &[usize; MOST],
        truth: &[i32],
    ) -> Result<Integers, CodingError> {
        let n = column.kind.integers();
        self.skip(column, at);
        let from = at as usize * n;
        let mut expected: Integers = std::array::from_fn(|k| guess.ways[self.best(k, guess.count)][k]);
        let mut wanted = [0; MOST];
        wanted.iter_mut().zip(truth).for_each(|(wanted, &truth)| *wanted = truth);
        let frame = match column.kind.quantisation {
            Quantisation::Octahedral { bits } => {
                let way = self.best(0, guess.count);
                expected = guess.ways[way];
                Some(Frame::new([expected[0], expected[1]], quantise::radius(bits)))
            }
            _ => None,
        };
        if let Some(frame) = &frame {
            for value in [&mut expected, &mut wanted] {
                let at = frame.enter([value[0], value[1]]);
                value[..2].copy_from_slice(&at);
            }
        }
        let mut value = [0; MOST];
        let (mut before, mut sign) = (0, 0);
        for k in 0..n {
            let spread = bit_length(guess.spread[k]).min(12) as usize;
            let last = if k == 0 { UNKNOWN } else { bit_length(before) as usize };
            let contexts = [near[k], guess.sources.min(2) * 13 + spread, last];
            let residual =
                self.numbers[k].code(coder, contexts, sign, wanted[k].wrapping_sub(expected[k]))?;
            before = residual.unsigned_abs();
            sign = usize::from(residual > 0) + 2 * usize::from(residual < 0);
            self.lengths[from + k] = bit_length(before) as u8;
            value[k] = expected[k].wrapping_add(residual);
        }
        if let Some(frame) = &frame {
            let at = frame.leave([value[0], value[1]]).ok_or(CodingError::Number)?;
            value[..2].copy_from_slice(&at);
        }
        coder.check()?;
        self.judge(guess, &value, n);
        Ok(value)
    }

    /// The way of guessing that did best so far.
    fn best(&self, k: usize, count: usize) -> usize {
        (0..count).min_by_key(|&way| self.costs[k][way]).unwrap_or(0)
    }

    fn judge(&mut self, guess: &Guess, value: &Integers, n: usize) {
        if guess.count < 2 {
            return;
        }
        for (k, (&value, costs)) in value.iter().zip(&mut self.costs).take(n).enumerate() {
            for (way, cost) in guess.ways.iter().zip(costs).take(guess.count) {
                let off = bit_length(value.wrapping_sub(way[k]).unsigned_abs());
                *cost = *cost - (*cost >> 6) + off;
            }
        }
    }
}

/// The length of what these models have not coded.
const NOT_CODED: u8 = u8::MAX;
/// A context of its own.
const UNKNOWN: usize = super::residual::CONTEXTS - 1;

fn bit_length(x: u32) -> u32 {
    32 - x.leading_zeros()
}
