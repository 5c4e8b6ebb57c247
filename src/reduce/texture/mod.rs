//! The colours of a mesh, kept by a texture of its simplified version, whatever simplified it.
//!
//! Zhou, Zhang, Shi and Pan, *A new simplification algorithm for colored or textured polygonal models*, section 4, after Soucy, Godin and Rioux (1996):
//! every triangle of the simplified mesh gets a right isosceles triangle of a map, larger for a larger area, and each of its texels the
//! colour of the point of the original that is nearest to its own. Along an edge both sides have the same texels: the coarser side's, which a
//! finer one repeats. All texels of a vertex have one colour.
//!
//! Where we depart: it is the squares, two triangles each, that have sides of powers of two; triangles leave room in them for gutters, so that a look
//! between texels mixes no neighbour in, and groups of repeated texels are as long as each other but for one. Pictures of the original are looked at
//! in halves of their size where texels lie so far apart, so that nothing is skipped. Maps have no mip levels: the gutters would have to be as wide
//! as the coarsest one's texels. Where surfaces touch, the nearest point of one may be on the other.

mod bake;
mod difference;
mod edges;
mod layout;
#[cfg(test)]
mod tests;

pub use bake::{Baked, bake};
pub use difference::colour_difference;

use std::num::NonZeroUsize;

/// How a texture is made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BakeOptions {
    /// Most texels of the map, of which the largest power of two counts: 2^20 by default. Its rows are as long as its columns, or twice as long.
    pub texels: u64,
    /// Texels round each texture triangle that repeat the nearest of its own, 1 by default: as many as looks between texels reach beyond it.
    pub gutter: u32,
    /// Threads, as many as the machine has cores by default. The result does not depend on them.
    pub threads: NonZeroUsize,
    /// Most bytes that all that is made may take; 64 GiB by default.
    pub max_memory: u64,
}

impl Default for BakeOptions {
    fn default() -> Self {
        let threads = std::thread::available_parallelism().unwrap_or(NonZeroUsize::MIN);
        Self { texels: 1 << 20, gutter: 1, threads, max_memory: 1 << 36 }
    }
}
