//! Where a new vertex lies: predicted in the frame of the split edge, coded as what the cell differs by (spec §5.4).

use super::vector::{Vector, exponent, floor};
use crate::entropy::{BitCoder, CodingError, NumberModel, SymbolModel};

/// What is known round the edge a–b before it is split. All but the start are vectors from there.
#[derive(Clone, Copy, Debug)]
pub struct Surroundings {
    /// The cell of a.
    pub start: [i32; 3],
    /// To b.
    pub edge: Vector,
    /// To the vertex opposite in the triangle on its left.
    pub left: Vector,
    /// To the vertex opposite in the triangle on its right, if there is one.
    pub right: Option<Vector>,
    /// Sum of those to the vertices beyond the other edges of the two triangles, and how many there are.
    pub wings: (Vector, f32),
}

/// What positions are coded under. Starts afresh with each segment.
#[derive(Clone, Debug)]
pub struct PositionModels {
    /// By axis of the frame, octave of the squared edge length, class of the feature that drives the axis.
    scales: Box<[[[Scale; FEATURES]; OCTAVES]; 3]>,
    /// Of the tangential and the normal prediction, by class of its feature.
    weights: [[Weight; FEATURES]; 2],
    /// By coordinate in the order of coding, octave of the variance, place between two cells.
    tokens: Box<[[[SymbolModel; PHASES]; VARIANCES]; 3]>,
    far: NumberModel,
}

impl Default for PositionModels {
    fn default() -> Self {
        Self {
            scales: Box::new([0.1, 0.1, 0.05].map(|mean| [[Scale { mean, count: 0 }; FEATURES]; OCTAVES])),
            weights: [Weight::new(0.5), Weight::new(0.25)].map(|weight| [weight; FEATURES]),
            tokens: Box::new([TOKENS; 3]),
            far: NumberModel::default(),
        }
    }
}

/// Classes of a feature beside the edge length.
const FEATURES: usize = 8;
/// Classes of squared edge lengths, from 1 to 3 × 2^48.
const OCTAVES: usize = 51;
/// Classes of variances, from 2^-4 on.
const VARIANCES: usize = 56;
/// Classes of the place between two cells, where a cell is no finer than the deviation.
const PHASES: usize = 3;

/// Tokens before anything is learnt of them: a bell of the width that the octave tells, round the place between two cells.
const TOKENS: [[SymbolModel; PHASES]; VARIANCES] = {
    let mut tokens = [[SymbolModel::bell(1, 0); PHASES]; VARIANCES];
    let mut place = 0;
    while place < VARIANCES * PHASES {
        let (octave, phase) = (place / PHASES, place % PHASES);
        let shift = if octave < 8 { 0 } else { octave / 2 - 3 };
        // The variance in the middle of the octave, and that of rounding, in units of a token's twelfth, squared.
        let variance = ((203 << (octave - 2 * shift)) >> 4) + 12;
        // Of a token of several cells the middle lies behind its first one.
        let offset = if shift > 0 { 5 } else { 4 - 4 * phase as i32 };
        tokens[octave][phase] = SymbolModel::bell(variance, offset);
        place += 1;
    }
    tokens
};

/// A running mean of magnitudes over the edge length.
#[derive(Clone, Copy, Debug)]
struct Scale {
    mean: f32,
    count: u32,
}

impl Scale {
    #[inline]
    fn learn(&mut self, magnitude: f32) {
        self.mean += (magnitude - self.mean) / (self.count + 5) as f32;
        self.count += u32::from(self.count < 59);
    }
}

/// A linear regression through the origin, with something known beforehand.
#[derive(Clone, Copy, Debug)]
struct Weight {
    products: f32,
    squares: f32,
}

impl Weight {
    const fn new(slope: f32) -> Self {
        Self { products: 4.0 * slope, squares: 4.0 }
    }

    fn slope(&self) -> f32 {
        (self.products / self.squares).clamp(-2.0, 2.0)
    }

    /// Learns that `y` came of `x`, both over their deviation.
    fn learn(&mut self, x: f32, y: f32) {
        self.products += x * y;
        self.squares += x * x;
        if self.squares > 400.0 {
            self.products *= 0.5;
            self.squares *= 0.5;
        }
    }
}

/// A prediction: where the vertex is expected, along which axes it errs, and how far.
#[derive(Clone, Copy, Debug)]
struct Prediction {
    middle: Vector,
    /// Along the edge, across it, normal to it; of length 1.
    axes: [Vector; 3],
    /// What is expected along each axis, over the edge length, and the feature it is a multiple of.
    features: [f32; 2],
    classes: [usize; 3],
    octave: usize,
    length: f32,
}

impl PositionModels {
    /// Codes the cell of a vertex that splits an edge.
    ///
    /// # Errors
    /// [`CodingError::Number`] where a residual is out of range.
    #[inline]
    pub fn split<C: BitCoder>(
        &mut self,
        coder: &mut C,
        at: &Surroundings,
        known: [i32; 3],
    ) -> Result<[i32; 3], CodingError> {
        let Some(p) = Prediction::new(at) else {
            return self.near(coder, at.start, at.edge * 0.5, 1.0, known);
        };
        let scales = |axis: usize| self.scales[axis][p.octave][p.classes[axis]].mean;
        let deviations = [scales(0), scales(1), scales(2)];
        let slopes = [self.weights[0][p.classes[1]].slope(), self.weights[1][p.classes[2]].slope()];
        let shifts = [slopes[0] * p.features[0], slopes[1] * p.features[1]];
        let expected = (p.middle + p.axes[1] * (shifts[0] * p.length)) + p.axes[2] * (shifts[1] * p.length);
        let size = 1.25 * p.length;
        let axis = |i: usize| p.axes[i] * (deviations[i] * size).max(0.25);
        let cell = self.code(coder, at.start, expected, [axis(0), axis(1), axis(2)], known)?;
        let offset = offset(cell, at.start) - p.middle;
        let over = 1.0 / p.length;
        let errs = [offset.dot(p.axes[0]) * over, offset.dot(p.axes[1]) * over, offset.dot(p.axes[2]) * over];
        self.scales[0][p.octave][p.classes[0]].learn(errs[0].abs());
        for axis in 0..2 {
            let (octave, class) = (p.octave, p.classes[axis + 1]);
            self.scales[axis + 1][octave][class].learn((errs[axis + 1] - shifts[axis]).abs());
            let over = 1.0 / deviations[axis + 1].max(1e-3);
            self.weights[axis][class].learn(p.features[axis] * over, errs[axis + 1] * over);
        }
        Ok(cell)
    }

    /// Codes the cell of a vertex that may lie anywhere within `size` of what is `expected` from `start`.
    ///
    /// # Errors
    /// [`CodingError::Number`] where a residual is out of range.
    pub fn near<C: BitCoder>(
        &mut self,
        coder: &mut C,
        start: [i32; 3],
        expected: Vector,
        size: f32,
        known: [i32; 3],
    ) -> Result<[i32; 3], CodingError> {
        let s = (0.2 * size).max(0.25);
        let axes = [Vector::new(s, 0.0, 0.0), Vector::new(0.0, s, 0.0), Vector::new(0.0, 0.0, s)];
        self.code(coder, start, expected, axes, known)
    }

    /// Codes a cell that is normally distributed round `start + expected` with the covariance that `axes` span: coordinate by
    /// coordinate, the one that is least normal to the surface first, each given those before.
    #[inline]
    fn code<C: BitCoder>(
        &mut self,
        coder: &mut C,
        start: [i32; 3],
        expected: Vector,
        axes: [Vector; 3],
        known: [i32; 3],
    ) -> Result<[i32; 3], CodingError> {
        let [i, j, k] = order(axes[2]);
        let [e, t, n] = axes.map(|axis| {
            let axis = axis.coordinates();
            [axis[i], axis[j], axis[k]]
        });
        let covariance = |x: usize, y: usize| (e[x] * e[y] + t[x] * t[y]) + n[x] * n[y];
        let (ii, ij, ik) = (covariance(0, 0), covariance(0, 1), covariance(0, 2));
        let over = 1.0 / ii;
        let (a, b) = (ij * over, ik * over);
        let jj = covariance(1, 1) - a * ij;
        let jk = covariance(1, 2) - b * ij;
        let c = if jj > LEAST { jk / jj } else { 0.0 };
        let kk = (covariance(2, 2) - b * ik) - c * jk;
        let (mut cell, expected) = (start, expected.coordinates());
        let x = self.coordinate(coder, 0, expected[i], ii, known[i], &mut cell[i])?;
        let y = self.coordinate(coder, 1, expected[j] + a * x, jj, known[j], &mut cell[j])?;
        self.coordinate(coder, 2, (expected[k] + b * x) + c * y, kk, known[k], &mut cell[k])?;
        Ok(cell)
    }

    /// Codes a coordinate, that of the start given. Returns how far from `expected` it is.
    #[inline]
    fn coordinate<C: BitCoder>(
        &mut self,
        coder: &mut C,
        place: usize,
        expected: f32,
        variance: f32,
        known: i32,
        coordinate: &mut i32,
    ) -> Result<f32, CodingError> {
        let octave = exponent(variance.max(LEAST)) + 4;
        let shift = ((octave - 6).clamp(0, 32) / 2) as u32;
        let origin = floor(within(expected, FARTHEST) + 0.5);
        let mut phase = 0;
        if shift == 0 {
            let fraction = expected - origin as f32;
            phase = usize::from(fraction >= -1.0 / 6.0) + usize::from(fraction >= 1.0 / 6.0);
        }
        let model = &mut self.tokens[place][(octave as usize).min(VARIANCES - 1)][phase];
        let residual = known.wrapping_sub(*coordinate).wrapping_sub(origin);
        let token = coder.symbol(model, || ((residual >> shift) + 8).clamp(0, 15) as usize);
        let mut high = token as i32 - 8;
        if token == 0 || token == 15 {
            let beyond = self.far.unsigned(coder, || ((residual >> shift) - high).unsigned_abs())?;
            let beyond = i32::try_from(beyond).ok().filter(|&n| n < 1 << 28).ok_or(CodingError::Number)?;
            high = if token == 0 { high - beyond } else { high + beyond };
        }
        let mut low = 0;
        if shift > 0 {
            low = coder.bits(shift, || (residual & ((1 << shift) - 1)) as u32);
        }
        let found = i64::from(origin) + (i64::from(high) << shift) + i64::from(low);
        if found.abs() > 1 << 28 {
            return Err(CodingError::Number);
        }
        *coordinate += found as i32;
        Ok(found as f32 - expected)
    }
}

/// The smallest variance told apart.
const LEAST: f32 = 0.0625;
/// Expected offsets are cut off here, far outside any lattice.
const FARTHEST: f32 = (1 << 26) as f32;

impl Prediction {
    /// `None` where the edge or its triangles have no extent.
    #[inline]
    fn new(at: &Surroundings) -> Option<Self> {
        let middle = at.edge * 0.5;
        let squared = at.edge.dot(at.edge);
        let across = at.left - at.right.unwrap_or(middle);
        let normal = at.edge.cross(across);
        let area = normal.dot(normal);
        if squared == 0.0 || area == 0.0 {
            return None;
        }
        let length = squared.sqrt();
        let over = 1.0 / length;
        let normal = normal * (1.0 / area.sqrt());
        let along = at.edge * over;
        let tangent = normal.cross(along);
        let (mut features, mut asymmetry) = ([0.0; 2], 0.0);
        if let Some(right) = at.right {
            let tips = (at.left + right) * 0.5 - middle;
            features[0] = tips.dot(tangent) * over;
            asymmetry = tips.dot(along) * over;
            let (wings, count) = at.wings;
            if count > 0.0 {
                let wings = wings * (1.0 / count) - middle;
                features[1] = (tips - wings).dot(normal) * over;
            }
        }
        let across = asymmetry.abs() + features[0].abs();
        let classes = [feature_class(across), feature_class(features[0]), feature_class(features[1])];
        let octave = (exponent(squared).max(0) as usize).min(OCTAVES - 1);
        Some(Self { middle, axes: [along, tangent, normal], features, classes, octave, length })
    }
}

/// x, or the bound that is nearest to it; `-bound` where x is not a number.
#[inline]
fn within(x: f32, bound: f32) -> f32 {
    let above = if x > -bound { x } else { -bound };
    if above < bound { above } else { bound }
}

/// From one cell to another.
#[inline]
fn offset(cell: [i32; 3], start: [i32; 3]) -> Vector {
    let d = |i: usize| cell[i].wrapping_sub(start[i]);
    Vector::of_cell([d(0), d(1), d(2)])
}

/// Octaves of |x| from 2^-6 to 2^1.
#[inline]
fn feature_class(x: f32) -> usize {
    (exponent(x).clamp(-7, 0) + 7) as usize
}

/// The axes, the one along which |v| is smallest first; the lower one first among equals.
#[inline]
fn order(v: Vector) -> [usize; 3] {
    let [x, y, z] = v.coordinates().map(f32::abs);
    // A table, since branches would be taken at random.
    let sorted = ORDERS[usize::from(x <= y) | usize::from(x <= z) << 1 | usize::from(y <= z) << 2];
    sorted.map(|axis| usize::from(axis) % 3)
}

/// By x <= y, x <= z, y <= z, from the lowest bit on; two of the cases cannot be.
const ORDERS: [[u8; 3]; 8] =
    [[2, 1, 0], [2, 0, 1], [2, 1, 0], [0, 2, 1], [1, 2, 0], [0, 1, 2], [1, 0, 2], [0, 1, 2]];

#[cfg(all(test, feature = "encode"))]
mod tests {
    use super::*;
    use crate::entropy::{RangeDecoder, RangeEncoder};
    use proptest::prelude::*;

    fn surroundings(cells: [[i32; 3]; 4], open: bool, wings: [i32; 3], count: u8) -> Surroundings {
        let [a, b, c, d] = cells;
        Surroundings {
            start: a,
            edge: offset(b, a),
            left: offset(c, a),
            right: (!open).then(|| offset(d, a)),
            wings: (offset(wings, [0; 3]) * f32::from(count), f32::from(count)),
        }
    }

    fn cell() -> impl Strategy<Value = [i32; 3]> {
        prop_oneof![prop::array::uniform3(0..1 << 24), prop::array::uniform3(0..40), Just([3; 3])]
    }

    proptest! {
        #[test]
        fn cells_come_back_from_wherever(
            all in prop::collection::vec((prop::array::uniform4(cell()), any::<bool>(), cell(), 0..5u8, cell()), 1..60),
        ) {
            let mut encoder = RangeEncoder::default();
            let mut models = PositionModels::default();
            for &(cells, open, wings, count, known) in &all {
                let at = surroundings(cells, open, wings, count);
                prop_assert_eq!(models.split(&mut encoder, &at, known).unwrap(), known);
            }
            let bytes = encoder.finish();
            let mut decoder = RangeDecoder::new(&bytes);
            let mut models = PositionModels::default();
            for &(cells, open, wings, count, known) in &all {
                let at = surroundings(cells, open, wings, count);
                prop_assert_eq!(models.split(&mut decoder, &at, [0; 3]).unwrap(), known);
            }
            decoder.finish().unwrap();
        }

        #[test]
        fn any_bytes_are_a_position_or_an_error(bytes in prop::collection::vec(any::<u8>(), 0..200), cells in prop::array::uniform4(cell())) {
            let mut decoder = RangeDecoder::new(&bytes);
            let mut models = PositionModels::default();
            let at = surroundings(cells, false, [9; 3], 3);
            for _ in 0..40 {
                if models.split(&mut decoder, &at, [0; 3]).is_err() {
                    break;
                }
            }
        }
    }

    /// Vertices in the middle of flat, regular surroundings are what is expected: after a while they cost little.
    #[test]
    fn the_expected_is_cheap() {
        let cells = [[0, 0, 50], [64, 0, 50], [32, 55, 50], [32, -55, 50]];
        let at = surroundings(cells, false, [32, 0, 50], 4);
        let mut encoder = RangeEncoder::default();
        let mut models = PositionModels::default();
        for _ in 0..2000 {
            models.split(&mut encoder, &at, [32, 0, 50]).unwrap();
        }
        assert!(encoder.bits() < 3.0 * 2000.0, "{}", encoder.bits());
    }

    #[test]
    fn the_axes_are_sorted_by_magnitude() {
        for (v, sorted) in [
            ([1.0, 2.0, 3.0], [0, 1, 2]),
            ([-3.0, 2.0, 1.0], [2, 1, 0]),
            ([2.0, 3.0, -1.0], [2, 0, 1]),
            ([3.0, -1.0, 2.0], [1, 2, 0]),
            ([2.0, 1.0, 3.0], [1, 0, 2]),
            ([1.0, 3.0, 2.0], [0, 2, 1]),
            ([1.0; 3], [0, 1, 2]),
        ] {
            assert_eq!(order(Vector::new(v[0], v[1], v[2])), sorted);
        }
    }
}
