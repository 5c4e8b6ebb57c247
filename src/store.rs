//! Meshes where they lie: bytes by range, each with the tag of its version. A folder, memory, or an object store.
//!
//! A version is what lay under a name at one time. Bytes of two versions never mix: what is read of an [`Object`] is of the version
//! that was opened, or it is [`Fault::Changed`].

use std::collections::BTreeSet;
use std::future::Future;
use std::ops::Range;
use std::sync::Arc;
use std::time::{Duration, SystemTime};

use bytes::Bytes;
use futures_util::stream::{BoxStream, Stream, StreamExt, try_unfold};
use object_store::local::LocalFileSystem;
use object_store::path::Path;
use object_store::{GetOptions, GetRange, ObjectMeta, ObjectStore};
use prometheus_client::metrics::counter::Counter;

use crate::error::{Error, Result};
use cache::Cache;

mod cache;
mod file;

/// What went wrong with a store.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Fault {
    /// Nothing lies under this name.
    #[error("there is no such mesh")]
    Absent,
    /// Something else lies under this name by now.
    #[error("the mesh was replaced while it was read")]
    Changed,
    /// The store will not give it, however often it is asked.
    #[error("the store refuses: {0}")]
    Refused(String),
    /// The store failed, and failed again when asked anew.
    #[error("the store fails: {0}")]
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
    inner: Arc<dyn ObjectStore>,
    /// The same, where it is a folder: its files are opened here.
    folder: Option<Arc<LocalFileSystem>>,
    prefix: Path,
    retries: Counter,
    cache: Arc<Cache>,
}

/// One version of a mesh, to be read from.
#[derive(Clone, Debug)]
pub struct Object {
    /// Which version.
    pub version: Version,
    source: Source,
}

#[derive(Clone, Debug)]
enum Source {
    /// An open file: it stays the same when another takes over its name.
    File(Arc<file::Open>),
    Remote(Store, Path),
}

impl Store {
    /// The meshes of a folder, or of the URL of an object store; credentials come from the environment.
    ///
    /// # Errors
    /// [`Error::Parameter`] where the location is no folder and no such URL; [`Error::Io`] where the folder cannot be read.
    pub fn open(location: &str) -> Result<Self> {
        if location.contains("://") {
            return Self::of_url(location);
        }
        if !std::fs::metadata(location)?.is_dir() {
            return Err(Error::Parameter("not a folder".to_owned()));
        }
        let folder =
            LocalFileSystem::new_with_prefix(location).map_err(|e| Error::Parameter(e.to_string()))?;
        let folder = Arc::new(folder);
        Ok(Self { folder: Some(folder.clone()), ..Self::over(folder) })
    }

    /// The meshes of any object store.
    pub fn over(inner: Arc<dyn ObjectStore>) -> Self {
        let cache = Arc::new(Cache::new(CACHE_BYTES));
        Self { inner, folder: None, prefix: Path::default(), retries: Counter::default(), cache }
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
        Ok(Self { prefix, ..Self::over(inner.into()) })
    }

    /// Opens the mesh of this name, which [`check_name`] has accepted.
    ///
    /// # Errors
    /// [`Fault`]; [`Fault::Absent`] also for a name that cannot be.
    pub async fn object(&self, name: &str) -> Result<Object, Fault> {
        let path = self.path(name)?;
        if let Some(folder) = &self.folder {
            let path = folder.path_to_filesystem(&path).map_err(|_| Fault::Absent)?;
            return file::open(&path, &self.cache);
        }
        // It is only asked about: its bytes come when they are wanted.
        let ask = || self.get(&path, GetOptions { head: true, ..GetOptions::default() });
        let got = self.patiently(ask).await?;
        Ok(Object { version: version(&got.meta), source: Source::Remote(self.clone(), path) })
    }

    /// Up to `limit` names behind `after`, sorted, and whether there are more.
    ///
    /// # Errors
    /// [`Fault`].
    pub async fn names(&self, after: &str, limit: usize) -> Result<(Vec<String>, bool), Fault> {
        self.patiently(|| async {
            let mut least = BTreeSet::new();
            let mut more = false;
            let mut list = self.inner.list(Some(&self.prefix));
            while let Some(meta) = list.next().await {
                let location = meta.map_err(fault)?.location;
                let name = location.prefix_match(&self.prefix).map(|parts| {
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
        })
        .await
    }

    /// How often a request to the store was made again because it had failed.
    pub fn retries(&self) -> &Counter {
        &self.retries
    }

    fn path(&self, name: &str) -> Result<Path, Fault> {
        let name = Path::parse(name).map_err(|_| Fault::Absent)?;
        Ok(self.prefix.parts().chain(name.parts()).collect())
    }

    async fn get(&self, path: &Path, options: GetOptions) -> Result<object_store::GetResult, Fault> {
        self.inner.get_opts(path, options).await.map_err(fault)
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
            Source::File(file) => file.read(&self.object.version, self.range.start).await?,
            Source::Remote(store, path) => {
                let (store, path) = (store.clone(), path.clone());
                self.receive(&store, &path).await?
            }
        };
        // A store that sends more than it was asked for.
        let piece = piece.slice(..piece.len().min(usize::try_from(left).unwrap_or(usize::MAX)));
        self.range.start += piece.len() as u64;
        Ok(Some(piece))
    }

    /// The next piece of a remote object; where the connection breaks, from another one.
    async fn receive(&mut self, store: &Store, path: &Path) -> Result<Bytes, Fault> {
        loop {
            let failed = match self.attempt(store, path).await {
                Err(Fault::Unavailable(what)) => what,
                outcome => return outcome.inspect(|_| self.failures = 0),
            };
            self.open = None;
            self.failures += 1;
            if self.failures >= TRIES {
                return Err(Fault::Unavailable(failed));
            }
            store.pause(self.failures).await;
        }
    }

    async fn attempt(&mut self, store: &Store, path: &Path) -> Result<Bytes, Fault> {
        let slow = |_| Fault::Unavailable(format!("no answer for {} s", MOST_WAIT.as_secs()));
        if self.open.is_none() {
            let range = Some(GetRange::Bounded(self.range.clone()));
            let options = GetOptions { range, ..GetOptions::default() };
            let got = tokio::time::timeout(MOST_WAIT, store.get(path, options)).await.map_err(slow)??;
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
