//! Reads PLY: the Polygon File Format (G. Turk 1994) with the conventions that grew around it.
//!
//! - Elements may come in any order; rows of text are words, wherever their lines end.
//! - A coordinate in text is read to the nearest number of the type that the header declares.
//! - `vertex` has x, y and z of any type. `face` has a list `vertex_indices` or `vertex_index`.
//! - Other columns of `vertex` and `face` are attributes (see `ply_columns`); `texcoord` of a face is a list of the texture coordinates of its
//!   corners, or is empty. Numbers of attributes need not be finite. Comments `TextureFile` name libraries.
//! - `tristrips` has a list of the same names; -1 begins a new strip. Every second triangle of a strip is
//!   turned round. A strip triangle that names a vertex twice is a device to go round corners, so it is skipped; but
//!   it counts for the turning.

use byteorder::{BigEndian, LittleEndian};

use crate::error::{Error, InputError, Place, Result};
use crate::mesh::IndexedMesh;

use super::fan::{Faces, Fans};
use super::gather::Gathered;
use super::ply_columns::Columns;
use super::ply_faces::{read_faces, read_strips, skip};
use super::ply_header::{Element, Encoding, Header, Kind, Property, Scalar};
use super::ply_values::{Binary, Text, Values};
use super::{Coordinates, Format, Source, within};

/// Reads a PLY file. `name` is for error messages.
///
/// # Errors
/// [`Error::Input`] at the line (header, text) or byte (binary) at fault.
pub(super) fn read(bytes: &[u8], name: &str) -> Result<Source> {
    let header = Header::parse(bytes, name)?;
    let mut vertices = header.elements.iter().filter(|e| e.name == "vertex");
    let vertex = vertices.next();
    if let Some(second) = vertices.next() {
        return Err(header_fault(name, second, "a second element `vertex`"));
    }
    let no_indices = |e: &&Element| e.name == "face" && e.count > 0 && index_list(e).is_none();
    if let Some(face) = header.elements.iter().find(no_indices) {
        return Err(header_fault(
            name,
            face,
            "element `face` has no list `vertex_indices` or `vertex_index`",
        ));
    }
    let axes = vertex.map(|v| axes(v).map_err(|what| header_fault(name, v, &what))).transpose()?;
    let layout = Layout { axes, vertices: vertex.map_or(0, |v| v.count) };
    match header.encoding {
        Encoding::Ascii => {
            read_elements(&header, &layout, Text::new(bytes, header.length, header.lines, name))
        }
        Encoding::LittleEndian => {
            read_elements(&header, &layout, Binary::<LittleEndian>::new(bytes, header.length, name))
        }
        Encoding::BigEndian => {
            read_elements(&header, &layout, Binary::<BigEndian>::new(bytes, header.length, name))
        }
    }
}

/// What the reading of one element must know of the others.
struct Layout {
    /// The columns of `vertex` that hold x, y, z, with their types.
    axes: Option<[(usize, Scalar); 3]>,
    /// Number of vertices, as claimed.
    vertices: u64,
}

fn read_elements(header: &Header, layout: &Layout, mut values: impl Values) -> Result<Source> {
    let mut positions = Vec::new();
    let mut fans = Fans::default();
    let mut dropped = Vec::new();
    let (mut of_vertices, mut of_faces) = (None, None);
    for element in header.elements.iter().filter(|e| e.count > 0) {
        let read = match (element.name.as_str(), layout.axes, index_list(element)) {
            ("vertex", Some(axes), _) => {
                let columns = Columns::new(element, &axes.map(|(column, _)| column), &mut dropped);
                read_vertices(&mut values, element, axes, columns, &mut positions)
                    .map(|columns| of_vertices = Some(columns))
            }
            ("face", _, Some(column)) => {
                let read = read_faces(&mut values, element, column, layout.vertices, &mut fans, &mut dropped);
                read.map(|attributes| match &of_faces {
                    None => of_faces = Some(attributes),
                    // One element of faces is what all files have.
                    Some(_) if attributes.is_empty() => {}
                    Some(_) => dropped.push("attributes of a further element face".to_owned()),
                })
            }
            ("tristrips", _, Some(column)) => {
                let others = element.properties.iter().enumerate().filter(|(k, _)| *k != column);
                dropped.extend(others.map(|(_, p)| format!("tristrips property {}", p.name.escape_debug())));
                read_strips(&mut values, element, column, layout.vertices, &mut fans)
            }
            _ => {
                dropped.push(format!("element {} ({})", element.name.escape_debug(), element.count));
                skip_element(&mut values, element)
            }
        };
        read.map_err(|e| within(e, &format!("element {}", element.name.escape_debug())))?;
    }
    let Faces { mesh, polygons, notes, origins } = fans.mesh(positions);
    let mut gathered = Gathered::default();
    if let Some(columns) = of_vertices {
        columns.of_vertices(&mesh.triangles, &mut gathered);
    }
    if let Some(attributes) = of_faces {
        attributes.take(&origins, &mut gathered);
    }
    let mesh = IndexedMesh { libraries: header.textures.clone(), ..gathered.mesh(mesh) };
    dropped.extend(gathered.dropped);
    dropped.extend(notes);
    dropped.extend(values.rest());
    let wide = |axis: &(usize, Scalar)| matches!(axis.1, Scalar::F64 | Scalar::I32 | Scalar::U32);
    let coordinates = match layout.axes {
        Some(axes) if axes.iter().any(wide) => Coordinates::Float64,
        _ => Coordinates::Float32,
    };
    let (format, text) = (Format::Ply, header.encoding == Encoding::Ascii);
    Ok(Source { polygons, text, dropped, ..Source::new(mesh, format, coordinates) })
}

fn read_vertices(
    values: &mut impl Values,
    element: &Element,
    axes: [(usize, Scalar); 3],
    mut attributes: Columns,
    positions: &mut Vec<[f64; 3]>,
) -> Result<Columns> {
    let columns: Vec<(Kind, Option<usize>)> = element
        .properties
        .iter()
        .enumerate()
        .map(|(column, p)| (p.kind, axes.iter().position(|&(axis, _)| axis == column)))
        .collect();
    // The claim is believed only as far as the file is long enough for it.
    let room = axes.map(|(_, scalar)| values.at_most(scalar) / 3).into_iter().min().unwrap_or(0);
    positions.reserve(usize::try_from(element.count).map_or(room, |n| n.min(room)));
    let any = attributes.kept.contains(&true);
    let mut row = vec![0; columns.len()];
    for vertex in 0..element.count {
        let mut position = [0.0; 3];
        for (k, &(kind, axis)) in columns.iter().enumerate() {
            match (kind, axis) {
                (Kind::Scalar(scalar), Some(axis)) => {
                    position[axis] = values.number(scalar)?;
                    if !position[axis].is_finite() {
                        let name = ["x", "y", "z"][axis];
                        return Err(values.fault(format!("{name} of vertex {vertex} is {}", position[axis])));
                    }
                }
                (Kind::Scalar(scalar), None) => row[k] = values.bits(scalar)?,
                _ => skip(values, kind)?,
            }
        }
        positions.push(position);
        if any {
            attributes.row(&row);
        }
    }
    Ok(attributes)
}

fn skip_element(values: &mut impl Values, element: &Element) -> Result<()> {
    match element.properties[..] {
        // Nothing is stored, however many rows are claimed.
        [] => Ok(()),
        [Property { kind: Kind::Scalar(scalar), .. }] => values.skip(scalar, element.count),
        _ => (0..element.count)
            .try_for_each(|_| element.properties.iter().try_for_each(|p| skip(values, p.kind))),
    }
}

/// The columns of `vertex` that hold x, y, z.
fn axes(vertex: &Element) -> Result<[(usize, Scalar); 3], String> {
    let find = |name: &str| {
        vertex.properties.iter().enumerate().find_map(|(column, p)| match p.kind {
            Kind::Scalar(scalar) if p.name == name => Some((column, scalar)),
            _ => None,
        })
    };
    match [find("x"), find("y"), find("z")] {
        [Some(x), Some(y), Some(z)] => Ok([x, y, z]),
        _ => Err("element `vertex` has no x, y, z".into()),
    }
}

/// The column that holds the vertex indices of a face or strip.
fn index_list(element: &Element) -> Option<usize> {
    element.properties.iter().position(|p| {
        matches!(p.kind, Kind::List(..)) && (p.name == "vertex_indices" || p.name == "vertex_index")
    })
}

fn header_fault(name: &str, element: &Element, what: &str) -> Error {
    InputError::new(name, Place::Line(element.line), what).into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::attributes::{Domain, Semantic, Values as Numbers};
    use proptest::prelude::*;

    const SQUARE: &str = "0 0 0\n1 0 0\n1 1 0\n0 1 0.5\n";
    const POSITIONS: [[f64; 3]; 4] = [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.5]];

    fn header(format: &str, lines: &str) -> String {
        format!("ply\nformat {format} 1.0\n{lines}end_header\n")
    }

    /// A text file of four vertices, with `face` as the two header lines about the rest, which begins at line 14.
    fn text(face: &str, data: &str) -> String {
        let vertex = "element vertex 4\nproperty float x\nproperty double y\nproperty float z\n";
        header("ascii", &format!("{vertex}{face}")) + SQUARE + data
    }

    const FACES: &str = "element face 1\nproperty list uchar int vertex_indices\n";
    const STRIPS: &str = "element tristrips 1\nproperty list int int vertex_index\n";

    fn source(bytes: impl AsRef<[u8]>) -> Source {
        read(bytes.as_ref(), "").unwrap()
    }

    fn fails(place: Place, what: &str, bytes: impl AsRef<[u8]>) {
        match read(bytes.as_ref(), "a.ply") {
            Err(Error::Input(e)) => assert_eq!(e, InputError::new("a.ply", place, what)),
            other => panic!("{other:?}"),
        }
    }

    /// A binary file with vertices of (short x, uchar label, float y, double z), a face of 3 and one of 4.
    fn binary(big_endian: bool) -> (usize, Vec<u8>) {
        let format = if big_endian { "binary_big_endian" } else { "binary_little_endian" };
        let header = header(
            format,
            "element camera 2\nproperty float f\nproperty list char ushort dots\n\
             element vertex 4\nproperty short x\nproperty uchar label\nproperty float y\nproperty double z\n\
             element face 2\nproperty int flags\nproperty list uint ushort vertex_index\nproperty uchar red\n",
        );
        let mut data = Vec::new();
        let mut push = |little: &[u8]| {
            let order: Vec<u8> =
                if big_endian { little.iter().rev().copied().collect() } else { little.to_vec() };
            data.extend(order);
        };
        for dots in [2u8, 0] {
            push(&1.5f32.to_le_bytes());
            push(&[dots]);
            (0..dots).for_each(|dot| push(&u16::from(dot).to_le_bytes()));
        }
        for [x, y, z] in POSITIONS {
            push(&(x as i16).to_le_bytes());
            push(&[7]);
            push(&(y as f32).to_le_bytes());
            push(&z.to_le_bytes());
        }
        for face in [&[0u16, 1, 2][..], &[3, 2, 1, 0]] {
            push(&(-1i32).to_le_bytes());
            push(&(face.len() as u32).to_le_bytes());
            face.iter().for_each(|v| push(&v.to_le_bytes()));
            push(&[255]);
        }
        (header.len(), [header.into_bytes(), data].concat())
    }

    #[test]
    fn text_of_any_line_end() {
        let file = text(FACES, "4 0 1\n 2\t3 \n\n");
        for end in ["\n", "\r\n", "\r"] {
            let s = source(file.replace('\n', end));
            assert_eq!(s.mesh, IndexedMesh::new(POSITIONS.to_vec(), vec![[0, 1, 2], [0, 2, 3]]));
            assert_eq!((s.format, s.polygons, s.coordinates), (Format::Ply, 1, Coordinates::Float64));
            assert!(s.text);
            assert!(s.dropped.is_empty());
        }
    }

    #[test]
    fn binary_in_both_byte_orders() {
        for big_endian in [false, true] {
            let s = source(binary(big_endian).1);
            let triangles = vec![[0, 1, 2], [3, 2, 1], [3, 1, 0]];
            assert_eq!((s.mesh.positions, s.mesh.triangles), (POSITIONS.to_vec(), triangles));
            assert_eq!((s.polygons, s.coordinates, s.text), (1, Coordinates::Float64, false));
            assert_eq!(s.dropped, ["element camera (2)"]);
            let [label, flags, red] = &s.mesh.attributes[..] else { panic!("{:?}", s.mesh.attributes) };
            let told = [label, flags, red].map(|a| (&a.name[..], a.semantic, a.domain, a.values.clone()));
            let (generic, values) = (Semantic::Generic, Numbers::U8(vec![7; 4]));
            assert_eq!(told[0], ("label", generic, Domain::Corner, values));
            assert_eq!(told[1], ("flags", generic, Domain::Triangle, Numbers::I32(vec![-1; 2])));
            assert_eq!(told[2], ("red", generic, Domain::Triangle, Numbers::U8(vec![255; 2])));
            assert_eq!(
                (&label.corners[..], &red.corners[..]),
                (&[0, 1, 2, 3, 2, 1, 3, 1, 0][..], &[0, 1, 1][..])
            );
        }
    }

    #[test]
    fn every_truncation_is_an_error() {
        for big_endian in [false, true] {
            let (header, whole) = binary(big_endian);
            for length in header..whole.len() {
                match read(&whole[..length], "") {
                    Err(Error::Input(InputError { place: Place::Byte(byte), what, .. })) => {
                        // The value cut off takes at most 8 bytes, or is the list skipped as a whole.
                        assert!((length - 7..=length).contains(&(byte as usize)), "{length} {byte}");
                        assert!(what.starts_with("the file ends early (element "), "{what}");
                    }
                    other => panic!("{length} {other:?}"),
                }
            }
            (0..header).for_each(|length| assert!(read(&whole[..length], "").is_err()));
        }
        let whole = text(FACES, "3 0 1 2");
        (0..whole.len())
            .for_each(|length| assert!(read(&whole.as_bytes()[..length], "").is_err(), "{length}"));
    }

    #[test]
    fn strips_turn_every_second_triangle_and_restart() {
        let s = source(text(STRIPS, "12 0 1 2 3 -1 3 2 1 -1 0 1 -1"));
        assert_eq!(s.mesh.triangles, [[0, 1, 2], [2, 1, 3], [3, 2, 1]]);
        // The degenerate triangles 1 2 2 and 2 2 3 are passed over, yet 2 3 0 is the fourth of its strip.
        let s = source(text(STRIPS, "6 0 1 2 2 3 0"));
        assert_eq!(s.mesh.triangles, [[0, 1, 2], [3, 2, 0]]);
        // Every list begins a strip.
        let two = STRIPS.replace("tristrips 1", "tristrips 2");
        assert_eq!(source(text(&two, "3 0 1 2\n3 2 1 3")).mesh.triangles, [[0, 1, 2], [2, 1, 3]]);
    }

    #[test]
    fn elements_in_any_order_and_unknown_ones() {
        let lines = "element face 1\nproperty list uchar float texcoord\nproperty list uchar int vertex_indices\n\
            element nothing 4000000000\nelement edge 0\nproperty int a\nelement range_grid 2\n\
            property list uchar int vertex_indices\nelement vertex 3\nproperty list int int near\nproperty uchar x\n\
            property int z\nproperty float nx\nproperty float y\nproperty float nz\n";
        let data = "6 .1 .2 .3 .4 .5 .6  3 2 1 0\n0\n2 1 1\n1 9 10 11 12 13 14\n0 20 21 22 23 24\n0 30 31 32 33 34\nx";
        let s = source(header("ascii", lines) + data);
        assert_eq!(s.mesh.positions, [[10.0, 13.0, 11.0], [20.0, 23.0, 21.0], [30.0, 33.0, 31.0]]);
        assert_eq!(s.mesh.triangles, [[2, 1, 0]]);
        assert_eq!(
            s.dropped,
            [
                "element nothing (4000000000)",
                "element range_grid (2)",
                "vertex property near",
                "text after the last element",
            ]
        );
        let [x, z, uv] = &s.mesh.attributes[..] else { panic!("{:?}", s.mesh.attributes) };
        // Two numbers of a normal are none.
        assert_eq!((&x.name[..], &x.values), ("nx", &Numbers::F32(vec![12.0, 22.0, 32.0])));
        assert_eq!((&z.name[..], &z.corners[..]), ("nz", &[2, 1, 0][..]));
        assert_eq!(
            (uv.semantic, &uv.values),
            (Semantic::TexCoord, &Numbers::F32(vec![0.1, 0.2, 0.3, 0.4, 0.5, 0.6]))
        );
        assert_eq!(uv.corners, [0, 1, 2]);
    }

    #[test]
    fn short_faces_become_nothing() {
        let faces = FACES.replace("face 1", "face 3");
        let s = source(text(&faces, "2 0 1\n0\n3 1 1 2\n"));
        assert_eq!(s.mesh.triangles, [[1, 1, 2]]);
        assert_eq!(s.dropped, ["faces with fewer than 3 corners (2)"]);
    }

    #[test]
    fn the_type_of_the_coordinates_is_told() {
        let told = |types: [&str; 3]| {
            let [x, y, z] = types;
            let lines = format!("element vertex 0\nproperty {x} x\nproperty {y} y\nproperty {z} z\n");
            let [binary, text] =
                ["binary_little_endian", "ascii"].map(|format| source(header(format, &lines)).coordinates);
            assert_eq!(binary, text);
            text
        };
        assert_eq!(told(["float", "float", "float"]), Coordinates::Float32);
        assert_eq!(told(["short", "uchar", "float32"]), Coordinates::Float32);
        assert_eq!(told(["float", "float", "double"]), Coordinates::Float64);
        assert_eq!(told(["int", "float", "float"]), Coordinates::Float64);
    }

    #[test]
    fn text_is_read_to_the_declared_type() {
        let lines = "element vertex 1\nproperty float x\nproperty double y\nproperty short z\n";
        // Half way between 1 and the next binary32 number, and a little more: by way of binary64 it would round to 1.
        let halfway = "1.000000059604644775390625000000001";
        let s = source(header("ascii", lines) + halfway + " 0.1 -7.0\n");
        assert_eq!(s.mesh.positions, [[1.0 + f64::from(f32::EPSILON), 0.1, -7.0]]);
        let s = source(header("ascii", &lines.replace("double", "float")) + "0.1 0.1 3e4\n");
        assert_eq!(s.mesh.positions, [[f64::from(0.1f32), f64::from(0.1f32), 30000.0]]);
        assert_eq!(s.coordinates, Coordinates::Float32);
        let refused = |data: &str, what: &str| {
            let file = header("ascii", lines) + data;
            fails(Place::Line(8), &format!("{what} (element vertex)"), file);
        };
        refused("-1e39 0 0", "\"-1e39\" is beyond the declared type, binary32");
        refused("0 0 0.5", "\"0.5\" is not an integer, as declared");
        refused("0 0 32768", "\"32768\" is beyond the declared type, a 16-bit integer");
        refused("-inf 0 0", "x of vertex 0 is -inf");
        refused("0 1e999 0", "y of vertex 0 is inf");
    }

    #[test]
    fn faults_in_text_are_placed() {
        let range = "is out of range: the file has 4 vertices";
        fails(Place::Line(15), &format!("vertex index 4 {range} (element face)"), text(FACES, "3 0 1\n4"));
        fails(Place::Line(14), &format!("vertex index -1 {range} (element face)"), text(FACES, "3 0 -1 1"));
        fails(
            Place::Line(14),
            &format!("vertex index -2 {range} (element tristrips)"),
            text(STRIPS, "3 0 -2 1"),
        );
        fails(Place::Line(14), "a list of length -3 (element face)", text(FACES, "-3 0 1 2"));
        fails(Place::Line(14), "\"1.5\" is not an integer (element face)", text(FACES, "3 0 1.5 2"));
        fails(Place::Line(14), "the file ends early (element face)", text(FACES, "3 0 1"));
        let nan = text(FACES, "").replace("1 1 0\n", "1 nan 0\n");
        fails(Place::Line(12), "y of vertex 2 is NaN (element vertex)", nan);
        let word = text(FACES, "").replace("0.5", "0,5");
        fails(Place::Line(13), "\"0,5\" is not a number (element vertex)", word);
    }

    #[test]
    fn faults_in_binary_are_placed() {
        let (header, whole) = binary(false);
        let with = |at: usize, bytes: &[u8]| {
            let mut file = whole.clone();
            file[header + at..][..bytes.len()].copy_from_slice(bytes);
            file
        };
        let place = |at: usize| Place::Byte((header + at) as u64);
        // Cameras take 9 + 5 bytes, vertices 15 each; the first face begins at 74, its indices at 82.
        let what = "a list of length -1 (element camera)";
        fails(place(4), what, with(4, &[0xff]));
        let y = 14 + 15 + 3;
        fails(place(y), "y of vertex 1 is inf (element vertex)", with(y, &f32::INFINITY.to_le_bytes()));
        let what = "vertex index 4 is out of range: the file has 4 vertices (element face)";
        fails(place(84), what, with(84, &[4, 0]));
        // The second face begins at 89, its indices at 97; the fifth would begin with the colour, the last byte.
        fails(place(105), "the file ends early (element face)", with(93, &[5]));
    }

    #[test]
    fn faults_in_the_header_are_placed() {
        let no_z = "element vertex 3\nproperty float x\nproperty float y\n";
        fails(Place::Line(3), "element `vertex` has no x, y, z", header("ascii", no_z));
        let list = format!("{no_z}property list int float z\n");
        fails(Place::Line(3), "element `vertex` has no x, y, z", header("ascii", &list));
        let no_list = "element face 1\nproperty list uchar int corners\nproperty int vertex_indices\n";
        let what = "element `face` has no list `vertex_indices` or `vertex_index`";
        fails(Place::Line(3), what, header("ascii", no_list));
        fails(Place::Line(7), "a second element `vertex`", text("element vertex 1\n", ""));
    }

    #[test]
    fn a_claim_costs_nothing() {
        for (format, place) in [("ascii", Place::Line(8)), ("binary_little_endian", Place::Byte(0))] {
            for count in ["4294967295", "18446744073709551615"] {
                let lines =
                    format!("element vertex {count}\nproperty float x\nproperty float y\nproperty float z\n");
                let file = header(format, &lines);
                let place = if place == Place::Byte(0) { Place::Byte(file.len() as u64) } else { place };
                fails(place, "the file ends early (element vertex)", &file);
                let faces = FACES.replace("face 1", &format!("face {count}")).replace("uchar", "uint");
                let file = header(format, &faces);
                let place =
                    if let Place::Line(_) = place { Place::Line(6) } else { Place::Byte(file.len() as u64) };
                fails(place, "the file ends early (element face)", &file);
            }
        }
    }

    proptest! {
        #[test]
        fn damage_does_no_harm(at in any::<prop::sample::Index>(), value: u8, big_endian: bool) {
            let (_, mut file) = binary(big_endian);
            let at = at.index(file.len());
            file[at] = value;
            match read(&file, "") {
                Ok(s) => {
                    let n = s.mesh.positions.len() as u32;
                    prop_assert!(s.mesh.triangles.iter().flatten().all(|&v| v < n));
                    prop_assert!(s.mesh.positions.iter().flatten().all(|x| x.is_finite()));
                }
                Err(e) => prop_assert!(matches!(e, Error::Input(_)), "{e:?}"),
            }
        }
    }
}
