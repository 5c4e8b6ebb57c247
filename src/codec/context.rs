//! What a decision is coded under: small classes of the geometry at hand, in integers and plain binary64 (spec §5.5, §9).

/// Longest extent of an edge along an axis.
pub fn extent(a: [i32; 3], b: [i32; 3]) -> u32 {
    (0..3).map(|k| a[k].abs_diff(b[k])).max().unwrap_or(0)
}

/// Classes of the angles of [`link_edge`].
pub const ANGLES: usize = 16;
/// Classes of the bend of [`link_edge`].
pub const BENDS: usize = 6;

/// How far the edge p–q between v and r is from being locally Delaunay, and how sharply the surface bends there.
#[inline]
pub fn link_edge(v: [i32; 3], p: [i32; 3], q: [i32; 3], r: [i32; 3]) -> (usize, usize) {
    let (dot_v, normal_v) = products(v, p, q);
    let (dot_r, normal_r) = products(r, q, p);
    let length_v = dot(normal_v, normal_v).sqrt().max(0.5);
    let length_r = dot(normal_r, normal_r).sqrt().max(0.5);
    let both = 1.0 / (length_v * length_r);
    // cot(angle at v) + cot(angle at r), and from there to -1 .. 1.
    let sum = (dot_v * length_r + dot_r * length_v) * both;
    let angle = sum / (1.0 + sum.abs());
    let cosine = dot(normal_v, normal_r) * both;
    let bend = [0.0, 0.7, 0.9, 0.97, 0.995].iter().map(|&bound| usize::from(cosine < bound)).sum();
    (((angle * 8.0 + 8.0) as usize).min(ANGLES - 1), bend)
}

/// Dot and cross product of p - tip and q - tip.
fn products(tip: [i32; 3], p: [i32; 3], q: [i32; 3]) -> (f64, [f64; 3]) {
    let d = |x: [i32; 3]| -> [f64; 3] { std::array::from_fn(|k| f64::from(x[k] - tip[k])) };
    let (x, y) = (d(p), d(q));
    (dot(x, y), [x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]])
}

fn dot(x: [f64; 3], y: [f64; 3]) -> f64 {
    x[0] * y[0] + x[1] * y[1] + x[2] * y[2]
}
