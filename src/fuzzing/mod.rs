//! Bodies of the fuzz targets: they panic where an invariant breaks. Not part of the public interface.
//!
//! Bytes alone seldom come past a checksum. So most bodies also read their data as changes to a small file of the encoder,
//! whose checksums are then mended (`seeds`).

#[cfg(feature = "encode")]
mod choices;
#[cfg(feature = "encode")]
mod codec;
mod container;
#[cfg(feature = "encode")]
mod decoder;
#[cfg(feature = "encode")]
mod encoder;
#[cfg(feature = "formats")]
mod formats;
#[cfg(feature = "encode")]
mod resources;
#[cfg(feature = "formats")]
mod scenes;
#[cfg(feature = "encode")]
mod seeds;
#[cfg(feature = "encode")]
mod sets;

#[cfg(feature = "encode")]
pub use codec::{fuzz_exact, fuzz_keyframe, fuzz_refinement, fuzz_residue};
pub use container::fuzz_container;
#[cfg(test)]
pub(crate) use container::mend;
#[cfg(feature = "encode")]
pub use decoder::{fuzz_chunks, fuzz_decode};
#[cfg(feature = "encode")]
pub use encoder::fuzz_round_trip;
#[cfg(feature = "formats")]
pub use formats::fuzz_formats;
#[cfg(feature = "encode")]
pub use resources::fuzz_resources;
#[cfg(feature = "formats")]
pub use scenes::{fuzz_scene_writer, fuzz_scenes};
#[cfg(feature = "encode")]
pub use sets::fuzz_sets;
