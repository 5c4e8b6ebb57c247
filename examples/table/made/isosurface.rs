//! Surfaces where a function of space is 0, as scanners' volumes give them: marching cubes (Lorensen and Cline 1987), its cases found by
//! following the outline through each cell's faces.

use std::collections::HashMap;
use unweld::mesh::IndexedMesh;

/// The surface round where `function` is below 0, in `cells` cells a side of the cube from -1 to 1. It is closed where the function is
/// not below 0 on the cube's sides.
pub fn surface(cells: usize, function: impl Fn([f64; 3]) -> f64) -> IndexedMesh {
    let side = cells + 1;
    let place = |[i, j, k]: [usize; 3]| [i, j, k].map(|n| 2.0 * n as f64 / cells as f64 - 1.0);
    let number = |[i, j, k]: [usize; 3]| (i * side + j) * side + k;
    let cube = |n: usize| (0..n).flat_map(move |i| (0..n).flat_map(move |j| (0..n).map(move |k| [i, j, k])));
    let values: Vec<f64> = cube(side).map(|at| function(place(at))).collect();
    let (mut numbers, mut positions, mut triangles) = (HashMap::new(), Vec::new(), Vec::new());
    for cell in cube(cells) {
        let corner = |c: usize| [0, 1, 2].map(|axis| cell[axis] + (c >> axis & 1));
        let inside: [bool; 8] = std::array::from_fn(|c| values[number(corner(c))] < 0.0);
        if inside == [inside[0]; 8] {
            continue;
        }
        let mut vertex = |[a, b]: [usize; 2]| {
            let [p, q] = [a.min(b), a.max(b)].map(corner);
            *numbers.entry([number(p), number(q)]).or_insert_with(|| {
                let [at_p, at_q] = [p, q].map(|at| values[number(at)]);
                // Not onto a corner, where the vertices of several edges would be one.
                let t = (at_p / (at_p - at_q)).clamp(0.01, 0.99);
                let [p, q] = [p, q].map(place);
                positions.push([0, 1, 2].map(|axis| p[axis] + t * (q[axis] - p[axis])));
                positions.len() as u32 - 1
            })
        };
        for outline in outlines(inside) {
            let ring: Vec<u32> = outline.into_iter().map(&mut vertex).collect();
            triangles.extend((1..ring.len() - 1).map(|k| [ring[0], ring[k], ring[k + 1]]));
        }
    }
    IndexedMesh::new(positions, triangles)
}

/// The closed lines that part the corners inside from the others on the faces of a cell, as rings of edges (two corners each).
/// Where a face has two of either at its diagonals, the ones inside are apart: both cells at the face agree on that.
fn outlines(inside: [bool; 8]) -> Vec<Vec<[usize; 2]>> {
    // From the edge on which a face is entered to the one on which it is left again, with the inside on the same hand.
    let mut next: Vec<([usize; 2], [usize; 2])> = Vec::new();
    for face in FACES {
        for k in (0..4).filter(|&k| !inside[face[k]] && inside[face[(k + 1) % 4]]) {
            let leaves =
                (k + 1..k + 4).find(|&l| inside[face[l % 4]] && !inside[face[(l + 1) % 4]]).unwrap_or(k);
            next.push((edge(face, k), edge(face, leaves)));
        }
    }
    let mut rings = Vec::new();
    while let Some((start, mut at)) = next.pop() {
        let mut ring = vec![start];
        while at != start {
            ring.push(at);
            let Some(found) = next.iter().position(|(from, _)| *from == at) else { break };
            at = next.swap_remove(found).1;
        }
        rings.push(ring);
    }
    rings
}

fn edge(face: [usize; 4], k: usize) -> [usize; 2] {
    let [a, b] = [face[k % 4], face[(k + 1) % 4]];
    [a.min(b), a.max(b)]
}

/// The corners of each face, counter-clockwise as seen from outside; bits of a corner's number are its x, y, z.
const FACES: [[usize; 4]; 6] =
    [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];

#[cfg(test)]
mod tests {
    use super::*;
    use unweld::mesh::topology::{Weld, condition};

    #[test]
    fn a_ball_is_closed_and_looks_outwards() {
        let mesh = surface(12, |[x, y, z]| (x * x + y * y + z * z).sqrt() - 0.7);
        let conditioned = condition(&mesh, Weld::Exact);
        let census = &conditioned.report.census;
        assert_eq!((census.components, census.boundary_loops, census.handles), (1, 0, 0));
        assert_eq!(conditioned.report.reoriented_triangles, 0);
        let volume: f64 = mesh
            .triangles
            .iter()
            .map(|t| t.map(|v| mesh.positions[v as usize]))
            .map(|[a, b, c]| {
                let cross = [b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0]];
                (a[0] * cross[0] + a[1] * cross[1] + a[2] * cross[2]) / 6.0
            })
            .sum();
        let ball = 4.0 / 3.0 * std::f64::consts::PI * 0.343;
        assert!((0.95..1.0).contains(&(volume / ball)), "{volume} {ball}");
    }

    #[test]
    fn every_case_is_closed_with_its_neighbours() {
        // White noise has all 256 cases, also the ambiguous ones; its border is outside.
        let noise = |p: [f64; 3]| {
            let [i, j, k] = p.map(|x| ((x + 1.0) * 6.0).round() as u32);
            let border = [i, j, k].iter().any(|&n| n == 0 || n == 12);
            if border { 1.0 } else { super::super::noise::unit(u64::from(k), i, j, 0) }
        };
        let report = condition(&surface(12, noise), Weld::Exact).report;
        assert_eq!((report.census.boundary_edges, report.reoriented_triangles), (0, 0));
    }
}
