//! What a decision is coded under: small classes of the geometry at hand, in integers and plain binary32 (spec §5.5.3, §9.2).

use super::vector::{Vector, exponent};

/// Classes of the angles of [`link_edge`].
pub const ANGLES: usize = 16;
/// Classes of the bend of [`link_edge`].
pub const BENDS: usize = 5;

/// How far the edge p–q between v and r is from being locally Delaunay, and how sharply the surface bends there.
#[inline(always)]
pub fn link_edge(v: Vector, p: Vector, q: Vector, r: Vector) -> (usize, usize) {
    let (vp, vq, rp, rq) = (p - v, q - v, p - r, q - r);
    let (normal_v, normal_r) = (vp.cross(vq), rq.cross(rp));
    let length_v = normal_v.dot(normal_v).sqrt().max(0.5);
    let length_r = normal_r.dot(normal_r).sqrt().max(0.5);
    let both = 1.0 / (length_v * length_r);
    // cot(angle at v) + cot(angle at r), and from there to -1 .. 1.
    let sum = (vp.dot(vq) * length_r + rp.dot(rq) * length_v) * both;
    let angle = sum / (1.0 + sum.abs());
    let cosine = normal_v.dot(normal_r) * both;
    // From flat, below 2^-7, to more than a right angle, in steps of 4.
    let bend = (exponent(1.0 - cosine).clamp(-8, 1) + 8) as usize / 2;
    (((angle * 8.0 + 8.0) as i32).clamp(0, ANGLES as i32 - 1) as usize, bend)
}
