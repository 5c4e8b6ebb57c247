//! From atoms to the mesh: what a segment has to remember, and no more.

use super::log::Log;
use super::{Delta, Event, Options};
use crate::codec::correction::Correction;
use crate::codec::edgebreaker::ConnectivityError;
use crate::codec::keyframe::{self, Expected};
use crate::codec::order::Order;
use crate::codec::precision::PrecisionPass;
use crate::codec::refinement::{Inserted, LevelPass, RefinementError, SegmentModels, Unknown};
use crate::codec::residue::{Residue, ResidueError, Whole};
use crate::codec::walk::Walk;
use crate::container::{Atom, AtomKind, Contents, Metadata};
use crate::entropy::{CodingError, RangeDecoder};
use crate::error::{Error, FormatError, Result};
use crate::limits::Budget;
use crate::mesh::corner_table::MAX_TRIANGLES;
use crate::refine::ProgressiveMesh;
use std::collections::VecDeque;
use std::sync::Arc;

/// The passes of the level under way.
#[derive(Debug)]
enum Pass {
    /// Between levels, with the pass of the one before.
    None(Option<Box<LevelPass>>),
    Precision(PrecisionPass),
    Level(Box<LevelPass>),
}

/// A decoder without its parser.
#[derive(Debug)]
pub struct Session {
    pub contents: Option<Arc<Contents>>,
    pub mesh: ProgressiveMesh,
    pub residue: Option<Residue>,
    pub correction: Option<Correction>,
    pub order: Option<Order>,
    pub metadata: Option<Metadata>,
    pub operations: u64,
    options: Options,
    budget: Budget,
    models: SegmentModels,
    pass: Pass,
    /// The level whose base or keyframe decoding starts from.
    start: u32,
    /// The level complete.
    level: Option<u32>,
    /// The parts of a payload of several atoms.
    parts: Vec<u8>,
    /// Where the first of them stands in the file.
    parts_start: u64,
    log: Option<Log>,
    /// Whether deltas tell of flips.
    flips: bool,
    /// Whether anybody will look at the lists of deltas.
    pub tells: bool,
    stopped: bool,
}

impl Session {
    pub fn new(options: Options) -> Self {
        Self {
            contents: None,
            mesh: ProgressiveMesh::default(),
            residue: None,
            correction: None,
            order: None,
            metadata: None,
            operations: 0,
            budget: Budget::new(options.limits),
            models: SegmentModels::default(),
            pass: Pass::None(None),
            start: 0,
            level: None,
            parts: Vec::new(),
            parts_start: 0,
            log: options.undo.then(Log::default),
            flips: options.flips,
            tells: true,
            stopped: false,
            options,
        }
    }

    /// Sets out from the base or keyframe of level `start`.
    pub fn begin(&mut self, contents: Arc<Contents>, start: u32) {
        self.contents = Some(contents);
        self.start = start;
    }

    pub fn is_stopped(&self) -> bool {
        self.stopped
    }

    pub fn is_lowered(&self) -> bool {
        self.log.as_ref().is_some_and(|log| log.lowered().is_some())
    }

    pub fn level(&self) -> Option<u32> {
        self.log.as_ref().and_then(Log::lowered).or(self.level)
    }

    /// Takes up an atom whose checksum holds.
    pub fn atom(&mut self, index: usize, payload: &[u8], events: &mut VecDeque<Event>) -> Result<()> {
        let Some(contents) = self.contents.clone() else { return Ok(()) };
        let Some(&atom) = contents.atoms.get(index) else { return Ok(()) };
        match atom.kind {
            AtomKind::Base | AtomKind::Keyframe => {
                if atom.level != self.start || self.level.is_some() {
                    return Ok(()); // A way in that was not taken.
                }
                if let Some((payload, offset)) = self.gather(&atom, payload)? {
                    self.start_from(&contents, &atom, offset, &payload, events)?;
                }
            }
            AtomKind::Precision | AtomKind::Refinement => {
                if self.level.is_none_or(|level| level != atom.level + 1) {
                    let what = format!("a refinement to level {} does not follow", atom.level);
                    return Err(FormatError::new(atom.offset, "3.3", what).into());
                }
                if atom.level < self.options.until.level {
                    self.stop(events);
                } else if atom.kind == AtomKind::Precision {
                    self.sharpen(&contents, &atom, payload, events)?;
                } else {
                    self.refine(&contents, &atom, payload, events)?;
                }
            }
            AtomKind::Residue => {
                if let Some((payload, offset)) = self.gather(&atom, payload)? {
                    if self.level != Some(0) {
                        return Ok(());
                    }
                    self.budget.take_work(2 * self.mesh.table.slots() as u64)?;
                    let residue = Residue::decode(&payload, &self.mesh, &mut self.budget);
                    self.residue = Some(residue.map_err(|e| fault(e, offset, "8"))?);
                    events.push_back(Event::Residue);
                }
            }
            AtomKind::Correction => {
                if let Some((payload, offset)) = self.gather(&atom, payload)? {
                    if self.level != Some(0) {
                        return Ok(());
                    }
                    let (whole, lattice) = (self.whole()?, &contents.header.lattice);
                    let correction = Correction::decode(&payload, &whole, lattice, &mut self.budget);
                    self.correction = Some(correction.map_err(|e| fault(e, offset, "10"))?);
                    self.give_back(whole);
                    events.push_back(Event::Correction);
                }
            }
            AtomKind::Order => {
                if let Some((payload, offset)) = self.gather(&atom, payload)? {
                    if self.level != Some(0) {
                        return Ok(());
                    }
                    let mut whole = self.whole()?;
                    let mut count = whole.vertices.len();
                    if let Some(correction) = &self.correction {
                        correction.rename(&mut whole.triangles);
                        count += correction.copies.len();
                    }
                    let (none, budget) = (Residue::default(), &mut self.budget);
                    let residue = self.residue.as_ref().unwrap_or(&none);
                    let order = Order::decode(&payload, &self.mesh, residue, &whole, count, budget);
                    self.order = Some(order.map_err(|e| fault(e, offset, "11"))?);
                    self.give_back(whole);
                    events.push_back(Event::Order);
                }
            }
            AtomKind::Metadata => {
                if let Some((payload, offset)) = self.gather(&atom, payload)? {
                    self.metadata = Some(Metadata::decode(&payload, offset)?);
                    events.push_back(Event::Metadata);
                }
            }
            AtomKind::Optional(_) => {}
        }
        Ok(())
    }

    /// Level 0 with its residue, on the lattice; [`Session::give_back`] when it is done with.
    fn whole(&mut self) -> Result<Whole> {
        self.budget.take_work(4 * self.mesh.table.slots() as u64)?;
        self.budget.take_memory(self.size_of_whole(), BYTES_OF_WHOLE)?;
        let none = Residue::default();
        let residue = self.residue.as_ref().unwrap_or(&none);
        Ok(residue.whole(&self.mesh, &Walk::new(&self.mesh.table, &self.mesh.roots)))
    }

    fn give_back(&mut self, whole: Whole) {
        drop(whole);
        self.budget.give_memory(self.size_of_whole(), BYTES_OF_WHOLE);
    }

    fn size_of_whole(&self) -> usize {
        let further = self.residue.as_ref().map_or(0, |r| r.triangles.len() + r.extras.len());
        self.mesh.table.slots() + further
    }

    /// Collects a payload of several atoms; returns it with the offset of its first part once its last is there.
    fn gather(&mut self, atom: &Atom, payload: &[u8]) -> Result<Option<(Vec<u8>, u64)>> {
        self.budget.take_memory(payload.len(), 1)?;
        if self.parts.is_empty() {
            self.parts_start = atom.offset;
        }
        self.parts.extend_from_slice(payload);
        if !atom.last {
            return Ok(None);
        }
        self.budget.give_memory(self.parts.len(), 1);
        Ok(Some((std::mem::take(&mut self.parts), self.parts_start)))
    }

    fn start_from(
        &mut self,
        contents: &Contents,
        atom: &Atom,
        offset: u64,
        payload: &[u8],
        events: &mut VecDeque<Event>,
    ) -> Result<()> {
        let (entry, bits) = (&contents.levels[atom.level as usize], contents.header.lattice.bits);
        let expected = Expected {
            vertices: entry.vertices,
            triangles: entry.triangles,
            precision: entry.precision,
            bits,
        };
        let mesh = keyframe::decode(payload, expected, &mut self.budget).map_err(|e| match e {
            ConnectivityError::Limit(limit) => limit,
            other => FormatError::new(offset, "7", other.to_string()).into(),
        })?;
        self.budget.take_memory(mesh.positions.len(), ProgressiveMesh::BYTES_A_VERTEX)?;
        self.mesh = mesh;
        events.push_back(Event::Whole { level: atom.level });
        self.complete(contents, atom.level, events);
        Ok(())
    }

    /// A level is complete; where a segment begins, models start afresh.
    fn complete(&mut self, contents: &Contents, level: u32, events: &mut VecDeque<Event>) {
        self.level = Some(level);
        self.pass = Pass::None(match std::mem::replace(&mut self.pass, Pass::None(None)) {
            Pass::Level(pass) if level > 0 => Some(pass),
            _ => None,
        });
        if contents.starts_segment(level) {
            self.models = SegmentModels::default();
        }
        if let Some(log) = &mut self.log {
            log.end_level(&self.mesh, level, contents.levels[level as usize].precision);
        }
        let entry = &contents.levels[level as usize];
        events.push_back(Event::Level { level, max_error: entry.max_error, rms_error: entry.rms_error });
        let until = self.options.until;
        let last = level == until.level && level > 0;
        if last || self.operations >= until.operations || entry.triangles >= until.triangles {
            self.stop(events);
        }
    }

    fn stop(&mut self, events: &mut VecDeque<Event>) {
        if !std::mem::replace(&mut self.stopped, true) {
            events.push_back(Event::Stopped);
        }
    }

    fn pay_for_walk(&mut self) -> Result<()> {
        let slots = self.mesh.table.slots();
        self.budget.take_work(4 * slots as u64)?;
        // Lists of edges and triangles; they are given back when the level is complete, which is soon.
        self.budget.take_memory(slots, 36)?;
        self.budget.give_memory(slots, 36);
        Ok(())
    }

    fn sharpen(
        &mut self,
        contents: &Contents,
        atom: &Atom,
        payload: &[u8],
        events: &mut VecDeque<Event>,
    ) -> Result<()> {
        let fault = |e: CodingError| FormatError::new(atom.offset, "5.6", e.to_string());
        self.budget.take_work(u64::from(atom.items))?;
        if matches!(self.pass, Pass::None(_)) {
            let (from, to) = (
                contents.levels[atom.level as usize + 1].precision,
                contents.levels[atom.level as usize].precision,
            );
            self.pay_for_walk()?;
            let walk = Walk::new(&self.mesh.table, &self.mesh.roots);
            self.pass = Pass::Precision(PrecisionPass::new(&self.mesh, &walk, from, to));
        }
        let Pass::Precision(pass) = &mut self.pass else {
            return Err(FormatError::new(atom.offset, "5.6", "a precision pass behind operations").into());
        };
        let mut coder = RangeDecoder::new(payload);
        let mut moved = Vec::new();
        for _ in 0..atom.items {
            let step = pass.step(&mut self.mesh, &mut self.models, &mut coder, |_| [0; 3]).map_err(fault)?;
            let Some(v) = step else {
                return Err(FormatError::new(atom.offset, "5.6", "more steps than vertices").into());
            };
            moved.push(v.0);
        }
        coder.finish().map_err(fault)?;
        if atom.last {
            self.pass = Pass::None(None);
        }
        moved.sort_unstable();
        moved.dedup();
        let (v, t) = (self.mesh.positions.len() as u32, self.mesh.table.slots() as u32);
        events.push_back(Event::Refined(Delta {
            vertices: v..v,
            triangles: t..t,
            moved,
            ..Delta::default()
        }));
        Ok(())
    }

    fn refine(
        &mut self,
        contents: &Contents,
        atom: &Atom,
        payload: &[u8],
        events: &mut VecDeque<Event>,
    ) -> Result<()> {
        if let Pass::None(before) = &mut self.pass {
            let before = before.take();
            let precision = contents.levels[atom.level as usize].precision;
            self.pay_for_walk()?;
            let needed = u64::from(contents.levels[atom.level as usize].triangles);
            if needed >= MAX_TRIANGLES as u64 {
                return Err(Error::Limit { what: "triangles", needed, allowed: MAX_TRIANGLES as u64 - 1 });
            }
            let counts = |level: u32| {
                let entry = &contents.levels[level as usize];
                [entry.vertices as usize, entry.triangles as usize]
            };
            self.mesh.reserve(counts(atom.level), counts(self.options.until.level.min(atom.level)));
            let bits = contents.header.lattice.bits;
            self.pass = Pass::Level(Box::new(match before {
                Some(pass) => pass.next(&self.mesh, precision, bits),
                None => LevelPass::new(&self.mesh, precision, bits),
            }));
        }
        let first_vertex = self.mesh.positions.len() as u32;
        let first_triangle = self.mesh.table.slots() as u32;
        let mut delta = Delta::default();
        let outcome = self.operations_of(atom, payload, &mut delta);
        delta.vertices = first_vertex..self.mesh.positions.len() as u32;
        delta.triangles = first_triangle..self.mesh.table.slots() as u32;
        if !delta.vertices.is_empty() {
            events.push_back(Event::Refined(delta));
        }
        outcome?;
        if self.stopped {
            self.stopped = false;
            self.stop(events);
        } else if atom.last {
            self.complete(contents, atom.level, events);
        }
        Ok(())
    }

    /// Carries out the operations of one atom, as far as wanted.
    fn operations_of(&mut self, atom: &Atom, payload: &[u8], delta: &mut Delta) -> Result<()> {
        let fault = |what: String| FormatError::new(atom.offset, "5.3", what);
        let Pass::Level(pass) = &mut self.pass else {
            return Err(fault("operations inside a precision pass".into()).into());
        };
        let until = self.options.until;
        let triangles = self.mesh.table.triangle_count();
        let mut coder = RangeDecoder::new(payload);
        // At valence 6, and no more than a few pages on a table's word.
        let ahead = CHUNK.min(atom.items) as usize;
        if self.tells {
            delta.parents.reserve(ahead);
            delta.rewritten.reserve(4 * ahead);
        }
        for k in 0..atom.items {
            if k.is_multiple_of(CHUNK) {
                let ahead = CHUNK.min(atom.items - k) as usize;
                self.budget.take_memory(ahead, ProgressiveMesh::BYTES_A_VERTEX + BYTES_AN_EVENT)?;
                self.budget.give_memory(ahead, BYTES_AN_EVENT);
                self.budget.take_work(ahead as u64 * 16)?;
            }
            if self.operations >= until.operations
                || self.mesh.table.triangle_count() as u32 + 2 > until.triangles
            {
                self.stopped = true;
                return Ok(());
            }
            let step = pass.step(&mut self.mesh, &mut self.models, &mut coder, &mut Unknown);
            let inserted = step.map_err(|e| match e {
                RefinementError::Coding(e) => fault(e.to_string()),
                RefinementError::OffLattice(_) => fault(e.to_string()),
            })?;
            let Some(inserted) = inserted else {
                return Err(fault(format!("the level ends after {k} of {} operations", atom.items)).into());
            };
            self.operations += 1;
            if self.tells {
                tell(delta, inserted, self.flips);
            }
            if let Some(log) = &mut self.log {
                log.push(inserted);
            }
        }
        coder.finish().map_err(|e| fault(e.to_string()))?;
        let added = self.mesh.table.triangle_count() - triangles;
        if added != atom.triangles as usize {
            return Err(fault(format!("{added} triangles added instead of {}", atom.triangles)).into());
        }
        Ok(())
    }

    pub fn coarsen(&mut self) -> Result<Option<u32>> {
        match &mut self.log {
            Some(log) => Ok(log.coarsen(&mut self.mesh)),
            None => Err(no_log()),
        }
    }

    pub fn restore(&mut self) -> Result<Option<u32>> {
        match &mut self.log {
            Some(log) => Ok(log.restore(&mut self.mesh)),
            None => Err(no_log()),
        }
    }
}

/// Adds an operation to a delta.
fn tell(delta: &mut Delta, inserted: &Inserted, flips: bool) {
    // Triangles that are not new are in the star of no second operation of this level, so they are new to the delta.
    delta.rewritten.extend(inserted.star[inserted.created..].iter().map(|c| c.triangle().0));
    delta.parents.push(inserted.site);
    if flips {
        delta.flips.extend(inserted.flips.iter().map(|&[p, q]| [inserted.vertex, p, q]));
    }
}

/// Operations that the budget is debited for at a time.
const CHUNK: u32 = 1024;
/// What an event holds for one operation: its parents, its flips, and the triangles of its star.
const BYTES_AN_EVENT: usize = 128;

/// What the whole of level 0 takes for a triangle: its half of a vertex and itself, and the walk to find them by.
const BYTES_OF_WHOLE: usize = 48;

/// Why a payload beyond the mesh cannot be read.
fn fault(error: ResidueError, offset: u64, section: &'static str) -> Error {
    match error {
        ResidueError::Limit(limit) => limit,
        other => FormatError::new(offset, section, other.to_string()).into(),
    }
}

fn no_log() -> Error {
    Error::Parameter("the decoder was not told to keep an undo log".into())
}
