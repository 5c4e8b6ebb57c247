//! The topology of a manifold in four numbers.

use bitvec::vec::BitVec;

use crate::mesh::corner_table::CornerTable;
use crate::mesh::index::Corner;

/// Components, boundary and handles; simplification changes none but the number of boundary edges, and leaves out whole components.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Census {
    /// Connected components.
    pub components: usize,
    /// Boundary loops of all components.
    pub boundary_loops: usize,
    /// Boundary edges of all components.
    pub boundary_edges: usize,
    /// Handles of all components: the sum of their genera.
    pub handles: usize,
}

/// Counts; unused vertices and removed triangles do not matter.
pub fn census(table: &CornerTable) -> Census {
    let (boundary_loops, boundary_edges) = boundary(table);
    let components = components(table);
    let vertices = (0..table.vertex_slots()).filter(|&v| table.corners[v].is_some()).count();
    let triangles = table.triangle_count();
    // Euler: V - E + F = 2 components - 2 handles - loops, and 3 F = 2 E - boundary edges.
    let edges = (3 * triangles + boundary_edges) / 2;
    let handles = (2 * components + edges - boundary_loops - vertices - triangles) / 2;
    Census { components, boundary_loops, boundary_edges, handles }
}

fn components(table: &CornerTable) -> usize {
    let mut seen: BitVec = BitVec::repeat(false, table.slots());
    let mut stack = Vec::new();
    let mut components = 0;
    for first in table.triangles() {
        if seen.replace(first.index(), true) {
            continue;
        }
        components += 1;
        stack.push(first);
        while let Some(t) = stack.pop() {
            for o in t.corners().map(|c| table.opposite(c)).into_iter().filter(|o| o.is_some()) {
                if !seen.replace(o.triangle().index(), true) {
                    stack.push(o.triangle());
                }
            }
        }
    }
    components
}

/// Loops and edges of the boundary.
fn boundary(table: &CornerTable) -> (usize, usize) {
    let mut seen: BitVec = BitVec::repeat(false, 4 * table.slots());
    let (mut loops, mut edges) = (0, 0);
    for mut c in table.triangles().flat_map(|t| t.corners()).filter(|&c| table.opposite(c).is_none()) {
        loops += usize::from(!seen[c.index()]);
        while !seen.replace(c.index(), true) {
            edges += 1;
            c = next_boundary_edge(table, c);
        }
    }
    (loops, edges)
}

/// From one boundary edge, named by the corner opposite, to the one that starts where it ends.
fn next_boundary_edge(table: &CornerTable, c: Corner) -> Corner {
    table.corner_of(table.edge(c).1).prev()
}
