//! Chapters 13.3 and 13.7: the attributes of a whole mesh.

use std::collections::{BTreeMap, BTreeSet};

use super::attributes::{Attributes, name};
use super::column::{Column, Place};
use super::container::Result;
use super::entropy::Code;
use super::round::{Models, Vertex};
use super::walk::{Edge, Mesh, Walk};

/// The models of a pass, and what it tells.
pub struct Pass {
    told: Vec<usize>,
    pub models: Models,
}

impl Pass {
    pub fn fresh(attributes: &Attributes, told: &[usize]) -> Self {
        Self { told: told.to_vec(), models: Models::fresh(&attributes.about) }
    }

    /// The vertices, of which those told are alive from now on.
    pub fn vertices(
        &mut self,
        code: &mut Code,
        attributes: &mut Attributes,
        mesh: &Mesh,
        walk: &Walk,
    ) -> Result<()> {
        let before = attributes.of_corners();
        self.told.iter().for_each(|&k| attributes.alive[k] = true);
        let told: Vec<usize> =
            self.told.iter().copied().filter(|&k| !attributes.is_of_triangles(k)).collect();
        if told.is_empty() {
            return Ok(());
        }
        let listed = listed(mesh, walk);
        let mut met = BTreeSet::new();
        for v in walk.vertices(mesh) {
            let vertex = Vertex { mesh, corners: fan(mesh, &listed[v]), before: &before, told: &told };
            self.models.vertex(code, attributes, vertex, &|w| met.contains(&w))?;
            met.insert(v);
        }
        Ok(())
    }

    /// §13.7: the triangles of the walk, of an attribute.
    pub fn triangles(
        &mut self,
        code: &mut Code,
        attributes: &mut Attributes,
        mesh: &Mesh,
        walk: &Walk,
        k: usize,
    ) -> Result<()> {
        let mut told = BTreeMap::new();
        let mut last = None;
        for &c in &walk.triangles {
            let behind = mesh.opposite(c).and_then(|o| told.get(&name(mesh.triangle(o))));
            let value = read_own(code, &mut self.models.columns[k], mesh, behind.or(last.as_ref()))?;
            told.insert(name(mesh.triangle(c)), value.clone());
            last = Some(value);
        }
        attributes.of_triangles[k] = told;
        Ok(())
    }
}

/// The value of a triangle.
pub fn read_own(
    code: &mut Code,
    column: &mut Column,
    mesh: &Mesh,
    p: Option<&super::numbers::Value>,
) -> Result<super::numbers::Value> {
    let place = Place { mesh, of: &BTreeMap::new(), values: &BTreeMap::new(), corners: &[] };
    column.read(code, &place, None, p)
}

/// For each vertex its corners as the walk comes to them.
pub fn listed(mesh: &Mesh, walk: &Walk) -> Vec<Vec<Edge>> {
    let mut listed = vec![vec![]; mesh.points.len()];
    for c in walk.triangles.iter().flat_map(|&c| [mesh.next(c), mesh.prev(c), c]) {
        listed[mesh.tip(c)].push(c);
    }
    listed
}

/// The corners round a vertex, of its corners as they are listed: of an inner one from the first on.
pub fn fan(mesh: &Mesh, at: &[Edge]) -> Vec<Edge> {
    let leaves = |&&c: &&Edge| mesh.opposite(mesh.prev(c)).is_none();
    let first = *at.iter().find(leaves).unwrap_or(&at[0]);
    let mut corners = vec![first];
    while let Some(o) = mesh.opposite(mesh.next(corners[corners.len() - 1])) {
        if mesh.next(o) == first {
            break;
        }
        corners.push(mesh.next(o));
    }
    corners
}
