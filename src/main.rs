//! The command line.

mod cli;

use peak_alloc::PeakAlloc;
use std::process::ExitCode;

/// Counts allocations, so that `encode` can tell its peak of memory.
#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

fn main() -> ExitCode {
    cli::run()
}
