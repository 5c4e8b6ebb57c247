//! Chapters 5.5.2 and 5.5.3: contexts of splits and flips.

use super::extent::Extent;
use super::vector::{Vector, cross, d2, dot, exponent, floor, larger};
use super::walk::{Edge, Mesh};

type Cell = [i64; 3];

/// Of a split, with the number that its class is made from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Split {
    pub kind: usize,
    pub closed: usize,
    pub class: usize,
    pub size: f32,
}

/// Of a flip, with the number that its angle is made from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flip {
    pub so_far: usize,
    pub ends: usize,
    pub angle: usize,
    pub sum: f32,
}

/// How long an edge is beside those at its ends, as the mesh stands: what its class is made from.
pub fn size(mesh: &Mesh, (a, b): Edge, cell: impl Fn(usize) -> Cell) -> f32 {
    let [at_a, at_b] = [a, b].map(|w| Extent::of(mesh, w, &cell));
    let (count, total) = (at_a.edges + at_b.edges, at_a.squares.wrapping_add(at_b.squares));
    (d2(cell(a), cell(b)) * count as f32) / larger(total as f32, 1.0)
}

/// The context of a split of the edge named by k, which had this size when it was looked at.
pub fn split(mesh: &Mesh, k: Edge, size: f32, is_starred: impl Fn(Edge) -> bool) -> Split {
    let o = mesh.opposite(k);
    let names: Vec<Edge> = [Some(k), o].into_iter().flatten().collect();
    let sides = names.iter().flat_map(|&e| [mesh.next(e), mesh.prev(e)]);
    let closed = sides.filter(|&e| mesh.opposite(e).is_none_or(&is_starred)).count();
    let quarter = i64::from(size.to_bits() >> 21 & 3);
    let class = (4 * exponent(size) + quarter + 10).clamp(0, 19) as usize;
    Split { kind: usize::from(o.is_none()), closed, class, size }
}

/// The context of a flip of p→q, vertices, between those at v and r, after so many flips of this star; `split` is the edge that was split.
pub fn flip((p, q): Edge, split: Edge, so_far: usize, [at_v, at_r, at_p, at_q]: [Cell; 4]) -> Flip {
    let is_end = |w: usize| usize::from(w == split.0 || w == split.1);
    let (x, y) = (Vector::between(at_v, at_p), Vector::between(at_v, at_q));
    let (z, w) = (Vector::between(at_r, at_p), Vector::between(at_r, at_q));
    let (ours, theirs) = (cross(x, y), cross(w, z));
    let n = larger(dot(ours, ours).sqrt(), 0.5);
    let m = larger(dot(theirs, theirs).sqrt(), 0.5);
    let sum = (dot(x, y) * m + dot(z, w) * n) * (1.0 / (n * m));
    let t = sum / (1.0 + sum.abs());
    let angle = floor(t * 8.0 + 8.0).clamp(0, 15) as usize;
    Flip { so_far: so_far.min(3), ends: is_end(p) + 2 * is_end(q), angle, sum }
}

#[test]
fn the_square_of_chapter_5() {
    let [a, b, c, d] = [0, 1, 2, 3];
    let points = vec![[0, 0, 0], [255, 0, 0], [255, 255, 0], [0, 255, 0]];
    let mut mesh = Mesh { roots: vec![(a, b)], points, ..Mesh::default() };
    mesh.add([a, b, c]);
    mesh.add([a, c, d]);
    let cell = |v: usize| mesh.points[v];
    for (w, edges, squares) in [(a, 3, 260_100), (b, 2, 130_050), (c, 3, 260_100), (d, 2, 130_050)] {
        assert_eq!(Extent::of(&mesh, w, cell), Extent { edges, squares });
    }
    let context = |k| split(&mesh, k, size(&mesh, k, cell), |_| false);
    assert_eq!(context((a, b)), Split { kind: 1, closed: 1, class: 8, size: 5.0 / 6.0 });
    assert_eq!(context((c, a)), Split { kind: 0, closed: 4, class: 12, size: 1.5 });
}

/// All edges of one length: class 10, whatever else.
#[test]
fn as_even_as_can_be() {
    let mut mesh = Mesh { roots: vec![(0, 1)], ..Mesh::default() };
    mesh.points = vec![[4, 0, 0], [0, 4, 0], [0, 0, 4], [4, 4, 4]];
    mesh.add([0, 1, 2]);
    mesh.add([1, 0, 3]);
    let context = |k| split(&mesh, k, size(&mesh, k, |v| mesh.points[v]), |_| false).class;
    assert_eq!([context((0, 1)), context((1, 2))], [10, 10]);
}

/// A flat pair of half squares, then one folded flat onto itself; an end of the edge that was split, the other, none.
#[test]
fn two_right_angles() {
    let [v, p, q] = [[0, 0, 0], [1, 0, 0], [0, 1, 0]];
    let of = |so_far, ends| Flip { so_far, ends, angle: 8, sum: 0.0 };
    assert_eq!(flip((5, 6), (5, 7), 0, [v, [1, 1, 0], p, q]), of(0, 1));
    assert_eq!(flip((5, 6), (7, 6), 2, [v, v, p, q]), of(2, 2));
    assert_eq!(flip((5, 6), (7, 8), 9, [v, v, p, q]), of(3, 0));
}
