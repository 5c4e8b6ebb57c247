//! The precision schedule: how many low bits each level's coordinates lack (spec §5.6).

use super::{LatticeChoice, Options, Preview};
use crate::mesh::Lattice;
use crate::simplify::Simplified;

/// What the shifts of the levels follow from.
#[derive(Clone, Debug, PartialEq)]
pub enum Schedule {
    /// A given list, by number from 1; the last holds for all further levels.
    List(Vec<u32>),
    /// How large cells may be, in steps of the lattice: for each level, by number, and at all.
    Error(Vec<f64>, f64),
}

impl Schedule {
    /// The schedule that the settings ask for.
    pub fn new(options: &Options, simplified: &Simplified, lattice: &Lattice, lifted: bool) -> Self {
        // Tiles with a common lattice are to have common places, at all levels; each has errors of its own.
        let shared = matches!(options.lattice, LatticeChoice::Given { .. }) || options.lock_boundary;
        let share = match &options.preview {
            Preview::Off => return Self::List(Vec::new()),
            Preview::Auto if shared => return Self::List(Vec::new()),
            Preview::Schedule(list) => {
                return Self::List(list.iter().map(|&s| s.min(options.position_bits)).collect());
            }
            Preview::Auto | Preview::Fine => FINE,
            Preview::Coarse => COARSE,
        };
        let share = if lifted { share } else { UNLIFTED * share };
        let steps = |rms: f64| if lattice.step > 0.0 { share * MEAN * rms / lattice.step } else { 0.0 };
        let sizes = simplified.errors.iter().map(|error| steps(error.rms)).collect();
        Self::Error(sizes, f64::from(lattice.max_coordinate()) / CELLS)
    }

    /// The shift of level `j`, at least that of the finer one, where lifting has changed its mean squared error by this factor.
    pub fn shift(&self, j: usize, squares: f64, finer: u32) -> u32 {
        let shift = match self {
            Self::List(list) => list.get(j - 1).or(list.last()).copied().unwrap_or(0),
            Self::Error(sizes, most) => (sizes[j] * squares.sqrt()).min(*most).max(1.0).log2() as u32,
        };
        shift.max(finer)
    }
}

/// The mean distance of a level's vertices over their root mean square, about.
const MEAN: f64 = 0.75;
/// How large a cell may be, over the mean error of its level; and how much larger where levels are not lifted, whose vertices are
/// the input's, so that the error lies between them.
const FINE: f64 = 1.0;
const COARSE: f64 = 2.0;
const UNLIFTED: f64 = 2.0;
/// Cells along the longest side of the lattice, at least.
const CELLS: f64 = 32.0;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_follow_the_error() {
        let schedule = Schedule::Error(vec![0.0, 0.5, 1.0, 1.9, 2.0, 8.0, 1e9], 300.0);
        let shifts = [1, 2, 3, 4, 5].map(|j| schedule.shift(j, 1.0, 0));
        assert_eq!(shifts, [0, 0, 0, 1, 3]);
        assert_eq!(schedule.shift(6, 1.0, 0), 8, "no larger than all that matters");
        assert_eq!(schedule.shift(5, 0.25, 0), 2, "half the error, half the cell");
        assert_eq!(schedule.shift(1, 1.0, 2), 2, "never finer than a finer level");
    }

    #[test]
    fn the_last_number_holds_for_all_further_levels() {
        let schedule = Schedule::List(vec![1, 3]);
        assert_eq!([1, 2, 3, 9].map(|j| schedule.shift(j, 1.0, 0)), [1, 3, 3, 3]);
        assert_eq!(Schedule::List(Vec::new()).shift(1, 1.0, 0), 0);
    }
}
