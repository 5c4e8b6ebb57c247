//! The undo log: down again without a byte, and up again.

use crate::codec::refinement::Inserted;
use crate::mesh::Vertex;
use crate::refine::{Operation, ProgressiveMesh, from_cell};

/// A level that was complete.
#[derive(Clone, Debug)]
struct Mark {
    level: u32,
    precision: u32,
    /// Operations carried out by then.
    operations: usize,
    roots: Vec<(Vertex, Vertex)>,
}

/// All operations since the base or keyframe, coarse to fine, and the levels between them.
#[derive(Clone, Debug, Default)]
pub struct Log {
    operations: Vec<Operation>,
    flips: Vec<Vertex>,
    marks: Vec<Mark>,
    /// Root edges of all marks together.
    roots: usize,
    /// How many levels below the last mark the mesh stands now.
    below: usize,
    /// Whether the last mark stands between two levels.
    between: bool,
    /// All positions at the finest precision, once the mesh stands below the last mark.
    positions: Vec<[i32; 3]>,
}

impl Log {
    /// Records an operation.
    pub fn push(&mut self, inserted: &Inserted) {
        let (first_flip, flip_count) = (self.flips.len() as u32, inserted.flips.len() as u32);
        self.flips.extend(inserted.flips.iter().map(|&[p, _]| p));
        self.operations.push(Operation {
            vertex: inserted.vertex,
            site: inserted.site,
            first_flip,
            flip_count,
        });
    }

    /// Bytes that it takes when each of its lists is next copied to one twice as long.
    pub fn bytes(&self) -> usize {
        let marks = self.marks.capacity() * size_of::<Mark>();
        let lists = self.operations.capacity() * size_of::<Operation>() + self.flips.capacity() * 4 + marks;
        3 * lists + self.roots * size_of::<(Vertex, Vertex)>()
    }

    /// Bytes that a further mark takes.
    pub fn bytes_of_mark(mesh: &ProgressiveMesh) -> usize {
        size_of_val(mesh.roots.edges())
    }

    /// Records that a level is complete.
    pub fn end_level(&mut self, mesh: &ProgressiveMesh, level: u32, precision: u32) {
        let roots = mesh.roots.edges().to_vec();
        self.roots += roots.len();
        self.marks.push(Mark { level, precision, operations: self.operations.len(), roots });
    }

    /// The level the mesh stands at, where that is below the last one decoded.
    pub fn lowered(&self) -> Option<u32> {
        if self.below == 0 { None } else { Some(self.mark(self.below)?.level) }
    }

    /// One level down; from between two levels to the coarser of them.
    pub fn coarsen(&mut self, mesh: &mut ProgressiveMesh) -> Option<u32> {
        let last = self.marks.last()?;
        let moved = || mesh.positions.iter().any(|&p| p != coarse(p, last.precision));
        if self.below == 0 && (last.operations < self.operations.len() || moved()) {
            // Where decoding stands becomes a mark of its own until it is reached again.
            let (level, operations) = (last.level, self.operations.len());
            self.marks.push(Mark { level, precision: 0, operations, roots: mesh.roots.edges().to_vec() });
            self.between = true;
        }
        let (fine, coarse) = (self.mark(self.below)?.clone(), self.mark(self.below + 1)?.clone());
        if self.below == 0 {
            self.positions.clone_from(&mesh.positions);
        }
        for operation in self.operations[coarse.operations..fine.operations].iter().rev() {
            operation
                .undo(&mut mesh.table, self.flips_of(operation))
                .expect("what was carried out can be undone in reverse");
        }
        self.below += 1;
        self.settle(mesh, &coarse);
        Some(coarse.level)
    }

    /// One level up, among those left by [`Log::coarsen`].
    pub fn restore(&mut self, mesh: &mut ProgressiveMesh) -> Option<u32> {
        let above = self.below.checked_sub(1)?;
        let (coarse, fine) = (self.mark(self.below)?.clone(), self.mark(above)?.clone());
        for operation in &self.operations[coarse.operations..fine.operations] {
            operation
                .apply(&mut mesh.table, self.flips_of(operation))
                .expect("what was undone can be carried out again");
        }
        self.below = above;
        self.settle(mesh, &fine);
        if above == 0 && std::mem::take(&mut self.between) {
            self.marks.pop();
        }
        Some(fine.level)
    }

    fn mark(&self, below: usize) -> Option<&Mark> {
        self.marks.get(self.marks.len().checked_sub(below + 1)?)
    }

    fn flips_of(&self, operation: &Operation) -> &[Vertex] {
        let first = operation.first_flip as usize;
        &self.flips[first..first + operation.flip_count as usize]
    }

    /// Positions, roots and vertices of a level.
    fn settle(&self, mesh: &mut ProgressiveMesh, mark: &Mark) {
        let first = self.marks.first().map_or(0, |first| first.operations);
        let base = self.positions.len() - (self.operations.len() - first);
        let vertices = base + mark.operations - first;
        mesh.positions = self.positions[..vertices].iter().map(|&p| coarse(p, mark.precision)).collect();
        mesh.table.truncate_vertices(vertices);
        mesh.roots.restore(&mesh.table, mark.roots.clone());
    }
}

/// A position as it is at a precision.
fn coarse(position: [i32; 3], precision: u32) -> [i32; 3] {
    position.map(|x| from_cell(x >> precision, precision))
}
