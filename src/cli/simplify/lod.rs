//! `unweld lod`: a chain of discrete levels of detail, as files or as a set.

use super::reduction::{self, Reduction};
use super::{Limit, Outcome, SAMPLES, distance, removal};
use crate::cli::args::{self, Removal, Tolerance, part, size, tolerance};
use crate::cli::detail;
use crate::cli::encode;
use crate::cli::failure::{Usage, note};
use crate::cli::input::{self, Mesh, Reading};
use crate::cli::inputs::{is_folder, is_mesh_name};
use crate::cli::numbers::{count, of_diagonal, percent};
use crate::cli::output::{MeshFormat, Output, remark, say};
use crate::cli::pack::{self, Packing};
use crate::cli::progress::Progress;
use anyhow::{Context, bail};
use serde_json::{Value, json};
use std::fs;
use std::path::PathBuf;
use unweld::codec::grid::Real;
use unweld::encoder::{Options, Profile};
use unweld::formats::{Coordinates, Source};
use unweld::mesh::IndexedMesh;

/// Make levels of detail that are meshes of their own, each coarser than the one before: a folder of files, a set in one file, or a .glb
/// whose node has them (MSFT_lod)
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// The mesh (PLY, OBJ, STL, OFF or glTF, also gzip-compressed, or .uwm), - for standard input
    #[arg(value_name = "IN")]
    input: PathBuf,
    /// The folder for level-0, the input, to level-K; or the file of a set, or of a glTF
    #[arg(short, long, value_name = "DIR|SET.uwm|LODS.glb")]
    output: PathBuf,
    #[command(flatten)]
    goals: Goals,
    /// What to write to a folder
    #[arg(long, value_enum, default_value = "ply")]
    format: MeshFormat,
    /// What the levels cannot keep of the input is an error, and nothing is written
    #[arg(long)]
    strict: bool,
    /// Most memory for decoding a .uwm file, and most bytes that a compressed mesh may inflate to, with a suffix K, M, G or without
    #[arg(long, value_name = "M", value_parser = size, default_value = "4G")]
    max_memory: u64,
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
    packing: Packing,
}

/// How coarse the levels are.
#[derive(clap::Args)]
struct Goals {
    /// Coarser levels besides the input, 1 or more, each with --ratio of the triangles of the one before; 4 where nothing is given
    #[arg(long, value_name = "K", value_parser = clap::value_parser!(u32).range(1..=64), conflicts_with_all = ["triangles", "errors"])]
    levels: Option<u32>,
    /// Triangles of a level as a part of those of the one before, above 0 and below 1
    #[arg(long, value_name = "R", value_parser = part, default_value = "0.5", conflicts_with_all = ["triangles", "errors"])]
    ratio: f64,
    /// Most triangles of each level, separated by commas
    #[arg(
        long,
        visible_alias = "faces",
        value_name = "N,...",
        value_delimiter = ',',
        conflicts_with = "errors"
    )]
    triangles: Vec<usize>,
    /// Largest distance from the input that each level may have, separated by commas: lengths, or parts of the diagonal such as 0.5%
    #[arg(long, value_name = "E,...", value_delimiter = ',', value_parser = tolerance)]
    errors: Vec<Tolerance>,
}

/// A level of detail.
struct Made {
    source: Source,
    /// The largest distance from the input, and the root mean square.
    errors: Option<[f64; 2]>,
}

/// Runs the command.
///
/// # Errors
/// Those of reading, simplifying and writing.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let folder =
        is_folder(&args.output) || args.output.extension().is_none() && !args::is_stream(&args.output);
    let is_gltf = detail::is_file(&args.output);
    if !folder && !is_gltf && is_mesh_name(&args.output) {
        let what =
            format!("{}: the name of a folder is wanted, or of a .uwm or .glb file", args.output.display());
        return Err(Usage(what).into());
    }
    let file = if folder { None } else { Some(Output::new(&args.output, [&*args.input])?) };
    if args.json && file.as_ref().is_some_and(Output::is_stream) {
        return Err(Usage("--json and -o - both want standard output".to_owned()).into());
    }
    let name = input::name(&args.input);
    let mut progress = Progress::new(args.quiet);
    let reading =
        Reading { max_memory: args.max_memory, force: false, scenes: false, painted: false, detail: None };
    let Mesh { source, level, .. } = Mesh::read(&args.input, None, reading, &mut progress)?;
    for text in level.and_then(|level| level.lost).into_iter().chain(source.remarks.clone()) {
        remark(args.quiet, &format!("{name}: {text}"));
    }
    let method = args.reduction.method.of_removal();
    if let (Some(output), Some(method), false) = (&file, method, is_gltf) {
        return progressive(args, &source, method, output, &mut progress);
    }
    let dropped: Vec<String> = source.dropped.iter().cloned().chain(source.mesh.uncoded()).collect();
    if args.strict && !dropped.is_empty() {
        bail!("{name}: --strict: the levels cannot keep {}", dropped.join(", "));
    }
    if !dropped.is_empty() {
        note(&format!("{name}: dropped {}", dropped.join(", ")));
    }
    let (levels, remarks) = chain(args, source, &mut progress).with_context(|| name.clone())?;
    remarks.iter().for_each(|text| remark(args.quiet, &format!("{name}: {text}")));
    match file {
        None => to_folder(args, levels, progress),
        Some(output) if is_gltf => to_gltf(args, levels, &output, progress),
        Some(output) => {
            let names: Vec<String> = (0..levels.len()).map(|j| format!("level-{j}")).collect();
            let sources = levels.into_iter().map(|made| made.source).collect();
            let packed = pack::packed(sources, &names, &args.packing, args.max_memory, &mut progress)?;
            drop(progress);
            output.write(|out| out.write_all(&packed.file))?;
            if args.json {
                return say(&format!("{:#}\n", pack::json(&packed.file, &packed.report, &names)?));
            }
            if args.quiet {
                Ok(())
            } else {
                output.say(&pack::text(&output.name, &packed.file, &packed.report)?)
            }
        }
    }
}

/// All levels, the input first; and what there is to say of them.
fn chain(args: &Args, source: Source, progress: &mut Progress) -> anyhow::Result<(Vec<Made>, Vec<String>)> {
    let diagonal = source.mesh.diagonal();
    let triangles = source.mesh.triangles.len();
    let goals = &args.goals;
    let limits: Vec<Limit> = if !goals.errors.is_empty() {
        let length = |&error: &Tolerance| match error {
            Tolerance::Absolute(error) => error,
            Tolerance::Percent(percent) => percent / 100.0 * diagonal,
        };
        goals.errors.iter().map(length).map(Limit::Error).collect()
    } else if !goals.triangles.is_empty() {
        goals.triangles.iter().copied().map(Limit::Triangles).collect()
    } else {
        let levels = goals.levels.unwrap_or(4) as i32;
        (1..=levels).map(|k| Limit::Triangles((triangles as f64 * goals.ratio.powi(k)) as usize)).collect()
    };
    let mut remarks = Vec::new();
    let mut levels = vec![Made { source, errors: None }];
    for limit in limits {
        // Contractions in passes remember nothing of the level before: they go on from it. The others keep planes of the input.
        let goes_on =
            args.reduction.method == reduction::Method::Hqms && matches!(limit, Limit::Triangles(_));
        let from = if goes_on { levels.len() - 1 } else { 0 };
        let from = &levels[from].source;
        let outcome = match args.reduction.method.of_removal() {
            Some(method) => {
                args.reduction.refuse()?;
                removal::simplified(&from.mesh, limit, method, &args.removal, progress)
            }
            None => reduction::reduced(from, limit, &args.reduction, &args.removal, false, progress),
        };
        let Outcome { mesh, left_out, obstacle, remarks: own, .. } = outcome?;
        let j = levels.len();
        if j == 1 && !left_out.is_empty() {
            if args.strict {
                bail!("--strict: the levels cannot keep {}", left_out.join(", "));
            }
            remarks.push(format!("the coarser levels lack {}", left_out.join(", ")));
        }
        remarks.extend(own.into_iter().filter(|_| j == 1));
        let input = &levels[0].source.mesh;
        let far = distance(input, &mesh, SAMPLES);
        remarks.extend(limit.missed(&mesh, far, &obstacle).map(|text| format!("level {j}: {text}")));
        let template = &levels[0].source;
        let source =
            Source { mesh, dropped: Vec::new(), remarks: Vec::new(), scene: None, ..template.clone() };
        levels.push(Made { source, errors: far.map(|far| [far.max, far.rms]) });
    }
    Ok((levels, remarks))
}

/// A file for each level.
fn to_folder(args: &Args, levels: Vec<Made>, progress: Progress) -> anyhow::Result<()> {
    let format = args.format;
    fs::create_dir_all(&args.output).with_context(|| args.output.display().to_string())?;
    let outputs = (0..levels.len()).map(|j| {
        let path = args.output.join(format!("level-{j}.{}", format.extension()));
        Output::new(&path, [&*args.input])
    });
    let outputs = outputs.collect::<anyhow::Result<Vec<_>>>()?;
    drop(progress);
    for (made, output) in levels.iter().zip(&outputs) {
        let mesh = &made.source.mesh;
        output.write(|out| format.write_as_read(mesh, made.source.coordinates, out))?;
        for loss in format.losses(mesh, None) {
            remark(args.quiet, &format!("{}: {loss}", output.name));
        }
    }
    tell(args, &levels, &|j| outputs[j].name.clone(), &|j| outputs[j].name.clone())
}

/// All levels in one glTF.
fn to_gltf(args: &Args, levels: Vec<Made>, output: &Output, progress: Progress) -> anyhow::Result<()> {
    drop(progress);
    let errors: Vec<f64> = levels.iter().map(|made| made.errors.map_or(0.0, |[max, _]| max)).collect();
    let meshes: Vec<IndexedMesh> = levels.iter().map(|made| made.source.mesh.clone()).collect();
    detail::write(&meshes, &errors, meshes[0].diagonal(), output)?;
    let name = |j: usize| format!("{}, level {j}", output.name);
    for (j, mesh) in meshes.iter().enumerate() {
        for loss in MeshFormat::Glb.losses(mesh, None) {
            remark(args.quiet, &format!("{}: {loss}", name(j)));
        }
    }
    tell(args, &levels, &name, &|_| output.name.clone())
}

/// What each level is; what it is called for people, and its file for programs.
fn tell(
    args: &Args,
    levels: &[Made],
    name: &dyn Fn(usize) -> String,
    file: &dyn Fn(usize) -> String,
) -> anyhow::Result<()> {
    let diagonal = levels[0].source.mesh.diagonal();
    let (mut text, mut files) = (String::new(), Vec::new());
    for (j, made) in levels.iter().enumerate() {
        let mesh = &made.source.mesh;
        let [vertices, triangles] = [mesh.positions.len(), mesh.triangles.len()].map(|n| n as u64);
        text += &format!("{}: {}, {}", name(j), count(vertices, "vertex"), count(triangles, "triangle"));
        if let Some([max, rms]) = made.errors {
            text += &format!(
                ", error at most {}, rms {}",
                of_diagonal(max, diagonal),
                of_diagonal(rms, diagonal)
            );
        }
        text.push('\n');
        let [max, rms] = [0, 1].map(|k| made.errors.map(|errors| errors[k]));
        files.push(json!({
            "level": j, "file": file(j), "vertices": vertices, "triangles": triangles, "max_error": max, "rms_error": rms,
            "max_error_percent": max.and_then(|x| percent(x, diagonal)), "rms_error_percent": rms.and_then(|x| percent(x, diagonal)),
        }));
    }
    if args.json {
        return say(&format!("{:#}\n", json!({ "levels": Value::Array(files) })));
    }
    if args.quiet { Ok(()) } else { say(&text) }
}

/// The encoder's own methods leave a history: an ordinary file, whose levels are nested and cost nothing more.
fn progressive(
    args: &Args,
    source: &Source,
    method: args::Method,
    output: &Output,
    progress: &mut Progress,
) -> anyhow::Result<()> {
    let name = input::name(&args.input);
    args.reduction.refuse()?;
    let (position_bits, lattice) = args.packing.lattice();
    let real = match source.coordinates {
        Coordinates::Float32 => Real::Binary32,
        Coordinates::Float64 | Coordinates::Text => Real::Binary64,
    };
    let options = Options {
        position_bits,
        lattice,
        exact: args.packing.is_exact().then_some(real),
        simplify: args.removal.options(method, Profile::Default, None),
        lock_boundary: args.removal.lock_boundary,
        weld: args.removal.weld,
        max_memory: args.max_memory,
        ..Options::default()
    };
    if args.strict {
        encode::refuse_losses(source, &args.input)?;
    }
    let encoded = encode::encode(source, &args.input, options, Vec::new(), progress)?;
    output.write(|out| out.write_all(&encoded.file))?;
    let text = format!(
        "{name}: {} is an ordinary .uwm file of {} with all levels between, not a set: levels of this method are nested\n",
        output.name,
        count(encoded.file.len() as u64, "byte"),
    );
    if args.json {
        return say(&format!(
            "{:#}\n",
            json!({ "file_bytes": encoded.file.len(), "set": false, "levels": encoded.report.errors.len() })
        ));
    }
    if args.quiet { Ok(()) } else { output.say(&text) }
}

const EXAMPLES: &str = "\
EXAMPLES
  unweld lod bunny.ply -o lods/ --levels 5
  unweld lod bunny.ply -o lods/ --triangles 10000,3000,1000 --method qslim --format obj
  unweld lod bunny.ply -o lods.uwm --errors 0.1%,0.5% --small
  unweld lod bunny.ply -o lods.glb --ratio 30%
  unweld lod bunny.ply -o bunny.uwm --method stellar

Discrete levels are for engines that want files, and nearest to the input at equal triangles. For streaming, `unweld encode`, or
--method stellar here, makes a file that has all its levels for nothing: it is about as long as its finest mesh alone.";
