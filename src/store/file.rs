//! Files of a folder: opened at once, as that seldom has to wait for a disk, and read at once as far as they are in memory.

use std::fs::{File, Metadata};
use std::io;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use bytes::Bytes;

use super::cache::Cache;
use super::{Fault, Object, PIECE, Source, Version, fault_of};

/// An open file, whose parts may be known already.
#[derive(Debug)]
pub struct Open {
    file: Arc<File>,
    stamp: Stamp,
    /// Its path and version.
    name: Arc<str>,
    cache: Arc<Cache>,
}

/// What changes whenever a file is written to, or another takes its place.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Stamp {
    number: u64,
    /// Nanoseconds since 1970: of the last change of anything, which nobody can set, and of the bytes, which anybody can.
    changed: i128,
    modified: i128,
    bytes: u64,
    /// How many names it has. One that loses its name to another file is changed by that, though not in its bytes.
    names: u64,
}

/// The object in an open file, which lies at `path`.
///
/// # Errors
/// [`Fault`]; [`Fault::Absent`] also for what is no file.
pub async fn object(file: File, path: &Path, cache: &Arc<Cache>) -> Result<Object, Fault> {
    let (about, stamp) = settled(&file).await?;
    let (tag, bytes) = (stamp.tag(), stamp.bytes);
    let modified = about.modified().map_err(fault_of)?;
    let name = format!("{tag} {}", path.display()).into();
    let open = Open { file: Arc::new(file), stamp, name, cache: cache.clone() };
    Ok(Object { version: Version { tag, bytes, modified }, source: Source::File(Arc::new(open)) })
}

/// What there is to tell of a file, once a change from now on would give it another stamp: clocks of file systems go in steps.
async fn settled(file: &File) -> Result<(Metadata, Stamp), Fault> {
    for _ in 0..LOOKS {
        let about = file.metadata().map_err(fault_of)?;
        if !about.is_file() {
            return Err(Fault::Absent);
        }
        let stamp = Stamp::of(&about);
        let age = nanoseconds(SystemTime::now()) - stamp.changed;
        if !(0..STEP.as_nanos() as i128).contains(&age) {
            return Ok((about, stamp));
        }
        tokio::time::sleep(STEP).await;
    }
    Err(Fault::Changed)
}

impl Open {
    /// The bytes from `offset` on to the end of its piece of [`PIECE`] bytes, at least one.
    ///
    /// # Errors
    /// [`Fault::Changed`] where the file has been written to, or cut off, since it was opened.
    pub async fn read(&self, offset: u64) -> Result<Bytes, Fault> {
        let number = offset / PIECE as u64;
        let start = number * PIECE as u64;
        let key = (self.name.clone(), number);
        let piece = match self.cache.get(&key) {
            Some(piece) => piece,
            None => {
                let length = self.stamp.bytes.saturating_sub(start).min(PIECE as u64) as usize;
                let piece = read(&self.file, &self.stamp, start, length).await?;
                self.cache.put(key, piece.clone());
                piece
            }
        };
        let skip = (offset - start) as usize;
        if skip < piece.len() { Ok(piece.slice(skip..)) } else { Err(Fault::Changed) }
    }
}

impl Stamp {
    #[cfg(unix)]
    fn of(about: &Metadata) -> Self {
        use std::os::unix::fs::MetadataExt;
        let time = |seconds: i64, rest: i64| i128::from(seconds) * 1_000_000_000 + i128::from(rest);
        Self {
            number: about.ino(),
            changed: time(about.ctime(), about.ctime_nsec()),
            modified: time(about.mtime(), about.mtime_nsec()),
            bytes: about.len(),
            names: about.nlink(),
        }
    }

    #[cfg(not(unix))]
    fn of(about: &Metadata) -> Self {
        let [changed, modified] = [about.created(), about.modified()].map(|time| time.map_or(0, nanoseconds));
        Self { number: 0, changed, modified, bytes: about.len(), names: 1 }
    }

    fn tag(&self) -> String {
        format!("{:x}-{:x}-{:x}-{:x}", self.number, self.changed, self.modified, self.bytes)
    }

    /// Whether the bytes are the same by this later stamp.
    fn holds(&self, later: &Self) -> bool {
        let same = (later.bytes, later.modified) == (self.bytes, self.modified);
        same && (later.changed == self.changed || later.names != self.names)
    }
}

/// So many bytes at `offset`.
async fn read(file: &Arc<File>, stamp: &Stamp, offset: u64, length: usize) -> Result<Bytes, Fault> {
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
    let now = Stamp::of(&file.metadata().map_err(|e| Fault::Unavailable(e.to_string()))?);
    if stamp.holds(&now) { Ok(buffer.into()) } else { Err(Fault::Changed) }
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

fn nanoseconds(time: SystemTime) -> i128 {
    match time.duration_since(UNIX_EPOCH) {
        Ok(since) => since.as_nanos() as i128,
        Err(before) => -(before.duration().as_nanos() as i128),
    }
}

/// Longer than the steps of the clock that files are stamped with (10 ms at the most on Linux).
const STEP: Duration = Duration::from_millis(20);
/// How often a file that is just being written to is looked at.
const LOOKS: u32 = 3;
