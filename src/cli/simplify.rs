//! `unweld simplify`: a coarser mesh, without a `.uwm` file between.

mod device;
pub mod lod;
mod parallel;
mod reduction;
mod removal;
mod texture;

use super::args::{Removal, Tolerance, part, size, tolerance, value_name};
use super::failure::{Usage, note};
use super::input::{self, Mesh, Reading};
use super::numbers::{count, grouped, of_diagonal, percent, significant};
use super::output::{MeshFormat, Output, remark, say};
use super::parents;
use super::progress::Progress;
use super::welding;
use anyhow::{Context, bail};
use parallel::Parallel;
use reduction::Reduction;
use serde_json::json;
use std::path::{Path, PathBuf};
use std::time::Instant;
use texture::Texturing;
use unweld::encoder::Joined;
use unweld::formats::{SceneOptions, gltf_files};
use unweld::mesh::distance::{Sampling, SurfaceDistance, surface_distances};
use unweld::mesh::topology::{Weld, condition};
use unweld::mesh::{IndexedMesh, Lattice, lattice};

/// Simplify a mesh to a number of triangles or within an error; by the methods stellar and ffc vertices keep their positions
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// The mesh (PLY, OBJ, STL, OFF or glTF, also gzip-compressed, or .uwm), - for standard input
    #[arg(value_name = "IN")]
    input: PathBuf,
    /// The mesh to write, .ply, .obj, .stl, .glb or .gltf, - for PLY on standard output
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
    /// Write which vertex of the result stands for each vertex of the input, for `unweld morph`: a line each, its number from 0, or - where
    /// none does. By the methods that contract edges or cluster vertices, to PLY or OBJ
    #[arg(long, value_name = "FILE")]
    parents: Option<PathBuf>,
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
    reduction: Reduction,
    #[command(flatten)]
    removal: Removal,
    #[command(flatten)]
    parallel: Parallel,
    #[command(flatten)]
    texturing: Texturing,
}

/// How far to simplify; one of them is needed, but not by what simplifies for a view.
#[derive(clap::Args)]
#[group(multiple = false)]
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
    let parents = args.parents.as_deref().map(|path| args.parents(path, format)).transpose()?;
    if args.json && output.is_stream() {
        return Err(Usage("--json and -o - both want standard output".to_owned()).into());
    }
    if !args.goal.is_given() && !args.reduction.method.is_parallel() {
        return Err(Usage("how far? --triangles, --ratio or --error says it".to_owned()).into());
    }
    let map = args.texturing.outputs(args, format)?;
    let name = input::name(&args.input);
    let start = Instant::now();
    let mut progress = Progress::new(args.quiet);
    let reading = Reading {
        max_memory: args.max_memory,
        force: false,
        scenes: false,
        painted: map.is_some(),
        detail: None,
    };
    let Mesh { mut source, paint, level } = Mesh::read(&args.input, args.level, reading, &mut progress)?;
    let read = start.elapsed().as_secs_f64();
    let mut warnings = Vec::new();
    let begin = |map| args.texturing.begin(map, args, &mut source, paint, &mut warnings);
    let baking = map.map(begin).transpose().with_context(|| name.clone())?;
    let limit = args.goal.limit(&source.mesh);
    if !args.reduction.method.is_parallel() {
        args.parallel.refuse(&value_name(&args.reduction.method))?;
    }
    let outcome = match args.reduction.method.of_removal() {
        None if args.reduction.method.is_parallel() => {
            args.reduction.refuse()?;
            let goal = args.goal.is_given().then_some(limit);
            parallel::removed(&source, goal, &args.parallel, &args.removal, &mut progress)
        }
        Some(method) => {
            args.reduction.refuse()?;
            removal::simplified(&source.mesh, limit, method, &args.removal, &mut progress)
        }
        None => {
            let (reduction, removal) = (&args.reduction, &args.removal);
            reduction::reduced(&source, limit, reduction, removal, parents.is_some(), &mut progress)
        }
    };
    let Outcome {
        mesh,
        left_out,
        joined_vertices: joined,
        conditioning,
        obstacle,
        passes,
        remarks,
        parents: links,
        frames,
    } = outcome.with_context(|| name.clone())?;
    let simplifying = start.elapsed().as_secs_f64() - read - conditioning;
    let made = baking.as_ref().map(|baking| baking.make(&mesh, &mut progress)).transpose();
    let made = made.with_context(|| name.clone())?;
    let texturing = start.elapsed().as_secs_f64() - read - conditioning - simplifying;
    drop(progress);
    let mut dropped = source.dropped;
    dropped.extend(left_out);
    if args.strict && !dropped.is_empty() {
        bail!("{name}: --strict: the result cannot keep {}", dropped.join(", "));
    }
    match (format, &baking, &made) {
        (_, Some(baking), Some(made)) => {
            baking.write(mesh.clone(), made, args, (format, source.coordinates), &output)?;
        }
        (MeshFormat::Gltf, ..) => {
            drop(output.write_files(&[&args.input], |stem| {
                gltf_files(&mesh, None, &SceneOptions::default(), stem)
            })?)
        }
        _ => output.write(|out| format.write_as_read(&mesh, source.coordinates, out))?,
    }
    if let (Some(file), Some(links)) = (parents, links) {
        file.write(|out| parents::write(&links, out))?;
    }

    let diagonal = source.mesh.diagonal();
    let distance = distance(&source.mesh, &mesh, SAMPLES);
    warnings.extend(level.and_then(|level| level.lost));
    warnings.extend(remarks);
    warnings.extend(limit.missed(&mesh, distance, &obstacle));
    if let Limit::Triangles(most) = limit
        && mesh.triangles.len() > most
    {
        warnings.extend(welding::warning(&parts(&source.mesh, args.removal.weld), most / 2));
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
            "method": value_name(&args.reduction.method),
            "passes": passes,
            "frames": parallel::object(&frames),
            "texture": baking.as_ref().zip(made.as_ref()).map(|(baking, made)| baking.object(made)),
            "warnings": warnings,
            "seconds": { "read": read, "condition": conditioning, "simplify": simplifying, "bake": texturing },
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
    text += &parallel::text(&frames);
    let mut bake_time = String::new();
    if let (Some(baking), Some(made)) = (&baking, &made) {
        text += &baking.text(made);
        bake_time = format!(", bake {texturing:.2} s");
    }
    text += &format!(
        "  {:<11}read {read:.2} s, condition {conditioning:.2} s, simplify {simplifying:.2} s{bake_time}\n",
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

/// What came of a mesh.
struct Outcome {
    mesh: IndexedMesh,
    /// What no result can hold, in words.
    left_out: Vec<String>,
    joined_vertices: usize,
    /// Seconds that were spent before simplifying.
    conditioning: f64,
    /// Why no fewer triangles were to be had, if more were wanted.
    obstacle: String,
    /// How often all vertices were gone over, by a method that does.
    passes: Option<usize>,
    /// Which vertex stands for which of the input, where that is wanted.
    parents: Option<Vec<u32>>,
    /// What else there is to say.
    remarks: Vec<String>,
    /// What was made for each view, by the method that does.
    frames: Vec<parallel::Frame>,
}

impl Args {
    /// Where to write parents to.
    fn parents(&self, path: &Path, format: MeshFormat) -> anyhow::Result<Output> {
        if self.reduction.method.of_removal().is_some() || self.reduction.method.is_parallel() {
            let method = value_name(&self.reduction.method);
            return Err(Usage(format!("--parents is of no use with --method {method}")).into());
        }
        if !matches!(format, MeshFormat::Ply | MeshFormat::Obj) {
            return Err(
                Usage("--parents wants PLY or OBJ: other files number vertices anew".to_owned()).into()
            );
        }
        Output::new(path, [&*self.input, &*self.output])
    }
}

impl Goal {
    fn is_given(&self) -> bool {
        self.triangles.is_some() || self.ratio.is_some() || self.error.is_some()
    }

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
    fn missed(self, mesh: &IndexedMesh, distance: Option<SurfaceDistance>, obstacle: &str) -> Option<String> {
        match self {
            Self::Triangles(most) if mesh.triangles.len() > most => {
                let triangles = count(mesh.triangles.len() as u64, "triangle");
                let wanted = grouped(most as u64);
                Some(format!("{triangles} are left, {wanted} wanted: {obstacle}"))
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
fn parts(mesh: &IndexedMesh, weld: Weld) -> Joined {
    let conditioned = condition(mesh, weld);
    let (min, max) = lattice::bounds(conditioned.manifold.positions.iter().copied()).unwrap_or_default();
    let lattice = Lattice::over(min, max, Lattice::DEFAULT_BITS);
    let [parts, lattice_parts] = [None, Some(&lattice)].map(|lattice| conditioned.parts(lattice, &[]));
    Joined { parts, lattice_parts, ..Joined::default() }
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

/// Points of each surface that are measured, besides its vertices.
const SAMPLES: u64 = 100_000;
const EXAMPLES: &str = "\
EXAMPLES
  unweld simplify bunny.ply -o small.ply --triangles 5000
  unweld simplify bunny.ply -o tenth.ply --ratio 10%
  unweld simplify bunny.ply -o near.ply --error 0.1%
  unweld simplify bunny.uwm -o coarse.obj --level 3 --triangles 1000
  unweld simplify bunny.ply -o small.obj --triangles 5000 --method ffc --lock-boundary
  unweld simplify dragon.ply -o small.ply --triangles 1000 --topology free
  unweld simplify duck.glb -o small.glb --ratio 10%             texture coordinates, normals and colours go along
  unweld simplify spot.obj -o small.obj --ratio 3% --bake small.png --texels 512K    colours and textures of any input, by one map
  unweld simplify bunny.ply -o seen.ply --method parallel --eye 0,0.1,0.5 --pixels 2
  unweld simplify bunny.ply -o seen.ply --method parallel --spacing 8 --orbit 36
  unweld simplify part.stl -o small.stl --triangles 5000 --weld 0.0001";
