//! What the surface of a mesh is painted with: the materials of its parts, and their pictures.

/// The paint of a mesh. A triangle has the material of its part; all of them are of part 0 where the mesh has no parts.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Paint {
    /// The materials.
    pub materials: Vec<Material>,
    /// The material of each part, by the numbers that parts have, if it has one.
    pub of_parts: Vec<Option<usize>>,
    /// The pictures.
    pub images: Vec<Image>,
    /// Whether colours at corners are linear light, as a glTF's are; else they are sRGB.
    pub is_linear: bool,
}

/// How a surface looks, as far as its colour goes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// Red, green, blue and opacity, 0 to 1, in linear light: all else is multiplied by it.
    pub colour: [f32; 4],
    /// What picture lies on it, by its place in [`Paint::images`].
    pub image: Option<usize>,
    /// The set of texture coordinates by which the picture lies, (0, 0) at the first pixel of its first row.
    pub set: u32,
    /// What texture coordinates become before the picture is looked at: two rows of a 2 x 3 matrix.
    pub transform: [[f32; 3]; 2],
    /// The opacity below which nothing is seen: 0 where all is.
    pub cutoff: f32,
}

impl Default for Material {
    /// White, without a picture.
    fn default() -> Self {
        let transform = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        Self { colour: [1.0; 4], image: None, set: 0, transform, cutoff: 0.0 }
    }
}

/// A picture in sRGB.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Image {
    /// Pixels a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// `width * height` colours, row by row from the top: red, green, blue, opacity.
    pub pixels: Vec<[u8; 4]>,
}
