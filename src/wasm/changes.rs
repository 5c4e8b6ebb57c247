//! Typed arrays of what has changed, and the marks they are gathered from.

use super::corners::Corners;
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
    /// What is new of the attributes that are alive.
    pub corners: Corners,
}

/// A field of [`Changes`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Field<'a> {
    /// A count or a number.
    Number(u32),
    /// A length.
    Length(f32),
    /// Numbers of vertices or triangles.
    Numbers(&'a [u32]),
    /// Coordinates.
    Coordinates(&'a [f32]),
    /// Bytes.
    Bytes(&'a [u8]),
}

impl Field<'_> {
    /// Its type in few letters: `u32`, `f32`, `u32[]`, `f32[]` or `u8[]`.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Number(_) => "u32",
            Self::Length(_) => "f32",
            Self::Numbers(_) => "u32[]",
            Self::Coordinates(_) => "f32[]",
            Self::Bytes(_) => "u8[]",
        }
    }
}

impl Changes {
    /// All fields in order, by the names that a page has for them. There is no other list: a page asks for this one.
    pub fn fields(&self) -> [(&'static str, Field<'_>); 22] {
        use Field::{Bytes, Coordinates, Length, Number, Numbers};
        [
            ("vertices", Number(self.counts[0])),
            ("triangles", Number(self.counts[1])),
            ("firstVertex", Number(self.first_vertex)),
            ("firstTriangle", Number(self.first_triangle)),
            ("positions", Coordinates(&self.positions)),
            ("from", Coordinates(&self.from)),
            ("normals", Coordinates(&self.normals)),
            ("moved", Numbers(&self.moved)),
            ("movedPositions", Coordinates(&self.moved_positions)),
            ("turned", Numbers(&self.turned)),
            ("turnedNormals", Coordinates(&self.turned_normals)),
            ("indices", Numbers(&self.indices)),
            ("rewritten", Numbers(&self.rewritten)),
            ("rewrittenIndices", Numbers(&self.rewritten_indices)),
            ("jump", Length(self.jump)),
            ("alive", Numbers(&self.corners.alive)),
            ("firstTold", Number(self.corners.first_triangle)),
            ("firstWedge", Number(self.corners.first_wedge)),
            ("wedges", Numbers(&self.corners.vertices)),
            ("wedgeIndices", Numbers(&self.corners.indices)),
            ("rewrittenWedges", Numbers(&self.corners.rewritten)),
            ("values", Bytes(&self.corners.values)),
        ]
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Each field told is the field that is named: twenty-two values that differ.
    #[test]
    fn names_lead_to_their_fields() {
        let changes = Changes {
            counts: [1, 2],
            first_vertex: 3,
            positions: vec![4.0],
            from: vec![5.0],
            normals: vec![6.0],
            moved: vec![7],
            moved_positions: vec![8.0],
            turned: vec![9],
            turned_normals: vec![10.0],
            first_triangle: 11,
            indices: vec![12],
            rewritten: vec![13],
            rewritten_indices: vec![14],
            jump: 15.0,
            corners: Corners {
                vertices: vec![16],
                indices: vec![17],
                values: vec![18],
                alive: vec![19],
                first_triangle: 20,
                first_wedge: 21,
                rewritten: vec![22],
            },
        };
        let told = changes.fields().map(|(name, field)| match field {
            Field::Number(x) => (name, x),
            Field::Length(x) => (name, x as u32),
            Field::Numbers(x) => (name, x[0]),
            Field::Coordinates(x) => (name, x[0] as u32),
            Field::Bytes(x) => (name, x[0].into()),
        });
        let expected = [
            ("alive", 19),
            ("firstTold", 20),
            ("firstTriangle", 11),
            ("firstWedge", 21),
            ("firstVertex", 3),
            ("from", 5),
            ("indices", 12),
            ("jump", 15),
            ("moved", 7),
            ("movedPositions", 8),
            ("normals", 6),
            ("positions", 4),
            ("rewritten", 13),
            ("rewrittenIndices", 14),
            ("rewrittenWedges", 22),
            ("triangles", 2),
            ("turned", 9),
            ("turnedNormals", 10),
            ("values", 18),
            ("vertices", 1),
            ("wedgeIndices", 17),
            ("wedges", 16),
        ];
        assert_eq!(std::collections::BTreeMap::from(told), std::collections::BTreeMap::from(expected));
    }
}
