//! HQMS: passes over the vertices, each of which contracts what a small heap picks, in linear time.
//!
//! H. K. Chen, C. S. Fahn, J. J. P. Tsai, R. M. Chen, M. B. Lin: "A linear time algorithm for high quality mesh simplification" (2004) and
//! "Generating high-quality discrete LOD meshes for 3D computer games in linear time" (2006). A pass goes over the vertices in their
//! order; each proposes the cheapest contraction of itself into a neighbour, by the planes of its own triangles; the heap of replacement
//! selection gives them back cheapest first, and those whose vertices are still as they were are carried out, with the vertex at the
//! optimum for both. So no vertex takes part in two contractions of a pass, and the rings of a pass need no change.
//!
//! Beyond the papers: planes count by area, and planes through the boundary hold it; the link condition and the normals are checked; only
//! contractions below a quantile of the costs are proposed, because without it a pass removes all that it can, creases included; no vertex may
//! end farther off the triangles that are left of it than where planes as large as a vertex has on average cost that quantile, because
//! nothing remembers the input's planes, and those of thin tips let them be worn away; the vertex goes where it keeps the volume; the last
//! passes pick from fewer contractions than the first ones; and the last one takes no more than it needs, all over the mesh instead of its
//! first part.

use super::collapse::{Limits, Pair, Placement, Rules, Topology};
use super::quadric::{Form, Quadric, Weights};
use super::selection::{Record, Selection};
use super::star::{GONE, Star, relative, turned};
use super::wedges::{Fits, Sides, Spoke};
use super::working::{DIRTY, FIXED, Working};
use super::{Edition, Options, Pass, Strategy, Ticker};
use crate::error::Result;
use crate::mesh::random::SplitMix64;
use glam::DVec3;

mod attributes;

/// Makes passes until at most `faces` triangles are left or none can go.
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub(super) fn run(
    working: &mut Working,
    faces: usize,
    options: &Options,
    ticker: &mut Ticker,
) -> Result<Vec<Pass>> {
    let scheme = Scheme::of(options);
    let is_free = !matches!(scheme.rules.topology, Some(Topology::Keep | Topology::Close));
    working.fix(is_free, options.lock_boundary);
    let mut passes = Vec::new();
    let mut pipeline = Pipeline {
        working,
        faces,
        scheme,
        pair: Pair::default(),
        spokes: Vec::new(),
        ends: Vec::new(),
        fits: [Fits::default(), Fits::default()],
        sides: None,
        is_thorough: false,
        limits: Limits::NONE,
    };
    // What a pass in vain lets propose more.
    let (mut cap, mut slack) = (scheme.cap, 1.0);
    while pipeline.working.living > faces {
        let vertices = pipeline.working.positions.len();
        let triangles = pipeline.working.living;
        // A contraction takes two triangles with it.
        let wanted = (triangles - faces).div_ceil(2);
        let need = if scheme.spreads { 1.6 * wanted as f64 / vertices as f64 + 0.02 } else { 1.0 };
        let pace = match scheme.spreads {
            true if triangles / NEAR < faces => LAST_PACE,
            true => FIRST_PACE,
            false => 1.0,
        };
        let share = (cap * pace).min(need * slack);
        let cost = pipeline.quantile(share, passes.len() as u64);
        pipeline.limits = Limits { cost, reach: pipeline.reach(cost) };
        let contractions = pipeline.pass(options.heap, ticker)?;
        pipeline.working.compact();
        let Working { positions, triangles: left, rings, .. } = &mut *pipeline.working;
        rings.rebuild(positions.len(), left);
        passes.push(Pass { vertices, triangles, contractions });
        if contractions < wanted.min(vertices / LEAST_SHARE).max(1) {
            if share < 1.0 {
                (cap, slack) = (cap * 2.0, slack * 4.0);
            } else if !pipeline.is_thorough && scheme.rules.topology.is_some() {
                pipeline.is_thorough = true;
            } else if contractions == 0 {
                break;
            }
        }
    }
    Ok(passes)
}

/// What the options make of the algorithm.
#[derive(Clone, Copy, Debug)]
struct Scheme {
    rules: Rules,
    weights: Weights,
    /// Whether planes through the edges of the boundary hold it.
    boundary_planes: bool,
    /// Whether vertices of the boundary go along it alone.
    along_boundary: bool,
    /// Whether the last of equal costs is taken.
    last_of_equal: bool,
    /// Most triangles round a vertex.
    max_degree: usize,
    strategy: Strategy,
    cap: f64,
    /// Whether the last passes take less than the first ones, and the last one no more than it needs from everywhere.
    spreads: bool,
}

impl Scheme {
    fn of(options: &Options) -> Self {
        let recommended = Self {
            rules: Rules { topology: Some(options.topology), normals: true, placement: Placement::Best },
            weights: options.weights,
            boundary_planes: true,
            along_boundary: true,
            last_of_equal: false,
            max_degree: usize::MAX,
            strategy: options.strategy,
            cap: options.cap,
            spreads: options.cap < 1.0,
        };
        let published = |placement| Self {
            rules: Rules { topology: None, normals: false, placement },
            weights: Weights::Unit,
            boundary_planes: false,
            cap: 1.0,
            spreads: false,
            ..recommended
        };
        match options.edition {
            None => recommended,
            Some(Edition::Of2004) => {
                Self { along_boundary: false, max_degree: 19, ..published(Placement::Optimum) }
            }
            Some(Edition::Of2006) => Self { last_of_equal: true, ..published(Placement::Ball) },
        }
    }
}

struct Pipeline<'a> {
    working: &'a mut Working,
    faces: usize,
    scheme: Scheme,
    pair: Pair,
    /// Neighbours of a vertex and where they are relative to it.
    spokes: Vec<(u32, DVec3)>,
    /// With attributes, the edges of a star.
    ends: Vec<Spoke>,
    /// With attributes, the values round the source and the target.
    fits: [Fits; 2],
    /// With attributes, which wedges the contraction that was looked at last joins, where the target does not rest.
    sides: Option<(Sides, bool)>,
    /// Whether a vertex proposes what can be carried out, though it may be dearer.
    is_thorough: bool,
    /// What a contraction may cost in this pass, and how far vertices may be off it.
    limits: Limits,
}

impl Pipeline<'_> {
    /// Proposes, selects and contracts over all vertices; returns how many contractions there were.
    fn pass(&mut self, heap: usize, ticker: &mut Ticker) -> Result<usize> {
        let mut selection = Selection::new(heap);
        let mut contractions = 0;
        for v in 0..self.working.positions.len() as u32 {
            if v.is_multiple_of(TICK) {
                ticker.tell(self.working.living)?;
            }
            let Some(record) = self.proposal(v).filter(|record| record.cost <= self.limits.cost) else {
                continue;
            };
            if let Some(record) = selection.replace(record) {
                contractions += usize::from(self.contract(record));
            }
            if self.working.living <= self.faces {
                return Ok(contractions);
            }
        }
        while let Some(record) = selection.pop() {
            contractions += usize::from(self.contract(record));
            if self.working.living <= self.faces {
                break;
            }
        }
        Ok(contractions)
    }

    /// The cost below which lie a share of the costs of some random vertices.
    fn quantile(&mut self, share: f64, seed: u64) -> f64 {
        let vertices = self.working.positions.len();
        if share >= 1.0 || vertices == 0 {
            return f64::INFINITY;
        }
        self.limits = Limits::NONE;
        let mut random = SplitMix64::new(seed);
        let draw = vertices.min(SAMPLE);
        let mut cost = |v| self.proposal(v).map_or(f64::INFINITY, |record| record.cost);
        let mut costs: Vec<f64> = if draw == vertices {
            (0..vertices as u32).map(&mut cost).collect()
        } else {
            (0..draw).map(|_| cost(random.below(vertices as u32))).collect()
        };
        // So many may be proposed, one at least.
        let at = ((share * draw as f64) as usize).clamp(1, draw) - 1;
        *costs.select_nth_unstable_by(at, f64::total_cmp).1
    }

    /// The square of the distance at which the planes of a vertex on average cost so much; more where that is next to none of their size, as
    /// on flat surfaces, whose costs are errors of rounding.
    fn reach(&self, cost: f64) -> f64 {
        let Working { positions, triangles, .. } = &*self.working;
        if cost.is_infinite() {
            return f64::INFINITY;
        }
        let area = |&[a, b, c]: &[u32; 3]| {
            let [b, c] = [b, c].map(|v| relative(positions[v as usize], positions[a as usize]));
            b.cross(c).length() / 2.0
        };
        // Each triangle is one of three vertices.
        let share = 3.0 / positions.len() as f64;
        let size = share * triangles.iter().map(area).sum::<f64>();
        let weight = match self.scheme.weights {
            Weights::Area => size,
            Weights::Unit => share * triangles.len() as f64,
        };
        (cost / weight).max(LEAST_REACH * size)
    }

    /// The cheapest contraction of a vertex into one of its neighbours, by the planes of its triangles.
    fn proposal(&mut self, v: u32) -> Option<Record> {
        let Working { positions, triangles, flags, rings, .. } = &*self.working;
        if flags[v as usize] != 0 {
            return None;
        }
        if self.working.wedges.is_some() {
            return self.proposal_with_attributes(v);
        }
        let origin = positions[v as usize];
        let mut form = Form::default();
        // Within, each neighbour is in two triangles; on the boundary two are in one.
        let (mut parity, mut degree) = (0, 0);
        self.spokes.clear();
        for &t in rings.of(v) {
            let Some([a, b]) = turned(triangles[t as usize], v) else { continue };
            let [at_a, at_b] = [a, b].map(|v| relative(positions[v as usize], origin));
            form.add_triangle(at_a.cross(at_b), self.scheme.weights);
            self.spokes.push((a, at_a));
            parity ^= a ^ b;
            degree += 1;
        }
        if parity != 0 {
            form = self.boundary_spokes(v);
        }
        if self.is_thorough {
            let choices = self.spokes.iter().map(|&(target, at)| (form.at(at).max(0.0), target)).collect();
            return self.thorough(v, choices);
        }
        let Working { flags, rings, .. } = &*self.working;
        let mut best = Record { cost: f64::INFINITY, source: v, target: u32::MAX };
        for &(target, at) in &self.spokes {
            let cost = form.at(at).max(0.0);
            let is_better = cost < best.cost || self.scheme.last_of_equal && cost == best.cost;
            // The triangles at the edge go.
            let fits = || degree + rings.of(target).len() <= self.scheme.max_degree.saturating_add(2);
            if is_better && flags[target as usize] & DIRTY == 0 && fits() {
                best = Record { cost, target, ..best };
            }
        }
        (best.target != u32::MAX).then_some(best)
    }

    /// Leaves the neighbours of a vertex of the boundary to which it may go, and returns its planes.
    fn boundary_spokes(&mut self, v: u32) -> Form {
        let Working { positions, triangles, rings, .. } = &*self.working;
        let star = &mut self.pair.source;
        star.gather(v, rings.of(v), triangles, positions, positions[v as usize]);
        self.spokes.clear();
        let along = self.scheme.along_boundary && star.is_boundary();
        let allowed = star.neighbours.iter().filter(|n| !along || n.triangles == 1);
        self.spokes.extend(
            allowed.map(|n| (n.vertex, relative(positions[n.vertex as usize], positions[v as usize]))),
        );
        star.form(self.scheme.weights, self.scheme.boundary_planes)
    }

    /// The cheapest contraction that can be carried out as things are.
    fn thorough(&mut self, v: u32, mut choices: Vec<(f64, u32)>) -> Option<Record> {
        choices.sort_by(|x, y| x.0.total_cmp(&y.0).then(x.1.cmp(&y.1)));
        choices.truncate(MOST_CHOICES);
        let can = |&(cost, target): &(f64, u32)| {
            let record = Record { cost, source: v, target };
            self.place(record).map(|_| record)
        };
        choices.iter().find_map(can)
    }

    /// Where the vertex of a contraction goes, if it can be carried out; leaves its stars in `pair`.
    fn place(&mut self, record: Record) -> Option<DVec3> {
        let Record { source, target, .. } = record;
        let Working { positions, triangles, flags, rings, .. } = &*self.working;
        let [source_flags, target_flags] = [source, target].map(|v| flags[v as usize]);
        if (source_flags | target_flags) & DIRTY != 0 {
            return None;
        }
        let origin = positions[source as usize];
        self.pair.source.gather(source, rings.of(source), triangles, positions, origin);
        self.pair.target.gather(target, rings.of(target), triangles, positions, origin);
        let mut place = None;
        let (mut extra, mut is_fixed) = (Quadric::default(), target_flags & FIXED != 0);
        if self.pair.is_allowed(self.scheme.rules.topology) && self.joins(&mut extra, &mut is_fixed) {
            let forms = [&self.pair.source, &self.pair.target].map(|star| self.form(star));
            place = self.pair.place(forms, &extra, is_fixed, &self.scheme.rules, self.limits);
        }
        let Working { flags, .. } = &mut *self.working;
        if place.is_none() && self.pair.target.wings.len() > MANY {
            // Or else all round it would try in vain, and each would look at all of its triangles.
            flags[target as usize] |= DIRTY;
        }
        place
    }

    /// Carries a contraction out if it still can be.
    fn contract(&mut self, record: Record) -> bool {
        let Some(place) = self.place(record) else { return false };
        let Record { source, target, .. } = record;
        self.join(place);
        let Working { positions, triangles, flags, living, parents, .. } = &mut *self.working;
        if let Some(parents) = parents {
            parents.merge(source, target);
        }
        if place != self.pair.target.at {
            let origin = positions[source as usize];
            positions[target as usize] = std::array::from_fn(|k| origin[k] + place[k]);
        }
        for wing in self.pair.at_edge() {
            triangles[wing.triangle as usize] = GONE;
            *living -= 1;
        }
        for wing in self.pair.moved() {
            let corners = &mut triangles[wing.triangle as usize];
            corners[super::wedges::place(*corners, source)] = target;
        }
        for &t in &self.pair.repeated {
            triangles[t as usize] = GONE;
            *living -= 1;
        }
        let mut mark = |v: u32| flags[v as usize] |= DIRTY;
        mark(source);
        mark(target);
        match self.scheme.strategy {
            Strategy::One => {}
            Strategy::Two => self.pair.at_edge().flat_map(|wing| [wing.a, wing.b]).for_each(mark),
            Strategy::Three => {
                let stars = [&self.pair.source, &self.pair.target];
                stars.into_iter().flat_map(|star| &star.neighbours).for_each(|n| mark(n.vertex));
            }
        }
        true
    }
}

/// Vertices whose costs are sampled.
const SAMPLE: usize = 4096;
/// Whatever the costs, vertices may be off by the root of this part of the area round one.
const LEAST_REACH: f64 = 1e-4;
/// Vertices between two reports.
const TICK: u32 = 1 << 14;
/// The errors of a mesh are mostly those of the last contractions, since costs grow as triangles do. Passes that begin with fewer than so
/// many times the triangles that are wanted therefore pick from fewer, in an order nearer to that of the costs; those before, from more,
/// which takes back the time.
const NEAR: usize = 4;
/// Parts of the cap, near the end and before.
const LAST_PACE: f64 = 0.5;
const FIRST_PACE: f64 = 1.2;
/// A pass that removes less than one vertex of so many, and less than is wanted, comes to the end of what it can do.
const LEAST_SHARE: usize = 32;
/// Neighbours that a thorough proposal looks at.
const MOST_CHOICES: usize = 16;
/// More triangles than this round a vertex are looked at once a pass.
const MANY: usize = 256;

#[cfg(test)]
mod tests;
