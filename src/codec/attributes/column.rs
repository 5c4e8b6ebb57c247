//! The values of one attribute, as integers.

use crate::mesh::attributes::Kind;

/// The values of one attribute: by wedge, or by row of triangles.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    /// What they are.
    pub kind: Kind,
    values: Vec<i32>,
    known: Vec<bool>,
}

impl Column {
    /// No values yet.
    pub fn new(kind: Kind) -> Self {
        Self { kind, values: Vec::new(), known: Vec::new() }
    }

    /// How many values there are, those that are none included; 0 where none are coded, all being the same.
    pub fn count(&self) -> usize {
        self.known.len()
    }

    /// A value; `None` where it is none, or not known yet. Of a constant attribute always the one that it has.
    #[inline]
    pub fn value(&self, at: u32) -> Option<&[i32]> {
        if let Some(value) = &self.kind.constant {
            return Some(value);
        }
        if !self.known.get(at as usize).is_some_and(|&known| known) {
            return None;
        }
        let n = self.kind.integers();
        self.values.get(at as usize * n..(at as usize + 1) * n)
    }

    /// Whether there is a value, of an attribute that is not constant.
    #[inline]
    pub fn is_known(&self, at: u32) -> bool {
        self.known.get(at as usize).is_some_and(|&known| known)
    }

    /// Sets a value, or none; those before it that have not been set are none.
    pub fn set(&mut self, at: u32, value: Option<&[i32]>) {
        let (n, at) = (self.kind.integers(), at as usize);
        self.reach(at);
        if let Some(value) = value {
            self.values[at * n..(at + 1) * n].copy_from_slice(&value[..n]);
        }
        self.known[at] = value.is_some();
    }

    /// Sets the value that another one is.
    pub fn copy(&mut self, from: u32, to: u32) {
        let (n, from) = (self.kind.integers(), from as usize);
        self.reach((to as usize).max(from));
        self.values.copy_within(from * n..(from + 1) * n, to as usize * n);
        let known = self.known[from];
        self.known[to as usize] = known;
    }

    fn reach(&mut self, at: usize) {
        if at >= self.known.len() {
            self.known.resize(at + 1, false);
            self.values.resize((at + 1) * self.kind.integers(), 0);
        }
    }
}
