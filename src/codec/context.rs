//! What a decision is coded under: small classes of the geometry at hand, in integers and plain binary64 (spec §5.5, §9).

use crate::mesh::{Corner, CornerTable};

/// Squared distance of two lattice points. Coordinates stay below 2^24, so the sum is exact.
fn distance_squared(a: [i32; 3], b: [i32; 3]) -> u64 {
    (0..3).map(|k| u64::from(a[k].abs_diff(b[k])).pow(2)).sum()
}

/// Length of an edge, as the bit length of its longest extent along an axis: 0 ..= 32.
pub fn extent(a: [i32; 3], b: [i32; 3]) -> usize {
    let size = (0..3).map(|k| a[k].abs_diff(b[k])).max().unwrap_or(0);
    32 - size.leading_zeros() as usize
}

/// Classes of [`edge_ratio`].
pub const RATIOS: usize = 9;

/// How long the edge opposite to `k` is beside the other edges of its triangles: the class of 4 × squared length over their mean
/// squared length.
pub fn edge_ratio(table: &CornerTable, k: Corner, position: impl Fn(Corner) -> [i32; 3]) -> usize {
    let (a, b) = (position(k.next()), position(k.prev()));
    let mut others = 0;
    let mut count = 0;
    for c in [k, table.opposite(k)].into_iter().filter(|c| c.is_some()) {
        let tip = position(c);
        others += distance_squared(tip, a) + distance_squared(tip, b);
        count += 2;
    }
    let scaled = 4 * count * distance_squared(a, b);
    [1, 2, 3, 4, 5, 6, 8, 12].iter().filter(|&&bound| scaled >= bound * others.max(1)).count()
}

/// Classes of [`delaunay`].
pub const ANGLES: usize = 8;

/// How far the edge p–q between v and r is from being locally Delaunay: the class of cot(angle at v) + cot(angle at r).
pub fn delaunay(v: [i32; 3], p: [i32; 3], q: [i32; 3], r: [i32; 3]) -> usize {
    let sum = cotangent(v, p, q) + cotangent(r, p, q);
    [-1.0, -0.4, -0.1, 0.1, 0.4, 1.0, 2.0].iter().filter(|&&bound| sum >= bound).count()
}

/// Cotangent of the angle at `tip` between `p` and `q`: dot product over length of cross product, which counts as 0.5 at least.
fn cotangent(tip: [i32; 3], p: [i32; 3], q: [i32; 3]) -> f64 {
    let d = |x: [i32; 3]| -> [f64; 3] { std::array::from_fn(|k| f64::from(x[k] - tip[k])) };
    let (x, y) = (d(p), d(q));
    let dot = x[0] * y[0] + x[1] * y[1] + x[2] * y[2];
    let cross = [x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]];
    let length = (cross[0] * cross[0] + cross[1] * cross[1] + cross[2] * cross[2]).sqrt();
    dot / length.max(0.5)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::CornerTable;

    #[test]
    fn the_classes_of_a_square_and_of_its_stretched_diagonal() {
        let table = CornerTable::from_triangles(4, &[[0, 1, 2], [0, 2, 3]]).unwrap();
        let diagonal = table.find_edge(crate::mesh::Vertex(0), crate::mesh::Vertex(2));
        // Squared diagonal 2, squared sides 1: 4 * 2 = 8 times the mean.
        let square = [[0, 0, 0], [10, 0, 0], [10, 10, 0], [0, 10, 0]];
        assert_eq!(edge_ratio(&table, diagonal, |c| square[table.vertex(c).index()]), 7);
        // Both angles opposite to the diagonal are right angles: the sum of cotangents is 0.
        assert_eq!(delaunay(square[1], square[0], square[2], square[3]), 3);
        // Sides of 10, diagonal of 2: the angles opposite are small, the edge is as Delaunay as can be.
        let needle = [[9, 0, 0], [0, 10, 0], [9, 2, 0], [20, 1, 0]];
        assert_eq!(delaunay(needle[1], needle[0], needle[2], needle[3]), 7);
    }

    #[test]
    fn degenerate_geometry_has_classes_too() {
        let table = CornerTable::from_triangles(3, &[[0, 1, 2]]).unwrap();
        assert!(edge_ratio(&table, Corner(0), |_| [7; 3]) < RATIOS);
        assert!(delaunay([1; 3], [1; 3], [1; 3], [1; 3]) < ANGLES);
    }
}
