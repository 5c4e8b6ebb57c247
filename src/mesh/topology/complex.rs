//! The middle steps of conditioning: triangles find their neighbours, turn the same way round, and part into fans.

use bitvec::vec::BitVec;

use crate::mesh::corner_table::sorted_edges;
use crate::mesh::index::{Corner, CornerMap, Triangle, Vertex};

/// Triangles joined across edges: a corner table to be, in which the triangles at a vertex may form several fans.
pub(super) struct Complex {
    /// V: the vertex of a corner, as welded.
    pub vertices: CornerMap<Vertex>,
    /// O: the corner across the edge, or `NONE` at the boundary and at cut edges.
    pub opposites: CornerMap<Corner>,
    /// Corners whose opposite edge is cut, by number.
    pub cut: BitVec,
}

impl Complex {
    /// Joins the triangles that are alone with each other at an edge, whatever their orientation. Cuts the edges with more
    /// triangles and returns their number.
    pub fn pair(vertices: CornerMap<Vertex>) -> (Self, usize) {
        let triangles = vertices.0.len();
        let mut opposites = CornerMap::new(Corner::NONE, triangles);
        let mut cut = BitVec::repeat(false, Triangle(triangles as u32).corner(0).index());
        let mut cut_edges = 0;
        for edge in sorted_edges(&vertices).chunk_by(|x, y| x.0 == y.0) {
            match *edge {
                [_] => {}
                [(_, c), (_, d)] => {
                    opposites[c] = d;
                    opposites[d] = c;
                }
                _ => {
                    cut_edges += 1;
                    for (_, c) in edge {
                        cut.set(c.index(), true);
                    }
                }
            }
        }
        (Self { vertices, opposites, cut }, cut_edges)
    }

    /// Turns neighbours the same way round, of each component as few triangles as it takes, in case of a tie not
    /// the first. Cuts the edges where that is impossible. Returns the turned triangles and the number of edges cut.
    pub fn orient(&mut self) -> (BitVec, usize) {
        let triangles = self.vertices.0.len();
        let mut seen: BitVec = BitVec::repeat(false, triangles);
        let mut flipped: BitVec = BitVec::repeat(false, triangles);
        let mut component = Vec::new();
        let mut cut_edges = 0;
        for first in (0..triangles as u32).map(Triangle) {
            if seen.replace(first.index(), true) {
                continue;
            }
            component.clear();
            component.push(first);
            let mut at = 0;
            while let Some(&t) = component.get(at) {
                at += 1;
                for (c, d) in t.corners().map(|c| (c, self.opposites[c])) {
                    if d.is_none() {
                        continue;
                    }
                    let neighbour = d.triangle();
                    let turned = flipped[t.index()] ^ self.run_alike(c, d);
                    if !seen.replace(neighbour.index(), true) {
                        flipped.set(neighbour.index(), turned);
                        component.push(neighbour);
                    } else if flipped[neighbour.index()] != turned {
                        self.cut_edge(c, d);
                        cut_edges += 1;
                    }
                }
            }
            let turned = component.iter().filter(|t| flipped[t.index()]).count();
            if 2 * turned > component.len() {
                for t in &component {
                    let now = flipped[t.index()];
                    flipped.set(t.index(), !now);
                }
            }
        }
        self.turn(&flipped);
        (flipped, cut_edges)
    }

    /// Makes each fan a vertex of its own, in the order of their first corners; returns the vertex each one was.
    pub fn split_vertices(&mut self) -> Vec<Vertex> {
        let mut fans = CornerMap::new(Vertex::NONE, self.vertices.0.len());
        let mut origins = Vec::new();
        for first in self.vertices.corners() {
            if fans[first].is_some() {
                continue;
            }
            let fan = Vertex(origins.len() as u32);
            origins.push(self.vertices[first]);
            // Once round, or to the boundary one way and then the other way.
            let mut c = first;
            while c.is_some() && fans[c].is_none() {
                fans[c] = fan;
                c = self.across(c.next(), Corner::next);
            }
            let mut c = self.across(first.prev(), Corner::prev);
            while c.is_some() && fans[c].is_none() {
                fans[c] = fan;
                c = self.across(c.prev(), Corner::prev);
            }
        }
        self.vertices = fans;
        origins
    }

    /// Closes slits of one edge: joins cut edges that now run between the same two vertices, of `count`.
    ///
    /// After this no two edges have the same ends. Before the cuts an edge was one pair of ends, and either its two
    /// triangles are joined, or it is cut and each of its triangles has a piece of it on the boundary. A vertex is now one
    /// fan and has at most two boundary edges, one out and one in; so of the pieces of an edge at most two share
    /// an end, and if they share both, they run in opposite directions and are joined here.
    pub fn zip(&mut self, count: usize) {
        let mut outgoing = vec![Corner::NONE; count];
        for c in self.cut.iter_ones().map(|c| Corner(c as u32)) {
            outgoing[self.edge(c).0.index()] = c;
        }
        for c in outgoing.iter().copied().filter(|c| c.is_some()) {
            let (a, b) = self.edge(c);
            let d = outgoing[b.index()];
            if d.is_some() && self.edge(d).1 == a {
                self.opposites[c] = d;
            }
        }
    }

    /// Of `count` vertices those at which a cut edge ends.
    pub fn cut_ends(&self, count: usize) -> BitVec {
        let mut ends = BitVec::repeat(false, count);
        for c in self.cut.iter_ones().map(|c| Corner(c as u32)) {
            let (a, b) = self.edge(c);
            ends.set(a.index(), true);
            ends.set(b.index(), true);
        }
        ends
    }

    /// The edge opposite to `c` as its triangle runs along it.
    fn edge(&self, c: Corner) -> (Vertex, Vertex) {
        (self.vertices[c.next()], self.vertices[c.prev()])
    }

    /// Whether the triangles of two corners run along their common edge in the same direction.
    fn run_alike(&self, c: Corner, d: Corner) -> bool {
        self.edge(c).0 == self.edge(d).0
    }

    fn cut_edge(&mut self, c: Corner, d: Corner) {
        for c in [c, d] {
            self.opposites[c] = Corner::NONE;
            self.cut.set(c.index(), true);
        }
    }

    /// Reverses triangles: their second and third corners change places.
    fn turn(&mut self, flipped: &BitVec) {
        let turned = |c: &&mut Corner| c.is_some() && flipped[c.triangle().index()];
        for c in self.opposites.0.iter_mut().flatten().filter(turned) {
            *c = match c.place() {
                0 => *c,
                1 => c.next(),
                _ => c.prev(),
            };
        }
        for t in flipped.iter_ones() {
            let [_, second, third] = Triangle(t as u32).corners();
            self.vertices.0[t].swap(1, 2);
            self.opposites.0[t].swap(1, 2);
            self.cut.swap(second.index(), third.index());
        }
    }

    /// From a corner across its edge and one `step` on, or `NONE`.
    fn across(&self, c: Corner, step: fn(Corner) -> Corner) -> Corner {
        let o = self.opposites[c];
        if o.is_some() { step(o) } else { Corner::NONE }
    }
}
