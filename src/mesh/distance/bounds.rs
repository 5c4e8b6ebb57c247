//! Boxes round triangles, turned the way these lie: a turned box round a patch or a sliver is as thin as that is, where an
//! upright one is as thick as it is long (Gottschalk, Lin, Manocha, OBBTree, 1996).

use glam::{DMat3, DVec3};

/// All points that have coordinates from `min` to `max` once they are turned.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    turn: DMat3,
    min: DVec3,
    max: DVec3,
}

impl Bounds {
    /// Along the axes of the coordinates.
    pub(super) fn upright(points: impl Iterator<Item = DVec3>) -> Self {
        Self::along(DMat3::IDENTITY, points)
    }

    /// Along the normal of the triangles, if they have much the same one whatever their orientation, and their longest edge.
    pub(super) fn turned(triangles: impl Iterator<Item = [DVec3; 3]> + Clone) -> Self {
        let (mut normal, mut area) = (DVec3::ZERO, 0.0);
        let (mut longest, mut length_squared) = (DVec3::ZERO, 0.0);
        for [a, b, c] in triangles.clone() {
            let twice = (b - a).cross(c - a);
            normal += if normal.dot(twice) < 0.0 { -twice } else { twice };
            area += twice.length();
            for edge in [b - a, c - b, a - c] {
                if edge.length_squared() > length_squared {
                    (longest, length_squared) = (edge, edge.length_squared());
                }
            }
        }
        let flat = normal.try_normalize().filter(|_| normal.length() > FLAT * area);
        let along = flat.and_then(|n| Some((n, (longest - n * n.dot(longest)).try_normalize()?)));
        let turn = along.map_or(DMat3::IDENTITY, |(n, e)| DMat3::from_cols(n, e, n.cross(e)).transpose());
        Self::along(turn, triangles.flatten())
    }

    /// At most the squared distance of `p` from whatever is inside; 0 where `p` is inside too.
    #[inline]
    pub(super) fn distance_squared(&self, p: DVec3) -> f64 {
        let p = self.turn * p;
        (self.min - p).max(p - self.max).max(DVec3::ZERO).length_squared()
    }

    fn along(turn: DMat3, points: impl Iterator<Item = DVec3>) -> Self {
        let none = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let turned = points.map(|p| turn * p);
        let (min, max) = turned.fold(none, |(min, max), p| (min.min(p), max.max(p)));
        Self { turn, min: min - ROUNDING, max: max + ROUNDING }
    }
}

/// Normals are much the same where their sum has more than this part of the area.
const FLAT: f64 = 0.5;
/// More than the rounding errors of a turn, for points at most ten units from the origin.
const ROUNDING: f64 = 1e-14;

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn point() -> impl Strategy<Value = DVec3> {
        prop::array::uniform3(-5.0..5.0).prop_map(DVec3::from)
    }

    fn triangle() -> impl Strategy<Value = [DVec3; 3]> {
        prop::array::uniform3(point())
    }

    proptest! {
        #[test]
        fn nothing_inside_is_nearer(
            triangles in prop::collection::vec(triangle(), 1..5), p in point(), u in 0.0..1.0, v in 0.0..1.0, thin: bool,
        ) {
            let flat = |p: DVec3| if thin { p.with_x(p.y * 0.3) } else { p };
            let triangles: Vec<_> = triangles.iter().map(|t| t.map(flat)).collect();
            let boxes = [Bounds::turned(triangles.iter().copied()), Bounds::upright(triangles.iter().flatten().copied())];
            for &[a, b, c] in &triangles {
                let inside = a.lerp(b, u).lerp(c, v);
                for bounds in &boxes {
                    prop_assert_eq!(bounds.distance_squared(inside), 0.0);
                    prop_assert!(bounds.distance_squared(p) <= p.distance_squared(inside));
                }
            }
        }
    }

    /// Two slivers in the plane x = y, of opposite orientation: the upright box is full of points far from them.
    #[test]
    fn a_turned_box_is_thin() {
        let (a, b) = (DVec3::ZERO, DVec3::new(3.0, 3.0, 3.0));
        let [c, d] = [DVec3::new(1.0, 1.0, 1.001), DVec3::new(2.0, 2.0, 1.999)];
        let triangles = [[a, b, c], [a, b, d]];
        let p = DVec3::new(2.5, 0.5, 1.5);
        assert_eq!(Bounds::upright(triangles.into_iter().flatten()).distance_squared(p), 0.0);
        // The plane is (2.5 - 0.5) / sqrt(2) away.
        let turned = Bounds::turned(triangles.into_iter()).distance_squared(p);
        assert!((turned - 2.0).abs() < 1e-2, "{turned}");
    }

    #[test]
    fn a_point_has_a_box_too() {
        let bounds = Bounds::turned([[DVec3::ONE; 3]].into_iter());
        assert!((bounds.distance_squared(DVec3::ZERO) - 3.0).abs() < 1e-12);
    }
}
