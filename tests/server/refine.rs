//! Atoms that lead from one level to another: a client that only gets those has the same mesh in the end.

use super::{Served, coded, folder_with, mesh};
use serde_json::json;
use std::ops::Range;
use std::sync::Arc;
use unweld::codec::grid::Real;
use unweld::container::{Contents, Part, Plan, parse_contents, plan_from_keyframe};
use unweld::decoder::{Decoder, Options, decode};
use unweld::encoder::{Encoder, Keyframes, Options as Encoding};
use unweld::mesh::{IndexedMesh, shapes};

/// The two numbers of a header such as `unweld-atoms`.
fn span(text: &str) -> Range<usize> {
    let (start, end) = text.split_once('-').unwrap();
    start.parse().unwrap()..end.parse().unwrap()
}

fn bytes(contents: &Contents, atoms: Range<usize>) -> Range<usize> {
    let range = contents.bytes(atoms);
    range.start as usize..range.end as usize
}

#[test]
fn each_way_to_ask() {
    let (file, contents) = mesh();
    let folder = folder_with("a.uwm", &file);
    let served = Served::folder(folder.path());
    let base = contents.base_level();
    assert!(base > 8, "levels enough");
    let end_of = |j: u32| contents.steps(j).end;
    let finish = contents.keyframe(contents.segments().nth(1).unwrap()).unwrap().start;
    assert!(
        finish == contents.metadata().end && finish > end_of(0),
        "the metadata stand before the first keyframe"
    );
    let error = contents.levels[4].max_error;
    let by_error = (0..=base).rev().find(|&j| contents.levels[j as usize].max_error <= error).unwrap();
    let rms = contents.levels[4].rms_error;
    let by_rms = (0..=base).rev().find(|&j| contents.levels[j as usize].rms_error <= error).unwrap();
    assert!(by_rms > by_error && end_of(7) < end_of(4), "the measures lead to different levels");
    let triangles = contents.levels[5].triangles;
    let by_triangles =
        (0..end_of(0)).rev().find(|&k| contents.atoms[k].triangles_after <= triangles).unwrap() + 1;
    let length = |atoms: Range<usize>| atoms.map(|k| u64::from(contents.atoms[k].length)).sum::<u64>();
    let two = length(end_of(7)..end_of(7) + 2);
    let cases = [
        ("from=7&to=3".to_owned(), end_of(7)..end_of(3)),
        ("from=7&to=7".to_owned(), end_of(7)..end_of(7)),
        ("from=7".to_owned(), end_of(7)..finish),
        ("from=7&to=0".to_owned(), end_of(7)..finish),
        ("from=0".to_owned(), end_of(0)..finish),
        (format!("from=7&triangles={}", u32::MAX), end_of(7)..end_of(0)),
        (format!("from={base}&to={}", base - 1), end_of(base)..end_of(base - 1)),
        (format!("from=7&max_error={error}"), end_of(7)..end_of(by_error)),
        (format!("from={base}&max_error={error}"), end_of(base)..end_of(by_error)),
        (format!("from={base}&rms_error={error}"), end_of(base)..end_of(by_rms)),
        (format!("from=7&rms_error={rms}"), end_of(7)..end_of(4)),
        ("from=7&rms_error=0".to_owned(), end_of(7)..finish),
        ("from=7&max_error=0".to_owned(), end_of(7)..finish),
        ("from=7&max_error=1e300".to_owned(), end_of(7)..end_of(7)),
        (format!("from=7&triangles={triangles}"), end_of(7)..by_triangles),
        ("from=7&triangles=0".to_owned(), end_of(7)..end_of(7)),
        (format!("from=7&max_bytes={two}"), end_of(7)..end_of(7) + 2),
        (format!("from=7&max_bytes={}", two - 1), end_of(7)..end_of(7) + 1),
        ("from=7&max_bytes=0".to_owned(), end_of(7)..end_of(7)),
        ("from=7&max_bytes=99999999".to_owned(), end_of(7)..finish),
        (format!("from=7&to=3&after={}", end_of(7)), end_of(7) + 1..end_of(3)),
        (format!("from=7&to=3&after={}", end_of(7) - 1), end_of(7)..end_of(3)),
        (format!("to=3&after={}", end_of(7)), end_of(7) + 1..end_of(3)),
        (format!("from=7&after={}", finish - 1), finish..finish),
    ];
    for (query, atoms) in cases {
        let answer = served.get(&format!("/meshes/a/refine?{query}"));
        assert_eq!(answer.status, 200, "{query}");
        assert_eq!(span(answer.header("unweld-atoms")), atoms, "{query}");
        let expected = if atoms.is_empty() { &[][..] } else { &file[bytes(&contents, atoms.clone())] };
        assert_eq!(answer.body, expected, "{query}");
        assert_eq!(span(answer.header("unweld-bytes")).len(), expected.len());
        let level = (0..=base).find(|&j| end_of(j) <= atoms.end).unwrap();
        assert_eq!(answer.header("unweld-level"), level.to_string(), "{query}");
        assert_eq!(answer.header("content-length"), expected.len().to_string());
    }
    let part = served.ask("GET", "/meshes/a/refine?from=7&to=3", &["Range: bytes=10-19"]);
    let start = bytes(&contents, end_of(7)..end_of(3)).start;
    assert_eq!((part.status, &part.body[..]), (206, &file[start + 10..start + 20]));
}

#[test]
fn a_session_in_small_steps_ends_with_the_whole_mesh() {
    let (file, contents) = mesh();
    let folder = folder_with("a.uwm", &file);
    let served = Served::folder(folder.path());
    let mut decoder = Decoder::new(Options::default());
    let first = served.get("/meshes/a/refine?max_bytes=3000");
    assert!(first.body.len() <= 3000 && span(first.header("unweld-bytes")).start == 0);
    decoder.push(&first.body);
    let mut next = span(first.header("unweld-atoms")).end;
    let mut steps = 0;
    loop {
        while decoder.poll().unwrap().is_some() {}
        let answer = served.get(&format!("/meshes/a/refine?after={}&max_bytes=70000", next - 1));
        assert_eq!(answer.header("etag"), first.header("etag"));
        if answer.body.is_empty() {
            break;
        }
        decoder.push(&answer.body);
        next = span(answer.header("unweld-atoms")).end;
        steps += 1;
    }
    assert_eq!((decoder.level(), next), (Some(0), contents.metadata().end));
    assert!(steps >= 1);
    let whole = decode(&file, Options::default()).unwrap();
    assert_eq!(decoder.assembled().unwrap(), whole.assembled().unwrap());
}

#[test]
fn from_a_keyframe() {
    let (file, contents) = mesh();
    let folder = folder_with("a.uwm", &file);
    let served = Served::folder(folder.path());
    let start = contents.segments().nth(1).expect("there is a keyframe");
    let keyframe = served.get(&format!("/meshes/a/keyframe/{start}"));
    assert_eq!(keyframe.body, &file[bytes(&contents, contents.keyframe(start).unwrap())]);
    assert_eq!(keyframe.header("unweld-level"), start.to_string());
    let rest = served.get(&format!("/meshes/a/refine?from={start}&to=0"));
    let whole = plan_from_keyframe(&contents, 0);
    let atoms = span(rest.header("unweld-atoms"));
    let part = |atoms: Range<usize>| Part { bytes: contents.bytes(atoms.clone()), atoms };
    let plan = Plan { start, parts: vec![part(contents.keyframe(start).unwrap()), part(atoms)], ..whole };
    let mut decoder = Decoder::of_plan(contents.clone(), &plan, Options::default());
    decoder.push(&keyframe.body);
    decoder.push(&rest.body);
    while decoder.poll().unwrap().is_some() {}
    assert_eq!(decoder.level(), Some(0));
    let mesh = decoder.assembled().unwrap();
    assert_eq!(mesh.triangles.len(), 5120);

    let base = served.get(&format!("/meshes/a/keyframe/{}", contents.base_level()));
    assert_eq!(base.body, &file[bytes(&contents, contents.steps(contents.base_level()))]);
    let none = (0..contents.base_level()).find(|&j| contents.keyframe(j).is_none()).unwrap();
    served.get(&format!("/meshes/a/keyframe/{none}")).refuses(404, "level");
    served.get("/meshes/a/keyframe/4000000000").refuses(404, "level");
    served.get("/meshes/a/keyframe/-1").refuses(400, "level");
    served.get("/meshes/a/keyframe/99999999999").refuses(400, "level");
}

#[test]
fn queries_that_cannot_be() {
    let (file, contents) = mesh();
    let folder = folder_with("a.uwm", &file);
    let served = Served::folder(folder.path());
    let beyond = contents.base_level() + 1;
    let cases = [
        ("from=x".to_owned(), "from"),
        ("from=-1".to_owned(), "from"),
        ("from=%2B1".to_owned(), "from"),
        ("from=".to_owned(), "from"),
        ("from=99999999999".to_owned(), "from"),
        (format!("from={beyond}"), "from"),
        ("from=3&from=3".to_owned(), "from"),
        (format!("from=3&to={beyond}"), "to"),
        ("from=3&to=4".to_owned(), "to"),
        ("from=3&to=1&triangles=100".to_owned(), "triangles"),
        ("from=3&max_error=0.1&max_bytes=1".to_owned(), "max_bytes"),
        ("from=3&max_error=0.1&rms_error=0.1".to_owned(), "rms_error"),
        ("from=3&max_error=-1".to_owned(), "max_error"),
        ("from=3&rms_error=-1".to_owned(), "rms_error"),
        ("from=3&max_error=nan".to_owned(), "max_error"),
        ("from=3&max_error=inf".to_owned(), "max_error"),
        ("from=3&max_bytes=1.5".to_owned(), "max_bytes"),
        ("from=3&triangles=5000000000".to_owned(), "triangles"),
        ("from=3&after=0".to_owned(), "after"),
        (format!("from=3&after={}", contents.atoms.len()), "after"),
        (format!("after={}", u64::MAX), "after"),
        ("form=3".to_owned(), "form"),
        ("from=3&%00=1".to_owned(), "\0"),
        ("v=%22".to_owned(), "v"),
    ];
    for (query, field) in cases {
        let status = if field == "v" { 410 } else { 400 };
        served.get(&format!("/meshes/a/refine?{query}")).refuses(status, field);
    }
    served.get("/meshes/a.uwm?to=3").refuses(400, "to");
    served.get("/meshes/a/levels?from=3").refuses(400, "from");
    served.get("/meshes/a/other").refuses(404, "");
    served.get("/meshes/b/refine").refuses(404, "");
}

#[test]
fn levels_tell_what_the_table_says() {
    let (file, contents) = coded(3);
    let folder = folder_with("a.uwm", &file);
    let served = Served::folder(folder.path());
    let table = served.get("/meshes/a/levels").json();
    assert_eq!(table["name"], "a.uwm");
    assert_eq!(table["bytes"], file.len());
    assert_eq!(table["head_bytes"], contents.header.table_end());
    let levels = table["levels"].as_array().unwrap();
    assert_eq!(levels.len(), contents.levels.len());
    for (told, j) in levels.iter().zip((0..contents.levels.len() as u32).rev()) {
        let (level, bytes) = (contents.level(j).unwrap(), contents.bytes(contents.steps(j)));
        assert_eq!(told["level"], j);
        assert_eq!(told["triangles"], level.triangles);
        // The reader of JSON may be off by the last digit.
        let error = told["max_error"].as_f64().unwrap();
        assert!((error - level.max_error).abs() <= 1e-15 * error, "{error} {}", level.max_error);
        assert_eq!(told["attribute_errors"], json!([]));
        assert_eq!((&told["offset"], &told["bytes"]), (&json!(bytes.start), &json!(bytes.end - bytes.start)));
        let end = if j > 0 { contents.steps(j).end } else { contents.metadata().end };
        assert_eq!(told["prefix_bytes"], contents.bytes(0..end).end);
        let keyframe = contents.keyframe(j).map(|atoms| contents.bytes(atoms));
        assert_eq!(told["keyframe"]["offset"].as_u64(), keyframe.map(|bytes| bytes.start));
    }
    let list = served.get("/meshes").json();
    assert_eq!(list["meshes"], json!([table]));
    assert_eq!(list["next"], json!(null));
}

/// Vertices and triangles in an order of their own, one vertex that no triangle uses, one triangle twice.
fn in_an_order() -> IndexedMesh {
    let mut mesh = shapes::bumpy_sphere(4, 2);
    mesh.triangles.reverse();
    mesh.triangles.iter_mut().step_by(3).for_each(|t| t.rotate_left(1));
    mesh.positions.push([0.1, -0.0, 7.5]);
    mesh.triangles.push(mesh.triangles[100]);
    mesh
}

/// Positions, to the last bit, and triangles, as they stand.
fn lists(mesh: &IndexedMesh) -> (Vec<[u64; 3]>, Vec<[u32; 3]>) {
    (mesh.positions.iter().map(|p| p.map(f64::to_bits)).collect(), mesh.triangles.clone())
}

/// A file with everything that belongs to level 0, and what it was made of.
fn exact_and_ordered() -> (IndexedMesh, Vec<u8>, Arc<Contents>) {
    let mesh = in_an_order();
    let options = Encoding {
        exact: Some(Real::Binary64),
        keep_order: true,
        keyframes: Keyframes::Every(4),
        ..Encoding::default()
    };
    let file = Encoder::new(options).encode_to_vec(&mesh).unwrap();
    let contents = parse_contents(&file).unwrap().unwrap();
    for part in [contents.residue(), contents.correction(), contents.order(), contents.metadata()] {
        assert!(!part.is_empty());
    }
    (mesh, file, contents)
}

#[test]
fn an_exact_and_ordered_file_comes_over_every_road() {
    let (mesh, file, contents) = exact_and_ordered();
    let folder = folder_with("a.uwm", &file);
    let served = Served::folder(folder.path());
    let refine = |query: &str| {
        let answer = served.get(&format!("/meshes/a/refine?{query}"));
        assert_eq!(answer.status, 200, "{query}");
        answer
    };
    let joined = |queries: &[&str]| queries.iter().flat_map(|query| refine(query).body).collect::<Vec<u8>>();
    let back = |bytes: &[u8]| {
        let mut decoder = Decoder::new(Options::default());
        decoder.push(bytes);
        while decoder.poll().unwrap().is_some() {}
        assert!(decoder.metadata().is_some());
        lists(&decoder.assembled().unwrap())
    };
    let (whole, base) = (lists(&mesh), contents.base_level());
    let error = contents.levels[0].max_error;
    for queries in [
        &[""][..],
        &["to=0"],
        &["max_error=0"],
        &["rms_error=0"],
        &[&format!("max_error={error:e}")],
        &["max_bytes=99999999"],
        &[&format!("to={base}"), &format!("from={base}")],
        &["to=5", "from=5&to=2", "from=2&max_error=0"],
        &["triangles=4000000000", "from=0"],
        &["triangles=4000000000", "from=0&to=0"],
    ] {
        assert!(back(&joined(queries)) == whole, "{queries:?}");
    }
    // Broken off behind any atom of what level 0 has beyond its mesh, and taken up again.
    let all = refine("").body;
    assert!(all == file[..all.len()] && !all.is_empty());
    for after in contents.steps(0).end - 1..contents.metadata().end {
        let end = contents.atoms[after].end() as usize;
        let rest = refine(&format!("after={after}"));
        assert!([&all[..end], &rest.body].concat() == all, "after={after}");
        assert_eq!(span(rest.header("unweld-atoms")).end, contents.metadata().end);
    }
    // By no more than 900 bytes at a time, if no atom is larger.
    let least = contents.atoms.iter().map(|atom| u64::from(atom.length)).max().unwrap().max(900);
    let first = refine(&format!("to={base}"));
    let (mut bytes, mut next) = (first.body.clone(), span(first.header("unweld-atoms")).end);
    loop {
        let answer = refine(&format!("after={}&max_bytes={least}", next - 1));
        if answer.body.is_empty() {
            break;
        }
        bytes.extend(&answer.body);
        next = span(answer.header("unweld-atoms")).end;
    }
    assert!(back(&bytes) == whole);
    // From each keyframe.
    for start in contents.segments().skip(1) {
        let keyframe = served.get(&format!("/meshes/a/keyframe/{start}"));
        let rest = refine(&format!("from={start}&max_error=0"));
        let plan = plan_from_keyframe(&contents, 0);
        let part = |atoms: Range<usize>| Part { bytes: contents.bytes(atoms.clone()), atoms };
        let parts = vec![part(contents.keyframe(start).unwrap()), part(span(rest.header("unweld-atoms")))];
        let mut decoder =
            Decoder::of_plan(contents.clone(), &Plan { start, parts, ..plan }, Options::default());
        decoder.push(&keyframe.body);
        decoder.push(&rest.body);
        while decoder.poll().unwrap().is_some() {}
        decoder.finish().unwrap();
        assert!(lists(&decoder.assembled().unwrap()) == whole, "keyframe of level {start}");
    }
    let told = served.get("/meshes/a/levels").json();
    let parts =
        ["residue", "correction", "order", "metadata"].map(|part| told[format!("{part}_bytes")].as_u64());
    let bare = contents.bytes(contents.steps(0)).end;
    assert_eq!(bare + parts.into_iter().flatten().sum::<u64>(), all.len() as u64);
    assert_eq!(told["levels"].as_array().unwrap().last().unwrap()["prefix_bytes"], all.len());
}
