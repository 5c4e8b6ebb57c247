//! Work is counted before it is done, and what the encoder writes takes little of it.

use super::{alone, files};
use proptest::prelude::*;
use unweld::codec::grid::Real;
use unweld::codec::residue::Residue;
use unweld::container::{Contents, parse_contents};
use unweld::decoder::{self, decode};
use unweld::encoder::{Encoder, Options, Profile};
use unweld::limits::{WORK_A_BYTE, max_walked};
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

fn walked(contents: &Contents) -> u64 {
    contents.levels[1..].iter().map(|level| u64::from(level.triangles)).sum()
}

/// What the encoder writes needs none of the work that every file is granted, and a quarter of the levels.
fn is_far_inside(mesh: &IndexedMesh, options: Options) {
    let file = Encoder::new(options.clone()).encode_to_vec(mesh).unwrap();
    let work = work_of(&file);
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
            let file = Encoder::new(options.clone()).encode_to_vec(&mesh).unwrap();
            prop_assert!(work_of(&file) <= WORK_A_BYTE * file.len() as u64);
        }
    }
}
