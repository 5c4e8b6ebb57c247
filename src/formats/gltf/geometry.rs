//! Triangles of a mesh with vertices of their own, as a glTF has them: one for each vertex of the mesh and all its corners that have the
//! same values.

use std::collections::HashMap;

use super::accessor::Shape;
use crate::formats::write::fraction;
use crate::mesh::IndexedMesh;
use crate::mesh::attributes::{Attribute, NO_VALUE, Semantic, Values};

/// An attribute and which of its values are the same.
pub(super) struct Column<'a> {
    pub attribute: &'a Attribute,
    /// For each value the first one that is the same, bit for bit.
    ones: Vec<u32>,
}

impl<'a> Column<'a> {
    pub(super) fn new(attribute: &'a Attribute) -> Self {
        let mut known = HashMap::new();
        let n = attribute.components;
        let bits = |value: usize| -> Vec<u64> {
            (value * n..(value + 1) * n).map(|at| attribute.values.bits(at)).collect()
        };
        let ones = (0..attribute.count()).map(|v| *known.entry(bits(v)).or_insert(v as u32)).collect();
        Self { attribute, ones }
    }

    /// The value of a corner, one of those that are the same; [`NO_VALUE`] where there is none.
    pub(super) fn at(&self, triangle: usize, place: usize) -> u32 {
        self.attribute.at(triangle, place).map_or(NO_VALUE, |value| self.ones[value])
    }

    /// The numbers of values, one behind the other, as they are in another shape: the first of them where it has fewer.
    pub(super) fn values(&self, values: &[u32], shape: Shape, absent: &[f64]) -> Values {
        let attribute = self.attribute;
        let mut out = Values::new(shape.stored);
        let same = (attribute.values.stored(), attribute.normalised) == (shape.stored, shape.normalised);
        let one = if shape.normalised { shape.stored.one().unwrap_or(1.0) } else { 1.0 };
        for &value in values {
            for k in 0..shape.components {
                let at = value as usize * attribute.components + k;
                match () {
                    _ if value == NO_VALUE => out.push(one * absent.get(k).copied().unwrap_or(0.0)),
                    // What has no alpha is opaque.
                    _ if k >= attribute.components => {
                        out.push(if attribute.semantic == Semantic::Color { one } else { 0.0 });
                    }
                    _ if same => out.push_bits(attribute.values.bits(at)),
                    _ => out.push(one * fraction(attribute, at)),
                }
            }
        }
        out
    }
}

/// Triangles and their vertices.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Geometry {
    /// Vertices of the mesh, in the order in which triangles have them.
    pub vertices: Vec<u32>,
    /// By column, the value of each vertex.
    pub values: Vec<Vec<u32>>,
    /// Three a triangle.
    pub indices: Vec<u32>,
}

impl Geometry {
    /// A triangle without extent, at a vertex that has none of the values.
    pub(super) fn point(columns: usize) -> Self {
        Self { vertices: vec![0], values: vec![vec![NO_VALUE]; columns], indices: vec![0; 3] }
    }

    /// The triangles of some numbers, with the values that columns have there.
    pub(super) fn new(mesh: &IndexedMesh, triangles: &[u32], columns: &[&Column<'_>]) -> Self {
        let mut geometry = Self { values: vec![Vec::new(); columns.len()], ..Self::default() };
        // Column by column, what has been told apart by those before, and its value in this one; by none of them, vertices.
        let mut known: Vec<HashMap<(u32, u32), u32>> = vec![HashMap::new(); columns.len().max(1)];
        let mut values = vec![NO_VALUE; columns.len().max(1)];
        for &t in triangles {
            for (place, &v) in mesh.triangles[t as usize].iter().enumerate() {
                values
                    .iter_mut()
                    .zip(columns)
                    .for_each(|(value, column)| *value = column.at(t as usize, place));
                let one = |one: u32, (known, value): (&mut HashMap<_, u32>, &u32)| {
                    let next = known.len() as u32;
                    *known.entry((one, *value)).or_insert(next)
                };
                let found = known.iter_mut().zip(&values).fold(v, one);
                if found as usize == geometry.vertices.len() {
                    geometry.vertices.push(v);
                    geometry.values.iter_mut().zip(&values).for_each(|(of, &value)| of.push(value));
                }
                geometry.indices.push(found);
            }
        }
        geometry
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::attributes::Stored;

    #[test]
    fn corners_that_differ_are_vertices_of_their_own() {
        let mut mesh = IndexedMesh::new(vec![[0.0; 3]; 4], vec![[0, 1, 2], [0, 2, 3]]);
        // Values 0 and 2 are the same.
        let uv = Values::F32(vec![0.0, 1.0, 0.5, 0.5, 0.0, 1.0]);
        mesh.attributes = vec![Attribute::new(Semantic::TexCoord, 2, uv, vec![0, 1, 1, 2, 0, NO_VALUE])];
        let column = Column::new(&mesh.attributes[0]);
        let geometry = Geometry::new(&mesh, &[0, 1], &[&column]);
        assert_eq!(geometry.vertices, [0, 1, 2, 2, 3]);
        assert_eq!(geometry.values, [[0, 1, 1, 0, NO_VALUE]]);
        assert_eq!(geometry.indices, [0, 1, 2, 0, 3, 4]);
        let geometry = Geometry::new(&mesh, &[1], &[]);
        assert_eq!((geometry.vertices, geometry.indices), (vec![0, 2, 3], vec![0, 1, 2]));
    }

    #[test]
    fn numbers_in_other_shapes() {
        let colour = Attribute::new(Semantic::Color, 3, Values::F32(vec![0.0, 0.5, 1.0]), vec![0; 3]);
        let column = Column::new(&colour);
        let shape = Shape { stored: Stored::U8, normalised: true, components: 4 };
        assert_eq!(
            column.values(&[0, NO_VALUE], shape, &[1.0; 4]),
            Values::U8(vec![0, 128, 255, 255, 255, 255, 255, 255])
        );
        let shape = Shape { stored: Stored::F32, normalised: false, components: 2 };
        assert_eq!(column.values(&[0], shape, &[]), Values::F32(vec![0.0, 0.5]));
    }
}
