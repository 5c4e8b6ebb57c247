//! Chapter 5.5.1: how many edges a vertex has, and the sum of their squared lengths.

use std::collections::BTreeSet;

use super::vector::{d2, floor};
use super::walk::Mesh;

/// Of the edges at one vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extent {
    pub edges: i64,
    pub squares: i64,
}

impl Extent {
    /// `cell` is P.
    pub fn of(mesh: &Mesh, w: usize, cell: impl Fn(usize) -> [i64; 3]) -> Self {
        // Of each triangle at w the vertex behind w, and the one before it.
        let triangles = mesh.third.range((w, 0)..=(w, usize::MAX));
        let neighbours: BTreeSet<usize> =
            triangles.flat_map(|(&(_, behind), &before)| [behind, before]).collect();
        let squares = neighbours.iter().map(|&u| floor(d2(cell(w), cell(u))));
        Self { edges: neighbours.len() as i64, squares: squares.fold(0, i64::wrapping_add) }
    }
}
