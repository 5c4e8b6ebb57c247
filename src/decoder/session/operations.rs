//! The operations of refinement atoms (spec §5.3), and what they do to attributes (spec §13.9).

use super::{Pass, Session, cells};
use crate::codec::attributes::{Nothing, TOGETHER};
use crate::codec::lift::plus;
use crate::codec::refinement::{Inserted, LevelPass, MAX_STAR, RefinementError, Unknown};
use crate::container::{Atom, Contents};
use crate::decoder::log::Log;
use crate::decoder::{Delta, Event};
use crate::entropy::RangeDecoder;
use crate::error::{Error, FormatError, Result};
use crate::limits::WORK_AN_OPERATION;
use crate::mesh::corner_table::MAX_TRIANGLES;
use crate::refine::Site;
use std::collections::VecDeque;

impl Session {
    /// Decodes a refinement atom, and begins the pass of its level where it is the first.
    pub(super) fn refine(
        &mut self,
        contents: &Contents,
        atom: &Atom,
        payload: &[u8],
        events: &mut VecDeque<Event>,
    ) -> Result<()> {
        if let Pass::None(before) = &mut self.pass {
            let before = before.take();
            let cells = cells(contents, atom.level);
            self.pay_for_walk()?;
            let needed = u64::from(contents.levels[atom.level as usize].triangles);
            if needed >= MAX_TRIANGLES as u64 {
                return Err(Error::Limit { what: "triangles", needed, allowed: MAX_TRIANGLES as u64 - 1 });
            }
            // A level is at most twice as large as the one before, but for what nobody writes.
            let level = &contents.levels[atom.level as usize];
            let added = level.vertices as usize - self.mesh.positions.len();
            self.make_room(contents, added.min(self.mesh.positions.len()))?;
            self.walked = self.mesh.table.slots();
            let held = LevelPass::bytes(self.mesh.room(), self.walked, self.boundary);
            self.budget.exchange(&mut self.pass_held, held)?;
            self.pass = Pass::Level(Box::new(match before {
                Some(pass) => pass.next(&self.mesh, cells),
                None => LevelPass::new(&self.mesh, cells),
            }));
        }
        let first_vertex = self.mesh.positions.len() as u32;
        let first_triangle = self.mesh.table.slots() as u32;
        let first_wedge = self.attributes.count;
        let mut delta = Delta::default();
        let mut lifts = Vec::new();
        let outcome = self.operations_of(contents, atom, payload, &mut delta, &mut lifts);
        sum_up(lifts, &mut delta);
        delta.vertices = first_vertex..self.mesh.positions.len() as u32;
        delta.wedges = first_wedge..self.attributes.count;
        delta.triangles = first_triangle..self.mesh.table.slots() as u32;
        if !delta.vertices.is_empty() {
            events.push_back(Event::Refined(delta));
        }
        outcome?;
        if self.stopped {
            self.stopped = false;
            self.stop(events);
        } else if atom.last {
            let coarser = &contents.levels[atom.level as usize + 1];
            let added = self.mesh.positions.len() - coarser.vertices as usize;
            let triangles = self.mesh.table.triangle_count() - coarser.triangles as usize;
            // An operation adds two triangles inside, and at the boundary one triangle and one boundary edge.
            self.boundary += 2 * added - triangles;
            if contents.born(atom.level) == [0; 2] {
                self.complete(contents, atom.level, events)?;
            }
        }
        Ok(())
    }

    /// Carries out the operations of one atom, as far as wanted.
    fn operations_of(
        &mut self,
        contents: &Contents,
        atom: &Atom,
        payload: &[u8],
        delta: &mut Delta,
        lifts: &mut Vec<Moved>,
    ) -> Result<()> {
        let fault = |what: String| FormatError::new(atom.offset, "5.3", what);
        let until = self.options.until;
        let triangles = self.mesh.table.triangle_count();
        let mut coder = RangeDecoder::new(payload);
        // At valence 6, and no more than a few pages on a table's word.
        let ahead = CHUNK.min(atom.items) as usize;
        if self.tells {
            delta.parents.reserve(ahead);
            delta.rewritten.reserve(4 * ahead);
        }
        // The mesh as it stood where decoding is to stop, if others have followed.
        let mut surplus = None;
        for k in 0..atom.items {
            if k.is_multiple_of(CHUNK) {
                let ahead = CHUNK.min(atom.items - k) as usize;
                self.pay_for(contents, ahead, delta, lifts.capacity())?;
            }
            let is_enough = self.operations >= until.operations
                || self.mesh.table.triangle_count() as u32 + 2 > until.triangles;
            if STOPS && is_enough && surplus.is_none() {
                self.stopped = true;
                if self.refined.as_ref().is_none_or(|models| models.owe_nothing()) {
                    return Ok(());
                }
                surplus = Some(self.begin_surplus(contents, atom.level)?);
            }
            let Pass::Level(pass) = &mut self.pass else {
                return Err(fault("operations inside a precision pass".into()).into());
            };
            let step = pass.step(&mut self.mesh, &mut self.models, &mut coder, &mut Unknown);
            let inserted = step.map_err(|e| match e {
                RefinementError::Coding(e) => fault(e.to_string()),
                RefinementError::OffLattice(_) => fault(e.to_string()),
            })?;
            let Some(inserted) = inserted else {
                return Err(fault(format!("the level ends after {k} of {} operations", atom.items)).into());
            };
            if STOPS && let Some(surplus) = &mut surplus {
                surplus.push(inserted, &self.attributes.wedges);
            } else {
                self.operations += 1;
                if self.tells {
                    tell(delta, inserted, self.flips);
                    if let (Some(by), Site::Edge(a, b)) = (inserted.lift, inserted.site) {
                        lifts.extend([a, b].map(|w| (w.0, by)));
                    }
                }
                if let Some(log) = &mut self.log {
                    log.push(inserted, &self.attributes.wedges);
                }
            }
            if !self.attributes.wedges.is_empty() {
                let (v, carried) = (inserted.vertex, inserted.carried());
                let (attributes, budget) = (&mut self.attributes, &mut self.budget);
                if self.refined.is_none() {
                    budget.hold(&mut self.refined_held, attributes.model_bytes())?;
                }
                let models = self.refined.get_or_insert_with(|| Box::new(attributes.models()));
                attributes.carry(models, &self.mesh, v, &carried);
                let ends = (k + 1).is_multiple_of(TOGETHER as u32) || k + 1 == atom.items;
                if ends {
                    let outcome = attributes.refine(models, &self.mesh, &mut coder, &Nothing, budget);
                    outcome.map_err(|e| e.at(atom.offset, "13.9"))?;
                    if STOPS && let Some(mut surplus) = surplus {
                        let cells = cells(contents, atom.level);
                        surplus.coarsen(&mut self.mesh, &mut attributes.wedges, cells);
                        return Ok(());
                    }
                }
            }
        }
        coder.finish().map_err(|e| fault(e.to_string()))?;
        let added = self.mesh.table.triangle_count() - triangles;
        if added != atom.triangles as usize {
            return Err(fault(format!("{added} triangles added instead of {}", atom.triangles)).into());
        }
        Ok(())
    }

    /// Decoding is to stop here, but what attributes the operations so far have is told behind some that follow: these are undone then.
    fn begin_surplus(&mut self, contents: &Contents, level: u32) -> Result<Log> {
        // Where vertices are, and the bits that they lose, and what is recorded of operations.
        self.budget.take_memory(self.mesh.positions.len() + TOGETHER, 2 * size_of::<[i32; 3]>())?;
        self.budget.take_memory(Log::bytes_of_mark(&self.mesh, None) + 64 * TOGETHER * MAX_STAR, 1)?;
        let mut surplus = Log::default();
        surplus.end_level(&self.mesh, level, cells(contents, level), None);
        Ok(surplus)
    }

    /// Debits the next operations, and what those before have told and recorded.
    fn pay_for(&mut self, contents: &Contents, ahead: usize, delta: &Delta, lifts: usize) -> Result<()> {
        self.budget.take_work(WORK_AN_OPERATION * ahead as u64)?;
        // The list of lifts, and the one of vertices that is made of it, as if each were copied to one twice as long.
        self.budget.hold(&mut self.told, delta.bytes() + 4 * size_of::<Moved>() * lifts)?;
        if let Some(log) = &self.log {
            self.budget.hold(&mut self.log_held, log.bytes())?;
        }
        self.make_room(contents, ahead)
    }
}

/// A vertex that was there before, and by how much a split has moved it.
type Moved = (u32, [i32; 3]);

/// Tells which vertices lifts have moved, and how far.
fn sum_up(mut lifts: Vec<Moved>, delta: &mut Delta) {
    lifts.sort_unstable_by_key(|&(v, _)| v);
    for of_one in lifts.chunk_by(|x, y| x.0 == y.0) {
        let by = of_one.iter().fold([0; 3], |sum, &(_, by)| plus(sum, by));
        if by != [0; 3] {
            delta.moved.push(of_one[0].0);
            let squares = by.map(|x| f64::from(x) * f64::from(x));
            delta.shift = delta.shift.max(squares.iter().sum::<f64>().sqrt());
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

/// Whether decoding may stop at an operation. No page has it do that (CONTRIBUTING).
const STOPS: bool = cfg!(not(unweld_surface));

/// Operations that the budget is debited for at a time.
const CHUNK: u32 = 1024;
