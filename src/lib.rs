//! unweld: a progressive-mesh encoding and streaming format.

pub mod codec;
pub mod container;
pub mod decoder;
#[cfg(feature = "encode")]
pub mod encoder;
pub mod entropy;
pub mod error;
#[cfg(feature = "formats")]
pub mod formats;
#[doc(hidden)]
pub mod fuzzing;
pub mod limits;
pub mod mesh;
pub mod refine;
#[cfg(feature = "cli")]
pub mod render;
#[cfg(feature = "encode")]
pub mod simplify;

pub use error::{Error, Result};
