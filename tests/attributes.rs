//! Attributes there and back: every corner has the values that it had, whatever the mesh is like.
#![cfg(feature = "encode")]

#[path = "common/corners.rs"]
mod by_corner;

use proptest::prelude::*;
use unweld::codec::grid::Real;
use unweld::decoder::{self, Decoder, Event};
use unweld::encoder::{Encoder, Options};
use unweld::mesh::attributes::{Attribute, Domain, NO_VALUE, Semantic, Stored, Values};
use unweld::mesh::{IndexedMesh, shapes};

/// Bits of the position and of all attributes, those of triangles too, at a corner; `None` where there is no value.
type CornerBits = (Vec<u64>, Vec<Option<Vec<u64>>>);

fn corner(mesh: &IndexedMesh, t: usize, k: usize) -> CornerBits {
    let position = mesh.positions[mesh.triangles[t][k] as usize].map(|x| (x + 0.0).to_bits()).to_vec();
    let value = |a: &Attribute| {
        let value = a.at(t, k)?;
        Some((0..a.components).map(|i| a.values.bits(a.components * value + i)).collect())
    };
    (position, mesh.attributes.iter().map(value).collect())
}

/// All triangles, each from its least corner, sorted.
fn corners(mesh: &IndexedMesh) -> Vec<[CornerBits; 3]> {
    by_corner::from_least(mesh.triangles.len(), |t, k| corner(mesh, t, k))
}

fn encoded(mesh: &IndexedMesh, options: Options) -> Vec<u8> {
    Encoder::new(options).encode_to_vec(mesh).unwrap()
}

fn decoded(file: &[u8]) -> IndexedMesh {
    decoder::decode(file, decoder::Options::default()).unwrap().assembled().unwrap()
}

fn exact() -> Options {
    Options { exact: Some(Real::Binary64), ..Options::default() }
}

/// What tells one attribute from another, its values aside.
fn shape(a: &Attribute) -> (Semantic, u32, String, Domain, usize, bool, Stored) {
    (a.semantic, a.set, a.name.clone(), a.domain, a.components, a.normalised, a.values.stored())
}

/// Exactly, in any order of triangles, and then in the order of the input, corner by corner.
fn there_and_back(mesh: &IndexedMesh) {
    let back = decoded(&encoded(mesh, exact()));
    let shapes = |mesh: &IndexedMesh| mesh.attributes.iter().map(shape).collect::<Vec<_>>();
    assert_eq!(shapes(&back), shapes(mesh));
    assert_eq!(corners(&back), corners(mesh));
    assert_eq!((&back.part_names, &back.libraries), (&mesh.part_names, &mesh.libraries));
    let ordered = decoded(&encoded(mesh, Options { keep_order: true, ..exact() }));
    assert_eq!(ordered.triangles, mesh.triangles);
    for t in 0..mesh.triangles.len() {
        assert_eq!(
            [0, 1, 2].map(|k| corner(&ordered, t, k)),
            [0, 1, 2].map(|k| corner(mesh, t, k)),
            "triangle {t}"
        );
    }
}

/// Texture coordinates by the sphere's longitude, with a seam, and normals that are the positions.
fn globe() -> IndexedMesh {
    let mut mesh = shapes::sphere(3);
    let longitude = |p: [f64; 3]| (p[1].atan2(p[0]) / std::f64::consts::TAU + 1.0).fract() as f32;
    let (mut uv, mut normals, mut corners) = (Vec::new(), Vec::new(), Vec::new());
    for triangle in &mesh.triangles {
        let u = triangle.map(|v| longitude(mesh.positions[v as usize]));
        let wraps = u.iter().any(|&u| u < 0.25) && u.iter().any(|&u| u > 0.75);
        for (k, &v) in triangle.iter().enumerate() {
            corners.push(corners.len() as u32);
            let p = mesh.positions[v as usize];
            uv.extend([if wraps && u[k] < 0.25 { u[k] + 1.0 } else { u[k] }, p[2] as f32]);
            let length = p.iter().map(|x| x * x).sum::<f64>().sqrt();
            normals.extend(p.map(|x| (x / length) as f32));
        }
    }
    mesh.attributes.push(Attribute::new(Semantic::TexCoord, 2, Values::F32(uv), corners.clone()));
    mesh.attributes.push(Attribute::new(Semantic::Normal, 3, Values::F32(normals), corners));
    mesh
}

#[test]
fn a_globe_with_a_seam() {
    there_and_back(&globe());
}

#[test]
fn values_are_as_near_as_their_bits_say() {
    let mesh = globe();
    for bits in [6u32, 12] {
        let names = [("uv", bits), ("normal", bits)].map(|(name, bits)| (name.to_owned(), bits));
        let options = Options { keep_order: true, attribute_bits: names.to_vec(), ..Options::default() };
        let back = decoded(&encoded(&mesh, options));
        // v has the longer range, about -1 to 1.
        let v: Vec<f64> =
            (0..mesh.attributes[0].count()).map(|k| mesh.attributes[0].values.number(2 * k + 1)).collect();
        let range = v.iter().copied().fold(f64::MIN, f64::max) - v.iter().copied().fold(f64::MAX, f64::min);
        let step = range / f64::from((1u32 << bits) - 1);
        for at in 0..3 * mesh.triangles.len() {
            let numbers = |mesh: &IndexedMesh, a: usize| {
                let a = &mesh.attributes[a];
                let value = a.at(at / 3, at % 3).unwrap();
                (0..a.components).map(|i| a.values.number(a.components * value + i)).collect::<Vec<_>>()
            };
            let apart = |a: usize| {
                numbers(&mesh, a)
                    .iter()
                    .zip(numbers(&back, a))
                    .map(|(x, y)| (x - y).abs())
                    .fold(0.0, f64::max)
            };
            assert!(apart(0) <= 0.5001 * step + 1e-7, "{at}: {}", apart(0));
            // The octahedron's plane folds a sphere of 2 pi to a square of side 2.
            assert!(apart(1) <= 2.0 * step, "{at}: {}", apart(1));
        }
    }
}

/// Points of a lattice over them, or squares of half its step, are beyond what numbers reach: they stay as they are.
#[test]
fn numbers_as_large_as_there_are() {
    // The second is 4.8 steps of a seventh of the first one's range from its least.
    let short = vec![-2e38, 1e38, 1.5e38, f32::MAX, 0.0, 2e38];
    for values in [Values::F32(short), Values::F64(vec![1e300, -1e299, 3e250, 0.0, -7e300, 5.0])] {
        let mut mesh = shapes::torus(9, 7);
        let corners = (0..3 * mesh.triangles.len() as u32).map(|c| c / 2 % 3).collect();
        mesh.attributes.push(Attribute::new(Semantic::Generic, 2, values, corners));
        let options =
            Options { keep_order: true, attribute_bits: vec![("generic".into(), 3)], ..Options::default() };
        let back = decoded(&encoded(&mesh, options));
        for t in 0..mesh.triangles.len() {
            for k in 0..3 {
                assert_eq!(corner(&back, t, k).1, corner(&mesh, t, k).1);
            }
        }
    }
}

#[test]
fn every_kind_of_number_and_place() {
    let mut mesh = shapes::torus(9, 7);
    let triangles = mesh.triangles.len();
    for (k, stored) in Stored::ALL.into_iter().enumerate() {
        let mut values = Values::new(stored);
        let mut state = 1u64;
        for _ in 0..40 {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            values.push_bits(state >> 7);
        }
        let name = format!("n{k}");
        let at_corners =
            (0..3 * triangles).map(|c| if c % 5 == k % 5 { NO_VALUE } else { (c * 7 % 20) as u32 }).collect();
        let corner = Attribute::new(Semantic::Generic, 2, values.clone(), at_corners);
        mesh.attributes.push(Attribute { name: name.clone(), ..corner });
        let at_triangles =
            (0..triangles).map(|t| if t % 9 == k { NO_VALUE } else { (t % 40) as u32 }).collect();
        let triangle = Attribute::new(Semantic::Generic, 1, values, at_triangles);
        mesh.attributes.push(Attribute {
            name: format!("{name}t"),
            domain: Domain::Triangle,
            set: 3,
            ..triangle
        });
    }
    let parts: Vec<u32> = (0..triangles as u32).map(|t| t / 50).collect();
    mesh.attributes.push(Attribute::parts(&parts));
    mesh.part_names = vec!["hull".into(), "é".into()];
    mesh.libraries = vec!["ship.mtl".into()];
    there_and_back(&mesh);
}

#[test]
fn whatever_is_no_manifold() {
    let mut mesh = shapes::sphere(2);
    let n = mesh.positions.len() as u32;
    mesh.positions.extend([[3.0, 0.0, 0.0], [3.0, 1.0, 0.0], [9.0; 3]]);
    // A fin on an edge, a triangle that comes twice, one turned round, one with two corners on one vertex, one far away.
    let [a, b, c] = mesh.triangles[5];
    mesh.triangles.extend([
        [a, b, n],
        [a, b, c],
        [c, b, a],
        [a, a, b],
        [n, n + 1, n + 2],
        [b, c, n + 1],
        [c, b, n],
    ]);
    mesh.triangles.swap(2, 7);
    mesh.triangles[9].swap(0, 1);
    let count = mesh.triangles.len();
    let values = (0..count * 3).map(|x| x as f32 * 0.37).collect();
    // Some corners share values, many do not.
    let at = (0..3 * count as u32).map(|c| if c.is_multiple_of(4) { c / 12 } else { c }).collect();
    mesh.attributes.push(Attribute::new(Semantic::Generic, 1, Values::F32(values), at));
    mesh.attributes.push(Attribute::parts(&(0..count as u32).map(|t| t % 3).collect::<Vec<_>>()));
    there_and_back(&mesh);
}

#[test]
fn a_mesh_without_attributes_has_no_byte_of_them() {
    let mesh = shapes::torus(20, 10);
    let file = encoded(&mesh, Options::default());
    let decoder = decoder::decode(&file, decoder::Options::default()).unwrap();
    assert!(decoder.attributes().is_none() && decoder.contents().unwrap().attributes.is_empty());
    assert_eq!(file[12], 0);
}

/// One value at every corner, or for every triangle.
fn constant(semantic: Semantic, components: usize, values: Values, triangles: usize) -> Attribute {
    let domain = if semantic == Semantic::Part { Domain::Triangle } else { Domain::Corner };
    let count = if domain == Domain::Triangle { triangles } else { 3 * triangles };
    Attribute { domain, ..Attribute::new(semantic, components, values, vec![0; count]) }
}

#[test]
fn an_attribute_that_is_the_same_everywhere_costs_sixteen_bytes_at_most() {
    let plain = shapes::torus(60, 40);
    let n = plain.triangles.len();
    let white = Values::U8(vec![255; 4]);
    let odd = Values::F32(vec![0.1, 0.2, 0.7, 1.0]);
    for (values, exact_too) in [(white, true), (Values::F32(vec![1.0, 0.5, 0.25, 1.0]), true), (odd, false)] {
        for options in [Options::default(), exact()] {
            if options.exact.is_some() && !exact_too {
                continue;
            }
            let mesh = IndexedMesh {
                attributes: vec![constant(Semantic::Color, 4, values.clone(), n)],
                ..plain.clone()
            };
            let file = encoded(&mesh, options.clone());
            let without = encoded(&plain, options).len();
            assert!(file.len() <= without + 16, "{} and {without} bytes", file.len());
            assert!(!exact_too || decoded(&file).attributes == mesh.attributes);
        }
    }
}

#[test]
fn constants_are_alive_at_every_level_and_have_no_payload() {
    let mut mesh = globe();
    // Further triangles have them too.
    mesh.triangles.extend([mesh.triangles[7], mesh.triangles[9]]);
    let n = mesh.triangles.len();
    let kinds = |n: usize| {
        [
            constant(Semantic::Color, 4, Values::U8(vec![9, 0, 255, 7]), n),
            constant(Semantic::Part, 1, Values::U16(vec![3]), n),
            constant(Semantic::Generic, 2, Values::F64(vec![f64::INFINITY, -0.0]), n),
            constant(Semantic::Normal, 3, Values::F32(vec![0.0, 0.0, -1.0]), n),
        ]
    };
    for alone in [true, false] {
        for attribute in &mut mesh.attributes {
            attribute.corners.resize(3 * n, 1);
        }
        let others = if alone { Vec::new() } else { globe().attributes };
        let mut mesh = IndexedMesh { attributes: kinds(n).to_vec(), ..mesh.clone() };
        mesh.attributes.extend(others.into_iter().map(|mut attribute| {
            attribute.corners.resize(3 * n, 1);
            attribute
        }));
        there_and_back(&mesh);
        let file = encoded(&mesh, Options::default());
        let contents =
            decoder::decode(&file, decoder::Options::default()).unwrap().contents().unwrap().clone();
        let payloads = (0..contents.header.level_count).filter(|&j| !contents.attribute_atoms(j).is_empty());
        assert!(!alone || payloads.count() == 0);
        for level in [0, contents.base_level() / 2, contents.base_level()] {
            let mut decoder = Decoder::new(decoder::Options::default());
            decoder.push(&file[..contents.bytes(contents.prefix(level)).end as usize]);
            while decoder.poll().unwrap().is_some() {}
            let mesh = decoder.assembled().unwrap();
            assert_eq!(mesh.attributes[..4], kinds(mesh.triangles.len()), "level {level}");
            mesh.attributes.iter().for_each(|attribute| attribute.check(mesh.triangles.len()).unwrap());
        }
    }
}

#[test]
fn what_does_not_fit_is_refused() {
    let refuse = |change: &dyn Fn(&mut IndexedMesh), what: &str| {
        let mut mesh = globe();
        change(&mut mesh);
        let error = Encoder::default().encode_to_vec(&mesh).unwrap_err();
        assert!(error.to_string().contains(what), "{error}");
    };
    refuse(
        &|mesh| mesh.attributes[0].corners.truncate(3839),
        "uv: 3839 indices of values where there are 3840",
    );
    refuse(&|mesh| mesh.attributes[1].corners[7] = 9_000, "normal: index 7 names value 9000 of 3840");
    refuse(&|mesh| mesh.attributes = vec![mesh.attributes[0].clone(); 65], "65 attributes, allowed 64");
    let options = Options { attribute_bits: vec![("warmth".into(), 8)], ..Options::default() };
    let error = Encoder::new(options).encode_to_vec(&globe()).unwrap_err();
    assert!(error.to_string().contains("no attribute warmth"), "{error}");
}

#[test]
fn chunks_of_any_size_tell_the_same() {
    let file = encoded(&globe(), Options::default());
    let events = |size: usize| {
        let mut decoder = Decoder::new(decoder::Options::default());
        let mut events = Vec::new();
        for chunk in file.chunks(size) {
            decoder.push(chunk);
            while let Some(event) = decoder.poll().unwrap() {
                events.push(event);
            }
        }
        decoder.finish().unwrap();
        (events, decoder.assembled().unwrap())
    };
    let whole = events(file.len());
    let wedges = |event: &Event| matches!(event, Event::Refined(delta) if !delta.wedges.is_empty());
    assert!(whole.0.iter().any(wedges), "wedges come with refinements");
    assert!(events(1) == whole && events(777) == whole);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]
    #[test]
    fn any_values_on_any_triangles(
        triangles in prop::collection::vec([0..9u32, 0..9, 0..9], 1..40),
        corners in prop::collection::vec(prop::option::of(0..6u32), 120),
        other in prop::collection::vec(0..3u32, 120),
        bits in prop::collection::vec(any::<u32>(), 12),
    ) {
        let positions = (0..9).map(|v| [f64::from(v % 3), f64::from(v / 3), f64::from(v * v % 5)]).collect();
        let mut mesh = IndexedMesh::new(positions, triangles);
        let count = 3 * mesh.triangles.len();
        let values = Values::F32(bits.iter().map(|&bits| f32::from_bits(bits)).collect());
        let at = corners[..count].iter().map(|c| c.unwrap_or(NO_VALUE)).collect();
        mesh.attributes.push(Attribute::new(Semantic::TexCoord, 2, values, at));
        mesh.attributes.push(Attribute::new(Semantic::Joints, 1, Values::U16(vec![9, 900, 70]), other[..count].to_vec()));
        there_and_back(&mesh);
    }
}
