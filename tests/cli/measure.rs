//! `unweld measure`.

use super::{Folder, Run, keys};
use serde_json::Value;
use unweld::mesh::{IndexedMesh, shapes};

/// The square over [0, 1]^2 at height `low` where x = 0, `high` where x = 1.
fn square(low: f64, high: f64) -> IndexedMesh {
    let positions = [[0.0, 0.0, low], [1.0, 0.0, high], [1.0, 1.0, high], [0.0, 1.0, low]];
    IndexedMesh::new(positions.to_vec(), vec![[0, 1, 2], [0, 2, 3]])
}

/// The surface of [x, x + 1] * [0, 1]^2.
fn cube(x: f64) -> IndexedMesh {
    let corner = |k: u32| [x + f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2)];
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    IndexedMesh::new((0..8).map(corner).collect(), triangles)
}

fn scaled(mesh: &IndexedMesh, factor: f64) -> IndexedMesh {
    let positions = mesh.positions.iter().map(|p| p.map(|x| x * factor)).collect();
    IndexedMesh::new(positions, mesh.triangles.clone())
}

/// What `measure A B --json` finds.
fn measured(a: &IndexedMesh, b: &IndexedMesh) -> Value {
    let folder = Folder::new();
    folder.mesh("a.ply", a);
    folder.mesh("b.ply", b);
    folder.run("measure a.ply b.ply --samples 100000 --json").json()
}

/// Mean, rms and maximum, each to one in 100; 0 to 1e-12.
fn assert_near(distance: &Value, [mean, rms, max]: [f64; 3]) {
    for (key, expected) in [("mean", mean), ("rms", rms), ("max", max)] {
        let found = distance[key].as_f64().unwrap();
        assert!(
            (found - expected).abs() <= 0.01 * expected + 1e-12,
            "{key} of {distance}, expected {expected}"
        );
    }
}

#[test]
fn parallel_planes() {
    let json = measured(&square(0.0, 0.0), &square(0.25, 0.25));
    for key in ["a_to_b", "b_to_a", "symmetric"] {
        assert_near(&json[key], [0.25; 3]);
        // The diagonal of A is the root of 2.
        let percent = 25.0 / 2.0f64.sqrt();
        for key_percent in ["mean_percent", "rms_percent", "max_percent"] {
            let found = json[key][key_percent].as_f64().unwrap();
            assert!((found - percent).abs() < 1e-9, "{key} {key_percent}: {found}");
        }
    }
    assert!((json["diagonal"].as_f64().unwrap() - 2.0f64.sqrt()).abs() < 1e-12);
    assert_eq!(
        (&json["a_to_b"]["samples"], &json["symmetric"]["samples"]),
        (&100_000.into(), &200_000.into())
    );
    assert_eq!((&json["b_to_a"]["vertices"], &json["symmetric"]["vertices"]), (&4.into(), &8.into()));
    let each = ["max", "max_percent", "mean", "mean_percent", "rms", "rms_percent", "samples", "vertices"];
    assert_eq!(keys(&json["a_to_b"]), each);
    assert_eq!(keys(&json), ["a", "a_to_b", "b", "b_to_a", "diagonal", "symmetric"]);
}

/// Down from a plane of the slope 3/4 the distance is the height, 3/4 x; up to it, it goes by the normal: 3/5 x. The
/// mean of x over the unit interval is 1/2, that of its square 1/3.
#[test]
fn a_tilted_plane() {
    let json = measured(&square(0.0, 0.75), &square(0.0, 0.0));
    let third = (1.0f64 / 3.0).sqrt();
    let expected = |most: f64| [most / 2.0, most * third, most];
    assert_near(&json["a_to_b"], expected(0.75));
    assert_near(&json["b_to_a"], expected(0.6));
    assert_near(&json["symmetric"], expected(0.75));
}

#[test]
fn concentric_spheres() {
    let sphere = shapes::sphere(5);
    let json = measured(&sphere, &scaled(&sphere, 1.5));
    let radius = sphere.positions[0].iter().map(|x| x * x).sum::<f64>().sqrt();
    assert_near(&json["a_to_b"], [radius / 2.0; 3]);
    assert_near(&json["b_to_a"], [radius / 2.0; 3]);
}

#[test]
fn a_cube_and_itself() {
    let json = measured(&cube(3.0), &cube(3.0));
    assert_near(&json["symmetric"], [0.0; 3]);
}

/// Shifted by s = 1/4 in x: one face is s away. Of the opposite one the points are min(s, m) away, where m is their
/// distance from its border and exceeds t for a part (1 - 2t)^2 of them. On the four others it is s - x up to s, then 0.
#[test]
fn a_shifted_cube() {
    let s = 0.25f64;
    let (inside, inside_square) =
        ((1.0 - (1.0 - 2.0 * s).powi(3)) / 6.0, s * s - 8.0 * s.powi(3) / 3.0 + 2.0 * s.powi(4));
    let mean = (s + inside + 4.0 * s * s / 2.0) / 6.0;
    let mean_square = (s * s + inside_square + 4.0 * s.powi(3) / 3.0) / 6.0;
    let json = measured(&cube(0.0), &cube(s));
    for key in ["a_to_b", "b_to_a", "symmetric"] {
        assert_near(&json[key], [mean, mean_square.sqrt(), s]);
    }
}

/// A hole shows in one direction alone: half a square lies on the whole one, which has points up to 1/2 away from it, on the
/// mean 1/8, in the mean square 1/24.
#[test]
fn a_part_and_the_whole() {
    let (half, whole) = (
        IndexedMesh::new(
            square(0.0, 0.0).positions.iter().map(|p| [p[0] / 2.0, p[1], p[2]]).collect(),
            square(0.0, 0.0).triangles,
        ),
        square(0.0, 0.0),
    );
    let json = measured(&half, &whole);
    assert_near(&json["a_to_b"], [0.0; 3]);
    assert_near(&json["b_to_a"], [0.125, (1.0f64 / 24.0).sqrt(), 0.5]);
}

#[test]
fn threads_do_not_matter_and_the_seed_does() {
    let folder = Folder::with_sphere();
    let out = |more: &str| {
        let command = format!("measure sphere.ply sphere.uwm --level 3 --samples 20000 --json {more}");
        folder.run(&command).succeeded().out
    };
    let one = out("--threads 1");
    assert_eq!(one, out("--threads 3"));
    assert_eq!(one, out(""));
    assert_ne!(one, out("--seed 1"));
}

#[test]
fn levels_of_a_uwm_file() {
    let folder = Folder::with_sphere();
    let rms = |run: Run| run.json()["symmetric"]["rms"].as_f64().unwrap();
    let of_level = |level: u32| {
        rms(folder.run(&format!("measure sphere.ply sphere.uwm --level {level} --samples 9999 --json")))
    };
    // What `decode` gives is what is measured.
    folder.run("decode sphere.uwm -o level.ply --level 4").succeeded();
    let json = folder.run("measure sphere.ply sphere.uwm --level 4 --samples 9999 --json").json();
    let decoded = folder.run("measure sphere.ply level.ply --samples 9999 --json").json();
    assert_eq!((&json["b"]["level"], &json["a"]["level"]), (&4.into(), &Value::Null));
    assert_eq!(json["b"]["triangles"], folder.read("level.ply").triangles.len());
    assert_near(
        &json["symmetric"],
        ["mean", "rms", "max"].map(|key| decoded["symmetric"][key].as_f64().unwrap()),
    );
    assert!(of_level(6) > of_level(4) && of_level(4) > of_level(0) && of_level(0) > 0.0);
    // By its content, whatever its name; from standard input.
    std::fs::copy(folder.path("sphere.uwm"), folder.path("sphere.dat")).unwrap();
    assert_eq!(rms(folder.run("measure sphere.ply sphere.dat --level 4 --samples 9999 --json")), of_level(4));
    let bytes = folder.bytes("sphere.uwm");
    assert_eq!(
        rms(folder.run_with("measure sphere.ply - --level 4 --samples 9999 --json", &bytes)),
        of_level(4)
    );
    let json = folder.run("measure sphere.uwm sphere.uwm --samples 9999 --json").json();
    assert_near(&json["symmetric"], [0.0; 3]);
    assert_eq!(json["a"]["level"], 0);
}

#[test]
fn a_table_for_people() {
    let folder = Folder::new();
    folder.mesh("a.ply", &scaled(&square(0.0, 0.0), 10.0));
    folder.write("b.obj", "v 0 0 2.5\nv 10 0 2.5\nv 10 10 2.5\nv 0 10 2.5\nf 1 2 3 4\n");
    let run = folder.run("measure a.ply b.obj --samples 1000").succeeded();
    let expected = "\
A  a.ply: 4 vertices, 2 triangles
B  b.obj: 4 vertices, 2 triangles

             samples  vertices   mean    rms    max  mean %  rms %  max %
     A to B    1,000         4  2.500  2.500  2.500   17.68  17.68  17.68
     B to A    1,000         4  2.500  2.500  2.500   17.68  17.68  17.68
  symmetric    2,000         8  2.500  2.500  2.500   17.68  17.68  17.68

  % of the diagonal of A, 14.1421
";
    assert_eq!(run.text(), expected);
}

#[test]
fn odd_meshes() {
    let folder = Folder::new();
    let triangle = |x: f64| IndexedMesh::new(vec![[0.0; 3], [x, 0.0, 0.0], [0.0, x, 0.0]], vec![[0, 1, 2]]);
    folder.mesh("one.ply", &triangle(1.0));
    folder.mesh("point.ply", &scaled(&triangle(1.0), 0.0));
    // Without a diagonal there are no percents; without area the vertices count.
    let json = folder.run("measure point.ply one.ply --samples 1000 --json").json();
    assert_eq!((&json["a_to_b"]["samples"], &json["diagonal"]), (&0.into(), &0.0.into()));
    assert_eq!((&json["a_to_b"]["mean"], &json["a_to_b"]["mean_percent"]), (&0.0.into(), &Value::Null));
    assert_eq!(json["b_to_a"]["max"], 1.0);
    assert!(folder.run("measure point.ply one.ply --samples 1000").succeeded().text().contains('-'));
    // From the smallest numbers to the largest: a triangle and one of half its size lie half a leg apart.
    for x in [1e-310, 1e-150, 1e-70, 1e70, 1e150, 1e307] {
        folder.mesh("a.ply", &triangle(x));
        folder.mesh("b.ply", &triangle(x / 2.0));
        let json = folder.run("measure a.ply b.ply --samples 1000 --json").json();
        let max = json["symmetric"]["max"].as_f64().unwrap();
        assert!((max / x - 0.5).abs() < 1e-9, "{x}: {max}");
        let percent = json["symmetric"]["max_percent"].as_f64().unwrap();
        assert!((percent - 50.0 / 2.0f64.sqrt()).abs() < 1e-6, "{x}: {percent} %");
    }
}

#[test]
fn faults() {
    let folder = Folder::with_sphere();
    let missing = "No such file or directory (os error 2)";
    folder.run("measure sphere.ply no.obj").failed(1, &format!("no.obj: {missing}"));
    folder.run("measure no.uwm sphere.ply").failed(1, &format!("no.uwm: {missing}"));
    folder.write("points.ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n1 2 3\n");
    folder.run("measure sphere.ply points.ply").failed(1, "points.ply: no triangles, only vertices (1)");
    folder.run_with("measure - sphere.ply", b"").failed(1, "standard input: the file is empty");
    folder.write("bad.uwm", "ply\n");
    folder.run("measure bad.uwm sphere.ply").failed(1, "bad.uwm: byte 0: not a .uwm file (spec §3.2)");
    let base = folder.info("sphere.uwm")["levels"][0]["level"].as_u64().unwrap();
    let levels = format!("sphere.uwm: there is no level 99: the levels are 0 (finest) to {base} (base)");
    folder.run("measure sphere.ply sphere.uwm --level 99").failed(1, &levels);
    let run = folder.run("measure sphere.ply sphere.uwm --max-memory 1K");
    assert_eq!(run.code, 1);
    assert!(run.err.ends_with("allowed 1024 (--max-memory allows more)\n"), "{}", run.err);
    let wide = |x: f64| {
        IndexedMesh::new(vec![[x, 0.0, 0.0], [1e308, 0.0, 0.0], [1e308, 1e300, 0.0]], vec![[0, 1, 2]])
    };
    folder.mesh("wide.ply", &wide(-1e308));
    let infinite = "wide.ply: the mesh is larger than the largest number: its extent is infinite";
    folder.run("measure wide.ply sphere.ply").failed(1, infinite);
    folder.mesh("east.ply", &wide(0.9e308));
    folder.mesh("west.ply", &scaled(&wide(0.9e308), -1.0));
    let apart = "east.ply, west.ply: they are farther apart than the largest number";
    folder.run("measure east.ply west.ply").failed(1, apart);
    for arguments in [
        "measure sphere.ply",
        "measure - -",
        "measure sphere.ply sphere.ply --level 0",
        "measure sphere.ply sphere.ply --samples 0",
        "measure sphere.ply sphere.ply --samples many",
        "measure sphere.ply sphere.ply --threads 0",
        "measure sphere.ply sphere.ply --seed -1",
    ] {
        let run = folder.run(arguments);
        assert_eq!((run.code, run.out.len()), (2, 0), "{arguments}: {}", run.err);
    }
}
