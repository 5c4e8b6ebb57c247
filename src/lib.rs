//! unweld: a progressive-mesh encoding and streaming format.

pub mod container;
pub mod entropy;
pub mod error;
#[doc(hidden)]
pub mod fuzzing;
pub mod limits;
pub mod mesh;

pub use error::{Error, Result};
