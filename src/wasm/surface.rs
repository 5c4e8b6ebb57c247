//! The mesh as it is drawn: the decoder's, at level 0 with what the residue adds, and its normals.

use crate::codec::residue::Residue;
use crate::codec::walk::Walk;
use crate::codec::whole::Extra;
use crate::mesh::{Lattice, Triangle, Vertex};
use crate::refine::ProgressiveMesh;
use std::collections::BTreeMap;

/// What the residue adds. Further vertices and triangles are numbered behind those of the mesh.
#[derive(Clone, Debug, Default)]
pub struct Surface {
    extras: Vec<Extra>,
    triangles: Vec<[u32; 3]>,
    /// Triangles that the input had the other way round, ascending.
    reversed: Vec<u32>,
    /// Sums of normals of vertices that are sewn together or have further triangles.
    sums: BTreeMap<u32, [f64; 3]>,
}

impl Surface {
    /// Adds the residue to level 0.
    pub fn new(mesh: &ProgressiveMesh, residue: &Residue) -> Self {
        if residue.is_empty() {
            return Self::default();
        }
        let walk = Walk::new(&mesh.table, &mesh.roots);
        let order = walk.vertices(&mesh.table);
        let further = |name: u32| (mesh.positions.len() + name as usize - order.len()) as u32;
        let name = |name: u32| order.get(name as usize).map_or_else(|| further(name), |v| v.0);
        let mut reversed: Vec<u32> = residue
            .flipped
            .iter_ones()
            .filter_map(|k| walk.triangles.get(k))
            .map(|c| c.triangle().0)
            .collect();
        reversed.sort_unstable();
        let mut surface = Self {
            extras: residue.extras.clone(),
            triangles: residue.triangles.iter().map(|t| t.map(name)).collect(),
            reversed,
            sums: BTreeMap::new(),
        };
        surface.sums = surface.sums_of(mesh, residue, &order);
        surface
    }

    /// Further vertices and triangles.
    pub fn counts(&self) -> [u32; 2] {
        [self.extras.len() as u32, self.triangles.len() as u32]
    }

    /// Triangles of the mesh that are drawn the other way round.
    pub fn reversed(&self) -> impl Iterator<Item = u32> + '_ {
        self.reversed.iter().copied()
    }

    /// Vertices whose normals are not those of the mesh.
    pub fn turned(&self) -> impl Iterator<Item = u32> + '_ {
        self.sums.keys().copied()
    }

    /// A vertex's place relative to the lattice's origin, in its steps.
    pub fn position(&self, mesh: &ProgressiveMesh, lattice: &Lattice, v: u32) -> [f64; 3] {
        if let Some(p) = mesh.positions.get(v as usize) {
            return p.map(f64::from);
        }
        match self.extras.get(v as usize - mesh.positions.len()) {
            Some(&Extra::Lattice(p)) => p.map(f64::from),
            Some(&Extra::Exact(p)) if lattice.step > 0.0 => [0, 1, 2].map(|k| lattice.unclamped(p[k], k)),
            _ => [0.0; 3],
        }
    }

    /// The vertices of a triangle.
    pub fn triangle(&self, mesh: &ProgressiveMesh, t: u32) -> [u32; 3] {
        let slots = mesh.table.slots();
        if t as usize >= slots {
            return self.triangles.get(t as usize - slots).copied().unwrap_or_default();
        }
        self.as_drawn(t, mesh.table.triangle(Triangle(t)).map(|v| v.0))
    }

    /// What the corners of a triangle of the mesh have, in the order in which it is drawn.
    pub fn as_drawn(&self, t: u32, [a, b, c]: [u32; 3]) -> [u32; 3] {
        if self.reversed.binary_search(&t).is_ok() { [a, c, b] } else { [a, b, c] }
    }

    /// The normal of a vertex: the mean of those of its triangles, weighted by their areas; 0 where there is none.
    pub fn normal(&self, mesh: &ProgressiveMesh, v: u32) -> [f32; 3] {
        let sum = match self.sums.get(&v) {
            Some(&sum) => sum,
            None if (v as usize) < mesh.positions.len() => fan_sum(mesh, v),
            None => [0.0; 3],
        };
        let length = (sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]).sqrt();
        if length > 0.0 { sum.map(|x| (x / length) as f32) } else { [0.0; 3] }
    }

    fn sums_of(
        &self,
        mesh: &ProgressiveMesh,
        residue: &Residue,
        order: &[Vertex],
    ) -> BTreeMap<u32, [f64; 3]> {
        let near = |v: u32| match self.extras.get((v as usize).wrapping_sub(mesh.positions.len())) {
            Some(&Extra::Lattice(p)) => Some(p),
            Some(Extra::Exact(_)) => None,
            None => mesh.positions.get(v as usize).copied(),
        };
        let mut sums = BTreeMap::new();
        for t in &self.triangles {
            let [Some(a), Some(b), Some(c)] = t.map(near) else { continue };
            let normal = cross(a, b, c);
            for &v in t {
                let own = || if (v as usize) < mesh.positions.len() { fan_sum(mesh, v) } else { [0.0; 3] };
                add(sums.entry(v).or_insert_with(own), normal);
            }
        }
        let members = || order.iter().zip(&residue.groups).filter(|&(_, &group)| group != u32::MAX);
        let mut groups: BTreeMap<u32, [f64; 3]> = BTreeMap::new();
        for (v, &group) in members() {
            let own = sums.get(&v.0).copied().unwrap_or_else(|| fan_sum(mesh, v.0));
            add(groups.entry(group).or_default(), own);
        }
        sums.extend(members().filter_map(|(v, group)| Some((v.0, *groups.get(group)?))));
        sums
    }
}

/// The sum of the normals of the triangles at a vertex of the mesh, each as long as twice its area.
fn fan_sum(mesh: &ProgressiveMesh, v: u32) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for corner in mesh.table.fan(Vertex(v)) {
        let [a, b, c] = mesh.table.vertices_from(corner).map(|v| mesh.positions[v.index()]);
        add(&mut sum, cross(a, b, c));
    }
    sum
}

fn cross(a: [i32; 3], b: [i32; 3], c: [i32; 3]) -> [f64; 3] {
    let [u, v] = [b, c].map(|p| [0, 1, 2].map(|k| f64::from(p[k]) - f64::from(a[k])));
    [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
}

fn add(sum: &mut [f64; 3], more: [f64; 3]) {
    for (x, more) in sum.iter_mut().zip(more) {
        *x += more;
    }
}
