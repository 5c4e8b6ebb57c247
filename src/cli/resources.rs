//! What the resources of a scene are, as far as its JSON tells.

use super::numbers::{columns, count, grouped};
use super::scene::LISTS;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use unweld::container::{Contents, ResourceKind};

/// Resources with what they are.
pub struct Resources {
    list: Vec<Line>,
    scene: Option<Value>,
}

struct Line {
    kind: ResourceKind,
    place: u32,
    offset: u64,
    bytes: u64,
    role: Option<Role>,
}

/// What a buffer is for.
#[derive(Clone, Debug, PartialEq)]
enum Role {
    /// An image as it was.
    Original { image: usize, name: String },
    /// A small copy of an image, of so many pixels along its longer side.
    Preview { image: usize, name: String, size: u64 },
    /// Something else: samples, matrices, accessors.
    Binary,
}

impl Resources {
    /// Those of a file; `scene` is its JSON, where it is known.
    pub fn new(contents: &Contents, scene: Option<&[u8]>) -> Self {
        let scene: Option<Value> = scene.and_then(|json| serde_json::from_slice(json).ok());
        let roles = scene.as_ref().map(roles);
        let first = usize::from(contents.scene().is_some());
        let lines = contents.resources.iter().enumerate().map(|(number, entry)| {
            let buffer = number.checked_sub(first).filter(|_| entry.kind == ResourceKind::Buffer);
            let told = buffer.zip(roles.as_ref());
            Line {
                kind: entry.kind,
                place: entry.place,
                offset: contents.bytes(entry.atoms.clone()).start,
                bytes: entry.bytes,
                role: told.map(|(buffer, roles)| roles.get(&buffer).cloned().unwrap_or(Role::Binary)),
            }
        });
        Self { list: lines.collect(), scene }
    }

    /// Bytes of all of them.
    pub fn bytes(&self) -> u64 {
        self.list.iter().map(|line| line.bytes).sum()
    }

    /// What the scene has, in words: its lists that are not empty.
    pub fn scene_text(&self) -> Option<String> {
        let scene = self.scene.as_ref()?;
        let counts = LISTS.iter().map(|&(name, noun)| (length(scene, name), noun));
        let texts: Vec<String> = counts.filter(|&(n, _)| n > 0).map(|(n, noun)| count(n, noun)).collect();
        (!texts.is_empty()).then(|| texts.join(", "))
    }

    /// One JSON object.
    pub fn json(&self) -> Value {
        let list = self.list.iter().map(|line| {
            let mut value = json!({
                "kind": line.kind.name(),
                "level": line.place,
                "offset": line.offset,
                "bytes": line.bytes,
            });
            match &line.role {
                Some(Role::Original { image, name }) => {
                    value["role"] = "original".into();
                    value["image"] = json!({ "number": image, "name": name });
                }
                Some(Role::Preview { image, name, size }) => {
                    value["role"] = "preview".into();
                    value["image"] = json!({ "number": image, "name": name });
                    value["size"] = (*size).into();
                }
                Some(Role::Binary) => value["role"] = "binary".into(),
                None => {}
            }
            value
        });
        let scene = self.scene.as_ref().map(|scene| {
            let counts = LISTS.iter().map(|&(name, _)| (name.to_owned(), json!(length(scene, name))));
            Value::Object(counts.collect())
        });
        json!({ "bytes": self.bytes(), "scene": scene, "list": list.collect::<Vec<_>>() })
    }

    /// A line each, as they stand in the file; none where there are none.
    pub fn table(&self) -> String {
        if self.list.is_empty() {
            return String::new();
        }
        let heads = ["resource", "behind level", "bytes", "up to here", "what"];
        let mut lines = vec![heads.map(str::to_owned).to_vec()];
        for (number, line) in self.list.iter().enumerate() {
            let what = match &line.role {
                _ if line.kind == ResourceKind::Scene => "scene".to_owned(),
                Some(Role::Original { image, name }) => format!("image {image}{}", told(name)),
                Some(Role::Preview { image, name, size }) => {
                    format!("{size} px of image {image}{}", told(name))
                }
                _ => line.kind.name().to_owned(),
            };
            let numbers =
                [line.place.to_string(), grouped(line.bytes), grouped(line.offset + line.bytes), what];
            lines.push(std::iter::once(number.to_string()).chain(numbers).collect());
        }
        columns(&lines, &[4]).lines().map(|line| line.trim_end().to_owned() + "\n").collect()
    }
}

fn told(name: &str) -> String {
    if name.is_empty() { String::new() } else { format!(", {name}") }
}

/// The roles of buffers that hold an image, by their numbers, as the JSON of a scene tells.
pub fn roles_of(scene: &[u8]) -> BTreeMap<usize, unweld::formats::Role> {
    use unweld::formats::Role as Told;
    let scene = serde_json::from_slice(scene).unwrap_or_default();
    let told = |role| match role {
        Role::Original { image, .. } => Told::Original { image },
        Role::Preview { image, size, .. } => {
            Told::Preview { image, size: u32::try_from(size).unwrap_or(u32::MAX) }
        }
        Role::Binary => Told::Binary,
    };
    roles(&scene).into_iter().map(|(buffer, role)| (buffer, told(role))).collect()
}

/// By buffer, those that hold an image.
fn roles(scene: &Value) -> BTreeMap<usize, Role> {
    let views = &scene["bufferViews"];
    let buffer_of =
        |view: &Value| Some(views[usize::try_from(view.as_u64()?).ok()?]["buffer"].as_u64()? as usize);
    let mut roles = BTreeMap::new();
    for (image, entry) in scene["images"].as_array().into_iter().flatten().enumerate() {
        let progressive = &entry["extensions"]["UNWELD_progressive_mesh"];
        let names = [&entry["name"], &progressive["uri"]];
        let name = names.into_iter().find_map(Value::as_str).unwrap_or("").to_owned();
        let original = buffer_of(&entry["bufferView"]);
        roles.extend(original.map(|buffer| (buffer, Role::Original { image, name: name.clone() })));
        for preview in progressive["previews"].as_array().into_iter().flatten() {
            let size = preview["size"].as_u64().unwrap_or(0);
            let buffer = buffer_of(&preview["bufferView"]);
            roles.extend(buffer.map(|buffer| (buffer, Role::Preview { image, name: name.clone(), size })));
        }
    }
    roles
}

fn length(scene: &Value, list: &str) -> u64 {
    scene[list].as_array().map_or(0, |list| list.len() as u64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use unweld::encoder::{Encoder, Place, Resource};
    use unweld::mesh::shapes;

    #[test]
    fn the_scene_says_what_they_are() {
        let scene = br#"{"nodes":[{},{}],"meshes":[{}],"images":[{"bufferView":2,"name":"bark","extensions":
            {"UNWELD_progressive_mesh":{"previews":[{"size":64,"bufferView":1}],"uri":"bark.png"}}}],
            "bufferViews":[{"buffer":0},{"buffer":1},{"buffer":2}]}"#;
        let buffer =
            |place, bytes: usize| Resource { kind: ResourceKind::Buffer, place, bytes: vec![1; bytes] };
        let resources = vec![
            Resource { kind: ResourceKind::Scene, place: Place::Base, bytes: scene.to_vec() },
            buffer(Place::Base, 10),
            buffer(Place::Base, 20),
            buffer(Place::Finest, 30),
        ];
        let file = Encoder::default().resources(resources).encode_to_vec(&shapes::sphere(2)).unwrap();
        let contents = unweld::container::parse_contents(&file).unwrap().unwrap();
        let told = Resources::new(&contents, Some(scene));
        assert_eq!(told.scene_text().as_deref(), Some("2 nodes, 1 mesh, 1 image"));
        let json = told.json();
        let roles: Vec<_> =
            json["list"].as_array().unwrap().iter().map(|line| line["role"].as_str()).collect();
        assert_eq!(roles, [None, Some("binary"), Some("preview"), Some("original")]);
        assert_eq!(
            (&json["list"][2]["size"], &json["list"][3]["image"]["name"]),
            (&json!(64), &json!("bark"))
        );
        assert_eq!((&json["scene"]["nodes"], json["list"][3]["bytes"].as_u64()), (&json!(2), Some(30)));
        let table = told.table();
        let lines: Vec<&str> = table.lines().collect();
        assert_eq!(lines.len(), 5);
        assert!(
            lines[3].ends_with("64 px of image 0, bark") && lines[4].ends_with("image 0, bark"),
            "{table}"
        );
        // Nothing is known of what they are without it, nor of one that is no JSON.
        for scene in [None, Some(&b"{"[..])] {
            let told = Resources::new(&contents, scene);
            assert!(told.json()["list"][2]["role"].is_null() && told.scene_text().is_none());
        }
    }
}
