//! The nearest point of the input, looked for from near by.

use super::bodies::Bodies;
use super::frame::Places;
use crate::mesh::distance::point_triangle_distance_squared;
use crate::mesh::{Corner, CornerTable, Triangle, Vertex};
use glam::DVec3;

/// Where the nearest point of the input is looked for from.
#[derive(Clone, Copy, Debug)]
pub struct Near<'a, T> {
    /// The input.
    pub input: &'a CornerTable,
    /// Its vertices.
    pub places: &'a Places<'a, T>,
    /// Which of them are of which body.
    pub bodies: &'a Bodies,
    /// The corners of a level's triangle.
    pub corners: [Vertex; 3],
    /// Vertices near by, of which a few are asked.
    pub met: &'a [Vertex],
}

/// The squared distance of the farthest of some points of a level's triangle from the input, but for its corners, which are at most as far
/// off as they have moved. Points lie on the triangle's edges and inside; where they are nearly as far off as `most` (squared), there are
/// more of them.
pub fn farthest_of_triangle<T: Copy + Into<f64>>(near: &Near<T>, triangle: [DVec3; 3], most: f32) -> f32 {
    let mut found = farthest_point(near, triangle, most, &[]);
    // What would be the farthest of all may only have been looked for in the wrong place: all of the input is asked for a better one.
    let mut starts = Vec::new();
    while found.0 > f64::from(most) && starts.len() < STARTS {
        starts.push(near.closest(found.1));
        let again = farthest_point(near, triangle, most, &starts);
        if again.0 >= found.0 {
            break;
        }
        found = again;
    }
    found.0 as f32
}

impl<T: Copy + Into<f64>> Near<'_, T> {
    /// A vertex of the triangle's body near a point: the nearest of some from all over.
    fn closest(&self, p: DVec3) -> Vertex {
        let body = self.bodies.around(self.corners[0], self.places.positions.len());
        let vertices = body.some(ALL_OVER);
        let apart = |v: Vertex| self.places.at(v).distance_squared(p);
        let there = vertices.filter(|&v| self.input.corner_of(v).is_some()).map(|v| (apart(v), v));
        there.min_by(|x, y| x.0.total_cmp(&y.0)).map_or(self.corners[0], |(_, v)| v)
    }
}

/// The farthest of some points, squared, and which it is; also looked for from some more vertices.
fn farthest_point<T: Copy + Into<f64>>(
    &Near { input, places, bodies: _, corners, met: known }: &Near<T>,
    [a, b, c]: [DVec3; 3],
    most: f32,
    starts: &[Vertex],
) -> (f64, DVec3) {
    let at = |u: f64, v: f64| a + (b - a) * u + (c - a) * v;
    let mut last = input.corner_of(corners[0]).triangle();
    let enough = CLOSE * f64::from(most);
    let step = known.len().div_ceil(ASKED).max(1);
    let mut descents = Descents::new(input, places, enough);
    let mut measure = |u: f64, v: f64| {
        let p = at(u, v);
        descents.aim(p);
        let mut found = descents.from(last);
        if found.0 > enough {
            let apart = |v: &Vertex| places.at(*v).distance_squared(p);
            let near =
                corners.iter().chain(known.iter().step_by(step)).min_by(|v, w| apart(v).total_cmp(&apart(w)));
            let start = near.map_or(last, |&v| input.corner_of(v).triangle());
            let other = descents.from(start);
            found = if other.0 < found.0 { other } else { found };
        }
        // What would be the farthest of all is looked for from all sides: from the nearest vertex the way may end before a notch of the
        // boundary.
        if found.0 > f64::from(most) {
            let sides = known.iter().step_by(known.len().div_ceil(SIDES).max(1));
            for &v in starts.iter().chain(&corners).chain(sides) {
                let other = descents.from(input.corner_of(v).triangle());
                found = if other.0 < found.0 { other } else { found };
            }
        }
        last = found.1;
        found.0
    };
    let mut best = (0.0, 0.0, 0.0);
    let part = 1.0 / f64::from(GRID);
    for (i, j) in (0..=GRID).flat_map(|i| (0..=GRID - i).map(move |j| (i, j))) {
        let (u, v) = (f64::from(i) * part, f64::from(j) * part);
        let corner = [i, j, GRID - i - j].contains(&GRID);
        let squared = if corner { 0.0 } else { measure(u, v) };
        if squared > best.0 {
            best = (squared, u, v);
        }
    }
    let mut step = 0.5 * part;
    for _ in 0..CLIMBS {
        if best.0 <= enough {
            break;
        }
        let (_, u, v) = best;
        for (du, dv) in [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0), (1.0, -1.0), (-1.0, 1.0)] {
            let (u, v) = (u + du * step, v + dv * step);
            if u >= 0.0 && v >= 0.0 && u + v <= 1.0 {
                let squared = measure(u, v);
                if squared > best.0 {
                    best = (squared, u, v);
                }
            }
        }
        step *= 0.5;
    }
    (best.0, at(best.1, best.2))
}

/// Ways to the triangle of the input that is nearest to a point, with what those before have met.
struct Descents<'a, T> {
    input: &'a CornerTable,
    places: &'a Places<'a, T>,
    enough: f64,
    point: DVec3,
    /// How many points there have been.
    number: u32,
    met: [Met; MET],
    /// Whether a way to this point was given up.
    is_cut_short: bool,
}

/// A triangle met on the way to a point.
#[derive(Clone, Copy, Debug)]
struct Met {
    /// The number of the point; 0 of none.
    point: u32,
    triangle: Triangle,
    /// Whether a way has led on from here.
    is_left: bool,
    squared: f64,
}

impl<'a, T: Copy + Into<f64>> Descents<'a, T> {
    fn new(input: &'a CornerTable, places: &'a Places<'a, T>, enough: f64) -> Self {
        let none = Met { point: 0, triangle: Triangle::NONE, is_left: false, squared: 0.0 };
        Self { input, places, enough, point: DVec3::ZERO, number: 0, met: [none; MET], is_cut_short: false }
    }

    /// A new point.
    fn aim(&mut self, point: DVec3) {
        (self.point, self.is_cut_short) = (point, false);
        self.number += 1;
    }

    /// The squared distance of the point from a triangle of the input, and that triangle: from `start` on to neighbours as long as one is
    /// nearer, and until one is near enough. So it is never less than the distance from the input. Where an earlier way to this point has gone
    /// on from the same triangle, it has found as much, and nothing is found.
    fn from(&mut self, start: Triangle) -> (f64, Triangle) {
        let input = self.input;
        let (mut at, mut next) = (start, (self.squared(start), start));
        let mut look = |this: &mut Self, c: Corner| {
            let squared = this.squared(c.triangle());
            if squared < next.0 {
                next = (squared, c.triangle());
            }
            next
        };
        for _ in 0..STEPS {
            let met = self.met(at);
            if std::mem::replace(&mut met.is_left, true) && !self.is_cut_short {
                return (f64::INFINITY, start);
            }
            let mut least = look(self, at.corner(0));
            for corner in at.corners() {
                let mut c = input.swing(corner);
                let mut left = FAN;
                while c.is_some() && c != corner && left > 0 && least.0 > self.enough {
                    least = look(self, c);
                    c = input.swing(c);
                    left -= 1;
                }
                // Past a boundary, or far round a vertex of many triangles, the other way round.
                let mut c = if c == corner { Corner::NONE } else { swing_back(input, corner) };
                left = FAN;
                while c.is_some() && left > 0 && least.0 > self.enough {
                    least = look(self, c);
                    c = swing_back(input, c);
                    left -= 1;
                }
            }
            if least.1 == at || least.0 <= self.enough {
                return least;
            }
            at = least.1;
        }
        self.is_cut_short = true;
        next
    }

    fn squared(&mut self, t: Triangle) -> f64 {
        self.met(t).squared
    }

    /// What is known of a triangle, of this point.
    #[inline]
    fn met(&mut self, t: Triangle) -> &mut Met {
        let met = &mut self.met[t.index() % MET];
        if met.triangle != t || met.point != self.number {
            let [a, b, c] = self.input.triangle(t).map(|v| self.places.at(v));
            let squared = point_triangle_distance_squared(self.point, a, b, c);
            *met = Met { point: self.number, triangle: t, is_left: false, squared };
        }
        met
    }
}

/// The next corner at the same vertex, clockwise.
fn swing_back(input: &CornerTable, c: Corner) -> Corner {
    let beyond = input.opposite(c.prev());
    if beyond.is_some() { beyond.prev() } else { Corner::NONE }
}

/// Parts of an edge between the points of a triangle.
const GRID: u32 = 6;
/// How often the farthest point is looked for anew round the one known, each time at half the distance.
const CLIMBS: u32 = 4;
/// Share of the largest squared distance from which on it is worth it.
const CLOSE: f64 = 0.5;
/// Vertices near by from which the nearest triangle is looked for, at most: the way there is short from any of them.
const ASKED: usize = 64;
/// How many of them are asked where it matters most.
const SIDES: usize = 8;
/// Vertices of the whole input of which the nearest is looked for.
const ALL_OVER: usize = 16_384;
/// How often that is done for a triangle.
const STARTS: usize = 3;
/// Triangles looked at round a corner, each way.
const FAN: u32 = 32;
/// Triangles that are remembered on the way, if all goes well.
const MET: usize = 128;
/// Triangles on the way to the nearest.
const STEPS: u32 = 256;

#[cfg(test)]
mod tests {
    use super::super::frame::Frame;
    use super::*;
    use crate::mesh::Lattice;

    /// A strip that runs along x, turns and runs back two higher: from the lower arm no way over nearer and nearer triangles leads to the
    /// upper one, below which the triangle is.
    #[test]
    fn the_other_arm_is_found() {
        let along = |k: u32| if k <= 10 { [f64::from(k), 0.0] } else { [f64::from(21 - k), 2.0] };
        let corner = |i: u32| [along(i / 2)[0], f64::from(i % 2), along(i / 2)[1]];
        let positions: Vec<_> = (0..44).map(corner).collect();
        let strip: Vec<_> =
            (0..42).map(|k| if k % 2 == 0 { [k, k + 2, k + 1] } else { [k, k + 1, k + 2] }).collect();
        let input = CornerTable::from_triangles(44, &strip).unwrap();
        let lattice = Lattice { origin: [0.0; 3], step: 1.0 / 1023.0, bits: 10 };
        let places = Places { positions: &positions, frame: Frame::new(&lattice) };
        let bodies = Bodies::default();
        let near = Near {
            input: &input,
            places: &places,
            bodies: &bodies,
            corners: [2, 4, 3].map(Vertex),
            met: &[],
        };
        for (height, far) in [(1.9, 0.1), (0.2, 0.2)] {
            let triangle = [[1.0, 0.0], [2.0, 0.0], [1.0, 1.0]].map(|[x, y]| DVec3::new(x, y, height));
            let found = farthest_of_triangle(&near, triangle, 0.01).sqrt();
            assert!((found - far).abs() < 1e-6, "{height}: {found}");
        }
    }

    /// A square of height 0, and another body that lies where the level of the first one has its triangle, far above.
    #[test]
    fn what_lies_where_the_level_is_and_is_another_body_is_not_near() {
        let square =
            |height: f64| [[0.0, 0.0], [9.0, 0.0], [9.0, 9.0], [0.0, 9.0]].map(|[x, y]| [x, y, height]);
        let positions = [square(0.0), square(3.0)].concat();
        let input = CornerTable::from_triangles(8, &[[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]]).unwrap();
        let lattice = Lattice { origin: [0.0; 3], step: 1.0 / 1023.0, bits: 10 };
        let places = Places { positions: &positions, frame: Frame::new(&lattice) };
        let triangle = [[1.0, 1.0], [8.0, 1.0], [8.0, 8.0]].map(|[x, y]| DVec3::new(x, y, 3.0));
        let far = |bodies: &Bodies, corners: [u32; 3]| {
            let near =
                Near { input: &input, places: &places, bodies, corners: corners.map(Vertex), met: &[] };
            farthest_of_triangle(&near, triangle, 0.01).sqrt()
        };
        let apart = Bodies::new(vec![0, 0, 0, 0, 1, 1, 1, 1]);
        assert!((far(&apart, [0, 1, 2]) - 3.0).abs() < 1e-6);
        assert!(far(&apart, [4, 5, 6]) < 1e-6);
        assert!(far(&Bodies::default(), [0, 1, 2]) < 1e-6);
    }
}
