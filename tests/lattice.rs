//! Which vertices are one, and which lattice they live on: welding of nearly equal vertices, lattices that meshes share.
#![cfg(feature = "encode")]

use proptest::prelude::*;
use std::collections::{HashMap, HashSet};
#[cfg(feature = "formats")]
use std::path::{Path, PathBuf};
use unweld::codec::grid::Real;
use unweld::container::parse_contents;
use unweld::decoder::{self, Decoder, Event};
use unweld::encoder::{Encoder, Keyframes, LatticeChoice, Options, Report};
use unweld::mesh::topology::{Weld, condition};
use unweld::mesh::{IndexedMesh, Lattice, shapes};

fn encoded(mesh: &IndexedMesh, options: Options) -> (Vec<u8>, Report) {
    let mut file = Vec::new();
    let report = Encoder::new(options).encode(mesh, &mut file).unwrap();
    (file, report)
}

fn back(file: &[u8]) -> IndexedMesh {
    decoder::decode(file, decoder::Options::default()).unwrap().assembled().unwrap()
}

fn bits(p: &[f64; 3]) -> [u64; 3] {
    p.map(f64::to_bits)
}

/// The bits of the corners of each triangle, from the least one; sorted.
fn triangles(mesh: &IndexedMesh) -> Vec<[[u64; 3]; 3]> {
    let turned = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| bits(&mesh.positions[v as usize]));
        [[a, b, c], [b, c, a], [c, a, b]].into_iter().min().unwrap()
    };
    let mut all: Vec<_> = mesh.triangles.iter().map(turned).collect();
    all.sort_unstable();
    all
}

// Which vertices are one.

/// A lattice for those that do not look at it.
fn unit() -> Lattice {
    Lattice { origin: [0.0; 3], step: 1.0, bits: 8 }
}

/// By the definition: each vertex with the least number that a chain leads to.
fn by_chains(positions: &[[f64; 3]], distance: f64) -> Vec<usize> {
    let near = |p: &[f64; 3], q: &[f64; 3]| {
        let squares = (0..3).map(|k| (p[k] - q[k]) / distance * ((p[k] - q[k]) / distance));
        squares.sum::<f64>() <= 1.0
    };
    let mut least: Vec<usize> = (0..positions.len()).collect();
    loop {
        let before = least.clone();
        for v in 0..least.len() {
            let reached = (0..least.len()).filter(|&w| near(&positions[v], &positions[w]));
            least[v] = reached.map(|w| before[w]).min().unwrap();
        }
        if least == before {
            return least;
        }
    }
}

/// What two lists of names have in common if they part the same things in the same way.
fn parts_of<T: std::hash::Hash + Eq + Copy>(names: &[T]) -> Vec<usize> {
    let mut first = HashMap::new();
    names.iter().enumerate().map(|(v, name)| *first.entry(*name).or_insert(v)).collect()
}

fn stand_for(positions: &[[f64; 3]], weld: Weld, lattice: &Lattice) -> Vec<u32> {
    let mesh = IndexedMesh::new(positions.to_vec(), Vec::new());
    let same = weld.representatives(&mesh, lattice);
    assert!(same.iter().all(|&v| same[v as usize] == v), "one that stands for others stands for itself");
    same
}

/// Places of which many are near each other.
fn crowd() -> impl Strategy<Value = Vec<[f64; 3]>> {
    let coordinate = prop_oneof![-2.0..2.0f64, (-8i32..8).prop_map(|k| f64::from(k) * 0.25), Just(-0.0)];
    prop::collection::vec(prop::array::uniform3(coordinate), 1..120)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn chains_are_followed_to_their_ends(positions in crowd(), distance in prop_oneof![0.01..1.0f64, Just(0.25), Just(4.0)]) {
        let same = stand_for(&positions, Weld::Within(distance), &unit());
        prop_assert_eq!(parts_of(&same), parts_of(&by_chains(&positions, distance)));
    }

    #[test]
    fn the_lattice_decides_by_its_points(positions in crowd(), step in 0.1..1.0f64) {
        let lattice = Lattice { origin: [-0.3, 0.0, 0.1], step, bits: 8 };
        let points: Vec<_> = positions.iter().map(|p| {
            let q: [i64; 3] = std::array::from_fn(|k| ((p[k] - lattice.origin[k]) / step).round() as i64);
            q
        }).collect();
        let same = stand_for(&positions, Weld::Lattice, &lattice);
        prop_assert_eq!(parts_of(&same), parts_of(&points));
    }

    #[test]
    fn the_order_of_the_vertices_does_not_matter(positions in crowd(), distance in 0.01..1.0f64, seed: u32) {
        let mut order: Vec<usize> = (0..positions.len()).collect();
        order.sort_by_key(|&v| (v as u32 ^ seed).wrapping_mul(0x9E37_79B9));
        let shuffled: Vec<_> = order.iter().map(|&v| positions[v]).collect();
        for weld in [Weld::Exact, Weld::Within(distance), Weld::Lattice] {
            let (same, other) = (stand_for(&positions, weld, &unit()), stand_for(&shuffled, weld, &unit()));
            for (place, &v) in order.iter().enumerate() {
                // The place that stands for it is the same, whichever index has it.
                let [x, y] = [positions[same[v] as usize], shuffled[other[place] as usize]];
                prop_assert_eq!(x, y);
            }
        }
    }

    /// Bodies lie over each other; what stands for a vertex is what would if its body were alone.
    #[test]
    fn bodies_are_welded_by_themselves(bodies in prop::collection::vec(crowd(), 1..4), distance in 0.01..1.0f64) {
        let firsts = bodies.iter().scan(0, |next, body| Some(std::mem::replace(next, *next + body.len() as u32)));
        let firsts: Vec<u32> = firsts.collect();
        let all = IndexedMesh { bodies: firsts.clone(), ..IndexedMesh::new(bodies.concat(), Vec::new()) };
        for weld in [Weld::Exact, Weld::None, Weld::Within(distance), Weld::Lattice] {
            let alone = bodies.iter().zip(&firsts).flat_map(|(body, &first)| {
                stand_for(body, weld, &unit()).into_iter().map(move |v| first + v)
            });
            prop_assert_eq!(weld.representatives(&all, &unit()), alone.collect::<Vec<_>>());
        }
    }
}

#[test]
fn bodies_in_one_place_stay_apart() {
    let one = shapes::tetrahedron();
    let count = one.positions.len() as u32;
    let twice = |bodies| IndexedMesh {
        bodies,
        ..IndexedMesh::new(
            [&one.positions[..], &one.positions].concat(),
            one.triangles.iter().copied().chain(one.triangles.iter().map(|t| t.map(|v| v + count))).collect(),
        )
    };
    let apart = condition(&twice(vec![0, count]), Weld::Exact);
    assert_eq!((apart.report.census.components, apart.report.welded_vertices), (2, 0));
    assert_eq!(apart.parts(Some(&unit()), &[0, count]), 2);
    let together = condition(&twice(vec![]), Weld::Exact);
    assert_eq!((together.report.repeated_triangles, together.report.welded_vertices), (4, 4));
    // They are kept apart all the way.
    for weld in [Weld::Exact, Weld::Lattice, Weld::Within(0.01)] {
        let mesh = twice(vec![0, count]);
        let (file, report) = encoded(&mesh, Options { weld, ..Options::default() });
        assert_eq!(report.conditioning.input_triangles, 8);
        assert_eq!((back(&file).positions.len(), back(&file).triangles.len()), (8, 8));
    }
}

#[test]
fn a_used_vertex_stands_for_one_that_is_not() {
    // The second is least, but in no triangle: it could lie outside the box of the lattice.
    let positions = vec![[0.0; 3], [-0.01, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let mesh = IndexedMesh::new(positions, vec![[0, 2, 3]]);
    assert_eq!(Weld::Within(0.1).representatives(&mesh, &unit()), [0, 0, 2, 3]);
}

/// Two crowds, each within the distance, of which no two vertices are: a centre, and a sphere round it. They cannot be told
/// apart without looking at all pairs; so many are not looked at, and the crowds count as near. Fewer are told apart.
#[test]
fn nobody_makes_it_compare_all_pairs() {
    let crowds = |n: u32| -> Vec<[f64; 3]> {
        let centre =
            (0..n).map(|k| [f64::from(k), f64::from(k * 5 % 97), f64::from(k * 7 % 89)].map(|x| x * 1e-13));
        let sphere = (0..n).map(|k| {
            let angle = f64::from(k) / f64::from(n) * 0.5;
            [(1.0 + 1e-8) * angle.cos(), (1.0 + 1e-8) * angle.sin(), 0.0]
        });
        centre.chain(sphere).collect()
    };
    let sets =
        |n| stand_for(&crowds(n), Weld::Within(1.0), &unit()).into_iter().collect::<HashSet<_>>().len();
    assert_eq!(sets(20), 2);
    assert_eq!(sets(20_000), 1);
}

// There and back.

/// A torus as a soup of corners, each moved a little.
fn loose(seed: u32, far: f64) -> IndexedMesh {
    let torus = shapes::torus_with_hole(10, 8);
    let mut mix = seed.wrapping_mul(0x9E37_79B9) | 1;
    let mut noise = || {
        mix = mix.wrapping_mul(0x0019_660D).wrapping_add(0x3C6E_F35F);
        if mix >> 30 == 0 { 0.0 } else { (f64::from(mix >> 8) / f64::from(1 << 23) - 1.0) * far }
    };
    let corner = |&v: &u32| torus.positions[v as usize].map(|x| x + noise());
    let mut positions: Vec<_> = torus.triangles.as_flattened().iter().map(corner).collect();
    let n = positions.len() as u32;
    // In no triangle: beside a vertex, and at one but for the sign of a zero.
    positions.push(positions[5].map(|x| x + far));
    positions[7][2] = 0.0;
    positions.push([positions[7][0], positions[7][1], -0.0]);
    IndexedMesh::new(positions, (0..n / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect())
}

fn in_binary32(mut mesh: IndexedMesh) -> IndexedMesh {
    mesh.positions.iter_mut().flatten().for_each(|x| *x = f64::from(*x as f32));
    mesh
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    /// Whatever is one, level 0 has all vertices where they were, by every road.
    #[test]
    fn exact_files_lose_nothing(
        seed: u32, far in prop_oneof![Just(1e-15), Just(1e-6), Just(0.05), Just(1.0)], single: bool, keep_order: bool,
        weld in prop::sample::select(vec![Weld::Exact, Weld::None, Weld::Lattice, Weld::Within(1e-5), Weld::Within(0.2)]),
        bits_a_coordinate in 8..=24u32,
    ) {
        let mesh = if single { in_binary32(loose(seed, far)) } else { loose(seed, far) };
        let exact = Some(if single { Real::Binary32 } else { Real::Binary64 });
        let position_bits = bits_a_coordinate;
        let mut options = Options { weld, exact, keep_order, position_bits, keyframes: Keyframes::All, ..Options::default() };
        options.simplify.base_vertices = Some(20);
        let (file, _) = encoded(&mesh, options);
        let back = back(&file);
        if keep_order {
            let lists = |mesh: &IndexedMesh| (mesh.positions.iter().map(bits).collect::<Vec<_>>(), mesh.triangles.clone());
            prop_assert_eq!(lists(&back), lists(&mesh));
        } else {
            prop_assert_eq!(triangles(&back), triangles(&mesh));
            let places = |mesh: &IndexedMesh| mesh.positions.iter().map(bits).collect::<HashSet<_>>();
            prop_assert_eq!(places(&back), places(&mesh));
        }
    }
}

/// On the lattice, too, all triangles are there, each from the corners that stand for its own.
#[test]
fn what_is_joined_is_in_one_place() {
    for weld in [Weld::Lattice, Weld::Within(0.1)] {
        let mesh = loose(3, 0.01);
        let (file, report) = encoded(&mesh, Options { weld, position_bits: 10, ..Options::default() });
        let lattice = parse_contents(&file).unwrap().unwrap().header.lattice;
        let same = weld.representatives(&mesh, &lattice);
        let place = |&v: &u32| lattice.position(lattice.quantise(mesh.positions[v as usize]));
        let wanted = IndexedMesh::new(same.iter().map(place).collect(), mesh.triangles.clone());
        assert_eq!(triangles(&back(&file)), triangles(&wanted), "{weld}");
        // How many places there were and are, and how far apart.
        let distinct: HashSet<_> = mesh.positions.iter().map(|p| p.map(|x| (x + 0.0).to_bits())).collect();
        let sets: HashSet<_> = same.iter().collect();
        assert_eq!(report.conditioning.joined_vertices, distinct.len() - sets.len());
        let apart = |v: usize| {
            let (p, q) = (mesh.positions[v], mesh.positions[same[v] as usize]);
            (0..3).map(|k| (p[k] - q[k]).powi(2)).sum::<f64>().sqrt()
        };
        let most = (0..same.len()).map(apart).fold(0.0, f64::max);
        assert!(most > 0.0 && (report.joined.distance - most).abs() < 1e-12, "{most}");
        // The error of level 0 in the table holds for every vertex of the input: of its own a level 0 has but half a step an axis,
        // and the table rounds it up.
        let decoded = decoder::decode(&file, decoder::Options::default()).unwrap();
        let told = decoded.contents().unwrap().levels[0].max_error;
        let found = most + lattice.step * 0.75f64.sqrt() * 1.001;
        assert!(told >= most && told <= found * (1.0 + 1.0 / 128.0), "{told} for {most}");
        let told = decoded.metadata().unwrap();
        assert!(told.settings.contains(&("weld".to_owned(), weld.to_string())), "{:?}", told.settings);
        assert!(told.conditioning.iter().any(|(name, n)| name == "joined_vertices" && *n > 0));
    }
}

#[test]
fn nothing_changes_where_nothing_is_joined() {
    let mesh = shapes::bumpy_sphere(3, 1);
    let file = |weld| encoded(&mesh, Options { weld, position_bits: 20, ..Options::default() });
    let (plain, report) = file(Weld::Exact);
    assert_eq!(
        (report.conditioning.joined_vertices, report.joined.parts, report.joined.lattice_parts),
        (0, 1, 1)
    );
    for weld in [Weld::Lattice, Weld::Within(1e-9), Weld::Within(0.0)] {
        assert!(file(weld).0 == plain, "{weld}");
    }
}

/// 160 triangles each for itself, or one surface.
#[test]
fn parts_are_counted_as_they_are_and_as_the_lattice_has_them() {
    let torus = shapes::torus(10, 8);
    let mut mesh = torus.clone();
    mesh.positions = torus.triangles.as_flattened().iter().map(|&v| torus.positions[v as usize]).collect();
    for (k, p) in mesh.positions.iter_mut().enumerate() {
        p[0] += k as f64 * 1e-12;
    }
    mesh.triangles = (0..160).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    let joined = |weld| encoded(&mesh, Options { weld, position_bits: 12, ..Options::default() }).1.joined;
    let (exact, lattice) = (joined(Weld::Exact), joined(Weld::Lattice));
    assert_eq!((exact.parts, exact.lattice_parts, exact.distance), (160, 1, 0.0));
    assert_eq!((lattice.parts, lattice.lattice_parts), (1, 1));
    assert_eq!(condition(&mesh, Weld::Lattice).report.census, condition(&torus, Weld::Exact).report.census);
}

// Lattices that are shared.

/// A grid of 12 by 12 rectangles from a corner on, the first one or the one beside it, with edges that are no multiples of
/// anything.
fn tile(beside: bool, [x, y]: [f64; 2], height: impl Fn(f64, f64) -> f64) -> IndexedMesh {
    let columns = if beside { 12..=24 } else { 0..=12 };
    let places = columns.flat_map(|i| (0..=12).map(move |j| (f64::from(i), f64::from(j))));
    let place = |(i, j)| {
        let (u, v) = (x + i * 1.103, y + j * 0.897);
        [u, v, height(u, v)]
    };
    let squares = (0..12u32).flat_map(|i| (0..12u32).map(move |j| 13 * i + j));
    let triangles = squares.flat_map(|v| [[v, v + 13, v + 14], [v, v + 14, v + 1]]);
    IndexedMesh::new(places.map(place).collect(), triangles.collect())
}

/// For each level from the base to level 0 the positions of its vertices.
fn levels(file: &[u8]) -> Vec<Vec<[f64; 3]>> {
    let mut decoder = Decoder::new(decoder::Options::default());
    decoder.push(file);
    let mut levels = Vec::new();
    while let Some(event) = decoder.poll().unwrap() {
        if let Event::Level { .. } = event {
            let lattice = decoder.contents().unwrap().header.lattice;
            levels.push(decoder.mesh().positions.iter().map(|&q| lattice.position(q)).collect());
        }
    }
    levels
}

/// A number to the nearest multiple of a power of two, halves upwards.
fn to_multiple(x: f64, step: f64) -> f64 {
    // Exact: the quotient by a power of two, its floor, and the difference of the two.
    let quotient = x / step;
    let below = quotient.floor();
    (if quotient - below >= 0.5 { below + 1.0 } else { below }) * step + 0.0
}

/// The places that both meshes have, as the lattice of this step has them.
fn border(a: &IndexedMesh, b: &IndexedMesh, step: f64) -> HashSet<[u64; 3]> {
    let places: HashSet<_> = a.positions.iter().map(bits).collect();
    let both = b.positions.iter().filter(|p| places.contains(&bits(p)));
    both.map(|p| bits(&p.map(|x| to_multiple(x, step)))).collect()
}

fn has_all(level: &[[f64; 3]], wanted: &HashSet<[u64; 3]>) -> bool {
    let there: HashSet<_> = level.iter().map(|p| bits(&p.map(|x| x + 0.0))).collect();
    wanted.is_subset(&there)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    /// Wherever two tiles lie, and wherever the lattice's origin is, the border they have in common stays common: bit for
    /// bit, at level 0, and at every level where it is locked. Each place is the nearest multiple of the step.
    #[test]
    fn tiles_meet(
        x in prop::sample::select(vec![0.0, -3.7, 450_000.0, -5_400_000.3, 1e9]),
        y in prop::sample::select(vec![0.0, -1e5 - 0.1, 5_400_000.7]),
        shift in prop::sample::select(vec![0.0, 7.0, -1024.0, 3e6]),
        power in 3..=14i32, noise: u32, halves: bool, locked: bool,
    ) {
        let step = 2f64.powi(-power);
        let height = |u: f64, v: f64| {
            let h = ((u * 0.37 + f64::from(noise % 1000)).sin() + (v * 0.71).cos()) * 3.0;
            if halves { ((h / step).floor() + 0.5) * step } else { h }
        };
        let (a, b) = (tile(false, [x, y], height), tile(true, [x, y], height));
        let common = border(&a, &b, step);
        prop_assert_eq!(common.len(), 13);
        let lattice = LatticeChoice::Given { step, origin: [shift, -shift, 0.0] };
        for mesh in [&a, &b] {
            let mut options = Options { lattice, lock_boundary: locked, ..Options::default() };
            options.simplify.base_vertices = Some(10);
            let (file, report) = encoded(mesh, options);
            prop_assert!(report.lattice_is_exact);
            let levels = levels(&file);
            prop_assert!(levels.len() > 1);
            let reached = if locked { &levels[..] } else { &levels[levels.len() - 1..] };
            for level in reached {
                prop_assert!(has_all(level, &common));
            }
        }
    }
}

/// A lattice of its own for each tile does not do: that is what the test above would see.
#[test]
fn tiles_of_their_own_do_not_meet() {
    let height = |u: f64, v: f64| (u * 0.37).sin() + (v * 0.71).cos();
    // Other extents, and so other lattices.
    let steep = |u: f64, v: f64| height(u, v) + 10.0 * (u - (100.3 + 12.0 * 1.103));
    let (a, b) = (tile(false, [100.3, 7.1], height), tile(true, [100.3, 7.1], steep));
    let common = border(&a, &b, 2f64.powi(-10));
    assert_eq!(common.len(), 13);
    assert!(
        ![&a, &b]
            .iter()
            .all(|mesh| has_all(levels(&encoded(mesh, Options::default()).0).last().unwrap(), &common))
    );
}

#[test]
fn a_step_that_is_no_power_of_two_is_told() {
    let mesh = shapes::bumpy_sphere(2, 1);
    let given =
        |step, origin| Options { lattice: LatticeChoice::Given { step, origin }, ..Options::default() };
    let is_exact = |options| encoded(&mesh, options).1.lattice_is_exact;
    assert!(is_exact(given(0.0625, [0.0; 3])) && is_exact(given(0.0625, [0.5, -64.0, 0.0625])));
    assert!(!is_exact(given(0.1, [0.0; 3])) && !is_exact(given(0.0625, [0.1, 0.0, 0.0])));
    // Within half a step it is right all the same.
    let back = back(&encoded(&mesh, given(0.1, [0.03; 3])).0);
    let nearest = |p: &[f64; 3]| p.map(|x| ((x - 0.03) / 0.1).round());
    let there: HashSet<_> = back.positions.iter().map(|p| nearest(p).map(|x| x as i64)).collect();
    assert!(mesh.positions.iter().all(|p| there.contains(&nearest(p).map(|x| x as i64))));
}

#[test]
fn the_fewest_bits_for_a_step() {
    let mesh = shapes::bumpy_sphere(3, 1);
    for step in [0.5, 0.01, 1e-4, 3e-6] {
        let (file, _) =
            encoded(&mesh, Options { lattice: LatticeChoice::AtMost(step), ..Options::default() });
        let lattice = parse_contents(&file).unwrap().unwrap().header.lattice;
        let extent = lattice.step * f64::from((1u32 << lattice.bits) - 1);
        assert!(lattice.step <= step, "{step}");
        assert!(lattice.bits == 8 || extent / f64::from((1u32 << (lattice.bits - 1)) - 1) > step, "{step}");
        // It is the file that these bits give.
        assert!(file == encoded(&mesh, Options { position_bits: lattice.bits, ..Options::default() }).0);
    }
}

#[test]
fn impossible_lattices_are_refused() {
    let mesh = shapes::sphere(1);
    let refused = |options: Options| Encoder::new(options).encode_to_vec(&mesh).unwrap_err().to_string();
    let given = |step, origin| {
        refused(Options { lattice: LatticeChoice::Given { step, origin }, ..Options::default() })
    };
    for step in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let told = format!("the step of the lattice must be above 0 and finite, not {step}");
        assert!(given(step, [0.0; 3]).contains(&told));
        assert!(
            refused(Options { lattice: LatticeChoice::AtMost(step), ..Options::default() }).contains(&told)
        );
    }
    assert!(given(1.0, [0.0, f64::NAN, 0.0]).contains("the origin of the lattice must be finite, not NaN"));
    let said = given(2f64.powi(-30), [0.0; 3]);
    assert!(
        said.contains("lattice steps of") && said.contains("more than 24 bits a coordinate hold: a step of"),
        "{said}"
    );
    assert!(given(1.0, [1e300, 0.0, 0.0]).contains("more than 2^48 lattice steps of 1 from"));
    // Smaller than any number that divides the extent.
    assert!(given(5e-324, [0.0; 3]).contains("more than 2^48 lattice steps of"));
    // The step that is named does.
    let enough: f64 =
        said.rsplit_once("a step of ").unwrap().1.strip_suffix(" would do").unwrap().parse().unwrap();
    encoded(
        &mesh,
        Options { lattice: LatticeChoice::Given { step: enough, origin: [0.0; 3] }, ..Options::default() },
    );
    for distance in [-1.0, f64::NAN, f64::INFINITY] {
        let told = format!("the distance of welding must be at least 0 and finite, not {distance}");
        assert!(refused(Options { weld: Weld::Within(distance), ..Options::default() }).contains(&told));
    }
}

// Meshes from elsewhere: `$UNWELD_DATA` or `../shared/data`.

#[cfg(feature = "formats")]
fn field(case: &str, name: &str) -> Option<IndexedMesh> {
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data");
    let path = std::env::var_os("UNWELD_DATA")
        .map_or_else(beside, PathBuf::from)
        .join("field")
        .join(case)
        .join(name);
    if !path.exists() {
        eprintln!("skipped: there is no {}", path.display());
        return None;
    }
    Some(unweld::formats::read(&path).unwrap().mesh)
}

/// A torus of 9,216 triangles; in the other file 30 % of the corners differ by one unit in the last place of binary32.
#[cfg(feature = "formats")]
#[test]
fn a_torus_of_nearly_equal_vertices() {
    let case = "nearly_equal_vertices/torus_ulp";
    let (Some(loose), Some(welded)) = (field(case, "torus_ulp.stl"), field(case, "torus_welded.stl")) else {
        return;
    };
    let (wanted, _) = encoded(&welded, Options::default());
    for weld in [Weld::Lattice, Weld::Within(1e-5)] {
        let (file, report) = encoded(&loose, Options { weld, ..Options::default() });
        let census = &report.conditioning.census;
        assert_eq!((census.components, census.handles, census.boundary_loops), (1, 1, 0), "{weld}");
        let contents = parse_contents(&file).unwrap().unwrap();
        assert!((290..=310).contains(&contents.header.base_triangles), "{}", contents.header.base_triangles);
        assert!(file.len() * 10 <= wanted.len() * 11, "{} bytes, not {}", file.len(), wanted.len());
        for keep_order in [false, true] {
            let options = Options { weld, keep_order, exact: Some(Real::Binary32), ..Options::default() };
            let back = back(&encoded(&loose, options).0);
            assert_eq!(triangles(&back), triangles(&loose), "{weld}");
            assert!(!keep_order || back.positions.iter().map(bits).eq(loose.positions.iter().map(bits)));
        }
    }
    let apart = encoded(&loose, Options::default()).1.joined;
    assert!(apart.parts > 500 && apart.lattice_parts == 1, "{apart:?}");
}

/// Two tiles of 200 m with heights and 101 vertices in common, far from the origin.
#[cfg(feature = "formats")]
#[test]
fn two_tiles_of_a_map() {
    let case = "tiles_share_no_lattice/two_tiles_level0";
    let (Some(a), Some(b)) = (field(case, "tileA.ply"), field(case, "tileB.ply")) else { return };
    let step = 2f64.powi(-10);
    let places: HashSet<_> = a.positions.iter().map(bits).collect();
    assert_eq!(b.positions.iter().filter(|p| places.contains(&bits(p))).count(), 101);
    let common = border(&a, &b, step);
    assert_eq!(common.len(), 101);
    for lock_boundary in [false, true] {
        for mesh in [&a, &b] {
            let lattice = LatticeChoice::Given { step, origin: [450_000.0, 5_400_000.0, 0.0] };
            let levels = levels(&encoded(mesh, Options { lattice, lock_boundary, ..Options::default() }).0);
            let reached = if lock_boundary { &levels[..] } else { &levels[levels.len() - 1..] };
            assert!(levels.len() > 5 && reached.iter().all(|level| has_all(level, &common)));
        }
    }
}
