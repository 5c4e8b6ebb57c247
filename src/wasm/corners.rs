//! Values at corners and triangles as arrays that a graphics processor takes.

use super::surface::Surface;
use crate::codec::attributes::{Attributes, Column};
use crate::container::AttributeEntry;
use crate::mesh::Triangle;
use crate::mesh::attributes::{Domain, Semantic, Stored, Values};
use crate::refine::{ProgressiveMesh, Wedges};

/// The attributes of level 0: triangles as triples of wedges, and values by wedge or by triangle.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Corners {
    /// The vertex of each wedge.
    pub vertices: Vec<u32>,
    /// The wedges of the triangles, three a triangle.
    pub indices: Vec<u32>,
    /// The values of one attribute after the other, in the order of the file, each from a multiple of four bytes on: numbers as they are
    /// stored, little end first, but of binary64 as binary32.
    pub values: Vec<u8>,
}

impl Corners {
    /// Those of level 0. Where only triangles have values, the wedges are the vertices.
    pub fn new(
        mesh: &ProgressiveMesh,
        surface: &Surface,
        attributes: &Attributes,
        entries: &[AttributeEntry],
    ) -> Self {
        let slots = mesh.table.slots() as u32;
        let [more_vertices, more_triangles] = surface.counts();
        let triangles = slots + more_triangles;
        let mut corners = Self::default();
        // Of what is constant no corner tells.
        let is_at = |entry: &AttributeEntry| entry.domain == Domain::Corner && entry.constant.is_none();
        if entries.iter().any(is_at) {
            let wedges = |t: u32| match t.checked_sub(slots) {
                Some(further) => attributes.further.get(further as usize).copied().unwrap_or_default(),
                None => surface.as_drawn(t, Triangle(t).corners().map(|c| attributes.wedges.of(c))),
            };
            corners.name((0..triangles).map(|t| (surface.triangle(mesh, t), wedges(t))), attributes.count);
        } else {
            corners.vertices = (0..mesh.positions.len() as u32 + more_vertices).collect();
            corners.indices.reserve_exact(3 * triangles as usize);
            corners.indices.extend((0..triangles).flat_map(|t| surface.triangle(mesh, t)));
        }
        let count = corners.vertices.len() as u32;
        for (entry, column) in entries.iter().zip(&attributes.columns) {
            match entry.domain {
                Domain::Corner => corners.append(entry, column, 0..count),
                Domain::Triangle => {
                    let row = |t: u32| match t.checked_sub(slots) {
                        Some(further) => attributes.further_row(further),
                        None => attributes.wedges.row(Triangle(t)),
                    };
                    corners.append(entry, column, (0..triangles).map(row));
                }
            }
        }
        corners
    }

    fn name(&mut self, triangles: impl ExactSizeIterator<Item = ([u32; 3], [u32; 3])>, count: u32) {
        self.vertices = vec![Wedges::NONE; count as usize];
        self.indices.reserve_exact(3 * triangles.len());
        for (vertices, wedges) in triangles {
            for (v, wedge) in vertices.into_iter().zip(wedges) {
                // A further triangle may name a wedge by a vertex that is sewn together with the wedge's own: it is at the same place.
                if let Some(vertex) = self.vertices.get_mut(wedge as usize).filter(|v| **v == Wedges::NONE) {
                    *vertex = v;
                }
                self.indices.push(wedge);
            }
        }
    }

    fn append(&mut self, entry: &AttributeEntry, column: &Column, places: impl Iterator<Item = u32>) {
        let mut values = Values::new(entry.stored);
        for place in places {
            match column.value(place) {
                Some(value) => entry.quantisation.value(value, entry.components, &mut values),
                None => (0..entry.components).for_each(|_| values.push_bits(nothing(entry.semantic))),
            }
        }
        let width = match entry.stored {
            Stored::U8 | Stored::I8 => 1,
            Stored::U16 | Stored::I16 => 2,
            Stored::U32 | Stored::I32 | Stored::F32 | Stored::F64 => 4,
        };
        self.values.reserve_exact((width * values.len()).next_multiple_of(4));
        for at in 0..values.len() {
            let bits = match entry.stored {
                Stored::F64 => (values.number(at) as f32).to_bits().into(),
                _ => values.bits(at),
            };
            self.values.extend_from_slice(&bits.to_le_bytes()[..width]);
        }
        self.values.resize(self.values.len().next_multiple_of(4), 0);
    }
}

/// The number that stands for none: 0, of parts the largest, for 0 is one.
fn nothing(semantic: Semantic) -> u64 {
    if semantic == Semantic::Part { u64::MAX } else { 0 }
}

/// What a page calls attributes: each by its title, with `_` behind it as often as it takes to have a name of its own. The source's names come
/// after those that the semantics give, and are never one of them.
pub fn names(entries: &[AttributeEntry]) -> Vec<String> {
    let mut names = vec![String::new(); entries.len()];
    for named in [false, true] {
        for (k, entry) in entries.iter().enumerate().filter(|(_, entry)| entry.name.is_empty() != named) {
            let mut name = entry.title();
            let means = |name: &str| Semantic::ALL.iter().any(|semantic| semantic.name() == name);
            while TAKEN.contains(&name.as_str()) || (named && means(&name)) || names.contains(&name) {
                name.push('_');
            }
            names[k] = name;
        }
    }
    names
}

/// Names that have a meaning of their own in a page.
const TAKEN: [&str; 5] = ["__proto__", "born", "from", "index", "position"];

/// How a page gets the numbers of an attribute.
pub fn stored(entry: &AttributeEntry) -> Stored {
    if entry.stored == Stored::F64 { Stored::F32 } else { entry.stored }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::attributes::{Attribute, Quantisation};

    fn entry(semantic: Semantic, set: u32, name: &str) -> AttributeEntry {
        let plain = Attribute::new(semantic, 1, Values::U8(Vec::new()), Vec::new());
        AttributeEntry::of(&Attribute { set, name: name.into(), ..plain }, Quantisation::Integer, 0.0)
    }

    #[test]
    fn names_are_unlike() {
        let entries = [
            entry(Semantic::Generic, 0, "uv"),
            entry(Semantic::Generic, 0, "position"),
            entry(Semantic::TexCoord, 0, ""),
            entry(Semantic::TexCoord, 1, ""),
            entry(Semantic::Generic, 3, "uv"),
            entry(Semantic::Generic, 0, "__proto__"),
            entry(Semantic::Generic, 0, "normal"),
        ];
        let expected = ["uv_", "position_", "uv", "uv1", "uv__", "__proto___", "normal_"];
        assert_eq!(names(&entries), expected);
    }

    #[test]
    fn columns_begin_at_multiples_of_four_bytes() {
        let mut corners = Corners::default();
        let color = entry(Semantic::Color, 0, "");
        let mut column = Column::new(color.kind());
        (0..).zip([Some([7].as_slice()), None, Some(&[9])]).for_each(|(at, value)| column.set(at, value));
        corners.append(&color, &column, 0..3);
        assert_eq!(corners.values, [7, 0, 9, 0]);
        corners.append(&entry(Semantic::Part, 0, ""), &column, [1, 2].into_iter());
        assert_eq!(corners.values[4..], [255, 9, 0, 0]);
        let number = AttributeEntry { stored: Stored::F64, quantisation: Quantisation::Raw, ..color };
        let mut column = Column::new(number.kind());
        let mut integers = Vec::new();
        let values = Values::F64(vec![1.5]);
        let source = Attribute::new(Semantic::Color, 1, values, vec![0]);
        number.quantisation.quantise(&source, 0, &mut integers);
        column.set(0, Some(&integers));
        corners.append(&number, &column, 0..1);
        assert_eq!(
            (corners.values[8..].to_vec(), stored(&number)),
            (1.5f32.to_le_bytes().to_vec(), Stored::F32)
        );
    }
}
