//! How far one surface lies from another, by sampling, as Metro does it (Cignoni, Rocchini, Scopigno 1998).

mod point_triangle;
mod search;

pub use point_triangle::point_triangle_distance_squared;
pub use search::TriangleSearch;

use glam::DVec3;

use super::indexed::IndexedMesh;
use super::random::SplitMix64;

/// The one-sided distance of a surface from another, in the units of the positions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceDistance {
    /// Mean over the area of the first surface.
    pub mean: f64,
    /// Root mean square over the area of the first surface.
    pub rms: f64,
    /// The largest distance met, at a sample or at a vertex of the first surface.
    pub max: f64,
    /// Points measured: samples and vertices.
    pub samples: usize,
}

/// Measures how far the points of `from` lie from the nearest points of `to`.
///
/// `samples` points are spread evenly over the area of `from`: each triangle gets its share, rounded so that the
/// errors cancel, and places its points at random. They give mean and root mean square, with a standard error of about
/// 1 / sqrt(`samples`). The vertices of `from` count for the maximum alone; but where there is no sample, because
/// none was asked for or all area is 0, mean and root mean square are those of the vertices.
/// The same arguments give the same result everywhere. Positions are finite, with an extent of 1e-70 to 1e70.
///
/// `None` where one of the meshes has no triangle.
pub fn surface_distance(
    from: &IndexedMesh,
    to: &IndexedMesh,
    samples: usize,
    seed: u64,
) -> Option<SurfaceDistance> {
    if from.triangles.is_empty() || to.triangles.is_empty() {
        return None;
    }
    let mut probe = Probe::new(TriangleSearch::new(to));
    let over_area = measure_area(from, samples, seed, &mut probe);
    let over_vertices = measure_vertices(from, &mut probe);
    let average = if over_area.count > 0 { &over_area } else { &over_vertices };
    Some(SurfaceDistance {
        mean: average.sum / average.count as f64,
        rms: (average.sum_of_squares / average.count as f64).sqrt(),
        max: over_area.max.max(over_vertices.max),
        samples: over_area.count + over_vertices.count,
    })
}

/// Measures points spread over the triangles by area. The running share starts at random, so that no triangle is
/// favoured by its place in the list.
fn measure_area(from: &IndexedMesh, samples: usize, seed: u64, probe: &mut Probe) -> Tally {
    let mut tally = Tally::default();
    let total: f64 = (0..from.triangles.len()).map(|t| twice_area(corners(from, t))).sum();
    if !(total > 0.0 && total.is_finite()) {
        return tally;
    }
    let mut random = SplitMix64::new(seed);
    let mut share = random.unit();
    for t in 0..from.triangles.len() {
        let [a, b, c] = corners(from, t);
        share += twice_area([a, b, c]) / total * samples as f64;
        while share >= 1.0 {
            share -= 1.0;
            let (u, v) = (random.unit(), random.unit());
            let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
            tally.add(probe.distance(a + (b - a) * u + (c - a) * v));
        }
    }
    tally
}

/// Measures every vertex that a triangle uses, once.
fn measure_vertices(from: &IndexedMesh, probe: &mut Probe) -> Tally {
    let mut tally = Tally::default();
    let mut seen = vec![false; from.positions.len()];
    for &v in from.triangles.iter().flatten() {
        if !std::mem::replace(&mut seen[v as usize], true) {
            tally.add(probe.distance(from.positions[v as usize].into()));
        }
    }
    tally
}

fn corners(mesh: &IndexedMesh, triangle: usize) -> [DVec3; 3] {
    mesh.triangles[triangle].map(|v| mesh.positions[v as usize].into())
}

fn twice_area([a, b, c]: [DVec3; 3]) -> f64 {
    (b - a).cross(c - a).length()
}

/// Asks for the distances of one point after another. Successive points are near each other, and from one to the next
/// the distance can grow by no more than the way between them: that bounds the search.
struct Probe {
    search: TriangleSearch,
    last: Option<(DVec3, f64)>,
}

impl Probe {
    fn new(search: TriangleSearch) -> Self {
        Self { search, last: None }
    }

    fn distance(&mut self, p: DVec3) -> f64 {
        let bound = self.last.map(|(q, d)| (d + p.distance(q)) * (1.0 + ROUNDING));
        let distance = self.search.nearest_distance(p, bound.unwrap_or(f64::INFINITY));
        self.last = Some((p, distance));
        distance
    }
}

#[derive(Default)]
struct Tally {
    count: usize,
    sum: f64,
    sum_of_squares: f64,
    max: f64,
}

impl Tally {
    fn add(&mut self, distance: f64) {
        self.count += 1;
        self.sum += distance;
        self.sum_of_squares += distance * distance;
        self.max = self.max.max(distance);
    }
}

/// Covers the rounding errors in a bound that is right but for them.
const ROUNDING: f64 = 1e-9;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes;

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
        assert_eq!(d.samples, 1005);
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
        for factor in [1e-30, 1e30] {
            let d = surface_distance(&scaled(&tent, factor), &scaled(&square, factor), 500, 6).unwrap();
            assert_near(d.mean / factor, one.mean, 1e-9);
            assert_near(d.rms / factor, one.rms, 1e-9);
            assert_near(d.max / factor, one.max, 1e-9);
        }
    }

    #[test]
    fn without_triangles_there_is_no_distance_and_without_area_the_vertices_count() {
        let points = IndexedMesh::new(vec![[0.0; 3]; 3], Vec::new());
        assert_eq!(surface_distance(&points, &tent(0.0, 0.0), 10, 7), None);
        assert_eq!(surface_distance(&tent(0.0, 0.0), &points, 10, 7), None);

        let needle = IndexedMesh::new(vec![[0.0, 0.0, 1.0], [0.0, 0.0, 3.0]], vec![[0, 1, 1]]);
        let d = surface_distance(&needle, &tent(0.0, 0.0), 10, 7).unwrap();
        assert_eq!((d.mean, d.max, d.samples), (2.0, 3.0, 2));
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
