//! What is to be reached, and the rows and the table that say how far it is.

use super::measure::geometric_mean;
use super::tables::{Cell, Table};

/// A figure: the column of a table, over its rows.
struct Figure {
    what: &'static str,
    /// Where it stands: title and head.
    table: &'static str,
    column: &'static str,
    decimals: usize,
    /// The only row that counts, by the start of its name, where not all do.
    row: &'static str,
    /// The geometric mean to be reached.
    mean: Option<f64>,
    /// What no row is to be above.
    most: Option<f64>,
}

/// The figures that matter, in one table on top.
pub fn summary(tables: &[Table]) -> Table {
    let columns =
        ["what", "meshes", "geometric mean", "to be reached", "smallest", "largest", "none to be above"];
    let mut summary = Table::new("Summary", &[NOTE], &columns);
    for figure in FIGURES {
        let Some(table) = tables.iter().find(|table| table.title == figure.table) else { continue };
        let values = figure.values(table);
        if values.is_empty() {
            continue;
        }
        let number = |value| Cell::number(value, figure.decimals);
        let [smallest, largest] = [f64::min, f64::max].map(|pick| values.iter().copied().reduce(pick));
        summary.rows.push(vec![
            Cell::text(figure.what),
            Cell::Count(values.len() as u64),
            number(geometric_mean(values.into_iter())),
            number(figure.mean),
            number(smallest),
            number(largest),
            number(figure.most),
        ]);
    }
    summary
}

/// Adds what a table's figures come to, and below it what they are to.
pub fn close(table: &mut Table) {
    let figures: Vec<&Figure> =
        FIGURES.iter().filter(|f| f.table == table.title && f.row.is_empty()).collect();
    let figures: Vec<(usize, &Figure)> =
        figures.iter().filter_map(|f| Some((table.column(f.column)?, *f))).collect();
    let row = |of: &dyn Fn(&Figure) -> Option<f64>| -> Vec<(usize, Cell)> {
        let cell = |(k, figure): &(usize, &Figure)| Some((*k, Cell::Number(of(figure)?, figure.decimals)));
        figures.iter().filter_map(cell).collect()
    };
    let mean = row(&|figure| geometric_mean(figure.values(table).into_iter()));
    let largest = row(&|figure| figure.values(table).into_iter().reduce(f64::max));
    let [mean_goal, largest_goal] = [row(&|figure| figure.mean), row(&|figure| figure.most)];
    for (what, cells) in [
        ("geometric mean", mean),
        ("to be reached", mean_goal),
        ("largest", largest),
        ("none to be above", largest_goal),
    ] {
        if !cells.is_empty() {
            table.close(what, cells);
        }
    }
}

impl Figure {
    /// The numbers of its column, those of its row alone where it has one.
    fn values(&self, table: &Table) -> Vec<f64> {
        let Some(k) = table.column(self.column) else { return Vec::new() };
        let counts = |row: &&Vec<Cell>| matches!(&row[0], Cell::Text(name) if name.starts_with(self.row));
        let number = |row: &Vec<Cell>| match row[k] {
            Cell::Number(x, _) => Some(x),
            Cell::Count(n) => Some(n as f64),
            _ => None,
        };
        table.rows.iter().filter(counts).filter_map(number).collect()
    }
}

/// A figure of all rows of a table.
const fn figure(
    what: &'static str,
    table: &'static str,
    column: &'static str,
    decimals: usize,
    mean: Option<f64>,
    most: Option<f64>,
) -> Figure {
    Figure { what, table, column, decimals, row: "", mean, most }
}

/// What and where; decimals, the mean to be reached, the largest allowed.
const FIGURES: [Figure; 31] = [
    figure("bytes over Draco's, 12 bits", "Sizes", "bytes/Draco", 2, Some(1.12), Some(1.30)),
    figure("bytes over Draco's, profile small", "Sizes", "small/Draco", 2, Some(1.05), None),
    figure(
        "bytes over Draco's, generated meshes",
        "Structured meshes",
        "bytes/Draco",
        2,
        Some(0.85),
        Some(1.25),
    ),
    figure("bytes over Draco's, small meshes, 14 bits", "Small meshes", "bytes/Draco", 2, Some(1.08), None),
    figure(
        "bytes over Draco's, meshes that nothing was chosen on",
        "Acceptance",
        "bytes/Draco",
        2,
        Some(1.25),
        Some(1.60),
    ),
    figure("bytes over Draco's, dragon, 14 bits", "The dragon", "bytes/Draco", 2, None, None),
    figure(
        "bytes over the best progressive coder's",
        "Progressive coders",
        "bytes/best",
        2,
        Some(0.85),
        None,
    ),
    Figure {
        row: "organic_cat",
        ..figure(
            "header, table and metadata of a mesh of 8,000 vertices, bytes",
            "Sizes",
            "frame",
            0,
            Some(350.0),
            None,
        )
    },
    figure("their share of the file in percent, 12 bits", "Sizes", "frame %", 1, None, Some(3.0)),
    figure("their share, generated meshes", "Structured meshes", "frame %", 1, None, Some(3.0)),
    figure("their share, small meshes", "Small meshes", "frame %", 1, None, Some(3.0)),
    figure("their share, meshes that nothing was chosen on", "Acceptance", "frame %", 1, None, Some(3.0)),
    figure("bits a triangle of a keyframe's connectivity", "Keyframe of level 0", "sum", 4, None, None),
    figure(
        "exact and in order, over the best of xz and zstd",
        "Exact coordinates, and the order of the input",
        "in order/best",
        2,
        None,
        None,
    ),
    figure(
        "error of prefixes of equal bytes, over an earlier version's",
        "Prefixes beside an earlier version's",
        "error/earlier",
        2,
        Some(0.75),
        Some(1.10),
    ),
    figure(
        "error of prefixes, over simplified meshes coded by Draco to as many bytes",
        "Prefixes beside single-rate files",
        "error/single",
        2,
        None,
        None,
    ),
    figure(
        "error over meshopt_simplify's, as many triangles",
        "Whole files",
        "error/meshopt",
        2,
        Some(1.0),
        None,
    ),
    figure("the same at 50 % of the triangles", "Whole files", "error 50 %", 2, None, None),
    figure("at 25 %", "Whole files", "25 %", 2, None, None),
    figure("at 10 %", "Whole files", "10 %", 2, None, None),
    figure("at 5 %", "Whole files", "5 %", 2, None, None),
    figure(
        "error over meshopt_simplify's on the lattice, CAD parts, 14 bits",
        "CAD parts",
        "error/meshopt",
        2,
        Some(1.4),
        None,
    ),
    Figure {
        row: "cad_fandisk",
        ..figure("the same, fandisk", "CAD parts", "error/meshopt", 2, Some(1.0), None)
    },
    figure("encoding time over Draco's", "Whole files", "encode/Draco", 2, None, Some(6.5)),
    figure("encoding time over Draco's, dragon", "The dragon", "encode/Draco", 2, None, Some(6.5)),
    figure("decoding time over Draco's", "Whole files", "decode/Draco", 2, None, Some(2.4)),
    figure("decoding time over Draco's, dragon", "The dragon", "decode/Draco", 2, None, Some(2.4)),
    figure("bytes of memory a vertex, encoding", "Whole files", "encode B/vertex", 0, Some(300.0), None),
    figure(
        "bytes of memory a vertex, encoding, dragon",
        "The dragon",
        "encode B/vertex",
        0,
        Some(300.0),
        None,
    ),
    figure("bytes of memory a vertex, decoding", "Whole files", "decode B/vertex", 0, Some(150.0), None),
    figure(
        "bytes of memory a vertex, decoding, dragon",
        "The dragon",
        "decode B/vertex",
        0,
        Some(150.0),
        None,
    ),
];

const NOTE: &str = "One default setting for all. Below 1 is better than the peer, above 1 worse. Positions and connectivity alone.";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_figure_is_summed_up_beside_its_goal() {
        let mut table = Table::new("Sizes", &[], &["mesh", "bytes/Draco"]);
        for (name, ratio) in [("a", 0.5), ("b", 2.0)] {
            table.rows.push(vec![Cell::text(name), Cell::Number(ratio, 3)]);
        }
        close(&mut table);
        let shown = table.markdown();
        for row in
            ["geometric mean | 1.00", "to be reached | 1.12", "largest | 2.00", "none to be above | 1.30"]
        {
            assert!(shown.contains(&format!("| {row} |")), "{shown}");
        }
        // The rows below the meshes are not counted.
        let shown = summary(&[table]).markdown();
        assert!(
            shown.contains("| bytes over Draco's, 12 bits | 2 | 1.00 | 1.12 | 0.50 | 2.00 | 1.30 |"),
            "{shown}"
        );
    }

    #[test]
    fn a_figure_of_one_row_counts_that_alone() {
        let mut table = Table::new("CAD parts", &[], &["mesh", "error/meshopt"]);
        for (name, ratio) in [("cad_fandisk.obj.gz", 0.5), ("b", 2.0)] {
            table.rows.push(vec![Cell::text(name), Cell::Number(ratio, 3)]);
        }
        let shown = summary(&[table]).markdown();
        assert!(shown.contains("fandisk | 1 | 0.50 | 1.00 |"), "{shown}");
    }
}
