//! The walk: the order of all triangles, edges and boundary edges of a mesh, by structure alone (spec §4).

use crate::mesh::{Corner, CornerTable, Vertex};
use crate::refine::{ProgressiveMesh, Roots};

/// A mesh in walk order. Edges run from `v(next c)` to `v(prev c)` of their corner.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Walk {
    /// One corner for each edge, opposite to it, in the triangle that was reached first.
    pub edges: Vec<Corner>,
    /// For each triangle the corner opposite to the edge it was entered by.
    pub triangles: Vec<Corner>,
    /// The edges that have no second triangle, in the order of `edges`.
    pub boundary: Vec<Corner>,
}

impl Walk {
    /// Walks breadth first, component by component, from the root edges.
    ///
    /// The edge list is the queue: an edge is listed when the first of its triangles is visited, and taken up in that order;
    /// behind it lies the next triangle, unless it has been visited.
    pub fn new(table: &CornerTable, roots: &Roots) -> Self {
        let mut walk = Self::default();
        walk.again(table, roots, &mut Vec::new());
        walk
    }

    /// Walks anew where an earlier walk leaves its memory. Every triangle `visited` is marked with 1, by slot.
    pub fn again(&mut self, table: &CornerTable, roots: &Roots, visited: &mut Vec<u8>) {
        let walk = self;
        walk.triangles.clear();
        walk.triangles.reserve_exact(table.triangle_count());
        walk.boundary.clear();
        visited.clear();
        visited.resize(table.slots(), 0);
        let edges = &mut walk.edges;
        // As many as a closed surface has, and two that are written in vain.
        let most = table.triangle_count() + table.triangle_count() / 2 + 2;
        edges.reserve_exact(most.saturating_sub(edges.len()));
        edges.resize(edges.len().max(most), Corner::NONE);
        let mut tail = 0;
        for root in roots.corners(table) {
            visited[root.triangle().index()] = 1;
            walk.triangles.push(root);
            make_room(edges, tail + 3);
            edges[tail..tail + 3].copy_from_slice(&[root, root.next(), root.prev()]);
            let mut head = tail;
            tail += 3;
            while head < tail {
                let edge = edges[head];
                head += 1;
                let entry = table.opposite(edge);
                if entry.is_none() {
                    walk.boundary.push(edge);
                    continue;
                }
                if std::mem::replace(&mut visited[entry.triangle().index()], 1) == 1 {
                    continue;
                }
                walk.triangles.push(entry);
                let [_, next, prev] = table.opposites_from(entry);
                let is_new = |beyond: Corner| {
                    visited.get(beyond.triangle().index()).is_none_or(|&visited| visited == 0)
                };
                let new = [is_new(next), is_new(prev)];
                // They are taken up much later, when the edges before them have been.
                table.prefetch(next);
                table.prefetch(prev);
                make_room(edges, tail + 2);
                // Whether an edge is new is as good as random: a branch would cost more than a write in vain.
                edges[tail] = entry.next();
                tail += usize::from(new[0]);
                edges[tail] = entry.prev();
                tail += usize::from(new[1]);
            }
        }
        edges.truncate(tail);
    }

    /// Bytes that its lists take, at most, of a mesh of so many triangles and boundary edges.
    pub fn bytes(triangles: usize, boundary: usize) -> usize {
        let edges = (3 * triangles + boundary) / 2 + 4;
        // Where there is a boundary, edges find no room and are copied to where there is an eighth more; the boundary's own list doubles.
        let lists = if boundary == 0 { 4 * edges } else { 4 * edges + 4 * (edges + edges / 8 + 4) };
        lists + 4 * triangles + 12 * boundary
    }

    /// The vertices in the order in which the walk meets them: of each triangle next, prev, then the corner itself.
    pub fn vertices(&self, table: &CornerTable) -> Vec<Vertex> {
        let mut seen = vec![false; table.vertex_slots()];
        // One more than there are, that is written in vain: whether a vertex is new is as good as random.
        let mut vertices = vec![Vertex::NONE; table.vertex_slots() + 1];
        let mut count = 0;
        for &c in &self.triangles {
            for c in [c.next(), c.prev(), c] {
                let v = table.vertex(c);
                vertices[count] = v;
                count += usize::from(!std::mem::replace(&mut seen[v.index()], true));
            }
        }
        vertices.truncate(count);
        vertices
    }
}

/// A walk with the vertices that it meets.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Tour {
    /// The walk.
    pub walk: Walk,
    /// See [`Walk::vertices`].
    pub vertices: Vec<Vertex>,
}

impl Tour {
    /// Walks a mesh.
    pub fn new(mesh: &ProgressiveMesh) -> Self {
        let walk = Walk::new(&mesh.table, &mesh.roots);
        let vertices = walk.vertices(&mesh.table);
        Self { walk, vertices }
    }

    /// Bytes that it takes to make one, of a mesh of so many boundary edges.
    pub fn bytes(mesh: &ProgressiveMesh, boundary: usize) -> usize {
        // Which triangles have been visited, and which vertices, too.
        Walk::bytes(mesh.table.triangle_count(), boundary)
            + mesh.table.slots()
            + 5 * mesh.table.vertex_slots()
    }
}

/// Makes a list at least so long.
#[inline(always)]
fn make_room(edges: &mut Vec<Corner>, least: usize) {
    if least > edges.len() {
        let room = least + edges.len() / 8;
        edges.reserve_exact(room - edges.len());
        edges.resize(room, Corner::NONE);
    }
}
