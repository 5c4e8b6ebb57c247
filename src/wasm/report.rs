//! Events as JSON.

use super::corners;
use crate::codec::residue::Residue;
use crate::container::{AttributeEntry, Contents, Header, Metadata, Plan, SetContents};
use crate::error::Error;
use crate::mesh::attributes::Domain;
use serde_json::{Value, json};
use std::ops::Range;
use std::sync::Arc;

/// What the file holds, and where what is wanted of it ends.
pub fn contents(contents: &Contents, wanted: Value) -> Value {
    let header = &contents.header;
    let levels: Vec<Value> = (0..header.level_count).map(|j| of_level(contents, j)).collect();
    json!({
        "type": "contents",
        "set": false,
        "vertices": header.vertices,
        "triangles": header.triangles,
        "bits": header.lattice.bits,
        "step": header.lattice.step,
        "min": header.lattice.origin,
        "max": header.far_corner(),
        "levels": levels,
        "tableEnd": header.table_end(),
        "fileBytes": contents.file_bytes(),
        "wanted": wanted,
        "attributes": [{ "name": "position", "components": 3 }, { "name": "normal", "components": 3 }],
        "fileAttributes": file_attributes(&contents.attributes),
        "resources": resources(contents),
    })
}

/// The same of a set of meshes: its members as levels.
pub fn set(set: &SetContents, wanted: Value) -> Value {
    let mut value = contents(&set.members[0].contents, wanted);
    value["set"] = true.into();
    value["levels"] = (0..set.members.len() as u32).map(|number| member(set, number, "")).collect();
    value["tableEnd"] = set.head_end().into();
    value["fileBytes"] = set.file_bytes().into();
    value["resources"] = Value::Array(Vec::new());
    value
}

/// A member as a level, or that it is complete.
pub fn member(set: &SetContents, number: u32, kind: &str) -> Value {
    let member = &set.members[number as usize];
    let mut value = of_level(&member.contents, 0);
    value["level"] = number.into();
    value["end"] = member.bytes.end.into();
    if !kind.is_empty() {
        value["type"] = kind.into();
    }
    value
}

/// What is to be decoded of a set.
pub fn wanted_member(set: &SetContents, number: u32, end: u64) -> Value {
    let level = set.members[number as usize].level();
    json!({ "level": number, "vertices": level.vertices, "triangles": level.triangles, "end": end, "holes": [] })
}

/// The attributes of a member that takes another one's place.
pub fn attributes(contents: &Contents, members: usize) -> Value {
    let mut told = file_attributes(&contents.attributes);
    for one in &mut told {
        one["level"] = (members - 1).into();
    }
    json!({ "type": "attributes", "fileAttributes": told })
}

/// What will be decoded is something else now.
pub fn other(wanted: Value) -> Value {
    json!({ "type": "wanted", "wanted": wanted })
}

/// A resource is whole.
pub fn resource(number: usize) -> Value {
    json!({ "type": "resource", "number": number })
}

/// A level is complete.
pub fn level(contents: &Contents, level: u32) -> Value {
    let mut value = of_level(contents, level);
    value["type"] = "level".into();
    value
}

/// The residue of level 0 is there.
pub fn residue(residue: &Residue) -> Value {
    let counts = residue.counts();
    json!({
        "type": "residue",
        "triangles": counts.triangles,
        "vertices": counts.extra_vertices,
        "groups": counts.groups,
        "groupedVertices": counts.grouped_vertices,
        "reversedTriangles": counts.reversed_triangles,
    })
}

/// The metadata are there.
pub fn metadata(metadata: &Metadata, header: &Header) -> Value {
    json!({
        "type": "metadata",
        "generator": metadata.generator,
        "source": metadata.source,
        "settings": metadata.settings,
        "dropped": metadata.dropped,
        "conditioning": metadata.findings(header),
        "diagonal": metadata.diagonal_of(header),
        "partNames": metadata.part_names,
    })
}

/// What was wanted is there.
pub fn end() -> Value {
    json!({ "type": "end" })
}

/// What ended decoding; names the atom, where it lies in one.
pub fn fault(error: &Error, contents: Option<&Arc<Contents>>) -> Value {
    let mut value = json!({ "type": "fault", "message": error.to_string() });
    match error {
        Error::Format(fault) => {
            value["kind"] = "format".into();
            value["offset"] = fault.offset.into();
            value["section"] = fault.section.into();
            let atoms = contents.map_or(&[][..], |contents| &contents.atoms);
            let index = atoms.partition_point(|atom| atom.end() <= fault.offset);
            if let Some(atom) = atoms.get(index).filter(|atom| atom.offset <= fault.offset) {
                let kind = format!("{:?}", atom.kind).to_ascii_lowercase();
                value["atom"] = json!({ "index": index, "kind": kind, "level": atom.level });
                let named = fault.what.starts_with("atom ");
                if !named {
                    let what = format!(
                        "byte {}: atom {index} ({kind}, level {}): {}",
                        fault.offset, atom.level, fault.what
                    );
                    value["message"] = format!("{what} (spec §{})", fault.section).into();
                }
            }
        }
        Error::Limit { .. } => value["kind"] = "limit".into(),
        _ => value["kind"] = "other".into(),
    }
    value
}

/// What the source had at corners and triangles.
fn file_attributes(entries: &[AttributeEntry]) -> Vec<Value> {
    let named = corners::names(entries).into_iter().zip(entries);
    let told = named.map(|(name, entry)| {
        json!({
            "name": name,
            "semantic": entry.semantic.name(),
            "set": entry.set,
            "domain": if entry.domain == Domain::Corner { "corner" } else { "triangle" },
            "components": entry.components,
            "type": corners::stored(entry).name(),
            "normalised": entry.normalised,
            "partial": entry.partial,
            "level": entry.birth,
            "error": entry.error,
        })
    });
    told.collect()
}

/// What is to be decoded, up to byte `end`, and where bytes before that need not come.
pub fn wanted(plan: &Plan, end: u64, holes: &[[u64; 2]]) -> Value {
    json!({
        "level": plan.level,
        "vertices": plan.vertices,
        "triangles": plan.triangles,
        "end": end,
        "holes": holes,
    })
}

/// What the table of contents says of resources.
fn resources(contents: &Contents) -> Vec<Value> {
    let told = contents.resources.iter().map(|entry| {
        let Range { start, end } = contents.bytes(entry.atoms.clone());
        json!({ "kind": entry.kind.name(), "level": entry.place, "bytes": entry.bytes, "range": [start, end] })
    });
    told.collect()
}

fn of_level(contents: &Contents, level: u32) -> Value {
    let end = contents.bytes(contents.prefix(level)).end;
    contents.level(level).map_or(Value::Null, |entry| {
        let names =
            if entry.attributes.is_empty() { Vec::new() } else { corners::names(&contents.attributes) };
        let errors = entry.attributes.iter().map(
            |error| json!({ "name": names.get(error.attribute), "error": error.error, "high": error.high }),
        );
        json!({
            "level": level,
            "vertices": entry.vertices,
            "triangles": entry.triangles,
            "maxError": entry.max_error,
            "rmsError": entry.rms_error,
            "attributeErrors": errors.collect::<Vec<_>>(),
            "end": end,
        })
    })
}
