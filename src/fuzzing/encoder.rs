//! The encoder on any heap of triangles: nothing is lost.

use super::choices::Choices;
use super::decoder::{check_indices, from_keyframe};
use crate::codec::grid::Real;
use crate::container::parse_contents;
use crate::decoder;
use crate::encoder::{self, Encoder, Keyframes, Preview};
use crate::error::Error;
use crate::mesh::topology::Weld;
use crate::mesh::{IndexedMesh, Lattice};

/// Encodes a mesh made of `data` and decodes it by every road: the triangles are the same.
pub fn fuzz_round_trip(data: &[u8]) {
    let mut choices = Choices(data);
    let options = any_options(&mut choices);
    let (exact, keep_order, weld) = (options.exact.is_some(), options.keep_order, options.weld);
    let mesh = any_mesh(&mut choices);
    let file = match Encoder::new(options).encode_to_vec(&mesh) {
        Ok(file) => file,
        Err(Error::Parameter(what)) if mesh.triangles.is_empty() => {
            assert_eq!(what, "the mesh has no triangles");
            return;
        }
        Err(fault) => panic!("{fault}"),
    };
    let contents = parse_contents(&file).ok().flatten().expect("the encoder wrote it");
    let lattice = contents.header.lattice;
    let same = if exact { Weld::None } else { weld }.representatives(&mesh, &lattice);
    let joined = same.iter().map(|&v| mesh.positions[v as usize]).collect();
    let wanted = triangles(&IndexedMesh::new(joined, mesh.triangles.clone()), &lattice);
    for j in contents.segments() {
        let mut decoder = from_keyframe(&file, &contents, j, decoder::Options::default());
        while decoder.poll().expect("the encoder wrote it").is_some() {}
        decoder.finish().expect("no byte is missing");
        assert_eq!(decoder.level(), Some(0));
        let back = decoder.assembled().expect("it is complete");
        check_indices(&back);
        assert_eq!(triangles(&back, &lattice), wanted, "from level {j}");
        if exact && keep_order {
            let bits = |mesh: &IndexedMesh| -> Vec<_> {
                mesh.positions.iter().map(|p| p.map(f64::to_bits)).collect()
            };
            assert_eq!((bits(&back), &back.triangles), (bits(&mesh), &mesh.triangles), "from level {j}");
        } else if keep_order {
            assert_eq!(back.triangles, mesh.triangles, "from level {j}");
        }
    }
}

/// A mesh of few vertices on few places, so that everything that no manifold holds is likely.
fn any_mesh(choices: &mut Choices) -> IndexedMesh {
    let (places, count) = (2 + choices.below(6), 1 + choices.below(24));
    let scale = [1.0, 1e-300, 1e300, 0.1][choices.below(4)];
    let mut place = || {
        let x = choices.below(places) as f64 * scale;
        if x == 0.0 && choices.below(4) == 1 { -x } else { x }
    };
    let positions: Vec<[f64; 3]> = (0..count).map(|_| std::array::from_fn(|_| place())).collect();
    let mut triangles = Vec::new();
    while !choices.0.is_empty() && triangles.len() < 64 {
        triangles.push(std::array::from_fn(|_| choices.below(count) as u32));
    }
    IndexedMesh::new(positions, triangles)
}

fn any_preview(choices: &mut Choices) -> Preview {
    match choices.below(6) {
        0 => Preview::Off,
        1 => Preview::Coarse,
        2 => Preview::Schedule(vec![1]),
        3 => Preview::Fine,
        4 => Preview::Auto,
        _ => Preview::Schedule(vec![2, 2, 7]),
    }
}

fn any_options(choices: &mut Choices) -> encoder::Options {
    let mut options = encoder::Options {
        position_bits: 8 + choices.below(17) as u32,
        lock_boundary: choices.below(4) == 1,
        weld: [Weld::Exact, Weld::None, Weld::Lattice, Weld::Within(1.0)][choices.below(4)],
        atom_bytes: 1 + choices.below(40),
        keyframes: [Keyframes::All, Keyframes::None, Keyframes::Every(2)][choices.below(3)].clone(),
        preview: any_preview(choices),
        lifting: Some(choices.below(33) as u8),
        exact: [None, Some(Real::Binary64)][choices.below(2)],
        keep_order: choices.below(2) == 1,
        rich_models: [None, Some(false), Some(true)][choices.below(3)],
        ..encoder::Options::default()
    };
    options.simplify.base_vertices = Some(choices.below(8));
    options.simplify.level_share = [0.2, 1.0][choices.below(2)];
    options
}

/// Triangles as lattice points, from the smallest corner, sorted: equal for equal surfaces.
fn triangles(mesh: &IndexedMesh, lattice: &Lattice) -> Vec<[[i32; 3]; 3]> {
    let turned = |t: &[u32; 3]| {
        let mut points = t.map(|v| lattice.quantise(mesh.positions[v as usize]));
        let least = (0..3).min_by_key(|&k| [points[k], points[(k + 1) % 3], points[(k + 2) % 3]]);
        points.rotate_left(least.unwrap_or(0));
        points
    };
    let mut all: Vec<_> = mesh.triangles.iter().map(turned).collect();
    all.sort_unstable();
    all
}
