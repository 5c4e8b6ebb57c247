//! Writing: the traversal forwards, the symbols backwards.

use super::{Models, Symbol, cap};
use crate::entropy::BitCoder;
use crate::mesh::{Corner, CornerTable};
use crate::refine::Roots;
use bitvec::vec::BitVec;

/// Writes the connectivity of `table`. The number of boundary edges must be told beside it, and the number of triangles.
pub fn encode<C: BitCoder>(table: &CornerTable, roots: &Roots, coder: &mut C) {
    let starts: Vec<Corner> = roots.corners(table).collect();
    let mut closed = table.clone();
    let first_cap = closed.vertex_slots();
    cap::close(&mut closed);
    let traversal = Traversal::new(&closed, &starts);
    traversal.write(&closed, first_cap, coder);
}

/// What the traversal meets, in its order.
struct Traversal {
    /// The corner each triangle is entered at.
    entries: Vec<Corner>,
    symbols: Vec<Symbol>,
    /// For an S triangle whose left gate was closed from the other side: which triangle did it, and whether over its left edge.
    handles: Vec<(u32, u32, bool)>,
}

const UNVISITED: u32 = u32::MAX;

impl Traversal {
    fn new(table: &CornerTable, starts: &[Corner]) -> Self {
        let mut this = Self {
            entries: Vec::with_capacity(table.triangle_count()),
            symbols: Vec::with_capacity(table.triangle_count()),
            handles: Vec::new(),
        };
        let mut order = vec![UNVISITED; table.slots()];
        let mut marked: BitVec = BitVec::repeat(false, table.vertex_slots());
        for &start in starts {
            let (u, w) = table.edge(start);
            marked.set(u.index(), true);
            marked.set(w.index(), true);
            this.component(table, start, &mut order, &mut marked);
        }
        this.handles.sort_unstable();
        this
    }

    fn component(&mut self, table: &CornerTable, start: Corner, order: &mut [u32], marked: &mut BitVec) {
        // Gates left behind by S, each with the number of its triangle.
        let mut stack: Vec<(Corner, u32)> = Vec::new();
        let mut at = start;
        loop {
            let number = self.entries.len() as u32;
            order[at.triangle().index()] = number;
            self.entries.push(at);
            let (right, left) = (table.opposite(at.next()), table.opposite(at.prev()));
            let open = |c: Corner| order[c.triangle().index()] == UNVISITED;
            let symbol = if !marked.replace(table.vertex(at).index(), true) {
                Symbol::C
            } else {
                match (open(right), open(left)) {
                    (true, true) => Symbol::S,
                    (true, false) => Symbol::L,
                    (false, true) => Symbol::R,
                    (false, false) => Symbol::E,
                }
            };
            self.symbols.push(symbol);
            at = match symbol {
                Symbol::C | Symbol::L => right,
                Symbol::R => left,
                Symbol::S => {
                    stack.push((left, number));
                    right
                }
                Symbol::E => loop {
                    let Some((gate, split)) = stack.pop() else { return };
                    let by = order[gate.triangle().index()];
                    if by == UNVISITED {
                        break gate;
                    }
                    self.handles.push((split, by, gate == self.entries[by as usize].prev()));
                },
            };
        }
    }

    fn write<C: BitCoder>(&self, table: &CornerTable, first_cap: usize, coder: &mut C) {
        let mut models = Models::default();
        let mut reader = super::decode::Builder::default();
        let mut handles = self.handles.iter().rev().peekable();
        for (number, &symbol) in self.symbols.iter().enumerate().rev() {
            // The builder is the reader's own; it gives the contexts.
            if let Some((count, last)) = reader.context() {
                models.symbol(coder, count, last, Some(symbol));
            }
            let mut handle = None;
            if symbol == Symbol::S {
                let known =
                    handles.next_if(|h| h.0 == number as u32).map(|&(split, by, left)| (by - split, left));
                handle = models.handle(coder, known).expect("a distance between triangles is a number");
            }
            reader.add(symbol, handle).expect("the traversal of a closed manifold can be built again");
        }
        let mut seen: BitVec = BitVec::repeat(false, table.vertex_slots());
        for c in self.entries.iter().flat_map(|c| [*c, c.next(), c.prev()]) {
            let v = table.vertex(c);
            if !seen.replace(v.index(), true) {
                models.is_cap(coder, table.valence(v), v.index() >= first_cap);
            }
        }
    }
}
