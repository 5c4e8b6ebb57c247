//! The star of a vertex as a polygon to be triangulated anew.

use super::polygon::{MAX_SIDES, Programme};
use crate::mesh::Vertex;
use glam::DVec3;

/// The link of a vertex, counter-clockwise, seen from the vertex.
#[derive(Clone, Debug)]
pub struct Star {
    sides: usize,
    ring: [Vertex; MAX_SIDES],
    points: [DVec3; MAX_SIDES],
    normals: [DVec3; MAX_SIDES],
    /// Whether the vertex lies on the boundary: then the edge from the last link vertex to the first is to be made.
    pub boundary: bool,
    /// Mean length of the edges at the vertex, above 0.
    pub mean_edge: f64,
    /// Area of the star.
    pub area: f64,
}

impl Star {
    /// The star of a vertex at `centre`; `None` with fewer than 2 or more than [`MAX_SIDES`] link vertices.
    pub fn new(
        link: impl Iterator<Item = Vertex>,
        boundary: bool,
        centre: DVec3,
        at: impl Fn(Vertex) -> DVec3,
    ) -> Option<Self> {
        let mut star = Self {
            sides: 0,
            ring: [Vertex::NONE; MAX_SIDES],
            points: [DVec3::ZERO; MAX_SIDES],
            normals: [DVec3::ZERO; MAX_SIDES],
            boundary,
            mean_edge: 0.0,
            area: 0.0,
        };
        for w in link {
            *star.ring.get_mut(star.sides)? = w;
            let point = at(w) - centre;
            star.points[star.sides] = point;
            star.mean_edge += point.length();
            star.sides += 1;
        }
        if star.sides < 2 {
            return None;
        }
        star.mean_edge = if star.mean_edge > 0.0 { star.mean_edge / star.sides as f64 } else { 1.0 };
        for i in 0..star.triangles() {
            let next = if i + 1 < star.sides { i + 1 } else { 0 };
            let cross = star.points[i].cross(star.points[next]);
            let length = cross.length();
            star.area += 0.5 * length;
            star.normals[i] = if length > 0.0 { cross / length } else { DVec3::ZERO };
        }
        Some(star)
    }

    /// The link, counter-clockwise.
    pub fn ring(&self) -> &[Vertex] {
        &self.ring[..self.sides]
    }

    /// A link vertex's position less the vertex's.
    pub fn point(&self, i: usize) -> DVec3 {
        self.points[i]
    }

    fn triangles(&self) -> usize {
        self.sides - usize::from(self.boundary)
    }

    /// The best triangulation; `edge(i, j)` is what making an edge costs, in mean edges, infinite where it must not be made.
    ///
    /// A triangle costs its circumradius, 8 times the vertex's distance from its plane, and 4 mean edges times 1 - cosine of the angle
    /// to the nearest of the normals of the old star there: so it is round, near, and does not cut off a crease.
    pub fn solve(&self, edge: impl Fn(usize, usize) -> f64) -> Programme {
        let mut lengths = [[0.0; MAX_SIDES]; MAX_SIDES];
        for (i, row) in lengths.iter_mut().enumerate().take(self.sides) {
            for (length, point) in row.iter_mut().zip(&self.points[..self.sides]).skip(i + 1) {
                *length = self.points[i].distance(*point);
            }
        }
        let normals = &self.normals[..self.triangles()];
        let worst = WORST * self.mean_edge;
        let triangle = |[i, k, j]: [usize; 3], bound: f64| {
            let (a, b, c) = (self.points[i], self.points[k], self.points[j]);
            let cross = (b - a).cross(c - a);
            let twice_area = cross.length();
            if twice_area <= 0.0 {
                return worst;
            }
            let scale = 1.0 / twice_area;
            let radius = lengths[i][k] * lengths[k][j] * lengths[i][j] * 0.5 * scale;
            let distance = a.dot(cross).abs() * scale;
            let round_and_near = radius + DISTANCE * distance;
            if round_and_near >= bound {
                return worst.max(bound);
            }
            // Beside the old triangles from i to j, the one behind the closing side where the triangle lies on it.
            let closing = if j + 1 == self.sides { &normals[normals.len() - 1..] } else { &[] };
            let normals = normals[i..j].iter().chain(closing);
            let cosine = normals.map(|old| cross.dot(*old)).fold(-twice_area, f64::max) * scale;
            let turn = self.mean_edge * (1.0 - cosine);
            (round_and_near + TURN * turn).min(worst)
        };
        Programme::solve(self.sides, self.boundary, |i, j| edge(i, j) * self.mean_edge, triangle)
    }

    /// The point nearest to the vertex on some triangles of the polygon, or on its only edge.
    pub fn foot(&self, triangles: impl Iterator<Item = [usize; 3]>) -> DVec3 {
        let feet = triangles.map(|t| nearest_to_origin(t.map(|i| self.points[i])));
        feet.min_by(|a, b| a.length_squared().total_cmp(&b.length_squared())).unwrap_or(DVec3::ZERO)
    }
}

/// The point of a triangle nearest to the origin (Ericson, Real-Time Collision Detection, 2005, §5.1.5).
fn nearest_to_origin([a, b, c]: [DVec3; 3]) -> DVec3 {
    let (ab, ac) = (b - a, c - a);
    let (ab_a, ac_a) = (-ab.dot(a), -ac.dot(a));
    if ab_a <= 0.0 && ac_a <= 0.0 {
        return a;
    }
    let (ab_b, ac_b) = (-ab.dot(b), -ac.dot(b));
    if ab_b >= 0.0 && ac_b <= ab_b {
        return b;
    }
    let (ab_c, ac_c) = (-ab.dot(c), -ac.dot(c));
    if ac_c >= 0.0 && ab_c <= ac_c {
        return c;
    }
    let over_ab = ab_a * ac_b - ab_b * ac_a;
    if over_ab <= 0.0 && ab_a > 0.0 && ab_b < 0.0 {
        return a + ab * (ab_a / (ab_a - ab_b));
    }
    let over_ca = ab_c * ac_a - ab_a * ac_c;
    if over_ca <= 0.0 && ac_a > 0.0 && ac_c < 0.0 {
        return a + ac * (ac_a / (ac_a - ac_c));
    }
    let over_bc = ab_b * ac_c - ab_c * ac_b;
    let (from_b, from_c) = (ac_b - ab_b, ab_c - ac_c);
    if over_bc <= 0.0 && from_b > 0.0 && from_c > 0.0 {
        return b + (c - b) * (from_b / (from_b + from_c));
    }
    let sum = over_ab + over_bc + over_ca;
    if sum > 0.0 { a + ab * (over_ca / sum) + ac * (over_ab / sum) } else { a }
}

/// Weight of the vertex's distance from a triangle's plane.
const DISTANCE: f64 = 8.0;
/// Weight of a triangle's turn, in mean edges.
const TURN: f64 = 4.0;
/// Most that a triangle costs, in mean edges.
const WORST: f64 = 1e3;

#[cfg(test)]
mod tests {
    use super::*;

    fn star(points: &[[f64; 3]], boundary: bool) -> Star {
        let link = (0..points.len() as u32).map(Vertex);
        Star::new(link, boundary, DVec3::ZERO, |v| DVec3::from_array(points[v.index()])).unwrap()
    }

    /// A vertex on the ridge of a roof along x: the new edge runs along the ridge, and the vertex lies on it.
    #[test]
    fn a_crease_stays() {
        let roof = star(
            &[
                [1.0, 0.0, 0.0],
                [0.5, 1.0, -1.0],
                [-0.5, 1.0, -1.0],
                [-1.0, 0.0, 0.0],
                [-0.5, -1.0, -1.0],
                [0.5, -1.0, -1.0],
            ],
            false,
        );
        let best = roof.solve(|_, _| 0.0).triangulation().unwrap();
        assert!(best.diagonals().any(|d| d == (0, 3)), "{best:?}");
        assert!(roof.foot(best.triangles.iter().copied()).length() < 1e-12);
    }

    #[test]
    fn the_foot_is_the_nearest_point() {
        let above = star(&[[2.0, 0.0, -3.0], [-1.0, 2.0, -3.0], [-1.0, -2.0, -3.0]], false);
        assert!((above.foot([[0, 1, 2]].into_iter()) - DVec3::new(0.0, 0.0, -3.0)).length() < 1e-12);
        let beside = star(&[[1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [2.0, 0.0, 0.0]], false);
        assert!((beside.foot([[0, 1, 2]].into_iter()) - DVec3::X).length() < 1e-12);
        let ear = star(&[[1.0, 1.0, 0.0], [1.0, -1.0, 0.0]], true);
        assert!((ear.foot([[0, 0, 1]].into_iter()) - DVec3::X).length() < 1e-12);
    }

    #[test]
    fn areas_and_edges_are_those_of_the_star() {
        let square = star(&[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]], false);
        assert!((square.area - 2.0).abs() < 1e-12 && (square.mean_edge - 1.0).abs() < 1e-12);
        assert!(Star::new([Vertex(0)].into_iter(), true, DVec3::ZERO, |_| DVec3::X).is_none());
        assert!(Star::new((0..17).map(Vertex), false, DVec3::ZERO, |_| DVec3::X).is_none());
    }
}
