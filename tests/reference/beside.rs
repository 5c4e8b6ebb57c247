//! Chapter 13.4: what is beside a wedge, and what it tells.

use super::column::Place;
use super::vector::{Vector, cross, dot};
use super::walk::Edge;

/// A wedge beside another one.
#[derive(Clone, Copy, Debug)]
pub struct Beside {
    /// A corner that has it.
    pub corner: Edge,
    /// Its number; none where it is not known.
    pub wedge: Option<usize>,
    /// From the vertex of the other.
    pub to: Vector,
}

/// The corners of a wedge that count.
pub fn counted<'a>(at: &Place<'a>) -> &'a [Edge] {
    &at.corners[..at.corners.len().min(64)]
}

pub fn position(at: &Place, c: Edge) -> [f64; 3] {
    at.mesh.points[at.mesh.tip(c)].map(|q| q as f64)
}

/// From the vertex of a corner to that of another one.
pub fn between(at: &Place, from: Edge, to: Edge) -> Vector {
    let [from, to] = [from, to].map(|c| at.mesh.points[at.mesh.tip(c)]);
    Vector::between(from, to)
}

/// The list of those beside.
pub fn beside(at: &Place) -> Vec<Beside> {
    let corners = counted(at);
    let of = |corner: Edge| {
        let wedge = at.of.get(&corner).copied();
        Beside { corner, wedge, to: between(at, corners[0], corner) }
    };
    let mut list: Vec<Beside> = vec![];
    for &c in corners {
        let next = of(at.mesh.next(c));
        if list.last().is_none_or(|last| last.wedge != next.wedge) {
            list.push(next);
        }
        list.push(of(at.mesh.prev(c)));
    }
    if let [first, .., last] = &list[..]
        && at.mesh.tip(first.corner) == at.mesh.tip(last.corner)
        && first.wedge == last.wedge
    {
        list.pop();
    }
    list
}

/// Those that have a value, but where another at their vertex has the same.
pub fn known<'a>(at: &Place<'a>, list: &[Beside]) -> Vec<(Beside, &'a Vec<i32>)> {
    let value = |b: &Beside| -> Option<&'a Vec<i32>> { at.values.get(&b.wedge?)?.as_ref() };
    let is_twin = |x: usize, y: usize| {
        at.mesh.tip(list[x].corner) == at.mesh.tip(list[y].corner) && value(&list[x]) == value(&list[y])
    };
    let n = list.len();
    let counts = |&b: &usize| !(b > 0 && is_twin(b - 1, b) || b > 1 && b == n - 1 && is_twin(0, b));
    (0..n).filter(counts).filter_map(|b| Some((list[b], value(&list[b])?))).collect()
}

/// The share of each of these; none where they are too few.
pub fn shares(to: &[Vector]) -> Option<Vec<f32>> {
    if to.len() < 3 {
        return None;
    }
    let w: Vec<f32> = to.iter().map(|&v| 1.0 / (dot(v, v) + 1.0)).collect();
    let sum = |f: &dyn Fn(usize) -> f32| (0..to.len()).fold(0.0, |sum, b| sum + f(b));
    let whole = sum(&|b| w[b]);
    let m = [0, 1, 2].map(|k| sum(&|b| w[b] * to[b].0[k]));
    let over = 1.0 / whole;
    let middle = Vector(m.map(|m| m * over));
    let s = |i: usize, k: usize| sum(&|b| (w[b] * to[b].0[i]) * to[b].0[k]) - m[i] * middle.0[k];
    let (xx, xy, xz, yy, yz, zz) = (s(0, 0), s(0, 1), s(0, 2), s(1, 1), s(1, 2), s(2, 2));
    let flat = ((xx + yy) + zz) / 256.0 + 1.0 / 65_536.0;
    let x = Vector([xx + flat, xy, xz]);
    let y = Vector([xy, yy + flat, yz]);
    let z = Vector([xz, yz, zz + flat]);
    // The products of A are those of cross products of its rows.
    let rows = [cross(y, z), cross(z, x), cross(x, y)];
    let over_all = 1.0 / dot(x, rows[0]);
    let slope = Vector(rows.map(|row| dot(row, middle) * over_all));
    let constant = over + dot(slope, middle);
    Some((0..to.len()).map(|b| w[b] * (constant - dot(slope, to[b]))).collect())
}
