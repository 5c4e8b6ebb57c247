//! Work is counted before it is done, and what the encoder writes takes little of it.

use super::{alone, files};
use proptest::prelude::*;
use unweld::codec::grid::Real;
use unweld::codec::residue::Residue;
use unweld::container::{Contents, parse_contents};
use unweld::decoder::{self, decode};
use unweld::encoder::{Encoder, Keyframes, Options, Preview, Profile};
use unweld::limits::{WORK_A_BYTE, max_walked};
use unweld::mesh::topology::Weld;
use unweld::mesh::{IndexedMesh, shapes};
use unweld::simplify::Method;

fn work_of(file: &[u8]) -> u64 {
    decode(file, decoder::Options::default()).unwrap().work()
}

#[test]
fn each_kind_of_payload_counts() {
    let _turn = alone();
    let mesh = files::mesh(&shapes::grid(20, 20));
    let [vertices, triangles] = [mesh.positions.len() as u64, mesh.table.triangle_count() as u64];
    let boundary = 4 * 20;
    // A base: a symbol for each triangle and each of a cap, then 8 for each triangle.
    let base = 9 * triangles + boundary;
    let none = work_of(&files::with_residue(&mesh, &Residue::default()));
    // A residue: a walk.
    assert_eq!(none, base + 4 * triangles);
    let groups = work_of(&files::with_residue(&mesh, &files::groups_of_one(&mesh)));
    assert_eq!(groups, none + 8 * vertices);
    let flipped = Residue { flipped: (0..triangles).map(|k| k % 2 == 0).collect(), ..Residue::default() };
    assert_eq!(work_of(&files::with_residue(&mesh, &flipped)), none + triangles);
    // Items by 1,024, 16 units each.
    let further = Residue { triangles: vec![[0, 1, 2]; 1025], ..Residue::default() };
    assert_eq!(work_of(&files::with_residue(&mesh, &further)), none + 2 * 1024 * 16);
}

#[test]
fn levels_count() {
    let _turn = alone();
    // Of the square's two triangles a level halves each, and the next ones theirs.
    let square = IndexedMesh::new(
        vec![[0.0; 3], [4096.0, 0.0, 0.0], [4096.0, 4096.0, 0.0], [0.0, 4096.0, 0.0]],
        vec![[0, 1, 2], [0, 2, 3]],
    );
    let file = files::with_levels(files::mesh(&square), 8, files::Longest::new);
    let contents = parse_contents(&file).unwrap().unwrap();
    let above: u64 = contents.levels[1..].iter().map(|level| u64::from(level.triangles)).sum();
    let operations = u64::from(contents.levels[0].vertices - 4);
    assert_eq!(work_of(&file), 9 * 2 + 4 + 4 * above + 16 * operations);
}

/// A file, and the work that its encoder says it takes.
fn encoded(mesh: &IndexedMesh, options: Options) -> (Vec<u8>, u64) {
    let mut file = Vec::new();
    let report = Encoder::new(options).encode(mesh, &mut file).unwrap();
    (file, report.work)
}

/// The encoder knows what a decoder will count: of every kind of payload.
#[test]
fn the_encoder_tells_the_same() {
    let _turn = alone();
    // Triangles turned round, groups of cut vertices, further vertices and triangles, and vertices that are there several times.
    let mut odd = shapes::bumpy_sphere(3, 1);
    for t in odd.triangles.iter_mut().step_by(3) {
        t.swap(0, 1);
    }
    let n = odd.positions.len() as u32;
    odd.positions.extend([
        [2.0, 0.0, 0.0],
        [2.0, 1.0, 0.0],
        [1e9, 0.0, 0.0],
        odd.positions[7],
        odd.positions[9],
    ]);
    odd.triangles.extend([[0, 1, n], [0, 1, n + 1], [5, n, n + 1], [n + 3, n + 4, 20], [3, 3, 4]]);
    for mesh in [odd, shapes::grid(20, 30), shapes::torus(12, 40)] {
        for preview in [Preview::Off, Preview::Schedule(vec![1, 2, 6])] {
            for keyframes in [Keyframes::None, Keyframes::Every(2)] {
                for (exact, keep_order) in
                    [(None, false), (Some(Real::Binary64), false), (None, true), (Some(Real::Binary64), true)]
                {
                    let mut options = Options { exact, keep_order, atom_bytes: 100, ..Options::default() };
                    (options.preview, options.keyframes) = (preview.clone(), keyframes.clone());
                    options.simplify.base_vertices = Some(20);
                    let (file, told) = encoded(&mesh, options.clone());
                    assert_eq!(work_of(&file), told, "{options:?}");
                }
            }
        }
    }
}

/// Of a correction: each triangle of the whole, and each vertex, by 1,024; copies and corners at them likewise. Of an order: each triangle and
/// vertex, and each vertex beyond the whole's, likewise.
#[test]
fn corrections_and_orders_count() {
    let _turn = alone();
    let mut options = Options::default();
    options.simplify.base_vertices = Some(usize::MAX);
    let beyond = |mesh: &IndexedMesh, exact: Option<Real>, keep_order: bool, weld: Weld| {
        let plain = Options { weld, ..options.clone() };
        let file = |options| {
            let mut draft = Vec::new();
            Encoder::new(options).encode(mesh, &mut draft).unwrap();
            let contents = parse_contents(&draft).unwrap().unwrap();
            let metadata = contents.bytes(contents.metadata());
            work_of(&draft) - (metadata.end - metadata.start)
        };
        file(Options { exact, keep_order, ..plain.clone() }) - file(plain)
    };
    let mesh = shapes::grid(40, 50);
    let [v, t] = [mesh.positions.len() as u64, mesh.triangles.len() as u64];
    assert_eq!((v, t), (2091, 4000));
    let item = 16 * 1024;
    // Walk and whole come first.
    let both = 2 * 4 * t;
    assert_eq!(beyond(&mesh, Some(Real::Binary64), false, Weld::Exact), both + t + 3 * item);
    assert_eq!(beyond(&mesh, None, true, Weld::Exact), both + 64 * (v + t));
    // A seam of equal vertices, then of nearly equal ones, each at one corner.
    let mut twice = mesh.clone();
    for k in 0..1100 {
        twice.triangles[3 * k][0] = twice.positions.len() as u32;
        twice.positions.push(mesh.positions[mesh.triangles[3 * k][0] as usize]);
    }
    assert_eq!(beyond(&twice, None, true, Weld::Exact), both + 64 * (v + t) + 2 * item);
    for p in &mut twice.positions[v as usize..] {
        p[2] += 1e-9;
    }
    let near = Weld::Within(1e-6);
    assert_eq!(beyond(&twice, Some(Real::Binary64), false, near), both + t + (3 + 2 + 2) * item);
}

fn walked(contents: &Contents) -> u64 {
    contents.levels[1..].iter().map(|level| u64::from(level.triangles)).sum()
}

/// What the encoder writes needs none of the work that every file is granted, and a quarter of the levels.
fn is_far_inside(mesh: &IndexedMesh, options: Options) {
    let (file, told) = encoded(mesh, options.clone());
    let work = work_of(&file);
    assert_eq!(work, told);
    let contents = parse_contents(&file).unwrap().unwrap();
    assert!(
        work <= WORK_A_BYTE / 4 * file.len() as u64,
        "{work} units for {} bytes, {options:?}",
        file.len()
    );
    let allowed = max_walked(contents.levels[0].triangles) - max_walked(0);
    assert!(walked(&contents) <= allowed / 2 + 10_000, "{options:?}");
}

#[test]
fn regular_meshes() {
    let _turn = alone();
    for method in [Method::Stellar, Method::Ffc] {
        for profile in [Profile::Default, Profile::Small, Profile::Fine] {
            let mut options = Options::profile(profile);
            options.simplify.method = method;
            is_far_inside(&shapes::grid(130, 130), options.clone());
            is_far_inside(&shapes::torus(96, 128), options);
        }
    }
    let exact = Options { exact: Some(Real::Binary64), keep_order: true, ..Options::profile(Profile::Small) };
    is_far_inside(&shapes::grid(130, 130), exact);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn meshes_of_any_size(n in 3..40u32, m in 3..40u32, share in 0.01..1.0f64, lock in any::<bool>()) {
        let _turn = alone();
        let mut options = Options { lock_boundary: lock, ..Options::default() };
        // Small levels, and as many of them as it takes.
        options.simplify.level_share = share;
        options.simplify.base_vertices = Some(8);
        for mesh in [shapes::torus(n, m), shapes::grid(n, m)] {
            let (file, told) = encoded(&mesh, options.clone());
            prop_assert_eq!(work_of(&file), told);
            prop_assert!(work_of(&file) <= WORK_A_BYTE * file.len() as u64);
        }
    }
}
