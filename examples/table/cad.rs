//! Levels of parts as CAD programs tessellate them.

use super::cases::{Case, default_file};
use super::made::parts;
use super::measure::geometric_mean;
use super::peers::Draco;
use super::quality::{self, Quality, SHARES};
use super::tables::{Cell, Table};
use unweld::encoder::Encoder;

/// One row a part.
///
/// # Errors
/// Those of reading and of the coders.
pub fn table(bits: u32) -> anyhow::Result<Table> {
    let mut table = Table::new("CAD parts", &[NOTE], &COLUMNS);
    let read = FILES.iter().map(|name| Case::read(&default_file(name)?, bits));
    let made = [("blade (generated)", parts::blade(90, 70)), ("coupling (generated)", parts::coupling())];
    let made = made.into_iter().map(|(name, mesh)| Case::of(name.to_owned(), mesh, bits));
    for case in read.chain(made) {
        let case = case?;
        eprintln!("CAD parts: {}, {} triangles, {bits} bits", case.name, case.mesh.triangles.len());
        let file = Encoder::new(case.options()).encode_to_vec(&case.mesh)?;
        let draco = Draco::new(&case.mesh, bits)?;
        let ratio = file.len() as f64 / draco.encode(draco.encoder())?.len() as f64;
        let qualities = quality::measure(&case, &file)?;
        let mut row = vec![
            Cell::text(&case.name),
            Cell::Count(u64::from(bits)),
            Cell::Count(case.mesh.triangles.len() as u64),
            Cell::Count(file.len() as u64),
            Cell::Number(ratio, 3),
        ];
        row.extend((0..SHARES.len()).map(|k| Cell::number(qualities[k].rounded_ratio(), 2)));
        row.push(Cell::number(geometric_mean(qualities.iter().filter_map(Quality::rounded_ratio)), 2));
        table.rows.push(row);
    }
    Ok(table)
}

const FILES: [&str; 5] = [
    "cad_anchor.off.gz",
    "cad_casting.off.gz",
    "cad_fandisk.obj.gz",
    "cad_wingnut.obj.gz",
    "cad_tray.stl.gz",
];

const COLUMNS: [&str; 10] = [
    "mesh",
    "bits",
    "triangles",
    "bytes",
    "bytes/Draco",
    "error 50 %",
    "25 %",
    "10 %",
    "5 %",
    "error/meshopt",
];

const NOTE: &str = "Error: the level's mean error over that of `meshopt_simplify` of as many triangles, its vertices rounded to the same lattice, at about 50, 25, 10 and 5 % of the \
    triangles, and the geometric mean of the four. Generated: a twisted blade of rows, flat at its ends; a flange with eight bolt holes round a hub with a bore.";
