//! What a level pass knows of the coarser mesh before its first operation: how large everything is (spec §5.5).

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
    /// Mean squared length of the edges at each vertex, of each triangle's two once.
    scales: Vec<f32>,
}

/// Classes of [`Survey::class`].
pub const CLASSES: usize = 28;

impl Survey {
    /// Walks a mesh and measures it; `cell` tells where its vertices are.
    pub fn new(table: &CornerTable, roots: &Roots, cell: impl Fn(Vertex) -> [i32; 3]) -> (Walk, Self) {
        let mut sums = vec![(0u64, 0u32); table.vertex_slots()];
        let mut lengths = Vec::with_capacity(table.triangle_count() * 3 / 2 + 2);
        let mut areas = vec![0.0; table.slots()];
        let walk = Walk::visit(table, roots, |c, listed| {
            let [u, v, w] = table.vertices_from(c);
            let [p, q, r] = [cell(u), cell(v), cell(w)];
            let (uv, vw, wu) = (squared(p, q), squared(q, r), squared(r, p));
            for (vertex, two) in [(u, uv + wu), (v, uv + vw), (w, vw + wu)] {
                let (sum, count) = &mut sums[vertex.index()];
                *sum = sum.wrapping_add(two);
                *count += 2;
            }
            if listed[0] {
                lengths.push(vw as f32);
            }
            if listed[1] {
                lengths.push(wu as f32);
            }
            if listed[2] {
                lengths.push(uv as f32);
            }
            let (uv, vw, wu) = (uv as f64, vw as f64, wu as f64);
            let dot = 0.5 * (uv + wu - vw);
            areas[c.triangle().index()] = (uv * wu - dot * dot).max(0.0).sqrt() as f32;
        });
        let scales = sums.into_iter().map(|(sum, count)| (sum as f64 / f64::from(count)) as f32).collect();
        (walk, Self { lengths, areas, scales })
    }

    /// How large the edge of place `i` in the walk, opposite to `k` and `o`, and its triangles are beside their surroundings: the
    /// class of squared length × area over the square of the mean squared edge length at its vertices.
    #[inline]
    pub fn class(&self, table: &CornerTable, i: usize, k: Corner, o: Corner) -> usize {
        let scale = |v: Vertex| self.scales[v.index()];
        let area = |c: Corner| self.areas[c.triangle().index()];
        let [c, a, b] = table.vertices_from(k);
        let near = scale(a) + scale(b) + scale(c);
        let (mean, area) = if o.is_some() {
            ((near + scale(table.vertex(o))) * 0.25, area(k) + area(o))
        } else {
            (near * (1.0 / 3.0), 2.0 * area(k))
        };
        let size = self.lengths[i] * area / (mean * mean).max(f32::MIN_POSITIVE);
        // Quarter octaves from 2^-4 on: the leading bits of the number.
        ((size.to_bits() >> 21) as usize).saturating_sub((127 - 4) << 2).min(CLASSES - 1)
    }
}

#[inline]
fn squared(p: [i32; 3], q: [i32; 3]) -> u64 {
    let d = |i: usize| i64::from(p[i] - q[i]);
    (d(0) * d(0) + d(1) * d(1) + d(2) * d(2)) as u64
}
