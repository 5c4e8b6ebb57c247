//! What a scene is beside its mesh: a glTF's JSON, and the bytes of its buffers (spec §14).

/// A scene without its geometry, which is in a mesh beside it, by parts.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scene {
    /// The scene JSON (spec §14): the glTF JSON whose triangles name parts of the mesh in place of accessors.
    pub json: Vec<u8>,
    /// The buffers that the JSON names, by number.
    pub buffers: Vec<SceneBuffer>,
}

/// Bytes that a scene's JSON names.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneBuffer {
    /// The bytes, 1 or more.
    pub bytes: Vec<u8>,
    /// What they are.
    pub role: Role,
    /// The error, in units of the mesh, of the coarsest levels that have a use for it: infinite where all have, 0 where only the finest has.
    /// That of a picture is how far apart its pixels are on the surface. It does not grow from a buffer to the next.
    pub useful_from: f64,
}

/// What a buffer of a scene holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// What accessors name, such as samples of animations, or anything else that is no image.
    Binary,
    /// A small picture of an image.
    Preview {
        /// The number of the image.
        image: usize,
        /// Pixels of its longer side, at most: 64 or 256.
        size: u32,
    },
    /// An image as it was.
    Original {
        /// The number of the image.
        image: usize,
    },
}
