//! Memory taken, as counted by the allocator.

use peak_alloc::PeakAlloc;

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// Most bytes held at a time so far.
pub fn peak() -> u64 {
    MEMORY.peak_usage() as u64
}
