//! A star seen along its mean normal: how far the edges that take its place are from it.
//!
//! Seen so, the old triangles of a star and the new ones cover the same polygon. Between the two, straight along the normal, the distance
//! is largest where an edge of one crosses an edge of the other, or at the vertex. So a new edge is as far off as where it crosses the
//! spokes, the edges at the vertex.

use super::polygon::MAX_SIDES;
use super::star::Star;
use crate::mesh::Vertex;
use glam::Vec3;

/// A star as seen along its mean normal.
#[derive(Debug)]
pub struct Shadow<'a> {
    star: &'a Star,
    normal: Vec3,
    /// Of the link vertices, over the vertex, in mean edges.
    heights: [f32; MAX_SIDES],
    /// Between the lowest and the highest of them and the vertex: no two triangulations are farther apart. Infinite where the star is
    /// folded, as seen along the normal.
    thickness: f32,
}

impl<'a> Shadow<'a> {
    /// The shadow of a star.
    pub fn new(star: &'a Star) -> Self {
        let normals = star.normals();
        let normal = normals.iter().sum::<Vec3>().normalize_or_zero();
        let mut heights = [0.0; MAX_SIDES];
        let (mut low, mut high) = (0.0f32, 0.0f32);
        for (i, height) in heights.iter_mut().enumerate().take(star.ring().len()) {
            *height = star.point(i).dot(normal);
            (low, high) = (low.min(*height), high.max(*height));
        }
        let folded = normals.iter().any(|n| n.dot(normal) <= 0.0);
        Self { star, normal, heights, thickness: if folded { f32::INFINITY } else { high - low } }
    }

    /// A bound of the squared distance of a new edge from the input, in the unit of the mesh; `known` are bounds for the triangles of the
    /// star.
    pub fn bound(&self, a: Vertex, b: Vertex, known: &[f32]) -> f32 {
        let place = |v| self.star.ring().iter().position(|&w| w == v);
        let crossing = place(a).zip(place(b)).and_then(|(i, j)| self.cross(i, j, known));
        let all = || (known.iter().copied().fold(0.0, f32::max), self.thickness);
        let (known, apart) = crossing.unwrap_or_else(all);
        let bound = f64::from(known).sqrt() + f64::from(apart) * self.star.mean_edge;
        (bound * bound) as f32
    }

    /// The largest of what is known of the triangles that an edge between two link vertices crosses, and how far it is from their spokes;
    /// `None` where it leaves the star.
    fn cross(&self, i: usize, j: usize, known: &[f32]) -> Option<(f32, f32)> {
        let turn = |a: Vec3, b: Vec3| self.normal.dot(a.cross(b));
        // Counter-clockwise, with the vertex on the left.
        let whole = turn(self.star.point(i), self.star.point(j));
        let (i, j, whole) = if whole > 0.0 { (i, j, whole) } else { (j, i, -whole) };
        if whole == 0.0 || self.thickness.is_infinite() || self.star.boundary && i > j {
            return None;
        }
        let (p, q) = (self.star.point(i), self.star.point(j));
        let (mut k, mut most, mut apart) = (i, 0.0f32, 0.0f32);
        loop {
            most = most.max(known[k]);
            k = if k + 1 < self.star.ring().len() { k + 1 } else { 0 };
            if k == j {
                return Some((most, apart));
            }
            let spoke = self.star.point(k);
            let denominator = turn(spoke, q - p);
            // At which parts of the spoke and of the edge they cross.
            let (s, u) = (whole / denominator, turn(p, spoke) / denominator);
            if !((0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&u)) {
                return None;
            }
            let over = self.heights[i] + u * (self.heights[j] - self.heights[i]);
            apart = apart.max((s * self.heights[k] - over).abs());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    fn star(points: &[[f64; 3]], boundary: bool) -> Star {
        let link = (0..points.len() as u32).map(Vertex);
        Star::new(link, boundary, DVec3::ZERO, |v| DVec3::from_array(points[v.index()])).unwrap()
    }

    fn bound(star: &Star, i: u32, j: u32, known: &[f32]) -> f32 {
        Shadow::new(star).bound(Vertex(i), Vertex(j), known).sqrt()
    }

    /// A pyramid of height 1 over a regular hexagon.
    fn pyramid() -> Star {
        let corner = |k: u32| {
            let turn = std::f64::consts::TAU * f64::from(k) / 6.0;
            [2.0 * turn.cos(), 2.0 * turn.sin(), -1.0]
        };
        star(&(0..6).map(corner).collect::<Vec<_>>(), false)
    }

    /// An edge that cuts a corner off crosses the spoke there halfway down; one through the middle is below the tip.
    #[test]
    fn an_edge_is_as_far_off_as_where_it_crosses() {
        let pyramid = pyramid();
        for (i, j) in [(0, 2), (2, 0), (5, 1), (1, 5)] {
            let found = bound(&pyramid, i, j, &[0.0; 6]);
            assert!((found - 0.5).abs() < 1e-5, "{i} to {j}: {found}");
        }
        assert!((bound(&pyramid, 1, 4, &[0.0; 6]) - 1.0).abs() < 1e-5);
        assert!(bound(&pyramid, 1, 2, &[0.0; 6]) < 1e-6);
    }

    /// What is known of the two triangles there counts, and nothing else; of all where an edge does not lead across.
    #[test]
    fn it_adds_to_what_is_known_there() {
        let pyramid = pyramid();
        let known = [0.04, 0.01, 9.0, 9.0, 9.0, 9.0];
        assert!((bound(&pyramid, 0, 2, &known) - 0.7).abs() < 1e-5);
        assert!((bound(&pyramid, 5, 1, &known) - 3.5).abs() < 1e-5);
        assert!((bound(&pyramid, 0, 9, &known) - 4.0).abs() < 1e-5);
    }

    /// At a reflex corner the edge beyond it leaves the star, and so it does beside a vertex of the boundary; a folded star tells nothing.
    #[test]
    fn nothing_is_said_of_what_leaves_the_star() {
        let mut points =
            [[2.0, 0.0, -1.0], [0.2, 0.2, -1.0], [0.0, 2.0, -1.0], [-2.0, 0.0, -1.0], [0.0, -2.0, 2.0]];
        let reflex = star(&points, false);
        let thickness = bound(&reflex, 0, 2, &[0.0; 5]);
        assert!(thickness > 1.5, "{thickness}");
        assert!((bound(&reflex, 1, 9, &[0.0; 5]) - thickness).abs() < 1e-6);
        let half = star(&[[2.0, 0.0, -1.0], [1.0, 2.0, -1.0], [-1.0, 2.0, -1.0], [-2.0, -0.5, -1.0]], true);
        assert!((bound(&half, 0, 2, &[0.0; 3]) - bound(&half, 2, 0, &[0.0; 3])).abs() < 1e-6);
        // At a reflex vertex of the boundary the edge that closes the star runs outside of it.
        let open = star(&[[2.0, 0.0, -1.0], [1.0, 2.0, -1.0], [-2.0, 1.0, -1.0], [-1.0, -2.0, -1.0]], true);
        let known = [0.01, 0.04, 0.01];
        for (i, j) in [(0, 3), (3, 0)] {
            let all = 0.2 + bound(&open, 0, 9, &[0.0; 3]);
            assert!((bound(&open, i, j, &known) - all).abs() < 1e-5);
        }
        points[1] = [0.3, -0.3, 3.0];
        assert!(bound(&star(&points, false), 0, 2, &[0.0; 5]).is_infinite());
    }
}
