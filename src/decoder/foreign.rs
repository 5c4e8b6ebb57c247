//! Attributes as a source has them, made of those that a file has.

use crate::codec::attributes::{Attributes, Column};
use crate::codec::order::Origin;
use crate::container::AttributeEntry;
use crate::mesh::Attribute;
use crate::mesh::attributes::{Domain, NO_VALUE, Values};
use std::collections::HashMap;

/// Where the corners of the mesh that is handed out are.
pub struct Corners<'a> {
    /// For each corner of the whole its wedge.
    pub of_wedges: Vec<[u32; 3]>,
    /// For each triangle of the whole its row.
    pub rows: Vec<u32>,
    /// Which triangles of the whole the mesh has, and from which corner on, where it has not all in their order.
    pub origins: Option<&'a [Origin]>,
}

impl Corners<'_> {
    /// For each triangle of the mesh its place in the whole, and the corner there at which it begins.
    fn triangles(&self) -> impl Iterator<Item = Origin> + '_ {
        let count = self.origins.map_or(self.of_wedges.len(), <[Origin]>::len);
        (0..count).map(|t| self.origins.map_or((t as u32, 0), |origins| origins[t]))
    }
}

/// One attribute. Equal values are one, in the order in which wedges or rows have them; those of wedges that no corner names any more, too.
pub fn attribute(entry: &AttributeEntry, column: &Column, corners: &Corners) -> Attribute {
    let mut values = Values::new(entry.stored);
    if let Some(value) = &column.kind.constant {
        entry.quantisation.value(value, entry.components, &mut values);
        let count = corners.triangles().count();
        let count = if entry.domain == Domain::Triangle { count } else { 3 * count };
        return of_source(entry, values, vec![0; count]);
    }
    let mut places: HashMap<&[i32], u32> = HashMap::new();
    let mut of = Vec::with_capacity(column.count());
    for at in 0..column.count() as u32 {
        let Some(value) = column.value(at) else {
            of.push(NO_VALUE);
            continue;
        };
        let next = places.len() as u32;
        let place = *places.entry(value).or_insert(next);
        if place == next {
            entry.quantisation.value(value, entry.components, &mut values);
        }
        of.push(place);
    }
    let indices = match entry.domain {
        Domain::Triangle => {
            corners.triangles().map(|(place, _)| named(&of, corners.rows[place as usize])).collect()
        }
        Domain::Corner => {
            let turned = |(place, first): Origin| {
                let mut wedges = corners.of_wedges[place as usize];
                wedges.rotate_left(first as usize);
                wedges
            };
            corners.triangles().flat_map(turned).map(|wedge| named(&of, wedge)).collect()
        }
    };
    of_source(entry, values, indices)
}

fn of_source(entry: &AttributeEntry, values: Values, corners: Vec<u32>) -> Attribute {
    let AttributeEntry { semantic, set, domain, components, normalised, .. } = *entry;
    Attribute { semantic, set, name: entry.name.clone(), domain, components, normalised, values, corners }
}

/// The value of a wedge or row; none of what is behind the last value.
fn named(of: &[u32], at: u32) -> u32 {
    of.get(at as usize).copied().unwrap_or(NO_VALUE)
}

/// Bytes that it takes to make all of them, for so many triangles.
pub fn bytes(attributes: &Attributes, triangles: usize) -> usize {
    let of_column = |column: &Column| {
        let value = 8 * column.kind.components + BYTES_OF_AN_ENTRY;
        2 * column.count() * value + 2 * 3 * 4 * triangles
    };
    12 * triangles + attributes.columns.iter().map(of_column).sum::<usize>()
}

/// An entry of the map of values, and the place of one.
const BYTES_OF_AN_ENTRY: usize = 32 + 4;
