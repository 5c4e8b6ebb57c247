//! The loop: what goes in comes out, at every level, by every road.
#![cfg(feature = "encode")]

mod common;

use common::triangles;
use std::num::NonZeroUsize;
use std::sync::Arc;
use unweld::Error;
use unweld::container::{Atom, Contents, Part, Plan, Want, parse_contents, plan, plan_from_keyframe};
use unweld::decoder::{self, Decoder, Event, Until};
use unweld::encoder::{Encoder, FEW, Keyframes, Options, Preview, Profile};
use unweld::limits::Limits;
use unweld::mesh::distance::{Sampling, SurfaceDistance, surface_distances};
use unweld::mesh::{IndexedMesh, Triangle, shapes};
use unweld::refine::Site;
use unweld::simplify::Method;

fn small() -> Options {
    let mut options = Options { keyframes: Keyframes::All, atom_bytes: 100, ..Options::default() };
    options.simplify.base_vertices = Some(10);
    options
}

/// The grid of a level is as coarse as its mean error allows; the table tells the root mean square, with what the grid adds.
#[test]
fn the_grid_of_a_preview_follows_the_error() {
    for (preview, lifting, share) in [
        (Preview::Fine, 13, 1.0),
        (Preview::Coarse, 13, 2.0),
        (Preview::Fine, 0, 2.0),
        (Preview::Auto, 13, 1.0),
    ] {
        let mut options = Options { preview, lifting: Some(lifting), ..Options::default() };
        options.simplify.base_vertices = Some(30);
        let file = Encoder::new(options).encode_to_vec(&shapes::sphere(4)).unwrap();
        let contents = parse_contents(&file).unwrap().unwrap();
        let unit = contents.header.lattice.step;
        for (j, level) in contents.levels.iter().enumerate() {
            let step = f64::from(1u32 << level.precision);
            let rms = level.rms_error / unit;
            let without = (rms * rms - 0.25 * (step - 1.0) * (step - 1.0)).sqrt();
            // The mean is no more than that, and not far below it. Never more than a 32nd of the whole.
            let [least, most] = [0.5, 1.0].map(|mean| (mean * share * without).clamp(1.0, 16_383.0 / 32.0));
            assert!(j > 0 || step == 1.0);
            assert!(step <= most * 1.01, "level {j}: {step} of {most}");
            assert!(j == 0 || 2.0 * step >= least * 0.99, "level {j}: {step} of {least}");
        }
        assert!(contents.levels.last().unwrap().precision > 5);
    }
}

#[test]
fn a_schedule_that_falls_is_refused() {
    let options = Options { preview: Preview::Schedule(vec![2, 1]), ..Options::default() };
    let error = Encoder::new(options).encode_to_vec(&shapes::tetrahedron()).unwrap_err();
    assert!(matches!(error, Error::Parameter(_)), "{error}");
}

#[test]
fn shapes_come_back() {
    for mesh in
        [shapes::sphere(3), shapes::torus_with_hole(20, 14), shapes::handle_body(2), shapes::disc_with_ears()]
    {
        for preview in [Preview::Off, Preview::Fine, Preview::Coarse, Preview::Schedule(vec![1, 2, 5])] {
            let file = Encoder::new(Options { preview, ..small() }).encode_to_vec(&mesh).unwrap();
            let decoder = decoder::decode(&file, decoder::Options::default()).unwrap();
            let lattice = decoder.contents().unwrap().header.lattice;
            assert_eq!(triangles(&decoder.assembled().unwrap(), &lattice), triangles(&mesh, &lattice));
        }
    }
}

#[test]
fn the_undo_log_goes_down_and_up_again() {
    let mut options = small();
    options.preview = Preview::Schedule(vec![1, 3]);
    let file = Encoder::new(options).encode_to_vec(&shapes::torus_with_hole(16, 12)).unwrap();
    let mut decoder = Decoder::new(decoder::Options { undo: true, ..Default::default() });
    decoder.push(&file);
    let mut seen = Vec::new();
    while let Some(event) = decoder.poll().unwrap() {
        if let Event::Level { level, .. } = event {
            seen.push((level, decoder.mesh().clone()));
        }
    }
    let mut down = seen.len() - 1;
    while let Some(level) = decoder.coarsen().unwrap() {
        down -= 1;
        assert_eq!(level, seen[down].0);
        assert_eq!(decoder.level(), Some(level));
        decoder.mesh().table.check().unwrap();
        assert_eq!(decoder.mesh().positions, seen[down].1.positions);
        assert_eq!(decoder.mesh().roots.edges(), seen[down].1.roots.edges());
    }
    assert_eq!(down, 0);
    while decoder.restore().unwrap().is_some() {
        down += 1;
        assert_eq!(decoder.mesh().positions, seen[down].1.positions);
    }
    assert_eq!(down, seen.len() - 1);
    let lattice = decoder.contents().unwrap().header.lattice;
    assert_eq!(
        triangles(&decoder.assembled().unwrap(), &lattice),
        triangles(&shapes::torus_with_hole(16, 12), &lattice)
    );
}

/// Wherever a prefix ends, most of it is seen: an atom is no more than an eighth of what comes before it, but for those near the
/// beginning.
#[test]
fn an_atom_is_a_small_share_of_what_comes_before() {
    let file = Encoder::new(Options::default()).encode_to_vec(&shapes::bumpy_sphere(5, 1)).unwrap();
    let contents = parse_contents(&file).unwrap().unwrap();
    let begin = contents.atoms[0].offset;
    // An operation and the coder's last bytes lie beyond the mark.
    let slack = 32;
    let steps = &contents.atoms[contents.steps(0).start..contents.steps(0).end];
    assert!(steps.len() > 1, "a level of {} bytes", steps[0].length);
    for atom in &contents.atoms[..contents.steps(0).end] {
        let share = (atom.offset - begin) / 8;
        assert!(u64::from(atom.length) <= share.max(2048) + slack, "{} of {}", atom.length, atom.offset);
    }
    // It is worth its entry in the table: all but the last of a level are as long as they may be.
    let whole = |pair: &[Atom]| pair[0].kind != pair[1].kind || pair[0].length >= 2048 - slack as u32;
    assert!(steps.windows(2).all(whole));
}

#[test]
fn the_same_input_gives_the_same_bytes() {
    let mesh = shapes::bumpy_sphere(4, 3);
    let file = |method: Method, seed: u64| {
        let mut options = small();
        (options.simplify.method, options.simplify.seed) = (method, seed);
        Encoder::new(options).encode_to_vec(&mesh).unwrap()
    };
    for method in [Method::Auto, Method::Stellar, Method::Ffc] {
        assert_eq!(file(method, 0), file(method, 0));
    }
    // A queue draws no lots.
    assert_ne!(file(Method::Stellar, 1), file(Method::Stellar, 0));
    assert_eq!(file(Method::Ffc, 1), file(Method::Ffc, 0));
}

/// A client that knows only what the events tell has the decoder's mesh after each of them.
#[test]
fn events_tell_every_change() {
    for mesh in [shapes::bumpy_sphere(3, 1), shapes::torus_with_hole(16, 12), shapes::disc_with_ears()] {
        let file = Encoder::new(Options { preview: Preview::Schedule(vec![1, 2, 4]), ..small() })
            .encode_to_vec(&mesh)
            .unwrap();
        let mut decoder = Decoder::new(decoder::Options::default());
        decoder.push(&file);
        let (mut positions, mut triangles) = (Vec::new(), Vec::new());
        while let Some(event) = decoder.poll().unwrap() {
            let now = decoder.mesh();
            let triangle = |t: u32| now.table.triangle(Triangle(t));
            match event {
                Event::Whole { .. } => {
                    positions = now.positions.clone();
                    triangles = now.table.triangles().map(|t| triangle(t.0)).collect();
                }
                Event::Refined(delta) => {
                    assert_eq!(delta.vertices.start as usize, positions.len());
                    assert_eq!(delta.triangles.start as usize, triangles.len());
                    assert_eq!(delta.parents.len(), delta.vertices.len());
                    for (v, parents) in delta.vertices.clone().zip(&delta.parents) {
                        let before = match *parents {
                            Site::Edge(a, b) | Site::Attach(a, b) => vec![a, b],
                            Site::Face(a, b, c) => vec![a, b, c],
                        };
                        assert!(before.iter().all(|parent| parent.0 < v), "a parent is older than its child");
                    }
                    positions
                        .extend(&now.positions[delta.vertices.start as usize..delta.vertices.end as usize]);
                    triangles.extend(delta.triangles.map(triangle));
                    delta.moved.iter().for_each(|&v| positions[v as usize] = now.positions[v as usize]);
                    delta.rewritten.iter().for_each(|&t| triangles[t as usize] = triangle(t));
                }
                _ => {}
            }
            assert_eq!(positions, now.positions);
            assert_eq!(triangles, now.table.triangles().map(|t| triangle(t.0)).collect::<Vec<_>>());
        }
        assert_eq!(decoder.level(), Some(0));
    }
}

#[test]
fn decoding_stops_where_it_is_told_to() {
    let file = Encoder::new(small()).encode_to_vec(&shapes::bumpy_sphere(3, 1)).unwrap();
    let decode = |until: Until| {
        let decoder = decoder::decode(&file, decoder::Options { until, ..Default::default() }).unwrap();
        decoder.mesh().table.check().unwrap();
        decoder
    };
    let whole = decode(Until::default());
    let contents = whole.contents().unwrap().clone();
    for j in 0..=contents.base_level() {
        let at = decode(Until { level: j, ..Until::default() });
        assert_eq!(at.level(), Some(j));
        assert_eq!(at.mesh().table.triangle_count() as u32, contents.level(j).unwrap().triangles);
    }
    let base = u64::from(contents.header.base_vertices);
    for operations in [0, 1, 17, 100] {
        let at = decode(Until { operations, ..Until::default() });
        assert_eq!(at.operations(), operations);
        assert_eq!(at.mesh().positions.len() as u64, base + operations);
    }
    for triangles in [100, 101, 500] {
        let count = decode(Until { triangles, ..Until::default() }).mesh().table.triangle_count() as u32;
        assert!((triangles - 1..=triangles).contains(&count), "{count} of {triangles}");
    }
}

/// The surface that a plan leads to, by its parts of the file alone.
fn followed(file: &[u8], contents: &Arc<Contents>, plan: &Plan) -> Vec<[[i32; 3]; 3]> {
    let mut decoder = Decoder::of_plan(contents.clone(), plan, decoder::Options::default());
    for part in &plan.parts {
        decoder.push(&file[part.bytes.start as usize..part.bytes.end as usize]);
    }
    while decoder.poll().unwrap().is_some() {}
    decoder.finish().unwrap();
    decoder.mesh().table.check().unwrap();
    if plan.complete {
        assert_eq!(decoder.level(), Some(plan.level));
    }
    assert_eq!(decoder.mesh().table.triangle_count() as u32, plan.triangles);
    triangles(&decoder.assembled().unwrap(), &contents.header.lattice)
}

#[test]
fn every_plan_is_enough_and_leads_where_it_says() {
    let file = Encoder::new(Options { preview: Preview::Schedule(vec![2]), ..small() })
        .encode_to_vec(&shapes::bumpy_sphere(3, 1))
        .unwrap();
    let contents = parse_contents(&file).unwrap().unwrap();
    let base = contents.base_level();
    let follow = |plan: &Plan| followed(&file, &contents, plan);
    for j in 0..=base {
        assert_eq!(
            follow(&plan(&contents, Want::Level(j))),
            follow(&plan_from_keyframe(&contents, j)),
            "level {j}"
        );
    }
    for bytes in (0..file.len() as u64).step_by(97) {
        follow(&plan(&contents, Want::Bytes(bytes)));
    }
}

/// From each keyframe, over those that follow it, to every level that is finer: the same surface as from the base. Keyframes are
/// where they were asked for: between two of them the levels of a segment share their models.
#[test]
fn every_keyframe_leads_to_every_finer_level() {
    for (keyframes, every) in [(Keyframes::All, 1), (Keyframes::Every(2), 2)] {
        for mesh in [shapes::bumpy_sphere(3, 1), shapes::torus_with_hole(16, 12), shapes::disc_with_ears()] {
            let options = Options {
                keyframes: keyframes.clone(),
                preview: Preview::Schedule(vec![1, 2, 4]),
                ..small()
            };
            let file = Encoder::new(options).encode_to_vec(&mesh).unwrap();
            let contents = parse_contents(&file).unwrap().unwrap();
            let follow = |plan: &Plan| followed(&file, &contents, plan);
            let base = contents.base_level();
            let replayed: Vec<_> = (0..=base).map(|j| follow(&plan(&contents, Want::Level(j)))).collect();
            assert_eq!(replayed[0], triangles(&mesh, &contents.header.lattice));
            for start in 0..base {
                let expected = start.is_multiple_of(every);
                assert_eq!(contents.keyframe(start).is_some(), expected, "a keyframe of level {start}");
                if !expected {
                    continue;
                }
                for j in 0..=start {
                    assert_eq!(
                        follow(&from_keyframe(&contents, start, j)),
                        replayed[j as usize],
                        "level {j} from {start}"
                    );
                }
            }
        }
    }
}

/// The way from the keyframe of one level, though others may be nearer.
fn from_keyframe(contents: &Contents, start: u32, level: u32) -> Plan {
    let mut way = Plan { start, ..plan_from_keyframe(contents, level) };
    way.parts = plan_from_keyframe(contents, start).parts;
    way.parts.truncate(1);
    let first = if start > 0 { contents.steps(start - 1).start } else { contents.steps(0).end };
    let end = if level == 0 { contents.prefix(0).end } else { contents.steps(level).end };
    if (start > level || level == 0) && first < end {
        way.parts.push(Part { bytes: contents.bytes(first..end), atoms: first..end });
    }
    way
}

/// A bumpy sphere has curvature everywhere, so that no level is free. A larger budget of a level's cost takes more operations into it: fewer levels, of
/// fewer bytes in all (no seam between levels costs anything), and each further off; a smaller budget the other way round. How far is measured, not
/// taken from the file.
#[test]
fn profiles_do_what_their_names_say() {
    let mesh = shapes::bumpy_sphere(5, 3);
    let [default, few, near] = [Profile::Default, Profile::Small, Profile::Fine].map(|profile| {
        let file = Encoder::new(Options::profile(profile)).encode_to_vec(&mesh).unwrap();
        let contents = parse_contents(&file).unwrap().unwrap();
        (file, contents)
    });
    let [few_bytes, bytes] = [few.0.len(), default.0.len()];
    assert!(few_bytes < bytes, "{few_bytes} bytes for few, {bytes} by default");
    assert!(few.1.levels.len() <= default.1.levels.len());
    // Of as many triangles at most, from the same input.
    for share in [4, 8, 16] {
        let most = default.1.header.triangles / share;
        let measured = |(file, contents): &(Vec<u8>, Arc<Contents>)| {
            let level = contents.levels.iter().position(|level| level.triangles <= most).unwrap();
            let until = Until { level: level as u32, ..Until::default() };
            let options = decoder::Options { until, ..Default::default() };
            let decoded = decoder::decode(file, options).unwrap().assembled().unwrap();
            assert!(decoded.triangles.len() <= most as usize);
            let sampling = Sampling { samples: 20_000, seed: 1, threads: NonZeroUsize::MIN };
            let ways = surface_distances(&mesh, &decoded, &sampling, &mut |_, _| {}).unwrap();
            SurfaceDistance::symmetric(ways).rms
        };
        let (fine, plain) = (measured(&near), measured(&default));
        assert!(fine < plain, "1 in {share}: {fine} instead of {plain}");
    }
}

/// Six models for a decision tell more than one; where nobody says which, a small mesh has them, a large one has not.
#[test]
fn rich_models_take_fewer_bytes() {
    for (mesh, few) in [(shapes::bumpy_sphere(3, 3), true), (shapes::torus(65, 64), false)] {
        assert_eq!(mesh.positions.len() <= FEW, few);
        let file =
            Encoder::new(Options { lifting: Some(0), ..Options::default() }).encode_to_vec(&mesh).unwrap();
        assert_eq!(parse_contents(&file).unwrap().unwrap().header.coding.rich_models, few);
    }
    let mesh = shapes::bumpy_sphere(5, 3);
    let [plain, rich] = [false, true].map(|rich_models| {
        Encoder::new(Options { rich_models: Some(rich_models), ..Options::default() })
            .encode_to_vec(&mesh)
            .unwrap()
    });
    assert!(rich.len() < plain.len(), "{} bytes instead of {}", rich.len(), plain.len());
    let [plain, rich] =
        [plain, rich].map(|file| decoder::decode(&file, decoder::Options::default()).unwrap());
    assert_eq!(plain.mesh().positions, rich.mesh().positions);
}

#[test]
fn a_callback_can_cancel() {
    let mut encoder = Encoder::new(small());
    let mut calls = 0;
    encoder.on_progress(|_| {
        calls += 1;
        calls < 4
    });
    assert!(matches!(encoder.encode_to_vec(&shapes::sphere(4)), Err(Error::Cancelled)));
    drop(encoder);
    assert_eq!(calls, 4);
}

#[test]
fn limits_are_kept() {
    let file = Encoder::new(small()).encode_to_vec(&shapes::sphere(4)).unwrap();
    for (memory, work) in [(20_000, u64::MAX), (u64::MAX, 5000)] {
        let limits = Limits { memory, work };
        let outcome = decoder::decode(&file, decoder::Options { limits, ..Default::default() });
        assert!(matches!(outcome, Err(Error::Limit { .. })), "{outcome:?}");
    }
    let mut encoder = Encoder::new(Options { max_memory: 1000, ..small() });
    assert!(matches!(encoder.encode_to_vec(&shapes::sphere(4)), Err(Error::Limit { .. })));
}

#[test]
fn impossible_settings_and_meshes_are_refused() {
    let refused = |options: Options, mesh: &IndexedMesh| match Encoder::new(options).encode_to_vec(mesh) {
        Err(Error::Parameter(what)) => what,
        other => panic!("{other:?}"),
    };
    let sphere = shapes::sphere(1);
    assert_eq!(
        refused(Options { position_bits: 25, ..small() }, &sphere),
        "position bits must be 8 to 24, not 25"
    );
    let mut broken = sphere.clone();
    broken.positions[5][1] = f64::NAN;
    assert_eq!(refused(small(), &broken), "vertex 5 has a coordinate that is not finite");
    let mut broken = sphere.clone();
    broken.triangles[7][2] = 42;
    assert_eq!(refused(small(), &broken), "triangle 7 names vertex 42 of 42");
    assert_eq!(refused(small(), &IndexedMesh::default()), "the mesh has no triangles");
}

#[test]
fn bytes_behind_the_end_are_refused_whichever_push_brings_them() {
    let file = Encoder::new(small()).encode_to_vec(&shapes::sphere(2)).unwrap();
    let outcome = |pieces: &[&[u8]]| {
        let mut decoder = Decoder::new(decoder::Options::default());
        for piece in pieces {
            decoder.push(piece);
            while decoder.poll().unwrap().is_some() {}
        }
        decoder.finish().map_err(|e| e.to_string())
    };
    let at_once = outcome(&[&[&file[..], b"xyz"].concat()]);
    assert!(at_once.as_ref().unwrap_err().contains("3 bytes behind the last atom"), "{at_once:?}");
    assert_eq!(outcome(&[&file, b"xyz"]), at_once);
    assert_eq!(outcome(&[&file, b"x", b"yz"]), at_once);
    assert_eq!(outcome(&[&file]), Ok(()));
}

#[test]
fn a_jump_to_level_0_brings_the_residue() {
    let mut mesh = shapes::sphere(3);
    mesh.triangles.extend([mesh.triangles[0], [3, 3, 5]]);
    mesh.positions.push([9.0; 3]);
    let file = Encoder::new(small()).encode_to_vec(&mesh).unwrap();
    let contents = parse_contents(&file).unwrap().unwrap();
    let plan = plan_from_keyframe(&contents, 0);
    let mut decoder = Decoder::of_plan(contents.clone(), &plan, decoder::Options::default());
    for part in &plan.parts {
        decoder.push(&file[part.bytes.start as usize..part.bytes.end as usize]);
    }
    while decoder.poll().unwrap().is_some() {}
    let (back, lattice) = (decoder.assembled().unwrap(), contents.header.lattice);
    assert_eq!(triangles(&back, &lattice), triangles(&mesh, &lattice));
    assert_eq!(back.positions.len(), mesh.positions.len());
}
