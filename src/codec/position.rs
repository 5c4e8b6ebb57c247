//! Where a new vertex lies: predicted in the frame of the split edge, coded as what the cell differs by (spec §5.4).

use crate::entropy::{BitCoder, CodingError, NumberModel, SymbolModel};

/// A point or vector in cells.
pub type Vector = [f64; 3];

/// What is known round the edge a–b before it is split.
#[derive(Clone, Copy, Debug)]
pub struct Surroundings {
    /// The ends of the edge.
    pub ends: [Vector; 2],
    /// The vertex opposite in the triangle on its left.
    pub left: Vector,
    /// The vertex opposite in the triangle on its right, if there is one.
    pub right: Option<Vector>,
    /// Sum of the vertices beyond the other edges of the two triangles, and how many there are.
    pub wings: (Vector, f64),
}

/// What positions are coded under. Starts afresh with each segment.
#[derive(Clone, Debug)]
pub struct PositionModels {
    /// By axis of the frame, octave of the squared edge length, class of the feature that drives the axis.
    scales: Vec<[[Scale; FEATURES]; OCTAVES]>,
    /// Of the tangential and the normal prediction, by class of its feature.
    weights: [[Weight; FEATURES]; 2],
    /// By coordinate in the order of coding, octave of the variance, place between two cells.
    tokens: Vec<[[SymbolModel; PHASES]; VARIANCES]>,
    far: NumberModel,
}

impl Default for PositionModels {
    fn default() -> Self {
        Self {
            scales: [0.1, 0.1, 0.05].map(|mean| [[Scale { mean, count: 0 }; FEATURES]; OCTAVES]).to_vec(),
            weights: [Weight::new(0.5), Weight::new(0.25)].map(|weight| [weight; FEATURES]),
            tokens: vec![[[SymbolModel::BELL; PHASES]; VARIANCES]; 3],
            far: NumberModel::default(),
        }
    }
}

/// Classes of a feature beside the edge length.
const FEATURES: usize = 8;
/// Classes of squared edge lengths: 1 to 3 × 2^48.
const OCTAVES: usize = 51;
/// Classes of variances, from 2^-4 on.
const VARIANCES: usize = 56;
/// Classes of the place between two cells, where a cell is no finer than the deviation.
const PHASES: usize = 3;

/// A running mean of magnitudes over the edge length.
#[derive(Clone, Copy, Debug)]
struct Scale {
    mean: f64,
    count: u32,
}

impl Scale {
    #[inline]
    fn learn(&mut self, magnitude: f64) {
        self.mean += (magnitude - self.mean) / f64::from(self.count + 5);
        self.count += u32::from(self.count < 59);
    }
}

/// A linear regression through the origin, with something known beforehand.
#[derive(Clone, Copy, Debug)]
struct Weight {
    products: f64,
    squares: f64,
}

impl Weight {
    const fn new(slope: f64) -> Self {
        Self { products: 4.0 * slope, squares: 4.0 }
    }

    fn slope(&self) -> f64 {
        self.products / self.squares
    }

    /// Learns that `y` came of `x`, both over their deviation.
    fn learn(&mut self, x: f64, y: f64) {
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
    features: [f64; 3],
    classes: [usize; 3],
    octave: usize,
    length: f64,
}

impl PositionModels {
    /// Codes the cell of a vertex that splits an edge.
    ///
    /// # Errors
    /// [`CodingError::Number`] where a residual is out of range.
    pub fn split<C: BitCoder>(
        &mut self,
        coder: &mut C,
        at: &Surroundings,
        known: &dyn Fn(usize) -> i32,
    ) -> Result<[i32; 3], CodingError> {
        let Some(p) = Prediction::new(at) else {
            let middle = scaled(sum(at.ends[0], at.ends[1]), 0.5);
            return self.code(coder, middle, [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], known);
        };
        let mut deviations = [0.0; 3];
        for axis in 0..3 {
            deviations[axis] = self.scales[axis][p.octave][p.classes[axis]].mean;
        }
        let slopes = [0.0, self.weights[0][p.classes[1]].slope(), self.weights[1][p.classes[2]].slope()];
        let mut expected = p.middle;
        let mut axes = p.axes;
        for axis in 0..3 {
            let shift = slopes[axis] * p.features[axis] * p.length;
            let deviation = (1.25 * deviations[axis] * p.length).max(0.25);
            for i in 0..3 {
                expected[i] += shift * p.axes[axis][i];
                axes[axis][i] *= deviation;
            }
        }
        let cell = self.code(coder, expected, axes, known)?;
        let offset: Vector = std::array::from_fn(|i| f64::from(cell[i]) - p.middle[i]);
        for axis in 0..3 {
            let x = p.features[axis];
            let y = dot(offset, p.axes[axis]) / p.length;
            self.scales[axis][p.octave][p.classes[axis]].learn((y - slopes[axis] * x).abs());
            if axis > 0 {
                let deviation = deviations[axis].max(1e-3);
                self.weights[axis - 1][p.classes[axis]].learn(x / deviation, y / deviation);
            }
        }
        Ok(cell)
    }

    /// Codes the cell of a vertex that may lie anywhere within `size` of `middle`.
    ///
    /// # Errors
    /// [`CodingError::Number`] where a residual is out of range.
    pub fn near<C: BitCoder>(
        &mut self,
        coder: &mut C,
        middle: Vector,
        size: f64,
        known: &dyn Fn(usize) -> i32,
    ) -> Result<[i32; 3], CodingError> {
        let size = (0.2 * size).max(0.25);
        self.code(coder, middle, [[size, 0.0, 0.0], [0.0, size, 0.0], [0.0, 0.0, size]], known)
    }

    /// Codes a cell that is normally distributed round `expected` with the covariance that `axes` span: coordinate by coordinate,
    /// the one that is least normal to the surface first, each given those before.
    fn code<C: BitCoder>(
        &mut self,
        coder: &mut C,
        expected: Vector,
        axes: [Vector; 3],
        known: &dyn Fn(usize) -> i32,
    ) -> Result<[i32; 3], CodingError> {
        let covariance = |i: usize, j: usize| {
            axes[0][i] * axes[0][j] + axes[1][i] * axes[1][j] + axes[2][i] * axes[2][j]
        };
        let [i, j, k] = order(axes[2]);
        let mut cell = [0; 3];
        let (ii, ij, ik) = (covariance(i, i), covariance(i, j), covariance(i, k));
        let (a, b) = (ij / ii, ik / ii);
        let jj = covariance(j, j) - a * ij;
        let jk = covariance(j, k) - b * ij;
        let c = if jj > LEAST { jk / jj } else { 0.0 };
        let kk = covariance(k, k) - b * ik - c * jk;
        let (first, x) = self.coordinate(coder, 0, expected[i], ii, || known(i))?;
        let (second, y) = self.coordinate(coder, 1, expected[j] + a * x, jj, || known(j))?;
        let (third, _) = self.coordinate(coder, 2, expected[k] + b * x + c * y, kk, || known(k))?;
        cell[i] = first;
        cell[j] = second;
        cell[k] = third;
        Ok(cell)
    }

    /// Codes a coordinate, and returns how far from `expected` it is as well.
    #[inline]
    fn coordinate<C: BitCoder>(
        &mut self,
        coder: &mut C,
        place: usize,
        expected: f64,
        variance: f64,
        known: impl Fn() -> i32,
    ) -> Result<(i32, f64), CodingError> {
        let octave = exponent(variance.max(LEAST)) + 4;
        let shift = ((octave - 6).clamp(0, 32) / 2) as u32;
        let origin = (expected + 0.5).floor();
        let phase = if shift > 0 {
            0
        } else {
            let fraction = expected - origin;
            usize::from(fraction >= -1.0 / 6.0) + usize::from(fraction >= 1.0 / 6.0)
        };
        let origin = origin.clamp(-FARTHEST, FARTHEST) as i32;
        let model = &mut self.tokens[place][(octave as usize).min(VARIANCES - 1)][phase];
        let residual = || known() - origin;
        let token = coder.symbol(model, || ((residual() >> shift) + 8).clamp(0, 15) as usize);
        let mut high = token as i32 - 8;
        if token == 0 || token == 15 {
            let beyond = self.far.unsigned(coder, || ((residual() >> shift) - high).unsigned_abs())?;
            let beyond = i32::try_from(beyond).ok().filter(|&n| n < 1 << 26).ok_or(CodingError::Number)?;
            high = if token == 0 { high - beyond } else { high + beyond };
        }
        let mut low = 0;
        if shift > 0 {
            low = coder.bits(shift, || (residual() & ((1 << shift) - 1)) as u32) as i32;
        }
        let value = i64::from(origin) + (i64::from(high) << shift) + i64::from(low);
        let value = i32::try_from(value).map_err(|_| CodingError::Number)?;
        Ok((value, f64::from(value) - expected))
    }
}

/// The smallest variance told apart.
const LEAST: f64 = 0.0625;
/// Expected coordinates are cut off here, far outside any lattice.
const FARTHEST: f64 = (1 << 26) as f64;

impl Prediction {
    /// `None` where the edge or its triangles have no extent.
    fn new(at: &Surroundings) -> Option<Self> {
        let [a, b] = at.ends;
        let middle = scaled(sum(a, b), 0.5);
        let edge = difference(b, a);
        let squared = dot(edge, edge);
        let across = difference(at.left, at.right.unwrap_or(middle));
        let normal = cross(edge, across);
        let area = dot(normal, normal);
        if squared == 0.0 || area == 0.0 {
            return None;
        }
        let length = squared.sqrt();
        let normal = scaled(normal, 1.0 / area.sqrt());
        let along = scaled(edge, 1.0 / length);
        let tangent = cross(normal, along);
        let (mut features, mut asymmetry) = ([0.0; 3], 0.0);
        if let Some(right) = at.right {
            let tips = difference(scaled(sum(at.left, right), 0.5), middle);
            features[1] = dot(tips, tangent) / length;
            asymmetry = dot(tips, along) / length;
            let (wings, count) = at.wings;
            if count > 0.0 {
                let wings = difference(scaled(wings, 1.0 / count), middle);
                features[2] = dot(difference(tips, wings), normal) / length;
            }
        }
        let across = asymmetry.abs() + features[1].abs();
        let classes = [across, features[1], features[2]].map(feature_class);
        let octave = (exponent(squared) as usize).min(OCTAVES - 1);
        Some(Self { middle, axes: [along, tangent, normal], features, classes, octave, length })
    }
}

/// Octaves of |x| from 2^-6 to 2^1.
#[inline]
fn feature_class(x: f64) -> usize {
    (exponent(x).clamp(-7, 0) + 7) as usize
}

/// The power of two at or below |x|; -1023 where that is tiny.
#[inline]
fn exponent(x: f64) -> i32 {
    (x.to_bits() >> 52 & 0x7FF) as i32 - 1023
}

/// The axes, the one along which |v| is smallest first; the lower one first among equals.
#[inline]
fn order(v: Vector) -> [usize; 3] {
    let v = v.map(f64::abs);
    let mut order = [0, 1, 2];
    if v[order[1]] < v[order[0]] {
        order.swap(0, 1);
    }
    if v[order[2]] < v[order[1]] {
        order.swap(1, 2);
        if v[order[1]] < v[order[0]] {
            order.swap(0, 1);
        }
    }
    order
}

#[inline]
fn sum(a: Vector, b: Vector) -> Vector {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

#[inline]
fn difference(a: Vector, b: Vector) -> Vector {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline]
fn scaled(a: Vector, s: f64) -> Vector {
    [a[0] * s, a[1] * s, a[2] * s]
}

#[inline]
fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline]
fn cross(a: Vector, b: Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
