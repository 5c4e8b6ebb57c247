//! `unweld encode`, `unweld info`, `unweld demo`.

use super::{Folder, keys, levels};
use unweld::decoder::decode;
use unweld::encoder::{Encoder, Options, Profile};
use unweld::mesh::{IndexedMesh, shapes};

/// Two tetrahedra that share one vertex, one triangle twice, one degenerate, one vertex in no triangle.
fn faulty() -> IndexedMesh {
    let positions = vec![
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 1.0],
        [-1.0, 0.0, 0.0],
        [0.0, -1.0, 0.0],
        [0.0, 0.0, -1.0],
        [9.0, 9.0, 9.0],
    ];
    let tetrahedron =
        |v: [u32; 4]| [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]].map(|t: [usize; 3]| t.map(|k| v[k]));
    let mut triangles = [tetrahedron([0, 1, 2, 3]), tetrahedron([0, 4, 6, 5])].concat();
    triangles.push(triangles[1]);
    triangles.push([1, 1, 2]);
    IndexedMesh::new(positions, triangles)
}

#[test]
fn the_json_of_info_and_encode() {
    let folder = Folder::with_sphere();
    let info = folder.info("sphere.uwm");
    let expected = [
        "attributes",
        "coding",
        "correction",
        "exact",
        "file_bytes",
        "format_version",
        "generator",
        "input",
        "keep_order",
        "keyframes",
        "lattice",
        "levels",
        "manifold",
        "order",
        "residue",
        "resources",
        "triangles",
        "vertices",
    ];
    assert_eq!(keys(&info), expected);
    assert_eq!((&info["vertices"], &info["triangles"]), (&642.into(), &1280.into()));
    assert_eq!(info["exact"], false);
    assert_eq!(info["coding"], serde_json::json!({ "lifting": 13, "models": "rich" }));
    assert_eq!(info["format_version"], 1);
    assert_eq!(info["generator"], concat!("unweld ", env!("CARGO_PKG_VERSION")));
    assert_eq!(info["file_bytes"], folder.bytes("sphere.uwm").len());
    assert_eq!(keys(&info["lattice"]), ["bits", "origin", "step"]);
    assert_eq!(info["lattice"]["bits"], 14);
    assert_eq!(info["input"]["source"], "sphere.ply");
    assert_eq!(info["input"]["float32"], false);
    assert_eq!(info["input"]["conditioning"]["input_triangles"], 1280);
    assert_eq!(info["input"]["settings"]["keyframes"], "every:3");
    assert_eq!(info["residue"]["bytes"], 0);

    let levels = levels(&info);
    let expected = [
        "attribute_errors",
        "born",
        "bytes",
        "cumulative_bytes",
        "level",
        "max_error",
        "max_error_percent",
        "offset",
        "precision",
        "rms_error",
        "rms_error_percent",
        "triangles",
        "vertices",
    ];
    let base = levels.len() as u64 - 1;
    assert_eq!((&levels[0]["level"], &levels[0]["vertices"]), (&base.into(), &40.into()));
    for (k, pair) in levels.windows(2).enumerate() {
        assert_eq!(keys(&pair[0]), expected);
        assert_eq!(pair[1]["level"], base - 1 - k as u64);
        assert_eq!(pair[1]["offset"], pair[0]["cumulative_bytes"], "levels follow each other");
        let end = pair[1]["offset"].as_u64().unwrap() + pair[1]["bytes"].as_u64().unwrap();
        assert_eq!(pair[1]["cumulative_bytes"], end);
    }
    assert_eq!(levels.last().unwrap()["triangles"], 1280);
    let diagonal = info["input"]["diagonal"].as_f64().unwrap();
    let percent = levels[0]["max_error"].as_f64().unwrap() / diagonal * 100.0;
    assert!((levels[0]["max_error_percent"].as_f64().unwrap() - percent).abs() < 1e-9);
    let keyframes: Vec<u64> =
        info["keyframes"].as_array().unwrap().iter().map(|k| k["level"].as_u64().unwrap()).collect();
    assert_eq!(keyframes, (0..base).rev().filter(|level| level % 3 == 0).collect::<Vec<_>>());

    let encoded = folder
        .run("encode sphere.ply -o again.uwm --base-vertices 40 --keyframes every:3 --preview off --json")
        .json();
    assert_eq!(folder.bytes("again.uwm"), folder.bytes("sphere.uwm"));
    for key in keys(&info) {
        assert_eq!(encoded[key], info[key], "{key}");
    }
    let further: Vec<&str> = keys(&encoded).into_iter().filter(|key| info.get(key).is_none()).collect();
    assert_eq!(
        further,
        ["bits", "bits_per_vertex", "joined", "locked_vertices", "peak_bytes", "seconds", "warnings"]
    );
    assert_eq!(keys(&encoded["seconds"]), ["code", "condition", "read", "simplify", "write"]);
    let bits = [
        "attributes",
        "base",
        "births",
        "connectivity",
        "correction",
        "geometry",
        "keyframes",
        "order",
        "other",
        "residue",
        "resources",
    ];
    assert_eq!(keys(&encoded["bits"]), bits);
    let total: f64 = bits.iter().map(|name| encoded["bits"][name].as_f64().unwrap()).sum();
    assert!((total / 8.0 - info["file_bytes"].as_f64().unwrap()).abs() < 1e-6, "{total} bits");
    let total = encoded["bits_per_vertex"]["total"].as_f64().unwrap();
    assert!((total * 642.0 / 8.0 - info["file_bytes"].as_f64().unwrap()).abs() < 1e-6);
    assert!(encoded["peak_bytes"].as_u64().unwrap() > 642 * 24);
    assert_eq!(encoded["warnings"], serde_json::json!([]));
}

#[test]
fn every_option_of_encode_does_something() {
    let folder = Folder::new();
    folder.mesh("m.ply", &shapes::torus_with_hole(30, 20));
    let plain = {
        folder.run("encode m.ply -o plain.uwm --base-vertices 100").succeeded();
        folder.bytes("plain.uwm")
    };
    for option in [
        "--position-bits 10",
        "--position-bits auto:0.01",
        "--lattice-step 0.0625",
        "--weld 0.2",
        "--base-vertices 90",
        "--profile small",
        "--profile fine",
        "--preview coarse",
        "--keyframes all",
        "--keyframes 1,2",
        "--method ffc",
        "--alpha 0.1",
        "--beta 2",
        "--choices 3",
        "--seed 7",
        "--lock-boundary",
    ] {
        let mut command = format!("encode m.ply -o other.uwm {option} --quiet");
        if !option.starts_with("--base") {
            command += " --base-vertices 100";
        }
        let run = folder.run(&command).succeeded();
        assert!(run.out.is_empty());
        assert_ne!(folder.bytes("other.uwm"), plain, "{option}");
        folder.run("verify other.uwm m.ply -q").succeeded();
        let (name, value) = option[2..].split_once(' ').unwrap_or((&option[2..], "true"));
        assert_eq!(folder.info("other.uwm")["input"]["settings"][name], value);
    }
    folder.run("encode m.ply -o weld.uwm --weld none --max-memory 1G").succeeded();
    assert_eq!(folder.info("weld.uwm")["input"]["conditioning"]["welded_vertices"], 0);
}

/// A torus of triangles that share no vertices, each corner elsewhere by less than anyone sees.
fn loose_torus() -> IndexedMesh {
    let torus = shapes::torus(30, 20);
    let corners = torus.triangles.as_flattened().iter().enumerate();
    let positions =
        corners.map(|(k, &v)| torus.positions[v as usize].map(|x| x + k as f64 * 1e-12)).collect();
    IndexedMesh::new(positions, (0..1200).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect())
}

#[test]
fn nearly_equal_vertices_are_told_and_joined() {
    let folder = Folder::new();
    folder.mesh("m.ply", &loose_torus());
    let apart = folder.run("encode m.ply -o m.uwm --base-vertices 100 --json").json();
    let warnings = apart["warnings"].as_array().unwrap();
    assert!(
        warnings.iter().any(|w| {
            let text = w.as_str().unwrap();
            text.starts_with("1,200 parts would be 1 if") && text.contains("--weld lattice")
        }),
        "{warnings:?}"
    );
    assert_eq!(apart["joined"]["vertices"], 0);
    for weld in ["lattice", "0.00001"] {
        let json =
            folder.run(&format!("encode m.ply -o m.uwm --base-vertices 100 --json --weld {weld}")).json();
        assert_eq!(json["warnings"], serde_json::json!([]));
        // 3,600 corners, all in other places, of 600 vertices.
        assert_eq!((&json["joined"]["vertices"], &json["joined"]["parts"]), (&3000.into(), &1.into()));
        assert_eq!(json["input"]["conditioning"]["joined_vertices"], 3000);
        assert!(json["joined"]["max_distance"].as_f64().unwrap() <= 3600.0 * 1e-12 * 2.0);
        assert_eq!(json["vertices"], 600);
        folder.run("verify m.uwm m.ply -q").succeeded();
        folder.run(&format!("encode m.ply -o m.uwm --weld {weld} --keep-order -q")).succeeded();
        folder.run("verify m.uwm m.ply -q").succeeded();
        let run = folder.run(&format!("encode m.ply -o m.uwm --base-vertices 100 --weld {weld}")).succeeded();
        assert!(run.text().contains("3,000 nearly equal vertices (joined)"), "{}", run.text());
        assert!(run.text().contains("without --exact they stay so"), "{}", run.text());
        let run =
            folder.run(&format!("encode m.ply -o m.uwm --weld {weld} --exact --keep-order")).succeeded();
        assert!(run.text().contains("level 0 has them apart again"), "{}", run.text());
        assert_eq!(folder.info("m.uwm")["vertices"], 3600);
        folder.run("verify m.uwm m.ply -q").succeeded();
    }
}

#[test]
fn what_keeps_neighbours_from_being_equal_is_told() {
    let folder = Folder::with_sphere();
    let warnings = |arguments: &str| -> Vec<String> {
        let json = folder.run(&format!("encode sphere.ply -o s.uwm --json {arguments}")).json();
        json["warnings"].as_array().unwrap().iter().map(|w| w.as_str().unwrap().to_owned()).collect()
    };
    assert!(warnings("--lattice-step 0.0078125 --lattice-origin -8,0,0.5").is_empty());
    let rounded = warnings("--lattice-step 0.01");
    assert!(rounded.len() == 1 && rounded[0].contains("a power of two, such as 0.0078125"), "{rounded:?}");
    let preview = warnings("--lattice-step 0.0078125 --preview coarse");
    assert!(preview.len() == 1 && preview[0].contains("--preview coarse"), "{preview:?}");
    let info = folder.info("s.uwm");
    assert_eq!(info["lattice"]["step"], 0.0078125);
    assert_eq!(info["input"]["settings"]["lattice-step"], "0.0078125");
}

/// The command's profiles are the library's: nothing that one of them settles is overruled by an argument not given.
#[test]
fn profiles_are_those_of_the_library() {
    let folder = Folder::with_sphere();
    let mesh = folder.read("sphere.ply");
    for (name, profile) in [("default", Profile::Default), ("small", Profile::Small), ("fine", Profile::Fine)]
    {
        folder.run(&format!("encode sphere.ply -o {name}.uwm --profile {name} -q")).succeeded();
        let by_command = decode(&folder.bytes(&format!("{name}.uwm")), Default::default()).unwrap();
        let file = Encoder::new(Options::profile(profile)).encode_to_vec(&mesh).unwrap();
        let by_library = decode(&file, Default::default()).unwrap();
        assert_eq!(by_command.contents().unwrap().levels, by_library.contents().unwrap().levels);
    }
}

#[test]
fn a_coarse_preview_shows_more_in_the_first_bytes() {
    let folder = Folder::new();
    folder.mesh("m.ply", &shapes::bumpy_sphere(4, 3));
    for preview in ["off", "coarse"] {
        let command = format!("encode m.ply -o {preview}.uwm --base-vertices 50 --preview {preview} -q");
        folder.run(&command).succeeded();
        folder.run(&format!("verify {preview}.uwm m.ply -q")).succeeded();
    }
    let [off, coarse] = ["off.uwm", "coarse.uwm"].map(|name| folder.info(name));
    let precision = |info: &serde_json::Value| -> Vec<u64> {
        levels(info).iter().map(|level| level["precision"].as_u64().unwrap()).collect()
    };
    assert!(precision(&off).iter().all(|&s| s == 0));
    // From the base down to level 0.
    let shifts = precision(&coarse);
    assert!(shifts[0] > 0 && shifts.is_sorted_by(|a, b| a >= b) && shifts.last() == Some(&0), "{shifts:?}");
    let bytes = |info: &serde_json::Value| levels(info)[0]["cumulative_bytes"].as_u64().unwrap();
    assert!(bytes(&coarse) < bytes(&off), "{} and {}", bytes(&coarse), bytes(&off));
}

#[test]
fn what_no_manifold_holds_is_told() {
    let folder = Folder::new();
    folder.mesh("faulty.ply", &faulty());
    let text = folder.run("encode faulty.ply -o faulty.uwm").succeeded();
    let line = |head: &str| {
        let mut lines = text.text().lines().filter_map(|line| line.strip_prefix("  ")?.strip_prefix(head));
        lines.next().unwrap_or_else(|| panic!("{head}: {}", text.text())).trim().to_owned()
    };
    assert_eq!(line("mesh "), "8 vertices, 10 triangles");
    assert_eq!(line("manifold "), "8 vertices, 8 triangles");
    assert!(line("residue").starts_with("2 triangles, 1 stitched group, 1 extra vertex ("));
    assert_eq!(
        line("found"),
        "1 isolated vertex, 1 degenerate triangle, 1 repeated triangle, 1 non-manifold vertex (cut)"
    );
    assert_eq!(line("topology"), "2 components, 0 handles, no boundary");

    let info = folder.info("faulty.uwm");
    assert_eq!((&info["vertices"], &info["triangles"]), (&8.into(), &10.into()));
    assert_eq!(info["manifold"], serde_json::json!({"vertices": 8, "triangles": 8}));
    let residue = &info["residue"];
    assert_eq!((&residue["triangles"], &residue["stitched_groups"]), (&2.into(), &1.into()));
    assert_eq!((&residue["reversed_triangles"], &residue["extra_vertices"]), (&0.into(), &1.into()));
    assert!(residue["bytes"].as_u64().unwrap() > 0);
    folder.run("verify faulty.uwm faulty.ply").succeeded();
}

#[test]
fn what_is_dropped_is_told() {
    let folder = Folder::new();
    folder.write("m.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nl 1 2\np 1\nf 1 2 3\n");
    let encoded = folder.run("encode m.obj -o m.uwm --json").json();
    let dropped = encoded["input"]["dropped"].as_array().unwrap();
    assert_eq!(dropped.len(), 2, "{dropped:?}");
    let text = folder.run("encode m.obj -o m.uwm");
    assert_eq!(text.code, 0);
    for name in dropped {
        assert!(text.text().lines().any(|line| {
            line.trim_start().starts_with("dropped") && line.contains(name.as_str().unwrap())
        }));
    }
    // It stands on standard error as well, even where nothing else is to be said; in JSON it has its place.
    let names: Vec<&str> = dropped.iter().filter_map(|name| name.as_str()).collect();
    let line = format!("unweld: m.obj: dropped {}\n", names.join(", "));
    assert_eq!(text.err, line);
    let quiet = folder.run("encode m.obj -o m.uwm -q");
    assert_eq!((quiet.code, &quiet.err, &quiet.out[..]), (0, &line, &b""[..]));
    assert_eq!(folder.run("encode m.obj -o m.uwm --json").err, "");
}

#[test]
fn strict_refuses_what_a_file_cannot_keep() {
    let folder = Folder::new();
    folder.write("m.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nl 1 2\nf 1//1 2//1 3//1\n");
    folder.write("bare.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    let run = folder.run("encode m.obj -o m.uwm --strict");
    assert_eq!(run.code, 1);
    assert!(
        run.err.starts_with("unweld: m.obj: --strict: a file cannot keep line elements (1)"),
        "{}",
        run.err
    );
    let run = folder.run("simplify m.obj -o m.ply --faces 1 --strict");
    assert_eq!(run.code, 1);
    assert!(
        run.err.starts_with("unweld: m.obj: --strict: the result cannot keep line elements (1)\n"),
        "{}",
        run.err
    );
    // By removals no attribute goes along.
    let run = folder.run("simplify m.obj -o m.ply --faces 1 --strict --method stellar");
    assert!(run.err.contains("cannot keep line elements (1), normal"), "{}", run.err);
    assert_eq!(folder.list(), ["bare.obj", "m.obj"]);
    // One that loses nothing is none the worse for it, also beside one that fails.
    let run = folder.run("encode m.obj bare.obj -o out --strict");
    assert_eq!(run.code, 1);
    folder.run("verify out/bare.uwm bare.obj").succeeded();
}

#[test]
fn a_base_that_stays_large_is_told() {
    let folder = Folder::new();
    folder.mesh("m.ply", &shapes::annulus(30));
    let warning =
        "the base has 60 vertices where 10 would do: 60 vertices are locked, no other can be removed";
    let run = folder.run("encode m.ply -o m.uwm --base-vertices 10 --lock-boundary --keyframes 0,7");
    let second = "no keyframe at level 7: the base is level 0";
    assert_eq!(run.err, format!("unweld: m.ply: {warning}\nunweld: m.ply: {second}\n"));
    let json = folder.run("encode m.ply -o m.uwm --base-vertices 10 --lock-boundary --json").json();
    assert_eq!(json["warnings"], serde_json::json!([warning]));
    assert_eq!(json["locked_vertices"], 60);
}

#[test]
fn by_standard_input_and_output() {
    let folder = Folder::with_sphere();
    let input = folder.bytes("sphere.ply");
    let run = folder.run_with("encode - -o - --base-vertices 40 --keyframes every:3", &input);
    assert_eq!(run.code, 0);
    assert!(run.err.starts_with("standard input -> standard output\n"), "{}", run.err);
    let quiet =
        folder.run_with("encode - -o - -q --base-vertices 40 --keyframes every:3", &input).succeeded();
    assert_eq!(run.out, quiet.out);
    let decoded = folder.run_with("decode - -o - -q", &quiet.out).succeeded();
    folder.write("piped.ply", &decoded.out);
    folder.run("decode sphere.uwm -o sphere2.ply -q").succeeded();
    assert_eq!(folder.bytes("piped.ply"), folder.bytes("sphere2.ply"));
    let info = folder.run_with("info - --json", &quiet.out).json();
    assert_eq!((&info["triangles"], &info["input"]["source"]), (&1280.into(), &"-".into()));
    let coarse = folder.run_with("decode - -o - -q --level 3 --via keyframe", &quiet.out).succeeded();
    assert!(coarse.out.starts_with(b"ply\n"));
    folder.run_with("verify - sphere.ply", &quiet.out).succeeded();
}

#[test]
fn info_for_people() {
    let folder = Folder::with_sphere();
    let run = folder.run("info sphere.uwm").succeeded();
    let text = run.text();
    assert!(text.starts_with("sphere.uwm: "), "{text}");
    let base = levels(&folder.info("sphere.uwm")).len() - 1;
    let line = |level: usize| {
        let head = level.to_string();
        text.lines().map(|l| l.split_whitespace().collect::<Vec<_>>()).find(|l| l.first() == Some(&&head[..]))
    };
    assert_eq!(line(base).unwrap().last(), Some(&"base"));
    assert_eq!(line(0).unwrap()[1..3], ["642", "1,280"]);
    assert_eq!(line(0).unwrap().last(), Some(&"key"));
}

/// A sphere with its normals and two parts.
#[test]
fn info_tells_errors_of_attributes() {
    let folder = Folder::new();
    let sphere = shapes::sphere(3);
    let mut text = String::new();
    sphere.positions.iter().for_each(|[x, y, z]| text += &format!("v {x} {y} {z}\nvn {x} {y} {z}\n"));
    for (k, half) in ["below", "above"].into_iter().enumerate() {
        text += &format!("g {half}\n");
        let height = |t: &[u32; 3]| t.iter().map(|&v| sphere.positions[v as usize][2]).sum::<f64>();
        for t in sphere.triangles.iter().filter(|&t| (height(t) > 0.0) == (k > 0)) {
            let [a, b, c] = t.map(|v| v + 1);
            text += &format!("f {a}//{a} {b}//{b} {c}//{c}\n");
        }
    }
    folder.write("ball.obj", text);
    folder.run("encode ball.obj -o ball.uwm -q").succeeded();
    let info = folder.info("ball.uwm");
    let titles: Vec<_> = info["attributes"]["list"].as_array().unwrap().iter().map(|a| &a["title"]).collect();
    assert!(titles.contains(&&"normal".into()) && titles.contains(&&"part".into()), "{titles:?}");
    let mut normals = Vec::new();
    for level in levels(&info) {
        for error in level["attribute_errors"].as_array().unwrap() {
            assert!(level["level"] != 0);
            assert_eq!(error["high"].is_null(), error["title"] == "part", "{error}");
            let number = error["error"].as_f64().unwrap();
            if error["title"] == "normal" {
                // The sphere's edges are an eighth of it: not farther than that are normals of the coarsest level.
                assert!(
                    number > 0.01 && number < error["high"].as_f64().unwrap() && number < 45.0,
                    "{error}"
                );
                normals.push(number);
            } else {
                assert!((0.0..0.5).contains(&number), "{error}");
            }
        }
    }
    assert!(normals.len() > 1 && normals[0] > normals[normals.len() - 1], "{normals:?}");
    let text = folder.run("info ball.uwm").succeeded();
    let line = |head: &str| text.text().lines().find(|line| line.contains(head)).map(str::to_owned);
    assert!(line("normal error").unwrap().contains("95 %"), "{}", text.text());
    assert!(line("°").is_some() && line("another part").is_some());
    let none = Folder::with_sphere().run("info sphere.uwm").succeeded();
    assert!(!none.text().contains("95 %"));
}

#[test]
fn info_tells_how_refinements_are_coded() {
    let folder = Folder::with_sphere();
    // More vertices than those of a small mesh.
    folder.mesh("large.ply", &shapes::sphere(5));
    for (settings, lifting, models, words) in [
        ("large.ply --lifting 0", 0, "plain", "coarse levels are not lifted, plain models"),
        ("sphere.ply --lifting 0", 0, "rich", "coarse levels are not lifted, rich models"),
        (
            "large.ply --lifting 20 --profile small",
            20,
            "rich",
            "coarse levels are lifted by 20/64, rich models",
        ),
    ] {
        folder.run(&format!("encode -o other.uwm --force {settings}")).succeeded();
        let coding = &folder.info("other.uwm")["coding"];
        assert_eq!((&coding["lifting"], &coding["models"]), (&lifting.into(), &models.into()));
        let run = folder.run("info other.uwm").succeeded();
        assert!(run.text().contains(&format!("  coding     {words}\n")), "{}", run.text());
    }
}

#[test]
fn the_demo_shows_what_it_does() {
    let folder = Folder::new();
    let run = folder.run("demo --output show").succeeded();
    for words in ["81,920 triangles", "base", "right", "the same 81,920 triangles"] {
        assert!(run.text().contains(words), "{words}: {}", run.text());
    }
    assert!(folder.bytes("show/demo.png").starts_with(b"\x89PNG"));
    // As whoever runs it here can: by cargo, unless the shell finds a program of that name.
    let paths = std::env::var_os("PATH").unwrap();
    let found = std::env::split_paths(&paths).any(|folder| folder.join("unweld").is_file());
    let called = if found { "unweld" } else { "cargo run --" };
    assert!(run.text().contains(&format!("\n  {called} view show/demo.uwm\n")), "{}", run.text());
    assert_eq!(folder.info("show/demo.uwm")["triangles"], 81_920);
    // And a scene: with its pictures, and an animation.
    assert!(folder.bytes("show/demo-scene.png").starts_with(b"\x89PNG"));
    let resources = &folder.info("show/demo-scene.uwm")["resources"]["list"];
    assert!(resources.as_array().is_some_and(|list| list.len() > 4), "{resources}");
    assert_eq!(folder.list(), ["show"]);
}
