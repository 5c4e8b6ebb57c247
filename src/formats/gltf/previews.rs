//! Images decoded, and small pictures of them (feature `images`); what is told of an image by its first bytes.

use super::ktx;
use crate::mesh::paint::Image;

/// What a file of an image is by its first bytes.
pub(super) fn media(bytes: &[u8]) -> Option<&'static str> {
    let begins = |first: &[u8]| bytes.starts_with(first);
    match () {
        _ if begins(b"\x89PNG\r\n\x1a\n") => Some("image/png"),
        _ if begins(b"\xff\xd8\xff") => Some("image/jpeg"),
        _ if begins(b"RIFF") && bytes.get(8..12) == Some(b"WEBP") => Some("image/webp"),
        _ if begins(b"\xabKTX 20\xbb\r\n\x1a\n") => Some("image/ktx2"),
        _ => None,
    }
}

/// A small picture of an image.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Preview {
    /// Pixels of its longer side, at most.
    pub size: u32,
    pub bytes: Vec<u8>,
    pub media: &'static str,
}

/// What an image is.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Picture {
    /// Its width and height; 0 where they are not known.
    pub pixels: [u32; 2],
    /// The smallest first.
    pub previews: Vec<Preview>,
}

/// Pixels of the longer side of the first preview of an image.
pub(super) const FIRST: u32 = 64;
/// Pixels of the longer sides of previews, and from how many pixels of an image's own on there is one.
const SIZES: [(u32, u32); 2] = [(FIRST, 65), (256, 513)];

/// An original is at least so many times as large as its first preview, and as all previews where there are more.
const FIRST_WORTH: usize = 2;
const WORTH: usize = 8;

/// Leaves the previews that are worth their bytes. The first is what a scene is seen by at all: it is worth all but what it stands for. A
/// further one only bridges the time until the original is there, which is the shorter the smaller that is, and every client loads both: of its
/// bytes previews are to take a small share.
fn keep_worthy(previews: &mut Vec<Preview>, original: usize) {
    let mut taken = 0;
    previews.retain(|preview| {
        let share = if preview.size == FIRST { FIRST_WORTH } else { WORTH };
        let is_worth = share * (taken + preview.bytes.len()) <= original;
        taken += if is_worth { preview.bytes.len() } else { 0 };
        is_worth
    });
}

/// The size of a picture of KTX 2.0, and as previews its coarse mips, which need no transcoder.
fn of_ktx(bytes: &[u8]) -> Picture {
    let pixels = ktx::pixels(bytes);
    let sizes =
        SIZES.iter().filter(|(_, from)| pixels.iter().any(|side| side >= from)).map(|(size, _)| *size);
    let previews = sizes
        .filter_map(|size| Some(Preview { size, bytes: ktx::smaller(bytes, size)?, media: "image/ktx2" }));
    let mut previews: Vec<Preview> = previews.collect();
    keep_worthy(&mut previews, bytes.len());
    Picture { pixels, previews }
}

#[cfg(not(feature = "images"))]
pub(in crate::formats) use without::decoded;
#[cfg(not(feature = "images"))]
pub(super) use without::look;

#[cfg(feature = "images")]
pub(in crate::formats) use with::decoded;
#[cfg(feature = "images")]
pub(super) use with::look;

#[cfg(not(feature = "images"))]
mod without {
    use super::*;

    /// Of KTX its size; of others nothing.
    ///
    /// # Errors
    /// None.
    pub(in crate::formats::gltf) fn look(bytes: &[u8], _: bool, _: &mut u64) -> Result<Picture, String> {
        match media(bytes) {
            Some("image/ktx2") => Ok(of_ktx(bytes)),
            _ => Ok(Picture::default()),
        }
    }

    /// Nothing.
    ///
    /// # Errors
    /// Always.
    pub(in crate::formats) fn decoded(_: &[u8], _: &mut u64) -> Result<Image, String> {
        Err("this program was built without the feature `images`".to_owned())
    }
}

#[cfg(feature = "images")]
mod with {
    use super::*;
    use image::codecs::jpeg::JpegEncoder;
    use image::codecs::png::{CompressionType, FilterType, PngEncoder};
    use image::{DynamicImage, ImageFormat, ImageReader, Limits};
    use std::io::Cursor;

    /// Looks at an image and makes what previews are worth it. `has_alpha`: whether its alpha is looked at. `left`: how many pixels may yet
    /// be decoded.
    ///
    /// # Errors
    /// Why there are none, in words for the user.
    pub(in crate::formats::gltf) fn look(
        bytes: &[u8],
        has_alpha: bool,
        left: &mut u64,
    ) -> Result<Picture, String> {
        if media(bytes) == Some("image/ktx2") {
            return Ok(of_ktx(bytes));
        }
        let Reader { reader, width, height } = reader(bytes, left)?;
        let longest = width.max(height);
        let sizes = SIZES.iter().filter(|(_, from)| longest >= *from).map(|(size, _)| *size);
        let mut picture = Picture { pixels: [width, height], previews: Vec::new() };
        if longest < SIZES[0].1 {
            return Ok(picture);
        }
        let whole = reader.decode().map_err(said)?;
        for size in sizes {
            let small = whole.thumbnail(size, size);
            let (bytes, media) = encoded(&small, has_alpha).map_err(said)?;
            picture.previews.push(Preview { size, bytes, media });
        }
        keep_worthy(&mut picture.previews, bytes.len());
        Ok(picture)
    }

    /// The pixels of an image. `left` is as in [`look`].
    ///
    /// # Errors
    /// Why they cannot be had, in words for the user.
    pub(in crate::formats) fn decoded(bytes: &[u8], left: &mut u64) -> Result<Image, String> {
        let Reader { reader, width, height } = reader(bytes, left)?;
        let pixels = reader.decode().map_err(said)?.into_rgba8();
        Ok(Image { width, height, pixels: pixels.pixels().map(|pixel| pixel.0).collect() })
    }

    /// A decoder that takes no more than an image of its size does.
    struct Reader<'a> {
        reader: ImageReader<Cursor<&'a [u8]>>,
        width: u32,
        height: u32,
    }

    fn reader<'a>(bytes: &'a [u8], left: &mut u64) -> Result<Reader<'a>, String> {
        let format = match media(bytes) {
            Some("image/png") => ImageFormat::Png,
            Some("image/jpeg") => ImageFormat::Jpeg,
            Some("image/webp") => ImageFormat::WebP,
            Some("image/ktx2") => return Err("KTX 2.0, which is not decoded".to_owned()),
            _ => return Err("no PNG, JPEG, WebP or KTX 2.0".to_owned()),
        };
        let reader = || ImageReader::with_format(Cursor::new(bytes), format);
        let (width, height) = reader().into_dimensions().map_err(said)?;
        let count = u64::from(width) * u64::from(height);
        if count > MOST_PIXELS || count > *left {
            return Err(format!("{width} by {height} pixels, which is more than is decoded"));
        }
        *left -= count;
        let mut reader = reader();
        let mut limits = Limits::default();
        // Of 16 bits in four channels, and once more in the decoder.
        limits.max_alloc = Some(16 * count + SPARE);
        reader.limits(limits);
        Ok(Reader { reader, width, height })
    }

    fn said(error: image::ImageError) -> String {
        error.to_string()
    }

    fn encoded(small: &DynamicImage, has_alpha: bool) -> image::ImageResult<(Vec<u8>, &'static str)> {
        let mut bytes = Vec::new();
        if has_alpha && small.color().has_alpha() {
            let small = small.to_rgba8();
            if small.pixels().any(|pixel| pixel.0[3] < u8::MAX) {
                let best =
                    PngEncoder::new_with_quality(&mut bytes, CompressionType::Best, FilterType::Adaptive);
                small.write_with_encoder(best)?;
                return Ok((bytes, "image/png"));
            }
        }
        let encoder = JpegEncoder::new_with_quality(&mut bytes, QUALITY);
        if small.color().has_color() {
            small.to_rgb8().write_with_encoder(encoder)?;
        } else {
            small.to_luma8().write_with_encoder(encoder)?;
        }
        Ok((bytes, "image/jpeg"))
    }

    const QUALITY: u8 = 75;
    /// Most pixels of an image that is decoded.
    const MOST_PIXELS: u64 = 1 << 26;
    /// What a decoder takes besides.
    const SPARE: u64 = 1 << 22;
}

/// Most pixels that are decoded of all images of a file.
pub(in crate::formats) const ALL_PIXELS: u64 = 1 << 31;
