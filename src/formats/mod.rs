//! Foreign meshes in and out: PLY, OBJ, STL and OFF; OFF is only read.
//!
//! The readers keep positions and connectivity; whatever else a file carries is named in [`Source::dropped`].
//! They keep every vertex and every triangle, also those that make no sense as a surface: telling a manifold
//! from a heap of triangles is not their business. What cannot be a mesh (an index out of range, a coordinate that
//! is not finite, data that end early) is an error that tells its line or byte.
//!
//! The readers are our own since none that we found tells where a file is at fault, or refuses all that cannot be a mesh,
//! as fast. Seconds of processor time (and memory at the peak, the file included) for 7 million triangles, measured on one
//! machine: binary PLY 0.7 (0.3 GB; ply-rs-bw 4.0: 13 and 4.3 GB), text PLY 2.4, OBJ 2.1 (0.5 GB; tobj 4.0: 6.0 and
//! 1.0 GB, binary32 alone, errors without a line), OFF 2.5, binary STL 1.2 (0.9 GB; stl_io 0.11: 3.7, welded, errors without
//! a place), text STL 8.0 (1.9 GB; stl_io: 25). off-rs 2.0 takes indices out of range and coordinates that are no numbers.

use std::path::Path;

use crate::error::{Error, InputError, Place, Result};
use crate::limits::MAX_ELEMENTS;
use crate::mesh::IndexedMesh;

mod fan;
mod gzip;
mod obj;
mod off;
mod ply;
mod ply_header;
mod ply_values;
mod stl;
mod text;
mod write;

pub use write::{Precision, write_obj, write_ply, write_stl};

/// A foreign mesh format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Polygon File Format (Stanford, G. Turk 1994): ascii, binary little endian, binary big endian.
    Ply,
    /// Wavefront OBJ, its polygonal part.
    Obj,
    /// STL (3D Systems): text and binary.
    Stl,
    /// OFF (Geomview): text and binary, points of three coordinates.
    Off,
}

impl Format {
    /// The format a file's name tells: `.ply`, `.obj`, `.stl` or `.off`, in any case, `.gz` behind it or not.
    pub fn from_path(path: &Path) -> Option<Self> {
        let extension = |p: &Path| p.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
        let told = match extension(path).as_deref() {
            Some("gz") => extension(path.file_stem()?.as_ref()),
            told => told.map(str::to_owned),
        };
        match told?.as_str() {
            "ply" => Some(Self::Ply),
            "obj" => Some(Self::Obj),
            "stl" => Some(Self::Stl),
            "off" => Some(Self::Off),
            _ => None,
        }
    }

    /// The format the (inflated) content tells: PLY begins with a line `ply`; STL with `solid`, or else its length is the
    /// one that its number of facets asks for; OFF begins with its keyword, and OBJ, which is text, with nothing in particular.
    pub fn sniff(bytes: &[u8]) -> Option<Self> {
        match bytes {
            [b'p', b'l', b'y', b'\r' | b'\n', ..] => Some(Self::Ply),
            _ if stl::is_stl(bytes) => Some(Self::Stl),
            _ if off::is_off(bytes) => Some(Self::Off),
            _ => text::is_text(bytes).then_some(Self::Obj),
        }
    }
}

/// The type a file declares its coordinates to have. Integers count as the smallest floating-point type that holds them all.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coordinates {
    /// binary32 or 8- and 16-bit integers: every coordinate of the mesh is a binary32 number.
    Float32,
    /// binary64 or 32-bit integers, on at least one axis.
    Float64,
    /// Decimal text of no declared type, read to the nearest binary64.
    Text,
}

/// What a foreign file held.
#[derive(Clone, Debug, PartialEq)]
pub struct Source {
    /// All vertices and triangles, in the order of the file; polygons as fans from the first corner.
    pub mesh: IndexedMesh,
    /// The file's format.
    pub format: Format,
    /// How many faces had more than three sides and became fans.
    pub polygons: usize,
    /// The type the file declares its coordinates to have. Text is read to the nearest number of that type.
    pub coordinates: Coordinates,
    /// Whether the file has its numbers as decimal text.
    pub text: bool,
    /// What the file carried and the mesh does not, in words for the user, e.g. `"materials (2)"`.
    pub dropped: Vec<String>,
}

/// Reads the file at `path`, inflating it if it is gzip-compressed, whatever its name says.
/// The extension tells the format, or else the content.
///
/// # Errors
/// [`Error::Io`], with the path in its text, and whatever [`read_bytes`] says.
pub fn read(path: &Path) -> Result<Source> {
    let name = path.display().to_string();
    let bytes = std::fs::read(path).map_err(|e| std::io::Error::new(e.kind(), format!("{name}: {e}")))?;
    read_bytes(&bytes, Format::from_path(path), &name)
}

/// Reads a mesh from memory, inflating it if it is gzip-compressed. Without a `hint` the content tells the format.
/// `name` is the file as the user knows it, for error messages; it may be empty.
///
/// # Errors
/// [`Error::Input`] with the line (text) or the byte of the inflated data (binary) where the file is at fault, or for the
/// file as a whole where it holds no triangle; [`Error::Limit`] above [`MAX_ELEMENTS`] vertices or triangles, or
/// where the inflated size is out of reason.
pub fn read_bytes(bytes: &[u8], hint: Option<Format>, name: &str) -> Result<Source> {
    let inflated =
        if gzip::is_gzip(bytes) { Some(gzip::inflate(bytes, MAX_INFLATED_BYTES, name)?) } else { None };
    let bytes = inflated.as_deref().unwrap_or(bytes);
    let whole = |what: &str| InputError::new(name, Place::Whole, what);
    if bytes.is_empty() {
        return Err(whole("the file is empty").into());
    }
    let format = hint.or_else(|| Format::sniff(bytes));
    let unknown = || whole("the content is of no known format: PLY, OBJ, STL, OFF");
    let mut source = match format.ok_or_else(unknown)? {
        Format::Ply => ply::read(bytes, name)?,
        Format::Obj => obj::read(bytes, name)?,
        Format::Stl => stl::read(bytes, name)?,
        Format::Off => off::read(bytes, name)?,
    };
    match source.mesh.positions.len() {
        _ if !source.mesh.triangles.is_empty() => {}
        0 => return Err(whole("no triangles").into()),
        vertices => return Err(whole(&format!("no triangles, only vertices ({vertices})")).into()),
    }
    if source.polygons > 0 {
        source.dropped.push(format!("polygons ({}, cut into triangles)", source.polygons));
    }
    limit("vertices", source.mesh.positions.len())?;
    limit("triangles", source.mesh.triangles.len())?;
    Ok(source)
}

/// The error with the part of the file that it is in.
fn within(error: Error, part: &str) -> Error {
    match error {
        Error::Input(mut e) => {
            e.what = format!("{} ({part})", e.what);
            e.into()
        }
        other => other,
    }
}

/// Memory is spent in proportion to the file, so it is enough to look at the counts once, at the end.
fn limit(what: &'static str, count: usize) -> Result<()> {
    let (needed, allowed) = (count as u64, u64::from(MAX_ELEMENTS));
    if needed > allowed { Err(Error::Limit { what, needed, allowed }) } else { Ok(()) }
}

/// Most bytes a compressed file may inflate to: 64 GiB.
const MAX_INFLATED_BYTES: u64 = 1 << 36;

#[cfg(test)]
mod tests {
    use super::*;
    use flate2::{Compression, write::GzEncoder};
    use proptest::prelude::*;
    use std::io::Write;

    const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

    fn zipped(bytes: &[u8]) -> Vec<u8> {
        let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
        encoder.write_all(bytes).unwrap();
        encoder.finish().unwrap()
    }

    fn input_error(result: Result<Source>) -> InputError {
        match result {
            Err(Error::Input(e)) => e,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn the_name_tells_the_format() {
        let told = |name: &str| Format::from_path(Path::new(name));
        assert_eq!(told("a/b.PLY"), Some(Format::Ply));
        assert_eq!(told("b.ply.gz"), Some(Format::Ply));
        assert_eq!(told("b.ply/c.Obj.GZ"), Some(Format::Obj));
        assert_eq!((told("b.STL"), told("b.stl.gz")), (Some(Format::Stl), Some(Format::Stl)));
        assert_eq!(told("c.off"), Some(Format::Off));
        for name in ["b.glb", "b.gz", ".ply", "ply", "b.ply/c", "b.gz.gz", ""] {
            assert_eq!(told(name), None, "{name}");
        }
    }

    #[test]
    fn the_content_tells_the_format() {
        let mut facets = vec![0; 84 + 50];
        facets[80] = 1;
        for (bytes, format) in [
            (&b"ply\nformat"[..], Some(Format::Ply)),
            (b"ply\rformat", Some(Format::Ply)),
            (b"plywood", Some(Format::Obj)),
            (b"solid", Some(Format::Stl)),
            (b"\n SOLID x\n", Some(Format::Stl)),
            (b"solids x\n", Some(Format::Obj)),
            (&facets, Some(Format::Stl)),
            (&facets[..133], None),
            (b"solid \0", None),
            (b"# c\nCOFF\n", Some(Format::Off)),
            (b"# c\nv 1 2 3\n", Some(Format::Obj)),
            (b"glTF\x02\0\0\0", None),
        ] {
            assert_eq!(Format::sniff(bytes), format, "{bytes:?}");
        }
        let none = "the content is of no known format: PLY, OBJ, STL, OFF";
        assert_eq!(input_error(read_bytes(b"\0\x01", None, "n")), InputError::new("n", Place::Whole, none));
        assert_eq!(read_bytes(TRIANGLE.as_bytes(), None, "").unwrap().format, Format::Obj);
    }

    #[test]
    fn gzip_is_seen_by_its_content() {
        let plain = read_bytes(TRIANGLE.as_bytes(), None, "").unwrap();
        assert_eq!(read_bytes(&zipped(TRIANGLE.as_bytes()), None, "").unwrap(), plain);
        let two_members = [zipped(&TRIANGLE.as_bytes()[..10]), zipped(&TRIANGLE.as_bytes()[10..])].concat();
        assert_eq!(read_bytes(&two_members, Some(Format::Obj), "").unwrap(), plain);
    }

    #[test]
    fn nothing_in_it() {
        let says = |what: &str, bytes: &[u8], hint| {
            let expected = InputError::new("n", Place::Whole, what);
            assert_eq!(input_error(read_bytes(bytes, hint, "n")), expected, "{bytes:?}");
        };
        for format in [None, Some(Format::Ply), Some(Format::Obj), Some(Format::Stl), Some(Format::Off)] {
            says("the file is empty", b"", format);
            says("the file is empty", &zipped(b""), format);
        }
        says("no triangles", b"# empty\n", None);
        says("no triangles", b"ply\nformat ascii 1.0\nend_header\n", None);
        says("no triangles", b"solid a\nendsolid a\n", None);
        says("no triangles", &[0; 84], None);
        says("no triangles", b"OFF\n0 0 0\n", None);
        says("no triangles, only vertices (1)", b"v 1 2 3\nf 1 1\n", None);
        says("no triangles, only vertices (1)", b"OFF 1 1 0\n1 2 3\n2 0 0\n", None);
    }

    #[test]
    fn a_missing_file_is_named() {
        let error = read(Path::new("/nowhere/at all.obj")).unwrap_err();
        assert!(matches!(error, Error::Io(_)));
        assert!(error.to_string().starts_with("/nowhere/at all.obj: "));
    }

    proptest! {
        #[test]
        fn what_is_written_is_read(
            positions in prop::collection::vec(prop::array::uniform3(-1e300f64..1e300), 1..20),
            seeds in prop::collection::vec(any::<[prop::sample::Index; 3]>(), 1..30),
        ) {
            let n = positions.len();
            let mesh = IndexedMesh::new(positions, seeds.iter().map(|t| t.map(|i| i.index(n) as u32)).collect());
            let (mut ply, mut obj) = (Vec::new(), Vec::new());
            write_ply(&mesh, Precision::Float64, &mut ply).unwrap();
            write_obj(&mesh, &mut obj).unwrap();
            for (bytes, format, coordinates, text) in
                [(ply, Format::Ply, Coordinates::Float64, false), (obj, Format::Obj, Coordinates::Text, true)]
            {
                let source = read_bytes(&bytes, None, "").unwrap();
                prop_assert_eq!(
                    source,
                    Source { mesh: mesh.clone(), format, polygons: 0, coordinates, text, dropped: vec![] }
                );
            }
        }

        #[test]
        fn any_finite_number_survives_exactly(bits in any::<[u64; 3]>()) {
            let p = bits.map(f64::from_bits).map(|x| if x.is_finite() { x } else { -0.0 });
            let mesh = IndexedMesh::new(vec![p], vec![[0; 3]]);
            let (mut ply, mut obj, mut small) = (Vec::new(), Vec::new(), Vec::new());
            write_ply(&mesh, Precision::Float64, &mut ply).unwrap();
            write_obj(&mesh, &mut obj).unwrap();
            for bytes in [ply, obj] {
                let back = read_bytes(&bytes, None, "").unwrap().mesh.positions[0];
                prop_assert_eq!(back.map(f64::to_bits), p.map(f64::to_bits));
            }

            let p = bits.map(|b| f32::from_bits(b as u32)).map(|x| if x.is_finite() { x } else { -0.0 });
            let mesh = IndexedMesh::new(vec![p.map(f64::from)], vec![[0; 3]]);
            write_ply(&mesh, Precision::Float32, &mut small).unwrap();
            let back = read_bytes(&small, None, "").unwrap();
            prop_assert_eq!(back.coordinates, Coordinates::Float32);
            prop_assert_eq!(back.mesh.positions[0].map(|x| (x as f32).to_bits()), p.map(f32::to_bits));
        }

        #[test]
        fn bytes_that_mean_nothing_do_no_harm(
            bytes in prop::collection::vec(any::<u8>(), 0..200),
            text in "([vf#glp\\\\ /.0-9\n\r-]|v 1 2 3\n|f 1 2 3|OFF 3 1|3 0 1 2|solid|vertex 1 2 3){0,40}",
            format in prop::sample::select(vec![Format::Ply, Format::Obj, Format::Stl, Format::Off]),
        ) {
            let hint = Some(format);
            for bytes in [&bytes[..], text.as_bytes()] {
                if let Ok(source) = read_bytes(bytes, hint, "") {
                    let n = source.mesh.positions.len() as u32;
                    prop_assert!(source.mesh.triangles.iter().flatten().all(|&v| v < n));
                }
            }
        }
    }
}
