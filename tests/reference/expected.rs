//! Chapters 13.4 and 13.5: values by what is expected of them.

use std::collections::BTreeMap;

use super::attribute::Attribute;
use super::column::Place;
use super::container::{Result, demand};
use super::entropy::{Code, Model};
use super::mix;
use super::numbers::{cross, direction, dot, integers, minus, radius, raw32, raw64};

const NORMALS: u8 = 0;
const COORDINATES: u8 = 2;

/// The models of an attribute's values, and what they remember.
pub struct Values {
    residuals: Vec<Residual>,
    costs: Vec<[i64; 5]>,
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
    ways: [Vec<i32>; 5],
    count: usize,
    sources: usize,
    spread: Vec<u32>,
}

impl Values {
    pub fn fresh(about: &Attribute) -> Self {
        let n = integers(about);
        Self {
            residuals: (0..n).map(|_| Residual::fresh()).collect(),
            costs: vec![[0; 5]; n],
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
        let guess = self.expect(at, p, about);
        let is_octahedral = about.quantisation == 2;
        let way = |k: usize| self.best(if is_octahedral { 0 } else { k }, guess.count);
        let mut expected: Vec<i32> = (0..n).map(|k| guess.ways[way(k)][k]).collect();
        let frame = is_octahedral.then(|| Frame::of([expected[0], expected[1]], radius(about)));
        if let Some(frame) = &frame {
            [expected[0], expected[1]] = frame.enter([expected[0], expected[1]]);
        }
        let near: Vec<&Vec<u32>> = at
            .corners
            .iter()
            .flat_map(|&c| [at.mesh.next(c), at.mesh.prev(c)])
            .filter_map(|c| self.lengths.get(at.of.get(&c)?))
            .collect();
        let (mut value, mut found) = (vec![], vec![]);
        let (mut before, mut sign) = (0i32, 0);
        for k in 0..n {
            let sum: usize = near.iter().map(|lengths| lengths[k] as usize).sum();
            let round = (2 * sum + near.len() / 2).checked_div(near.len()).unwrap_or(39).min(39);
            let spread = bits(guess.spread[k]).min(12) as usize;
            let last = if k == 0 { 39 } else { bits(before.unsigned_abs()) as usize };
            let contexts = [round, 13 * guess.sources.min(2) + spread, last];
            before = self.residuals[k].read(code, contexts, sign)?;
            sign = [2, 0, 1][(before.signum() + 1) as usize];
            value.push(expected[k].wrapping_add(before));
            found.push(bits(before.unsigned_abs()));
        }
        if let Some(frame) = &frame {
            [value[0], value[1]] = frame.leave([value[0], value[1]])?;
        }
        if guess.count > 1 {
            for (k, (value, costs)) in value.iter().zip(&mut self.costs).enumerate() {
                for (cost, way) in costs.iter_mut().zip(&guess.ways).take(guess.count) {
                    let off = bits(value.wrapping_sub(way[k]).unsigned_abs());
                    *cost = *cost - (*cost >> 6) + i64::from(off);
                }
            }
        }
        self.last = value.clone();
        Ok((value, found))
    }

    fn best(&self, k: usize, count: usize) -> usize {
        (0..count).min_by_key(|&w| self.costs[k][w]).expect("there is a way")
    }

    fn expect(&mut self, at: &Place, p: Option<&Vec<i32>>, about: &Attribute) -> Expected {
        let known = |c| at.of.get(&c).and_then(|wedge| at.values.get(wedge)?.as_ref());
        let beside = at.corners.iter().flat_map(|&c| [at.mesh.next(c), at.mesh.prev(c)]);
        let near = beside.filter_map(known).next().or(p).unwrap_or(&self.last).clone();
        let ways = [0; 5].map(|_| near.clone());
        let guess = Expected { ways, count: 1, sources: 0, spread: vec![0; integers(about)] };
        match about.semantic {
            4 | 6 => guess,
            NORMALS if about.quantisation >= 2 => normals(at, about, guess),
            _ => self.means(at, about, guess, &known),
        }
    }

    fn means<'a>(
        &mut self,
        at: &Place,
        about: &Attribute,
        mut guess: Expected,
        known: &dyn Fn((usize, usize)) -> Option<&'a Vec<i32>>,
    ) -> Expected {
        let is_mapped = about.semantic == COORDINATES && about.components == 2;
        let components = components_of(about, &guess.ways[0]).len();
        let [mut beyond, mut mapped, mut near] = [0; 3].map(|_| Means::empty(components));
        for &c in at.corners {
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
            guess.count = if is_mapped { 1 } else { 3 };
            for k in 0..components {
                let (x, y) = (first.mean(k), near.mean(k));
                round(about, &mut guess.ways[0], k, x);
                round(about, &mut guess.ways[1], k, y);
                round(about, &mut guess.ways[2], k, 0.5 * (x + y));
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

fn position(at: &Place, c: (usize, usize)) -> [f64; 3] {
    at.mesh.points[at.mesh.tip(c)].map(|q| q as f64)
}

fn normals(at: &Place, about: &Attribute, mut guess: Expected) -> Expected {
    let mut whole = 0.0;
    let mut s = [[0.0; 3]; 3];
    for &c in at.corners {
        let here = position(at, c);
        let x = minus(position(at, at.mesh.next(c)), here);
        let y = minus(position(at, at.mesh.prev(c)), here);
        let z = cross(x, y);
        let l = dot(z, z).sqrt();
        whole += l;
        if l > 0.0 {
            let weights = [1.0, 1.0 / (dot(x, x) * dot(y, y)), angle(l, dot(x, y)) / l];
            for (s, weight) in s.iter_mut().zip(weights) {
                *s = [0, 1, 2].map(|k| s[k] + z[k] * weight);
            }
        }
    }
    let lengths = s.map(|s| dot(s, s).sqrt());
    if lengths.contains(&0.0) {
        return guess;
    }
    guess.count = 3;
    guess.sources = at.corners.len();
    let mut s = [s[0], s[1], s[2], [0.0; 3], [0.0; 3]];
    let mut lengths = [lengths[0], lengths[1], lengths[2], 0.0, 0.0];
    let known = |c| at.of.get(&c).and_then(|wedge| at.values.get(wedge)?.as_ref());
    for &c in at.corners {
        for value in [at.mesh.next(c), at.mesh.prev(c)].into_iter().filter_map(known) {
            let x: Vec<f64> = match about.quantisation {
                2 => direction(value[0].into(), value[1].into(), radius(about)).to_vec(),
                _ => components_of(about, value),
            };
            s[3] = [0, 1, 2].map(|k| s[3][k] + x[k]);
        }
    }
    lengths[3] = dot(s[3], s[3]).sqrt();
    if lengths[3] > 0.0 && lengths[3].is_finite() {
        s[4] = [0, 1, 2].map(|k| s[0][k] / lengths[0] + s[3][k] / lengths[3]);
        lengths[4] = dot(s[4], s[4]).sqrt();
        if lengths[4] > 0.0 {
            guess.count = 5;
        }
    }
    let count = guess.count;
    for ((way, s), length) in guess.ways.iter_mut().zip(s).zip(lengths).take(count) {
        if about.quantisation == 2 {
            way[..2].copy_from_slice(&nearest(s, radius(about)));
        } else {
            for (k, x) in s.into_iter().enumerate().take(about.components) {
                round(about, way, k, x / length);
            }
        }
    }
    let spread = (1024.0 * ((whole - lengths[0]) / whole).max(0.0).sqrt()).floor() as u32;
    guess.spread.fill(spread);
    guess
}

fn angle(y: f64, x: f64) -> f64 {
    let b = x.abs();
    let t = if y < b { y / b } else { b / y };
    let mut arc = t * ((0.6365 - 0.2078 * t * t) + 0.0713 * t * t * t * t);
    if y >= b {
        arc = 1.0 - arc;
    }
    if x < 0.0 { 2.0 - arc } else { arc }
}

fn nearest([x, y, z]: [f64; 3], radius: i64) -> [i32; 2] {
    let r = radius as f64;
    let sum = (x.abs() + y.abs()) + z.abs();
    let scale = r / sum;
    let (mut u, mut v) = (0.0, 0.0);
    if scale.is_finite() && sum.is_finite() {
        (u, v) = (x * scale, y * scale);
        if z < 0.0 {
            (u, v) = (u.signum() * (r - v.abs()), v.signum() * (r - u.abs()));
        }
    }
    let mut best = ([0; 2], f64::NEG_INFINITY);
    for k in 0..4 {
        let q = [u.floor() as i64 + k % 2, v.floor() as i64 + k / 2].map(|q| q.clamp(-radius, radius));
        let q = match [q[0].abs() == radius, q[1].abs() == radius] {
            [true, true] => [radius; 2],
            [true, false] => [q[0], q[1].abs()],
            [false, true] => [q[0].abs(), q[1]],
            _ => q,
        };
        let d = dot(direction(q[0], q[1], radius), [x, y, z]);
        if d > best.1 {
            best = (q.map(|q| q as i32), d);
        }
    }
    best.0
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

fn bits(x: u32) -> u32 {
    32 - x.leading_zeros()
}

/// The models of a residual.
struct Residual {
    /// Those that have been met, by context and place.
    length: [BTreeMap<(usize, usize), Model>; 3],
    second: [Model; 33],
    third: [[Model; 2]; 33],
    sign: [Model; 3],
    weights: [[i64; 3]; 33],
}

impl Residual {
    fn fresh() -> Self {
        Self {
            length: [0; 3].map(|_| BTreeMap::new()),
            second: [Model::FRESH; 33],
            third: [[Model::FRESH; 2]; 33],
            sign: [Model::FRESH; 3],
            weights: [[26000; 3]; 33],
        }
    }

    fn read(&mut self, code: &mut Code, contexts: [usize; 3], s: usize) -> Result<i32> {
        let mut n = 0;
        loop {
            let [x, y, z] = &mut self.length;
            let models = [(x, 0), (y, 1), (z, 2)]
                .map(|(models, k)| models.entry((contexts[k], n)).or_insert(Model::FRESH));
            if !mix::read(code, &mut self.weights[n], models)? {
                break;
            }
            n += 1;
            demand(n <= 32, "13.5: a residual of more than 32 bits")?;
        }
        if n == 0 {
            return Ok(0);
        }
        let mut x = 1u32;
        for place in 1..n {
            let bit = match place {
                1 => code.read(&mut self.second[n])?,
                2 => code.read(&mut self.third[n][x as usize & 1])?,
                _ => code.even()?,
            };
            x = x << 1 | u32::from(bit);
        }
        let x = x as i32;
        Ok(if code.read(&mut self.sign[s])? { x.wrapping_neg() } else { x })
    }
}
