//! Attributes as quadrics: how far values are off the linear functions that triangles make of them.
//!
//! Garland and Heckbert (1998) and Hoppe (1999): on each triangle an attribute is linear; a vertex at `p` with the values `a` costs, for
//! each triangle round it, area times the squared difference between `a` and the triangle's function, extended to `p`. For each `p` the
//! best values are a mean, and what they leave is a quadric of `p` alone.

use super::quadric::{Quadric, Weights};
use glam::DVec3;

/// The triangles round a wedge: linear functions of several numbers, weighted.
#[derive(Clone, Debug, Default)]
pub(super) struct Fit {
    /// The weighted sum of the squares of all functions.
    squares: Quadric,
    weight: f64,
    /// For each number the weighted sum of the functions: slope, and value at the origin.
    functions: Vec<(DVec3, f64)>,
}

/// A triangle: sides from the wedge's corner to the other two, their cross product, where the wedge's corner is, and the corners' numbers.
#[derive(Clone, Copy, Debug)]
pub(super) struct Face<'a> {
    pub(super) at: DVec3,
    pub(super) sides: [DVec3; 2],
    pub(super) cross: DVec3,
    pub(super) rows: [&'a [f64]; 3],
}

impl Fit {
    /// No triangle, of so many numbers.
    pub(super) fn clear(&mut self, width: usize) {
        self.squares = Quadric::default();
        self.weight = 0.0;
        self.functions.clear();
        self.functions.resize(width, (DVec3::ZERO, 0.0));
    }

    /// Adds a triangle. One that has next to no area has the numbers of its corner everywhere.
    pub(super) fn add(&mut self, face: &Face, weights: Weights) {
        let square = face.cross.length_squared();
        if square == 0.0 {
            return;
        }
        let weight = if weights == Weights::Area { 0.5 * square.sqrt() } else { 1.0 };
        let [first, second] = face.sides;
        let is_thin = square <= THIN * first.length_squared() * second.length_squared();
        // The slope is the change along the first side times this, plus that along the second times that.
        let [to_first, to_second] = match is_thin {
            true => [DVec3::ZERO; 2],
            false => [second.cross(face.cross), face.cross.cross(first)].map(|v| v / square),
        };
        let [row, row_a, row_b] = face.rows;
        let mut sum = Quadric::default();
        for (k, (slope_sum, value_sum)) in self.functions.iter_mut().enumerate() {
            let x = row[k];
            if x.is_nan() {
                continue;
            }
            let [a, b] = [row_a[k] - x, row_b[k] - x].map(|d| if d.is_nan() { 0.0 } else { d });
            let slope = to_first * a + to_second * b;
            let value = x - slope.dot(face.at);
            sum.add_square(slope, value, weight);
            *slope_sum += slope * weight;
            *value_sum += value * weight;
        }
        self.squares += sum;
        self.weight += weight;
    }

    /// Adds all of another one's triangles.
    pub(super) fn add_all(&mut self, other: &Self) {
        self.squares += other.squares;
        self.weight += other.weight;
        for (sum, more) in self.functions.iter_mut().zip(&other.functions) {
            sum.0 += more.0;
            sum.1 += more.1;
        }
    }
}

/// What the best values for all of these cost together, as a quadric.
pub(super) fn least(fits: &[&Fit]) -> Quadric {
    let mut sum = Quadric::default();
    fits.iter().for_each(|fit| sum += fit.squares);
    let weight = weight(fits);
    if weight > 0.0 {
        for (slope, value) in functions(fits) {
            sum.add_square(slope, value, -weight.recip());
        }
    }
    sum
}

/// What these values cost at a place.
pub(super) fn price(fits: &[&Fit], p: DVec3, row: &[f64]) -> f64 {
    let weight = weight(fits);
    if weight == 0.0 {
        return 0.0;
    }
    let off = values(fits, p).zip(row).map(|(value, x)| value - x).filter(|d| !d.is_nan());
    least(fits).at(p) + weight * off.map(|d| d * d).sum::<f64>()
}

/// The best values at a place; NaN where there is no triangle.
pub(super) fn values(fits: &[&Fit], p: DVec3) -> impl Iterator<Item = f64> {
    let weight = weight(fits);
    functions(fits).map(move |(slope, value)| (slope.dot(p) + value) / weight)
}

fn weight(fits: &[&Fit]) -> f64 {
    fits.iter().map(|fit| fit.weight).sum()
}

fn functions(fits: &[&Fit]) -> impl Iterator<Item = (DVec3, f64)> {
    let width = fits.first().map_or(0, |fit| fit.functions.len());
    (0..width).map(|k| {
        let each = fits.iter().map(|fit| fit.functions[k]);
        each.fold((DVec3::ZERO, 0.0), |sum, (slope, value)| (sum.0 + slope, sum.1 + value))
    })
}

/// The squared sine of a triangle's angle at which it is too thin to tell how values change across it.
const THIN: f64 = 1e-6;

#[cfg(test)]
mod tests {
    use super::*;

    /// Two triangles round the origin in two planes, a number each way.
    fn fit(rows: &[[f64; 3]; 4]) -> (Fit, Vec<[DVec3; 3]>) {
        let at = DVec3::new(1.0, 2.0, 3.0);
        let ends = [at + DVec3::X * 2.0, at + DVec3::Y, at + DVec3::new(-1.0, 0.0, 1.0)];
        let mut fit = Fit::default();
        fit.clear(3);
        let mut faces = Vec::new();
        for k in 0..2 {
            let [a, b] = [ends[k], ends[k + 1]];
            let sides = [a - at, b - at];
            let rows = [&rows[0][..], &rows[k + 1][..], &rows[k + 2][..]];
            fit.add(&Face { at, sides, cross: sides[0].cross(sides[1]), rows }, Weights::Area);
            faces.push([at, a, b]);
        }
        (fit, faces)
    }

    #[test]
    fn what_is_linear_everywhere_costs_nothing_and_is_found() {
        let linear = |p: DVec3| [p.x + 2.0 * p.y - p.z, 7.0, 0.5 * p.z];
        let at = DVec3::new(1.0, 2.0, 3.0);
        let ends = [at, at + DVec3::X * 2.0, at + DVec3::Y, at + DVec3::new(-1.0, 0.0, 1.0)];
        let (fit, _) = fit(&ends.map(linear));
        // In the planes of both, which meet in this line.
        let p = at + DVec3::Y * 5.0;
        assert!(least(&[&fit]).at(p) < 1e-12);
        let values: Vec<f64> = values(&[&fit], p).collect();
        let expected = linear(p);
        assert!(values.iter().zip(expected).all(|(x, y)| (x - y).abs() < 1e-12), "{values:?}");
        let off = [expected[0] + 0.1, expected[1], expected[2]];
        let area = 0.5 * (2.0 + 2f64.sqrt());
        assert!((price(&[&fit], p, &off) - 0.01 * area).abs() < 1e-12);
    }

    /// By the definition: area times the squared difference from each triangle's function, and the best value is the one that costs least.
    #[test]
    fn the_price_is_area_times_squared_difference() {
        let rows = [[0.3, 1.0, 0.0], [0.1, -1.0, 2.0], [0.9, 0.5, 0.0], [0.0, 0.2, 0.4]];
        let (fit, faces) = fit(&rows);
        let p = DVec3::new(1.5, 2.2, 3.1);
        let expected = |values: &[f64]| {
            let mut sum = 0.0;
            for (k, [at, a, b]) in faces.iter().enumerate() {
                let (u, v) = (*a - *at, *b - *at);
                let n = u.cross(v);
                // Shares of the foot of p in the plane.
                let d = p - *at;
                let [s, t] = [d.cross(v).dot(n), u.cross(d).dot(n)].map(|x| x / n.length_squared());
                for j in 0..3 {
                    let value = rows[0][j] * (1.0 - s - t) + rows[k + 1][j] * s + rows[k + 2][j] * t;
                    sum += 0.5 * n.length() * (values[j] - value).powi(2);
                }
            }
            sum
        };
        let best: Vec<f64> = values(&[&fit], p).collect();
        assert!((least(&[&fit]).at(p) - expected(&best)).abs() < 1e-12);
        for other in [[0.0; 3], [1.0, 0.2, -3.0]] {
            assert!((price(&[&fit], p, &other) - expected(&other)).abs() < 1e-10);
            assert!(expected(&best) <= expected(&other));
        }
    }
}
