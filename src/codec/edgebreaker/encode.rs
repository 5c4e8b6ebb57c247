//! Writing: the traversal forwards, the symbols backwards.

use super::{Models, Symbol, cap};
use crate::entropy::BitCoder;
use crate::mesh::{Corner, CornerTable, Vertex};
use crate::refine::Roots;
use bitvec::vec::BitVec;

/// Bits that parts of a connectivity took.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bits {
    /// Symbols of the triangles of the mesh.
    pub symbols: f64,
    /// Symbols of the triangles of caps, and which vertices are their tips: the boundary loops.
    pub loops: f64,
    /// What closed the left sides of S: the handles.
    pub handles: f64,
}

/// Writes the connectivity of `table`. The number of boundary edges must be told beside it, and the number of triangles.
pub fn encode<C: BitCoder>(table: &CornerTable, roots: &Roots, coder: &mut C) -> Bits {
    let starts: Vec<Corner> = roots.corners(table).collect();
    let mut closed = table.clone();
    let first_cap = closed.vertex_slots();
    cap::close(&mut closed);
    let traversal = Traversal::new(&closed, &starts);
    let mut bits = traversal.write_symbols(table.slots(), coder);
    if closed.slots() > table.slots() {
        let before = coder.spent();
        traversal.write_caps(&closed, first_cap, &starts, &mut Models::default(), coder);
        bits.loops += coder.spent() - before;
    }
    bits
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

    /// Writes the symbols, last first. Triangles from `first_cap` on belong to caps.
    fn write_symbols<C: BitCoder>(&self, first_cap: usize, coder: &mut C) -> Bits {
        let mut models = Models::default();
        let mut reader = super::decode::Builder::default();
        let mut handles = self.handles.iter().rev().peekable();
        let mut bits = Bits::default();
        for (number, &symbol) in self.symbols.iter().enumerate().rev() {
            let before = coder.spent();
            // The builder is the reader's own; it gives the contexts.
            if let Some((count, last)) = reader.context() {
                models.symbol(coder, count, last, Some(symbol));
            }
            let is_cap = self.entries[number].triangle().index() >= first_cap;
            *if is_cap { &mut bits.loops } else { &mut bits.symbols } += coder.spent() - before;
            let mut handle = None;
            if symbol == Symbol::S {
                let before = coder.spent();
                let known = handles.next_if(|h| h.0 == number as u32);
                let known = known.map(|&(split, by, left)| (by - split, left));
                handle = models.handle(coder, known).expect("a distance between triangles is a number");
                bits.handles += coder.spent() - before;
            }
            reader.add(symbol, handle).expect("the traversal of a closed manifold can be built again");
        }
        bits
    }

    /// Writes which vertices are tips of caps, as far as that needs telling: those from `first_cap` on.
    fn write_caps<C: BitCoder>(
        &self,
        table: &CornerTable,
        first_cap: usize,
        starts: &[Corner],
        models: &mut Models,
        coder: &mut C,
    ) {
        let is_cap = |v: Vertex| v.index() >= first_cap;
        let mut seen: BitVec = BitVec::repeat(false, table.vertex_slots());
        let mut is_first: BitVec = BitVec::repeat(false, table.slots());
        for start in starts {
            is_first.set(start.triangle().index(), true);
        }
        for c in self.entries.iter().flat_map(|c| [*c, c.next(), c.prev()]) {
            let v = table.vertex(c);
            if seen.replace(v.index(), true) {
                continue;
            }
            let settled = |c: Corner| {
                let beside = [c.next(), c.prev()].map(|c| table.vertex(c));
                is_first[c.triangle().index()] || beside.iter().any(|&w| is_cap(w) && seen[w.index()])
            };
            if !table.fan(v).any(settled) {
                models.is_cap(coder, table.valence(v), is_cap(v));
            }
        }
    }
}
