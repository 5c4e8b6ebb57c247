//! How far a surface jumps although its new vertices begin on it.
//!
//! A vertex that begins where its edge was split, and no flip: nothing jumps. A flip replaces the edge p–q of the triangles (v, p, q) and
//! (x, q, p) by v–x. Let g be a point of the edge p–q and h one of the edge v–x. Cut the two triangles before at g and the two after
//! at h: there are the same four triangles, with g in the place of h. So no point has to move further than g lies from h, and the
//! nearest such points bound the jump. Flips one after the other add up; operations of one level have disjoint stars, so that
//! the largest counts; levels add up.

use crate::mesh::{CornerTable, Vertex};

/// The jumps since they were told last, in steps of the lattice.
#[derive(Clone, Copy, Debug, Default)]
pub struct Jumps {
    before: f64,
    /// Of the precision pass of the level under way, of its operations, and of the ends of split edges.
    level: [f64; 3],
}

impl Jumps {
    /// Counts a jump of operations of the level under way.
    pub fn operations(&mut self, jump: f64) {
        self.level[1] = self.level[1].max(jump);
    }

    /// Counts a part of the precision pass of the level under way, in which each vertex moves once, at most so far.
    pub fn precision(&mut self, shift: f64) {
        self.level[0] = self.level[0].max(shift);
    }

    /// Counts some operations of the level under way that move ends of edges, each at most so far: others may move them again.
    pub fn lifts(&mut self, shift: f64) {
        self.level[2] += shift;
    }

    /// What follows is on top of it.
    pub fn end_level(&mut self) {
        self.before += std::mem::take(&mut self.level).iter().sum::<f64>();
    }

    /// A bound of all of them together.
    pub fn sum(self) -> f64 {
        self.before + self.level.iter().sum::<f64>()
    }
}

/// The largest jump of operations of one level with these flips: the vertex inserted, start and end of the link edge, by operation in order.
/// `place` tells where a vertex begins.
pub fn of_flips(table: &CornerTable, flips: &[[Vertex; 3]], place: impl Fn(Vertex) -> [f64; 3]) -> f64 {
    let operations = flips.chunk_by(|a, b| a[0] == b[0]);
    operations.map(|flips| of_operation(table, flips, &place)).fold(0.0, f64::max)
}

fn of_operation(table: &CornerTable, flips: &[[Vertex; 3]], place: impl Fn(Vertex) -> [f64; 3]) -> f64 {
    let Some(&[v, ..]) = flips.first() else { return 0.0 };
    let mut link = table.link(v);
    let mut sum = 0.0;
    // Backwards: what a flip brought into the link stands between the ends of the edge.
    for &[_, p, q] in flips.iter().rev() {
        let count = link.len();
        let far = (0..count).find(|&k| link[k] == p).map(|k| (k + 1) % count);
        let Some(far) = far.filter(|&k| link[(k + 1) % count] == q) else {
            debug_assert!(false, "a flipped edge has one vertex between its ends");
            return f64::INFINITY;
        };
        let x = link.remove(far);
        sum += apart([place(p), place(q)], [place(v), place(x)]);
    }
    sum
}

/// How far two segments are apart.
fn apart([a, b]: [[f64; 3]; 2], [c, d]: [[f64; 3]; 2]) -> f64 {
    let (u, v, w) = (minus(b, a), minus(d, c), minus(a, c));
    let (uu, uv, vv, uw, vw) = (dot(u, u), dot(u, v), dot(v, v), dot(u, w), dot(v, w));
    let onto = |x: f64, length: f64| if length > 0.0 { (x / length).clamp(0.0, 1.0) } else { 0.0 };
    // Where the lines are nearest, then the nearest point of the other segment, and of the first again.
    let s = onto(uv * vw - vv * uw, uu * vv - uv * uv);
    let t = onto(uv * s + vw, vv);
    let s = onto(uv * t - uw, uu);
    let gap = [0, 1, 2].map(|k| w[k] + s * u[k] - t * v[k]);
    dot(gap, gap).sqrt()
}

fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|k| a[k] - b[k])
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn segments() {
        let x = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0]];
        assert_eq!(apart(x, [[1.0, -1.0, 3.0], [1.0, 1.0, 3.0]]), 3.0, "crossing at a distance");
        assert_eq!(apart(x, [[3.0, 0.0, 0.0], [4.0, 0.0, 0.0]]), 1.0, "in one line");
        assert_eq!(apart(x, [[1.0, 4.0, 0.0], [1.0, 7.0, 0.0]]), 4.0, "ending above");
        assert_eq!(apart(x, [[1.0, 2.0, 0.0], [1.0, 2.0, 0.0]]), 2.0, "a point");
        assert_eq!(apart(x, [[5.0, 4.0, 0.0], [5.0, 9.0, 0.0]]), 5.0, "beside both ends");
    }

    #[test]
    fn one_flip() {
        let fan = [1, 2, 3, 4, 5].map(|k| [0, k, k % 5 + 1]);
        let table = CornerTable::from_triangles(6, &fan).unwrap();
        let mut places = [[0.0; 3]; 6];
        (places[1], places[2], places[3]) = ([1.0, -1.0, 0.0], [3.0, 0.0, 2.0], [1.0, 1.0, 0.0]);
        let jump = |flips: &[[u32; 3]]| {
            let flips: Vec<_> = flips.iter().map(|flip| flip.map(Vertex)).collect();
            of_flips(&table, &flips, |v| places[v.index()])
        };
        // From (1, 0, 0) to the line along (3, 0, 2).
        assert!((jump(&[[0, 1, 3]]) - 2.0 / 13_f64.sqrt()).abs() < 1e-12);
        assert_eq!(jump(&[]), 0.0, "without a flip nothing jumps");
    }
}
