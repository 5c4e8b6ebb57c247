//! `unweld decode`.

use super::{Folder, levels, triangles};
use serde_json::Value;
use unweld::mesh::{IndexedMesh, shapes};

fn number(value: &Value) -> usize {
    value.as_u64().unwrap() as usize
}

#[test]
fn by_level_error_bytes_operations_and_triangles() {
    let folder = Folder::with_sphere();
    let info = folder.info("sphere.uwm");
    let decode = |options: &str| {
        folder.run(&format!("decode sphere.uwm -o out.ply {options}")).succeeded();
        folder.read("out.ply")
    };
    for level in levels(&info) {
        let counts = (number(&level["vertices"]), number(&level["triangles"]));
        let counted = |mesh: &IndexedMesh| (mesh.positions.len(), mesh.triangles.len());
        let (j, bytes) = (number(&level["level"]), number(&level["cumulative_bytes"]));
        let by_level = decode(&format!("--level {j}"));
        assert_eq!(counted(&by_level), counts);
        for options in [
            format!("--max-bytes {bytes}"),
            format!("--operations {}", counts.0 - 40),
            format!("--triangles {}", counts.1),
            format!("--triangles {}", counts.1 + 1),
            format!("--level {j} --via keyframe"),
        ] {
            assert_eq!(triangles(&decode(&options)), triangles(&by_level), "{options}");
        }
        // A little more, since reading JSON may round.
        let error = level["max_error"].as_f64().unwrap() * (1.0 + 1e-9);
        let coarsest = levels(&info).iter().find(|l| l["max_error"].as_f64().unwrap() <= error).unwrap();
        let by_error = decode(&format!("--error {error}"));
        assert_eq!(counted(&by_error).0, number(&coarsest["vertices"]));
        let percent = level["max_error_percent"].as_f64().unwrap() * (1.0 + 1e-9);
        assert_eq!(triangles(&decode(&format!("--error {percent}%"))), triangles(&by_error));
    }
    // By the root mean square a level is good enough that by its largest error is not.
    let most = levels(&info).iter().find(|l| l["level"] == 3).unwrap()["max_error"].as_f64().unwrap();
    let within = |key: &str, most: f64| {
        let coarsest = levels(&info).iter().find(|l| l[key].as_f64().unwrap() <= most).unwrap();
        (number(&coarsest["level"]), number(&coarsest["vertices"]))
    };
    let (by_max, by_rms) = (within("max_error", most), within("rms_error", most));
    assert!(by_rms.0 > by_max.0, "{by_rms:?} {by_max:?}");
    assert_eq!(decode(&format!("--error rms:{most}")).positions.len(), by_rms.1);
    assert_eq!(decode(&format!("--error max:{most}")).positions.len(), by_max.1);
    assert_eq!(
        decode(&format!("--error {most}")).positions.len(),
        by_max.1,
        "what is meant where nothing is said"
    );
    assert_eq!(decode("--operations 7").positions.len(), 47);
    assert_eq!(decode("--triangles 501").triangles.len(), 500);
    assert_eq!(triangles(&decode("--via keyframe")), triangles(&decode("")));
    assert_eq!(triangles(&decode("--max-bytes 1G")), triangles(&decode("")));
}

#[test]
fn what_was_reached_is_told() {
    let folder = Folder::with_sphere();
    let told = |options: &str| folder.run(&format!("decode sphere.uwm -o out.obj {options}")).succeeded();
    let info = folder.info("sphere.uwm");
    let base = levels(&info).len() - 1;
    // Two operations beyond a level that has more than two to the next.
    let vertices = |level: usize| levels(&info)[base - level]["vertices"].as_u64().unwrap();
    let operations = vertices(3) - vertices(base) + 2;
    let run = told(&format!("--operations {operations}"));
    let (reached, triangles) = (vertices(3) + 2, 2 * vertices(3));
    let head = format!("out.obj: {reached} vertices, {triangles} triangles\n");
    assert!(run.text().starts_with(&head), "{}", run.text());
    let missing = vertices(2) - vertices(3);
    let words = format!("level 3 of {base} and 2 of the {missing} operations to level 2");
    assert!(run.text().contains(&words), "{}", run.text());
    assert!(told("").text().contains(&format!("level 0 of {base}, everything")));
    assert!(told("--level 2").text().contains(&format!("level 2 of {base}; error at most ")));
    assert!(told("--level 2 --quiet").out.is_empty());

    let run = folder.run("decode sphere.uwm -o out.obj --triangles 10");
    assert_eq!(
        (run.code, run.err.as_str()),
        (0, "unweld: sphere.uwm: the base has 76 triangles, more than 10\n")
    );
    let run = folder.run("decode sphere.uwm -o out.obj --error 0");
    assert_eq!(run.code, 0);
    assert!(run.err.starts_with("unweld: sphere.uwm: level 0 has an error of "), "{}", run.err);
}

#[test]
fn out_of_range() {
    let folder = Folder::with_sphere();
    let info = folder.info("sphere.uwm");
    let base = levels(&info).len() - 1;
    let run = folder.run(&format!("decode sphere.uwm -o x.ply --level {}", base + 1));
    let line = format!("there is no level {}: the levels are 0 (finest) to {base} (base)", base + 1);
    run.failed(1, &format!("sphere.uwm: {line}"));
    folder
        .run("decode sphere.uwm -o x.ply --operations 603")
        .failed(1, "sphere.uwm: there are 602 operations, 603 cannot be carried out");
    let needed = number(&levels(&info)[0]["cumulative_bytes"]);
    folder
        .run(&format!("decode sphere.uwm -o x.ply --max-bytes {}", needed - 1))
        .failed(1, &format!("sphere.uwm: the base needs {needed} bytes, --max-bytes allows {}", needed - 1));
    assert!(!folder.list().contains(&"x.ply".to_owned()));
}

#[test]
fn a_download_that_broke_off_gives_what_it_holds() {
    let folder = Folder::with_sphere();
    let info = folder.info("sphere.uwm");
    let level = levels(&info).iter().find(|level| level["level"] == 2).unwrap();
    folder.write("part.uwm", &folder.bytes("sphere.uwm")[..number(&level["cumulative_bytes"]) + 10]);
    let cut = number(&level["cumulative_bytes"]) + 10;
    for options in ["", "--max-bytes 1G"] {
        let run = folder.run(&format!("decode part.uwm -o part.ply {options}"));
        let base = levels(&info).len() - 1;
        let line = format!(
            "cut off at byte {} of {}: level 2 of {base} is there",
            grouped(cut),
            grouped(number(&info["file_bytes"]))
        );
        assert_eq!((run.code, run.err), (0, format!("unweld: part.uwm: {line}\n")));
        assert_eq!(folder.read("part.ply").triangles.len(), number(&level["triangles"]));
    }
    // Whoever wants no more than is there is told of nothing.
    folder.run(&format!("decode part.uwm -o part.ply --max-bytes {cut}")).succeeded();
}

/// In groups of three digits, below a million.
fn grouped(n: usize) -> String {
    if n < 1000 { n.to_string() } else { format!("{},{:03}", n / 1000, n % 1000) }
}

#[test]
fn all_levels_into_a_folder() {
    let folder = Folder::with_sphere();
    let info = folder.info("sphere.uwm");
    let run = folder.run("decode sphere.uwm --all-levels new/levels").succeeded();
    assert_eq!(run.text().lines().count(), levels(&info).len());
    for (level, line) in levels(&info).iter().zip(run.text().lines()) {
        let name = format!("new/levels/level-{}.ply", level["level"]);
        let mesh = folder.read(&name);
        assert_eq!(mesh.triangles.len(), number(&level["triangles"]));
        let [vertices, triangles] = [mesh.positions.len(), mesh.triangles.len()].map(grouped);
        let told = format!("{name}: {vertices} vertices, {triangles} triangles, error at most ");
        assert!(line.starts_with(&told), "{line}");
    }
    assert!(folder.run("decode sphere.uwm --all-levels new/levels -q").succeeded().out.is_empty());
    let told = folder.run("decode sphere.uwm --all-levels new/levels -o new/whole.stl --json").json();
    let written = told["all_levels"].as_array().unwrap();
    assert_eq!(written.len(), levels(&info).len());
    for (level, written) in levels(&info).iter().zip(written) {
        assert_eq!(written["file"], format!("new/levels/level-{}.stl", level["level"]));
        for key in ["level", "vertices", "triangles", "max_error"] {
            assert_eq!(written[key], level[key], "{key}");
        }
    }
    assert_eq!(told["output"]["file"], "new/whole.stl");
    assert_eq!(told["output"]["triangles"], 1280);
    // What an STL file loses.
    assert_eq!(told["warnings"].as_array().unwrap().len(), 2);
    let plain = folder.run("decode sphere.uwm -o whole.ply --level 2 --json").json();
    assert_eq!(
        (plain["output"]["level"].as_u64(), &plain["all_levels"], &plain["warnings"]),
        (Some(2), &serde_json::json!([]), &serde_json::json!([]))
    );
    folder.run("decode sphere.uwm -o - --json").refused("both want standard output");
    folder.run("decode sphere.uwm --all-levels obj -o out.obj --level 3").succeeded();
    let count = std::fs::read_dir(folder.path("obj")).unwrap().count();
    assert_eq!(count, levels(&info).len() - 3, "levels finer than wanted are not written");
    assert_eq!(folder.bytes("obj/level-3.obj"), folder.bytes("out.obj"));
}

#[test]
fn level_0_has_the_residue_where_it_fits() {
    let folder = Folder::new();
    let mut mesh = shapes::sphere(1);
    mesh.triangles.push(mesh.triangles[3]);
    mesh.triangles.push(mesh.triangles[4]);
    folder.mesh("m.ply", &mesh);
    folder.run("encode m.ply -o m.uwm --base-vertices 12 --keyframes all").succeeded();
    let count = |options: &str| {
        folder.run(&format!("decode m.uwm -o out.ply {options}")).succeeded();
        folder.read("out.ply").triangles.len()
    };
    assert_eq!(count(""), 82);
    assert_eq!(count("--level 0"), 82);
    assert_eq!(count("--via keyframe"), 82);
    assert_eq!(count("--operations 30"), 82);
    assert_eq!(count("--operations 29"), 78);
    assert_eq!(
        ["--triangles 82", "--triangles 81", "--triangles 80", "--triangles 79"].map(count),
        [82, 80, 80, 78]
    );
}

#[test]
fn binary64_only_where_binary32_would_lose_the_lattice() {
    let folder = Folder::new();
    let mut mesh = shapes::sphere(2);
    folder.mesh("near.ply", &mesh);
    for p in &mut mesh.positions {
        p[0] += 1e6;
    }
    folder.mesh("far.ply", &mesh);
    for (name, real) in [("near", "float"), ("far", "double")] {
        folder.run(&format!("encode {name}.ply -o m.uwm --position-bits 16")).succeeded();
        folder.run("decode m.uwm -o out.ply").succeeded();
        let header = String::from_utf8_lossy(&folder.bytes("out.ply")[..200]).into_owned();
        assert!(header.contains(&format!("property {real} x\n")), "{name}: {header}");
        folder.run(&format!("verify m.uwm {name}.ply")).succeeded();
        // The decoded mesh is on the lattice: encoding it again changes nothing.
        folder.run("verify m.uwm out.ply").succeeded();
    }
}
