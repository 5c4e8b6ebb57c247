//! What a level pass knows of the coarser mesh before its first operation: how large everything is (spec §5.5.1).

use super::vector::Vector;
use super::walk::Walk;
use crate::mesh::{Corner, CornerTable, Triangle, Vertex};
use crate::refine::Roots;

/// Sizes and states of triangles, in cells. The sizes of neighbourhoods are kept with the vertices.
#[derive(Clone, Debug, Default)]
pub struct Survey {
    /// By slot.
    faces: Vec<Face>,
}

/// What a level pass knows of a triangle.
#[derive(Clone, Copy, Debug, Default)]
pub struct Face {
    /// Twice its area.
    area: f32,
    /// [`STAR`] in the star of a vertex of this level, else how many of its edges are boundary or have a star beyond.
    state: u32,
}

/// A triangle in the star of a vertex of this level.
pub const STAR: u32 = u32::MAX;

/// Classes of [`Survey::class`].
pub const CLASSES: usize = 28;

impl Survey {
    /// Walks a mesh whose vertices are at `cells` and measures it. The fourth lane of each cell becomes the scale of the vertex: over
    /// the triangles round it, the mean squared length of their two edges there.
    pub fn new(table: &CornerTable, roots: &Roots, cells: &mut [Vector]) -> (Walk, Self) {
        // Summed up in the order of the walk, so that the sums do not depend on how the mesh is stored.
        let mut sums = vec![[0.0f32; 2]; cells.len()];
        let mut faces = Vec::with_capacity(table.capacity());
        faces.resize(table.slots(), Face::default());
        let walk = Walk::visit(table, roots, |c| {
            let [u, v, w] = table.vertices_from(c);
            let [p, q, r] = [cells[u.index()], cells[v.index()], cells[w.index()]];
            let (x, y, z) = (q - p, r - q, p - r);
            let (uv, vw, wu) = (x.dot(x), y.dot(y), z.dot(z));
            for (vertex, two) in [(u, uv + wu), (v, uv + vw), (w, vw + wu)] {
                let sum = &mut sums[vertex.index()];
                *sum = [sum[0] + two, sum[1] + 2.0];
            }
            let dot = 0.5 * ((uv + wu) - vw);
            faces[c.triangle().index()].area = (uv * wu - dot * dot).max(0.0).sqrt();
        });
        for k in &walk.boundary {
            faces[k.triangle().index()].state += 1;
        }
        for (cell, [sum, count]) in cells.iter_mut().zip(sums) {
            cell.0[3] = sum / count;
        }
        (walk, Self { faces })
    }

    /// [`STAR`] in the star of a vertex of this level, else how many of its edges are boundary or have a star beyond.
    #[inline(always)]
    pub fn state(&self, t: Triangle) -> u32 {
        self.faces[t.index()].state
    }

    /// Counts a triangle, old or new, to a star of this level.
    #[inline(always)]
    pub fn star(&mut self, t: Triangle) {
        if t.index() >= self.faces.len() {
            self.faces.resize(t.index() + 1, Face { area: 0.0, state: STAR });
        }
        self.faces[t.index()].state = STAR;
    }

    /// Tells a triangle that a star has grown beyond one of its edges.
    #[inline(always)]
    pub fn close(&mut self, t: Triangle) {
        let state = &mut self.faces[t.index()].state;
        *state = state.saturating_add(1);
    }

    /// How large the edge opposite to `k` and `o` and its triangles are beside their surroundings: the
    /// class of squared length × area over the square of the mean squared edge length at its vertices.
    #[inline(always)]
    pub fn class(&self, table: &CornerTable, cells: &[Vector], k: Corner, o: Corner) -> usize {
        let scale = |v: Vertex| cells[v.index()].0[3];
        let area = |c: Corner| self.faces[c.triangle().index()].area;
        let [c, a, b] = table.vertices_from(k);
        let (a, b) = (cells[a.index()], cells[b.index()]);
        let all = (a.0[3] + b.0[3]) + scale(c);
        let (mean, area) = if o.is_some() {
            ((all + scale(table.vertex(o))) * 0.25, area(k) + area(o))
        } else {
            (all * (1.0 / 3.0), 2.0 * area(k))
        };
        let size = (b - a).dot(b - a) * area / (mean * mean).max(f32::MIN_POSITIVE);
        // Quarter octaves from 2^-4 on: the leading bits of the number.
        ((size.to_bits() >> 21) as usize).saturating_sub((127 - 4) << 2).min(CLASSES - 1)
    }
}

#[cfg(all(test, feature = "encode"))]
mod tests {
    use super::*;
    use crate::mesh::shapes;

    /// On a sheet of squares of side 10, cut by parallel diagonals, an interior vertex has two right angles between sides and four acute
    /// ones between a side and a diagonal: its scale is (2 * 200 + 4 * 300) / 12 = 133.3. Twice the area of a triangle is 100.
    #[test]
    fn a_sheet_of_squares() {
        let mesh = shapes::grid(8, 8);
        let table = CornerTable::from_triangles(mesh.positions.len(), &mesh.triangles).unwrap();
        // The vertices of the sheet are listed row by row.
        let mut cells: Vec<_> = (0..81).map(|v| Vector::of_cell([v % 9 * 10, v / 9 * 10, 7])).collect();
        let (walk, survey) = Survey::new(&table, &Roots::choose(&table), &mut cells);
        let middle = Vertex(4 * 9 + 4);
        assert!((cells[middle.index()].0[3] - 400.0 / 3.0).abs() < 1e-4);
        for c in table.fan(middle) {
            let k = c.next();
            let (a, b) = table.edge(k);
            let edge = cells[b.index()] - cells[a.index()];
            // Diagonal: 200 * 200 / 133.3^2 = 2.25, five quarter octaves above 1. Side: 100 * 200 / 133.3^2 = 1.125, in the one of 1.
            let class = if edge.dot(edge) == 200.0 { 20 } else { 16 };
            assert_eq!(survey.class(&table, &cells, k, table.opposite(k)), class);
        }
        assert_eq!(walk.boundary.len(), 32);
        let open: u32 = table.triangles().map(|t| survey.state(t)).sum();
        assert_eq!(open, 32);
    }
}
