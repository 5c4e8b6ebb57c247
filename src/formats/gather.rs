//! Attributes of a mesh as readers find them.

use std::collections::HashMap;

use crate::mesh::IndexedMesh;
use crate::mesh::attributes::{Attribute, Domain, NO_VALUE, Semantic, Values};

/// Attributes, and what of them is not kept.
#[derive(Default)]
pub(super) struct Gathered {
    pub attributes: Vec<Attribute>,
    /// In words for the user.
    pub dropped: Vec<String>,
}

impl Gathered {
    /// Takes an attribute, as [`Gathered::keep`]. Of several of the same semantic each is a set of its own.
    pub(super) fn take(&mut self, mut attribute: Attribute, what: &str) {
        if attribute.semantic != Semantic::Generic {
            let same =
                |other: &&Attribute| (other.semantic, other.domain) == (attribute.semantic, attribute.domain);
            attribute.set = self.attributes.iter().filter(same).count() as u32;
        }
        self.keep(attribute, what);
    }

    /// Takes an attribute of a set that is known, whose values are `what`, a plural. Values that no triangle has are left out, and it is
    /// said; so is what is beyond the most attributes that a file holds.
    pub(super) fn keep(&mut self, mut attribute: Attribute, what: &str) {
        let unused = compact(&mut attribute);
        if unused > 0 {
            self.dropped.push(format!("{what} of no triangle ({unused})"));
        }
        if attribute.values.is_empty() {
            return;
        }
        if self.attributes.len() == MOST {
            self.dropped.push(what.to_owned());
            return;
        }
        self.attributes.push(attribute);
    }

    /// The mesh with what was found.
    pub(super) fn mesh(&mut self, mesh: IndexedMesh) -> IndexedMesh {
        IndexedMesh { attributes: std::mem::take(&mut self.attributes), ..mesh }
    }
}

/// An attribute of corners of which the vertices have the values: value v is that of vertex v, or by a list, that `of_vertex[v]` names.
pub(super) fn of_vertices(
    semantic: Semantic,
    components: usize,
    values: Values,
    of_vertex: Option<&[u32]>,
    triangles: &[[u32; 3]],
) -> Attribute {
    let vertices = triangles.as_flattened().iter();
    let corners = match of_vertex {
        Some(list) => vertices.map(|&v| list.get(v as usize).copied().unwrap_or(NO_VALUE)).collect(),
        None => vertices.copied().collect(),
    };
    Attribute::new(semantic, components, values, corners)
}

/// An attribute of triangles.
pub(super) fn of_triangles(
    semantic: Semantic,
    components: usize,
    values: Values,
    triangles: Vec<u32>,
) -> Attribute {
    Attribute { domain: Domain::Triangle, ..Attribute::new(semantic, components, values, triangles) }
}

/// A number a triangle; those that are [`NO_VALUE`] are none.
pub(super) fn numbers(semantic: Semantic, mut of_triangles: Vec<u32>) -> Attribute {
    let (mut values, mut places) = (Vec::new(), HashMap::new());
    let mut last = (NO_VALUE, NO_VALUE);
    for number in of_triangles.iter_mut().filter(|number| **number != NO_VALUE) {
        if *number != last.0 {
            let place = *places.entry(*number).or_insert_with(|| {
                values.push(*number);
                values.len() as u32 - 1
            });
            last = (*number, place);
        }
        *number = last.1;
    }
    self::of_triangles(semantic, 1, Values::U32(values), of_triangles)
}

/// Leaves out the values that no corner has, and returns how many they were.
fn compact(attribute: &mut Attribute) -> usize {
    let mut numbers = vec![NO_VALUE; attribute.count()];
    for &value in attribute.corners.iter().filter(|&&value| value != NO_VALUE) {
        numbers[value as usize] = 0;
    }
    let unused = numbers.iter().filter(|&&number| number == NO_VALUE).count();
    if unused == 0 {
        return 0;
    }
    let mut values = Values::new(attribute.values.stored());
    let mut count = 0;
    for (value, number) in numbers.iter_mut().enumerate().filter(|(_, number)| **number != NO_VALUE) {
        (*number, count) = (count, count + 1);
        let first = value * attribute.components;
        (first..first + attribute.components).for_each(|at| values.push_bits(attribute.values.bits(at)));
    }
    attribute.values = values;
    for value in attribute.corners.iter_mut().filter(|value| **value != NO_VALUE) {
        *value = numbers[*value as usize];
    }
    unused
}

/// Most attributes of a file (spec §3.3).
pub(super) const MOST: usize = 64;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_that_no_triangle_has_are_left_out() {
        let mut gathered = Gathered::default();
        let values = || Values::I8(vec![1, 2, 3, 4, 5, 6]);
        let of = |semantic, corners| Attribute::new(semantic, 2, values(), corners);
        gathered.take(of(Semantic::TexCoord, vec![2, NO_VALUE, 0]), "places");
        gathered.take(of(Semantic::TexCoord, vec![2, 1, 0]), "more");
        gathered.take(of(Semantic::Color, vec![NO_VALUE; 3]), "nothing");
        assert_eq!(gathered.dropped, ["places of no triangle (1)", "nothing of no triangle (3)"]);
        let [first, second] = &gathered.attributes[..] else { panic!() };
        assert_eq!(
            (&first.values, &first.corners[..]),
            (&Values::I8(vec![1, 2, 5, 6]), &[1, NO_VALUE, 0][..])
        );
        assert_eq!((first.set, second.set), (0, 1));
        assert_eq!((&second.values, &second.corners[..]), (&values(), &[2, 1, 0][..]));
        (2..=MOST).for_each(|_| gathered.take(of(Semantic::Generic, vec![2, 1, 0]), "one more"));
        assert_eq!((gathered.attributes.len(), &gathered.dropped[2][..]), (MOST, "one more"));
    }

    #[test]
    fn numbers_of_triangles() {
        let parts = numbers(Semantic::Part, vec![7, 7, NO_VALUE, 0, 7]);
        assert_eq!((&parts.values, parts.corners), (&Values::U32(vec![7, 0]), vec![0, 0, NO_VALUE, 1, 0]));
    }
}
