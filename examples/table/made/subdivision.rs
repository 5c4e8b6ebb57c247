//! Subdivision surfaces: Loop (1987) of triangles, Catmull and Clark (1978) of quads, both of closed meshes.

use super::sheet::cut;
use std::collections::HashMap;
use std::f64::consts::TAU;
use unweld::mesh::IndexedMesh;

/// One step of Loop's: a vertex on every edge, four triangles for each.
pub fn triangles(mesh: &IndexedMesh) -> IndexedMesh {
    let old = &mesh.positions;
    let edges = Edges::of(&mesh.triangles);
    let mut around = vec![(0.0, [0.0; 3]); old.len()];
    let mut middles = vec![[0.0; 3]; edges.ends.len()];
    for (&[a, b], middle) in edges.ends.iter().zip(&mut middles) {
        let [p, q] = [a, b].map(|v| old[v as usize]);
        *middle = add(*middle, scale(add(p, q), 3.0 / 8.0));
        for (v, other) in [(a, q), (b, p)] {
            let (count, sum) = &mut around[v as usize];
            *count += 1.0;
            *sum = add(*sum, other);
        }
    }
    for t in &mesh.triangles {
        for k in 0..3 {
            let edge = edges.number(t[k], t[(k + 1) % 3]) as usize;
            middles[edge] = add(middles[edge], scale(old[t[(k + 2) % 3] as usize], 1.0 / 8.0));
        }
    }
    let moved = old.iter().zip(&around).map(|(&p, &(count, sum))| {
        let beta = (5.0 / 8.0 - (3.0 / 8.0 + (TAU / count).cos() / 4.0f64).powi(2)) / count;
        add(scale(p, 1.0 - count * beta), scale(sum, beta))
    });
    let first = old.len() as u32;
    let quarters = mesh.triangles.iter().flat_map(|&[a, b, c]| {
        let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(v, w)| first + edges.number(v, w));
        [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
    });
    let quarters = quarters.collect();
    IndexedMesh::new(moved.chain(middles.iter().copied()).collect(), quarters)
}

/// Quads, not cut yet.
pub struct Quads {
    pub positions: Vec<[f64; 3]>,
    pub faces: Vec<[u32; 4]>,
}

impl Quads {
    /// The surface of cubes of side 1 by their lower corners; no two of them may touch along an edge or at a vertex only.
    pub fn of_cubes(cubes: &[[i32; 3]]) -> Self {
        let (mut numbers, mut positions, mut faces) = (HashMap::new(), Vec::new(), Vec::new());
        for &cube in cubes {
            for (axis, side) in (0..3).flat_map(|axis| [(axis, 0), (axis, 1)]) {
                let mut beside = cube;
                beside[axis] += 2 * side - 1;
                if cubes.contains(&beside) {
                    continue;
                }
                let mut face = [[0, 0], [1, 0], [1, 1], [0, 1]].map(|[u, v]| {
                    let mut corner = cube;
                    corner[axis] += side;
                    corner[(axis + 1) % 3] += u;
                    corner[(axis + 2) % 3] += v;
                    *numbers.entry(corner).or_insert_with(|| {
                        positions.push(corner.map(f64::from));
                        positions.len() as u32 - 1
                    })
                });
                if side == 0 {
                    face.reverse();
                }
                faces.push(face);
            }
        }
        Self { positions, faces }
    }

    /// One step of Catmull and Clark's: a vertex on every face and edge, four quads for each.
    pub fn subdivided(&self) -> Self {
        let old = &self.positions;
        let edges = Edges::of(&self.faces);
        let centres: Vec<[f64; 3]> = self
            .faces
            .iter()
            .map(|face| scale(face.map(|v| old[v as usize]).into_iter().fold([0.0; 3], add), 0.25))
            .collect();
        let mut middles: Vec<[f64; 3]> = edges
            .ends
            .iter()
            .map(|ends| scale(add(old[ends[0] as usize], old[ends[1] as usize]), 0.25))
            .collect();
        // Of each vertex, the number of its edges, the sum of the middles of its edges, of its faces.
        let mut around = vec![(0.0, [0.0; 3], [0.0; 3]); old.len()];
        for (&ends, &middle) in edges.ends.iter().zip(&middles) {
            for v in ends {
                let (count, of_edges, _) = &mut around[v as usize];
                *count += 1.0;
                *of_edges = add(*of_edges, scale(middle, 2.0));
            }
        }
        for (face, &centre) in self.faces.iter().zip(&centres) {
            for k in 0..4 {
                let (_, _, of_faces) = &mut around[face[k] as usize];
                *of_faces = add(*of_faces, centre);
                let edge = edges.number(face[k], face[(k + 1) % 4]) as usize;
                middles[edge] = add(middles[edge], scale(centre, 0.25));
            }
        }
        let moved = old.iter().zip(&around).map(|(&p, &(count, of_edges, of_faces))| {
            let sum = add(scale(add(of_faces, scale(of_edges, 2.0)), 1.0 / count), scale(p, count - 3.0));
            scale(sum, 1.0 / count)
        });
        let [first_centre, first_middle] = [old.len(), old.len() + centres.len()].map(|n| n as u32);
        let mut faces = Vec::with_capacity(4 * self.faces.len());
        for (f, face) in self.faces.iter().enumerate() {
            let middle = |k: usize| first_middle + edges.number(face[k % 4], face[(k + 1) % 4]);
            faces.extend((0..4).map(|k| [face[k], middle(k), first_centre + f as u32, middle(k + 3)]));
        }
        let positions = moved.chain(centres.iter().copied()).chain(middles.iter().copied()).collect();
        Self { positions, faces }
    }

    /// Each quad cut from its first corner: a vertex of the coarser mesh, where it was subdivided.
    pub fn cut(self) -> IndexedMesh {
        IndexedMesh::new(self.positions, self.faces.into_iter().flat_map(|face| cut(face, false)).collect())
    }
}

/// The edges of faces, numbered as they appear.
struct Edges {
    numbers: HashMap<[u32; 2], u32>,
    ends: Vec<[u32; 2]>,
}

impl Edges {
    fn of<const N: usize>(faces: &[[u32; N]]) -> Self {
        let mut edges = Self { numbers: HashMap::new(), ends: Vec::new() };
        for face in faces {
            for k in 0..N {
                let ends = Self::key(face[k], face[(k + 1) % N]);
                edges.numbers.entry(ends).or_insert_with(|| {
                    edges.ends.push(ends);
                    edges.ends.len() as u32 - 1
                });
            }
        }
        edges
    }

    /// The number of an edge that is there.
    fn number(&self, a: u32, b: u32) -> u32 {
        self.numbers[&Self::key(a, b)]
    }

    fn key(a: u32, b: u32) -> [u32; 2] {
        [a.min(b), a.max(b)]
    }
}

fn add(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|k| a[k] + b[k])
}

fn scale(a: [f64; 3], factor: f64) -> [f64; 3] {
    a.map(|x| x * factor)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cube_becomes_a_ball_of_quads() {
        let mut quads = Quads::of_cubes(&[[0; 3]]);
        assert_eq!((quads.positions.len(), quads.faces.len()), (8, 6));
        for _ in 0..3 {
            quads = quads.subdivided();
        }
        assert_eq!((quads.positions.len(), quads.faces.len()), (386, 384));
        let far = |p: &[f64; 3]| p.iter().map(|x| (x - 0.5) * (x - 0.5)).sum::<f64>().sqrt();
        let [min, max] =
            [f64::min, f64::max].map(|pick| quads.positions.iter().map(far).reduce(pick).unwrap());
        assert!(max / min < 1.1, "{min} {max}");
    }

    #[test]
    fn a_regular_plane_stays_one() {
        // Loop's masks have a sum of 1 and keep what is linear: a tetrahedron shrinks about its centre.
        let corners = vec![[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]];
        let fine = triangles(&IndexedMesh::new(corners, vec![[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]]));
        assert_eq!((fine.positions.len(), fine.triangles.len()), (10, 16));
        let sum = fine.positions.iter().fold([0.0; 3], |sum, &p| add(sum, p));
        assert!(sum.iter().all(|x| x.abs() < 1e-12), "{sum:?}");
    }
}
