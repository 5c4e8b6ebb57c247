//! How far the attributes of levels are from those of the input, at some points of its surface (spec §3.3).
//!
//! The points lie by the vertices by which the levels' positions are measured: in a triangle at each, or some of them, its corner there
//! having two thirds of the weight and the others a sixth each. Such points of all three corners of a triangle tell the mean of a quadratic
//! function on it exactly (Hammer, Marlowe, Stroud 1956), so that vertices at random tell means of squares without a bias.
//!
//! Each point is looked for from the triangle that covers its vertex: so it is found on its own side of a thin wall.

use super::difference::{Difference, Numbers};
use crate::codec::attributes::Truth;
use crate::container::{AttributeEntry, AttributeError};
use crate::mesh::attributes::{Domain, Semantic};
use crate::mesh::distance::{point_triangle_distance_squared, shares_of_nearest};
use crate::mesh::topology::Remainder;
use crate::mesh::{Corner, CornerTable, IndexedMesh, Triangle, Vertex};
use crate::refine::{Labels, ProgressiveMesh};
use crate::simplify::Fours;
use glam::DVec3;

/// Points of the input, and what its attributes are there.
#[derive(Debug)]
pub struct AttributeErrors {
    /// In the order of their vertices.
    points: Vec<Point>,
    /// By attribute, those of the points in order; empty where levels tell no errors of it.
    values: Vec<Vec<Option<Numbers>>>,
    /// By level, which triangles cover the vertices.
    probes: Vec<Fours>,
}

/// A point of the input.
#[derive(Clone, Copy, Debug)]
struct Point {
    /// The vertex it is near.
    vertex: Vertex,
    /// In steps of the lattice.
    at: DVec3,
    /// Of the surface, in squares of these.
    area: f64,
}

/// A level.
#[derive(Clone, Copy, Debug)]
pub struct LevelMesh<'a> {
    /// The mesh.
    pub mesh: &'a ProgressiveMesh,
    /// What its corners and triangles are labelled.
    pub labels: &'a Labels,
    /// What labels stand for.
    pub truth: &'a Truth,
    /// Its number.
    pub number: usize,
    /// Its root mean square error of positions, in steps of the lattice.
    pub rms: f64,
}

impl LevelMesh<'_> {
    /// What an attribute is at a point of a triangle that has such shares of its corners; `None` where one of them has no value.
    fn value(
        &self,
        attribute: usize,
        t: Triangle,
        shares: [f64; 3],
        difference: &Difference,
    ) -> Option<Numbers> {
        let number =
            |label: u32| self.truth.value(attribute, label).map(|integers| difference.of_integers(integers));
        match difference.domain() {
            Domain::Triangle => number(self.labels.of_triangle(t)),
            Domain::Corner => {
                let [a, b, c] = t.corners().map(|c| number(self.labels.of(c)));
                Some(difference.between(&[a?, b?, c?], shares))
            }
        }
    }

    /// Whether two triangles have other values at a vertex that they share, or are of other values themselves.
    fn are_apart(&self, t: Triangle, other: Triangle) -> bool {
        let table = &self.mesh.table;
        let differ = |c: Corner| {
            let same = other.corners().into_iter().find(|&d| table.vertex(d) == table.vertex(c));
            same.is_some_and(|d| self.labels.of(d) != self.labels.of(c))
        };
        self.labels.of_triangle(t) != self.labels.of_triangle(other) || t.corners().into_iter().any(differ)
    }
}

impl AttributeErrors {
    /// The points near the probes of a table that was made of the triangles of `input` that `remainder` says; its vertices are at
    /// `positions`. `probes` are those of each level.
    pub fn new(
        input: &IndexedMesh,
        entries: &[AttributeEntry],
        remainder: &Remainder,
        table: &CornerTable,
        positions: &[[i32; 3]],
        probes: Vec<Fours>,
    ) -> Self {
        let mut vertices: Vec<Vertex> =
            probes.iter().take(1).flat_map(Fours::iter).map(|[v, ..]| v).collect();
        vertices.sort_unstable();
        let at = |v: Vertex| DVec3::from_array(positions[v.index()].map(f64::from));
        let (mut points, mut corners) = (Vec::new(), Vec::new());
        let wanted = POINTS.div_ceil(vertices.len().max(1));
        for vertex in vertices {
            // Some of the triangles round it, for all of them.
            let round: Vec<Corner> = table.fan(vertex).collect();
            let taken = wanted.min(round.len());
            let first = vertex.0.wrapping_mul(0x9e37_79b1) as usize % round.len().max(1);
            let stands_for = round.len() as f64 / taken.max(1) as f64;
            for &c in round.iter().cycle().skip(first).take(taken) {
                let [p, q, r] = table.vertices_from(c).map(at);
                let area = (q - p).cross(r - p).length() * stands_for;
                let at = p * SHARES[0] + q * SHARES[1] + r * SHARES[2];
                points.push(Point { vertex, at, area });
                corners.push(c);
            }
        }
        // By triangle of the table that of the input.
        let origins: Vec<u32> = remainder.origins.in_table.iter_ones().map(|t| t as u32).collect();
        let values = entries.iter().zip(&input.attributes).map(|(entry, attribute)| {
            let difference = Difference::new(entry);
            let value = |&c: &Corner| {
                let t = c.triangle().index();
                let origin = origins[t] as usize;
                // Where a triangle was turned round, its last two corners changed places.
                let place = |k: usize| if remainder.flipped[t] { (3 - k) % 3 } else { k };
                let of = |k: usize| {
                    attribute.at(origin, place(k)).map(|value| difference.of_input(attribute, value))
                };
                let [a, b, c] = [c, c.next(), c.prev()].map(|c| of(c.place()));
                let corners = [a?, b?, c?];
                Some(if entry.domain == Domain::Triangle {
                    corners[0]
                } else {
                    difference.between(&corners, SHARES)
                })
            };
            if entry.has_level_errors() { corners.iter().map(value).collect() } else { Vec::new() }
        });
        Self { values: values.collect(), points, probes }
    }

    /// How far the attributes of a level are off.
    pub fn of_level(&self, entries: &[AttributeEntry], level: LevelMesh) -> Vec<AttributeError> {
        let number = level.number;
        let is_told = |k: &usize| entries[*k].birth as usize >= number && entries[*k].has_level_errors();
        let told: Vec<usize> = (0..entries.len()).filter(is_told).collect();
        if number == 0 || told.is_empty() {
            return Vec::new();
        }
        let mut found = vec![Vec::new(); told.len()];
        let stamps = vec![0; level.mesh.table.slots()];
        let mut search = Search { level, seen: Vec::new(), places: Vec::new(), stamps, stamp: 0 };
        for [vertex, a, b, _] in self.probes.get(number).into_iter().flat_map(Fours::iter) {
            let Some(start) = triangle_of(&level.mesh.table, [a, b]) else { continue };
            let first = self.points.partition_point(|point| point.vertex < vertex);
            let near =
                self.points[first..].iter().enumerate().take_while(|(_, point)| point.vertex == vertex);
            for (k, point) in near.map(|(k, point)| (first + k, point)) {
                let places = search.places(point.at, start);
                for (&attribute, found) in told.iter().zip(&mut found) {
                    let Some(value) = &self.values[attribute][k] else { continue };
                    let difference = Difference::new(&entries[attribute]);
                    let of = |&(t, shares): &(Triangle, [f64; 3])| {
                        let other = level.value(attribute, t, shares, &difference)?;
                        difference.of(value, &other)
                    };
                    if let Some(least) = places.iter().filter_map(of).min_by(f64::total_cmp) {
                        found.push((least, point.area));
                    }
                }
            }
        }
        let error = |(attribute, found): (usize, Vec<(f64, f64)>)| {
            let is_part = entries[attribute].semantic == Semantic::Part;
            let (error, high) = if is_part {
                (mean(&found), None)
            } else {
                (rms(&found).min(MOST), Some(high(found).min(MOST)))
            };
            AttributeError { attribute, error, high }
        };
        told.into_iter().zip(found).map(error).collect()
    }
}

/// The triangle of a level that covers a vertex.
fn triangle_of(table: &CornerTable, [a, b]: [Vertex; 2]) -> Option<Triangle> {
    let c = if a == b { table.corner_of(a) } else { table.find_directed_edge(a, b) };
    c.is_some().then(|| c.triangle())
}

/// Looks for the nearest points of a level; has room for them.
struct Search<'a> {
    level: LevelMesh<'a>,
    /// Triangles that have been looked at, and how far off they are, squared.
    seen: Vec<(Triangle, f64)>,
    places: Vec<(Triangle, [f64; 3])>,
    /// For which point each triangle has been looked at last.
    stamps: Vec<u32>,
    stamp: u32,
}

impl Search<'_> {
    /// The nearest point; and those of triangles beyond a seam there that are hardly farther. The way begins at `start`, and goes on as long as a
    /// triangle is nearer.
    fn places(&mut self, p: DVec3, start: Triangle) -> &[(Triangle, [f64; 3])] {
        self.seen.clear();
        self.stamp += 1;
        self.stamps[start.index()] = self.stamp;
        let mut nearest = self.measure(p, start);
        for _ in 0..STEPS {
            let closer = self.look_round(p, nearest);
            if closer.0 == nearest.0 {
                break;
            }
            nearest = closer;
        }
        let Self { level, seen, places, .. } = self;
        let (at, most) = (nearest.0, nearest.1.sqrt() + level.rms);
        places.clear();
        let near = seen.iter().filter(|&&(_, squared)| squared <= most * most).map(|&(t, _)| t);
        for t in
            std::iter::once(at).chain(near.filter(|&t| touch(level.mesh, at, t) && level.are_apart(at, t)))
        {
            if places.iter().all(|&(other, _)| other != t) {
                let [a, b, c] = corners(level.mesh, t);
                places.push((t, shares_of_nearest(p, a, b, c)));
            }
        }
        places
    }

    /// The nearest of a triangle, of which it is known how far off it is, and those that share a vertex with it.
    fn look_round(&mut self, p: DVec3, mut best: (Triangle, f64)) -> (Triangle, f64) {
        let LevelMesh { mesh, rms, .. } = self.level;
        let reach = |squared: f64| (squared.sqrt() + rms) * (squared.sqrt() + rms);
        let mut most = reach(best.1);
        for v in mesh.table.triangle(best.0) {
            for other in mesh.table.fan(v).take(FAN).map(|c| c.triangle()) {
                // None that has been seen is nearer, and what lies too far off to count, whatever is nearest in the end, need not be measured.
                let before = std::mem::replace(&mut self.stamps[other.index()], self.stamp);
                if before == self.stamp || self.is_beyond(p, other, most) {
                    continue;
                }
                let found = self.measure(p, other);
                if found.1 < best.1 {
                    best = found;
                    most = reach(best.1);
                }
            }
        }
        best
    }

    /// Whether the box of a triangle is farther off than that, squared.
    fn is_beyond(&self, p: DVec3, t: Triangle, squared: f64) -> bool {
        let [a, b, c] = corners(self.level.mesh, t);
        let off = (a.min(b).min(c) - p).max(p - a.max(b).max(c)).max(DVec3::ZERO);
        off.length_squared() > squared
    }

    fn measure(&mut self, p: DVec3, t: Triangle) -> (Triangle, f64) {
        let [a, b, c] = corners(self.level.mesh, t);
        let found = (t, point_triangle_distance_squared(p, a, b, c));
        self.seen.push(found);
        found
    }
}

/// Whether two triangles have a vertex in common.
fn touch(mesh: &ProgressiveMesh, t: Triangle, other: Triangle) -> bool {
    let round = mesh.table.triangle(other);
    mesh.table.triangle(t).iter().any(|v| round.contains(v))
}

fn corners(mesh: &ProgressiveMesh, t: Triangle) -> [DVec3; 3] {
    mesh.table.triangle(t).map(|v| DVec3::from_array(mesh.positions[v.index()].map(f64::from)))
}

/// The mean of some numbers by their weights; 0 where nothing has a weight.
fn mean(found: &[(f64, f64)]) -> f64 {
    let (sum, total) =
        found.iter().fold((0.0, 0.0), |(sum, total), (x, weight)| (sum + x * weight, total + weight));
    if total > 0.0 { sum / total } else { 0.0 }
}

/// Their root mean square.
fn rms(found: &[(f64, f64)]) -> f64 {
    let largest = found.iter().fold(0.0f64, |largest, &(x, _)| largest.max(x));
    if largest == 0.0 {
        return 0.0;
    }
    let squares: Vec<_> = found.iter().map(|&(x, weight)| (x / largest * (x / largest), weight)).collect();
    mean(&squares).sqrt() * largest
}

/// The least of them that all but a twentieth do not exceed.
fn high(mut found: Vec<(f64, f64)>) -> f64 {
    found.sort_by(|x, y| x.0.total_cmp(&y.0));
    let total: f64 = found.iter().map(|(_, weight)| weight).sum();
    let mut sum = 0.0;
    let reaches = |&(_, weight): &(f64, f64)| {
        sum += weight;
        sum >= total * 0.95
    };
    if total > 0.0 { found.iter().copied().find(reaches).map_or(0.0, |(x, _)| x) } else { 0.0 }
}

/// How many points there are at least, of a mesh that has so many corners: more for small meshes than vertices.
const POINTS: usize = 1024;
/// The shares of a triangle's corners in a point of it.
const SHARES: [f64; 3] = [2.0 / 3.0, 1.0 / 6.0, 1.0 / 6.0];
/// What a file can tell of numbers of any size at most, about.
const MOST: f64 = 1e36;
/// Triangles looked at round a vertex.
const FAN: usize = 32;
/// Triangles on the way to the nearest.
const STEPS: usize = 16;
