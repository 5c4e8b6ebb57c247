//! Tables of contents, read once for each version and kept while there is room.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use bytes::Bytes;
use lru::LruCache;
use tokio::sync::Semaphore;

use super::sets;
use super::tables::Table;
use crate::container::{Atom, AttributeError, Contents, Level, Parsed, Parser, SetContents};
use crate::error::FormatError;
use crate::store::{Fault, Object};

/// Why a table of contents cannot be had.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Unreadable {
    /// The store's fault.
    #[error("{0}")]
    Store(#[from] Fault),
    /// The file's fault.
    #[error("{0}")]
    Format(#[from] FormatError),
}

/// The tables that are known.
#[derive(Debug)]
pub struct Library {
    known: Mutex<Known>,
    /// How many tables may be read at a time, so that large ones do not take the memory of all the rest.
    reading: Semaphore,
}

#[derive(Debug)]
struct Known {
    tables: LruCache<String, Kept>,
    bytes: usize,
}

/// What is kept under a name.
#[derive(Clone, Debug)]
struct Kept {
    /// The tag of the version.
    tag: String,
    contents: Arc<Contents>,
    /// Its levels as JSON; empty until they are wanted.
    text: Bytes,
}

impl Library {
    /// One that knows nothing yet.
    pub fn new() -> Self {
        let known = Known { tables: LruCache::unbounded(), bytes: 0 };
        Self { known: Mutex::new(known), reading: Semaphore::new(READERS) }
    }

    /// Header and table of contents of a version.
    ///
    /// # Errors
    /// [`Unreadable`].
    pub async fn contents(&self, name: &str, object: &Object) -> Result<Arc<Contents>, Unreadable> {
        self.kept(name, object).await.map(|kept| kept.contents)
    }

    /// The levels of a version, or the members of a set, as JSON (spec §12.3).
    ///
    /// # Errors
    /// [`Unreadable`].
    pub async fn levels(&self, name: &str, object: &Object) -> Result<Bytes, Unreadable> {
        let mut kept = match self.kept(name, object).await {
            Err(Unreadable::Format(fault)) if SetContents::is_fault_of_set(&fault) => {
                let _turn = self.reading.acquire().await;
                return sets::members(name, object).await.map(Bytes::from);
            }
            kept => kept?,
        };
        if kept.text.is_empty() {
            kept.text = Table::new(name.to_owned(), &object.version, &kept.contents).text().into();
            self.keep(name, kept.clone());
        }
        Ok(kept.text)
    }

    async fn kept(&self, name: &str, object: &Object) -> Result<Kept, Unreadable> {
        let tag = &object.version.tag;
        if let Some(kept) = self.recall(name, tag) {
            return Ok(kept);
        }
        let _turn = self.reading.acquire().await;
        if let Some(kept) = self.recall(name, tag) {
            return Ok(kept);
        }
        let kept = Kept { tag: tag.clone(), contents: read(object).await?, text: Bytes::new() };
        self.keep(name, kept.clone());
        Ok(kept)
    }

    fn recall(&self, name: &str, tag: &str) -> Option<Kept> {
        self.known().tables.get(name).filter(|kept| kept.tag == tag).cloned()
    }

    fn keep(&self, name: &str, kept: Kept) {
        let mut guard = self.known();
        let known = &mut *guard;
        known.bytes += kept.bytes();
        if let Some((_, old)) = known.tables.push(name.to_owned(), kept) {
            known.bytes -= old.bytes();
        }
        while known.bytes > MOST_BYTES {
            let Some((_, old)) = known.tables.pop_lru() else { break };
            known.bytes -= old.bytes();
        }
    }

    fn known(&self) -> MutexGuard<'_, Known> {
        self.known.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Kept {
    /// Memory that it takes, about.
    fn bytes(&self) -> usize {
        let Contents { atoms, levels, .. } = &*self.contents;
        let errors: usize = levels.iter().map(|level| level.attributes.len()).sum();
        let levels = levels.len() * 2 * size_of::<Level>() + errors * size_of::<AttributeError>();
        256 + atoms.len() * size_of::<Atom>() + levels + self.text.len()
    }
}

async fn read(object: &Object) -> Result<Arc<Contents>, Unreadable> {
    let mut parser = Parser::new();
    let mut at = 0;
    // As a rule all is in the first piece.
    let mut wanted = FIRST_BYTES;
    loop {
        let end = object.version.bytes.min(at + wanted);
        let piece = object.read(at..end).await?;
        at = end;
        let cut = piece.is_empty();
        let parse = move || {
            let missing = match parser.parse(&mut &piece[..])? {
                Parsed::Contents(contents) => return Ok((Some(contents), 0, parser)),
                Parsed::NeedMore(missing) => missing,
                Parsed::Atom { .. } | Parsed::End => 0,
            };
            if cut {
                parser.finish()?;
            }
            Ok::<_, FormatError>((None, missing, parser))
        };
        // A large table takes a while.
        let (contents, missing, rest) = match wanted {
            FIRST_BYTES => parse()?,
            _ => {
                tokio::task::spawn_blocking(parse).await.map_err(|e| Fault::Unavailable(e.to_string()))??
            }
        };
        match contents {
            Some(contents) => return Ok(contents),
            None if cut => return Err(FormatError::new(at, "3.1", "there is no table of contents").into()),
            None => (wanted, parser) = (missing as u64, rest),
        }
    }
}

/// Memory for tables.
const MOST_BYTES: usize = 64 << 20;
const READERS: usize = 4;
const FIRST_BYTES: u64 = 16 << 10;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::container::testing;
    use crate::store::Store;
    use object_store::memory::InMemory;
    use object_store::path::Path;
    use object_store::{ObjectStore, ObjectStoreExt};

    #[test]
    fn tables_of_versions_and_of_damaged_files() {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
        runtime.block_on(async {
            let memory = Arc::new(InMemory::new());
            let store = Store::over(memory.clone() as Arc<dyn ObjectStore>);
            let library = Library::new();
            let bytes = testing::bytes(&testing::small_file());
            let whole = testing::contents(&testing::small_file());
            let path = Path::from("a.uwm");
            memory.put(&path, bytes.clone().into()).await.unwrap();
            let object = store.object("a.uwm").await.unwrap();
            let first = library.contents("a.uwm", &object).await.unwrap();
            assert_eq!(*first, whole);
            assert!(Arc::ptr_eq(&first, &library.contents("a.uwm", &object).await.unwrap()), "read once");
            let text = library.levels("a.uwm", &object).await.unwrap();
            assert_eq!(text, library.levels("a.uwm", &object).await.unwrap());
            assert_eq!(text, Table::new("a.uwm".to_owned(), &object.version, &first).text());
            for cut in [0, 8, 16, 50, 100] {
                memory.put(&path, bytes[..cut].to_vec().into()).await.unwrap();
                let object = store.object("a.uwm").await.unwrap();
                let fault = library.contents("a.uwm", &object).await.unwrap_err().to_string();
                assert!(fault.starts_with(&format!("byte {cut}: the file is cut off")), "{fault}");
            }
            memory.put(&path, bytes.clone().into()).await.unwrap();
            let object = store.object("a.uwm").await.unwrap();
            assert!(
                !Arc::ptr_eq(&first, &library.contents("a.uwm", &object).await.unwrap()),
                "another version"
            );
        });
    }

    #[test]
    fn what_is_kept_is_bounded() {
        let library = Library::new();
        let contents = Arc::new(testing::contents(&testing::small_file()));
        let kept = |tag: &str| Kept {
            tag: tag.to_owned(),
            contents: contents.clone(),
            text: Bytes::from(vec![b' '; 1000]),
        };
        let each = kept("tag").bytes();
        for k in 0..MOST_BYTES / each + 1000 {
            library.keep(&k.to_string(), kept("tag"));
        }
        library.keep("0", kept("tag"));
        library.keep("0", kept("other"));
        let known = library.known();
        assert_eq!(known.bytes, known.tables.len() * each);
        assert!(known.bytes <= MOST_BYTES && known.bytes > MOST_BYTES - each);
        assert_eq!(known.tables.peek("0").map(|kept| kept.tag.as_str()), Some("other"));
    }
}
