//! Values at corners and triangles as arrays that a graphics processor takes.

use super::surface::Surface;
use crate::codec::attributes::{Attributes, Column};
use crate::container::AttributeEntry;
use crate::mesh::Triangle;
use crate::mesh::attributes::{Domain, Semantic, Stored, Values};
use crate::refine::{ProgressiveMesh, Wedges};

/// What is new of the attributes that are alive: wedges, triangles as triples of them, and values by wedge or by triangle.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Corners {
    /// The attributes that are alive, by their places in the file's list.
    pub alive: Vec<u32>,
    /// The first triangle told; all from it on are. Where it is 0 all is new: all wedges are told, and nothing of triangles that are rewritten.
    pub first_triangle: u32,
    /// The first wedge told; all from it on are.
    pub first_wedge: u32,
    /// The vertex of each of these wedges; of one that no triangle names, vertex 0. Where all attributes of corners are
    /// constant the wedges are the vertices; where there are none there are no wedges.
    pub vertices: Vec<u32>,
    /// The wedges of the triangles told, three a triangle.
    pub indices: Vec<u32>,
    /// Those of the triangles rewritten, as [`Changes::rewritten`](super::Changes::rewritten) has them.
    pub rewritten: Vec<u32>,
    /// The values of one living attribute after the other, each from a multiple of four bytes on: of the wedges told, or of the triangles told
    /// and those rewritten. Numbers as they are stored, little end first, but of binary64 as binary32.
    pub values: Vec<u8>,
}

/// The mesh as it is drawn, with its attributes.
#[derive(Clone, Copy)]
pub struct Dressed<'a> {
    /// The mesh.
    pub mesh: &'a ProgressiveMesh,
    /// What the residue adds to it.
    pub surface: &'a Surface,
    /// Its attributes.
    pub attributes: &'a Attributes,
    /// What they are.
    pub entries: &'a [AttributeEntry],
}

impl Corners {
    /// What is new since `told`: the first wedge and the first triangle that have not been told, and triangles rewritten.
    pub fn new(
        of: Dressed,
        alive: Vec<u32>,
        [first_wedge, first_triangle]: [u32; 2],
        rewritten: &[u32],
    ) -> Self {
        let Dressed { mesh, surface, attributes, entries } = of;
        let slots = mesh.table.slots() as u32;
        let triangles = first_triangle..slots + surface.counts()[1];
        let rewritten = if first_triangle == 0 { &[] } else { rewritten };
        let told = || triangles.clone().chain(rewritten.iter().copied());
        let mut corners = Self { alive, first_triangle, first_wedge, ..Self::default() };
        let columns: Vec<_> = corners.alive.iter().map(|&k| k as usize).collect();
        let at_corners =
            || columns.iter().map(|&k| &entries[k]).filter(|entry| entry.domain == Domain::Corner);
        // Of what is constant no corner tells.
        if at_corners().any(|entry| entry.constant.is_none()) {
            corners.indices.reserve_exact(3 * triangles.len());
            corners.rewritten.reserve_exact(3 * rewritten.len());
            corners.vertices = vec![Wedges::NONE; attributes.count.saturating_sub(first_wedge) as usize];
            for t in told() {
                let vertices = surface.triangle(mesh, t);
                let wedges = match t.checked_sub(slots) {
                    Some(further) => attributes.further.get(further as usize).copied().unwrap_or_default(),
                    None => surface.as_drawn(t, Triangle(t).corners().map(|c| attributes.wedges.of(c))),
                };
                corners.name(vertices, wedges, if t < first_triangle { Part::Rewritten } else { Part::Told });
            }
            if first_triangle == 0 {
                // On a level shown again, wedges of finer ones are nobody's.
                let used =
                    corners.vertices.iter().rposition(|&v| v != Wedges::NONE).map_or(0, |last| last + 1);
                corners.vertices.truncate(used);
            }
            corners.vertices.iter_mut().filter(|v| **v == Wedges::NONE).for_each(|v| *v = 0);
        } else if at_corners().next().is_some() {
            let vertices = mesh.positions.len().min(mesh.table.vertex_slots()) as u32 + surface.counts()[0];
            corners.vertices = (first_wedge..vertices).collect();
            corners.indices = triangles.clone().flat_map(|t| surface.triangle(mesh, t)).collect();
            corners.rewritten = rewritten.iter().flat_map(|&t| surface.triangle(mesh, t)).collect();
        }
        let wedges = first_wedge..first_wedge + corners.vertices.len() as u32;
        for k in columns {
            let (entry, column) = (&entries[k], &attributes.columns[k]);
            let row = |t: u32| match t.checked_sub(slots) {
                Some(further) => attributes.further_row(further),
                None => attributes.wedges.row(Triangle(t)),
            };
            match entry.domain {
                Domain::Corner => corners.append(entry, column, wedges.clone()),
                Domain::Triangle => corners.append(entry, column, told().map(row)),
            }
        }
        corners
    }

    fn name(&mut self, vertices: [u32; 3], wedges: [u32; 3], part: Part) {
        for (v, wedge) in vertices.into_iter().zip(wedges) {
            // Behind a fault, triangles of the operation that it lies in may name none.
            let wedge = if wedge == Wedges::NONE { 0 } else { wedge };
            let place = wedge.checked_sub(self.first_wedge).map(|place| place as usize);
            // A further triangle may name a wedge by a vertex that is sewn together with the wedge's own: it is at the same place.
            let open = place.and_then(|place| self.vertices.get_mut(place)).filter(|v| **v == Wedges::NONE);
            if let Some(vertex) = open {
                *vertex = v;
            }
            match part {
                Part::Told => self.indices.push(wedge),
                Part::Rewritten => self.rewritten.push(wedge),
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

/// Which list the wedges of a triangle go to.
#[derive(Clone, Copy)]
enum Part {
    Told,
    Rewritten,
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
