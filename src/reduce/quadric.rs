//! Quadric error metric (Garland and Heckbert 1997), binary64, as sums of squared distances to planes.
//!
//! The planes of the triangles round a vertex all go through it: relative to it their sum has neither a linear nor a constant part. A
//! [`Form`] is such a sum, six numbers; a [`Quadric`] is one of any planes.

use glam::DVec3;
use std::ops::AddAssign;

/// How much each plane counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Weights {
    /// A triangle's by its area; one through an edge of the boundary by the square of its length.
    #[default]
    Area,
    /// All alike.
    Unit,
}

/// A sum of squared distances to planes through one point: the symmetric 3 × 3 matrix of it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Form {
    xx: f64,
    xy: f64,
    xz: f64,
    yy: f64,
    yz: f64,
    zz: f64,
}

impl Form {
    /// Adds the squared distance to the plane that is perpendicular to `normal`, times `weight`; `normal` need not have length 1.
    fn add(&mut self, normal: DVec3, weight: f64) {
        let w = normal * weight;
        self.xx += w.x * normal.x;
        self.xy += w.x * normal.y;
        self.xz += w.x * normal.z;
        self.yy += w.y * normal.y;
        self.yz += w.y * normal.z;
        self.zz += w.z * normal.z;
    }

    /// Adds the plane of a triangle whose sides have this cross product. One without an area has no plane.
    pub(super) fn add_triangle(&mut self, cross: DVec3, weights: Weights) {
        let square = cross.length_squared();
        if square > 0.0 {
            // The area is half the length of the cross product, and so is the weight that makes of it a normal with this area.
            self.add(cross, if weights == Weights::Area { 0.5 / square.sqrt() } else { square.recip() });
        }
    }

    /// Adds the plane through an edge of the boundary that is perpendicular to its triangle.
    pub(super) fn add_boundary(&mut self, edge: DVec3, cross: DVec3, weights: Weights) {
        let normal = edge.cross(cross);
        let square = match weights {
            Weights::Area => cross.length_squared(),
            Weights::Unit => normal.length_squared(),
        };
        if square > 0.0 {
            self.add(normal, square.recip());
        }
    }

    /// So many times as much.
    pub(super) fn scaled(mut self, factor: f64) -> Self {
        for x in [&mut self.xx, &mut self.xy, &mut self.xz, &mut self.yy, &mut self.yz, &mut self.zz] {
            *x *= factor;
        }
        self
    }

    /// The value at a place relative to the point.
    pub(super) fn at(&self, d: DVec3) -> f64 {
        self.times(d).dot(d)
    }

    /// The matrix times a vector: half of the gradient.
    pub(super) fn times(&self, d: DVec3) -> DVec3 {
        DVec3::new(
            self.xx * d.x + self.xy * d.y + self.xz * d.z,
            self.xy * d.x + self.yy * d.y + self.yz * d.z,
            self.xz * d.x + self.yz * d.y + self.zz * d.z,
        )
    }

    /// The solution of matrix times x = `right`; `None` where there is no inverse.
    pub(super) fn solve(&self, right: DVec3, singular: f64) -> Option<DVec3> {
        Some(self.inverse(singular)?.times(right))
    }

    /// The inverse of the matrix; `None` where that is next to singular, as where all planes go along one line.
    fn inverse(&self, singular: f64) -> Option<Self> {
        let cofactors = DVec3::new(
            self.yy * self.zz - self.yz * self.yz,
            self.xz * self.yz - self.xy * self.zz,
            self.xy * self.yz - self.xz * self.yy,
        );
        let det = self.xx * cofactors.x + self.xy * cofactors.y + self.xz * cofactors.z;
        let third = (self.xx + self.yy + self.zz) / 3.0;
        // What is no number is singular, too.
        if det.is_nan() || det.abs() <= singular * third * third * third {
            return None;
        }
        let inverse = Self {
            xx: cofactors.x,
            xy: cofactors.y,
            xz: cofactors.z,
            yy: self.xx * self.zz - self.xz * self.xz,
            yz: self.xy * self.xz - self.xx * self.yz,
            zz: self.xx * self.yy - self.xy * self.xy,
        };
        Some(inverse.scaled(det.recip()))
    }
}

impl AddAssign for Form {
    fn add_assign(&mut self, other: Self) {
        self.xx += other.xx;
        self.xy += other.xy;
        self.xz += other.xz;
        self.yy += other.yy;
        self.yz += other.yz;
        self.zz += other.zz;
    }
}

/// A sum of squared distances to any planes.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Quadric {
    form: Form,
    linear: DVec3,
    constant: f64,
}

impl Quadric {
    /// The planes of a form through `point`.
    pub(super) fn through(form: Form, point: DVec3) -> Self {
        let moved = form.times(point);
        Self { form, linear: -moved, constant: moved.dot(point) }
    }

    /// Adds `weight` times the square of a linear function: `slope` along the coordinates, and its value at the origin.
    pub(super) fn add_square(&mut self, slope: DVec3, value: f64, weight: f64) {
        self.form.add(slope, weight);
        self.linear += slope * (value * weight);
        self.constant += value * value * weight;
    }

    /// The value at a point, at least 0.
    pub(super) fn at(&self, p: DVec3) -> f64 {
        ((self.form.times(p) + self.linear * 2.0).dot(p) + self.constant).max(0.0)
    }

    /// Where the value is least among the points whose product with `slope` is `level`, or among all where no slope is to be told.
    pub(super) fn optimum_where(&self, slope: DVec3, level: f64, singular: f64) -> Option<DVec3> {
        let inverse = self.form.inverse(singular)?;
        let (least, way) = (-inverse.times(self.linear), inverse.times(slope));
        let rise = way.dot(slope);
        Some(if rise > 0.0 { least + way * ((level - slope.dot(least)) / rise) } else { least })
    }

    /// Where the value is least, relative to `origin`, near which the numbers are best; `None` where that is no one point.
    pub(super) fn optimum(&self, origin: DVec3, singular: f64) -> Option<DVec3> {
        self.form.solve(-(self.linear + self.form.times(origin)), singular)
    }
}

impl AddAssign for Quadric {
    fn add_assign(&mut self, other: Self) {
        self.form += other.form;
        self.linear += other.linear;
        self.constant += other.constant;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Squared distance from p to the plane through q with this normal, by its definition.
    fn squared(p: DVec3, q: DVec3, normal: DVec3) -> f64 {
        ((p - q).dot(normal) / normal.length()).powi(2)
    }

    #[test]
    fn forms_are_sums_of_weighted_squared_distances() {
        let crosses = [DVec3::new(1.0, 2.0, -0.5), DVec3::new(0.0, -3.0, 1.0), DVec3::new(4.0, 0.1, 0.2)];
        let (edge, d) = (DVec3::new(0.3, 0.0, 2.0), DVec3::new(0.7, -1.1, 0.4));
        for weights in [Weights::Area, Weights::Unit] {
            let mut form = Form::default();
            let mut sum = 0.0;
            for cross in crosses {
                form.add_triangle(cross, weights);
                let weight = if weights == Weights::Area { cross.length() / 2.0 } else { 1.0 };
                sum += weight * squared(d, DVec3::ZERO, cross);
            }
            // The edge is in the plane of its triangle.
            let cross = edge.cross(DVec3::X);
            form.add_boundary(edge, cross, weights);
            let weight = if weights == Weights::Area { edge.length_squared() } else { 1.0 };
            sum += weight * squared(d, DVec3::ZERO, edge.cross(cross));
            form.add_triangle(DVec3::ZERO, weights);
            form.add_boundary(DVec3::ZERO, cross, weights);
            assert!((form.at(d) - sum).abs() < 1e-12 * sum);
            let point = DVec3::new(-2.0, 5.0, 1.0);
            assert!((Quadric::through(form, point).at(point + d) - sum).abs() < 1e-10 * sum);
        }
    }

    #[test]
    fn the_optimum_on_a_plane() {
        // 1 x² + 2 y² + 3 z² round (1, 1, 1), where x + y = 1: x - 1 = -2/3 and y - 1 = -1/3.
        let mut sum = Quadric::default();
        for (axis, weight) in [(DVec3::X, 1.0), (DVec3::Y, 2.0), (DVec3::Z, 3.0)] {
            sum.add_square(axis, -1.0, weight);
        }
        let least = |slope: DVec3| sum.optimum_where(slope, slope.x, 1e-6).unwrap();
        assert!((least(DVec3::new(1.0, 1.0, 0.0)) - DVec3::new(1.0 / 3.0, 2.0 / 3.0, 1.0)).length() < 1e-12);
        assert!((least(DVec3::ZERO) - DVec3::ONE).length() < 1e-12);
        assert!((least(DVec3::splat(1e-200)) - DVec3::ONE).length() < 1e-12, "its square is 0");
    }

    #[test]
    fn the_optimum_is_where_three_planes_meet() {
        let corner = DVec3::new(3.0, -1.0, 2.0);
        let mut sum = Quadric::default();
        for (normal, beside) in [
            (DVec3::X, DVec3::Y),
            (DVec3::Y, DVec3::Z),
            (DVec3::new(1.0, 1.0, 1.0), DVec3::new(1.0, -1.0, 0.0)),
        ] {
            let mut form = Form::default();
            form.add_triangle(normal, Weights::Area);
            sum += Quadric::through(form, corner + beside);
            let origin = DVec3::new(2.5, 0.0, 2.0);
            let optimum = sum.optimum(origin, 1e-6).map(|p| p + origin);
            match normal.x * normal.y {
                1.0 => assert!((optimum.unwrap() - corner).length() < 1e-12, "{optimum:?}"),
                _ => assert_eq!(optimum, None),
            }
        }
        assert!(sum.at(corner) < 1e-12 && sum.at(corner + DVec3::X) > 0.1);
        let mut not_a_number = Form::default();
        not_a_number.add(DVec3::splat(f64::NAN), 1.0);
        assert_eq!(not_a_number.solve(DVec3::X, 1e-6), None);
    }
}
