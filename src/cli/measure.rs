//! `unweld measure`: how far two surfaces lie from each other, as Metro measures it (Cignoni, Rocchini, Scopigno 1998).

use super::args::{is_stream, size};
use super::failure::Usage;
use super::input::{self, Input, Reading};
use super::numbers::{count, grouped, percent, significant, table};
use super::output::say;
use super::progress::Progress;
use super::shown::placed;
use anyhow::bail;
use serde_json::{Value, json};
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use unweld::mesh::distance::{Sampling, SurfaceDistance, surface_distances};
use unweld::mesh::{IndexedMesh, lattice};

/// Measure how far two surfaces lie from each other, both ways: mean, root mean square, maximum
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// The mesh whose diagonal is 100 %: PLY, OBJ, STL, OFF or glTF, also gzip-compressed, or .uwm; - for standard input
    #[arg(value_name = "A")]
    a: PathBuf,
    /// The other mesh, as A; one of them may be standard input
    #[arg(value_name = "B")]
    b: PathBuf,
    /// Level of B, which is a .uwm file: 0, the finest, where not given, to the base's
    #[arg(long, value_name = "J")]
    level: Option<u32>,
    /// Points spread evenly over the area of each surface, 1 to 2^40, for mean and rms; all vertices are measured besides, for the
    /// maximum. A million gives mean and rms to about 0.1 %
    #[arg(long, value_name = "N", default_value_t = Sampling::default().samples,
          value_parser = clap::value_parser!(u64).range(1..=MOST_SAMPLES))]
    samples: u64,
    /// Seed of the random points, 0 to 2^64 - 1
    #[arg(long, value_name = "S", default_value_t = 0)]
    seed: u64,
    /// Threads, 1 or more, all cores where not given; the result does not depend on them
    #[arg(long, value_name = "N")]
    threads: Option<NonZeroUsize>,
    /// One JSON object instead of text
    #[arg(long)]
    json: bool,
    /// No progress bar
    #[arg(long, short)]
    quiet: bool,
    /// Most memory to use for decoding, in bytes or with a suffix K, M, G
    #[arg(long, value_name = "M", value_parser = size, default_value = "4G")]
    max_memory: u64,
}

/// A mesh to measure.
struct Measured {
    /// With its level, if it has any.
    name: String,
    level: Option<u32>,
    mesh: IndexedMesh,
    diagonal: f64,
}

/// Runs the command.
///
/// # Errors
/// Those of reading and decoding; where a length is beyond all numbers.
pub fn run(args: &Args) -> anyhow::Result<()> {
    if is_stream(&args.a) && is_stream(&args.b) {
        return Err(Usage("A and B cannot both be standard input".to_owned()).into());
    }
    let mut progress = Progress::new(args.quiet);
    let a = read(&args.a, None, args.max_memory, &mut progress)?;
    let b = read(&args.b, args.level, args.max_memory, &mut progress)?;
    let defaults = Sampling::default();
    let threads = args.threads.unwrap_or(defaults.threads);
    let sampling = Sampling { samples: args.samples, seed: args.seed, threads };
    let mut on_progress = |done, total| progress.update("measure", done, total);
    // Every reader refuses a mesh without triangles, but a level may have none.
    let Some(distances) = surface_distances(&a.mesh, &b.mesh, &sampling, &mut on_progress) else {
        let empty = if a.mesh.triangles.is_empty() { &a.name } else { &b.name };
        bail!("{empty}: no triangles");
    };
    drop(progress);
    let symmetric = SurfaceDistance::symmetric(distances);
    if !symmetric.max.is_finite() {
        bail!("{}, {}: they are farther apart than the largest number", a.name, b.name);
    }
    let [there, back] = distances;
    let lines =
        [("a_to_b", "A to B", there), ("b_to_a", "B to A", back), ("symmetric", "symmetric", symmetric)];
    if args.json {
        let mut object = json!({ "diagonal": a.diagonal, "a": a.json(), "b": b.json() });
        for (key, _, distance) in lines {
            object[key] = distance_json(&distance, a.diagonal);
        }
        return say(&format!("{object:#}\n"));
    }
    let mut text = format!("A  {}\nB  {}\n\n", a.text(), b.text());
    let heads = ["", "samples", "vertices", "mean", "rms", "max", "mean %", "rms %", "max %"];
    let mut cells = vec![heads.map(str::to_owned).to_vec()];
    cells.extend(lines.map(|(_, head, distance)| line(head, &distance, a.diagonal)));
    text += &table(&cells);
    text += &format!("\n  % of the diagonal of A, {}\n", significant(a.diagonal, 6));
    say(&text)
}

impl Measured {
    fn new(name: String, level: Option<u32>, mesh: IndexedMesh) -> anyhow::Result<Self> {
        let diagonal = diagonal(&mesh);
        if !diagonal.is_finite() {
            bail!("{name}: the mesh is larger than the largest number: its extent is infinite");
        }
        Ok(Self { name, level, mesh, diagonal })
    }

    fn text(&self) -> String {
        let vertices = count(self.mesh.positions.len() as u64, "vertex");
        let level = self.level.map_or_else(String::new, |level| format!(", level {level}"));
        format!("{}{level}: {vertices}, {}", self.name, count(self.mesh.triangles.len() as u64, "triangle"))
    }

    fn json(&self) -> Value {
        json!({
            "vertices": self.mesh.positions.len(),
            "triangles": self.mesh.triangles.len(),
            "level": self.level,
        })
    }
}

/// Reads a mesh of any format; `level` is one of a `.uwm` file.
fn read(path: &Path, level: Option<u32>, memory: u64, progress: &mut Progress) -> anyhow::Result<Measured> {
    let name = input::name(path);
    match Input::open(
        path,
        Reading { max_memory: memory, force: false, scenes: false, painted: false, detail: None },
    )? {
        Input::Levels(mut uwm) => {
            let level = level.unwrap_or(0);
            let own = uwm.enter(level, progress)?;
            let (mesh, _) = placed(&uwm.level(own, progress)?, memory)?;
            Measured::new(name, Some(level), mesh)
        }
        Input::Mesh(..) if level.is_some() => Err(input::without_levels(path).into()),
        Input::Mesh(source, _) => Measured::new(name, None, source.mesh),
    }
}

/// The diagonal of the bounding box of the vertices that triangles use, also where its square is no number.
fn diagonal(mesh: &IndexedMesh) -> f64 {
    let corners = mesh.triangles.iter().flatten().map(|&v| mesh.positions[v as usize]);
    let (min, max) = lattice::bounds(corners).unwrap_or_default();
    (0..3).fold(0.0, |sum: f64, k| sum.hypot(max[k] - min[k]))
}

fn distance_json(distance: &SurfaceDistance, diagonal: f64) -> Value {
    let SurfaceDistance { mean, rms, max, samples, vertices } = *distance;
    json!({
        "mean": mean,
        "rms": rms,
        "max": max,
        "mean_percent": percent(mean, diagonal),
        "rms_percent": percent(rms, diagonal),
        "max_percent": percent(max, diagonal),
        "samples": samples,
        "vertices": vertices,
    })
}

/// Points, lengths, and lengths in percent.
fn line(head: &str, distance: &SurfaceDistance, diagonal: f64) -> Vec<String> {
    let lengths = [distance.mean, distance.rms, distance.max];
    let relative = |x: f64| percent(x, diagonal).map_or_else(|| "-".to_owned(), |x| significant(x, 4));
    let mut cells = vec![head.to_owned(), grouped(distance.samples), grouped(distance.vertices)];
    cells.extend(lengths.map(|x| significant(x, 4)));
    cells.extend(lengths.map(relative));
    cells
}

/// Beyond this they would take a month.
const MOST_SAMPLES: u64 = 1 << 40;

const EXAMPLES: &str = "\
EXAMPLES
  unweld measure bunny.ply small.ply
  unweld measure bunny.ply bunny.uwm --level 8
  unweld measure bunny.ply small.obj --samples 10000000 --threads 4
  unweld measure bunny.ply small.ply --json | jq .symmetric.rms_percent
  unweld decode bunny.uwm -o - --triangles 5000 | unweld measure bunny.ply -

A to B is how far the points of A lie from the nearest points of B; symmetric is the larger of both ways. The mean and rms
are over the area, the maximum is the largest distance met.";
