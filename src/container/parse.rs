//! Reads a file as its bytes arrive, in pieces of any size (spec §3.1).

use std::ops::Range;
use std::sync::Arc;

use super::contents::{Atom, AtomKind, Contents};
use super::header::Header;
use super::table;
use crate::error::FormatError;

/// What [`Parser::parse`] found.
#[derive(Debug, PartialEq)]
pub enum Parsed<'a> {
    /// All input is used up; so many more bytes complete the part at hand.
    NeedMore(usize),
    /// Header and table of contents, once and before any atom.
    Contents(Arc<Contents>),
    /// The next atom. Its checksum has been checked.
    Atom {
        /// Its place in [`Contents::atoms`].
        index: usize,
        /// Its bytes.
        payload: &'a [u8],
    },
    /// The last atom has been told.
    End,
}

/// A parser that is fed as bytes arrive and holds at most one atom, or header or table, at a time.
///
/// However the bytes are cut, it tells the same and ends with the same error.
#[derive(Debug, Default)]
pub struct Parser {
    buffer: Vec<u8>,
    /// Whether the buffer holds a part that has been told already.
    told: bool,
    part: Part,
    /// The first fault: all that comes after it is without meaning.
    fault: Option<FormatError>,
    trailing: u64,
}

#[derive(Debug, Default)]
enum Part {
    #[default]
    Header,
    Table(Header),
    Atoms(Arc<Contents>, Range<usize>),
}

impl Parser {
    /// A parser of a whole file, from its first byte.
    pub fn new() -> Self {
        Self::default()
    }

    /// A parser of some atoms of a file whose contents are known; its input starts at the first of them.
    pub fn of_atoms(contents: Arc<Contents>, atoms: Range<usize>) -> Self {
        let atoms = atoms.start..atoms.end.min(contents.atoms.len());
        Self { part: Part::Atoms(contents, atoms), ..Self::default() }
    }

    /// Takes bytes off the front of `input` and tells what they complete. Call it until it answers
    /// [`Parsed::NeedMore`] or [`Parsed::End`]: then, and only then, all of `input` is used up.
    ///
    /// # Errors
    /// [`FormatError`] where a rule of spec §3 is broken; from then on always the same one.
    pub fn parse(&mut self, input: &mut &[u8]) -> Result<Parsed<'_>, FormatError> {
        loop {
            if let Some(fault) = &self.fault {
                return Err(fault.clone());
            }
            let Some(need) = self.need() else {
                self.trailing += input.len() as u64;
                *input = &[];
                return Ok(Parsed::End);
            };
            if let Some(missing) = self.fill(need, input) {
                self.check_start()?;
                return Ok(Parsed::NeedMore(missing));
            }
            match self.tell() {
                Ok(Told::Nothing) => {}
                Ok(Told::Contents(contents)) => return Ok(Parsed::Contents(contents)),
                Ok(Told::Atom(index)) => return Ok(Parsed::Atom { index, payload: &self.buffer }),
                Err(fault) => self.fault = Some(fault),
            }
        }
    }

    /// Header and table of contents, as soon as they have been read.
    pub fn contents(&self) -> Option<&Arc<Contents>> {
        match &self.part {
            Part::Atoms(contents, _) => Some(contents),
            _ => None,
        }
    }

    /// Says that no more bytes will come.
    ///
    /// # Errors
    /// The fault that stopped the parser; a [`FormatError`] where bytes are missing or where there are more
    /// bytes than atoms.
    pub fn finish(&self) -> Result<(), FormatError> {
        if let Some(fault) = &self.fault {
            return Err(fault.clone());
        }
        let held = if self.told { 0 } else { self.buffer.len() as u64 };
        let (start, end, least) = match &self.part {
            Part::Header => (0, Header::SIZE as u64, "at least "),
            Part::Table(header) => (Header::SIZE as u64, header.table_end(), "at least "),
            Part::Atoms(contents, atoms) => {
                let bytes = contents.bytes(atoms.clone());
                if atoms.is_empty() && self.trailing > 0 {
                    let what = format!("{} bytes behind the last atom", self.trailing);
                    return Err(FormatError::new(self.end_offset(contents, atoms), "3.1", what));
                }
                (bytes.start, bytes.end, "")
            }
        };
        match end - start - held {
            0 => Ok(()),
            missing => {
                let what = format!("the file is cut off: {least}{missing} bytes are missing");
                Err(FormatError::new(start + held, "3.1", what))
            }
        }
    }

    /// Bytes of the part at hand, or `None` behind the last.
    fn need(&self) -> Option<usize> {
        match &self.part {
            Part::Header => Some(Header::SIZE),
            Part::Table(header) => Some(header.table_bytes as usize),
            Part::Atoms(contents, atoms) if !atoms.is_empty() => {
                contents.atoms.get(atoms.start).map(|atom| atom.length as usize)
            }
            Part::Atoms(..) => None,
        }
    }

    /// Moves up to `need` bytes into the buffer; tells how many are missing, if any.
    fn fill(&mut self, need: usize, input: &mut &[u8]) -> Option<usize> {
        if std::mem::take(&mut self.told) {
            self.buffer.clear();
        }
        let (taken, rest) = input.split_at(input.len().min(need - self.buffer.len()));
        self.buffer.extend_from_slice(taken);
        *input = rest;
        let missing = need - self.buffer.len();
        (missing > 0).then_some(missing)
    }

    /// Refuses a file of another kind or version as early as its bytes allow.
    fn check_start(&mut self) -> Result<(), FormatError> {
        if let Part::Header = self.part {
            Header::check_start(&self.buffer).inspect_err(|fault| self.fault = Some(fault.clone()))?;
        }
        Ok(())
    }

    /// Tells the part in the buffer, which is complete, and goes on to the next.
    fn tell(&mut self) -> Result<Told, FormatError> {
        self.told = true;
        match &mut self.part {
            Part::Header => {
                let bytes = self.buffer.first_chunk().expect("a full buffer holds a header");
                self.part = Part::Table(Header::read(bytes)?);
                Ok(Told::Nothing)
            }
            Part::Table(header) => {
                let contents = Arc::new(table::read(*header, &std::mem::take(&mut self.buffer))?);
                self.part = Part::Atoms(contents.clone(), 0..contents.atoms.len());
                Ok(Told::Contents(contents))
            }
            Part::Atoms(contents, atoms) => {
                let index = atoms.start;
                contents.check(index, &self.buffer)?;
                atoms.start += 1;
                let skipped =
                    matches!(contents.atoms.get(index), Some(Atom { kind: AtomKind::Optional(_), .. }));
                Ok(if skipped { Told::Nothing } else { Told::Atom(index) })
            }
        }
    }

    /// Where the atoms that have been told end.
    fn end_offset(&self, contents: &Contents, atoms: &Range<usize>) -> u64 {
        contents.bytes(0..atoms.end).end
    }
}

/// Reads header and table from the start of a file, or `None` where `bytes` ends inside them.
///
/// # Errors
/// [`FormatError`] where a rule of spec §3 is broken.
pub fn parse_contents(mut bytes: &[u8]) -> Result<Option<Arc<Contents>>, FormatError> {
    let mut parser = Parser::new();
    match parser.parse(&mut bytes)? {
        Parsed::Contents(contents) => Ok(Some(contents)),
        _ => Ok(None),
    }
}

enum Told {
    Nothing,
    Contents(Arc<Contents>),
    Atom(usize),
}
