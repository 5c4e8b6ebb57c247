//! `unweld demo`: what it does, on a mesh of its own making: encodes, verifies and draws it, and shows it in a browser.

use super::describe::Description;
use super::encode::{self, Encoded};
use super::numbers::{count, grouped};
use super::original;
use super::output::{MeshFormat, Output, say};
use super::page::{self, Page};
use super::progress::Progress;
use super::uwm::Uwm;
use super::verify;
use super::view;
use anyhow::Context;
use std::fs;
use std::io::IsTerminal;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use unweld::container::Contents;
use unweld::encoder::{Keyframes, Options};
use unweld::formats::{Coordinates, Format, Source};
use unweld::mesh::{IndexedMesh, shapes};
use unweld::render::View;

/// Make a mesh, encode it, verify it, draw three of its levels, and show it in a browser
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// The folder for the files
    #[arg(short, long, value_name = "DIR", default_value = "unweld-demo")]
    output: PathBuf,
    /// End once all of it has been checked, instead of serving the page until Ctrl-C; so it does also where there is neither a terminal
    /// nor a screen, without one of the next two
    #[arg(long)]
    once: bool,
    /// Serve the page, but open no browser
    #[arg(long, conflicts_with = "once")]
    no_open: bool,
    /// The address of the page [default: 127.0.0.1:8080, or another port where that is taken]
    #[arg(long, value_name = "ADDRESS")]
    addr: Option<SocketAddr>,
    /// No progress bar
    #[arg(long, short)]
    quiet: bool,
}

/// Runs the command.
///
/// # Errors
/// Those of writing and of serving.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let folder = &args.output;
    fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    let output = |name: &str| Output::new(&folder.join(name), []);
    let outputs = [output("demo.ply")?, output("demo.uwm")?, output("demo.png")?];
    let [ply, uwm_file, picture] = &outputs;

    let mesh = shapes::bumpy_sphere(SUBDIVISIONS, SEED);
    ply.write(|out| MeshFormat::Ply.write(&mesh, None, out))?;
    let triangles = count(mesh.triangles.len() as u64, "triangle");
    say(&format!("Made a mesh of {triangles}: {}\n\n", ply.name))?;

    let mut progress = Progress::new(args.quiet);
    let source = Source {
        mesh,
        format: Format::Ply,
        polygons: 0,
        coordinates: Coordinates::Float64,
        text: false,
        dropped: vec![],
        remarks: vec![],
        scene: None,
    };
    let options = Options { keyframes: Keyframes::Levels(KEYFRAMES.to_vec()), ..Options::default() };
    let encoded = encode::encode(&source, Path::new("demo.ply"), options, vec![], &mut progress)?;
    let Encoded { file, report } = encoded;
    uwm_file.write(|out| out.write_all(&file))?;
    let mut uwm = Uwm::in_memory(file.clone(), &uwm_file.name)?;
    let description = Description::new(&mut uwm, report.residue)?;
    say(&format!("Encoded it: {}\n{}\n", uwm_file.name, encode::report_text(&description, &report)))?;

    let mut lines = vec!["Verified it:".to_owned()];
    let decoded = verify::check(&mut uwm, &mut progress, &mut lines)?;
    original::compare(&mut uwm, &decoded, &source.mesh, &ply.name, &mut lines)?;
    say(&format!("{}\n\n", lines.join("\n  ")))?;

    let levels = shown(&uwm.contents);
    let meshes = view::levels(&mut uwm, &levels, &mut progress)?;
    let shown: Vec<&IndexedMesh> = levels.iter().filter_map(|level| meshes.get(level)).collect();
    let view = View {
        width: 2100,
        height: 720,
        turn_degrees: view::TURN,
        tilt_degrees: view::TILT,
        wireframe: true,
        ..View::default()
    };
    view::draw(&shown, &view, picture, &mut progress)?;
    drop(progress);
    let counts: Vec<String> = shown.iter().map(|mesh| grouped(mesh.triangles.len() as u64)).collect();
    let (name, unweld) = (&uwm_file.name, called());
    say(&format!(
        "Drew its levels of {} triangles: {}\n\nNow try\n  {unweld} info {name}\n  \
         {unweld} view {name}\n  \
         {unweld} decode {name} -o coarse.obj --triangles 2000\n  \
         {unweld} decode {name} -o early.ply --prefix-bytes 20K\n\n",
        counts.join(", "),
        picture.name,
    ))?;
    let page = Page { folder, mesh: "demo.uwm", bytes: &file, address: args.addr };
    let seen = page::may_open() || std::io::stdout().is_terminal();
    let stay = !args.once && (seen || args.no_open || args.addr.is_some());
    page.show(stay, stay && !args.no_open && page::may_open())?;
    if !stay && !args.once {
        say(
            "There is neither a terminal nor a screen to look at it: --no-open would have gone on serving it\n",
        )?;
    }
    Ok(())
}

/// How the user calls this program: by its name, if the shell finds it; else as it was called now.
fn called() -> String {
    let name = format!("unweld{}", std::env::consts::EXE_SUFFIX);
    let folders = std::env::var_os("PATH").unwrap_or_default();
    if std::env::split_paths(&folders).any(|folder| folder.join(&name).is_file()) {
        return "unweld".to_owned();
    }
    match std::env::var_os("CARGO_MANIFEST_DIR") {
        Some(_) if cfg!(debug_assertions) => "cargo run --".to_owned(),
        Some(_) => "cargo run --release --".to_owned(),
        None => std::env::args_os().next().map_or(name, |called| called.to_string_lossy().into_owned()),
    }
}

/// Three levels whose sizes are far apart, coarse to fine.
fn shown(contents: &Contents) -> Vec<u32> {
    let far = |triangles: u32, wanted: f64| (f64::from(triangles.max(1)) / wanted).ln().abs();
    let next_to = |wanted: f64| {
        let levels = (0..=contents.base_level()).zip(&contents.levels);
        let nearest =
            levels.min_by(|(_, x), (_, y)| far(x.triangles, wanted).total_cmp(&far(y.triangles, wanted)));
        nearest.map_or(0, |(number, _)| number)
    };
    let finest = f64::from(contents.header.triangles);
    vec![next_to(finest / 64.0), next_to(finest / 8.0), 0]
}

/// 81,920 triangles.
const SUBDIVISIONS: u32 = 6;
const SEED: u64 = 4;
const KEYFRAMES: [u32; 2] = [8, 14];

const EXAMPLES: &str = "\
EXAMPLES
  unweld demo                      everything, then the page in a browser until Ctrl-C
  unweld demo --no-open            the same without opening a browser: its address is told
  unweld demo --once               all checks, then the end";
