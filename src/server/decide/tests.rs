use super::*;
use crate::container::{AtomKind, FileBuilder, testing};
use axum::http::HeaderValue;
use proptest::prelude::*;
use std::time::{Duration, SystemTime};

fn version() -> Version {
    Version {
        tag: "t".to_owned(),
        bytes: 100,
        modified: SystemTime::UNIX_EPOCH + Duration::from_secs(1_000_000),
    }
}

fn field(outcome: Result<impl std::fmt::Debug, Refusal>) -> String {
    outcome.unwrap_err().field.unwrap_or_default()
}

#[test]
fn targets() {
    let told = |path| target(path).map(|(name, target)| (name, format!("{target:?}")));
    let found = |name: &str, target: &str| Ok((name.to_owned(), target.to_owned()));
    assert_eq!(told("a.uwm"), found("a.uwm", "File"));
    assert_eq!(told("x/levels.uwm"), found("x/levels.uwm", "File"));
    assert_eq!(told("x/levels/levels"), found("x/levels.uwm", "Levels"));
    assert_eq!(told("a%20b/%C3%A9/refine"), found("a b/é.uwm", "Refine"));
    assert_eq!(told("a/keyframe/3"), found("a.uwm", "Keyframe(3)"));
    assert_eq!(told("a.uwm/levels"), found("a.uwm.uwm", "Levels"));
    for path in [
        "",
        "levels",
        "/levels",
        "keyframe/3",
        "../levels",
        "a/%2e%2e/b.uwm",
        "a%2fb.uwm",
        "a//b.uwm",
        "%ff.uwm",
        "a%00/x",
    ] {
        assert_eq!(field(target(path)), "name", "{path}");
    }
    assert_eq!(field(target("a/keyframe/x")), "level");
    assert_eq!(target("a/other").unwrap_err().status, StatusCode::NOT_FOUND);
}

#[test]
fn a_small_file_by_hand() {
    // Atoms: 0 base of level 2, 1 to 3 level 1, 4 to 6 level 0, 7 residue, 8 metadata, 9 keyframe of level 1, 10 and 11 optional;
    // the metadata are the last that a client is led to.
    let contents = testing::contents(&testing::small_file());
    let ask = |text: &str| refine(&contents, &Query::parse(Some(text), Target::Refine.queries()).unwrap());
    let atoms = |text: &str| ask(text).unwrap().atoms;
    let first = contents.steps(2);
    for all in ["from=2", "from=2&to=0", "from=2&max_error=0.1", "from=2&max_bytes=9999"] {
        assert_eq!(atoms(all), 1..9, "{all}");
    }
    assert_eq!(
        [atoms("from=2&triangles=99"), atoms("from=0"), atoms("after=7"), atoms("after=8")],
        [1..7, 7..9, 8..9, 9..9]
    );
    assert_eq!(field(ask("after=9")), "after");
    assert_eq!(atoms("from=2&to=1"), contents.steps(1));
    // Largest errors 0.5, 0.25 and 0.09375; the root mean square is 0.125 everywhere.
    assert_eq!(atoms("from=2&max_error=0.25"), contents.steps(1));
    assert_eq!(atoms("from=2&rms_error=0.125"), first.end..first.end);
    assert_eq!(atoms("from=2&rms_error=0.25"), first.end..first.end);
    assert_eq!(atoms("from=2&rms_error=0.12"), atoms("from=2"));
    assert_eq!(atoms("from=2&faces=8"), atoms("from=2&triangles=8"));
    assert_eq!(atoms("from=2&triangles=8"), contents.steps(1).start..contents.steps(1).start + 2);
    assert_eq!(atoms("from=1&max_bytes=1"), contents.steps(0).start..contents.steps(0).start + 1);
    assert_eq!(ask("from=1&max_bytes=1").unwrap().level, 1);
    assert_eq!(ask("").unwrap().bytes.start, 0);
    assert_eq!(ask("to=2").unwrap().bytes, 0..contents.bytes(first).end);
    assert_eq!(keyframe(&contents, 1).unwrap().atoms, contents.keyframe(1).unwrap());
    let missing = keyframe(&contents, 0).unwrap_err();
    assert_eq!(missing.detail, "level 0 has no keyframe; there is one of level 2, 1");
    // Without a keyframe the end of the file is the end.
    let (levels, lattice) = (contents.levels[1..].to_vec(), contents.header.lattice);
    let mut file = FileBuilder::new(lattice, [1; 3], levels);
    file.levels[0].precision = 0;
    file.levels[1].precision = 0;
    file.payload(AtomKind::Base, 1, b"base");
    file.atom(AtomKind::Refinement, 0, 3, 6, b"all".to_vec());
    file.payload(AtomKind::Metadata, 0, b"who");
    let all = refine(&testing::contents(&file), &Query::default()).unwrap();
    assert_eq!((all.atoms, all.level), (0..3, 0));
}

/// Atoms: 0 base of level 2, 1 2 its resources, 3 to 8 level 1, 9 10 its resource, 11 to 13 level 0, 14 its resource, 15 to 17 what else it
/// has, 18 keyframe of level 1.
#[test]
fn resources_belong_to_their_levels() {
    let contents = testing::contents(&testing::resourced_file());
    let ask = |text: &str| refine(&contents, &Query::parse(Some(text), Target::Refine.queries()).unwrap());
    let told = |text: &str| ask(text).map(|slice| (slice.atoms, slice.level)).unwrap();
    assert_eq!(told("to=2"), (0..3, 2));
    assert_eq!(told("from=2&to=1"), (3..11, 1));
    assert_eq!(told("from=1"), (11..18, 0));
    assert_eq!(told("from=0"), (15..18, 0));
    // Whoever has only a part of them goes on behind it; their bytes count.
    assert_eq!([told("after=0&to=2"), told("after=9&to=1")], [(1..3, 2), (10..11, 1)]);
    let bytes =
        |atoms: std::ops::Range<usize>| contents.bytes(atoms.clone()).end - contents.bytes(atoms).start;
    let most = |atoms| format!("after=8&max_bytes={}", bytes(atoms));
    assert_eq!([told(&most(9..10)), told(&most(9..11))], [(9..10, 1), (9..11, 1)]);
    assert_eq!(told(&format!("after=8&max_bytes={}", bytes(9..11) - 1)), (9..10, 1));
    assert_eq!(told(&format!("from=2&triangles={}", contents.levels[1].triangles)), (3..11, 1));
    assert_eq!([2, 1].map(|j| keyframe(&contents, j).unwrap().atoms), [0..3, 18..19]);
}

#[test]
fn the_example_of_the_specification() {
    let bytes = [&testing::GOLDEN_HEADER[..], &testing::GOLDEN_REST].concat();
    let contents = crate::container::parse_contents(&bytes).unwrap().unwrap();
    let rows = [
        ("to=1", 0..1, 0..66, 1),
        ("from=1", 1..2, 66..68, 0),
        ("from=1&max_bytes=1", 1..1, 66..66, 1),
        ("after=1", 2..2, 68..68, 0),
    ];
    for (text, atoms, bytes, level) in rows {
        let query = Query::parse(Some(text), Target::Refine.queries()).unwrap();
        assert_eq!(refine(&contents, &query), Ok(Slice { atoms, bytes, level }), "{text}");
    }
}

proptest! {
    /// Whatever is asked: whole atoms, right behind those the client has, no more bytes than wanted.
    #[test]
    fn slices_keep_their_promise(file in testing::any_file(), from in 0u32..6, to in 0u32..6, bytes in 0u64..300, triangles in 0u32..60) {
        let contents = testing::contents(&file);
        let error = Want::Error(Measure::Max, triangles.into());
        for want in [Want::Level(to), Want::Bytes(bytes), Want::Triangles(triangles), error] {
            let query = Query { from: Some(from), want, ..Query::default() };
            let Ok(slice) = refine(&contents, &query) else {
                prop_assert!(from > contents.base_level() || matches!(want, Want::Level(to) if to > from));
                continue;
            };
            let held = contents.resource_atoms(from).end;
            prop_assert_eq!(slice.atoms.start, held);
            let sum: u64 = contents.atoms[slice.atoms.clone()].iter().map(|atom| u64::from(atom.length)).sum();
            prop_assert_eq!(slice.bytes.end - slice.bytes.start, sum);
            prop_assert!(slice.level <= from);
            match want {
                Want::Level(to) => prop_assert_eq!(slice.level, to),
                Want::Bytes(most) => prop_assert!(sum <= most),
                Want::Triangles(most) => {
                    let more = &contents.atoms[slice.atoms.clone()];
                    prop_assert!(more.iter().all(|atom| atom.triangles_after <= most));
                }
                // The client may hold a finer level than the first that is good enough.
                Want::Error(_, most) => {
                    let held = &contents.levels[slice.level as usize..];
                    prop_assert!(slice.level == 0 || held.iter().any(|level| level.max_error <= most));
                }
                Want::All => unreachable!(),
            }
            // Asked again from where it ended, the rest follows without a gap.
            if let Some(after) = slice.atoms.end.checked_sub(1) {
                let rest = refine(&contents, &Query { after: Some(after), ..Query::default() });
                prop_assert_eq!(rest.unwrap().atoms.start, slice.atoms.end);
            }
        }
    }

    /// Any text at all: an answer, and ranges inside.
    #[test]
    fn ranges_stay_inside(text in "bytes=([0-9]{0,3}-[0-9]{0,3},? ?){0,20}", length in 0u64..200) {
        let mut headers = HeaderMap::new();
        headers.insert(header::RANGE, HeaderValue::try_from(text).unwrap());
        if let Wanted::Ranges(ranges) = wanted(&headers, &version(), length) {
            prop_assert!(!ranges.is_empty() && ranges.len() <= MAX_RANGES);
            prop_assert!(ranges.iter().all(|range| range.start < range.end && range.end <= length));
            prop_assert!(ranges.iter().map(|range| range.end - range.start).sum::<u64>() <= length);
        }
    }

    #[test]
    fn any_path_and_query(path in ".{0,40}", query in ".{0,40}") {
        if let Ok((name, _)) = target(&path) {
            prop_assert_eq!(check_name(&name), Ok(()));
        }
        let _ = Query::parse(Some(&query), Target::Refine.queries());
    }
}
