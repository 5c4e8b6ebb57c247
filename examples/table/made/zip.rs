//! Triangles between two closed loops, as tessellators of CAD programs lay them: long, thin, without a vertex between.

use std::f64::consts::TAU;

/// A triangle by its corners' places.
pub type Facet = [[f64; 3]; 3];

/// The triangles between loop `inner` and loop `outer`, both counter-clockwise and starlike about `centre` in the plane of x and
/// y, so that a line from the centre meets each of them once.
pub fn between(inner: &[[f64; 3]], outer: &[[f64; 3]], centre: [f64; 2]) -> Vec<Facet> {
    let start = angle(inner[0], centre);
    let turn = |p: [f64; 3]| (angle(p, centre) - start).rem_euclid(TAU);
    // The outer loop from its first vertex at or after the inner one's.
    let first = (0..outer.len()).min_by(|&a, &b| turn(outer[a]).total_cmp(&turn(outer[b]))).unwrap_or(0);
    let outer: Vec<[f64; 3]> = (0..=outer.len()).map(|k| outer[(first + k) % outer.len()]).collect();
    let inner: Vec<[f64; 3]> = (0..=inner.len()).map(|k| inner[k % inner.len()]).collect();
    let turns = |ring: &[[f64; 3]]| -> Vec<f64> {
        let last = ring.len() - 1;
        let full = |k: usize| if k == last { TAU } else { 0.0 };
        ring.iter().enumerate().map(|(k, &p)| turn(p) + full(k)).collect()
    };
    let (inner_turns, outer_turns) = (turns(&inner), turns(&outer));
    let (mut i, mut j, mut facets) = (0, 0, Vec::new());
    while i + 1 < inner.len() || j + 1 < outer.len() {
        let inner_first =
            j + 1 == outer.len() || (i + 1 < inner.len() && inner_turns[i + 1] < outer_turns[j + 1]);
        if inner_first {
            facets.push([inner[i], outer[j], inner[i + 1]]);
            i += 1;
        } else {
            facets.push([inner[i], outer[j], outer[j + 1]]);
            j += 1;
        }
    }
    facets
}

/// The triangles between two loops of as many vertices: a wall of quads, `lower` below `upper`, seen from outside.
pub fn wall(lower: &[[f64; 3]], upper: &[[f64; 3]]) -> Vec<Facet> {
    let n = lower.len();
    let quads = (0..n).map(|k| [lower[k], lower[(k + 1) % n], upper[(k + 1) % n], upper[k]]);
    quads.flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).collect()
}

/// The triangles the other way round.
pub fn turned(mut facets: Vec<Facet>) -> Vec<Facet> {
    facets.iter_mut().for_each(|facet| facet.swap(1, 2));
    facets
}

fn angle([x, y, _]: [f64; 3], centre: [f64; 2]) -> f64 {
    (y - centre[1]).atan2(x - centre[0])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn circle(n: u32, radius: f64, from: f64) -> Vec<[f64; 3]> {
        (0..n)
            .map(|k| from + TAU * f64::from(k) / f64::from(n))
            .map(|t| [radius * t.cos(), radius * t.sin(), 0.0])
            .collect()
    }

    #[test]
    fn a_ring_is_covered_once() {
        let facets = between(&circle(7, 1.0, 0.4), &circle(24, 2.0, -1.0), [0.0; 2]);
        assert_eq!(facets.len(), 31);
        let area = |[a, b, c]: &Facet| ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])) / 2.0;
        let polygon = |n: f64, r: f64| n / 2.0 * r * r * (TAU / n).sin();
        assert!(facets.iter().all(|facet| area(facet) > 0.0));
        let sum: f64 = facets.iter().map(area).sum();
        assert!((sum - (polygon(24.0, 2.0) - polygon(7.0, 1.0))).abs() < 1e-9, "{sum}");
    }
}
