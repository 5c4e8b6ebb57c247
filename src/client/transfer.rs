//! The table of contents first, then the atoms that a plan names, each checked (spec §3.7, §12.2).

use std::ops::Range;
use std::sync::Arc;

use bytes::Bytes;

use super::feed::Feed;
use super::source::RangeSource;
use crate::container::{Contents, Header, Parsed, Parser, Part, Plan, Want, kept, plan};
use crate::error::Result;

/// What [`Transfer::next`] brings.
#[derive(Clone, Debug, PartialEq)]
pub enum Piece {
    /// Header and table of contents: the first piece.
    Head {
        /// What they say.
        contents: Arc<Contents>,
        /// What will come.
        plan: Plan,
        /// Their bytes, from the first of the file on.
        bytes: Bytes,
    },
    /// An atom of the plan, in the plan's order. Its checksum holds.
    Atom {
        /// Its place in [`Contents::atoms`].
        index: usize,
        /// Its bytes.
        bytes: Bytes,
    },
}

/// Brings from a source what a plan needs, and no more than that.
///
/// It holds at most the table of contents or one atom besides what the source holds.
#[derive(Debug)]
pub struct Transfer<S, P> {
    feed: Feed<S>,
    stage: Stage<P>,
}

#[derive(Debug)]
enum Stage<P> {
    /// The planner, and how many bytes to ask for before the table of contents tells what is needed.
    Head(P, u64),
    Atoms {
        contents: Arc<Contents>,
        /// Atoms still to come, by parts: the bytes of one are asked for together.
        parts: Vec<Range<usize>>,
        /// Where the last of them ends.
        end: u64,
    },
    Done,
}

impl<S, P> Transfer<S, P>
where
    S: RangeSource,
    P: FnOnce(&Contents) -> Result<Plan> + Send,
{
    /// Brings what `planner` chooses once the table of contents is known. The first `first` bytes, often [`FIRST_BYTES`], are asked
    /// for at once; [`u64::MAX`] where all of the file is wanted anyway.
    pub fn new(source: S, first: u64, planner: P) -> Self {
        Self { feed: Feed::new(source), stage: Stage::Head(planner, first) }
    }

    /// Where the bytes come from.
    pub fn source(&self) -> &S {
        self.feed.source()
    }

    /// Leaves out those resources of which `skipped` says so by their numbers, but for atoms that have come. The rest of the part that they are in is
    /// asked for by further requests.
    pub fn skip(&mut self, skipped: impl Fn(usize) -> bool) {
        if let Stage::Atoms { contents, parts, .. } = &mut self.stage {
            let left = std::mem::take(parts);
            parts.extend(left.into_iter().flat_map(|atoms| kept(contents, atoms, &skipped)));
        }
    }

    /// The next piece; `None` behind the last.
    ///
    /// # Errors
    /// [`Error::Io`](crate::Error::Io) of the source; [`Error::Format`](crate::Error::Format) where the table of contents or an atom is damaged, where
    /// the source ends before the plan does, and, if the plan ends with the file, where it does not; those of the planner. After an
    /// error nothing more comes, nor after a call that was dropped before it ended.
    pub async fn next(&mut self) -> Result<Option<Piece>> {
        match std::mem::replace(&mut self.stage, Stage::Done) {
            Stage::Head(planner, first) => self.head(planner, first).await.map(Some),
            Stage::Atoms { contents, mut parts, end } => {
                let Some(part) = parts.first_mut() else {
                    // Where all of the file was wanted, it has nothing behind its last atom.
                    if end == contents.file_bytes() {
                        self.feed.check_end(end).await?;
                    }
                    return Ok(None);
                };
                let (index, last) = (part.start, part.end);
                part.start += 1;
                if part.start >= part.end {
                    parts.remove(0);
                }
                let bytes = self.atom(&contents, index, last).await?;
                self.stage = Stage::Atoms { contents, parts, end };
                Ok(Some(Piece::Atom { index, bytes }))
            }
            Stage::Done => Ok(None),
        }
    }

    async fn head(&mut self, planner: P, first: u64) -> Result<Piece> {
        let mut parser = Parser::new();
        let mut bytes = Vec::new();
        let mut missing = Header::SIZE;
        let contents = loop {
            let at = bytes.len() as u64;
            let piece = self.feed.take(at..first.max(at + missing as u64), missing).await?;
            if piece.is_empty() {
                parser.finish()?;
            }
            bytes.extend_from_slice(&piece);
            match parser.parse(&mut &piece[..])? {
                Parsed::NeedMore(more) => missing = more,
                Parsed::Contents(contents) => break contents,
                // There is no atom yet.
                _ => {}
            }
        };
        let plan = planner(&contents)?;
        let end = plan.parts.iter().map(|part| part.bytes.end).max().unwrap_or(0);
        self.feed.check_length(end)?;
        let parts = plan.parts.iter().map(|part| part.atoms.clone()).filter(|atoms| !atoms.is_empty());
        self.stage = Stage::Atoms { contents: contents.clone(), parts: parts.collect(), end };
        Ok(Piece::Head { contents, plan, bytes: bytes.into() })
    }

    /// Atom `index`; those before `last` are to follow.
    async fn atom(&mut self, contents: &Contents, index: usize, last: usize) -> Result<Bytes> {
        let (atom, end) = (contents.bytes(index..index + 1), contents.bytes(index..last).end);
        let bytes = self.feed.all(atom, end).await?;
        contents.check(index, &bytes)?;
        Ok(bytes)
    }
}

/// All of a file, with metadata and keyframes.
pub fn whole_file(contents: &Contents) -> Plan {
    let atoms = 0..contents.atoms.len();
    let parts = vec![Part { bytes: contents.bytes(atoms.clone()), atoms }];
    Plan { parts, ..plan(contents, Want::All) }
}

/// What is asked for before the table of contents tells what is needed: most tables fit, and with them the first levels.
pub const FIRST_BYTES: u64 = 16 << 10;
