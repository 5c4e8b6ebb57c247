//! A folder as a place of meshes, or one file as a place of its own. A name leads to a file inside; where a link leads out, there is nothing,
//! unless links may.

use std::fs::{self, File, OpenOptions};
use std::io;
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

use tokio::sync::Mutex;

use super::index::Index;
use super::{Fault, check_name, fault_of};
use crate::error::{Error, Result};

/// A folder; a clone is the same one.
#[derive(Clone, Debug)]
pub struct Folder {
    root: PathBuf,
    /// The only name there is, where one file was opened.
    only: Option<String>,
    links: bool,
    index: Arc<Mutex<Index>>,
}

impl Folder {
    /// The folder at a path, or the `.uwm` file.
    ///
    /// # Errors
    /// [`Error::Io`] where it cannot be read, [`Error::Parameter`] where it is neither.
    pub fn new(location: &str) -> Result<Self> {
        let about = fs::metadata(location)?;
        if about.is_dir() {
            let root = fs::canonicalize(location)?;
            return Ok(Self { root, only: None, links: false, index: Arc::default() });
        }
        if !about.is_file() || !location.ends_with(".uwm") {
            return Err(Error::Parameter("neither a folder nor a .uwm file".to_owned()));
        }
        let path = Path::new(location);
        let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        check_name(&name).map_err(|what| Error::Parameter(format!("the name {what}")))?;
        let parent = path.parent().filter(|parent| !parent.as_os_str().is_empty());
        let root = fs::canonicalize(parent.unwrap_or(Path::new(".")))?;
        // Whoever names a link means what it leads to.
        Ok(Self { root, only: Some(name), links: true, index: Arc::default() })
    }

    /// The same, where links may lead anywhere.
    pub fn with_links(self) -> Self {
        Self { links: true, index: Arc::default(), ..self }
    }

    /// What a file is known by, beside its version.
    pub fn path(&self, name: &str) -> PathBuf {
        self.root.join(name)
    }

    /// Opens what lies under a name.
    ///
    /// # Errors
    /// Those of the system; [`io::ErrorKind::NotFound`] also for a name that leads out.
    pub fn file(&self, name: &str) -> io::Result<File> {
        let inside = Path::new(name).components().all(|part| matches!(part, Component::Normal(_)));
        if !inside || self.only.as_ref().is_some_and(|only| only != name) {
            return Err(io::ErrorKind::NotFound.into());
        }
        if self.links {
            return read(&self.root.join(name));
        }
        #[cfg(target_os = "linux")]
        if let Some(outcome) = beneath(&self.root, name) {
            return outcome;
        }
        within(&self.root, name)
    }

    /// Up to `limit` names behind `after`, sorted, and whether there are more.
    ///
    /// # Errors
    /// [`Fault`], where the folder itself cannot be read.
    pub async fn names(&self, after: &str, limit: usize) -> std::result::Result<(Vec<String>, bool), Fault> {
        if let Some(only) = &self.only {
            let there = only.as_str() > after && limit > 0 && self.file(only).is_ok();
            return Ok((there.then(|| only.clone()).into_iter().collect(), false));
        }
        // One looks through the folder at a time; the others have the use of it.
        let mut index = self.index.clone().lock_owned().await;
        let (root, links, after) = (self.root.clone(), self.links, after.to_owned());
        let looking = tokio::task::spawn_blocking(move || index.page(&root, links, &after, limit));
        looking.await.map_err(|e| Fault::Unavailable(e.to_string()))?.map_err(fault_of)
    }
}

/// Where a path leads, if it may: out of `root` only where links may.
///
/// # Errors
/// Those of the system, such as that links lead in a circle; [`io::ErrorKind::PermissionDenied`] where it leads out.
pub fn target(root: &Path, links: bool, path: &Path) -> io::Result<PathBuf> {
    let real = path.canonicalize()?;
    if links || real.starts_with(root) {
        return Ok(real);
    }
    Err(io::Error::new(io::ErrorKind::PermissionDenied, "a link that leads out of the folder"))
}

fn read(path: &Path) -> io::Result<File> {
    let mut options = OpenOptions::new();
    options.read(true);
    #[cfg(unix)]
    {
        use std::os::unix::fs::OpenOptionsExt;
        // A pipe that nobody writes to would hold up the opening; of files this changes nothing.
        options.custom_flags(rustix::fs::OFlags::NONBLOCK.bits() as i32);
    }
    options.open(path)
}

/// Opens what is beneath the folder at every step, as the system sees to. `None` where a link names its target from the root of the system, which
/// may yet be inside, or where the system cannot do it.
#[cfg(target_os = "linux")]
fn beneath(root: &Path, name: &str) -> Option<io::Result<File>> {
    use rustix::fs::{CWD, Mode, OFlags, ResolveFlags, openat, openat2};
    use rustix::io::Errno;
    let folder = match openat(CWD, root, OFlags::PATH | OFlags::DIRECTORY | OFlags::CLOEXEC, Mode::empty()) {
        Ok(folder) => folder,
        Err(error) => return Some(Err(error.into())),
    };
    let flags = OFlags::RDONLY | OFlags::NONBLOCK | OFlags::CLOEXEC;
    match openat2(folder, name, flags, Mode::empty(), ResolveFlags::BENEATH | ResolveFlags::NO_MAGICLINKS) {
        Ok(file) => Some(Ok(file.into())),
        Err(Errno::XDEV | Errno::AGAIN | Errno::NOSYS | Errno::PERM | Errno::INVAL) => None,
        Err(error) => Some(Err(error.into())),
    }
}

/// Opens what really lies inside the folder, and sees afterwards that it still does: what was opened is what lies there.
fn within(root: &Path, name: &str) -> io::Result<File> {
    let root = root.canonicalize()?;
    let absent = |_| io::Error::from(io::ErrorKind::NotFound);
    let real = target(&root, false, &root.join(name)).map_err(|e| match e.kind() {
        io::ErrorKind::PermissionDenied => absent(e),
        _ => e,
    })?;
    let file = read(&real)?;
    // A part of the path may have become a link in between.
    let still = real.canonicalize()? == real && same(&file.metadata()?, &fs::symlink_metadata(&real)?);
    if still { Ok(file) } else { Err(io::ErrorKind::NotFound.into()) }
}

#[cfg(unix)]
fn same(one: &fs::Metadata, other: &fs::Metadata) -> bool {
    use std::os::unix::fs::MetadataExt;
    (one.dev(), one.ino()) == (other.dev(), other.ino())
}

#[cfg(not(unix))]
fn same(one: &fs::Metadata, other: &fs::Metadata) -> bool {
    !other.is_symlink() && one.len() == other.len()
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use std::io::Read;
    use std::os::unix::fs::symlink;

    /// Both ways to open, on the same links.
    #[test]
    fn links_lead_to_what_is_inside() {
        let place = tempfile::tempdir().unwrap();
        let place = place.path().canonicalize().unwrap();
        let root = place.join("in");
        fs::create_dir_all(root.join("sub")).unwrap();
        fs::write(place.join("out.uwm"), "out").unwrap();
        fs::write(root.join("sub/a.uwm"), "inside").unwrap();
        symlink("sub/a.uwm", root.join("relative.uwm")).unwrap();
        symlink(root.join("sub/a.uwm"), root.join("absolute.uwm")).unwrap();
        symlink("sub", root.join("folder")).unwrap();
        symlink("../in/sub/a.uwm", root.join("out_and_in.uwm")).unwrap();
        symlink("../out.uwm", root.join("out.uwm")).unwrap();
        symlink(place.join("out.uwm"), root.join("far.uwm")).unwrap();
        symlink("relative.uwm", root.join("twice.uwm")).unwrap();
        symlink("out.uwm", root.join("twice_out.uwm")).unwrap();
        symlink("..", root.join("up")).unwrap();
        symlink("loop.uwm", root.join("loop.uwm")).unwrap();
        let folder = Folder::new(root.to_str().unwrap()).unwrap();
        let text = |file: io::Result<File>| {
            let mut text = String::new();
            file.ok()?.read_to_string(&mut text).ok()?;
            Some(text)
        };
        for name in
            ["sub/a.uwm", "relative.uwm", "absolute.uwm", "folder/a.uwm", "out_and_in.uwm", "twice.uwm"]
        {
            assert_eq!(text(folder.file(name)).as_deref(), Some("inside"), "{name}");
            assert_eq!(text(within(&root, name)).as_deref(), Some("inside"), "{name}");
        }
        for name in [
            "out.uwm",
            "far.uwm",
            "twice_out.uwm",
            "up/out.uwm",
            "loop.uwm",
            "../out.uwm",
            "/etc/passwd",
            "none.uwm",
        ] {
            assert!(folder.file(name).is_err(), "{name}");
            assert!(within(&root, name).is_err() || name.starts_with('/'), "{name}");
        }
        let folder = folder.with_links();
        for name in ["out.uwm", "far.uwm", "twice_out.uwm", "up/out.uwm"] {
            assert_eq!(text(folder.file(name)).as_deref(), Some("out"), "{name}");
        }
        assert!(folder.file("../out.uwm").is_err(), "a name does not lead out in any case");
    }
}
