//! Scenes without their images: smaller pictures of these stand in their place, so that most of the file need not come.

use super::super::failure::Usage;
use super::super::numbers::{count, grouped};
use super::super::output::{MeshFormat, Output};
use super::super::uwm::Uwm;
use super::part::Part;
use super::{Args, is_long};
use anyhow::{Context, bail};
use serde_json::{Value, json};
use std::io::{self, Read, Seek, SeekFrom};
use unweld::container::{AtomKind, Contents, FileBuilder, Plan, ResourceKind, packed_scene};
use unweld::formats::{Lighter, lighter};

/// A scene whose images are smaller, and what of the file it has no need of.
pub struct Light {
    pixels: u32,
    scene: Lighter,
    /// The resources that are left out, in ascending order.
    left_out: Vec<usize>,
}

/// That `--textures` is for what is fetched.
///
/// # Errors
/// [`Usage`] where it is not.
pub fn check(args: &Args, format: Option<MeshFormat>) -> anyhow::Result<()> {
    if args.textures.is_none() {
        return Ok(());
    }
    let what = match format {
        Some(format) if format.is_gltf() => return Ok(()),
        None if args.quality.is_all() => return Ok(()),
        None => "with --textures a .uwm file has all of the mesh: as .glb it may have a part of it",
        Some(_) => "--textures is for .uwm, .glb and .gltf",
    };
    Err(Usage(what.to_owned()).into())
}

/// That it is not for a set of meshes.
///
/// # Errors
/// [`Usage`] where it is.
pub fn check_set(args: &Args) -> anyhow::Result<()> {
    match args.textures {
        Some(_) => Err(Usage("a set of meshes has no images: --textures is for scenes".to_owned()).into()),
        None => Ok(()),
    }
}

/// A plan with a part that ends with the scene.
pub fn parted(mut plan: Plan, contents: &Contents) -> Plan {
    let Some(end) = contents.scene().map(|number| contents.resources[number].atoms.end) else { return plan };
    let cut = |atoms: std::ops::Range<usize>| {
        let at = end.clamp(atoms.start, atoms.end);
        [atoms.start..at, at..atoms.end]
    };
    let atoms = plan.parts.iter().flat_map(|part| cut(part.atoms.clone())).filter(|atoms| !atoms.is_empty());
    plan.parts =
        atoms.map(|atoms| unweld::container::Part { bytes: contents.bytes(atoms.clone()), atoms }).collect();
    plan
}

/// Whether the scene is there once atom `index` is.
pub fn is_known(contents: &Contents, index: usize) -> bool {
    contents.scene().is_some_and(|number| contents.resources[number].atoms.end == index + 1)
}

impl Light {
    /// What the scene tells that has come.
    ///
    /// # Errors
    /// Those of the medium and of the decoder; where its JSON is at fault.
    pub fn of(part: &Part, pixels: u32, memory: u64) -> anyhow::Result<Self> {
        Self::of_scene(&mut Uwm::of_file(part.reader()?, &part.name, memory)?, pixels)
    }

    /// The same, of a file.
    ///
    /// # Errors
    /// As [`Light::of`], and where it has no scene.
    pub fn of_scene(uwm: &mut Uwm, pixels: u32) -> anyhow::Result<Self> {
        let json = uwm.scene()?.with_context(|| format!("{}: there is no scene", uwm.name))?;
        let scene = lighter(&json, pixels).with_context(|| uwm.name.clone())?;
        let kinds = &uwm.contents.resources;
        let first = kinds.iter().position(|entry| entry.kind == ResourceKind::Buffer).unwrap_or(kinds.len());
        let left_out = scene.left_out.iter().map(|buffer| first + buffer).collect();
        Ok(Self { pixels, scene, left_out })
    }

    /// Whether a resource is left out.
    pub fn leaves_out(&self, number: usize) -> bool {
        self.left_out.binary_search(&number).is_ok()
    }

    /// Whether it is so long that it is not asked for.
    pub fn passes_over(&self, contents: &Contents, number: usize) -> bool {
        self.leaves_out(number) && is_long(contents, number)
    }

    /// Writes a file of what came, whose scene has the smaller images; what came is removed.
    ///
    /// # Errors
    /// Those of the medium; where the file would take more memory than is allowed.
    pub fn write(&self, contents: &Contents, part: Part, args: &Args, output: &Output) -> anyhow::Result<()> {
        let name = part.name.clone();
        let bytes = contents.file_bytes() - self.bytes(contents);
        if bytes > args.max_memory {
            bail!(
                "{name}: {} are to be written, --max-memory allows {}",
                count(bytes, "byte"),
                grouped(args.max_memory)
            );
        }
        let mut file = part.reader()?;
        let mut read = |atoms: std::ops::Range<usize>| -> io::Result<Vec<u8>> {
            let at = contents.bytes(atoms);
            file.seek(SeekFrom::Start(at.start))?;
            let mut bytes = Vec::new();
            (&mut file).take(at.end - at.start).read_to_end(&mut bytes)?;
            Ok(bytes)
        };
        let header = contents.header;
        let mut builder = FileBuilder::new(header.lattice, header.maximum, contents.levels.clone());
        (builder.coding, builder.attributes) = (header.coding, contents.attributes.clone());
        let mesh = contents.atoms.iter().enumerate().filter(|(_, atom)| atom.kind != AtomKind::Resource);
        for (index, atom) in mesh {
            let bytes = read(index..index + 1).with_context(|| name.clone())?;
            builder.atom(atom.kind, atom.level, atom.items, atom.triangles, bytes);
        }
        for (number, entry) in contents.resources.iter().enumerate().filter(|(k, _)| !self.leaves_out(*k)) {
            let bytes = match entry.kind {
                ResourceKind::Scene if number == 0 => packed_scene(&self.scene.json)?,
                _ => read(entry.atoms.clone()).with_context(|| name.clone())?,
            };
            builder.resource(entry.kind, entry.place, &bytes);
        }
        output
            .write(|out| builder.write(&mut io::BufWriter::new(out)).map(drop).map_err(io::Error::other))?;
        part.remove();
        Ok(())
    }

    /// For programs.
    pub fn json(&self, contents: &Contents) -> Value {
        json!({ "pixels": self.pixels, "smaller_images": self.scene.images, "left_out_bytes": self.bytes(contents) })
    }

    /// In words.
    pub fn text(&self, contents: &Contents) -> String {
        let (images, left_out) = (self.scene.images as u64, self.bytes(contents));
        match images {
            0 => format!("all of the mesh; no image has a picture of at most {} pixels", self.pixels),
            _ => format!(
                "all of the mesh, with smaller pictures of {} in place of {}",
                count(images, "image"),
                count(left_out, "byte"),
            ),
        }
    }

    /// Bytes of what is left out.
    fn bytes(&self, contents: &Contents) -> u64 {
        self.left_out
            .iter()
            .filter_map(|&number| contents.resources.get(number))
            .map(|entry| entry.bytes)
            .sum()
    }
}
