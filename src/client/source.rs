//! Where bytes come from, and what can go wrong there.

use std::future::Future;
use std::io;
use std::ops::Range;

use bytes::Bytes;

use crate::error::Error;

/// One version of a file, to be read from any place on.
///
/// An error of kind [`io::ErrorKind::Other`] that holds a [`Fault`] tells more than the medium would; a source that comes to bytes
/// of another version ends with [`Fault::Changed`] and never mixes the two.
pub trait RangeSource: Send {
    /// The next bytes of `range`, from its start on: at least one and at most as many as it is long; none where the file ends at its
    /// start or before. An end of [`u64::MAX`] is that of the file.
    ///
    /// Whoever goes on calls again with the range's rest, so a source may answer all of these calls by one request.
    fn read(&mut self, range: Range<u64>) -> impl Future<Output = io::Result<Bytes>> + Send;

    /// Bytes of the whole file, once known.
    fn length(&self) -> Option<u64> {
        None
    }
}

/// A file in memory.
impl RangeSource for Bytes {
    async fn read(&mut self, range: Range<u64>) -> io::Result<Bytes> {
        let place = |at: u64| usize::try_from(at).unwrap_or(usize::MAX).min(self.len());
        let (start, end) = (place(range.start), place(range.end));
        Ok(self.slice(start..end.max(start)))
    }

    fn length(&self) -> Option<u64> {
        Some(self.len() as u64)
    }
}

/// Why a source does not give what it should; inside of [`Error::Io`], where [`Fault::of`] finds it.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Fault {
    /// Another version lies there by now: what was read before is not of it.
    #[error("the file was replaced while it was read")]
    Changed,
    /// It will not be had, however often it is asked for.
    #[error("the server refuses: {0}")]
    Refused(String),
    /// It could not be had, again and again.
    #[error("{what} (given up after {tries})", tries = times(*.tries))]
    Unavailable {
        /// What went wrong last.
        what: String,
        /// How often it was tried.
        tries: u32,
    },
    /// The answer is not one that HTTP allows for what was asked.
    #[error("the server's answer makes no sense: {0}")]
    Nonsense(String),
}

impl Fault {
    /// The fault that an error tells of, if it does.
    pub fn of(error: &Error) -> Option<&Self> {
        match error {
            Error::Io(error) => error.get_ref()?.downcast_ref(),
            _ => None,
        }
    }
}

impl From<Fault> for io::Error {
    fn from(fault: Fault) -> Self {
        Self::other(fault)
    }
}

fn times(tries: u32) -> String {
    if tries == 1 { "1 try".to_owned() } else { format!("{tries} tries") }
}
