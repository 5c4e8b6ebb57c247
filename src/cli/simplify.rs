//! `unweld simplify`: a coarser mesh with the positions of the input, without a `.uwm` file between.

use super::args::Simplification;
use super::failure::Usage;
use super::input;
use super::numbers::{count, grouped, of_diagonal, percent};
use super::output::{MeshFormat, Output, remark, say};
use super::progress::Progress;
use anyhow::{Context, anyhow, bail};
use serde_json::json;
use std::path::PathBuf;
use std::time::Instant;
use unweld::encoder::Profile;
use unweld::mesh::distance::{SurfaceDistance, surface_distance};
use unweld::mesh::topology::{Conditioned, condition};
use unweld::mesh::{CornerTable, IndexedMesh, Lattice, Vertex, lattice};
use unweld::simplify;

/// Simplify a mesh to a number of triangles; the vertices that stay keep their positions
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// The mesh (PLY, OBJ, STL or OFF, also gzip-compressed), - for standard input
    #[arg(value_name = "IN")]
    input: PathBuf,
    /// The mesh to write, .ply, .obj or .stl, - for PLY on standard output
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,
    /// Most triangles
    #[arg(long, value_name = "N")]
    faces: usize,
    /// One JSON object on standard output instead of text
    #[arg(long)]
    json: bool,
    /// Nothing but errors
    #[arg(long, short)]
    quiet: bool,
    #[command(flatten)]
    simplification: Simplification,
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
    let source = input::read(&args.input)?;
    let read = start.elapsed().as_secs_f64();
    let mut progress = Progress::new(args.quiet);
    let conditioned = condition(&source.mesh, args.simplification.weld());
    let conditioning = start.elapsed().as_secs_f64() - read;
    let table = simplified(&conditioned, args, &mut progress).with_context(|| name.clone())?;
    let simplifying = start.elapsed().as_secs_f64() - read - conditioning;
    let mesh = sewn(&table, &conditioned);
    output.write(|out| format.write(&mesh, None, out))?;
    drop(progress);

    let diagonal = source.mesh.diagonal();
    let distance = distance(&source.mesh, &mesh, diagonal);
    let mut dropped = source.dropped;
    dropped.extend(left_out(&conditioned));
    let mut warnings = Vec::new();
    if mesh.triangles.len() > args.faces {
        let triangles = count(mesh.triangles.len() as u64, "triangle");
        warnings.push(format!(
            "{triangles} are left, {} wanted: no further vertex can go",
            grouped(args.faces as u64)
        ));
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
            "warnings": warnings,
            "seconds": { "read": read, "condition": conditioning, "simplify": simplifying },
        });
        return say(&format!("{object:#}\n"));
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
    if !dropped.is_empty() {
        text += &format!("  {:<11}{}\n", "dropped", dropped.join(", "));
    }
    text += &format!(
        "  {:<11}read {read:.2} s, condition {conditioning:.2} s, simplify {simplifying:.2} s\n",
        "time"
    );
    output.say(&text)
}

/// Removes vertices until at most so many triangles are left, and not one more than that takes.
fn simplified(
    conditioned: &Conditioned,
    args: &Args,
    progress: &mut Progress,
) -> anyhow::Result<CornerTable> {
    let table = &conditioned.table;
    let triangles = table.triangle_count();
    let used = conditioned.positions.iter().copied();
    let Some((min, max)) = lattice::bounds(used).filter(|_| triangles > 0) else {
        bail!("no triangle is left: all are degenerate");
    };
    let lattice = Lattice::over(min, max, Lattice::MAX_BITS);
    if !lattice.step.is_finite() {
        bail!("the mesh is larger than the largest number: its extent is infinite");
    }
    let Some(surplus) = triangles.checked_sub(args.faces).filter(|&n| n > 0) else {
        return Ok(table.clone());
    };
    let mut locked = conditioned.locked.clone();
    if args.simplification.lock_boundary {
        for v in (0..table.vertex_slots() as u32).map(Vertex).filter(|&v| table.is_boundary(v)) {
            locked.set(v.index(), true);
        }
    }
    // A vertex takes two triangles with it, or one where it was on the boundary, whose vertices are as many as its edges.
    let removals = (surplus + conditioned.report.census.boundary_edges).div_ceil(2).min(surplus);
    let least = conditioned.positions.len().saturating_sub(removals);
    let options = args.simplification.options(Profile::Default, Some(least));
    let mut tell = |done, total| {
        progress.update("simplify", done, total);
        true
    };
    let simplified =
        simplify::simplify(table.clone(), &conditioned.positions, locked, &lattice, &options, &mut tell)?;
    let (mut table, history) = (simplified.base, simplified.history);
    for operation in history.operations().iter().rev() {
        let flips = history.flips(operation);
        operation.apply(&mut table, flips).map_err(|e| anyhow!("{e}"))?;
        if table.triangle_count() > args.faces {
            operation.undo(&mut table, flips).map_err(|e| anyhow!("{e}"))?;
            break;
        }
    }
    Ok(table)
}

/// Positions and triangles, with the copies of cut vertices sewn together: they are all still there.
fn sewn(table: &CornerTable, conditioned: &Conditioned) -> IndexedMesh {
    let mut first: Vec<Vertex> = (0..table.vertex_slots() as u32).map(Vertex).collect();
    for group in &conditioned.stitches {
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
                mesh.positions.push(conditioned.positions[v.index()]);
            }
            *name
        });
        mesh.triangles.push(triangle);
    }
    mesh
}

/// How far the input is from the result.
fn distance(input: &IndexedMesh, mesh: &IndexedMesh, diagonal: f64) -> Option<SurfaceDistance> {
    let measurable = (1e-60..1e60).contains(&diagonal);
    if measurable { surface_distance(input, mesh, SAMPLES, 0) } else { None }
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

/// Points of the input's surface that are measured, besides its vertices.
const SAMPLES: usize = 100_000;

const EXAMPLES: &str = "\
EXAMPLES
  unweld simplify bunny.ply -o small.ply --faces 5000
  unweld simplify bunny.ply -o small.obj --faces 5000 --method ffc --lock-boundary";
