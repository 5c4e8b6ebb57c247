//! A table of results, and how it is written: for a terminal, as Markdown, as JSON.

use serde_json::{Map, Value, json};

/// What stands in a place of a table.
#[derive(Clone, Debug)]
pub enum Cell {
    /// Words.
    Text(String),
    /// A number of things.
    Count(u64),
    /// A number with so many decimals.
    Number(f64, usize),
    /// Nothing known.
    None,
}

/// One table.
#[derive(Clone, Debug)]
pub struct Table {
    /// What it tells.
    pub title: String,
    /// How to read it, a paragraph each.
    pub notes: Vec<String>,
    /// Heads of the columns, all different.
    pub columns: Vec<String>,
    /// One cell a column each.
    pub rows: Vec<Vec<Cell>>,
    /// Rows below the others, about all of them.
    pub foot: Vec<Vec<Cell>>,
}

impl Cell {
    /// Words.
    pub fn text(text: impl Into<String>) -> Self {
        Self::Text(text.into())
    }

    /// A number with so many decimals, where there is one.
    pub fn number(value: Option<f64>, decimals: usize) -> Self {
        value.map_or(Self::None, |x| Self::Number(x, decimals))
    }

    fn shown(&self) -> String {
        match self {
            Self::Text(text) => text.clone(),
            Self::Count(n) => grouped(*n),
            Self::Number(x, decimals) => format!("{x:.decimals$}"),
            Self::None => "-".to_owned(),
        }
    }

    fn json(&self) -> Value {
        match self {
            Self::Text(text) => json!(text),
            Self::Count(n) => json!(n),
            Self::Number(x, _) => json!(x),
            Self::None => Value::Null,
        }
    }
}

impl Table {
    /// An empty table.
    pub fn new(title: &str, notes: &[&str], columns: &[&str]) -> Self {
        let owned = |texts: &[&str]| texts.iter().map(|&text| text.to_owned()).collect();
        Self {
            title: title.to_owned(),
            notes: owned(notes),
            columns: owned(columns),
            rows: Vec::new(),
            foot: Vec::new(),
        }
    }

    /// Where the column of this head is.
    pub fn column(&self, head: &str) -> Option<usize> {
        self.columns.iter().position(|column| column == head)
    }

    /// A row below the others: `what` in its first cell, then what is given for columns.
    pub fn close(&mut self, what: &str, cells: impl IntoIterator<Item = (usize, Cell)>) {
        let mut row = vec![Cell::None; self.columns.len()];
        row[0] = Cell::text(what);
        for (column, cell) in cells {
            row[column] = cell;
        }
        self.foot.push(row);
    }

    /// For a terminal: columns aligned.
    pub fn plain(&self) -> String {
        let shown: Vec<Vec<String>> = self.shown();
        let width = |k: usize| shown.iter().map(|row| row[k].chars().count()).max().unwrap_or(0);
        let widths: Vec<usize> = (0..self.columns.len()).map(width).collect();
        let mut text = format!("{}\n\n", self.title);
        for row in &shown {
            let cells = row.iter().zip(&widths).enumerate().map(|(k, (cell, &width))| match k {
                0 => format!("{cell:<width$}"),
                _ => format!("{cell:>width$}"),
            });
            text += cells.collect::<Vec<_>>().join("  ").trim_end();
            text.push('\n');
        }
        for note in &self.notes {
            text += &format!("\n{note}\n");
        }
        text
    }

    /// As Markdown, with a heading.
    pub fn markdown(&self) -> String {
        let mut text = format!("## {}\n\n", self.title);
        for (k, row) in self.shown().iter().enumerate() {
            text += &format!("| {} |\n", row.join(" | "));
            if k == 0 {
                text += &format!("|---|{}\n", "---:|".repeat(self.columns.len().saturating_sub(1)));
            }
        }
        for note in &self.notes {
            text += &format!("\n{note}\n");
        }
        text
    }

    /// As JSON: rows are objects with the columns' heads as keys.
    pub fn json(&self) -> Value {
        let row = |row: &Vec<Cell>| -> Map<String, Value> {
            self.columns.iter().cloned().zip(row.iter().map(Cell::json)).collect()
        };
        json!({
            "title": self.title,
            "notes": self.notes,
            "rows": self.rows.iter().chain(&self.foot).map(row).collect::<Vec<_>>(),
        })
    }

    /// Heads and rows as they are shown.
    fn shown(&self) -> Vec<Vec<String>> {
        let rows = self.rows.iter().chain(&self.foot).map(|row| row.iter().map(Cell::shown).collect());
        std::iter::once(self.columns.clone()).chain(rows).collect()
    }
}

/// Digits in groups of three.
pub fn grouped(n: u64) -> String {
    let digits = n.to_string();
    let mut text = String::new();
    for (k, digit) in digits.chars().enumerate() {
        if k > 0 && (digits.len() - k).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_three_forms() {
        let mut table = Table::new("Sizes", &["In bytes."], &["mesh", "bytes"]);
        table.rows.push(vec![Cell::text("a"), Cell::Count(1_234_567)]);
        table.rows.push(vec![Cell::text("long"), Cell::None]);
        assert_eq!(
            table.plain(),
            "Sizes\n\nmesh      bytes\na     1,234,567\nlong          -\n\nIn bytes.\n"
        );
        let markdown =
            "## Sizes\n\n| mesh | bytes |\n|---|---:|\n| a | 1,234,567 |\n| long | - |\n\nIn bytes.\n";
        assert_eq!(table.markdown(), markdown);
        assert_eq!(table.json()["rows"][0], json!({"mesh": "a", "bytes": 1_234_567}));
        assert_eq!(table.json()["rows"][1]["bytes"], Value::Null);
    }
}
