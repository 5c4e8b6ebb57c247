//! Attributes of which all corners, or triangles, have one value: the table of contents tells it.

use crate::container::AttributeEntry;
use crate::mesh::attributes::dyadic::Dyadic;
use crate::mesh::attributes::{Attribute, NO_VALUE, Quantisation};

/// What the table of contents says of an attribute that `quantisation` makes constant; `None` where it does not.
///
/// Nothing of floating-point numbers is lost where all that is said, but for a name, takes [`MOST_BYTES`], or where the quantisation loses
/// nothing; else `bits` of a number are kept.
pub fn entry(attribute: &Attribute, quantisation: &Quantisation, bits: u32) -> Option<AttributeEntry> {
    let (first, value) = one_value(attribute, quantisation)?;
    let told = |quantisation: Quantisation, value: Vec<i32>| {
        let error = quantisation.error(attribute);
        AttributeEntry { constant: Some(value), ..AttributeEntry::of(attribute, quantisation, error) }
    };
    let n = attribute.components;
    let on_lattice = |numbers: Option<Dyadic>| {
        let quantisation = Quantisation::Lattice { bits, origin: numbers?.numbers()?, step: 0.0 };
        Some(told(quantisation, vec![0; n]))
    };
    let numbers = match quantisation {
        Quantisation::Integer | Quantisation::Octahedral { .. } => {
            return Some(told(quantisation.clone(), value));
        }
        Quantisation::Lattice { step, .. } if *step > 0.0 => return None,
        Quantisation::Lattice { origin, .. } => origin.clone(),
        Quantisation::Raw => (0..n).map(|k| attribute.values.number(n * first + k)).collect(),
    };
    let mut raw = Vec::new();
    Quantisation::Raw.quantise(attribute, first, &mut raw);
    let bytes = |entry: &AttributeEntry| entry.table_bytes().unwrap_or(usize::MAX);
    let exact = [on_lattice(Dyadic::of(&numbers)), Some(told(Quantisation::Raw, raw))];
    let exact = exact.into_iter().flatten().min_by_key(bytes)?;
    if *quantisation == Quantisation::Raw || bytes(&exact) <= MOST_BYTES + attribute.name.len() {
        return Some(exact);
    }
    let rounded = on_lattice(Dyadic::rounded(&numbers, bits));
    Some(rounded.into_iter().find(|rounded| bytes(rounded) < bytes(&exact)).unwrap_or(exact))
}

/// The value that all have, where they have one and the same: its place, and its integers.
fn one_value(attribute: &Attribute, quantisation: &Quantisation) -> Option<(usize, Vec<i32>)> {
    let first = *attribute.corners.first().filter(|&&first| first != NO_VALUE)?;
    let mut value = Vec::new();
    quantisation.quantise(attribute, first as usize, &mut value);
    let (mut other, mut last) = (Vec::new(), first);
    for &at in &attribute.corners {
        if at == NO_VALUE {
            return None;
        }
        if at != last {
            other.clear();
            quantisation.quantise(attribute, at as usize, &mut other);
            if other != value {
                return None;
            }
            last = at;
        }
    }
    Some((first as usize, value))
}

/// What a constant takes at most where numbers may be rounded.
const MOST_BYTES: usize = 16;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::attributes::{Domain, Semantic, Stored, Values};

    fn of(attribute: &Attribute, exact: bool) -> Option<AttributeEntry> {
        entry(attribute, &Quantisation::choose(attribute, None, exact), 10)
    }

    fn color(components: usize, values: Values) -> Attribute {
        Attribute::new(Semantic::Color, components, values, vec![0; 6])
    }

    /// What comes back of it.
    fn back(entry: &AttributeEntry) -> Values {
        let mut values = Values::new(entry.stored);
        entry.quantisation.value(entry.constant.as_ref().unwrap(), entry.components, &mut values);
        values
    }

    #[test]
    fn what_it_takes() {
        // Bytes, and whether the values come back to their bits.
        let told = |values: Values, exact: bool| {
            let color = color(values.len(), values);
            let entry = of(&color, exact).unwrap();
            (entry.table_bytes().unwrap(), back(&entry) == color.values && entry.error == 0.0)
        };
        for exact in [false, true] {
            assert_eq!(told(Values::U8(vec![255; 4]), exact), (10, true));
            assert_eq!(told(Values::U8(vec![255, 0, 255, 0]), exact), (13, true));
            assert_eq!(told(Values::U16(vec![65535; 4]), exact), (11, true));
            assert_eq!(told(Values::F32(vec![1.0; 4]), exact), (12, true));
            assert_eq!(told(Values::F32(vec![0.25, 0.5, 0.75, 1.0]), exact), (12, true));
        }
        let odd_ones = vec![204.0 / 255.0, 102.0 / 255.0, 51.0 / 255.0, 254.0 / 255.0];
        assert_eq!(told(Values::F32(odd_ones.clone()), false), (16, false));
        assert_eq!(told(Values::F32(odd_ones.clone()), true), (22, true));
        let rounded = of(&color(4, Values::F32(odd_ones.clone())), false).unwrap();
        for (x, y) in odd_ones.iter().zip([819.0, 410.0, 205.0, 1020.0]) {
            assert!((f64::from(*x) - y / 1024.0).abs() <= 1.0 / 2048.0);
        }
        assert_eq!(back(&rounded), Values::F32([819.0, 410.0, 205.0, 1020.0].map(|x| x / 1024.0).to_vec()));
        assert!(rounded.error > 0.0 && rounded.error < 4f64.sqrt() / 2048.0);
        // What is no multiple of a power of two, or not finite, to its bits.
        for odd in [-0.0, f32::NAN, f32::INFINITY, f32::from_bits(1)] {
            let color = color(3, Values::F32(vec![odd, 0.5, 0.5]));
            let entry = of(&color, true).unwrap();
            assert!((0..3).all(|k| back(&entry).bits(k) == color.values.bits(k)), "{odd}");
        }
        assert!(told(Values::F64(vec![0.1, 0.2]), true).1);
    }

    #[test]
    fn what_is_constant() {
        let mut many = color(1, Values::U8(vec![7, 8, 7]));
        assert!(of(&many, false).is_some(), "a value that none has does not count");
        many.corners = vec![0, 2, 0, 2, 2, 2];
        assert_eq!(of(&many, false).unwrap().constant, Some(vec![7]));
        many.corners[4] = 1;
        assert_eq!(of(&many, false), None);
        many.corners[4] = NO_VALUE;
        assert_eq!(of(&many, false), None, "some have none");
        let parts = Attribute::parts(&[3, 3]);
        let entry = of(&parts, false).unwrap();
        assert_eq!(
            (entry.domain, entry.stored, entry.constant),
            (Domain::Triangle, Stored::U32, Some(vec![3]))
        );
        // Normals that quantisation makes one.
        let flat = Values::F32(vec![0.0, 0.0, 1.0, 1e-5, 0.0, 1.0]);
        let normals = Attribute::new(Semantic::Normal, 3, flat, vec![0, 1, 0]);
        assert_eq!(of(&normals, false).unwrap().constant, Some(vec![0, 0]));
        assert_eq!(of(&normals, true), None);
        let close = color(1, Values::F32(vec![1.0, 1.0 + 1e-6]));
        let close = Attribute { corners: vec![0, 1, 0], ..close };
        assert_eq!(of(&close, false), None, "a lattice tells apart what differs");
    }
}
