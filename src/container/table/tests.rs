//! What the table of contents may say, and what it may not.

use super::*;
use crate::container::testing::{GOLDEN_HEADER, GOLDEN_REST, bytes, golden_header, small_file};
use crate::container::{FileBuilder, parse_contents};
use crate::error::Error;
use crate::fuzzing::mend;

#[test]
fn golden_bytes() {
    let contents = read(&Start::read(&GOLDEN_HEADER).unwrap(), &GOLDEN_REST[..47]).unwrap();
    let level = |vertices, triangles, max_error, rms_error| Level {
        vertices,
        triangles,
        precision: 0,
        max_error,
        rms_error,
        attributes: Vec::new(),
    };
    assert_eq!(contents.header, golden_header());
    assert_eq!(contents.header.far_corner(), [126.5, 0.0, 10.0]);
    assert_eq!(contents.levels, [level(5, 6, 0.0, 0.0), level(4, 4, 0.5, 0.25)]);
    let atom = Atom {
        kind: AtomKind::Base,
        level: 1,
        offset: 63,
        length: 3,
        items: 0,
        triangles: 0,
        crc: 0x514A,
        vertices_after: 4,
        triangles_after: 4,
        last: true,
    };
    let finer = Atom { offset: 66, length: 2, items: 1, triangles: 2, crc: 0xE6E2, ..atom };
    let finer = Atom { kind: AtomKind::Refinement, level: 0, vertices_after: 5, triangles_after: 6, ..finer };
    assert_eq!(contents.atoms, [atom, finer]);
    assert_eq!((contents.base_end(), contents.file_bytes()), (66, 68));
}

#[test]
fn what_follows_from_the_entries() {
    let contents = crate::container::testing::contents(&small_file());
    assert_eq!([contents.steps(2), contents.steps(1), contents.steps(0)], [0..1, 1..4, 4..7]);
    assert_eq!((contents.residue(), contents.metadata()), (7..8, 8..9));
    assert_eq!((contents.keyframe(1), contents.keyframe(0), contents.keyframe(9)), (Some(9..10), None, None));
    assert_eq!(contents.segments().collect::<Vec<_>>(), [2, 1]);
    let counts: Vec<_> = contents.atoms.iter().map(|a| (a.vertices_after, a.triangles_after)).collect();
    let (base, level_1, level_0) = ((5, 6), (8, 12), (12, 20));
    let expected = [base, base, (6, 8), level_1, level_1, level_1, level_0, level_0, level_0, level_1];
    assert_eq!(counts[..10], expected);
    let open: Vec<_> = (0..12).filter(|&i| !contents.atoms[i].last).collect();
    assert_eq!(open, [2, 4]);
    assert_eq!(contents.steps(3), 0..0);
    let items: Vec<_> = contents.atoms.iter().map(|atom| (atom.items, atom.triangles)).collect();
    assert_eq!(items[..7], [(0, 0), (5, 0), (1, 2), (2, 4), (10, 0), (6, 0), (4, 8)]);
}

fn fault_of(bytes: &[u8]) -> FormatError {
    parse_contents(bytes).expect_err("a rule is broken")
}

/// What a writer would have to say of a file after `change`.
fn refusal(change: impl FnOnce(&mut FileBuilder)) -> String {
    let mut file = small_file();
    change(&mut file);
    match file.write(&mut Vec::new()) {
        Err(Error::Parameter(what)) => what,
        other => panic!("{other:?}"),
    }
}

#[test]
fn what_does_not_add_up_is_not_written() {
    type Change = fn(&mut FileBuilder);
    // Places of the pieces: 0 base, 1 precision, 2 3 refinement, 4 5 precision, 6 refinement, 7 residue, 8 metadata, 9 keyframe,
    // 10 11 optional.
    let rules: [(Change, &str); 26] = [
        (|f| f.pieces.clear(), "level 2 has no atom of kind Base"),
        (|f| f.pieces[0].level = 1, "level 2 has no atom of kind Base"),
        (|f| f.pieces[1].level = 2, "level 1 has no atom of kind Precision"),
        (|f| drop(f.pieces.drain(2..4)), "level 1 has no atom of kind Refinement"),
        (|f| f.pieces[2].level = 9, "level 1 has no atom of kind Precision"),
        (|f| f.pieces[9].level = 2, "a keyframe of level 2 in a file whose base is level 2"),
        (
            |f| f.payload(AtomKind::Optional(5), 0, b"k"),
            "an atom of kind Optional(5) at level 0 has no place",
        ),
        (|f| f.pieces[0].items = 1, "an atom is (Base, 2, 1, 0) where the levels want (Base, 2, 0, 0)"),
        (
            |f| f.pieces[8].level = 1,
            "an atom is (Metadata, 1, 0, 0) where the levels want (Metadata, 0, 0, 0)",
        ),
        (
            |f| f.pieces[9].triangles = 1,
            "an atom is (Keyframe, 1, 0, 1) where the levels want (Keyframe, 1, 0, 0)",
        ),
        (
            |f| f.pieces[1].triangles = 1,
            "an atom is (Precision, 1, 5, 1) where the levels want (Precision, 1, 5, 0)",
        ),
        (
            |f| f.pieces[3].triangles = 3,
            "an atom is (Refinement, 1, 2, 3) where the levels want (Refinement, 1, 2, 4)",
        ),
        (
            |f| f.pieces[2].triangles = 1,
            "an atom is (Refinement, 1, 1, 1) where the levels want (Refinement, 1, 1, 2)",
        ),
        (
            |f| drop(f.pieces.remove(2)),
            "an atom is (Refinement, 1, 2, 4) where the levels want (Refinement, 1, 3, 6)",
        ),
        (|f| f.pieces[2].items = 0, "an atom has 0 items, 0 of them with one triangle; left are 3 and 0"),
        (|f| f.pieces[2].items = 3, "an atom has 3 items, 0 of them with one triangle; left are 3 and 0"),
        (
            |f| f.pieces[2].items = u32::MAX,
            "an atom has 4294967295 items, 0 of them with one triangle; left are 3 and 0",
        ),
        (
            |f| f.pieces[5].items = 7,
            "an atom is (Precision, 0, 7, 0) where the levels want (Precision, 0, 6, 0)",
        ),
        (|f| f.pieces[0].bytes.clear(), "an empty atom"),
        (|f| f.levels[2].precision = 13, "the precision shift of the base is 13, allowed 12"),
        (|f| f.levels[1].precision = 4, "level 1 cannot come of the one above"),
        (|f| f.levels[1].vertices = 4, "level 1 cannot come of the one above"),
        (|f| f.levels[1].triangles = 13, "level 1 cannot come of the one above"),
        (
            |f| f.levels[1].max_error = f64::NAN,
            "level 1 has an error that is negative, not finite or too large",
        ),
        (|f| f.levels[2].max_error = -1.0, "level 2 has an error that is negative, not finite or too large"),
        (
            |f| f.levels[0].rms_error = f64::MAX,
            "level 0 has an error that is negative, not finite or too large",
        ),
    ];
    for (i, (change, what)) in rules.into_iter().enumerate() {
        assert_eq!(refusal(change), what, "rule {i}");
    }
    assert_eq!(
        refusal(|f| for level in &mut f.levels {
            level.precision += 1
        }),
        "level 0 lacks bits"
    );
}

#[test]
fn single_triangles_are_shared_out() {
    let mut file = small_file();
    // Level 1 comes of three operations of 1, 2 and 1 triangles.
    (file.levels[1].triangles, file.levels[0].triangles) = (10, 18);
    (file.pieces[2].items, file.pieces[2].triangles, file.pieces[3].items, file.pieces[3].triangles) =
        (2, 3, 1, 1);
    let contents = crate::container::testing::contents(&file);
    let told: Vec<_> =
        contents.atoms[2..4].iter().map(|atom| (atom.items, atom.triangles, atom.triangles_after)).collect();
    assert_eq!(told, [(2, 3, 9), (1, 1, 10)]);
    assert_eq!(contents.header.triangles, 18);
    // No operation adds no triangle, in this atom or in the next.
    for triangles in [1, 4] {
        file.pieces[2].triangles = triangles;
        let fault = fault_of(&bytes(&file));
        let what =
            format!("an atom has 2 items, {} of them with one triangle; left are 3 and 2", 4 - triangles);
        assert!(fault.what == what || fault.what.contains("number of single triangles is"), "{fault}");
    }
}

/// What is told of the example with `change` made to its table of contents, the checksum mended.
fn fault_in_table(change: impl FnOnce(&mut Vec<u8>)) -> (u64, &'static str, String) {
    let mut table = GOLDEN_REST[..47].to_vec();
    change(&mut table);
    let mut bytes = GOLDEN_HEADER.to_vec();
    bytes[13] = table.len() as u8;
    bytes.extend(table);
    mend(&mut bytes);
    let fault = fault_of(&bytes);
    (fault.offset, fault.section, fault.what)
}

#[test]
fn each_rule_of_entries_is_checked() {
    let mend = |at: usize, with: &'static [u8], lacking: usize| {
        fault_in_table(move |table| drop(table.splice(at..at + lacking, with.iter().copied())))
    };
    // Places in the table: 0 form, 1 origin, 13 step, 17 maximum, 22 levels, 23 base, 25 shift, 26 errors, 30 base's atom,
    // 33 shape, 34 and 37 errors, 40 atom, 43 checksum.
    let many: &[u8] = &[0x81, 0x80, 0x80, 0x80, 0x04];
    /// Where, what instead, of how many bytes; what is told of it.
    type Rule = (usize, &'static [u8], usize, u64, &'static str, &'static str);
    let rules: [Rule; 33] = [
        (0, &[0x67], 1, 16, "3.3", "a lattice of 7 bits, form 3; allowed 8 to 24, form 0 to 3"),
        (0, &[0x79], 1, 16, "3.3", "a lattice of 25 bits, form 3; allowed 8 to 24, form 0 to 3"),
        (0, &[0xE8], 1, 16, "3.3", "a lattice of 8 bits, form 7; allowed 8 to 24, form 0 to 3"),
        (3, &[0x80, 0x7F], 2, 17, "3.3", "the origin is not finite"),
        (15, &[0x80, 0x7F], 2, 29, "3.3", "the lattice step is not finite"),
        (16, &[0xBF], 1, 16, "3.3", "the lattice step is negative"),
        (
            0,
            &[0x28, 0, 0, 0x80, 0xBF, 0, 0, 0, 0, 0, 0, 0, 0x40, 0, 0, 0, 0, 0, 0, 0xE0, 0x3F],
            17,
            16,
            "3.3",
            "the lattice is not in its shortest form",
        ),
        (17, &[0x80, 0x02], 1, 33, "3.6", "what the bounding box lacks of the lattice is 256, allowed 255"),
        (22, &[0], 1, 38, "3.3", "a file without levels"),
        (22, &[0x81, 0x20], 1, 38, "3.6", "the number of levels is 4097, allowed 4096"),
        (23, many, 1, 39, "3.6", "the number of vertices of the base is 1073741825, allowed 1073741824"),
        (24, many, 1, 40, "3.6", "the number of triangles of the base is 1073741825, allowed 1073741824"),
        (24, &[1], 1, 39, "3.6", "the base has more vertices than corners"),
        (24, &[5], 1, 39, "3.6", "the base has more triangles than its vertices can span"),
        (23, &[0, 0], 2, 39, "3.6", "nothing can be refined where there is no triangle"),
        (25, &[9], 1, 41, "3.6", "the precision shift of the base is 9, allowed 8"),
        (26, &[0x80, 0x7F], 2, 42, "3.3", "an error is not finite"),
        (28, &[0x00, 0x80], 2, 44, "3.3", "an error is not finite"),
        (30, &[0], 1, 46, "3.3", "an empty atom"),
        (30, &[1], 1, 46, "3.3", "an empty atom"),
        (30, &[0x82, 0x80, 0x08], 1, 46, "3.6", "the length of an atom is 65537, allowed 65536"),
        (33, &[3, 1, 1], 1, 49, "3.3", "level 0 adds nothing"),
        (33, &[0x84, 0], 1, 49, "3.3", "the number of vertices added is not an integer in its shortest form"),
        (33, &[5, 0], 1, 49, "3.3", "a level entry is not in its shortest form"),
        (33, &[6, 0], 1, 49, "3.3", "a level entry is not in its shortest form"),
        (33, &[6, 1], 1, 50, "3.6", "the bits that are gained is 1, allowed 0"),
        (33, &[5, 2], 1, 50, "3.6", "the number of single triangles is 2, allowed 1"),
        (
            33,
            &[0xFC, 0xFF, 0xFF, 0xFF, 0x0F],
            1,
            49,
            "3.6",
            "level 0 has more than 1073741824 vertices or triangles",
        ),
        (
            33,
            &[0x80, 0x80, 0x80, 0x80, 0x10],
            1,
            49,
            "3.6",
            "the number of vertices added is 4294967296, allowed 4294967295",
        ),
        (34, &[0xA1], 1, 50, "3.3", "an error is negative or not finite"),
        (34, &[0xFF, 0xFF, 0xFF, 0xFF, 0x0F], 3, 50, "3.3", "an error is negative or not finite"),
        (40, &[5, 1], 1, 57, "3.3", "an atom has 1 items, 0 of them with one triangle; left are 1 and 0"),
        (43, &[2], 0, 59, "3.3", "unknown kind of atom 2"),
    ];
    for (i, (at, with, lacking, offset, section, what)) in rules.into_iter().enumerate() {
        let told = mend(at, with, lacking);
        assert_eq!(told, (offset, section, what.to_owned()), "rule {i}: {with:?} at {at}");
    }
}

#[test]
fn the_table_may_be_cut_off_nowhere() {
    let told = |offset, what: &str| (offset, "3.3", what.to_owned());
    assert_eq!(
        fault_in_table(|t| t.truncate(3)),
        told(16, "the table of contents has no room for its checksum")
    );
    for left in 4..47 {
        let (offset, section, what) = fault_in_table(|t| t.truncate(left));
        assert_eq!(section, "3.3");
        assert!(what.contains("no room left") || what.contains("not an integer"), "{left}: {what}");
        assert!(offset <= 16 + left as u64 - 4);
    }
    for at in 10..63 {
        let mut bytes = [&GOLDEN_HEADER[..], &GOLDEN_REST].concat();
        // Not the length: another end is another checksum.
        if !(13..16).contains(&at) {
            bytes[at] ^= 4;
            let what = "header and table of contents do not match their checksum";
            assert_eq!(fault_of(&bytes), FormatError::new(0, "3.4", what), "byte {at}");
        }
    }
}

#[test]
fn each_rule_of_further_payloads_is_checked() {
    // Behind a sound table: kind, level where it is a keyframe, length 1, checksum.
    let fault = |more: &'static [u8]| fault_in_table(move |t| drop(t.splice(43..43, more.iter().copied())));
    let rules: [(&'static [u8], u64, &str); 15] = [
        (&[0], 59, "unknown kind of atom 0"),
        (&[9], 59, "unknown kind of atom 9"),
        (&[8, 2, 0, 0], 59, "values of attributes where there are no attributes"),
        (&[127], 59, "unknown kind of atom 127"),
        (&[128, 0], 60, "an empty atom"),
        (&[128, 2, 0], 61, "a field has no room left"),
        (&[3, 2, 0, 0, 3, 2, 0, 0], 63, "Residue of level 0 is out of order"),
        (&[6, 2, 0, 0, 3, 2, 0, 0], 63, "Residue of level 0 is out of order"),
        (&[7, 2, 0, 0, 6, 2, 0, 0], 63, "Correction of level 0 is out of order"),
        (&[4, 2, 0, 0, 7, 2, 0, 0], 63, "Order of level 0 is out of order"),
        (&[5, 0, 2, 0, 0, 4, 2, 0, 0], 64, "Metadata of level 0 is out of order"),
        (&[4, 2, 0, 0, 128, 2, 0, 0, 4, 2, 0, 0], 67, "Metadata of level 0 is out of order"),
        (&[5, 0, 2, 0, 0, 5, 0, 2, 0, 0], 64, "Keyframe of level 0 is out of order"),
        (&[5, 1, 2, 0, 0], 59, "a keyframe of level 1 in a file whose base is level 1"),
        (
            &[5, 0xFF, 0xFF, 0xFF, 0xFF, 0x0F, 2, 0, 0],
            59,
            "a keyframe of level 4294967295 in a file whose base is level 1",
        ),
    ];
    for (more, offset, what) in rules {
        assert_eq!(fault(more), (offset, "3.3", what.to_owned()), "{more:?}");
    }
}

/// A level of one atom whose vertices have more steps to take than an atom can.
#[test]
fn shares_beyond_32_bits() {
    let mut table = vec![24 | 96, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 2];
    // 2^29 vertices and triangles, 24 bits that the base lacks and level 0 gains.
    table.extend([0x80, 0x80, 0x80, 0x80, 2, 0x80, 0x80, 0x80, 0x80, 2, 24, 0, 0, 0, 0, 2, 0, 0]);
    table.extend([6, 24, 96, 96]);
    let seen = |run: &[u8]| {
        let rest = [&table[..], run, &[2, 0, 0, 0, 0, 0, 0]].concat();
        let mut bytes = Start::new(rest.len() as u32, Coding::default(), 0, false).unwrap().bytes.to_vec();
        bytes.extend(rest);
        mend(&mut bytes);
        parse_contents(&bytes)
            .map(|contents| contents.unwrap().atoms.iter().map(|atom| atom.items).collect::<Vec<_>>())
    };
    assert_eq!(seen(&[2, 0, 0]).unwrap_err().what, "12884901888 items in one atom");
    let most: &[u8] = &[3, 0xFF, 0xFF, 0xFF, 0xFF, 0x0F, 0, 0];
    assert_eq!(seen(&[most, most, &[2, 0, 0]].concat()).unwrap_err().what, "4294967298 items in one atom");
    assert_eq!(
        seen(&[most, most, most, &[2, 0, 0]].concat()),
        Ok(vec![0, u32::MAX, u32::MAX, u32::MAX, 3, 1])
    );
}

/// The finest lattice has no bit left for what is lifted beyond the box.
#[test]
fn no_lifting_without_room() {
    for (bits, lifting, fits) in [(24, 0, true), (24, 1, false), (23, 32, true)] {
        let mut file = small_file();
        file.lattice.bits = bits;
        file.coding.lifting = lifting;
        let told = file.write(&mut Vec::new()).map_err(|fault| fault.to_string());
        assert_eq!(told.is_ok(), fits, "{told:?}");
        assert!(fits || told.unwrap_err().contains("a lattice of 24 bits leaves no room for lifting"));
    }
}

#[test]
fn no_more_atoms_than_allowed() {
    let atoms = |count: usize| {
        let mut table = GOLDEN_REST[..43].to_vec();
        table.push(200);
        table.extend([3, 0, 0].repeat(count - 3));
        table.extend([2, 0, 0, 0, 0, 0, 0]);
        let mut bytes = Start::new(table.len() as u32, Coding::default(), 0, false).unwrap().bytes.to_vec();
        bytes.extend(table);
        mend(&mut bytes);
        parse_contents(&bytes).map(|contents| contents.unwrap().atoms.len())
    };
    assert_eq!(atoms(MAX_ATOMS as usize), Ok(MAX_ATOMS as usize));
    assert_eq!(atoms(MAX_ATOMS as usize + 1).unwrap_err().what, "more than 1048576 atoms");
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
