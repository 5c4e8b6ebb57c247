//! What the writer of a level knows: which triangle of the coarser level belongs to which operation.

use super::refinement::Answers;
use crate::mesh::{Corner, CornerTable, Vertex};
use crate::refine::{History, Operation, ProgressiveMesh, Site};

/// The operations of one level, laid out on the coarser level's mesh before any of them is applied.
#[derive(Debug)]
pub struct LevelAnswers<'a> {
    operations: &'a [Operation],
    /// For each triangle of the coarser level the operation whose star it will be part of.
    owner: Vec<u32>,
    /// For each vertex the attachment on the boundary edge that starts there.
    attach: Vec<(Vertex, u32)>,
    positions: &'a [[i32; 3]],
    current: u32,
}

const NONE: u32 = u32::MAX;

impl<'a> LevelAnswers<'a> {
    /// Lays out level `j` of `history` on `table`, level `j + 1`. `positions` tell for each vertex where the
    /// level's splits put it, at full scale.
    pub fn new(table: &CornerTable, history: &'a History, j: usize, positions: &'a [[i32; 3]]) -> Self {
        let operations = history.level(j);
        let mut owner = vec![NONE; table.slots()];
        let mut attach = Vec::new();
        for (number, operation) in operations.iter().enumerate() {
            let number = number as u32;
            match operation.site {
                Site::Edge(a, b) => {
                    let k = table.find_directed_edge(a, b);
                    own(table, &mut owner, k, history.flips(operation), number);
                }
                Site::Face(a, b, _) => owner[table.find_directed_edge(a, b).triangle().index()] = number,
                Site::Attach(a, _) => attach.push((a, number)),
            }
        }
        attach.sort_unstable();
        Self { operations, owner, attach, positions, current: 0 }
    }

    fn operation(&self) -> &Operation {
        &self.operations[self.current as usize]
    }

    fn take(&mut self, number: u32, fits: impl FnOnce(&Site) -> bool) -> bool {
        let yes = number != NONE && fits(&self.operations[number as usize].site);
        if yes {
            self.current = number;
        }
        yes
    }
}

/// Marks the triangles that the operation at `k` will rewrite: the two of the split, and the far one of each flip.
fn own(table: &CornerTable, owner: &mut [u32], k: Corner, flips: &[Vertex], number: u32) {
    let mut queue = Vec::with_capacity(4 + 2 * flips.len());
    for c in [k, table.opposite(k)].into_iter().filter(|c| c.is_some()) {
        owner[c.triangle().index()] = number;
        queue.extend([c.next(), c.prev()]);
    }
    // The queue is the reader's, but of old triangles: a corner here faces the link edge from outside the star's far side.
    let mut flips = flips.iter().copied().peekable();
    let mut head = 0;
    while let (Some(&c), Some(&p)) = (queue.get(head), flips.peek()) {
        head += 1;
        let far = table.opposite(c);
        if table.vertex(c.next()) != p || far.is_none() || owner[far.triangle().index()] == number {
            continue;
        }
        flips.next();
        owner[far.triangle().index()] = number;
        queue.extend([far.next(), far.prev()]);
    }
    debug_assert!(flips.peek().is_none(), "the flips of a recorded operation are those of its star");
}

impl Answers for LevelAnswers<'_> {
    fn split(&mut self, table: &CornerTable, k: Corner) -> bool {
        let (x, y) = table.edge(k);
        self.take(self.owner[k.triangle().index()], |site| match *site {
            Site::Edge(a, b) => (a, b) == (x, y) || (b, a) == (x, y),
            _ => false,
        })
    }

    fn flip(&self, table: &CornerTable, c: Corner) -> bool {
        self.owner.get(table.opposite(c).triangle().index()) == Some(&self.current)
    }

    fn face(&mut self, _: &CornerTable, c: Corner) -> bool {
        self.take(self.owner[c.triangle().index()], |site| matches!(site, Site::Face(..)))
    }

    fn attach(&mut self, table: &CornerTable, k: Corner) -> bool {
        let (x, _) = table.edge(k);
        let found = self.attach.binary_search_by_key(&x, |&(a, _)| a);
        self.take(found.map_or(NONE, |i| self.attach[i].1), |site| matches!(site, Site::Attach(..)))
    }

    fn vertex(&self, _: &ProgressiveMesh) -> Vertex {
        self.operation().vertex
    }

    fn position(&self) -> [i32; 3] {
        self.positions[self.operation().vertex.index()]
    }
}
