//! Foreign formats in and out.

use super::{Folder, triangles};
use flate2::{Compression, write::GzEncoder};
use std::io::Write;
use unweld::formats::Precision;
use unweld::formats::{write_obj, write_ply, write_stl};
use unweld::mesh::{IndexedMesh, shapes};

/// A mesh whose coordinates are binary32 numbers, in each of the formats, text and binary.
fn in_all_formats() -> (IndexedMesh, Vec<(&'static str, Vec<u8>)>) {
    let mut mesh = shapes::bumpy_sphere(2, 1);
    mesh.positions.iter_mut().flatten().for_each(|x| *x = f64::from(*x as f32));
    let lines = |head: String, positions: &str, triangles: &str| {
        let positions = mesh.positions.iter().map(|[x, y, z]| format!("{positions}{x} {y} {z}\n"));
        let triangles_of = mesh.triangles.iter().map(|[a, b, c]| format!("{triangles}{a} {b} {c}\n"));
        (head + &positions.collect::<String>() + &triangles_of.collect::<String>()).into_bytes()
    };
    let (v, t) = (mesh.positions.len(), mesh.triangles.len());
    let ply = format!(
        "ply\nformat ascii 1.0\nelement vertex {v}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {t}\nproperty list uchar int vertex_indices\nend_header\n"
    );
    let facet = |t: &[u32; 3]| {
        let corners = t.map(|v| mesh.positions[v as usize]).map(|[x, y, z]| format!("vertex {x} {y} {z}\n"));
        format!("facet normal 0 0 0\nouter loop\n{}endloop\nendfacet\n", corners.concat())
    };
    let stl = format!("solid\n{}endsolid\n", mesh.triangles.iter().map(facet).collect::<String>());
    let mut files = vec![
        ("text.ply", lines(ply, "", "3 ")),
        ("text.off", lines(format!("OFF\n{v} {t} 0\n"), "", "3 ")),
        ("text.stl", stl.into_bytes()),
        ("b.PLY", Vec::new()),
        ("b.Obj", Vec::new()),
        ("b.STL", Vec::new()),
    ];
    write_ply(&mesh, Precision::Float64, &mut files[3].1).unwrap();
    write_obj(&mesh, Precision::Float64, &mut files[4].1).unwrap();
    write_stl(&mesh, &mut files[5].1).unwrap();
    (mesh, files)
}

#[test]
fn every_format_by_name_by_content_and_compressed() {
    let folder = Folder::new();
    let (mesh, files) = in_all_formats();
    folder.mesh("mesh.ply", &mesh);
    for (name, bytes) in files {
        let mut zipped = GzEncoder::new(Vec::new(), Compression::fast());
        zipped.write_all(&bytes).unwrap();
        let zipped = zipped.finish().unwrap();
        folder.write(name, &bytes);
        folder.write(&format!("{name}.gz"), &zipped);
        folder.write("no_extension", &bytes);
        for input in [name, &format!("{name}.gz"), "no_extension"] {
            folder.run(&format!("encode {input} -o a.uwm -q")).succeeded();
            folder.run("verify a.uwm mesh.ply -q").succeeded();
            folder.run(&format!("verify a.uwm {input} -q")).succeeded();
        }
        for input in [&bytes, &zipped] {
            folder.run_with("encode - -o a.uwm -q", input).succeeded();
            folder.run("verify a.uwm mesh.ply -q").succeeded();
        }
    }
}

#[test]
fn stl_out_is_the_same_triangles_and_says_what_it_costs() {
    let folder = Folder::with_sphere();
    let run = folder.run("decode sphere.uwm -o sphere.stl");
    assert_eq!(run.code, 0);
    let told: Vec<&str> = run.err.lines().collect();
    let head = "unweld: sphere.stl: STL has";
    assert_eq!(told[0], format!("{head} no shared vertices: 642 vertices written as 3,840 corners"));
    assert!(
        told[1].starts_with(&format!("{head} binary32 numbers: coordinates rounded by up to ")),
        "{}",
        told[1]
    );
    assert!(told[1].ends_with(", on the same points of the lattice"));
    assert_eq!(told.len(), 2);
    assert!(run.text().starts_with("sphere.stl: 642 vertices, 1,280 triangles\n"), "{}", run.text());
    folder.run("verify sphere.uwm sphere.stl").succeeded();
    let stl = folder.bytes("sphere.stl");
    assert_eq!(stl.len(), 84 + 50 * 1280);

    folder.run("decode sphere.uwm -o sphere.stl -q").succeeded();
    assert_eq!(folder.bytes("sphere.stl"), stl);
    folder.run("decode sphere.uwm -o coarse.stl --all-levels levels -q").succeeded();
    assert!(folder.path("levels/level-0.stl").is_file());
    assert_eq!(folder.bytes("levels/level-0.stl"), stl);

    // An STL file in, and out again.
    folder.run("encode sphere.stl -o again.uwm -q").succeeded();
    folder.run("decode again.uwm -o again.ply -q").succeeded();
    folder.run("verify again.uwm sphere.stl -q").succeeded();
    assert_eq!(folder.read("again.ply").positions.len(), 642);
}

#[test]
fn simplify_to_stl_warns_in_json_too() {
    let folder = Folder::with_sphere();
    let object = folder.run("simplify sphere.ply -o small.STL --faces 100 --json").json();
    let warnings = object["warnings"].as_array().unwrap();
    assert_eq!(warnings[0], "small.STL: STL has no shared vertices: 52 vertices written as 300 corners");
    assert!(warnings[1].as_str().unwrap().starts_with("small.STL: STL has binary32 numbers"));
    assert_eq!(triangles(&folder.read("small.STL")).len(), 100);
}

/// A binary STL file of two facets that tells of so many.
fn stl_of(told: u8) -> Vec<u8> {
    let facet = |z: f32| {
        let numbers = [0.0, 0.0, 0.0, 0.0, 0.0, z, 1.0, 0.0, z, 0.0, 1.0, z];
        [&numbers.map(f32::to_le_bytes).concat()[..], &[0, 0]].concat()
    };
    [&[b' '; 80][..], &[told, 0, 0, 0], &facet(0.0), &facet(1.0)].concat()
}

#[test]
fn counts_that_are_not_those_of_the_length() {
    let folder = Folder::new();
    for (told, fault) in [(0, "byte 80: "), (1, "byte 80: "), (3, "byte 184: the file ends early: ")] {
        folder.write("a.stl", stl_of(told));
        let counts = format!("the header tells of {told} facets, 2 are there by the file's length");
        folder
            .run("encode a.stl -o x.uwm")
            .failed(1, &format!("a.stl: {fault}{counts}; --force reads what is there"));
        assert_eq!(folder.list(), ["a.stl"]);
        folder.run("encode a.stl -o x.uwm --exact --force -q").succeeded();
        folder.run("verify x.uwm a.stl -q").succeeded();
        folder.run("decode x.uwm -o x.ply -q").succeeded();
        assert_eq!(folder.read("x.ply").triangles.len(), 2);
        for name in ["x.uwm", "x.ply"] {
            std::fs::remove_file(folder.path(name)).unwrap();
        }
    }
    // Force mends no coordinate, and is not named where it would not help.
    let mut broken = stl_of(1);
    broken[84 + 12..84 + 16].copy_from_slice(&f32::NAN.to_le_bytes());
    folder.write("a.stl", broken);
    let run = folder.run("encode a.stl -o x.uwm");
    assert!(run.code == 1 && !run.err.contains("--force"), "{}", run.err);
    let run = folder.run("encode a.stl -o x.uwm --force");
    assert!(run.err.contains("x of corner 1 of facet 1 is NaN"), "{}", run.err);
}

#[test]
fn what_a_compressed_file_inflates_to_is_limited_everywhere() {
    let folder = Folder::with_sphere();
    let mut bomb = GzEncoder::new(Vec::new(), Compression::best());
    bomb.write_all(b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n#").unwrap();
    bomb.write_all(&vec![b' '; 8 << 20]).unwrap();
    folder.write("bomb.obj.gz", bomb.finish().unwrap());
    let limit = "bomb.obj.gz: limit reached: inflated size in bytes needs 4194305, allowed 4194304 (--max-memory allows more)";
    for command in [
        "encode bomb.obj.gz -o x.uwm",
        "simplify bomb.obj.gz -o x.ply --faces 1",
        "verify sphere.uwm bomb.obj.gz -q",
        "view bomb.obj.gz -o x.png",
        "measure bomb.obj.gz sphere.ply",
        "measure sphere.ply bomb.obj.gz",
    ] {
        folder.run(&format!("{command} --max-memory 4M")).failed(1, limit);
    }
    folder.run("encode bomb.obj.gz -o x.uwm --max-memory 64M -q").succeeded();
}

#[test]
fn what_is_no_mesh_is_refused_at_its_place() {
    let folder = Folder::new();
    let none = "the content is of no known format: PLY, OBJ, STL, OFF, glTF";
    folder.write("model.glb", b"glTF\x02\0\0\0");
    let glb = "byte 8: the file ends early";
    folder.run("encode model.glb -o x.uwm").failed(1, &format!("model.glb: {glb}"));
    folder.run_with("encode - -o x.uwm", b"\0\0").failed(1, &format!("standard input: {none}"));
    folder.write("short.stl", [&[0; 80][..], &[7, 0, 0, 0], &[0; 6]].concat());
    let early =
        "byte 84: the file ends early: the header tells of 7 facets, 0 are there by the file's length";
    folder.run("encode short.stl -o x.uwm").failed(1, &format!("short.stl: {early}"));
    folder.write("far.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n");
    let range = "line 6: vertex index 3 is out of range: the file has 3 vertices (faces)";
    folder.run("encode far.off -o x.uwm").failed(1, &format!("far.off: {range}"));
    folder.write("wrong.stl", "v 0 0 0\n");
    let not = "line 1: not an STL file: text that does not begin with `solid`";
    folder.run("encode wrong.stl -o x.uwm").failed(1, &format!("wrong.stl: {not}"));
    let run = folder.run("decode x.uwm -o x.off");
    assert_eq!(run.code, 2);
    assert!(run.err.contains("x.off: the name must end in .ply, .obj, .stl, .glb or .gltf"), "{}", run.err);
    assert_eq!(folder.list(), ["far.off", "model.glb", "short.stl", "wrong.stl"]);
}
