//! Chapter 10: the coordinates of the input.

use std::collections::BTreeMap;

use super::container::{CORRECTION, File, Result, demand};
use super::entropy::{Code, Model, Number};
use super::grids::{Grid, Type, read_grids};
use super::residue::{Origins, Whole};

/// Corrects a whole, if the file has a correction.
pub fn correct(file: &File, whole: &mut Whole, origins: &Origins) -> Result<()> {
    let payload = file.payload(CORRECTION, 0);
    if payload.is_empty() {
        return Ok(());
    }
    let mut code = Code::start(&payload);
    read_correction(&mut code, file, whole, origins)?;
    code.end()
}

/// §10, up to the end of the code.
pub fn read_correction(code: &mut Code, file: &File, whole: &mut Whole, origins: &Origins) -> Result<()> {
    let of = Type { w: if code.even()? { 64 } else { 32 } };
    let mut axes = Vec::new();
    for _ in 0..3 {
        axes.push(Axis {
            of,
            grids: read_grids(code, of)?,
            again: [Model::FRESH; 4],
            on: [Model::FRESH; 4],
            off: Number::FRESH,
            other: [Model::FRESH; 2],
            by: Model::FRESH,
            away: Number::FRESH,
            seen: BTreeMap::new(),
        });
    }
    let half = file.step * 0.5;
    let places = whole.positions.clone();
    for (position, point) in whole.positions.iter_mut().zip(&origins.points) {
        let Some(q) = point else {
            demand(position.iter().all(|&x| of.round(x) == x), "10.3: a far vertex of another type")?;
            continue;
        };
        let p = file.position(*q);
        for i in 0..3 {
            position[i] = axes[i].coordinate(code, q[i], p[i], half)?;
        }
    }
    read_copies(code, whole, &places, &mut axes, half)
}

struct Axis {
    of: Type,
    grids: Vec<Grid>,
    again: [Model; 4],
    on: [Model; 4],
    off: Number,
    other: [Model; 2],
    by: Model,
    away: Number,
    seen: BTreeMap<i64, (f64, usize)>,
}

impl Axis {
    fn coordinate(&mut self, code: &mut Code, q: i64, p: f64, half: f64) -> Result<f64> {
        let seen = match self.seen.get(&q).copied() {
            Some((x, state)) if code.read(&mut self.again[state])? => (x, (state + 1).min(3)),
            Some(_) => (self.fresh(code, p, half)?, 0),
            None => (self.fresh(code, p, half)?, 1),
        };
        self.seen.insert(q, seen);
        Ok(seen.0)
    }

    fn fresh(&mut self, code: &mut Code, p: f64, half: f64) -> Result<f64> {
        let of = self.of;
        for (g, grid) in self.grids.iter().enumerate() {
            if code.read(&mut self.on[g])? {
                let low = grid.least(p - half, of);
                let high = low.max(grid.least(p + half, of) - 1);
                let i = low + i128::from(code.uniform((high - low + 1) as u64)?);
                let mut x = grid.point(i, of)?;
                if grid.is_decimal() {
                    x = of.number(of.key(x) + i128::from(code.signed(&mut self.off)?))?;
                }
                demand(x.is_finite(), "10.3: a coordinate that is not finite")?;
                return Ok(x);
            }
        }
        let mut b = 0;
        for _ in 0..of.w / 16 {
            b = b << 16 | code.bits(16)?;
        }
        let x = of.with_bits(b);
        demand(x.is_finite(), "10.3: a coordinate that is not finite")?;
        Ok(x)
    }
}

/// §10.4.
fn read_copies(
    code: &mut Code,
    whole: &mut Whole,
    points: &[[f64; 3]],
    axes: &mut [Axis],
    half: f64,
) -> Result<()> {
    let (mut count, mut steps) = (Number::FRESH, Number::FRESH);
    let n = code.unsigned(&mut count)?;
    let mut v = 0;
    let mut before = None;
    let vertices = whole.positions.len();
    let mut copies: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for _ in 0..n {
        v += code.unsigned(&mut steps)? as usize;
        demand(v < vertices, "10.4: no such vertex")?;
        let mut x = whole.positions[v];
        let mut c = 0;
        for i in 0..3 {
            let axis = &mut axes[i];
            if code.read(&mut axis.other[c])? {
                c = 1;
                x[i] = if code.read(&mut axis.by)? {
                    axis.of.number(axis.of.key(x[i]) + i128::from(code.signed(&mut axis.away)?))?
                } else {
                    axis.fresh(code, points[v][i], half)?
                };
                demand(x[i].is_finite(), "10.4: a coordinate that is not finite")?;
            }
        }
        demand(x.map(f64::to_bits) != whole.positions[v].map(f64::to_bits), "10.4: no copy")?;
        let now = (v, x.map(|x| axes[0].of.key(x)));
        demand(before.is_none_or(|before| before < now), "10.4: order of copies")?;
        before = Some(now);
        copies.entry(v).or_default().push(whole.positions.len());
        whole.positions.push(x);
    }
    if n > 0 {
        let mut choice = Number::FRESH;
        for corner in whole.triangles.as_flattened_mut() {
            let Some(copies) = copies.get(corner) else { continue };
            let k = code.unsigned(&mut choice)? as usize;
            demand(k <= copies.len(), "10.4: no such copy")?;
            if k > 0 {
                *corner = copies[k - 1];
            }
        }
    }
    Ok(())
}
