//! Exact files, beside general compressors on the arrays and Draco without quantisation.

use super::peers::draco_without_quantisation;
use super::tables::{Cell, Table};
use anyhow::{Context, anyhow, ensure};
use std::io::Write;
use std::path::PathBuf;
use unweld::codec::grid::Real;
use unweld::decoder;
use unweld::encoder::{Encoder, Options, Report};
use unweld::formats::{self, Coordinates};
use unweld::mesh::IndexedMesh;

/// One row a mesh, as it is in its file.
///
/// # Errors
/// Those of reading and of the coders.
pub fn table(files: &[PathBuf]) -> anyhow::Result<Table> {
    let mut table = Table::new("Exact coordinates, and the order of the input", &NOTES, &COLUMNS);
    for path in files {
        let name = path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
        // The error's text has the path and the cause.
        let source = formats::read(path).map_err(|e| anyhow!("{e}"))?;
        let real = match source.coordinates {
            Coordinates::Float32 => Real::Binary32,
            Coordinates::Float64 | Coordinates::Text => Real::Binary64,
        };
        // Positions and triangles alone, as the arrays have.
        let mesh = IndexedMesh::new(source.mesh.positions, source.mesh.triangles);
        table.rows.push(row(&name, &mesh, real).with_context(|| name.clone())?);
    }
    Ok(table)
}

fn row(name: &str, mesh: &IndexedMesh, real: Real) -> anyhow::Result<Vec<Cell>> {
    let (vertices, triangles) = (mesh.positions.len(), mesh.triangles.len());
    let arrays = arrays(mesh, real);
    let (zstd, xz) = (zstd::encode_all(&arrays[..], 19)?.len(), xz(&arrays)?);
    let plain = encode(mesh, Options::default())?;
    let exact = encode(mesh, Options { exact: Some(real), ..Options::default() })?;
    let ordered = encode(mesh, Options { exact: Some(real), keep_order: true, ..Options::default() })?;
    let ratio = |bytes: u64, other: usize| Cell::number(Some(bytes as f64 / other as f64), 3);
    Ok(vec![
        Cell::text(name),
        Cell::text(real.to_string()),
        Cell::Count(vertices as u64),
        Cell::Count(triangles as u64),
        Cell::Count(arrays.len() as u64),
        Cell::Count(zstd as u64),
        Cell::Count(xz as u64),
        draco_without_quantisation(mesh, real).map_or(Cell::None, |bytes| Cell::Count(bytes as u64)),
        Cell::Count(plain.bytes),
        Cell::Count(exact.bytes),
        Cell::Count(ordered.bytes),
        ratio(exact.bytes, xz.min(zstd)),
        ratio(ordered.bytes, xz.min(zstd)),
        Cell::number(Some(exact.correction_bits / vertices as f64), 2),
        Cell::number(Some(ordered.order_bits / triangles as f64), 2),
    ])
}

/// Encodes, and sees that what has to come back does.
fn encode(mesh: &IndexedMesh, options: Options) -> anyhow::Result<Report> {
    let ordered = options.keep_order;
    let mut file = Vec::new();
    let report = Encoder::new(options).encode(mesh, &mut file)?;
    let back = decoder::decode(&file, decoder::Options::default())?.assembled()?;
    ensure!(back.triangles.len() == mesh.triangles.len(), "triangles are lost");
    if ordered {
        let bits =
            |mesh: &IndexedMesh| -> Vec<_> { mesh.positions.iter().map(|p| p.map(f64::to_bits)).collect() };
        ensure!(bits(&back) == bits(mesh) && back.triangles == mesh.triangles, "the arrays are not the same");
    }
    Ok(report)
}

/// Positions, then triangles, as a program has them in memory.
fn arrays(mesh: &IndexedMesh, real: Real) -> Vec<u8> {
    let mut bytes = Vec::new();
    for &x in mesh.positions.as_flattened() {
        match real {
            Real::Binary32 => bytes.extend((x as f32).to_le_bytes()),
            Real::Binary64 => bytes.extend(x.to_le_bytes()),
        }
    }
    bytes.extend(mesh.triangles.as_flattened().iter().flat_map(|v| v.to_le_bytes()));
    bytes
}

fn xz(bytes: &[u8]) -> anyhow::Result<usize> {
    let mut encoder = liblzma::write::XzEncoder::new(Vec::new(), 9);
    encoder.write_all(bytes)?;
    Ok(encoder.finish()?.len())
}

const NOTES: [&str; 2] = [
    "Bytes of whole files, at the default settings (14 bits a coordinate). Raw: the arrays of positions, in the type that the input's \
     coordinates are of (binary64 for text that declares none), and of triangles, as 32-bit indices; zstd -19 and xz -9 are given these arrays. \
     Draco: draco-core, Edgebreaker, compression level 10, without quantisation: it keeps coordinates but not the order, and drops isolated \
     vertices and degenerate triangles; - where it cannot encode the mesh so.",
    "Lattice: the file without either. Exact: `--exact`. Exact, in order: `--exact --keep-order`, which gives back both arrays, to the last bit, \
     and is checked here. Exact/best and in order/best: over the smaller of zstd and xz. Bits: the correction's a vertex of the input, the order's a \
     triangle.",
];

const COLUMNS: [&str; 15] = [
    "mesh",
    "coordinates",
    "vertices",
    "triangles",
    "raw",
    "zstd -19",
    "xz -9",
    "Draco, not quantised",
    "lattice",
    "exact",
    "exact, in order",
    "exact/best",
    "in order/best",
    "correction bits/vertex",
    "order bits/triangle",
];
