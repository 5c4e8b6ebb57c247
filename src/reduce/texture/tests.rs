//! Maps looked at from outside, by their texture coordinates alone.

use super::*;
use crate::mesh::attributes::{Attribute, Semantic, Values};
use crate::mesh::paint::{Image, Material, Paint};
use crate::mesh::random::SplitMix64;
use crate::mesh::{IndexedMesh, shapes};
use crate::reduce::{Method, Options, reduce};
use proptest::prelude::*;
use std::collections::HashMap;

/// A mesh of which every vertex has a colour of its own.
fn coloured(mut mesh: IndexedMesh, seed: u64) -> IndexedMesh {
    let mut random = SplitMix64::new(seed);
    let colours = (0..3 * mesh.positions.len()).map(|_| random.next_u64() as u8).collect();
    let colours =
        Attribute::new(Semantic::Color, 3, Values::U8(colours), mesh.triangles.as_flattened().to_vec());
    mesh.attributes.push(Attribute { normalised: true, ..colours });
    mesh
}

fn simplified(mesh: &IndexedMesh, faces: usize, method: Method) -> IndexedMesh {
    let options = Options { method, attributes: false, ..Options::default() };
    let mesh = reduce(mesh, faces, &options, &mut |_, _| true).unwrap().mesh;
    IndexedMesh::new(mesh.positions, mesh.triangles)
}

fn made(mesh: &IndexedMesh, original: &IndexedMesh, paint: &Paint, options: &BakeOptions) -> Baked {
    bake(mesh, original, paint, options, &mut |_, _| true).unwrap()
}

/// The texel of each corner.
fn corners(baked: &Baked) -> Vec<[i64; 2]> {
    let sides = [baked.map.width, baked.map.height].map(f64::from);
    let of = |value: usize| {
        [0, 1].map(|k| {
            let at = baked.places.values.number(2 * value + k) * sides[k] - 0.5;
            assert_eq!(at, at.round());
            at as i64
        })
    };
    (0..baked.places.count()).map(of).collect()
}

/// The colours from one texel to another, straight.
fn along(map: &Image, from: [i64; 2], to: [i64; 2]) -> Vec<[u8; 4]> {
    let steps = [0, 1].map(|k| to[k] - from[k]);
    let count = steps[0].abs().max(steps[1].abs());
    assert!(count > 0 && steps.iter().all(|step| step.abs() == count || *step == 0));
    let at = |s: i64| {
        let [x, y] = [0, 1].map(|k| from[k] + steps[k] / count * s);
        map.pixels[(y * i64::from(map.width) + x) as usize]
    };
    (0..=count).map(at).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn vertices_have_one_colour_and_edges_the_same_from_both_sides(
        faces in 4usize..200, gutter in 0u32..3, log in 15u32..18, seed: u64,
        method in prop::sample::select(vec![Method::Hqms, Method::Octree, Method::Uniform]),
    ) {
        let original = coloured(shapes::bumpy_sphere(2, 1), seed);
        let mesh = simplified(&original, faces, method);
        prop_assume!(!mesh.triangles.is_empty());
        let options = BakeOptions { texels: 1 << log, gutter, ..BakeOptions::default() };
        let baked = made(&mesh, &original, &Paint::default(), &options);
        let corners = corners(&baked);
        let mut of_vertices = HashMap::new();
        let mut of_edges: HashMap<[u32; 2], Vec<Vec<[u8; 4]>>> = HashMap::new();
        for (t, triangle) in mesh.triangles.iter().enumerate() {
            for k in 0..3 {
                let (next, [a, b]) = ((k + 1) % 3, [triangle[k], triangle[(k + 1) % 3]]);
                let mut texels = along(&baked.map, corners[3 * t + k], corners[3 * t + next]);
                let first = texels[0];
                prop_assert_eq!(*of_vertices.entry(a).or_insert(first), first);
                if b < a {
                    texels.reverse();
                }
                of_edges.entry([a.min(b), a.max(b)]).or_default().push(texels);
            }
        }
        for sides in of_edges.values() {
            let coarse = sides.iter().min_by_key(|side| side.len()).unwrap();
            for side in sides {
                for (s, texel) in side.iter().enumerate() {
                    // Some texel of the coarser side covers the middle of this one.
                    let middle = (s as f64 + 0.5) / side.len() as f64 * coarse.len() as f64;
                    let [low, high] = [middle - 1e-9, middle + 1e-9].map(|at| (at.floor() as usize).min(coarse.len() - 1));
                    prop_assert!(*texel == coarse[low] || *texel == coarse[high]);
                }
            }
        }
    }
}

/// A sphere with a picture on it of soft colours, by a projection that covers both halves.
fn pictured() -> (IndexedMesh, Paint) {
    let mut mesh = shapes::bumpy_sphere(3, 1);
    let places = mesh.positions.iter().flat_map(|p| [0, 1].map(|k| 0.5 + 0.3 * p[k] as f32)).collect();
    let corners = mesh.triangles.as_flattened().to_vec();
    mesh.attributes.push(Attribute::new(Semantic::TexCoord, 2, Values::F32(places), corners));
    let wave =
        |k: u32, f: f64| (127.5 + 127.0 * (f64::from(k) / 64.0 * f * std::f64::consts::TAU).sin()) as u8;
    let pixels =
        (0..64 * 64u32).map(|k| [wave(k % 64, 3.0), wave(k / 64, 2.0), wave(k % 64 + k / 64, 1.0), 9]);
    let image = Image { width: 64, height: 64, pixels: pixels.collect() };
    let mut paint = Paint::default();
    paint.cover(image, true);
    (mesh, paint)
}

#[test]
fn what_is_not_simplified_keeps_its_colours() {
    let (original, paint) = pictured();
    let mesh = IndexedMesh::new(original.positions.clone(), original.triangles.clone());
    let off = |texels| {
        let options = BakeOptions { texels, ..BakeOptions::default() };
        let baked = made(&mesh, &original, &paint, &options);
        let own = baked.paint();
        let mut with = mesh.clone();
        with.attributes.push(baked.places);
        assert_eq!(own.materials[0].cutoff, 0.0);
        colour_difference((&with, &own), (&original, &paint), 20_000, &options).unwrap()
    };
    let differences = [1 << 16, 1 << 18].map(off);
    assert!(
        differences[1] <= 1.0 && differences[1] < differences[0] && differences[0] < 3.0,
        "{differences:?}"
    );
}

#[test]
fn threads_do_not_matter() {
    let original = coloured(shapes::bumpy_sphere(3, 1), 7);
    let mesh = simplified(&original, 300, Method::Hqms);
    let of = |threads: usize| {
        let options =
            BakeOptions { texels: 1 << 15, threads: threads.try_into().unwrap(), ..BakeOptions::default() };
        made(&mesh, &original, &Paint::default(), &options)
    };
    assert_eq!(of(1), of(3));
}

#[test]
fn what_cannot_be_baked_is_told() {
    let (original, mut paint) = pictured();
    let bare = IndexedMesh::new(original.positions.clone(), original.triangles.clone());
    let options = BakeOptions::default();
    let error = |mesh: &IndexedMesh, original: &IndexedMesh, paint: &Paint, options: &BakeOptions| {
        bake(mesh, original, paint, options, &mut |_, _| true).unwrap_err().to_string()
    };
    let told = error(&bare, &bare, &Paint::default(), &options);
    assert!(told.contains("nothing to bake: the original has no colours and no texture"), "{told}");
    let told = error(&bare, &bare, &paint, &options);
    assert!(told.contains("triangle 0 of the original has a texture, but no texture coordinates"), "{told}");
    let told = error(&bare, &original, &paint, &BakeOptions { texels: 100, ..options });
    assert!(told.contains("100 texels are too few"), "{told}");
    let told = error(&IndexedMesh::default(), &original, &paint, &options);
    assert!(told.contains("without a triangle"), "{told}");
    let told = error(&bare, &original, &paint, &BakeOptions { max_memory: 1 << 20, ..options });
    assert!(told.contains("memory"), "{told}");
    paint.materials[0] = Material { image: None, ..paint.materials[0] };
    assert!(bake(&bare, &bare, &paint, &options, &mut |_, _| false).is_err());
}
