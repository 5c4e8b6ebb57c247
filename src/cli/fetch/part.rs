//! What has come of a file so far: `OUT.part`, each atom at its place in the file, and `OUT.part.json`, which tells of what version.

use super::super::output::Output;
use super::super::replace::{self, Replacement, keep_access};
use super::super::uwm::Uwm;
use anyhow::{Context, bail};
use serde_json::{Value, json};
use std::fs::{self, File};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use unweld::client::Version;
use unweld::container::Contents;

/// A file that is to become another one once all of it is there.
pub struct Part {
    /// Where it is to go, and where it lies until then; `None` for a file without a name, which goes with the process.
    paths: Option<[PathBuf; 3]>,
    file: File,
    /// What it is called in messages.
    pub name: String,
}

/// An atom that is wanted.
pub struct Wish {
    /// Of the mesh that it is of.
    pub contents: Arc<Contents>,
    /// Its place there.
    pub index: usize,
    /// Where it stands in the file.
    pub bytes: Range<u64>,
}

/// What a part has of what is wanted.
pub struct Held {
    /// Of which version it is.
    pub version: Version,
    /// Bytes that are sound, in the order in which they came.
    pub sound: Vec<Range<u64>>,
}

impl Part {
    /// Opens the part of an output, or begins one; nobody else may have it open.
    ///
    /// # Errors
    /// Those of the medium; where another process has it, or where it is a file of somebody else.
    pub fn open(output: &Output) -> anyhow::Result<Self> {
        let Some(target) = output.target() else {
            let file = tempfile::tempfile().context("temporary file")?;
            return Ok(Self { paths: None, file, name: "temporary file".to_owned() });
        };
        let beside = |end: &str| {
            let mut name = target.as_os_str().to_owned();
            name.push(end);
            PathBuf::from(name)
        };
        let paths = [target.to_owned(), beside(".part"), beside(".part.json")];
        let name = paths[1].display().to_string();
        let file = lock(&paths[1]).with_context(|| name.clone())?;
        // Nobody may read it who may not read what it replaces.
        keep_access(&file, target).with_context(|| name.clone())?;
        let part = Self { paths: Some(paths), file, name };
        if part.length()? > 0 && part.note().is_none() {
            bail!("{}: this file is in the way, and nothing tells what it is part of", part.name);
        }
        Ok(part)
    }

    /// Its file, for reading.
    pub fn reader(&self) -> anyhow::Result<File> {
        self.file.try_clone().with_context(|| self.name.clone())
    }

    /// Whether the same command can go on with it later.
    pub fn stays(&self) -> bool {
        self.paths.is_some()
    }

    /// Bytes that it takes.
    pub fn length(&self) -> anyhow::Result<u64> {
        Ok(self.file.metadata().with_context(|| self.name.clone())?.len())
    }

    /// What it has of what is wanted of the file at `address`: bytes of header and table, and the atoms in the order in which they come, which `wanted`
    /// tells. The last atom is left out: it is asked for again, to hear whether the version is still there. Looking at it may take so many bytes of `memory`.
    pub fn held(
        &mut self,
        address: &str,
        memory: u64,
        wanted: impl FnOnce(&mut Uwm) -> anyhow::Result<(u64, Vec<Wish>)>,
    ) -> Option<Held> {
        let note = self.note()?;
        let text = |name: &str| note[name].as_str().map(str::to_owned);
        if text("address").as_deref() != Some(address) {
            return None;
        }
        let version = Version { tag: text("tag"), modified: text("modified"), bytes: note["bytes"].as_u64() };
        let mut uwm = Uwm::of_file(self.reader().ok()?, &self.name, memory).ok()?;
        let (head, wishes) = wanted(&mut uwm).ok()?;
        let mut sound: Vec<Range<u64>> = std::iter::once(0..head).collect();
        let mut last = None;
        for wish in wishes {
            if self.read_atom(&wish).is_none() {
                break;
            }
            sound.extend(last.replace(wish.bytes));
        }
        Some(Held { version, sound: joined(sound) })
    }

    fn read_atom(&mut self, wish: &Wish) -> Option<()> {
        let mut bytes = vec![0; usize::try_from(wish.bytes.end - wish.bytes.start).ok()?];
        self.file.seek(SeekFrom::Start(wish.bytes.start)).ok()?;
        self.file.read_exact(&mut bytes).ok()?;
        wish.contents.check(wish.index, &bytes).ok()
    }

    /// Writes down of which version its bytes will be.
    ///
    /// # Errors
    /// Those of the medium.
    pub fn begin(&mut self, address: &str, version: &Version) -> anyhow::Result<()> {
        let Some([_, part, note]) = &self.paths else { return Ok(()) };
        let Version { tag, modified, bytes } = version;
        let object = json!({ "address": address, "tag": tag, "modified": modified, "bytes": bytes });
        let write = || {
            let mut file = Replacement::new(note)?;
            keep_access(file.file(), part)?;
            writeln!(file.file(), "{object:#}")?;
            file.finish()
        };
        write().with_context(|| note.display().to_string())
    }

    /// Puts bytes in their place.
    ///
    /// # Errors
    /// Those of the medium.
    pub fn write(&mut self, offset: u64, bytes: &[u8]) -> anyhow::Result<()> {
        let mut write = || {
            self.file.seek(SeekFrom::Start(offset))?;
            self.file.write_all(bytes)
        };
        write().with_context(|| self.name.clone())
    }

    /// Throws away what is there.
    ///
    /// # Errors
    /// Those of the medium.
    pub fn clear(&mut self) -> anyhow::Result<()> {
        self.file.set_len(0).with_context(|| self.name.clone())?;
        if let Some([_, _, note]) = &self.paths {
            let _ = fs::remove_file(note);
        }
        Ok(())
    }

    /// Gives its first `length` bytes the name of the output.
    ///
    /// # Errors
    /// Those of the medium.
    pub fn finish(self, length: u64) -> anyhow::Result<()> {
        let Some([target, part, note]) = &self.paths else { return Ok(()) };
        let rename = || {
            self.file.set_len(length)?;
            replace::rename(&self.file, part, target)
        };
        rename().with_context(|| target.display().to_string())?;
        let _ = fs::remove_file(note);
        Ok(())
    }

    /// Removes it.
    pub fn remove(self) {
        if let Some([_, part, note]) = &self.paths {
            let _ = (fs::remove_file(part), fs::remove_file(note));
        }
    }

    fn note(&self) -> Option<Value> {
        let [_, _, note] = self.paths.as_ref()?;
        serde_json::from_slice(&fs::read(note).ok()?).ok()
    }
}

/// Opens a file for this process alone.
fn lock(path: &Path) -> io::Result<File> {
    loop {
        let file = fs::OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path)?;
        #[cfg(unix)]
        {
            use rustix::fs::{FlockOperation, flock};
            use std::os::unix::fs::MetadataExt;
            if flock(&file, FlockOperation::NonBlockingLockExclusive).is_err() {
                return Err(io::Error::other("another unweld is at work on it"));
            }
            // Whoever had it before may have renamed it meanwhile.
            let (ours, there) = (file.metadata()?, fs::metadata(path));
            if !there.is_ok_and(|there| (there.ino(), there.dev()) == (ours.ino(), ours.dev())) {
                continue;
            }
        }
        return Ok(file);
    }
}

/// Ranges that follow each other as one.
fn joined(ranges: Vec<Range<u64>>) -> Vec<Range<u64>> {
    let mut joined: Vec<Range<u64>> = Vec::new();
    for range in ranges {
        match joined.last_mut() {
            Some(last) if last.end == range.start => last.end = range.end,
            _ => joined.push(range),
        }
    }
    joined
}
