//! What a value is expected to be, from the values and positions round it (spec §13.4).

use super::column::Column;
use super::numbers::{Integers, MOST, Numbers, Scale};
use super::values::Around;
use crate::mesh::attributes::{Quantisation, Semantic, quantise};
use crate::mesh::{Attribute, Corner};

/// Ways to guess a value.
pub(super) const WAYS: usize = 5;

/// What is expected.
#[derive(Clone, Debug)]
pub(super) struct Guess {
    /// The value, in several ways.
    pub ways: [Integers; WAYS],
    /// How many of these there are, 1 at least.
    pub count: usize,
    /// How far what it was made of lies apart, by integer.
    pub spread: [u32; MOST],
    /// Of how many triangles it was made; 0 where only neighbours, or nothing, were known.
    pub sources: usize,
}

/// What is remembered from value to value.
#[derive(Clone, Debug)]
pub(super) struct Memory {
    /// The last value.
    pub last: Integers,
    /// 1 where texture coordinates run counter-clockwise as their triangles do, else -1.
    side: f64,
}

impl Default for Memory {
    fn default() -> Self {
        Self { last: [0; MOST], side: 1.0 }
    }
}

const NONE: Numbers = [0.0; Attribute::MAX_COMPONENTS];

/// A sum of numbers, and the least and the greatest of each.
struct Mean {
    sum: Numbers,
    low: Numbers,
    high: Numbers,
    count: f64,
}

impl Mean {
    fn new() -> Self {
        let (low, high) =
            ([f64::INFINITY; Attribute::MAX_COMPONENTS], [f64::NEG_INFINITY; Attribute::MAX_COMPONENTS]);
        Self { sum: NONE, low, high, count: 0.0 }
    }

    fn add(&mut self, x: Numbers) {
        for (k, x) in x.into_iter().enumerate() {
            self.sum[k] += x;
            (self.low[k], self.high[k]) = (self.low[k].min(x), self.high[k].max(x));
        }
        self.count += 1.0;
    }

    fn mean(&self, k: usize) -> f64 {
        self.sum[k] / self.count
    }
}

/// Guesses the value of a wedge of these corners, `before` being the wedge before it at its vertex.
pub(super) fn guess(
    memory: &mut Memory,
    around: &Around,
    column: &Column,
    corners: &[Corner],
    before: Option<u32>,
) -> Guess {
    let mut near = memory.last;
    let ring = || corners.iter().flat_map(|c| [c.next(), c.prev()]);
    if let Some(value) = ring().find_map(|c| around.value(column, c)).or_else(|| column.value(before?)) {
        near[..value.len()].copy_from_slice(value);
    }
    let mut guess = Guess { ways: [near; WAYS], count: 1, spread: [0; MOST], sources: 0 };
    // What is on a lattice or an integer may be of any length; a surface tells directions alone.
    let is_direction =
        matches!(column.kind.quantisation, Quantisation::Octahedral { .. } | Quantisation::Raw);
    match column.kind.semantic {
        Semantic::Joints | Semantic::Part => {}
        Semantic::Normal if is_direction => normal(&mut guess, around, column, corners),
        _ => linear(&mut guess, memory, around, column, corners),
    }
    guess
}

/// As the surface goes on beyond triangles two of whose corners are known, and as neighbours are.
fn linear(guess: &mut Guess, memory: &mut Memory, around: &Around, column: &Column, corners: &[Corner]) {
    let scale = Scale::of(&column.kind);
    let components = scale.components(column.kind.integers());
    let is_map = column.kind.semantic == Semantic::TexCoord && components == 2;
    let (mut beyond, mut mapped, mut near) = (Mean::new(), Mean::new(), Mean::new());
    for &c in corners {
        let [a, b] = [c.next(), c.prev()].map(|c| around.value(column, c));
        [a, b].into_iter().flatten().for_each(|x| near.add(scale.numbers(x)));
        let (Some(n), Some(p)) = (a, b) else { continue };
        let (a, b) = (scale.numbers(n), scale.numbers(p));
        let far = around.far(column, c, n, p).map(|far| scale.numbers(far));
        if is_map && let Some(x) = similar(memory, around, c, a, b, far) {
            mapped.add(x);
        }
        if let Some(far) = far {
            beyond.add(std::array::from_fn(|k| (a[k] + b[k]) - far[k]));
        }
    }
    let first = if mapped.count > 0.0 {
        &mapped
    } else if beyond.count > 0.0 {
        &beyond
    } else {
        &near
    };
    guess.sources = mapped.count.max(beyond.count) as usize;
    if near.count == 0.0 {
        return;
    }
    guess.count = if is_map { 1 } else { 3 };
    for k in 0..components {
        scale.round(k, first.mean(k), &mut guess.ways[0]);
        if !is_map {
            scale.round(k, near.mean(k), &mut guess.ways[1]);
            scale.round(k, 0.5 * (first.mean(k) + near.mean(k)), &mut guess.ways[2]);
        }
        guess.spread[k] = (first.high[k] - first.low[k]) as u32;
    }
}

/// Where the tip of a triangle lies on the map, were the triangle there as it is in space.
fn similar(
    memory: &mut Memory,
    around: &Around,
    c: Corner,
    a: Numbers,
    b: Numbers,
    far: Option<Numbers>,
) -> Option<Numbers> {
    let d = [b[0] - a[0], b[1] - a[1]];
    if let Some(far) = far {
        let turn = d[0] * (far[1] - a[1]) - d[1] * (far[0] - a[0]);
        if turn != 0.0 {
            memory.side = if turn < 0.0 { 1.0 } else { -1.0 };
        }
    }
    let (along, up) = around.foot(c)?;
    let up = up * memory.side;
    let mut out = NONE;
    out[0] = (a[0] + along * d[0]) - up * d[1];
    out[1] = (a[1] + along * d[1]) + up * d[0];
    Some(out)
}

/// The normals of the wedge's triangles, weighted by area.
fn normal(guess: &mut Guess, around: &Around, column: &Column, corners: &[Corner]) {
    let mut sums = [[0.0; 3]; 3];
    let mut whole = 0.0;
    for &c in corners {
        let [at, n, p] = [c, c.next(), c.prev()].map(|c| around.position(c));
        let (x, y) = (difference(n, at), difference(p, at));
        let cross = cross(x, y);
        let squares = dot(x, x) * dot(y, y);
        let length = dot(cross, cross).sqrt();
        whole += length;
        if length > 0.0 {
            for (sum, weight) in sums.iter_mut().zip([1.0, 1.0 / squares, angle(length, dot(x, y)) / length])
            {
                *sum = [0, 1, 2].map(|k| sum[k] + cross[k] * weight);
            }
        }
    }
    let lengths = sums.map(|sum| dot(sum, sum).sqrt());
    if lengths.contains(&0.0) {
        return;
    }
    guess.sources = corners.len();
    // As the surface is bent against the normals round it.
    let mut near = [0.0; 3];
    for c in corners.iter().flat_map(|c| [c.next(), c.prev()]) {
        if let Some(x) = around.value(column, c) {
            let x = match column.kind.quantisation {
                Quantisation::Octahedral { bits } => {
                    quantise::direction([x[0], x[1]], quantise::radius(bits))
                }
                _ => {
                    let n = Scale::of(&column.kind).numbers(x);
                    [n[0], n[1], n[2]]
                }
            };
            near = [0, 1, 2].map(|k| near[k] + x[k]);
        }
    }
    let length = dot(near, near).sqrt();
    let mut all = [sums[0], sums[1], sums[2], near, near];
    let mut of = [lengths[0], lengths[1], lengths[2], length, 0.0];
    guess.count = 3;
    if length > 0.0 && length.is_finite() {
        all[4] = [0, 1, 2].map(|k| sums[0][k] / lengths[0] + near[k] / length);
        of[4] = dot(all[4], all[4]).sqrt();
        if of[4] > 0.0 {
            guess.count = WAYS;
        }
    }
    let count = guess.count;
    for ((way, sum), length) in guess.ways.iter_mut().zip(all).zip(of).take(count) {
        match column.kind.quantisation {
            Quantisation::Octahedral { bits } => {
                let q = quantise::octahedral(sum, quantise::radius(bits));
                way[..2].copy_from_slice(&q);
            }
            _ => (0..3).for_each(|k| Scale::of(&column.kind).round(k, sum[k] / length, way)),
        }
    }
    let bend = (((whole - lengths[0]) / whole).max(0.0)).sqrt() * 1024.0;
    guess.spread = [bend as u32; MOST];
}

/// The angle whose tangent is y / x, y at least 0, within a thousandth; in units of a quarter turn.
fn angle(y: f64, x: f64) -> f64 {
    let (a, b) = (y, if x < 0.0 { -x } else { x });
    let t = if a < b { a / b } else { b / a };
    // A quarter turn times this is the arc tangent of t.
    let arc = t * ((0.6365 - 0.2078 * t * t) + 0.0713 * t * t * t * t);
    let arc = if a < b { arc } else { 1.0 - arc };
    if x < 0.0 { 2.0 - arc } else { arc }
}

impl Around<'_> {
    /// The value of the wedge of a corner.
    fn value<'a>(&self, column: &'a Column, c: Corner) -> Option<&'a [i32]> {
        column.value(self.wedges.of(c))
    }

    /// The value at the corner that faces `c`, if both triangles have `n` and `p` at the ends of the edge between them.
    fn far<'a>(&self, column: &'a Column, c: Corner, n: &[i32], p: &[i32]) -> Option<&'a [i32]> {
        let o = self.mesh.table.opposite(c);
        let goes_on =
            o.is_some() && self.value(column, o.next()) == Some(p) && self.value(column, o.prev()) == Some(n);
        if goes_on { self.value(column, o) } else { None }
    }

    fn position(&self, c: Corner) -> [f64; 3] {
        self.mesh.positions[self.mesh.table.vertex(c).index()].map(f64::from)
    }

    /// Where a corner lies over the edge opposite to it: how far along it from its first end and how high, in lengths of the edge.
    fn foot(&self, c: Corner) -> Option<(f64, f64)> {
        let [tip, n, p] = [c, c.next(), c.prev()].map(|c| self.position(c));
        let (edge, to) = (difference(p, n), difference(tip, n));
        let square = dot(edge, edge);
        let area = cross(edge, to);
        (square > 0.0).then(|| (dot(to, edge) / square, dot(area, area).sqrt() / square))
    }
}

fn difference(x: [f64; 3], y: [f64; 3]) -> [f64; 3] {
    [x[0] - y[0], x[1] - y[1], x[2] - y[2]]
}

fn dot(x: [f64; 3], y: [f64; 3]) -> f64 {
    (x[0] * y[0] + x[1] * y[1]) + x[2] * y[2]
}

fn cross(x: [f64; 3], y: [f64; 3]) -> [f64; 3] {
    [x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]]
}
