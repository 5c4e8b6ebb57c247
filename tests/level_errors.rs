//! The errors that the table of contents tells, against distances measured by sampling: both ways, at every level, boundaries included.
#![cfg(all(feature = "encode", feature = "formats"))]

use std::f64::consts::TAU;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use unweld::decoder::{self, Decoder, Event};
use unweld::encoder::{Encoder, Options, Preview};
use unweld::formats;
use unweld::mesh::distance::{Sampling, SurfaceDistance, surface_distances};
use unweld::mesh::topology::{self, Weld};
use unweld::mesh::{IndexedMesh, shapes};

/// What is told of a level, and what sampling says: from the input to the level, and back.
struct Measured {
    level: u32,
    max: f64,
    rms: f64,
    ways: [SurfaceDistance; 2],
}

impl Measured {
    /// The largest distance met over the one told.
    fn ratio(&self) -> f64 {
        SurfaceDistance::symmetric(self.ways).max / self.max
    }
}

/// All levels but those that `skip` says, base first. Residue is no part of what is measured.
fn levels(mesh: &IndexedMesh, options: Options, samples: u64, skip: impl Fn(u32) -> bool) -> Vec<Measured> {
    let file = Encoder::new(options).encode_to_vec(mesh).unwrap();
    let conditioned = topology::condition(mesh, Weld::Exact);
    let table = &conditioned.manifold.table;
    let triangles = table.triangles().map(|t| table.triangle(t).map(|v| v.0)).collect();
    let input = IndexedMesh::new(conditioned.manifold.positions.clone(), triangles);
    let sampling = Sampling { samples, seed: 7, threads: NonZeroUsize::MIN };
    let mut decoder = Decoder::new(decoder::Options::default());
    decoder.push(&file);
    let mut found = Vec::new();
    while let Some(event) = decoder.poll().unwrap() {
        let Event::Level { level, max_error, rms_error } = event else { continue };
        if !skip(level) {
            let mesh = decoder.assembled().unwrap();
            let Some(ways) = surface_distances(&input, &mesh, &sampling, &mut |_, _| {}) else { continue };
            found.push(Measured { level, max: max_error, rms: rms_error, ways });
        }
    }
    found
}

fn options(base_vertices: usize) -> Options {
    let mut options = Options::default();
    options.simplify.base_vertices = Some(base_vertices);
    options
}

/// A square of n by n squares; `place` moves its points, which are from 0 to 1 in x and y.
fn plate(n: u32, place: impl Fn(f64, f64) -> [f64; 3]) -> IndexedMesh {
    let mut mesh = shapes::grid(n, n);
    for (i, p) in mesh.positions.iter_mut().enumerate() {
        let (x, y) = (i as u32 % (n + 1), i as u32 / (n + 1));
        *p = place(f64::from(x) / f64::from(n), f64::from(y) / f64::from(n));
    }
    mesh
}

/// Whatever the vertex numbers, a pseudo-random number from -1 to 1 for two others.
fn rough(x: f64, y: f64) -> f64 {
    ((x * 1237.0 + 0.3).sin() * 4321.7 + (y * 977.0 + 0.7).cos() * 1777.3).fract()
}

/// A plate whose outline has waves, inwards and outwards, of some tenth of its side.
fn wavy_plate() -> IndexedMesh {
    plate(40, |x, y| {
        let wave = 1.0 + 0.08 * (TAU * 5.0 * (x + y)).sin();
        [(x - 0.5) * wave, (y - 0.5) * wave, 0.02 * (TAU * x).sin() * (TAU * y).cos()]
    })
}

/// A flat plate with teeth along all its sides: every other vertex of the boundary is drawn in.
fn toothed_plate() -> IndexedMesh {
    let n = 30.0;
    plate(30, move |x, y| {
        let tooth = |along: f64| if (along * n).round() as i32 % 2 == 0 { 0.4 / n } else { 0.0 };
        let pull = |x: f64, along: f64| match x {
            0.0 => tooth(along),
            1.0 => 1.0 - tooth(along),
            _ => x,
        };
        [pull(x, y), pull(y, x), 0.0]
    })
}

/// A tube along x, open at both ends; n points round it.
fn tube(n: u32) -> IndexedMesh {
    let rings = 2 * n;
    let mut mesh = IndexedMesh::default();
    for (k, i) in (0..rings).flat_map(|k| (0..n).map(move |i| (k, i))) {
        let (turn, x) = (f64::from(i) / f64::from(n), f64::from(k) / f64::from(rings));
        let radius = 0.2 + 0.05 * (TAU * 2.0 * x).sin();
        let (sin, cos) = (TAU * turn).sin_cos();
        mesh.positions.push([x + 0.02 * rough(x, turn) / f64::from(n), radius * cos, radius * sin]);
    }
    for (k, i) in (0..rings - 1).flat_map(|k| (0..n).map(move |i| (k, i))) {
        let [a, b] = [k * n + i, k * n + (i + 1) % n];
        mesh.triangles.extend([[a, b + n, b], [a, a + n, b + n]]);
    }
    mesh
}

fn synthetic() -> Vec<(&'static str, IndexedMesh)> {
    vec![
        ("wavy plate", wavy_plate()),
        ("toothed plate", toothed_plate()),
        ("noisy plate", plate(30, |x, y| [x, y, 0.01 * rough(x, y)])),
        ("saddle", plate(20, |x, y| [x, y, (x - 0.5) * (y - 0.5)])),
        ("tube", tube(24)),
        ("annulus", shapes::annulus(200)),
        ("torus with a hole", shapes::torus_with_hole(40, 24)),
        ("sphere", shapes::sphere(3)),
        ("mountains", shapes::bumpy_sphere(4, 3)),
        ("handles", shapes::handle_body(3)),
        ("two components", shapes::two_components()),
    ]
}

#[test]
fn the_largest_error_holds_both_ways_on_synthetic_meshes() {
    for (name, mesh) in synthetic() {
        for level in levels(&mesh, options(12), 20_000, |_| false) {
            let (ratio, number) = (level.ratio(), level.level);
            assert!(
                ratio <= 1.1,
                "{name}, level {number}: {ratio:.3} times the error told, {:?}",
                level.ways
            );
            // A bound that is far off would be of no use.
            let least = 0.45;
            assert!(ratio >= least, "{name}, level {number}: only {ratio:.3} of the error told");
        }
    }
}

/// Coordinates of coarse levels are in the middle of cells: their errors tell that, too.
#[test]
fn the_largest_error_holds_with_coarse_coordinates() {
    let options = Options { preview: Preview::Coarse, ..options(20) };
    for level in levels(&wavy_plate(), options, 20_000, |_| false) {
        let ratio = level.ratio();
        assert!((0.45..=1.1).contains(&ratio), "level {}: {ratio:.3}", level.level);
    }
}

/// Told are the distances of vertices, measured those of the whole surface: of one kind, not the same.
#[test]
fn the_mean_error_is_near_the_larger_of_both_ways() {
    // Vertices of the saddle lie on straight lines of it, those of the handles on flat faces: theirs is no measure of the rest.
    for (name, mesh) in synthetic().into_iter().filter(|(name, _)| !["saddle", "handles"].contains(name)) {
        let told = levels(&mesh, options(12), 20_000, |_| false);
        // Level 0 is as far off as its moves to the lattice are expected to be; where rows leave a flat level no farther off, these may cancel out.
        let rounding = told.last().map_or(0.0, |level| level.rms);
        for level in told.iter().filter(|level| level.rms > 2.0 * rounding) {
            let ratio = SurfaceDistance::symmetric(level.ways).rms / level.rms;
            // As above: where all is rough, vertices are led astray.
            let least = if name == "noisy plate" { 0.1 } else { 0.2 };
            assert!((least..=2.0).contains(&ratio), "{name}, level {}: {ratio:.3}", level.level);
        }
    }
}

/// A vertex that is far off stays as long as there are others: so a wanted error needs fewer bytes the larger it is.
#[test]
fn the_largest_error_falls_with_the_mean_error() {
    for (name, mesh) in [("wavy plate", wavy_plate()), ("toothed plate", toothed_plate())] {
        // Measured at points, some percent of which miss the farthest; since what is told may be a looser bound at one level than at the next.
        let told = levels(&mesh, options(12), 20_000, |_| false);
        let max = |level: &Measured| SurfaceDistance::symmetric(level.ways).max;
        let errors: Vec<_> = told.iter().map(|level| (max(level), level.max, level.rms)).collect();
        assert!(told.windows(2).all(|pair| max(&pair[1]) <= 1.2 * max(&pair[0])), "{name}: {errors:?}");
        // Where a fifth of the levels is left, so is a small part of the error.
        let late = &told[told.len() * 4 / 5];
        assert!(max(late) < 0.2 * max(&told[0]), "{name}: {errors:?}");
        for level in &told {
            assert!(level.max < 60.0 * level.rms, "{name}, level {}: {errors:?}", level.level);
        }
    }
}

/// On real meshes: every third level of those that are small, and of the one that showed what was missing.
#[test]
fn the_largest_error_holds_both_ways_on_real_meshes() {
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data");
    let folder = std::env::var_os("UNWELD_DATA").map_or_else(beside, PathBuf::from);
    if !folder.is_dir() {
        eprintln!("skipped: no folder of real meshes at {}", folder.display());
        return;
    }
    let names = [
        "cad_fandisk.obj.gz",
        "cad_anchor.off.gz",
        "cad_plate_holes.stl",
        "comps_truck.obj.gz",
        "open_shark_holes.off.gz",
        "open_three_peaks.off",
        "nasty/plate_9_holes.obj",
        "nasty/moebius_3_twists.obj",
        "nasty/klein_bottle.obj",
        "organic_cat.obj.gz",
        "organic_goathead.obj.gz",
        "poly_aircraft.off",
        "scan_bunny.ply.gz",
    ];
    for name in names {
        let source = formats::read(&folder.join(name)).unwrap();
        let options = options((source.mesh.positions.len() / 200).clamp(4, 150));
        for level in levels(&source.mesh, options, 30_000, |level| level % 3 != 0) {
            let ratio = level.ratio();
            assert!(ratio <= 1.1, "{name}, level {}: {ratio:.3} times the error told", level.level);
        }
    }
}
