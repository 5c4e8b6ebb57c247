//! `unweld view`: a picture of a mesh, or of levels of a `.uwm` file side by side.

use super::args::{is_stream, size};
use super::drawn::Drawn;
use super::failure::{Usage, note};
use super::input::{self, Input, Reading};
use super::numbers::{count, grouped};
use super::output::{Output, remark, say};
use super::progress::Progress;
use super::shown;
use super::uwm::Uwm;
use anyhow::Context;
use clap::ValueEnum;
use serde_json::json;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;
use unweld::decoder::{Event, Until};
use unweld::render::{Model, Picture, SOFTWARE, Up, View, render_with, write_png};

/// Draw a mesh, or levels of a .uwm file side by side, as a PNG picture
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// A .uwm file or a mesh (PLY, OBJ, STL, OFF or glTF, also gzip-compressed), - for standard input
    #[arg(value_name = "IN")]
    input: PathBuf,
    /// The picture to write, .png, - for standard output; where not given, it goes beside IN, to IN.png
    #[arg(short, long, value_name = "OUT.png")]
    output: Option<PathBuf>,
    /// Without -o: replace a file of that name that is none of our pictures
    #[arg(long)]
    force: bool,
    /// Levels of a .uwm file, from left to right, from 0, the finest and the one drawn where none is named, to the base's
    #[arg(long, value_name = "J,…", value_delimiter = ',')]
    level: Vec<u32>,
    /// Most memory for decoding, in bytes or with a suffix K, M, G
    #[arg(long, value_name = "M", value_parser = size, default_value = "4G")]
    max_memory: u64,
    /// One JSON object on standard output instead of text
    #[arg(long)]
    json: bool,
    /// Nothing but errors
    #[arg(long, short)]
    quiet: bool,
    #[command(flatten)]
    look: Look,
}

/// What the picture looks like.
#[derive(clap::Args)]
#[command(next_help_heading = "Picture")]
struct Look {
    /// Pixels, 1 to 8192 each way; 800 a level, and as many down, where not given
    #[arg(long, value_name = "WxH", value_parser = pixels)]
    size: Option<(u32, u32)>,
    /// The axis that points upwards: y in most scans and models, z in CAD, printing and terrain
    #[arg(long, value_enum, default_value = "y")]
    up: Axis,
    /// Turn the mesh about the upward axis by any angle; positive brings its left side to the front. Several angles make rows of the picture
    #[arg(long, value_name = "DEGREES,…", default_values_t = [TURN], value_delimiter = ',', value_parser = angle, allow_negative_numbers = true)]
    turn: Vec<f64>,
    /// Tip the mesh forwards by any angle; positive shows it from above
    #[arg(long, value_name = "DEGREES", default_value_t = TILT, value_parser = angle, allow_negative_numbers = true)]
    tilt: f64,
    /// Draw the shape alone: without colours and normals of the mesh, and without the base colours and their textures that are drawn of
    /// materials
    #[arg(long)]
    plain: bool,
    /// Draw the edges too, where triangles are not too small for it
    #[arg(long)]
    wireframe: bool,
    /// Let colours run over edges that bend little; without it each triangle has one colour, unless it has normals
    #[arg(long)]
    smooth: bool,
    /// The colour behind the mesh, red, green and blue as in f5f5f3, or none for a transparent one
    #[arg(long, value_name = "RRGGBB", default_value = "f5f5f3", value_parser = colour)]
    background: Background,
}

#[derive(Clone, Copy, ValueEnum)]
enum Axis {
    X,
    Y,
    Z,
}

/// In sRGB; none for a transparent one.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Background(Option<[u8; 3]>);

/// Runs the command.
///
/// # Errors
/// Those of reading, decoding and writing, and where the file has no such level.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let output = output(args)?;
    if args.json && output.is_stream() {
        return Err(Usage("--json and -o - both want standard output".to_owned()).into());
    }
    let name = input::name(&args.input);
    let start = Instant::now();
    let mut progress = Progress::new(args.quiet);
    let (meshes, dropped) = meshes(args, &mut progress)?;
    let shown: Vec<(Option<u32>, &Drawn)> = match &args.level[..] {
        [] => meshes.iter().map(|(&level, mesh)| (level, mesh)).collect(),
        levels => levels.iter().filter_map(|&j| Some((Some(j), meshes.get(&Some(j))?))).collect(),
    };
    let read = start.elapsed().as_secs_f64();
    let models: Vec<Model> = shown.iter().map(|(_, drawn)| drawn.model()).collect();
    let views = args.look.views(models.len());
    let (picture, bytes) = draw(&models, &views, &output, &mut progress)?;
    let draw = start.elapsed().as_secs_f64() - read;
    drop(progress);

    let mut warnings: Vec<String> = shown.iter().flat_map(|(_, drawn)| drawn.remarks.clone()).collect();
    warnings.dedup();
    if picture.drawn.iter().all(|&n| n == 0) {
        warnings.push("no triangle has an area as seen from here: the picture is empty".to_owned());
    }
    if args.json {
        let shown = shown.iter().zip(&picture.drawn).map(|((level, Drawn { mesh, .. }), drawn)| {
            json!({
                "level": level,
                "vertices": mesh.positions.len(),
                "triangles": mesh.triangles.len(),
                "drawn": drawn,
            })
        });
        let object = json!({
            "output": output.name,
            "width": picture.width,
            "height": picture.height,
            "bytes": bytes,
            "meshes": shown.collect::<Vec<_>>(),
            "dropped": dropped,
            "warnings": warnings,
            "seconds": { "read": read, "draw": draw },
        });
        return say(&format!("{object:#}\n"));
    }
    for warning in &warnings {
        remark(args.quiet, &format!("{name}: {warning}"));
    }
    if args.quiet {
        return Ok(());
    }
    let mut text = format!("{name} -> {}\n", output.name);
    for ((level, Drawn { mesh, .. }), &drawn) in shown.iter().zip(&picture.drawn) {
        let head = level.map_or("mesh".to_owned(), |level| format!("level {level}"));
        let hidden = mesh.triangles.len() - drawn;
        let but = if hidden > 0 {
            format!(", {} without an area as seen from here", grouped(hidden as u64))
        } else {
            String::new()
        };
        text += &format!("  {head:<11}{}{but}\n", count(mesh.triangles.len() as u64, "triangle"));
    }
    if !dropped.is_empty() {
        text += &format!("  {:<11}{}\n", "not drawn", dropped.join(", "));
    }
    text += &format!(
        "  {:<11}{} x {} pixels, {}\n",
        "picture",
        picture.width,
        picture.height,
        count(bytes, "byte")
    );
    text += &format!("  {:<11}read {read:.2} s, draw {draw:.2} s\n", "time");
    output.say(&text)
}

/// Draws models side by side, a row for each view, all of the same size, and writes the picture; returns it and the bytes of its file.
///
/// # Errors
/// Those of the medium.
pub fn draw(
    models: &[Model],
    views: &[View],
    output: &Output,
    progress: &mut Progress,
) -> anyhow::Result<(Picture, u64)> {
    let progress = Mutex::new(progress);
    let rows = views.len() as u64;
    let mut picture: Option<Picture> = None;
    for (row, view) in (0..).zip(views) {
        let tell = |done, total| {
            let mut progress = progress.lock().unwrap_or_else(PoisonError::into_inner);
            progress.update("draw", row * total + done, rows * total);
        };
        let next = render_with(models, view, &tell)?;
        match &mut picture {
            None => picture = Some(next),
            Some(picture) => {
                picture.height += next.height;
                picture.pixels.extend(next.pixels);
                picture.drawn.iter_mut().zip(next.drawn).for_each(|(most, drawn)| *most = drawn.max(*most));
            }
        }
    }
    let picture = picture.context("there is no view")?;
    let mut file = Vec::new();
    write_png(&picture, &mut file).with_context(|| output.name.clone())?;
    output.write(|out| out.write_all(&file))?;
    Ok((picture, file.len() as u64))
}

/// Decodes as far as the finest of some levels, and returns them; where none is wanted, level 0, or the finest mesh there is of a file
/// that is cut off, by the level that it completes; each with all pictures of its scene that are there, or its shape alone.
///
/// # Errors
/// As [`Uwm::decode`] and [`Uwm::check_level`].
pub fn levels(
    uwm: &mut Uwm,
    wanted: &[u32],
    is_plain: bool,
    progress: &mut Progress,
) -> anyhow::Result<BTreeMap<u32, Drawn>> {
    if uwm.members().is_some() {
        let mut meshes = BTreeMap::new();
        for &level in if wanted.is_empty() { &[0] } else { wanted } {
            let own = uwm.enter(level, progress)?;
            let mesh = uwm.level(own, progress)?.assembled()?;
            meshes.insert(level, Drawn::of(mesh, None, is_plain, uwm.memory())?);
        }
        return Ok(meshes);
    }
    wanted.iter().try_for_each(|&level| uwm.check_level(level))?;
    let finest = wanted.iter().copied().min().unwrap_or(0);
    let way = uwm.way_to(finest)?;
    if let Some(there) = uwm.cut().filter(|_| finest == 0) {
        note(&uwm.cut_text(there));
    }
    let until = Until { level: finest, ..Until::default() };
    let mut meshes = BTreeMap::new();
    let mut decoder = uwm.decode(way.as_ref(), until, progress, &mut |decoder, event| {
        if let Event::Level { level, .. } = event
            && *level > finest
            && wanted.contains(level)
        {
            meshes.insert(*level, decoder.assembled()?);
        }
        Ok(())
    })?;
    // Level 0 is complete with its residue alone.
    meshes.insert(decoder.level().unwrap_or(finest), decoder.assembled()?);
    if !is_plain {
        uwm.complete_scene(&mut decoder)?;
    }
    let scene = shown::scene(&decoder).with_context(|| uwm.name.clone())?;
    let drawn = |(level, mesh)| {
        let drawn = Drawn::of(mesh, scene.as_ref(), is_plain, uwm.memory());
        Ok((level, drawn.with_context(|| uwm.name.clone())?))
    };
    meshes.into_iter().map(drawn).collect()
}

impl Look {
    /// A view for each row of the picture.
    fn views(&self, meshes: usize) -> Vec<View> {
        let side = |panes: usize| u32::try_from(800 * panes).unwrap_or(u32::MAX).clamp(1, View::MAX_SIDE);
        let rows = u32::try_from(self.turn.len()).unwrap_or(u32::MAX).max(1);
        let (width, height) = self.size.unwrap_or((side(meshes), side(self.turn.len())));
        let view = View {
            width,
            height: (height / rows).max(1),
            up: match self.up {
                Axis::X => Up::X,
                Axis::Y => Up::Y,
                Axis::Z => Up::Z,
            },
            turn_degrees: TURN,
            tilt_degrees: self.tilt,
            smooth: self.smooth,
            wireframe: self.wireframe,
            background: self.background.0,
        };
        self.turn.iter().map(|&turn_degrees| View { turn_degrees, ..view }).collect()
    }
}

/// Degrees by which meshes are turned and tilted where nothing else is said: all three axes show.
pub const TURN: f64 = 25.0;
pub const TILT: f64 = 20.0;

/// Where the picture goes: as is wanted, or beside the input, if nothing of somebody else's is in the way.
fn output(args: &Args) -> anyhow::Result<Output> {
    let beside = || {
        let mut path = args.input.clone().into_os_string();
        path.push(".png");
        PathBuf::from(path)
    };
    let path = match &args.output {
        Some(path) => path.clone(),
        None if is_stream(&args.input) => {
            let what = "a picture of standard input has no file to stand beside: name one with -o";
            return Err(Usage(what.to_owned()).into());
        }
        None => beside(),
    };
    if !is_stream(&path) && !path.extension().is_some_and(|e| e.eq_ignore_ascii_case("png")) {
        return Err(Usage(format!("{}: the name must end in .png", path.display())).into());
    }
    // What is missing needs no place for a picture.
    let missing = || args.input.metadata().with_context(|| input::name(&args.input));
    if args.output.is_none() {
        missing()?;
        if path.exists() && !args.force && !is_ours(&path).with_context(|| path.display().to_string())? {
            let what = "is there, and none of our pictures: --force replaces it, -o names another";
            return Err(Usage(format!("{} {what}", path.display())).into());
        }
    }
    Output::new(&path, [&*args.input])
}

/// Whether a file is a picture that says it was drawn here.
fn is_ours(path: &Path) -> io::Result<bool> {
    let mut first = Vec::new();
    File::open(path)?.take(256).read_to_end(&mut first)?;
    let mark = [b"tEXtSoftware\0", SOFTWARE.as_bytes()].concat();
    Ok(first.windows(mark.len()).any(|bytes| bytes == mark))
}

/// What to draw by its level, if it has one, and what the file has besides.
type Meshes = (BTreeMap<Option<u32>, Drawn>, Vec<String>);

fn meshes(args: &Args, progress: &mut Progress) -> anyhow::Result<Meshes> {
    let is_plain = args.look.plain;
    let reading = Reading {
        max_memory: args.max_memory,
        force: false,
        scenes: false,
        painted: !is_plain,
        detail: None,
    };
    let (source, paint) = match Input::open(&args.input, reading)? {
        Input::Levels(mut uwm) => {
            let levels = levels(&mut uwm, &args.level, is_plain, progress)?;
            return Ok((levels.into_iter().map(|(level, mesh)| (Some(level), mesh)).collect(), Vec::new()));
        }
        Input::Mesh(source, paint) => (source, paint),
    };
    if !args.level.is_empty() {
        return Err(input::without_levels(&args.input).into());
    }
    let drawn = match is_plain {
        true => Drawn::plain(source.mesh),
        false => Drawn::new(source.mesh, paint, source.remarks),
    };
    // Of materials the base colours are drawn.
    let is_drawn = |what: &String| {
        !is_plain && ["materials (", "textures (", "images ("].iter().any(|list| what.starts_with(list))
    };
    let dropped = source.dropped.into_iter().filter(|what| !is_drawn(what));
    let dropped = dropped.chain(drawn.left_out()).collect();
    Ok((BTreeMap::from([(None, drawn)]), dropped))
}

/// `1200x800`.
fn pixels(text: &str) -> Result<(u32, u32), String> {
    let side = |text: &str| text.parse().ok().filter(|n| (1..=View::MAX_SIDE).contains(n));
    let sides = text.split_once(['x', 'X']).and_then(|(width, height)| Some((side(width)?, side(height)?)));
    sides.ok_or_else(|| format!("a width and a height such as 1200x800, each from 1 to {}", View::MAX_SIDE))
}

/// A finite number.
fn angle(text: &str) -> Result<f64, String> {
    let angle = text.parse().ok().filter(|x: &f64| x.is_finite());
    angle.ok_or_else(|| "degrees such as 30 or -12.5".to_owned())
}

/// `f5f5f3`, `#f5f5f3` or `none`.
fn colour(text: &str) -> Result<Background, String> {
    if text == "none" {
        return Ok(Background(None));
    }
    let digits = text.strip_prefix('#').unwrap_or(text);
    let number =
        u32::from_str_radix(digits, 16).ok().filter(|_| digits.len() == 6 && !digits.starts_with('+'));
    let [_, red, green, blue] = number.ok_or("six hexadecimal digits such as ffffff, or none")?.to_be_bytes();
    Ok(Background(Some([red, green, blue])))
}

const EXAMPLES: &str = "\
EXAMPLES
  unweld view bunny.ply                                          a picture beside it, bunny.ply.png
  unweld view bunny.ply -o bunny.png
  unweld view bunny.uwm -o levels.png --level 12,6,0 --wireframe --size 2100x720
  unweld view part.obj -o part.png --up z --turn -30 --tilt 35 --smooth --background none
  unweld view helmet.uwm -o helmet.png --level 12,6,0 --turn 0,120,240  levels side by side, as seen from three sides
  unweld view helmet.glb -o shape.png --plain
  unweld view - -o - < bunny.uwm > bunny.png";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_angles_and_colours() {
        assert_eq!(pixels("1200x800"), Ok((1200, 800)));
        assert_eq!(pixels("1X8192"), Ok((1, 8192)));
        for text in ["", "x", "800", "0x1", "8193x1", "1x", "-1x1", "1x1x1", "1 x 1"] {
            assert!(pixels(text).is_err(), "{text}");
        }
        assert_eq!(["30", "-12.5", "0"].map(angle), [30.0, -12.5, 0.0].map(Ok));
        for text in ["", "nan", "inf", "ten", "1e999"] {
            assert!(angle(text).is_err(), "{text}");
        }
        assert_eq!(colour("0a00Ff"), Ok(Background(Some([10, 0, 255]))));
        assert_eq!(colour("#ffffff"), Ok(Background(Some([255; 3]))));
        assert_eq!(colour("none"), Ok(Background(None)));
        for text in ["", "fff", "+fffff", "ffffff0", "##ffffff", "white", "éff"] {
            assert!(colour(text).is_err(), "{text}");
        }
    }
}
