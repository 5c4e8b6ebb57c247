//! Images of scenes: their bytes as they are, small pictures of them, and where each is of use.

use crate::builder::*;
use crate::scenes::{options, view};
use image::{DynamicImage, ImageFormat, Rgb, RgbImage, Rgba, RgbaImage};
use serde_json::{Value, json};
use std::io::Cursor;
use unweld::formats::{Role, Scene, Source, read_with};

const EXTENSION: &str = "UNWELD_progressive_mesh";

/// A picture that has something of everything.
fn picture(width: u32, height: u32) -> DynamicImage {
    let noise =
        |x: u32, y: u32| (x.wrapping_mul(2_654_435_761) ^ y.wrapping_mul(40_503)).to_le_bytes()[1] >> 3;
    RgbImage::from_fn(width, height, |x, y| {
        Rgb([(x * 255 / width) as u8, (y * 255 / height) as u8, noise(x, y)])
    })
    .into()
}

fn encoded(picture: &DynamicImage, format: ImageFormat) -> Vec<u8> {
    let mut bytes = Vec::new();
    picture.write_to(&mut Cursor::new(&mut bytes), format).unwrap();
    bytes
}

fn read(gltf: &Gltf) -> (Source, Scene, Value) {
    let mut source = read_with(&gltf.glb(), &options()).unwrap();
    let scene = source.scene.take().unwrap();
    let json = serde_json::from_slice(&scene.json).unwrap();
    (source, scene, json)
}

/// A triangle of sides of 1 and 2, on which a quarter of each picture lies, and images on it.
fn textured(images: &[(&[u8], &str)]) -> Gltf {
    let mut gltf = triangle();
    let uv = gltf.floats("VEC2", &[0.0, 0.0, 0.5, 0.0, 0.0, 0.5]);
    gltf.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = uv.into();
    gltf.json["meshes"][0]["primitives"][0]["material"] = 0.into();
    let mut material = json!({});
    for (k, (bytes, slot)) in images.iter().enumerate() {
        let view = gltf.view(bytes);
        gltf.push("images", json!({"bufferView": view}));
        gltf.push("textures", json!({"source": k}));
        material[*slot] = json!({"index": k});
    }
    gltf.push("materials", json!({"alphaMode": "BLEND", "pbrMetallicRoughness": material}));
    gltf
}

#[test]
fn pictures_come_small_first() {
    let large = encoded(&picture(1024, 512), ImageFormat::Png);
    let jpeg = encoded(&picture(300, 200), ImageFormat::Jpeg);
    let webp = encoded(&picture(128, 128), ImageFormat::WebP);
    let small = encoded(&picture(16, 64), ImageFormat::Png);
    let gltf = textured(&[
        (&large, "baseColorTexture"),
        (&jpeg, "aTexture"),
        (&webp, "bTexture"),
        (&small, "cTexture"),
    ]);
    let (source, scene, json) = read(&gltf);
    assert!(
        source.dropped.is_empty() && source.remarks.is_empty(),
        "{:?} {:?}",
        source.dropped,
        source.remarks
    );
    for (k, (bytes, media)) in
        [(&large, "image/png"), (&jpeg, "image/jpeg"), (&webp, "image/webp"), (&small, "image/png")]
            .into_iter()
            .enumerate()
    {
        let image = &json["images"][k];
        assert_eq!(
            (view(&scene, &json, &image["bufferView"]), &image["mimeType"]),
            (&bytes[..], &json!(media))
        );
        let sizes: &[(u32, [u32; 2])] = match k {
            0 => &[(64, [64, 32]), (256, [256, 128])],
            1 => &[(64, [64, 43])],
            2 => &[(64, [64, 64])],
            _ => &[],
        };
        let none = vec![];
        let previews = image["extensions"][EXTENSION]["previews"].as_array().unwrap_or(&none);
        assert_eq!(previews.len(), sizes.len(), "{k}");
        for (preview, (size, pixels)) in previews.iter().zip(sizes) {
            assert_eq!((&preview["size"], &preview["mimeType"]), (&json!(size), &json!("image/jpeg")));
            let small =
                image::load_from_memory(view(&scene, &json, &preview["bufferView"])).unwrap().to_rgb8();
            assert_eq!([small.width(), small.height()], *pixels);
            // The middle has the colour of the middle.
            let middle = small.get_pixel(pixels[0] / 2, pixels[1] / 2);
            assert!(middle.0[0].abs_diff(127) < 12 && middle.0[1].abs_diff(127) < 12, "{middle:?}");
        }
    }
    // The unit square is as large as eight triangles of area 1, 2.83 long. In the order of the sizes of pixels.
    let side = 8f64.sqrt();
    let texel = side / f64::from(1024 * 512).sqrt();
    let wanted = [
        (Role::Preview { image: 0, size: 64 }, f64::INFINITY),
        (Role::Preview { image: 1, size: 64 }, f64::INFINITY),
        (Role::Preview { image: 2, size: 64 }, f64::INFINITY),
        (Role::Original { image: 3 }, f64::INFINITY),
        (Role::Original { image: 2 }, side / 128.0),
        (Role::Preview { image: 0, size: 256 }, 4.0 * texel),
        (Role::Original { image: 1 }, side / 60_000f64.sqrt()),
        (Role::Original { image: 0 }, texel),
    ];
    assert_eq!(scene.buffers.len(), wanted.len());
    for (buffer, (role, from)) in scene.buffers.iter().zip(wanted) {
        assert_eq!(buffer.role, role);
        assert!(
            buffer.useful_from == from || (buffer.useful_from / from - 1.0).abs() < 1e-9,
            "{role:?}: {}",
            buffer.useful_from
        );
    }
}

/// All previews together are an eighth of an image at most, but for the first.
#[test]
fn a_larger_preview_is_to_be_worth_it() {
    let sizes = |bytes: &[u8]| -> Vec<u32> {
        let (_, scene, _) = read(&textured(&[(bytes, "baseColorTexture")]));
        let previews = scene.buffers.iter().filter_map(|buffer| match buffer.role {
            Role::Preview { size, .. } => Some((size, buffer.bytes.len())),
            _ => None,
        });
        let (sizes, lengths): (Vec<_>, Vec<_>) = previews.unzip();
        let all: usize = lengths.iter().sum();
        assert!(
            8 * all <= bytes.len() || (sizes == [64] && 2 * all <= bytes.len()),
            "{all} of {}",
            bytes.len()
        );
        sizes
    };
    // The same picture, stored plainly and with care.
    let picture = picture(600, 600);
    assert_eq!(sizes(&encoded(&picture, ImageFormat::Png)), [64, 256]);
    let mut small = Vec::new();
    let careful = image::codecs::jpeg::JpegEncoder::new_with_quality(&mut small, 10);
    picture.write_with_encoder(careful).unwrap();
    assert_eq!(sizes(&small), [64]);
}

/// The least length of a texel counts, with the scale of the texture's transform and in the units of the mesh.
#[test]
fn the_densest_surface_counts() {
    let bytes = encoded(&picture(128, 128), ImageFormat::Png);
    let mut gltf = textured(&[(&bytes, "baseColorTexture")]);
    let from = |gltf: &Gltf| {
        let (_, scene, _) = read(gltf);
        scene.buffers.iter().find(|buffer| buffer.role == Role::Original { image: 0 }).unwrap().useful_from
    };
    let near = |x: f64, y: f64| assert!((x / y - 1.0).abs() < 1e-9, "{x}, not {y}");
    let plain = 8f64.sqrt() / 128.0;
    near(from(&gltf), plain);
    gltf.json["nodes"][0]["scale"] = json!([4, 4, 4]);
    near(from(&gltf), 4.0 * plain);
    let slot = "/materials/0/pbrMetallicRoughness/baseColorTexture";
    gltf.json.pointer_mut(slot).unwrap()["extensions"] = json!({"KHR_texture_transform": {"scale": [8, 2]}});
    near(from(&gltf), plain);
    assert_eq!(Vec::from_iter(read(&gltf).0.texels), [(0, 1.0 / (8.0 * 128.0))]);
    gltf.json.pointer_mut(slot).unwrap()["texCoord"] = json!(1);
    assert_eq!(from(&gltf), 0.0, "there is no such set");
}

#[test]
fn alpha_stays_where_it_matters() {
    let clear = RgbaImage::from_fn(200, 200, |x, y| {
        Rgba([(x * y) as u8, x as u8, y as u8, if x < 100 { 255 } else { 9 }])
    });
    let clear = encoded(&clear.into(), ImageFormat::Png);
    let media =
        |gltf: &Gltf| read(gltf).2["images"][0]["extensions"][EXTENSION]["previews"][0]["mimeType"].clone();
    let mut gltf = textured(&[(&clear, "baseColorTexture")]);
    assert_eq!(media(&gltf), "image/png");
    gltf.json["materials"][0]["alphaMode"] = json!("OPAQUE");
    assert_eq!(media(&gltf), "image/jpeg");
    assert_eq!(media(&textured(&[(&clear, "metallicRoughnessTexture")])), "image/jpeg");
    assert_eq!(media(&textured(&[(&clear, "strangeTexture")])), "image/png");
}

#[test]
fn equal_images_are_stored_once() {
    let bytes = encoded(&picture(100, 100), ImageFormat::Png);
    let mut gltf = textured(&[(&bytes, "baseColorTexture")]);
    let uri = format!("data:image/png;base64,{}", base64(&bytes));
    gltf.push("images", json!({"uri": uri, "name": "second"}));
    let (_, scene, json) = read(&gltf);
    assert_eq!(scene.buffers.len(), 2);
    assert_eq!(json["images"][0]["bufferView"], json["images"][1]["bufferView"]);
    assert_eq!((&json["images"][1]["name"], json["images"][1].get("uri")), (&json!("second"), None));
}

#[test]
fn files_beside_it_come_in_and_links_stay() {
    let folder = tempfile::tempdir().unwrap();
    let bytes = encoded(&picture(100, 100), ImageFormat::Jpeg);
    std::fs::create_dir(folder.path().join("in")).unwrap();
    std::fs::write(folder.path().join("in/a b.jpg"), &bytes).unwrap();
    std::fs::write(folder.path().join("secret.jpg"), &bytes).unwrap();
    let mut gltf = triangle();
    for uri in ["a%20b.jpg", "../secret.jpg", "none.png", "https://example.org/c.png"] {
        gltf.push("images", json!({"uri": uri}));
    }
    let mut options = options();
    options.folder = Some(folder.path().join("in"));
    let source = read_with(&gltf.glb(), &options).unwrap();
    let scene = source.scene.unwrap();
    let json: Value = serde_json::from_slice(&scene.json).unwrap();
    assert_eq!(view(&scene, &json, &json["images"][0]["bufferView"]), bytes);
    assert_eq!(json["images"][0]["extensions"][EXTENSION]["uri"], "a%20b.jpg");
    for k in 1..4 {
        assert_eq!(json["images"][k], gltf.json["images"][k]);
    }
    assert_eq!(
        source.dropped,
        ["image 1, a file that is not there (../secret.jpg)", "image 2, a file that is not there (none.png)"]
    );
    assert_eq!(source.remarks, ["image 3 stays a link to https://example.org/c.png"]);
}

/// A PNG of a few bytes that says that it is of many pixels.
fn bomb(width: u32, height: u32) -> Vec<u8> {
    let mut bytes = encoded(&picture(2, 2), ImageFormat::Png);
    bytes[16..20].copy_from_slice(&width.to_be_bytes());
    bytes[20..24].copy_from_slice(&height.to_be_bytes());
    let crc = crc(&bytes[12..29]);
    bytes[29..33].copy_from_slice(&crc.to_be_bytes());
    bytes
}

fn crc(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0u32, |crc, &b| {
        (0..8).fold(crc ^ u32::from(b), |crc, _| crc >> 1 ^ if crc & 1 == 1 { 0xEDB8_8320 } else { 0 })
    })
}

#[test]
fn bombs_and_damage_have_no_preview() {
    let whole = encoded(&picture(300, 300), ImageFormat::Png);
    for (bytes, told) in [
        (bomb(100_000, 100_000), "100000 by 100000 pixels, which is more than is decoded"),
        (whole[..whole.len() / 2].to_vec(), ""),
        (whole[..20].to_vec(), ""),
        (b"GIF89a".to_vec(), "no PNG, JPEG, WebP or KTX 2.0"),
        (bomb(8000, 8000), ""),
    ] {
        let (source, scene, json) = read(&textured(&[(&bytes, "baseColorTexture")]));
        assert_eq!(view(&scene, &json, &json["images"][0]["bufferView"]), bytes);
        assert!(json["images"][0].get("extensions").is_none());
        let [remark] = &source.remarks[..] else { panic!("{:?}", source.remarks) };
        assert!(remark.starts_with("image 0 has no preview: ") && remark.ends_with(told), "{remark}");
        assert!(source.dropped.is_empty(), "nothing is lost");
    }
}

/// Pictures of KTX 2.0 are carried; their size says where they belong.
#[test]
fn ktx_is_carried() {
    let mut bytes = b"\xabKTX 20\xbb\r\n\x1a\n".to_vec();
    bytes.extend([0u32, 1, 256, 128, 0, 0, 1, 9, 0].iter().flat_map(|x| x.to_le_bytes()));
    let mut gltf = textured(&[(&bytes, "baseColorTexture")]);
    gltf.json["textures"][0] = json!({"extensions": {"KHR_texture_basisu": {"source": 0}}});
    let (source, scene, json) = read(&gltf);
    assert_eq!(json["images"][0]["mimeType"], "image/ktx2");
    assert!(source.remarks.is_empty() && scene.buffers.len() == 1);
    assert!((scene.buffers[0].useful_from * f64::from(256 * 128).sqrt() / 8f64.sqrt() - 1.0).abs() < 1e-9);
}
