//! From numbers of a source to the integers that are coded, and back (spec §13.2).

use super::{Attribute, Semantic, Stored, Values};

/// How the numbers of an attribute become integers.
#[derive(Clone, Debug, PartialEq)]
pub enum Quantisation {
    /// Integers as they are stored.
    Integer,
    /// Floating-point numbers on a lattice: component k of `origin[k]` plus a multiple of `step`.
    Lattice {
        /// Bits of a number, 1 to 24.
        bits: u32,
        /// The least number of each component.
        origin: Vec<f64>,
        /// Distance of neighbouring numbers, of all components; 0 where each has but one.
        step: f64,
    },
    /// Unit vectors as octahedral coordinates; of a tangent, with the sign of its fourth component.
    Octahedral {
        /// Bits a coordinate, 2 to 16.
        bits: u32,
    },
    /// Floating-point numbers by their bits, none lost: one integer a binary32, two a binary64.
    Raw,
}

/// How far from 1 the length of a unit vector may be: less than a display of it could show, more than three decimals leave.
const UNIT: f64 = 1.0 / 1024.0;

impl Quantisation {
    /// Fewest and most bits of a lattice.
    pub const LATTICE_BITS: std::ops::RangeInclusive<u32> = 1..=24;
    /// Fewest and most bits of octahedral coordinates.
    pub const OCTAHEDRAL_BITS: std::ops::RangeInclusive<u32> = 2..=16;

    /// The usual one of an attribute, or that of so many `bits` a number, as many as it can have at most.
    ///
    /// Integers stay as they are. Nothing of floating-point numbers is lost where the attribute is to be `exact`, or has numbers
    /// that are not finite. Vectors that should have a length of 1 but have not are numbers like any others.
    pub fn choose(attribute: &Attribute, bits: Option<u32>, exact: bool) -> Self {
        if !attribute.values.stored().is_float() {
            return Self::Integer;
        }
        if exact {
            return Self::Raw;
        }
        if is_of_unit_vectors(attribute) {
            let (least, most) = (*Self::OCTAHEDRAL_BITS.start(), *Self::OCTAHEDRAL_BITS.end());
            return Self::Octahedral { bits: bits.unwrap_or(10).clamp(least, most) };
        }
        Self::over(attribute, Self::lattice_bits(attribute, bits)).unwrap_or(Self::Raw)
    }

    /// The usual bits of a number on a lattice, or so many `bits`, as many as it can have at most.
    pub(crate) fn lattice_bits(attribute: &Attribute, bits: Option<u32>) -> u32 {
        let usual = if attribute.semantic == Semantic::Color { 10 } else { 12 };
        bits.unwrap_or(usual).clamp(*Self::LATTICE_BITS.start(), *Self::LATTICE_BITS.end())
    }

    /// The lattice over all values that a corner has; `None` where it would not be finite.
    fn over(attribute: &Attribute, bits: u32) -> Option<Self> {
        let n = attribute.components;
        let (mut min, mut max) = (vec![f64::INFINITY; n], vec![f64::NEG_INFINITY; n]);
        for value in used(attribute) {
            for k in 0..n {
                let x = attribute.values.number(value * n + k);
                if !x.is_finite() {
                    return None;
                }
                (min[k], max[k]) = (min[k].min(x), max[k].max(x));
            }
        }
        // 0.0: an origin of -0 would be another descriptor of the same lattice.
        let origin: Vec<f64> = min.iter().map(|&x| if x.is_finite() { x + 0.0 } else { 0.0 }).collect();
        let extent = (0..n).map(|k| max[k] - min[k]).fold(0.0, f64::max);
        let step = extent / f64::from((1u32 << bits) - 1);
        step.is_finite().then_some(Self::Lattice { bits, origin, step })
    }

    /// How many integers a value of so many numbers becomes.
    pub fn integers(&self, components: usize, stored: Stored) -> usize {
        match self {
            Self::Octahedral { .. } => components.saturating_sub(1),
            Self::Raw if stored == Stored::F64 => 2 * components,
            _ => components,
        }
    }

    /// Appends the integers of a value of an attribute.
    pub fn quantise(&self, attribute: &Attribute, value: usize, out: &mut Vec<i32>) {
        let n = attribute.components;
        let numbers = value * n..(value + 1) * n;
        match self {
            Self::Integer => out.extend(numbers.map(|at| attribute.values.bits(at) as i32)),
            Self::Raw => numbers.for_each(|at| match attribute.values.stored() {
                Stored::F64 => out.extend(halves(ordered_long(attribute.values.bits(at)))),
                _ => out.push(ordered(attribute.values.bits(at) as u32)),
            }),
            Self::Lattice { origin, step, .. } => {
                out.extend(
                    numbers
                        .zip(origin)
                        .map(|(at, &origin)| self.nearest((attribute.values.number(at) - origin) / step)),
                );
            }
            Self::Octahedral { bits } => {
                let vector = [0, 1, 2].map(|k| attribute.values.number(numbers.start + k));
                out.extend(octahedral(vector, radius(*bits)));
                if n > 3 {
                    out.push(i32::from(attribute.values.number(numbers.start + 3) < 0.0));
                }
            }
        }
    }

    /// The point of a lattice that is nearest to so many steps from its origin; 0 where it has no extent.
    fn nearest(&self, steps: f64) -> i32 {
        let most = match self {
            Self::Lattice { bits, step, .. } if *step > 0.0 => (1u32 << bits) - 1,
            _ => 0,
        };
        (steps + 0.5).floor().clamp(0.0, f64::from(most)) as i32
    }

    /// Appends the numbers of a value, whatever its integers are (spec §13.2).
    pub fn value(&self, integers: &[i32], components: usize, out: &mut Values) {
        match self {
            Self::Integer => {
                integers.iter().take(components).for_each(|&q| out.push_bits(i64::from(q) as u64))
            }
            Self::Raw if out.stored() == Stored::F64 => {
                for pair in integers.chunks_exact(2).take(components) {
                    out.push_bits(ordered_long(joined(pair[0], pair[1]) as u64) as u64);
                }
            }
            Self::Raw => {
                integers
                    .iter()
                    .take(components)
                    .for_each(|&q| out.push_bits((ordered(q as u32) as u32).into()));
            }
            Self::Lattice { origin, step, .. } => {
                for (&q, &origin) in integers.iter().zip(origin).take(components) {
                    out.push(origin + step * f64::from(q));
                }
            }
            Self::Octahedral { bits } => {
                let at = |k: usize| integers.get(k).copied().unwrap_or(0);
                let vector = direction([at(0), at(1)], radius(*bits));
                vector.into_iter().take(components).for_each(|x| out.push(x));
                if components > 3 {
                    out.push(if at(2) > 0 { -1.0 } else { 1.0 });
                }
            }
        }
    }

    /// The root mean square, over the corners that have a value, of how far it is from what comes back; in the units of the
    /// attribute, of unit vectors in degrees.
    pub fn error(&self, attribute: &Attribute) -> f64 {
        if matches!(self, Self::Integer | Self::Raw) {
            return 0.0;
        }
        let n = attribute.components;
        let (mut integers, mut back) = (Vec::new(), Values::F64(Vec::new()));
        let lost: Vec<f64> = (0..attribute.count())
            .map(|value| {
                integers.clear();
                back = Values::new(attribute.values.stored());
                self.quantise(attribute, value, &mut integers);
                self.value(&integers, n, &mut back);
                let measured = if matches!(self, Self::Octahedral { .. }) { 3 } else { n };
                let off = |k: usize| attribute.values.number(value * n + k) - back.number(k);
                (0..measured).map(|k| off(k) * off(k)).sum()
            })
            .collect();
        let (sum, count) =
            used(attribute).fold((0.0, 0.0), |(sum, count), value| (sum + lost[value], count + 1.0));
        let rms = (sum / f64::max(count, 1.0)).sqrt();
        // A chord of a circle of radius 1 so short is as long as its arc.
        if matches!(self, Self::Octahedral { .. }) { rms * (180.0 / std::f64::consts::PI) } else { rms }
    }
}

/// The values that corners or triangles have, as often as they have them.
fn used(attribute: &Attribute) -> impl Iterator<Item = usize> + '_ {
    let count = attribute.count();
    attribute.corners.iter().map(|&value| value as usize).filter(move |&value| value < count)
}

/// Whether all values are what octahedral coordinates can bring back: unit vectors, tangents with a side of 1 or -1.
fn is_of_unit_vectors(attribute: &Attribute) -> bool {
    let n = match attribute.semantic {
        Semantic::Normal => 3,
        Semantic::Tangent => 4,
        _ => return false,
    };
    let number = |value: usize, k: usize| attribute.values.number(value * n + k);
    let is_unit = |value: usize| {
        let [x, y, z] = [0, 1, 2].map(|k| number(value, k));
        let length = (x * x + y * y + z * z).sqrt();
        (length - 1.0).abs() <= UNIT && (n == 3 || number(value, 3).abs() == 1.0)
    };
    attribute.components == n && used(attribute).all(is_unit)
}

/// The largest octahedral coordinate of so many bits: an odd number of them, so that the axes have one of their own.
pub(crate) fn radius(bits: u32) -> i32 {
    (1i32 << (bits.clamp(2, 16) - 1)) - 1
}

/// The octahedral coordinates, -`radius` to `radius`, of the direction nearest to a vector that is not 0 (Meyer et al. 2010;
/// the nearest of four as Cigolle et al. 2014 have it). Of several for one direction the canonical one.
pub(crate) fn octahedral(vector: [f64; 3], radius: i32) -> [i32; 2] {
    let Some([u, v]) = folded(vector, radius) else { return [0, 0] };
    let [x, y, z] = vector;
    let low = [u.floor() as i32, v.floor() as i32];
    let mut best = ([0, 0], f64::NEG_INFINITY);
    for k in 0..4 {
        let q = canonical([low[0] + (k & 1), low[1] + (k >> 1)].map(|q| q.clamp(-radius, radius)), radius);
        let [a, b, c] = direction(q, radius);
        let near = (a * x + b * y) + c * z;
        if near > best.1 {
            best = (q, near);
        }
    }
    best.0
}

/// The octahedral coordinates of a vector, not rounded; `None` where it has no direction.
#[inline]
fn folded([x, y, z]: [f64; 3], radius: i32) -> Option<[f64; 2]> {
    let sum = x.abs() + y.abs() + z.abs();
    let scale = f64::from(radius) / sum;
    if !(scale.is_finite() && sum.is_finite()) {
        return None;
    }
    let (u, v) = (x * scale, y * scale);
    if z < 0.0 {
        let r = f64::from(radius);
        return Some([(r - v.abs()).copysign(u), (r - u.abs()).copysign(v)]);
    }
    Some([u, v])
}

/// The one of several octahedral coordinates of a direction, which is on the border of the square, that encoders write.
pub(crate) fn canonical([u, v]: [i32; 2], radius: i32) -> [i32; 2] {
    match (u.abs() == radius, v.abs() == radius) {
        (true, true) => [radius, radius],
        (true, false) => [u, v.abs()],
        (false, true) => [u.abs(), v],
        (false, false) => [u, v],
    }
}

/// The vector, not yet of length 1, of octahedral coordinates; those beyond the radius are taken to it.
pub(crate) fn unfolded([u, v]: [i32; 2], radius: i32) -> [i32; 3] {
    let (u, v) = (u.clamp(-radius, radius), v.clamp(-radius, radius));
    let z = radius - u.abs() - v.abs();
    let sign = |x: i32| if x < 0 { -1 } else { 1 };
    if z < 0 { [sign(u) * (radius - v.abs()), sign(v) * (radius - u.abs()), z] } else { [u, v, z] }
}

/// The unit vector of octahedral coordinates.
pub(crate) fn direction(q: [i32; 2], radius: i32) -> [f64; 3] {
    let vector = unfolded(q, radius).map(f64::from);
    let [x, y, z] = vector;
    let length = ((x * x + y * y) + z * z).sqrt();
    vector.map(|x| x / length)
}

/// The bits of a binary32 as an integer in the order of the numbers, and back: it is its own inverse.
pub(crate) fn ordered(bits: u32) -> i32 {
    let bits = bits as i32;
    bits ^ ((bits >> 31) & i32::MAX)
}

/// As [`ordered`], of a binary64.
pub(crate) fn ordered_long(bits: u64) -> i64 {
    let bits = bits as i64;
    bits ^ ((bits >> 63) & i64::MAX)
}

/// The two integers of a binary64: its high half and its low half.
pub(crate) fn halves(x: i64) -> [i32; 2] {
    [(x >> 32) as i32, x as i32]
}

/// The inverse of [`halves`].
pub(crate) fn joined(high: i32, low: i32) -> i64 {
    i64::from(high) << 32 | i64::from(low as u32)
}

/// The binary32 of an integer of [`ordered`].
pub(crate) fn short(q: i32) -> f32 {
    f32::from_bits(ordered(q as u32) as u32)
}

/// The binary64 of two integers.
pub(crate) fn long([high, low]: [i32; 2]) -> f64 {
    f64::from_bits(ordered_long(joined(high, low) as u64) as u64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// An attribute whose corners are its values in turn.
    fn attribute(semantic: Semantic, components: usize, values: Values) -> Attribute {
        let count = (values.len() / components) as u32;
        Attribute::new(semantic, components, values, (0..count).collect())
    }

    fn integers(quantisation: &Quantisation, attribute: &Attribute) -> Vec<i32> {
        let mut all = Vec::new();
        (0..attribute.count()).for_each(|value| quantisation.quantise(attribute, value, &mut all));
        all
    }

    /// What comes back.
    fn back(quantisation: &Quantisation, of: &Attribute) -> Attribute {
        let stored = of.values.stored();
        let mut values = Values::new(stored);
        for q in integers(quantisation, of).chunks(quantisation.integers(of.components, stored)) {
            quantisation.value(q, of.components, &mut values);
        }
        Attribute { values, ..of.clone() }
    }

    fn vectors(seed: &[[f64; 3]]) -> Attribute {
        let unit = seed.iter().filter_map(|v| {
            let length = (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
            (length > 1e-3).then(|| v.map(|x| x / length))
        });
        attribute(Semantic::Normal, 3, Values::F64(unit.flatten().collect()))
    }

    proptest! {
        #[test]
        fn a_lattice_is_half_a_step_off_at_most(
            numbers in prop::collection::vec(-1e3..1e3f64, 2..60), bits in 1..=24u32, k in 1..=2usize
        ) {
            let numbers = numbers[..numbers.len() / k * k].to_vec();
            let uv = attribute(Semantic::TexCoord, k, Values::F64(numbers));
            let quantisation = Quantisation::choose(&uv, Some(bits), false);
            let Quantisation::Lattice { step, .. } = &quantisation else { panic!("{quantisation:?}") };
            let again = back(&quantisation, &uv);
            for at in 0..uv.values.len() {
                let off = (uv.values.number(at) - again.values.number(at)).abs();
                prop_assert!(off <= step * 0.5 + 1e-9, "{off} of {step}");
            }
            prop_assert_eq!(integers(&quantisation, &again), integers(&quantisation, &uv));
            let root = (k as f64).sqrt();
            prop_assert!(quantisation.error(&uv) <= (step * 0.5 + 1e-9) * root);
        }

        /// Distances of neighbouring coordinates are at most 2 / radius on the octahedron, whose points are 1 / sqrt(3) and more
        /// from the middle: no direction is further from the nearest one than the half of a diagonal of four.
        #[test]
        fn directions_come_back(seed in prop::collection::vec(prop::array::uniform3(-1.0..1.0f64), 1..40), bits in 3..=16u32) {
            let normals = vectors(&seed);
            let quantisation = Quantisation::Octahedral { bits };
            let again = back(&quantisation, &normals);
            let most = 0.5 * 2f64.sqrt() * 3f64.sqrt() * 2f64.sqrt() / f64::from(radius(bits));
            for value in 0..normals.count() {
                let off: f64 = (0..3)
                    .map(|k| (normals.values.number(3 * value + k) - again.values.number(3 * value + k)).powi(2))
                    .sum();
                prop_assert!(off.sqrt() <= most, "{} of {most}", off.sqrt());
            }
            prop_assert_eq!(integers(&quantisation, &again), integers(&quantisation, &normals));
            prop_assert!(quantisation.error(&normals) <= most * 57.3);
        }

        #[test]
        fn bits_are_kept_and_ordered(bits in prop::collection::vec(any::<u64>(), 1..50)) {
            for stored in Stored::ALL {
                let mut values = Values::new(stored);
                bits.iter().for_each(|&bits| values.push_bits(bits));
                [0, 1 << 31, 1 << 63, 0x7F80_0001, 0xFFF0_0000_0000_0001].iter().for_each(|&bits| values.push_bits(bits));
                let any = attribute(Semantic::Generic, 1, values);
                let quantisation = Quantisation::choose(&any, None, true);
                let again = back(&quantisation, &any);
                let same = (0..any.values.len()).all(|at| any.values.bits(at) == again.values.bits(at));
                prop_assert!(same && again.values.len() == any.values.len(), "{stored:?}");
                prop_assert_eq!(quantisation.error(&any), 0.0);
            }
            for pair in bits.windows(2) {
                let [x, y] = [pair[0], pair[1]].map(|bits| f32::from_bits(bits as u32));
                if x < y {
                    prop_assert!(ordered(x.to_bits()) < ordered(y.to_bits()));
                }
                let [x, y] = [pair[0], pair[1]].map(f64::from_bits);
                if x < y {
                    prop_assert!(halves(ordered_long(x.to_bits()))[0] <= halves(ordered_long(y.to_bits()))[0]);
                }
            }
        }
    }

    #[test]
    fn axes_and_diagonals_are_exact() {
        for bits in [2, 10, 16] {
            for axis in [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]] {
                assert_eq!(direction(octahedral(axis, radius(bits)), radius(bits)), axis);
            }
        }
    }

    #[test]
    fn what_is_chosen() {
        let of = |semantic, components, values| {
            Quantisation::choose(&attribute(semantic, components, Values::F32(values)), None, false)
        };
        assert_eq!(of(Semantic::Normal, 3, vec![0.577, 0.577, 0.577]), Quantisation::Octahedral { bits: 10 });
        assert_eq!(
            of(Semantic::Tangent, 4, vec![1.0, 0.0, 0.0, -1.0]),
            Quantisation::Octahedral { bits: 10 }
        );
        for (semantic, values) in
            [(Semantic::Normal, vec![0.0, 0.0, 0.0]), (Semantic::Tangent, vec![1.0, 0.0, 0.0, 0.0])]
        {
            assert!(matches!(of(semantic, values.len(), values), Quantisation::Lattice { bits: 12, .. }));
        }
        assert!(matches!(of(Semantic::Color, 3, vec![0.5; 3]), Quantisation::Lattice { bits: 10, .. }));
        for strange in [f32::NAN, f32::INFINITY] {
            assert_eq!(of(Semantic::Normal, 3, vec![strange, 0.0, 0.0]), Quantisation::Raw);
        }
        let bytes = attribute(Semantic::Color, 3, Values::U8(vec![1, 2, 3]));
        assert_eq!(Quantisation::choose(&bytes, Some(4), true), Quantisation::Integer);
        let wide = attribute(Semantic::Generic, 1, Values::F64(vec![-f64::MAX, f64::MAX]));
        assert_eq!(Quantisation::choose(&wide, None, false), Quantisation::Raw);
    }

    /// A value that no corner has does not widen the lattice.
    #[test]
    fn only_what_is_used_counts() {
        let mut uv = attribute(Semantic::TexCoord, 1, Values::F32(vec![0.0, 1.0, 1e6]));
        uv.corners[2] = super::super::NO_VALUE;
        let Quantisation::Lattice { step, .. } = Quantisation::choose(&uv, Some(2), false) else { panic!() };
        assert_eq!(step, 1.0 / 3.0);
    }
}
