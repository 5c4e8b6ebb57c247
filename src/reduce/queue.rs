//! QSlim: always the cheapest of all edges (Garland and Heckbert 1997, 1998), by a priority queue.

use super::incremental::Incremental;
use super::working::Working;
use super::{Options, Pass, Ticker};
use crate::error::Result;
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// Contracts edges until at most `faces` triangles are left or none can go.
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub(super) fn run(
    working: &mut Working,
    faces: usize,
    options: &Options,
    ticker: &mut Ticker,
) -> Result<Vec<Pass>> {
    let vertices = working.positions.len();
    let mut passes = Vec::new();
    let mut mesh = Incremental::new(working, options);
    let mut versions = vec![0u32; vertices];
    // What topology or normals refuse is not looked at again before something round it has changed. When nothing is left, all that is
    // there is tried once more, in other places than the best.
    while mesh.working.living > faces {
        let before = Pass { vertices, triangles: mesh.working.living, contractions: 0 };
        let somewhere = !passes.is_empty();
        let mut queue = BinaryHeap::new();
        for v in 0..vertices as u32 {
            let edges = mesh.neighbours(v).into_iter().filter(|&other| other > v).map(|other| [v, other]);
            queue.extend(edges.filter_map(|ends| entry(&mesh, ends, &versions)));
        }
        let mut contractions = 0;
        while mesh.working.living > faces
            && let Some(Entry { cost, ends, version }) = queue.pop()
        {
            if version != version_of(ends, &versions) {
                continue;
            }
            let left = if somewhere {
                mesh.contract_somewhere(ends)
            } else {
                mesh.candidate(ends)
                    .filter(|c| c.cost <= cost || cost.is_nan())
                    .and_then(|c| mesh.contract(c))
            };
            let Some(left) = left else { continue };
            contractions += 1;
            if contractions % TICK == 0 {
                ticker.tell(mesh.working.living)?;
            }
            for v in ends {
                versions[v as usize] += 1;
            }
            let changed = mesh.neighbours(left).into_iter().map(|other| [left, other]);
            queue.extend(changed.filter_map(|ends| entry(&mesh, ends, &versions)));
        }
        passes.push(Pass { contractions, ..before });
        if contractions == 0 && somewhere {
            break;
        }
    }
    Ok(passes)
}

/// An edge, and the sum of its ends' versions when it came.
struct Entry {
    cost: f64,
    ends: [u32; 2],
    version: u32,
}

fn entry(mesh: &Incremental, ends: [u32; 2], versions: &[u32]) -> Option<Entry> {
    Some(Entry { cost: mesh.candidate(ends)?.cost, ends, version: version_of(ends, versions) })
}

fn version_of(ends: [u32; 2], versions: &[u32]) -> u32 {
    versions[ends[0] as usize].wrapping_add(versions[ends[1] as usize])
}

impl Ord for Entry {
    /// The cheapest is the greatest; equal costs in the order of their ends.
    fn cmp(&self, other: &Self) -> Ordering {
        other.cost.total_cmp(&self.cost).then_with(|| other.ends.cmp(&self.ends))
    }
}

impl PartialOrd for Entry {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Entry {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Entry {}

/// Contractions between two reports.
const TICK: usize = 1 << 12;
