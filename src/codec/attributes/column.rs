//! The values of one attribute, as integers.

use crate::mesh::attributes::Kind;
use bitvec::vec::BitVec;

/// The values of one attribute: by wedge, or by triangle of the whole.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    /// What they are.
    pub kind: Kind,
    values: Vec<i32>,
    known: BitVec,
}

impl Column {
    /// No values yet.
    pub fn new(kind: Kind) -> Self {
        Self { kind, values: Vec::new(), known: BitVec::new() }
    }

    /// How many values there are, those that are none included.
    pub fn count(&self) -> usize {
        self.known.len()
    }

    /// A value; `None` where it is none, or not known yet.
    #[inline]
    pub fn value(&self, at: u32) -> Option<&[i32]> {
        if !self.known.get(at as usize).is_some_and(|known| *known) {
            return None;
        }
        let n = self.kind.integers();
        self.values.get(at as usize * n..(at as usize + 1) * n)
    }

    /// Appends a value, or none.
    pub fn push(&mut self, value: Option<&[i32]>) {
        let n = self.kind.integers();
        match value {
            Some(value) => self.values.extend_from_slice(&value[..n]),
            None => self.values.resize(self.values.len() + n, 0),
        }
        self.known.push(value.is_some());
    }

    /// Appends the value at a place once more.
    pub fn repeat(&mut self, at: u32) {
        let n = self.kind.integers();
        self.values.extend_from_within(at as usize * n..(at as usize + 1) * n);
        self.known.push(self.known[at as usize]);
    }
}
