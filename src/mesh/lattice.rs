//! The integer lattice that positions live on (spec §2.4).

use crate::error::{Error, Result};

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
    /// Bits a coordinate where nothing else is asked for.
    pub const DEFAULT_BITS: u32 = 14;
    /// Largest magnitude of a coordinate outside the cube, so that differences are 32-bit numbers.
    pub const MAX_OUTSIDE: i32 = (1 << 30) - 1;

    /// The lattice over a bounding box: step = longest extent / (2^bits - 1).
    pub fn over(min: [f64; 3], max: [f64; 3], bits: u32) -> Self {
        let extent = (0..3).map(|k| max[k] - min[k]).fold(0.0, f64::max);
        Self { origin: min, step: extent / f64::from((1u32 << bits) - 1), bits }
    }

    /// Nearly the same lattice, over a bounding box up to `max`, of numbers that binary32 holds, which take half the bytes in a file: the step is
    /// rounded up, the origin down, but not where that would move it by more than a small part of a step. One whose origin is of binary32, as
    /// those of meshes in binary32 are, stays: what is symmetric on it would no longer be, for four bytes.
    pub fn rounded(self, max: [f64; 3]) -> Self {
        let origin = self.origin.map(|x| -rounded_up(-x));
        let moved = |k: usize| self.origin[k] - origin[k];
        let whole = Self::over(origin, max, self.bits);
        let step = rounded_up(whole.step);
        let is_better = origin != self.origin && (0..3).all(|k| moved(k) <= self.step / 128.0);
        if is_better && (step as f32).is_normal() { Self { step, ..whole } } else { self }
    }

    /// The lattice of the fewest bits over a bounding box whose step is at most `step`, which is above 0.
    ///
    /// # Errors
    /// [`Error::Parameter`] where it takes more than [`Lattice::MAX_BITS`].
    pub fn at_most(step: f64, min: [f64; 3], max: [f64; 3]) -> Result<Self> {
        let mut fine_enough = (Self::MIN_BITS..=Self::MAX_BITS).map(|bits| Self::over(min, max, bits));
        fine_enough.find(|lattice| lattice.step <= step).ok_or_else(|| {
            let (bits, finest) = (Self::MAX_BITS, Self::over(min, max, Self::MAX_BITS).step);
            Error::Parameter(format!(
                "a step of at most {step} takes more than {bits} bits a coordinate: the mesh allows {finest} or more"
            ))
        })
    }

    /// The part over a bounding box of a lattice that several meshes share: its points are `origin` plus multiples of `step`,
    /// which is above 0; both are finite. Its own origin is the point nearest to `min`.
    ///
    /// # Errors
    /// [`Error::Parameter`] where it takes more than [`Lattice::MAX_BITS`], or lies too far from `origin` for its step.
    pub fn part(step: f64, origin: [f64; 3], min: [f64; 3], max: [f64; 3]) -> Result<Self> {
        let first: [f64; 3] = std::array::from_fn(|k| nearest(min[k], origin[k], step));
        let own = std::array::from_fn(|k| origin[k] + first[k] * step);
        let last: [f64; 3] = std::array::from_fn(|k| nearest(max[k], own[k], step));
        let is_near = |k: usize| first[k].abs() <= MAX_STEPS && last[k].abs() <= MAX_STEPS;
        if let Some(k) = (0..3).find(|&k| !is_near(k)) {
            return Err(Error::Parameter(format!(
                "the mesh reaches from {} to {}, more than 2^48 lattice steps of {step} from the lattice's origin at {}",
                min[k], max[k], origin[k]
            )));
        }
        let steps = last.into_iter().fold(0.0, f64::max);
        let most = |bits: u32| f64::from((1u32 << bits) - 1);
        let fitting = (Self::MIN_BITS..=Self::MAX_BITS).find(|&bits| steps <= most(bits));
        fitting.map(|bits| Self { origin: own, step, bits }).ok_or_else(|| {
            let mut enough = step;
            // One step more than now can be needed where the ends are rounded the other way.
            while (steps + 1.0) * (step / enough) > most(Self::MAX_BITS) - 1.0 {
                enough *= 2.0;
            }
            Error::Parameter(format!(
                "the mesh is {steps} lattice steps of {step} long, more than {} bits a coordinate hold: a step of {enough} would do",
                Self::MAX_BITS
            ))
        })
    }

    /// Whether the points are multiples of the step, which is a power of two, without any rounding: then meshes whose lattices
    /// have this step have positions in common, bit for bit.
    pub fn is_exact(&self) -> bool {
        let multiple =
            |x: f64| x.fract() == 0.0 && x.abs() + f64::from(self.max_coordinate()) <= 2f64.powi(53);
        is_power_of_two(self.step) && self.origin.iter().all(|x| multiple(x / self.step))
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
        if self.step > 0.0 { nearest(x, self.origin[k], self.step) } else { 0.0 }
    }

    /// The nearest lattice point, also outside the cube; `None` beyond [`Lattice::MAX_OUTSIDE`], and where the lattice has no
    /// extent for all positions but its origin.
    pub fn point(&self, position: [f64; 3]) -> Option<[i32; 3]> {
        let q: [f64; 3] = std::array::from_fn(|k| self.unclamped(position[k], k));
        let is_near = q.iter().all(|x| x.abs() <= f64::from(Self::MAX_OUTSIDE));
        (is_near && (self.step > 0.0 || position == self.origin)).then(|| q.map(|x| x as i32))
    }

    /// The position of a lattice point: origin + step * point, one multiplication and one addition an axis.
    pub fn position(&self, point: [i32; 3]) -> [f64; 3] {
        std::array::from_fn(|k| self.origin[k] + self.step * f64::from(point[k]))
    }
}

/// The number of steps from `origin` that is nearest to `x`. Where the step is a power of two it is right to the last bit, and
/// halves go up: so a position has the same point, wherever the origin of its mesh is.
fn nearest(x: f64, origin: f64, step: f64) -> f64 {
    let difference = x - origin;
    let quotient = difference / step;
    let below = quotient.floor();
    if quotient - below != 0.5 || !is_power_of_two(step) {
        return quotient.round();
    }
    // Rounding can only have led onto the middle, never across it. What it took away decides (Knuth's sum of two numbers).
    let part = difference - x;
    let lost = (x - (difference - part)) - (origin + part);
    if (difference - (below + 0.5) * step) + lost >= 0.0 { below + 1.0 } else { below }
}

/// The least number of binary32 that is not less than `x`.
fn rounded_up(x: f64) -> f64 {
    let near = x as f32;
    f64::from(if f64::from(near) < x { near.next_up() } else { near })
}

/// Of normal numbers.
fn is_power_of_two(x: f64) -> bool {
    x.is_normal() && x > 0.0 && x.to_bits() << 12 == 0
}

/// Steps from the origin of a shared lattice: the rounding of a place so far off is a small part of a step.
const MAX_STEPS: f64 = (1u64 << 48) as f64;

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

    /// A box of decimals: binary32 holds the lattice, whose corners are the box's to a small part of a step; far from the origin it does not hold the
    /// box's corner so well, and a box without extent has no step to round.
    #[test]
    fn rounded_lattices_take_half_the_bytes() {
        let short = |x: f64| f64::from(x as f32) == x;
        let (min, max) = ([12.6055, -0.1, 0.0], [13.7, 4.5, 1.0]);
        for bits in [8, 12, 14] {
            let lattice = Lattice::over(min, max, bits).rounded(max);
            assert!(lattice.origin.iter().all(|&x| short(x)) && short(lattice.step), "{lattice:?}");
            let [first, last] = [min, max].map(|p| lattice.quantise(p));
            assert_eq!(first, [0; 3]);
            assert!(
                last[1] == lattice.max_coordinate() && lattice.unclamped(max[1], 1) <= f64::from(last[1])
            );
            let back = [first, last].map(|q| lattice.position(q));
            let off = |k: usize| (back[0][k] - min[k]).abs().max((back[1][k] - max[k]).abs());
            assert!((0..3).all(|k| off(k) <= 0.51 * lattice.step), "{lattice:?}");
        }
        let fine = Lattice::over(min, max, 20);
        assert_eq!(fine.rounded(max), fine, "binary32 is too coarse");
        let far = Lattice::over([5e6 + 0.3, 0.0, 0.0], [5e6 + 1.0, 1.0, 1.0], 14);
        assert_eq!(far.rounded([5e6 + 1.0, 1.0, 1.0]), far);
        let point = Lattice::over([0.1; 3], [0.1; 3], 14);
        assert_eq!(point.rounded([0.1; 3]), point);
        let short = Lattice::over([-0.5, 0.0, 1.0], [0.1; 3], 12);
        assert_eq!(short.rounded([0.1; 3]), short, "its origin is of binary32");
    }

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

    #[test]
    fn fewest_bits_for_a_step() {
        let over = |step, extent: f64| Lattice::at_most(step, [-1.0; 3], [extent - 1.0, 0.0, 0.0]);
        // 255 steps of 1 are 8 bits; a little finer takes 9.
        assert_eq!(over(1.0, 255.0).unwrap().bits, 8);
        assert_eq!(over(0.999, 255.0).unwrap().bits, 9);
        assert_eq!(over(1e9, 255.0).unwrap().bits, 8);
        assert_eq!(over(1.0, 16_777_215.0).unwrap().bits, 24);
        let said = over(0.5, 16_777_215.0).unwrap_err().to_string();
        assert!(said.contains("more than 24 bits") && said.contains("allows 1 or more"), "{said}");
    }

    #[test]
    fn a_part_of_a_shared_lattice() {
        // 2.9 / 0.25 = 11.6, 4.1 / 0.25 = 16.4: points 12 to 16.
        let part = Lattice::part(0.25, [1.0, 0.0, 0.0], [3.9, 0.0, -10.0], [5.1, 0.0, -9.0]).unwrap();
        assert_eq!(part, Lattice { origin: [4.0, 0.0, -10.0], step: 0.25, bits: 8 });
        assert_eq!(part.quantise([5.1, 0.0, -9.0]), [4, 0, 4]);
        assert!(part.is_exact());
        let wide = |extent| Lattice::part(1.0, [0.5; 3], [0.5; 3], [extent + 0.5, 0.5, 0.5]);
        assert_eq!([255.0, 256.0, 16_777_215.0].map(|x| wide(x).unwrap().bits), [8, 9, 24]);
        assert!(!wide(1.0).unwrap().is_exact());
        let said = wide(16_777_216.0).unwrap_err().to_string();
        assert!(
            said.contains("16777216 lattice steps of 1 long") && said.contains("step of 2 would do"),
            "{said}"
        );
        let said = Lattice::part(1e-9, [0.0; 3], [1e9; 3], [1e9; 3]).unwrap_err().to_string();
        assert!(said.contains("more than 2^48 lattice steps of 0.000000001"), "{said}");
        assert!(!Lattice::part(0.1, [0.0; 3], [0.0; 3], [1.0; 3]).unwrap().is_exact());
    }

    #[test]
    fn what_is_lost_decides_at_the_middle() {
        let (half, little) = (0.5f64, 2f64.powi(-60));
        // From a far origin all three look the same.
        for (x, point) in [(half, 1.0), (half - little * 64.0, 0.0), (half + little * 128.0, 1.0)] {
            assert_eq!(nearest(x, 0.0, 1.0), point, "{x}");
            assert_eq!(nearest(x, -4096.0, 1.0), point + 4096.0, "{x}");
            assert_eq!(nearest(x, 4096.0, 1.0), point - 4096.0, "{x}");
        }
        // Halves go up on both sides of the origin.
        assert_eq!([-2.5, -0.5, 0.5, 2.5].map(|x| nearest(x, 0.0, 1.0)), [-2.0, 0.0, 1.0, 3.0]);
    }
}
