//! Files that are cut off: what is before the cut is a mesh.

use super::{Folder, levels, triangles};
use serde_json::Value;
use unweld::mesh::shapes;

fn number(value: &Value) -> usize {
    value.as_u64().unwrap() as usize
}

impl super::Run {
    /// Went well, with one line on standard error, which has these words in it.
    fn remarked(&self, what: &str) {
        assert_eq!((self.code, self.err.lines().count()), (0, 1), "{}", self.err);
        assert!(self.err.contains(what), "{what}: {}", self.err);
    }
}

#[test]
fn every_prefix_from_the_base_on_is_a_mesh() {
    let folder = Folder::with_sphere();
    let (info, file) = (folder.info("sphere.uwm"), folder.bytes("sphere.uwm"));
    let table = levels(&info);
    let (base, end) = (table.len() - 1, file.len());
    let base_end = number(&table[0]["cumulative_bytes"]);
    let bounds = table.iter().map(|level| number(&level["cumulative_bytes"]));
    // Where a level is complete, a byte before, and some places between.
    let cuts = bounds.flat_map(|bound| [bound, bound - 1, bound + 17]);
    for cut in cuts.filter(|cut| (base_end..end).contains(cut)) {
        folder.write("cut.uwm", &file[..cut]);
        // The table tells which levels end before the cut.
        let complete = table.iter().rfind(|level| number(&level["cumulative_bytes"]) <= cut).unwrap();
        let level = number(&complete["level"]);
        let next = table.iter().find(|other| number(&other["level"]) + 1 == level);
        let told = format!("level {level} of {base} ");
        folder.run("decode cut.uwm -o cut.ply -q").remarked(&told);
        folder.run("view cut.uwm -o cut.png --size 40x40 -q").remarked(&told);
        folder.run("info cut.uwm").remarked(&told);
        let run = folder.run("info cut.uwm --json");
        run.remarked(&told);
        let json: Value = serde_json::from_slice(&run.out).unwrap();
        // The table is there; what is behind the cut, as the diagonal of the input, is not.
        for (level, whole) in levels(&json).iter().zip(table) {
            for key in ["level", "offset", "bytes", "vertices", "triangles", "max_error", "rms_error"] {
                assert_eq!(level[key], whole[key], "{key}");
            }
        }
        let counts = (
            number(&json["cut"]["bytes"]),
            number(&json["cut"]["missing_bytes"]),
            number(&json["cut"]["level"]),
        );
        assert_eq!(counts, (cut, end - cut, level));
        let there = folder.read("cut.ply").triangles.len();
        assert_eq!(there, number(&json["cut"]["triangles"]));
        let most = next.map_or(1280, |next| number(&next["triangles"]));
        assert!((number(&complete["triangles"])..=most).contains(&there), "{cut}: {there}");
        if cut == number(&complete["cumulative_bytes"]) {
            folder.run(&format!("decode sphere.uwm -o level.ply --level {level}")).succeeded();
            assert_eq!(triangles(&folder.read("cut.ply")), triangles(&folder.read("level.ply")));
            folder.run(&format!("view sphere.uwm -o level.png --size 40x40 --level {level}")).succeeded();
            assert_eq!(folder.bytes("cut.png"), folder.bytes("level.png"));
        }
        assert_eq!(folder.run("verify cut.uwm").code, 1, "it is not the whole file");
    }
}

#[test]
fn before_the_end_of_the_base_there_is_none() {
    let folder = Folder::with_sphere();
    let (info, file) = (folder.info("sphere.uwm"), folder.bytes("sphere.uwm"));
    let base = &levels(&info)[0];
    let (table_end, base_end) = (number(&base["offset"]), number(&base["cumulative_bytes"]));
    for cut in [0, 1, 87, 88, table_end - 1, table_end, base_end - 1] {
        folder.write("cut.uwm", &file[..cut]);
        let missing = match cut {
            // A header has 88 bytes (spec 3.2).
            0..88 => format!("at least {} bytes are missing (spec §3.1)", 88 - cut),
            _ if cut < table_end => format!("at least {} bytes are missing (spec §3.1)", table_end - cut),
            _ if cut == base_end - 1 => "the base, the least that is a mesh, lacks 1 byte".to_owned(),
            _ => format!("the base, the least that is a mesh, lacks {} bytes", base_end - cut),
        };
        let line = format!("cut.uwm: byte {cut}: the file is cut off: {missing}");
        folder.run("decode cut.uwm -o x.ply").failed(1, &line);
        folder.run("view cut.uwm -o x.png").failed(1, &line);
        let info = folder.run("info cut.uwm");
        assert_eq!((info.code, info.err.as_str()), (1, format!("unweld: {line}\n").as_str()));
        // The table is told where there is one.
        assert_eq!(info.out.is_empty(), cut < table_end);
    }
    assert!(!folder.list().iter().any(|name| name.starts_with('x')));
}

#[test]
fn what_is_wanted_and_not_there_is_an_error_and_what_is_there_is_none() {
    let folder = Folder::with_sphere();
    let (info, file) = (folder.info("sphere.uwm"), folder.bytes("sphere.uwm"));
    let table = levels(&info);
    let of = |j: usize| &table[table.len() - 1 - j];
    let cut = number(&of(3)["cumulative_bytes"]) + 1;
    folder.write("cut.uwm", &file[..cut]);
    let missing = number(&of(2)["cumulative_bytes"]) - cut;
    let line =
        format!("cut.uwm: byte {cut}: the file is cut off: level 2 lacks {missing} bytes, level 3 is there");
    for command in [
        "decode cut.uwm -o x.ply --level 2",
        "view cut.uwm -o x.png --level 2",
        "view cut.uwm -o x.png --level 4,2",
        "encode cut.uwm -o x.uwm --level 2",
        "simplify cut.uwm -o x.ply --ratio 0.5 --level 2",
        "measure sphere.ply cut.uwm --level 2",
    ] {
        folder.run(command).failed(1, &line);
    }
    for command in [
        "encode cut.uwm -o x.uwm",
        "simplify cut.uwm -o x.ply --faces 50",
        "decode cut.uwm -o x.ply --level 0",
    ] {
        let run = folder.run(command);
        assert_eq!(run.code, 1);
        assert!(run.err.contains(&format!("byte {cut}: the file is cut off: level 0 lacks ")), "{}", run.err);
    }
    assert!(!folder.list().iter().any(|name| name.starts_with('x')));
    // All that is wanted is there: nothing to tell.
    let few = number(&of(5)["triangles"]);
    let operations = number(&of(5)["vertices"]) - number(&of(table.len() - 1)["vertices"]);
    let error = of(5)["max_error"].as_f64().unwrap() * (1.0 + 1e-9);
    for options in [
        "--level 3".to_owned(),
        format!("--faces {few}"),
        format!("--operations {operations}"),
        format!("--error {error}"),
        format!("--prefix-bytes {cut}"),
    ] {
        folder.run(&format!("decode cut.uwm -o a.ply {options}")).succeeded();
        folder.run(&format!("decode sphere.uwm -o b.ply {options}")).succeeded();
        assert_eq!(triangles(&folder.read("a.ply")), triangles(&folder.read("b.ply")), "{options}");
    }
    folder.run("encode cut.uwm -o level.uwm --level 3 -q").succeeded();
    // More is wanted than is there: the finest comes, and is told.
    folder.run("decode cut.uwm -o finest.ply").remarked("level 3 ");
    for options in ["--faces 1200", "--operations 600", "--error 0.0001%", "--prefix-bytes 1G"] {
        let run = folder.run(&format!("decode cut.uwm -o a.ply -q {options}"));
        run.remarked("level 3 ");
        assert_eq!(folder.bytes("a.ply"), folder.bytes("finest.ply"), "{options}");
    }
    let json = folder.run("decode cut.uwm -o a.ply --json").json();
    assert_eq!((&json["output"]["level"], json["warnings"].as_array().unwrap().len()), (&3.into(), 1));
}

#[test]
fn level_0_without_what_belongs_to_it() {
    let folder = Folder::new();
    let mut mesh = shapes::bumpy_sphere(2, 3);
    mesh.triangles.push(mesh.triangles[3]);
    folder.mesh("m.ply", &mesh);
    folder.run("encode m.ply -o m.uwm --exact --keep-order --keyframes all -q").succeeded();
    let (info, file) = (folder.info("m.uwm"), folder.bytes("m.uwm"));
    let bytes = |key: &str| number(&info[key]["bytes"]);
    let level_0 = number(&levels(&info).last().unwrap()["cumulative_bytes"]);
    let residue = level_0 + bytes("residue");
    let correction = residue + bytes("correction");
    let order = correction + bytes("order");
    for (cut, lacks, triangles) in [
        (level_0, "without residue, exact coordinates, order", 320),
        (residue - 1, "without residue, exact coordinates, order", 320),
        (residue, "without exact coordinates, order", 321),
        (correction, "without order", 321),
    ] {
        folder.write("cut.uwm", &file[..cut]);
        let run = folder.run("decode cut.uwm -o cut.ply");
        run.remarked(lacks);
        assert!(!run.text().contains("everything"), "{}", run.text());
        assert_eq!(folder.read("cut.ply").triangles.len(), triangles, "{cut}");
        assert_eq!(folder.run("decode cut.uwm -o x.ply --level 0").code, 1);
    }
    // All of level 0 is there, keyframes are not.
    for cut in [order, file.len() - 1] {
        folder.write("cut.uwm", &file[..cut]);
        for options in ["", "--level 0"] {
            let run = folder.run(&format!("decode cut.uwm -o cut.ply {options}"));
            assert_eq!(run.code, 0, "{}", run.err);
            assert!(run.text().contains("everything there is, bit for bit"), "{}", run.text());
            assert_eq!(folder.read("cut.ply"), mesh, "{cut}");
        }
        assert_eq!(folder.run("decode cut.uwm -o x.ply --via keyframe").code, 1);
    }
    assert!(!folder.path("x.ply").exists());
}

#[test]
fn damage_before_the_cut_is_damage() {
    let folder = Folder::with_sphere();
    let (info, mut file) = (folder.info("sphere.uwm"), folder.bytes("sphere.uwm"));
    let level = &levels(&info)[3];
    file[number(&level["offset"]) + 5] ^= 4;
    file.truncate(number(&level["cumulative_bytes"]) + 100);
    folder.write("cut.uwm", &file);
    for command in ["decode cut.uwm -o x.ply", "view cut.uwm -o x.png"] {
        let run = folder.run(command);
        assert_eq!(run.code, 1);
        assert!(run.err.contains("checksum"), "{}", run.err);
    }
    assert!(!folder.list().iter().any(|name| name.starts_with('x')));
}

#[test]
fn from_standard_input() {
    let folder = Folder::with_sphere();
    let (info, file) = (folder.info("sphere.uwm"), folder.bytes("sphere.uwm"));
    let cut = &file[..number(&levels(&info)[6]["cumulative_bytes"])];
    let told = format!("standard input: cut off at byte {},{:03} of ", cut.len() / 1000, cut.len() % 1000);
    folder.run_with("info -", cut).remarked(&told);
    folder.run_with("view - -o a.png -q", cut).remarked(&told);
    let run = folder.run_with("decode - -o - -q", cut);
    run.remarked(&told);
    folder.write("piped.ply", &run.out);
    assert_eq!(folder.read("piped.ply").triangles.len(), number(&levels(&info)[6]["triangles"]));
}
