//! Attributes at every level: the same corners with the same values however a level is come to.
#![cfg(feature = "encode")]

#[path = "common/corners.rs"]
mod by_corner;

use proptest::prelude::*;
use std::collections::BTreeMap;
use std::sync::Arc;
use unweld::codec::grid::Real;
use unweld::container::{Contents, Part, plan_from_keyframe};
use unweld::decoder::{self, Decoder, Event, Until};
use unweld::encoder::{Encoder, Keyframes, Options, Preview};
use unweld::mesh::attributes::{Attribute, Domain, NO_VALUE, Semantic, Values};
use unweld::mesh::{IndexedMesh, shapes};

/// Position bits and, by attribute, what it is and the bits of the value at a corner.
type CornerBits = (Vec<u64>, Vec<(Semantic, u32, Option<Vec<u64>>)>);

/// All triangles with what is at their corners, each from its least corner, sorted: the same however a mesh is numbered.
fn corners(mesh: &IndexedMesh) -> Vec<[CornerBits; 3]> {
    let corner = |t: usize, k: usize| {
        let position = mesh.positions[mesh.triangles[t][k] as usize].map(|x| (x + 0.0).to_bits()).to_vec();
        let of = |a: &Attribute| {
            let bits =
                |value: usize| (0..a.components).map(|i| a.values.bits(a.components * value + i)).collect();
            (a.semantic, a.set, a.at(t, k).map(bits))
        };
        (position, mesh.attributes.iter().map(of).collect())
    };
    by_corner::from_least(mesh.triangles.len(), corner)
}

type Levels = BTreeMap<u32, Vec<[CornerBits; 3]>>;

/// What a decoder has at the end of each level, in which its attributes are born, too.
fn levels(mut decoder: Decoder, bytes: &[u8], chunk: usize) -> (Levels, Decoder) {
    let mut levels = Levels::new();
    for chunk in bytes.chunks(chunk) {
        decoder.push(chunk);
        while let Some(event) = decoder.poll().unwrap() {
            let level = match event {
                Event::Level { level, .. } | Event::Attributes { level } => level,
                Event::Residue | Event::Correction | Event::Order | Event::Metadata => 0,
                _ => continue,
            };
            levels.insert(level, corners(&decoder.assembled().unwrap()));
        }
    }
    decoder.finish().unwrap();
    (levels, decoder)
}

/// Encodes a mesh and comes to its levels in every way there is. Returned are the levels, coarsest last, and the contents.
fn every_way(mesh: &IndexedMesh, options: Options) -> (Levels, Arc<Contents>) {
    let options = Options { keyframes: Keyframes::Every(2), ..options };
    let file = Encoder::new(options).encode_to_vec(mesh).unwrap();
    let undo = decoder::Options { undo: true, ..decoder::Options::default() };
    let (wanted, mut decoder) = levels(Decoder::new(undo), &file, file.len());
    let contents = decoder.contents().unwrap().clone();
    assert_eq!(levels(Decoder::new(decoder::Options::default()), &file, 97).0, wanted, "in other chunks");
    // Down to the base, and up again.
    for (level, wanted) in wanted.iter().skip(1) {
        assert_eq!(decoder.coarsen().unwrap(), Some(*level));
        assert_eq!(corners(&decoder.assembled().unwrap()), *wanted, "down to level {level}");
    }
    for (level, wanted) in wanted.iter().rev().skip(1) {
        assert_eq!(decoder.restore().unwrap(), Some(*level));
        assert_eq!(corners(&decoder.assembled().unwrap()), *wanted, "up to level {level}");
    }
    // From every keyframe to every finer level.
    let base = contents.base_level();
    for start in (0..=base).filter(|&j| contents.starts_segment(j)) {
        for to in 0..=start {
            let mut plan = plan_from_keyframe(&contents, start);
            assert_eq!(plan.start, start);
            if to < start {
                let end = if to == 0 { contents.beyond_mesh().end } else { 0 };
                let atoms = contents.steps(start - 1).start..contents.steps(to).end.max(end);
                plan.parts.push(Part { bytes: contents.bytes(atoms.clone()), atoms });
            }
            let mut decoder = Decoder::of_plan(contents.clone(), &plan, decoder::Options::default());
            for part in &plan.parts {
                decoder.push(&file[part.bytes.start as usize..part.bytes.end as usize]);
            }
            while decoder.poll().unwrap().is_some() {}
            assert_eq!(decoder.level(), Some(to));
            assert_eq!(corners(&decoder.assembled().unwrap()), wanted[&to], "from {start} to {to}");
        }
        let until = decoder::Until { level: start, ..decoder::Until::default() };
        let stopped = decoder::decode(&file, decoder::Options { until, ..decoder::Options::default() });
        assert_eq!(corners(&stopped.unwrap().assembled().unwrap()), wanted[&start], "stopped at {start}");
    }
    (wanted, contents)
}

/// Normals that are the positions of a globe, texture coordinates with a seam, and a colour of each vertex.
fn globe(depth: u32) -> IndexedMesh {
    let mut mesh = shapes::sphere(depth);
    let longitude = |p: [f64; 3]| (p[1].atan2(p[0]) / std::f64::consts::TAU + 1.0).fract() as f32;
    let (mut uv, mut normals, mut colors, mut corners) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for triangle in &mesh.triangles {
        let u = triangle.map(|v| longitude(mesh.positions[v as usize]));
        let wraps = u.iter().any(|&u| u < 0.25) && u.iter().any(|&u| u > 0.75);
        for (k, &v) in triangle.iter().enumerate() {
            corners.push(corners.len() as u32);
            let p = mesh.positions[v as usize];
            uv.extend([if wraps && u[k] < 0.25 { u[k] + 1.0 } else { u[k] }, p[2] as f32]);
            let length = p.iter().map(|x| x * x).sum::<f64>().sqrt();
            normals.extend(p.map(|x| (x / length) as f32));
            colors.extend(p.map(|x| (x * 100.0 + 128.0) as u8));
        }
    }
    mesh.attributes = vec![
        Attribute::new(Semantic::TexCoord, 2, Values::F32(uv), corners.clone()),
        Attribute::new(Semantic::Normal, 3, Values::F32(normals), corners.clone()),
        Attribute::new(Semantic::Color, 3, Values::U8(colors), corners),
    ];
    mesh
}

/// Colours of triangles, by where they are and by chance.
fn faces(mesh: &IndexedMesh, of: impl Fn(usize, [f64; 3]) -> u8) -> Attribute {
    let middle =
        |t: &[u32; 3]| [0, 1, 2].map(|k| t.iter().map(|&v| mesh.positions[v as usize][k]).sum::<f64>() / 3.0);
    let values = mesh.triangles.iter().enumerate().map(|(k, t)| of(k, middle(t))).collect();
    let corners = (0..mesh.triangles.len() as u32).collect();
    Attribute {
        domain: Domain::Triangle,
        ..Attribute::new(Semantic::Generic, 1, Values::U8(values), corners)
    }
}

/// How many levels have some attribute of a kind.
fn alive(levels: &Levels, semantic: Semantic) -> usize {
    let has = |level: &&Vec<[CornerBits; 3]>| level[0][0].1.iter().any(|(other, ..)| *other == semantic);
    levels.values().filter(has).count()
}

#[test]
fn a_globe_has_its_attributes_at_every_level() {
    let mesh = globe(4);
    let options = || {
        [Options::default(), Options { keep_order: true, exact: Some(Real::Binary64), ..Options::default() }]
    };
    for options in options() {
        let (levels, contents) = every_way(&mesh, options);
        assert!(levels.len() > 4);
        for semantic in [Semantic::TexCoord, Semantic::Normal, Semantic::Color] {
            assert_eq!(alive(&levels, semantic), levels.len(), "{semantic:?}");
        }
        assert!(contents.attributes.iter().all(|entry| entry.birth == contents.base_level()));
        // Every vertex has one wedge but on the seam, which two vertices end: no corner is without a value.
        let none = |(.., value): &(Semantic, u32, Option<Vec<u64>>)| value.is_none();
        assert!(levels.values().flatten().flatten().all(|(_, values)| !values.iter().any(none)));
    }
}

/// What triangles have is inherited from a level on that depends on where values change.
#[test]
fn attributes_of_triangles_are_born_where_all_inherit_them() {
    let mut mesh = shapes::torus(24, 36);
    mesh.attributes = vec![faces(&mesh, |_, _| 7)];
    let (levels, contents) = every_way(&mesh, Options::default());
    assert_eq!(contents.attributes[0].birth, contents.base_level(), "all are the same");
    assert_eq!(alive(&levels, Semantic::Generic), levels.len());
    // Scattered on one side: nothing there can go before they are.
    mesh.attributes = vec![faces(&mesh, |k, p| if p[0] > 1.1 { (k % 5) as u8 } else { 9 })];
    let (levels, contents) = every_way(&mesh, Options::default());
    assert_eq!(contents.attributes[0].birth, 0);
    assert_eq!(alive(&levels, Semantic::Generic), 1);
    // One triangle alone is told apart until one of its vertices goes.
    for one in [3, 400, 1200] {
        let colors = faces(&mesh, |k, _| u8::from(k == one));
        let parts = Attribute { semantic: Semantic::Part, ..faces(&mesh, |_, p| u8::from(p[2] > 0.0)) };
        let mesh = IndexedMesh { attributes: vec![colors, parts], ..mesh.clone() };
        every_way(&mesh, Options::default());
    }
    let among = |mesh: &IndexedMesh| every_way(mesh, Options::default()).1.attributes[0].birth;
    let births: Vec<u32> = (0..40)
        .map(|k| {
            let colors = faces(&mesh, |t, _| u8::from(t == 37 * k));
            among(&IndexedMesh { attributes: vec![colors], ..mesh.clone() })
        })
        .collect();
    assert!(births.iter().any(|&birth| birth > 0), "some are born between: {births:?}");
}

/// Components of all sizes, most of them born at levels, with attributes and seams of their own.
#[test]
fn components_are_born_with_attributes() {
    let part = globe(2);
    let mut mesh = globe(4);
    for k in 0..60u32 {
        let first = mesh.positions.len() as u32;
        let size = 0.02 + 0.002 * f64::from(k);
        let place = [f64::from(k % 8) * 0.7, f64::from(k / 8) * 0.7, 2.0];
        mesh.positions.extend(part.positions.iter().map(|p| [0, 1, 2].map(|i| place[i] + size * p[i])));
        mesh.triangles.extend(part.triangles.iter().map(|t| t.map(|v| v + first)));
        for (all, own) in mesh.attributes.iter_mut().zip(&part.attributes) {
            let count = all.count() as u32;
            (0..own.values.len()).for_each(|at| all.values.push_bits(own.values.bits(at)));
            all.corners.extend(own.corners.iter().map(|&value| value + count));
        }
    }
    mesh.attributes.push(Attribute { semantic: Semantic::Part, ..faces(&mesh, |_, p| u8::from(p[2] > 1.5)) });
    let (levels, contents) = every_way(&mesh, Options::default());
    assert!((0..contents.base_level()).any(|j| contents.born(j) != [0; 2]), "some are born");
    assert_eq!(contents.attributes[3].birth, contents.base_level(), "no operation is at a border of parts");
    assert_eq!(alive(&levels, Semantic::Normal), levels.len());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]
    /// Values by chance: breaks on any edges, corners without values, more triangles than a manifold takes.
    #[test]
    fn whatever_corners_have(
        seed in any::<u64>(),
        kind in 0..5usize,
        distinct in 1..6u32,
        further in prop::collection::vec([0..30u32, 0..30, 0..30], 0..6),
        exact in any::<bool>(),
    ) {
        let mut mesh = [shapes::sphere(3), shapes::torus(12, 9), shapes::grid(9, 14), shapes::annulus(40), shapes::bumpy_sphere(3, 5)][kind].clone();
        mesh.triangles.extend(further);
        let mut random = seed;
        let mut next = |below: u32| {
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (random >> 33) as u32 % below
        };
        let count = 3 * mesh.triangles.len();
        let values = |n: u32| (0..n).map(|k| k as f32 * 0.37 - 1.0).collect::<Vec<_>>();
        // Most vertices have one value, some are broken anywhere.
        let of_vertex: Vec<u32> = mesh.positions.iter().map(|_| next(distinct)).collect();
        let own: Vec<u32> = mesh.triangles.as_flattened().iter().map(|&v| {
            if next(6) == 0 { next(distinct) } else { of_vertex[v as usize] }
        }).collect();
        let partial = (0..count).map(|_| if next(9) == 0 { NO_VALUE } else { next(distinct) }).collect();
        mesh.attributes = vec![
            Attribute::new(Semantic::TexCoord, 2, Values::F32(values(2 * distinct)), own.clone()),
            Attribute::new(Semantic::Generic, 1, Values::I16((0..distinct as i16).collect()), partial),
        ];
        if kind > 2 {
            mesh.attributes.push(Attribute::new(Semantic::Color, 3, Values::U8((0..3 * distinct as u8).collect()), own));
            mesh.attributes.swap(0, 2);
        }
        let exact = exact.then_some(Real::Binary64);
        every_way(&mesh, Options { exact, ..Options::default() });
    }
}

/// Attributes are told of 64 operations together; decoding stops at any one of them all the same, with the values of all corners there are.
#[test]
fn decoding_stops_between_operations_that_are_told_of_together() {
    let mut mesh = shapes::bumpy_sphere(3, 1);
    let numbers: Vec<u32> = (0..mesh.positions.len() as u32).collect();
    let of_vertices = mesh.triangles.as_flattened().to_vec();
    mesh.attributes.push(Attribute::new(Semantic::Generic, 1, Values::U32(numbers), of_vertices));
    // A vertex stays where it is born.
    let options = Options { lifting: Some(0), preview: Preview::Off, ..Options::default() };
    let file = Encoder::new(options).encode_to_vec(&mesh).unwrap();
    let decode = |until: Until, undo: bool| {
        let decoder = decoder::decode(&file, decoder::Options { until, undo, ..Default::default() }).unwrap();
        decoder.mesh().table.check().unwrap();
        let now = decoder.assembled().unwrap();
        let numbers = now.triangles.iter().enumerate().flat_map(|(t, triangle)| {
            let at = |k: usize| now.attributes[0].values.bits(now.attributes[0].at(t, k).expect("a value"));
            [0, 1, 2].map(|k| (at(k), now.positions[triangle[k] as usize].map(f64::to_bits)))
        });
        (numbers.collect::<BTreeMap<_, _>>(), decoder)
    };
    let (all, whole) = decode(Until::default(), false);
    assert_eq!(all.len(), mesh.positions.len());
    let base = u64::from(whole.contents().unwrap().header.base_vertices);
    let most = whole.operations();
    let wanted = (0..10).map(|k| most.saturating_sub(50 * k + k * k)).chain([1, 63, 64, 65, most - 1]);
    for operations in wanted {
        let (there, mut at) = decode(Until { operations, ..Until::default() }, operations % 2 == 0);
        assert_eq!((at.operations(), there.len() as u64), (operations, base + operations));
        assert!(there.iter().all(|(number, position)| all[number] == *position));
        if operations > 0 && operations % 2 == 0 {
            let level = at.coarsen().unwrap().expect("a level below");
            let (below, _) = decode(Until { level, ..Until::default() }, false);
            assert_eq!(at.mesh().positions.len(), below.len());
        }
    }
    for triangles in [400, 401, 777] {
        let (_, at) = decode(Until { triangles, ..Until::default() }, false);
        assert!((triangles - 1..=triangles).contains(&(at.mesh().table.triangle_count() as u32)));
    }
}

/// Where attributes are wide, and after many vertices that tell nothing of them every corner has values of its own, atoms stay as short as they must.
#[test]
fn atoms_stay_short_where_values_become_many_at_once() {
    let mut mesh = shapes::bumpy_sphere(4, 2);
    let count = 3 * mesh.triangles.len();
    let mut noise = 1u64;
    let mut number = |is_one: bool| {
        noise = noise.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        if is_one { 1.0 } else { f64::from_bits(noise >> 12 | 0x3FF0_0000_0000_0000) }
    };
    let is_calm: Vec<bool> =
        mesh.triangles.iter().map(|t| t.iter().all(|&v| mesh.positions[v as usize][2] > -0.3)).collect();
    let values = (0..count).flat_map(|c| [is_calm[c / 3]; 16]).map(&mut number).collect();
    let values = Values::F64(values);
    for set in 0..4 {
        let all = (0..count as u32).collect();
        let attribute = Attribute::new(Semantic::Generic, 16, values.clone(), all);
        mesh.attributes.push(Attribute { set, ..attribute });
    }
    let options = Options { exact: Some(Real::Binary64), ..Options::default() };
    let file = Encoder::new(options).encode_to_vec(&mesh).expect("no atom is too long");
    let whole = decoder::decode(&file, decoder::Options::default()).unwrap();
    let whole = whole.assembled().unwrap();
    assert_eq!(corners(&whole), corners(&mesh));
}
