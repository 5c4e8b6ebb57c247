//! One page of caps: what a file may ask for before it is refused (spec §3.6).

use crate::error::{Error, Result};

/// Most bytes of one atom (spec §3.3).
pub const MAX_ATOM_BYTES: u32 = 64 * 1024;
/// Most atoms in a file.
pub const MAX_ATOMS: u32 = 1 << 20;
/// Most levels in a file, the base included.
pub const MAX_LEVELS: u32 = 4096;
/// Most vertices or triangles; corner indices stay below 2^32.
pub const MAX_ELEMENTS: u32 = 1 << 30;
/// Most bytes of the table of contents, its checksum included (spec §3.3).
pub const MAX_TABLE_BYTES: u32 = 64 << 20;
/// Most bytes of the metadata chunk (spec §3.5).
pub const MAX_METADATA_BYTES: usize = 1 << 20;

/// What a decoder may spend.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Bytes of memory, 1 GiB by default.
    pub memory: u64,
    /// Units of work, 2^32 by default; visiting a triangle in a walk or decoding a decision is one.
    pub work: u64,
}

impl Default for Limits {
    fn default() -> Self {
        Self { memory: 1 << 30, work: 1 << 32 }
    }
}

/// What is left of the [`Limits`]; debited before anything is reserved.
#[derive(Clone, Debug)]
pub struct Budget {
    limits: Limits,
    memory: u64,
    work: u64,
}

impl Budget {
    /// A full budget.
    pub fn new(limits: Limits) -> Self {
        Self { limits, memory: limits.memory, work: limits.work }
    }

    /// Debits memory for `count` items of `size` bytes.
    ///
    /// # Errors
    /// [`Error::Limit`] where that is more than what is left.
    pub fn take_memory(&mut self, count: usize, size: usize) -> Result<()> {
        let bytes = (count as u64).saturating_mul(size as u64);
        if bytes > self.memory {
            let needed = (self.limits.memory - self.memory).saturating_add(bytes);
            return Err(Error::Limit { what: "memory in bytes", needed, allowed: self.limits.memory });
        }
        self.memory -= bytes;
        Ok(())
    }

    /// Gives back memory taken for `count` items of `size` bytes.
    pub fn give_memory(&mut self, count: usize, size: usize) {
        let bytes = (count as u64).saturating_mul(size as u64);
        self.memory = self.memory.saturating_add(bytes).min(self.limits.memory);
    }

    /// Debits units of work.
    ///
    /// # Errors
    /// [`Error::Limit`] where that is more than what is left.
    pub fn take_work(&mut self, units: u64) -> Result<()> {
        if units > self.work {
            let needed = (self.limits.work - self.work).saturating_add(units);
            return Err(Error::Limit { what: "work in steps", needed, allowed: self.limits.work });
        }
        self.work -= units;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_budget_is_debited_and_refuses() {
        let mut budget = Budget::new(Limits { memory: 100, work: 10 });
        budget.take_memory(9, 10).unwrap();
        assert!(matches!(budget.take_memory(2, 10), Err(Error::Limit { needed: 110, allowed: 100, .. })));
        budget.give_memory(1, 10);
        budget.take_memory(2, 10).unwrap();
        assert!(budget.take_memory(usize::MAX, 16).is_err());
        budget.take_work(10).unwrap();
        assert!(budget.take_work(1).is_err());
    }
}
