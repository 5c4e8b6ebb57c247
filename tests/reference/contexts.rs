//! Chapters 5.4 and 5.5: contexts.

use super::refinement::bit_length;
use super::walk::{Edge, Mesh};

type Cell = [i64; 3];

/// extent(A, B) of §5.4.
pub fn extent(a: Cell, b: Cell) -> usize {
    bit_length((0..3).map(|k| (a[k] - b[k]).abs()).max().unwrap_or(0))
}

/// The kind, closed and ratio of a split of the edge named by k.
pub fn split(
    mesh: &Mesh,
    k: Edge,
    cell: impl Fn(usize) -> Cell,
    is_starred: impl Fn(Edge) -> bool,
) -> [usize; 3] {
    let (a, b) = k;
    let names: Vec<Edge> = [Some(k), mesh.opposite(k)].into_iter().flatten().collect();
    let sides = names.iter().flat_map(|&e| [mesh.next(e), mesh.prev(e)]);
    let closed = sides.filter(|&e| mesh.opposite(e).is_none_or(&is_starred)).count();
    let d2 = |v, w| -> i64 {
        let (p, q) = (cell(v), cell(w));
        (0..3).map(|i| (p[i] - q[i]).pow(2)).sum()
    };
    let tips = names.iter().map(|&e| mesh.tip(e));
    let others: i64 = tips.map(|tip| d2(tip, a) + d2(tip, b)).sum();
    let scaled = 4 * (2 * names.len() as i64) * d2(a, b);
    let ratio = [1, 2, 3, 4, 5, 6, 8, 12].iter().filter(|&it| scaled >= it * others.max(1)).count();
    [usize::from(names.len() == 1), closed, ratio]
}

/// The angle of a flip of p→q between v and r.
pub fn angle([v, r, p, q]: [Cell; 4]) -> usize {
    let sum = cotangent(v, p, q) + cotangent(r, p, q);
    [-1.0, -0.4, -0.1, 0.1, 0.4, 1.0, 2.0].iter().filter(|&&it| sum >= it).count()
}

fn cotangent(t: Cell, a: Cell, b: Cell) -> f64 {
    let [x0, x1, x2] = [0, 1, 2].map(|k| (a[k] - t[k]) as f64);
    let [y0, y1, y2] = [0, 1, 2].map(|k| (b[k] - t[k]) as f64);
    let dot = x0 * y0 + x1 * y1 + x2 * y2;
    let [c0, c1, c2] = [x1 * y2 - x2 * y1, x2 * y0 - x0 * y2, x0 * y1 - x1 * y0];
    let length = ((c0 * c0 + c1 * c1) + c2 * c2).sqrt();
    dot / length.max(0.5)
}
