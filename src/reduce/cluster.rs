//! Clusters of vertices become one vertex each.

use super::star::{GONE, Star};
use super::working::Working;
use glam::DVec3;

/// An edge in one triangle, with the cross product of that triangle's sides.
pub(super) struct BoundaryEdge {
    pub(super) ends: [u32; 2],
    pub(super) cross: DVec3,
}

/// The edges in one triangle alone; leaves the rings behind.
pub(super) fn boundary_edges(working: &mut Working) -> Vec<BoundaryEdge> {
    working.rings.rebuild(working.positions.len(), &working.triangles);
    let Working { positions, triangles, rings, .. } = &*working;
    let mut star = Star::default();
    let mut edges = Vec::new();
    for v in 0..positions.len() as u32 {
        star.gather(v, rings.of(v), triangles, positions, positions[v as usize]);
        for n in star.neighbours.iter().filter(|n| n.triangles == 1 && n.vertex > v) {
            if let Some(wing) = star.wings.iter().find(|wing| wing.a == n.vertex || wing.b == n.vertex) {
                edges.push(BoundaryEdge { ends: [v, n.vertex], cross: wing.cross });
            }
        }
    }
    edges
}

/// How many triangles have their vertices in three clusters; some may be repeated.
pub(super) fn surviving(triangles: &[[u32; 3]], cluster_of: impl Fn(u32) -> u32) -> usize {
    let survives = |t: &&[u32; 3]| {
        let [a, b, c] = t.map(&cluster_of);
        a != b && b != c && c != a
    };
    triangles.iter().filter(survives).count()
}

/// Replaces the vertices by their clusters' places; triangles in fewer than three clusters go, and those that repeat an earlier one.
pub(super) fn merge(working: &mut Working, cluster_of: impl Fn(u32) -> u32, places: Vec<[f64; 3]>) {
    for triangle in &mut working.triangles {
        let [a, b, c] = triangle.map(&cluster_of);
        *triangle = if a != b && b != c && c != a { [a, b, c] } else { GONE };
    }
    working.triangles.retain(|triangle| *triangle != GONE);
    working.living = working.triangles.len();
    working.flags = vec![0; places.len()];
    working.positions = places;
    working.remove_repeated();
    working.compact();
}
