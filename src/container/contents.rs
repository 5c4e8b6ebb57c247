//! What a file holds: its levels and its atoms (spec §3.3).

use std::ops::Range;

use super::attributes::AttributeEntry;
use super::checksum;
use super::header::Header;
use super::resources::ResourceEntry;
use super::want::Measure;
use crate::error::FormatError;

/// One level of detail; numbers run from the base down to 0, the finest.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Level {
    /// Vertices of the whole mesh at this level.
    pub vertices: u32,
    /// Triangles of the whole mesh at this level.
    pub triangles: u32,
    /// How many low bits of every coordinate this level lacks; at most 24, 0 at level 0.
    pub precision: u32,
    /// Largest distance of a point of either surface, the level or the input without its residue, from the other one, as the encoder found it:
    /// within some percent a bound. In the units of the input; finite. A file has it rounded up to the next of the numbers of spec §3.3.
    pub max_error: f64,
    /// Root mean square distance of the input's vertices from the level, of those on the boundary from its boundary, each weighted by the
    /// area round it; in the units of the input; finite. Rounded up as the other.
    pub rms_error: f64,
    /// How far its attributes are from those of the input, in the order of [`Contents::attributes`]: of those that it has and of which there
    /// is something to tell ([`AttributeEntry::has_level_errors`]). Empty at level 0, where only quantisation loses anything.
    pub attributes: Vec<AttributeError>,
}

/// How far an attribute of a level is from that of the input, as the encoder found it at some points of the surface: no bound (spec §3.3).
///
/// Differences of normals and tangents are angles, in degrees; those of other attributes lengths, in the units of the attribute, where
/// integers that stand for fractions count as these. Finite; a file has them rounded up to the next of the numbers of spec §3.3.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AttributeError {
    /// Its place in [`Contents::attributes`].
    pub attribute: usize,
    /// Root mean square over the surface of the input; of parts the share of the surface that has another part, 0 to 1.
    pub error: f64,
    /// What is not exceeded on 95 % of the surface; of parts nothing is told.
    pub high: Option<f64>,
}

impl Level {
    /// One of its errors, in the units of the input.
    pub fn error(&self, measure: Measure) -> f64 {
        match measure {
            Measure::Max => self.max_error,
            Measure::Rms => self.rms_error,
        }
    }
}

/// What an atom holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum AtomKind {
    /// A part of the base.
    Base,
    /// Lower bits for the vertices of the level above.
    Precision,
    /// Operations.
    Refinement,
    /// A part of the components that are born at a level, behind its operations.
    Birth,
    /// What no manifold can hold.
    Residue,
    /// A part of the [`Metadata`](super::Metadata).
    Metadata,
    /// A part of a keyframe.
    Keyframe,
    /// The input's coordinates, exactly.
    Correction,
    /// The order of the input's vertices and triangles.
    Order,
    /// Values of the attributes that are born at a level.
    Attributes,
    /// A part of a resource.
    Resource,
    /// Something this version does not know and may skip; 128 or above.
    Optional(u8),
}

impl AtomKind {
    /// The kind of a payload behind level 0, for its byte in the table; `None` where it is unknown and may not be skipped.
    pub(super) fn from_byte(byte: u8) -> Option<Self> {
        Some(match byte {
            3 => Self::Residue,
            4 => Self::Metadata,
            5 => Self::Keyframe,
            6 => Self::Correction,
            7 => Self::Order,
            8 => Self::Attributes,
            128.. => Self::Optional(byte),
            _ => return None,
        })
    }

    /// Its byte in the table; `None` where its place tells what it is.
    #[cfg(any(test, feature = "encode"))]
    pub(super) fn to_byte(self) -> Option<u8> {
        match self {
            Self::Base | Self::Precision | Self::Refinement | Self::Birth | Self::Resource => None,
            Self::Residue => Some(3),
            Self::Metadata => Some(4),
            Self::Keyframe => Some(5),
            Self::Correction => Some(6),
            Self::Order => Some(7),
            Self::Attributes => Some(8),
            Self::Optional(byte) => Some(byte),
        }
    }

    /// Place in the order of atoms of an atom of this kind at `level`, below `level_count`; `None` where it
    /// may stand anywhere behind level 0.
    pub(super) fn rank(self, level: u32, level_count: u32) -> Option<(u8, u32, u8)> {
        let depth = level_count.saturating_sub(level);
        Some(match self {
            Self::Base => (0, 0, 0),
            Self::Precision => (1, depth, 0),
            Self::Refinement => (1, depth, 1),
            Self::Birth => (1, depth, 2),
            Self::Attributes if level > 0 => (1, depth, 3),
            Self::Resource => (1, depth, 4),
            Self::Residue => (2, 0, 0),
            Self::Attributes => (2, 0, 1),
            Self::Correction => (2, 0, 2),
            Self::Order => (2, 0, 3),
            Self::Metadata => (3, 0, 0),
            Self::Keyframe => (4, depth, 0),
            Self::Optional(_) => return None,
        })
    }
}

/// The smallest run of bytes that is decoded once its last byte is there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Atom {
    /// What it holds.
    pub kind: AtomKind,
    /// The level it belongs to or leads to, of a resource its place; 0 for residue, correction, order, metadata and [`AtomKind::Optional`].
    pub level: u32,
    /// Where it starts, in bytes from the start of the file.
    pub offset: u64,
    /// Its bytes, 1 to [`MAX_ATOM_BYTES`](crate::limits::MAX_ATOM_BYTES).
    pub length: u32,
    /// Operations of a refinement atom, vertex steps of a precision atom, at least 1 in both; of the last atom of a birth the vertices born.
    pub items: u32,
    /// Triangles that the operations of a refinement atom add; of the last atom of a birth the triangles born.
    pub triangles: u32,
    /// The checksum of its bytes (spec §3.4).
    pub crc: u32,
    /// Vertices of the mesh once it and all atoms before it are decoded; for a keyframe, those of its level.
    pub vertices_after: u32,
    /// Triangles of the mesh once it and all atoms before it are decoded; for a keyframe, those of its level.
    pub triangles_after: u32,
    /// Whether it is the last of its kind at its level, so that its payload or pass ends with it.
    pub last: bool,
}

impl Atom {
    /// Where it ends, in bytes from the start of the file.
    pub fn end(&self) -> u64 {
        self.offset + u64::from(self.length)
    }
}

/// Header and table of contents of a file, checked against every rule of spec §3.
///
/// Ranges of atoms behind level 0 may enclose [`AtomKind::Optional`] ones.
#[derive(Clone, Debug, PartialEq)]
pub struct Contents {
    /// The header.
    pub header: Header,
    /// The levels, by number.
    pub levels: Vec<Level>,
    /// The attributes, in the order of the file.
    pub attributes: Vec<AttributeEntry>,
    /// The resources, in the order of the file.
    pub resources: Vec<ResourceEntry>,
    /// The atoms, in the order of the file.
    pub atoms: Vec<Atom>,
    pub(super) steps: Vec<Range<usize>>,
    pub(super) keyframes: Vec<Range<usize>>,
    pub(super) residue: Range<usize>,
    pub(super) attribute_atoms: Range<usize>,
    pub(super) correction: Range<usize>,
    pub(super) order: Range<usize>,
    pub(super) metadata: Range<usize>,
}

impl Contents {
    /// The level number of the base.
    pub fn base_level(&self) -> u32 {
        self.header.base_level()
    }

    /// Level `j`, or `None` where the file has no such level.
    pub fn level(&self, j: u32) -> Option<&Level> {
        self.levels.get(j as usize)
    }

    /// The coarsest level with at most this error, in the units of the input; level 0, where none is so close.
    pub fn level_within(&self, measure: Measure, most: f64) -> u32 {
        let close = |level: &Level| level.error(measure) <= most;
        self.levels.iter().rposition(close).unwrap_or(0) as u32
    }

    /// The atoms that lead from level `j + 1` to level `j`: precision, refinement, births, and but for level 0 the attributes that are born at
    /// it; at the base, its own. Those of [resources](Self::resource_atoms) that stand behind them are not counted in. Empty where the file has
    /// no such level.
    pub fn steps(&self, j: u32) -> Range<usize> {
        self.steps.get(j as usize).cloned().unwrap_or(0..0)
    }

    /// The vertices and triangles of the components that are born at level `j`.
    pub fn born(&self, j: u32) -> [u32; 2] {
        let steps = self.atoms.get(self.steps(j)).unwrap_or_default();
        let last = steps.iter().rfind(|atom| atom.kind != AtomKind::Attributes);
        last.filter(|atom| atom.kind == AtomKind::Birth).map_or([0; 2], |atom| [atom.items, atom.triangles])
    }

    /// How many operations some atoms have.
    pub fn operations(&self, atoms: Range<usize>) -> u64 {
        let atoms = self.atoms.get(atoms).unwrap_or_default();
        let refinements = atoms.iter().filter(|atom| atom.kind == AtomKind::Refinement);
        refinements.map(|atom| u64::from(atom.items)).sum()
    }

    /// The atoms of the keyframe of level `j`, or `None` where it has none.
    pub fn keyframe(&self, j: u32) -> Option<Range<usize>> {
        self.keyframes.get(j as usize).filter(|run| !run.is_empty()).cloned()
    }

    /// The residue's atoms; empty where there is none.
    pub fn residue(&self) -> Range<usize> {
        self.residue.clone()
    }

    /// The attributes whose values level `j` is told of, since they are born at it, by their places in [`Contents::attributes`]. Those that
    /// are constant are told by the table of contents.
    pub fn births_at(&self, j: u32) -> impl Iterator<Item = usize> + '_ {
        let told = move |entry: &AttributeEntry| entry.birth == j && entry.constant.is_none();
        self.attributes.iter().enumerate().filter(move |(_, entry)| told(entry)).map(|(k, _)| k)
    }

    /// The attributes that level `j` has, by their places in [`Contents::attributes`].
    pub fn alive_at(&self, j: u32) -> impl Iterator<Item = usize> + '_ {
        self.attributes.iter().enumerate().filter(move |(_, entry)| entry.birth >= j).map(|(k, _)| k)
    }

    /// The atoms of the values that level `j` is told of beside its mesh: of the attributes that are born at it. Those of the base and of
    /// keyframes are in these. Empty where there are none.
    pub fn attribute_atoms(&self, j: u32) -> Range<usize> {
        if j == 0 {
            return self.attribute_atoms.clone();
        }
        let steps = self.steps(j);
        let run = self.atoms.get(steps.clone()).unwrap_or_default();
        let count = run.iter().rev().take_while(|atom| atom.kind == AtomKind::Attributes).count();
        steps.end - count..steps.end
    }

    /// The correction's atoms; empty where coordinates are those of the lattice.
    pub fn correction(&self) -> Range<usize> {
        self.correction.clone()
    }

    /// The order's atoms; empty where the order of the input was not kept.
    pub fn order(&self) -> Range<usize> {
        self.order.clone()
    }

    /// The atoms that level `j` takes, from the first of the file: its prefix (spec §3.7), with the resources that stand behind it. Level 0 is the whole mesh, and takes residue,
    /// attributes, correction, order and metadata too, all but the keyframes. A level coarser than the base is taken for the base.
    pub fn prefix(&self, j: u32) -> Range<usize> {
        match j.min(self.base_level()) {
            0 => {
                0..self
                    .atoms
                    .iter()
                    .position(|atom| atom.kind == AtomKind::Keyframe)
                    .unwrap_or(self.atoms.len())
            }
            j => 0..self.resource_atoms(j).end,
        }
    }

    /// What level 0 takes beyond its mesh: the end of its [prefix](Self::prefix), with the resources that stand behind it.
    pub fn beyond_mesh(&self) -> Range<usize> {
        self.steps(0).end..self.prefix(0).end
    }

    /// The metadata's atoms; empty where there is none.
    pub fn metadata(&self) -> Range<usize> {
        self.metadata.clone()
    }

    /// Whether models start afresh at level `j`: at the base and wherever there is a keyframe.
    pub fn starts_segment(&self, j: u32) -> bool {
        j == self.base_level() || self.keyframe(j).is_some()
    }

    /// The levels that start a segment, coarse to fine; the base is the first.
    pub fn segments(&self) -> impl Iterator<Item = u32> + '_ {
        (0..self.header.level_count).rev().filter(|&j| self.starts_segment(j))
    }

    /// Where the base ends, in bytes from the start of the file.
    pub fn base_end(&self) -> u64 {
        self.bytes(self.steps(self.base_level())).end
    }

    /// Bytes of the whole file.
    pub fn file_bytes(&self) -> u64 {
        self.atoms.last().map_or(self.header.table_end(), Atom::end)
    }

    /// The bytes that a range of atoms takes in the file; an empty range where the atoms are none.
    pub fn bytes(&self, atoms: Range<usize>) -> Range<u64> {
        match self.atoms.get(atoms) {
            Some([first, .., last]) => first.offset..last.end(),
            Some([only]) => only.offset..only.end(),
            _ => self.header.table_end()..self.header.table_end(),
        }
    }

    /// Checks the bytes of atom `index` against its length and checksum (spec §3.4).
    ///
    /// # Errors
    /// [`FormatError`] where they differ, or where the file has no such atom.
    pub fn check(&self, index: usize, payload: &[u8]) -> Result<(), FormatError> {
        let Some(atom) = self.atoms.get(index) else {
            return Err(FormatError::new(self.file_bytes(), "3.3", format!("there is no atom {index}")));
        };
        if payload.len() == atom.length as usize && checksum::of_atom(payload) == atom.crc {
            return Ok(());
        }
        let Atom { kind, level, offset, .. } = *atom;
        let what = format!("atom {index} ({kind:?}, level {level}) does not match its checksum");
        Err(FormatError::new(offset, "3.4", what))
    }
}
