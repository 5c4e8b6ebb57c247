//! Chapter 5.4.4: the coordinates of a new vertex, one after the other.

use super::container::{Result, demand};
use super::entropy::{Code, Number};
use super::lifting::Scale;
use super::symbol::Symbol;
use super::trace::Step;
use super::vector::{Vector, clamp, exponent, floor, larger};

/// The models of coordinates.
pub struct Models {
    /// By place, octave and phase.
    token: [Vec<[Symbol; 3]>; 3],
    far: Number,
}

impl Models {
    pub fn fresh() -> Self {
        let fresh = |octave: i64, phase: i64| {
            let shift = (octave - 6).max(0) / 2;
            let variance = 203 * (1 << (octave - 2 * shift)) / 16 + 12;
            Symbol::bell(variance, if shift > 0 { 5 } else { 4 - 4 * phase })
        };
        let octaves: Vec<_> = (0..56).map(|octave| [0i64, 1, 2].map(|phase| fresh(octave, phase))).collect();
        Self { token: [0, 1, 2].map(|_| octaves.clone()), far: Number::FRESH }
    }
}

/// Reads from a code.
pub struct Reader<'a, 'b> {
    pub code: &'a mut Code<'b>,
    pub models: &'a mut Models,
    pub scale: Scale,
    pub trace: &'a mut Vec<Step>,
}

/// What was reckoned and read for a coordinate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coordinate {
    pub axis: usize,
    pub start: i64,
    pub expected: f32,
    pub variance: f32,
    pub octave: i64,
    pub shift: u32,
    pub origin: i64,
    pub phase: usize,
    pub token: i64,
    pub beyond: i64,
    pub low: i64,
    pub found: i64,
}

pub fn locate(start: [i64; 3], expected: Vector, axes: [Vector; 3], reader: &mut Reader) -> Result<[i64; 3]> {
    let [a0, a1, a2] = axes.map(|axis| axis.0);
    let Vector(expected) = expected;
    let mut order = [0, 1, 2];
    order.sort_by(|&i, &j| a2[i].abs().partial_cmp(&a2[j].abs()).expect("no normal is NaN"));
    let [i, j, h] = order;
    let cov = |x: usize, y: usize| (a0[x] * a0[y] + a1[x] * a1[y]) + a2[x] * a2[y];
    let ii = cov(i, i);
    let r = 1.0 / ii;
    let a = cov(i, j) * r;
    let b = cov(i, h) * r;
    let jj = cov(j, j) - a * cov(i, j);
    let jh = cov(j, h) - b * cov(i, j);
    let c = if jj > 0.0625 { jh / jj } else { 0.0 };
    let hh = (cov(h, h) - b * cov(i, h)) - c * jh;
    reader.trace.push(Step::Axes([a, b, c]));

    let mut cell = start;
    let x = coordinate(0, i, expected[i], ii, &mut cell, reader)?;
    let y = coordinate(1, j, expected[j] + a * x, jj, &mut cell, reader)?;
    coordinate(2, h, (expected[h] + b * x) + c * y, hh, &mut cell, reader)?;
    Ok(cell)
}

fn shift(octave: i64) -> i64 {
    (octave - 6).clamp(0, 32) / 2
}

fn coordinate(
    place: usize,
    axis: usize,
    expected: f32,
    variance: f32,
    cell: &mut [i64; 3],
    reader: &mut Reader,
) -> Result<f32> {
    let octave = exponent(larger(variance, 0.0625)) + 4;
    let shift = shift(octave) as u32;
    let origin = floor(clamp(expected, -67_108_864.0, 67_108_864.0) + 0.5);
    let mut phase = 0;
    if shift == 0 {
        let fraction = expected - origin as f32;
        phase += usize::from(fraction >= -1.0 / 6.0);
        phase += usize::from(fraction >= 1.0 / 6.0);
    }
    let model = &mut reader.models.token[place][octave.min(55) as usize][phase];
    let token = reader.code.symbol(model)? as i64;
    let mut high = token - 8;
    let mut beyond = 0;
    if token == 0 || token == 15 {
        beyond = reader.code.unsigned(&mut reader.models.far)? as i64;
        demand(beyond < 1 << 28, "5.4.4: too far")?;
        high += if token == 0 { -beyond } else { beyond };
    }
    let low = if shift > 0 { reader.code.bits(shift)? as i64 } else { 0 };
    let found = origin + (high << shift) + low;
    let read = Coordinate {
        axis,
        start: cell[axis],
        expected,
        variance,
        octave,
        shift,
        origin,
        phase,
        token,
        beyond,
        low,
        found,
    };
    reader.trace.push(Step::Coordinate(read));
    cell[axis] += found;
    demand(reader.scale.holds(cell[axis]), "5.4.4: off the lattice")?;
    Ok(found as f32 - expected)
}
