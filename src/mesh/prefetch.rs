//! Memory asked for before it is needed.

/// Asks for something to be brought into the caches, where there is a way to; nothing else happens.
#[inline(always)]
pub fn prefetch<T>(what: &T) {
    #[cfg(target_arch = "x86_64")]
    safe_arch::prefetch_t0(what);
    #[cfg(not(target_arch = "x86_64"))]
    let _ = what;
}
