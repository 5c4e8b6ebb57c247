//! The nearest point of a surface, with the triangle that it is on and where in it: for values to be taken over from one mesh to another.

use std::num::NonZeroUsize;

use super::frame::Frame;
use super::search::TriangleSearch;
use super::shares_of_nearest;
use crate::mesh::indexed::IndexedMesh;

/// A point of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nearest {
    /// How far off it is, in the units of the positions.
    pub distance: f64,
    /// The number of a triangle that it is on.
    pub triangle: u32,
    /// What the triangle's corners weigh there (barycentric coordinates): none below 0, 1 in all.
    pub shares: [f64; 3],
}

/// Finds the nearest points of a surface, in about logarithmic time each. Takes about 170 bytes a triangle.
pub struct NearestPoints {
    frame: Frame,
    search: TriangleSearch,
    /// For each triangle of the search its number.
    numbers: Vec<u32>,
    /// Where the last point was found.
    last: Near,
}

/// Where a point was found: the next one is likely to be near. Whoever asks for many points on several threads has one each.
#[derive(Clone, Copy, Debug, Default)]
pub struct Near(u32);

impl NearestPoints {
    /// Prepares a mesh to be asked for points near the triangles of `around`, which may be the mesh itself. Positions are finite, and those
    /// that the triangles name exist. `None` where one of them has no triangle.
    pub fn new(mesh: &IndexedMesh, around: &IndexedMesh, threads: NonZeroUsize) -> Option<Self> {
        let frame = Frame::over(mesh, around)?;
        let positions: Vec<_> = mesh.positions.iter().map(|&p| frame.inside(p)).collect();
        let (search, numbers) = TriangleSearch::new(&positions, &mesh.triangles, threads);
        Some(Self { frame, search, numbers, last: Near::default() })
    }

    /// The nearest point; of several equally near ones any. Fast where points asked for one after the other are near each other.
    pub fn nearest(&mut self, p: [f64; 3]) -> Nearest {
        let mut near = self.last;
        let found = self.nearest_from(p, &mut near);
        self.last = near;
        found
    }

    /// The nearest point, of several equally near ones any, but the same for the same `near`, which is told where it was found.
    pub fn nearest_from(&self, p: [f64; 3], near: &mut Near) -> Nearest {
        let p = self.frame.inside(p);
        let (distance, place) = self.search.nearest(p, near.0);
        *near = Near(place);
        let [a, b, c] = self.search.triangles()[place as usize];
        let shares = shares_of_nearest(p, a, b, c);
        Nearest {
            distance: self.frame.outside(distance),
            triangle: self.numbers[place as usize],
            shares: shares.map(|share| share.clamp(0.0, 1.0)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::distance::point_triangle_distance_squared;
    use crate::mesh::random::SplitMix64;
    use crate::mesh::shapes;
    use glam::DVec3;

    /// Against all triangles one by one, for points on, near and far from the surface; the shares give the point itself.
    #[test]
    fn it_is_the_nearest_and_its_shares_are_where_it_is() {
        let mut mesh = shapes::torus(9, 7);
        mesh.triangles.push([0, 0, 1]);
        mesh.positions.iter_mut().flatten().for_each(|x| *x = *x * 30.0 + 1000.0);
        let mut search = NearestPoints::new(&mesh, &mesh, NonZeroUsize::MIN).unwrap();
        let corners = |t: usize| mesh.triangles[t].map(|v| DVec3::from(mesh.positions[v as usize]));
        let mut random = SplitMix64::new(5);
        for k in 0..200 {
            let p = match k % 2 {
                0 => mesh.positions[k % mesh.positions.len()],
                _ => [0; 3].map(|_| 950.0 + 100.0 * random.unit()),
            };
            let found = search.nearest(p);
            let p = DVec3::from(p);
            let to = |t: usize| {
                let [a, b, c] = corners(t);
                point_triangle_distance_squared(p, a, b, c).sqrt()
            };
            let least = (0..mesh.triangles.len()).map(to).fold(f64::INFINITY, f64::min);
            assert!((found.distance - least).abs() < 1e-9, "{found:?}, {least}");
            assert!((to(found.triangle as usize) - least).abs() < 1e-9);
            let [a, b, c] = corners(found.triangle as usize);
            let at = a * found.shares[0] + b * found.shares[1] + c * found.shares[2];
            assert!((at.distance(p) - least).abs() < 1e-6, "{found:?}");
        }
    }

    #[test]
    fn without_triangles_there_is_none() {
        let mesh = shapes::sphere(1);
        for (mesh, around) in [(&mesh, &IndexedMesh::default()), (&IndexedMesh::default(), &mesh)] {
            assert!(NearestPoints::new(mesh, around, NonZeroUsize::MIN).is_none());
        }
    }
}
