//! What a removal does to the surface, as quadrics tell it (Garland and Heckbert 1997), beside what it does to the shape of the triangles.

use super::Options;
use super::frame::Places;
use super::quadric::Quadric;
use super::star::Star;
use crate::mesh::{CornerTable, Vertex};
use glam::{DVec3, Vec3};

/// The quadrics of the vertices, and the scale and the weights of both costs.
#[derive(Debug)]
pub struct Metric {
    quadrics: Vec<Quadric>,
    /// Mean length of the input's edges, above 0.
    mean_edge: f64,
    alpha: f64,
    beta: f64,
}

impl Metric {
    /// Assigns quadrics and the scale that both costs are measured in.
    pub fn new(table: &CornerTable, places: &Places, options: &Options) -> Self {
        let (quadrics, mean_edge) = assign_quadrics(table, places);
        Self { quadrics, mean_edge, alpha: options.alpha, beta: options.beta }
    }

    /// E(v) = alpha C(v) + beta S(v). C(v) is the quadric at the point `foot` of the new star nearest to v, but no less than this vertex
    /// alone makes, squared distance times area; over the fourth power of the mean edge length. `shape` is S(v), in mean edges.
    pub fn energy(&self, v: Vertex, star: &Star, foot: Vec3, shape: f32) -> f32 {
        let area = f64::from(star.area) * star.mean_edge.powi(2);
        let foot = star.outside(foot);
        let distortion =
            self.quadrics[v.index()].at(foot).max(foot.length_squared() * area) / self.mean_edge.powi(4);
        (self.alpha * distortion + self.beta * f64::from(shape)) as f32
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

/// The quadrics of all vertices, and the mean length of an edge.
fn assign_quadrics(table: &CornerTable, places: &Places) -> (Vec<Quadric>, f64) {
    let mut quadrics = vec![Quadric::default(); places.positions.len()];
    let (mut length, mut edges) = (0.0, 0usize);
    for t in table.triangles() {
        let corners = t.corners().map(|c| places.at(table.vertex(c)));
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        let unit = normal.normalize_or_zero();
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
                    x.distance_squared(y),
                );
                let (v, w) = table.edge(c);
                quadrics[v.index()] += wall;
                quadrics[w.index()] += wall;
            }
        }
    }
    (quadrics, if edges > 0 && length > 0.0 { length / edges as f64 } else { 1.0 })
}
