//! The indexed face set: what comes in from a foreign file and what goes out again.

use std::collections::BTreeSet;

/// Values attached to corners, such as texture coordinates, normals or colours.
///
/// Corners that share an index share a wedge.
/// They are carried in memory; a file does not keep them yet: see [`IndexedMesh::uncoded`].
#[derive(Clone, Debug, PartialEq)]
pub struct CornerAttribute {
    /// What the values are, e.g. `"uv"`, `"normal"`, `"colour"`.
    pub name: String,
    /// Components a value, at least 1.
    pub components: usize,
    /// `components` numbers a value.
    pub values: Vec<f64>,
    /// One index into the values for each corner, three a triangle; `u32::MAX` where a corner has none.
    pub corners: Vec<u32>,
}

/// A triangle mesh as lists of positions and index triples; nothing is assumed about its topology.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct IndexedMesh {
    /// Vertex positions, in the units of the file.
    pub positions: Vec<[f64; 3]>,
    /// Counter-clockwise vertex indices, each below `positions.len()`.
    pub triangles: Vec<[u32; 3]>,
    /// Per-corner attributes; empty where the source has none.
    pub attributes: Vec<CornerAttribute>,
    /// Material of each triangle, or empty.
    pub materials: Vec<u32>,
}

impl IndexedMesh {
    /// A mesh of positions and triangles alone.
    pub fn new(positions: Vec<[f64; 3]>, triangles: Vec<[u32; 3]>) -> Self {
        Self { positions, triangles, attributes: Vec::new(), materials: Vec::new() }
    }

    /// What the mesh has beside positions and triangles, which no file keeps yet, in words for the user, e.g.
    /// `"normal (3 numbers, 24 values)"` and `"materials (2)"`.
    pub fn uncoded(&self) -> Vec<String> {
        let named = |attribute: &CornerAttribute| {
            let values = attribute.values.len() / attribute.components.max(1);
            format!("{} ({} numbers, {values} values)", attribute.name, attribute.components)
        };
        let mut uncoded: Vec<String> = self.attributes.iter().map(named).collect();
        let materials: BTreeSet<u32> = self.materials.iter().copied().collect();
        if !materials.is_empty() {
            uncoded.push(format!("materials ({})", materials.len()));
        }
        uncoded
    }

    /// The diagonal of the bounding box of the vertices that triangles use; 0 where there are none.
    pub fn diagonal(&self) -> f64 {
        let corners = self.triangles.iter().flatten().map(|&v| self.positions[v as usize]);
        match super::lattice::bounds(corners) {
            Some((min, max)) => {
                let d = [max[0] - min[0], max[1] - min[1], max[2] - min[2]];
                (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt()
            }
            None => 0.0,
        }
    }
}
