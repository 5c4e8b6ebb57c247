//! What a removal does to the surface, as quadrics tell it (Garland and Heckbert 1997), beside what it does to the shape of the triangles.

use super::Options;
use super::frame::Places;
use super::quadric::Quadric;
use super::star::Star;
use crate::mesh::{CornerTable, Vertex};
use glam::{DVec3, Vec3};

/// The quadrics of the vertices, and what both costs weigh.
#[derive(Debug)]
pub struct Metric {
    quadrics: Vec<Quadric>,
    /// Mean length of the input's edges, above 0.
    mean_edge: f64,
    /// Area of the input.
    area: f64,
    /// What rounding to the lattice does to a star, as a cost.
    noise: f64,
    /// Of the lattice.
    step: f64,
    alpha: f64,
    beta: f64,
    /// Share of beta that this level pays for, above 0.
    share: f64,
    /// Whether a level has told it.
    is_set: bool,
}

/// What a removal costs.
#[derive(Clone, Copy, Debug)]
pub struct Energy {
    /// alpha C(v).
    pub distortion: f32,
    /// E(v): the distortion, and what the level pays for the shape.
    pub total: f32,
}

/// What a triangulation in place of a star loses.
#[derive(Clone, Copy, Debug, Default)]
pub struct Lost {
    /// Of the surface, in the star's units.
    pub distortion: f32,
    /// Of the values at corners, in the fourth power of the cube's unit.
    pub values: f64,
}

impl Lost {
    /// Of values only.
    pub fn values(values: f64) -> Self {
        Self { distortion: 0.0, values }
    }
}

impl Energy {
    /// Of a vertex that cannot be removed.
    pub const NEVER: Self = Self { distortion: f32::INFINITY, total: f32::INFINITY };
}

impl Metric {
    /// Assigns quadrics and the scale that both costs are measured in.
    pub fn new(table: &CornerTable, places: &Places, options: &Options) -> Self {
        let (quadrics, mean_edge, area) = assign_quadrics(table, places);
        // The variance of what is uniform in a cell, over an area of one.
        let noise = options.alpha * (places.frame.step() / mean_edge).powi(2) / 12.0;
        // Before anything is known of the surface, a triangulation is as near to it as can be.
        Self {
            quadrics,
            mean_edge,
            area,
            noise,
            step: places.frame.step(),
            alpha: options.alpha,
            beta: options.beta,
            share: f64::MIN_POSITIVE,
            is_set: false,
        }
    }

    /// Shape counts for so much of what it did.
    pub fn weigh_shape(&mut self, share: f64) {
        self.beta *= share;
    }

    /// What rounding to the lattice costs anyway: the variance of a place in its cell, over a squared mean edge.
    pub fn noise(&self) -> f32 {
        self.noise as f32
    }

    /// E(v) of a vertex half a step of the lattice off the new surface, in a star of mean size, where so many vertices are left.
    pub fn negligible(&self, vertices: usize) -> f64 {
        // Three times as many corners as triangles share the area.
        let star = 3.0 * self.area / vertices.max(1) as f64;
        self.alpha * (0.5 * self.step).powi(2) * star / self.mean_edge.powi(4)
    }

    /// Whether a level has begun of which some distortions were known.
    pub fn is_set(&self) -> bool {
        self.is_set
    }

    /// What share of its weight shape has, and whether a level has told it.
    pub fn shape_share(&self) -> (f64, bool) {
        (self.share, self.is_set)
    }

    /// Sets that back.
    pub fn set_shape_share(&mut self, (share, is_set): (f64, bool)) {
        (self.share, self.is_set) = (share, is_set);
    }

    /// Whether shape counts for something: the surface is bent more or less alike.
    pub fn is_bent_alike(&self) -> bool {
        self.share >= ALIKE_ENOUGH
    }

    /// Begins a level of which some distortions are known. Returns whether shape counts otherwise than before.
    ///
    /// Where all of a surface is bent alike, it hardly matters to the level what goes first, and round triangles pay. Where the cheapest
    /// quarter is far flatter than the rest, as on a part of planes and cylinders, there is always something that goes for nothing, and
    /// shape counts as much less: the edges and holes that remain are all that the part consists of. Both sides of the ratio are
    /// distortions of this level, so neither the scale of the mesh nor its density matters; and as no more than rounding does, shape may
    /// cost anyway.
    pub fn begin_level(&mut self, mut distortions: Vec<f32>) -> bool {
        let Some(quarter) = lower_quartile(&mut distortions) else { return false };
        let roots: f64 = distortions.iter().map(|&distortion| f64::from(distortion).sqrt()).sum();
        let typical = (roots / distortions.len() as f64).powi(2);
        let unequal = if typical > 0.0 { ALIKE * f64::from(quarter) / typical } else { 1.0 };
        self.is_set = true;
        let before = self.share;
        self.share = unequal.max(self.noise / (REGULAR * self.beta)).clamp(f64::MIN_POSITIVE, 1.0);
        self.share != before
    }

    /// What a mean edge of shape costs, in distortions of the star: the unit that both have in its triangulation.
    #[inline]
    pub fn shape_price(&self, star: &Star) -> f32 {
        let scale = (star.mean_edge / self.mean_edge).powi(4);
        (self.beta * self.share / (self.alpha * scale).max(f64::MIN_POSITIVE)).clamp(LEAST, MOST) as f32
    }

    /// E(v) = alpha C(v) + beta S(v), over the fourth power of the mean edge length. C(v) is the quadric at the point `foot` of the new star
    /// nearest to v, but no less than this vertex alone makes, squared distance times area, and than the new triangles do, and what is
    /// `lost` of the values; `shape` is S(v) times its price.
    pub fn energy(&self, v: Vertex, star: &Star, foot: Vec3, lost: Lost, shape: f32) -> Energy {
        let unit = star.mean_edge.powi(2);
        let foot = star.outside(foot);
        let own = (foot.length_squared() * f64::from(star.area) * unit)
            .max(f64::from(lost.distortion) * unit * unit);
        let scale = self.alpha / self.mean_edge.powi(4);
        let distortion = (self.quadrics[v.index()].at(foot).max(own) + aside(star) + lost.values) * scale;
        let total = distortion + f64::from(shape) * unit * unit * scale;
        Energy { distortion: distortion as f32, total: total as f32 }
    }

    /// The link vertex that takes over the quadric of `v`: the one where those of both add up to least.
    pub fn heir(&self, v: Vertex, star: &Star) -> Vertex {
        let quadric = self.quadrics[v.index()];
        let value = |i: usize, w: Vertex| {
            quadric.at(star.outside(star.point(i))) + self.quadrics[w.index()].at(DVec3::ZERO)
        };
        let values = star.ring().iter().enumerate().map(|(i, &w)| (value(i, w), w));
        values.min_by(|x, y| x.0.total_cmp(&y.0)).map_or(v, |x| x.1)
    }

    /// Hands the quadric of `v` on to `heir`, which lies `between` away.
    pub fn hand_on(&mut self, v: Vertex, heir: Vertex, between: DVec3) {
        let quadric = self.quadrics[v.index()].seen_from(between);
        self.quadrics[heir.index()] += quadric;
    }
}

/// How far a vertex comes to lie beside its curve, or the borders that go with it where it slides: the squared distance times that of
/// their ends, as of a wall.
fn aside(star: &Star) -> f64 {
    let of_curve = |(a, b): (usize, usize)| {
        let off = star.foot([[a, a, b]].into_iter()).length_squared();
        let length = star.point(a).distance_squared(star.point(b));
        CURVE * f64::from(off) * f64::from(length) * star.mean_edge.powi(4)
    };
    match &star.slide {
        Some(parting) => {
            let is_border = |&place: &usize| parting.borders() >> place & 1 == 1 && place != parting.target();
            (0..star.ring().len()).filter(is_border).map(|place| of_curve((parting.target(), place))).sum()
        }
        None => star.curve.map_or(0.0, of_curve),
    }
}

/// The quadrics of all vertices, the mean length of an edge, and the area.
fn assign_quadrics(table: &CornerTable, places: &Places) -> (Vec<Quadric>, f64, f64) {
    let mut quadrics = vec![Quadric::default(); places.positions.len()];
    let (mut length, mut edges, mut area) = (0.0, 0usize, 0.0);
    for t in table.triangles() {
        let corners = t.corners().map(|c| places.at(table.vertex(c)));
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        let unit = normal.normalize_or_zero();
        area += normal.length() * 0.5;
        for (k, c) in t.corners().into_iter().enumerate() {
            let v = table.vertex(c);
            quadrics[v.index()] += Quadric::of_plane(unit, DVec3::ZERO, normal.length() * 0.5);
            let (x, y) = (corners[(k + 1) % 3], corners[(k + 2) % 3]);
            length += x.distance(y);
            edges += 1;
            if table.opposite(c).is_none() {
                // A wall on each boundary edge keeps the outline (Garland and Heckbert 1997, §6).
                let wall = Quadric::of_plane(
                    (y - x).cross(normal).normalize_or_zero(),
                    DVec3::ZERO,
                    OUTLINE * x.distance_squared(y),
                );
                let (v, w) = table.edge(c);
                quadrics[v.index()] += wall;
                quadrics[w.index()] += wall;
            }
        }
    }
    (quadrics, if edges > 0 && length > 0.0 { length / edges as f64 } else { 1.0 }, area)
}

/// The number that a quarter of some are below; `None` of none. They change places.
pub fn lower_quartile(numbers: &mut [f32]) -> Option<f32> {
    let at = numbers.len() / 4;
    (!numbers.is_empty()).then(|| *numbers.select_nth_unstable_by(at, f32::total_cmp).1)
}

/// Weight of a wall, as of Garland and Heckbert's: what is off the outline is seen against whatever lies behind it.
const OUTLINE: f64 = 10.0;
/// Weight of the distance from a curve: so curves are about as near to the input's as surfaces are. The surface behind it is the same.
const CURVE: f64 = 1.0;
/// How many times the lower quartile of the distortions may be below their typical value, the square of the mean root, for shape to count
/// in full. Where distances spread as a normal distribution does, it is below it 6 times.
const ALIKE: f64 = 30.0;
/// Share of its weight from which on shape counts for something. On a part of planes and cylinders it is thousands of times less.
const ALIKE_ENOUGH: f64 = 0.1;
/// About what the shape of a regular star of six is, in mean edges.
const REGULAR: f64 = 6.0;
/// Bounds of the price of shape, so that binary32 holds what is added up.
const LEAST: f64 = 1e-12;
const MOST: f64 = 1e6;

#[cfg(test)]
mod tests {
    use super::super::frame::Frame;
    use super::*;
    use crate::mesh::Lattice;

    /// Two triangles on a flat boundary with a bulge of height h at vertex 0; the lattice is the unit cube.
    fn bulge(h: f64, check: impl FnOnce(Metric, Star)) {
        let positions = [[0.5, 0.5 - h, 0.0], [1.0, 0.5, 0.0], [0.5, 1.0, 0.0], [0.0, 0.5, 0.0]];
        let table = CornerTable::from_triangles(4, &[[0, 1, 2], [0, 2, 3]]).unwrap();
        let lattice = Lattice { origin: [0.0; 3], step: 1.0 / 1023.0, bits: 10 };
        let places = Places { positions: &positions, frame: Frame::new(&lattice) };
        let metric = Metric::new(&table, &places, &Options::default());
        let link = [1, 2, 3].map(Vertex).into_iter();
        let star = Star::new(link, true, places.at(Vertex(0)), |v| places.at(v)).unwrap();
        check(metric, star);
    }

    /// The foot is off the line of either edge by h / 2l, l its length, and the weight of its wall is 10 l².
    #[test]
    fn the_outline_weighs_as_walls_do() {
        let h = 0.01;
        bulge(h, |metric, star| {
            let foot = star.foot([[0, 0, 2]].into_iter());
            let energy = metric.energy(Vertex(0), &star, foot, Lost::default(), 0.0);
            let expected = 0.75 * 2.0 * 10.0 * (0.5 * h).powi(2) / metric.mean_edge.powi(4);
            assert!(
                (f64::from(energy.total) / expected - 1.0).abs() < 0.01,
                "{} for {expected}",
                energy.total
            );
        });
    }

    /// Distances that spread as a normal distribution does leave shape its full weight, whatever their scale; where a third is flat it
    /// has next to none.
    #[test]
    fn shape_counts_where_all_is_bent_alike() {
        for scale in [1e-8f32, 1e-4, 1.0] {
            bulge(0.1, |mut metric, star| {
                metric.noise = 0.0;
                metric.begin_level(vec![scale; 3]);
                let full = metric.shape_price(&star);
                // The quantiles of the half normal distribution at 5 %, 15 %, ... 95 %.
                let normal = [0.063f32, 0.189, 0.319, 0.454, 0.598, 0.755, 0.935, 1.150, 1.440, 1.960];
                metric.begin_level(normal.map(|x| scale * x * x).to_vec());
                assert_eq!(metric.shape_price(&star), full);
                let flat = normal.iter().enumerate().map(|(i, x)| if i < 4 { 1e-12 * x } else { *x });
                metric.begin_level(flat.map(|x| scale * x * x).collect());
                assert!(metric.shape_price(&star) < 1e-3 * full);
            });
        }
    }

    /// As much as rounding to the lattice costs, shape may cost anyway.
    #[test]
    fn below_the_lattice_shape_counts() {
        bulge(0.1, |mut metric, star| {
            metric.begin_level(vec![0.0, 0.0, 0.0, 1.0]);
            let paid = metric.shape_price(&star);
            let unit = (star.mean_edge / metric.mean_edge).powi(4);
            let regular = f64::from(paid) * REGULAR * unit * metric.alpha;
            assert!((regular / metric.noise - 1.0).abs() < 0.01, "{regular} for {}", metric.noise);
        });
    }
}
