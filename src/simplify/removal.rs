//! What removing a vertex costs, and removing it: the part that `ffc` and `stellar` share.

use super::Options;
use super::covering::Covering;
use super::frame::Places;
use super::metric::{Energy, Metric};
use super::parity::Classes;
use super::polygon::{MAX_SIDES, Shape};
use super::seconds::Stopwatch;
use super::star::Star;
use crate::mesh::prefetch::prefetch;
use crate::mesh::{Corner, CornerTable, Triangle, Vertex};
use crate::refine::operation::has_triangle;
use crate::refine::{History, Operation, Site};
use bitvec::vec::BitVec;
use std::cmp::Ordering::Equal;

/// How a vertex would be removed.
#[derive(Clone, Debug)]
struct Removal {
    site: Site,
    flips: Vec<Vertex>,
    /// The link vertex that takes over the quadric.
    heir: Vertex,
    /// What is left open.
    star: Star,
}

/// A mesh that loses its vertices.
#[derive(Debug)]
pub struct Remover<'a> {
    /// The mesh as it stands.
    pub table: CornerTable,
    /// Input positions, and the cube they are seen in.
    pub places: Places<'a>,
    /// The history so far.
    pub history: History,
    /// Removed vertices and where they lie.
    pub covering: Covering,
    /// Vertices left.
    pub vertices: usize,
    /// Where the time goes.
    pub watch: Stopwatch,
    /// In a level by parity, the classes and the ranks they have.
    pub pattern: Option<Pattern>,
    metric: Metric,
    energies: Energies,
    barred: Barred,
    /// Lists that are empty between removals, with their memory.
    room: (Vec<Triangle>, Vec<Vertex>),
}

/// What is known of the cost of each vertex.
#[derive(Debug)]
struct Energies {
    /// E(v) as last computed; NaN where the star has changed since.
    costs: Vec<f32>,
    /// The part of it that is the distortion.
    distortions: Vec<f32>,
    /// The triangulations that the costs are of.
    shapes: Vec<Shape>,
}

/// The vertices that must stay.
#[derive(Debug)]
struct Barred {
    /// At all levels.
    locked: BitVec,
    /// In this level: those on the link of a vertex removed.
    blocked: BitVec,
}

/// The classes of the vertices, and how soon each class goes: edges between vertices that go soon are dear.
#[derive(Debug)]
pub struct Pattern {
    /// The classes.
    pub classes: Classes,
    /// By class, 0 for those that stay; the last entry is that of vertices without a class.
    pub ranks: [u8; 5],
}

impl<'a> Remover<'a> {
    /// A mesh with all its vertices.
    pub fn new(table: CornerTable, places: Places<'a>, locked: BitVec, options: &Options) -> Self {
        let count = places.positions.len();
        let vertices = vertices(&table).count();
        let mut watch = Stopwatch::default();
        let metric = watch.assign(|| Metric::new(&table, &places, options));
        Self {
            vertices,
            covering: Covering::new(&table, &places),
            history: History::with_capacity(vertices),
            pattern: None,
            energies: Energies {
                costs: vec![f32::NAN; count],
                distortions: vec![f32::NAN; count],
                shapes: vec![Shape::NONE; count],
            },
            barred: Barred { locked, blocked: BitVec::repeat(false, count) },
            room: Default::default(),
            table,
            places,
            watch,
            metric,
        }
    }

    /// Begins a level: nothing is blocked.
    pub fn begin_level(&mut self, pattern: Option<Pattern>) {
        // The pattern is part of what a removal costs.
        if pattern.is_some() || self.pattern.is_some() {
            self.energies.costs.fill(f32::NAN);
        }
        self.pattern = pattern;
        self.barred.blocked.fill(false);
    }

    /// The vertices not locked, and some finite E(v): those of one in `every`, picked at random.
    pub fn candidates(&mut self, every: u32) -> (Vec<Vertex>, Vec<f32>) {
        let start = std::time::Instant::now();
        let is_free = |v: &Vertex| self.table.corner_of(*v).is_some() && !self.barred.locked[v.index()];
        let free: Vec<_> = (0..self.table.vertex_slots() as u32).map(Vertex).filter(is_free).collect();
        // Picked by a hash, as the order of the vertices may have a pattern.
        let is_picked =
            |v: &&Vertex| every == 1 || (v.0.wrapping_mul(0x9e37_79b1) >> 16).is_multiple_of(every);
        let picked: Vec<_> = free.iter().filter(is_picked).copied().collect();
        if self.history.operations().is_empty() {
            // Nothing is known of the surface yet: a few tell what is flat.
            let few = picked.len().div_ceil(PROBES).max(1);
            let distortions = self.distortions(picked.iter().copied().step_by(few));
            if self.metric.begin_level(distortions) {
                self.energies.costs.fill(f32::NAN);
            }
        }
        let distortions = self.distortions(picked.iter().copied());
        self.metric.begin_level(distortions);
        let costs = picked.iter().map(|v| self.energies.costs[v.index()]);
        let sample = costs.filter(|cost| cost.is_finite()).collect();
        self.watch.seconds.cost += start.elapsed().as_secs_f64();
        (free, sample)
    }

    /// The finite distortions of some vertices.
    fn distortions(&mut self, vertices: impl Iterator<Item = Vertex>) -> Vec<f32> {
        let of_vertex = |v: Vertex| {
            self.renew_cost(v);
            self.energies.distortions[v.index()]
        };
        vertices.map(of_vertex).filter(|distortion| distortion.is_finite()).collect()
    }

    /// What rounding to the lattice costs anyway.
    pub fn noise(&self) -> f32 {
        self.metric.noise()
    }

    /// Asks for what the costs of some vertices are computed from: most of them will be asked for, and in no order.
    pub fn expect(&self, vertices: &[Vertex]) {
        for &v in vertices {
            self.table.prefetch(self.table.corner_of(v));
        }
        for &v in vertices {
            let first = self.table.corner_of(v);
            if first.is_none() {
                continue;
            }
            for w in self.table.vertices_from(first) {
                prefetch(&self.places.positions[w.index()]);
            }
            for beyond in self.table.opposites_from(first) {
                self.table.prefetch(beyond);
            }
        }
    }

    /// E(v), computed where it is not known.
    #[inline]
    fn renew_cost(&mut self, v: Vertex) -> f32 {
        let cost = self.energies.costs[v.index()];
        if !cost.is_nan() {
            return cost;
        }
        let (energy, shape) = self.energy(v);
        self.energies.costs[v.index()] = energy.total;
        self.energies.distortions[v.index()] = energy.distortion;
        self.energies.shapes[v.index()] = shape;
        energy.total
    }

    /// E(v) where the vertex may still be removed in this level: as of the level's beginning, for nothing that is free has changed since.
    #[inline]
    pub fn cost(&mut self, v: Vertex) -> Option<f32> {
        if self.barred.blocked[v.index()] {
            return None;
        }
        if self.energies.costs[v.index()].is_nan() {
            self.watch.begin_cost();
            self.renew_cost(v);
            self.watch.end_cost();
        }
        Some(self.energies.costs[v.index()]).filter(|cost| cost.is_finite())
    }

    /// E(v), and the triangulation that it is of; infinite where v cannot be removed. Whether the edges to be
    /// made exist is not asked.
    fn energy(&self, v: Vertex) -> (Energy, Shape) {
        let Some(star) = self.star(v) else { return (Energy::NEVER, Shape::NONE) };
        if star.ring().len() == 2 {
            let foot = star.foot([[0, 0, 1]].into_iter());
            return (self.metric.energy(v, &star, foot, 0.0, 0.0), Shape::NONE);
        }
        let price = self.metric.shape_price(&star);
        let solved = star.solve(price, |i, j| price * self.price(&star, i, j));
        let Some(best) = solved.shape.triangulation() else { return (Energy::NEVER, Shape::NONE) };
        // A vertex of the boundary is to be near the new boundary: where it turns inwards, it lies on the new triangles.
        let sides = star.ring().len();
        let foot = if star.boundary {
            star.foot([[0, 0, sides - 1]].into_iter())
        } else {
            star.foot(best.triangles.iter())
        };
        let distortion = star.distortion(best.triangles.iter());
        let shape = (solved.cost - distortion).max(0.0);
        (self.metric.energy(v, &star, foot, distortion, shape), solved.shape)
    }

    #[inline]
    fn star(&self, v: Vertex) -> Option<Star> {
        let table = &self.table;
        let boundary = table.is_boundary(v);
        let first = table.corner_of(v);
        // The corners at v, and then, at the boundary, the last corner's previous one.
        let (mut at, mut last) = (first, Corner::NONE);
        let link = std::iter::from_fn(|| {
            if at.is_none() {
                let end = std::mem::replace(&mut last, Corner::NONE);
                return (boundary && end.is_some()).then(|| table.vertex(end.prev()));
            }
            let side = at.next();
            last = at;
            let beyond = table.opposite(side);
            at = if beyond.is_some() { beyond.next() } else { Corner::NONE };
            if at == first {
                at = Corner::NONE;
            }
            Some(table.vertex(side))
        });
        Star::new(link, boundary, self.places.at(v), |w| self.places.at(w))
    }

    /// What an edge costs, in mean edges: its middle is to be near the vertex, from where its position is predicted.
    #[inline]
    fn price(&self, star: &Star, i: usize, j: usize) -> f32 {
        let middle = 0.5 * (star.point(i) + star.point(j)).length();
        MIDDLE * middle + self.bias(star.ring()[i], star.ring()[j])
    }

    /// What the pattern adds to the cost of an edge, in mean edges.
    #[inline]
    fn bias(&self, a: Vertex, b: Vertex) -> f32 {
        self.pattern.as_ref().map_or(0.0, |pattern| {
            let rank = |v: Vertex| f32::from(pattern.ranks[usize::from(pattern.classes.of[v.index()])]);
            BIAS * (rank(a) + rank(b))
        })
    }

    /// The cheapest way to remove `v`, or `None` where the one rule (no new edge may exist already) leaves none.
    fn plan(&self, v: Vertex) -> Option<Removal> {
        let table = &self.table;
        let star = self.star(v)?;
        let ring = star.ring();
        let sides = ring.len();
        if sides == 2 {
            // An ear: (v, a, b) goes, unless its inner edge is a boundary edge.
            let inner = table.opposite(table.corner_of(v));
            let (site, flips) = (Site::Attach(ring[1], ring[0]), Vec::new());
            return inner.is_some().then(|| Removal { site, flips, heir: self.metric.heir(v, &star), star });
        }
        if !star.boundary && sides == 3 && has_triangle(table, [ring[0], ring[1], ring[2]]) {
            return None;
        }
        let price = self.metric.shape_price(&star);
        let mut exists = [[false; MAX_SIDES]; MAX_SIDES];
        let mut shape = self.energies.shapes[v.index()];
        let best = loop {
            let best = shape.triangulation()?;
            let closing = star.boundary.then_some((0, sides - 1));
            let made = best.diagonals().chain(closing);
            let mut fine = true;
            for (i, j) in made.filter(|&(i, j)| table.may_have_edge(ring[i], ring[j], FAN)) {
                exists[i][j] = true;
                fine = false;
            }
            if fine {
                break best;
            }
            let edge = |i: usize, j: usize| {
                if exists[i][j] { f32::INFINITY } else { price * self.price(&star, i, j) }
            };
            shape = star.solve(price, edge).shape;
        };
        // The edge to be split: the one the pattern keeps, then the one whose midpoint is nearest.
        let distance = |&(i, j): &(usize, usize)| {
            let middle = (star.point(i) + star.point(j)) * 0.5;
            (self.bias(ring[i], ring[j]), middle.length_squared())
        };
        let diagonal = if star.boundary {
            Some((sides - 1, 0))
        } else {
            best.diagonals()
                .map(|d| (distance(&d), d))
                .min_by(|x, y| x.0.partial_cmp(&y.0).unwrap_or(Equal))
                .map(|x| x.1)
        };
        let (site, flips) = match diagonal {
            Some(diagonal) => best.operation(ring, diagonal),
            None => (Site::Face(ring[0], ring[1], ring[2]), Vec::new()),
        };
        Some(Removal { site, flips, heir: self.metric.heir(v, &star), star })
    }

    /// Removes `v`, blocks its link, hands its quadric on. Returns whether that was possible; if not, `v` is free no more.
    pub fn remove(&mut self, v: Vertex) -> bool {
        self.watch.begin_removal();
        let plan = self.plan(v);
        self.watch.planned();
        let Some(plan) = plan else {
            self.energies.costs[v.index()] = f32::INFINITY;
            return false;
        };
        let (mut star, mut covered) = std::mem::take(&mut self.room);
        star.extend(self.table.fan(v).map(|c| c.triangle()));
        let inner = self.table.opposite(self.table.corner_of(v));
        let operation =
            Operation { vertex: v, site: plan.site, first_flip: 0, flip_count: plan.flips.len() as u32 };
        // The plan has looked at all edges that are made.
        let may_join = |table: &CornerTable, a, b| {
            debug_assert!(!table.has_edge(a, b));
            true
        };
        if operation.undo_where(&mut self.table, &plan.flips, may_join).is_err() {
            debug_assert!(false, "a plan holds until the mesh changes");
            self.energies.costs[v.index()] = f32::INFINITY;
            return false;
        }
        self.history.push(v, plan.site, plan.flips.iter().copied());
        self.vertices -= 1;
        for &w in plan.star.ring() {
            self.barred.blocked.set(w.index(), true);
            self.energies.costs[w.index()] = f32::NAN;
        }
        let between = self.places.at(plan.heir) - self.places.at(v);
        self.metric.hand_on(v, plan.heir, between);
        self.watch.removed();
        covered.push(v);
        for &t in &star {
            self.covering.take(t, &mut covered);
        }
        let known = f64::from(self.covering.known(&star, &covered));
        let bound = (known.sqrt() + plan.star.thickness()).powi(2) as f32;
        star.retain(|t| t.index() < self.table.slots() && self.table.is_live(*t));
        if star.is_empty() {
            star.push(inner.triangle());
        }
        self.covering.put(&self.table, &self.places, &covered, &star);
        self.covering.paths.renew(&self.table, &star, bound);
        star.clear();
        covered.clear();
        self.room = (star, covered);
        self.watch.covered();
        true
    }
}

/// The vertices of a mesh, in the order of their numbers.
pub fn vertices(table: &CornerTable) -> impl Iterator<Item = Vertex> + '_ {
    (0..table.vertex_slots() as u32).map(Vertex).filter(|&v| table.corner_of(v).is_some())
}

/// What an edge costs for each rank of its two ends, in mean edges: enough that a pattern goes on where the surface is smooth.
const BIAS: f32 = 1.5;

/// What an edge costs for the distance of its middle from the vertex removed.
const MIDDLE: f32 = 1.5;

/// Vertices that tell what is flat, before anything is known.
const PROBES: usize = 512;

/// Triangles looked at round each of two vertices before an edge between them is presumed: where both have more, as two apexes
/// over one long rim, every removal on the rim would look at all of them.
const FAN: usize = 1000;
