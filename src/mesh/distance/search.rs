//! Nearest-triangle search: a hierarchy of bounding boxes, split at the median, in one flat array.

use glam::DVec3;

use super::point_triangle_distance_squared;
use crate::mesh::indexed::IndexedMesh;

/// A search structure over the triangles of a mesh.
///
/// Each split halves the number of triangles, whatever their places, so the tree is at most 32 deep and is built in
/// O(n log n) time also where all triangles coincide. It takes about 120 bytes a triangle.
#[derive(Clone, Debug)]
pub struct TriangleSearch {
    /// In preorder: the first child of an inner node follows it.
    nodes: Vec<Node>,
    /// Corner positions; those of a leaf are neighbours.
    triangles: Vec<[DVec3; 3]>,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    min: DVec3,
    max: DVec3,
    /// Leaf: its first triangle. Inner node: its second child.
    first: u32,
    /// Leaf: its number of triangles. Inner node: 0.
    count: u32,
}

impl TriangleSearch {
    /// Sorts the triangles of `mesh`; they may be degenerate, repeated, or all in one place.
    pub fn new(mesh: &IndexedMesh) -> Self {
        let at = |v: u32| DVec3::from(mesh.positions[v as usize]);
        let triangles = mesh.triangles.iter().map(|t| t.map(at)).collect::<Vec<_>>();
        let mut search = Self { nodes: Vec::with_capacity(triangles.len() / 2 + 1), triangles };
        if !search.triangles.is_empty() {
            search.build(0, search.triangles.len());
        }
        search
    }

    /// The distance of `p` from the nearest triangle, or `bound` where none is nearer than that.
    ///
    /// A small bound makes the search fast; infinity is always right.
    pub fn nearest_distance(&self, p: DVec3, bound: f64) -> f64 {
        let Some(root) = self.nodes.first() else { return bound };
        let mut best = bound * bound;
        let mut pending = [(0, 0.0); MAX_DEPTH];
        pending[0] = (0, root.distance_squared(p));
        let mut len = 1;
        while len > 0 {
            len -= 1;
            let (at, distance) = pending[len];
            if distance >= best {
                continue;
            }
            let node = self.nodes[at as usize];
            if node.count > 0 {
                for &[a, b, c] in &self.triangles[node.first as usize..][..node.count as usize] {
                    best = best.min(point_triangle_distance_squared(p, a, b, c));
                }
                continue;
            }
            let [mut near, mut far] =
                [at + 1, node.first].map(|n| (n, self.nodes[n as usize].distance_squared(p)));
            if far.1 < near.1 {
                std::mem::swap(&mut near, &mut far);
            }
            pending[len] = far;
            pending[len + 1] = near;
            len += 2;
        }
        best.sqrt().min(bound)
    }

    /// Appends the subtree over `triangles[start..end]`, which is not empty.
    fn build(&mut self, start: usize, end: usize) {
        let node = self.nodes.len();
        let (min, max) = bounds(self.triangles[start..end].iter().flatten().copied());
        let count = end - start;
        self.nodes.push(Node { min, max, first: start as u32, count: count as u32 });
        if count <= LEAF {
            return;
        }
        let triangles = &mut self.triangles[start..end];
        let (min, max) = bounds(triangles.iter().map(thrice_centroid));
        let axis = (max - min).max_position();
        triangles.select_nth_unstable_by(count / 2, |s, t| {
            thrice_centroid(s)[axis].total_cmp(&thrice_centroid(t)[axis])
        });
        self.build(start, start + count / 2);
        (self.nodes[node].first, self.nodes[node].count) = (self.nodes.len() as u32, 0);
        self.build(start + count / 2, end);
    }
}

impl Node {
    /// The squared distance of `p` from the box; 0 inside.
    #[inline]
    fn distance_squared(&self, p: DVec3) -> f64 {
        (self.min - p).max(p - self.max).max(DVec3::ZERO).length_squared()
    }
}

fn bounds(points: impl Iterator<Item = DVec3>) -> (DVec3, DVec3) {
    points.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(min, max), p| (min.min(p), max.max(p)))
}

fn thrice_centroid(&[a, b, c]: &[DVec3; 3]) -> DVec3 {
    a + b + c
}

/// Most triangles in a leaf.
const LEAF: usize = 4;
/// Most nodes pending: one more on each of at most 32 levels, and the root.
const MAX_DEPTH: usize = 34;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::random::SplitMix64;
    use crate::mesh::shapes;
    use proptest::prelude::*;

    fn brute_force(mesh: &IndexedMesh, p: DVec3) -> f64 {
        let at = |v: u32| DVec3::from(mesh.positions[v as usize]);
        let distance = |t: &[u32; 3]| point_triangle_distance_squared(p, at(t[0]), at(t[1]), at(t[2]));
        mesh.triangles.iter().map(distance).fold(f64::INFINITY, f64::min).sqrt()
    }

    /// A soup on a coarse lattice: many repeated points and degenerate triangles.
    fn soup() -> impl Strategy<Value = IndexedMesh> {
        let position = (-3i8..4, -3i8..4, -3i8..4).prop_map(|(x, y, z)| [x, y, z].map(f64::from));
        (prop::collection::vec(position, 3..40), prop::collection::vec(any::<[u32; 3]>(), 1..80)).prop_map(
            |(positions, triangles)| {
                let n = positions.len() as u32;
                IndexedMesh::new(positions, triangles.iter().map(|t| t.map(|v| v % n)).collect())
            },
        )
    }

    proptest! {
        #[test]
        fn it_finds_what_brute_force_finds(mesh in soup(), p in prop::array::uniform3(-6.0..6.0), slack in 1.0..3.0) {
            let (search, p) = (TriangleSearch::new(&mesh), DVec3::from(p));
            let expected = brute_force(&mesh, p);
            prop_assert_eq!(search.nearest_distance(p, f64::INFINITY), expected);
            prop_assert!((search.nearest_distance(p, expected * slack) - expected).abs() <= 1e-12);
            prop_assert!((search.nearest_distance(p, expected / 2.0) - expected / 2.0).abs() <= 1e-12);
        }
    }

    #[test]
    fn it_agrees_with_brute_force_on_a_surface() {
        let mesh = shapes::torus(30, 40);
        let search = TriangleSearch::new(&mesh);
        let mut random = SplitMix64::new(9);
        for _ in 0..200 {
            let p = DVec3::from([0; 3].map(|_| 6.0 * random.unit() - 3.0));
            assert_eq!(search.nearest_distance(p, f64::INFINITY), brute_force(&mesh, p));
        }
    }

    #[test]
    fn many_triangles_in_one_place_make_no_deep_tree() {
        let mesh = IndexedMesh::new(vec![[1.0, 2.0, 2.0]], vec![[0, 0, 0]; 100_000]);
        let search = TriangleSearch::new(&mesh);
        assert_eq!(search.nearest_distance(DVec3::ZERO, f64::INFINITY), 3.0);
        assert!(search.nodes.len() < 100_000);
    }

    #[test]
    fn no_triangle_is_nearer_than_any_bound() {
        let search = TriangleSearch::new(&IndexedMesh::default());
        assert_eq!(search.nearest_distance(DVec3::ZERO, 5.0), 5.0);
        assert_eq!(search.nearest_distance(DVec3::ZERO, f64::INFINITY), f64::INFINITY);
    }
}
