//! Errors of levels as numbers of 16 bits, rounded up: what was a bound stays one (spec §3.3).

/// The largest code: that of the largest finite number. 0 is 0, and a larger code is a larger number.
pub(super) const MAX_CODE: u16 = 0x7F7F;

/// How much smaller a code is expected to be than that of the level before: a level has some three quarters of its error.
pub(super) const FALL: i32 = 48;

/// What errors are counted in: steps of the lattice; units of the input where all positions coincide.
pub(super) fn unit(step: f64) -> f64 {
    if step > 0.0 { step } else { 1.0 }
}

/// The error of a code: the upper half of a binary32 number, times `unit`.
pub(super) fn value(code: u16, unit: f64) -> f64 {
    f64::from(f32::from_bits(u32::from(code) << 16)) * unit
}

/// The smallest code whose error is not below `error`; `None` where there is none: below 0, not a number, too large.
#[cfg(any(test, feature = "encode"))]
pub(super) fn code(error: f64, unit: f64) -> Option<u16> {
    // A guess that the quotient's rounding may have moved by one either way.
    let mut code = ((((error / unit) as f32).to_bits() >> 16) as u16).min(MAX_CODE);
    while code > 0 && value(code - 1, unit) >= error {
        code -= 1;
    }
    while code < MAX_CODE && value(code, unit) < error {
        code += 1;
    }
    (error >= 0.0 && error <= value(code, unit)).then_some(code)
}

/// A code as the table has it behind that of the level before.
#[cfg(any(test, feature = "encode"))]
pub(super) fn difference(code: u16, before: u16) -> u64 {
    let difference = i32::from(code) - (i32::from(before) - FALL);
    u64::from(((difference << 1) ^ (difference >> 31)) as u32)
}

/// The inverse of [`difference`]; `None` where there is no such code.
pub(super) fn behind(before: u16, difference: u32) -> Option<u16> {
    let difference = (difference >> 1) as i32 ^ -((difference & 1) as i32);
    let code = (i32::from(before) - FALL).checked_add(difference)?;
    u16::try_from(code).ok().filter(|&code| code <= MAX_CODE)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn known_codes() {
        let codes = [
            (0.0, 0),
            (-0.0, 0),
            (1.0, 0x3F80),
            (1.0 + 1e-15, 0x3F81),
            (1.0078125, 0x3F81),
            (0.5, 0x3F00),
            (100.0, 0x42C8),
            // The smallest numbers: the first subnormal one, the first normal one and what lies beside them.
            (f64::from_bits(1), 1),
            (2f64.powi(-133), 1),
            (2f64.powi(-133) * 1.0001, 2),
            (f64::from(f32::MIN_POSITIVE) * 0.9999, 0x80),
            (f64::from(f32::MIN_POSITIVE), 0x80),
            (f64::from(f32::MIN_POSITIVE) * 1.0001, 0x81),
            // The largest ones.
            (255.0 * 2f64.powi(120), MAX_CODE),
            (254.5 * 2f64.powi(120), MAX_CODE),
        ];
        for (error, expected) in codes {
            assert_eq!(code(error, 1.0), Some(expected), "{error:e}");
        }
        for none in [-1.0, -f64::from_bits(1), f64::NAN, f64::INFINITY, 255.01 * 2f64.powi(120), f64::MAX] {
            assert_eq!(code(none, 1.0), None, "{none:e}");
        }
        assert_eq!([unit(0.25), unit(0.0)], [0.25, 1.0]);
    }

    #[test]
    fn what_follows_a_code() {
        assert_eq!(
            [difference(1000 - 48, 1000), difference(1000, 1000), difference(900, 1000)],
            [0, 96, 103]
        );
        assert_eq!(
            [behind(1000, 0), behind(1000, 96), behind(1000, 103)],
            [Some(952), Some(1000), Some(900)]
        );
        assert_eq!(
            [behind(0, 96), behind(0, 94), behind(MAX_CODE, 96), behind(MAX_CODE, 98)],
            [Some(0), None, Some(MAX_CODE), None]
        );
        assert_eq!([behind(0, u32::MAX), behind(0, u32::MAX - 1), behind(MAX_CODE, u32::MAX - 1)], [None; 3]);
    }

    proptest! {
        /// Never below, and no code less would do.
        #[test]
        fn codes_round_up(bits: u64, unit in prop_oneof![Just(1.0), 1e-300..1e-290f64, 1e-9..1e9f64, 1e250..1e260f64]) {
            let error = f64::from_bits(bits >> 1);
            match code(error, unit) {
                Some(code) => {
                    prop_assert!(value(code, unit) >= error && value(code, unit).is_finite());
                    prop_assert!(code == 0 || value(code - 1, unit) < error);
                    prop_assert_eq!(code == 0, error == 0.0);
                }
                None => prop_assert!(error.is_nan() || error > value(MAX_CODE, unit)),
            }
        }

        /// What errors are: a relative 2^-7 above at most, as long as they are no subnormal numbers.
        #[test]
        fn codes_are_close(error in 1e-30..1e30f64, unit in 1e-3..1e3f64) {
            let coded = value(code(error, unit).unwrap(), unit);
            prop_assert!((error..=error * (1.0 + 1.0 / 128.0)).contains(&coded));
        }

        #[test]
        fn all_codes_come_back(code in 0..=MAX_CODE, before in 0..=MAX_CODE, step in 1e-9..1e9f64) {
            prop_assert_eq!(super::code(value(code, step), step), Some(code));
            prop_assert_eq!(behind(before, difference(code, before) as u32), Some(code));
        }
    }
}
