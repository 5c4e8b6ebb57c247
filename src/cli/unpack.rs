//! `unweld unpack`: the meshes of a set as files.

use super::args::size;
use super::failure::Usage;
use super::input;
use super::numbers::count;
use super::output::{MeshFormat, Output, remark, say};
use super::progress::Progress;
use super::shown::Shown;
use super::uwm::Uwm;
use anyhow::Context;
use serde_json::json;
use std::fs;
use std::path::PathBuf;

/// Write the meshes of a set to DIR/level-J.ply, level 0 being the finest
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// The set, - for standard input
    #[arg(value_name = "SET.uwm")]
    input: PathBuf,
    /// The folder to write to
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// This member alone, 0, the finest, and up
    #[arg(long, value_name = "J")]
    level: Option<u32>,
    /// What to write
    #[arg(long, value_enum, default_value = "ply")]
    format: MeshFormat,
    /// Most memory to use, in bytes or with a suffix K, M, G
    #[arg(long, value_name = "M", value_parser = size, default_value = "4G")]
    max_memory: u64,
    /// One JSON object on standard output instead of text
    #[arg(long)]
    json: bool,
    /// Nothing but errors
    #[arg(long, short)]
    quiet: bool,
}

/// Runs the command.
///
/// # Errors
/// Those of reading, decoding and writing; [`Usage`] where the file is no set.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let format = args.format;
    let mut uwm = Uwm::open(&args.input, args.max_memory)?;
    let Some(members) = uwm.members() else {
        let what = format!(
            "{} is no set of meshes; decode --all-levels writes its levels",
            input::name(&args.input)
        );
        return Err(Usage(what).into());
    };
    fs::create_dir_all(&args.output).with_context(|| args.output.display().to_string())?;
    let mut progress = Progress::new(args.quiet);
    let (mut lines, mut files, mut warnings) = (String::new(), Vec::new(), Vec::new());
    for number in args.level.map_or(members, |level| vec![level]) {
        uwm.enter(number, &mut progress)?;
        let decoder = uwm.level(0, &mut progress)?;
        let shown = Shown::new(&decoder, None, format, args.max_memory).with_context(|| uwm.name.clone())?;
        let path = args.output.join(format!("level-{number}.{}", format.extension()));
        let output = Output::new(&path, [&*args.input])?;
        let remarks = shown.write(format, false, &output, &[&args.input])?;
        warnings.extend(remarks);
        warnings.extend(shown.losses(format).into_iter().map(|loss| format!("{}: {loss}", output.name)));
        let [vertices, triangles] =
            [shown.mesh.positions.len(), shown.mesh.triangles.len()].map(|n| n as u64);
        let source = uwm.metadata()?.map(|metadata| metadata.source).filter(|source| !source.is_empty());
        lines += &format!("{}: {}, {}", output.name, count(vertices, "vertex"), count(triangles, "triangle"));
        lines += &source.as_ref().map_or_else(|| "\n".to_owned(), |source| format!(", from {source}\n"));
        files.push(json!({ "member": number, "file": output.name, "vertices": vertices, "triangles": triangles, "source": source }));
    }
    drop(progress);
    if args.json {
        return say(&format!("{:#}\n", json!({ "files": files, "warnings": warnings })));
    }
    warnings.iter().for_each(|text| remark(args.quiet, text));
    if args.quiet { Ok(()) } else { say(&lines) }
}

const EXAMPLES: &str = "\
EXAMPLES
  unweld unpack lods.uwm -o lods/
  unweld unpack lods.uwm -o lods/ --level 2 --format obj";
