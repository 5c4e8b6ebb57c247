//! What a decision is coded under: small classes of the geometry at hand, in integers and plain binary32 (spec §5.5.3, §9.2).

use super::vector::{Four, Vector, Vectors};

/// Classes of the angles of [`link_edges`].
pub const ANGLES: usize = 16;
/// What a link edge that starts at an end of the edge split has beside its angle, and one that ends there.
pub const START: u8 = 16;
/// See [`START`].
pub const END: u8 = 32;
/// What all three make up.
pub const LINK_EDGES: usize = 64;

/// How far the edges p–q, four of them, between v and r, are from being locally Delaunay: below [`ANGLES`].
#[inline(always)]
pub fn link_edges(v: Vector, p: [Vector; 4], q: [Vector; 4], r: [Vector; 4]) -> [u8; 4] {
    let [v, p, q, r] = [Vectors::of(v), Vectors::new(p), Vectors::new(q), Vectors::new(r)];
    let (vp, vq, rp, rq) = (p - v, q - v, p - r, q - r);
    let (normal_v, normal_r) = (vp.cross(vq), rq.cross(rp));
    let length = |normal: Vectors| normal.dot(normal).sqrt().max(Four::of(0.5));
    let (length_v, length_r) = (length(normal_v), length(normal_r));
    let one = Four::of(1.0);
    let both = one / (length_v * length_r);
    // cot(angle at v) + cot(angle at r), and from there to -1 .. 1.
    let sum = (vp.dot(vq) * length_r + rp.dot(rq) * length_v) * both;
    let angle = sum / (one + sum.abs());
    let angles = (angle * Four::of(8.0) + Four::of(8.0)).truncated();
    angles.map(|angle| angle.clamp(0, ANGLES as i32 - 1) as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The angle, wherever among four.
    fn link_edge(v: Vector, p: Vector, q: Vector, r: Vector) -> usize {
        let [a, b, c, d] = link_edges(v, [p; 4], [q; 4], [r; 4]);
        assert!(a == b && b == c && c == d);
        usize::from(a)
    }

    fn at(x: i32, y: i32, z: i32) -> Vector {
        Vector::of_cell([x, y, z])
    }

    /// Right angles at v and r: the cotangents are 0, whether flat or folded.
    #[test]
    fn the_diagonal_of_a_square() {
        assert_eq!(link_edge(at(0, 0, 0), at(10, 0, 0), at(0, 10, 0), at(10, 10, 0)), 8);
        assert_eq!(link_edge(at(5, 5, 0), at(10, 0, 0), at(0, 0, 0), at(5, 0, 5)), 8);
    }

    #[test]
    fn slim_triangles_on_both_sides_want_a_flip_and_tall_ones_do_not() {
        let (p, q) = (at(0, 0, 0), at(100, 0, 0));
        // Cotangents of nearly straight angles, about -5 each: -10 / 11 of the way down from 8.
        assert_eq!(link_edge(at(50, 5, 0), q, p, at(50, -5, 0)), 0);
        assert_eq!(link_edge(at(50, 500, 0), q, p, at(50, -500, 0)), 15);
    }

    #[test]
    fn degenerate_geometry_has_a_class_too() {
        assert!(link_edge(at(1, 1, 1), at(1, 1, 1), at(1, 1, 1), at(1, 1, 1)) < ANGLES);
    }
}
