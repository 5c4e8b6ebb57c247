//! Which file a path leads to: two names of one file, or two files.

use super::args::is_stream;
use std::io;
use std::path::Path;

/// What tells a file from all others, whatever it is called.
#[derive(PartialEq, Eq, Hash)]
pub struct Identity(system::Key);

impl Identity {
    /// Of what is read from this path, or from standard input; `None` for what is no file.
    pub fn of_input(path: &Path) -> Option<Self> {
        if is_stream(path) { system::of_stream(&io::stdin()) } else { Self::of_file(path) }
    }

    /// Of what is written to.
    pub fn of_file(path: &Path) -> Option<Self> {
        let there = path.metadata().ok()?;
        there.is_file().then(|| system::key(path, &there)).flatten().map(Self)
    }

    /// Of what standard output leads to.
    pub fn of_output_stream() -> Option<Self> {
        system::of_stream(&io::stdout())
    }
}

#[cfg(unix)]
mod system {
    use super::{Identity, Path};
    use std::fs::{File, Metadata};
    use std::os::fd::AsFd;
    use std::os::unix::fs::MetadataExt;

    /// Device and inode.
    pub type Key = (u64, u64);

    pub fn key(_: &Path, there: &Metadata) -> Option<Key> {
        Some((there.dev(), there.ino()))
    }

    pub fn of_stream(stream: &impl AsFd) -> Option<Identity> {
        let there = File::from(stream.as_fd().try_clone_to_owned().ok()?).metadata().ok()?;
        there.is_file().then(|| Identity((there.dev(), there.ino())))
    }
}

#[cfg(not(unix))]
mod system {
    use super::{Identity, Path};

    pub type Key = std::path::PathBuf;

    pub fn key(path: &Path, _: &std::fs::Metadata) -> Option<Key> {
        path.canonicalize().ok()
    }

    pub fn of_stream<T>(_: &T) -> Option<Identity> {
        None
    }
}
