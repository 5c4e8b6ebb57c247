//! A scene without its geometry: the JSON, in which triangles name parts, and the buffers that it still needs (spec §14.3).
//!
//! Accessors that only triangles have go, and so do the buffer views that only they have; what stays is renumbered, and all of it lies in one
//! buffer, but for the samples of animations, where they are many, and for images, each of which has buffers of its own. All else of the JSON,
//! known or not, stays as it is and where it is.

use std::collections::BTreeSet;

use serde_json::{Map, Value, json};

use super::accessor::Accessor;
use super::document::Document;
use super::draco;
use super::images::{self, Image};
use super::json::At;
use super::layout::{Part, Parts};
use super::meshopt;
use super::notes::{Notes, QUANTIZATION};
use super::previews::FIRST as FIRST_PREVIEW;
use super::references::{self, Kind, Reference};
use super::unknown;
use crate::error::{Error, Result};
use crate::formats::scene::{Role, Scene, SceneBuffer};
use crate::mesh::IndexedMesh;
use crate::mesh::attributes::Stored;

/// The name of the extension of scenes (spec §14.3).
pub(super) const EXTENSION: &str = "UNWELD_progressive_mesh";

/// What a document is beside its mesh.
///
/// # Errors
/// At the pointer where it names what is not there, or what cannot be had.
pub(super) fn carry(
    document: &Document<'_>,
    mesh: &IndexedMesh,
    parts: &Parts,
    notes: &mut Notes,
) -> Result<Scene> {
    document.take_json()?;
    let mut json = document.root().value.clone();
    let geometry = Geometry::of(document, parts)?;
    place_parts(&mut json, document, parts, notes)?;
    let images = images::of(document, mesh, parts, notes)?;
    for item in list(&mut json, "images") {
        remove(item, "bufferView");
    }
    let most = list(&mut json, "accessors").len().max(list(&mut json, "bufferViews").len());
    let unknown = unknown::numbers(&json, most);
    let accessors = keep_accessors(&mut json, document, &geometry, notes)?;
    let (binary, views) = keep_views(&mut json, document, &geometry, notes)?;
    let have_changed = |k: &usize| accessors.changes(*k) || views.changes(*k);
    let unknown = unknown.into_iter().filter(|(_, numbers)| numbers.iter().any(have_changed));
    notes.unchecked.extend(unknown.map(|(name, _)| name));
    let buffers = place_buffers(&mut json, binary, moved_from(mesh), images, notes);
    name_extensions(&mut json, is_quantised(document, parts)?);
    let json = serde_json::to_vec(&json).map_err(|e| Error::Parameter(e.to_string()))?;
    Ok(Scene { json, buffers })
}

/// What triangles alone have, if nothing else names it.
struct Geometry {
    accessors: BTreeSet<usize>,
    /// Those of images, too, which get views of their own.
    views: BTreeSet<usize>,
}

impl Geometry {
    fn of(document: &Document<'_>, parts: &Parts) -> Result<Self> {
        let (mut accessors, mut views) = (BTreeSet::new(), BTreeSet::new());
        let root = document.root();
        let meshes = root.list("meshes")?;
        for &(mesh, number) in parts.keys() {
            let primitives = meshes[mesh].list("primitives")?;
            let primitive = &primitives[number];
            let mut named = primitive.object("attributes")?;
            for target in primitive.list("targets")? {
                named.extend(target.members()?);
            }
            named.extend(primitive.key("indices").map(|indices| ("", indices)));
            for (_, accessor) in named {
                accessors.insert(accessor.number()?);
            }
            if let Some(packed) = primitive.extension(draco::EXTENSION) {
                views.insert(packed.needed("bufferView")?.number()?);
            }
        }
        for &accessor in &accessors {
            let Some(at) = root.item("accessors", accessor) else { continue };
            let sparse = at.key("sparse");
            let of = |key: &str| sparse.as_ref().and_then(|sparse| sparse.key(key)?.key("bufferView"));
            for view in [at.key("bufferView"), of("indices"), of("values")].into_iter().flatten() {
                views.insert(view.number()?);
            }
        }
        for image in root.list("images")? {
            if let Some(view) = image.key("bufferView") {
                views.insert(view.number()?);
            }
        }
        Ok(Self { accessors, views })
    }
}

/// Has primitives name parts in place of accessors.
fn place_parts(json: &mut Value, document: &Document<'_>, parts: &Parts, notes: &mut Notes) -> Result<()> {
    let meshes = document.root().list("meshes")?;
    for (&(mesh, number), part) in parts {
        let (at, now) = (&meshes[mesh].list("primitives")?[number], &mut json["meshes"][mesh]);
        lose_extensions(now, &NAMING_TRIANGLES, notes);
        let now = &mut now["primitives"][number];
        lose_extensions(now, &NAMING_VERTICES, notes);
        for key in ["indices", "targets", "mode"] {
            remove(now, key);
        }
        if let Some(extensions) = now.get_mut("extensions") {
            remove(extensions, draco::EXTENSION);
        }
        now["attributes"] = json!({});
        let extension = named_part(document, at, part)?;
        let extensions = match now.as_object_mut() {
            Some(now) => now.entry("extensions").or_insert_with(|| json!({})),
            None => continue,
        };
        let Some(extensions) = extensions.as_object_mut() else {
            return Err(at.fault("`extensions` is no object"));
        };
        extensions.insert(EXTENSION.to_owned(), extension);
    }
    Ok(())
}

/// What stands in place of a primitive's accessors.
fn named_part(document: &Document<'_>, primitive: &At<'_>, part: &Part) -> Result<Value> {
    let types = |members: Vec<(&str, At<'_>)>| -> Result<Value> {
        let members = members.into_iter().map(|(name, number)| {
            let accessor = document.named("accessors", &number)?;
            let keys = ["componentType", "normalized", "type"];
            let told =
                keys.iter().filter_map(|&key| Some((key.to_owned(), accessor.value.get(key)?.clone())));
            Ok((name.to_owned(), told.filter(|(_, value)| *value != false).collect::<Map<_, _>>().into()))
        });
        Ok(Value::Object(members.collect::<Result<_>>()?))
    };
    let mut extension = json!({"part": part.number, "exponent": part.exponent});
    extension["attributes"] = types(primitive.object("attributes")?)?;
    let targets = primitive.list("targets")?;
    if !targets.is_empty() {
        let targets = targets.iter().map(|target| types(target.members()?));
        extension["targets"] = targets.collect::<Result<Vec<_>>>()?.into();
    }
    Ok(extension)
}

fn lose_extensions(of: &mut Value, names: &[&'static str], notes: &mut Notes) {
    let Some(extensions) = of.get_mut("extensions") else { return };
    for &name in names {
        if extensions.get(name).is_some() {
            remove(extensions, name);
            *notes.lost_extensions.entry(name).or_default() += 1;
        }
    }
    if extensions.as_object().is_some_and(Map::is_empty) {
        remove(of, "extensions");
    }
}

/// Leaves the accessors that something names but triangles, or nothing at all.
fn keep_accessors(
    json: &mut Value,
    document: &Document<'_>,
    geometry: &Geometry,
    notes: &mut Notes,
) -> Result<Kept> {
    let accessors = list(json, "accessors").len();
    let mut kept: Vec<bool> = (0..accessors).map(|k| !geometry.accessors.contains(&k)).collect();
    references::visit(json, &mut |Reference { kind, value, pointer, is_certain }| {
        if kind != Kind::Accessor {
            return Ok(());
        }
        let at = At { value, pointer: pointer.to_owned() };
        if is_certain {
            Accessor::new(document, &at)?.check()?;
        }
        if let Some(kept) = at.number().ok().and_then(|k| kept.get_mut(k)) {
            *kept = true;
        }
        Ok(())
    })?;
    let kept = Kept::new(kept);
    keep(json, "accessors", Kind::Accessor, &kept, notes)?;
    Ok(kept)
}

/// Which items of a list stay, and the first of those that do not.
struct Kept(Vec<bool>, Option<usize>);

impl Kept {
    fn new(kept: Vec<bool>) -> Self {
        let first = kept.iter().position(|kept| !kept);
        Self(kept, first)
    }

    /// Whether an item has gone or has another number now; no item has not.
    fn changes(&self, k: usize) -> bool {
        k < self.0.len() && self.1.is_some_and(|first| k >= first)
    }
}

/// Leaves the buffer views that something names, or nothing at all; returns the bytes that they are of now: samples of animations, if they are many, in
/// a buffer of their own, the second; and which stay.
fn keep_views(
    json: &mut Value,
    document: &Document<'_>,
    geometry: &Geometry,
    notes: &mut Notes,
) -> Result<([Vec<u8>; 2], Kept)> {
    let views = list(json, "bufferViews").len();
    let mut kept: Vec<bool> = (0..views).map(|k| !geometry.views.contains(&k)).collect();
    references::visit(json, &mut |Reference { kind, value, pointer, is_certain }| {
        if kind != Kind::View {
            return Ok(());
        }
        let at = At { value, pointer: pointer.to_owned() };
        if is_certain {
            document.named("bufferViews", &at)?;
        }
        if let Some(kept) = at.number().ok().and_then(|k| kept.get_mut(k)) {
            *kept = true;
        }
        Ok(())
    })?;
    let motion = motion(json)?;
    let mut buffers = [Vec::new(), Vec::new()];
    for (k, item) in list(json, "bufferViews").iter_mut().enumerate().filter(|(k, _)| kept[*k]) {
        let buffer = usize::from(motion.contains(&k));
        let binary = &mut buffers[buffer];
        let number = Value::from(k);
        let bytes = document.view(&At { value: &number, pointer: format!("/bufferViews/{k}") })?.bytes;
        // Numbers stay as aligned as they were.
        let offset = item.get("byteOffset").and_then(Value::as_u64).unwrap_or(0) as usize % ALIGNED;
        let begin = binary.len().next_multiple_of(ALIGNED) + offset;
        document.take(begin - binary.len() + bytes.len(), 2)?;
        binary.resize(begin, 0);
        binary.extend_from_slice(bytes);
        item["buffer"] = buffer.into();
        item["byteOffset"] = begin.into();
        item["byteLength"] = bytes.len().into();
        if let Some(extensions) = item.get_mut("extensions") {
            meshopt::EXTENSIONS.iter().for_each(|name| remove(extensions, name));
            if extensions.as_object().is_some_and(Map::is_empty) {
                remove(item, "extensions");
            }
        }
    }
    let kept = Kept::new(kept);
    keep(json, "bufferViews", Kind::View, &kept, notes)?;
    for (k, binary) in buffers.iter_mut().enumerate() {
        // A buffer has a byte at least.
        if binary.is_empty() && list(json, "bufferViews").iter().any(|view| view["buffer"] == k) {
            binary.push(0);
        }
    }
    Ok((buffers, kept))
}

/// The views that samplers of animations have, and nothing else; none where these are but a few bytes.
fn motion(json: &mut Value) -> Result<BTreeSet<usize>> {
    let mut of = [Kind::Accessor, Kind::View].map(|kind| (kind, BTreeSet::new(), BTreeSet::new()));
    for k in 0..of.len() {
        let (before, at) = of.split_at_mut(k);
        let (wanted, moving, others) = &mut at[0];
        references::visit(json, &mut |Reference { kind, value, pointer, .. }| {
            let Some(number) = value.as_u64().filter(|_| kind == *wanted) else { return Ok(()) };
            let is_motion = match before.first() {
                None => pointer.starts_with("/animations/"),
                // A view: what moves is an accessor that nothing else has.
                Some((_, accessors, others)) => {
                    let accessor =
                        pointer.strip_prefix("/accessors/").and_then(|rest| rest.split('/').next());
                    let accessor = accessor.and_then(|number| number.parse().ok());
                    accessor.is_some_and(|k| accessors.contains(&k) && !others.contains(&k))
                }
            };
            if is_motion {
                moving.insert(number as usize)
            } else {
                others.insert(number as usize)
            };
            Ok(())
        })?;
    }
    let [_, (_, moving, others)] = of;
    let views: BTreeSet<usize> = moving.difference(&others).copied().collect();
    let length = |k: &usize| json["bufferViews"][*k]["byteLength"].as_u64().unwrap_or(0);
    let bytes = views.iter().map(length).fold(0, u64::saturating_add);
    Ok(if bytes > FEW { views } else { BTreeSet::new() })
}

/// From which error of a level on many samples are of use: where the mesh looks right in a picture of as many pixels as the first preview of an image
/// has. Before that, what is there matters more than how it moves.
fn moved_from(mesh: &IndexedMesh) -> f64 {
    let range = |k: usize| {
        let along = || mesh.positions.iter().map(|p| p[k]);
        along().fold(f64::NEG_INFINITY, f64::max) - along().fold(f64::INFINITY, f64::min)
    };
    [0, 1, 2].map(range).into_iter().fold(0.0, f64::max) / f64::from(FIRST_PREVIEW)
}

/// Leaves some items of a list, and has them named by the numbers that they have then.
fn keep(json: &mut Value, name: &str, of: Kind, Kept(kept, _): &Kept, notes: &mut Notes) -> Result<()> {
    let numbers: Vec<usize> =
        kept.iter().scan(0, |next, kept| Some(std::mem::replace(next, *next + usize::from(*kept)))).collect();
    if let Some(Value::Array(items)) = json.get_mut(name) {
        let mut kept = kept.iter();
        items.retain(|item| {
            let stays = *kept.next().expect("there is one for each");
            let says_more = item.get("extras").is_some();
            notes.lost_extras += usize::from(!stays && says_more);
            stays
        });
        if items.is_empty() {
            remove(json, name);
        }
    }
    references::visit(json, &mut |Reference { kind, value, .. }| {
        let number = value.as_f64().map(|k| k as usize).filter(|_| kind == of);
        if let Some(number) = number.and_then(|k| numbers.get(k)) {
            *value = (*number).into();
        }
        Ok(())
    })
}

/// Makes buffers of binary data and images, in the order in which they are of use.
fn place_buffers(
    json: &mut Value,
    binary: [Vec<u8>; 2],
    moved_from: f64,
    images: Vec<Image>,
    notes: &mut Notes,
) -> Vec<SceneBuffer> {
    notes.lost_extras += list(json, "buffers").iter().filter(|buffer| buffer.get("extras").is_some()).count();
    let mut buffers = Vec::new();
    // Of the binary data which buffers they are.
    let mut numbers = [0; 2];
    for (k, (bytes, useful_from)) in binary.into_iter().zip([f64::INFINITY, moved_from]).enumerate() {
        numbers[k] = buffers.len();
        if !bytes.is_empty() {
            buffers.push(SceneBuffer { bytes, role: Role::Binary, useful_from });
        }
    }
    // Of each further buffer the view that names it.
    let mut views = Vec::new();
    let mut next = list(json, "bufferViews").len();
    for Image { numbers, bytes, media, picture, useful_from, previews_from } in images {
        let image = numbers[0];
        let mut add = |bytes: Vec<u8>, role: Role, useful_from: f64| {
            views.push((buffers.len(), bytes.len()));
            buffers.push(SceneBuffer { bytes, role, useful_from });
            next += 1;
            next - 1
        };
        let mut previews = Vec::new();
        for (preview, from) in picture.previews.into_iter().zip(previews_from) {
            let (size, media) = (preview.size, preview.media);
            let view = add(preview.bytes, Role::Preview { image, size }, from);
            previews.push(json!({"size": size, "bufferView": view, "mimeType": media}));
        }
        let view = add(bytes, Role::Original { image }, useful_from);
        for number in numbers {
            name_image(&mut json["images"][number], view, media, &previews);
        }
    }
    let mut order: Vec<usize> = (0..buffers.len()).collect();
    order.sort_by(|&x, &y| buffers[y].useful_from.total_cmp(&buffers[x].useful_from));
    let mut places = vec![0; buffers.len()];
    order.iter().enumerate().for_each(|(place, &k)| places[k] = place);
    for view in list(json, "bufferViews") {
        let of = view["buffer"].as_u64().unwrap_or(0) as usize;
        view["buffer"] = places[numbers[of]].into();
    }
    let views = views
        .into_iter()
        .map(|(buffer, length): (usize, usize)| json!({"buffer": places[buffer], "byteLength": length}));
    if views.len() > 0 {
        list_to_be(json, "bufferViews").into_iter().for_each(|items| items.extend(views.clone()));
    }
    let mut buffers: Vec<_> = buffers.into_iter().zip(places).collect();
    buffers.sort_by_key(|(_, place)| *place);
    let buffers: Vec<SceneBuffer> = buffers.into_iter().map(|(buffer, _)| buffer).collect();
    match buffers.is_empty() {
        true => remove(json, "buffers"),
        false => {
            json["buffers"] =
                buffers.iter().map(|buffer| json!({"byteLength": buffer.bytes.len()})).collect();
        }
    }
    buffers
}

/// Has an image name its views.
fn name_image(image: &mut Value, view: usize, media: Option<&str>, previews: &[Value]) {
    let uri = image.get("uri").cloned();
    let file = uri.filter(|uri| uri.as_str().is_some_and(|uri| !images::is_data(uri)));
    remove(image, "uri");
    image["bufferView"] = view.into();
    if let (None, Some(media)) = (image.get("mimeType"), media) {
        image["mimeType"] = media.into();
    }
    let mut extension = Map::new();
    if !previews.is_empty() {
        extension.insert("previews".to_owned(), previews.to_vec().into());
    }
    extension.extend(file.map(|uri| ("uri".to_owned(), uri)));
    if extension.is_empty() {
        return;
    }
    if !image.get("extensions").is_some_and(Value::is_object) {
        image["extensions"] = json!({});
    }
    image["extensions"][EXTENSION] = extension.into();
}

/// Says which extensions the document has now.
fn name_extensions(json: &mut Value, is_quantised: bool) {
    let is_gone = |name: &Value| {
        let name = name.as_str().unwrap_or_default();
        name == draco::EXTENSION || meshopt::EXTENSIONS.contains(&name)
    };
    for key in ["extensionsUsed", "extensionsRequired"] {
        let Some(names) = list_to_be(json, key) else { continue };
        names.retain(|name| !is_gone(name));
        for (name, is_needed) in [(QUANTIZATION, is_quantised), (EXTENSION, key == "extensionsUsed")] {
            if is_needed && names.iter().all(|other| other != name) {
                names.push(name.into());
            }
        }
        if names.is_empty() {
            remove(json, key);
        }
    }
}

/// Whether an accessor of a primitive is of a type that glTF has only with an extension (KHR_mesh_quantization).
fn is_quantised(document: &Document<'_>, parts: &Parts) -> Result<bool> {
    let meshes = document.root().list("meshes")?;
    for &(mesh, number) in parts.keys() {
        let primitive = &meshes[mesh].list("primitives")?[number];
        let mut members = primitive.object("attributes")?;
        for target in primitive.list("targets")? {
            members.extend(target.members()?);
        }
        for (name, number) in members {
            let shape = Accessor::new(document, &number)?.shape;
            let is_core = match name {
                _ if shape.stored == Stored::F32 => true,
                "POSITION" | "NORMAL" | "TANGENT" => false,
                _ if name.starts_with("TEXCOORD_") => {
                    shape.normalised && matches!(shape.stored, Stored::U8 | Stored::U16)
                }
                _ => true,
            };
            if !is_core {
                return Ok(true);
            }
        }
    }
    Ok(false)
}

/// The items of a list at the root; none where there is none.
fn list<'v>(json: &'v mut Value, name: &str) -> &'v mut [Value] {
    match json.get_mut(name) {
        Some(Value::Array(items)) => items,
        _ => &mut [],
    }
}

/// A list at the root, which is made where there is none.
fn list_to_be<'v>(json: &'v mut Value, name: &str) -> Option<&'v mut Vec<Value>> {
    json.as_object_mut()?.entry(name).or_insert_with(|| json!([])).as_array_mut()
}

fn remove(from: &mut Value, key: &str) {
    if let Some(object) = from.as_object_mut() {
        object.shift_remove(key);
    }
}

/// Extensions of meshes and primitives that name triangles or vertices by number.
const NAMING_TRIANGLES: [&str; 1] = ["EXT_mesh_manifold"];
const NAMING_VERTICES: [&str; 2] = ["CESIUM_primitive_outline", "EXT_mesh_primitive_edge_visibility"];
/// Bytes of samples of animations that stand with all else at the base: they take no longer to come than a base does.
const FEW: u64 = 1 << 14;
/// Bytes of the largest number of an accessor.
const ALIGNED: usize = 8;
