//! The frame of binary glTF files (glTF 2.0, §4.4).

use std::io::{self, Write};

use serde_json::Value;

use crate::error::{InputError, Place, Result};

/// Whether the content begins as a binary glTF file.
pub(super) fn is_glb(bytes: &[u8]) -> bool {
    bytes.starts_with(b"glTF")
}

/// What a binary glTF file holds.
pub(super) struct Frame<'a> {
    /// The text, and the byte that it begins at.
    pub json: &'a [u8],
    pub json_at: usize,
    /// The chunk that a buffer without a URI lies in.
    pub binary: Option<&'a [u8]>,
}

/// Takes a file apart. Chunks of other kinds are passed over, and so is what follows the length that the header tells.
///
/// # Errors
/// At the byte where the file is cut, of another version, or has no JSON.
pub(super) fn frame(bytes: &[u8]) -> Result<Frame<'_>> {
    let fault = |byte: usize, what: String| InputError::new("", Place::Byte(byte as u64), what);
    let early = |byte: usize| fault(byte, "the file ends early".to_owned());
    let word = |at: usize| {
        let word = bytes.get(at..).and_then(|rest| rest.first_chunk()).copied();
        word.map(u32::from_le_bytes).ok_or_else(|| early(bytes.len()))
    };
    let (version, length) = (word(4)?, word(8)? as usize);
    if version != 2 {
        return Err(fault(4, format!("binary glTF of version {version}, 2 is read")).into());
    }
    if length > bytes.len() {
        let what =
            format!("the file ends early: the header tells of {length} bytes, {} are there", bytes.len());
        return Err(fault(8, what).into());
    }
    let (mut json, mut binary, mut at) = (None, None, HEADER);
    while at < length {
        let (size, kind) = (word(at)? as usize, word(at + 4)?);
        let begin = at + CHUNK_HEADER;
        let Some(chunk) = begin.checked_add(size).and_then(|end| bytes[..length].get(begin..end)) else {
            let left = length.saturating_sub(begin);
            return Err(fault(at, format!("a chunk of {size} bytes where {left} are left")).into());
        };
        match (kind, json) {
            (JSON, None) => json = Some((chunk, begin)),
            (BINARY, Some(_)) if binary.is_none() => binary = Some(chunk),
            (_, None) => return Err(fault(at + 4, "the first chunk is not JSON".to_owned()).into()),
            _ => {}
        }
        // Sizes are multiples of four, or ought to be.
        at = begin + size.next_multiple_of(4);
    }
    let (json, json_at) = json.ok_or_else(|| early(HEADER))?;
    Ok(Frame { json, json_at, binary })
}

/// Writes a file of its text and its one buffer, which may be empty.
///
/// # Errors
/// What `out` says; [`io::ErrorKind::InvalidInput`] where it would be longer than it can tell.
pub(super) fn write(json: &Value, binary: &[u8], out: &mut impl Write) -> io::Result<()> {
    let mut text = json.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let padding = binary.len().next_multiple_of(4) - binary.len();
    let behind = if binary.is_empty() { 0 } else { CHUNK_HEADER + binary.len() + padding };
    let length = u32::try_from(HEADER + CHUNK_HEADER + text.len() + behind).map_err(|_| {
        io::Error::new(io::ErrorKind::InvalidInput, "a binary glTF file has at most 2^32 - 1 bytes")
    })?;
    let mut head = |words: &[[u8; 4]]| out.write_all(words.as_flattened());
    head(&[*b"glTF", 2u32.to_le_bytes(), length.to_le_bytes()])?;
    head(&[(text.len() as u32).to_le_bytes(), JSON.to_le_bytes()])?;
    out.write_all(&text)?;
    if !binary.is_empty() {
        let size = (binary.len() + padding) as u32;
        out.write_all([size.to_le_bytes(), BINARY.to_le_bytes()].as_flattened())?;
        out.write_all(binary)?;
        out.write_all(&[0; 4][..padding])?;
    }
    out.flush()
}

const HEADER: usize = 12;
const CHUNK_HEADER: usize = 8;
const JSON: u32 = u32::from_le_bytes(*b"JSON");
const BINARY: u32 = u32::from_le_bytes(*b"BIN\0");

#[cfg(test)]
mod tests {
    use super::*;

    fn chunk(kind: &[u8; 4], data: &[u8]) -> Vec<u8> {
        [&(data.len() as u32).to_le_bytes()[..], kind, data].concat()
    }

    fn file(chunks: &[Vec<u8>]) -> Vec<u8> {
        let body = chunks.concat();
        let length = (12 + body.len()) as u32;
        [b"glTF", &2u32.to_le_bytes()[..], &length.to_le_bytes(), &body].concat()
    }

    fn says(bytes: &[u8]) -> String {
        frame(bytes).err().unwrap().to_string()
    }

    #[test]
    fn chunks() {
        let bytes = file(&[chunk(b"JSON", b"{}  "), chunk(b"odd ", b"1234"), chunk(b"BIN\0", b"abcd")]);
        let whole = frame(&bytes).unwrap();
        assert_eq!((whole.json, whole.json_at, whole.binary), (&b"{}  "[..], 20, Some(&b"abcd"[..])));
        let alone = file(&[chunk(b"JSON", b"{}  ")]);
        assert!(frame(&[&alone[..], b"more"].concat()).unwrap().binary.is_none());
    }

    #[test]
    fn faults() {
        let bytes = file(&[chunk(b"JSON", b"{}  "), chunk(b"BIN\0", b"abcd")]);
        for length in 0..bytes.len() {
            assert!(says(&bytes[..length]).contains("the file ends early"), "{length}");
        }
        let mut old = bytes.clone();
        old[4] = 1;
        assert_eq!(says(&old), "byte 4: binary glTF of version 1, 2 is read");
        let mut long = bytes.clone();
        long[24] = 5;
        assert_eq!(says(&long), "byte 24: a chunk of 5 bytes where 4 are left");
        assert_eq!(says(&file(&[chunk(b"BIN\0", b"")])), "byte 16: the first chunk is not JSON");
        assert_eq!(says(&file(&[])), "byte 12: the file ends early");
    }
}
