//! One page of caps: what a file may ask for before it is refused (spec §3.6).

use crate::error::{Error, Result};

/// Most bytes of one atom (spec §3.3).
pub const MAX_ATOM_BYTES: u32 = 64 * 1024;
/// Most atoms in a file.
pub const MAX_ATOMS: u32 = 1 << 20;
/// Most levels in a file, the base included.
pub const MAX_LEVELS: u32 = 4096;
/// Largest part of a vertex's height over its edge by which the ends of the edge move, in 64ths (spec §5.4.5).
pub const MAX_LIFTING: u8 = 32;
/// Most attributes of a mesh (spec §3.2).
pub const MAX_ATTRIBUTES: u8 = 64;
/// Most resources of a file (spec §3.3).
pub const MAX_RESOURCES: u32 = 1 << 16;
/// Most bytes of the scene's JSON once it is inflated (spec §3.9).
pub const MAX_SCENE_BYTES: u32 = 1 << 26;
/// Most vertices or triangles; corner indices stay below 2^32.
pub const MAX_ELEMENTS: u32 = 1 << 30;
/// Most bytes of the table of contents, its checksum included: its length has three bytes (spec §3.2).
pub const MAX_TABLE_BYTES: u32 = (1 << 24) - 1;
/// Most bytes of the metadata chunk (spec §3.5).
pub const MAX_METADATA_BYTES: usize = 1 << 20;

/// Triangles of all levels but the finest together, at most, beside [`MAX_WALKED_A_TRIANGLE`] for each of level 0 (spec §3.6).
pub const MAX_WALKED: u64 = 1 << 24;
/// See [`MAX_WALKED`].
pub const MAX_WALKED_A_TRIANGLE: u64 = 32;

/// How many triangles the levels above level 0 may have together, where level 0 has so many: each of them is walked once.
pub fn max_walked(triangles: u32) -> u64 {
    MAX_WALKED + MAX_WALKED_A_TRIANGLE * u64::from(triangles)
}

/// Units of work that any file may take (spec §3.6).
pub const FREE_WORK: u64 = 1 << 28;
/// Units of work that a file may take beyond [`FREE_WORK`] for each byte of its atoms that has arrived.
pub const WORK_A_BYTE: u64 = 1 << 13;

/// Units of work for each triangle of a mesh that is walked.
pub(crate) const WORK_A_SLOT: u64 = 4;
/// Units of work for an operation.
pub(crate) const WORK_AN_OPERATION: u64 = 16;
/// Units of work for a step of a precision pass.
pub(crate) const WORK_A_STEP: u64 = 2;

/// What a decoder may spend.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Bytes of memory, 1 GiB by default.
    pub memory: u64,
    /// Units of work, 2^32 by default; visiting a triangle in a walk or decoding a decision is one. Fewer are allowed where few bytes
    /// have arrived: [`FREE_WORK`] and [`WORK_A_BYTE`].
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
    /// Units of work done.
    work: u64,
    /// Bytes that have arrived.
    bytes: u64,
}

impl Budget {
    /// A full budget.
    pub fn new(limits: Limits) -> Self {
        Self { limits, memory: limits.memory, work: 0, bytes: 0 }
    }

    /// The budget of a writer, who knows what is coming.
    #[cfg(feature = "encode")]
    pub fn unlimited() -> Self {
        Self { bytes: u64::MAX, ..Self::by_bytes() }
    }

    /// One that only the bytes limit which arrive.
    #[cfg(feature = "encode")]
    pub(crate) fn by_bytes() -> Self {
        Self::new(Limits { memory: u64::MAX, work: u64::MAX })
    }

    /// So many more bytes have arrived, and may be worked on.
    pub fn receive(&mut self, bytes: usize) {
        self.bytes = self.bytes.saturating_add(bytes as u64);
    }

    /// Units of work done so far.
    pub fn work(&self) -> u64 {
        self.work
    }

    /// Debits memory for `count` items of `size` bytes.
    ///
    /// # Errors
    /// [`Error::Limit`] where that is more than what is left, [`Error::Memory`] where the system has not so much.
    pub fn take_memory(&mut self, count: usize, size: usize) -> Result<()> {
        let bytes = (count as u64).saturating_mul(size as u64);
        if bytes > self.memory {
            let needed = (self.limits.memory - self.memory).saturating_add(bytes);
            return Err(Error::Limit { what: "memory in bytes", needed, allowed: self.limits.memory });
        }
        if bytes >= PROBED && self.limits.memory != u64::MAX {
            probe(bytes)?;
        }
        self.memory -= bytes;
        Ok(())
    }

    /// Gives back memory taken for `count` items of `size` bytes.
    pub fn give_memory(&mut self, count: usize, size: usize) {
        let bytes = (count as u64).saturating_mul(size as u64);
        self.memory = self.memory.saturating_add(bytes).min(self.limits.memory);
    }

    /// Exchanges memory `held` for as much as `wanted`. What grows is copied, and both are there for a moment.
    ///
    /// # Errors
    /// [`Error::Limit`] where there is not enough left for both; what is held stays.
    pub fn exchange(&mut self, held: &mut usize, wanted: usize) -> Result<()> {
        if wanted > *held {
            self.take_memory(wanted, 1)?;
            self.give_memory(*held, 1);
        } else {
            self.give_memory(*held - wanted, 1);
        }
        *held = wanted;
        Ok(())
    }

    /// Takes, or gives back, what is lacking of `wanted` bytes beside those `held`.
    ///
    /// # Errors
    /// [`Error::Limit`] where there is not so much left; what is held stays.
    pub fn hold(&mut self, held: &mut usize, wanted: usize) -> Result<()> {
        self.take_memory(wanted.saturating_sub(*held), 1)?;
        self.give_memory(held.saturating_sub(wanted), 1);
        *held = wanted;
        Ok(())
    }

    /// Debits units of work.
    ///
    /// # Errors
    /// [`Error::Limit`] where that is more than what is left, or more than the bytes that have arrived may take.
    pub fn take_work(&mut self, units: u64) -> Result<()> {
        let needed = self.work.saturating_add(units);
        let earned = FREE_WORK.saturating_add(self.bytes.saturating_mul(WORK_A_BYTE));
        if needed > self.limits.work {
            return Err(Error::Limit { what: "work in steps", needed, allowed: self.limits.work });
        }
        if needed > earned {
            let what = "work in steps for so few bytes";
            return Err(Error::Limit { what, needed, allowed: earned });
        }
        self.work = needed;
        Ok(())
    }
}

/// Asks the system for so many bytes, and gives them back untouched: most lists end the program where they find no memory.
///
/// # Errors
/// [`Error::Memory`] where there are not so many.
fn probe(bytes: u64) -> Result<()> {
    // Memory of WebAssembly is never given back.
    let wanted = if cfg!(target_family = "wasm") { 0 } else { bytes.saturating_add(PROBED) };
    let mut list: Vec<u8> = Vec::new();
    let wanted = usize::try_from(wanted).map_err(|_| Error::Memory { bytes })?;
    list.try_reserve_exact(wanted).map_err(|_| Error::Memory { bytes })?;
    // Who does not look at a list does not ask for it either.
    std::hint::black_box(&list);
    Ok(())
}

/// Bytes from which on the system is asked, and that are to be left for all that is smaller.
const PROBED: u64 = 256 << 10;

/// Makes room for exactly so many more items, which have been debited.
///
/// # Errors
/// [`Error::Memory`] where the system has not so much.
pub fn make_room<T>(list: &mut Vec<T>, more: usize) -> Result<()> {
    let bytes = (more as u64).saturating_mul(size_of::<T>() as u64);
    list.try_reserve_exact(more).map_err(|_| Error::Memory { bytes })
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
        assert_eq!(budget.work(), 10);
    }

    #[test]
    fn what_grows_is_there_twice_for_a_moment() {
        let mut budget = Budget::new(Limits { memory: 100, work: 0 });
        let mut held = 0;
        budget.exchange(&mut held, 40).unwrap();
        budget.exchange(&mut held, 60).unwrap();
        assert!(budget.exchange(&mut held, 61).is_err());
        assert_eq!(held, 60);
        budget.exchange(&mut held, 10).unwrap();
        budget.take_memory(90, 1).unwrap();
        assert!(budget.take_memory(1, 1).is_err());
    }

    #[test]
    fn allowed_memory_that_the_system_has_not() {
        let mut budget = Budget::new(Limits { memory: u64::MAX - 1, work: 0 });
        let bytes = u64::MAX / 2;
        assert!(
            matches!(budget.take_memory(bytes as usize, 1), Err(Error::Memory { bytes: b }) if b == bytes)
        );
        budget.take_memory(1 << 20, 1).unwrap();
    }

    #[test]
    fn bytes_earn_work() {
        let mut budget = Budget::new(Limits::default());
        budget.take_work(1 << 28).unwrap();
        let fault = budget.take_work(1).unwrap_err();
        assert_eq!(
            fault.to_string(),
            "limit reached: work in steps for so few bytes needs 268435457, allowed 268435456"
        );
        budget.receive(2);
        budget.take_work(16_384).unwrap();
        assert!(budget.take_work(1).is_err());
        budget.receive(usize::MAX);
        budget.take_work((1 << 32) - (1 << 28) - 16_384).unwrap();
        assert!(matches!(budget.take_work(1), Err(Error::Limit { what: "work in steps", .. })));
    }

    #[test]
    fn room_that_no_system_has() {
        let mut list: Vec<[u64; 4]> = Vec::new();
        assert!(matches!(make_room(&mut list, usize::MAX / 64), Err(Error::Memory { .. })));
        make_room(&mut list, 10).unwrap();
        assert!(list.capacity() >= 10);
    }
}
