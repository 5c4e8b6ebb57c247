//! The bytes of format version 1: see `tests/golden/README.md`.

use std::path::PathBuf;

use unweld::codec::grid::Real;
use unweld::container::ResourceKind;
use unweld::encoder::{AttributeBirth, Encoder, Keyframes, Options, Place, Preview, Resource};
use unweld::mesh::attributes::{Attribute, Domain, NO_VALUE, Semantic, Values};
use unweld::mesh::topology::Weld;
use unweld::mesh::{IndexedMesh, shapes};
use unweld::simplify::Method;

use super::agree::{agree, by_crate, sorted};
use super::by_hand;
use super::container::{BIRTH, CORRECTION, File, KEYFRAME, METADATA, ORDER, REFINEMENT, RESIDUE};
use super::draft::Draft;
use super::on_shapes::same_triangles;
use super::residue::Whole;
use super::resources::Resource as Beside;

pub fn load(name: &str) -> Vec<u8> {
    std::fs::read(path(name)).expect("the golden files are part of the repository")
}

pub fn path(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/golden").join(name)
}

/// What the encoder wrote, with what it wrote it from.
fn vectors() -> Vec<(&'static str, IndexedMesh, Options)> {
    let small = |bits, base, seed| {
        let mut options = Options {
            position_bits: bits,
            atom_bytes: 60,
            preview: Preview::Off,
            rich_models: Some(false),
            ..Options::default()
        };
        options.simplify.base_vertices = Some(base);
        options.simplify.seed = seed;
        // Many levels of a small mesh.
        options.simplify.level_share = 0.2;
        options
    };
    let mut torus = snapped(shapes::torus_with_hole(8, 7));
    let first = torus.triangles[0];
    torus.triangles.extend([first, [first[0], first[1], first[1]]]);
    torus.positions.extend([[9.0, 9.0, 9.0], [0.0, 8.0, 0.0], [1.0, 8.0, 0.5]]);
    // A bow-tie: a triangle that shares one vertex.
    torus.triangles.push([30, 57, 58]);
    // Decimals in binary32, zeros of both signs at one place, a vertex that is there twice and one that is alone.
    let mut disc = decimal(shapes::disc_with_ears());
    let v = disc.triangles[3][1];
    let y = disc.positions[v as usize][1];
    let n = disc.positions.len() as u32;
    disc.positions[v as usize] = [0.0, y, -0.0];
    let twice = disc.positions[disc.triangles[0][0] as usize];
    disc.positions.extend([[-0.0, y, 0.0], twice, [-3.5, -0.0, f64::from(1e-40f32)]]);
    for corner in disc.triangles.iter_mut().flatten().filter(|w| **w == v).step_by(2) {
        *corner = n;
    }
    disc.triangles[0][0] = n + 1;
    disc.triangles.rotate_left(5);
    // Corners that are a little, and in part nearly a lattice step, away from where their vertex is.
    let mut loose = snapped(shapes::torus(6, 5));
    for (k, t) in loose.triangles.iter_mut().enumerate().filter(|(k, _)| k % 3 == 0) {
        let mut p = loose.positions[t[k % 2] as usize];
        p[k % 3] += if k % 2 == 0 { 2f64.powi(-40) } else { 2f64.powi(-9) };
        t[k % 2] = loose.positions.len() as u32;
        loose.positions.push(p);
    }
    let mut sphere = Options { preview: Preview::Schedule(vec![1, 2, 5]), ..small(12, 6, 2) };
    sphere.simplify.method = Method::Ffc;
    vec![
        ("tetrahedron.uwm", snapped(shapes::tetrahedron()), Options::default()),
        ("disc.uwm", snapped(shapes::disc_with_ears()), Options { atom_bytes: 1, ..small(10, 4, 1) }),
        (
            "torus.uwm",
            torus,
            Options { keyframes: Keyframes::Every(4), rich_models: Some(true), ..small(10, 12, 3) },
        ),
        ("sphere.uwm", snapped(shapes::sphere(1)), Options { keyframes: Keyframes::Every(3), ..sphere }),
        ("exact.uwm", disc.clone(), Options { exact: Some(Real::Binary32), ..small(9, 4, 4) }),
        (
            "joined.uwm",
            loose,
            Options { exact: Some(Real::Binary64), weld: Weld::Within(0.01), ..small(9, 6, 6) },
        ),
        (
            "births.uwm",
            snapped(components()),
            Options {
                keyframes: Keyframes::Every(2),
                preview: Preview::Schedule(vec![0, 1, 2]),
                ..small(10, 8, 7)
            },
        ),
        (
            "order.uwm",
            disc,
            Options {
                exact: Some(Real::Binary64),
                keep_order: true,
                keyframes: Keyframes::Every(3),
                ..small(8, 4, 5)
            },
        ),
        (
            "values.uwm",
            painted(),
            Options { keyframes: Keyframes::Every(4), attribute_births: kept(), ..small(10, 6, 8) },
        ),
        (
            "exact_values.uwm",
            painted(),
            Options {
                attribute_births: kept(),
                exact: Some(Real::Binary32),
                keep_order: true,
                ..small(10, 6, 8)
            },
        ),
        ("constants.uwm", washed(), small(10, 6, 9)),
        ("born_values.uwm", dressed(), Options { keyframes: Keyframes::Every(3), ..small(10, 8, 9) }),
        (
            "scene.uwm",
            snapped(shapes::sphere(1)),
            Options { keyframes: Keyframes::Every(4), ..small(10, 6, 10) },
        ),
    ]
}

/// What stands beside the mesh in one of them: a scene, samples, a small picture and a large one, as far as anybody can see.
fn resources(name: &str) -> Vec<Resource> {
    if name != "scene.uwm" {
        return vec![];
    }
    let buffer = |place, bytes: std::ops::Range<u16>| Resource {
        kind: ResourceKind::Buffer,
        place,
        bytes: bytes.flat_map(u16::to_le_bytes).collect(),
    };
    vec![
        Resource { kind: ResourceKind::Scene, place: Place::Base, bytes: SCENE.to_vec() },
        buffer(Place::Base, 0..10),
        buffer(Place::Error(0.25), 100..130),
        buffer(Place::Finest, 1000..1300),
    ]
}

/// Its scene.
const SCENE: &[u8] = br#"{"asset":{"version":"2.0"},"scenes":[{"nodes":[0,1,2]}],"nodes":[{"mesh":0},{"mesh":0,"translation":[2,0,0]},
{"mesh":0,"translation":[4,0,0]}],"meshes":[{"primitives":[{"attributes":{}}]}],"buffers":[{"byteLength":20},{"byteLength":60},{"byteLength":600}]}"#;

/// Charts are kept down to the base, and parts come last.
fn kept() -> Vec<(String, AttributeBirth)> {
    vec![("uv".into(), AttributeBirth::Base), ("part".into(), AttributeBirth::Finest)]
}

/// The same shape with attributes of one value each.
fn washed() -> IndexedMesh {
    let mut mesh = painted();
    let n = mesh.triangles.len();
    let of = |semantic, components, values| Attribute::new(semantic, components, values, vec![0; 3 * n]);
    mesh.attributes = vec![
        Attribute { normalised: true, ..of(Semantic::Color, 4, Values::U8(vec![255; 4])) },
        of(Semantic::TexCoord, 2, Values::F32(vec![0.5, -0.75])),
        of(Semantic::Normal, 3, Values::F32(vec![0.6, 0.0, 0.8])),
        of(Semantic::Weights, 4, Values::F32(vec![0.1, 0.2, 0.3, 0.4])),
        of(Semantic::Generic, 1, Values::F64(vec![f64::NEG_INFINITY])),
        Attribute::parts(&vec![7; n]),
    ];
    mesh
}

/// A ball and a triangle that it has twice: texture coordinates with a seam, normals, colours at corners, a part for each triangle, and
/// a number that not all corners have.
pub fn painted() -> IndexedMesh {
    let mut mesh = snapped(shapes::sphere(1));
    mesh.triangles.push(mesh.triangles[4]);
    let (mut uv, mut normals, mut colours, mut numbers) = (vec![], vec![], vec![], vec![]);
    for t in &mesh.triangles {
        let middle: f64 = t.iter().map(|&v| mesh.positions[v as usize][0]).sum();
        for &v in t {
            let p = mesh.positions[v as usize];
            // Two charts, one for each half.
            uv.extend([(p[1] + if middle < 0.0 { 3.0 } else { 0.0 }) as f32, p[2] as f32]);
            let length = (p[0] * p[0] + p[1] * p[1] + p[2] * p[2]).sqrt();
            normals.extend(p.map(|x| (x / length) as f32));
            colours.extend(p.map(|x| (128.0 + 100.0 * x) as u8));
            numbers.push((p[0] * 7.0) as i16);
        }
    }
    let corners: Vec<u32> = (0..3 * mesh.triangles.len() as u32).collect();
    let partly = corners.iter().map(|&c| if c % 40 < 9 { NO_VALUE } else { c }).collect();
    mesh.attributes = vec![
        Attribute::new(Semantic::TexCoord, 2, Values::F32(uv), corners.clone()),
        Attribute::new(Semantic::Normal, 3, Values::F32(normals), corners.clone()),
        Attribute { normalised: true, ..Attribute::new(Semantic::Color, 3, Values::U8(colours), corners) },
        Attribute {
            name: "heat".into(),
            ..Attribute::new(Semantic::Generic, 1, Values::I16(numbers), partly)
        },
        Attribute::parts(&(0..mesh.triangles.len() as u32).map(|t| t / 30).collect::<Vec<_>>()),
    ];
    mesh
}

/// Components of many sizes, of which one has a triangle twice: texture coordinates in two charts, colours at corners, a part for each
/// component, and a number of triangles that is another one round one vertex.
fn dressed() -> IndexedMesh {
    let mut mesh = snapped(components());
    mesh.triangles.push(mesh.triangles[4]);
    let (mut uv, mut colours, mut kinds, mut components) = (vec![], vec![], vec![], vec![]);
    let mut last = 0;
    for t in &mesh.triangles {
        let at = t.map(|v| mesh.positions[v as usize]);
        let middle: f64 = at.iter().map(|p| p[0] + p[2]).sum();
        for p in at {
            uv.extend([(p[1] + if middle < 0.5 { 3.0 } else { 0.0 }) as f32, p[2] as f32]);
            colours.extend(p.map(|x| (60.0 + 20.0 * x) as u8));
        }
        kinds.push(u8::from(t.contains(&13)));
        // Components have their vertices one behind the other.
        last += u32::from(t.iter().min() > mesh.triangles[..kinds.len() - 1].iter().flatten().max());
        components.push(last);
    }
    let corners: Vec<u32> = (0..3 * mesh.triangles.len() as u32).collect();
    let kinds =
        Attribute::new(Semantic::Generic, 1, Values::U8(kinds), corners[..mesh.triangles.len()].to_vec());
    mesh.attributes = vec![
        Attribute::new(Semantic::TexCoord, 2, Values::F32(uv), corners.clone()),
        Attribute { normalised: true, ..Attribute::new(Semantic::Color, 3, Values::U8(colours), corners) },
        Attribute { name: "kind".into(), domain: Domain::Triangle, ..kinds },
        Attribute::parts(&components),
    ];
    mesh
}

/// A ball, three tetrahedra, two strips and twelve loose triangles, each apart from the others and of another size.
pub fn components() -> IndexedMesh {
    let triangle = IndexedMesh::new(vec![[0.0; 3], [1.0, 0.25, 0.125], [0.25, 1.0, 0.5]], vec![[0, 1, 2]]);
    let (ball, tetrahedron, strip) = (shapes::sphere(1), shapes::tetrahedron(), shapes::strip(4));
    let parts = [&[ball][..], &vec![tetrahedron; 3], &vec![strip; 2], &vec![triangle; 12]].concat();
    let mut mesh = IndexedMesh::default();
    for (k, part) in parts.iter().enumerate() {
        let (first, size) = (mesh.positions.len() as u32, 2.0 / (1.0 + k as f64));
        let at = [3 * k % 7, 2 * k % 5, k].map(|x| x as f64);
        mesh.positions.extend(part.positions.iter().map(|p| [0, 1, 2].map(|i| at[i] + size * p[i])));
        mesh.triangles.extend(part.triangles.iter().map(|t| t.map(|v| v + first)));
    }
    mesh
}

/// A mesh whose coordinates do not hang on the last bits of sines and cosines.
pub fn snapped(mut mesh: IndexedMesh) -> IndexedMesh {
    for x in mesh.positions.iter_mut().flatten() {
        *x = (*x * 1024.0).round() / 1024.0;
    }
    mesh
}

/// A mesh whose coordinates are the binary32 numbers nearest to decimals.
fn decimal(mut mesh: IndexedMesh) -> IndexedMesh {
    for x in mesh.positions.iter_mut().flatten() {
        *x = f64::from(((*x * 1000.0).round() / 1000.0) as f32);
    }
    mesh
}

/// All but the metadata, which name the version of the program, and what follows from their length.
pub fn essence(bytes: &[u8]) -> Draft {
    let mut draft = Draft::of(bytes);
    draft.atoms.retain(|a| a.kind != METADATA);
    draft
}

#[test]
fn the_encoder_still_writes_these_bytes() {
    let bless = std::env::var_os("UNWELD_BLESS").is_some_and(|value| value == "1");
    for (name, mesh, options) in vectors() {
        let written = Encoder::new(options).resources(resources(name)).encode_to_vec(&mesh).unwrap();
        if bless {
            std::fs::write(path(name), &written).unwrap();
        }
        assert!(essence(&written).bytes() == essence(&load(name)).bytes(), "{name}: other bytes");
    }
    if bless {
        std::fs::write(path("hand.uwm"), by_hand::file().bytes()).unwrap();
    }
}

#[test]
fn both_decoders_read_them() {
    for (name, mesh, _) in vectors() {
        let bytes = load(name);
        let seen = agree(&bytes).unwrap_or_else(|| panic!("{name} is refused"));
        let file = File::read(&bytes).unwrap();
        match file.payload(CORRECTION, 0).is_empty() {
            true => same_triangles(&mesh, &seen.whole, &file),
            false => same_bits(&mesh, &seen.whole, !file.payload(ORDER, 0).is_empty()),
        }
        let beside = resources(name).into_iter().map(|resource| Some(resource.bytes));
        assert!(seen.resources == beside.collect::<Vec<_>>(), "{name}: other resources");
    }
}

/// What is the same everywhere is told once, and known at every corner of every level, of further triangles too.
#[test]
fn constants_are_everywhere() {
    let seen = agree(&load("constants.uwm")).expect("both read it");
    let white = vec![255u64; 4];
    assert!(seen.whole.values.len() == 81 && seen.levels.len() == 12);
    for corner in seen.whole.values.as_flattened() {
        assert!(corner.len() == 6 && corner[0] == Some(white.clone()), "{corner:?}");
        assert_eq!(corner[4], Some(vec![f64::NEG_INFINITY.to_bits()]));
    }
}

/// Asserts that the whole is the mesh, to the last bit; in order, or but for the order and repeated vertices.
pub fn same_bits(mesh: &IndexedMesh, whole: &Whole, in_order: bool) {
    let bits = |positions: &[[f64; 3]]| -> Vec<_> { positions.iter().map(|p| p.map(f64::to_bits)).collect() };
    let (expected, found) = (bits(&mesh.positions), bits(&whole.positions));
    let triangles: Vec<_> = mesh.triangles.iter().map(|t| t.map(|v| v as usize)).collect();
    if in_order {
        assert!((expected, triangles) == (found, whole.triangles.clone()), "the lists are others");
    } else {
        let corners = |positions: &[[u64; 3]], triangles: &[[usize; 3]]| {
            sorted(triangles.iter().map(|t| t.map(|v| positions[v])))
        };
        assert!(corners(&expected, &triangles) == corners(&found, &whole.triangles), "not the same bits");
    }
}

#[test]
fn they_are_what_the_read_me_says() {
    // Levels, keyframes, whether there is a residue, vertices of the base and its shift.
    let figures = |name| {
        let file = File::read(&load(name)).unwrap();
        let count = |kind| (0..file.levels.len()).filter(|&j| !file.atoms_of(kind, j).is_empty()).count();
        let base = file.levels.last().unwrap();
        let residue = !file.payload(RESIDUE, 0).is_empty();
        (file.levels.len(), count(KEYFRAME), residue, base.vertices, base.shift)
    };
    assert_eq!(figures("tetrahedron.uwm"), (1, 0, false, 4, 0));
    assert_eq!(figures("disc.uwm"), (8, 0, false, 4, 0));
    assert_eq!(figures("torus.uwm"), (9, 2, true, 12, 0));
    assert_eq!(figures("sphere.uwm"), (12, 4, false, 6, 5));
    let beyond =
        |name| [CORRECTION, ORDER].map(|kind| !File::read(&load(name)).unwrap().payload(kind, 0).is_empty());
    assert_eq!([beyond("exact.uwm"), beyond("order.uwm")], [[true, false], [true; 2]]);
    // Joined they are one closed surface again: 60 triangles, 30 vertices.
    let joined = File::read(&load("joined.uwm")).unwrap();
    assert_eq!((joined.levels[0].vertices, joined.levels[0].triangles), (30, 60));
    assert_eq!((beyond("joined.uwm"), joined.levels.len()), ([true, false], 9));
    assert_eq!(figures("values.uwm"), (12, 3, true, 6, 0));
    assert_eq!(figures("exact_values.uwm"), (12, 0, true, 6, 0));
    let kinds = |name| {
        let file = File::read(&load(name)).unwrap();
        file.attributes.iter().map(|a| (a.semantic, a.quantisation, a.marks % 8)).collect::<Vec<_>>()
    };
    assert_eq!(kinds("values.uwm"), [(2, 1, 0), (0, 2, 0), (3, 0, 2), (7, 0, 4), (6, 0, 1)]);
    assert_eq!(kinds("exact_values.uwm"), [(2, 3, 0), (0, 3, 0), (3, 0, 2), (7, 0, 4), (6, 0, 1)]);
    let constant = |a: &super::attribute::Attribute| a.constant.is_some();
    let washed = File::read(&load("constants.uwm")).unwrap();
    assert!(washed.attributes.len() == 6 && washed.attributes.iter().all(constant));
    assert!(!washed.payload(RESIDUE, 0).is_empty() && washed.atoms.iter().all(|atom| atom.kind != 8));
    assert_eq!(figures("born_values.uwm"), (12, 4, true, 12, 0));
    let scene = File::read(&load("scene.uwm")).unwrap();
    assert_eq!(figures("scene.uwm"), (12, 3, false, 6, 0));
    let [places, kinds] = [|r: &Beside| r.place, |r: &Beside| r.kind.into()]
        .map(|of: fn(&Beside) -> u64| scene.resources.iter().map(of).collect::<Vec<_>>());
    assert!(places[..2] == [11; 2] && (1..11).contains(&places[2]) && places[3] == 0, "{places:?}");
    assert_eq!(kinds, [0, 1, 1, 1]);
    let births = |name| {
        let file = File::read(&load(name)).unwrap();
        file.attributes.iter().map(|a| a.birth).collect::<Vec<_>>()
    };
    assert_eq!(births("values.uwm"), [11, 11, 11, 11, 0]);
    assert_eq!(births("born_values.uwm"), [11, 11, 1, 11]);
    assert_eq!(figures("hand.uwm"), (2, 0, false, 4, 2));
    let births = File::read(&load("births.uwm")).unwrap();
    let with = (0..births.levels.len()).filter(|&j| !births.atoms_of(BIRTH, j).is_empty()).count();
    let alone = (0..births.levels.len()).filter(|&j| births.atoms_of(REFINEMENT, j).is_empty()).count() - 1;
    assert_eq!((births.levels.len(), with, alone), (8, 3, 0));
    let lifting = |name| File::read(&load(name)).unwrap().lifting;
    assert_eq!(["torus.uwm", "sphere.uwm", "hand.uwm"].map(lifting), [18, 18, 0]);
    let rich = |name| File::read(&load(name)).unwrap().rich_models;
    assert_eq!(["torus.uwm", "sphere.uwm", "hand.uwm"].map(rich), [true, false, false]);
}

#[test]
fn cut_or_lengthened_they_are_refused() {
    let mut bytes = load("disc.uwm");
    for length in 0..bytes.len() {
        assert!(File::read(&bytes[..length]).is_err(), "cut to {length} bytes");
        assert!(by_crate(&bytes[..length], None).is_err(), "cut to {length} bytes");
    }
    for byte in [0, 1, 0xFF] {
        bytes.push(byte);
        assert!(agree(&bytes).is_none());
        bytes.pop();
    }
}

#[test]
fn every_other_byte_is_found_out() {
    let sound = load("hand.uwm");
    let mut bytes = sound.clone();
    for i in 0..bytes.len() {
        for difference in 1..=255 {
            bytes[i] = sound[i] ^ difference;
            // A checksum covers every byte, and finds every change of a single one.
            assert!(by_crate(&bytes, None).is_err(), "byte {i}");
            if difference.is_power_of_two() {
                assert!(File::read(&bytes).is_err(), "byte {i}");
            }
        }
        bytes[i] = sound[i];
    }
}
