//! Whole files beside Draco's: bytes, and what of them is no mesh.

use super::cases::Case;
use super::peers::Draco;
use super::tables::{Cell, Table};
use anyhow::Context;
use unweld::container::{AtomKind, parse_contents};
use unweld::encoder::{Encoder, Options, Profile};

/// One row a mesh; with the profile `small` beside the default where `small` says so.
///
/// # Errors
/// Those of the coders.
pub fn table(
    title: &str,
    note: &str,
    cases: impl Iterator<Item = anyhow::Result<Case>>,
    small: bool,
) -> anyhow::Result<Table> {
    let columns = if small { &COLUMNS[..] } else { &COLUMNS[..OF_DEFAULT] };
    let mut table = Table::new(title, &[note, NOTE], columns);
    if small {
        table.notes.push(SMALL_NOTE.to_owned());
    }
    // One mesh after the other, so that memory holds one of them.
    for case in cases {
        let case = case?;
        eprintln!("{title}: {}, {} triangles, {} bits", case.name, case.mesh.triangles.len(), case.bits);
        let vertices = case.mesh.positions.len() as f64;
        let peer = Draco::new(&case.mesh, case.bits)?;
        let draco = peer.encode(peer.encoder())?.len() as f64;
        let size = size(&case, &case.options())?;
        let mut row = vec![
            Cell::text(&case.name),
            Cell::Count(u64::from(case.bits)),
            Cell::Count(vertices as u64),
            Cell::Count(case.mesh.triangles.len() as u64),
            Cell::Count(size.bytes as u64),
            Cell::Number(size.bytes * 8.0 / vertices, 2),
            Cell::Count(draco as u64),
            Cell::Number(size.bytes / draco, 3),
            Cell::Count(size.frame),
            Cell::Number(size.frame as f64 / size.bytes * 100.0, 2),
        ];
        if small {
            let options = Options { position_bits: case.bits, ..Options::profile(Profile::Small) };
            let bytes = self::size(&case, &options)?.bytes;
            row.extend([Cell::Count(bytes as u64), Cell::Number(bytes / draco, 3)]);
        }
        table.rows.push(row);
    }
    Ok(table)
}

struct Size {
    /// Bytes without the residue.
    bytes: f64,
    /// Bytes of header, table of contents and metadata.
    frame: u64,
}

fn size(case: &Case, options: &Options) -> anyhow::Result<Size> {
    let mut file = Vec::new();
    let report = Encoder::new(options.clone()).encode(&case.mesh, &mut file)?;
    let contents = parse_contents(&file)?.context("a file has a table of contents")?;
    let payloads = contents.atoms.iter().filter(|atom| atom.kind != AtomKind::Metadata);
    let payloads: u64 = payloads.map(|atom| u64::from(atom.length)).sum();
    Ok(Size { bytes: file.len() as f64 - report.residue_bits / 8.0, frame: file.len() as u64 - payloads })
}

const COLUMNS: [&str; 12] = [
    "mesh",
    "bits",
    "vertices",
    "triangles",
    "bytes",
    "bits/vertex",
    "Draco bytes",
    "bytes/Draco",
    "frame",
    "frame %",
    "small",
    "small/Draco",
];
/// How many of the columns are about the default settings.
const OF_DEFAULT: usize = 10;

const NOTE: &str = "Bytes without residue; Draco: Edgebreaker, compression level 10, on the same lattice. Frame: the bytes of header, table of contents and metadata, and their share.";
const SMALL_NOTE: &str = "Small: the file of `--profile small`.";
