//! Classes of vertices by the feature edges, seam or boundary, that end at them (DESIGN §3).

use bitvec::slice::BitSlice;

use crate::mesh::corner_table::CornerTable;
use crate::mesh::index::Corner;

/// What a vertex's feature edges allow.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VertexClass {
    /// No feature edge: removable.
    Interior,
    /// Exactly two: removable along its curve.
    Curve,
    /// Any other number: stays.
    Corner,
}

/// The class of every vertex. `seams` has a bit a corner number, four a triangle, set at one or both sides of a seam for the edge opposite;
/// empty, it means no seams. Unused vertices are interior.
///
/// # Panics
/// Where `seams` is neither empty nor of four bits a triangle.
pub fn classify(table: &CornerTable, seams: &BitSlice) -> Vec<VertexClass> {
    assert!(seams.is_empty() || seams.len() == 4 * table.slots(), "one bit a corner number");
    let is_seam = |c: Corner| !seams.is_empty() && seams[c.index()];
    let mut features = vec![0u8; table.vertex_slots()];
    for c in table.triangles().flat_map(|t| t.corners()) {
        let o = table.opposite(c);
        // NONE is the largest index: a boundary edge counts once, as any other edge does.
        if c < o && (o.is_none() || is_seam(c) || is_seam(o)) {
            let (a, b) = table.edge(c);
            for v in [a, b] {
                features[v.index()] = features[v.index()].saturating_add(1);
            }
        }
    }
    let class = |n| match n {
        0 => VertexClass::Interior,
        2 => VertexClass::Curve,
        _ => VertexClass::Corner,
    };
    features.into_iter().map(class).collect()
}

#[cfg(test)]
mod tests {
    use super::VertexClass::{Curve, Interior};
    use super::*;
    use crate::mesh::{IndexedMesh, Vertex, shapes};
    use bitvec::vec::BitVec;

    fn table(mesh: &IndexedMesh) -> CornerTable {
        CornerTable::from_triangles(mesh.positions.len(), &mesh.triangles).unwrap()
    }

    #[test]
    fn without_seams_the_boundary_decides() {
        assert!(
            classify(&table(&shapes::torus(5, 4)), BitSlice::empty()).iter().all(|&class| class == Interior)
        );
        let grid = classify(&table(&shapes::grid(2, 2)), BitSlice::empty());
        assert_eq!(grid, [Curve, Curve, Curve, Curve, Interior, Curve, Curve, Curve, Curve]);
    }

    #[test]
    fn a_seam_marked_on_either_side_counts_once() {
        let table = table(&shapes::sphere(1));
        let centre = Vertex(0);
        let spokes: Vec<Corner> = table.fan(centre).map(|c| c.prev()).collect();
        let class = |seams: &[Corner]| {
            let mut bits: BitVec = BitVec::repeat(false, 4 * table.slots());
            seams.iter().for_each(|c| bits.set(c.index(), true));
            classify(&table, &bits)[0]
        };
        assert_eq!(class(&[]), Interior);
        assert_eq!(class(&spokes[..1]), VertexClass::Corner);
        assert_eq!(class(&spokes[..2]), Curve);
        assert_eq!(class(&[spokes[0], table.opposite(spokes[0])]), VertexClass::Corner);
        assert_eq!(class(&[spokes[0], table.opposite(spokes[0]), table.opposite(spokes[2])]), Curve);
        assert_eq!(class(&spokes), VertexClass::Corner);
    }

    #[test]
    fn an_end_of_a_seam_at_the_boundary_is_a_corner() {
        let table = table(&shapes::grid(2, 1));
        let seam = table.find_edge(Vertex(1), Vertex(4));
        let mut seams: BitVec = BitVec::repeat(false, 4 * table.slots());
        seams.set(seam.index(), true);
        let corners = [Curve, VertexClass::Corner, Curve, Curve, VertexClass::Corner, Curve];
        assert_eq!(classify(&table, &seams), corners);
    }
}
