//! Powers of two by which the meshes of a scene are scaled, so that errors of the file are errors in the scene (spec §14.2).

use super::scene::Instance;
use super::transform::Matrix;

/// For each of so many meshes the smallest power of two that is at least as large as the largest scale of its instances, but for a rounding:
/// as exponents. 0 for what no node shows, or shows as a point.
pub(super) fn of_meshes(instances: &[Instance], meshes: usize) -> Vec<i32> {
    let mut scales = vec![0.0f64; meshes];
    for Instance { mesh, world, .. } in instances {
        scales[*mesh] = scales[*mesh].max(world.largest_scale());
    }
    scales.into_iter().map(of_scale).collect()
}

fn of_scale(scale: f64) -> i32 {
    if !(scale > 0.0 && scale.is_finite()) {
        return 0;
    }
    // What turns is a little more than 1 long at times.
    let scale = (scale * (1.0 - ROUNDING)).clamp(f64::from(-MOST).exp2(), f64::from(MOST).exp2());
    let exponent = (scale.to_bits() >> 52) as i32 - 1023;
    let is_power = scale.to_bits() << 12 == 0;
    (exponent + i32::from(!is_power)).clamp(-MOST, MOST)
}

/// The exponent for a mesh at `positions`, 0 where numbers of binary32 would not stay such.
pub(super) fn that_is_exact<'a>(exponent: i32, mut positions: impl Iterator<Item = &'a [f64; 3]>) -> i32 {
    let factor = f64::from(exponent).exp2();
    let is_short = |x: f64| f64::from(x as f32) == x;
    let is_kept = |x: &f64| !is_short(*x) || is_short(*x * factor);
    if positions.all(|p| p.iter().all(is_kept)) { exponent } else { 0 }
}

impl Matrix {
    /// How much longer it makes what it makes longest: its largest singular value.
    fn largest_scale(&self) -> f64 {
        let columns = [0, 1, 2].map(|k| {
            let mut axis = [0.0; 3];
            axis[k] = 1.0;
            self.direction(axis)
        });
        let most = columns.as_flattened().iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        if most == 0.0 || !most.is_finite() {
            return most;
        }
        let columns = columns.map(|column| column.map(|x| x / most));
        let dot = |a: usize, b: usize| (0..3).map(|k| columns[a][k] * columns[b][k]).sum::<f64>();
        let mut m = [0, 1, 2].map(|row| [0, 1, 2].map(|column| dot(row, column)));
        // Jacobi (1846): turned until what is beside the diagonal has vanished.
        for _ in 0..SWEEPS {
            for (p, q) in [(0, 1), (0, 2), (1, 2)] {
                if m[p][q] == 0.0 {
                    continue;
                }
                let theta = (m[q][q] - m[p][p]) / (2.0 * m[p][q]);
                let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
                let c = 1.0 / (t * t + 1.0).sqrt();
                let s = t * c;
                for row in &mut m {
                    (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
                }
                let (a, b) = (m[p], m[q]);
                for k in 0..3 {
                    (m[p][k], m[q][k]) = (c * a[k] - s * b[k], s * a[k] + c * b[k]);
                }
            }
        }
        most * m[0][0].max(m[1][1]).max(m[2][2]).max(0.0).sqrt()
    }
}

/// The largest exponent; its negative is the least.
const MOST: i32 = 60;
/// By which part scales of files are taken to be rounded.
const ROUNDING: f64 = 1.0 / 4096.0;
const SWEEPS: usize = 8;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scales() {
        let of = |rotation, scale| Matrix::of_parts([5.0, 6.0, 7.0], rotation, scale).largest_scale();
        let turned = [0.3, -0.2, 0.5, 0.7];
        for (scale, most) in
            [([1.0; 3], 1.0), ([0.5, -3.0, 2.0], 3.0), ([0.0, 0.0, 1e-20], 1e-20), ([0.0; 3], 0.0)]
        {
            for rotation in [[0.0, 0.0, 0.0, 1.0], turned] {
                let found = of(rotation, scale);
                assert!((found - most).abs() <= 1e-12 * most, "{found} for {most}");
            }
        }
        // A shear: scaled along a diagonal, by the singular values of [[1, 1], [0, 1]].
        let stretched = Matrix::of_parts([0.0; 3], turned, [1.0, 8.0, 1.0]);
        let back = Matrix::of_parts([0.0; 3], [0.3, -0.2, 0.5, -0.7], [1.0; 3]);
        assert!((stretched.after(&back).largest_scale() - 8.0).abs() < 1e-12);
    }

    #[test]
    fn exponents() {
        for (scale, exponent) in [
            (1.0, 0),
            (1.0001, 0),
            (1.01, 1),
            (2.0, 1),
            (0.5, -1),
            (0.3, -1),
            (0.01, -6),
            (1000.0, 10),
            (0.0, 0),
            (f64::INFINITY, 0),
            (1e300, 60),
            (1e-300, -60),
        ] {
            assert_eq!(of_scale(scale), exponent, "{scale}");
        }
        assert_eq!(that_is_exact(-6, [[1.0, 0.0, -3.5]].iter()), -6);
        assert_eq!(that_is_exact(-6, [[1.0, f64::from(f32::MIN_POSITIVE), 0.0]].iter()), -6);
        assert_eq!(that_is_exact(-6, [[f64::from(f32::from_bits(1)), 0.0, 0.0]].iter()), 0);
        assert_eq!(that_is_exact(3, [[f64::from(f32::MAX), 0.0, 0.0]].iter()), 0);
        assert_eq!(that_is_exact(3, [[0.1, 0.0, 0.0]].iter()), 3);
    }
}
