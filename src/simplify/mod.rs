//! Mesh -> history: vertex by vertex, level by level, down to the base.
//!
//! Two ways to choose the next vertex: `ffc`, Four-Face Clusters with a priority queue (Velho 2001), and `stellar`, the best of
//! d random vertices (Vieira, Velho, Lopes, Tavares, Lewiner 2003, after Wu and Kobbelt 2002). Everything else they share. Both work on
//! positions in full precision: on the lattice small triangles degenerate.

mod covering;
mod frame;
mod polygon;
mod quadric;
mod removal;

pub use covering::LevelError;

use crate::error::{Error, Result};
use crate::mesh::random::SplitMix64;
use crate::mesh::{CornerTable, Lattice, Vertex};
use crate::refine::History;
use bitvec::vec::BitVec;
use removal::Remover;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// How the next vertex is chosen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Method {
    /// The best of [`Options::choices`] random vertices.
    #[default]
    Stellar,
    /// The best of all, by a priority queue.
    Ffc,
}

/// Settings of a simplification.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// How the next vertex is chosen.
    pub method: Method,
    /// Weight of the distortion C(v), over the fourth power of the mean edge length.
    pub alpha: f64,
    /// Weight of the shape S(v), over the mean edge length round v.
    pub beta: f64,
    /// d, the number of random vertices compared by [`Method::Stellar`]; at least 1.
    pub choices: u32,
    /// Vertices to stop at; the larger of 1 % and 500 where not given.
    pub base_vertices: Option<usize>,
    /// Largest share of a level's vertices that the level may remove, above 0 and at most 1.
    pub level_share: f64,
    /// Seed of the random choices.
    pub seed: u64,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            method: Method::Stellar,
            alpha: 0.75,
            beta: 0.25,
            choices: 8,
            base_vertices: None,
            level_share: 0.2,
            seed: 0,
        }
    }
}

/// A base and the way back.
#[derive(Debug)]
pub struct Simplified {
    /// The base, on the vertex numbers of the input.
    pub base: CornerTable,
    /// All removals.
    pub history: History,
    /// For each level, finest first, the base last, its distance from the input.
    pub errors: Vec<LevelError>,
}

/// Simplifies down to the base.
///
/// `locked` vertices stay. `progress` is called with the vertices removed so far and the vertices to remove; it returns
/// whether to go on.
///
/// # Errors
/// [`Error::Cancelled`] where `progress` said so.
pub fn simplify(
    table: CornerTable,
    positions: &[[f64; 3]],
    locked: BitVec,
    lattice: &Lattice,
    options: &Options,
    progress: &mut dyn FnMut(u64, u64) -> bool,
) -> Result<Simplified> {
    let frame = frame::Frame::new(lattice);
    let positions: Vec<_> = positions.iter().map(|&p| frame.inside(p)).collect();
    let mut remover = Remover::new(table, positions, locked, options);
    let start = remover.vertices;
    let target = options.base_vertices.unwrap_or_else(|| default_base_vertices(start));
    let mut errors = vec![remover.covering.error(&remover.table, &remover.positions, &frame)];
    let mut random = SplitMix64::new(options.seed);
    let mut report = |vertices: usize| {
        let done = (start - vertices) as u64;
        if progress(done, start.saturating_sub(target) as u64) { Ok(()) } else { Err(Error::Cancelled) }
    };
    while remover.vertices > target {
        let share = (remover.vertices as f64 * options.level_share) as usize;
        let quota = share.max(1).min(remover.vertices - target);
        remover.begin_level();
        match options.method {
            Method::Stellar => {
                level_by_choice(&mut remover, quota, options.choices, &mut random, &mut report)?
            }
            Method::Ffc => level_by_queue(&mut remover, quota, &mut report)?,
        }
        if !remover.history.end_level() {
            break;
        }
        errors.push(remover.covering.error(&remover.table, &remover.positions, &frame));
    }
    report(remover.vertices)?;
    Ok(Simplified { base: remover.table, history: remover.history, errors })
}

/// Vertices to stop at for a mesh of so many vertices, where [`Options::base_vertices`] is not given.
pub fn default_base_vertices(vertices: usize) -> usize {
    (vertices / 100).max(500)
}

/// Removals between two calls of the progress callback.
const REPORT_EVERY: usize = 1024;

/// One level of Fast Stellar: the cheapest of `choices` random valid vertices, over and over.
fn level_by_choice(
    remover: &mut Remover,
    quota: usize,
    choices: u32,
    random: &mut SplitMix64,
    report: &mut dyn FnMut(usize) -> Result<()>,
) -> Result<()> {
    let mut valid: Vec<Vertex> =
        (0..remover.positions.len() as u32).map(Vertex).filter(|&v| remover.is_free(v)).collect();
    let mut removed = 0;
    while removed < quota {
        let mut best: Option<(f64, Vertex)> = None;
        let mut drawn = 0;
        while drawn < choices && !valid.is_empty() {
            let place = random.below(valid.len() as u32) as usize;
            let v = valid[place];
            let cost = if remover.is_free(v) { remover.cost(v) } else { f64::INFINITY };
            if cost.is_infinite() {
                valid.swap_remove(place);
                continue;
            }
            drawn += 1;
            if best.is_none_or(|(least, _)| cost < least) {
                best = Some((cost, v));
            }
        }
        let Some((_, v)) = best else { return Ok(()) };
        // The cost may be an old one: an edge made since can stand in the way.
        let done = match remover.plan(v) {
            Some(plan) => remover.remove(v, &plan),
            None => false,
        };
        if !done {
            remover.reject(v);
            continue;
        }
        removed += 1;
        if removed % REPORT_EVERY == 0 {
            report(remover.vertices)?;
        }
    }
    Ok(())
}

/// One level of Four-Face Clusters: the cheapest valid vertex, over and over.
fn level_by_queue(
    remover: &mut Remover,
    quota: usize,
    report: &mut dyn FnMut(usize) -> Result<()>,
) -> Result<()> {
    let mut queue = BinaryHeap::new();
    for v in (0..remover.positions.len() as u32).map(Vertex) {
        if remover.is_free(v) {
            let cost = remover.cost(v);
            if cost.is_finite() {
                queue.push((Reverse(Ordered(cost)), Reverse(v)));
            }
        }
    }
    let mut removed = 0;
    while removed < quota {
        let Some((Reverse(Ordered(queued)), Reverse(v))) = queue.pop() else { return Ok(()) };
        if !remover.is_free(v) {
            continue;
        }
        // Removals near by may have raised the cost; then it waits for its turn.
        let Some(plan) = remover.plan(v) else { continue };
        if plan.cost > queued * (1.0 + 1e-6) {
            queue.push((Reverse(Ordered(plan.cost)), Reverse(v)));
        } else if remover.remove(v, &plan) {
            removed += 1;
            if removed % REPORT_EVERY == 0 {
                report(remover.vertices)?;
            }
        }
    }
    Ok(())
}

/// A cost with a total order.
#[derive(Clone, Copy, PartialEq)]
struct Ordered(f64);

impl Eq for Ordered {}

impl PartialOrd for Ordered {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Ordered {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.0.total_cmp(&other.0)
    }
}
