//! A glTF document: its JSON as a whole, and the bytes that its buffers and their views are.
//!
//! The JSON stays as it was parsed, also what the reader of geometry has no use for, so that whoever writes it again has all of it.

use std::cell::{OnceCell, RefCell};
use std::path::PathBuf;

use serde_json::Value;

use super::glb::{self, Frame};
use super::json::At;
use super::meshopt;
use super::uri::{self, Uri};
use crate::error::{Error, InputError, Place, Result};
use crate::limits::{Budget, Limits};

/// A document, whose buffers are read when they are first asked for.
pub(super) struct Document<'a> {
    json: Value,
    /// The chunk of a binary file, which the first buffer is if it has no URI.
    binary: Option<&'a [u8]>,
    /// Where the files lie that it names; none are read where this is not known.
    folder: Option<PathBuf>,
    /// What the JSON may take.
    json_bytes: usize,
    /// Buffers from elsewhere.
    buffers: Vec<OnceCell<Vec<u8>>>,
    /// What compressed views unpack to.
    unpacked: Vec<OnceCell<Vec<u8>>>,
    budget: RefCell<Budget>,
    #[cfg(feature = "draco")]
    max_memory: u64,
}

/// A stretch of a buffer.
pub(super) struct View<'d> {
    pub bytes: &'d [u8],
    /// Bytes from one element to the next, where they are not close together.
    pub stride: Option<usize>,
}

impl<'a> Document<'a> {
    /// Parses a file, binary or not. It takes up to `max_memory` bytes, and what is read from it too.
    ///
    /// # Errors
    /// At the byte or the line where the file is at fault, at the pointer where it is of a version that is not known; [`Error::Limit`].
    pub(super) fn parse(bytes: &'a [u8], folder: Option<PathBuf>, max_memory: u64) -> Result<Self> {
        let Frame { json: text, json_at, binary } = if glb::is_glb(bytes) {
            glb::frame(bytes)?
        } else {
            Frame { json: bytes.strip_prefix(BYTE_ORDER_MARK).unwrap_or(bytes), json_at: 0, binary: None }
        };
        let mut budget = Budget::new(Limits { memory: max_memory, work: u64::MAX });
        budget.take_memory(text.len(), PARSED_BYTES)?;
        let json: Value = serde_json::from_slice(text).map_err(|e| syntax(&e, text, json_at))?;
        let cells = |list: &str| json.get(list).and_then(Value::as_array).map_or(0, Vec::len);
        let (buffers, views) = (cells("buffers"), cells("bufferViews"));
        let document = Self {
            binary,
            folder,
            json_bytes: text.len(),
            buffers: (0..buffers).map(|_| OnceCell::new()).collect(),
            unpacked: (0..views).map(|_| OnceCell::new()).collect(),
            budget: RefCell::new(budget),
            #[cfg(feature = "draco")]
            max_memory,
            json,
        };
        let asset = document.root().needed("asset")?;
        let version = asset.needed("version")?;
        match version.value.as_str() {
            Some(text) if text == "2" || text.starts_with("2.") => Ok(document),
            _ => Err(version.fault(format!("version {} of glTF, 2.0 is read", version.value))),
        }
    }

    pub(super) fn root(&self) -> At<'_> {
        At::root(&self.json)
    }

    /// The item of a list at the root that a number names.
    ///
    /// # Errors
    /// Where there is none.
    pub(super) fn named(&self, list: &str, number: &At<'_>) -> Result<At<'_>> {
        let k = number.number()?;
        self.root().item(list, k).ok_or_else(|| {
            let count = self.json.get(list).and_then(Value::as_array).map_or(0, Vec::len);
            number.fault(format!("names item {k} of /{list}, which has {count}"))
        })
    }

    /// Debits memory for `count` items of `size` bytes.
    ///
    /// # Errors
    /// [`Error::Limit`] where there is not so much left.
    pub(super) fn take(&self, count: usize, size: usize) -> Result<()> {
        self.budget.borrow_mut().take_memory(count, size)
    }

    /// Debits memory for a copy of the JSON, and for its text.
    ///
    /// # Errors
    /// [`Error::Limit`] where there is not so much left.
    pub(super) fn take_json(&self) -> Result<()> {
        self.take(self.json_bytes, PARSED_BYTES + 1)
    }

    /// Most bytes that all that is read may take.
    #[cfg(feature = "draco")]
    pub(super) fn most_memory(&self) -> u64 {
        self.max_memory
    }

    /// A view of a buffer, by the number that names it; unpacked, if it is compressed.
    ///
    /// # Errors
    /// Where its buffer cannot be had, or it goes beyond it, or is not what it is to unpack to.
    pub(super) fn view(&self, number: &At<'_>) -> Result<View<'_>> {
        let at = self.named("bufferViews", number)?;
        let stride = at.count("byteStride")?;
        for name in meshopt::EXTENSIONS {
            let Some(packed) = at.extension(name) else { continue };
            let Some(cell) = self.unpacked.get(number.number()?) else { break };
            if cell.get().is_none() {
                let packing = meshopt::Packing::new(&packed)?;
                // Indices are listed first.
                self.take(packing.count, packing.stride + size_of::<u32>())?;
                // The decoder fills the list: nobody else may.
                let _ = cell.set(packing.unpack(self.stretch(&packed)?, &packed)?);
            }
            return Ok(View { bytes: cell.get().map_or(&[], Vec::as_slice), stride });
        }
        Ok(View { bytes: self.stretch(&at)?, stride })
    }

    /// What `buffer`, `byteOffset` and `byteLength` of an object name.
    fn stretch(&self, at: &At<'_>) -> Result<&[u8]> {
        let number = at.needed("buffer")?;
        let buffer = self.buffer(&number)?;
        let (offset, length) = (at.count("byteOffset")?.unwrap_or(0), at.needed("byteLength")?.number()?);
        let bytes = offset.checked_add(length).and_then(|end| buffer.get(offset..end));
        bytes.ok_or_else(|| {
            let there = buffer.len();
            at.fault(format!("{length} bytes from byte {offset} of a buffer of {there}"))
        })
    }

    /// A buffer, by the number that names it: as many bytes as it tells.
    fn buffer(&self, number: &At<'_>) -> Result<&[u8]> {
        let (k, at) = (number.number()?, self.named("buffers", number)?);
        let bytes = match (at.text("uri")?, self.buffers.get(k)) {
            (Some(uri), Some(cell)) => {
                if cell.get().is_none() {
                    let _ = cell.set(self.load(uri, &at)?);
                }
                cell.get().map_or(&[][..], Vec::as_slice)
            }
            _ => self
                .binary
                .filter(|_| k == 0)
                .ok_or_else(|| at.fault("the buffer is missing: it has no URI"))?,
        };
        let length = at.needed("byteLength")?.number()?;
        bytes
            .get(..length)
            .ok_or_else(|| at.fault(format!("tells of {length} bytes, {} are there", bytes.len())))
    }

    /// Where the file lies that a URI stands for, if it does.
    pub(super) fn path(&self, uri: &str) -> Option<PathBuf> {
        match (uri::resolve(uri), &self.folder) {
            (Ok(Uri::File(file)), Some(folder)) => uri::within(folder, &file).ok(),
            _ => None,
        }
    }

    /// What the URI of an object stands for, of which it tells under `uri`.
    ///
    /// # Errors
    /// Where it cannot be had.
    pub(super) fn load(&self, text: &str, at: &At<'_>) -> Result<Vec<u8>> {
        let fault = |what: String| at.fault(format!("uri: {what}"));
        // As text, and then as bytes.
        self.take(text.len(), 2)?;
        let file = match uri::resolve(text).map_err(fault)? {
            Uri::Data(bytes) => return Ok(bytes),
            Uri::File(file) => file,
        };
        let Some(folder) = &self.folder else {
            return Err(fault(format!("the folder of {} is not known", file.display())));
        };
        let path = uri::within(folder, &file).map_err(fault)?;
        let io = |e: std::io::Error| -> Error {
            std::io::Error::new(e.kind(), format!("{}: {e}", path.display())).into()
        };
        let length = std::fs::metadata(&path).map_err(io)?.len();
        self.take(usize::try_from(length).unwrap_or(usize::MAX), 1)?;
        let mut bytes = Vec::new();
        let opened = std::fs::File::open(&path).map_err(io)?;
        // What grows while it is read is cut.
        std::io::Read::read_to_end(&mut std::io::Read::take(opened, length), &mut bytes).map_err(io)?;
        Ok(bytes)
    }
}

/// Where JSON is at fault: at a byte of a binary file, else at a line.
fn syntax(error: &serde_json::Error, text: &[u8], json_at: usize) -> Error {
    let what = error.to_string();
    let what = what.rsplit_once(" at line").map_or(&what[..], |(what, _)| what);
    let place = if json_at > 0 {
        let lines = text.split_inclusive(|&b| b == b'\n').take(error.line().saturating_sub(1));
        let before: usize = lines.map(<[u8]>::len).sum();
        Place::Byte((json_at + before + error.column().saturating_sub(1)) as u64)
    } else {
        Place::Line(error.line() as u64)
    };
    InputError::new("", place, format!("JSON: {what}")).into()
}

const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

/// Bytes that a byte of JSON may take when it is parsed: `0,` is a value of 72, and a list may have room for twice as many.
const PARSED_BYTES: usize = 72;
