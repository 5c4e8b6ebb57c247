//! Files that tell which vertex of one mesh stands for each vertex of another: a line a vertex.

use anyhow::{Context, bail};
use std::io::{self, Write};
use unweld::reduce::NO_VERTEX;

/// Writes them.
///
/// # Errors
/// Those of the medium.
pub fn write(parents: &[u32], out: &mut dyn Write) -> io::Result<()> {
    let mut out = io::BufWriter::new(out);
    for &parent in parents {
        if parent == NO_VERTEX { writeln!(out, "-")? } else { writeln!(out, "{parent}")? }
    }
    out.flush()
}

/// Reads them.
///
/// # Errors
/// Where a line is neither a number nor `-`, with its number.
pub fn read(bytes: &[u8]) -> anyhow::Result<Vec<u32>> {
    let text = std::str::from_utf8(bytes).context("no text")?;
    let mut parents = Vec::new();
    for (number, line) in (1..).zip(text.lines()) {
        parents.push(match line.trim() {
            "-" => NO_VERTEX,
            line => match line.parse() {
                Ok(parent) if parent != NO_VERTEX => parent,
                _ => bail!("line {number}: neither the number of a vertex nor -"),
            },
        });
    }
    Ok(parents)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read() {
        let mut bytes = Vec::new();
        write(&[3, NO_VERTEX, 0], &mut bytes).unwrap();
        assert_eq!(bytes, b"3\n-\n0\n");
        assert_eq!(read(&bytes).unwrap(), [3, NO_VERTEX, 0]);
        for (bad, line) in [(&b"1\nx\n"[..], "line 2"), (b"4294967295", "line 1"), (b"-1", "line 1")] {
            assert!(read(bad).unwrap_err().to_string().starts_with(line));
        }
        assert!(read(&[0xFF]).is_err());
    }
}
