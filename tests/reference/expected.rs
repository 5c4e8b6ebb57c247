//! Chapters 13.4 and 13.5: values by what is expected of them.

use std::collections::BTreeMap;

use super::attribute::Attribute;
use super::beside::{Beside, beside, between, counted, known, position, shares};
use super::column::Place;
use super::container::{Result, demand};
use super::entropy::{Code, Model};
use super::numbers::{cross, dot, integers, minus, radius, raw32, raw64, unfold};
use super::residual::{Neighbours, Recalled, Residual, bits};
use super::vector::{self, Vector, floor};

const NORMALS: u8 = 0;
const COORDINATES: u8 = 2;

/// The models of an attribute's values, and what they remember.
pub struct Values {
    residuals: Vec<Residual>,
    recalled: Option<Recalled>,
    neighbours: Option<Neighbours>,
    costs: [i64; 5],
    /// How many values have had several ways.
    turn: u64,
    constant: bool,
    again: Model,
    /// Whether they have told of a value, or that there is none.
    any: bool,
    last: Vec<i32>,
    side: f64,
    /// By wedge, the lengths of what was missing.
    lengths: BTreeMap<usize, Vec<u32>>,
}

/// What is expected of a value.
struct Expected {
    ways: Vec<Vec<i32>>,
    sources: usize,
    spread: Vec<u32>,
}

impl Values {
    pub fn fresh(about: &Attribute) -> Self {
        let n = integers(about);
        let is_at_corners = about.marks.is_multiple_of(2);
        Self {
            residuals: (0..n).map(|_| Residual::fresh(about.quantisation == 2)).collect(),
            recalled: (is_at_corners && about.semantic == 3).then(Recalled::fresh),
            neighbours: (is_at_corners && about.quantisation == 0).then(Neighbours::fresh),
            costs: [0; 5],
            turn: 0,
            constant: true,
            again: Model::FRESH,
            any: false,
            last: vec![0; n],
            side: 1.0,
            lengths: BTreeMap::new(),
        }
    }

    /// A value has been told, of a wedge.
    pub fn told(&mut self, wedge: Option<usize>, lengths: Vec<u32>) {
        self.any = true;
        self.lengths.extend(wedge.map(|wedge| (wedge, lengths)));
    }

    /// A value, and the lengths of what was missing to the one expected.
    pub fn read(
        &mut self,
        code: &mut Code,
        at: &Place,
        p: Option<&Vec<i32>>,
        about: &Attribute,
    ) -> Result<(Vec<i32>, Vec<u32>)> {
        let n = integers(about);
        if self.constant && self.any {
            self.constant = code.read(&mut self.again)?;
            if self.constant {
                return Ok((self.last.clone(), vec![0; n]));
            }
        }
        let beside = beside(at);
        let near: Vec<&Vec<u32>> = beside.iter().filter_map(|b| self.lengths.get(&b.wedge?)).collect();
        let round: Vec<usize> = (0..n)
            .map(|k| {
                let sum: usize = near.iter().map(|lengths| lengths[k].min(31) as usize).sum();
                (2 * sum + near.len() / 2).checked_div(near.len()).unwrap_or(39).min(39)
            })
            .collect();
        let known = |b: &Beside| at.values.get(&b.wedge?)?.as_ref();
        if let Some(neighbours) = &mut self.neighbours
            && let Some(value) = neighbours.read(code, beside.iter().filter_map(known), round[0])?
        {
            self.last = value.clone();
            return Ok((value, vec![0; n]));
        }
        let guess = self.expect(at, &beside, p, about);
        let several = guess.ways.len() > 1;
        let is_judged = several && (self.turn < 32 || self.turn.is_multiple_of(8));
        self.turn += u64::from(several);
        let best = (0..guess.ways.len()).min_by_key(|&w| self.costs[w]).expect("there is a way");
        let mut expected = guess.ways[best].clone();
        let frame = (about.quantisation == 2).then(|| Frame::of([expected[0], expected[1]], radius(about)));
        if let Some(frame) = &frame {
            [expected[0], expected[1]] = frame.enter([expected[0], expected[1]]);
        }
        let (mut value, mut found): (Vec<i32>, Vec<u32>) = (vec![], vec![]);
        let (mut before, mut mirrored) = (0u32, false);
        for k in 0..n {
            let recalled = match &mut self.recalled {
                Some(recalled) if k > 0 => recalled.read(code, &value, expected[k])?,
                _ => None,
            };
            if let Some(number) = recalled {
                (before, mirrored) = (number.wrapping_sub(expected[k]).unsigned_abs(), false);
                value.push(number);
                found.push(bits(before));
                continue;
            }
            let spread = bits(guess.spread[k]).min(12) as usize;
            let last = if k == 0 { 39 } else { bits(before) as usize };
            let contexts = [round[k], 13 * guess.sources.min(2) + spread, last];
            let off = self.residuals[k].read(code, contexts, mirrored)?;
            (before, mirrored) = (off.unsigned_abs(), off < 0);
            let number = expected[k].wrapping_add(off);
            if let Some(recalled) = self.recalled.as_mut().filter(|_| k > 0) {
                recalled.put(&value, number);
            }
            value.push(number);
            found.push(bits(before));
        }
        if let Some(frame) = &frame {
            [value[0], value[1]] = frame.leave([value[0], value[1]])?;
        }
        if is_judged {
            for (cost, way) in self.costs.iter_mut().zip(&guess.ways) {
                let off = |(x, y): (&i32, &i32)| i64::from(bits(x.wrapping_sub(*y).unsigned_abs()));
                *cost = *cost - (*cost >> 6) + value.iter().zip(way).map(off).sum::<i64>();
            }
        }
        self.last = value.clone();
        Ok((value, found))
    }

    fn expect(&mut self, at: &Place, beside: &[Beside], p: Option<&Vec<i32>>, about: &Attribute) -> Expected {
        let known = known(at, beside);
        let near = known.first().map(|(_, value)| *value).or(p).unwrap_or(&self.last).clone();
        let mut guess = Expected { ways: vec![near], sources: 0, spread: vec![0; integers(about)] };
        let to: Vec<Vector> = known.iter().map(|(b, _)| b.to).collect();
        let shares = shares(&to);
        let known: Vec<&Vec<i32>> = known.into_iter().map(|(_, value)| value).collect();
        match (about.semantic, shares) {
            (4 | 6, _) => guess,
            (NORMALS, shares) if about.quantisation >= 2 => normals(at, about, guess, &known, shares),
            (_, Some(shares)) if about.quantisation < 3 && integers(about) <= 4 => {
                guess.sources = 2;
                for k in 0..integers(about) {
                    let first = guess.ways[0][k];
                    let off: Vec<f32> =
                        known.iter().map(|value| value[k].wrapping_sub(first) as f32).collect();
                    let x = off.iter().zip(&shares).fold(0.0, |sum, (x, share)| sum + x * share) + 0.5;
                    if x.abs() < 2f32.powi(30) {
                        guess.ways[0][k] = first.wrapping_add(floor(x) as i32);
                    }
                    let least = off.iter().copied().fold(f32::INFINITY, f32::min);
                    let largest = off.iter().copied().fold(f32::NEG_INFINITY, f32::max);
                    guess.spread[k] = floor((largest - least) / 8.0) as u32;
                }
                guess
            }
            (_, Some(shares)) => {
                guess.sources = 2;
                let numbers: Vec<Vec<f64>> = known.iter().map(|value| components_of(about, value)).collect();
                for k in 0..numbers[0].len() {
                    let sum = numbers
                        .iter()
                        .zip(&shares)
                        .fold(0.0, |sum, (x, &share)| sum + x[k] * f64::from(share));
                    round(about, &mut guess.ways[0], k, sum);
                    let all = || numbers.iter().map(|x| x[k]);
                    let (least, largest) =
                        (all().fold(f64::INFINITY, f64::min), all().fold(f64::NEG_INFINITY, f64::max));
                    guess.spread[k] = ((largest - least) / 8.0).floor() as u32;
                }
                guess
            }
            _ => self.means(at, about, guess),
        }
    }

    fn means(&mut self, at: &Place, about: &Attribute, mut guess: Expected) -> Expected {
        let known = |c| at.of.get(&c).and_then(|wedge| at.values.get(wedge)?.as_ref());
        let is_mapped = about.semantic == COORDINATES && about.components == 2;
        let components = components_of(about, &guess.ways[0]).len();
        let [mut beyond, mut mapped, mut near] = [0; 3].map(|_| Means::empty(components));
        for &c in counted(at) {
            let (next, prev) = (at.mesh.next(c), at.mesh.prev(c));
            let ends = [next, prev].map(known);
            ends.iter().flatten().for_each(|end| near.add(&components_of(about, end)));
            let [Some(at_next), Some(at_prev)] = ends else { continue };
            let (n, p) = (components_of(about, at_next), components_of(about, at_prev));
            let o = at.mesh.opposite(c).filter(|&o| {
                known(at.mesh.next(o)) == Some(at_prev) && known(at.mesh.prev(o)) == Some(at_next)
            });
            let f = o.and_then(known).map(|f| components_of(about, f));
            if is_mapped {
                let d = [p[0] - n[0], p[1] - n[1]];
                if let Some(f) = &f {
                    let turn = d[0] * (f[1] - n[1]) - d[1] * (f[0] - n[0]);
                    if turn != 0.0 {
                        self.side = if turn < 0.0 { 1.0 } else { -1.0 };
                    }
                }
                let [here, from, to] = [c, next, prev].map(|c| position(at, c));
                let (e, t) = (minus(to, from), minus(here, from));
                let square = dot(e, e);
                if square > 0.0 {
                    let along = dot(t, e) / square;
                    let across = cross(e, t);
                    let up = dot(across, across).sqrt() / square * self.side;
                    mapped.add(&[(n[0] + along * d[0]) - up * d[1], (n[1] + along * d[1]) + up * d[0]]);
                }
            }
            if let Some(f) = f {
                beyond.add(&(0..components).map(|k| (n[k] + p[k]) - f[k]).collect::<Vec<_>>());
            }
        }
        let first = [&mapped, &beyond, &near].into_iter().find(|means| means.added > 0).unwrap_or(&near);
        guess.sources = mapped.added.max(beyond.added);
        if near.added > 0 {
            for k in 0..components {
                round(about, &mut guess.ways[0], k, first.mean(k));
                guess.spread[k] = (first.largest[k] - first.least[k]).floor() as u32;
            }
        }
        guess
    }
}

struct Means {
    added: usize,
    sums: Vec<f64>,
    least: Vec<f64>,
    largest: Vec<f64>,
}

impl Means {
    fn empty(components: usize) -> Self {
        let all = |x| vec![x; components];
        Self { added: 0, sums: all(0.0), least: all(f64::INFINITY), largest: all(f64::NEG_INFINITY) }
    }

    fn add(&mut self, numbers: &[f64]) {
        self.added += 1;
        for (k, &x) in numbers.iter().enumerate() {
            self.sums[k] += x;
            self.least[k] = self.least[k].min(x);
            self.largest[k] = self.largest[k].max(x);
        }
    }

    fn mean(&self, k: usize) -> f64 {
        self.sums[k] / self.added as f64
    }
}

/// The numbers that integers stand for.
fn components_of(about: &Attribute, q: &[i32]) -> Vec<f64> {
    match (about.quantisation, about.stored) {
        (3, 7) => q.chunks(2).map(|q| f64::from_bits(raw64([q[0], q[1]]))).collect(),
        (3, _) => q.iter().map(|&q| f64::from(f32::from_bits(raw32(q)))).collect(),
        _ => q.iter().map(|&q| f64::from(q)).collect(),
    }
}

fn round(about: &Attribute, way: &mut [i32], k: usize, x: f64) {
    if !x.is_finite() {
        return;
    }
    match (about.quantisation, about.stored) {
        (3, 7) => {
            // The map of the bits is its own inverse.
            let b = x.to_bits();
            let q = raw64([(b >> 32) as u32 as i32, b as u32 as i32]);
            (way[2 * k], way[2 * k + 1]) = ((q >> 32) as u32 as i32, q as u32 as i32);
        }
        (3, _) => way[k] = raw32((x as f32).to_bits() as i32) as i32,
        _ => way[k] = (x + 0.5).floor().clamp(-2_147_483_648.0, 2_147_483_647.0) as i32,
    }
}

fn normals(
    at: &Place,
    about: &Attribute,
    mut guess: Expected,
    known: &[&Vec<i32>],
    shares: Option<Vec<f32>>,
) -> Expected {
    let mut own = Vector([0.0; 3]);
    for &c in counted(at) {
        let [x, y] = [at.mesh.next(c), at.mesh.prev(c)].map(|end| between(at, c, end));
        let z = vector::cross(x, y);
        let l = vector::dot(z, z).sqrt();
        if l > 0.0 {
            own = own + z * (angle(l, vector::dot(x, y)) / l);
        }
    }
    let Some(own) = unit(own) else { return guess };
    let mut near = Vector([0.0; 3]);
    for (b, value) in known.iter().enumerate() {
        let x = match about.quantisation {
            2 => unfold(value[0].into(), value[1].into(), radius(about)).to_vec(),
            _ => components_of(about, value),
        };
        near =
            near + Vector([0, 1, 2].map(|k| x[k] as f32)) * shares.as_ref().map_or(1.0, |shares| shares[b]);
    }
    let both = unit(near).map(|near| (near, own + near)).filter(|&(_, both)| sum(both) > 0.0);
    let start = guess.ways.remove(0);
    let ways = match both {
        Some((near, both)) => {
            guess.spread.fill(floor(4096.0 * sum(own - near)) as u32);
            vec![both, near, own, both + near * 2.0, both + own * 2.0]
        }
        None => vec![own],
    };
    guess.sources = if ways.len() > 1 { 2 } else { 1 };
    for v in ways {
        let mut way = start.clone();
        if about.quantisation == 2 {
            way[..2].copy_from_slice(&rounded(v, radius(about)));
        } else {
            let length = vector::dot(v, v).sqrt();
            for (k, x) in v.0.into_iter().enumerate().take(about.components) {
                round(about, &mut way, k, f64::from(x / length));
            }
        }
        guess.ways.push(way);
    }
    guess
}

fn sum(Vector([x, y, z]): Vector) -> f32 {
    (x.abs() + y.abs()) + z.abs()
}

fn unit(v: Vector) -> Option<Vector> {
    let over = 1.0 / sum(v);
    (sum(v).is_finite() && over.is_finite()).then(|| v * over)
}

fn angle(y: f32, x: f32) -> f32 {
    let b = x.abs();
    let t = if y < b { y / b } else { b / y };
    let mut arc = t * ((0.6365 - 0.2078 * (t * t)) + 0.0713 * ((t * t) * (t * t)));
    if y >= b {
        arc = 1.0 - arc;
    }
    if x < 0.0 { 2.0 - arc } else { arc }
}

fn rounded(v: Vector, radius: i64) -> [i32; 2] {
    let r = radius as f32;
    let scale = r / sum(v);
    if !scale.is_finite() {
        return [0, 0];
    }
    let Vector([x, y, z]) = v;
    let (mut u, mut v) = (x * scale, y * scale);
    if z < 0.0 {
        (u, v) = (u.signum() * (r - v.abs()), v.signum() * (r - u.abs()));
    }
    let q = [u, v].map(|x| (floor(x + (r + 0.5)) - radius).clamp(-radius, radius) as i32);
    let r = radius as i32;
    match [q[0].abs() == r, q[1].abs() == r] {
        [true, true] => [r; 2],
        [true, false] => [q[0], q[1].abs()],
        [false, true] => [q[0].abs(), q[1]],
        _ => q,
    }
}

/// §13.5.
struct Frame {
    r: i32,
    inverted: bool,
    turns: usize,
}

impl Frame {
    fn of([u, v]: [i32; 2], r: i64) -> Self {
        let r = r as i32;
        let inverted = u.abs() + v.abs() > r;
        let [u, v] = if inverted { invert([u, v], r) } else { [u, v] };
        Self { r, inverted, turns: [[0, 3], [1, 2]][usize::from(u < 0)][usize::from(v < 0)] }
    }

    fn enter(&self, q: [i32; 2]) -> [i32; 2] {
        let q = if self.inverted { invert(q, self.r) } else { q };
        (0..self.turns).fold(q, |[u, v], _| [v, -u])
    }

    fn leave(&self, q: [i32; 2]) -> Result<[i32; 2]> {
        demand(q.iter().all(|x| (-self.r..=self.r).contains(x)), "13.5: beyond the octahedron")?;
        let q = (0..(4 - self.turns) % 4).fold(q, |[u, v], _| [v, -u]);
        Ok(if self.inverted { invert(q, self.r) } else { q })
    }
}

fn invert([u, v]: [i32; 2], r: i32) -> [i32; 2] {
    let sign = |x: i32| if x < 0 { -1 } else { 1 };
    [sign(u) * (r - v.abs()), sign(v) * (r - u.abs())]
}
