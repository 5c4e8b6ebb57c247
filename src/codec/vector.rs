//! Cells as points and vectors in binary32, four lanes to a register; the fourth is no part of any result (spec §9.2).
//!
//! Lattice coordinates have at most 24 bits, so they are exact. Every operation is rounded once, in the order written here.

use std::ops::{Add, Mul, Sub};

/// A point or vector.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(align(16))]
pub struct Vector(pub [f32; 4]);

impl Vector {
    /// The point of a cell.
    #[inline(always)]
    pub fn of_cell(cell: [i32; 3]) -> Self {
        Self([cell[0] as f32, cell[1] as f32, cell[2] as f32, 0.0])
    }

    /// (x0 y0 + x1 y1) + x2 y2.
    #[inline(always)]
    pub fn dot(self, other: Self) -> f32 {
        let m = self * other;
        (m.0[0] + m.0[1]) + m.0[2]
    }

    /// The cross product.
    #[inline(always)]
    pub fn cross(self, other: Self) -> Self {
        // Rotated, so that it takes three shuffles: (x * y.yzx - x.yzx * y).yzx.
        let turned = |v: Self| Self([v.0[1], v.0[2], v.0[0], v.0[3]]);
        turned(self * turned(other) - turned(self) * other)
    }
}

impl Add for Vector {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        let (a, b) = (self.0, other.0);
        Self([a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3]])
    }
}

impl Sub for Vector {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        let (a, b) = (self.0, other.0);
        Self([a[0] - b[0], a[1] - b[1], a[2] - b[2], a[3] - b[3]])
    }
}

impl Mul for Vector {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        let (a, b) = (self.0, other.0);
        Self([a[0] * b[0], a[1] * b[1], a[2] * b[2], a[3] * b[3]])
    }
}

impl Mul<f32> for Vector {
    type Output = Self;

    #[inline(always)]
    fn mul(self, s: f32) -> Self {
        let a = self.0;
        Self([a[0] * s, a[1] * s, a[2] * s, a[3] * s])
    }
}

/// The power of two at or below |x|; -127 where that is tiny.
#[inline(always)]
pub fn exponent(x: f32) -> i32 {
    (x.to_bits() >> 23 & 0xFF) as i32 - 127
}
