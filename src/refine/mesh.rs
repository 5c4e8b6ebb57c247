//! The mesh as refinement sees it: connectivity, lattice positions, root edges (spec §2).

use super::Roots;
use crate::mesh::{CornerTable, Vertex};

/// A level, or any state between two levels. Vertices are numbered by birth where a decoder builds it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ProgressiveMesh {
    /// Connectivity.
    pub table: CornerTable,
    /// Lattice coordinates of each vertex, at full scale: at precision s the middle of a cell of side 2^s (spec §2.4).
    pub positions: Vec<[i32; 3]>,
    /// Where walks start.
    pub roots: Roots,
}

impl ProgressiveMesh {
    /// Sets the position of a vertex, the next one or one that has its place.
    pub fn set_position(&mut self, v: Vertex, position: [i32; 3]) {
        if v.index() >= self.positions.len() {
            self.positions.resize(v.index() + 1, [0; 3]);
        }
        self.positions[v.index()] = position;
    }

    /// Makes room for a finer level of `next` vertices and triangles. If there is too little, all that is there has to be copied: so
    /// there is made room for the `last` level, if it is but 16 times as large, or else for twice as much as there is. Numbers that
    /// only a header claims take no memory.
    pub fn reserve(&mut self, next: [usize; 2], last: [usize; 2]) {
        let (v, t) = (self.positions.len(), self.table.slots());
        if next[0] > self.positions.capacity() || next[1] > self.table.capacity() {
            let more =
                |have: usize, last: usize| if last / 16 <= have { last.saturating_sub(have) } else { have };
            let (vertices, triangles) = (more(v, last[0]), more(t, last[1]));
            self.positions.reserve_exact(vertices);
            self.table.reserve(vertices, triangles);
            self.roots.reserve(vertices);
        }
    }

    /// Bytes a vertex and its two triangles take here: two records of the corner table, the corner, the component, the position.
    pub const BYTES_A_VERTEX: usize = 2 * 32 + 4 + 4 + 12;
}

/// The full-scale coordinate of the middle of cell `x` of side 2^`s`.
#[inline]
pub fn from_cell(x: i32, s: u32) -> i32 {
    (x << s) + ((1 << s) >> 1)
}
