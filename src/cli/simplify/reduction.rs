//! Edges contracted or vertices clustered: coarser meshes without a history, whose vertices go where they fit best.

use super::{Limit, Outcome, SAMPLES, distance};
use crate::cli::args::{self, Removal, value_name};
use crate::cli::failure::Usage;
use crate::cli::numbers::count;
use crate::cli::progress::Progress;
use anyhow::bail;
use clap::ValueEnum;
use std::time::Instant;
use unweld::formats::{Coordinates, Source};
use unweld::mesh::topology::{Weld, census};
use unweld::mesh::{CornerTable, IndexedMesh, Lattice, lattice};
use unweld::reduce::{self, Edition, LeftOut, Options, Reduced, Representative, Strategy, Topology, Weights};

/// How a mesh is made coarser.
#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Method")]
pub struct Reduction {
    /// Which method
    #[arg(long, value_enum, default_value = "hqms")]
    pub method: Method,
    /// What may become of the topology; where not given, `keep`, but `free` where there would be fewer than 20 triangles a handle
    #[arg(long, value_enum)]
    topology: Option<Kept>,
    /// How much each plane counts: area where not given
    #[arg(long, value_enum)]
    weights: Option<Weighted>,
    /// Contractions from which the cheapest is picked (hqms), 1 or more: 512 where not given
    #[arg(long, value_name = "K", value_parser = clap::value_parser!(u32).range(1..))]
    heap: Option<u32>,
    /// Share of the vertices that a pass looks at (hqms), the cheapest ones, above 0 and up to 1: 0.5 where not given
    #[arg(long, value_name = "Q", value_parser = args::part)]
    cap: Option<f64>,
    /// Which vertices wait for the next pass once an edge has been contracted (hqms): 1, its ends; 2, those opposite to it, too; 3, all
    /// round it; 1 where not given
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=3))]
    strategy: Option<u8>,
    /// Exactly as the paper of that year has it (hqms), without any check of topology or normals, for comparison
    #[arg(long, value_name = "YEAR")]
    as_published: Option<Year>,
    /// Where the vertex of a cell goes (uniform): quadric where not given
    #[arg(long, value_enum)]
    place: Option<Place>,
    /// Part the vertices of a cell where some triangle looks away from the others, whatever the error (octree)
    #[arg(long)]
    strict_normals: bool,
    /// Count how far old vertices are off the new triangles, too, not the new ones off the old planes alone (octree)
    #[arg(long)]
    both_errors: bool,
}

/// How a mesh is made coarser.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Method {
    /// Contracts edges in passes, in linear time: nearest to the input (Chen and others 2004, 2006)
    Hqms,
    /// Always the cheapest edge, by a queue (Garland and Heckbert 1997)
    Qslim,
    /// The cheapest of some random edges (Wu and Kobbelt 2002)
    Mca,
    /// Clusters of vertices in an octree's cells: any triangles, fast; the result may be no manifold
    Octree,
    /// Clusters of vertices in a grid's cells (Rossignac and Borrel 1993); the result may be no manifold
    Uniform,
    /// Removes many vertices at once for a view, on any number of threads: fast, farther from the input (Odaker and others 2016)
    Parallel,
    /// Removes the best of some random vertices, as the encoder does
    Stellar,
    /// Removes the best of all vertices, by a priority queue
    Ffc,
}

/// What may become of the topology.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Kept {
    /// Components, handles and holes stay
    Keep,
    /// The same, but holes of three edges are shut
    Close,
    /// Handles and holes may go; sheets may come to share an edge
    Free,
}

/// How much a plane counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Weighted {
    /// By the area of its triangle
    Area,
    /// All alike
    Unit,
}

/// Where the vertex of a cell goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Place {
    /// To where its planes cost least
    Quadric,
    /// To the centre of its vertices
    Centre,
}

/// The year of a paper.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Year {
    #[value(name = "2004")]
    Of2004,
    #[value(name = "2006")]
    Of2006,
}

impl Method {
    /// The encoder's method, if it is one.
    pub fn of_removal(self) -> Option<args::Method> {
        match self {
            Self::Stellar => Some(args::Method::Stellar),
            Self::Ffc => Some(args::Method::Ffc),
            _ => None,
        }
    }

    /// Whether it is the one for a view.
    pub fn is_parallel(self) -> bool {
        self == Self::Parallel
    }
}

impl Reduction {
    /// Refuses what the encoder's methods and the one for a view do not know.
    ///
    /// # Errors
    /// [`Usage`] where one is given.
    pub fn refuse(&self) -> anyhow::Result<()> {
        let given = [
            ("--topology", self.topology.is_some()),
            ("--weights", self.weights.is_some()),
            ("--heap", self.heap.is_some()),
            ("--cap", self.cap.is_some()),
            ("--strategy", self.strategy.is_some()),
            ("--as-published", self.as_published.is_some()),
            ("--place", self.place.is_some()),
            ("--strict-normals", self.strict_normals),
            ("--both-errors", self.both_errors),
        ];
        self.refuse_given(&given)
    }

    fn refuse_given(&self, given: &[(&str, bool)]) -> anyhow::Result<()> {
        match given.iter().find(|(_, is_given)| *is_given) {
            Some((name, _)) => {
                let method = value_name(&self.method);
                Err(Usage(format!("{name} is of no use with --method {method}")).into())
            }
            None => Ok(()),
        }
    }

    /// Whether the method keeps the topology if it is told to.
    fn keeps(&self) -> bool {
        let contracts = matches!(self.method, Method::Hqms | Method::Qslim | Method::Mca);
        contracts && self.as_published.is_none()
    }

    /// For the library.
    fn options(&self, removal: &Removal, topology: Topology) -> anyhow::Result<Options> {
        if self.method.is_parallel() {
            return Err(Usage(
                "--method parallel has no goal: it is for a view, of unweld simplify".to_owned(),
            )
            .into());
        }
        let is_hqms = self.method == Method::Hqms;
        let clusters = matches!(self.method, Method::Octree | Method::Uniform);
        let given = [
            ("--alpha", removal.alpha.is_some()),
            ("--beta", removal.beta.is_some()),
            ("--heap", self.heap.is_some() && !is_hqms),
            ("--cap", self.cap.is_some() && !is_hqms),
            ("--strategy", self.strategy.is_some() && !is_hqms),
            ("--as-published", self.as_published.is_some() && !is_hqms),
            ("--topology", self.topology.is_some() && clusters),
            ("--lock-boundary", removal.lock_boundary && clusters),
            ("--place", self.place.is_some() && self.method != Method::Uniform),
            ("--strict-normals", self.strict_normals && self.method != Method::Octree),
            ("--both-errors", self.both_errors && self.method != Method::Octree),
        ];
        self.refuse_given(&given)?;
        let default = Options::default();
        Ok(Options {
            method: match self.method {
                Method::Qslim => reduce::Method::Qslim,
                Method::Mca => reduce::Method::Mca,
                Method::Octree => reduce::Method::Octree,
                Method::Uniform => reduce::Method::Uniform,
                Method::Hqms | Method::Parallel | Method::Stellar | Method::Ffc => reduce::Method::Hqms,
            },
            topology,
            weights: if self.weights == Some(Weighted::Unit) { Weights::Unit } else { Weights::Area },
            lock_boundary: removal.lock_boundary,
            strategy: match self.strategy {
                Some(2) => Strategy::Two,
                Some(3) => Strategy::Three,
                _ => Strategy::One,
            },
            heap: self.heap.map_or(default.heap, |heap| heap as usize),
            cap: self.cap.unwrap_or(default.cap),
            edition: self.as_published.map(|year| match year {
                Year::Of2004 => Edition::Of2004,
                Year::Of2006 => Edition::Of2006,
            }),
            choices: removal.choices,
            seed: removal.seed,
            representative: match self.place {
                Some(Place::Centre) => Representative::Centre,
                _ => Representative::Quadric,
            },
            strict_normals: self.strict_normals,
            both_errors: self.both_errors,
        })
    }
}

/// Makes a mesh coarser, as far as the limit allows.
///
/// # Errors
/// [`Usage`] for options of other methods; where no triangle is left; those of the library.
pub fn reduced(
    source: &Source,
    limit: Limit,
    reduction: &Reduction,
    removal: &Removal,
    progress: &mut Progress,
) -> anyhow::Result<Outcome> {
    let start = Instant::now();
    let (mesh, joined_vertices) = welded(&source.mesh, removal.weld);
    let (topology, remark) = topology(&mesh, reduction, limit);
    let options = reduction.options(removal, topology)?;
    let conditioning = start.elapsed().as_secs_f64();
    let mut once = |faces: usize| -> anyhow::Result<Reduced> {
        let mut tell = |done, total| {
            progress.update("simplify", done, total);
            true
        };
        let mut result = reduce::reduce(&mesh, faces, &options, &mut tell)?;
        if source.coordinates == Coordinates::Float32 {
            // As they will be written.
            result.mesh.positions.iter_mut().flatten().for_each(|x| *x = f64::from(*x as f32));
        }
        Ok(result)
    };
    let reduced = match limit {
        Limit::Triangles(most) => once(most)?,
        Limit::Error(most) => within(&source.mesh, most, &mut once)?,
    };
    let left_out = left_out(&source.mesh, &mesh, &reduced.left_out);
    if reduced.mesh.triangles.is_empty() && reduced.passes.is_empty() {
        bail!("no triangle is left: all are degenerate");
    }
    Ok(Outcome {
        mesh: reduced.mesh,
        left_out,
        joined_vertices,
        conditioning,
        obstacle: obstacle(reduction, &options),
        passes: Some(reduced.passes.len()),
        remarks: remark.into_iter().collect(),
        frames: Vec::new(),
    })
}

/// With as few triangles as bisection finds that keep the two surfaces so near to each other; all of them where it finds none.
fn within(
    input: &IndexedMesh,
    most: f64,
    once: &mut dyn FnMut(usize) -> anyhow::Result<Reduced>,
) -> anyhow::Result<Reduced> {
    let mut best = once(usize::MAX)?;
    // Of so few nothing is known; so many fit.
    let (mut low, mut high) = (0, best.mesh.triangles.len());
    while high - low > (high / FINENESS).max(1) {
        // By ratios, since errors go with them.
        let middle = ((low.max(1) as f64 * high as f64).sqrt() as usize).clamp(low + 1, high - 1);
        let result = once(middle)?;
        let reached = result.mesh.triangles.len();
        // The vertices alone refuse most of what does not fit.
        let near = |samples| distance(input, &result.mesh, samples).is_some_and(|d| d.max <= most);
        if reached > 0 && [0, SAMPLES].into_iter().all(near) {
            high = middle;
            best = result;
            if reached > middle {
                // No fewer can be had.
                break;
            }
        } else {
            low = middle;
        }
    }
    Ok(best)
}

/// The mesh with one vertex for those that are the same, and how many were joined that are not equal.
pub(super) fn welded(mesh: &IndexedMesh, weld: Weld) -> (IndexedMesh, usize) {
    let used = mesh.triangles.iter().flatten().map(|&v| mesh.positions[v as usize]);
    let (min, max) = lattice::bounds(used).unwrap_or_default();
    let joined = |weld: Weld| {
        let same = weld.representatives(mesh, &Lattice::over(min, max, Lattice::DEFAULT_BITS));
        let others = (0..).zip(&same).filter(|&(v, &other)| v != other).count();
        (same, others)
    };
    let (same, others) = joined(weld);
    let equal = if matches!(weld, Weld::Exact | Weld::None) { others } else { joined(Weld::Exact).1 };
    let triangles = mesh.triangles.iter().map(|t| t.map(|v| same[v as usize])).collect();
    (IndexedMesh::new(mesh.positions.clone(), triangles), others - equal)
}

/// What is asked for, or else what holds so few triangles, and a remark where that is not to keep.
fn topology(mesh: &IndexedMesh, reduction: &Reduction, limit: Limit) -> (Topology, Option<String>) {
    match (reduction.topology, limit) {
        (Some(Kept::Keep), _) => (Topology::Keep, None),
        (Some(Kept::Close), _) => (Topology::Close, None),
        (Some(Kept::Free), _) => (Topology::Free, None),
        (None, Limit::Triangles(most)) if most < mesh.triangles.len() && reduction.keeps() => {
            let handles = handles(mesh).unwrap_or(0);
            if handles == 0 || most >= TRIANGLES_A_HANDLE * handles {
                return (Topology::Keep, None);
            }
            let remark = format!(
                "{} may go, since so few triangles hold them badly: --topology keep keeps them",
                count(handles as u64, "handle")
            );
            (Topology::Free, Some(remark))
        }
        (None, _) => (Topology::Keep, None),
    }
}

/// Handles of a manifold.
fn handles(mesh: &IndexedMesh) -> Option<usize> {
    let table = CornerTable::from_triangles(mesh.positions.len(), &mesh.triangles).ok()?;
    Some(census(&table).handles)
}

/// Why no fewer triangles were to be had.
fn obstacle(reduction: &Reduction, options: &Options) -> String {
    match (options.topology, options.lock_boundary) {
        _ if reduction.strict_normals => "--strict-normals parts what is left".to_owned(),
        (_, true) => "no further edge can go, with the boundary locked".to_owned(),
        (Topology::Free, _) => "no further edge can go without triangles turning over".to_owned(),
        _ => "no further edge can go without a change of topology or triangles turning over: \
              --topology free lets the topology change"
            .to_owned(),
    }
}

/// What was of no use, in words: of vertices those that no triangle of the input has.
pub(super) fn left_out(input: &IndexedMesh, welded: &IndexedMesh, left_out: &LeftOut) -> Vec<String> {
    let mut used = vec![false; input.positions.len()];
    for triangles in [&input.triangles, &welded.triangles] {
        triangles.as_flattened().iter().for_each(|&v| used[v as usize] = true);
    }
    let isolated = used.iter().filter(|&&used| !used).count();
    let counts = [
        (left_out.degenerate_triangles, "degenerate triangle"),
        (left_out.repeated_triangles, "repeated triangle"),
        (isolated, "isolated vertex"),
    ];
    counts.iter().filter(|(n, _)| *n > 0).map(|(n, noun)| count(*n as u64, noun)).collect()
}

/// A handle wants some triangles of its own: the smallest torus has 14.
const TRIANGLES_A_HANDLE: usize = 20;
/// A search ends once one part of so many is left in which to look.
const FINENESS: usize = 256;
