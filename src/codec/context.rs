//! What a decision is coded under: small classes of the geometry at hand, in integers and plain binary32 (spec §5.5.3, §9.2).

use super::vector::{Vector, exponent, truncate};

/// Classes of the angles of [`link_edge`].
pub const ANGLES: usize = 16;
/// Classes of the bend of [`link_edge`].
pub const BENDS: usize = 5;

/// How far the edge p–q between v and r is from being locally Delaunay, and how sharply the surface bends there.
#[inline(always)]
pub fn link_edge(v: Vector, p: Vector, q: Vector, r: Vector) -> (usize, usize) {
    let (vp, vq, rp, rq) = (p - v, q - v, p - r, q - r);
    let (normal_v, normal_r) = (vp.cross(vq), rq.cross(rp));
    let [square_v, square_r, dot_v, dot_r] =
        Vector::dots([(normal_v, normal_v), (normal_r, normal_r), (vp, vq), (rp, rq)]);
    let (length_v, length_r) = (square_v.sqrt().max(0.5), square_r.sqrt().max(0.5));
    let both = 1.0 / (length_v * length_r);
    // cot(angle at v) + cot(angle at r), and from there to -1 .. 1.
    let sum = (dot_v * length_r + dot_r * length_v) * both;
    let angle = sum / (1.0 + sum.abs());
    let cosine = normal_v.dot(normal_r) * both;
    // From flat, below 2^-7, to more than a right angle, in steps of 4.
    let bend = (exponent(1.0 - cosine).clamp(-8, 1) + 8) as usize / 2;
    (truncate(angle * 8.0 + 8.0).clamp(0, ANGLES as i32 - 1) as usize, bend)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x: i32, y: i32, z: i32) -> Vector {
        Vector::of_cell([x, y, z])
    }

    #[test]
    fn the_diagonal_of_a_square() {
        // Right angles at v and r: the cotangents are 0. Flat: the normals agree.
        assert_eq!(link_edge(at(0, 0, 0), at(10, 0, 0), at(0, 10, 0), at(10, 10, 0)), (8, 0));
        // Folded by a right angle along p–q = (0, 0) – (10, 0): the cosine of the normals is 0.
        assert_eq!(link_edge(at(5, 5, 0), at(10, 0, 0), at(0, 0, 0), at(5, 0, 5)).1, 4);
    }

    #[test]
    fn slim_triangles_on_both_sides_want_a_flip_and_tall_ones_do_not() {
        let (p, q) = (at(0, 0, 0), at(100, 0, 0));
        // Cotangents of nearly straight angles, about -5 each: -10 / 11 of the way down from 8.
        assert_eq!(link_edge(at(50, 5, 0), q, p, at(50, -5, 0)).0, 0);
        assert_eq!(link_edge(at(50, 500, 0), q, p, at(50, -500, 0)).0, 15);
    }

    #[test]
    fn degenerate_geometry_has_classes_too() {
        let (angle, bend) = link_edge(at(1, 1, 1), at(1, 1, 1), at(1, 1, 1), at(1, 1, 1));
        assert!(angle < ANGLES && bend < BENDS);
    }
}
