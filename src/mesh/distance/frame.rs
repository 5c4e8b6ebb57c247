//! The space in which two meshes are measured: both within a cube of side 2 round the origin, so that no square or fourth
//! power of a length overflows or vanishes, and nothing is lost far from the origin.

use glam::DVec3;

use crate::mesh::indexed::IndexedMesh;
use crate::mesh::lattice::bounds;

/// A shift, and scalings by powers of two, which are exact.
pub(super) struct Frame {
    /// Brings coordinates to at most 2.
    coarse: f64,
    centre: DVec3,
    /// Then the extent to 1 to 2.
    fine: f64,
}

impl Frame {
    /// Round the triangles of both meshes; `None` where one of them has none.
    pub(super) fn over(a: &IndexedMesh, b: &IndexedMesh) -> Option<Self> {
        let [a, b] = [a, b].map(|mesh| {
            let corners = mesh.triangles.iter().flatten().map(|&v| mesh.positions[v as usize]);
            bounds(corners).map(|(min, max)| [DVec3::from(min), DVec3::from(max)])
        });
        let ([a_min, a_max], [b_min, b_max]) = (a?, b?);
        let (min, max) = (a_min.min(b_min), a_max.max(b_max));
        let coarse = inverse_power(min.abs().max(max.abs()).max_element());
        let (min, max) = (min * coarse, max * coarse);
        let fine = inverse_power((max - min).max_element());
        Some(Self { coarse, centre: min + (max - min) * 0.5, fine })
    }

    pub(super) fn inside(&self, p: [f64; 3]) -> DVec3 {
        (DVec3::from(p) * self.coarse - self.centre) * self.fine
    }

    /// A length in here as it is outside.
    pub(super) fn outside(&self, length: f64) -> f64 {
        length / self.fine / self.coarse
    }
}

/// 1 over the largest power of two that is at most `x`, as far as that is a number; 1 for 0.
fn inverse_power(x: f64) -> f64 {
    if x == 0.0 {
        return 1.0;
    }
    let exponent = (x.to_bits() >> 52) as i32 - 1023;
    // 2^-1023 is a subnormal number, and exact.
    if exponent >= 1023 { f64::MIN_POSITIVE / 2.0 } else { f64::from_bits(((1023 - exponent) as u64) << 52) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn powers_of_two() {
        for (x, expected) in
            [(1.0, 1.0), (1.99, 1.0), (2.0, 0.5), (0.75, 2.0), (0.0, 1.0), (6e10, (-35f64).exp2())]
        {
            assert_eq!(inverse_power(x), expected, "{x}");
        }
        for x in [f64::MAX, 1e308, f64::MIN_POSITIVE, 1e-310, 5e-324] {
            let y = x * inverse_power(x);
            assert!(y > 0.0 && y < 2.0, "{x} becomes {y}");
        }
    }

    /// Extents from the smallest to the largest, near the origin and far from it.
    #[test]
    fn everything_comes_to_the_middle_and_lengths_come_back() {
        for (near, far) in [(0.0, 1e-300), (-1e308, 1e308), (1e9, 1e9 + 1.0), (-3.0, 4.5), (1e-310, 2e-310)] {
            let mesh = |x: f64| IndexedMesh::new(vec![[x, near, near], [x; 3]], vec![[0, 1, 1]]);
            let frame = Frame::over(&mesh(near), &mesh(far)).unwrap();
            let [p, q] = [near, far].map(|x| frame.inside([x; 3]));
            assert!(p.abs().max(q.abs()).max_element() <= 1.0, "{p} {q}");
            let length = frame.outside(q.x - p.x);
            assert!(
                (length / 2.0 - (far / 2.0 - near / 2.0)).abs() <= 1e-9 * length,
                "{near} {far}: {length}"
            );
        }
    }

    #[test]
    fn without_triangles_there_is_no_frame() {
        let (empty, mesh) = (IndexedMesh::default(), IndexedMesh::new(vec![[1.0; 3]], vec![[0; 3]]));
        assert!(Frame::over(&empty, &mesh).is_none() && Frame::over(&mesh, &empty).is_none());
        assert_eq!(Frame::over(&mesh, &mesh).unwrap().inside([1.0; 3]), DVec3::ZERO);
    }
}
