//! What a writer knows of attributes.

use super::Known;
use crate::mesh::attributes::{Attribute, Domain, Kind};
use crate::mesh::{Corner, Triangle};
use crate::refine::Labels;
use std::collections::HashMap;

/// The attributes of an input, quantised, by labels: a label of corners stands for one value in each attribute at corners, one of
/// triangles for one in each of triangles.
#[derive(Debug)]
pub struct Truth {
    /// For each column its values, equal ones once, `integers` numbers each.
    values: Vec<Values>,
    /// For each column and each label the value; [`NONE`] where there is none.
    of_label: Vec<Vec<u32>>,
}

#[derive(Debug)]
struct Values {
    integers: usize,
    numbers: Vec<i32>,
}

const NONE: u32 = u32::MAX;

impl Truth {
    /// Quantises attributes of so many triangles. Returned are also the labels of each triangle of the input: of its corners, and its own.
    ///
    /// Labels are told apart by quantised values: what quantisation makes equal is one.
    pub fn new(attributes: &[Attribute], kinds: &[Kind], triangles: usize) -> (Self, Vec<[u32; 4]>) {
        let mut labels = vec![[0u32; 4]; triangles];
        let (mut values, mut classes) = (Vec::new(), Vec::new());
        for (attribute, kind) in attributes.iter().zip(kinds) {
            let (list, of_value) = quantised(attribute, kind);
            values.push(list);
            // Labels so far, parted further by this attribute.
            let mut numbers: HashMap<(u32, u32), u32> = HashMap::new();
            let mut part = |label: &mut u32, value: Option<usize>| {
                let next = numbers.len() as u32;
                let class = value.map_or(NONE, |value| of_value[value]);
                *label = *numbers.entry((*label, class)).or_insert(next);
            };
            for (t, labels) in labels.iter_mut().enumerate() {
                match kind.domain {
                    Domain::Triangle => part(&mut labels[3], attribute.at(t, 0)),
                    Domain::Corner => {
                        let corners = labels[..3].iter_mut().enumerate();
                        corners.for_each(|(k, label)| part(label, attribute.at(t, k)));
                    }
                }
            }
            classes.push(of_value);
        }
        let of_label = attributes.iter().zip(kinds).zip(&classes).map(|((attribute, kind), of_value)| {
            let mut of_label = Vec::new();
            let mut set = |label: u32, value: Option<usize>| {
                if label as usize >= of_label.len() {
                    of_label.resize(label as usize + 1, NONE);
                }
                of_label[label as usize] = value.map_or(NONE, |value| of_value[value]);
            };
            for (t, labels) in labels.iter().enumerate() {
                match kind.domain {
                    Domain::Triangle => set(labels[3], attribute.at(t, 0)),
                    Domain::Corner => (0..3).for_each(|k| set(labels[k], attribute.at(t, k))),
                }
            }
            of_label
        });
        let of_label = of_label.collect();
        (Self { values, of_label }, labels)
    }

    /// The value of a column that a label stands for.
    pub fn value(&self, column: usize, label: u32) -> Option<&[i32]> {
        let Values { integers, numbers } = &self.values[column];
        let class = *self.of_label[column].get(label as usize).filter(|&&class| class != NONE)? as usize;
        numbers.get(class * integers..(class + 1) * integers)
    }
}

/// A mesh whose corners and triangles are labelled.
#[derive(Clone, Copy, Debug)]
pub struct Labelled<'a> {
    /// What labels stand for.
    pub truth: &'a Truth,
    /// Those of the mesh.
    pub labels: &'a Labels,
    /// Those of further triangles.
    pub further: &'a [[u32; 4]],
}

impl Known for Labelled<'_> {
    fn label(&self, c: Corner) -> u32 {
        self.labels.of(c)
    }

    fn of_triangle(&self, t: Triangle) -> u32 {
        self.labels.of_triangle(t)
    }

    fn further(&self, place: usize) -> [u32; 4] {
        self.further[place]
    }

    fn value(&self, column: usize, label: u32) -> Option<&[i32]> {
        self.truth.value(column, label)
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
