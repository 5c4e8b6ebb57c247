//! The images of a document: their bytes as they are, wherever they lie, previews of them, and from which errors of levels on each is of use.

use std::collections::HashMap;

use super::document::Document;
use super::layout::Parts;
use super::notes::{Notes, shortened};
use super::previews::{self, Picture};
use super::texels;
use crate::error::{Error, Result};
use crate::mesh::IndexedMesh;

/// An image, or several that are equal.
#[derive(Debug)]
pub(super) struct Image {
    /// Their numbers.
    pub numbers: Vec<usize>,
    pub bytes: Vec<u8>,
    /// What kind of file it is, if its first bytes tell.
    pub media: Option<&'static str>,
    pub picture: Picture,
    /// From which error of a level on the original is of use, and the previews as many, both as
    /// [`SceneBuffer::useful_from`](crate::formats::SceneBuffer::useful_from) has it.
    pub useful_from: f64,
    pub previews_from: Vec<f64>,
}

/// The images of a document that can be had, and makes notes of the others.
///
/// # Errors
/// At the pointer where an image is neither of a buffer view nor of a URI, or what it names is at fault; [`Error::Limit`].
pub(super) fn of(
    document: &Document<'_>,
    mesh: &IndexedMesh,
    parts: &Parts,
    notes: &mut Notes,
) -> Result<Vec<Image>> {
    let texels = texels::of_images(document, mesh, parts)?;
    let (mut images, mut known) = (Vec::<Image>::new(), HashMap::<Vec<u8>, usize>::new());
    for (number, at) in document.root().list("images")?.iter().enumerate() {
        let bytes = match (at.key("bufferView"), at.text("uri")?) {
            (Some(view), _) => document.view(&view)?.bytes.to_vec(),
            (None, Some(uri)) => match document.load(uri, at) {
                Ok(bytes) => bytes,
                // What is elsewhere stays a link; what is in the JSON itself must be right.
                Err(Error::Input(_) | Error::Io(_)) if !is_data(uri) => {
                    match is_elsewhere(uri) {
                        true => {
                            notes.remarks.push(format!("image {number} stays a link to {}", shortened(uri)))
                        }
                        false => notes
                            .lost_images
                            .push(format!("image {number}, a file that is not there ({})", shortened(uri))),
                    }
                    continue;
                }
                Err(error) => return Err(error),
            },
            (None, None) => return Err(at.fault("an image without `bufferView` and `uri`")),
        };
        document.take(bytes.len(), 2)?;
        if bytes.is_empty() {
            return Err(at.fault("an image of no bytes"));
        }
        if let Some(&same) = known.get(&bytes) {
            images[same].numbers.push(number);
            continue;
        }
        known.insert(bytes.clone(), images.len());
        let media = previews::media(&bytes);
        images.push(Image {
            numbers: vec![number],
            bytes,
            media,
            picture: Picture::default(),
            useful_from: 0.0,
            previews_from: Vec::new(),
        });
    }
    let mut left = previews::ALL_PIXELS;
    for image in &mut images {
        let of = image.numbers.iter().map(|&number| &texels[number]);
        let has_alpha = of.clone().any(|of| of.has_alpha);
        let lengths = of.clone().map(|of| of.length).filter(|&length| length > 0.0);
        let length = lengths.reduce(f64::min).unwrap_or(0.0);
        match previews::look(&image.bytes, has_alpha, &mut left) {
            Ok(picture) => image.picture = picture,
            Err(why) => notes.remarks.push(format!("image {} has no preview: {why}", image.numbers[0])),
        }
        let size = image.picture.pixels.map(f64::from);
        for (set, scale) in of.flat_map(|of| &of.sets) {
            let pixels = f64::max(scale[0] * size[0], scale[1] * size[1]);
            if pixels > 0.0 && pixels.is_finite() {
                let least = notes.texels.entry(*set).or_insert(f64::INFINITY);
                *least = least.min(1.0 / pixels);
            }
        }
        image.place(length);
    }
    Ok(images)
}

impl Image {
    /// Finds from where on it is of use, the unit square of texture coordinates being so long at the surface.
    fn place(&mut self, length: f64) {
        let [width, height] = self.picture.pixels.map(f64::from);
        let texel = if width * height > 0.0 { length / (width * height).sqrt() } else { 0.0 };
        let is_small =
            width.max(height) > 0.0 && self.picture.previews.is_empty() && self.media != Some("image/ktx2");
        self.useful_from = if is_small { f64::INFINITY } else { texel };
        let previews = self.picture.previews.iter().enumerate();
        self.previews_from = previews
            .map(|(k, preview)| match k {
                0 => f64::INFINITY,
                _ => texel * width.max(height) / f64::from(preview.size),
            })
            .collect();
    }
}

/// Whether a URI has its bytes in itself.
pub(super) fn is_data(uri: &str) -> bool {
    uri.get(..5).is_some_and(|scheme| scheme.eq_ignore_ascii_case("data:"))
}

/// Whether a URI has a scheme, so that it is no file beside the document.
fn is_elsewhere(uri: &str) -> bool {
    uri.split_once("://").is_some_and(|(scheme, _)| scheme.bytes().all(|b| b.is_ascii_alphanumeric()))
}
