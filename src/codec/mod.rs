//! History <-> opaque payloads: walk, keyframes, refinements, residue (spec §4 to §8).

pub mod edgebreaker;
pub mod keyframe;
pub mod walk;
