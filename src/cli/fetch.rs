//! `unweld fetch`: a file from a server, or as much of it as is wanted.

mod light;
mod part;
mod set;
mod steps;
mod told;

use super::args::{is_stream, size};
use super::decode;
use super::describe::diagonal;
use super::failure::{Usage, line};
use super::numbers::{count, grouped};
use super::output::{MeshFormat, Output, remark};
use super::progress::Progress;
use super::quality::Quality;
use super::shown::Shown;
use super::signals::stopped;
use super::uwm::Uwm;
use anyhow::{Context, anyhow, bail};
use bytes::Bytes;
use part::{Held, Part, Wish};
use reqwest::Url;
use reqwest::header::{AUTHORIZATION, HeaderMap, HeaderName, HeaderValue};
use std::fs::{self, File};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::Duration;
use told::{Got, Of, Told};
use unweld::Error;
use unweld::client::{
    Begun, FIRST_BYTES, Fault, Http, HttpOptions, Piece, RangeSource, Transfer, Version, whole_file,
};
use unweld::container::{Contents, Plan, Want, plan, plan_from_keyframe};
use unweld::decoder::Until;

/// Fetch a .uwm file from an HTTP server, or as much of it as is wanted; of a set of meshes, as a mesh, the member that is wanted
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Where it is, http:// or https://
    #[arg(value_name = "URL", value_parser = address)]
    url: Url,
    /// The file to write: .uwm for the bytes as they are, .ply, .obj, .stl or .glb for the mesh, - for the bytes on standard output
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,
    #[command(flatten)]
    quality: Quality,
    /// Of the images of a scene pictures of at most N pixels along the longer side, 1 or more, where it has such, and its smallest elsewhere, and not
    /// the images themselves: all of the mesh in less of the file, for .uwm, .glb and .gltf
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    textures: Option<u32>,
    /// For a mesh: where to start, from the base, or from the keyframe next to the wanted level
    #[arg(long, value_enum, default_value = "replay")]
    via: decode::Via,
    /// Sent with every request; may be there several times
    #[arg(long, value_name = "NAME:VALUE", value_parser = header)]
    header: Vec<(HeaderName, HeaderValue)>,
    /// The token in this file is sent as `Authorization: Bearer TOKEN`
    #[arg(long, value_name = "FILE")]
    token_file: Option<PathBuf>,
    /// How long connecting may take, and how long nothing may come, 1 or more
    #[arg(long, value_name = "SECONDS", default_value_t = 30, value_parser = clap::value_parser!(u32).range(1..))]
    timeout: u32,
    /// How often in a row to try again, 0 or more, after a failure that may pass, after 0.5, 1, 2, 4 … seconds
    #[arg(long, value_name = "N", default_value_t = 5)]
    retries: u32,
    /// Most memory to decode a mesh with, in bytes or with a suffix K, M, G
    #[arg(long, value_name = "M", value_parser = size, default_value = "4G")]
    max_memory: u64,
    /// Tell what came as one JSON object
    #[arg(long)]
    json: bool,
    /// Nothing but errors
    #[arg(long, short)]
    quiet: bool,
}

/// What is wanted of a file.
#[derive(Clone, Copy)]
struct Wanted {
    quality: Quality,
    keyframe: bool,
    /// As a mesh: keyframes that nothing starts from are of no use.
    mesh: bool,
    /// As a mesh of a format that has room for nothing else: nor are resources.
    alone: bool,
    /// Pixels of images that are enough.
    textures: Option<u32>,
}

/// Runs the command.
///
/// # Errors
/// Those of the server, of the file and of writing, and where the file has no such quality.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let format = form(&args.output)?;
    let partial = args.quality.max_bytes.is_some() || args.quality.triangles.is_some();
    if args.via == decode::Via::Keyframe && (format.is_none() || partial) {
        return Err(Usage(
            "--via keyframe leads to a level, and to a mesh: .ply, .obj, .stl or .glb".to_owned(),
        )
        .into());
    }
    light::check(args, format)?;
    let output = Output::new(&args.output, args.token_file.as_deref())?;
    let wanted = Wanted {
        quality: args.quality,
        keyframe: args.via == decode::Via::Keyframe,
        mesh: format.is_some(),
        alone: format.is_some_and(|format| !format.is_gltf()),
        textures: args.textures,
    };
    let mut sink = match (format, output.target()) {
        (None, None) if args.textures.is_none() => Sink::Stream(output.open()?),
        _ => Sink::Part(Part::open(&output)?),
    };
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    let outcome = runtime.block_on(async {
        let stop = stopped()?;
        tokio::select! {
            outcome = fetch(args, wanted, &output, &mut sink) => outcome,
            () = stop => Err(anyhow!("{}: interrupted", shown(&args.url))),
        }
    });
    let got = match (outcome, sink) {
        (Ok(got), Sink::Part(part)) => {
            match (format, &got.light, &got.of) {
                (None, Some(light), Of::Mesh(contents, _)) => light.write(contents, part, args, &output)?,
                (None, ..) => part.finish(got.end())?,
                (Some(format), ..) => write_mesh(args, &got, part, format, &output)?,
            }
            got
        }
        (Ok(got), Sink::Stream(_)) => got,
        (Err(error), Sink::Part(part)) => return Err(kept(error, part)),
        (Err(error), Sink::Stream(_)) => return Err(error),
    };
    if args.json {
        let text = format!("{:#}\n", got.json(args, &output));
        return output.say(&text);
    }
    if args.quiet { Ok(()) } else { output.say(&got.summary(&output, format)) }
}

/// Where bytes go to.
enum Sink {
    Part(Part),
    Stream(Box<dyn Write>),
}

/// Fetches, and begins anew as often as the file is another one.
async fn fetch(args: &Args, wanted: Wanted, output: &Output, sink: &mut Sink) -> anyhow::Result<Got> {
    let address = shown(&args.url);
    let mut again = MAX_RESTARTS;
    loop {
        let held = match sink {
            Sink::Part(part) => part.held(&address, args.max_memory, |uwm| wanted.of(uwm)),
            Sink::Stream(_) => None,
        };
        let tagless = held.as_ref().is_some_and(|held| held.version.tag.is_none());
        let error = match attempt(args, wanted, output, sink, held).await {
            Ok(got) => return Ok(got),
            Err(error) => error,
        };
        let changed = matches!(error.downcast_ref().and_then(Fault::of), Some(Fault::Changed));
        // Where no tag tells versions apart, checksums do.
        let damaged = tagless && matches!(error.downcast_ref(), Some(Error::Format(_)));
        match sink {
            Sink::Part(part) if (changed || damaged) && again > 0 => {
                again -= 1;
                part.clear()?;
                let text = if changed { "the file was replaced".to_owned() } else { line(&error) };
                remark(args.quiet, &format!("{address}: {text}: beginning anew"));
            }
            _ => return Err(error.context(address)),
        }
    }
}

async fn attempt(
    args: &Args,
    wanted: Wanted,
    output: &Output,
    sink: &mut Sink,
    held: Option<Held>,
) -> anyhow::Result<Got> {
    let address = shown(&args.url);
    let mut source = Source::new(args, &held)?;
    let resumed = held.as_ref().map_or(0, |held| held.sound.iter().map(|run| run.end - run.start).sum());
    if let (Sink::Part(part), Some(held)) = (&*sink, held) {
        remark(
            args.quiet,
            &format!("{}: going on behind {} that are there", part.name, count(resumed, "byte")),
        );
        source.held = Some((part.reader()?, held.sound));
    } else if let Sink::Part(part) = sink {
        part.clear()?;
    }
    let first = match args.quality {
        Quality { max_bytes: Some(most), .. } => most.clamp(1, FIRST_BYTES),
        quality if quality.is_all() && !wanted.keyframe && wanted.textures.is_none() => u64::MAX,
        _ => FIRST_BYTES,
    };
    let source = Begun::new(source, first).await?;
    let mut told = Told { args, output, sink, address, resumed, progress: Progress::new(args.quiet) };
    if source.is_set() {
        light::check_set(args)?;
        return set::fetch(source, first, wanted, told).await;
    }
    let mut transfer = Transfer::new(source, first, |contents: &Contents| wanted.transfer(contents));
    let Some(Piece::Head { contents, plan: mut fetched, bytes }) = transfer.next().await? else {
        bail!("there is no table of contents");
    };
    let (mut plan, mut light) = (wanted.plan(&contents)?, None);
    let (mut steps, diagonal) = (steps::steps(&contents, &plan), diagonal(&contents, None));
    let version = transfer.source().source().version();
    let line = head(&told.address, &contents);
    told.begin(&bytes, &version, &line)?;
    let head = bytes.len() as u64;
    let mut done = head;
    while let Some(piece) = transfer.next().await.map_err(|e| named(e, &contents))? {
        let Piece::Atom { index, bytes } = piece else { continue };
        let Some(atom) = contents.atoms.get(index) else { continue };
        done += bytes.len() as u64;
        let step = steps.iter().find(|step| step.atoms.end == index + 1);
        let line = step.map(|step| step.line(diagonal));
        told.atom(atom.offset, &bytes, [done, head + fetched.byte_count()], line)?;
        if let (Some(pixels), true, Sink::Part(part)) =
            (wanted.textures, light::is_known(&contents, index), &*told.sink)
        {
            let known = light::Light::of(part, pixels, args.max_memory)?;
            transfer.skip(|number| known.passes_over(&contents, number));
            fetched = fetched.without(&contents, |number| known.passes_over(&contents, number));
            plan = plan.without(&contents, |number| known.leaves_out(number));
            steps = steps::steps(&contents, &plan);
            light = Some(known);
        }
    }
    let got = told.end(Of::Mesh(contents, plan), steps, transfer.source().source())?;
    Ok(Got { light, ..got })
}

impl Sink {
    /// A stream takes what comes in order.
    fn write(&mut self, offset: u64, bytes: &[u8]) -> anyhow::Result<()> {
        match self {
            Self::Part(part) => part.write(offset, bytes),
            Self::Stream(out) => out.write_all(bytes).context("standard output"),
        }
    }
}

impl Wanted {
    /// Bytes of header and table of a file, and what is wanted of it.
    fn of(&self, uwm: &mut Uwm) -> anyhow::Result<(u64, Vec<Wish>)> {
        if let Some(set) = &uwm.set {
            return set::wishes(&set.contents, self);
        }
        let contents = &uwm.contents.clone();
        let mut plan = self.transfer(contents)?;
        // Until the scene is there, nothing behind it is.
        if let Some(Ok(light)) = self.textures.map(|pixels| light::Light::of_scene(uwm, pixels)) {
            plan = plan.without(contents, |number| light.passes_over(contents, number));
        }
        let wish =
            |index| Wish { contents: contents.clone(), index, bytes: contents.bytes(index..index + 1) };
        let wishes = plan.parts.iter().flat_map(|part| part.atoms.clone()).map(wish).collect();
        Ok((contents.header.table_end(), wishes))
    }

    /// What is asked for together: where the scene is to tell of what it has no need, nothing with what stands behind it.
    fn transfer(&self, contents: &Contents) -> unweld::Result<Plan> {
        let plan = self.plan(contents)?;
        Ok(if self.textures.is_some() { light::parted(plan, contents) } else { plan })
    }

    fn plan(&self, contents: &Contents) -> unweld::Result<Plan> {
        let want = self.quality.want(contents, || diagonal(contents, None))?;
        let plan = match want {
            _ if self.keyframe => plan_from_keyframe(contents, Until::of(want, contents).level),
            Want::Bytes(_) | Want::Triangles(_) => plan(contents, want),
            _ => match Until::of(want, contents).level {
                // Level 0 is the whole file, which any decoder takes.
                0 if !self.mesh => whole_file(contents),
                level => plan(contents, Want::Level(level)),
            },
        };
        // What is shorter is there sooner than an answer to a further request.
        Ok(if self.alone { plan.without(contents, |number| is_long(contents, number)) } else { plan })
    }
}

/// Whether a resource takes longer than an answer to a further request.
fn is_long(contents: &Contents, number: usize) -> bool {
    contents.resources.get(number).is_some_and(|entry| entry.bytes >= LONG_RESOURCE)
}

/// What is there already, then the server.
struct Source {
    held: Option<(File, Vec<Range<u64>>)>,
    http: Http,
}

impl Source {
    fn new(args: &Args, held: &Option<Held>) -> anyhow::Result<Self> {
        let mut headers: HeaderMap = args.header.iter().cloned().collect();
        if let Some(path) = &args.token_file {
            headers.insert(AUTHORIZATION, token(path)?);
        }
        let options = HttpOptions {
            headers,
            timeout: Duration::from_secs(args.timeout.into()),
            retries: args.retries,
            version: held.as_ref().map(|held| held.version.clone()),
            ..HttpOptions::default()
        };
        let (quiet, address) = (args.quiet, shown(&args.url));
        let http = Http::new(args.url.as_str(), options)?.on_retry(move |retry| {
            let (what, at, after) = (&retry.what, grouped(retry.at), retry.after.as_secs_f64());
            remark(quiet, &format!("{address}: {what}; asking again from byte {at} on, in {after} s"));
        });
        Ok(Self { held: None, http })
    }

    fn version(&self) -> Version {
        self.http.version().cloned().unwrap_or_default()
    }
}

impl RangeSource for Source {
    async fn read(&mut self, range: Range<u64>) -> io::Result<Bytes> {
        if let Some((file, sound)) = &mut self.held
            && let Some(run) = sound.iter().find(|run| run.contains(&range.start))
        {
            let count = (range.end.min(run.end) - range.start).min(READ_BYTES);
            let mut bytes = vec![0; count as usize];
            file.seek(SeekFrom::Start(range.start))?;
            file.read_exact(&mut bytes)?;
            return Ok(bytes.into());
        }
        self.http.read(range).await
    }

    fn length(&self) -> Option<u64> {
        self.http.length()
    }
}

fn write_mesh(args: &Args, got: &Got, part: Part, format: MeshFormat, output: &Output) -> anyhow::Result<()> {
    let mut uwm = Uwm::of_file(part.reader()?, &part.name, args.max_memory)?;
    let mut progress = Progress::new(args.quiet);
    let decoder = match &got.of {
        Of::Mesh(_, plan) => {
            let until = Until { level: plan.level, ..Until::default() };
            uwm.decode(Some(plan), until, &mut progress, &mut |_, _| Ok(()))?
        }
        Of::Set(members) => {
            let level = uwm.enter(members.wanted(), &mut progress)?;
            uwm.level(level, &mut progress)?
        }
    };
    drop(progress);
    let shown = Shown::new(&decoder, None, format, args.max_memory).with_context(|| part.name.clone())?;
    let remarks = shown.write(format, decode::Compression::None, output, &[])?;
    part.remove();
    for loss in shown.losses(format).into_iter().chain(remarks) {
        remark(args.quiet, &format!("{}: {loss}", output.name));
    }
    if args.quiet || args.json {
        return Ok(());
    }
    let text = match &got.of {
        Of::Mesh(..) => decode::reached(&mut uwm, &decoder)?,
        Of::Set(members) => members.reached(),
    };
    output.say(&format!(
        "{}: {}, {}\n  {text}\n",
        output.name,
        count(shown.mesh.positions.len() as u64, "vertex"),
        count(shown.mesh.triangles.len() as u64, "triangle"),
    ))
}

/// An error, and what is left of the work.
fn kept(error: anyhow::Error, part: Part) -> anyhow::Error {
    match part.length() {
        Ok(1..) if part.stays() => {
            anyhow!("{} ({} has what came; the same command goes on with it)", line(&error), part.name)
        }
        _ => {
            part.remove();
            error
        }
    }
}

/// A damaged atom with all its bytes.
fn named(error: Error, contents: &Contents) -> anyhow::Error {
    let Error::Format(fault) = &error else { return error.into() };
    let atom = contents.atoms.iter().find(|atom| atom.offset == fault.offset && fault.section == "3.4");
    match atom {
        Some(atom) => {
            let bytes = format!("bytes {} to {}", grouped(atom.offset), grouped(atom.end() - 1));
            anyhow::Error::from(error).context(bytes)
        }
        None => error.into(),
    }
}

fn head(address: &str, contents: &Contents) -> String {
    let header = &contents.header;
    format!(
        "{address}: {}, levels {} to 0, {}, {}\n  table of contents: {}\n",
        count(contents.file_bytes(), "byte"),
        contents.base_level(),
        count(header.vertices, "vertex"),
        count(header.triangles, "triangle"),
        count(header.table_end(), "byte"),
    )
}

/// `None` for the bytes themselves.
fn form(path: &Path) -> anyhow::Result<Option<MeshFormat>> {
    let is_uwm = path.extension().is_some_and(|end| end.eq_ignore_ascii_case("uwm"));
    let is_device = fs::metadata(path).is_ok_and(|there| !there.is_file() && !there.is_dir());
    if is_uwm || is_stream(path) || (is_device && path.extension().is_none()) {
        return Ok(None);
    }
    let what =
        || Usage(format!("{}: the name must end in .uwm, .ply, .obj, .stl, .glb or .gltf", path.display()));
    Ok(Some(MeshFormat::of(path).map_err(|_| what())?))
}

/// An address without what is secret in it.
fn shown(url: &Url) -> String {
    let mut url = url.clone();
    // Neither can fail on a URL with a host.
    let _ = (url.set_username(""), url.set_password(None));
    url.set_query(None);
    url.set_fragment(None);
    url.to_string()
}

fn address(text: &str) -> Result<Url, String> {
    match Url::parse(text) {
        Ok(url) if ["http", "https"].contains(&url.scheme()) => Ok(url),
        _ => Err("an address such as https://example.org/bunny.uwm".to_owned()),
    }
}

fn header(text: &str) -> Result<(HeaderName, HeaderValue), String> {
    let what = || "NAME:VALUE in ASCII, such as X-Api-Key:secret".to_owned();
    let (name, value) = text.split_once(':').ok_or_else(what)?;
    let mut value = HeaderValue::from_str(value.trim()).map_err(|_| what())?;
    value.set_sensitive(true);
    Ok((name.trim().parse().map_err(|_| what())?, value))
}

fn token(path: &Path) -> anyhow::Result<HeaderValue> {
    let name = || path.display().to_string();
    let text = fs::read_to_string(path).with_context(name)?;
    let mut tokens = text.lines().map(str::trim).filter(|line| !line.is_empty());
    let (Some(token), None) = (tokens.next(), tokens.next()) else {
        bail!("{}: there must be one token in it", name());
    };
    let mut value = HeaderValue::from_str(&format!("Bearer {token}")).with_context(name)?;
    value.set_sensitive(true);
    Ok(value)
}

/// A file that is replaced more often than this while it is fetched is given up.
const MAX_RESTARTS: u32 = 3;
/// Bytes read at a time of what is there already.
const READ_BYTES: u64 = 64 << 10;
/// Bytes of a resource from which on it is left out where it is of no use.
const LONG_RESOURCE: u64 = 64 << 10;

const EXAMPLES: &str = "\
EXAMPLES
  unweld fetch https://example.org/bunny.uwm -o bunny.uwm               the whole file
  unweld fetch https://example.org/bunny.uwm -o early.uwm --max-bytes 20K
  unweld fetch https://example.org/bunny.uwm -o bunny.ply --error 0.5%   a mesh, of no more bytes than it takes
  unweld fetch https://example.org/bunny.uwm -o lod.obj --level 8 --via keyframe
  unweld fetch https://example.org/chair.uwm -o chair.glb --textures 256 all of the mesh, images of 256 pixels
  unweld fetch https://example.org/lods.uwm -o lod.glb --member 2        of a set of meshes the bytes that this one takes
  unweld fetch http://localhost:8080/meshes/bunny.uwm -o - --token-file token | unweld info -

What broke off is taken up again by the same command: OUT.part and OUT.part.json hold what came, and of which version.
Any server that answers Range requests will do; one that does not is read from the first byte as far as is wanted.";
