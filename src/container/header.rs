//! The header, of a fixed size (spec §3.2), and what is told with it at the front of the table of contents (spec §3.3).

use crate::error::FormatError;
#[cfg(any(test, feature = "encode"))]
use crate::limits::MAX_TABLE_BYTES;
use crate::limits::{MAX_ATTRIBUTES, MAX_LIFTING};
use crate::mesh::lattice::Lattice;

/// What a file tells of the whole mesh before all else.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Header {
    /// Vertices of level 0, without what the residue holds; at most [`MAX_ELEMENTS`](crate::limits::MAX_ELEMENTS).
    pub vertices: u32,
    /// Triangles of level 0, without what the residue holds; at most [`MAX_ELEMENTS`](crate::limits::MAX_ELEMENTS).
    pub triangles: u32,
    /// Vertices of the base.
    pub base_vertices: u32,
    /// Triangles of the base.
    pub base_triangles: u32,
    /// Levels, the base included; 1 to [`MAX_LEVELS`](crate::limits::MAX_LEVELS).
    pub level_count: u32,
    /// The lattice of level 0: finite origin, finite step of at least 0.
    pub lattice: Lattice,
    /// How refinements are coded.
    pub coding: Coding,
    /// The largest coordinates, in lattice units; the smallest are 0.
    pub maximum: [u32; 3],
    /// Bytes of the table of contents, its checksum included.
    pub table_bytes: u32,
}

impl Header {
    /// Bytes of the header.
    pub const SIZE: usize = 16;

    /// The level number of the base.
    pub fn base_level(&self) -> u32 {
        self.level_count - 1
    }

    /// The position of the corner of the bounding box opposite to the origin.
    pub fn far_corner(&self) -> [f64; 3] {
        self.lattice.position(self.maximum.map(|m| m as i32))
    }

    /// Diagonal of the bounding box, in units of the mesh.
    pub fn diagonal(&self) -> f64 {
        let squares = self.maximum.map(|m| f64::from(m) * f64::from(m));
        (squares[0] + squares[1] + squares[2]).sqrt() * self.lattice.step
    }

    /// Where the table of contents ends and the first atom starts, in bytes from the start of the file.
    pub fn table_end(&self) -> u64 {
        Self::SIZE as u64 + u64::from(self.table_bytes)
    }
}

/// How refinements are coded (spec §3.2).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Coding {
    /// How far splits move the ends of their edges, in 64ths of the new vertex's height (spec §5.4.5): at most [`MAX_LIFTING`], and 0, not at
    /// all, where the lattice has [`Lattice::MAX_BITS`].
    pub lifting: u8,
    /// Whether decisions have the rich models (spec §5.5).
    pub rich_models: bool,
}

/// What the first [`Header::SIZE`] bytes tell: how much is to be read before all else is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Start {
    /// Bytes of the table of contents, its checksum included.
    pub table_bytes: u32,
    /// The bytes themselves, which the checksum of the table covers.
    pub bytes: [u8; Header::SIZE],
}

impl Start {
    /// Checks as much of magic and version as `bytes`, the start of a file, holds.
    pub fn check(bytes: &[u8]) -> Result<(), FormatError> {
        let magic = &bytes[..bytes.len().min(MAGIC.len())];
        if !MAGIC.starts_with(magic) {
            let what = if magic.starts_with(&MAGIC[..4]) {
                "not a .uwm file any more: it was transferred as text"
            } else {
                "not a .uwm file"
            };
            return Err(FormatError::new(0, "3.2", what));
        }
        match bytes.get(8..10) {
            Some(&[low, high]) if u16::from_le_bytes([low, high]) != VERSION => {
                let version = u16::from_le_bytes([low, high]);
                let what =
                    format!("written by format version {version}; this decoder reads version {VERSION}");
                Err(FormatError::new(8, "3.2", what))
            }
            _ => Ok(()),
        }
    }

    /// Reads the header. Its checksum is that of the table.
    pub fn read(bytes: &[u8; Header::SIZE]) -> Result<Self, FormatError> {
        Self::check(bytes)?;
        if bytes[11] == SET {
            return Err(FormatError::new(11, "15.1", super::set::SetContents::NO_MESH));
        }
        let [.., low, middle, high] = *bytes;
        Ok(Self { table_bytes: u32::from_le_bytes([low, middle, high, 0]), bytes: *bytes })
    }

    /// How refinements are coded: what only a sound header need tell.
    pub fn coding(&self) -> Result<Coding, FormatError> {
        let [_, _, _, _, _, _, _, _, _, _, lifting, models, ..] = self.bytes;
        let refuse = |at, what| Err(FormatError::new(at, "3.2", what));
        if lifting > MAX_LIFTING {
            return refuse(10, format!("a lifting of {lifting} 64ths; allowed 0 to {MAX_LIFTING}"));
        }
        if models > 1 {
            return refuse(11, format!("unknown set of models {models}"));
        }
        Ok(Coding { lifting, rich_models: models == 1 })
    }

    /// How many attributes the table tells of; what only a sound header need tell.
    pub fn attributes(&self) -> Result<u8, FormatError> {
        let count = self.bytes[12] & !RESOURCES;
        if count > MAX_ATTRIBUTES {
            let what = format!("{count} attributes, allowed {MAX_ATTRIBUTES}");
            return Err(FormatError::new(12, "3.2", what));
        }
        Ok(count)
    }

    /// Whether the table tells of resources.
    pub fn has_resources(&self) -> bool {
        self.bytes[12] & RESOURCES > 0
    }

    /// The header of a table of so many bytes that tells of so many attributes, and perhaps of resources; `None` where they are too many.
    #[cfg(any(test, feature = "encode"))]
    pub fn new(table_bytes: u32, coding: Coding, attributes: usize, resources: bool) -> Option<Self> {
        let attributes = u8::try_from(attributes).ok().filter(|&count| count <= MAX_ATTRIBUTES)?;
        let attributes = attributes | if resources { RESOURCES } else { 0 };
        let mut bytes = [0; Header::SIZE];
        bytes[..8].copy_from_slice(&MAGIC);
        bytes[8..10].copy_from_slice(&VERSION.to_le_bytes());
        bytes[10..13].copy_from_slice(&[coding.lifting, u8::from(coding.rich_models), attributes]);
        bytes[13..].copy_from_slice(&table_bytes.to_le_bytes()[..3]);
        (table_bytes <= MAX_TABLE_BYTES).then_some(Self { table_bytes, bytes })
    }
}

/// What a `.uwm` file begins with (spec §3.2). As in PNG: a high bit, a name, and line ends that a transfer as text would
/// change.
pub const MAGIC: [u8; 8] = *b"\x89UWM\r\n\x1A\n";
/// The format version that this module reads and writes.
pub const VERSION: u16 = 1;
/// What stands for the set of models in a file that is a set of meshes (spec §15.1).
pub(super) const SET: u8 = 2;
/// Mark beside the number of attributes: that there are resources.
const RESOURCES: u8 = 128;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::container::testing::GOLDEN_HEADER;

    #[test]
    fn golden_bytes() {
        let start = Start::read(&GOLDEN_HEADER).unwrap();
        assert_eq!(
            (start.table_bytes, start.coding(), start.attributes()),
            (47, Ok(Coding::default()), Ok(0))
        );
        assert_eq!(
            (Start::new(47, Coding::default(), 0, false), start.has_resources()),
            (Some(start), false)
        );
        let coding = Coding { lifting: 32, rich_models: true };
        let start = Start::new(MAX_TABLE_BYTES, coding, 64, true).unwrap();
        assert_eq!((start.coding(), start.attributes(), start.has_resources()), (Ok(coding), Ok(64), true));
        assert_eq!(start.bytes[12..], [0xC0, 0xFF, 0xFF, 0xFF]);
        assert_eq!(Start::new(MAX_TABLE_BYTES + 1, coding, 0, false), None);
        assert_eq!([65, 128, 256].map(|attributes| Start::new(47, coding, attributes, false)), [None; 3]);
    }

    #[test]
    fn each_rule_is_checked() {
        let rules: [(usize, &[u8], u64, &str); 8] = [
            (0, b"P", 0, "not a .uwm file"),
            (4, b"\n", 0, "not a .uwm file any more: it was transferred as text"),
            (8, &[2, 0], 8, "written by format version 2; this decoder reads version 1"),
            (8, &[0, 0], 8, "written by format version 0; this decoder reads version 1"),
            (10, &[33], 10, "a lifting of 33 64ths; allowed 0 to 32"),
            (11, &[3], 11, "unknown set of models 3"),
            (12, &[65], 12, "65 attributes, allowed 64"),
            (12, &[128 + 127], 12, "127 attributes, allowed 64"),
        ];
        for (at, bytes, offset, what) in rules {
            let mut header = GOLDEN_HEADER;
            header[at..at + bytes.len()].copy_from_slice(bytes);
            let fault = Start::read(&header)
                .and_then(|start| start.coding().and(start.attributes()))
                .expect_err("a rule is broken");
            assert_eq!(fault, FormatError::new(offset, "3.2", what), "{bytes:?} at {at}");
        }
    }
}
