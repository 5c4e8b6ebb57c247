//! Attributes: which corners of a vertex share their values, and the values (spec §13).

mod column;
mod frame;
mod further;
mod numbers;
mod owed;
mod predict;
mod recall;
mod refined;
mod residual;
mod ring;
mod round;
#[cfg(feature = "encode")]
mod truth;
mod values;
mod whole;

use super::residue::Residue;
use super::walk::{Tour, Walk};
use super::whole::{Whole, WholeError};
use crate::entropy::BitCoder;
use crate::limits::Budget;
use crate::mesh::attributes::{Domain, Kind};
use crate::mesh::{Corner, Triangle};
use crate::refine::{ProgressiveMesh, Wedges};
use further::Further;
use round::RoundModels;

pub use column::Column;
pub use owed::TOGETHER;
pub use refined::RefinedModels;
#[cfg(feature = "encode")]
pub use truth::{Labelled, Truth};
pub use whole::{Ground, Nothing};

/// The attributes of a mesh, of its level or any state between two.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Attributes {
    /// A column of values each: by wedge, those of the further triangles of level 0 behind the others; or by row of triangles. Empty where
    /// an attribute has not been born.
    pub columns: Vec<Column>,
    /// Which wedge each corner of the mesh names, and which row each of its triangles has.
    pub wedges: Wedges,
    /// The wedges of the further triangles of the residue, in their order.
    pub further: Vec<[u32; 3]>,
    /// How many wedges there are in all.
    pub count: u32,
    /// Which columns have been born.
    is_born: Vec<bool>,
    /// Those of them that are at corners.
    alive: Vec<usize>,
    /// How many rows of triangles there are.
    rows: u32,
    /// The row of the first further triangle of level 0, once known.
    further_row: u32,
}

/// Level 0, which attributes are told of.
#[derive(Clone, Copy, Debug)]
pub struct Finest<'a> {
    /// The mesh.
    pub mesh: &'a ProgressiveMesh,
    /// A walk of it.
    pub tour: &'a Tour,
    /// Its residue.
    pub residue: &'a Residue,
    /// All of it together; its triangles at the vertices of the input, without copies.
    pub whole: &'a Whole,
}

impl Attributes {
    /// Attributes of which nothing is known but their kinds.
    pub fn new(kinds: impl IntoIterator<Item = Kind>) -> Self {
        let columns: Vec<Column> = kinds.into_iter().map(Column::new).collect();
        // What is constant is known at every level.
        let is_born = columns.iter().map(|column| column.kind.constant.is_some()).collect();
        Self { is_born, columns, ..Self::default() }
    }

    /// Whether the values of an attribute are known; it is then alive.
    pub fn is_born(&self, column: usize) -> bool {
        self.is_born.get(column).is_some_and(|&born| born)
    }

    /// Whether none is alive.
    pub fn are_none(&self) -> bool {
        !self.is_born.contains(&true)
    }

    /// Codes what level 0 has: the attributes that are born there, and the values of the residue's further triangles.
    ///
    /// # Errors
    /// [`WholeError`]; memory grows with what has been read.
    pub fn finish<C: BitCoder, K: Known>(
        &mut self,
        born: &[usize],
        finest: Finest,
        coder: &mut C,
        known: &K,
        budget: &mut Budget,
    ) -> Result<(), WholeError> {
        let ground = Ground { mesh: finest.mesh, walk: &finest.tour.walk, born };
        self.open(ground, budget)?;
        let bytes = RoundModels::bytes(&self.columns);
        budget.take_memory(bytes, 1)?;
        let mut models = RoundModels::new(&self.columns);
        self.bear_corners(ground, &mut models, coder, known, budget)?;
        self.born(born);
        let further = finest.residue.triangles.len();
        if further > 0 && !self.alive.is_empty() {
            self.further = Further::new(finest, models.columns, known).code(self, coder, budget)?;
        }
        budget.give_memory(bytes, 1);
        // The rows of further triangles come behind those of the walk.
        self.bear_triangles(ground, coder, known, budget, |this, k, models, coder, budget| {
            this.further_rows(finest, k, models, coder, known, budget)
        })?;
        self.further_row = self.rows;
        self.rows += further as u32;
        Ok(())
    }

    /// Codes the attributes of components that are born, a mesh of their own, and joins them.
    ///
    /// # Errors
    /// [`WholeError`].
    pub fn join<C: BitCoder, K: Known>(
        &mut self,
        part: &ProgressiveMesh,
        walk: &Walk,
        coder: &mut C,
        known: &K,
        budget: &mut Budget,
    ) -> Result<(), WholeError> {
        let told = |k: &usize| self.is_born(*k) && self.columns[*k].kind.constant.is_none();
        let born: Vec<usize> = (0..self.columns.len()).filter(told).collect();
        if born.is_empty() {
            return Ok(());
        }
        budget.take_memory(Wedges::bytes(&part.table), 2)?;
        let own = Wedges::open_from(&part.table, self.wedges.count());
        let whole = std::mem::replace(&mut self.wedges, own);
        let outcome = self.bear(Ground { mesh: part, walk, born: &born }, coder, known, budget);
        let own = std::mem::replace(&mut self.wedges, whole);
        self.wedges.append_part(&own);
        outcome
    }

    /// These columns have got their values.
    fn born(&mut self, columns: &[usize]) {
        columns.iter().for_each(|&k| self.is_born[k] = true);
        self.alive = self.corner_columns();
    }

    /// The columns at corners that are alive.
    fn corner_columns(&self) -> Vec<usize> {
        let born: Vec<usize> = (0..self.columns.len()).filter(|&k| self.is_born(k)).collect();
        self.at_corners(&born)
    }

    /// Whether two wedges have the same values in some columns. Their numbers do not tell: these depend on where a decoder has set out from.
    fn are_alike<'a>(&self, a: u32, b: u32, columns: impl IntoIterator<Item = &'a usize>) -> bool {
        let is_same = |&k: &usize| self.columns[k].value(a) == self.columns[k].value(b);
        a == b || columns.into_iter().all(is_same)
    }

    fn at_corners(&self, columns: &[usize]) -> Vec<usize> {
        columns.iter().copied().filter(|&k| self.columns[k].kind.is_coded_at(Domain::Corner)).collect()
    }

    /// For each corner of each triangle of a mesh its wedge: those of its walk, and of the further triangles of `residue`.
    pub fn corners(&self, walk: &Walk, residue: &Residue) -> Vec<[u32; 3]> {
        let of_walk = walk.triangles.iter().enumerate().map(|(k, &c)| {
            let [a, b, d] = [c, c.next(), c.prev()].map(|c| self.wedges.of(c));
            if residue.is_flipped(k) { [a, d, b] } else { [a, b, d] }
        });
        let further = residue.triangles.len();
        let mut corners: Vec<[u32; 3]> = of_walk.chain(self.further.iter().take(further).copied()).collect();
        // Where there are but columns of triangles, nothing has a wedge.
        corners.resize(walk.triangles.len() + further, [Wedges::NONE; 3]);
        corners
    }

    /// The row of a further triangle of level 0.
    pub fn further_row(&self, k: u32) -> u32 {
        self.further_row.saturating_add(k)
    }

    /// For each triangle of a mesh its row, likewise.
    pub fn rows(&self, walk: &Walk, residue: &Residue) -> Vec<u32> {
        let of_walk = walk.triangles.iter().map(|c| self.wedges.row(c.triangle()));
        let further = (0..residue.triangles.len() as u32).map(|place| self.further_row(place));
        of_walk.chain(further).collect()
    }
}

/// What a writer knows of the attributes; a reader is never asked.
pub trait Known {
    /// What tells a corner of the mesh from others: its values in all attributes.
    fn label(&self, c: Corner) -> u32;
    /// What tells a triangle of the mesh from others.
    fn of_triangle(&self, t: Triangle) -> u32;
    /// What tells the corners of a further triangle from others, and the triangle.
    fn further(&self, place: usize) -> [u32; 4];
    /// The value of a column that a label stands for; `None` where it has none.
    fn value(&self, column: usize, label: u32) -> Option<&[i32]>;
}
