//! The one value of a constant attribute, in its entry (spec §3.3).

use super::fields::Fields;
#[cfg(any(test, feature = "encode"))]
use crate::entropy::varint;
use crate::error::FormatError;
use crate::mesh::attributes::dyadic::Dyadic;
use crate::mesh::attributes::{Quantisation, Stored};

/// Reads the value of an attribute on a lattice: the lattice has but that point.
pub(super) fn lattice(fields: &mut Fields, components: usize) -> Result<Quantisation, FormatError> {
    let at = fields.offset();
    let exponent = signed(fields)?;
    let multiples = list(fields, components)?;
    let origin = Dyadic { exponent, multiples }.numbers();
    let origin = origin
        .ok_or_else(|| fields.fault(at, "a constant is not finite or not in its shortest form".to_owned()))?;
    Ok(Quantisation::Lattice { bits: 1, origin, step: 0.0 })
}

/// Reads the integers of any other.
pub(super) fn integers(
    fields: &mut Fields,
    quantisation: &Quantisation,
    components: usize,
    stored: Stored,
) -> Result<Vec<i32>, FormatError> {
    let count = quantisation.integers(components, stored);
    if matches!(quantisation, Quantisation::Lattice { .. }) {
        Ok(vec![0; count])
    } else {
        list(fields, count)
    }
}

/// Appends what these two read; `None` where it has no form.
#[cfg(any(test, feature = "encode"))]
pub(super) fn write(
    value: &[i32],
    quantisation: &Quantisation,
    components: usize,
    stored: Stored,
    table: &mut Vec<u8>,
) -> Option<()> {
    if value.len() != quantisation.integers(components, stored) {
        return None;
    }
    let mut list = |numbers: &[i32]| {
        let mut before = 0;
        for &number in numbers {
            varint::write(zigzag(number.wrapping_sub(before)).into(), table);
            before = number;
        }
    };
    match quantisation {
        Quantisation::Lattice { origin, step, .. } => {
            let dyadic = Dyadic::of(origin).filter(|_| *step == 0.0 && value.iter().all(|&q| q == 0))?;
            list(&[dyadic.exponent]);
            list(&dyadic.multiples);
        }
        _ => list(value),
    }
    Some(())
}

/// Integers, each told by what it is more than the one before.
fn list(fields: &mut Fields, count: usize) -> Result<Vec<i32>, FormatError> {
    let mut before = 0i32;
    (0..count)
        .map(|_| {
            before = before.wrapping_add(signed(fields)?);
            Ok(before)
        })
        .collect()
}

fn signed(fields: &mut Fields) -> Result<i32, FormatError> {
    let number = fields.count(u32::MAX, "a number of a constant")?;
    Ok((number >> 1) as i32 ^ -((number & 1) as i32))
}

#[cfg(any(test, feature = "encode"))]
fn zigzag(number: i32) -> u32 {
    ((number << 1) ^ (number >> 31)) as u32
}
