//! `unweld simplify --bake`.

use super::Folder;
use unweld::formats::{ReadOptions, read_painted};
use unweld::mesh::shapes;

/// A triangle with a picture that lies beside it.
const TRIANGLE: &str =
    "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl red\nf 1/1 2/2 3/3\n";

#[test]
fn all_formats_show_the_same_and_name_their_map() {
    let folder = Folder::new();
    folder.write("s.glb", unweld::formats::sample_scene(0.1));
    let mut pictures = Vec::new();
    for end in ["obj", "ply", "glb", "gltf"] {
        let command = format!("simplify s.glb -o t.{end} --ratio 30% --bake m.png --texels 256K --json");
        let json = folder.run(&command).json();
        let texture = &json["texture"];
        assert_eq!((&texture["width"], &texture["height"]), (&512.into(), &512.into()));
        assert_eq!(texture["output"], "m.png");
        assert!(texture["mean_difference"].as_f64().unwrap() < 12.0, "{texture}");
        assert_eq!(texture["material"], if end == "obj" { "t.mtl".into() } else { serde_json::Value::Null });
        let mut options = ReadOptions::default();
        options.folder = Some(folder.path(""));
        let (_, paint) = read_painted(&folder.bytes(&format!("t.{end}")), &options).unwrap();
        assert_eq!((paint.images.len(), paint.missing.len()), (1, 0));
        folder.run(&format!("view t.{end} -o {end}.png --size 120x90 -q")).succeeded();
        pictures.push(folder.bytes(&format!("{end}.png")));
    }
    assert!(pictures.iter().all(|picture| *picture == pictures[0]));
    folder.run("view s.glb -o s.png --size 120x90 --plain -q").succeeded();
    assert_ne!(folder.bytes("s.png"), pictures[0]);
    // A map is no input of its own mesh; it may be replaced.
    assert_eq!(
        folder.list(),
        [
            "glb.png", "gltf.png", "m.png", "obj.png", "ply.png", "s.glb", "s.png", "t.bin", "t.glb",
            "t.gltf", "t.mtl", "t.obj", "t.ply"
        ]
    );
}

#[test]
fn what_cannot_be_baked_leaves_no_file() {
    let folder = Folder::new();
    folder.mesh("bare.ply", &shapes::sphere(1));
    folder.write("a.obj", TRIANGLE);
    folder.write("a.mtl", "newmtl red\nmap_Kd gone.png\n");
    std::fs::create_dir(folder.path("below")).unwrap();
    let before = folder.list();
    let run = |command: &str| folder.run(&format!("simplify {command} --triangles 1000"));
    run("bare.ply -o x.obj --bake m.png")
        .failed(1, "bare.ply: --bake: there is nothing to bake: the original has no colours and no texture");
    let gone = run("a.obj -o x.obj --bake m.png");
    assert!(
        gone.err.contains("image gone.png is not shown: ") && gone.err.contains("--texture"),
        "{}",
        gone.err
    );
    assert_eq!(gone.code, 1);
    for (command, words) in [
        ("a.obj -o below/x.obj --bake m.png", "m.png: the map must lie in the folder of OUT or below it"),
        ("a.obj -o x.stl --bake m.png", "texture coordinates"),
        ("a.obj -o x.obj --bake m.jpg", "must end in .png"),
        ("a.obj -o - --bake m.png", "a file for OUT"),
        ("a.obj -o x.obj --texels 1M", "--bake"),
        ("a.obj -o x.obj --bake m.png --texels x", "512K"),
    ] {
        let run = run(command);
        assert_eq!(run.code, 2, "{command}: {}", run.err);
        assert!(run.err.contains(words), "{command}: {}", run.err);
    }
    assert_eq!(folder.list(), before);

    // Nothing is written over what the input is made of.
    folder.run("view bare.ply -o gone.png --size 9x9 -q").succeeded();
    let picture = folder.bytes("gone.png");
    let lost = run("a.obj -o x.obj --bake gone.png");
    assert!(lost.code == 2 && lost.err.contains("gone.png, which would be lost"), "{}", lost.err);
    run("a.obj -o a.ply --bake m.png --texels 16")
        .failed(1, "a.obj: --bake: 16 texels are too few: a map of 1 triangles takes 64 texels at least");
    assert_eq!(run("bare.ply -o a.obj --bake gone.png --texture gone.png").code, 2);
    assert_eq!(folder.bytes("gone.png"), picture);
    run("a.obj -o x.obj --bake below/m.png --texels 64 -q").succeeded();
    assert!(String::from_utf8(folder.bytes("x.mtl")).unwrap().contains("map_Kd below/m.png\n"));
}
