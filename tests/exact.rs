//! `--exact` and `--keep-order` of the library: what comes back is what went in, to the last bit.
#![cfg(feature = "encode")]

use proptest::prelude::*;
use unweld::codec::grid::Real;
use unweld::decoder;
use unweld::encoder::{Encoder, Keyframes, Options};
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

fn any_real() -> impl Strategy<Value = Real> {
    prop::sample::select(vec![Real::Binary32, Real::Binary64])
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn any_soup_comes_back(
        (real, mesh) in any_real().prop_flat_map(|real| (Just(real), soup(real))), bits in 8..=24u32, weld: bool,
    ) {
        let weld = if weld { Weld::Exact } else { Weld::None };
        let mut options = Options { position_bits: bits, weld, keyframes: Keyframes::All, ..exact(real) };
        options.simplify.base_vertices = Some(4);
        prop_assert_eq!(triangles(&back(&mesh, options)), triangles(&mesh));
    }
}

#[test]
fn shapes_come_back() {
    for mesh in [shapes::bumpy_sphere(4, 3), shapes::torus_with_hole(20, 14), shapes::handle_body(2)] {
        assert_eq!(triangles(&back(&mesh, exact(Real::Binary64))), triangles(&mesh));
    }
}
