//! Reads the table of contents and checks it against every rule (spec §3.3).

use std::ops::Range;

use super::contents::{Atom, AtomKind, Contents, Level};
use super::fields::Fields;
use super::header::Header;
use crate::error::FormatError;
use crate::limits::{MAX_ATOM_BYTES, MAX_ATOMS, MAX_ELEMENTS, MAX_METADATA_BYTES};

/// Reads the `header.table_bytes` bytes behind the header.
pub(super) fn read(header: Header, bytes: &[u8]) -> Result<Contents, FormatError> {
    let start = Header::SIZE as u64;
    let Some((body, checksum)) = bytes.split_last_chunk::<4>() else {
        return Err(FormatError::new(start, "3.3", "the table of contents has no room for its checksum"));
    };
    if crc32c::crc32c(body).to_le_bytes() != *checksum {
        return Err(FormatError::new(start, "3.4", "the table of contents does not match its checksum"));
    }
    let mut fields = Fields::new(body, start, "3.3");
    let levels = read_levels(&header, &mut fields)?;
    let list = fields.offset();
    let atoms = read_atoms(&header, &mut fields)?;
    let (left, end) = (fields.left(), fields.offset());
    fields.require(left == 0, end, || format!("{left} bytes behind the last entry of the table"))?;
    check_sums(&levels, &atoms).map_err(|what| FormatError::new(list, "3.3", what))?;
    Ok(assemble(header, levels, atoms))
}

/// The levels, by number; their counts are totals, checked against the header.
fn read_levels(header: &Header, fields: &mut Fields) -> Result<Vec<Level>, FormatError> {
    let base = header.base_level();
    let mut above =
        Level { vertices: header.base_vertices, triangles: header.base_triangles, ..Level::default() };
    let mut levels = Vec::new();
    for j in (0..=base).rev() {
        let at = fields.offset();
        let mut level = above;
        if j < base {
            let vertices = fields.count(MAX_ELEMENTS, "the number of vertices added")?;
            let triangles = fields.count(MAX_ELEMENTS, "the number of triangles added")?;
            fields.require(vertices >= 1 && grows(vertices, triangles), at, || {
                format!("level {j} adds {vertices} vertices and {triangles} triangles")
            })?;
            level.vertices += vertices;
            level.triangles += triangles;
            let within = level.vertices <= header.vertices && level.triangles <= header.triangles;
            fields.require(within, at, || format!("level {j} is larger than the header tells of level 0"))?;
        }
        let at = fields.offset();
        level.precision = u32::from(fields.u8()?);
        let most = if j == base { MAX_PRECISION } else { above.precision };
        fields.require(level.precision <= most, at, || {
            format!("level {j} lacks {} bits, allowed {most}", level.precision)
        })?;
        fields.require(j > 0 || level.precision == 0, at, || "level 0 lacks bits".to_owned())?;
        level.max_error = fields.size_f64("the largest error")?;
        level.rms_error = fields.size_f32("the mean error")?;
        levels.push(level);
        above = level;
    }
    let complete = above.vertices == header.vertices && above.triangles == header.triangles;
    fields.require(complete, fields.offset(), || {
        format!(
            "the levels add up to {} vertices and {} triangles, the header tells {} and {}",
            above.vertices, above.triangles, header.vertices, header.triangles
        )
    })?;
    levels.reverse();
    Ok(levels)
}

/// The atoms in order, without their counts and `last`.
fn read_atoms(header: &Header, fields: &mut Fields) -> Result<Vec<Atom>, FormatError> {
    let at = fields.offset();
    let count = fields.count(MAX_ATOMS, "the number of atoms")?;
    let room = fields.left() / MIN_ENTRY_BYTES;
    fields.require(count as usize <= room, at, || format!("no room for {count} atoms"))?;
    let mut atoms = Vec::new();
    let mut offset = header.table_end();
    let mut before = None;
    for index in 0..count {
        let at = fields.offset();
        let atom = read_atom(fields, offset)?;
        check_atom(&atom, header)
            .map_err(|what| FormatError::new(at, "3.3", format!("atom {index}: {what}")))?;
        if let Some(rank) = atom.kind.rank(atom.level, header.level_count) {
            let first = before.is_none();
            fields.require(!first || atom.kind == AtomKind::Base, at, || {
                "the base does not come first".into()
            })?;
            fields.require(before <= Some(rank), at, || {
                format!("atom {index} ({:?}, level {}) is out of order", atom.kind, atom.level)
            })?;
            before = Some(rank);
        }
        offset = atom.end();
        atoms.push(atom);
    }
    fields.require(before.is_some(), at, || "there is no base".to_owned())?;
    Ok(atoms)
}

fn read_atom(fields: &mut Fields, offset: u64) -> Result<Atom, FormatError> {
    let at = fields.offset();
    let byte = fields.u8()?;
    let kind = AtomKind::from_byte(byte);
    let kind = kind.ok_or_else(|| FormatError::new(at, "3.3", format!("unknown kind of atom {byte}")))?;
    let level = fields.count(u32::MAX, "the level of an atom")?;
    let at = fields.offset();
    let length = fields.count(MAX_ATOM_BYTES, "the length of an atom")?;
    fields.require(length >= 1, at, || "an empty atom".to_owned())?;
    let items = fields.count(u32::MAX, "the number of items")?;
    let triangles = fields.count(u32::MAX, "the number of triangles")?;
    let crc = fields.u32()?;
    let (vertices_after, triangles_after, last) = (0, 0, false);
    Ok(Atom { kind, level, offset, length, items, triangles, crc, vertices_after, triangles_after, last })
}

/// What an atom may say on its own.
fn check_atom(atom: &Atom, header: &Header) -> Result<(), String> {
    let &Atom { kind, level, items, triangles, .. } = atom;
    let base = header.base_level();
    let (level_fits, counts_fit) = match kind {
        AtomKind::Base => (level == base, items == 0 && triangles == 0),
        AtomKind::Keyframe => (level < base, items == 0 && triangles == 0),
        AtomKind::Residue | AtomKind::Metadata => (level == 0, items == 0 && triangles == 0),
        AtomKind::Precision => (level < base, items >= 1 && triangles == 0),
        AtomKind::Refinement => (level < base, items >= 1 && grows(items, triangles)),
        AtomKind::Optional(_) => (true, true),
    };
    if !level_fits {
        return Err(format!("{kind:?} cannot be at level {level} of a file whose base is level {base}"));
    }
    if !counts_fit {
        return Err(format!("{kind:?} cannot have {items} items and {triangles} triangles"));
    }
    Ok(())
}

/// Whether the atoms hold exactly what the levels promise.
fn check_sums(levels: &[Level], atoms: &[Atom]) -> Result<(), String> {
    // Items, and triangles, of refinement; items of precision. No overflow: 2^20 atoms of 32 bits each.
    let mut sums = vec![[0u64; 3]; levels.len()];
    let mut metadata = 0;
    for atom in atoms {
        match (atom.kind, sums.get_mut(atom.level as usize)) {
            (AtomKind::Refinement, Some([items, triangles, _])) => {
                *items += u64::from(atom.items);
                *triangles += u64::from(atom.triangles);
            }
            (AtomKind::Precision, Some([_, _, items])) => *items += u64::from(atom.items),
            (AtomKind::Metadata, _) => metadata += u64::from(atom.length),
            _ => {}
        }
    }
    for (j, pair) in levels.windows(2).enumerate() {
        let [level, above] = pair else { continue };
        let wanted = [
            u64::from(level.vertices - above.vertices),
            u64::from(level.triangles - above.triangles),
            u64::from(above.vertices) * u64::from(above.precision - level.precision),
        ];
        for ((name, wanted), found) in SUMS.into_iter().zip(wanted).zip(sums[j]) {
            if wanted != found {
                return Err(format!("level {j} has {wanted} {name}, its atoms {found}"));
            }
        }
    }
    if metadata > MAX_METADATA_BYTES as u64 {
        return Err(format!("{metadata} bytes of metadata, allowed {MAX_METADATA_BYTES}"));
    }
    Ok(())
}

/// Fills in what follows from checked entries: counts, ends and runs.
fn assemble(header: Header, levels: Vec<Level>, mut atoms: Vec<Atom>) -> Contents {
    let mut steps = vec![0..0; levels.len()];
    let mut keyframes = steps.clone();
    let (mut residue, mut metadata) = (0..0, 0..0);
    let (mut vertices, mut triangles) = (header.base_vertices, header.base_triangles);
    for (index, atom) in atoms.iter_mut().enumerate() {
        if atom.kind == AtomKind::Refinement {
            vertices += atom.items;
            triangles += atom.triangles;
        }
        (atom.vertices_after, atom.triangles_after) = (vertices, triangles);
        let j = atom.level as usize;
        match atom.kind {
            AtomKind::Base | AtomKind::Precision | AtomKind::Refinement => extend(&mut steps[j], index),
            AtomKind::Residue => extend(&mut residue, index),
            AtomKind::Metadata => extend(&mut metadata, index),
            AtomKind::Keyframe => {
                extend(&mut keyframes[j], index);
                (atom.vertices_after, atom.triangles_after) = (levels[j].vertices, levels[j].triangles);
            }
            AtomKind::Optional(_) => {}
        }
    }
    let mut next = None;
    for atom in atoms.iter_mut().rev() {
        let rank = atom.kind.rank(atom.level, header.level_count);
        atom.last = rank.is_none() || rank != next;
        next = rank.or(next);
    }
    Contents { header, levels, atoms, steps, keyframes, residue, metadata }
}

fn extend(run: &mut Range<usize>, index: usize) {
    if run.is_empty() {
        run.start = index;
    }
    run.end = index + 1;
}

/// Whether so many operations can add so many triangles: one or two each.
fn grows(operations: u32, triangles: u32) -> bool {
    (u64::from(operations)..=2 * u64::from(operations)).contains(&u64::from(triangles))
}

/// Most low bits a level may lack.
const MAX_PRECISION: u32 = 24;
/// Fewest bytes of an atom's entry: kind, four counts, checksum.
const MIN_ENTRY_BYTES: usize = 9;
/// What [`check_sums`] compares, in its order.
const SUMS: [&str; 3] = ["operations", "triangles added", "precision steps"];
