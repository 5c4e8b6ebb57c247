//! Contractions one by one, with the quadrics of the input added up as QSlim does it (Garland and Heckbert 1997).

use super::Options;
use super::collapse::{Pair, SINGULAR, Topology};
use super::fit::{Fit, least, price, values};
use super::quadric::Quadric;
use super::star::{GONE, Star, relative};
use super::wedges::{Fits, Sides, Wedges};
use super::working::{FIXED, Working};
use glam::DVec3;

/// A mesh, for each vertex its triangles and the sum of the planes that it stands for.
pub(super) struct Incremental<'a> {
    pub(super) working: &'a mut Working,
    pub(super) rings: Vec<Vec<u32>>,
    quadrics: Vec<Quadric>,
    /// For each wedge the values that it stands for; empty without attributes.
    fits: Vec<Fit>,
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
        let mut fits = vec![Fit::default(); working.wedges.as_ref().map_or(0, Wedges::count)];
        let mut around = Fits::default();
        for v in 0..vertices {
            let at = working.positions[v as usize];
            star.gather(v, working.rings.of(v), &working.triangles, &working.positions, at);
            let mut form = star.form(weights, true);
            if let Some(wedges) = &working.wedges {
                form += wedges.seam_planes(&star, &working.triangles, weights);
                star.gather(v, working.rings.of(v), &working.triangles, &working.positions, origin);
                wedges.fits(&star, &working.triangles, weights, &mut around);
                around.take_into(&mut fits);
            }
            quadrics.push(Quadric::through(form, relative(at, origin)));
        }
        let rings = (0..vertices).map(|v| working.rings.of(v).to_vec()).collect();
        working.rings = super::rings::Rings::default();
        Self { working, rings, quadrics, fits, origin, topology, pair: Pair::default() }
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
        let joined = self.joined(ends)?;
        let stays = [0, 1].map(|end| self.stays(ends[end], end, joined.as_ref()));
        let rest = |end: usize| match (&self.working.wedges, &joined) {
            // The values are those of the end that stays, too.
            (Some(wedges), Some(sides)) => {
                let at = if end == 0 { a } else { b };
                let of = |pair: &[u32; 2]| price(&self.both(*pair), at, wedges.row(pair[end]));
                sides.pairs().iter().map(of).sum::<f64>()
            }
            _ => 0.0,
        };
        if stays == [false; 2]
            && let Some(sides) = &joined
        {
            sides.pairs().iter().for_each(|pair| sum += least(&self.both(*pair)));
        }
        let of = |place: DVec3| Candidate { cost: sum.at(place), ends, place };
        let and = |candidate: Candidate, more: f64| Candidate { cost: candidate.cost + more, ..candidate };
        let (optimum, mut others) = match stays {
            [true, true] => return None,
            [true, false] => (None, vec![and(of(a), rest(0))]),
            [false, true] => (None, vec![and(of(b), rest(1))]),
            [false, false] => {
                let optimum = sum.optimum(a, SINGULAR).map(|at| of(at + a)).filter(|c| c.place.is_finite());
                (optimum, vec![of(a), of(b), of((a + b) / 2.0)])
            }
        };
        others.sort_by(|x, y| x.cost.total_cmp(&y.cost));
        Some(optimum.into_iter().chain(others))
    }

    /// The fits of two wedges.
    fn both(&self, pair: [u32; 2]) -> [&Fit; 2] {
        pair.map(|wedge| &self.fits[wedge as usize])
    }

    /// With attributes, which wedges an edge joins; `None` where it would join what a seam parts.
    fn joined(&self, ends: [u32; 2]) -> Option<Option<Sides>> {
        let Working { triangles, wedges: Some(wedges), .. } = &*self.working else { return Some(None) };
        let at_edge =
            self.rings[ends[0] as usize].iter().filter(|&&t| triangles[t as usize].contains(&ends[1]));
        Sides::of(at_edge.map(|&t| ends.map(|v| wedges.of(t, v, triangles)))).map(Some)
    }

    /// Whether an end of an edge stays in its place: fixed, or with wedges beside those that are joined.
    fn stays(&self, v: u32, end: usize, joined: Option<&Sides>) -> bool {
        let Working { triangles, flags, wedges, .. } = &*self.working;
        flags[v as usize] & FIXED != 0
            || wedges.as_ref().zip(joined).is_some_and(|(wedges, sides)| {
                self.rings[v as usize].iter().any(|&t| !sides.has(end, wedges.of(t, v, triangles)))
            })
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
        let Working { positions, triangles, .. } = &*self.working;
        let stars = [&mut self.pair.source, &mut self.pair.target];
        for (star, v) in stars.into_iter().zip(ends) {
            star.gather(v, &self.rings[v as usize], triangles, positions, self.origin);
        }
        let joined = self.joined(ends)?;
        let stays =
            |star: &Star, end: usize| (self.stays(star.vertex, end, joined.as_ref()), star.is_boundary());
        if stays(&self.pair.source, 0) > stays(&self.pair.target, 1) {
            std::mem::swap(&mut self.pair.source, &mut self.pair.target);
        }
        self.pair.is_allowed(Some(self.topology)).then_some(())
    }

    fn carry_out(&mut self, candidate: Candidate) -> Option<u32> {
        if !self.pair.is_clear(candidate.place) {
            return None;
        }
        let [source, target] = [self.pair.source.vertex, self.pair.target.vertex];
        self.join(candidate.place)?;
        let Working { positions, triangles, living, parents, .. } = &mut *self.working;
        if let Some(parents) = parents {
            parents.merge(source, target);
        }
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

    /// Joins the wedges of the edge that was gathered, before the triangles change; `None` where a seam is in the way.
    fn join(&mut self, place: DVec3) -> Option<()> {
        let Working { triangles, wedges: Some(wedges), flags, .. } = &mut *self.working else {
            return Some(());
        };
        let Pair { source, target, .. } = &self.pair;
        let sides = wedges.sides(&self.pair, triangles)?;
        let rests = flags[target.vertex as usize] & FIXED != 0 || wedges.rests(target, sides, triangles);
        self.pair.moved().for_each(|wing| wedges.join(wing.triangle, source.vertex, &sides, triangles));
        let is_nearer = place.distance_squared(source.at) < place.distance_squared(target.at);
        for &[from, to] in sides.pairs() {
            let more = std::mem::take(&mut self.fits[from as usize]);
            if !rests {
                let found: Vec<f64> = values(&[&more, &self.fits[to as usize]], place).collect();
                wedges.change([from, to], found.into_iter(), is_nearer);
            }
            self.fits[to as usize].add_all(&more);
        }
        Some(())
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
