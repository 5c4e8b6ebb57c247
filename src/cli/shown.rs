//! What a decoded file shows: its mesh, or all of its scene.

use super::decode::Compression;
use super::output::{MeshFormat, Output};
use super::resources;
use anyhow::bail;
use std::path::Path;
use unweld::codec::grid::Real;
use unweld::codec::walk::Tour;
use unweld::codec::whole::Whole;
use unweld::container::ResourceKind;
use unweld::decoder::Decoder;
use unweld::formats::{self, Role, Scene, SceneBuffer, SceneOptions, gltf_files, write_scene};
use unweld::mesh::attributes::{Quantisation, Semantic};
use unweld::mesh::{IndexedMesh, Lattice};

/// A mesh to write, and how.
pub struct Shown {
    /// As the file has it, or of its scene all that is shown, where it is.
    pub mesh: IndexedMesh,
    /// What is known of its numbers.
    numbers: Numbers,
    scene: Option<Scene>,
    /// Whether its weights are those of the source.
    exact_weights: bool,
    /// What of the scene a mesh alone has not.
    dropped: Vec<String>,
    memory: u64,
}

/// What coordinates are.
enum Numbers {
    /// The source's own, of this type.
    Exact(Real),
    /// Those of the file's lattice.
    OnLattice(Lattice),
    /// Others.
    Any,
}

impl Shown {
    /// What a decoder has, for a file of a format; without the triangles of the residue, where they would be more than so many `triangles` with
    /// them. To place a scene may take so many bytes of `memory`.
    ///
    /// # Errors
    /// Where there is no mesh, or not enough memory; where the scene has not come or is at fault.
    pub fn new(
        decoder: &Decoder,
        triangles: Option<u32>,
        format: MeshFormat,
        memory: u64,
    ) -> anyhow::Result<Self> {
        let Some(contents) = decoder.contents() else { bail!("there is no mesh") };
        let lattice = contents.header.lattice;
        let real =
            decoder.correction().filter(|_| decoder.level() == Some(0)).map(|correction| correction.real);
        let numbers = real.map_or(Numbers::OnLattice(lattice), Numbers::Exact);
        let plain = |mesh, numbers| {
            let (scene, exact_weights, dropped) = (None, false, vec![]);
            Self { mesh, numbers, scene, exact_weights, dropped, memory }
        };
        if contents.scene().is_none() {
            return Ok(match without_residue(decoder, triangles, &lattice) {
                Some(mesh) => plain(mesh, Numbers::OnLattice(lattice)),
                None => plain(decoder.assembled()?, numbers),
            });
        }
        if !format.is_gltf() {
            let exact = if real.is_some() { Numbers::Exact(Real::Binary64) } else { Numbers::Any };
            let (mesh, dropped) = placed(decoder, memory)?;
            return Ok(Self { dropped, ..plain(mesh, exact) });
        }
        let is_exact =
            |quantisation: &Quantisation| matches!(quantisation, Quantisation::Integer | Quantisation::Raw);
        let mut weights = contents.attributes.iter().filter(|entry| entry.semantic == Semantic::Weights);
        let exact_weights = weights.all(|entry| is_exact(&entry.quantisation));
        Ok(Self { scene: scene(decoder)?, exact_weights, ..plain(decoder.assembled()?, numbers) })
    }

    /// Writes it, in the type of its coordinates where these are exact; a glTF of a scene as it is asked for, with numbers that are integers
    /// where they can be. Files beside a glTF must not be one of `inputs`. Returns what is not as it was asked for, in words for the user.
    ///
    /// # Errors
    /// Those of the medium; where the scene is at fault.
    pub fn write(
        &self,
        format: MeshFormat,
        compression: Compression,
        output: &Output,
        inputs: &[&Path],
    ) -> anyhow::Result<Vec<String>> {
        let mut options = SceneOptions::default();
        options.exact_weights = self.exact_weights;
        options.max_memory = self.memory;
        let mut remarks = Vec::new();
        let quantised = compression != Compression::None;
        options.compress = compression == Compression::Meshopt;
        options.quantise = match self.numbers {
            Numbers::OnLattice(lattice) if quantised && self.scene.is_some() => Some(lattice),
            _ => None,
        };
        if quantised && options.quantise.is_none() {
            let why = if self.scene.is_none() { "the file has no scene" } else { "they are exact" };
            remarks.push(format!("coordinates stay floating-point numbers: {why}"));
            if options.compress && self.scene.is_none() {
                remarks.push("nothing is compressed: the file has no scene".to_owned());
            }
        }
        if format == MeshFormat::Gltf {
            let make = |stem: &str| gltf_files(&self.mesh, self.scene.as_ref(), &options, stem);
            remarks.extend(output.write_files(inputs, make)?);
            return Ok(remarks);
        }
        output.write(|mut out| {
            match (&self.scene, &self.numbers) {
                (Some(scene), _) => remarks.extend(write_scene(&self.mesh, scene, &options, &mut out)?),
                (None, Numbers::Exact(real)) => format.write_exact(&self.mesh, *real, out)?,
                (None, Numbers::OnLattice(lattice)) => format.write(&self.mesh, Some(lattice), out)?,
                (None, Numbers::Any) => format.write(&self.mesh, None, out)?,
            }
            Ok(())
        })?;
        Ok(remarks)
    }

    /// What a file of a format does not keep of it, in words for the user.
    pub fn losses(&self, format: MeshFormat) -> Vec<String> {
        let mut losses = match self.numbers {
            _ if self.scene.is_some() => Vec::new(),
            Numbers::OnLattice(lattice) => format.losses(&self.mesh, Some(&lattice)),
            Numbers::Exact(_) | Numbers::Any => format.losses(&self.mesh, None),
        };
        if !self.dropped.is_empty() {
            losses.push(format!("of the scene it has not {}", self.dropped.join(", ")));
        }
        losses
    }
}

/// The scene of a file that has one, with the buffers that have come; others are empty.
///
/// # Errors
/// Where its JSON has not come.
pub fn scene(decoder: &Decoder) -> anyhow::Result<Option<Scene>> {
    let Some(contents) = decoder.contents().filter(|contents| contents.scene().is_some()) else {
        return Ok(None);
    };
    let Some(json) = decoder.scene() else {
        bail!("the scene stands behind what is decoded: without it no mesh has its place");
    };
    let roles = resources::roles_of(json);
    let mut buffers: Vec<SceneBuffer> = Vec::new();
    let entries =
        contents.resources.iter().enumerate().filter(|(_, entry)| entry.kind == ResourceKind::Buffer);
    for (r, (number, entry)) in entries.enumerate() {
        let error = match entry.place {
            place if place == contents.base_level() => f64::INFINITY,
            0 => 0.0,
            place => contents.level(place).map_or(0.0, |level| level.max_error),
        };
        buffers.push(SceneBuffer {
            bytes: decoder.resource(number).unwrap_or_default().to_vec(),
            role: roles.get(&r).copied().unwrap_or(Role::Binary),
            // Levels need not be in the order of their errors, buffers are.
            useful_from: buffers.last().map_or(error, |last| error.min(last.useful_from)),
        });
    }
    Ok(Some(Scene { json: json.to_vec(), buffers }))
}

/// All that the scene of a file shows, where it is shown, or its mesh where it has none; and what of the scene that has not, in words for the
/// user.
///
/// # Errors
/// As [`Shown::new`].
pub fn placed(decoder: &Decoder, memory: u64) -> anyhow::Result<(IndexedMesh, Vec<String>)> {
    let mesh = decoder.assembled()?;
    match scene(decoder)? {
        Some(scene) => Ok(formats::placed(&mesh, &scene, memory)?),
        None => Ok((mesh, vec![])),
    }
}

/// The mesh on the lattice without the triangles of the residue, where it has too many with them.
fn without_residue(decoder: &Decoder, triangles: Option<u32>, lattice: &Lattice) -> Option<IndexedMesh> {
    let mut residue = decoder.residue()?.clone();
    let all = decoder.mesh().table.triangle_count() + residue.triangles.len();
    if triangles.is_none_or(|most| all <= most as usize) {
        return None;
    }
    residue.triangles.clear();
    Some(Whole::new(decoder.mesh(), &residue, &Tour::new(decoder.mesh())).on_lattice(lattice))
}
