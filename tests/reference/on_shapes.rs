//! Both decoders on what the encoder makes of meshes.

use proptest::prelude::*;
use unweld::codec::grid::Real;
use unweld::encoder::{Encoder, Keyframes, Options, Preview};
use unweld::mesh::topology::Weld;
use unweld::mesh::{IndexedMesh, Lattice, shapes};
use unweld::simplify::Method;

use super::agree::{agree, sorted};
use super::container::File;
use super::golden::same_bits;
use super::residue::Whole;

pub fn every_shape() -> Vec<IndexedMesh> {
    vec![
        shapes::tetrahedron(),
        shapes::disc_with_ears(),
        shapes::annulus(9),
        shapes::strip(12),
        shapes::grid(6, 5),
        shapes::torus(8, 7),
        shapes::torus_with_hole(9, 8),
        shapes::two_components(),
        shapes::handle_body(3),
        shapes::sphere(2),
        shapes::bumpy_sphere(2, 5),
    ]
}

#[test]
fn shapes_in_every_way() {
    let mut seed = 0;
    for mesh in every_shape() {
        for method in [Method::Stellar, Method::Ffc] {
            for keyframes in [Keyframes::None, Keyframes::Every(3), Keyframes::All] {
                for preview in [Preview::Off, Preview::Schedule(vec![1, 2, 5])] {
                    let mut options = Options { keyframes: keyframes.clone(), preview, ..Options::default() };
                    options.simplify.method = method;
                    options.simplify.seed = seed;
                    options.simplify.base_vertices = Some([1, 10][seed as usize % 2]);
                    options.atom_bytes = [60, 1, 16 << 10][seed as usize % 3];
                    options.position_bits = [14, 8, 24][seed as usize / 3 % 3];
                    options.rich_models = Some(seed % 7 < 3);
                    seed += 1;
                    let bytes = Encoder::new(options).encode_to_vec(&mesh).unwrap();
                    agree(&bytes).expect("the encoder writes what can be read");
                }
            }
        }
    }
}

/// Asserts that the whole is the mesh on the lattice: the same triangles, as often, turned the same way.
pub fn same_triangles(mesh: &IndexedMesh, whole: &Whole, file: &File) {
    let lattice = Lattice { origin: file.origin, step: file.step, bits: file.bits };
    let point = |v: u32| file.position(lattice.quantise(mesh.positions[v as usize]).map(i64::from));
    let expected = sorted(mesh.triangles.iter().map(|t| t.map(point)));
    let found = sorted(whole.triangles.iter().map(|t| t.map(|v| whole.positions[v])));
    assert!(expected == found, "the whole is not the mesh on the lattice");
}

fn comes_back(mesh: &IndexedMesh, options: &Options) {
    let bytes = Encoder::new(options.clone()).encode_to_vec(mesh).unwrap();
    let seen = agree(&bytes).expect("the encoder writes what can be read");
    same_triangles(mesh, &seen.whole, &File::read(&bytes).unwrap());
}

fn with_keyframes() -> Options {
    let mut options = Options { keyframes: Keyframes::All, atom_bytes: 60, ..Options::default() };
    options.simplify.base_vertices = Some(6);
    options
}

/// Cones of so many triangles round a tip, apart from each other.
pub fn cones(counts: &[u32]) -> IndexedMesh {
    let mut mesh = IndexedMesh::default();
    for (place, &n) in counts.iter().enumerate() {
        let (x, tip) = (3.0 * place as f64, mesh.positions.len() as u32);
        mesh.positions.push([x, 0.0, 0.4]);
        let turn = |i: u32| std::f64::consts::TAU * f64::from(i) / f64::from(n);
        mesh.positions.extend((0..n).map(|i| [x + turn(i).cos(), turn(i).sin(), 0.01 * f64::from(i % 3)]));
        mesh.triangles.extend((0..n).map(|i| [tip, tip + 1 + i, tip + 1 + (i + 1) % n]));
    }
    mesh
}

/// The last contexts of caps: each loop is as long as the valence of a tip.
#[test]
fn high_valences() {
    for counts in [&[64][..], &[29, 30, 31, 32, 33]] {
        comes_back(&cones(counts), &Options { lock_boundary: true, ..with_keyframes() });
        comes_back(&cones(counts), &with_keyframes());
    }
}

/// Spheres, sheets and loose triangles of many sizes: most of them are born late.
#[test]
fn components_of_many_sizes() {
    let loose = IndexedMesh::new(vec![[0.0; 3], [1.0, 0.2, 0.1], [0.3, 1.0, 0.5]], vec![[0, 1, 2]]);
    let parts = [shapes::bumpy_sphere(1, 5), shapes::grid(2, 2), loose.clone(), shapes::torus(4, 5), loose];
    for count in [4, 17, 60] {
        let mut mesh = IndexedMesh::default();
        for k in 0..count {
            let (part, first) = (&parts[k % parts.len()], mesh.positions.len() as u32);
            let turn = |n: usize| (k as f64 * 0.618 + n as f64 * 0.37).fract();
            let size = 0.5f64.powf(5.0 * turn(1));
            let at = [2, 3, 4].map(|n| 10.0 * turn(n * (1 + k % 3)));
            mesh.positions.extend(part.positions.iter().map(|p| [0, 1, 2].map(|i| at[i] + size * p[i])));
            mesh.triangles.extend(part.triangles.iter().map(|t| t.map(|v| v + first)));
        }
        for preview in [Preview::Off, Preview::Auto, Preview::Schedule(vec![1, 2, 5])] {
            for lifting in [0, 13] {
                let options =
                    Options { preview: preview.clone(), lifting: Some(lifting), ..with_keyframes() };
                comes_back(&mesh, &options);
                let bytes = Encoder::new(options).encode_to_vec(&mesh).unwrap();
                let file = File::read(&bytes).unwrap();
                assert!(count == 4 || file.atoms.iter().any(|atom| atom.kind == super::container::BIRTH));
            }
        }
    }
}

/// Tips that the input has seven times each, used at their corners in no order.
#[test]
fn vertices_of_seven_instances() {
    let mut mesh = cones(&[40; 12]);
    let tips: Vec<u32> = (0..12).map(|i| 41 * i).collect();
    let first = mesh.positions.len() as u32;
    for &tip in &tips {
        mesh.positions.extend([mesh.positions[tip as usize]; 6]);
    }
    for (k, t) in mesh.triangles.iter_mut().enumerate() {
        let copies = first + t[0] / 41 * 6;
        // Often the one before, else any.
        let any = [k * k % 6, k / 2 % 6, k * 7 / 3 % 6].map(|copy| copies + copy as u32);
        t[0] = [t[0], any[0], any[1], any[2]][k % 4];
    }
    let options = Options { exact: Some(Real::Binary64), keep_order: true, ..with_keyframes() };
    let bytes = Encoder::new(options).encode_to_vec(&mesh).unwrap();
    same_bits(&mesh, &agree(&bytes).expect("the encoder writes what can be read").whole, true);
}

/// Three bow-ties in one place, which a reader must tell apart.
#[test]
fn groups_in_one_place() {
    let mut mesh = IndexedMesh::new(vec![[0.0; 3]; 3], vec![]);
    for i in 0..9 {
        let first = mesh.positions.len() as u32;
        mesh.positions.extend([[f64::from(i), 1.0, 2.0], [f64::from(i), 2.0, 1.0]]);
        mesh.triangles.push([i % 3, first, first + 1]);
    }
    comes_back(&mesh, &Options { weld: Weld::None, ..with_keyframes() });
    let bytes = Encoder::new(Options { weld: Weld::None, ..with_keyframes() }).encode_to_vec(&mesh).unwrap();
    // The three stay three: the whole has the vertices that went in.
    assert_eq!(agree(&bytes).map(|seen| seen.whole.positions.len()), Some(mesh.positions.len()));
}

/// A sheet with something added to it.
fn sheet(positions: &[[f64; 3]], triangles: &[[u32; 3]]) -> IndexedMesh {
    let mut mesh = shapes::grid(5, 4);
    mesh.positions.extend(positions);
    mesh.triangles.extend(triangles);
    mesh
}

#[test]
fn what_no_manifold_holds() {
    // The sheet has vertices 0 to 29; (0, 1, 7) is a triangle of its first square.
    let (p, q) = ([1.0, 1.0, 2.0], [2.0, 1.0, 2.5]);
    let first = shapes::grid(5, 4).triangles[0];
    let [a, b, c] = first;
    let moebius = |n: u32| -> IndexedMesh {
        let ring = |i: u32| std::f64::consts::TAU * f64::from(i) / f64::from(n);
        let at = |i, w: f64| {
            let r = 3.0 + w * (ring(i) / 2.0).cos();
            [r * ring(i).cos(), r * ring(i).sin(), w * (ring(i) / 2.0).sin()]
        };
        let side = |i: u32, s: u32| if i < n { 2 * i + s } else { 1 - s };
        let positions = (0..n).flat_map(|i| [at(i, -1.0), at(i, 1.0)]).collect();
        let quads = (0..n).map(|i| [side(i, 0), side(i + 1, 0), side(i + 1, 1), side(i, 1)]);
        IndexedMesh::new(positions, quads.flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).collect())
    };
    let mut turned = sheet(&[], &[]);
    for t in turned.triangles.iter_mut().step_by(3) {
        t.swap(0, 1);
    }
    let mut welded = shapes::sphere(1);
    let soup = welded.triangles.iter().flatten().map(|&v| welded.positions[v as usize]).collect();
    welded = IndexedMesh::new(soup, (0..80).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect());
    let cases = [
        sheet(&[], &[first, first, [b, a, c]]),
        sheet(&[], &[[0, 0, 1], [7, 7, 7], [a, b, a]]),
        sheet(&[p, [1e9, -1e9, 3.0], [f64::MAX, f64::MIN, 5e-324], [-3.0, 0.0, 0.0]], &[]),
        sheet(&[p, q], &[[8, 30, 31]]),
        sheet(&[p, q], &[[8, 9, 30], [8, 9, 31]]),
        sheet(&[p, q], &[[8, 9, 30], [9, 8, 31], [30, 30, 31]]),
        moebius(9),
        moebius(30),
        turned,
        welded,
    ];
    for mesh in &cases {
        comes_back(mesh, &with_keyframes());
        comes_back(
            mesh,
            &Options { preview: Preview::Schedule(vec![1, 2, 5]), position_bits: 9, ..with_keyframes() },
        );
    }
}

/// Random triangles on few places, some of them taken twice.
pub fn soup() -> impl Strategy<Value = IndexedMesh> {
    let places = prop::collection::vec([0..4, 0..4, 0..2], 12);
    let triangles = prop::collection::vec(prop::array::uniform3(0..12u32), 1..40);
    (places, triangles).prop_map(|(places, triangles)| {
        IndexedMesh::new(places.into_iter().map(|p| p.map(f64::from)).collect(), triangles)
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(500))]

    #[test]
    fn any_soup(mesh in soup(), base in 1..10usize, seed: u64, precision: bool) {
        let mut options = with_keyframes();
        options.simplify.base_vertices = Some(base);
        options.simplify.seed = seed;
        options.preview = if precision { Preview::Schedule(vec![1, 2, 5]) } else { Preview::Off };
        comes_back(&mesh, &options);
    }

    #[test]
    fn any_soup_exactly(
        mesh in soup(), kind in 0..4usize, keep_order: bool, float32: bool, seed: u64,
        weld in prop::sample::select(vec![Weld::Exact, Weld::None, Weld::Lattice, Weld::Within(2e-3), Weld::Within(1.0)]),
    ) {
        let real = if float32 { Real::Binary32 } else { Real::Binary64 };
        let mut mesh = mesh;
        for (k, x) in mesh.positions.iter_mut().flatten().enumerate() {
            // Small integers as they are, with noise, far apart, and with zeros of both signs.
            *x = real.round(match kind {
                0 => *x,
                1 => *x * 0.1 + (k as f64 * 0.6180339887).fract() * 1e-3,
                2 => *x * 10f64.powi(30 - k as i32 % 7),
                _ if k % 3 == 1 => -*x,
                _ => *x,
            });
        }
        let mut options = Options { exact: Some(real), keep_order, weld, ..with_keyframes() };
        options.simplify.seed = seed;
        let bytes = Encoder::new(options).encode_to_vec(&mesh).unwrap();
        let seen = agree(&bytes).expect("the encoder writes what can be read");
        same_bits(&mesh, &seen.whole, keep_order);
    }
}
