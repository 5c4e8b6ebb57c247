//! The `.uwm` container: framing only (spec §3). It knows levels, atoms and checksums, but no triangle.
//!
//! ```text
//! | header | table of contents | base | level n-2 | ... | level 0 | residue | attributes | metadata | keyframes |
//! 0        16                  ^ atoms, each right behind the one before
//! ```

mod attributes;
mod checksum;
mod constant;
mod contents;
mod errors;
mod fields;
mod header;
mod magnitude;
pub mod metadata;
mod parse;
pub mod plan;
mod resources;
mod scene;
mod set;
mod table;
#[cfg(test)]
pub(crate) mod testing;
mod want;
#[cfg(any(test, feature = "encode"))]
mod write;

pub use attributes::AttributeEntry;
pub use contents::{Atom, AtomKind, AttributeError, Contents, Level};
pub use header::{Coding, Header, MAGIC, VERSION};
pub use metadata::{FINDINGS, Metadata};
pub use parse::{Parsed, Parser, parse_contents};
pub(crate) use plan::kept;
pub use plan::{Part, Plan, plan, plan_from_keyframe};
pub use resources::{ResourceEntry, ResourceKind};
pub use scene::PackedScene;
#[cfg(any(test, feature = "encode"))]
pub use scene::packed_scene;
#[cfg(any(test, feature = "encode"))]
pub use set::write_set;
pub use set::{Member, SetContents, parse_set};
pub use want::{Measure, Want};
#[cfg(any(test, feature = "encode"))]
pub use write::FileBuilder;
