//! The corner table (Rossignac, Safonova, Szymczak 2001; spec §2.1).
//!
//! ```text
//!               v(c)                 A corner c is triangle t = c/4 seen from its vertex v(c).
//!                c                   It also names the edge opposite to it, n(c) -> p(c).
//!               / \
//!        left  /   \  right          left edge  v(c) -> v(n): opposite to p(c)
//!             /  t  \                right edge v(p) -> v(c): opposite to n(c)
//!         n(c)-------p(c)
//!             \     /                o = O[c] is the corner that faces c across the edge,
//!              \   /                 NONE where the edge is a boundary edge.
//!               \ /
//!                o                   Seen from outside the order v, n, p is counter-clockwise.
//! ```

use super::buckets;
use super::index::{Corner, CornerMap, Triangle, Vertex};
use super::prefetch::prefetch;
use crate::error::Result;
use crate::limits::make_room;

/// A triangle mesh as the arrays V (corner to vertex), O (corner to opposite corner) and one corner a vertex.
///
/// Invariants, kept by every operation of `refine`:
/// - `O[O[c]] == c` wherever `O[c]` exists, and the two corners see the same edge in opposite directions;
/// - the corners at a vertex form one fan, closed in the interior, open at the boundary;
/// - no two edges join the same pair of vertices, no two triangles have the same three vertices;
/// - the corner of a boundary vertex is the one whose triangle has the outgoing boundary edge;
/// - a removed triangle has `V == NONE` at its three corners, an unused vertex has corner `NONE`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct CornerTable {
    /// V and O side by side: whoever looks at one of a corner mostly looks at the other, or at those of its triangle.
    records: Vec<Record>,
    pub(crate) corners: Vec<Corner>,
    pub(crate) live: u32,
}

/// V and O of the corners of a triangle, half a cache line. The fourth places belong to no corner: they make every place of a
/// corner number a place of the arrays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(align(32))]
struct Record {
    vertices: [Vertex; 4],
    opposites: [Corner; 4],
}

impl Record {
    const EMPTY: Self = Self { vertices: [Vertex::NONE; 4], opposites: [Corner::NONE; 4] };

    fn is_live(&self) -> bool {
        self.vertices[0].is_some()
    }
}

/// There are numbers for the corners of fewer triangles than this; those of the last one would be `NONE`'s.
pub const MAX_TRIANGLES: usize = 1 << 30;

/// Why some triangles are not an oriented manifold.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TopologyError {
    /// A triangle names one vertex twice.
    #[error("triangle {0:?} names a vertex twice")]
    DegenerateTriangle(Triangle),
    /// An edge has three triangles, or two that run along it in the same direction.
    #[error("the edge {0:?} {1:?} has more than two triangles, or two in the same direction")]
    EdgeNotManifold(Vertex, Vertex),
    /// The corners at a vertex form more than one fan.
    #[error("the triangles at {0:?} form more than one fan")]
    VertexNotManifold(Vertex),
    /// Two triangles have the same vertices.
    #[error("triangle {0:?} repeats another")]
    RepeatedTriangle(Triangle),
    /// The table contradicts itself.
    #[error("the table is inconsistent at {0:?}")]
    Inconsistent(Corner),
}

impl CornerTable {
    /// Builds the table of an oriented manifold of `vertex_count` vertices.
    ///
    /// # Errors
    /// [`TopologyError`] where the triangles are not an oriented manifold without repeated edges.
    pub fn from_triangles(vertex_count: usize, triangles: &[[u32; 3]]) -> Result<Self, TopologyError> {
        let vertices = CornerMap(triangles.iter().map(|t| t.map(Vertex)).collect());
        let mut opposites = CornerMap::new(Corner::NONE, triangles.len());
        for edge in sorted_edges(&vertices).chunk_by(|x, y| x.0 == y.0) {
            let ends = (Vertex((edge[0].0 >> 32) as u32), Vertex(edge[0].0 as u32));
            match *edge {
                [_] => {}
                [(_, c), (_, d)] if vertices[c.next()] == vertices[d.prev()] => {
                    opposites[c] = d;
                    opposites[d] = c;
                }
                _ => return Err(TopologyError::EdgeNotManifold(ends.0, ends.1)),
            }
        }
        let table = Self::from_parts(vertex_count, vertices, opposites);
        table.check()?;
        Ok(table)
    }

    /// Completes a table whose V and O are consistent: finds one corner for each vertex.
    pub(crate) fn from_parts(
        vertex_count: usize,
        vertices: CornerMap<Vertex>,
        opposites: CornerMap<Corner>,
    ) -> Self {
        let count = vertices.0.len();
        Self::collect(vertex_count, count, vertices.0.into_iter().zip(opposites.0))
    }

    /// [`CornerTable::from_parts`], of V and O of one triangle after the other.
    pub(crate) fn collect(
        vertex_count: usize,
        triangle_count: usize,
        triangles: impl Iterator<Item = ([Vertex; 3], [Corner; 3])>,
    ) -> Self {
        let mut records = Vec::with_capacity(triangle_count);
        records.extend(triangles.map(|([a, b, c], [x, y, z])| Record {
            vertices: [a, b, c, Vertex::NONE],
            opposites: [x, y, z, Corner::NONE],
        }));
        let live = records.len() as u32;
        let mut table = Self { records, corners: vec![Corner::NONE; vertex_count], live };
        for t in (0..live).map(Triangle) {
            table.renew_corners(t);
        }
        table
    }

    /// Number of triangles.
    pub fn triangle_count(&self) -> usize {
        self.live as usize
    }

    /// Number of edges.
    pub fn edge_count(&self) -> usize {
        let open = |t: Triangle| t.corners().into_iter().filter(|&c| self.opposite(c).is_none()).count();
        (3 * self.triangle_count() + self.triangles().map(open).sum::<usize>()) / 2
    }

    /// Number of places for triangles, removed ones included: triangle indices are below it.
    pub fn slots(&self) -> usize {
        self.records.len()
    }

    /// Number of vertex indices, unused ones included.
    pub fn vertex_slots(&self) -> usize {
        self.corners.len()
    }

    /// V: the vertex of a corner.
    #[inline]
    pub fn vertex(&self, c: Corner) -> Vertex {
        self.records[c.triangle().index()].vertices[c.place()]
    }

    /// O: the corner that faces `c` across its edge, or `NONE` at the boundary.
    #[inline]
    pub fn opposite(&self, c: Corner) -> Corner {
        self.records[c.triangle().index()].opposites[c.place()]
    }

    /// The vertices of a triangle, that of corner `c` first, counter-clockwise.
    #[inline]
    pub fn vertices_from(&self, c: Corner) -> [Vertex; 3] {
        let vertices = &self.records[c.triangle().index()].vertices;
        [c, c.next(), c.prev()].map(|c| vertices[c.place()])
    }

    /// O of the corners of a triangle, that of `c` first, counter-clockwise.
    #[inline]
    pub fn opposites_from(&self, c: Corner) -> [Corner; 3] {
        let opposites = &self.records[c.triangle().index()].opposites;
        [c, c.next(), c.prev()].map(|c| opposites[c.place()])
    }

    /// Asks for the triangle of a corner, if it has one, to be brought into the caches.
    #[inline(always)]
    pub fn prefetch(&self, c: Corner) {
        if let Some(record) = self.records.get(c.triangle().index()) {
            prefetch(record);
        }
    }

    /// One corner at `v`: at a boundary vertex the one whose triangle has the outgoing boundary edge;
    /// `NONE` for an unused vertex.
    #[inline]
    pub fn corner_of(&self, v: Vertex) -> Corner {
        self.corners[v.index()]
    }

    /// Whether the triangle has not been removed.
    #[inline]
    pub fn is_live(&self, t: Triangle) -> bool {
        self.vertex(t.corner(0)).is_some()
    }

    /// The three vertices of a triangle, counter-clockwise.
    #[inline]
    pub fn triangle(&self, t: Triangle) -> [Vertex; 3] {
        t.corners().map(|c| self.vertex(c))
    }

    /// All triangles that have not been removed.
    pub fn triangles(&self) -> impl Iterator<Item = Triangle> + '_ {
        (0..self.slots() as u32).map(Triangle).filter(|&t| self.is_live(t))
    }

    /// The edge opposite to `c` as its triangle runs along it: from `v(next c)` to `v(prev c)`.
    #[inline]
    pub fn edge(&self, c: Corner) -> (Vertex, Vertex) {
        let [_, a, b] = self.vertices_from(c);
        (a, b)
    }

    /// The next corner at the same vertex, counter-clockwise; `NONE` past the boundary.
    #[inline]
    pub fn swing(&self, c: Corner) -> Corner {
        let o = self.opposite(c.next());
        if o.is_some() { o.next() } else { Corner::NONE }
    }

    /// The corners at `v`, counter-clockwise; at a boundary vertex from the outgoing boundary edge to the incoming one.
    pub fn fan(&self, v: Vertex) -> impl Iterator<Item = Corner> + '_ {
        let first = self.corner_of(v);
        let mut at = first;
        std::iter::from_fn(move || {
            if at.is_none() {
                return None;
            }
            let now = at;
            at = self.swing(at);
            if at == first {
                at = Corner::NONE;
            }
            Some(now)
        })
    }

    /// Whether `v` lies on the boundary; an unused vertex does not.
    #[inline]
    pub fn is_boundary(&self, v: Vertex) -> bool {
        let c = self.corner_of(v);
        c.is_some() && self.opposite(c.prev()).is_none()
    }

    /// Number of edges at `v`.
    pub fn valence(&self, v: Vertex) -> usize {
        self.fan(v).count() + usize::from(self.is_boundary(v))
    }

    /// The neighbours of `v`, counter-clockwise; at a boundary vertex from the outgoing boundary edge to the incoming one.
    pub fn link(&self, v: Vertex) -> Vec<Vertex> {
        let mut link = Vec::with_capacity(8);
        let mut last = Corner::NONE;
        for c in self.fan(v) {
            link.push(self.vertex(c.next()));
            last = c;
        }
        if last.is_some() && self.is_boundary(v) {
            link.push(self.vertex(last.prev()));
        }
        link
    }

    /// The neighbours of `v` as in [`CornerTable::link`], one after the other.
    pub fn vertices_round(&self, v: Vertex) -> impl Iterator<Item = Vertex> + '_ {
        let boundary = self.is_boundary(v).then(|| self.vertex(self.corner_of(v).next()));
        boundary.into_iter().chain(self.fan(v).map(|c| self.vertex(c.prev())))
    }

    /// A corner whose opposite edge joins `a` and `b`, or `NONE`. Takes time in the smaller of the two valences.
    pub fn find_edge(&self, a: Vertex, b: Vertex) -> Corner {
        let mut at = [self.fan(a), self.fan(b)];
        let other = [b, a];
        loop {
            for (fan, &other) in at.iter_mut().zip(&other) {
                let Some(c) = fan.next() else { return Corner::NONE };
                if self.vertex(c.next()) == other {
                    return c.prev();
                }
                if self.vertex(c.prev()) == other {
                    return c.next();
                }
            }
        }
    }

    /// The corner whose triangle runs along its opposite edge from `a` to `b`, or `NONE`.
    pub fn find_directed_edge(&self, a: Vertex, b: Vertex) -> Corner {
        let c = self.find_edge(a, b);
        if c.is_none() || self.vertex(c.next()) == a { c } else { self.opposite(c) }
    }

    /// Whether `a` and `b` are joined by an edge.
    pub fn has_edge(&self, a: Vertex, b: Vertex) -> bool {
        self.find_edge(a, b).is_some()
    }

    /// Whether an edge between two used vertices may exist: looks at no more than `most` triangles round each of them, and says
    /// yes where these do not tell.
    pub fn may_have_edge(&self, a: Vertex, b: Vertex, most: usize) -> bool {
        let mut at = [self.fan(a), self.fan(b)];
        let other = [b, a];
        for _ in 0..most {
            for (fan, &other) in at.iter_mut().zip(&other) {
                let Some(c) = fan.next() else { return false };
                if [c.next(), c.prev()].iter().any(|&c| self.vertex(c) == other) {
                    return true;
                }
            }
        }
        true
    }

    /// Sets V of a corner.
    #[inline]
    pub(crate) fn set_vertex(&mut self, c: Corner, v: Vertex) {
        self.records[c.triangle().index()].vertices[c.place()] = v;
    }

    /// Makes the edge opposite to a corner a boundary edge.
    #[inline]
    pub(crate) fn open(&mut self, c: Corner) {
        self.set_opposite(c, Corner::NONE);
    }

    fn set_opposite(&mut self, c: Corner, o: Corner) {
        self.records[c.triangle().index()].opposites[c.place()] = o;
    }

    /// Triangles that there is room for.
    pub(crate) fn capacity(&self) -> usize {
        self.records.capacity()
    }

    /// Joins two corners across an edge; either may be `NONE`.
    #[inline]
    pub(crate) fn join(&mut self, c: Corner, d: Corner) {
        self.set_facing(c, d);
        self.set_facing(d, c);
    }

    /// Re-establishes the corner of the vertex at `c`, one of whose triangles has been rewritten.
    #[inline]
    pub(crate) fn renew_corner(&mut self, c: Corner) {
        let v = self.vertex(c);
        let old = self.corners[v.index()];
        let there = self.records.get(old.triangle().index());
        let stale = there.is_none_or(|record| record.vertices[old.place()] != v);
        let renew = stale | self.opposite(c.prev()).is_none();
        self.corners[v.index()] = if renew { c } else { old };
    }

    /// A vertex moves from one corner to another: if it was its corner, so is the other.
    #[inline]
    pub(crate) fn replace_corner(&mut self, v: Vertex, from: Corner, to: Corner) {
        let corner = &mut self.corners[v.index()];
        *corner = if *corner == from { to } else { *corner };
    }

    /// Re-establishes the corners of the vertices of a rewritten triangle.
    pub(crate) fn renew_corners(&mut self, t: Triangle) {
        for c in t.corners() {
            self.renew_corner(c);
        }
    }

    /// Appends a triangle, given V and O of its corners.
    #[inline]
    pub(crate) fn push_triangle(&mut self, vertices: [Vertex; 3], opposites: [Corner; 3]) -> Triangle {
        let t = Triangle(self.slots() as u32);
        let ([a, b, c], [x, y, z]) = (vertices, opposites);
        self.records.push(Record { vertices: [a, b, c, Vertex::NONE], opposites: [x, y, z, Corner::NONE] });
        self.live += 1;
        t
    }

    /// Rewrites a triangle: V of the corner before `c`, O of `c` and of the one after it. Returns the last as it was.
    #[inline]
    pub(crate) fn rewrite(&mut self, c: Corner, before: Vertex, opposite: Corner, after: Corner) -> Corner {
        let Record { vertices, opposites } = &mut self.records[c.triangle().index()];
        vertices[c.prev().place()] = before;
        opposites[c.place()] = opposite;
        std::mem::replace(&mut opposites[c.next().place()], after)
    }

    /// Sets O of a corner, if there is one.
    #[inline]
    pub(crate) fn set_facing(&mut self, c: Corner, o: Corner) {
        if c.is_some() {
            self.set_opposite(c, o);
        }
    }

    /// Marks a triangle as removed; removed triangles at the end give up their place.
    pub(crate) fn remove_triangle(&mut self, t: Triangle) {
        self.records[t.index()] = Record::EMPTY;
        self.live -= 1;
        while self.records.last().is_some_and(|record| !record.is_live()) {
            self.records.pop();
        }
    }

    /// Appends the triangles of another table, none of which has been removed, and whose vertices `name` gives numbers here that are not in use.
    pub(crate) fn append(&mut self, part: &Self, name: impl Fn(Vertex) -> Vertex) {
        let first = self.slots() as u32;
        let moved = |c: Corner| {
            if c.is_none() { c } else { Triangle(first + c.triangle().0).corner(c.place() as u32) }
        };
        for t in part.triangles() {
            let vertices = part.triangle(t).map(&name);
            vertices.into_iter().for_each(|v| self.reserve_vertex(v));
            let t = self.push_triangle(vertices, part.opposites_from(t.corner(0)).map(moved));
            self.renew_corners(t);
        }
    }

    /// Takes whole components away, of which these are all triangles.
    pub(crate) fn remove_components(&mut self, triangles: impl Iterator<Item = Triangle>) {
        for t in triangles {
            for v in self.triangle(t) {
                self.corners[v.index()] = Corner::NONE;
            }
            self.remove_triangle(t);
        }
    }

    /// The same mesh without the places of removed triangles; vertices keep their numbers.
    pub fn compacted(&self) -> Self {
        let mut places = vec![Triangle::NONE; self.slots()];
        for (k, t) in (0..).zip(self.triangles()) {
            places[t.index()] = Triangle(k);
        }
        let moved = |c: Corner| {
            if c.is_none() { c } else { places[c.triangle().index()].corner(c.place() as u32) }
        };
        let vertices = self.triangles().map(|t| self.triangle(t)).collect();
        let opposites = self.triangles().map(|t| t.corners().map(|c| moved(self.opposite(c)))).collect();
        Self::from_parts(self.corners.len(), CornerMap(vertices), CornerMap(opposites))
    }

    /// Takes the places of removed triangles out and gives their memory back; the others keep their order, and vertices their numbers and
    /// corners.
    #[cfg(feature = "encode")]
    pub(crate) fn close_up(&mut self) {
        // The places that belong to no corner tell meanwhile where each triangle goes.
        for (k, record) in (0..).zip(self.records.iter_mut().filter(|record| record.is_live())) {
            record.vertices[3] = Vertex(k);
        }
        let moved = |records: &[Record], c: Corner| match records.get(c.triangle().index()) {
            Some(record) => Triangle(record.vertices[3].0).corner(c.place() as u32),
            None => c,
        };
        for t in 0..self.records.len() {
            if self.records[t].is_live() {
                self.records[t].opposites = self.records[t].opposites.map(|o| moved(&self.records, o));
            }
        }
        self.corners.iter_mut().for_each(|c| *c = moved(&self.records, *c));
        self.records.retain(Record::is_live);
        self.records.iter_mut().for_each(|record| record.vertices[3] = Vertex::NONE);
        self.records.shrink_to_fit();
    }

    /// Forgets the numbers of unused vertices from `count` on.
    pub(crate) fn truncate_vertices(&mut self, count: usize) {
        self.corners.truncate(count);
    }

    /// Makes room for so many vertices and triangles in all.
    pub(crate) fn make_room(&mut self, vertices: usize, triangles: usize) -> Result<()> {
        let (v, t) = (self.corners.len(), self.records.len());
        make_room(&mut self.corners, vertices.saturating_sub(v))?;
        make_room(&mut self.records, triangles.saturating_sub(t))
    }

    /// Gives `v` its corner.
    #[inline]
    pub(crate) fn set_corner(&mut self, v: Vertex, c: Corner) {
        self.reserve_vertex(v);
        self.corners[v.index()] = c;
    }

    /// Makes room for vertex `v` in the corner array.
    pub(crate) fn reserve_vertex(&mut self, v: Vertex) {
        if v.index() >= self.corners.len() {
            self.corners.resize(v.index() + 1, Corner::NONE);
        }
    }

    /// Checks every invariant. Takes time in proportion to the mesh.
    ///
    /// # Errors
    /// The first [`TopologyError`] found.
    pub fn check(&self) -> Result<(), TopologyError> {
        let live = |c: Corner| self.records.get(c.triangle().index()).is_some_and(Record::is_live);
        let mut fan_sizes = vec![0u32; self.corners.len()];
        for t in self.triangles() {
            let [a, b, c] = self.triangle(t);
            if a == b || b == c || c == a {
                return Err(TopologyError::DegenerateTriangle(t));
            }
            for c in t.corners() {
                let o = self.opposite(c);
                if o.is_some() {
                    let (x, y) = self.edge(c);
                    if !live(o) || self.opposite(o) != c || self.edge(o) != (y, x) {
                        return Err(TopologyError::Inconsistent(c));
                    }
                }
                let v = self.vertex(c);
                let Some(size) = fan_sizes.get_mut(v.index()) else {
                    return Err(TopologyError::Inconsistent(c));
                };
                *size += 1;
            }
        }
        let mut seen = vec![Vertex::NONE; self.corners.len()];
        for v in (0..self.corners.len() as u32).map(Vertex) {
            let c = self.corner_of(v);
            if c.is_none() {
                if fan_sizes[v.index()] > 0 {
                    return Err(TopologyError::VertexNotManifold(v));
                }
                continue;
            }
            if !live(c) || self.vertex(c) != v || self.fan(v).count() as u32 != fan_sizes[v.index()] {
                return Err(TopologyError::VertexNotManifold(v));
            }
            for w in self.link(v) {
                if std::mem::replace(&mut seen[w.index()], v) == v {
                    return Err(TopologyError::EdgeNotManifold(v, w));
                }
            }
            // With single edges, two triangles with the same vertices see each other across an edge.
            for c in self.fan(v) {
                let o = self.opposite(c);
                if o.is_some() && self.vertex(o) == v {
                    return Err(TopologyError::RepeatedTriangle(o.triangle()));
                }
            }
        }
        Ok(())
    }
}

/// All edges as (smaller end, larger end) in one key, with the corner opposite; sorted.
pub(super) fn sorted_edges(vertices: &CornerMap<Vertex>) -> Vec<(u64, Corner)> {
    let key = |c: Corner| {
        let (a, b) = (vertices[c.next()].0, vertices[c.prev()].0);
        u64::from(a.min(b)) << 32 | u64::from(a.max(b))
    };
    let mut edges = Vec::with_capacity(3 * vertices.0.len());
    edges.extend(vertices.corners().map(|c| (key(c), c)));
    let vertices = vertices.0.iter().flatten().map(|v| v.index() + 1).max().unwrap_or(0);
    buckets::sort(&mut edges, vertices, |&(key, _)| (key >> 32) as usize);
    edges
}

#[cfg(test)]
mod tests {
    use super::*;

    const TETRAHEDRON: [[u32; 3]; 4] = [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]];

    #[test]
    fn a_tetrahedron_is_closed() {
        let table = CornerTable::from_triangles(4, &TETRAHEDRON).unwrap();
        for v in (0..4).map(Vertex) {
            assert_eq!(table.valence(v), 3);
            assert!(!table.is_boundary(v));
        }
        assert_eq!(table.edge(table.find_directed_edge(Vertex(1), Vertex(3))), (Vertex(1), Vertex(3)));
    }

    #[test]
    fn the_fan_of_a_boundary_vertex_runs_from_the_outgoing_edge_to_the_incoming_one() {
        let table = CornerTable::from_triangles(4, &[[0, 1, 2], [0, 2, 3]]).unwrap();
        assert_eq!(table.link(Vertex(0)), [Vertex(1), Vertex(2), Vertex(3)]);
        assert!(table.is_boundary(Vertex(0)));
        assert!(!table.has_edge(Vertex(1), Vertex(3)));
    }

    #[test]
    fn what_is_no_manifold_is_refused() {
        let fails = |n, t: &[[u32; 3]]| CornerTable::from_triangles(n, t).unwrap_err();
        assert!(matches!(fails(5, &[[0, 1, 2], [1, 0, 3], [0, 1, 4]]), TopologyError::EdgeNotManifold(..)));
        assert!(matches!(fails(4, &[[0, 1, 2], [0, 1, 3]]), TopologyError::EdgeNotManifold(..)));
        assert!(matches!(fails(5, &[[0, 1, 2], [0, 3, 4]]), TopologyError::VertexNotManifold(_)));
        assert!(matches!(fails(3, &[[0, 1, 2], [0, 2, 1]]), TopologyError::RepeatedTriangle(_)));
        assert!(matches!(fails(2, &[[0, 1, 1]]), TopologyError::DegenerateTriangle(_)));
    }
}
