//! Sets of meshes: the file as it is, and where its members are.

use super::{Served, folder_with};
use std::sync::Arc;
use unweld::decoder::{Decoder, Options};
use unweld::encoder::{self, SetInput, SetOrder, Source, encode_set};
use unweld::mesh::{IndexedMesh, shapes};

/// A mesh and 100 of its triangles, these first.
pub fn set(fine: &IndexedMesh) -> Vec<u8> {
    let coarse = IndexedMesh::new(fine.positions.clone(), fine.triangles[..100].to_vec());
    let input = |mesh: &IndexedMesh| SetInput { mesh: mesh.clone(), source: Source::default(), exact: None };
    let (inputs, options) = ([input(fine), input(&coarse)], encoder::Options::default());
    let mut file = Vec::new();
    encode_set(&inputs, SetOrder::Stream, &options, &mut |_, _| true, &mut file).unwrap();
    file
}

#[test]
fn a_client_comes_to_a_member_by_the_table() {
    let fine = shapes::bumpy_sphere(2, 1);
    let file = set(&fine);
    let folder = folder_with("lods.uwm", &file);
    let served = Served::folder(folder.path());
    let told = served.get("/meshes/lods/levels").json();
    assert_eq!((&told["finest_first"], &told["bytes"]), (&false.into(), &file.len().into()));
    let members = told["members"].as_array().unwrap();
    let triangles = |k: usize| members[k]["triangles"].as_u64().unwrap() as usize;
    assert_eq!((members.len(), triangles(0), triangles(1)), (2, 100, fine.triangles.len()));
    // The fine one is told by the vertices of the coarse one, so that both are needed: all of the file.
    let number = |key: &str| members[1][key].as_u64().unwrap();
    assert_eq!(members[1]["beside_another"], true);
    assert_eq!(
        (number("chain_offset"), number("offset") + number("bytes")),
        (told["head_bytes"].as_u64().unwrap(), file.len() as u64)
    );
    assert_eq!(served.get("/meshes/lods.uwm").body, file);
    let list = served.get("/meshes").json();
    assert_eq!(list["meshes"][0], told);
    assert_eq!(told["kind"], "set");
    for route in ["refine", "refine?to=1", "keyframe/0", "keyframe/1"] {
        let answer = served.get(&format!("/meshes/lods/{route}"));
        answer.refuses(404, "");
        assert_eq!(
            answer.json()["detail"],
            "this is a set of meshes: it has no refinement and no keyframes; its members are ranges of NAME.uwm, which NAME/levels tells"
        );
    }

    // As a client would.
    let set = unweld::container::parse_set(&file).unwrap().unwrap();
    let mut other: Option<Arc<[[i32; 3]]>> = None;
    for number in set.chain(0) {
        let member = &set.members[number as usize];
        let mut decoder = Decoder::new(Options::default());
        if let Some(other) = other.take().filter(|_| member.leans) {
            decoder.beside(other);
        }
        decoder.push(&member.head);
        let range = format!("Range: bytes={}-{}", member.bytes.start, member.bytes.end - 1);
        decoder.push(&served.ask("GET", "/meshes/lods.uwm", &[&range]).body);
        while decoder.poll().unwrap().is_some() {}
        decoder.finish().unwrap();
        other = Some(decoder.mesh().positions.as_slice().into());
    }
    assert_eq!(other.unwrap().len(), fine.positions.len());
}
