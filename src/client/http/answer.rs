//! What an answer is: a range, the file from its first byte, or trouble.

use std::error::Error;
use std::ops::Range;
use std::time::{Duration, SystemTime};

use bytes::Bytes;
use headers::{ContentRange, HeaderMapExt};
use reqwest::header::{CONTENT_ENCODING, ETAG, HeaderMap, HeaderName, LAST_MODIFIED, RETRY_AFTER};
use reqwest::{Response, StatusCode};

use super::Version;
use crate::client::source::Fault;

/// Why there are no bytes.
pub enum Trouble {
    /// It is no use asking again.
    Final(Fault),
    /// It may be, not before so long.
    Passing { what: String, after: Option<Duration> },
}

impl From<Fault> for Trouble {
    fn from(fault: Fault) -> Self {
        Self::Final(fault)
    }
}

impl From<reqwest::Error> for Trouble {
    fn from(error: reqwest::Error) -> Self {
        if error.is_builder() {
            return Self::Final(Fault::Refused(innermost(&error)));
        }
        let what = match innermost(&error) {
            _ if error.is_timeout() => "nothing came in time".to_owned(),
            // A certificate that is not accepted will not be the next time.
            what if what.contains("invalid peer certificate") => return Self::Final(Fault::Refused(what)),
            what => what,
        };
        Self::Passing { what, after: None }
    }
}

/// A body on its way.
pub struct Answer {
    response: Response,
    version: Version,
    /// Where in the file its next byte belongs.
    at: u64,
    /// Where its last one does, plus one; `None` where it did not say.
    end: Option<u64>,
    /// What has come and was not wanted yet.
    rest: Bytes,
    came: u64,
}

impl Answer {
    /// Judges an answer to a request for `range`.
    pub fn of(response: Response, range: &Range<u64>) -> Result<Self, Trouble> {
        let status = response.status();
        let headers = response.headers();
        let mut version =
            Version { tag: text(headers, &ETAG), modified: text(headers, &LAST_MODIFIED), bytes: None };
        let span = headers.typed_get::<ContentRange>();
        let coding = text(headers, &CONTENT_ENCODING).filter(|coding| coding != "identity");
        let (at, end) = match status {
            StatusCode::PARTIAL_CONTENT => {
                let told = span
                    .as_ref()
                    .and_then(|span| span.bytes_range().map(|(first, last)| (first, last, span.bytes_len())));
                let Some((first, last, total)) = told else {
                    return Err(nonsense("part of a file, but not which (Content-Range)"));
                };
                if first != range.start || last < first || total.is_some_and(|total| last >= total) {
                    let what = format!("bytes from {first} to {last}, asked for from {} on", range.start);
                    return Err(nonsense(&what));
                }
                version.bytes = total;
                (first, Some(last.saturating_add(1).min(range.end)))
            }
            StatusCode::OK => {
                version.bytes = response.content_length();
                (0, version.bytes)
            }
            StatusCode::RANGE_NOT_SATISFIABLE => {
                let total = span.and_then(|span| span.bytes_len());
                if total.is_some_and(|total| total > range.start) {
                    return Err(nonsense(&format!(
                        "no bytes from {} on, though there are some",
                        range.start
                    )));
                }
                version.bytes = total;
                (range.start, Some(range.start))
            }
            _ => return Err(refusal(&response)),
        };
        match coding {
            Some(coding) => Err(nonsense(&format!("a body that is {coding}, which was not asked for"))),
            None => Ok(Self { response, version, at, end, rest: Bytes::new(), came: 0 }),
        }
    }

    /// Of what it is.
    pub fn version(&self) -> &Version {
        &self.version
    }

    /// Whether there is nothing in it.
    pub fn is_empty(&self) -> bool {
        self.response.status() == StatusCode::RANGE_NOT_SATISFIABLE
    }

    /// Whether all of it has been taken.
    pub fn is_through(&self) -> bool {
        self.end.is_some_and(|end| self.at >= end)
    }

    /// Bytes that have come.
    pub fn came(&self) -> u64 {
        self.came
    }

    /// Whether a byte of the file will come, with little to throw away before it.
    pub fn leads_to(&self, start: u64) -> bool {
        let held = self.at + self.rest.len() as u64;
        let reaches = self.end.is_none_or(|end| start < end);
        let near = start <= held.saturating_add(NEAR) || self.response.status() == StatusCode::OK;
        start >= self.at && reaches && near
    }

    /// Its next bytes from the start of `range` on; none where it ends there, and the file with it.
    pub async fn piece(&mut self, range: &Range<u64>) -> Result<Bytes, Trouble> {
        loop {
            let skipped = range.start.saturating_sub(self.at).min(self.rest.len() as u64);
            drop(self.take(skipped));
            let wanted = range.end.min(self.end.unwrap_or(u64::MAX)).saturating_sub(self.at);
            if !self.rest.is_empty() && wanted > 0 {
                return Ok(self.take(wanted));
            }
            match self.response.chunk().await? {
                Some(chunk) => {
                    self.came += chunk.len() as u64;
                    self.rest = chunk;
                }
                None if self.end.is_none_or(|end| self.at >= end) => return Ok(Bytes::new()),
                None => {
                    let missing = self.end.unwrap_or(self.at) - self.at;
                    return Err(Trouble::Passing {
                        what: format!("it ended {missing} bytes early"),
                        after: None,
                    });
                }
            }
        }
    }

    fn take(&mut self, most: u64) -> Bytes {
        let count = usize::try_from(most).unwrap_or(usize::MAX).min(self.rest.len());
        self.at += count as u64;
        self.rest.split_to(count)
    }
}

/// What a status that is none of the good ones means.
fn refusal(response: &Response) -> Trouble {
    let status = response.status();
    let what = format!("status {status}");
    match status.as_u16() {
        412 => Fault::Changed.into(),
        408 | 425 | 429 | 500 | 502 | 503 | 504 => {
            Trouble::Passing { what, after: retry_after(response.headers()) }
        }
        _ => Fault::Refused(what).into(),
    }
}

/// Seconds, or a date (RFC 9110 §10.2.3).
fn retry_after(headers: &HeaderMap) -> Option<Duration> {
    let text = text(headers, &RETRY_AFTER)?;
    if let Ok(seconds) = text.parse() {
        return Some(Duration::from_secs(seconds));
    }
    let date = httpdate::parse_http_date(&text).ok()?;
    Some(date.duration_since(SystemTime::now()).unwrap_or_default())
}

fn text(headers: &HeaderMap, name: &HeaderName) -> Option<String> {
    Some(headers.get(name)?.to_str().ok()?.trim().to_owned())
}

fn nonsense(what: &str) -> Trouble {
    Fault::Nonsense(what.to_owned()).into()
}

/// What the system said, below what each layer made of it.
fn innermost(error: &reqwest::Error) -> String {
    let mut cause: &dyn Error = error;
    while let Some(next) = cause.source() {
        cause = next;
    }
    cause.to_string()
}

/// Throwing away so much is quicker than asking again.
const NEAR: u64 = 64 << 10;
