//! Several inputs: which files they are, and where each of them goes.

use super::args::is_stream;
use super::failure::Usage;
use super::input;
use anyhow::bail;
use std::collections::{BTreeMap, BTreeSet};
use std::ffi::{OsStr, OsString};
use std::path::{Path, PathBuf};
use unweld::formats::Format;
use walkdir::{DirEntry, WalkDir};

/// A file to encode.
#[derive(Debug)]
pub struct Job {
    /// Where it lies.
    pub input: PathBuf,
    /// Where the result goes; or why it cannot even be tried.
    pub output: Result<PathBuf, String>,
}

/// What is to be done, and what is left out of the folders among the inputs.
#[derive(Debug, Default)]
pub struct Jobs {
    /// In the order of the inputs; those of a folder by their names.
    pub jobs: Vec<Job>,
    /// Hidden files and folders.
    pub hidden: usize,
    /// Files that are not called as meshes are, and linked folders.
    pub others: usize,
}

impl Jobs {
    /// Searches the folders among the inputs; results go to the folder `output`.
    ///
    /// # Errors
    /// [`Usage`] where two inputs of one name would become one file, or one has no name; where there is no mesh at all.
    pub fn find(inputs: &[PathBuf], output: &Path) -> anyhow::Result<Self> {
        let mut found = Self::default();
        for input in inputs {
            if input.is_dir() {
                found.search(input, output);
            } else {
                let output = into_folder(input, output)?;
                found.jobs.push(Job { input: input.clone(), output: Ok(output) });
            }
        }
        found.part()?;
        if found.jobs.is_empty() {
            let folders: Vec<String> = inputs.iter().map(|input| input::name(input)).collect();
            bail!("{}: there is no mesh", folders.join(", "));
        }
        Ok(found)
    }

    fn search(&mut self, folder: &Path, output: &Path) {
        let is_hidden =
            |entry: &DirEntry| entry.depth() > 0 && entry.file_name().as_encoded_bytes().starts_with(b".");
        let mut hidden = 0;
        let shown = WalkDir::new(folder).sort_by_file_name().into_iter().filter_entry(|entry| {
            hidden += usize::from(is_hidden(entry));
            !is_hidden(entry)
        });
        for entry in shown {
            let entry = match entry {
                Ok(entry) => entry,
                Err(error) => {
                    let input = error.path().unwrap_or(folder).to_owned();
                    let cause = error.io_error().map_or_else(|| error.to_string(), ToString::to_string);
                    self.jobs.push(Job { input, output: Err(cause) });
                    continue;
                }
            };
            let path = entry.path();
            if entry.file_type().is_dir() {
                continue;
            }
            if !path.is_file() || Format::from_path(path).is_none() {
                self.others += 1;
                continue;
            }
            let within = path.strip_prefix(folder).ok().and_then(Path::parent).unwrap_or(Path::new(""));
            let output = output.join(within).join(result_name(entry.file_name()));
            self.jobs.push(Job { input: path.to_owned(), output: Ok(output) });
        }
        self.hidden += hidden;
    }

    /// An input that is named twice is encoded once. Where two inputs would become one file, both keep their whole names.
    fn part(&mut self) -> anyhow::Result<()> {
        let mut seen = BTreeSet::new();
        let file = |input: &PathBuf| input.canonicalize().unwrap_or_else(|_| input.clone());
        self.jobs.retain(|job| seen.insert((file(&job.input), job.output.clone())));
        let mut counts: BTreeMap<PathBuf, usize> = BTreeMap::new();
        for output in self.jobs.iter().filter_map(|job| job.output.as_ref().ok()) {
            *counts.entry(output.clone()).or_default() += 1;
        }
        let mut first: BTreeMap<PathBuf, PathBuf> = BTreeMap::new();
        for Job { input, output } in &mut self.jobs {
            let (Ok(output), Some(name)) = (output, input.file_name()) else { continue };
            if counts.get(output).is_some_and(|&count| count > 1) {
                output.set_file_name(whole_name(name));
            }
            if let Some(other) = first.insert(output.clone(), input.clone()) {
                let [one, other] = [&other, input].map(|path| path.display());
                let output = output.display();
                return Err(Usage(format!(
                    "{one} and {other} would both become {output}: encode them into different folders"
                ))
                .into());
            }
        }
        Ok(())
    }
}

/// Whether a path is that of a folder, or has to be because a separator ends it.
pub fn is_folder(path: &Path) -> bool {
    path.as_os_str().to_string_lossy().ends_with(std::path::is_separator) || path.is_dir()
}

/// Whether a name ends as those of meshes in other formats do, also compressed ones.
pub fn is_mesh_name(path: &Path) -> bool {
    let end = |path: &Path| path.extension().map(|end| end.to_string_lossy().to_ascii_lowercase());
    let stem = path.file_stem().map(Path::new);
    let told = end(path).and_then(|told| if COMPRESSED.contains(&&*told) { end(stem?) } else { Some(told) });
    told.is_some_and(|told| MESH_ENDS.contains(&&*told))
}

/// The result of an input in a folder.
///
/// # Errors
/// [`Usage`] where the input has no name.
pub fn into_folder(input: &Path, folder: &Path) -> anyhow::Result<PathBuf> {
    match input.file_name() {
        Some(name) if !is_stream(input) => Ok(folder.join(result_name(name))),
        _ => Err(Usage(format!("{} has no name to go by in a folder", input::name(input))).into()),
    }
}

/// The name with `.uwm` behind it.
fn whole_name(name: &OsStr) -> OsString {
    let mut result = name.to_owned();
    result.push(".uwm");
    result
}

/// The name without `.gz` and without what tells the format, and with `.uwm`.
fn result_name(name: &OsStr) -> OsString {
    let name = Path::new(name);
    let mut stem = name;
    if name.extension().is_some_and(|e| e.eq_ignore_ascii_case("uwm")) {
        stem = name.file_stem().map_or(stem, Path::new);
    } else if Format::from_path(name).is_some() {
        if stem.extension().is_some_and(|e| e.eq_ignore_ascii_case("gz")) {
            stem = stem.file_stem().map_or(stem, Path::new);
        }
        stem = stem.file_stem().map_or(stem, Path::new);
    }
    whole_name(stem.as_os_str())
}

/// Ends of names that meshes, scenes and point clouds have.
const MESH_ENDS: [&str; 38] = [
    "3ds", "3mf", "abc", "amf", "blend", "brep", "bvh", "cgns", "ctm", "dae", "drc", "fbx", "glb", "gltf",
    "iges", "igs", "las", "laz", "lwo", "max", "mesh", "msh", "obj", "off", "pcd", "ply", "pts", "stl",
    "step", "stp", "usd", "usda", "usdc", "usdz", "vtk", "vtp", "vtu", "x3d",
];
const COMPRESSED: [&str; 5] = ["bz2", "gz", "xz", "zip", "zst"];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_meshes() {
        let is = |name: &str| is_mesh_name(Path::new(name));
        for name in ["a.ply", "a.OBJ", "b.c/a.stl.gz", "a.off", "a.glb", "a.gltf", "a.drc", "a.3mf.ZIP"] {
            assert!(is(name), "{name}");
        }
        for name in ["a", "a.uwm", "a.ply.uwm", "ply", ".ply", "a.gz", "a.uwm.gz", "a.ply/b", "-"] {
            assert!(!is(name), "{name}");
        }
    }

    #[test]
    fn names_of_results() {
        let of = |name: &str| result_name(OsStr::new(name)).into_string().unwrap();
        assert_eq!(of("bunny.ply"), "bunny.uwm");
        assert_eq!(of("bunny.v2.OBJ.GZ"), "bunny.v2.uwm");
        assert_eq!(of("bunny"), "bunny.uwm");
        assert_eq!(of("bunny.dat"), "bunny.dat.uwm");
        assert_eq!(of("bunny.gz"), "bunny.gz.uwm");
        assert_eq!(of(".ply"), ".ply.uwm");
        assert_eq!(of("bunny.UWM"), "bunny.uwm");
    }
}
