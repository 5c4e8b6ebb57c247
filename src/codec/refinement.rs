//! A refinement level, operation by operation: splits with positions and flips, face splits, attachments (spec §5.3 to §5.5).

mod flips;
mod models;
mod priors;
mod splits;
mod star;

use super::context;
use super::extents::{Extents, Length};
use super::lift::Cells;
use super::position::PositionModels;
use super::vector::truncate;
use super::walk::Walk;
use crate::entropy::{BitCoder, CodingError};
use crate::error::Result;
use crate::limits::make_room;
use crate::mesh::{Corner, CornerTable, Vertex};
use crate::refine::{Carried, ProgressiveMesh, Site, from_cell, stellar};
use splits::{Clue, Round};
use star::LinkEdge;

pub use models::SegmentModels;
pub use priors::known;

/// Most triangles in the star of a new vertex; no flip is asked for beyond it (spec §5.3).
pub const MAX_STAR: usize = 64;

/// What a writer knows of the operations ahead. A reader's answers are never asked for, but for the number of the next vertex.
pub trait Answers {
    /// Whether the edge opposite to `k` is split; the operation is then the current one.
    fn split(&mut self, table: &CornerTable, k: Corner) -> bool;
    /// Whether the link edge opposite to `c`, at the current vertex, is flipped.
    fn flip(&self, table: &CornerTable, c: Corner) -> bool;
    /// Whether the triangle at `c` is split; the operation is then the current one.
    fn face(&mut self, table: &CornerTable, c: Corner) -> bool;
    /// Whether a triangle grows on the boundary edge opposite to `k`; the operation is then the current one.
    fn attach(&mut self, table: &CornerTable, k: Corner) -> bool;
    /// The number of the current operation's vertex.
    fn vertex(&self, mesh: &ProgressiveMesh) -> Vertex;
    /// Its position, at full scale.
    fn position(&self) -> [i32; 3];
}

/// A reader knows nothing but that vertices are numbered by birth.
#[derive(Clone, Copy, Debug, Default)]
pub struct Unknown;

impl Answers for Unknown {
    fn split(&mut self, _: &CornerTable, _: Corner) -> bool {
        false
    }
    fn flip(&self, _: &CornerTable, _: Corner) -> bool {
        false
    }
    fn face(&mut self, _: &CornerTable, _: Corner) -> bool {
        false
    }
    fn attach(&mut self, _: &CornerTable, _: Corner) -> bool {
        false
    }
    fn vertex(&self, mesh: &ProgressiveMesh) -> Vertex {
        Vertex(mesh.positions.len() as u32)
    }
    fn position(&self) -> [i32; 3] {
        [0; 3]
    }
}

/// One operation as it was carried out.
#[derive(Clone, Debug)]
pub struct Inserted {
    /// The new vertex.
    pub vertex: Vertex,
    /// Where it was inserted: its parents.
    pub site: Site,
    /// The link edges flipped, start and end, in order.
    pub flips: Vec<[Vertex; 2]>,
    /// The corners at it that faced these edges.
    pub turned: Vec<Corner>,
    /// The corners at it: those in new triangles, then those in triangles that were there before and have been rewritten.
    pub star: Vec<Corner>,
    /// How many of its triangles are new.
    pub created: usize,
    /// By how much the ends of the edge have moved, where it was a split that lifts them.
    pub lift: Option<[i32; 3]>,
}

impl Default for Inserted {
    fn default() -> Self {
        let site = Site::Edge(Vertex::NONE, Vertex::NONE);
        let (flips, turned, star) = (Vec::new(), Vec::new(), Vec::new());
        Self { vertex: Vertex::NONE, site, flips, turned, star, created: 0, lift: None }
    }
}

impl Inserted {
    /// What it has done to triangles.
    pub fn carried(&self) -> Carried<'_> {
        Carried { site: self.site, star: &self.star, created: self.created, flips: &self.turned }
    }
}

/// Why a refinement cannot be read.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RefinementError {
    /// The code ends early or holds an impossible number.
    #[error("{0}")]
    Coding(#[from] CodingError),
    /// A position lies outside the lattice.
    #[error("position {0:?} is off the lattice")]
    OffLattice([i32; 3]),
}

/// Where fewer than one in so many vertices has been inserted with a lift, it is quicker to measure the three that it moves than all.
const FEW: usize = 12;

/// A triangle in the star of a vertex of this level; others have at most three edges beyond which there is nothing or a star.
const STAR: u8 = u8::MAX;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Pass {
    Split,
    Face,
    Attach,
    Done,
}

/// An edge that may be split; or, in the face pass, a triangle, by a corner on the `left`.
#[derive(Clone, Copy, Debug)]
struct Asked {
    /// The corner on its left, and on its right where there is one.
    left: Corner,
    right: Corner,
    length: Length,
    /// What rich models know besides.
    round: Round,
}

impl Asked {
    const NONE: Self =
        Self { left: Corner::NONE, right: Corner::NONE, length: Length::NONE, round: Round::NONE };
}

/// Edges that are looked at together, before the first of them is asked for (spec §5.5.2).
const AHEAD: usize = 64;
/// Link edges of a star that are looked at: each flip takes one away and adds two, and no star has more than [`MAX_STAR`] triangles.
const QUEUE: usize = 2 * MAX_STAR;
const _: () = assert!(QUEUE.is_power_of_two());
// An index is masked where it is known to be within its list: the mask then changes nothing, and spares the check.
const _: () = assert!(AHEAD.is_power_of_two());

/// The state of a level under way; it survives from atom to atom.
#[derive(Debug)]
pub struct LevelPass {
    walk: Walk,
    extents: Extents,
    /// By slot: [`STAR`] for a triangle in the star of a vertex of this level, else how many of its edges are boundary or have
    /// a star beyond.
    states: Vec<u8>,
    /// Boundary edges of the coarser level, start and end, in walk order.
    boundary: Vec<(Vertex, Vertex)>,
    pass: Pass,
    cursor: usize,
    /// Of the next edges those that no star had reached when they were looked at, how many they are, and how many of them are done.
    asked: [Asked; AHEAD],
    asked_count: usize,
    asked_done: usize,
    /// What splits are told by, and whether flips are by rows.
    clue: Clue,
    flips_by_rows: bool,
    cells: Cells,
    /// Of the cells, the least and the largest coordinate.
    range: [i32; 2],
    /// The vertices that lifts have moved since extents were measured, and how many there are; the list ends where they are many.
    lifted: Vec<[Vertex; 3]>,
    lifts: usize,
    /// Of the star under way: the link edges to be looked at.
    queue: [LinkEdge; QUEUE],
    inserted: Inserted,
    /// Bits that positions took, where this side writes.
    pub position_bits: f64,
}

/// Everything that a decision may look at or change.
struct Under<'a, C, A> {
    mesh: &'a mut ProgressiveMesh,
    models: &'a mut SegmentModels,
    coder: &'a mut C,
    answers: &'a mut A,
}

impl LevelPass {
    /// Walks the coarser level. `cells` are the finer level's.
    pub fn new(mesh: &ProgressiveMesh, cells: Cells) -> Self {
        let mut this = Self {
            walk: Walk::default(),
            extents: Extents::new(mesh, cells.precision),
            states: Vec::new(),
            boundary: Vec::new(),
            pass: Pass::Split,
            cursor: 0,
            asked: [Asked::NONE; AHEAD],
            asked_count: 0,
            asked_done: 0,
            clue: Clue::Beside,
            flips_by_rows: false,
            cells,
            range: cells.range(),
            lifted: Vec::new(),
            lifts: 0,
            queue: [LinkEdge::NONE; QUEUE],
            inserted: Inserted::default(),
            position_bits: 0.0,
        };
        this.walk(mesh);
        this
    }

    /// The pass of the next level, for the mesh that this one has led to. It is the same as a new one: extents need not be
    /// measured again unless vertices have moved, and lists keep their memory.
    pub fn next(mut self, mesh: &ProgressiveMesh, cells: Cells) -> Self {
        if cells.precision != self.cells.precision || self.lifts > self.lifted.len() {
            self.extents.measure(mesh, cells.precision);
        } else {
            for &v in self.lifted.iter().flatten() {
                self.extents.follow(mesh, v);
            }
        }
        self.lifted.clear();
        (self.cells, self.range, self.lifts) = (cells, cells.range(), 0);
        self.pass = Pass::Split;
        self.cursor = 0;
        (self.asked_count, self.asked_done) = (0, 0);
        self.position_bits = 0.0;
        self.extents.reserve(mesh.positions.capacity());
        self.walk(mesh);
        self
    }

    /// Bytes that a pass takes over a mesh with room for so much, of so many triangles and boundary edges when the pass begins.
    pub fn bytes([vertices, triangles]: [usize; 2], walked: usize, boundary: usize) -> usize {
        let lists = Walk::bytes(walked, boundary) + 3 * size_of::<(Vertex, Vertex)>() * boundary;
        let lifted = 2 * size_of::<[Vertex; 3]>() * vertices / FEW;
        lists + triangles.max(walked) + Extents::BYTES_A_VERTEX * vertices + lifted
    }

    /// Takes as much room as the mesh has been given.
    pub fn make_room(&mut self, mesh: &ProgressiveMesh) -> Result<()> {
        let [vertices, triangles] = mesh.room();
        let more = triangles.saturating_sub(self.states.len());
        make_room(&mut self.states, more)?;
        self.extents.make_room(vertices)
    }

    /// Whether extents are what a new measurement would find.
    #[cfg(all(test, feature = "encode"))]
    pub(super) fn is_measured(&self, mesh: &ProgressiveMesh) -> bool {
        let fresh = Extents::new(mesh, self.cells.precision);
        let used = |v: &Vertex| mesh.table.corner_of(*v).is_some();
        (0..mesh.positions.len() as u32)
            .map(Vertex)
            .filter(used)
            .all(|v| self.extents.extent(v) == fresh.extent(v))
    }

    fn walk(&mut self, mesh: &ProgressiveMesh) {
        let table = &mesh.table;
        self.states.clear();
        self.states.reserve_exact(table.capacity());
        // Where the walk has been is no longer of interest afterwards.
        self.walk.again(table, &mesh.roots, &mut self.states);
        self.states.fill(0);
        self.boundary.clear();
        for &k in &self.walk.boundary {
            self.states[k.triangle().index()] += 1;
            self.boundary.push(table.edge(k));
        }
    }

    /// Codes the decisions up to the next operation and carries it out; `None` where the level has no further one.
    ///
    /// # Errors
    /// [`RefinementError`]; the mesh is then a valid one, with or without the operation under way.
    pub fn step<C: BitCoder, A: Answers>(
        &mut self,
        mesh: &mut ProgressiveMesh,
        models: &mut SegmentModels,
        coder: &mut C,
        answers: &mut A,
    ) -> Result<Option<&Inserted>, RefinementError> {
        let mut under = Under { mesh, models, coder, answers };
        loop {
            let found = match self.pass {
                Pass::Split => self.next_split(&mut under)?,
                Pass::Face => self.next_face(&mut under)?,
                Pass::Attach => self.next_attach(&mut under)?,
                Pass::Done => return Ok(None),
            };
            if found {
                return Ok(Some(&self.inserted));
            }
            under.coder.check()?;
            self.cursor = 0;
            self.pass = match self.pass {
                Pass::Split => Pass::Face,
                Pass::Face => Pass::Attach,
                _ => Pass::Done,
            };
        }
    }

    fn next_split<C: BitCoder, A: Answers>(
        &mut self,
        under: &mut Under<C, A>,
    ) -> Result<bool, RefinementError> {
        loop {
            while self.asked_done < self.asked_count {
                let Asked { left: k, right: o, length, round } = self.asked[self.asked_done & (AHEAD - 1)];
                self.asked_done += 1;
                let left = self.states[k.triangle().index()];
                if left == STAR {
                    continue;
                }
                let closed = if o.is_some() {
                    let right = self.states[o.triangle().index()];
                    if right == STAR {
                        continue;
                    }
                    left + right
                } else {
                    left - 1
                };
                let known = || under.answers.split(&under.mesh.table, k);
                if under.models.split.code(
                    under.coder,
                    o.is_none(),
                    closed,
                    (length, self.clue, round),
                    known,
                ) {
                    under.coder.check()?;
                    self.split(under, k)?;
                    return Ok(true);
                }
            }
            if self.cursor >= self.walk.edges.len() {
                return Ok(false);
            }
            if self.cursor == 0 {
                (self.clue, self.flips_by_rows) = under.models.choose(under.coder);
            }
            self.look_ahead::<C>(&under.mesh.table, under.models);
        }
    }

    /// Looks at the next edges, all at once: what has to be waited for is waited for together.
    fn look_ahead<C: BitCoder>(&mut self, table: &CornerTable, models: &SegmentModels) {
        let from = self.cursor;
        self.cursor = self.walk.edges.len().min(from + AHEAD);
        let next = self.walk.edges.len().min(self.cursor + AHEAD);
        for &k in &self.walk.edges[self.cursor..next] {
            table.prefetch(k);
        }
        let mut count = 0;
        for &k in &self.walk.edges[from..self.cursor] {
            let o = table.opposite(k);
            table.prefetch(o);
            let right = if o.is_some() { self.states[o.triangle().index()] } else { 0 };
            let reached = self.states[k.triangle().index()] == STAR || right == STAR;
            self.asked[count & (AHEAD - 1)] = Asked { left: k, right: o, ..Asked::NONE };
            count += usize::from(!reached);
        }
        // A writer tries both lengths; rich models, which mix, go by no clue alone.
        match self.clue {
            Clue::Alone if !C::ENCODES => {
                for asked in &mut self.asked[..count] {
                    let (a, b) = table.edge(asked.left);
                    asked.length = self.extents.length_alone(a, b);
                }
            }
            Clue::Rows if !C::ENCODES => {}
            _ => {
                for asked in &mut self.asked[..count] {
                    let (a, b) = table.edge(asked.left);
                    asked.length = self.extents.length(a, b);
                }
            }
        }
        if models.are_rich() {
            self.look_round(table, count);
        } else if models.split.asks_for_rows(self.clue) {
            for asked in &mut self.asked[..count] {
                let round = Self::round(table, asked);
                asked.round = Round::of_edges(round.map(|v| self.extents.at(v).edges));
            }
        }
        (self.asked_count, self.asked_done) = (count, 0);
    }

    /// The ends of an edge asked for, and the vertices opposite to it. Of a boundary edge, the triangle on its left stands on both sides.
    #[inline]
    fn round(table: &CornerTable, asked: &Asked) -> [Vertex; 4] {
        let [l, a, b] = table.vertices_from(asked.left);
        [a, b, l, if asked.right.is_some() { table.vertex(asked.right) } else { l }]
    }

    /// What rich models know of the first `count` edges asked for.
    fn look_round(&mut self, table: &CornerTable, count: usize) {
        for four in self.asked[..count].chunks_mut(4) {
            let last = four.len() - 1;
            let round: [[Vertex; 4]; 4] = std::array::from_fn(|i| Self::round(table, &four[i.min(last)]));
            let cells = |k: usize| round.map(|at| self.extents.cell(at[k]));
            let shapes = context::edges(cells(2), cells(0), cells(1), cells(3));
            for (i, asked) in four.iter_mut().enumerate() {
                let edges = round[i].map(|v| self.extents.at(v).edges);
                let at = round[i].map(|v| self.extents.cell(v));
                asked.round = Round::new(shapes[i].angle, at, edges, asked.right.is_none());
            }
        }
    }

    fn next_face<C: BitCoder, A: Answers>(
        &mut self,
        under: &mut Under<C, A>,
    ) -> Result<bool, RefinementError> {
        loop {
            if self.asked_done == self.asked_count {
                if self.cursor >= self.walk.triangles.len() {
                    return Ok(false);
                }
                self.look_ahead_at_triangles();
                continue;
            }
            let c = self.asked[self.asked_done & (AHEAD - 1)].left;
            self.asked_done += 1;
            if self.states[c.triangle().index()] == STAR {
                continue;
            }
            if !under.coder.bit(&mut under.models.face, || under.answers.face(&under.mesh.table, c)) {
                continue;
            }
            under.coder.check()?;
            let [x, y, z] = [c, c.next(), c.prev()].map(|c| under.mesh.table.vertex(c));
            let [px, py, pz] = [x, y, z].map(|w| self.extents.cell(w));
            let (start, middle) = (self.cell(x), ((py - px) + (pz - px)) * (1.0 / 3.0));
            let size = (py - px).dot(py - px).max((pz - px).dot(pz - px)).sqrt();
            let (v, position) = self
                .code_vertex(under, |models, coder, known| models.near(coder, start, middle, size, known))?;
            stellar::split_face(&mut under.mesh.table, c, v);
            self.place(under.mesh, v, position);
            self.begin(&under.mesh.table, v, Site::Face(x, y, z), 2);
            let of_old = |corner: &Corner| corner.triangle() == c.triangle();
            let (old, new): (Vec<_>, Vec<_>) = under.mesh.table.fan(v).partition(of_old);
            self.star(&new);
            self.star(&old);
            self.end(under.mesh, x);
            return Ok(true);
        }
    }

    /// As [`LevelPass::look_ahead`], but at triangles: whether a star has reached one is as good as random, and a branch in the midst
    /// of decisions is dear.
    fn look_ahead_at_triangles(&mut self) {
        let from = self.cursor;
        self.cursor = self.walk.triangles.len().min(from + AHEAD);
        let mut count = 0;
        for &c in &self.walk.triangles[from..self.cursor] {
            self.asked[count & (AHEAD - 1)].left = c;
            count += usize::from(self.states[c.triangle().index()] != STAR);
        }
        (self.asked_count, self.asked_done) = (count, 0);
    }

    fn next_attach<C: BitCoder, A: Answers>(
        &mut self,
        under: &mut Under<C, A>,
    ) -> Result<bool, RefinementError> {
        while let Some(&(a, b)) = self.boundary.get(self.cursor) {
            self.cursor += 1;
            // The triangle behind a→b may have been rewritten, so the edge is found through its start.
            let k = under.mesh.table.corner_of(a).prev();
            if under.mesh.table.edge(k) != (a, b) {
                continue;
            }
            if !under.coder.bit(&mut under.models.attach, || under.answers.attach(&under.mesh.table, k)) {
                continue;
            }
            under.coder.check()?;
            let edge = self.extents.cell(b) - self.extents.cell(a);
            let (start, middle, size) = (self.cell(a), edge * 0.5, edge.dot(edge).sqrt());
            let (v, position) = self
                .code_vertex(under, |models, coder, known| models.near(coder, start, middle, size, known))?;
            stellar::attach(&mut under.mesh.table, k, v);
            self.place(under.mesh, v, position);
            self.begin(&under.mesh.table, v, Site::Attach(a, b), 1);
            self.star(&[under.mesh.table.corner_of(v)]);
            self.end(under.mesh, a);
            return Ok(true);
        }
        Ok(false)
    }

    /// Whether a vertex may be there.
    #[inline]
    fn holds(&self, cell: [i32; 3]) -> bool {
        cell.iter().all(|x| (self.range[0]..=self.range[1]).contains(x))
    }

    #[inline]
    fn cell(&self, v: Vertex) -> [i32; 3] {
        self.extents.cell(v).coordinates().map(truncate)
    }

    #[inline]
    fn place(&mut self, mesh: &mut ProgressiveMesh, v: Vertex, position: [i32; 3]) {
        mesh.set_position(v, position);
        self.extents.put(v, position);
    }

    /// Codes where the next vertex lies. Returns its number and full-scale position.
    fn code_vertex<C: BitCoder, A: Answers>(
        &mut self,
        under: &mut Under<C, A>,
        code: impl FnOnce(&mut PositionModels, &mut C, [i32; 3]) -> Result<[i32; 3], CodingError>,
    ) -> Result<(Vertex, [i32; 3]), RefinementError> {
        let precision = self.cells.precision;
        let truth = if C::ENCODES { under.answers.position().map(|x| x >> precision) } else { [0; 3] };
        let before = under.coder.spent();
        let cell = code(&mut under.models.position, under.coder, truth)?;
        self.position_bits += under.coder.spent() - before;
        if !self.holds(cell) {
            return Err(RefinementError::OffLattice(cell));
        }
        under.coder.check()?;
        Ok((under.answers.vertex(under.mesh), cell.map(|x| from_cell(x, precision))))
    }
}
