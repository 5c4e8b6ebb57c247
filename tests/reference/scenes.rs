//! Resources with faults behind sound checksums, and scenes deflated in every way.

use proptest::prelude::*;
use unweld::container::{PackedScene, packed_scene};

use super::agree::agree;
use super::container::{Atom, RESOURCE};
use super::draft::{Draft, atom};
use super::golden::load;
use super::inflate::inflate;
use super::resources::Resource;

/// A file of one level with these resources, each in these atoms.
fn with(resources: &[(u8, u64, &[&[u8]])]) -> Draft {
    let mut draft = Draft::of(&load("tetrahedron.uwm"));
    draft.settings[2] = 128;
    draft.resources = resources.iter().map(|&(kind, place, _)| Resource { kind, place }).collect();
    let own = resources.iter().enumerate().flat_map(|(k, &(_, place, atoms))| {
        atoms.iter().map(move |bytes| atom(RESOURCE, place, k as u64, 0, bytes))
    });
    // Behind the base, which is its first atom.
    draft.atoms.splice(1..1, own.collect::<Vec<Atom>>());
    draft
}

/// A resource: its kind, its place, its atoms.
type Cut<'a> = (u8, u64, &'a [&'a [u8]]);

#[test]
fn however_they_are_cut() {
    let files: [&[Cut<'_>]; 4] = [
        &[(1, 0, &[b"whole"])],
        &[(1, 0, &[b"in ", b"three", b" atoms"]), (1, 0, &[b"x"])],
        &[(0, 0, &[b"\x00\x02{}"]), (1, 0, &[b"a", b"b"])],
        &[(0, 0, &[b"\x00", b"\x02", b"{", b"}"])],
    ];
    let expected: [&[&[u8]]; 4] = [&[b"whole"], &[b"in three atoms", b"x"], &[b"{}", b"ab"], &[b"{}"]];
    for (file, expected) in files.into_iter().zip(expected) {
        let seen = agree(&with(file).bytes()).expect("a sound file");
        assert!(seen.resources.iter().flatten().map(Vec::as_slice).eq(expected.iter().copied()));
    }
}

#[test]
fn what_cannot_be() {
    let sound: &[Cut<'_>] = &[(0, 0, &[b"\x00\x02{}"]), (1, 0, &[b"abc"])];
    assert!(agree(&with(sound).bytes()).is_some());
    let files: [&[Cut<'_>]; 12] = [
        &[],
        &[(2, 0, &[b"abc"])],
        &[(127, 0, &[b"abc"])],
        &[(1, 1, &[b"abc"])],
        &[(1, u64::MAX, &[b"abc"])],
        &[(1, 0, &[b"abc"]), (0, 0, &[b"\x00\x02{}"])],
        &[(0, 0, &[b"\x00\x02{}"]), (0, 0, &[b"\x00\x02{}"])],
        &[(0, 0, &[b"\x00\x03{}"])],
        &[(0, 0, &[b"\x02\x02{}"])],
        &[(0, 0, &[b"\x01\x02{}"])],
        &[(1, 0, &[])],
        &[(1, 0, &[b""])],
    ];
    for (k, file) in files.into_iter().enumerate() {
        assert!(agree(&with(file).bytes()).is_none(), "file {k} is read");
    }
    // Places of several levels: each no nearer to the base than the one before.
    let golden = Draft::of(&load("scene.uwm"));
    let places: Vec<u64> = golden.resources.iter().map(|resource| resource.place).collect();
    let placed = |places: &[u64]| {
        let mut draft = golden.clone();
        draft.resources.iter_mut().zip(places).for_each(|(resource, &place)| resource.place = place);
        agree(&draft.bytes()).is_some()
    };
    let [base, _, middle, _] = places[..] else { panic!("four resources") };
    assert!(placed(&places));
    assert!(
        !placed(&[base, middle, base, 0])
            && !placed(&[0, base, middle, 0])
            && !placed(&[base + 1, base, middle, 0])
    );
    assert!(!placed(&[base, base, 0, middle]));
}

#[test]
fn single_bits_of_a_small_file() {
    let draft = with(&[(0, 0, &[b"\x01\x14\x4B", b"\xC4\x02\x00"]), (1, 0, &[b"x", b"y"])]);
    let (mut read, mut all) = (0, 0);
    for bit in 0..8 {
        for bytes in draft.changed(1 << bit) {
            read += usize::from(agree(&bytes).is_some());
            all += 1;
        }
    }
    assert!(read > all / 20 && read < all, "{read} of {all} are read");
}

/// What the crate makes of a scene.
fn by_crate(packed: &[u8]) -> Option<Vec<u8>> {
    PackedScene::read(packed, 0).ok()?.json().ok()
}

/// Text that repeats itself, more or less.
fn text() -> impl Strategy<Value = Vec<u8>> {
    let words = proptest::collection::vec((0usize..6, any::<u8>(), 1usize..40), 1..60);
    words.prop_map(|words| {
        let of = |(kind, byte, count): (usize, u8, usize)| match kind {
            0 => vec![byte; count],
            1 => (0..count as u8).map(|k| k.wrapping_mul(byte)).collect(),
            _ => b"\"translation\":[1.25,0,-3],\"mesh\":".repeat(1 + count / 20),
        };
        words.into_iter().flat_map(of).collect()
    })
}

proptest! {
    /// Both inflaters read what is deflated, and nothing that has been changed in one of them alone.
    #[test]
    fn deflated_data(text in text(), at: prop::sample::Index, mask in 1u8..) {
        let packed = packed_scene(&text).unwrap();
        prop_assert_eq!(by_crate(&packed), Some(text.clone()));
        if packed[0] == 0 {
            return Ok(());
        }
        let mut data = packed[if text.len() < 128 { 2 } else { 3 }..].to_vec();
        prop_assert_eq!(inflate(&data), Ok(text.clone()));
        let at = at.index(data.len());
        data[at] ^= mask;
        // So long as ours is: whether it is the length that was told is seen apart.
        match inflate(&data) {
            Ok(other) if !other.is_empty() && other.len() < 1 << 20 => {
                let mut bytes = vec![1];
                let mut length = other.len();
                while length >= 128 {
                    bytes.push(length as u8 | 128);
                    length >>= 7;
                }
                bytes.push(length as u8);
                bytes.extend(&data);
                prop_assert_eq!(by_crate(&bytes), Some(other));
            }
            Ok(_) => {}
            Err(why) => {
                let head = &packed[..packed.len() - data.len()];
                prop_assert_eq!(by_crate(&[head, &data[..]].concat()), None, "only ours refuses: {}", why);
            }
        }
    }
}
