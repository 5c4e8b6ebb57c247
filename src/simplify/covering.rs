//! Which triangle covers each removed vertex, and how far off: the level's error is tracked while simplifying. What vertices do not tell,
//! the edges' paths do.

use super::frame::Places;
use super::paths::Paths;
use crate::mesh::distance::point_triangle_distance_squared;
use crate::mesh::{CornerTable, Triangle, Vertex};
use glam::DVec3;

/// The removed vertices, in a list for each triangle of the mesh as it stands.
#[derive(Debug)]
pub struct Covering {
    first: Vec<u32>,
    next: Vec<u32>,
    /// A third of the area round each vertex of the input.
    weights: Vec<f32>,
    /// Squared distance of each vertex from the triangle that covers it; 0 for those of the mesh.
    distances: Vec<f32>,
    /// Where the edges run on the input.
    pub paths: Paths,
    /// Room for the triangles of one star.
    patches: Vec<Patch>,
}

/// How far a level and the input are apart, in the input's units; but for the input's residue, which levels do not have.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LevelError {
    /// Largest distance of a point of either surface from the other one: a bound before the level's vertices are moved to the lattice,
    /// and the largest move. Where the bound would decide on the level's, it is measured at points, to some percent.
    pub max: f64,
    /// Root of the mean squared distance of the input's vertices from the level, of those on the boundary from the level's boundary, each
    /// weighted by the area round it; moves to the lattice count as they are expected.
    pub rms: f64,
}

/// By what it is told how far a level is off once its vertices have moved.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Traces {
    /// Some of the input's vertices, the same ones at each level.
    pub probes: Vec<Probe>,
    /// The triangles that are farther off than half of the largest distance, and how far at most, in steps of the lattice.
    pub far: Vec<([Vertex; 3], f64)>,
    /// The largest distance.
    pub most: f64,
}

/// A vertex of the input, and where a level has it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Probe {
    /// The vertex.
    pub vertex: Vertex,
    /// The triangle that covers it; three times itself where it is one of the level's.
    pub corners: [Vertex; 3],
    /// A third of the area round it.
    pub weight: f32,
    /// Its squared distance from the level's boundary, in steps of the lattice, where it is on the input's; else 0.
    pub outline: f32,
}

const NONE: u32 = u32::MAX;

impl Covering {
    /// Nothing is removed yet.
    pub fn new(table: &CornerTable, places: &Places) -> Self {
        let count = places.positions.len();
        let mut weights = vec![0.0; count];
        for t in table.triangles() {
            let [a, b, c] = table.triangle(t).map(|v| places.at(v));
            let third = ((b - a).cross(c - a).length() / 6.0) as f32;
            for v in table.triangle(t) {
                weights[v.index()] += third;
            }
        }
        Self {
            first: vec![NONE; table.slots()],
            next: vec![NONE; count],
            weights,
            distances: vec![0.0; count],
            paths: Paths::new(table),
            patches: Vec::new(),
        }
    }

    /// Takes the vertices off a triangle that is about to be rewritten.
    pub fn take(&mut self, t: Triangle, out: &mut Vec<Vertex>) {
        let mut at = std::mem::replace(&mut self.first[t.index()], NONE);
        while at != NONE {
            out.push(Vertex(at));
            at = self.next[at as usize];
        }
    }

    /// The largest squared distance known in a star whose vertices have been taken off: of these and of the edges' paths.
    pub fn known(&self, star: &[Triangle], vertices: &[Vertex]) -> f32 {
        vertices.iter().map(|v| self.distances[v.index()]).fold(self.paths.known(star), f32::max)
    }

    /// Puts each vertex on one of some neighbouring triangles: the one it is led to across edges that it lies beyond, or the nearest
    /// where it comes to lie much farther off than before.
    pub fn put(&mut self, table: &CornerTable, places: &Places, vertices: &[Vertex], triangles: &[Triangle]) {
        let mut patches = std::mem::take(&mut self.patches);
        let few = vertices.len() <= FEW;
        patches.extend(
            triangles.iter().map(|&t| Patch::new(table, places, t, if few { &[] } else { triangles })),
        );
        let mut at = 0;
        for &v in vertices {
            let p = places.at(v);
            for _ in 0..if few { 0 } else { patches.len() } {
                match patches[at].way(p) {
                    Some(on) => at = on,
                    None => break,
                }
            }
            let mut squared = patches[at].distance_squared(p);
            if few || squared > FARTHER * f64::from(self.distances[v.index()]) {
                // Much farther than it was: led astray on a fold, perhaps.
                let start = at;
                for (k, patch) in patches.iter().enumerate().filter(|&(k, _)| k != start) {
                    let other = patch.distance_squared(p);
                    if other < squared {
                        (squared, at) = (other, k);
                    }
                }
            }
            self.distances[v.index()] = squared as f32;
            let t = triangles[at];
            self.next[v.index()] = self.first[t.index()];
            self.first[t.index()] = v.0;
        }
        patches.clear();
        self.patches = patches;
    }

    /// What is known of the level as it stands, of which [`Covering::error`] has just told `error`.
    pub fn traces(&self, table: &CornerTable, places: &Places, error: &LevelError) -> Traces {
        let most = error.max / places.frame.length(places.frame.step());
        if !most.is_finite() {
            return Traces::default();
        }
        let far = table.triangles().filter_map(|t| {
            let mut squared = self.paths.known(&[t]);
            let mut at = self.first[t.index()];
            while at != NONE {
                squared = squared.max(self.distances[at as usize]);
                at = self.next[at as usize];
            }
            let (distance, rounding) = (f64::from(squared).sqrt() / places.frame.step(), 0.75f64.sqrt());
            (distance > 0.5 * most - rounding && distance > 0.0)
                .then(|| (table.triangle(t), (distance + rounding).min(most)))
        });
        Traces { probes: self.probes(table, places), far: far.collect(), most }
    }

    /// Some of the input's vertices, picked at random.
    fn probes(&self, table: &CornerTable, places: &Places) -> Vec<Probe> {
        let every = self.weights.len().div_ceil(PROBES) as u32;
        // Picked by a hash, as the order of the vertices may have a pattern.
        let picked = |v: u32| (v.wrapping_mul(0x9e37_79b1) >> 16).is_multiple_of(every);
        let (outline, step) = (self.paths.outline(), places.frame.step() as f32);
        let probe = |v: u32, corners| Probe {
            vertex: Vertex(v),
            corners,
            weight: self.weights[v as usize],
            outline: outline[v as usize] / (step * step).max(f32::MIN_POSITIVE),
        };
        let mut probes = Vec::new();
        for t in table.triangles() {
            let mut at = self.first[t.index()];
            while at != NONE {
                if picked(at) {
                    probes.push(probe(at, table.triangle(t)));
                }
                at = self.next[at as usize];
            }
        }
        let there = (0..table.vertex_slots() as u32).filter(|&v| table.corner_of(Vertex(v)).is_some());
        probes.extend(there.filter(|&v| picked(v)).map(|v| probe(v, [Vertex(v); 3])));
        probes
    }

    /// How far the level as it stands and the input are apart, the level's vertices moved to the lattice.
    pub fn error(&mut self, table: &CornerTable, places: &Places) -> LevelError {
        let most = self.distances.iter().fold(0.0f32, |most, &squared| most.max(squared));
        let max = self.paths.farthest(table, places, most);
        let (mut sum, mut total) = (0.0, 0.0);
        let outline = self.paths.outline().iter();
        for ((&squared, &outline), &weight) in self.distances.iter().zip(outline).zip(&self.weights) {
            let squared = squared.max(outline);
            sum += f64::from(weight) * f64::from(squared);
            total += f64::from(weight);
        }
        let mean = if total > 0.0 { sum / total } else { 0.0 };
        let step = places.frame.step();
        // Half the diagonal of a cell; and the variance along any direction of what is uniform in a cell.
        let (most, variance) = (0.75f64.sqrt() * step, step * step / 12.0);
        LevelError {
            max: places.frame.length(f64::from(max).sqrt() + most),
            rms: places.frame.length((mean + variance).sqrt()),
        }
    }
}

/// A triangle and the ways to its neighbours.
#[derive(Debug)]
struct Patch {
    corners: [DVec3; 3],
    /// For each corner the direction out across the edge opposite, and the place of the triangle behind it.
    ways: [(DVec3, usize); 3],
}

impl Patch {
    /// The ways are those to some of `triangles`.
    fn new(table: &CornerTable, places: &Places, t: Triangle, triangles: &[Triangle]) -> Self {
        let corners = table.triangle(t).map(|v| places.at(v));
        if triangles.is_empty() {
            return Self { corners, ways: [(DVec3::ZERO, usize::MAX); 3] };
        }
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        let mut k = 0;
        let ways = t.corners().map(|c| {
            let along = corners[(k + 2) % 3] - corners[(k + 1) % 3];
            k += 1;
            let o = table.opposite(c);
            let behind = if o.is_some() { triangles.iter().position(|&u| u == o.triangle()) } else { None };
            (along.cross(normal), behind.unwrap_or(usize::MAX))
        });
        Self { corners, ways }
    }

    fn distance_squared(&self, p: DVec3) -> f64 {
        let [a, b, c] = self.corners;
        point_triangle_distance_squared(p, a, b, c)
    }

    /// The neighbour that a point lies towards, if any.
    fn way(&self, p: DVec3) -> Option<usize> {
        let beyond = |k: usize| (p - self.corners[(k + 1) % 3]).dot(self.ways[k].0) > 0.0;
        (0..3).find(|&k| self.ways[k].1 != usize::MAX && beyond(k)).map(|k| self.ways[k].1)
    }
}

/// Vertices that tell how far a level is off, about.
const PROBES: usize = 1024;

/// So few vertices ask all triangles at once.
const FEW: usize = 3;

/// How much the squared distance may grow without all triangles being asked.
const FARTHER: f64 = 3.0;
