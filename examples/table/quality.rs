//! How far the levels lie from the original, beside `meshopt_simplify` with as many triangles.

use super::cases::Case;
use super::measure::geometric_mean;
use super::peers::meshopt_simplify;
use super::tables::{Cell, Table};
use anyhow::Context;
use unweld::container::{Level, parse_contents};
use unweld::decoder::{Decoder, Options, Until};
use unweld::mesh::distance::surface_distance;
use unweld::mesh::{IndexedMesh, Lattice};

/// Shares of the triangles at which levels are compared, in percent.
pub const SHARES: [u32; 4] = [50, 25, 10, 5];
/// Points on the original that are measured.
pub const SAMPLES: usize = 100_000;
/// Seed of the points.
pub const SEED: u64 = 1;

/// A level and its peer.
#[derive(Clone, Copy, Debug)]
pub struct Quality {
    /// The level's number.
    pub level: u32,
    /// Its triangles.
    pub triangles: u32,
    /// Mean distance of the original's surface from the level's, in the units of the mesh.
    pub mean: f64,
    /// The same for the peer, where it gets down to as many triangles.
    pub peer: Option<f64>,
    /// The same for the peer with its vertices rounded to the lattice.
    pub rounded_peer: Option<f64>,
}

impl Quality {
    /// Mean error over that of the peer.
    pub fn ratio(&self) -> Option<f64> {
        self.peer.map(|peer| self.mean / peer)
    }

    /// Mean error over that of the peer on the same lattice.
    pub fn rounded_ratio(&self) -> Option<f64> {
        self.rounded_peer.map(|peer| self.mean / peer)
    }
}

/// Measures, for each share, the level of a file whose number of triangles is nearest to it.
///
/// # Errors
/// Those of the decoder.
pub fn measure(case: &Case, file: &[u8]) -> anyhow::Result<Vec<Quality>> {
    let contents = parse_contents(file)?.context("a file has a table of contents")?;
    let levels = &contents.levels;
    let of_share = |share: u32| {
        let level = nearest(levels, case.mesh.triangles.len() as f64 * f64::from(share) / 100.0);
        let triangles = levels[level].triangles;
        let decoded = decode_level(file, level as u32)?;
        let mean = mean_distance(case, &decoded).context("a level has triangles")?;
        // Level 0 is not simplified; what is flat leaves errors of rounding alone.
        let simplified = (level > 0).then(|| meshopt_simplify(&case.mesh, triangles as usize)).flatten();
        let negligible = case.diagonal() * 1e-9;
        let rounded = simplified.as_ref().map(|peer| rounded(peer, &contents.header.lattice));
        let error =
            |peer: Option<IndexedMesh>| mean_distance(case, &peer?).filter(|&error| error > negligible);
        let (peer, rounded_peer) = (error(simplified), error(rounded));
        Ok(Quality { level: level as u32, triangles, mean, peer, rounded_peer })
    };
    SHARES.into_iter().map(of_share).collect()
}

/// Mean distance of a case's surface from another.
pub fn mean_distance(case: &Case, to: &IndexedMesh) -> Option<f64> {
    surface_distance(&case.mesh, to, SAMPLES, SEED).map(|distance| distance.mean)
}

/// One row a mesh and share.
pub fn table(title: &str, of_cases: &[(&Case, Vec<Quality>)]) -> Table {
    let mut table = Table::new(title, &[&note()], &COLUMNS);
    for (case, qualities) in of_cases {
        let percent = 100.0 / case.diagonal();
        for (share, quality) in SHARES.iter().zip(qualities) {
            table.rows.push(vec![
                Cell::text(&case.name),
                Cell::Count(u64::from(*share)),
                Cell::Count(u64::from(quality.level)),
                Cell::Count(u64::from(quality.triangles)),
                Cell::Number(quality.mean * percent, 4),
                Cell::number(quality.peer.map(|peer| peer * percent), 4),
                Cell::number(quality.ratio(), 2),
                Cell::number(quality.rounded_peer.map(|peer| peer * percent), 4),
                Cell::number(quality.rounded_ratio(), 2),
            ]);
        }
    }
    let all = || of_cases.iter().flat_map(|(_, qualities)| SHARES.into_iter().zip(qualities));
    for share in SHARES.map(Some).into_iter().chain([None]) {
        let of_share =
            || all().filter(|(of, _)| share.is_none_or(|share| share == *of)).map(|(_, quality)| quality);
        let mut row = vec![Cell::None; COLUMNS.len()];
        row[0] = Cell::text("geometric mean");
        row[1] = share.map_or(Cell::text("all"), |share| Cell::Count(u64::from(share)));
        row[6] = Cell::number(geometric_mean(of_share().filter_map(Quality::ratio)), 2);
        row[8] = Cell::number(geometric_mean(of_share().filter_map(Quality::rounded_ratio)), 2);
        table.foot.push(row);
    }
    table
}

fn note() -> String {
    format!(
        "The level whose number of triangles is nearest to the share (by ratio), as decoded, on the lattice; errors in % of the \
         diagonal of the bounding box: mean distance of the original's surface from the simplified one, {SAMPLES} points, seed \
         {SEED}. Peer: `meshopt_simplify` of the original in full precision to as many triangles, no limit of error, no flags; - \
         where it stops before, or where the level is the original. The last two columns have its result with the vertices rounded to the same lattice, as our levels are.",
    )
}

/// A mesh with its vertices on a lattice.
fn rounded(mesh: &IndexedMesh, lattice: &Lattice) -> IndexedMesh {
    let positions = mesh.positions.iter().map(|&p| lattice.position(lattice.quantise(p))).collect();
    IndexedMesh::new(positions, mesh.triangles.clone())
}

/// The number of the level whose triangles are nearest by ratio.
fn nearest(levels: &[Level], triangles: f64) -> usize {
    let apart = |level: &Level| (f64::from(level.triangles.max(1)) / triangles).ln().abs();
    (0..levels.len()).min_by(|&a, &b| apart(&levels[a]).total_cmp(&apart(&levels[b]))).unwrap_or(0)
}

fn decode_level(file: &[u8], level: u32) -> anyhow::Result<IndexedMesh> {
    let until = Until { level, ..Until::default() };
    let mut decoder = Decoder::new(Options { until, ..Options::default() });
    decoder.push(file);
    while decoder.poll()?.is_some() {}
    anyhow::ensure!(decoder.level() == Some(level), "level {level} is not reached");
    Ok(decoder.assembled()?)
}

const COLUMNS: [&str; 9] = [
    "mesh",
    "share %",
    "level",
    "triangles",
    "mean error %",
    "meshopt %",
    "error/meshopt",
    "meshopt on lattice %",
    "error/that",
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nearest_goes_by_ratio() {
        let levels = [1000, 500, 100].map(|triangles| Level { triangles, ..Level::default() });
        assert_eq!(
            [2000.0, 720.0, 700.0, 230.0, 220.0, 1.0].map(|t| nearest(&levels, t)),
            [0, 0, 1, 1, 2, 2]
        );
    }
}
