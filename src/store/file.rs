//! Reading a file of which something may be in memory already.

use std::fs::File;
use std::io;
use std::sync::Arc;

use bytes::Bytes;

use super::{Fault, Version};

/// Up to `length` bytes at `offset`, at least one.
///
/// # Errors
/// [`Fault::Changed`] where the file has been written to, or cut off, since `version` was told.
pub async fn read(file: &Arc<File>, version: &Version, offset: u64, length: usize) -> Result<Bytes, Fault> {
    let mut buffer = vec![0; length];
    let count = match at_hand(file, &mut buffer, offset) {
        Some(count) => count,
        None => {
            let file = file.clone();
            let waiting = tokio::task::spawn_blocking(move || {
                let outcome = read_at(&file, &mut buffer, offset);
                (outcome, buffer)
            });
            let (outcome, filled) = waiting.await.map_err(|e| Fault::Unavailable(e.to_string()))?;
            buffer = filled;
            outcome.map_err(|e| Fault::Unavailable(e.to_string()))?
        }
    };
    let now = file.metadata().map_err(|e| Fault::Unavailable(e.to_string()))?;
    let same = now.len() == version.bytes
        && now.modified().is_ok_and(|time| micros(time) == micros(version.modified));
    if count == 0 || !same {
        return Err(Fault::Changed);
    }
    buffer.truncate(count);
    Ok(buffer.into())
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
fn read_at(file: &File, buffer: &mut [u8], offset: u64) -> io::Result<usize> {
    std::os::unix::fs::FileExt::read_at(file, buffer, offset)
}

#[cfg(windows)]
fn read_at(file: &File, buffer: &mut [u8], offset: u64) -> io::Result<usize> {
    std::os::windows::fs::FileExt::seek_read(file, buffer, offset)
}

/// What versions are compared by.
fn micros(time: std::time::SystemTime) -> Option<u128> {
    time.duration_since(std::time::UNIX_EPOCH).ok().map(|since| since.as_micros())
}
