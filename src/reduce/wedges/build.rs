//! Wedges of a mesh's attributes.

use super::{CREASE, Column, Wedges};
use crate::mesh::IndexedMesh;
use crate::mesh::attributes::worth::worth;
use crate::mesh::attributes::{Attribute, Domain, NO_VALUE, Quantisation, Semantic};
use crate::reduce::rings::Rings;
use crate::reduce::star::turned;
use glam::DVec3;
use std::collections::HashMap;

impl Wedges {
    /// The wedges of what is left of a mesh: triangles with the same vertices' corners in the same order, each with its number in the mesh,
    /// and rings. `positions` may be scaled.
    pub(in crate::reduce) fn new(
        mesh: &IndexedMesh,
        positions: &[[f64; 3]],
        triangles: &[[u32; 3]],
        origins: Vec<u32>,
        rings: &Rings,
    ) -> Self {
        let input = Input { mesh, origins: &origins };
        let tags = input.tags();
        let normals = input.normals();
        let mut corners = vec![[NO_VALUE; 3]; triangles.len()];
        let mut sources = Vec::new();
        let mut fan = Fan::default();
        for v in 0..positions.len() as u32 {
            fan.gather(v, rings.of(v), triangles);
            fan.join(|x, y| {
                let alike = |normals: &[DVec3]| {
                    let [x, y] = [x, y].map(|corner| normals[corner]);
                    x == DVec3::ZERO || y == DVec3::ZERO || x.dot(y) >= CREASE
                };
                tags[x] == tags[y] && normals.iter().all(|normals| alike(normals))
            });
            for k in 0..fan.corners.len() {
                let corner = fan.corners[k];
                let root = fan.root(k);
                let root = fan.corners[root];
                let wedge = match root == corner {
                    true => {
                        sources.push(3 * origins[corner / 3] + (corner % 3) as u32);
                        sources.len() as u32 - 1
                    }
                    false => corners[root / 3][root % 3],
                };
                corners[corner / 3][corner % 3] = wedge;
            }
        }
        let mut first = vec![[NO_VALUE; 3]; mesh.triangles.len()];
        origins.iter().zip(&corners).for_each(|(&t, &wedges)| first[t as usize] = wedges);
        let (columns, width) = input.columns(positions, triangles);
        let is_changed = vec![false; sources.len()];
        let mut wedges = Self {
            corners,
            origins,
            width,
            rows: Vec::new(),
            sources,
            is_changed,
            first,
            columns,
            bounds: Vec::new(),
        };
        wedges.fill(mesh);
        wedges
    }

    /// Reads the numbers of all wedges.
    fn fill(&mut self, mesh: &IndexedMesh) {
        self.rows.reserve_exact(self.sources.len() * self.width);
        for &corner in &self.sources {
            for column in &self.columns {
                let attribute = &mesh.attributes[column.attribute];
                match attribute.at(corner as usize / 3, corner as usize % 3) {
                    Some(value) => {
                        let scale = column.scale / length(attribute, value);
                        let first = value * column.components;
                        let number = |k| attribute.values.number(first + k) * scale;
                        self.rows.extend((0..column.components).map(number));
                    }
                    None => self.rows.extend(std::iter::repeat_n(f64::NAN, column.components)),
                }
            }
        }
        self.bounds = vec![[f64::INFINITY, f64::NEG_INFINITY]; self.width];
        if self.width > 0 {
            for row in self.rows.chunks_exact(self.width) {
                for ([least, most], &x) in self.bounds.iter_mut().zip(row) {
                    (*least, *most) = (least.min(x), most.max(x));
                }
            }
        }
    }
}

/// What the numbers of a value are divided by: the length of a normal that has one, else 1.
pub(super) fn length(attribute: &Attribute, value: usize) -> f64 {
    if attribute.semantic != Semantic::Normal {
        return 1.0;
    }
    let numbers = (value * attribute.components..).take(attribute.components);
    let length = numbers.map(|at| attribute.values.number(at)).map(|x| x * x).sum::<f64>().sqrt();
    if length > 0.0 { length } else { 1.0 }
}

struct Input<'a> {
    mesh: &'a IndexedMesh,
    origins: &'a [u32],
}

impl Input<'_> {
    /// For each corner a number that is another one where parts, texture coordinates, colours or the like are.
    fn tags(&self) -> Vec<u32> {
        let mut tags = vec![0; 3 * self.origins.len()];
        let parts = |attribute: &&Attribute| match (attribute.domain, attribute.semantic) {
            (Domain::Triangle, semantic) => semantic == Semantic::Part,
            (_, Semantic::TexCoord | Semantic::Color | Semantic::Generic) => true,
            _ => false,
        };
        for attribute in self.mesh.attributes.iter().filter(parts) {
            let classes = classes(attribute);
            let mut numbers = HashMap::new();
            for (corner, tag) in tags.iter_mut().enumerate() {
                let value = attribute.at(self.origins[corner / 3] as usize, corner % 3);
                let class = value.map_or(NO_VALUE, |value| classes[value]);
                let next = numbers.len() as u32;
                *tag = *numbers.entry((*tag, class)).or_insert(next);
            }
        }
        tags
    }

    /// For each attribute of normals the one of each corner, of length 1, or 0 where it has none.
    fn normals(&self) -> Vec<Vec<DVec3>> {
        let is_normal = |a: &&Attribute| {
            a.semantic == Semantic::Normal && a.components == 3 && a.domain == Domain::Corner
        };
        let of = |attribute: &Attribute| -> Vec<DVec3> {
            let at = |corner: usize| {
                let value = attribute.at(self.origins[corner / 3] as usize, corner % 3)?;
                let [x, y, z] = [0, 1, 2].map(|k| attribute.values.number(3 * value + k));
                Some(DVec3::new(x, y, z) / length(attribute, value)).filter(|normal| normal.is_finite())
            };
            (0..3 * self.origins.len()).map(|corner| at(corner).unwrap_or_default()).collect()
        };
        self.mesh.attributes.iter().filter(is_normal).map(of).collect()
    }

    /// The attributes that are numbers between which there are others, with what a difference of them counts, and how many numbers they have.
    fn columns(&self, positions: &[[f64; 3]], triangles: &[[u32; 3]]) -> (Vec<Column>, usize) {
        let bounds = crate::mesh::lattice::bounds(positions.iter().copied()).unwrap_or_default();
        let size = (0..3).map(|k| bounds.1[k] - bounds.0[k]).fold(0.0, f64::max);
        let size = if size > 0.0 { size } else { 1.0 };
        let (mut columns, mut width) = (Vec::new(), 0);
        for (number, attribute) in self.mesh.attributes.iter().enumerate().filter(|(_, a)| is_smooth(a)) {
            let of = |(t, triangle): (usize, &[u32; 3])| {
                let values = [0, 1, 2].map(|k| attribute.at(self.origins[t] as usize, k));
                (values, triangle.map(|v| positions[v as usize]))
            };
            let worth = worth(attribute, size, triangles.iter().enumerate().map(of));
            // What is worth nothing, as what does not change, still has the values that fit best.
            let worth = if worth > 0.0 && worth.is_finite() { worth } else { TRIFLE };
            let (semantic, components) = (attribute.semantic, attribute.components);
            columns.push(Column { attribute: number, semantic, at: width, components, scale: worth * size });
            width += components;
        }
        (columns, width)
    }
}

/// Whether there are values between two of an attribute's: not so of numbers of joints, nor of whole numbers that may be names.
fn is_smooth(attribute: &Attribute) -> bool {
    let is_number = attribute.values.stored().is_float() || attribute.normalised;
    let kind = match attribute.semantic {
        Semantic::Normal => attribute.components == 3,
        Semantic::Color | Semantic::TexCoord | Semantic::Tangent => true,
        Semantic::Generic => is_number,
        _ => false,
    };
    let all_finite = || (0..attribute.values.len()).all(|at| attribute.values.number(at).is_finite());
    kind && attribute.domain == Domain::Corner && all_finite()
}

/// For each value which value it is: what the usual quantisation makes equal is no seam.
fn classes(attribute: &Attribute) -> Vec<u32> {
    let quantisation = Quantisation::choose(attribute, None, false);
    let mut places = HashMap::new();
    let class = |value: usize| {
        let mut integers = Vec::with_capacity(attribute.components);
        quantisation.quantise(attribute, value, &mut integers);
        let next = places.len() as u32;
        *places.entry(integers).or_insert(next)
    };
    (0..attribute.count()).map(class).collect()
}

/// The corners round a vertex, and which of them are joined.
#[derive(Default)]
struct Fan {
    /// Three a triangle.
    corners: Vec<usize>,
    /// Each end of an edge, and the place of a corner whose triangle has it.
    edges: Vec<(u32, u32)>,
    /// For each corner an earlier one that it is joined with, or itself.
    joined: Vec<u32>,
}

impl Fan {
    fn gather(&mut self, v: u32, ring: &[u32], triangles: &[[u32; 3]]) {
        self.corners.clear();
        self.edges.clear();
        for &t in ring {
            let triangle = triangles[t as usize];
            let Some(ends) = turned(triangle, v) else { continue };
            let at = self.corners.len() as u32;
            self.corners.push(3 * t as usize + super::place(triangle, v));
            self.edges.extend(ends.map(|end| (end, at)));
        }
        self.edges.sort_unstable();
        self.joined.clear();
        self.joined.extend(0..self.corners.len() as u32);
    }

    /// Joins corners of triangles that share an edge, where they are alike.
    fn join(&mut self, alike: impl Fn(usize, usize) -> bool) {
        for k in 1..self.edges.len() {
            let [(end, x), (other, y)] = [self.edges[k - 1], self.edges[k]];
            if end == other && alike(self.corners[x as usize], self.corners[y as usize]) {
                let [x, y] = [x, y].map(|at| self.root(at as usize) as u32);
                self.joined[x.max(y) as usize] = x.min(y);
            }
        }
    }

    /// The first of those that a corner is joined with.
    fn root(&mut self, mut at: usize) -> usize {
        while self.joined[at] as usize != at {
            let next = self.joined[at] as usize;
            self.joined[at] = self.joined[next];
            at = next;
        }
        at
    }
}

/// What a difference of 1 counts of what is worth nothing.
const TRIFLE: f64 = 1e-6;
