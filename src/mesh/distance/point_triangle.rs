//! The distance of a point from a triangle (Ericson, Real-Time Collision Detection, 2005, §5.1.5).

use glam::DVec3;

/// The squared distance of `p` from the nearest point of the triangle `a b c`, which may be a segment or a point.
///
/// It goes by the region of the triangle's plane that `p` falls into: a corner, an edge or the inside. Coordinates are
/// finite, with extents of 1e-70 to 1e70, since fourth powers of lengths are compared.
#[inline]
pub fn point_triangle_distance_squared(p: DVec3, a: DVec3, b: DVec3, c: DVec3) -> f64 {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (ab_ap, ac_ap) = (ab.dot(ap), ac.dot(ap));
    if ab_ap <= 0.0 && ac_ap <= 0.0 {
        return ap.length_squared();
    }
    let bp = p - b;
    let (ab_bp, ac_bp) = (ab.dot(bp), ac.dot(bp));
    if ab_bp >= 0.0 && ac_bp <= ab_bp {
        return bp.length_squared();
    }
    let cp = p - c;
    let (ab_cp, ac_cp) = (ab.dot(cp), ac.dot(cp));
    if ac_cp >= 0.0 && ab_cp <= ac_cp {
        return cp.length_squared();
    }

    // Twice the triangle's area times that of p's shadow with each edge; their sum is the square of the former.
    // Each is 0 where the triangle is a segment, and the strict tests below skip an edge of no length.
    let over_ab = ab_ap * ac_bp - ab_bp * ac_ap;
    if over_ab <= 0.0 && ab_ap > 0.0 && ab_bp < 0.0 {
        return (ap - ab * (ab_ap / (ab_ap - ab_bp))).length_squared();
    }
    let over_ca = ab_cp * ac_ap - ab_ap * ac_cp;
    if over_ca <= 0.0 && ac_ap > 0.0 && ac_cp < 0.0 {
        return (ap - ac * (ac_ap / (ac_ap - ac_cp))).length_squared();
    }
    let over_bc = ab_bp * ac_cp - ab_cp * ac_bp;
    let (from_b, from_c) = (ac_bp - ab_bp, ab_cp - ac_cp);
    if over_bc <= 0.0 && from_b > 0.0 && from_c > 0.0 {
        return (bp - (c - b) * (from_b / (from_b + from_c))).length_squared();
    }

    let area_squared = over_ab + over_bc + over_ca;
    let inside = (ap - (ab * over_ca + ac * over_ab) / area_squared).length_squared();
    if area_squared > THIN * ab.length_squared() * ac.length_squared() {
        return inside;
    }
    // So thin that the areas may be rounding errors: then an edge is as near as the inside.
    let edges = segment_distance_squared(ap, ab)
        .min(segment_distance_squared(bp, c - b))
        .min(segment_distance_squared(cp, -ac));
    if over_ab > 0.0 && over_bc > 0.0 && over_ca > 0.0 { inside.min(edges) } else { edges }
}

/// The squared distance of `p` from the nearest point of the segment `a b`, which may be a point.
#[inline]
pub fn point_segment_distance_squared(p: DVec3, a: DVec3, b: DVec3) -> f64 {
    segment_distance_squared(p - a, b - a)
}

/// The shares that the corners have in the point of the triangle `a b c`, which may be a segment or a point, that is nearest to `p`: at least
/// 0, and 1 together. Coordinates as for [`point_triangle_distance_squared`].
pub fn shares_of_nearest(p: DVec3, a: DVec3, b: DVec3, c: DVec3) -> [f64; 3] {
    let normal = (b - a).cross(c - a);
    let area_squared = normal.length_squared();
    if area_squared > THIN * (b - a).length_squared() * (c - a).length_squared() {
        let over = |x: DVec3, y: DVec3| normal.dot((x - p).cross(y - p)) / area_squared;
        let shares = [over(b, c), over(c, a), over(a, b)];
        if shares.iter().all(|&share| share >= 0.0) {
            return shares;
        }
    }
    let along = |p: DVec3, end: DVec3| {
        let length_squared = end.length_squared();
        if length_squared > 0.0 { (p.dot(end) / length_squared).clamp(0.0, 1.0) } else { 0.0 }
    };
    let [ab, bc, ca] = [along(p - a, b - a), along(p - b, c - b), along(p - c, a - c)];
    let edges = [[1.0 - ab, ab, 0.0], [0.0, 1.0 - bc, bc], [ca, 0.0, 1.0 - ca]];
    let squared = |[u, v, w]: [f64; 3]| (p - (a * u + b * v + c * w)).length_squared();
    let mut best = (f64::INFINITY, edges[0]);
    for shares in edges {
        let squared = squared(shares);
        if squared < best.0 {
            best = (squared, shares);
        }
    }
    best.1
}

/// The squared distance of `p` from the segment from the origin to `end`, which may be a point.
fn segment_distance_squared(p: DVec3, end: DVec3) -> f64 {
    let length_squared = end.length_squared();
    let t = if length_squared > 0.0 { (p.dot(end) / length_squared).clamp(0.0, 1.0) } else { 0.0 };
    (p - end * t).length_squared()
}

/// Squared sine of the angle at `a` below which a triangle is taken with care.
const THIN: f64 = 1e-8;

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const A: DVec3 = DVec3::new(0.0, 0.0, 0.0);
    const B: DVec3 = DVec3::new(4.0, 0.0, 0.0);
    const C: DVec3 = DVec3::new(0.0, 3.0, 0.0);

    /// The least distance by ternary search over the two barycentric coordinates: the squared distance is convex.
    fn by_search(p: DVec3, a: DVec3, b: DVec3, c: DVec3) -> f64 {
        let along = |f: &dyn Fn(f64) -> f64| {
            let (mut low, mut high) = (0.0, 1.0);
            for _ in 0..80 {
                let (x, y) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
                if f(x) < f(y) { high = y } else { low = x }
            }
            f(low).min(f(high))
        };
        along(&|u| along(&|v| p.distance_squared(a.lerp(b, v).lerp(c, u))))
    }

    #[test]
    fn every_region_has_its_distance() {
        for (p, expected) in [
            (DVec3::new(1.0, 1.0, 2.0), 4.0),              // inside: straight down
            (DVec3::new(-3.0, -4.0, 0.0), 25.0),           // corner a
            (DVec3::new(6.0, -1.0, 1.0), 6.0),             // corner b
            (DVec3::new(-1.0, 5.0, 2.0), 9.0),             // corner c
            (DVec3::new(2.0, -2.0, 1.0), 5.0),             // edge ab
            (DVec3::new(-1.0, 1.0, 1.0), 2.0),             // edge ac
            (DVec3::new(2.0 + 3.0, 1.5 + 4.0, 0.0), 25.0), // edge bc, from its middle along its normal (3, 4)
            (DVec3::new(2.0, 1.5, 0.0), 0.0),              // on the triangle
        ] {
            for (a, b, c) in [(A, B, C), (B, C, A), (C, A, B), (B, A, C), (A, C, B), (C, B, A)] {
                let d = point_triangle_distance_squared(p, a, b, c);
                assert!((d - expected).abs() < 1e-12, "{p} from {a} {b} {c}: {d} instead of {expected}");
            }
        }
    }

    #[test]
    fn a_segment_and_a_point_are_triangles_too() {
        let p = DVec3::new(3.0, 2.0, 0.0);
        for (a, b, c) in
            [(A, A, B), (A, B, A), (B, A, A), (A, B, B), (A, B, B * 0.3), (A, B * 0.7, B), (B * 0.9, A, B)]
        {
            assert_eq!(point_triangle_distance_squared(p, a, b, c), 4.0, "{a} {b} {c}");
        }
        assert_eq!(point_triangle_distance_squared(p, A, A, A), 13.0);
        assert_eq!(point_triangle_distance_squared(A, A, A, A), 0.0);
    }

    fn point() -> impl Strategy<Value = DVec3> {
        (-4i32..5, -4i32..5, -4i32..5).prop_map(|(x, y, z)| DVec3::new(x.into(), y.into(), z.into()) * 0.37)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(300))]

        /// Coarse coordinates, so that degenerate triangles and points in their planes are common.
        #[test]
        fn it_is_the_least_distance(p in point(), a in point(), b in point(), c in point()) {
            let (d, expected) = (point_triangle_distance_squared(p, a, b, c), by_search(p, a, b, c));
            prop_assert!((d - expected).abs() < 1e-9, "{d} instead of {expected}");
        }

        /// The point of these shares is as far off as the nearest one.
        #[test]
        fn shares_are_those_of_the_nearest_point(p in point(), a in point(), b in point(), c in point(), flat: bool) {
            let c = if flat { a.lerp(b, 0.25) } else { c };
            let shares = shares_of_nearest(p, a, b, c);
            prop_assert!(shares.iter().all(|share| (0.0..=1.0 + 1e-9).contains(share)));
            prop_assert!((shares.iter().sum::<f64>() - 1.0).abs() < 1e-9);
            let at = a * shares[0] + b * shares[1] + c * shares[2];
            let least = point_triangle_distance_squared(p, a, b, c).sqrt();
            prop_assert!((p.distance(at) - least).abs() < 1e-6 * (1.0 + least), "{} {least}", p.distance(at));
        }

        /// Slivers with all three corners nearly on one slanted line.
        #[test]
        fn slivers_are_no_worse_than_their_width(
            p in point(), s in -1.0..2.0, width in prop::sample::select(vec![0.0, 1e-16, 1e-12, 1e-9, 1e-7, 1e-5]),
        ) {
            let (a, b) = (DVec3::new(0.1, 0.2, 0.3), DVec3::new(1.3, 0.9, -0.4));
            let c = a.lerp(b, s) + DVec3::new(0.7, -1.2, 0.0) * width;
            for (a, b, c) in [(a, b, c), (b, c, a), (c, a, b)] {
                let d = point_triangle_distance_squared(p, a, b, c).sqrt();
                let expected = by_search(p, a, b, c).sqrt();
                prop_assert!((d - expected).abs() < 1e-6, "{d} instead of {expected}");
            }
        }
    }
}
