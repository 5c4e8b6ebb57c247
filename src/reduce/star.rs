//! The triangles round a vertex, gathered to look at a contraction.

use super::quadric::{Form, Weights};
use glam::DVec3;

/// A triangle's three vertices where it has been removed.
pub(super) const GONE: [u32; 3] = [u32::MAX; 3];

/// A triangle of a star: counter-clockwise the star's vertex, `a`, `b`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Wing {
    pub(super) triangle: u32,
    pub(super) a: u32,
    pub(super) b: u32,
    /// Where `a` and `b` are, relative to the origin that the star was gathered with.
    pub(super) at_a: DVec3,
    pub(super) at_b: DVec3,
    /// The cross product of the sides: twice the area along the normal.
    pub(super) cross: DVec3,
}

/// A vertex at the other end of an edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Neighbour {
    pub(super) vertex: u32,
    /// Triangles at the edge: 1 at the boundary, 2 within.
    pub(super) triangles: u32,
}

/// A vertex and what is round it; reused, so that it allocates nothing in the long run.
#[derive(Debug, Default)]
pub(super) struct Star {
    pub(super) vertex: u32,
    /// Where the vertex is, relative to the origin.
    pub(super) at: DVec3,
    pub(super) wings: Vec<Wing>,
    /// In ascending order.
    pub(super) neighbours: Vec<Neighbour>,
    ends: Vec<u32>,
}

/// A position relative to another one.
pub(super) fn relative(p: [f64; 3], origin: [f64; 3]) -> DVec3 {
    DVec3::new(p[0] - origin[0], p[1] - origin[1], p[2] - origin[2])
}

/// The triangle with `v` in front; `None` where it is gone.
pub(super) fn turned(triangle: [u32; 3], v: u32) -> Option<[u32; 2]> {
    let [a, b, c] = triangle;
    match v {
        _ if v == a => Some([b, c]),
        _ if v == b => Some([c, a]),
        _ if v == c => Some([a, b]),
        _ => None,
    }
}

impl Star {
    /// Gathers what is left of a ring.
    pub(super) fn gather(
        &mut self,
        vertex: u32,
        ring: &[u32],
        triangles: &[[u32; 3]],
        positions: &[[f64; 3]],
        origin: [f64; 3],
    ) {
        self.vertex = vertex;
        self.at = relative(positions[vertex as usize], origin);
        self.wings.clear();
        self.ends.clear();
        for &triangle in ring {
            let Some([a, b]) = turned(triangles[triangle as usize], vertex) else { continue };
            let [at_a, at_b] = [a, b].map(|v| relative(positions[v as usize], origin));
            let cross = (at_a - self.at).cross(at_b - self.at);
            self.wings.push(Wing { triangle, a, b, at_a, at_b, cross });
            self.ends.extend([a, b]);
        }
        self.ends.sort_unstable();
        self.neighbours.clear();
        let counted = self.ends.chunk_by(|a, b| a == b);
        self.neighbours
            .extend(counted.map(|equal| Neighbour { vertex: equal[0], triangles: equal.len() as u32 }));
    }

    /// Triangles at the edge to a vertex; 0 where there is none.
    pub(super) fn triangles_to(&self, vertex: u32) -> u32 {
        let found = self.neighbours.binary_search_by_key(&vertex, |n| n.vertex);
        found.map_or(0, |at| self.neighbours[at].triangles)
    }

    /// Whether the vertex is on the boundary.
    pub(super) fn is_boundary(&self) -> bool {
        self.neighbours.iter().any(|n| n.triangles == 1)
    }

    /// Whether the triangles form one fan, open or closed.
    pub(super) fn is_manifold(&self) -> bool {
        if self.neighbours.iter().any(|n| n.triangles > 2 || n.vertex == self.vertex) {
            return false;
        }
        // What hangs together over the edges from the first triangle on, once round or to both ends.
        let mut at_neighbour = vec![[u32::MAX; 2]; self.neighbours.len()];
        let slot = |v: u32| self.neighbours.partition_point(|n| n.vertex < v);
        for (k, wing) in (0..).zip(&self.wings) {
            for v in [wing.a, wing.b] {
                let places = &mut at_neighbour[slot(v)];
                places[usize::from(places[0] != u32::MAX)] = k;
            }
        }
        let mut seen = vec![false; self.wings.len()];
        let (mut stack, mut count) = (vec![0], 0);
        while let Some(k) = stack.pop() {
            let Some(wing) = self.wings.get(k as usize) else { continue };
            if !std::mem::replace(&mut seen[k as usize], true) {
                count += 1;
                stack.extend([wing.a, wing.b].into_iter().flat_map(|v| at_neighbour[slot(v)]));
            }
        }
        count == self.wings.len()
    }

    /// The squared distances to the planes of the triangles, and, if `boundary`, to those through the edges of the boundary.
    pub(super) fn form(&self, weights: Weights, boundary: bool) -> Form {
        let mut form = Form::default();
        for wing in &self.wings {
            form.add_triangle(wing.cross, weights);
        }
        if boundary && self.is_boundary() {
            for wing in &self.wings {
                for (v, at) in [(wing.a, wing.at_a), (wing.b, wing.at_b)] {
                    if self.triangles_to(v) == 1 {
                        form.add_boundary(at - self.at, wing.cross, weights);
                    }
                }
            }
        }
        form
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::IndexedMesh;
    use crate::mesh::shapes;

    fn star(mesh: &IndexedMesh, vertex: u32) -> Star {
        let mut star = Star::default();
        let ring: Vec<u32> = (0..mesh.triangles.len() as u32).collect();
        star.gather(vertex, &ring, &mesh.triangles, &mesh.positions, mesh.positions[vertex as usize]);
        star
    }

    #[test]
    fn a_star_within_and_one_on_the_boundary() {
        let mesh = shapes::disc_with_ears();
        let centre = star(&mesh, 0);
        assert_eq!((centre.wings.len(), centre.neighbours.len()), (6, 6));
        assert!(!centre.is_boundary() && centre.is_manifold());
        assert!((1..=6).all(|v| centre.triangles_to(v) == 2) && centre.triangles_to(7) == 0);
        let corner = star(&mesh, 1);
        assert_eq!((corner.wings.len(), corner.triangles_to(0), corner.is_boundary()), (4, 2, true));
        assert!(corner.is_manifold());
        assert_eq!(corner.neighbours.iter().filter(|n| n.triangles == 1).count(), 2);
    }

    #[test]
    fn what_is_no_manifold_is_seen() {
        let positions = vec![[0.0; 3]; 8];
        let of = |triangles: &[[u32; 3]]| {
            star(&IndexedMesh::new(positions.clone(), triangles.to_vec()), 0).is_manifold()
        };
        assert!(of(&[[0, 1, 2], [0, 2, 3], [3, 1, 0]]), "closed, turned as it may");
        assert!(of(&[[0, 1, 2], [2, 0, 3]]));
        assert!(!of(&[[0, 1, 2], [0, 3, 4]]), "two fans");
        assert!(!of(&[[0, 1, 2], [0, 2, 3], [0, 3, 1], [0, 4, 5], [0, 5, 6], [0, 6, 4]]), "two cones");
        assert!(!of(&[[0, 1, 2], [0, 1, 3], [0, 1, 4]]), "an edge of three");
        assert!(!of(&[[0, 0, 1]]));
        assert!(of(&[]));
    }

    #[test]
    fn the_planes_of_a_star() {
        // A half-disc in the plane z = 0 with the vertex in the middle of its straight side.
        let positions = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]];
        let mesh = IndexedMesh::new(positions, vec![[0, 1, 2], [0, 2, 3]]);
        let form = |boundary| star(&mesh, 0).form(Weights::Area, boundary);
        // Two triangles of area 1/2; two edges of length 1.
        assert_eq!(form(false).at(DVec3::new(5.0, 7.0, 2.0)), 4.0);
        assert_eq!(form(true).at(DVec3::new(5.0, 7.0, 2.0)), 4.0 + 2.0 * 49.0);
    }
}
