//! What corners have beside their positions, while their mesh gets coarser.
//!
//! A *wedge* is what corners of a vertex share: a fan of triangles between seams. An edge at which the corners of either end are of two
//! wedges is a *seam*: texture coordinates, colours or parts differ across it, or normals by more than [`CREASE`]. A seam stays on both
//! sides: a contraction along it joins the wedges of each side, a vertex beside it may join one on it, which then stays in its place,
//! and whatever else would join what a seam parts is refused.

mod build;
mod write;

use super::collapse::Pair;
use super::fit::{Face, Fit};
use super::quadric::{Form, Weights};
use super::star::Star;
use crate::mesh::attributes::Semantic;
use glam::DVec3;

/// The wedges of a mesh, their numbers, and which attributes these are of.
#[derive(Debug)]
pub(super) struct Wedges {
    /// For each triangle the wedge of each corner.
    pub(super) corners: Vec<[u32; 3]>,
    /// For each triangle its number in the input.
    pub(super) origins: Vec<u32>,
    /// Numbers a wedge.
    pub(super) width: usize,
    /// The numbers of each wedge, as lengths: a difference of them counts as much as so far off the surface. NaN where there is none.
    rows: Vec<f64>,
    /// For each wedge a corner of the input, three a triangle, that has what else the wedge has.
    sources: Vec<u32>,
    /// Whether a wedge has other numbers than the input's corners.
    is_changed: Vec<bool>,
    /// For each triangle of the input the wedges that its corners had at first.
    first: Vec<[u32; 3]>,
    columns: Vec<Column>,
    /// For each number the least and the largest one.
    bounds: Vec<[f64; 2]>,
}

/// An attribute among the numbers.
#[derive(Clone, Copy, Debug)]
struct Column {
    /// Its place among the mesh's attributes.
    attribute: usize,
    semantic: Semantic,
    /// Where its numbers begin.
    at: usize,
    components: usize,
    /// What a difference of 1 counts.
    scale: f64,
}

/// Which wedges of a source become which of a target, on one or both sides of their edge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Sides {
    pairs: [[u32; 2]; 2],
    count: usize,
}

impl Sides {
    /// Those of a triangle at the edge; `false` where they do not fit what is known.
    fn add(&mut self, pair: [u32; 2]) -> bool {
        let known = &self.pairs[..self.count];
        if known.contains(&pair) {
            return true;
        }
        if self.count == 2 || known.iter().any(|other| other[0] == pair[0] || other[1] == pair[1]) {
            return false;
        }
        self.pairs[self.count] = pair;
        self.count += 1;
        true
    }

    /// Source and target of each.
    pub(super) fn pairs(&self) -> &[[u32; 2]] {
        &self.pairs[..self.count]
    }

    /// Whether a wedge of the source, 0, or of the target, 1, is one of them.
    pub(super) fn has(&self, end: usize, wedge: u32) -> bool {
        self.pairs().iter().any(|pair| pair[end] == wedge)
    }

    /// Those of several triangles; `None` where they would join what a seam parts, or there are none.
    pub(super) fn of(pairs: impl IntoIterator<Item = [u32; 2]>) -> Option<Self> {
        let mut sides = Self::default();
        (pairs.into_iter().all(|pair| sides.add(pair)) && sides.count > 0).then_some(sides)
    }
}

impl Wedges {
    /// The wedge of a triangle's corner at a vertex that it has.
    pub(super) fn of(&self, triangle: u32, vertex: u32, triangles: &[[u32; 3]]) -> u32 {
        self.corners[triangle as usize][place(triangles[triangle as usize], vertex)]
    }

    /// The numbers of a wedge.
    pub(super) fn row(&self, wedge: u32) -> &[f64] {
        &self.rows[wedge as usize * self.width..][..self.width]
    }

    /// How many wedges there were at first; no later one has a higher number.
    pub(super) fn count(&self) -> usize {
        self.sources.len()
    }

    /// Triangles that are gone go here, too.
    pub(super) fn retain(&mut self, stays: impl Fn(usize) -> bool) {
        let mut number = 0;
        let mut next = || {
            number += 1;
            stays(number - 1)
        };
        self.corners.retain(|_| next());
        number = 0;
        let mut next = || {
            number += 1;
            stays(number - 1)
        };
        self.origins.retain(|_| next());
    }

    /// The planes through the seams at a vertex that are perpendicular to their triangles: they hold a seam as they do a boundary.
    pub(super) fn seam_planes(&self, star: &Star, triangles: &[[u32; 3]], weights: Weights) -> Form {
        let mut form = Form::default();
        let mut spokes = Vec::new();
        self.spokes(star, triangles, &mut spokes);
        for spoke in spokes.chunk_by(|x, y| x.vertex == y.vertex) {
            if spoke.iter().any(|other| other.wedges != spoke[0].wedges) {
                for Spoke { wing, at, .. } in spoke {
                    form.add_boundary(*at - star.at, star.wings[*wing as usize].cross, weights);
                }
            }
        }
        form
    }

    /// The edges of a star, one for each of their triangles, by the vertex at their other end.
    pub(super) fn spokes(&self, star: &Star, triangles: &[[u32; 3]], spokes: &mut Vec<Spoke>) {
        spokes.clear();
        for (wing, w) in (0..).zip(&star.wings) {
            let wedges = self.corners[w.triangle as usize];
            let k = place(triangles[w.triangle as usize], star.vertex);
            let spoke = |vertex, at, next: usize| Spoke {
                vertex,
                wedges: [wedges[k], wedges[(k + next) % 3]],
                wing,
                at,
            };
            spokes.extend([spoke(w.a, w.at_a, 1), spoke(w.b, w.at_b, 2)]);
        }
        spokes.sort_unstable_by_key(|spoke| (spoke.vertex, spoke.wing));
    }

    /// The fits of the wedges of a star.
    pub(super) fn fits(&self, star: &Star, triangles: &[[u32; 3]], weights: Weights, fits: &mut Fits) {
        fits.count = 0;
        for wing in &star.wings {
            let wedges = self.corners[wing.triangle as usize];
            let k = place(triangles[wing.triangle as usize], star.vertex);
            let fit = fits.of_or_new(wedges[k], self.width);
            let rows = [0, 1, 2].map(|i| self.row(wedges[(k + i) % 3]));
            let sides = [wing.at_a - star.at, wing.at_b - star.at];
            fit.add(&Face { at: star.at, sides, cross: wing.cross, rows }, weights);
        }
    }

    /// What an edge that is about to be contracted joins; `None` where a seam is in the way.
    pub(super) fn sides(&self, pair: &Pair, triangles: &[[u32; 3]]) -> Option<Sides> {
        let ends = [pair.source.vertex, pair.target.vertex];
        let sides = Sides::of(pair.at_edge().map(|wing| ends.map(|v| self.of(wing.triangle, v, triangles))))?;
        let all_join =
            pair.source.wings.iter().all(|wing| sides.has(0, self.of(wing.triangle, ends[0], triangles)));
        all_join.then_some(sides)
    }

    /// Whether a star has a wedge that is no target: the vertex stays in its place.
    pub(super) fn rests(&self, target: &Star, sides: Sides, triangles: &[[u32; 3]]) -> bool {
        target.wings.iter().any(|wing| !sides.has(1, self.of(wing.triangle, target.vertex, triangles)))
    }

    /// The target's wedge has these numbers from now on, and all else of the source's if `is_nearer`.
    pub(super) fn change(
        &mut self,
        [source, target]: [u32; 2],
        values: impl Iterator<Item = f64>,
        is_nearer: bool,
    ) {
        let row = &mut self.rows[target as usize * self.width..][..self.width];
        for ((x, value), [least, most]) in row.iter_mut().zip(values).zip(&self.bounds) {
            if value.is_finite() && !x.is_nan() {
                *x = value.clamp(*least, *most);
            }
        }
        for column in self.columns.iter().filter(|column| column.semantic == Semantic::Normal) {
            let normal = &mut row[column.at..column.at + 3];
            let length = normal.iter().map(|x| x * x).sum::<f64>().sqrt();
            if length > 0.0 {
                normal.iter_mut().for_each(|x| *x *= column.scale / length);
            }
        }
        self.is_changed[target as usize] = true;
        if is_nearer {
            self.sources[target as usize] = self.sources[source as usize];
        }
    }

    /// Another wedge for the corner of a triangle at a vertex.
    pub(super) fn join(&mut self, triangle: u32, vertex: u32, sides: &Sides, triangles: &[[u32; 3]]) {
        let wedge = &mut self.corners[triangle as usize][place(triangles[triangle as usize], vertex)];
        if let Some(pair) = sides.pairs().iter().find(|pair| pair[0] == *wedge) {
            *wedge = pair[1];
        }
    }
}

/// An edge of a star, and a triangle at it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spoke {
    /// The vertex at its other end.
    pub(super) vertex: u32,
    /// The triangle's wedges at the star's vertex and at the other one.
    pub(super) wedges: [u32; 2],
    /// The triangle's place in the star.
    wing: u32,
    /// Where the other end is.
    pub(super) at: DVec3,
}

/// The fits of a few wedges; reused, so that it allocates nothing in the long run.
#[derive(Debug, Default)]
pub(super) struct Fits {
    list: Vec<(u32, Fit)>,
    count: usize,
}

impl Fits {
    /// How many wedges there are.
    pub(super) fn len(&self) -> usize {
        self.count
    }

    /// The fit of a wedge that is there.
    pub(super) fn of(&self, wedge: u32) -> Option<&Fit> {
        self.list[..self.count].iter().find(|(other, _)| *other == wedge).map(|(_, fit)| fit)
    }

    /// Puts each in the place of its wedge.
    pub(super) fn take_into(&mut self, all: &mut [Fit]) {
        for (wedge, fit) in &mut self.list[..self.count] {
            all[*wedge as usize] = std::mem::take(fit);
        }
        self.count = 0;
    }

    fn of_or_new(&mut self, wedge: u32, width: usize) -> &mut Fit {
        let known = self.list[..self.count].iter().position(|(other, _)| *other == wedge);
        let at = known.unwrap_or(self.count);
        if known.is_none() {
            if self.list.len() == self.count {
                self.list.push((wedge, Fit::default()));
            }
            self.list[at].0 = wedge;
            self.list[at].1.clear(width);
            self.count += 1;
        }
        &mut self.list[at].1
    }
}

/// At which corner of a triangle a vertex is; the last where it is at no other.
pub(super) fn place(triangle: [u32; 3], vertex: u32) -> usize {
    triangle.iter().take(2).position(|&v| v == vertex).unwrap_or(2)
}

/// The cosine of the angle, 30 degrees, from which on normals stand for an edge of the surface and not for a bend that few triangles
/// follow: a circle of them is of more than twelve sides.
const CREASE: f64 = 0.866;

#[cfg(test)]
mod tests;
