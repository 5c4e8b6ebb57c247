//! Streams of events: bytes in, as they are asked for, events out.

use std::fmt;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll, ready};

use bytes::{Bytes, BytesMut};
use futures_util::stream::{BoxStream, Stream, StreamExt, try_unfold};
use tokio::io::{AsyncRead, AsyncReadExt};

use super::source::RangeSource;
use super::transfer::{FIRST_BYTES, Piece, Transfer};
use crate::container::{Contents, Plan};
use crate::decoder::{Decoder, Event, Options};
use crate::error::Result;

/// Decodes a file, from its first byte to its last, as `reader` brings it.
///
/// The stream ends behind [`Event::End`], once the reader has ended too, or with [`Event::Stopped`], and then the reader is dropped at
/// once. Its errors are those of the reader and of [`Decoder::poll`] and [`Decoder::finish`]; nothing follows one.
pub fn refine<'a>(reader: impl AsyncRead + Send + Unpin + 'a, options: Options) -> Refinement<'a> {
    let pieces = try_unfold(reader, |mut reader| async move {
        let mut piece = BytesMut::with_capacity(PIECE_BYTES);
        let count = reader.read_buf(&mut piece).await?;
        Ok((count > 0).then(|| (Fed::Bytes(piece.freeze()), reader)))
    });
    Refinement::of(pieces.boxed(), options)
}

/// Decodes what a plan takes: `planner` makes one of the table of contents, which comes first; then its parts, in order, are asked for.
///
/// The first event is [`Event::Contents`]. The stream ends as [`refine`]'s does, and with the errors of [`Transfer::next`] besides. Where
/// [`Fault::Changed`](super::Fault::Changed) is one of them, the mesh belongs to a version that is gone, and a new stream starts over.
pub fn refine_ranges<'a>(
    source: impl RangeSource + 'a,
    planner: impl FnOnce(&Contents) -> Result<Plan> + Send + 'a,
    options: Options,
) -> Refinement<'a> {
    let pieces = try_unfold(Transfer::new(source, FIRST_BYTES, planner), |mut transfer| async move {
        let piece = transfer.next().await?;
        Ok(piece.map(|piece| (Fed::of(piece), transfer)))
    });
    Refinement::of(pieces.boxed(), options)
}

/// A stream of [events](Event) that decodes as it is polled; [`Refinement::decoder`] has the mesh that they tell of.
///
/// A poll decodes one atom at most, on the thread that polls: milliseconds, or the better part of a second where a level of millions of
/// triangles begins. Dropping it stops everything.
pub struct Refinement<'a> {
    decoder: Decoder,
    options: Options,
    /// `None` once nothing more is wanted of it.
    feed: Option<BoxStream<'a, Result<Fed>>>,
    /// An event that the decoder does not tell itself.
    told: Option<Event>,
    /// Whether [`Event::End`] has been told.
    ended: bool,
}

enum Fed {
    Plan(Arc<Contents>, Plan),
    Bytes(Bytes),
}

impl Fed {
    fn of(piece: Piece) -> Self {
        match piece {
            Piece::Head { contents, plan, .. } => Self::Plan(contents, plan),
            Piece::Atom { bytes, .. } => Self::Bytes(bytes),
        }
    }
}

impl<'a> Refinement<'a> {
    fn of(feed: BoxStream<'a, Result<Fed>>, options: Options) -> Self {
        Self { decoder: Decoder::new(options), options, feed: Some(feed), told: None, ended: false }
    }

    /// The decoder as it stands behind the last event.
    pub fn decoder(&self) -> &Decoder {
        &self.decoder
    }

    /// The same, to go down and up in its undo log.
    pub fn decoder_mut(&mut self) -> &mut Decoder {
        &mut self.decoder
    }

    /// The decoder, without what it was fed by.
    pub fn into_decoder(self) -> Decoder {
        self.decoder
    }

    fn poll_event(&mut self, cx: &mut Context<'_>) -> Poll<Result<Option<Event>>> {
        while let Some(feed) = &mut self.feed {
            if let Some(event) = self.told.take() {
                return Poll::Ready(Ok(Some(event)));
            }
            if let Some(event) = self.decoder.poll()? {
                match event {
                    Event::Stopped => self.feed = None,
                    Event::End => self.ended = true,
                    _ => {}
                }
                return Poll::Ready(Ok(Some(event)));
            }
            match ready!(feed.poll_next_unpin(cx)?) {
                Some(Fed::Bytes(bytes)) => {
                    self.decoder.push(&bytes);
                    if self.ended {
                        // There may be no end to what stands behind the end.
                        self.feed = None;
                        self.decoder.poll()?;
                        self.decoder.finish()?;
                    }
                }
                Some(Fed::Plan(contents, plan)) => {
                    self.options.until.level = self.options.until.level.max(plan.level);
                    self.decoder = Decoder::of_plan(contents.clone(), &plan, self.options);
                    self.told = Some(Event::Contents(contents));
                }
                None => {
                    self.feed = None;
                    self.decoder.finish()?;
                }
            }
        }
        Poll::Ready(Ok(None))
    }
}

impl Stream for Refinement<'_> {
    type Item = Result<Event>;

    fn poll_next(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<Option<Self::Item>> {
        let event = ready!(self.poll_event(cx));
        if event.is_err() {
            self.feed = None;
        }
        Poll::Ready(event.transpose())
    }
}

impl fmt::Debug for Refinement<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Refinement").field("decoder", &self.decoder).finish_non_exhaustive()
    }
}

/// Most bytes read at a time.
const PIECE_BYTES: usize = 16 << 10;
