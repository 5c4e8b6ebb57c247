//! The integer lattice that positions live on (spec §2.4).

/// A cube of `2^bits` points a side: origin at the minimum of the bounding box, one step for all axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lattice {
    /// The position of lattice point (0, 0, 0).
    pub origin: [f64; 3],
    /// Distance of neighbouring lattice points; 0 where all positions coincide.
    pub step: f64,
    /// Bits a coordinate, [`Lattice::MIN_BITS`] to [`Lattice::MAX_BITS`].
    pub bits: u32,
}

impl Lattice {
    /// Fewest bits a coordinate.
    pub const MIN_BITS: u32 = 8;
    /// Most bits a coordinate.
    pub const MAX_BITS: u32 = 24;

    /// The lattice over a bounding box: step = longest extent / (2^bits - 1).
    pub fn over(min: [f64; 3], max: [f64; 3], bits: u32) -> Self {
        let extent = (0..3).map(|k| max[k] - min[k]).fold(0.0, f64::max);
        Self { origin: min, step: extent / f64::from((1u32 << bits) - 1), bits }
    }

    /// Largest coordinate on the lattice.
    pub fn max_coordinate(&self) -> i32 {
        ((1u32 << self.bits) - 1) as i32
    }

    /// The nearest lattice point; positions outside the cube go to its surface.
    pub fn quantise(&self, position: [f64; 3]) -> [i32; 3] {
        let max = f64::from(self.max_coordinate());
        std::array::from_fn(|k| self.unclamped(position[k], k).clamp(0.0, max) as i32)
    }

    /// The nearest lattice coordinate along axis `k`, also outside the cube; 0 where the lattice has no extent.
    pub fn unclamped(&self, x: f64, k: usize) -> f64 {
        if self.step > 0.0 { ((x - self.origin[k]) / self.step).round() } else { 0.0 }
    }

    /// The position of a lattice point: origin + step * point, one multiplication and one addition an axis.
    pub fn position(&self, point: [i32; 3]) -> [f64; 3] {
        std::array::from_fn(|k| self.origin[k] + self.step * f64::from(point[k]))
    }
}

/// The bounding box of some positions, or `None` where there are none.
pub fn bounds(positions: impl Iterator<Item = [f64; 3]>) -> Option<([f64; 3], [f64; 3])> {
    let mut bounds: Option<([f64; 3], [f64; 3])> = None;
    for p in positions {
        let (min, max) = bounds.get_or_insert((p, p));
        for k in 0..3 {
            min[k] = min[k].min(p[k]);
            max[k] = max[k].max(p[k]);
        }
    }
    bounds
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nearest_point_within_half_a_step() {
        let lattice = Lattice::over([-1.0, 0.0, 2.0], [3.0, 1.0, 2.5], 8);
        for p in [[-1.0, 0.0, 2.0], [3.0, 1.0, 2.5], [0.123, 0.456, 2.2]] {
            let back = lattice.position(lattice.quantise(p));
            for k in 0..3 {
                assert!((back[k] - p[k]).abs() <= lattice.step * 0.5 + 1e-12);
            }
        }
        assert_eq!(lattice.quantise([3.0, 0.0, 2.0])[0], 255);
    }

    #[test]
    fn a_single_point_has_no_step() {
        let lattice = Lattice::over([5.0; 3], [5.0; 3], 14);
        assert_eq!(lattice.step, 0.0);
        assert_eq!(lattice.position(lattice.quantise([5.0; 3])), [5.0; 3]);
    }
}
