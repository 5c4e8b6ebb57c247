//! Quadric error metric (Garland and Heckbert 1997).

use glam::DVec3;

/// The symmetric 4 × 4 matrix of a sum of squared distances to planes, area-weighted: in units of length to the fourth power.
#[derive(Clone, Copy, Debug, Default)]
pub struct Quadric {
    xx: f64,
    xy: f64,
    xz: f64,
    yy: f64,
    yz: f64,
    zz: f64,
    x: f64,
    y: f64,
    z: f64,
    one: f64,
}

impl Quadric {
    /// Squared distance to the plane of a triangle, times its area; zero for a collinear triangle.
    pub fn of_triangle(a: DVec3, b: DVec3, c: DVec3) -> Self {
        let normal = (b - a).cross(c - a);
        let length = normal.length();
        if length <= 0.0 {
            return Self::default();
        }
        Self::of_plane(normal / length, a, length * 0.5)
    }

    /// Squared distance to the plane through `point`, times `weight`.
    pub fn of_plane(n: DVec3, point: DVec3, weight: f64) -> Self {
        let d = -n.dot(point);
        let w = n * weight;
        Self {
            xx: w.x * n.x,
            xy: w.x * n.y,
            xz: w.x * n.z,
            yy: w.y * n.y,
            yz: w.y * n.z,
            zz: w.z * n.z,
            x: w.x * d,
            y: w.y * d,
            z: w.z * d,
            one: weight * d * d,
        }
    }

    /// The value at a point, at least 0.
    pub fn at(&self, p: DVec3) -> f64 {
        let quadratic = p.x * (self.xx * p.x + 2.0 * (self.xy * p.y + self.xz * p.z + self.x))
            + p.y * (self.yy * p.y + 2.0 * (self.yz * p.z + self.y))
            + p.z * (self.zz * p.z + 2.0 * self.z);
        (quadratic + self.one).max(0.0)
    }
}

impl std::ops::AddAssign for Quadric {
    fn add_assign(&mut self, other: Self) {
        self.xx += other.xx;
        self.xy += other.xy;
        self.xz += other.xz;
        self.yy += other.yy;
        self.yz += other.yz;
        self.zz += other.zz;
        self.x += other.x;
        self.y += other.y;
        self.z += other.z;
        self.one += other.one;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quadric_is_area_times_squared_distance() {
        let mut q = Quadric::of_triangle(DVec3::ZERO, DVec3::new(2.0, 0.0, 0.0), DVec3::new(0.0, 2.0, 0.0));
        assert!((q.at(DVec3::new(5.0, 7.0, 3.0)) - 2.0 * 9.0).abs() < 1e-12);
        q += Quadric::of_plane(DVec3::X, DVec3::ONE, 0.5);
        assert!((q.at(DVec3::new(5.0, 7.0, 3.0)) - (18.0 + 0.5 * 16.0)).abs() < 1e-12);
    }
}
