//! Reads Wavefront OBJ: vertices and polygons, with texture coordinates, normals, colours, parts and smoothing groups; the rest
//! is named, not kept.
//!
//! - A statement is a line; `\` before a line end continues it; `#` begins a comment. Indices count from 1, negative
//!   ones back from the vertex read last. A positive index may name a vertex that comes later.
//! - Numbers of `vt`, `vn` and colours are binary32 where that tells all their decimals, else binary64. They need not be finite.
//!   A third texture coordinate is kept where one is not 0.
//! - Three or four numbers behind the coordinates of a vertex are its colour.
//! - The triangles that the same object, group and material name are a part. Its name is the statements that tell
//!   them, each a line: `o Cube`, `g left`, `usemtl red`. An object has groups of its own.

use crate::error::{Error, InputError, Place, Result};
use crate::mesh::attributes::{Attribute, NO_VALUE, Semantic};

use super::decimals::Colours;
use super::fan::{self, Fans};
use super::gather::{self, Gathered};
use super::obj_dropped::Dropped;
use super::obj_parts::Parts;
use super::obj_values::{Coordinates, List, References};
use super::text::{byte_order_mark, integer, line_end, number, quoted};
use super::{Format, Source};

/// Reads an OBJ file. `name` is for error messages. Forced, corners may name texture coordinates and normals that are not there:
/// they have none.
///
/// # Errors
/// [`Error::Input`] at the line at fault.
pub(super) fn read(bytes: &[u8], name: &str, force: bool) -> Result<Source> {
    let mut statements = Statements { bytes, next: byte_order_mark(bytes), line: 1, name };
    let mut vertices = Vertices::default();
    let [mut uvs, mut normals] = [Coordinates::new(&UV), Coordinates::new(&NORMAL)];
    let mut faces = Faces::new();
    let mut parts = Parts::default();
    let mut dropped = Dropped::default();
    loop {
        match statements.word() {
            None => {}
            Some(b"v") => vertices.read(&mut statements, &mut dropped)?,
            Some(b"vt") => uvs.read(&mut statements)?,
            Some(b"vn") => normals.read(&mut statements)?,
            Some(b"f" | b"fo") => {
                parts.face(faces.fans.faces());
                faces.read(&mut statements, [vertices.positions.len(), uvs.count(), normals.count()])?;
            }
            Some(keyword) if parts.take(keyword, || statements.words(), faces.fans.faces()) => {}
            Some(keyword) => dropped.note(keyword, &statements),
        }
        if !statements.advance() {
            break;
        }
    }
    let Vertices { positions, colours, of_vertex } = vertices;
    if let (true, Some((line, keyword))) = (positions.is_empty(), dropped.first_unknown) {
        let what = format!("not an OBJ file: {} is no statement", quoted(keyword));
        return Err(InputError::new(name, Place::Line(line), what).into());
    }
    let Faces { fans, ahead, references } = faces;
    if let Some(&(index, line)) = ahead.iter().find(|(index, _)| *index > positions.len() as u64) {
        let what = format!("vertex index {index} is out of range: the file has {} vertices", positions.len());
        return Err(InputError::new(name, Place::Line(line), what).into());
    }
    let fan::Faces { mesh, polygons, notes, origins } = fans.mesh(positions);
    let mut gathered = Gathered::default();
    for (references, coordinates) in references.into_iter().zip([uvs, normals]) {
        let (list, there) = (coordinates.list, coordinates.count());
        let corners = references.finish(there, name, force, &mut gathered.dropped)?;
        let (semantic, (components, values)) = (list.semantic, coordinates.finish(&mut gathered.dropped));
        if there > 0 {
            gathered.take(
                Attribute::new(semantic, components, values, origins.of_corners(&corners)),
                list.plural,
            );
        }
    }
    if !of_vertex.is_empty() {
        let (components, values, normalised) = colours.finish();
        let of_vertices =
            gather::of_vertices(Semantic::Color, components, values, Some(&of_vertex), &mesh.triangles);
        gathered.take(Attribute { normalised, ..of_vertices }, "vertex colours");
    }
    let (part_names, libraries) = parts.finish(&origins, &mut gathered);
    let mut mesh = gathered.mesh(mesh);
    (mesh.part_names, mesh.libraries) = (part_names, libraries);
    let dropped = dropped.in_words().into_iter().chain(gathered.dropped).chain(notes).collect();
    let (format, coordinates) = (Format::Obj, super::Coordinates::Text);
    Ok(Source { polygons, text: true, dropped, ..Source::new(mesh, format, coordinates) })
}

/// The file as statements of words.
pub(super) struct Statements<'a> {
    bytes: &'a [u8],
    next: usize,
    /// The 1-based line of `next`, which is also that of the word read last.
    pub line: u64,
    name: &'a str,
}

impl<'a> Statements<'a> {
    /// The next word of the present statement; `None` at its end.
    #[inline]
    pub(super) fn word(&mut self) -> Option<&'a [u8]> {
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
    pub(super) fn words(&mut self) -> &'a [u8] {
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
    pub(super) fn fault(&self, what: impl Into<String>) -> Error {
        InputError::new(self.name, Place::Line(self.line), what).into()
    }
}

/// The vertices read so far.
#[derive(Default)]
struct Vertices {
    positions: Vec<[f64; 3]>,
    colours: Colours,
    /// The colour of each vertex, as far as any has one.
    of_vertex: Vec<u32>,
}

impl Vertices {
    /// Reads the rest of a `v` statement.
    fn read(&mut self, statements: &mut Statements, dropped: &mut Dropped) -> Result<()> {
        let mut position = [0.0; 3];
        let before = self.positions.len();
        for (axis, x) in ["x", "y", "z"].into_iter().zip(&mut position) {
            let vertex = before + 1;
            let word = statements
                .word()
                .ok_or_else(|| statements.fault(format!("vertex {vertex} has no {axis}")))?;
            *x = number(word).ok_or_else(|| statements.fault(format!("{} is not a number", quoted(word))))?;
            if !x.is_finite() {
                return Err(statements.fault(format!("{axis} of vertex {vertex} is {x}")));
            }
        }
        self.positions.push(position);
        let Some(first) = statements.word() else { return Ok(()) };
        let mut extra = [first, &[], &[], &[]];
        let mut count = 1;
        while let Some(word) = statements.word() {
            if let Some(place) = extra.get_mut(count) {
                *place = word;
            }
            count += 1;
        }
        match extra.get(..count).and_then(|words| self.colours.push(words)) {
            Some(colour) => {
                self.of_vertex.resize(before, NO_VALUE);
                self.of_vertex.push(colour);
            }
            None if count == 1 => dropped.weights = true,
            None => dropped.columns = true,
        }
        Ok(())
    }
}

/// The faces read so far.
struct Faces {
    fans: Fans,
    /// References to vertices that had not come yet: index (from 1) and line, only where the index is a new maximum. The
    /// first reference past the last vertex is among them.
    ahead: Vec<(u64, u64)>,
    /// What corners name of texture coordinates and normals.
    references: [References; 2],
}

impl Faces {
    fn new() -> Self {
        let references = [References::new(&UV), References::new(&NORMAL)];
        Self { fans: Fans::default(), ahead: Vec::new(), references }
    }

    /// Reads the rest of an `f` statement; so many vertices, texture coordinates and normals came before it.
    #[inline]
    fn read(&mut self, statements: &mut Statements, before: [usize; 3]) -> Result<()> {
        let [before, behind @ ..] = before;
        while let Some(word) = statements.word() {
            // v, v/vt, v//vn, v/vt/vn
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
            if digits < word.len() {
                let corner = self.fans.corners();
                let fields = word[digits + 1..].split(|&b| b == b'/');
                for ((field, references), before) in fields.zip(&mut self.references).zip(behind) {
                    references.read(field, corner, before, statements.line);
                }
            }
            // An index beyond 32 bits is beyond the last vertex too, or beyond the limit of a mesh.
            self.fans.corner(position as u32);
        }
        self.fans.end();
        Ok(())
    }
}

const UV: List = List {
    semantic: Semantic::TexCoord,
    name: "texture coordinate",
    plural: "texture coordinates",
    axes: &["u", "v", "w"],
    needed: 1,
};
const NORMAL: List =
    List { semantic: Semantic::Normal, name: "normal", plural: "normals", axes: &["x", "y", "z"], needed: 3 };

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::attributes::{Domain, Stored, Values};

    fn source(text: &str) -> Source {
        read(text.as_bytes(), "", false).unwrap()
    }

    fn fails(place: u64, what: &str, text: &str) {
        let expected = InputError::new("a.obj", Place::Line(place), what);
        match read(text.as_bytes(), "a.obj", false) {
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
        assert_eq!((s.polygons, s.coordinates, s.dropped.len()), (0, crate::formats::Coordinates::Text, 0));
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
        // Where there is nothing to name.
        let s = source(&format!("{THREE}f 1/7 2/-1/5 3/x/\n"));
        let missing = [
            "references to texture coordinates that are not there (3)",
            "references to normals that are not there (1)",
        ];
        assert_eq!((s.mesh.attributes.len(), &s.dropped[..]), (0, &missing.map(String::from)[..]));
    }

    const UVS: &str = "vt .5 0\nvt 1 .25 0\nvt -1\nvn 0 0 1\nvn 0.6 0 0.8\n";

    #[test]
    fn corners_have_texture_coordinates_and_normals() {
        // A square and a triangle; the square's third corner has no texture coordinates, the triangle no normals.
        let s = source(&format!("{THREE}v 1 1 0\n{UVS}f 1/1/1 2/2/1 4//-1 3/-1/2\nf 1/3 2/1 3/2\n"));
        let [uv, normal] = &s.mesh.attributes[..] else { panic!("{s:?}") };
        assert_eq!(s.mesh.triangles, [[0, 1, 3], [0, 3, 2], [0, 1, 2]]);
        assert_eq!((uv.semantic, uv.components, uv.domain), (Semantic::TexCoord, 2, Domain::Corner));
        assert_eq!(uv.values, Values::F32(vec![0.5, 0.0, 1.0, 0.25, -1.0, 0.0]));
        assert_eq!(uv.corners, [0, 1, NO_VALUE, 0, NO_VALUE, 2, 2, 0, 1]);
        assert_eq!((normal.semantic, normal.components), (Semantic::Normal, 3));
        assert_eq!(normal.values, Values::F32(vec![0.0, 0.0, 1.0, 0.6, 0.0, 0.8]));
        assert_eq!(normal.corners, [0, 0, 1, 0, 1, 1, NO_VALUE, NO_VALUE, NO_VALUE]);
        assert_eq!(s.dropped, [""; 0]);
        // An index may look ahead; a third coordinate counts where it is not 0.
        let s = source(&format!("f 1/1 2/4 3/2\n{THREE}{UVS}vt 1 2 3 4\n"));
        let [uv] = &s.mesh.attributes[..] else { panic!("{s:?}") };
        assert_eq!(uv.values, Values::F32(vec![0.5, 0.0, 0.0, 1.0, 0.25, 0.0, 1.0, 2.0, 3.0]));
        assert_eq!((uv.components, &uv.corners[..]), (3, &[0, 2, 1][..]));
        let told = [
            "further numbers of texture coordinates (1)",
            "texture coordinates of no triangle (1)",
            "normals of no triangle (2)",
        ];
        assert_eq!(s.dropped, told);
    }

    #[test]
    fn ears_carry_their_corners() {
        // An arrow head, which no fan from its first corner covers, of which corner k has texture coordinates k.
        let head = "v 0 0 0\nv 1 1 0\nv 4 0 0\nv 1 3 0\nvt 0\nvt 1\nvt 2\nvt 3\nf 1/1 2/2 3/3 4/4\n";
        let s = source(head);
        let corners: Vec<u32> = s.mesh.triangles.iter().flatten().copied().collect();
        assert!(s.mesh.triangles.iter().all(|t| t.contains(&1) && t.contains(&3)), "{:?}", s.mesh.triangles);
        assert_eq!(s.mesh.attributes[0].corners, corners);
    }

    #[test]
    fn colours_behind_the_coordinates() {
        let s = source("v 0 0 0 1 0 .5\nv 1 0 0\nv 0 1 0 .25 0 0\nf 3 2 1\n");
        let [color] = &s.mesh.attributes[..] else { panic!("{s:?}") };
        assert_eq!((color.semantic, color.components, color.normalised), (Semantic::Color, 3, false));
        assert_eq!(color.values, Values::F32(vec![1.0, 0.0, 0.5, 0.25, 0.0, 0.0]));
        assert_eq!((&color.corners[..], s.dropped.len()), (&[1, NO_VALUE, 0][..], 0));
        let s = source("v 0 0 0 255 0 7\nv 1 0 0 0 0 0 3\nv 0 1 0 1 1 1\nf 1 2 3\n");
        let [color] = &s.mesh.attributes[..] else { panic!("{s:?}") };
        assert_eq!((color.components, color.normalised), (4, true));
        assert_eq!(color.values, Values::U8(vec![255, 0, 7, 255, 0, 0, 0, 3, 1, 1, 1, 255]));
    }

    #[test]
    fn parts_are_told_by_objects_groups_and_materials() {
        let text = format!(
            "mtllib a b.mtl\n{THREE}f 1 2 3\nusemtl red\nusemtl blue\ng x  y\ns 2\nf 1 2 3 1\no b\ns off\nf 1 2 3\n\
             g\nusemtl red\nf 1 2\nf 1 2 3\no\ng x  y\nusemtl \\\n blue\ns 1\nf 3 2 1\nmtllib a b.mtl\nmtllib c.mtl\n"
        );
        let s = source(&text);
        assert_eq!(s.mesh.part_names, ["", "g x  y\nusemtl blue", "o b\nusemtl blue", "o b\nusemtl red"]);
        assert_eq!(s.mesh.libraries, ["a b.mtl", "c.mtl"]);
        let [part, smooth] = &s.mesh.attributes[..] else { panic!("{s:?}") };
        let numbers = |a: &Attribute| -> Vec<f64> {
            assert_eq!(a.check(s.mesh.triangles.len()), Ok(()));
            a.corners.iter().map(|&value| a.values.number(value as usize)).collect()
        };
        assert_eq!(
            (part.semantic, part.domain, part.values.stored()),
            (Semantic::Part, Domain::Triangle, Stored::U32)
        );
        assert_eq!(numbers(part), [0.0, 1.0, 1.0, 2.0, 3.0, 1.0]);
        assert_eq!((smooth.semantic, &smooth.name[..]), (Semantic::Generic, "smoothing group"));
        assert_eq!(numbers(smooth), [0.0, 2.0, 2.0, 0.0, 0.0, 1.0]);
        // What says nothing is nothing.
        let s = source(&format!("{THREE}g\ns off\nusemtl\nf 1 2 3\n"));
        assert_eq!((s.mesh.attributes.len(), s.mesh.part_names.len()), (0, 0));
        assert_eq!(source(&format!("{THREE}g g\nf 1 2 3\n")).mesh.part_names, ["g g"]);
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
        let text = "v 0 0 0 1\nv 1 0 0 1 1 x\nv 0 1 0 1 2\nl 1 2\np 1\nf 1 2 3\ncurv 0 1 1 2\nlod 1\nfrob\n";
        assert_eq!(
            source(text).dropped,
            [
                "vertex weights",
                "further numbers of vertices",
                "line elements (1)",
                "point elements (1)",
                "free-form geometry",
                "display settings",
                "unknown statements (1)",
            ]
        );
        let latin = [THREE.as_bytes(), b"g caf\xe9\nf 1 2 3\n"].concat();
        let s = read(&latin, "", false).unwrap();
        assert_eq!(
            (&s.mesh.part_names[0][..], &s.dropped[0][..]),
            ("g caf\u{fffd}", "letters of names that are not UTF-8 (1)")
        );
    }

    #[test]
    fn corners_that_name_what_is_not_there() {
        let range = "is out of range";
        for (face, what, attributes) in [
            (
                "1/1 2/2 3/4",
                format!("texture coordinate index 4 {range}: the file has 3 texture coordinates"),
                1,
            ),
            ("1//1 2//2 3//-3", format!("normal index -3 {range}: 2 normals come before it"), 1),
            ("1/1 2/0 3/-9", "texture coordinate index 0: indices count from 1".into(), 1),
            ("1/1/1 2/2/x 3/3/3", "\"x\" is not the index of a normal".into(), 2),
            (
                "1/4294967295 2 3",
                format!("texture coordinate index 4294967295 {range}: the file has 3 texture coordinates"),
                0,
            ),
            (
                "1/4294967296 2 3",
                format!("texture coordinate index 4294967296 {range}: the file has 3 texture coordinates"),
                0,
            ),
        ] {
            let text = format!("{THREE}{UVS}f {face}\n");
            fails(9, &what, &text);
            let forced = read(text.as_bytes(), "", true).unwrap();
            assert_eq!(forced.mesh.attributes.len(), attributes, "{face}");
            assert!(forced.dropped.iter().any(|note| note.contains("not there")), "{:?}", forced.dropped);
        }
        fails(2, "texture coordinate 2 has no u", "vt 1\nvt\n");
        fails(1, "normal 1 has no z", "vn 1 2\n");
        fails(1, "\"x\" is not a number", "vn 1 2 x\n");
        // Values need not be finite.
        let s = source(&format!("{THREE}vn nan inf -nan(ind)\nf 1//1 2//1 3//1\n"));
        let Values::F32(list) = &s.mesh.attributes[0].values else { panic!() };
        assert!(list[0].is_nan() && list[1] == f32::INFINITY && list[2].is_nan());
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
