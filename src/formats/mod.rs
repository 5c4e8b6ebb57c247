//! Foreign meshes in and out: PLY, OBJ, STL, OFF and glTF; OFF is only read.
//!
//! The readers keep positions, connectivity and attributes; whatever else a file carries is named in [`Source::dropped`].
//! They keep every vertex and every triangle, also those that make no sense as a surface: telling a manifold
//! from a heap of triangles is not their business. What cannot be a mesh (an index out of range, a coordinate that
//! is not finite, data that end early) is an error that tells its line or byte.
//!
//! The readers are our own since none that we found tells where a file is at fault, or refuses all that cannot be a mesh,
//! as fast. Seconds of processor time (and memory at the peak, the file included) for 7 million triangles, measured on one
//! machine: binary PLY 0.7 (0.3 GB; ply-rs-bw 4.0: 13 and 4.3 GB), text PLY 2.4, OBJ 2.1 (0.5 GB; tobj 4.0: 6.0 and
//! 1.0 GB, binary32 alone, errors without a line), OFF 2.5, binary STL 1.2 (0.9 GB; stl_io 0.11: 3.7, welded, errors without
//! a place), text STL 8.0 (1.9 GB; stl_io: 25). off-rs 2.0 takes indices out of range and coordinates that are no numbers.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use crate::error::{Error, InputError, Place, Result};
use crate::limits::MAX_ELEMENTS;
use crate::mesh::{IndexedMesh, Paint};

mod decimals;
mod ears;
mod fan;
mod foreign;
mod gather;
mod gltf;
mod gzip;
mod materials;
mod obj;
mod obj_dropped;
mod obj_parts;
mod obj_values;
mod obj_write;
mod obstacles;
mod off;
mod off_beside;
mod origins;
mod painted;
mod ply;
mod ply_columns;
mod ply_faces;
mod ply_header;
mod ply_values;
mod ply_write;
mod scene;
mod stl;
mod stl_colours;
mod stl_text;
mod stl_write;
mod text;
mod write;

#[cfg(feature = "encode")]
pub use gltf::sample_scene;
pub use gltf::{
    File, GltfFiles, Lighter, SceneOptions, Texture, gltf_files, in_bodies, lighter, placed,
    textured_gltf_files, turn_v, write_glb, write_levels_of_detail, write_progressive, write_scene,
    write_textured_glb,
};
pub use gzip::INFLATED_BYTES;
pub use materials::material_library;
pub use obj_write::write_obj;
pub use painted::read_image;
pub use ply_write::write_ply;
pub use scene::{Role, Scene, SceneBuffer};
pub use stl_write::write_stl;
pub use write::{Precision, unwritten};

/// A foreign mesh format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Format {
    /// Polygon File Format (Stanford, G. Turk 1994): ascii, binary little endian, binary big endian.
    Ply,
    /// Wavefront OBJ, its polygonal part.
    Obj,
    /// STL (3D Systems): text and binary.
    Stl,
    /// OFF (Geomview): text and binary, points of three coordinates.
    Off,
    /// glTF 2.0 (Khronos): binary, or text with its buffers in it or beside it.
    Gltf,
}

impl Format {
    /// The format a file's name tells: `.ply`, `.obj`, `.stl`, `.off`, `.glb` or `.gltf`, in any case, `.gz` behind it or not.
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
            "glb" | "gltf" => Some(Self::Gltf),
            _ => None,
        }
    }

    /// What it is called.
    fn name(self) -> &'static str {
        match self {
            Self::Ply => "PLY",
            Self::Obj => "OBJ",
            Self::Stl => "STL",
            Self::Off => "OFF",
            Self::Gltf => "glTF",
        }
    }

    /// The format the (inflated) content tells: PLY begins with a line `ply`; STL with `solid` (or a facet), or else its length is the
    /// one that its number of facets asks for; OFF begins with its keyword, glTF with its own
    /// or with an object of JSON, and OBJ, which is text, with nothing in particular.
    pub fn sniff(bytes: &[u8]) -> Option<Self> {
        match () {
            _ if ply_header::is_ply(bytes) => Some(Self::Ply),
            _ if stl::is_stl(bytes) => Some(Self::Stl),
            _ if off::is_off(bytes) => Some(Self::Off),
            _ if gltf::is_gltf(bytes) => Some(Self::Gltf),
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
    /// All vertices and triangles, in the order of the file. A polygon of n corners is n - 2 triangles: a fan from its first corner where none
    /// of that turns against the polygon's normal, which is so where it is convex; else its ears, so that they cover what it goes round.
    pub mesh: IndexedMesh,
    /// The file's format.
    pub format: Format,
    /// How many faces had more than three sides and were cut.
    pub polygons: usize,
    /// The type the file declares its coordinates to have. Text is read to the nearest number of that type.
    pub coordinates: Coordinates,
    /// Whether the file has its numbers as decimal text.
    pub text: bool,
    /// What the file carried and the mesh does not, in words for the user, e.g. `"line elements (2)"`.
    pub dropped: Vec<String>,
    /// What the user may not have expected and is no loss, in words.
    pub remarks: Vec<String>,
    /// What the file is beside its mesh, where it is a scene and was read as one ([`ReadOptions::scenes`]).
    pub scene: Option<Scene>,
    /// For sets of texture coordinates, how far apart, in these coordinates, the texels are of the finest picture that a scene lays on
    /// triangles by them, as far as its images are there and tell their pixels.
    pub texels: BTreeMap<u32, f64>,
}

impl Source {
    /// A mesh of triangles in binary numbers, of which nothing was lost, and nothing else.
    pub fn new(mesh: IndexedMesh, format: Format, coordinates: Coordinates) -> Self {
        Self {
            mesh,
            format,
            polygons: 0,
            coordinates,
            text: false,
            dropped: Vec::new(),
            remarks: Vec::new(),
            scene: None,
            texels: BTreeMap::new(),
        }
    }
}

/// How to read a mesh.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct ReadOptions {
    /// The format; the content tells it where this is `None`.
    pub format: Option<Format>,
    /// The file as the user knows it, for error messages; it may be empty.
    pub name: String,
    /// Most bytes that a gzip-compressed file may inflate to, and that a glTF file's buffers and all that is read of them may take; 64 GiB by
    /// default. What is read of a file of another kind takes about as much again.
    pub max_memory: u64,
    /// Where the files lie that a glTF names, and the materials and pictures of others, none of which are read where this is `None`; [`read`] takes the folder of the file.
    pub folder: Option<PathBuf>,
    /// Whether to read what contradicts itself, as far as it can be read: a binary STL file by its length where that is not what its count of
    /// facets asks for, a text STL file whose last solid does not end. Not by default.
    pub force: bool,
    /// Whether a glTF stays a scene: each of its meshes once, in its own coordinates times a power of two, as parts of one mesh, and beside it
    /// all else that the file has ([`Source::scene`]). Otherwise it is one mesh of all that is shown, where it is shown. Not by default.
    pub scenes: bool,
    /// Which level of detail of a glTF is read as one mesh, where its nodes have coarser ones that may stand in their place (`MSFT_lod`): 0 for the nodes
    /// themselves. Where it is given, all of [`levels_of_detail`] are to be read, and what another one shows is not told as dropped.
    pub detail: Option<usize>,
}

impl Default for ReadOptions {
    fn default() -> Self {
        Self {
            format: None,
            name: String::new(),
            max_memory: 1 << 36,
            folder: None,
            force: false,
            scenes: false,
            detail: None,
        }
    }
}

/// Reads the file at `path`, inflating it if it is gzip-compressed, whatever its name says.
/// The extension tells the format, or else the content.
///
/// # Errors
/// [`Error::Io`], with the path in its text, and whatever [`read_bytes`] says.
pub fn read(path: &Path) -> Result<Source> {
    let name = path.display().to_string();
    let bytes = std::fs::read(path).map_err(|e| std::io::Error::new(e.kind(), format!("{name}: {e}")))?;
    let folder = path.parent().map(Path::to_owned);
    read_with(
        &bytes,
        &ReadOptions { format: Format::from_path(path), name, folder, ..ReadOptions::default() },
    )
}

/// Reads a mesh from memory, inflating it if it is gzip-compressed. Without a `hint` the content tells the format.
/// `name` is the file as the user knows it, for error messages; it may be empty.
///
/// # Errors
/// As [`read_with`].
pub fn read_bytes(bytes: &[u8], hint: Option<Format>, name: &str) -> Result<Source> {
    read_with(bytes, &ReadOptions { format: hint, name: name.to_owned(), ..ReadOptions::default() })
}

/// Reads a mesh from memory, inflating it if it is gzip-compressed.
///
/// # Errors
/// [`Error::Input`] with the line (text) or the byte of the inflated data (binary) where the file is at fault, or for the
/// file as a whole where it holds no triangle; where it is a file of another kind, that is said instead. [`Error::Limit`]
/// above [`MAX_ELEMENTS`] vertices or triangles, or where the inflated size is beyond the limit.
pub fn read_with(bytes: &[u8], options: &ReadOptions) -> Result<Source> {
    read_as(bytes, options, None)
}

/// As [`read_with`], of a mesh to be drawn, and what it is painted with: a glTF that is read as one mesh tells that by its materials, an OBJ by
/// those of its libraries, a PLY by its `TextureFile`s. Pictures of them are decoded with the feature `images`; those that cannot be are told in [`Source::remarks`].
/// Texture coordinates of a glTF stay as it has them: (0, 0) is the first pixel of a picture's first row; those of others are turned by
/// [`Material::transform`](crate::mesh::paint::Material::transform).
///
/// # Errors
/// As [`read_with`].
pub fn read_painted(bytes: &[u8], options: &ReadOptions) -> Result<(Source, Paint)> {
    let mut paint = Paint::default();
    let source = read_as(bytes, options, Some(&mut paint))?;
    Ok((source, paint))
}

/// How many levels of detail a glTF's nodes have by the extension `MSFT_lod`, themselves among them; 1 of any other file.
///
/// # Errors
/// As [`read_with`], where the document is at fault.
pub fn levels_of_detail(bytes: &[u8], options: &ReadOptions) -> Result<usize> {
    let name = &options.name;
    let inflated =
        if gzip::is_gzip(bytes) { Some(gzip::inflate(bytes, options.max_memory, name)?) } else { None };
    let bytes = inflated.as_deref().unwrap_or(bytes);
    if !gltf::is_gltf(bytes) {
        return Ok(1);
    }
    gltf::levels_of_detail(bytes, options)
}

fn read_as(bytes: &[u8], options: &ReadOptions, paint: Option<&mut Paint>) -> Result<Source> {
    let name = &options.name;
    let inflated =
        if gzip::is_gzip(bytes) { Some(gzip::inflate(bytes, options.max_memory, name)?) } else { None };
    let bytes = inflated.as_deref().unwrap_or(bytes);
    let outcome = read_inflated(bytes, options, paint);
    match outcome {
        Err(Error::Input(fault)) => Err(misnamed(bytes, options).unwrap_or(fault).into()),
        outcome => outcome,
    }
}

fn read_inflated(bytes: &[u8], options: &ReadOptions, paint: Option<&mut Paint>) -> Result<Source> {
    let name = &options.name[..];
    let whole = |what: &str| InputError::new(name, Place::Whole, what);
    if bytes.is_empty() {
        return Err(whole("the file is empty").into());
    }
    let format = options.format.or_else(|| Format::sniff(bytes));
    let unknown = || whole("the content is of no known format: PLY, OBJ, STL, OFF, glTF");
    let format = format.ok_or_else(unknown)?;
    let mut paint = paint;
    let mut source = match format {
        Format::Ply => ply::read(bytes, name)?,
        Format::Obj => obj::read(bytes, name, options.force)?,
        Format::Stl => stl::read(bytes, name, options.force)?,
        Format::Off => off::read(bytes, name)?,
        Format::Gltf => gltf::read(bytes, options, paint.take())?,
    };
    if let Some(paint) = paint {
        *paint = painted::paint(&source, options)?;
        source.remarks.extend_from_slice(&paint.missing);
    }
    match source.mesh.positions.len() {
        _ if !source.mesh.triangles.is_empty() => {}
        // Its points and lines are in the scene.
        _ if source.scene.is_some() => {}
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

/// What there is to say of a file that cannot be read since it is of another kind.
fn misnamed(bytes: &[u8], options: &ReadOptions) -> Option<InputError> {
    let place = if text::is_text(bytes) { Place::Line(1) } else { Place::Byte(0) };
    let says = |what: String| Some(InputError::new(&options.name, place, what));
    // The parts of a glTF may look like something else.
    if let Some(what) = foreign::named(bytes).filter(|_| !gltf::is_gltf(bytes)) {
        return says(format!("this is {what}; PLY, OBJ, STL, OFF and glTF are read"));
    }
    // That it may be OBJ is said of all text.
    let told = Format::sniff(bytes).filter(|format| !matches!(format, Format::Obj))?;
    let expected = options.format.filter(|format| *format != told)?;
    says(format!("this is {}, not {}, by what it begins with", told.name(), expected.name()))
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
        assert_eq!((told("c.glb"), told("c.GLTF.gz")), (Some(Format::Gltf), Some(Format::Gltf)));
        for name in ["b.glbx", "b.gz", ".ply", "ply", "b.ply/c", "b.gz.gz", ""] {
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
            (b"\xef\xbb\xbfply \r\nformat", Some(Format::Ply)),
            (b"facet normal 0 0 1", Some(Format::Stl)),
            (b"plywood", Some(Format::Obj)),
            (b"solid", Some(Format::Stl)),
            (b"\n SOLID x\n", Some(Format::Stl)),
            (b"solids x\n", Some(Format::Obj)),
            (&facets, Some(Format::Stl)),
            (&facets[..133], None),
            (b"solid \0x", None),
            (b"# c\nCOFF\n", Some(Format::Off)),
            (b"# c\nv 1 2 3\n", Some(Format::Obj)),
            (b"glTF\x02\0\0\0", Some(Format::Gltf)),
            (b" {\n\"asset\": {\"version\": \"2.0\"}}", Some(Format::Gltf)),
            (b"\xef\xbb\xbf{\"accessors\": []", Some(Format::Gltf)),
            (b"{\"assets\": 1}", Some(Format::Obj)),
        ] {
            assert_eq!(Format::sniff(bytes), format, "{bytes:?}");
        }
        let none = "the content is of no known format: PLY, OBJ, STL, OFF, glTF";
        assert_eq!(input_error(read_bytes(b"\0\x01", None, "n")), InputError::new("n", Place::Whole, none));
        assert_eq!(read_bytes(TRIANGLE.as_bytes(), None, "").unwrap().format, Format::Obj);
    }

    #[test]
    fn files_of_other_kinds_are_named() {
        let all = [Format::Ply, Format::Obj, Format::Stl, Format::Off, Format::Gltf].map(Some);
        let all = [&[None], &all[..]].concat();
        let long = |first: &str| [first.as_bytes(), &[b'\n'; 200]].concat();
        for (bytes, place, what) in [
            (b"DRACO\x02\x02\x01\x01\0\0 and so on, for more bytes than the header of an STL file has, which is 84".to_vec(), Place::Byte(0), "a Draco file"),
            (long("<!doctype html>"), Place::Line(1), "an HTML page"),
            (long("{\"type\":\"FeatureCollection\"}"), Place::Line(1), "JSON"),
            (b"P\0K\0-\0u\0t\0f\0".to_vec(), Place::Byte(0), "text in UTF-16, not in UTF-8"),
        ] {
            let what = format!("this is {what}; PLY, OBJ, STL, OFF and glTF are read");
            for &hint in &all {
                let expected = InputError::new("n", place, &what[..]);
                assert_eq!(input_error(read_bytes(&bytes, hint, "n")), expected);
                assert_eq!(input_error(read_bytes(&zipped(&bytes), hint, "n")), expected);
            }
        }
        let error =
            input_error(read_bytes(b"OFF\n3 1 0\n0 0 0 1 0 0 0 1 0 3 0 1 2\n", Some(Format::Stl), "n"));
        assert_eq!(error.to_string(), "n: line 1: this is OFF, not STL, by what it begins with");
        let error = input_error(read_bytes(b"{\"asset\": {\"version\": \"2.0\"}}", Some(Format::Obj), "n"));
        assert_eq!(error.to_string(), "n: line 1: this is glTF, not OBJ, by what it begins with");
        // What can be read is read, whatever it begins with.
        let odd = format!("#usda\n{TRIANGLE}");
        assert_eq!(read_bytes(odd.as_bytes(), Some(Format::Obj), "").unwrap().mesh.triangles.len(), 1);
    }

    #[test]
    fn the_inflated_size_is_limited() {
        let bomb = zipped(&[TRIANGLE.as_bytes(), &[b'#'; 1 << 20]].concat());
        let with = |max_memory| read_with(&bomb, &ReadOptions { max_memory, ..ReadOptions::default() });
        assert!(matches!(with(100_000), Err(Error::Limit { allowed: 100_000, .. })));
        assert_eq!(with(2 << 20).unwrap().mesh.triangles.len(), 1);
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
        let all = [Format::Ply, Format::Obj, Format::Stl, Format::Off, Format::Gltf].map(Some);
        for format in all.into_iter().chain([None]) {
            says("the file is empty", b"", format);
            says("the file is empty", &zipped(b""), format);
        }
        says("no triangles", b"# empty\n", None);
        says("no triangles", b"ply\nformat ascii 1.0\nend_header\n", None);
        says("no triangles", b"solid a\nendsolid a\n", None);
        says("no triangles", &[0; 84], None);
        says("no triangles", b"OFF\n0 0 0\n", None);
        says("no triangles", b"{\"asset\": {\"version\": \"2.0\"}}", None);
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
            write_obj(&mesh, Precision::Float64, &mut obj).unwrap();
            for (bytes, format, coordinates, text) in
                [(ply, Format::Ply, Coordinates::Float64, false), (obj, Format::Obj, Coordinates::Text, true)]
            {
                let source = read_bytes(&bytes, None, "").unwrap();
                prop_assert_eq!(
                    source,
                    Source { text, ..Source::new(mesh.clone(), format, coordinates) }
                );
            }
        }

        #[test]
        fn any_finite_number_survives_exactly(bits in any::<[u64; 3]>()) {
            let p = bits.map(f64::from_bits).map(|x| if x.is_finite() { x } else { -0.0 });
            let mesh = IndexedMesh::new(vec![p], vec![[0; 3]]);
            let (mut ply, mut obj, mut small) = (Vec::new(), Vec::new(), Vec::new());
            write_ply(&mesh, Precision::Float64, &mut ply).unwrap();
            write_obj(&mesh, Precision::Float64, &mut obj).unwrap();
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
            text in "(vt |vn |v 1 2 3 1 0 1\n|f 1/1/1 2/2/1 3//2\n|usemtl |[vf#glp\\\\ /.0-9\n\r-]|v 1 2 3\n|f 1 2 3|OFF 3 1|3 0 1 2|solid|vertex 1 2 3){0,40}",
            format in prop::sample::select(vec![Format::Ply, Format::Obj, Format::Stl, Format::Off, Format::Gltf]),
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
