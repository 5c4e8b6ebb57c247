//! Attributes: which corners of a vertex share their values, and the values (spec §13).

mod column;
mod frame;
mod further;
mod numbers;
mod predict;
mod residual;
#[cfg(feature = "encode")]
mod truth;
mod values;
mod whole;

use super::residue::Residue;
use super::walk::{Tour, Walk};
use super::whole::{Whole, WholeError};
use crate::entropy::RangeDecoder;
use crate::limits::Budget;
use crate::mesh::attributes::{Domain, Kind};
use crate::refine::{ProgressiveMesh, Wedges};
use further::Further;
use whole::WholePass;

pub use column::Column;
#[cfg(feature = "encode")]
pub use truth::Truth;

/// The attributes of level 0.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Attributes {
    /// A column of values each: by wedge, those of the further triangles behind the others; or by triangle of the whole.
    pub columns: Vec<Column>,
    /// Which wedge each corner of the mesh names; empty where all columns are of triangles.
    pub wedges: Wedges,
    /// The wedges of the further triangles of the residue, in their order.
    pub further: Vec<[u32; 3]>,
    /// How many wedges there are in all.
    pub count: u32,
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
        Self { columns: kinds.into_iter().map(Column::new).collect(), ..Self::default() }
    }

    /// Writes the attributes that `truth` tells, of level 0. Returned are the payload and the units of work that reading it takes.
    ///
    /// # Errors
    /// [`WholeError`] where a number cannot be written.
    #[cfg(feature = "encode")]
    pub fn encode(
        kinds: impl IntoIterator<Item = Kind>,
        truth: &Truth,
        finest: Finest,
    ) -> Result<(Vec<u8>, u64), WholeError> {
        let mut coder = crate::entropy::RangeEncoder::default();
        let mut budget = Budget::unlimited();
        Self::new(kinds).code(finest, truth, &mut coder, &mut budget)?;
        Ok((coder.finish(), budget.work()))
    }

    /// Reads the attributes of level 0.
    ///
    /// # Errors
    /// [`WholeError`]; memory grows with what has been read.
    pub fn decode(
        bytes: &[u8],
        kinds: impl IntoIterator<Item = Kind>,
        finest: Finest,
        budget: &mut Budget,
    ) -> Result<Self, WholeError> {
        let mut coder = RangeDecoder::new(bytes);
        let mut attributes = Self::new(kinds);
        attributes.code(finest, &whole::Nothing, &mut coder, budget)?;
        coder.finish()?;
        Ok(attributes)
    }

    fn code<C: crate::entropy::BitCoder>(
        &mut self,
        finest: Finest,
        truth: &impl Known,
        coder: &mut C,
        budget: &mut Budget,
    ) -> Result<(), WholeError> {
        if self.columns.iter().any(|column| column.kind.domain == Domain::Corner) {
            budget.take_memory(Wedges::bytes(&finest.mesh.table), 1)?;
            let mut pass = WholePass::new(finest, &mut self.columns, truth);
            pass.code_vertices(coder, budget)?;
            let (wedges, lists, models) = pass.end();
            let mut further = Further::new(finest, &wedges, lists, models, truth);
            self.further = further.code(&mut self.columns, coder, budget)?;
            self.count = further.count;
            self.wedges = wedges;
        }
        whole::code_triangles(finest, &mut self.columns, truth, coder, budget)
    }

    /// For each corner of each triangle of the whole its wedge.
    pub fn corners(&self, walk: &Walk, residue: &Residue) -> Vec<[u32; 3]> {
        let of_walk = walk.triangles.iter().enumerate().map(|(k, &c)| {
            let [a, b, d] = [c, c.next(), c.prev()].map(|c| self.wedges.of(c));
            if residue.is_flipped(k) { [a, d, b] } else { [a, b, d] }
        });
        let mut corners: Vec<[u32; 3]> = of_walk.chain(self.further.iter().copied()).collect();
        // Where there are but columns of triangles, nothing has a wedge.
        corners.resize(walk.triangles.len() + residue.triangles.len(), [Wedges::NONE; 3]);
        corners
    }
}

/// What a writer knows of the attributes; a reader is never asked.
pub trait Known {
    /// What tells the wedges of a vertex apart, of corner `k` (0 for the corner of the walk, 1 for its next, 2 for its prev) of triangle
    /// `place`; of a further triangle, of its corner `k`.
    fn wedge(&self, place: usize, k: usize) -> u32;
    /// The value of column `column` there; `None` where it has none.
    fn value(&self, column: usize, wedge: u32) -> Option<&[i32]>;
    /// The value of a triangle.
    fn of_triangle(&self, column: usize, place: usize) -> Option<&[i32]>;
}
