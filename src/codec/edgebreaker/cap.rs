//! Caps: each boundary loop closed by a fan of triangles round a vertex of its own (spec §7.1.1).

use crate::mesh::{Corner, CornerTable, Triangle, Vertex};

/// Closes all boundary loops. Returns the number of loops; their vertices take the numbers from `table.vertex_slots()` on.
pub fn close(table: &mut CornerTable) -> usize {
    let before = table.slots();
    let mut loops = 0;
    for c in (0..before as u32).flat_map(|t| Triangle(t).corners()) {
        if table.vertex(c).is_none() || table.opposite(c).is_some() {
            continue;
        }
        let tip = Vertex(table.vertex_slots() as u32);
        let edges = boundary_loop(table, c);
        table.reserve_vertex(tip);
        let first = table.slots() as u32;
        for &k in &edges {
            let (a, b) = table.edge(k);
            let t = table.push_triangle([b, a, tip], [Corner::NONE; 3]);
            table.join(t.corner(2), k);
        }
        // The triangle (b, a, tip) and the one of the next edge b→b', (b', b, tip), share b–tip.
        let count = edges.len() as u32;
        for k in 0..count {
            let (this, next) = (Triangle(first + k), Triangle(first + (k + 1) % count));
            table.join(this.corner(1), next.corner(0));
        }
        for t in (first..first + count).map(Triangle) {
            table.renew_corners(t);
        }
        loops += 1;
    }
    loops
}

/// The corners opposite to the edges of a boundary loop, in the direction of their triangles.
pub fn boundary_loop(table: &CornerTable, start: Corner) -> Vec<Corner> {
    let mut edges = vec![start];
    loop {
        let (_, b) = table.edge(edges[edges.len() - 1]);
        let next = table.corner_of(b).prev();
        if next == start {
            return edges;
        }
        edges.push(next);
    }
}
