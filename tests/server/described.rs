//! The description of the interface holds: every route, query, status and member of an answer in it is there, and no other.

use super::sets::set;
use super::{Answer, Served, folder_with, mesh};
use serde_json::Value;
use std::collections::BTreeSet;
use unweld::mesh::shapes;

#[test]
fn the_description_holds() {
    let (file, contents) = mesh();
    let folder = folder_with("bunny.uwm", &file);
    let served = Served::folder(folder.path());
    let description = served.get("/openapi.json").json();
    assert!(description["openapi"].as_str().unwrap().starts_with("3."));
    assert_eq!(description["info"]["version"], env!("CARGO_PKG_VERSION"));
    let mut tried = 0;
    for (path, item) in description["paths"].as_object().unwrap() {
        let (route, told) = (
            path.replace("{name}", "bunny").replace("{level}", &contents.base_level().to_string()),
            &item["get"],
        );
        assert!(item.as_object().unwrap().keys().all(|method| method == "get" || method == "parameters"));
        let plain = served.get(&route);
        conforms(&description, path, told, &plain);
        assert_eq!(plain.status, 200, "{path}");
        assert_eq!(served.ask("HEAD", &route, &[]).status, 200, "{path}");
        // Every query it names is understood, with the example it gives; no other is.
        let parameters = told["parameters"].as_array().cloned().unwrap_or_default();
        let queries: Vec<&Value> = parameters.iter().filter(|p| p["in"] == "query").collect();
        for query in &queries {
            let name = query["name"].as_str().unwrap();
            let example = match query["example"].clone() {
                Value::String(text) if name == "v" => {
                    text.replace("VERSION", plain.header("etag").trim_matches('"'))
                }
                Value::String(text) => text,
                other => other.to_string(),
            };
            let answer = served.get(&format!("{route}?{name}={example}"));
            assert_eq!(answer.status, 200, "{path} {name}={example}: {answer:?}");
            conforms(&description, path, told, &answer);
            tried += 1;
        }
        if path != "/" && path != "/healthz" && path != "/metrics" && path != "/openapi.json" {
            let unknown = served.get(&format!("{route}?surely_unknown=1"));
            assert_eq!(unknown.status, 400, "{path}");
            conforms(&description, path, told, &unknown);
            let understood =
                unknown.json()["detail"].as_str().unwrap().split("understood are ").nth(1).map(str::to_owned);
            let understood: BTreeSet<String> =
                understood.iter().flat_map(|text| text.split(", ")).map(str::to_owned).collect();
            let named = queries.iter().map(|q| q["name"].as_str().unwrap().to_owned());
            assert_eq!(understood, named.collect(), "{path}");
        }
        if path.starts_with("/meshes/") {
            let tag = plain.header("etag");
            let cases = [
                ("If-None-Match", tag, 304),
                ("If-Match", "\"x\"", 412),
                ("Range", "bytes=0-1", 206),
                ("Range", "bytes=99999999-", 416),
            ];
            for (name, value, status) in cases {
                let answer = served.ask("GET", &route, &[&format!("{name}: {value}")]);
                conforms(&description, path, told, &answer);
                assert!(answer.status == status || path.ends_with("/levels"), "{path} {name}");
            }
            for (bad, status) in [("nothing", 404), ("a%00", 400)] {
                let answer = served.get(&path.replace("{name}", bad).replace("{level}", "0"));
                assert_eq!(answer.status, status, "{path}");
                conforms(&description, path, told, &answer);
            }
            let answer = served.get(&format!("{route}?v=old"));
            assert_eq!(answer.status, 410);
            conforms(&description, path, told, &answer);
        }
        tried += 1;
    }
    assert!(tried >= 20, "{tried}");
    std::fs::write(folder.path().join("lods.uwm"), set(&shapes::bumpy_sphere(2, 1))).unwrap();
    let paths = &description["paths"];
    let cases = [
        ("/meshes", "/meshes", 200),
        ("/meshes/{name}/levels", "/meshes/lods/levels", 200),
        ("/meshes/{name}/refine", "/meshes/lods/refine", 404),
        ("/meshes/{name}/keyframe/{level}", "/meshes/lods/keyframe/0", 404),
    ];
    for (path, route, status) in cases {
        let answer = served.get(route);
        assert_eq!(answer.status, status, "{route}");
        conforms(&description, path, &paths[path]["get"], &answer);
    }
}

/// Whether status, media type, headers and body of an answer are as they are told.
fn conforms(description: &Value, path: &str, told: &Value, answer: &Answer) {
    let response = resolve(description, &told["responses"][answer.status.to_string()]);
    assert!(response.is_object(), "{path}: {} is not told", answer.status);
    for (name, header) in response["headers"].as_object().into_iter().flatten() {
        let optional = header["required"] == false;
        assert!(
            optional || !answer.header(&name.to_lowercase()).is_empty(),
            "{path}: {} has no {name}",
            answer.status
        );
    }
    let Some(content) = response["content"].as_object() else {
        assert!(answer.body.is_empty(), "{path}: {} has a body", answer.status);
        return;
    };
    let media_type = answer.header("content-type").split(';').next().unwrap();
    let told = content.get(media_type).unwrap_or_else(|| panic!("{path}: {media_type} is not told"));
    if media_type.ends_with("json") {
        agrees(description, &told["schema"], &answer.json(), path);
    }
}

fn resolve<'a>(description: &'a Value, value: &'a Value) -> &'a Value {
    match value["$ref"].as_str() {
        Some(reference) => {
            description.pointer(reference.trim_start_matches('#')).expect("a reference leads somewhere")
        }
        None => value,
    }
}

/// As much of JSON Schema as the description uses.
fn agrees(description: &Value, schema: &Value, value: &Value, place: &str) {
    let schema = resolve(description, schema);
    if let Some(choices) = schema["oneOf"].as_array() {
        let fits = |choice: &&Value| {
            let required = resolve(description, choice)["required"].as_array().unwrap();
            required.iter().all(|name| value.get(name.as_str().unwrap()).is_some())
        };
        let kind = |choice: &&Value| {
            let kind = &resolve(description, choice)["properties"]["kind"]["enum"][0];
            kind.is_null() || *kind == value["kind"]
        };
        let fitting: Vec<&Value> = choices.iter().filter(fits).filter(kind).collect();
        assert_eq!(fitting.len(), 1, "{place}");
        return agrees(description, fitting[0], value, place);
    }
    let kinds: Vec<&str> = match &schema["type"] {
        Value::Array(kinds) => kinds.iter().map(|kind| kind.as_str().unwrap()).collect(),
        Value::String(kind) => vec![kind],
        _ => return,
    };
    let kind = match value {
        Value::Null => "null",
        Value::Bool(_) => "boolean",
        Value::Number(n) if n.is_u64() && kinds.contains(&"integer") => "integer",
        Value::Number(_) => "number",
        Value::String(_) => "string",
        Value::Array(_) => "array",
        Value::Object(_) => "object",
    };
    assert!(kinds.contains(&kind), "{place}: {value} is no {kinds:?}");
    match value {
        Value::Array(items) => {
            items.iter().for_each(|item| agrees(description, &schema["items"], item, place))
        }
        Value::Object(members) => {
            for name in schema["required"].as_array().into_iter().flatten() {
                assert!(members.contains_key(name.as_str().unwrap()), "{place}: {name} is missing");
            }
            let Some(properties) = schema["properties"].as_object() else { return };
            for (name, member) in members {
                let told = properties.get(name).unwrap_or_else(|| panic!("{place}: {name} is not told"));
                agrees(description, told, member, &format!("{place} {name}"));
            }
        }
        _ => {}
    }
}
