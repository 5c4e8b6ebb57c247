//! The precision schedule: how many low bits each level's coordinates lack (spec §5.6).

use super::{Options, Preview};
use crate::mesh::CornerTable;
use crate::simplify::Simplified;

/// s of the levels, by number from 1; not falling.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Schedule(Vec<u32>);

impl Schedule {
    /// The schedule that the settings ask for. `positions` are those of level 0 on the lattice, by the numbers of the input.
    pub fn of(options: &Options, simplified: &Simplified, positions: &[[i32; 3]]) -> Self {
        match &options.preview {
            Preview::Off => Self::default(),
            Preview::Coarse => Self::coarse(simplified, positions),
            Preview::Schedule(schedule) => {
                Self(schedule.iter().map(|&s| s.min(options.position_bits)).collect())
            }
        }
    }

    /// s of level `j`: 0 at level 0.
    pub fn precision(&self, j: u32) -> u32 {
        let known = self.0.get((j as usize).saturating_sub(1)).or(self.0.last());
        if j == 0 { 0 } else { known.copied().unwrap_or(0) }
    }

    /// The largest steps of at most an eighth of a level's mean edge, from the base on towards finer levels until they are 1.
    fn coarse(simplified: &Simplified, positions: &[[i32; 3]]) -> Self {
        let history = &simplified.history;
        let mut shifts = vec![0; history.level_count()];
        let mut table = simplified.base.clone();
        let mut least = u32::MAX;
        for j in (1..=history.level_count()).rev() {
            least = least.min(shift(mean_edge(&table, positions)));
            if least == 0 {
                break;
            }
            shifts[j - 1] = least;
            history.apply_level(&mut table, j - 1).expect("the history leads back from the base");
        }
        Self(shifts)
    }
}

/// The largest s for which 2^s is at most an eighth of an edge; 0 for short ones.
fn shift(edge: f64) -> u32 {
    // At least 1 and below 2^22, as lattices have at most 24 bits and an edge is at most √3 times their extent.
    ((edge / EDGE_STEPS).max(1.0) as u32).ilog2()
}

/// Mean length of the edges, in steps of the lattice. There are triangles.
fn mean_edge(table: &CornerTable, positions: &[[i32; 3]]) -> f64 {
    let (mut sum, mut count) = (0.0, 0u32);
    for c in table.triangles().flat_map(|t| t.corners()) {
        let opposite = table.opposite(c);
        if opposite.is_none() || c < opposite {
            let (a, b) = table.edge(c);
            let (a, b) = (positions[a.index()], positions[b.index()]);
            let squares = (0..3).map(|k| f64::from(a[k] - b[k]) * f64::from(a[k] - b[k]));
            sum += squares.sum::<f64>().sqrt();
            count += 1;
        }
    }
    sum / f64::from(count.max(1))
}

/// Steps of a level's grid that go into its mean edge, at least.
const EDGE_STEPS: f64 = 8.0;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_eighth_of_the_edge() {
        let expected = [(0.0, 0), (1.0, 0), (15.9, 0), (16.0, 1), (31.9, 1), (32.0, 2), (8.0 * 1024.0, 10)];
        for (edge, s) in expected {
            assert_eq!(shift(edge), s, "{edge}");
        }
    }

    #[test]
    fn every_edge_counts_once() {
        // A square, cut in two: four sides and a diagonal.
        let table = CornerTable::from_triangles(4, &[[0, 1, 2], [0, 2, 3]]).unwrap();
        let positions = [[0, 0, 0], [10, 0, 0], [10, 10, 0], [0, 10, 0]];
        assert!((mean_edge(&table, &positions) - (40.0 + 200f64.sqrt()) / 5.0).abs() < 1e-12);
    }

    #[test]
    fn the_last_number_holds_for_all_further_levels() {
        let schedule = Schedule(vec![1, 3]);
        assert_eq!([0, 1, 2, 3, 9].map(|j| schedule.precision(j)), [0, 1, 3, 3, 3]);
        assert_eq!([0, 1].map(|j| Schedule::default().precision(j)), [0, 0]);
    }
}
