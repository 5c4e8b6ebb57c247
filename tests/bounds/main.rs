//! What a file may cost: memory as the allocator counts it, work in units, whatever the file.
#![cfg(all(feature = "cli", feature = "fuzzing"))]

mod files;
mod hostile;
mod memory;
mod system;
mod work;

use peak_alloc::PeakAlloc;
use std::sync::{Mutex, MutexGuard, PoisonError};

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// The allocator counts for all threads together: one test at a time.
fn alone() -> MutexGuard<'static, ()> {
    static TURN: Mutex<()> = Mutex::new(());
    TURN.lock().unwrap_or_else(PoisonError::into_inner)
}

/// What `run` returns, and the most bytes that it held beyond those there were before.
fn peak_of<T>(run: impl FnOnce() -> T) -> (T, u64) {
    let before = MEMORY.current_usage();
    MEMORY.reset_peak_usage();
    let result = run();
    (result, MEMORY.peak_usage().saturating_sub(before) as u64)
}

/// Bytes that a decoder may hold beside what it debits: its models, a few atoms, an atom's events and a chunk of operations.
const BESIDE: u64 = 1 << 20;
