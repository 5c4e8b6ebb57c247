//! unweld: a progressive-mesh encoding and streaming format.

pub mod codec;
pub mod entropy;
pub mod error;
pub mod limits;
pub mod mesh;
pub mod refine;
#[cfg(feature = "encode")]
pub mod simplify;

pub use error::{Error, Result};
