//! Levels of `.uwm` files as inputs of `encode` and `simplify`.

use super::{Folder, levels, triangles};
use unweld::decoder::{Options, Until, decode};
use unweld::formats::Precision;
use unweld::mesh::{IndexedMesh, shapes};

/// A mesh that is no manifold, with coordinates that no lattice has.
fn odd() -> IndexedMesh {
    let mut mesh = shapes::bumpy_sphere(3, 2);
    mesh.triangles.push(mesh.triangles[5]);
    mesh.positions.iter_mut().flatten().for_each(|x| *x += 0.1);
    mesh
}

#[test]
fn level_0_stays_what_it_is() {
    let folder = Folder::new();
    folder.mesh("m.ply", &odd());
    for options in ["", "--exact", "--keep-order", "--exact --keep-order", "--position-bits 11"] {
        folder.run(&format!("encode m.ply -o a.uwm -q {options}")).succeeded();
        // On the lattice as many bits are wanted as there were; what is exact or ordered stays so unasked.
        let bits = if options.contains("bits") { options } else { "" };
        folder.run(&format!("encode a.uwm -o b.uwm -q {bits}")).succeeded();
        folder.run("verify b.uwm m.ply").succeeded();
        let [a, b] = ["a.uwm", "b.uwm"].map(|name| folder.info(name));
        for key in ["exact", "keep_order", "vertices", "triangles"] {
            assert_eq!(a[key], b[key], "{key} {options}");
        }
    }
}

#[test]
fn binary32_stays_binary32() {
    let folder = Folder::new();
    let mut mesh = odd();
    mesh.positions.iter_mut().flatten().for_each(|x| *x = f64::from(*x as f32));
    let mut file = Vec::new();
    unweld::formats::write_ply(&mesh, Precision::Float32, &mut file).unwrap();
    folder.write("m.ply", file);
    folder.run("encode m.ply -o a.uwm --exact -q").succeeded();
    folder.run("encode a.uwm -o b.uwm -q").succeeded();
    folder.run("verify b.uwm m.ply").succeeded();
    // In twice the width they would take far more.
    let [a, b] = ["a.uwm", "b.uwm"].map(|name| folder.info(name)["correction"]["bytes"].as_u64().unwrap());
    assert!(b < a + a / 4, "{a} {b}");
}

#[test]
fn another_level() {
    let folder = Folder::new();
    folder.mesh("m.ply", &odd());
    folder.run("encode m.ply -o a.uwm --exact -q").succeeded();
    let until = Until { level: 3, ..Until::default() };
    let decoder = decode(&folder.bytes("a.uwm"), Options { until, ..Options::default() }).unwrap();
    folder.mesh("level.ply", &decoder.assembled().unwrap());
    let run = folder.run("encode a.uwm -o b.uwm --level 3 --position-bits 20");
    let lines: Vec<&str> = run.err.lines().collect();
    assert_eq!(
        lines[0],
        "unweld: a.uwm: level 3 is without what level 0 has: the residue, exact coordinates"
    );
    let rounded =
        "unweld: a.uwm: coordinates on a lattice of 14 bits are rounded to another one of 20 bits, by up to ";
    assert!(lines[1].starts_with(rounded), "{}", lines[1]);
    assert_eq!((run.code, lines.len()), (0, 2));
    let info = folder.info("b.uwm");
    assert_eq!(info["exact"], false);
    assert_eq!(info["triangles"], folder.read("level.ply").triangles.len());
    folder.run("verify b.uwm level.ply -q").succeeded();
    folder.run("encode a.uwm -o d.uwm --level 3 --exact -q").succeeded();
    folder.run("decode d.uwm -o d.ply -q").succeeded();
    assert_eq!(triangles(&folder.read("d.ply")), triangles(&folder.read("level.ply")));
}

#[test]
fn simplified_and_several() {
    let folder = Folder::with_sphere();
    let info = folder.info("sphere.uwm");
    let of_level =
        |j: u64| levels(&info).iter().find(|level| level["level"] == j).unwrap()["triangles"].clone();
    for (options, input) in [("", 1280.into()), ("--level 2", of_level(2))] {
        let json = folder.run(&format!("simplify sphere.uwm -o out.ply --faces 200 --json {options}")).json();
        assert_eq!((&json["input"]["triangles"], &json["triangles"]), (&input, &200.into()));
    }
    folder.run_with("simplify - -o out.ply --faces 200 -q", &folder.bytes("sphere.uwm")).succeeded();
    assert_eq!(folder.read("out.ply").triangles.len(), 200);
    folder.mesh("other.ply", &shapes::torus(8, 9));
    folder.run("encode sphere.uwm other.ply -o out -q").succeeded();
    folder.run("verify out/sphere.uwm sphere.ply -q").succeeded();
    // Its result would have its name.
    folder
        .run("encode sphere.uwm other.ply -o .")
        .refused("./sphere.uwm is the input sphere.uwm, which would be lost");
    folder.run("encode sphere.uwm -o sphere.uwm").refused("sphere.uwm is the input");
    for command in ["encode other.ply -o x.uwm", "simplify other.ply -o x.ply --faces 9"] {
        folder
            .run(&format!("{command} --level 1"))
            .refused("other.ply has no levels: --level is for .uwm files");
    }
    let base = levels(&info).len() - 1;
    let line = format!("sphere.uwm: there is no level 99: the levels are 0 (finest) to {base} (base)");
    folder.run("encode sphere.uwm -o x.uwm --level 99").failed(1, &line);
    let few = folder.run("encode sphere.uwm -o x.uwm --max-memory 1K");
    assert_eq!(few.code, 1);
    assert!(!folder.list().iter().any(|name| name.starts_with('x')));
}

/// A mesh from a pipe by its name is read once, from its first byte.
#[cfg(unix)]
#[test]
fn from_a_named_pipe() {
    let folder = Folder::with_sphere();
    for (command, name) in [
        ("view pipe -o a.png -q", "sphere.ply"),
        ("view pipe -o a.png -q", "sphere.uwm"),
        ("encode pipe -o a.uwm -q", "sphere.uwm"),
        ("simplify pipe -o a.ply --faces 99 -q", "sphere.ply"),
    ] {
        let line = format!("rm -f pipe; mkfifo pipe; cat {name} > pipe & unweld {command}");
        let Some((code, err)) = folder.shell(&line) else { return };
        assert_eq!((code, err.as_str()), (Some(0), ""), "{command} of {name}");
    }
}
