use super::*;
use crate::mesh::random::SplitMix64;
use crate::mesh::shapes;
use crate::reduce::tests::topology;
use proptest::prelude::*;

const RULES: [Rule; 2] = [Rule::Of2015, Rule::Of2016];
const GUARDS: [Guard; 3] = [Guard::Veto, Guard::Blind, Guard::Independent];

fn view(mesh: &IndexedMesh, turn: f64, pixels: f64) -> View {
    let far = 1.5 * mesh.diagonal();
    let eye = [far * turn.cos(), far * turn.sin(), far / 3.0];
    View { eye, pixels, height: 1000.0, fov: 50.0 }
}

/// All ways of simplifying a mesh.
fn all_ways(mesh: &IndexedMesh) -> impl Iterator<Item = (Option<View>, Options)> {
    let views = [None, Some(view(mesh, 1.0, 20.0))];
    let options =
        RULES.into_iter().flat_map(|rule| GUARDS.map(|guard| Options { rule, guard, ..Options::default() }));
    options.flat_map(move |options| views.map(|view| (view, options)))
}

#[test]
fn a_manifold_stays_one_of_the_same_topology() {
    let meshes = [
        shapes::bumpy_sphere(3, 1),
        shapes::torus(30, 20),
        shapes::torus(40, 4),
        shapes::torus_with_hole(20, 12),
        shapes::grid(15, 9),
        shapes::annulus(40),
        shapes::handle_body(3),
        shapes::two_components(),
        shapes::disc_with_ears(),
        shapes::tetrahedron(),
        shapes::strip(30),
    ];
    for mesh in &meshes {
        let before = topology(mesh);
        for spacing in [2, 3, 40] {
            let surface = Surface::new(mesh, spacing).unwrap();
            assert!(surface.locked().iter().all(|&locked| !locked));
            for (view, options) in all_ways(mesh) {
                let result = surface.simplify(view.as_ref(), options).unwrap();
                assert_eq!(topology(&surface.mesh(&result.triangles)), before, "{options:?}");
                let used: Vec<u32> = result.triangles.as_flattened().to_vec();
                let stay = (0..).zip(surface.guaranteed()).filter(|(_, stays)| **stays);
                stay.for_each(|(v, _)| assert!(used.contains(&v)));
                let removed: usize = result.iterations.iter().map(|i| i.removed).sum();
                assert_eq!(surface.mesh(&result.triangles).positions.len() + removed, mesh.positions.len());
            }
        }
    }
}

#[test]
fn most_vertices_go_at_once() {
    let mesh = shapes::bumpy_sphere(4, 3);
    let surface = Surface::new(&mesh, 3).unwrap();
    let stay = surface.guaranteed().iter().filter(|&&stays| stays).count();
    let by = |rule, guard| surface.simplify(None, Options { rule, guard, ..Options::default() }).unwrap();
    let [veto, of_2015] = [Rule::Of2016, Rule::Of2015].map(|rule| by(rule, Guard::Veto));
    let independent = by(Rule::Of2016, Guard::Independent);
    let first = |result: &Simplified| result.iterations[0].removed as f64 / mesh.positions.len() as f64;
    assert!(first(&veto) > 0.6 && first(&independent) < 0.2);
    assert!(veto.iterations.len() <= of_2015.iterations.len());
    // Nothing but the guaranteed ones is left, or nearly so.
    assert!(surface.mesh(&veto.triangles).positions.len() <= stay + stay / 20);
}

#[test]
fn any_number_of_threads_makes_the_same_mesh() {
    let meshes = [
        shapes::bumpy_sphere(4, 9),
        shapes::torus_with_hole(50, 31),
        shapes::grid(60, 45),
        shapes::handle_body(4),
        shapes::two_components(),
    ];
    for mesh in &meshes {
        let surface = Surface::new(mesh, 4).unwrap();
        for k in 0..20 {
            let view = (k > 0).then(|| view(mesh, f64::from(k) * 0.3, f64::from(1 << (k % 7))));
            let of =
                |threads| surface.simplify(view.as_ref(), Options { threads, ..Options::default() }).unwrap();
            let alone = of(1);
            assert_eq!(of(2), alone);
            assert_eq!(of(8), alone);
        }
    }
}

#[test]
fn who_is_near_sees_more() {
    let mesh = shapes::bumpy_sphere(4, 2);
    let surface = Surface::new(&mesh, 6).unwrap();
    let count = |view: &View| surface.simplify(Some(view), Options::default()).unwrap().triangles.len();
    let plain = view(&mesh, 0.0, 2.0);
    let mut counts = vec![count(&plain)];
    for factor in [4.0, 16.0, 1000.0] {
        counts.push(count(&View { eye: plain.eye.map(|x| x * factor), ..plain }));
    }
    assert!(counts.is_sorted_by(|a, b| a >= b) && counts[0] > 2 * counts[3], "{counts:?}");
    // An error of no pixel keeps what is not flat, however far it is.
    assert_eq!(count(&View { pixels: 1e-9, ..plain }), mesh.triangles.len());
    // Twice the pixels of twice the picture are the same.
    assert_eq!(count(&View { pixels: 4.0, height: 2000.0, ..plain }), counts[0]);
    let all = surface.simplify(None, Options::default()).unwrap().triangles.len();
    assert_eq!(count(&View { pixels: 1e9, ..plain }), all);
}

#[test]
fn the_near_side_is_finer() {
    let mesh = shapes::bumpy_sphere(5, 2);
    let surface = Surface::new(&mesh, 6).unwrap();
    let view = View { eye: [2.5, 0.0, 0.0], pixels: 6.0, height: 1000.0, fov: 50.0 };
    let small = surface.mesh(&surface.simplify(Some(&view), Options::default()).unwrap().triangles);
    let near = small.positions.iter().filter(|p| p[0] > 0.0).count();
    assert!(near > small.positions.len() - near);
}

#[test]
fn views_out_of_range_are_refused() {
    let mesh = shapes::sphere(1);
    let surface = Surface::new(&mesh, 3).unwrap();
    let good = view(&mesh, 0.0, 1.0);
    let bad = [
        View { eye: [f64::NAN, 0.0, 0.0], ..good },
        View { pixels: 0.0, ..good },
        View { pixels: f64::INFINITY, ..good },
        View { height: -1.0, ..good },
        View { fov: 180.0, ..good },
    ];
    for view in bad {
        assert!(matches!(surface.simplify(Some(&view), Options::default()), Err(Error::Parameter(_))));
    }
    for spacing in [0, 256] {
        assert!(matches!(Surface::new(&mesh, spacing), Err(Error::Parameter(_))));
    }
    // The extremes of what is allowed do no harm.
    for eye in [[0.0; 3], [1e300, -1e300, 0.0], [1e-300; 3]] {
        for (pixels, height, fov) in [(1e300, 1e-300, 179.9), (1e-300, 1e300, 1e-9)] {
            surface.simplify(Some(&View { eye, pixels, height, fov }), Options::default()).unwrap();
        }
    }
}

#[test]
fn odd_meshes() {
    let mut random = SplitMix64::new(4);
    let mut corner = || random.below(30);
    let soup: Vec<[u32; 3]> = (0..200).map(|_| [corner(), corner(), corner()]).collect();
    let mut random = SplitMix64::new(5);
    let positions: Vec<[f64; 3]> = (0..300).map(|_| std::array::from_fn(|_| random.unit())).collect();
    let fan = |n: u32| (1..n).map(|k| [0, k, k + 1]).collect::<Vec<_>>();
    let mut in_one_place = shapes::bumpy_sphere(2, 1);
    in_one_place.positions.fill([3.0; 3]);
    let mut huge = shapes::bumpy_sphere(2, 1);
    huge.positions.iter_mut().flatten().for_each(|x| *x *= 1e100);
    let meshes = [
        IndexedMesh::new(positions.clone(), soup),
        IndexedMesh::new(positions.clone(), (0..100).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect()),
        IndexedMesh::new(positions.clone(), fan(299)),
        IndexedMesh::new(positions.clone(), fan(200)),
        IndexedMesh::new(positions, (2..100).map(|k| [0, 1, k]).collect()),
        in_one_place,
        huge,
        IndexedMesh::default(),
    ];
    for mesh in &meshes {
        for spacing in [1, 2, 5] {
            let surface = Surface::new(mesh, spacing).unwrap();
            for (view, options) in all_ways(mesh) {
                let result = surface.simplify(view.as_ref(), options).unwrap();
                assert!(result.triangles.len() <= mesh.triangles.len());
                assert!(result.triangles.iter().all(|&[a, b, c]| a != b && b != c && c != a));
            }
        }
    }
    let nan = IndexedMesh::new(vec![[0.0; 3], [1.0; 3], [f64::NAN; 3]], vec![[0, 1, 2]]);
    assert!(matches!(Surface::new(&nan, 3), Err(Error::Parameter(_))));
}

#[test]
fn what_is_no_manifold_stays() {
    // Three sheets on one edge, each a grid.
    let n = 12;
    let grid = shapes::grid(n, n);
    let width = n + 1;
    let mut mesh = IndexedMesh::default();
    for sheet in 0..3u32 {
        let first = mesh.positions.len() as u32;
        let turn = f64::from(sheet) * 2.0;
        mesh.positions.extend((0..width * width).map(|k| {
            let [x, y] = [k % width, k / width].map(f64::from);
            [x * turn.cos(), x * turn.sin(), y]
        }));
        let name = |v: u32| if v.is_multiple_of(width) { v } else { v + first };
        mesh.triangles.extend(grid.triangles.iter().map(|t| t.map(name)));
    }
    let surface = Surface::new(&mesh, 3).unwrap();
    let result = surface.simplify(None, Options::default()).unwrap();
    assert!(result.triangles.len() < mesh.triangles.len() / 2);
    let edge_triangles = |triangles: &[[u32; 3]]| {
        triangles
            .iter()
            .filter(|t| t.iter().filter(|v| **v % width == 0 && **v < width * width).count() == 2)
            .count()
    };
    assert_eq!(
        edge_triangles(&surface.mesh(&surface.triangles).triangles),
        edge_triangles(&surface.triangles)
    );
    assert_eq!(edge_triangles(&result.triangles), edge_triangles(surface.triangles()));
}

#[test]
fn no_triangle_turns_over_on_a_plane() {
    // A flat piece with random vertices: every triangle must still look up, and the area is the same.
    let mut mesh = shapes::grid(25, 25);
    let mut random = SplitMix64::new(8);
    for (k, p) in mesh.positions.iter_mut().enumerate() {
        let [x, y] = [k % 26, k / 26];
        let mut off = |x: usize| x as f64 + if x == 0 || x == 25 { 0.0 } else { 0.6 * random.unit() - 0.3 };
        *p = [off(x), off(y), 0.0];
    }
    let double_area = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| mesh.positions[v as usize]);
        (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    };
    let total = |triangles: &[[u32; 3]]| triangles.iter().map(double_area).sum::<f64>();
    for (view, options) in all_ways(&mesh) {
        let surface = Surface::new(&mesh, 3).unwrap();
        let result = surface.simplify(view.as_ref(), options).unwrap();
        assert!(result.triangles.iter().all(|t| double_area(t) > 0.0));
        // Corners may go, edges of the square do not bend inwards.
        assert!(total(&result.triangles) <= total(&mesh.triangles) + 1e-6);
        assert!(total(&result.triangles) > 0.9 * total(&mesh.triangles));
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn the_storage_of_triangles_does_not_matter(seed: u64, spacing in 2u32..6, rule in 0usize..2, guard in 0usize..3, pixels in 1u32..40) {
        let mesh = shapes::bumpy_sphere(2, seed);
        let mut random = SplitMix64::new(seed);
        let mut other = mesh.clone();
        for k in (1..other.triangles.len()).rev() {
            other.triangles.swap(k, random.below(k as u32 + 1) as usize);
            other.triangles[k].rotate_left(random.below(3) as usize);
        }
        let options = Options { rule: RULES[rule], guard: GUARDS[guard], threads: 1 };
        let view = (pixels < 30).then(|| view(&mesh, f64::from(pixels), f64::from(pixels)));
        let of = |mesh: &IndexedMesh| {
            let surface = Surface::new(mesh, spacing).unwrap();
            let result = surface.simplify(view.as_ref(), options).unwrap();
            let mut triangles: Vec<[u32; 3]> = result.triangles.iter().map(|&[a, b, c]| {
                let least = a.min(b).min(c);
                if a == least { [a, b, c] } else if b == least { [b, c, a] } else { [c, a, b] }
            }).collect();
            triangles.sort_unstable();
            (triangles, result.iterations)
        };
        prop_assert_eq!(of(&mesh), of(&other));
    }
}
