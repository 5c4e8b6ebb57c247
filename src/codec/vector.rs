//! Cells as points and vectors in binary32, four lanes to a register; the fourth is no part of any result (spec §9.2).
//!
//! Lattice coordinates have at most 24 bits, so they are exact. Every operation is rounded once, in the order written here: with the
//! registers of x86-64 or WebAssembly and without them the results are the same bit for bit.

use super::lanes;
pub use super::lanes::{truncate, truncate_long};
use std::ops::{Add, Div, Mul, Sub};

/// A point or vector.
#[derive(Clone, Copy, Debug)]
pub struct Vector(lanes::Lanes);

impl Vector {
    /// Of three coordinates.
    #[inline(always)]
    pub fn new(x: f32, y: f32, z: f32) -> Self {
        Self(lanes::of_floats([x, y, z, 0.0]))
    }

    /// The point of a cell.
    #[inline(always)]
    pub fn of_cell(cell: [i32; 3]) -> Self {
        Self(lanes::of_integers([cell[0], cell[1], cell[2], 0]))
    }

    /// The coordinates.
    #[inline(always)]
    pub fn coordinates(self) -> [f32; 3] {
        let [x, y, z, _] = lanes::floats(self.0);
        [x, y, z]
    }

    /// (x0 y0 + x1 y1) + x2 y2.
    #[inline(always)]
    pub fn dot(self, other: Self) -> f32 {
        let [x, y, z] = (self * other).coordinates();
        (x + y) + z
    }

    /// The cross product.
    #[inline(always)]
    pub fn cross(self, other: Self) -> Self {
        // Rotated, so that it takes three shuffles: (x * y.yzx - x.yzx * y).yzx.
        let turned = |v: Self| Self(lanes::turned(v.0));
        turned(self * turned(other) - turned(self) * other)
    }
}

impl Default for Vector {
    fn default() -> Self {
        Self::new(0.0, 0.0, 0.0)
    }
}

impl Add for Vector {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self(lanes::add(self.0, other.0))
    }
}

impl Sub for Vector {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self(lanes::sub(self.0, other.0))
    }
}

impl Mul for Vector {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self(lanes::mul(self.0, other.0))
    }
}

impl Mul<f32> for Vector {
    type Output = Self;

    #[inline(always)]
    fn mul(self, s: f32) -> Self {
        Self(lanes::mul(self.0, lanes::of_floats([s; 4])))
    }
}

/// Four numbers, each on its own.
#[derive(Clone, Copy, Debug)]
pub struct Four(lanes::Lanes);

impl Four {
    /// The same four times.
    #[inline(always)]
    pub fn of(x: f32) -> Self {
        Self(lanes::of_floats([x; 4]))
    }

    /// The numbers next to four integers.
    #[inline(always)]
    pub fn of_integers(x: [i32; 4]) -> Self {
        Self(lanes::of_integers(x))
    }

    /// The numbers.
    #[inline(always)]
    pub fn floats(self) -> [f32; 4] {
        lanes::floats(self.0)
    }

    /// The integers next to them towards zero, where those are 31-bit numbers; else any.
    #[inline(always)]
    pub fn truncated(self) -> [i32; 4] {
        lanes::truncated(self.0)
    }

    /// The square roots.
    #[inline(always)]
    pub fn sqrt(self) -> Self {
        Self(lanes::sqrt(self.0))
    }

    /// The magnitudes.
    #[inline(always)]
    pub fn abs(self) -> Self {
        Self(lanes::abs(self.0))
    }

    /// The larger ones.
    #[inline(always)]
    pub fn max(self, other: Self) -> Self {
        Self(lanes::max(self.0, other.0))
    }

    /// The smaller ones.
    #[inline(always)]
    pub fn min(self, other: Self) -> Self {
        Self(lanes::min(self.0, other.0))
    }

    /// Those of `this` where these are below `bound`, those of `that` elsewhere.
    #[inline(always)]
    pub fn below(self, bound: Self, this: Self, that: Self) -> Self {
        Self(lanes::where_less(self.0, bound.0, this.0, that.0))
    }
}

impl Add for Four {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self(lanes::add(self.0, other.0))
    }
}

impl Sub for Four {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self(lanes::sub(self.0, other.0))
    }
}

impl Mul for Four {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self(lanes::mul(self.0, other.0))
    }
}

impl Div for Four {
    type Output = Self;

    #[inline(always)]
    fn div(self, other: Self) -> Self {
        Self(lanes::div(self.0, other.0))
    }
}

/// Four points or vectors, coordinate by coordinate.
#[derive(Clone, Copy, Debug)]
pub struct Vectors {
    x: Four,
    y: Four,
    z: Four,
}

impl Vectors {
    /// Of four vectors.
    #[inline(always)]
    pub fn new(vectors: [Vector; 4]) -> Self {
        let [x, y, z] = lanes::transposed(vectors.map(|v| v.0)).map(Four);
        Self { x, y, z }
    }

    /// Four times the same.
    #[inline(always)]
    pub fn of(v: Vector) -> Self {
        let [x, y, z] = v.coordinates().map(Four::of);
        Self { x, y, z }
    }

    /// The coordinates: those of all four along each axis.
    #[inline(always)]
    pub fn coordinates(self) -> [[f32; 4]; 3] {
        [self.x, self.y, self.z].map(Four::floats)
    }

    /// The dot products, as [`Vector::dot`].
    #[inline(always)]
    pub fn dot(self, other: Self) -> Four {
        (self.x * other.x + self.y * other.y) + self.z * other.z
    }

    /// The cross products.
    #[inline(always)]
    pub fn cross(self, other: Self) -> Self {
        Self {
            x: self.y * other.z - self.z * other.y,
            y: self.z * other.x - self.x * other.z,
            z: self.x * other.y - self.y * other.x,
        }
    }
}

impl Mul<Four> for Vectors {
    type Output = Self;

    #[inline(always)]
    fn mul(self, s: Four) -> Self {
        Self { x: self.x * s, y: self.y * s, z: self.z * s }
    }
}

impl Sub for Vectors {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self { x: self.x - other.x, y: self.y - other.y, z: self.z - other.z }
    }
}

/// The power of two at or below |x|; -127 where that is tiny.
#[inline(always)]
pub fn exponent(x: f32) -> i32 {
    (x.to_bits() >> 23 & 0xFF) as i32 - 127
}

/// The largest integer at or below x, which is a 31-bit number.
#[inline(always)]
pub fn floor(x: f32) -> i32 {
    let towards_zero = truncate(x);
    towards_zero - i32::from(towards_zero as f32 > x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn the_cross_product_is_right_handed() {
        let cross = Vector::new(1.0, 0.0, 0.0).cross(Vector::new(0.0, 1.0, 0.0));
        assert_eq!(cross.coordinates(), [0.0, 0.0, 1.0]);
        let cross = Vector::of_cell([1, 2, 3]).cross(Vector::of_cell([4, 5, 6]));
        assert_eq!(cross.coordinates(), [-3.0, 6.0, -3.0]);
    }

    #[test]
    fn floors() {
        for (x, floor_of_x) in
            [(0.0, 0), (-0.0, 0), (0.99, 0), (-0.01, -1), (7.0, 7), (-7.0, -7), (-1e6 - 0.5, -1_000_001)]
        {
            assert_eq!(floor(x), floor_of_x, "{x}");
        }
    }

    proptest! {
        /// Four at once are what they are one by one.
        #[test]
        fn four_and_one_agree(cells in prop::array::uniform8(prop::array::uniform3(-(1i32 << 24)..1 << 24))) {
            let v = cells.map(Vector::of_cell);
            let (a, b) = ([v[0], v[1], v[2], v[3]], [v[4], v[5], v[6], v[7]]);
            let (many_a, many_b) = (Vectors::new(a), Vectors::new(b));
            let dots = many_a.dot(many_b).floats();
            let [x, y, z] = { let n = (many_a - many_b).cross(many_b); [n.x, n.y, n.z].map(Four::floats) };
            for i in 0..4 {
                prop_assert_eq!(dots[i].to_bits(), a[i].dot(b[i]).to_bits());
                prop_assert_eq!([x[i], y[i], z[i]], (a[i] - b[i]).cross(b[i]).coordinates());
            }
        }
    }
}
