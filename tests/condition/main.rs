//! Conditioning: whatever comes in, a manifold comes out, and nothing is lost.

mod by_hand;
mod random;
mod real;

use std::collections::HashMap;

use unweld::mesh::topology::{Conditioned, Weld, condition};
use unweld::mesh::{Corner, IndexedMesh, Triangle, Vertex};

/// A position that can be compared and sorted; the two zeros are one.
type Point = [u64; 3];

fn point(position: [f64; 3]) -> Point {
    position.map(|x| if x == 0.0 { 0 } else { x.to_bits() })
}

/// Conditions a mesh and checks everything that must hold for all inputs. Where `weld` is `None`, positions must differ.
fn conditioned(mesh: &IndexedMesh, weld: Weld) -> Conditioned {
    let result = condition(mesh, weld);
    assert_eq!(result.manifold.table.check(), Ok(()));
    nothing_is_lost(mesh, &result);
    stitches_join_what_was_one(&result);
    edges_are_cut_where_they_must(&result);
    few_triangles_are_turned(&result);
    a_second_time_there_is_nothing_to_do(&result);
    result
}

fn nothing_is_lost(mesh: &IndexedMesh, result: &Conditioned) {
    let before = mesh.triangles.iter().map(|t| t.map(|v| point(mesh.positions[v as usize])));
    let manifold = result.manifold.table.triangles().map(|t| {
        let [a, b, c] =
            result.manifold.table.triangle(t).map(|v| point(result.manifold.positions[v.index()]));
        if result.remainder.flipped[t.index()] { [a, c, b] } else { [a, b, c] }
    });
    let places: Vec<Point> =
        result.manifold.positions.iter().chain(&result.remainder.extras).map(|&p| point(p)).collect();
    let residue = result.remainder.residue.iter().map(|t| t.map(|v| places[v as usize]));
    assert_eq!(multiset(before), multiset(manifold.chain(residue)));

    let report = &result.report;
    assert_eq!(report.input_vertices, mesh.positions.len());
    assert_eq!(report.input_triangles, mesh.triangles.len());
    assert_eq!(report.degenerate_triangles + report.repeated_triangles, result.remainder.residue.len());
    let copies: usize = result.remainder.stitches.iter().map(|group| group.len() - 1).sum();
    assert_eq!(report.input_vertices - report.welded_vertices, places.len() - copies);
    let (mut before, mut after) = (mesh.positions.iter().map(|&p| point(p)).collect::<Vec<_>>(), places);
    before.sort_unstable();
    before.dedup();
    after.sort_unstable();
    after.dedup();
    assert_eq!(before, after);
}

/// Triangles in an order of their own, each from its smallest point on: what remains is which there are, and how often.
fn multiset(triangles: impl Iterator<Item = [Point; 3]>) -> Vec<[Point; 3]> {
    let from_smallest = |[a, b, c]: [Point; 3]| [[a, b, c], [b, c, a], [c, a, b]].into_iter().min().unwrap();
    let mut triangles: Vec<_> = triangles.map(from_smallest).collect();
    triangles.sort_unstable();
    triangles
}

fn stitches_join_what_was_one(result: &Conditioned) {
    let slots = result.manifold.table.vertex_slots();
    assert_eq!((result.manifold.positions.len(), result.manifold.locked.len()), (slots, slots));
    let mut groups: HashMap<Point, Vec<Vertex>> = HashMap::new();
    for v in (0..slots as u32).map(Vertex) {
        assert!(result.manifold.table.corner_of(v).is_some(), "{v:?} is unused");
        groups.entry(point(result.manifold.positions[v.index()])).or_default().push(v);
    }
    let mut expected: Vec<_> = groups.into_values().filter(|group| group.len() > 1).collect();
    expected.sort_unstable();
    let mut stitches = result.remainder.stitches.clone();
    stitches.sort_unstable();
    assert_eq!(stitches, expected);
    assert_eq!(result.report.cut_vertices, expected.len());
}

fn edges_are_cut_where_they_must(result: &Conditioned) {
    let table = &result.manifold.table;
    let mut edges: HashMap<[Point; 2], Vec<Corner>> = HashMap::new();
    for c in table.triangles().flat_map(|t| t.corners()) {
        let (a, b) = table.edge(c);
        let mut ends = [a, b].map(|v| point(result.manifold.positions[v.index()]));
        ends.sort_unstable();
        edges.entry(ends).or_default().push(c);
    }
    let mut locked = vec![false; table.vertex_slots()];
    result.remainder.stitches.iter().flatten().for_each(|v| locked[v.index()] = true);
    let (mut nonmanifold, mut nonorientable) = (0, 0);
    for corners in edges.values() {
        let open = |c: &&Corner| table.opposite(**c).is_none();
        match corners.len() {
            1 => continue,
            2 => nonorientable += usize::from(corners.iter().any(|c| open(&c))),
            _ => nonmanifold += 1,
        }
        for (a, b) in corners.iter().filter(open).map(|&c| table.edge(c)) {
            locked[a.index()] = true;
            locked[b.index()] = true;
        }
    }
    assert_eq!(
        (result.report.nonmanifold_edges, result.report.nonorientable_edges),
        (nonmanifold, nonorientable)
    );
    assert!(result.manifold.locked.iter().by_vals().eq(locked.iter().copied()));
    assert_eq!(result.report.locked_vertices, result.manifold.locked.count_ones());
}

fn few_triangles_are_turned(result: &Conditioned) {
    let table = &result.manifold.table;
    assert_eq!(result.remainder.flipped.len(), table.slots());
    assert_eq!(result.report.reoriented_triangles, result.remainder.flipped.count_ones());
    let (mut seen, mut components) = (vec![false; table.slots()], 0);
    for first in (0..table.slots() as u32).map(Triangle) {
        let mut component = vec![first];
        let (mut size, mut turned) = (0, 0);
        while let Some(t) = component.pop() {
            if !std::mem::replace(&mut seen[t.index()], true) {
                size += 1;
                turned += usize::from(result.remainder.flipped[t.index()]);
                let across = t.corners().map(|c| table.opposite(c));
                component.extend(across.into_iter().filter(|o| o.is_some()).map(|o| o.triangle()));
            }
        }
        components += usize::from(size > 0);
        assert!(2 * turned <= size);
        assert!(2 * turned < size || size == 0 || !result.remainder.flipped[first.index()]);
    }
    assert_eq!(result.report.census.components, components);
}

fn a_second_time_there_is_nothing_to_do(result: &Conditioned) {
    let triangles =
        result.manifold.table.triangles().map(|t| result.manifold.table.triangle(t).map(|v| v.0)).collect();
    let again = condition(&IndexedMesh::new(result.manifold.positions.clone(), triangles), Weld::None);
    assert_eq!(again.manifold.table, result.manifold.table);
    assert!(
        again.remainder.flipped.not_any()
            && again.manifold.locked.not_any()
            && again.remainder.stitches.is_empty()
    );
    assert!(again.remainder.residue.is_empty() && again.remainder.extras.is_empty());
    assert_eq!(again.report.census, result.report.census);
}
