//! The figures that matter, in one table on top: taken from the tables below it.

use super::tables::{Cell, Table};

/// A row for each figure whose table was measured.
pub fn table(tables: &[Table]) -> Table {
    let mut summary =
        Table::new("Summary", &[NOTE], &["what", "meshes", "geometric mean", "smallest", "largest"]);
    for (what, title, column, decimals) in FIGURES {
        let Some(table) = tables.iter().find(|table| table.title == title) else { continue };
        let Some(values) = values(table, column).filter(|values| !values.is_empty()) else { continue };
        let mean = super::measure::geometric_mean(values.iter().copied());
        let bound = |pick: fn(f64, f64) -> f64| values.iter().copied().reduce(pick);
        summary.rows.push(vec![
            Cell::text(what),
            Cell::Count(values.len() as u64),
            Cell::number(mean, decimals),
            Cell::number(bound(f64::min), decimals),
            Cell::number(bound(f64::max), decimals),
        ]);
    }
    summary
}

/// The numbers of a column, a mesh each; `None` where there is no such column.
fn values(table: &Table, column: &str) -> Option<Vec<f64>> {
    let k = table.columns.iter().position(|head| head == column)?;
    let meshes =
        table.rows.iter().filter(|row| !matches!(&row[0], Cell::Text(name) if name == "geometric mean"));
    let numbers = meshes.filter_map(|row| match row[k] {
        Cell::Number(x, _) => Some(x),
        _ => None,
    });
    Some(numbers.collect())
}

/// What, the table it stands in, its column, decimals.
const FIGURES: [(&str, &str, &str, usize); 17] = [
    ("bytes over Draco's, 12 bits", "Whole files", "bytes/Draco", 2),
    ("bytes over Draco's, dragon, 14 bits", "The dragon", "bytes/Draco", 2),
    ("bytes over Draco's, structured meshes, 12 bits", "Structured meshes", "bytes/Draco", 2),
    ("bytes over the best progressive coder's", "Progressive coders", "bytes/best", 2),
    (
        "exact and in order, over the best of xz and zstd",
        "Exact coordinates, and the order of the input",
        "in order/best",
        2,
    ),
    ("error over meshopt_simplify's at 50 % of the triangles", "Whole files", "error 50 %", 2),
    ("error at 25 %", "Whole files", "25 %", 2),
    ("error at 10 %", "Whole files", "10 %", 2),
    ("error at 5 %", "Whole files", "5 %", 2),
    ("encoding time over Draco's", "Whole files", "encode/Draco", 1),
    ("encoding time over Draco's, dragon", "The dragon", "encode/Draco", 1),
    ("decoding time over Draco's", "Whole files", "decode/Draco", 1),
    ("decoding time over Draco's, dragon", "The dragon", "decode/Draco", 1),
    ("bytes of memory a vertex, encoding", "Whole files", "encode B/vertex", 0),
    ("bytes of memory a vertex, encoding, dragon", "The dragon", "encode B/vertex", 0),
    ("bytes of memory a vertex, decoding", "Whole files", "decode B/vertex", 0),
    ("bytes of memory a vertex, decoding, dragon", "The dragon", "decode B/vertex", 0),
];

const NOTE: &str = "One default setting for all. Below 1 is better than the peer, above 1 worse. Positions and connectivity alone.";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_and_bounds_leave_the_last_row_out() {
        let mut table = Table::new("Whole files", &[], &["mesh", "bytes/Draco"]);
        for (name, ratio) in [("a", 0.5), ("b", 2.0), ("geometric mean", 9.0)] {
            table.rows.push(vec![Cell::text(name), Cell::Number(ratio, 3)]);
        }
        let summary = super::table(&[table]);
        assert_eq!(summary.rows.len(), 1);
        let shown = summary.markdown();
        assert!(shown.contains("| bytes over Draco's, 12 bits | 2 | 1.00 | 0.50 | 2.00 |"), "{shown}");
    }
}
