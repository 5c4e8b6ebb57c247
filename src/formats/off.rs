//! Reads OFF, the Object File Format of Geomview, text and binary.
//!
//! - The keyword may be missing; its prefixes tell what a vertex has beside its position: N normals, C colours, ST
//!   texture coordinates. Points of other than three coordinates (prefixes 4 and n) are refused.
//! - `#` begins a comment. The counts may stand in the line of the keyword, even without a blank between; the
//!   number of edges may be missing in a line of its own, and is not looked at.
//! - Vertices are a line each, and what follows the coordinates in it is what the prefixes tell; without any, three or four numbers are a
//!   colour. What is more or less is not kept. Where the file has too few lines for that, they are numbers one after the
//!   other, as many a vertex as the prefixes tell.
//! - What follows the indices of a face in its line is its colour; a single number, that of a colour map, is not kept.
//! - Colours are integers that stand for fractions of 255 where all are integers and some are more than 1. Other numbers are
//!   binary32 where that tells all their decimals, else binary64.
//! - Binary data are big-endian.

use byteorder::BigEndian;

use crate::error::Result;

use super::fan::{Faces, Fans};
use super::gather::Gathered;
use super::off_beside::{Beside, Prefixes};
use super::ply_header::Scalar;
use super::ply_values::{Binary, Values as _};
use super::text::{ENDS_EARLY, Words, byte_order_mark, integer, line_end, quoted};
use super::{Coordinates, Format, Source, within};

/// Reads an OFF file. `name` is for error messages.
///
/// # Errors
/// [`crate::Error::Input`] at the line (text) or byte (binary) at fault.
pub(super) fn read(bytes: &[u8], name: &str) -> Result<Source> {
    let mut words = words(bytes, name);
    let keyword = words.word().map(Keyword::split);
    let Some((keyword, rest)) = keyword else { return Err(words.fault(ENDS_EARLY)) };
    words.unread(rest.len());
    if let Some(dimensions) = keyword.dimensions {
        let what = format!("points of {dimensions} coordinates are not read");
        return Err(words.fault(what));
    }
    let mut peek = words.clone();
    if peek.word_in_line() == Some(b"BINARY") {
        peek.skip_line();
        let data = bytes.len() - peek.rest().len() + line_end(peek.rest());
        return Body::new(keyword).binary(Binary::new(bytes, data, name));
    }
    Body::new(keyword).text(words)
}

/// Whether the content tells that this is an OFF file.
pub(super) fn is_off(bytes: &[u8]) -> bool {
    words(bytes, "").word().is_some_and(|word| Keyword::split(word).0.there)
}

fn words<'a>(bytes: &'a [u8], name: &'a str) -> Words<'a> {
    Words::new(bytes, byte_order_mark(bytes), 0, name).with_comments()
}

/// What the first word tells.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Keyword {
    there: bool,
    prefixes: Prefixes,
    /// The prefix that tells of other than three coordinates.
    dimensions: Option<&'static str>,
}

impl Keyword {
    /// The keyword at the start of a word and what follows it without a blank; all of the word where there is none.
    fn split(word: &[u8]) -> (Self, &[u8]) {
        let mut rest = word;
        let mut prefix = |text: &[u8]| {
            let behind = rest.strip_prefix(text);
            rest = behind.unwrap_or(rest);
            behind.is_some()
        };
        let (texture, colours, normals) = (prefix(b"ST"), prefix(b"C"), prefix(b"N"));
        let dimensions = match (prefix(b"4"), prefix(b"n")) {
            (false, false) => None,
            (true, false) => Some("4"),
            (false, true) => Some("n"),
            (true, true) => Some("n + 1"),
        };
        let there = prefix(b"OFF") || word == b"off" && prefix(b"off");
        let number = rest.is_empty() || integer(rest).is_some_and(|n| n >= 0);
        if there && number {
            (Self { there, prefixes: Prefixes { normals, colours, texture }, dimensions }, rest)
        } else {
            (Self::default(), word)
        }
    }
}

/// The file behind its keyword, as it is read.
struct Body {
    keyword: Keyword,
    positions: Vec<[f64; 3]>,
    fans: Fans,
    beside: Beside,
    dropped: Vec<String>,
}

impl Body {
    fn new(keyword: Keyword) -> Self {
        Self {
            keyword,
            positions: Vec::new(),
            fans: Fans::default(),
            beside: Beside::default(),
            dropped: Vec::new(),
        }
    }

    fn text(mut self, mut words: Words) -> Result<Source> {
        let vertices = self.count(&mut words, "vertices")?;
        let line = words.line();
        let faces = self.count(&mut words, "faces")?;
        let edges = if words.line() == line { words.word_in_line() } else { words.word() };
        if let Some(word) = edges.filter(|word| integer(word).is_none_or(|n| n < 0)) {
            return Err(words.fault(format!("{} is not a number of edges", quoted(word))));
        }
        let rows = self.are_rows(words.clone(), vertices, faces);
        self.text_vertices(&mut words, vertices, rows).map_err(|e| within(e, "vertices"))?;
        self.text_faces(&mut words, vertices, faces).map_err(|e| within(e, "faces"))?;
        if words.word().is_some() {
            self.dropped.push(format!("text after the last face, from line {} on", words.line()));
        }
        Ok(self.source(Coordinates::Text, true))
    }

    fn count(&self, words: &mut Words, what: &str) -> Result<u64> {
        let Some(word) = words.word() else {
            return Err(words.fault(format!("{ENDS_EARLY}: no number of {what}")));
        };
        match integer(word).map(u64::try_from) {
            Some(Ok(count)) => Ok(count),
            _ if !self.keyword.there && what == "vertices" => {
                Err(words.fault(format!("not an OFF file: it begins with {}", quoted(word))))
            }
            _ => Err(words.fault(format!("{} is not a number of {what}", quoted(word)))),
        }
    }

    /// Whether every vertex has a line of its own, with whatever else stands in it; or else they are numbers one after the
    /// other: where the first line has too few for one, or others than the keyword tells and there are too few lines.
    fn are_rows(&self, mut words: Words, vertices: u64, faces: u64) -> bool {
        let rest = words.rest();
        let first = u64::from(words.word().is_some()) + words.count_in_line();
        let numbers = 3 + self.keyword.prefixes.numbers() as u64;
        first >= 3 && (first == numbers || has_lines(rest, vertices.saturating_add(faces)))
    }

    fn text_vertices(&mut self, words: &mut Words, vertices: u64, rows: bool) -> Result<()> {
        // A position takes six bytes at least.
        self.positions.reserve(vertices.min(words.rest().len() as u64 / 6) as usize);
        let prefixes = self.keyword.prefixes;
        let mut beside = Vec::new();
        for vertex in 0..vertices {
            let mut position = [0.0; 3];
            for (axis, x) in position.iter_mut().enumerate() {
                *x = finite(words.number()?, axis, vertex).map_err(|what| words.fault(what))?;
            }
            self.positions.push(position);
            beside.clear();
            if rows {
                // More than there can be, so that it is seen that they are too many.
                beside
                    .extend(std::iter::from_fn(|| words.word_in_line()).take(prefixes.numbers().max(4) + 1));
                words.count_in_line();
            } else {
                for _ in 0..prefixes.numbers() {
                    let mut ahead = words.clone();
                    beside.extend(ahead.word());
                    words.number()?;
                }
            }
            self.beside.vertex(self.positions.len() - 1, prefixes, &beside);
        }
        Ok(())
    }

    fn text_faces(&mut self, words: &mut Words, vertices: u64, faces: u64) -> Result<()> {
        // A triangle takes eight bytes at least.
        self.fans.triangles.reserve(faces.min(words.rest().len() as u64 / 8) as usize);
        let mut colour_words = Vec::new();
        for face in 0..faces {
            let length = length(words.integer()?, face).map_err(|what| words.fault(what))?;
            for _ in 0..length {
                let index = words.integer()?;
                self.corner(index, vertices).map_err(|what| words.fault(what))?;
            }
            self.fans.end();
            colour_words.clear();
            colour_words.extend(std::iter::from_fn(|| words.word_in_line()).take(MOST_OF_COLOUR as usize));
            let colour = colour_words.len() as u64 + words.count_in_line();
            if colour > MOST_OF_COLOUR {
                let what =
                    format!("{colour} numbers behind the corners of face {face}, and a colour has 4 at most");
                return Err(words.fault(what));
            }
            self.beside.face(face as usize, &colour_words);
        }
        Ok(())
    }

    fn binary(mut self, mut values: Binary<BigEndian>) -> Result<Source> {
        let mut counts = [0; 3];
        for (count, what) in counts.iter_mut().zip(["vertices", "faces", "edges"]) {
            let told = values.integer(Scalar::I32).map_err(|e| within(e, "counts"))?;
            *count =
                u64::try_from(told).map_err(|_| values.fault(format!("{told} is not a number of {what}")))?;
        }
        let [vertices, faces, _] = counts;
        self.binary_vertices(&mut values, vertices).map_err(|e| within(e, "vertices"))?;
        self.binary_faces(&mut values, vertices, faces).map_err(|e| within(e, "faces"))?;
        self.dropped.extend(values.rest());
        Ok(self.source(Coordinates::Float32, false))
    }

    fn binary_vertices(&mut self, values: &mut Binary<BigEndian>, vertices: u64) -> Result<()> {
        self.positions.reserve(vertices.min(values.at_most(Scalar::F32) as u64 / 3) as usize);
        for vertex in 0..vertices {
            let mut position = [0.0; 3];
            for (axis, x) in position.iter_mut().enumerate() {
                *x = finite(values.number(Scalar::F32)?, axis, vertex).map_err(|what| values.fault(what))?;
            }
            let prefixes = self.keyword.prefixes;
            let numbers = Self::numbers(values, prefixes.numbers())?;
            let words: Vec<&[u8]> = numbers.iter().map(|number| number.as_bytes()).collect();
            self.beside.vertex(self.positions.len(), prefixes, &words);
            self.positions.push(position);
        }
        Ok(())
    }

    fn binary_faces(&mut self, values: &mut Binary<BigEndian>, vertices: u64, faces: u64) -> Result<()> {
        for face in 0..faces {
            let length = length(values.integer(Scalar::I32)?, face).map_err(|what| values.fault(what))?;
            for _ in 0..length {
                let index = values.integer(Scalar::I32)?;
                self.corner(index, vertices).map_err(|what| values.fault(what))?;
            }
            self.fans.end();
            let colour = values.integer(Scalar::I32)?;
            if !(0..=MOST_OF_COLOUR as i64).contains(&colour) {
                let what = format!("face {face} has a colour of {colour} numbers, and it has 0 to 4");
                return Err(values.fault(what));
            }
            let numbers = Self::numbers(values, colour as usize)?;
            let words: Vec<&[u8]> = numbers.iter().map(|number| number.as_bytes()).collect();
            self.beside.face(face as usize, &words);
        }
        Ok(())
    }

    /// A corner of the present face.
    #[inline]
    fn corner(&mut self, index: i64, vertices: u64) -> Result<(), String> {
        match u32::try_from(index) {
            Ok(v) if u64::from(v) < vertices => {
                self.fans.corner(v);
                Ok(())
            }
            _ => Err(format!("vertex index {index} is out of range: the file has {vertices} vertices")),
        }
    }

    /// So many numbers of a binary file, as text of a program would have them.
    fn numbers(values: &mut Binary<BigEndian>, count: usize) -> Result<Vec<String>> {
        let number = |_| values.bits(Scalar::F32).map(|bits| f32::from_bits(bits as u32).to_string());
        (0..count).map(number).collect()
    }

    fn source(mut self, coordinates: Coordinates, text: bool) -> Source {
        let Faces { mesh, polygons, notes, origins } = self.fans.mesh(self.positions);
        let mut gathered = Gathered::default();
        self.beside.finish(&mesh.triangles, &origins, &mut gathered);
        let mesh = gathered.mesh(mesh);
        self.dropped.extend(gathered.dropped);
        self.dropped.extend(notes);
        Source { polygons, text, dropped: self.dropped, ..Source::new(mesh, Format::Off, coordinates) }
    }
}

fn finite(x: f64, axis: usize, vertex: u64) -> Result<f64, String> {
    if x.is_finite() { Ok(x) } else { Err(format!("{} of vertex {vertex} is {x}", ["x", "y", "z"][axis])) }
}

fn length(told: i64, face: u64) -> Result<u64, String> {
    u64::try_from(told).map_err(|_| format!("face {face} has {told} corners"))
}

/// Whether there are so many lines with anything but comments.
fn has_lines(text: &[u8], lines: u64) -> bool {
    let line = |line: &&[u8]| line.trim_ascii_start().first().is_some_and(|&b| b != b'#');
    let found = text.split(|b| matches!(b, b'\r' | b'\n')).filter(line);
    found.take(usize::try_from(lines).unwrap_or(usize::MAX)).count() as u64 == lines
}

/// Most numbers of a colour.
const MOST_OF_COLOUR: u64 = 4;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::{Error, InputError, Place};
    use crate::formats::text::number;
    use crate::mesh::attributes::{Domain, NO_VALUE, Semantic, Values};

    const SQUARE: &str = "0 0 0\n1 0 0\n1 1 0\n0 1 0.1\n";
    const POSITIONS: [[f64; 3]; 4] = [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.1]];
    const TRIANGLES: [[u32; 3]; 2] = [[0, 1, 2], [0, 2, 3]];

    fn square(text: impl AsRef<[u8]>) -> Source {
        let s = read(text.as_ref(), "").unwrap();
        assert_eq!(s.mesh.positions, POSITIONS, "{:?}", String::from_utf8_lossy(text.as_ref()));
        assert_eq!(s.mesh.triangles, TRIANGLES);
        s
    }

    fn fails(place: Place, what: &str, bytes: impl AsRef<[u8]>) {
        match read(bytes.as_ref(), "a.off") {
            Err(Error::Input(e)) => assert_eq!(e, InputError::new("a.off", place, what)),
            other => panic!("{other:?}"),
        }
    }

    /// Numbers, as a binary file has them: those with a point as binary32, others as integers.
    fn binary(keyword: &str, numbers: &str) -> Vec<u8> {
        let bytes = numbers.split_whitespace().flat_map(|word| match integer(word.as_bytes()) {
            Some(n) => (n as i32).to_be_bytes(),
            None => (number(word.as_bytes()).unwrap() as f32).to_be_bytes(),
        });
        let mut file = format!("# made by hand\n{keyword} BINARY\n").into_bytes();
        file.extend(bytes);
        file
    }

    #[test]
    fn heads_of_all_kinds() {
        for head in [
            "OFF\n4 1 4\n",
            "# c\n\n OFF # c\n# c\n4 # c\n1\n4\n# c\n\n",
            "OFF 4 1 4\n",
            "OFF4 1 0\n",
            "off\n4 1\n",
            "4 1 4\n",
            "\u{feff}OFF\n4 1 4\n",
        ] {
            for end in ["\n", "\r\n", "\r"] {
                let s = square(format!("{head}{SQUARE}4 0 1 2 3").replace('\n', end));
                assert_eq!((s.format, s.coordinates, s.text), (Format::Off, Coordinates::Text, true));
                assert_eq!((s.polygons, s.dropped), (1, vec![]));
            }
        }
    }

    #[test]
    fn the_content_tells() {
        for yes in ["OFF", "\n# c\nOFF #\n", "COFF\n", "STCN4nOFF", "OFF12 4 5", "nOFF", "off"] {
            assert!(is_off(yes.as_bytes()), "{yes}");
        }
        for no in ["", "OFFS", "4 1 4", "NCOFF", "offset", "v 1 2 3", "OFF-1", "solid", "#OFF"] {
            assert!(!is_off(no.as_bytes()), "{no}");
        }
    }

    #[test]
    fn numbers_wherever_lines_end() {
        let line = SQUARE.replace('\n', " ");
        square(format!("OFF 4 1 4 {line} 4 0 1 2 3\n"));
        square(format!("OFF\n4 1 4\n{line}\n4 0 1\n2 3"));
        square(format!("OFF\n4 1 4\n{} 4 0 1 2 3\n", SQUARE.replace(' ', "\n")));
        square("OFF\n4 1 4\n0 0 0 1\n0 0 1 1\n0 0 1 0.1\n4 0 1 2 3\n");
        let coloured = SQUARE.replace('\n', " 1 1 1 1 ");
        let s = square(format!("COFF 4 1 4\n{coloured} 4 0 1 2 3\n"));
        assert_eq!((s.mesh.attributes[0].count(), s.dropped.len()), (4, 0));
    }

    #[test]
    fn colours_of_faces_and_short_faces() {
        let s = square(format!(
            "OFF\n4 6 0\n{SQUARE}3 0 1 2 255 0 0\n3 0 2 3 # red\n2 0 1 7\n1 0\n0\n1 3 .1 .2 .3 1 # x\nmore\n"
        ));
        assert_eq!(
            s.dropped,
            [
                "text after the last face, from line 13 on",
                "face colours of no triangle (1)",
                "face colours by the number of a colour map (1)",
                "faces with fewer than 3 corners (4)"
            ]
        );
        let [color] = &s.mesh.attributes[..] else { panic!("{s:?}") };
        assert_eq!((color.semantic, color.domain, color.components), (Semantic::Color, Domain::Triangle, 4));
        assert_eq!(
            (&color.values, &color.corners[..]),
            (&Values::F32(vec![255.0, 0.0, 0.0, 1.0]), &[0, NO_VALUE][..])
        );
    }

    #[test]
    fn binary_data() {
        let positions = "0.0 0.0 0.0 1.0 0.0 0.0 1.0 1.0 0.0 0.0 1.0 0.25";
        let s =
            read(&binary("OFF", &format!("4 2 0 {positions} 3 0 1 2 0 3 0 2 3 4 1. 1. 1. .5")), "").unwrap();
        assert_eq!(s.mesh.positions[..3], POSITIONS[..3]);
        assert_eq!(s.mesh.positions[3], [0.0, 1.0, 0.25]);
        assert_eq!(s.mesh.triangles, TRIANGLES);
        assert_eq!((s.coordinates, s.text), (Coordinates::Float32, false));
        let [color] = &s.mesh.attributes[..] else { panic!("{s:?}") };
        assert_eq!(
            (&color.values, &color.corners[..]),
            (&Values::F32(vec![1.0, 1.0, 1.0, 0.5]), &[NO_VALUE, 0][..])
        );
        assert_eq!(s.dropped, [""; 0]);

        let vertex = "1. 2. 3. 0. 0. 1. .1 .2 .3 .4";
        let s = read(&binary("CNOFF", &format!("1 1 0 {vertex} 3 0 0 0 0 9")), "").unwrap();
        assert_eq!((&s.mesh.positions[..], &s.mesh.triangles[..]), (&[[1.0, 2.0, 3.0]][..], &[[0; 3]][..]));
        let [normal, color] = &s.mesh.attributes[..] else { panic!("{s:?}") };
        assert_eq!((&normal.values, &normal.corners[..]), (&Values::F32(vec![0.0, 0.0, 1.0]), &[0; 3][..]));
        assert_eq!(color.values, Values::F32(vec![0.1, 0.2, 0.3, 0.4]));
        assert_eq!(s.dropped, ["4 bytes after the last element"]);
    }

    #[test]
    fn faults_in_text_are_placed() {
        let with = |faces: &str| format!("OFF\n4 1 4\n{SQUARE}{faces}\n");
        let range = "is out of range: the file has 4 vertices (faces)";
        fails(Place::Line(7), &format!("vertex index 4 {range}"), with("3 0 1 4"));
        fails(Place::Line(7), &format!("vertex index -1 {range}"), with("3 0 -1 2"));
        fails(Place::Line(7), "\"1.5\" is not an integer (faces)", with("3 0 1.5 2"));
        fails(Place::Line(7), "face 0 has -3 corners (faces)", with("-3 0 1 2"));
        let colour = "5 numbers behind the corners of face 0, and a colour has 4 at most (faces)";
        fails(Place::Line(7), colour, with("3 0 1 2 1 2 3 4 5"));
        fails(Place::Line(8), "the file ends early (faces)", with("5 0 1 2 3"));
        fails(Place::Line(4), "y of vertex 1 is NaN (vertices)", with("").replace("1 0 0", "1 nan 0"));
        fails(Place::Line(4), "x of vertex 1 is -inf (vertices)", with("").replace("1 0 0", "-1e999 0 0"));
        fails(Place::Line(4), "\"0,5\" is not a number (vertices)", with("").replace("1 0 0", "0,5 0 0"));
        fails(Place::Line(5), "the file ends early (vertices)", "OFF\n4 1 4\n0 0 0\n1 0 0\n");
        fails(Place::Line(1), "not an OFF file: it begins with \"solid\"", "solid x\n");
        fails(Place::Line(2), "\"-4\" is not a number of vertices", "OFF\n-4 1 4\n");
        fails(Place::Line(2), "\"x\" is not a number of faces", "OFF\n4 x 4\n");
        fails(Place::Line(2), "\"0.5\" is not a number of edges", "OFF\n4 1 0.5\n");
        fails(Place::Line(1), "the file ends early: no number of faces", "OFF 4");
        fails(Place::Line(1), "the file ends early", "#");
        fails(Place::Line(1), "points of 4 coordinates are not read", "C4OFF\n1 1 1\n");
        fails(Place::Line(2), "points of n coordinates are not read", "\nnOFF\n5\n1 1 1\n");
    }

    #[test]
    fn faults_in_binary_are_placed() {
        let vertex = "0.0 0.0 0.0";
        let whole = binary("OFF", &format!("1 1 0 {vertex} 3 0 0 0 0"));
        let data = whole.len() as u64 - 4 * 11;
        let at = |number: u64| Place::Byte(data + 4 * number);
        for length in data..whole.len() as u64 {
            match read(&whole[..length as usize], "") {
                Err(Error::Input(e)) => {
                    assert_eq!(e.place, at((length - data) / 4));
                    assert!(e.what.starts_with("the file ends early ("), "{e}");
                }
                other => panic!("{other:?}"),
            }
        }
        fails(at(1), "-1 is not a number of faces", binary("OFF", "1 -1 0"));
        fails(at(4), "y of vertex 0 is NaN (vertices)", binary("OFF", "1 1 0 0.0 nan 0.0"));
        let range = "vertex index 1 is out of range: the file has 1 vertices (faces)";
        fails(at(8), range, binary("OFF", &format!("1 1 0 {vertex} 3 0 1 0 0")));
        fails(at(6), "face 0 has -3 corners (faces)", binary("OFF", &format!("1 1 0 {vertex} -3")));
        let colour = "face 0 has a colour of 5 numbers, and it has 0 to 4 (faces)";
        fails(at(10), colour, binary("OFF", &format!("1 1 0 {vertex} 3 0 0 0 5")));
        fails(at(3), "the file ends early (vertices)", binary("OFF", "2147483647 1 0"));
    }
}
