//! Simplifiers side by side, at equal numbers of triangles: those of `unweld simplify`, the papers' editions, meshoptimizer's.

use super::args::Args;
use super::cases::{Case, default_file};
use super::generate;
use super::measure::{median, peak, seconds};
use super::peers::{meshopt_simplify, meshopt_simplify_with_update};
use super::quality::{SAMPLES, SEED};
use super::simplifiers_papers;
use super::tables::{Cell, Table};
use std::collections::HashMap;
use unweld::mesh::distance::surface_distance;
use unweld::mesh::topology::{self, Manifold, Weld};
use unweld::mesh::{IndexedMesh, Lattice, lattice};
use unweld::reduce::{Edition, Method, Options, Pass, Representative, Strategy, Topology, Weights, reduce};
use unweld::simplify::{self, Features, Regular};

/// Errors, times and memory of all of them; what the default is beside the others; growing meshes; shares of the strategies.
///
/// # Errors
/// Those of reading.
pub fn tables(args: &Args) -> anyhow::Result<Vec<Table>> {
    let mut all = Table::new("Simplifiers", &[NOTE], &COLUMNS);
    let mut beside = Table::new("HQMS beside other simplifiers", &[BESIDE_NOTE], &BESIDE);
    for (name, targets) in MESHES {
        let case = Case::read(&default_file(name)?, 12)?;
        for &target in targets {
            eprintln!("{}: {target} triangles", case.name);
            let results: Vec<(Which, Option<Measured>)> =
                WHICH.into_iter().map(|which| (which, measure(&case, target, which, args.runs))).collect();
            for (which, measured) in &results {
                all.rows.push(row(&case, *which, measured.as_ref()));
            }
            beside.rows.push(ratios(&case, target, &results));
        }
    }
    let mut tables = vec![all, beside, linear(args)?, shares()?];
    tables.extend(simplifiers_papers::tables());
    Ok(tables)
}

/// A simplifier.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Which {
    Of(Method),
    Free,
    Published(Edition),
    /// An octree's cells cut in eight; the same with both errors and apart by normals, as the paper has it.
    Eighths,
    PublishedOctree,
    /// Uniform cells with the vertex at the centre.
    Centre,
    Stellar,
    Meshopt,
    MeshoptWithUpdate,
}

const WHICH: [Which; 14] = [
    Which::Of(Method::Hqms),
    Which::Free,
    Which::Published(Edition::Of2004),
    Which::Published(Edition::Of2006),
    Which::Of(Method::Qslim),
    Which::Of(Method::Mca),
    Which::Of(Method::Octree),
    Which::Eighths,
    Which::PublishedOctree,
    Which::Of(Method::Uniform),
    Which::Centre,
    Which::Stellar,
    Which::Meshopt,
    Which::MeshoptWithUpdate,
];

impl Which {
    fn name(self) -> &'static str {
        match self {
            Self::Of(Method::Hqms) => "hqms",
            Self::Of(Method::Qslim) => "qslim",
            Self::Of(Method::Mca) => "mca",
            Self::Of(Method::Octree) => "octree",
            Self::Of(Method::Uniform) => "uniform, quadric",
            Self::Of(_) => "other",
            Self::Eighths => "octree, cut in eight",
            Self::PublishedOctree => "octree as published",
            Self::Centre => "uniform, centre",
            Self::Free => "hqms, free topology",
            Self::Published(Edition::Of2004) => "hqms as published 2004",
            Self::Published(Edition::Of2006) => "hqms as published 2006",
            Self::Stellar => "stellar",
            Self::Meshopt => "meshopt_simplify",
            Self::MeshoptWithUpdate => "meshopt_simplifyWithUpdate",
        }
    }

    fn run(self, case: &Case, target: usize) -> Option<(IndexedMesh, Vec<Pass>)> {
        let by = |options: Options| {
            let result = reduce(&case.mesh, target, &options, &mut |_, _| true).ok()?;
            Some((result.mesh, result.passes))
        };
        match self {
            Self::Of(method) => by(Options { method, ..Options::default() }),
            Self::Free => by(Options { topology: Topology::Free, ..Options::default() }),
            Self::Published(edition) => by(Options { edition: Some(edition), ..Options::default() }),
            Self::Eighths => by(Options { method: Method::Octree, eighths: true, ..Options::default() }),
            Self::PublishedOctree => by(Options {
                method: Method::Octree,
                eighths: true,
                both_errors: true,
                strict_normals: true,
                weights: Weights::Unit,
                ..Options::default()
            }),
            Self::Centre => by(Options {
                method: Method::Uniform,
                representative: Representative::Centre,
                ..Options::default()
            }),
            Self::Stellar => stellar(case, target).map(|mesh| (mesh, Vec::new())),
            Self::Meshopt => meshopt_simplify(&case.mesh, target).map(|mesh| (mesh, Vec::new())),
            Self::MeshoptWithUpdate => {
                meshopt_simplify_with_update(&case.mesh, target).map(|mesh| (mesh, Vec::new()))
            }
        }
    }
}

/// The base of a history that removes so many vertices that about this many triangles are left.
fn stellar(case: &Case, target: usize) -> Option<IndexedMesh> {
    let Manifold { table, positions, locked } = topology::condition(&case.mesh, Weld::None).manifold;
    let (min, max) = lattice::bounds(positions.iter().copied())?;
    let removals = (case.mesh.triangles.len().saturating_sub(target)).div_ceil(2);
    let options = simplify::Options {
        base_vertices: Some(positions.len().saturating_sub(removals)),
        regular: Regular::Ignored,
        ..simplify::Options::default()
    };
    let lattice = Lattice::over(min, max, Lattice::MAX_BITS);
    let simplified = simplify::simplify(
        table,
        &positions,
        locked,
        Features::default(),
        &lattice,
        &options,
        &mut |_, _| true,
    );
    let base = simplified.ok()?.base;
    let triangles = base.triangles().map(|t| base.triangle(t).map(|v| v.0)).collect();
    Some(IndexedMesh::new(positions, triangles))
}

/// What came of a mesh.
struct Measured {
    triangles: usize,
    /// Mean, root mean square and maximum from the original, and the maximum from the result, in % of the diagonal.
    errors: [f64; 4],
    seconds: f64,
    bytes_a_vertex: f64,
    folds: usize,
    nonmanifold_edges: usize,
    repeated: usize,
    components: usize,
    boundary_edges: usize,
    handles: usize,
    passes: usize,
}

fn measure(case: &Case, target: usize, which: Which, runs: u64) -> Option<Measured> {
    let (bytes, first) = peak(|| seconds(|| which.run(case, target)));
    let (time, result) = first;
    let (mesh, passes) = result?;
    let again = (1..runs).map(|_| seconds(|| which.run(case, target)).0);
    let time = median(again.chain([time]).collect());
    let there = surface_distance(&case.mesh, &mesh, SAMPLES, SEED)?;
    let back = surface_distance(&mesh, &case.mesh, SAMPLES, SEED)?;
    let conditioned = topology::condition(&mesh, Weld::None);
    let report = conditioned.report;
    let percent = 100.0 / case.diagonal();
    Some(Measured {
        triangles: mesh.triangles.len(),
        errors: [there.mean, there.rms, there.max, back.max].map(|x| x * percent),
        seconds: time,
        bytes_a_vertex: bytes as f64 / case.mesh.positions.len() as f64,
        folds: folds(&mesh),
        nonmanifold_edges: report.nonmanifold_edges,
        repeated: report.repeated_triangles,
        components: report.census.components,
        boundary_edges: report.census.boundary_edges,
        handles: report.census.handles,
        passes: passes.len(),
    })
}

/// Edges whose two triangles have normals more than 120 degrees apart.
fn folds(mesh: &IndexedMesh) -> usize {
    let normal = |&[a, b, c]: &[u32; 3]| {
        let [a, b, c] = [a, b, c].map(|v| mesh.positions[v as usize]);
        let [u, v] = [b, c].map(|p| [p[0] - a[0], p[1] - a[1], p[2] - a[2]]);
        let n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
        let length = n.iter().map(|x| x * x).sum::<f64>().sqrt();
        n.map(|x| if length > 0.0 { x / length } else { 0.0 })
    };
    let mut at_edges: HashMap<[u32; 2], Vec<[f64; 3]>> = HashMap::new();
    for triangle in &mesh.triangles {
        for k in 0..3 {
            let [a, b] = [triangle[k], triangle[(k + 1) % 3]];
            at_edges.entry([a.min(b), a.max(b)]).or_default().push(normal(triangle));
        }
    }
    let is_fold = |n: &&Vec<[f64; 3]>| n.len() == 2 && (0..3).map(|k| n[0][k] * n[1][k]).sum::<f64>() < -0.5;
    at_edges.values().filter(is_fold).count()
}

fn row(case: &Case, which: Which, measured: Option<&Measured>) -> Vec<Cell> {
    let mut cells = vec![Cell::Text(format!("{}, {}", case.name, which.name()))];
    let Some(m) = measured else {
        cells.resize(COLUMNS.len(), Cell::None);
        return cells;
    };
    let removed = case.mesh.triangles.len() - m.triangles;
    cells.push(Cell::Count(m.triangles as u64));
    cells.extend(m.errors.iter().zip([4, 4, 3, 3]).map(|(&error, decimals)| Cell::Number(error, decimals)));
    cells.extend([Cell::Number(m.seconds, 3), Cell::Number(removed as f64 / m.seconds / 1e6, 2)]);
    cells.push(Cell::Number(m.bytes_a_vertex, 0));
    let counts = [m.folds, m.nonmanifold_edges, m.repeated, m.components, m.boundary_edges, m.handles];
    cells.extend(counts.map(|n| Cell::Count(n as u64)));
    cells.push(if m.passes > 0 { Cell::Count(m.passes as u64) } else { Cell::None });
    cells
}

fn ratios(case: &Case, target: usize, results: &[(Which, Option<Measured>)]) -> Vec<Cell> {
    let of = |which: Which| results.iter().find(|(w, _)| *w == which).and_then(|(_, m)| m.as_ref());
    let hqms = of(Which::Of(Method::Hqms));
    let over = |which: Which, value: fn(&Measured) -> f64| {
        let (x, y) = (value(hqms?), value(of(which)?));
        (y > 1e-9).then(|| x / y)
    };
    let cells_over = |which: Which, value: fn(&Measured) -> f64| {
        let (x, y) = (value(of(Which::Of(Method::Octree))?), value(of(which)?));
        (y > 1e-9).then(|| x / y)
    };
    let time = |slow: Which, fast: Which| Some(of(slow)?.seconds / of(fast)?.seconds);
    let (qslim, mca) = (Which::Of(Method::Qslim), Which::Of(Method::Mca));
    let published = Which::Published(Edition::Of2006);
    let mut cells = vec![Cell::text(&case.name), Cell::Count(target as u64)];
    let values = [
        over(qslim, |m| m.errors[0]),
        over(qslim, |m| m.errors[1]),
        over(qslim, |m| m.errors[2]),
        over(Which::Meshopt, |m| m.errors[0]),
        over(Which::Stellar, |m| m.errors[0]),
        time(qslim, Which::Of(Method::Hqms)),
        time(qslim, published),
        time(mca, published),
        hqms.map(|m| m.bytes_a_vertex),
        over(qslim, |m| m.bytes_a_vertex),
        cells_over(Which::Centre, |m| m.errors[0]),
        cells_over(Which::Of(Method::Uniform), |m| m.errors[0]),
        cells_over(Which::Of(Method::Uniform), |m| m.seconds),
    ];
    cells.extend(values.into_iter().enumerate().map(|(k, x)| Cell::number(x, if k == 8 { 0 } else { 2 })));
    cells
}

/// Whether time and memory grow in proportion to the mesh.
fn linear(args: &Args) -> anyhow::Result<Table> {
    let mut table = Table::new("HQMS of growing meshes", &[LINEAR_NOTE], &LINEAR);
    let mut first = None;
    for &millions in &args.linear {
        let around = (millions * 1e6 / 4.0).sqrt().round().max(8.0) as u32;
        let mesh = generate::torus(2 * around, around, 1);
        eprintln!("HQMS: {} triangles", mesh.triangles.len());
        let once = || seconds(|| reduce(&mesh, TARGET, &Options::default(), &mut |_, _| true)).0;
        let (bytes, time) = peak(once);
        let time = median((1..args.runs).map(|_| once()).chain([time]).collect());
        let each = time / mesh.triangles.len() as f64;
        let smallest = *first.get_or_insert(each);
        table.rows.push(vec![
            Cell::Text(format!("torus, {millions} M")),
            Cell::Count(mesh.triangles.len() as u64),
            Cell::Number(time, 2),
            Cell::Number(each * 1e6, 3),
            Cell::Number(each / smallest, 2),
            Cell::Number(bytes as f64 / mesh.positions.len() as f64, 1),
        ]);
    }
    Ok(table)
}

/// How many vertices a pass removes when it may remove all that it can.
fn shares() -> anyhow::Result<Table> {
    let mut table = Table::new("Shares of a pass, by strategy", &[SHARES_NOTE], &SHARES);
    let case = Case::read(&default_file(MESHES[0].0)?, 12)?;
    for (strategy, name, claimed) in
        [(Strategy::One, "I", 0.5), (Strategy::Two, "II", 0.25), (Strategy::Three, "III", 0.1)]
    {
        let options = Options { strategy, cap: 1.0, ..Options::default() };
        let passes = reduce(&case.mesh, TARGET, &options, &mut |_, _| true)?.passes;
        // The last pass stops where there are few enough.
        let whole = passes.len().saturating_sub(1).max(1);
        let share = passes[..whole].iter().map(|p| p.contractions as f64 / p.vertices as f64).sum::<f64>()
            / whole as f64;
        let ratio = case.mesh.triangles.len() as f64 / TARGET as f64;
        table.rows.push(vec![
            Cell::text(name),
            Cell::Number(claimed, 2),
            Cell::Number(share, 3),
            Cell::Count(passes.len() as u64),
            Cell::Number((ratio.ln() / -(1.0 - share).ln()).ceil(), 0),
        ]);
    }
    Ok(table)
}

/// Files, and the triangles that are to be left.
const MESHES: [(&str, &[usize]); 9] = [
    ("scan_bunny.ply.gz", &[10_000, 1_000]),
    ("organic_horse.ply.gz", &[10_000, 1_000]),
    ("bench/igea.ply.gz", &[10_000, 1_000]),
    ("bench/armadillo_86k.obj.gz", &[10_000, 1_000]),
    ("bench/dragon_vrip.ply.gz", &[10_000, 1_000]),
    ("cad_fandisk.obj.gz", &[3_000, 1_000]),
    ("cad_casting.off.gz", &[2_556, 511]),
    ("open_elephant_106_holes.off.gz", &[2_000, 1_000]),
    ("synth_terrain.ply.gz", &[10_000, 1_000]),
];
/// Triangles of the coarsest level.
const TARGET: usize = 1_000;

const COLUMNS: [&str; 16] = [
    "mesh, simplifier",
    "triangles",
    "mean %",
    "RMS %",
    "max %",
    "max back %",
    "s",
    "Mtri/s",
    "B/vertex",
    "folds",
    "non-manifold edges",
    "repeated triangles",
    "components",
    "boundary edges",
    "handles",
    "passes",
];
const BESIDE: [&str; 15] = [
    "mesh",
    "to",
    "mean/qslim",
    "RMS/qslim",
    "max/qslim",
    "mean/meshopt",
    "mean/stellar",
    "qslim s/hqms",
    "qslim s/published",
    "mca s/published",
    "B/vertex",
    "B/qslim",
    "octree/centre",
    "octree/quadric",
    "octree s/quadric",
];
const LINEAR: [&str; 6] = ["mesh", "triangles", "s", "µs/triangle", "over the smallest", "B/vertex"];
const SHARES: [&str; 5] = ["strategy", "claimed", "share a pass", "passes", "passes expected"];

const NOTE: &str = "Errors in % of the diagonal of the bounding box: mean, root mean square and maximum over the original's surface of the distance from the result (as Metro measures), and \
    the maximum back. CPU time of one thread, the median of the runs; million triangles removed a second; peak memory above the input, a vertex of it (of meshoptimizer the memory of its \
    C++ side is not seen). Folds: edges whose two triangles have normals more than 120 degrees apart. hqms, qslim and mca keep the topology where nothing else is said.";
const BESIDE_NOTE: &str = "Errors of HQMS (Chen, Fahn, Tsai, Chen and Lin 2004, 2006, with what the papers leave out) over those of others at as many triangles, times of others over its own. Published: as the paper of \
    2006 has it word for word. The papers report qslim's time over theirs as 4.3 to 4.5, that of multiple choice (mca) as 2.7 to 2.9, their memory as 0.24 to 0.26 of qslim's. The last columns: means and time of octree cells over those of a grid's, with \
    the vertex at the weighted centre or where the planes cost least; the paper reports no error, and 1.7 to 2.1 times the time. With all its 55 handles the dragon has no room in 1,000 triangles, whoever takes it there; `unweld simplify` lets go of them below 20 triangles a \
    handle (the row with free topology).";
const LINEAR_NOTE: &str =
    "To 1,000 triangles. Generated: a rough torus, a third of its cells cut along the other diagonal.";
const SHARES_NOTE: &str = "The bunny to 1,000 triangles, all vertices proposed (no cap). Claimed: by the paper of 2006. Expected: ln(n/n0) / -ln(1 - share), rounded up.";
