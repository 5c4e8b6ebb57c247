//! What a value is expected to be, from the values and positions round it (spec §13.4).

use super::column::Column;
use super::numbers::{Integers, MOST, Numbers, Scale};
use super::ring::Ring;
use super::values::Around;
use crate::codec::vector::{Four, Vector, floor, truncate};
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

    /// The best of all ways.
    fn best(&self) -> usize {
        (0..WAYS).min_by_key(|&way| self.costs[way]).unwrap_or(0)
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

/// Guesses the value of a wedge, round which is `ring`, which knows this column; `before` is the wedge before it at its vertex. `guess` has
/// what was guessed before.
#[inline]
pub(super) fn guess(
    guess: &mut Guess,
    memory: &mut Memory,
    around: &Around,
    column: &Column,
    ring: &mut Ring,
    before: Option<u32>,
) {
    let n = column.integers();
    guess.ways.clear();
    guess.sources = 0;
    let near = match ring.wedges().next() {
        Some(wedge) => column.there(wedge),
        None => before.and_then(|before| column.value(before)).unwrap_or(&memory.last[..n]),
    };
    copy(near, &mut guess.value);
    for spread in guess.spread.iter_mut().take(n) {
        *spread = 0;
    }
    // What is on a lattice or an integer may be of any length; a surface tells directions alone.
    let is_direction =
        matches!(column.kind.quantisation, Quantisation::Octahedral { .. } | Quantisation::Raw);
    match column.kind.semantic {
        Semantic::Joints | Semantic::Part => {}
        Semantic::Normal if is_direction => normal(guess, memory, column, ring),
        _ => {
            let scale = Scale::of(&column.kind);
            let is_fitted = match (scale, n) {
                (Scale::Same, 1) => fitted::<1>(guess, column, ring),
                (Scale::Same, 2) => fitted::<2>(guess, column, ring),
                (Scale::Same, 3) => fitted::<3>(guess, column, ring),
                (Scale::Same, 4) => fitted::<4>(guess, column, ring),
                _ => fitted_numbers(guess, scale, column, ring),
            };
            if !is_fitted {
                linear(guess, memory, around, column, ring);
            }
        }
    }
}

/// Copies a value. Nearly all have few integers, and a call to copy these would take longer.
#[inline]
pub(super) fn copy(from: &[i32], to: &mut Integers) {
    match *from {
        [a] => to[0] = a,
        [a, b] => (to[0], to[1]) = (a, b),
        [a, b, c] => (to[0], to[1], to[2]) = (a, b, c),
        _ => to[..from.len()].copy_from_slice(from),
    }
}

/// What differences that a map tells are kept below, in magnitude.
const FAR: f32 = (1u32 << 30) as f32;

/// As a linear map fitted to neighbours has it, of N integers, four at most: `guess` has the value of the first.
#[inline]
fn fitted<const N: usize>(guess: &mut Guess, column: &Column, ring: &mut Ring) -> bool {
    let first: [i32; N] = std::array::from_fn(|k| guess.value[k]);
    let Some(shares) = ring.shares() else { return false };
    let nothing = Four::of(0.0);
    let (mut sum, mut low, mut high) = (nothing, nothing, nothing);
    for (wedge, share) in shares {
        let Some(value) = column.there(wedge).first_chunk::<N>() else { continue };
        let mut off = [0; 4];
        for (off, (x, first)) in off.iter_mut().zip(value.iter().zip(&first)) {
            *off = x.wrapping_sub(*first);
        }
        let off = Four::of_integers(off);
        sum = sum + off * Four::of(share);
        (low, high) = (low.min(off), high.max(off));
    }
    guess.sources = 2;
    let (sum, spread) = ((sum + Four::of(0.5)).floats(), ((high - low) * Four::of(0.125)).truncated());
    for (k, first) in first.into_iter().enumerate() {
        let off = if sum[k].abs() < FAR { floor(sum[k]) } else { 0 };
        guess.value[k] = first.wrapping_add(off);
        guess.spread[k] = spread[k] as u32;
    }
    true
}

/// The same of any numbers.
#[cold]
fn fitted_numbers(guess: &mut Guess, scale: Scale, column: &Column, ring: &mut Ring) -> bool {
    let Some(shares) = ring.shares() else { return false };
    let mut mean = Mean::new();
    for (wedge, share) in shares {
        let numbers = scale.numbers(column.there(wedge));
        mean.add(numbers, share.into());
    }
    guess.sources = 2;
    for k in 0..scale.components(column.integers()) {
        scale.round(k, mean.sum[k], &mut guess.value);
        guess.spread[k] = ((mean.high[k] - mean.low[k]) * 0.125) as u32;
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

    fn add(&mut self, x: Numbers, share: f64) {
        for (k, x) in x.into_iter().enumerate() {
            self.sum[k] += x * share;
            (self.low[k], self.high[k]) = (self.low[k].min(x), self.high[k].max(x));
        }
        self.count += 1.0;
    }

    fn mean(&self, k: usize) -> f64 {
        self.sum[k] / self.count
    }
}

/// As the surface goes on beyond triangles two of whose corners are known, or as neighbours are.
#[cold]
fn linear(guess: &mut Guess, memory: &mut Memory, around: &Around, column: &Column, ring: &Ring) {
    let scale = Scale::of(&column.kind);
    let components = scale.components(column.kind.integers());
    let is_map = column.kind.semantic == Semantic::TexCoord && components == 2;
    let (mut beyond, mut mapped, mut near) = (Mean::new(), Mean::new(), Mean::new());
    for &c in ring.looked_at() {
        let [a, b] = [c.next(), c.prev()].map(|c| around.value(column, c));
        [a, b].into_iter().flatten().for_each(|x| near.add(scale.numbers(x), 1.0));
        let (Some(n), Some(p)) = (a, b) else { continue };
        let (a, b) = (scale.numbers(n), scale.numbers(p));
        let far = around.far(column, c, n, p).map(|far| scale.numbers(far));
        if is_map && let Some(x) = similar(memory, around, c, a, b, far) {
            mapped.add(x, 1.0);
        }
        if let Some(far) = far {
            beyond.add(std::array::from_fn(|k| (a[k] + b[k]) - far[k]), 1.0);
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

/// The normals of the wedge's triangles, those of neighbours, or both, in the way that did best.
fn normal(guess: &mut Guess, memory: &mut Memory, column: &Column, ring: &mut Ring) {
    let Some(own) = normalised(by_angles(ring)) else { return };
    let near = normalised(near_normal(column, ring));
    let both = near.map(|near| own + near).filter(|both| sum(*both) > 0.0);
    let (Some(near), Some(both)) = (near, both) else {
        guess.sources = 1;
        round_normal(column, own, &mut guess.value);
        return;
    };
    guess.sources = 2;
    // As the surface is bent against the normals round it.
    let bend = (sum(own - near) * FLAT) as u32;
    guess.spread.iter_mut().take(column.integers()).for_each(|spread| *spread = bend);
    let ways: [Vector; WAYS] = [both, near, own, both + near * 2.0, both + own * 2.0];
    let best = memory.best();
    if memory.judges() {
        let start = guess.value;
        for way in ways {
            let mut value = start;
            round_normal(column, way, &mut value);
            guess.ways.push(value);
        }
        guess.value = guess.ways[best];
    } else {
        round_normal(column, ways[best], &mut guess.value);
    }
}

/// The normals of a wedge's triangles, each by its angle at the wedge.
fn by_angles(ring: &Ring) -> Vector {
    let nothing = Four::of(0.0);
    let mut total = [0.0; 3];
    ring.each_four(|x, y| {
        let z = x.cross(y);
        let length = z.dot(z).sqrt();
        // A triangle of no length counts for nothing: its normal, 0, is added, which changes no sum that began as 0.
        let weight = nothing.below(length, angles(length, x.dot(y)) / length, nothing);
        for (sum, parts) in total.iter_mut().zip((z * weight).coordinates()) {
            *sum = (((*sum + parts[0]) + parts[1]) + parts[2]) + parts[3];
        }
    });
    let [x, y, z] = total;
    Vector::new(x, y, z)
}

/// The angles whose tangents are y / x, y above 0, within a thousandth; in units of a quarter turn.
#[inline]
fn angles(y: Four, x: Four) -> Four {
    let b = x.abs();
    let t = y.min(b) / y.max(b);
    // A quarter turn times this is the arc tangent of t.
    let square = t * t;
    let arc = t * ((Four::of(0.6365) - Four::of(0.2078) * square) + Four::of(0.0713) * (square * square));
    let arc = y.below(b, arc, Four::of(1.0) - arc);
    x.below(Four::of(0.0), Four::of(2.0) - arc, arc)
}

/// The units of how far two directions are apart.
const FLAT: f32 = 4096.0;

/// A vector over the sum of its magnitudes; `None` where it has no direction.
#[inline]
fn normalised(v: Vector) -> Option<Vector> {
    let sum = sum(v);
    let over = 1.0 / sum;
    (sum < f32::INFINITY && over < f32::INFINITY).then(|| v * over)
}

/// A vector as the integers of a normal.
fn round_normal(column: &Column, vector: Vector, value: &mut Integers) {
    if let Quantisation::Octahedral { bits } = column.kind.quantisation {
        [value[0], value[1]] = near_octahedral(vector, quantise::radius(bits));
    } else {
        let length = vector.dot(vector).sqrt();
        for (k, x) in vector.coordinates().into_iter().enumerate() {
            Scale::of(&column.kind).round(k, (x / length).into(), value);
        }
    }
}

/// Octahedral coordinates of a direction near to that of a vector.
#[inline]
fn near_octahedral(vector: Vector, radius: i32) -> [i32; 2] {
    let r = radius as f32;
    let scale = r / sum(vector);
    // What is no number must not be cut: what comes of that is another thing on every machine.
    if !scale.is_finite() {
        return [0, 0];
    }
    let [x, y, z] = vector.coordinates();
    let (u, v) = (x * scale, y * scale);
    let folded = [(r - v.abs()).copysign(u), (r - u.abs()).copysign(v)];
    let q = if z < 0.0 { folded } else { [u, v] };
    // What is cut is above 0: to cut it is to round it down.
    quantise::canonical(q.map(|x| (truncate(x + (r + 0.5)) - radius).clamp(-radius, radius)), radius)
}

/// The normal that neighbours tell of.
fn near_normal(column: &Column, ring: &mut Ring) -> Vector {
    let mut near = Vector::default();
    let mut are_shared = false;
    if let Some(shares) = ring.shares() {
        are_shared = true;
        for (wedge, share) in shares {
            near = near + direction(column, wedge) * share;
        }
    }
    if !are_shared {
        for wedge in ring.wedges() {
            near = near + direction(column, wedge);
        }
    }
    near
}

/// The direction of a normal that is known.
#[inline(always)]
fn direction(column: &Column, wedge: u32) -> Vector {
    let value = column.there(wedge);
    if let Quantisation::Octahedral { bits } = column.kind.quantisation {
        let &[u, v] = value.first_chunk().unwrap_or(&[0; 2]);
        // All that have been told are within the radius.
        let w = quantise::radius(bits) - u.abs() - v.abs();
        let folded = w.min(0);
        let unfold = |x: i32| x + (x >> 31 | 1) * folded;
        return Vector::of_cell([unfold(u), unfold(v), w]);
    }
    let scale = Scale::of(&column.kind);
    let [x, y, z] = [0, 1, 2].map(|k| scale.number(value, k) as f32);
    Vector::new(x, y, z)
}

/// The sum of magnitudes.
#[inline]
fn sum(v: Vector) -> f32 {
    let [x, y, z] = v.coordinates();
    (x.abs() + y.abs()) + z.abs()
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
