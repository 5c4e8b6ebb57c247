//! Chapter 13.5: what is missing to a value expected, and what is known of it otherwise.

use std::collections::BTreeMap;

use super::container::Result;
use super::entropy::{Code, Model, Number};
use super::symbol::Symbol;

pub fn bits(x: u32) -> u32 {
    32 - x.leading_zeros()
}

/// The models of a residual.
pub struct Residual {
    /// By kind of context and context: what it adds, how often it has been met.
    parts: [[(i64, u32); 40]; 3],
    symbols: Vec<Symbol>,
    far: Number,
}

impl Residual {
    pub fn fresh(is_octahedral: bool) -> Self {
        let of = |c: i64| match (is_octahedral, c) {
            (true, 39) => [71, 0, -8],
            (true, 0..26) => [36 + 3 * c, 18, (8 * c - 40).min(11)],
            (true, _) => [36 + 3 * c, 4 * (c % 13) - 30, (8 * c - 40).min(11)],
            (false, 39) => [88, 0, -12],
            (false, _) => [14 + 5 * c, -6, (3 * c - 21).min(11)],
        };
        let parts = [0, 1, 2].map(|i| std::array::from_fn(|c| (256 * of(c as i64)[i], 0)));
        let variance = |h: usize| match h {
            0 => 92,
            1 => 171,
            2 => 330,
            3 => 648,
            _ if h.is_multiple_of(2) => 1284,
            _ => 1636,
        };
        let symbols = (0..66).map(|h| Symbol::bell(variance(h), if h < 6 { 0 } else { 5 })).collect();
        Self { parts, symbols, far: Number::FRESH }
    }

    pub fn read(&mut self, code: &mut Code, contexts: [usize; 3], mirrored: bool) -> Result<i32> {
        let sum: i64 = (0..3).map(|i| self.parts[i][contexts[i]].0).sum();
        let size = (sum >> 8).clamp(-16, 511);
        let shift = ((size - 16).max(0) / 16) as u32;
        let symbol = code.symbol(&mut self.symbols[((size + 16) / 8) as usize])?;
        let mut high = symbol as i128 - 8;
        if symbol == 0 {
            high -= i128::from(code.unsigned(&mut self.far)?);
        } else if symbol == 15 {
            high += i128::from(code.unsigned(&mut self.far)?);
        }
        let mut low = 0;
        let mut left = shift;
        while left > 0 {
            let n = left.min(16);
            low = low << n | i128::from(code.bits(n)?);
            left -= n;
        }
        let x = ((high << shift) + low) as i32;
        let twice = 2 * u64::from(x.unsigned_abs()) + 1;
        let e = i64::from(twice.ilog2());
        // The four bits below the leading one.
        let f = ((u128::from(twice) << 4) >> e) as i64 - 16;
        let target = 16 * (e - 1) + f;
        for (i, c) in contexts.into_iter().enumerate() {
            let (part, met) = &mut self.parts[i][c];
            let rate = match *met {
                0..4 => 3,
                4..16 => 4,
                16..48 => 5,
                _ => 6,
            };
            *part += ((target - size) * 256) >> rate;
            *met += 1;
        }
        Ok(if mirrored { x.wrapping_neg() } else { x })
    }
}

/// Models of whether values are those of neighbours.
pub struct Neighbours {
    one: [[Model; 4]; 8],
    which: [[Model; 8]; 8],
}

impl Neighbours {
    pub fn fresh() -> Self {
        Self { one: [[Model::FRESH; 4]; 8], which: [[Model::FRESH; 8]; 8] }
    }

    pub fn read<'a>(
        &mut self,
        code: &mut Code,
        beside: impl Iterator<Item = &'a Vec<i32>>,
        round: usize,
    ) -> Result<Option<Vec<i32>>> {
        let mut different: Vec<&Vec<i32>> = vec![];
        for value in beside {
            if different.len() < 8 && !different.contains(&value) {
                different.push(value);
            }
        }
        let d = different.len();
        if d == 0 {
            return Ok(None);
        }
        let class = match round {
            0 => 0,
            1..=5 => 1,
            6..=38 => 2,
            _ => 3,
        };
        if !code.read(&mut self.one[d - 1][class])? {
            return Ok(None);
        }
        let mut i = 0;
        while i < d - 1 && !code.read(&mut self.which[d - 1][i])? {
            i += 1;
        }
        Ok(Some(different[i].clone()))
    }
}

/// What has stood behind other integers.
pub struct Recalled {
    by_hash: BTreeMap<u32, (i32, u32)>,
    hit: [[[Model; 8]; 6]; 3],
}

impl Recalled {
    pub fn fresh() -> Self {
        Self { by_hash: BTreeMap::new(), hit: [[[Model::FRESH; 8]; 6]; 3] }
    }

    pub fn read(&mut self, code: &mut Code, before: &[i32], expected: i32) -> Result<Option<i32>> {
        let Some((number, times)) = self.by_hash.get_mut(&hash(before)) else { return Ok(None) };
        let off = bits(number.wrapping_sub(expected).unsigned_abs()).min(9) as usize;
        let models = &mut self.hit[before.len().min(3) - 1][off / 2 + off % 2];
        let is_it = code.read(&mut models[(*times).min(7) as usize])?;
        *times += u32::from(is_it);
        Ok(is_it.then_some(*number))
    }

    pub fn put(&mut self, before: &[i32], number: i32) {
        self.by_hash.insert(hash(before), (number, 0));
    }
}

fn hash(before: &[i32]) -> u32 {
    let h = before.iter().fold(before.len() as u32, |h, &x| {
        let h = (h ^ x as u32).wrapping_mul(0x9E37_79B1);
        h ^ h >> 15
    });
    h >> 20
}
