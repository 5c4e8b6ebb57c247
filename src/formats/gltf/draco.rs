//! Primitives compressed as KHR_draco_mesh_compression has it (feature `draco`).

use super::document::Document;
use super::json::At;
use super::primitive::Stream;
use crate::error::Result;

/// The name of the extension.
pub(super) const EXTENSION: &str = "KHR_draco_mesh_compression";

#[cfg(feature = "draco")]
pub(super) use unpack::Packed;

#[cfg(feature = "draco")]
mod unpack {
    use super::*;
    use crate::formats::gltf::accessor::{self, Accessor};
    use crate::limits::MAX_ELEMENTS;
    use crate::mesh::attributes::{Stored, Values};
    use draco_core::{DecodeLimits, DecoderBuffer, Mesh, MeshDecoder, PointIndex};

    /// A primitive that has been decoded.
    pub(in crate::formats::gltf) struct Packed<'d> {
        document: &'d Document<'d>,
        mesh: Mesh,
        /// Which of the attributes are in it, by their identifiers there.
        attributes: At<'d>,
        pub triangles: Vec<[u32; 3]>,
    }

    impl<'d> Packed<'d> {
        /// Decodes a primitive, if it is compressed.
        ///
        /// # Errors
        /// Where its data are not there, or damaged, or more than is allowed.
        pub(in crate::formats::gltf) fn of(
            document: &'d Document<'d>,
            primitive: &At<'d>,
        ) -> Result<Option<Self>> {
            let Some(at) = primitive.extension(EXTENSION) else { return Ok(None) };
            let view = document.view(&at.needed("bufferView")?)?;
            let most = document.most_memory();
            let limits = DecodeLimits::default()
                .with_max_points(MAX_ELEMENTS.into())
                .with_max_faces((most / BYTES_A_FACE).min(MAX_ELEMENTS.into()))
                .with_max_decoded_bytes(most / 4);
            let mut mesh = Mesh::new();
            let mut buffer = DecoderBuffer::new(view.bytes).with_limits(limits);
            MeshDecoder::new().decode(&mut buffer, &mut mesh).map_err(|e| at.fault(format!("Draco: {e}")))?;
            document.take(mesh.num_faces(), 2 * size_of::<[u32; 3]>())?;
            let triangles = mesh.faces().iter().map(|face| face.map(|v| v.0)).collect();
            Ok(Some(Self { document, mesh, attributes: at.needed("attributes")?, triangles }))
        }

        /// The numbers of an attribute, of the type that its accessor tells; none if it is not in the compressed data.
        pub(in crate::formats::gltf) fn stream(
            &self,
            name: &str,
            accessor: &At<'d>,
        ) -> Option<Result<Stream>> {
            let number = self.attributes.key(name)?;
            Some(self.numbers(&number, accessor))
        }

        fn numbers(&self, number: &At<'_>, accessor: &At<'d>) -> Result<Stream> {
            let shape = Accessor::new(self.document, accessor)?.shape;
            let id = number.number()?;
            let attribute = u32::try_from(id).ok().and_then(|id| self.mesh.attribute_by_unique_id(id));
            let attribute =
                attribute.ok_or_else(|| number.fault(format!("the Draco data have no attribute {id}")))?;
            if usize::from(attribute.num_components()) != shape.components {
                let (has, needed) = (attribute.num_components(), shape.components);
                return Err(number
                    .fault(format!("the Draco data have {has} numbers a vertex, the accessor {needed}")));
            }
            let stored = STORED[..]
                .iter()
                .find(|(code, _)| *code == attribute.data_type() as u32)
                .map(|(_, stored)| *stored);
            let stored =
                stored.ok_or_else(|| number.fault("the Draco data are of a type that glTF has not"))?;
            let points = self.mesh.num_points();
            self.document.take(points, shape.components * accessor::size(shape.stored))?;
            let (size, data) = (accessor::size(stored), attribute.buffer().data());
            let stride = usize::try_from(attribute.byte_stride()).unwrap_or(0);
            let mut values = Values::new(shape.stored);
            for p in 0..points as u32 {
                let row = (attribute.mapped_index(PointIndex(p)).0 as usize).checked_mul(stride);
                let row = row.and_then(|row| data.get(row..)?.get(..size * shape.components));
                let row =
                    row.ok_or_else(|| number.fault(format!("the Draco data have no numbers of vertex {p}")))?;
                for bytes in row.chunks_exact(size) {
                    let bits = bytes.iter().rev().fold(0, |bits, &b| bits << 8 | u64::from(b));
                    if stored == shape.stored {
                        values.push_bits(bits);
                    } else {
                        let mut single = Values::new(stored);
                        single.push_bits(bits);
                        values.push(single.number(0));
                    }
                }
            }
            Ok(Stream { shape, values, accessor: None })
        }
    }

    const STORED: [(u32, Stored); 8] = [
        (1, Stored::I8),
        (2, Stored::U8),
        (3, Stored::I16),
        (4, Stored::U16),
        (5, Stored::I32),
        (6, Stored::U32),
        (9, Stored::F32),
        (10, Stored::F64),
    ];

    /// What the decoder takes for a face, about.
    const BYTES_A_FACE: u64 = 64;
}

/// None can be decoded.
#[cfg(not(feature = "draco"))]
pub(super) struct Packed {
    pub triangles: Vec<[u32; 3]>,
}

#[cfg(not(feature = "draco"))]
impl Packed {
    /// Refuses a primitive that is there only compressed.
    ///
    /// # Errors
    /// At the extension.
    pub(super) fn of(document: &Document<'_>, primitive: &At<'_>) -> Result<Option<Self>> {
        let Some(at) = primitive.extension(EXTENSION) else { return Ok(None) };
        let position = primitive.needed("attributes")?.needed(super::primitive::POSITION)?;
        if document.named("accessors", &position)?.key("bufferView").is_some() {
            return Ok(None);
        }
        Err(at.fault(format!("{EXTENSION} is not read: this program was built without the feature `draco`")))
    }

    /// Nothing.
    pub(super) fn stream(&self, _: &str, _: &At<'_>) -> Option<Result<Stream>> {
        None
    }
}
