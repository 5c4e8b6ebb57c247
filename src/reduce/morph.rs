//! From a fine level to a coarse one without a jump (Zhou, Zhang, Shi and Pan's octree paper, §5): vertices move to those that stand for them.
//!
//! Where a simplifier told which vertex stands for which, these are the pairs, and the way ends at the coarse mesh. Of two meshes of which
//! nothing is known, each coarse vertex has the nearest fine one, the nearest pairs first and each but once; every other fine vertex goes to
//! the nearest point of the coarse surface, or to the nearest coarse vertex, as the paper has it.

use super::NO_VERTEX;
use crate::error::{Error, Result};
use crate::mesh::IndexedMesh;
use crate::mesh::attributes::Domain;
use crate::mesh::distance::NearestPoints;
use std::collections::HashSet;
use std::num::NonZeroUsize;

/// Where vertices without a partner of their own go.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Pairs {
    /// To the nearest point of the coarse surface: at the end all triangles are there, on it.
    #[default]
    Surface,
    /// To the nearest coarse vertex: at the end triangles have gone.
    Vertices,
}

/// Where each vertex of a fine mesh goes.
#[derive(Clone, Debug)]
pub struct Morph {
    targets: Vec<[f64; 3]>,
    /// For each fine vertex the coarse one that it becomes, or [`NO_VERTEX`].
    parents: Vec<u32>,
    /// Whether these are the simplifier's.
    is_known: bool,
    /// Coarse vertices that no fine one becomes.
    pub left_over: usize,
}

impl Morph {
    /// By the vertices that stand for the fine ones, as [`Reduced::parents`](super::Reduced::parents) tells them. A vertex for which none does
    /// stays in its place, and its triangles are not there at the end.
    ///
    /// # Errors
    /// [`Error::Parameter`] where there are not as many as fine vertices, or one names a coarse vertex that does not exist.
    pub fn by_parents(fine: &IndexedMesh, coarse: &IndexedMesh, parents: Vec<u32>) -> Result<Self> {
        let (there, wanted, most) = (parents.len(), fine.positions.len(), coarse.positions.len());
        if there != wanted {
            return Err(Error::Parameter(format!("{there} parents for {wanted} vertices")));
        }
        let mut is_reached = vec![false; most];
        let mut targets = fine.positions.clone();
        for (v, (&parent, target)) in parents.iter().zip(&mut targets).enumerate() {
            match coarse.positions.get(parent as usize) {
                Some(place) => {
                    is_reached[parent as usize] = true;
                    *target = *place;
                }
                None if parent == NO_VERTEX => {}
                None => {
                    return Err(Error::Parameter(format!("vertex {v} has the parent {parent} of {most}")));
                }
            }
        }
        let left_over = is_reached.iter().filter(|reached| !**reached).count();
        Ok(Self { targets, parents, is_known: true, left_over })
    }

    /// By what is nearest, for meshes of which nothing else is known.
    ///
    /// # Errors
    /// [`Error::Parameter`] where one of them has no triangle, names a vertex that does not exist, or has a coordinate that is no finite number.
    pub fn by_distance(
        fine: &IndexedMesh,
        coarse: &IndexedMesh,
        pairs: Pairs,
        threads: NonZeroUsize,
    ) -> Result<Self> {
        [fine, coarse].into_iter().try_for_each(check)?;
        let empty = || Error::Parameter("a mesh has no triangle".to_owned());
        let [fine_points, coarse_points] = [fine, coarse].map(points);
        let mut to_fine = NearestPoints::new(&fine_points, coarse, threads).ok_or_else(empty)?;
        let mut to_coarse = NearestPoints::new(&coarse_points, fine, threads).ok_or_else(empty)?;
        // A point's number among the points, as a vertex.
        let vertex = |points: &IndexedMesh, at: u32| points.triangles[at as usize][0];
        let mut candidates: Vec<(f64, u32, u32)> = Vec::with_capacity(coarse_points.triangles.len());
        for &[v, ..] in &coarse_points.triangles {
            let found = to_fine.nearest(coarse.positions[v as usize]);
            candidates.push((found.distance, vertex(&fine_points, found.triangle), v));
        }
        candidates.sort_by(|x, y| x.0.total_cmp(&y.0).then((x.1, x.2).cmp(&(y.1, y.2))));
        let mut parents = vec![NO_VERTEX; fine.positions.len()];
        let mut left_over = 0;
        for (_, fine_vertex, v) in candidates {
            match &mut parents[fine_vertex as usize] {
                parent @ &mut NO_VERTEX => *parent = v,
                _ => left_over += 1,
            }
        }
        let mut targets = fine.positions.clone();
        let mut surface = NearestPoints::new(coarse, fine, threads).ok_or_else(empty)?;
        for &[v, ..] in &fine_points.triangles {
            let (parent, target) = (&mut parents[v as usize], &mut targets[v as usize]);
            if *parent == NO_VERTEX && pairs == Pairs::Vertices {
                *parent = vertex(&coarse_points, to_coarse.nearest(*target).triangle);
            }
            *target = match coarse.positions.get(*parent as usize) {
                Some(place) => *place,
                None => {
                    let found = surface.nearest(*target);
                    let corners =
                        coarse.triangles[found.triangle as usize].map(|v| coarse.positions[v as usize]);
                    std::array::from_fn(|k| (0..3).map(|i| corners[i][k] * found.shares[i]).sum())
                }
            };
        }
        Ok(Self { targets, parents, is_known: false, left_over })
    }

    /// The mesh on the way: at 0 the fine one, at 1 the coarse one, as far as pairs are known. It has the attributes of the fine one
    /// throughout.
    pub fn at(&self, fine: &IndexedMesh, coarse: &IndexedMesh, t: f64) -> IndexedMesh {
        if t < 1.0 {
            let between = |(&from, &to): (&[f64; 3], &[f64; 3])| match t > 0.0 {
                true => std::array::from_fn(|k| from[k] + (to[k] - from[k]) * t),
                false => from,
            };
            let positions = fine.positions.iter().zip(&self.targets).map(between).collect();
            return IndexedMesh { positions, ..fine.clone() };
        }
        if !self.is_known && self.parents.contains(&NO_VERTEX) {
            return IndexedMesh { positions: self.targets.clone(), ..fine.clone() };
        }
        let wanted: HashSet<[u32; 3]> = coarse.triangles.iter().map(|&t| turned(t)).collect();
        let mut seen = HashSet::new();
        let mut mesh =
            IndexedMesh { positions: coarse.positions.clone(), bodies: Vec::new(), ..fine.clone() };
        mesh.triangles.iter_mut().flatten().for_each(|v| *v = self.parents[*v as usize]);
        let stays = |t: &[u32; 3]| {
            let [a, b, c] = turned(*t);
            let is_there = a != b && b != c && c != a && c != NO_VERTEX && b != NO_VERTEX;
            is_there && (!self.is_known || wanted.contains(&[a, b, c])) && seen.insert([a, b, c])
        };
        let stays: Vec<bool> = mesh.triangles.iter().map(stays).collect();
        let mut flags = stays.iter();
        mesh.triangles.retain(|_| *flags.next().unwrap_or(&false));
        for attribute in &mut mesh.attributes {
            let each = if attribute.domain == Domain::Corner { 3 } else { 1 };
            let mut at = 0;
            attribute.corners.retain(|_| {
                at += 1;
                stays[(at - 1) / each]
            });
        }
        mesh
    }
}

/// A triangle from its least vertex on.
fn turned(t: [u32; 3]) -> [u32; 3] {
    let least = (0..3).min_by_key(|&k| t[k]).unwrap_or(0);
    [t[least], t[(least + 1) % 3], t[(least + 2) % 3]]
}

/// The vertices that triangles have, as triangles of no extent.
fn points(mesh: &IndexedMesh) -> IndexedMesh {
    let mut used = vec![false; mesh.positions.len()];
    mesh.triangles.as_flattened().iter().for_each(|&v| used[v as usize] = true);
    let of = |v: u32| used[v as usize].then_some([v; 3]);
    IndexedMesh::new(mesh.positions.clone(), (0..mesh.positions.len() as u32).filter_map(of).collect())
}

fn check(mesh: &IndexedMesh) -> Result<()> {
    for &v in mesh.triangles.as_flattened() {
        match mesh.positions.get(v as usize) {
            Some(p) if p.iter().all(|x| x.is_finite()) => {}
            Some(_) => {
                return Err(Error::Parameter(format!(
                    "vertex {v} has a coordinate that is no finite number"
                )));
            }
            None => return Err(Error::Parameter(format!("there is no vertex {v}"))),
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::tests::{ALL, reduced};
    use super::super::{Options, Reduced};
    use super::*;
    use crate::mesh::shapes;
    use std::collections::BTreeSet;

    fn triangles(mesh: &IndexedMesh) -> BTreeSet<[[u64; 3]; 3]> {
        let bits = |v: u32| mesh.positions[v as usize].map(f64::to_bits);
        let of = |t: &[u32; 3]| {
            let mut corners = t.map(bits);
            let least = (0..3).min_by_key(|&k| corners[k]).unwrap_or(0);
            corners.rotate_left(least);
            corners
        };
        mesh.triangles.iter().map(of).collect()
    }

    #[test]
    fn by_parents_it_goes_from_the_one_to_the_other() {
        for mesh in [shapes::bumpy_sphere(3, 2), shapes::torus_with_hole(20, 12)] {
            for method in ALL {
                let options = Options { method, parents: true, ..Options::default() };
                let Reduced { mesh: coarse, parents, .. } = reduced(&mesh, 80, &options);
                let morph = Morph::by_parents(&mesh, &coarse, parents).unwrap();
                assert_eq!(morph.left_over, 0);
                assert_eq!(morph.at(&mesh, &coarse, 0.0), mesh);
                assert_eq!(triangles(&morph.at(&mesh, &coarse, 1.0)), triangles(&coarse), "{method:?}");
                let half = morph.at(&mesh, &coarse, 0.5);
                let middle = |v: usize| 0.5 * (mesh.positions[v][0] + morph.targets[v][0]);
                assert!((0..mesh.positions.len()).all(|v| (half.positions[v][0] - middle(v)).abs() < 1e-12));
            }
        }
    }

    #[test]
    fn by_distance_every_coarse_vertex_has_one_of_its_own_or_is_told() {
        let (fine, coarse) = (shapes::sphere(3), shapes::sphere(1));
        // The coarse sphere's vertices are some of the fine one's.
        for pairs in [Pairs::Surface, Pairs::Vertices] {
            let morph = Morph::by_distance(&fine, &coarse, pairs, NonZeroUsize::MIN).unwrap();
            assert_eq!(morph.left_over, 0);
            assert_eq!(morph.at(&fine, &coarse, 0.0), fine);
            let end = morph.at(&fine, &coarse, 1.0);
            if pairs == Pairs::Vertices {
                assert_eq!(end.positions, coarse.positions);
                assert!((60..600).contains(&end.triangles.len()), "{}", end.triangles.len());
                assert!(end.triangles.iter().all(|&[a, b, c]| a != b && b != c && c != a));
            } else {
                assert_eq!(end.triangles, fine.triangles);
                let off = crate::mesh::distance::surface_distance(&end, &coarse, 100, 1).unwrap();
                assert!(off.max < 1.0, "{off:?}");
                let mut on = NearestPoints::new(&coarse, &end, NonZeroUsize::MIN).unwrap();
                assert!(end.positions.iter().all(|&p| on.nearest(p).distance < 1e-12));
            }
        }
        // Two coarse vertices that are nearest to the same fine one.
        let mut twice = coarse.clone();
        twice.positions.push(coarse.positions[0]);
        twice.triangles[0] =
            twice.triangles[0].map(|v| if v == 0 { coarse.positions.len() as u32 } else { v });
        let morph = Morph::by_distance(&fine, &twice, Pairs::Vertices, NonZeroUsize::MIN).unwrap();
        assert!(morph.left_over <= 1);
    }

    #[test]
    fn what_does_not_fit_is_refused() {
        let (fine, coarse) = (shapes::sphere(2), shapes::sphere(1));
        let count = fine.positions.len();
        for parents in [vec![0; count - 1], vec![coarse.positions.len() as u32; count]] {
            assert!(matches!(Morph::by_parents(&fine, &coarse, parents), Err(Error::Parameter(_))));
        }
        let none = IndexedMesh::default();
        let bad = IndexedMesh::new(vec![[f64::NAN; 3]; 3], vec![[0, 1, 2]]);
        for (fine, coarse) in [(&fine, &none), (&none, &coarse), (&bad, &coarse), (&fine, &bad)] {
            let made = Morph::by_distance(fine, coarse, Pairs::Surface, NonZeroUsize::MIN);
            assert!(matches!(made, Err(Error::Parameter(_))));
        }
        let all_gone = Morph::by_parents(&fine, &coarse, vec![NO_VERTEX; count]).unwrap();
        assert!(all_gone.at(&fine, &coarse, 1.0).triangles.is_empty());
    }
}
