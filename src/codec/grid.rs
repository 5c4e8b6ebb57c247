//! Grids: the floating-point numbers that coordinates are taken from, numbered in ascending order (spec §10.1, §10.2).

use std::fmt;

/// The type of the input's coordinates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Real {
    /// IEEE 754 binary32.
    #[default]
    Binary32,
    /// IEEE 754 binary64.
    Binary64,
}

impl fmt::Display for Real {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "binary{}", self.bits())
    }
}

impl Real {
    /// Bits of a number.
    pub fn bits(self) -> u32 {
        match self {
            Self::Binary32 => 32,
            Self::Binary64 => 64,
        }
    }

    /// The nearest number of this type, ties to even; an infinity where `x` is too large.
    #[inline]
    pub fn round(self, x: f64) -> f64 {
        match self {
            Self::Binary32 => f64::from(x as f32),
            Self::Binary64 => x,
        }
    }

    /// Whether `x` is a finite number of this type.
    #[inline]
    pub fn holds(self, x: f64) -> bool {
        x.is_finite() && self.round(x) == x
    }

    /// The place of a number of this type in ascending order: 0 for 0, -1 for -0.
    #[inline]
    pub fn key(self, x: f64) -> i64 {
        let (negative, magnitude) = match self {
            Self::Binary32 => (x.is_sign_negative(), i64::from((x as f32).to_bits() & 0x7FFF_FFFF)),
            Self::Binary64 => (x.is_sign_negative(), (x.to_bits() & (u64::MAX >> 1)) as i64),
        };
        if negative { -1 - magnitude } else { magnitude }
    }

    /// The number with this key, if there is one.
    #[inline]
    pub fn number(self, key: i64) -> Option<f64> {
        let magnitude = if key < 0 { -1 - key } else { key };
        let sign = u64::from(key < 0);
        match self {
            Self::Binary32 if magnitude >> 31 == 0 => {
                Some(f64::from(f32::from_bits(magnitude as u32 | (sign as u32) << 31)))
            }
            Self::Binary32 => None,
            Self::Binary64 => Some(f64::from_bits(magnitude as u64 | sign << 63)),
        }
    }
}

/// A set of numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Grid {
    /// All numbers of the type of which so many low bits are zero; at most its bits but two.
    Binary {
        /// The low bits.
        dropped: u32,
    },
    /// Decimals.
    Decimal {
        /// Most significant digits, 1 to 15.
        digits: u32,
        /// Most digits behind the point, at most [`MAX_PLACES`].
        places: u32,
    },
}

/// Most digits behind the point that a decimal grid has; 10^22 is the largest power that a binary64 number is.
pub const MAX_PLACES: u32 = 22;

/// The points of a grid, ready for use.
#[derive(Clone, Debug)]
pub struct Points {
    /// The grid.
    pub grid: Grid,
    real: Real,
    /// 10^digits, and how many of the numbers below that have all their digits; 0 for binary grids.
    power: i64,
    decade: i64,
    /// Where each decade of a decimal grid ends.
    ends: Vec<f64>,
}

impl Points {
    /// The points of `grid` for coordinates of type `real`.
    pub fn new(grid: Grid, real: Real) -> Self {
        let Grid::Decimal { digits, places } = grid else {
            return Self { grid, real, power: 0, decade: 0, ends: Vec::new() };
        };
        let power = 10i64.pow(digits.min(15));
        let places = places.min(MAX_PLACES) as i32;
        let ends = (0..=places + MAX_PLACES as i32).map(|j| scale(power, j - places)).collect();
        Self { grid, real, power, decade: power - power / 10, ends }
    }

    /// Point `i`, or `None` where there is no such one.
    #[inline]
    pub fn point(&self, i: i64) -> Option<f64> {
        match self.grid {
            Grid::Binary { dropped } => {
                let key = |i: i64| i.checked_mul(1 << dropped);
                self.real.number(if i < 0 { -1 - key(-1 - i)? } else { key(i)? })
            }
            Grid::Decimal { places, .. } => {
                let a = i.checked_abs()?;
                let (j, m) = match a - self.power {
                    ..0 => (0, a),
                    over => (1 + over / self.decade, self.power / 10 + over % self.decade),
                };
                if j as usize >= self.ends.len() {
                    return None;
                }
                let x = self.real.round(scale(m, j as i32 - places as i32));
                Some(if i < 0 { -x } else { x })
            }
        }
    }

    /// The number of the first point that is not below `x`, which is not NaN; -0 is not below 0.
    #[inline]
    pub fn least(&self, x: f64) -> i64 {
        match self.grid {
            Grid::Binary { dropped } => {
                let rounded = self.real.round(x);
                let k = if x == 0.0 { -1 } else { self.real.key(rounded) + i64::from(rounded < x) };
                if k < 0 {
                    return -1 - ((-1 - k) >> dropped);
                }
                (k >> dropped) + i64::from(k & ((1 << dropped) - 1) != 0)
            }
            Grid::Decimal { .. } if x >= 0.0 => self.count(x, f64::ceil),
            Grid::Decimal { .. } => -self.count(-x, f64::floor),
        }
    }

    /// The number of the decimal at `y`, which is not negative; between two, that which `to_integer` chooses.
    fn count(&self, y: f64, to_integer: fn(f64) -> f64) -> i64 {
        let Grid::Decimal { places, .. } = self.grid else { return 0 };
        let (power, decade) = (self.power, self.decade);
        let j = self.ends.partition_point(|&end| end <= y);
        if j == self.ends.len() {
            return power + (j as i64 - 1) * decade - 1;
        }
        let shift = j as i32 - places as i32;
        let scaled = match POWERS[shift.unsigned_abs() as usize] {
            power if shift <= 0 => y * power,
            power => y / power,
        };
        let m = (to_integer(scaled) as i64).min(power);
        if j == 0 { m } else { power + (j as i64 - 1) * decade + (m - power / 10).max(0) }
    }

    /// The points from `from` to below `to`, at least one: the number of the first, and how many. Neither end is NaN.
    #[inline]
    pub fn within(&self, from: f64, to: f64) -> (i64, u64) {
        let low = self.least(from);
        let high = low.max(self.least(to) - 1);
        (low, high.wrapping_sub(low) as u64 + 1)
    }
}

/// m * 10^e, rounded once; |m| is at most 10^15 and |e| at most 22.
fn scale(m: i64, e: i32) -> f64 {
    let power = POWERS[e.unsigned_abs() as usize];
    if e < 0 { m as f64 / power } else { m as f64 * power }
}

/// Powers of ten that are binary64 numbers.
const POWERS: [f64; MAX_PLACES as usize + 1] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18,
    1e19, 1e20, 1e21, 1e22,
];

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn keys_are_in_order() {
        for real in [Real::Binary32, Real::Binary64] {
            let ascending =
                [f64::NEG_INFINITY, -2.0, -1.0, -1e-40, -0.0, 0.0, 1e-40, 1.0, 1.5, f64::INFINITY];
            let ascending = ascending.map(|x| real.round(x));
            assert!(ascending.map(|x| real.key(x)).is_sorted_by(|a, b| a < b));
            assert_eq!([-0.0, 0.0].map(|x| real.key(x)), [-1, 0]);
            for x in ascending {
                assert_eq!(real.number(real.key(x)).map(f64::to_bits), Some(x.to_bits()));
            }
        }
        // 1 is 3F800000, and the next number is one further on.
        assert_eq!(Real::Binary32.number(0x3F80_0001), Some(1.0 + f64::from(f32::EPSILON)));
        assert_eq!([1 << 31, -1 - (1 << 31)].map(|k| Real::Binary32.number(k)), [None; 2]);
    }

    #[test]
    fn decimals_of_three_digits_and_two_places() {
        let points = Points::new(Grid::Decimal { digits: 3, places: 2 }, Real::Binary64);
        // 0.00 to 9.99 are 1,000 points, 10.0 to 99.9 are 900, 100 to 999 another 900, then 1000, 1010, …
        let known =
            [(0, 0.0), (1, 0.01), (999, 9.99), (1000, 10.0), (1001, 10.1), (1900, 100.0), (2801, 1010.0)];
        for (i, x) in known {
            assert_eq!((points.point(i), points.point(-i)), (Some(x), Some(-x)));
            assert_eq!(points.least(x), i);
        }
        assert_eq!([9.991, 10.01, 99.95, 1001.0].map(|x| points.least(x)), [1000, 1001, 1900, 2801]);
        assert_eq!([-9.991, -10.01, -1001.0].map(|x| points.least(x)), [-999, -1000, -2800]);
        assert_eq!(points.within(-0.015, 0.02), (-1, 3));
        assert_eq!(points.within(0.011, 0.012), (2, 1), "never none");
        let last = 1000 + 24 * 900 - 1;
        assert_eq!([1e26, 1e300, f64::INFINITY].map(|x| points.least(x)), [last; 3]);
        assert_eq!((points.point(last), points.point(last + 1)), (Some(9.99e24), None));
    }

    #[test]
    fn binary_grids_drop_bits() {
        let points = Points::new(Grid::Binary { dropped: 22 }, Real::Binary32);
        // One bit of the mantissa is left: 1, 1.5, 2, 3, …
        let one = points.least(1.0);
        let there = [-1, 0, 1, 2, 3].map(|k| points.point(one + k).unwrap());
        assert_eq!(there, [0.75, 1.0, 1.5, 2.0, 3.0]);
        assert_eq!([1.1, 1.5, 1.6].map(|x| points.least(x) - one), [1, 1, 2]);
        let minus_one = points.least(-1.0);
        assert_eq!([-2, -1, 0, 1].map(|k| points.point(minus_one + k).unwrap()), [-2.0, -1.5, -1.0, -0.75]);
        assert_eq!([-1.1, -1.5, -1.6].map(|x| points.least(x) - minus_one), [0, -1, -1]);
        assert_eq!([-0.0, 0.0, 1e-60, -1e-60].map(|x| points.least(x)), [-1, -1, 1, -1]);
        assert_eq!(points.point(i64::MAX), None);
    }

    proptest! {
        /// `least` is what it says, as far as rounding goes: within one point. Points of more digits than the type has fall together.
        #[test]
        fn least_finds_its_point(
            digits in 1..=15u32, places in 0..=22u32, dropped in 0..=20u32, bits: u64, small in -1e3..1e3f64, wide: bool,
        ) {
            let real = if wide { Real::Binary64 } else { Real::Binary32 };
            let digits = if wide { digits } else { digits.min(6) };
            for grid in [Grid::Decimal { digits, places }, Grid::Binary { dropped }] {
                let points = Points::new(grid, real);
                for x in [small, f64::from_bits(bits), f64::from(f32::from_bits(bits as u32))] {
                    if !(x.abs() < 1e22 && real.round(x).is_finite()) {
                        continue;
                    }
                    let i = points.least(x);
                    let at = |k: i64| points.point(i + k).unwrap();
                    prop_assert!(at(1) >= x && at(-2) <= x, "{grid:?}: {} is not least for {x}", at(0));
                    prop_assert!(at(0) <= at(1) && at(-1) <= at(0));
                }
            }
        }
    }
}
