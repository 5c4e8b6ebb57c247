//! `unweld simplify`: a coarser mesh with the positions of the input, without a `.uwm` file between.

use super::args::{Simplification, Tolerance, part, size, tolerance};
use super::failure::{Usage, note};
use super::input::{self, Mesh, Reading};
use super::numbers::{count, grouped, of_diagonal, percent, significant};
use super::output::{MeshFormat, Output, remark, say};
use super::progress::Progress;
use super::welding;
use anyhow::{Context, anyhow, bail};
use serde_json::json;
use std::path::PathBuf;
use std::time::Instant;
use unweld::codec::grid::Real;
use unweld::encoder::{Joined, Profile};
use unweld::formats::Coordinates;
use unweld::mesh::distance::{Sampling, SurfaceDistance, surface_distances};
use unweld::mesh::topology::{Conditioned, condition};
use unweld::mesh::{CornerTable, IndexedMesh, Lattice, Vertex, lattice};
use unweld::refine::{History, OperationError};
use unweld::simplify::{self, Features, Regular, Simplified};

/// Simplify a mesh to a number of triangles or within an error; the vertices that stay keep their positions
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// The mesh (PLY, OBJ, STL, OFF or glTF, also gzip-compressed, or .uwm), - for standard input
    #[arg(value_name = "IN")]
    input: PathBuf,
    /// The mesh to write, .ply, .obj, .stl or .glb, - for PLY on standard output
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,
    #[command(flatten)]
    goal: Goal,
    /// Level of a .uwm file, 0, the finest, where none is named, to the base's
    #[arg(long, value_name = "J")]
    level: Option<u32>,
    /// Most memory for decoding a .uwm file, and most bytes that a compressed mesh may inflate to, with a suffix K, M, G or without
    #[arg(long, value_name = "M", value_parser = size, default_value = "4G")]
    max_memory: u64,
    /// What the result cannot keep of the input is an error, and nothing is written
    #[arg(long)]
    strict: bool,
    /// One JSON object on standard output instead of text
    #[arg(long)]
    json: bool,
    /// Nothing but errors
    #[arg(long, short)]
    quiet: bool,
    #[command(flatten)]
    simplification: Simplification,
}

/// How far to simplify.
#[derive(clap::Args)]
#[group(required = true, multiple = false)]
struct Goal {
    /// Most triangles, 0 or more
    #[arg(long, visible_alias = "faces", value_name = "N")]
    triangles: Option<usize>,
    /// Most triangles as a part of the input's, above 0 and up to 1: 0.1 or 10%
    #[arg(long, value_name = "R", value_parser = part)]
    ratio: Option<f64>,
    /// As few triangles as keep the two surfaces within this distance of each other, 0 or more: a length, or a part of the diagonal such as
    /// 0.5%. The largest distance measured counts, from either to the other
    #[arg(long, value_name = "E", value_parser = tolerance)]
    error: Option<Tolerance>,
}

/// Runs the command.
///
/// # Errors
/// Those of reading, simplifying and writing.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let format = MeshFormat::of(&args.output)?;
    let output = Output::new(&args.output, [&*args.input])?;
    if args.json && output.is_stream() {
        return Err(Usage("--json and -o - both want standard output".to_owned()).into());
    }
    let name = input::name(&args.input);
    let start = Instant::now();
    let mut progress = Progress::new(args.quiet);
    let reading = Reading { max_memory: args.max_memory, force: false, scenes: false };
    let Mesh { source, level } = Mesh::read(&args.input, args.level, reading, &mut progress)?;
    let read = start.elapsed().as_secs_f64();
    let limit = args.goal.limit(&source.mesh);
    let conditioned = condition(&source.mesh, args.simplification.weld);
    let conditioning = start.elapsed().as_secs_f64() - read;
    let mesh =
        simplified(&source.mesh, &conditioned, limit, args, &mut progress).with_context(|| name.clone())?;
    let simplifying = start.elapsed().as_secs_f64() - read - conditioning;
    drop(progress);
    let mut dropped = source.dropped;
    dropped.extend(source.mesh.uncoded());
    dropped.extend(left_out(&conditioned));
    if args.strict && !dropped.is_empty() {
        bail!("{name}: --strict: the result cannot keep {}", dropped.join(", "));
    }
    output.write(|out| match source.coordinates {
        Coordinates::Float32 => format.write_exact(&mesh, Real::Binary32, out),
        Coordinates::Float64 | Coordinates::Text => format.write(&mesh, None, out),
    })?;

    let diagonal = source.mesh.diagonal();
    let distance = distance(&source.mesh, &mesh, SAMPLES);
    let mut warnings: Vec<String> = level.and_then(|level| level.lost).into_iter().collect();
    warnings.extend(limit.missed(&mesh, distance));
    let joined = conditioned.report.joined_vertices;
    if let Limit::Triangles(most) = limit
        && mesh.triangles.len() > most
    {
        warnings.extend(welding::warning(&parts(&conditioned), most / 2));
    }
    warnings.extend(format.losses(&mesh, None).into_iter().map(|loss| format!("{}: {loss}", output.name)));
    if args.json {
        let (max, rms) = (distance.map(|d| d.max), distance.map(|d| d.rms));
        let object = json!({
            "input": { "vertices": source.mesh.positions.len(), "triangles": source.mesh.triangles.len(), "diagonal": diagonal },
            "vertices": mesh.positions.len(),
            "triangles": mesh.triangles.len(),
            "max_error": max,
            "rms_error": rms,
            "max_error_percent": max.and_then(|x| percent(x, diagonal)),
            "rms_error_percent": rms.and_then(|x| percent(x, diagonal)),
            "dropped": dropped,
            "joined_vertices": joined,
            "warnings": warnings,
            "seconds": { "read": read, "condition": conditioning, "simplify": simplifying },
        });
        return say(&format!("{object:#}\n"));
    }
    if !dropped.is_empty() {
        note(&format!("{name}: dropped {}", dropped.join(", ")));
    }
    for warning in &warnings {
        remark(args.quiet, &format!("{name}: {warning}"));
    }
    if args.quiet {
        return Ok(());
    }
    let sizes = |mesh: &IndexedMesh| {
        let triangles = count(mesh.triangles.len() as u64, "triangle");
        format!("{}, {triangles}", count(mesh.positions.len() as u64, "vertex"))
    };
    let mut text = format!("{name} -> {}\n  {:<11}{}\n", output.name, "from", sizes(&source.mesh));
    text += &format!("  {:<11}{}\n", "to", sizes(&mesh));
    if let Some(d) = distance {
        let (max, rms) = (of_diagonal(d.max, diagonal), of_diagonal(d.rms, diagonal));
        text += &format!("  {:<11}max {max}, rms {rms}\n", "error");
    }
    if joined > 0 {
        text += &format!(
            "  {:<11}{} with others that are nearly equal\n",
            "joined",
            count(joined as u64, "vertex")
        );
    }
    if !dropped.is_empty() {
        text += &format!("  {:<11}{}\n", "dropped", dropped.join(", "));
    }
    text += &format!(
        "  {:<11}read {read:.2} s, condition {conditioning:.2} s, simplify {simplifying:.2} s\n",
        "time"
    );
    output.say(&text)
}

/// Where to stop.
#[derive(Clone, Copy)]
enum Limit {
    Triangles(usize),
    /// In the units of the mesh.
    Error(f64),
}

impl Goal {
    fn limit(&self, mesh: &IndexedMesh) -> Limit {
        let triangles = mesh.triangles.len();
        match (self.triangles, self.ratio, self.error) {
            (Some(triangles), _, _) => Limit::Triangles(triangles),
            (_, _, Some(Tolerance::Absolute(error))) => Limit::Error(error),
            (_, _, Some(Tolerance::Percent(percent))) => Limit::Error(percent / 100.0 * mesh.diagonal()),
            (_, ratio, _) => Limit::Triangles((triangles as f64 * ratio.unwrap_or(1.0)) as usize),
        }
    }
}

impl Limit {
    /// Why it was not kept, if it was not.
    fn missed(self, mesh: &IndexedMesh, distance: Option<SurfaceDistance>) -> Option<String> {
        match self {
            Self::Triangles(most) if mesh.triangles.len() > most => {
                let triangles = count(mesh.triangles.len() as u64, "triangle");
                let wanted = grouped(most as u64);
                Some(format!("{triangles} are left, {wanted} wanted: no further vertex can go"))
            }
            Self::Error(most) => match distance.map(|distance| distance.max) {
                Some(error) if error <= most => None,
                Some(error) => {
                    let [error, most] = [error, most].map(|x| significant(x, 3));
                    Some(format!("the error is {error}, above the {most} wanted, by what was left out"))
                }
                None => Some("no error can be measured: nothing was simplified".to_owned()),
            },
            Self::Triangles(_) => None,
        }
    }
}

/// The parts of the mesh, as it is and as the lattice has it.
fn parts(conditioned: &Conditioned) -> Joined {
    let (min, max) = lattice::bounds(conditioned.manifold.positions.iter().copied()).unwrap_or_default();
    let lattice = Lattice::over(min, max, Lattice::DEFAULT_BITS);
    let [parts, lattice_parts] = [None, Some(&lattice)].map(|lattice| conditioned.parts(lattice, &[]));
    Joined { parts, lattice_parts, ..Joined::default() }
}

/// Removes vertices as far as the limit allows.
fn simplified(
    input: &IndexedMesh,
    conditioned: &Conditioned,
    limit: Limit,
    args: &Args,
    progress: &mut Progress,
) -> anyhow::Result<IndexedMesh> {
    let table = &conditioned.manifold.table;
    let triangles = table.triangle_count();
    let used = conditioned.manifold.positions.iter().copied();
    let Some((min, max)) = lattice::bounds(used).filter(|_| triangles > 0) else {
        bail!("no triangle is left: all are degenerate");
    };
    let lattice = Lattice::over(min, max, Lattice::MAX_BITS);
    if !lattice.step.is_finite() {
        bail!("the mesh is larger than the largest number: its extent is infinite");
    }
    let least = match limit {
        Limit::Triangles(most) if triangles <= most => return Ok(sewn(table, conditioned)),
        // A vertex takes two triangles with it, or one where it was on the boundary, whose vertices are as many as its edges.
        Limit::Triangles(most) => {
            let surplus = triangles - most;
            let removals = (surplus + conditioned.report.census.boundary_edges).div_ceil(2).min(surplus);
            conditioned.manifold.positions.len().saturating_sub(removals)
        }
        Limit::Error(_) => 0,
    };
    let locked = if args.simplification.lock_boundary {
        conditioned.manifold.locked_with_boundary()
    } else {
        conditioned.manifold.locked.clone()
    };
    // No bytes are to be saved here.
    let regular = Regular::Ignored;
    let options = simplify::Options { regular, ..args.simplification.options(Profile::Default, Some(least)) };
    let mut tell = |done, total| {
        progress.update("simplify", done, total);
        true
    };
    let Simplified { base, history, .. } = simplify::simplify(
        table.clone(),
        &conditioned.manifold.positions,
        locked,
        Features::default(),
        &lattice,
        &options,
        &mut tell,
    )?;
    let mut way = Way { applied: 0, table: base, history };
    match limit {
        Limit::Triangles(most) => way.refine_while(|table| table.triangle_count() <= most)?,
        Limit::Error(most) => {
            way.refine_until(progress, |table| {
                let mesh = sewn(table, conditioned);
                // The vertices alone refuse most of what does not fit.
                let near = |samples| distance(input, &mesh, samples).is_some_and(|d| d.max <= most);
                [0, SAMPLES].into_iter().all(near)
            })?;
        }
    }
    Ok(sewn(&way.table, conditioned))
}

/// A mesh on the way from the base back to the input.
struct Way {
    table: CornerTable,
    history: History,
    /// Operations between the base and the mesh.
    applied: usize,
}

impl Way {
    /// To the last mesh that fits, when all before it do.
    fn refine_while(&mut self, fits: impl Fn(&CornerTable) -> bool) -> anyhow::Result<()> {
        while self.applied < self.history.operations().len() {
            self.go(self.applied + 1)?;
            if !fits(&self.table) {
                return self.go(self.applied - 1);
            }
        }
        Ok(())
    }

    /// To a mesh that fits, with as few operations as bisection finds; to all of them where it finds none.
    fn refine_until(
        &mut self,
        progress: &mut Progress,
        fits: impl Fn(&CornerTable) -> bool,
    ) -> anyhow::Result<()> {
        let all = self.history.operations().len();
        // Those that do not fit are below `low`, and `high` fits, if any does.
        let (mut low, mut high, mut steps) = (0, all, 0);
        while high - low > high / FINENESS {
            self.go((low + high) / 2)?;
            if fits(&self.table) {
                high = self.applied;
            } else {
                low = self.applied + 1;
            }
            steps += 1;
            progress.update("measure", steps, steps + u64::from((high - low).max(1).ilog2()));
        }
        self.go(high)
    }

    /// Applies or undoes operations until so many are applied.
    fn go(&mut self, to: usize) -> anyhow::Result<()> {
        let operations = self.history.operations();
        let told = |e: OperationError| anyhow!("{e}");
        // They were recorded in the order of removal.
        while self.applied < to {
            let operation = &operations[operations.len() - 1 - self.applied];
            operation.apply(&mut self.table, self.history.flips(operation)).map_err(told)?;
            self.applied += 1;
        }
        while self.applied > to {
            let operation = &operations[operations.len() - self.applied];
            operation.undo(&mut self.table, self.history.flips(operation)).map_err(told)?;
            self.applied -= 1;
        }
        Ok(())
    }
}

/// Positions and triangles, with the copies of cut vertices sewn together: they are all still there.
fn sewn(table: &CornerTable, conditioned: &Conditioned) -> IndexedMesh {
    let mut first: Vec<Vertex> = (0..table.vertex_slots() as u32).map(Vertex).collect();
    for group in &conditioned.remainder.stitches {
        for &copy in group {
            first[copy.index()] = group[0];
        }
    }
    let mut names = vec![u32::MAX; first.len()];
    let mut mesh = IndexedMesh::default();
    for t in table.triangles() {
        let triangle = table.triangle(t).map(|v| {
            let v = first[v.index()];
            let name = &mut names[v.index()];
            if *name == u32::MAX {
                *name = mesh.positions.len() as u32;
                mesh.positions.push(conditioned.manifold.positions[v.index()]);
            }
            *name
        });
        mesh.triangles.push(triangle);
    }
    mesh
}

/// How far the input and the result are from each other, the larger of both ways; `None` where squares of lengths are no numbers.
fn distance(input: &IndexedMesh, mesh: &IndexedMesh, samples: u64) -> Option<SurfaceDistance> {
    let sampling = Sampling { samples, ..Sampling::default() };
    let both =
        is_measurable(input).then(|| surface_distances(input, mesh, &sampling, &mut |_, _| {})).flatten();
    both.map(SurfaceDistance::symmetric)
}

fn is_measurable(mesh: &IndexedMesh) -> bool {
    (1e-60..1e60).contains(&mesh.diagonal())
}

/// What conditioning set aside: no manifold holds it.
fn left_out(conditioned: &Conditioned) -> Vec<String> {
    let report = &conditioned.report;
    let counts = [
        (report.degenerate_triangles, "degenerate triangle"),
        (report.repeated_triangles, "repeated triangle"),
        (report.isolated_vertices, "isolated vertex"),
    ];
    counts.iter().filter(|(n, _)| *n > 0).map(|(n, noun)| count(*n as u64, noun)).collect()
}

/// Points of each surface that are measured, besides its vertices.
const SAMPLES: u64 = 100_000;
/// A search ends once one part of so many is left in which to look.
const FINENESS: usize = 256;

const EXAMPLES: &str = "\
EXAMPLES
  unweld simplify bunny.ply -o small.ply --triangles 5000
  unweld simplify bunny.ply -o tenth.ply --ratio 10%
  unweld simplify bunny.ply -o near.ply --error 0.1%
  unweld simplify bunny.uwm -o coarse.obj --level 3 --triangles 1000
  unweld simplify bunny.ply -o small.obj --triangles 5000 --method ffc --lock-boundary
  unweld simplify part.stl -o small.stl --triangles 5000 --weld 0.0001";
