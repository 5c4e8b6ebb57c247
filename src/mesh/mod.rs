//! Ground: typed indices, the corner table, the lattice, conditioning, distances. Knows no codec.

pub mod attributes;
mod buckets;
pub mod corner_table;
#[cfg(feature = "encode")]
pub mod distance;
pub mod index;
pub mod indexed;
pub mod lattice;
pub mod paint;
pub(crate) mod prefetch;
pub(crate) mod random;
#[doc(hidden)]
pub mod shapes;
pub mod topology;

pub use attributes::Attribute;
pub use corner_table::CornerTable;
pub use index::{Corner, CornerMap, Triangle, Vertex};
pub use indexed::IndexedMesh;
pub use lattice::Lattice;
pub use paint::Paint;
