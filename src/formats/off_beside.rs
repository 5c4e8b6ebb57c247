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
