//! Whether time and memory grow in proportion to the mesh.

use super::args::Args;
use super::cases::Case;
use super::generate;
use super::measure::{peak, seconds, unbounded};
use super::tables::{Cell, Table};
use unweld::decoder;
use unweld::encoder::Encoder;

/// What a mesh took.
#[derive(Debug)]
struct Cost {
    triangles: f64,
    bytes: f64,
    /// Seconds: encode, decode.
    seconds: [f64; 2],
    /// Bytes at the peak, above the input: encode, decode.
    peaks: [f64; 2],
}

impl Cost {
    /// Bits, microseconds twice, bytes twice, all of a triangle.
    fn per_triangle(&self) -> [f64; 5] {
        let ([encode, decode], [encoding, decoding]) = (self.seconds, self.peaks);
        [self.bytes * 8.0, encode * 1e6, decode * 1e6, encoding, decoding].map(|x| x / self.triangles)
    }
}

/// One row a size, of generated meshes or of those named; the last row is the largest over the smallest, per triangle.
///
/// # Errors
/// Those of the coders.
pub fn table(args: &Args) -> anyhow::Result<Table> {
    let bits = args.bits.unwrap_or(14);
    let note = if args.meshes.is_empty() { GENERATED } else { "" };
    let mut table = Table::new("Growing meshes", &[&format!("{note}{NOTE}")], &COLUMNS);
    let mut costs = Vec::new();
    // One mesh after the other, so that memory holds one of them.
    let sizes = if args.meshes.is_empty() { args.linear.as_slice() } else { &[] };
    let made = sizes.iter().map(|&millions| generated(millions, bits));
    let read = args.meshes.iter().map(|path| Case::read(path, bits));
    for case in made.chain(read) {
        let case = case?;
        eprintln!("{}: {} triangles", case.name, case.mesh.triangles.len());
        let cost = measure(&case)?;
        let [bits, encode, decode, encoding, decoding] = cost.per_triangle();
        table.rows.push(vec![
            Cell::text(&case.name),
            Cell::Count(cost.triangles as u64),
            Cell::Number(bits, 2),
            Cell::Number(cost.seconds[0], 2),
            Cell::Number(encode, 3),
            Cell::Number(cost.seconds[1], 2),
            Cell::Number(decode, 3),
            Cell::Number(encoding, 1),
            Cell::Number(decoding, 1),
        ]);
        costs.push(cost);
    }
    costs.sort_by(|a, b| a.triangles.total_cmp(&b.triangles));
    if let (Some(small), Some(large)) = (costs.first(), costs.last()) {
        let ratio = |k: usize| Cell::Number(large.per_triangle()[k] / small.per_triangle()[k], 3);
        table.foot.push(vec![
            Cell::text("largest : smallest"),
            Cell::Number(large.triangles / small.triangles, 2),
            ratio(0),
            Cell::None,
            ratio(1),
            Cell::None,
            ratio(2),
            ratio(3),
            ratio(4),
        ]);
    }
    Ok(table)
}

fn generated(millions: f64, bits: u32) -> anyhow::Result<Case> {
    // Twice as many cells along as around.
    let around = (millions * 1e6 / 4.0).sqrt().round().max(8.0) as u32;
    Case::of(format!("torus, {millions} M"), generate::torus(2 * around, around, 1), bits)
}

fn measure(case: &Case) -> anyhow::Result<Cost> {
    let (encoding, (encode, file)) =
        peak(|| seconds(|| Encoder::new(case.options()).encode_to_vec(&case.mesh)));
    let file = file?;
    let (decoding, (decode, decoded)) = peak(|| seconds(|| decoder::decode(&file, unbounded())));
    decoded?;
    Ok(Cost {
        triangles: case.mesh.triangles.len() as f64,
        bytes: file.len() as f64,
        seconds: [encode, decode],
        peaks: [encoding as f64, decoding as f64],
    })
}

const COLUMNS: [&str; 9] = [
    "mesh",
    "triangles",
    "bits/triangle",
    "encode s",
    "encode µs/triangle",
    "decode s",
    "decode µs/triangle",
    "encode B/triangle",
    "decode B/triangle",
];

const GENERATED: &str =
    "Generated: a rough torus, a third of its cells cut along the other diagonal, so that valences vary. ";
const NOTE: &str = "One run each, CPU time of \
    the one thread; peak memory above the input. In the last row, per triangle, 1 is linear.";
