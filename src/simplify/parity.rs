//! Classes of the vertices of a regular sampling: every other row, in all three directions.
//!
//! Where triangles pair up to parallelograms, the four corners of each get the four classes 0 to 3: the corner across an edge has
//! the exclusive or of the three others. Vertices of one class are then nowhere neighbours, and what is left without three of the
//! classes is as regular as before. The classes spread over the best parallelograms first, so that they follow the sampling even
//! where its diagonals run either way; where the pattern does not close up, it meets itself along a seam.

use crate::mesh::{Corner, CornerTable, Vertex};
use glam::DVec3;
use std::collections::VecDeque;

/// The classes of all vertices.
#[derive(Debug)]
pub struct Classes {
    /// 0 to 3, or [`NONE`] for an unused vertex or one that no parallelogram leads to.
    pub of: Vec<u8>,
    /// Share of the interior edges round which all four classes meet: about a half where there is no pattern.
    pub fit: f64,
}

/// No class.
pub const NONE: u8 = 4;

impl Classes {
    /// Spreads the classes over a mesh.
    pub fn new(table: &CornerTable, at: impl Fn(Vertex) -> DVec3) -> Self {
        let mut flood = Flood {
            table,
            at,
            class: vec![NONE; table.vertex_slots()],
            queues: std::array::from_fn(|_| VecDeque::new()),
            least: BUCKETS,
        };
        let regular = |v: Vertex| !table.is_boundary(v) && table.fan(v).count() == 6;
        for anywhere in [false, true] {
            for t in table.triangles() {
                let corners = t.corners();
                let vertices = table.triangle(t);
                if vertices.iter().any(|v| flood.class[v.index()] != NONE) {
                    continue;
                }
                if anywhere || vertices.iter().all(|&v| regular(v)) {
                    for (class, v) in vertices.iter().enumerate() {
                        flood.class[v.index()] = class as u8;
                    }
                    corners.into_iter().for_each(|c| flood.across(c));
                    flood.run();
                }
            }
        }
        let Flood { at, class: mut of, .. } = flood;
        let names = names(table, &of, at);
        of.iter_mut().for_each(|class| *class = names[usize::from(*class)]);
        let fit = fit(table, &of);
        Self { of, fit }
    }
}

/// New names of the classes, such that 0, 1 and 2 lie on edges of middle, of short and of long mean length from 3.
///
/// They go in this order, each from the middle of an edge between two vertices of 3: that edge and the triangles beside it are best
/// where the short direction is thinned out before the long one.
fn names(table: &CornerTable, class: &[u8], at: impl Fn(Vertex) -> DVec3) -> [u8; 5] {
    // By the exclusive or of the classes at its ends, each edge has one of three directions.
    let (mut sums, mut counts) = ([0.0; 8], [0.0; 8]);
    for c in table.triangles().flat_map(|t| t.corners()) {
        let (v, w) = table.edge(c);
        let direction = usize::from(class[v.index()] ^ class[w.index()]);
        sums[direction] += at(v).distance(at(w));
        counts[direction] += 1.0;
    }
    let mean = |direction: u8| sums[usize::from(direction)] / f64::max(counts[usize::from(direction)], 1.0);
    let mut directions = [1, 2, 3];
    directions.sort_by(|&x, &y| mean(x).total_cmp(&mean(y)));
    let mut names = [0, 0, 0, 0, NONE];
    for (direction, name) in directions.into_iter().zip([2, 3, 1]) {
        names[usize::from(direction)] = name;
    }
    names
}

/// Share of the interior edges round which all four classes meet.
fn fit(table: &CornerTable, class: &[u8]) -> f64 {
    let (mut fits, mut all) = (0usize, 0usize);
    for c in table.triangles().flat_map(|t| t.corners()) {
        let o = table.opposite(c);
        // Each edge once.
        if o.is_some() && o.0 > c.0 {
            all += 1;
            let seen = [c, c.next(), c.prev(), o].map(|c| 1u8 << class[table.vertex(c).index()]);
            fits += usize::from(seen.into_iter().fold(0, |a, b| a | b) == 0b1111);
        }
    }
    if all > 0 { fits as f64 / all as f64 } else { 0.0 }
}

struct Flood<'a, F> {
    table: &'a CornerTable,
    at: F,
    class: Vec<u8>,
    /// Edges with a triangle that knows its classes, by how far off a parallelogram they lead.
    queues: [VecDeque<Corner>; BUCKETS],
    /// No queue below is in use.
    least: usize,
}

impl<F: Fn(Vertex) -> DVec3> Flood<'_, F> {
    fn run(&mut self) {
        while self.least < BUCKETS {
            let Some(c) = self.queues[self.least].pop_front() else {
                self.least += 1;
                continue;
            };
            let far = self.table.vertex(self.table.opposite(c));
            if self.class[far.index()] != NONE {
                continue;
            }
            let [x, y, z] = [c, c.next(), c.prev()].map(|c| self.class[self.table.vertex(c).index()]);
            self.class[far.index()] = x ^ y ^ z;
            for c in self.table.fan(far) {
                c.triangle().corners().into_iter().for_each(|c| self.across(c));
            }
        }
        self.least = BUCKETS;
    }

    /// Queues the edge opposite to `c` where it leads from three different classes to a vertex without one.
    fn across(&mut self, c: Corner) {
        let table = self.table;
        let o = table.opposite(c);
        if o.is_none() || self.class[table.vertex(o).index()] != NONE {
            return;
        }
        let [p, a, b, q] = [c, c.next(), c.prev(), o].map(|c| table.vertex(c));
        let [x, y, z] = [p, a, b].map(|v| self.class[v.index()]);
        if x == NONE || y == NONE || z == NONE || x == y || y == z || z == x {
            return;
        }
        let [p, a, b, q] = [p, a, b, q].map(&self.at);
        let sides =
            p.distance_squared(a) + p.distance_squared(b) + q.distance_squared(a) + q.distance_squared(b);
        let off = (p + q - a - b).length_squared();
        let bend = (off / sides.max(f64::MIN_POSITIVE)).sqrt();
        let k = ((bend * BUCKETS as f64) as usize).min(BUCKETS - 1);
        self.queues[k].push_back(c);
        self.least = self.least.min(k);
    }
}

/// Steps in which the diagonals' midpoints may lie apart, up to twice the root of the mean squared side.
const BUCKETS: usize = 128;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{IndexedMesh, shapes};

    fn classes(mesh: &IndexedMesh) -> (CornerTable, Classes) {
        let table = CornerTable::from_triangles(mesh.positions.len(), &mesh.triangles).unwrap();
        let classes = Classes::new(&table, |v| DVec3::from_array(mesh.positions[v.index()]));
        (table, classes)
    }

    /// On a sheet of squares with parallel diagonals the class is told by the parities of row and column.
    #[test]
    fn rows_and_columns_of_a_sheet_alternate() {
        let (n, m) = (9, 7);
        let (_, classes) = classes(&shapes::grid(n, m));
        assert_eq!(classes.fit, 1.0);
        let class = |i: u32, j: u32| classes.of[(j * (n + 1) + i) as usize];
        let mut seen = [class(0, 0), class(1, 0), class(0, 1), class(1, 1)];
        for j in 0..=m {
            for i in 0..=n {
                assert_eq!(class(i, j), class(i % 2, j % 2), "{i} {j}");
            }
        }
        seen.sort_unstable();
        assert_eq!(seen, [0, 1, 2, 3]);
    }

    /// The pattern does not close up round a torus of odd girths: a seam is left, and no more.
    #[test]
    fn where_the_pattern_meets_itself_there_is_a_seam() {
        let (_, even) = classes(&shapes::torus(12, 20));
        assert_eq!(even.fit, 1.0);
        let (_, odd) = classes(&shapes::torus(13, 21));
        assert!(odd.fit > 0.7 && odd.fit < 1.0, "{}", odd.fit);
    }

    #[test]
    fn unused_vertices_have_no_class_and_a_mesh_without_edges_fits_nothing() {
        let mesh =
            IndexedMesh::new(vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [5.0; 3]], vec![[0, 1, 2]]);
        let (_, classes) = classes(&mesh);
        assert_eq!(classes.of[3], NONE);
        assert!(classes.of[..3].iter().all(|&class| class < NONE));
        assert_eq!(classes.fit, 0.0);
    }
}
