//! Writes a whole file (spec §3).

use std::io::Write;
use std::sync::Arc;

use super::contents::{AtomKind, Contents, Level};
use super::header::Header;
use super::parse_contents;
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
    /// Whether refinements are coded under the rich models (spec §5.5).
    pub rich_models: bool,
    /// The largest coordinates, in lattice units.
    pub maximum: [u32; 3],
    /// The levels, by number; the last is the base.
    pub levels: Vec<Level>,
    pub(super) pieces: Vec<Piece>,
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
        Self { lattice, rich_models: false, maximum, levels, pieces: Vec::new() }
    }

    /// Adds one precision or refinement atom: its operations or vertex steps, and how many triangles they add.
    pub fn atom(&mut self, kind: AtomKind, level: u32, items: u32, triangles: u32, bytes: Vec<u8>) {
        self.pieces.push(Piece { kind, level, items, triangles, bytes });
    }

    /// Adds the payload of a base, keyframe, residue, correction, order or metadata, cut into as many atoms as it takes.
    pub fn payload(&mut self, kind: AtomKind, level: u32, bytes: &[u8]) {
        for chunk in bytes.chunks(MAX_ATOM_BYTES as usize) {
            self.atom(kind, level, 0, 0, chunk.to_vec());
        }
    }

    /// Writes the file and tells its contents.
    ///
    /// # Errors
    /// [`Error::Parameter`] where the parts do not make a file that follows spec §3; nothing is written then.
    /// [`Error::Io`] where `out` fails.
    pub fn write(mut self, out: &mut impl Write) -> Result<Arc<Contents>> {
        if let Some(piece) =
            self.pieces.iter().find(|p| AtomKind::from_byte(p.kind.to_byte()) != Some(p.kind))
        {
            return Err(Error::Parameter(format!("{:?} is not an optional kind of atom", piece.kind)));
        }
        let level_count = u32::try_from(self.levels.len()).unwrap_or(u32::MAX);
        let last = (5, 0, 0);
        self.pieces.sort_by_key(|piece| piece.kind.rank(piece.level, level_count).unwrap_or(last));
        let head = self.head()?;
        let refuse = |fault: FormatError| Error::Parameter(fault.what);
        let contents = parse_contents(&head).map_err(refuse)?;
        let contents = contents.ok_or_else(|| Error::Parameter("the table of contents is cut off".into()))?;
        out.write_all(&head)?;
        for piece in &self.pieces {
            out.write_all(&piece.bytes)?;
        }
        out.flush()?;
        Ok(contents)
    }

    /// Header and table of contents of the pieces as they stand, right or wrong.
    pub(super) fn head(&self) -> Result<Vec<u8>> {
        let (Some(level_0), Some(base)) = (self.levels.first(), self.levels.last()) else {
            return Err(Error::Parameter("a file without levels".to_owned()));
        };
        if self.levels.len() > MAX_LEVELS as usize {
            return Err(Error::Parameter(format!("{} levels, allowed {MAX_LEVELS}", self.levels.len())));
        }
        let table = self.table()?;
        let header = Header {
            vertices: level_0.vertices,
            triangles: level_0.triangles,
            base_vertices: base.vertices,
            base_triangles: base.triangles,
            level_count: self.levels.len() as u32,
            rich_models: self.rich_models,
            lattice: self.lattice,
            maximum: self.maximum,
            table_bytes: u32::try_from(table.len()).unwrap_or(u32::MAX),
        };
        let mut head = header.to_bytes();
        head.extend(table);
        Ok(head)
    }

    fn table(&self) -> Result<Vec<u8>> {
        let mut table = Vec::new();
        let mut above: Option<&Level> = None;
        for level in self.levels.iter().rev() {
            if let Some(above) = above {
                for (fine, coarse) in [(level.vertices, above.vertices), (level.triangles, above.triangles)] {
                    let added = fine.checked_sub(coarse);
                    let added = added
                        .ok_or_else(|| Error::Parameter("a level is smaller than the one above".into()))?;
                    varint::write(added.into(), &mut table);
                }
            }
            table.push(u8::try_from(level.precision).unwrap_or(u8::MAX));
            table.extend(level.max_error.to_le_bytes());
            table.extend(level.rms_error.to_le_bytes());
            above = Some(level);
        }
        varint::write(self.pieces.len() as u64, &mut table);
        for piece in &self.pieces {
            table.push(piece.kind.to_byte());
            let length = piece.bytes.len() as u64;
            for count in [piece.level.into(), length, piece.items.into(), piece.triangles.into()] {
                varint::write(count, &mut table);
            }
            table.extend(crc32c::crc32c(&piece.bytes).to_le_bytes());
        }
        table.extend(crc32c::crc32c(&table).to_le_bytes());
        Ok(table)
    }
}
