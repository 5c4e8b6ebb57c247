//! What a decision is coded under: small classes of the geometry at hand, in integers and plain binary32 (spec §5.5.3, §9.2).

use super::vector::{Four, Vector, Vectors, exponent};

/// Classes of [`Shape::angle`].
pub const ANGLES: usize = 32;
/// Classes of [`Shape::bend`].
pub const BENDS: usize = 5;

/// The two triangles at an edge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Shape {
    /// How far the edge is from being locally Delaunay: below [`ANGLES`].
    pub angle: u8,
    /// How sharply the surface bends there: below [`BENDS`].
    pub bend: u8,
}

/// The edges p–q, four of them, between v and r.
#[inline(always)]
pub fn edges(v: [Vector; 4], p: [Vector; 4], q: [Vector; 4], r: [Vector; 4]) -> [Shape; 4] {
    shapes(Vectors::new(v), p, q, r)
}

/// The edges p–q, four of them, between the same v and r.
#[inline(always)]
pub fn link_edges(v: Vector, p: [Vector; 4], q: [Vector; 4], r: [Vector; 4]) -> [Shape; 4] {
    shapes(Vectors::of(v), p, q, r)
}

#[inline(always)]
fn shapes(v: Vectors, p: [Vector; 4], q: [Vector; 4], r: [Vector; 4]) -> [Shape; 4] {
    let [p, q, r] = [p, q, r].map(Vectors::new);
    let (vp, vq, rp, rq) = (p - v, q - v, p - r, q - r);
    let (normal_v, normal_r) = (vp.cross(vq), rq.cross(rp));
    let length = |normal: Vectors| normal.dot(normal).sqrt().max(Four::of(0.5));
    let (length_v, length_r) = (length(normal_v), length(normal_r));
    let one = Four::of(1.0);
    let both = one / (length_v * length_r);
    // cot(angle at v) + cot(angle at r), and from there to -1 .. 1.
    let sum = (vp.dot(vq) * length_r + rp.dot(rq) * length_v) * both;
    let angle = sum / (one + sum.abs());
    let angles = (angle * Four::of(16.0) + Four::of(16.0)).truncated();
    let flat = (one - normal_v.dot(normal_r) * both).floats();
    std::array::from_fn(|i| Shape {
        angle: angles[i].clamp(0, ANGLES as i32 - 1) as u8,
        // From flat, below 2^-7, to more than a right angle, in steps of 4.
        bend: (exponent(flat[i]).clamp(-8, 1) + 8) as u8 / 2,
    })
}

/// How far r is from v, over how long p–q is, in half octaves of the squares from 1/8 on, below [`REACHES`].
#[inline]
pub fn reach(v: Vector, p: Vector, q: Vector, r: Vector) -> usize {
    let (far, edge) = (r - v, q - p);
    let size = far.dot(far) / edge.dot(edge).max(1.0);
    ((size.to_bits() >> 22) as usize).saturating_sub((127 << 1) - 6).min(REACHES - 1)
}

/// Classes of [`reach`].
pub const REACHES: usize = 12;

#[cfg(test)]
mod tests {
    use super::*;

    /// Angle and bend, wherever among four.
    fn link_edge(v: Vector, p: Vector, q: Vector, r: Vector) -> (usize, usize) {
        let [a, b, c, d] = link_edges(v, [p; 4], [q; 4], [r; 4]);
        assert!(a == b && b == c && c == d);
        assert_eq!(edges([v; 4], [p; 4], [q; 4], [r; 4]), [a; 4]);
        (usize::from(a.angle), usize::from(a.bend))
    }

    fn at(x: i32, y: i32, z: i32) -> Vector {
        Vector::of_cell([x, y, z])
    }

    #[test]
    fn the_diagonal_of_a_square() {
        // Right angles at v and r: the cotangents are 0. Flat: the normals agree.
        assert_eq!(link_edge(at(0, 0, 0), at(10, 0, 0), at(0, 10, 0), at(10, 10, 0)), (16, 0));
        // Folded by a right angle along p–q = (0, 0) – (10, 0): the cosine of the normals is 0.
        assert_eq!(link_edge(at(5, 5, 0), at(10, 0, 0), at(0, 0, 0), at(5, 0, 5)).1, 4);
    }

    #[test]
    fn slim_triangles_on_both_sides_want_a_flip_and_tall_ones_do_not() {
        let (p, q) = (at(0, 0, 0), at(100, 0, 0));
        // Cotangents of nearly straight angles, about -5 each: -10 / 11 of the way down from 16.
        assert_eq!(link_edge(at(50, 5, 0), q, p, at(50, -5, 0)).0, 1);
        assert_eq!(link_edge(at(50, 500, 0), q, p, at(50, -500, 0)).0, 30);
    }

    #[test]
    fn reaches_are_half_octaves() {
        let (p, q) = (at(0, 0, 0), at(100, 0, 0));
        let reached = |far| reach(at(50, 0, 0), p, q, at(50, far, 0));
        assert_eq!([1, 36, 100, 150, 5000].map(reached), [0, 0, 6, 8, 11]);
        assert_eq!(reach(p, p, p, p), 0);
    }

    #[test]
    fn degenerate_geometry_has_classes_too() {
        let (angle, bend) = link_edge(at(1, 1, 1), at(1, 1, 1), at(1, 1, 1), at(1, 1, 1));
        assert!(angle < ANGLES && bend < BENDS);
    }
}
