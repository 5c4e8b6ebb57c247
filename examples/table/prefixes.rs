//! How far the mesh of a prefix lies from the original, with and without lifted levels of few bits.

use super::cases::Case;
use super::quality::{SAMPLES, SEED, mean_distance};
use super::tables::{Cell, Table};
use unweld::decoder::{Decoder, Options};
use unweld::encoder::{self, Encoder, Preview};
use unweld::mesh::IndexedMesh;

/// One row a mesh and share of the file.
///
/// # Errors
/// Those of the coders.
pub fn table(cases: &[Case]) -> anyhow::Result<Table> {
    let mut table = Table::new("Prefixes", &[&note()], &COLUMNS);
    for case in cases {
        let plain = encoder::Options { preview: Preview::Off, lifting: Some(0), ..case.options() };
        let files = [case.options(), plain].map(|options| Encoder::new(options).encode_to_vec(&case.mesh));
        let [lifted, plain] = files;
        let files = [lifted?, plain?];
        for share in SHARES {
            let mut row = vec![Cell::text(&case.name), Cell::Count(u64::from(share))];
            for file in &files {
                let bytes = file.len() * share as usize / 100;
                let mesh = decode(&file[..bytes])?;
                let error = mesh.as_ref().and_then(|mesh| mean_distance(case, mesh));
                row.extend([
                    Cell::Count(bytes as u64),
                    mesh.map_or(Cell::None, |mesh| Cell::Count(mesh.triangles.len() as u64)),
                    Cell::number(error.map(|error| error * 100.0 / case.diagonal()), 4),
                ]);
            }
            table.rows.push(row);
        }
    }
    Ok(table)
}

/// The mesh of a prefix, or `None` before the end of the base.
pub fn decode(prefix: &[u8]) -> anyhow::Result<Option<IndexedMesh>> {
    let mut decoder = Decoder::new(Options::default());
    decoder.push(prefix);
    while decoder.poll()?.is_some() {}
    Ok(decoder.level().is_some().then(|| decoder.assembled()).transpose()?)
}

fn note() -> String {
    format!(
        "The first bytes of the file, and the mesh that they give; share in % of the file. Error: mean distance of the original's surface from it, in % of \
         the diagonal of the bounding box, {SAMPLES} points, seed {SEED}; - before the end of the base. Plain: `--lifting 0 --preview off`, \
         levels of the input's own vertices, with all bits.",
    )
}

/// Shares of the file, in percent.
const SHARES: [u32; 6] = [2, 5, 10, 20, 35, 100];

const COLUMNS: [&str; 8] = [
    "mesh",
    "share %",
    "bytes",
    "triangles",
    "error %",
    "bytes, plain",
    "triangles, plain",
    "error %, plain",
];
