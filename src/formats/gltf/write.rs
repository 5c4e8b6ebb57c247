//! Writes binary glTF.

use std::io::{self, Write};

use super::composed::{self, Composed, Form};
use super::files::{self, File};
use super::{glb, plain};
use crate::error::{Error, Result};
use crate::formats::write::check;
use crate::formats::{Format, ReadOptions, Scene, read_with};
use crate::mesh::{IndexedMesh, Lattice};

/// Writes a binary glTF file of a mesh without a scene: a mesh and its node for each object that parts are named by, a primitive for each part.
///
/// Attributes that glTF knows have their names, others their own behind `_`; integers stay of their type where glTF has that, all else is
/// binary32. Materials have names alone. Vertices of no triangle are left out. Triangles are in their order within a primitive, and where some
/// lack an attribute they are a primitive of their own. [`unwritten`](crate::formats::unwritten) tells what is not kept.
///
/// # Errors
/// What `out` says; [`io::ErrorKind::InvalidInput`] where a coordinate is not finite in binary32, there are more than 2^32 - 1 bytes, or
/// the attributes are not those of the mesh.
pub fn write_glb(mesh: &IndexedMesh, out: &mut impl Write) -> io::Result<()> {
    check(mesh)?;
    let (json, binary) = plain::document(mesh)?;
    glb::write(&json, &binary, out)
}

/// As [`write_glb`], of levels of detail of one thing, the finest first: each is a node, and the first one, which is all that the scene
/// has, names the others (`MSFT_lod`), so that who does not know the extension shows the finest. `coverage` tells, for each, down to which
/// share of the screen's area it is meant to be shown (`MSFT_screencoverage`): from 1 to 0, none more than the one before.
///
/// # Errors
/// As [`write_glb`]; [`io::ErrorKind::InvalidInput`] where there is no level, or not such a number for each.
pub fn write_levels_of_detail(
    levels: &[IndexedMesh],
    coverage: &[f64],
    out: &mut impl Write,
) -> io::Result<()> {
    let falls = coverage.is_sorted_by(|a, b| a >= b) && coverage.iter().all(|x| (0.0..=1.0).contains(x));
    if levels.is_empty() || coverage.len() != levels.len() || !falls {
        let what = "levels of detail want a share of the screen each, from 1 to 0";
        return Err(io::Error::new(io::ErrorKind::InvalidInput, what));
    }
    levels.iter().try_for_each(check)?;
    let (json, binary) = plain::levels(levels, coverage)?;
    glb::write(&json, &binary, out)
}

/// How a scene is written.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct SceneOptions {
    /// Whether weights of joints are the source's own. Others are made to sum up to 1; so they are by default.
    pub exact_weights: bool,
    /// Most bytes that the file and what is made for it may take; no limit by default.
    pub max_memory: u64,
    /// The lattice of the mesh, of up to 15 bits, for positions that are integers on it, and normals, tangents and texture coordinates that are
    /// fractions of 16 bits (KHR_mesh_quantization); none by default. Meshes with skins, instances, morph targets, points or lines, and those
    /// off the lattice, stay as they are.
    pub quantise: Option<Lattice>,
    /// Whether vertices and indices are compressed where that makes them smaller (EXT_meshopt_compression), which loses nothing; not so by
    /// default. Triangles may begin with another corner then.
    pub compress: bool,
}

impl Default for SceneOptions {
    fn default() -> Self {
        Self { exact_weights: false, max_memory: u64::MAX, quantise: None, compress: false }
    }
}

/// Writes a binary glTF file of a scene whose mesh is given, at whatever level: what its JSON has stays as it is, and primitives name accessors
/// again, of the types that they had (spec §14). Images are as they were where their buffers are there, that is not empty, or else the
/// largest previews. A primitive of which nothing has come yet is a triangle without extent, so that whatever names it stays valid;
/// texture coordinates, joints, weights and displacements of targets that are not there are 0, other attributes left out.
///
/// Returns what is not as it was asked for, in words for the user: meshes that are not quantised.
///
/// # Errors
/// As [`write_glb`]; [`io::ErrorKind::InvalidInput`] at the JSON pointer where the scene is at fault; [`Error::Limit`](crate::Error::Limit), within
/// the error, beyond the memory that is allowed.
pub fn write_scene(
    mesh: &IndexedMesh,
    scene: &Scene,
    options: &SceneOptions,
    out: &mut impl Write,
) -> io::Result<Vec<String>> {
    let Composed { json, binary, remarks, .. } = composed(mesh, scene, options, None)?;
    glb::write(&json, &binary, out)?;
    Ok(remarks)
}

/// A glTF as text and what lies beside it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GltfFiles {
    /// The JSON.
    pub json: Vec<u8>,
    /// Its buffer, where it has one, and its images; it names them by their names alone.
    pub beside: Vec<File>,
    /// What is not as it was asked for, in words for the user.
    pub remarks: Vec<String>,
}

/// A mesh, or its scene where there is one, as text with its buffer and its images in files beside it, all of which have names that begin with
/// `stem`; otherwise as [`write_scene`] and [`write_glb`] have it.
///
/// # Errors
/// As [`write_scene`].
pub fn gltf_files(
    mesh: &IndexedMesh,
    scene: Option<&Scene>,
    options: &SceneOptions,
    stem: &str,
) -> io::Result<GltfFiles> {
    check(mesh)?;
    let Composed { mut json, binary, files, remarks } = match scene {
        Some(scene) => composed(mesh, scene, options, Some(stem))?,
        None => {
            let (json, binary) = plain::document(mesh)?;
            Composed { json, binary, ..Composed::default() }
        }
    };
    let mut beside = Vec::new();
    if !binary.is_empty() {
        let name = format!("{stem}.bin");
        json["buffers"][0]["uri"] = files::uri(&name).into();
        beside.push(File { name, bytes: binary });
    }
    beside.extend(files);
    Ok(GltfFiles { json: serde_json::to_vec_pretty(&json).map_err(io::Error::other)?, beside, remarks })
}

fn composed(
    mesh: &IndexedMesh,
    scene: &Scene,
    options: &SceneOptions,
    beside: Option<&str>,
) -> io::Result<Composed> {
    check(mesh)?;
    let SceneOptions { exact_weights, quantise, compress, .. } = options;
    let form =
        Form::Whole { is_exact: *exact_weights, beside, quantise: quantise.as_ref(), compress: *compress };
    composed::document(mesh, scene, form, options.max_memory)
}

/// Writes a binary glTF file with the extension `UNWELD_progressive_mesh` (spec §14): its accessors have the mesh, which ought to be the base of
/// `uwm`, for viewers that do not know the extension, and `uwm` lies in its buffer.
///
/// # Errors
/// As [`write_scene`].
pub fn write_progressive(
    mesh: &IndexedMesh,
    scene: &Scene,
    uwm: &[u8],
    out: &mut impl Write,
) -> io::Result<()> {
    check(mesh)?;
    let Composed { json, binary, .. } = composed::document(mesh, scene, Form::Progressive { uwm }, u64::MAX)?;
    glb::write(&json, &binary, out)
}

/// All that a scene shows as one mesh, where it is shown: what [`read_with`] gives of a glTF that is no scene to it; and what of the scene is
/// left out of that, in words for the user.
///
/// # Errors
/// [`Error::Input`] at the JSON pointer where the scene is at fault, also where nothing of it has a triangle; [`Error::Limit`] beyond so many
/// bytes of memory.
pub fn placed(mesh: &IndexedMesh, scene: &Scene, max_memory: u64) -> Result<(IndexedMesh, Vec<String>)> {
    let form = Form::Geometry;
    let composed = check(mesh).and_then(|()| composed::document(mesh, scene, form, max_memory));
    let Composed { json, binary, .. } = composed.map_err(inner)?;
    let mut bytes = Vec::new();
    glb::write(&json, &binary, &mut bytes)?;
    drop((json, binary));
    let options =
        ReadOptions { format: Some(Format::Gltf), max_memory, force: true, ..ReadOptions::default() };
    let source = read_with(&bytes, &options)?;
    Ok((source.mesh, source.dropped))
}

/// The error of this crate that one of the medium stands for, if it does.
fn inner(error: io::Error) -> Error {
    match error.downcast::<Error>() {
        Ok(error) => error,
        Err(error) => error.into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::{Format, Source, read_bytes, unwritten};
    use crate::mesh::attributes::{Attribute, Domain, NO_VALUE, Semantic, Stored, Values};
    use proptest::prelude::*;

    fn back(mesh: &IndexedMesh) -> Source {
        let mut bytes = Vec::new();
        write_glb(mesh, &mut bytes).unwrap();
        read_bytes(&bytes, None, "").unwrap()
    }

    /// The bits of all that each corner has: its position, and its value of the attributes of so many names.
    fn corners(mesh: &IndexedMesh, titles: &[String]) -> Vec<Vec<Option<u64>>> {
        let of = |corner: usize| {
            let position = mesh.positions[mesh.triangles.as_flattened()[corner] as usize];
            let mut bits: Vec<_> = position.map(|x| Some(x.to_bits())).to_vec();
            for title in titles {
                let attribute = mesh.attributes.iter().find(|a| a.title().trim_matches('_') == title);
                let value = attribute.and_then(|a| Some((a, a.at(corner / 3, corner % 3)?)));
                bits.push(value.map(|(a, _)| a.components as u64));
                let number = |(a, value): (&Attribute, usize), k| a.values.bits(value * a.components + k);
                bits.extend(
                    (0..4).map(|k| value.filter(|(a, _)| k < a.components).map(|value| number(value, k))),
                );
            }
            bits
        };
        (0..3 * mesh.triangles.len()).map(of).collect()
    }

    fn square() -> IndexedMesh {
        let positions = vec![[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
        IndexedMesh::new(positions, vec![[0, 1, 2], [0, 2, 3]])
    }

    #[test]
    fn parts_are_primitives_and_keep_their_names() {
        let mut mesh = square();
        mesh.triangles.push([3, 2, 1]);
        mesh.attributes = vec![Attribute::parts(&[2, 0, 1])];
        mesh.part_names =
            ["o lamp\ng primitive 1\nusemtl red", "o table\nusemtl red", "o lamp\ng primitive 0"]
                .map(str::to_owned)
                .to_vec();
        let source = back(&mesh);
        assert_eq!(unwritten(&mesh, Format::Gltf), [""; 0]);
        // By objects: the third triangle is the table's.
        assert_eq!(
            source.mesh.part_names,
            ["o lamp\ng primitive 0", "o lamp\ng primitive 1\nusemtl red", "o table\nusemtl red"]
        );
        let part = |t: usize| source.mesh.attributes[0].at(t, 0);
        assert_eq!([0, 1, 2].map(part), [Some(0), Some(1), Some(2)]);
        assert_eq!(corners(&source.mesh, &[])[6], corners(&mesh, &[])[6]);
    }

    /// The finest of two objects; who knows nothing of levels sees that one alone.
    #[test]
    fn levels_of_detail_come_back_one_by_one() {
        let mut fine = square();
        fine.triangles.push([3, 2, 1]);
        fine.attributes = vec![Attribute::parts(&[0, 0, 1])];
        fine.part_names = ["o lamp\nusemtl red", "o table\nusemtl blue"].map(str::to_owned).to_vec();
        let mut coarse = square();
        coarse.triangles.truncate(1);
        coarse.attributes = vec![Attribute::parts(&[0])];
        coarse.part_names = vec!["o lamp\nusemtl blue".to_owned()];
        let mut bytes = Vec::new();
        write_levels_of_detail(&[fine.clone(), coarse.clone()], &[0.25, 0.0], &mut bytes).unwrap();
        for (detail, mesh) in [(None, &fine), (Some(0), &fine), (Some(1), &coarse)] {
            let options = ReadOptions { detail, ..ReadOptions::default() };
            let told = read_with(&bytes, &options).unwrap().mesh;
            assert_eq!((corners(&told, &[]), told.part_names), (corners(mesh, &[]), mesh.part_names.clone()));
        }
        let json: serde_json::Value = serde_json::from_slice(glb::frame(&bytes).unwrap().json).unwrap();
        assert_eq!(json["scenes"][0]["nodes"].to_string(), "[0]");
        assert_eq!(json["nodes"][0]["extensions"]["MSFT_lod"]["ids"].to_string(), "[1]");
        assert_eq!(json["nodes"][0]["extras"]["MSFT_screencoverage"].to_string(), "[0.25,0.0]");
        assert_eq!(json["extensionsUsed"].to_string(), "[\"MSFT_lod\"]");
        let refused = |levels: &[IndexedMesh], coverage: &[f64]| {
            let outcome = write_levels_of_detail(levels, coverage, &mut io::sink());
            outcome.unwrap_err().kind() == io::ErrorKind::InvalidInput
        };
        let levels = [fine, coarse];
        assert!(refused(&[], &[]) && refused(&levels, &[0.5]) && refused(&levels, &[0.25, 0.5]));
        assert!(refused(&levels, &[1.5, 0.5]) && refused(&levels, &[0.5, f64::NAN]));
    }

    #[test]
    fn triangles_that_lack_an_attribute_are_a_primitive() {
        let mut mesh = square();
        let uv = Values::F32(vec![0.25, 0.5]);
        mesh.attributes =
            vec![Attribute::new(Semantic::TexCoord, 2, uv, vec![NO_VALUE, NO_VALUE, NO_VALUE, 0, 0, 0])];
        let told = back(&mesh).mesh;
        assert_eq!(corners(&told, &["uv".to_owned()]), corners(&mesh, &["uv".to_owned()]));
        assert_eq!(unwritten(&mesh, Format::Gltf), [""; 0]);
        // A corner alone has no value.
        mesh.attributes[0].corners[0] = 0;
        assert_eq!(
            unwritten(&mesh, Format::Gltf),
            ["glTF has values at all corners of a triangle or at none: some uv left out"]
        );
        assert!(back(&mesh).mesh.attributes.last().unwrap().corners[0] == NO_VALUE);
    }

    #[test]
    fn what_gltf_has_no_type_for() {
        let mut mesh = square();
        let of = |semantic, components, values| Attribute::new(semantic, components, values, vec![0; 6]);
        let named = |name: &str, attribute| Attribute { name: name.into(), ..attribute };
        mesh.attributes = vec![
            of(Semantic::TexCoord, 3, Values::F32(vec![0.0; 3])),
            named("wide", of(Semantic::Generic, 5, Values::F32(vec![0.0; 5]))),
            named("third", of(Semantic::Generic, 1, Values::F64(vec![1.0 / 3.0]))),
            named("big", of(Semantic::Generic, 1, Values::U32(vec![1 << 24]))),
            Attribute {
                domain: Domain::Triangle,
                corners: vec![0, 0],
                ..of(Semantic::Color, 3, Values::F32(vec![0.5; 3]))
            },
            named(
                "flags",
                Attribute {
                    domain: Domain::Triangle,
                    corners: vec![0, 0],
                    ..of(Semantic::Generic, 1, Values::U8(vec![1]))
                },
            ),
        ];
        let lost = [
            "glTF has no place for wide, flags of triangles",
            "glTF has binary32 numbers: third rounded",
            "glTF has values of vertices alone: color of triangles written at their corners",
        ];
        assert_eq!(unwritten(&mesh, Format::Gltf), lost);
        let titles: Vec<String> = back(&mesh).mesh.attributes.iter().map(Attribute::title).collect();
        assert_eq!(titles, ["color", "_big", "_third", "_uv"]);
    }

    #[test]
    fn what_would_not_read_back_is_refused() {
        let mut mesh = square();
        mesh.positions[1][2] = 1e39;
        let kind = |mesh: &IndexedMesh| write_glb(mesh, &mut io::sink()).unwrap_err().kind();
        assert_eq!(kind(&mesh), io::ErrorKind::InvalidInput);
        // What no triangle has is not written.
        mesh.triangles = vec![[0, 2, 3]];
        assert_eq!(back(&mesh).mesh.positions.len(), 3);
    }

    prop_compose! {
        /// Up to 12 triangles of 8 vertices, with attributes of all kinds and few values.
        fn meshes()(
            triangles in prop::collection::vec(prop::array::uniform3(0u32..8), 1..12),
            positions in prop::collection::vec(prop::array::uniform3(-100f32..100.0), 8),
            numbers in prop::collection::vec(0u16..5, 16),
            corners in prop::collection::vec(0u32..4, 36),
            which in 0u32..256,
        ) -> IndexedMesh {
            let count = triangles.len();
            let mut mesh = IndexedMesh::new(positions.iter().map(|p| p.map(f64::from)).collect(), triangles);
            let kinds = [
                (Semantic::Normal, Stored::F32, 3, "", false),
                (Semantic::Tangent, Stored::F32, 4, "", false),
                (Semantic::TexCoord, Stored::U16, 2, "", true),
                (Semantic::Color, Stored::U8, 3, "", true),
                (Semantic::Joints, Stored::U16, 4, "", false),
                (Semantic::Weights, Stored::F32, 4, "", false),
                (Semantic::Generic, Stored::I8, 1, "heat", false),
                (Semantic::Generic, Stored::F32, 2, "flow", false),
            ];
            for (k, (semantic, stored, components, name, normalised)) in kinds.into_iter().enumerate() {
                let mut values = Values::new(stored);
                numbers.iter().take(4 * components).for_each(|&x| values.push(f64::from(x)));
                let corners: Vec<u32> = (0..3 * count).map(|at| corners[(at * (k + 1)) % corners.len()]).collect();
                let attribute = Attribute { name: name.into(), normalised, ..Attribute::new(semantic, components, values, corners) };
                mesh.attributes.extend((which >> k & 1 == 1).then_some(attribute));
            }
            mesh
        }
    }

    proptest! {
        #[test]
        fn what_is_written_is_read(mesh in meshes()) {
            let titles: Vec<String> = mesh.attributes.iter().map(Attribute::title).collect();
            let source = back(&mesh);
            prop_assert_eq!(source.mesh.attributes.len(), titles.len());
            prop_assert_eq!(corners(&source.mesh, &titles), corners(&mesh, &titles));
            prop_assert_eq!((source.dropped, unwritten(&mesh, Format::Gltf)), (vec![], vec![]));
        }
    }
}
