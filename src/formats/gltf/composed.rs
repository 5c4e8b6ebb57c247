//! A mesh and its scene as one glTF again: primitives name accessors in place of parts, and one buffer has all that is binary (spec §14).

use std::collections::{HashMap, HashSet};
use std::io;

use serde_json::{Map, Value, json};

use super::carried::EXTENSION;
use super::files::{File, Names};
use super::pack::Pack;
use super::quantised::Quantiser;
use super::references::{self, Kind};
use super::shaped::Shaper;
use crate::formats::scene::Scene;
use crate::mesh::{IndexedMesh, Lattice};

/// What is made of a scene.
#[derive(Clone, Copy)]
pub(super) enum Form<'a> {
    /// All of it.
    Whole {
        /// Whether the numbers of the mesh are the source's own, in which nothing is to be mended.
        is_exact: bool,
        /// Whether its images are files beside it, the names of which begin with this.
        beside: Option<&'a str>,
        /// The lattice of positions that are to be integers.
        quantise: Option<&'a Lattice>,
        /// Whether vertices and indices are compressed.
        compress: bool,
    },
    /// What says which shape it has, as it is.
    Geometry,
    /// All of it, for viewers that do not know the extension, and in the buffer the file for those that do.
    Progressive {
        /// The file.
        uwm: &'a [u8],
    },
}

/// A glTF in pieces.
#[derive(Default)]
pub(super) struct Composed {
    pub json: Value,
    /// Its one buffer.
    pub binary: Vec<u8>,
    /// Images that are files beside it.
    pub files: Vec<File>,
    /// What is not as it was asked for, in words for the user.
    pub remarks: Vec<String>,
}

/// A glTF that has the mesh in its scene. Images are as they were, or the largest previews that are there. It takes up to `max_memory` bytes.
///
/// # Errors
/// [`io::ErrorKind::InvalidInput`] at the pointer where the scene's JSON is at fault, or names what is not there;
/// [`Error::Limit`](crate::Error::Limit), within [`io::Error`].
pub(super) fn document(
    mesh: &IndexedMesh,
    scene: &Scene,
    form: Form<'_>,
    max_memory: u64,
) -> io::Result<Composed> {
    let mut pack = Pack::new(max_memory);
    pack.take(scene.json.len(), PARSED_BYTES)?;
    let mut json: Value =
        serde_json::from_slice(&scene.json).map_err(|e| invalid(format!("the scene's JSON: {e}")))?;
    let mut files = Vec::new();
    let of_images = views_of_images(&mut json);
    let mut used = match form {
        Form::Geometry => {
            // How many there are is all that is asked.
            items(&mut json, "images").iter_mut().for_each(|image| *image = json!({}));
            HashSet::new()
        }
        Form::Whole { beside: Some(stem), .. } => {
            files = images_beside(&mut json, scene, stem, &mut pack)?;
            HashSet::new()
        }
        _ => choose_images(&mut json, scene)?,
    };
    if !matches!(form, Form::Geometry) {
        // What is not known to be named by anything may be all the same.
        let views = items(&mut json, "bufferViews").len() as u64;
        used.extend((0..views).filter(|view| !of_images.contains(view)));
    }
    visit_views(&mut json, &mut |view| {
        used.extend(view.as_u64());
        Ok(())
    })?;
    keep_views(&mut json, scene, &used, &mut pack)?;
    pack.accessors = taken(&mut json, "accessors");
    let mut quantiser = match form {
        Form::Whole { quantise: Some(lattice), .. } => Some(Quantiser::new(lattice, &json)),
        _ => None,
    };
    let mut shaper =
        Shaper::new(mesh, matches!(form, Form::Geometry | Form::Whole { is_exact: true, .. }), &mut pack)?;
    for (m, item) in items(&mut json, "meshes").iter_mut().enumerate() {
        // Where another primitive of the mesh is, there is one of which nothing has come yet.
        let mut near = None;
        let grid = quantiser.as_mut().and_then(|quantiser| quantiser.grid(m, item, &shaper));
        for (p, primitive) in items(item, "primitives").iter_mut().enumerate() {
            let extension = match form {
                Form::Progressive { .. } => {
                    primitive.get("extensions").and_then(|extensions| extensions.get(EXTENSION)).cloned()
                }
                _ => taken_extension(primitive),
            };
            let Some(extension) = extension else { continue };
            let at = format!("/meshes/{m}/primitives/{p}/extensions/{EXTENSION}");
            let shown = shaper.primitive(&mut pack, &extension, &at, &mut near, grid.as_ref())?;
            let Some(primitive) = primitive.as_object_mut() else { continue };
            primitive.insert("attributes".to_owned(), shown.attributes);
            primitive.insert("indices".to_owned(), shown.indices.into());
            primitive.extend(shown.targets.map(|targets| ("targets".to_owned(), targets)));
        }
    }
    let remarks = quantiser.map_or(vec![], |quantiser| quantiser.finish(&mut json));
    let Some(root) = json.as_object_mut() else {
        return Err(invalid("the scene's JSON is no object".to_owned()));
    };
    match form {
        Form::Progressive { uwm } => {
            pack.take(uwm.len(), 1)?;
            let begin = pack.put(uwm);
            pack.views.push(json!({ "buffer": 0, "byteOffset": begin, "byteLength": uwm.len() }));
            let extensions = root.entry("extensions").or_insert_with(|| json!({}));
            let Some(extensions) = extensions.as_object_mut() else {
                return Err(invalid("/extensions: not an object".to_owned()));
            };
            extensions.insert(EXTENSION.to_owned(), json!({ "bufferView": pack.views.len() - 1 }));
        }
        _ => ["extensionsUsed", "extensionsRequired"].iter().for_each(|list| unlist(root, list)),
    }
    if matches!(form, Form::Whole { compress: true, .. }) {
        pack.compress(root)?;
    }
    pack.finish(root);
    Ok(Composed { json, binary: pack.bytes, files, remarks })
}

/// The views that images and their previews are in.
fn views_of_images(json: &mut Value) -> HashSet<u64> {
    let mut views = HashSet::new();
    for image in items(json, "images") {
        views.extend(image.get("bufferView").and_then(Value::as_u64));
        let previews =
            image.get("extensions").and_then(|extensions| extensions.get(EXTENSION)?.get("previews"));
        let previews = previews.and_then(Value::as_array).into_iter().flatten();
        views.extend(previews.filter_map(|preview| preview.get("bufferView")?.as_u64()));
    }
    views
}

/// Has images be files beside the glTF; equal ones are one.
fn images_beside(json: &mut Value, scene: &Scene, stem: &str, pack: &mut Pack) -> io::Result<Vec<File>> {
    let told: Vec<Option<String>> = items(json, "images").iter().map(told_name).collect();
    choose_images(json, scene)?;
    let (mut files, mut names, mut known) = (Vec::<File>::new(), Names::new(stem), HashMap::new());
    let views = items(json, "bufferViews").to_vec();
    for (k, (image, told)) in items(json, "images").iter_mut().zip(told).enumerate() {
        let Some(number) = image.get("bufferView").and_then(Value::as_u64) else { continue };
        let name = match known.get(&number) {
            Some(name) => String::clone(name),
            None => {
                let view = views.get(number as usize);
                let view = view.ok_or_else(|| invalid(format!("/bufferViews has no item {number}")))?;
                let (r, offset, length) = stretch(scene, number as usize, view)?;
                let bytes = &scene.buffers[r].bytes[offset..offset + length];
                pack.take(bytes.len(), 1)?;
                let name = names.image(told.as_deref(), k, image.get("mimeType").and_then(Value::as_str));
                files.push(File { name: name.clone(), bytes: bytes.to_vec() });
                known.insert(number, name.clone());
                name
            }
        };
        if let Some(image) = image.as_object_mut() {
            image.shift_remove("bufferView");
            image.insert("uri".to_owned(), super::files::uri(&name).into());
        }
    }
    Ok(files)
}

/// What an image was called: as a file, or else by itself.
fn told_name(image: &Value) -> Option<String> {
    let uri = image.get("extensions").and_then(|extensions| extensions.get(EXTENSION)?.get("uri")?.as_str());
    uri.or_else(|| image.get("name")?.as_str()).map(str::to_owned)
}

/// Has images name the best bytes that are there; returns the views that these are in.
fn choose_images(json: &mut Value, scene: &Scene) -> io::Result<HashSet<u64>> {
    let buffers: Vec<Option<u64>> =
        items(json, "bufferViews").iter().map(|view| view.get("buffer").and_then(Value::as_u64)).collect();
    let is_there = |view: &u64| {
        let buffer = buffers.get(*view as usize).copied().flatten();
        buffer.and_then(|r| scene.buffers.get(r as usize)).is_some_and(|buffer| !buffer.bytes.is_empty())
    };
    let mut used = HashSet::new();
    for (k, image) in items(json, "images").iter_mut().enumerate() {
        let extension = taken_extension(image);
        let Some(original) = image.get("bufferView").and_then(Value::as_u64) else { continue };
        if is_there(&original) {
            used.insert(original);
            continue;
        }
        let previews = extension.as_ref().and_then(|extension| extension.get("previews")?.as_array());
        let view = |preview: &&Value| preview.get("bufferView").and_then(Value::as_u64).filter(is_there);
        let size = |preview: &&Value| preview.get("size").and_then(Value::as_u64);
        let there = previews.into_iter().flatten().filter(|preview| view(preview).is_some());
        let Some(preview) = there.max_by_key(size) else {
            return Err(invalid(format!("/images/{k}: neither the image nor a preview of it is there")));
        };
        let media = preview.get("mimeType").cloned().unwrap_or(Value::Null);
        let number = view(&preview).unwrap_or(0);
        used.insert(number);
        image["bufferView"] = number.into();
        image["mimeType"] = media;
    }
    Ok(used)
}

/// Leaves the views that are used, which get their places in the one buffer and the numbers of their places in the list.
fn keep_views(json: &mut Value, scene: &Scene, used: &HashSet<u64>, pack: &mut Pack) -> io::Result<()> {
    let views = taken(json, "bufferViews");
    let mut begins: Vec<Option<usize>> = vec![None; scene.buffers.len()];
    let mut numbers = vec![None; views.len()];
    for (k, mut view) in views.into_iter().enumerate().filter(|(k, _)| used.contains(&(*k as u64))) {
        let (r, offset, _) = stretch(scene, k, &view)?;
        let begin = match begins[r] {
            Some(begin) => begin,
            None => {
                pack.take(scene.buffers[r].bytes.len(), 1)?;
                *begins[r].insert(pack.put(&scene.buffers[r].bytes))
            }
        };
        view["buffer"] = 0.into();
        view["byteOffset"] = (begin + offset).into();
        numbers[k] = Some(pack.views.len());
        pack.views.push(view);
    }
    visit_views(json, &mut |view| {
        let number = view.as_u64().and_then(|k| *numbers.get(k as usize)?);
        *view = number.ok_or_else(|| invalid(format!("/bufferViews has no item {view}")))?.into();
        Ok(())
    })?;
    for image in items(json, "images") {
        let number =
            image.get("bufferView").and_then(Value::as_u64).and_then(|k| *numbers.get(k as usize)?);
        number.into_iter().for_each(|number| image["bufferView"] = number.into());
    }
    Ok(())
}

/// The buffer that a view is of, where it begins there, and how long it is.
fn stretch(scene: &Scene, k: usize, view: &Value) -> io::Result<(usize, usize, usize)> {
    let fault = |what: &str| invalid(format!("/bufferViews/{k}: {what}"));
    if !view.is_object() {
        return Err(fault("not an object"));
    }
    let number =
        |key: &str| view.get(key).map_or(Some(0), |x| x.as_u64().and_then(|x| usize::try_from(x).ok()));
    let (Some(r), Some(offset), Some(length)) =
        (number("buffer"), number("byteOffset"), number("byteLength"))
    else {
        return Err(fault("not a stretch of a buffer"));
    };
    let buffer = scene.buffers.get(r).ok_or_else(|| fault(&format!("there is no buffer {r}")))?;
    if offset.checked_add(length).is_none_or(|end| end > buffer.bytes.len()) {
        let there = buffer.bytes.len();
        return Err(fault(&format!("{length} bytes from byte {offset} of a buffer of {there}")));
    }
    Ok((r, offset, length))
}

/// Visits all numbers of views but those of images.
pub(super) fn visit_views(
    json: &mut Value,
    visit: &mut dyn FnMut(&mut Value) -> io::Result<()>,
) -> io::Result<()> {
    references::visit(json, &mut |reference| match reference.kind {
        // What only may be one stays if it is none.
        Kind::View if reference.is_certain || reference.value.is_u64() => {
            visit(reference.value).map_err(|e| super::json::fault(reference.pointer, e))
        }
        _ => Ok(()),
    })
    .map_err(|e| invalid(e.to_string()))
}

/// The object that the extension has of a value, which loses it.
fn taken_extension(of: &mut Value) -> Option<Value> {
    let extensions = of.get_mut("extensions")?.as_object_mut()?;
    let extension = extensions.shift_remove(EXTENSION);
    if extensions.is_empty()
        && let Some(of) = of.as_object_mut()
    {
        of.shift_remove("extensions");
    }
    extension
}

fn unlist(root: &mut Map<String, Value>, list: &str) {
    let Some(names) = root.get_mut(list).and_then(Value::as_array_mut) else { return };
    names.retain(|name| name != EXTENSION);
    if names.is_empty() {
        root.shift_remove(list);
    }
}

/// The items of a list; none where there is none.
pub(super) fn items<'v>(json: &'v mut Value, name: &str) -> &'v mut [Value] {
    match json.get_mut(name) {
        Some(Value::Array(items)) => items,
        _ => &mut [],
    }
}

fn taken(json: &mut Value, name: &str) -> Vec<Value> {
    match json.get_mut(name).map(Value::take) {
        Some(Value::Array(items)) => items,
        _ => Vec::new(),
    }
}

pub(super) fn invalid(what: String) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidInput, what)
}

/// Bytes that a byte of JSON may take when it is parsed.
const PARSED_BYTES: usize = 73;
