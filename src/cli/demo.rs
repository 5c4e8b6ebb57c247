//! `unweld demo`: what it does, on a mesh and a scene of its own making: encodes, verifies and draws them, and shows them in a browser.

use super::describe::Description;
use super::encode::{self, Encoded};
use super::numbers::{count, grouped};
use super::original;
use super::output::{MeshFormat, Output, say};
use super::page::{self, Page};
use super::progress::Progress;
use super::scene;
use super::scenes;
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
use unweld::formats::{Coordinates, Format, ReadOptions, Source, read_with, sample_scene};
use unweld::mesh::shapes;
use unweld::render::{Model, View};

/// Make a mesh and a scene with pictures, encode, verify and draw both at three levels, and show them in a browser
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
    let mut progress = Progress::new(args.quiet);

    let ply = output("demo.ply")?;
    let mesh = shapes::bumpy_sphere(SUBDIVISIONS, SEED);
    ply.write(|out| MeshFormat::Ply.write(&mesh, None, out))?;
    let triangles = count(mesh.triangles.len() as u64, "triangle");
    say(&format!("Made a mesh of {triangles}: {}\n\n", ply.name))?;
    let source = Source::new(mesh, Format::Ply, Coordinates::Float64);
    let mesh = Shown { original: &ply, uwm: output("demo.uwm")?, picture: output("demo.png")? };
    let options = Options { keyframes: Keyframes::Levels(KEYFRAMES.to_vec()), ..Options::default() };
    let mesh_file = mesh.show(&source, options, &mut progress)?;

    let glb = output("demo-scene.glb")?;
    let bytes = sample_scene(SCENE_DETAIL);
    glb.write(|out| out.write_all(&bytes))?;
    let mut reading = ReadOptions::default();
    (reading.format, reading.scenes) = (Some(Format::Gltf), true);
    let source = read_with(&bytes, &reading).with_context(|| glb.name.clone())?;
    let triangles = count(source.mesh.triangles.len() as u64, "triangle");
    say(&format!("\nMade a scene of {triangles}, with pictures: {}\n\n", glb.name))?;
    let scene = Shown { original: &glb, uwm: output(SCENE)?, picture: output("demo-scene.png")? };
    let options = Options { attribute_births: scene::births(vec![]), ..Options::default() };
    let scene_file = scene.show(&source, options, &mut progress)?;
    drop(progress);

    let (name, scene, unweld) = (&mesh.uwm.name, &scene.uwm.name, called());
    say(&format!(
        "\nNow try\n  {unweld} info {name}\n  \
         {unweld} view {name}\n  \
         {unweld} view {scene} --level 4 --turn 0,120,240\n  \
         {unweld} decode {name} -o coarse.obj --triangles 2000\n  \
         {unweld} decode {name} -o early.ply --prefix-bytes 20K\n\n",
    ))?;
    let files = [(SCENE, &scene_file[..]), ("demo.uwm", &mesh_file)];
    let page = Page { folder, files: &files, address: args.addr };
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

/// What is shown of a mesh or a scene, and where.
struct Shown<'a> {
    original: &'a Output,
    uwm: Output,
    picture: Output,
}

impl Shown<'_> {
    /// Encodes, verifies and draws it; returns the file.
    fn show(&self, source: &Source, options: Options, progress: &mut Progress) -> anyhow::Result<Vec<u8>> {
        let Encoded { file, report } =
            encode::encode(source, Path::new(&self.original.name), options, vec![], progress)?;
        self.uwm.write(|out| out.write_all(&file))?;
        let mut uwm = Uwm::in_memory(file.clone(), &self.uwm.name)?;
        let description = Description::new(&mut uwm, report.residue)?;
        say(&format!("Encoded it: {}\n{}\n", self.uwm.name, encode::report_text(&description, &report)))?;

        let mut lines = vec!["Verified it:".to_owned()];
        let decoded = verify::check(&mut uwm, progress, &mut lines)?;
        original::compare(&mut uwm, &decoded, &source.mesh, &self.original.name, &mut lines)?;
        if source.scene.is_some() {
            scenes::compare(&mut uwm, source, &self.original.name, &mut lines)?;
        }
        say(&format!("{}\n\n", lines.join("\n  ")))?;

        let levels = shown(&uwm.contents, if source.scene.is_some() { 4.0 } else { 8.0 });
        let drawn = view::levels(&mut uwm, &levels, false, progress)?;
        let models: Vec<Model> = levels.iter().filter_map(|level| Some(drawn.get(level)?.model())).collect();
        let view = View {
            width: 2100,
            height: 720,
            turn_degrees: view::TURN,
            tilt_degrees: view::TILT,
            wireframe: source.scene.is_none(),
            ..View::default()
        };
        view::draw(&models, &[view], &self.picture, progress)?;
        let counts: Vec<String> = levels
            .iter()
            .filter_map(|level| drawn.get(level))
            .map(|drawn| grouped(drawn.mesh.triangles.len() as u64))
            .collect();
        say(&format!("Drew its levels of {} triangles: {}\n", counts.join(", "), self.picture.name))?;
        Ok(file)
    }
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

/// Three levels, coarse to fine, each about so many times as large as the one before.
fn shown(contents: &Contents, times: f64) -> Vec<u32> {
    let far = |triangles: u32, wanted: f64| (f64::from(triangles.max(1)) / wanted).ln().abs();
    let next_to = |wanted: f64| {
        let levels = (0..=contents.base_level()).zip(&contents.levels);
        let nearest =
            levels.min_by(|(_, x), (_, y)| far(x.triangles, wanted).total_cmp(&far(y.triangles, wanted)));
        nearest.map_or(0, |(number, _)| number)
    };
    let finest = f64::from(contents.header.triangles);
    vec![next_to(finest / (times * times)), next_to(finest / times), 0]
}

/// The first file of the list that the page has: so it is shown first.
const SCENE: &str = "demo-scene.uwm";
/// Of the scene: some 11,000 triangles to store.
const SCENE_DETAIL: f64 = 0.6;
/// 81,920 triangles.
const SUBDIVISIONS: u32 = 6;
const SEED: u64 = 4;
const KEYFRAMES: [u32; 2] = [8, 14];

const EXAMPLES: &str = "\
EXAMPLES
  unweld demo                      everything, then the page in a browser until Ctrl-C
  unweld demo --no-open            the same without opening a browser: its address is told
  unweld demo --once               all checks, then the end";
