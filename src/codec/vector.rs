//! Cells as points and vectors in binary32, four lanes to a register; the fourth is no part of any result (spec §9.2).
//!
//! Lattice coordinates have at most 24 bits, so they are exact. Every operation is rounded once, in the order written here: with the
//! registers of x86-64 or WebAssembly and without them the results are the same bit for bit.

#[cfg(not(any(target_arch = "x86_64", target_feature = "simd128")))]
use portable as lanes;
#[cfg(target_feature = "simd128")]
use wasm as lanes;
#[cfg(target_arch = "x86_64")]
use x86 as lanes;

pub use lanes::{truncate, truncate_long};
use std::ops::{Add, Mul, Sub};

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

    /// Four dot products at once.
    #[inline(always)]
    pub fn dots(pairs: [(Self, Self); 4]) -> [f32; 4] {
        let [x, y, z] = lanes::transposed(pairs.map(|(a, b)| lanes::mul(a.0, b.0)));
        lanes::floats(lanes::add(lanes::add(x, y), z))
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

/// Registers. What compilers make of arrays of four numbers is mostly four times as many instructions.
#[cfg(target_arch = "x86_64")]
mod x86 {
    use safe_arch::*;

    pub type Lanes = m128;

    #[inline(always)]
    pub fn of_floats([a, b, c, d]: [f32; 4]) -> Lanes {
        set_reversed_m128(a, b, c, d)
    }

    #[inline(always)]
    pub fn of_integers([a, b, c, d]: [i32; 4]) -> Lanes {
        convert_to_m128_from_i32_m128i(set_i32_m128i(d, c, b, a))
    }

    #[inline(always)]
    pub fn floats(v: Lanes) -> [f32; 4] {
        v.to_array()
    }

    #[inline(always)]
    pub fn add(a: Lanes, b: Lanes) -> Lanes {
        add_m128(a, b)
    }

    #[inline(always)]
    pub fn sub(a: Lanes, b: Lanes) -> Lanes {
        sub_m128(a, b)
    }

    #[inline(always)]
    pub fn mul(a: Lanes, b: Lanes) -> Lanes {
        mul_m128(a, b)
    }

    /// Lanes y, z, x and the fourth.
    #[inline(always)]
    pub fn turned(v: Lanes) -> Lanes {
        shuffle_abi_f32_all_m128::<0b11_00_10_01>(v, v)
    }

    /// The first, second and third lanes of four.
    #[inline(always)]
    pub fn transposed([mut a, mut b, mut c, mut d]: [Lanes; 4]) -> [Lanes; 3] {
        transpose_four_m128(&mut a, &mut b, &mut c, &mut d);
        [a, b, c]
    }

    /// The integer next to x towards zero, where it is a 31-bit number; else any.
    #[inline(always)]
    pub fn truncate(x: f32) -> i32 {
        get_i32_from_m128i_s(truncate_m128_to_m128i(set_m128_s(x)))
    }

    /// The integer next to x towards zero, where it is a 63-bit number; else any.
    #[inline(always)]
    pub fn truncate_long(x: f32) -> i64 {
        truncate_to_i64_m128d_s(set_m128d_s(f64::from(x)))
    }
}

/// Registers of WebAssembly, where they are switched on.
#[cfg(target_feature = "simd128")]
mod wasm {
    use std::arch::wasm32::*;

    pub type Lanes = v128;

    #[inline(always)]
    pub fn of_floats([a, b, c, d]: [f32; 4]) -> Lanes {
        f32x4(a, b, c, d)
    }

    #[inline(always)]
    pub fn of_integers([a, b, c, d]: [i32; 4]) -> Lanes {
        f32x4_convert_i32x4(i32x4(a, b, c, d))
    }

    #[inline(always)]
    pub fn floats(v: Lanes) -> [f32; 4] {
        [
            f32x4_extract_lane::<0>(v),
            f32x4_extract_lane::<1>(v),
            f32x4_extract_lane::<2>(v),
            f32x4_extract_lane::<3>(v),
        ]
    }

    #[inline(always)]
    pub fn add(a: Lanes, b: Lanes) -> Lanes {
        f32x4_add(a, b)
    }

    #[inline(always)]
    pub fn sub(a: Lanes, b: Lanes) -> Lanes {
        f32x4_sub(a, b)
    }

    #[inline(always)]
    pub fn mul(a: Lanes, b: Lanes) -> Lanes {
        f32x4_mul(a, b)
    }

    #[inline(always)]
    pub fn turned(v: Lanes) -> Lanes {
        i32x4_shuffle::<1, 2, 0, 3>(v, v)
    }

    #[inline(always)]
    pub fn transposed([a, b, c, d]: [Lanes; 4]) -> [Lanes; 3] {
        let [ab, cd] = [i32x4_shuffle::<0, 4, 1, 5>(a, b), i32x4_shuffle::<0, 4, 1, 5>(c, d)];
        let [ab_z, cd_z] = [i32x4_shuffle::<2, 6, 3, 7>(a, b), i32x4_shuffle::<2, 6, 3, 7>(c, d)];
        [
            i32x4_shuffle::<0, 1, 4, 5>(ab, cd),
            i32x4_shuffle::<2, 3, 6, 7>(ab, cd),
            i32x4_shuffle::<0, 1, 4, 5>(ab_z, cd_z),
        ]
    }

    #[inline(always)]
    pub fn truncate(x: f32) -> i32 {
        x as i32
    }

    #[inline(always)]
    pub fn truncate_long(x: f32) -> i64 {
        x as i64
    }
}

/// Arrays.
#[cfg(any(test, not(any(target_arch = "x86_64", target_feature = "simd128"))))]
mod portable {
    use std::array::from_fn;

    #[derive(Clone, Copy, Debug)]
    #[repr(align(16))]
    pub struct Lanes(pub [f32; 4]);

    #[inline(always)]
    pub fn of_floats(lanes: [f32; 4]) -> Lanes {
        Lanes(lanes)
    }

    #[inline(always)]
    pub fn of_integers(lanes: [i32; 4]) -> Lanes {
        Lanes(lanes.map(|x| x as f32))
    }

    #[inline(always)]
    pub fn floats(v: Lanes) -> [f32; 4] {
        v.0
    }

    #[inline(always)]
    pub fn add(a: Lanes, b: Lanes) -> Lanes {
        Lanes(from_fn(|i| a.0[i] + b.0[i]))
    }

    #[inline(always)]
    pub fn sub(a: Lanes, b: Lanes) -> Lanes {
        Lanes(from_fn(|i| a.0[i] - b.0[i]))
    }

    #[inline(always)]
    pub fn mul(a: Lanes, b: Lanes) -> Lanes {
        Lanes(from_fn(|i| a.0[i] * b.0[i]))
    }

    #[inline(always)]
    pub fn turned(v: Lanes) -> Lanes {
        let [x, y, z, w] = v.0;
        Lanes([y, z, x, w])
    }

    #[inline(always)]
    pub fn transposed(v: [Lanes; 4]) -> [Lanes; 3] {
        from_fn(|i| Lanes(v.map(|v| v.0[i])))
    }

    #[inline(always)]
    pub fn truncate(x: f32) -> i32 {
        x as i32
    }

    #[inline(always)]
    pub fn truncate_long(x: f32) -> i64 {
        x as i64
    }
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

    fn bits<const N: usize>(lanes: [f32; N]) -> [u32; N] {
        lanes.map(f32::to_bits)
    }

    proptest! {
        /// Whatever the machine has does what arrays do.
        #[test]
        fn registers_and_arrays_agree(cells in prop::array::uniform4(prop::array::uniform4(-(1i32 << 24)..1 << 24)), s in -1e9f32..1e9) {
            let a = cells.map(lanes::of_integers);
            let b = cells.map(portable::of_integers);
            let same = |a: lanes::Lanes, b: portable::Lanes| bits(lanes::floats(a)) == bits(portable::floats(b));
            prop_assert!(same(a[0], b[0]));
            prop_assert!(same(lanes::add(a[0], lanes::of_floats([s; 4])), portable::add(b[0], portable::of_floats([s; 4]))));
            prop_assert!(same(lanes::sub(a[1], a[2]), portable::sub(b[1], b[2])));
            prop_assert!(same(lanes::mul(a[1], a[2]), portable::mul(b[1], b[2])));
            prop_assert!(same(lanes::turned(a[3]), portable::turned(b[3])));
            for (x, y) in lanes::transposed(a).into_iter().zip(portable::transposed(b)) {
                prop_assert!(same(x, y));
            }
            prop_assert_eq!(lanes::truncate(s), portable::truncate(s));
            prop_assert_eq!(lanes::truncate_long(s * s), portable::truncate_long(s * s));
            let v = cells.map(|c| Vector::of_cell([c[0], c[1], c[2]]));
            let dots = Vector::dots([(v[0], v[1]), (v[1], v[2]), (v[2], v[3]), (v[3], v[0])]);
            prop_assert_eq!(bits(dots), bits([v[0].dot(v[1]), v[1].dot(v[2]), v[2].dot(v[3]), v[3].dot(v[0])]));
        }
    }
}
