//! A mesh on its way to a coarser one: checked once, then made smaller in its own memory.

use super::parents::{NO_VERTEX, Parents};
use super::rings::Rings;
use super::star::{GONE, Star, is_closed_fan, turned};
use super::wedges::Wedges;
use crate::error::{Error, Result};
use crate::mesh::IndexedMesh;

/// What was left out of the input because no simplifier can use it; numbers of things.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LeftOut {
    /// Triangles with two corners on one vertex.
    pub degenerate_triangles: usize,
    /// Triangles with the same vertices as an earlier one, in whichever orientation.
    pub repeated_triangles: usize,
    /// Vertices in no triangle.
    pub isolated_vertices: usize,
}

/// A mesh whose triangles each have three vertices, in one triangle each at least.
#[derive(Debug, Default)]
pub(super) struct Working {
    pub(super) positions: Vec<[f64; 3]>,
    /// [`GONE`] where one has been removed.
    pub(super) triangles: Vec<[u32; 3]>,
    /// Those that are not gone.
    pub(super) living: usize,
    /// What is known of each vertex.
    pub(super) flags: Vec<u8>,
    pub(super) rings: Rings,
    /// What corners have beside their positions, where that counts.
    pub(super) wedges: Option<Wedges>,
    /// Where the vertices of the input went, where that is wanted.
    pub(super) parents: Option<Parents>,
    /// The power of 2 that the positions were multiplied with.
    scale: f64,
}

/// The vertex takes no part any more in this pass.
pub(super) const DIRTY: u8 = 1;
/// The vertex stays in its place, since the surface round it is no manifold or the boundary is locked.
pub(super) const FIXED: u8 = 2;

impl Working {
    /// Copies a mesh, and leaves out what is of no use; with its attributes and the vertices' ways, if these are wanted.
    ///
    /// # Errors
    /// [`Error::Parameter`] where a triangle names a vertex that does not exist or has no finite position, [`Error::Limit`] where there
    /// are more than [`Rings::MAX_TRIANGLES`].
    pub(super) fn new(
        mesh: &IndexedMesh,
        with_attributes: bool,
        with_parents: bool,
    ) -> Result<(Self, LeftOut)> {
        let given = mesh.triangles.len();
        if given > Rings::MAX_TRIANGLES {
            let [needed, allowed] = [given, Rings::MAX_TRIANGLES].map(|n| n as u64);
            return Err(Error::Limit { what: "triangles", needed, allowed });
        }
        let mut largest = 0.0f64;
        for (t, &v) in
            mesh.triangles.iter().enumerate().flat_map(|(t, triangle)| triangle.iter().map(move |v| (t, v)))
        {
            let Some(position) = mesh.positions.get(v as usize) else {
                return Err(Error::Parameter(format!("triangle {t} names vertex {v}, which does not exist")));
            };
            if !position.iter().all(|x| x.is_finite()) {
                return Err(Error::Parameter(format!(
                    "vertex {v} has a coordinate that is no finite number"
                )));
            }
            largest = position.iter().fold(largest, |most, x| most.max(x.abs()));
        }
        // So that products of six lengths are numbers; a power of 2 changes no digit.
        let scale =
            if largest == 0.0 || (1e-30..1e30).contains(&largest) { 1.0 } else { power_below(largest) };
        let positions = mesh.positions.iter().map(|p| p.map(|x| x * scale)).collect();
        let mut working = Self {
            positions,
            triangles: mesh.triangles.clone(),
            living: given,
            flags: vec![0; mesh.positions.len()],
            rings: Rings::default(),
            wedges: None,
            parents: with_parents.then(|| Parents::new(mesh.positions.len())),
            scale,
        };
        // Which triangles these are: by their vertices that is not to be told.
        let mut origins: Vec<u32> = Vec::new();
        for triangle in &mut working.triangles {
            let [a, b, c] = *triangle;
            if a == b || b == c || c == a {
                *triangle = GONE;
                working.living -= 1;
            }
        }
        let degenerate_triangles = given - working.living;
        let isolated_vertices = isolated(mesh);
        if with_attributes {
            let is_there = |(_, triangle): &(u32, &[u32; 3])| **triangle != GONE;
            origins.extend((0..).zip(&working.triangles).filter(is_there).map(|(t, _)| t));
        }
        let repeated_triangles = working.mark_repeated();
        if with_attributes {
            let mut there = working.triangles.iter().map(|triangle| *triangle != GONE);
            origins.retain(|_| there.next().unwrap_or(false));
        }
        working.compact();
        if with_attributes {
            working.rings.rebuild(working.positions.len(), &working.triangles);
            let Self { positions, triangles, rings, .. } = &working;
            working.wedges = Some(Wedges::new(mesh, positions, triangles, origins, rings));
        }
        Ok((working, LeftOut { degenerate_triangles, repeated_triangles, isolated_vertices }))
    }

    /// Flags the vertices that stay, and leaves the rings behind: those round which the triangles are no single fan, unless the topology
    /// is `free`, and those of the boundary, if that is `locked`.
    pub(super) fn fix(&mut self, is_free: bool, is_locked: bool) {
        self.rings.rebuild(self.positions.len(), &self.triangles);
        if is_free && !is_locked {
            return;
        }
        let mut star = Star::default();
        for v in 0..self.positions.len() as u32 {
            if is_closed_fan(v, self.rings.of(v), &self.triangles) {
                continue;
            }
            star.gather(v, self.rings.of(v), &self.triangles, &self.positions, self.positions[v as usize]);
            if !is_free && !star.is_manifold() || is_locked && star.is_boundary() {
                self.flags[v as usize] |= FIXED;
            }
        }
    }

    /// Gives up triangles that are gone, and vertices in no other one; all numbers change, their order does not.
    pub(super) fn compact(&mut self) {
        self.drop_gone();
        debug_assert_eq!(self.triangles.len(), self.living);
        self.rings.rebuild(self.positions.len(), &[]);
        let map = self.rings.as_map();
        for &v in self.triangles.as_flattened() {
            map[v as usize] = 0;
        }
        let mut count = 0;
        for (v, place) in map.iter_mut().enumerate().filter(|(_, place)| **place == 0) {
            *place = count;
            self.positions[count as usize] = self.positions[v];
            self.flags[count as usize] = self.flags[v] & FIXED;
            count += 1;
        }
        for v in self.triangles.as_flattened_mut() {
            *v = map[*v as usize];
        }
        self.positions.truncate(count as usize);
        self.flags.truncate(count as usize);
        if let Some(parents) = &mut self.parents {
            parents.renumber(count as usize, |v| map.get(v as usize).copied().unwrap_or(NO_VERTEX));
        }
    }

    /// The power of 2 that the positions were multiplied with.
    pub(super) fn scale(&self) -> f64 {
        self.scale
    }

    /// Gives up triangles that are gone.
    pub(super) fn drop_gone(&mut self) {
        if let Some(wedges) = &mut self.wedges {
            wedges.retain(|t| self.triangles[t] != GONE);
        }
        self.triangles.retain(|triangle| *triangle != GONE);
    }

    /// The mesh as it is now, with what `given` has beside triangles, and for each of its vertices the one that stands for it, if that is known.
    pub(super) fn into_mesh(mut self, given: &IndexedMesh) -> (IndexedMesh, Vec<u32>) {
        self.compact();
        let back = self.scale.recip();
        self.positions.iter_mut().flatten().for_each(|x| *x *= back);
        let mut mesh = IndexedMesh::new(self.positions, self.triangles);
        if let Some(wedges) = self.wedges {
            mesh.attributes = wedges.attributes(&given.attributes);
            mesh.part_names.clone_from(&given.part_names);
            mesh.libraries.clone_from(&given.libraries);
        }
        (mesh, self.parents.map(Parents::finish).unwrap_or_default())
    }

    /// Marks the triangles with the same three vertices, each another one, as an earlier one as gone, and counts them.
    pub(super) fn mark_repeated(&mut self) -> usize {
        self.drop_gone();
        self.rings.rebuild(self.positions.len(), &self.triangles);
        let mut others: Vec<([u32; 2], u32)> = Vec::new();
        let before = self.living;
        for v in 0..self.positions.len() as u32 {
            others.clear();
            for &t in self.rings.of(v) {
                // Each at the least of its vertices.
                if let Some([a, b]) = turned(self.triangles[t as usize], v)
                    && v < a.min(b)
                {
                    others.push(([a.min(b), a.max(b)], t));
                }
            }
            if others.len() > 1 {
                others.sort_unstable();
            }
            for pair in others.windows(2).filter(|pair| pair[0].0 == pair[1].0) {
                self.triangles[pair[1].1 as usize] = GONE;
                self.living -= 1;
            }
        }
        before - self.living
    }
}

/// How many vertices no triangle has.
fn isolated(mesh: &IndexedMesh) -> usize {
    let mut used = vec![false; mesh.positions.len()];
    mesh.triangles.as_flattened().iter().for_each(|&v| used[v as usize] = true);
    used.iter().filter(|&&used| !used).count()
}

/// The power of 2 that brings a positive number near 1, as far as there is one.
fn power_below(x: f64) -> f64 {
    2f64.powi(-(x.log2().floor().clamp(-1000.0, 1000.0) as i32))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes;

    #[test]
    fn what_is_of_no_use_is_left_out_and_counted() {
        let mut mesh = shapes::sphere(1);
        let clean = mesh.clone();
        let [a, b, c] = mesh.triangles[0];
        mesh.triangles.extend([[b, c, a], [a, c, b], [a, a, b]]);
        mesh.positions.push([f64::NAN; 3]);
        let (working, left_out) = Working::new(&mesh, false, false).unwrap();
        assert_eq!(
            left_out,
            LeftOut { degenerate_triangles: 1, repeated_triangles: 2, isolated_vertices: 1 }
        );
        assert_eq!(working.into_mesh(&mesh).0, clean);
    }

    #[test]
    fn what_is_no_mesh_is_refused() {
        let with = |value: f64, last: u32| {
            IndexedMesh::new(vec![[0.0; 3], [1.0; 3], [value, 0.0, 0.0]], vec![[0, 1, 2], [0, 1, last]])
        };
        for mesh in [with(f64::NAN, 2), with(f64::INFINITY, 2), with(2.0, 3)] {
            assert!(matches!(Working::new(&mesh, false, false), Err(Error::Parameter(_))));
        }
        assert!(
            Working::new(&IndexedMesh::default(), false, false)
                .unwrap()
                .0
                .into_mesh(&IndexedMesh::default())
                .0
                .triangles
                .is_empty()
        );
    }

    #[test]
    fn scaling_changes_no_digit() {
        for factor in [1e300, 1e-300, 3.0e40, 1.0] {
            let mut mesh = shapes::sphere(1);
            mesh.positions.iter_mut().flatten().for_each(|x| *x *= factor);
            let (working, _) = Working::new(&mesh, false, false).unwrap();
            assert!(working.positions.iter().flatten().all(|x| x.abs() < 4.0));
            assert_eq!(working.into_mesh(&mesh).0, mesh);
        }
    }

    #[test]
    fn vertices_that_are_no_manifold_are_fixed() {
        // Two tetrahedra that share a vertex.
        let mut mesh = shapes::tetrahedron();
        mesh.positions.extend(shapes::tetrahedron().positions[1..].iter().map(|p| p.map(|x| x + 9.0)));
        mesh.triangles.extend(
            shapes::tetrahedron().triangles.iter().map(|t| t.map(|v| if v == 0 { 0 } else { v + 3 })),
        );
        let (mut working, _) = Working::new(&mesh, false, false).unwrap();
        working.fix(true, true);
        assert_eq!(working.flags, [0; 7]);
        working.fix(false, false);
        assert_eq!(working.flags, [FIXED, 0, 0, 0, 0, 0, 0]);
    }
}
