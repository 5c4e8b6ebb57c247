//! Quadric error metric (Garland and Heckbert 1997).

use glam::DVec3;

/// The symmetric 4 × 4 matrix of a sum of squared distances to planes, area-weighted: in units of length to the fourth power.
///
/// Positions are relative to the vertex that it belongs to: so binary32 is enough, whatever the distance from the origin.
#[derive(Clone, Copy, Debug, Default)]
pub struct Quadric {
    xx: f32,
    xy: f32,
    xz: f32,
    yy: f32,
    yz: f32,
    zz: f32,
    x: f32,
    y: f32,
    z: f32,
    one: f32,
}

impl Quadric {
    /// Squared distance to the plane with unit normal `n` through `point`, times `weight`.
    pub fn of_plane(n: DVec3, point: DVec3, weight: f64) -> Self {
        let d = -n.dot(point);
        let w = n * weight;
        Self {
            xx: (w.x * n.x) as f32,
            xy: (w.x * n.y) as f32,
            xz: (w.x * n.z) as f32,
            yy: (w.y * n.y) as f32,
            yz: (w.y * n.z) as f32,
            zz: (w.z * n.z) as f32,
            x: (w.x * d) as f32,
            y: (w.y * d) as f32,
            z: (w.z * d) as f32,
            one: (weight * d * d) as f32,
        }
    }

    /// The value at a point, at least 0.
    pub fn at(&self, p: DVec3) -> f64 {
        let linear = DVec3::new(self.x.into(), self.y.into(), self.z.into());
        ((self.times(p) + linear * 2.0).dot(p) + f64::from(self.one)).max(0.0)
    }

    /// The same for positions relative to the point `origin` of the present ones.
    pub fn seen_from(&self, origin: DVec3) -> Self {
        let moved = self.times(origin);
        Self {
            x: self.x + moved.x as f32,
            y: self.y + moved.y as f32,
            z: self.z + moved.z as f32,
            one: self.at(origin) as f32,
            ..*self
        }
    }

    fn times(&self, p: DVec3) -> DVec3 {
        let [xx, xy, xz] = [self.xx, self.xy, self.xz].map(f64::from);
        let [yy, yz, zz] = [self.yy, self.yz, self.zz].map(f64::from);
        DVec3::new(
            xx * p.x + xy * p.y + xz * p.z,
            xy * p.x + yy * p.y + yz * p.z,
            xz * p.x + yz * p.y + zz * p.z,
        )
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
    fn a_quadric_is_weight_times_squared_distance_wherever_it_is_seen_from() {
        let mut q = Quadric::of_plane(DVec3::Z, DVec3::ZERO, 2.0);
        q += Quadric::of_plane(DVec3::X, DVec3::ONE, 0.5);
        let expected = 2.0 * 9.0 + 0.5 * 16.0;
        assert!((q.at(DVec3::new(5.0, 7.0, 3.0)) - expected).abs() < 1e-5);
        let moved = q.seen_from(DVec3::new(3.0, -1.0, 2.0));
        assert!((moved.at(DVec3::new(2.0, 8.0, 1.0)) - expected).abs() < 1e-5);
    }
}
