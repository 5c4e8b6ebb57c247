//! `unweld decode`: from a `.uwm` file, or as much of it as is wanted, to a foreign mesh.

use super::args::{Bound, Tolerance, size};
use super::describe::diagonal;
use super::failure::Usage;
use super::numbers::{count, grouped, of_diagonal, significant};
use super::output::{MeshFormat, Output, remark};
use super::progress::Progress;
use super::quality::Quality;
use super::uwm::Uwm;
use anyhow::{Context, bail};
use clap::ValueEnum;
use std::fs;
use std::path::{Path, PathBuf};
use unweld::codec::grid::Real;
use unweld::codec::walk::Walk;
use unweld::container::{Contents, Measure, Plan, Want, plan, plan_from_keyframe};
use unweld::decoder::{Decoder, Event, Until};
use unweld::mesh::{IndexedMesh, Lattice};

/// Decode a .uwm file, or as much as is wanted, to PLY, OBJ or STL
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// The file, - for standard input
    #[arg(value_name = "IN.uwm")]
    input: PathBuf,
    /// The mesh to write, .ply, .obj or .stl, - for PLY on standard output
    #[arg(short, long, value_name = "OUT", required_unless_present = "all_levels")]
    output: Option<PathBuf>,
    #[command(flatten)]
    quality: Quality,
    /// The base and K operations, 0 to the number that `info` tells
    #[arg(long, value_name = "K", conflicts_with = "Quality")]
    operations: Option<u64>,
    /// Where to start: from the base, or from the keyframe next to the wanted level
    #[arg(long, value_enum, default_value = "replay")]
    via: Via,
    /// Write every level on the way to DIR/level-J.ply (or .obj or .stl, if OUT is)
    #[arg(long, value_name = "DIR")]
    all_levels: Option<PathBuf>,
    /// Most memory to use, in bytes or with a suffix K, M, G
    #[arg(long, value_name = "M", value_parser = size, default_value = "4G")]
    max_memory: u64,
    /// Nothing but errors
    #[arg(long, short)]
    quiet: bool,
}

/// How to come to a level.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Via {
    Replay,
    Keyframe,
}

/// What to decode: a plan, or all the file; and where to stop.
struct Way {
    plan: Option<Plan>,
    until: Until,
}

/// Runs the command.
///
/// # Errors
/// Those of reading, decoding and writing, and where the file has no such quality.
pub fn run(args: &Args) -> anyhow::Result<()> {
    check(args)?;
    let format = args.output.as_deref().map_or(Ok(MeshFormat::Ply), MeshFormat::of)?;
    let output = args.output.as_deref().map(Output::new).transpose()?;
    let folder = args.all_levels.as_deref();
    if let Some(folder) = folder {
        fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    }
    let mut uwm = Uwm::open(&args.input, args.max_memory)?;
    let way = way(args, &mut uwm)?;
    let mut progress = Progress::new(args.quiet);
    let mut on_event = |decoder: &Decoder, event: &Event| match (event, folder) {
        // Level 0 is not complete before its residue.
        (Event::Level { level: 1.., .. }, Some(folder)) => write_level(decoder, folder, format),
        _ => Ok(()),
    };
    let decoder = uwm.decode(way.plan.as_ref(), way.until, &mut progress, &mut on_event)?;
    drop(progress);
    if let (Some(folder), Some(0)) = (folder, decoder.level()) {
        write_level(&decoder, folder, format)?;
    }
    if let Some(most) = args.quality.triangles {
        remark_on_triangles(args.quiet, &uwm.name, &decoder, most);
    }
    let Some(output) = output else { return Ok(()) };
    let (mesh, real) = mesh(&decoder, args.quality.triangles)?;
    let lattice = &uwm.contents.header.lattice;
    write(&mesh, real, lattice, format, &output)?;
    for loss in format.losses(&mesh, real.is_none().then_some(lattice)) {
        remark(args.quiet, &format!("{}: {loss}", output.name));
    }
    if args.quiet {
        return Ok(());
    }
    let text = reached(&mut uwm, &decoder)?;
    output.say(&format!(
        "{}: {}, {}\n  {text}\n",
        output.name,
        count(mesh.positions.len() as u64, "vertex"),
        count(mesh.triangles.len() as u64, "triangle"),
    ))
}

/// Keyframes lead to levels alone.
fn check(args: &Args) -> anyhow::Result<()> {
    let partial = [
        ("--triangles", args.quality.triangles.is_some()),
        ("--max-bytes", args.quality.max_bytes.is_some()),
        ("--operations", args.operations.is_some()),
    ];
    match partial.iter().find(|(_, given)| *given && args.via == Via::Keyframe) {
        Some((name, _)) => Err(Usage(format!("--via keyframe leads to a level, not to {name}")).into()),
        None => Ok(()),
    }
}

/// From what is wanted to what that takes.
fn way(args: &Args, uwm: &mut Uwm) -> anyhow::Result<Way> {
    let contents = uwm.contents.clone();
    if let Some(operations) = args.operations {
        let most = u64::from(contents.header.vertices - contents.header.base_vertices);
        if operations > most {
            bail!("{}: there are {most} operations, {operations} cannot be carried out", uwm.name);
        }
        // All of them are level 0, with what belongs to it.
        let operations = if operations == most { u64::MAX } else { operations };
        return Ok(Way { plan: None, until: Until { operations, ..Until::default() } });
    }
    let relative = matches!(args.quality.error, Some(Bound { most: Tolerance::Percent(_), .. }));
    let metadata = if relative { uwm.metadata()? } else { None };
    let want = args.quality.want(&contents, || diagonal(&contents, metadata.as_ref()));
    let want = want.with_context(|| uwm.name.clone())?;
    let until = Until::of(want, &contents);
    let plan = match want {
        Want::Bytes(most) => {
            let there = most.min(uwm.length()?);
            if there < contents.base_end() {
                bail!("{}: the base needs {} bytes, {there} are there", uwm.name, contents.base_end());
            }
            Some(plan(&contents, Want::Bytes(there)))
        }
        Want::Error(measure, most) => {
            remark_on_error(args.quiet, &uwm.name, &contents, measure, most);
            by(args.via, &contents, until.level)
        }
        // To the operation: the plan would end with an atom.
        Want::Triangles(_) => None,
        Want::Level(_) | Want::All => by(args.via, &contents, until.level),
    };
    Ok(Way { plan, until })
}

/// The way to a level; `None` for all of the file.
fn by(via: Via, contents: &Contents, level: u32) -> Option<Plan> {
    match via {
        Via::Keyframe => Some(plan_from_keyframe(contents, level)),
        // Level 0 takes the whole file, and all its checksums with it.
        Via::Replay if level == 0 => None,
        Via::Replay => Some(plan(contents, Want::Level(level))),
    }
}

fn write_level(decoder: &Decoder, folder: &Path, format: MeshFormat) -> anyhow::Result<()> {
    let (Some(level), Some(contents)) = (decoder.level(), decoder.contents()) else { return Ok(()) };
    let (mesh, real) = mesh(decoder, None)?;
    let output = Output::new(&folder.join(format!("level-{level}.{}", format.extension())))?;
    write(&mesh, real, &contents.header.lattice, format, &output)
}

/// Writes a mesh, in the type of its coordinates where these are exact.
pub fn write(
    mesh: &IndexedMesh,
    real: Option<Real>,
    lattice: &Lattice,
    format: MeshFormat,
    output: &Output,
) -> anyhow::Result<()> {
    output.write(|out| match real {
        Some(real) => format.write_exact(mesh, real, out),
        None => format.write(mesh, Some(lattice), out),
    })
}

/// The mesh to write, and the type of its coordinates where they are exact; on the lattice and without the triangles of the
/// residue, where there are too many with them.
pub fn mesh(decoder: &Decoder, triangles: Option<u32>) -> anyhow::Result<(IndexedMesh, Option<Real>)> {
    let fits = |residue: usize| {
        triangles.is_none_or(|most| decoder.mesh().table.triangle_count() + residue <= most as usize)
    };
    match (decoder.residue(), decoder.contents()) {
        (Some(residue), Some(contents)) if !fits(residue.triangles.len()) => {
            let mut residue = residue.clone();
            residue.triangles.clear();
            let walk = Walk::new(&decoder.mesh().table, &decoder.mesh().roots);
            Ok((residue.assemble(decoder.mesh(), &walk, &contents.header.lattice), None))
        }
        _ => {
            let correction = decoder.correction().filter(|_| decoder.level() == Some(0));
            Ok((decoder.assembled()?, correction.map(|correction| correction.real)))
        }
    }
}

fn remark_on_triangles(quiet: bool, name: &str, decoder: &Decoder, most: u32) {
    let triangles = decoder.mesh().table.triangle_count();
    if triangles > most as usize {
        let text = format!(
            "{name}: the base has {} triangles, more than {}",
            grouped(triangles as u64),
            grouped(most)
        );
        remark(quiet, &text);
    }
}

fn remark_on_error(quiet: bool, name: &str, contents: &Contents, measure: Measure, most: f64) {
    let finest = contents.levels.first().map_or(0.0, |level| level.error(measure));
    if finest > most {
        let (finest, most) = (significant(finest, 3), significant(most, 3));
        let of = if measure == Measure::Rms { "an rms error" } else { "an error" };
        remark(quiet, &format!("{name}: level 0 has {of} of {finest}, above the {most} wanted"));
    }
}

/// Where decoding ended.
pub fn reached(uwm: &mut Uwm, decoder: &Decoder) -> anyhow::Result<String> {
    let contents = uwm.contents.clone();
    let (Some(level), base) = (decoder.level(), contents.base_level()) else {
        bail!("{}: there is no mesh", uwm.name);
    };
    let Some(entry) = contents.level(level) else { bail!("{}: there is no level {level}", uwm.name) };
    let diagonal = diagonal(&contents, uwm.metadata().unwrap_or_default().as_ref());
    let [error, rms] =
        [Measure::Max, Measure::Rms].map(|measure| of_diagonal(entry.error(measure), diagonal));
    let error = format!("{error}, rms {rms}");
    let vertices = decoder.mesh().positions.len() as u32;
    let done = vertices.saturating_sub(entry.vertices);
    let next = level.checked_sub(1).and_then(|finer| contents.level(finer)).filter(|_| done > 0);
    Ok(match next {
        None if level == 0 => {
            let exact = match (contents.correction().is_empty(), decoder.correction()) {
                (true, _) => "everything there is; error",
                (false, Some(_)) => "everything there is, bit for bit; error on the lattice",
                (false, None) => "without the correction to exact coordinates; error",
            };
            format!("level 0 of {base}, {exact} at most {error}")
        }
        None => format!("level {level} of {base}; error at most {error}"),
        Some(finer) => format!(
            "level {level} of {base} and {} of the {} operations to level {}; error of level {level} at most {error}",
            grouped(done),
            grouped(finer.vertices - entry.vertices),
            level - 1,
        ),
    })
}

const EXAMPLES: &str = "\
EXAMPLES
  unweld decode bunny.uwm -o bunny.ply
  unweld decode bunny.uwm -o bunny.obj --triangles 5000
  unweld decode bunny.uwm -o coarse.stl --error 0.5%
  unweld decode bunny.uwm -o coarse.stl --error rms:0.1%
  unweld decode bunny.uwm -o early.ply --max-bytes 20K
  unweld decode bunny.uwm --all-levels levels/
  curl -s https://example.org/bunny.uwm | unweld decode - -o bunny.obj

--max-bytes and --max-memory take suffixes K, M, G.";
