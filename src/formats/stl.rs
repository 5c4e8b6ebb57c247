//! Reads STL (3D Systems, 1989), text and binary: facets of three corners each, no shared vertices.
//!
//! - A file is binary where its length is the one that its count of facets asks for, also if it begins with `solid`, as
//!   many do; or where it does not go on as text.
//! - A binary file of more or fewer facets than it tells of is refused, unless forced: then its length counts.
//! - Keywords of text may be in any case, and `end` may be a word of its own; what follows `solid` and `endsolid` in their
//!   line is a name. A file may hold several solids. Lines `solid` and `endsolid` may be doubled, and `solid` missing, as in
//!   files that other readers take; but a solid that began and does not end is a file that was cut off. Comment lines
//!   may come first, zeros last.
//! - Solids of text are parts, which have their names. The two bytes at the end of a facet are its colour (see `stl_colours`), or
//!   a number of its own. Normals of facets are not kept, since they follow from the corners; where they do not, it is said.
//! - Every corner becomes a vertex of its own, as stored; conditioning welds them.

use byteorder::{ByteOrder, LittleEndian};

use crate::error::{InputError, Place, Result};
use crate::mesh::IndexedMesh;

use super::gather::Gathered;
use super::stl_colours::FacetWords;
use super::text::{self, ENDS_EARLY, Words, byte_order_mark};
use super::write::unit_normal;
use super::{Coordinates, Format, Source, stl_text};

/// Reads an STL file. `name` is for error messages. Forced, a binary file has as many facets as its length tells, and a
/// text file may end within a solid.
///
/// # Errors
/// [`crate::Error::Input`] at the line (text) or byte (binary) at fault.
pub(super) fn read(bytes: &[u8], name: &str, force: bool) -> Result<Source> {
    // A binary file has a zero in the number of facets or in the first of them.
    if (is_text(bytes) || text::is_text(bytes)) && !has_told_length(bytes) {
        stl_text::Text::new(bytes, name).read(force)
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

pub(super) fn begins(words: &mut Words) -> bool {
    let first = words.word().unwrap_or_default();
    let normal = |words: &mut Words| words.word().is_some_and(|word| word.eq_ignore_ascii_case(b"normal"));
    first.eq_ignore_ascii_case(b"solid") || first.eq_ignore_ascii_case(b"facet") && normal(words)
}

/// The words behind comment lines, of which STL has none, and before the zeros that some programs fill a file up with.
pub(super) fn text_words<'a>(bytes: &'a [u8], name: &'a str) -> Words<'a> {
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
    let mut normals = Normals::default();
    let mut words = FacetWords::new(&bytes[..HEADER as usize - 4]);
    for (k, facet) in facets.take(told).enumerate() {
        let (numbers, attribute) = facet.split_at(FACET - 2);
        words.push(LittleEndian::read_u16(attribute));
        let mut numbers = numbers.chunks_exact(4).map(LittleEndian::read_f32);
        let mut normal = [0.0; 3];
        for (x, number) in normal.iter_mut().zip(numbers.by_ref()) {
            *x = number.into();
        }
        let mut corners = [[0.0f64; 3]; 3];
        for (x, number) in corners.as_flattened_mut().iter_mut().zip(numbers) {
            *x = number.into();
        }
        if let Some(n) = corners.as_flattened().iter().position(|x| !x.is_finite()) {
            let at = HEADER + (FACET * k + 12 + 4 * n) as u64;
            return Err(fault(at, not_finite(n % 3, n / 3, k, corners[n / 3][n % 3])).into());
        }
        normals.look_at(normal, corners);
        positions.extend(corners);
    }
    let rest = bytes.len() - HEADER as usize - told * FACET;
    let mut gathered = Gathered::default();
    words.finish(&mut gathered);
    gathered.dropped.extend(normals.in_words());
    if rest > 0 {
        gathered.dropped.push(format!("{rest} bytes after the last facet"));
    }
    let triangles = (0..told as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    let mesh = gathered.mesh(IndexedMesh::new(positions, triangles));
    Ok(source(mesh, 0, false, gathered.dropped))
}

pub(super) fn not_finite(axis: usize, corner: usize, facet: usize, x: f64) -> String {
    format!("{} of corner {} of facet {} is {x}", ["x", "y", "z"][axis], corner + 1, facet + 1)
}

pub(super) fn source(mesh: IndexedMesh, polygons: usize, text: bool, dropped: Vec<String>) -> Source {
    let coordinates = if text { Coordinates::Text } else { Coordinates::Float32 };
    Source { polygons, text, dropped, ..Source::new(mesh, Format::Stl, coordinates) }
}

/// Normals of facets, which follow from the corners: they are worth a word only where they do not.
#[derive(Default)]
pub(super) struct Normals {
    /// Those that are a degree or more away from the triangle's.
    others: usize,
}

impl Normals {
    /// The normal that the file has of a triangle; zeros, and what is not finite, are none.
    pub(super) fn look_at(&mut self, normal: [f64; 3], corners: [[f64; 3]; 3]) {
        let length = normal.iter().map(|x| x * x).sum::<f64>().sqrt();
        let own = unit_normal(corners);
        let along: f64 = (0..3).map(|k| normal[k] * own[k]).sum();
        let told = length > 0.0 && length.is_finite() && own != [0.0; 3];
        self.others += usize::from(told && along < NEAR * length);
    }

    pub(super) fn in_words(&self) -> Option<String> {
        (self.others > 0).then(|| format!("facet normals other than the triangles' ({})", self.others))
    }
}

/// The cosine of a degree.
const NEAR: f64 = 0.999_847_695;

/// Bytes before the first facet of a binary file: 80 of anything, then the number of facets.
const HEADER: u64 = 84;
/// Bytes of a facet: normal, three corners, two bytes of attributes.
const FACET: usize = 50;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Error;
    use crate::mesh::attributes::{Attribute, NO_VALUE, Values};

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
            assert_eq!(s.mesh.part_names[0].to_lowercase(), "o a b");
            assert_eq!(s.mesh.attributes, [Attribute::parts(&[0])]);
            // The triangle leans 5.7 degrees.
            assert_eq!(s.dropped, ["facet normals other than the triangles' (1)"]);
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
        assert_eq!(s.mesh.attributes, [Attribute::parts(&[0, 0, 1])]);
        assert_eq!(s.mesh.part_names, ["", ""]);
        assert_eq!(
            s.dropped,
            ["facet normals other than the triangles' (1)", "faces with fewer than 3 corners (1)"]
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
            assert_eq!(s.dropped, ["facet normals other than the triangles' (2)"]);
        }
        let mut file = two_facets("COLOR=abcd,MATERIAL=abcdefghijkl");
        file[84 + 8..84 + 12].copy_from_slice(&(-0.0f32).to_le_bytes());
        file[84 + 50 + 8..84 + 50 + 12].copy_from_slice(&0.0f32.to_le_bytes());
        file[84 + 49] = 0x80;
        file.extend([1; 3]);
        let s = read(&file, "", false).unwrap();
        assert_eq!(
            s.dropped,
            ["colour of the whole", "material of the whole", "3 bytes after the last facet"]
        );
        let [color] = &s.mesh.attributes[..] else { panic!("{s:?}") };
        assert_eq!((&color.values, &color.corners[..]), (&Values::U8(vec![0; 3]), &[NO_VALUE, 0][..]));
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
            (1, &["facet normals other than the triangles' (1)".to_owned()][..])
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
    }

    #[test]
    fn normals_are_told_where_they_are_others() {
        let told = |normal: [f64; 3], corners| {
            let mut normals = Normals::default();
            normals.look_at(normal, corners);
            normals.in_words().is_some()
        };
        let flat = [[0.0; 3], [1e-200, 0.0, 0.0], [0.0, 1e-200, 0.0]];
        let leaning =
            |degrees: f64| [degrees.to_radians().sin(), 0.0, degrees.to_radians().cos()].map(|x| 3.0 * x);
        assert_eq!(
            [0.0, 0.9, 1.1, 180.0].map(|degrees| told(leaning(degrees), flat)),
            [false, false, true, true]
        );
        // None, and none to differ from.
        let none = [[0.0; 3], [f64::NAN, 0.0, 0.0], [f64::INFINITY, 0.0, 0.0]];
        assert_eq!(none.map(|normal| told(normal, flat)), [false; 3]);
        assert!(!told(leaning(90.0), [[1.0; 3]; 3]));
    }
}
