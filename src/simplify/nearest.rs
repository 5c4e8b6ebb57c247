//! The nearest point of the input, looked for from near by.

use super::frame::Places;
use crate::mesh::distance::point_triangle_distance_squared;
use crate::mesh::{Corner, CornerTable, Triangle, Vertex};
use glam::DVec3;

/// The squared distance of the farthest of some points of a level's triangle from the input; `known` are vertices of the input near by, of which
/// a few are asked.
/// Points lie on the triangle's edges and inside; where they are nearly as far off as `most` (squared), there are more of them.
pub fn farthest_of_triangle(
    input: &CornerTable,
    places: &Places,
    corners: [Vertex; 3],
    known: &[Vertex],
    most: f32,
) -> f32 {
    let [a, b, c] = corners.map(|v| places.at(v));
    let at = |u: f64, v: f64| a + (b - a) * u + (c - a) * v;
    let mut last = input.corner_of(corners[0]).triangle();
    let enough = CLOSE * f64::from(most);
    let step = known.len().div_ceil(ASKED).max(1);
    let mut measure = |u: f64, v: f64| {
        let p = at(u, v);
        let mut found = descend(input, places, p, last, enough);
        if found.0 > enough {
            let apart = |v: &Vertex| places.at(*v).distance_squared(p);
            let near =
                corners.iter().chain(known.iter().step_by(step)).min_by(|v, w| apart(v).total_cmp(&apart(w)));
            let start = near.map_or(last, |&v| input.corner_of(v).triangle());
            let other = descend(input, places, p, start, enough);
            found = if other.0 < found.0 { other } else { found };
        }
        // What would be the farthest of all is looked for from all sides: from the nearest vertex the way may end before a notch of the
        // boundary.
        if found.0 > f64::from(most) {
            for &v in corners.iter().chain(known.iter().step_by(known.len().div_ceil(SIDES).max(1))) {
                let other = descend(input, places, p, input.corner_of(v).triangle(), enough);
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
        // The corners are vertices of the input.
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
    best.0 as f32
}

/// The squared distance of a point from a triangle of the input, and that triangle: from `start` on to neighbours as long as one is nearer,
/// and until one is near `enough`. So it is never less than the distance from the input.
fn descend(input: &CornerTable, places: &Places, p: DVec3, start: Triangle, enough: f64) -> (f64, Triangle) {
    let mut best = (f64::INFINITY, start);
    let mut look = |t: Triangle| {
        let [a, b, c] = input.triangle(t).map(|v| places.at(v));
        let squared = point_triangle_distance_squared(p, a, b, c);
        if squared < best.0 {
            best = (squared, t);
        }
        best
    };
    let (mut at, mut next) = (start, look(start));
    for _ in 0..STEPS {
        for corner in at.corners() {
            let mut c = input.swing(corner);
            let mut left = FAN;
            while c.is_some() && c != corner && left > 0 && next.0 > enough {
                next = look(c.triangle());
                c = input.swing(c);
                left -= 1;
            }
            // Past a boundary, or far round a vertex of many triangles, the other way round.
            let mut c = if c == corner { Corner::NONE } else { swing_back(input, corner) };
            left = FAN;
            while c.is_some() && left > 0 && next.0 > enough {
                next = look(c.triangle());
                c = swing_back(input, c);
                left -= 1;
            }
        }
        if next.1 == at || next.0 <= enough {
            break;
        }
        at = next.1;
    }
    next
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
/// Triangles looked at round a corner, each way.
const FAN: u32 = 32;
/// Triangles on the way to the nearest.
const STEPS: u32 = 256;
