//! Numbers for people.

/// With commas between the thousands.
pub fn grouped(n: impl TryInto<u64>) -> String {
    let digits = n.try_into().map_or_else(|_| "?".to_owned(), |n: u64| n.to_string());
    let mut out = String::new();
    for (k, digit) in digits.chars().enumerate() {
        if k > 0 && (digits.len() - k).is_multiple_of(3) {
            out.push(',');
        }
        out.push(digit);
    }
    out
}

/// `"1 edge"`, `"2 edges"`, `"1,000 vertices"`.
pub fn count(n: impl TryInto<u64>, noun: &str) -> String {
    let n = n.try_into().unwrap_or(u64::MAX);
    match noun.strip_suffix("ex") {
        _ if n == 1 => format!("1 {noun}"),
        Some(stem) => format!("{} {stem}ices", grouped(n)),
        None if noun.ends_with("sh") => format!("{} {noun}es", grouped(n)),
        None => format!("{} {noun}s", grouped(n)),
    }
}

/// To `digits` significant digits.
pub fn significant(x: f64, digits: i32) -> String {
    if x == 0.0 || !x.is_finite() {
        return x.to_string();
    }
    let magnitude = x.abs().log10().floor() as i32;
    if !(-5..9).contains(&magnitude) {
        return format!("{x:.*e}", (digits - 1).max(0) as usize);
    }
    format!("{x:.*}", (digits - 1 - magnitude).max(0) as usize)
}

/// Bytes of memory, in a suitable unit.
pub fn memory(bytes: u64) -> String {
    let (unit, size) = [("GB", 1e9), ("MB", 1e6), ("kB", 1e3)]
        .into_iter()
        .find(|&(_, size)| bytes as f64 >= size)
        .unwrap_or(("bytes", 1.0));
    format!("{} {unit}", significant(bytes as f64 / size, 3))
}

/// A length `x`, and what it is of the whole: `"0.0123 (0.45 % of the diagonal)"`.
pub fn of_diagonal(x: f64, diagonal: f64) -> String {
    let length = significant(x, 3);
    match percent(x, diagonal) {
        Some(percent) => format!("{length} ({} % of the diagonal)", significant(percent, 3)),
        None => length,
    }
}

/// `x` in percent of the diagonal; `None` where that has no meaning.
pub fn percent(x: f64, diagonal: f64) -> Option<f64> {
    let percent = x / diagonal * 100.0;
    percent.is_finite().then_some(percent)
}

/// Lines of cells as columns flush right, two spaces apart and before the first.
pub fn table(lines: &[Vec<String>]) -> String {
    columns(lines, &[])
}

/// Lines of cells as columns, two spaces apart and before the first; those of the numbers `left` flush left, the others
/// flush right.
pub fn columns(lines: &[Vec<String>], left: &[usize]) -> String {
    let columns = lines.iter().map(Vec::len).max().unwrap_or(0);
    let width = |k: usize| lines.iter().filter_map(|l| l.get(k)).map(|cell| cell.chars().count()).max();
    let widths: Vec<usize> = (0..columns).map(|k| width(k).unwrap_or(0)).collect();
    let line = |cells: &Vec<String>| {
        let cells = cells.iter().zip(&widths).enumerate().map(|(k, (cell, &width))| match cell {
            // Nothing stands behind the last one.
            cell if left.contains(&k) && k + 1 == columns => format!("  {cell}"),
            cell if left.contains(&k) => format!("  {cell:<width$}"),
            cell => format!("  {cell:>width$}"),
        });
        cells.collect::<String>() + "\n"
    };
    lines.iter().map(line).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn for_people() {
        assert_eq!([0u64, 999, 1000, 1_234_567].map(grouped), ["0", "999", "1,000", "1,234,567"]);
        assert_eq!(count(1u32, "vertex"), "1 vertex");
        assert_eq!(count(2000u32, "vertex"), "2,000 vertices");
        assert_eq!(count(0u32, "edge"), "0 edges");
        let texts = [0.0, 0.012345, 12.345, 12345.0, 1e-7].map(|x| significant(x, 3));
        assert_eq!(texts, ["0", "0.0123", "12.3", "12345", "1.00e-7"]);
        assert_eq!([12, 1_230_000, 45_600_000_000].map(memory), ["12.0 bytes", "1.23 MB", "45.6 GB"]);
        assert_eq!(of_diagonal(0.5, 2.0), "0.500 (25.0 % of the diagonal)");
        assert_eq!(of_diagonal(0.0, 0.0), "0");
    }

    #[test]
    fn columns_flush_left_and_right() {
        let lines = [["a", "1", "x"], ["bcd", "234", "yz"]].map(|line| line.map(str::to_owned).to_vec());
        assert_eq!(columns(&lines, &[0, 2]), "  a      1  x\n  bcd  234  yz\n");
        assert_eq!(table(&lines), "    a    1   x\n  bcd  234  yz\n");
    }
}
