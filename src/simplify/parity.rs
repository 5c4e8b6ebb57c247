//! Classes of the vertices of a regular sampling: every other row, in all three directions.
//!
//! Where triangles pair up to parallelograms, the four corners of each get the four classes 0 to 3: the corner across an edge has
//! the exclusive or of the three others. Vertices of one class are then nowhere neighbours, and what is left without three of the
//! classes is as regular as before. Where four triangles meet at a vertex, as in quads cut along alternating diagonals, two steps
//! straight on through it lead to the same class again. The classes spread over the best fits first, so that they follow the sampling
//! even where its diagonals run either way; where the pattern does not close up, it meets itself along a seam.

use super::removal::vertices;
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

/// New names of the classes: 3 stays, the class of the irregular vertices; 0, 1 and 2 lie on edges of middle, of short and of long mean
/// length from there.
///
/// They go in this order, each from the middle of an edge between two vertices of 3: that edge and the triangles beside it are best
/// where the short direction is thinned out before the long one.
fn names(table: &CornerTable, class: &[u8], at: impl Fn(Vertex) -> DVec3) -> [u8; 5] {
    let stays = stays(table, class);
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
    let mut names = [NONE; 5];
    names[usize::from(stays)] = 3;
    for (direction, name) in directions.into_iter().zip([1, 0, 2]) {
        names[usize::from(stays ^ direction)] = name;
    }
    names
}

/// The class that stays: that of the valences that vary most, since the pattern goes on round an irregular vertex, but only where this is
/// of the class that stays; and where they do not vary, that of the highest ones, which would take most flips.
fn stays(table: &CornerTable, class: &[u8]) -> u8 {
    // Count, sum and sum of squares.
    let mut valences = [[0u64; 3]; 5];
    for v in vertices(table).filter(|&v| !table.is_boundary(v)) {
        let valence = table.valence(v) as u64;
        let of = &mut valences[usize::from(class[v.index()])];
        *of = [of[0] + 1, of[1] + valence, of[2] + valence * valence];
    }
    let score = |class: &u8| {
        let [count, sum, squares] = valences[usize::from(*class)].map(|n| n as f64);
        let mean = sum / count.max(1.0);
        // A share x of valence 5 among 6 lowers the mean by x, but counts for more: the variance is about x.
        mean + VARIANCE * (squares / count.max(1.0) - mean * mean)
    };
    [3, 2, 1, 0].into_iter().max_by(|x, y| score(x).total_cmp(&score(y))).unwrap_or(0)
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
            self.class[far.index()] = if self.leads(c).1 { x } else { x ^ y ^ z };
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
        let [x, y, z] = [c, c.next(), c.prev()].map(|c| self.class[table.vertex(c).index()]);
        if x == NONE || y == NONE || z == NONE || x == y || y == z || z == x {
            return;
        }
        let k = ((self.leads(c).0 * BUCKETS as f64) as usize).min(BUCKETS - 1);
        self.queues[k].push_back(c);
        self.least = self.least.min(k);
    }

    /// How far the vertex beyond the edge opposite to `c` is off the place that the pattern leads to, in edges; and whether that is two
    /// steps straight on from `c`, through an end of the edge, rather than the fourth corner of a parallelogram.
    fn leads(&self, c: Corner) -> (f64, bool) {
        let table = self.table;
        let [p, a, b, q] = [c, c.next(), c.prev(), table.opposite(c)].map(|c| table.vertex(c));
        let [at_p, at_a, at_b, at_q] = [p, a, b, q].map(&self.at);
        let across = (at_p + at_q - at_a - at_b).length_squared();
        // Two triangles make up a straight angle where four go round a vertex.
        let through = |v: Vertex, at_v: DVec3| {
            let four = table.fan(v).take(5).count() + 2 * usize::from(table.is_boundary(v)) == 4;
            if four { (at_p + at_q - at_v * 2.0).length_squared() } else { f64::INFINITY }
        };
        let straight = through(a, at_a).min(through(b, at_b));
        let edge = (at_b - at_a).length_squared().max(f64::MIN_POSITIVE);
        ((across.min(straight) / edge).sqrt(), straight < across)
    }
}

/// Steps in which a vertex may be off its place, up to the length of an edge.
const BUCKETS: usize = 128;

/// What the variance of a class's valences counts beside their mean.
const VARIANCE: f64 = 4.0;

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

    /// Squares whose diagonals alternate: all legs lead straight on, and only half of the edges to a parallelogram.
    #[test]
    fn alternating_diagonals_do_not_matter() {
        let (n, m) = (9, 7);
        let mut mesh = shapes::grid(n, m);
        for (k, pair) in mesh.triangles.chunks_mut(2).enumerate() {
            let [i, j] = [k as u32 % n, k as u32 / n];
            if (i + j) % 2 == 1 {
                let corner = |di: u32, dj: u32| (j + dj) * (n + 1) + i + di;
                let [a, b, c, d] = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
                pair.copy_from_slice(&[[a, b, d], [b, c, d]]);
            }
        }
        let (table, classes) = classes(&mesh);
        let class = |i: u32, j: u32| classes.of[(j * (n + 1) + i) as usize];
        for j in 0..=m {
            for i in 0..=n {
                assert_eq!(class(i, j), class(i % 2, j % 2), "{i} {j}");
            }
        }
        // What stays has eight neighbours.
        let mut stays = vertices(&table).filter(|&v| !table.is_boundary(v) && classes.of[v.index()] == 3);
        assert!(stays.all(|v| table.valence(v) == 8));
    }

    /// A subdivided icosahedron: its corners, of valence 5, stay, with every other vertex of the rows between them.
    #[test]
    fn irregular_vertices_stay() {
        let (table, classes) = classes(&shapes::sphere(4));
        let five: Vec<_> = vertices(&table).filter(|&v| table.valence(v) == 5).collect();
        assert_eq!(five.len(), 12);
        assert!(five.iter().all(|v| classes.of[v.index()] == 3));
        let coarse = shapes::sphere(3).positions.len();
        assert_eq!(classes.of.iter().filter(|&&class| class == 3).count(), coarse);
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
