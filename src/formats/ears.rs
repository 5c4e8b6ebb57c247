//! Triangles of one polygon: its fan, or where a triangle of that turns against the polygon's normal, its ears (Meisters 1975).
//!
//! A polygon is looked at along the axis that its normal is nearest to: of a plane that is a map that keeps which way a
//! triangle turns, and it takes no arithmetic, so that nothing is rounded. Which way three corners turn is decided exactly
//! (Shewchuk 1997).
//!
//! **Why this is right.** To cut corner b off between its neighbours a and c takes the triangle abc away from the outline, so
//! whichever corners are cut, in whatever order, the triangles' signed areas add up to the winding number of the outline
//! at every point. Where no triangle turns against the normal, they therefore cover each point as often as the outline goes
//! round it: a polygon that does not cross itself exactly once, inside, and nothing outside. A fan is such a series of
//! cuts, too; all its triangles are right where the polygon is convex, and where it is seen whole from its first corner.
//! So it suffices to look at the signs. Which ear is cut next decides only whether all ears come out right.
//!
//! A polygon of n corners always becomes n - 2 triangles, and each corner is in one of them; where corners repeat, as in
//! an edge that bridges the way to a hole, or lie in one line, some may be without area.

use std::collections::VecDeque;

use robust::{Coord, orient2d};

use super::obstacles::Obstacles;

/// What a polygon becomes.
pub(super) struct Outcome {
    pub triangles: Cut,
    /// Whether some triangles turn against the normal whatever is cut: the outline crosses itself.
    pub crossed: bool,
}

/// The triangles of a polygon.
pub(super) enum Cut {
    /// Corner 0 with each edge in order.
    Fan,
    /// Places among the corners.
    Ears(Vec<[u32; 3]>),
}

/// Cuts polygons, one after the other.
#[derive(Default)]
pub(super) struct Cutter {
    points: Vec<Coord<f64>>,
}

impl Cutter {
    /// Cuts a polygon of at least three corners, which are finite. Work is at most proportional to their number.
    pub(super) fn cut(&mut self, corners: &[[f64; 3]]) -> Outcome {
        let has_normal = project(corners, &mut self.points);
        let points = &self.points;
        let fan = turned((1..points.len() as u32 - 1).map(|k| [0, k, k + 1]), points);
        if fan == 0.0 || !has_normal {
            return Outcome { triangles: Cut::Fan, crossed: fan > noise(points) };
        }
        let ears = Ears::new(points).cut();
        let left = turned(ears.iter().copied(), points);
        let triangles = if left < fan { Cut::Ears(ears) } else { Cut::Fan };
        Outcome { triangles, crossed: left.min(fan) > noise(points) }
    }
}

/// The corners as seen along the axis that the polygon's normal is nearest to, from the side where they go round counter-clockwise.
/// Returns whether there is such a side: not where all corners are in one line, or the outline goes round as much to the left as to the right.
fn project(corners: &[[f64; 3]], points: &mut Vec<Coord<f64>>) -> bool {
    let most = corners.iter().flatten().fold(0.0, |most: f64, x| most.max(x.abs()));
    let scale = inverse_power(most);
    let scaled = |p: &[f64; 3]| p.map(|x| x * scale);
    let origin = scaled(&corners[0]);
    let from_origin = |p: &[f64; 3]| {
        let p = scaled(p);
        [p[0] - origin[0], p[1] - origin[1], p[2] - origin[2]]
    };
    // Newell's normal (Sutherland et al. 1974), and the sizes of what it is the sum of.
    let (mut normal, mut sizes) = ([0.0; 3], [0.0; 3]);
    for pair in corners.windows(2) {
        let [u, v] = [from_origin(&pair[0]), from_origin(&pair[1])];
        for k in 0..3 {
            let (i, j) = ((k + 1) % 3, (k + 2) % 3);
            normal[k] += u[i] * v[j] - u[j] * v[i];
            sizes[k] += (u[i] * v[j]).abs() + (u[j] * v[i]).abs();
        }
    }
    let axis = |of: &[f64; 3]| (1..3).fold(0, |best, k| if of[k].abs() > of[best].abs() { k } else { best });
    let mut up = axis(&normal);
    let size = sizes[axis(&sizes)];
    // What the sums may be wrong by, and more.
    let has_normal = normal[up].abs() > size * corners.len() as f64 * f64::EPSILON;
    if !has_normal {
        up = axis(&sizes);
    }
    let (x, y) = if normal[up] < 0.0 { ((up + 2) % 3, (up + 1) % 3) } else { ((up + 1) % 3, (up + 2) % 3) };
    points.clear();
    points.extend(corners.iter().map(scaled).map(|p| Coord { x: p[x], y: p[y] }));
    has_normal
}

/// A power of two by which numbers up to `most` become about 1 or smaller, so that no product is infinite; to multiply by it rounds
/// nothing but what is far below the smallest of the others.
fn inverse_power(most: f64) -> f64 {
    let exponent = (most.to_bits() >> 52) as i64 - 1023;
    f64::from_bits(((1023 - exponent.clamp(-1000, 1000)) as u64) << 52)
}

/// Twice the area of the triangles that turn clockwise.
fn turned(triangles: impl Iterator<Item = [u32; 3]>, points: &[Coord<f64>]) -> f64 {
    triangles
        .map(|triangle| {
            let [a, b, c] = triangle.map(|k| points[k as usize]);
            (-orient2d(a, b, c)).max(0.0)
        })
        .sum()
}

/// An area that is not worth a word: that of corners rounded to 20 bits.
fn noise(points: &[Coord<f64>]) -> f64 {
    let (mut min, mut max) = (points[0], points[0]);
    for p in points {
        min = Coord { x: min.x.min(p.x), y: min.y.min(p.y) };
        max = Coord { x: max.x.max(p.x), y: max.y.max(p.y) };
    }
    let side = (max.x - min.x).max(max.y - min.y);
    side * side / f64::from(1 << 20)
}

/// A polygon that goes round counter-clockwise, as its ears are cut.
struct Ears<'a> {
    points: &'a [Coord<f64>],
    /// Neighbours of the corners that are left.
    previous: Vec<u32>,
    next: Vec<u32>,
    left: usize,
    is_left: Vec<bool>,
    /// Corners that may be ears.
    queue: VecDeque<u32>,
    queued: Vec<bool>,
    /// Corners that are not convex: only they can lie in an ear.
    obstacles: Obstacles<'a>,
    triangles: Vec<[u32; 3]>,
    /// Units of work that may still be done.
    work: u64,
}

impl<'a> Ears<'a> {
    fn new(points: &'a [Coord<f64>]) -> Self {
        let n = points.len() as u32;
        let mut ears = Self {
            points,
            previous: (0..n).map(|k| (k + n - 1) % n).collect(),
            next: (0..n).map(|k| (k + 1) % n).collect(),
            left: points.len(),
            is_left: vec![true; points.len()],
            queue: VecDeque::with_capacity(points.len()),
            queued: vec![false; points.len()],
            obstacles: Obstacles::new(points),
            triangles: Vec::with_capacity(points.len() - 2),
            work: WORK + WORK_A_CORNER * u64::from(n),
        };
        (0..n).for_each(|k| ears.look_at(k));
        ears
    }

    fn cut(mut self) -> Vec<[u32; 3]> {
        let mut idle = false;
        while self.left > 3 && self.work > 0 {
            match self.queue.pop_front() {
                Some(corner) => {
                    self.queued[corner as usize] = false;
                    if self.is_left[corner as usize] && self.is_ear(corner) {
                        self.cut_off(corner);
                        idle = false;
                    }
                }
                // To cut an ear changes what its neighbours are, and nothing else where the outline does not touch itself;
                // where it does, others may have become ears.
                None if !idle => {
                    idle = true;
                    self.work = self.work.saturating_sub(self.points.len() as u64);
                    self.corners().for_each(|corner| self.enqueue(corner));
                }
                None => {
                    if let Some(corner) = self.least() {
                        self.cut_off(corner);
                    }
                    idle = false;
                }
            }
        }
        // What is left is a triangle, or more than there is time for.
        if let Some(first) = self.corners().next() {
            (2..self.left).for_each(|_| self.cut_off(self.next[first as usize]));
        }
        self.triangles
    }

    /// The corners that are left, in their order in the file.
    fn corners(&self) -> std::vec::IntoIter<u32> {
        let left = (0..).zip(&self.is_left).filter(|(_, left)| **left).map(|(k, _)| k);
        left.collect::<Vec<u32>>().into_iter()
    }

    fn around(&self, corner: u32) -> [u32; 3] {
        [self.previous[corner as usize], corner, self.next[corner as usize]]
    }

    fn places(&self, corners: [u32; 3]) -> [Coord<f64>; 3] {
        corners.map(|k| self.points[k as usize])
    }

    /// Whether a corner can be cut off: its triangle is inside and the line to be cut along touches no other corner. Nothing is
    /// cut off where corners repeat, and where the outline goes there and back again outside; inside, it is the tip of a
    /// wall that the triangles beside it must meet.
    fn is_ear(&mut self, corner: u32) -> bool {
        let around = self.around(corner);
        let triangle @ [a, b, c] = self.places(around);
        let turn = orient2d(a, b, c);
        if turn <= 0.0 {
            let back = (a.x - b.x) * (c.x - b.x) + (a.y - b.y) * (c.y - b.y) >= 0.0;
            return turn == 0.0 && back && (a == b || b == c || self.is_outside(corner));
        }
        let (points, previous, next) = (self.points, &self.previous, &self.next);
        let blocks = |k: u32| {
            let neighbours = [previous[k as usize], next[k as usize]].map(|k| points[k as usize]);
            !around.contains(&k) && is_in_the_way(triangle, points[k as usize], neighbours)
        };
        !self.obstacles.any(triangle, blocks, &mut self.work)
    }

    /// Whether the outline, without the edges at a corner, does not go round it, or comes by there.
    fn is_outside(&mut self, corner: u32) -> bool {
        self.work = self.work.saturating_sub(self.left as u64);
        let b = self.points[corner as usize];
        let (mut rounds, mut k) = (0i64, self.next[corner as usize]);
        while k != self.previous[corner as usize] {
            let next = self.next[k as usize];
            let (from, to) = (self.points[k as usize], self.points[next as usize]);
            let side = orient2d(from, to, b);
            let between = |from: f64, x: f64, to: f64| from.min(to) <= x && x <= from.max(to);
            if side == 0.0 && between(from.x, b.x, to.x) && between(from.y, b.y, to.y) {
                return true;
            }
            rounds += i64::from(from.y <= b.y && to.y > b.y && side > 0.0);
            rounds -= i64::from(from.y > b.y && to.y <= b.y && side < 0.0);
            k = next;
        }
        rounds == 0
    }

    /// Cuts a corner off, and looks at its neighbours anew.
    fn cut_off(&mut self, corner: u32) {
        let [a, b, c] = self.around(corner);
        self.triangles.push([a, b, c]);
        self.next[a as usize] = c;
        self.previous[c as usize] = a;
        self.is_left[b as usize] = false;
        self.left -= 1;
        self.obstacles.set(b, false);
        self.look_at(a);
        self.look_at(c);
    }

    /// Takes note of a corner that is new, or has a new neighbour. Where the outline turns back comes first: before an edge that leads
    /// nowhere is gone, its other end looks like an ear.
    fn look_at(&mut self, corner: u32) {
        let [a, b, c] = self.places(self.around(corner));
        let turn = orient2d(a, b, c);
        self.obstacles.set(corner, turn <= 0.0);
        if turn == 0.0 {
            self.queue.push_front(corner);
        } else {
            self.enqueue(corner);
        }
    }

    fn enqueue(&mut self, corner: u32) {
        if !std::mem::replace(&mut self.queued[corner as usize], true) {
            self.queue.push_back(corner);
        }
    }

    /// Where there is no ear: the corner that does the least harm.
    fn least(&mut self) -> Option<u32> {
        let corners = self.corners();
        let area = |k: u32| {
            let [a, b, c] = self.places(self.around(k));
            orient2d(a, b, c).abs()
        };
        let least = corners.map(|k| (area(k), k)).min_by(|x, y| x.0.total_cmp(&y.0));
        self.work = self.work.saturating_sub(self.points.len() as u64);
        least.map(|(_, corner)| corner)
    }
}

/// Whether corner p, which is not convex, keeps the triangle abc from being an ear: where it lies inside or on the line to be cut
/// along; on the outline, which touches itself there, if it goes on into the inside from p to one of its neighbours.
fn is_in_the_way([a, b, c]: [Coord<f64>; 3], p: Coord<f64>, neighbours: [Coord<f64>; 2]) -> bool {
    let sides = [(a, b), (b, c), (c, a)].map(|(from, to)| (from, to, orient2d(from, to, p)));
    if sides.iter().any(|side| side.2 < 0.0) {
        return false;
    }
    let [ab, bc, ca] = sides.map(|side| side.2 == 0.0);
    let enters = |q: &Coord<f64>| {
        sides.iter().filter(|side| side.2 == 0.0).all(|&(from, to, _)| orient2d(from, to, *q) > 0.0)
    };
    ca && !ab && !bc || neighbours.iter().any(enters)
}

/// Units of work for a polygon, and for each of its corners: a box or a corner looked at. Outlines of 100,000 corners that nobody made
/// to annoy take less than a hundredth of it.
const WORK: u64 = 1 << 16;
const WORK_A_CORNER: u64 = 1 << 10;
