//! Meshes where they lie: bytes by range, each with the tag of its version. A folder, memory, or an object store.
//!
//! A version is what lay under a name at one time. Bytes of two versions never mix: what is read of an [`Object`] is of the version
//! that was opened, or it is [`Fault::Changed`].

use std::collections::BTreeSet;
use std::future::Future;
use std::io;
use std::ops::Range;
use std::sync::Arc;
use std::time::{Duration, SystemTime};

use bytes::Bytes;
use futures_util::stream::{BoxStream, Stream, StreamExt, try_unfold};
use object_store::path::Path;
use object_store::{GetOptions, GetRange, ObjectMeta, ObjectStore};
use prometheus_client::metrics::counter::Counter;

use crate::error::{Error, Result};
use cache::Cache;
use folder::Folder;

mod cache;
mod file;
mod folder;
mod index;

/// What went wrong with a store.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Fault {
    /// Nothing lies under this name.
    #[error("there is no such mesh")]
    Absent,
    /// Something else lies under this name by now.
    #[error("the mesh was replaced while it was read")]
    Changed,
    /// The store will not give it, however often it is asked. Why is for the operator: it may tell paths and addresses.
    #[error("the store refuses")]
    Refused(String),
    /// The store failed, and failed again when asked anew. Why is for the operator, too.
    #[error("the store fails")]
    Unavailable(String),
}

/// One version of an object.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Version {
    /// Another one for every other version under the same name: letters, digits and signs of ASCII but `"` and `\`.
    pub tag: String,
    /// Its length.
    pub bytes: u64,
    /// When it was written, as the store tells.
    pub modified: SystemTime,
}

/// A place of meshes; a clone is the same place.
#[derive(Clone, Debug)]
pub struct Store {
    place: Place,
    retries: Counter,
    cache: Arc<Cache>,
}

#[derive(Clone, Debug)]
enum Place {
    Folder(Folder),
    /// What is below a path.
    Remote(Arc<dyn ObjectStore>, Path),
}

/// One version of a mesh, to be read from.
#[derive(Clone, Debug)]
pub struct Object {
    /// Which version.
    pub version: Version,
    source: Source,
}

/// An object of a store elsewhere.
#[derive(Clone, Debug)]
struct Remote {
    store: Store,
    inner: Arc<dyn ObjectStore>,
    path: Path,
}

#[derive(Clone, Debug)]
enum Source {
    /// An open file: it stays the same when another takes over its name.
    File(Arc<file::Open>),
    Remote(Remote),
}

impl Store {
    /// The meshes of a folder, the one of a `.uwm` file, or those at the URL of an object store; credentials come from the environment.
    /// Links that lead out of a folder lead nowhere, unless [`Store::with_links`] lets them.
    ///
    /// # Errors
    /// [`Error::Parameter`] where the location is none of them; [`Error::Io`] where it cannot be read.
    pub fn open(location: &str) -> Result<Self> {
        if location.contains("://") {
            return Self::of_url(location);
        }
        Ok(Self::of(Place::Folder(Folder::new(location)?)))
    }

    /// The meshes of any object store.
    pub fn over(inner: Arc<dyn ObjectStore>) -> Self {
        Self::of(Place::Remote(inner, Path::default()))
    }

    fn of(place: Place) -> Self {
        Self { place, retries: Counter::default(), cache: Arc::new(Cache::new(CACHE_BYTES)) }
    }

    /// The same, where links in a folder may lead out of it.
    pub fn with_links(self) -> Self {
        match self.place {
            Place::Folder(folder) => Self { place: Place::Folder(folder.with_links()), ..self },
            Place::Remote(..) => self,
        }
    }

    /// The same with so many bytes of memory, instead of [`CACHE_BYTES`], for parts of files that are often wanted.
    pub fn with_cache(self, bytes: usize) -> Self {
        Self { cache: Arc::new(Cache::new(bytes)), ..self }
    }

    fn of_url(location: &str) -> Result<Self> {
        let refuse = |what: String| Error::Parameter(what);
        let url = url::Url::parse(location).map_err(|e| refuse(format!("not a URL: {e}")))?;
        if !cfg!(feature = "cloud") && !["file", "memory"].contains(&url.scheme()) {
            let what = format!("{}:// wants a build with --features cloud", url.scheme());
            return Err(refuse(what));
        }
        if url.scheme() == "file" {
            let path = url.to_file_path().map_err(|()| refuse("not the path of a folder".to_owned()))?;
            return Self::open(&path.to_string_lossy());
        }
        let variables =
            std::env::vars_os().filter_map(|(k, v)| Some((k.into_string().ok()?, v.into_string().ok()?)));
        let (inner, prefix) =
            object_store::parse_url_opts(&url, variables).map_err(|e| refuse(e.to_string()))?;
        Ok(Self::of(Place::Remote(inner.into(), prefix)))
    }

    /// Opens the mesh of this name, which [`check_name`] has accepted.
    ///
    /// # Errors
    /// [`Fault`]; [`Fault::Absent`] also for a name that cannot be.
    pub async fn object(&self, name: &str) -> Result<Object, Fault> {
        check_name(name).map_err(|_| Fault::Absent)?;
        let (inner, prefix) = match &self.place {
            Place::Remote(inner, prefix) => (inner.clone(), prefix),
            Place::Folder(folder) => {
                let file = folder.file(name).map_err(fault_of)?;
                return file::object(file, &folder.path(name), &self.cache).await;
            }
        };
        let name = Path::parse(name).map_err(|_| Fault::Absent)?;
        let path = prefix.parts().chain(name.parts()).collect();
        let remote = Remote { store: self.clone(), inner, path };
        // It is only asked about: its bytes come when they are wanted.
        let ask = || remote.get(GetOptions { head: true, ..GetOptions::default() });
        let got = self.patiently(ask).await?;
        Ok(Object { version: version(&got.meta), source: Source::Remote(remote) })
    }

    /// Up to `limit` names behind `after`, sorted, and whether there are more. What has no name that a mesh may have is left out.
    ///
    /// # Errors
    /// [`Fault`].
    pub async fn names(&self, after: &str, limit: usize) -> Result<(Vec<String>, bool), Fault> {
        match &self.place {
            Place::Folder(folder) => folder.names(after, limit).await,
            Place::Remote(inner, prefix) => self.patiently(|| listed(inner, prefix, after, limit)).await,
        }
    }

    /// How often a request to the store was made again because it had failed.
    pub fn retries(&self) -> &Counter {
        &self.retries
    }

    /// Asks up to [`TRIES`] times, with growing pauses, as long as the store is what fails.
    async fn patiently<T, F: Future<Output = Result<T, Fault>>>(
        &self,
        ask: impl Fn() -> F,
    ) -> Result<T, Fault> {
        let mut outcome = Err(Fault::Unavailable(String::new()));
        for attempt in 0..TRIES {
            if attempt > 0 {
                self.pause(attempt).await;
            }
            outcome = match tokio::time::timeout(MOST_WAIT, ask()).await {
                Ok(outcome) => outcome,
                Err(_) => Err(Fault::Unavailable(format!("no answer for {} s", MOST_WAIT.as_secs()))),
            };
            if !matches!(outcome, Err(Fault::Unavailable(_))) {
                break;
            }
        }
        outcome
    }

    async fn pause(&self, attempt: u32) {
        self.retries.inc();
        tokio::time::sleep(FIRST_PAUSE * (1 << attempt)).await;
    }
}

impl Object {
    /// The bytes of a range, in pieces of at most [`PIECE`] from a folder; a piece is read when it is asked for. A range that leaves the
    /// object ends in [`Fault::Changed`], once what is there has been told.
    pub fn stream(&self, range: Range<u64>) -> impl Stream<Item = Result<Bytes, Fault>> + Send + 'static {
        let state = Reading { object: self.clone(), range, open: None, failures: 0 };
        try_unfold(state, |mut state| async move { Ok(state.next().await?.map(|piece| (piece, state))) })
    }

    /// The bytes of a range, all at once.
    ///
    /// # Errors
    /// [`Fault`].
    pub async fn read(&self, range: Range<u64>) -> Result<Vec<u8>, Fault> {
        let mut bytes = Vec::new();
        let mut pieces = std::pin::pin!(self.stream(range));
        while let Some(piece) = pieces.next().await {
            bytes.extend_from_slice(&piece?);
        }
        Ok(bytes)
    }
}

/// What is still to be read, and how far that is under way.
struct Reading {
    object: Object,
    range: Range<u64>,
    open: Option<BoxStream<'static, object_store::Result<Bytes>>>,
    failures: u32,
}

impl Reading {
    async fn next(&mut self) -> Result<Option<Bytes>, Fault> {
        let left = self.range.end.saturating_sub(self.range.start);
        if left == 0 {
            return Ok(None);
        }
        let piece = match &self.object.source {
            Source::File(file) => file.read(self.range.start).await?,
            Source::Remote(remote) => {
                let remote = remote.clone();
                self.receive(&remote).await?
            }
        };
        // A store that sends more than it was asked for.
        let piece = piece.slice(..piece.len().min(usize::try_from(left).unwrap_or(usize::MAX)));
        self.range.start += piece.len() as u64;
        Ok(Some(piece))
    }

    /// The next piece of a remote object; where the connection breaks, from another one.
    async fn receive(&mut self, remote: &Remote) -> Result<Bytes, Fault> {
        loop {
            let failed = match self.attempt(remote).await {
                Err(Fault::Unavailable(what)) => what,
                outcome => return outcome.inspect(|_| self.failures = 0),
            };
            self.open = None;
            self.failures += 1;
            if self.failures >= TRIES {
                return Err(Fault::Unavailable(failed));
            }
            remote.store.pause(self.failures).await;
        }
    }

    async fn attempt(&mut self, remote: &Remote) -> Result<Bytes, Fault> {
        let slow = |_| Fault::Unavailable(format!("no answer for {} s", MOST_WAIT.as_secs()));
        if self.open.is_none() {
            let range = Some(GetRange::Bounded(self.range.clone()));
            let options = GetOptions { range, ..GetOptions::default() };
            let got = tokio::time::timeout(MOST_WAIT, remote.get(options)).await.map_err(slow)??;
            if version(&got.meta) != self.object.version {
                return Err(Fault::Changed);
            }
            self.open = Some(got.into_stream());
        }
        let Some(open) = &mut self.open else { return Err(Fault::Changed) };
        match tokio::time::timeout(MOST_WAIT, open.next()).await.map_err(slow)? {
            Some(Ok(piece)) => Ok(piece),
            Some(Err(error)) => Err(fault(error)),
            None => Err(Fault::Unavailable("it sent less than it was asked for".to_owned())),
        }
    }
}

impl Remote {
    async fn get(&self, options: GetOptions) -> Result<object_store::GetResult, Fault> {
        self.inner.get_opts(&self.path, options).await.map_err(fault)
    }
}

/// A page of the names below a path.
async fn listed(
    inner: &Arc<dyn ObjectStore>,
    prefix: &Path,
    after: &str,
    limit: usize,
) -> Result<(Vec<String>, bool), Fault> {
    let mut least = BTreeSet::new();
    let mut more = false;
    let mut list = inner.list(Some(prefix));
    while let Some(meta) = list.next().await {
        let location = match meta {
            Ok(meta) => meta.location,
            Err(error @ object_store::Error::InvalidPath { .. }) => {
                tracing::warn!(?error, "left out of the list");
                continue;
            }
            Err(error) => return Err(fault(error)),
        };
        let name = location.prefix_match(prefix).map(|parts| {
            let parts: Vec<_> = parts.map(|part| part.as_ref().to_owned()).collect();
            parts.join("/")
        });
        let Some(name) = name.filter(|name| check_name(name).is_ok() && name.as_str() > after) else {
            continue;
        };
        least.insert(name);
        if least.len() > limit {
            more = true;
            least.pop_last();
        }
    }
    Ok((least.into_iter().collect(), more))
}

/// Sees whether `name` may be that of a mesh: parts separated by `/`, none of them empty or hidden, the last one ending in `.uwm`.
///
/// # Errors
/// What is wrong with it.
pub fn check_name(name: &str) -> Result<(), &'static str> {
    let rules = [
        (name.len() <= MAX_NAME_BYTES, "is longer than 1,024 bytes"),
        (!name.chars().any(|c| c.is_control() || c == '\\'), "has a control character or a backslash"),
        (name.split('/').all(|part| !part.is_empty()), "has an empty part"),
        (name.split('/').all(|part| !part.starts_with('.')), "has a part that begins with a dot"),
        (name.ends_with(".uwm"), "does not end in .uwm"),
    ];
    rules.into_iter().find(|(holds, _)| !holds).map_or(Ok(()), |(_, what)| Err(what))
}

fn version(meta: &ObjectMeta) -> Version {
    let told = meta.e_tag.as_deref().map(|tag| tag.trim_matches('"'));
    // A weak tag, or one that no header could carry, is none.
    let fit = |tag: &&str| {
        !tag.is_empty()
            && !tag.starts_with("W/")
            && tag.bytes().all(|b| b.is_ascii_graphic() && b != b'"' && b != b'\\')
    };
    let made = || format!("{:x}-{:x}", meta.last_modified.timestamp_micros(), meta.size);
    Version {
        tag: told.filter(fit).map_or_else(made, str::to_owned),
        bytes: meta.size,
        modified: meta.last_modified.into(),
    }
}

/// What an error of the system means.
fn fault_of(error: io::Error) -> Fault {
    use io::ErrorKind as K;
    match error.kind() {
        K::NotFound | K::NotADirectory | K::InvalidFilename => Fault::Absent,
        // Links that lead in a circle, which has no stable name yet.
        #[cfg(unix)]
        _ if error.raw_os_error() == Some(rustix::io::Errno::LOOP.raw_os_error()) => Fault::Absent,
        K::PermissionDenied => Fault::Refused(error.to_string()),
        _ => Fault::Unavailable(error.to_string()),
    }
}

fn fault(error: object_store::Error) -> Fault {
    use object_store::Error as E;
    match error {
        E::NotFound { .. } | E::InvalidPath { .. } => Fault::Absent,
        E::Precondition { .. } | E::NotModified { .. } => Fault::Changed,
        E::PermissionDenied { .. }
        | E::Unauthenticated { .. }
        | E::NotSupported { .. }
        | E::NotImplemented { .. } => Fault::Refused(error.to_string()),
        other => Fault::Unavailable(other.to_string()),
    }
}

/// Most bytes read from a file at a time.
pub const PIECE: usize = 64 << 10;
/// Memory for parts of files that are often wanted.
pub const CACHE_BYTES: usize = 64 << 20;
const MAX_NAME_BYTES: usize = 1024;
/// How often the store is asked before it is given up.
const TRIES: u32 = 3;
const FIRST_PAUSE: Duration = Duration::from_millis(25);
const MOST_WAIT: Duration = Duration::from_secs(20);

#[cfg(test)]
mod tests;
