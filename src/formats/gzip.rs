//! Gzip (RFC 1952) around a foreign file.

use std::io::Read;

use flate2::read::MultiGzDecoder;

use crate::error::{Error, InputError, Place, Result};

/// Whether the content is gzip-compressed.
pub(super) fn is_gzip(bytes: &[u8]) -> bool {
    bytes.starts_with(&[0x1f, 0x8b])
}

/// Inflates all members. Memory grows with what has been inflated, up to `cap` and one byte.
///
/// # Errors
/// [`Error::Limit`] above `cap` bytes; where the compressed data are damaged or end early, [`Error::Input`] at the byte
/// up to which they could be inflated.
pub(super) fn inflate(bytes: &[u8], cap: u64, name: &str) -> Result<Vec<u8>> {
    let mut inflated = Vec::new();
    let most = usize::try_from(cap.saturating_add(1)).unwrap_or(usize::MAX);
    let mut decoder = MultiGzDecoder::new(bytes);
    let mut piece = [0; PIECE];
    loop {
        let length = inflated.len();
        let room = PIECE.min(most - length);
        let read = match decoder.read(&mut piece[..room]) {
            Ok(0) if length as u64 > cap => {
                let needed = length as u64;
                return Err(Error::Limit { what: INFLATED_BYTES, needed, allowed: cap });
            }
            Ok(0) => return Ok(inflated),
            Ok(read) => read,
            Err(e) if e.kind() == std::io::ErrorKind::Interrupted => continue,
            Err(e) => {
                let what = format!("the gzip data are damaged: {e}");
                return Err(InputError::new(name, Place::Byte(length as u64), what).into());
            }
        };
        if inflated.capacity() - length < read {
            // Twice the room, as a vector does by itself, but not more than may be needed.
            inflated.reserve_exact(length.clamp(read, most - length));
        }
        inflated.extend_from_slice(&piece[..read]);
    }
}

/// What [`Error::Limit`] calls the size of the inflated data.
pub const INFLATED_BYTES: &str = "inflated size in bytes";

/// Bytes inflated at a time.
const PIECE: usize = 1 << 15;

#[cfg(test)]
mod tests {
    use super::*;
    use flate2::{Compression, write::GzEncoder};
    use std::io::Write;

    fn zeros(count: usize) -> Vec<u8> {
        let mut encoder = GzEncoder::new(Vec::new(), Compression::best());
        encoder.write_all(&vec![0; count]).unwrap();
        encoder.finish().unwrap()
    }

    #[test]
    fn a_bomb_stops_at_the_cap() {
        let bomb = zeros(1 << 20);
        assert!(bomb.len() < 2000);
        assert_eq!(inflate(&bomb, 1 << 20, "").unwrap().len(), 1 << 20);
        let error = inflate(&bomb, 1000, "").unwrap_err();
        assert!(matches!(error, Error::Limit { needed: 1001, allowed: 1000, .. }));
        // No room is taken beyond the limit.
        assert!(inflate(&bomb, (1 << 20) + 7, "").unwrap().capacity() <= (1 << 20) + 8);
    }

    #[test]
    fn every_truncation_is_an_error() {
        let whole = zeros(100);
        for length in 2..whole.len() {
            let error = inflate(&whole[..length], 1000, "a.gz").unwrap_err();
            assert!(error.to_string().starts_with("a.gz: byte "), "{error}");
        }
    }
}
