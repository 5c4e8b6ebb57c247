//! unweld: a progressive-mesh encoding and streaming format.

pub mod codec;
pub mod entropy;
pub mod error;
pub mod limits;
pub mod mesh;
pub mod refine;

pub use error::{Error, Result};
