//! Files of an HTTP server, by Range where it knows that, over connections that break (spec §12.2).
//!
//! All answers are of one version (RFC 9110 §8.8, §13.1.5, §14): each says which, by its tag, or its date and length where it has no
//! tag, and where a request goes on in a file it says so in `If-Range`.

use std::fmt;
use std::io;
use std::ops::Range;
use std::sync::Arc;
use std::time::Duration;

use bytes::Bytes;
use reqwest::header::{HeaderMap, IF_RANGE, LOCATION, RANGE};
use reqwest::redirect::Policy;
use reqwest::{Client, Response, StatusCode, Url};

use super::source::{Fault, RangeSource};
use crate::error::{Error, Result};

mod answer;

use answer::{Answer, Trouble};

/// Which version of a file an answer is of, as its headers tell.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Version {
    /// `ETag`, with its quotation marks.
    pub tag: Option<String>,
    /// `Last-Modified`.
    pub modified: Option<String>,
    /// Bytes of the whole file.
    pub bytes: Option<u64>,
}

impl Version {
    /// Whether both may be the same. Lengths are compared where both have one; dates only where there is no tag.
    pub fn agrees(&self, other: &Self) -> bool {
        let lengths = self.bytes.zip(other.bytes).is_none_or(|(a, b)| a == b);
        lengths && self.tag == other.tag && (self.tag.is_some() || self.modified == other.modified)
    }

    /// The tag, if it is strong: only then can `If-Range` ask for it.
    fn strong_tag(&self) -> Option<&str> {
        self.tag.as_deref().filter(|tag| tag.starts_with('"'))
    }
}

/// How to ask a server.
#[derive(Clone, Debug)]
pub struct HttpOptions {
    /// Sent with every request, but not to another server that an answer leads to.
    pub headers: HeaderMap,
    /// How long connecting may take, and how long nothing may come.
    pub timeout: Duration,
    /// How often in a row it is tried again after a failure that may pass.
    pub retries: u32,
    /// How long to wait before trying again; doubled each time, up to a minute.
    pub pause: Duration,
    /// The only version that will do, where some of it is there already.
    pub version: Option<Version>,
}

impl Default for HttpOptions {
    /// Half a minute of patience, 5 retries, the first after half a second.
    fn default() -> Self {
        let (timeout, pause) = (Duration::from_secs(30), Duration::from_millis(500));
        Self { headers: HeaderMap::new(), timeout, retries: 5, pause, version: None }
    }
}

/// A failure that may pass.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Retry {
    /// What went wrong.
    pub what: String,
    /// Where in the file it goes on.
    pub at: u64,
    /// After what time.
    pub after: Duration,
}

/// A file of an HTTP server.
///
/// A server that does not know ranges is read from the first byte on, and what is not wanted thrown away; the connection is closed as
/// soon as no more is wanted. Compressed answers are not asked for, and refused.
pub struct Http {
    client: Client,
    url: Url,
    options: HttpOptions,
    version: Option<Version>,
    open: Option<Answer>,
    /// Failures in a row, and bytes that came between them.
    failures: u32,
    since: u64,
    requests: u64,
    received: u64,
    heard: Option<Heard>,
}

type Heard = Box<dyn FnMut(&Retry) + Send>;

impl Http {
    /// The file at an `http` or `https` address. Nothing is asked yet.
    ///
    /// # Errors
    /// [`Error::Parameter`] where that is no such address; [`Error::Io`] where the system's certificates cannot be had.
    pub fn new(url: &str, options: HttpOptions) -> Result<Self> {
        let url = Url::parse(url).map_err(|e| Error::Parameter(format!("not a URL: {e}")))?;
        if !["http", "https"].contains(&url.scheme()) || url.host().is_none() {
            return Err(Error::Parameter("not an http:// or https:// URL".to_owned()));
        }
        let client = client(&options)?;
        let version = options.version.clone();
        let (failures, since, requests, received) = (0, 0, 0, 0);
        Ok(Self {
            client,
            url,
            options,
            version,
            open: None,
            failures,
            since,
            requests,
            received,
            heard: None,
        })
    }

    /// Tells of every failure that may pass, before it is tried again.
    pub fn on_retry(mut self, heard: impl FnMut(&Retry) + Send + 'static) -> Self {
        self.heard = Some(Box::new(heard));
        self
    }

    /// Which version it is, once an answer has told.
    pub fn version(&self) -> Option<&Version> {
        self.version.as_ref()
    }

    /// Requests made.
    pub fn requests(&self) -> u64 {
        self.requests
    }

    /// Bytes of bodies that came, with those thrown away.
    pub fn received(&self) -> u64 {
        self.received
    }

    async fn piece(&mut self, range: &Range<u64>) -> Result<Bytes, Trouble> {
        if self.open.as_ref().is_none_or(|open| !open.leads_to(range.start)) {
            self.open = None;
            match self.ask(range).await? {
                Some(answer) => self.open = Some(answer),
                None => return Ok(Bytes::new()),
            }
        }
        let Some(open) = &mut self.open else { return Ok(Bytes::new()) };
        let before = open.came();
        let piece = open.piece(range).await;
        self.received += open.came() - before;
        // What is left of it is not wanted: its connection is free, or closed.
        if piece.is_err() || open.is_through() {
            self.open = None;
        }
        piece
    }

    /// Asks for a range; `None` where the file ends before it.
    async fn ask(&mut self, range: &Range<u64>) -> Result<Option<Answer>, Trouble> {
        let response = self.send(range).await?;
        let answer = Answer::of(response, range)?;
        let told = answer.version();
        match &mut self.version {
            Some(version) if !version.agrees(told) => return Err(Fault::Changed.into()),
            Some(version) => version.bytes = version.bytes.or(told.bytes),
            none => *none = Some(told.clone()),
        }
        Ok(Some(answer).filter(|answer| !answer.is_empty()))
    }

    /// One request, and those that its answers lead to.
    async fn send(&mut self, range: &Range<u64>) -> Result<Response, Trouble> {
        let mut url = self.url.clone();
        for _ in 0..=MAX_REDIRECTS {
            let mut request = self.client.get(url.clone());
            if url.origin() == self.url.origin() {
                request = request.headers(self.options.headers.clone());
            }
            request = request.header(
                RANGE,
                match range.end {
                    u64::MAX => format!("bytes={}-", range.start),
                    end => format!("bytes={}-{}", range.start, end.saturating_sub(1)),
                },
            );
            if let Some(tag) = self.version.as_ref().and_then(Version::strong_tag) {
                request = request.header(IF_RANGE, tag);
            }
            self.requests += 1;
            let response = request.send().await?;
            if !is_redirect(response.status()) {
                return Ok(response);
            }
            let target = response.headers().get(LOCATION).and_then(|to| to.to_str().ok());
            let next =
                target.and_then(|to| url.join(to).ok()).filter(|to| ["http", "https"].contains(&to.scheme()));
            let Some(next) = next else {
                return Err(
                    Fault::Nonsense(format!("status {} without a place to go", response.status())).into()
                );
            };
            if url.scheme() == "https" && next.scheme() == "http" {
                return Err(Fault::Refused(format!("it leads from https:// to {next}")).into());
            }
            url = next;
        }
        Err(Fault::Nonsense(format!("more than {MAX_REDIRECTS} redirections")).into())
    }
}

impl RangeSource for Http {
    async fn read(&mut self, range: Range<u64>) -> io::Result<Bytes> {
        if range.is_empty() {
            return Ok(Bytes::new());
        }
        loop {
            let (what, told) = match self.piece(&range).await {
                Ok(piece) => {
                    self.since += piece.len() as u64;
                    if self.since >= SETTLED {
                        (self.failures, self.since) = (0, 0);
                    }
                    return Ok(piece);
                }
                Err(Trouble::Final(fault)) => return Err(fault.into()),
                Err(Trouble::Passing { what, after }) => (what, after),
            };
            self.failures += 1;
            let least = self.options.pause.saturating_mul(1 << (self.failures - 1).min(16)).min(MAX_PAUSE);
            if self.failures > self.options.retries {
                return Err(Fault::Unavailable { what, tries: self.failures }.into());
            }
            if let Some(told) = told.filter(|&told| told > MAX_PAUSE) {
                return Err(
                    Fault::Refused(format!("{what}; it asks to come again in {} s", told.as_secs())).into()
                );
            }
            let after = told.unwrap_or(Duration::ZERO).max(least);
            if let Some(heard) = &mut self.heard {
                heard(&Retry { what, at: range.start, after });
            }
            tokio::time::sleep(after).await;
        }
    }

    fn length(&self) -> Option<u64> {
        self.version.as_ref().and_then(|version| version.bytes)
    }
}

impl fmt::Debug for Http {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // The address and the headers may hold secrets.
        f.debug_struct("Http")
            .field("host", &self.url.host_str())
            .field("version", &self.version)
            .finish_non_exhaustive()
    }
}

fn client(options: &HttpOptions) -> Result<Client> {
    use rustls_platform_verifier::BuilderVerifierExt;
    let failed = |e: rustls::Error| Error::from(io::Error::other(e));
    let provider = Arc::new(rustls::crypto::ring::default_provider());
    let tls = rustls::ClientConfig::builder_with_provider(provider).with_safe_default_protocol_versions();
    let tls = tls.and_then(BuilderVerifierExt::with_platform_verifier).map_err(failed)?.with_no_client_auth();
    let client = Client::builder()
        .tls_backend_preconfigured(tls)
        .user_agent(concat!("unweld/", env!("CARGO_PKG_VERSION")))
        .redirect(Policy::none())
        .referer(false)
        .connect_timeout(options.timeout)
        .read_timeout(options.timeout);
    client.build().map_err(|e| Error::from(io::Error::other(e)))
}

fn is_redirect(status: StatusCode) -> bool {
    matches!(status.as_u16(), 301 | 302 | 303 | 307 | 308)
}

/// So many bytes make failures forgotten: a line that breaks often is used as long as it brings something.
const SETTLED: u64 = 4 << 10;
const MAX_REDIRECTS: u32 = 10;
const MAX_PAUSE: Duration = Duration::from_secs(60);
