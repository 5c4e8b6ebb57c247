//! The undo log: down again without a byte, and up again.

use crate::codec::lift::{Cells, minus, plus};
use crate::codec::refinement::Inserted;
use crate::mesh::{CornerTable, Triangle, Vertex};
use crate::refine::{Operation, ProgressiveMesh, Site, Wedges, from_cell};

/// A level that was complete.
#[derive(Clone, Debug)]
struct Mark {
    level: u32,
    /// Those of its vertices, and how the level was lifted.
    cells: Cells,
    /// Operations carried out by then.
    operations: usize,
    roots: Vec<(Vertex, Vertex)>,
    /// What was born behind them, by numbers of its own, and how many vertices there were before.
    births: Option<(CornerTable, u32)>,
    /// How many triangles had been rewritten by then whose wedges were known.
    rewritten: usize,
    /// What triangles named before attributes were born here; while the mesh stands below, what they name since.
    parted: Option<Vec<[u32; 4]>>,
}

/// All operations since the base or keyframe, coarse to fine, and the levels between them.
#[derive(Clone, Debug, Default)]
pub struct Log {
    operations: Vec<Operation>,
    flips: Vec<Vertex>,
    marks: Vec<Mark>,
    /// Root edges of all marks together.
    roots: usize,
    /// Vertices and triangles born at all marks together.
    born: [usize; 2],
    /// How many levels below the last mark the mesh stands now.
    below: usize,
    /// Whether the last mark stands between two levels.
    between: bool,
    /// What triangles named that operations have rewritten; while the mesh stands below those, what they name since.
    rewritten: Vec<(Triangle, [u32; 4])>,
    /// What the triangles named that are gone, by levels gone down.
    tails: Vec<Vec<[u32; 4]>>,
    /// Bytes of what marks hold of attributes.
    parted: usize,
    /// Where vertices were when they went, and the low bits that those which stay have lost, while the mesh stands below the last mark.
    gone: Vec<[i32; 3]>,
    lost: Vec<[i32; 3]>,
}

impl Log {
    /// Records an operation; `wedges` are those before it.
    pub fn push(&mut self, inserted: &Inserted, wedges: &Wedges) {
        if !wedges.is_empty() {
            let rewritten = inserted.star[inserted.created..].iter().map(|c| c.triangle());
            self.rewritten.extend(rewritten.map(|t| (t, wedges.triangle(t))));
        }
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
        // The tails, too, once the mesh goes down.
        let wedges = 6 * self.rewritten.capacity() * size_of::<(Triangle, [u32; 4])>() + self.parted;
        3 * lists + wedges + self.roots * size_of::<(Vertex, Vertex)>() + ProgressiveMesh::bytes(self.born)
    }

    /// Bytes that a further mark takes.
    pub fn bytes_of_mark(mesh: &ProgressiveMesh, births: Option<&CornerTable>) -> usize {
        let born = births.map_or([0; 2], |table| [table.vertex_slots(), table.slots()]);
        size_of_val(mesh.roots.edges()) + ProgressiveMesh::bytes(born)
    }

    /// Records that a level is complete, and which of its components have been born last.
    pub fn end_level(
        &mut self,
        mesh: &ProgressiveMesh,
        level: u32,
        cells: Cells,
        births: Option<CornerTable>,
    ) {
        let roots = mesh.roots.edges().to_vec();
        self.roots += roots.len();
        let births = births.map(|table| {
            let count = table.vertex_slots();
            self.born = [self.born[0] + count, self.born[1] + table.slots()];
            (table, (mesh.positions.len() - count) as u32)
        });
        let (operations, rewritten) = (self.operations.len(), self.rewritten.len());
        self.marks.push(Mark { level, cells, operations, roots, births, rewritten, parted: None });
    }

    /// Attributes are about to be born at the level that is complete.
    pub fn part(&mut self, wedges: &Wedges) {
        self.parted += size_of_val(wedges.all());
        if let Some(mark) = self.marks.last_mut() {
            mark.parted = Some(wedges.all().to_vec());
        }
    }

    /// The level the mesh stands at, where that is below the last one decoded.
    pub fn lowered(&self) -> Option<u32> {
        if self.below == 0 { None } else { Some(self.mark(self.below)?.level) }
    }

    /// One level down; from between two levels to the coarser of them, the cells of the finer being `under_way`.
    pub fn coarsen(
        &mut self,
        mesh: &mut ProgressiveMesh,
        wedges: &mut Wedges,
        under_way: Cells,
    ) -> Option<u32> {
        let last = self.marks.last()?;
        let begun = last.operations < self.operations.len();
        let moved = || mesh.positions.iter().any(|&p| p != coarse(p, last.cells.precision));
        if self.below == 0 && (begun || moved()) {
            // Where decoding stands becomes a mark of its own until it is reached again. In the midst of a precision pass nothing is lifted.
            let cells = if begun { under_way } else { Cells { precision: 0, ..under_way } };
            let (level, operations) = (last.level, self.operations.len());
            let roots = mesh.roots.edges().to_vec();
            let rewritten = self.rewritten.len();
            let (births, parted) = (None, None);
            self.marks.push(Mark { level, cells, operations, roots, births, rewritten, parted });
            self.between = true;
        }
        let (fine, coarser) = (self.mark(self.below)?.clone(), self.mark(self.below + 1)?.clone());
        if self.below == 0 {
            self.gone = vec![[0; 3]; mesh.positions.len()];
            self.lost = vec![[0; 3]; mesh.positions.len()];
        }
        if let Some((_, first)) = &fine.births {
            let first = *first as usize;
            self.gone[first..mesh.positions.len()].copy_from_slice(&mesh.positions[first..]);
            mesh.positions.truncate(first);
            let of_birth = |t: &Triangle| mesh.table.triangle(*t)[0].index() >= first;
            let born: Vec<_> = mesh.table.triangles().filter(of_birth).collect();
            mesh.table.remove_components(born.into_iter());
        }
        for operation in self.operations[coarser.operations..fine.operations].iter().rev() {
            operation
                .undo(&mut mesh.table, self.flips_of(operation))
                .expect("what was carried out can be undone in reverse");
            lift(mesh, operation, fine.cells, plus);
            self.gone[operation.vertex.index()] = mesh.positions[operation.vertex.index()];
        }
        let vertices = mesh.positions.len() - (fine.operations - coarser.operations);
        mesh.positions.truncate(vertices);
        if fine.cells.precision < coarser.cells.precision {
            for (p, lost) in mesh.positions.iter_mut().zip(&mut self.lost) {
                // Bits that had been lost before stand below those that are lost now.
                *lost =
                    [0, 1, 2].map(|k| low(lost[k], fine.cells.precision) | high(p[k], fine.cells.precision));
                *p = coarse(*p, coarser.cells.precision);
            }
        }
        self.below += 1;
        settle(mesh, &coarser);
        self.swap_parted(self.below - 1, wedges);
        let rewritten = &mut self.rewritten[coarser.rewritten..fine.rewritten];
        rewritten.iter_mut().rev().for_each(|(t, there)| wedges.swap(*t, there));
        self.tails.push(wedges.cut(mesh.table.slots()));
        Some(coarser.level)
    }

    /// One level up, among those left by [`Log::coarsen`].
    pub fn restore(&mut self, mesh: &mut ProgressiveMesh, wedges: &mut Wedges) -> Option<u32> {
        let above = self.below.checked_sub(1)?;
        let (coarser, fine) = (self.mark(self.below)?.clone(), self.mark(above)?.clone());
        if fine.cells.precision < coarser.cells.precision {
            for (p, lost) in mesh.positions.iter_mut().zip(&self.lost) {
                let s = coarser.cells.precision;
                *p = coarse([0, 1, 2].map(|k| high(p[k], s) | low(lost[k], s)), fine.cells.precision);
            }
        }
        for operation in &self.operations[coarser.operations..fine.operations] {
            mesh.positions.push(self.gone[operation.vertex.index()]);
            lift(mesh, operation, fine.cells, minus);
            operation
                .apply(&mut mesh.table, self.flips_of(operation))
                .expect("what was undone can be carried out again");
        }
        if let Some((table, first)) = &fine.births {
            let first = *first as usize;
            mesh.positions.extend_from_slice(&self.gone[first..first + table.vertex_slots()]);
            mesh.table.append(table, |v| Vertex((first + v.index()) as u32));
        }
        self.below = above;
        settle(mesh, &fine);
        if let Some(tail) = self.tails.pop() {
            wedges.put_back(&tail);
            let rewritten = &mut self.rewritten[coarser.rewritten..fine.rewritten];
            rewritten.iter_mut().for_each(|(t, there)| wedges.swap(*t, there));
            self.swap_parted(above, wedges);
        }
        if above == 0 && std::mem::take(&mut self.between) {
            self.marks.pop();
        }
        Some(fine.level)
    }

    /// Has triangles name what they named before attributes were born at a level, or since.
    fn swap_parted(&mut self, below: usize, wedges: &mut Wedges) {
        let place = self.marks.len().checked_sub(below + 1);
        if let Some(parted) = place.and_then(|place| self.marks[place].parted.as_mut()) {
            wedges.swap_all(parted);
        }
    }

    fn mark(&self, below: usize) -> Option<&Mark> {
        self.marks.get(self.marks.len().checked_sub(below + 1)?)
    }

    fn flips_of(&self, operation: &Operation) -> &[Vertex] {
        let first = operation.first_flip as usize;
        &self.flips[first..first + operation.flip_count as usize]
    }
}

/// Roots and vertices of a level.
fn settle(mesh: &mut ProgressiveMesh, mark: &Mark) {
    mesh.table.truncate_vertices(mesh.positions.len());
    mesh.roots.restore(&mesh.table, mark.roots.clone());
}

/// Moves the ends of the edge that an operation splits, and its vertex, while the edge is whole (spec §5.4.5).
fn lift(
    mesh: &mut ProgressiveMesh,
    operation: &Operation,
    cells: Cells,
    moved: impl Fn([i32; 3], [i32; 3]) -> [i32; 3],
) {
    let Site::Edge(a, b) = operation.site else { return };
    if cells.lifting == 0 {
        return;
    }
    let Some([c, d]) = wings(&mesh.table, a, b) else { return };
    let at = |v: Vertex| mesh.positions[v.index()];
    let by = cells.lift([a, b, c, d].map(at), at(operation.vertex));
    for w in [a, b, operation.vertex] {
        mesh.positions[w.index()] = moved(mesh.positions[w.index()], by);
    }
}

/// The vertices on the left and on the right of an edge, where neither of its ends is at the boundary.
fn wings(table: &CornerTable, a: Vertex, b: Vertex) -> Option<[Vertex; 2]> {
    if table.is_boundary(a) || table.is_boundary(b) {
        return None;
    }
    let k = table.find_directed_edge(a, b);
    Some([table.vertex(k), table.vertex(table.opposite(k))])
}

/// The bits below 2^`precision`, and those above.
fn low(x: i32, precision: u32) -> i32 {
    x & ((1 << precision) - 1)
}

fn high(x: i32, precision: u32) -> i32 {
    x >> precision << precision
}

/// A position as it is at a precision.
fn coarse(position: [i32; 3], precision: u32) -> [i32; 3] {
    position.map(|x| from_cell(x >> precision, precision))
}
