//! The names in a folder, kept in memory. Before each use the folders are asked for the time of their last change, and those that have changed
//! are read again. What has no name that a mesh may have, or cannot be read, is left out and told to the log once.

use std::collections::{BTreeMap, BTreeSet, HashSet};
use std::fs::{self, Metadata};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant, SystemTime};

use super::check_name;
use super::folder::target;

/// What is known of a folder and those in it.
#[derive(Debug, Default)]
pub struct Index {
    folders: BTreeMap<String, Known>,
    names: Vec<Arc<str>>,
    /// The names would take more than [`MOST_BYTES`]: they are looked through for each page instead.
    large: bool,
    /// When they were last compared with the folder, and how long that took.
    compared: Option<(Instant, Duration)>,
    /// What the log has been told.
    told: HashSet<String>,
}

/// A folder as it was when it was read.
#[derive(Debug)]
struct Known {
    /// What tells that it has not changed; nothing where that cannot be told.
    stamp: Option<Stamp>,
    names: Vec<Arc<str>>,
    folders: Vec<Entry>,
}

type Stamp = (SystemTime, u128);

/// A folder that is to be looked through.
#[derive(Clone, Debug)]
struct Entry {
    /// With a slash at its end, or empty.
    name: String,
    real: PathBuf,
    /// The folders from which links led here.
    trail: Vec<PathBuf>,
}

impl Index {
    /// Up to `limit` names behind `after`, sorted, and whether there are more.
    ///
    /// # Errors
    /// Those of the folder itself.
    pub fn page(
        &mut self,
        root: &Path,
        links: bool,
        after: &str,
        limit: usize,
    ) -> io::Result<(Vec<String>, bool)> {
        // A folder that takes long to look through is looked through less often.
        let fresh = self
            .compared
            .is_some_and(|(when, took)| took > CHEAP && when.elapsed() < took.saturating_mul(RESTS));
        if !fresh && !self.large {
            self.refresh(root, links)?;
        }
        if self.large {
            return self.look_through(root, links, after, limit);
        }
        let start = self.names.partition_point(|name| **name <= *after);
        let rest = &self.names[start..];
        let page = rest.iter().take(limit).map(|name| name.to_string());
        Ok((page.collect(), rest.len() > limit))
    }

    /// Reads what has changed.
    fn refresh(&mut self, root: &Path, links: bool) -> io::Result<()> {
        let begun = Instant::now();
        let mut before = std::mem::take(&mut self.folders);
        let (mut changed, mut bytes) = (false, 0);
        let mut waiting = vec![Entry::root(root)];
        while let Some(entry) = waiting.pop() {
            let stamp = stamp(&entry.real);
            let known =
                before.remove(&entry.name).filter(|known| known.stamp.is_some() && known.stamp == stamp);
            let known = match known {
                Some(known) => known,
                None => {
                    changed = true;
                    let mut known = Known { stamp, names: Vec::new(), folders: Vec::new() };
                    let certain = self.read(root, links, &entry, &mut |found| {
                        bytes += found.bytes();
                        match found {
                            _ if bytes > MOST_BYTES => {}
                            Found::Mesh(name) => known.names.push(name.into()),
                            Found::Folder(entry) => known.folders.push(entry),
                        }
                    })?;
                    known.stamp = known.stamp.filter(|_| certain);
                    known
                }
            };
            waiting.extend(known.folders.iter().cloned());
            self.folders.insert(entry.name, known);
            if bytes > MOST_BYTES {
                let told = std::mem::take(&mut self.told);
                *self = Self { large: true, told, ..Self::default() };
                return Ok(());
            }
        }
        if changed || !before.is_empty() {
            self.names = self.folders.values().flat_map(|known| known.names.iter().cloned()).collect();
            self.names.sort_unstable();
        }
        // What was known already counts as well.
        let kept = self.names.iter().map(|name| name.len() + OVERHEAD).sum::<usize>();
        self.large = kept > MOST_BYTES;
        self.compared = Some((Instant::now(), begun.elapsed()));
        Ok(())
    }

    /// The names of a page out of all there are, of which no more are kept than it holds.
    fn look_through(
        &mut self,
        root: &Path,
        links: bool,
        after: &str,
        limit: usize,
    ) -> io::Result<(Vec<String>, bool)> {
        (self.folders, self.names) = Default::default();
        let (mut page, mut more, mut bytes) = (BTreeSet::new(), false, 0_usize);
        let mut waiting = vec![Entry::root(root)];
        while let Some(entry) = waiting.pop() {
            self.read(root, links, &entry, &mut |found| {
                bytes = bytes.saturating_add(found.bytes());
                match found {
                    Found::Folder(entry) => waiting.push(entry),
                    Found::Mesh(name) if name.as_str() > after => {
                        page.insert(name);
                        if page.len() > limit {
                            more = true;
                            page.pop_last();
                        }
                    }
                    Found::Mesh(_) => {}
                }
            })?;
        }
        self.large = bytes > MOST_BYTES;
        Ok((page.into_iter().collect(), more))
    }

    /// Tells what is in a folder, and whether the time of its last change tells when that is no longer so.
    fn read(
        &mut self,
        root: &Path,
        links: bool,
        folder: &Entry,
        found: &mut dyn FnMut(Found),
    ) -> io::Result<bool> {
        let entries = match fs::read_dir(&folder.real) {
            Ok(entries) => entries,
            Err(error) if folder.name.is_empty() => return Err(error),
            Err(error) => {
                self.leave_out(&folder.real, &error.to_string());
                return Ok(false);
            }
        };
        let mut certain = true;
        for entry in entries {
            let (entry, kind) = match entry.and_then(|entry| Ok((entry.file_type()?, entry))) {
                Ok((kind, entry)) => (entry, kind),
                Err(error) => {
                    self.leave_out(&folder.real, &error.to_string());
                    certain = false;
                    continue;
                }
            };
            let (path, name) = (entry.path(), entry.file_name());
            if name.as_encoded_bytes().starts_with(b".") {
                continue;
            }
            let mesh = name.as_encoded_bytes().ends_with(b".uwm");
            let mut inner = Entry { name: String::new(), real: path.clone(), trail: folder.trail.clone() };
            let kind = if kind.is_symlink() {
                // What it leads to may change where this folder does not.
                certain = false;
                match target(root, links, &path).and_then(|real| Ok((fs::metadata(&real)?, real))) {
                    Ok((about, real)) => {
                        inner.trail.push(folder.real.clone());
                        inner.real = real;
                        about.file_type()
                    }
                    Err(error) => {
                        if mesh || error.kind() == io::ErrorKind::PermissionDenied {
                            self.leave_out(&path, &error.to_string());
                        }
                        continue;
                    }
                }
            } else {
                kind
            };
            if !(kind.is_dir() || kind.is_file() && mesh) {
                continue;
            }
            let Some(name) = name.to_str().map(|name| format!("{}{name}", folder.name)) else {
                self.leave_out(&path, "its name is not UTF-8");
                continue;
            };
            if kind.is_file() {
                match check_name(&name) {
                    Ok(()) => found(Found::Mesh(name)),
                    Err(what) => self.leave_out(&path, &format!("its name {what}")),
                }
            } else if inner.trail.iter().any(|passed| passed.starts_with(&inner.real)) {
                self.leave_out(&path, "a link that leads in a circle");
            } else if let Err(what) = check_name(&format!("{name}/x.uwm")) {
                self.leave_out(&path, &format!("its name {what}"));
            } else {
                inner.name = name + "/";
                found(Found::Folder(inner));
            }
        }
        Ok(certain)
    }

    fn leave_out(&mut self, path: &Path, why: &str) {
        // With its control characters escaped.
        let line = format!("{path:?}: {why}");
        if self.told.len() >= MOST_TOLD {
            self.told.clear();
        }
        if self.told.insert(line.clone()) {
            tracing::warn!("left out of the list: {line}");
        }
    }
}

enum Found {
    Mesh(String),
    Folder(Entry),
}

impl Found {
    fn bytes(&self) -> usize {
        OVERHEAD
            + match self {
                Self::Mesh(name) => name.len(),
                Self::Folder(entry) => entry.name.len() + entry.real.as_os_str().len(),
            }
    }
}

impl Entry {
    fn root(root: &Path) -> Self {
        Self { name: String::new(), real: root.to_owned(), trail: Vec::new() }
    }
}

/// When a folder changed last, and its number. Nothing where that was a moment ago: another change might have the same time.
fn stamp(folder: &Path) -> Option<Stamp> {
    let about = fs::metadata(folder).ok()?;
    let modified = about.modified().ok()?;
    let settled = SystemTime::now().duration_since(modified).is_ok_and(|age| age > MOMENT);
    settled.then(|| (modified, number(&about)))
}

#[cfg(unix)]
fn number(about: &Metadata) -> u128 {
    use std::os::unix::fs::MetadataExt;
    // Its permissions may have changed, or another one may have its place.
    (u128::from(about.ino()) << 64)
        ^ (u128::from(about.ctime() as u64) << 32)
        ^ u128::from(about.ctime_nsec() as u64)
}

#[cfg(not(unix))]
fn number(_: &Metadata) -> u128 {
    0
}

/// Memory for names.
const MOST_BYTES: usize = 32 << 20;
/// What a name takes beside its letters, about.
const OVERHEAD: usize = 64;
/// Folders that are compared in less than this are compared for every page; others again after so many times that they took.
const CHEAP: Duration = Duration::from_millis(5);
const RESTS: u32 = 10;
/// How coarse the time of a change may be.
const MOMENT: Duration = Duration::from_millis(2500);
const MOST_TOLD: usize = 1000;

#[cfg(test)]
mod tests {
    use super::*;

    fn all(index: &mut Index, root: &Path) -> Vec<String> {
        // As if time had passed.
        index.compared = None;
        index.page(root, false, "", usize::MAX).unwrap().0
    }

    /// Sets the time of the last change back, so that it can be told from that of another one.
    fn settle(folder: &Path) {
        let past = SystemTime::now() - Duration::from_secs(100);
        fs::File::open(folder).unwrap().set_modified(past).unwrap();
    }

    #[test]
    fn what_changes_is_seen() {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path().canonicalize().unwrap();
        let write = |name: &str| fs::write(root.join(name), "x").unwrap();
        fs::create_dir_all(root.join("b/c")).unwrap();
        for name in ["z.uwm", "b/y.uwm", "b/c/x.uwm", "a.uwm", "b.uwm", "b/no.txt", "b/.no.uwm"] {
            write(name);
        }
        let mut index = Index::default();
        for settled in [false, true] {
            assert_eq!(all(&mut index, &root), ["a.uwm", "b.uwm", "b/c/x.uwm", "b/y.uwm", "z.uwm"]);
            if settled {
                for name in ["", "b", "b/c"] {
                    settle(&root.join(name));
                }
                all(&mut index, &root);
                assert!(
                    index.folders.values().all(|known| known.stamp.is_some()),
                    "they need not be read again"
                );
            }
        }
        write("b/c/new.uwm");
        fs::remove_file(root.join("a.uwm")).unwrap();
        assert_eq!(all(&mut index, &root), ["b.uwm", "b/c/new.uwm", "b/c/x.uwm", "b/y.uwm", "z.uwm"]);
        fs::remove_dir_all(root.join("b/c")).unwrap();
        assert_eq!(all(&mut index, &root), ["b.uwm", "b/y.uwm", "z.uwm"]);
        assert_eq!(index.page(&root, false, "b.uwm", 1).unwrap(), (vec!["b/y.uwm".to_owned()], true));
        assert_eq!(index.page(&root, false, "b/y.uwm", 1).unwrap(), (vec!["z.uwm".to_owned()], false));
        assert_eq!(index.page(&root, false, "z.uwm", 1).unwrap(), (vec![], false));
        fs::remove_dir_all(&root).unwrap();
        index.compared = None;
        assert!(index.page(&root, false, "", 1).is_err());
    }

    #[test]
    fn looking_through_tells_the_same_and_keeps_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path().canonicalize().unwrap();
        for k in 0..50 {
            let inner = root.join(format!("{}", k % 7));
            fs::create_dir_all(&inner).unwrap();
            fs::write(inner.join(format!("{k}.uwm")), "x").unwrap();
        }
        let (mut kept, mut looked) = (Index::default(), Index::default());
        let mut after = String::new();
        let mut count = 0;
        loop {
            looked.large = true;
            let page = looked.page(&root, false, &after, 8).unwrap();
            assert_eq!(page, kept.page(&root, false, &after, 8).unwrap());
            assert!(looked.names.is_empty() && looked.folders.is_empty());
            count += page.0.len();
            if !page.1 {
                break;
            }
            after = page.0.last().unwrap().clone();
        }
        assert_eq!(count, 50);
    }
}
