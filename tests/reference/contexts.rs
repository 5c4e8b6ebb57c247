//! Chapters 5.5.2 and 5.5.3: contexts of splits and flips.

use super::extent::Extent;
use super::vector::{Vector, cross, d2, dot, exponent, floor, larger};
use super::walk::{Edge, Mesh};

type Cell = [i64; 3];

/// What is seen of an edge when it is looked at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Looked {
    pub square: f32,
    pub size: f32,
    /// Of a, b, l and r.
    pub edges: [i64; 4],
    /// Rich models alone have these.
    pub angle: usize,
    /// Classes of the sides a–l, b–l, a–r, b–r, and of how far l and r are from the middle.
    pub sides: [usize; 4],
    pub heights: [usize; 2],
}

/// Of a split.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Split {
    pub kind: usize,
    pub closed: usize,
    pub class: usize,
    pub length: usize,
    pub looked: Looked,
}

/// Of a flip, with the two numbers that its shape is made from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flip {
    pub bend: usize,
    /// That of rich models; for others, twice as coarse.
    pub angle: usize,
    pub flips: usize,
    pub closed: usize,
    /// 1 where p is an end of the edge that was split, 2 where q is.
    pub end: usize,
    /// Of p, q and r.
    pub valences: [i64; 3],
    pub reach: usize,
    pub sum: f32,
    pub cosine: f32,
}

impl Looked {
    /// An edge named by k, as the mesh stands; none where there is no such edge any more.
    pub fn at(mesh: &Mesh, k: Edge, cell: impl Fn(usize) -> Cell) -> Option<Self> {
        let left = *mesh.third.get(&k)?;
        let right = mesh.third.get(&(k.1, k.0)).copied();
        let of = |w| Extent::of(mesh, w, &cell);
        let (at_a, at_b) = (of(k.0), of(k.1));
        let (count, total) = (at_a.edges + at_b.edges, at_a.squares.wrapping_add(at_b.squares));
        let square = d2(cell(k.0), cell(k.1));
        let over = larger(square, 1.0);
        let [a, b, l, r] = [k.0, k.1, left, right.unwrap_or(left)].map(&cell);
        let side = |end, tip| (exponent(d2(end, tip) / over) + 3).clamp(0, 5) as usize;
        let height = |tip| {
            let twice = Vector::between(tip, a) + Vector::between(tip, b);
            (exponent(dot(twice, twice) / over) + 1).clamp(0, 5) as usize
        };
        Some(Self {
            square,
            size: (square * count as f32) / larger(total as f32, 1.0),
            angle: flip([l, r, a, b]).angle / 2,
            edges: [at_a.edges, at_b.edges, of(left).edges, of(right.unwrap_or(left)).edges],
            sides: [side(a, l), side(b, l), side(a, r), side(b, r)],
            heights: [height(l), height(r)],
        })
    }
}

/// The context of a split of the edge named by k.
pub fn split(mesh: &Mesh, k: Edge, looked: Looked, is_starred: impl Fn(Edge) -> bool) -> Split {
    let o = mesh.opposite(k);
    let names: Vec<Edge> = [Some(k), o].into_iter().flatten().collect();
    let sides = names.iter().flat_map(|&e| [mesh.next(e), mesh.prev(e)]);
    let closed = sides.filter(|&e| mesh.opposite(e).is_none_or(&is_starred)).count();
    let class = (quarters(looked.size) + 10).clamp(0, 19) as usize;
    let length = quarters(looked.square).max(0) as usize;
    Split { kind: usize::from(o.is_none()), closed, class, length, looked }
}

/// reach of v, r, p, q.
pub fn reach([v, r, p, q]: [Cell; 4]) -> usize {
    let size = d2(v, r) / larger(d2(p, q), 1.0);
    let half = i64::from(size.to_bits() >> 22 & 1);
    (2 * exponent(size) + half + 6).clamp(0, 11) as usize
}

/// Quarters of octaves.
fn quarters(x: f32) -> i64 {
    4 * exponent(x) + i64::from(x.to_bits() >> 21 & 3)
}

/// What is known of the shape of p→q between v and r; the rest of the context is open.
pub fn flip([v, r, p, q]: [Cell; 4]) -> Flip {
    let (x, y) = (Vector::between(v, p), Vector::between(v, q));
    let (z, w) = (Vector::between(r, p), Vector::between(r, q));
    let (ours, theirs) = (cross(x, y), cross(w, z));
    let n = larger(dot(ours, ours).sqrt(), 0.5);
    let m = larger(dot(theirs, theirs).sqrt(), 0.5);
    let over = 1.0 / (n * m);
    let sum = (dot(x, y) * m + dot(z, w) * n) * over;
    let t = sum / (1.0 + sum.abs());
    let angle = floor(t * 16.0 + 16.0).clamp(0, 31) as usize;
    let cosine = dot(ours, theirs) * over;
    let bend = ((exponent(1.0 - cosine).clamp(-8, 1) + 8) / 2) as usize;
    Flip { bend, angle, flips: 0, closed: 0, end: 0, valences: [0; 3], reach: 0, sum, cosine }
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
    let looked = |k| Looked::at(&mesh, k, cell).unwrap();
    let context = |k| split(&mesh, k, looked(k), |_| false);
    let (edges, sides, heights) = ([3, 2, 3, 3], [4, 3, 4, 3], [3, 3]);
    let at_ab = Looked { square: 65025.0, size: 5.0 / 6.0, angle: 13, edges, sides, heights };
    assert_eq!(context((a, b)), Split { kind: 1, closed: 1, class: 8, length: 63, looked: at_ab });
    let (edges, sides, heights) = ([3, 3, 2, 2], [2; 4], [1, 1]);
    let at_ca = Looked { square: 130050.0, size: 1.5, angle: 8, edges, sides, heights };
    assert_eq!(context((c, a)), Split { kind: 0, closed: 4, class: 12, length: 67, looked: at_ca });
}

/// All edges of one length: class 10, whatever else.
#[test]
fn as_even_as_can_be() {
    let mut mesh = Mesh { roots: vec![(0, 1)], ..Mesh::default() };
    mesh.points = vec![[4, 0, 0], [0, 4, 0], [0, 0, 4], [4, 4, 4]];
    mesh.add([0, 1, 2]);
    mesh.add([1, 0, 3]);
    let looked = |k| Looked::at(&mesh, k, |v| mesh.points[v]).unwrap();
    let context = |k| split(&mesh, k, looked(k), |_| false).class;
    assert_eq!([context((0, 1)), context((1, 2))], [10, 10]);
}

/// A flat pair of half squares, then one folded flat onto itself.
#[test]
fn two_right_angles() {
    let [v, p, q] = [[0, 0, 0], [1, 0, 0], [0, 1, 0]];
    let shape = |r| {
        let flip = flip([v, r, p, q]);
        (flip.bend, flip.angle, flip.sum, flip.cosine)
    };
    assert_eq!(shape([1, 1, 0]), (0, 16, 0.0, 1.0));
    assert_eq!(shape(v), (4, 16, 0.0, -1.0));
}
