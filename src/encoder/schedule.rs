//! The precision schedule: how many low bits each level's coordinates lack (spec §5.6).

use super::{LatticeChoice, Options, Preview};
use crate::mesh::Lattice;

/// What the shifts of the levels follow from.
#[derive(Clone, Debug, PartialEq)]
pub enum Schedule {
    /// A given list, by number from 1; the last holds for all further levels.
    List(Vec<u32>),
    /// How large cells may be: beside their level's mean error, and at all, in steps of the lattice.
    Error(f64, f64),
}

impl Schedule {
    /// The schedule that the settings ask for.
    pub fn new(options: &Options, lattice: &Lattice, lifted: bool) -> Self {
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
        Self::Error(share, f64::from(lattice.max_coordinate()) / CELLS)
    }

    /// The shift of level `j`, at least that of the finer one; its mean error is this, in steps of the lattice.
    pub fn shift(&self, j: usize, error: f64, finer: u32) -> u32 {
        let shift = match self {
            Self::List(list) => list.get(j - 1).or(list.last()).copied().unwrap_or(0),
            Self::Error(share, most) => (share * error).min(*most).max(1.0).log2() as u32,
        };
        shift.max(finer)
    }
}

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
        let schedule = Schedule::Error(2.0, 300.0);
        let shifts = [0.0, 0.4, 0.9, 1.0, 4.1, 1e9].map(|error| schedule.shift(1, error, 0));
        assert_eq!(shifts, [0, 0, 0, 1, 3, 8]);
        assert_eq!(schedule.shift(2, 1.0, 2), 2, "never finer than a finer level");
    }

    #[test]
    fn the_last_number_holds_for_all_further_levels() {
        let schedule = Schedule::List(vec![1, 3]);
        assert_eq!([1, 2, 3, 9].map(|j| schedule.shift(j, 1.0, 0)), [1, 3, 3, 3]);
        assert_eq!(Schedule::List(Vec::new()).shift(1, 1.0, 0), 0);
    }
}
