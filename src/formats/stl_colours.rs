//! The two bytes at the end of a facet of binary STL: by the standard of 1989 a count of attributes, 0; now mostly a colour of five bits
//! a component, in one of two ways.
//!
//! - VisCAM and SolidView: where bit 15 is set, red in bits 10 to 14, green in 5 to 9, blue in 0 to 4. Taken for this where all that
//!   are not 0 have bit 15.
//! - Magics, whose header has `COLOR=`: where bit 15 is not set, red in bits 0 to 4, green in 5 to 9, blue in 10 to 14; other
//!   facets have the colour of the whole.
//!
//! All else are numbers, which mean what they mean.

use crate::mesh::attributes::{Attribute, NO_VALUE, Semantic, Values};

use super::gather::{self, Gathered};

/// The words of the facets.
pub(super) struct FacetWords<'a> {
    header: &'a [u8],
    words: Vec<u16>,
}

impl<'a> FacetWords<'a> {
    /// Of a file with a header of 80 bytes.
    pub(super) fn new(header: &'a [u8]) -> Self {
        Self { header, words: Vec::new() }
    }

    pub(super) fn push(&mut self, word: u16) {
        self.words.push(word);
    }

    pub(super) fn finish(self, gathered: &mut Gathered) {
        let named = |what: &[u8]| self.header.windows(what.len()).any(|window| window == what);
        let magics = named(b"COLOR=");
        if magics {
            gathered.dropped.push("colour of the whole".to_owned());
        }
        if named(b"MATERIAL=") {
            gathered.dropped.push("material of the whole".to_owned());
        }
        if !magics && self.words.iter().all(|&word| word == 0) {
            return;
        }
        let viscam = self.words.iter().all(|&word| word == 0 || word & TOLD != 0);
        let number = |&word: &u16| match (magics, viscam) {
            (true, _) if word & TOLD == 0 => u32::from(turned(word)),
            (false, true) if word & TOLD != 0 => u32::from(word & !TOLD),
            (false, false) => u32::from(word),
            _ => NO_VALUE,
        };
        let words = gather::numbers(Semantic::Generic, self.words.iter().map(number).collect());
        let Values::U32(list) = &words.values else { return };
        let list = list.iter().map(|&word| word as u16);
        if magics || viscam {
            let values = Values::U8(list.flat_map(rgb).collect());
            let colours = gather::of_triangles(Semantic::Color, 3, values, words.corners);
            gathered.take(Attribute { normalised: true, ..colours }, "facet colours");
        } else {
            let attribute =
                gather::of_triangles(Semantic::Generic, 1, Values::U16(list.collect()), words.corners);
            gathered.take(Attribute { name: ATTRIBUTE.to_owned(), ..attribute }, "facet attributes");
        }
    }
}

/// Red, green and blue of 8 bits of a word that has red in bits 10 to 14.
pub(super) fn rgb(word: u16) -> [u8; 3] {
    [10, 5, 0].map(|shift| {
        let component = word >> shift & MOST;
        // To the nearest fraction; `word` finds it again.
        ((component * 255 * 2 + MOST) / (2 * MOST)) as u8
    })
}

/// The word of a colour of fractions from 0 to 1, bit 15 included.
pub(super) fn word(rgb: [f64; 3]) -> u16 {
    let component = |x: f64| (x.clamp(0.0, 1.0) * f64::from(MOST)).round() as u16;
    rgb.into_iter().fold(1, |word, x| word << 5 | component(x))
}

/// Red and blue exchanged.
fn turned(word: u16) -> u16 {
    word & MOST << 5 | word >> 10 & MOST | (word & MOST) << 10
}

/// The most of a component.
const MOST: u16 = 31;
const TOLD: u16 = 0x8000;

/// The attribute that words which are no colours are.
pub(super) const ATTRIBUTE: &str = "attribute";

#[cfg(test)]
mod tests {
    use super::*;

    fn attribute(header: &[u8], words: &[u16]) -> Option<Attribute> {
        let mut all = FacetWords::new(header);
        words.iter().for_each(|&word| all.push(word));
        let mut gathered = Gathered::default();
        all.finish(&mut gathered);
        gathered.attributes.pop()
    }

    #[test]
    fn colours_in_both_ways() {
        // Red of 31 and green of 1: 255 and 8.2.
        let viscam = attribute(b"any", &[0xfc20, 0, 0x8000, 0xfc20]).unwrap();
        assert_eq!((viscam.semantic, viscam.components, viscam.normalised), (Semantic::Color, 3, true));
        assert_eq!(viscam.values, Values::U8(vec![255, 8, 0, 0, 0, 0]));
        assert_eq!(viscam.corners, [0, NO_VALUE, 1, 0]);
        let magics = attribute(b"by hand COLOR=abcd", &[0x003f, 0x8000, 0, 0xffff]).unwrap();
        assert_eq!(magics.values, Values::U8(vec![255, 8, 0, 0, 0, 0]));
        assert_eq!(magics.corners, [0, NO_VALUE, 1, NO_VALUE]);
        let other = attribute(b"any", &[0xfc20, 7, 0]).unwrap();
        assert_eq!((other.semantic, &other.name[..]), (Semantic::Generic, "attribute"));
        assert_eq!((&other.values, &other.corners[..]), (&Values::U16(vec![0xfc20, 7, 0]), &[0, 1, 2][..]));
        assert_eq!(attribute(b"any", &[0, 0]), None);
    }

    #[test]
    fn every_colour_of_five_bits_comes_back() {
        for colour in 0..=0x7fff {
            assert_eq!(word(rgb(colour).map(|x| f64::from(x) / 255.0)), colour | TOLD);
        }
        assert_eq!([turned(0x7c00), turned(0x001f), turned(0x03e1)], [0x001f, 0x7c00, 0x07e0]);
    }
}
