//! Reads a file as its bytes arrive, in pieces of any size (spec §3.1).

use std::ops::Range;
use std::sync::Arc;

use super::contents::{Atom, AtomKind, Contents};
use super::header::{Header, Start};
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
    stage: Stage,
    /// The first fault: all that comes after it is without meaning.
    fault: Option<FormatError>,
    trailing: u64,
}

impl Parser {
    /// A parser of a whole file, from its first byte.
    pub fn new() -> Self {
        Self::default()
    }

    /// A parser of some atoms of a file whose contents are known; its input starts at the first of them.
    pub fn of_atoms(contents: Arc<Contents>, atoms: Range<usize>) -> Self {
        let atoms = atoms.start..atoms.end.min(contents.atoms.len());
        Self { stage: Stage::Atoms(contents, atoms), ..Self::default() }
    }

    /// Takes bytes off the front of `input` and tells what they complete. Call it until it answers
    /// [`Parsed::NeedMore`] or [`Parsed::End`]: then all of `input` is used up.
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

    /// Whether the last atom has been told.
    pub fn is_complete(&self) -> bool {
        matches!(&self.stage, Stage::Atoms(_, atoms) if atoms.is_empty())
    }

    /// The atoms still to be told, and how many bytes of the first of them are there; none before the table of contents is.
    pub(crate) fn rest(&self) -> (Range<usize>, u64) {
        match &self.stage {
            Stage::Atoms(_, atoms) => (atoms.clone(), if self.told { 0 } else { self.buffer.len() as u64 }),
            _ => (0..0, 0),
        }
    }

    /// Ends before atom `end`, no sooner than behind those that have begun.
    pub(crate) fn end_before(&mut self, end: usize) {
        if let Stage::Atoms(_, atoms) = &mut self.stage {
            atoms.end = atoms.end.min(end.max(atoms.start));
        }
    }

    /// Header and table of contents, as soon as they have been read.
    pub fn contents(&self) -> Option<&Arc<Contents>> {
        match &self.stage {
            Stage::Atoms(contents, _) => Some(contents),
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
        let table = Header::SIZE as u64;
        let (start, end, least) = match &self.stage {
            Stage::Header => (0, table, "at least "),
            Stage::Table(start) => (table, table + u64::from(start.table_bytes), "at least "),
            Stage::Atoms(contents, atoms) => {
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
        match &self.stage {
            Stage::Header => Some(Header::SIZE),
            Stage::Table(start) => Some(start.table_bytes as usize),
            Stage::Atoms(contents, atoms) if !atoms.is_empty() => {
                contents.atoms.get(atoms.start).map(|atom| atom.length as usize)
            }
            Stage::Atoms(..) => None,
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
        if let Stage::Header = self.stage {
            Start::check(&self.buffer).inspect_err(|fault| self.fault = Some(fault.clone()))?;
        }
        Ok(())
    }

    /// Tells the part in the buffer, which is complete, and goes on to the next.
    fn tell(&mut self) -> Result<Told, FormatError> {
        self.told = true;
        match &mut self.stage {
            Stage::Header => {
                let bytes = self.buffer.first_chunk().expect("a full buffer holds a header");
                self.stage = Stage::Table(Start::read(bytes)?);
                Ok(Told::Nothing)
            }
            Stage::Table(start) => {
                let contents = Arc::new(table::read(start, &std::mem::take(&mut self.buffer))?);
                self.stage = Stage::Atoms(contents.clone(), 0..contents.atoms.len());
                Ok(Told::Contents(contents))
            }
            Stage::Atoms(contents, atoms) => {
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

/// What comes next; of atoms, those still to come.
#[derive(Debug, Default)]
enum Stage {
    #[default]
    Header,
    Table(Start),
    Atoms(Arc<Contents>, Range<usize>),
}

enum Told {
    Nothing,
    Contents(Arc<Contents>),
    Atom(usize),
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::container::testing::{self, GOLDEN_HEADER, GOLDEN_REST, small_file};
    use crate::container::{FileBuilder, Level};
    use crate::error::Error;
    use crate::mesh::lattice::Lattice;

    type Told = (Vec<(usize, Vec<u8>)>, Result<(), FormatError>);

    /// The atoms of a file, told in pieces of `size`, and how it ends.
    fn read(mut parser: Parser, bytes: &[u8], size: usize) -> Told {
        let mut atoms = Vec::new();
        for mut piece in bytes.chunks(size) {
            loop {
                match parser.parse(&mut piece) {
                    Ok(Parsed::Atom { index, payload }) => atoms.push((index, payload.to_vec())),
                    Ok(Parsed::Contents(_)) => {}
                    Ok(Parsed::NeedMore(_) | Parsed::End) => break,
                    Err(fault) => return (atoms, Err(fault)),
                }
            }
        }
        (atoms, parser.finish())
    }

    #[test]
    fn the_example_of_the_specification() {
        let bytes = [&GOLDEN_HEADER[..], &GOLDEN_REST].concat();
        let (atoms, outcome) = read(Parser::new(), &bytes, 50);
        assert_eq!((atoms, outcome), (vec![(0, b"abc".to_vec()), (1, b"de".to_vec())], Ok(())));
        let mut file = FileBuilder::new(testing::golden_header().lattice, [255, 0, 16], Vec::new());
        let level = |vertices, triangles, max_error, rms_error| Level {
            vertices,
            triangles,
            precision: 0,
            max_error,
            rms_error,
            attributes: Vec::new(),
        };
        file.levels = vec![level(5, 6, 0.0, 0.0), level(4, 4, 0.5, 0.25)];
        file.atom(AtomKind::Refinement, 0, 1, 2, b"de".to_vec());
        file.payload(AtomKind::Base, 1, b"abc");
        let mut written = Vec::new();
        file.write(&mut written).unwrap();
        assert_eq!(written, bytes);
    }

    #[test]
    fn it_asks_for_what_is_missing() {
        let bytes = [&GOLDEN_HEADER[..], &GOLDEN_REST].concat();
        let mut parser = Parser::new();
        for (piece, missing) in [(0..0, 16), (0..10, 6), (10..16, 47), (16..62, 1)] {
            assert_eq!(parser.parse(&mut &bytes[piece]), Ok(Parsed::NeedMore(missing)));
        }
        assert!(parser.contents().is_none());
        let mut rest = &bytes[62..];
        assert!(matches!(parser.parse(&mut rest), Ok(Parsed::Contents(_))));
        assert_eq!((rest, parser.contents().is_some()), (&b"abcde"[..], true));
    }

    #[test]
    fn every_truncation_is_an_error() {
        let bytes = testing::bytes(&small_file());
        let contents = testing::contents(&small_file());
        let table_end = contents.header.table_end() as usize;
        for cut in 0..bytes.len() {
            let (atoms, outcome) = read(Parser::new(), &bytes[..cut], 7);
            let missing = match cut {
                0..16 => format!("at least {} bytes", 16 - cut),
                _ if cut < table_end => format!("at least {} bytes", table_end - cut),
                _ => format!("{} bytes", bytes.len() - cut),
            };
            let what = format!("the file is cut off: {missing} are missing");
            assert_eq!(outcome, Err(FormatError::new(cut as u64, "3.1", what)));
            let whole = contents.atoms.iter().filter(|atom| atom.end() <= cut as u64);
            assert_eq!(atoms.len(), whole.filter(|atom| !matches!(atom.kind, AtomKind::Optional(_))).count());
        }
    }

    #[test]
    fn trailing_bytes_are_an_error() {
        let mut bytes = testing::bytes(&small_file());
        let end = bytes.len() as u64;
        bytes.extend([0; 3]);
        for size in [1, 64, bytes.len()] {
            let (atoms, outcome) = read(Parser::new(), &bytes, size);
            assert_eq!(atoms.len(), 10, "all atoms but the optional ones");
            assert_eq!(outcome, Err(FormatError::new(end, "3.1", "3 bytes behind the last atom")));
        }
    }

    #[test]
    fn a_damaged_atom_is_named() {
        let file = small_file();
        let (bytes, contents) = (testing::bytes(&file), testing::contents(&file));
        for (index, atom) in contents.atoms.iter().enumerate() {
            for at in atom.offset..atom.end() {
                let mut bytes = bytes.clone();
                bytes[at as usize] ^= 0x20;
                let (atoms, outcome) = read(Parser::new(), &bytes, 10);
                let what = format!(
                    "atom {index} ({:?}, level {}) does not match its checksum",
                    atom.kind, atom.level
                );
                assert_eq!(outcome, Err(FormatError::new(atom.offset, "3.4", what)));
                assert!(atoms.iter().all(|&(told, _)| told < index));
            }
        }
        assert!(contents.check(99, b"").is_err());
    }

    #[test]
    fn another_kind_of_file_is_refused_at_its_first_bytes() {
        for (start, what) in [
            (&b"ply\n"[..], "not a .uwm file"),
            (b"\x89UWM\n\x1A\n", "not a .uwm file any more: it was transferred as text"),
            (b"\x89UWM\r\n\x1A\n\x02\x01", "written by format version 258; this decoder reads version 1"),
        ] {
            assert_eq!(Parser::new().parse(&mut &start[..]).unwrap_err().what, what);
        }
    }

    #[test]
    fn a_file_that_breaks_a_rule_is_not_written() {
        let refused = |change: fn(&mut FileBuilder)| {
            let (mut file, mut out) = (small_file(), Vec::new());
            change(&mut file);
            let outcome = file.write(&mut out);
            assert!(matches!(outcome, Err(Error::Parameter(_))) && out.is_empty());
        };
        refused(|file| file.levels.clear());
        refused(|file| file.levels = vec![Level::default(); 5000]);
        refused(|file| file.levels.reverse());
        refused(|file| file.levels[0].vertices = u32::MAX);
        refused(|file| file.levels[2].precision = 256);
        refused(|file| file.lattice.bits = 256 + 12);
        refused(|file| file.maximum[1] = 4096);
        refused(|file| file.atom(AtomKind::Refinement, 0, 1, 2, vec![1]));
        refused(|file| file.atom(AtomKind::Optional(128), 0, 0, 0, vec![0; 65537]));
        refused(|file| file.atom(AtomKind::Optional(5), 0, 0, 0, vec![0]));
    }

    #[test]
    fn a_long_payload_spans_atoms() {
        let levels = vec![Level { vertices: 3, triangles: 1, ..Level::default() }];
        let lattice = Lattice { origin: [0.0; 3], step: 1.0, bits: 8 };
        let mut file = FileBuilder::new(lattice, [1; 3], levels);
        let payload: Vec<u8> = (0..150_000u32).map(|i| (i % 251) as u8).collect();
        file.payload(AtomKind::Base, 0, &payload);
        let mut bytes = Vec::new();
        let contents = file.write(&mut bytes).unwrap();
        let ends: Vec<_> = contents.atoms.iter().map(|atom| (atom.length, atom.last)).collect();
        assert_eq!(ends, [(65536, false), (65536, false), (18928, true)]);
        let (atoms, outcome) = read(Parser::new(), &bytes, 100_000);
        assert_eq!(outcome, Ok(()));
        assert_eq!(atoms.into_iter().flat_map(|(_, bytes)| bytes).collect::<Vec<_>>(), payload);
    }

    proptest! {
        #[test]
        fn round_trip(file in testing::any_file(), size in 1usize..200) {
            let (mut shuffled, mut bytes) = (file.clone(), Vec::new());
            // The writer finds the order of kinds and levels itself, and puts optional atoms last.
            shuffled.pieces.sort_by_key(|piece| piece.kind.to_byte().unwrap_or(9).wrapping_mul(37) ^ piece.level as u8);
            let written = shuffled.write(&mut bytes).unwrap();
            let (atoms, outcome) = read(Parser::new(), &bytes, size);
            prop_assert_eq!(outcome, Ok(()));
            for (told, level) in written.levels.iter().zip(&file.levels) {
                let up = |told: f64, error: f64| (error..=error * (1.0 + 1.0 / 128.0)).contains(&told);
                prop_assert!(up(told.max_error, level.max_error) && up(told.rms_error, level.rms_error));
                let exact = Level { max_error: level.max_error, rms_error: level.rms_error, ..told.clone() };
                prop_assert_eq!(&Level { attributes: Vec::new(), ..exact }, level);
            }
            prop_assert_eq!(written.header.lattice, file.lattice);
            prop_assert_eq!(written.file_bytes(), bytes.len() as u64);
            let known: Vec<_> = file.pieces.iter().filter(|piece| !matches!(piece.kind, AtomKind::Optional(_))).collect();
            prop_assert_eq!(atoms.len(), known.len());
            for ((index, payload), piece) in atoms.iter().zip(&known) {
                let atom = &written.atoms[*index];
                prop_assert_eq!((atom.kind, atom.level, atom.items), (piece.kind, piece.level, piece.items));
                prop_assert_eq!(payload, &piece.bytes);
            }
        }

        #[test]
        fn a_part_is_read_on_its_own(file in testing::any_file(), a: prop::sample::Index, b: prop::sample::Index) {
            let (bytes, contents) = (testing::bytes(&file), Arc::new(testing::contents(&file)));
            let (a, b) = (a.index(contents.atoms.len()), b.index(contents.atoms.len() + 1));
            let range = contents.bytes(a..b);
            let part = &bytes[range.start as usize..range.end as usize];
            let (atoms, outcome) = read(Parser::of_atoms(contents.clone(), a..b), part, 3);
            prop_assert_eq!(outcome, Ok(()));
            let (all, _) = read(Parser::new(), &bytes, 9);
            let expected: Vec<_> = all.into_iter().filter(|(index, _)| (a..b).contains(index)).collect();
            prop_assert_eq!(atoms, expected);
            if a < b {
                let parser = Parser::of_atoms(contents, a..b);
                prop_assert!(read(parser, &part[1..], 3).1.is_err());
            }
        }
    }
}
