//! Chapters 5.4.1 to 5.4.3: where a new vertex is expected.

use super::container::Result;
use super::coordinates::{Reader, locate};
use super::trace::{Placed, Step};
use super::vector::{Vector, clamp, cross, dot, exponent, larger};
use super::walk::{Edge, Mesh};

type Cell = [i64; 3];

/// A mean model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mean {
    pub mean: f32,
    count: u32,
}

/// A slope model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slope {
    pub products: f32,
    pub squares: f32,
}

/// The models that learn from positions of splits.
pub struct Models {
    /// By axis, octave and class.
    mean: [[[Mean; 8]; 50]; 3],
    /// By axis and class.
    slope: [[Slope; 8]; 2],
}

impl Models {
    pub fn fresh() -> Self {
        let mean = |mean| [[Mean { mean, count: 0 }; 8]; 50];
        let slope = |products| [Slope { products, squares: 4.0 }; 8];
        Self { mean: [mean(0.1), mean(0.1), mean(0.05)], slope: [slope(2.0), slope(1.0)] }
    }
}

impl Mean {
    fn learn(&mut self, x: f32) {
        self.mean += (x - self.mean) / (self.count as f32 + 5.0);
        self.count = (self.count + 1).min(59);
    }
}

impl Slope {
    pub fn slope(&self) -> f32 {
        clamp(self.products / self.squares, -2.0, 2.0)
    }

    fn learn(&mut self, x: f32, y: f32) {
        self.products += x * y;
        self.squares += x * x;
        if self.squares > 400.0 {
            self.products *= 0.5;
            self.squares *= 0.5;
        }
    }
}

/// What is known of a split before its vertex is read.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    middle: Vector,
    over: f32,
    pub length: f32,
    pub along: Vector,
    pub across: Vector,
    pub normal: Vector,
    /// F.
    pub features: [f32; 2],
    pub octave: usize,
    /// K.
    pub classes: [usize; 3],
}

impl Frame {
    /// Of the edge named by k, or `middle` alone where there are no axes.
    pub fn of(mesh: &Mesh, k: Edge, cell: impl Fn(usize) -> Cell) -> std::result::Result<Self, Vector> {
        let start = cell(k.0);
        let from_start = |v: usize| Vector::between(start, cell(v));
        let o = mesh.opposite(k);
        let (edge, left) = (from_start(k.1), from_start(mesh.tip(k)));
        let right = o.map(|o| from_start(mesh.tip(o)));
        let middle = edge * 0.5;
        let mut wings = Vector([0.0; 3]);
        let mut n = 0.0f32;
        for e in [Some(k), o].into_iter().flatten() {
            for c in [mesh.next(e), mesh.prev(e)] {
                if let Some(beyond) = mesh.opposite(c) {
                    wings = wings + from_start(mesh.tip(beyond));
                    n += 1.0;
                }
            }
        }

        let squared = dot(edge, edge);
        let perpendicular = cross(edge, left - right.unwrap_or(middle));
        let area = dot(perpendicular, perpendicular);
        if squared == 0.0 || area == 0.0 {
            return Err(middle);
        }
        let length = squared.sqrt();
        let over = 1.0 / length;
        let normal = perpendicular * (1.0 / area.sqrt());
        let along = edge * over;
        let across = cross(normal, along);

        let (mut features, mut skew) = ([0.0, 0.0], 0.0f32);
        if let Some(right) = right {
            let tips = (left + right) * 0.5 - middle;
            features[0] = dot(tips, across) * over;
            skew = dot(tips, along) * over;
            if n > 0.0 {
                features[1] = dot(tips - (wings * (1.0 / n) - middle), normal) * over;
            }
        }
        let classes = [feature(skew.abs() + features[0].abs()), feature(features[0]), feature(features[1])];
        let octave = exponent(squared) as usize;
        Ok(Self { middle, over, length, along, across, normal, features, octave, classes })
    }

    /// `expected` and A, for these deviations D and shifts S.
    fn expectation(&self, d: [f32; 3], s: [f32; 2]) -> (Vector, [Vector; 3]) {
        let expected =
            (self.middle + self.across * (s[0] * self.length)) + self.normal * (s[1] * self.length);
        let size = 1.25 * self.length;
        let axes = [self.along, self.across, self.normal];
        (expected, [0, 1, 2].map(|i| axes[i] * larger(d[i] * size, 0.25)))
    }

    /// E of a vertex that was found so far from the start.
    fn errors(&self, found: Vector) -> [f32; 3] {
        let offset = found - self.middle;
        [self.along, self.across, self.normal].map(|axis| dot(offset, axis) * self.over)
    }
}

/// split_position(k), with start = P(a).
pub fn split(
    start: Cell,
    frame: std::result::Result<Frame, Vector>,
    models: &mut Models,
    reader: &mut Reader,
) -> Result<Cell> {
    let frame = match frame {
        Ok(frame) => frame,
        Err(middle) => return near(start, middle, 1.0, reader),
    };
    let (d, s) = models.say(&frame);
    let (expected, axes) = frame.expectation(d, s);
    let cell = locate(start, expected, axes, reader)?;
    let errors = frame.errors(Vector::between(start, cell));
    models.learn(&frame, errors, d, s);
    let (means, slopes) = models.of(&frame);
    let placed = Placed { frame, deviations: d, shifts: s, expected, errors, means, slopes };
    reader.trace.push(Step::Placed(Box::new(placed)));
    Ok(cell)
}

/// near(start, expected, size).
pub fn near(start: Cell, expected: Vector, size: f32, reader: &mut Reader) -> Result<Cell> {
    let d = larger(0.2 * size, 0.25);
    locate(start, expected, [Vector([d, 0.0, 0.0]), Vector([0.0, d, 0.0]), Vector([0.0, 0.0, d])], reader)
}

impl Models {
    /// D and S.
    fn say(&self, frame: &Frame) -> ([f32; 3], [f32; 2]) {
        let d = [0, 1, 2].map(|i| self.mean[i][frame.octave][frame.classes[i]].mean);
        let s = [0, 1].map(|i| self.slope[i][frame.classes[i + 1]].slope() * frame.features[i]);
        (d, s)
    }

    /// From E, with the D and S from before.
    fn learn(&mut self, frame: &Frame, e: [f32; 3], d: [f32; 3], s: [f32; 2]) {
        let Frame { features, octave, classes, .. } = *frame;
        self.mean[0][octave][classes[0]].learn(e[0].abs());
        for i in [0, 1] {
            self.mean[i + 1][octave][classes[i + 1]].learn((e[i + 1] - s[i]).abs());
            let w = 1.0 / larger(d[i + 1], 0.001);
            self.slope[i][classes[i + 1]].learn(features[i] * w, e[i + 1] * w);
        }
    }

    /// The models that a frame chooses.
    fn of(&self, frame: &Frame) -> ([Mean; 3], [Slope; 2]) {
        let means = [0, 1, 2].map(|i| self.mean[i][frame.octave][frame.classes[i]]);
        (means, [0, 1].map(|i| self.slope[i][frame.classes[i + 1]]))
    }
}

/// feature(x).
fn feature(x: f32) -> usize {
    (exponent(x).clamp(-7, 0) + 7) as usize
}

#[test]
fn features_are_octaves() {
    assert_eq!([0.0, 1e-9, 0.01, -0.5, 0.9, 1.0, -1e9].map(feature), [0, 0, 0, 6, 6, 7, 7]);
}

#[test]
fn models_forget_slowly_and_stay_in_bounds() {
    let mut slope = Slope { products: 2.0, squares: 4.0 };
    slope.learn(20.0, 80.0);
    assert_eq!(slope, Slope { products: 801.0, squares: 202.0 });
    assert_eq!(slope.slope(), 2.0);
    slope.learn(-20.0, 80.0);
    assert_eq!(slope, Slope { products: -799.0 / 2.0, squares: 301.0 });
    assert_eq!(slope.slope(), -799.0 / 602.0);

    let mut mean = Mean { mean: 0.0, count: 0 };
    mean.learn(5.0);
    assert_eq!(mean.mean, 1.0);
    (0..100).for_each(|_| mean.learn(mean.mean));
    mean.learn(65.0);
    assert_eq!(mean.mean, 2.0, "one part in 64");
}
