//! `unweld simplify`.

use super::{Folder, keys, triangles};
use std::collections::HashSet;
use unweld::mesh::{CornerTable, IndexedMesh, shapes};

fn bits(mesh: &IndexedMesh) -> HashSet<[u64; 3]> {
    mesh.positions.iter().map(|p| p.map(f64::to_bits)).collect()
}

#[test]
fn as_many_triangles_as_wanted_on_positions_of_the_input() {
    let folder = Folder::new();
    for mesh in [shapes::bumpy_sphere(3, 2), shapes::torus_with_hole(30, 20)] {
        folder.mesh("m.ply", &mesh);
        for faces in [100, 401, 900] {
            for method in ["stellar", "ffc"] {
                let command =
                    format!("simplify m.ply -o out.ply --triangles {faces} --method {method} --json");
                let json = folder.run(&command).json();
                let out = folder.read("out.ply");
                assert_eq!(json["triangles"], out.triangles.len());
                assert_eq!(json["vertices"], out.positions.len());
                // A closed surface has an even number; the last vertex may have taken two.
                assert!((faces - 1..=faces).contains(&out.triangles.len()), "{}", out.triangles.len());
                assert!(bits(&out).is_subset(&bits(&mesh)));
                let table = CornerTable::from_triangles(out.positions.len(), &out.triangles).unwrap();
                table.check().unwrap();
                let error = json["max_error"].as_f64().unwrap();
                assert!(error > 0.0 && error < 0.5 * mesh.diagonal(), "{error}");
            }
        }
    }
    let json = folder.run("simplify m.ply -o out.obj --faces 100000 --method stellar --json").json();
    assert_eq!(json["triangles"], json["input"]["triangles"]);
    assert!(json["max_error"].as_f64().unwrap() < 1e-12);
    let expected = [
        "dropped",
        "frames",
        "input",
        "joined_vertices",
        "max_error",
        "max_error_percent",
        "method",
        "passes",
        "rms_error",
        "rms_error_percent",
        "seconds",
        "texture",
        "triangles",
        "vertices",
        "warnings",
    ];
    assert_eq!(keys(&json), expected);
}

#[test]
fn a_part_of_the_triangles() {
    let folder = Folder::new();
    folder.mesh("m.ply", &shapes::bumpy_sphere(3, 2));
    for (ratio, faces) in [("0.25", 320), ("25%", 320), ("0.1", 128), ("100%", 1280)] {
        folder.run(&format!("simplify m.ply -o out.ply --ratio {ratio} -q")).succeeded();
        folder.run(&format!("simplify m.ply -o same.ply --faces {faces} -q")).succeeded();
        assert_eq!(folder.bytes("out.ply"), folder.bytes("same.ply"), "{ratio}");
        assert_eq!(folder.read("out.ply").triangles.len(), faces);
    }
    for goals in [
        "",
        "--faces 9 --ratio 0.1",
        "--ratio 0.1 --error 1%",
        "--ratio 0",
        "--ratio 1.5",
        "--ratio 101%",
        "--error -1",
    ] {
        assert_eq!(folder.run(&format!("simplify m.ply -o x.ply {goals}")).code, 2, "{goals}");
    }
}

/// The distance is measured by another command, from other points.
#[test]
fn within_an_error() {
    let folder = Folder::new();
    for mesh in [shapes::bumpy_sphere(3, 2), shapes::torus_with_hole(30, 20)] {
        folder.mesh("m.ply", &mesh);
        let mut before = usize::MAX;
        for percent in [0.1, 0.5, 2.0] {
            let json = folder.run(&format!("simplify m.ply -o out.ply --error {percent}% --json")).json();
            let measured = folder.run("measure m.ply out.ply --samples 300000 --seed 9 --json").json();
            let error = measured["symmetric"]["max_percent"].as_f64().unwrap();
            // Between the samples it may be a little more.
            assert!(error <= percent * 1.02, "{error} for {percent}");
            assert!(json["max_error_percent"].as_f64().unwrap() <= percent);
            let triangles = folder.read("out.ply").triangles.len();
            assert!(triangles < before, "more may go with a larger error");
            before = triangles;
            // In the units of the mesh it is the same.
            let length = mesh.diagonal() * percent / 100.0;
            folder.run(&format!("simplify m.ply -o same.ply --error {length} -q")).succeeded();
            assert_eq!(folder.bytes("out.ply"), folder.bytes("same.ply"));
        }
        assert!(before < mesh.triangles.len() / 2, "{before}");
    }
    // A plane can do without all that is within, but for one or two vertices that no flips free any more, which depends on the seed.
    let n = 12u32;
    let positions = (0..n * n).map(|k| [f64::from(k % n), f64::from(k / n), 0.0]).collect();
    let cell =
        |k: u32| (k % n + 1 < n && k / n + 1 < n).then(|| [[k, k + 1, k + n + 1], [k, k + n + 1, k + n]]);
    folder.mesh("plane.ply", &IndexedMesh::new(positions, (0..n * n).filter_map(cell).flatten().collect()));
    folder
        .run("simplify plane.ply -o out.ply --error 0.000001% --lock-boundary --method stellar -q")
        .succeeded();
    let boundary = 4 * (n as usize - 1);
    let within = (folder.read("out.ply").triangles.len() - (boundary - 2)) / 2;
    assert!(within <= 2, "{within} vertices within are left of 100");
    // What cannot be is told.
    folder.write("spike.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 9 9 9\nf 1 2 3\nf 1 4 4\n");
    let run = folder.run("simplify spike.obj -o out.ply --error 0.01");
    assert_eq!(run.code, 0);
    assert!(run.err.contains("above the 0.0100 wanted, by what was left out"), "{}", run.err);
}

#[test]
fn what_is_left_out_is_told() {
    let folder = Folder::new();
    let mut mesh = shapes::sphere(2);
    mesh.triangles.push(mesh.triangles[0]);
    mesh.triangles.push([1, 1, 2]);
    mesh.positions.push([7.0; 3]);
    folder.mesh("m.ply", &mesh);
    let json = folder.run("simplify m.ply -o out.ply --faces 50 --json").json();
    let expected = ["1 degenerate triangle", "1 repeated triangle", "1 isolated vertex"];
    assert_eq!(json["dropped"], serde_json::json!(expected));
    let run = folder.run("simplify m.ply -o out.ply --faces 50");
    let told = format!("unweld: m.ply: dropped {}\n", expected.join(", "));
    assert_eq!((run.code, &run.err), (0, &told));
    assert!(run.text().contains(&format!("dropped    {}", expected.join(", "))), "{}", run.text());
    let quiet = folder.run("simplify m.ply -o out.ply --faces 50 -q");
    assert_eq!((quiet.code, &quiet.err, &quiet.out[..]), (0, &told, &b""[..]));
}

#[test]
fn cut_vertices_are_sewn_together_again() {
    // Two spheres that touch in one vertex.
    let sphere = shapes::sphere(2);
    let n = sphere.positions.len() as u32;
    let top =
        (0..n).max_by(|&a, &b| sphere.positions[a as usize][2].total_cmp(&sphere.positions[b as usize][2]));
    let (top, mut mesh) = (top.unwrap(), sphere.clone());
    mesh.positions.extend(
        sphere.positions.iter().map(|p| [p[0], p[1], 2.0 * sphere.positions[top as usize][2] - p[2]]),
    );
    mesh.triangles.extend(sphere.triangles.iter().map(|t| [t[0] + n, t[2] + n, t[1] + n]));
    let folder = Folder::new();
    folder.mesh("m.ply", &mesh);
    folder.run("simplify m.ply -o out.ply --faces 100").succeeded();
    let out = folder.read("out.ply");
    assert_eq!(out.triangles.len(), 100);
    // Two closed surfaces of V = F / 2 + 2 vertices, one of them common.
    assert_eq!(out.positions.len(), 100 / 2 + 4 - 1);
    assert!(bits(&out).contains(&sphere.positions[top as usize].map(f64::to_bits)));
}

#[test]
fn what_cannot_be_reached_is_told() {
    let folder = Folder::new();
    folder.mesh("m.ply", &shapes::annulus(20));
    let run = folder.run("simplify m.ply -o out.ply --faces 5 --lock-boundary --method stellar");
    let line = "unweld: m.ply: 40 triangles are left, 5 wanted: no further vertex can go\n";
    assert_eq!((run.code, run.err.as_str()), (0, line));
    let run = folder.run("simplify m.ply -o out.ply --faces 5 --lock-boundary");
    let line =
        "unweld: m.ply: 40 triangles are left, 5 wanted: no further edge can go, with the boundary locked\n";
    assert_eq!((run.code, run.err.as_str()), (0, line));
    folder.write("flat.obj", "v 0 0 0\nv 1 0 0\nv 0 0 0\nf 1 2 3\n");
    let run = folder.run("simplify flat.obj -o out.ply --faces 5");
    run.failed(1, "flat.obj: no triangle is left: all are degenerate");
}

#[test]
fn nearly_equal_vertices_can_be_joined() {
    // A grid of two squares that do not quite meet: apart, no vertex can go.
    let folder = Folder::new();
    folder.write(
        "m.obj",
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 1.00001 0 0\nv 2 0 0\nv 2 1 0\nv 1.00001 1 0\nf 1 2 3\nf 1 3 4\nf 5 6 7\nf 5 7 8\n",
    );
    let joined = |weld: &str| {
        let json = folder.run(&format!("simplify m.obj -o out.ply --faces 4 --weld {weld} --json")).json();
        (json["joined_vertices"].as_u64().unwrap(), json["vertices"].as_u64().unwrap())
    };
    // The two pairs are 0.00001 apart, on one point of the lattice, 8192: its step is 2 / 16383.
    assert_eq!([joined("exact"), joined("0.001"), joined("0.000005")], [(0, 8), (2, 6), (0, 8)]);
    // A triangle of each stays.
    let run = folder.run("simplify m.obj -o out.ply --faces 1");
    assert_eq!(run.code, 0);
    assert!(run.err.contains("2 parts would be 1 if nearly equal vertices were one: --weld"), "{}", run.err);
    let run = folder.run("simplify m.obj -o out.ply --faces 4 --weld 0.001").succeeded();
    assert!(run.text().contains("joined     2 vertices with others"), "{}", run.text());
}

#[test]
fn to_standard_output() {
    let folder = Folder::with_sphere();
    let run = folder.run("simplify sphere.ply -o - --faces 200 --quiet").succeeded();
    assert!(run.out.starts_with(b"ply\nformat binary_little_endian 1.0\n"));
}

/// Those that move vertices.
const REDUCTIONS: [&str; 5] = ["hqms", "qslim", "mca", "octree", "uniform"];

#[test]
fn the_methods_that_move_vertices() {
    let folder = Folder::new();
    let mesh = shapes::bumpy_sphere(3, 2);
    folder.mesh("m.ply", &mesh);
    for method in REDUCTIONS {
        let command = format!("simplify m.ply -o out.ply --faces 300 --method {method} --json");
        let json = folder.run(&command).json();
        let out = folder.read("out.ply");
        assert_eq!((&json["method"], &json["triangles"]), (&method.into(), &out.triangles.len().into()));
        assert!((200..=300).contains(&out.triangles.len()), "{method}: {}", out.triangles.len());
        assert!(json["passes"].as_u64().unwrap() > 0);
        assert!(!bits(&out).is_subset(&bits(&mesh)));
        assert!(json["max_error_percent"].as_f64().unwrap() < 5.0, "{method}");
    }
    // The default is the first.
    folder.run("simplify m.ply -o same.ply --faces 300 -q").succeeded();
    folder.run("simplify m.ply -o out.ply --faces 300 --method hqms -q").succeeded();
    assert_eq!(folder.bytes("out.ply"), folder.bytes("same.ply"));
}

#[test]
fn options_of_other_methods_are_refused() {
    let folder = Folder::with_sphere();
    for options in [
        "--method stellar --topology free",
        "--method ffc --heap 9",
        "--method hqms --alpha 1",
        "--method qslim --cap 0.5",
        "--method mca --as-published 2004",
        "--method octree --topology keep",
        "--method uniform --strict-normals",
        "--method hqms --place centre",
        "--method hqms --spacing 3",
        "--method stellar --eye 1,2,3",
        "--method parallel",
        "--strategy 4",
        "--heap 0",
        "--cap 0",
        "--as-published 2005",
    ] {
        let run = folder.run(&format!("simplify sphere.ply -o x.ply --faces 100 {options}"));
        assert_eq!(run.code, 2, "{options}: {}", run.err);
    }
    for options in [
        "--strategy 3 --heap 15 --cap 30% --weights unit --topology close",
        "--as-published 2004",
        "--as-published 2006",
        "--method mca --choices 3 --seed 5 --topology free",
        "--method octree --strict-normals --both-errors --eighths --weights unit",
        "--method uniform --place centre",
    ] {
        let command = format!("simplify sphere.ply -o x.ply --faces 100 {options} -q");
        folder.run(&command).succeeded();
    }
}

#[test]
fn handles_go_where_few_triangles_are_left() {
    let folder = Folder::new();
    folder.mesh("m.ply", &shapes::handle_body(6));
    folder.mesh("torus.ply", &shapes::torus(40, 30));
    let run = folder.run("simplify m.ply -o out.ply --faces 60");
    assert_eq!(run.code, 0);
    assert!(run.err.contains("6 handles may go"), "{}", run.err);
    assert!(folder.read("out.ply").triangles.len() <= 60);
    // Nothing of that where there is room, or where they are to be kept.
    let few = folder.run("simplify torus.ply -o out.ply --faces 20");
    assert_eq!((few.code, few.err.as_str()), (0, ""));
    let run = folder.run("simplify torus.ply -o out.ply --faces 8 --topology keep");
    assert!(run.err.contains("triangles are left, 8 wanted: no further edge can go"), "{}", run.err);
    assert!(folder.read("out.ply").triangles.len() >= 14);
}

#[test]
fn coordinates_that_are_no_numbers_are_refused() {
    let folder = Folder::new();
    folder.write("m.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv nan 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n");
    for method in REDUCTIONS {
        let run = folder.run(&format!("simplify m.obj -o out.ply --faces 2 --method {method}"));
        run.failed(1, "m.obj: line 4: x of vertex 4 is NaN");
    }
}

/// A sheet whose texture coordinates are its places, and start anew to the right of the middle.
fn textured() -> String {
    let n = 12;
    let mut text = String::from("mtllib m.mtl\n");
    let mut faces = [String::new(), String::new()];
    for y in 0..=n {
        for x in 0..=n {
            text += &format!("v {x} {y} 0\nvt {x} {y}\nvt {} {y}\n", x + 100);
        }
    }
    for y in 0..n {
        for x in 0..n {
            let right = usize::from(x >= n / 2);
            let corner = |x: usize, y: usize| {
                let v = y * (n + 1) + x;
                format!("{}/{}", v + 1, 2 * v + 1 + right)
            };
            let [a, b, c, d] = [corner(x, y), corner(x + 1, y), corner(x + 1, y + 1), corner(x, y + 1)];
            faces[right] += &format!("f {a} {b} {c}\nf {a} {c} {d}\n");
        }
    }
    text + "usemtl left\n" + &faces[0] + "usemtl right\n" + &faces[1]
}

#[test]
fn textures_and_materials_go_along() {
    let folder = Folder::new();
    folder.write("m.obj", textured());
    for (method, least) in [("hqms", 1), ("qslim", 1), ("octree", 1)] {
        let json =
            folder.run(&format!("simplify m.obj -o out.obj --faces 60 --method {method} --json")).json();
        // Each point has two; 91 on either side are somebody's.
        assert_eq!(json["dropped"], serde_json::json!(["texture coordinates of no triangle (156)"]));
        let out = folder.read("out.obj");
        assert!((least..=60).contains(&out.triangles.len()));
        let uv = out.attributes.iter().find(|a| a.title() == "uv").unwrap();
        let parts = out.attributes.iter().find(|a| a.title() == "part").unwrap();
        let sides: HashSet<_> = (0..out.triangles.len()).map(|t| parts.at(t, 0)).collect();
        // Clusters go by shape, which a plane does not have.
        assert!(sides.len() == 2 || method == "octree", "{method}");
        for (t, triangle) in out.triangles.iter().enumerate().filter(|_| method != "octree") {
            let us = [0, 1, 2].map(|k| uv.values.number(2 * uv.at(t, k).unwrap()));
            let start = if us[0] > 50.0 { 100.0 } else { 0.0 };
            for (u, &v) in us.iter().zip(triangle) {
                assert!((u - start - out.positions[v as usize][0]).abs() < 1e-4, "{method}: {us:?}");
            }
        }
    }
    let json = folder.run("simplify m.obj -o out.obj --faces 60 --method stellar --json").json();
    assert!(json["dropped"].to_string().contains("uv"), "{json}");
}

#[test]
fn a_mesh_between_two_levels() {
    let folder = Folder::with_sphere();
    for method in ["hqms", "octree"] {
        let command =
            format!("simplify sphere.ply -o coarse.ply --faces 100 --method {method} --parents map.txt -q");
        folder.run(&command).succeeded();
        let at = |t: &str, parents: &str| {
            folder.run(&format!("morph sphere.ply coarse.ply {parents} -t {t} -o out.ply -q")).succeeded();
            folder.read("out.ply")
        };
        let [fine, coarse] = ["sphere.ply", "coarse.ply"].map(|name| folder.read(name));
        assert_eq!(triangles(&at("0", "--parents map.txt")), triangles(&fine));
        assert_eq!(triangles(&at("1", "--parents map.txt")), triangles(&coarse), "{method}");
        for parents in ["--parents map.txt", "", "--pairs vertices"] {
            let between = at("0.4", parents);
            assert_eq!(between.triangles, fine.triangles);
            assert_ne!(between.positions, fine.positions);
        }
    }
    let json = folder.run("morph sphere.ply coarse.ply -t 0.5 -o out.ply --json").json();
    assert_eq!(keys(&json), ["left_over", "t", "triangles", "vertices", "warnings"]);
    folder.write("bad.txt", "0\n1\n");
    let run = folder.run("morph sphere.ply coarse.ply -t 0.5 -o x.ply --parents bad.txt");
    run.failed(1, "bad.txt: 2 parents for 642 vertices");
    folder.write("bad.txt", "0\nseven\n");
    let run = folder.run("morph sphere.ply coarse.ply -t 0.5 -o x.ply --parents bad.txt");
    run.failed(1, "bad.txt: line 2: neither the number of a vertex nor -");
    for command in [
        "morph sphere.ply coarse.ply -t 1.5 -o x.ply",
        "morph sphere.ply coarse.ply -t 1 -o sphere.ply",
        "simplify sphere.ply -o x.ply --faces 9 --method stellar --parents m.txt",
        "simplify sphere.ply -o x.glb --faces 9 --parents m.txt",
        "simplify sphere.ply -o x.ply --faces 9 --parents sphere.ply",
    ] {
        assert_eq!(folder.run(command).code, 2, "{command}");
    }
}

#[test]
fn parallel_removal_as_a_viewer_sees_it() {
    let folder = Folder::new();
    let mesh = shapes::bumpy_sphere(4, 2);
    folder.mesh("m.ply", &mesh);
    let of = |options: &str| {
        let json =
            folder.run(&format!("simplify m.ply -o out.ply --method parallel --json {options}")).json();
        (json, folder.read("out.ply"))
    };
    let (json, all) = of("");
    assert!(bits(&all).is_subset(&bits(&mesh)) && all.triangles.len() < mesh.triangles.len() / 5);
    let frame = &json["frames"][0];
    assert_eq!((&frame["triangles"], &frame["vertices"]), (&json["triangles"], &json["vertices"]));
    let removed: u64 =
        frame["iterations"].as_array().unwrap().iter().map(|i| i["removed"].as_u64().unwrap()).sum();
    assert_eq!(removed as usize, mesh.positions.len() - all.positions.len());
    // Threads change nothing.
    assert_eq!(of("--threads 2").1, all);
    assert!(of("--spacing 9").1.triangles.len() < all.triangles.len() / 4);
    // Three frames; the last one is that of the eye.
    let (one, seen) = of("--spacing 9 --eye 0,1,9 --pixels 4");
    let (three, last) = of("--spacing 9 --eye 0,1,9 --pixels 4 --orbit 3");
    assert!(
        seen == last && seen.triangles.len() > of("--spacing 9 --eye 0,1,90 --pixels 4").1.triangles.len()
    );
    assert_eq!(
        (three["frames"].as_array().unwrap().len(), &three["frames"][2]["eye"]),
        (3, &one["frames"][0]["eye"])
    );
    let run =
        folder.run("simplify m.ply -o out.ply --method parallel --orbit 2 --rule 2015 --guard independent");
    let text = String::from_utf8(run.out).unwrap();
    assert!(text.contains("frame 2") && text.contains("candidates -> removed"), "{text}");
    for options in [
        "--faces 9",
        "--alpha 1",
        "--heap 9",
        "--pixels 3",
        "--fov 180 --orbit 2",
        "--eye 1,2",
        "--spacing 0",
    ] {
        let run = folder.run(&format!("simplify m.ply -o x.ply --method parallel {options}"));
        assert_eq!(run.code, 2, "{options}: {}", run.err);
    }
}

/// Cells that are halved where the surface is bent are long where it is not: what hardly tells a place there does not throw it far.
#[test]
fn an_octree_has_no_spikes() {
    let folder = Folder::new();
    folder.write("s.glb", unweld::formats::sample_scene(0.6));
    let json = folder.run("simplify s.glb --method octree --ratio 10% -o t.ply --json").json();
    assert!(json["max_error_percent"].as_f64().unwrap() < 2.0, "{json}");
}
