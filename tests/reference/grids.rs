//! Chapters 10.1 and 10.2: the type of the coordinates, and grids.

use super::container::{Result, demand, refuse};
use super::entropy::Code;

/// The type: so many bits.
#[derive(Clone, Copy, PartialEq)]
pub struct Type {
    pub w: u32,
}

impl Type {
    pub fn round(self, x: f64) -> f64 {
        if self.w == 32 { f64::from(x as f32) } else { x }
    }

    /// Of a number of the type.
    pub fn key(self, x: f64) -> i128 {
        let b = if self.w == 32 { u128::from((x as f32).to_bits()) } else { u128::from(x.to_bits()) };
        let highest = 1 << (self.w - 1);
        let m = (b % highest) as i128;
        if b < highest { m } else { -1 - m }
    }

    pub fn number(self, k: i128) -> Result<f64> {
        let highest = 1i128 << (self.w - 1);
        demand((-highest..highest).contains(&k), "10.1: no key of the type")?;
        let b = if k >= 0 { k } else { highest + (-1 - k) };
        Ok(self.with_bits(b as u64))
    }

    pub fn with_bits(self, b: u64) -> f64 {
        if self.w == 32 { f64::from(f32::from_bits(b as u32)) } else { f64::from_bits(b) }
    }
}

#[derive(Clone, Copy)]
pub enum Grid {
    Binary { d: u32 },
    Decimal { s: u32, n: i128 },
}

pub fn read_grids(code: &mut Code, of: Type) -> Result<Vec<Grid>> {
    let mut grids = Vec::new();
    for _ in 0..1 + code.bits(2)? {
        grids.push(if code.even()? {
            let (s, n) = (code.bits(4)? as u32, i128::from(code.bits(5)?));
            demand(s > 0 && n <= 22, "10.2: a decimal grid")?;
            Grid::Decimal { s, n }
        } else {
            let d = code.bits(6)? as u32;
            demand(d <= of.w - 2, "10.2: a binary grid")?;
            Grid::Binary { d }
        });
    }
    Ok(grids)
}

fn power_of_ten(e: i128) -> f64 {
    // The text of a power is read as the number nearest to it, which it is.
    format!("1e{e}").parse().unwrap()
}

fn scale(m: i128, e: i128) -> f64 {
    if e >= 0 { m as f64 * power_of_ten(e) } else { m as f64 / power_of_ten(-e) }
}

impl Grid {
    pub fn is_decimal(self) -> bool {
        matches!(self, Self::Decimal { .. })
    }

    pub fn point(self, i: i128, of: Type) -> Result<f64> {
        match self {
            Self::Binary { d } if i >= 0 => of.number(i << d),
            Self::Binary { d } => of.number(-1 - ((-1 - i) << d)),
            Self::Decimal { s, n } => {
                let p = 10i128.pow(s);
                let q = p - p / 10;
                let a = i.abs();
                let (j, m) = if a < p { (0, a) } else { (1 + (a - p) / q, p / 10 + (a - p) % q) };
                if j > n + 22 {
                    return refuse("10.2: no such point");
                }
                let x = of.round(scale(m, j - n));
                Ok(if i < 0 { -x } else { x })
            }
        }
    }

    pub fn least(self, x: f64, of: Type) -> i128 {
        match self {
            Self::Binary { d } => {
                let mut k = -1;
                if x != 0.0 {
                    k = of.key(of.round(x)) + i128::from(of.round(x) < x);
                }
                if k >= 0 { (k + (1 << d) - 1) >> d } else { -1 - ((-1 - k) >> d) }
            }
            Self::Decimal { s, n } if x >= 0.0 => count(x, f64::ceil, s, n),
            Self::Decimal { s, n } => -count(-x, f64::floor, s, n),
        }
    }
}

fn count(y: f64, to_integer: fn(f64) -> f64, s: u32, n: i128) -> i128 {
    let p = 10i128.pow(s);
    let q = p - p / 10;
    let Some(j) = (0..=n + 22).find(|j| y < scale(p, j - n)) else { return p + (n + 22) * q - 1 };
    let m = to_integer(if j <= n { y * power_of_ten(n - j) } else { y / power_of_ten(j - n) });
    let m = (m as i128).min(p);
    if j == 0 { m } else { p + (j - 1) * q + m.max(p / 10) - p / 10 }
}
