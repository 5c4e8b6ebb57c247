//! The mesh as refinement sees it: connectivity, lattice positions, root edges (spec §2).

use super::Roots;
use crate::error::Result;
use crate::limits::make_room;
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

    /// Components are born: those of `part`, of which no triangle has been removed, join behind all others (spec §7.4). `name` gives its
    /// vertices numbers here that are not in use; their positions are set apart from this.
    pub fn join(&mut self, part: &CornerTable, roots: &Roots, name: impl Fn(Vertex) -> Vertex) {
        self.roots.append(&self.table, part, roots, &name);
        self.table.append(part, name);
    }

    /// For how many vertices and triangles there is room.
    pub fn room(&self) -> [usize; 2] {
        [self.positions.capacity(), self.table.capacity()]
    }

    /// For how many vertices and triangles to make room, where so many are `needed` and there is too little. All that is there has to be
    /// copied: so room is made for as many as are `hoped` for, if they are but 16 times as many, or else for twice as many as there are.
    /// Numbers that only a header claims take no memory. Where that is too much, there may be memory for the second answer.
    pub fn more_room(&self, needed: [usize; 2], hoped: [usize; 2]) -> Option<[[usize; 2]; 2]> {
        let (have, room) = ([self.positions.len(), self.table.slots()], self.room());
        if needed[0] <= room[0] && needed[1] <= room[1] {
            return None;
        }
        let most = |k: usize| if hoped[k] / 16 <= have[k] { hoped[k] } else { 2 * have[k] };
        let least = [needed[0].max(room[0]), needed[1].max(room[1])];
        Some([[least[0].max(most(0)), least[1].max(most(1))], least])
    }

    /// Makes room for so many vertices and triangles in all.
    ///
    /// # Errors
    /// [`Error::Memory`](crate::Error::Memory) where the system has not so much.
    pub fn make_room(&mut self, [vertices, triangles]: [usize; 2]) -> Result<()> {
        let more = vertices.saturating_sub(self.positions.len());
        make_room(&mut self.positions, more)?;
        self.table.make_room(vertices, triangles)?;
        self.roots.make_room(vertices)
    }

    /// Bytes that room for so many vertices and triangles takes: the position, the corner, the component; the record.
    pub fn bytes([vertices, triangles]: [usize; 2]) -> usize {
        vertices * (12 + 4 + 4) + triangles * 32
    }
}

/// The full-scale coordinate of the middle of cell `x` of side 2^`s`.
#[inline]
pub fn from_cell(x: i32, s: u32) -> i32 {
    (x << s) + ((1 << s) >> 1)
}
