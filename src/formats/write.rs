//! Writes PLY, OBJ and STL: positions and triangles.

use std::array;
use std::io::{self, BufWriter, Write};

use byteorder::{ByteOrder, LittleEndian, WriteBytesExt};

use crate::mesh::IndexedMesh;

/// The type of the coordinates in a file; in text, the one to which its decimals are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Precision {
    /// binary32, to the nearest.
    Float32,
    /// binary64, exactly.
    Float64,
}

/// Writes a binary little-endian PLY file, indices as `list uchar int`.
///
/// # Errors
/// What `out` says; [`io::ErrorKind::InvalidInput`] where a coordinate is not finite in the wanted precision.
pub fn write_ply(mesh: &IndexedMesh, precision: Precision, out: &mut impl Write) -> io::Result<()> {
    let mut out = BufWriter::new(out);
    let real = match precision {
        Precision::Float32 => "float",
        Precision::Float64 => "double",
    };
    let (vertices, faces) = (mesh.positions.len(), mesh.triangles.len());
    write!(
        out,
        "ply\nformat binary_little_endian 1.0\n\
         element vertex {vertices}\nproperty {real} x\nproperty {real} y\nproperty {real} z\n\
         element face {faces}\nproperty list uchar int vertex_indices\nend_header\n"
    )?;
    for &x in mesh.positions.iter().flatten() {
        match precision {
            Precision::Float32 => {
                finite(f64::from(x as f32), x)?;
                out.write_f32::<LittleEndian>(x as f32)?;
            }
            Precision::Float64 => out.write_f64::<LittleEndian>(finite(x, x)?)?,
        }
    }
    for triangle in &mesh.triangles {
        let mut face = [3; 13];
        for (bytes, v) in face[1..].chunks_exact_mut(4).zip(triangle) {
            LittleEndian::write_u32(bytes, *v);
        }
        out.write_all(&face)?;
    }
    out.flush()
}

/// Writes an OBJ file, each coordinate as the shortest decimal that reads back exactly in the precision: 0.1 is
/// 0.1 in binary32, and 0.10000000149011612 in binary64.
///
/// # Errors
/// What `out` says; [`io::ErrorKind::InvalidInput`] where a coordinate is not finite in the wanted precision.
pub fn write_obj(mesh: &IndexedMesh, precision: Precision, out: &mut impl Write) -> io::Result<()> {
    let mut out = BufWriter::new(out);
    for &position in &mesh.positions {
        out.write_all(b"v")?;
        for x in position {
            let small = x as f32;
            match precision {
                Precision::Float32 => finite(f64::from(small), x)?,
                Precision::Float64 => finite(x, x)?,
            };
            // Display never uses an exponent: 300 zeros for 1e300.
            let plain = x == 0.0 || (1e-4..1e16).contains(&x.abs());
            match precision {
                Precision::Float32 if plain => write!(out, " {small}")?,
                Precision::Float32 => write!(out, " {small:e}")?,
                Precision::Float64 if plain => write!(out, " {x}")?,
                Precision::Float64 => write!(out, " {x:e}")?,
            }
        }
        out.write_all(b"\n")?;
    }
    for &triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|v| u64::from(v) + 1);
        writeln!(out, "f {a} {b} {c}")?;
    }
    out.flush()
}

/// Writes a binary STL file: three corners a triangle, as binary32, to the nearest. Vertices that triangles share are
/// repeated, those of no triangle are left out. Normals follow from the corners (0 where they are in one line).
///
/// # Errors
/// What `out` says; [`io::ErrorKind::InvalidInput`] where a coordinate is not finite in binary32, or there are more
/// than 2^32 - 1 triangles.
pub fn write_stl(mesh: &IndexedMesh, out: &mut impl Write) -> io::Result<()> {
    let mut out = BufWriter::new(out);
    let triangles = u32::try_from(mesh.triangles.len()).map_err(|_| {
        io::Error::new(io::ErrorKind::InvalidInput, "an STL file has at most 2^32 - 1 triangles")
    })?;
    // Not `solid`, by which some readers know a text file.
    out.write_all(&[b' '; 80])?;
    out.write_u32::<LittleEndian>(triangles)?;
    for triangle in &mesh.triangles {
        let mut facet = [0; 50];
        let corners = triangle.map(|v| mesh.positions[v as usize]);
        let (normal, numbers) = facet.split_at_mut(12);
        for (bytes, &x) in numbers.chunks_exact_mut(4).zip(corners.as_flattened()) {
            finite(f64::from(x as f32), x)?;
            LittleEndian::write_f32(bytes, x as f32);
        }
        for (bytes, x) in normal.chunks_exact_mut(4).zip(unit_normal(corners)) {
            LittleEndian::write_f32(bytes, x as f32);
        }
        out.write_all(&facet)?;
    }
    out.flush()
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
fn finite(stored: f64, x: f64) -> io::Result<f64> {
    if stored.is_finite() {
        return Ok(stored);
    }
    Err(io::Error::new(
        io::ErrorKind::InvalidInput,
        format!("the coordinate {x} is not finite in the file's precision"),
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

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
