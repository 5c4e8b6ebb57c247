//! What removing a vertex costs, and removing it: the part that `ffc` and `stellar` share.

use super::Options;
use super::covering::Covering;
use super::polygon::{MAX_SIDES, Triangulation};
use super::quadric::Quadric;
use crate::mesh::{CornerTable, Triangle, Vertex};
use crate::refine::operation::has_triangle;
use crate::refine::{History, Operation, Site};
use bitvec::vec::BitVec;
use glam::DVec3;

/// How a vertex would be removed.
#[derive(Clone, Debug)]
pub struct Removal {
    /// E(v) = alpha C(v) + beta S(v).
    pub cost: f64,
    site: Site,
    flips: Vec<Vertex>,
    /// The link vertex that takes over the quadric.
    heir: Vertex,
}

/// A mesh that loses its vertices.
#[derive(Debug)]
pub struct Remover {
    /// The mesh as it stands.
    pub table: CornerTable,
    /// Input positions.
    pub positions: Vec<DVec3>,
    /// The history so far.
    pub history: History,
    /// Removed vertices and where they lie.
    pub covering: Covering,
    /// Vertices left.
    pub vertices: usize,
    locked: BitVec,
    /// Vertices on the link of a vertex removed in this level.
    blocked: BitVec,
    quadrics: Vec<Quadric>,
    /// E(v) as last computed; NaN where the star has changed since.
    costs: Vec<f32>,
    mean_edge: f64,
    alpha: f64,
    beta: f64,
}

impl Remover {
    /// Assigns quadrics and the scale that both costs are measured in.
    pub fn new(table: CornerTable, positions: Vec<DVec3>, locked: BitVec, options: &Options) -> Self {
        let mut quadrics = vec![Quadric::default(); positions.len()];
        let (mut length, mut edges) = (0.0, 0usize);
        for t in table.triangles() {
            let [a, b, c] = table.triangle(t).map(|v| positions[v.index()]);
            let quadric = Quadric::of_triangle(a, b, c);
            for v in table.triangle(t) {
                quadrics[v.index()] += quadric;
            }
            for k in t.corners() {
                let (x, y) = table.edge(k);
                let (x, y) = (positions[x.index()], positions[y.index()]);
                length += x.distance(y);
                edges += 1;
                if table.opposite(k).is_none() {
                    // A wall on each boundary edge keeps the outline (Garland and Heckbert 1997, §6).
                    let wall = (y - x).cross((b - a).cross(c - a)).normalize_or_zero();
                    let quadric = Quadric::of_plane(wall, x, x.distance_squared(y));
                    let (v, w) = table.edge(k);
                    quadrics[v.index()] += quadric;
                    quadrics[w.index()] += quadric;
                }
            }
        }
        let vertices = (0..positions.len() as u32).filter(|&v| table.corner_of(Vertex(v)).is_some()).count();
        Self {
            covering: Covering::new(&table, &positions),
            blocked: BitVec::repeat(false, positions.len()),
            costs: vec![f32::NAN; positions.len()],
            mean_edge: if edges > 0 && length > 0.0 { length / edges as f64 } else { 1.0 },
            history: History::default(),
            alpha: options.alpha,
            beta: options.beta,
            table,
            positions,
            vertices,
            locked,
            quadrics,
        }
    }

    /// Begins a level: nothing is blocked.
    pub fn begin_level(&mut self) {
        self.blocked.fill(false);
    }

    /// Whether the vertex may still be removed in this level, as far as locks and links go.
    pub fn is_free(&self, v: Vertex) -> bool {
        !self.blocked[v.index()] && !self.locked[v.index()] && self.table.corner_of(v).is_some()
    }

    /// E(v), remembered until the star changes; infinite where v cannot be removed.
    pub fn cost(&mut self, v: Vertex) -> f64 {
        if self.costs[v.index()].is_nan() {
            self.costs[v.index()] = self.plan(v).map_or(f32::INFINITY, |plan| plan.cost as f32);
        }
        f64::from(self.costs[v.index()])
    }

    /// Marks a vertex as not removable until its star changes.
    pub fn reject(&mut self, v: Vertex) {
        self.costs[v.index()] = f32::INFINITY;
    }

    /// The cheapest way to remove `v`, or `None` where the one rule (no new edge may exist already) leaves none.
    pub fn plan(&self, v: Vertex) -> Option<Removal> {
        let table = &self.table;
        let ring = table.link(v);
        if !(2..=MAX_SIDES).contains(&ring.len()) {
            return None;
        }
        let boundary = table.is_boundary(v);
        let p = self.positions[v.index()];
        let at = |i: usize| self.positions[ring[i].index()];
        let (heir, distortion) = self.distortion(v, &ring);
        let removal = |site, flips, shape: f64| {
            let cost = self.alpha * distortion + self.beta * shape;
            Some(Removal { cost, site, flips, heir })
        };
        if boundary && ring.len() == 2 {
            // An ear: (v, a, b) goes, unless its inner edge is a boundary edge.
            let inner = table.opposite(table.corner_of(v));
            return if inner.is_some() {
                removal(Site::Attach(ring[1], ring[0]), Vec::new(), 0.0)
            } else {
                None
            };
        }
        if !boundary && ring.len() == 3 && has_triangle(table, [ring[0], ring[1], ring[2]]) {
            return None;
        }
        let shape = Shape::new(p, ring.iter().map(|w| self.positions[w.index()]), boundary);
        let best = Triangulation::best(
            ring.len(),
            boundary,
            |i, j| !table.may_have_edge(ring[i], ring[j], FAN),
            |i, k, j| shape.cost(at(i), at(k), at(j)),
        )?;
        let cost = best.cost / shape.mean_edge;
        if boundary {
            let (site, flips) = best.operation(&ring, (ring.len() - 1, 0));
            return removal(site, flips, cost);
        }
        let nearest = best.diagonals().min_by(|&x, &y| {
            let distance = |(i, j): (usize, usize)| ((at(i) + at(j)) * 0.5).distance_squared(p);
            distance(x).total_cmp(&distance(y))
        });
        match nearest {
            Some(diagonal) => {
                let (site, flips) = best.operation(&ring, diagonal);
                removal(site, flips, cost)
            }
            None => removal(Site::Face(ring[0], ring[1], ring[2]), Vec::new(), cost),
        }
    }

    /// C(v) over the fourth power of the mean edge length, and the neighbour where the minimum is.
    fn distortion(&self, v: Vertex, ring: &[Vertex]) -> (Vertex, f64) {
        let mut best = (ring[0], f64::INFINITY);
        for &u in ring {
            let p = self.positions[u.index()];
            let value = self.quadrics[v.index()].at(p) + self.quadrics[u.index()].at(p);
            if value < best.1 {
                best = (u, value);
            }
        }
        (best.0, best.1 / self.mean_edge.powi(4))
    }

    /// Removes `v` as planned, blocks its link, hands its quadric on. Returns whether the plan still held.
    pub fn remove(&mut self, v: Vertex, plan: &Removal) -> bool {
        let link = self.table.link(v);
        let star: Vec<Triangle> = self.table.fan(v).map(|c| c.triangle()).collect();
        let inner = self.table.opposite(self.table.corner_of(v));
        let operation =
            Operation { vertex: v, site: plan.site, first_flip: 0, flip_count: plan.flips.len() as u32 };
        if operation.undo(&mut self.table, &plan.flips).is_err() {
            debug_assert!(false, "a plan holds until the mesh changes");
            return false;
        }
        self.history.push(v, plan.site, plan.flips.iter().copied());
        self.vertices -= 1;
        let mut covered = vec![v];
        for &t in &star {
            self.covering.take(t, &mut covered);
        }
        let live = |t: &Triangle| t.index() < self.table.slots() && self.table.is_live(*t);
        let mut covers: Vec<Triangle> = star.into_iter().filter(live).collect();
        if covers.is_empty() {
            covers.push(inner.triangle());
        }
        self.covering.put(&self.table, &self.positions, &covered, &covers);
        let quadric = self.quadrics[v.index()];
        self.quadrics[plan.heir.index()] += quadric;
        for w in link {
            self.blocked.set(w.index(), true);
            self.costs[w.index()] = f32::NAN;
        }
        true
    }
}

/// What makes a triangle of the new star good: round, near the removed vertex, facing as the old star did.
struct Shape {
    vertex: DVec3,
    normal: DVec3,
    mean_edge: f64,
}

impl Shape {
    fn new(vertex: DVec3, ring: impl Iterator<Item = DVec3> + Clone, boundary: bool) -> Self {
        let (mut length, mut count) = (0.0, 0);
        for p in ring.clone() {
            length += p.distance(vertex);
            count += 1;
        }
        let pairs = ring.clone().zip(ring.clone().cycle().skip(1)).take(count - usize::from(boundary));
        let normal: DVec3 = pairs.map(|(p, q)| (p - vertex).cross(q - vertex)).sum();
        let mean_edge = if length > 0.0 { length / count as f64 } else { 1.0 };
        Self { vertex, normal: normal.normalize_or_zero(), mean_edge }
    }

    /// Circumradius, 8 times the vertex's distance from the plane, 8 mean edges times (1 - cosine to the star's normal).
    fn cost(&self, a: DVec3, b: DVec3, c: DVec3) -> f64 {
        let cross = (b - a).cross(c - a);
        let twice_area = cross.length();
        let worst = 1e3 * self.mean_edge;
        if twice_area <= 0.0 {
            return worst;
        }
        let radius = a.distance(b) * b.distance(c) * c.distance(a) / (2.0 * twice_area);
        let normal = cross / twice_area;
        let distance = (self.vertex - a).dot(normal).abs();
        let turn = 1.0 - normal.dot(self.normal);
        (radius.min(worst) + 8.0 * distance + 8.0 * self.mean_edge * turn).min(worst)
    }
}

/// Triangles looked at round each of two vertices before an edge between them is presumed: where both have more, as two apexes
/// over one long rim, every removal on the rim would look at all of them.
const FAN: usize = 1000;
