//! What removing a vertex costs, and removing it: the part that `ffc` and `stellar` share.

use super::Options;
use super::bodies::Bodies;
use super::covering::Covering;
use super::frame::Places;
use super::lines::Lines;
use super::metric::{Energy, Lost, Metric};
use super::polygon::{MAX_SIDES, Shape, Triangulation};
use super::rows::Pattern;
use super::seams::Ways;
use super::seconds::Stopwatch;
use super::shadow::Shadow;
use super::star::Star;
use super::values::{Around, Corners};
use crate::mesh::prefetch::prefetch;
use crate::mesh::{Corner, CornerTable, Triangle, Vertex};
use crate::refine::labels::Slid;
use crate::refine::operation::has_triangle;
use crate::refine::{History, Operation, Site};
use bitvec::vec::BitVec;
use glam::Vec3;
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
    /// The vertices that have gone onto others, in its order.
    pub slid: Vec<Slid>,
    /// Removed vertices and where they lie.
    pub covering: Covering,
    /// Vertices left.
    pub vertices: usize,
    /// Where the time goes.
    pub watch: Stopwatch,
    /// In a level by parity, its pattern.
    pub pattern: Option<Pattern>,
    /// In levels along straight lines, these.
    pub lines: Option<Lines>,
    metric: Metric,
    energies: Energies,
    barred: Barred,
    /// Whether charts may be given up.
    gives_up: bool,
    corners: Option<Corners>,
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

/// What must stay of a mesh.
#[derive(Debug)]
pub struct Kept {
    /// Vertices.
    pub locked: BitVec,
    /// Whether charts may be given up that need not stay.
    pub gives_up: bool,
    /// As far as it goes, what corners are worth.
    pub corners: Option<Corners>,
    /// Which vertices are of which body.
    pub bodies: Bodies,
}

/// The vertices that must stay.
#[derive(Debug)]
struct Barred {
    /// At all levels.
    locked: BitVec,
    /// In this level: those on the link of a vertex removed.
    blocked: BitVec,
}

impl<'a> Remover<'a> {
    /// A mesh with all its vertices.
    pub fn new(table: CornerTable, places: Places<'a>, kept: Kept, options: &Options) -> Self {
        let Kept { locked, gives_up, corners, bodies } = kept;
        let count = places.positions.len();
        let vertices = vertices(&table).count();
        let mut watch = Stopwatch::default();
        let metric = watch.assign(|| Metric::new(&table, &places, options));
        Self {
            vertices,
            covering: Covering::new(&table, &places, bodies),
            history: History::default(),
            slid: Vec::new(),
            pattern: None,
            lines: None,
            energies: Energies {
                costs: vec![f32::NAN; count],
                distortions: vec![f32::NAN; count],
                shapes: vec![Shape::NONE; count],
            },
            barred: Barred { locked, blocked: BitVec::repeat(false, count) },
            gives_up,
            corners,
            room: Default::default(),
            table,
            places,
            watch,
            metric,
        }
    }

    /// Shape counts for so much of what it did.
    pub fn weigh_shape(&mut self, share: f64) {
        self.metric.weigh_shape(share);
        self.energies.costs.fill(f32::NAN);
    }

    /// Begins a level: nothing is blocked.
    pub fn begin_level(&mut self, pattern: Option<Pattern>) {
        // What removed triangles have left is most of the memory by and by, and what is near each other is read sooner.
        if SPARSE * self.table.slots() > (SPARSE + 1) * self.table.triangle_count() {
            self.covering.compact(&self.table);
            if let Some(corners) = &mut self.corners {
                let there: Vec<_> = self.table.triangles().collect();
                corners.compact(&there);
            }
            self.table.close_up();
        }
        // The pattern is part of what a removal costs.
        if pattern.is_some() || self.pattern.is_some() {
            self.energies.costs.fill(f32::NAN);
        }
        self.pattern = pattern;
        self.barred.blocked.fill(false);
    }

    /// The vertices neither locked nor where the level follows a pattern, and some finite E(v): those of one in `every`, picked at random.
    pub fn candidates(&mut self, every: u32) -> (Vec<Vertex>, Vec<f32>) {
        let start = std::time::Instant::now();
        let mut free = Vec::with_capacity(self.vertices);
        free.extend(self.free().filter(|&v| !self.follows(v)));
        let picked: Vec<_> = free.iter().copied().filter(|&v| is_picked(v, every)).collect();
        self.probe();
        let distortions = self.distortions(picked.iter().copied());
        self.metric.begin_level(distortions);
        let sample = self.known_costs(&picked);
        self.watch.seconds.cost += start.elapsed().as_secs_f64();
        (free, sample)
    }

    /// The vertices of the classes up to the one that goes, those before it first, where the level follows a pattern; and some of their
    /// costs, as in [`Remover::candidates`].
    pub fn of_pattern(&mut self, every: u32) -> (Vec<Vertex>, Vec<f32>) {
        let Some(class) = self.pattern.as_ref().map(|pattern| pattern.class) else {
            return Default::default();
        };
        let start = std::time::Instant::now();
        let of = |v: &Vertex| self.pattern.as_ref().map_or(class, |pattern| pattern.class_of(*v));
        let followed: Vec<_> = self.free().filter(|&v| self.follows(v) && of(&v) <= class).collect();
        let (mut left, mut of_class): (Vec<_>, Vec<_>) = followed.into_iter().partition(|v| of(v) < class);
        let picked: Vec<_> = of_class.iter().copied().filter(|&v| is_picked(v, every)).collect();
        for &v in &picked {
            self.renew_cost(v);
        }
        let sample = self.known_costs(&picked);
        left.append(&mut of_class);
        self.watch.seconds.cost += start.elapsed().as_secs_f64();
        (left, sample)
    }

    /// The two vertices that `v` lies exactly between, if the surface loses no more than rounding does where an edge joins them in its place.
    pub fn between(&self, v: Vertex) -> Option<[Vertex; 2]> {
        let mut star = self.any_star(v).filter(|star| !star.boundary)?;
        let ring = star.ring();
        let most = (2.0 * STRAIGHT / star.mean_edge) as f32;
        let pairs = (0..ring.len()).flat_map(|i| (i + 2..ring.len()).map(move |j| (i, j)));
        let off = |&(i, j): &(usize, usize)| (star.point(i) + star.point(j)).length_squared();
        let (i, j) = pairs
            .filter(|pair| off(pair) <= most * most && *pair != (0, ring.len() - 1))
            .min_by(|x, y| off(x).total_cmp(&off(y)))?;
        let mates = [ring[i], ring[j]];
        star.curve = Some((i, j));
        let price = self.metric.shape_price(&star);
        let solved = star.solve(price, |i, j| self.price(v, &star, None, price, i, j));
        let best = solved.shape.triangulation()?;
        let lost = Lost { distortion: star.distortion(best.triangles.iter()), values: 0.0 };
        let energy = self.metric.energy(v, &star, Vec3::ZERO, lost, 0.0);
        self.is_negligible(energy.distortion).then_some(mates)
    }

    /// Goes on along lines, or begins to; returns whether there are any.
    pub fn follow_lines(&mut self) -> bool {
        // Of what corners are worth nothing is known here, and charts have edges of their own.
        if self.corners.is_some() {
            return false;
        }
        if self.lines.as_ref().is_none_or(|lines| lines.order.is_empty()) {
            let begins = self.lines.is_none();
            self.end_lines();
            self.lines = Lines::new(self);
            // Where all is bent, what is straight is so by chance.
            if begins && self.lines.is_some() && self.seems_bent_alike() {
                self.lines = None;
            }
            if self.lines.is_some() {
                self.energies.costs.fill(f32::NAN);
            }
        }
        self.lines.is_some()
    }

    /// Gives up what is left of lines.
    pub fn end_lines(&mut self) {
        if self.lines.take().is_some() {
            // The edges to be made are part of what a removal costs.
            self.energies.costs.fill(f32::NAN);
        }
    }

    /// Whether a vertex is blocked in this level.
    #[inline]
    pub fn is_blocked(&self, v: Vertex) -> bool {
        self.barred.blocked[v.index()]
    }

    /// Whether no more than rounding does is lost of the surface without a vertex of which the cost is known.
    pub fn loses_nothing(&self, v: Vertex) -> bool {
        self.is_negligible(self.energies.distortions[v.index()])
    }

    fn is_negligible(&self, distortion: f32) -> bool {
        f64::from(distortion) <= self.negligible()
    }

    /// What corners are worth, if anything.
    pub fn corners(&self) -> Option<&Corners> {
        self.corners.as_ref()
    }

    /// How many vertices are locked.
    pub fn held(&self) -> usize {
        vertices(&self.table).filter(|v| self.barred.locked[v.index()]).count()
    }

    /// How many vertices there are at which charts meet that may be given up, in another way than along curves through them.
    pub fn at_corners(&self) -> usize {
        let Some(corners) = self.corners.as_ref().filter(|_| self.gives_up) else { return 0 };
        self.free().filter(|&v| corners.are_corners(&self.table, v) == [true, false]).count()
    }

    /// Whether there are charts that may be given up.
    pub fn has_charts(&self) -> bool {
        self.gives_up
    }

    /// From here on no charts are kept but those that must be.
    pub fn drop_charts(&mut self) {
        self.gives_up = false;
        if let Some(corners) = &mut self.corners {
            corners.drop_charts();
        }
        self.energies.costs.fill(f32::NAN);
    }

    /// Whether the surface is bent more or less alike, so that the shape of triangles counts.
    pub fn is_bent_alike(&mut self) -> bool {
        self.probe();
        self.metric.is_bent_alike()
    }

    /// The same, of what is not known yet, which it leaves unknown.
    fn seems_bent_alike(&mut self) -> bool {
        let known = self.metric.shape_share();
        let alike = self.is_bent_alike();
        self.metric.set_shape_share(known);
        self.energies.costs.fill(f32::NAN);
        alike
    }

    /// Before anything is known of the surface, a few vertices tell what is flat.
    fn probe(&mut self) {
        if self.metric.is_set() {
            return;
        }
        let free: Vec<_> = self.free().collect();
        let few = free.len().div_ceil(PROBES).max(1);
        let distortions = self.distortions(free.into_iter().step_by(few));
        if self.metric.begin_level(distortions) {
            self.energies.costs.fill(f32::NAN);
        }
    }

    /// The vertices not locked.
    pub fn free(&self) -> impl Iterator<Item = Vertex> + '_ {
        vertices(&self.table).filter(|v| !self.barred.locked[v.index()])
    }

    /// The finite E(v) of some vertices, which are known.
    fn known_costs(&self, of: &[Vertex]) -> Vec<f32> {
        of.iter().map(|v| self.energies.costs[v.index()]).filter(|cost| cost.is_finite()).collect()
    }

    /// Whether the level follows a pattern at a vertex.
    #[inline]
    fn follows(&self, v: Vertex) -> bool {
        self.pattern.as_ref().is_some_and(|pattern| pattern.holds(v))
    }

    /// E(v) of a vertex half a step of the lattice off the new surface, in a star of mean size.
    pub fn negligible(&self) -> f64 {
        self.metric.negligible(self.vertices)
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
        let Some(mut star) = self.star(v) else { return (Energy::NEVER, Shape::NONE) };
        let around = self.around(v, &star);
        let mut best = (Energy::NEVER, Shape::NONE);
        self.each_way(v, &mut star, around.as_ref(), |star, around| {
            let found = self.energy_of(v, star, around);
            if best.0.total > found.0.total {
                best = found;
            }
        });
        best
    }

    /// Tells of each way that a vertex may go, as far as charts leave it one.
    fn each_way(
        &self,
        v: Vertex,
        star: &mut Star,
        around: Option<&(&Corners, Around)>,
        mut tell: impl FnMut(&Star, Option<&(&Corners, Around)>),
    ) {
        let Some((corners, values)) = around else { return tell(star, None) };
        match Ways::new(star, corners.borders(star, values)) {
            Ways::Free if star.ring().len() == 2 => {
                if corners.may_shed(&self.table, self.table.corner_of(v)) {
                    tell(star, around);
                }
            }
            Ways::Free => tell(star, around),
            Ways::Along(curve) => {
                star.curve = Some(curve);
                tell(star, around);
            }
            Ways::Onto(places) => {
                for parting in places.filter(|parting| values.fits(parting)) {
                    star.slide = Some(parting);
                    tell(star, around);
                }
            }
        }
    }

    /// The same of a star that goes in one way.
    fn energy_of(&self, v: Vertex, star: &Star, around: Option<&(&Corners, Around)>) -> (Energy, Shape) {
        if star.ring().len() == 2 {
            let ear = || [[0, 0, 1]].into_iter();
            let of_ear = |(corners, around): &(&Corners, Around)| corners.price(star, around, ear(), None);
            let values = around.map_or(0.0, of_ear);
            return (self.metric.energy(v, star, star.foot(ear()), Lost::values(values), 0.0), Shape::NONE);
        }
        let price = self.metric.shape_price(star);
        let values = around.map(|(corners, around)| (*corners, around));
        let solved = star.solve(price, |i, j| self.price(v, star, values, price, i, j));
        let Some(best) = solved.shape.triangulation() else { return (Energy::NEVER, Shape::NONE) };
        // A vertex of the boundary is to be near the new boundary: where it turns inwards, it lies on the new triangles.
        let sides = star.ring().len();
        let foot = if star.boundary {
            star.foot([[0, 0, sides - 1]].into_iter())
        } else {
            star.foot(best.triangles.iter())
        };
        let distortion = star.distortion(best.triangles.iter());
        let (mut lost, mut crossed) = (0.0, 0.0);
        if let Some((corners, around)) = values {
            let made = best.diagonals().chain(star.boundary.then_some((0, sides - 1)));
            crossed = made.map(|edge| crossing(corners, star, around, edge)).sum();
            let edge = self.edge_left(v, star, &best, values);
            lost = corners.price(star, around, best.triangles.iter(), edge)
                + f64::from(crossed) * star.mean_edge.powi(4);
            if star.slide.is_some() {
                lost *= SLIDES;
            }
        }
        // Where a pattern is followed, it settles the shape.
        let shape = if self.follows(v) { 0.0 } else { (solved.cost - distortion - crossed).max(0.0) };
        (self.metric.energy(v, star, foot, Lost { distortion, values: lost }, shape), solved.shape)
    }

    /// The values at the corners of a star, if there are any.
    fn around(&self, v: Vertex, star: &Star) -> Option<(&Corners, Around)> {
        self.corners.as_ref().map(|corners| (corners, corners.around(&self.table, v, star)))
    }

    /// The edge that is to be left of a star, the one to be split, as places on the link: the curve's, or the one the pattern keeps, then the
    /// one at which least of the values is lost, then the one whose midpoint is nearest; `None` where a face is left.
    fn edge_left(
        &self,
        v: Vertex,
        star: &Star,
        best: &Triangulation,
        values: Option<(&Corners, &Around)>,
    ) -> Option<(usize, usize)> {
        if star.boundary {
            return Some((star.ring().len() - 1, 0));
        }
        if star.curve.is_some() {
            return star.curve;
        }
        // Where nothing parts, or the parts are given, any edge will do.
        let parted = values.filter(|(_, around)| !around.is_whole() && star.slide.is_none());
        let lost = |edge: (usize, usize)| {
            parted.map_or(0.0, |(corners, around)| {
                corners.price(star, around, best.triangles.iter(), Some(edge))
            })
        };
        let cost = |&(i, j): &(usize, usize)| {
            let middle = (star.point(i) + star.point(j)) * 0.5;
            (self.bias(v, star, i, j), lost((i, j)), middle.length_squared())
        };
        let costs = best.diagonals().map(|d| (cost(&d), d));
        costs.min_by(|x, y| x.0.partial_cmp(&y.0).unwrap_or(Equal)).map(|x| x.1)
    }

    /// The star of a vertex, if it can be removed at all.
    #[inline]
    fn star(&self, v: Vertex) -> Option<Star> {
        let mut star = self.any_star(v);
        if let (Some(star), Some(mates)) = (&mut star, self.lines.as_ref().and_then(|lines| lines.mates(v))) {
            star.curve = places_of(star.ring(), mates);
        }
        star
    }

    #[inline]
    fn any_star(&self, v: Vertex) -> Option<Star> {
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

    /// What an edge in place of `v` costs, in distortions of the star, of which a mean edge is worth `price`: its middle is to be near the
    /// vertex, from where its position is predicted.
    #[inline]
    fn price(
        &self,
        v: Vertex,
        star: &Star,
        values: Option<(&Corners, &Around)>,
        price: f32,
        i: usize,
        j: usize,
    ) -> f32 {
        if star.is_across(i, j) {
            return f32::INFINITY;
        }
        let middle = 0.5 * (star.point(i) + star.point(j)).length();
        // A pattern that is followed comes before all else, distortions included.
        let dear = if self.follows(v) { price.max(1.0) } else { price };
        let lost = values.map_or(0.0, |(corners, around)| crossing(corners, star, around, (i, j)));
        // Beside a line either diagonal of four vertices may do; all are to run the same way, so that they are expected.
        let turned = self.lines.is_some() && star.turns_left(i, j);
        let middle = if turned { middle + HANDED } else { middle };
        price * MIDDLE * middle + dear * self.bias(v, star, i, j) + lost
    }

    /// What the pattern adds to the cost of an edge, in mean edges.
    #[inline]
    fn bias(&self, v: Vertex, star: &Star, i: usize, j: usize) -> f32 {
        let way = || star.point(j) - star.point(i);
        self.pattern.as_ref().map_or(0.0, |pattern| pattern.bias(v, [star.ring()[i], star.ring()[j]], way()))
    }

    /// The cheapest way to remove `v`, or `None` where the one rule (no new edge may exist already) leaves none.
    fn plan(&self, v: Vertex) -> Option<Removal> {
        let mut star = self.star(v)?;
        let around = self.around(v, &star);
        let mut ways = Vec::new();
        self.each_way(v, &mut star, around.as_ref(), |star, around| {
            // Of several ways the cost is of one.
            let (energy, shape) = match star.slide {
                Some(_) => self.energy_of(v, star, around),
                None => (Energy::NEVER, self.energies.shapes[v.index()]),
            };
            ways.push((energy.total, shape, star.clone()));
        });
        ways.sort_by(|x, y| x.0.total_cmp(&y.0));
        let values = around.as_ref().map(|(corners, around)| (*corners, around));
        ways.into_iter().find_map(|(_, shape, star)| self.plan_of(v, star, shape, values))
    }

    /// The same of a star that goes in one way, of which this is the best triangulation but for edges that exist already.
    fn plan_of(
        &self,
        v: Vertex,
        star: Star,
        mut shape: Shape,
        values: Option<(&Corners, &Around)>,
    ) -> Option<Removal> {
        let table = &self.table;
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
                if exists[i][j] { f32::INFINITY } else { self.price(v, &star, values, price, i, j) }
            };
            shape = star.solve(price, edge).shape;
        };
        let diagonal = self.edge_left(v, &star, &best, values);
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
        let slid =
            self.corners.as_mut().and_then(|corners| corners.read(&self.table, v, plan.site, &plan.star));
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
        if let Some(corners) = &mut self.corners {
            corners.settle(&self.table, plan.site, slid.as_ref());
        }
        self.slid.extend(slid);
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
        let mut known = [0.0; MAX_SIDES];
        for (&t, known) in star.iter().zip(&mut known) {
            let before = covered.len();
            self.covering.take(t, &mut covered);
            *known = self.covering.known(t, &covered[before..]);
        }
        let known = &known[..star.len()];
        star.retain(|t| t.index() < self.table.slots() && self.table.is_live(*t));
        if star.is_empty() {
            star.push(inner.triangle());
        }
        self.covering.put(&self.table, &self.places, &covered, &star);
        let mut shadow = None;
        let bound = |a, b| shadow.get_or_insert_with(|| Shadow::new(&plan.star)).bound(a, b, known);
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

/// The places i < j on a link of two vertices that are not neighbours there.
fn places_of(ring: &[Vertex], vertices: [Vertex; 2]) -> Option<(usize, usize)> {
    let [a, b] = vertices.map(|v| ring.iter().position(|&w| w == v));
    let (i, j) = (a?.min(b?), a?.max(b?));
    (j - i > 1 && j - i < ring.len() - 1).then_some((i, j))
}

/// What of the values is lost where an edge takes the place of spokes; where the vertex goes onto one of its link, those from there to others
/// bring its own values along.
fn crossing(corners: &Corners, star: &Star, around: &Around, (i, j): (usize, usize)) -> f32 {
    match &star.slide {
        Some(parting) if [i, j].contains(&parting.target()) => 0.0,
        _ => corners.along(star, around, (i, j)),
    }
}

/// Whether a vertex is one of those that tell of all, one in `every`: by a hash, as the order of the vertices may have a pattern.
fn is_picked(v: Vertex, every: u32) -> bool {
    every == 1 || (v.0.wrapping_mul(0x9e37_79b1) >> 16).is_multiple_of(every)
}

/// How far off the middle between two others a vertex on a line may be, over the side of the cube: about what binary32 keeps of coordinates.
const STRAIGHT: f64 = 1.0 / (1 << 21) as f64;

/// What an edge costs beside a line that runs the other way than most, as a distance of its middle.
const HANDED: f32 = 0.2;

/// What an edge costs for the distance of its middle from the vertex removed.
const MIDDLE: f32 = 1.5;

/// What the loss of values weighs where a vertex goes onto another one: all that is round it is drawn there, where edges crossed tell of what lies
/// between elsewhere.
const SLIDES: f64 = 3.0;

/// Triangles that are left, for each place more from which on these are given back.
const SPARSE: usize = 4;

/// Vertices that tell what is flat, before anything is known.
const PROBES: usize = 512;

/// Triangles looked at round each of two vertices before an edge between them is presumed: where both have more, as two apexes
/// over one long rim, every removal on the rim would look at all of them.
const FAN: usize = 1000;
