//! Views of buffers compressed as EXT_meshopt_compression and KHR_meshopt_compression have it: the codecs of meshoptimizer
//! (A. Kapoulkine), read and written here without its library, which wants a C++ compiler.

mod filters;
mod indices;
mod vertices;

use super::json::At;
use crate::error::Result;

/// The names of the extension.
pub(super) const EXTENSIONS: [&str; 2] = ["EXT_meshopt_compression", "KHR_meshopt_compression"];

/// What a view unpacks to.
pub(super) struct Packing {
    mode: Mode,
    filter: Filter,
    /// Elements, and bytes of each.
    pub count: usize,
    pub stride: usize,
}

/// What the elements of a view are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Mode {
    Attributes,
    Triangles,
    Indices,
}

impl Mode {
    /// As the extension calls it.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Attributes => "ATTRIBUTES",
            Self::Triangles => "TRIANGLES",
            Self::Indices => "INDICES",
        }
    }

    /// Packs elements of `stride` bytes: vertices, or indices of triangles, which may begin with another corner when they are unpacked.
    /// `None` for lists of indices, which are only read.
    pub(super) fn pack(self, bytes: &[u8], stride: usize) -> Option<Vec<u8>> {
        let index = |bytes: &[u8]| bytes.iter().rev().fold(0, |index, &byte| index << 8 | u32::from(byte));
        match self {
            Self::Attributes => Some(vertices::pack(bytes, stride)),
            Self::Triangles => Some(indices::pack(&bytes.chunks(stride).map(index).collect::<Vec<_>>())),
            Self::Indices => None,
        }
    }
}

#[derive(Clone, Copy, PartialEq)]
enum Filter {
    None,
    Octahedral,
    Quaternion,
    Exponential,
    Color,
}

impl Packing {
    /// Reads the extension's object.
    ///
    /// # Errors
    /// Where mode and filter are not known, or the stride is not one for them.
    pub(super) fn new(at: &At<'_>) -> Result<Self> {
        let mode = match at.needed("mode")?.value.as_str() {
            Some("ATTRIBUTES") => Mode::Attributes,
            Some("TRIANGLES") => Mode::Triangles,
            Some("INDICES") => Mode::Indices,
            _ => return Err(at.needed("mode")?.fault("no mode that is known")),
        };
        let filter = match at.text("filter")? {
            None | Some("NONE") => Filter::None,
            Some("OCTAHEDRAL") => Filter::Octahedral,
            Some("QUATERNION") => Filter::Quaternion,
            Some("EXPONENTIAL") => Filter::Exponential,
            Some("COLOR") => Filter::Color,
            Some(_) => return Err(at.needed("filter")?.fault("no filter that is known")),
        };
        let (count, stride) = (at.needed("count")?.number()?, at.needed("byteStride")?.number()?);
        let fits = match (mode, filter) {
            (Mode::Attributes, Filter::None | Filter::Exponential) => {
                stride.is_multiple_of(4) && (4..=256).contains(&stride)
            }
            (Mode::Attributes, Filter::Octahedral | Filter::Color) => matches!(stride, 4 | 8),
            (Mode::Attributes, Filter::Quaternion) => stride == 8,
            (_, Filter::None) => matches!(stride, 2 | 4),
            _ => false,
        };
        if !fits {
            return Err(at.fault(format!("elements of {stride} bytes do not go with its mode and filter")));
        }
        if mode == Mode::Triangles && !count.is_multiple_of(3) {
            return Err(at.fault(format!("{count} indices are no triangles")));
        }
        Ok(Self { mode, filter, count, stride })
    }

    /// Unpacks the view; `count` times `stride` bytes have been debited.
    ///
    /// # Errors
    /// Where the data are damaged, or end early.
    pub(super) fn unpack(&self, packed: &[u8], at: &At<'_>) -> Result<Vec<u8>> {
        // A block of vertices has a control byte or more, an index is a byte or more, or a third of that.
        let most = packed.len().saturating_mul(MOST_A_BYTE);
        if self.count > most {
            return Err(at.fault(format!("{} elements in {} bytes", self.count, packed.len())));
        }
        let unpacked = match self.mode {
            Mode::Attributes => vertices::unpack(packed, self.count, self.stride),
            Mode::Triangles => indices::triangles(packed, self.count).map(|list| self.indices(&list)),
            Mode::Indices => indices::sequence(packed, self.count).map(|list| self.indices(&list)),
        };
        let mut bytes = unpacked.ok_or_else(|| at.fault("the compressed data are damaged, or end early"))?;
        match (self.filter, self.stride) {
            (Filter::None, _) => {}
            (Filter::Octahedral, 4) => filters::octahedral_8(&mut bytes),
            (Filter::Octahedral, _) => filters::octahedral_16(&mut bytes),
            (Filter::Quaternion, _) => filters::quaternion(&mut bytes),
            (Filter::Exponential, _) => filters::exponential(&mut bytes),
            (Filter::Color, 4) => filters::color_8(&mut bytes),
            (Filter::Color, _) => filters::color_16(&mut bytes),
        }
        Ok(bytes)
    }

    fn indices(&self, list: &[u32]) -> Vec<u8> {
        if self.stride == 2 {
            list.iter().flat_map(|&index| (index as u16).to_le_bytes()).collect()
        } else {
            list.iter().flat_map(|index| index.to_le_bytes()).collect()
        }
    }
}

/// Most elements that a byte may stand for: as many as a block has.
const MOST_A_BYTE: usize = 256;

/// The next so many bytes of what is left.
fn take<'a>(rest: &mut &'a [u8], count: usize) -> Option<&'a [u8]> {
    let (taken, behind) = rest.split_at_checked(count)?;
    *rest = behind;
    Some(taken)
}
