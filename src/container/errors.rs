//! Errors of the attributes of levels (spec §3.3).

use super::attributes::AttributeEntry;
use super::contents::AttributeError;
use super::fields::Fields;
use super::magnitude;
#[cfg(any(test, feature = "encode"))]
use crate::entropy::varint;
use crate::error::FormatError;
#[cfg(any(test, feature = "encode"))]
use crate::error::{Error, Result};

/// The errors of a level as codes, by attribute: what those of the next one are told by.
#[derive(Clone, Debug, Default)]
pub(super) struct Codes(Vec<[u16; 2]>);

impl Codes {
    /// Before the base.
    pub fn new(attributes: &[AttributeEntry]) -> Self {
        Self(vec![[0; 2]; attributes.len()])
    }

    /// Reads those of level `j`.
    pub fn read(
        &mut self,
        fields: &mut Fields,
        attributes: &[AttributeEntry],
        j: u32,
    ) -> std::result::Result<Vec<AttributeError>, FormatError> {
        let mut errors = Vec::new();
        for (k, entry) in told(attributes, j) {
            let (unit, count) = entry.level_errors();
            let mut values = [0.0; 2];
            for (value, code) in values.iter_mut().zip(&mut self.0[k]).take(count) {
                let at = fields.offset();
                let read = if entry.birth == j {
                    Some(fields.u16()?).filter(|&code| code <= magnitude::MAX_CODE)
                } else {
                    magnitude::behind(*code, fields.count(u32::MAX, "the difference of an error")?)
                };
                let read = read.filter(|&code| magnitude::value(code, unit).is_finite());
                *code = read.ok_or_else(|| {
                    FormatError::new(at, "3.3", "the error of an attribute is negative or not finite")
                })?;
                *value = magnitude::value(*code, unit);
            }
            errors.push(AttributeError {
                attribute: k,
                error: values[0],
                high: (count > 1).then_some(values[1]),
            });
        }
        Ok(errors)
    }

    /// Appends those of level `j` to a table of contents; what `errors` do not tell is 0.
    ///
    /// # Errors
    /// [`Error::Parameter`] where they have no form there, or where the level has no such attribute.
    #[cfg(any(test, feature = "encode"))]
    pub fn write(
        &mut self,
        errors: &[AttributeError],
        attributes: &[AttributeEntry],
        j: u32,
        table: &mut Vec<u8>,
    ) -> Result<()> {
        let refused = |what: &str| Err(Error::Parameter(format!("level {j}: {what}")));
        let is_told = |error: &AttributeError| told(attributes, j).any(|(k, _)| k == error.attribute);
        if !errors.iter().all(is_told) {
            return refused("an error of an attribute that has none there");
        }
        for (k, entry) in told(attributes, j) {
            let (unit, count) = entry.level_errors();
            let error = errors.iter().find(|error| error.attribute == k).copied().unwrap_or_default();
            let values = [error.error, error.high.unwrap_or(0.0)];
            for (value, before) in values.into_iter().zip(&mut self.0[k]).take(count) {
                let Some(code) = magnitude::code(value, unit) else {
                    return refused("an error of an attribute that is negative, not finite or too large");
                };
                if entry.birth == j {
                    table.extend(code.to_le_bytes());
                } else {
                    varint::write(magnitude::difference(code, *before), table);
                }
                *before = code;
            }
        }
        Ok(())
    }
}

/// The attributes that a level tells errors of, by their places.
fn told(attributes: &[AttributeEntry], j: u32) -> impl Iterator<Item = (usize, &AttributeEntry)> {
    let is_told = move |entry: &AttributeEntry| j > 0 && entry.birth >= j && entry.has_level_errors();
    attributes.iter().enumerate().filter(move |(_, entry)| is_told(entry))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::container::testing::any_attribute;
    use crate::container::{AtomKind, FileBuilder, Level, parse_contents, testing};
    use crate::fuzzing::mend;
    use crate::mesh::attributes::{Domain, Quantisation, Semantic};
    use proptest::prelude::*;

    /// Texture coordinates of step 2^-12 and parts.
    fn attributes() -> Vec<AttributeEntry> {
        let all = testing::attributed_file().attributes;
        let lattice = Quantisation::Lattice { bits: 12, origin: vec![0.0, 0.5], step: 2f64.powi(-12) };
        vec![
            AttributeEntry { birth: 4, quantisation: lattice, ..all[1].clone() },
            AttributeEntry { birth: 3, ..all[3].clone() },
        ]
    }

    fn error(attribute: usize, error: f64, high: Option<f64>) -> AttributeError {
        AttributeError { attribute, error, high }
    }

    #[test]
    fn the_example_of_the_specification() {
        let (attributes, step) = (attributes(), 2f64.powi(-12));
        let levels = [
            (5, Vec::new(), Vec::new()),
            (4, vec![error(0, 8.0 * step, Some(20.0 * step))], vec![0x00, 0x41, 0xA0, 0x41]),
            (
                3,
                vec![error(0, 6.0 * step, Some(15.0 * step)), error(1, 1.0 / 64.0, None)],
                vec![0x1F, 0x00, 0x80, 0x3C],
            ),
        ];
        let (mut written, mut read) = (Codes::new(&attributes), Codes::new(&attributes));
        for (j, errors, bytes) in levels {
            let mut table = Vec::new();
            written.write(&errors, &attributes, j, &mut table).unwrap();
            assert_eq!(table, bytes);
            let mut fields = Fields::new(&bytes, 0, "3.3");
            assert_eq!(read.read(&mut fields, &attributes, j).unwrap(), errors);
            assert_eq!(fields.left(), 0);
        }
    }

    /// Nothing is told at level 0, of what is born later, of what is constant, of joints and of weights.
    #[test]
    fn of_which_attributes_errors_are_told() {
        let entry = &attributes()[0];
        let of = |semantic, constant| AttributeEntry { semantic, constant, ..entry.clone() };
        let all = vec![
            entry.clone(),
            of(Semantic::Joints, None),
            of(Semantic::Weights, None),
            of(Semantic::Color, Some(vec![0, 0])),
            AttributeEntry { birth: 2, ..entry.clone() },
        ];
        let places = |j| told(&all, j).map(|(k, _)| k).collect::<Vec<_>>();
        assert_eq!([places(5), places(4), places(2), places(1)], [vec![], vec![0], vec![0, 4], vec![0, 4]]);
        assert_eq!(places(0), Vec::<usize>::new());
        let mut codes = Codes::new(&all);
        for astray in [1, 3, 4, 9] {
            assert!(codes.write(&[error(astray, 0.0, None)], &all, 3, &mut Vec::new()).is_err(), "{astray}");
        }
    }

    #[test]
    fn units() {
        let [uv, part] = [&attributes()[0], &attributes()[1]];
        assert_eq!((uv.level_errors(), part.level_errors()), ((2f64.powi(-12), 2), (1.0, 1)));
        let normal = AttributeEntry { semantic: Semantic::Normal, components: 3, ..uv.clone() };
        assert_eq!(normal.level_errors(), (1.0, 2));
        // Two numbers are no vector.
        assert_eq!(AttributeEntry { components: 2, ..normal }.level_errors(), (2f64.powi(-12), 2));
        let flat = Quantisation::Lattice { bits: 1, origin: vec![0.0; 2], step: 0.0 };
        assert_eq!(AttributeEntry { quantisation: flat, ..uv.clone() }.level_errors(), (1.0, 2));
    }

    #[test]
    fn what_is_not_finite_or_negative_is_refused() {
        let entries = attributes();
        let read = |bytes: &[u8], j: u32| {
            let mut codes = Codes(vec![[47, 0x7F7F], [0; 2]]);
            codes
                .read(&mut Fields::new(bytes, 7, "3.3"), &entries, j)
                .map_err(|fault| (fault.offset, fault.what))
        };
        let what = "the error of an attribute is negative or not finite".to_owned();
        // A code of infinity; the code before 47 less 48 is -1; one more than the largest.
        assert_eq!(read(&[0x00, 0x41, 0x80, 0x7F], 4), Err((9, what.clone())));
        assert_eq!(read(&[0x00, 0x00, 0x00, 0x00], 3), Err((7, what.clone())));
        assert_eq!(read(&[0x02, 98, 0x00, 0x00], 3), Err((8, what.clone())));
        assert!(read(&[0x02, 96, 0x00, 0x00], 3).is_ok());
        // A finite number of steps that is too long.
        let step = 1e300;
        let lattice = Quantisation::Lattice { bits: 12, origin: vec![0.0; 2], step };
        let long = vec![AttributeEntry { quantisation: lattice, ..entries[0].clone() }];
        let far = Codes::new(&long).read(&mut Fields::new(&[0x00, 0x41, 0x00, 0x60], 0, "3.3"), &long, 4);
        assert_eq!(far.unwrap_err().what, what);
    }

    #[test]
    fn what_has_no_form_is_not_written() {
        for (error, high) in [(-1.0, 0.0), (0.0, f64::NAN), (f64::INFINITY, 0.0), (0.0, 1e300)] {
            let mut file = testing::born_file();
            file.levels[2].attributes = vec![AttributeError { attribute: 0, error, high: Some(high) }];
            assert!(file.write(&mut Vec::new()).is_err(), "{error} {high}");
        }
        let mut file = testing::born_file();
        file.levels[0].attributes = vec![AttributeError::default()];
        assert!(file.write(&mut Vec::new()).is_err());
    }

    proptest! {
        /// They come back rounded up, each where it belongs; and a change of any byte is either refused or read.
        #[test]
        fn they_come_back(
            entries in prop::collection::vec((any_attribute(), 0u32..4), 1..5),
            numbers in prop::collection::vec(0.0..1e6f64, 40),
            change: (prop::sample::Index, u8),
        ) {
            let entries: Vec<_> = entries
                .into_iter()
                .map(|(entry, birth)| {
                    AttributeEntry { birth: if entry.constant.is_some() { 3 } else { birth }, ..entry }
                })
                .collect();
            let mut numbers = numbers.into_iter();
            let mut error = |k: usize, entry: &AttributeEntry| {
                let (unit, count) = entry.level_errors();
                let mut next = || numbers.next().unwrap_or(0.5) * unit;
                AttributeError { attribute: k, error: next(), high: (count > 1).then(next) }
            };
            let levels: Vec<Level> = (0..4u32)
                .map(|j| Level {
                    vertices: 8 - j,
                    triangles: 12 - 2 * j,
                    attributes: told(&entries, j).map(|(k, entry)| error(k, entry)).collect(),
                    ..Level::default()
                })
                .collect();
            let mut file = FileBuilder::new(testing::small_file().lattice, [9; 3], levels.clone());
            file.payload(AtomKind::Base, 3, b"b");
            (0..3).for_each(|j| file.atom(AtomKind::Refinement, j, 1, 2, b"r".to_vec()));
            let is_born = |j: u32| entries.iter().any(|entry| entry.birth == j && entry.constant.is_none());
            (0..3).filter(|&j| is_born(j)).for_each(|j| file.payload(AtomKind::Attributes, j, b"a"));
            file.attributes = entries;
            let bytes = testing::bytes(&file);
            let contents = parse_contents(&bytes).unwrap().unwrap();
            for (told, level) in contents.levels.iter().zip(&levels) {
                prop_assert_eq!(told.attributes.len(), level.attributes.len());
                for (told, given) in told.attributes.iter().zip(&level.attributes) {
                    let up = |told: f64, error: f64| (error..=error * (1.0 + 1.0 / 128.0) + 1e-30).contains(&told);
                    prop_assert_eq!(told.attribute, given.attribute);
                    prop_assert_eq!(told.high.is_some(), given.high.is_some());
                    prop_assert!(up(told.error, given.error), "{} {}", told.error, given.error);
                    prop_assert!(up(told.high.unwrap_or(0.0), given.high.unwrap_or(0.0)));
                }
            }
            let mut changed = bytes;
            let at = 16 + change.0.index(contents.header.table_end() as usize - 20);
            changed[at] ^= change.1;
            mend(&mut changed);
            let _ = parse_contents(&changed);
        }
    }

    /// Parts are of triangles, and yet have errors.
    #[test]
    fn parts_are_told() {
        assert_eq!(attributes()[1].domain, Domain::Triangle);
        assert!(attributes()[1].has_level_errors());
    }
}
