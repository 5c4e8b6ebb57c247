//! Colours of the input kept by a texture of the result.

use super::{Args, SAMPLES};
use crate::cli::args::{is_stream, size};
use crate::cli::failure::Usage;
use crate::cli::input;
use crate::cli::numbers::grouped;
use crate::cli::output::{Content, MeshFormat, Output, content};
use crate::cli::progress::Progress;
use anyhow::{Context, anyhow, bail};
use serde_json::{Value, json};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use unweld::Error;
use unweld::formats::{
    Coordinates, Source, Texture, material_library, read_image, textured_gltf_files, turn_v,
    write_textured_glb,
};
use unweld::mesh::attributes::{Attribute, Semantic};
use unweld::mesh::{IndexedMesh, Paint};
use unweld::reduce::texture::{BakeOptions, Baked, bake, colour_difference};
use unweld::render::write_image;

/// Whether and how colours are baked.
#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Texture")]
pub struct Texturing {
    /// Bake the colours of the input, those of its vertices or faces, materials and their textures, into a texture of the result, and write it here,
    /// in the folder of OUT or below it; OUT names it, .obj by a material in a file .mtl beside it, .ply by a comment TextureFile; a .glb has
    /// it in itself, too
    #[arg(long, value_name = "MAP.png")]
    bake: Option<PathBuf>,
    /// Most texels of the map, with a suffix K, M, G or without: the largest power of two counts
    #[arg(long, value_name = "T", value_parser = texels, default_value = "1M", requires = "bake")]
    texels: u64,
    /// Texels round each triangle's part of the map that repeat its own, 0 to 64: 1 keeps looks between texels from mixing neighbours in
    #[arg(long, value_name = "G", value_parser = clap::value_parser!(u32).range(..=64), default_value_t = 1, requires = "bake")]
    gutter: u32,
    /// The picture that lies on the input where its material names none, or none that is there: PNG, JPEG or WebP
    #[arg(long, value_name = "IMAGE", requires = "bake")]
    texture: Option<PathBuf>,
}

/// A texture to be made.
pub struct Baking {
    map: Output,
    /// The file of the material.
    library: Option<Output>,
    /// The map's path from the result's folder.
    name: String,
    /// With all that it had.
    original: IndexedMesh,
    paint: Paint,
    options: BakeOptions,
}

/// A texture that has been made.
pub struct Made {
    baked: Baked,
    png: Vec<u8>,
    /// The mean difference of the colours, of 255.
    difference: f64,
}

impl Texturing {
    /// Where the map goes, if there is to be one, before any work is done for it.
    ///
    /// # Errors
    /// [`Usage`] where it is not to be had with such an output, or would be written over an input; as [`Output::new`].
    pub fn outputs(
        &self,
        args: &Args,
        format: MeshFormat,
    ) -> anyhow::Result<Option<(Output, Option<Output>, String)>> {
        let Some(path) = self.bake.as_deref() else { return Ok(None) };
        if format == MeshFormat::Stl {
            return Err(Usage(
                "--bake wants a format with texture coordinates: .obj, .ply, .glb or .gltf".to_owned(),
            )
            .into());
        }
        if is_stream(path) || !path.extension().is_some_and(|e| e.eq_ignore_ascii_case("png")) {
            return Err(Usage(format!("{}: the name of a map must end in .png", path.display())).into());
        }
        if is_stream(&args.output) {
            return Err(
                Usage("--bake wants a file for OUT, beside the map: name one with -o".to_owned()).into()
            );
        }
        let inputs = || [Some(&*args.input), self.texture.as_deref()].into_iter().flatten();
        let map = Output::new(path, inputs())?;
        drop(Output::new(&args.output, inputs())?);
        let library = (format == MeshFormat::Obj).then(|| args.output.with_extension("mtl"));
        let library = library.map(|path| Output::new(&path, inputs())).transpose()?;
        let name = from_folder(&args.output, path).with_context(|| path.display().to_string())?;
        let name = match name {
            Some(name) => name,
            None if format == MeshFormat::Glb => String::new(),
            None => {
                let what =
                    "the map must lie in the folder of OUT or below it, since readers look nowhere else";
                return Err(Usage(format!("{}: {what}", path.display())).into());
            }
        };
        Ok(Some((map, library, name)))
    }

    /// Takes from the input what the texture is made of. What is left is to be simplified.
    ///
    /// # Errors
    /// Where a picture of the input cannot be had, and none is given for it; [`Usage`] where the map would be written over one.
    pub fn begin(
        &self,
        outputs: (Output, Option<Output>, String),
        args: &Args,
        source: &mut Source,
        mut paint: Paint,
        warnings: &mut Vec<String>,
    ) -> anyhow::Result<Baking> {
        let (map, library, name) = outputs;
        let has_colours = source.mesh.attributes.iter().any(|a| a.semantic == Semantic::Color);
        for output in [Some(&map), library.as_ref()].into_iter().flatten() {
            output.check_against(paint.files.iter().map(PathBuf::as_path))?;
        }
        match &self.texture {
            Some(path) => {
                let image = read_image(&input::read_bytes(path)?).map_err(|e| anyhow!(e));
                // A glTF's have linear light, and texture coordinates as pictures are.
                let turned = !paint.is_linear;
                paint.cover(image.with_context(|| path.display().to_string())?, turned);
            }
            None if has_colours => warnings.append(&mut paint.missing.clone()),
            None if !paint.missing.is_empty() => {
                bail!("{} (--texture gives a picture instead)", paint.missing.join("; "));
            }
            None => {}
        }
        let original = source.mesh.clone();
        let is_baked = |a: &Attribute| {
            matches!(a.semantic, Semantic::Color | Semantic::TexCoord | Semantic::Tangent | Semantic::Part)
        };
        let several = original.part_names.len() > 1;
        source.mesh.attributes.retain(|a| !is_baked(a));
        (source.mesh.part_names, source.mesh.libraries) = Default::default();
        let is_material = |what: &String| {
            ["materials (", "textures (", "images ("].iter().any(|list| what.starts_with(list))
        };
        source.dropped.retain(|what| !is_material(what));
        if several {
            source.dropped.push(format!("parts ({}, all of one texture)", original.part_names.len()));
        }
        let mut options = BakeOptions { texels: self.texels, gutter: self.gutter, ..BakeOptions::default() };
        options.max_memory = args.max_memory;
        Ok(Baking { map, library, name, original, paint, options })
    }
}

impl Baking {
    /// Makes the texture of a result.
    ///
    /// # Errors
    /// As [`bake`].
    pub fn make(&self, mesh: &IndexedMesh, progress: &mut Progress) -> anyhow::Result<Made> {
        let mut tell = |done, total| {
            progress.update("bake", done, total);
            true
        };
        let baked = match bake(mesh, &self.original, &self.paint, &self.options, &mut tell) {
            Err(error @ Error::Limit { .. }) => bail!("{error} (--max-memory allows more)"),
            Err(Error::Parameter(what)) => bail!("--bake: {what}"),
            baked => baked?,
        };
        let mut with = mesh.clone();
        with.attributes.push(baked.places.clone());
        let own = baked.paint();
        let difference =
            colour_difference((&with, &own), (&self.original, &self.paint), SAMPLES as usize, &self.options)?;
        let mut png = Vec::new();
        write_image(&baked.map, &mut png)?;
        Ok(Made { baked, png, difference })
    }

    /// Writes a result with its texture: all files or none.
    ///
    /// # Errors
    /// Those of the media.
    pub fn write(
        &self,
        mut mesh: IndexedMesh,
        made: &Made,
        args: &Args,
        (format, coordinates): (MeshFormat, Coordinates),
        output: &Output,
    ) -> anyhow::Result<()> {
        let texture = Texture { png: &made.png, cutoff: made.baked.cutoff() };
        let mut places =
            IndexedMesh { attributes: vec![made.baked.places.clone()], ..IndexedMesh::default() };
        turn_v(&mut places);
        mesh.attributes.append(&mut places.attributes);
        let mut files: Vec<(&Output, Content<'_>)> = vec![(&self.map, content(&made.png))];
        match format {
            MeshFormat::Gltf => {
                let mut inputs = vec![&*args.input];
                inputs.extend(self.paint.files.iter().map(PathBuf::as_path));
                let make = |stem: &str| textured_gltf_files(&mesh, &texture, &self.name, stem);
                return output.write_files_with(files, &inputs, make).map(drop);
            }
            MeshFormat::Glb => {
                files.push((
                    output,
                    Box::new(|mut out: &mut dyn Write| write_textured_glb(&mesh, &texture, &mut out)),
                ));
                return Output::write_all(files);
            }
            MeshFormat::Obj => {
                mesh.attributes.push(Attribute::parts(&vec![0; mesh.triangles.len()]));
                mesh.part_names = vec![format!("usemtl {MATERIAL}")];
            }
            MeshFormat::Ply | MeshFormat::Stl => mesh.libraries = vec![self.name.clone()],
        }
        if let Some(library) = &self.library {
            let name = Path::new(&library.name).file_name().unwrap_or_default().to_string_lossy();
            mesh.libraries = vec![name.into_owned()];
            files.push((library, content(material_library(MATERIAL, &self.name))));
        }
        let write = |out: &mut dyn Write| -> io::Result<()> { format.write_as_read(&mesh, coordinates, out) };
        files.push((output, Box::new(write)));
        Output::write_all(files)
    }

    /// What there is to say of it.
    pub fn text(&self, made: &Made) -> String {
        let map = &made.baked.map;
        let share = 100.0 * made.baked.texels as f64 / map.pixels.len() as f64;
        format!(
            "  {:<11}{} x {} texels in {}, {share:.0} % of them of triangles; colours {:.2} of 255 off in the mean\n",
            "texture",
            grouped(map.width),
            grouped(map.height),
            self.map.name,
            made.difference,
        )
    }

    /// So for programs.
    pub fn object(&self, made: &Made) -> Value {
        let map = &made.baked.map;
        json!({
            "output": self.map.name,
            "material": self.library.as_ref().map(|library| &library.name),
            "width": map.width,
            "height": map.height,
            "texels": made.baked.texels,
            "mean_difference": made.difference,
        })
    }
}

/// The path of a file from the folder of another one, with `/`; `None` where it is not below that.
fn from_folder(of: &Path, path: &Path) -> io::Result<Option<String>> {
    let folder = |path: &Path| {
        let folder = path.parent().filter(|folder| *folder != Path::new("")).unwrap_or(Path::new("."));
        folder.canonicalize()
    };
    let (from, to) = (folder(of)?, folder(path)?);
    let Ok(below) = to.strip_prefix(&from) else { return Ok(None) };
    let parts = below.iter().chain(path.file_name()).map(|part| part.to_str().map(str::to_owned));
    Ok(parts.collect::<Option<Vec<_>>>().map(|parts| parts.join("/")))
}

fn texels(text: &str) -> Result<u64, String> {
    size(text).map_err(|_| "a number of texels such as 65536, 512K or 4M".to_owned())
}

const MATERIAL: &str = "baked";
