//! The values of one attribute, as integers.

use crate::mesh::attributes::Kind;
use crate::mesh::prefetch::prefetch;

/// The values of one attribute: by wedge, or by row of triangles.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    /// What they are.
    pub kind: Kind,
    /// Integers a value.
    integers: usize,
    values: Vec<i32>,
    known: Vec<bool>,
    /// How many of the first are known, at least.
    all: usize,
}

impl Column {
    /// No values yet.
    pub fn new(kind: Kind) -> Self {
        Self { integers: kind.integers(), kind, values: Vec::new(), known: Vec::new(), all: 0 }
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
        Some(self.there(at))
    }

    /// A value that is there, of an attribute that is not constant.
    #[inline]
    pub fn there(&self, at: u32) -> &[i32] {
        let (n, at) = (self.integers, at as usize);
        self.values.get(at * n..(at + 1) * n).unwrap_or(&[])
    }

    /// Asks for a value to be brought into the caches.
    #[inline(always)]
    pub fn prefetch(&self, at: u32) {
        if let Some(value) = self.values.get(at as usize * self.integers) {
            prefetch(value);
        }
    }

    /// Integers a value.
    #[inline]
    pub fn integers(&self) -> usize {
        self.integers
    }

    /// Whether there is a value, of an attribute that is not constant.
    #[inline]
    pub fn is_known(&self, at: u32) -> bool {
        self.known.get(at as usize).is_some_and(|&known| known)
    }

    /// Whether there are all values up to one, of an attribute that is not constant; it may be that there are, and not known.
    #[inline]
    pub fn are_known(&self, up_to: u32) -> bool {
        (up_to as usize) < self.all
    }

    /// Sets a value, or none; those before it that have not been set are none.
    pub fn set(&mut self, at: u32, value: Option<&[i32]>) {
        let (n, at) = (self.integers, at as usize);
        if let Some(value) = value
            && at == self.known.len()
        {
            self.all += usize::from(self.all == at);
            self.known.push(true);
            // Most have two, and a call to copy these would take longer.
            match value[..n] {
                [a, b] => self.values.extend([a, b]),
                _ => self.values.extend_from_slice(&value[..n]),
            }
            return;
        }
        self.reach(at);
        if let Some(value) = value {
            self.values[at * n..(at + 1) * n].copy_from_slice(&value[..n]);
        }
        self.known[at] = value.is_some();
        self.found(at);
    }

    /// Sets the value that another one is.
    pub fn copy(&mut self, from: u32, to: u32) {
        let (n, from) = (self.integers, from as usize);
        self.reach((to as usize).max(from));
        self.values.copy_within(from * n..(from + 1) * n, to as usize * n);
        let known = self.known[from];
        self.known[to as usize] = known;
        self.found(to as usize);
    }

    /// Whether one is known has been told.
    fn found(&mut self, at: usize) {
        if !self.known[at] {
            self.all = self.all.min(at);
        }
        while self.all >= at && self.known.get(self.all).is_some_and(|&known| known) {
            self.all += 1;
        }
    }

    fn reach(&mut self, at: usize) {
        if at >= self.known.len() {
            self.known.resize(at + 1, false);
            self.values.resize((at + 1) * self.integers, 0);
        }
    }
}
