//! History <-> opaque payloads: walk, keyframes, refinements, residue, correction, order (spec §4 to §8, §10, §11).

#[cfg(feature = "encode")]
pub(crate) mod answers;
pub mod attributes;
mod context;
pub mod correction;
pub(crate) mod edgebreaker;
mod extents;
pub mod grid;
pub mod keyframe;
mod lanes;
pub mod lift;
pub mod order;
mod places;
pub(crate) mod position;
pub(crate) mod precision;
#[cfg(not(feature = "fuzzing"))]
pub(crate) mod refinement;
#[cfg(feature = "fuzzing")]
pub mod refinement;
pub mod residue;
mod shared;
mod vector;
pub mod walk;
pub mod whole;

#[cfg(all(test, feature = "encode"))]
mod tests;
