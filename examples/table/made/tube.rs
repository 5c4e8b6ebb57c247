//! A bent tube of quads, its ends closed by domes of irregular triangles.

use super::assemble;
use super::noise::unit;
use super::sheet::{one, sheet};
use super::zip::{Facet, between, turned};
use std::f64::consts::TAU;
use unweld::mesh::IndexedMesh;

/// A tube of `along` rows of `around` quads, between two domes of about as large triangles.
pub fn with_domes(along: u32, around: u32, seed: u64) -> IndexedMesh {
    let circle = |z: f64| ring(1.0, z, (0..around).map(|k| f64::from(k) / f64::from(around)));
    let step = TAU / f64::from(around);
    let length = step * f64::from(along);
    let wall = sheet([along + 1, around], [false, true], one, |i, j| {
        let [x, y, _] = ring(1.0, 0.0, [f64::from(j) / f64::from(around)].into_iter())[0];
        [x, y, length * f64::from(i) / f64::from(along)]
    });
    // Columns run counter-clockwise and rows upwards: its cells look inwards.
    let corners = |t: &[u32; 3]| t.map(|v| wall.positions[v as usize]);
    let mut facets = turned(wall.triangles.iter().map(corners).collect());
    facets.extend(
        dome(circle(0.0), step, seed).into_iter().map(|facet| facet.map(|p| [p[0], p[1], p[2] + length])),
    );
    facets.extend(
        turned(dome(circle(0.0), step, seed + 1)).into_iter().map(|facet| facet.map(|p| [p[0], p[1], -p[2]])),
    );
    // The axis becomes a helix' turn, wide enough that the tube does not meet itself.
    let radius = length / TAU * 1.3;
    let bent = |[x, y, z]: [f64; 3]| {
        let turn = z / radius;
        [(radius + x) * turn.cos(), (radius + x) * turn.sin(), y + 0.4 * turn * turn]
    };
    assemble(&facets.iter().map(|facet| facet.map(bent)).collect::<Vec<_>>())
}

/// Half a ball over a circle in the plane of x and y: rings of ever fewer vertices, shifted and jittered.
fn dome(rim: Vec<[f64; 3]>, step: f64, seed: u64) -> Vec<Facet> {
    let rings = (TAU / 4.0 / (0.87 * step)) as u32;
    let (mut facets, mut outer) = (Vec::new(), rim);
    for k in 1..rings {
        let latitude = TAU / 4.0 * f64::from(k) / f64::from(rings);
        let count =
            ((TAU * latitude.cos() / step) * (1.0 + 0.15 * unit(seed, k, 0, 0))).round().max(5.0) as u32;
        let start = 0.5 * unit(seed, k, 0, 1);
        let place = |j: u32| (start + f64::from(j) + 0.3 * unit(seed, k, j, 2)) / f64::from(count);
        let inner = ring(latitude.cos(), latitude.sin(), (0..count).map(place));
        facets.extend(between(&inner, &outer, [0.0; 2]));
        outer = inner;
    }
    let n = outer.len();
    facets.extend((0..n).map(|k| [outer[k], outer[(k + 1) % n], [0.0, 0.0, 1.0]]));
    facets
}

/// Vertices of a circle about the axis of z, at shares of a turn.
fn ring(radius: f64, z: f64, turns: impl Iterator<Item = f64>) -> Vec<[f64; 3]> {
    turns.map(|turn| (TAU * turn).sin_cos()).map(|(sin, cos)| [radius * cos, radius * sin, z]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use unweld::mesh::topology::{Weld, condition};

    #[test]
    fn it_is_closed() {
        let report = condition(&with_domes(40, 24, 1), Weld::Exact).report;
        let census = &report.census;
        assert_eq!((census.components, census.boundary_edges, census.handles), (1, 0, 0));
        assert_eq!((report.reoriented_triangles, report.degenerate_triangles), (0, 0));
    }
}
