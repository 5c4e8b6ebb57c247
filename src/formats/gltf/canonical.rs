//! Primitives that are equal whatever they are called: by what their triangles have at each corner.

use super::accessor::Shape;
use super::primitive::{Primitive, Stored, Stream};
use crate::mesh::attributes::Values;

/// A primitive by itself: only the vertices that its triangles have, in the order in which these name them.
pub(super) struct Canonical {
    pub triangles: Vec<[u32; 3]>,
    /// For each of its vertices the one of the mesh's streams.
    pub vertices: Vec<u32>,
}

/// Room for the numbers of vertices.
#[derive(Default)]
pub(super) struct Numbers(Vec<u32>);

impl Numbers {
    /// Numbers the vertices of triangles, each below `count`.
    pub(super) fn canonical(&mut self, triangles: &[[u32; 3]], count: usize) -> Canonical {
        if self.0.len() < count {
            self.0.resize(count, NONE);
        }
        let mut vertices = Vec::new();
        let mut number = |v: u32| {
            let number = &mut self.0[v as usize];
            if *number == NONE {
                *number = vertices.len() as u32;
                vertices.push(v);
            }
            *number
        };
        let triangles = triangles.iter().map(|t| t.map(&mut number)).collect();
        vertices.iter().for_each(|&v| self.0[v as usize] = NONE);
        Canonical { triangles, vertices }
    }
}

impl Canonical {
    /// The numbers of its own vertices.
    pub(super) fn stream(&self, stream: &Stream) -> Stream {
        let n = stream.shape.components;
        let mut values = Values::new(stream.shape.stored);
        for &v in &self.vertices {
            (n * v as usize..n * (v as usize + 1)).for_each(|at| values.push_bits(stream.values.bits(at)));
        }
        Stream { shape: stream.shape, values, accessor: None }
    }

    /// How many bytes [`Canonical::content`] has, at most.
    pub(super) fn content_bytes(&self, primitive: &Primitive<'_>, stored: &Stored<'_>) -> usize {
        let streams = primitive.streams().map(|(_, name, stream)| {
            let shape = stored.streams[stream].shape;
            name.len() + 32 + self.vertices.len() * shape.components * size_of::<u64>()
        });
        32 + self.triangles.len() * size_of::<[u32; 3]>() + streams.sum::<usize>()
    }

    /// All that tells it from others: equal bytes, equal primitives.
    pub(super) fn content(&self, primitive: &Primitive<'_>, stored: &Stored<'_>) -> Vec<u8> {
        let mut bytes = Vec::new();
        let word = |bytes: &mut Vec<u8>, x: usize| bytes.extend((x as u64).to_le_bytes());
        word(&mut bytes, self.triangles.len());
        word(&mut bytes, self.vertices.len());
        bytes.extend(self.triangles.as_flattened().iter().flat_map(|v| v.to_le_bytes()));
        let mut streams: Vec<_> = primitive.streams().collect();
        streams.sort_unstable();
        for (target, name, stream) in streams {
            let Stream { shape: Shape { stored, normalised, components }, ref values, .. } =
                stored.streams[stream];
            word(&mut bytes, target);
            word(&mut bytes, name.len());
            bytes.extend(name.as_bytes());
            bytes.extend(stored.name().as_bytes());
            bytes.push(normalised.into());
            word(&mut bytes, components);
            let size = super::accessor::size(stored);
            for &v in &self.vertices {
                for at in components * v as usize..components * (v as usize + 1) {
                    bytes.extend(&values.bits(at).to_le_bytes()[..size]);
                }
            }
        }
        bytes
    }
}

const NONE: u32 = u32::MAX;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vertices_are_numbered_as_triangles_name_them() {
        let mut numbers = Numbers::default();
        for _ in 0..2 {
            let canonical = numbers.canonical(&[[7, 2, 9], [9, 2, 4]], 10);
            assert_eq!(canonical.triangles, [[0, 1, 2], [2, 1, 3]]);
            assert_eq!(canonical.vertices, [7, 2, 9, 4]);
        }
    }
}
