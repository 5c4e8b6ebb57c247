//! The names that the parts of the input have in the walk of level 0, and the residue, which is written in them.

use crate::codec::residue::Residue;
use crate::codec::walk::Tour;
use crate::codec::whole::{Extra, Whole};
use crate::mesh::topology::Remainder;
use crate::mesh::{Lattice, Vertex};
use crate::refine::ProgressiveMesh;

/// Which part of the conditioned mesh has which name, and the residue.
pub struct Names {
    /// What the manifold lacks of the input, named by places in the walk of level 0.
    pub residue: Residue,
    /// The triangles of the walk, by vertices of the conditioned table.
    pub triangles: Vec<[Vertex; 3]>,
    /// For each further triangle its place in the remainder's residue.
    pub further: Vec<u32>,
    /// For each vertex of the table its place in the walk.
    place: Vec<u32>,
    /// For each of the remainder's extras its name.
    extra_names: Vec<u32>,
}

impl Names {
    /// Names the parts by the walk of `mesh`, level 0, whose vertices have the numbers of the conditioned table. `flipped`: its
    /// triangles that were turned round, each from its least vertex, in ascending order.
    pub fn new(
        remainder: &Remainder,
        flipped: &[[Vertex; 3]],
        mesh: &ProgressiveMesh,
        tour: &Tour,
        lattice: &Lattice,
    ) -> Self {
        let Tour { walk, vertices: order } = tour;
        let vertices = order.len();
        let mut place = vec![u32::MAX; remainder.origins.vertices.len()];
        for (k, v) in order.iter().enumerate() {
            place[v.index()] = k as u32;
        }
        let triangles: Vec<[Vertex; 3]> =
            walk.triangles.iter().map(|&c| mesh.table.triangle(c.triangle())).collect();
        let mut residue = Residue::default();
        if !flipped.is_empty() {
            residue.flipped = triangles.iter().map(|&t| flipped.binary_search(&turned(t)).is_ok()).collect();
        }
        if !remainder.stitches.is_empty() {
            let mut group = vec![u32::MAX; vertices];
            for (number, stitch) in remainder.stitches.iter().enumerate() {
                for v in stitch {
                    group[place[v.index()] as usize] = number as u32;
                }
            }
            // Groups are numbered by their first vertex in the walk.
            let mut renumbered = vec![u32::MAX; remainder.stitches.len()];
            let mut count = 0;
            for group in group.iter_mut().filter(|g| **g != u32::MAX) {
                let number = &mut renumbered[*group as usize];
                if *number == u32::MAX {
                    *number = count;
                    count += 1;
                }
                *group = *number;
            }
            residue.groups = group;
        }
        let mut extras: Vec<(Extra, usize)> =
            remainder.extras.iter().enumerate().map(|(k, &p)| (extra(p, lattice), k)).collect();
        extras.sort_by(|(x, _), (y, _)| match (x, y) {
            (Extra::Lattice(x), Extra::Lattice(y)) => x.cmp(y),
            (Extra::Lattice(_), Extra::Exact(_)) => std::cmp::Ordering::Less,
            (Extra::Exact(_), Extra::Lattice(_)) => std::cmp::Ordering::Greater,
            (Extra::Exact(x), Extra::Exact(y)) => x.partial_cmp(y).unwrap_or(std::cmp::Ordering::Equal),
        });
        let mut extra_names = vec![0; extras.len()];
        for (k, (_, from)) in extras.iter().enumerate() {
            extra_names[*from] = (vertices + k) as u32;
        }
        residue.extras = extras.into_iter().map(|(extra, _)| extra).collect();
        let named = |v: u32| match place.get(v as usize) {
            Some(&place) => place,
            None => extra_names[v as usize - place.len()],
        };
        let named = remainder.residue.iter().map(|t| t.map(named));
        let mut further: Vec<([u32; 3], u32)> = named.zip(0..).collect();
        further.sort_unstable();
        residue.triangles = further.iter().map(|&(t, _)| t).collect();
        let further = further.into_iter().map(|(_, from)| from).collect();
        Self { residue, triangles, further, place, extra_names }
    }

    /// For each vertex of the input its vertex of the whole.
    pub fn vertices(&self, remainder: &Remainder, whole: &Whole) -> Vec<u32> {
        let origins = &remainder.origins;
        let mut vertices = vec![u32::MAX; origins.same.len()];
        let names = self.place.iter().chain(&self.extra_names);
        for (v, &name) in origins.vertices.iter().chain(&origins.extras).zip(names) {
            vertices[v.index()] = whole.names[name as usize];
        }
        for (v, &first) in origins.same.iter().enumerate() {
            vertices[v] = vertices[first as usize];
        }
        vertices
    }
}

/// A triangle from its least vertex.
pub fn turned(mut t: [Vertex; 3]) -> [Vertex; 3] {
    let least = (0..3).min_by_key(|&k| t[k]).unwrap_or(0);
    t.rotate_left(least);
    t
}

/// A vertex outside the manifold: on the lattice where that can say where it is.
fn extra(position: [f64; 3], lattice: &Lattice) -> Extra {
    lattice.point(position).map_or(Extra::Exact(position), Extra::Lattice)
}
