//! The whole pass: every vertex of a mesh in walk order, then its triangles (spec §13.3, §13.7).

use super::ring::Ring;
use super::round::{CornerModels, RoundModels, Vicinity, WORK_A_VALUE, fan, take_room};
use super::values::Around;
use super::{Attributes, Known};
use crate::codec::walk::Walk;
use crate::codec::whole::WholeError;
use crate::entropy::BitCoder;
use crate::limits::Budget;
use crate::mesh::Triangle;
use crate::mesh::attributes::Domain;
use crate::refine::{ProgressiveMesh, Wedges};
use bitvec::vec::BitVec;

/// A reader knows nothing.
pub struct Nothing;

impl Known for Nothing {
    fn label(&self, _: crate::mesh::Corner) -> u32 {
        0
    }
    fn of_triangle(&self, _: Triangle) -> u32 {
        0
    }
    fn further(&self, _: usize) -> [u32; 4] {
        [0; 4]
    }
    fn value(&self, _: usize, _: u32) -> Option<&[i32]> {
        None
    }
}

/// A mesh that is told of, and what of.
#[derive(Clone, Copy, Debug)]
pub struct Ground<'a> {
    /// The mesh.
    pub mesh: &'a ProgressiveMesh,
    /// A walk of it.
    pub walk: &'a Walk,
    /// Which columns are told, in order.
    pub born: &'a [usize],
}

impl Attributes {
    /// Codes the values of columns that are born at a mesh, of all its corners and triangles. Wedges that there are part further where
    /// these part them.
    ///
    /// # Errors
    /// [`WholeError`].
    pub fn bear<C: BitCoder, K: Known>(
        &mut self,
        ground: Ground,
        coder: &mut C,
        known: &K,
        budget: &mut Budget,
    ) -> Result<(), WholeError> {
        self.open(ground, budget)?;
        let bytes = RoundModels::bytes(&self.columns);
        budget.take_memory(bytes, 1)?;
        let mut models = RoundModels::new(&self.columns);
        self.bear_corners(ground, &mut models, coder, known, budget)?;
        drop(models);
        budget.give_memory(bytes, 1);
        self.bear_triangles(ground, coder, known, budget, |_, _, _, _, _| Ok(()))?;
        self.born(ground.born);
        Ok(())
    }

    /// Room for wedges, where there is none.
    pub(super) fn open(&mut self, ground: Ground, budget: &mut Budget) -> Result<(), WholeError> {
        let table = &ground.mesh.table;
        let told = |&k: &usize| self.columns[k].kind.constant.is_none();
        if self.wedges.is_empty() && ground.born.iter().any(told) {
            budget.take_memory(Wedges::bytes(table), 1)?;
            self.wedges = Wedges::open(table);
        }
        Ok(())
    }

    /// The pass over the vertices.
    pub(super) fn bear_corners<C: BitCoder, K: Known>(
        &mut self,
        ground: Ground,
        models: &mut RoundModels,
        coder: &mut C,
        known: &K,
        budget: &mut Budget,
    ) -> Result<(), WholeError> {
        let Ground { mesh, walk, .. } = ground;
        let born = self.at_corners(ground.born);
        if born.is_empty() {
            return Ok(());
        }
        let integers: usize = born.iter().map(|&k| self.columns[k].kind.integers() + 1).sum();
        budget.take_memory(self.wedges.count() as usize, 4 * integers)?;
        budget.take_work(WORK_A_CORNER * 3 * walk.triangles.len() as u64)?;
        budget.take_work(WORK_A_VALUE * u64::from(self.wedges.count()) * born.len() as u64)?;
        // Which vertices the pass has been to, and which wedges from before are theirs.
        let marks = [mesh.table.vertex_slots(), self.wedges.count() as usize];
        let marks: usize = marks.iter().map(|count| count / 8 + size_of::<usize>()).sum();
        budget.take_memory(marks, 1)?;
        models.taken = BitVec::repeat(false, self.wedges.count() as usize);
        let old = self.corner_columns();
        let mut seen: BitVec = BitVec::repeat(false, mesh.table.vertex_slots());
        let mut ring = Ring::default();
        for &c in &walk.triangles {
            for first in [c.next(), c.prev(), c] {
                let v = mesh.table.vertex(first);
                if seen[v.index()] {
                    continue;
                }
                let is_boundary = mesh.table.is_boundary(v);
                let vicinity = Vicinity { mesh, born: &born, old: &old, is_boundary };
                ring.corners.clear();
                // Where there is an end to go from, the fan goes from there.
                ring.corners
                    .extend(fan(&mesh.table, if is_boundary { mesh.table.corner_of(v) } else { first }));
                ring.look(&Around { mesh, wedges: &self.wedges });
                self.round(models, vicinity, &mut ring, |w| seen[w.index()], None, coder, known, budget)?;
                seen.set(v.index(), true);
                coder.check()?;
            }
        }
        models.taken = BitVec::new();
        budget.give_memory(marks, 1);
        self.count = self.wedges.count();
        Ok(())
    }

    /// The values of triangles, in walk order; `behind` codes what follows for a column. Rows are numbered by the walk from now on.
    pub(super) fn bear_triangles<C: BitCoder, K: Known>(
        &mut self,
        ground: Ground,
        coder: &mut C,
        known: &K,
        budget: &mut Budget,
        mut behind: impl FnMut(&mut Self, usize, &mut CornerModels, &mut C, &mut Budget) -> Result<(), WholeError>,
    ) -> Result<(), WholeError> {
        let Ground { mesh, walk, .. } = ground;
        let of = |k: &usize| self.columns[*k].kind.is_coded_at(Domain::Triangle);
        let born: Vec<usize> = ground.born.iter().copied().filter(of).collect();
        let table = &mesh.table;
        let first = self.rows;
        if !born.is_empty() {
            budget.take_memory(table.slots(), size_of::<u32>())?;
            self.number_rows(walk, budget)?;
        }
        for k in 0..self.columns.len() {
            if !self.columns[k].kind.is_coded_at(Domain::Triangle) {
                continue;
            }
            let bytes = CornerModels::bytes(&self.columns[k]);
            budget.take_memory(bytes, 1)?;
            let mut models = CornerModels::new(&self.columns[k]);
            if born.contains(&k) {
                budget.take_work(WORK_A_CORNER * walk.triangles.len() as u64)?;
                let mut last = None;
                let around = Around { mesh, wedges: &Wedges::default() };
                let mut done: BitVec = BitVec::repeat(false, table.slots());
                for (place, &c) in (0..).zip(&walk.triangles) {
                    take_room(budget, place, std::slice::from_ref(&self.columns[k]))?;
                    // The triangle that the walk came from.
                    let from = table.opposite(c);
                    let from = Some(from).filter(|from| from.is_some() && done[from.triangle().index()]);
                    let before = from.map(|from| self.wedges.row(from.triangle())).or(last);
                    done.set(c.triangle().index(), true);
                    let truth = if C::ENCODES { known.of_triangle(c.triangle()) } else { 0 };
                    let truth = known.value(k, truth);
                    let (row, column) = (first + place, &mut self.columns[k]);
                    models.code(coder, &around, &mut Ring::default(), column, row, before, truth)?;
                    coder.check()?;
                    last = Some(first + place);
                }
            }
            behind(self, k, &mut models, coder, budget)?;
            budget.give_memory(bytes, 1);
        }
        if !born.is_empty() {
            budget.give_memory(table.slots(), size_of::<u32>());
        }
        Ok(())
    }

    /// New rows for triangles as the walk meets them, with the values that are known of their old ones: these stay, for who goes back.
    fn number_rows(&mut self, walk: &Walk, budget: &mut Budget) -> Result<(), WholeError> {
        let known: Vec<usize> = (0..self.columns.len())
            .filter(|&k| self.is_born(k) && self.columns[k].kind.is_coded_at(Domain::Triangle))
            .collect();
        let integers: usize = known.iter().map(|&k| self.columns[k].kind.integers() + 1).sum();
        budget.take_memory(walk.triangles.len(), 4 * integers)?;
        for c in &walk.triangles {
            let (old, row) = (self.wedges.row(c.triangle()), self.rows);
            if old != Wedges::NONE {
                known.iter().for_each(|&k| self.columns[k].copy(old, row));
            }
            self.wedges.set_row(c.triangle(), row);
            self.rows += 1;
        }
        Ok(())
    }
}

/// Units of work for a corner that is looked at.
const WORK_A_CORNER: u64 = 4;
