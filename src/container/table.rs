//! Reads the table of contents and checks it against every rule (spec §3.3).

use std::ops::Range;

use super::contents::{Atom, AtomKind, Contents, Level};
use super::fields::Fields;
use super::header::Header;
use crate::error::FormatError;
use crate::limits::{MAX_ATOM_BYTES, MAX_ATOMS, MAX_ELEMENTS, MAX_METADATA_BYTES, max_walked};

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
        let most = if j == base { header.lattice.bits } else { above.precision };
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
    let walked =
        levels.iter().map(|level| u64::from(level.triangles)).sum::<u64>() - u64::from(above.triangles);
    let allowed = max_walked(above.triangles);
    if walked > allowed {
        let what = format!("the levels above level 0 have {walked} triangles together, allowed {allowed}");
        return Err(FormatError::new(fields.offset(), "3.6", what));
    }
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
        AtomKind::Residue | AtomKind::Correction | AtomKind::Order | AtomKind::Metadata => {
            (level == 0, items == 0 && triangles == 0)
        }
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
    let [mut residue, mut correction, mut order, mut metadata] = [const { 0..0 }; 4];
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
            AtomKind::Correction => extend(&mut correction, index),
            AtomKind::Order => extend(&mut order, index),
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
    Contents { header, levels, atoms, steps, keyframes, residue, correction, order, metadata }
}

fn extend(run: &mut Range<usize>, index: usize) {
    if *run == (0..0) {
        run.start = index;
    }
    run.end = index + 1;
}

/// Whether so many operations can add so many triangles: one or two each.
fn grows(operations: u32, triangles: u32) -> bool {
    (u64::from(operations)..=2 * u64::from(operations)).contains(&u64::from(triangles))
}

/// Fewest bytes of an atom's entry: kind, four counts, checksum.
const MIN_ENTRY_BYTES: usize = 9;
/// What [`check_sums`] compares, in its order.
const SUMS: [&str; 3] = ["operations", "triangles added", "precision steps"];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::container::testing::{GOLDEN_HEADER, GOLDEN_REST, bytes, golden_header, small_file};
    use crate::container::{FileBuilder, parse_contents};
    use crate::fuzzing::mend;
    use crate::limits::MAX_LEVELS;

    #[test]
    fn golden_bytes() {
        let contents = read(golden_header(), &GOLDEN_REST[..51]).unwrap();
        let level = |vertices, triangles, max_error, rms_error| Level {
            vertices,
            triangles,
            precision: 0,
            max_error,
            rms_error,
        };
        assert_eq!(contents.levels, [level(5, 6, 0.0, 0.0), level(4, 4, 0.5, 0.25)]);
        let atom = Atom {
            kind: AtomKind::Base,
            level: 1,
            offset: 139,
            length: 3,
            items: 0,
            triangles: 0,
            crc: 0x364B_3FB7,
            vertices_after: 4,
            triangles_after: 4,
            last: true,
        };
        let finer = Atom { offset: 142, length: 2, items: 1, triangles: 2, crc: 0x6B40_B476, ..atom };
        let finer =
            Atom { kind: AtomKind::Refinement, level: 0, vertices_after: 5, triangles_after: 6, ..finer };
        assert_eq!(contents.atoms, [atom, finer]);
        assert_eq!((contents.base_end(), contents.file_bytes()), (142, 144));
    }

    #[test]
    fn what_follows_from_the_entries() {
        let contents = crate::container::testing::contents(&small_file());
        assert_eq!([contents.steps(2), contents.steps(1), contents.steps(0)], [1..2, 2..5, 5..8]);
        assert_eq!((contents.residue(), contents.metadata()), (8..9, 9..10));
        assert_eq!(
            (contents.keyframe(1), contents.keyframe(0), contents.keyframe(9)),
            (Some(10..11), None, None)
        );
        assert_eq!(contents.segments().collect::<Vec<_>>(), [2, 1]);
        let counts: Vec<_> = contents.atoms.iter().map(|a| (a.vertices_after, a.triangles_after)).collect();
        let (base, level_1, level_0) = ((5, 6), (8, 12), (12, 20));
        let expected = [base, base, base, (6, 8), level_1, level_1, level_1];
        assert_eq!(counts[..7], expected);
        assert_eq!(counts[7..], [level_0, level_0, level_0, level_1, level_0]);
        let open: Vec<_> = (0..12).filter(|&i| !contents.atoms[i].last).collect();
        assert_eq!(open, [3, 5]);
        assert_eq!(contents.steps(3), 0..0);
    }

    fn fault_of(bytes: &[u8]) -> FormatError {
        parse_contents(bytes).expect_err("a rule is broken")
    }

    #[test]
    fn each_rule_of_order_and_sums_is_checked() {
        type Change = fn(&mut FileBuilder);
        // Places of the pieces: 0 optional, 1 base, 2 precision, 3 4 refinement, 5 6 precision,
        // 7 refinement, 8 residue, 9 metadata, 10 keyframe, 11 optional.
        let rules: [(Change, &str); 33] = [
            (|f| f.pieces.clear(), "there is no base"),
            (|f| drop(f.pieces.drain(1..11)), "there is no base"),
            (|f| drop(f.pieces.remove(1)), "the base does not come first"),
            (|f| f.pieces.swap(1, 2), "the base does not come first"),
            (|f| f.pieces.swap(2, 3), "atom 3 (Precision, level 1) is out of order"),
            (|f| f.pieces.swap(4, 5), "atom 5 (Refinement, level 1) is out of order"),
            (|f| f.pieces.swap(7, 8), "atom 8 (Refinement, level 0) is out of order"),
            (|f| f.pieces.swap(8, 9), "atom 9 (Residue, level 0) is out of order"),
            (|f| f.pieces.swap(9, 10), "atom 10 (Metadata, level 0) is out of order"),
            (|f| f.payload(AtomKind::Base, 2, b"b"), "atom 12 (Base, level 2) is out of order"),
            (
                |f| [0, 1].map(|j| f.payload(AtomKind::Keyframe, j, b"k")).into_iter().collect(),
                "atom 13 (Keyframe, level 1) is out of order",
            ),
            (|f| f.pieces[1].level = 1, "atom 1: Base cannot be at level 1 of a file whose base is level 2"),
            (
                |f| f.pieces[2].level = 2,
                "atom 2: Precision cannot be at level 2 of a file whose base is level 2",
            ),
            (
                |f| f.pieces[3].level = 9,
                "atom 3: Refinement cannot be at level 9 of a file whose base is level 2",
            ),
            (
                |f| f.pieces[8].level = 1,
                "atom 8: Residue cannot be at level 1 of a file whose base is level 2",
            ),
            (
                |f| f.pieces[9].level = 1,
                "atom 9: Metadata cannot be at level 1 of a file whose base is level 2",
            ),
            (
                |f| f.pieces[10].level = 2,
                "atom 10: Keyframe cannot be at level 2 of a file whose base is level 2",
            ),
            (|f| f.pieces[1].items = 1, "atom 1: Base cannot have 1 items and 0 triangles"),
            (|f| f.pieces[10].triangles = 1, "atom 10: Keyframe cannot have 0 items and 1 triangles"),
            (|f| f.pieces[2].triangles = 1, "atom 2: Precision cannot have 5 items and 1 triangles"),
            (|f| f.pieces[2].items = 0, "atom 2: Precision cannot have 0 items and 0 triangles"),
            (|f| f.pieces[3].items = 0, "atom 3: Refinement cannot have 0 items and 2 triangles"),
            (|f| f.pieces[3].triangles = 0, "atom 3: Refinement cannot have 1 items and 0 triangles"),
            (|f| f.pieces[3].triangles = 3, "atom 3: Refinement cannot have 1 items and 3 triangles"),
            (|f| drop(f.pieces.remove(3)), "level 1 has 3 operations, its atoms 2"),
            (|f| f.pieces[3].triangles = 1, "level 1 has 6 triangles added, its atoms 5"),
            (|f| f.pieces[6].items = 7, "level 0 has 16 precision steps, its atoms 17"),
            (|f| f.pieces[6].items = u32::MAX, "level 0 has 16 precision steps, its atoms 4294967305"),
            (|f| drop(f.pieces.remove(2)), "level 1 has 5 precision steps, its atoms 0"),
            (|f| f.pieces[0].bytes.clear(), "an empty atom"),
            (|f| f.levels[2].precision = 13, "level 2 lacks 13 bits, allowed 12"),
            (|f| f.levels[1].precision = 4, "level 1 lacks 4 bits, allowed 3"),
            (|f| f.levels[0].precision = 1, "level 0 lacks bits"),
        ];
        for (i, (change, what)) in rules.into_iter().enumerate() {
            let mut file = small_file();
            change(&mut file);
            let fault = fault_of(&bytes(&file));
            assert_eq!((fault.what.as_str(), fault.section), (what, "3.3"), "rule {i}");
            assert!((88..88 + 200).contains(&fault.offset), "rule {i}: {fault}");
        }
    }

    #[test]
    fn each_rule_of_levels_is_checked() {
        type Change = fn(&mut FileBuilder);
        let rules: [(Change, &str); 6] = [
            (
                |f| (f.levels[1].vertices, f.levels[1].triangles) = (5, 6),
                "level 1 adds 0 vertices and 0 triangles",
            ),
            (|f| f.levels[1].triangles = 13, "level 1 adds 3 vertices and 7 triangles"),
            (|f| f.levels[1].max_error = f64::NAN, "the largest error is not finite"),
            (|f| f.levels[2].max_error = -1.0, "the largest error is negative"),
            (|f| f.levels[0].rms_error = f32::INFINITY, "the mean error is negative or not finite"),
            (|f| f.levels[0].rms_error = -1.0, "the mean error is negative or not finite"),
        ];
        for (change, what) in rules {
            let mut file = small_file();
            change(&mut file);
            assert_eq!(fault_of(&bytes(&file)).what, what);
        }
    }

    /// What is told of the example with `change` made to its table of contents, checksums mended.
    fn fault_in_table(change: impl FnOnce(&mut Vec<u8>)) -> (u64, &'static str, String) {
        let mut table = GOLDEN_REST[..51].to_vec();
        change(&mut table);
        let mut bytes = GOLDEN_HEADER.to_vec();
        bytes[80] = table.len() as u8;
        bytes.extend(table);
        mend(&mut bytes);
        let fault = fault_of(&bytes);
        (fault.offset, fault.section, fault.what)
    }

    #[test]
    fn each_rule_of_entries_is_checked() {
        let told = |offset, section, what: &str| (offset, section, what.to_owned());
        let shortest = "is not an integer in its shortest form";
        assert_eq!(
            fault_in_table(|t| t.truncate(3)),
            told(88, "3.3", "the table of contents has no room for its checksum")
        );
        assert_eq!(fault_in_table(|t| t.truncate(10)), told(88 + 1, "3.3", "a field has no room left"));
        assert_eq!(
            fault_in_table(|t| t.truncate(32)),
            told(88 + 28, "3.3", "the number of atoms is not an integer in its shortest form")
        );
        assert_eq!(fault_in_table(|t| t[13] = 2).2, "level 0 is larger than the header tells of level 0");
        assert_eq!(
            fault_in_table(|t| t[14] = 1).2,
            "the levels add up to 5 vertices and 5 triangles, the header tells 5 and 6"
        );
        assert_eq!(
            fault_in_table(|t| drop(t.splice(13..14, [0x81, 0]))),
            (88 + 13, "3.3", format!("the number of vertices added {shortest}"))
        );
        assert_eq!(fault_in_table(|t| t[28] = 3), told(88 + 28, "3.3", "no room for 3 atoms"));
        assert_eq!(
            fault_in_table(|t| t[28] = 1),
            told(88 + 38, "3.3", "9 bytes behind the last entry of the table")
        );
        let many = told(88 + 28, "3.6", "the number of atoms is 1048577, allowed 1048576");
        assert_eq!(fault_in_table(|t| drop(t.splice(28..29, [0x81, 0x80, 0x40]))), many);
        assert_eq!(fault_in_table(|t| t[29] = 8), told(88 + 29, "3.3", "unknown kind of atom 8"));
        assert_eq!(fault_in_table(|t| t[29] = 127), told(88 + 29, "3.3", "unknown kind of atom 127"));
        let long = told(88 + 31, "3.6", "the length of an atom is 65537, allowed 65536");
        assert_eq!(fault_in_table(|t| drop(t.splice(31..32, [0x81, 0x80, 4]))), long);
        let level = told(88 + 30, "3.6", "the level of an atom is 4294967296, allowed 4294967295");
        assert_eq!(fault_in_table(|t| drop(t.splice(30..31, [0x80, 0x80, 0x80, 0x80, 0x10]))), level);
        for at in 0..51 {
            let mut bytes = [&GOLDEN_HEADER[..], &GOLDEN_REST].concat();
            bytes[88 + at] ^= 4;
            assert_eq!(
                fault_of(&bytes),
                FormatError::new(88, "3.4", "the table of contents does not match its checksum")
            );
        }
    }

    #[test]
    fn levels_that_hardly_differ_are_no_many() {
        // Level 0 has 1,000,000 triangles; 48 levels of about as many are within 2^24 + 32,000,000, 49 are not.
        for (coarse, fits) in [(48, true), (49, false)] {
            let mut file = small_file();
            let (vertices, triangles) = (500_000, 1_000_000);
            file.levels = (0..=coarse)
                .map(|j| Level { vertices: vertices - j, triangles: triangles - 2 * j, ..Level::default() })
                .collect();
            file.pieces.clear();
            file.payload(AtomKind::Base, coarse, b"base");
            (0..coarse).rev().for_each(|j| file.atom(AtomKind::Refinement, j, 1, 2, b"r".to_vec()));
            let read = parse_contents(&bytes(&file));
            // The sum of 2j for j up to 49 is 2450.
            let what = "the levels above level 0 have 48997550 triangles together, allowed 48777216";
            assert_eq!(
                read.err().map(|fault| (fault.section, fault.what)),
                (!fits).then(|| ("3.6", what.into()))
            );
        }
    }

    #[test]
    fn as_many_levels_and_as_much_metadata_as_allowed() {
        let mut file = small_file();
        file.levels = (0..MAX_LEVELS)
            .map(|j| MAX_LEVELS - j + 3)
            .map(|n| Level { vertices: n, triangles: 2 * n - 4, ..Level::default() })
            .collect();
        file.pieces.clear();
        file.payload(AtomKind::Base, MAX_LEVELS - 1, b"base");
        for j in (0..MAX_LEVELS - 1).rev() {
            file.atom(AtomKind::Refinement, j, 1, 2, b"r".to_vec());
        }
        file.payload(AtomKind::Metadata, 0, &vec![0; MAX_METADATA_BYTES]);
        assert_eq!(parse_contents(&bytes(&file)).unwrap().unwrap().levels.len(), MAX_LEVELS as usize);
        file.payload(AtomKind::Metadata, 0, b"1");
        assert_eq!(fault_of(&bytes(&file)).what, "1048577 bytes of metadata, allowed 1048576");
    }
}
