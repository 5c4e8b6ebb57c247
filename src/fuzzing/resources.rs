//! Resources: on their way, left out, and added.

use std::collections::BTreeMap;
use std::sync::OnceLock;

use super::choices::Choices;
use crate::container::{AtomKind, Contents, FileBuilder, ResourceKind, packed_scene, parse_contents};
use crate::decoder::{Decoder, Event, Options};
use crate::encoder::{self, Encoder, Keyframes};
use crate::limits::Limits;
use crate::mesh::shapes;

/// Reads `data` as resources of a small file: however it is cut, whatever is left out of it, what is there is the same.
pub fn fuzz_resources(data: &[u8]) {
    let mut choices = Choices(data);
    let Some(file) = file(&mut choices) else { return };
    let whole = tell(&file, &mut |left| left);
    assert_eq!(whole, tell(&file, &mut |_| 7), "pieces of seven bytes");
    assert_eq!(whole, tell(&file, &mut |_| 1 + choices.below(300)), "irregular pieces");
    let contents = parse_contents(&file).ok().flatten().expect("the writer wrote it");
    skipped(&file, &contents, &whole, &mut choices);
    for (number, entry) in contents.resources.iter().enumerate() {
        let bytes = contents.bytes(entry.atoms.clone());
        let own = &file[bytes.start as usize..bytes.end as usize];
        let mut decoder = Decoder::new(options());
        decoder.push(&file[..contents.header.table_end() as usize]);
        while matches!(decoder.poll(), Ok(Some(_))) {}
        let added = decoder.add_resource(number, own).is_ok();
        assert!(added || entry.kind == ResourceKind::Scene, "opaque bytes are never wrong");
        if let Some(bytes) = whole.resources.get(&number) {
            assert_eq!(decoder.take_resource(number).as_ref(), Some(bytes));
        }
        assert!(decoder.resource(number).is_none() || !whole.resources.contains_key(&number));
    }
}

/// A file of some levels, with the resources that the choices say; `None` where there may be no such file.
fn file(choices: &mut Choices) -> Option<Vec<u8>> {
    static BARE: OnceLock<Vec<u8>> = OnceLock::new();
    let bare = BARE.get_or_init(|| {
        let keyframes = Keyframes::Every(2);
        let mut options =
            encoder::Options { position_bits: 8, keyframes, atom_bytes: 12, ..encoder::Options::default() };
        options.simplify.base_vertices = Some(4);
        Encoder::new(options).encode_to_vec(&shapes::sphere(1)).expect("a small mesh can be encoded")
    });
    let contents = parse_contents(bare).ok().flatten().expect("the encoder wrote it");
    let mut file =
        FileBuilder::new(contents.header.lattice, contents.header.maximum, contents.levels.clone());
    file.coding = contents.header.coding;
    for atom in &contents.atoms {
        let bytes = bare[atom.offset as usize..atom.end() as usize].to_vec();
        file.atom(atom.kind, atom.level, atom.items, atom.triangles, bytes);
    }
    let mut place = contents.base_level();
    for number in 0..choices.below(6) {
        let what = choices.byte().unwrap_or(0);
        // Mostly where it may stand.
        place = if what < 250 { place.saturating_sub(u32::from(what % 3)) } else { u32::from(what) };
        let (count, times) = (1 + choices.below(40), 1 + choices.below(3) * choices.below(3000));
        let mut bytes = choices.bytes(count).repeat(times);
        bytes.push(what);
        let kind = if number == 0 && !what.is_multiple_of(4) || what == 249 {
            ResourceKind::Scene
        } else {
            ResourceKind::Buffer
        };
        if kind == ResourceKind::Scene && what % 4 > 1 {
            bytes = packed_scene(&bytes).ok()?;
            let at = choices.below(bytes.len());
            bytes[at] ^= if what % 4 == 3 { choices.byte().unwrap_or(0) } else { 0 };
        }
        file.resource(kind, place, &bytes);
    }
    let mut written = Vec::new();
    file.write(&mut written).ok()?;
    Some(written)
}

/// What a decoder told, and what it holds at the end.
#[derive(Debug, PartialEq)]
struct Story {
    events: Vec<Event>,
    resources: BTreeMap<usize, Vec<u8>>,
    fault: Option<String>,
}

fn tell(mut file: &[u8], size: &mut dyn FnMut(usize) -> usize) -> Story {
    let mut decoder = Decoder::new(options());
    let mut story = Story { events: Vec::new(), resources: BTreeMap::new(), fault: None };
    while !file.is_empty() && story.fault.is_none() {
        let (piece, rest) = file.split_at(size(file.len()).min(file.len()));
        file = rest;
        decoder.push(piece);
        story.fault = poll(&mut decoder, &mut story.events);
    }
    story.fault = story.fault.or_else(|| decoder.finish().err().map(|fault| fault.to_string()));
    let count = decoder.resources().len();
    story.resources =
        (0..count).filter_map(|number| Some((number, decoder.resource(number)?.to_vec()))).collect();
    // Each is told once, and is there.
    let told = story.events.iter().filter_map(|event| match event {
        Event::Resource { number } => Some(*number),
        _ => None,
    });
    assert!(told.eq(story.resources.keys().copied()));
    story
}

fn poll(decoder: &mut Decoder, events: &mut Vec<Event>) -> Option<String> {
    loop {
        match decoder.poll() {
            Ok(Some(event)) => events.push(event),
            Ok(None) => return None,
            Err(fault) => return Some(fault.to_string()),
        }
    }
}

/// Some are left out somewhere on the way: nothing else is different.
fn skipped(file: &[u8], contents: &Contents, whole: &Story, choices: &mut Choices) {
    let (first, mask) = (choices.below(file.len()), choices.byte().unwrap_or(1));
    let is_skipped = |number: usize| mask >> (number % 8) & 1 == 1;
    let mut decoder = Decoder::new(options());
    let mut events = Vec::new();
    decoder.push(&file[..first]);
    let mut fault = poll(&mut decoder, &mut events);
    decoder.skip(is_skipped);
    let rest = decoder.missing();
    if decoder.contents().is_none() {
        assert!(rest.is_empty());
        return;
    }
    for range in rest {
        if fault.is_some() {
            break;
        }
        assert!(range.start >= first as u64 && !range.is_empty());
        decoder.push(&file[range.start as usize..range.end as usize]);
        fault = poll(&mut decoder, &mut events);
    }
    let of_scene = |number: usize| contents.resources[number].kind == ResourceKind::Scene;
    match (&fault, &whole.fault) {
        // What is wrong may be left out.
        (None, Some(_)) => assert!(is_skipped(0) && of_scene(0)),
        (fault, other) => assert_eq!(fault, other),
    }
    if whole.fault.is_some() {
        return;
    }
    decoder.finish().expect("all that was wanted is there");
    assert!(decoder.missing().is_empty());
    let others = |event: &&Event| !matches!(event, Event::Resource { .. });
    assert!(events.iter().filter(others).eq(whole.events.iter().filter(others)));
    for (number, bytes) in &whole.resources {
        let end = contents.bytes(contents.resources[*number].atoms.clone()).end;
        let expected = Some(&bytes[..]).filter(|_| !is_skipped(*number) || end <= first as u64);
        let last = contents.resources[*number].atoms.end - 1;
        let has_begun = contents.atoms[last].offset < first as u64;
        assert!(decoder.resource(*number) == expected || has_begun, "resource {number}");
        assert_eq!(contents.atoms[last].kind, AtomKind::Resource);
    }
}

fn options() -> Options {
    Options { limits: Limits { memory: 64 << 20, work: 1 << 26 }, ..Options::default() }
}
