//! `unweld verify`.

use super::Folder;
use unweld::codec::keyframe;
use unweld::container::{Atom, AtomKind, FileBuilder};
use unweld::decoder::{Decoder, Options, Until};
use unweld::mesh::shapes;

#[test]
fn a_sound_file_and_its_original() {
    let folder = Folder::with_sphere();
    let run = folder.run("verify sphere.uwm sphere.ply").succeeded();
    for words in [
        "602 operations",
        "1 component, 0 handles, 0 boundary loops",
        "the same 1,280 triangles, to the lattice of 14 bits",
    ] {
        assert!(run.text().contains(words), "{words}: {}", run.text());
    }
    assert!(folder.run("verify sphere.uwm -q").succeeded().out.is_empty());
    folder.run("encode sphere.ply -o plain.uwm").succeeded();
    assert!(folder.run("verify plain.uwm").succeeded().text().contains("none but the base"));
}

#[test]
fn another_mesh_is_not_the_original() {
    let folder = Folder::with_sphere();
    let mut other = shapes::bumpy_sphere(3, 1);
    let corners = other.triangles[100].map(|v| other.positions[v as usize]);
    other.triangles[100].swap(0, 1);
    other.triangles.push(other.triangles[0]);
    folder.mesh("other.ply", &other);
    let run = folder.run("verify sphere.uwm other.ply");
    assert_eq!(run.code, 1);
    let start = "unweld: sphere.uwm: not other.ply: 2 triangles missing, 1 extra; missing for example (";
    assert!(run.err.starts_with(start), "{}", run.err);
    // Both missing triangles touch the two that were changed, to the lattice.
    let example = run.err.split("for example (").nth(1).unwrap();
    let x: f64 = example.split(',').next().unwrap().parse().unwrap();
    let first = other.triangles[0].map(|v| other.positions[v as usize]);
    assert!(corners.iter().chain(&first).any(|p| (p[0] - x).abs() < 1e-3), "{example}");
    assert!(run.text().contains("checksums"), "what did hold is told: {}", run.text());
}

#[test]
fn the_residue_is_part_of_it() {
    let folder = Folder::new();
    let mut mesh = shapes::torus_with_hole(12, 9);
    mesh.triangles.push(mesh.triangles[5]);
    mesh.triangles.push([3, 3, 4]);
    mesh.triangles[7].swap(1, 2);
    folder.mesh("m.ply", &mesh);
    folder.run("encode m.ply -o m.uwm --base-vertices 30 --keyframes all").succeeded();
    let info = folder.info("m.uwm");
    assert_eq!(info["residue"]["reversed_triangles"], 1);
    folder.run("verify m.uwm m.ply").succeeded();
    mesh.triangles[7].swap(1, 2);
    folder.mesh("turned.ply", &mesh);
    assert_eq!(folder.run("verify m.uwm turned.ply").code, 1);
}

/// The file with another keyframe at `level`: one vertex is a step of the lattice away. All checksums hold.
fn forged(file: &[u8], level: u32) -> Vec<u8> {
    let mut decoder =
        Decoder::new(Options { until: Until { level, ..Until::default() }, ..Options::default() });
    decoder.push(file);
    while decoder.poll().unwrap().is_some() {}
    let mut mesh = decoder.mesh().clone();
    let x = &mut mesh.positions[7][0];
    *x += if *x > 0 { -1 } else { 1 };
    let keyframe = keyframe::encode(&mesh, 0, |_, _| 0).payload;

    let contents = decoder.contents().unwrap();
    let header = &contents.header;
    let mut forged = FileBuilder::new(header.lattice, header.maximum, contents.levels.clone());
    forged.coding = header.coding;
    let bytes = |atom: &Atom| file[atom.offset as usize..atom.end() as usize].to_vec();
    for atom in &contents.atoms {
        match atom.kind {
            AtomKind::Keyframe if atom.level == level => {}
            AtomKind::Precision | AtomKind::Refinement => {
                forged.atom(atom.kind, atom.level, atom.items, atom.triangles, bytes(atom));
            }
            _ => forged.payload(atom.kind, atom.level, &bytes(atom)),
        }
    }
    forged.payload(AtomKind::Keyframe, level, &keyframe);
    let mut out = Vec::new();
    forged.write(&mut out).unwrap();
    out
}

#[test]
fn a_keyframe_of_another_mesh_is_found() {
    let folder = Folder::with_sphere();
    folder.write("forged.uwm", forged(&folder.bytes("sphere.uwm"), 3));
    folder.run("decode forged.uwm -o out.ply").succeeded();
    let run = folder.run("verify forged.uwm sphere.ply");
    let line = "forged.uwm: level 3 from the keyframe of level 3 is not what the replay gives";
    assert_eq!((run.code, run.err), (1, format!("unweld: {line}\n")));
}
