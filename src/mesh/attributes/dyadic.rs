//! Numbers as multiples of one power of two: what the one value of a constant attribute is told by (spec §3.3).

/// Numbers without a last bit lost: `multiples[k] * 2^exponent`. The exponent is the largest that does; 0 where all numbers are 0.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Dyadic {
    /// Of the power of two; in [`Dyadic::EXPONENTS`].
    pub exponent: i32,
    /// One a number.
    pub multiples: Vec<i32>,
}

impl Dyadic {
    /// Those of the powers of two that binary64 has with all its bits.
    pub const EXPONENTS: std::ops::RangeInclusive<i32> = -1022..=1023;

    /// `None` where numbers are not finite, are -0, or too small or too far apart.
    pub fn of(numbers: &[f64]) -> Option<Self> {
        if numbers.iter().any(|x| !x.is_finite() || (*x == 0.0 && x.is_sign_negative())) {
            return None;
        }
        let exponent = numbers.iter().filter(|&&x| x != 0.0).map(|&x| last_place(x)).min().unwrap_or(0);
        let unit = power(exponent)?;
        let multiple = |&x: &f64| {
            let multiple = x / unit;
            (f64::from(i32::MIN)..=f64::from(i32::MAX)).contains(&multiple).then_some(multiple as i32)
        };
        Some(Self { exponent, multiples: numbers.iter().map(multiple).collect::<Option<_>>()? })
    }

    /// The numbers; `None` where one of them is not finite, or they have another exponent.
    pub fn numbers(&self) -> Option<Vec<f64>> {
        let unit = power(self.exponent)?;
        let numbers: Vec<f64> = self.multiples.iter().map(|&multiple| f64::from(multiple) * unit).collect();
        (Self::of(&numbers).as_ref() == Some(self)).then_some(numbers)
    }

    /// The numbers nearest to these of which each is a multiple of a power of two, less than 2^`bits` of it or just as many.
    #[cfg(any(test, feature = "encode"))]
    pub fn rounded(numbers: &[f64], bits: u32) -> Option<Self> {
        let most = numbers.iter().map(|x| x.abs()).fold(0.0, f64::max);
        if most == 0.0 {
            return Self::of(&vec![0.0; numbers.len()]);
        }
        let above = (most.to_bits() >> 52) as i32 - 1023 + 1;
        let unit = power(above - bits as i32)?;
        let round = |&x: &f64| (x / unit + 0.5).floor() * unit + 0.0;
        Self::of(&numbers.iter().map(round).collect::<Vec<_>>())
    }
}

/// The exponent of the lowest bit of a number that is set; it is finite and not 0.
fn last_place(x: f64) -> i32 {
    let (exponent, fraction) = ((x.to_bits() >> 52) as i32 & 0x7FF, x.to_bits() & ((1 << 52) - 1));
    let (mantissa, exponent) = if exponent == 0 { (fraction, 1) } else { (fraction | 1 << 52, exponent) };
    exponent - 1075 + mantissa.trailing_zeros() as i32
}

/// 2 to the power of `exponent`.
fn power(exponent: i32) -> Option<f64> {
    Dyadic::EXPONENTS.contains(&exponent).then(|| f64::from_bits(((exponent + 1023) as u64) << 52))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn known_numbers() {
        let of = |numbers: &[f64]| Dyadic::of(numbers).map(|it| (it.exponent, it.multiples));
        assert_eq!(of(&[1.0, 0.5, -0.75]), Some((-2, vec![4, 2, -3])));
        assert_eq!(of(&[0.0, 0.0]), Some((0, vec![0, 0])));
        assert_eq!(of(&[]), Some((0, vec![])));
        assert_eq!(of(&[2f64.powi(1023), 0.0]), Some((1023, vec![1, 0])));
        assert_eq!(of(&[f64::from(i32::MAX), 1.0]), Some((0, vec![i32::MAX, 1])));
        for none in
            [&[-0.0][..], &[f64::NAN], &[f64::INFINITY], &[2f64.powi(31) + 1.0], &[f64::MIN_POSITIVE / 2.0]]
        {
            assert_eq!(of(none), None, "{none:?}");
        }
        let told = |exponent, multiples: &[i32]| Dyadic { exponent, multiples: multiples.to_vec() }.numbers();
        assert_eq!(told(-1, &[1, 4]), Some(vec![0.5, 2.0]));
        // Another exponent would do; beyond all numbers.
        assert_eq!(
            [told(0, &[2, 4]), told(1, &[0]), told(1023, &[5]), told(1024, &[1])],
            [const { None }; 4]
        );
        let rounded = |numbers: &[f64], bits| Dyadic::rounded(numbers, bits).and_then(|it| it.numbers());
        assert_eq!(rounded(&[0.8, -0.3], 10), Some(vec![819.0 / 1024.0, -307.0 / 1024.0]));
        assert_eq!(rounded(&[0.9999, 0.0], 10), Some(vec![1.0, 0.0]));
        assert_eq!(rounded(&[0.0, -0.0], 10), Some(vec![0.0, 0.0]));
        assert_eq!(rounded(&[5.0, -0.1], 2), Some(vec![6.0, 0.0]));
    }

    proptest! {
        #[test]
        fn they_come_back(numbers in prop::collection::vec(prop::num::f64::ANY, 1..5), bits in 1u32..25) {
            if let Some(it) = Dyadic::of(&numbers) {
                prop_assert_eq!(it.numbers(), Some(numbers.clone()));
            }
            let small: Vec<f64> = numbers.iter().map(|x| x % 1e6).collect();
            if let Some(it) = Dyadic::rounded(&small, bits).filter(|_| small.iter().all(|x| x.is_finite())) {
                let most = small.iter().map(|x| x.abs()).fold(0.0, f64::max);
                for (x, y) in small.iter().zip(it.numbers().unwrap()) {
                    prop_assert!((x - y).abs() * f64::from(1u32 << bits) <= most, "{x} {y}");
                }
            }
        }
    }
}
