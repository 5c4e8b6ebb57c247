//! The order of the input's vertices and triangles (spec §11).

mod instances;
mod triangles;
mod vertices;

use super::residue::Residue;
use super::walk::Walk;
use super::whole::{Whole, WholeError};
use crate::entropy::{BitCoder, RangeDecoder};
use crate::limits::Budget;
use crate::mesh::IndexedMesh;
use crate::refine::ProgressiveMesh;
use triangles::Surface;

/// The lists of the input.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Order {
    /// For each vertex of the input its vertex of the whole, copies of the correction included.
    pub vertices: Vec<u32>,
    /// The triangles of the input, by its vertices.
    pub triangles: Vec<[u32; 3]>,
    /// Which triangle of the whole each of them is; known to readers.
    pub origins: Vec<Origin>,
}

/// Which triangle of the whole a triangle of the input is: its place, and at which corner of that it begins, 0 to 2.
pub type Origin = (u32, u32);

const NONE: u32 = u32::MAX;

impl Order {
    /// Writes the order of `whole`, which is level 0, `mesh`, with its residue and the copies of its correction: `count`
    /// vertices, on a walk of it. `origins` tells of each triangle of the input which one it is. Returned are the
    /// payload and the units of work that reading it takes.
    #[cfg(feature = "encode")]
    pub fn encode(
        &self,
        mesh: &ProgressiveMesh,
        residue: &Residue,
        walk: &Walk,
        whole: &Whole,
        count: usize,
        origins: &[Origin],
    ) -> Result<(Vec<u8>, u64), WholeError> {
        let mut coder = crate::entropy::RangeEncoder::default();
        let mut budget = Budget::unlimited();
        let surface = Surface::new(mesh, residue, walk);
        self.clone().code(&surface, whole, count, origins, &mut coder, &mut budget)?;
        Ok((coder.finish(), budget.work()))
    }

    /// Reads the order of `whole`; see [`Order::encode`].
    ///
    /// # Errors
    /// [`WholeError`]; memory grows with what has been read.
    pub fn decode(
        bytes: &[u8],
        mesh: &ProgressiveMesh,
        residue: &Residue,
        walk: &Walk,
        whole: &Whole,
        count: usize,
        budget: &mut Budget,
    ) -> Result<Self, WholeError> {
        let mut coder = RangeDecoder::new(bytes);
        let triangles = whole.triangles.len();
        budget.take_memory(mesh.table.slots(), BYTES_A_SLOT)?;
        budget.take_memory(triangles, BYTES_A_TRIANGLE)?;
        budget.take_memory(count, BYTES_A_VERTEX)?;
        let mut order = Self::default();
        order.code(&Surface::new(mesh, residue, walk), whole, count, &[], &mut coder, budget)?;
        coder.finish()?;
        budget.give_memory(mesh.table.slots(), BYTES_A_SLOT);
        budget.give_memory(triangles, BYTES_A_TRIANGLE - BYTES_KEPT - size_of::<Origin>());
        budget.give_memory(count, BYTES_A_VERTEX - BYTES_KEPT);
        Ok(order)
    }

    /// The input's lists, of the positions of the whole and of its copies.
    pub fn apply(&self, positions: &[[f64; 3]]) -> IndexedMesh {
        let positions = self.vertices.iter().map(|&v| positions[v as usize]).collect();
        IndexedMesh::new(positions, self.triangles.clone())
    }

    fn code<C: BitCoder>(
        &mut self,
        surface: &Surface,
        whole: &Whole,
        count: usize,
        origins: &[Origin],
        coder: &mut C,
        budget: &mut Budget,
    ) -> Result<(), WholeError> {
        budget.take_work(WORK_AN_ITEM * (whole.triangles.len() + count) as u64)?;
        let (mut corners, origins) = triangles::code(surface, whole, origins, coder)?;
        let instances = instances::code(self, &mut corners, count, coder, budget)?;
        let numbers = vertices::code(self, &corners, &instances, coder)?;
        self.vertices.resize(instances.len(), 0);
        for (&v, &number) in instances.iter().zip(&numbers) {
            self.vertices[number as usize] = v;
        }
        for triangle in &mut corners {
            *triangle = triangle.map(|instance| numbers[instance as usize]);
        }
        self.triangles = corners;
        self.origins = origins;
        Ok(())
    }
}

/// Memory for a triangle and for a vertex while an order is read, and what is kept of it.
const BYTES_A_TRIANGLE: usize = 48;
const BYTES_A_VERTEX: usize = 32;
const BYTES_KEPT: usize = 12;
/// Memory for a slot of the table: its place.
const BYTES_A_SLOT: usize = 4;
/// Units of work for one.
const WORK_AN_ITEM: u64 = 64;
