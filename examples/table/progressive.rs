//! Sizes beside the progressive coders that can be had.

use super::cases::{Case, default_file};
use super::measure::geometric_mean;
use super::tables::{Cell, Table};
use unweld::encoder::Encoder;

/// What a progressive coder made of a mesh at 12 bits a coordinate.
struct Peer {
    file: &'static str,
    /// Bytes, valence-driven coding.
    valence: u32,
    /// Bits a vertex, Compressed Progressive Meshes.
    cpm: Option<f64>,
}

/// The table. Peers are known at 12 bits; other `bits` are not compared.
///
/// # Errors
/// Those of reading and encoding.
pub fn table(bits: Option<u32>) -> anyhow::Result<Table> {
    let columns =
        ["mesh", "vertices", "bytes", "bits/vertex", "Valence bytes", "bytes/Valence", "CPM bits/vertex"];
    let mut table = Table::new("Progressive coders", &[NOTE], &columns);
    let bits = bits.unwrap_or(BITS);
    let mut ratios = Vec::new();
    for peer in PEERS {
        let case = Case::read(&default_file(peer.file)?, bits)?;
        let report = Encoder::new(case.options()).encode(&case.mesh, &mut std::io::sink())?;
        let valence = (bits == BITS).then_some(f64::from(peer.valence));
        let ratio = valence.map(|valence| report.bytes as f64 / valence);
        ratios.extend(ratio);
        let vertices = case.mesh.positions.len();
        table.rows.push(vec![
            Cell::text(&case.name),
            Cell::Count(vertices as u64),
            Cell::Count(report.bytes),
            Cell::Number(report.bytes as f64 * 8.0 / vertices as f64, 2),
            valence.map_or(Cell::None, |_| Cell::Count(u64::from(peer.valence))),
            Cell::number(ratio, 3),
            Cell::number(peer.cpm.filter(|_| bits == BITS), 1),
        ]);
    }
    let mut means = vec![Cell::None; columns.len()];
    means[0] = Cell::text("geometric mean");
    means[5] = Cell::number(geometric_mean(ratios.into_iter()), 3);
    table.rows.push(means);
    Ok(table)
}

const BITS: u32 = 12;

/// Measured once with MEPP2's command line on the same meshes.
const PEERS: [Peer; 5] = [
    Peer { file: "scan_bunny.ply.gz", valence: 81_899, cpm: Some(25.2) },
    Peer { file: "organic_horse.ply.gz", valence: 101_710, cpm: Some(22.9) },
    Peer { file: "bench/igea.ply.gz", valence: 264_520, cpm: None },
    Peer { file: "genus1_rocker_arm.obj.gz", valence: 28_446, cpm: None },
    Peer { file: "cad_fandisk.obj.gz", valence: 17_460, cpm: None },
];

const NOTE: &str = "12 bits a coordinate, whole files, without residue. Valence: valence-driven connectivity coding (Alliez and Desbrun 2001; Lee, Lavoué \
    and Dupont 2012); CPM: Compressed Progressive Meshes (Pajarola and Rossignac 2000); both as implemented in MEPP2 \
    (github.com/MEPP-team/MEPP2), measured once on these meshes, not in this run.";
