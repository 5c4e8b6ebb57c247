//! Texture coordinates and normals of an OBJ file, and what corners name of them.

use crate::error::{InputError, Place, Result};
use crate::mesh::attributes::{NO_VALUE, Semantic, Values};

use super::decimals::{Decimals, attribute};
use super::obj::Statements;
use super::text::{integer, quoted};

/// One of the lists of an OBJ file.
pub(super) struct List {
    pub semantic: Semantic,
    pub name: &'static str,
    pub plural: &'static str,
    /// What its three numbers are called.
    pub axes: &'static [&'static str; 3],
    /// How many of them must be there; others are 0.
    pub needed: usize,
}

/// The values read so far, three numbers each.
pub(super) struct Coordinates {
    pub list: &'static List,
    numbers: Decimals,
    /// Those of more numbers.
    longer: usize,
}

impl Coordinates {
    pub(super) fn new(list: &'static List) -> Self {
        Self { list, numbers: Decimals::default(), longer: 0 }
    }

    /// Reads the rest of a statement.
    pub(super) fn read(&mut self, statements: &mut Statements) -> Result<()> {
        let number = self.count() + 1;
        for (place, axis) in self.list.axes.iter().enumerate() {
            match statements.word() {
                Some(word) => {
                    let x = attribute(word)
                        .ok_or_else(|| statements.fault(format!("{} is not a number", quoted(word))))?;
                    self.numbers.push(word, x);
                }
                None if place >= self.list.needed => self.numbers.push(b"0", 0.0),
                None => {
                    return Err(statements.fault(format!("{} {number} has no {axis}", self.list.name)));
                }
            }
        }
        self.longer += usize::from(statements.word().is_some());
        Ok(())
    }

    pub(super) fn count(&self) -> usize {
        self.numbers.len() / 3
    }

    /// How many numbers they have each, and the numbers. A third one that may be missing is left out where it is 0 everywhere.
    pub(super) fn finish(self, dropped: &mut Vec<String>) -> (usize, Values) {
        if self.longer > 0 {
            dropped.push(format!("further numbers of {} ({})", self.list.plural, self.longer));
        }
        let third =
            self.list.needed > 2 || self.numbers.numbers().iter().skip(2).step_by(3).any(|&w| w != 0.0);
        if third { (3, self.numbers.values()) } else { (2, self.numbers.without_third().values()) }
    }
}

/// What the corners of a file name of a list.
pub(super) struct References {
    list: &'static List,
    /// The value of each corner, as far as any names one.
    by_corner: Vec<u32>,
    /// References to values that had not come yet: index (from 1) and line, only where the index is a new maximum. The
    /// first reference past the last value is among them.
    ahead: Vec<(u64, u64)>,
    /// References that name nothing, and the first: its line and what is wrong.
    faults: usize,
    first_fault: Option<(u64, String)>,
}

impl References {
    pub(super) fn new(list: &'static List) -> Self {
        Self { list, by_corner: Vec::new(), ahead: Vec::new(), faults: 0, first_fault: None }
    }

    /// What a corner names; nothing where the field is empty. `before` values came before it.
    #[inline]
    pub(super) fn read(&mut self, field: &[u8], corner: usize, before: usize, line: u64) {
        if field.is_empty() {
            return;
        }
        let index = integer(field);
        let place = match index {
            Some(index @ 1..) => index - 1,
            Some(index) if index < 0 => before as i64 + index,
            _ => -1,
        };
        if place < 0 {
            return self.fault(field, index, before, line);
        }
        if place >= before as i64 && self.ahead.last().is_none_or(|last| last.0 <= place as u64) {
            self.ahead.push((place as u64 + 1, line));
        }
        if self.by_corner.len() != corner {
            self.by_corner.resize(corner, NO_VALUE);
        }
        // Beyond 32 bits it is beyond the last value, or beyond the limit of a mesh.
        self.by_corner.push(u32::try_from(place).unwrap_or(NO_VALUE - 1));
    }

    #[cold]
    fn fault(&mut self, field: &[u8], index: Option<i64>, before: usize, line: u64) {
        self.faults += 1;
        let List { name, plural, .. } = self.list;
        self.first_fault.get_or_insert_with(|| {
            let what = match index {
                None => format!("{} is not the index of a {name}", quoted(field)),
                Some(0) => format!("{name} index 0: indices count from 1"),
                Some(index) => {
                    format!("{name} index {index} is out of range: {before} {plural} come before it")
                }
            };
            (line, what)
        });
    }

    /// The value of each corner, where there are so many. Where the list is empty the corners have none.
    ///
    /// # Errors
    /// [`crate::Error::Input`] where a corner names what is not there, unless forced: then it has none.
    pub(super) fn finish(
        mut self,
        there: usize,
        name: &str,
        force: bool,
        dropped: &mut Vec<String>,
    ) -> Result<Vec<u32>> {
        let List { name: one, plural, .. } = self.list;
        let beyond = self.ahead.iter().find(|(index, _)| *index > there as u64).map(|&(index, line)| {
            (line, format!("{one} index {index} is out of range: the file has {there} {plural}"))
        });
        let first = self.first_fault.into_iter().chain(beyond).min_by_key(|fault| fault.0);
        let Some((line, what)) = first else { return Ok(self.by_corner) };
        if there > 0 && !force {
            return Err(InputError::new(name, Place::Line(line), what).into());
        }
        for value in self.by_corner.iter_mut().filter(|v| **v != NO_VALUE && **v as usize >= there) {
            *value = NO_VALUE;
            self.faults += 1;
        }
        dropped.push(format!("references to {plural} that are not there ({})", self.faults));
        Ok(self.by_corner)
    }
}
