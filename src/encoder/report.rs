//! What encoding has to tell.

use crate::codec::edgebreaker::Bits;
use crate::codec::keyframe::Written;
use crate::codec::residue::ResidueCounts;
use crate::container::Contents;
use crate::mesh::topology::{Conditioned, ConditioningReport};
use crate::mesh::{IndexedMesh, Lattice};
use crate::simplify::{self, LevelError, Simplified};

/// Seconds by stage.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Seconds {
    /// Making a manifold of the input.
    pub condition: f64,
    /// Removing vertices.
    pub simplify: f64,
    /// Writing refinements and keyframes.
    pub code: f64,
}

/// What a keyframe took.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KeyframeBits {
    /// Its level.
    pub level: u32,
    /// Triangles of the level.
    pub triangles: u32,
    /// Bits of its connectivity, without the next two.
    pub connectivity: f64,
    /// Bits of its boundary loops: of the triangles that close them.
    pub loops: f64,
    /// Bits of its handles.
    pub handles: f64,
    /// Bits of its positions.
    pub positions: f64,
}

/// Vertices that are nearly one.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Joined {
    /// How far a vertex is from the one that stands for it, at most; each level's errors include it.
    pub distance: f64,
    /// Root of the mean squared distance, of all vertices.
    pub rms_distance: f64,
    /// Parts of the surface that share no vertex, as it was welded.
    pub parts: usize,
    /// What the parts would be if vertices on the same lattice point were one.
    pub lattice_parts: usize,
}

impl Joined {
    pub(super) fn new(mesh: &IndexedMesh, conditioned: &Conditioned, lattice: &Lattice) -> Self {
        let (mut distance, mut squares) = (0.0f64, 0.0);
        if conditioned.report.joined_vertices > 0 {
            for (p, &v) in mesh.positions.iter().zip(&conditioned.remainder.origins.same) {
                let q = mesh.positions[v as usize];
                let apart = length(std::array::from_fn(|k| p[k] - q[k]));
                distance = distance.max(apart);
                squares += apart * apart;
            }
        }
        let rms_distance = (squares / mesh.positions.len().max(1) as f64).sqrt().min(distance);
        // Where all is one piece, nothing can be joined.
        let whole = conditioned.report.census.components < 2;
        let parts = |lattice| match whole {
            true => conditioned.report.census.components,
            false => conditioned.parts(lattice, &mesh.bodies),
        };
        Self { distance, rms_distance, parts: parts(None), lattice_parts: parts(Some(lattice)) }
    }

    /// The levels stand for vertices that stand for others: those are as much further away.
    pub(super) fn add_to(&self, errors: &mut [LevelError]) {
        for error in errors {
            error.max += self.distance;
            error.rms += self.rms_distance;
        }
    }
}

/// What an encoding did and what it took.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Report {
    /// What conditioning found.
    pub conditioning: ConditioningReport,
    /// Diagonal of the input's bounding box.
    pub diagonal: f64,
    /// What the input carried and the file does not keep, in words: what [`Source::dropped`](super::Source::dropped) names.
    pub dropped: Vec<String>,
    /// Distance of each level from the input, by number, the base last.
    pub errors: Vec<LevelError>,
    /// Vertices that had to stay: copies of cut vertices, and the boundary where it was locked.
    pub locked_vertices: usize,
    /// Vertices that are nearly one.
    pub joined: Joined,
    /// Whether the lattice's points are multiples of its step without any rounding: [`Lattice::is_exact`].
    pub lattice_is_exact: bool,
    /// What the residue holds.
    pub residue: ResidueCounts,
    /// Bytes of the file.
    pub bytes: u64,
    /// Bits of the base.
    pub base_bits: f64,
    /// Bits of the components born at finer levels.
    pub birth_bits: f64,
    /// Bits of the refinements' connectivity.
    pub connectivity_bits: f64,
    /// Bits of the refinements' positions.
    pub position_bits: f64,
    /// Bits of the residue.
    pub residue_bits: f64,
    /// Bits of the attributes.
    pub attribute_bits: f64,
    /// Bits of the correction.
    pub correction_bits: f64,
    /// Bits of the resources.
    pub resource_bits: f64,
    /// Bits of the order.
    pub order_bits: f64,
    /// Bits of the keyframes, the base's not counted.
    pub keyframe_bits: f64,
    /// Each keyframe, the base's included, coarse to fine.
    pub keyframes: Vec<KeyframeBits>,
    /// Header, table of contents, metadata, and what atoms lose at their ends.
    pub other_bits: f64,
    /// Units of work that decoding takes, from the base on (spec §3.6).
    pub work: u64,
    /// Time taken.
    pub seconds: Seconds,
    /// How simplification spent its time.
    pub routines: simplify::Seconds,
}

impl Report {
    pub(super) fn new(conditioning: ConditioningReport, simplified: &Simplified, diagonal: f64) -> Self {
        Self {
            conditioning,
            diagonal,
            errors: simplified.errors.clone(),
            routines: simplified.seconds,
            ..Self::default()
        }
    }

    pub(super) fn keyframe(&mut self, level: u32, written: &Written, triangles: u32) {
        let Bits { symbols: connectivity, loops, handles } = written.connectivity;
        let coded = written.payload.len() as f64 * 8.0 - written.attributes;
        let positions = coded - connectivity - loops - handles;
        self.keyframes.push(KeyframeBits { level, triangles, connectivity, loops, handles, positions });
    }

    pub(super) fn finish(&mut self, contents: &Contents) {
        self.bytes = contents.file_bytes();
        let told = self.base_bits
            + self.birth_bits
            + self.connectivity_bits
            + self.position_bits
            + self.residue_bits
            + self.attribute_bits
            + self.correction_bits
            + self.order_bits
            + self.resource_bits
            + self.keyframe_bits;
        self.other_bits = self.bytes as f64 * 8.0 - told;
    }
}

/// The length of a vector, where its square would be too large or too small, too.
fn length(v: [f64; 3]) -> f64 {
    let largest = v.iter().fold(0.0f64, |largest, x| largest.max(x.abs()));
    let squares: f64 = v.iter().map(|x| x / largest * (x / largest)).sum();
    if largest > 0.0 { largest * squares.sqrt() } else { 0.0 }
}

/// The report's numbers by name, as the metadata carry them.
pub fn conditioning_counts(report: &ConditioningReport) -> Vec<(String, u64)> {
    let counts = [
        ("input_vertices", report.input_vertices),
        ("input_triangles", report.input_triangles),
        ("welded_vertices", report.welded_vertices),
        ("degenerate_triangles", report.degenerate_triangles),
        ("repeated_triangles", report.repeated_triangles),
        ("isolated_vertices", report.isolated_vertices),
        ("nonmanifold_edges", report.nonmanifold_edges),
        ("nonorientable_edges", report.nonorientable_edges),
        ("cut_vertices", report.cut_vertices),
        ("nonmanifold_vertices", report.nonmanifold_vertices),
        ("reoriented_triangles", report.reoriented_triangles),
        ("locked_vertices", report.locked_vertices),
        ("components", report.census.components),
        ("boundary_loops", report.census.boundary_loops),
        ("boundary_edges", report.census.boundary_edges),
        ("handles", report.census.handles),
    ];
    // Most files have nothing to say of it.
    let joined = Some(("joined_vertices", report.joined_vertices)).filter(|&(_, count)| count > 0);
    let counts = counts.into_iter().chain(joined);
    counts.map(|(name, count)| (name.to_owned(), count as u64)).collect()
}
