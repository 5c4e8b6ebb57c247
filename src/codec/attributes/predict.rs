//! What a value is expected to be, from the values and positions round it (spec §13.4).

use super::column::Column;
use super::numbers::{Integers, MOST, Numbers, Scale};
use super::ring::Ring;
use super::values::Around;
use crate::mesh::attributes::{Quantisation, Semantic, quantise};
use crate::mesh::{Attribute, Corner};

/// Ways to guess a value.
pub(super) const WAYS: usize = 5;

/// What is expected.
#[derive(Clone, Debug, Default)]
pub(super) struct Guess {
    /// The value.
    pub value: Integers,
    /// The value in all ways that there are, where these are to be judged; else none.
    pub ways: Vec<Integers>,
    /// How far what it was made of lies apart, by integer.
    pub spread: [u32; MOST],
    /// Of how many triangles it was made, or 2 where of all that is round it; 0 where only neighbours, or nothing, were known.
    pub sources: usize,
}

/// What is remembered from value to value.
#[derive(Clone, Debug)]
pub(super) struct Memory {
    /// The last value.
    pub last: Integers,
    /// 1 where texture coordinates run counter-clockwise as their triangles do, else -1.
    side: f64,
    /// How well each way did: mean bit lengths of what was missing.
    pub costs: [u32; WAYS],
    /// How many values there have been of which there were several ways.
    turn: u64,
}

impl Default for Memory {
    fn default() -> Self {
        Self { last: [0; MOST], side: 1.0, costs: [0; WAYS], turn: 0 }
    }
}

/// The first values of an attribute, of which all ways are judged; of later ones every eighth is.
const JUDGED: u64 = 32;

impl Memory {
    /// Whether all ways of the next value are to be judged.
    fn judges(&mut self) -> bool {
        let judges = self.turn < JUDGED || self.turn.is_multiple_of(8);
        self.turn += 1;
        judges
    }

    /// The best of so many ways.
    fn best(&self, count: usize) -> usize {
        (0..count).min_by_key(|&way| self.costs[way]).unwrap_or(0)
    }

    /// Judges all ways by the first `n` integers of the last value.
    pub(super) fn judge(&mut self, ways: &[Integers], n: usize) {
        let value = &self.last[..n];
        for (way, cost) in ways.iter().zip(&mut self.costs) {
            let bits =
                |(value, way): (&i32, &i32)| 32 - value.wrapping_sub(*way).unsigned_abs().leading_zeros();
            *cost = *cost - (*cost >> 6) + value.iter().zip(way).map(bits).sum::<u32>();
        }
    }
}

const NONE: Numbers = [0.0; Attribute::MAX_COMPONENTS];

/// Guesses the value of a wedge, round which is `ring`; `before` is the wedge before it at its vertex. `guess` has what was guessed before.
#[inline]
pub(super) fn guess(
    guess: &mut Guess,
    memory: &mut Memory,
    around: &Around,
    column: &Column,
    ring: &mut Ring,
    before: Option<u32>,
) {
    let n = column.kind.integers();
    guess.value[..n].copy_from_slice(&memory.last[..n]);
    guess.ways.clear();
    guess.sources = 0;
    let beside = || ring.beside.iter().find_map(|beside| column.value(beside.wedge));
    if let Some(value) = beside().or_else(|| column.value(before?)) {
        guess.value[..value.len()].copy_from_slice(value);
    }
    guess.spread[..n].fill(0);
    // What is on a lattice or an integer may be of any length; a surface tells directions alone.
    let is_direction =
        matches!(column.kind.quantisation, Quantisation::Octahedral { .. } | Quantisation::Raw);
    match column.kind.semantic {
        Semantic::Joints | Semantic::Part => {}
        Semantic::Normal if is_direction => normal(guess, memory, column, ring),
        _ => {
            let components = Scale::of(&column.kind).components(column.kind.integers());
            let is_fitted = match components {
                1 => fitted::<1>(guess, column, ring),
                2 => fitted::<2>(guess, column, ring),
                3 => fitted::<3>(guess, column, ring),
                4 => fitted::<4>(guess, column, ring),
                _ => fitted::<{ Attribute::MAX_COMPONENTS }>(guess, column, ring),
            };
            if !is_fitted {
                linear(guess, memory, around, column, ring);
            }
        }
    }
}

/// As a linear map fitted to neighbours has it, of at most N components.
#[inline]
fn fitted<const N: usize>(guess: &mut Guess, column: &Column, ring: &mut Ring) -> bool {
    let scale = Scale::of(&column.kind);
    let Some(shares) = ring.shares(column) else { return false };
    let (mut sum, mut low, mut high) = ([0.0; N], [f64::INFINITY; N], [f64::NEG_INFINITY; N]);
    for (wedge, share) in shares {
        let Some(value) = column.value(wedge) else { continue };
        let numbers: [f64; N] = match value.first_chunk() {
            Some(value) if scale == Scale::Same => value.map(f64::from),
            _ => std::array::from_fn(|k| scale.number(value, k)),
        };
        for (k, x) in numbers.into_iter().enumerate() {
            sum[k] += x * share;
            low[k] = if x < low[k] { x } else { low[k] };
            high[k] = if x > high[k] { x } else { high[k] };
        }
    }
    guess.sources = 2;
    for k in 0..N.min(scale.components(column.kind.integers())) {
        scale.round(k, sum[k], &mut guess.value);
        guess.spread[k] = ((high[k] - low[k]) * 0.125) as u32;
    }
    true
}

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

/// As the surface goes on beyond triangles two of whose corners are known, or as neighbours are.
fn linear(guess: &mut Guess, memory: &mut Memory, around: &Around, column: &Column, ring: &Ring) {
    let scale = Scale::of(&column.kind);
    let components = scale.components(column.kind.integers());
    let is_map = column.kind.semantic == Semantic::TexCoord && components == 2;
    let (mut beyond, mut mapped, mut near) = (Mean::new(), Mean::new(), Mean::new());
    for &c in &ring.corners {
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
    for k in 0..components {
        scale.round(k, first.mean(k), &mut guess.value);
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

/// The normals of the wedge's triangles summed in some way, or those of neighbours; the last way is both.
const AREA: usize = 0;
const SQUARES: usize = 1;
const ANGLE: usize = 2;
const NEAR: usize = 3;

/// The normals of the wedge's triangles and those of its neighbours, in the way that did best.
fn normal(guess: &mut Guess, memory: &mut Memory, column: &Column, ring: &mut Ring) {
    let mut area = [0.0; 3];
    let mut whole = 0.0;
    for [x, y] in ring.sides() {
        let z = cross(x, y);
        whole += dot(z, z).sqrt();
        area = plus(area, z, 1.0);
    }
    let length = dot(area, area).sqrt();
    if length == 0.0 {
        return;
    }
    guess.sources = ring.corners.len();
    let bend = ((whole - length) / whole).max(0.0).sqrt() * 1024.0;
    guess.spread = [bend as u32; MOST];
    // As the surface is bent against the normals round it.
    let near = near_normal(column, ring);
    let both = if sum(near) > 0.0 && sum(near).is_finite() {
        plus(area.map(|x| x / sum(area)), near, 1.0 / sum(near))
    } else {
        [0.0; 3]
    };
    let count = if sum(both) > 0.0 { WAYS } else { WAYS - 2 };
    let vector = |way: usize| match way {
        AREA => area,
        SQUARES => weighted(ring, |x, y, _| 1.0 / (dot(x, x) * dot(y, y))),
        ANGLE => weighted(ring, |x, y, length| angle(length, dot(x, y)) / length),
        NEAR => near,
        _ => both,
    };
    let best = memory.best(count);
    if memory.judges() {
        let start = guess.value;
        for way in 0..count {
            let mut value = start;
            round_normal(column, vector(way), &mut value);
            guess.ways.push(value);
        }
        guess.value = guess.ways[best];
    } else {
        round_normal(column, vector(best), &mut guess.value);
    }
}

/// A vector as the integers of a normal.
fn round_normal(column: &Column, vector: [f64; 3], value: &mut Integers) {
    if let Quantisation::Octahedral { bits } = column.kind.quantisation {
        value[..2].copy_from_slice(&quantise::near_octahedral(vector, quantise::radius(bits)));
    } else {
        let length = dot(vector, vector).sqrt();
        (0..3).for_each(|k| Scale::of(&column.kind).round(k, vector[k] / length, value));
    }
}

/// The normals of a wedge's triangles, each weighted by its sides and the length of its normal.
fn weighted(ring: &Ring, weight: impl Fn([f64; 3], [f64; 3], f64) -> f64) -> [f64; 3] {
    let mut total = [0.0; 3];
    for [x, y] in ring.sides() {
        let z = cross(x, y);
        let length = dot(z, z).sqrt();
        if length > 0.0 {
            total = plus(total, z, weight(x, y, length));
        }
    }
    total
}

/// The normal that neighbours tell of.
fn near_normal(column: &Column, ring: &mut Ring) -> [f64; 3] {
    let scale = Scale::of(&column.kind);
    let vector = |value: &[i32]| match column.kind.quantisation {
        Quantisation::Octahedral { bits } => {
            quantise::unfolded([value[0], value[1]], quantise::radius(bits)).map(f64::from)
        }
        _ => [0, 1, 2].map(|k| scale.number(value, k)),
    };
    let mut near = [0.0; 3];
    let mut are_shared = false;
    for (wedge, share) in ring.shares(column).into_iter().flatten() {
        are_shared = true;
        near = column.value(wedge).map_or(near, |value| plus(near, vector(value), share));
    }
    if are_shared {
        return near;
    }
    for wedge in ring.wedges(column) {
        near = column.value(wedge).map_or(near, |value| plus(near, vector(value), 1.0));
    }
    near
}

/// x + w y.
fn plus(x: [f64; 3], y: [f64; 3], w: f64) -> [f64; 3] {
    [x[0] + y[0] * w, x[1] + y[1] * w, x[2] + y[2] * w]
}

/// The sum of magnitudes.
fn sum([x, y, z]: [f64; 3]) -> f64 {
    (x.abs() + y.abs()) + z.abs()
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
