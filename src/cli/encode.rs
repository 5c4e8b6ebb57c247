//! `unweld encode`: from a foreign mesh to a `.uwm` file.

use super::args::{Preview, Profile, Simplification, is_stream, keyframes, size, value_name};
use super::attribute_args;
use super::batch;
use super::describe::Description;
use super::failure::{Usage, line, note};
use super::input::{self, Level, Mesh, Reading};
use super::inputs;
use super::lattice;
use super::memory::peak;
use super::numbers::{count, grouped, memory, significant};
use super::output::{Output, remark, say};
use super::progress::Progress;
use super::scene::{self, Contents};
use super::uwm::{DEFAULT_MEMORY, Uwm};
use super::welding;
use anyhow::{Context, anyhow, bail};
use serde_json::{Map, Value, json};
use std::fs;
use std::num::NonZero;
use std::path::{Path, PathBuf};
use std::time::Instant;
use unweld::codec::grid::Real;
use unweld::encoder::{Encoder, Keyframes, Options, Report, Source, Stage};
use unweld::error::Place;
use unweld::formats::{self, Coordinates, write_progressive};
use unweld::limits::MAX_LIFTING;
use unweld::mesh::attributes::Semantic;
use unweld::mesh::{Attribute, Lattice};
use unweld::simplify;

/// Encode meshes (PLY, OBJ, STL or OFF, also gzip-compressed, or levels of .uwm files) and scenes (glTF) as .uwm files
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// The mesh, - for standard input; or several, and folders of them
    #[arg(value_name = "IN", required = true)]
    input: Vec<PathBuf>,
    /// The file to write, - for standard output; the folder to write to, where there are several inputs or a folder
    #[arg(short, long, value_name = "OUT.uwm|DIR")]
    output: PathBuf,
    /// How many inputs to encode at a time, 1 or more; as many as there are processors where not given
    #[arg(long, value_name = "N")]
    pub(super) jobs: Option<NonZero<usize>>,
    /// Level of inputs that are .uwm files, 0, the finest, where none is named, to the base's. Level 0 stays exact and in order, if it is
    #[arg(long, value_name = "J")]
    level: Option<u32>,
    /// Level 0 has the coordinates of the input, bit for bit
    #[arg(long)]
    exact: bool,
    /// Level 0 has the vertices and triangles of the input in their order, none of them welded
    #[arg(long)]
    keep_order: bool,
    /// What matters most
    #[arg(long, value_enum, default_value = "default")]
    profile: Profile,
    /// How coarse the coordinates of coarse levels are
    #[arg(long, value_enum, default_value = "auto")]
    preview: Preview,
    /// How far vertices of coarse levels leave their places for the levels to be nearer to the input, 0, not at all, to 32; where not
    /// given, 18, or 13 where they stand in rows or have attributes that vary
    #[arg(long, value_name = "F", value_parser = clap::value_parser!(u8).range(..=i64::from(MAX_LIFTING)))]
    lifting: Option<u8>,
    /// Vertices of the base, 0 or more; where not given, the locked ones and of the others the larger of 0.5 % and 150, or up to an eighth more;
    /// with values that vary, such as normals, of a small mesh one in 32, at least 50
    #[arg(long, value_name = "N")]
    base_vertices: Option<usize>,
    /// All levels have all components, however small; otherwise each appears where a level is nearer to the input than it is large
    #[arg(long)]
    keep_components: bool,
    /// Levels to jump to: none, all, every:N, or level numbers separated by commas
    #[arg(long, value_name = "LEVELS", default_value = "none", value_parser = keyframes)]
    keyframes: Keyframes,
    /// Most memory to use for each input, in bytes or with a suffix K, M, G
    #[arg(long, value_name = "M", value_parser = size)]
    max_memory: Option<u64>,
    /// Write an ordinary .glb with the scene's coarsest level, in the buffer of which a .uwm file refines it for viewers that know the
    /// extension UNWELD_progressive_mesh
    #[arg(long)]
    gltf_extension: bool,
    /// What a file cannot keep of an input is an error, and that input is not encoded
    #[arg(long)]
    strict: bool,
    /// One JSON object on standard output instead of text
    #[arg(long)]
    pub(super) json: bool,
    /// Do what is refused otherwise: write to a name that ends as a mesh's does, read a mesh whose counts are not those of what is there
    #[arg(long)]
    pub(super) force: bool,
    /// No progress bar and no report
    #[arg(long, short)]
    pub(super) quiet: bool,
    #[command(flatten)]
    attributes: attribute_args::Attributes,
    #[command(flatten)]
    lattice: lattice::Choice,
    #[command(flatten)]
    simplification: Simplification,
}

/// Runs the command.
///
/// # Errors
/// Those of reading, encoding and writing.
pub fn run(args: &Args) -> anyhow::Result<()> {
    match &args.input[..] {
        [input] if !input.is_dir() => run_one(args, input),
        _ if args.gltf_extension => Err(Usage("--gltf-extension takes one input".to_owned()).into()),
        inputs => batch::run(args, inputs, &args.output),
    }
}

fn run_one(args: &Args, input: &Path) -> anyhow::Result<()> {
    let output = if inputs::is_folder(&args.output) {
        let mut path = inputs::into_folder(input, &args.output)?;
        if args.gltf_extension {
            path.set_extension("glb");
        }
        fs::create_dir_all(&args.output).with_context(|| args.output.display().to_string())?;
        Output::new(&path, [input])?
    } else {
        let output = Output::new(&args.output, [input])?;
        if inputs::is_mesh_name(&args.output) && !args.force && !args.gltf_extension {
            let what = "the name of a mesh, but a .uwm file is written";
            return Err(Usage(format!("{} is {what} (--force does it)", output.name)).into());
        }
        output
    };
    if args.json && output.is_stream() {
        return Err(Usage("--json and -o - both want standard output".to_owned()).into());
    }
    let mut progress = Progress::new(args.quiet);
    let done = encode_to(args, input, &output, &mut progress)?;
    drop(progress);

    if args.json {
        let mut object = done.json();
        object.insert("peak_bytes".to_owned(), json!(peak()));
        return say(&format!("{:#}\n", Value::Object(object)));
    }
    done.remark(args.quiet, input);
    if args.quiet {
        return Ok(());
    }
    let head = format!("{} -> {}\n", input::name(input), output.name);
    let scene =
        done.scene.as_ref().map_or(String::new(), |scene| format!("  {:<11}{}\n", "scene", scene.text()));
    let body = scene + &report_text(&done.description, &done.report);
    let times = times(&done.report, done.seconds);
    output.say(&format!("{head}{body}{times}"))
}

/// What there is to tell of an input that has been encoded.
pub struct Done {
    /// The file.
    pub description: Description,
    /// What the encoder tells.
    pub report: Report,
    /// What the user may not have expected.
    pub warnings: Vec<String>,
    /// What the file has beside its mesh, where it is a scene.
    pub scene: Option<Contents>,
    /// For reading and for writing.
    seconds: [f64; 2],
}

impl Done {
    /// Says on standard error what was dropped, even where nothing else is to be said, and what the user may not have expected.
    pub fn remark(&self, quiet: bool, input: &Path) {
        let name = input::name(input);
        if !self.report.dropped.is_empty() {
            note(&format!("{name}: dropped {}", self.report.dropped.join(", ")));
        }
        for warning in &self.warnings {
            remark(quiet, &format!("{name}: {warning}"));
        }
    }

    /// One JSON object.
    pub fn json(&self) -> Map<String, Value> {
        let mut object = self.description.json();
        add_report(&mut object, &self.description, &self.report, self.seconds, &self.warnings);
        if let Some(scene) = &self.scene {
            object.insert("scene".to_owned(), scene.json());
        }
        object
    }
}

/// From an input to an output.
///
/// # Errors
/// Those of reading, encoding and writing.
pub fn encode_to(
    args: &Args,
    input: &Path,
    output: &Output,
    progress: &mut Progress,
) -> anyhow::Result<Done> {
    let start = Instant::now();
    let max_memory = args.max_memory.unwrap_or(DEFAULT_MEMORY);
    let reading = Reading { max_memory, force: args.force, scenes: true, painted: false, detail: None };
    let Mesh { mut source, level, .. } =
        Mesh::read(input, args.level, reading, progress).map_err(|e| hinted(e, reading, input))?;
    if args.strict {
        refuse_losses(&source, input)?;
    }
    let left_out = args.attributes.drop_from(&mut source.mesh);
    source.dropped.extend(left_out);
    let is_part = |attribute: &Attribute| attribute.semantic == Semantic::Part;
    let has_parts = source.mesh.triangles.is_empty() || source.mesh.attributes.iter().any(is_part);
    if source.scene.is_some() && !has_parts {
        source.scene = None;
        formats::turn_v(&mut source.mesh);
        source.dropped.push("the scene (without parts)".to_owned());
    }
    let read = start.elapsed().as_secs_f64();
    let kept = Kept::new(args, level.as_ref());
    let (options, settings) = (options(args, kept, &source), settings(args, kept));
    let scene = source.scene.as_ref().map(|scene| Contents::new(scene, source.mesh.part_names.len()));
    // In a glTF the scene is the glTF's own.
    let around = if args.gltf_extension { source.scene.take() } else { None };
    if args.gltf_extension && around.is_none() {
        return Err(Usage(format!("{}: --gltf-extension is for scenes of glTF", input::name(input))).into());
    }
    let Encoded { file, report } = encode(&source, input, options, settings, progress)?;
    let remarks = std::mem::take(&mut source.remarks);
    drop(source);
    let start = Instant::now();
    let mut uwm = Uwm::in_memory(file.clone(), &output.name)?;
    match &around {
        Some(scene) => {
            let base = uwm.level(uwm.contents.base_level(), progress)?.assembled()?;
            output.write(|mut out| write_progressive(&base, scene, &file, &mut out))?;
        }
        None => output.write(|out| out.write_all(&file))?,
    }
    drop(file);
    let write = start.elapsed().as_secs_f64();
    let description = Description::new(&mut uwm, report.residue)?;
    let mut warnings = warnings(args, &description, &report);
    warnings.extend(level.iter().flat_map(|level| losses(level, &description)));
    warnings.extend(remarks);
    Ok(Done { description, report, warnings, scene, seconds: [read, write] })
}

/// With `--strict` nothing may be lost.
///
/// # Errors
/// Where the file would not keep all of the input.
pub fn refuse_losses(source: &formats::Source, input: &Path) -> anyhow::Result<()> {
    let dropped = source.dropped.clone();
    match &dropped[..] {
        [] => Ok(()),
        _ => bail!("{}: --strict: a file cannot keep {}", input::name(input), dropped.join(", ")),
    }
}

/// The error with a word about --force, where that would help.
fn hinted(error: anyhow::Error, reading: Reading, input: &Path) -> anyhow::Error {
    let fault = error.downcast_ref::<unweld::Error>();
    let contradicts = matches!(fault, Some(unweld::Error::Input(fault)) if fault.place != Place::Whole);
    // Standard input cannot be read again.
    let readable = || input::read(input, Reading { force: true, ..reading }).is_ok();
    if contradicts && !reading.force && !is_stream(input) && readable() {
        return anyhow!("{}; --force reads what is there", line(&error));
    }
    error
}

/// A file and how it came about.
pub struct Encoded {
    /// Its bytes.
    pub file: Vec<u8>,
    /// What the encoder tells.
    pub report: Report,
}

/// Encodes in memory: nothing is written before all has gone well.
///
/// # Errors
/// Those of the encoder, with the name of the input.
pub fn encode(
    source: &formats::Source,
    path: &Path,
    options: Options,
    settings: Vec<(String, String)>,
    progress: &mut Progress,
) -> anyhow::Result<Encoded> {
    let mut encoder = Encoder::new(options);
    encoder.source(Source {
        name: input::file_name(path),
        dropped: source.dropped.clone(),
        float32: source.coordinates == Coordinates::Float32,
        settings,
    });
    encoder.on_progress(|p| {
        let stage = match p.stage {
            Stage::Condition => "condition",
            Stage::Simplify => "simplify",
            _ => "code",
        };
        progress.update(stage, p.done, p.total);
        true
    });
    if let Some(scene) = &source.scene {
        encoder.resources(scene::resources(scene));
    }
    let mut file = Vec::new();
    let report = encoder.encode(&source.mesh, &mut file).with_context(|| input::name(path))?;
    Ok(Encoded { file, report })
}

/// The description and what the encoding took, in bits a vertex.
pub fn report_text(description: &Description, report: &Report) -> String {
    let per_vertex = |bits: f64| significant(bits / description.vertices().max(1) as f64, 3);
    let parts: Vec<String> = parts(report)
        .iter()
        .filter(|(_, bits)| *bits > 0.0)
        .map(|(name, bits)| format!("{name} {}", per_vertex(*bits)))
        .collect();
    let joined = welding::text(report, description.is_exact());
    let joined = joined.map_or(String::new(), |text| format!("  {:<11}{text}\n", "joined"));
    format!(
        "{}{joined}\n{}\n  {:<11}{}, {} bits a vertex ({})\n",
        description.summary(),
        description.table(),
        "file",
        count(report.bytes, "byte"),
        per_vertex(report.bytes as f64 * 8.0),
        parts.join(", "),
    )
}

/// What of the input is kept besides its surface.
#[derive(Clone, Copy)]
struct Kept {
    coordinates: bool,
    order: bool,
}

impl Kept {
    /// As is wanted; and what a level of a `.uwm` file has kept before stays.
    fn new(args: &Args, level: Option<&Level>) -> Self {
        let (exact, ordered) = level.map_or((false, false), |level| (level.exact, level.ordered));
        Self { coordinates: args.exact || exact, order: args.keep_order || ordered }
    }
}

/// What a level of a `.uwm` file loses on the way to another one.
fn losses(level: &Level, description: &Description) -> Vec<String> {
    let now = &description.contents.header.lattice;
    // Bounds that were decoded are off by a rounding, which moves no point of the lattice.
    let near = |x: f64, y: f64| (x - y).abs() <= 0.01 * now.step;
    let moved = |old: &Lattice| {
        let points = f64::from(now.bits).exp2();
        let same = old.bits == now.bits && near(old.step * points, now.step * points);
        !(same && (0..3).all(|k| near(old.origin[k], now.origin[k])))
    };
    let rounded = level.lattice.as_ref().filter(|old| !description.is_exact() && moved(old)).map(|old| {
        format!(
            "coordinates on a lattice of {} bits are rounded to another one of {} bits, by up to {}",
            old.bits,
            now.bits,
            significant(now.step * 0.75f64.sqrt(), 3),
        )
    });
    level.lost.iter().cloned().chain(rounded).collect()
}

fn options(args: &Args, kept: Kept, source: &formats::Source) -> Options {
    let real = match source.coordinates {
        Coordinates::Float32 => Real::Binary32,
        Coordinates::Float64 | Coordinates::Text => Real::Binary64,
    };
    let (position_bits, lattice) = args.lattice.of_library();
    let is_scene = source.scene.is_some();
    let (bits, births) = (args.attributes.bits(&source.mesh), args.attributes.births(&source.mesh));
    Options {
        position_bits,
        lattice,
        exact: kept.coordinates.then_some(real),
        keep_order: kept.order,
        simplify: args.simplification.removal.options(
            args.simplification.method,
            args.profile.of_library(),
            args.base_vertices,
        ),
        keyframes: args.keyframes.clone(),
        preview: args.preview.of_library(),
        lifting: args.lifting,
        attribute_bits: if is_scene { scene::bits(&source.mesh, &source.texels, bits) } else { bits },
        attribute_births: if is_scene { scene::births(births) } else { births },
        attribute_weights: args.attributes.weights(&source.mesh),
        lock_boundary: args.simplification.removal.lock_boundary,
        births: !args.keep_components,
        rich_models: args.profile.of_library().rich_models(),
        weld: args.simplification.removal.weld,
        max_memory: args.max_memory.unwrap_or(u64::MAX),
        ..Options::default()
    }
}

/// Names and values as they are given on the command line, but for those that are what they are by default.
fn settings(args: &Args, kept: Kept) -> Vec<(String, String)> {
    let keyframes = match &args.keyframes {
        Keyframes::None => "none".to_owned(),
        Keyframes::All => "all".to_owned(),
        Keyframes::Every(n) => format!("every:{n}"),
        Keyframes::Levels(levels) => levels.iter().map(u32::to_string).collect::<Vec<_>>().join(","),
    };
    let mut settings = args.lattice.settings();
    settings.extend([
        ("exact".to_owned(), kept.coordinates.to_string()),
        ("keep-order".to_owned(), kept.order.to_string()),
        ("profile".to_owned(), value_name(&args.profile)),
        ("preview".to_owned(), value_name(&args.preview)),
        ("lifting".to_owned(), args.lifting.map_or("auto".to_owned(), |f| f.to_string())),
        ("base-vertices".to_owned(), args.base_vertices.map_or("auto".to_owned(), |n| n.to_string())),
        ("keep-components".to_owned(), args.keep_components.to_string()),
        ("keyframes".to_owned(), keyframes),
    ]);
    settings.extend(args.attributes.settings());
    settings.extend(args.simplification.settings());
    settings.retain(|(name, value)| !DEFAULTS.contains(&(name, value)));
    settings
}

/// Settings that a file need not name: its generator knows them, or its header has them.
const DEFAULTS: [(&str, &str); 14] = [
    ("position-bits", "14"),
    ("exact", "false"),
    ("keep-order", "false"),
    ("profile", "default"),
    ("preview", "auto"),
    ("lifting", "auto"),
    ("base-vertices", "auto"),
    ("keep-components", "false"),
    ("keyframes", "none"),
    ("method", "auto"),
    ("choices", "8"),
    ("lock-boundary", "false"),
    ("weld", "exact"),
    ("seed", "0"),
];

/// What the user may not have expected.
fn warnings(args: &Args, description: &Description, report: &Report) -> Vec<String> {
    let header = &description.contents.header;
    let mut warnings = Vec::new();
    let usual = simplify::default_base_vertices(header.vertices as usize, report.locked_vertices, false);
    let wanted = args.base_vertices.unwrap_or(usual);
    if header.base_vertices as usize > args.base_vertices.unwrap_or(simplify::most_base_vertices(usual)) {
        warnings.push(format!(
            "the base has {} where {} would do: {} locked, no other can be removed",
            count(header.base_vertices, "vertex"),
            grouped(wanted as u64),
            match report.locked_vertices {
                0 => "no vertex is".to_owned(),
                1 => "1 vertex is".to_owned(),
                n => format!("{} are", count(n as u64, "vertex")),
            },
        ));
    }
    warnings.extend(welding::warning(&report.joined, wanted));
    warnings.extend(args.lattice.warnings(args.preview, report));
    if let Keyframes::Levels(levels) = &args.keyframes {
        let base = description.contents.base_level();
        let beyond: Vec<String> = levels.iter().filter(|&&level| level > base).map(u32::to_string).collect();
        if !beyond.is_empty() {
            warnings.push(format!("no keyframe at level {}: the base is level {base}", beyond.join(", ")));
        }
    }
    warnings
}

fn times(report: &Report, [read, write]: [f64; 2]) -> String {
    let seconds = &report.seconds;
    format!(
        "  {:<11}read {read:.2} s, condition {:.2} s, simplify {:.2} s, code {:.2} s, write {write:.2} s\n  {:<11}{}\n",
        "time",
        seconds.condition,
        seconds.simplify,
        seconds.code,
        "memory",
        memory(peak()) + " at its peak",
    )
}

/// Where the bits went.
fn parts(report: &Report) -> [(&'static str, f64); 11] {
    [
        ("connectivity", report.connectivity_bits),
        ("geometry", report.position_bits),
        ("base", report.base_bits),
        ("births", report.birth_bits),
        ("residue", report.residue_bits),
        ("attributes", report.attribute_bits),
        ("correction", report.correction_bits),
        ("order", report.order_bits),
        ("keyframes", report.keyframe_bits),
        ("resources", report.resource_bits),
        ("other", report.other_bits),
    ]
}

fn add_report(
    object: &mut Map<String, Value>,
    description: &Description,
    report: &Report,
    [read, write]: [f64; 2],
    warnings: &[String],
) {
    let vertices = description.vertices().max(1) as f64;
    let bits: Map<String, Value> = parts(report).map(|(n, b)| (n.to_owned(), json!(b))).into_iter().collect();
    let total = json!(report.bytes as f64 * 8.0 / vertices);
    let per_vertex = parts(report).map(|(n, b)| (n.to_owned(), json!(b / vertices))).into_iter();
    let per_vertex: Map<String, Value> = per_vertex.chain([("total".to_owned(), total)]).collect();
    let seconds = &report.seconds;
    object.insert("bits".to_owned(), Value::Object(bits));
    object.insert("bits_per_vertex".to_owned(), Value::Object(per_vertex));
    object.insert(
        "seconds".to_owned(),
        json!({
            "read": read,
            "condition": seconds.condition,
            "simplify": seconds.simplify,
            "code": seconds.code,
            "write": write,
        }),
    );
    object.insert("locked_vertices".to_owned(), json!(report.locked_vertices));
    object.insert("joined".to_owned(), welding::json(report));
    object.insert("warnings".to_owned(), json!(warnings));
}

const EXAMPLES: &str = "\
EXAMPLES
  unweld encode bunny.ply -o bunny.uwm
  unweld encode part.stl -o part.uwm
  unweld encode bunny.ply.gz -o bunny.uwm --position-bits 12 --keyframes every:4
  unweld encode bunny.ply -o bunny.uwm --profile small --preview coarse
  unweld encode bunny.ply -o bunny.uwm --exact --keep-order
  unweld encode scene.obj -o scene.uwm --strict
  unweld encode scene.glb -o scene.uwm
  unweld encode scene.obj -o scene.uwm --bits uv=14,normal=8 --drop color
  unweld encode scene.obj -o scene.uwm --attribute-birth uv=base,color=0 --weight normal=2
  unweld encode part.stl -o part.uwm --weld 0.0001 --exact
  unweld encode bunny.ply -o bunny.uwm --position-bits auto:0.0005
  unweld encode tiles/ -o coded/ --lattice-step 0.0009765625 --lattice-origin 4600000,5300000,0 --lock-boundary
  unweld encode - -o - < bunny.obj > bunny.uwm
  unweld encode bunny.ply -o bunny.uwm --json | jq .bits_per_vertex
  unweld encode bunny.uwm -o coarse.uwm --level 5
  unweld encode bunny.ply scans/ more/*.obj -o coded/ --jobs 4

SEVERAL INPUTS
  Each becomes a file of its name in DIR: scans/bunny.ply.gz becomes DIR/bunny.uwm.
  Folders are searched to the bottom; IN/a/bunny.ply becomes DIR/a/bunny.uwm.
  Left out and counted: hidden files, files not called as meshes of other formats are, linked folders.
  Two inputs that would become one file, such as a.ply and a.obj, become a.ply.uwm and a.obj.uwm.
  One that fails does not stop the others; then the exit code is 1.";
