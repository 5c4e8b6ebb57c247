//! What the surface of a mesh is painted with: the materials of its parts, and their pictures. What is drawn and what is baked into a texture
//! look colours up in one place, `coat`.

#[cfg(feature = "encode")]
pub(crate) mod coat;
#[cfg(feature = "encode")]
pub(crate) mod light;
#[cfg(feature = "encode")]
pub(crate) mod texture;

/// The paint of a mesh. A triangle has the material of its part; all of them are of part 0 where the mesh has no parts.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Paint {
    /// The materials.
    pub materials: Vec<Material>,
    /// The material of each part, by the numbers that parts have, if it has one.
    pub of_parts: Vec<Option<usize>>,
    /// The material of all parts beyond that list, if they have one.
    pub others: Option<usize>,
    /// The pictures.
    pub images: Vec<Image>,
    /// Whether colours at corners are linear light, as a glTF's are; else they are sRGB.
    pub is_linear: bool,
    /// Which pictures cannot be had, and why, in words for the user: what they lie on has its colours alone.
    pub missing: Vec<String>,
    /// Files that were read for it, where they lie beside the mesh's.
    pub files: Vec<std::path::PathBuf>,
}

impl Paint {
    /// Lays a picture on all that has none; `turned` where texture coordinates run up from its last row.
    pub fn cover(&mut self, image: Image, turned: bool) {
        let place = Some(self.images.len());
        self.images.push(image);
        let transform = if turned { TURNED } else { Material::default().transform };
        let cover = |material: &mut Material| {
            if material.image.is_none() {
                (material.image, material.set, material.transform) = (place, 0, transform);
            }
        };
        self.materials.iter_mut().for_each(cover);
        let bare = self.materials.len();
        self.materials.push(Material { image: place, transform, ..Material::default() });
        self.of_parts.iter_mut().for_each(|part| *part = part.or(Some(bare)));
        self.others = Some(bare);
    }

    /// The material of a part, if it has one.
    pub fn material(&self, part: usize) -> Option<&Material> {
        self.materials.get(self.of_parts.get(part).copied().unwrap_or(self.others)?)
    }
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

/// From a number of sRGB, 0 to 1, to linear light (IEC 61966-2-1).
pub fn srgb_to_linear(x: f32) -> f32 {
    if x <= 0.04045 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) }
}

/// The transform of texture coordinates whose v runs up from a picture's lower edge, as in OBJ and PLY.
pub const TURNED: [[f32; 3]; 2] = [[1.0, 0.0, 0.0], [0.0, -1.0, 1.0]];

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
