//! The edges of a mesh, and the texels along them: those of the coarsest texture triangle at each.

use super::layout::Layout;
use crate::mesh::IndexedMesh;

/// Edges of two vertices, which may be one, each once, however many triangles there are at it.
#[derive(Clone, Debug, Default)]
pub(super) struct Edges {
    pub list: Vec<Edge>,
    /// For each triangle its edges, from each corner to the next.
    of_triangles: Vec<[u32; 3]>,
    /// The first texel of each edge, and the number of all.
    firsts: Vec<usize>,
}

/// An edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Edge {
    /// The smaller number first.
    pub ends: [u32; 2],
    /// Texels along it, its ends too.
    pub texels: u32,
}

impl Edges {
    /// Those of a mesh that is laid out.
    pub(super) fn new(mesh: &IndexedMesh, layout: &Layout) -> Self {
        let ends = |t: usize, k: usize| {
            let [a, b] = [k, (k + 1) % 3].map(|k| mesh.triangles[t][k]);
            [a.min(b), a.max(b)]
        };
        let mut sides: Vec<u64> = (0..3 * mesh.triangles.len() as u64).collect();
        sides.sort_unstable_by_key(|&side| (ends(side as usize / 3, side as usize % 3), side));
        let mut edges = Self { of_triangles: vec![[0; 3]; mesh.triangles.len()], ..Self::default() };
        for side in sides {
            let (t, k) = (side as usize / 3, side as usize % 3);
            let (ends, texels) = (ends(t, k), layout.edge_texels(&layout.places[t]));
            match edges.list.last_mut().filter(|last| last.ends == ends) {
                Some(last) => last.texels = last.texels.min(texels),
                None => edges.list.push(Edge { ends, texels }),
            }
            edges.of_triangles[t][k] = edges.list.len() as u32 - 1;
        }
        let mut next = 0;
        edges.firsts = Vec::with_capacity(edges.list.len() + 1);
        for edge in &edges.list {
            edges.firsts.push(next);
            next += edge.texels as usize;
        }
        edges.firsts.push(next);
        edges
    }

    /// How many texels all of them have.
    pub(super) fn texels(&self) -> usize {
        self.firsts.last().copied().unwrap_or(0)
    }

    /// The texel of all edges that lies at the `step`-th of `count` texels from a corner of a triangle to the next one.
    pub(super) fn texel(&self, mesh: &IndexedMesh, t: usize, corner: usize, step: u32, count: u32) -> usize {
        let number = self.of_triangles[t][corner] as usize;
        let edge = self.list[number];
        let step = if mesh.triangles[t][corner] == edge.ends[0] { step } else { count - 1 - step };
        // Groups about as long as each other, the same from both ends.
        let coarse = (2 * u64::from(step) + 1) * u64::from(edge.texels) / (2 * u64::from(count));
        self.firsts[number] + coarse as usize
    }
}
