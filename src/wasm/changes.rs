//! Typed arrays of what has changed, and the marks they are gathered from.

use bitvec::vec::BitVec;

/// What has changed in the mesh: appended vertices and triangles, and single ones of those that were there.
///
/// Positions and normals are three numbers a vertex, indices three a triangle. Where `first_vertex` and `first_triangle` are 0,
/// everything is new.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Changes {
    /// Vertices and triangles of the whole mesh now.
    pub counts: [u32; 2],
    /// The first vertex appended; all from it on are.
    pub first_vertex: u32,
    /// Positions of the vertices appended.
    pub positions: Vec<f32>,
    /// Where they lay on the surface before: the middle of the edge that was split, or of the triangle.
    pub from: Vec<f32>,
    /// Their normals, of length 1, or 0 where there is none.
    pub normals: Vec<f32>,
    /// Vertices moved, each once.
    pub moved: Vec<u32>,
    /// Their positions.
    pub moved_positions: Vec<f32>,
    /// Vertices whose triangles have changed, each once.
    pub turned: Vec<u32>,
    /// Their normals.
    pub turned_normals: Vec<f32>,
    /// The first triangle appended; all from it on are.
    pub first_triangle: u32,
    /// Vertices of the triangles appended.
    pub indices: Vec<u32>,
    /// Triangles rewritten, each once.
    pub rewritten: Vec<u32>,
    /// Their vertices.
    pub rewritten_indices: Vec<u32>,
    /// How far the surface is at most from what it was, while the vertices appended still lie where they began; in the units of the
    /// input. 0 where that was not to be told.
    pub jump: f32,
}

/// A set of numbers that keeps the order in which they came.
#[derive(Clone, Debug, Default)]
pub struct Marks {
    list: Vec<u32>,
    there: BitVec,
}

impl Marks {
    pub fn add(&mut self, number: u32) {
        let place = number as usize;
        if place >= self.there.len() {
            self.there.resize(place + 1, false);
        }
        if !self.there.replace(place, true) {
            self.list.push(number);
        }
    }

    pub fn list(&self) -> &[u32] {
        &self.list
    }

    pub fn clear(&mut self) {
        for number in self.list.drain(..) {
            self.there.set(number as usize, false);
        }
    }
}
