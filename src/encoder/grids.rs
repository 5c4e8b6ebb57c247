//! Which grids the coordinates of an axis are taken from: chosen by what they would cost (spec §10.2).

use crate::codec::correction::{MAX_GRIDS, place};
use crate::codec::grid::{Grid, MAX_PLACES, Points, Real};

/// A coordinate, and the middle of its cell.
pub type Sample = (f64, f64);

/// The grids of one axis, given some of its coordinates; all its coordinates may be others.
pub fn choose(samples: &[Sample], half: f64, real: Real) -> Vec<Grid> {
    let all = Grid::Binary { dropped: 0 };
    let mut chosen = Vec::new();
    // What is not on a grid chosen before costs this much on the grid of all numbers.
    let mut left: Vec<(Sample, f64)> = samples
        .iter()
        .map(|&(x, p)| {
            ((x, p), on(&Points::new(all, real), real, x, p, half).map_or(raw(real), |(bits, _)| bits))
        })
        .collect();
    while chosen.len() + 1 < MAX_GRIDS && left.len() * 50 > samples.len() {
        let rest: Vec<_> = left.iter().map(|(sample, _)| *sample).collect();
        let few: Vec<_> = left.iter().step_by(left.len().div_ceil(FEW)).copied().collect();
        let mut worth: Vec<_> =
            candidates(&rest, real).into_iter().map(|grid| (saving(grid, &few, half, real), grid)).collect();
        worth.retain(|&(saved, _)| saved > 0.0);
        worth.sort_by(|x, y| y.0.total_cmp(&x.0));
        worth.truncate(CLOSELY);
        let close = worth.into_iter().rev().map(|(_, grid)| (grid, saving(grid, &left, half, real)));
        let best = close.max_by(|x, y| x.1.total_cmp(&y.1));
        let Some((grid, saved)) = best else { break };
        if saved < 0.05 * samples.len() as f64 {
            break;
        }
        let points = Points::new(grid, real);
        left.retain(|&((x, p), _)| on(&points, real, x, p, half).is_none());
        chosen.push(grid);
    }
    chosen.push(all);
    chosen
}

/// Bits that a grid saves on these coordinates, each with its cost otherwise.
fn saving(grid: Grid, samples: &[(Sample, f64)], half: f64, real: Real) -> f64 {
    let points = Points::new(grid, real);
    let (mut saved, mut hits) = (0.0, 0.0);
    let mut offsets = [0.0f64; 2 * NEAR + 1];
    for &((x, p), cost) in samples {
        if let Some((bits, offset)) = on(&points, real, x, p, half) {
            saved += cost - bits;
            hits += 1.0;
            offsets[(offset + NEAR as i32).clamp(0, 2 * NEAR as i32) as usize] += 1.0;
        }
    }
    let count = samples.len() as f64;
    saved - entropy(&[hits, count - hits]) - entropy(&offsets)
}

/// Bits of a coordinate on a grid, and how far off its point it is.
fn on(points: &Points, real: Real, x: f64, p: f64, half: f64) -> Option<(f64, i32)> {
    let (low, count) = points.within(p - half, p + half);
    place(points, real, x, low, count).map(|(_, offset)| ((count as f64).log2(), offset))
}

/// Bits that tell in which of some classes of these sizes each thing is.
fn entropy(sizes: &[f64]) -> f64 {
    let all: f64 = sizes.iter().sum();
    sizes.iter().filter(|&&n| n > 0.0).map(|n| n * (all / n).log2()).sum()
}

fn candidates(samples: &[Sample], real: Real) -> Vec<Grid> {
    // Low bits that none has; binary32 numbers among binary64 ones.
    let common = samples.iter().map(|&(x, _)| real.key(x)).map(|k| if k < 0 { -1 - k } else { k });
    let common = common.fold(0, |bits, magnitude| bits | magnitude).trailing_zeros().min(real.bits() - 2);
    let dropped = [common, 29].into_iter().filter(|&d| d > 0 && d <= real.bits() - 2);
    // Of several that cost the same, the first is taken: that of the fewest digits.
    let decimals =
        (1..=15).flat_map(|digits| (0..=MAX_PLACES).map(move |places| Grid::Decimal { digits, places }));
    dropped.map(|dropped| Grid::Binary { dropped }).chain(decimals).collect()
}

/// Bits of a coordinate that is on no grid.
fn raw(real: Real) -> f64 {
    f64::from(real.bits())
}

/// Coordinates that decide which grids are looked at closely, and how many of these there are.
const FEW: usize = 64;
const CLOSELY: usize = 12;
/// Offsets that are told apart.
const NEAR: usize = 16;

#[cfg(test)]
mod tests {
    use super::*;

    fn chosen(coordinate: impl Fn(f64) -> f64, real: Real) -> Vec<Grid> {
        let half = 0.01;
        let samples = (1..500).map(|k| coordinate((f64::from(k) * 0.5f64.sqrt()).fract())).map(|x| (x, x));
        choose(&samples.collect::<Vec<_>>(), half, real)
    }

    #[test]
    fn decimals_are_found() {
        let all = Grid::Binary { dropped: 0 };
        let three = |x: f64| (x * 1000.0).round() / 1000.0;
        let decimal = |digits, places| Grid::Decimal { digits, places };
        // Below 1, three places are three digits.
        assert_eq!(chosen(three, Real::Binary64), [decimal(3, 3), all]);
        assert_eq!(chosen(|x| f64::from(three(x) as f32), Real::Binary32), [decimal(3, 3), all]);
        // Above, they are four.
        assert_eq!(chosen(|x| 5.0 + three(x), Real::Binary64)[0], decimal(4, 3));
        assert_eq!(chosen(|x| x * 0.1f64.sqrt(), Real::Binary64), [all]);
        let single = |x: f64| f64::from((x * 0.1f64.sqrt()) as f32);
        assert_eq!(chosen(single, Real::Binary64), [Grid::Binary { dropped: 29 }, all]);
        assert_eq!(chosen(single, Real::Binary32), [all]);
    }

    #[test]
    fn a_second_grid_for_what_the_first_has_not() {
        let mixed = |x: f64| if x < 0.8 { (x * 100.0).round() / 100.0 } else { (x * 1e6).round() / 1e6 };
        let grids = chosen(mixed, Real::Binary64);
        let decimal = |digits, places| Grid::Decimal { digits, places };
        assert_eq!(grids, [decimal(2, 2), decimal(6, 6), Grid::Binary { dropped: 0 }]);
    }
}
