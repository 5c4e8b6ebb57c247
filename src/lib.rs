//! unweld: a progressive-mesh encoding and streaming format.

pub mod error;
#[cfg(feature = "formats")]
pub mod formats;
pub mod limits;
pub mod mesh;

pub use error::{Error, Result};
