//! Levels as JSON.

use serde_json::{Value, json};

use crate::container::Contents;
use crate::store::Version;

/// What a client wants to know of a version before it asks for atoms (spec §12.3).
pub fn table(name: &str, version: &Version, contents: &Contents) -> Value {
    let header = &contents.header;
    let levels: Vec<Value> = (0..header.level_count).rev().filter_map(|j| level(contents, j)).collect();
    let length = |atoms| {
        let bytes = contents.bytes(atoms);
        bytes.end - bytes.start
    };
    json!({
        "name": name,
        "version": version.tag,
        "bytes": version.bytes,
        "head_bytes": header.table_end(),
        "vertices": header.vertices,
        "triangles": header.triangles,
        "origin": header.lattice.origin,
        "far_corner": header.far_corner(),
        "bits": header.lattice.bits,
        "atoms": contents.atoms.len(),
        "residue_bytes": length(contents.residue()),
        "correction_bytes": length(contents.correction()),
        "order_bytes": length(contents.order()),
        "metadata_bytes": length(contents.metadata()),
        "levels": levels,
    })
}

fn level(contents: &Contents, j: u32) -> Option<Value> {
    let level = contents.level(j)?;
    let bytes = contents.bytes(contents.steps(j));
    let keyframe = contents.keyframe(j).map(|atoms| contents.bytes(atoms));
    Some(json!({
        "level": j,
        "vertices": level.vertices,
        "triangles": level.triangles,
        "precision": level.precision,
        "max_error": level.max_error,
        "rms_error": level.rms_error,
        "offset": bytes.start,
        "bytes": bytes.end - bytes.start,
        "atoms": [contents.steps(j).start, contents.steps(j).end],
        "prefix_bytes": contents.bytes(contents.prefix(j)).end,
        "keyframe": keyframe.map(|bytes| json!({ "offset": bytes.start, "bytes": bytes.end - bytes.start })),
    }))
}
