//! Bytes of a source, as many at a time as are wanted.

use std::ops::Range;

use bytes::Bytes;

use super::source::RangeSource;
use crate::container::{Header, SetContents};
use crate::error::{FormatError, Result};

/// A source, and what it has given that nobody has taken yet.
#[derive(Debug)]
pub struct Feed<S> {
    source: S,
    /// What has not been taken, and where it stands in the file.
    rest: Bytes,
    at: u64,
}

impl<S: RangeSource> Feed<S> {
    pub fn new(source: S) -> Self {
        Self { source, rest: Bytes::new(), at: 0 }
    }

    pub fn source(&self) -> &S {
        &self.source
    }

    /// Up to `most` bytes of `range`, from its start on; what the source gives beyond them is kept.
    pub async fn take(&mut self, range: Range<u64>, most: usize) -> Result<Bytes> {
        if self.rest.is_empty() || self.at != range.start {
            let length = usize::try_from(range.end - range.start).unwrap_or(usize::MAX);
            self.rest = self.source.read(range.clone()).await?;
            self.rest.truncate(length);
            self.at = range.start;
        }
        let piece = self.rest.split_to(most.min(self.rest.len()));
        self.at += piece.len() as u64;
        Ok(piece)
    }

    /// All bytes of `range`; those behind it up to `end` are to follow.
    ///
    /// # Errors
    /// Those of the source, and where it ends before.
    pub async fn all(&mut self, range: Range<u64>, end: u64) -> Result<Bytes> {
        let length = usize::try_from(range.end - range.start).unwrap_or(usize::MAX);
        let mut bytes = self.take(range.start..end, length).await?;
        if bytes.len() < length && !bytes.is_empty() {
            let mut parts = Vec::from(bytes);
            while parts.len() < length {
                let piece = self.take(range.start + parts.len() as u64..end, length - parts.len()).await?;
                if piece.is_empty() {
                    break;
                }
                parts.extend_from_slice(&piece);
            }
            bytes = parts.into();
        }
        if bytes.len() < length {
            return Err(cut_off(range.start + bytes.len() as u64, end).into());
        }
        Ok(bytes)
    }

    /// That the source does not end before `end`, if it knows.
    ///
    /// # Errors
    /// Where it does.
    pub fn check_length(&self, end: u64) -> Result<()> {
        match self.source.length().filter(|&length| length < end) {
            Some(length) => Err(cut_off(length, end).into()),
            None => Ok(()),
        }
    }

    /// That there is nothing from byte `end` on, where the last atom ends.
    ///
    /// # Errors
    /// Where there is.
    pub async fn check_end(&mut self, end: u64) -> Result<()> {
        let more = match self.source.length() {
            Some(length) => length.saturating_sub(end),
            None => self.take(end..u64::MAX, usize::MAX).await?.len() as u64,
        };
        match more {
            0 => Ok(()),
            _ => Err(FormatError::new(end, "3.1", format!("{more} bytes behind the last atom")).into()),
        }
    }
}

/// A source whose first bytes have been looked at: they tell a mesh from a set of meshes.
#[derive(Debug)]
pub struct Begun<S> {
    source: S,
    first: Bytes,
}

impl<S: RangeSource> Begun<S> {
    /// Asks for the first `first` bytes and waits for a few of them. Whoever goes on, a [`Transfer`](super::Transfer) or a
    /// [`SetTransfer`](super::SetTransfer), asks for as many: it is the same request.
    ///
    /// # Errors
    /// Those of the source.
    pub async fn new(mut source: S, first: u64) -> Result<Self> {
        let first = first.max(Header::SIZE as u64);
        let mut bytes = source.read(0..first).await?;
        while bytes.len() < Header::SIZE {
            let more = source.read(bytes.len() as u64..first).await?;
            if more.is_empty() {
                break;
            }
            bytes = [bytes, more].concat().into();
        }
        Ok(Self { source, first: bytes })
    }

    /// Whether the file is a set of meshes.
    pub fn is_set(&self) -> bool {
        SetContents::is_set(&self.first)
    }

    /// Where the bytes come from.
    pub fn source(&self) -> &S {
        &self.source
    }
}

impl<S: RangeSource> RangeSource for Begun<S> {
    async fn read(&mut self, range: Range<u64>) -> std::io::Result<Bytes> {
        let known = self.first.len() as u64;
        if range.start < known {
            return Ok(self.first.slice(range.start as usize..range.end.min(known) as usize));
        }
        self.source.read(range).await
    }

    fn length(&self) -> Option<u64> {
        self.source.length()
    }
}

/// The fault of a source that ends at `at` and not, as it should, at `end`.
pub fn cut_off(at: u64, end: u64) -> FormatError {
    let what = format!("the file is cut off: {} bytes are missing", end.saturating_sub(at));
    FormatError::new(at, "3.1", what)
}
