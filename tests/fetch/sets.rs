//! Sets of meshes: the file as it is, its beginning, or the bytes that one member takes.

use super::command::Folder;
use super::script::Script;
use serde_json::Value;
use unweld::codec::grid::Real;
use unweld::container::{SetContents, parse_set};
use unweld::encoder::{Options, SetInput, SetOrder, Source, encode_set};
use unweld::mesh::{IndexedMesh, shapes};

/// A fine mesh, most of its triangles, and something that shares no vertex with them; the coarsest first, longer than the first request.
fn set() -> (Vec<u8>, SetContents) {
    let fine = shapes::bumpy_sphere(4, 1);
    let part = |of: &IndexedMesh, count: usize| {
        IndexedMesh::new(of.positions.clone(), of.triangles[..count].to_vec())
    };
    let other = part(&shapes::bumpy_sphere(4, 7), 3900);
    let inputs = [part(&fine, 4000), fine, other].map(|mesh| SetInput {
        mesh,
        source: Source::default(),
        exact: Some(Real::Binary64),
    });
    let mut file = Vec::new();
    encode_set(&inputs, SetOrder::Stream, &Options::default(), &mut |_, _| true, &mut file).unwrap();
    let set = parse_set(&file).unwrap().unwrap();
    assert_eq!([0, 1, 2].map(|j: usize| set.members[j].leans), [true, false, false]);
    assert!(set.members[2].bytes.end > 16384);
    (file, set)
}

#[test]
fn a_member_is_fetched_by_the_bytes_that_it_takes() {
    let (file, set) = set();
    let (served, chain) = (file.clone(), set.members[1].bytes.start..set.members[0].bytes.end);
    // A byte of the finest is wrong, the first time that it comes.
    let last = set.members[0].bytes.end as usize - 1;
    let script = Script::answers(move |number, asked| {
        let mut file = served.clone();
        if number < 2 {
            file[last] ^= 1;
        }
        asked.answer(&file, "\"one\"")
    });
    let folder = Folder::new();
    std::fs::write(folder.path("set.uwm"), &file).unwrap();
    let fetch = |arguments: &str| folder.run(&format!("fetch {} {arguments}", script.url()));
    let run = fetch("-o a.ply --member 0");
    assert!(run.code == 1 && run.err.contains(": member 0: byte "), "{}", run.err);
    let told: Value = serde_json::from_slice(&fetch("-o a.ply --member 0 --json").succeeded().out).unwrap();
    assert_eq!(told["bytes"], set.head_end() + chain.end - chain.start);
    assert_eq!((&told["level"], &told["members"]), (&0.into(), &[1, 0][..].into()));
    // What was sound stayed: head and member 1, but for the last atom of what was sound.
    assert!(told["resumed_bytes"].as_u64().unwrap() > set.head_end());
    let asked = script.asked();
    assert_eq!(asked[0].range(), (0, 16383));
    assert_eq!(asked[1].range().0, chain.start as usize, "member 2 is passed over");
    assert!(asked.len() == 3 && asked[2].range().0 > chain.start as usize, "{asked:?}");
    folder.run("decode set.uwm -o b.ply --level 0").succeeded();
    assert_eq!(folder.bytes("a.ply"), folder.bytes("b.ply"));

    let run = fetch("-o c.ply --triangles 3950");
    let text = run.succeeded().text();
    assert!(text.contains("  member 2: ") && !text.contains("  member 1: "), "{text}");
    folder.run("decode set.uwm -o d.ply --level 2").succeeded();
    assert_eq!(folder.bytes("c.ply"), folder.bytes("d.ply"));

    fetch("-o whole.uwm -q").succeeded();
    assert_eq!(folder.bytes("whole.uwm"), file);
    fetch("-o part.uwm --level 1 -q").succeeded();
    assert_eq!(folder.bytes("part.uwm"), file[..set.members[1].bytes.end as usize]);
    let most = set.members[2].bytes.end;
    fetch(&format!("-o most.uwm --max-bytes {most} -q")).succeeded();
    assert_eq!(folder.bytes("most.uwm"), file[..most as usize]);

    let refused = |arguments: &str, code: i32, what: &str| {
        let run = fetch(arguments);
        assert!(run.code == code && run.err.contains(what), "{}", run.err);
    };
    refused("-o e.ply --level 3", 1, "there is no member 3: they are 0 (finest) to 2");
    refused("-o e.ply --level 1 --via keyframe", 2, "a set of meshes has no keyframes");
    let (less, least) = (most - 1, most);
    refused(
        &format!("-o e.uwm --max-bytes {less}"),
        1,
        &format!("member 2, the first, needs {least} bytes, --max-bytes allows {less}"),
    );
}
