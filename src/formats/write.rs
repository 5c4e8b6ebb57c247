//! Writes PLY and OBJ: positions and triangles.

use std::io::{self, BufWriter, Write};

use crate::mesh::IndexedMesh;

/// The type of the coordinates in a PLY file.
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
                out.write_all(&(x as f32).to_le_bytes())?;
            }
            Precision::Float64 => out.write_all(&finite(x, x)?.to_le_bytes())?,
        }
    }
    for triangle in &mesh.triangles {
        let mut face = [3; 13];
        for (bytes, v) in face[1..].chunks_exact_mut(4).zip(triangle) {
            bytes.copy_from_slice(&v.to_le_bytes());
        }
        out.write_all(&face)?;
    }
    out.flush()
}

/// Writes an OBJ file, each coordinate as the shortest decimal that reads back exactly as binary64.
///
/// # Errors
/// What `out` says; [`io::ErrorKind::InvalidInput`] where a coordinate is not finite.
pub fn write_obj(mesh: &IndexedMesh, out: &mut impl Write) -> io::Result<()> {
    let mut out = BufWriter::new(out);
    for &position in &mesh.positions {
        out.write_all(b"v")?;
        for x in position {
            // Display never uses an exponent: 300 zeros for 1e300.
            if x == 0.0 || (1e-4..1e16).contains(&finite(x, x)?.abs()) {
                write!(out, " {x}")?;
            } else {
                write!(out, " {x:e}")?;
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
        write_obj(&mesh(), &mut text).unwrap();
        let expected = "v 0 -0 1\nv 0.1 1e300 -2.5e-7\nv 123456.75 5e-324 9\nf 1 2 3\n";
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
    fn what_would_not_read_back_is_refused() {
        let kind = |r: io::Result<()>| r.unwrap_err().kind();
        let mut mesh = mesh();
        assert_eq!(kind(write_ply(&mesh, Precision::Float32, &mut io::sink())), io::ErrorKind::InvalidInput);
        write_ply(&mesh, Precision::Float64, &mut io::sink()).unwrap();
        mesh.positions[0][0] = f64::NAN;
        assert_eq!(kind(write_ply(&mesh, Precision::Float64, &mut io::sink())), io::ErrorKind::InvalidInput);
        assert_eq!(kind(write_obj(&mesh, &mut io::sink())), io::ErrorKind::InvalidInput);
    }
}
