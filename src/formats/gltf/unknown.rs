//! Extensions that nobody here knows, and the numbers in them: each may name an accessor or a buffer view.

use std::collections::{BTreeMap, BTreeSet};

use serde_json::Value;

/// The whole numbers below `most` that extensions have which are not known, by their names; but for those under the keys `accessor` and
/// `bufferView`, which are looked after, and in extras.
pub(super) fn numbers(root: &Value, most: usize) -> BTreeMap<String, BTreeSet<usize>> {
    let mut found = BTreeMap::new();
    look(root, most, &mut found);
    found
}

/// Looks for extensions.
fn look(value: &Value, most: usize, found: &mut BTreeMap<String, BTreeSet<usize>>) {
    match value {
        Value::Array(list) => list.iter().for_each(|value| look(value, most, found)),
        Value::Object(object) => {
            for (key, value) in object.iter().filter(|(key, _)| *key != "extras") {
                if let ("extensions", Value::Object(extensions)) = (key.as_str(), value) {
                    let unknown = extensions.iter().filter(|(name, _)| !is_known(name));
                    unknown.for_each(|(name, value)| within(value, "", most, name, found));
                }
                look(value, most, found);
            }
        }
        _ => {}
    }
}

/// Gathers the numbers of an extension.
fn within(value: &Value, key: &str, most: usize, name: &str, found: &mut BTreeMap<String, BTreeSet<usize>>) {
    match value {
        Value::Array(list) => list.iter().for_each(|value| within(value, key, most, name, found)),
        Value::Object(object) => {
            let inner = object.iter().filter(|(key, _)| *key != "extras" && *key != "extensions");
            inner.for_each(|(key, value)| within(value, key, most, name, found));
        }
        Value::Number(number) if !matches!(key, "accessor" | "bufferView") => {
            let number = number.as_u64().and_then(|number| usize::try_from(number).ok());
            if let Some(number) = number.filter(|&number| number < most) {
                found.entry(name.to_owned()).or_default().insert(number);
            }
        }
        _ => {}
    }
}

/// Whether an extension is known to name neither, or is looked after.
fn is_known(name: &str) -> bool {
    KNOWN.iter().any(|begin| name.starts_with(begin))
}

/// Beginnings of their names.
const KNOWN: [&str; 25] = [
    "ADOBE_materials_",
    "AGI_",
    "CESIUM_",
    "EXT_instance_features",
    "EXT_lights_",
    "EXT_mesh_features",
    "EXT_mesh_gpu_instancing",
    "EXT_meshopt_compression",
    "EXT_structural_metadata",
    "EXT_texture_",
    "KHR_animation_pointer",
    "KHR_draco_mesh_compression",
    "KHR_lights_",
    "KHR_materials_",
    "KHR_mesh_quantization",
    "KHR_meshopt_compression",
    "KHR_node_",
    "KHR_techniques_webgl",
    "KHR_texture_",
    "KHR_xmp",
    "MSFT_lod",
    "MSFT_texture_dds",
    "UNWELD_progressive_mesh",
    "VRM",
    "EXT_mesh_manifold",
];

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn numbers_of_what_is_not_known() {
        let root = json!({
            "materials": [{"extensions": {"KHR_materials_x": {"a": 1}, "VENDOR_a": {"b": [2, 3.5, -1, 99], "accessor": 4}}}],
            "extensions": {"VENDOR_b": {"c": {"bufferView": 5, "d": 6}, "extras": 7, "extensions": {"VENDOR_c": 8}}},
            "nodes": [{"extras": {"extensions": {"VENDOR_d": 1}}, "mesh": 9}],
            "VENDOR_e": 1,
        });
        let found = numbers(&root, 10);
        let of =
            |name: &str, list: &[usize]| (name.to_owned(), list.iter().copied().collect::<BTreeSet<_>>());
        assert_eq!(found, [of("VENDOR_a", &[2]), of("VENDOR_b", &[6]), of("VENDOR_c", &[8])].into());
    }
}
