//! Signals that end the process: unfinished files go first.

use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// A file that must not outlive the process; the guard is dropped once it may.
pub struct Unfinished(PathBuf);

impl Unfinished {
    /// Makes a file, with no moment between its making and its being known. `path` tells where it is.
    ///
    /// # Errors
    /// Those of `make`.
    pub fn make<T>(
        make: impl FnOnce() -> io::Result<T>,
        path: impl FnOnce(&T) -> &Path,
    ) -> io::Result<(T, Self)> {
        system::watch();
        let mut files = unfinished();
        let made = make()?;
        let path = path(&made).to_owned();
        files.push(path.clone());
        Ok((made, Self(path)))
    }
}

impl Drop for Unfinished {
    fn drop(&mut self) {
        unfinished().retain(|path| *path != self.0);
    }
}

/// Makes writing beyond the largest size allowed (`ulimit -f`) an error like any other, instead of the end.
pub fn survive_large_files() {
    system::survive_large_files();
}

/// Ready once the process is interrupted or terminated. While it is waited for, and from the signal on, the first signal is left to whoever
/// waits; a second one ends the process at once.
///
/// # Errors
/// Those of the system.
pub fn stopped() -> anyhow::Result<impl Future<Output = ()>> {
    let stop = system::stop()?;
    let waiting = Waiting::new();
    Ok(async move {
        stop.await;
        // Who has been told is about to end: nobody else should see to it.
        std::mem::forget(waiting);
    })
}

/// Somebody who ends in good order after a signal.
struct Waiting;

impl Waiting {
    fn new() -> Self {
        WAITING.fetch_add(1, Ordering::SeqCst);
        Self
    }
}

impl Drop for Waiting {
    fn drop(&mut self) {
        WAITING.fetch_sub(1, Ordering::SeqCst);
    }
}

fn unfinished() -> MutexGuard<'static, Vec<PathBuf>> {
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(unix)]
mod system {
    use super::{Ordering, WAITING, unfinished};
    use signal_hook::consts::{SIGHUP, SIGINT, SIGQUIT, SIGTERM, SIGXFSZ};
    use signal_hook::iterator::Signals;
    use signal_hook::low_level::emulate_default_handler;
    use std::sync::{Arc, Once};
    use tokio::signal::unix::{SignalKind, signal};

    /// Watches for signals from now on, in a thread. Without one, files of a process that ends early stay.
    pub fn watch() {
        static ONCE: Once = Once::new();
        ONCE.call_once(|| {
            let ignored = ignored();
            let heard =
                [SIGHUP, SIGINT, SIGQUIT, SIGTERM].into_iter().filter(|n| ignored >> (n - 1) & 1 == 0);
            if let Ok(signals) = Signals::new(heard) {
                let _ = std::thread::Builder::new().spawn(|| end(signals));
            }
        });
    }

    fn end(mut signals: Signals) {
        let mut warned = false;
        for signal in signals.forever() {
            if WAITING.load(Ordering::SeqCst) > 0 && !warned {
                warned = true;
                continue;
            }
            // Held to the end, so that no other file is begun.
            let files = unfinished();
            for file in files.iter() {
                let _ = std::fs::remove_file(file);
            }
            let _ = emulate_default_handler(signal);
        }
    }

    /// Signals that whoever started the process wants ignored, as `nohup` and shells do for what runs in the background: bit n - 1 for signal n.
    fn ignored() -> u64 {
        let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
        let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
        mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or(0)
    }

    /// A signal that is heard does not end the process.
    pub fn survive_large_files() {
        let _ = signal_hook::flag::register(SIGXFSZ, Arc::default());
    }

    pub fn stop() -> anyhow::Result<impl Future<Output = ()>> {
        let (mut interrupted, mut terminated) =
            (signal(SignalKind::interrupt())?, signal(SignalKind::terminate())?);
        Ok(async move {
            tokio::select! {
                _ = interrupted.recv() => {}
                _ = terminated.recv() => {}
            }
        })
    }
}

#[cfg(not(unix))]
mod system {
    pub fn watch() {}

    pub fn survive_large_files() {}

    pub fn stop() -> anyhow::Result<impl Future<Output = ()>> {
        Ok(async { drop(tokio::signal::ctrl_c().await) })
    }
}

static UNFINISHED: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());
static WAITING: AtomicUsize = AtomicUsize::new(0);
