//! Where results go: to a file, all of it or nothing, or to standard output.

use super::args::is_stream;
use super::failure::{Usage, note};
use super::identity::Identity;
use super::input;
use super::numbers::{count, grouped, significant};
use super::replace::{self, Replacement};
use anyhow::Context;
use clap::ValueEnum;
use std::fs;
use std::io::{self, IsTerminal, Write};
use std::path::{Path, PathBuf};
use unweld::codec::grid::Real;
use unweld::formats::{
    Coordinates, Format, GltfFiles, Precision, unwritten, write_glb, write_obj, write_ply, write_stl,
};
use unweld::mesh::{IndexedMesh, Lattice};

/// A place that can be written to.
pub struct Output {
    /// The file to replace or to write to; `None` for standard output.
    file: Option<PathBuf>,
    /// What it is called in messages.
    pub name: String,
    /// Whether the file is replaced by renaming: not where it is a device or a pipe.
    replaced: bool,
}

impl Output {
    /// Sees whether the path can be written to, before any work is done for it. It must not be one of `inputs`.
    ///
    /// # Errors
    /// Where it cannot, or where it is standard output and that is a terminal; [`Usage`] where it is an input.
    pub fn new<'a>(path: &Path, inputs: impl IntoIterator<Item = &'a Path>) -> anyhow::Result<Self> {
        let output = Self::of(path)?;
        output.check_against(inputs)?;
        if output.replaced
            && let Some(file) = &output.file
        {
            replace::check(file).with_context(|| output.name.clone())?;
        }
        Ok(output)
    }

    fn of(path: &Path) -> anyhow::Result<Self> {
        if is_stream(path) {
            if io::stdout().is_terminal() {
                let what = "standard output is a terminal: name a file with -o, or redirect it";
                return Err(Usage(what.to_owned()).into());
            }
            return Ok(Self { file: None, name: "standard output".to_owned(), replaced: false });
        }
        let name = path.display().to_string();
        // A link stays, and what it leads to is replaced.
        let file = replace::followed(path).with_context(|| name.clone())?;
        let replaced = fs::metadata(&file).map_or(true, |there| there.is_file() || there.is_dir());
        Ok(Self { file: Some(file), name, replaced })
    }

    /// Whoever names the input as the output does not want to lose it.
    ///
    /// # Errors
    /// [`Usage`] where this is one of `inputs`.
    pub fn check_against<'a>(&self, inputs: impl IntoIterator<Item = &'a Path>) -> anyhow::Result<()> {
        let there = self.file.as_deref().map_or_else(Identity::of_output_stream, Identity::of_file);
        let mut inputs = inputs.into_iter();
        let Some(input) =
            there.and_then(|it| inputs.find(|input| Identity::of_input(input).as_ref() == Some(&it)))
        else {
            return Ok(());
        };
        Err(would_be_lost(&input::name(input), &self.name).into())
    }

    /// Whether this is standard output.
    pub fn is_stream(&self) -> bool {
        self.file.is_none()
    }

    /// The file that is replaced; `None` for standard output, devices and pipes.
    pub fn target(&self) -> Option<&Path> {
        self.file.as_deref().filter(|_| self.replaced)
    }

    /// Where to write to at once, bit by bit, if nothing is to be replaced.
    ///
    /// # Errors
    /// Those of the medium, with the name.
    pub fn open(&self) -> anyhow::Result<Box<dyn Write>> {
        match &self.file {
            None => Ok(Box::new(io::stdout())),
            Some(file) => {
                let file =
                    fs::OpenOptions::new().write(true).open(file).with_context(|| self.name.clone())?;
                Ok(Box::new(file))
            }
        }
    }

    /// Writes; a file becomes visible once all of it is written, until then an older one stays as it is.
    ///
    /// # Errors
    /// Those of the medium and of `content`, with the name.
    pub fn write(&self, content: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> anyhow::Result<()> {
        let write = || match &self.file {
            None => {
                let mut out = io::stdout().lock();
                content(&mut out)?;
                out.flush()
            }
            Some(file) if self.replaced => {
                let mut replacement = Replacement::new(file)?;
                content(replacement.file())?;
                replacement.finish()
            }
            Some(file) => {
                let mut file = fs::OpenOptions::new().write(true).open(file)?;
                content(&mut file)?;
                file.flush()
            }
        };
        write().with_context(|| self.name.clone())
    }

    /// Writes several files, of which none becomes visible before all of them are written: then one after the other, in their order.
    ///
    /// # Errors
    /// As [`Output::write`].
    pub fn write_all(files: Vec<(&Self, Content<'_>)>) -> anyhow::Result<()> {
        let (mut written, mut others) = (Vec::new(), Vec::new());
        for (output, content) in files {
            let Some(target) = output.target() else {
                others.push((output, content));
                continue;
            };
            let replacement = || -> io::Result<Replacement> {
                let mut replacement = Replacement::new(target)?;
                content(replacement.file())?;
                Ok(replacement)
            };
            written.push((output, replacement().with_context(|| output.name.clone())?));
        }
        for (output, replacement) in written {
            replacement.finish().with_context(|| output.name.clone())?;
        }
        others.into_iter().try_for_each(|(output, content)| output.write(content))
    }

    /// Writes a glTF and what lies beside it, of which each file becomes visible once all of them are written, the glTF last. `make` makes them, given
    /// what their names begin with. None of them must be one of `inputs`.
    ///
    /// # Errors
    /// As [`Output::write`] and [`Output::new`]; [`Usage`] where this is no file with a name.
    pub fn write_files(
        &self,
        inputs: &[&Path],
        make: impl FnOnce(&str) -> io::Result<GltfFiles>,
    ) -> anyhow::Result<Vec<String>> {
        self.write_files_with(Vec::new(), inputs, make)
    }

    /// As [`Output::write_files`], with other files, which become visible first.
    ///
    /// # Errors
    /// As [`Output::write_files`].
    pub fn write_files_with(
        &self,
        files: Vec<(&Self, Content<'_>)>,
        inputs: &[&Path],
        make: impl FnOnce(&str) -> io::Result<GltfFiles>,
    ) -> anyhow::Result<Vec<String>> {
        let target = self.target();
        let stem = target.and_then(|target| target.file_stem()).and_then(|stem| stem.to_str());
        let (Some(target), Some(stem)) = (target, stem) else {
            let what = "a .gltf is several files, which need a place beside it and a name of letters";
            return Err(Usage(format!("{}: {what}", self.name)).into());
        };
        let GltfFiles { json, beside, remarks } = make(stem).with_context(|| self.name.clone())?;
        let outputs =
            beside.iter().map(|file| Self::new(&target.with_file_name(&file.name), inputs.iter().copied()));
        let outputs = outputs.collect::<anyhow::Result<Vec<_>>>()?;
        let mut files: Vec<(&Self, Content<'_>)> = files;
        for (output, file) in outputs.iter().zip(beside) {
            files.push((output, content(file.bytes)));
        }
        files.push((self, content(json)));
        Self::write_all(files)?;
        Ok(remarks)
    }

    /// Tells the user something: on standard output, or on standard error where that is taken by the result.
    ///
    /// # Errors
    /// As [`say`].
    pub fn say(&self, text: &str) -> anyhow::Result<()> {
        if self.is_stream() {
            let _ = io::stderr().write_all(text.as_bytes());
            return Ok(());
        }
        say(text)
    }
}

/// Writes what is in a file.
pub type Content<'a> = Box<dyn FnOnce(&mut dyn Write) -> io::Result<()> + 'a>;

/// Bytes as they are.
pub fn content<'a>(bytes: impl AsRef<[u8]> + 'a) -> Content<'a> {
    Box::new(move |out| out.write_all(bytes.as_ref()))
}

/// Why an input is not written to, by the names of both.
pub fn would_be_lost(input: &str, output: &str) -> Usage {
    let what = if input == output { "the input".to_owned() } else { format!("the input {input}") };
    Usage(format!("{output} is {what}, which would be lost"))
}

/// A foreign mesh format to write.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum MeshFormat {
    Ply,
    Obj,
    Stl,
    Glb,
    /// With its buffer and its images in files beside it: by its name alone.
    #[value(skip)]
    Gltf,
}

impl MeshFormat {
    /// What the name ends in; PLY for standard output.
    ///
    /// # Errors
    /// [`Usage`] for any other end.
    pub fn of(path: &Path) -> anyhow::Result<Self> {
        let extension = path.extension().map(|e| e.to_ascii_lowercase());
        match extension.as_ref().and_then(|e| e.to_str()) {
            _ if is_stream(path) => Ok(Self::Ply),
            Some("ply") => Ok(Self::Ply),
            Some("obj") => Ok(Self::Obj),
            Some("stl") => Ok(Self::Stl),
            Some("glb") => Ok(Self::Glb),
            Some("gltf") => Ok(Self::Gltf),
            _ => {
                let ends = ".ply, .obj, .stl, .glb or .gltf";
                Err(Usage(format!("{}: the name must end in {ends}", path.display())).into())
            }
        }
    }

    /// As the end of a name.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Ply => "ply",
            Self::Obj => "obj",
            Self::Stl => "stl",
            Self::Glb => "glb",
            Self::Gltf => "gltf",
        }
    }

    /// Whether it has scenes.
    pub fn is_gltf(self) -> bool {
        matches!(self, Self::Glb | Self::Gltf)
    }

    /// Writes a mesh; a PLY file in binary32 where that keeps every coordinate, on the lattice if one is given, and an OBJ file
    /// with its decimals where they keep every point of the lattice. STL and glTF files are always in binary32. [`MeshFormat::Gltf`] is not
    /// written so, but by [`Output::write_files`].
    ///
    /// # Errors
    /// Those of `out`.
    pub fn write(
        self,
        mesh: &IndexedMesh,
        lattice: Option<&Lattice>,
        mut out: &mut dyn Write,
    ) -> io::Result<()> {
        match self {
            Self::Ply if fits_binary32(mesh, lattice) => write_ply(mesh, Precision::Float32, &mut out),
            Self::Ply => write_ply(mesh, Precision::Float64, &mut out),
            Self::Obj if decimals_fit_binary32(mesh, lattice) => {
                write_obj(mesh, Precision::Float32, &mut out)
            }
            Self::Obj => write_obj(mesh, Precision::Float64, &mut out),
            Self::Stl => write_stl(mesh, &mut out),
            Self::Glb => write_glb(mesh, &mut out),
            Self::Gltf => Err(io::Error::other("a .gltf is several files")),
        }
    }

    /// What a file of this format does not keep of the mesh, in words for the user.
    pub fn losses(self, mesh: &IndexedMesh, lattice: Option<&Lattice>) -> Vec<String> {
        let format = match self {
            Self::Ply => Format::Ply,
            Self::Obj => Format::Obj,
            Self::Stl => Format::Stl,
            Self::Glb | Self::Gltf => Format::Gltf,
        };
        let mut losses = unwritten(mesh, format);
        let name = match self {
            Self::Stl => "STL",
            Self::Glb | Self::Gltf => "glTF",
            Self::Ply | Self::Obj => return losses,
        };
        let mut used = vec![false; mesh.positions.len()];
        mesh.triangles.iter().flatten().for_each(|&v| used[v as usize] = true);
        let corners = 3 * mesh.triangles.len();
        let shared = used.iter().filter(|&&used| used).count();
        let rounding = mesh.positions.iter().flatten().map(|&x| (f64::from(x as f32) - x).abs());
        let rounding = rounding.fold(0.0, f64::max);
        if self == Self::Stl && shared < corners {
            let vertices = count(shared as u64, "vertex");
            losses.push(format!(
                "STL has no shared vertices: {vertices} written as {} corners",
                grouped(corners as u64)
            ));
        }
        if shared < used.len() {
            let isolated = count((used.len() - shared) as u64, "vertex");
            losses.push(format!("{name} has triangles alone: {isolated} of no triangle left out"));
        }
        let is_kept = fits_binary32(mesh, lattice);
        if rounding > 0.0 && (self == Self::Stl || !is_kept) {
            let kept = if is_kept { ", on the same points of the lattice" } else { "" };
            let by = significant(rounding, 3);
            losses.push(format!("{name} has binary32 numbers: coordinates rounded by up to {by}{kept}"));
        }
        losses
    }

    /// Writes what became of a mesh in the type that its coordinates were read in.
    ///
    /// # Errors
    /// Those of `out`.
    pub fn write_as_read(
        self,
        mesh: &IndexedMesh,
        coordinates: Coordinates,
        out: &mut dyn Write,
    ) -> io::Result<()> {
        match coordinates {
            Coordinates::Float32 => self.write_exact(mesh, Real::Binary32, out),
            Coordinates::Float64 | Coordinates::Text => self.write(mesh, None, out),
        }
    }

    /// Writes a mesh of which the coordinates are exact; a PLY file has them in the type that they are of, an OBJ file as
    /// decimals of that.
    ///
    /// # Errors
    /// Those of `out`.
    pub fn write_exact(self, mesh: &IndexedMesh, real: Real, mut out: &mut dyn Write) -> io::Result<()> {
        match (self, real) {
            (Self::Ply, Real::Binary32) => write_ply(mesh, Precision::Float32, &mut out),
            (Self::Ply, Real::Binary64) => write_ply(mesh, Precision::Float64, &mut out),
            (Self::Obj, Real::Binary32) => write_obj(mesh, Precision::Float32, &mut out),
            (Self::Obj, Real::Binary64) => write_obj(mesh, Precision::Float64, &mut out),
            (Self::Stl, _) => write_stl(mesh, &mut out),
            (Self::Glb, _) => write_glb(mesh, &mut out),
            (Self::Gltf, _) => Err(io::Error::other("a .gltf is several files")),
        }
    }
}

/// Writes text to standard output. Nobody reading it any more is no fault.
///
/// # Errors
/// Those of the medium.
pub fn say(text: &str) -> anyhow::Result<()> {
    let mut out = io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() != io::ErrorKind::BrokenPipe => Err(e).context("standard output"),
        _ => Ok(()),
    }
}

/// Tells the user something by the way, on standard error.
pub fn remark(quiet: bool, text: &str) {
    if !quiet {
        note(text);
    }
}

/// Whether every coordinate survives: as the same point of the lattice, or else exactly.
fn fits_binary32(mesh: &IndexedMesh, lattice: Option<&Lattice>) -> bool {
    let survives = |x: f64, k: usize| {
        let rounded = f64::from(x as f32);
        rounded == x
            || lattice.is_some_and(|lattice| {
                let point = lattice.unclamped(x, k);
                // Beyond this, positions are kept exactly, not as points of the lattice.
                lattice.step > 0.0 && point.abs() <= MOST && point == lattice.unclamped(rounded, k)
            })
    };
    mesh.positions.iter().all(|p| (0..3).all(|k| survives(p[k], k)))
}

/// Whether every coordinate survives as the same point of the lattice where it is written as a decimal of binary32, which is anywhere
/// between the neighbours of the binary32 number that is nearest.
fn decimals_fit_binary32(mesh: &IndexedMesh, lattice: Option<&Lattice>) -> bool {
    let Some(lattice) = lattice.filter(|lattice| lattice.step > 0.0) else { return false };
    let survives = |x: f64, k: usize| {
        let (point, near) = (lattice.unclamped(x, k), x as f32);
        let stays = |y: f32| lattice.unclamped(f64::from(y), k) == point;
        point.abs() <= MOST && stays(near.next_down()) && stays(near.next_up())
    };
    mesh.positions.iter().all(|p| (0..3).all(|k| survives(p[k], k)))
}

const MOST: f64 = unweld::codec::residue::MAX_OUTSIDE as f64;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn binary32_where_it_keeps_the_lattice() {
        let lattice = Lattice::over([1000.0, 0.0, 0.0], [1001.0, 1.0, 1.0], 12);
        let mesh = |x| IndexedMesh::new(vec![[x, 0.5, 0.25]], vec![]);
        // 1000.123 is no binary32 number; its neighbours are 6e-5 apart, points of the lattice 2.4e-4.
        assert!(fits_binary32(&mesh(1000.123), Some(&lattice)));
        assert!(!fits_binary32(&mesh(1000.123), None));
        assert!(fits_binary32(&mesh(1000.5), None));
        // At 20 bits points are 9.5e-7 apart.
        let lattice = Lattice::over([1000.0, 0.0, 0.0], [1001.0, 1.0, 1.0], 20);
        assert!(!fits_binary32(&mesh(1000.123), Some(&lattice)));
        let point = Lattice::over([0.1; 3], [0.1; 3], 12);
        assert!(!fits_binary32(&mesh(0.1), Some(&point)));
        assert!(!fits_binary32(&mesh(1e300), Some(&lattice)));
    }

    #[test]
    fn decimals_of_binary32_where_they_keep_the_lattice() {
        let mesh = |x| IndexedMesh::new(vec![[x, 0.0, 1.0]], vec![]);
        let lattice = Lattice::over([1000.0, 0.0, 0.0], [1001.0, 1.0, 1.0], 12);
        let on_lattice = lattice.position([2048, 1, 1])[0];
        let text = |bits| {
            let lattice = Lattice::over([1000.0, 0.0, 0.0], [1001.0, 1.0, 1.0], bits);
            let mut text = Vec::new();
            MeshFormat::Obj.write(&mesh(on_lattice + 1e-5), Some(&lattice), &mut text).unwrap();
            String::from_utf8(text).unwrap()
        };
        // Neighbours of binary32 are 6.1e-5 apart there, points of the lattice 2.4e-4 or 9.5e-7.
        let first = |text: String| text.split_whitespace().nth(1).unwrap().to_owned();
        assert!(first(text(12)).len() <= 9, "{}", text(12));
        assert_eq!(first(text(20)).parse::<f64>().unwrap(), on_lattice + 1e-5);
        assert!(!decimals_fit_binary32(&mesh(1000.5), None));
    }

    #[test]
    fn the_end_of_the_name_tells_the_format() {
        let of = |name: &str| MeshFormat::of(Path::new(name)).ok();
        assert_eq!(of("a.PLY"), Some(MeshFormat::Ply));
        assert_eq!(of("b.c/a.obj"), Some(MeshFormat::Obj));
        assert_eq!(of("-"), Some(MeshFormat::Ply));
        assert_eq!(of("a.Stl"), Some(MeshFormat::Stl));
        assert_eq!(of("a.Glb"), Some(MeshFormat::Glb));
        assert_eq!(of("a.gltf"), Some(MeshFormat::Gltf));
        assert_eq!(["a", "a.off", "a.ply.gz", ".ply"].map(of), [None; 4]);
    }

    #[test]
    fn what_stl_does_not_keep() {
        let x = 1.0 + f64::EPSILON;
        let mesh = IndexedMesh::new(vec![[x; 3], [0.5; 3], [0.0; 3], [7.0; 3]], vec![[0, 1, 2]; 2]);
        assert_eq!(MeshFormat::Ply.losses(&mesh, None), [""; 0]);
        let repeated = "STL has no shared vertices: 3 vertices written as 6 corners";
        let isolated = "STL has triangles alone: 1 vertex of no triangle left out";
        let rounded = "STL has binary32 numbers: coordinates rounded by up to 2.22e-16";
        assert_eq!(MeshFormat::Stl.losses(&mesh, None), [repeated, isolated, rounded]);
        let lattice = Lattice::over([0.0; 3], [8.0; 3], 12);
        let kept = format!("{rounded}, on the same points of the lattice");
        assert_eq!(MeshFormat::Stl.losses(&mesh, Some(&lattice))[2], kept);
        // A glTF file has other numbers, but the same points: that is said of STL alone.
        assert_eq!(
            MeshFormat::Glb.losses(&mesh, Some(&lattice)),
            ["glTF has triangles alone: 1 vertex of no triangle left out"]
        );
        assert_eq!(MeshFormat::Glb.losses(&mesh, None)[1], rounded.replace("STL", "glTF"));
        let mesh = IndexedMesh::new(vec![[0.5; 3], [0.25; 3], [0.0; 3]], vec![[0, 1, 2]]);
        assert_eq!(MeshFormat::Stl.losses(&mesh, None), [""; 0]);
    }
}
