//! Parts as CAD programs tessellate them: flat faces without inner vertices, walls of long quads, holes that are to stay round.

use super::assemble;
use super::zip::{Facet, between, turned, wall};
use std::f64::consts::TAU;
use unweld::mesh::IndexedMesh;

/// A coupling: a flange with bolt holes round a hub with a bore, the edge between them rounded.
pub fn coupling() -> IndexedMesh {
    let centre = [0.0; 2];
    let ring = |radius: f64, z: f64| arc(radius, 0.0, TAU, HOLES * SEGMENTS, z);
    let mut facets = Vec::new();
    // From the bore's lower edge outwards, up and back: all that turns round the axis.
    let walls = [([BORE, 1.0], [BORE, 0.0]), ([RIM, 0.0], [RIM, THICK]), ([HUB, THICK + ROUND], [HUB, 1.0])];
    for ([radius, from], [_, to]) in walls {
        for k in 0..ROWS {
            let [lower, upper] = [k, k + 1].map(|k| from + (to - from) * f64::from(k) / f64::from(ROWS));
            facets.extend(wall(&ring(radius, lower), &ring(radius, upper)));
        }
    }
    let fillet = |k: u32| {
        let t = TAU / 4.0 * f64::from(k) / f64::from(ROWS);
        ring(HUB + ROUND * (1.0 - t.sin()), THICK + ROUND * (1.0 - t.cos()))
    };
    facets.extend((0..ROWS).flat_map(|k| wall(&fillet(k), &fillet(k + 1))));
    facets.extend(between(&ring(BORE, 1.0), &ring(HUB, 1.0), centre));
    // The two faces of the flange, a sector a hole, and the holes' walls.
    for hole in 0..HOLES {
        let turn = TAU * f64::from(hole) / f64::from(HOLES);
        let middle = [BOLTS * turn.cos(), BOLTS * turn.sin()];
        let circle = |z: f64| -> Vec<[f64; 3]> {
            let around = arc(HOLE, turn, turn + TAU, SEGMENTS, z);
            around.iter().map(|p| [middle[0] + p[0], middle[1] + p[1], z]).collect()
        };
        facets.extend(turned(wall(&circle(0.0), &circle(THICK))));
        let upper = sector(hole, &fillet(0), &ring(RIM, THICK));
        facets.extend(between(&circle(THICK), &upper, middle));
        let lower = sector(hole, &ring(BORE, 0.0), &ring(RIM, 0.0));
        facets.extend(turned(between(&circle(0.0), &lower, middle)));
    }
    assemble(&facets)
}

/// The outline of a hole's part of the flange, counter-clockwise, from the rings that it lies between.
fn sector(hole: u32, inner: &[[f64; 3]], outer: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let n = inner.len();
    let first = (hole * SEGMENTS) as usize + n - SEGMENTS as usize / 2;
    let part = |ring: &[[f64; 3]]| -> Vec<[f64; 3]> {
        (first..=first + SEGMENTS as usize).map(|k| ring[k % n]).collect()
    };
    part(outer).into_iter().chain(part(inner).into_iter().rev()).collect()
}

/// A turbine's blade: rows of a profile along the span, twisted and tapered, flat at both ends.
pub fn blade(rows: u32, half: u32) -> IndexedMesh {
    let section = |row: u32| -> Vec<[f64; 3]> {
        let s = f64::from(row) / f64::from(rows);
        let (sin, cos) = (0.9 * s).sin_cos();
        let chord = 1.0 - 0.45 * s;
        let profile = (0..2 * half).map(|k| profile(k, half));
        profile
            .map(|[x, y]| [chord * (cos * x - sin * y) + 0.1 * s * s, chord * (sin * x + cos * y), 3.0 * s])
            .collect()
    };
    let sections: Vec<_> = (0..=rows).map(section).collect();
    let mut facets: Vec<Facet> = sections.windows(2).flat_map(|pair| wall(&pair[0], &pair[1])).collect();
    facets.extend(ladder(&sections[rows as usize]));
    facets.extend(turned(ladder(&sections[0])));
    assemble(&facets)
}

/// A point of a four-digit NACA profile (Jacobs, Ward and Pinkerton 1933), counter-clockwise from its trailing edge; chord 1.
fn profile(k: u32, half: u32) -> [f64; 2] {
    let t = TAU / 2.0 * f64::from(k) / f64::from(half);
    let x = (1.0 + t.cos()) / 2.0;
    let root = x.sqrt();
    let thickness =
        0.6 * (0.2969 * root - 0.126 * x - 0.3516 * x * x + 0.2843 * x.powi(3) - 0.1036 * x.powi(4));
    let camber = 0.25 * x * (1.0 - x);
    [x - 0.5, if k <= half { camber + thickness } else { camber - thickness }]
}

/// A flat loop cut into rungs between its two sides, which meet at its first and its middle vertex.
fn ladder(ring: &[[f64; 3]]) -> Vec<Facet> {
    let (n, half) = (ring.len(), ring.len() / 2);
    let mut facets = Vec::new();
    for k in 0..half {
        let [a, b, c, d] = [k, k + 1, n - k - 1, (n - k) % n].map(|k| ring[k]);
        if k + 1 < half {
            facets.push([a, b, c]);
        } else {
            facets.push([a, b, d]);
        }
        if k > 0 && k + 1 < half {
            facets.push([a, c, d]);
        }
    }
    facets
}

/// A spur gear with a bore.
pub fn gear(teeth: u32) -> IndexedMesh {
    let steps = 60;
    let outline = |z: f64| -> Vec<[f64; 3]> {
        let point = |k: u32| {
            let turn = TAU * f64::from(k) / f64::from(teeth * steps);
            // A flank of a sine cut off above and below is near enough to an involute.
            let radius = 1.0 + 0.08 * (2.2 * (turn * f64::from(teeth)).sin()).clamp(-1.0, 1.0);
            [radius * turn.cos(), radius * turn.sin(), z]
        };
        (0..teeth * steps).map(point).collect()
    };
    let bore = |z: f64| arc(0.35, 0.0, TAU, 180, z);
    let mut facets = Vec::new();
    for k in 0..ROWS {
        let [lower, upper] = [k, k + 1].map(|k| 0.4 * f64::from(k) / f64::from(ROWS));
        facets.extend(wall(&outline(lower), &outline(upper)));
        facets.extend(turned(wall(&bore(lower), &bore(upper))));
    }
    facets.extend(between(&bore(0.4), &outline(0.4), [0.0; 2]));
    facets.extend(turned(between(&bore(0.0), &outline(0.0), [0.0; 2])));
    assemble(&facets)
}

/// The vertices of an arc about the axis of z, its last one left out.
fn arc(radius: f64, from: f64, to: f64, segments: u32, z: f64) -> Vec<[f64; 3]> {
    let at = |k: u32| from + (to - from) * f64::from(k) / f64::from(segments);
    (0..segments).map(|k| [radius * at(k).cos(), radius * at(k).sin(), z]).collect()
}

/// Bolt holes of the coupling, and segments of the circle of each.
const HOLES: u32 = 8;
const SEGMENTS: u32 = 64;
/// Rows of a wall.
const ROWS: u32 = 4;
/// Radii of the coupling: bore, hub, fillet, circle of the bolts, their holes, rim; thickness of the flange, of a hub of height 1.
const BORE: f64 = 0.35;
const HUB: f64 = 0.55;
const ROUND: f64 = 0.06;
const BOLTS: f64 = 0.85;
const HOLE: f64 = 0.1;
const RIM: f64 = 1.1;
const THICK: f64 = 0.3;

#[cfg(test)]
mod tests {
    use super::*;
    use unweld::mesh::topology::{Weld, condition};

    #[test]
    fn parts_are_closed_and_of_the_genus_meant() {
        for (mesh, handles) in [(coupling(), HOLES as usize + 1), (blade(20, 30), 0), (gear(9), 1)] {
            let report = condition(&mesh, Weld::Exact).report;
            let census = &report.census;
            assert_eq!((census.components, census.boundary_edges, census.handles), (1, 0, handles));
            assert_eq!((report.reoriented_triangles, report.degenerate_triangles), (0, 0));
        }
    }
}
