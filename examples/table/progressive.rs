//! Sizes beside the progressive coders that can be had.

use super::cases::{Case, default_file};
use super::tables::{Cell, Table};
use unweld::encoder::Encoder;

/// What a progressive coder made of a mesh at 12 bits a coordinate.
struct Peer {
    file: &'static str,
    /// Bytes, wavelets of irregular subdivisions.
    wavemesh: u32,
    /// Bytes, valence-driven coding.
    valence: Option<u32>,
    /// Bits a vertex, Compressed Progressive Meshes.
    cpm: Option<f64>,
}

/// The table. Peers are known at 12 bits; other `bits` are not compared.
///
/// # Errors
/// Those of reading and encoding.
pub fn table(bits: Option<u32>) -> anyhow::Result<Table> {
    let columns = [
        "mesh",
        "vertices",
        "bytes",
        "bits/vertex",
        "Wavemesh bytes",
        "bytes/Wavemesh",
        "Valence bytes",
        "bytes/Valence",
        "bytes/best",
        "CPM bits/vertex",
    ];
    let mut table = Table::new("Progressive coders", &[NOTE], &columns);
    let bits = bits.unwrap_or(BITS);
    for peer in PEERS {
        let case = Case::read(&default_file(peer.file)?, bits)?;
        let report = Encoder::new(case.options()).encode(&case.mesh, &mut std::io::sink())?;
        let vertices = case.mesh.positions.len();
        let peers = [Some(peer.wavemesh), peer.valence].map(|bytes| bytes.filter(|_| bits == BITS));
        let best = peers.into_iter().flatten().min();
        let over = [peers[0], peers[1], best].map(|bytes| Some(report.bytes as f64 / f64::from(bytes?)));
        let bytes = |bytes: Option<u32>| bytes.map_or(Cell::None, |bytes| Cell::Count(u64::from(bytes)));
        table.rows.push(vec![
            Cell::text(&case.name),
            Cell::Count(vertices as u64),
            Cell::Count(report.bytes),
            Cell::Number(report.bytes as f64 * 8.0 / vertices as f64, 2),
            bytes(peers[0]),
            Cell::number(over[0], 3),
            bytes(peers[1]),
            Cell::number(over[1], 3),
            Cell::number(over[2], 3),
            Cell::number(peer.cpm.filter(|_| bits == BITS), 1),
        ]);
    }
    Ok(table)
}

const BITS: u32 = 12;

/// Measured once with MEPP2's and Wavemesh's command lines on the same meshes.
const PEERS: [Peer; 8] = [
    Peer { file: "scan_bunny.ply.gz", wavemesh: 70_930, valence: Some(81_899), cpm: Some(25.2) },
    Peer { file: "organic_horse.ply.gz", wavemesh: 93_395, valence: Some(101_710), cpm: Some(22.9) },
    Peer { file: "bench/igea.ply.gz", wavemesh: 241_280, valence: Some(264_520), cpm: None },
    Peer { file: "genus1_rocker_arm.obj.gz", wavemesh: 28_818, valence: Some(28_446), cpm: None },
    Peer { file: "cad_fandisk.obj.gz", wavemesh: 14_235, valence: Some(17_460), cpm: None },
    Peer { file: "organic_cat.obj.gz", wavemesh: 16_982, valence: None, cpm: None },
    Peer { file: "genus12_boot.obj.gz", wavemesh: 56_090, valence: None, cpm: None },
    Peer { file: "genus4_fertility.off.gz", wavemesh: 14_532, valence: None, cpm: None },
];

const NOTE: &str = "12 bits a coordinate, whole files, without residue. Wavemesh (Valette and Prost 2004; github.com/valette/Wavemesh), the smaller of \
    its two settings of geometry, bunny with its 5 holes closed, since it cannot read the open one. Valence: valence-driven connectivity coding (Alliez and \
    Desbrun 2001; Lee, Lavoué and Dupont 2012); CPM: Compressed Progressive Meshes (Pajarola and Rossignac 2000); both as implemented in MEPP2 \
    (github.com/MEPP-team/MEPP2). All of them were measured once on these meshes, not in this run. Best: the smaller of Wavemesh and Valence.";
