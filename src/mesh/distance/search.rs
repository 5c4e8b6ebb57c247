//! Nearest-triangle search: a hierarchy of boxes, split at the median, in one flat array.

use glam::DVec3;
use std::num::NonZeroUsize;
use std::panic::resume_unwind;
use std::thread;

use super::bounds::Bounds;
use super::point_triangle_distance_squared;

/// A search structure over triangles, of which there is at least one.
///
/// Each split halves the number of triangles, whatever their places, so the tree is at most 32 deep and is built in
/// O(n log n) time, or O(n log^2 n) where all triangles lie round one point. Repeated triangles are searched once. It takes
/// about 150 bytes a triangle.
#[derive(Clone, Debug)]
pub(super) struct TriangleSearch {
    root: Node,
    /// Children of a node are neighbours.
    nodes: Vec<Node>,
    /// Corner positions; those of a leaf are neighbours. Repetitions are here, but in no leaf.
    triangles: Vec<[DVec3; 3]>,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    bounds: Bounds,
    /// Leaf: its first triangle. Inner node: the first of its two children.
    first: u32,
    /// Leaf: its number of triangles. Inner node: 0.
    count: u32,
}

impl TriangleSearch {
    /// Sorts triangles so that neighbours in space are neighbours in the list, and returns their old places too. They may be
    /// degenerate, repeated, or all in one place. Positions lie within ten units round the origin.
    pub(super) fn new(
        positions: &[DVec3],
        triangles: &[[u32; 3]],
        threads: NonZeroUsize,
    ) -> (Self, Vec<u32>) {
        let corners = Corners { positions, triangles };
        let mut items: Vec<Item> = (0..triangles.len() as u32).map(|t| corners.item(t)).collect();
        let mut nodes = Vec::with_capacity(items.len());
        let root = corners.build(&mut items, 0, threads.get(), &mut nodes);
        let order: Vec<u32> = items.iter().map(|item| item.triangle).collect();
        let triangles = order.iter().map(|&t| corners.of(t)).collect();
        (Self { root, nodes, triangles }, order)
    }

    /// All triangles, neighbours in space near each other.
    pub(super) fn triangles(&self) -> &[[DVec3; 3]] {
        &self.triangles
    }

    /// The distance of `p` from the nearest triangle, and a triangle so near. A good guess of it makes the search fast; any
    /// other is right too.
    pub(super) fn nearest(&self, p: DVec3, guess: u32) -> (f64, u32) {
        let (mut best, mut nearest) = (self.distance_squared(p, guess), guess);
        let mut pending = [(0, 0, 0.0); MAX_DEPTH];
        pending[0] = (self.root.first, self.root.count, self.root.bounds.distance_squared(p));
        let mut len = 1;
        while len > 0 {
            len -= 1;
            let (first, count, distance) = pending[len];
            if distance >= best {
                continue;
            }
            for t in first..first + count {
                let distance = self.distance_squared(p, t);
                if distance < best {
                    (best, nearest) = (distance, t);
                }
            }
            if count > 0 {
                continue;
            }
            let [mut near, mut far] = [first, first + 1].map(|n| {
                let node = &self.nodes[n as usize];
                (node.first, node.count, node.bounds.distance_squared(p))
            });
            if far.2 < near.2 {
                std::mem::swap(&mut near, &mut far);
            }
            for child in [far, near] {
                if child.2 < best {
                    pending[len] = child;
                    len += 1;
                }
            }
        }
        (best.sqrt(), nearest)
    }

    fn distance_squared(&self, p: DVec3, triangle: u32) -> f64 {
        let [a, b, c] = self.triangles[triangle as usize];
        point_triangle_distance_squared(p, a, b, c)
    }
}

/// A triangle on its way into the tree.
struct Item {
    thrice_centroid: DVec3,
    triangle: u32,
}

/// What the tree is built over.
#[derive(Clone, Copy)]
struct Corners<'m> {
    positions: &'m [DVec3],
    triangles: &'m [[u32; 3]],
}

impl Corners<'_> {
    fn of(&self, triangle: u32) -> [DVec3; 3] {
        self.triangles[triangle as usize].map(|v| self.positions[v as usize])
    }

    fn item(&self, triangle: u32) -> Item {
        let [a, b, c] = self.of(triangle);
        Item { thrice_centroid: a + b + c, triangle }
    }

    /// The node over `items`, which begin at `start` in the whole list; what is below it is appended to `nodes`.
    fn build(self, items: &mut [Item], start: usize, threads: usize, nodes: &mut Vec<Node>) -> Node {
        let triangles = items.iter().map(|item| self.of(item.triangle));
        let bounds = if items.len() <= TURNED {
            Bounds::turned(triangles)
        } else {
            Bounds::upright(triangles.flatten())
        };
        if items.len() <= LEAF {
            return Node { bounds, first: start as u32, count: items.len() as u32 };
        }
        let none = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let centroids = items.iter().map(|item| item.thrice_centroid);
        let (min, max) = centroids.fold(none, |(min, max), p| (min.min(p), max.max(p)));
        if min == max {
            let distinct = self.distinct_first(items);
            if distinct < items.len() {
                return self.build(&mut items[..distinct], start, threads, nodes);
            }
        }
        let axis = (max - min).max_position();
        let half = items.len() / 2;
        items
            .select_nth_unstable_by(half, |s, t| s.thrice_centroid[axis].total_cmp(&t.thrice_centroid[axis]));
        let (low, high) = items.split_at_mut(half);
        let first = nodes.len();
        // Their places; they themselves come once all below them is there.
        nodes.extend([Node { bounds, first: 0, count: 0 }; 2]);
        let shared =
            if threads > 1 && half > FORK { self.share(low, high, start, threads, nodes) } else { None };
        let children = shared
            .unwrap_or_else(|| [self.build(low, start, 1, nodes), self.build(high, start + half, 1, nodes)]);
        nodes[first..first + 2].copy_from_slice(&children);
        Node { bounds, first: first as u32, count: 0 }
    }

    /// Sorts triangles so that one of each kind is in front of all repetitions, and counts the kinds.
    fn distinct_first(self, items: &mut [Item]) -> usize {
        let kind = |item: &Item| {
            let mut corners = self.of(item.triangle).map(|p| p.to_array().map(f64::to_bits));
            corners.sort_unstable();
            corners
        };
        items.sort_unstable_by_key(kind);
        let mut distinct = 1;
        for k in 1..items.len() {
            if kind(&items[k]) != kind(&items[distinct - 1]) {
                items.swap(k, distinct);
                distinct += 1;
            }
        }
        distinct
    }

    /// Builds both sides at the same time; `None`, with nothing appended, where the system gives no further thread.
    fn share(
        self,
        low: &mut [Item],
        high: &mut [Item],
        start: usize,
        threads: usize,
        nodes: &mut Vec<Node>,
    ) -> Option<[Node; 2]> {
        thread::scope(|scope| {
            let other_start = start + low.len();
            let other = move || {
                let mut apart = Vec::with_capacity(high.len());
                (self.build(high, other_start, threads / 2, &mut apart), apart)
            };
            let other = thread::Builder::new().spawn_scoped(scope, other).ok()?;
            let node = self.build(low, start, threads - threads / 2, nodes);
            let (other, apart) = other.join().unwrap_or_else(|panic| resume_unwind(panic));
            let shift = nodes.len() as u32;
            let moved = |node: Node| match node.count {
                0 => Node { first: node.first + shift, ..node },
                _ => node,
            };
            nodes.extend(apart.into_iter().map(moved));
            Some([node, moved(other)])
        })
    }
}

/// Most triangles in a leaf.
const LEAF: usize = 4;
/// Most nodes pending: one more on each of at most 32 levels, and the root.
const MAX_DEPTH: usize = 34;
/// Most triangles in a turned box: larger parts of a surface are seldom flat, and each costs a look at all of them.
const TURNED: usize = 1 << 12;
/// Fewest triangles that are worth a thread.
const FORK: usize = 1 << 14;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::indexed::IndexedMesh;
    use crate::mesh::random::SplitMix64;
    use crate::mesh::shapes;
    use proptest::prelude::*;

    fn search(mesh: &IndexedMesh, threads: usize) -> TriangleSearch {
        let positions: Vec<DVec3> = mesh.positions.iter().map(|&p| p.into()).collect();
        TriangleSearch::new(&positions, &mesh.triangles, NonZeroUsize::new(threads).unwrap()).0
    }

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
        fn it_finds_what_brute_force_finds(mesh in soup(), p in prop::array::uniform3(-6.0..6.0), guess: u32) {
            let (search, p) = (search(&mesh, 1), DVec3::from(p));
            let (distance, nearest) = search.nearest(p, guess % mesh.triangles.len() as u32);
            // A box may be rounded to be a little further off than what is in it.
            let nearest_of_all = brute_force(&mesh, p);
            prop_assert!((distance - nearest_of_all).abs() <= 1e-14 * nearest_of_all, "{} {}", distance, nearest_of_all);
            prop_assert_eq!(search.distance_squared(p, nearest).sqrt(), distance);
        }
    }

    #[test]
    fn it_agrees_with_brute_force_on_a_surface() {
        let mesh = shapes::torus(30, 40);
        let search = search(&mesh, 1);
        let mut random = SplitMix64::new(9);
        for _ in 0..200 {
            let p = DVec3::from([0; 3].map(|_| 6.0 * random.unit() - 3.0));
            assert_eq!(search.nearest(p, 0).0, brute_force(&mesh, p));
        }
    }

    #[test]
    fn many_triangles_in_one_place_make_no_deep_tree() {
        let mesh = IndexedMesh::new(vec![[1.0, 2.0, 2.0]], vec![[0, 0, 0]; 100_000]);
        let search = search(&mesh, 1);
        assert_eq!(search.nearest(DVec3::ZERO, 0).0, 3.0);
        assert!(search.nodes.len() < 100_000);
    }

    #[test]
    fn threads_build_the_same_tree() {
        let mesh = shapes::torus(250, 300);
        assert!(mesh.triangles.len() > 4 * FORK);
        let (one, four) = (search(&mesh, 1), search(&mesh, 4));
        assert_eq!(one.triangles, four.triangles);
        let flat = |search: &TriangleSearch| format!("{:?}", (search.root, &search.nodes));
        assert!(flat(&one) == flat(&four));
    }
}
