//! Which vertices a level removes.

use super::metric::lower_quartile;
use super::removal::Remover;
use super::rows::Pattern;
use super::{Method, Options};
use crate::error::Result;
use crate::mesh::Vertex;
use crate::mesh::random::SplitMix64;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// What a level may take.
#[derive(Clone, Copy, Debug)]
pub struct Allowance {
    /// Most vertices.
    pub quota: usize,
    /// Most of what all removals would cost, as a share of the sum of roots; 1 is no limit.
    pub budget: f64,
    /// Triangles of components that the level has left out already.
    pub gone: usize,
    /// Vertices that are to go in this level and all coarser ones, where the level is to take but what is cheap beside them.
    pub wanted: usize,
}

/// Removes one level: first the vertices of the pattern's class, if any, then those that the method chooses, and no more than half of the
/// triangles (but for one vertex). `report` is told the vertices left.
pub fn remove_level(
    remover: &mut Remover,
    Allowance { quota, budget, gone, wanted }: Allowance,
    options: &Options,
    random: &mut SplitMix64,
    report: &mut dyn FnMut(usize) -> Result<()>,
) -> Result<()> {
    // Two triangles go with an interior vertex; the first removal is free, or a disc of three triangles would stay.
    let (left, half) = (remover.table.triangle_count(), (remover.table.triangle_count() + gone) / 2);
    let mut level = Level {
        vertices: remover.vertices.saturating_sub(quota),
        triangles: (left + gone - half + 1).min(left - 1),
        remover,
        report,
    };
    let by_queue = match options.method {
        Method::Auto => level.remover.pattern.is_none(),
        Method::Stellar => false,
        Method::Ffc => true,
    };
    // The queue asks for all costs anyway.
    let every = if by_queue { 1 } else { level.remover.vertices / SAMPLE };
    let every = every.clamp(1, SPARSEST) as u32;
    let pattern = level.remover.pattern.as_ref().map(|pattern| (pattern.class, pattern.is_exact()));
    if let Some((_, true)) = pattern {
        let (of_class, sample) = level.remover.of_pattern(every);
        level.follow(&of_class, sample)?;
    }
    let preferred = pattern.and_then(|(class, exact)| (!exact).then_some(class));
    let share = if preferred.is_some() { FILL * budget } else { budget };
    let (mut candidates, mut sample) = level.remover.candidates(every);
    let dear = if budget < 1.0 { dear(&mut sample, level.remover.noise()) } else { f32::INFINITY };
    // A level that takes whatever there is takes what is dear, too.
    let wanted = if budget < 1.0 { wanted as f64 / candidates.len().max(1) as f64 } else { f64::INFINITY };
    let dear = dear.min(cheapest(&mut sample, AT_ONCE * wanted));
    let [of_class, cheap, most] = affordable(sample, [OF_CLASS * budget, FIRST_PASS * share, share]);
    let [cheap, most] = [cheap, most].map(|cost| cost.min(dear));
    if let Some(lines) = &level.remover.lines {
        candidates.retain(|&v| !lines.hold(v));
        level.remove_along_lines()?;
    }
    if let Some(class) = preferred {
        level.remove_class(&candidates, class, of_class)?;
    }
    if by_queue {
        level.by_queue(&candidates, most)
    } else {
        level.by_choice(candidates, [cheap, most], options.choices, random)
    }
}

/// The costs up to which vertices carry certain shares of the sum of the roots of all costs.
fn affordable<const N: usize>(mut costs: Vec<f32>, shares: [f64; N]) -> [f32; N] {
    costs.sort_unstable_by(f32::total_cmp);
    let root = |cost: f32| f64::from(cost.max(0.0)).sqrt();
    let total: f64 = costs.iter().map(|&cost| root(cost)).sum();
    shares.map(|share| {
        let mut sum = 0.0;
        let dear = costs.iter().find(|&&cost| {
            sum += root(cost);
            sum > total * share
        });
        dear.copied().unwrap_or(f32::INFINITY)
    })
}

/// The cost up to which a share of the vertices cost.
fn cheapest(sample: &mut [f32], share: f64) -> f32 {
    if share >= 1.0 || sample.is_empty() {
        return f32::INFINITY;
    }
    let at = ((share * sample.len() as f64) as usize).min(sample.len() - 1);
    *sample.select_nth_unstable_by(at, f32::total_cmp).1
}

/// The cost from which on a vertex waits, whatever the budget: in a level that takes flat faces nothing that is bent has to go, for what
/// is flat and blocked now is free in the next one. What rounding costs anyway is not dear.
fn dear(sample: &mut [f32], noise: f32) -> f32 {
    lower_quartile(sample).map_or(f32::INFINITY, |quarter| DEAR * DEAR * quarter.max(noise))
}

struct Level<'a, 'b> {
    remover: &'a mut Remover<'b>,
    report: &'a mut dyn FnMut(usize) -> Result<()>,
    /// Vertices to leave.
    vertices: usize,
    /// As long as there are more triangles than this, another vertex may go.
    triangles: usize,
}

impl Level<'_, '_> {
    fn is_over(&self) -> bool {
        self.remover.vertices <= self.vertices || self.remover.table.triangle_count() <= self.triangles
    }

    fn remove(&mut self, v: Vertex) -> Result<()> {
        if self.remover.remove(v) && self.remover.vertices.is_multiple_of(REPORT_EVERY) {
            (self.report)(self.remover.vertices)?;
        }
        Ok(())
    }

    /// Removes vertices that a pattern leads to, whatever they cost, unless it is far more than most of their kind cost: such a vertex is
    /// a feature that the rows run over by chance.
    fn follow(&mut self, of_class: &[Vertex], mut sample: Vec<f32>) -> Result<()> {
        let middle = sample.len() / 2;
        if sample.is_empty() {
            return Ok(());
        }
        let median = *sample.select_nth_unstable_by(middle, f32::total_cmp).1;
        let most = OUTLIER * f64::from(median).max(self.remover.negligible());
        for window in of_class.chunks(WINDOW) {
            self.remover.expect(window);
            for &v in window {
                if self.is_over() {
                    return Ok(());
                }
                if self.remover.cost(v).is_some_and(|cost| f64::from(cost) <= most) {
                    self.remove(v)?;
                }
            }
        }
        Ok(())
    }

    /// Removes what goes with straight lines; what another one blocks is left for the next level.
    fn remove_along_lines(&mut self) -> Result<()> {
        let order = self.remover.lines.as_mut().map(|lines| std::mem::take(&mut lines.order));
        let mut left = Vec::new();
        for v in order.into_iter().flatten() {
            if self.is_over() || self.remover.is_blocked(v) {
                left.push(v);
            } else if self.remover.cost(v).is_some() && self.remover.loses_nothing(v) {
                self.remove(v)?;
            }
        }
        if let Some(lines) = &mut self.remover.lines {
            lines.order = left;
        }
        Ok(())
    }

    fn remove_class(&mut self, free: &[Vertex], class: u8, most: f32) -> Result<()> {
        for &v in free {
            if self.is_over() {
                break;
            }
            let of_class = |pattern: &Pattern| pattern.class_of(v) == class;
            if self.remover.pattern.as_ref().is_some_and(of_class)
                && self.remover.cost(v).is_some_and(|cost| cost <= most)
            {
                self.remove(v)?;
            }
        }
        Ok(())
    }

    /// Fast Stellar: the cheapest of `choices` random candidates, over and over. They are drawn from one small window of the
    /// candidates after the other, so that successive removals are near each other in memory; that what is cheap in one window goes
    /// before what is dear in another, there are two passes. A cost that is not asked for before its vertex is blocked is never
    /// computed.
    fn by_choice(
        &mut self,
        mut candidates: Vec<Vertex>,
        passes: [f32; 2],
        choices: u32,
        random: &mut SplitMix64,
    ) -> Result<()> {
        for most in passes {
            for window in candidates.chunks_mut(WINDOW) {
                self.remover.expect(window);
                let mut left = window.len();
                while !self.is_over() {
                    let mut best: Option<(f32, Vertex)> = None;
                    let mut drawn = 0;
                    while drawn < choices && left > 0 {
                        let place = random.below(left as u32) as usize;
                        let v = window[place];
                        let Some(cost) = self.remover.cost(v).filter(|&cost| cost <= most) else {
                            left -= 1;
                            window.swap(place, left);
                            continue;
                        };
                        drawn += 1;
                        if best.is_none_or(|(least, _)| cost < least) {
                            best = Some((cost, v));
                        }
                    }
                    let Some((_, v)) = best else { break };
                    self.remove(v)?;
                }
            }
        }
        Ok(())
    }

    /// Four-Face Clusters: the cheapest candidate, over and over.
    fn by_queue(&mut self, candidates: &[Vertex], most: f32) -> Result<()> {
        // Costs are not negative, so their bits are ordered as they are.
        let keyed = candidates.iter().filter_map(|&v| {
            let cost = self.remover.cost(v).filter(|&cost| cost <= most)?;
            Some(Reverse((cost.max(0.0).to_bits(), v)))
        });
        let mut queue: BinaryHeap<_> = keyed.collect();
        while !self.is_over() {
            let Some(Reverse((_, v))) = queue.pop() else { break };
            if self.remover.cost(v).is_some() {
                self.remove(v)?;
            }
        }
        Ok(())
    }
}

/// Share of the budget that a preferred class may take: less than all of it, or what is bent would go for the sake of the pattern.
const OF_CLASS: f64 = 0.7;

/// What a class leaves to other vertices of its level, as a share of the budget.
const FILL: f64 = 0.5;

/// How many times the median of its class a vertex may cost: six times as far off, in stars of one size. Noise hardly goes that far.
const OUTLIER: f64 = 36.0;

/// Share of the vertices still to go, the cheapest, to which a level keeps. If removals changed no cost, all of these would go in the end and none
/// that is dearer; what is left is room for those that become cheap, or dear, by what goes first.
const AT_ONCE: f64 = 0.8;

/// Candidates that a random choice is made from.
const WINDOW: usize = 256;

/// Share of the budget that the first pass over all windows may take.
const FIRST_PASS: f64 = 0.5;

/// How many times the root of a cost may be above that of the lower quartile. Where distances spread as a normal distribution does, those up
/// to 4.2 times carry six tenths of the sum, the default budget: what is bent alike is left to the budget, and where flat vertices do
/// not count in the sum, nothing dearer goes than would go there.
const DEAR: f32 = 4.2;

/// Vertices whose costs tell what is affordable, at least.
const SAMPLE: usize = 4096;

/// Of so many vertices, one tells, at most.
const SPARSEST: usize = 16;

/// Removals between two calls of the progress callback.
const REPORT_EVERY: usize = 1024;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_bent_waits_for_what_is_flat() {
        // Three eighths are flat: what costs more than the square of 4.2 times what the lattice does has to wait.
        assert_eq!(dear(&mut [1.0, 0.0, 2.0, 0.0, 4.0, 5.0, 0.0, 6.0], 1e-4), DEAR * DEAR * 1e-4);
        // Where nothing is flat, the quarter tells.
        assert_eq!(dear(&mut [4.0, 3.0, 2.0, 1.0], 1e-4), DEAR * DEAR * 2.0);
        assert_eq!(dear(&mut [], 1.0), f32::INFINITY);
    }

    #[test]
    fn what_is_cheap_beside_all_that_goes_is_a_share_of_the_costs() {
        let costs = [5.0, 0.0, 3.0, 1.0, 4.0, 2.0, 7.0, 6.0];
        for (share, expected) in [(0.0, 0.0), (0.25, 2.0), (0.5, 4.0), (0.99, 7.0), (1.0, f32::INFINITY)] {
            assert_eq!(cheapest(&mut costs.clone(), share), expected, "{share}");
        }
        assert_eq!(cheapest(&mut costs.clone(), f64::INFINITY), f32::INFINITY);
        assert_eq!([0.5, f64::INFINITY].map(|share| cheapest(&mut [], share)), [f32::INFINITY; 2]);
    }

    /// What is dear is what the default budget ends at where distances spread as a normal distribution does.
    #[test]
    fn what_is_bent_alike_is_left_to_the_budget() {
        // Its absolute values at 1,000 equal shares: the density, added up.
        let (mut costs, mut x, mut below) = (Vec::new(), 0.0f64, 0.0);
        while costs.len() < 999 {
            below += 1e-4 * (2.0 / std::f64::consts::PI).sqrt() * (-0.5 * x * x).exp();
            x += 1e-4;
            if below >= (costs.len() as f64 + 0.5) / 1000.0 {
                costs.push((x * x) as f32);
            }
        }
        let [budget] = affordable(costs.clone(), [Options::default().level_budget]);
        let ratio = (dear(&mut costs, 0.0) / budget).sqrt();
        assert!((ratio - 1.0).abs() < 0.02, "{ratio}");
    }
}
