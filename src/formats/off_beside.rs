//! What vertices and faces of an OFF file have beside positions and corners.

use crate::mesh::attributes::{Attribute, NO_VALUE, Semantic};

use super::decimals::{Colours, Decimals, attribute};
use super::gather::{self, Gathered};
use super::origins::Origins;

/// What the keyword tells of a vertex, beside its position and in this order.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Prefixes {
    pub normals: bool,
    pub colours: bool,
    pub texture: bool,
}

impl Prefixes {
    pub(super) fn any(self) -> bool {
        self.normals || self.colours || self.texture
    }

    /// How many numbers a vertex has beside its position, a colour of four.
    pub(super) fn numbers(self) -> usize {
        3 * usize::from(self.normals) + 4 * usize::from(self.colours) + 2 * usize::from(self.texture)
    }
}

/// The attributes, as they come.
#[derive(Default)]
pub(super) struct Beside {
    normals: Listed<Decimals>,
    colours: Listed<Colours>,
    texture: Listed<Decimals>,
    faces: Listed<Colours>,
    /// Vertices of which the numbers are not what the keyword tells, and faces whose colour is not three or four numbers.
    odd: usize,
    odd_faces: usize,
}

/// Values and, as far as any has one, the number of each element's.
#[derive(Default)]
struct Listed<T> {
    values: T,
    of: Vec<u32>,
}

impl<T> Listed<T> {
    /// Element `element` has a value.
    fn put(&mut self, element: usize, value: u32) {
        self.of.resize(element, NO_VALUE);
        self.of.push(value);
    }
}

impl Listed<Decimals> {
    fn push(&mut self, element: usize, words: &[&[u8]], numbers: &[f64]) {
        let value = (self.values.len() / words.len()) as u32;
        words.iter().zip(numbers).for_each(|(word, &x)| self.values.push(word, x));
        self.put(element, value);
    }
}

impl Beside {
    /// Takes the words behind the position of a vertex. Without a prefix three or four are a colour.
    pub(super) fn vertex(&mut self, vertex: usize, prefixes: Prefixes, words: &[&[u8]]) {
        if words.is_empty() {
            return;
        }
        let numbers: Vec<f64> = words.iter().map_while(|word| attribute(word)).collect();
        let (front, back) = (3 * usize::from(prefixes.normals), 2 * usize::from(prefixes.texture));
        let colour = words.len().checked_sub(front + back);
        let suits = match colour {
            Some(3 | 4) => prefixes.colours || !prefixes.any(),
            Some(0) => prefixes.any(),
            _ => false,
        };
        if !suits || numbers.len() < words.len() {
            self.odd += 1;
            return;
        }
        if prefixes.normals {
            self.normals.push(vertex, &words[..front], &numbers[..front]);
        }
        let middle = front..words.len() - back;
        if let Some(colour) = self.colours.values.push(&words[middle.clone()]) {
            self.colours.put(vertex, colour);
        }
        if prefixes.texture {
            self.texture.push(vertex, &words[middle.end..], &numbers[middle.end..]);
        }
    }

    /// Takes the words behind the corners of a face.
    pub(super) fn face(&mut self, face: usize, words: &[&[u8]]) {
        match self.faces.values.push(words) {
            Some(colour) => self.faces.put(face, colour),
            None => self.odd_faces += usize::from(!words.is_empty()),
        }
    }

    pub(super) fn finish(self, triangles: &[[u32; 3]], origins: &Origins, gathered: &mut Gathered) {
        for (semantic, components, list, what) in [
            (Semantic::Normal, 3, self.normals, "vertex normals"),
            (Semantic::TexCoord, 2, self.texture, "vertex texture coordinates"),
        ] {
            if !list.of.is_empty() {
                let (values, of) = (list.values.values(), Some(&list.of[..]));
                gathered.take(gather::of_vertices(semantic, components, values, of, triangles), what);
            }
        }
        if !self.colours.of.is_empty() {
            let (components, values, normalised) = self.colours.values.finish();
            let of = Some(&self.colours.of[..]);
            let colours = gather::of_vertices(Semantic::Color, components, values, of, triangles);
            gathered.take(Attribute { normalised, ..colours }, "vertex colours");
        }
        if !self.faces.of.is_empty() {
            let (components, values, normalised) = self.faces.values.finish();
            let of_triangles = origins.of_faces(&self.faces.of);
            let colours = gather::of_triangles(Semantic::Color, components, values, of_triangles);
            gathered.take(Attribute { normalised, ..colours }, "face colours");
        }
        if self.odd > 0 {
            gathered.dropped.push(format!("further numbers of vertices ({})", self.odd));
        }
        if self.odd_faces > 0 {
            gathered.dropped.push(format!("face colours by the number of a colour map ({})", self.odd_faces));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::{Format, Source, read_bytes};

    const SQUARE: &str = "0 0 0\n1 0 0\n1 1 0\n0 1 0.1\n";

    fn square(text: String) -> Source {
        read_bytes(text.as_bytes(), Some(Format::Off), "").unwrap()
    }

    #[test]
    fn what_a_vertex_has_beside_its_position() {
        let file = |keyword: &str, beside: &str| {
            format!("{keyword}\n4 1 0\n{}4 0 1 2 3\n", SQUARE.replace('\n', &format!(" {beside}\n")))
        };
        let (normal, color, uv) = (Semantic::Normal, Semantic::Color, Semantic::TexCoord);
        let odd = Some("further numbers of vertices (4)");
        for (keyword, beside, expected, dropped) in [
            ("COFF", "255 0 0 255", &[(color, &[255.0, 0.0, 0.0, 255.0][..])][..], None),
            ("COFF", "1 0 0", &[(color, &[1.0, 0.0, 0.0])], None),
            ("COFF", "", &[], None),
            ("COFF", "7", &[], odd),
            ("NOFF", "0 0 1", &[(normal, &[0.0, 0.0, 1.0])], None),
            ("NOFF", "0 0 1 1 0 0", &[], odd),
            ("STOFF", "0.5 0.25", &[(uv, &[0.5, 0.25])], None),
            (
                "STCNOFF",
                "0 0 1 .1 .2 .3 1 7 8",
                &[(normal, &[0.0, 0.0, 1.0]), (uv, &[7.0, 8.0]), (color, &[0.1, 0.2, 0.3, 1.0])],
                None,
            ),
            ("STCNOFF", "0 0 1 .1 .2 .3 7 8 9 10", &[], odd),
            ("OFF", ".1 .2 .3", &[(color, &[0.1, 0.2, 0.3])], None),
            ("OFF", "7", &[], odd),
            ("OFF", "1 2 x", &[], odd),
        ] {
            let s = square(file(keyword, beside));
            let near = |a: &Attribute, number: usize, x: f64| (a.values.number(number) - x).abs() < 1e-7;
            assert_eq!(s.mesh.attributes.len(), expected.len(), "{keyword} {beside}");
            for (a, (semantic, numbers)) in s.mesh.attributes.iter().zip(expected) {
                assert_eq!((a.semantic, a.components, a.count()), (*semantic, numbers.len(), 4));
                assert!(numbers.iter().enumerate().all(|(k, &x)| near(a, 3 * numbers.len() + k, x)), "{a:?}");
                assert_eq!(
                    (a.normalised, &a.corners[..]),
                    (numbers.contains(&255.0), &[0, 1, 2, 0, 2, 3][..])
                );
            }
            let cut = Some("polygons (1, cut into triangles)");
            assert_eq!(s.dropped.first().map(String::as_str), dropped.or(cut), "{keyword} {beside}");
        }
        // Some vertices have none.
        let s = square(file("COFF", "").replace("1 1 0 ", "1 1 0 1 .5 0"));
        assert_eq!(s.mesh.attributes[0].corners, [NO_VALUE, NO_VALUE, 0, NO_VALUE, 0, NO_VALUE]);
    }
}
