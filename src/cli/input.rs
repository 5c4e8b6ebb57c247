//! Meshes to read, from a file or from standard input.

use super::args::is_stream;
use super::drawn::Drawn;
use super::failure::Usage;
use super::progress::Progress;
use super::shown;
use super::uwm::Uwm;
use anyhow::{Context, anyhow, bail};
use std::fs::File;
use std::io::Read;
use std::path::Path;
use unweld::Error;
use unweld::codec::grid::Real;
use unweld::container::{AttributeEntry, MAGIC};
use unweld::formats::{self, Coordinates, Format, INFLATED_BYTES, ReadOptions, Source};
use unweld::mesh::attributes::{Quantisation, Semantic};
use unweld::mesh::{Lattice, Paint};

/// What a file holds.
pub enum Input {
    /// A mesh in a foreign format, and what it is painted with, if that is wanted.
    Mesh(Box<Source>, Paint),
    /// A `.uwm` file.
    Levels(Uwm),
}

/// A mesh to work on.
pub struct Mesh {
    /// As from a foreign file.
    pub source: Source,
    /// What it is painted with, if that is wanted.
    pub paint: Paint,
    /// What it was before, if it is a level of a `.uwm` file.
    pub level: Option<Level>,
}

/// A level of a `.uwm` file.
pub struct Level {
    /// Whether it has the coordinates of the file's input, bit for bit.
    pub exact: bool,
    /// Whether it has the lists of the file's input.
    pub ordered: bool,
    /// The lattice of its coordinates, if they are not exact.
    pub lattice: Option<Lattice>,
    /// What the file has and this level has not, in words for the user.
    pub lost: Option<String>,
}

impl Input {
    /// Opens a file, which is a `.uwm` file if it is called or begins like one.
    ///
    /// # Errors
    /// Those of the medium and of the reader, with the name of the file.
    pub fn open(path: &Path, reading: Reading) -> anyhow::Result<Self> {
        let named = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("uwm"));
        if !path.is_file() || is_stream(path) {
            // Pipes are read once.
            let bytes = read_bytes(path)?;
            return if named || bytes.starts_with(&MAGIC[..4]) {
                Ok(Self::Levels(Uwm::of_bytes(bytes, &name(path), reading.max_memory)?))
            } else {
                parse(&bytes, path, reading).map(|(source, paint)| Self::Mesh(Box::new(source), paint))
            };
        }
        if named || begins_as_uwm(path)? {
            Ok(Self::Levels(Uwm::open(path, reading.max_memory)?))
        } else {
            let (source, paint) = parse(&read_bytes(path)?, path, reading)?;
            Ok(Self::Mesh(Box::new(source), paint))
        }
    }
}

impl Mesh {
    /// Reads a mesh, or decodes `level` of a `.uwm` file, 0 where none is named.
    ///
    /// # Errors
    /// As [`Input::open`] and [`Uwm::level`]; [`Usage`] for a level of what has none.
    pub fn read(
        path: &Path,
        level: Option<u32>,
        reading: Reading,
        progress: &mut Progress,
    ) -> anyhow::Result<Self> {
        match Input::open(path, reading)? {
            Input::Mesh(..) if level.is_some() => Err(without_levels(path).into()),
            Input::Mesh(source, paint) => Ok(Self { source: *source, paint, level: None }),
            Input::Levels(mut uwm) => Self::of_level(&mut uwm, level.unwrap_or(0), reading, progress),
        }
    }

    /// Reads a mesh, or all levels of detail of a glTF that has some (`MSFT_lod`), the finest first.
    ///
    /// # Errors
    /// As [`Mesh::read`].
    pub fn read_all(path: &Path, reading: Reading, progress: &mut Progress) -> anyhow::Result<Vec<Self>> {
        let is_plain = path.is_file() && !is_stream(path);
        let named = |end: &str| path.extension().is_some_and(|e| e.eq_ignore_ascii_case(end));
        if !is_plain || !(named("glb") || named("gltf")) {
            return Ok(vec![Self::read(path, None, reading, progress)?]);
        }
        let bytes = read_bytes(path)?;
        let levels =
            formats::levels_of_detail(&bytes, &options(path, reading)).with_context(|| name(path))?;
        let detail = |k| (levels > 1).then_some(k);
        let read = |k| {
            let (source, paint) = parse(&bytes, path, Reading { detail: detail(k), ..reading })?;
            Ok(Self { source, paint, level: None })
        };
        (0..levels).map(read).collect()
    }

    fn of_level(
        uwm: &mut Uwm,
        level: u32,
        reading: Reading,
        progress: &mut Progress,
    ) -> anyhow::Result<Self> {
        let level = uwm.enter(level, progress)?;
        let mut decoder = uwm.level(level, progress)?;
        let mut scene = None;
        let mut paint = Paint::default();
        let (mesh, dropped) = if reading.painted {
            uwm.complete_scene(&mut decoder)?;
            let of_scene = shown::scene(&decoder).with_context(|| uwm.name.clone())?;
            let drawn = Drawn::of(decoder.assembled()?, of_scene.as_ref(), false, reading.max_memory);
            let drawn = drawn.with_context(|| uwm.name.clone())?;
            paint = drawn.paint.unwrap_or_default();
            (drawn.mesh, vec![])
        } else if reading.scenes && uwm.contents.scene().is_some() {
            uwm.complete_scene(&mut decoder)?;
            let whole = shown::scene(&decoder).with_context(|| uwm.name.clone())?.unwrap_or_default();
            if let Some(r) = whole.buffers.iter().position(|buffer| buffer.bytes.is_empty()) {
                bail!("{}: the file is cut off: buffer {r} of its scene is not there", uwm.name);
            }
            let mesh = formats::in_bodies(decoder.assembled()?, &whole).with_context(|| uwm.name.clone())?;
            scene = Some(whole);
            (mesh, vec![])
        } else {
            shown::placed(&decoder, reading.max_memory).with_context(|| uwm.name.clone())?
        };
        let real = decoder.correction().filter(|_| level == 0).map(|correction| correction.real);
        let coordinates =
            if real == Some(Real::Binary32) { Coordinates::Float32 } else { Coordinates::Float64 };
        let source = Source {
            dropped,
            scene,
            // As fine as they are, so that they are again.
            texels: uwm.contents.attributes.iter().filter_map(step_of_texture_coordinates).collect(),
            ..Source::new(mesh, Format::Ply, coordinates)
        };
        let contents = &uwm.contents;
        let parts = [
            ("the residue", !contents.residue().is_empty()),
            ("attributes", contents.attributes.iter().any(|attribute| attribute.birth < level)),
            ("exact coordinates", !contents.correction().is_empty()),
            ("the order of the input", !contents.order().is_empty()),
        ];
        let parts = parts.into_iter().filter(|&(_, is_there)| is_there && level > 0);
        let parts: Vec<_> = parts.map(|(name, _)| name).collect();
        let lost = (!parts.is_empty())
            .then(|| format!("level {level} is without what level 0 has: {}", parts.join(", ")));
        let lattice = real.is_none().then_some(contents.header.lattice);
        let ordered = level == 0 && decoder.order().is_some();
        Ok(Self { source, paint, level: Some(Level { exact: real.is_some(), ordered, lattice, lost }) })
    }
}

/// The step of the lattice that texture coordinates stand on, by their set.
fn step_of_texture_coordinates(entry: &AttributeEntry) -> Option<(u32, f64)> {
    match entry.quantisation {
        Quantisation::Lattice { step, .. } if entry.semantic == Semantic::TexCoord && step > 0.0 => {
            Some((entry.set, step))
        }
        _ => None,
    }
}

/// Why a level of this file cannot be had.
pub fn without_levels(path: &Path) -> Usage {
    Usage(format!("{} has no levels: --level is for .uwm files", name(path)))
}

/// What a path is called in messages.
pub fn name(path: &Path) -> String {
    if is_stream(path) { "standard input".to_owned() } else { path.display().to_string() }
}

/// The last part of a path, for the metadata: where a file lay is nobody's business.
pub fn file_name(path: &Path) -> String {
    path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned())
}

/// How to read a mesh.
#[derive(Clone, Copy, Debug)]
pub struct Reading {
    /// Most bytes that decoding may take, and that a compressed foreign mesh may inflate to.
    pub max_memory: u64,
    /// Whether to read what contradicts itself.
    pub force: bool,
    /// Whether scenes stay scenes.
    pub scenes: bool,
    /// Whether it is wanted what meshes are painted with.
    pub painted: bool,
    /// The level of detail of a glTF, where all of them are read.
    pub detail: Option<usize>,
}

/// Reads a mesh; its name tells the format, or else its content.
///
/// # Errors
/// Those of the medium and of the reader, with the name of the file.
pub fn read(path: &Path, reading: Reading) -> anyhow::Result<Source> {
    parse(&read_bytes(path)?, path, reading).map(|(source, _)| source)
}

/// Reads a mesh from memory; the name that it came by tells the format, or else its content.
///
/// # Errors
/// Those of the reader, with the name.
fn parse(bytes: &[u8], path: &Path, reading: Reading) -> anyhow::Result<(Source, Paint)> {
    let (name, options) = (name(path), options(path, reading));
    let outcome = if reading.painted {
        formats::read_painted(bytes, &options)
    } else {
        formats::read_with(bytes, &options).map(|source| (source, Paint::default()))
    };
    match outcome {
        Err(error @ Error::Limit { what: INFLATED_BYTES | "memory in bytes", .. }) => {
            Err(anyhow!("{name}: {error} (--max-memory allows more)"))
        }
        outcome => outcome.with_context(|| name),
    }
}

fn options(path: &Path, reading: Reading) -> ReadOptions {
    let mut options = ReadOptions::default();
    options.format = Format::from_path(path);
    options.folder = path.parent().filter(|_| !is_stream(path)).map(Path::to_owned);
    options.max_memory = reading.max_memory;
    options.force = reading.force;
    options.scenes = reading.scenes;
    options.detail = reading.detail;
    options
}

fn begins_as_uwm(path: &Path) -> anyhow::Result<bool> {
    let mut first = Vec::new();
    let read = File::open(path).and_then(|file| file.take(4).read_to_end(&mut first));
    read.with_context(|| name(path))?;
    Ok(first == MAGIC[..4])
}

/// All bytes of a file or of standard input.
///
/// # Errors
/// Those of the medium, with the name of the file.
pub fn read_bytes(path: &Path) -> anyhow::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let outcome = if is_stream(path) {
        std::io::stdin().lock().read_to_end(&mut bytes)
    } else {
        std::fs::File::open(path).and_then(|mut file| file.read_to_end(&mut bytes))
    };
    outcome.with_context(|| name(path))?;
    Ok(bytes)
}
