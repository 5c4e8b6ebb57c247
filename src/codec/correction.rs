//! The correction: the input's coordinates at level 0, bit for bit (spec §10).

use super::grid::{Grid, MAX_PLACES, Points, Real};
use super::whole::{Extra, Whole, WholeError, spend};
use crate::entropy::{Bit, BitCoder, NumberModel, RangeDecoder, uniform};
use crate::limits::Budget;
use crate::mesh::{IndexedMesh, Lattice};
use std::collections::HashMap;

/// What level 0 lacks of the input's coordinates.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Correction {
    /// The type of the coordinates.
    pub real: Real,
    /// For each axis one to four grids, in the order in which they are tried.
    pub grids: [Vec<Grid>; 3],
    /// The positions of the vertices of the whole, exactly.
    pub positions: Vec<[f64; 3]>,
    /// Copies of vertices, with other coordinates: in the order of [`Correction::order`], each once.
    pub copies: Vec<Copied>,
    /// Corners at copies: three times the triangle plus 0 to 2, and the copy. Ascending.
    pub corners: Vec<(u32, u32)>,
}

/// A copy of a vertex of the whole: a vertex of the input that was one with it, but elsewhere, if only by the sign of a zero.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Copied {
    /// The vertex.
    pub vertex: u32,
    /// Where the copy is.
    pub position: [f64; 3],
}

/// Most grids of an axis.
pub const MAX_GRIDS: usize = 4;
/// How far a coordinate may be from a decimal, in numbers of its type, to be coded as that decimal.
#[cfg(feature = "encode")]
const NEAR: u64 = 16;

impl Correction {
    /// Writes the correction of level 0. What reading it will take is debited.
    #[cfg(feature = "encode")]
    pub fn encode(
        &self,
        whole: &Whole,
        lattice: &Lattice,
        budget: &mut Budget,
    ) -> Result<Vec<u8>, WholeError> {
        let mut coder = crate::entropy::RangeEncoder::default();
        let mut copy = self.clone();
        copy.code(whole, lattice, &mut coder, budget)?;
        Ok(coder.finish())
    }

    /// Reads the correction of level 0.
    ///
    /// # Errors
    /// [`WholeError`]; memory grows with what has been read.
    pub fn decode(
        bytes: &[u8],
        whole: &Whole,
        lattice: &Lattice,
        budget: &mut Budget,
    ) -> Result<Self, WholeError> {
        let mut coder = RangeDecoder::new(bytes);
        let mut correction = Self::default();
        correction.code(whole, lattice, &mut coder, budget)?;
        coder.finish()?;
        Ok(correction)
    }

    /// Puts the whole right: positions, and a vertex for each copy.
    pub fn apply(&self, mesh: &mut IndexedMesh) {
        mesh.positions = self.all_positions();
        self.rename(&mut mesh.triangles);
    }

    /// The positions of the whole's vertices, then those of the copies.
    pub fn all_positions(&self) -> Vec<[f64; 3]> {
        let mut positions = Vec::with_capacity(self.positions.len() + self.copies.len());
        positions.extend_from_slice(&self.positions);
        positions.extend(self.copies.iter().map(|copy| copy.position));
        positions
    }

    /// Puts the corners of the whole's triangles right: at copies, which follow the other vertices.
    pub fn rename(&self, triangles: &mut [[u32; 3]]) {
        for &(corner, copy) in &self.corners {
            triangles[corner as usize / 3][corner as usize % 3] = self.positions.len() as u32 + copy;
        }
    }

    /// What copies are sorted by: their vertices, then their coordinates.
    pub fn order(&self, copy: &Copied) -> (u32, [i64; 3]) {
        (copy.vertex, copy.position.map(|x| self.real.key(x)))
    }

    fn code<C: BitCoder>(
        &mut self,
        whole: &Whole,
        lattice: &Lattice,
        coder: &mut C,
        budget: &mut Budget,
    ) -> Result<(), WholeError> {
        self.real = if coder.even(|| self.real == Real::Binary64) { Real::Binary64 } else { Real::Binary32 };
        for grids in &mut self.grids {
            code_grids(grids, self.real, coder)?;
        }
        budget.take_work(whole.triangles.len() as u64)?;
        let mut axes: Vec<Axis> = self.grids.iter().map(|grids| Axis::new(grids, self.real)).collect();
        self.code_positions(whole, &mut axes, lattice, coder, budget)?;
        self.code_copies(whole, &mut axes, lattice, coder, budget)
    }

    fn code_positions<C: BitCoder>(
        &mut self,
        whole: &Whole,
        axes: &mut [Axis],
        lattice: &Lattice,
        coder: &mut C,
        budget: &mut Budget,
    ) -> Result<(), WholeError> {
        let known = std::mem::take(&mut self.positions);
        for (k, vertex) in whole.vertices.iter().enumerate() {
            if k.is_multiple_of(1024) {
                // Of each coordinate what was seen last, until all are read.
                budget.take_memory(1024, BYTES_SEEN)?;
            }
            spend(budget, k)?;
            let p = vertex.position(lattice);
            let Extra::Lattice(q) = *vertex else {
                if !p.iter().all(|&x| self.real.holds(x)) {
                    return Err(WholeError::Range("a further vertex is not of the type of the coordinates"));
                }
                self.positions.push(p);
                continue;
            };
            let truth = known.get(k).copied().unwrap_or_default();
            let mut position = [0.0; 3];
            for i in 0..3 {
                position[i] = axes[i].coordinate(q[i], p[i], lattice.step * 0.5, coder, truth[i])?;
            }
            coder.check()?;
            self.positions.push(position);
        }
        budget.give_memory(whole.vertices.len().next_multiple_of(1024), BYTES_SEEN);
        Ok(())
    }

    /// Copies (spec §10.4): of each vertex those with other coordinates, then where they are.
    fn code_copies<C: BitCoder>(
        &mut self,
        whole: &Whole,
        axes: &mut [Axis],
        lattice: &Lattice,
        coder: &mut C,
        budget: &mut Budget,
    ) -> Result<(), WholeError> {
        let fault = || WholeError::Range("a copy of a vertex that does not exist, as it is, or told twice");
        let known = (std::mem::take(&mut self.copies), std::mem::take(&mut self.corners));
        let count = NumberModel::default().unsigned(coder, || known.0.len() as u32)?;
        let mut steps = NumberModel::default();
        // The copies of each vertex that has some, as the first and how many.
        let mut copies_of: HashMap<u32, (u32, u32)> = HashMap::new();
        let mut last = Copied::default();
        for k in 0..count as usize {
            spend(budget, k)?;
            if k.is_multiple_of(1024) {
                budget.take_memory(1024, BYTES_OF_A_COPY)?;
            }
            let truth = known.0.get(k).copied().unwrap_or_default();
            let step = steps.unsigned(coder, || truth.vertex - last.vertex)?;
            let v = last.vertex.checked_add(step).ok_or_else(fault)?;
            let original = *self.positions.get(v as usize).ok_or_else(fault)?;
            let (p, mut position) = (whole.vertices[v as usize].position(lattice), original);
            let mut changed = false;
            for i in 0..3 {
                let half = lattice.step * 0.5;
                changed |= axes[i].copied(&mut position[i], changed, p[i], half, coder, truth.position[i])?;
            }
            coder.check()?;
            let copy = Copied { vertex: v, position };
            let follows = k == 0 || self.order(&last) < self.order(&copy);
            if !follows || position.map(f64::to_bits) == original.map(f64::to_bits) {
                return Err(fault());
            }
            copies_of.entry(v).or_insert((k as u32, 0)).1 += 1;
            self.copies.push(copy);
            last = copy;
        }
        if count == 0 {
            return Ok(());
        }
        let mut choices = NumberModel::default();
        let mut ahead = known.1.iter().peekable();
        for (corner, v) in whole.triangles.as_flattened().iter().enumerate() {
            let Some(&(first, count)) = copies_of.get(v) else { continue };
            let truth = ahead.next_if(|&&(c, _)| c as usize == corner);
            match choices.unsigned(coder, || truth.map_or(0, |&(_, copy)| copy - first + 1))? {
                0 => {}
                k if k <= count => {
                    spend(budget, self.corners.len())?;
                    self.corners.push((corner as u32, first + k - 1));
                }
                _ => return Err(WholeError::Range("a corner names a copy that does not exist")),
            }
            coder.check()?;
        }
        budget.give_memory((count as usize).next_multiple_of(1024), BYTES_OF_A_COPY);
        Ok(())
    }
}

fn code_grids<C: BitCoder>(grids: &mut Vec<Grid>, real: Real, coder: &mut C) -> Result<(), WholeError> {
    let known = std::mem::take(grids);
    let count = 1 + coder.bits(2, || known.len() as u32 - 1);
    for k in 0..count as usize {
        let truth = known.get(k).copied().unwrap_or(Grid::Binary { dropped: 0 });
        let (decimal, [a, b]) = match truth {
            Grid::Binary { dropped } => (false, [dropped, 0]),
            Grid::Decimal { digits, places } => (true, [digits, places]),
        };
        let grid = if coder.even(|| decimal) {
            Grid::Decimal { digits: coder.bits(4, || a), places: coder.bits(5, || b) }
        } else {
            Grid::Binary { dropped: coder.bits(6, || a) }
        };
        let sound = match grid {
            Grid::Binary { dropped } => dropped <= real.bits() - 2,
            Grid::Decimal { digits, places } => digits > 0 && places <= MAX_PLACES,
        };
        if !sound {
            return Err(WholeError::Range("a grid of coordinates is out of range"));
        }
        grids.push(grid);
    }
    Ok(())
}

/// The models of an axis, and what it remembers.
struct Axis {
    real: Real,
    grids: Vec<Points>,
    again: [Bit; 4],
    on: [Bit; MAX_GRIDS],
    off: NumberModel,
    /// Of copies: whether a coordinate is another one, and whether it is told by how many numbers away it is.
    other: [Bit; 2],
    by: Bit,
    away: NumberModel,
    /// For each lattice coordinate what its last vertex had, and how it came to have that.
    seen: HashMap<i32, (f64, u8)>,
}

impl Axis {
    fn new(grids: &[Grid], real: Real) -> Self {
        Self {
            real,
            grids: grids.iter().map(|&grid| Points::new(grid, real)).collect(),
            again: [Bit::NEW; 4],
            on: [Bit::NEW; MAX_GRIDS],
            off: NumberModel::default(),
            other: [Bit::NEW; 2],
            by: Bit::NEW,
            away: NumberModel::default(),
            seen: HashMap::new(),
        }
    }

    /// A coordinate of a vertex at `p`, point `q` of the lattice.
    fn coordinate<C: BitCoder>(
        &mut self,
        q: i32,
        p: f64,
        half: f64,
        coder: &mut C,
        truth: f64,
    ) -> Result<f64, WholeError> {
        let mut next = 1;
        if let Some((x, state)) = self.seen.get_mut(&q) {
            let again = &mut self.again[usize::from((*state).min(3))];
            if coder.bit(again, || x.to_bits() == truth.to_bits()) {
                *state = (*state + 1).min(3);
                return Ok(*x);
            }
            next = 0;
        }
        let x = self.fresh(p, half, coder, truth)?;
        self.seen.insert(q, (x, next));
        Ok(x)
    }

    /// Turns a coordinate of a vertex at `p` to that of its copy; whether that is another one. `changed` says whether one
    /// before was.
    fn copied<C: BitCoder>(
        &mut self,
        x: &mut f64,
        changed: bool,
        p: f64,
        half: f64,
        coder: &mut C,
        truth: f64,
    ) -> Result<bool, WholeError> {
        let before = *x;
        if !coder.bit(&mut self.other[usize::from(changed)], || before.to_bits() != truth.to_bits()) {
            return Ok(false);
        }
        let away = if C::ENCODES { self.away(before, p, half, truth) } else { None };
        *x = if coder.bit(&mut self.by, || away.is_some()) {
            let range = || WholeError::Range("the coordinate of a copy is out of range");
            let away = self.away.signed(coder, || away.unwrap_or_default())?;
            let key = self.real.key(before).checked_add(i64::from(away)).ok_or_else(range)?;
            self.real.number(key).filter(|x| x.is_finite()).ok_or_else(range)?
        } else {
            self.fresh(p, half, coder, truth)?
        };
        Ok(true)
    }

    /// How many numbers `truth` is away from `x`, if that is told with fewer bits than its place among the points of its cell.
    fn away(&self, x: f64, p: f64, half: f64, truth: f64) -> Option<i32> {
        let away = self.real.key(truth).checked_sub(self.real.key(x))?;
        let away = i32::try_from(away).ok().filter(|&away| away != i32::MIN)?;
        let on_grid = |points: &Points| {
            let (low, count) = points.within(p - half, p + half);
            place(points, self.real, truth, low, count).map(|_| count)
        };
        let count = self.grids.iter().find_map(on_grid);
        count.is_none_or(|count| u64::from(away.unsigned_abs()) <= count).then_some(away)
    }

    fn fresh<C: BitCoder>(
        &mut self,
        p: f64,
        half: f64,
        coder: &mut C,
        truth: f64,
    ) -> Result<f64, WholeError> {
        let range = || WholeError::Range("a coordinate is out of range");
        for (points, on) in self.grids.iter().zip(&mut self.on) {
            let (low, count) = points.within(p - half, p + half);
            let found = if C::ENCODES { place(points, self.real, truth, low, count) } else { None };
            if !coder.bit(on, || found.is_some()) {
                continue;
            }
            let (index, offset) = found.unwrap_or_default();
            let index = uniform(coder, count, || index)?;
            let mut x = points.point(low.wrapping_add(index as i64)).ok_or_else(range)?;
            if let Grid::Decimal { .. } = points.grid {
                let offset = self.off.signed(coder, || offset)?;
                x = self.real.number(self.real.key(x) + i64::from(offset)).ok_or_else(range)?;
            }
            return if x.is_finite() { Ok(x) } else { Err(range()) };
        }
        let bits = self.real.bits();
        let truth = match self.real {
            Real::Binary32 => u64::from((truth as f32).to_bits()),
            Real::Binary64 => truth.to_bits(),
        };
        let word = (0..bits / 16).rev().fold(0, |word, k| {
            word << 16 | u64::from(coder.bits(16, || (truth >> (16 * k) & 0xFFFF) as u32))
        });
        let x = match self.real {
            Real::Binary32 => f64::from(f32::from_bits(word as u32)),
            Real::Binary64 => f64::from_bits(word),
        };
        if x.is_finite() { Ok(x) } else { Err(range()) }
    }
}

/// Where `x` is among `count` points from `low` on, and how far off it; `None` where it is elsewhere.
#[cfg(feature = "encode")]
pub fn place(points: &Points, real: Real, x: f64, low: i64, count: u64) -> Option<(u64, i32)> {
    let near = |i: i64| {
        let index = i.wrapping_sub(low) as u64;
        let point = points.point(i).filter(|point| i >= low && index < count && point.is_finite())?;
        let offset = real.key(x).checked_sub(real.key(point))?;
        let most = if let Grid::Decimal { .. } = points.grid { NEAR } else { 0 };
        (offset.unsigned_abs() <= most).then_some((index, offset as i32))
    };
    let least = points.least(x);
    (-1..=1).filter_map(|k| near(least + k)).min_by_key(|&(_, offset)| offset.unsigned_abs())
}

/// A decoder looks for nothing.
#[cfg(not(feature = "encode"))]
fn place(_: &Points, _: Real, _: f64, _: i64, _: u64) -> Option<(u64, i32)> {
    None
}

/// What a copy takes until all corners are read, beyond itself: its place among those of its vertex.
const BYTES_OF_A_COPY: usize = 48;
/// What a vertex leaves in the memory of the axes, at most, until all vertices are read.
const BYTES_SEEN: usize = 3 * 72;

#[cfg(all(test, feature = "encode"))]
mod tests {
    use super::*;
    use crate::error::Error;
    use crate::limits::Limits;

    /// A whole of so many vertices on the lattice's diagonal and as many triangles, and its correction with copies at some of them.
    fn correction(vertices: u32, copies: u32) -> (Whole, Correction) {
        let place = |k: u32| [f64::from(k) + 0.125; 3];
        let whole = Whole {
            vertices: (0..vertices).map(|k| Extra::Lattice([k as i32; 3])).collect(),
            triangles: (0..vertices).map(|k| [k, (k + 1) % vertices, (k + 2) % vertices]).collect(),
            names: (0..vertices).collect(),
        };
        let copied = |k: u32| Copied { vertex: k, position: [place(k)[0], place(k)[1], place(k)[2] + 0.25] };
        let grids = std::array::from_fn(|_| vec![Grid::Binary { dropped: 0 }]);
        let correction = Correction {
            real: Real::Binary64,
            grids,
            positions: (0..vertices).map(place).collect(),
            copies: (0..copies).map(copied).collect(),
            corners: (0..copies).map(|k| (3 * k, k)).collect(),
        };
        (whole, correction)
    }

    /// Vertices, copies and corners at them take 96 bytes each, by 1,024. Besides, while coordinates are read each axis remembers 72 bytes of
    /// a vertex, and 48 of each copy are remembered until all corners are read; these are given back.
    #[test]
    fn just_enough_memory() {
        let lattice = Lattice { origin: [0.0; 3], step: 1.0, bits: 12 };
        for (vertices, copies) in [(1000, 0), (1500, 0), (30, 20), (1500, 1400), (9000, 8000)] {
            let (whole, correction) = correction(vertices, copies);
            let bytes = correction.encode(&whole, &lattice, &mut Budget::unlimited()).unwrap();
            let of = |count: u32, each| u64::from(count.div_ceil(1024)) * 1024 * each;
            let stays = of(vertices, 96) + of(copies, 2 * 96);
            let exact = of(vertices, 96 + 3 * 72).max(stays + of(copies, 48));
            let decode = |memory| {
                let mut budget = Budget::new(Limits { memory, ..Limits::default() });
                budget.receive(bytes.len());
                Correction::decode(&bytes, &whole, &lattice, &mut budget).map(|found| (found, budget))
            };
            let (found, mut budget) = decode(exact).unwrap();
            assert_eq!(found, correction);
            budget.take_memory((exact - stays) as usize, 1).unwrap();
            assert!(budget.take_memory(1, 1).is_err());
            let refused = decode(exact - 1).map(|_| ());
            assert!(matches!(refused, Err(WholeError::Limit(Error::Limit { .. }))), "{refused:?}");
        }
    }
}
