//! Words of text files: numbers, line ends, quoting.

/// A decimal number, read to the nearest binary64; `inf` and `nan` are numbers here.
#[inline]
pub(super) fn number(word: &[u8]) -> Option<f64> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

/// A decimal number, read to the nearest binary32.
#[inline]
pub(super) fn binary32(word: &[u8]) -> Option<f32> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

/// A decimal integer.
#[inline]
pub(super) fn integer(word: &[u8]) -> Option<i64> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

/// Length of the line end at the start of `bytes`: LF, CR LF or CR; 0 where there is none.
#[inline]
pub(super) fn line_end(bytes: &[u8]) -> usize {
    match bytes {
        [b'\r', b'\n', ..] => 2,
        [b'\r' | b'\n', ..] => 1,
        _ => 0,
    }
}

/// A word of the file for an error message: in quotes, escaped, not too long.
pub(super) fn quoted(word: &[u8]) -> String {
    let shown = &word[..word.len().min(MAX_QUOTED)];
    let dots = if shown.len() < word.len() { "..." } else { "" };
    format!("{:?}{dots}", String::from_utf8_lossy(shown))
}

/// Most bytes of a word that an error message repeats.
const MAX_QUOTED: usize = 40;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words() {
        assert_eq!(number(b"-1.5e-3"), Some(-0.0015));
        assert!(number(b"NaN").is_some_and(f64::is_nan));
        for word in [&b""[..], b"1,5", b"0x10", b"1.0f", b"\xff"] {
            assert_eq!(number(word), None);
        }
        assert_eq!(integer(b"-7"), Some(-7));
        assert_eq!(integer(b"7.0"), None);
        assert_eq!(integer(b"99999999999999999999"), None);
        assert_eq!(quoted(b"a\x1b\"\xff"), "\"a\\u{1b}\\\"\u{fffd}\"");
        assert_eq!(quoted(&[b'x'; 41]), format!("\"{}\"...", "x".repeat(40)));
    }
}
