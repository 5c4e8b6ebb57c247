//! What a writer knows of the attributes of level 0.

use super::Known;
use crate::mesh::attributes::{Attribute, Domain, Kind};
use std::collections::HashMap;

/// The attributes of level 0, quantised, by the places that it has in the walk.
#[derive(Debug)]
pub struct Truth {
    /// For each triangle of the whole, as the mesh and not the input has it round, what tells the wedges of its corners apart.
    wedges: Vec<[u32; 3]>,
    /// For each column its values, equal ones once, `integers` numbers each.
    values: Vec<Values>,
    /// For each column at corners and each wedge the value; [`NONE`] where there is none.
    of_wedge: Vec<Vec<u32>>,
    /// For each column of triangles and each triangle of the whole the value.
    of_triangle: Vec<Vec<u32>>,
}

#[derive(Debug)]
struct Values {
    integers: usize,
    numbers: Vec<i32>,
}

const NONE: u32 = u32::MAX;

impl Truth {
    /// Quantises attributes. `corners` tells for each corner of the whole, as the mesh has it round, which corner of the input it is: three
    /// times its triangle plus its place in that.
    ///
    /// Wedges are told apart by their quantised values: what quantisation makes equal is one.
    pub fn new(attributes: &[Attribute], kinds: &[Kind], corners: &[[u32; 3]]) -> Self {
        let mut wedges = vec![[0u32; 3]; corners.len()];
        let (mut values, mut of_wedge, mut of_triangle) = (Vec::new(), Vec::new(), Vec::new());
        let mut classes_of = Vec::new();
        for (attribute, kind) in attributes.iter().zip(kinds) {
            let (list, classes) = quantised(attribute, kind);
            values.push(list);
            let class = |corner: u32| {
                let value = attribute.at(corner as usize / 3, corner as usize % 3);
                value.map_or(NONE, |value| classes[value])
            };
            if kind.domain == Domain::Triangle {
                of_triangle.push(corners.iter().map(|c| class(c[0])).collect());
                of_wedge.push(Vec::new());
                classes_of.push(Vec::new());
                continue;
            }
            of_triangle.push(Vec::new());
            of_wedge.push(Vec::new());
            let classes: Vec<[u32; 3]> = corners.iter().map(|c| c.map(class)).collect();
            // Wedges so far, parted further by this attribute.
            let mut numbers: HashMap<(u32, u32), u32> = HashMap::new();
            for (wedge, &class) in wedges.as_flattened_mut().iter_mut().zip(classes.as_flattened()) {
                let next = numbers.len() as u32;
                *wedge = *numbers.entry((*wedge, class)).or_insert(next);
            }
            classes_of.push(classes);
        }
        let count = wedges.as_flattened().iter().max().map_or(0, |&most| most as usize + 1);
        for (of_wedge, classes) in
            of_wedge.iter_mut().zip(&classes_of).filter(|(_, classes)| !classes.is_empty())
        {
            of_wedge.resize(count, NONE);
            for (&wedge, &class) in wedges.as_flattened().iter().zip(classes.as_flattened()) {
                of_wedge[wedge as usize] = class;
            }
        }
        Self { wedges, values, of_wedge, of_triangle }
    }

    fn at(&self, column: usize, class: Option<&u32>) -> Option<&[i32]> {
        let Values { integers, numbers } = &self.values[column];
        let class = *class.filter(|&&class| class != NONE)? as usize;
        numbers.get(class * integers..(class + 1) * integers)
    }
}

impl Known for Truth {
    fn wedge(&self, place: usize, k: usize) -> u32 {
        self.wedges[place][k]
    }

    fn value(&self, column: usize, wedge: u32) -> Option<&[i32]> {
        self.at(column, self.of_wedge[column].get(wedge as usize))
    }

    fn of_triangle(&self, column: usize, place: usize) -> Option<&[i32]> {
        self.at(column, self.of_triangle[column].get(place))
    }
}

/// The values of an attribute, equal ones once, and for each of its values which of these it is.
fn quantised(attribute: &Attribute, kind: &Kind) -> (Values, Vec<u32>) {
    let integers = kind.integers();
    let mut numbers = Vec::new();
    let mut places: HashMap<Vec<i32>, u32> = HashMap::new();
    let mut classes = Vec::with_capacity(attribute.count());
    let mut value = Vec::with_capacity(integers);
    for k in 0..attribute.count() {
        value.clear();
        kind.quantisation.quantise(attribute, k, &mut value);
        let class = match places.get(&value) {
            Some(&class) => class,
            None => {
                let class = places.len() as u32;
                numbers.extend_from_slice(&value);
                places.insert(value.clone(), class);
                class
            }
        };
        classes.push(class);
    }
    (Values { integers, numbers }, classes)
}
