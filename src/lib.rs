//! unweld: a progressive-mesh encoding and streaming format.

pub mod error;
pub mod limits;
pub mod mesh;

pub use error::{Error, Result};
