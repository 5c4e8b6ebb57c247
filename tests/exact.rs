//! `--exact` and `--keep-order` of the library: what comes back is what went in, to the last bit.
#![cfg(feature = "encode")]

use proptest::prelude::*;
use unweld::codec::grid::Real;
use unweld::container::{Part, Want, parse_contents, plan, plan_from_keyframe};
use unweld::decoder::{self, Decoder};
use unweld::encoder::{Encoder, Keyframes, Options};
use unweld::limits::Limits;
use unweld::mesh::topology::Weld;
use unweld::mesh::{IndexedMesh, shapes};

type Corners = [[u64; 3]; 3];

/// The bits of the corners of each triangle, from the least one; sorted.
fn triangles(mesh: &IndexedMesh) -> Vec<Corners> {
    let turned = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| mesh.positions[v as usize].map(f64::to_bits));
        [[a, b, c], [b, c, a], [c, a, b]].into_iter().min().unwrap()
    };
    let mut all: Vec<_> = mesh.triangles.iter().map(turned).collect();
    all.sort_unstable();
    all
}

fn back(mesh: &IndexedMesh, options: Options) -> IndexedMesh {
    let file = Encoder::new(options).encode_to_vec(mesh).unwrap();
    decoder::decode(&file, decoder::Options::default()).unwrap().assembled().unwrap()
}

fn exact(real: Real) -> Options {
    Options { exact: Some(real), ..Options::default() }
}

/// Numbers that are hard to keep: zeros of both signs, the least and largest ones, neighbours, decimals.
fn number(real: Real) -> impl Strategy<Value = f64> {
    let hard = prop_oneof![
        prop::sample::select(vec![
            0.0, -0.0, 1e-30, -1e30, 1e30, 5e-324, -5e-324, 1e-45, -1e-40, 2.0, 0.1, -0.1, 1e-3, 123456.789
        ]),
        (-1000i32..1000).prop_map(|k| f64::from(k) / 100.0),
        any::<f32>().prop_map(f64::from),
        -1.0..1.0f64,
    ];
    hard.prop_map(move |x| real.round(x)).prop_filter("finite", |x| x.is_finite())
}

/// Triangles of any kind on few places.
fn soup(real: Real) -> impl Strategy<Value = IndexedMesh> {
    let places = prop::collection::vec(number(real), 1..6);
    let positions = prop::collection::vec(any::<[prop::sample::Index; 3]>(), 1..20);
    let triangles = prop::collection::vec(any::<[prop::sample::Index; 3]>(), 1..40);
    (places, positions, triangles).prop_map(|(places, positions, triangles)| {
        let positions: Vec<[f64; 3]> =
            positions.iter().map(|p| p.map(|i| places[i.index(places.len())])).collect();
        let corner = |i: prop::sample::Index| i.index(positions.len()) as u32;
        let triangles = triangles.iter().map(|t| t.map(corner)).collect();
        IndexedMesh::new(positions, triangles)
    })
}

fn any_weld() -> impl Strategy<Value = Weld> {
    prop::sample::select(vec![Weld::Exact, Weld::None, Weld::Lattice, Weld::Within(0.1), Weld::Within(1e20)])
}

fn any_real() -> impl Strategy<Value = Real> {
    prop::sample::select(vec![Real::Binary32, Real::Binary64])
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn any_soup_comes_back(
        (real, mesh) in any_real().prop_flat_map(|real| (Just(real), soup(real))), bits in 8..=24u32, weld in any_weld(),
    ) {
        let mut options = Options { position_bits: bits, weld, keyframes: Keyframes::All, ..exact(real) };
        options.simplify.base_vertices = Some(4);
        prop_assert_eq!(triangles(&back(&mesh, options)), triangles(&mesh));
    }
}

/// Positions, to the last bit, and triangles, as they stand.
fn lists(mesh: &IndexedMesh) -> (Vec<[u64; 3]>, &[[u32; 3]]) {
    (mesh.positions.iter().map(|p| p.map(f64::to_bits)).collect(), &mesh.triangles)
}

/// The whole of level 0, from the base and from every keyframe.
fn by_every_road(file: &[u8]) -> Vec<IndexedMesh> {
    let contents = parse_contents(file).unwrap().unwrap();
    let keyframes = contents.segments().map(|j| {
        let mut plan = plan_from_keyframe(&contents, j);
        plan.parts.truncate(1);
        let first = if j > 0 { contents.steps(j - 1).start } else { contents.steps(0).end };
        let atoms = first..contents.metadata().end;
        plan.parts.push(Part { bytes: contents.bytes(atoms.clone()), atoms });
        plan
    });
    let mut plans: Vec<_> = keyframes.collect();
    plans.push(plan_from_keyframe(&contents, 0));
    plans.push(plan(&contents, Want::All));
    let by_plan = plans.iter().map(|plan| {
        let mut decoder = Decoder::of_plan(contents.clone(), plan, decoder::Options::default());
        for part in &plan.parts {
            decoder.push(&file[part.bytes.start as usize..part.bytes.end as usize]);
        }
        while decoder.poll().unwrap().is_some() {}
        decoder.finish().unwrap();
        decoder.assembled().unwrap()
    });
    by_plan.collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn any_soup_comes_back_in_order(
        (real, mesh) in any_real().prop_flat_map(|real| (Just(real), soup(real))), bits in 8..=24u32, weld in any_weld(),
    ) {
        let mut options = Options { position_bits: bits, weld, keep_order: true, keyframes: Keyframes::All, ..exact(real) };
        options.simplify.base_vertices = Some(4);
        let file = Encoder::new(options.clone()).encode_to_vec(&mesh).unwrap();
        for back in by_every_road(&file) {
            prop_assert_eq!(lists(&back), lists(&mesh));
        }
        // On the lattice, the lists are the same, but for the places.
        let file = Encoder::new(Options { exact: None, ..options }).encode_to_vec(&mesh).unwrap();
        let contents = parse_contents(&file).unwrap().unwrap();
        let lattice = contents.header.lattice;
        let same = weld.representatives(&mesh, &lattice);
        for back in by_every_road(&file) {
            prop_assert_eq!(&back.triangles, &mesh.triangles);
            prop_assert_eq!(back.positions.len(), mesh.positions.len());
            for &v in mesh.triangles.iter().flatten() {
                let (x, y) = (mesh.positions[same[v as usize] as usize], back.positions[v as usize]);
                // Where all lies within the least number, there is no lattice, and only further vertices keep their places.
                prop_assert!(y == lattice.position(lattice.quantise(x)) || (lattice.step == 0.0 && y == x));
            }
        }
    }

    #[test]
    fn any_order_of_a_shape_comes_back(seed in 0..100u32, shape in 0..4usize, soup: bool) {
        let shape = [
            shapes::torus_with_hole(12, 9), shapes::handle_body(1), shapes::disc_with_ears(), shapes::bumpy_sphere(2, 3),
        ][shape].clone();
        let mesh = shuffled(&shape, seed, soup);
        let options = Options { keep_order: true, ..exact(Real::Binary64) };
        let file = Encoder::new(options).encode_to_vec(&mesh).unwrap();
        for back in by_every_road(&file) {
            prop_assert_eq!(lists(&back), lists(&mesh));
        }
    }
}

/// The same surface with vertices and triangles in another order; as a soup, each corner has its own vertex.
fn shuffled(mesh: &IndexedMesh, seed: u32, soup: bool) -> IndexedMesh {
    let mix = |k: u32| (k.wrapping_add(seed)).wrapping_mul(0x9E37_79B9).rotate_left(seed % 32);
    let mut triangles = mesh.triangles.clone();
    triangles.sort_by_key(|t| mix(t[0] ^ t[1] << 8 ^ t[2] << 16));
    triangles.iter_mut().enumerate().for_each(|(k, t)| t.rotate_left((mix(k as u32) % 3) as usize));
    if soup {
        let positions = triangles.iter().flatten().map(|&v| mesh.positions[v as usize]).collect();
        return IndexedMesh::new(
            positions,
            (0..triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect(),
        );
    }
    let mut order: Vec<u32> = (0..mesh.positions.len() as u32).collect();
    order.sort_by_key(|&v| mix(v));
    let mut numbers = vec![0; order.len()];
    order.iter().zip(0..).for_each(|(&v, k)| numbers[v as usize] = k);
    let positions = order.iter().map(|&v| mesh.positions[v as usize]).collect();
    IndexedMesh::new(positions, triangles.iter().map(|t| t.map(|v| numbers[v as usize])).collect())
}

#[test]
fn shapes_come_back() {
    for mesh in [shapes::bumpy_sphere(4, 3), shapes::torus_with_hole(20, 14), shapes::handle_body(2)] {
        assert_eq!(triangles(&back(&mesh, exact(Real::Binary64))), triangles(&mesh));
    }
}

#[test]
fn a_coordinate_of_another_type_is_refused() {
    let corners = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.1, 0.5, 1.0]];
    let mut mesh = IndexedMesh::new(corners, vec![[0, 1, 2]]);
    let refused =
        |mesh: &IndexedMesh, real| Encoder::new(exact(real)).encode_to_vec(mesh).unwrap_err().to_string();
    let said = refused(&mesh, Real::Binary32);
    assert!(said.contains("vertex 2 has a coordinate that is no binary32 number"), "{said}");
    mesh.positions[2] = [0.25, f64::NAN, 1.0];
    for real in [Real::Binary32, Real::Binary64] {
        let said = refused(&mesh, real);
        assert!(said.contains("vertex 2 has a coordinate that is not finite"), "{said}");
    }
}

/// The limit is kept while an order is read, and told.
#[test]
fn an_order_keeps_the_limit() {
    let mesh = shuffled(&shapes::sphere(3), 1, true);
    let options = Options { keep_order: true, ..exact(Real::Binary64) };
    let file = Encoder::new(options).encode_to_vec(&mesh).unwrap();
    let limits =
        |memory| decoder::Options { limits: Limits { memory, ..Limits::default() }, ..Default::default() };
    assert!(decoder::decode(&file, limits(4 << 20)).is_ok());
    let needed = match decoder::decode(&file, limits(200_000)) {
        Err(unweld::Error::Limit { needed, allowed: 200_000, .. }) => needed,
        other => panic!("{:?}", other.err()),
    };
    assert!(needed < 4 << 20, "{needed}");
}

/// The tip of a cone is six vertices of the input, four of which differ by the signs of zeros alone, and a seventh that no triangle has. Corners
/// come back to earlier ones, in an order without a rule: each has to be named among all the others.
#[test]
fn instances_of_a_vertex_keep_their_places() {
    let n = 24u32;
    let tips = [
        [0.0, 0.0, 1.0],
        [-0.0, 0.0, 1.0],
        [0.0, -0.0, 1.0],
        [-0.0, -0.0, 1.0],
        [0.0, 0.0, 1.0],
        [-0.0, 0.0, 1.0],
    ];
    let first_tip = 3;
    let ring = |k: u32| if k % n < first_tip { k % n } else { k % n + tips.len() as u32 };
    let mut positions: Vec<[f64; 3]> = (0..n)
        .map(|k| f64::from(k) / f64::from(n) * std::f64::consts::TAU)
        .map(|turn| [turn.cos(), turn.sin(), 0.0])
        .collect();
    positions.splice(first_tip as usize..first_tip as usize, tips);
    positions.push([0.0, -0.0, 1.0]);
    // Every tip is met, then met again after each of the others.
    let turns = [0, 1, 2, 3, 4, 5, 0, 3, 1, 5, 2, 4, 0, 5, 4, 1, 3, 2, 2, 0, 4, 3, 5, 1];
    let triangles = (0..n).map(|k| [first_tip + turns[k as usize], ring(k), ring(k + 1)]).collect();
    let mesh = IndexedMesh::new(positions, triangles);
    for weld in [Weld::Exact, Weld::None] {
        let keyframes = Keyframes::All;
        let options = Options { keep_order: true, weld, keyframes, ..exact(Real::Binary64) };
        let file = Encoder::new(options.clone()).encode_to_vec(&mesh).unwrap();
        for back in by_every_road(&file) {
            assert_eq!(lists(&back), lists(&mesh));
        }
        // Without the exact coordinates there is still a vertex for each of the input, and triangles name the same ones.
        let file = Encoder::new(Options { exact: None, ..options }).encode_to_vec(&mesh).unwrap();
        for back in by_every_road(&file) {
            assert_eq!((back.positions.len(), &back.triangles), (mesh.positions.len(), &mesh.triangles));
        }
    }
}

/// A vertex with thousands of triangles and of instances: no list is gone through again and again.
#[test]
fn a_hub_of_many_instances() {
    let n = 30_000u32;
    let ring = |k: u32| {
        let turn = f64::from(k) / f64::from(n) * std::f64::consts::TAU;
        [turn.cos(), turn.sin(), 0.0]
    };
    let mut mesh = IndexedMesh::new((0..n).map(ring).collect(), Vec::new());
    mesh.positions.extend(vec![[0.0, 0.0, 1.0]; n as usize]);
    // Each instance of the hub is used twice, far apart.
    mesh.triangles = (0..n).map(|k| [n + k.wrapping_mul(7919) % n / 2, k, (k + 1) % n]).collect();
    let options = Options { keep_order: true, ..exact(Real::Binary64) };
    assert_eq!(lists(&back(&mesh, options)), lists(&mesh));
}

/// Real meshes below `$UNWELD_DATA` or `../shared/data`, good and bad, of which both arrays come back.
#[cfg(feature = "formats")]
#[test]
fn real_meshes_come_back() {
    use std::path::{Path, PathBuf};
    use unweld::formats::{self, Coordinates};
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data");
    let folder = std::env::var_os("UNWELD_DATA").map_or_else(beside, PathBuf::from);
    if !folder.is_dir() {
        eprintln!("skipped: no folder of real meshes at {}", folder.display());
        return;
    }
    let mut count = 0;
    for sub in ["", "nasty", "nasty_real", "tex_fuze", "tex_ico4uv", "tex_spot"] {
        let Ok(entries) = folder.join(sub).read_dir() else { continue };
        for path in entries.flatten().map(|entry| entry.path()) {
            // Whether a broken file is refused as it should be is another test's business.
            let Ok(source) = formats::read(&path) else { continue };
            let finite = source.mesh.positions.iter().flatten().all(|x| x.is_finite());
            if !finite || source.mesh.triangles.len() > 50_000 {
                continue;
            }
            let real = match source.coordinates {
                Coordinates::Float32 => Real::Binary32,
                _ => Real::Binary64,
            };
            for keep_order in [true, false] {
                let options = Options { keep_order, keyframes: Keyframes::Every(7), ..exact(real) };
                let back = match Encoder::new(options).encode_to_vec(&source.mesh) {
                    Ok(file) => {
                        decoder::decode(&file, decoder::Options::default()).unwrap().assembled().unwrap()
                    }
                    Err(unweld::Error::Parameter(what)) => {
                        assert!(what.contains("extent is infinite"), "{}: {what}", path.display());
                        continue;
                    }
                    Err(fault) => panic!("{}: {fault}", path.display()),
                };
                let same = match keep_order {
                    true => lists(&back) == lists(&source.mesh),
                    false => triangles(&back) == triangles(&source.mesh),
                };
                assert!(same, "{}: not the same, in order: {keep_order}", path.display());
            }
            count += 1;
        }
    }
    assert!(count > 60, "{count} meshes in {}", folder.display());
}
