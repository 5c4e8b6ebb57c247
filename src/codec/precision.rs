//! The precision pass: all positions of a level gain bits, one a coordinate and round (spec §5.6).

use super::refinement::SegmentModels;
use super::walk::Walk;
use crate::entropy::{BitCoder, CodingError};
use crate::mesh::Vertex;
use crate::refine::{ProgressiveMesh, from_cell};

/// The state of a pass under way; it survives from atom to atom.
#[derive(Debug)]
pub struct PrecisionPass {
    order: Vec<Vertex>,
    cursor: usize,
    /// The s the round under way leads to, and the last one.
    shift: u32,
    last: u32,
}

impl PrecisionPass {
    /// A pass over the coarser level's vertices from its precision `from` down to `to`, `to < from`.
    pub fn new(mesh: &ProgressiveMesh, walk: &Walk, from: u32, to: u32) -> Self {
        debug_assert!(to < from);
        Self { order: walk.vertices(&mesh.table), cursor: 0, shift: from.saturating_sub(1), last: to }
    }

    /// Codes one vertex's next bits and moves it; `None` where the pass is over. `known` gives full-scale coordinates.
    ///
    /// # Errors
    /// [`CodingError`] where the code is too short.
    pub fn step<C: BitCoder>(
        &mut self,
        mesh: &mut ProgressiveMesh,
        models: &mut SegmentModels,
        coder: &mut C,
        known: impl Fn(Vertex) -> [i32; 3],
    ) -> Result<Option<Vertex>, CodingError> {
        if self.cursor == self.order.len() {
            if self.shift == self.last || self.order.is_empty() {
                return Ok(None);
            }
            self.shift -= 1;
            self.cursor = 0;
        }
        let v = self.order[self.cursor];
        self.cursor += 1;
        let shift = self.shift;
        let mut position = mesh.positions[v.index()];
        for (i, x) in position.iter_mut().enumerate() {
            let bit = coder.bit(&mut models.precision[i], || known(v)[i] >> shift & 1 == 1);
            *x = from_cell((*x >> (shift + 1)) << 1 | i32::from(bit), shift);
        }
        mesh.positions[v.index()] = position;
        coder.check()?;
        Ok(Some(v))
    }
}
