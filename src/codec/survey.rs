//! What a level pass knows of the coarser mesh before its first operation: how large everything is (spec §5.5.1).

use super::vector::Vector;
use super::walk::Walk;
use crate::mesh::{Corner, CornerTable, Vertex};
use crate::refine::Roots;

/// Sizes of edges, triangles and neighbourhoods, in cells.
#[derive(Clone, Debug, Default)]
pub struct Survey {
    /// Squared length of each edge of the walk.
    lengths: Vec<f32>,
    /// Twice the area of each triangle, by slot.
    areas: Vec<f32>,
    /// For each vertex, over the triangles round it, the mean squared length of their two edges there.
    scales: Vec<f32>,
}

/// Classes of [`Survey::class`].
pub const CLASSES: usize = 28;

impl Survey {
    /// Walks a mesh whose vertices are at `cells` and measures it.
    pub fn new(table: &CornerTable, roots: &Roots, cells: &[Vector]) -> (Walk, Self) {
        // Summed up in the order of the walk, so that the sums do not depend on how the mesh is stored.
        let mut sums = vec![[0.0f32; 2]; table.vertex_slots()];
        let mut lengths = vec![0.0; table.edge_count() + 1];
        let mut count = 0;
        let mut areas = vec![0.0; table.slots()];
        let walk = Walk::visit(table, roots, |c, listed| {
            let [u, v, w] = table.vertices_from(c);
            let [p, q, r] = [cells[u.index()], cells[v.index()], cells[w.index()]];
            let (x, y, z) = (q - p, r - q, p - r);
            let (uv, vw, wu) = (x.dot(x), y.dot(y), z.dot(z));
            for (vertex, two) in [(u, uv + wu), (v, uv + vw), (w, vw + wu)] {
                let sum = &mut sums[vertex.index()];
                *sum = [sum[0] + two, sum[1] + 2.0];
            }
            for (length, listed) in [vw, wu, uv].into_iter().zip(listed) {
                lengths[count] = length;
                count += usize::from(listed);
            }
            let dot = 0.5 * ((uv + wu) - vw);
            areas[c.triangle().index()] = (uv * wu - dot * dot).max(0.0).sqrt();
        });
        let scales = sums.into_iter().map(|[sum, count]| sum / count).collect();
        (walk, Self { lengths, areas, scales })
    }

    /// How large the edge of place `i` in the walk, opposite to `k` and `o`, and its triangles are beside their surroundings: the
    /// class of squared length × area over the square of the mean squared edge length at its vertices.
    #[inline(always)]
    pub fn class(&self, table: &CornerTable, i: usize, k: Corner, o: Corner) -> usize {
        let scale = |v: Vertex| self.scales[v.index()];
        let area = |c: Corner| self.areas[c.triangle().index()];
        let [c, a, b] = table.vertices_from(k);
        let all = (scale(a) + scale(b)) + scale(c);
        let (mean, area) = if o.is_some() {
            ((all + scale(table.vertex(o))) * 0.25, area(k) + area(o))
        } else {
            (all * (1.0 / 3.0), 2.0 * area(k))
        };
        let size = self.lengths[i] * area / (mean * mean).max(f32::MIN_POSITIVE);
        // Quarter octaves from 2^-4 on: the leading bits of the number.
        ((size.to_bits() >> 21) as usize).saturating_sub((127 - 4) << 2).min(CLASSES - 1)
    }
}
