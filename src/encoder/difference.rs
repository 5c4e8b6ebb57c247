//! How far two values of an attribute are apart (spec §3.3).

use crate::container::AttributeEntry;
use crate::mesh::Attribute;
use crate::mesh::attributes::{Domain, Quantisation, Semantic, Stored, quantise};

/// The numbers of a value; those beyond its components are 0.
pub type Numbers = [f64; Attribute::MAX_COMPONENTS];

/// What an attribute's values are to be compared by.
#[derive(Clone, Copy, Debug)]
pub struct Difference<'a> {
    entry: &'a AttributeEntry,
    /// The largest integer, where integers stand for fractions.
    whole: Option<f64>,
}

impl<'a> Difference<'a> {
    /// That of an attribute.
    pub fn new(entry: &'a AttributeEntry) -> Self {
        Self { entry, whole: entry.stored.one().filter(|_| entry.normalised) }
    }

    /// What has the values.
    pub fn domain(&self) -> Domain {
        self.entry.domain
    }

    /// A value of the input.
    pub fn of_input(&self, attribute: &Attribute, value: usize) -> Numbers {
        let n = self.entry.components;
        self.numbers(|k| attribute.values.number(value * n + k))
    }

    /// What comes back of the integers of a value (spec §13.2).
    pub fn of_integers(&self, q: &[i32]) -> Numbers {
        match &self.entry.quantisation {
            Quantisation::Integer => self.numbers(|k| match self.entry.stored {
                Stored::U8 => (q[k] as u8).into(),
                Stored::I8 => (q[k] as i8).into(),
                Stored::U16 => (q[k] as u16).into(),
                Stored::I16 => (q[k] as i16).into(),
                Stored::U32 => (q[k] as u32).into(),
                _ => q[k].into(),
            }),
            Quantisation::Lattice { origin, step, .. } => {
                self.numbers(|k| origin[k] + step * f64::from(q[k]))
            }
            Quantisation::Octahedral { bits } => {
                let [x, y, z] = quantise::direction([q[0], q[1]], quantise::radius(*bits));
                self.numbers(|k| [x, y, z].get(k).copied().unwrap_or(0.0))
            }
            Quantisation::Raw if self.entry.stored == Stored::F64 => {
                self.numbers(|k| quantise::long([q[2 * k], q[2 * k + 1]]))
            }
            Quantisation::Raw => self.numbers(|k| quantise::short(q[k]).into()),
        }
    }

    fn numbers(&self, number: impl Fn(usize) -> f64) -> Numbers {
        let mut numbers = [0.0; Attribute::MAX_COMPONENTS];
        for (k, x) in numbers.iter_mut().enumerate().take(self.entry.components) {
            *x = match self.whole {
                Some(whole) => (number(k) / whole).max(-1.0),
                None => number(k),
            };
        }
        numbers
    }

    /// The value between those of the corners of a triangle.
    pub fn between(&self, corners: &[Numbers; 3], shares: [f64; 3]) -> Numbers {
        let mut numbers = [0.0; Attribute::MAX_COMPONENTS];
        for (k, x) in numbers.iter_mut().enumerate().take(self.entry.components) {
            *x = shares[0] * corners[0][k] + shares[1] * corners[1][k] + shares[2] * corners[2][k];
        }
        numbers
    }

    /// The difference of two values; `None` where there is none that is a number.
    pub fn of(&self, a: &Numbers, b: &Numbers) -> Option<f64> {
        let difference = if self.entry.semantic == Semantic::Part {
            f64::from(u8::from(a[0] != b[0]))
        } else if self.entry.is_of_directions() {
            angle([a[0], a[1], a[2]], [b[0], b[1], b[2]])?
        } else {
            let squares = a.iter().zip(b).take(self.entry.components).map(|(x, y)| (x - y) * (x - y));
            squares.sum::<f64>().sqrt()
        };
        difference.is_finite().then_some(difference)
    }
}

/// The angle between two vectors, in degrees; `None` where one has no length. The same on all machines: without a library's functions.
fn angle(a: [f64; 3], b: [f64; 3]) -> Option<f64> {
    let unit = |v: [f64; 3]| {
        let most = v.iter().fold(0.0f64, |most, x| most.max(x.abs()));
        let v = v.map(|x| x / most);
        let length = (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
        (most > 0.0 && length.is_finite()).then(|| v.map(|x| x / length))
    };
    let (a, b) = (unit(a)?, unit(b)?);
    let length = |v: [f64; 3]| (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
    // The sides of a rhombus: its diagonals are as the tangent of half the angle (Kahan 2006).
    let (apart, along) = (length([0, 1, 2].map(|k| a[k] - b[k])), length([0, 1, 2].map(|k| a[k] + b[k])));
    let half =
        if apart <= along { arc(apart / along) } else { std::f64::consts::FRAC_PI_2 - arc(along / apart) };
    Some(half * (360.0 / std::f64::consts::PI))
}

/// The arc tangent of 0 to 1, to nine digits: that of a quarter of the angle, by its series.
fn arc(tangent: f64) -> f64 {
    let halved = |t: f64| t / (1.0 + (1.0 + t * t).sqrt());
    let t = halved(halved(tangent));
    let s = t * t;
    4.0 * t * (1.0 - s * (1.0 / 3.0 - s * (1.0 / 5.0 - s * (1.0 / 7.0 - s * (1.0 / 9.0 - s / 11.0)))))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::attributes::Values;
    use proptest::prelude::*;

    fn entry(
        semantic: Semantic,
        components: usize,
        values: Values,
        bits: Option<u32>,
    ) -> (AttributeEntry, Attribute) {
        let count = (values.len() / components) as u32;
        let attribute = Attribute::new(semantic, components, values, (0..count).collect());
        let quantisation = Quantisation::choose(&attribute, bits, bits.is_none());
        (AttributeEntry::of(&attribute, quantisation, 0.0), attribute)
    }

    fn differences(
        entry: &AttributeEntry,
        attribute: &Attribute,
        pairs: &[(usize, usize)],
    ) -> Vec<Option<f64>> {
        let difference = Difference::new(entry);
        let of = |&(a, b): &(usize, usize)| {
            let [a, b] = [a, b].map(|k| difference.of_input(attribute, k));
            difference.of(&a, &b)
        };
        pairs.iter().map(of).collect()
    }

    #[test]
    fn each_kind_has_its_own() {
        let all = [(0, 1), (0, 0)];
        let (uv, of) = entry(Semantic::TexCoord, 2, Values::F32(vec![0.0, 0.0, 3.0, 4.0]), Some(12));
        assert_eq!(differences(&uv, &of, &all), [Some(5.0), Some(0.0)]);
        let (color, of) = entry(Semantic::Color, 3, Values::U8(vec![0, 255, 7, 51, 255, 7]), None);
        assert_eq!(differences(&color, &of, &all), [Some(51.0), Some(0.0)]);
        let color = AttributeEntry { normalised: true, ..color };
        assert_eq!(differences(&color, &of, &all), [Some(0.2), Some(0.0)]);
        // -128 stands for -1, as -127 does.
        let (small, of) = entry(Semantic::Generic, 1, Values::I8(vec![-128, -127, 127]), None);
        let small = AttributeEntry { normalised: true, ..small };
        assert_eq!(differences(&small, &of, &[(0, 1), (1, 2)]), [Some(0.0), Some(2.0)]);
        let (part, of) = entry(Semantic::Part, 1, Values::U32(vec![3, 9]), None);
        let part = AttributeEntry { domain: Domain::Triangle, ..part };
        assert_eq!(differences(&part, &of, &all), [Some(1.0), Some(0.0)]);
        let nothing = vec![0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 2.0];
        let (normal, of) = entry(Semantic::Normal, 3, Values::F64(nothing), None);
        let found = differences(&normal, &of, &[(0, 1), (1, 2), (2, 2)]);
        assert_eq!((found[0], found[2]), (None, Some(0.0)));
        assert!((found[1].unwrap() - 90.0).abs() < 1e-6);
        let (raw, of) =
            entry(Semantic::Generic, 1, Values::F64(vec![f64::NAN, 1.0, f64::MAX, -f64::MAX]), None);
        assert_eq!(differences(&raw, &of, &[(0, 1), (2, 3), (1, 1)]), [None, None, Some(0.0)]);
    }

    /// The side of a tangent is no part of its direction.
    #[test]
    fn tangents_are_compared_by_direction() {
        let (tangent, of) =
            entry(Semantic::Tangent, 4, Values::F32(vec![0.0, 1.0, 0.0, 1.0, 0.0, 1.0, 0.0, -1.0]), Some(10));
        assert_eq!(differences(&tangent, &of, &[(0, 1)]), [Some(0.0)]);
    }

    #[test]
    fn a_value_between() {
        let (uv, of) = entry(Semantic::TexCoord, 2, Values::F32(vec![0.0, 0.0, 4.0, 0.0, 0.0, 8.0]), None);
        let difference = Difference::new(&uv);
        let corners = [0, 1, 2].map(|k| difference.of_input(&of, k));
        assert_eq!(difference.between(&corners, [0.5, 0.25, 0.25])[..3], [1.0, 2.0, 0.0]);
    }

    proptest! {
        #[test]
        fn angles_are_those_of_the_library(a: [f64; 3], b: [f64; 3], turn in 0.0..180.0f64) {
            let length = |v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
            if (1e-100..1e100).contains(&length(a)) && (1e-100..1e100).contains(&length(b)) {
                let [a, b] = [a, b].map(|v| v.map(|x| x / length(v)));
                let apart = length([0, 1, 2].map(|k| a[k] - b[k]));
                let expected = 2.0 * (apart / 2.0).min(1.0).asin().to_degrees();
                // The arc sine has half of the digits near a right angle.
                prop_assert!((angle(a, b).unwrap() - expected).abs() < 1e-5);
            }
            let (s, c) = turn.to_radians().sin_cos();
            let found = angle([0.0, 1e-300, 0.0], [s * 1e200, c * 1e200, 0.0]).unwrap();
            prop_assert!((found - turn).abs() < 1e-6, "{turn}: {found}");
        }

        /// What comes back of a value's integers is what a decoder makes of them.
        #[test]
        fn integers_come_back_as_a_decoder_has_them(
            numbers in prop::collection::vec(-1.0..1.0f64, 12),
            kind in 0usize..7,
            bits in 4u32..16,
        ) {
            let floats = Values::F64(numbers.clone());
            let shorts = Values::F32(numbers.iter().map(|&x| x as f32).collect());
            let unit: Vec<f64> = numbers.chunks(3).flat_map(|v| {
                let length = v.iter().map(|x| x * x).sum::<f64>().sqrt().max(1e-9);
                v.iter().map(move |x| x / length).collect::<Vec<_>>()
            }).collect();
            let (entry, attribute) = match kind {
                0 => entry(Semantic::TexCoord, 2, floats, Some(bits)),
                1 => entry(Semantic::Generic, 3, floats, None),
                2 => entry(Semantic::Generic, 4, shorts, None),
                3 => entry(Semantic::Normal, 3, Values::F64(unit), Some(bits)),
                4 => entry(Semantic::Color, 4, Values::U8(numbers.iter().map(|x| (x * 255.0) as i32 as u8).collect()), None),
                5 => entry(Semantic::Generic, 1, Values::I16(numbers.iter().map(|x| (x * 32767.0) as i16).collect()), None),
                _ => entry(Semantic::Generic, 2, Values::U32(numbers.iter().map(|x| (x.abs() * 4e9) as u32).collect()), None),
            };
            let difference = Difference::new(&entry);
            for value in 0..attribute.count() {
                let mut integers = Vec::new();
                entry.quantisation.quantise(&attribute, value, &mut integers);
                let mut back = Values::new(entry.stored);
                entry.quantisation.value(&integers, entry.components, &mut back);
                let found = difference.of_integers(&integers);
                for (k, found) in found.iter().enumerate().take(entry.components) {
                    prop_assert!((found - back.number(k)).abs() < 1e-12 * back.number(k).abs().max(1.0));
                }
            }
        }
    }
}
