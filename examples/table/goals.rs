//! What is to be reached, and the rows and the table that say how far it is.

use super::figures::{FIGURES, Figure};
use super::measure::geometric_mean;
use super::tables::{Cell, Table};

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

const NOTE: &str = "One default setting for all. Below 1 is better than the peer, above 1 worse. Positions and connectivity alone, but for models with attributes.";

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
