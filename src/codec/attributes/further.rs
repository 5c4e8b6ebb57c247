//! The wedges of the residue's further triangles: those of their vertices, or new ones (spec §13.6).

use super::column::Column;
use super::values::Around;
use super::whole::{CornerModels, take_room};
use super::{Finest, Known};
use crate::codec::whole::{WholeError, spend};
use crate::entropy::{BitCoder, NumberModel};
use crate::limits::Budget;
use crate::mesh::Corner;
use crate::mesh::attributes::Domain;
use crate::refine::Wedges;
use std::collections::HashMap;

/// The pass over the further triangles.
pub struct Further<'a, K> {
    finest: Finest<'a>,
    wedges: &'a Wedges,
    /// For each wedge what the writer knows it by.
    lists: Vec<u32>,
    models: Vec<CornerModels>,
    known: &'a K,
    /// How many wedges there are.
    pub count: u32,
}

impl<'a, K: Known> Further<'a, K> {
    pub fn new(
        finest: Finest<'a>,
        wedges: &'a Wedges,
        lists: Vec<u32>,
        models: Vec<CornerModels>,
        known: &'a K,
    ) -> Self {
        Self { finest, wedges, lists, models, known, count: wedges.count() }
    }

    /// Codes the corners of all further triangles.
    pub fn code<C: BitCoder>(
        &mut self,
        columns: &mut [Column],
        coder: &mut C,
        budget: &mut Budget,
    ) -> Result<Vec<[u32; 3]>, WholeError> {
        let first = self.finest.tour.walk.triangles.len();
        let triangles = &self.finest.residue.triangles;
        // The wedges of a vertex of the whole, in the order in which they came.
        let mut at: HashMap<u32, Vec<u32>> = HashMap::new();
        self.list_known(&mut at, budget)?;
        let mut choice = NumberModel::default();
        let mut coded = Vec::new();
        for (t, triangle) in triangles.iter().enumerate() {
            spend(budget, t)?;
            let mut corners = [0; 3];
            for (k, &name) in triangle.iter().enumerate() {
                let here = at.entry(self.finest.whole.names[name as usize]).or_default();
                let truth = self.known.wedge(first + t, k);
                let wanted = || {
                    let found = here.iter().position(|&wedge| self.lists.get(wedge as usize) == Some(&truth));
                    found.map_or(0, |place| place as u32 + 1)
                };
                let chosen = if here.is_empty() { 0 } else { choice.unsigned(coder, wanted)? };
                corners[k] = match chosen {
                    0 => {
                        take_room(budget, self.count, columns)?;
                        let around = Around { mesh: self.finest.mesh, wedges: self.wedges };
                        let before = here.last().copied().or(self.count.checked_sub(1));
                        for (k, (column, models)) in columns.iter_mut().zip(&mut self.models).enumerate() {
                            if column.kind.domain == Domain::Corner {
                                let value = self.known.value(k, truth);
                                models.code(coder, &around, column, &[], before, value)?;
                            }
                        }
                        if C::ENCODES {
                            self.lists.push(truth);
                        }
                        here.push(self.count);
                        self.count += 1;
                        self.count - 1
                    }
                    place => *here
                        .get(place as usize - 1)
                        .ok_or(WholeError::Range("a further triangle names a wedge that does not exist"))?,
                };
                coder.check()?;
            }
            coded.push(corners);
        }
        Ok(coded)
    }

    /// Lists the wedges of the vertices that further triangles have in common with the mesh.
    fn list_known(&self, at: &mut HashMap<u32, Vec<u32>>, budget: &mut Budget) -> Result<(), WholeError> {
        let Finest { mesh, tour, residue, whole, .. } = self.finest;
        if residue.triangles.is_empty() {
            return Ok(());
        }
        budget.take_memory(residue.triangles.len(), BYTES_A_TRIANGLE)?;
        for &name in residue.triangles.as_flattened() {
            at.entry(whole.names[name as usize]).or_default();
        }
        budget.take_work(4 * mesh.table.slots() as u64)?;
        for (k, &v) in tour.vertices.iter().enumerate() {
            let Some(here) = at.get_mut(&whole.names[k]) else { continue };
            let wedges = mesh.table.fan(v).map(|c: Corner| self.wedges.of(c));
            let from = here.len();
            here.extend(wedges);
            // By birth, whichever corner the table has the fan begin at.
            here[from..].sort_unstable();
            here.dedup();
            budget.take_memory(here.len() - from, 3 * size_of::<u32>())?;
        }
        Ok(())
    }
}

/// What a further triangle takes here: three entries of the map, which may just have grown, with lists of their own.
const BYTES_A_TRIANGLE: usize = 3 * 128;
