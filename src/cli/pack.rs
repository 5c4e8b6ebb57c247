//! `unweld pack`: levels of detail that are meshes of their own, on one lattice, in one file.

use super::args::size;
use super::failure::{Usage, note};
use super::input::{self, Mesh, Reading};
use super::lattice;
use super::numbers::{count, grouped, significant};
use super::output::{Output, remark, say};
use super::progress::Progress;
use super::uwm::Uwm;
use anyhow::{Context, bail};
use serde_json::{Value, json};
use std::path::PathBuf;
use unweld::codec::grid::Real;
use unweld::encoder::{LatticeChoice, Options, SetInput, SetOrder, SetReport, Source, encode_set};
use unweld::formats::{self, Coordinates};
use unweld::mesh::topology::Weld;

/// Pack meshes that are levels of detail of one thing into one file: each by itself or by the vertices that it shares with its neighbour
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// The meshes (PLY, OBJ, STL, OFF or glTF, also gzip-compressed, or .uwm); the one with most triangles is member 0. Of a glTF whose
    /// nodes have levels of detail (MSFT_lod) each level is one
    #[arg(value_name = "IN", required = true)]
    inputs: Vec<PathBuf>,
    /// The file to write, - for standard output
    #[arg(short, long, value_name = "SET.uwm")]
    output: PathBuf,
    #[command(flatten)]
    packing: Packing,
    /// What a file cannot keep of an input is an error, and nothing is written
    #[arg(long)]
    strict: bool,
    /// Most memory to use for each input, in bytes or with a suffix K, M, G
    #[arg(long, value_name = "M", value_parser = size, default_value = "4G")]
    max_memory: u64,
    /// One JSON object on standard output instead of text
    #[arg(long)]
    json: bool,
    /// Nothing but errors
    #[arg(long, short)]
    quiet: bool,
}

/// How to pack.
#[derive(Clone, Debug, clap::Args)]
pub struct Packing {
    /// The finest first in the file: fewer bytes in all, nothing to see before it is there
    #[arg(long, conflicts_with = "stream")]
    small: bool,
    /// The coarsest first in the file, for who shows it while it loads; so it is where neither is given
    #[arg(long)]
    stream: bool,
    /// Every member has the coordinates of its input, bit for bit
    #[arg(long)]
    exact: bool,
    #[command(flatten)]
    lattice: lattice::Choice,
}

impl Packing {
    /// The lattice, for the library.
    pub fn lattice(&self) -> (u32, LatticeChoice) {
        self.lattice.of_library()
    }

    /// Whether coordinates come back bit for bit.
    pub fn is_exact(&self) -> bool {
        self.exact
    }
}

/// Runs the command.
///
/// # Errors
/// Those of reading, encoding and writing.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let output = Output::new(&args.output, args.inputs.iter().map(|input| &**input))?;
    if args.json && output.is_stream() {
        return Err(Usage("--json and -o - both want standard output".to_owned()).into());
    }
    let mut progress = Progress::new(args.quiet);
    let reading =
        Reading { max_memory: args.max_memory, force: false, scenes: false, painted: false, detail: None };
    let (mut sources, mut names) = (Vec::new(), Vec::new());
    for input in &args.inputs {
        let meshes = Mesh::read_all(input, reading, &mut progress)?;
        let (whole, own, count) = (input::name(input), input::file_name(input), meshes.len());
        for (k, Mesh { source, level, .. }) in meshes.into_iter().enumerate() {
            let of = |name: &str| if count > 1 { format!("{name}, level {k}") } else { name.to_owned() };
            let name = of(&whole);
            if args.strict && !source.dropped.is_empty() {
                bail!("{name}: --strict: a file cannot keep {}", source.dropped.join(", "));
            }
            if !source.dropped.is_empty() {
                note(&format!("{name}: dropped {}", source.dropped.join(", ")));
            }
            for text in level.and_then(|level| level.lost).into_iter().chain(source.remarks.clone()) {
                remark(args.quiet, &format!("{name}: {text}"));
            }
            sources.push(source);
            names.push(of(&own));
        }
    }
    let Packed { file, report } = packed(sources, &names, &args.packing, args.max_memory, &mut progress)?;
    drop(progress);
    output.write(|out| out.write_all(&file))?;
    if args.json {
        return say(&format!("{:#}\n", json(&file, &report, &names)?));
    }
    if args.quiet {
        return Ok(());
    }
    output.say(&text(&output.name, &file, &report)?)
}

/// A set in memory.
pub struct Packed {
    /// The file.
    pub file: Vec<u8>,
    /// What the encoder tells.
    pub report: SetReport,
}

/// Packs meshes; `names` are theirs, for the metadata.
///
/// # Errors
/// Those of the encoder.
pub fn packed(
    sources: Vec<formats::Source>,
    names: &[String],
    packing: &Packing,
    max_memory: u64,
    progress: &mut Progress,
) -> anyhow::Result<Packed> {
    let input = |(source, name): (formats::Source, &String)| {
        let float32 = source.coordinates == Coordinates::Float32;
        let real = if float32 { Real::Binary32 } else { Real::Binary64 };
        SetInput {
            mesh: source.mesh,
            source: Source { name: name.clone(), dropped: source.dropped, float32, settings: Vec::new() },
            exact: packing.exact.then_some(real),
        }
    };
    let inputs: Vec<SetInput> = sources.into_iter().zip(names).map(input).collect();
    let (position_bits, lattice) = packing.lattice();
    let options = Options { position_bits, lattice, weld: Weld::Exact, max_memory, ..Options::default() };
    let order = if packing.small { SetOrder::Small } else { SetOrder::Stream };
    let mut file = Vec::new();
    let mut tell = |done, total| {
        progress.update("pack", done, total);
        true
    };
    let report = encode_set(&inputs, order, &options, &mut tell, &mut file).context("pack")?;
    Ok(Packed { file, report })
}

/// What came of it.
///
/// # Errors
/// Where the file cannot be read again.
pub fn text(name: &str, file: &[u8], report: &SetReport) -> anyhow::Result<String> {
    let uwm = Uwm::in_memory(file.to_vec(), name)?;
    let Some(set) = &uwm.set else { bail!("{name}: no set") };
    let alone: u64 = report.members.iter().map(|member| member.alone).sum();
    let bytes = count(file.len() as u64, "byte");
    let share = significant(file.len() as f64 / alone.max(1) as f64, 3);
    let (summary, table) = (set.summary(), set.table());
    Ok(format!(
        "{name}\n{summary}\n{table}\n  file       {bytes}, {share} of the {} that the members are as files of their own\n",
        grouped(alone)
    ))
}

/// The same for programs.
///
/// # Errors
/// Where the file cannot be read again.
pub fn json(file: &[u8], report: &SetReport, names: &[String]) -> anyhow::Result<Value> {
    let uwm = Uwm::in_memory(file.to_vec(), "set")?;
    let Some(set) = &uwm.set else { bail!("no set") };
    let mut object = set.described();
    let inputs = report.members.iter().map(|member| {
        json!({ "input": names.get(member.input), "bytes_alone": member.alone, "dropped": member.report.dropped })
    });
    if let Value::Object(map) = &mut object {
        map.insert("inputs".to_owned(), Value::Array(inputs.collect()));
    }
    Ok(object)
}

const EXAMPLES: &str = "\
EXAMPLES
  unweld pack lod0.ply lod1.ply lod2.ply -o lods.uwm
  unweld pack lod*.obj -o lods.uwm --small --position-bits 12
  unweld pack lod*.glb -o lods.uwm --exact
  unweld pack lods.glb -o lods.uwm                 all levels of its MSFT_lod
  unweld info lods.uwm
  unweld unpack lods.uwm -o lods/

For levels that come from elsewhere, as files that engines want. Whoever has the fine mesh alone is better served by `unweld encode`:
all levels of such a file together are about as long as its finest mesh alone is here.";
