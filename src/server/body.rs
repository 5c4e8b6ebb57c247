//! Bodies that are read from the store as the client takes them.

use std::ops::Range;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};

use axum::body::Body;
use bytes::Bytes;
use futures_util::stream::{self, BoxStream, Stream, StreamExt};

use super::metrics::Metrics;
use crate::store::{Fault, Object};

/// A part of a body.
#[derive(Clone, Debug)]
pub enum Piece {
    /// What stands between parts.
    Text(Bytes),
    /// Bytes of the object.
    Object(Range<u64>),
}

impl Piece {
    /// Its length.
    pub fn bytes(&self) -> u64 {
        match self {
            Self::Text(text) => text.len() as u64,
            Self::Object(range) => range.end.saturating_sub(range.start),
        }
    }
}

/// A body of these pieces, its first bytes read already: what cannot be read at all is known before anything is sent.
///
/// # Errors
/// [`Fault`], of the first bytes. A later one breaks the connection off, so that the client does not take the body for whole.
pub async fn body(object: &Object, pieces: Vec<Piece>, metrics: &Arc<Metrics>) -> Result<Body, Fault> {
    let left = pieces.iter().map(Piece::bytes).sum();
    let object = object.clone();
    let mut rest = stream::iter(pieces)
        .flat_map(move |piece| match piece {
            Piece::Text(text) => stream::once(async { Ok(text) }).boxed(),
            Piece::Object(range) => object.stream(range).boxed(),
        })
        .boxed();
    let first = match rest.next().await {
        Some(first) => Some(first?),
        None => return Ok(Body::empty()),
    };
    Ok(Body::from_stream(Counted { first, rest, metrics: metrics.clone(), left }))
}

/// Counts what is sent, and whether all of it was.
struct Counted {
    first: Option<Bytes>,
    rest: BoxStream<'static, Result<Bytes, Fault>>,
    metrics: Arc<Metrics>,
    left: u64,
}

impl Stream for Counted {
    type Item = Result<Bytes, Fault>;

    fn poll_next(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Option<Self::Item>> {
        let next = match self.first.take() {
            Some(first) => Poll::Ready(Some(Ok(first))),
            None => self.rest.poll_next_unpin(context),
        };
        match &next {
            Poll::Ready(Some(Ok(bytes))) => {
                self.metrics.body_bytes.inc_by(bytes.len() as u64);
                self.left = self.left.saturating_sub(bytes.len() as u64);
            }
            Poll::Ready(Some(Err(fault))) => tracing::warn!(?fault, "an answer was broken off"),
            Poll::Ready(None) | Poll::Pending => {}
        }
        next
    }
}

impl Drop for Counted {
    fn drop(&mut self) {
        if self.left > 0 {
            self.metrics.unfinished.inc();
        }
    }
}
