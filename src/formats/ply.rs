//! Reads PLY: the Polygon File Format (G. Turk 1994) with the conventions that grew around it.
//!
//! - Elements may come in any order; rows of text are words, wherever their lines end.
//! - `vertex` has x, y and z of any type. `face` has a list `vertex_indices` or `vertex_index`.
//! - `tristrips` has a list of the same names; -1 begins a new strip. Every second triangle of a strip is
//!   turned round. A strip triangle that names a vertex twice is a device to go round corners, so it is skipped; but
//!   it counts for the turning.

use crate::error::{Error, InputError, Place, Result};
use crate::mesh::IndexedMesh;

use super::fan::Fans;
use super::ply_header::{Element, Encoding, Header, Kind, Property, Scalar};
use super::ply_values::{Binary, Text, Values};
use super::{Coordinates, Format, Source};

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
    let axes = vertex.map(|v| axes(v).map_err(|what| header_fault(name, v, &what))).transpose()?;
    let layout = Layout { axes, vertices: vertex.map_or(0, |v| v.count) };
    match header.encoding {
        Encoding::Ascii => {
            read_elements(&header, &layout, Text::new(bytes, header.length, header.lines, name))
        }
        Encoding::LittleEndian => {
            read_elements(&header, &layout, Binary::<false>::new(bytes, header.length, name))
        }
        Encoding::BigEndian => {
            read_elements(&header, &layout, Binary::<true>::new(bytes, header.length, name))
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
    for element in header.elements.iter().filter(|e| e.count > 0) {
        let read = match (element.name.as_str(), layout.axes, index_list(element)) {
            ("vertex", Some(axes), _) => {
                note_properties(element, &axes.map(|(column, _)| column), &mut dropped);
                read_vertices(&mut values, element, axes, &mut positions)
            }
            ("face", _, Some(column)) => {
                note_properties(element, &[column], &mut dropped);
                read_faces(&mut values, element, column, layout.vertices, &mut fans)
            }
            ("tristrips", _, Some(column)) => {
                note_properties(element, &[column], &mut dropped);
                read_strips(&mut values, element, column, layout.vertices, &mut fans.triangles)
            }
            _ => {
                dropped.push(format!("element {} ({})", element.name.escape_debug(), element.count));
                skip_element(&mut values, element)
            }
        };
        read.map_err(|e| in_element(e, element))?;
    }
    if header.textures > 0 {
        dropped.push(format!("texture file names ({})", header.textures));
    }
    dropped.extend(fans.note_short());
    dropped.extend(values.rest());
    let coordinates = match (header.encoding, layout.axes) {
        (Encoding::Ascii, _) => Coordinates::Text,
        (_, Some(axes)) if axes.iter().any(|a| matches!(a.1, Scalar::F64 | Scalar::I32 | Scalar::U32)) => {
            Coordinates::Float64
        }
        _ => Coordinates::Float32,
    };
    let mesh = IndexedMesh::new(positions, fans.triangles);
    Ok(Source { mesh, format: Format::Ply, polygons: fans.polygons, coordinates, dropped })
}

fn read_vertices(
    values: &mut impl Values,
    element: &Element,
    axes: [(usize, Scalar); 3],
    positions: &mut Vec<[f64; 3]>,
) -> Result<()> {
    let columns: Vec<(Kind, Option<usize>)> = element
        .properties
        .iter()
        .enumerate()
        .map(|(column, p)| (p.kind, axes.iter().position(|&(axis, _)| axis == column)))
        .collect();
    // The claim is believed only as far as the file is long enough for it.
    let room = axes.map(|(_, scalar)| values.at_most(scalar) / 3).into_iter().min().unwrap_or(0);
    positions.reserve(usize::try_from(element.count).map_or(room, |n| n.min(room)));
    for vertex in 0..element.count {
        let mut position = [0.0; 3];
        for &(kind, axis) in &columns {
            match (kind, axis) {
                (Kind::Scalar(scalar), Some(axis)) => {
                    position[axis] = values.number(scalar)?;
                    if !position[axis].is_finite() {
                        let name = ["x", "y", "z"][axis];
                        return Err(values.fault(format!("{name} of vertex {vertex} is {}", position[axis])));
                    }
                }
                _ => skip(values, kind)?,
            }
        }
        positions.push(position);
    }
    Ok(())
}

fn read_faces(
    values: &mut impl Values,
    element: &Element,
    column: usize,
    vertices: u64,
    fans: &mut Fans,
) -> Result<()> {
    if let Kind::List(_, item) = element.properties[column].kind {
        let room = values.at_most(item) / 3;
        fans.triangles.reserve(usize::try_from(element.count).map_or(room, |n| n.min(room)));
    }
    for _ in 0..element.count {
        for (k, property) in element.properties.iter().enumerate() {
            match property.kind {
                Kind::List(length, item) if k == column => {
                    for _ in 0..list_length(values, length)? {
                        let index = values.integer(item)?;
                        fans.corner(vertex(values, index, vertices)?);
                    }
                    fans.end();
                }
                kind => skip(values, kind)?,
            }
        }
    }
    Ok(())
}

fn read_strips(
    values: &mut impl Values,
    element: &Element,
    column: usize,
    vertices: u64,
    triangles: &mut Vec<[u32; 3]>,
) -> Result<()> {
    for _ in 0..element.count {
        for (k, property) in element.properties.iter().enumerate() {
            match property.kind {
                Kind::List(length, item) if k == column => {
                    let mut before = [0; 2];
                    let mut corners = 0u64;
                    for _ in 0..list_length(values, length)? {
                        let index = values.integer(item)?;
                        if index == -1 {
                            corners = 0;
                            continue;
                        }
                        let ([a, b], c) = (before, vertex(values, index, vertices)?);
                        if corners >= 2 && a != b && b != c && c != a {
                            triangles.push(if corners % 2 == 0 { [a, b, c] } else { [b, a, c] });
                        }
                        before = [b, c];
                        corners += 1;
                    }
                }
                kind => skip(values, kind)?,
            }
        }
    }
    Ok(())
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

#[inline]
fn skip(values: &mut impl Values, kind: Kind) -> Result<()> {
    match kind {
        Kind::Scalar(scalar) => values.skip(scalar, 1),
        Kind::List(length, item) => {
            let length = list_length(values, length)?;
            values.skip(item, length)
        }
    }
}

#[inline]
fn list_length(values: &mut impl Values, scalar: Scalar) -> Result<u64> {
    let length = values.integer(scalar)?;
    u64::try_from(length).map_err(|_| values.fault(format!("a list of length {length}")))
}

/// The index read last, checked.
#[inline]
fn vertex(values: &impl Values, index: i64, vertices: u64) -> Result<u32> {
    match u32::try_from(index) {
        Ok(v) if u64::from(v) < vertices => Ok(v),
        _ => {
            Err(values
                .fault(format!("vertex index {index} is out of range: the file has {vertices} vertices")))
        }
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

/// Names the columns that are not read, those that belong together as one.
fn note_properties(element: &Element, read: &[usize], dropped: &mut Vec<String>) {
    let unread = element.properties.iter().enumerate().filter(|(column, _)| !read.contains(column));
    for (_, property) in unread {
        let (owner, name) = (element.name.as_str(), property.name.as_str());
        let note = match name {
            "nx" | "ny" | "nz" => format!("{owner} normals"),
            "red" | "green" | "blue" | "alpha" | "diffuse_red" | "diffuse_green" | "diffuse_blue" => {
                format!("{owner} colours")
            }
            "s" | "t" | "u" | "v" | "texture_u" | "texture_v" | "texcoord" => {
                format!("{owner} texture coordinates")
            }
            _ => format!("{owner} property {}", name.escape_debug()),
        };
        if !dropped.contains(&note) {
            dropped.push(note);
        }
    }
}

fn header_fault(name: &str, element: &Element, what: &str) -> Error {
    InputError::new(name, Place::Line(element.line), what).into()
}

fn in_element(error: Error, element: &Element) -> Error {
    match error {
        Error::Input(mut e) => {
            e.what = format!("{} (element {})", e.what, element.name.escape_debug());
            e.into()
        }
        other => other,
    }
}
