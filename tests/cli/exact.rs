//! `encode --exact` and `--keep-order`, and what the other commands make of such files.

use super::{Folder, triangles};
use unweld::container::parse_contents;
use unweld::formats::{Precision, write_ply};
use unweld::mesh::{IndexedMesh, shapes};

/// A sphere of binary32 coordinates, some vertices of it twice, one alone, zeros of both signs; in an order of its own.
fn mesh() -> IndexedMesh {
    let mut mesh = shapes::bumpy_sphere(3, 1);
    for x in mesh.positions.iter_mut().flatten() {
        *x = f64::from((*x * 1000.0).round() as f32 / 1000.0);
    }
    mesh.positions[7] = [0.0, -0.0, 1.5];
    let n = mesh.positions.len() as u32;
    mesh.positions.extend([[-0.0, 0.0, 1.5], mesh.positions[9], [40.0, 0.1f32.into(), -0.0]]);
    for v in mesh.triangles.iter_mut().flatten().filter(|v| **v == 7).step_by(2) {
        *v = n;
    }
    mesh.triangles.push([n + 1, 9, 3]);
    mesh.triangles.reverse();
    mesh
}

fn ply(mesh: &IndexedMesh, precision: Precision) -> Vec<u8> {
    let mut bytes = Vec::new();
    write_ply(mesh, precision, &mut bytes).unwrap();
    bytes
}

fn next_up(x: &mut f64) {
    *x = f64::from((*x as f32).next_up());
}

#[test]
fn the_same_file_comes_back() {
    let folder = Folder::new();
    for precision in [Precision::Float32, Precision::Float64] {
        folder.write("in.ply", ply(&mesh(), precision));
        folder.run("encode in.ply -o all.uwm --exact --keep-order --keyframes every:4 -q").succeeded();
        let run = folder.run("decode all.uwm -o out.ply").succeeded();
        assert!(
            run.text().contains("everything there is, bit for bit; error on the lattice at most"),
            "{}",
            run.text()
        );
        assert!(folder.bytes("out.ply") == folder.bytes("in.ply"), "{precision:?}");
        folder.run("decode all.uwm -o via.ply --via keyframe -q").succeeded();
        assert!(folder.bytes("via.ply") == folder.bytes("in.ply"), "{precision:?}");
        folder.run("decode all.uwm -o out.obj -q").succeeded();
        folder.run("verify all.uwm out.obj").succeeded();
        let back = folder.read("out.obj");
        // Decimals of binary32 are read as that.
        let number = |x: f64| if precision == Precision::Float32 { f64::from(x as f32) } else { x };
        let bits = |mesh: &IndexedMesh| -> Vec<_> {
            mesh.positions.iter().map(|p| p.map(|x| number(x).to_bits())).collect()
        };
        assert_eq!((bits(&back), &back.triangles), (bits(&mesh()), &mesh().triangles));
    }
}

#[test]
fn info_tells_it() {
    let folder = Folder::new();
    folder.write("in.ply", ply(&mesh(), Precision::Float32));
    folder.run("encode in.ply -o plain.uwm -q").succeeded();
    folder.run("encode in.ply -o exact.uwm --exact -q").succeeded();
    let encoded = folder.run("encode in.ply -o all.uwm --exact --keep-order --json").json();
    let told = |name: &str| {
        let info = folder.info(name);
        let bytes = |part: &str| info[part]["bytes"].as_u64().unwrap();
        let settings = info["input"]["settings"].to_string();
        (info["exact"].clone(), info["keep_order"].clone(), bytes("correction"), bytes("order"), settings)
    };
    let (exact, keep_order, correction, order, settings) = told("plain.uwm");
    assert_eq!(
        (exact, keep_order, correction, order, settings.as_str()),
        (false.into(), false.into(), 0, 0, "{}")
    );
    let (exact, keep_order, correction, order, settings) = told("exact.uwm");
    assert_eq!(
        (exact, keep_order, order, settings.as_str()),
        (true.into(), false.into(), 0, "{\"exact\":\"true\"}")
    );
    assert!(correction > 0);
    let (exact, keep_order, correction, order, _) = told("all.uwm");
    assert_eq!((exact, keep_order), (true.into(), true.into()));
    assert_eq!(encoded["bits"]["correction"], correction as f64 * 8.0);
    assert_eq!(encoded["bits"]["order"], order as f64 * 8.0);
    // The input's vertices; welded, without the repeated one, but with the copy of other zeros.
    let vertices = mesh().positions.len();
    for (name, count) in [("all.uwm", vertices), ("exact.uwm", vertices - 1), ("plain.uwm", vertices - 2)] {
        assert_eq!(folder.info(name)["vertices"], count, "{name}");
        folder.run(&format!("decode {name} -o out.ply -q")).succeeded();
        assert_eq!(folder.read("out.ply").positions.len(), count, "{name}");
    }
    let text = folder.run("info all.uwm").succeeded().text().to_owned();
    assert!(text.contains("  exact      level 0 has the input's coordinates as binary32 ("), "{text}");
    assert!(text.contains("  order      that of the input's vertices and triangles ("), "{text}");
}

#[test]
fn verify_looks_at_every_bit() {
    let folder = Folder::new();
    folder.write("in.ply", ply(&mesh(), Precision::Float32));
    for (name, options) in
        [("exact.uwm", "--exact"), ("order.uwm", "--keep-order"), ("all.uwm", "--exact --keep-order")]
    {
        folder.run(&format!("encode in.ply -o {name} {options} --keyframes all -q")).succeeded();
    }
    let says = |name: &str, words: &str| {
        let run = folder.run(&format!("verify {name} in.ply")).succeeded();
        assert!(run.text().contains(words), "{words}: {}", run.text());
    };
    says("exact.uwm", "in.ply: the same 1,281 triangles, bit for bit");
    says(
        "order.uwm",
        "in.ply: the same 645 vertices and 1,281 triangles, in the same order, to the lattice of 14 bits",
    );
    says("all.uwm", "in.ply: the same 645 vertices and 1,281 triangles, in the same order, bit for bit");

    let refuses = |change: fn(&mut IndexedMesh), name: &str, start: &str| {
        let mut other = mesh();
        change(&mut other);
        folder.write("other.ply", ply(&other, Precision::Float32));
        let run = folder.run(&format!("verify {name} other.ply"));
        assert_eq!(run.code, 1);
        assert!(run.err.starts_with(&format!("unweld: {name}: not other.ply: {start}")), "{}", run.err);
    };
    refuses(|mesh| next_up(&mut mesh.positions[20][1]), "exact.uwm", "6 triangles missing, 6 extra");
    refuses(|mesh| next_up(&mut mesh.positions[20][1]), "all.uwm", "vertex 20 is at [");
    // Vertex 7 is one of the icosahedron, of five triangles; three of them have the copy.
    refuses(
        |mesh| mesh.positions[7][0] = -0.0,
        "all.uwm",
        "vertex 7 is at [0.0, -0.0, 1.5], not [-0.0, -0.0, 1.5]",
    );
    refuses(|mesh| mesh.positions[7][0] = -0.0, "exact.uwm", "2 triangles missing, 2 extra");
    refuses(|mesh| next_up(&mut mesh.positions[644][0]), "exact.uwm", "there is no vertex at (40.");
    refuses(|mesh| mesh.triangles[4].rotate_left(1), "order.uwm", "triangle 4 is [");
    refuses(|mesh| mesh.triangles.swap(4, 5), "all.uwm", "triangle 4 is [");
    refuses(
        |mesh| mesh.positions.truncate(644),
        "order.uwm",
        "645 vertices and 1,281 triangles, not 644 vertices",
    );
}

#[test]
fn coarser_levels_and_prefixes_are_as_without() {
    let folder = Folder::new();
    folder.write("in.ply", ply(&mesh(), Precision::Float32));
    folder.run("encode in.ply -o plain.uwm -q").succeeded();
    folder.run("encode in.ply -o all.uwm --exact --keep-order -q").succeeded();
    for quality in ["--level 1", "--triangles 700", "--operations 50"] {
        for name in ["plain", "all"] {
            folder.run(&format!("decode {name}.uwm -o {name}.ply -q {quality}")).succeeded();
        }
        assert!(folder.bytes("plain.ply") == folder.bytes("all.ply"), "{quality}");
    }
    let info = folder.info("all.uwm");
    let level_0 = info["levels"].as_array().unwrap().last().unwrap()["cumulative_bytes"].as_u64().unwrap();
    let residue = info["residue"]["bytes"].as_u64().unwrap();
    let run = folder.run(&format!("decode all.uwm -o all.ply --max-bytes {}", level_0 + residue)).succeeded();
    assert!(
        run.text().contains("level 0 of") && run.text().contains("without the correction"),
        "{}",
        run.text()
    );
    folder.run("decode plain.uwm -o plain.ply -q").succeeded();
    assert_eq!(triangles(&folder.read("all.ply")), triangles(&folder.read("plain.ply")));
}

#[test]
fn info_decodes_nothing_it_need_not() {
    let folder = Folder::new();
    folder.write("in.ply", ply(&mesh(), Precision::Float32));
    folder.run("encode in.ply -o all.uwm --exact --keep-order -q").succeeded();
    let mut file = folder.bytes("all.uwm");
    let contents = parse_contents(&file).unwrap().unwrap();
    assert!(!contents.residue().is_empty(), "it takes the mesh to count what the residue holds");
    for atoms in [contents.correction(), contents.order()] {
        file[contents.bytes(atoms).start as usize] ^= 1;
    }
    folder.write("damaged.uwm", file);
    let whole = folder.run("info all.uwm").succeeded();
    let damaged = folder.run("info damaged.uwm").succeeded();
    assert_eq!(damaged.text().replace("damaged", "all"), whole.text());
    assert_eq!(folder.run("decode damaged.uwm -o out.ply").code, 1);
}
