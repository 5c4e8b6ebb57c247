//! How far one surface lies from another, by sampling, as Metro does it (Cignoni, Rocchini, Scopigno 1998).

mod bounds;
mod frame;
mod nearest;
mod point_triangle;
mod sampling;
mod search;

pub use nearest::{Near, Nearest, NearestPoints};
pub use point_triangle::{
    point_segment_distance_squared, point_triangle_distance_squared, shares_of_nearest,
};

use super::indexed::IndexedMesh;
use frame::Frame;
use sampling::Surface;
use std::num::NonZeroUsize;

/// The one-sided distance of a surface from another, in the units of the positions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceDistance {
    /// Mean over the area of the first surface.
    pub mean: f64,
    /// Root mean square over the area of the first surface.
    pub rms: f64,
    /// The largest distance met, at a sample or at a vertex of the first surface.
    pub max: f64,
    /// Points spread over the area of the first surface; 0 where it has no area.
    pub samples: u64,
    /// Vertices of the first surface: those that its triangles use.
    pub vertices: u64,
}

/// How surfaces are sampled, and by how many threads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sampling {
    /// Points spread over a surface's area, 1,000,000 by default. Mean and root mean square have a standard error of
    /// about 1 / sqrt(`samples`).
    pub samples: u64,
    /// Where in its triangle each point falls.
    pub seed: u64,
    /// Threads, as many as the machine has cores by default. The result does not depend on them.
    pub threads: NonZeroUsize,
}

impl Default for Sampling {
    fn default() -> Self {
        let threads = std::thread::available_parallelism().unwrap_or(NonZeroUsize::MIN);
        Self { samples: 1_000_000, seed: 0, threads }
    }
}

/// Measures how far the points of `from` lie from the nearest points of `to`.
///
/// `samples` points are spread evenly over the area of `from`: each triangle gets its share, rounded so that the
/// errors cancel, and places its points at random. They give mean and root mean square. The vertices of `from` count
/// for the maximum alone; but where there is no sample, because none was asked for or all area is 0, mean and root mean
/// square are those of the vertices. The same arguments give the same result everywhere. Positions are finite; a distance
/// beyond the largest number is infinite.
///
/// `None` where one of the meshes has no triangle.
pub fn surface_distance(
    from: &IndexedMesh,
    to: &IndexedMesh,
    samples: usize,
    seed: u64,
) -> Option<SurfaceDistance> {
    let sampling = Sampling { samples: samples as u64, seed, ..Sampling::default() };
    let frame = Frame::over(from, to)?;
    let [from, to] = surfaces([from, to], &frame, sampling.threads);
    Some(from.distance(&to, &sampling, &mut |_| {}).scaled(&frame))
}

/// Measures two surfaces both ways, each as [`surface_distance`] does: `a` from `b`, then `b` from `a`. `progress` is
/// told how many points of how many have been measured.
///
/// `None` where one of the meshes has no triangle.
pub fn surface_distances(
    a: &IndexedMesh,
    b: &IndexedMesh,
    sampling: &Sampling,
    progress: &mut dyn FnMut(u64, u64),
) -> Option<[SurfaceDistance; 2]> {
    let frame = Frame::over(a, b)?;
    let [a, b] = surfaces([a, b], &frame, sampling.threads);
    let points = [&a, &b].map(|surface| surface.points(sampling));
    let total = points[0].saturating_add(points[1]);
    let there = a.distance(&b, sampling, &mut |done| progress(done, total));
    let back = b.distance(&a, sampling, &mut |done| progress(points[0].saturating_add(done), total));
    Some([there, back].map(|distance| distance.scaled(&frame)))
}

impl SurfaceDistance {
    /// Of two directions the larger mean, root mean square and maximum: the last is the Hausdorff distance, as far
    /// as the points that were measured tell.
    pub fn symmetric([a, b]: [Self; 2]) -> Self {
        Self {
            mean: a.mean.max(b.mean),
            rms: a.rms.max(b.rms),
            max: a.max.max(b.max),
            samples: a.samples.saturating_add(b.samples),
            vertices: a.vertices + b.vertices,
        }
    }

    fn scaled(self, frame: &Frame) -> Self {
        let [mean, rms, max] = [self.mean, self.rms, self.max].map(|length| frame.outside(length));
        Self { mean, rms, max, ..self }
    }
}

/// Prepares two meshes in one frame.
fn surfaces(meshes: [&IndexedMesh; 2], frame: &Frame, threads: NonZeroUsize) -> [Surface; 2] {
    meshes.map(|mesh| Surface::new(mesh, frame, threads))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes;
    use glam::DVec3;

    /// The square [-1, 1]^2 at height `h`, cut in four round a centre at height `h + peak`.
    fn tent(h: f64, peak: f64) -> IndexedMesh {
        let mut positions: Vec<[f64; 3]> =
            [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| [x, y, h]).to_vec();
        positions.push([0.0, 0.0, h + peak]);
        IndexedMesh::new(positions, (0..4).map(|i| [i, (i + 1) % 4, 4]).collect())
    }

    fn scaled(mesh: &IndexedMesh, factor: f64) -> IndexedMesh {
        let positions = mesh.positions.iter().map(|p| p.map(|x| x * factor)).collect();
        IndexedMesh::new(positions, mesh.triangles.clone())
    }

    fn assert_near(actual: f64, expected: f64, tolerance: f64) {
        assert!((actual - expected).abs() <= tolerance * expected.abs(), "{actual} instead of {expected}");
    }

    #[test]
    fn parallel_squares_are_everywhere_as_far_apart() {
        let d = surface_distance(&tent(0.25, 0.0), &tent(0.0, 0.0), 1000, 1).unwrap();
        assert_near(d.mean, 0.25, 1e-12);
        assert_near(d.rms, 0.25, 1e-12);
        assert_near(d.max, 0.25, 1e-12);
        assert_eq!((d.samples, d.vertices), (1000, 5));
    }

    /// Over the square the height of a low tent is H (1 - r) with r = max(|x|, |y|), which has density 2r: the mean
    /// is H/3, the mean square H^2 (1 - 4/3 + 1/2) = H^2/6. The tent's area is spread just as its shadow is.
    #[test]
    fn a_tent_has_the_distances_of_the_integral() {
        let height = 0.3;
        let d = surface_distance(&tent(0.0, height), &tent(0.0, 0.0), 40_000, 2).unwrap();
        assert_near(d.mean, height / 3.0, 0.01);
        assert_near(d.rms, height / 6.0_f64.sqrt(), 0.01);
        assert_near(d.max, height, 1e-12);
    }

    #[test]
    fn nested_spheres_are_apart_by_the_difference_of_their_radii() {
        let (outer, inner) = (scaled(&sphere_of_triangles(4), 1.5), sphere_of_triangles(4));
        let (out, back) = (
            surface_distance(&outer, &inner, 5000, 3).unwrap(),
            surface_distance(&inner, &outer, 5000, 3).unwrap(),
        );
        for d in [out, back] {
            assert_near(d.mean, 0.5, 0.01);
            assert_near(d.rms, 0.5, 0.01);
            assert_near(d.max, 0.5, 0.01);
            assert!(d.mean <= d.rms && d.rms <= d.max);
        }
    }

    #[test]
    fn a_surface_lies_on_itself() {
        let mesh = shapes::torus(12, 20);
        let d = surface_distance(&mesh, &mesh, 3000, 4).unwrap();
        assert!(d.max < 1e-12, "{d:?}");
    }

    /// One triangle of `from` is a speck, the other has all the area: the share of the speck must not show.
    #[test]
    fn samples_go_by_area() {
        let mut from = tent(0.0, 0.0);
        let v = from.positions.len() as u32;
        from.positions.extend([[0.0, 0.0, 9.0], [1e-4, 0.0, 9.0], [0.0, 1e-4, 9.0]]);
        from.triangles.insert(0, [v, v + 1, v + 2]);
        let d = surface_distance(&from, &tent(0.0, 0.0), 1000, 5).unwrap();
        assert!(d.mean < 0.02, "{d:?}");
        assert_near(d.max, 9.0, 1e-9);
    }

    #[test]
    fn a_scale_scales_the_distances() {
        let (tent, square) = (tent(0.0, 0.5), tent(0.0, 0.0));
        let one = surface_distance(&tent, &square, 500, 6).unwrap();
        for factor in [1e-300, 1e-70, 1e-30, 1e30, 1e70, 1e300] {
            let d = surface_distance(&scaled(&tent, factor), &scaled(&square, factor), 500, 6).unwrap();
            assert_near(d.mean / factor, one.mean, 1e-9);
            assert_near(d.rms / factor, one.rms, 1e-9);
            assert_near(d.max / factor, one.max, 1e-9);
        }
    }

    #[test]
    fn threads_and_the_order_of_the_meshes_do_not_matter() {
        let (a, b) = (shapes::torus(20, 30), scaled(&shapes::torus(12, 9), 1.1));
        let of = |a, b, threads| {
            let threads = NonZeroUsize::new(threads).unwrap();
            let (mut calls, mut last) = (0, (0, 0));
            let sampling = Sampling { samples: 5000, seed: 3, threads };
            let both = surface_distances(a, b, &sampling, &mut |done, total| {
                assert!(last.0 <= done && done <= total);
                (calls, last) = (calls + 1, (done, total));
            });
            assert!(calls > 1 && last.0 == last.1, "{last:?} after {calls}");
            both.unwrap()
        };
        let one = of(&a, &b, 1);
        assert_eq!(one, of(&a, &b, 2));
        assert_eq!(one, of(&a, &b, 9));
        let [there, back] = of(&b, &a, 1);
        assert_eq!(one, [back, there]);
        assert_eq!(Some(one[0]), surface_distance(&a, &b, 5000, 3));
        let symmetric = SurfaceDistance::symmetric(one);
        assert_eq!(symmetric.max, one[0].max.max(one[1].max));
        assert_eq!(symmetric, SurfaceDistance::symmetric([there, back]));
    }

    /// A speck of 1e-12 far from the origin, beside a mesh of 1.
    #[test]
    fn a_small_thing_beside_a_large_one() {
        let mut large = tent(0.0, 0.0);
        large.positions.extend([[1.0, 1.0, 1e-12], [1.0, 1.0 + 1e-12, 0.0], [1.0 + 1e-12, 1.0, 0.0]]);
        large.triangles.push([5, 6, 7]);
        let [there, back] =
            surface_distances(&large, &tent(0.0, 0.0), &Sampling::default(), &mut |_, _| {}).unwrap();
        assert!((0.9e-12..1.1e-12).contains(&there.max), "{there:?}");
        assert!(back.max < 1e-14, "{back:?}");
    }

    #[test]
    fn without_triangles_there_is_no_distance_and_without_area_the_vertices_count() {
        let points = IndexedMesh::new(vec![[0.0; 3]; 3], Vec::new());
        assert_eq!(surface_distance(&points, &tent(0.0, 0.0), 10, 7), None);
        assert_eq!(surface_distance(&tent(0.0, 0.0), &points, 10, 7), None);

        let needle = IndexedMesh::new(vec![[0.0, 0.0, 1.0], [0.0, 0.0, 3.0]], vec![[0, 1, 1]]);
        let d = surface_distance(&needle, &tent(0.0, 0.0), 10, 7).unwrap();
        assert_eq!((d.mean, d.max, d.samples, d.vertices), (2.0, 3.0, 0, 2));
        assert_near(d.rms, 5.0_f64.sqrt(), 1e-12);
    }

    /// Vertices on the unit sphere: octahedron, each triangle cut in four `n` times.
    fn sphere_of_triangles(n: u32) -> IndexedMesh {
        let mut triangles: Vec<[DVec3; 3]> = Vec::new();
        for (x, y, z) in [(1, 1, 1), (1, 1, -1), (1, -1, 1), (1, -1, -1)] {
            for x in [x, -x] {
                triangles.push([DVec3::X * x as f64, DVec3::Y * y as f64, DVec3::Z * z as f64]);
            }
        }
        for _ in 0..n {
            let middle = |a: DVec3, b: DVec3| (a + b).normalize();
            triangles = triangles
                .iter()
                .flat_map(|&[a, b, c]| {
                    let (x, y, z) = (middle(b, c), middle(c, a), middle(a, b));
                    [[a, z, y], [z, b, x], [y, x, c], [x, y, z]]
                })
                .collect();
        }
        let positions = triangles.iter().flatten().map(|p| p.to_array()).collect();
        IndexedMesh::new(
            positions,
            (0..triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect(),
        )
    }
}
