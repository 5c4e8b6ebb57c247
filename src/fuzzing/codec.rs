//! The codec on hostile payloads.

use bitvec::vec::BitVec;

use super::choices::Choices;
use super::decoder::check_indices;
use super::seeds;
use crate::codec::correction::Correction;
use crate::codec::keyframe::{self, Expected};
use crate::codec::lift::Cells;
use crate::codec::order::Order;
use crate::codec::refinement::{LevelPass, SegmentModels, Unknown};
use crate::codec::residue::Residue;
use crate::codec::walk::{Tour, Walk};
use crate::codec::whole::Whole;
use crate::container::AtomKind;
use crate::entropy::RangeDecoder;
use crate::limits::{Budget, Limits};
use crate::mesh::{CornerTable, IndexedMesh, Lattice, Vertex, lattice, shapes};
use crate::refine::{ProgressiveMesh, Roots};

/// Reads `data` as the refinement of a small mesh, level after level, and checks the mesh after each operation.
pub fn fuzz_refinement(data: &[u8]) {
    let mut choices = Choices(data);
    let (mut mesh, lattice) = small_mesh(choices.below(SHAPES.len()));
    let mut precision = choices.below(lattice.bits as usize) as u32;
    let lifting = choices.below(33) as u8;
    let mut models = SegmentModels::default();
    let mut coder = RangeDecoder::new(choices.0);
    for x in mesh.positions.iter_mut().flatten() {
        *x = crate::refine::from_cell(*x >> precision, precision);
    }
    for _ in 0..8 {
        let walk = Walk::new(&mesh.table, &mesh.roots);
        check_walk(&mesh, &walk);
        let cells = Cells { bits: lattice.bits, precision, lifting };
        let mut pass = LevelPass::new(&mesh, cells);
        let mut in_star = BitVec::<usize>::repeat(false, mesh.table.slots());
        loop {
            let step = pass.step(&mut mesh, &mut models, &mut coder, &mut Unknown);
            mesh.table.check().expect("every operation leaves a manifold");
            assert_eq!(mesh.positions.len(), mesh.table.vertex_slots());
            assert!(mesh.positions.iter().all(|&p| cells.hold_position(p)));
            let Ok(step) = step else { return };
            let Some(inserted) = step else { break };
            in_star.resize(mesh.table.slots(), false);
            assert!(
                inserted.star.iter().all(|c| !in_star.replace(c.triangle().index(), true)),
                "stars share a triangle"
            );
            if mesh.positions.len() > 300 {
                return;
            }
        }
        precision /= 2;
    }
}

/// Reads `data` as a keyframe, and as changes to a keyframe. What is accepted can be written, and is then read as the same mesh.
pub fn fuzz_keyframe(data: &[u8]) {
    let mut choices = Choices(data);
    let [vertices, triangles] = [3, 1].map(|least| least + choices.below(64) as u32);
    read_keyframe(
        choices.0,
        Expected { vertices, triangles, cells: Cells { bits: 8, precision: 0, lifting: 0 } },
        choices.0.len() % 2 == 1,
    );
    let mut choices = Choices(data);
    let payloads = seeds::payloads(&[AtomKind::Base, AtomKind::Keyframe, AtomKind::Birth]);
    let (payload, seed, level) = payloads[choices.below(payloads.len())];
    let born = seed.born(payload);
    let (level, bits) = (seed.level(level), seed.lattice().bits);
    let cells = Cells { bits, precision: level.precision, lifting: seed.lifting() };
    let [vertices, triangles] = born.unwrap_or([level.vertices, level.triangles]);
    let mut expected = Expected { vertices, triangles, cells };
    let mut payload = payload.to_vec();
    while let Some(what) = choices.byte() {
        match what % 8 {
            0 => expected.triangles = expected.triangles.saturating_add_signed(choices.below(9) as i32 - 4),
            1 => expected.vertices = expected.vertices.saturating_add_signed(choices.below(9) as i32 - 4),
            2 => payload.truncate(1 + choices.below(payload.len())),
            3 => payload.extend(choices.byte()),
            _ => {
                let at = choices.below(payload.len());
                payload[at] ^= choices.byte().unwrap_or(1);
            }
        }
    }
    read_keyframe(&payload, expected, born.is_some());
}

/// A keyframe, or components that are born.
fn read_keyframe(payload: &[u8], expected: Expected, born: bool) {
    // Seeds are of meshes without attributes: nothing comes behind positions.
    let decode = |payload: &[u8]| match born {
        true => keyframe::decode_birth(payload, expected, &mut budget(), |_, _| Ok(())),
        false => keyframe::decode(payload, expected, &mut budget(), |_, _| Ok(())),
    };
    let Ok(mesh) = decode(payload) else { return };
    mesh.table.check().expect("a keyframe is a manifold");
    let counts = (mesh.table.triangle_count() as u32, mesh.positions.len() as u32);
    assert_eq!(counts, (expected.triangles, expected.vertices));
    assert!(mesh.positions.iter().all(|&p| expected.cells.hold_position(p)));
    check_walk(&mesh, &Walk::new(&mesh.table, &mesh.roots));
    let again = match born {
        true => keyframe::encode_birth(&mesh, expected.cells.precision, |_, _| 0),
        false => keyframe::encode(&mesh, expected.cells.precision, |_, _| 0),
    };
    let copy = decode(&again.payload).expect("what was written can be read");
    assert_eq!(copy.positions, mesh.positions);
    assert_eq!(copy.roots.edges(), mesh.roots.edges());
    let triangles = |mesh: &ProgressiveMesh| {
        let walk = Walk::new(&mesh.table, &mesh.roots);
        walk.triangles
            .iter()
            .map(|&c| [c, c.next(), c.prev()].map(|c| mesh.table.vertex(c)))
            .collect::<Vec<_>>()
    };
    assert_eq!(triangles(&copy), triangles(&mesh));
}

/// Reads `data` as the residue of a small mesh, and as a change of one. What is accepted can be assembled, and written again.
pub fn fuzz_residue(data: &[u8]) {
    let mut choices = Choices(data);
    let (mesh, lattice) = small_mesh(choices.below(SHAPES.len()));
    read_residue(choices.0, &mesh, &lattice);
    let mut residue = Residue::default();
    let flips = choices.bytes(4);
    residue.flipped =
        (0..mesh.table.triangle_count()).map(|k| flips.get(k % 8).is_some_and(|x| x & 1 == 1)).collect();
    let mut payload =
        residue.encode(&mesh, &Tour::new(&mesh), &mut Budget::unlimited()).expect("flags can be written");
    payload.extend(choices.0);
    read_residue(&payload, &mesh, &lattice);
}

fn read_residue(payload: &[u8], mesh: &ProgressiveMesh, lattice: &Lattice) {
    let tour = Tour::new(mesh);
    let Ok(residue) = Residue::decode(payload, mesh, &tour, &mut budget()) else { return };
    let assembled = Whole::new(mesh, &residue, &tour).on_lattice(lattice);
    check_indices(&assembled);
    assert!(assembled.positions.iter().flatten().all(|x| x.is_finite()));
    assert!(assembled.positions.len() <= mesh.positions.len() + residue.extras.len());
    let again = residue.encode(mesh, &tour, &mut Budget::unlimited()).expect("what was read can be written");
    let copy = Residue::decode(&again, mesh, &tour, &mut budget()).expect("what was written can be read");
    assert_eq!(Whole::new(mesh, &copy, &tour).on_lattice(lattice), assembled);
}

/// Reads `data` as correction and order of a small mesh with a residue. What is accepted can be written again, and is the same.
pub fn fuzz_exact(data: &[u8]) {
    let mut choices = Choices(data);
    let (mesh, lattice) = small_mesh(choices.below(SHAPES.len()));
    let n = choices.below(8);
    let tour = Tour::new(&mesh);
    let residue = Residue::decode(choices.bytes(n), &mesh, &tour, &mut budget()).unwrap_or_default();
    let mut whole = Whole::new(&mesh, &residue, &tour);
    let n = choices.below(64);
    let mut assembled = whole.clone().on_lattice(&lattice);
    if let Ok(correction) = Correction::decode(choices.bytes(n), &whole, &lattice, &mut budget()) {
        let again = correction
            .encode(&whole, &lattice, &mut Budget::unlimited())
            .expect("what was read can be written");
        let copy = Correction::decode(&again, &whole, &lattice, &mut budget())
            .expect("what was written can be read");
        correction.apply(&mut assembled);
        let mut other = whole.clone().on_lattice(&lattice);
        copy.apply(&mut other);
        let bits =
            |mesh: &IndexedMesh| -> Vec<_> { mesh.positions.iter().map(|p| p.map(f64::to_bits)).collect() };
        assert_eq!(bits(&assembled), bits(&other));
        assert_eq!(assembled.triangles, other.triangles);
        assert!(assembled.positions.iter().flatten().all(|&x| correction.real.holds(x)));
        correction.rename(&mut whole.triangles);
    }
    let count = assembled.positions.len();
    let order = Order::decode(choices.0, &mesh, &residue, &tour.walk, &whole, count, &mut budget());
    let Ok(order) = order else { return };
    let ordered = order.apply(&assembled.positions);
    check_indices(&ordered);
    let corners = |mesh: &IndexedMesh| {
        let turned = |t: &[u32; 3]| {
            let mut t = t.map(|v| mesh.positions[v as usize].map(f64::to_bits));
            let least = (0..3).min_by_key(|&k| [t[k], t[(k + 1) % 3], t[(k + 2) % 3]]).unwrap_or(0);
            t.rotate_left(least);
            t
        };
        let mut all: Vec<_> = mesh.triangles.iter().map(turned).collect();
        all.sort_unstable();
        all
    };
    assert_eq!(corners(&ordered), corners(&assembled), "an order adds no triangle and loses none");
}

/// The walk comes to every triangle and every vertex, once.
fn check_walk(mesh: &ProgressiveMesh, walk: &Walk) {
    assert_eq!(walk.triangles.len(), mesh.table.triangle_count(), "a triangle that no root leads to");
    assert_eq!(walk.vertices(&mesh.table).len(), mesh.positions.len());
    for &c in &walk.triangles {
        assert!(mesh.table.is_live(c.triangle()));
    }
    let boundary = walk.edges.iter().filter(|&&k| mesh.table.opposite(k).is_none()).count();
    assert_eq!(3 * walk.triangles.len() + boundary, 2 * walk.edges.len(), "an edge left out or listed twice");
}

fn small_mesh(which: usize) -> (ProgressiveMesh, Lattice) {
    let mesh = SHAPES[which]();
    let (min, max) = lattice::bounds(mesh.positions.iter().copied()).expect("a shape has vertices");
    let lattice = Lattice::over(min, max, 8);
    let table =
        CornerTable::from_triangles(mesh.positions.len(), &mesh.triangles).expect("a shape is a manifold");
    let positions = mesh.positions.iter().map(|&p| lattice.quantise(p)).collect();
    let roots = Roots::choose(&table);
    debug_assert!((0..mesh.positions.len() as u32).all(|v| table.corner_of(Vertex(v)).is_some()));
    (ProgressiveMesh { table, positions, roots }, lattice)
}

fn budget() -> Budget {
    Budget::new(Limits { memory: 16 << 20, work: 1 << 20 })
}

const SHAPES: [fn() -> IndexedMesh; 7] = [
    shapes::tetrahedron,
    || shapes::strip(1),
    shapes::disc_with_ears,
    || shapes::annulus(3),
    || shapes::torus_with_hole(4, 3),
    shapes::two_components,
    || shapes::handle_body(1),
];
