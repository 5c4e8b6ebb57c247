//! Reading: triangles are glued onto loops of open edges, last symbol first.

use super::{Models, Symbol};
use crate::entropy::{BitCoder, CodingError};
use crate::limits::Budget;
use crate::mesh::corner_table::MAX_TRIANGLES;
use crate::mesh::{Corner, CornerMap, CornerTable, Triangle, Vertex};
use crate::refine::Roots;
use bitvec::vec::BitVec;

/// A connectivity and its root edges.
#[derive(Debug)]
pub struct Connectivity {
    /// A manifold that passed [`CornerTable::check`].
    pub table: CornerTable,
    /// One root edge for each component, in the order of the writer's.
    pub roots: Roots,
    /// Bytes debited for reading it, which are enough to number it anew; to be given back then.
    pub held: usize,
}

/// Why a connectivity payload cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum ConnectivityError {
    /// The code ends early or holds an impossible number.
    #[error("{0}")]
    Coding(#[from] CodingError),
    /// A symbol cannot follow those before it.
    #[error("triangle {0} cannot be attached")]
    Symbol(usize),
    /// Open edges remain.
    #[error("the surface is not closed")]
    Open,
    /// The result is not what the file says, or no manifold.
    #[error("{0}")]
    Mesh(String),
    /// A limit was reached.
    #[error("{0}")]
    Limit(#[from] crate::error::Error),
}

/// Reads the connectivity of a mesh of `triangles` triangles and `boundary` boundary edges.
///
/// # Errors
/// [`ConnectivityError`]; nothing panics, and memory grows with what has been read.
pub fn decode<C: BitCoder>(
    coder: &mut C,
    triangles: u32,
    boundary: u32,
    budget: &mut Budget,
) -> Result<Connectivity, ConnectivityError> {
    let total = triangles as usize + boundary as usize;
    if total >= MAX_TRIANGLES {
        return Err(ConnectivityError::Mesh(
            "more triangles and boundary edges than corners have numbers".into(),
        ));
    }
    let mut models = Models::default();
    let mut builder = Builder::default();
    for number in 0..total {
        if number.is_multiple_of(CHUNK) {
            let chunk = CHUNK.min(total - number);
            budget.take_memory(chunk, BYTES_A_TRIANGLE)?;
            budget.take_work(chunk as u64)?;
        }
        let symbol = match builder.context() {
            Some((count, last)) => models.symbol(coder, count, last, None),
            None => Symbol::E,
        };
        let handle = if symbol == Symbol::S { models.handle(coder, None)? } else { None };
        builder.add(symbol, handle).ok_or(ConnectivityError::Symbol(number))?;
        coder.check()?;
    }
    let (table, roots) = builder.finish(&mut models, coder, boundary)?;
    Ok(Connectivity { table, roots, held: total * BYTES_A_TRIANGLE })
}

/// Triangles that the budget is debited for at a time.
const CHUNK: usize = 1 << 12;
/// While building, per corner opposite, next, previous and the count, in lists of which one has just been copied to another twice as long;
/// per triangle a place on the stack and among the first ones, alike. It is no less than what comes after: numbers of vertices and two
/// tables with their walk.
const BYTES_A_TRIANGLE: usize = 2 * 3 * 13 + 12 + 2 * 12;

/// The surface so far, in reading order, bounded by loops of open edges. An edge is named by the corner opposite to it.
#[derive(Debug, Default)]
pub(super) struct Builder {
    opposites: CornerMap<Corner>,
    /// The loops: the open edges behind and before each; `NONE` at both for an edge that is not open.
    next: CornerMap<Corner>,
    prev: CornerMap<Corner>,
    /// Triangles round the start of each open edge, up to 255.
    counts: CornerMap<u8>,
    open: usize,
    /// The edges that wait for a triangle; the last is the active one.
    stack: Vec<Corner>,
    last: Option<Symbol>,
    /// The first triangles of components: the last ones read.
    starts: Vec<Corner>,
}

impl Builder {
    /// What the next symbol is read under; `None` where a component begins, with E.
    pub(super) fn context(&self) -> Option<(u8, Symbol)> {
        let &active = self.stack.last()?;
        Some((self.counts[active], self.last.unwrap_or(Symbol::E)))
    }

    /// Adds a triangle; `None` where it does not fit.
    pub(super) fn add(&mut self, symbol: Symbol, handle: Option<(u32, bool)>) -> Option<()> {
        let t = self.opposites.0.len() as u32;
        // Edges of the new triangle: y→z, where it was entered, z→x on its right, x→y on its left.
        let [gate, right, left] = Triangle(t).corners();
        self.opposites.0.push([Corner::NONE; 3]);
        self.next.0.push([Corner::NONE; 3]);
        self.prev.0.push([Corner::NONE; 3]);
        self.counts.0.push([1; 3]);
        self.last = Some(symbol);
        if symbol == Symbol::E {
            self.link(gate, right);
            self.link(right, left);
            self.link(left, gate);
            self.open += 3;
            self.stack.push(gate);
            return Some(());
        }
        let a = self.stack.pop()?;
        if !self.is_open(a) {
            return None;
        }
        let (before, after) = (self.prev[a], self.next[a]);
        match symbol {
            Symbol::R | Symbol::L => {
                let (glued, first, second) =
                    if symbol == Symbol::R { (left, gate, right) } else { (right, left, gate) };
                self.counts[first] = self.counts[a].saturating_add(1);
                self.grow(after);
                self.glue(a, glued);
                self.link(before, first);
                self.link(first, second);
                self.link(second, after);
                self.open += 1;
            }
            Symbol::C | Symbol::S => {
                let b = match (symbol, handle) {
                    (Symbol::C, _) => before,
                    (_, None) => self.stack.pop()?,
                    (_, Some((distance, is_left))) => {
                        let by = t.checked_sub(distance).filter(|_| distance > 0)?;
                        Triangle(by).corner(if is_left { 2 } else { 1 })
                    }
                };
                // y and z must differ: the edge behind a must not be b.
                if b == a || b == after || !self.is_open(b) {
                    return None;
                }
                let (before_b, after_b) = (self.prev[b], self.next[b]);
                self.counts[gate] = self.counts[b].saturating_add(1);
                self.grow(after);
                if after_b != a {
                    // An edge alone would begin and end at one vertex.
                    if after_b == before {
                        return None;
                    }
                    let joined = self.counts[a].saturating_add(1);
                    let count = &mut self.counts[after_b];
                    *count = count.saturating_add(joined);
                    self.link(before, after_b);
                }
                self.glue(a, right);
                self.glue(b, left);
                self.link(before_b, gate);
                self.link(gate, after);
                self.open -= 1;
            }
            Symbol::E => unreachable!("handled above"),
        }
        let over = self.next[gate];
        if self.next[over] == gate {
            // Two open edges with the same ends: the root edge, and the component is complete.
            self.glue(gate, over);
            self.open -= 2;
            self.starts.push(gate);
            return (self.open == 0 && self.stack.is_empty()).then_some(());
        }
        self.stack.push(gate);
        Some(())
    }

    fn is_open(&self, edge: Corner) -> bool {
        self.next[edge].is_some()
    }

    fn link(&mut self, a: Corner, b: Corner) {
        self.next[a] = b;
        self.prev[b] = a;
    }

    fn grow(&mut self, edge: Corner) {
        let count = &mut self.counts[edge];
        *count = count.saturating_add(1);
    }

    /// Makes two edges one; neither is open afterwards.
    fn glue(&mut self, a: Corner, b: Corner) {
        self.opposites[a] = b;
        self.opposites[b] = a;
        for e in [a, b] {
            self.next[e] = Corner::NONE;
            self.prev[e] = Corner::NONE;
        }
    }

    /// Names the vertices, takes the caps away, checks the rest.
    fn finish<C: BitCoder>(
        self,
        models: &mut Models,
        coder: &mut C,
        boundary: u32,
    ) -> Result<(CornerTable, Roots), ConnectivityError> {
        if self.open > 0 {
            return Err(ConnectivityError::Open);
        }
        let Self { opposites, starts, next, prev, counts, .. } = self;
        drop((next, prev, counts)); // Their memory is needed.
        let closed = Closed::read(opposites, &starts, models, coder, boundary)?;
        let kept = closed.without_caps(boundary)?;
        let table = closed.table(&kept, boundary)?;
        let mut edges = Vec::with_capacity(starts.len());
        for &start in starts.iter().rev() {
            let start = kept.corner(start);
            if start.is_none() {
                return Err(ConnectivityError::Mesh("a component begins with a cap".into()));
            }
            edges.push(table.edge(start));
        }
        let roots = Roots::new(&table, edges);
        Ok((table, roots))
    }
}

/// The closed surface: its vertices have names, and some of them are caps.
struct Closed {
    opposites: CornerMap<Corner>,
    /// The vertex at each corner; by number, in the order of the writer.
    orbit: CornerMap<Vertex>,
    /// For each vertex whether it is the tip of a cap.
    caps: Vec<bool>,
}

impl Closed {
    /// Goes round each vertex, and reads where it may be a cap whether it is one. The writer's order is the reader's backwards.
    fn read<C: BitCoder>(
        opposites: CornerMap<Corner>,
        starts: &[Corner],
        models: &mut Models,
        coder: &mut C,
        boundary: u32,
    ) -> Result<Self, ConnectivityError> {
        let triangles = opposites.0.len();
        let mut is_first: BitVec = BitVec::repeat(false, triangles);
        for start in starts {
            is_first.set(start.triangle().index(), true);
        }
        let mut orbit = CornerMap::new(Vertex::NONE, triangles);
        let mut caps = Vec::new();
        for c in (0..triangles as u32).rev().flat_map(|t| Triangle(t).corners()) {
            if orbit[c].is_some() {
                continue;
            }
            let v = Vertex(caps.len() as u32);
            let (mut at, mut valence, mut settled) = (c, 0, boundary == 0);
            while orbit[at].is_none() {
                orbit[at] = v;
                valence += 1;
                settled |= is_first[at.triangle().index()];
                settled |= [at.next(), at.prev()].iter().any(|c| {
                    let w = orbit[*c];
                    w.is_some() && w != v && caps[w.index()]
                });
                at = opposites[at.next()].next();
            }
            caps.push(!settled && models.is_cap(coder, valence, false));
            coder.check()?;
        }
        Ok(Self { opposites, orbit, caps })
    }

    /// The triangles that are of no cap, in the writer's order.
    fn without_caps(&self, boundary: u32) -> Result<Kept, ConnectivityError> {
        let triangles = self.opposites.0.len();
        let is_cap = |t: usize| self.orbit.0[t].iter().any(|v| self.caps[v.index()]);
        let mut kept = Kept { place: vec![Triangle::NONE; triangles], count: 0 };
        for t in (0..triangles).rev().filter(|&t| !is_cap(t)) {
            kept.place[t] = Triangle(kept.count);
            kept.count += 1;
        }
        match triangles - kept.count as usize {
            edges if edges == boundary as usize => Ok(kept),
            edges => Err(ConnectivityError::Mesh(format!("{edges} boundary edges instead of {boundary}"))),
        }
    }

    /// The table of the triangles kept, their vertices named in the order in which they are met; checked.
    fn table(self, kept: &Kept, boundary: u32) -> Result<CornerTable, ConnectivityError> {
        let order = || (0..kept.place.len()).rev().filter(|&t| kept.place[t].is_some());
        // Caps that touch each other, or a cap that is no disc, would leave other boundary edges than these, and perhaps pieces
        // that no root edge leads to.
        let open = || order().flat_map(|t| self.opposites.0[t]).filter(|&c| kept.corner(c).is_none()).count();
        let open = if boundary > 0 { open() } else { 0 };
        if open != boundary as usize {
            return Err(ConnectivityError::Mesh(format!(
                "caps leave {open} boundary edges instead of {boundary}"
            )));
        }
        let mut names = vec![Vertex::NONE; self.caps.len()];
        let mut named = 0;
        let triangles = order().map(|t| {
            let vertices = self.orbit.0[t].map(|v| {
                let name = &mut names[v.index()];
                if name.is_none() {
                    *name = Vertex(named);
                    named += 1;
                }
                *name
            });
            (vertices, self.opposites.0[t].map(|c| kept.corner(c)))
        });
        let mut table = CornerTable::collect(self.caps.len(), kept.count as usize, triangles);
        table.truncate_vertices(named as usize);
        drop(self);
        table.check().map_err(|e| ConnectivityError::Mesh(e.to_string()))?;
        Ok(table)
    }
}

/// Where triangles of the closed surface are once the caps are taken away.
struct Kept {
    /// By triangle; `NONE` for those of caps.
    place: Vec<Triangle>,
    count: u32,
}

impl Kept {
    fn corner(&self, c: Corner) -> Corner {
        let place = self.place[c.triangle().index()];
        if place.is_none() { Corner::NONE } else { place.corner(c.place() as u32) }
    }
}
