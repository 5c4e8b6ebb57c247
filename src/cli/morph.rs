//! `unweld morph`: a mesh on the way from a fine level to a coarse one.

use super::args::size;
use super::failure::Usage;
use super::input::{self, Mesh, Reading, read_bytes};
use super::numbers::count;
use super::output::{MeshFormat, Output, remark, say};
use super::parents;
use super::progress::Progress;
use anyhow::Context;
use clap::ValueEnum;
use serde_json::json;
use std::path::PathBuf;
use unweld::mesh::distance::Sampling;
use unweld::reduce::morph::{self, Morph};

/// Write a mesh between a fine and a coarse level: the fine one's triangles, with their attributes, its vertices part of the way to those
/// that stand for them
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// The fine mesh (PLY, OBJ, STL, OFF or glTF, also gzip-compressed, or .uwm)
    #[arg(value_name = "FINE")]
    fine: PathBuf,
    /// The coarse mesh, as FINE
    #[arg(value_name = "COARSE")]
    coarse: PathBuf,
    /// How far on the way: 0 is the fine mesh, 1 the coarse one
    #[arg(short, value_name = "T", value_parser = share)]
    t: f64,
    /// The mesh to write, .ply, .obj, .stl or .glb, - for PLY on standard output
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,
    /// What `unweld simplify --parents` wrote when it made COARSE of FINE: then 1 is the coarse mesh exactly. Without it vertices go to what
    /// is nearest
    #[arg(long, value_name = "FILE", conflicts_with = "pairs")]
    parents: Option<PathBuf>,
    /// Where vertices go that are not the nearest to one of the coarse mesh
    #[arg(long, value_enum, default_value = "surface")]
    pairs: Pairs,
    /// One JSON object on standard output instead of text
    #[arg(long)]
    json: bool,
    /// Nothing but errors
    #[arg(long, short)]
    quiet: bool,
    /// Most memory for decoding, in bytes or with a suffix K, M, G
    #[arg(long, value_name = "M", value_parser = size, default_value = "4G")]
    max_memory: u64,
}

/// Where vertices without a partner go.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Pairs {
    /// To the nearest point of the coarse surface
    Surface,
    /// To the nearest vertex
    Vertices,
}

/// A number from 0 to 1.
fn share(text: &str) -> Result<f64, String> {
    let number = text.parse::<f64>().ok().filter(|t| (0.0..=1.0).contains(t));
    number.ok_or_else(|| "a number from 0 to 1".to_owned())
}

/// Runs the command.
///
/// # Errors
/// Those of reading and writing; where parents are not of these meshes.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let format = MeshFormat::of(&args.output)?;
    let inputs = [Some(&args.fine), Some(&args.coarse), args.parents.as_ref()];
    let output = Output::new(&args.output, inputs.into_iter().flatten().map(PathBuf::as_path))?;
    if args.json && output.is_stream() {
        return Err(Usage("--json and -o - both want standard output".to_owned()).into());
    }
    let mut progress = Progress::new(args.quiet);
    let reading =
        Reading { max_memory: args.max_memory, force: false, scenes: false, painted: false, detail: None };
    let mut read = |path| Mesh::read(path, None, reading, &mut progress).map(|mesh| mesh.source);
    let (fine, coarse) = (read(&args.fine)?, read(&args.coarse)?);
    drop(progress);
    let (fine, coarse) = (fine.mesh, coarse.mesh);
    let names = format!("{}, {}", input::name(&args.fine), input::name(&args.coarse));
    let morph = match &args.parents {
        Some(path) => {
            let read = || -> anyhow::Result<Morph> {
                Ok(Morph::by_parents(&fine, &coarse, parents::read(&read_bytes(path)?)?)?)
            };
            read().with_context(|| input::name(path))?
        }
        None => {
            let pairs = match args.pairs {
                Pairs::Surface => morph::Pairs::Surface,
                Pairs::Vertices => morph::Pairs::Vertices,
            };
            let threads = Sampling::default().threads;
            Morph::by_distance(&fine, &coarse, pairs, threads).with_context(|| names.clone())?
        }
    };
    let mesh = morph.at(&fine, &coarse, args.t);
    output.write(|out| format.write(&mesh, None, out))?;
    let mut warnings = Vec::new();
    if morph.left_over > 0 {
        let left = count(morph.left_over as u64, "coarse vertex");
        warnings.push(format!("{left} without a fine one of its own"));
    }
    warnings.extend(format.losses(&mesh, None).into_iter().map(|loss| format!("{}: {loss}", output.name)));
    let (vertices, triangles) = (mesh.positions.len(), mesh.triangles.len());
    if args.json {
        let object = json!({
            "t": args.t,
            "vertices": vertices,
            "triangles": triangles,
            "left_over": morph.left_over,
            "warnings": warnings,
        });
        return say(&format!("{object:#}\n"));
    }
    for warning in &warnings {
        remark(args.quiet, &format!("{names}: {warning}"));
    }
    if args.quiet {
        return Ok(());
    }
    let [vertices, triangles] =
        [(vertices, "vertex"), (triangles, "triangle")].map(|(n, noun)| count(n as u64, noun));
    output.say(&format!("{names} -> {}\n  at {}: {vertices}, {triangles}\n", output.name, args.t))
}

const EXAMPLES: &str = "\
EXAMPLES
  unweld simplify bunny.ply -o coarse.ply --ratio 10% --parents map.txt
  unweld morph bunny.ply coarse.ply --parents map.txt -t 0.4 -o between.ply
  unweld morph bunny.ply foreign.ply -t 0.8 -o between.ply         a level made by another program";
