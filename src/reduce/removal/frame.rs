//! One view: classify, then remove and classify anew until nothing goes.

use super::propose::{Memory, Move, NOWHERE};
use super::snapshot::Snapshot;
use super::veto::{After, Moves};
use super::view::{Sight, error};
use super::workers::Workers;
use super::{Fan, Guard, Iteration, Options, Simplified, Surface};
use crate::error::Result;
use crate::reduce::rings::Rings;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

/// The steps of an iteration, on whatever carries them out: results of one are results of all.
pub(crate) trait Steps {
    /// Takes back the selection of those that the view would miss, then proposes where each candidate would go.
    ///
    /// # Errors
    /// Those of the device.
    fn propose(&mut self, iteration: u32) -> Result<Iteration>;

    /// Calls off moves that do not go together.
    ///
    /// # Errors
    /// Those of the device.
    fn veto(&mut self, iteration: u32) -> Result<()>;

    /// Makes the next mesh, and calls off moves that are in the way of a sheet round each vertex.
    ///
    /// # Errors
    /// Those of the device.
    fn settle(&mut self, iteration: u32, patience: Patience) -> Result<Settled>;

    /// Takes the next mesh for the present one.
    ///
    /// # Errors
    /// Those of the device.
    fn accept(&mut self) -> Result<()>;
}

/// What is called off where the triangles round a vertex would be no sheet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Patience {
    /// The dearest of the moves there.
    Dearest,
    /// Each of them.
    All,
    /// No vertex moves at all.
    Still,
}

/// What came of a round.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Settled {
    /// Vertices that move.
    pub(crate) moving: usize,
    /// Whether moves were called off, so that another round is needed.
    pub(crate) is_disputed: bool,
}

/// Iterates until nothing goes any more, for a mesh of so many vertices; returns what happened.
///
/// # Errors
/// Those of the steps.
pub(crate) fn iterate(steps: &mut impl Steps, vertices: usize) -> Result<Vec<Iteration>> {
    let mut iterations = Vec::new();
    let mut left = vertices;
    while iterations.len() < MOST_ITERATIONS {
        let number = iterations.len() as u32;
        let mut iteration = steps.propose(number)?;
        if iteration.candidates == 0 {
            break;
        }
        steps.veto(number)?;
        for round in 0..=MOST_ROUNDS {
            let patience = match round {
                MOST_ROUNDS => Patience::Still,
                PATIENCE.. => Patience::All,
                _ => Patience::Dearest,
            };
            let settled = steps.settle(number, patience)?;
            iteration.removed = settled.moving;
            if !settled.is_disputed {
                break;
            }
        }
        iterations.push(iteration);
        if iteration.removed == 0 {
            break;
        }
        steps.accept()?;
        left -= iteration.removed;
        if iteration.removed < left / FEW {
            break;
        }
    }
    Ok(iterations)
}

/// Simplifies for a view, or as far as can be.
///
/// # Errors
/// [`crate::Error::Io`] where the system has no threads.
pub(super) fn run(surface: &Surface, sight: Option<Sight>, options: Options) -> Result<Simplified> {
    let count = surface.points.len();
    let mut frame = Frame {
        surface,
        sight,
        options,
        workers: Workers::new(options.threads)?,
        selected: vec![true; count],
        near: vec![false; count],
        candidates: vec![false; count],
        moves: vec![Move::NONE; count],
        off: Vec::new(),
        present: None,
        next: Buffers::default(),
    };
    frame.off.resize_with(count, AtomicBool::default);
    let iterations = iterate(&mut frame, count)?;
    let triangles = frame.present.map_or_else(|| surface.triangles.clone(), |buffers| buffers.triangles);
    Ok(Simplified { triangles, iterations })
}

/// What goes with one view.
struct Frame<'a> {
    surface: &'a Surface,
    sight: Option<Sight>,
    options: Options,
    workers: Workers,
    selected: Vec<bool>,
    near: Vec<bool>,
    candidates: Vec<bool>,
    moves: Vec<Move>,
    /// The moves that are called off.
    off: Vec<AtomicBool>,
    /// The present mesh, once it is another than the surface's.
    present: Option<Buffers>,
    next: Buffers,
}

/// A mesh that comes of another one.
#[derive(Debug, Default)]
struct Buffers {
    triangles: Vec<[u32; 3]>,
    origins: Vec<u32>,
    rings: Rings,
    moving: Vec<bool>,
    pairs: Vec<([u32; 3], u32)>,
}

impl Frame<'_> {
    fn snapshot(&self) -> Snapshot<'_> {
        let Surface { points, auxiliary, boundary, .. } = self.surface;
        let (triangles, rings) = match &self.present {
            Some(buffers) => (&buffers.triangles[..], &buffers.rings),
            None => (&self.surface.triangles[..], &self.surface.rings),
        };
        Snapshot { points, triangles, rings, selected: &self.selected, auxiliary, boundary }
    }

    fn classify(&mut self) {
        let mut selected = std::mem::take(&mut self.selected);
        let (surface, sight) = (self.surface, self.sight);
        let Snapshot { triangles, rings, .. } = self.snapshot();
        self.workers.each(&mut selected, |v, selected, (): &mut ()| {
            if *selected {
                let point = surface.points[v as usize];
                let is_missed = || {
                    sight.is_some_and(|sight| {
                        error(v, &surface.points, triangles, rings) > sight.allowed(point)
                    })
                };
                *selected = !surface.guaranteed[v as usize] && !surface.locked[v as usize] && !is_missed();
            }
        });
        self.selected = selected;
    }

    fn called_off(&self) -> usize {
        self.off.iter().filter(|off| off.load(Relaxed)).count()
    }
}

impl Steps for Frame<'_> {
    fn propose(&mut self, _iteration: u32) -> Result<Iteration> {
        self.classify();
        let Options { rule, guard, .. } = self.options;
        let [mut near, mut candidates] = [&mut self.near, &mut self.candidates].map(std::mem::take);
        let mut moves = std::mem::take(&mut self.moves);
        let here = self.snapshot();
        let selected = |v: u32| here.selected[v as usize];
        self.workers.each(&mut near, |v, near, (): &mut ()| *near = selected(v) && here.is_near(v));
        self.workers.each(&mut candidates, |v, candidate, (): &mut ()| {
            *candidate = selected(v) && here.is_candidate(v, &near, rule);
        });
        self.workers.each(&mut moves, |v, to, memory: &mut Memory| {
            *to = match candidates[v as usize] {
                true => here.propose(v, &candidates, rule, guard, memory),
                false => Move::NONE,
            };
        });
        let count = |flags: &[bool]| flags.iter().filter(|&&flag| flag).count();
        let proposed = moves.iter().filter(|to| to.target != NOWHERE).count();
        let iteration = Iteration { candidates: count(&candidates), proposed, removed: 0 };
        (self.near, self.candidates, self.moves) = (near, candidates, moves);
        Ok(iteration)
    }

    fn veto(&mut self, iteration: u32) -> Result<()> {
        self.off.iter_mut().for_each(|off| *off.get_mut() = false);
        let here = self.snapshot();
        let moves = Moves { moves: &self.moves, iteration };
        match self.options.guard {
            Guard::Veto => self.workers.each_number(here.triangles.len(), |t, (): &mut ()| {
                moves.veto(here.triangles[t as usize], &here, &self.off);
            }),
            Guard::Blind => {}
            Guard::Independent => self.workers.each_number(self.moves.len(), |v, (): &mut ()| {
                if self.moves[v as usize].target != NOWHERE && moves.is_beaten(v, &here) {
                    self.off[v as usize].store(true, Relaxed);
                }
            }),
        }
        Ok(())
    }

    fn settle(&mut self, iteration: u32, patience: Patience) -> Result<Settled> {
        let mut next = std::mem::take(&mut self.next);
        let here = self.snapshot();
        let moves = Moves { moves: &self.moves, iteration };
        let count = self.moves.len();
        next.moving.resize(count, false);
        self.workers.each(&mut next.moving, |v, moving, (): &mut ()| {
            let stays = self.off[v as usize].load(Relaxed) || patience == Patience::Still;
            *moving = self.moves[v as usize].target != NOWHERE && !stays;
        });
        let moving = &next.moving;
        let moved = |v: u32| if moving[v as usize] { self.moves[v as usize].target } else { v };
        let left = |t: u32| {
            let [a, b, c] = here.triangles[t as usize].map(moved);
            (a != b && b != c && c != a).then_some(([a, b, c], t))
        };
        self.workers.gather(here.triangles.len(), left, &mut next.pairs);
        next.triangles.clear();
        next.triangles.extend(next.pairs.iter().map(|(triangle, _)| *triangle));
        next.origins.clear();
        next.origins.extend(next.pairs.iter().map(|(_, origin)| *origin));
        next.rings.rebuild_by(&self.workers, count, &next.triangles);
        let after = After { moving, triangles: &next.triangles, origins: &next.origins, rings: &next.rings };
        let before = self.called_off();
        self.workers.each_number(count, |v, fan: &mut Fan| {
            if !self.surface.locked[v as usize] {
                moves.check(v, &here, &after, patience == Patience::All, &self.off, fan);
            }
        });
        let is_disputed = self.called_off() != before;
        let moving = next.moving.iter().filter(|&&moving| moving).count();
        self.next = next;
        Ok(Settled { moving, is_disputed })
    }

    fn accept(&mut self) -> Result<()> {
        let present = self.present.get_or_insert_default();
        std::mem::swap(present, &mut self.next);
        for (selected, _) in self.selected.iter_mut().zip(&present.moving).filter(|(_, moving)| **moving) {
            *selected = false;
        }
        Ok(())
    }
}

/// Iterations that are made at most.
const MOST_ITERATIONS: usize = 1000;
/// No further iteration is made after one in which fewer than one vertex in so many went.
const FEW: usize = 10_000;
/// Rounds of calling off after which all moves round a vertex are called off, not the dearest alone.
const PATIENCE: usize = 8;
/// Rounds after which no vertex moves at all.
const MOST_ROUNDS: usize = 64;
