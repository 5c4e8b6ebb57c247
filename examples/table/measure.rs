//! Time, memory, and the means of what was measured.

use peak_alloc::PeakAlloc;
use rustix::time::{ClockId, clock_gettime};
use unweld::decoder;
use unweld::limits::Limits;

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// Seconds of CPU time that this thread takes for `work`.
pub fn seconds<T>(work: impl FnOnce() -> T) -> (f64, T) {
    let start = thread_time();
    let result = work();
    (thread_time() - start, result)
}

/// Bytes that `work` allocates at its peak, its result included, above what is there before.
pub fn peak<T>(work: impl FnOnce() -> T) -> (usize, T) {
    let before = MEMORY.current_usage();
    MEMORY.reset_peak_usage();
    let result = work();
    (MEMORY.peak_usage().saturating_sub(before), result)
}

/// Decoding without a bound: with one, memory is asked of the system beforehand and given back, which would count although nobody
/// touches it.
pub fn unbounded() -> decoder::Options {
    let limits = Limits { memory: u64::MAX, ..Limits::default() };
    decoder::Options { limits, ..decoder::Options::default() }
}

/// The middle one, or the mean of the two in the middle; 0 of none.
pub fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    match values.len() {
        0 => 0.0,
        n => (values[(n - 1) / 2] + values[n / 2]) / 2.0,
    }
}

/// The geometric mean of positive numbers; `None` of none.
pub fn geometric_mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, count) = values.fold((0.0, 0), |(sum, count), x| (sum + x.ln(), count + 1));
    (count > 0).then(|| (sum / f64::from(count)).exp())
}

fn thread_time() -> f64 {
    let time = clock_gettime(ClockId::ThreadCPUTime);
    time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means() {
        assert_eq!(median(vec![3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(vec![4.0, 1.0]), 2.5);
        assert!((geometric_mean([2.0, 8.0].into_iter()).unwrap() - 4.0).abs() < 1e-12);
        assert_eq!(geometric_mean(std::iter::empty()), None);
    }

    #[test]
    fn the_peak_counts_what_is_freed_again() {
        let (bytes, ()) = peak(|| drop(vec![1u8; 1 << 20]));
        assert!(bytes >= 1 << 20, "{bytes}");
    }
}
