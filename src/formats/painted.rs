//! What OBJ and PLY files are painted with: libraries of materials and pictures, which lie beside them.

use std::collections::HashMap;
use std::fs::File;
use std::io::Read;
use std::path::{Component, Path, PathBuf};

use crate::error::Result;
use crate::limits::{Budget, Limits};
use crate::mesh::paint::{Image, Material, Paint, TURNED};

use super::gltf::{ALL_PIXELS, decoded, within};
use super::write::is_picture;
use super::{Format, ReadOptions, Source, materials};

/// The paint of a mesh that was read of an OBJ or PLY file; of other files none. What cannot be had of it is told in [`Paint::missing`].
///
/// # Errors
/// [`Error::Limit`](crate::Error::Limit) where it takes more memory than is allowed.
pub(super) fn paint(source: &Source, options: &ReadOptions) -> Result<Paint> {
    let mut beside = Beside::new(options);
    let mut paint = Paint::default();
    match source.format {
        Format::Obj => beside.materials(source, &mut paint)?,
        Format::Ply => {
            for name in source.mesh.libraries.iter().filter(|name| is_picture(name)) {
                let image = beside.image(name)?;
                paint.of_parts.push(Some(paint.materials.len()));
                paint.materials.push(Material { image, transform: TURNED, ..Material::default() });
            }
        }
        _ => {}
    }
    (paint.images, paint.missing, paint.files) = (beside.images, beside.missing, beside.files);
    Ok(paint)
}

/// The pixels of a picture: PNG, JPEG or WebP, with the feature `images`.
///
/// # Errors
/// Why they cannot be had, in words for the user.
pub fn read_image(bytes: &[u8]) -> std::result::Result<Image, String> {
    decoded(bytes, &mut { ALL_PIXELS })
}

/// Files beside a file.
struct Beside<'a> {
    folder: Option<&'a Path>,
    budget: Budget,
    /// Pixels that may yet be decoded.
    left: u64,
    images: Vec<Image>,
    /// By their names the places of those that can be had.
    places: HashMap<String, Option<usize>>,
    missing: Vec<String>,
    files: Vec<PathBuf>,
}

impl<'a> Beside<'a> {
    fn new(options: &'a ReadOptions) -> Self {
        Self {
            folder: options.folder.as_deref(),
            budget: Budget::new(Limits { memory: options.max_memory, work: u64::MAX }),
            left: ALL_PIXELS,
            images: Vec::new(),
            places: HashMap::new(),
            missing: Vec::new(),
            files: Vec::new(),
        }
    }

    /// The materials that parts of an OBJ file name.
    fn materials(&mut self, source: &Source, paint: &mut Paint) -> Result<()> {
        let mut known = HashMap::new();
        for library in source.mesh.libraries.iter().filter(|name| !is_picture(name)) {
            let named = match self.file(library)? {
                Ok(bytes) => materials::read(&bytes),
                Err(why) => Err(why),
            };
            match named {
                // The first of a name counts.
                Ok(list) => list.into_iter().for_each(|named| {
                    known.entry(named.name.clone()).or_insert(named);
                }),
                Err(why) => self.missing.push(format!("{library} is not used: {why}")),
            }
        }
        let mut places: HashMap<&str, usize> = HashMap::new();
        for name in &source.mesh.part_names {
            let wanted = name.lines().find_map(|line| line.strip_prefix("usemtl ")).map(str::trim);
            let named = wanted.and_then(|wanted| known.get(wanted));
            let Some(named) = named else {
                paint.of_parts.push(None);
                continue;
            };
            let place = match places.get(&*named.name) {
                Some(&place) => place,
                None => {
                    let image = named.picture.as_deref().map(|name| self.image(name)).transpose()?.flatten();
                    paint.materials.push(Material { image, ..named.material });
                    paint.materials.len() - 1
                }
            };
            places.insert(&named.name, place);
            paint.of_parts.push(Some(place));
        }
        Ok(())
    }

    /// The place of a picture, by its name, if it can be had.
    fn image(&mut self, name: &str) -> Result<Option<usize>> {
        if let Some(place) = self.places.get(name) {
            return Ok(*place);
        }
        let image = match self.file(name)? {
            Ok(bytes) => decoded(&bytes, &mut self.left),
            Err(why) => Err(why),
        };
        let place = match image {
            Ok(image) => {
                self.budget.take_memory(image.pixels.len(), size_of::<[u8; 4]>())?;
                self.images.push(image);
                Some(self.images.len() - 1)
            }
            Err(why) => {
                self.missing.push(format!("image {name} is not shown: {why}"));
                None
            }
        };
        self.places.insert(name.to_owned(), place);
        Ok(place)
    }

    /// The bytes of a file below the folder, or why they cannot be had.
    fn file(&mut self, name: &str) -> Result<std::result::Result<Vec<u8>, String>> {
        let name = name.replace('\\', "/");
        let path = Path::new(&name);
        let is_below = path.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir))
            && !name.is_empty();
        if !is_below {
            return Ok(Err("it is not below the file's own folder".to_owned()));
        }
        let Some(folder) = self.folder else {
            return Ok(Err("the file's own folder is not known".to_owned()));
        };
        let path = match within(folder, path) {
            Ok(path) => path,
            Err(why) => return Ok(Err(why)),
        };
        let open = || -> std::result::Result<(File, u64), String> {
            let said = |e: std::io::Error| format!("{}: {e}", path.display());
            let file = File::open(&path).map_err(said)?;
            let there = file.metadata().map_err(said)?;
            if !there.is_file() {
                return Err(format!("{} is no file", path.display()));
            }
            Ok((file, there.len()))
        };
        let (file, length) = match open() {
            Ok(opened) => opened,
            Err(why) => return Ok(Err(why)),
        };
        self.files.push(path.clone());
        self.budget.take_memory(usize::try_from(length).unwrap_or(usize::MAX), 1)?;
        let mut bytes = Vec::new();
        // What grows while it is read is cut.
        let read = file.take(length).read_to_end(&mut bytes);
        self.budget.give_memory(usize::try_from(length).unwrap_or(usize::MAX), 1);
        Ok(read.map(|_| bytes).map_err(|e| format!("{}: {e}", path.display())))
    }
}

#[cfg(all(test, feature = "images"))]
mod tests {
    use super::*;
    use crate::formats::read_painted;

    const TEXT: &str = "mtllib m.mtl\nmtllib gone.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl a\nf 1/1 2/2 3/3\n\
        usemtl b\nf 1/1 3/3 2/2\nusemtl c\nf 2 1 3\n";

    fn picture(path: &Path) {
        let mut image = image::RgbaImage::new(2, 1);
        image.put_pixel(1, 0, image::Rgba([255, 0, 0, 255]));
        image.save(path).unwrap();
    }

    #[test]
    fn materials_and_pictures_are_read_beside_and_what_is_missing_is_told() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("maps")).unwrap();
        picture(&folder.path().join("maps/p.png"));
        let library = "newmtl a\nKd 1 0 0\nmap_Kd maps\\p.png\nnewmtl b\nmap_Kd ../x.png\n";
        std::fs::write(folder.path().join("m.mtl"), library).unwrap();
        let mut options = ReadOptions { folder: Some(folder.path().into()), ..ReadOptions::default() };
        let (source, paint) = read_painted(TEXT.as_bytes(), &options).unwrap();
        assert_eq!(paint.of_parts, [Some(0), Some(1), None]);
        let images: Vec<Option<usize>> = paint.materials.iter().map(|m| m.image).collect();
        assert_eq!((images, paint.images.len()), (vec![Some(0), None], 1));
        assert_eq!(paint.images[0].pixels[1], [255, 0, 0, 255]);
        assert_eq!(source.remarks, paint.missing);
        assert!(source.remarks[0].starts_with("gone.mtl is not used: "), "{:?}", source.remarks);
        assert_eq!(source.remarks[1], "image ../x.png is not shown: it is not below the file's own folder");
        // As memory allows.
        options.max_memory = 20;
        assert!(read_painted(TEXT.as_bytes(), &options).is_err());
    }

    #[test]
    fn a_ply_names_pictures_by_numbers() {
        let folder = tempfile::tempdir().unwrap();
        picture(&folder.path().join("b.png"));
        let text = "ply\nformat ascii 1.0\ncomment TextureFile a.png\ncomment TextureFile b.png\nelement vertex 3\nproperty float x\n\
            property float y\nproperty float z\nelement face 1\nproperty list uchar int vertex_indices\nproperty list uchar float texcoord\n\
            property int texnumber\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2 6 0 0 1 0 0 1 1\n";
        let options = ReadOptions { folder: Some(folder.path().into()), ..ReadOptions::default() };
        let (_, paint) = read_painted(text.as_bytes(), &options).unwrap();
        assert_eq!((paint.material(1).unwrap().image, paint.material(0).unwrap().image), (Some(0), None));
        assert!(paint.missing[0].contains("a.png"));
    }
}
