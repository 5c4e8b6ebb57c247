//! `unweld decode`: from a `.uwm` file, or as much of it as is wanted, to a foreign mesh.

use super::args::{Bound, Tolerance, is_stream, size};
use super::describe::diagonal;
use super::failure::{Usage, note};
use super::input;
use super::numbers::{count, grouped, of_diagonal, significant};
use super::output::{MeshFormat, Output, remark, say};
use super::progress::Progress;
use super::quality::Quality;
use super::shown::Shown;
use super::uwm::Uwm;
use anyhow::{Context, bail};
use clap::ValueEnum;
use serde_json::{Value, json};
use std::fs;
use std::path::{Path, PathBuf};
use unweld::container::{Contents, Measure, Plan, Want, plan, plan_from_keyframe};
use unweld::decoder::{Decoder, Event, Until};
use unweld::mesh::IndexedMesh;

/// Decode a .uwm file, or as much as is wanted or there, to PLY, OBJ, STL or glTF
#[derive(Clone, clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// The file, - for standard input
    #[arg(value_name = "IN.uwm")]
    input: PathBuf,
    /// The mesh to write, .ply, .obj, .stl, .glb or .gltf (with OUT.bin and images called OUT-… beside it), - for PLY on standard output
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
    /// How a glTF of a scene has its numbers: quantize has positions as integers on the file's lattice, and normals, tangents and texture
    /// coordinates in 16 bits (KHR_mesh_quantization), where a mesh has no skin, instances or morph targets; meshopt has them so, too, and
    /// vertices and indices compressed (EXT_meshopt_compression)
    #[arg(long, value_enum, default_value = "none")]
    gltf_compression: Compression,
    /// Write every level on the way to DIR/level-J.ply (or .obj, .stl, .glb or .gltf, if OUT is)
    #[arg(long, value_name = "DIR")]
    all_levels: Option<PathBuf>,
    /// Most memory to use, in bytes or with a suffix K, M, G
    #[arg(long, value_name = "M", value_parser = size, default_value = "4G")]
    max_memory: u64,
    /// Tell what was written as one JSON object on standard output
    #[arg(long)]
    json: bool,
    /// Nothing but errors
    #[arg(long, short)]
    quiet: bool,
}

/// How a glTF has its numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Compression {
    None,
    Quantize,
    Meshopt,
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
    let input = args.input.as_path();
    let output = args.output.as_deref().map(|path| Output::new(path, [input])).transpose()?;
    let folder = args.all_levels.as_deref();
    if let Some(folder) = folder {
        fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    }
    let mut uwm = Uwm::open(&args.input, args.max_memory)?;
    let of_member;
    let args = if uwm.members().is_some() {
        if args.operations.is_some() || folder.is_some() || args.via == Via::Keyframe {
            return Err(Usage(format!(
                "{}: a set of meshes has no operations; unpack writes all of it",
                uwm.name
            ))
            .into());
        }
        uwm.enter_wanted(&args.quality, &mut Progress::new(args.quiet))?;
        of_member = Args { quality: Quality::default(), ..args.clone() };
        &of_member
    } else {
        args
    };
    let way = way(args, &mut uwm)?;
    let (way, short) = within(&uwm, args, way)?;
    let (mut levels, mut warnings) = (Vec::new(), Vec::new());
    let is_scene = uwm.contents.scene().is_some();
    let mut progress = Progress::new(args.quiet);
    let mut decoder = uwm.decode(way.plan.as_ref(), way.until, &mut progress, &mut |decoder, event| {
        // Level 0 is not complete before its residue.
        if let (Event::Level { level: 1.., .. }, Some(folder), false) = (event, folder, is_scene) {
            levels.push(write_level(decoder, folder, format, args, &mut warnings)?);
        }
        Ok(())
    })?;
    if let (Some(folder), Some(finest), true) = (folder, decoder.level(), is_scene) {
        // A scene comes behind the base, its images behind one level or the other.
        for level in (finest.max(1)..=uwm.contents.base_level()).rev() {
            let mut decoder = uwm.level(level, &mut progress)?;
            uwm.complete_scene(&mut decoder)?;
            levels.push(write_level(&decoder, folder, format, args, &mut warnings)?);
        }
    }
    drop(progress);
    if let (Some(folder), Some(0)) = (folder, decoder.level()) {
        levels.push(write_level(&decoder, folder, format, args, &mut warnings)?);
    }
    let cut = uwm.cut().filter(|_| short).map(|there| uwm.cut_text(there));
    if let Some(most) = args.quality.triangles {
        remark_on_triangles(args.quiet, &uwm.name, &decoder, most);
    }
    let text = reached(&mut uwm, &decoder)?;
    let mut written = None;
    if let Some(output) = &output {
        if format.is_gltf() && args.quality.max_bytes.is_none() {
            uwm.complete_scene(&mut decoder)?;
        }
        let shown = Shown::new(&decoder, args.quality.triangles, format, args.max_memory)
            .with_context(|| uwm.name.clone())?;
        let remarks = shown.write(format, args.gltf_compression, output, &[input])?;
        let losses = shown.losses(format).into_iter().chain(remarks);
        warnings.extend(losses.map(|loss| format!("{}: {loss}", output.name)));
        written = Some(Written::new(output, &shown.mesh, &decoder));
    }
    if args.json {
        warnings.extend(cut);
        let levels: Vec<_> = levels.iter().map(Written::json).collect();
        let output = written.as_ref().map(Written::json);
        let object = json!({ "output": output, "all_levels": levels, "warnings": warnings });
        return say(&format!("{object:#}\n"));
    }
    // That a file has less than it says is no news to leave out.
    cut.iter().for_each(|text| note(text));
    warnings.iter().for_each(|text| remark(args.quiet, text));
    if args.quiet {
        return Ok(());
    }
    let metadata = uwm.metadata().unwrap_or_default();
    let diagonal = diagonal(&uwm.contents, metadata.as_ref());
    let lines = levels.iter().map(|level| level.line() + &level.error_text(diagonal) + "\n");
    let lines = lines.chain(written.iter().map(|written| format!("{}\n  {text}\n", written.line())));
    let text: String = lines.collect();
    output.as_ref().map_or_else(|| say(&text), |output| output.say(&text))
}

/// A mesh that has been written.
struct Written {
    name: String,
    vertices: usize,
    triangles: usize,
    /// The level that it is, or has all of.
    level: Option<u32>,
    /// Of that level.
    max_error: Option<f64>,
}

impl Written {
    fn new(output: &Output, mesh: &IndexedMesh, decoder: &Decoder) -> Self {
        let level = decoder.level();
        let entry = level.and_then(|level| decoder.contents()?.level(level));
        Self {
            name: output.name.clone(),
            vertices: mesh.positions.len(),
            triangles: mesh.triangles.len(),
            level,
            max_error: entry.map(|entry| entry.max_error),
        }
    }

    fn line(&self) -> String {
        let triangles = count(self.triangles as u64, "triangle");
        format!("{}: {}, {triangles}", self.name, count(self.vertices as u64, "vertex"))
    }

    fn error_text(&self, diagonal: f64) -> String {
        self.max_error
            .map_or_else(String::new, |error| format!(", error at most {}", of_diagonal(error, diagonal)))
    }

    fn json(&self) -> Value {
        let Self { name, vertices, triangles, level, max_error } = self;
        json!({ "file": name, "level": level, "vertices": vertices, "triangles": triangles, "max_error": max_error })
    }
}

/// Keyframes lead to levels alone, and two results do not fit on standard output.
fn check(args: &Args) -> anyhow::Result<()> {
    if args.json && args.output.as_deref().is_some_and(is_stream) {
        return Err(Usage("--json and -o - both want standard output".to_owned()).into());
    }
    let partial = [
        ("--triangles", args.quality.triangles.is_some()),
        ("--max-bytes", args.quality.max_bytes.is_some()),
        ("--operations", args.operations.is_some()),
    ];
    if args.gltf_compression != Compression::None
        && !args.output.as_deref().is_some_and(|out| MeshFormat::of(out).is_ok_and(MeshFormat::is_gltf))
    {
        return Err(Usage("--gltf-compression is for .glb and .gltf".to_owned()).into());
    }
    match partial.iter().find(|(_, given)| *given && args.via == Via::Keyframe) {
        Some((name, _)) => Err(Usage(format!("--via keyframe leads to a level, not to {name}")).into()),
        None => Ok(()),
    }
}

/// From what is wanted to what that takes.
fn way(args: &Args, uwm: &mut Uwm) -> anyhow::Result<Way> {
    let contents = uwm.contents.clone();
    if let Some(operations) = args.operations {
        let most = contents.operations(0..contents.atoms.len());
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
            let there = most.min(uwm.length());
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

/// Of a file that is cut off as much as there is on the way, and whether that is less than is wanted.
///
/// # Errors
/// Where a certain level is wanted that is not there.
fn within(uwm: &Uwm, args: &Args, way: Way) -> anyhow::Result<(Way, bool)> {
    let Some(there) = uwm.cut() else { return Ok((way, false)) };
    let quality = &args.quality;
    let fits = |plan: &Plan| plan.parts.iter().all(|part| part.bytes.end <= there);
    if way.plan.as_ref().is_some_and(fits) {
        return Ok((way, quality.max_bytes.is_some_and(|bytes| bytes > there)));
    }
    quality.level.map_or(Ok(()), |level| uwm.check_level(level))?;
    if args.via == Via::Keyframe {
        // Keyframes are the last in a file: decoding tells what is missing.
        return Ok((way, false));
    }
    let prefix = uwm.prefix(there)?;
    let operations: u64 = prefix.parts.iter().map(|part| uwm.contents.operations(part.atoms.clone())).sum();
    let short = operations < way.until.operations && prefix.triangles < way.until.triangles;
    Ok((Way { plan: Some(prefix), ..way }, short))
}

fn write_level(
    decoder: &Decoder,
    folder: &Path,
    format: MeshFormat,
    args: &Args,
    warnings: &mut Vec<String>,
) -> anyhow::Result<Written> {
    let (input, name) = (args.input.as_path(), || input::name(&args.input));
    let Some(level) = decoder.level() else { bail!("{}: there is no mesh", name()) };
    let shown = Shown::new(decoder, None, format, args.max_memory).with_context(name)?;
    let output = Output::new(&folder.join(format!("level-{level}.{}", format.extension())), [input])?;
    let remarks = shown.write(format, args.gltf_compression, &output, &[input])?;
    warnings.extend(remarks.into_iter().map(|remark| format!("{}: {remark}", output.name)));
    Ok(Written::new(&output, &shown.mesh, decoder))
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
            let lacks = lacking(decoder, &contents);
            let what = match (lacks.is_empty(), decoder.correction()) {
                (true, None) => "everything there is; error".to_owned(),
                (true, Some(_)) => "everything there is, bit for bit; error on the lattice".to_owned(),
                (false, _) => format!("without {}; error", lacks.join(", ")),
            };
            format!("level 0 of {base}, {what} at most {error}")
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

/// What belongs to level 0 and has not come.
fn lacking(decoder: &Decoder, contents: &Contents) -> Vec<&'static str> {
    let parts = [
        ("the residue", contents.residue(), decoder.residue().is_some()),
        ("the correction to exact coordinates", contents.correction(), decoder.correction().is_some()),
        ("the order of the input", contents.order(), decoder.order().is_some()),
    ];
    parts.into_iter().filter(|(_, atoms, there)| !atoms.is_empty() && !there).map(|(name, ..)| name).collect()
}

const EXAMPLES: &str = "\
EXAMPLES
  unweld decode bunny.uwm -o bunny.ply
  unweld decode bunny.uwm -o bunny.obj --triangles 5000
  unweld decode bunny.uwm -o coarse.stl --error 0.5%
  unweld decode bunny.uwm -o coarse.stl --error rms:0.1%
  unweld decode bunny.uwm -o early.ply --max-bytes 20K
  unweld decode scene.uwm -o scene.gltf
  unweld decode scene.uwm -o small.glb --level 4 --gltf-compression quantize
  unweld decode bunny.uwm --all-levels levels/
  curl -s https://example.org/bunny.uwm | unweld decode - -o bunny.obj

--max-bytes and --max-memory take suffixes K, M, G.
Of a file that is cut off comes the finest mesh that is there, and a remark that tells which.";
