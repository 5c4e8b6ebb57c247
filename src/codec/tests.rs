//! The loop without a container: simplify, write, read, compare by structure and position.

use super::answers::LevelAnswers;
use super::keyframe::{self, Expected};
use super::refinement::{LevelPass, SegmentModels, Unknown};
use super::walk::Walk;
use crate::entropy::{RangeDecoder, RangeEncoder};
use crate::limits::{Budget, Limits};
use crate::mesh::{CornerTable, IndexedMesh, Lattice, Vertex, lattice, shapes};
use crate::refine::{ProgressiveMesh, Roots};
use crate::simplify::{self, Method, Options};
use bitvec::vec::BitVec;

const BITS: u32 = 16;

/// All triangles as positions, each in the smallest of its rotations, sorted.
fn triangles(mesh: &ProgressiveMesh) -> Vec<[[i32; 3]; 3]> {
    let rotated = |t| {
        let [a, b, c] = mesh.table.triangle(t).map(|v| mesh.positions[v.index()]);
        [[a, b, c], [b, c, a], [c, a, b]].into_iter().min().unwrap()
    };
    let mut all: Vec<_> = mesh.table.triangles().map(rotated).collect();
    all.sort_unstable();
    all
}

struct Written {
    base: Vec<u8>,
    levels: Vec<Vec<u8>>,
    keyframes: Vec<Vec<u8>>,
    /// The mesh at each level, finest first.
    meshes: Vec<ProgressiveMesh>,
}

fn write(input: &IndexedMesh, options: &Options) -> Written {
    let table = CornerTable::from_triangles(input.positions.len(), &input.triangles).unwrap();
    let (min, max) = lattice::bounds(input.positions.iter().copied()).unwrap();
    let lattice = Lattice::over(min, max, BITS);
    let positions: Vec<_> = input.positions.iter().map(|&p| lattice.quantise(p)).collect();
    let locked = BitVec::repeat(false, input.positions.len());
    let simplified =
        simplify::simplify(table.clone(), &input.positions, locked, &lattice, options, &mut |_, _| true)
            .unwrap();
    simplified.base.check().unwrap();
    let base = simplified.base.compacted();
    let roots = Roots::choose(&base);
    let mut mesh = ProgressiveMesh { table: base, positions, roots };
    let finest = mesh.positions.clone();
    let mut written =
        Written { base: Vec::new(), levels: Vec::new(), keyframes: Vec::new(), meshes: Vec::new() };
    written.base = keyframe::encode(&mesh, 0).payload;
    written.meshes.push(mesh.clone());
    for j in (0..simplified.history.level_count()).rev() {
        let mut answers = LevelAnswers::new(&mesh.table, &simplified.history, j, &finest);
        let walk = Walk::new(&mesh.table, &mesh.roots);
        let mut pass = LevelPass::new(&mesh, walk, 0, BITS);
        let mut models = SegmentModels::default();
        let mut coder = RangeEncoder::default();
        for _ in simplified.history.level(j) {
            let inserted = pass.step(&mut mesh, &mut models, &mut coder, &mut answers).unwrap();
            assert!(inserted.is_some(), "every operation of the level is met in its walk");
            if input.triangles.len() < 400 {
                mesh.table.check().unwrap();
            }
        }
        written.levels.push(coder.finish());
        written.keyframes.push(keyframe::encode(&mesh, 0).payload);
        written.meshes.push(mesh.clone());
    }
    assert_eq!(
        triangles(&mesh),
        triangles(&ProgressiveMesh { table, positions: finest, roots: Roots::default() })
    );
    written
}

fn expected(mesh: &ProgressiveMesh) -> Expected {
    let vertices =
        (0..mesh.table.vertex_slots() as u32).filter(|&v| mesh.table.corner_of(Vertex(v)).is_some());
    let triangles = mesh.table.triangle_count() as u32;
    Expected { vertices: vertices.count() as u32, triangles, precision: 0, bits: BITS }
}

fn read(written: &Written, start: usize, mut between: impl FnMut(&mut ProgressiveMesh)) {
    let mut budget = Budget::new(Limits::default());
    let payload = if start == 0 { &written.base } else { &written.keyframes[start - 1] };
    let mut mesh = keyframe::decode(payload, expected(&written.meshes[start]), &mut budget).unwrap();
    assert_eq!(triangles(&mesh), triangles(&written.meshes[start]));
    for (level, bytes) in written.levels.iter().enumerate().skip(start) {
        between(&mut mesh);
        let walk = Walk::new(&mesh.table, &mesh.roots);
        let mut pass = LevelPass::new(&mesh, walk, 0, BITS);
        let mut models = SegmentModels::default();
        let mut coder = RangeDecoder::new(bytes);
        let target = expected(&written.meshes[level + 1]).vertices as usize;
        while mesh.positions.len() < target {
            let inserted = pass.step(&mut mesh, &mut models, &mut coder, &mut Unknown).unwrap();
            assert!(inserted.is_some());
            if mesh.positions.len() < 300 {
                mesh.table.check().unwrap();
            }
        }
        coder.finish().unwrap();
        assert_eq!(triangles(&mesh), triangles(&written.meshes[level + 1]), "level {level}");
    }
}

fn meshes() -> Vec<(&'static str, IndexedMesh)> {
    vec![
        ("tetrahedron", shapes::tetrahedron()),
        ("disc with ears", shapes::disc_with_ears()),
        ("annulus", shapes::annulus(12)),
        ("strip", shapes::strip(30)),
        ("grid", shapes::grid(13, 9)),
        ("torus", shapes::torus(16, 12)),
        ("torus with hole", shapes::torus_with_hole(16, 12)),
        ("two components", shapes::two_components()),
        ("handles", shapes::handle_body(3)),
        ("sphere", shapes::sphere(3)),
    ]
}

#[test]
fn every_shape_goes_down_and_comes_back_from_every_keyframe() {
    for (name, input) in meshes() {
        for method in [Method::Stellar, Method::Ffc] {
            for seed in 0..3 {
                let options = Options { method, seed, base_vertices: Some(0), ..Options::default() };
                let written = write(&input, &options);
                eprintln!(
                    "{name} {method:?}: {} levels, base {:?}",
                    written.levels.len(),
                    expected(&written.meshes[0])
                );
                for start in 0..=written.levels.len() {
                    read(&written, start, |_| {});
                }
            }
        }
    }
}
