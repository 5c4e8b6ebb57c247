//! `unweld view`.

use super::{Folder, keys, levels};
use unweld::mesh::{IndexedMesh, shapes};

/// Width, height, and the pixels with all their channels.
fn picture(bytes: &[u8]) -> (u32, u32, Vec<Vec<u8>>) {
    let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut pixels).unwrap();
    (info.width, info.height, pixels.chunks(info.color_type.samples()).map(<[u8]>::to_vec).collect())
}

/// Pixels that are not those of the corner.
fn covered(bytes: &[u8]) -> usize {
    let (_, _, pixels) = picture(bytes);
    pixels.iter().filter(|&p| *p != pixels[0]).count()
}

#[test]
fn a_level_looks_like_the_mesh_it_decodes_to() {
    let folder = Folder::with_sphere();
    for level in [0, 3] {
        folder.run(&format!("decode sphere.uwm -o {level}.ply --level {level} -q")).succeeded();
        folder.run(&format!("view {level}.ply -o mesh.png --size 90x70 -q")).succeeded();
        folder.run(&format!("view sphere.uwm -o level.png --size 90x70 --level {level} -q")).succeeded();
        // The mesh has binary32 coordinates: an edge may run on the other side of a sample.
        let [mesh, level_itself] = ["mesh.png", "level.png"].map(|name| picture(&folder.bytes(name)).2);
        let others = mesh.iter().zip(&level_itself).filter(|(p, q)| p != q).count();
        assert!(mesh.len() == level_itself.len() && others < 90 * 70 / 100, "level {level}: {others}");
        assert!(covered(&folder.bytes("mesh.png")) > 90 * 70 / 4);
    }
    folder.run("view sphere.uwm -o finest.png --size 90x70").succeeded();
    assert_ne!(folder.bytes("finest.png"), folder.bytes("level.png"));
    folder.run("view sphere.uwm -o finest.png --size 90x70 --level 0").succeeded();
}

#[test]
fn levels_stand_side_by_side_in_the_order_given() {
    let folder = Folder::with_sphere();
    let info = folder.info("sphere.uwm");
    let base = levels(&info).len() - 1;
    let told = folder.run(&format!("view sphere.uwm -o s.png --level {base},0 --level 2 --json")).json();
    assert_eq!(
        keys(&told),
        ["bytes", "dropped", "height", "meshes", "output", "seconds", "warnings", "width"]
    );
    assert_eq!((&told["width"], &told["height"]), (&2400.into(), &800.into()));
    assert_eq!(told["bytes"], folder.bytes("s.png").len());
    let meshes = told["meshes"].as_array().unwrap();
    for (mesh, level) in meshes.iter().zip([base, 0, 2]) {
        assert_eq!(keys(mesh), ["drawn", "level", "triangles", "vertices"]);
        assert_eq!(mesh["level"], level);
        let entry = &levels(&info)[base - level];
        assert_eq!((&mesh["triangles"], &mesh["vertices"]), (&entry["triangles"], &entry["vertices"]));
        assert_eq!(mesh["drawn"], mesh["triangles"]);
    }
    // Whatever stands beside it, and however often, a pane is the same.
    let pane = |bytes: &[u8], from: usize| -> Vec<Vec<u8>> {
        let (width, _, pixels) = picture(bytes);
        pixels.chunks(width as usize).flat_map(|row| row[from..from + 50].to_vec()).collect()
    };
    folder.run("view sphere.uwm -o ab.png --level 2,0 --size 100x50").succeeded();
    folder.run("view sphere.uwm -o ba.png --level 0,2 --size 100x50").succeeded();
    folder.run("view sphere.uwm -o aab.png --level 2,2,0 --size 150x50").succeeded();
    let [ab, ba, aab] = ["ab.png", "ba.png", "aab.png"].map(|name| folder.bytes(name));
    assert_eq!((pane(&ab, 0), pane(&ab, 50)), (pane(&ba, 50), pane(&ba, 0)));
    assert_eq!((pane(&aab, 0), pane(&aab, 100)), (pane(&aab, 50), pane(&ab, 50)));
}

#[test]
fn a_picture_for_people() {
    let folder = Folder::new();
    folder.write("m.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nf 1//1 2//1 3//1\nf 1 1 2\n");
    let run = folder.run("view m.obj -o m.png --size 30x20 --plain").succeeded();
    let lines: Vec<&str> = run.text().lines().collect();
    assert_eq!(lines[0], "m.obj -> m.png");
    assert_eq!(lines[1], "  mesh       2 triangles, 1 without an area as seen from here");
    assert!(lines[2].starts_with("  not drawn  ") && lines[2].contains("normal"), "{}", lines[2]);
    assert_eq!(lines[3], format!("  picture    30 x 20 pixels, {} bytes", folder.bytes("m.png").len()));
    assert!(lines[4].starts_with("  time       read "));
    let quiet = folder.run("view m.obj -o m.png -q").succeeded();
    assert!(quiet.out.is_empty());
    let normals = folder.run("view m.obj -o m.png").succeeded();
    assert!(!normals.text().contains("not drawn"), "{}", normals.text());
}

/// A scene as it came and as it comes back; without its pictures it is another sight.
#[test]
fn pictures_of_materials_are_drawn() {
    let folder = Folder::new();
    folder.write("s.glb", unweld::formats::sample_scene(0.1));
    folder.run("encode s.glb -o s.uwm -q").succeeded();
    let drawn = |input: &str, options: &str| {
        folder.run(&format!("view {input} -o s.png --size 80x60 -q {options}")).succeeded();
        picture(&folder.bytes("s.png")).2
    };
    let scene = drawn("s.glb", "");
    let far = |other: &[Vec<u8>]| {
        let differs = |(p, q): (&Vec<u8>, &Vec<u8>)| p.iter().zip(q).any(|(a, b)| a.abs_diff(*b) > 24);
        scene.iter().zip(other).filter(|pair| differs(*pair)).count()
    };
    assert!(far(&drawn("s.uwm", "--level 0")) < 80 * 60 / 50);
    assert!(far(&drawn("s.glb", "--plain")) > 80 * 60 / 10);
    // What comes back as a scene looks as the level does.
    folder.run("decode s.uwm -o l.glb --level 1 -q").succeeded();
    assert_eq!(drawn("l.glb", ""), drawn("s.uwm", "--level 1"));
    // Told is what is not drawn.
    let told = folder.run("view s.glb -o s.png --size 80x60 --json --plain").json();
    assert_eq!(told["dropped"].as_array().map(|list| list.len() > 3), Some(true), "{told}");
}

/// A row of the picture for each angle.
#[test]
fn several_turns_make_rows() {
    let folder = Folder::with_sphere();
    let drawn = |options: &str| {
        folder.run(&format!("view sphere.uwm -o s.png --level 2,0 -q {options}")).succeeded();
        picture(&folder.bytes("s.png"))
    };
    let [(_, _, mut above), (_, _, below)] =
        ["--turn 10", "--turn -70"].map(|turn| drawn(&format!("{turn} --size 60x30")));
    above.extend(below);
    assert_eq!(drawn("--turn 10,-70 --size 60x60"), (60, 60, above));
    let told = folder.run("view sphere.uwm -o s.png --turn 0,45,90 --json").json();
    assert_eq!((&told["width"], &told["height"]), (&800.into(), &2400.into()));
}

#[test]
fn every_option_of_view_does_something() {
    let folder = Folder::new();
    let mut mesh = shapes::bumpy_sphere(2, 5);
    mesh.positions.iter_mut().for_each(|p| *p = [p[0], 2.0 * p[1], 3.0 * p[2]]);
    folder.mesh("m.ply", &mesh);
    let drawn = |options: &str| {
        folder.run(&format!("view m.ply -o m.png --size 60x60 -q {options}")).succeeded();
        folder.bytes("m.png")
    };
    let plain = drawn("");
    assert_eq!(plain, drawn("--turn 25 --tilt 20 --up y --background f5f5f3"));
    for options in
        ["--turn -25", "--tilt -20.5", "--up x", "--up z", "--wireframe", "--smooth", "--background #000000"]
    {
        assert_ne!(drawn(options), plain, "{options}");
    }
    let clear = picture(&drawn("--background none")).2;
    assert_eq!(clear[0], [0; 4]);
    assert!(clear.iter().any(|p| p[3] == 255));
}

#[test]
fn by_standard_input_and_output() {
    let folder = Folder::with_sphere();
    for (name, options) in [("sphere.uwm", "--size 50x40 --level 1"), ("sphere.ply", "--size 50x40")] {
        folder.run(&format!("view {name} -o x.png {options}")).succeeded();
        let piped = folder.run_with(&format!("view - -o - {options} -q"), &folder.bytes(name)).succeeded();
        assert_eq!(piped.out, folder.bytes("x.png"));
        let told = folder.run_with(&format!("view - -o - {options}"), &folder.bytes(name));
        assert_eq!((told.code, &told.out), (0, &piped.out));
        assert!(told.err.starts_with("standard input -> standard output\n"), "{}", told.err);
    }
}

#[test]
fn a_picture_with_nothing_in_it() {
    let folder = Folder::new();
    // In the plane z = 0, seen along x.
    // In the plane z = 0, seen along x.
    let mut flat = shapes::annulus(9);
    flat.positions.iter_mut().for_each(|p| p[2] = 0.0);
    folder.mesh("m.ply", &flat);
    let warning = "no triangle has an area as seen from here: the picture is empty";
    let told = folder.run("view m.ply -o m.png --turn 90 --tilt 0 --size 20x20");
    assert_eq!((told.code, told.err), (0, format!("unweld: m.ply: {warning}\n")));
    assert_eq!(covered(&folder.bytes("m.png")), 0);
    let json = folder.run("view m.ply -o m.png --turn 90 --tilt 0 --json").json();
    assert_eq!((&json["warnings"], &json["meshes"][0]["drawn"]), (&serde_json::json!([warning]), &0.into()));
    assert_eq!(json["meshes"][0]["level"], serde_json::Value::Null);
    folder.mesh("point.ply", &IndexedMesh::new(vec![[7.0; 3]; 3], vec![[0, 1, 2]]));
    assert_eq!(folder.run("view point.ply -o m.png -q").succeeded().code, 0);
}

#[test]
fn faults() {
    let folder = Folder::with_sphere();
    let base = levels(&folder.info("sphere.uwm")).len() - 1;
    let range = format!("the levels are 0 (finest) to {base} (base)");
    folder
        .run("view sphere.uwm -o x.png --level 0,99,77")
        .failed(1, &format!("sphere.uwm: there is no level 99: {range}"));
    folder.run("view no.uwm -o x.png").failed(1, "no.uwm: No such file or directory (os error 2)");
    folder.write("bad.uwm", "ply\n");
    folder.run("view bad.uwm -o x.png").failed(1, "bad.uwm: byte 0: not a .uwm file (spec §3.2)");
    folder.write("empty.ply", "");
    folder.run("view empty.ply -o x.png").failed(1, "empty.ply: the file is empty");
    let few = folder.run("view sphere.uwm -o x.png --max-memory 1K");
    assert!(few.err.ends_with("(--max-memory allows more)\n"), "{}", few.err);
    let few = folder.run_with("view - -o x.png --max-memory 1K", &folder.bytes("sphere.uwm"));
    assert!(few.err.ends_with("(--max-memory allows more)\n"), "{}", few.err);
    // The first bytes have the coarse levels, whatever is missing behind them.
    folder.write("early.uwm", &folder.bytes("sphere.uwm")[..2000]);
    assert_eq!(folder.run("view early.uwm -o x.png --level 0").code, 1);
    assert!(!folder.path("x.png").exists());
    folder.run(&format!("view early.uwm -o early.png --level {base}")).succeeded();
    for arguments in [
        "view -",
        "view sphere.ply -o x.jpg",
        "view sphere.ply -o x",
        "view sphere.ply -o x.png --level 0",
        "view sphere.uwm -o x.png --level one",
        "view sphere.uwm -o x.png --size 0x9",
        "view sphere.uwm -o x.png --size 9x9999",
        "view sphere.uwm -o x.png --turn nan",
        "view sphere.uwm -o x.png --up w",
        "view sphere.uwm -o x.png --background white",
        "view sphere.uwm -o - --json",
    ] {
        let run = folder.run(arguments);
        assert_eq!((run.code, run.out.len()), (2, 0), "{arguments}: {}", run.err);
    }
    let run = folder.run("view sphere.ply -o x.png --level 0");
    assert!(run.err.contains("sphere.ply has no levels: --level is for .uwm files"), "{}", run.err);
    assert!(!folder.list().iter().any(|name| name.starts_with('x')));
}

#[test]
fn without_a_name_the_picture_stands_beside_its_mesh() {
    let folder = Folder::with_sphere();
    std::fs::create_dir(folder.path("in")).unwrap();
    folder.write("in/a.uwm", folder.bytes("sphere.uwm"));
    let run = folder.run("view in/a.uwm --size 40x30").succeeded();
    assert!(run.text().starts_with("in/a.uwm -> in/a.uwm.png\n"), "{}", run.text());
    folder.run("view in/a.uwm -o a.png --size 40x30 -q").succeeded();
    assert_eq!(folder.bytes("in/a.uwm.png"), folder.bytes("a.png"));
    // Our own picture may be drawn anew, nobody else's: not even one in the same format.
    let told = folder.run("view in/a.uwm --level 2 --size 50x30 --json").json();
    assert_eq!((&told["output"], &told["width"]), (&"in/a.uwm.png".into(), &50.into()));
    let mut theirs = Vec::new();
    let mut encoder = png::Encoder::new(&mut theirs, 1, 1);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.write_header().unwrap().write_image_data(&[7]).unwrap();
    for theirs in [&theirs[..], b"", b"my thesis"] {
        folder.write("in/a.uwm.png", theirs);
        folder.run("view in/a.uwm").refused("in/a.uwm.png is there, and none of our pictures");
        assert_eq!(folder.bytes("in/a.uwm.png"), theirs);
    }
    folder.run("view in/a.uwm --force -q").succeeded();
    assert_eq!(picture(&folder.bytes("in/a.uwm.png")).0, 800);
    // A name that is given is meant.
    folder.write("b.png", "old");
    folder.run("view in/a.uwm -o b.png -q").succeeded();
    folder.run("view no.uwm").failed(1, "no.uwm: No such file or directory (os error 2)");
    folder.run_with("view -", &folder.bytes("sphere.uwm")).refused("name one with -o");
}
