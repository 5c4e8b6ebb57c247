//! The whole pass: every vertex of a level in walk order, its breaks, then the values of its wedges (spec §13.3).

use super::column::Column;
use super::values::{Around, ValueModels};
use super::{Finest, Known};
use crate::codec::whole::WholeError;
use crate::entropy::{Bit, BitCoder};
use crate::limits::Budget;
use crate::mesh::attributes::Domain;
use crate::mesh::{Corner, CornerTable};
use crate::refine::Wedges;
use bitvec::vec::BitVec;

/// A reader knows nothing.
pub struct Nothing;

impl Known for Nothing {
    fn wedge(&self, _: usize, _: usize) -> u32 {
        0
    }
    fn value(&self, _: usize, _: u32) -> Option<&[i32]> {
        None
    }
    fn of_triangle(&self, _: usize, _: usize) -> Option<&[i32]> {
        None
    }
}

/// The models of one column of values at corners.
pub struct CornerModels {
    /// Whether a wedge has the value of the one before it at its vertex; by whether that one had the value of its own predecessor.
    same: [Bit; 2],
    /// Whether a wedge has a value, by whether the one coded last had.
    present: [Bit; 2],
    last_present: bool,
    pub values: ValueModels,
}

impl CornerModels {
    fn new(column: &Column) -> Self {
        let (same, present) = ([Bit::NEW; 2], [Bit::NEW; 2]);
        Self { same, present, last_present: true, values: ValueModels::new(&column.kind) }
    }

    /// Codes the value of one wedge and appends it to the column. `before` is the wedge before it at its vertex, if there is one.
    pub fn code<C: BitCoder>(
        &mut self,
        coder: &mut C,
        around: &Around,
        column: &mut Column,
        corners: &[Corner],
        before: Option<u32>,
        truth: Option<&[i32]>,
    ) -> Result<(), WholeError> {
        if let Some(before) = before {
            let context = usize::from(column.kind.partial && !self.last_present);
            let is_same = || column.value(before) == truth;
            if coder.bit(&mut self.same[context], is_same) {
                column.repeat(before);
                return Ok(());
            }
        }
        if column.kind.partial {
            let context = usize::from(self.last_present);
            self.last_present = coder.bit(&mut self.present[context], || truth.is_some());
            if !self.last_present {
                column.push(None);
                return Ok(());
            }
        }
        let value = self.values.code(coder, around, column, corners, before, truth.unwrap_or(&[]))?;
        column.push(Some(&value));
        Ok(())
    }
}

/// What the whole pass leaves for the further triangles: the wedges, for each wedge what the writer knows it by, and the models.
pub type Ended = (Wedges, Vec<u32>, Vec<CornerModels>);

/// The pass under way.
pub struct WholePass<'a, K> {
    finest: Finest<'a>,
    columns: &'a mut [Column],
    models: Vec<CornerModels>,
    /// For each triangle of the table its place in the walk, where this side writes.
    place: Vec<u32>,
    wedges: Wedges,
    /// For each wedge what the writer knows it by.
    lists: Vec<u32>,
    known: &'a K,
    /// Whether a vertex has several wedges, by how many of its spokes part the wedges at their far end: none that is known to, one, more.
    broken: [Bit; 3],
    /// Whether a spoke parts the wedges of the vertex: by whether it does so at its far end (not known yet, no, yes), and how far the
    /// triangles on its sides are from lying in one plane.
    breaks: [[Bit; 3]; 3],
    corners: Vec<Corner>,
    spokes: Vec<bool>,
}

impl<'a, K: Known> WholePass<'a, K> {
    pub fn new(finest: Finest<'a>, columns: &'a mut [Column], known: &'a K) -> Self {
        let models = columns.iter().map(CornerModels::new).collect();
        Self {
            finest,
            columns,
            models,
            place: Vec::new(),
            wedges: Wedges::open(&finest.mesh.table),
            lists: Vec::new(),
            known,
            broken: [Bit::NEW; 3],
            breaks: [[Bit::NEW; 3]; 3],
            corners: Vec::new(),
            spokes: Vec::new(),
        }
    }

    pub fn end(self) -> Ended {
        (self.wedges, self.lists, self.models)
    }

    /// Codes all vertices.
    pub fn code_vertices<C: BitCoder>(
        &mut self,
        coder: &mut C,
        budget: &mut Budget,
    ) -> Result<(), WholeError> {
        let Finest { mesh, tour, .. } = self.finest;
        if C::ENCODES {
            self.place = vec![u32::MAX; mesh.table.slots()];
            for (k, c) in tour.walk.triangles.iter().enumerate() {
                self.place[c.triangle().index()] = k as u32;
            }
        }
        budget.take_work(WORK_A_CORNER * 3 * tour.walk.triangles.len() as u64)?;
        budget.take_memory(mesh.table.vertex_slots() / 8 + size_of::<usize>(), 1)?;
        let mut seen: BitVec = BitVec::repeat(false, mesh.table.vertex_slots());
        for &c in &tour.walk.triangles {
            for c in [c.next(), c.prev(), c] {
                if !seen.replace(mesh.table.vertex(c).index(), true) {
                    self.vertex(c, coder, budget)?;
                    coder.check()?;
                }
            }
        }
        budget.give_memory(mesh.table.vertex_slots() / 8 + size_of::<usize>(), 1);
        Ok(())
    }

    /// The vertex of corner `first`, which the walk has met first.
    fn vertex<C: BitCoder>(
        &mut self,
        first: Corner,
        coder: &mut C,
        budget: &mut Budget,
    ) -> Result<(), WholeError> {
        let table = &self.finest.mesh.table;
        let v = table.vertex(first);
        let is_boundary = table.is_boundary(v);
        let mut corners = std::mem::take(&mut self.corners);
        let mut spokes = std::mem::take(&mut self.spokes);
        corners.clear();
        // Where there is an end to go from, the fan goes from there.
        corners.extend(fan(table, if is_boundary { table.corner_of(v) } else { first }));
        self.code_breaks(&corners, is_boundary, &mut spokes, coder);
        let start = spokes.iter().position(|&breaks| breaks).filter(|_| !is_boundary).unwrap_or(0);
        corners.rotate_left(start);
        spokes.rotate_left(start);
        let mut before = None;
        let mut from = 0;
        while from < corners.len() {
            let run = 1 + spokes[from + 1..].iter().take_while(|&&breaks| !breaks).count();
            before = Some(self.wedge(&corners[from..from + run], before, coder, budget)?);
            from += run;
        }
        (self.corners, self.spokes) = (corners, spokes);
        Ok(())
    }

    /// Tells of each of the corners round a vertex whether the spoke before it parts it from the corner before.
    fn code_breaks<C: BitCoder>(
        &mut self,
        corners: &[Corner],
        is_boundary: bool,
        spokes: &mut Vec<bool>,
        coder: &mut C,
    ) {
        let count = corners.len();
        spokes.clear();
        spokes.resize(count, false);
        if C::ENCODES {
            for (i, breaks) in spokes.iter_mut().enumerate().skip(usize::from(is_boundary)) {
                let [a, b] = [corners[(i + count - 1) % count], corners[i]].map(|c| self.truth(c));
                *breaks = a != b;
            }
        }
        let table = &self.finest.mesh.table;
        let far = |i: usize| {
            let [a, b] =
                [corners[(i + count - 1) % count].prev(), corners[i].next()].map(|c| self.wedges.of(c));
            if a == Wedges::NONE || b == Wedges::NONE { 0 } else { 1 + usize::from(a != b) }
        };
        let inner = usize::from(is_boundary)..count;
        let parted = inner.clone().filter(|&i| far(i) == 2).count();
        let any = spokes.contains(&true);
        if !coder.bit(&mut self.broken[parted.min(2)], || any) {
            return;
        }
        for i in inner {
            let context = [far(i), bend(self.finest, table.opposite(corners[i].prev()), corners[i].prev())];
            let known = spokes[i];
            spokes[i] = coder.bit(&mut self.breaks[context[0]][context[1]], || known);
        }
    }

    /// A wedge with its values.
    fn wedge<C: BitCoder>(
        &mut self,
        corners: &[Corner],
        before: Option<u32>,
        coder: &mut C,
        budget: &mut Budget,
    ) -> Result<u32, WholeError> {
        take_room(budget, self.wedges.count(), self.columns)?;
        let known = if C::ENCODES { self.truth(corners[0]) } else { 0 };
        let around = Around { mesh: self.finest.mesh, wedges: &self.wedges };
        for (k, (column, models)) in self.columns.iter_mut().zip(&mut self.models).enumerate() {
            if column.kind.domain == Domain::Corner {
                models.code(coder, &around, column, corners, before, self.known.value(k, known))?;
            }
        }
        if C::ENCODES {
            self.lists.push(known);
        }
        Ok(self.wedges.append(corners))
    }

    /// What the writer knows the wedge of a corner by.
    fn truth(&self, c: Corner) -> u32 {
        let place = self.place[c.triangle().index()] as usize;
        let first = self.finest.tour.walk.triangles[place];
        let k = [first, first.next(), first.prev()].iter().position(|&other| other == c).unwrap_or(0);
        self.known.wedge(place, k)
    }
}

/// The corners round a vertex, from one of them on.
fn fan(table: &CornerTable, first: Corner) -> impl Iterator<Item = Corner> + '_ {
    let next = move |&c: &Corner| Some(table.swing(c)).filter(|&c| c.is_some() && c != first);
    std::iter::successors(Some(first), next)
}

/// How far two triangles are from lying in one plane, by corners that face each other: 0 within 20 degrees, 1 within 60, 2 beyond, or
/// where there is but one.
fn bend(finest: Finest, c: Corner, o: Corner) -> usize {
    if c.is_none() || o.is_none() {
        return 2;
    }
    let normal = |c: Corner| {
        let [a, b, d] =
            finest.mesh.table.vertices_from(c).map(|v| finest.mesh.positions[v.index()].map(f64::from));
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

/// The values of triangles, in walk order, then of the further ones.
pub fn code_triangles<C: BitCoder>(
    finest: Finest,
    columns: &mut [Column],
    known: &impl Known,
    coder: &mut C,
    budget: &mut Budget,
) -> Result<(), WholeError> {
    let table = &finest.mesh.table;
    let walk = &finest.tour.walk;
    for (k, column) in
        columns.iter_mut().enumerate().filter(|(_, column)| column.kind.domain == Domain::Triangle)
    {
        budget.take_work(WORK_A_CORNER * finest.whole.triangles.len() as u64)?;
        budget.take_memory(table.slots(), size_of::<u32>())?;
        let mut place = vec![u32::MAX; table.slots()];
        let mut models = CornerModels::new(column);
        let mut last = None;
        let around = Around { mesh: finest.mesh, wedges: &Wedges::default() };
        for t in 0..finest.whole.triangles.len() {
            take_room(budget, t as u32, std::slice::from_ref(column))?;
            // The triangle that the walk came from; of a further one, the one before.
            let before = match walk.triangles.get(t) {
                Some(&c) => {
                    place[c.triangle().index()] = t as u32;
                    let from = table.opposite(c);
                    place.get(from.triangle().index()).copied().filter(|&place| place != u32::MAX).or(last)
                }
                None => last,
            };
            models.code(coder, &around, column, &[], before, known.of_triangle(k, t))?;
            coder.check()?;
            last = Some(t as u32);
        }
        budget.give_memory(table.slots(), size_of::<u32>());
    }
    Ok(())
}

/// Debits the budget for some further values of all columns, at item `k`.
pub fn take_room(budget: &mut Budget, k: u32, columns: &[Column]) -> Result<(), WholeError> {
    if k.is_multiple_of(AHEAD as u32) {
        let integers: usize = columns.iter().map(|column| column.kind.integers() + 1).sum();
        // In lists that have just been copied to ones twice as long.
        budget.take_memory(AHEAD, 3 * 4 * (integers + 2))?;
        budget.take_work(WORK_A_VALUE * (AHEAD * columns.len()) as u64)?;
    }
    Ok(())
}

/// Items that the budget is debited for at a time.
const AHEAD: usize = 1024;
/// Units of work for a corner that is looked at, and for a value.
const WORK_A_CORNER: u64 = 4;
const WORK_A_VALUE: u64 = 16;
