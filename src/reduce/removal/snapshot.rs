//! The mesh at the beginning of an iteration, which every decision of the iteration looks at, and none changes.

use super::integer::Point;
use crate::reduce::rings::Rings;
use crate::reduce::star::turned;

/// The mesh and what is known of its vertices.
#[derive(Clone, Copy, Debug)]
pub(super) struct Snapshot<'a> {
    pub(super) points: &'a [Point],
    pub(super) triangles: &'a [[u32; 3]],
    pub(super) rings: &'a Rings,
    /// Vertices that are to be removed; all others stay, or are gone already and in no triangle.
    pub(super) selected: &'a [bool],
    pub(super) auxiliary: &'a [bool],
    pub(super) boundary: &'a [bool],
}

impl<'a> Snapshot<'a> {
    /// The corners of the triangles round a vertex, each several times, the vertex itself among them.
    pub(super) fn corners(&self, v: u32) -> impl Iterator<Item = u32> + use<'a> {
        let triangles = self.triangles;
        self.rings.of(v).iter().flat_map(move |&t| triangles[t as usize])
    }
}

/// A vertex at the other end of an edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Neighbour {
    pub(super) vertex: u32,
    /// Triangles at the edge: 1 at the boundary, 2 within.
    pub(super) triangles: u32,
}

/// The triangles round a vertex; nothing depends on their order.
#[derive(Debug, Default)]
pub(super) struct Fan {
    pub(super) vertex: u32,
    /// The other two corners of each triangle, counter-clockwise.
    pub(super) wings: Vec<[u32; 2]>,
    pub(super) neighbours: Vec<Neighbour>,
}

impl Fan {
    /// Gathers the triangles round a vertex.
    pub(super) fn gather(&mut self, v: u32, snapshot: &Snapshot) {
        self.gather_wings(v, snapshot.triangles, snapshot.rings);
        self.neighbours.clear();
        for &vertex in self.wings.as_flattened() {
            match self.neighbours.iter_mut().find(|n| n.vertex == vertex) {
                Some(neighbour) => neighbour.triangles += 1,
                None => self.neighbours.push(Neighbour { vertex, triangles: 1 }),
            }
        }
    }

    /// Gathers no neighbours.
    pub(super) fn gather_wings(&mut self, v: u32, triangles: &[[u32; 3]], rings: &Rings) {
        self.vertex = v;
        self.wings.clear();
        self.wings.extend(rings.of(v).iter().filter_map(|&t| turned(triangles[t as usize], v)));
    }

    pub(super) fn has(&self, v: u32) -> bool {
        self.neighbours.iter().any(|n| n.vertex == v)
    }

    /// Whether the triangles are one sheet round the vertex, open or closed; `None` where they are none of both. A closed one of two
    /// triangles lies folded on itself.
    pub(super) fn shape(&self) -> Option<Shape> {
        let count = self.wings.len();
        if count == 0 || count > MAX_TRIANGLES {
            return None;
        }
        // With edges that begin in one triangle each at most, each triangle is followed by one at most.
        let mut first = None;
        for (k, [a, _]) in self.wings.iter().enumerate() {
            if self.wings[..k].iter().any(|[other, _]| other == a) {
                return None;
            }
            if !self.wings.iter().any(|[_, end]| end == a) && first.replace(k).is_some() {
                return None;
            }
        }
        let start = first.unwrap_or(0);
        let (mut at, mut seen) = (start, 1);
        loop {
            let end = self.wings[at][1];
            match self.wings.iter().position(|[a, _]| *a == end) {
                Some(next) if next == start => break,
                Some(next) if seen < count => (at, seen) = (next, seen + 1),
                Some(_) => return None,
                None => break,
            }
        }
        match first {
            _ if seen < count => None,
            Some(_) => Some(Shape::Open),
            None if count > 2 => Some(Shape::Closed),
            None => None,
        }
    }
}

/// What the triangles round a vertex are like.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Shape {
    /// The vertex is on the boundary.
    Open,
    Closed,
}

/// Vertices with more triangles than these stay, and so does all round them; no vertex comes to have more.
pub(super) const MAX_TRIANGLES: usize = 255;

#[cfg(test)]
mod tests {
    use super::*;

    fn shape(wings: &[[u32; 2]]) -> Option<Shape> {
        Fan { vertex: 0, wings: wings.to_vec(), neighbours: Vec::new() }.shape()
    }

    #[test]
    fn shapes() {
        use Shape::{Closed, Open};
        assert_eq!(shape(&[]), None);
        assert_eq!(shape(&[[1, 2]]), Some(Open));
        assert_eq!(shape(&[[2, 3], [1, 2]]), Some(Open));
        assert_eq!(shape(&[[2, 3], [3, 1], [1, 2]]), Some(Closed));
        // Folded on itself, twice the same, two sheets that share an edge or the vertex alone, against each other.
        assert_eq!(shape(&[[1, 2], [2, 1]]), None);
        assert_eq!(shape(&[[1, 2], [1, 2]]), None);
        assert_eq!(shape(&[[1, 2], [2, 3], [1, 4]]), None);
        assert_eq!(shape(&[[1, 2], [4, 2]]), None);
        assert_eq!(shape(&[[1, 2], [3, 4]]), None);
        assert_eq!(shape(&[[1, 2], [2, 3], [3, 1], [4, 5]]), None);
        assert_eq!(shape(&[[1, 2], [2, 3], [3, 1], [4, 5], [5, 6], [6, 4]]), None);
        assert_eq!(shape(&[[4, 1], [1, 2], [2, 3], [3, 1]]), None);
        let fan: Vec<[u32; 2]> = (0..300).map(|k| [k, k + 1]).collect();
        assert_eq!((shape(&fan[..255]), shape(&fan[..256])), (Some(Open), None));
    }
}
