//! Tables of contents, read once for each version and kept while there is room.

use std::sync::{Arc, Mutex, PoisonError};

use lru::LruCache;
use tokio::sync::Semaphore;

use crate::container::{Atom, Contents, Level, Parsed, Parser};
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
    /// By name: the tag of the version, and its contents.
    tables: LruCache<String, (String, Arc<Contents>)>,
    bytes: usize,
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
        if let Some(contents) = self.recall(name, &object.version.tag) {
            return Ok(contents);
        }
        let _turn = self.reading.acquire().await;
        if let Some(contents) = self.recall(name, &object.version.tag) {
            return Ok(contents);
        }
        let contents = read(object).await?;
        self.keep(name, &object.version.tag, &contents);
        Ok(contents)
    }

    fn recall(&self, name: &str, tag: &str) -> Option<Arc<Contents>> {
        let mut known = self.known.lock().unwrap_or_else(PoisonError::into_inner);
        known.tables.get(name).filter(|(known, _)| known == tag).map(|(_, contents)| contents.clone())
    }

    fn keep(&self, name: &str, tag: &str, contents: &Arc<Contents>) {
        let mut guard = self.known.lock().unwrap_or_else(PoisonError::into_inner);
        let known = &mut *guard;
        known.bytes += size(contents);
        if let Some((_, (_, old))) = known.tables.push(name.to_owned(), (tag.to_owned(), contents.clone())) {
            known.bytes -= size(&old);
        }
        while known.bytes > MOST_BYTES {
            let Some((_, (_, old))) = known.tables.pop_lru() else { break };
            known.bytes -= size(&old);
        }
    }
}

/// Memory that a table takes, about.
fn size(contents: &Contents) -> usize {
    256 + contents.atoms.len() * size_of::<Atom>() + contents.levels.len() * 2 * size_of::<Level>()
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
        let each = size(&contents);
        for k in 0..MOST_BYTES / each + 1000 {
            library.keep(&k.to_string(), "tag", &contents);
        }
        library.keep("0", "tag", &contents);
        library.keep("0", "other", &contents);
        let known = library.known.lock().unwrap();
        assert_eq!(known.bytes, known.tables.len() * each);
        assert!(known.bytes <= MOST_BYTES && known.bytes > MOST_BYTES - each);
        assert_eq!(known.tables.peek("0").map(|(tag, _)| tag.as_str()), Some("other"));
    }
}
