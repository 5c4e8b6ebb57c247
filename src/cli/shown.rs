//! What a decoded file shows: its mesh, or all of its scene.

use super::output::{MeshFormat, Output};
use anyhow::bail;
use unweld::codec::grid::Real;
use unweld::codec::walk::Tour;
use unweld::codec::whole::Whole;
use unweld::container::ResourceKind;
use unweld::decoder::Decoder;
use unweld::formats::{self, Role, Scene, SceneBuffer, write_scene};
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
        let plain = |mesh, numbers| Self { mesh, numbers, scene: None, exact_weights: false };
        if contents.scene().is_none() {
            return Ok(match without_residue(decoder, triangles, &lattice) {
                Some(mesh) => plain(mesh, Numbers::OnLattice(lattice)),
                None => plain(decoder.assembled()?, numbers),
            });
        }
        if format != MeshFormat::Glb {
            let exact = if real.is_some() { Numbers::Exact(Real::Binary64) } else { Numbers::Any };
            return Ok(plain(placed(decoder, memory)?, exact));
        }
        let is_exact =
            |quantisation: &Quantisation| matches!(quantisation, Quantisation::Integer | Quantisation::Raw);
        let mut weights = contents.attributes.iter().filter(|entry| entry.semantic == Semantic::Weights);
        let exact_weights = weights.all(|entry| is_exact(&entry.quantisation));
        Ok(Self { mesh: decoder.assembled()?, numbers, scene: scene(decoder)?, exact_weights })
    }

    /// Writes it, in the type of its coordinates where these are exact.
    ///
    /// # Errors
    /// Those of the medium; where the scene is at fault.
    pub fn write(&self, format: MeshFormat, output: &Output) -> anyhow::Result<()> {
        output.write(|mut out| match (&self.scene, &self.numbers) {
            (Some(scene), _) => write_scene(&self.mesh, scene, self.exact_weights, &mut out),
            (None, Numbers::Exact(real)) => format.write_exact(&self.mesh, *real, out),
            (None, Numbers::OnLattice(lattice)) => format.write(&self.mesh, Some(lattice), out),
            (None, Numbers::Any) => format.write(&self.mesh, None, out),
        })
    }

    /// What a file of a format does not keep of it, in words for the user.
    pub fn losses(&self, format: MeshFormat) -> Vec<String> {
        match self.numbers {
            _ if self.scene.is_some() => Vec::new(),
            Numbers::OnLattice(lattice) => format.losses(&self.mesh, Some(&lattice)),
            Numbers::Exact(_) | Numbers::Any => format.losses(&self.mesh, None),
        }
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
    let buffers =
        contents.resources.iter().enumerate().filter(|(_, entry)| entry.kind == ResourceKind::Buffer);
    let buffers = buffers.map(|(number, entry)| SceneBuffer {
        bytes: decoder.resource(number).unwrap_or_default().to_vec(),
        role: Role::Binary,
        useful_from: match entry.place {
            place if place == contents.base_level() => f64::INFINITY,
            0 => 0.0,
            place => contents.level(place).map_or(0.0, |level| level.max_error),
        },
    });
    Ok(Some(Scene { json: json.to_vec(), buffers: buffers.collect() }))
}

/// All that the scene of a file shows, where it is shown, or its mesh where it has none.
///
/// # Errors
/// As [`Shown::new`].
pub fn placed(decoder: &Decoder, memory: u64) -> anyhow::Result<IndexedMesh> {
    let mesh = decoder.assembled()?;
    match scene(decoder)? {
        Some(scene) => Ok(formats::placed(&mesh, &scene, memory)?),
        None => Ok(mesh),
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
