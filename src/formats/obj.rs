//! Reads Wavefront OBJ: vertices and polygons; the rest is named, not kept.
//!
//! A statement is a line; `\` before a line end continues it; `#` begins a comment. Indices count from 1, negative
//! ones back from the vertex read last. A positive index may name a vertex that comes later.

use std::collections::HashSet;

use crate::error::{Error, InputError, Place, Result};

use super::fan::{self, Fans};
use super::text::{byte_order_mark, integer, line_end, number, quoted};
use super::{Coordinates, Format, Source};

/// Reads an OBJ file. `name` is for error messages.
///
/// # Errors
/// [`Error::Input`] at the line at fault.
pub(super) fn read(bytes: &[u8], name: &str) -> Result<Source> {
    let mut statements = Statements { bytes, next: byte_order_mark(bytes), line: 1, name };
    let mut positions = Vec::new();
    let mut faces = Faces::default();
    let mut dropped = Dropped::default();
    loop {
        match statements.word() {
            None => {}
            Some(b"v") => positions.push(read_vertex(&mut statements, positions.len(), &mut dropped)?),
            Some(b"f" | b"fo") => faces.read(&mut statements, positions.len())?,
            Some(keyword) => dropped.note(keyword, &mut statements),
        }
        if !statements.advance() {
            break;
        }
    }
    if let (true, Some((line, keyword))) = (positions.is_empty(), dropped.first_unknown) {
        let what = format!("not an OBJ file: {} is no statement", quoted(keyword));
        return Err(InputError::new(name, Place::Line(line), what).into());
    }
    let Faces { fans, ahead } = faces;
    if let Some(&(index, line)) = ahead.iter().find(|(index, _)| *index > positions.len() as u64) {
        let what = format!("vertex index {index} is out of range: the file has {} vertices", positions.len());
        return Err(InputError::new(name, Place::Line(line), what).into());
    }
    let fan::Faces { mesh, polygons, notes } = fans.mesh(positions);
    let dropped = dropped.in_words().into_iter().chain(notes).collect();
    let format = Format::Obj;
    Ok(Source { mesh, format, polygons, coordinates: Coordinates::Text, text: true, dropped })
}

/// The file as statements of words.
struct Statements<'a> {
    bytes: &'a [u8],
    next: usize,
    /// The 1-based line of `next`, which is also that of the word read last.
    line: u64,
    name: &'a str,
}

impl<'a> Statements<'a> {
    /// The next word of the present statement; `None` at its end.
    #[inline]
    fn word(&mut self) -> Option<&'a [u8]> {
        let rest = loop {
            let rest = &self.bytes[self.next..];
            match rest.first()? {
                b'\r' | b'\n' => return None,
                b'\\' if line_end(&rest[1..]) > 0 => {
                    self.next += 1 + line_end(&rest[1..]);
                    self.line += 1;
                }
                b'#' => {
                    self.next += rest.iter().position(|b| matches!(b, b'\r' | b'\n')).unwrap_or(rest.len());
                    return None;
                }
                b if b.is_ascii_whitespace() => self.next += 1,
                _ => break rest,
            }
        };
        let ends =
            |(k, b): (usize, &u8)| b.is_ascii_whitespace() || *b == b'\\' && line_end(&rest[k + 1..]) > 0;
        let length = rest.iter().enumerate().position(ends).unwrap_or(rest.len());
        self.next += length;
        Some(&rest[..length])
    }

    /// The remaining words of the present statement, with what is between them.
    fn words(&mut self) -> &'a [u8] {
        let Some(first) = self.word() else { return &[] };
        let start = self.next - first.len();
        let mut end = self.next;
        while self.word().is_some() {
            end = self.next;
        }
        &self.bytes[start..end]
    }

    /// Goes to the next statement, if there is one.
    fn advance(&mut self) -> bool {
        while self.word().is_some() {}
        let end = line_end(&self.bytes[self.next..]);
        self.next += end;
        self.line += 1;
        end > 0
    }

    /// A fault in the word read last.
    fn fault(&self, what: impl Into<String>) -> Error {
        InputError::new(self.name, Place::Line(self.line), what).into()
    }
}

/// Reads the rest of a `v` statement; `before` vertices came before it.
fn read_vertex(statements: &mut Statements, before: usize, dropped: &mut Dropped) -> Result<[f64; 3]> {
    let mut position = [0.0; 3];
    for (axis, x) in ["x", "y", "z"].into_iter().zip(&mut position) {
        let vertex = before + 1;
        let word =
            statements.word().ok_or_else(|| statements.fault(format!("vertex {vertex} has no {axis}")))?;
        *x = number(word).ok_or_else(|| statements.fault(format!("{} is not a number", quoted(word))))?;
        if !x.is_finite() {
            return Err(statements.fault(format!("{axis} of vertex {vertex} is {x}")));
        }
    }
    let mut extra = 0;
    while statements.word().is_some() {
        extra += 1;
    }
    match extra {
        0 => {}
        1 => dropped.weights = true,
        3 => dropped.colours = true,
        _ => dropped.columns = true,
    }
    Ok(position)
}

/// The faces read so far.
#[derive(Default)]
struct Faces {
    fans: Fans,
    /// References to vertices that had not come yet: index (from 1) and line, only where the index is a new maximum. The
    /// first reference past the last vertex is among them.
    ahead: Vec<(u64, u64)>,
}

impl Faces {
    /// Reads the rest of an `f` statement; `before` vertices came before it.
    #[inline]
    fn read(&mut self, statements: &mut Statements, before: usize) -> Result<()> {
        while let Some(word) = statements.word() {
            // v, v/vt, v//vn, v/vt/vn; texture coordinates and normals are not kept.
            let digits = word.iter().position(|&b| b == b'/').unwrap_or(word.len());
            let index = integer(&word[..digits])
                .ok_or_else(|| statements.fault(format!("{} is not a vertex index", quoted(word))))?;
            let position = match index {
                1.. => index - 1,
                0 => return Err(statements.fault("vertex index 0: indices count from 1")),
                _ => before as i64 + index,
            };
            if position < 0 {
                let what = format!("vertex index {index} is out of range: {before} vertices come before it");
                return Err(statements.fault(what));
            }
            if index > before as i64 && self.ahead.last().is_none_or(|last| last.0 < index as u64) {
                self.ahead.push((index as u64, statements.line));
            }
            // An index beyond 32 bits is beyond the last vertex too, or beyond the limit of a mesh.
            self.fans.corner(position as u32);
        }
        self.fans.end();
        Ok(())
    }
}

/// What is not kept.
#[derive(Default)]
struct Dropped<'a> {
    weights: bool,
    colours: bool,
    columns: bool,
    /// How often each row of [`NOT_KEPT`] occurred.
    counts: [usize; NOT_KEPT.len()],
    /// The names seen in its rows of [`Count::Names`].
    names: HashSet<(usize, &'a [u8])>,
    unknown: usize,
    /// The first unknown keyword and its line.
    first_unknown: Option<(u64, &'a [u8])>,
}

impl<'a> Dropped<'a> {
    /// Takes note of a statement whose keyword has been read.
    fn note(&mut self, keyword: &'a [u8], statements: &mut Statements<'a>) {
        let Some(row) = NOT_KEPT.iter().position(|(.., keywords)| keywords.contains(&keyword)) else {
            self.unknown += 1;
            self.first_unknown.get_or_insert((statements.line, keyword));
            return;
        };
        let new = match NOT_KEPT[row].1 {
            Count::Statements | Count::Not => true,
            Count::Names => {
                let name = statements.words();
                !(keyword == b"s" && matches!(name, b"off" | b"0")) && self.names.insert((row, name))
            }
        };
        self.counts[row] += usize::from(new);
    }

    fn in_words(&self) -> Vec<String> {
        let mut words = Vec::new();
        let columns = [
            (self.weights, "vertex weights"),
            (self.colours, "vertex colours"),
            (self.columns, "further numbers of vertices"),
        ];
        words.extend(columns.iter().filter(|(there, _)| *there).map(|(_, what)| what.to_string()));
        for (&count, (what, how, _)) in self.counts.iter().zip(&NOT_KEPT) {
            match how {
                _ if count == 0 => {}
                Count::Not => words.push(what.to_string()),
                Count::Statements | Count::Names => words.push(format!("{what} ({count})")),
            }
        }
        if self.unknown > 0 {
            words.push(format!("unknown statements ({})", self.unknown));
        }
        words
    }
}

/// What to count of some statements.
enum Count {
    Statements,
    /// Distinct names.
    Names,
    Not,
}

/// Statements that are not kept: what they are, what of them is counted, their keywords.
const NOT_KEPT: [(&str, Count, &[&[u8]]); 11] = [
    ("normals", Count::Statements, &[b"vn"]),
    ("texture coordinates", Count::Statements, &[b"vt"]),
    ("line elements", Count::Statements, &[b"l"]),
    ("point elements", Count::Statements, &[b"p"]),
    ("groups", Count::Names, &[b"g"]),
    ("objects", Count::Names, &[b"o"]),
    ("smoothing groups", Count::Names, &[b"s"]),
    ("materials", Count::Names, &[b"usemtl"]),
    ("material libraries", Count::Names, &[b"mtllib"]),
    ("free-form geometry", Count::Not, FREE_FORM),
    ("display settings", Count::Not, DISPLAY),
];
const FREE_FORM: &[&[u8]] = &[
    b"vp", b"cstype", b"deg", b"bmat", b"step", b"curv", b"curv2", b"surf", b"parm", b"trim", b"hole",
    b"scrv", b"sp", b"end", b"con",
];
const DISPLAY: &[&[u8]] = &[
    b"bevel",
    b"c_interp",
    b"d_interp",
    b"lod",
    b"maplib",
    b"usemap",
    b"shadow_obj",
    b"trace_obj",
    b"ctech",
    b"stech",
    b"mg",
];

#[cfg(test)]
mod tests {
    use super::*;

    fn source(text: &str) -> Source {
        read(text.as_bytes(), "").unwrap()
    }

    fn fails(place: u64, what: &str, text: &str) {
        let expected = InputError::new("a.obj", Place::Line(place), what);
        match read(text.as_bytes(), "a.obj") {
            Err(Error::Input(e)) => assert_eq!(e, expected, "{text:?}"),
            other => panic!("{text:?} {other:?}"),
        }
    }

    const THREE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 -2.5e-1\n";

    #[test]
    fn a_triangle() {
        let s = source(&format!("{THREE}f 1 2 3"));
        assert_eq!(s.mesh.positions, [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, -0.25]]);
        assert_eq!(s.mesh.triangles, [[0, 1, 2]]);
        assert_eq!((s.polygons, s.coordinates, s.dropped.len()), (0, Coordinates::Text, 0));
    }

    #[test]
    fn all_ways_to_write_a_corner() {
        for face in
            ["1 2 3", "1/7 2/8 3/9", "1//7 2//8 3//9", "1/7/7 2/8/8 3/9/9", "-3 -2/-1 -1//-1", "1// 2/ 3"]
        {
            assert_eq!(source(&format!("{THREE}f {face}\n")).mesh.triangles, [[0, 1, 2]], "{face}");
        }
        // Negative indices count from where they stand.
        let s = source("v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\nv 5 5 5\nf -3 -2 -1\n");
        assert_eq!(s.mesh.triangles, [[0, 1, 2], [1, 2, 3]]);
    }

    #[test]
    fn white_space_comments_and_continuations() {
        for text in [
            "\u{feff}v\t0 0 0 \r\n  v 1 0 0\r\n\r\n#v 9 9 9\r\nv 0 1 0 # x\r\nf 1\t2 \\\r\n 3\r\n",
            "v 0 0 0\rv 1 0 0\rv 0\\\r1 0\rf 1 2\\\r3",
            "# ends in \\\nv 0 0 0\nv 1 0 0\nv 0 \\\n\\\n1 0\nf \\\n1 2 3\\\n",
        ] {
            let s = source(text);
            assert_eq!(s.mesh.positions, [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], "{text:?}");
            assert_eq!(s.mesh.triangles, [[0, 1, 2]], "{text:?}");
            assert!(s.dropped.is_empty());
        }
    }

    #[test]
    fn polygons_become_fans_and_short_faces_nothing() {
        let s = source(&format!("{THREE}v 0 0 1\nf 2 3 4 1\nf 1 2\nf\nf 1 2 3\n"));
        assert_eq!(s.mesh.triangles, [[1, 2, 3], [1, 3, 0], [0, 1, 2]]);
        assert_eq!(s.polygons, 1);
        assert_eq!(s.dropped, ["faces with fewer than 3 corners (2)"]);
    }

    #[test]
    fn a_face_may_come_before_its_vertices() {
        assert_eq!(source(&format!("f 1 2 3\n{THREE}")).mesh.triangles, [[0, 1, 2]]);
    }

    #[test]
    fn what_is_not_kept_is_named() {
        let text = "mtllib a.mtl\nv 0 0 0 1\nv 1 0 0 1 1 1\nv 0 1 0 1 2\nvt 0 0\nvt nan 0\nvn 0 0 1\no a\ng b c\n\
            g b  d\ng b c\nusemtl\nusemtl red\nusemtl red\ns off\ns 1\nl 1 2\np 1\nf 1 2 3\ncurv 0 1 1 2\nlod 1\nfrob\n";
        assert_eq!(
            source(text).dropped,
            [
                "vertex weights",
                "vertex colours",
                "further numbers of vertices",
                "normals (1)",
                "texture coordinates (2)",
                "line elements (1)",
                "point elements (1)",
                "groups (2)",
                "objects (1)",
                "smoothing groups (1)",
                "materials (2)",
                "material libraries (1)",
                "free-form geometry",
                "display settings",
                "unknown statements (1)",
            ]
        );
    }

    #[test]
    fn faults_are_placed() {
        fails(2, "x of vertex 1 is NaN", "\nv nan 0 0\n");
        fails(2, "z of vertex 2 is -inf", "v 0 0 0\nv 0 0 -1e999\n");
        fails(1, "vertex 1 has no z", "v 0 0");
        fails(3, "\"x\" is not a number", "v 0 \\\n0 \\\nx\n");
        fails(4, "\"a/1\" is not a vertex index", &format!("{THREE}f 1 a/1 3\n"));
        fails(4, "\"/1\" is not a vertex index", &format!("{THREE}f /1 2 3\n"));
        fails(4, "vertex index 0: indices count from 1", &format!("{THREE}f 0 1 2\n"));
        fails(
            5,
            "vertex index -4 is out of range: 3 vertices come before it",
            &format!("{THREE}f 1 2 \\\n-4\n"),
        );
        let far = "vertex index 9223372036854775807 is out of range: the file has 3 vertices";
        fails(4, far, &format!("{THREE}f 1 2 9223372036854775807"));
        // The first of several, though neither the first nor the largest of those that look ahead.
        let late = "f 1 2 3\nf 1 2 4\nf 1 2 9\nf 1 2 5\n";
        fails(2, "vertex index 4 is out of range: the file has 3 vertices", &format!("{late}{THREE}"));
        fails(1, "not an OBJ file: \"solid\" is no statement", "solid x\n facet normal 0 0 1\n");
    }
}
