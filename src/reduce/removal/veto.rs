//! Moves that do not go together, each called off by a flag that whoever sees the conflict sets: so no order matters.

use super::integer::{keeps_side, mixed, normal};
use super::propose::{Move, NOWHERE};
use super::snapshot::{Fan, Shape, Snapshot};
use crate::reduce::rings::Rings;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

/// The moves of an iteration.
#[derive(Clone, Copy, Debug)]
pub(super) struct Moves<'a> {
    pub(super) moves: &'a [Move],
    /// Counted from 0.
    pub(super) iteration: u32,
}

impl Moves<'_> {
    /// Grows with what a move costs. From the third iteration on it is chance: otherwise the dearest of some that are in each other's
    /// way would lose for ever.
    fn rank(&self, v: u32) -> (u32, u32) {
        let rank = if self.iteration < FAIR { self.moves[v as usize].key } else { mixed(v, self.iteration) };
        (rank, v)
    }

    /// Calls off moves until no triangle turns over, whichever of the rest are carried out.
    pub(super) fn veto(&self, triangle: [u32; 3], snapshot: &Snapshot, off: &[AtomicBool]) {
        let corners = turned_to_least(triangle);
        let is_mover = |v: u32| self.moves[v as usize].target != NOWHERE;
        if corners.iter().filter(|&&v| is_mover(v)).count() < 2 {
            // One alone has been looked at when it was proposed.
            return;
        }
        let at = |v: u32| snapshot.points[v as usize];
        let old = normal(at(corners[0]), at(corners[1]), at(corners[2]));
        // Which corners may still move.
        let mut movers = (0..3).filter(|&k| is_mover(corners[k])).fold(0u32, |set, k| set | 1 << k);
        while let Some(set) =
            (1..8).find(|set| set & movers == *set && self.turns_over(corners, *set, old, snapshot))
        {
            let inside = (0..3).filter(|k| set >> k & 1 == 1);
            let Some(dearest) = inside.max_by_key(|&k| self.rank(corners[k])) else { return };
            off[corners[dearest] as usize].store(true, Relaxed);
            movers &= !(1 << dearest);
        }
    }

    /// Whether a triangle turns over if the corners of this set move.
    fn turns_over(&self, corners: [u32; 3], set: u32, old: [i32; 3], snapshot: &Snapshot) -> bool {
        let moved = |k: usize| match set >> k & 1 {
            1 => self.moves[corners[k] as usize].target,
            _ => corners[k],
        };
        let [a, b, c] = [0, 1, 2].map(moved);
        let at = |v: u32| snapshot.points[v as usize];
        a != b && b != c && c != a && !keeps_side(old, normal(at(a), at(b), at(c)))
    }

    /// Whether a neighbour's move is cheaper.
    pub(super) fn is_beaten(&self, v: u32, snapshot: &Snapshot) -> bool {
        let own = (self.moves[v as usize].key, v);
        snapshot.corners(v).any(|w| {
            let other = self.moves[w as usize];
            other.target != NOWHERE && (other.key, w) < own
        })
    }

    /// Calls off the dearest of the moves after which the triangles round a vertex would be no sheet any more, or open where they were
    /// closed, or the other way round; `all`: each of them.
    pub(super) fn check(
        &self,
        v: u32,
        here: &Snapshot,
        after: &After,
        all: bool,
        off: &[AtomicBool],
        fan: &mut Fan,
    ) {
        let is_moving = |w: u32| after.moving[w as usize];
        // What nobody round it moves does not change.
        if is_moving(v) || !here.corners(v).any(is_moving) {
            return;
        }
        fan.gather_wings(v, after.triangles, after.rings);
        let expected = if here.boundary[v as usize] { Shape::Open } else { Shape::Closed };
        if fan.shape() == Some(expected) {
            return;
        }
        let new = after.rings.of(v).iter().flat_map(|&t| here.triangles[after.origins[t as usize] as usize]);
        let movers = here.corners(v).chain(new).filter(|&w| is_moving(w));
        if all {
            movers.for_each(|w| off[w as usize].store(true, Relaxed));
        } else if let Some(dearest) = movers.max_by_key(|&w| self.rank(w)) {
            off[dearest as usize].store(true, Relaxed);
        }
    }
}

/// The mesh as it would be after the moves that are not called off.
#[derive(Clone, Copy, Debug)]
pub(super) struct After<'a> {
    pub(super) moving: &'a [bool],
    pub(super) triangles: &'a [[u32; 3]],
    /// Which triangle of the present mesh each was.
    pub(super) origins: &'a [u32],
    pub(super) rings: &'a Rings,
}

/// The triangle with its least vertex in front, so that it does not matter which was there.
fn turned_to_least([a, b, c]: [u32; 3]) -> [u32; 3] {
    match a.min(b).min(c) {
        least if least == a => [a, b, c],
        least if least == b => [b, c, a],
        _ => [c, a, b],
    }
}

/// Iterations in which the dearest loses.
const FAIR: u32 = 2;
