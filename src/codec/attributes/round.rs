//! What is coded round one vertex: its breaks, then the values of its wedges (spec §13.3).

use super::column::Column;
use super::ring::Ring;
use super::values::{Around, ValueModels};
use super::{Attributes, Known};
use crate::codec::whole::WholeError;
use crate::entropy::{Bit, BitCoder};
use crate::limits::Budget;
use crate::mesh::{Corner, CornerTable, Vertex};
use crate::refine::{ProgressiveMesh, Wedges};
use bitvec::vec::BitVec;

/// Models of one column of values at corners.
#[derive(Debug)]
pub struct CornerModels {
    /// Whether a wedge has the value of the one before it at its vertex; by whether that one had the value of its own predecessor.
    same: [Bit; 2],
    /// Whether a wedge has a value, by whether the one coded last had.
    present: [Bit; 2],
    last_present: bool,
    values: ValueModels,
}

impl CornerModels {
    pub fn new(column: &Column) -> Self {
        let (same, present) = ([Bit::NEW; 2], [Bit::NEW; 2]);
        Self { same, present, last_present: true, values: ValueModels::new(&column.kind) }
    }

    /// Bytes that the models of a column take, without what grows with its values.
    pub fn bytes(column: &Column) -> usize {
        size_of::<Self>() + ValueModels::bytes(&column.kind)
    }

    /// Asks for what is remembered of the value of a wedge to be brought into the caches.
    #[inline(always)]
    pub fn prefetch(&self, at: u32) {
        self.values.prefetch(at);
    }

    /// Codes the value of one wedge, the one numbered `at`, round which is `ring`, or of a row of triangles, round which is nothing.
    /// `before` is the wedge before it at its vertex, if there is one.
    #[expect(clippy::too_many_arguments)]
    pub fn code<C: BitCoder>(
        &mut self,
        coder: &mut C,
        around: &Around,
        ring: &mut Ring,
        column: &mut Column,
        at: u32,
        before: Option<u32>,
        truth: Option<&[i32]>,
    ) -> Result<(), WholeError> {
        if let Some(before) = before {
            let context = usize::from(column.kind.partial && !self.last_present);
            let is_same = || column.value(before) == truth;
            if coder.bit(&mut self.same[context], is_same) {
                column.copy(before, at);
                self.values.skip(column, at);
                return Ok(());
            }
        }
        if column.kind.partial {
            let context = usize::from(self.last_present);
            self.last_present = coder.bit(&mut self.present[context], || truth.is_some());
            if !self.last_present {
                column.set(at, None);
                self.values.skip(column, at);
                return Ok(());
            }
        }
        let value = self.values.code(coder, around, ring, column, at, before, truth.unwrap_or(&[]))?;
        column.set(at, Some(value));
        Ok(())
    }
}

/// Models of what is round a vertex.
#[derive(Debug)]
pub struct RoundModels {
    /// Whether a vertex has several wedges, by how many of its spokes part the wedges at their far end: none that is known to, one, more.
    broken: [Bit; 3],
    /// Whether a spoke parts the wedges of the vertex: by whether it does so at its far end (not known yet, no, yes), and how far the
    /// triangles on its sides are from lying in one plane.
    breaks: [[Bit; 3]; 3],
    /// By column.
    pub columns: Vec<CornerModels>,
    spokes: Vec<bool>,
    /// Of the wedges from before the pass those that corners have again: each is at one vertex.
    pub taken: BitVec,
    /// Of a run of corners, and all of them from the first break on.
    ring: Ring,
    corners: Vec<Corner>,
}

impl RoundModels {
    /// Bytes that models of some columns take, without what grows with their values.
    pub fn bytes(columns: &[Column]) -> usize {
        columns.iter().map(CornerModels::bytes).sum()
    }

    pub fn new(columns: &[Column]) -> Self {
        let columns = columns.iter().map(CornerModels::new).collect();
        Self {
            broken: [Bit::NEW; 3],
            breaks: [[Bit::NEW; 3]; 3],
            columns,
            spokes: Vec::new(),
            taken: BitVec::new(),
            ring: Ring::default(),
            corners: Vec::new(),
        }
    }
}

impl RoundModels {
    /// Whether a wedge from before the pass has been taken; it is now.
    fn is_taken(&mut self, wedge: u32) -> bool {
        let place = wedge as usize;
        place >= self.taken.len() || self.taken.replace(place, true)
    }
}

/// A vertex to be coded round.
#[derive(Clone, Copy, Debug)]
pub struct Vicinity<'a> {
    pub mesh: &'a ProgressiveMesh,
    /// The columns that are coded: numbers, ascending.
    pub born: &'a [usize],
    /// Those that are known of all wedges there are.
    pub old: &'a [usize],
    pub is_boundary: bool,
}

impl Attributes {
    /// Codes what is round a vertex: `ring` has looked round all its corners, those of its fan, from where it is told. `seen` tells of which
    /// other vertices all that is coded now is known; `parted` is how many spokes part the wedges at their far end, where that is known
    /// already.
    #[expect(clippy::too_many_arguments)]
    pub(super) fn round<C: BitCoder, K: Known>(
        &mut self,
        models: &mut RoundModels,
        vicinity: Vicinity,
        ring: &mut Ring,
        seen: impl Fn(Vertex) -> bool,
        parted: Option<usize>,
        coder: &mut C,
        known: &K,
        budget: &mut Budget,
    ) -> Result<(), WholeError> {
        let mut spokes = std::mem::take(&mut models.spokes);
        let outcome = if self.breaks(models, vicinity, &ring.corners, &mut spokes, seen, parted, coder, known)
        {
            let start = spokes.iter().position(|&breaks| breaks);
            let start = start.filter(|_| !vicinity.is_boundary).unwrap_or(0);
            let mut corners = std::mem::take(&mut models.corners);
            corners.clone_from(&ring.corners);
            corners.rotate_left(start);
            spokes.rotate_left(start);
            let outcome = self.runs(models, vicinity, &corners, &spokes, coder, known, budget);
            models.corners = corners;
            outcome
        } else {
            self.wedge(models, vicinity, ring, None, coder, known, budget).map(|_| ())
        };
        models.spokes = spokes;
        outcome
    }

    /// Codes one wedge after the other, parted by `spokes`.
    #[expect(clippy::too_many_arguments)]
    fn runs<C: BitCoder, K: Known>(
        &mut self,
        models: &mut RoundModels,
        vicinity: Vicinity,
        corners: &[Corner],
        spokes: &[bool],
        coder: &mut C,
        known: &K,
        budget: &mut Budget,
    ) -> Result<(), WholeError> {
        let (mut before, mut from) = (None, 0);
        let mut ring = std::mem::take(&mut models.ring);
        while from < corners.len() {
            let run = 1 + spokes[from + 1..].iter().take_while(|&&breaks| !breaks).count();
            ring.corners.clear();
            ring.corners.extend_from_slice(&corners[from..from + run]);
            ring.look(&Around { mesh: vicinity.mesh, wedges: &self.wedges });
            before = Some(self.wedge(models, vicinity, &mut ring, before, coder, known, budget)?);
            from += run;
        }
        models.ring = ring;
        Ok(())
    }

    /// Codes the values of the wedge that a ring has looked round, of one corner at least. `before` is the wedge before it at its vertex.
    #[expect(clippy::too_many_arguments)]
    fn wedge<C: BitCoder, K: Known>(
        &mut self,
        models: &mut RoundModels,
        vicinity: Vicinity,
        ring: &mut Ring,
        before: Option<u32>,
        coder: &mut C,
        known: &K,
        budget: &mut Budget,
    ) -> Result<u32, WholeError> {
        let there = self.wedges.of(ring.corners[0]);
        let stays = there != Wedges::NONE && !models.is_taken(there);
        let wedge = if stays { there } else { self.wedges.count() };
        if !stays {
            take_room(budget, wedge, &self.columns)?;
            if there != Wedges::NONE {
                vicinity.old.iter().for_each(|&k| self.columns[k].copy(there, wedge));
            }
        }
        let label = if C::ENCODES { known.label(ring.corners[0]) } else { 0 };
        let around = Around { mesh: vicinity.mesh, wedges: &self.wedges };
        for &k in vicinity.born {
            let (models, column) = (&mut models.columns[k], &mut self.columns[k]);
            models.code(coder, &around, ring, column, wedge, before, known.value(k, label))?;
        }
        if stays {
            // There may have been several numbers for what is alike.
            ring.corners.iter().for_each(|&c| self.wedges.assign(c, wedge));
        } else {
            self.wedges.append(&ring.corners);
        }
        Ok(wedge)
    }

    /// Tells of each of the corners round a vertex whether the spoke before it parts it from the corner before. Returned is whether any does,
    /// else `spokes` is of no meaning.
    #[expect(clippy::too_many_arguments)]
    fn breaks<C: BitCoder, K: Known>(
        &self,
        models: &mut RoundModels,
        vicinity: Vicinity,
        corners: &[Corner],
        spokes: &mut Vec<bool>,
        seen: impl Fn(Vertex) -> bool,
        parted: Option<usize>,
        coder: &mut C,
        known: &K,
    ) -> bool {
        let count = corners.len();
        let table = &vicinity.mesh.table;
        let sides = |i: usize| [corners[if i == 0 { count - 1 } else { i - 1 }], corners[i]];
        let inner = usize::from(vicinity.is_boundary)..count;
        spokes.clear();
        // Nothing parts where nothing was known before.
        if !vicinity.old.is_empty() {
            spokes.resize(count, false);
            for i in inner.clone() {
                let [a, b] = sides(i);
                spokes[i] = !self.are_alike(self.wedges.of(a), self.wedges.of(b), vicinity.old);
            }
        }
        let is_open = |i: usize, spokes: &[bool]| !spokes.get(i).is_some_and(|&breaks| breaks);
        let truth = |i: usize| {
            let [a, b] = sides(i).map(|c| known.label(c));
            a != b && vicinity.born.iter().any(|&k| known.value(k, a) != known.value(k, b))
        };
        let far = |i: usize| {
            let [a, b] = sides(i);
            let (a, b) = (a.prev(), b.next());
            if !seen(table.vertex(a)) {
                return 0;
            }
            let [a, b] = [a, b].map(|c| self.wedges.of(c));
            2 - usize::from(self.are_alike(a, b, vicinity.old.iter().chain(vicinity.born)))
        };
        let parted =
            parted.unwrap_or_else(|| inner.clone().filter(|&i| is_open(i, spokes) && far(i) == 2).count());
        let any = || inner.clone().any(|i| is_open(i, spokes) && truth(i));
        if !coder.bit(&mut models.broken[parted.min(2)], any) {
            return spokes.contains(&true);
        }
        spokes.resize(count, false);
        for i in inner.clone() {
            if is_open(i, spokes) {
                let facing = corners[i].prev();
                let context = [far(i), bend(vicinity.mesh, table.opposite(facing), facing)];
                spokes[i] = coder.bit(&mut models.breaks[context[0]][context[1]], || truth(i));
            }
        }
        true
    }
}

/// The corners round a vertex, from one of them on.
pub(super) fn fan(table: &CornerTable, first: Corner) -> impl Iterator<Item = Corner> + '_ {
    let next = move |&c: &Corner| Some(table.swing(c)).filter(|&c| c.is_some() && c != first);
    std::iter::successors(Some(first), next)
}

/// How far two triangles are from lying in one plane, by corners that face each other: 0 within 20 degrees, 1 within 60, 2 beyond, or
/// where there is but one.
fn bend(mesh: &ProgressiveMesh, c: Corner, o: Corner) -> usize {
    if c.is_none() || o.is_none() {
        return 2;
    }
    let normal = |c: Corner| {
        let [a, b, d] = mesh.table.vertices_from(c).map(|v| mesh.positions[v.index()].map(f64::from));
        let [u, w] = [b, d].map(|p| [p[0] - a[0], p[1] - a[1], p[2] - a[2]]);
        [u[1] * w[2] - u[2] * w[1], u[2] * w[0] - u[0] * w[2], u[0] * w[1] - u[1] * w[0]]
    };
    let dot = |x: [f64; 3], y: [f64; 3]| x[0] * y[0] + x[1] * y[1] + x[2] * y[2];
    let [m, n] = [normal(c), normal(o)];
    let (d, squares) = (dot(m, n), dot(m, m) * dot(n, n));
    // Cosines 0.94 and 0.5.
    match () {
        _ if d > 0.0 && d * d >= 0.8836 * squares => 0,
        _ if d > 0.0 && d * d >= 0.25 * squares => 1,
        _ => 2,
    }
}

/// Debits the budget for some further values of all columns, at item `k`.
pub fn take_room(budget: &mut Budget, k: u32, columns: &[Column]) -> Result<(), WholeError> {
    if k.is_multiple_of(AHEAD as u32) {
        // Numbers, and the lengths of what was missing in two kinds of models.
        let integers: usize = columns.iter().map(|column| 2 * column.integers() + 2).sum();
        // In lists that have just been copied to ones twice as long.
        budget.take_memory(AHEAD, 3 * 4 * (integers + 1))?;
        budget.take_work(WORK_A_VALUE * (AHEAD * columns.len()) as u64)?;
    }
    Ok(())
}

/// Items that the budget is debited for at a time.
const AHEAD: usize = 1024;
/// Units of work for a value.
pub(super) const WORK_A_VALUE: u64 = 16;
