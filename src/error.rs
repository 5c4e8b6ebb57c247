//! Errors, told by actor: the medium, the file, the caller, the policy.

use std::fmt;
use std::sync::Arc;

/// What can go wrong in the library.
#[derive(Clone, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The medium failed: worth trying again.
    #[error("{0}")]
    Io(Arc<std::io::Error>),
    /// The `.uwm` file is damaged, truncated or not one.
    #[error("{0}")]
    Format(#[from] FormatError),
    /// A foreign mesh file cannot be read.
    #[error("{0}")]
    Input(#[from] InputError),
    /// The caller asked for something impossible.
    #[error("{0}")]
    Parameter(String),
    /// A limit of [`crate::limits::Limits`] was reached.
    #[error("limit reached: {what} needs {needed}, allowed {allowed}")]
    Limit {
        /// What is limited, e.g. `"memory in bytes"`.
        what: &'static str,
        /// How much was needed, at least.
        needed: u64,
        /// How much is allowed.
        allowed: u64,
    },
    /// Memory that was allowed is not to be had: the system refuses it.
    #[error("out of memory: the system has no {bytes} bytes more")]
    Memory {
        /// How much was asked for.
        bytes: u64,
    },
    /// The caller's progress callback asked to stop.
    #[error("cancelled")]
    Cancelled,
}

impl From<std::io::Error> for Error {
    fn from(error: std::io::Error) -> Self {
        Self::Io(Arc::new(error))
    }
}

/// A fault in a `.uwm` file: where it is, which rule it breaks.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FormatError {
    /// Offset from the start of the file, in bytes, of the part that holds the fault.
    pub offset: u64,
    /// Section of `spec/`, e.g. `"3.2"`.
    pub section: &'static str,
    /// What is wrong.
    pub what: String,
}

impl FormatError {
    /// A fault at `offset`, against spec §`section`.
    pub fn new(offset: u64, section: &'static str, what: impl Into<String>) -> Self {
        Self { offset, section, what: what.into() }
    }
}

impl fmt::Display for FormatError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "byte {}: {} (spec §{})", self.offset, self.what, self.section)
    }
}

impl std::error::Error for FormatError {}

/// Where in a foreign mesh file a fault is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// 1-based line of a text file.
    Line(u64),
    /// 0-based byte offset.
    Byte(u64),
    /// The file as a whole.
    Whole,
}

/// A fault in a foreign mesh file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct InputError {
    /// The file as the user named it; empty where the caller gave none.
    pub file: String,
    /// Where.
    pub place: Place,
    /// What is wrong.
    pub what: String,
}

impl InputError {
    /// A fault at a line, a byte or in the whole of `file`.
    pub fn new(file: impl Into<String>, place: Place, what: impl Into<String>) -> Self {
        Self { file: file.into(), place, what: what.into() }
    }
}

impl fmt::Display for InputError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if !self.file.is_empty() {
            write!(f, "{}: ", self.file)?;
        }
        match self.place {
            Place::Line(n) => write!(f, "line {n}: ")?,
            Place::Byte(n) => write!(f, "byte {n}: ")?,
            Place::Whole => {}
        }
        f.write_str(&self.what)
    }
}

impl std::error::Error for InputError {}

/// The library's result.
pub type Result<T, E = Error> = std::result::Result<T, E>;
