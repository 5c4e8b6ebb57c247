//! How much of a file is wanted: one set of words for plans, the decoder, the server, the command line and the page.

/// How far to come.
///
/// | here | command line | query of `/refine` (spec §12.4) | page |
/// |---|---|---|---|
/// | [`Level`](Want::Level) | `--level J` | `to=J` | `{ level }` |
/// | [`Triangles`](Want::Triangles) | `--triangles N` | `triangles=N` | `{ triangles }` |
/// | [`Error`](Want::Error) | `--error E`, `--error rms:E` | `max_error=E`, `rms_error=E` | `{ error, measure }` |
/// | [`Bytes`](Want::Bytes) | `--max-bytes B` | `max_bytes=B`, counted from where the answer begins | |
/// | [`All`](Want::All) | nothing | nothing | nothing |
///
/// [`plan`](super::plan()) makes whole atoms of it; `decoder::Until::of` is where a decoder stops for it, to the operation.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Want {
    /// All of this level; the base, where the file has none so coarse. Level 0 is the same as [`All`](Want::All).
    Level(u32),
    /// As much of the mesh as possible with at most so many triangles, without the residue, whose triangles the table of contents
    /// does not count; the base, if even that has more.
    Triangles(u32),
    /// The coarsest level with at most this error, in the units of the input; level 0, all of it, where none is so close.
    Error(Measure, f64),
    /// As many atoms as fit into so many bytes, header and table included; the base, if even that has more.
    Bytes(u64),
    /// Level 0 with residue, correction, order and metadata: all but the keyframes. See [`Contents::prefix`](super::Contents::prefix).
    #[default]
    All,
}

/// Which of a level's two errors is meant: see [`Level`](super::Level).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Measure {
    /// The largest distance: nothing lies farther off. What is meant where nothing is said.
    #[default]
    Max,
    /// The root mean square of the distances: a few places may lie farther off.
    Rms,
}
