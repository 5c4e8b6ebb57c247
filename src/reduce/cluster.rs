//! Clusters of vertices become one vertex each.

use super::fit::{Face, Fit, values};
use super::quadric::Weights;
use super::star::{GONE, Star, relative};
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
    if working.wedges.is_some() {
        join(working, &cluster_of, &places);
    }
    if let Some(parents) = &mut working.parents {
        parents.renumber(places.len(), &cluster_of);
    }
    for triangle in &mut working.triangles {
        let [a, b, c] = triangle.map(&cluster_of);
        *triangle = if a != b && b != c && c != a { [a, b, c] } else { GONE };
    }
    working.drop_gone();
    working.living = working.triangles.len();
    working.flags = vec![0; places.len()];
    working.positions = places;
    working.mark_repeated();
    working.compact();
}

/// Joins the wedges of each cluster that edges within it join, and gives them what fits their triangles best at the cluster's place.
fn join(working: &mut Working, cluster_of: &impl Fn(u32) -> u32, places: &[[f64; 3]]) {
    let Working { positions, triangles, wedges: Some(wedges), .. } = working else { return };
    let mut sets: Vec<u32> = (0..wedges.count() as u32).collect();
    let root = |sets: &mut Vec<u32>, mut wedge: u32| {
        while sets[wedge as usize] != wedge {
            sets[wedge as usize] = sets[sets[wedge as usize] as usize];
            wedge = sets[wedge as usize];
        }
        wedge
    };
    for (triangle, corners) in triangles.iter().zip(&wedges.corners) {
        for (i, j) in [(0, 1), (1, 2), (2, 0)] {
            if cluster_of(triangle[i]) == cluster_of(triangle[j]) {
                let [x, y] = [i, j].map(|k| root(&mut sets, corners[k]));
                sets[x.max(y) as usize] = x.min(y);
            }
        }
    }
    let origin = positions.first().copied().unwrap_or_default();
    let mut fits = vec![Fit::default(); sets.len()];
    let mut clusters = vec![u32::MAX; sets.len()];
    let mut sizes = vec![0u32; sets.len()];
    // What has no values between others is that of the nearest.
    let mut nearest: Vec<(f64, u32)> = (0..).map(|set| (f64::INFINITY, set)).take(sets.len()).collect();
    for wedge in 0..sets.len() as u32 {
        sizes[root(&mut sets, wedge) as usize] += 1;
    }
    for (triangle, &corners) in triangles.iter().zip(&wedges.corners) {
        let at = triangle.map(|v| relative(positions[v as usize], origin));
        for k in 0..3 {
            let set = root(&mut sets, corners[k]) as usize;
            if sizes[set] == 1 {
                continue;
            }
            if clusters[set] == u32::MAX {
                clusters[set] = cluster_of(triangle[k]);
                fits[set].clear(wedges.width);
            }
            let squared = at[k].distance_squared(relative(places[clusters[set] as usize], origin));
            if squared < nearest[set].0 {
                nearest[set] = (squared, corners[k]);
            }
            let others = [(k + 1) % 3, (k + 2) % 3];
            let sides = others.map(|other| at[other] - at[k]);
            let rows = [k, others[0], others[1]].map(|k| wedges.row(corners[k]));
            let face = Face { at: at[k], sides, cross: sides[0].cross(sides[1]), rows };
            fits[set].add(&face, Weights::Area);
        }
    }
    for (set, fit) in fits.iter().enumerate().filter(|(set, _)| clusters[*set] != u32::MAX) {
        let place = relative(places[clusters[set] as usize], origin);
        wedges.change([nearest[set].1, set as u32], values(&[fit], place), true);
    }
    for corners in &mut wedges.corners {
        *corners = corners.map(|wedge| root(&mut sets, wedge));
    }
}
