//! Vertices that a mesh shares with another one on the same lattice: named by how near they are to where they are looked for (spec §15.2).

use super::edgebreaker::ConnectivityError;
use crate::entropy::{Bit, BitCoder, NumberModel};
use crate::limits::Budget;
use bitvec::vec::BitVec;
use std::cmp::Reverse;
use std::collections::BinaryHeap;
#[cfg(feature = "encode")]
use std::collections::HashMap;

/// The vertices of the other mesh, those that have been named among them, and the models by which they are.
#[derive(Debug)]
pub struct Shared<'a> {
    /// Where they are, on the lattice, in their order there.
    places: &'a [[i32; 3]],
    /// Their numbers, by the interleaved bits of their coordinates, and these: a cell of any size is a run.
    cells: Vec<(u128, u32)>,
    /// Those that have been named.
    named: BitVec,
    /// For a writer, numbers by place.
    #[cfg(feature = "encode")]
    numbers: HashMap<[i32; 3], Vec<u32>>,
    /// Which vertices are there to be named: distance from where one is looked for, and number.
    candidates: Vec<Reverse<(u64, u32)>>,
    /// The vertex named last.
    last: i32,
    /// Whether the two vertices before were shared.
    before: usize,
    is_shared: [[Bit; NEARNESSES]; 4],
    first_is_shared: [Bit; 4],
    first: NumberModel,
    rank: [NumberModel; COUNTS],
}

impl<'a> Shared<'a> {
    /// None has been named. Coordinates are at least 0 and have at most 24 bits.
    ///
    /// # Errors
    /// [`Error::Limit`](crate::Error::Limit) where memory or work are not allowed.
    pub fn new(places: &'a [[i32; 3]], budget: &mut Budget) -> crate::Result<Self> {
        budget.take_memory(places.len(), BYTES_A_VERTEX)?;
        budget.take_work(WORK_A_VERTEX * places.len() as u64)?;
        Ok(Self {
            places,
            cells: sorted((0..).zip(places).map(|(k, &place)| (interleaved(place), k)).collect()),
            named: BitVec::repeat(false, places.len()),
            #[cfg(feature = "encode")]
            numbers: HashMap::new(),
            candidates: Vec::new(),
            last: 0,
            before: 3,
            is_shared: [[Bit::NEW; NEARNESSES]; 4],
            first_is_shared: [Bit::NEW; 4],
            first: NumberModel::default(),
            rank: std::array::from_fn(|_| NumberModel::default()),
        })
    }

    /// Bytes that one takes of so many vertices.
    pub fn bytes(vertices: usize) -> usize {
        vertices * BYTES_A_VERTEX
    }

    /// Tells whether a vertex of a component's first triangle is one of them, and where that is. `truth` is where it is, for a writer.
    ///
    /// # Errors
    /// [`ConnectivityError`] where there is no such vertex, or it has been named.
    pub fn first<C: BitCoder>(
        &mut self,
        coder: &mut C,
        truth: [i32; 3],
    ) -> Result<Option<[i32; 3]>, ConnectivityError> {
        let known = if C::ENCODES { self.numbered(truth) } else { None };
        let is_shared = coder.bit(&mut self.first_is_shared[self.before], || known.is_some());
        self.before = self.before << 1 & 2 | usize::from(is_shared);
        if !is_shared {
            return Ok(None);
        }
        let last = self.last;
        let number = last.wrapping_add(self.first.signed(coder, || known.unwrap_or(0) as i32 - last)?);
        self.name(usize::try_from(number).ok()).map(Some)
    }

    /// Tells whether a vertex that is looked for at `prediction`, beyond an edge that is `size` long, is one of them, and where that is.
    ///
    /// # Errors
    /// [`ConnectivityError`] where there are not so many, or the budget is spent.
    pub fn next<C: BitCoder>(
        &mut self,
        coder: &mut C,
        prediction: [i32; 3],
        size: u32,
        truth: [i32; 3],
        budget: &mut Budget,
    ) -> Result<Option<[i32; 3]>, ConnectivityError> {
        let bits = u32::BITS - size.leading_zeros();
        self.look(prediction, (bits + 1).min(24), budget)?;
        let Some(&Reverse((nearest, _))) = self.candidates.iter().max() else { return Ok(None) };
        let far = (u64::BITS - nearest.leading_zeros()) as usize;
        let nearness = (2 * bits as usize + 5).saturating_sub(far).min(NEARNESSES - 1);
        let rank = if C::ENCODES { self.rank_of(truth) } else { None };
        let is_shared = coder.bit(&mut self.is_shared[self.before][nearness], || rank.is_some());
        self.before = self.before << 1 & 2 | usize::from(is_shared);
        if !is_shared {
            return Ok(None);
        }
        let count = self.candidates.len();
        let bits = (usize::BITS - count.leading_zeros()) as usize;
        let model = &mut self.rank[bits.min(COUNTS - 1)];
        let rank = model.unsigned(coder, || rank.unwrap_or(0))? as usize;
        if rank >= count {
            return Err(ConnectivityError::Mesh("a shared vertex that is not there".to_owned()));
        }
        let mut nearest: BinaryHeap<_> = std::mem::take(&mut self.candidates).into();
        for _ in 0..rank {
            nearest.pop();
        }
        let number = nearest.peek().map(|&Reverse((_, number))| number as usize);
        self.candidates = nearest.into_vec();
        self.name(number).map(Some)
    }

    /// Gathers those not named in the eight cells of 2^`shift` a side that are nearest to a point.
    fn look(&mut self, point: [i32; 3], shift: u32, budget: &mut Budget) -> crate::Result<()> {
        self.candidates.clear();
        let low = point.map(|x| (i64::from(x) - (1i64 << shift >> 1)) >> shift);
        let last = 1i64 << (24 - shift);
        for k in 0..8 {
            let cell: [i64; 3] = std::array::from_fn(|i| low[i] + (k >> i & 1));
            if cell.iter().any(|x| !(0..last).contains(x)) {
                continue;
            }
            let least = interleaved(cell.map(|x| (x << shift) as i32));
            let from = self.cells.partition_point(|&(code, _)| code < least);
            let rest = &self.cells[from..];
            let run = &rest[..rest.partition_point(|&(code, _)| code - least < 1u128 << (3 * shift))];
            budget.take_work(WORK_A_CELL + run.len() as u64)?;
            for &(_, number) in run {
                if !self.named[number as usize] {
                    let place = self.places[number as usize];
                    let squares =
                        (0..3).map(|i| i64::from(place[i]) - i64::from(point[i])).map(|x| (x * x) as u64);
                    self.candidates.push(Reverse((squares.sum(), number)));
                }
            }
        }
        Ok(())
    }

    /// How many candidates come before the first at a place, if there is one.
    fn rank_of(&self, truth: [i32; 3]) -> Option<u32> {
        let here =
            self.candidates.iter().filter(|Reverse((_, number))| self.places[*number as usize] == truth);
        let own = here.max()?;
        Some(self.candidates.iter().filter(|&other| other > own).count() as u32)
    }

    /// The first vertex at a place that has not been named.
    #[cfg(feature = "encode")]
    fn numbered(&mut self, truth: [i32; 3]) -> Option<usize> {
        if self.numbers.is_empty() {
            for (k, &place) in self.places.iter().enumerate().rev() {
                self.numbers.entry(place).or_default().push(k as u32);
            }
        }
        let here = self.numbers.get_mut(&truth)?;
        // The lowest is the last.
        while here.last().is_some_and(|&k| self.named[k as usize]) {
            here.pop();
        }
        here.last().map(|&k| k as usize)
    }

    /// There is no writer.
    #[cfg(not(feature = "encode"))]
    fn numbered(&mut self, _: [i32; 3]) -> Option<usize> {
        None
    }

    fn name(&mut self, number: Option<usize>) -> Result<[i32; 3], ConnectivityError> {
        let there = number.filter(|&k| self.named.get(k).is_some_and(|named| !named));
        let Some(k) = there else {
            return Err(ConnectivityError::Mesh("a shared vertex that is not there".to_owned()));
        };
        self.named.set(k, true);
        self.last = k as i32;
        Ok(self.places[k])
    }
}

/// Codes of 72 bits with their numbers, which ascend, by code: by its bytes, the lowest first. A page waits for this code, and it is shorter than a
/// sort for any order.
fn sorted(mut list: Vec<(u128, u32)>) -> Vec<(u128, u32)> {
    let mut other = list.clone();
    for shift in (0..72).step_by(8) {
        let digit = |code: u128| (code >> shift) as usize & 0xFF;
        let mut ends = [0usize; 257];
        list.iter().for_each(|&(code, _)| ends[digit(code) + 1] += 1);
        (0..256).for_each(|k| ends[k + 1] += ends[k]);
        for &one in &list {
            let end = &mut ends[digit(one.0)];
            other[*end] = one;
            *end += 1;
        }
        std::mem::swap(&mut list, &mut other);
    }
    list
}

/// The bits of three coordinates below 2^24, the highest first: of x, y, z in turn.
fn interleaved(place: [i32; 3]) -> u128 {
    let spread =
        |x: i32| u128::from(spread(x as u64 >> 12 & 0xFFF)) << 36 | u128::from(spread(x as u64 & 0xFFF));
    spread(place[0]) << 2 | spread(place[1]) << 1 | spread(place[2])
}

/// Twelve bits, each with two free ones before it.
fn spread(mut x: u64) -> u64 {
    x = (x | x << 16) & 0xFF00_00FF;
    x = (x | x << 8) & 0x00F0_0F00_F00F;
    x = (x | x << 4) & 0x0C30_C30C_30C3;
    (x | x << 2) & 0x2492_4924_9249
}

/// Classes of how near the nearest candidate is.
const NEARNESSES: usize = 16;
/// Classes of how many candidates there are.
const COUNTS: usize = 16;
/// Bytes for a vertex of the other mesh.
const BYTES_A_VERTEX: usize = 2 * 32 + 12 + 1;
/// Units of work for one, once: to be sorted.
const WORK_A_VERTEX: u64 = 16;
/// Units of work for a cell that is looked into, beside one for each vertex in it.
const WORK_A_CELL: u64 = 4;
