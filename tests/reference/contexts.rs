//! Chapters 5.5.2 and 5.5.3: contexts of splits and flips.

use super::survey::Survey;
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

/// Of a flip, with the two numbers that it is made from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flip {
    pub bend: usize,
    pub angle: usize,
    pub sum: f32,
    pub cosine: f32,
}

/// The context of a split of the edge named by k.
pub fn split(
    mesh: &Mesh,
    survey: &Survey,
    k: Edge,
    cell: impl Fn(usize) -> Cell,
    is_starred: impl Fn(Edge) -> bool,
) -> Split {
    let (a, b) = k;
    let o = mesh.opposite(k);
    let names: Vec<Edge> = [Some(k), o].into_iter().flatten().collect();
    let sides = names.iter().flat_map(|&e| [mesh.next(e), mesh.prev(e)]);
    let closed = sides.filter(|&e| mesh.opposite(e).is_none_or(&is_starred)).count();
    let extent = |v: usize| survey.extent[v];
    let area = |c: Edge| survey.area(mesh.triangle(c));
    let all = (extent(a) + extent(b)) + extent(mesh.tip(k));
    let (mean, both) = match o {
        None => (all * (1.0 / 3.0), 2.0 * area(k)),
        Some(o) => ((all + extent(mesh.tip(o))) * 0.25, area(k) + area(o)),
    };
    let size = (d2(cell(a), cell(b)) * both) / larger(mean * mean, f32::MIN_POSITIVE);
    let quarter = i64::from(size.to_bits() >> 21 & 3);
    let class = (4 * (exponent(size) + 4) + quarter).clamp(0, 27) as usize;
    Split { kind: usize::from(o.is_none()), closed, class, size }
}

/// The context of a flip of p→q between v and r.
pub fn flip([v, r, p, q]: [Cell; 4]) -> Flip {
    let (x, y) = (Vector::between(v, p), Vector::between(v, q));
    let (z, w) = (Vector::between(r, p), Vector::between(r, q));
    let (ours, theirs) = (cross(x, y), cross(w, z));
    let n = larger(dot(ours, ours).sqrt(), 0.5);
    let m = larger(dot(theirs, theirs).sqrt(), 0.5);
    let over = 1.0 / (n * m);
    let sum = (dot(x, y) * m + dot(z, w) * n) * over;
    let t = sum / (1.0 + sum.abs());
    let angle = floor(t * 8.0 + 8.0).clamp(0, 15) as usize;
    let cosine = dot(ours, theirs) * over;
    let bend = ((exponent(1.0 - cosine).clamp(-8, 1) + 8) / 2) as usize;
    Flip { bend, angle, sum, cosine }
}

#[test]
fn the_square_of_chapter_5() {
    use super::walk::Walk;
    let [a, b, c, d] = [0, 1, 2, 3];
    let points = vec![[0, 0, 0], [255, 0, 0], [255, 255, 0], [0, 255, 0]];
    let mut mesh = Mesh { roots: vec![(a, b)], points, ..Mesh::default() };
    mesh.add([a, b, c]);
    mesh.add([a, c, d]);
    let cell = |v: usize| mesh.points[v];
    let survey = Survey::of(&mesh, &Walk::of(&mesh), cell);
    assert_eq!(survey.area([c, a, b]), 65025.0);
    assert_eq!(survey.area([d, c, a]), 65025.0);
    assert_eq!(survey.extent, [97537.5, 65025.0, 97537.5, 65025.0]);
    let context = |k| split(&mesh, &survey, k, cell, |_| false);
    assert_eq!(context((a, b)), Split { kind: 1, closed: 1, class: 16, size: 1.125 });
    assert_eq!(context((c, a)), Split { kind: 0, closed: 4, class: 21, size: 2.56 });
}

/// Both triangles equilateral and of one size: class 18, whatever else.
#[test]
fn as_even_as_can_be() {
    use super::walk::Walk;
    let mut mesh = Mesh { roots: vec![(0, 1)], ..Mesh::default() };
    mesh.points = vec![[4, 0, 0], [0, 4, 0], [0, 0, 4], [4, 4, 4]];
    mesh.add([0, 1, 2]);
    mesh.add([1, 0, 3]);
    let survey = Survey::of(&mesh, &Walk::of(&mesh), |v| mesh.points[v]);
    let context = |k| split(&mesh, &survey, k, |v| mesh.points[v], |_| false).class;
    assert_eq!([context((0, 1)), context((1, 2))], [18, 18]);
}

/// A flat pair of half squares, then one folded flat onto itself.
#[test]
fn two_right_angles() {
    let [v, p, q] = [[0, 0, 0], [1, 0, 0], [0, 1, 0]];
    assert_eq!(flip([v, [1, 1, 0], p, q]), Flip { bend: 0, angle: 8, sum: 0.0, cosine: 1.0 });
    assert_eq!(flip([v, v, p, q]), Flip { bend: 4, angle: 8, sum: 0.0, cosine: -1.0 });
}
