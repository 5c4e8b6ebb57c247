//! Entropy coding: knows no mesh, takes slices.

pub mod varint;
