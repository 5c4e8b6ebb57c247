//! What level 0 lacks of the input: the residue, its attributes, and where it is asked for the correction and the order. All of it is
//! named by places in the walk of level 0.

use super::alive::Alive;
use super::attribute_errors::AttributeErrors;
use super::labelling::Labelling;
use super::names::{Names, turned};
use super::{AttributeBirth, Options, attributes, features, grids};
use crate::codec::attributes::Finest;
use crate::codec::correction::{Copied, Correction};
use crate::codec::grid::Real;
use crate::codec::order::{Order, Origin};
use crate::codec::residue::ResidueCounts;
use crate::codec::walk::Tour;
use crate::codec::whole::{Extra, Whole, WholeError};
use crate::container::AttributeEntry;
use crate::error::{Error, Result};
use crate::limits::{Budget, WORK_A_SLOT};
use crate::mesh::attributes::Semantic;
use crate::mesh::topology::{Manifold, Remainder};
use crate::mesh::{IndexedMesh, Lattice, Vertex};
use crate::refine::ProgressiveMesh;
use crate::simplify::{Features, Simplified};

/// The payloads of level 0; those that are not wanted are empty.
#[derive(Debug, Default)]
pub struct Payloads {
    /// The residue.
    pub residue: Vec<u8>,
    /// What it holds.
    pub counts: ResidueCounts,
    /// The attributes.
    pub attributes: Vec<u8>,
    /// The correction.
    pub correction: Vec<u8>,
    /// Vertices that it adds, copies with other coordinates.
    pub copies: usize,
    /// The order.
    pub order: Vec<u8>,
    /// Units of work that it takes to have read up to each of the four.
    pub work: [u64; 4],
}

/// What is kept of the input until level 0 is there.
#[derive(Debug)]
pub struct Finish<'a> {
    input: &'a IndexedMesh,
    exact: Option<Real>,
    keep_order: bool,
    /// What the file says of the input's attributes.
    entries: Vec<AttributeEntry>,
    /// Whether vertices that are the same have other coordinates, if only zeros of other signs.
    has_copies: bool,
    /// What the manifold does not tell of it.
    remainder: Remainder,
    /// The triangles of the conditioned table that were turned round, each from its least vertex, in ascending order.
    flipped: Vec<[Vertex; 3]>,
    /// The triangles of the conditioned table, where they will be needed.
    triangles: Vec<[Vertex; 3]>,
}

impl<'a> Finish<'a> {
    /// Keeps what it takes.
    pub fn new(input: &'a IndexedMesh, manifold: &Manifold, remainder: Remainder, options: &Options) -> Self {
        let (table, same) = (&manifold.table, &remainder.origins.same);
        let has_copies =
            options.exact.is_some() && (0..same.len()).any(|v| differ(input, v, same[v] as usize));
        let mut triangles = Vec::new();
        let entries = attributes::entries(input, options);
        if has_copies || options.keep_order {
            triangles = table.triangles().map(|t| table.triangle(t)).collect();
        }
        let flipped = table.triangles().filter(|t| remainder.flipped[t.index()]);
        let mut flipped: Vec<_> = flipped.map(|t| turned(table.triangle(t))).collect();
        flipped.sort_unstable();
        let (exact, keep_order) = (options.exact, options.keep_order);
        Self { input, exact, keep_order, entries, has_copies, remainder, flipped, triangles }
    }

    /// What the table of contents is to say of the attributes.
    pub fn entries(&self) -> &[AttributeEntry] {
        &self.entries
    }

    /// What the attributes mean to the simplification.
    pub fn features(&self, manifold: &Manifold, options: &Options, lattice: &Lattice) -> Features {
        let bodies = features::bodies(self.input, &self.remainder);
        if self.entries.is_empty() {
            return Features { bodies, ..Features::default() };
        }
        let features =
            features::features(self.input, manifold, &self.remainder, &self.entries, options, lattice);
        Features { bodies, ..features }
    }

    /// What the corners of `simplified`, whose vertices are at `positions`, are at every level; `None` where there are no attributes. The
    /// entries are told where attributes are born.
    pub fn label(
        &mut self,
        simplified: &Simplified,
        positions: &[[i32; 3]],
        options: &Options,
    ) -> Option<Labelling> {
        if self.entries.is_empty() {
            return None;
        }
        let kinds: Vec<_> = self.entries.iter().map(AttributeEntry::kind).collect();
        let (table, history) = (simplified.input.clone(), &simplified.history);
        let slid = &simplified.slid;
        let labelling = Labelling::new(self.input, &kinds, &self.remainder, table, history, slid, positions);
        let attributes = self.input.attributes.iter().zip(&labelling.coarsest).zip(&labelling.parted);
        for (entry, ((attribute, &coarsest), &parted)) in self.entries.iter_mut().zip(attributes) {
            if entry.constant.is_some() {
                entry.birth = simplified.history.level_count() as u32;
                continue;
            }
            let birth = features::birth(attribute, options);
            let most = match birth {
                _ if !features::may_be_coarse(attribute, birth) => 0,
                // Where nearly every edge parts it, every operation would have to tell all of its corners anew.
                AttributeBirth::Auto if parted > MOSTLY => 0,
                AttributeBirth::Base if attribute.semantic == Semantic::Part => coarsest,
                _ if features::is_chart(attribute) => simplified.charts_to,
                _ => coarsest,
            };
            entry.birth = coarsest.min(most) as u32;
        }
        Some(labelling)
    }

    /// Where the attributes of levels are to be compared with those of the input.
    pub fn measured(&self, simplified: &Simplified, positions: &[[i32; 3]]) -> AttributeErrors {
        let probes = simplified.traces.iter().map(|traces| traces.probes.clone()).collect();
        let (table, remainder) = (&simplified.input, &self.remainder);
        AttributeErrors::new(self.input, &self.entries, remainder, table, positions, probes)
    }

    /// Writes what belongs to level 0, `mesh`, whose vertices have the numbers of the conditioned table.
    ///
    /// # Errors
    /// [`Error::Parameter`] where a part has a number that cannot be written.
    pub fn payloads(
        &self,
        mesh: &ProgressiveMesh,
        alive: Option<&mut Alive>,
        lattice: &Lattice,
    ) -> Result<Payloads> {
        let tour = Tour::new(mesh);
        let names = Names::new(&self.remainder, &self.flipped, mesh, &tour, lattice);
        let mut payloads = Payloads { counts: names.residue.counts(), ..Payloads::default() };
        let cannot = |e: WholeError| Error::Parameter(e.to_string());
        let mut budget = Budget::unlimited();
        // A walk of level 0, and then the whole that is made of it.
        let pass = WORK_A_SLOT * mesh.table.triangle_count() as u64;
        budget.take_work(pass)?;
        if !names.residue.is_empty() {
            payloads.residue = names.residue.encode(mesh, &tour, &mut budget).map_err(cannot)?;
            payloads.work[0] = budget.work();
        }
        if self.exact.is_none() && !self.keep_order && self.entries.is_empty() {
            return Ok(payloads);
        }
        budget.take_work(pass)?;
        let mut whole = Whole::new(mesh, &names.residue, &tour);
        let mut vertices = names.vertices(&self.remainder, &whole);
        let origins = if self.has_copies || self.keep_order {
            self.origins(&names, &whole, &vertices)
        } else {
            Vec::new()
        };
        if let Some(alive) = alive {
            let outside: Vec<usize> = self.remainder.origins.in_table.iter_zeros().collect();
            let further = names.further.iter().map(|&k| outside[k as usize]);
            let finest = Finest { mesh, tour: &tour, residue: &names.residue, whole: &whole };
            let (payload, work) = alive.finish(finest, further).map_err(cannot)?;
            payloads.attributes = payload;
            budget.take_work(work)?;
            payloads.work[1] = budget.work();
        }
        let mut count = whole.vertices.len();
        if let Some(real) = self.exact {
            let mut correction = self.correction(real, &whole, &vertices, lattice);
            if self.has_copies {
                self.copy(&mut correction, &mut vertices, &origins);
            }
            payloads.correction = correction.encode(&whole, lattice, &mut budget).map_err(cannot)?;
            payloads.work[2] = budget.work();
            correction.rename(&mut whole.triangles);
            payloads.copies = correction.copies.len();
            count += payloads.copies;
        }
        if self.keep_order {
            let order = Order { vertices, triangles: self.input.triangles.clone(), origins: Vec::new() };
            let coded = order.encode(mesh, &names.residue, &tour.walk, &whole, count, &origins);
            let (payload, work) = coded.map_err(cannot)?;
            payloads.order = payload;
            payloads.work[3] = budget.work() + work;
        }
        Ok(payloads)
    }

    fn correction(&self, real: Real, whole: &Whole, vertices: &[u32], lattice: &Lattice) -> Correction {
        let mut positions = vec![[0.0; 3]; whole.vertices.len()];
        for (v, &first) in self.remainder.origins.same.iter().enumerate() {
            if first as usize == v {
                positions[vertices[v] as usize] = self.input.positions[v];
            }
        }
        let near = || whole.vertices.iter().zip(&positions).filter(|(v, _)| matches!(v, Extra::Lattice(_)));
        let step = near().count().div_ceil(SAMPLES).max(1);
        let grids = std::array::from_fn(|k| {
            let samples = near().step_by(step).map(|(v, x)| (x[k], v.position(lattice)[k]));
            grids::choose(&samples.collect::<Vec<_>>(), lattice.step * 0.5, real)
        });
        Correction { real, grids, positions, ..Correction::default() }
    }

    /// Makes copies of vertices for those of the input that have other coordinates. These become their vertices of the whole.
    fn copy(&self, correction: &mut Correction, vertices: &mut [u32], origins: &[Origin]) {
        let same = &self.remainder.origins.same;
        let copies: Vec<Option<Copied>> = vertices
            .iter()
            .enumerate()
            .map(|(v, &vertex)| {
                let copy = Copied { vertex, position: self.input.positions[v] };
                differ(self.input, v, same[v] as usize).then_some(copy)
            })
            .collect();
        let mut sorted: Vec<Copied> = copies.iter().copied().flatten().collect();
        sorted.sort_unstable_by_key(|copy| correction.order(copy));
        sorted.dedup_by_key(|copy| correction.order(copy));
        correction.copies = sorted;
        let place = |copy: Copied| {
            let found =
                correction.copies.binary_search_by_key(&correction.order(&copy), |c| correction.order(c));
            found.expect("all copies are there") as u32
        };
        let copies: Vec<Option<u32>> = copies.iter().map(|copy| copy.map(place)).collect();
        for (t, &(place, first)) in origins.iter().enumerate() {
            for (k, &v) in self.input.triangles[t].iter().enumerate() {
                if let Some(copy) = copies[v as usize] {
                    let corner = 3 * place + (k as u32 + first) % 3;
                    correction.corners.push((corner, copy));
                }
            }
        }
        correction.corners.sort_unstable();
        for (vertex, copy) in vertices.iter_mut().zip(copies) {
            if let Some(copy) = copy {
                *vertex = correction.positions.len() as u32 + copy;
            }
        }
    }

    /// For each triangle of the input its place in the whole, and the corner there at which it begins.
    fn origins(&self, names: &Names, whole: &Whole, vertices: &[u32]) -> Vec<Origin> {
        let in_table = &self.remainder.origins.in_table;
        let mut sorted: Vec<([Vertex; 3], u32)> =
            names.triangles.iter().zip(0..).map(|(&t, place)| (turned(t), place)).collect();
        sorted.sort_unstable();
        let mut origins = vec![(0, 0); self.input.triangles.len()];
        for (t, &triangle) in in_table.iter_ones().zip(&self.triangles) {
            let found = sorted.binary_search_by_key(&turned(triangle), |&(other, _)| other);
            let place = sorted[found.expect("level 0 has the triangles of the table")].1;
            let first = vertices[self.input.triangles[t][0] as usize];
            let turn = whole.triangles[place as usize].iter().position(|&v| v == first);
            origins[t] = (place, turn.expect("they have the same vertices") as u32);
        }
        let outside: Vec<usize> = in_table.iter_zeros().collect();
        for (&k, place) in names.further.iter().zip(names.triangles.len() as u32..) {
            origins[outside[k as usize]] = (place, 0);
        }
        origins
    }
}

/// Whether two vertices have other coordinates, if only zeros of other signs.
fn differ(mesh: &IndexedMesh, v: usize, w: usize) -> bool {
    mesh.positions[v].map(f64::to_bits) != mesh.positions[w].map(f64::to_bits)
}

/// Which share of the edges may part an attribute that is born at a coarser level than the finest.
const MOSTLY: f64 = 0.5;
/// Coordinates of an axis by which its grids are chosen, at most.
const SAMPLES: usize = 2048;
