//! How far the meshes of prefixes lie from the original, beside an earlier version's prefixes of as many bytes.

use super::cases::{Case, default_file};
use super::prefixes;
use super::quality::{SAMPLES, SEED, mean_distance};
use super::tables::{Cell, Table};
use unweld::encoder::Encoder;

/// What an earlier version made of a mesh at 12 bits.
struct Earlier {
    file: &'static str,
    /// Bytes of the whole file.
    bytes: u32,
    /// Errors of prefixes of these shares of it, in % of the diagonal; `None` before the end of the base.
    errors: [Option<f64>; SHARES.len()],
}

/// One row a mesh and share.
///
/// # Errors
/// Those of reading and of the coders.
pub fn table() -> anyhow::Result<Table> {
    let columns = ["mesh", "share %", "bytes", "triangles", "error %", "earlier error %", "error/earlier"];
    let mut table = Table::new("Prefixes beside an earlier version's", &[&note()], &columns);
    for earlier in &EARLIER {
        let case = Case::read(&default_file(earlier.file)?, BITS)?;
        eprintln!("prefixes: {}", case.name);
        let file = Encoder::new(case.options()).encode_to_vec(&case.mesh)?;
        for (share, before) in SHARES.into_iter().zip(earlier.errors) {
            let bytes = (u64::from(earlier.bytes) * share / 100) as usize;
            let mesh = prefixes::decode(&file[..bytes.min(file.len())])?;
            let error = mesh.as_ref().and_then(|mesh| mean_distance(&case, mesh));
            let error = error.map(|error| error * 100.0 / case.diagonal());
            // No mesh where there was one is worse than any.
            let ratio = before.map(|before| error.map_or(f64::INFINITY, |error| error / before));
            table.rows.push(vec![
                Cell::text(&case.name),
                Cell::Count(share),
                Cell::Count(bytes as u64),
                mesh.map_or(Cell::None, |mesh| Cell::Count(mesh.triangles.len() as u64)),
                Cell::number(error, 5),
                Cell::number(before, 5),
                Cell::number(ratio, 2),
            ]);
        }
    }
    Ok(table)
}

fn note() -> String {
    format!(
        "12 bits a coordinate, default settings: the mesh of the first bytes of the file, as many as the share of the file that the version of commit \
         {VERSION} wrote, beside the mesh that this many bytes of that file gave. Errors: mean distance of the original's surface, in % of the diagonal of the \
         bounding box, {SAMPLES} points, seed {SEED}; - before the end of the base, inf where only the earlier file had a mesh by then.",
    )
}

const BITS: u32 = 12;

/// Shares of the earlier file, in percent.
const SHARES: [u64; 6] = [2, 5, 10, 20, 35, 50];

const VERSION: &str = "1389054";

/// Measured by the program of the version named.
const EARLIER: [Earlier; 8] = [
    Earlier {
        file: "scan_bunny.ply.gz",
        bytes: 68_960,
        errors: [None, Some(0.1485), Some(0.057814), Some(0.02761), Some(0.017125), Some(0.010593)],
    },
    Earlier {
        file: "organic_horse.ply.gz",
        bytes: 85_125,
        errors: [
            Some(0.22871),
            Some(0.086773),
            Some(0.033118),
            Some(0.015614),
            Some(0.0096992),
            Some(0.0061674),
        ],
    },
    Earlier {
        file: "bench/igea.ply.gz",
        bytes: 210_854,
        errors: [
            Some(0.096979),
            Some(0.034155),
            Some(0.0177),
            Some(0.0092805),
            Some(0.006349),
            Some(0.0044641),
        ],
    },
    Earlier {
        file: "genus1_rocker_arm.obj.gz",
        bytes: 25_281,
        errors: [None, Some(0.37763), Some(0.12556), Some(0.053353), Some(0.024532), Some(0.014424)],
    },
    Earlier {
        file: "cad_fandisk.obj.gz",
        bytes: 13_777,
        errors: [None, None, Some(0.094224), Some(0.021581), Some(0.0093341), Some(0.0059193)],
    },
    Earlier {
        file: "organic_cat.obj.gz",
        bytes: 17_803,
        errors: [None, None, Some(0.23929), Some(0.081322), Some(0.037546), Some(0.021264)],
    },
    Earlier {
        file: "genus12_boot.obj.gz",
        bytes: 53_720,
        errors: [None, Some(0.21637), Some(0.11876), Some(0.051701), Some(0.031939), Some(0.019042)],
    },
    Earlier {
        file: "bench/dragon_vrip.ply.gz",
        bytes: 674_979,
        errors: [
            Some(0.062176),
            Some(0.021311),
            Some(0.010752),
            Some(0.0059498),
            Some(0.0044053),
            Some(0.0038226),
        ],
    },
];
