//! `unweld simplify`.

use super::{Folder, keys};
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
                let command = format!("simplify m.ply -o out.ply --faces {faces} --method {method} --json");
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
    let json = folder.run("simplify m.ply -o out.obj --faces 100000 --json").json();
    assert_eq!(json["triangles"], json["input"]["triangles"]);
    assert!(json["max_error"].as_f64().unwrap() < 1e-12);
    let expected = [
        "dropped",
        "input",
        "max_error",
        "max_error_percent",
        "rms_error",
        "rms_error_percent",
        "seconds",
        "triangles",
        "vertices",
        "warnings",
    ];
    assert_eq!(keys(&json), expected);
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
    let run = folder.run("simplify m.ply -o out.ply --faces 5 --lock-boundary");
    let line = "unweld: m.ply: 40 triangles are left, 5 wanted: no further vertex can go\n";
    assert_eq!((run.code, run.err.as_str()), (0, line));
    folder.write("flat.obj", "v 0 0 0\nv 1 0 0\nv 0 0 0\nf 1 2 3\n");
    let run = folder.run("simplify flat.obj -o out.ply --faces 5");
    run.failed(1, "flat.obj: no triangle is left: all are degenerate");
}

#[test]
fn to_standard_output() {
    let folder = Folder::with_sphere();
    let run = folder.run("simplify sphere.ply -o - --faces 200 --quiet").succeeded();
    assert!(run.out.starts_with(b"ply\nformat binary_little_endian 1.0\n"));
}
