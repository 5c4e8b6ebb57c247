//! Both decoders on meshes with attributes.

use proptest::prelude::*;
use unweld::codec::grid::Real;
use unweld::encoder::{Encoder, Keyframes, Options};
use unweld::mesh::attributes::{Attribute, Domain, NO_VALUE, Semantic, Stored, Values};
use unweld::mesh::topology::Weld;
use unweld::mesh::{IndexedMesh, shapes};

use super::agree::agree;
use super::container::{ATTRIBUTES, BASE, BIRTH, KEYFRAME, REFINEMENT};
use super::draft::Draft;
use super::golden::{components, load};
use super::on_shapes::{every_shape, soup};

/// Numbers of no pattern.
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        self.0 >> 24
    }
}

/// For each corner one of the values of its vertex, of which there are as many as vertices, and as many again.
fn at_corners(mesh: &IndexedMesh, noise: &mut Noise, partial: bool) -> Vec<u32> {
    let n = mesh.positions.len() as u32;
    let corners = mesh.triangles.as_flattened().iter();
    corners
        .map(|&v| match noise.next() % 16 {
            0 => v + n,
            1 if partial => NO_VALUE,
            _ => v,
        })
        .collect()
}

/// A mesh with attributes of every semantic, type and domain, of what its positions are and of noise.
fn valued(mut mesh: IndexedMesh, seed: u64) -> IndexedMesh {
    let mut noise = Noise(seed);
    let points: Vec<[f64; 3]> = mesh.positions.repeat(2);
    let unit = |p: &[f64; 3]| {
        let length = p.iter().map(|x| x * x).sum::<f64>().sqrt();
        if length > 0.0 { p.map(|x| (x / length) as f32) } else { [0.0, 0.0, 1.0] }
    };
    let normals: Vec<f32> = points.iter().flat_map(unit).collect();
    let tangents = points
        .iter()
        .enumerate()
        .flat_map(|(k, p)| {
            let [x, y, z] = unit(p);
            [y, z, x, if k % 5 == 0 { -1.0 } else { 1.0 }]
        })
        .collect();
    let double = points.iter().flatten().map(|x| x * 0.3).collect();
    let flat: Vec<f32> = points.iter().flat_map(|p| [p[0] as f32, (p[1] + 0.25 * p[2]) as f32]).collect();
    let wild = points.iter().flat_map(|p| [(p[0] / p[1]) as f32, p[2] as f32]).collect();
    let of_bytes = points.iter().flatten().map(|x| (x * 60.0) as u8).collect();
    let joints = points.iter().map(|p| (p[0] * 3.0) as u16).collect();
    let list = [
        (Semantic::TexCoord, 2, Values::F32(flat)),
        (Semantic::Normal, 3, Values::F32(normals.clone())),
        (Semantic::Tangent, 4, Values::F32(tangents)),
        (Semantic::TexCoord, 3, Values::F64(double)),
        (Semantic::TexCoord, 2, Values::F32(wild)),
        (Semantic::Normal, 3, Values::F64(normals.iter().map(|&x| f64::from(x)).collect())),
        (Semantic::Color, 3, Values::U8(of_bytes)),
        (Semantic::Joints, 1, Values::U16(joints)),
    ];
    for (k, (semantic, components, values)) in list.into_iter().enumerate() {
        let corners = at_corners(&mesh, &mut noise, k % 3 == 2);
        let set = k as u32;
        mesh.attributes.push(Attribute { set, ..Attribute::new(semantic, components, values, corners) });
    }
    for (k, stored) in Stored::ALL.into_iter().enumerate() {
        let mut values = Values::new(stored);
        (0..2 * points.len()).for_each(|_| values.push_bits(noise.next() << 20 | noise.next()));
        let (name, set) = (format!("n{k}"), k as u32);
        let corners = at_corners(&mesh, &mut noise, k % 2 == 0);
        let of_triangles = (0..mesh.triangles.len())
            .map(|t| if noise.next() % 9 == k as u64 { NO_VALUE } else { t as u32 / 7 % points.len() as u32 })
            .collect();
        let at_corner =
            Attribute::new([Semantic::Weights, Semantic::Generic][k % 2], 2, values.clone(), corners);
        mesh.attributes.push(Attribute { name: name.clone(), set, ..at_corner });
        let of_triangle = Attribute::new(Semantic::Generic, 1, values, of_triangles);
        let domain = Domain::Triangle;
        mesh.attributes.push(Attribute { name: format!("{name}t"), domain, ..of_triangle });
    }
    mesh.attributes
        .push(Attribute::parts(&(0..mesh.triangles.len() as u32).map(|t| t / 9).collect::<Vec<_>>()));
    mesh
}

fn both_read(mesh: &IndexedMesh, options: Options) -> bool {
    let bytes = Encoder::new(options).encode_to_vec(mesh).unwrap();
    let seen = agree(&bytes).expect("the encoder writes what can be read");
    seen.whole.values.len() == mesh.triangles.len() && seen.about.len() == mesh.attributes.len()
}

/// Quantised, with other bits for each attribute, and exactly in the order of the input.
fn both_ways(mesh: &IndexedMesh, seed: u64) -> [Options; 2] {
    let bits = |(k, a): (usize, &Attribute)| (a.title(), 2 + ((seed >> 7) as u32 + 5 * k as u32) % 23);
    let attribute_bits = mesh.attributes.iter().enumerate().map(bits).collect();
    let mut options = Options { keyframes: Keyframes::Every(2), attribute_bits, ..Options::default() };
    options.simplify.seed = seed;
    options.simplify.base_vertices = Some(6);
    // Many levels of a small mesh.
    options.simplify.level_share = 0.2;
    // Vertices in one place, and edges without a length.
    options.weld = if seed % 2 == 1 { Weld::None } else { Weld::Exact };
    let exact = Options { exact: Some(Real::Binary64), keep_order: true, ..options.clone() };
    [options, exact]
}

#[test]
fn shapes_with_values() {
    for (k, mesh) in every_shape().into_iter().enumerate() {
        let mesh = valued(mesh, k as u64);
        for options in both_ways(&mesh, (k as u64) << 6) {
            assert!(both_read(&mesh, options));
        }
    }
}

/// Normals and texture coordinates with a seam, of which atoms tell behind 64 operations, behind 128 and behind the last.
#[test]
fn many_operations() {
    let mut mesh = shapes::bumpy_sphere(3, 4);
    let n = mesh.positions.len() as u32;
    let normals = mesh.positions.iter().flat_map(|p| p.map(|x| x as f32)).collect();
    let flat = |p: &[f64; 3], turn: f32| [turn + p[0] as f32, p[1] as f32];
    let uv = mesh.positions.iter().flat_map(|p| flat(p, 0.0));
    let uv: Vec<f32> = uv.chain(mesh.positions.iter().flat_map(|p| flat(p, 4.0))).collect();
    let corners = mesh.triangles.as_flattened().to_vec();
    let is_behind = |t: &[u32; 3]| t.iter().map(|&v| mesh.positions[v as usize][2]).sum::<f64>() < 0.0;
    let sides = mesh.triangles.iter().flat_map(|t| t.map(|v| if is_behind(t) { v + n } else { v })).collect();
    mesh.attributes.push(Attribute::new(Semantic::Normal, 3, Values::F32(normals), corners));
    mesh.attributes.push(Attribute::new(Semantic::TexCoord, 2, Values::F32(uv), sides));
    let bytes = Encoder::default().encode_to_vec(&mesh).unwrap();
    let draft = Draft::of(&bytes);
    let items = draft.atoms.iter().filter(|atom| atom.kind == REFINEMENT).map(|atom| atom.items);
    assert!(items.clone().any(|n| n > 128 && !n.is_multiple_of(64)), "{:?}", items.collect::<Vec<_>>());
    assert_eq!(agree(&bytes).expect("a sound file").whole.values.len(), mesh.triangles.len());
}

/// Two or three values that meet everywhere: runs of the same value round a vertex that others part, and that come together again where
/// an operation takes what is between away.
#[test]
fn few_values() {
    for seed in 0..16 {
        let mut noise = Noise(seed);
        let mut mesh =
            [shapes::torus(9, 8), shapes::sphere(2), shapes::grid(7, 6), shapes::torus_with_hole(8, 7)]
                [seed as usize % 4]
                .clone();
        let values = 2 + seed as u32 % 3;
        // Of a triangle as a rule, else of a corner.
        let mut corners = vec![];
        for _ in &mesh.triangles {
            let of_triangle = noise.next() as u32 % values;
            corners.extend([0; 3].map(|_| {
                if noise.next().is_multiple_of(4) { noise.next() as u32 % values } else { of_triangle }
            }));
        }
        let numbers = Values::U8((0..values as u8).collect());
        mesh.attributes.push(Attribute::new(Semantic::Generic, 1, numbers, corners));
        // What no manifold holds names one of them, or another one.
        for _ in 0..8 {
            let [a, b, _] = mesh.triangles[noise.next() as usize % mesh.triangles.len()];
            mesh.triangles.push([a, b, b]);
            mesh.attributes[0].corners.extend([0; 3].map(|_| noise.next() as u32 % values));
        }
        for options in both_ways(&mesh, seed) {
            assert!(both_read(&mesh, options));
        }
    }
}

#[test]
fn no_value_anywhere() {
    let mut mesh = shapes::torus(5, 4);
    let nowhere = vec![NO_VALUE; 3 * mesh.triangles.len()];
    mesh.attributes.push(Attribute::new(Semantic::Generic, 1, Values::F32(vec![]), nowhere.clone()));
    for options in both_ways(&mesh, 0) {
        assert!(both_read(&mesh, options));
    }
    // A surface of nothing, and a further triangle.
    let mut mesh = IndexedMesh::new(vec![[0.0; 3]; 2], vec![[0, 1, 1]]);
    mesh.attributes.push(Attribute::new(Semantic::Generic, 1, Values::F32(vec![]), nowhere[..3].to_vec()));
    for options in both_ways(&mesh, 0) {
        assert!(both_read(&mesh, options));
    }
}

/// Charts that seams part, soft values that part nowhere, kinds of triangles that meet somewhere.
fn dressed(mut mesh: IndexedMesh, noise: &mut Noise) -> IndexedMesh {
    // Further triangles, which have values like others.
    for _ in 0..3 {
        let [a, b, c] = mesh.triangles[noise.next() as usize % mesh.triangles.len()];
        mesh.triangles.extend([[a, b, c], [a, b, b]]);
    }
    let (mut uv, mut soft, mut kinds, mut parts) = (vec![], vec![], vec![], vec![]);
    for t in &mesh.triangles {
        let at = t.map(|v| mesh.positions[v as usize]);
        let middle = [0, 1, 2].map(|k| at.iter().map(|p| p[k]).sum::<f64>() / 3.0);
        let chart = (f64::from(u8::from(middle[0] > 0.1)) + 2.0 * f64::from(u8::from(middle[1] > 0.3))) * 4.0;
        for p in at {
            uv.extend([(p[0] + chart) as f32, (p[1] + p[2]) as f32]);
            soft.extend(p.map(|x| x as f32));
        }
        kinds.push(u8::from(middle[2] > 0.5));
        parts.push(u32::from(middle[0] > 0.1));
    }
    let (n, corners) =
        (mesh.triangles.len() as u32, (0..3 * mesh.triangles.len() as u32).collect::<Vec<_>>());
    let kinds = Attribute::new(Semantic::Generic, 1, Values::U8(kinds), (0..n).collect());
    mesh.attributes = vec![
        Attribute::new(Semantic::TexCoord, 2, Values::F32(uv), corners.clone()),
        Attribute::new(Semantic::Normal, 3, Values::F32(soft.clone()), corners.clone()),
        Attribute::new(Semantic::Color, 3, Values::F32(soft), corners),
        Attribute { domain: Domain::Triangle, ..kinds },
        Attribute::parts(&parts),
    ];
    mesh
}

#[test]
fn charts_and_components() {
    let mut noise = Noise(5);
    let shapes = [
        shapes::sphere(2),
        shapes::torus_with_hole(9, 8),
        shapes::grid(7, 6),
        shapes::handle_body(2),
        shapes::disc_with_ears(),
        components(),
    ];
    let mut between = [0; 2];
    for (k, mesh) in shapes.into_iter().enumerate() {
        let mesh = dressed(mesh, &mut noise);
        for options in both_ways(&mesh, 3 * k as u64) {
            let bytes = Encoder::new(options).encode_to_vec(&mesh).unwrap();
            assert!(agree(&bytes).is_some());
            let file = super::container::File::read(&bytes).unwrap();
            let base = file.levels.len() as u64 - 1;
            for born in file.attributes.iter().filter(|a| (1..base).contains(&a.birth)) {
                between[usize::from(born.marks % 2)] += 1;
            }
        }
    }
    assert!(between.iter().all(|&count| count > 1), "of corners and triangles, born between: {between:?}");
}

/// Bytes of what has values others, or the payload of level 0 cut short: refused by both, or the same to both.
#[test]
fn payloads_with_faults() {
    let (mut read, mut refused) = (0, 0);
    for name in ["values.uwm", "born_values.uwm"] {
        let sound = Draft::of(&load(name));
        assert!(sound.bytes() == load(name));
        for (k, atom) in sound.atoms.iter().enumerate() {
            if ![BASE, REFINEMENT, BIRTH, KEYFRAME, ATTRIBUTES].contains(&atom.kind) {
                continue;
            }
            // A few of them: there are four ways in.
            let step = if atom.kind == ATTRIBUTES { 1 } else { 8 };
            for at in (k % step..atom.bytes.len()).step_by(step) {
                let mut other = sound.clone();
                other.atoms[k].bytes[at] ^= 1 << (at % 8);
                let mut drafts = vec![other];
                if atom.kind == ATTRIBUTES {
                    let mut cut = sound.clone();
                    cut.atoms[k].bytes.truncate(at + 1);
                    cut.atoms[k].length = at + 1;
                    drafts.push(cut);
                }
                for draft in drafts {
                    *if agree(&draft.bytes()).is_some() { &mut read } else { &mut refused } += 1;
                }
            }
        }
    }
    assert!(read > 0 && refused > 0, "{read} {refused}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    #[test]
    fn any_soup_with_values(mesh in soup(), seed: u64) {
        let mesh = valued(mesh, seed);
        for options in both_ways(&mesh, seed) {
            prop_assert!(both_read(&mesh, options));
        }
    }
}
