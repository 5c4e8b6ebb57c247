//! The header, at a fixed place and of a fixed size (spec §3.2).

use super::fields::Fields;
use crate::error::FormatError;
use crate::limits::{MAX_ELEMENTS, MAX_LEVELS, MAX_TABLE_BYTES};
use crate::mesh::lattice::Lattice;

/// What the first bytes of a file tell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Header {
    /// Vertices of level 0, without what the residue holds; at most [`MAX_ELEMENTS`].
    pub vertices: u32,
    /// Triangles of level 0, without what the residue holds; at most [`MAX_ELEMENTS`].
    pub triangles: u32,
    /// Vertices of the base.
    pub base_vertices: u32,
    /// Triangles of the base.
    pub base_triangles: u32,
    /// Levels, the base included; 1 to [`MAX_LEVELS`].
    pub level_count: u32,
    /// Whether refinements are coded under the rich models (spec §5.5).
    pub rich_models: bool,
    /// The lattice of level 0: finite origin, finite step of at least 0.
    pub lattice: Lattice,
    /// The largest coordinates, in lattice units; the smallest are 0.
    pub maximum: [u32; 3],
    /// Bytes of the table of contents, its checksum included.
    pub table_bytes: u32,
}

impl Header {
    /// Bytes of the header, its checksum included.
    pub const SIZE: usize = 88;

    /// The level number of the base.
    pub fn base_level(&self) -> u32 {
        self.level_count - 1
    }

    /// The position of the corner of the bounding box opposite to the origin.
    pub fn far_corner(&self) -> [f64; 3] {
        self.lattice.position(self.maximum.map(|m| m as i32))
    }

    /// Where the table of contents ends and the first atom starts, in bytes from the start of the file.
    pub fn table_end(&self) -> u64 {
        Self::SIZE as u64 + u64::from(self.table_bytes)
    }

    /// Checks as much of magic and version as `bytes`, the start of a file, holds.
    pub(super) fn check_start(bytes: &[u8]) -> Result<(), FormatError> {
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

    /// Reads the first [`Header::SIZE`] bytes of a file.
    ///
    /// # Errors
    /// [`FormatError`] where a rule of spec §3.2, §3.4 or §3.6 is broken.
    pub fn read(bytes: &[u8; Self::SIZE]) -> Result<Self, FormatError> {
        Self::check_start(bytes)?;
        let (body, checksum) = bytes.split_at(Self::SIZE - 4);
        if crc32c::crc32c(body).to_le_bytes() != *checksum {
            return Err(FormatError::new(0, "3.4", "the header does not match its checksum"));
        }
        let mut fields = Fields::new(&body[10..], 10, "3.2");
        let flags = fields.u16()?;
        fields.require(flags == 0, 10, || format!("unknown flags {flags:#06x}"))?;
        let [vertices, triangles, base_vertices, base_triangles] = read_counts(&mut fields)?;
        let level_count = u32::from(fields.u16()?);
        fields.require(level_count >= 1, 28, || "a file without levels".to_owned())?;
        limit(level_count, MAX_LEVELS, 28, "the number of levels")?;
        let reserved = fields.u16()?;
        fields.require(reserved == 0, 30, || "reserved bytes are not zero".to_owned())?;
        let origin = [fields.f64("the origin")?, fields.f64("the origin")?, fields.f64("the origin")?];
        let step = fields.size_f64("the lattice step")?;
        let bits = u32::from(fields.u8()?);
        fields.require((Lattice::MIN_BITS..=Lattice::MAX_BITS).contains(&bits), 64, || {
            format!("a lattice of {bits} bits; allowed {} to {}", Lattice::MIN_BITS, Lattice::MAX_BITS)
        })?;
        let reserved = fields.u8()?;
        fields.require(reserved == 0, 65, || "reserved bytes are not zero".to_owned())?;
        let models = fields.u8()?;
        fields.require(models <= 1, 66, || format!("unknown set of models {models}"))?;
        let reserved = fields.u8()?;
        fields.require(reserved == 0, 67, || "reserved bytes are not zero".to_owned())?;
        let maximum = [fields.u32()?, fields.u32()?, fields.u32()?];
        let inside = maximum.iter().all(|&m| m < 1 << bits);
        fields.require(inside, 68, || "the bounding box leaves the lattice".to_owned())?;
        let table_bytes = fields.u32()?;
        limit(table_bytes, MAX_TABLE_BYTES, 80, "the length of the table of contents")?;
        let lattice = Lattice { origin, step, bits };
        let header = Self {
            vertices,
            triangles,
            base_vertices,
            base_triangles,
            level_count,
            rich_models: models == 1,
            lattice,
            maximum,
            table_bytes,
        };
        let finite = header.far_corner().iter().all(|x| x.is_finite());
        fields.require(finite, 68, || "the bounding box is not finite".to_owned())?;
        header.check_counts()?;
        Ok(header)
    }

    /// The bytes of the header, its checksum included; a value that its field cannot hold becomes one that is
    /// refused on reading.
    #[cfg(any(test, feature = "encode"))]
    pub(super) fn to_bytes(self) -> Vec<u8> {
        let mut out = MAGIC.to_vec();
        out.extend(VERSION.to_le_bytes());
        out.extend(0u16.to_le_bytes());
        for count in [self.vertices, self.triangles, self.base_vertices, self.base_triangles] {
            out.extend(count.to_le_bytes());
        }
        out.extend(u16::try_from(self.level_count).unwrap_or(u16::MAX).to_le_bytes());
        out.extend(0u16.to_le_bytes());
        for x in self.lattice.origin.into_iter().chain([self.lattice.step]) {
            out.extend(x.to_le_bytes());
        }
        let bits = u8::try_from(self.lattice.bits).unwrap_or(u8::MAX);
        out.extend([bits, 0, u8::from(self.rich_models), 0]);
        for count in self.maximum.into_iter().chain([self.table_bytes]) {
            out.extend(count.to_le_bytes());
        }
        out.extend(crc32c::crc32c(&out).to_le_bytes());
        out
    }

    /// Whether a manifold with these counts can exist (spec §3.6): every vertex has a triangle, no two edges
    /// join the same vertices, and an operation adds one vertex and one or two triangles.
    fn check_counts(&self) -> Result<(), FormatError> {
        let [vertices, triangles] = [self.base_vertices, self.base_triangles].map(u64::from);
        if vertices > 3 * triangles {
            return Err(FormatError::new(20, "3.6", "the base has more vertices than corners"));
        }
        if 3 * triangles > vertices * vertices.saturating_sub(1) {
            return Err(FormatError::new(
                24,
                "3.6",
                "the base has more triangles than its vertices can span",
            ));
        }
        let added = u64::from(self.vertices).checked_sub(vertices);
        let grown = u64::from(self.triangles).checked_sub(triangles);
        let (Some(added), Some(grown)) = (added, grown) else {
            return Err(FormatError::new(20, "3.2", "the base is larger than level 0"));
        };
        if !(added..=2 * added).contains(&grown) {
            let what = format!("{added} operations cannot add {grown} triangles");
            return Err(FormatError::new(12, "3.6", what));
        }
        let refined = u64::from(self.base_level());
        if added < refined || (refined == 0 && added > 0) || (triangles == 0 && refined > 0) {
            let what = format!("{added} operations cannot make {} levels", self.level_count);
            return Err(FormatError::new(28, "3.2", what));
        }
        Ok(())
    }
}

fn read_counts(fields: &mut Fields) -> Result<[u32; 4], FormatError> {
    let mut counts = [0; 4];
    for count in &mut counts {
        let at = fields.offset();
        *count = fields.u32()?;
        limit(*count, MAX_ELEMENTS, at, "a count of vertices or triangles")?;
    }
    Ok(counts)
}

fn limit(value: u32, allowed: u32, at: u64, name: &str) -> Result<(), FormatError> {
    if value <= allowed {
        return Ok(());
    }
    Err(FormatError::new(at, "3.6", format!("{name} is {value}, allowed {allowed}")))
}

/// What a `.uwm` file begins with (spec §3.2). As in PNG: a high bit, a name, and line ends that a transfer as text would
/// change.
pub const MAGIC: [u8; 8] = *b"\x89UWM\r\n\x1A\n";
/// The format version that this module reads and writes.
pub const VERSION: u16 = 1;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::container::testing::{GOLDEN_HEADER, golden_header};
    use crate::fuzzing::mend;

    #[test]
    fn golden_bytes() {
        assert_eq!(Header::read(&GOLDEN_HEADER).unwrap(), golden_header());
        assert_eq!(golden_header().to_bytes(), GOLDEN_HEADER);
        assert_eq!(golden_header().far_corner(), [126.5, 0.0, 10.0]);
    }

    /// What is told of the golden header with `bytes` written at `at`, its checksum mended.
    fn fault(at: usize, bytes: &[u8]) -> (u64, &'static str, String) {
        let mut header = GOLDEN_HEADER;
        header[at..at + bytes.len()].copy_from_slice(bytes);
        mend(&mut header);
        let fault = Header::read(&header).expect_err("a rule is broken");
        (fault.offset, fault.section, fault.what)
    }

    #[test]
    fn each_rule_is_checked() {
        let rules: [(usize, &[u8], u64, &str, &str); 31] = [
            (0, b"P", 0, "3.2", "not a .uwm file"),
            (4, b"\n", 0, "3.2", "not a .uwm file any more: it was transferred as text"),
            (8, &[2, 0], 8, "3.2", "written by format version 2; this decoder reads version 1"),
            (8, &[0, 0], 8, "3.2", "written by format version 0; this decoder reads version 1"),
            (10, &[0, 1], 10, "3.2", "unknown flags 0x0100"),
            (
                12,
                &[1, 0, 0, 64],
                12,
                "3.6",
                "a count of vertices or triangles is 1073741825, allowed 1073741824",
            ),
            (
                24,
                &[1, 0, 0, 64],
                24,
                "3.6",
                "a count of vertices or triangles is 1073741825, allowed 1073741824",
            ),
            (12, &[3], 20, "3.2", "the base is larger than level 0"),
            (16, &[3], 20, "3.2", "the base is larger than level 0"),
            (12, &[4], 12, "3.6", "0 operations cannot add 2 triangles"),
            (16, &[7], 12, "3.6", "1 operations cannot add 3 triangles"),
            (16, &[4], 12, "3.6", "1 operations cannot add 0 triangles"),
            (24, &[1], 20, "3.6", "the base has more vertices than corners"),
            (24, &[5], 24, "3.6", "the base has more triangles than its vertices can span"),
            (28, &[0], 28, "3.2", "a file without levels"),
            (28, &[1, 16], 28, "3.6", "the number of levels is 4097, allowed 4096"),
            (28, &[1], 28, "3.2", "1 operations cannot make 1 levels"),
            (28, &[3], 28, "3.2", "1 operations cannot make 3 levels"),
            (31, &[1], 30, "3.2", "reserved bytes are not zero"),
            (46, &[0xF0, 0x7F], 40, "3.2", "the origin is not finite"),
            (62, &[0xF8, 0x7F], 56, "3.2", "the lattice step is not finite"),
            (63, &[0xBF], 56, "3.2", "the lattice step is negative"),
            (64, &[7], 64, "3.2", "a lattice of 7 bits; allowed 8 to 24"),
            (64, &[25], 64, "3.2", "a lattice of 25 bits; allowed 8 to 24"),
            (65, &[1], 65, "3.2", "reserved bytes are not zero"),
            (66, &[2], 66, "3.2", "unknown set of models 2"),
            (67, &[1], 67, "3.2", "reserved bytes are not zero"),
            (69, &[1], 68, "3.2", "the bounding box leaves the lattice"),
            (79, &[1], 68, "3.2", "the bounding box leaves the lattice"),
            (62, &[0xE0, 0x7F], 68, "3.2", "the bounding box is not finite"),
            (
                80,
                &[1, 0, 0, 4],
                80,
                "3.6",
                "the length of the table of contents is 67108865, allowed 67108864",
            ),
        ];
        for (at, bytes, offset, section, what) in rules {
            assert_eq!(fault(at, bytes), (offset, section, what.to_owned()), "{bytes:?} at {at}");
        }
        assert_eq!(fault(12, &[0; 16]).2, "0 operations cannot make 2 levels");
    }

    #[test]
    fn the_checksum_covers_every_byte() {
        for at in 10..Header::SIZE {
            let mut header = GOLDEN_HEADER;
            header[at] ^= 0x10;
            let fault = Header::read(&header).unwrap_err();
            assert_eq!((fault.offset, fault.section), (0, "3.4"), "byte {at}");
        }
    }

    #[test]
    fn an_empty_mesh_has_a_header() {
        let lattice = Lattice { origin: [0.0; 3], step: 0.0, bits: 8 };
        let empty = Header {
            vertices: 0,
            triangles: 0,
            base_vertices: 0,
            base_triangles: 0,
            level_count: 1,
            rich_models: true,
            lattice,
            maximum: [0; 3],
            table_bytes: 40,
        };
        assert_eq!(Header::read(empty.to_bytes().as_slice().try_into().unwrap()), Ok(empty));
    }
}
