//! Components born at a level: meshes of many parts, large and small.
#![cfg(feature = "encode")]

mod common;

use common::triangles;
use proptest::prelude::*;
use unweld::Error;
use unweld::container::{AtomKind, Contents, Want, parse_contents, plan, plan_from_keyframe};
use unweld::decoder::{self, Decoder, Event, Until};
use unweld::encoder::{Encoder, Keyframes, Options, Preview};
use unweld::limits::Limits;
use unweld::mesh::{IndexedMesh, Triangle, shapes};
use unweld::refine::Site;

/// Numbers of 0 to 1 that look like chance.
fn chance(k: usize) -> f64 {
    (k as f64 * 0.618_033_988_749_895 + 0.3).fract()
}

fn add(mesh: &mut IndexedMesh, part: &IndexedMesh, size: f64, k: usize) {
    let at = [chance(k), chance(k * 7 + 3), chance(k * 13 + 5)].map(|x| 20.0 * x);
    let first = mesh.positions.len() as u32;
    mesh.positions.extend(part.positions.iter().map(|p| [0, 1, 2].map(|i| at[i] + size * p[i])));
    mesh.triangles.extend(part.triangles.iter().map(|t| t.map(|v| v + first)));
}

/// So many copies of parts, each of another size.
fn scattered(parts: &[IndexedMesh], count: usize, size: impl Fn(usize) -> f64) -> IndexedMesh {
    let mut mesh = IndexedMesh::default();
    (0..count).for_each(|k| add(&mut mesh, &parts[k % parts.len()], size(k), k));
    mesh
}

fn loose_triangles(count: usize) -> IndexedMesh {
    let triangle = IndexedMesh::new(vec![[0.0; 3], [1.0, 0.2, 0.1], [0.3, 1.0, 0.5]], vec![[0, 1, 2]]);
    scattered(&[triangle], count, |k| 0.1 + 0.9 * chance(k * 3 + 1))
}

/// Spheres, sheets, tubes and loose triangles, from large to tiny.
fn parts(count: usize) -> IndexedMesh {
    let parts = [shapes::bumpy_sphere(2, 5), shapes::grid(2, 1), shapes::torus(6, 9), shapes::annulus(7)];
    scattered(&parts, count, |k| 2.0 * 0.5f64.powf(6.0 * chance(k * 5 + 2)))
}

fn small() -> Options {
    let mut options = Options { keyframes: Keyframes::All, atom_bytes: 100, ..Options::default() };
    options.simplify.base_vertices = Some(30);
    options
}

fn encoded(mesh: &IndexedMesh, options: Options) -> (Vec<u8>, std::sync::Arc<Contents>) {
    let file = Encoder::new(options).encode_to_vec(mesh).unwrap();
    let contents = parse_contents(&file).unwrap().unwrap();
    (file, contents)
}

fn has_births(contents: &Contents) -> bool {
    contents.atoms.iter().any(|atom| atom.kind == AtomKind::Birth)
}

/// 2,000 loose triangles begin as a few, and each level at most doubles them.
#[test]
fn loose_triangles_refine() {
    let mesh = loose_triangles(2000);
    let (file, contents) = encoded(&mesh, Options::default());
    assert!(contents.header.base_triangles <= 60, "{}", contents.header.base_triangles);
    assert!(contents.base_end() < file.len() as u64 / 8);
    for pair in contents.levels.windows(2) {
        assert!(pair[0].triangles <= 2 * pair[1].triangles && pair[0].max_error <= pair[1].max_error);
    }
    let whole = Encoder::new(Options { births: false, ..Options::default() }).encode_to_vec(&mesh).unwrap();
    assert_eq!(parse_contents(&whole).unwrap().unwrap().header.level_count, 1);
    let decoder = decoder::decode(&file, decoder::Options::default()).unwrap();
    let lattice = contents.header.lattice;
    assert_eq!(triangles(&decoder.assembled().unwrap(), &lattice), triangles(&mesh, &lattice));
}

/// What has nothing small loses nothing.
#[test]
fn one_component_is_as_it_was() {
    for mesh in [shapes::bumpy_sphere(3, 1), shapes::torus_with_hole(16, 12)] {
        let [with, without] = [true, false].map(|births| {
            Encoder::new(Options { births, ..Options::default() }).encode_to_vec(&mesh).unwrap()
        });
        assert_eq!(with, without);
    }
}

/// A level's error is as large as any component that it lacks.
#[test]
fn errors_count_what_is_missing() {
    let mesh = parts(60);
    for lifting in [0, 13] {
        let (file, contents) = encoded(&mesh, Options { lifting: Some(lifting), ..small() });
        assert!(has_births(&contents));
        let sizes = |mesh: &IndexedMesh| -> f64 {
            let mut low = [f64::INFINITY; 3];
            let mut high = [-f64::INFINITY; 3];
            for p in mesh.triangles.iter().flatten().map(|&v| mesh.positions[v as usize]) {
                low = [0, 1, 2].map(|k| low[k].min(p[k]));
                high = [0, 1, 2].map(|k| high[k].max(p[k]));
            }
            [0, 1, 2].map(|k| (high[k] - low[k]).powi(2)).iter().sum::<f64>().sqrt()
        };
        // All of level 0's components, by where their vertices are.
        let decoder = decoder::decode(&file, decoder::Options::default()).unwrap();
        let table = &decoder.mesh().table;
        let parts = decoder.mesh().roots.edges().len();
        assert_eq!(parts, 60);
        let mut of = vec![usize::MAX; table.vertex_slots()];
        for (number, &(u, _)) in decoder.mesh().roots.edges().iter().enumerate() {
            let mut queue = vec![u];
            while let Some(v) = queue.pop() {
                if std::mem::replace(&mut of[v.index()], number) != number {
                    queue.extend(table.link(v));
                }
            }
        }
        let whole = decoder.assembled().unwrap();
        let size_of = |number: usize| {
            let mut part = whole.clone();
            part.triangles = table
                .triangles()
                .map(|t| table.triangle(t).map(|v| v.0))
                .filter(|t| of[t[0] as usize] == number)
                .collect();
            part.positions =
                decoder.mesh().positions.iter().map(|&p| contents.header.lattice.position(p)).collect();
            sizes(&part)
        };
        let sizes: Vec<_> = (0..parts).map(size_of).collect();
        for j in 0..=contents.base_level() {
            let until = Until { level: j, ..Until::default() };
            let at = decoder::decode(&file, decoder::Options { until, ..Default::default() }).unwrap();
            let there = at.mesh().roots.edges().len();
            let missing = sizes[there..].iter().copied().fold(0.0, f64::max);
            let told = contents.levels[j as usize].max_error;
            // The lattice moves either end of a diagonal.
            assert!(told >= missing - 2.0 * contents.header.lattice.step, "level {j}: {told} of {missing}");
        }
        assert!(contents.level(contents.base_level()).unwrap().vertices <= 40);
    }
}

/// Every road to a level, up, down and up again, through meshes that are valid all the time, and events that tell all.
fn every_road(mesh: &IndexedMesh, options: Options, chunk: usize) -> Result<(), TestCaseError> {
    let (file, contents) = encoded(mesh, options);
    let mut decoder = Decoder::new(decoder::Options { undo: true, ..Default::default() });
    let (mut positions, mut told): (Vec<[i32; 3]>, Vec<_>) = Default::default();
    let mut seen = Vec::new();
    for packet in file.chunks(chunk) {
        decoder.push(packet);
        while let Some(event) = decoder.poll().unwrap() {
            let now = decoder.mesh();
            now.table.check().unwrap();
            let triangle = |t: u32| now.table.triangle(Triangle(t));
            match event {
                Event::Whole { .. } => {
                    positions = now.positions.clone();
                    told = now.table.triangles().map(|t| triangle(t.0)).collect();
                }
                Event::Refined(delta) => {
                    prop_assert_eq!(delta.vertices.start as usize, positions.len());
                    prop_assert_eq!(delta.parents.len(), delta.vertices.len());
                    for (v, site) in delta.vertices.clone().zip(&delta.parents) {
                        if let Site::Edge(a, b) = *site {
                            prop_assert!(a.0 < v && b.0 < v || a.0 == v && b.0 == v);
                        }
                    }
                    positions
                        .extend(&now.positions[delta.vertices.start as usize..delta.vertices.end as usize]);
                    told.extend(delta.triangles.map(triangle));
                    delta.moved.iter().for_each(|&v| positions[v as usize] = now.positions[v as usize]);
                    delta.rewritten.iter().for_each(|&t| told[t as usize] = triangle(t));
                }
                Event::Level { level, .. } => {
                    let about = contents.level(level).unwrap();
                    prop_assert_eq!(now.positions.len(), about.vertices as usize);
                    prop_assert_eq!(now.table.triangle_count(), about.triangles as usize);
                    seen.push((level, now.clone(), decoder.assembled().unwrap()));
                }
                _ => {}
            }
            prop_assert_eq!(&positions, &now.positions);
            prop_assert_eq!(&told, &now.table.triangles().map(|t| triangle(t.0)).collect::<Vec<_>>());
        }
    }
    decoder.finish().unwrap();
    let lattice = contents.header.lattice;
    prop_assert_eq!(triangles(&decoder.assembled().unwrap(), &lattice), triangles(mesh, &lattice));
    for (level, at, whole) in seen.iter().rev().skip(1) {
        prop_assert_eq!(decoder.coarsen().unwrap(), Some(*level));
        decoder.mesh().table.check().unwrap();
        prop_assert_eq!(&decoder.mesh().positions, &at.positions);
        prop_assert_eq!(decoder.mesh().roots.edges(), at.roots.edges());
        prop_assert_eq!(triangles(&decoder.assembled().unwrap(), &lattice), triangles(whole, &lattice));
    }
    for (level, at, whole) in seen.iter().skip(1) {
        prop_assert_eq!(decoder.restore().unwrap(), Some(*level));
        prop_assert_eq!(&decoder.mesh().positions, &at.positions);
        prop_assert_eq!(triangles(&decoder.assembled().unwrap(), &lattice), triangles(whole, &lattice));
    }
    for (level, _, whole) in &seen {
        for plan in [plan(&contents, Want::Level(*level)), plan_from_keyframe(&contents, *level)] {
            let mut decoder = Decoder::of_plan(contents.clone(), &plan, decoder::Options::default());
            for part in &plan.parts {
                decoder.push(&file[part.bytes.start as usize..part.bytes.end as usize]);
            }
            while decoder.poll().unwrap().is_some() {}
            prop_assert_eq!(decoder.level(), Some(*level));
            let found = triangles(&decoder.assembled().unwrap(), &lattice);
            prop_assert_eq!(found, triangles(whole, &lattice));
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]
    #[test]
    fn every_road_leads_to_the_same_levels(
        count in 2..40usize,
        flat: bool,
        base in 4..60usize,
        schedule in prop::collection::vec(0..4u32, 0..4),
        every in 1..4u32,
        chunk in 1..3000usize,
        share in 0.1..1.0f64,
    ) {
        let mesh = if flat { loose_triangles(3 * count) } else { parts(count) };
        let mut schedule = schedule;
        schedule.sort_unstable();
        let keyframes = if every == 1 { Keyframes::All } else { Keyframes::Every(every) };
        let mut options = Options { keyframes, preview: Preview::Schedule(schedule), ..small() };
        options.simplify.base_vertices = Some(base);
        options.simplify.level_share = share;
        every_road(&mesh, options, chunk)?;
    }
}

/// Where a boundary is to stay at all levels, what has one stays.
#[test]
fn a_locked_boundary_is_not_left_out() {
    let mesh = parts(40);
    let (file, contents) = encoded(&mesh, Options { lock_boundary: true, ..small() });
    assert!(has_births(&contents));
    let boundary = |level: u32| {
        let until = Until { level, ..Until::default() };
        let at = decoder::decode(&file, decoder::Options { until, ..Default::default() }).unwrap();
        let table = &at.mesh().table;
        table.triangles().flat_map(|t| t.corners()).filter(|&c| table.opposite(c).is_none()).count()
    };
    assert_eq!(boundary(contents.base_level()), boundary(0));
}

/// A decoder that is to stop does so before what is born.
#[test]
fn births_stop_where_they_are_told_to() {
    let (file, contents) = encoded(&loose_triangles(300), small());
    for triangles in [1, 20, 100, 299, 300] {
        let until = Until { triangles, ..Until::default() };
        let at = decoder::decode(&file, decoder::Options { until, ..Default::default() }).unwrap();
        let count = at.mesh().table.triangle_count() as u32;
        let most = contents.levels.iter().map(|level| level.triangles).filter(|&n| n <= triangles).max();
        assert_eq!(count, most.unwrap_or(contents.header.base_triangles));
    }
}

/// What is born is paid for: a decoder that may not have so much gives up, with the mesh as it was.
#[test]
fn births_are_debited() {
    let (file, contents) = encoded(&loose_triangles(3000), Options::default());
    let mut refused = 0;
    for memory in [20_000, 100_000, 300_000, 600_000, 3_000_000] {
        let limits = Limits { memory, ..Limits::default() };
        let mut decoder = Decoder::new(decoder::Options { limits, ..Default::default() });
        decoder.push(&file);
        let outcome = loop {
            match decoder.poll() {
                Ok(Some(_)) => decoder.mesh().table.check().unwrap(),
                other => break other,
            }
        };
        if let Err(error) = outcome {
            assert!(matches!(error, Error::Limit { .. }), "{error}");
            refused += 1;
        }
        let told = decoder.level().map(|level| contents.levels[level as usize].triangles as usize);
        assert_eq!(told.unwrap_or(0), decoder.mesh().table.triangle_count());
    }
    assert!((1..5).contains(&refused));
}
