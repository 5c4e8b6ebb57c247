//! What an operation, a level and a history are; applying and undoing them on a corner table (spec §5).

pub mod birth;
pub mod history;
#[cfg(any(test, feature = "encode"))]
pub mod labels;
pub mod mesh;
pub mod operation;
pub mod roots;
pub mod stellar;
pub mod wedges;

pub use birth::Birth;
pub use history::{History, Level};
#[cfg(any(test, feature = "encode"))]
pub use labels::{Labels, Ring};
pub use mesh::{ProgressiveMesh, from_cell};
pub use operation::{Operation, OperationError, Site};
pub use roots::{Root, Roots};
pub use wedges::{Carried, Wedges};
