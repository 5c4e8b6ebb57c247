//! The triangles of the input, one after the other: a neighbour of one that has been read, or a jump (spec §11.2).

use super::{NONE, Origin};
use crate::codec::places::Places;
use crate::codec::residue::Residue;
use crate::codec::walk::Walk;
use crate::codec::whole::{Whole, WholeError};
use crate::entropy::{Bit, BitCoder, NumberModel};
use crate::mesh::{Corner, CornerTable};
use crate::refine::ProgressiveMesh;

/// Codes the triangles of the input, by vertices of the whole, and which of its triangles they are. `origins` is what the writer knows.
pub fn code<C: BitCoder>(
    surface: &Surface,
    whole: &Whole,
    origins: &[Origin],
    coder: &mut C,
) -> Result<(Vec<[u32; 3]>, Vec<Origin>), WholeError> {
    let mut state = State::new(surface, whole.triangles.len(), C::ENCODES);
    let mut triangles = Vec::with_capacity(whole.triangles.len());
    let (mut s, mut r) = (0, 0);
    for t in 0..whole.triangles.len() {
        let truth = origins.get(t).copied().unwrap_or_default();
        let p = state.read.last().map_or(0, |&(place, _)| state.places.below(place as usize));
        let way = if C::ENCODES { state.way(truth, p) } else { Way::default() };
        let (origin, found) = if t > 0 && coder.bit(&mut state.models.near[s][r], || way.is_near) {
            state.neighbour(s, &way, truth, coder)?
        } else {
            (state.jump(p, &way, truth, coder)?, 0)
        };
        coder.check()?;
        state.take(origin);
        let mut triangle = whole.triangles[origin.0 as usize];
        triangle.rotate_left(origin.1 as usize);
        triangles.push(triangle);
        (s, r) = (found, s);
    }
    Ok((triangles, state.read))
}

/// The triangles of the walk as the whole has them.
pub struct Surface<'a> {
    table: &'a CornerTable,
    residue: &'a Residue,
    walk: &'a Walk,
    /// For each triangle of the table its place.
    place: Vec<u32>,
}

impl<'a> Surface<'a> {
    /// Level 0 with its residue, on a walk of it.
    pub fn new(mesh: &'a ProgressiveMesh, residue: &'a Residue, walk: &'a Walk) -> Self {
        let mut place = vec![NONE; mesh.table.slots()];
        for (k, c) in walk.triangles.iter().enumerate() {
            place[c.triangle().index()] = k as u32;
        }
        Self { table: &mesh.table, residue, walk, place }
    }

    /// The place across the edge that corner `i` faces, and the corner there that faces it too; corners as the whole has them.
    fn across(&self, place: usize, i: usize) -> Option<(usize, usize)> {
        let corner = self.corners(place)?[i];
        let facing = self.table.opposite(corner);
        if facing.is_none() {
            return None;
        }
        let other = self.place[facing.triangle().index()] as usize;
        let corner = self.corners(other)?.iter().position(|&c| c == facing)?;
        Some((other, corner))
    }

    fn corners(&self, place: usize) -> Option<[Corner; 3]> {
        let &c = self.walk.triangles.get(place)?;
        let [next, prev] = [c.next(), c.prev()];
        Some(if self.residue.is_flipped(place) { [c, prev, next] } else { [c, next, prev] })
    }
}

/// The models of triangles.
struct Models {
    near: [[Bit; 5]; 5],
    ages: Vec<NumberModel>,
    which: [[[Bit; 2]; 8]; 4],
    turn: [[[Bit; 2]; 3]; 3],
    jump: [Bit; 2],
    jumps: NumberModel,
}

impl Default for Models {
    fn default() -> Self {
        Self {
            near: [[Bit::NEW; 5]; 5],
            ages: vec![NumberModel::default(); 5],
            which: [[[Bit::NEW; 2]; 8]; 4],
            turn: [[[Bit::NEW; 2]; 3]; 3],
            jump: [Bit::NEW; 2],
            jumps: NumberModel::default(),
        }
    }
}

/// How far the list of triangles has come.
struct State<'a> {
    surface: &'a Surface<'a>,
    models: Models,
    /// The places of the whole that have not been taken.
    places: Places,
    read: Vec<Origin>,
    /// What the writer knows: when each place was taken.
    when: Vec<u32>,
}

impl<'a> State<'a> {
    fn new(surface: &'a Surface, count: usize, encodes: bool) -> Self {
        Self {
            surface,
            models: Models::default(),
            places: Places::new(count),
            read: Vec::with_capacity(count),
            when: vec![NONE; if encodes { count } else { 0 }],
        }
    }

    /// The triangle over an edge of one that has been read; and the state that it leaves, by how long ago that was.
    fn neighbour<C: BitCoder>(
        &mut self,
        s: usize,
        way: &Way,
        truth: Origin,
        coder: &mut C,
    ) -> Result<(Origin, usize), WholeError> {
        let range = WholeError::Range;
        let age = self.models.ages[s].unsigned(coder, || way.age)? as usize;
        let from = self.read.len().checked_sub(age + 1).and_then(|o| self.read.get(o));
        let &(from, turn) = from.ok_or(range("a triangle is named that has not been read"))?;
        let beyond: [_; 3] = std::array::from_fn(|i| {
            let across = self.surface.across(from as usize, (i + turn as usize) % 3);
            across.filter(|&(place, _)| !self.places.is_taken(place))
        });
        let mask = (0..3).fold(0, |mask, i| mask | usize::from(beyond[i].is_some()) << i);
        let mut open = (0..3).filter(|&i| beyond[i].is_some()).peekable();
        let mut i = open.next().ok_or(range("a triangle has no neighbour that is left"))?;
        for model in &mut self.models.which[age.min(3)][mask] {
            if open.peek().is_none() || !coder.bit(model, || i != way.edge) {
                break;
            }
            i = open.next().unwrap_or(i);
        }
        let (place, facing) = beyond[i].ok_or(range("a triangle has no such neighbour"))?;
        let turn = &mut self.models.turn[age.min(2)][i];
        let x = three(turn, coder, || (facing + 3 - truth.1 as usize) % 3);
        let found = 1 + 3.min(usize::BITS - age.leading_zeros()) as usize;
        Ok(((place as u32, ((facing + 3 - x) % 3) as u32), found))
    }

    /// The triangle so many places from the last one, of those that are left; `p` of them are below it.
    fn jump<C: BitCoder>(
        &mut self,
        p: usize,
        way: &Way,
        truth: Origin,
        coder: &mut C,
    ) -> Result<Origin, WholeError> {
        let jump = self.models.jumps.signed(coder, || way.jump)?;
        let k = usize::try_from(p as i64 + i64::from(jump)).ok();
        let place = k.and_then(|k| self.places.nth(k));
        let place = place.ok_or(WholeError::Range("a triangle is not among those that are left"))?;
        let in_walk = place < self.surface.walk.triangles.len();
        let first = if in_walk { three(&mut self.models.jump, coder, || truth.1 as usize) } else { 0 };
        Ok((place as u32, first as u32))
    }

    fn take(&mut self, origin: Origin) {
        self.places.take(origin.0 as usize);
        if let Some(when) = self.when.get_mut(origin.0 as usize) {
            *when = self.read.len() as u32;
        }
        self.read.push(origin);
    }

    /// Over the edge of the youngest neighbour, unless a jump is shorter.
    fn way(&self, truth: Origin, p: usize) -> Way {
        let place = truth.0 as usize;
        let jump = (self.places.below(place) as i64 - p as i64) as i32;
        let neighbours = (0..3).filter_map(|i| self.surface.across(place, i));
        let taken = neighbours.filter(|&(o, _)| self.when[o] != NONE);
        let Some((o, facing)) = taken.max_by_key(|&(o, _)| self.when[o]) else {
            return Way { jump, ..Way::default() };
        };
        let age = self.read.len() as u32 - 1 - self.when[o];
        let bits = |x: u32| u32::BITS - x.leading_zeros();
        let is_near = bits(age) < bits(jump.unsigned_abs());
        let first = self.read[self.when[o] as usize].1 as usize;
        Way { is_near, age, edge: (facing + 3 - first) % 3, jump }
    }
}

/// How the writer names the next triangle.
#[derive(Default)]
struct Way {
    is_near: bool,
    age: u32,
    /// The corner, as the input has them, that faces the edge to cross.
    edge: usize,
    jump: i32,
}

/// A number of 0 to 2.
fn three<C: BitCoder>(models: &mut [Bit; 2], coder: &mut C, known: impl Fn() -> usize) -> usize {
    if coder.bit(&mut models[0], || known() > 0) {
        1 + usize::from(coder.bit(&mut models[1], || known() > 1))
    } else {
        0
    }
}
