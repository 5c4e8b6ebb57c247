//! What of an OBJ file is not kept.

use super::obj::Statements;

/// What is not kept.
#[derive(Default)]
pub(super) struct Dropped<'a> {
    pub weights: bool,
    pub columns: bool,
    /// How often each row of [`NOT_KEPT`] occurred.
    counts: [usize; NOT_KEPT.len()],
    unknown: usize,
    /// The first unknown keyword and its line.
    pub first_unknown: Option<(u64, &'a [u8])>,
}

impl<'a> Dropped<'a> {
    /// Takes note of a statement whose keyword has been read.
    pub(super) fn note(&mut self, keyword: &'a [u8], statements: &Statements<'a>) {
        let Some(row) = NOT_KEPT.iter().position(|(.., keywords)| keywords.contains(&keyword)) else {
            self.unknown += 1;
            self.first_unknown.get_or_insert((statements.line, keyword));
            return;
        };
        self.counts[row] += 1;
    }

    pub(super) fn in_words(&self) -> Vec<String> {
        let mut words = Vec::new();
        let columns = [(self.weights, "vertex weights"), (self.columns, "further numbers of vertices")];
        words.extend(columns.iter().filter(|(there, _)| *there).map(|(_, what)| what.to_string()));
        for (&count, (what, counted, _)) in self.counts.iter().zip(&NOT_KEPT).filter(|(count, _)| **count > 0)
        {
            words.push(if *counted { format!("{what} ({count})") } else { what.to_string() });
        }
        if self.unknown > 0 {
            words.push(format!("unknown statements ({})", self.unknown));
        }
        words
    }
}

/// Statements that are not kept: what they are, whether it is said how many, their keywords.
const NOT_KEPT: [(&str, bool, &[&[u8]]); 4] = [
    ("line elements", true, &[b"l"]),
    ("point elements", true, &[b"p"]),
    ("free-form geometry", false, FREE_FORM),
    ("display settings", false, DISPLAY),
];
const FREE_FORM: &[&[u8]] = &[
    b"vp", b"cstype", b"deg", b"bmat", b"step", b"curv", b"curv2", b"surf", b"parm", b"trim", b"hole",
    b"scrv", b"sp", b"end", b"con",
];
const DISPLAY: &[&[u8]] = &[
    b"bevel",
    b"c_interp",
    b"d_interp",
    b"lod",
    b"maplib",
    b"usemap",
    b"shadow_obj",
    b"trace_obj",
    b"ctech",
    b"stech",
    b"mg",
];
