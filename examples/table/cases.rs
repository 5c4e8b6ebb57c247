//! The meshes: where they are, and as what all coders get them.

use super::glb;
use anyhow::{Context, anyhow, ensure};
use std::env;
use std::path::{Path, PathBuf};
use unweld::encoder::Options;
use unweld::mesh::topology::{self, Conditioned, Weld};
use unweld::mesh::{IndexedMesh, lattice};

/// A mesh to measure.
pub struct Case {
    /// Its file's name, without a folder.
    pub name: String,
    /// Bits a coordinate.
    pub bits: u32,
    /// What the file holds.
    pub input: IndexedMesh,
    /// The manifold that conditioning makes of it: what all coders and simplifiers get.
    pub mesh: IndexedMesh,
    /// Whether the manifold is all there is: no residue, nothing cut or turned round.
    pub whole: bool,
}

impl Case {
    /// Reads and conditions.
    ///
    /// # Errors
    /// Those of reading; where no triangle is left.
    pub fn read(path: &Path, bits: u32) -> anyhow::Result<Self> {
        let name = path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
        let mesh = if path.extension().is_some_and(|ending| ending == "glb") {
            glb::read(&std::fs::read(path).with_context(|| path.display().to_string())?)
                .with_context(|| path.display().to_string())?
        } else {
            // The error's text has the path and the cause.
            unweld::formats::read(path).map_err(|e| anyhow!("{e}"))?.mesh
        };
        // The peers are given positions and triangles alone.
        Self::of(name, IndexedMesh::new(mesh.positions, mesh.triangles), bits)
    }

    /// Conditions a mesh.
    ///
    /// # Errors
    /// Where no triangle is left.
    pub fn of(name: String, input: IndexedMesh, bits: u32) -> anyhow::Result<Self> {
        let Conditioned { manifold, remainder, .. } = topology::condition(&input, Weld::Exact);
        let table = &manifold.table;
        let triangles: Vec<[u32; 3]> =
            table.triangles().map(|t| table.triangle(t).map(|v| v.index() as u32)).collect();
        ensure!(!triangles.is_empty(), "{name}: no triangle is left after conditioning");
        let whole = remainder.extras.is_empty()
            && remainder.residue.is_empty()
            && remainder.stitches.is_empty()
            && remainder.flipped.not_any();
        Ok(Self { name, bits, input, mesh: IndexedMesh::new(manifold.positions, triangles), whole })
    }

    /// The default settings, with the bits of this case.
    pub fn options(&self) -> Options {
        Options { position_bits: self.bits, ..Options::default() }
    }

    /// The diagonal of the bounding box.
    pub fn diagonal(&self) -> f64 {
        let bounds = lattice::bounds(self.mesh.positions.iter().copied());
        bounds.map_or(0.0, |(min, max)| (0..3).map(|k| (max[k] - min[k]).powi(2)).sum::<f64>().sqrt())
    }
}

/// The file of a mesh of the default set.
///
/// # Errors
/// Where there is no folder of meshes, or the file is not in it.
pub fn default_file(name: &str) -> anyhow::Result<PathBuf> {
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data");
    let folder = env::var_os("UNWELD_DATA").map_or_else(beside, PathBuf::from);
    ensure!(
        folder.is_dir(),
        "no folder {}: set UNWELD_DATA to the folder of the test meshes, or name meshes (PLY, OBJ, STL, OFF)",
        folder.display()
    );
    let file = folder.join(name);
    file.is_file().then(|| file.clone()).with_context(|| format!("there is no {}", file.display()))
}
