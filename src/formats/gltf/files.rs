//! Files beside a glTF of text: what they are called, and how it names them.

use std::collections::HashSet;

/// A file that is to lie beside a glTF.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct File {
    /// Its name: letters, digits, `-`, `_` and `.`, the first of them none of the latter.
    pub name: String,
    /// What is in it.
    pub bytes: Vec<u8>,
}

/// Names that have not been given yet.
pub(super) struct Names<'a> {
    /// What all of them begin with.
    stem: &'a str,
    taken: HashSet<String>,
}

impl<'a> Names<'a> {
    pub(super) fn new(stem: &'a str) -> Self {
        Self { stem, taken: HashSet::new() }
    }

    /// A name for an image: as it was called, without folders and what some system minds, and with the end that its media type asks for.
    pub(super) fn image(&mut self, told: Option<&str>, number: usize, media: Option<&str>) -> String {
        let told = told.unwrap_or_default();
        let last = told.rsplit(['/', '\\']).next().unwrap_or_default();
        let (stem, end) = last.rsplit_once('.').unwrap_or((last, ""));
        let end = match MEDIA.iter().find(|(name, _)| media == Some(name)) {
            // `.jpeg` is one, too.
            Some((_, ends)) if ends.contains(&&*end.to_ascii_lowercase()) => end.to_ascii_lowercase(),
            Some((_, ends)) => ends[0].to_owned(),
            None => cleaned(end),
        };
        let stem = match cleaned(stem) {
            stem if stem.is_empty() => format!("image{number}"),
            stem => stem,
        };
        let end = if end.is_empty() { end } else { format!(".{end}") };
        let mut name = format!("{}-{stem}{end}", self.stem);
        // Not every system tells large letters from small ones.
        let mut further = number;
        while !self.taken.insert(name.to_lowercase()) {
            name = format!("{}-{stem}-{further}{end}", self.stem);
            further += 1;
        }
        name
    }
}

/// Letters and digits of any script, `-` and `_`; all else is `_`. Not too long.
fn cleaned(text: &str) -> String {
    let kept = |c: char| if c.is_alphanumeric() || c == '-' || c == '_' { c } else { '_' };
    unescaped(text).chars().take(MOST_LETTERS).map(kept).collect()
}

/// Text of a URI without its escapes, where it is such.
fn unescaped(text: &str) -> String {
    super::uri::unescape(text)
        .ok()
        .and_then(|bytes| String::from_utf8(bytes).ok())
        .unwrap_or_else(|| text.to_owned())
}

/// A file's name as a URI (RFC 3986).
pub(super) fn uri(name: &str) -> String {
    let escaped = |byte: u8| match byte {
        b'A'..=b'Z' | b'a'..=b'z' | b'0'..=b'9' | b'-' | b'_' | b'.' => char::from(byte).to_string(),
        _ => format!("%{byte:02X}"),
    };
    name.bytes().map(escaped).collect()
}

/// Media types of images, and ends of the names of such files, the first of them the usual one.
const MEDIA: [(&str, &[&str]); 5] = [
    ("image/png", &["png"]),
    ("image/jpeg", &["jpg", "jpeg"]),
    ("image/webp", &["webp"]),
    ("image/ktx2", &["ktx2"]),
    ("image/vnd-ms.dds", &["dds"]),
];
const MOST_LETTERS: usize = 60;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_stay_in_the_folder() {
        let mut names = Names::new("cup");
        let mut of = |told: &str, media: &str| names.image(Some(told), 3, Some(media));
        assert_eq!(of("textures/bark.jpeg", "image/jpeg"), "cup-bark.jpeg");
        assert_eq!(of("bark.JPG", "image/jpeg"), "cup-bark.jpg");
        assert_eq!(of("other/BARK.jpg", "image/jpeg"), "cup-BARK-3.jpg");
        assert_eq!(of("Bark.jpg", "image/jpeg"), "cup-Bark-4.jpg");
        assert_eq!(of("bark.png", "image/webp"), "cup-bark.webp");
        assert_eq!(of("../../etc/passwd", "image/png"), "cup-passwd.png");
        assert_eq!(of("..\\..\\a:b*c\u{0}", "image/png"), "cup-a_b_c_.png");
        assert_eq!(of("%2e%2e%2fup.png", "image/png"), "cup-___up.png");
        assert_eq!(of("..", "image/png"), "cup-_.png");
        assert_eq!(of("...", "image/png"), "cup-__.png");
        assert_eq!(of("", "image/ktx2"), "cup-image3.ktx2");
        assert_eq!(of("é 1.png", "image/png"), "cup-é_1.png");
        assert!(of(&"x".repeat(999), "image/png").len() < 80);
        assert_eq!(names.image(None, 7, None), "cup-image7");
        assert_eq!(uri("cup-é_1.png"), "cup-%C3%A9_1.png");
    }
}
