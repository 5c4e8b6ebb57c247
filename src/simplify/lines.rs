//! Levels along straight lines: of the vertices exactly in the middle between two others on a surface that is straight that way too, every
//! other one goes first.
//!
//! Walls of a part are often cut into rows that add nothing to them. A vertex in the middle of such a line costs no error, and hardly a bit
//! where its edge is expected to be split: its place is known. That holds as long as no end of a line goes before what lies on it, and what
//! lies on it goes in order.

use super::removal::{Remover, vertices};
use crate::mesh::{CornerTable, Vertex};
use bitvec::bitvec;
use bitvec::vec::BitVec;
use std::collections::VecDeque;

/// What goes in one or more levels: every other vertex of the lines.
#[derive(Debug)]
pub struct Lines {
    /// Those that go, or are left of them, each beside one before it where that can be.
    pub order: Vec<Vertex>,
    /// The two vertices that each of them lies between, and none for all others.
    mates: Vec<[Vertex; 2]>,
    /// The others on lines, and those that lines end at.
    waits: BitVec,
}

impl Lines {
    /// Those of a mesh as it stands, if enough of its vertices go with them.
    pub fn new(remover: &Remover) -> Option<Self> {
        let table = &remover.table;
        let mut mates = vec![BESIDE; table.vertex_slots()];
        let mut count = 0;
        for v in remover.free() {
            if let Some(between) = remover.between(v) {
                mates[v.index()] = between;
                count += 1;
            }
        }
        if count * SHARE < remover.vertices {
            return None;
        }
        // How far each is from what lies on no line.
        let mut distance = vec![0u32; table.vertex_slots()];
        let mut order = Vec::new();
        let mut queue: VecDeque<_> = vertices(table).filter(|&v| mates[v.index()] == BESIDE).collect();
        while let Some(v) = queue.pop_front() {
            for w in table.vertices_round(v) {
                if mates[w.index()] != BESIDE && distance[w.index()] == 0 {
                    distance[w.index()] = distance[v.index()] + 1;
                    queue.push_back(w);
                    order.push(w);
                }
            }
        }
        let is_odd = |v: Vertex| distance[v.index()] % 2 == 1;
        order.retain(|&v| is_odd(v) && !mates[v.index()].into_iter().any(is_odd));
        if order.len() < LEAST || order.len() * SHARE < remover.vertices {
            return None;
        }
        let mut goes = bitvec![0; table.vertex_slots()];
        order.iter().for_each(|v| goes.set(v.index(), true));
        let mut waits: BitVec = mates.iter().map(|&mates| mates != BESIDE).collect();
        waits &= !goes.clone();
        for v in &order {
            mates[v.index()].iter().for_each(|w| waits.set(w.index(), true));
        }
        for v in goes.iter_zeros() {
            mates[v] = BESIDE;
        }
        Some(Self { order: beside(table, order, goes), mates, waits })
    }

    /// The two vertices that one lies between which goes.
    #[inline]
    pub fn mates(&self, v: Vertex) -> Option<[Vertex; 2]> {
        let mates = self.mates[v.index()];
        (mates != BESIDE).then_some(mates)
    }

    /// Whether a vertex is no choice of a level, because it goes with the lines or waits for them.
    pub fn hold(&self, v: Vertex) -> bool {
        self.waits[v.index()] || self.mates[v.index()] != BESIDE
    }
}

/// Some vertices in another order: from each to those beside it, so that every other one of a chain can be removed in one level.
fn beside(table: &CornerTable, vertices: Vec<Vertex>, mut left: BitVec) -> Vec<Vertex> {
    let mut order = Vec::with_capacity(vertices.len());
    for first in vertices {
        let mut next = order.len();
        if left.replace(first.index(), false) {
            order.push(first);
        }
        while next < order.len() {
            order.extend(table.vertices_round(order[next]).filter(|w| left.replace(w.index(), false)));
            next += 1;
        }
    }
    order
}

/// Of a vertex that lies on no line.
const BESIDE: [Vertex; 2] = [Vertex::NONE; 2];

/// One in so many vertices must go with the lines: fewer save less than their levels take.
const SHARE: usize = 8;
/// So many must in any case.
const LEAST: usize = 64;

#[cfg(test)]
mod tests {
    use super::super::{Features, Method, Options, Simplified, simplify};
    use crate::mesh::{CornerTable, IndexedMesh, Lattice, lattice};
    use bitvec::bitvec;
    use std::f64::consts::TAU;

    /// A star-shaped prism of so many rows, its ends closed by fans.
    fn prism(around: u32, rows: u32) -> IndexedMesh {
        let at = |i: u32| {
            let turn = TAU * f64::from(i) / f64::from(around);
            let radius = 1.0 + 0.3 * (5.0 * turn).sin();
            [radius * turn.cos(), radius * turn.sin()]
        };
        let (mut positions, mut triangles) = (Vec::new(), Vec::new());
        for row in 0..=rows {
            positions.extend((0..around).map(at).map(|[x, y]| [x, y, f64::from(row) / f64::from(rows)]));
        }
        positions.extend([[0.0, 0.0, 0.0], [0.0, 0.0, 1.0]]);
        let ends = (rows + 1) * around;
        for i in 0..around {
            let j = (i + 1) % around;
            for row in (0..rows).map(|row| row * around) {
                triangles.extend([
                    [row + i, row + j, row + around + j],
                    [row + i, row + around + j, row + around + i],
                ]);
            }
            triangles.extend([[j, i, ends], [rows * around + i, rows * around + j, ends + 1]]);
        }
        IndexedMesh::new(positions, triangles)
    }

    /// The vertices that the first level of a prism lacks, on 12 bits a coordinate.
    fn first_level(around: u32, rows: u32) -> Vec<u32> {
        simplified(&prism(around, rows)).history.level(0).iter().map(|operation| operation.vertex.0).collect()
    }

    fn simplified(mesh: &IndexedMesh) -> Simplified {
        let table = CornerTable::from_triangles(mesh.positions.len(), &mesh.triangles).unwrap();
        let (min, max) = lattice::bounds(mesh.positions.iter().copied()).unwrap();
        simplify(
            table,
            &mesh.positions,
            bitvec![0; mesh.positions.len()],
            Features::default(),
            &Lattice::over(min, max, 12),
            // A queue would begin with such rows even where none has been found.
            &Options { base_vertices: Some(20), method: Method::Stellar, ..Options::default() },
            &mut |_, _| true,
        )
        .unwrap()
    }

    /// With 30 round there are 60 vertices that would go first, and that is too few; with 34, 68.
    #[test]
    fn a_few_vertices_are_no_rows() {
        let are_first =
            |around: u32| first_level(around, 4).into_iter().all(|v| [1, 3].contains(&(v / around)));
        assert_eq!((are_first(30), are_first(34)), (false, true));
    }

    /// The rows between the ends go, the first and the third before the second, each in two levels, and nothing else with them.
    #[test]
    fn rows_of_a_wall_go_first() {
        let (around, rows) = (120, 4);
        let done = simplified(&prism(around, rows));
        for (j, (rows, count)) in
            [([1, 3], around), ([1, 3], around), ([2, 2], around / 2), ([2, 2], around / 2)]
                .into_iter()
                .enumerate()
        {
            let level = done.history.level(j);
            assert!(level.iter().all(|operation| rows.contains(&(operation.vertex.0 / around))), "{j}");
            assert_eq!(level.len() as u32, count, "{j}");
        }
        // Half a step, at most, is lost of places.
        let step = done.errors[0].max;
        assert!(done.errors[4].max < 1.5 * step, "{:?}", &done.errors[..5]);
    }
}
