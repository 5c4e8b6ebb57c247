//! Meshes made by rule, for tests and the demonstration. All are oriented manifolds in general position:
//! the positions carry a small deterministic jitter, so that no two edges are exactly as long.

use std::collections::HashMap;
use std::f64::consts::TAU;

use super::indexed::IndexedMesh;
use super::random::SplitMix64;

/// A tetrahedron.
pub fn tetrahedron() -> IndexedMesh {
    let positions = vec![[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]];
    jittered(positions, vec![[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]])
}

/// A hexagon of six triangles round vertex 0, with an ear (a triangle with two boundary edges) on each side:
/// 13 vertices, 12 triangles, one boundary loop of 12 edges.
pub fn disc_with_ears() -> IndexedMesh {
    let mut positions = vec![[0.0, 0.0, 0.3]];
    positions.extend((0..6).map(|i| circle(f64::from(i) / 6.0, 1.0, 0.0)));
    positions.extend((0..6).map(|i| circle((f64::from(i) + 0.5) / 6.0, 1.7, -0.3)));
    let hexagon = (0..6).map(|i| [0, 1 + i, 1 + (i + 1) % 6]);
    let ears = (0..6).map(|i| [1 + (i + 1) % 6, 1 + i, 7 + i]);
    jittered(positions, hexagon.chain(ears).collect())
}

/// A ring of 2n triangles between two boundary loops of n edges; n >= 3.
pub fn annulus(n: u32) -> IndexedMesh {
    let ring = |radius| (0..n).map(move |i| circle(f64::from(i) / f64::from(n), radius, 0.0));
    let positions = ring(1.0).chain(ring(2.0)).collect();
    let quads = (0..n).map(|i| [i, n + i, n + (i + 1) % n, (i + 1) % n]);
    jittered(positions, quads.flat_map(split).collect())
}

/// A zigzag strip of n triangles; n >= 1.
pub fn strip(n: u32) -> IndexedMesh {
    let positions = (0..n + 2).map(|i| [0.5 * f64::from(i), f64::from(i % 2), 0.0]).collect();
    let triangles = (0..n).map(|i| if i % 2 == 0 { [i, i + 2, i + 1] } else { [i, i + 1, i + 2] });
    jittered(positions, triangles.collect())
}

/// A sheet of n times m squares, each of two triangles; n, m >= 1.
pub fn grid(n: u32, m: u32) -> IndexedMesh {
    let at = |i, j| j * (n + 1) + i;
    let positions = pairs(n + 1, m + 1).map(|(i, j)| [f64::from(i), f64::from(j), 0.0]).collect();
    let quads = pairs(n, m).map(|(i, j)| [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
    jittered(positions, quads.flat_map(split).collect())
}

/// A closed torus of n times m squares, each of two triangles; n, m >= 3.
pub fn torus(n: u32, m: u32) -> IndexedMesh {
    let at = |i, j| (j % m) * n + i % n;
    let positions = pairs(n, m).map(|(i, j)| {
        let [x, y, _] = circle(f64::from(j) / f64::from(m), 1.0, 0.0);
        circle(f64::from(i) / f64::from(n), 3.0 + x, y)
    });
    let quads = pairs(n, m).map(|(i, j)| [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
    jittered(positions.collect(), quads.flat_map(split).collect())
}

/// A torus without two neighbouring squares: one boundary loop of six edges; n, m >= 3.
pub fn torus_with_hole(n: u32, m: u32) -> IndexedMesh {
    let mut mesh = torus(n, m);
    mesh.triangles.drain(..4);
    mesh
}

/// A torus and a tetrahedron beside it.
pub fn two_components() -> IndexedMesh {
    let mut mesh = torus(8, 5);
    let first = mesh.positions.len() as u32;
    let other = tetrahedron();
    mesh.positions.extend(other.positions.iter().map(|&[x, y, z]| [x + 7.0, y, z]));
    mesh.triangles.extend(other.triangles.iter().map(|t| t.map(|v| v + first)));
    mesh
}

/// A plate of cubes with `genus` square holes in a row: a closed surface with that many handles; genus >= 1.
pub fn handle_body(genus: u32) -> IndexedMesh {
    let (width, height) = (2 * genus as i32 + 1, 3);
    let filled = |[x, y, z]: [i32; 3]| {
        let inside = (0..width).contains(&x) && (0..height).contains(&y) && z == 0;
        inside && !(x % 2 == 1 && y == 1)
    };
    let mut mesh = IndexedMesh::default();
    let mut numbers = HashMap::new();
    for cell in (0..width).flat_map(|x| (0..height).map(move |y| [x, y, 0])) {
        for (axis, side) in (0..3).flat_map(|axis| [(axis, 0), (axis, 1)]) {
            let mut beyond = cell;
            beyond[axis] += 2 * side - 1;
            if !filled(cell) || filled(beyond) {
                continue;
            }
            // The square's corners run counter-clockwise seen from the positive side of the axis.
            let mut square = [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(u, v)| {
                let mut p = cell;
                p[axis] += side;
                p[(axis + 1) % 3] += u;
                p[(axis + 2) % 3] += v;
                *numbers.entry(p).or_insert_with(|| {
                    mesh.positions.push(p.map(f64::from));
                    mesh.positions.len() as u32 - 1
                })
            });
            if side == 0 {
                square.reverse();
            }
            mesh.triangles.extend(split(square));
        }
    }
    jittered(mesh.positions, mesh.triangles)
}

/// An icosahedron, each triangle split into four `subdivisions` times, on the unit sphere:
/// 10 * 4^subdivisions + 2 vertices; subdivisions <= 12.
pub fn sphere(subdivisions: u32) -> IndexedMesh {
    let (positions, triangles) = icosphere(subdivisions);
    jittered(positions, triangles)
}

/// A sphere with mountains, the same for the same seed: detail down to the size of the triangles of seven subdivisions.
pub fn bumpy_sphere(subdivisions: u32, seed: u64) -> IndexedMesh {
    let (mut positions, triangles) = icosphere(subdivisions);
    for p in &mut positions {
        let octaves =
            (0..7).map(|k| noise(p.map(|x| x * f64::from(2u32 << k)), seed + k) / f64::from(1u32 << k));
        let height = 1.0 + 0.25 * octaves.sum::<f64>();
        *p = p.map(|x| x * height);
    }
    jittered(positions, triangles)
}

/// The unit icosahedron, subdivided.
fn icosphere(subdivisions: u32) -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
    let ring = |offset: f64, z| (0..5).map(move |i| unit(circle((f64::from(i) + offset) / 5.0, 2.0, z)));
    let mut positions: Vec<_> =
        [[0.0, 0.0, 1.0]].into_iter().chain(ring(0.0, 1.0)).chain(ring(0.5, -1.0)).collect();
    positions.push([0.0, 0.0, -1.0]);
    let fives = |i: u32| {
        let j = (i + 1) % 5;
        [[0, 1 + i, 1 + j], [1 + i, 6 + i, 1 + j], [1 + j, 6 + i, 6 + j], [11, 6 + j, 6 + i]]
    };
    let mut triangles: Vec<[u32; 3]> = (0..5).flat_map(fives).collect();
    for _ in 0..subdivisions {
        let mut middles = HashMap::new();
        let mut middle = |a: u32, b: u32| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                let (p, q) = (positions[a as usize], positions[b as usize]);
                positions.push(unit([p[0] + q[0], p[1] + q[1], p[2] + q[2]]));
                positions.len() as u32 - 1
            })
        };
        let quarters = |[a, b, c]: [u32; 3]| {
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            [[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]
        };
        triangles = triangles.into_iter().flat_map(quarters).collect();
    }
    (positions, triangles)
}

/// A smooth random function of space between -1 and 1 with features of size 1: values at integer points, interpolated.
fn noise(p: [f64; 3], seed: u64) -> f64 {
    let base = p.map(f64::floor);
    let smooth: [f64; 3] = std::array::from_fn(|k| {
        let t = p[k] - base[k];
        t * t * (3.0 - 2.0 * t)
    });
    let value = |corner: usize| {
        let (mut hash, mut weight) = (seed, 1.0);
        for k in 0..3 {
            let bit = corner >> k & 1;
            hash = SplitMix64::new(hash ^ (base[k] as i64 + bit as i64) as u64).next_u64();
            weight *= if bit == 1 { smooth[k] } else { 1.0 - smooth[k] };
        }
        weight * (2.0 * SplitMix64::new(hash).unit() - 1.0)
    };
    (0..8).map(value).sum()
}

/// Moves every vertex by a few hundredths of the first edge's length.
fn jittered(mut positions: Vec<[f64; 3]>, triangles: Vec<[u32; 3]>) -> IndexedMesh {
    let [p, q, _] = triangles[0].map(|v| positions[v as usize]);
    let edge = (0..3).map(|k| (p[k] - q[k]).powi(2)).sum::<f64>().sqrt();
    let mut random = SplitMix64::new(JITTER_SEED);
    for x in positions.iter_mut().flatten() {
        *x += 0.04 * edge * (random.unit() - 0.5);
    }
    IndexedMesh::new(positions, triangles)
}

/// The point of a circle round the z axis at `turn` turns.
fn circle(turn: f64, radius: f64, z: f64) -> [f64; 3] {
    let (sin, cos) = (turn * TAU).sin_cos();
    [radius * cos, radius * sin, z]
}

fn unit(p: [f64; 3]) -> [f64; 3] {
    let length = p.iter().map(|x| x * x).sum::<f64>().sqrt();
    p.map(|x| x / length)
}

/// The two triangles of a square.
fn split([a, b, c, d]: [u32; 4]) -> [[u32; 3]; 2] {
    [[a, b, c], [a, c, d]]
}

/// All (i, j) with i < n and j < m, i running fastest.
fn pairs(n: u32, m: u32) -> impl Iterator<Item = (u32, u32)> {
    (0..m).flat_map(move |j| (0..n).map(move |i| (i, j)))
}

const JITTER_SEED: u64 = 1;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::CornerTable;

    /// Checks the table, then returns vertices, triangles, boundary edges and the Euler characteristic.
    fn figures(mesh: &IndexedMesh) -> (usize, usize, usize, i64) {
        let table = CornerTable::from_triangles(mesh.positions.len(), &mesh.triangles).unwrap();
        let (v, f) = (mesh.positions.len(), mesh.triangles.len());
        let boundary =
            table.triangles().flat_map(|t| t.corners()).filter(|&c| table.opposite(c).is_none()).count();
        (v, f, boundary, v as i64 - (3 * f + boundary) as i64 / 2 + f as i64)
    }

    #[test]
    fn every_shape_is_the_manifold_it_claims_to_be() {
        assert_eq!(figures(&tetrahedron()), (4, 4, 0, 2));
        assert_eq!(figures(&disc_with_ears()), (13, 12, 12, 1));
        assert_eq!(figures(&annulus(3)), (6, 6, 6, 0));
        assert_eq!(figures(&annulus(24)), (48, 48, 48, 0));
        assert_eq!(figures(&strip(1)), (3, 1, 3, 1));
        assert_eq!(figures(&strip(9)), (11, 9, 11, 1));
        assert_eq!(figures(&grid(3, 2)), (12, 12, 10, 1));
        assert_eq!(figures(&torus(3, 3)), (9, 18, 0, 0));
        assert_eq!(figures(&torus(12, 7)), (84, 168, 0, 0));
        assert_eq!(figures(&torus_with_hole(3, 3)), (9, 14, 6, -1));
        assert_eq!(figures(&torus_with_hole(8, 6)), (48, 92, 6, -1));
        assert_eq!(figures(&two_components()), (44, 84, 0, 2));
        for genus in 1..5 {
            assert_eq!(figures(&handle_body(genus)).2, 0);
            assert_eq!(figures(&handle_body(genus)).3, 2 - 2 * i64::from(genus));
        }
        assert_eq!(figures(&sphere(0)), (12, 20, 0, 2));
        assert_eq!(figures(&sphere(3)), (642, 1280, 0, 2));
        assert_eq!(figures(&bumpy_sphere(3, 5)), (642, 1280, 0, 2));
    }

    #[test]
    fn closed_shapes_are_seen_counter_clockwise_from_outside() {
        let shapes = [tetrahedron(), torus(9, 6), handle_body(2), sphere(2), bumpy_sphere(4, 9)];
        for mesh in shapes {
            let volume: f64 = mesh
                .triangles
                .iter()
                .map(|t| {
                    let [a, b, c] = t.map(|v| mesh.positions[v as usize]);
                    a[0] * (b[1] * c[2] - b[2] * c[1])
                        + a[1] * (b[2] * c[0] - b[0] * c[2])
                        + a[2] * (b[0] * c[1] - b[1] * c[0])
                })
                .sum();
            assert!(volume > 0.0, "{} triangles", mesh.triangles.len());
        }
    }

    #[test]
    fn the_seed_decides_on_the_mountains() {
        assert_eq!(bumpy_sphere(2, 1), bumpy_sphere(2, 1));
        assert_ne!(bumpy_sphere(2, 1), bumpy_sphere(2, 2));
    }
}
