//! The table of a set first, then the members that are wanted, each atom checked (spec §15, §12.3).

use std::sync::Arc;

use bytes::Bytes;

use super::feed::Feed;
use super::source::RangeSource;
use crate::container::{Header, SetContents, parse_set};
use crate::error::{Error, FormatError, Result};

/// What [`SetTransfer::next`] brings.
#[derive(Clone, Debug, PartialEq)]
pub enum SetPiece {
    /// Header and table of the set: the first piece.
    Head {
        /// What they say.
        contents: Arc<SetContents>,
        /// The members that will come, in the order of the file.
        members: Vec<u32>,
        /// Their bytes, from the first of the file on.
        bytes: Bytes,
    },
    /// An atom of a member. Its checksum holds.
    Atom {
        /// The member.
        member: u32,
        /// Its place in the member's [`Contents::atoms`](crate::container::Contents::atoms).
        index: usize,
        /// Where it stands in the file of the set.
        offset: u64,
        /// Its bytes.
        bytes: Bytes,
    },
}

/// Brings members of a set from a source, and no more than them: one range of the file, as what a member takes stands before it.
///
/// It holds at most the table or one atom besides what the source holds.
#[derive(Debug)]
pub struct SetTransfer<S, P> {
    feed: Feed<S>,
    stage: Stage<P>,
}

#[derive(Debug)]
enum Stage<P> {
    Head(P, u64),
    Atoms {
        contents: Arc<SetContents>,
        /// Members still to come, and how many atoms of the first have.
        members: Vec<u32>,
        index: usize,
        end: u64,
    },
    Done,
}

impl<S, P> SetTransfer<S, P>
where
    S: RangeSource,
    P: FnOnce(&SetContents) -> Result<Vec<u32>> + Send,
{
    /// Brings the members that `chooser` names once the table is known: such that follow each other in the file, as
    /// [`SetContents::chain`] has them. The first `first` bytes are asked for at once.
    pub fn new(source: S, first: u64, chooser: P) -> Self {
        Self { feed: Feed::new(source), stage: Stage::Head(chooser, first) }
    }

    /// Where the bytes come from.
    pub fn source(&self) -> &S {
        self.feed.source()
    }

    /// The next piece; `None` behind the last.
    ///
    /// # Errors
    /// [`Error::Io`] of the source; [`Error::Format`] where the table or an atom is damaged, with its place in the file of the set, where the source ends
    /// before what is wanted does, and, if that ends with the file, where it does not; those of the chooser, and [`Error::Parameter`] where it names what
    /// does not follow each other. After an error nothing more comes, nor after a call that was dropped before it ended.
    pub async fn next(&mut self) -> Result<Option<SetPiece>> {
        match std::mem::replace(&mut self.stage, Stage::Done) {
            Stage::Head(chooser, first) => self.head(chooser, first).await.map(Some),
            Stage::Atoms { contents, mut members, mut index, end } => {
                let Some(&member) = members.first() else {
                    if end == contents.file_bytes() {
                        self.feed.check_end(end).await?;
                    }
                    return Ok(None);
                };
                let of = &contents.members[member as usize];
                let atom = of.contents.bytes(index..index + 1);
                let shift = |at: u64| at - of.head.len() as u64 + of.bytes.start;
                let (offset, at) = (shift(atom.start), index);
                let bytes = self.feed.all(offset..shift(atom.end), end).await?;
                of.contents.check(index, &bytes).map_err(|fault| FormatError { offset, ..fault })?;
                index += 1;
                if index == of.contents.atoms.len() {
                    members.remove(0);
                    index = 0;
                }
                self.stage = Stage::Atoms { contents, members, index, end };
                Ok(Some(SetPiece::Atom { member, index: at, offset, bytes }))
            }
            Stage::Done => Ok(None),
        }
    }

    async fn head(&mut self, chooser: P, first: u64) -> Result<SetPiece> {
        let first = first.max(Header::SIZE as u64);
        let start = self.feed.all(0..Header::SIZE as u64, first).await?;
        let start =
            start.first_chunk().ok_or_else(|| FormatError::new(0, "15.1", "the header is cut off"))?;
        let length = SetContents::head_bytes(start)? as u64;
        let rest = self.feed.all(Header::SIZE as u64..length, first.max(length)).await?;
        let bytes = [&start[..], &rest].concat();
        let contents = parse_set(&bytes)?;
        let contents =
            contents.ok_or_else(|| FormatError::new(length, "15.1", "the table of the set is cut off"))?;
        let members = chooser(&contents)?;
        let order = contents.in_file_order();
        let place = members.first().and_then(|first| order.iter().position(|number| number == first));
        let follow = place.and_then(|place| order.get(place..place + members.len()));
        if follow != Some(&members) {
            return Err(Error::Parameter("members that do not follow each other in the file".to_owned()));
        }
        let end = members.last().map_or(length, |&last| contents.members[last as usize].bytes.end);
        self.feed.check_length(end)?;
        let contents = Arc::new(contents);
        self.stage = Stage::Atoms { contents: contents.clone(), members: members.clone(), index: 0, end };
        Ok(SetPiece::Head { contents, members, bytes: bytes.into() })
    }
}
