//! Files for tests: small, random, broken.

use std::cmp::Reverse;
use std::collections::VecDeque;
use std::ops::Range;

use proptest::collection::vec;
use proptest::prelude::*;

use super::attributes::AttributeEntry;
use super::contents::{AtomKind, Contents, Level};
use super::header::{Coding, Header};
use super::resources::ResourceKind;
use super::write::{FileBuilder, Told};
use crate::mesh::attributes::dyadic::Dyadic;
use crate::mesh::attributes::{Domain, Quantisation, Semantic, Stored};
use crate::mesh::lattice::Lattice;

/// Three levels, a change of precision, residue, metadata, one keyframe, two optional atoms; errors that are exact in the table.
pub fn small_file() -> FileBuilder {
    let lattice = Lattice { origin: [-1.0, 0.0, 0.5], step: 0.25, bits: 12 };
    let level = |vertices, triangles, precision, max_error| Level {
        vertices,
        triangles,
        precision,
        max_error,
        rms_error: 0.125,
        attributes: Vec::new(),
    };
    let levels = vec![level(12, 20, 0, 0.09375), level(8, 12, 2, 0.25), level(5, 6, 3, 0.5)];
    let mut file = FileBuilder::new(lattice, [4095, 0, 17], levels);
    file.coding = Coding { lifting: 13, rich_models: true };
    file.payload(AtomKind::Base, 2, b"base");
    file.atom(AtomKind::Precision, 1, 5, 0, b"precise".to_vec());
    file.atom(AtomKind::Refinement, 1, 1, 2, b"one".to_vec());
    file.atom(AtomKind::Refinement, 1, 2, 4, b"two".to_vec());
    file.atom(AtomKind::Precision, 0, 10, 0, b"x".to_vec());
    file.atom(AtomKind::Precision, 0, 6, 0, b"y".to_vec());
    file.atom(AtomKind::Refinement, 0, 4, 8, b"four".to_vec());
    file.payload(AtomKind::Residue, 0, b"left over");
    file.payload(AtomKind::Metadata, 0, b"who");
    file.payload(AtomKind::Keyframe, 1, b"key");
    file.payload(AtomKind::Optional(200), 0, b"anything");
    file.payload(AtomKind::Optional(128), 0, b"more");
    file
}

/// The same with an attribute of each kind.
pub fn attributed_file() -> FileBuilder {
    let attribute = |semantic, components, stored, quantisation, error| AttributeEntry {
        semantic,
        set: 0,
        name: String::new(),
        domain: Domain::Corner,
        components,
        stored,
        normalised: false,
        partial: false,
        birth: 0,
        quantisation,
        error,
        constant: None,
    };
    let normal = attribute(Semantic::Normal, 3, Stored::F32, Quantisation::Octahedral { bits: 10 }, 0.125);
    let lattice = Quantisation::Lattice { bits: 12, origin: vec![0.1, -0.0], step: 0.25 };
    let uv = attribute(Semantic::TexCoord, 2, Stored::F64, lattice, 0.5);
    let uv = AttributeEntry { set: 1, partial: true, ..uv };
    let color = attribute(Semantic::Color, 4, Stored::U8, Quantisation::Integer, 0.0);
    let color = AttributeEntry { normalised: true, ..color };
    let part = attribute(Semantic::Part, 1, Stored::U32, Quantisation::Integer, 0.0);
    let part = AttributeEntry { domain: Domain::Triangle, ..part };
    let quality = attribute(Semantic::Generic, 16, Stored::F32, Quantisation::Raw, 0.0);
    let quality = AttributeEntry { name: "quality".to_owned(), ..quality };
    let mut file = small_file();
    file.attributes = vec![normal, uv, color, part, quality];
    file.payload(AtomKind::Attributes, 0, b"values");
    file
}

/// The same with a component born at level 1, and with attributes that are born at all three levels: at level 1 uv and color.
///
/// Atoms: 0 base, 1 to 3 level 1, 4 its birth, 5 and 6 its attributes, 7 to 9 level 0, 10 residue, 11 attributes, 12 metadata, 13 keyframe of
/// level 1.
pub fn born_file() -> FileBuilder {
    let mut file = attributed_file();
    for (attribute, birth) in file.attributes.iter_mut().zip([2, 1, 1, 0, 0]) {
        attribute.birth = birth;
    }
    for level in &mut file.levels[..2] {
        (level.vertices, level.triangles) = (level.vertices + 4, level.triangles + 4);
    }
    let precise =
        file.pieces.iter_mut().filter(|piece| piece.kind == AtomKind::Precision && piece.level == 0);
    precise.zip([14, 10]).for_each(|(piece, items)| piece.items = items);
    file.birth(1, [4, 4], b"component");
    file.payload(AtomKind::Attributes, 1, b"coarse");
    file.payload(AtomKind::Attributes, 1, b"values");
    file
}

/// The same with a scene and a buffer behind the base, one of two atoms behind level 1, and one behind level 0.
///
/// Atoms: 0 base, 1 and 2 its resources, 3 to 8 level 1, 9 and 10 its resource, 11 to 13 level 0, 14 its resource, 15 residue, 16 attributes,
/// 17 metadata, 18 keyframe of level 1.
pub fn resourced_file() -> FileBuilder {
    let mut file = born_file();
    file.resource(ResourceKind::Scene, 2, b"\x00\x02{}");
    file.resource(ResourceKind::Buffer, 2, b"samples");
    file.resources.push(Told { kind: ResourceKind::Buffer, place: 1, atoms: 2 });
    file.payload(AtomKind::Resource, 1, b"small");
    file.payload(AtomKind::Resource, 1, b"picture");
    file.resource(ResourceKind::Buffer, 0, b"large picture");
    file
}

/// Any attribute that a table may tell of.
pub fn any_attribute() -> impl Strategy<Value = AttributeEntry> {
    let stored = (0..Stored::ALL.len()).prop_map(|i| Stored::ALL[i]);
    let semantic = (0..Semantic::ALL.len()).prop_map(|i| Semantic::ALL[i]);
    let number = || prop_oneof![Just(0.0), Just(-0.0), Just(0.25), -1e9..1e9f64];
    let lattice = (1u32..=24, vec(number(), 16), prop_oneof![Just(0.0), Just(0.25), 1e-6..1e9f64]);
    let what = (semantic, any::<u32>(), "[ -~é]{0,12}", stored, 1usize..=16);
    (what, any::<[bool; 4]>(), lattice, 0u8..3, 2u32..=16, 0.0..1e30f64).prop_map(
        |(
            what,
            [triangles, normalised, partial, constant],
            (bits, origin, step),
            kind,
            octahedral,
            error,
        )| {
            let (semantic, set, name, stored, components) = what;
            let is_part = semantic == Semantic::Part;
            let stored = if is_part { Stored::U32 } else { stored };
            let components = match semantic {
                Semantic::Part => 1,
                Semantic::Normal => 3,
                Semantic::Tangent => 4,
                _ => components,
            };
            let is_unit = matches!(semantic, Semantic::Normal | Semantic::Tangent);
            let quantisation = match kind {
                _ if !stored.is_float() => Quantisation::Integer,
                0 => Quantisation::Raw,
                1 if is_unit => Quantisation::Octahedral { bits: octahedral },
                _ if constant => {
                    let origin = Dyadic::rounded(&origin[..components], bits).and_then(|it| it.numbers());
                    Quantisation::Lattice { bits: 1, origin: origin.unwrap(), step: 0.0 }
                }
                _ => Quantisation::Lattice { bits, origin: origin[..components].to_vec(), step },
            };
            let value = |count: usize| match quantisation {
                Quantisation::Lattice { .. } => vec![0; count],
                _ => (0..count).map(|k| origin[k % 16].to_bits().rotate_left(17 + k as u32) as i32).collect(),
            };
            let constant = constant.then(|| value(quantisation.integers(components, stored)));
            let exact = matches!(quantisation, Quantisation::Integer | Quantisation::Raw);
            AttributeEntry {
                semantic,
                set,
                name,
                domain: if triangles || is_part { Domain::Triangle } else { Domain::Corner },
                components,
                stored,
                normalised: normalised && !stored.is_float(),
                partial: partial && constant.is_none(),
                birth: 0,
                quantisation,
                error: if exact { 0.0 } else { error },
                constant,
            }
        },
    )
}

/// Any valid file of some levels, its atoms in order.
pub fn any_file() -> impl Strategy<Value = FileBuilder> {
    let operations = vec(1u32..=2, 1..20);
    let finer = vec((operations, 0u32..3, any::<bool>(), 1usize..5), 0..4);
    let payloads = (vec(any::<u8>(), 1..50), vec(any::<u8>(), 0..9), vec(any::<u8>(), 0..9), 0usize..6);
    let errors = vec((0.0..1e30f64, 0.0..1e30f64), 4);
    let step = prop_oneof![Just(0.0), Just(0.25), 1e-6..1e9f64];
    let frame = (8u32..=24, step, prop_oneof![Just(0.5), -1e9..1e9f64], any::<[u32; 3]>());
    let resources = (any::<bool>(), vec((any::<u32>(), vec(any::<u8>(), 1..9)), 0..4));
    let payloads = (payloads, vec((any_attribute(), any::<u32>()), 0..4), resources);
    (finer, payloads, errors, frame).prop_map(|(finer, (payloads, attributes, resources), errors, frame)| {
        let (base, residue, metadata, place) = payloads;
        let (bits, step, x, maximum) = frame;
        let depth = finer.len() as u32;
        let shifts: Vec<u32> = finer.iter().map(|&(_, shift, ..)| shift).collect();
        let mut level =
            Level { vertices: 4, triangles: 4, precision: shifts.iter().sum(), ..Level::default() };
        let mut levels = vec![level.clone()];
        let lattice = Lattice { origin: [x, -x, 0.0], step, bits };
        let mut file = FileBuilder::new(lattice, maximum.map(|m| m & ((1 << bits) - 1)), Vec::new());
        let born = attributes.into_iter();
        let birth = |entry: &AttributeEntry, birth: u32| match entry.constant {
            Some(_) => depth,
            None => birth % (depth + 1),
        };
        file.attributes =
            born.map(|(entry, at)| AttributeEntry { birth: birth(&entry, at), ..entry }).collect();
        let told = file.attributes.clone().into_iter().filter(|attribute| attribute.constant.is_none());
        let told: Vec<u32> = told.map(|attribute| attribute.birth).collect();
        let (has_scene, resources) = resources;
        let mut places: Vec<u32> = resources.iter().map(|(place, _)| place % (depth + 1)).collect();
        places.sort_unstable_by_key(|&place| Reverse(place));
        let mut resources: VecDeque<_> =
            places.into_iter().zip(resources.into_iter().map(|(_, bytes)| bytes)).collect();
        let mut kind = if has_scene { ResourceKind::Scene } else { ResourceKind::Buffer };
        let mut place_resources = |file: &mut FileBuilder, j: u32| {
            while resources.front().is_some_and(|&(place, _)| place == j) {
                let bytes = resources.pop_front().map(|(_, bytes)| bytes).unwrap_or_default();
                file.resource(kind, j, &bytes);
                kind = ResourceKind::Buffer;
            }
        };
        file.payload(AtomKind::Base, depth, &base);
        place_resources(&mut file, depth);
        for (i, (operations, shift, _, per_atom)) in finer.iter().enumerate() {
            let j = depth - 1 - i as u32;
            if *shift > 0 {
                file.atom(AtomKind::Precision, j, level.vertices * shift, 0, vec![j as u8; *per_atom]);
            }
            for some in operations.chunks(*per_atom) {
                let (items, triangles) = (some.len() as u32, some.iter().sum());
                file.atom(AtomKind::Refinement, j, items, triangles, vec![items as u8; *per_atom]);
                level.vertices += items;
                level.triangles += triangles;
            }
            if j > 0 && told.contains(&j) {
                file.payload(AtomKind::Attributes, j, &base);
            }
            place_resources(&mut file, j);
            level.precision -= shift;
            (level.max_error, level.rms_error) = errors[i];
            levels.push(level.clone());
        }
        file.payload(AtomKind::Residue, 0, &residue);
        if told.contains(&0) {
            file.payload(AtomKind::Attributes, 0, &base);
        }
        file.payload(AtomKind::Metadata, 0, &metadata);
        for (i, (.., keyframe, _)) in finer.iter().enumerate() {
            if *keyframe {
                file.payload(AtomKind::Keyframe, depth - 1 - i as u32, &base);
            }
        }
        levels.reverse();
        file.levels = levels;
        if place > 2 {
            file.payload(AtomKind::Optional(255), 0, &base);
        }
        file
    })
}

/// The bytes of a file, right or wrong.
pub fn bytes(file: &FileBuilder) -> Vec<u8> {
    let mut file = file.clone();
    file.sort();
    let mut bytes = file.head().unwrap();
    file.pieces.iter().for_each(|piece| bytes.extend(&piece.bytes));
    bytes
}

/// The contents of a valid file.
pub fn contents(file: &FileBuilder) -> Contents {
    let contents = super::parse_contents(&bytes(file)).unwrap().unwrap();
    Contents::clone(&contents)
}

/// Bytes of some runs of atoms, summed one by one.
pub fn bytes_of(contents: &Contents, runs: &[Range<usize>]) -> u64 {
    runs.iter().flat_map(|run| &contents.atoms[run.clone()]).map(|atom| u64::from(atom.length)).sum()
}

/// What the example of spec §3.8 tells of the whole mesh, made by hand.
pub fn golden_header() -> Header {
    Header {
        vertices: 5,
        triangles: 6,
        base_vertices: 4,
        base_triangles: 4,
        level_count: 2,
        lattice: Lattice { origin: [-1.0, 0.0, 2.0], step: 0.5, bits: 8 },
        coding: Coding::default(),
        maximum: [255, 0, 16],
        table_bytes: 47,
    }
}

/// The header of that example.
pub const GOLDEN_HEADER: [u8; Header::SIZE] =
    [0x89, 0x55, 0x57, 0x4D, 0x0D, 0x0A, 0x1A, 0x0A, 0x01, 0x00, 0x00, 0x00, 0x00, 0x2F, 0x00, 0x00];

/// The rest of it: table of contents, base `abc`, refinement `de`.
#[rustfmt::skip]
pub const GOLDEN_REST: [u8; 52] = [
    0x68, 0x00, 0x00, 0x80, 0xBF, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x40, 0x00, 0x00, 0x00,
    0x3F, 0x00, 0xFF, 0x01, 0xEF, 0x01, 0x02, 0x04, 0x04, 0x00, 0x80, 0x3F, 0x00, 0x3F, 0x06, 0x4A,
    0x51, 0x04, 0x9F, 0xFD, 0x01, 0x9F, 0xFB, 0x01, 0x04, 0xE2, 0xE6, 0xDF, 0xF8, 0x7B, 0x4D,
    0x61, 0x62, 0x63, 0x64, 0x65,
];
