//! History <-> opaque payloads: walk, keyframes, refinements, residue (spec §4 to §8).

#[cfg(feature = "encode")]
pub mod answers;
mod context;
pub mod edgebreaker;
pub mod keyframe;
pub mod places;
pub mod position;
pub mod precision;
pub mod refinement;
pub mod residue;
mod vector;
pub mod walk;

#[cfg(all(test, feature = "encode"))]
mod tests;
