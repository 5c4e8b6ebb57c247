//! The coder of one value (spec §13.4, §13.5).

use super::column::Column;
use super::frame::Frame;
use super::numbers::{Integers, MOST};
use super::predict::{self, Guess, Memory};
use super::recall::{Neighbours, Recall};
use super::residual::ResidualModel;
use super::ring::{Beside, Ring};
use crate::entropy::{Bit, BitCoder, CodingError};
use crate::mesh::attributes::{Domain, Kind, Quantisation, Semantic, quantise};
use crate::mesh::prefetch::prefetch;
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
    /// By value, for each two integers [`Lengths`] of their residuals.
    lengths: Vec<u32>,
}

impl ValueModels {
    /// Bytes that they take beside themselves, without what grows with values.
    pub fn bytes(kind: &Kind) -> usize {
        let is_color = kind.domain == Domain::Corner && kind.semantic == Semantic::Color;
        let beside = size_of::<Neighbours>() + size_of::<Guess>() + MOST_WAYS;
        kind.integers() * size_of::<ResidualModel>() + beside + usize::from(is_color) * Recall::BYTES
    }

    /// Fresh ones.
    pub fn new(kind: &Kind) -> Self {
        let is_at_corners = kind.domain == Domain::Corner;
        let are_repeated = is_at_corners && kind.quantisation == Quantisation::Integer;
        let are_directions = matches!(kind.quantisation, Quantisation::Octahedral { .. });
        let are_few = is_at_corners && kind.semantic == Semantic::Color;
        Self {
            memory: Memory::default(),
            constant: true,
            again: Bit::NEW,
            any: false,
            neighbours: are_repeated.then(|| Box::new(Neighbours::new())),
            recall: are_few.then(|| Box::new(Recall::new())),
            numbers: vec![ResidualModel::new(are_directions); kind.integers()],
            guess: Box::default(),
            lengths: Vec::new(),
        }
    }

    /// Asks for the lengths of a value to be brought into the caches.
    #[inline(always)]
    pub fn prefetch(&self, at: u32) {
        if let Some(lengths) = self.lengths.get(at as usize * (self.numbers.len().div_ceil(2))) {
            prefetch(lengths);
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
        let n = column.integers();
        if self.constant && self.any {
            self.constant = coder.bit(&mut self.again, || truth == &self.memory.last[..n]);
            if self.constant {
                self.skip(column, at);
                return Ok(&self.memory.last[..n]);
            }
        }
        let mut round = [UNKNOWN; MOST];
        self.round(ring, n, &mut round);
        self.skip(column, at);
        ring.know(column);
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
        let pairs = column.integers().div_ceil(2);
        let from = at as usize * pairs;
        self.any = true;
        if pairs == 1 && self.lengths.len() == from {
            self.lengths.push(Lengths::NOTHING);
            return;
        }
        if self.lengths.len() < from + pairs {
            self.lengths.resize(from + pairs, Lengths::UNKNOWN);
        }
        self.lengths[from..from + pairs].fill(Lengths::NOTHING);
    }

    /// Mean bit lengths of the residuals of known neighbours, in halves; [`UNKNOWN`] where there are none.
    #[inline]
    fn round(&self, ring: &Ring, n: usize, means: &mut [u8; MOST]) {
        let pairs = n.div_ceil(2);
        if pairs == 1 {
            let of = |beside: &Beside| {
                self.lengths.get(beside.wedge as usize).copied().unwrap_or(Lengths::UNKNOWN)
            };
            [means[0], means[1]] = Lengths::means(ring.beside.iter().map(of).sum());
            return;
        }
        for pair in 0..pairs {
            let of =
                |wedge: u32| self.lengths.get((wedge as usize).saturating_mul(pairs).saturating_add(pair));
            let sum = ring.beside.iter().filter_map(|beside| of(beside.wedge)).sum();
            let [first, second] = Lengths::means(sum);
            means[2 * pair] = first;
            means[2 * pair + 1] = second;
        }
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
        let n = column.integers();
        let from = at as usize * n.div_ceil(2);
        let guess = &mut *self.guess;
        let expected = &mut guess.value;
        let frame = match column.kind.quantisation {
            Quantisation::Octahedral { bits } => {
                Some(Frame::new([expected[0], expected[1]], quantise::radius(bits)))
            }
            _ => None,
        };
        // The first two integers of what is written, in the frame.
        let mut wanted = [0; 2];
        if let Some(frame) = &frame {
            [expected[0], expected[1]] = frame.enter([expected[0], expected[1]]);
            if C::ENCODES {
                wanted = frame.enter([truth[0], truth[1]]);
            }
        }
        let wanted = |k: usize| match (C::ENCODES, frame.is_some() && k < 2) {
            (false, _) => 0,
            (true, true) => wanted[k],
            (true, false) => truth[k],
        };
        let value: &mut Integers = &mut self.memory.last;
        let (mut before, mut mirrored) = (UNKNOWN_LENGTH, false);
        let sources = guess.sources.min(2) * 13;
        for (k, numbers) in self.numbers.iter_mut().enumerate() {
            let known = wanted(k);
            if k > 0
                && let Some(recall) = &mut self.recall
                && let Some(number) = recall.code(coder, &value[..k], expected[k], known)
            {
                value[k] = number;
                before = bit_length(number.wrapping_sub(expected[k]).unsigned_abs());
                mirrored = false;
                self.lengths[from + k / 2] += Lengths::of(k, before);
                continue;
            }
            let spread = bit_length(guess.spread[k]).min(12) as usize;
            let contexts = [usize::from(round[k]), sources + spread, before as usize];
            let residual = numbers.code(coder, contexts, mirrored, known.wrapping_sub(expected[k]))?;
            before = bit_length(residual.unsigned_abs());
            mirrored = residual < 0;
            self.lengths[from + k / 2] += Lengths::of(k, before);
            value[k] = expected[k].wrapping_add(residual);
            if k > 0
                && let Some(recall) = &mut self.recall
            {
                let (before, number) = value.split_at(k);
                recall.learn(before, number[0]);
            }
        }
        if let Some(frame) = &frame {
            [value[0], value[1]] = frame.leave([value[0], value[1]]).ok_or(CodingError::Number)?;
        }
        coder.check()?;
        if !guess.ways.is_empty() {
            self.memory.judge(&guess.ways, n);
        }
        Ok(())
    }
}

/// The lengths of two integers' residuals, in 12 bits each, and above them how many there are: so that they are added all at once.
struct Lengths;

impl Lengths {
    /// Those of what these models have not coded.
    const UNKNOWN: u32 = 0;
    /// Those of what was as expected.
    const NOTHING: u32 = 1 << 24;
    /// The longest, so that the sum of all that may be in a ring stays within 12 bits.
    const MOST: u32 = 31;

    /// The length of one residual, that of integer `k`.
    #[inline]
    fn of(k: usize, length: u32) -> u32 {
        length.min(Self::MOST) << (12 * (k & 1))
    }

    /// The means of a sum, in halves.
    #[inline]
    fn means(sum: u32) -> [u8; 2] {
        let count = sum >> 24;
        [sum & 0xFFF, sum >> 12 & 0xFFF].map(|sum| {
            let mean = (2 * sum + count / 2).checked_div(count);
            mean.map_or(UNKNOWN, |mean| mean.min(UNKNOWN.into()) as u8)
        })
    }
}

/// What the list of ways takes.
const MOST_WAYS: usize = predict::WAYS.next_power_of_two() * size_of::<Integers>();
/// A context of its own.
const UNKNOWN: u8 = super::residual::UNKNOWN as u8;
/// The same, of the integer before the first one.
const UNKNOWN_LENGTH: u32 = UNKNOWN as u32;

fn bit_length(x: u32) -> u32 {
    32 - x.leading_zeros()
}
