//! Parts of an OBJ file: its objects, groups and materials; smoothing groups; material libraries.

use std::collections::{HashMap, HashSet};

use crate::mesh::attributes::{Attribute, Semantic};

use super::gather::{self, Gathered};
use super::origins::Origins;

/// What the statements say that hold for the faces behind them.
#[derive(Default)]
pub(super) struct Parts<'a> {
    now: [&'a [u8]; 3],
    changed: bool,
    numbers: HashMap<[&'a [u8]; 3], u32>,
    names: Vec<String>,
    /// The face that a part, or a smoothing group, begins with.
    runs: Vec<(u32, u32)>,
    smoothing: Vec<(u32, u32)>,
    libraries: Vec<String>,
    /// Those that are among them.
    known: HashSet<&'a [u8]>,
    /// Names that are not UTF-8.
    other: HashSet<&'a [u8]>,
}

impl<'a> Parts<'a> {
    /// Takes a statement, of so many faces before it; returns whether it is one of these.
    pub(super) fn take(&mut self, keyword: &[u8], words: impl FnOnce() -> &'a [u8], faces: u32) -> bool {
        if let Some(row) = STATEMENTS.iter().position(|statement| statement.as_bytes() == keyword) {
            let name = words();
            self.now[row] = name;
            // Groups are those of an object.
            if row == OBJECT {
                self.now[GROUP] = &[];
            }
            self.changed = true;
            return true;
        }
        match keyword {
            b"s" => {
                let word = words();
                let group = std::str::from_utf8(word).ok().and_then(|word| word.parse().ok());
                // `off` is 0, and what else is no number, as `on`, is one group.
                self.smoothing.push((faces, group.unwrap_or(u32::from(!matches!(word, b"off" | b"")))));
            }
            b"mtllib" => {
                let name = words();
                if !name.is_empty() && self.known.insert(name) {
                    let library = self.text(name);
                    self.libraries.push(library);
                }
            }
            _ => return false,
        }
        true
    }

    /// A face comes, behind so many.
    #[inline]
    pub(super) fn face(&mut self, faces: u32) {
        if self.changed {
            self.begin(faces);
        }
    }

    #[cold]
    fn begin(&mut self, faces: u32) {
        self.changed = false;
        let number = match self.numbers.get(&self.now) {
            Some(&number) => number,
            None => {
                if self.names.is_empty() && faces > 0 {
                    // Faces before the first statement are of a part without a name.
                    self.numbers.insert([&[]; 3], 0);
                    self.names.push(String::new());
                }
                let there = self.now.into_iter().zip(STATEMENTS).filter(|(name, _)| !name.is_empty());
                let lines: Vec<String> =
                    there.map(|(name, statement)| format!("{statement} {}", self.text(name))).collect();
                let number = self.names.len() as u32;
                let number = *self.numbers.entry(self.now).or_insert(number);
                if number as usize == self.names.len() {
                    self.names.push(lines.join("\n"));
                }
                number
            }
        };
        self.runs.push((faces, number));
    }

    /// A name as text, in one line.
    fn text(&mut self, name: &'a [u8]) -> String {
        let text = String::from_utf8_lossy(name);
        if matches!(text, std::borrow::Cow::Owned(_)) {
            self.other.insert(name);
        }
        if text.contains(['\n', '\r']) {
            return text.split_whitespace().filter(|word| *word != "\\").collect::<Vec<_>>().join(" ");
        }
        text.into_owned()
    }

    /// What was found: the names of the parts, and the libraries.
    pub(super) fn finish(mut self, origins: &Origins, gathered: &mut Gathered) -> (Vec<String>, Vec<String>) {
        if self.names.iter().any(|name| !name.is_empty()) {
            gathered.take(gather::numbers(Semantic::Part, origins.of_runs(&self.runs)), "parts");
        } else {
            self.names.clear();
        }
        if self.smoothing.iter().any(|run| run.1 != 0) {
            let groups = gather::numbers(Semantic::Generic, origins.of_runs(&self.smoothing));
            gathered.take(Attribute { name: SMOOTHING.to_owned(), ..groups }, "smoothing groups");
        }
        if !self.other.is_empty() {
            gathered.dropped.push(format!("letters of names that are not UTF-8 ({})", self.other.len()));
        }
        (self.names, self.libraries)
    }
}

/// The statements whose names a part is told by, in the order that its name has them, each in a line of its own.
pub(super) const STATEMENTS: [&str; 3] = ["o", "g", "usemtl"];
const OBJECT: usize = 0;
const GROUP: usize = 1;

/// The attribute that has the numbers of the smoothing groups, 0 for none.
pub(super) const SMOOTHING: &str = "smoothing group";
