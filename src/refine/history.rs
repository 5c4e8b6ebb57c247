//! The history of a simplification: levels of operations, coarse to fine (spec §5.2).

use super::birth::Birth;
use super::operation::{Operation, OperationError, Site};
use crate::mesh::{CornerTable, Vertex};
use std::ops::Range;

/// The operations that lead from one level to the next finer one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Level {
    /// Their places in [`History::operations`].
    pub operations: Range<usize>,
}

/// Operations as an undo log: in the order of removal, fine to coarse. About 24 bytes a vertex, and 4 a flip.
///
/// Undoing all of them, first to last, leads from level 0 to the base; applying them, last to first, leads back.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct History {
    operations: Vec<Operation>,
    flips: Vec<Vertex>,
    /// Where each level's operations end; level 0's come first.
    ends: Vec<usize>,
    /// What is born at the end of each of them.
    births: Vec<Option<Birth>>,
    /// What is born at the end of the level under way.
    next: Option<Birth>,
}

impl History {
    /// Appends an operation to the level under way; `flips` as in [`Operation::apply`].
    pub fn push(&mut self, vertex: Vertex, site: Site, flips: impl IntoIterator<Item = Vertex>) {
        let first_flip = self.flips.len() as u32;
        make_room(&mut self.flips);
        self.flips.extend(flips);
        let flip_count = self.flips.len() as u32 - first_flip;
        make_room(&mut self.operations);
        self.operations.push(Operation { vertex, site, first_flip, flip_count });
    }

    /// Gives back the room for operations that there are not.
    #[cfg(feature = "encode")]
    pub(crate) fn shrink_to_fit(&mut self) {
        self.operations.shrink_to_fit();
        self.flips.shrink_to_fit();
    }

    /// Says which components the level under way has and the next coarser one has not: no operation of the level is on them.
    pub fn bear(&mut self, birth: Birth) {
        self.next = Some(birth);
    }

    /// Ends the level under way; a level without operations and births is not recorded. Returns whether one was.
    pub fn end_level(&mut self) -> bool {
        let grown = self.next.is_some() || self.operations.len() > self.ends.last().copied().unwrap_or(0);
        if grown {
            self.ends.push(self.operations.len());
            self.births.push(self.next.take());
        }
        grown
    }

    /// What is born at the end of level `j`, behind its operations.
    pub fn birth(&self, j: usize) -> Option<&Birth> {
        self.births.get(j)?.as_ref()
    }

    /// Number of refinement levels; level numbers run from 0, whose operations lead to the finest mesh, up to this, the base.
    pub fn level_count(&self) -> usize {
        self.ends.len()
    }

    /// The operations that lead from level `j + 1` to level `j`; none where there is no such level.
    pub fn level(&self, j: usize) -> &[Operation] {
        let Some(&end) = self.ends.get(j) else { return &[] };
        let start = j.checked_sub(1).map_or(0, |finer| self.ends[finer]);
        &self.operations[start..end]
    }

    /// Triangles that all levels together have at most, with so many in the base.
    #[cfg(feature = "encode")]
    pub(crate) fn most_triangles(&self, base: usize) -> usize {
        let born = self.births.iter().flatten().map(|birth| birth.table.triangle_count());
        base + 2 * self.operations.len() + born.sum::<usize>()
    }

    /// All operations, in the order of removal.
    pub fn operations(&self) -> &[Operation] {
        &self.operations
    }

    /// The flips of an operation of this history; empty for one that is not of it.
    pub fn flips(&self, operation: &Operation) -> &[Vertex] {
        let first = operation.first_flip as usize;
        self.flips.get(first..first + operation.flip_count as usize).unwrap_or(&[])
    }

    /// Undoes level `j`: from level `j` to the coarser level `j + 1`.
    ///
    /// # Errors
    /// The first operation that does not fit.
    pub fn undo_level(&self, table: &mut CornerTable, j: usize) -> Result<(), OperationError> {
        if let Some(birth) = self.birth(j) {
            birth.undo(table)?;
        }
        self.level(j).iter().try_for_each(|op| op.undo(table, self.flips(op)))
    }

    /// Applies level `j`: from level `j + 1` to the finer level `j`.
    ///
    /// # Errors
    /// The first operation that does not fit.
    pub fn apply_level(&self, table: &mut CornerTable, j: usize) -> Result<(), OperationError> {
        self.level(j).iter().rev().try_for_each(|op| op.apply(table, self.flips(op)))?;
        if let Some(birth) = self.birth(j) {
            birth.apply(table);
        }
        Ok(())
    }

    /// Bytes held.
    pub fn memory(&self) -> usize {
        self.operations.capacity() * size_of::<Operation>() + self.flips.capacity() * size_of::<Vertex>()
    }
}

/// Makes room for what an operation appends, an eighth more at a time: of a list that doubles, half may stay empty.
fn make_room<T>(list: &mut Vec<T>) {
    if list.capacity() - list.len() < ROOM {
        list.reserve_exact(list.len() / 8 + ROOM);
    }
}

/// Flips that there is room for before an operation's are appended: hardly one has more.
const ROOM: usize = 64;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn no_history_panics_whatever_it_contains(
            records in prop::collection::vec((0..50u32, 0..3u8, [0..50u32, 0..50, 0..50], any::<bool>()), 0..30),
            flips in prop::collection::vec(0..50u32, 0..5),
        ) {
            let mesh = shapes::annulus(8);
            let mut table = CornerTable::from_triangles(mesh.positions.len(), &mesh.triangles).unwrap();
            let mut history = History::default();
            for (v, kind, [a, b, c], ends) in records {
                let [a, b, c] = [a, b, c].map(Vertex);
                let site = [Site::Edge(a, b), Site::Face(a, b, c), Site::Attach(a, b)][usize::from(kind)];
                history.push(Vertex(v), site, flips.iter().copied().map(Vertex));
                if ends {
                    history.end_level();
                }
            }
            // One level more than there is, in both directions.
            for j in 0..=history.level_count() {
                let _ = history.undo_level(&mut table, j);
                let _ = history.apply_level(&mut table, j);
                prop_assert_eq!(table.check(), Ok(()));
            }
        }
    }
}
