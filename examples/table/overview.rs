//! The main table: sizes, errors, times and memory at the default settings, beside Draco and meshoptimizer.

use super::cases::Case;
use super::measure::{geometric_mean, median, peak, seconds, unbounded};
use super::peers::Draco;
use super::quality::{self, Quality};
use super::tables::{Cell, Table};
use anyhow::{Context, ensure};
use unweld::container::parse_contents;
use unweld::decoder;
use unweld::encoder::{Encoder, Options, Report};
use unweld::mesh::IndexedMesh;

/// Everything about one mesh and setting.
pub struct Measured {
    /// What the encoder tells of the arrays that all coders get.
    pub report: Report,
    /// Vertices of level 0, of the base; number of levels.
    counts: [u64; 3],
    /// The most that a level has triangles over the coarser one before it.
    growth: f64,
    /// Bytes without the residue.
    pub bytes: f64,
    /// Bytes of the file of the input, residue included.
    bytes_with_residue: u64,
    /// Bytes of Draco's file.
    pub draco_bytes: u64,
    /// Levels and their peers, one a share.
    pub qualities: Vec<Quality>,
    /// Seconds of unweld: encode, decode.
    pub seconds: [f64; 2],
    /// Seconds of Draco: encode, decode.
    pub draco_seconds: [f64; 2],
    /// Bytes at the peak of encoding and of decoding, above the input.
    peaks: [usize; 2],
}

/// Measures a mesh: coders in turn, `runs` times.
///
/// # Errors
/// Those of the coders.
pub fn measure(case: &Case, options: &Options, runs: usize) -> anyhow::Result<Measured> {
    let draco = Draco::new(&case.mesh, case.bits)?;
    let mut times: [Vec<f64>; 4] = Default::default();
    let [mut encode_peak, mut decode_peak] = [0; 2];
    let (mut draco_file, mut file, mut report) = (Vec::new(), Vec::new(), Report::default());
    for _ in 0..runs {
        let encoder = draco.encoder();
        let (time, encoded) = seconds(|| draco.encode(encoder));
        times[0].push(time);
        draco_file = encoded?;
        let (bytes, (time, encoded)) = peak(|| seconds(|| encode(&case.mesh, options)));
        times[1].push(time);
        encode_peak = bytes;
        (file, report) = encoded?;
        let (time, decoded) = seconds(|| Draco::decode(&draco_file));
        times[2].push(time);
        ensure!(decoded?.num_faces() == case.mesh.triangles.len(), "Draco loses triangles");
        let (bytes, (time, decoded)) = peak(|| seconds(|| decoder::decode(&file, unbounded())));
        times[3].push(time);
        decode_peak = bytes;
        decoded?;
    }
    let whole = if case.whole { file.len() } else { encode(&case.input, options)?.0.len() };
    let contents = parse_contents(&file)?.context("a file has a table of contents")?;
    let [draco_encode, encode, draco_decode, decode] = times.map(median);
    Ok(Measured {
        counts: [contents.header.vertices, contents.header.base_vertices, contents.levels.len() as u32]
            .map(u64::from),
        growth: contents
            .levels
            .windows(2)
            .map(|pair| f64::from(pair[0].triangles) / f64::from(pair[1].triangles))
            .fold(1.0, f64::max),
        bytes: file.len() as f64 - report.residue_bits / 8.0,
        bytes_with_residue: whole as u64,
        draco_bytes: draco_file.len() as u64,
        qualities: quality::measure(case, &file)?,
        seconds: [encode, decode],
        draco_seconds: [draco_encode, draco_decode],
        peaks: [encode_peak, decode_peak],
        report,
    })
}

impl Measured {
    /// Bytes without the residue over Draco's.
    pub fn size_ratio(&self) -> f64 {
        self.bytes / self.draco_bytes as f64
    }

    /// Time over Draco's: encode, decode.
    pub fn time_ratios(&self) -> [f64; 2] {
        [0, 1].map(|k| self.seconds[k] / self.draco_seconds[k])
    }

    /// Mean of the error ratios of all shares.
    pub fn error_ratio(&self) -> Option<f64> {
        geometric_mean(self.qualities.iter().filter_map(Quality::ratio))
    }
}

/// The table and the one of the levels' errors.
///
/// # Errors
/// As [`measure`].
pub fn tables(title: &str, cases: &[Case], runs: usize) -> anyhow::Result<Vec<Table>> {
    let mut table = Table::new(title, &NOTES, &COLUMNS);
    table.notes.push(format!(
        "Times are CPU time of the one thread, in process, medians of {runs}, the coders in turn: from arrays in memory to bytes in \
         memory, and from there to the mesh (unweld: `Decoder::mesh`). Peak memory is what is allocated above the input, result \
         included.",
    ));
    let mut all = Vec::new();
    for case in cases {
        eprintln!("{}: {} triangles, {} bits", case.name, case.mesh.triangles.len(), case.bits);
        let measured = measure(case, &case.options(), runs)?;
        table.rows.push(row(case, &measured));
        all.push((case, measured));
    }
    let qualities: Vec<_> = all.iter().map(|(case, m)| (*case, m.qualities.clone())).collect();
    Ok(vec![table, quality::table(&format!("{title}: errors of the levels"), &qualities)])
}

fn encode(mesh: &IndexedMesh, options: &Options) -> unweld::Result<(Vec<u8>, Report)> {
    let mut file = Vec::new();
    let report = Encoder::new(options.clone()).encode(mesh, &mut file)?;
    Ok((file, report))
}

fn row(case: &Case, measured: &Measured) -> Vec<Cell> {
    let report = &measured.report;
    let per_vertex = |bits: f64| Cell::Number(bits / measured.counts[0] as f64, 2);
    let rest = report.base_bits + report.other_bits;
    let [vertices, base, levels] = measured.counts.map(Cell::Count);
    let mut row = vec![
        Cell::text(&case.name),
        Cell::Count(u64::from(case.bits)),
        vertices,
        Cell::Count(case.mesh.triangles.len() as u64),
        levels,
        Cell::Number(measured.growth, 2),
        base,
        per_vertex(report.connectivity_bits),
        per_vertex(report.position_bits),
        per_vertex(rest),
        per_vertex(measured.bytes * 8.0),
        Cell::Count(measured.bytes as u64),
        Cell::Count(measured.bytes_with_residue),
        Cell::Count(measured.draco_bytes),
        Cell::Number(measured.size_ratio(), 3),
    ];
    row.extend(measured.qualities.iter().map(|quality| Cell::number(quality.ratio(), 2)));
    row.push(Cell::number(measured.error_ratio(), 2));
    for (time, ratio) in measured.seconds.into_iter().zip(measured.time_ratios()) {
        row.extend([Cell::Number(time, 3), Cell::Number(ratio, 2)]);
    }
    row.extend(measured.peaks.map(|bytes| Cell::Number(bytes as f64 / measured.counts[0] as f64, 0)));
    row
}

const COLUMNS: [&str; 26] = [
    "mesh",
    "bits",
    "vertices",
    "triangles",
    "levels",
    "growth",
    "base",
    "connectivity",
    "geometry",
    "rest",
    "bits/vertex",
    "bytes",
    "with residue",
    "Draco bytes",
    "bytes/Draco",
    "error 50 %",
    "25 %",
    "10 %",
    "5 %",
    "error/meshopt",
    "encode s",
    "encode/Draco",
    "decode s",
    "decode/Draco",
    "encode B/vertex",
    "decode B/vertex",
];
const NOTES: [&str; 2] = [
    "Default settings. Levels: the base is one of them; growth: the most that one has triangles over the coarser one before it. Base: its vertices. Connectivity, geometry (of the refinements) and rest (base, header, table of contents, \
     metadata) are bits a vertex of level 0 and add up to bits/vertex and to bytes, which leave the residue out (isolated vertices, degenerate \
     and repeated triangles, stitches, orientation flags); \"with residue\" is the whole file of the mesh as read. bytes/Draco is bytes (without residue) over Draco's \
     (draco-core, Edgebreaker, compression level 10): both code the same conditioned arrays on the same lattice.",
    "Error columns: mean surface error over `meshopt_simplify`'s at about 50, 25, 10 and 5 % of the triangles, see the table of the levels; error/meshopt is their geometric mean.",
];
