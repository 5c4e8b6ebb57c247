//! The star of a vertex as a polygon to be triangulated anew.

use super::polygon::{FEW_ROW, FEW_SIDES, MAX_SIDES, ROW, Solved, four};
use crate::mesh::Vertex;
use crate::refine::labels::Parting;
use glam::{DVec3, Vec3, Vec4};

/// The link of a vertex, counter-clockwise, seen from the vertex and measured in mean edges: so binary32 is enough.
#[derive(Clone, Debug)]
pub struct Star {
    sides: usize,
    ring: [Vertex; MAX_SIDES],
    points: [Vec3; MAX_SIDES],
    /// Unit normals of the triangles.
    normals: [Vec3; MAX_SIDES],
    /// Whether the vertex lies on the boundary: then the edge from the last link vertex to the first is to be made.
    pub boundary: bool,
    /// The places i < j of the link vertices that the vertex lies between on a curve, if it does: then the edge between these is to be
    /// made, and none across.
    pub curve: Option<(usize, usize)>,
    /// How it is parted where the vertex goes onto one of its link, if it does: then the edges from there to the borders are to be made.
    pub slide: Option<Parting>,
    /// Mean length of the edges at the vertex, above 0.
    pub mean_edge: f64,
    /// Area of the star, in squared mean edges.
    pub area: f32,
}

impl Star {
    /// The star of a vertex at `centre`; `None` with fewer than 2 or more than [`MAX_SIDES`] link vertices.
    #[inline]
    pub fn new(
        link: impl Iterator<Item = Vertex>,
        boundary: bool,
        centre: DVec3,
        at: impl Fn(Vertex) -> DVec3,
    ) -> Option<Self> {
        let mut ring = [Vertex::NONE; MAX_SIDES];
        let mut far = [DVec3::ZERO; MAX_SIDES];
        let (mut sides, mut length) = (0, 0.0);
        for w in link {
            if sides == MAX_SIDES {
                return None;
            }
            ring[sides] = w;
            far[sides] = at(w) - centre;
            length += far[sides].length();
            sides += 1;
        }
        if sides < 2 {
            return None;
        }
        let mean_edge = if length > 0.0 { length / sides as f64 } else { 1.0 };
        let scale = 1.0 / mean_edge;
        let mut points = [Vec3::ZERO; MAX_SIDES];
        for (point, far) in points.iter_mut().zip(&far).take(sides) {
            *point = (*far * scale).as_vec3();
        }
        let mut normals = [Vec3::ZERO; MAX_SIDES];
        let mut area = 0.0;
        for i in 0..sides - usize::from(boundary) {
            let cross = points[i].cross(points[if i + 1 < sides { i + 1 } else { 0 }]);
            let length = cross.length();
            area += 0.5 * length;
            normals[i] = if length > 0.0 { cross / length } else { Vec3::ZERO };
        }
        Some(Self { sides, ring, points, normals, boundary, curve: None, slide: None, mean_edge, area })
    }

    /// The link, counter-clockwise.
    #[inline]
    pub fn ring(&self) -> &[Vertex] {
        &self.ring[..self.sides]
    }

    /// A link vertex's position less the vertex's, in mean edges.
    #[inline]
    pub fn point(&self, i: usize) -> Vec3 {
        self.points[i]
    }

    /// How the star is parted where `edge`, two places on the link, is left of it, or a face.
    pub fn parting(&self, edge: Option<(usize, usize)>) -> Parting {
        let triangles = self.normals().len();
        match (self.slide, edge) {
            (Some(parting), _) => parting,
            (None, Some((a, b))) if !self.boundary => Parting::onto(triangles, false, a, 1 << a | 1 << b),
            _ => Parting::none(triangles, self.boundary),
        }
    }

    /// Whether a diagonal i < j would lead from one side of the vertex's curve, or from one part, to another.
    #[inline]
    pub fn is_across(&self, i: usize, j: usize) -> bool {
        if let Some(parting) = &self.slide {
            return parting.crosses(i, j);
        }
        self.curve.is_some_and(|(a, b)| {
            let between = |k: usize| a < k && k < b;
            let beyond = |k: usize| k < a || b < k;
            between(i) && beyond(j) || beyond(i) && between(j)
        })
    }

    /// Whether an edge beside the curve leads to the left, seen from outside and along the curve, either way.
    pub fn turns_left(&self, i: usize, j: usize) -> bool {
        let Some((a, b)) = self.curve.filter(|&curve| curve != (i, j)) else { return false };
        let (along, way) = (self.points[b] - self.points[a], self.points[j] - self.points[i]);
        let up: Vec3 = self.normals().iter().sum();
        way.dot(along) * along.cross(way).dot(up) > 0.0
    }

    /// Something seen from the vertex in the unit of the mesh.
    #[inline]
    pub fn outside(&self, p: Vec3) -> DVec3 {
        p.as_dvec3() * self.mean_edge
    }

    /// Unit normals of the triangles.
    #[inline]
    pub fn normals(&self) -> &[Vec3] {
        &self.normals[..self.sides - usize::from(self.boundary)]
    }

    /// The best triangulation: the least sum of what its triangles distort and of what shape costs, `price` a mean edge; `edge(i, j)` is
    /// what making an edge costs, infinite where it must not be made. All costs are in the fourth power of the mean edge length.
    ///
    /// A triangle distorts by its area times the squared distance of the vertex from its plane, as a quadric tells it, and by its squared
    /// area times 1 - cosine of the angle to the nearest of the normals of the old star there: so it does not cut off a crease, nor turn
    /// over. The shape of a triangle is its circumradius: so it is round where nothing else is at
    /// stake. Beyond some mean edges that of a sliver tells no more than that it is one, and weighs no more.
    #[inline]
    pub fn solve(&self, price: f32, edge: impl Fn(usize, usize) -> f32) -> Solved {
        if self.sides <= FEW_SIDES {
            self.solve_within::<FEW_SIDES, FEW_ROW>(price, edge)
        } else {
            self.solve_within::<MAX_SIDES, ROW>(price, edge)
        }
    }

    #[inline]
    fn solve_within<const MOST: usize, const ROW: usize>(
        &self,
        price: f32,
        edge: impl Fn(usize, usize) -> f32,
    ) -> Solved {
        let sides = self.sides.min(MOST);
        let (mut x, mut y, mut z) = ([0.0; ROW], [0.0; ROW], [0.0; ROW]);
        for (i, p) in self.points[..sides].iter().enumerate() {
            (x[i], y[i], z[i]) = (p.x, p.y, p.z);
        }
        let mut lengths = [[0.0; ROW]; MOST];
        for (row, p) in lengths.iter_mut().zip(&self.points[..sides]) {
            let mut j = 0;
            while j < sides {
                let [u, v, w] = [four(&x, j) - p.x, four(&y, j) - p.y, four(&z, j) - p.z];
                row[j..j + 4].copy_from_slice(&(u * u + v * v + w * w).sqrt().to_array());
                j += 4;
            }
        }
        let normals = self.normals();
        let triangles = |i: usize, j: usize, k: usize| {
            let (a, c) = (self.points[i], self.points[j]);
            let ac = c - a;
            let [u, v, w] = [four(&x, k) - a.x, four(&y, k) - a.y, four(&z, k) - a.z];
            // The normals of the triangles (a, b, c), b each of the four.
            let (nx, ny, nz) = (v * ac.z - w * ac.y, w * ac.x - u * ac.z, u * ac.y - v * ac.x);
            let twice_area = (nx * nx + ny * ny + nz * nz).sqrt();
            let along = |n: Vec3| nx * n.x + ny * n.y + nz * n.z;
            // Beside the old triangles from i to j, the one behind the closing side where the triangle lies on it.
            let closing = if j + 1 == sides { normals.len() - 1 } else { i };
            let nearest = normals[i..j]
                .iter()
                .fold(along(normals[closing]), |most, n| most.max(along(*n)))
                .max(-twice_area);
            let radius = four(&lengths[i], k) * four(&lengths[j], k) * (0.5 * lengths[i][j]);
            let radius = radius.min(twice_area * SLIVER);
            let off = along(a);
            let turn = twice_area * twice_area * (twice_area - nearest);
            let scaled = radius * price + off * off * 0.5 + turn * 0.25;
            let cost = (scaled / twice_area).min(WORST);
            Vec4::select(twice_area.cmpgt(Vec4::ZERO), cost, WORST)
        };
        Solved::new::<MOST, ROW>(sides, self.boundary, edge, triangles)
    }

    /// What some triangles of the polygon distort: the part of [`Star::solve`]'s cost that is not shape.
    pub fn distortion(&self, triangles: impl Iterator<Item = [usize; 3]>) -> f32 {
        let normals = &self.normals[..self.sides - usize::from(self.boundary)];
        let of_triangle = |[i, k, j]: [usize; 3]| {
            let (a, b, c) = (self.points[i], self.points[k], self.points[j]);
            let normal = (b - a).cross(c - a);
            let twice_area = normal.length();
            if twice_area <= 0.0 {
                return 0.0;
            }
            let closing = if j + 1 == self.sides { normals.len() - 1 } else { i };
            let nearest =
                normals[i..j].iter().fold(normal.dot(normals[closing]), |most, n| most.max(normal.dot(*n)));
            let off = normal.dot(a);
            0.5 * off * off / twice_area + 0.25 * twice_area * (twice_area - nearest).max(0.0)
        };
        triangles.map(of_triangle).sum()
    }

    /// The point nearest to the vertex on some triangles of the polygon, or on its only edge.
    pub fn foot(&self, triangles: impl Iterator<Item = [usize; 3]>) -> Vec3 {
        let (mut foot, mut least) = (Vec3::ZERO, f32::INFINITY);
        for t in triangles {
            let point = nearest_to_origin(t.map(|i| self.points[i]));
            if point.length_squared() < least {
                (foot, least) = (point, point.length_squared());
            }
        }
        foot
    }
}

/// The point of a triangle nearest to the origin (Ericson, Real-Time Collision Detection, 2005, §5.1.5).
fn nearest_to_origin([a, b, c]: [Vec3; 3]) -> Vec3 {
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

/// Most of a circumradius that counts, in mean edges.
const SLIVER: f32 = 4.0;
/// Most that a triangle costs.
const WORST: Vec4 = Vec4::splat(1e3);

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
        let best = roof.solve(0.01, |_, _| 0.0).shape.triangulation().unwrap();
        assert!(best.diagonals().any(|d| d == (0, 3)), "{best:?}");
        assert!(roof.foot(best.triangles.iter()).length() < 1e-6);
    }

    /// A vertex on a long edge of a prism, close to others across it: the new edge runs along the prism's where shape is cheap.
    #[test]
    fn where_shape_is_cheap_a_long_crease_stays() {
        let edge = star(
            &[[3.0, 0.0, 0.0], [0.3, 0.5, -0.1], [-0.3, 0.5, -0.1], [-3.0, 0.0, 0.0], [0.0, -0.5, -0.1]],
            false,
        );
        let diagonal = |price: f32| {
            let best = edge.solve(price, |_, _| 0.0).shape.triangulation().unwrap();
            (best.diagonals().any(|d| d == (0, 3)), edge.distortion(best.triangles.iter()))
        };
        assert!(!diagonal(1.0).0);
        assert!(diagonal(1e-4).0 && diagonal(1e-4).1 < 1e-6, "{:?}", diagonal(1e-4));
    }

    /// A flat star with a deep bay: no triangle of the best triangulation covers the bay, however thin the others are.
    #[test]
    fn nothing_turns_over_in_a_plane() {
        let bay = [[2.0, -0.1, 0.0], [2.0, 2.0, 0.0], [0.05, 0.06, 0.0], [-2.0, 2.0, 0.0], [-2.0, -0.1, 0.0]];
        let best = star(&bay, false).solve(0.01, |_, _| 0.0).shape.triangulation().unwrap();
        for [i, k, j] in best.triangles.iter() {
            let [a, b, c] = [i, k, j].map(|i| DVec3::from_array(bay[i]));
            assert!((b - a).cross(c - a).z > 0.0, "{i} {k} {j}");
        }
    }

    #[test]
    fn the_foot_is_the_nearest_point() {
        let above = star(&[[2.0, 0.0, -3.0], [-1.0, 2.0, -3.0], [-1.0, -2.0, -3.0]], false);
        assert!(
            (above.outside(above.foot([[0, 1, 2]].into_iter())) - DVec3::new(0.0, 0.0, -3.0)).length() < 1e-6
        );
        let beside = star(&[[1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [2.0, 0.0, 0.0]], false);
        assert!((beside.outside(beside.foot([[0, 1, 2]].into_iter())) - DVec3::X).length() < 1e-6);
        let ear = star(&[[1.0, 1.0, 0.0], [1.0, -1.0, 0.0]], true);
        assert!((ear.outside(ear.foot([[0, 0, 1]].into_iter())) - DVec3::X).length() < 1e-6);
    }

    #[test]
    fn areas_and_edges_are_those_of_the_star() {
        let square = star(&[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]], false);
        assert!((square.area - 2.0).abs() < 1e-6 && (square.mean_edge - 1.0).abs() < 1e-12);
        assert!(Star::new([Vertex(0)].into_iter(), true, DVec3::ZERO, |_| DVec3::X).is_none());
        assert!(Star::new((0..17).map(Vertex), false, DVec3::ZERO, |_| DVec3::X).is_none());
    }
}
