//! Lifting: the ends of a split edge give back what they had taken over of the new vertex (spec §5.4.5).
//!
//! As in a lifted wavelet (Sweldens 1998): the removal of a vertex moves the ends of its edge a little towards where it was, along the
//! surface's normal, so that the coarser level lies among the input's vertices rather than within them. What the move is made of does not
//! change under it, so that it can be undone without a bit.

use super::vector::{Vector, floor};

/// The cells that the vertices of a level may be in, and how far its splits move the ends of their edges.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cells {
    /// The lattice's bits.
    pub bits: u32,
    /// The level's shift s.
    pub precision: u32,
    /// The part of a vertex's height over its edge by which the ends move, in 64ths; 0 where they stay.
    pub lifting: u8,
}

impl Cells {
    /// How many cells beyond the lattice, on every side, may be used: lifted vertices can leave the input's bounding box.
    #[inline]
    pub fn margin(self) -> i32 {
        if self.lifting == 0 { 0 } else { 1i32 << (self.bits.max(2) - 2) >> self.precision }
    }

    /// The largest coordinate of a cell of the lattice itself.
    #[inline]
    fn last(self) -> i32 {
        ((1u32 << (self.bits - self.precision.min(self.bits))) - 1) as i32
    }

    /// The least and the largest coordinate of a cell.
    #[inline]
    pub fn range(self) -> [i32; 2] {
        [-self.margin(), self.last() + self.margin()]
    }

    /// Whether a vertex may be there.
    #[inline]
    pub fn hold(self, cell: [i32; 3]) -> bool {
        let [least, most] = self.range();
        cell.iter().all(|x| (least..=most).contains(x))
    }

    /// Whether a vertex may be at a full-scale position.
    #[inline]
    pub fn hold_position(self, position: [i32; 3]) -> bool {
        self.hold(position.map(|x| x >> self.precision))
    }

    /// The move of the split of an interior edge a–b with c on its left and d on its right, at full scale: all as they stand, before
    /// the split or after it. The ends and the new vertex `v` lie further by it in the coarser level.
    #[inline]
    pub fn lift(self, [a, b, c, d]: [[i32; 3]; 4], v: [i32; 3]) -> [i32; 3] {
        let cell = |p: [i32; 3]| Vector::of_cell(p.map(|x| x >> self.precision));
        let [a, b, c, d, v] = [cell(a), cell(b), cell(c), cell(d), cell(v)];
        let edge = b - a;
        let normal = edge.cross(c - d);
        let area = normal.dot(normal);
        if area == 0.0 {
            return [0; 3];
        }
        let height = ((v - a) - edge * 0.5).dot(normal);
        let by = normal * ((height / area) * (f32::from(self.lifting) * (1.0 / 64.0)));
        by.coordinates().map(|x| floor(x + 0.5) << self.precision)
    }
}

/// The position that a move leads to.
#[inline]
pub fn plus(position: [i32; 3], by: [i32; 3]) -> [i32; 3] {
    [0, 1, 2].map(|k| position[k] + by[k])
}

/// The position that a move has led from.
#[inline]
pub fn minus(position: [i32; 3], by: [i32; 3]) -> [i32; 3] {
    [0, 1, 2].map(|k| position[k] - by[k])
}
