//! Retriangulating the star polygon of a removed vertex (spec §5.1; Klincsek 1980 for the dynamic programme).
//!
//! Removing a vertex replaces its star by a triangulation of the polygon of its link. Any triangulation is reached by flips and one
//! weld, so the best one is looked for over all of them, and then told as an operation.

use crate::mesh::Vertex;
use crate::refine::Site;

/// Most sides of a star polygon.
pub const MAX_SIDES: usize = 16;

/// The cheapest triangulations of a polygon and of its parts.
#[derive(Clone, Debug)]
pub struct Programme {
    sides: usize,
    apex: [[u8; MAX_SIDES]; MAX_SIDES],
    /// What the triangles and the edges made cost in all; infinite where there is no triangulation.
    pub cost: f64,
}

impl Programme {
    /// Solves the polygon of 3 to [`MAX_SIDES`] sides.
    ///
    /// `edge(i, j)`, i < j, is what making an edge costs, infinite where it must not be made. It is asked for the diagonals, and for
    /// the closing side 0, n-1 only where `open`. `triangle` is the cost of a triangle i < k < j; where it
    /// is no less than the second argument, anything no less than that will do.
    pub fn solve(
        sides: usize,
        open: bool,
        edge: impl Fn(usize, usize) -> f64,
        triangle: impl Fn([usize; 3], f64) -> f64,
    ) -> Self {
        debug_assert!((3..=MAX_SIDES).contains(&sides));
        let mut best = [[0.0; MAX_SIDES]; MAX_SIDES];
        let mut apex = [[0u8; MAX_SIDES]; MAX_SIDES];
        for span in 2..sides {
            for i in 0..sides - span {
                let j = i + span;
                let closing = span == sides - 1;
                let own = if !closing || open { edge(i, j) } else { 0.0 };
                let mut least = f64::INFINITY;
                if own.is_finite() {
                    for (k, right) in best.iter().enumerate().take(j).skip(i + 1) {
                        let parts = best[i][k] + right[j] + own;
                        if parts < least {
                            let total = parts + triangle([i, k, j], least - parts);
                            if total < least {
                                least = total;
                                apex[i][j] = k as u8;
                            }
                        }
                    }
                }
                best[i][j] = least;
            }
        }
        Self { sides, apex, cost: best[0][sides - 1] }
    }

    /// The triangles of the cheapest triangulation, i < k < j; meaningless where the cost is infinite.
    pub fn triangles(&self) -> impl Iterator<Item = [usize; 3]> + '_ {
        let mut open = [(0, 0); MAX_SIDES];
        open[0] = (0, self.sides - 1);
        let mut count = 1;
        std::iter::from_fn(move || {
            count = usize::checked_sub(count, 1)?;
            let (i, j) = open[count];
            let k = self.apex[i][j] as usize;
            for (i, j) in [(i, k), (k, j)] {
                if j - i >= 2 {
                    open[count] = (i, j);
                    count += 1;
                }
            }
            Some([i, k, j])
        })
    }

    /// The cheapest triangulation, or `None` where there is none.
    pub fn triangulation(&self) -> Option<Triangulation> {
        let exists = self.cost.is_finite();
        exists.then(|| Triangulation { sides: self.sides, triangles: self.triangles().collect() })
    }
}

/// A triangulation of a polygon of `sides` vertices, numbered counter-clockwise.
#[derive(Clone, Debug)]
pub struct Triangulation {
    sides: usize,
    /// Index triples i < k < j, counter-clockwise.
    pub triangles: Vec<[usize; 3]>,
}

impl Triangulation {
    /// The diagonals i < j.
    pub fn diagonals(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        let edges = self.triangles.iter().flat_map(|&[i, k, j]| [(i, k), (k, j)]);
        edges.filter(|(i, j)| j - i >= 2)
    }

    /// The operation that puts the vertex back: split of the edge a→b, then flips, each told by the start of its link edge.
    /// The edge must be one of the diagonals, or the closing side n-1→0 of an open polygon.
    pub fn operation(&self, ring: &[Vertex], (a, b): (usize, usize)) -> (Site, Vec<Vertex>) {
        let mut third = [[usize::MAX; MAX_SIDES]; MAX_SIDES];
        for &[i, k, j] in &self.triangles {
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

    const FREE: fn(usize, usize) -> f64 = |_, _| 0.0;
    const NEVER: fn(usize, usize) -> f64 = |_, _| f64::INFINITY;

    #[test]
    fn the_cheapest_triangulation_of_a_hexagon() {
        // A triangle costs 1, but 0 where it contains vertex 2: the fan round 2 wins.
        let cost = |t: [usize; 3], _| if t.contains(&2) { 0.0 } else { 1.0 };
        let programme = Programme::solve(6, false, FREE, cost);
        assert_eq!(programme.cost, 0.0);
        let t = programme.triangulation().unwrap();
        assert_eq!(t.triangles.len(), 4);
        assert!(t.triangles.iter().all(|t| t.contains(&2)));
        // Without the diagonals of vertex 2 a triangulation is left, without any diagonal none.
        let never_at_2 = |i, j| if i == 2 || j == 2 { f64::INFINITY } else { 0.0 };
        let t = Programme::solve(6, false, never_at_2, cost).triangulation().unwrap();
        assert!(t.diagonals().all(|(i, j)| i != 2 && j != 2));
        assert!(Programme::solve(6, false, NEVER, cost).triangulation().is_none());
    }

    #[test]
    fn an_open_polygon_asks_for_its_closing_side() {
        assert!(Programme::solve(3, true, NEVER, |_, _| 1.0).triangulation().is_none());
        assert!(Programme::solve(3, false, NEVER, |_, _| 1.0).triangulation().is_some());
        assert_eq!(Programme::solve(3, true, |_, _| 0.5, |_, _| 1.0).cost, 1.5);
    }
}
