//! Arithmetic of the decisions, in integers, so that any machine comes to the same mesh. What has 64 bits here is a pair of 32 bits on a
//! GPU; no sum depends on the order of its terms.

/// Bits of a lattice coordinate.
pub(super) const LATTICE_BITS: u32 = 20;
/// Bits of a difference of coordinates that enters a product.
const DIFFERENCE_BITS: u32 = 14;
/// Fractional bits of an error.
pub(super) const ERROR_BITS: u32 = 8;

/// A point of the lattice, or a difference of two.
pub(super) type Point = [i32; 3];

pub(super) fn minus(a: Point, b: Point) -> Point {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// A number of as many bits as the largest magnitude, or one more.
pub(super) fn magnitude(d: Point) -> u32 {
    d[0].unsigned_abs() | d[1].unsigned_abs() | d[2].unsigned_abs()
}

/// How far numbers of such a magnitude are shifted right so that they fit.
pub(super) fn shift_of(magnitude: u32) -> u32 {
    (32 - magnitude.leading_zeros()).saturating_sub(DIFFERENCE_BITS)
}

pub(super) fn shifted(d: Point, shift: u32) -> Point {
    d.map(|x| x >> shift)
}

/// The cross product of two differences that fit: below 2^30.
pub(super) fn cross(a: Point, b: Point) -> Point {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub(super) fn dot(a: Point, b: Point) -> i64 {
    let product = |k: usize| i64::from(a[k]) * i64::from(b[k]);
    product(0) + product(1) + product(2)
}

/// The normal of a triangle, of whatever length; 0 where it is narrower than a 2^14th of its length.
pub(super) fn normal(a: Point, b: Point, c: Point) -> Point {
    let (b, c) = (minus(b, a), minus(c, a));
    let shift = shift_of(magnitude(b) | magnitude(c));
    cross(shifted(b, shift), shifted(c, shift))
}

/// Whether a triangle of the one normal may become one of the other: it looks to the same side, or had no side.
pub(super) fn keeps_side(old: Point, new: Point) -> bool {
    old == [0; 3] || dot(old, new) > 0
}

/// A number that grows with `x * 2^shift`, of which it keeps 25 digits.
pub(super) fn key(x: u64, shift: u32) -> u32 {
    if x == 0 {
        return 0;
    }
    let zeros = x.leading_zeros();
    let digits = ((x << zeros) >> 38) as u32 & 0x1ff_ffff;
    ((64 - zeros + shift) << 25) | digits
}

/// The largest integer whose square is at most `x`.
pub(super) fn square_root(x: u64) -> u32 {
    let mut root = 0u32;
    for bit in (0..32).rev() {
        let next = root | (1 << bit);
        if u64::from(next) * u64::from(next) <= x {
            root = next;
        }
    }
    root
}

/// The same vector, shorter, so that each coordinate is below 2^20.
pub(super) fn shortened(sum: [i64; 3]) -> Point {
    let magnitude = sum[0].unsigned_abs() | sum[1].unsigned_abs() | sum[2].unsigned_abs();
    let shift = (64 - magnitude.leading_zeros()).saturating_sub(20);
    sum.map(|x| (x >> shift) as i32)
}

/// A number that looks random, another one for each vertex and iteration.
pub(super) fn mixed(vertex: u32, iteration: u32) -> u32 {
    let mut x = vertex ^ iteration.wrapping_mul(0x9e37_79b9);
    x = (x ^ (x >> 16)).wrapping_mul(0x85eb_ca6b);
    x = (x ^ (x >> 13)).wrapping_mul(0xc2b2_ae35);
    x ^ (x >> 16)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn roots_are_the_largest_that_fit(x: u64, root: u32) {
            for x in [x, u64::from(root) * u64::from(root)] {
                let root = u128::from(square_root(x));
                prop_assert!(root * root <= u128::from(x) && (root + 1) * (root + 1) > u128::from(x));
            }
        }

        #[test]
        fn keys_are_in_order(x in 0u64..1 << 53, y in 0u64..1 << 53, a in 0u32..19, b in 0u32..19) {
            let [p, q] = [(x, a), (y, b)].map(|(x, shift)| u128::from(x) << shift);
            prop_assert!(p > q || key(x, a) <= key(y, b));
            prop_assert!(p <= q + (q >> 24) || key(x, a) > key(y, b));
        }

        #[test]
        fn normals_are_those_of_exact_arithmetic(a: [i16; 3], b: [i16; 3], c: [i16; 3], up in 0u32..5) {
            let [a, b, c] = [a, b, c].map(|p| p.map(|x| (i32::from(x) / 4) << up));
            let n = normal(a, b, c);
            prop_assert!(magnitude(n) < 1 << 30);
            let wide = |p: Point| minus(p, a).map(i64::from);
            let (u, v) = (wide(b), wide(c));
            let exact = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
            let shift = shift_of(magnitude(minus(b, a)) | magnitude(minus(c, a)));
            // What a shift takes away is 0 here.
            if shift <= up {
                prop_assert_eq!(n.map(i64::from), exact.map(|x| x >> (2 * shift)));
            }
        }
    }

    #[test]
    fn no_sum_is_too_large() {
        let most = (1 << LATTICE_BITS) - 1;
        let corners = [[0, most, 0], [most, 0, most], [0, 0, most], [most, most, 0]];
        for (a, b) in corners.iter().flat_map(|a| corners.iter().map(move |b| (*a, *b))) {
            for c in corners {
                let n = normal(a, b, c);
                assert!(magnitude(n) < 1 << 30 && dot(n, n) < 1 << 62);
            }
        }
        assert_eq!(shortened([1 << 40, -(1 << 40), 5]), [1 << 19, -(1 << 19), 0]);
        // The cost of a vertex of 255 triangles has its key: seven bits say how long it is.
        assert!(key((255 * 3) << 44, 3 * shift_of(most as u32)) < 73 << 25);
    }
}
