//! The largest principal curvature of each vertex, by which the vertices that stay are picked: k1 = H + sqrt(H^2 - K), the mean
//! curvature H by cotangents and the Gaussian curvature K by the defect of angles (Meyer and others 2003), both over a third of the area
//! round the vertex. In binary64 with + - * / and square roots in a fixed order, so that every machine picks the same.

use super::integer::Point;
use crate::reduce::rings::Rings;
use crate::reduce::star::turned;
use glam::DVec3;

/// The curvature of a vertex, 0 or more, finite; 0 where its triangles have no area. `wings` is empty memory.
pub(super) fn curvature(
    v: u32,
    points: &[Point],
    triangles: &[[u32; 3]],
    rings: &Rings,
    wings: &mut Vec<[u32; 2]>,
) -> f64 {
    wings.clear();
    wings.extend(rings.of(v).iter().filter_map(|&t| turned(triangles[t as usize], v)));
    // Sums of the same numbers in another order may differ.
    wings.sort_unstable();
    let at = |w: u32| {
        let [p, o] = [points[w as usize], points[v as usize]];
        DVec3::new(f64::from(p[0] - o[0]), f64::from(p[1] - o[1]), f64::from(p[2] - o[2]))
    };
    let (mut mean, mut area, mut angles) = (DVec3::ZERO, 0.0, 0.0);
    for &[a, b] in &*wings {
        let (a, b) = (at(a), at(b));
        let double = a.cross(b).length();
        if double == 0.0 {
            continue;
        }
        // The cotangent of an angle: the dot product of its sides over the cross product.
        mean += b * ((a.dot(a) - a.dot(b)) / double) + a * ((b.dot(b) - a.dot(b)) / double);
        area += double;
        angles += angle(a.dot(b), double);
    }
    // Twice the area of the triangles; a third of the area is the vertex's.
    let own = area / 6.0;
    if own == 0.0 {
        return 0.0;
    }
    let h = mean.length() / (4.0 * own);
    let k = (TURN - angles) / own;
    h + (h * h - k).max(0.0).sqrt()
}

/// The angle, 0 to half a turn, whose cosine and sine are as these to each other; the sine is above 0.
fn angle(cosine: f64, sine: f64) -> f64 {
    // Halved four times it is at most an eighth of a right angle, for which few terms do: tan(x/2) = sin x / (1 + cos x).
    let length = (cosine * cosine + sine * sine).sqrt();
    let mut tangent = if cosine > 0.0 { sine / (length + cosine) } else { (length - cosine) / sine };
    for _ in 0..3 {
        tangent /= 1.0 + (1.0 + tangent * tangent).sqrt();
    }
    let square = tangent * tangent;
    let mut series = 0.0;
    for odd in (0..12).rev() {
        series = 1.0 / f64::from(2 * odd + 1) - square * series;
    }
    16.0 * tangent * series
}

const TURN: f64 = 2.0 * std::f64::consts::PI;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes;

    #[test]
    fn angles() {
        for k in 1..180 {
            let exact = f64::from(k).to_radians();
            assert!((angle(7.0 * exact.cos(), 7.0 * exact.sin()) - exact).abs() < 1e-14, "{k} degrees");
        }
    }

    #[test]
    fn a_ball_of_radius_r_has_the_curvature_1_over_r() {
        let mesh = shapes::sphere(4);
        let radius = 10_000.0;
        let points: Vec<Point> = mesh
            .positions
            .iter()
            .map(|p| {
                let length = p.iter().map(|x| x * x).sum::<f64>().sqrt();
                p.map(|x| (x / length * radius).round() as i32)
            })
            .collect();
        let mut rings = Rings::default();
        rings.rebuild(points.len(), &mesh.triangles);
        for v in 0..points.len() as u32 {
            let k = curvature(v, &points, &mesh.triangles, &rings, &mut Vec::new()) * radius;
            assert!((0.7..2.0).contains(&k), "{k}");
        }
    }

    #[test]
    fn the_order_of_triangles_does_not_matter() {
        let mesh = shapes::bumpy_sphere(2, 5);
        let points: Vec<Point> = mesh.positions.iter().map(|p| p.map(|x| (x * 1e5) as i32)).collect();
        let mut other: Vec<[u32; 3]> = mesh.triangles.iter().map(|&[a, b, c]| [b, c, a]).collect();
        other.reverse();
        let of = |triangles: &[[u32; 3]]| -> Vec<u64> {
            let mut rings = Rings::default();
            rings.rebuild(points.len(), triangles);
            let k = |v| curvature(v, &points, triangles, &rings, &mut Vec::new()).to_bits();
            (0..points.len() as u32).map(k).collect()
        };
        assert_eq!(of(&mesh.triangles), of(&other));
    }
}
