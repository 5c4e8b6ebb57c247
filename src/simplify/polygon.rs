//! Retriangulating the star polygon of a removed vertex (spec §5.1; Klincsek 1980 for the dynamic programme).
//!
//! Removing a vertex replaces its star by a triangulation of the polygon of its link. Any triangulation is reached by flips and one
//! weld, so the best one is looked for over all of them, and then told as an operation.

use crate::mesh::Vertex;
use crate::refine::Site;
use glam::Vec4;

/// Most sides of a star polygon.
pub const MAX_SIDES: usize = 16;

/// Most sides of those that are met all the time: what is worked on is then a third as large.
pub const FEW_SIDES: usize = 8;

/// Lengths of a row of numbers by vertex of the polygon: whoever takes four from any of them on stays inside.
pub const ROW: usize = MAX_SIDES + 4;
/// The same of few.
pub const FEW_ROW: usize = FEW_SIDES + 4;

/// Four numbers of a row.
#[inline]
pub fn four<const ROW: usize>(row: &[f32; ROW], from: usize) -> Vec4 {
    Vec4::from_slice(&row[from..from + 4])
}

/// The cheapest triangulation of a polygon, by dynamic programming over its parts.
#[derive(Clone, Copy, Debug)]
pub struct Solved {
    /// What the triangles and the edges made cost in all; infinite where there is no triangulation.
    pub cost: f32,
    /// The triangulation; meaningless where the cost is infinite.
    pub shape: Shape,
}

impl Solved {
    /// Solves the polygon of 3 to `MOST` sides, [`MAX_SIDES`] or fewer; a `ROW` is longer by four.
    ///
    /// `edge(i, j)`, i < j, is what making an edge costs, infinite where it must not be made. It is asked for the diagonals, and for
    /// the closing side 0, n-1 only where `open`. `triangles(i, j, k)` are the costs of the triangles i, j and each of
    /// k to k+3, those from j on finite and otherwise of no meaning.
    #[inline]
    pub fn new<const MOST: usize, const ROW: usize>(
        sides: usize,
        open: bool,
        edge: impl Fn(usize, usize) -> f32,
        triangles: impl Fn(usize, usize, usize) -> Vec4,
    ) -> Self {
        debug_assert!((3..=MOST).contains(&sides));
        // Symmetric. What is not solved yet is infinite, and so is a triangle whose third vertex is not between the others.
        let mut best = [[f32::INFINITY; ROW]; MOST];
        let mut apex = [[0u8; MOST]; MOST];
        for i in 1..sides.min(MOST) {
            best[i - 1][i] = 0.0;
            best[i][i - 1] = 0.0;
        }
        for span in 2..sides.min(MOST) {
            for i in 0..sides - span {
                let j = i + span;
                let own = if span < sides - 1 || open { edge(i, j) } else { 0.0 };
                if own == f32::INFINITY {
                    continue;
                }
                let (mut least, mut at) = (f32::INFINITY, 0);
                let mut k = i + 1;
                while k < j {
                    let totals = four(&best[i], k) + four(&best[j], k) + triangles(i, j, k);
                    let total = totals.min_element();
                    if total < least {
                        (least, at) = (total, k + totals.min_position());
                    }
                    k += 4;
                }
                best[i][j] = least + own;
                best[j][i] = least + own;
                apex[i][j] = at as u8;
            }
        }
        let cost = best[0][sides - 1];
        Self { cost, shape: if cost.is_finite() { Shape::new(sides, &apex) } else { Shape::NONE } }
    }
}

/// A triangulation of a polygon as a binary tree, told in preorder: 1 for a triangle on a side, 0 for an edge; from the highest bit on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shape(u32);

impl Shape {
    /// No triangulation.
    pub const NONE: Self = Self(0);

    fn new<const MOST: usize>(sides: usize, apex: &[[u8; MOST]; MOST]) -> Self {
        let mut open = [(0u8, 0u8); MOST];
        open[0] = (0, sides as u8 - 1);
        let (mut count, mut bits, mut place) = (1, 0, 1 << 31);
        while count > 0 {
            count -= 1;
            let (i, j) = open[count];
            if j - i >= 2 {
                bits |= place;
                let k = apex[usize::from(i)][usize::from(j)];
                open[count] = (k, j);
                open[count + 1] = (i, k);
                count += 2;
            }
            place >>= 1;
        }
        Self(bits)
    }

    /// The triangulation; `None` for [`Shape::NONE`].
    pub fn triangulation(self) -> Option<Triangulation> {
        (self != Self::NONE).then(|| {
            let mut triangles = Triangles::default();
            // The vertices where triangles and their left halves begin: a half is over where an edge ends what is open.
            let mut open = [(0u8, NOT_YET); MAX_SIDES];
            let (mut count, mut bits, mut at) = (0, self.0, 0);
            loop {
                if bits >> 31 == 1 {
                    open[count] = (at, NOT_YET);
                    count += 1;
                } else {
                    at += 1;
                    // All parts that end here.
                    while count > 0 && open[count - 1].1 != NOT_YET {
                        count -= 1;
                        let (i, k) = open[count];
                        triangles.push([i, k, at].map(usize::from));
                    }
                    if count == 0 {
                        break;
                    }
                    open[count - 1].1 = at;
                }
                bits <<= 1;
            }
            Triangulation { sides: usize::from(at) + 1, triangles }
        })
    }
}

const NOT_YET: u8 = u8::MAX;

/// A list of triangles, index triples i < k < j, counter-clockwise.
#[derive(Clone, Copy, Debug, Default)]
pub struct Triangles {
    count: usize,
    of: [[u8; 3]; MAX_SIDES],
}

impl Triangles {
    fn push(&mut self, triangle: [usize; 3]) {
        self.of[self.count] = triangle.map(|i| i as u8);
        self.count += 1;
    }

    /// One after the other.
    pub fn iter(&self) -> impl Iterator<Item = [usize; 3]> + Clone + '_ {
        self.of[..self.count].iter().map(|t| t.map(usize::from))
    }
}

/// A triangulation of a polygon of `sides` vertices, numbered counter-clockwise.
#[derive(Clone, Copy, Debug)]
pub struct Triangulation {
    sides: usize,
    /// Its triangles.
    pub triangles: Triangles,
}

impl Triangulation {
    /// The diagonals i < j.
    pub fn diagonals(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        let edges = self.triangles.iter().flat_map(|[i, k, j]| [(i, k), (k, j)]);
        edges.filter(|(i, j)| j - i >= 2)
    }

    /// The operation that puts the vertex back: split of the edge a→b, then flips, each told by the start of its link edge.
    /// The edge must be one of the diagonals, or the closing side n-1→0 of an open polygon.
    pub fn operation(&self, ring: &[Vertex], (a, b): (usize, usize)) -> (Site, Vec<Vertex>) {
        let mut third = [[usize::MAX; MAX_SIDES]; MAX_SIDES];
        for [i, k, j] in self.triangles.iter() {
            third[i][k] = j;
            third[k][j] = i;
            third[j][i] = k;
        }
        let mut queue = Vec::with_capacity(2 * self.sides);
        for (a, b) in [(a, b), (b, a)] {
            let c = third[a][b];
            if c != usize::MAX {
                queue.extend([(b, c), (c, a)]);
            }
        }
        let mut flips = Vec::with_capacity(self.sides);
        let mut head = 0;
        while let Some(&(p, q)) = queue.get(head) {
            head += 1;
            let r = third[q][p];
            if r != usize::MAX {
                flips.push(ring[p]);
                queue.extend([(p, r), (r, q)]);
            }
        }
        (Site::Edge(ring[a], ring[b]), flips)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FREE: fn(usize, usize) -> f32 = |_, _| 0.0;
    const NEVER: fn(usize, usize) -> f32 = |_, _| f32::INFINITY;

    fn each(cost: impl Fn([usize; 3]) -> f32) -> impl Fn(usize, usize, usize) -> Vec4 {
        move |i, j, k| Vec4::from_array([0, 1, 2, 3].map(|lane| cost([i, k + lane, j])))
    }

    #[test]
    fn the_cheapest_triangulation_of_a_hexagon() {
        // A triangle costs 1, but 0 where it contains vertex 2: the fan round 2 wins.
        let cost = |t: [usize; 3]| if t.contains(&2) { 0.0 } else { 1.0 };
        let solved = Solved::new::<MAX_SIDES, ROW>(6, false, FREE, each(cost));
        assert_eq!(solved.cost, 0.0);
        let t = solved.shape.triangulation().unwrap();
        assert_eq!(t.triangles.iter().count(), 4);
        assert!(t.triangles.iter().all(|t| t.contains(&2)));
        // Without the diagonals of vertex 2 a triangulation is left, without any diagonal none.
        let never_at_2 = |i, j| if i == 2 || j == 2 { f32::INFINITY } else { 0.0 };
        let t =
            Solved::new::<MAX_SIDES, ROW>(6, false, never_at_2, each(cost)).shape.triangulation().unwrap();
        assert!(t.diagonals().all(|(i, j)| i != 2 && j != 2));
        assert!(Solved::new::<MAX_SIDES, ROW>(6, false, NEVER, each(cost)).shape.triangulation().is_none());
    }

    #[test]
    fn an_open_polygon_asks_for_its_closing_side() {
        assert!(Solved::new::<MAX_SIDES, ROW>(3, true, NEVER, each(|_| 1.0)).shape.triangulation().is_none());
        assert!(
            Solved::new::<MAX_SIDES, ROW>(3, false, NEVER, each(|_| 1.0)).shape.triangulation().is_some()
        );
        assert_eq!(Solved::new::<MAX_SIDES, ROW>(3, true, |_, _| 0.5, each(|_| 1.0)).cost, 1.5);
    }

    #[test]
    fn a_shape_tells_the_triangulation_that_was_found() {
        for sides in 3..=MAX_SIDES {
            // Costs without any order.
            let cost = |[i, k, j]: [usize; 3]| ((i * 7919 + k * 104_729 + j * 1_299_709) % 1009) as f32;
            let solved = Solved::new::<MAX_SIDES, ROW>(sides, false, FREE, each(cost));
            let t = solved.shape.triangulation().unwrap();
            assert_eq!(t.triangles.iter().count(), sides - 2);
            assert_eq!(t.triangles.iter().map(cost).sum::<f32>(), solved.cost);
            assert_eq!(t.diagonals().count(), sides - 3);
            assert!(t.triangles.iter().all(|[i, k, j]| i < k && k < j && j < sides));
        }
    }
}
