//! What the table may say of attributes, and what it may not.

use proptest::collection::vec;
use proptest::prelude::*;

use super::*;
use crate::container::testing::{any_attribute, attributed_file, born_file, bytes, contents, small_file};
use crate::container::{AtomKind, FileBuilder, Level, Want, parse_contents, plan, plan_from_keyframe};
use crate::fuzzing::mend;
use crate::mesh::attributes::Values;

fn plain(semantic: Semantic, components: usize, stored: Stored) -> AttributeEntry {
    AttributeEntry {
        semantic,
        set: 0,
        name: String::new(),
        domain: Domain::Corner,
        components,
        stored,
        normalised: false,
        partial: false,
        birth: 0,
        quantisation: if stored.is_float() { Quantisation::Raw } else { Quantisation::Integer },
        error: 0.0,
        constant: None,
    }
}

/// Texture coordinates of two binary32 numbers: the bytes of spec §3.3's example.
#[rustfmt::skip]
const UV: [u8; 21] = [
    0x62, 0x11, 0x1C, 1, 0, 0, // texture coordinates of binary32; two, a lattice; partial, both short; set 1, born at 0, no name
    12, 0, 0, 0, 0, 0, 0, 0, 0x3F, // 12 bits; origin 0, 1/2
    0, 0, 0x80, 0x39, // step 2^-12
    0x00, 0x3F, // half a step
];

#[test]
fn the_example_of_the_specification() {
    let quantisation = Quantisation::Lattice { bits: 12, origin: vec![0.0, 0.5], step: 1.0 / 4096.0 };
    let values = Values::F32(vec![0.0, 0.5]);
    let uv = Attribute { set: 1, ..Attribute::new(Semantic::TexCoord, 2, values, vec![0, 0, NO_VALUE]) };
    let entry = AttributeEntry::of(&uv, quantisation, 1.0 / 8192.0);
    let mut written = Vec::new();
    entry.write(&mut written).unwrap();
    assert_eq!(written, UV);
    let mut fields = Fields::new(&UV, 0, "3.3");
    assert_eq!(AttributeEntry::read(&mut fields), Ok(entry.clone()));
    assert_eq!((fields.left(), entry.title(), entry.bits()), (0, "uv1".to_owned(), Some(12)));
    for cut in 0..UV.len() {
        let fault = AttributeEntry::read(&mut Fields::new(&UV[..cut], 0, "3.3")).unwrap_err();
        assert_eq!(fault.section, "3.3", "{cut}: {fault}");
    }
}

#[test]
fn of_each_kind() {
    let contents = contents(&attributed_file());
    assert_eq!(contents.attributes, attributed_file().attributes);
    let titles: Vec<_> = contents.attributes.iter().map(AttributeEntry::title).collect();
    assert_eq!(titles, ["normal", "uv1", "color", "part", "quality"]);
    // Behind the residue, before metadata: of level 0's prefix.
    assert_eq!([contents.residue(), contents.attribute_atoms(0), contents.metadata()], [7..8, 8..9, 9..10]);
    assert_eq!((contents.beyond_mesh(), contents.prefix(0)), (7..10, 0..10));
    assert_eq!(contents.atoms[8].kind, AtomKind::Attributes);
}

/// White of four bytes, all the same: the second example of spec §3.3.
const WHITE: [u8; 10] = [0x03, 0x03, 0x22, 0, 0, 0xFE, 0x03, 0, 0, 0];

#[test]
fn constants() {
    let white = plain(Semantic::Color, 4, Stored::U8);
    let white = AttributeEntry { normalised: true, constant: Some(vec![255; 4]), ..white };
    let mut written = Vec::new();
    white.write(&mut written).unwrap();
    assert_eq!(written, WHITE);
    assert_eq!(AttributeEntry::read(&mut Fields::new(&WHITE, 0, "3.3")), Ok(white.clone()));
    assert_eq!((white.bits(), white.kind().constant), (None, Some(vec![255; 4])));
    for cut in 0..WHITE.len() {
        assert!(AttributeEntry::read(&mut Fields::new(&WHITE[..cut], 0, "3.3")).is_err());
    }
    // 1/2 and 3/4, of binary32 on their lattice: 2 and 3 quarters. Then what is refused of them.
    let half: &[u8] = &[0x62, 0x11, 0x20, 0, 0, 3, 4, 2, 0, 0];
    let entry = AttributeEntry::read(&mut Fields::new(half, 0, "3.3")).unwrap();
    assert_eq!(entry.quantisation, Quantisation::Lattice { bits: 1, origin: vec![0.5, 0.75], step: 0.0 });
    assert_eq!((&entry.constant, entry.error), (&Some(vec![0, 0]), 0.0));
    for (with, what) in [
        (&[1, 8, 4][..], "a constant is not finite or not in its shortest form"),
        (&[3, 0, 0], "a constant is not finite or not in its shortest form"),
        (&[0xFE, 0x0F, 10, 0], "a constant is not finite or not in its shortest form"),
        (&[0x80, 0x10, 2, 0], "a constant is not finite or not in its shortest form"),
        (&[0x83, 0, 2, 0], "a number of a constant is not an integer in its shortest form"),
    ] {
        let bytes = [&half[..5], with, &[0, 0]].concat();
        let told = AttributeEntry::read(&mut Fields::new(&bytes, 100, "3.3")).unwrap_err();
        assert_eq!(told, FormatError::new(105, "3.3", what), "{with:?}");
    }
    let bytes = [&WHITE[..5], &[0x80, 0x80, 0x80, 0x80, 0x10]].concat();
    let told = AttributeEntry::read(&mut Fields::new(&bytes, 100, "3.3")).unwrap_err();
    assert_eq!(
        told,
        FormatError::new(105, "3.6", "a number of a constant is 4294967296, allowed 4294967295")
    );
}

#[test]
fn constants_have_no_payload() {
    let mut file = born_file();
    file.attributes[1].partial = false;
    let lattice = Quantisation::Lattice { bits: 1, origin: vec![0.5, -3.0], step: 0.0 };
    file.attributes[1].quantisation = lattice;
    for (k, value) in [(1, vec![0; 2]), (2, vec![9; 4]), (3, vec![70_000]), (4, vec![-5; 16])] {
        file.attributes[k].constant = Some(value);
    }
    file.pieces.retain(|piece| piece.kind != AtomKind::Attributes);
    let told = contents(&file);
    assert_eq!(told.births_at(1).chain(told.births_at(0)).count(), 0);
    assert_eq!(told.alive_at(2).collect::<Vec<_>>(), [0, 1, 2, 3, 4]);
    for (told, given) in told.attributes.iter().zip(&file.attributes) {
        assert_eq!(told, &AttributeEntry { birth: 2, ..given.clone() });
    }
    // They are alive from the base on, and nothing is told of them.
    file.payload(AtomKind::Attributes, 1, b"values");
    assert_eq!(refusal(file), "an atom of kind Attributes at level 1 has no place");
}

#[test]
fn each_rule_is_checked() {
    /// Where, what instead, of how many bytes of the example; what is told of it.
    type Rule = (usize, &'static [u8], usize, u64, &'static str, &'static str);
    let rules: [Rule; 30] = [
        (0, &[0x68], 1, 100, "3.3", "unknown semantic 8"),
        (0, &[0x82], 1, 100, "3.3", "unknown stored type 8"),
        (1, &[0x41], 1, 101, "3.3", "unknown quantisation 4"),
        (2, &[0x5C], 1, 102, "3.3", "unknown marks 92 of an attribute"),
        (2, &[0x3C], 1, 102, "3.3", "marks of a lattice where there is none"),
        (2, &[0x24], 1, 102, "3.3", "a value that all have, where some have none"),
        (2, &[0x1E], 1, 102, "3.3", "floating-point numbers that stand for fractions"),
        (1, &[0x31], 1, 102, "3.3", "marks of a lattice where there is none"),
        (1, &[0x21], 1, 102, "3.3", "marks of a lattice where there is none"),
        (1, &[0x01, 0], 2, 101, "3.3", "quantisation 0 of f32 numbers"),
        (0, &[0x42], 1, 101, "3.3", "quantisation 1 of u32 numbers"),
        (0, &[0x42, 0x31, 0], 3, 101, "3.3", "quantisation 3 of u32 numbers"),
        (0, &[0x40, 0x22, 0], 3, 101, "3.3", "quantisation 2 of u32 numbers"),
        (1, &[0x22, 0], 2, 101, "3.3", "octahedral coordinates of 3 numbers of uv"),
        (0, &[0x60, 0x23, 0], 3, 101, "3.3", "octahedral coordinates of 4 numbers of normal"),
        (0, &[0x61, 0x22, 0], 3, 101, "3.3", "octahedral coordinates of 3 numbers of tangent"),
        (0, &[0x66], 1, 100, "3.3", "a part is one integer a triangle"),
        (0, &[0x46, 0x00, 0], 3, 100, "3.3", "a part is one integer a triangle"),
        (0, &[0x46, 0x01, 1], 3, 100, "3.3", "a part is one integer a triangle"),
        (3, &[0x80, 0], 1, 103, "3.3", "the set of an attribute is not an integer in its shortest form"),
        (
            3,
            &[0x80, 0x80, 0x80, 0x80, 0x10],
            1,
            103,
            "3.6",
            "the set of an attribute is 4294967296, allowed 4294967295",
        ),
        (5, &[0x80, 2], 1, 105, "3.6", "the length of an attribute's name is 256, allowed 255"),
        (5, &[2, 0xC3, 0x28], 1, 106, "3.3", "a name is not UTF-8"),
        (6, &[0], 1, 106, "3.3", "an attribute of 0 bits a number, allowed 1 to 24"),
        (6, &[25], 1, 106, "3.3", "an attribute of 25 bits a number, allowed 1 to 24"),
        (0, &[0x60, 0x22, 0, 0, 0, 0, 1], 7, 106, "3.3", "an attribute of 1 bits a number, allowed 2 to 16"),
        (
            0,
            &[0x60, 0x22, 0, 0, 0, 0, 17],
            7,
            106,
            "3.3",
            "an attribute of 17 bits a number, allowed 2 to 16",
        ),
        (13, &[0x80, 0x7F], 2, 111, "3.3", "an attribute's origin is not finite"),
        (18, &[0xB9], 1, 115, "3.3", "an attribute's step is negative"),
        (19, &[0x80, 0x7F], 2, 119, "3.3", "the error of an attribute is not finite"),
    ];
    for (i, (at, with, lacking, offset, section, what)) in rules.into_iter().enumerate() {
        let mut bytes = UV.to_vec();
        bytes.splice(at..at + lacking, with.iter().copied());
        let told = AttributeEntry::read(&mut Fields::new(&bytes, 100, "3.3")).unwrap_err();
        assert_eq!(told, FormatError::new(offset, section, what), "rule {i}: {with:?} at {at}");
    }
    // Numbers in more bytes than they need.
    for (marks, at, number) in [(0x0C, 15, &0.25f64.to_le_bytes()), (0x14, 7, &0.0f64.to_le_bytes())] {
        let mut bytes = UV.to_vec();
        bytes[2] = marks;
        bytes.splice(at..at + 4, *number);
        if at == 7 {
            bytes.splice(15..19, 0.5f64.to_le_bytes());
        }
        let told = AttributeEntry::read(&mut Fields::new(&bytes, 100, "3.3")).unwrap_err();
        let what = "an attribute's lattice is not in its shortest form";
        assert_eq!(told, FormatError::new(107, "3.3", what), "{marks}");
    }
    // An error that is finite in steps alone.
    let quantisation = Quantisation::Lattice { bits: 8, origin: vec![0.0], step: f64::MAX };
    let entry = AttributeEntry { quantisation, ..plain(Semantic::Generic, 1, Stored::F64) };
    let mut bytes = Vec::new();
    entry.write(&mut bytes).unwrap();
    let end = bytes.len();
    bytes[end - 2..].copy_from_slice(&0x4000u16.to_le_bytes());
    let told = AttributeEntry::read(&mut Fields::new(&bytes, 0, "3.3")).unwrap_err();
    assert_eq!(told, FormatError::new(end as u64 - 2, "3.3", "the error of an attribute is not finite"));
}

#[test]
fn attributes_and_values_belong_together() {
    let mut file = attributed_file();
    file.attributes.clear();
    let fault = parse_contents(&bytes(&file)).unwrap_err();
    assert_eq!((fault.section, &*fault.what), ("3.3", "values of attributes where there are no attributes"));
    let mut file = small_file();
    file.attributes = attributed_file().attributes;
    let whole = bytes(&file);
    let fault = parse_contents(&whole).unwrap_err();
    assert_eq!((fault.section, &*fault.what), ("3.3", "5 attributes without values"));
    let table = u64::from(whole[13]) + (u64::from(whole[14]) << 8);
    assert_eq!(fault.offset, 16 + table - 4);
    // Values come once, behind the residue and before the order.
    let mut file = attributed_file();
    file.payload(AtomKind::Order, 0, b"order");
    let [attributes, order] = [contents(&file).attribute_atoms(0).start, contents(&file).order().start];
    assert_eq!((attributes, order), (8, 9));
}

#[test]
fn births_at_all_levels() {
    let contents = contents(&born_file());
    assert_eq!(contents.attributes, born_file().attributes);
    let [born, alive] = [0, 1].map(|what| {
        [2, 1, 0, 3].map(|j| match what {
            0 => contents.births_at(j).collect::<Vec<_>>(),
            _ => contents.alive_at(j).collect(),
        })
    });
    assert_eq!(born, [vec![0], vec![1, 2], vec![3, 4], vec![]]);
    assert_eq!(alive, [vec![0], vec![0, 1, 2], vec![0, 1, 2, 3, 4], vec![]]);
    assert_eq!([0, 1, 2, 3].map(|j| contents.attribute_atoms(j)), [11..12, 5..7, 1..1, 0..0]);
    // Behind the components that are born, of the same mesh, and part of what leads to the level.
    assert_eq!([2, 1, 0].map(|j| contents.steps(j)), [0..1, 1..7, 7..10]);
    assert_eq!((contents.born(1), contents.born(0), contents.operations(1..7)), ([4, 4], [0; 2], 3));
    let told: Vec<_> = contents.atoms[4..7].iter().map(|atom| (atom.kind, atom.level, atom.last)).collect();
    let values = AtomKind::Attributes;
    assert_eq!(told, [(AtomKind::Birth, 1, true), (values, 1, false), (values, 1, true)]);
    assert!(contents.atoms[4..7].iter().all(|atom| (atom.vertices_after, atom.triangles_after) == (12, 16)));
    // The table grows by what the birth takes, by the entries of two atoms of values (nothing tells that there are any), and by errors:
    // two codes of the first attribute at the base, two bytes at level 1, and there two codes of each of the two that are born at it.
    let alike = |file: &FileBuilder| {
        let mut file = file.clone();
        file.attributes.iter_mut().for_each(|attribute| attribute.birth = 0);
        file.pieces.retain(|piece| piece.kind != AtomKind::Attributes || piece.level == 0);
        crate::container::testing::contents(&file).header.table_bytes
    };
    assert_eq!(contents.header.table_bytes, alike(&born_file()) + 2 * 3 + 4 + 2 + 2 * 4);
}

#[test]
fn plans_take_the_values_of_levels() {
    let contents = contents(&born_file());
    let atoms = |want| {
        let plan = plan(&contents, want);
        (plan.parts[0].atoms.end, plan.level, plan.complete)
    };
    assert_eq!(atoms(Want::Level(1)), (7, 1, true));
    assert_eq!(atoms(Want::Triangles(16)), (7, 1, true), "values add no triangle");
    assert_eq!(atoms(Want::Triangles(15)), (4, 1, false), "a birth comes whole, values behind it");
    assert_eq!(atoms(Want::Triangles(u32::MAX)), (10, 0, true), "those of level 0 come with its residue");
    assert_eq!(atoms(Want::Bytes(contents.atoms[6].end() - 1)), (6, 1, false));
    assert_eq!(atoms(Want::All), (13, 0, true));
    // A keyframe holds what is alive at its level.
    let runs =
        |j| plan_from_keyframe(&contents, j).parts.into_iter().map(|part| part.atoms).collect::<Vec<_>>();
    assert_eq!([runs(1), runs(0)].concat(), [13..14, 13..14, 7..13]);
    let mut file = born_file();
    file.pieces.retain(|piece| piece.kind != AtomKind::Keyframe);
    let contents = crate::container::testing::contents(&file);
    assert_eq!(plan_from_keyframe(&contents, 1).parts[1].atoms, 1..7);
}

#[test]
fn births_and_payloads_belong_together() {
    let changed = |change: fn(&mut FileBuilder)| {
        let mut file = born_file();
        change(&mut file);
        file
    };
    fn drop_values(file: &mut FileBuilder, level: u32) {
        file.pieces.retain(|piece| piece.kind != AtomKind::Attributes || piece.level != level);
    }
    for (file, what) in [
        (changed(|f| f.attributes[4].birth = 3), "an attribute is born at level 3, allowed 0 to 2"),
        (changed(|f| drop_values(f, 1)), "level 1 has no atom of kind Attributes"),
        (changed(|f| drop_values(f, 0)), "2 attributes without values"),
        (
            changed(|f| f.attributes.iter_mut().for_each(|attribute| attribute.birth = 0)),
            "an atom of kind Attributes at level 1 has no place",
        ),
        (
            changed(|f| f.payload(AtomKind::Attributes, 2, b"base")),
            "an atom of kind Attributes at level 2 has no place",
        ),
        (
            changed(|f| f.payload(AtomKind::Attributes, 9, b"nowhere")),
            "an atom of kind Attributes at level 9 has no place",
        ),
    ] {
        assert_eq!(refusal(file), what);
    }
    // What is read: the offset is that of the entry, of the first that is wrong.
    let mut file = born_file();
    file.attributes[2].birth = 7;
    let fault = parse_contents(&bytes(&file)).unwrap_err();
    let lengths = file.attributes.iter().map(|attribute| {
        let mut entry = Vec::new();
        attribute.write(&mut entry).unwrap();
        entry.len() as u64
    });
    let before: u64 = lengths.take(2).sum();
    let what = "an attribute is born at level 7, allowed 0 to 2";
    assert_eq!(fault, FormatError::new(16 + 22 + before, "3.3", what));
    // Level 0 may have values where nothing is born at it, those of further triangles.
    let bare =
        changed(|f| f.attributes.iter_mut().for_each(|attribute| attribute.birth = attribute.birth.max(1)));
    assert_eq!(contents(&bare).attribute_atoms(0), 11..12);
    let mut none = bare;
    drop_values(&mut none, 0);
    assert!(contents(&none).attribute_atoms(0).is_empty());
    // Where there is but the base, all values are its own.
    let levels = vec![Level { vertices: 3, triangles: 1, ..Level::default() }];
    let mut only = FileBuilder::new(bare_lattice(), [1; 3], levels);
    only.attributes = vec![plain(Semantic::Color, 4, Stored::U8)];
    only.payload(AtomKind::Base, 0, b"base");
    assert!(contents(&only).attribute_atoms(0).is_empty());
    assert_eq!(contents(&only).births_at(0).count(), 1);
    only.payload(AtomKind::Attributes, 0, b"further");
    assert_eq!(contents(&only).attribute_atoms(0), 1..2);
}

fn bare_lattice() -> crate::mesh::Lattice {
    crate::mesh::Lattice { origin: [0.0; 3], step: 1.0, bits: 8 }
}

#[test]
fn more_than_allowed() {
    let with = |count: usize| {
        let mut file = attributed_file();
        file.attributes = vec![plain(Semantic::Color, 4, Stored::U8); count];
        file
    };
    assert_eq!(contents(&with(64)).attributes.len(), 64);
    assert!(refusal(with(65)).contains("65 attributes"));
    let mut bytes = bytes(&with(64));
    bytes[12] = 65;
    mend(&mut bytes);
    let fault = parse_contents(&bytes).unwrap_err();
    assert_eq!(fault, FormatError::new(12, "3.2", "65 attributes, allowed 64"));
}

fn refusal(file: FileBuilder) -> String {
    match file.write(&mut Vec::new()) {
        Err(Error::Parameter(what)) => what,
        other => panic!("{other:?}"),
    }
}

#[test]
fn what_has_no_form_is_not_written() {
    type Change = fn(&mut AttributeEntry);
    let lattice = |bits, origin: &[f64], step| Quantisation::Lattice { bits, origin: origin.to_vec(), step };
    let uv = |quantisation| AttributeEntry { quantisation, ..plain(Semantic::TexCoord, 2, Stored::F32) };
    let rules: [(Change, &str); 16] = [
        (|a| a.constant = Some(vec![0; 2]), "uv: no such constant"),
        (|a| a.constant = Some(vec![0; 3]), "uv: no such constant"),
        (|a| (a.constant, a.quantisation) = (Some(vec![0]), Quantisation::Raw), "uv: no such constant"),
        (
            |a| {
                (a.constant, a.partial, a.quantisation, a.error) =
                    (Some(vec![0; 2]), true, Quantisation::Raw, 0.0)
            },
            "a value that all have, where some have none",
        ),
        (|a| a.components = 0, "uv: no such number of numbers a value"),
        (|a| a.components = 17, "uv: no such number of numbers a value"),
        (|a| a.components = 3, "uv: the origin has another number of numbers"),
        (|a| a.error = -1.0, "uv: an error that is negative, not finite or too large"),
        (|a| a.error = f64::NAN, "uv: an error that is negative, not finite or too large"),
        (|a| a.birth = 3, "an attribute is born at level 3, allowed 0 to 2"),
        (|a| a.name = "x".repeat(256), "the length of an attribute's name is 256, allowed 255"),
        (|a| a.normalised = true, "floating-point numbers that stand for fractions"),
        (|a| a.semantic = Semantic::Part, "a part is one integer a triangle"),
        (|a| a.stored = Stored::I8, "quantisation 1 of i8 numbers"),
        (|a| (a.quantisation, a.error) = (Quantisation::Raw, 1.0), "uv: an error where nothing is lost"),
        (
            |a| a.quantisation = Quantisation::Octahedral { bits: 8 },
            "octahedral coordinates of 2 numbers of uv",
        ),
    ];
    for (i, (change, what)) in rules.into_iter().enumerate() {
        let mut file = attributed_file();
        file.attributes = vec![uv(lattice(12, &[0.0, 0.5], 0.25))];
        change(&mut file.attributes[0]);
        assert_eq!(refusal(file), what, "rule {i}");
    }
    for (bits, origin, step, what) in [
        (25, [0.0; 2], 1.0, "an attribute of 25 bits a number, allowed 1 to 24"),
        (256 + 12, [0.0; 2], 1.0, "uv: no such number of bits"),
        (12, [0.0, f64::INFINITY], 1.0, "an attribute's origin is not finite"),
        (12, [0.0; 2], -1.0, "an attribute's step is negative"),
        (12, [0.0; 2], f64::NAN, "an attribute's step is not finite"),
    ] {
        let mut file = attributed_file();
        file.attributes = vec![uv(lattice(bits, &origin, step))];
        assert_eq!(refusal(file), what);
    }
}

proptest! {
    #[test]
    fn round_trip(attributes in vec(any_attribute(), 0..6)) {
        let mut file = attributed_file();
        if attributes.is_empty() {
            file = small_file();
        }
        file.attributes = attributes;
        let mut bytes = Vec::new();
        let given = file.attributes.clone();
        let told = file.write(&mut bytes).unwrap();
        prop_assert_eq!(told.attributes.len(), given.len());
        for (told, given) in told.attributes.iter().zip(given) {
            prop_assert!((given.error..=given.error * (1.0 + 1.0 / 128.0)).contains(&told.error));
            let birth = if given.constant.is_some() { 2 } else { given.birth };
            prop_assert_eq!(told, &AttributeEntry { birth, error: told.error, ..given });
        }
    }

    /// What is read has one form.
    #[test]
    fn one_form(mut bytes: Vec<u8>, first in 0u8..8, shape in 0u8..64, marks in 0u8..64) {
        bytes.splice(0..bytes.len().min(3), [first | 0x60, shape, marks]);
        let mut fields = Fields::new(&bytes, 0, "3.3");
        if let Ok(entry) = AttributeEntry::read(&mut fields) {
            let mut again = Vec::new();
            entry.write(&mut again).unwrap();
            prop_assert_eq!(&again, &bytes[..bytes.len() - fields.left()]);
        }
    }
}
