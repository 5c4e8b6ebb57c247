//! Words of text files: where they are, numbers, line ends, quoting.

use crate::error::{Error, InputError, Place};

/// The words of a file, between blanks and line ends.
#[derive(Clone)]
pub(super) struct Words<'a> {
    bytes: &'a [u8],
    next: usize,
    /// The 1-based line of `next`, which is also that of the word read last.
    line: u64,
    /// Whether `#` begins a comment, which ends with its line.
    comments: bool,
    name: &'a str,
}

impl<'a> Words<'a> {
    /// What is behind the first `skipped` bytes, which hold `lines` whole lines. `name` is the file's, for error messages.
    pub(super) fn new(bytes: &'a [u8], skipped: usize, lines: u64, name: &'a str) -> Self {
        Self { bytes, next: skipped, line: lines + 1, comments: false, name }
    }

    /// With `#` as the beginning of a comment.
    pub(super) fn with_comments(self) -> Self {
        Self { comments: true, ..self }
    }

    /// The next word.
    #[inline]
    pub(super) fn word(&mut self) -> Option<&'a [u8]> {
        loop {
            if let Some(word) = self.word_in_line() {
                return Some(word);
            }
            let end = line_end(&self.bytes[self.next..]);
            if end == 0 {
                return None;
            }
            self.next += end;
            self.line += 1;
        }
    }

    /// The next word, if it stands in the present line.
    #[inline]
    pub(super) fn word_in_line(&mut self) -> Option<&'a [u8]> {
        let rest = loop {
            let rest = &self.bytes[self.next..];
            match rest.first()? {
                b'\r' | b'\n' => return None,
                b'#' if self.comments => {
                    self.skip_line();
                    return None;
                }
                b if b.is_ascii_whitespace() => self.next += 1,
                _ => break rest,
            }
        };
        let ends = |b: &u8| b.is_ascii_whitespace() || self.comments && *b == b'#';
        let length = rest.iter().position(ends).unwrap_or(rest.len());
        self.next += length;
        Some(&rest[..length])
    }

    /// How many words are left in the present line; they are passed over.
    #[inline]
    pub(super) fn count_in_line(&mut self) -> u64 {
        let mut count = 0;
        while self.word_in_line().is_some() {
            count += 1;
        }
        count
    }

    /// What is left of the present line, without blanks around it.
    pub(super) fn rest_of_line(&mut self) -> &'a [u8] {
        let first = self.next;
        self.skip_line();
        self.bytes[first..self.next].trim_ascii()
    }

    /// Goes to the end of the present line.
    pub(super) fn skip_line(&mut self) {
        let rest = &self.bytes[self.next..];
        self.next += rest.iter().position(|b| matches!(b, b'\r' | b'\n')).unwrap_or(rest.len());
    }

    /// Goes back by `length` bytes of the word read last.
    pub(super) fn unread(&mut self, length: usize) {
        self.next -= length;
    }

    /// What is left.
    pub(super) fn rest(&self) -> &'a [u8] {
        &self.bytes[self.next..]
    }

    /// The 1-based line of the word read last.
    pub(super) fn line(&self) -> u64 {
        self.line
    }

    /// The next word as a number.
    ///
    /// # Errors
    /// Where it is none.
    #[inline]
    pub(super) fn number(&mut self) -> Result<f64, Error> {
        let word = self.word().ok_or_else(|| self.fault(ENDS_EARLY))?;
        number(word).ok_or_else(|| self.fault(format!("{} is not a number", quoted(word))))
    }

    /// The next word as an integer, which may be written as `3.0`.
    ///
    /// # Errors
    /// Where it is none.
    #[inline]
    pub(super) fn integer(&mut self) -> Result<i64, Error> {
        let word = self.word().ok_or_else(|| self.fault(ENDS_EARLY))?;
        integer(word)
            .or_else(|| whole(number(word)?))
            .ok_or_else(|| self.fault(format!("{} is not an integer", quoted(word))))
    }

    /// A fault in the word read last.
    pub(super) fn fault(&self, what: impl Into<String>) -> Error {
        InputError::new(self.name, Place::Line(self.line), what).into()
    }
}

/// Length of UTF-8's mark at the start of `bytes`, where some editors put it; 0 where there is none.
pub(super) fn byte_order_mark(bytes: &[u8]) -> usize {
    if bytes.starts_with(b"\xef\xbb\xbf") { 3 } else { 0 }
}

/// What there is to say where data are missing.
pub(super) const ENDS_EARLY: &str = "the file ends early";

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

/// The integer that a number is, if it is one that binary64 tells from its neighbours.
pub(super) fn whole(x: f64) -> Option<i64> {
    (x.fract() == 0.0 && x.abs() <= (1u64 << 53) as f64).then_some(x as i64)
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

/// Whether the file begins as text does: without a zero.
pub(super) fn is_text(bytes: &[u8]) -> bool {
    !bytes[..bytes.len().min(LOOKED_AT)].contains(&0)
}

/// A word of the file for an error message: in quotes, escaped, not too long.
pub(super) fn quoted(word: &[u8]) -> String {
    let shown = &word[..word.len().min(MAX_QUOTED)];
    let dots = if shown.len() < word.len() { "..." } else { "" };
    format!("{:?}{dots}", String::from_utf8_lossy(shown))
}

/// How many bytes are looked at to tell text from binary.
const LOOKED_AT: usize = 1000;

/// Most bytes of a word that an error message repeats.
const MAX_QUOTED: usize = 40;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_of_lines() {
        let mut words = Words::new(b"h\na b #c\r\n\r\rd#e\n#f\ng", 2, 1, "n");
        let plain = std::iter::from_fn(|| words.word().map(|word| (word, words.line()))).collect::<Vec<_>>();
        let expected: [(&[u8], u64); 6] =
            [(b"a", 2), (b"b", 2), (b"#c", 2), (b"d#e", 5), (b"#f", 6), (b"g", 7)];
        assert_eq!(plain, expected);
        assert_eq!(words.fault("x").to_string(), "n: line 7: x");

        let mut words = Words::new(b"a b #c\r\nd#e\n#f\ng h", 0, 0, "").with_comments();
        assert_eq!((words.word_in_line(), words.word_in_line()), (Some(&b"a"[..]), Some(&b"b"[..])));
        assert_eq!((words.word_in_line(), words.word_in_line(), words.line()), (None, None, 1));
        assert_eq!((words.word(), words.word(), words.line()), (Some(&b"d"[..]), Some(&b"g"[..]), 4));
        words.skip_line();
        assert_eq!((words.word(), words.rest()), (None, &b""[..]));
    }

    #[test]
    fn single_words() {
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
