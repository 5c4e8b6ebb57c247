//! Which triangle covers each removed vertex: the level's error is tracked while simplifying.

use super::removal::{Places, vertices};
use crate::mesh::distance::point_triangle_distance_squared;
use crate::mesh::{CornerTable, Triangle, Vertex};

/// The removed vertices, in a list for each triangle of the mesh as it stands.
#[derive(Debug)]
pub struct Covering {
    first: Vec<u32>,
    next: Vec<u32>,
    /// A third of the area round each vertex of the input.
    weights: Vec<f32>,
}

/// How far the input is from a level.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LevelError {
    /// Largest distance of an input vertex from the level's surface, in the input's units.
    pub max: f64,
    /// Root of the mean squared distance, each vertex weighted by the area round it.
    pub rms: f64,
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
        Self { first: vec![NONE; table.slots()], next: vec![NONE; count], weights }
    }

    /// Takes the vertices off a triangle that is about to be rewritten.
    pub fn take(&mut self, t: Triangle, out: &mut Vec<Vertex>) {
        let mut at = std::mem::replace(&mut self.first[t.index()], NONE);
        while at != NONE {
            out.push(Vertex(at));
            at = self.next[at as usize];
        }
    }

    /// Puts each vertex on the nearest of some triangles.
    pub fn put(&mut self, table: &CornerTable, places: &Places, vertices: &[Vertex], triangles: &[Triangle]) {
        for &v in vertices {
            let p = places.at(v);
            let distance = |t: &Triangle| {
                let [a, b, c] = table.triangle(*t).map(|v| places.at(v));
                point_triangle_distance_squared(p, a, b, c)
            };
            let nearest = match triangles {
                [only] => *only,
                _ => {
                    let keyed = triangles.iter().map(|t| (distance(t), *t));
                    let Some((_, t)) = keyed.min_by(|x, y| x.0.total_cmp(&y.0)) else { continue };
                    t
                }
            };
            self.next[v.index()] = self.first[nearest.index()];
            self.first[nearest.index()] = v.0;
        }
    }

    /// Distance of the input from the level as it stands, its vertices moved to the lattice, in the input's units.
    pub fn error(&self, table: &CornerTable, places: &Places) -> LevelError {
        let frame = &places.frame;
        let on_lattice = |v: Vertex| frame.on_lattice(places.at(v));
        let (mut max, mut sum, mut total) = (0.0f64, 0.0, 0.0);
        let mut add = |v: Vertex, squared: f64| {
            let weight = f64::from(self.weights[v.index()]);
            max = max.max(squared);
            sum += weight * squared;
            total += weight;
        };
        // A vertex of the level has been moved to the lattice, and its triangles with it.
        for v in vertices(table) {
            let p = places.at(v);
            let distance = |t: Triangle| {
                let [a, b, c] = table.triangle(t).map(on_lattice);
                point_triangle_distance_squared(p, a, b, c)
            };
            add(v, table.fan(v).map(|c| distance(c.triangle())).fold(f64::INFINITY, f64::min));
        }
        for t in table.triangles() {
            let mut at = self.first[t.index()];
            if at == NONE {
                continue;
            }
            let [a, b, c] = table.triangle(t).map(on_lattice);
            while at != NONE {
                add(Vertex(at), point_triangle_distance_squared(places.at(Vertex(at)), a, b, c));
                at = self.next[at as usize];
            }
        }
        let rms = if total > 0.0 { (sum / total).sqrt() } else { 0.0 };
        LevelError { max: frame.length(max.sqrt()), rms: frame.length(rms) }
    }
}
