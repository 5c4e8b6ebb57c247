//! Resources beside the mesh: however the file is cut, whichever way in is taken, whatever is left out (spec §3.9).
#![cfg(feature = "encode")]

use std::ops::Range;
use std::sync::Arc;
use unweld::Error;
use unweld::container::{
    AtomKind, Contents, FileBuilder, Level, ResourceKind, Want, packed_scene, parse_contents, plan,
    plan_from_keyframe,
};
use unweld::decoder::{self, Decoder, Event, Options, Until};
use unweld::encoder::{self, Encoder, Keyframes, Place, Resource};
use unweld::limits::Limits;
use unweld::mesh::{Lattice, shapes};

const SCENE: &[u8] =
    br#"{"asset":{"version":"2.0"},"nodes":[{"mesh":0},{"mesh":0,"translation":[1,0,0]}],"buffers":[]}"#;

/// Bytes that do not repeat soon.
fn noise(count: usize, seed: u32) -> Vec<u8> {
    let mut state = seed;
    let mut next = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 24) as u8
    };
    (0..count).map(|_| next()).collect()
}

/// What a scene brings: its JSON, samples of animations, a small picture and a large one.
fn resources() -> Vec<Resource> {
    let buffer = |place, bytes| Resource { kind: ResourceKind::Buffer, place, bytes };
    vec![
        Resource { kind: ResourceKind::Scene, place: Place::Base, bytes: SCENE.to_vec() },
        buffer(Place::Base, noise(100, 1)),
        buffer(Place::Error(0.02), noise(3_000, 2)),
        buffer(Place::Finest, noise(200_000, 3)),
    ]
}

fn encoded() -> Vec<u8> {
    let options = encoder::Options { keyframes: Keyframes::Every(2), ..encoder::Options::default() };
    Encoder::new(options).resources(resources()).encode_to_vec(&shapes::bumpy_sphere(4, 1)).unwrap()
}

fn contents_of(file: &[u8]) -> Arc<Contents> {
    parse_contents(file).unwrap().unwrap()
}

fn at(range: Range<u64>) -> Range<usize> {
    range.start as usize..range.end as usize
}

/// All events of a decoder that has been given its bytes, without what they tell of the mesh; and the error that ends them.
fn drain(decoder: &mut Decoder, events: &mut Vec<String>) -> Option<Error> {
    loop {
        match decoder.poll() {
            Ok(Some(Event::Refined(delta))) => events.push(format!("refined {:?}", delta.vertices)),
            Ok(Some(Event::Contents(_))) => events.push("contents".to_owned()),
            Ok(Some(event)) => events.push(format!("{event:?}")),
            Ok(None) => return None,
            Err(error) => return Some(error),
        }
    }
}

#[test]
fn however_the_file_is_cut_the_events_are_the_same() {
    let file = encoded();
    let contents = contents_of(&file);
    let told = |size: usize| {
        let (mut decoder, mut events) = (Decoder::new(Options::default()), Vec::new());
        for piece in file.chunks(size) {
            decoder.push(piece);
            assert!(drain(&mut decoder, &mut events).is_none());
        }
        decoder.finish().unwrap();
        for (number, resource) in resources().iter().enumerate() {
            assert_eq!(
                decoder.resource(number),
                Some(&resource.bytes[..]),
                "resource {number}, pieces of {size}"
            );
        }
        events
    };
    let whole = told(file.len());
    for size in [1, 7, 1000, 65_536] {
        assert_eq!(told(size), whole, "pieces of {size}");
    }
    // Each is told behind its level and before the next one.
    for (number, entry) in contents.resources.iter().enumerate() {
        let place =
            |what: String| whole.iter().position(|event| event.starts_with(&what)).expect("it is told");
        let own = place(format!("Resource {{ number: {number} }}"));
        assert!(place(format!("Level {{ level: {},", entry.place)) < own, "{number}");
        if entry.place > 0 {
            assert!(own < place(format!("Level {{ level: {},", entry.place - 1)), "{number}");
        }
    }
}

#[test]
fn the_mesh_is_as_without_them() {
    let mesh = shapes::bumpy_sphere(4, 1);
    let with = Encoder::default().resources(resources()).encode_to_vec(&mesh).unwrap();
    let without = Encoder::default().encode_to_vec(&mesh).unwrap();
    let [with, without] = [with, without].map(|file| decoder::decode(&file, Options::default()).unwrap());
    assert_eq!(with.assembled().unwrap(), without.assembled().unwrap());
    assert!(without.resources().is_empty() && without.scene().is_none());
    let file = encoded();
    let bare = decoder::decode(&file, Options { mesh_alone: true, ..Options::default() }).unwrap();
    assert_eq!(bare.assembled().unwrap().triangles.len(), mesh.triangles.len());
    assert_eq!((bare.resources().len(), bare.scene(), bare.resource(1)), (4, None, None));
}

/// Levels are left and come back; what has arrived stays. What has been taken is gone, until it is added again.
#[test]
fn going_down_and_up_leaves_them() {
    let file = encoded();
    let mut decoder = decoder::decode(&file, Options { undo: true, ..Options::default() }).unwrap();
    while decoder.coarsen().unwrap().is_some() {
        assert_eq!(decoder.scene(), Some(SCENE));
        assert_eq!(decoder.resource(3).map(<[u8]>::len), Some(200_000));
    }
    while decoder.restore().unwrap().is_some() {}
    assert_eq!(decoder.take_resource(3), Some(noise(200_000, 3)));
    assert!(decoder.resource(3).is_none() && decoder.take_resource(3).is_none());
    let bytes = decoder.contents().unwrap().bytes(decoder.resources()[3].atoms.clone());
    decoder.add_resource(3, &file[at(bytes.clone())]).unwrap();
    assert_eq!(decoder.resource(3), Some(&noise(200_000, 3)[..]));
    // What is not its own is refused, and changes nothing.
    let mut wrong = file[at(bytes)].to_vec();
    wrong[150_000] ^= 1;
    assert!(matches!(decoder.add_resource(3, &wrong), Err(Error::Format(fault)) if fault.section == "3.4"));
    assert!(matches!(decoder.add_resource(3, &wrong[..9]), Err(Error::Format(_))));
    assert!(matches!(decoder.add_resource(4, &wrong), Err(Error::Parameter(_))));
    assert_eq!(decoder.resource(3), Some(&noise(200_000, 3)[..]));
}

/// Each way in has all that stands before it, and stops behind the level with what belongs to it.
#[test]
fn every_way_in_has_them() {
    let file = encoded();
    let contents = contents_of(&file);
    assert!(contents.segments().count() > 2);
    for level in 0..=contents.base_level() {
        for plan in [plan(&contents, Want::Level(level)), plan_from_keyframe(&contents, level)] {
            let until = Until { level, ..Until::default() };
            let mut decoder =
                Decoder::of_plan(contents.clone(), &plan, Options { until, ..Options::default() });
            plan.parts.iter().for_each(|part| decoder.push(&file[at(part.bytes.clone())]));
            let mut events = Vec::new();
            assert!(drain(&mut decoder, &mut events).is_none());
            decoder.finish().unwrap();
            assert_eq!(decoder.level(), Some(level));
            for (number, entry) in contents.resources.iter().enumerate() {
                let there = decoder.resource(number).is_some();
                assert_eq!(
                    there,
                    entry.place >= level,
                    "resource {number} at level {level} from {}",
                    plan.start
                );
            }
            // Without them the same mesh is there, and what is missing can be had by itself.
            let bare = plan.without(&contents, |_| true);
            let mut other =
                Decoder::of_plan(contents.clone(), &bare, Options { until, ..Options::default() });
            bare.parts.iter().for_each(|part| other.push(&file[at(part.bytes.clone())]));
            assert!(drain(&mut other, &mut Vec::new()).is_none());
            other.finish().unwrap();
            assert_eq!((other.level(), other.scene()), (Some(level), None));
            assert_eq!(other.assembled().unwrap(), decoder.assembled().unwrap());
            let scene = contents.bytes(contents.resources[0].atoms.clone());
            other.add_resource(0, &file[at(scene)]).unwrap();
            assert_eq!(other.scene(), Some(SCENE));
        }
    }
}

/// The scene says which of the resources are wanted; those that have begun come to their end or not, and nothing else is different.
#[test]
fn what_is_skipped_need_not_come() {
    let file = encoded();
    let contents = contents_of(&file);
    let sizes = [1, 100, contents.base_end() as usize, file.len() / 2, file.len() - 1000];
    for size in sizes {
        let mut decoder = Decoder::new(Options::default());
        let mut events = Vec::new();
        decoder.push(&file[..size]);
        assert!(drain(&mut decoder, &mut events).is_none());
        decoder.skip(|number| number >= 2);
        let mut pushed = size as u64;
        if decoder.contents().is_none() {
            assert_eq!(decoder.missing(), []);
            decoder.push(&file[size..size + 2000]);
            pushed += 2000;
            assert!(drain(&mut decoder, &mut events).is_none());
            decoder.skip(|number| number >= 2);
        }
        let missing = decoder.missing();
        assert_eq!(missing.last().map_or(file.len() as u64, |range| range.end), file.len() as u64);
        assert!(missing.is_empty() || missing[0].start >= pushed);
        for entry in &contents.resources[2..] {
            let atoms = contents.atoms[entry.atoms.clone()].iter();
            for atom in atoms.filter(|atom| atom.offset >= pushed) {
                assert!(missing.iter().all(|range| range.end <= atom.offset || range.start >= atom.end()));
            }
        }
        for range in missing {
            for piece in file[at(range)].chunks(5000) {
                decoder.push(piece);
                assert!(drain(&mut decoder, &mut events).is_none());
            }
        }
        decoder.finish().unwrap();
        assert!(decoder.missing().is_empty());
        assert_eq!((decoder.level(), decoder.scene()), (Some(0), Some(SCENE)));
        let whole = decoder::decode(&file, Options::default()).unwrap();
        assert_eq!(decoder.assembled().unwrap(), whole.assembled().unwrap());
        for number in 2..4 {
            let there = contents.bytes(contents.resources[number].atoms.clone()).end <= pushed;
            assert_eq!(decoder.resource(number).is_some(), there, "resource {number} after {pushed} bytes");
        }
        assert_eq!(events.iter().filter(|event| event.starts_with("End")).count(), 1);
    }
}

/// A resource that began before the way in is none: only whole ones are told.
#[test]
fn half_a_resource_is_none() {
    let file = encoded();
    let contents = contents_of(&file);
    let mut plan = plan(&contents, Want::All);
    let atoms = contents.resources[3].atoms.clone();
    assert!(atoms.len() > 2);
    let (first, rest) = (plan.parts[0].atoms.start..atoms.start, atoms.start + 1..plan.parts[0].atoms.end);
    plan.parts = [first, rest]
        .map(|atoms| unweld::container::Part { bytes: contents.bytes(atoms.clone()), atoms })
        .to_vec();
    let mut decoder = Decoder::of_plan(contents.clone(), &plan, Options::default());
    plan.parts.iter().for_each(|part| decoder.push(&file[at(part.bytes.clone())]));
    assert!(drain(&mut decoder, &mut Vec::new()).is_none());
    decoder.finish().unwrap();
    assert_eq!((decoder.resource(2).is_some(), decoder.resource(3)), (true, None));
}

/// A file of a triangle with these resources.
fn triangle_with(resources: &[(ResourceKind, &[u8])]) -> Vec<u8> {
    let base = Encoder::default().encode_to_vec(&unweld::mesh::IndexedMesh::new(
        vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
        vec![[0, 1, 2]],
    ));
    let plain = base.unwrap();
    let contents = contents_of(&plain);
    let header = contents.header;
    let levels: Vec<Level> = contents.levels.clone();
    let mut file = FileBuilder::new(Lattice { ..header.lattice }, header.maximum, levels);
    file.coding = header.coding;
    for atom in &contents.atoms {
        file.atom(
            atom.kind,
            atom.level,
            atom.items,
            atom.triangles,
            plain[at(atom.offset..atom.end())].to_vec(),
        );
    }
    resources.iter().for_each(|&(kind, bytes)| file.resource(kind, 0, bytes));
    let mut bytes = Vec::new();
    file.write(&mut bytes).unwrap();
    bytes
}

#[test]
fn a_bad_scene_is_refused_where_it_stands() {
    let scene = |bytes: &[u8]| {
        let file = triangle_with(&[(ResourceKind::Scene, bytes), (ResourceKind::Buffer, b"x")]);
        let contents = contents_of(&file);
        let offset = contents.bytes(contents.resources[0].atoms.clone()).start;
        let outcome =
            decoder::decode(&file, Options::default()).map(|decoder| decoder.scene().unwrap().to_vec());
        // Whoever wants the mesh alone does not read it.
        assert!(decoder::decode(&file, Options { mesh_alone: true, ..Options::default() }).is_ok());
        outcome.map_err(|error| match error {
            Error::Format(fault) => (fault.offset - offset, fault.section, fault.what),
            other => panic!("{other}"),
        })
    };
    assert_eq!(scene(b"\x00\x02{}"), Ok(b"{}".to_vec()));
    assert_eq!(scene(b"\x01\x14\x4B\xC4\x02\x00"), Ok(vec![b'a'; 20]));
    let (at, section, what) = scene(b"\x01\x15\x4B\xC4\x02\x00").unwrap_err();
    assert_eq!((at, section), (0, "3.9"));
    assert!(what.contains("20 bytes instead of 21"), "{what}");
    assert!(scene(b"\x01\x13\x4B\xC4\x02\x00").unwrap_err().2.contains("more than 19"));
    assert!(scene(b"\x01\x14\x4B\xC4\x02").unwrap_err().2.contains("its end is missing"));
    assert!(scene(b"\x02\x14").unwrap_err().2.contains("unknown form"));
    assert!(scene(&[1]).is_err() && scene(&[0, 0]).is_err());
}

/// Memory and work of a scene are debited before it is inflated, those of others as their bytes arrive.
#[test]
fn limits_are_kept() {
    let json = vec![b' '; 1 << 20];
    let packed = packed_scene(&json).unwrap();
    assert!(packed.len() < 2000);
    let file = triangle_with(&[(ResourceKind::Scene, &packed)]);
    let with = |memory, work| {
        let limits = Limits { memory, work };
        decoder::decode(&file, Options { limits, ..Options::default() }).map(|_| ())
    };
    assert!(with(2 << 20, 2 << 20).is_ok());
    assert!(matches!(with(1 << 20, 2 << 20), Err(Error::Limit { what: "memory in bytes", .. })));
    assert!(matches!(with(2 << 20, 1 << 20), Err(Error::Limit { what: "work in steps", .. })));
    let large = noise(300_000, 5);
    let file = triangle_with(&[(ResourceKind::Buffer, &large), (ResourceKind::Buffer, &large)]);
    let limits = Limits { memory: 700_000, ..Limits::default() };
    // Both at a time are too much; one after the other they are not.
    let mut decoder = Decoder::new(Options { limits, ..Options::default() });
    let mut outcome = Ok(());
    for piece in file.chunks(10_000) {
        decoder.push(piece);
        while outcome.is_ok() {
            match decoder.poll() {
                Ok(Some(_)) => {}
                Ok(None) => break,
                Err(error) => outcome = Err(error),
            }
        }
    }
    assert!(matches!(outcome, Err(Error::Limit { .. })) && decoder.resource(0) == Some(&large[..]));
    let mut decoder = Decoder::new(Options { limits, ..Options::default() });
    for piece in file.chunks(10_000) {
        decoder.push(piece);
        while let Some(event) = decoder.poll().unwrap() {
            if let Event::Resource { number } = event {
                assert_eq!(decoder.take_resource(number), Some(large.clone()));
            }
        }
    }
    decoder.finish().unwrap();
}

/// Most of the file may be a resource that is never taken: a table that tells of much reserves nothing.
#[test]
fn what_is_only_promised_takes_no_memory() {
    let file = triangle_with(&[(ResourceKind::Buffer, &noise(3_000_000, 7))]);
    let contents = contents_of(&file);
    let first = contents.bytes(contents.resources[0].atoms.clone()).start as usize;
    let limits = Limits { memory: 100_000, ..Limits::default() };
    let mut decoder = Decoder::new(Options { limits, ..Options::default() });
    decoder.push(&file[..first + 60_000]);
    while decoder.poll().unwrap().is_some() {}
    assert_eq!((decoder.level(), decoder.resource(0)), (Some(0), None));
}

#[test]
fn every_cut_is_told() {
    let file = triangle_with(&[(ResourceKind::Scene, b"\x00\x02{}"), (ResourceKind::Buffer, &noise(300, 9))]);
    let contents = contents_of(&file);
    for cut in contents.header.table_end() as usize..file.len() {
        let fault = decoder::decode(&file[..cut], Options::default()).expect_err("bytes are missing");
        let Error::Format(fault) = fault else { panic!("{fault}") };
        assert_eq!((fault.offset, fault.section), (cut as u64, "3.1"));
    }
    let kinds: Vec<_> = contents.atoms.iter().map(|atom| atom.kind).collect();
    assert_eq!(kinds[..3], [AtomKind::Base, AtomKind::Resource, AtomKind::Resource]);
}
