//! From numbers of a source to the integers that are coded, and back (spec §13.2).

/// How the numbers of an attribute become integers.
#[derive(Clone, Debug, PartialEq)]
pub enum Quantisation {
    /// Integers as they are stored.
    Integer,
    /// Floating-point numbers on a lattice: component k of `origin[k]` plus a multiple of `step`.
    Lattice {
        /// Bits of a number, 1 to 24.
        bits: u32,
        /// The least number of each component.
        origin: Vec<f64>,
        /// Distance of neighbouring numbers, of all components; 0 where each has but one.
        step: f64,
    },
    /// Unit vectors as octahedral coordinates; of a tangent, with the sign of its fourth component.
    Octahedral {
        /// Bits a coordinate, 2 to 16.
        bits: u32,
    },
    /// Floating-point numbers by their bits, none lost: one integer a binary32, two a binary64.
    Raw,
}
