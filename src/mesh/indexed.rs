//! The indexed face set: what comes in from a foreign file and what goes out again.

use std::ops::Range;

use super::attributes::Attribute;

/// A triangle mesh as lists of positions and index triples; nothing is assumed about its topology.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct IndexedMesh {
    /// Vertex positions, in the units of the file.
    pub positions: Vec<[f64; 3]>,
    /// Counter-clockwise vertex indices, each below `positions.len()`.
    pub triangles: Vec<[u32; 3]>,
    /// What else it has, at corners or triangles; empty where the source has nothing else.
    pub attributes: Vec<Attribute>,
    /// Names of its parts, by number ([`Semantic::Part`](super::attributes::Semantic::Part)); parts beyond the list have none.
    pub part_names: Vec<String>,
    /// Files that say what its materials look like, as the source names them.
    pub libraries: Vec<String>,
    /// The first vertex of each body, ascending from 0; empty where all is one. Vertices of two bodies are two, wherever they are: meshes
    /// of a scene lie over each other, each in coordinates of its own.
    pub bodies: Vec<u32>,
}

impl IndexedMesh {
    /// A mesh of positions and triangles alone.
    pub fn new(positions: Vec<[f64; 3]>, triangles: Vec<[u32; 3]>) -> Self {
        Self { positions, triangles, ..Self::default() }
    }

    /// What the mesh has beside positions and triangles, which is lost where it is given other triangles; in words for the user, e.g.
    /// `"normal (3 numbers, 24 values)"`.
    pub fn uncoded(&self) -> Vec<String> {
        let named = |attribute: &Attribute| {
            format!("{} ({} numbers, {} values)", attribute.title(), attribute.components, attribute.count())
        };
        self.attributes.iter().map(named).collect()
    }

    /// The vertices of each body; those of a mesh that tells of none are one body.
    pub fn body_vertices(&self) -> impl Iterator<Item = Range<usize>> + '_ {
        let count = self.positions.len();
        let firsts =
            self.bodies.iter().map(move |&first| (first as usize).min(count)).filter(|&first| first > 0);
        let mut from = 0;
        firsts.chain([count]).map(move |to| {
            let range = from..to.max(from);
            from = range.end;
            range
        })
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
