//! The loop without a container: simplify, write, read, compare by structure and position; storage permuted on the way.

use super::answers::LevelAnswers;
use super::keyframe::{self, Expected};
use super::lift::Cells;
use super::refinement::{LevelPass, SegmentModels, Unknown};
use super::walk::Walk;
use crate::entropy::{RangeDecoder, RangeEncoder};
use crate::limits::{Budget, Limits};
use crate::mesh::random::SplitMix64;
use crate::mesh::{Corner, CornerMap, CornerTable, IndexedMesh, Lattice, Triangle, Vertex, lattice, shapes};
use crate::refine::{Operation, ProgressiveMesh, Roots, Site, stellar};
use crate::simplify::{self, Features, Method, Options};
use bitvec::vec::BitVec;
use proptest::prelude::*;

/// No vertex is lifted here: that is the encoder's business.
const CELLS: Cells = Cells { bits: 16, precision: 0, lifting: 0 };

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

/// What a writer made of a mesh: payloads, and the mesh at each level, from the base on.
struct Written {
    levels: Vec<Vec<u8>>,
    /// Of each level, the base first.
    keyframes: Vec<Vec<u8>>,
    meshes: Vec<ProgressiveMesh>,
}

fn write(input: &IndexedMesh, options: &Options) -> Written {
    let table = CornerTable::from_triangles(input.positions.len(), &input.triangles).unwrap();
    let (min, max) = lattice::bounds(input.positions.iter().copied()).unwrap();
    let lattice = Lattice::over(min, max, CELLS.bits);
    let finest: Vec<_> = input.positions.iter().map(|&p| lattice.quantise(p)).collect();
    let locked = BitVec::repeat(false, input.positions.len());
    let simplified = simplify::simplify(
        table.clone(),
        &input.positions,
        locked,
        Features::default(),
        &lattice,
        options,
        &mut |_, _| true,
    )
    .unwrap();
    simplified.base.check().unwrap();
    let base = simplified.base.compacted();
    let roots = Roots::choose(&base);
    let mut mesh = ProgressiveMesh { table: base, positions: finest.clone(), roots };
    let keyframes = vec![keyframe::encode(&mesh, 0, |_, _| 0).payload];
    let mut written = Written { levels: Vec::new(), keyframes, meshes: vec![mesh.clone()] };
    // The writer goes on with the pass of the level before, the reader begins each level with a new one.
    let mut before: Option<LevelPass> = None;
    for j in (0..simplified.history.level_count()).rev() {
        let mut answers = LevelAnswers::new(&mesh.table, &simplified.history, j, &finest);
        let mut pass = match before {
            Some(before) => before.next(&mesh, CELLS),
            None => LevelPass::new(&mesh, CELLS),
        };
        let mut models = SegmentModels::default();
        let mut coder = RangeEncoder::default();
        for _ in simplified.history.level(j) {
            let inserted = pass.step(&mut mesh, &mut models, &mut coder, &mut answers).unwrap();
            assert!(inserted.is_some(), "every operation of the level is met in its walk");
            check_if_small(&mesh);
            if mesh.table.triangle_count() < 100 {
                assert!(pass.is_measured(&mesh));
            }
        }
        before = Some(pass);
        written.levels.push(coder.finish());
        written.keyframes.push(keyframe::encode(&mesh, 0, |_, _| 0).payload);
        written.meshes.push(mesh.clone());
    }
    let original = ProgressiveMesh { table, positions: finest, roots: Roots::default() };
    assert_eq!(triangles(&mesh), triangles(&original));
    written
}

/// A pass goes on from where lifts have moved vertices, be they few or many: as one that measures all.
#[test]
fn the_next_pass_measures_what_lifts_have_moved() {
    let input = shapes::bumpy_sphere(4, 3);
    let (mut few, mut many) = (0, 0);
    for (lifting, share) in [(13, 1.0), (32, 0.02)] {
        let cells = Cells { lifting, ..CELLS };
        let table = CornerTable::from_triangles(input.positions.len(), &input.triangles).unwrap();
        // In the midst of the lattice, so that nothing leaves it.
        let place = |x: f64| 32_768 + (8_000.0 * x) as i32;
        let places: Vec<_> = input.positions.iter().map(|p| p.map(place)).collect();
        let locked = BitVec::repeat(false, places.len());
        let lattice = Lattice { origin: [-4.0; 3], step: 1.0 / 8_000.0, bits: CELLS.bits };
        let options = Options { base_vertices: Some(60), level_share: share, ..Options::default() };
        let simplified = simplify::simplify(
            table,
            &input.positions,
            locked,
            Features::default(),
            &lattice,
            &options,
            &mut |_, _| true,
        )
        .unwrap();
        let base = simplified.base.compacted();
        let mut mesh =
            ProgressiveMesh { roots: Roots::choose(&base), table: base, positions: places.clone() };
        let mut pass = LevelPass::new(&mesh, cells);
        for j in (0..simplified.history.level_count()).rev() {
            let mut answers = LevelAnswers::new(&mesh.table, &simplified.history, j, &places);
            let mut lifts = 0;
            for _ in simplified.history.level(j) {
                let mut coder = RangeEncoder::default();
                let step = pass.step(&mut mesh, &mut SegmentModels::default(), &mut coder, &mut answers);
                lifts += usize::from(step.unwrap().unwrap().lift.is_some());
            }
            // Vertices have the numbers of the input here: there are as many as in the end.
            if lifts < mesh.positions.len() / 12 {
                few += lifts
            } else {
                many += lifts
            }
            pass = pass.next(&mesh, cells);
            assert!(pass.is_measured(&mesh), "level {j}");
        }
    }
    assert!(few > 0 && many > 0, "{few} and {many}");
}

fn check_if_small(mesh: &ProgressiveMesh) {
    if mesh.table.triangle_count() < 250 {
        mesh.table.check().unwrap();
    }
}

fn expected(mesh: &ProgressiveMesh) -> Expected {
    let used = |v: &u32| mesh.table.corner_of(Vertex(*v)).is_some();
    let vertices = (0..mesh.table.vertex_slots() as u32).filter(used).count() as u32;
    Expected { vertices, triangles: mesh.table.triangle_count() as u32, cells: CELLS }
}

/// Reads from the keyframe of place `start` on. `between` may permute the storage between levels, `inside` the triangles of a
/// new star.
fn read(
    written: &Written,
    start: usize,
    mut between: impl FnMut(&mut ProgressiveMesh),
    mut inside: impl FnMut(&mut ProgressiveMesh, &[Triangle]),
) {
    let mut budget = Budget::new(Limits::default());
    let mut mesh =
        keyframe::decode(&written.keyframes[start], expected(&written.meshes[start]), &mut budget, |_, _| {
            Ok(())
        })
        .unwrap();
    assert_eq!(triangles(&mesh), triangles(&written.meshes[start]));
    for (level, bytes) in written.levels.iter().enumerate().skip(start) {
        between(&mut mesh);
        let mut pass = LevelPass::new(&mesh, CELLS);
        let mut models = SegmentModels::default();
        let mut coder = RangeDecoder::new(bytes);
        let target = expected(&written.meshes[level + 1]).vertices as usize;
        while mesh.positions.len() < target {
            let inserted = pass.step(&mut mesh, &mut models, &mut coder, &mut Unknown).unwrap().unwrap();
            let star: Vec<_> = inserted.star.iter().map(|c| c.triangle()).collect();
            inside(&mut mesh, &star);
            check_if_small(&mesh);
        }
        coder.finish().unwrap();
        assert_eq!(triangles(&mesh), triangles(&written.meshes[level + 1]), "level {level}");
    }
}

/// A random order of `n` things.
fn shuffled(n: usize, random: &mut SplitMix64) -> Vec<u32> {
    let mut order: Vec<u32> = (0..n as u32).collect();
    for k in (1..n).rev() {
        order.swap(k, random.below(k as u32 + 1) as usize);
    }
    order
}

/// The same mesh in other places: triangle t goes to `places[t]`, its corners turned at random; vertex v becomes `names[v]`.
fn moved(mesh: &ProgressiveMesh, places: &[u32], names: &[u32], random: &mut SplitMix64) -> ProgressiveMesh {
    let table = &mesh.table;
    let turns: Vec<u32> = places.iter().map(|_| random.below(3)).collect();
    let corner = |c: Corner| {
        let t = c.triangle().index();
        if c.is_none() { c } else { Triangle(places[t]).corner((c.place() as u32 + turns[t]) % 3) }
    };
    let mut vertices = CornerMap::new(Vertex::NONE, places.len());
    let mut opposites = CornerMap::new(Corner::NONE, places.len());
    for c in opposites.corners() {
        vertices[corner(c)] = Vertex(names[table.vertex(c).index()]);
        opposites[corner(c)] = corner(table.opposite(c));
    }
    let mut positions = vec![[0; 3]; names.len()];
    for (v, &name) in names.iter().enumerate() {
        positions[name as usize] = mesh.positions[v];
    }
    let renamed = |v: Vertex| Vertex(names[v.index()]);
    let edges = mesh.roots.edges().iter().map(|&(u, w)| (renamed(u), renamed(w))).collect();
    let table = CornerTable::from_parts(names.len(), vertices, opposites);
    let roots = Roots::new(&table, edges);
    ProgressiveMesh { table, positions, roots }
}

fn permuted(mesh: &mut ProgressiveMesh, random: &mut SplitMix64) {
    let places = shuffled(mesh.table.slots(), random);
    let names = shuffled(mesh.positions.len(), random);
    *mesh = moved(mesh, &places, &names, random);
}

/// Another allocation of the places of a star's triangles.
fn permuted_star(mesh: &mut ProgressiveMesh, star: &[Triangle], random: &mut SplitMix64) {
    let mut places: Vec<u32> = (0..mesh.table.slots() as u32).collect();
    for (k, to) in shuffled(star.len(), random).into_iter().enumerate() {
        places[star[k].index()] = star[to as usize].0;
    }
    let names: Vec<u32> = (0..mesh.positions.len() as u32).collect();
    // Triangles outside the star must keep their corners, so their turns are taken back.
    let turned = moved(mesh, &places, &names, random);
    let mut table = turned.table;
    let outside = (0..table.slots() as u32).map(Triangle).filter(|t| !star.contains(t));
    for t in outside.collect::<Vec<_>>() {
        while table.vertex(t.corner(0)) != mesh.table.vertex(t.corner(0)) {
            turn(&mut table, t);
        }
    }
    let vertices = table.triangles().map(|t| table.triangle(t)).collect();
    let opposites = table.triangles().map(|t| table.opposites_from(t.corner(0))).collect();
    mesh.table = CornerTable::from_parts(names.len(), CornerMap(vertices), CornerMap(opposites));
}

fn random_corner(table: &CornerTable, random: &mut SplitMix64) -> Corner {
    Triangle(random.below(table.slots() as u32)).corner(random.below(3))
}

/// V and O.
fn sides(table: &CornerTable) -> Vec<(Vertex, Corner)> {
    (0..table.slots() as u32)
        .flat_map(|t| Triangle(t).corners())
        .map(|c| (table.vertex(c), table.opposite(c)))
        .collect()
}

fn turn(table: &mut CornerTable, t: Triangle) {
    let corners = t.corners();
    let old: Vec<_> = corners.iter().map(|&c| (table.vertex(c), table.opposite(c))).collect();
    for k in 0..3 {
        let (v, o) = old[(k + 1) % 3];
        table.set_vertex(corners[k], v);
        table.open(corners[k]);
        table.join(corners[k], o);
    }
}

/// The shape after some random splits, face splits, attachments and flips, with random positions.
fn random_mesh(shape: &IndexedMesh, steps: u32, seed: u64) -> IndexedMesh {
    let mut random = SplitMix64::new(seed);
    let mut table = CornerTable::from_triangles(shape.positions.len(), &shape.triangles).unwrap();
    for _ in 0..steps {
        let c = random_corner(&table, &mut random);
        let v = Vertex(table.vertex_slots() as u32);
        let o = table.opposite(c);
        match random.below(5) {
            0 => drop(stellar::split_edge(&mut table, c, v)),
            1 => stellar::split_face(&mut table, c, v),
            2 if o.is_none() => stellar::attach(&mut table, c, v),
            _ if o.is_some() && !table.has_edge(table.vertex(c), table.vertex(o)) => {
                stellar::flip(&mut table, c);
            }
            _ => {}
        }
    }
    table.check().unwrap();
    let mut coordinate = || f64::from(random.below(1 << CELLS.bits));
    let positions = (0..table.vertex_slots()).map(|_| [coordinate(), coordinate(), coordinate()]).collect();
    let triangles = table.triangles().map(|t| table.triangle(t).map(|v| v.0)).collect();
    IndexedMesh::new(positions, triangles)
}

fn meshes() -> Vec<IndexedMesh> {
    vec![
        shapes::disc_with_ears(),
        shapes::annulus(12),
        shapes::strip(30),
        shapes::torus(10, 8),
        shapes::torus_with_hole(10, 8),
        shapes::two_components(),
        shapes::sphere(2),
        shapes::handle_body(3),
        shapes::tetrahedron(),
    ]
}

#[test]
fn every_shape_comes_back_from_every_keyframe() {
    for input in meshes() {
        for method in [Method::Stellar, Method::Ffc] {
            let options = Options { method, base_vertices: Some(0), ..Options::default() };
            let written = write(&input, &options);
            for start in 0..=written.levels.len() {
                read(&written, start, |_| {}, |_, _| {});
            }
        }
    }
}

/// Lists of a walk are a good part of the memory that decoding takes: a closed surface has three edges to two triangles.
#[test]
fn walks_of_closed_surfaces_take_no_more_memory_than_edges() {
    for shape in [shapes::tetrahedron(), shapes::torus(9, 7), shapes::sphere(3)] {
        let table = CornerTable::from_triangles(shape.positions.len(), &shape.triangles).unwrap();
        let walk = Walk::new(&table, &Roots::choose(&table));
        assert_eq!(walk.edges.len(), shape.triangles.len() * 3 / 2);
        assert!(walk.edges.capacity() <= walk.edges.len() + 8, "{}", walk.edges.capacity());
        assert!(walk.triangles.capacity() <= walk.triangles.len() + 8, "{}", walk.triangles.capacity());
    }
}

#[test]
fn bases_reach_the_topological_minimum() {
    let base = |mesh: &IndexedMesh| {
        let options = Options { base_vertices: Some(0), ..Options::default() };
        expected(&write(mesh, &options).meshes[0])
    };
    // A tetrahedron a closed component, three vertices a boundary loop, seven vertices for a torus (Möbius, Császár).
    assert_eq!(base(&shapes::sphere(3)).vertices, 4);
    assert_eq!(base(&shapes::strip(30)).vertices, 3);
    assert_eq!(base(&shapes::disc_with_ears()).vertices, 3);
    assert_eq!(base(&shapes::annulus(12)).vertices, 6);
    assert_eq!(base(&shapes::torus(16, 12)).vertices, 7);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn random_meshes_come_back_however_they_are_stored(shape in 0..9usize, steps in 0..120u32, seed in any::<u64>()) {
        let input = random_mesh(&meshes()[shape], steps, seed);
        let method = if seed % 2 == 0 { Method::Stellar } else { Method::Ffc };
        let level_share = [0.2, 1.0, 0.02][(seed % 3) as usize];
        let written = write(&input, &Options { method, seed, level_share, base_vertices: Some(0), ..Options::default() });
        let mut random = SplitMix64::new(seed);
        let start = random.below(written.levels.len() as u32 + 1) as usize;
        read(&written, start, |_| {}, |_, _| {});
        let mut other = SplitMix64::new(seed + 1);
        read(&written, start, |m| permuted(m, &mut random), |_, _| {});
        read(&written, start, |_| {}, |m, star| permuted_star(m, star, &mut other));
    }

    #[test]
    fn every_operation_has_its_inverse(shape in 0..9usize, steps in 0..60u32, seed in any::<u64>()) {
        let input = random_mesh(&meshes()[shape], steps, seed);
        let mut random = SplitMix64::new(seed);
        let mut table = CornerTable::from_triangles(input.positions.len(), &input.triangles).unwrap();
        for _ in 0..20 {
            let before = table.clone();
            let k = random_corner(&table, &mut random);
            let vertex = Vertex(table.vertex_slots() as u32);
            let (a, b) = table.edge(k);
            let site = match random.below(3) {
                0 => Site::Edge(a, b),
                1 => Site::Face(a, b, table.vertex(k)),
                _ if table.opposite(k).is_none() => Site::Attach(a, b),
                _ => Site::Edge(a, b),
            };
            // Flips of link edges that may be flipped, each chosen from the star as it then is.
            let mut flips = Vec::new();
            let mut trial = table.clone();
            let start = Operation { vertex, site, first_flip: 0, flip_count: 0 };
            start.apply(&mut trial, &[]).unwrap();
            for _ in 0..random.below(4) {
                let star: Vec<_> = trial.fan(vertex).collect();
                let c = star[random.below(star.len() as u32) as usize];
                let o = trial.opposite(c);
                if o.is_some() && trial.vertex(o) != vertex && !trial.has_edge(vertex, trial.vertex(o)) {
                    flips.push(trial.vertex(c.next()));
                    stellar::flip(&mut trial, c);
                }
            }
            let operation = Operation { flip_count: flips.len() as u32, ..start };
            operation.apply(&mut table, &flips).unwrap();
            table.check().unwrap();
            prop_assert_eq!(&table, &trial);
            let applied = table.clone();
            operation.undo(&mut table, &flips).unwrap();
            table.check().unwrap();
            prop_assert_eq!(sides(&table), sides(&before));
            operation.apply(&mut table, &flips).unwrap();
            prop_assert_eq!(sides(&table), sides(&applied));
        }
    }

    #[test]
    fn no_operation_panics_whatever_it_says(
        shape in 0..9usize,
        operations in prop::collection::vec((0..40u32, 0..3u8, [0..40u32, 0..40, 0..40], prop::collection::vec(0..40u32, 0..4), any::<bool>()), 1..60),
    ) {
        let input = &meshes()[shape];
        let mut table = CornerTable::from_triangles(input.positions.len(), &input.triangles).unwrap();
        for (vertex, kind, [a, b, c], flips, undo) in operations {
            let [a, b, c] = [a, b, c].map(Vertex);
            let site = match kind {
                0 => Site::Edge(a, b),
                1 => Site::Face(a, b, c),
                _ => Site::Attach(a, b),
            };
            let flips: Vec<_> = flips.into_iter().map(Vertex).collect();
            let vertex = Vertex(vertex % (table.vertex_slots() as u32 + 2));
            let operation = Operation { vertex, site, first_flip: 0, flip_count: flips.len() as u32 };
            let _ = if undo { operation.undo(&mut table, &flips) } else { operation.apply(&mut table, &flips) };
            prop_assert_eq!(table.check(), Ok(()));
        }
    }
}
