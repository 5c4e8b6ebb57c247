//! Replacing a file: all of it or nothing, and open to those to whom it was open before.

use super::signals::Unfinished;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use tempfile::{Builder, NamedTempFile};

/// What is to replace a file, in the same folder under another name; gone if it is not finished.
pub struct Replacement {
    file: NamedTempFile,
    target: PathBuf,
    _unfinished: Unfinished,
}

impl Replacement {
    /// An empty one for `target`, which may not be there yet.
    ///
    /// # Errors
    /// Those of the medium, without the other name.
    pub fn new(target: &Path) -> io::Result<Self> {
        let folder = folder(target);
        fs::metadata(folder)?;
        let mut builder = Builder::new();
        builder.prefix(".unweld-");
        #[cfg(unix)]
        if fs::metadata(target).is_err() {
            use std::os::unix::fs::PermissionsExt;
            // As the user's settings have it; what replaces a file is closed to others until it has that one's mode.
            builder.permissions(fs::Permissions::from_mode(0o666));
        }
        let (file, unfinished) =
            Unfinished::make(|| builder.tempfile_in(folder).map_err(plain), NamedTempFile::path)?;
        Ok(Self { file, target: target.to_owned(), _unfinished: unfinished })
    }

    /// To write to. Its errors do not tell the other name.
    pub fn file(&mut self) -> &mut File {
        self.file.as_file_mut()
    }

    /// Puts it in its place, on the disk.
    ///
    /// # Errors
    /// Those of the medium; the older file is still there, unless it is its folder that cannot be written to the disk.
    pub fn finish(self) -> io::Result<()> {
        keep_access(self.file.as_file(), &self.target)?;
        flush(self.file.as_file())?;
        self.file.persist(&self.target).map_err(|e| plain(e.error))?;
        flush_folder(&self.target)
    }
}

/// Sees whether a file can be made or replaced, before any work is done for it. Bits of its mode that forbid writing count for everybody.
///
/// # Errors
/// Where it cannot.
pub fn check(target: &Path) -> io::Result<()> {
    match fs::metadata(target) {
        Ok(there) if there.is_dir() => return Err(io::ErrorKind::IsADirectory.into()),
        Ok(there) if there.permissions().readonly() => {
            return Err(io::Error::new(io::ErrorKind::PermissionDenied, "it is write-protected"));
        }
        Ok(_) => drop(fs::OpenOptions::new().write(true).open(target)?),
        Err(error) if error.kind() == io::ErrorKind::NotFound => {}
        Err(error) => return Err(error),
    }
    Replacement::new(target).map(drop)
}

/// Renames a finished file to `target`, on the disk, open to those to whom that was.
///
/// # Errors
/// Those of the medium.
pub fn rename(file: &File, from: &Path, target: &Path) -> io::Result<()> {
    keep_access(file, target)?;
    flush(file)?;
    fs::rename(from, target)?;
    flush_folder(target)
}

/// Gives a file the mode of another one and, as far as the system lets this process, its owner and group.
///
/// # Errors
/// Those of the medium.
#[cfg(unix)]
pub fn keep_access(file: &File, of: &Path) -> io::Result<()> {
    use std::os::unix::fs::{MetadataExt, PermissionsExt, fchown};
    let (Ok(old), new) = (fs::metadata(of), file.metadata()?) else { return Ok(()) };
    if old.uid() != new.uid() {
        let _ = fchown(file, Some(old.uid()), None);
    }
    // Set-user-id and its like do not survive other content, as the system has it, too.
    let mut mode = old.mode() & 0o777;
    if old.gid() != new.gid() && fchown(file, None, Some(old.gid())).is_err() {
        // It is another group now: it may what all others may.
        mode = mode & 0o707 | (mode & 0o007) << 3;
    }
    if mode == new.mode() & 0o777 {
        return Ok(());
    }
    file.set_permissions(fs::Permissions::from_mode(mode))
}

#[cfg(not(unix))]
pub fn keep_access(_: &File, _: &Path) -> io::Result<()> {
    Ok(())
}

/// Where a path leads to: its links followed, also to what is not there yet.
///
/// # Errors
/// Where links lead in a circle.
pub fn followed(path: &Path) -> io::Result<PathBuf> {
    let mut path = path.to_owned();
    for _ in 0..MOST_LINKS {
        match fs::read_link(&path) {
            Ok(next) => path = folder(&path).join(next),
            Err(_) => return Ok(path),
        }
    }
    Err(io::Error::other("too many links, or a circle of them"))
}

fn folder(path: &Path) -> &Path {
    path.parent().filter(|folder| *folder != Path::new("")).unwrap_or(Path::new("."))
}

fn flush(file: &File) -> io::Result<()> {
    match file.sync_all() {
        // Not every file system can.
        Err(e) if matches!(e.kind(), io::ErrorKind::InvalidInput | io::ErrorKind::Unsupported) => Ok(()),
        outcome => outcome,
    }
}

/// A name is on the disk once its folder is.
fn flush_folder(path: &Path) -> io::Result<()> {
    if cfg!(unix) { File::open(folder(path)).map_or(Ok(()), |folder| flush(&folder)) } else { Ok(()) }
}

/// What the system said, without the other name.
fn plain(error: io::Error) -> io::Error {
    if error.get_ref().is_some() { error.kind().into() } else { error }
}

/// As many as Linux follows.
const MOST_LINKS: u32 = 40;
