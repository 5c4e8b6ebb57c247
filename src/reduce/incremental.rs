//! Contractions one by one, with the quadrics of the input added up as QSlim does it (Garland and Heckbert 1997).

use super::Options;
use super::collapse::{Pair, SINGULAR, Topology};
use super::quadric::Quadric;
use super::star::{GONE, Star, relative};
use super::working::{FIXED, Working};
use glam::DVec3;

/// A mesh, for each vertex its triangles and the sum of the planes that it stands for.
pub(super) struct Incremental<'a> {
    pub(super) working: &'a mut Working,
    pub(super) rings: Vec<Vec<u32>>,
    quadrics: Vec<Quadric>,
    /// Where the quadrics have their zero.
    origin: [f64; 3],
    topology: Topology,
    pair: Pair,
}

/// An edge to be contracted.
#[derive(Clone, Copy, Debug)]
pub(super) struct Candidate {
    pub(super) cost: f64,
    pub(super) ends: [u32; 2],
    /// Relative to the origin.
    place: DVec3,
}

impl<'a> Incremental<'a> {
    /// Planes of triangles, and of edges of the boundary, of the mesh as it is.
    pub(super) fn new(working: &'a mut Working, options: &Options) -> Self {
        let Options { topology, weights, .. } = *options;
        let origin = working.positions.first().copied().unwrap_or_default();
        let vertices = working.positions.len() as u32;
        working.fix(topology == Topology::Free, options.lock_boundary);
        let mut star = Star::default();
        let mut quadrics = Vec::with_capacity(vertices as usize);
        for v in 0..vertices {
            let at = working.positions[v as usize];
            star.gather(v, working.rings.of(v), &working.triangles, &working.positions, at);
            quadrics.push(Quadric::through(star.form(weights, true), relative(at, origin)));
        }
        let rings = (0..vertices).map(|v| working.rings.of(v).to_vec()).collect();
        working.rings = super::rings::Rings::default();
        Self { working, rings, quadrics, origin, topology, pair: Pair::default() }
    }

    /// What contracting an edge costs, and where its vertex goes: to the optimum, or else to the best of the ends and the middle; `None`
    /// where both ends stay or one has too many triangles.
    pub(super) fn candidate(&self, ends: [u32; 2]) -> Option<Candidate> {
        self.choices(ends)?.next()
    }

    /// What else there is than the best place, by what it costs.
    fn choices(&self, ends: [u32; 2]) -> Option<impl Iterator<Item = Candidate>> {
        if ends.iter().any(|&v| self.rings[v as usize].len() > MANY) {
            return None;
        }
        let [a, b] = ends.map(|v| relative(self.working.positions[v as usize], self.origin));
        let mut sum = self.quadrics[ends[0] as usize];
        sum += self.quadrics[ends[1] as usize];
        let of = |place: DVec3| Candidate { cost: sum.at(place), ends, place };
        let (optimum, mut others) = match ends.map(|v| self.working.flags[v as usize] & FIXED != 0) {
            [true, true] => return None,
            [true, false] => (None, vec![of(a)]),
            [false, true] => (None, vec![of(b)]),
            [false, false] => {
                let optimum = sum.optimum(a, SINGULAR).map(|at| of(at + a)).filter(|c| c.place.is_finite());
                (optimum, vec![of(a), of(b), of((a + b) / 2.0)])
            }
        };
        others.sort_by(|x, y| x.cost.total_cmp(&y.cost));
        Some(optimum.into_iter().chain(others))
    }

    /// Contracts an edge if topology and normals allow it, else not. Returns the vertex that is left.
    pub(super) fn contract(&mut self, candidate: Candidate) -> Option<u32> {
        self.gather(candidate.ends)?;
        self.carry_out(candidate)
    }

    /// The same with the best place that the normals allow.
    pub(super) fn contract_somewhere(&mut self, ends: [u32; 2]) -> Option<u32> {
        self.gather(ends)?;
        let choices: Vec<Candidate> = self.choices(ends)?.collect();
        choices.into_iter().find_map(|candidate| self.carry_out(candidate))
    }

    /// Gathers the stars of an edge, that of the end which goes first; `None` where the topology does not allow it.
    fn gather(&mut self, ends: [u32; 2]) -> Option<()> {
        let Working { positions, triangles, flags, .. } = &*self.working;
        let stars = [&mut self.pair.source, &mut self.pair.target];
        for (star, v) in stars.into_iter().zip(ends) {
            star.gather(v, &self.rings[v as usize], triangles, positions, self.origin);
        }
        let stays = |star: &Star| (flags[star.vertex as usize] & FIXED != 0, star.is_boundary());
        if stays(&self.pair.source) > stays(&self.pair.target) {
            std::mem::swap(&mut self.pair.source, &mut self.pair.target);
        }
        self.pair.is_allowed(Some(self.topology)).then_some(())
    }

    fn carry_out(&mut self, candidate: Candidate) -> Option<u32> {
        if !self.pair.is_clear(candidate.place) {
            return None;
        }
        let [source, target] = [self.pair.source.vertex, self.pair.target.vertex];
        let Working { positions, triangles, living, .. } = &mut *self.working;
        let gone = self.pair.at_edge().map(|wing| wing.triangle).chain(self.pair.repeated.iter().copied());
        for t in gone {
            for v in triangles[t as usize] {
                self.rings[v as usize].retain(|&other| other != t);
            }
            triangles[t as usize] = GONE;
            *living -= 1;
        }
        for t in std::mem::take(&mut self.rings[source as usize]) {
            triangles[t as usize].iter_mut().filter(|v| **v == source).for_each(|v| *v = target);
            self.rings[target as usize].push(t);
        }
        if candidate.place != self.pair.target.at {
            positions[target as usize] = std::array::from_fn(|k| self.origin[k] + candidate.place[k]);
        }
        let sum = self.quadrics[source as usize];
        self.quadrics[target as usize] += sum;
        Some(target)
    }

    /// The vertices at the other ends of the edges of a vertex, in ascending order.
    pub(super) fn neighbours(&self, v: u32) -> Vec<u32> {
        let triangles = self.rings[v as usize].iter().map(|&t| self.working.triangles[t as usize]);
        let mut found: Vec<u32> = triangles.flatten().filter(|&other| other != v).collect();
        found.sort_unstable();
        found.dedup();
        found
    }
}

/// A vertex with more triangles than this stays as it is: looking at all of them each time takes too long.
const MANY: usize = 1024;
