//! Attributes of what wedges have become.

use super::build::length;
use super::{Column, Wedges};
use crate::mesh::attributes::{Attribute, Domain, NO_VALUE, Semantic, Values};
use std::collections::HashMap;

impl Wedges {
    /// The attributes of the triangles that are left, from those of the input: values that stay come first, in their order.
    pub(in crate::reduce) fn attributes(&self, given: &[Attribute]) -> Vec<Attribute> {
        let of = |(number, attribute): (usize, &Attribute)| {
            let column = self.columns.iter().find(|column| column.attribute == number);
            match attribute.domain {
                Domain::Triangle => {
                    let corners = self.origins.iter().map(|&t| Named::Old(attribute.corners[t as usize]));
                    written(attribute, corners.collect(), &[])
                }
                Domain::Corner => self.of_corners(attribute, column),
            }
        };
        given.iter().enumerate().map(of).collect()
    }

    fn of_corners(&self, attribute: &Attribute, column: Option<&Column>) -> Attribute {
        let mut corners = Vec::with_capacity(3 * self.corners.len());
        let mut made: HashMap<u32, u32> = HashMap::new();
        let mut numbers = Vec::new();
        for (&origin, &wedges) in self.origins.iter().zip(&self.corners) {
            for (k, wedge) in wedges.into_iter().enumerate() {
                let source = self.sources[wedge as usize] as usize;
                let of_source = attribute.corners[source];
                let is_changed = self.is_changed[wedge as usize];
                let is_first = self.first[origin as usize][k] == wedge;
                let named = match column {
                    _ if !is_changed && is_first => Named::Old(attribute.corners[3 * origin as usize + k]),
                    Some(column) if is_changed && of_source != NO_VALUE => {
                        let next = made.len() as u32;
                        Named::New(*made.entry(wedge).or_insert_with(|| {
                            numbers.extend(self.numbers(attribute, column, wedge, of_source as usize));
                            next
                        }))
                    }
                    _ => Named::Old(of_source),
                };
                corners.push(named);
            }
        }
        written(attribute, corners, &numbers)
    }

    /// The numbers of a wedge as the attribute has them.
    fn numbers(
        &self,
        attribute: &Attribute,
        column: &Column,
        wedge: u32,
        like: usize,
    ) -> impl Iterator<Item = f64> {
        let row = &self.row(wedge)[column.at..column.at + column.components];
        let mut row: Vec<f64> = row.iter().map(|x| x / column.scale).collect();
        // Normals are as long as they were, 1 where they were nearly so; tangents have the length and the side that theirs has.
        let one = attribute.values.stored().one().filter(|_| attribute.normalised).unwrap_or(1.0);
        match attribute.semantic {
            Semantic::Normal => {
                let long = length(attribute, like);
                let long = if (long / one - 1.0).abs() < 0.1 { one } else { long };
                row.iter_mut().for_each(|x| *x *= long);
            }
            Semantic::Tangent if row.len() == 4 => {
                let long = row[..3].iter().map(|x| x * x).sum::<f64>().sqrt();
                if long > 0.0 {
                    row[..3].iter_mut().for_each(|x| *x *= one / long);
                }
                row[3] = attribute.values.number(4 * like + 3);
            }
            _ => {}
        }
        row.into_iter()
    }
}

/// A value of the input, or one of those made.
#[derive(Clone, Copy)]
enum Named {
    Old(u32),
    New(u32),
}

/// An attribute like another one, of other corners; `numbers` are those of the values made.
fn written(like: &Attribute, corners: Vec<Named>, numbers: &[f64]) -> Attribute {
    let n = like.components;
    let mut places = vec![NO_VALUE; like.count()];
    for named in &corners {
        if let Named::Old(value) = named
            && let Some(place) = places.get_mut(*value as usize)
        {
            *place = 0;
        }
    }
    let mut values = Values::new(like.values.stored());
    let mut count = 0;
    for (value, place) in places.iter_mut().enumerate().filter(|(_, place)| **place == 0) {
        *place = count;
        count += 1;
        (value * n..(value + 1) * n).for_each(|at| values.push_bits(like.values.bits(at)));
    }
    numbers.iter().for_each(|&x| values.push(x));
    let number = |named| match named {
        Named::Old(value) => places.get(value as usize).copied().unwrap_or(NO_VALUE),
        Named::New(value) => count + value,
    };
    let corners = corners.into_iter().map(number).collect();
    Attribute { values, corners, name: like.name.clone(), ..*like }
}
