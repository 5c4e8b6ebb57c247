//! Where a glTF's JSON names accessors and buffer views, but for images.
//!
//! What is in extensions that are not known is taken to name them under the keys `accessor` and `bufferView`, as all extensions of Khronos
//! that we know do, but for those of the table.

use serde_json::Value;

use crate::error::Result;

/// What a number names.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Accessor,
    View,
}

/// A number that names something, with the pointer to it.
pub(super) struct Reference<'v> {
    pub kind: Kind,
    pub value: &'v mut Value,
    pub pointer: &'v str,
    /// Whether the specification says that it is one. Others may be numbers of another kind.
    pub is_certain: bool,
}

/// Visits all references of a document, each once.
///
/// # Errors
/// Those of `visit`.
pub(super) fn visit(root: &mut Value, visit: &mut dyn FnMut(Reference) -> Result<()>) -> Result<()> {
    for (path, kind) in TABLE {
        descend(root, path, &mut String::new(), kind, visit)?;
    }
    extensions(root, &mut String::new(), false, visit)
}

/// Where the specification has them; `*` stands for each item of a list, or each member of an object.
const TABLE: [(&[&str], Kind); 13] = [
    (&["meshes", "*", "primitives", "*", "attributes", "*"], Kind::Accessor),
    (&["meshes", "*", "primitives", "*", "indices"], Kind::Accessor),
    (&["meshes", "*", "primitives", "*", "targets", "*", "*"], Kind::Accessor),
    (&["skins", "*", "inverseBindMatrices"], Kind::Accessor),
    (&["animations", "*", "samplers", "*", "input"], Kind::Accessor),
    (&["animations", "*", "samplers", "*", "output"], Kind::Accessor),
    (&["nodes", "*", "extensions", "EXT_mesh_gpu_instancing", "attributes", "*"], Kind::Accessor),
    (
        &["extensions", "EXT_structural_metadata", "propertyTables", "*", "properties", "*", "values"],
        Kind::View,
    ),
    (
        &["extensions", "EXT_structural_metadata", "propertyTables", "*", "properties", "*", "arrayOffsets"],
        Kind::View,
    ),
    (
        &["extensions", "EXT_structural_metadata", "propertyTables", "*", "properties", "*", "stringOffsets"],
        Kind::View,
    ),
    (&["accessors", "*", "bufferView"], Kind::View),
    (&["accessors", "*", "sparse", "indices", "bufferView"], Kind::View),
    (&["accessors", "*", "sparse", "values", "bufferView"], Kind::View),
];

fn descend(
    value: &mut Value,
    path: &[&str],
    pointer: &mut String,
    kind: Kind,
    visit: &mut dyn FnMut(Reference) -> Result<()>,
) -> Result<()> {
    let Some((&step, rest)) = path.split_first() else {
        return visit(Reference { kind, value, pointer, is_certain: true });
    };
    let length = pointer.len();
    match (step, value) {
        ("*", Value::Array(list)) => {
            for (k, item) in list.iter_mut().enumerate() {
                pointer.push_str(&format!("/{k}"));
                descend(item, rest, pointer, kind, visit)?;
                pointer.truncate(length);
            }
        }
        ("*", Value::Object(object)) => {
            for (key, item) in object.iter_mut() {
                push(pointer, key);
                descend(item, rest, pointer, kind, visit)?;
                pointer.truncate(length);
            }
        }
        (step, Value::Object(object)) => {
            if let Some(item) = object.get_mut(step) {
                push(pointer, step);
                descend(item, rest, pointer, kind, visit)?;
                pointer.truncate(length);
            }
        }
        _ => {}
    }
    Ok(())
}

/// Looks for extensions, wherever they are, and for references in them: by their names, for nobody knows all extensions.
fn extensions(
    value: &mut Value,
    pointer: &mut String,
    is_within: bool,
    visit: &mut dyn FnMut(Reference) -> Result<()>,
) -> Result<()> {
    let length = pointer.len();
    match value {
        Value::Array(list) => {
            for (k, item) in list.iter_mut().enumerate() {
                pointer.push_str(&format!("/{k}"));
                extensions(item, pointer, is_within, visit)?;
                pointer.truncate(length);
            }
        }
        Value::Object(object) => {
            for (key, item) in object.iter_mut() {
                push(pointer, key);
                let kind = match key.as_str() {
                    "accessor" if is_within => Some(Kind::Accessor),
                    "bufferView" if is_within => Some(Kind::View),
                    _ => None,
                };
                match (kind, item.is_u64()) {
                    (Some(kind), true) => visit(Reference { kind, value: item, pointer, is_certain: false })?,
                    _ if key == "extras" => {}
                    _ => extensions(item, pointer, is_within || key == "extensions", visit)?,
                }
                pointer.truncate(length);
            }
        }
        _ => {}
    }
    Ok(())
}

fn push(pointer: &mut String, key: &str) {
    pointer.push('/');
    pointer.push_str(&key.replace('~', "~0").replace('/', "~1"));
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn all_are_found_once() {
        let mut document = json!({
            "accessors": [{"bufferView": 1, "sparse": {"indices": {"bufferView": 2}, "values": {"bufferView": 3}}}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 4, "a/b": 5}, "indices": 6, "targets": [{"POSITION": 7}]}]}],
            "animations": [{"samplers": [{"input": 8, "output": 9}]}],
            "skins": [{"inverseBindMatrices": 10}],
            "nodes": [{"extensions": {"EXT_mesh_gpu_instancing": {"attributes": {"SCALE": 11}}}, "extras": {"bufferView": 99}}],
            "materials": [{"extensions": {"X": {"of": [{"bufferView": 12, "accessor": "no"}], "extras": {"accessor": 99}}}}],
            "extensions": {"EXT_structural_metadata": {"propertyTables": [{"properties": {"p": {"values": 13}}}]}},
        });
        let mut found = Vec::new();
        visit(&mut document, &mut |reference| {
            found.push((reference.value.as_u64().unwrap(), reference.kind, reference.pointer.to_owned()));
            Ok(())
        })
        .unwrap();
        found.sort_by_key(|(number, ..)| *number);
        let numbers: Vec<u64> = found.iter().map(|(number, ..)| *number).collect();
        assert_eq!(numbers, (1..=13).collect::<Vec<_>>());
        assert!(found.iter().all(|(n, kind, _)| (*kind == Kind::View) == [1, 2, 3, 12, 13].contains(n)));
        assert_eq!(found[4].2, "/meshes/0/primitives/0/attributes/a~1b");
        assert_eq!(found[11].2, "/materials/0/extensions/X/of/0/bufferView");
        for (_, _, pointer) in &found {
            assert!(document.pointer(pointer).is_some(), "{pointer}");
        }
    }
}
