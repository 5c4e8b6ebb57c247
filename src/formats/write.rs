//! Writes PLY, OBJ, STL and glTF: what the writers share.

use std::array;
use std::io::{self, Write};

use crate::mesh::IndexedMesh;
use crate::mesh::attributes::{Attribute, Domain, NO_VALUE, Semantic, Values};

use super::{Format, gltf, obj_write, ply_write, stl_write};

/// The type of the coordinates in a file; in text, the one to which its decimals are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Precision {
    /// binary32, to the nearest.
    Float32,
    /// binary64, exactly.
    Float64,
}

/// What a file of a format would not keep of a mesh's attributes, names and libraries, in words for the user, e.g.
/// `"OBJ has no place for tangent, uv1"`. All of it where the format is not one that is written.
pub fn unwritten(mesh: &IndexedMesh, format: Format) -> Vec<String> {
    match format {
        Format::Ply => ply_write::unwritten(mesh),
        Format::Obj => obj_write::unwritten(mesh),
        Format::Stl => stl_write::unwritten(mesh),
        Format::Gltf => gltf::unwritten(mesh),
        Format::Off => no_place(format, mesh.attributes.iter()).into_iter().collect(),
    }
}

/// Says which attributes a format has no place for, if there are any.
pub(super) fn no_place<'a>(
    format: Format,
    attributes: impl Iterator<Item = &'a Attribute>,
) -> Option<String> {
    let title = |attribute: &Attribute| match (attribute.domain, attribute.semantic) {
        (Domain::Triangle, semantic) if semantic != Semantic::Part => {
            format!("{} of triangles", attribute.title())
        }
        _ => attribute.title(),
    };
    let titles: Vec<String> = attributes.map(title).collect();
    (!titles.is_empty()).then(|| format!("{} has no place for {}", format.name(), titles.join(", ")))
}

/// That the attributes are those of the mesh; then its triangles must be those of its vertices, too.
pub(super) fn check(mesh: &IndexedMesh) -> io::Result<()> {
    let invalid = |what: String| io::Error::new(io::ErrorKind::InvalidInput, what);
    let vertices = mesh.positions.len();
    if mesh.attributes.is_empty() {
        return Ok(());
    }
    if let Some(v) = mesh.triangles.as_flattened().iter().find(|&&v| v as usize >= vertices) {
        return Err(invalid(format!("a triangle names vertex {v} of {vertices}")));
    }
    mesh.attributes.iter().try_for_each(|a| a.check(mesh.triangles.len())).map_err(invalid)
}

/// The value of each vertex, where an attribute has the same one at all corners of each; vertices of no triangle have none.
pub(super) fn of_vertices(attribute: &Attribute, mesh: &IndexedMesh) -> Option<Vec<u32>> {
    if attribute.domain != Domain::Corner {
        return None;
    }
    // No value at all yet: a number that no value has, since no mesh has so many corners.
    const OPEN: u32 = NO_VALUE - 1;
    let mut values = vec![OPEN; mesh.positions.len()];
    for (&v, &value) in mesh.triangles.as_flattened().iter().zip(&attribute.corners) {
        let known = values.get_mut(v as usize)?;
        if *known == OPEN {
            *known = value;
        } else if !same(attribute, *known, value) {
            return None;
        }
    }
    values.iter_mut().filter(|value| **value == OPEN).for_each(|value| *value = NO_VALUE);
    Some(values)
}

/// Whether two values are one, bit for bit.
fn same(attribute: &Attribute, one: u32, other: u32) -> bool {
    if one == other || one == NO_VALUE || other == NO_VALUE {
        return one == other;
    }
    let bits = |value: u32, k: usize| attribute.values.bits(value as usize * attribute.components + k);
    (0..attribute.components).all(|k| bits(one, k) == bits(other, k))
}

/// A number, as what it stands for: integers that stand for fractions become these.
pub(super) fn fraction(attribute: &Attribute, at: usize) -> f64 {
    attribute.values.fraction(at, attribute.normalised)
}

/// Whether a library is a picture, as PLY files name them, and not a file of materials, as OBJ files do.
pub(super) fn is_picture(library: &str) -> bool {
    let extension = library.rsplit_once('.').map(|(_, extension)| extension.to_ascii_lowercase());
    let pictures = [
        "png", "jpg", "jpeg", "tga", "tif", "tiff", "bmp", "gif", "dds", "exr", "hdr", "ktx", "ktx2", "webp",
    ];
    extension.is_some_and(|extension| pictures.contains(&extension.as_str()))
}

/// A name in one line.
pub(super) fn in_line(name: &str) -> String {
    name.split(['\n', '\r']).map(str::trim).collect::<Vec<_>>().join(" ")
}

/// Writes a number as the shortest decimal that reads back exactly in a precision.
pub(super) fn write_number(out: &mut impl Write, x: f64, precision: Precision) -> io::Result<()> {
    // Display never uses an exponent: 300 zeros for 1e300.
    let plain = x == 0.0 || (1e-4..1e16).contains(&x.abs());
    let small = x as f32;
    match precision {
        Precision::Float32 if plain => write!(out, "{small}"),
        Precision::Float32 => write!(out, "{small:e}"),
        Precision::Float64 if plain => write!(out, "{x}"),
        Precision::Float64 => write!(out, "{x:e}"),
    }
}

/// The normal of a triangle, of length 1; 0 where it has none.
pub(super) fn unit_normal([a, b, c]: [[f64; 3]; 3]) -> [f64; 3] {
    let (mut u, mut v): ([f64; 3], [f64; 3]) =
        (array::from_fn(|k| b[k] - a[k]), array::from_fn(|k| c[k] - a[k]));
    // Sides of about 1, so that no product overflows or vanishes.
    for side in [&mut u, &mut v] {
        let most = side.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        *side = side.map(|x| if most > 0.0 { x / most } else { 0.0 });
    }
    let normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    let length = normal.iter().map(|x| x * x).sum::<f64>().sqrt();
    normal.map(|x| if length > 0.0 { x / length } else { 0.0 })
}

/// `stored` if it is finite; `x` is what the mesh has.
pub(super) fn finite(stored: f64, x: f64) -> io::Result<f64> {
    if stored.is_finite() {
        return Ok(stored);
    }
    Err(io::Error::new(
        io::ErrorKind::InvalidInput,
        format!("the coordinate {x} is not finite in the file's precision"),
    ))
}

/// The precision in which decimals tell all of a number.
pub(super) fn precision(attribute: &Attribute) -> Precision {
    match attribute.values {
        Values::F64(_) => Precision::Float64,
        // Integers have all their digits.
        Values::U32(_) | Values::I32(_) if !attribute.normalised => Precision::Float64,
        _ => Precision::Float32,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::{write_obj, write_ply, write_stl};

    fn mesh() -> IndexedMesh {
        IndexedMesh::new(
            vec![[0.0, -0.0, 1.0], [0.1, 1e300, -2.5e-7], [123456.75, 5e-324, 9.0]],
            vec![[0, 1, 2]],
        )
    }

    #[test]
    fn obj_text() {
        let mut text = Vec::new();
        write_obj(&mesh(), Precision::Float64, &mut text).unwrap();
        let expected = "v 0 -0 1\nv 0.1 1e300 -2.5e-7\nv 123456.75 5e-324 9\nf 1 2 3\n";
        assert_eq!(String::from_utf8(text).unwrap(), expected);
        // What has been binary32 has the decimals of that.
        let mut mesh = mesh();
        mesh.positions[1] = [0.1f32, 1e30, -2.5e-7].map(f64::from);
        mesh.positions[2][1] = f64::from(f32::from_bits(1));
        text = Vec::new();
        write_obj(&mesh, Precision::Float32, &mut text).unwrap();
        let expected = "v 0 -0 1\nv 0.1 1e30 -2.5e-7\nv 123456.75 1e-45 9\nf 1 2 3\n";
        assert_eq!(String::from_utf8(text).unwrap(), expected);
    }

    #[test]
    fn ply_bytes() {
        let mut mesh = mesh();
        mesh.positions[1] = [-2.0, 0.0, 0.0];
        mesh.positions.truncate(2);
        mesh.triangles = vec![[0, 1, 258]];
        let mut bytes = Vec::new();
        write_ply(&mesh, Precision::Float32, &mut bytes).unwrap();
        let header = "ply\nformat binary_little_endian 1.0\nelement vertex 2\nproperty float x\nproperty float y\n\
            property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";
        let data = [
            0, 0, 0, 0, 0, 0, 0, 0x80, 0, 0, 0x80, 0x3f, 0, 0, 0, 0xc0, 0, 0, 0, 0, 0, 0, 0, 0, 3, 0, 0, 0,
            0, 1, 0, 0, 0, 2, 1, 0, 0,
        ];
        assert_eq!(bytes, [header.as_bytes(), &data].concat());
    }

    #[test]
    fn stl_bytes() {
        // A triangle in the plane z = 3, counter-clockwise from above, and one in a line.
        let positions = vec![[0.0, 0.0, 3.0], [2.0, 0.0, 3.0], [0.0, 0.1, 3.0], [9.0; 3]];
        let mesh = IndexedMesh::new(positions, vec![[1, 2, 0], [0, 1, 1]]);
        let mut bytes = Vec::new();
        write_stl(&mesh, &mut bytes).unwrap();
        let mut expected = [b' '; 80].to_vec();
        expected.extend([2, 0, 0, 0]);
        for facet in [
            [[0.0, 0.0, 1.0], [2.0, 0.0, 3.0], [0.0, 0.1, 3.0], [0.0, 0.0, 3.0]],
            [[0.0, 0.0, 0.0], [0.0, 0.0, 3.0], [2.0, 0.0, 3.0], [2.0, 0.0, 3.0]],
        ] {
            expected.extend(facet.as_flattened().iter().flat_map(|&x: &f64| (x as f32).to_le_bytes()));
            expected.extend([0, 0]);
        }
        assert_eq!(bytes, expected);
    }

    #[test]
    fn normals_of_any_size() {
        for size in [1e-30, 1e-300, 1.0, 1e30, 1e150] {
            let n = unit_normal([[0.0; 3], [0.0, size, 0.0], [0.0, 0.0, size / 3.0]]);
            assert_eq!(n, [1.0, 0.0, 0.0]);
        }
    }

    #[test]
    fn attributes_of_another_mesh_are_refused() {
        let mut mesh = IndexedMesh::new(vec![[0.0; 3]; 3], vec![[0, 1, 3]]);
        let color = Attribute::new(Semantic::Color, 3, Values::U8(vec![0; 3]), vec![0; 3]);
        mesh.attributes = vec![color];
        let says = |mesh: &IndexedMesh| {
            write_ply(mesh, Precision::Float64, &mut io::sink()).map_err(|e| e.to_string())
        };
        assert_eq!(says(&mesh), Err("a triangle names vertex 3 of 3".to_owned()));
        mesh.triangles[0][2] = 2;
        assert_eq!(says(&mesh), Ok(()));
        mesh.attributes[0].corners[2] = 1;
        assert_eq!(says(&mesh), Err("color: index 2 names value 1 of 1".to_owned()));
        let kind = |r: io::Result<()>| r.unwrap_err().kind();
        assert_eq!(kind(write_obj(&mesh, Precision::Float64, &mut io::sink())), io::ErrorKind::InvalidInput);
        assert_eq!(kind(write_stl(&mesh, &mut io::sink())), io::ErrorKind::InvalidInput);
    }

    #[test]
    fn what_would_not_read_back_is_refused() {
        let kind = |r: io::Result<()>| r.unwrap_err().kind();
        let mut mesh = mesh();
        assert_eq!(kind(write_ply(&mesh, Precision::Float32, &mut io::sink())), io::ErrorKind::InvalidInput);
        assert_eq!(kind(write_stl(&mesh, &mut io::sink())), io::ErrorKind::InvalidInput);
        write_ply(&mesh, Precision::Float64, &mut io::sink()).unwrap();
        mesh.positions[0][0] = f64::NAN;
        assert_eq!(kind(write_ply(&mesh, Precision::Float64, &mut io::sink())), io::ErrorKind::InvalidInput);
        for precision in [Precision::Float32, Precision::Float64] {
            assert_eq!(kind(write_obj(&mesh, precision, &mut io::sink())), io::ErrorKind::InvalidInput);
        }
        mesh.positions[0][0] = 1e39;
        assert_eq!(kind(write_obj(&mesh, Precision::Float32, &mut io::sink())), io::ErrorKind::InvalidInput);
    }
}
