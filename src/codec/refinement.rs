//! A refinement level, operation by operation: splits with positions and flips, face splits, attachments (spec §5.3 to §5.5).

use super::context::{self, ANGLES, RATIOS};
use super::walk::Walk;
use crate::entropy::{Bit, BitCoder, CodingError, NumberModel};
use crate::mesh::{Corner, CornerTable, Triangle, Vertex};
use crate::refine::{ProgressiveMesh, Site, from_cell, stellar};

/// Most triangles in the star of a new vertex; no flip is asked for beyond it (spec §5.3).
pub const MAX_STAR: usize = 64;

/// The models of refinements. They start afresh with each segment (spec §5.2).
#[derive(Clone, Debug)]
pub struct SegmentModels {
    split: [[[Bit; RATIOS]; 5]; 2],
    flip: [[Bit; ANGLES]; 6],
    face: Bit,
    attach: Bit,
    /// By site (edge, face, attachment) and extent.
    position: [Vec<NumberModel>; 3],
    pub(super) precision: [Bit; 3],
}

impl Default for SegmentModels {
    fn default() -> Self {
        Self {
            split: [[[Bit::NEW; RATIOS]; 5]; 2],
            flip: [[Bit::NEW; ANGLES]; 6],
            face: Bit::NEW,
            attach: Bit::NEW,
            position: std::array::from_fn(|_| vec![NumberModel::default(); 33]),
            precision: [Bit::NEW; 3],
        }
    }
}

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
    /// The starts of the link edges flipped, in order.
    pub flips: Vec<Vertex>,
    /// The triangles of its star; those that existed before the operation have been rewritten.
    pub star: Vec<Triangle>,
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

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Pass {
    Split,
    Face,
    Attach,
    Done,
}

/// The state of a level under way; it survives from atom to atom.
#[derive(Debug)]
pub struct LevelPass {
    walk: Walk,
    /// Boundary edges of the coarser level, start and end, in walk order.
    boundary: Vec<(Vertex, Vertex)>,
    pass: Pass,
    cursor: usize,
    /// Triangles that belong to the star of a vertex of this level.
    in_star: Vec<bool>,
    precision: u32,
    /// Largest coordinate of a cell.
    max: i32,
    queue: Vec<Corner>,
    ring: Vec<Vertex>,
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
    /// Fixes the walk of the coarser level. `precision` is the finer level's s, `bits` the lattice's.
    pub fn new(mesh: &ProgressiveMesh, walk: Walk, precision: u32, bits: u32) -> Self {
        let table = &mesh.table;
        let open = walk.edges.iter().filter(|&&k| table.opposite(k).is_none());
        let boundary = open.map(|&k| table.edge(k)).collect();
        let in_star = vec![false; table.slots()];
        let max = ((1u32 << (bits - precision.min(bits))) - 1) as i32;
        let (queue, ring) = (Vec::new(), Vec::new());
        Self {
            walk,
            boundary,
            pass: Pass::Split,
            cursor: 0,
            in_star,
            precision,
            max,
            queue,
            ring,
            position_bits: 0.0,
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
    ) -> Result<Option<Inserted>, RefinementError> {
        let mut under = Under { mesh, models, coder, answers };
        loop {
            let found = match self.pass {
                Pass::Split => self.next_split(&mut under)?,
                Pass::Face => self.next_face(&mut under)?,
                Pass::Attach => self.next_attach(&mut under)?,
                Pass::Done => return Ok(None),
            };
            if let Some(inserted) = found {
                self.in_star.resize(under.mesh.table.slots(), false);
                for t in &inserted.star {
                    self.in_star[t.index()] = true;
                }
                return Ok(Some(inserted));
            }
            self.cursor = 0;
            self.pass = match self.pass {
                Pass::Split => Pass::Face,
                Pass::Face => Pass::Attach,
                _ => Pass::Done,
            };
        }
    }

    #[inline]
    fn starred(&self, c: Corner) -> bool {
        self.in_star[c.triangle().index()]
    }

    fn next_split<C: BitCoder, A: Answers>(
        &mut self,
        under: &mut Under<C, A>,
    ) -> Result<Option<Inserted>, RefinementError> {
        while let Some(&k) = self.walk.edges.get(self.cursor) {
            self.cursor += 1;
            let table = &under.mesh.table;
            let o = table.opposite(k);
            if self.starred(k) || (o.is_some() && self.starred(o)) {
                continue;
            }
            let model = self.split_model(under.mesh, under.models, k, o);
            let yes = under.coder.bit(model, || under.answers.split(table, k));
            under.coder.check()?;
            if yes {
                return self.split(under, k).map(Some);
            }
        }
        Ok(None)
    }

    fn split_model<'m>(
        &self,
        mesh: &ProgressiveMesh,
        models: &'m mut SegmentModels,
        k: Corner,
        o: Corner,
    ) -> &'m mut Bit {
        let table = &mesh.table;
        let closed = |c: Corner| {
            let beyond = table.opposite(c);
            usize::from(beyond.is_none() || self.starred(beyond))
        };
        let cell = |c: Corner| self.cell(mesh, table.vertex(c));
        let mut count = closed(k.next()) + closed(k.prev());
        let mut far_tip = None;
        if o.is_some() {
            count += closed(o.next()) + closed(o.prev());
            far_tip = Some(cell(o));
        }
        let ratio = context::edge_ratio(cell(k.next()), cell(k.prev()), cell(k), far_tip);
        &mut models.split[usize::from(o.is_none())][count][ratio]
    }

    fn split<C: BitCoder, A: Answers>(
        &mut self,
        under: &mut Under<C, A>,
        k: Corner,
    ) -> Result<Inserted, RefinementError> {
        let (a, b) = under.mesh.table.edge(k);
        let (pa, pb) = (self.cell(under.mesh, a), self.cell(under.mesh, b));
        let middle = std::array::from_fn(|i| (pa[i] + pb[i]) >> 1);
        let (v, position) = self.code_vertex(under, EDGE, context::extent(pa, pb), middle)?;
        let (corners, count) = stellar::split_edge(&mut under.mesh.table, k, v);
        under.mesh.set_position(v, position);
        let flipped = self.flips(under, v, &corners[..count]);
        Ok(inserted(under.mesh, v, Site::Edge(a, b), &flipped))
    }

    /// Asks, first in first out, for the flips of the link edges that `corners` at `v` face. Returns the edges flipped.
    fn flips<C: BitCoder, A: Answers>(
        &mut self,
        under: &mut Under<C, A>,
        v: Vertex,
        corners: &[Corner],
    ) -> Vec<(Vertex, Vertex)> {
        let mut flipped = Vec::new();
        self.queue.clear();
        self.queue.extend_from_slice(corners);
        self.ring.clear();
        self.ring.extend(under.mesh.table.link(v));
        let mut size = corners.len();
        let mut head = 0;
        while head < self.queue.len() && size < MAX_STAR {
            let c = self.queue[head];
            head += 1;
            let table = &under.mesh.table;
            let o = table.opposite(c);
            if o.is_none() || self.in_star.get(o.triangle().index()) == Some(&true) {
                continue;
            }
            let r = table.vertex(o);
            if r == v || self.ring.contains(&r) {
                continue;
            }
            let (p, q) = table.edge(c);
            let [pv, pp, pq, pr] = [v, p, q, r].map(|w| self.cell(under.mesh, w));
            let model = &mut under.models.flip[(size - 2).min(5)][context::delaunay(pv, pp, pq, pr)];
            if under.coder.bit(model, || under.answers.flip(&under.mesh.table, c)) {
                let other = stellar::flip(&mut under.mesh.table, c);
                self.queue.extend([c, other]);
                self.ring.push(r);
                size += 1;
                flipped.push((p, q));
            }
        }
        flipped
    }

    fn next_face<C: BitCoder, A: Answers>(
        &mut self,
        under: &mut Under<C, A>,
    ) -> Result<Option<Inserted>, RefinementError> {
        while let Some(&c) = self.walk.triangles.get(self.cursor) {
            self.cursor += 1;
            if self.starred(c) {
                continue;
            }
            let yes = under.coder.bit(&mut under.models.face, || under.answers.face(&under.mesh.table, c));
            under.coder.check()?;
            if !yes {
                continue;
            }
            let [x, y, z] = [c, c.next(), c.prev()].map(|c| under.mesh.table.vertex(c));
            let [px, py, pz] = [x, y, z].map(|w| self.cell(under.mesh, w));
            let middle = std::array::from_fn(|i| (px[i] + py[i] + pz[i]).div_euclid(3));
            let extent = context::extent(px, py).max(context::extent(py, pz));
            let (v, position) = self.code_vertex(under, FACE, extent, middle)?;
            stellar::split_face(&mut under.mesh.table, c, v);
            under.mesh.set_position(v, position);
            return Ok(Some(inserted(under.mesh, v, Site::Face(x, y, z), &[])));
        }
        Ok(None)
    }

    fn next_attach<C: BitCoder, A: Answers>(
        &mut self,
        under: &mut Under<C, A>,
    ) -> Result<Option<Inserted>, RefinementError> {
        while let Some(&(a, b)) = self.boundary.get(self.cursor) {
            self.cursor += 1;
            // The triangle behind a→b may have been rewritten, so the edge is found through its start.
            let k = under.mesh.table.corner_of(a).prev();
            if under.mesh.table.edge(k) != (a, b) {
                continue;
            }
            let yes =
                under.coder.bit(&mut under.models.attach, || under.answers.attach(&under.mesh.table, k));
            under.coder.check()?;
            if !yes {
                continue;
            }
            let [pa, pb] = [a, b].map(|w| self.cell(under.mesh, w));
            let middle = std::array::from_fn(|i| (pa[i] + pb[i]) >> 1);
            let (v, position) = self.code_vertex(under, ATTACH, context::extent(pa, pb), middle)?;
            stellar::attach(&mut under.mesh.table, k, v);
            under.mesh.set_position(v, position);
            return Ok(Some(inserted(under.mesh, v, Site::Attach(a, b), &[])));
        }
        Ok(None)
    }

    #[inline]
    fn cell(&self, mesh: &ProgressiveMesh, v: Vertex) -> [i32; 3] {
        mesh.positions[v.index()].map(|x| x >> self.precision)
    }

    /// Codes where the next vertex lies, as what its cell differs by from `prediction`. Returns its number and full-scale position.
    fn code_vertex<C: BitCoder, A: Answers>(
        &mut self,
        under: &mut Under<C, A>,
        site: usize,
        extent: usize,
        prediction: [i32; 3],
    ) -> Result<(Vertex, [i32; 3]), RefinementError> {
        let truth = if C::ENCODES { under.answers.position().map(|x| x >> self.precision) } else { [0; 3] };
        let numbers = &mut under.models.position[site][extent];
        let mut cell = [0; 3];
        let before = under.coder.spent();
        for i in 0..3 {
            let residual = numbers.signed(under.coder, || truth[i] - prediction[i])?;
            cell[i] = prediction[i].wrapping_add(residual);
        }
        self.position_bits += under.coder.spent() - before;
        if cell.iter().any(|x| !(0..=self.max).contains(x)) {
            return Err(RefinementError::OffLattice(cell));
        }
        under.coder.check()?;
        Ok((under.answers.vertex(under.mesh), cell.map(|x| from_cell(x, self.precision))))
    }
}

/// Places of [`SegmentModels::position`].
const EDGE: usize = 0;
const FACE: usize = 1;
const ATTACH: usize = 2;

/// What has been carried out, once its last flip is done; the root edge is looked after.
fn inserted(mesh: &mut ProgressiveMesh, v: Vertex, site: Site, flipped: &[(Vertex, Vertex)]) -> Inserted {
    let (beside, split) = match site {
        Site::Edge(a, b) => (a, Some((a, b))),
        Site::Face(a, ..) | Site::Attach(a, _) => (a, None),
    };
    mesh.roots.insert(&mesh.table, v, beside, flipped.iter().copied().chain(split));
    let star = mesh.table.fan(v).map(Corner::triangle).collect();
    Inserted { vertex: v, site, flips: flipped.iter().map(|&(p, _)| p).collect(), star }
}
