//! Multiple choice (Wu and Kobbelt 2002): the cheapest of a few random edges, again and again, without a queue.

use super::incremental::{Candidate, Incremental};
use super::star::GONE;
use super::working::Working;
use super::{Options, Pass, Ticker};
use crate::error::Result;
use crate::mesh::random::SplitMix64;

/// Contracts edges until at most `faces` triangles are left, or so many draws in vain that hardly any can go.
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub(super) fn run(
    working: &mut Working,
    faces: usize,
    options: &Options,
    ticker: &mut Ticker,
) -> Result<Vec<Pass>> {
    let (vertices, triangles) = (working.positions.len(), working.living);
    let mut mesh = Incremental::new(working, options);
    let mut random = SplitMix64::new(options.seed);
    let mut living: Vec<u32> = (0..triangles as u32).collect();
    let (mut in_vain, mut contractions) = (0, 0);
    while mesh.working.living > faces && in_vain < MOST_IN_VAIN * mesh.working.living {
        if mesh.working.living < living.len() / 2 {
            living.retain(|&t| mesh.working.triangles[t as usize] != GONE);
            ticker.tell(mesh.working.living)?;
        }
        let mut best: Option<Candidate> = None;
        for _ in 0..options.choices {
            let candidate = draw(&mesh, &living, &mut random);
            if candidate.is_some_and(|c| best.is_none_or(|best| c.cost < best.cost)) {
                best = candidate;
            }
        }
        let done = best.and_then(|best| {
            let somewhere = in_vain > mesh.working.living;
            if somewhere { mesh.contract_somewhere(best.ends) } else { mesh.contract(best) }
        });
        if done.is_some() {
            contractions += 1;
            in_vain = 0;
        } else {
            in_vain += 1;
        }
    }
    Ok(vec![Pass { vertices, triangles, contractions }])
}

/// A random edge of a random triangle.
fn draw(mesh: &Incremental, living: &[u32], random: &mut SplitMix64) -> Option<Candidate> {
    let triangle = loop {
        let t = living[random.below(living.len() as u32) as usize];
        let triangle = mesh.working.triangles[t as usize];
        if triangle != GONE {
            break triangle;
        }
    };
    let k = random.below(3) as usize;
    mesh.candidate([triangle[k], triangle[(k + 1) % 3]])
}

/// Draws in vain, one after the other, for each triangle left.
const MOST_IN_VAIN: usize = 20;
