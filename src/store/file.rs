//! Files of a folder: opened at once, as that seldom has to wait for a disk, and read at once as far as they are in memory.

use std::fs::{File, Metadata, OpenOptions};
use std::io;
use std::path::Path;
use std::sync::Arc;

use bytes::Bytes;

use super::cache::Cache;
use super::{Fault, Object, PIECE, Source, Version};

/// An open file, whose parts may be known already.
#[derive(Debug)]
pub struct Open {
    file: Arc<File>,
    /// Its path and version.
    name: Arc<str>,
    cache: Arc<Cache>,
}

/// Opens a file. Its tag is made of what changes whenever another takes its place.
///
/// # Errors
/// [`Fault`]; [`Fault::Absent`] also for what is there, but no file.
pub fn open(path: &Path, cache: &Arc<Cache>) -> Result<Object, Fault> {
    let mut options = OpenOptions::new();
    options.read(true);
    #[cfg(unix)]
    {
        use std::os::unix::fs::OpenOptionsExt;
        // A pipe that nobody writes to would hold up the opening; of files this changes nothing.
        options.custom_flags(rustix::fs::OFlags::NONBLOCK.bits() as i32);
    }
    let fault = |e: io::Error| match e.kind() {
        io::ErrorKind::NotFound | io::ErrorKind::NotADirectory | io::ErrorKind::InvalidFilename => {
            Fault::Absent
        }
        io::ErrorKind::PermissionDenied => Fault::Refused(e.to_string()),
        _ => Fault::Unavailable(e.to_string()),
    };
    let file = options.open(path).map_err(fault)?;
    let about = file.metadata().map_err(fault)?;
    if !about.is_file() {
        return Err(Fault::Absent);
    }
    let modified = about.modified().map_err(fault)?;
    let tag = format!("{:x}-{:x}-{:x}", number(&about), micros(modified).unwrap_or(0), about.len());
    let file =
        Open { file: Arc::new(file), name: format!("{tag} {}", path.display()).into(), cache: cache.clone() };
    Ok(Object {
        version: Version { tag, bytes: about.len(), modified },
        source: Source::File(Arc::new(file)),
    })
}

impl Open {
    /// The bytes from `offset` on to the end of its piece of [`PIECE`] bytes, at least one.
    ///
    /// # Errors
    /// [`Fault::Changed`] where the file has been written to, or cut off, since `version` was told.
    pub async fn read(&self, version: &Version, offset: u64) -> Result<Bytes, Fault> {
        let number = offset / PIECE as u64;
        let start = number * PIECE as u64;
        let key = (self.name.clone(), number);
        let piece = match self.cache.get(&key) {
            Some(piece) => piece,
            None => {
                let length = version.bytes.saturating_sub(start).min(PIECE as u64) as usize;
                let piece = read(&self.file, version, start, length).await?;
                self.cache.put(key, piece.clone());
                piece
            }
        };
        let skip = (offset - start) as usize;
        if skip < piece.len() { Ok(piece.slice(skip..)) } else { Err(Fault::Changed) }
    }
}

/// Another one for every file that is there at a time, where the system has such numbers.
#[cfg(unix)]
fn number(about: &Metadata) -> u64 {
    std::os::unix::fs::MetadataExt::ino(about)
}

#[cfg(not(unix))]
fn number(_: &Metadata) -> u64 {
    0
}

/// So many bytes at `offset`.
async fn read(file: &Arc<File>, version: &Version, offset: u64, length: usize) -> Result<Bytes, Fault> {
    let mut buffer = vec![0; length];
    if at_hand(file, &mut buffer, offset) != Some(length) {
        let file = file.clone();
        let waiting = tokio::task::spawn_blocking(move || {
            let outcome = read_exact_at(&file, &mut buffer, offset);
            (outcome, buffer)
        });
        let (outcome, filled) = waiting.await.map_err(|e| Fault::Unavailable(e.to_string()))?;
        buffer = filled;
        outcome.map_err(|e| match e.kind() {
            io::ErrorKind::UnexpectedEof => Fault::Changed,
            _ => Fault::Unavailable(e.to_string()),
        })?;
    }
    let now = file.metadata().map_err(|e| Fault::Unavailable(e.to_string()))?;
    let same = now.len() == version.bytes
        && now.modified().is_ok_and(|time| micros(time) == micros(version.modified));
    if same { Ok(buffer.into()) } else { Err(Fault::Changed) }
}

/// Reads what the system holds in memory, without waiting for a disk; `None` where it would have to wait, or cannot tell.
#[cfg(target_os = "linux")]
fn at_hand(file: &File, buffer: &mut [u8], offset: u64) -> Option<usize> {
    use rustix::io::{ReadWriteFlags, preadv2};
    preadv2(file, &mut [io::IoSliceMut::new(buffer)], offset, ReadWriteFlags::NOWAIT).ok()
}

#[cfg(not(target_os = "linux"))]
fn at_hand(_: &File, _: &mut [u8], _: u64) -> Option<usize> {
    None
}

#[cfg(unix)]
fn read_exact_at(file: &File, buffer: &mut [u8], offset: u64) -> io::Result<()> {
    std::os::unix::fs::FileExt::read_exact_at(file, buffer, offset)
}

#[cfg(windows)]
fn read_exact_at(file: &File, mut buffer: &mut [u8], mut offset: u64) -> io::Result<()> {
    while !buffer.is_empty() {
        let count = std::os::windows::fs::FileExt::seek_read(file, buffer, offset)?;
        if count == 0 {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        (buffer, offset) = (&mut buffer[count..], offset + count as u64);
    }
    Ok(())
}

/// What versions are compared by.
fn micros(time: std::time::SystemTime) -> Option<u128> {
    time.duration_since(std::time::UNIX_EPOCH).ok().map(|since| since.as_micros())
}
