//! Models with normals, texture coordinates and colours, beside what Draco and gltfpack made of them.

use super::tables::{Cell, Table};
use anyhow::{Context, anyhow};
use std::path::{Path, PathBuf};
use unweld::encoder::{Encoder, Options};
use unweld::formats;
use unweld::mesh::attributes::Semantic;
use unweld::mesh::{Attribute, IndexedMesh};

/// One row a model; `peers` has a Markdown table of what the others made of them.
///
/// # Errors
/// Those of reading and of the coder.
pub fn table(files: &[PathBuf], peers: Option<&Path>) -> anyhow::Result<Table> {
    let mut table = Table::new("Attributes", &NOTES, &COLUMNS);
    let peers = match peers {
        Some(path) => std::fs::read_to_string(path).with_context(|| path.display().to_string())?,
        None => String::new(),
    };
    for path in files {
        let name = path.file_stem().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
        // The error's text has the path and the cause.
        let mesh = coded_by_all(formats::read(path).map_err(|e| anyhow!("{e}"))?.mesh);
        let peer = Peer::of(&name, &peers).filter(|peer| peer.triangles == mesh.triangles.len() as u64);
        table.rows.push(row(&name, &mesh, peer.as_ref()).with_context(|| name.clone())?);
    }
    Ok(table)
}

/// With what the peers were given: normals, the first texture coordinates, colours.
fn coded_by_all(mut mesh: IndexedMesh) -> IndexedMesh {
    let is_coded = |semantic| matches!(semantic, Semantic::Normal | Semantic::TexCoord | Semantic::Color);
    mesh.attributes.retain(|attribute| attribute.set == 0 && is_coded(attribute.semantic));
    mesh
}

/// What the others made of a model.
struct Peer {
    triangles: u64,
    draco: u64,
    draco_attributes: u64,
    gltfpack: u64,
}

impl Peer {
    /// The row of this name, by the heads of the columns above it.
    fn of(name: &str, markdown: &str) -> Option<Self> {
        let cells = |line: &str| -> Vec<String> {
            line.trim().trim_matches('|').split('|').map(|cell| cell.trim().to_owned()).collect()
        };
        let heads = markdown.lines().map(cells).find(|cells| cells.iter().any(|cell| cell == "Draco all"))?;
        let row = markdown.lines().map(cells).find(|cells| cells.len() == heads.len() && cells[0] == name)?;
        let number =
            |head: &str| -> Option<u64> { row[heads.iter().position(|other| other == head)?].parse().ok() };
        let draco_attributes = ["UV", "N", "C"].into_iter().filter_map(number).sum();
        let (triangles, draco, gltfpack) = (number("F")?, number("Draco all")?, number("+brotli 11")?);
        Some(Self { triangles, draco, draco_attributes, gltfpack })
    }
}

fn row(name: &str, mesh: &IndexedMesh, peer: Option<&Peer>) -> anyhow::Result<Vec<Cell>> {
    let mut file = Vec::new();
    let report = Encoder::new(Options::default()).encode(mesh, &mut file)?;
    let attributes = (report.attribute_bits / 8.0).round() as u64;
    let titles: Vec<String> = mesh.attributes.iter().map(Attribute::title).collect();
    let count = |of: fn(&Peer) -> u64| peer.map_or(Cell::None, |peer| Cell::Count(of(peer)));
    let ratio = |bytes: u64, of: fn(&Peer) -> u64| {
        Cell::number(peer.map(|peer| bytes as f64 / of(peer) as f64).filter(|ratio| ratio.is_finite()), 3)
    };
    Ok(vec![
        Cell::text(name),
        Cell::Count(mesh.triangles.len() as u64),
        Cell::text(titles.join(", ")),
        Cell::Count(report.bytes),
        Cell::Count(attributes),
        count(|peer| peer.draco),
        count(|peer| peer.draco_attributes),
        count(|peer| peer.gltfpack),
        ratio(report.bytes, |peer| peer.draco),
        ratio(attributes, |peer| peer.draco_attributes),
        ratio(report.bytes, |peer| peer.gltfpack),
    ])
}

const NOTES: [&str; 1] = [
    "Positions of 14 bits, normals of 10, the first texture coordinates of 12, colours as stored; all else is left out. Whole files, progressive, and what of \
     them attributes take. Draco: draco3d 1.5.9, Edgebreaker, best compression, each primitive on its own, its attributes the bytes that it takes more with \
     them than without. gltfpack 1.3.0 -cc, whole file, through brotli 11. The peers' bytes are read from a file (`--peers`); - where it does not tell \
     them of as many triangles.",
];

const COLUMNS: [&str; 11] = [
    "model",
    "triangles",
    "attributes",
    "bytes",
    "of attributes",
    "Draco",
    "Draco's attributes",
    "gltfpack and brotli",
    "bytes/Draco",
    "attributes/Draco",
    "bytes/gltfpack",
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_peers_took_is_read_by_its_heads() {
        let text = "Words | and | bars\n\n| mesh | F | Draco all | P | UV | N | C | +brotli 11 |\n| --- | --- | --- | --- | --- | --- | --- | --- |\n\
                    | a | 12 | 900 | 500 | 300 | 90 |  | 1800 |\n| scene | 7 | 900 | 500 |  |  |  | 9 (F 3) |\n";
        let peer = Peer::of("a", text).unwrap();
        assert_eq!((peer.triangles, peer.draco, peer.draco_attributes, peer.gltfpack), (12, 900, 390, 1800));
        // Not of that name, and one that has lost triangles.
        assert!(Peer::of("b", text).is_none() && Peer::of("scene", text).is_none());
        assert!(Peer::of("a", "").is_none());
    }
}
