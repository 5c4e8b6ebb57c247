//! The container: header, table of contents, frames.

use std::sync::Arc;

use crate::container::{
    AtomKind, Contents, Header, Measure, Metadata, Parsed, Parser, Want, plan, plan_from_keyframe,
};
use crate::error::FormatError;

/// Reads `data` as a `.uwm` file, whole and in pieces, as it is and with header and table checksums mended.
pub fn fuzz_container(data: &[u8]) {
    compare_chunkings(data);
    let mut mended = data.to_vec();
    mend(&mut mended);
    compare_chunkings(&mended);
    if let Ok(metadata) = Metadata::decode(data, 0) {
        assert_eq!(metadata.encode().expect("what was decoded can be encoded"), data);
    }
}

/// What a parser told.
#[derive(Debug, Default, PartialEq)]
struct Story {
    contents: Option<Arc<Contents>>,
    atoms: Vec<(usize, Vec<u8>)>,
    ended: bool,
    outcome: Option<FormatError>,
}

fn compare_chunkings(data: &[u8]) {
    let whole = tell(data, |left| left);
    assert_eq!(whole, tell(data, |_| 1), "byte by byte");
    let mut state = 0x9E37_79B9u32 ^ data.len() as u32;
    let irregular = tell(data, |_| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 24) as usize % 97
    });
    assert_eq!(whole, irregular, "irregular pieces");
    if let Some(contents) = &whole.contents {
        check_contents(contents);
        assert!(whole.outcome.is_some() || (whole.ended && contents.file_bytes() == data.len() as u64));
    }
}

/// Feeds `data` in pieces of the sizes that `size` gives for the number of bytes left.
fn tell(mut data: &[u8], mut size: impl FnMut(usize) -> usize) -> Story {
    let mut story = Story::default();
    let mut parser = Parser::new();
    while !data.is_empty() {
        let (mut piece, rest) = data.split_at(size(data.len()).min(data.len()));
        data = rest;
        loop {
            match parser.parse(&mut piece) {
                Ok(Parsed::NeedMore(missing)) => {
                    assert!(piece.is_empty() && missing > 0);
                    break;
                }
                Ok(Parsed::Contents(contents)) => assert!(story.contents.replace(contents).is_none()),
                Ok(Parsed::Atom { index, payload }) => story.atoms.push((index, payload.to_vec())),
                Ok(Parsed::End) => {
                    assert!(piece.is_empty());
                    story.ended = true;
                    break;
                }
                Err(fault) => {
                    assert_eq!(parser.finish(), Err(fault.clone()));
                    story.outcome = Some(fault);
                    return story;
                }
            }
        }
    }
    story.outcome = parser.finish().err();
    story
}

/// Contents that were accepted are consistent, and plans over them neither panic nor leave the file.
fn check_contents(contents: &Contents) {
    let mut offset = contents.header.table_end();
    for atom in &contents.atoms {
        assert_eq!(atom.offset, offset);
        offset = atom.end();
    }
    let base = contents.base_level();
    assert!(contents.attribute_atoms(base).is_empty() || base == 0);
    for j in 0..base {
        let [born, told] = [contents.births_at(j).next().is_some(), !contents.attribute_atoms(j).is_empty()];
        // Level 0 may tell of further triangles alone.
        assert!(born == told || (j == 0 && told && !contents.attributes.is_empty()));
        assert!(contents.births_at(j).all(|k| contents.alive_at(j).any(|alive| alive == k)));
    }
    let mut places: Vec<usize> = Vec::new();
    for (number, entry) in contents.resources.iter().enumerate() {
        assert!(contents.resources_at(entry.place).contains(&number) && entry.place <= base);
        assert!(entry.atoms.clone().all(|atom| contents.resource_of(atom) == Some(number)));
        let bytes = contents.bytes(entry.atoms.clone());
        assert_eq!(
            (bytes.end - bytes.start, entry.atoms.start >= contents.steps(entry.place).end),
            (entry.bytes, true)
        );
        places.extend(entry.atoms.clone());
    }
    let kinds = contents.atoms.iter().enumerate().filter(|(_, atom)| atom.kind == AtomKind::Resource);
    assert!(places.iter().copied().eq(kinds.map(|(index, _)| index)));
    assert_eq!(contents.segments().next(), Some(base));
    for j in [0, base / 2, base] {
        let level = contents.level(j).expect("a level of the file");
        let last = &contents.atoms[contents.steps(j).end - 1];
        assert_eq!((last.vertices_after, last.triangles_after), (level.vertices, level.triangles));
        let wants = [
            Want::Level(j),
            Want::Triangles(level.triangles),
            Want::Error(Measure::Max, level.max_error),
            Want::Error(Measure::Rms, level.rms_error),
            Want::Bytes(last.end()),
            Want::All,
        ];
        let plans =
            wants.map(|want| plan(contents, want)).into_iter().chain([plan_from_keyframe(contents, j)]);
        assert!(contents.prefix(j).end <= contents.prefix(0).end);
        for plan in plans {
            assert!(plan.end() <= contents.file_bytes() && plan.byte_count() > 0);
            let (even, odd) =
                (plan.without(contents, |k| k % 2 == 0), plan.without(contents, |k| k % 2 == 1));
            let bare = plan.without(contents, |_| true);
            assert_eq!(even.byte_count() + odd.byte_count(), plan.byte_count() + bare.byte_count());
        }
    }
}

/// Makes the checksum of header and table right, where there is room for it.
pub fn mend(bytes: &mut [u8]) {
    let Some(&[low, middle, high]) = bytes.get(Header::SIZE - 3..Header::SIZE) else { return };
    let length = u32::from_le_bytes([low, middle, high, 0]) as usize;
    let head = bytes.get_mut(..Header::SIZE + length).and_then(|head| head.split_last_chunk_mut::<4>());
    if let Some((body, checksum)) = head.filter(|(body, _)| body.len() >= Header::SIZE) {
        *checksum = crc32c::crc32c(body).to_le_bytes();
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::container::testing;

    #[test]
    fn the_container_holds_whatever_byte_is_changed() {
        for file in [testing::attributed_file(), testing::born_file(), testing::resourced_file()] {
            let file = testing::bytes(&file);
            fuzz_container(&file);
            for at in 0..file.len() {
                for mask in [0x01, 0x02, 0x7F, 0x80, 0xFF] {
                    let mut bytes = file.clone();
                    bytes[at] ^= mask;
                    fuzz_container(&bytes);
                }
                fuzz_container(&file[..at]);
            }
        }
    }

    proptest! {
        #[test]
        fn the_container_holds_on_random_files(
            file in testing::any_file(),
            changes in proptest::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..4),
        ) {
            let mut bytes = testing::bytes(&file);
            for (at, byte) in changes {
                let at = at.index(bytes.len());
                bytes[at] = byte;
            }
            fuzz_container(&bytes);
        }

        #[test]
        fn the_container_holds_on_noise(bytes: Vec<u8>) {
            fuzz_container(&bytes);
        }
    }
}
