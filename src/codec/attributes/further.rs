//! What the residue's further triangles have: the wedges of their vertices, or new ones, and values of their own (spec §13.6, §13.7).

use super::ring::Ring;
use super::round::{CornerModels, fan, take_room};
use super::values::Around;
use super::{Attributes, Finest, Known};
use crate::codec::whole::{WholeError, spend};
use crate::entropy::{BitCoder, NumberModel};
use crate::limits::Budget;
use crate::mesh::attributes::Domain;
use crate::refine::Wedges;
use bitvec::vec::BitVec;
use std::collections::HashMap;

/// The pass over the further triangles.
pub struct Further<'a, K> {
    finest: Finest<'a>,
    models: Vec<CornerModels>,
    known: &'a K,
}

impl<'a, K: Known> Further<'a, K> {
    pub fn new(finest: Finest<'a>, models: Vec<CornerModels>, known: &'a K) -> Self {
        Self { finest, models, known }
    }

    /// Codes the corners of all further triangles.
    pub fn code<C: BitCoder>(
        &mut self,
        attributes: &mut Attributes,
        coder: &mut C,
        budget: &mut Budget,
    ) -> Result<Vec<[u32; 3]>, WholeError> {
        let triangles = &self.finest.residue.triangles;
        // The wedges of a vertex of the whole, in the order in which the walk and further triangles have them.
        let mut at = self.list_known(attributes, budget)?;
        let Attributes { columns, wedges, alive, count, .. } = attributes;
        let mut choice = NumberModel::default();
        let (mut coded, mut last) = (Vec::new(), None);
        // Nothing is round them.
        let mut ring = Ring::default();
        for (t, triangle) in triangles.iter().enumerate() {
            spend(budget, t)?;
            let mut corners = [0; 3];
            for (k, &name) in triangle.iter().enumerate() {
                let here = at.entry(self.finest.whole.names[name as usize]).or_default();
                let label = if C::ENCODES { self.known.further(t)[k] } else { 0 };
                let is_it = |&wedge: &u32| {
                    alive.iter().all(|&k| columns[k].value(wedge) == self.known.value(k, label))
                };
                let wanted = || here.iter().position(is_it).map_or(0, |place| place as u32 + 1);
                let chosen = if here.is_empty() { 0 } else { choice.unsigned(coder, wanted)? };
                corners[k] = match chosen {
                    0 => {
                        take_room(budget, *count, columns)?;
                        let around = Around { mesh: self.finest.mesh, wedges };
                        let before = here.last().copied().or(last);
                        for &k in alive.iter() {
                            let (models, column) = (&mut self.models[k], &mut columns[k]);
                            let value = self.known.value(k, label);
                            models.code(coder, &around, &mut ring, column, *count, before, value)?;
                        }
                        here.push(*count);
                        last = Some(*count);
                        *count += 1;
                        *count - 1
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

    /// Lists the wedges of the vertices that further triangles have in common with the mesh: of each run of alike ones round a vertex the
    /// first, so that neither their numbers nor how many there are matter.
    fn list_known(
        &self,
        attributes: &Attributes,
        budget: &mut Budget,
    ) -> Result<HashMap<u32, Vec<u32>>, WholeError> {
        let Finest { mesh, tour, residue, whole, .. } = self.finest;
        let mut at: HashMap<u32, Vec<u32>> = HashMap::new();
        if residue.triangles.is_empty() {
            return Ok(at);
        }
        budget.take_memory(residue.triangles.len(), BYTES_A_TRIANGLE)?;
        for &name in residue.triangles.as_flattened() {
            at.entry(whole.names[name as usize]).or_default();
        }
        let table = &mesh.table;
        budget.take_work(4 * table.slots() as u64)?;
        let seen_bytes = table.vertex_slots() / 8 + size_of::<usize>();
        budget.take_memory(seen_bytes, 1)?;
        let mut seen: BitVec = BitVec::repeat(false, table.vertex_slots());
        let mut names = whole.names.iter();
        for first in tour.walk.triangles.iter().flat_map(|c| [c.next(), c.prev(), *c]) {
            let v = table.vertex(first);
            if seen.replace(v.index(), true) {
                continue;
            }
            let Some(here) = names.next().and_then(|name| at.get_mut(name)) else { continue };
            let from = here.len();
            let mut before = None;
            for c in fan(table, if table.is_boundary(v) { table.corner_of(v) } else { first }) {
                let wedge = attributes.wedges.of(c);
                if !before.is_some_and(|before| attributes.are_alike(before, wedge, &attributes.alive)) {
                    here.push(wedge);
                }
                before = Some(wedge);
            }
            budget.take_memory(here.len() - from, 3 * size_of::<u32>())?;
        }
        budget.give_memory(seen_bytes, 1);
        Ok(at)
    }
}

impl Attributes {
    /// Codes the values of further triangles, of a column of triangles.
    pub(super) fn further_rows<C: BitCoder, K: Known>(
        &mut self,
        finest: Finest,
        k: usize,
        models: &mut CornerModels,
        coder: &mut C,
        known: &K,
        budget: &mut Budget,
    ) -> Result<(), WholeError> {
        debug_assert_eq!(self.columns[k].kind.domain, Domain::Triangle);
        let (around, mut ring) = (Around { mesh: finest.mesh, wedges: &Wedges::default() }, Ring::default());
        // The last of the walk: rows are numbered by how a reader has come here.
        let mut before = finest.tour.walk.triangles.last().map(|c| self.wedges.row(c.triangle()));
        for t in 0..finest.residue.triangles.len() {
            let row = self.rows + t as u32;
            take_room(budget, row, std::slice::from_ref(&self.columns[k]))?;
            let truth = if C::ENCODES { known.further(t)[3] } else { 0 };
            let (ring, column) = (&mut ring, &mut self.columns[k]);
            models.code(coder, &around, ring, column, row, before, known.value(k, truth))?;
            before = Some(row);
            coder.check()?;
        }
        Ok(())
    }
}

/// What a further triangle takes here: three entries of the map, which may just have grown, with lists of their own.
const BYTES_A_TRIANGLE: usize = 3 * 128;
