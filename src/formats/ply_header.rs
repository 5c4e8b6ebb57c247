//! The header of a PLY file: which elements follow, in which order, with which properties.

use crate::error::{Error, InputError, Place, Result};

use super::text::{byte_order_mark, quoted};

/// How the data behind the header are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Encoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

/// The type of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    /// Bytes a number takes in binary.
    #[inline]
    pub(super) const fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// The least and the largest number of an integer type.
    pub(super) const fn integers(self) -> Option<(f64, f64)> {
        Some(match self {
            Self::I8 => (i8::MIN as f64, i8::MAX as f64),
            Self::U8 => (0.0, u8::MAX as f64),
            Self::I16 => (i16::MIN as f64, i16::MAX as f64),
            Self::U16 => (0.0, u16::MAX as f64),
            Self::I32 => (i32::MIN as f64, i32::MAX as f64),
            Self::U32 => (0.0, u32::MAX as f64),
            Self::F32 | Self::F64 => return None,
        })
    }

    /// By its name of 1994 or its later, sized one.
    fn from_name(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }
}

/// What a property holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// One number.
    Scalar(Scalar),
    /// A length of the first type, then as many items of the second.
    List(Scalar, Scalar),
}

/// One column of an element.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Property {
    pub name: String,
    pub kind: Kind,
}

/// One table of the file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Element {
    pub name: String,
    /// Rows, as claimed: the file may hold fewer.
    pub count: u64,
    /// Columns.
    pub properties: Vec<Property>,
    /// The header's line that declares it.
    pub line: u64,
}

/// What the header says.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Header {
    pub encoding: Encoding,
    pub elements: Vec<Element>,
    /// Texture files named by comments, as MeshLab writes them.
    pub textures: Vec<String>,
    /// Lines of the header.
    pub lines: u64,
    /// Bytes of the header.
    pub length: usize,
}

impl Header {
    /// Reads the header at the start of `bytes`. All its lines end as the first one does: LF, CR LF or CR.
    ///
    /// A line before the first element that begins with no keyword is a comment whose keyword is missing, as some exporters
    /// write it. There it cannot be a misspelt line: without its `format` or its first `element` the header is
    /// refused. Behind that it could, so it is a fault.
    ///
    /// # Errors
    /// [`Error::Input`] at the line at fault.
    pub(super) fn parse(bytes: &[u8], name: &str) -> Result<Self> {
        let fault = |line, what: String| Error::from(InputError::new(name, Place::Line(line), what));
        let Some(newline) = newline_of(bytes) else {
            return Err(fault(1, "not a PLY file: the first line is not `ply`".into()));
        };
        let length = byte_order_mark(bytes);
        let mut header =
            Self { encoding: Encoding::Ascii, elements: Vec::new(), textures: Vec::new(), lines: 0, length };
        let mut encoding = None;
        let mut declared = 0;
        loop {
            let rest = &bytes[header.length..];
            header.lines += 1;
            let Some(end) = rest.iter().position(|&b| b == newline) else {
                return Err(fault(header.lines, "the header ends without a line `end_header`".into()));
            };
            header.length += end + 1;
            let line = String::from_utf8_lossy(&rest[..end]);
            let unreadable =
                || fault(header.lines, format!("unreadable header line {}", quoted(line.trim().as_bytes())));
            let mut words = line.split_ascii_whitespace();
            match words.next() {
                None | Some("obj_info") => {}
                Some("comment") => {
                    let texture =
                        line.trim_start()["comment".len()..].trim_start().strip_prefix("TextureFile");
                    let texture = texture.filter(|name| name.starts_with([' ', '\t'])).map(str::trim);
                    header.textures.extend(texture.filter(|name| !name.is_empty()).map(str::to_owned));
                }
                Some("ply") if header.lines == 1 => {}
                Some("end_header") => break,
                Some("format") => encoding = Some(parse_encoding(words).ok_or_else(unreadable)?),
                Some("element") => {
                    declared += 1;
                    header.elements.push(parse_element(words, header.lines).ok_or_else(unreadable)?);
                }
                Some("property") => {
                    declared += 1;
                    let property = parse_property(words).ok_or_else(unreadable)?;
                    header.elements.last_mut().ok_or_else(unreadable)?.properties.push(property);
                }
                Some(_) if header.elements.is_empty() => {}
                Some(_) => return Err(unreadable()),
            }
            if declared > MAX_DECLARED {
                return Err(fault(header.lines, format!("more than {MAX_DECLARED} elements and properties")));
            }
        }
        header.encoding =
            encoding.ok_or_else(|| fault(header.lines, "the header has no line `format`".into()))?;
        Ok(header)
    }
}

/// Whether the content tells that this is a PLY file.
pub(super) fn is_ply(bytes: &[u8]) -> bool {
    newline_of(bytes).is_some()
}

/// The last byte of a line end, told by the first line, if that is `ply`; blanks may follow it.
fn newline_of(bytes: &[u8]) -> Option<u8> {
    let behind = bytes[byte_order_mark(bytes)..].strip_prefix(b"ply")?;
    let blanks = behind.iter().take_while(|b| matches!(b, b' ' | b'\t')).count();
    match behind[blanks..] {
        [b'\n', ..] | [b'\r', b'\n', ..] => Some(b'\n'),
        [b'\r', ..] => Some(b'\r'),
        _ => None,
    }
}

fn parse_encoding<'a>(mut words: impl Iterator<Item = &'a str>) -> Option<Encoding> {
    let encoding = match words.next()? {
        "ascii" => Encoding::Ascii,
        "binary_little_endian" => Encoding::LittleEndian,
        "binary_big_endian" => Encoding::BigEndian,
        _ => return None,
    };
    (words.next() == Some("1.0") && words.next().is_none()).then_some(encoding)
}

fn parse_element<'a>(mut words: impl Iterator<Item = &'a str>, line: u64) -> Option<Element> {
    let (name, count) = (words.next()?.to_owned(), words.next()?.parse().ok()?);
    words.next().is_none().then_some(Element { name, count, properties: Vec::new(), line })
}

fn parse_property<'a>(mut words: impl Iterator<Item = &'a str>) -> Option<Property> {
    let kind = match words.next()? {
        "list" => Kind::List(Scalar::from_name(words.next()?)?, Scalar::from_name(words.next()?)?),
        name => Kind::Scalar(Scalar::from_name(name)?),
    };
    let name = words.next()?.to_owned();
    words.next().is_none().then_some(Property { name, kind })
}

/// Most elements and properties of a header; no sensible file comes near.
const MAX_DECLARED: usize = 1000;

#[cfg(test)]
mod tests {
    use super::*;

    const HEADER: &str = "ply\nformat binary_big_endian 1.0\ncomment TextureFile a b.png\nobj_info x\n\
        element vertex 3\nproperty float32 x\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";

    #[test]
    fn all_line_ends() {
        for end in ["\n", "\r\n", "\r"] {
            let mut bytes = HEADER.replace('\n', end).into_bytes();
            let length = bytes.len();
            bytes.extend(b"\n\r\n");
            let header = Header::parse(&bytes, "").unwrap();
            assert_eq!(header.length, length);
            assert_eq!((header.lines, &header.textures[..]), (9, &["a b.png".to_owned()][..]));
            assert_eq!(header.encoding, Encoding::BigEndian);
            assert_eq!(
                header.elements[1],
                Element {
                    name: "face".into(),
                    count: 1,
                    properties: vec![Property {
                        name: "vertex_indices".into(),
                        kind: Kind::List(Scalar::U8, Scalar::I32)
                    }],
                    line: 7
                }
            );
        }
    }

    #[test]
    fn what_hands_and_exporters_add() {
        let plain = Header::parse(HEADER.as_bytes(), "").unwrap();
        for (from, to) in [
            ("ply", "\u{feff}ply"),
            ("ply", "ply "),
            ("ply", "\u{feff}ply \t"),
            ("comment TextureFile a b.png\n", "comment TextureFile a b.png\nMade by hand\n"),
        ] {
            for end in ["\n", "\r\n", "\r"] {
                let text = HEADER.replacen(from, to, 1).replace('\n', end);
                assert!(is_ply(text.as_bytes()));
                let header = Header::parse(text.as_bytes(), "").unwrap();
                let lines = text.matches(end).count();
                assert_eq!((header.length, header.lines), (text.len(), lines as u64), "{text:?}");
                let places = |header: &Header| {
                    header.elements.iter().map(|e| (e.name.clone(), e.count)).collect::<Vec<_>>()
                };
                assert_eq!(places(&header), places(&plain));
                assert_eq!((header.encoding, header.textures), (plain.encoding, plain.textures.clone()));
            }
        }
        for no in ["ply", "plywood\n", " ply\n", "ply x\n", "PLY\n"] {
            assert!(!is_ply(no.as_bytes()), "{no:?}");
        }
    }

    #[test]
    fn faults_are_placed() {
        let fails_at = |line: u64, text: &str| match Header::parse(text.as_bytes(), "a.ply") {
            Err(Error::Input(e)) => assert_eq!(e.place, Place::Line(line), "{text:?} {e}"),
            other => panic!("{text:?} {other:?}"),
        };
        fails_at(1, "ply");
        fails_at(1, "plywood\n");
        fails_at(1, "PLY\n");
        fails_at(2, "ply\n");
        fails_at(2, "ply\nformat ascii 1.0");
        fails_at(3, "ply\nformat ascii 1.0\n");
        fails_at(2, "ply\nend_header\n");
        for line in [
            "format ascii",
            "format ascii 2.0",
            "format binary 1.0",
            "element vertex",
            "element vertex -1",
            "element vertex 99999999999999999999",
            "element vertex 1 2",
            "property float x",
            "element v 1\rproperty float x",
        ] {
            fails_at(2, &format!("ply\n{line}\n"));
        }
        for line in ["garbage", "elemnt v 1", "Property float x"] {
            fails_at(3, &format!("ply\nelement v 1\n{line}\nproperty float x\n"));
        }
        fails_at(4, "ply\nfromat ascii 1.0\nelement v 1\nend_header\n");
        fails_at(4, "ply\nformat ascii 1.0\nelemnt v 1\nproperty float x\nend_header\n");
        for line in
            ["property", "property float", "property half x", "property list uchar x", "property float x y"]
        {
            fails_at(3, &format!("ply\nelement v 1\n{line}\nend_header\n"));
        }
        let many = format!("ply\nelement v 1\n{}", "property int a\n".repeat(MAX_DECLARED + 5));
        fails_at(2 + MAX_DECLARED as u64, &many);
    }

    #[test]
    fn every_truncation_is_an_error() {
        for length in 0..HEADER.len() {
            assert!(Header::parse(&HEADER.as_bytes()[..length], "").is_err());
        }
    }
}
