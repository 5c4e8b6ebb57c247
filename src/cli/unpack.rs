//! `unweld unpack`: the meshes of a set as files, or as levels of detail of one glTF.

use super::args::size;
use super::decode::Compression;
use super::detail;
use super::failure::Usage;
use super::input;
use super::inputs::{is_folder, is_mesh_name};
use super::numbers::count;
use super::output::{MeshFormat, Output, remark, say};
use super::progress::Progress;
use super::shown::Shown;
use super::uwm::Uwm;
use anyhow::Context;
use serde_json::json;
use std::fs;
use std::path::PathBuf;
use unweld::mesh::IndexedMesh;

/// Write the meshes of a set to DIR/level-J.ply, level 0 being the finest, or to one .glb as levels of detail of its node (MSFT_lod)
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// The set, - for standard input
    #[arg(value_name = "SET.uwm")]
    input: PathBuf,
    /// The folder to write to, or the .glb: viewers that know no levels of detail show the finest
    #[arg(short, long, value_name = "DIR|LODS.glb")]
    output: PathBuf,
    /// This member alone, 0, the finest, and up
    #[arg(long, value_name = "J")]
    level: Option<u32>,
    /// What to write to a folder
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
    let mut uwm = Uwm::open(&args.input, args.max_memory)?;
    let Some(members) = uwm.members() else {
        let what = format!(
            "{} is no set of meshes; decode --all-levels writes its levels",
            input::name(&args.input)
        );
        return Err(Usage(what).into());
    };
    let is_file = detail::is_file(&args.output);
    if !is_file && !is_folder(&args.output) && is_mesh_name(&args.output) {
        let what = format!("{}: the name of a folder is wanted, or of a .glb file", args.output.display());
        return Err(Usage(what).into());
    }
    let one = if is_file { Some(Output::new(&args.output, [&*args.input])?) } else { None };
    if one.is_none() {
        fs::create_dir_all(&args.output).with_context(|| args.output.display().to_string())?;
    }
    let format = if one.is_some() { MeshFormat::Glb } else { args.format };
    let mut progress = Progress::new(args.quiet);
    let (mut lines, mut files, mut warnings) = (String::new(), Vec::new(), Vec::new());
    let mut levels = Vec::new();
    for number in args.level.map_or(members, |level| vec![level]) {
        uwm.enter(number, &mut progress)?;
        let decoder = uwm.level(0, &mut progress)?;
        let shown = Shown::new(&decoder, None, format, args.max_memory).with_context(|| uwm.name.clone())?;
        let name = if let Some(output) = &one {
            format!("{}, level {number}", output.name)
        } else {
            let path = args.output.join(format!("level-{number}.{}", format.extension()));
            let output = Output::new(&path, [&*args.input])?;
            warnings.extend(shown.write(format, Compression::None, &output, &[&args.input])?);
            output.name
        };
        warnings.extend(shown.losses(format).into_iter().map(|loss| format!("{name}: {loss}")));
        let [vertices, triangles] =
            [shown.mesh.positions.len(), shown.mesh.triangles.len()].map(|n| n as u64);
        let source = uwm.metadata()?.map(|metadata| metadata.source).filter(|source| !source.is_empty());
        lines += &format!("{name}: {}, {}", count(vertices, "vertex"), count(triangles, "triangle"));
        lines += &source.as_ref().map_or_else(|| "\n".to_owned(), |source| format!(", from {source}\n"));
        let file = one.as_ref().map_or(name, |output| output.name.clone());
        files.push(json!({ "member": number, "file": file, "vertices": vertices, "triangles": triangles, "source": source }));
        if one.is_some() {
            levels.push((number, shown.mesh));
        }
    }
    if let (Some(output), Some(set)) = (&one, &uwm.set) {
        levels.sort_by_key(|(number, _)| *number);
        let error =
            |(number, _): &(u32, IndexedMesh)| set.contents.members[*number as usize].level().max_error;
        let errors: Vec<f64> = levels.iter().map(error).collect();
        let meshes: Vec<IndexedMesh> = levels.into_iter().map(|(_, mesh)| mesh).collect();
        detail::write(&meshes, &errors, set.diagonal(), output)?;
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
  unweld unpack lods.uwm -o lods/ --level 2 --format obj
  unweld unpack lods.uwm -o lods.glb               levels of detail of one node; pack takes them again";
