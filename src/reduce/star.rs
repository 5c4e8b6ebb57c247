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
    /// The neighbours that come first and last in the triangles.
    starts: Vec<u32>,
    ends: Vec<u32>,
}

/// A position relative to another one.
pub(super) fn relative(p: [f64; 3], origin: [f64; 3]) -> DVec3 {
    DVec3::new(p[0] - origin[0], p[1] - origin[1], p[2] - origin[2])
}

/// The triangle with `v` in front; `None` where it is gone.
pub(super) fn turned(triangle: [u32; 3], v: u32) -> Option<[u32; 2]> {
    let [a, b, c] = triangle;
    // Choices of numbers and no jumps: at which corner it is cannot be foreseen.
    let next = if v == a { [b, c] } else { [c, a] };
    let next = if v == c { [a, b] } else { next };
    (v == a || v == b || v == c).then_some(next)
}

/// Whether the triangles that are left of a ring go once round their vertex, all turned alike: then each neighbour is in two of them.
pub(super) fn is_closed_fan(vertex: u32, ring: &[u32], triangles: &[[u32; 3]]) -> bool {
    let mut sides = [[0; 2]; FEW];
    let mut count = 0;
    for &triangle in ring {
        let Some(side) = turned(triangles[triangle as usize], vertex) else { continue };
        let Some(place) = sides.get_mut(count) else { return false };
        *place = side;
        count += 1;
    }
    let sides = &mut sides[..count];
    for k in 1..count {
        // The one that goes on where the last one ends, and no other does.
        let end = sides[k - 1][1];
        let mut next = (k..count).filter(|&other| sides[other][0] == end);
        let (Some(found), None) = (next.next(), next.next()) else { return false };
        sides.swap(k, found);
    }
    count > 1 && sides[count - 1][1] == sides[0][0]
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
        self.starts.clear();
        self.ends.clear();
        for &triangle in ring {
            let Some([a, b]) = turned(triangles[triangle as usize], vertex) else { continue };
            let [at_a, at_b] = [a, b].map(|v| relative(positions[v as usize], origin));
            let cross = (at_a - self.at).cross(at_b - self.at);
            self.wings.push(Wing { triangle, a, b, at_a, at_b, cross });
            self.starts.push(a);
            self.ends.push(b);
        }
        self.starts.sort_unstable();
        self.ends.sort_unstable();
        self.neighbours.clear();
        if self.starts == self.ends && self.starts.is_sorted_by(|a, b| a < b) {
            // Mostly so, and faster than to sort all of them.
            self.neighbours.extend(self.starts.iter().map(|&vertex| Neighbour { vertex, triangles: 2 }));
            return;
        }
        self.ends.extend_from_slice(&self.starts);
        self.ends.sort_unstable();
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

/// Triangles up to which a fan is looked at in a simple way, in quadratic time.
const FEW: usize = 16;

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
            let star = star(&IndexedMesh::new(positions.clone(), triangles.to_vec()), 0);
            let ring: Vec<u32> = (0..triangles.len() as u32).collect();
            let is_closed = is_closed_fan(0, &ring, triangles);
            assert!(!is_closed || star.is_manifold() && !star.is_boundary());
            star.is_manifold()
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
    fn closed_fans_are_told_from_others() {
        let of = |triangles: &[[u32; 3]]| {
            is_closed_fan(0, &(0..triangles.len() as u32).collect::<Vec<_>>(), triangles)
        };
        assert!(
            of(&[[0, 1, 2], [3, 1, 0], GONE, [2, 3, 0]]),
            "in whichever order, turned alike, one of them gone"
        );
        assert!(of(&[[0, 1, 2], [0, 2, 1]]), "two against each other");
        assert!(!of(&[[0, 1, 2], [0, 2, 3]]) && !of(&[[0, 1, 2]]) && !of(&[]), "open");
        assert!(!of(&[[0, 1, 2], [0, 2, 3], [0, 1, 3]]), "turned otherwise");
        // From 1 over 2 to 3, and from there by two ways: 4 and 1, or 2 again.
        assert!(!of(&[[0, 1, 2], [0, 2, 3], [0, 3, 2], [0, 2, 4], [0, 4, 1]]), "an eight");
        assert!(!of(&[[0, 1, 2], [0, 2, 1], [0, 3, 4], [0, 4, 3]]), "two fans");
        let wheel = |n: u32| -> Vec<_> { (0..n).map(|k| [0, k + 1, (k + 1) % n + 1]).collect() };
        assert!(of(&wheel(FEW as u32)) && !of(&wheel(FEW as u32 + 1)), "too many for the simple way");
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
