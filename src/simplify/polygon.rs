//! Retriangulating the star polygon of a removed vertex (spec §5.1; Klincsek 1980 for the dynamic programme).
//!
//! Removing a vertex replaces its star by a triangulation of the polygon of its link. Any triangulation is reached by flips and one
//! weld, so the best one is looked for over all of them, and then told as an operation.

use crate::mesh::Vertex;
use crate::refine::Site;

/// Most sides of a star polygon.
pub const MAX_SIDES: usize = 16;

/// A triangulation of a polygon of `sides` vertices, numbered counter-clockwise.
#[derive(Clone, Debug)]
pub struct Triangulation {
    sides: usize,
    /// What the triangles cost in all.
    pub cost: f64,
    /// Index triples i < k < j, counter-clockwise.
    pub triangles: Vec<[usize; 3]>,
}

impl Triangulation {
    /// The cheapest triangulation with admissible diagonals, or `None` where there is none.
    ///
    /// `admissible(i, j)`, i < j, is asked for edges that are not sides i, i+1; for the closing side 0, n-1 only where `open`.
    /// `cost` is that of the triangle i < k < j.
    pub fn best(
        sides: usize,
        open: bool,
        admissible: impl Fn(usize, usize) -> bool,
        cost: impl Fn(usize, usize, usize) -> f64,
    ) -> Option<Self> {
        debug_assert!((3..=MAX_SIDES).contains(&sides));
        let mut best = [[f64::INFINITY; MAX_SIDES]; MAX_SIDES];
        let mut apex = [[0u8; MAX_SIDES]; MAX_SIDES];
        for (i, row) in best.iter_mut().enumerate().take(sides - 1) {
            row[i + 1] = 0.0;
        }
        for span in 2..sides {
            for i in 0..sides - span {
                let j = i + span;
                let closing = span == sides - 1;
                if (!closing || open) && !admissible(i, j) {
                    continue;
                }
                for k in i + 1..j {
                    let parts = best[i][k] + best[k][j];
                    if parts < best[i][j] {
                        let total = parts + cost(i, k, j);
                        if total < best[i][j] {
                            best[i][j] = total;
                            apex[i][j] = k as u8;
                        }
                    }
                }
            }
        }
        let total = best[0][sides - 1];
        if total.is_infinite() {
            return None;
        }
        let mut triangles = Vec::with_capacity(sides - 2);
        let mut open_spans = vec![(0, sides - 1)];
        while let Some((i, j)) = open_spans.pop() {
            if j - i >= 2 {
                let k = apex[i][j] as usize;
                triangles.push([i, k, j]);
                open_spans.extend([(i, k), (k, j)]);
            }
        }
        Some(Self { sides, cost: total, triangles })
    }

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

    #[test]
    fn the_cheapest_triangulation_of_a_hexagon() {
        // A triangle costs 1, but 0 where it contains vertex 2: the fan round 2 wins.
        let cost = |i, k, j| if [i, k, j].contains(&2) { 0.0 } else { 1.0 };
        let t = Triangulation::best(6, false, |_, _| true, cost).unwrap();
        assert_eq!(t.cost, 0.0);
        assert_eq!(t.triangles.len(), 4);
        assert!(t.triangles.iter().all(|t| t.contains(&2)));
        // Without the diagonals of vertex 2 a triangulation is left, without any diagonal none.
        let t = Triangulation::best(6, false, |i, j| i != 2 && j != 2, cost).unwrap();
        assert!(t.diagonals().all(|(i, j)| i != 2 && j != 2));
        assert!(Triangulation::best(6, false, |_, _| false, cost).is_none());
    }

    #[test]
    fn an_open_polygon_asks_for_its_closing_side() {
        assert!(Triangulation::best(3, true, |_, _| false, |_, _, _| 1.0).is_none());
        assert!(Triangulation::best(3, false, |_, _| false, |_, _, _| 1.0).is_some());
    }
}
