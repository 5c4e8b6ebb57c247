//! Which wedge each corner names (spec §13.3).

use crate::mesh::{Corner, CornerTable};

/// The wedges of a mesh: a wedge is a vertex with one value of every attribute, what a graphics processor calls a vertex.
///
/// Empty where there is no attribute at corners.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Wedges {
    /// By slot of the table, and place in the triangle; the fourth is not used.
    corners: Vec<[u32; 4]>,
    count: u32,
}

impl Wedges {
    /// Stands for "not known yet"; never a wedge.
    pub const NONE: u32 = u32::MAX;

    /// No wedge is known yet of any corner of a table.
    pub fn open(table: &CornerTable) -> Self {
        Self { corners: vec![[Self::NONE; 4]; table.slots()], count: 0 }
    }

    /// How many wedges there are.
    pub fn count(&self) -> u32 {
        self.count
    }

    /// The wedge of a corner, or [`Wedges::NONE`].
    #[inline]
    pub fn of(&self, c: Corner) -> u32 {
        self.corners.get(c.triangle().index()).map_or(Self::NONE, |corners| corners[c.place()])
    }

    /// A new wedge, of these corners.
    pub fn append(&mut self, corners: &[Corner]) -> u32 {
        let wedge = self.count;
        for c in corners {
            self.corners[c.triangle().index()][c.place()] = wedge;
        }
        self.count += 1;
        wedge
    }

    /// Bytes that the corners of a table take.
    pub fn bytes(table: &CornerTable) -> usize {
        table.slots() * size_of::<[u32; 4]>()
    }
}
