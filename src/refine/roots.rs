//! The root edge of each component, where every walk starts (spec §4.1).

use crate::error::Result;
use crate::limits::make_room;
use crate::mesh::{Corner, CornerTable, Vertex};

/// One directed edge u→w with a triangle on its left for each component, in the order the base fixed.
///
/// Depends on structure alone: never on how vertices, triangles or corners are stored.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Roots {
    edges: Vec<(Vertex, Vertex)>,
    /// The component of each vertex, `u32::MAX` for unused ones; empty where there is but one.
    component: Vec<u32>,
}

/// A root edge.
#[derive(Clone, Copy, Debug)]
pub struct Root(Vertex, Vertex);

impl Root {
    /// Whether it joins these two.
    #[inline]
    pub fn is(self, p: Vertex, q: Vertex) -> bool {
        (self.0 == p) & (self.1 == q) | (self.0 == q) & (self.1 == p)
    }
}

impl Roots {
    /// Starts from root edges; the component of every vertex is found through the table.
    pub fn new(table: &CornerTable, edges: Vec<(Vertex, Vertex)>) -> Self {
        if edges.len() == 1 {
            return Self { edges, component: Vec::new() };
        }
        let mut component = vec![u32::MAX; table.vertex_slots()];
        for (number, &(u, _)) in edges.iter().enumerate() {
            flood(table, &mut component, u, number as u32);
        }
        Self { edges, component }
    }

    /// A root edge for each component of a table: that of its first triangle, components in the order of their first triangles.
    pub fn choose(table: &CornerTable) -> Self {
        let mut component = vec![u32::MAX; table.vertex_slots()];
        let mut edges = Vec::new();
        for t in table.triangles() {
            let [u, w, _] = table.triangle(t);
            if component[u.index()] != u32::MAX {
                continue;
            }
            flood(table, &mut component, u, edges.len() as u32);
            edges.push((u, w));
        }
        if edges.len() == 1 {
            component = Vec::new();
        }
        Self { edges, component }
    }

    /// The root edges, a component each.
    pub fn edges(&self) -> &[(Vertex, Vertex)] {
        &self.edges
    }

    /// For each component the corner opposite to its root edge, in the triangle on the left of it.
    pub fn corners<'a>(&'a self, table: &'a CornerTable) -> impl Iterator<Item = Corner> + 'a {
        self.edges.iter().map(|&(u, w)| table.find_directed_edge(u, w))
    }

    /// The root edge of the component of a vertex.
    #[inline]
    pub fn of(&self, v: Vertex) -> Root {
        let edge = self.edges.get(self.number(v));
        edge.map_or(Root(Vertex::NONE, Vertex::NONE), |&(u, w)| Root(u, w))
    }

    fn number(&self, v: Vertex) -> usize {
        if self.edges.len() > 1 { self.component[v.index()] as usize } else { 0 }
    }

    /// Enters `v`, inserted next to `neighbour`; `uprooted` where that has destroyed the root edge.
    /// Call it once after the last flip of an operation: the root edge then becomes u→v, or v→u where u→v has no triangle on its left.
    #[inline]
    pub fn insert(&mut self, table: &CornerTable, v: Vertex, neighbour: Vertex, uprooted: bool) {
        let number = self.number(neighbour);
        if self.edges.len() > 1 {
            self.component.resize(self.component.len().max(v.index() + 1), u32::MAX);
            self.component[v.index()] = number as u32;
        }
        if uprooted && let Some(root) = self.edges.get_mut(number) {
            let (u, _) = *root;
            let uv = table.find_directed_edge(u, v);
            *root = if uv.is_some() { (u, v) } else { (v, u) };
        }
    }

    /// [`Roots::insert`] where it is not known whether the root edge is gone.
    pub fn mend(&mut self, table: &CornerTable, v: Vertex, neighbour: Vertex) {
        let root = self.edges.get(self.number(neighbour));
        let uprooted = root.is_some_and(|&(u, w)| !table.has_edge(u, w));
        self.insert(table, v, neighbour, uprooted);
    }

    /// Components join those of `table`, behind them: those of `part`, with their root edges, whose vertices `name` gives numbers here.
    pub(super) fn append(
        &mut self,
        table: &CornerTable,
        part: &CornerTable,
        roots: &Self,
        name: impl Fn(Vertex) -> Vertex,
    ) {
        if self.edges.len() < 2 {
            let used = |&c: &Corner| if c.is_some() { 0 } else { u32::MAX };
            self.component = table.corners.iter().map(used).collect();
        }
        let first = self.edges.len() as u32;
        let used = (0..part.vertex_slots() as u32).map(Vertex).filter(|&v| part.corner_of(v).is_some());
        for (v, number) in used.map(|v| (name(v), first + roots.number(v) as u32)) {
            self.component.resize(self.component.len().max(v.index() + 1), u32::MAX);
            self.component[v.index()] = number;
        }
        self.edges.extend(roots.edges.iter().map(|&(u, w)| (name(u), name(w))));
    }

    /// Makes room for so many vertices in all.
    pub(super) fn make_room(&mut self, vertices: usize) -> Result<()> {
        let more = if self.edges.len() > 1 { vertices.saturating_sub(self.component.len()) } else { 0 };
        make_room(&mut self.component, more)
    }

    /// Puts root edges back, as they were before some operations were undone or carried out again.
    pub fn restore(&mut self, table: &CornerTable, edges: Vec<(Vertex, Vertex)>) {
        *self = Self::new(table, edges);
    }
}

/// Marks all vertices of the component of `u`.
fn flood(table: &CornerTable, component: &mut [u32], u: Vertex, number: u32) {
    component[u.index()] = number;
    let mut queue = vec![u];
    while let Some(v) = queue.pop() {
        for c in table.fan(v) {
            for w in [table.vertex(c.next()), table.vertex(c.prev())] {
                if component[w.index()] == u32::MAX {
                    component[w.index()] = number;
                    queue.push(w);
                }
            }
        }
    }
}
