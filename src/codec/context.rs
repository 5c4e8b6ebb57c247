//! What a decision is coded under: small classes of the geometry at hand, in integers and plain binary64 (spec §5.5, §9).

/// Squared distance of two lattice points. Coordinates stay below 2^24, so the sum is exact.
fn distance_squared(a: [i32; 3], b: [i32; 3]) -> u64 {
    let d = |k: usize| i64::from(a[k] - b[k]);
    (d(0) * d(0) + d(1) * d(1) + d(2) * d(2)) as u64
}

/// Length of an edge, as the bit length of its longest extent along an axis: 0 ..= 32.
pub fn extent(a: [i32; 3], b: [i32; 3]) -> usize {
    let size = (0..3).map(|k| a[k].abs_diff(b[k])).max().unwrap_or(0);
    32 - size.leading_zeros() as usize
}

/// Classes of [`edge_ratio`].
pub const RATIOS: usize = 9;

/// How long the edge a–b is beside the other edges of its triangles, whose tips are given: the class of 4 × squared length over
/// their mean squared length.
#[inline]
pub fn edge_ratio(a: [i32; 3], b: [i32; 3], tip: [i32; 3], far_tip: Option<[i32; 3]>) -> usize {
    let mut others = distance_squared(tip, a) + distance_squared(tip, b);
    let mut count = 2;
    if let Some(tip) = far_tip {
        others += distance_squared(tip, a) + distance_squared(tip, b);
        count = 4;
    }
    let scaled = 4 * count * distance_squared(a, b);
    let others = others.max(1);
    [1, 2, 3, 4, 5, 6, 8, 12].iter().map(|bound| usize::from(scaled >= bound * others)).sum()
}

/// Classes of [`delaunay`].
pub const ANGLES: usize = 8;

/// How far the edge p–q between v and r is from being locally Delaunay: the class of cot(angle at v) + cot(angle at r).
pub fn delaunay(v: [i32; 3], p: [i32; 3], q: [i32; 3], r: [i32; 3]) -> usize {
    let sum = cotangent(v, p, q) + cotangent(r, p, q);
    [-1.0, -0.4, -0.1, 0.1, 0.4, 1.0, 2.0].iter().filter(|&&bound| sum >= bound).count()
}

/// Cotangent of the angle at `tip` between `p` and `q`: dot product over length of cross product, which counts as 0.5 at least.
fn cotangent(tip: [i32; 3], p: [i32; 3], q: [i32; 3]) -> f64 {
    let d = |x: [i32; 3]| -> [f64; 3] { std::array::from_fn(|k| f64::from(x[k] - tip[k])) };
    let (x, y) = (d(p), d(q));
    let dot = x[0] * y[0] + x[1] * y[1] + x[2] * y[2];
    let cross = [x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]];
    let length = (cross[0] * cross[0] + cross[1] * cross[1] + cross[2] * cross[2]).sqrt();
    dot / length.max(0.5)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_classes_of_a_square_and_of_its_stretched_diagonal() {
        // Squared diagonal 200, squared sides 100: 4 * 2 = 8 times the mean.
        let [a, b, c, d] = [[0, 0, 0], [10, 0, 0], [10, 10, 0], [0, 10, 0]];
        assert_eq!(edge_ratio(a, c, b, Some(d)), 7);
        // A side beside the other two edges of its triangle, squared 100 and 200: 4 * 100 / 150 = 2.67 times.
        assert_eq!(edge_ratio(a, b, c, None), 2);
        // Both angles opposite to the diagonal are right angles: the sum of cotangents is 0.
        assert_eq!(delaunay(b, a, c, d), 3);
        // Sides of 10, diagonal of 2: the angles opposite are small, the edge is as Delaunay as can be.
        assert_eq!(delaunay([0, 10, 0], [9, 0, 0], [9, 2, 0], [20, 1, 0]), 7);
    }

    #[test]
    fn degenerate_geometry_has_classes_too() {
        assert!(edge_ratio([7; 3], [7; 3], [7; 3], None) < RATIOS);
        assert!(delaunay([1; 3], [1; 3], [1; 3], [1; 3]) < ANGLES);
    }
}
