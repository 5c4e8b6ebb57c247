//! Reads STL (3D Systems, 1989), text and binary: facets of three corners each, no shared vertices.
//!
//! - A file is binary where its length is the one that its count of facets asks for, also if it begins with `solid`, as
//!   many do; or where it does not go on as text.
//! - A binary file of more or fewer facets than it tells of is refused, unless forced: then its length counts.
//! - Keywords of text may be in any case, and `end` may be a word of its own; what follows `solid` and `endsolid` in their
//!   line is a name. A file may hold several solids. Lines `solid` and `endsolid` may be doubled, and `solid` missing, as in
//!   files that other readers take; but a solid that began and does not end is a file that was cut off. Comment lines
//!   may come first, zeros last.
//! - Every corner becomes a vertex of its own, as stored; conditioning welds them.

use byteorder::{ByteOrder, LittleEndian};

use crate::error::{InputError, Place, Result};
use crate::mesh::IndexedMesh;

use super::fan::{Faces, Fans};
use super::text::{self, ENDS_EARLY, Words, byte_order_mark, number, quoted};
use super::{Coordinates, Format, Source};

/// Reads an STL file. `name` is for error messages. Forced, a binary file has as many facets as its length tells, and a
/// text file may end within a solid.
///
/// # Errors
/// [`crate::Error::Input`] at the line (text) or byte (binary) at fault.
pub(super) fn read(bytes: &[u8], name: &str, force: bool) -> Result<Source> {
    // A binary file has a zero in the number of facets or in the first of them.
    if (is_text(bytes) || text::is_text(bytes)) && !has_told_length(bytes) {
        Text::new(bytes, name).read(force)
    } else {
        binary(bytes, name, force)
    }
}

/// Whether the content tells that this is an STL file.
pub(super) fn is_stl(bytes: &[u8]) -> bool {
    is_text(bytes) || has_told_length(bytes)
}

/// Whether the file begins with `solid`, or with a facet where that is missing, and goes on as text.
fn is_text(bytes: &[u8]) -> bool {
    let mut words = text_words(bytes, "");
    text::is_text(words.rest()) && begins(&mut words)
}

fn begins(words: &mut Words) -> bool {
    let first = words.word().unwrap_or_default();
    let normal = |words: &mut Words| words.word().is_some_and(|word| word.eq_ignore_ascii_case(b"normal"));
    first.eq_ignore_ascii_case(b"solid") || first.eq_ignore_ascii_case(b"facet") && normal(words)
}

/// The words behind comment lines, of which STL has none, and before the zeros that some programs fill a file up with.
fn text_words<'a>(bytes: &'a [u8], name: &'a str) -> Words<'a> {
    let zeros = bytes.iter().rev().take_while(|b| matches!(b, 0 | 0x1a)).count();
    let mut words = Words::new(&bytes[..bytes.len() - zeros], byte_order_mark(bytes), 0, name);
    loop {
        let mut ahead = words.clone();
        match ahead.word() {
            Some([b'#' | b';' | b'!', ..] | [b'/', b'/', ..]) => ahead.skip_line(),
            _ => return words,
        }
        words = ahead;
    }
}

/// Whether the file is as long as a binary one with the facets it tells of.
fn has_told_length(bytes: &[u8]) -> bool {
    told_facets(bytes).is_some_and(|told| bytes.len() as u64 == (HEADER + FACET as u64 * told))
}

/// What a binary file says of its number of facets.
fn told_facets(bytes: &[u8]) -> Option<u64> {
    Some(LittleEndian::read_u32(bytes.get(HEADER as usize - 4..HEADER as usize)?).into())
}

fn binary(bytes: &[u8], name: &str, force: bool) -> Result<Source> {
    let fault = |at: u64, what: String| InputError::new(name, Place::Byte(at), what);
    let Some(told) = told_facets(bytes) else {
        let what = "not an STL file: neither `solid` nor a binary header of 84 bytes";
        return Err(fault(0, what.to_owned()).into());
    };
    let facets = bytes[HEADER as usize..].chunks_exact(FACET);
    let there = facets.len() as u64;
    let counts = format!("the header tells of {told} facets, {there} are there by the file's length");
    if told > there && !force {
        let what = format!("{ENDS_EARLY}: {counts}");
        return Err(fault(HEADER + there * FACET as u64, what).into());
    }
    // Zeros behind the last facet fill the file up.
    let behind = &bytes[HEADER as usize..][(told.min(there) as usize * FACET)..];
    let more = told < there && behind.iter().any(|&b| b != 0);
    if more && !force {
        return Err(fault(HEADER - 4, counts).into());
    }
    // No more than there are.
    let told = if more { there } else { told.min(there) } as usize;
    let mut positions = Vec::with_capacity(3 * told);
    let (mut normals, mut attributes) = (false, 0usize);
    for (k, facet) in facets.take(told).enumerate() {
        let (numbers, attribute) = facet.split_at(FACET - 2);
        attributes += usize::from(attribute != [0; 2]);
        let mut numbers = numbers.chunks_exact(4).map(LittleEndian::read_f32);
        // Both zeros are none.
        normals |= numbers.by_ref().take(3).fold(false, |any, x| any | (x != 0.0));
        let mut corners = [[0.0f64; 3]; 3];
        for (x, number) in corners.as_flattened_mut().iter_mut().zip(numbers) {
            *x = number.into();
        }
        if let Some(n) = corners.as_flattened().iter().position(|x| !x.is_finite()) {
            let at = HEADER + (FACET * k + 12 + 4 * n) as u64;
            return Err(fault(at, not_finite(n % 3, n / 3, k, corners[n / 3][n % 3])).into());
        }
        positions.extend(corners);
    }
    let rest = bytes.len() - HEADER as usize - told * FACET;
    let named = |what: &[u8]| bytes[..HEADER as usize].windows(what.len()).any(|window| window == what);
    let dropped = [
        (normals, "facet normals".to_owned()),
        (attributes > 0, format!("facet attributes or colours ({attributes})")),
        (named(b"COLOR="), "colour of the whole".to_owned()),
        (named(b"MATERIAL="), "material of the whole".to_owned()),
        (rest > 0, format!("{rest} bytes after the last facet")),
    ];
    let triangles = (0..told as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    Ok(source(IndexedMesh::new(positions, triangles), 0, false, dropped))
}

/// A text file as it is read.
struct Text<'a> {
    words: Words<'a>,
    positions: Vec<[f64; 3]>,
    fans: Fans,
    facets: usize,
    open: Option<Solid>,
    /// Solids that had facets, and those of them that had a name.
    solids: usize,
    named: usize,
    /// Whether a facet normal was not zero.
    normals: bool,
}

impl<'a> Text<'a> {
    fn new(bytes: &'a [u8], name: &'a str) -> Self {
        let words = text_words(bytes, name);
        let (positions, fans) = (Vec::new(), Fans::default());
        Self { words, positions, fans, facets: 0, open: None, solids: 0, named: 0, normals: false }
    }

    fn read(mut self, force: bool) -> Result<Source> {
        let mut ahead = self.words.clone();
        if !begins(&mut ahead) {
            return Err(ahead.fault("not an STL file: text that does not begin with `solid`"));
        }
        while let Some(word) = self.word() {
            match self.is(word, &["facet", "endsolid", "solid"])? {
                0 => self.facet()?,
                1 => {
                    self.close();
                    self.words.skip_line();
                }
                _ => {
                    self.close();
                    let named = self.words.word_in_line().is_some();
                    self.open = Some(Solid { facets: self.facets, named });
                    self.words.skip_line();
                }
            }
        }
        if self.open.is_some() && !force {
            return Err(self.words.fault(format!("{ENDS_EARLY}: there is no `endsolid`")));
        }
        self.close();
        let dropped = [
            (self.normals, "facet normals".to_owned()),
            (self.solids > 1, format!("division into solids ({})", self.solids)),
            (self.named > 0, format!("names of solids ({})", self.named)),
        ];
        let Faces { mesh, polygons, notes } = self.fans.mesh(self.positions);
        let dropped = dropped.into_iter().chain(notes.into_iter().map(|note| (true, note)));
        Ok(source(mesh, polygons, true, dropped))
    }

    /// The present solid, if there is one, has ended.
    fn close(&mut self) {
        if let Some(solid) = self.open.take().filter(|solid| solid.facets < self.facets) {
            self.solids += 1;
            self.named += usize::from(solid.named);
        }
    }

    /// Reads a facet behind its first word.
    #[inline]
    fn facet(&mut self) -> Result<()> {
        self.one_of(&["normal"])?;
        for _ in 0..3 {
            let word = self.next()?;
            // Many a file has no number here.
            self.normals |= number(word).is_none_or(|x| x != 0.0);
        }
        self.one_of(&["outer"])?;
        self.one_of(&["loop"])?;
        let first = self.positions.len();
        while self.one_of(&["vertex", "endloop"])? == 0 {
            let mut position = [0.0; 3];
            for (axis, x) in position.iter_mut().enumerate() {
                *x = self.words.number()?;
                if !x.is_finite() {
                    let corner = self.positions.len() - first;
                    return Err(self.words.fault(not_finite(axis, corner, self.facets, *x)));
                }
            }
            // Beyond 32 bits it is beyond the limit of a mesh too.
            self.fans.corner(self.positions.len() as u32);
            self.positions.push(position);
        }
        self.fans.end();
        self.facets += 1;
        self.one_of(&["endfacet"]).map(drop)
    }

    /// Reads a word, which must be one of some keywords, and returns which.
    #[inline]
    fn one_of(&mut self, keywords: &[&str]) -> Result<usize> {
        let word = self.next()?;
        self.is(word, keywords)
    }

    #[inline]
    fn is(&self, word: &[u8], keywords: &[&str]) -> Result<usize> {
        let found = keywords.iter().position(|keyword| {
            // `endsolid1` is met with.
            let word = if *keyword == "endsolid" { &word[..word.len().min(8)] } else { word };
            word.eq_ignore_ascii_case(keyword.as_bytes())
        });
        found.ok_or_else(|| {
            let keywords = keywords.iter().map(|keyword| format!("`{keyword}`")).collect::<Vec<_>>();
            self.words.fault(format!("{} where {} should be", quoted(word), keywords.join(" or ")))
        })
    }

    #[inline]
    fn next(&mut self) -> Result<&'a [u8]> {
        self.word().ok_or_else(|| self.words.fault(ENDS_EARLY))
    }

    /// The next word; `end loop` is one.
    #[inline]
    fn word(&mut self) -> Option<&'a [u8]> {
        let word = self.words.word()?;
        if !word.eq_ignore_ascii_case(b"end") {
            return Some(word);
        }
        let mut ahead = self.words.clone();
        let what = ahead.word_in_line().unwrap_or_default();
        let Some((_, whole)) = ENDS.iter().find(|(second, _)| what.eq_ignore_ascii_case(second)) else {
            return Some(word);
        };
        self.words = ahead;
        Some(whole)
    }
}

/// A solid that began.
struct Solid {
    /// Facets before it.
    facets: usize,
    named: bool,
}

fn not_finite(axis: usize, corner: usize, facet: usize, x: f64) -> String {
    format!("{} of corner {} of facet {} is {x}", ["x", "y", "z"][axis], corner + 1, facet + 1)
}

fn source(
    mesh: IndexedMesh,
    polygons: usize,
    text: bool,
    dropped: impl IntoIterator<Item = (bool, String)>,
) -> Source {
    let coordinates = if text { Coordinates::Text } else { Coordinates::Float32 };
    let dropped = dropped.into_iter().filter_map(|(there, what)| there.then_some(what)).collect();
    Source { mesh, format: Format::Stl, polygons, coordinates, text, dropped }
}

/// Second words of two that are read as one.
const ENDS: [(&[u8], &[u8]); 3] = [(b"loop", b"endloop"), (b"facet", b"endfacet"), (b"solid", b"endsolid")];

/// Bytes before the first facet of a binary file: 80 of anything, then the number of facets.
const HEADER: u64 = 84;
/// Bytes of a facet: normal, three corners, two bytes of attributes.
const FACET: usize = 50;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Error;

    const FACET_TEXT: &str = " facet normal 0 0 1\n  outer loop\n   vertex 0 0 0\n   vertex 1 0 0\n   vertex 0 1 0.1\n  \
        endloop\n endfacet\n";

    fn fails(place: Place, what: &str, bytes: impl AsRef<[u8]>) {
        match read(bytes.as_ref(), "a.stl", false) {
            Err(Error::Input(e)) => assert_eq!(e, InputError::new("a.stl", place, what)),
            other => panic!("{other:?}"),
        }
    }

    /// A binary file of two facets in the planes z = 0 and z = 1.
    fn two_facets(header: &str) -> Vec<u8> {
        let mut bytes = header.as_bytes().to_vec();
        bytes.resize(80, b' ');
        bytes.extend(2u32.to_le_bytes());
        for z in [0.0f32, 1.0] {
            let numbers = [0.0, 0.0, 1.0, 0.0, 0.0, z, 2.5, 0.0, z, 0.0, -0.1, z];
            bytes.extend(numbers.iter().flat_map(|x| x.to_le_bytes()));
            bytes.extend([0, 0]);
        }
        bytes
    }

    #[test]
    fn text() {
        let file = format!("solid a b\n{FACET_TEXT}endsolid a b\n");
        let shouted = file.to_uppercase();
        let one_line = format!("solid a b\n{}endsolid", FACET_TEXT.replace('\n', " "));
        let marked = format!("\u{feff}{file}");
        for text in
            [file.clone(), marked, file.replace('\n', "\r\n"), file.replace('\n', "\r"), shouted, one_line]
        {
            assert!(is_stl(text.as_bytes()));
            let s = read(text.as_bytes(), "", false).unwrap();
            assert_eq!(s.mesh.positions, [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.1]]);
            assert_eq!(s.mesh.triangles, [[0, 1, 2]]);
            assert_eq!((s.format, s.coordinates, s.text), (Format::Stl, Coordinates::Text, true));
            assert_eq!(s.dropped, ["facet normals", "names of solids (1)"]);
        }
    }

    #[test]
    fn several_solids_and_odd_facets() {
        let quad = FACET_TEXT.replace("0 0 1\n", "-0 0 0.0\n").replace("  endloop", "vertex 0 0 7\nendloop");
        let empty = "facet normal nan nan nan outer loop endloop endfacet";
        let text = format!("\n solid\n{quad}endsolid1\nsolid\n{FACET_TEXT}{empty}\nendsolid facet\n");
        let s = read(text.as_bytes(), "", false).unwrap();
        assert_eq!(s.mesh.triangles, [[0, 1, 2], [0, 2, 3], [4, 5, 6]]);
        assert_eq!(s.polygons, 1);
        assert_eq!(
            s.dropped,
            ["facet normals", "division into solids (2)", "faces with fewer than 3 corners (1)"]
        );
        let s = read(format!("solid\n{quad}endsolid").as_bytes(), "", false).unwrap();
        assert_eq!(s.dropped, [""; 0], "a normal of zeros says nothing");
    }

    #[test]
    fn binary() {
        for header in ["", "solid", "solid \n facet normal"] {
            let file = two_facets(header);
            assert!(is_stl(&file));
            let s = read(&file, "", false).unwrap();
            let corners = |z| [[0.0, 0.0, z], [2.5, 0.0, z], [0.0, f64::from(-0.1f32), z]];
            assert_eq!(s.mesh.positions, [corners(0.0), corners(1.0)].concat());
            assert_eq!(s.mesh.triangles, [[0, 1, 2], [3, 4, 5]]);
            assert_eq!((s.format, s.coordinates, s.text), (Format::Stl, Coordinates::Float32, false));
            assert_eq!(s.dropped, ["facet normals"]);
        }
        let mut file = two_facets("COLOR=abcd,MATERIAL=abcdefghijkl");
        file[84 + 8..84 + 12].copy_from_slice(&(-0.0f32).to_le_bytes());
        file[84 + 50 + 8..84 + 50 + 12].copy_from_slice(&0.0f32.to_le_bytes());
        file[84 + 49] = 0x80;
        file.extend([1; 3]);
        assert_eq!(
            read(&file, "", false).unwrap().dropped,
            [
                "facet attributes or colours (1)",
                "colour of the whole",
                "material of the whole",
                "3 bytes after the last facet",
            ]
        );
    }

    /// Text as other readers take it: all of it is the triangle that the plain text is.
    #[test]
    fn text_as_others_write_it() {
        let solid = format!("solid a\n{FACET_TEXT}endsolid a\n");
        for text in [
            solid
                .replace("endloop", "end loop")
                .replace("endfacet", "END  Facet")
                .replace("endsolid", "end solid"),
            format!("solid a\n{solid}endsolid a\n"),
            FACET_TEXT.to_owned(),
            format!("{FACET_TEXT}endsolid a\n"),
            format!("{solid}\0\0\0\0"),
            format!("{solid}\x1a"),
            format!("# made by hand\n; twice\n\n// and again\n{solid}"),
            // As a file whose `solid` line is lost, but not the one before it.
            format!("solid\nsolid\nendsolid\n{FACET_TEXT}"),
        ] {
            assert!(is_stl(text.as_bytes()) || text.starts_with('#'), "{text}");
            let s = read(text.as_bytes(), "", false).unwrap();
            assert_eq!(s.mesh.positions, [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.1]], "{text}");
            assert_eq!(s.mesh.triangles, [[0, 1, 2]], "{text}");
        }
        // A solid that began and does not end may have been cut off.
        let cut = format!("solid a\n{FACET_TEXT}");
        fails(Place::Line(9), "the file ends early: there is no `endsolid`", &cut);
        let s = read(cut.as_bytes(), "", true).unwrap();
        assert_eq!(
            (s.mesh.triangles.len(), &s.dropped[..]),
            (1, &["facet normals".to_owned(), "names of solids (1)".to_owned()][..])
        );
    }

    #[test]
    fn a_count_that_disagrees_with_the_length() {
        let with_count = |count: u32, behind: &[u8]| {
            let mut file = two_facets("");
            file[80..84].copy_from_slice(&count.to_le_bytes());
            [&file, behind].concat()
        };
        for count in [0, 1] {
            for behind in [&[][..], &[7; 49]] {
                let file = with_count(count, behind);
                let counts = format!("the header tells of {count} facets, 2 are there by the file's length");
                fails(Place::Byte(80), &counts, &file);
                let s = read(&file, "", true).unwrap();
                assert_eq!(s.mesh.triangles, [[0, 1, 2], [3, 4, 5]]);
                let rest = format!("{} bytes after the last facet", behind.len());
                assert_eq!(s.dropped.contains(&rest), !behind.is_empty());
            }
        }
        // More than are there: the file ends early, where the last whole facet does.
        let file = with_count(3, &[7; 20]);
        let counts = "the header tells of 3 facets, 2 are there by the file's length";
        fails(Place::Byte(184), &format!("the file ends early: {counts}"), &file);
        assert_eq!(read(&file, "", true).unwrap().mesh.triangles.len(), 2);
        // A file that is filled up with zeros has no more facets for it.
        let s = read(&with_count(2, &[0; 300]), "", false).unwrap();
        assert_eq!((s.mesh.triangles.len(), &s.dropped[1][..]), (2, "300 bytes after the last facet"));
    }

    #[test]
    fn faults_in_text_are_placed() {
        let in_solid = |facet: String| format!("solid\n{facet}endsolid\n");
        let with = |from: &str, to: &str| in_solid(FACET_TEXT.replace(from, to));
        let keywords = "where `facet` or `endsolid` or `solid` should be";
        fails(Place::Line(2), &format!("\"facets\" {keywords}"), with("facet ", "facets "));
        fails(Place::Line(3), "\"inner\" where `outer` should be", with("outer", "inner"));
        fails(Place::Line(2), "\"n\" where `normal` should be", with("normal", "n"));
        fails(Place::Line(5), "y of corner 2 of facet 1 is NaN", with("1 0 0\n ", "1 nan 0\n "));
        fails(Place::Line(6), "z of corner 3 of facet 1 is inf", with("0.1", "1e999"));
        fails(Place::Line(6), "\"0,1\" is not a number", with("0.1", "0,1"));
        fails(Place::Line(7), "\"endloop\" is not a number", with(" 0.1", ""));
        fails(Place::Line(10), &format!("\"x\" {keywords}"), in_solid(FACET_TEXT.into()) + "x");
        let none = "not an STL file: text that does not begin with `solid`";
        fails(Place::Line(2), none, "\nsolids\n");
        fails(Place::Line(1), none, "facet x");
        fails(Place::Line(1), none, "");
        fails(Place::Line(3), none, format!("; a comment\n# and another\nx {}", FACET_TEXT.repeat(10)));
        let whole = in_solid(FACET_TEXT.into());
        for length in 5..whole.len() - "endsolid\n".len() {
            let line = 1 + whole[..length].matches('\n').count() as u64;
            match read(&whole.as_bytes()[..length], "a", false) {
                Err(Error::Input(e)) => assert_eq!(e.place, Place::Line(line), "{length} {e}"),
                other => panic!("{length} {other:?}"),
            }
        }
    }

    #[test]
    fn faults_in_binary_are_placed() {
        let not = "not an STL file: neither `solid` nor a binary header of 84 bytes";
        fails(Place::Byte(0), not, &two_facets("")[..83]);
        let early = "the file ends early: the header tells of 2 facets, 1 are there by the file's length";
        for length in 134..184 {
            fails(Place::Byte(134), early, &two_facets("solid")[..length]);
        }
        let mut file = two_facets("");
        file[134 + 12 + 16..][..4].copy_from_slice(&f32::NEG_INFINITY.to_le_bytes());
        fails(Place::Byte(162), "y of corner 2 of facet 2 is -inf", &file);
        file[80..84].copy_from_slice(&u32::MAX.to_le_bytes());
        let counts = "the header tells of 4294967295 facets, 2 are there by the file's length";
        let early = &format!("the file ends early: {counts}");
        fails(Place::Byte(184), early, &file);
        // A normal that is no number is dropped as any other.
        let mut file = two_facets("");
        file[84..88].copy_from_slice(&f32::NAN.to_le_bytes());
        assert_eq!(read(&file, "", false).unwrap().mesh.triangles.len(), 2);
    }
}
