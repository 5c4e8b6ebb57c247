//! A scene whose images are small pictures of them: its JSON without what nobody wants who is content with so many pixels (spec §14.4).

use std::collections::HashSet;
use std::io;

use serde_json::Value;

use super::carried::EXTENSION;
use super::composed::{invalid, items, visit_views};

/// What is left of a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Lighter {
    /// Its JSON.
    pub json: Vec<u8>,
    /// The buffers that it has no more, by their numbers before, in ascending order.
    pub left_out: Vec<usize>,
    /// How many of its images are smaller pictures now.
    pub images: usize,
}

/// A scene whose images have at most `pixels` along their longer side, as far as there are such pictures of them; of one that has none as small, its
/// smallest. What anything else is in stays.
///
/// # Errors
/// [`io::ErrorKind::InvalidInput`] where the JSON is none, or at the pointer where it names what is not there.
pub fn lighter(json: &[u8], pixels: u32) -> io::Result<Lighter> {
    let mut json: Value =
        serde_json::from_slice(json).map_err(|e| invalid(format!("the scene's JSON: {e}")))?;
    let buffers: Vec<Option<u64>> = items(&mut json, "bufferViews")
        .iter()
        .map(|view| view.get("buffer").and_then(Value::as_u64))
        .collect();
    let buffer_of = |view: u64| buffers.get(usize::try_from(view).ok()?).copied().flatten();
    let (mut wanted, mut others) = (HashSet::new(), HashSet::new());
    for image in items(&mut json, "images") {
        for (k, (size, view)) in versions(image).into_iter().enumerate() {
            let is_wanted = size <= u64::from(pixels) || k == 0;
            if is_wanted { &mut wanted } else { &mut others }.insert(view);
        }
    }
    // What is not of images is somebody's, whether that is known or not.
    wanted.extend((0..buffers.len() as u64).filter(|view| !others.contains(view)));
    let images = json.get_mut("images").map(Value::take);
    let named = visit_views(&mut json, &mut |view| {
        wanted.extend(view.as_u64());
        Ok(())
    });
    named?;
    if let (Some(images), Some(root)) = (images, json.as_object_mut()) {
        root["images"] = images;
    }
    let kept: HashSet<u64> = wanted.iter().filter_map(|&view| buffer_of(view)).collect();
    let left_out: HashSet<u64> =
        others.iter().filter_map(|&view| buffer_of(view)).filter(|buffer| !kept.contains(buffer)).collect();
    let is_gone = |view: u64| buffer_of(view).is_some_and(|buffer| left_out.contains(&buffer));
    let smaller = items(&mut json, "images").iter_mut().map(|image| make_smaller(image, is_gone));
    let images = smaller.filter(|is_smaller| *is_smaller).count();
    number_anew(&mut json, &buffers, &left_out)?;
    let mut left_out: Vec<usize> = left_out.into_iter().filter_map(|r| usize::try_from(r).ok()).collect();
    left_out.sort_unstable();
    Ok(Lighter { json: json.to_string().into_bytes(), left_out, images })
}

/// Pixels along the longer side, and the view, of each picture that there is of an image, the smallest first; the image itself is the last.
fn versions(image: &Value) -> Vec<(u64, u64)> {
    let view = |of: &Value| of.get("bufferView").and_then(Value::as_u64);
    let previews = image.get("extensions").and_then(|extensions| extensions.get(EXTENSION)?.get("previews"));
    let previews = previews.and_then(Value::as_array).into_iter().flatten();
    let mut versions: Vec<_> =
        previews.filter_map(|preview| Some((preview.get("size")?.as_u64()?, view(preview)?))).collect();
    versions.sort_by_key(|&(size, _)| size);
    versions.extend(view(image).map(|view| (u64::MAX, view)));
    versions
}

/// Has an image name the largest picture that is left; whether that is another one than before.
fn make_smaller(image: &mut Value, is_gone: impl Fn(u64) -> bool) -> bool {
    let is_gone = |of: &Value| of.get("bufferView").and_then(Value::as_u64).is_some_and(&is_gone);
    let is_smaller = is_gone(image);
    let mut largest = None;
    let mut extensions = image.get_mut("extensions").and_then(Value::as_object_mut);
    if let Some(extension) =
        extensions.as_mut().and_then(|extensions| extensions.get_mut(EXTENSION)?.as_object_mut())
    {
        if let Some(Value::Array(previews)) = extension.get_mut("previews") {
            previews.retain(|preview| !is_gone(preview));
            if is_smaller {
                let size = |preview: &Value| preview.get("size").and_then(Value::as_u64);
                let place = (0..previews.len()).max_by_key(|&k| size(&previews[k]));
                largest = place.map(|place| previews.remove(place));
            }
            if previews.is_empty() {
                extension.shift_remove("previews");
            }
        }
        let is_empty = extension.is_empty();
        if let Some(extensions) = extensions.filter(|_| is_empty) {
            extensions.shift_remove(EXTENSION);
        }
    }
    if let Some(object) = image.as_object_mut() {
        if object.get("extensions").and_then(Value::as_object).is_some_and(|all| all.is_empty()) {
            object.shift_remove("extensions");
        }
        for key in ["bufferView", "mimeType"] {
            let value = largest.as_ref().and_then(|largest| largest.get(key));
            value.into_iter().for_each(|value| drop(object.insert(key.to_owned(), value.clone())));
        }
    }
    is_smaller
}

/// Takes buffers out, with their views, and gives the others the numbers of their places.
fn number_anew(json: &mut Value, buffers: &[Option<u64>], left_out: &HashSet<u64>) -> io::Result<()> {
    let is_left = |buffer: Option<u64>| !buffer.is_some_and(|buffer| left_out.contains(&buffer));
    let mut numbers = vec![None; buffers.len()];
    for (number, k) in (0..buffers.len()).filter(|&k| is_left(buffers[k])).enumerate() {
        numbers[k] = Some(number as u64);
    }
    keep(json, "buffers", |k| is_left(Some(k as u64)));
    keep(json, "bufferViews", |k| is_left(buffers[k]));
    for view in items(json, "bufferViews") {
        if let Some(buffer) = view.get("buffer").and_then(Value::as_u64) {
            view["buffer"] =
                (buffer - left_out.iter().filter(|&&other| other < buffer).count() as u64).into();
        }
    }
    let renumber = |view: &mut Value| {
        let number = view.as_u64().and_then(|k| *numbers.get(usize::try_from(k).ok()?)?);
        *view = number.ok_or_else(|| invalid(format!("/bufferViews has no item {view}")))?.into();
        Ok(())
    };
    // Previews, too, which are in an extension; images are in no table.
    visit_views(json, &mut { renumber })?;
    items(json, "images").iter_mut().filter_map(|image| image.get_mut("bufferView")).try_for_each(renumber)
}

fn keep(json: &mut Value, list: &str, is_kept: impl Fn(usize) -> bool) {
    let Some(Value::Array(list)) = json.get_mut(list) else { return };
    let mut k = 0;
    list.retain(|_| {
        k += 1;
        is_kept(k - 1)
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    /// Views 0 to 6: samples, two previews of each of two images, the images; a third image is in view 7, with the samples' buffer.
    fn scene() -> Value {
        let image = |view: u64, sizes: [(u64, u64); 2], more: Value| {
            let previews: Vec<_> = sizes
                .iter()
                .map(|(size, view)| json!({ "size": size, "bufferView": view, "mimeType": "image/jpeg" }))
                .collect();
            let mut extension = json!({ "previews": previews });
            extension.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
            json!({ "bufferView": view, "mimeType": "image/png", "extensions": { EXTENSION: extension } })
        };
        let one = image(5, [(64, 1), (256, 3)], json!({ "uri": "one.png" }));
        let two = image(6, [(64, 2), (256, 4)], json!({}));
        json!({
            "accessors": [{ "bufferView": 0 }, { "bufferView": 7 }],
            "images": [one, two, { "bufferView": 7, "mimeType": "image/png" }, { "uri": "elsewhere.png" }],
            "bufferViews": (0..8).map(|k| json!({ "buffer": k % 7, "byteLength": 10 + k })).collect::<Vec<_>>(),
            "buffers": (0..7).map(|k| json!({ "byteLength": 20 + k })).collect::<Vec<_>>(),
        })
    }

    fn of(pixels: u32) -> (Value, Vec<usize>, usize) {
        let Lighter { json, left_out, images } = lighter(scene().to_string().as_bytes(), pixels).unwrap();
        (serde_json::from_slice(&json).unwrap(), left_out, images)
    }

    #[test]
    fn images_become_the_largest_pictures_that_are_small_enough() {
        let (json, left_out, images) = of(256);
        assert_eq!((left_out, images), (vec![5, 6], 2));
        let preview =
            |size: u64, view: u64| json!({ "size": size, "bufferView": view, "mimeType": "image/jpeg" });
        assert_eq!(
            json["images"],
            json!([
                { "bufferView": 3, "mimeType": "image/jpeg", "extensions": { EXTENSION: { "previews": [preview(64, 1)], "uri": "one.png" } } },
                { "bufferView": 4, "mimeType": "image/jpeg", "extensions": { EXTENSION: { "previews": [preview(64, 2)] } } },
                { "bufferView": 5, "mimeType": "image/png" },
                { "uri": "elsewhere.png" },
            ])
        );
        assert_eq!(json["accessors"], json!([{ "bufferView": 0 }, { "bufferView": 5 }]));
        // View 7 was of buffer 0 and is view 5.
        let views: Vec<_> = json["bufferViews"]
            .as_array()
            .unwrap()
            .iter()
            .map(|view| [view["buffer"].as_u64().unwrap(), view["byteLength"].as_u64().unwrap()])
            .collect();
        assert_eq!(views, [[0, 10], [1, 11], [2, 12], [3, 13], [4, 14], [0, 17]]);
        assert_eq!(json["buffers"].as_array().unwrap().len(), 5);
        // As small as there is.
        let (json, left_out, images) = of(1);
        assert_eq!((left_out, images), (vec![3, 4, 5, 6], 2));
        assert_eq!(json["images"][0]["extensions"], json!({ EXTENSION: { "uri": "one.png" } }));
        assert_eq!(json["images"][1], json!({ "bufferView": 2, "mimeType": "image/jpeg" }));
        assert_eq!(json["accessors"][1]["bufferView"], 3);
    }

    #[test]
    fn what_else_is_in_a_buffer_keeps_it() {
        let mut json = scene();
        json["accessors"][0]["bufferView"] = 6.into();
        let told = lighter(json.to_string().as_bytes(), 64).unwrap();
        assert_eq!((told.left_out, told.images), (vec![3, 4, 5], 1));
        let json: Value = serde_json::from_slice(&told.json).unwrap();
        assert_eq!(json["images"][1]["bufferView"], json["accessors"][0]["bufferView"]);
        assert_eq!(json["images"][1]["extensions"][EXTENSION]["previews"].as_array().unwrap().len(), 1);
    }

    #[test]
    fn bad_json_is_refused() {
        assert!(lighter(b"{", 1).is_err());
        let mut json = scene();
        json["accessors"][0]["bufferView"] = 9.into();
        assert_eq!(
            lighter(json.to_string().as_bytes(), 64).unwrap_err().to_string(),
            "/accessors/0/bufferView: /bufferViews has no item 9"
        );
        assert!(lighter(b"[]", 1).unwrap().left_out.is_empty());
    }
}
