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

/// Simplifies for a view, or as far as can be.
///
/// # Errors
/// [`crate::Error::Io`] where the system has no threads.
pub(super) fn run(surface: &Surface, sight: Option<Sight>, options: Options) -> Result<Simplified> {
    let workers = Workers::new(options.threads)?;
    let count = surface.points.len();
    let mut frame = Frame {
        surface,
        sight,
        options,
        workers: &workers,
        selected: vec![true; count],
        near: vec![false; count],
        candidates: vec![false; count],
        moves: vec![Move::NONE; count],
        off: Vec::new(),
    };
    frame.off.resize_with(count, AtomicBool::default);
    let mut iterations = Vec::new();
    // The present mesh, once it is another than the surface's.
    let mut present: Option<Buffers> = None;
    let mut next = Buffers::default();
    let mut left = count;
    while iterations.len() < MOST_ITERATIONS {
        let (triangles, rings) = match &present {
            Some(buffers) => (&buffers.triangles[..], &buffers.rings),
            None => (&surface.triangles[..], &surface.rings),
        };
        frame.classify(triangles, rings);
        let mut iteration = frame.propose(triangles, rings);
        if iteration.candidates == 0 {
            break;
        }
        frame.veto(triangles, rings, iterations.len() as u32);
        iteration.removed = frame.settle(triangles, rings, iterations.len() as u32, &mut next);
        iterations.push(iteration);
        if iteration.removed == 0 {
            break;
        }
        let present = present.get_or_insert_default();
        std::mem::swap(present, &mut next);
        for (selected, _) in frame.selected.iter_mut().zip(&present.moving).filter(|(_, moving)| **moving) {
            *selected = false;
        }
        left -= iteration.removed;
        if iteration.removed < left / FEW {
            break;
        }
    }
    let triangles = present.map_or_else(|| surface.triangles.clone(), |buffers| buffers.triangles);
    Ok(Simplified { triangles, iterations })
}

/// What goes with one view.
struct Frame<'a> {
    surface: &'a Surface,
    sight: Option<Sight>,
    options: Options,
    workers: &'a Workers,
    selected: Vec<bool>,
    near: Vec<bool>,
    candidates: Vec<bool>,
    moves: Vec<Move>,
    /// The moves that are called off.
    off: Vec<AtomicBool>,
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
    fn snapshot<'b>(&'b self, triangles: &'b [[u32; 3]], rings: &'b Rings) -> Snapshot<'b> {
        let Surface { points, auxiliary, boundary, .. } = self.surface;
        Snapshot { points, triangles, rings, selected: &self.selected, auxiliary, boundary }
    }

    /// Takes back the selection of those that the view would miss.
    fn classify(&mut self, triangles: &[[u32; 3]], rings: &Rings) {
        let (surface, sight) = (self.surface, self.sight);
        self.workers.each(&mut self.selected, |v, selected, (): &mut ()| {
            if *selected {
                let point = surface.points[v as usize];
                let is_missed = || {
                    sight.is_some_and(|sight| error(v, &surface.points, triangles, rings) > sight.allowed(point))
                };
                *selected = !surface.guaranteed[v as usize] && !surface.locked[v as usize] && !is_missed();
            }
        });
    }

    /// Where each candidate would go.
    fn propose(&mut self, triangles: &[[u32; 3]], rings: &Rings) -> Iteration {
        let Options { rule, guard, .. } = self.options;
        let [mut near, mut candidates] = [&mut self.near, &mut self.candidates].map(std::mem::take);
        let mut moves = std::mem::take(&mut self.moves);
        let here = self.snapshot(triangles, rings);
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
        iteration
    }

    /// Calls off moves that do not go together.
    fn veto(&mut self, triangles: &[[u32; 3]], rings: &Rings, iteration: u32) {
        self.off.iter_mut().for_each(|off| *off.get_mut() = false);
        let here = self.snapshot(triangles, rings);
        let moves = Moves { moves: &self.moves, iteration };
        match self.options.guard {
            Guard::Veto => self.workers.each_number(triangles.len(), |t, (): &mut ()| {
                moves.veto(triangles[t as usize], &here, &self.off);
            }),
            Guard::Blind => {}
            Guard::Independent => self.workers.each_number(self.moves.len(), |v, (): &mut ()| {
                if self.moves[v as usize].target != NOWHERE && moves.is_beaten(v, &here) {
                    self.off[v as usize].store(true, Relaxed);
                }
            }),
        }
    }

    /// Makes the next mesh, and calls off moves until each vertex has a sheet of triangles; returns how many vertices went.
    fn settle(&mut self, triangles: &[[u32; 3]], rings: &Rings, iteration: u32, next: &mut Buffers) -> usize {
        let here = self.snapshot(triangles, rings);
        let moves = Moves { moves: &self.moves, iteration };
        let count = self.moves.len();
        for round in 0..=MOST_ROUNDS {
            next.moving.resize(count, false);
            self.workers.each(&mut next.moving, |v, moving, (): &mut ()| {
                let stays = self.off[v as usize].load(Relaxed) || round == MOST_ROUNDS;
                *moving = self.moves[v as usize].target != NOWHERE && !stays;
            });
            let moving = &next.moving;
            let moved = |v: u32| if moving[v as usize] { self.moves[v as usize].target } else { v };
            let left = |t: u32| {
                let [a, b, c] = triangles[t as usize].map(moved);
                (a != b && b != c && c != a).then_some(([a, b, c], t))
            };
            self.workers.gather(triangles.len(), left, &mut next.pairs);
            next.triangles.clear();
            next.triangles.extend(next.pairs.iter().map(|(triangle, _)| *triangle));
            next.origins.clear();
            next.origins.extend(next.pairs.iter().map(|(_, origin)| *origin));
            next.rings.rebuild_by(self.workers, count, &next.triangles);
            let after = After { moving, triangles: &next.triangles, origins: &next.origins, rings: &next.rings };
            let before = self.called_off();
            self.workers.each_number(count, |v, fan: &mut Fan| {
                if !self.surface.locked[v as usize] {
                    moves.check(v, &here, &after, round >= PATIENCE, &self.off, fan);
                }
            });
            if self.called_off() == before {
                break;
            }
        }
        next.moving.iter().filter(|&&moving| moving).count()
    }

    fn called_off(&self) -> usize {
        self.off.iter().filter(|off| off.load(Relaxed)).count()
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
