//! Whether two scenes are the same: what their JSON says, and the bytes that it names.

use super::numbers::count;
use super::uwm::Uwm;
use anyhow::anyhow;
use serde_json::Value;
use unweld::formats::{self, Role, Scene, SceneBuffer, Source};

/// Whether a file has the scene of its original: nodes, materials, animations, extras and all else of its JSON, samples of animations, images;
/// `lines` gets what was found.
///
/// # Errors
/// What is another one, with the name of the file.
pub fn compare(
    uwm: &mut Uwm,
    source: &Source,
    original: &str,
    lines: &mut Vec<String>,
) -> anyhow::Result<()> {
    let has_scene = uwm.contents.scene().is_some();
    let expected = match &source.scene {
        None if has_scene => return Err(anyhow!("{}: not {original}: a scene, which that is not", uwm.name)),
        None => {
            let is_gltf = source.format == formats::Format::Gltf;
            lines.extend(is_gltf.then(|| "left out    the scene".to_owned()));
            return Ok(());
        }
        Some(expected) => expected,
    };
    let number = uwm.contents.resources.len();
    let decoder = uwm.resources(0..number)?;
    let buffer = |r: usize| {
        let bytes = uwm.contents.buffer(r).and_then(|number| decoder.resource(number)).unwrap_or_default();
        SceneBuffer { bytes: bytes.to_vec(), role: Role::Binary, useful_from: 0.0 }
    };
    let buffers = (0..number.saturating_sub(1)).map(buffer).collect();
    let found = Scene { json: decoder.scene().unwrap_or_default().to_vec(), buffers };
    let same = |x: &SceneBuffer, y: &SceneBuffer| x.bytes == y.bytes;
    let is_same = found.json == expected.json
        && found.buffers.len() == expected.buffers.len()
        && found.buffers.iter().zip(&expected.buffers).all(|(x, y)| same(x, y));
    let Differences { list, further, previews } =
        if is_same { Differences::default() } else { differences(&found, expected) };
    if !list.is_empty() {
        let further = if further > 0 { format!("; and {further} more") } else { String::new() };
        return Err(anyhow!("{}: not {original}: its scene: {}{further}", uwm.name, list.join("; ")));
    }
    let bytes: u64 = uwm.contents.resources.iter().map(|entry| entry.bytes).sum();
    let others = if previews { "; previews are others" } else { "" };
    lines.push(format!(
        "scene       {} of {}: the same{others}",
        count(number as u64, "resource"),
        count(bytes, "byte")
    ));
    Ok(())
}

/// How two scenes differ.
#[derive(Debug, Default, PartialEq)]
struct Differences {
    /// At their JSON pointers, the first ones.
    list: Vec<String>,
    /// How many more there are.
    further: usize,
    /// Whether previews of images differ, which is no loss: they are made anew from the images.
    previews: bool,
}

fn differences(found: &Scene, expected: &Scene) -> Differences {
    let parsed = |scene: &Scene| serde_json::from_slice(&scene.json).unwrap_or(Value::Null);
    let jsons = [parsed(found), parsed(expected)];
    let mut walk = Walk { scenes: [found, expected], jsons: &jsons, differences: Differences::default() };
    walk.values([&jsons[0], &jsons[1]], &mut String::new());
    walk.differences
}

struct Walk<'a> {
    scenes: [&'a Scene; 2],
    jsons: &'a [Value; 2],
    differences: Differences,
}

impl Walk<'_> {
    fn values(&mut self, [x, y]: [&Value; 2], pointer: &mut String) {
        let length = pointer.len();
        match (x, y) {
            (Value::Object(a), Value::Object(b)) => {
                let further = b.keys().filter(|key| !a.contains_key(*key));
                for key in a.keys().chain(further) {
                    // Where bytes lie is nobody's business: those who name them are asked.
                    if pointer.is_empty() && ["bufferViews", "buffers"].contains(&key.as_str()) {
                        continue;
                    }
                    pointer.push('/');
                    pointer.push_str(&key.replace('~', "~0").replace('/', "~1"));
                    match (a.get(key), b.get(key)) {
                        (x, y) if key == "previews" && pointer.starts_with("/images/") => {
                            self.differences.previews |= !self.same_previews(x, y);
                        }
                        (Some(x), Some(y)) if key == "bufferView" && x.is_u64() && y.is_u64() => {
                            if self.bytes(0, x) != self.bytes(1, y) {
                                self.add(pointer, "other bytes");
                            }
                        }
                        (Some(x), Some(y)) => self.values([x, y], pointer),
                        (Some(_), None) => self.add(pointer, "is there"),
                        _ => self.add(pointer, "is missing"),
                    }
                    pointer.truncate(length);
                }
            }
            (Value::Array(a), Value::Array(b)) => {
                if a.len() != b.len() {
                    self.add(pointer, &format!("{} items, not {}", a.len(), b.len()));
                }
                for (k, (x, y)) in a.iter().zip(b).enumerate() {
                    pointer.push_str(&format!("/{k}"));
                    self.values([x, y], pointer);
                    pointer.truncate(length);
                }
            }
            _ if x != y => self.add(pointer, &format!("{}, not {}", shortened(x), shortened(y))),
            _ => {}
        }
    }

    /// The bytes of a view of one of the two scenes, and how far its elements are apart.
    fn bytes(&self, which: usize, view: &Value) -> Option<(&[u8], Option<u64>)> {
        let view = self.jsons[which]["bufferViews"].get(usize::try_from(view.as_u64()?).ok()?)?;
        let number = |key: &str| usize::try_from(view.get(key).map_or(Some(0), Value::as_u64)?).ok();
        let buffer = self.scenes[which].buffers.get(number("buffer")?)?;
        let begin = number("byteOffset")?;
        let bytes = buffer.bytes.get(begin..begin.checked_add(number("byteLength")?)?)?;
        Some((bytes, view.get("byteStride").and_then(Value::as_u64)))
    }

    fn same_previews(&self, x: Option<&Value>, y: Option<&Value>) -> bool {
        let list = |which: usize, previews: Option<&Value>| -> Vec<(Value, Vec<u8>)> {
            let previews = previews.and_then(Value::as_array).into_iter().flatten();
            let bytes =
                |preview: &Value| self.bytes(which, &preview["bufferView"]).map(|(bytes, _)| bytes.to_vec());
            previews.map(|preview| (preview["size"].clone(), bytes(preview).unwrap_or_default())).collect()
        };
        list(0, x) == list(1, y)
    }

    fn add(&mut self, pointer: &str, what: &str) {
        if self.differences.list.len() == MOST {
            self.differences.further += 1;
            return;
        }
        let image =
            pointer.strip_prefix("/images/").and_then(|rest| rest.split('/').next()?.parse::<usize>().ok());
        let name = image.and_then(|image| {
            let image = self.jsons[1]["images"].get(image)?;
            image["name"].as_str().or_else(|| image["extensions"]["UNWELD_progressive_mesh"]["uri"].as_str())
        });
        let name = name.map_or(String::new(), |name| format!(" ({name})"));
        let pointer = if pointer.is_empty() { "the JSON" } else { pointer };
        self.differences.list.push(format!("{pointer}{name}: {what}"));
    }
}

fn shortened(value: &Value) -> String {
    let text = value.to_string();
    let shown: String = text.chars().take(MOST_LETTERS).collect();
    if shown.len() < text.len() { format!("{shown}...") } else { shown }
}

/// How many differences are named.
const MOST: usize = 8;
const MOST_LETTERS: usize = 40;

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn scene(change: impl Fn(&mut Value, &mut Vec<Vec<u8>>)) -> Scene {
        let mut json = json!({
            "nodes": [{"mesh": 0, "extras": {"a/b": [1, 2.5]}}],
            "accessors": [{"bufferView": 1, "count": 2}],
            "images": [{"bufferView": 0, "name": "bark", "extensions": {"UNWELD_progressive_mesh": {"previews": [{"size": 64, "bufferView": 2}]}}}],
            "bufferViews": [{"buffer": 0, "byteLength": 3}, {"buffer": 1, "byteOffset": 1, "byteLength": 2}, {"buffer": 2, "byteLength": 1}],
        });
        let mut buffers = vec![b"abc".to_vec(), b"defg".to_vec(), b"h".to_vec()];
        change(&mut json, &mut buffers);
        let buffers =
            buffers.into_iter().map(|bytes| SceneBuffer { bytes, role: Role::Binary, useful_from: 0.0 });
        Scene { json: json.to_string().into_bytes(), buffers: buffers.collect() }
    }

    fn told(change: impl Fn(&mut Value, &mut Vec<Vec<u8>>)) -> Differences {
        differences(&scene(change), &scene(|_, _| ()))
    }

    #[test]
    fn what_differs_is_named() {
        let one = |text: &str| Differences { list: vec![text.to_owned()], ..Differences::default() };
        assert_eq!(told(|json, _| json["nodes"][0]["mesh"] = json!(1)), one("/nodes/0/mesh: 1, not 0"));
        assert_eq!(
            told(|json, _| json["nodes"][0]["extras"]["a/b"] = json!([1])),
            one("/nodes/0/extras/a~1b: 1 items, not 2")
        );
        assert_eq!(told(|json, _| json["scene"] = json!(0)), one("/scene: is there"));
        let cut =
            |json: &mut Value, _: &mut Vec<Vec<u8>>| drop(json.as_object_mut().unwrap().remove("nodes"));
        assert_eq!(told(cut), one("/nodes: is missing"));
        assert_eq!(told(|_, buffers| buffers[0][2] = 0), one("/images/0/bufferView (bark): other bytes"));
        assert_eq!(told(|_, buffers| buffers[1][2] = 0), one("/accessors/0/bufferView: other bytes"));
        assert_eq!(
            told(|json, _| json["bufferViews"][1]["byteStride"] = json!(8)),
            one("/accessors/0/bufferView: other bytes")
        );
        let list = |json: &mut Value, _: &mut Vec<Vec<u8>>| json["nodes"][0]["extras"] = json!({"x": [1]});
        assert_eq!(told(list).list, ["/nodes/0/extras/x: is there", "/nodes/0/extras/a~1b: is missing"]);
    }

    #[test]
    fn where_bytes_lie_is_no_difference() {
        assert_eq!(told(|_, buffers| buffers[1][0] = 0), Differences::default());
        let elsewhere = |json: &mut Value, buffers: &mut Vec<Vec<u8>>| {
            buffers[0] = b"..abc".to_vec();
            json["bufferViews"] = json!([{"buffer": 2, "byteLength": 1}, {"buffer": 1, "byteOffset": 1, "byteLength": 2}, {"buffer": 0, "byteOffset": 2, "byteLength": 3}]);
            json["images"][0]["bufferView"] = json!(2);
            json["images"][0]["extensions"]["UNWELD_progressive_mesh"]["previews"][0]["bufferView"] =
                json!(0);
        };
        assert_eq!(told(elsewhere), Differences::default());
        assert_eq!(
            told(|_, buffers| buffers[2][0] = 0),
            Differences { previews: true, ..Differences::default() }
        );
    }
}
