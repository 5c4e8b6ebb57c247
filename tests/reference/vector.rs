//! Chapter 9.2: binary32, one rounding for each operation.

use std::ops::{Add, Mul, Sub};

/// A vector of the text.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vector(pub [f32; 3]);

impl Vector {
    /// The difference of two cells, which is exact.
    pub fn between(from: [i64; 3], to: [i64; 3]) -> Self {
        Self([0, 1, 2].map(|k| (to[k] - from[k]) as f32))
    }
}

impl Add for Vector {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self([0, 1, 2].map(|k| self.0[k] + other.0[k]))
    }
}

impl Sub for Vector {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self([0, 1, 2].map(|k| self.0[k] - other.0[k]))
    }
}

impl Mul<f32> for Vector {
    type Output = Self;
    fn mul(self, by: f32) -> Self {
        Self(self.0.map(|x| x * by))
    }
}

pub fn dot(Vector([x0, x1, x2]): Vector, Vector([y0, y1, y2]): Vector) -> f32 {
    (x0 * y0 + x1 * y1) + x2 * y2
}

pub fn cross(Vector([x0, x1, x2]): Vector, Vector([y0, y1, y2]): Vector) -> Vector {
    Vector([x1 * y2 - x2 * y1, x2 * y0 - x0 * y2, x0 * y1 - x1 * y0])
}

/// d2, of two cells.
pub fn d2(a: [i64; 3], b: [i64; 3]) -> f32 {
    let between = Vector::between(b, a);
    dot(between, between)
}

/// max of binary32: y if x is NaN.
pub fn larger(x: f32, y: f32) -> f32 {
    if x > y { x } else { y }
}

/// clamp of binary32: `low` if x is NaN.
pub fn clamp(x: f32, low: f32, high: f32) -> f32 {
    match x {
        _ if x >= high => high,
        _ if x > low => x,
        _ => low,
    }
}

/// The largest integer that is at most x, for an x that is far below 2^63.
pub fn floor(x: f32) -> i64 {
    x.floor() as i64
}

/// floor(log2 |x|) of a normal number.
pub fn exponent(x: f32) -> i64 {
    i64::from(x.to_bits() >> 23 & 0xFF) - 127
}

#[test]
fn what_is_no_number() {
    assert_eq!(larger(f32::NAN, 2.0), 2.0);
    assert_eq!(clamp(f32::NAN, -1.0, 1.0), -1.0);
    assert_eq!(floor(-0.25), -1);
    assert_eq!(
        [0.0, -0.0, 1e-40, 1.0, -1.99, f32::INFINITY, f32::NAN].map(exponent),
        [-127, -127, -127, 0, 0, 128, 128]
    );
}
