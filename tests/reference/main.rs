//! A second decoder, written from `spec/` alone, slow and obvious: a file for a chapter or a part of one. It judges the
//! crate's decoder.
#![cfg(feature = "encode")]

mod attributes;
mod beside;
mod codes;
mod column;
mod connectivity;
mod container;
mod contexts;
mod coordinates;
mod correction;
mod decisions;
mod decode;
mod entropy;
mod expected;
mod further;
mod grids;
mod inflate;
mod keyframe;
mod lifting;
mod metadata;
mod mix;
mod numbers;
mod operation;
mod order;
mod other;
mod position;
mod refinement;
mod residual;
mod residue;
mod resources;
mod round;
mod symbol;
mod table;
mod trace;
mod vector;
mod walk;
mod whole_pass;

mod agree;
mod attribute;
mod by_hand;
mod draft;
mod examples;
mod extent;
mod forge;
mod forged;
mod forged_beyond;
mod golden;
mod hostile;
mod on_shapes;
mod real;
mod scenes;
mod seam;
mod sets;
mod with_values;
