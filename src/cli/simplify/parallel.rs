//! Many vertices removed at once, as one viewer sees the mesh, or as a camera that walks round it does.

use super::device::{Choice, PROCESSOR};
use super::reduction::{left_out, welded};
use super::{Limit, Outcome};
use crate::cli::args::{Point, Removal, above_zero, point};
use crate::cli::failure::Usage;
use crate::cli::numbers::{count, grouped};
use crate::cli::progress::Progress;
use anyhow::bail;
use clap::ValueEnum;
use serde_json::{Value, json};
use std::time::Instant;
use unweld::formats::Source;
use unweld::mesh::{IndexedMesh, lattice};
use unweld::reduce::removal::{self, Options, Simplified, Surface, View};

/// How vertices are removed in parallel.
#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Parallel removal (--method parallel)")]
pub struct Parallel {
    /// Edges from one vertex that always stays to the next, 1 to 255: the more, the coarser; 3 where not given
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=255))]
    spacing: Option<u32>,
    /// Whose rule says what may go where: 2016 where not given
    #[arg(long, value_name = "YEAR")]
    rule: Option<Rule>,
    /// What keeps moves from each other's way: veto where not given
    #[arg(long, value_enum)]
    guard: Option<Guard>,
    #[command(flatten)]
    device: Choice,
    /// Threads: as many as there are processors where not given; the mesh is the same
    #[arg(long, value_name = "T", value_parser = clap::value_parser!(u32).range(1..=1024))]
    threads: Option<u32>,
    /// Where the viewer's eye is, in the units of the mesh; it looks at the middle of the bounding box
    #[arg(long, value_name = "X,Y,Z", value_parser = point, allow_hyphen_values = true)]
    eye: Option<Point>,
    /// Largest error that the viewer may see, in pixels, above 0: 1 where not given
    #[arg(long, value_name = "P", value_parser = above_zero)]
    pixels: Option<f64>,
    /// Height of the picture in pixels: 1080 where not given
    #[arg(long, value_name = "H", value_parser = above_zero)]
    height: Option<f64>,
    /// Angle of the view from bottom to top, in degrees, above 0 and below 180: 60 where not given
    #[arg(long, value_name = "F", value_parser = angle)]
    fov: Option<f64>,
    /// Walk the eye round the mesh, about the axis y, in 1 to 100,000 frames, and tell of each; the last one is what is written. Without --eye
    /// it starts in front of the mesh, 1.5 diagonals away
    #[arg(long, value_name = "K", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    orbit: Option<u32>,
}

/// A paper's rule.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Rule {
    /// Vertices go beside one that stays, and to one that stays
    #[value(name = "2015")]
    Of2015,
    /// Vertices go beside one that stays or an auxiliary one, and to any that does not go itself
    #[value(name = "2016")]
    Of2016,
}

/// What keeps moves apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Guard {
    /// Moves that do not go together are called off: the fewest iterations
    Veto,
    /// No move is made that could be in another's way, as in the papers
    Blind,
    /// Of neighbours the cheapest goes: many iterations, nearer to the input
    Independent,
}

/// One view of the mesh.
#[derive(Debug)]
pub struct Frame {
    eye: Option<[f64; 3]>,
    /// What has computed it.
    device: String,
    simplified: Simplified,
    vertices: usize,
    milliseconds: f64,
}

impl Parallel {
    /// Refuses what no other method knows.
    ///
    /// # Errors
    /// [`Usage`] where one is given.
    pub fn refuse(&self, method: &str) -> anyhow::Result<()> {
        let given = [
            ("--spacing", self.spacing.is_some()),
            ("--rule", self.rule.is_some()),
            ("--guard", self.guard.is_some()),
            ("--device", self.device.is_given()),
            ("--threads", self.threads.is_some()),
            ("--eye", self.eye.is_some()),
            ("--pixels", self.pixels.is_some()),
            ("--height", self.height.is_some()),
            ("--fov", self.fov.is_some()),
            ("--orbit", self.orbit.is_some()),
        ];
        match given.iter().find(|(_, is_given)| *is_given) {
            Some((name, _)) => Err(Usage(format!("{name} is of no use with --method {method}")).into()),
            None => Ok(()),
        }
    }

    /// The views, `None` for none.
    fn views(&self, mesh: &IndexedMesh) -> anyhow::Result<Vec<Option<View>>> {
        let eye = self.eye.map(|Point(eye)| eye);
        let given = [("--pixels", self.pixels), ("--height", self.height), ("--fov", self.fov)];
        if eye.is_none() && self.orbit.is_none() {
            return match given.iter().find(|(_, value)| value.is_some()) {
                Some((name, _)) => Err(Usage(format!("{name} is of no use without --eye or --orbit")).into()),
                None => Ok(vec![None]),
            };
        }
        let used = mesh.triangles.iter().flatten().map(|&v| mesh.positions[v as usize]);
        let (min, max) = lattice::bounds(used).unwrap_or_default();
        let middle: [f64; 3] = std::array::from_fn(|k| min[k] + (max[k] - min[k]) / 2.0);
        let eye = eye.unwrap_or([middle[0], middle[1], middle[2] + 1.5 * mesh.diagonal()]);
        let frames = self.orbit.unwrap_or(1);
        let view = |frame: u32| {
            // The last one stands where the walk began.
            let (sine, cosine) = match frame == frames {
                true => (0.0, 1.0),
                false => (f64::from(frame) / f64::from(frames) * std::f64::consts::TAU).sin_cos(),
            };
            let [x, z] = [eye[0] - middle[0], eye[2] - middle[2]];
            let eye = [middle[0] + cosine * x + sine * z, eye[1], middle[2] + cosine * z - sine * x];
            let [pixels, height, fov] = [(self.pixels, 1.0), (self.height, 1080.0), (self.fov, 60.0)]
                .map(|(given, otherwise)| given.unwrap_or(otherwise));
            Some(View { eye, pixels, height, fov })
        };
        Ok((1..=frames).map(view).collect())
    }

    fn options(&self) -> Options {
        Options {
            rule: match self.rule {
                Some(Rule::Of2015) => removal::Rule::Of2015,
                Some(Rule::Of2016) | None => removal::Rule::Of2016,
            },
            guard: match self.guard {
                Some(Guard::Blind) => removal::Guard::Blind,
                Some(Guard::Independent) => removal::Guard::Independent,
                Some(Guard::Veto) | None => removal::Guard::Veto,
            },
            threads: self.threads.map_or(0, |threads| threads as usize),
        }
    }
}

/// Removes vertices for each view.
///
/// # Errors
/// [`Usage`] for options of other methods and for goals; where there is no GPU and it is asked for; those of the library.
pub fn removed(
    source: &Source,
    goal: Option<Limit>,
    parallel: &Parallel,
    removal: &Removal,
    progress: &mut Progress,
) -> anyhow::Result<Outcome> {
    if goal.is_some() {
        let message = "--method parallel has no goal but what a viewer sees (--eye, --pixels) and --spacing";
        return Err(Usage(message.to_owned()).into());
    }
    let others = [
        ("--alpha", removal.alpha.is_some()),
        ("--beta", removal.beta.is_some()),
        ("--lock-boundary", removal.lock_boundary),
    ];
    if let Some((name, _)) = others.iter().find(|(_, is_given)| *is_given) {
        return Err(Usage(format!("{name} is of no use with --method parallel")).into());
    }
    let start = Instant::now();
    let (mesh, _, joined_vertices) = welded(&source.mesh, removal.weld);
    let views = parallel.views(&mesh)?;
    let surface = Surface::new(&mesh, parallel.spacing.unwrap_or(SPACING))?;
    if surface.triangles().is_empty() {
        bail!("no triangle is left: all are degenerate");
    }
    let mut remarks = Vec::new();
    let device = parallel.device.open(&mut remarks)?;
    let mut loading = device.load(&surface)?;
    let conditioning = start.elapsed().as_secs_f64();
    let mut frames = Vec::new();
    for (k, view) in views.iter().enumerate() {
        progress.update("simplify", k as u64, views.len() as u64);
        let start = Instant::now();
        let simplified = loading.simplify(view.as_ref(), parallel.options())?;
        let milliseconds = start.elapsed().as_secs_f64() * 1e3;
        let vertices = surface.mesh(&simplified.triangles).positions.len();
        let device = device.name().to_owned();
        frames.push(Frame { eye: view.map(|view| view.eye), device, simplified, vertices, milliseconds });
    }
    let last = frames.last().map(|frame| surface.mesh(&frame.simplified.triangles)).unwrap_or_default();
    let locked = surface.locked().iter().filter(|&&locked| locked).count();
    if locked > 0 {
        let stay = if locked == 1 { "stays" } else { "stay" };
        remarks.push(format!(
            "{} {stay}, since there the surface is no manifold or a vertex has more than 255 triangles",
            count(locked as u64, "vertex")
        ));
    }
    Ok(Outcome {
        mesh: last,
        left_out: left_out(&source.mesh, &mesh, &surface.left_out()),
        joined_vertices,
        conditioning,
        obstacle: String::new(),
        passes: frames.last().map(|frame| frame.simplified.iterations.len()),
        parents: None,
        remarks,
        frames,
    })
}

/// What each frame was like, for people.
pub fn text(frames: &[Frame]) -> String {
    let mut text = String::new();
    if let Some(Frame { device, .. }) =
        frames.first().filter(|frame| frames.len() > 1 || frame.device != PROCESSOR)
    {
        text += &format!("  {:<11}{device}\n", "device");
    }
    for (k, frame) in frames.iter().enumerate() {
        let name = if frames.len() == 1 { "removal".to_owned() } else { format!("frame {}", k + 1) };
        let Simplified { triangles, iterations } = &frame.simplified;
        let list = iterations
            .iter()
            .map(|i| format!("{} -> {}", grouped(i.candidates as u64), grouped(i.removed as u64)));
        text += &format!(
            "  {name:<11}{:.1} ms, {}, {}, {}: candidates -> removed {}\n",
            frame.milliseconds,
            count(frame.vertices as u64, "vertex"),
            count(triangles.len() as u64, "triangle"),
            count(iterations.len() as u64, "iteration"),
            list.collect::<Vec<_>>().join(", ")
        );
    }
    text
}

/// What each frame was like, for programs.
pub fn object(frames: &[Frame]) -> Value {
    let frame = |frame: &Frame| {
        let iterations = frame
            .simplified
            .iterations
            .iter()
            .map(|i| json!({ "candidates": i.candidates, "proposed": i.proposed, "removed": i.removed }));
        json!({
            "eye": frame.eye,
            "device": frame.device,
            "milliseconds": frame.milliseconds,
            "vertices": frame.vertices,
            "triangles": frame.simplified.triangles.len(),
            "iterations": iterations.collect::<Vec<_>>(),
        })
    };
    frames.iter().map(frame).collect()
}

/// An angle above 0 and below 180.
fn angle(text: &str) -> Result<f64, String> {
    above_zero(text)
        .ok()
        .filter(|degrees| *degrees < 180.0)
        .ok_or_else(|| "an angle above 0 and below 180".to_owned())
}

/// Edges between vertices that stay, where nothing is said of it.
const SPACING: u32 = 3;
