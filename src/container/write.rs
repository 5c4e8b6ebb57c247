//! Writes a whole file (spec §3).

use std::io::Write;
use std::sync::Arc;

use super::attributes::AttributeEntry;
use super::checksum::{self, SHORT};
use super::contents::{AtomKind, Contents, Level};
use super::errors::Codes;
use super::header::{Coding, Header, Start};
use super::magnitude;
use super::parse_contents;
use super::resources::ResourceKind;
use super::table::{ORIGIN_SHORT, SHARPER, SINGLE, STEP_SHORT, form_of, tells_values};
use crate::entropy::varint;
use crate::error::{Error, FormatError, Result};
use crate::limits::{MAX_ATOM_BYTES, MAX_LEVELS};
use crate::mesh::lattice::Lattice;

/// Gathers levels and payloads, then writes the file.
///
/// Payloads may be added in any order of kinds and levels: they are written in the order of spec §3.3, those
/// of one kind and level in the order they came. [`AtomKind::Optional`] ones come last.
#[derive(Clone, Debug, PartialEq)]
pub struct FileBuilder {
    /// The lattice of level 0.
    pub lattice: Lattice,
    /// How refinements are coded.
    pub coding: Coding,
    /// The largest coordinates, in lattice units.
    pub maximum: [u32; 3],
    /// The levels, by number; the last is the base.
    pub levels: Vec<Level>,
    /// The attributes; at each level below the base at which any are born there is one payload of [`AtomKind::Attributes`].
    pub attributes: Vec<AttributeEntry>,
    pub(super) resources: Vec<Told>,
    pub(super) pieces: Vec<Piece>,
}

/// A resource as the table tells of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Told {
    pub kind: ResourceKind,
    pub place: u32,
    /// How many of the pieces are its own.
    pub atoms: usize,
}

/// What becomes one atom.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Piece {
    pub kind: AtomKind,
    pub level: u32,
    pub items: u32,
    pub triangles: u32,
    pub bytes: Vec<u8>,
}

impl FileBuilder {
    /// A file of these levels, without payloads as yet.
    pub fn new(lattice: Lattice, maximum: [u32; 3], levels: Vec<Level>) -> Self {
        Self {
            lattice,
            coding: Coding::default(),
            maximum,
            levels,
            attributes: Vec::new(),
            resources: Vec::new(),
            pieces: Vec::new(),
        }
    }

    /// The header that the file will have, as far as levels and lattice make it.
    pub fn header(&self) -> Header {
        let [finest, base] = [self.levels.first(), self.levels.last()]
            .map(|level| level.map_or([0; 2], |level| [level.vertices, level.triangles]));
        Header {
            vertices: finest[0],
            triangles: finest[1],
            base_vertices: base[0],
            base_triangles: base[1],
            level_count: self.levels.len() as u32,
            lattice: self.lattice,
            coding: self.coding,
            maximum: self.maximum,
            table_bytes: 0,
        }
    }

    /// Adds one precision or refinement atom: its operations or vertex steps, and how many triangles they add.
    pub fn atom(&mut self, kind: AtomKind, level: u32, items: u32, triangles: u32, bytes: Vec<u8>) {
        self.pieces.push(Piece { kind, level, items, triangles, bytes });
    }

    /// Adds the payload of a base, keyframe, residue, correction, order or metadata, or of attributes born at a level, cut into as many atoms
    /// as it takes.
    pub fn payload(&mut self, kind: AtomKind, level: u32, bytes: &[u8]) {
        for chunk in bytes.chunks(MAX_ATOM_BYTES as usize) {
            self.atom(kind, level, 0, 0, chunk.to_vec());
        }
    }

    /// Adds the payload of components that are born at a level, so many vertices and triangles, cut into as many atoms as it takes.
    pub fn birth(&mut self, level: u32, born: [u32; 2], bytes: &[u8]) {
        self.payload(AtomKind::Birth, level, bytes);
        if let Some(last) = self.pieces.last_mut() {
            [last.items, last.triangles] = born;
        }
    }

    /// Adds a resource that stands behind the atoms of level `place`, cut into as many atoms as it takes: at least one byte. Resources are
    /// written in the order they come, so that their places may not rise. A scene's JSON is to be [packed](super::packed_scene()).
    pub fn resource(&mut self, kind: ResourceKind, place: u32, bytes: &[u8]) {
        self.resources.push(Told { kind, place, atoms: bytes.len().div_ceil(MAX_ATOM_BYTES as usize) });
        self.payload(AtomKind::Resource, place, bytes);
    }

    /// Writes the file and tells its contents.
    ///
    /// # Errors
    /// [`Error::Parameter`] where the parts do not make a file that follows spec §3; nothing is written then.
    /// [`Error::Io`] where `out` fails.
    pub fn write(mut self, out: &mut impl Write) -> Result<Arc<Contents>> {
        self.sort();
        let head = self.head()?;
        let refuse = |fault: FormatError| Error::Parameter(fault.what);
        let contents = parse_contents(&head).map_err(refuse)?;
        let contents = contents.ok_or_else(|| Error::Parameter("the table of contents is cut off".into()))?;
        self.compare(&contents)?;
        out.write_all(&head)?;
        for piece in &self.pieces {
            out.write_all(&piece.bytes)?;
        }
        out.flush()?;
        Ok(contents)
    }

    /// Puts the payloads into the order of the file.
    pub(super) fn sort(&mut self) {
        let level_count = u32::try_from(self.levels.len()).unwrap_or(u32::MAX);
        let last = (5, 0, 0);
        self.pieces.sort_by_key(|piece| piece.kind.rank(piece.level, level_count).unwrap_or(last));
    }

    /// Whether the table says of the payloads what they are: it tells much by their places alone, and the last share of a pass not at all.
    fn compare(&self, contents: &Contents) -> Result<()> {
        let told = contents.atoms.iter().map(|atom| (atom.kind, atom.level, atom.items, atom.triangles));
        let given = self.pieces.iter().map(|piece| (piece.kind, piece.level, piece.items, piece.triangles));
        match told.zip(given).find(|(told, given)| told != given) {
            None => Ok(()),
            Some((told, given)) => refused(format!("an atom is {given:?} where the levels want {told:?}")),
        }
    }

    /// Header and table of contents of the pieces as they stand.
    pub(super) fn head(&self) -> Result<Vec<u8>> {
        if self.levels.is_empty() || self.levels.len() > MAX_LEVELS as usize {
            return refused(format!("{} levels, allowed 1 to {MAX_LEVELS}", self.levels.len()));
        }
        let table = self.table()?;
        let (bytes, attributes) = (table.len() + 4, self.attributes.len());
        let resources = !self.resources.is_empty();
        let start = u32::try_from(bytes).ok();
        let start = start.and_then(|bytes| Start::new(bytes, self.coding, attributes, resources));
        let Some(start) = start else {
            return refused(format!("a table of contents of {bytes} bytes and {attributes} attributes"));
        };
        let mut head = start.bytes.to_vec();
        head.extend(table);
        head.extend(crc32c::crc32c(&head).to_le_bytes());
        Ok(head)
    }

    fn table(&self) -> Result<Vec<u8>> {
        let base = self.levels.len() - 1;
        let astray = |piece: &&Piece| {
            let (kind, level) = (piece.kind, piece.level);
            let has_place = (level as usize) < base && tells_values(&self.attributes, level);
            kind == AtomKind::Attributes && level > 0 && !has_place
        };
        if let Some(&Piece { kind, level, .. }) = self.pieces.iter().find(astray) {
            return refused(format!("an atom of kind {kind:?} at level {level} has no place"));
        }
        let mut table = Vec::new();
        self.lattice(&mut table)?;
        for attribute in &self.attributes {
            attribute.write(&mut table)?;
        }
        self.told_resources(&mut table)?;
        varint::write(self.levels.len() as u64, &mut table);
        let mut pieces = &self.pieces[..];
        let unit = magnitude::unit(self.lattice.step);
        let mut before: Option<(&Level, [u16; 2])> = None;
        let mut of_attributes = Codes::new(&self.attributes);
        for (j, level) in self.levels.iter().enumerate().rev() {
            let codes = [level.max_error, level.rms_error].map(|error| magnitude::code(error, unit));
            let [Some(max), Some(rms)] = codes else {
                return refused(format!("level {j} has an error that is negative, not finite or too large"));
            };
            let mut run = |kind, single: u32, table: &mut Vec<u8>| {
                run(take(&mut pieces, kind, j as u32), single, table)
                    .ok_or_else(|| Error::Parameter(format!("level {j} has no atom of kind {kind:?}")))
            };
            match before {
                None => {
                    for count in [level.vertices, level.triangles, level.precision] {
                        varint::write(count.into(), &mut table);
                    }
                    table.extend([max, rms].iter().flat_map(|code| code.to_le_bytes()));
                    of_attributes.write(&level.attributes, &self.attributes, j as u32, &mut table)?;
                    run(AtomKind::Base, 0, &mut table)?;
                }
                Some((above, codes)) => {
                    let born = self.born(j as u32);
                    let [added, single, finer] = steps(level, above, born)
                        .ok_or_else(|| Error::Parameter(format!("level {j} cannot come of the one above")))?;
                    let marks =
                        [(single, SINGLE), (finer, SHARPER)].map(|(n, mark)| u64::from(n.min(1) * mark));
                    if born != [0; 2] {
                        varint::write(0, &mut table);
                        born.into_iter().for_each(|count| varint::write(count.into(), &mut table));
                    }
                    varint::write(4 * u64::from(added) + marks[0] + marks[1], &mut table);
                    for more in [single, finer].into_iter().filter(|&more| more > 0) {
                        varint::write(more.into(), &mut table);
                    }
                    for (code, before) in [max, rms].into_iter().zip(codes) {
                        varint::write(magnitude::difference(code, before), &mut table);
                    }
                    of_attributes.write(&level.attributes, &self.attributes, j as u32, &mut table)?;
                    if finer > 0 {
                        run(AtomKind::Precision, 0, &mut table)?;
                    }
                    if added > 0 || born == [0; 2] {
                        run(AtomKind::Refinement, single, &mut table)?;
                    }
                    if born != [0; 2] {
                        run(AtomKind::Birth, 0, &mut table)?;
                    }
                    if tells_values(&self.attributes, j as u32) {
                        run(AtomKind::Attributes, 0, &mut table)?;
                    }
                }
            }
            take(&mut pieces, AtomKind::Resource, j as u32);
            before = Some((level, [max, rms]));
        }
        while let Some(&Piece { kind, level, .. }) = pieces.first() {
            let Some(byte) = kind.to_byte().filter(|&byte| AtomKind::from_byte(byte) == Some(kind)) else {
                return refused(format!("an atom of kind {kind:?} at level {level} has no place"));
            };
            table.push(byte);
            if kind == AtomKind::Keyframe {
                varint::write(level.into(), &mut table);
            }
            run(take(&mut pieces, kind, level), 0, &mut table);
        }
        Ok(table)
    }

    /// What the table says of the resources, with the entries of their atoms.
    fn told_resources(&self, table: &mut Vec<u8>) -> Result<()> {
        if self.resources.is_empty() {
            return Ok(());
        }
        varint::write(self.resources.len() as u64, table);
        // Those of one resource stand together: they are of one level.
        let mut pieces = &self.pieces[..];
        for (number, resource) in self.resources.iter().enumerate() {
            table.push(resource.kind.to_byte());
            varint::write(resource.place.into(), table);
            let others = pieces.iter().take_while(|piece| piece.kind != AtomKind::Resource).count();
            let (atoms, rest) = pieces[others..].split_at(resource.atoms.min(pieces.len() - others));
            let are_its_own =
                |piece: &Piece| (piece.kind, piece.level) == (AtomKind::Resource, resource.place);
            if atoms.len() < resource.atoms || !atoms.iter().all(are_its_own) {
                return refused(format!("resource {number} does not stand behind level {}", resource.place));
            }
            run(atoms, 0, table)
                .ok_or_else(|| Error::Parameter(format!("resource {number} has no bytes")))?;
            pieces = rest;
        }
        match pieces.iter().find(|piece| piece.kind == AtomKind::Resource) {
            Some(piece) => refused(format!("a resource behind level {} that is not told of", piece.level)),
            None => Ok(()),
        }
    }

    /// Vertices and triangles of the components that are born at a level.
    fn born(&self, j: u32) -> [u32; 2] {
        let births = self.pieces.iter().filter(|piece| piece.kind == AtomKind::Birth && piece.level == j);
        births.fold([0; 2], |sum, piece| {
            [sum[0].saturating_add(piece.items), sum[1].saturating_add(piece.triangles)]
        })
    }

    fn lattice(&self, table: &mut Vec<u8>) -> Result<()> {
        let Lattice { origin, step, bits } = self.lattice;
        let most = 1u64.checked_shl(bits).map_or(0, |points| points - 1);
        if bits > Lattice::MAX_BITS || self.maximum.iter().any(|&m| u64::from(m) > most) {
            return refused(format!("a lattice of {bits} bits to {:?}", self.maximum));
        }
        let form = form_of(origin, step);
        table.push(bits as u8 | form);
        for (x, short) in origin.map(|x| (x, ORIGIN_SHORT)).into_iter().chain([(step, STEP_SHORT)]) {
            match form & short {
                0 => table.extend(x.to_le_bytes()),
                _ => table.extend((x as f32).to_le_bytes()),
            }
        }
        for m in self.maximum {
            varint::write(most - u64::from(m), table);
        }
        Ok(())
    }
}

/// Vertices that the operations of a level add, how many of them add one triangle only, and the bits that it gains, where so much is born;
/// `None` where it cannot be.
fn steps(level: &Level, above: &Level, born: [u32; 2]) -> Option<[u32; 3]> {
    let added = level.vertices.checked_sub(above.vertices)?.checked_sub(born[0])?;
    let triangles = level.triangles.checked_sub(above.triangles)?.checked_sub(born[1])?;
    let single = (2 * u64::from(added)).checked_sub(triangles.into())?;
    Some([added, u32::try_from(single).ok()?, above.precision.checked_sub(level.precision)?])
}

/// The pieces of one kind and level that stand in front.
fn take<'a>(pieces: &mut &'a [Piece], kind: AtomKind, level: u32) -> &'a [Piece] {
    let count = pieces.iter().take_while(|piece| piece.kind == kind && piece.level == level).count();
    let (run, rest) = pieces.split_at(count);
    *pieces = rest;
    run
}

/// Writes the entries of the atoms of one payload or pass; `None` where there are none. `single` of the operations add one triangle.
fn run(pieces: &[Piece], single: u32, table: &mut Vec<u8>) -> Option<()> {
    let mut left = u64::from(single);
    let (last, _) = pieces.split_last()?;
    for piece in pieces {
        let more = !std::ptr::eq(piece, last);
        varint::write(2 * piece.bytes.len() as u64 + u64::from(more), table);
        if more && matches!(piece.kind, AtomKind::Precision | AtomKind::Refinement) {
            varint::write(piece.items.into(), table);
            if left > 0 {
                let single = (2 * u64::from(piece.items)).saturating_sub(piece.triangles.into());
                varint::write(single, table);
                left = left.saturating_sub(single);
            }
        }
        let checksum = checksum::of_atom(&piece.bytes).to_le_bytes();
        table.extend(&checksum[..if piece.bytes.len() < SHORT as usize { 2 } else { 4 }]);
    }
    Some(())
}

fn refused<T>(what: String) -> Result<T> {
    Err(Error::Parameter(what))
}
