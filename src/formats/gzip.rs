//! Gzip (RFC 1952) around a foreign file.

use std::io::Read;

use flate2::read::MultiGzDecoder;

use crate::error::{Error, InputError, Place, Result};

/// Whether the content is gzip-compressed.
pub(super) fn is_gzip(bytes: &[u8]) -> bool {
    bytes.starts_with(&[0x1f, 0x8b])
}

/// Inflates all members. Memory grows with what has been inflated.
///
/// # Errors
/// [`Error::Limit`] above `cap` bytes; where the compressed data are damaged or end early, [`Error::Input`] at the byte
/// up to which they could be inflated.
pub(super) fn inflate(bytes: &[u8], cap: u64, name: &str) -> Result<Vec<u8>> {
    let mut inflated = Vec::new();
    let result = MultiGzDecoder::new(bytes).take(cap.saturating_add(1)).read_to_end(&mut inflated);
    let length = inflated.len() as u64;
    match result {
        Err(e) => {
            Err(InputError::new(name, Place::Byte(length), format!("the gzip data are damaged: {e}")).into())
        }
        Ok(_) if length > cap => {
            Err(Error::Limit { what: "inflated size in bytes", needed: length, allowed: cap })
        }
        Ok(_) => Ok(inflated),
    }
}

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
