//! What Edgebreaker takes for the connectivity of level 0 as a keyframe.

use super::cases::Case;
use super::tables::{Cell, Table};
use anyhow::Context;
use unweld::encoder::{Encoder, Keyframes, Options};

/// One row a mesh.
///
/// # Errors
/// Those of the encoder.
pub fn table(cases: &[Case]) -> anyhow::Result<Table> {
    let columns = ["mesh", "triangles", "symbols", "loops", "handles", "sum", "positions bits/vertex"];
    let mut table = Table::new("Keyframe of level 0", &[NOTE], &columns);
    for case in cases {
        let options = Options { keyframes: Keyframes::Levels(vec![0]), ..case.options() };
        let report = Encoder::new(options).encode(&case.mesh, &mut std::io::sink())?;
        let keyframe = report
            .keyframes
            .iter()
            .find(|k| k.level == 0)
            .context("the keyframe that was asked for is there")?;
        let parts = [keyframe.connectivity, keyframe.loops, keyframe.handles];
        let per_triangle = |bits: f64| bits / f64::from(keyframe.triangles);
        let sum = per_triangle(parts.iter().sum());
        let mut row = vec![Cell::text(&case.name), Cell::Count(u64::from(keyframe.triangles))];
        row.extend(parts.map(|bits| Cell::Number(per_triangle(bits), 4)));
        row.push(Cell::Number(sum, 4));
        row.push(Cell::Number(keyframe.positions / case.mesh.positions.len() as f64, 2));
        table.rows.push(row);
    }
    Ok(table)
}

const NOTE: &str = "Bits a triangle: symbols of the Edgebreaker traversal, loops (triangles that close a boundary loop), handles.";
