//! Several meshes to one file on one lattice: each as a file of one level, by itself or by the vertices of the one before it (spec §15).

use super::{Encoder, Options, Report, Source};
use crate::codec::grid::Real;
use crate::codec::walk::Walk;
use crate::container::{SetContents, write_set};
use crate::error::{Error, Result};
use crate::mesh::distance::{Sampling, SurfaceDistance, surface_distances};
use crate::mesh::{IndexedMesh, Lattice, lattice};
use crate::refine::ProgressiveMesh;
use crate::simplify;
use std::io::Write;
use std::sync::Arc;

/// Which member of a set stands first in the file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SetOrder {
    /// The coarsest: there is something to see at once.
    #[default]
    Stream,
    /// The finest: fewer bytes in all, since coarse members know all their vertices where they are some of the fine one's.
    Small,
}

/// A mesh to be a member of a set.
#[derive(Clone, Debug)]
pub struct SetInput {
    /// The mesh.
    pub mesh: IndexedMesh,
    /// Where it came from.
    pub source: Source,
    /// Whether its coordinates come back bit for bit, and of which type they are.
    pub exact: Option<Real>,
}

/// What a member took.
#[derive(Clone, Debug)]
pub struct SetMember {
    /// Place among the inputs.
    pub input: usize,
    /// Bytes of the file that it would be.
    pub alone: u64,
    /// Whether its vertices are told by those of the one before it.
    pub leans: bool,
    /// What its encoding tells.
    pub report: Report,
}

/// What comes of a set.
#[derive(Clone, Debug)]
pub struct SetReport {
    /// Header and table of the set.
    pub contents: SetContents,
    /// The members by number: 0 is the finest.
    pub members: Vec<SetMember>,
}

/// What a file has of its own as a member of a set.
#[derive(Clone, Debug)]
pub(super) struct Membership {
    /// The lattice of all members.
    pub lattice: Lattice,
    /// The box of all members, in lattice units.
    pub maximum: [u32; 3],
    /// The largest distance from the finest member, and the root mean square.
    pub errors: Option<[f64; 2]>,
    /// Where the vertices of the member before it are, in the order of its walk.
    pub other: Option<Arc<[[i32; 3]]>>,
    /// Where its own are, once it has been encoded.
    pub places: Arc<[[i32; 3]]>,
}

/// Writes a set of meshes. They are numbered by their triangles, the finest first; those with as many as another in the order in which they
/// come. Of `options` count `position_bits`, `lattice`, `keep_order`, `weld`, the bits of attributes and `max_memory`. `progress` is told how
/// many members of how many are done, and says whether to go on.
///
/// # Errors
/// As [`Encoder::encode`]; [`Error::Parameter`] without a mesh.
pub fn encode_set(
    inputs: &[SetInput],
    order: SetOrder,
    options: &Options,
    progress: &mut dyn FnMut(u64, u64) -> bool,
    out: &mut impl Write,
) -> Result<SetReport> {
    let mut numbers: Vec<usize> = (0..inputs.len()).collect();
    numbers.sort_by_key(|&k| std::cmp::Reverse(inputs[k].mesh.triangles.len()));
    let Some(&finest) = numbers.first() else {
        return Err(Error::Parameter("a set has a member at least".to_owned()));
    };
    for input in inputs {
        Encoder::new(one_level(options, input.exact)).check(&input.mesh)?;
    }
    let used = |input: &'_ SetInput| {
        let vertices: Vec<_> =
            input.mesh.triangles.iter().flatten().map(|&v| input.mesh.positions[v as usize]).collect();
        lattice::bounds(vertices.into_iter())
    };
    let corners = inputs.iter().filter_map(used).flat_map(|(min, max)| [min, max]);
    let (min, max) = lattice::bounds(corners)
        .ok_or_else(|| Error::Parameter("the meshes have no triangles".to_owned()))?;
    let lattice = options.lattice_over(min, max)?;
    let maximum = lattice.quantise(max).map(|x| x as u32);
    if order == SetOrder::Stream {
        numbers.reverse();
    }
    let mut files = Vec::with_capacity(inputs.len());
    let mut members = Vec::with_capacity(inputs.len());
    let mut other: Option<Arc<[[i32; 3]]>> = None;
    for (done, &k) in numbers.iter().enumerate() {
        if !progress(done as u64, numbers.len() as u64) {
            return Err(Error::Cancelled);
        }
        let input = &inputs[k];
        let errors = if k == finest { None } else { distance(&inputs[finest].mesh, &input.mesh) };
        let own = Membership { lattice, maximum, errors, other: None, places: Arc::default() };
        let encoded = |other| {
            let mut encoder = Encoder::new(one_level(options, input.exact));
            encoder.source(input.source.clone());
            encoder.membership = Some(Membership { other, ..own.clone() });
            let mut file = Vec::new();
            let report = encoder.encode(&input.mesh, &mut file)?;
            let places = encoder.membership.map_or_else(Arc::default, |own| own.places);
            Ok((file, report, places))
        };
        let (mut file, mut report, places) = encoded(None)?;
        let (alone, mut leans) = (file.len() as u64, false);
        if let Some(other) = other.replace(places) {
            match encoded(Some(other)) {
                Ok((shorter, its, _)) if shorter.len() < file.len() => {
                    (file, report, leans) = (shorter, its, true);
                }
                // Looking for vertices would take a decoder too long.
                Ok(_) | Err(Error::Limit { .. }) => {}
                Err(other) => return Err(other),
            }
        }
        files.push((file, leans));
        members.push(SetMember { input: k, alone, leans, report });
    }
    let contents = write_set(order == SetOrder::Small, &files, out)?;
    if order == SetOrder::Stream {
        members.reverse();
    }
    progress(numbers.len() as u64, numbers.len() as u64);
    Ok(SetReport { contents, members })
}

/// Where the vertices of a mesh are, in the order of its walk.
pub(super) fn places(mesh: &ProgressiveMesh) -> Arc<[[i32; 3]]> {
    let walk = Walk::new(&mesh.table, &mesh.roots);
    walk.vertices(&mesh.table).into_iter().map(|v| mesh.positions[v.index()]).collect()
}

/// The settings of a file with one level.
fn one_level(options: &Options, exact: Option<Real>) -> Options {
    Options {
        position_bits: options.position_bits,
        lattice: options.lattice,
        simplify: simplify::Options { base_vertices: Some(usize::MAX), ..simplify::Options::default() },
        preview: super::Preview::Off,
        lifting: Some(0),
        rich_models: Some(false),
        births: false,
        weld: options.weld,
        exact,
        keep_order: options.keep_order,
        attribute_bits: options.attribute_bits.clone(),
        max_memory: options.max_memory,
        ..Options::default()
    }
}

/// The largest distance between two surfaces, either way, and the root mean square; `None` where that cannot be measured.
fn distance(finest: &IndexedMesh, mesh: &IndexedMesh) -> Option<[f64; 2]> {
    let sampling = Sampling { samples: SAMPLES, ..Sampling::default() };
    let both = surface_distances(finest, mesh, &sampling, &mut |_, _| {})?;
    let distance = SurfaceDistance::symmetric(both);
    [distance.max, distance.rms].iter().all(|x| x.is_finite()).then_some([distance.max, distance.rms])
}

/// Points of each surface that are measured, besides its vertices.
const SAMPLES: u64 = 50_000;
