//! What a viewer sees of an error: whether the surface may leave a vertex for so many pixels.

use super::Surface;
use super::integer::{
    ERROR_BITS, LATTICE_BITS, Point, cross, dot, magnitude, minus, shift_of, shifted, shortened, square_root,
};
use crate::error::{Error, Result};
use crate::reduce::rings::Rings;
use crate::reduce::star::turned;

/// Who looks at the mesh, and how closely. The eye looks at the middle of the bounding box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Where the eye is, in the units of the mesh.
    pub eye: [f64; 3],
    /// Largest error in pixels, above 0.
    pub pixels: f64,
    /// Height of the picture in pixels, above 0.
    pub height: f64,
    /// Angle from the lower to the upper end of the picture in degrees, above 0 and below 180.
    pub fov: f64,
}

/// A view in integers, on the lattice of a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sight {
    /// Where the eye is; outside the lattice it may be.
    pub eye: [i32; 3],
    /// The direction in which the eye looks, below 2^14.
    pub forward: [i32; 3],
    /// The cosine of the angle from there within which everything is that can be seen, times the length of `forward`.
    pub cosine: i32,
    /// The error allowed at distance 1, in 2^-24.
    pub slope: u32,
}

impl View {
    /// On the lattice of a surface.
    ///
    /// # Errors
    /// [`Error::Parameter`] where a value is out of its range.
    pub fn on(&self, surface: &Surface) -> Result<Sight> {
        let positive = [("pixels", self.pixels), ("height", self.height), ("angle", self.fov)];
        if let Some((name, x)) = positive.into_iter().find(|(_, x)| !(x.is_finite() && *x > 0.0)) {
            return Err(Error::Parameter(format!("the {name} of a view is {x}, it must be above 0")));
        }
        if self.fov >= 180.0 {
            return Err(Error::Parameter(format!(
                "the angle of a view is {}, it must be below 180",
                self.fov
            )));
        }
        if !self.eye.iter().all(|x| x.is_finite()) {
            return Err(Error::Parameter("a coordinate of the eye is no finite number".to_owned()));
        }
        let half = (self.fov / 2.0).to_radians().tan();
        // The corner of the picture, which is wide.
        let corner = half * WIDE.hypot(1.0);
        let eye = surface.nearest(self.eye);
        let forward = minus(surface.middle(), eye);
        let forward = shifted(forward, shift_of(magnitude(forward)));
        let length = dot(forward, forward) as f64;
        Ok(Sight {
            eye,
            forward,
            cosine: (length.sqrt() / corner.hypot(1.0)) as i32,
            slope: (self.pixels * 2.0 * half / self.height * f64::from(1 << 24)).round() as u32,
        })
    }
}

impl Sight {
    /// The error that may be at a point, in 2^-8 steps of the lattice.
    pub(super) fn allowed(&self, point: Point) -> u32 {
        let to = minus(point, self.eye);
        let square: u64 = to.iter().map(|&x| u64::from(x.unsigned_abs()) * u64::from(x.unsigned_abs())).sum();
        let distance = square_root(square);
        let allowed = (u64::from(self.slope) * u64::from(distance.max(NEAR))) >> (24 - ERROR_BITS);
        let is_seen = dot(to, self.forward) >= i64::from(self.cosine) * i64::from(distance);
        // What is out of sight may be eight times as coarse.
        let allowed = if is_seen { allowed } else { allowed << 3 };
        u32::try_from(allowed).unwrap_or(u32::MAX)
    }
}

/// How far the neighbours of a vertex are from its tangent plane in the mean, in 2^-8 steps of the lattice.
pub(super) fn error(v: u32, points: &[Point], triangles: &[[u32; 3]], rings: &Rings) -> u32 {
    let at = |w: u32| minus(points[w as usize], points[v as usize]);
    let ends = || rings.of(v).iter().filter_map(|&t| turned(triangles[t as usize], v));
    let shift = shift_of(ends().fold(0, |most, [a, b]| most | magnitude(at(a)) | magnitude(at(b))));
    let near = |w: u32| shifted(at(w), shift);
    let (mut sum, mut count) = ([0i64; 3], 0u32);
    for [a, b] in ends() {
        let n = cross(near(a), near(b));
        sum = std::array::from_fn(|k| sum[k] + i64::from(n[k]));
        count += 2;
    }
    let normal = shortened(sum);
    let length = square_root(dot(normal, normal) as u64);
    if length == 0 {
        // There is no plane: whatever the surface is like, it is not flat.
        return if count == 0 { 0 } else { u32::MAX };
    }
    // Each neighbour comes twice, but the two at the ends of a boundary.
    let off: u64 =
        ends().map(|[a, b]| dot(normal, near(a)).unsigned_abs() + dot(normal, near(b)).unsigned_abs()).sum();
    let mean = (off << ERROR_BITS) / (u64::from(count) * u64::from(length));
    u32::try_from(mean << shift).unwrap_or(u32::MAX)
}

impl Surface {
    /// The nearest point of the lattice continued, as far as 2^29 steps.
    fn nearest(&self, position: [f64; 3]) -> Point {
        let most = f64::from(1 << 29);
        let scaled = position.map(|x| x * self.scale);
        std::array::from_fn(|k| self.lattice.unclamped(scaled[k], k).clamp(-most, most) as i32)
    }

    /// The middle of the bounding box.
    fn middle(&self) -> Point {
        let sides = |pick: fn(i32, i32) -> i32| {
            self.points.iter().copied().reduce(|a, b| std::array::from_fn(|k| pick(a[k], b[k])))
        };
        let [low, high] = [sides(i32::min), sides(i32::max)].map(Option::unwrap_or_default);
        std::array::from_fn(|k| low[k] + (high[k] - low[k]) / 2)
    }
}

/// What is nearer to the eye counts as if it were so far, in steps.
const NEAR: u32 = 1 << (LATTICE_BITS - 10);
/// Width of the picture over its height.
const WIDE: f64 = 16.0 / 9.0;
