//! The arguments of the benchmark.

use super::cases::{Case, default_file};
use clap::{Parser, ValueEnum};
use std::path::{Path, PathBuf};

/// unweld beside Draco, meshoptimizer and published figures, as tables.
///
/// Without MESHES the default meshes are looked for in $UNWELD_DATA, or else in ../shared/data beside the project.
#[derive(Parser)]
#[command(
    name = "table",
    bin_name = "cargo run --release --features peers --example table --",
    after_help = EXAMPLES
)]
pub struct Args {
    /// Meshes to measure instead of the default ones (PLY, OBJ, STL or OFF, also gzip-compressed, or the triangles of a GLB)
    #[arg(value_name = "MESHES")]
    pub meshes: Vec<PathBuf>,
    /// Bits a coordinate; 12 where not given, 14 for the dragon, the small meshes, the CAD parts and the growing meshes
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(8..=24))]
    pub bits: Option<u32>,
    /// Runs of which times are the median
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u64).range(1..))]
    pub runs: u64,
    /// What to measure; all where not given, with MESHES only what is about meshes of one's own
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    sections: Vec<Section>,
    /// Sizes of the generated meshes of the sections `linear` and `simplifiers`, in million triangles
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_values_t = [1.0, 2.0, 4.0, 8.0])]
    pub linear: Vec<f64>,
    /// Seed of the generated meshes of the section `acceptance`
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
    /// Markdown table of what the peers made of the models of the section `attributes`; gltf/PEERS.md of the default meshes, if it is there
    #[arg(long, value_name = "FILE")]
    peers: Option<PathBuf>,
    /// Folder for the drawings of the section `curves`; examples/curves where everything is measured, else nowhere
    #[arg(long, value_name = "FOLDER")]
    curves: Option<PathBuf>,
    /// Where the section `looks` draws levels of a scene made by code, ours above the peer's, as PNG
    #[arg(long, value_name = "FILE")]
    pub sheet: Option<PathBuf>,
    /// Where to write the tables as Markdown; BENCHMARKS.md where everything is measured, else nowhere
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Where to write the tables as JSON
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
}

/// A part of the benchmark.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Section {
    /// Sizes beside Draco, of the default settings and of the profile small
    Sizes,
    /// Sizes of generated meshes whose vertices stand in rows, or in part
    Structured,
    /// Sizes of small meshes
    Small,
    /// Sizes of generated meshes that no rule of the codec was chosen on
    Acceptance,
    /// Sizes, errors, times and memory
    Main,
    /// The same for the dragon
    Dragon,
    /// Errors of the levels of CAD parts
    Cad,
    /// Sizes beside progressive coders
    Progressive,
    /// Errors of prefixes beside an earlier version's
    Earlier,
    /// Errors of prefixes, with a coarse preview
    Prefixes,
    /// Errors against bytes, drawn, beside simplified meshes coded by Draco
    Curves,
    /// Errors of prefixes beside another simplifier's meshes, estimated
    Hqms,
    /// Simplifiers at equal triangles: errors, times, memory, topology
    Simplifiers,
    /// Bits of keyframes
    Keyframes,
    /// Time and memory of growing meshes
    Linear,
    /// The comparison of the paper: ffc and stellar
    Paper,
    /// The profiles beside the default
    Profiles,
    /// Exact coordinates and order, beside general compressors
    Exact,
    /// Models with attributes, beside what other coders made of them
    Attributes,
    /// How levels of textured glTF models look beside meshoptimizer's
    Looks,
}

impl Section {
    /// Whether it measures meshes of its own, whatever is named.
    fn of_its_own(self) -> bool {
        matches!(
            self,
            Self::Structured
                | Self::Small
                | Self::Acceptance
                | Self::Dragon
                | Self::Cad
                | Self::Progressive
                | Self::Earlier
                | Self::Hqms
                | Self::Simplifiers
                | Self::Linear
                | Self::Looks
        )
    }
}

impl Args {
    /// Where to read what the peers made of models.
    pub fn peers(&self) -> Option<PathBuf> {
        self.peers.clone().or_else(|| default_file("gltf/PEERS.md").ok())
    }

    /// The sections to measure, in their order.
    pub fn sections(&self) -> Vec<Section> {
        let chosen = |section: &Section| match self.sections.as_slice() {
            [] if self.meshes.is_empty() => true,
            [] => !section.of_its_own(),
            sections => sections.contains(section),
        };
        Section::value_variants().iter().copied().filter(chosen).collect()
    }

    /// Where Markdown goes. A run of parts does not overwrite the whole one unasked.
    pub fn out(&self) -> Option<&Path> {
        self.out.as_deref().or(self.everything().then_some(Path::new("BENCHMARKS.md")))
    }

    /// Where drawings go; the same holds for them.
    pub fn curves(&self) -> Option<&Path> {
        self.curves.as_deref().or(self.everything().then_some(Path::new("examples/curves")))
    }

    fn everything(&self) -> bool {
        self.meshes.is_empty() && self.sections.is_empty()
    }

    /// The files named, or else those of the default set.
    ///
    /// # Errors
    /// Where one of the default set is missing.
    pub fn files(&self, names: &[&str]) -> anyhow::Result<Vec<PathBuf>> {
        if self.meshes.is_empty() {
            names.iter().map(|name| default_file(name)).collect()
        } else {
            Ok(self.meshes.clone())
        }
    }

    /// The meshes named, or else these of the default set.
    ///
    /// # Errors
    /// Those of reading.
    pub fn cases(&self, names: &[&str], bits: u32) -> anyhow::Result<Vec<Case>> {
        let bits = self.bits.unwrap_or(bits);
        if self.meshes.is_empty() {
            return names.iter().map(|name| Case::read(&default_file(name)?, bits)).collect();
        }
        self.meshes.iter().map(|path| Case::read(path, bits)).collect()
    }
}

const EXAMPLES: &str = "\
EXAMPLES
  table                                          everything, written to BENCHMARKS.md
  table --sections main --runs 1                 the main table, quickly
  table --sections sizes,structured,small,acceptance,cad,earlier
                                                 sizes and errors alone: they do not depend on the machine
  table --sections acceptance --seed 7           other meshes of the same kinds
  table --sections linear 1.ply 2.ply 4.ply      time and memory of growing meshes of one's own
  table --bits 14 --json here.json a.ply b.obj   meshes of one's own";
