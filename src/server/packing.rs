//! Answers that are compressed where the client can read that: texts only, as a `.uwm` file has no redundancy left. An answer about a version is
//! none of them: its strong tag would be that of two bodies.

use std::io::Write;

use axum::http::{HeaderMap, header};
use axum::response::{IntoResponse, Response};
use flate2::{Compression, write::GzEncoder};

/// How an answer is sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coding {
    /// As it is.
    Identity,
    /// RFC 1952.
    Gzip,
}

impl Coding {
    /// What a client with these headers asks for.
    pub fn asked(request: &HeaderMap) -> Self {
        if accepts(request, "gzip") { Self::Gzip } else { Self::Identity }
    }
}

/// Whether a client takes this coding (RFC 9110 §12.5.3).
pub fn accepts(request: &HeaderMap, coding: &str) -> bool {
    let accepted = request.get_all(header::ACCEPT_ENCODING);
    accepted.iter().filter_map(|value| value.to_str().ok()).flat_map(|value| value.split(',')).any(|part| {
        let (name, weight) = part.split_once(';').unwrap_or((part, ""));
        name.trim().eq_ignore_ascii_case(coding)
            && weight.trim().trim_start_matches("q=").parse() != Ok(0.0_f32)
    })
}

/// An answer of this text, in this coding where that makes it smaller.
pub fn compressed(text: Vec<u8>, coding: Coding) -> Response {
    let vary = [(header::VARY, "Accept-Encoding")];
    if coding == Coding::Gzip && text.len() >= WORTH_IT {
        let mut encoder = GzEncoder::new(Vec::with_capacity(text.len() / 4), Compression::fast());
        // Writing to memory cannot fail; if it did, the text would go as it is.
        if let Ok(packed) = encoder.write_all(&text).and_then(|()| encoder.finish()) {
            return (vary, [(header::CONTENT_ENCODING, "gzip")], packed).into_response();
        }
    }
    (vary, text).into_response()
}

/// Bytes below which a packet holds it anyway.
const WORTH_IT: usize = 1024;

#[cfg(test)]
mod tests {
    use super::*;
    use axum::http::HeaderValue;

    #[test]
    fn a_coding_is_for_who_asks_for_it() {
        let accepting =
            |codings| HeaderMap::from_iter([(header::ACCEPT_ENCODING, HeaderValue::from_static(codings))]);
        for codings in ["br", "gzip, deflate, br", "gzip;q=0.5,BR;q=1.0", "br;q=0.1"] {
            assert!(accepts(&accepting(codings), "br"), "{codings}");
        }
        for codings in ["", "gzip", "br;q=0", "br; q=0.000", "brotli"] {
            assert!(!accepts(&accepting(codings), "br"), "{codings}");
        }
        assert!(!accepts(&HeaderMap::new(), "br"));
        assert_eq!(Coding::asked(&accepting("br;q=1, gzip;q=0.2")), Coding::Gzip);
        assert_eq!(Coding::asked(&accepting("br, gzip;q=0")), Coding::Identity);
    }
}
