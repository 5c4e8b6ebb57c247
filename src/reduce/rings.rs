//! The triangles round each vertex, in two arrays: 4 (n + 1) + 12 m bytes for n vertices and m triangles, without an allocation a vertex.

/// Which triangles have which vertex.
#[derive(Debug, Default)]
pub(super) struct Rings {
    /// For each vertex where its triangles begin, and for the last one where they end.
    pub(super) starts: Vec<u32>,
    pub(super) triangles: Vec<u32>,
}

impl Rings {
    /// Rings of no vertex, for as many triangles as can be numbered thrice.
    pub(super) const MAX_TRIANGLES: usize = u32::MAX as usize / 3;

    /// Forgets all and collects anew. A triangle that has a vertex twice is in its ring twice.
    pub(super) fn rebuild(&mut self, vertices: usize, triangles: &[[u32; 3]]) {
        debug_assert!(triangles.len() <= Self::MAX_TRIANGLES);
        self.starts.clear();
        self.starts.resize(vertices + 1, 0);
        for &v in triangles.as_flattened() {
            self.starts[v as usize] += 1;
        }
        let mut sum = 0;
        for start in &mut self.starts {
            sum += *start;
            *start = sum;
        }
        self.triangles.clear();
        self.triangles.resize(sum as usize, 0);
        // From behind, so that each start sinks to its place and each ring ascends.
        for (t, triangle) in triangles.iter().enumerate().rev() {
            for &v in triangle {
                let start = &mut self.starts[v as usize];
                *start -= 1;
                self.triangles[*start as usize] = t as u32;
            }
        }
    }

    /// The triangles round a vertex, in ascending order.
    pub(super) fn of(&self, v: u32) -> &[u32] {
        let v = v as usize;
        &self.triangles[self.starts[v] as usize..self.starts[v + 1] as usize]
    }

    /// Gives up the rings for a map of the vertices, all `u32::MAX`, in their memory.
    pub(super) fn as_map(&mut self) -> &mut [u32] {
        self.starts.pop();
        self.starts.fill(u32::MAX);
        &mut self.starts
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes;

    #[test]
    fn each_ring_has_the_triangles_that_name_its_vertex() {
        let mesh = shapes::disc_with_ears();
        let mut rings = Rings::default();
        for _ in 0..2 {
            rings.rebuild(mesh.positions.len() + 1, &mesh.triangles);
            for v in 0..=mesh.positions.len() as u32 {
                let by_search: Vec<u32> =
                    (0..).zip(&mesh.triangles).filter(|(_, t)| t.contains(&v)).map(|(t, _)| t).collect();
                assert_eq!(rings.of(v), by_search, "vertex {v}");
            }
        }
        assert!(rings.of(mesh.positions.len() as u32).is_empty());
        assert_eq!(rings.as_map(), vec![u32::MAX; mesh.positions.len() + 1]);
    }
}
