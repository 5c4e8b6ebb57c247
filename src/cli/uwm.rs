//! A `.uwm` file: its contents at once, the rest as far as it is wanted.

use super::args::is_stream;
use super::input;
use super::members::Set;
use super::numbers::{count, grouped};
use super::progress::Progress;
use anyhow::{Context, anyhow, bail};
use std::fs::File;
use std::io::{self, Cursor, Read, Seek, SeekFrom};
use std::ops::Range;
use std::path::Path;
use std::sync::Arc;
use unweld::Error;
use unweld::container::{Contents, Metadata, Parsed, Parser, Part, Plan, Want, plan, plan_from_keyframe};
use unweld::decoder::{Decoder, Event, Options, Until};
use unweld::error::FormatError;
use unweld::limits::Limits;

/// Header and table of contents are known and checked; all other bytes are still in the file.
pub struct Uwm {
    /// What it is called in messages.
    pub name: String,
    /// Header and table of contents.
    pub contents: Arc<Contents>,
    bytes: Box<dyn ReadSeek>,
    length: u64,
    limits: Limits,
    /// The set that it is a member of.
    pub(super) set: Option<Box<Set>>,
    /// Where the vertices of the member are that it leans on.
    other: Option<Arc<[[i32; 3]]>>,
}

pub(super) trait ReadSeek: Read + Seek {}
impl<T: Read + Seek> ReadSeek for T {}

impl Uwm {
    /// Opens a file; decoding it may take so many bytes of `memory`.
    ///
    /// # Errors
    /// Those of the medium, and where header or table of contents are at fault; all with the name of the file.
    pub fn open(path: &Path, memory: u64) -> anyhow::Result<Self> {
        let name = input::name(path);
        let file = if is_stream(path) { None } else { Some(File::open(path).with_context(|| name.clone())?) };
        let bytes: Box<dyn ReadSeek> = match file {
            Some(file) if file.metadata().is_ok_and(|file| file.is_file()) => Box::new(file),
            // Standard input and pipes only go forward.
            _ => Box::new(Cursor::new(input::read_bytes(path)?)),
        };
        Self::over(bytes, name, memory)
    }

    /// An open file, from its first byte.
    ///
    /// # Errors
    /// As [`Uwm::open`].
    pub fn of_file(mut file: File, name: &str, memory: u64) -> anyhow::Result<Self> {
        file.seek(SeekFrom::Start(0)).with_context(|| name.to_owned())?;
        Self::over(Box::new(file), name.to_owned(), memory)
    }

    /// A file in memory.
    ///
    /// # Errors
    /// Where header or table of contents are at fault, with the name.
    pub fn in_memory(bytes: Vec<u8>, name: &str) -> anyhow::Result<Self> {
        Self::of_bytes(bytes, name, DEFAULT_MEMORY)
    }

    /// A file in memory; decoding it may take so many bytes of `memory` besides.
    ///
    /// # Errors
    /// As [`Uwm::in_memory`].
    pub fn of_bytes(bytes: Vec<u8>, name: &str, memory: u64) -> anyhow::Result<Self> {
        Self::over(Box::new(Cursor::new(bytes)), name.to_owned(), memory)
    }

    fn over(mut bytes: Box<dyn ReadSeek>, name: String, memory: u64) -> anyhow::Result<Self> {
        let limits = Limits { memory, ..Limits::default() };
        if let Some(set) = Set::read(&mut *bytes, &name).with_context(|| name.clone())? {
            let contents = set.contents.members[0].contents.clone();
            let empty = Box::new(Cursor::new(Vec::new()));
            let set = Some(Box::new(set.over(bytes)));
            return Ok(Self { name, contents, bytes: empty, length: 0, limits, set, other: None });
        }
        let contents = read_contents(&mut *bytes).with_context(|| name.clone())?;
        let length = bytes.seek(SeekFrom::End(0)).with_context(|| name.clone())?;
        Ok(Self { name, contents, bytes, length, limits, set: None, other: None })
    }

    /// Becomes a file in memory, with what its vertices are told by.
    pub(super) fn become_member(
        &mut self,
        file: Vec<u8>,
        contents: Arc<Contents>,
        other: Option<Arc<[[i32; 3]]>>,
    ) {
        self.length = file.len() as u64;
        self.bytes = Box::new(Cursor::new(file));
        (self.contents, self.other) = (contents, other);
    }

    /// Bytes of memory that decoding may take.
    pub fn memory(&self) -> u64 {
        self.limits.memory
    }

    /// Bytes that are there, whatever the table of contents says.
    pub fn length(&self) -> u64 {
        self.length
    }

    /// The byte where the file ends, if it ends too early: what is before it is a mesh all the same, once the base is there.
    pub fn cut(&self) -> Option<u64> {
        (self.length < self.contents.file_bytes()).then_some(self.length)
    }

    /// The way to the finest mesh of the first `most` bytes that are there.
    ///
    /// # Errors
    /// Where the file ends before the base does.
    pub fn prefix(&self, most: u64) -> anyhow::Result<Plan> {
        let missing = self.contents.base_end().saturating_sub(self.length);
        if missing > 0 {
            let what = format!(
                "the file is cut off: the base, the least that is a mesh, lacks {}",
                count(missing, "byte")
            );
            return Err(anyhow!("{}: byte {}: {what}", self.name, self.length));
        }
        Ok(plan(&self.contents, Want::Bytes(most.min(self.length))))
    }

    /// That there is such a level, and all of it.
    ///
    /// # Errors
    /// Which levels there are.
    pub fn check_level(&self, level: u32) -> anyhow::Result<()> {
        let (name, base) = (&self.name, self.contents.base_level());
        if level > base {
            bail!("{name}: there is no level {level}: the levels are 0 (finest) to {base} (base)");
        }
        let contents = &self.contents;
        // What is known of a mesh is no part of it: metadata may be missing.
        let beyond =
            [contents.residue(), contents.attribute_atoms(0), contents.correction(), contents.order()];
        let ends = beyond.into_iter().filter(|_| level == 0).map(|atoms| contents.bytes(atoms).end);
        let end = ends.fold(contents.bytes(contents.steps(level)).end, u64::max);
        let Some(there) = self.cut().filter(|&there| there < end) else { return Ok(()) };
        let (finest, missing) = (self.finest_level(&self.prefix(there)?), count(end - there, "byte"));
        bail!(
            "{name}: byte {there}: the file is cut off: level {level} lacks {missing}, level {finest} is there"
        )
    }

    /// The finest level that a plan completes.
    pub fn finest_level(&self, plan: &Plan) -> u32 {
        if plan.complete { plan.level } else { plan.level + 1 }
    }

    /// Where a file that is cut off ends and what it has, in words for the user.
    pub fn cut_text(&self, there: u64) -> String {
        let (contents, bytes) = (&self.contents, self.contents.file_bytes());
        let ends = format!("{}: cut off at byte {} of {}", self.name, grouped(there), grouped(bytes));
        let Ok(prefix) = self.prefix(there) else {
            return format!("{ends}: there is no mesh before the base's end");
        };
        let level = self.finest_level(&prefix);
        let is_there = match prefix.complete {
            true => "is there".to_owned(),
            false => format!("and a part of level {} are there", level - 1),
        };
        let lacks = [
            ("residue", contents.residue()),
            ("exact coordinates", contents.correction()),
            ("order", contents.order()),
        ];
        let lacks: Vec<_> = lacks
            .into_iter()
            .filter(|(_, atoms)| !atoms.is_empty() && contents.bytes(atoms.clone()).end > there)
            .map(|(name, _)| name)
            .collect();
        let lacks = if lacks.is_empty() { String::new() } else { format!(", without {}", lacks.join(", ")) };
        format!("{ends}: level {level} of {} {is_there}{lacks}", contents.base_level())
    }

    /// The metadata, if the file has any and is not cut off before them.
    ///
    /// # Errors
    /// As [`Uwm::decode`].
    pub fn metadata(&mut self) -> anyhow::Result<Option<Metadata>> {
        if self.contents.bytes(self.contents.metadata()).end > self.length {
            return Ok(None);
        }
        let mut plan = plan_from_keyframe(&self.contents, self.contents.base_level());
        plan.parts = vec![self.part(self.contents.metadata())];
        let decoder =
            self.decode(Some(&plan), Until::default(), &mut Progress::new(true), &mut |_, _| Ok(()))?;
        Ok(decoder.metadata().cloned())
    }

    /// The scene's JSON, if the file has one and is not cut off before it.
    ///
    /// # Errors
    /// As [`Uwm::decode`].
    pub fn scene(&mut self) -> anyhow::Result<Option<Vec<u8>>> {
        let number = self.contents.scene();
        let mut decoder = self.resources(number.into_iter())?;
        Ok(number.and_then(|number| decoder.take_resource(number)))
    }

    /// A decoder that has these resources and nothing else, as far as the file is not cut off before them.
    ///
    /// # Errors
    /// As [`Uwm::decode`].
    pub fn resources(&mut self, numbers: impl Iterator<Item = usize>) -> anyhow::Result<Decoder> {
        let mut plan = plan_from_keyframe(&self.contents, self.contents.base_level());
        let parts = numbers.map(|number| self.part(self.contents.resources[number].atoms.clone()));
        plan.parts = parts.filter(|part| part.bytes.end <= self.length).collect();
        self.decode(Some(&plan), Until::default(), &mut Progress::new(true), &mut |_, _| Ok(()))
    }

    /// Decodes a level; level 0 with all that belongs to it. Of a set, of the member at hand.
    ///
    /// # Errors
    /// As [`Uwm::check_level`] and [`Uwm::decode`].
    pub fn level(&mut self, level: u32, progress: &mut Progress) -> anyhow::Result<Decoder> {
        self.check_level(level)?;
        let plan = self.way_to(level)?;
        self.decode(plan.as_ref(), Until { level, ..Until::default() }, progress, &mut |_, _| Ok(()))
    }

    /// What to decode for a level; `None` for level 0, which takes the whole file, and all its checksums with it.
    ///
    /// # Errors
    /// As [`Uwm::prefix`].
    pub fn way_to(&self, level: u32) -> anyhow::Result<Option<Plan>> {
        match self.cut() {
            Some(there) if level == 0 => Ok(Some(self.prefix(there)?)),
            _ if level == 0 => Ok(None),
            _ => {
                // The mesh needs no resource: one that is cut off may be missing.
                let plan = plan(&self.contents, Want::Level(level));
                let is_cut = |number: usize| {
                    let entry = &self.contents.resources[number];
                    self.contents.bytes(entry.atoms.clone()).end > self.length
                };
                Ok(Some(plan.without(&self.contents, is_cut)))
            }
        }
    }

    /// Adds the resources that decoding has passed over, as far as they are there.
    ///
    /// # Errors
    /// Those of the medium and of the decoder, with the name of the file.
    pub fn complete_scene(&mut self, decoder: &mut Decoder) -> anyhow::Result<()> {
        let contents = self.contents.clone();
        for (number, entry) in contents.resources.iter().enumerate() {
            let bytes = contents.bytes(entry.atoms.clone());
            if decoder.resource(number).is_some() || bytes.end > self.length {
                continue;
            }
            self.bytes.seek(SeekFrom::Start(bytes.start)).with_context(|| self.name.clone())?;
            let mut resource = Vec::new();
            let read = (&mut self.bytes).take(bytes.end - bytes.start).read_to_end(&mut resource);
            read.with_context(|| self.name.clone())?;
            decoder.add_resource(number, &resource).map_err(|e| fault(&self.name, e))?;
        }
        Ok(())
    }

    /// Some consecutive atoms.
    pub fn part(&self, atoms: Range<usize>) -> Part {
        Part { bytes: self.contents.bytes(atoms.clone()), atoms }
    }

    /// Decodes a plan, or the whole file and all its checksums without one, until it is through or stopped. `heard` is told of every event.
    ///
    /// # Errors
    /// Those of the medium and of the decoder, with the name of the file; those of `heard`.
    pub fn decode(
        &mut self,
        plan: Option<&Plan>,
        until: Until,
        progress: &mut Progress,
        heard: &mut dyn FnMut(&Decoder, &Event) -> anyhow::Result<()>,
    ) -> anyhow::Result<Decoder> {
        let end = plan.and_then(|plan| plan.parts.iter().map(|part| part.bytes.end).max());
        if let Some(missing) = end.and_then(|end| end.checked_sub(self.length)).filter(|&missing| missing > 0)
        {
            let what = format!("the file is cut off: {missing} bytes are missing");
            return Err(fault(&self.name, FormatError::new(self.length, "3.1", what).into()));
        }
        let options = Options { limits: self.limits, until, ..Options::default() };
        let mut decoder = match plan {
            Some(plan) => Decoder::of_plan(self.contents.clone(), plan, options),
            None => Decoder::new(options),
        };
        if let Some(other) = &self.other {
            decoder.beside(other.clone());
        }
        let runs: Vec<Range<u64>> = match plan {
            Some(plan) => plan.parts.iter().map(|part| part.bytes.clone()).collect(),
            None => std::iter::once(0..u64::MAX).collect(),
        };
        let total = plan.map_or(self.contents.file_bytes(), Plan::byte_count);
        let mut done = 0;
        let mut chunk = Vec::with_capacity(CHUNK as usize);
        for run in runs {
            self.bytes.seek(SeekFrom::Start(run.start)).with_context(|| self.name.clone())?;
            let mut rest = (&mut self.bytes).take(run.end - run.start);
            loop {
                chunk.clear();
                (&mut rest).take(CHUNK).read_to_end(&mut chunk).with_context(|| self.name.clone())?;
                if chunk.is_empty() {
                    break;
                }
                decoder.push(&chunk);
                while let Some(event) = decoder.poll().map_err(|e| fault(&self.name, e))? {
                    heard(&decoder, &event)?;
                    if event == Event::Stopped {
                        return Ok(decoder);
                    }
                }
                done += chunk.len() as u64;
                progress.update("decode", done, total);
            }
        }
        decoder.finish().map_err(|e| fault(&self.name, e))?;
        Ok(decoder)
    }
}

/// Memory for decoding, unless told otherwise.
pub const DEFAULT_MEMORY: u64 = 4 << 30;

fn read_contents(bytes: &mut dyn ReadSeek) -> anyhow::Result<Arc<Contents>> {
    let mut parser = Parser::new();
    let mut chunk = Vec::new();
    loop {
        let missing = match parser.parse(&mut &chunk[..]).map_err(Error::from)? {
            Parsed::Contents(contents) => return Ok(contents),
            Parsed::NeedMore(missing) => missing,
            _ => return Err(anyhow!("there is no table of contents")),
        };
        chunk.clear();
        (&mut *bytes).take(missing as u64).read_to_end(&mut chunk)?;
        if chunk.is_empty() {
            parser.finish().map_err(Error::from)?;
            return Err(io::Error::from(io::ErrorKind::UnexpectedEof).into());
        }
    }
}

fn fault(name: &str, error: Error) -> anyhow::Error {
    let more_helps = matches!(error, Error::Limit { what: "memory in bytes", .. });
    let error = anyhow::Error::from(error);
    if more_helps {
        return anyhow!("{name}: {error} (--max-memory allows more)");
    }
    error.context(name.to_owned())
}

/// Bytes read at a time.
const CHUNK: u64 = 64 << 10;
