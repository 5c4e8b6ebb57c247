//! Sets of meshes as JSON.

use serde::Serialize;

use super::library::Unreadable;
use crate::container::{Header, SetContents, parse_set};
use crate::error::FormatError;
use crate::store::Object;

/// What a client wants to know of a set before it asks for members (spec §12.3).
#[derive(Debug, Serialize)]
struct Table {
    kind: &'static str,
    name: String,
    version: String,
    bytes: u64,
    head_bytes: u64,
    origin: [f64; 3],
    far_corner: [f64; 3],
    bits: u32,
    finest_first: bool,
    members: Vec<Row>,
}

#[derive(Debug, Serialize)]
struct Row {
    member: u32,
    vertices: u32,
    triangles: u32,
    max_error: f64,
    rms_error: f64,
    beside_another: bool,
    offset: u64,
    bytes: u64,
    /// Where the first of the members begins that it takes.
    chain_offset: u64,
}

/// The members of a set as JSON, of this name, in this version.
///
/// # Errors
/// [`Unreadable`].
pub async fn members(name: &str, object: &Object) -> Result<Vec<u8>, Unreadable> {
    let cut = |at| FormatError::new(at, "15.1", "the table of the set is cut off");
    let start = object.read(0..object.version.bytes.min(Header::SIZE as u64)).await?;
    let start = start.first_chunk().ok_or_else(|| cut(start.len() as u64))?;
    let length = SetContents::head_bytes(start)? as u64;
    let head = object.read(0..object.version.bytes.min(length)).await?;
    let set = parse_set(&head)?.ok_or_else(|| cut(head.len() as u64))?;
    let row = |number: u32| {
        let member = set.members.get(number as usize)?;
        let first = *set.chain(number).first()?;
        let level = member.level();
        Some(Row {
            member: number,
            vertices: level.vertices,
            triangles: level.triangles,
            max_error: level.max_error,
            rms_error: level.rms_error,
            beside_another: member.leans,
            offset: member.bytes.start,
            bytes: member.bytes.end - member.bytes.start,
            chain_offset: set.members.get(first as usize)?.bytes.start,
        })
    };
    let header = &set.members[0].contents.header;
    let table = Table {
        kind: "set",
        name: name.to_owned(),
        version: object.version.tag.clone(),
        bytes: object.version.bytes,
        head_bytes: length,
        origin: header.lattice.origin,
        far_corner: header.far_corner(),
        bits: header.lattice.bits,
        finest_first: set.finest_first,
        members: (0..set.members.len() as u32).rev().filter_map(row).collect(),
    };
    Ok(serde_json::to_vec(&table).unwrap_or_default())
}
