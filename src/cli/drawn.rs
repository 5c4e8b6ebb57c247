//! What is drawn: a mesh, and what it is painted with.

use unweld::formats::{Format, ReadOptions, Scene, SceneOptions, placed, read_painted, write_scene};
use unweld::mesh::attributes::Semantic;
use unweld::mesh::{Attribute, IndexedMesh, Paint};
use unweld::render::Model;

/// A mesh to draw.
pub struct Drawn {
    /// The mesh; of a scene all that is shown, where it is.
    pub mesh: IndexedMesh,
    /// `None` for its shape alone.
    pub paint: Option<Paint>,
    /// What cannot be drawn of what it is painted with, in words for the user.
    pub remarks: Vec<String>,
}

impl Drawn {
    /// A mesh, which is painted if there is anything to paint it with.
    pub fn new(mesh: IndexedMesh, paint: Paint, remarks: Vec<String>) -> Self {
        let shows = |a: &Attribute| matches!(a.semantic, Semantic::Normal | Semantic::Color);
        let is_painted = !paint.materials.is_empty() || mesh.attributes.iter().any(shows);
        Self { mesh, paint: is_painted.then_some(paint), remarks }
    }

    /// The shape of a mesh.
    pub fn plain(mesh: IndexedMesh) -> Self {
        Self { mesh, paint: None, remarks: Vec::new() }
    }

    /// A mesh of a scene, if it is of one, with the pictures that the scene has; or its shape alone. To place it may take so many bytes of
    /// `memory`.
    ///
    /// # Errors
    /// Where the scene is at fault; where there is not enough memory.
    pub fn of(mesh: IndexedMesh, scene: Option<&Scene>, is_plain: bool, memory: u64) -> anyhow::Result<Self> {
        let Some(scene) = scene else {
            return Ok(if is_plain {
                Self::plain(mesh)
            } else {
                Self::new(mesh, Paint::default(), Vec::new())
            });
        };
        if is_plain {
            return Ok(Self::plain(placed(&mesh, scene, memory)?.0));
        }
        let mut bytes = Vec::new();
        let mut writing = SceneOptions::default();
        (writing.exact_weights, writing.max_memory) = (true, memory);
        drop(write_scene(&mesh, scene, &writing, &mut bytes)?);
        let mut options = ReadOptions::default();
        (options.format, options.max_memory, options.force) = (Some(Format::Gltf), memory, true);
        let (source, paint) = read_painted(&bytes, &options)?;
        Ok(Self::new(source.mesh, paint, source.remarks))
    }

    /// To be drawn.
    pub fn model(&self) -> Model<'_> {
        Model { mesh: &self.mesh, paint: self.paint.as_ref() }
    }

    /// The attributes that are not drawn, by their titles.
    pub fn left_out(&self) -> Vec<String> {
        let is_left_out = |attribute: &&Attribute| {
            let Some(paint) = &self.paint else { return true };
            match attribute.semantic {
                Semantic::Normal | Semantic::Color => attribute.set > 0,
                Semantic::Part => paint.materials.is_empty(),
                Semantic::TexCoord => {
                    !paint.materials.iter().any(|m| m.image.is_some() && m.set == attribute.set)
                }
                _ => true,
            }
        };
        self.mesh.attributes.iter().filter(is_left_out).map(Attribute::title).collect()
    }
}
