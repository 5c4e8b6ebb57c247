//! `unweld lod`, `pack`, `unpack`, and the commands that take sets.

use super::{Folder, triangles};
use unweld::mesh::{IndexedMesh, shapes};

/// A chain by hand: the whole, every vertex of which is a point of the lattice, and two of its parts; one of them has a triangle twice.
fn chain(folder: &Folder) -> [IndexedMesh; 3] {
    let mut fine = shapes::torus(12, 10);
    for x in fine.positions.iter_mut().flatten() {
        *x = (*x * 16.0).round() / 16.0;
    }
    // The box is 255 steps long.
    fine.positions[0] = [-5.0, -5.0, -5.0];
    fine.positions[1] = [255.0 / 16.0 - 5.0, 0.0, 0.0];
    let part = |count: usize| IndexedMesh::new(fine.positions.clone(), fine.triangles[..count].to_vec());
    let mut coarse = part(70);
    coarse.triangles.push(coarse.triangles[3]);
    let meshes = [fine.clone(), part(150), coarse];
    for (k, mesh) in meshes.iter().enumerate() {
        folder.mesh(&format!("{k}.ply"), mesh);
    }
    meshes
}

#[test]
fn meshes_come_back_from_a_set() {
    let folder = Folder::new();
    let meshes = chain(&folder);
    for (order, finest_first) in [("--small", true), ("--stream", false)] {
        // Whatever the order of the arguments.
        let json =
            folder.run(&format!("pack 2.ply 0.ply 1.ply -o set.uwm --position-bits 8 {order} --json")).json();
        assert_eq!(
            (&json["finest_first"], json["members"].as_array().unwrap().len()),
            (&finest_first.into(), 3)
        );
        assert_eq!(json["inputs"][0]["input"], "0.ply");
        assert_eq!(json["file_bytes"], folder.bytes("set.uwm").len());
        assert!(json["members"].as_array().unwrap().iter().any(|member| member["beside_another"] == true));
        folder.run("unpack set.uwm -o out -q").succeeded();
        for (k, mesh) in meshes.iter().enumerate() {
            let back = folder.read(&format!("out/level-{k}.ply"));
            assert!(triangles(&back) == triangles(mesh), "{order}: member {k}");
            folder.run(&format!("decode set.uwm -o one.ply --level {k} -q")).succeeded();
            assert!(triangles(&folder.read("one.ply")) == triangles(mesh), "{order}: member {k} alone");
            folder.run(&format!("verify set.uwm {k}.ply --level {k} -q")).succeeded();
        }
        folder.run("decode set.uwm -o one.ply --triangles 160 -q").succeeded();
        assert_eq!(folder.read("one.ply").triangles.len(), 150);
        let measured = folder.run("measure 1.ply set.uwm --level 1 --json --samples 1000").json();
        assert!(measured["symmetric"]["max"].as_f64().unwrap() < 1e-12);
        folder.run("view set.uwm -o set.png --level 0,2 --size 64x32 -q").succeeded();
        let other = folder.run("verify set.uwm 1.ply -q");
        assert!(
            other.code == 1 && other.err.starts_with("unweld: set.uwm, member 0: not 1.ply: "),
            "{}",
            other.err
        );
    }
}

#[test]
fn coordinates_come_back_bit_for_bit() {
    let folder = Folder::new();
    let mesh = shapes::bumpy_sphere(1, 3);
    folder.mesh("a.ply", &mesh);
    folder.mesh("b.ply", &IndexedMesh::new(mesh.positions.clone(), mesh.triangles[..30].to_vec()));
    folder.run("pack a.ply b.ply -o set.uwm --exact -q").succeeded();
    folder.run("unpack set.uwm -o out -q").succeeded();
    assert!(triangles(&folder.read("out/level-0.ply")) == triangles(&mesh));
    assert_eq!(folder.read("out/level-1.ply").triangles.len(), 30);
}

#[test]
fn chains_of_levels() {
    let folder = Folder::new();
    folder.mesh("m.ply", &shapes::bumpy_sphere(3, 2));
    folder.run("lod m.ply -o lods --levels 3 -q").succeeded();
    let counts = |name: &str| {
        (0..4).map(|k| folder.read(&format!("{name}/level-{k}.ply")).triangles.len()).collect::<Vec<_>>()
    };
    assert!(
        counts("lods").iter().zip([1280, 640, 320, 160]).all(|(&n, most)| n <= most && n + 2 >= most),
        "{:?}",
        counts("lods")
    );
    let json = folder.run("lod m.ply -o set.uwm --triangles 500,100 --small --json").json();
    let members = json["members"].as_array().unwrap();
    assert!(members.len() == 3 && members[1]["triangles"].as_u64().unwrap() <= 500);
    assert!(members[1]["max_error"].as_f64().unwrap() < members[2]["max_error"].as_f64().unwrap());
    // A history has all levels between: an ordinary file.
    folder.run("lod m.ply -o plain.uwm --method stellar -q").succeeded();
    assert!(folder.info("plain.uwm")["levels"].as_array().unwrap().len() > 3);
    let misused = |command: &str, what: &str| {
        let run = folder.run(command);
        assert!(run.code == 2 && run.err.starts_with(&format!("error: {what}\n")), "{}", run.err);
    };
    misused(
        "unpack plain.uwm -o out",
        "plain.uwm is no set of meshes; decode --all-levels writes its levels",
    );
    misused("lod m.ply -o m.obj", "m.obj: the name of a folder is wanted, or of a .uwm or .glb file");
    misused("unpack set.uwm -o m.obj", "m.obj: the name of a folder is wanted, or of a .glb file");
}

/// A set becomes one glTF, from which it is packed again; who knows nothing of levels of detail sees the finest.
#[test]
fn sets_as_levels_of_detail_of_a_gltf() {
    let folder = Folder::new();
    let meshes = chain(&folder);
    for order in ["--small", "--stream"] {
        folder.run(&format!("pack 0.ply 1.ply 2.ply -o set.uwm --exact {order} -q")).succeeded();
        let told = folder.run("unpack set.uwm -o lods.glb --json").json();
        assert_eq!(
            (&told["files"][0]["file"], told["files"].as_array().unwrap().len()),
            (&"lods.glb".into(), 3)
        );
        assert!(triangles(&folder.read("lods.glb")) == triangles(&meshes[0]));
        // A set has no place for the shares of the screen.
        let run = folder.run("pack lods.glb -o again.uwm --exact -q");
        assert!(
            run.code == 0 && run.err.contains("level 0: dropped objects with extras (1)\n"),
            "{}",
            run.err
        );
        folder.run("unpack again.uwm -o out -q").succeeded();
        for (k, mesh) in meshes.iter().enumerate() {
            assert!(
                triangles(&folder.read(&format!("out/level-{k}.ply"))) == triangles(mesh),
                "{order}: {k}"
            );
        }
        folder.run("unpack set.uwm -o one.glb --level 1 -q").succeeded();
        assert!(triangles(&folder.read("one.glb")) == triangles(&meshes[1]));
    }
    folder.run("lod 0.ply -o made.glb --triangles 100,50 -q").succeeded();
    assert_eq!(folder.run("pack made.glb -o made.uwm -q").code, 0);
    let members = folder.info("made.uwm");
    let counts = members["members"].as_array().unwrap().iter().map(|m| m["triangles"].as_u64().unwrap());
    let counts: Vec<u64> = counts.collect();
    assert!(counts.len() == 3 && counts[0] == 240 && counts[1] <= 100 && counts[2] <= 50, "{counts:?}");
}

#[test]
fn sets_at_fault() {
    let folder = Folder::new();
    chain(&folder);
    folder.run("pack 0.ply 1.ply 2.ply -o set.uwm --position-bits 8 -q").succeeded();
    folder
        .run("decode set.uwm -o one.ply --level 3")
        .failed(1, "set.uwm: there is no member 3: they are 0 (finest) to 2");
    let bytes = folder.bytes("set.uwm");
    folder.write("cut.uwm", &bytes[..bytes.len() - 1]);
    let there = bytes.len() - 1;
    folder
        .run("decode cut.uwm -o one.ply")
        .failed(1, &format!("cut.uwm: byte {there}: the file is cut off: member 0 lacks 1 byte"));
    folder.run("decode cut.uwm -o one.ply --level 2 -q").succeeded();
    for cut in [0, 12, 17, 60] {
        folder.write("cut.uwm", &bytes[..cut]);
        let run = folder.run("info cut.uwm");
        assert!(run.code == 1 && run.err.starts_with("unweld: cut.uwm: "), "{}", run.err);
    }
    let mut broken = bytes.clone();
    broken[30] ^= 1;
    folder.write("broken.uwm", &broken);
    folder
        .run("info broken.uwm")
        .failed(1, "broken.uwm: byte 0: header and table of the set do not match their checksum (spec §3.4)");
}
