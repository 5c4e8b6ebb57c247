//! Affine transformations of nodes (glTF 2.0, §3.5.3), in binary64.

use super::json::At;
use crate::error::Result;

/// The upper three rows of a 4 x 4 matrix.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Matrix([[f64; 4]; 3]);

impl Matrix {
    pub(super) const IDENTITY: Self =
        Self([[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]]);

    /// A node's own.
    ///
    /// # Errors
    /// Where its numbers are not as many as they must be.
    pub(super) fn of_node(node: &At<'_>) -> Result<Self> {
        if let Some(m) = node.numbers::<16>("matrix")? {
            return Ok(Self([0, 1, 2].map(|row| [0, 1, 2, 3].map(|column| m[4 * column + row]))));
        }
        let translation = node.numbers("translation")?.unwrap_or([0.0; 3]);
        let rotation = node.numbers("rotation")?.unwrap_or([0.0, 0.0, 0.0, 1.0]);
        Ok(Self::of_parts(translation, rotation, node.numbers("scale")?.unwrap_or([1.0; 3])))
    }

    /// Scaled first, then rotated by a quaternion, which may be of any length, then moved.
    pub(super) fn of_parts(translation: [f64; 3], rotation: [f64; 4], scale: [f64; 3]) -> Self {
        let square: f64 = rotation.iter().map(|q| q * q).sum();
        // What turns round nothing turns nothing.
        let s = if square > 0.0 { 2.0 / square } else { 0.0 };
        let [x, y, z, w] = rotation;
        let turn = [
            [1.0 - s * (y * y + z * z), s * (x * y - z * w), s * (x * z + y * w)],
            [s * (x * y + z * w), 1.0 - s * (x * x + z * z), s * (y * z - x * w)],
            [s * (x * z - y * w), s * (y * z + x * w), 1.0 - s * (x * x + y * y)],
        ];
        Self([0, 1, 2].map(|row| {
            let [a, b, c] = turn[row];
            [a * scale[0], b * scale[1], c * scale[2], translation[row]]
        }))
    }

    /// This behind another.
    pub(super) fn after(&self, first: &Self) -> Self {
        let column = |k: usize| [0, 1, 2].map(|row| first.0[row][k]);
        let [x, y, z] = [0, 1, 2].map(|k| self.direction(column(k)));
        let w = self.point(column(3));
        Self([0, 1, 2].map(|row| [x[row], y[row], z[row], w[row]]))
    }

    pub(super) fn point(&self, p: [f64; 3]) -> [f64; 3] {
        if *self == Self::IDENTITY {
            // Signs of zeros too.
            return p;
        }
        self.0.map(|[a, b, c, d]| a * p[0] + b * p[1] + c * p[2] + d)
    }

    /// A direction along a surface.
    pub(super) fn direction(&self, p: [f64; 3]) -> [f64; 3] {
        self.0.map(|[a, b, c, _]| a * p[0] + b * p[1] + c * p[2])
    }

    /// A normal of a surface, of any length: by the inverse transpose, but for its length that of the cofactors, which even
    /// a flattening matrix has.
    pub(super) fn normal(&self, p: [f64; 3]) -> [f64; 3] {
        let side = if self.mirrors() { -1.0 } else { 1.0 };
        self.cofactors().map(|[a, b, c]| side * (a * p[0] + b * p[1] + c * p[2]))
    }

    /// Whether it makes a left hand of a right one.
    pub(super) fn mirrors(&self) -> bool {
        let (first, cofactors) = (self.0[0], self.cofactors()[0]);
        (0..3).map(|k| first[k] * cofactors[k]).sum::<f64>() < 0.0
    }

    /// Whether directions stay as they are: it moves, and scales all alike, at most.
    pub(super) fn keeps_directions(&self) -> bool {
        let [[a, b, c, _], [d, e, f, _], [g, h, i, _]] = self.0;
        a > 0.0 && a == e && a == i && [b, c, d, f, g, h].iter().all(|&x| x == 0.0)
    }

    fn cofactors(&self) -> [[f64; 3]; 3] {
        let minor = |row: usize, column: usize| {
            let [r, s] = [(row + 1) % 3, (row + 2) % 3];
            let [c, d] = [(column + 1) % 3, (column + 2) % 3];
            self.0[r][c] * self.0[s][d] - self.0[r][d] * self.0[s][c]
        };
        [0, 1, 2].map(|row| [0, 1, 2].map(|column| minor(row, column)))
    }
}

/// A direction with length 1; what has no length, or none that is a number, as it is.
pub(super) fn unit(p: [f64; 3]) -> [f64; 3] {
    // Squares of what is far from 1 would not be numbers.
    let largest = p.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    if largest == 0.0 || !largest.is_finite() {
        return p;
    }
    let p = p.map(|x| x / largest);
    let length = (p[0] * p[0] + p[1] * p[1] + p[2] * p[2]).sqrt();
    p.map(|x| x / length)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn near(x: [f64; 3], y: [f64; 3]) -> bool {
        x.iter().zip(y).all(|(x, y)| (x - y).abs() < 1e-12)
    }

    #[test]
    fn nodes() {
        let half = 0.5f64.sqrt();
        // A quarter turn about z takes x to y.
        let node = json!({"translation": [10, 0, 0], "rotation": [0, 0, 3.0 * half, 3.0 * half], "scale": [2, 1, 1]});
        let m = Matrix::of_node(&At::root(&node)).unwrap();
        assert!(near(m.point([1.0, 0.0, 0.0]), [10.0, 2.0, 0.0]));
        assert!(near(m.point([0.0, 1.0, 5.0]), [9.0, 0.0, 5.0]));
        let matrix = json!({"matrix": [0, 2, 0, 0, -1, 0, 0, 0, 0, 0, 1, 0, 10, 0, 0, 1]});
        let same = Matrix::of_node(&At::root(&matrix)).unwrap();
        for p in [[1.0, 2.0, 3.0], [-4.0, 0.5, 0.0]] {
            assert!(near(m.point(p), same.point(p)));
        }
        let twice = same.after(&same);
        assert!(near(twice.point([1.0, 2.0, 3.0]), same.point(same.point([1.0, 2.0, 3.0]))));
        assert!(!m.mirrors() && !m.keeps_directions());
    }

    #[test]
    fn normals_stay_normals() {
        let m = Matrix::of_parts([1.0, 2.0, 3.0], [0.1, 0.7, -0.3, 0.4], [1.0, -3.0, 0.25]);
        let (u, v, n) = ([1.0, 2.0, 0.0], [0.0, 1.0, -1.0], [-2.0, 1.0, 1.0]);
        let dot = |x: [f64; 3], y: [f64; 3]| x[0] * y[0] + x[1] * y[1] + x[2] * y[2];
        let turned = m.normal(n);
        assert!(dot(turned, m.direction(u)).abs() < 1e-12 && dot(turned, m.direction(v)).abs() < 1e-12);
        assert!(m.mirrors() && dot(turned, m.direction(n)) > 0.0);
        // A plane that a scale of zero flattens keeps its normal.
        let flat = Matrix::of_parts([0.0; 3], [0.0, 0.0, 0.0, 1.0], [2.0, 3.0, 0.0]);
        assert_eq!(unit(flat.normal([0.0, 0.0, 0.5])), [0.0, 0.0, 1.0]);
        assert!(!flat.mirrors());
    }

    #[test]
    fn directions_that_stay() {
        let scaled = Matrix::of_parts([1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0], [2.0; 3]);
        assert!(scaled.keeps_directions() && Matrix::IDENTITY.keeps_directions());
        let mirrored = Matrix::of_parts([0.0; 3], [0.0, 0.0, 0.0, 1.0], [-2.0; 3]);
        assert!(!mirrored.keeps_directions() && mirrored.mirrors());
        assert_eq!(unit([3e200, 0.0, 4e200]), [0.6, 0.0, 0.8]);
        assert_eq!(unit([0.0, -0.0, 0.0]), [0.0; 3]);
        let minus = Matrix::IDENTITY.point([-0.0; 3]);
        assert!(minus.iter().all(|x| x.is_sign_negative()));
    }
}
