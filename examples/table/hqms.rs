//! Prefixes beside meshes simplified by HQMS, a simplifier that places vertices, coded by Draco: an estimate.

use super::cases::{Case, default_file};
use super::curves::{self, Point, percent};
use super::peers::meshopt_simplify_with_update;
use super::prefixes;
use super::tables::{Cell, Table};
use anyhow::Context;
use unweld::encoder::Encoder;

/// One row a mesh and number of triangles.
///
/// # Errors
/// Those of reading and of the coders.
pub fn table() -> anyhow::Result<Table> {
    let columns = [
        "mesh",
        "triangles",
        "HQMS error %",
        "bits",
        "bytes",
        "on lattice %",
        "our triangles",
        "error %",
        "error/HQMS",
    ];
    let mut table = Table::new("Prefixes beside HQMS coded by Draco", &[NOTE], &columns);
    for (name, points) in MEASURED {
        let case = Case::read(&default_file(name)?, BITS)?;
        eprintln!("HQMS: {}", case.name);
        let file = Encoder::new(case.options()).encode_to_vec(&case.mesh)?;
        for &(triangles, error) in points {
            let (bits, (bytes, peer)) = coded(&case, triangles, error)?;
            let mesh = prefixes::decode(&file[..file.len().min(bytes as usize)])?;
            let ours = mesh.as_ref().and_then(|mesh| percent(&case, mesh));
            table.rows.push(vec![
                Cell::text(&case.name),
                Cell::Count(triangles as u64),
                Cell::Number(error, 4),
                Cell::Count(u64::from(bits)),
                Cell::Count(bytes as u64),
                Cell::Number(peer, 4),
                mesh.map_or(Cell::None, |mesh| Cell::Count(mesh.triangles.len() as u64)),
                Cell::number(ours, 4),
                Cell::number(ours.map(|ours| ours / peer), 2),
            ]);
        }
    }
    Ok(table)
}

/// Bits, and with them bytes and error of a mesh of so many triangles with this error: bytes, and what the lattice adds to the error, are
/// those of `meshopt_simplifyWithUpdate`'s mesh of as many triangles. The bits for which bytes times error is least.
fn coded(case: &Case, triangles: usize, error: f64) -> anyhow::Result<(u32, Point)> {
    let mesh =
        meshopt_simplify_with_update(&case.mesh, triangles).context("it cannot be simplified so far")?;
    let exact = percent(case, &mesh).context("a mesh has a surface")?;
    let of_bits = |bits: u32| {
        let (bytes, on_lattice) = curves::coded(case, &mesh, bits)?;
        let added = (on_lattice * on_lattice - exact * exact).max(0.0);
        Ok((bits, (bytes, (error * error + added).sqrt())))
    };
    let all: anyhow::Result<Vec<(u32, Point)>> = (8..=BITS).map(of_bits).collect();
    let product = |(_, (bytes, error)): &(u32, Point)| bytes * error;
    all?.into_iter().min_by(|a, b| product(a).total_cmp(&product(b))).context("there are bits to choose")
}

const BITS: u32 = 12;

/// Files, and the mean errors of a prototype of HQMS (boundary planes, area weights, capped costs) at numbers of triangles, in % of the diagonal.
const MEASURED: [(&str, &[(usize, f64)]); 5] = [
    ("scan_bunny.ply.gz", &[(10_000, 0.0124), (1_000, 0.0847)]),
    ("organic_horse.ply.gz", &[(10_000, 0.0081), (1_000, 0.0673)]),
    ("bench/igea.ply.gz", &[(10_000, 0.0116), (1_000, 0.0750)]),
    ("bench/armadillo_86k.obj.gz", &[(10_000, 0.0210), (1_000, 0.129)]),
    ("cad_fandisk.obj.gz", &[(3_000, 0.0005), (1_000, 0.0032)]),
];

const NOTE: &str = "An estimate: errors of HQMS (Chen, Fahn, Tsai, Chen and Lin 2004, 2006; a prototype with boundary planes, area weights and capped costs) were measured once, not in this \
    run. Bytes, and what the lattice adds to the error, are those of `meshopt_simplifyWithUpdate`'s mesh of as many triangles, coded by Draco (Edgebreaker, \
    compression level 10) with those of 8 to 12 bits for which bytes times error is least. Ours: the prefix of as many bytes of the file of 12 bits, - before the end of its base.";
