//! Texture coordinates as other formats have them: in glTF v runs down from a picture's upper edge, in OBJ, and in what is read of other
//! files, up from its lower one.

use crate::mesh::IndexedMesh;
use crate::mesh::attributes::{Attribute, Semantic, Values};

/// Takes 1 - v for v in all texture coordinates of two numbers. Fractions that are integers without a sign stay such, to the last bit; other
/// integers become floating-point numbers.
pub fn turn_v(mesh: &mut IndexedMesh) {
    let is_uv = |a: &&mut Attribute| a.semantic == Semantic::TexCoord && a.components == 2;
    mesh.attributes.iter_mut().filter(is_uv).for_each(turn);
}

/// Whether [`turn_v`] has something to turn.
pub(super) fn has_v(mesh: &IndexedMesh) -> bool {
    mesh.attributes.iter().any(|a| a.semantic == Semantic::TexCoord && a.components == 2)
}

fn turn(attribute: &mut Attribute) {
    let second = |k: usize| k % 2 == 1;
    match (&mut attribute.values, attribute.normalised) {
        (Values::F32(list), _) => list.iter_mut().skip(1).step_by(2).for_each(|v| *v = 1.0 - *v),
        (Values::F64(list), _) => list.iter_mut().skip(1).step_by(2).for_each(|v| *v = 1.0 - *v),
        (Values::U8(list), true) => list.iter_mut().skip(1).step_by(2).for_each(|v| *v = u8::MAX - *v),
        (Values::U16(list), true) => list.iter_mut().skip(1).step_by(2).for_each(|v| *v = u16::MAX - *v),
        (Values::U32(list), true) => list.iter_mut().skip(1).step_by(2).for_each(|v| *v = u32::MAX - *v),
        (values, normalised) => {
            let number = |k: usize| {
                let x = values.fraction(k, normalised);
                if second(k) { 1.0 - x } else { x }
            };
            let numbers: Vec<f64> = (0..values.len()).map(number).collect();
            let is_short = numbers.iter().all(|&x| f64::from(x as f32) == x);
            *values = match is_short || normalised {
                true => Values::F32(numbers.iter().map(|&x| x as f32).collect()),
                false => Values::F64(numbers),
            };
            attribute.normalised = false;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_all_types() {
        let of = |values: Values, normalised: bool| {
            let mut mesh = IndexedMesh::default();
            let uv = Attribute::new(Semantic::TexCoord, 2, values, vec![]);
            mesh.attributes = vec![Attribute { normalised, ..uv }];
            assert!(has_v(&mesh));
            turn_v(&mut mesh);
            (mesh.attributes[0].values.clone(), mesh.attributes[0].normalised)
        };
        assert_eq!(
            of(Values::F32(vec![0.25, 0.25, 3.0, -1.0]), false),
            (Values::F32(vec![0.25, 0.75, 3.0, 2.0]), false)
        );
        assert_eq!(of(Values::F64(vec![0.1, 1.0]), false), (Values::F64(vec![0.1, 0.0]), false));
        assert_eq!(of(Values::U8(vec![1, 2]), true), (Values::U8(vec![1, 253]), true));
        assert_eq!(of(Values::U16(vec![1, 65535]), true), (Values::U16(vec![1, 0]), true));
        assert_eq!(of(Values::I8(vec![127, -127]), true), (Values::F32(vec![1.0, 2.0]), false));
        assert_eq!(of(Values::U16(vec![7, 5]), false), (Values::F32(vec![7.0, -4.0]), false));
        let attributes = vec![Attribute::new(Semantic::TexCoord, 3, Values::U8(vec![1, 2, 3]), vec![])];
        let mut other = IndexedMesh { attributes, ..IndexedMesh::default() };
        let same = other.clone();
        turn_v(&mut other);
        assert!(other == same && !has_v(&other));
    }
}
