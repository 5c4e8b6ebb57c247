//! The memory limit holds: for each kind of payload, and for what goes beside them.

use super::{BESIDE, alone, files, peak_of};
use unweld::codec::grid::Real;
use unweld::container::{AtomKind, FileBuilder, Metadata, parse_contents, plan_from_keyframe};
use unweld::decoder::{Decoder, Options as Wanted, decode};
use unweld::encoder::{Encoder, Keyframes, Options, Preview};
use unweld::limits::Limits;
use unweld::mesh::attributes::{Attribute, Semantic, Values};
use unweld::mesh::topology::Weld;
use unweld::mesh::{IndexedMesh, shapes};
use unweld::{Error, Result};

fn within(memory: u64) -> Wanted {
    Wanted { limits: Limits { memory, ..Limits::default() }, ..Wanted::default() }
}

/// Decodes with ever less memory; with the least that will do, no more is held than that and [`BESIDE`].
fn just_enough(name: &str, file: &[u8], run: impl Fn(Wanted) -> Result<()>) {
    let (mut too_little, mut enough) = (0, 1 << 30);
    run(within(enough)).unwrap_or_else(|e| panic!("{name}: {e}"));
    while enough - too_little > 1 {
        let middle = (too_little + enough) / 2;
        match run(within(middle)) {
            Ok(()) => enough = middle,
            Err(Error::Limit { what: "memory in bytes", .. }) => too_little = middle,
            Err(other) => panic!("{name}: {other}"),
        }
    }
    let (outcome, peak) = peak_of(|| run(within(enough)));
    outcome.unwrap_or_else(|e| panic!("{name}: {e}"));
    let allowed = enough + BESIDE + file.len() as u64;
    assert!(peak <= allowed, "{name}: {peak} bytes held, {enough} debited");
    // The budget means something: it is no many times what is held.
    assert!(enough <= 4 * peak, "{name}: {enough} bytes debited, {peak} held");
    let (outcome, peak) = peak_of(|| run(within(enough - 1)));
    assert!(matches!(outcome, Err(Error::Limit { what: "memory in bytes", .. })), "{name}: {outcome:?}");
    assert!(peak <= allowed, "{name}: {peak} bytes held before it was refused");
}

fn whole(file: &[u8]) -> impl Fn(Wanted) -> Result<()> + '_ {
    |wanted| decode(file, wanted).map(drop)
}

/// As the command and the page do: every event is looked at.
fn event_by_event(file: &[u8]) -> impl Fn(Wanted) -> Result<()> + '_ {
    |wanted| {
        let mut decoder = Decoder::new(wanted);
        decoder.push(file);
        while decoder.poll()?.is_some() {}
        decoder.finish()
    }
}

fn encoded(mesh: &IndexedMesh, options: Options) -> Vec<u8> {
    Encoder::new(options).encode_to_vec(mesh).unwrap()
}

/// No simplification: the base is level 0.
fn flat() -> Options {
    let mut options = Options::default();
    options.simplify.base_vertices = Some(usize::MAX);
    options
}

#[test]
fn a_base() {
    let _turn = alone();
    let file = encoded(&shapes::torus(100, 200), flat());
    just_enough("closed", &file, whole(&file));
    let file = encoded(&shapes::grid(150, 150), flat());
    just_enough("open", &file, whole(&file));
    let file = encoded(&files::pieces(20_000), flat());
    just_enough("pieces", &file, whole(&file));
}

#[test]
fn refinements() {
    let _turn = alone();
    let file = encoded(&shapes::torus(100, 200), Options::default());
    just_enough("silent", &file, whole(&file));
    just_enough("told", &file, event_by_event(&file));
    let file = encoded(&shapes::grid(150, 150), Options::default());
    just_enough("open", &file, event_by_event(&file));
    just_enough("flips", &file, |wanted| event_by_event(&file)(Wanted { flips: true, ..wanted }));
}

#[test]
fn precision_passes() {
    let _turn = alone();
    let preview = Preview::Schedule(vec![2, 6]);
    let file = encoded(&shapes::torus(100, 200), Options { preview, ..Options::default() });
    just_enough("precision", &file, event_by_event(&file));
}

#[test]
fn a_keyframe_of_level_0() {
    let _turn = alone();
    let file = encoded(&shapes::torus(100, 200), Options { keyframes: Keyframes::All, ..Options::default() });
    let contents = parse_contents(&file).unwrap().unwrap();
    let plan = plan_from_keyframe(&contents, 0);
    just_enough("keyframe", &file, |wanted| {
        let mut decoder = Decoder::of_plan(contents.clone(), &plan, wanted);
        for part in &plan.parts {
            decoder.push(&file[part.bytes.start as usize..part.bytes.end as usize]);
        }
        while decoder.poll()?.is_some() {}
        decoder.finish()
    });
}

#[test]
fn groups_of_a_residue() {
    let _turn = alone();
    let base = files::mesh(&shapes::grid(200, 200));
    let file = files::with_residue(&base, &files::groups_of_one(&base));
    assert!(file.len() < base.positions.len(), "{} bytes", file.len());
    just_enough("groups", &file, whole(&file));
}

/// Triangles by threes on one edge, vertices in no triangle, some of them far away.
fn odd() -> IndexedMesh {
    let mut mesh = shapes::grid(60, 60);
    for k in 0..10_000 {
        let (n, x) = (mesh.positions.len() as u32, f64::from(k));
        mesh.positions.extend([[x, 0.0, 0.5], [x, 1.0, 0.5], [x, 0.5, 1.0], [x, 0.5, 2.0], [x, 0.5, 3.0]]);
        mesh.triangles.extend([[n, n + 1, n + 2], [n, n + 1, n + 3], [n, n + 1, n + 4]]);
        mesh.positions.push([x * 1e3, -x, x]);
    }
    mesh
}

#[test]
fn residue_correction_and_order() {
    let _turn = alone();
    let options = |exact, keep_order| Options { exact, keep_order, ..flat() };
    let file = encoded(&odd(), options(None, false));
    just_enough("residue", &file, whole(&file));
    let file = encoded(&odd(), options(Some(Real::Binary64), false));
    just_enough("correction", &file, whole(&file));
    let file = encoded(&odd(), options(None, true));
    just_enough("order", &file, whole(&file));
    // Each triangle has its own three vertices in the input, and shares them in the whole.
    let mut soup = IndexedMesh::default();
    let torus = shapes::torus(60, 80);
    for triangle in &torus.triangles {
        let n = soup.positions.len() as u32;
        soup.positions.extend(triangle.map(|v| torus.positions[v as usize]));
        soup.triangles.push([n, n + 1, n + 2]);
    }
    let file = encoded(&soup, Options { weld: Weld::Exact, ..options(Some(Real::Binary64), true) });
    just_enough("instances", &file, whole(&file));
}

#[test]
fn metadata() {
    let _turn = alone();
    let file = encoded(&shapes::tetrahedron(), Options::default());
    let contents = parse_contents(&file).unwrap().unwrap();
    let mut other =
        FileBuilder::new(contents.header.lattice, contents.header.maximum, contents.levels.clone());
    let base = &contents.atoms[0];
    other.payload(AtomKind::Base, 0, &file[base.offset as usize..base.end() as usize]);
    let dropped = vec![String::new(); 30_000];
    other.payload(AtomKind::Metadata, 0, &Metadata { dropped, ..Metadata::default() }.encode().unwrap());
    let mut file = Vec::new();
    other.write(&mut file).unwrap();
    just_enough("metadata", &file, whole(&file));
}

#[test]
fn the_undo_log() {
    let _turn = alone();
    let down = |file: &[u8], wanted: Wanted| {
        let mut decoder = decode(file, Wanted { undo: true, ..wanted })?;
        while decoder.coarsen()?.is_some() {}
        while decoder.restore()?.is_some() {}
        Ok(())
    };
    let file = encoded(&shapes::torus(100, 200), Options::default());
    just_enough("operations", &file, |wanted| down(&file, wanted));
    // Each level adds one triangle, and has 20,000 root edges.
    let base = files::mesh(&files::pieces(20_000));
    let file = files::with_levels(base, 60, |_| files::OneEar::default());
    assert!(file.len() < 60_000, "{} bytes", file.len());
    just_enough("roots", &file, |wanted| down(&file, wanted));
}

#[test]
fn an_assembled_mesh() {
    let _turn = alone();
    let file = encoded(&odd(), Options { exact: Some(Real::Binary64), keep_order: true, ..flat() });
    just_enough("assembled", &file, |wanted| decode(&file, wanted)?.assembled().map(drop));
    let file = encoded(&shapes::torus(100, 200), Options::default());
    just_enough("assembled from a plain file", &file, |wanted| decode(&file, wanted)?.assembled().map(drop));
}

/// Models of attributes take memory by themselves: those of colours remember what stood behind what.
#[test]
fn models_of_attributes() {
    let _turn = alone();
    let mut mesh = shapes::grid(12, 12);
    let corners: Vec<u32> = mesh.triangles.as_flattened().to_vec();
    for k in 0..24 {
        let number = |n: u32| (n.wrapping_mul(2_654_435_761 + 2 * k) >> 24) as u8;
        let values = Values::U8((0..4 * mesh.positions.len() as u32).map(number).collect());
        let name = format!("c{k}");
        mesh.attributes
            .push(Attribute { name, ..Attribute::new(Semantic::Color, 4, values, corners.clone()) });
    }
    let mut coarse = Options::default();
    coarse.simplify.base_vertices = Some(10);
    for (name, options) in [("whole", flat()), ("refined", coarse)] {
        let file = encoded(&mesh, options);
        just_enough(name, &file, whole(&file));
    }
}
