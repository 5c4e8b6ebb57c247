//! Foreign meshes, from a file or from standard input.

use super::args::is_stream;
use anyhow::Context;
use std::io::Read;
use std::path::Path;
use unweld::formats::{self, Format, Source};

/// What a path is called in messages.
pub fn name(path: &Path) -> String {
    if is_stream(path) { "standard input".to_owned() } else { path.display().to_string() }
}

/// The last part of a path, for the metadata: where a file lay is nobody's business.
pub fn file_name(path: &Path) -> String {
    path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned())
}

/// Reads a mesh; its name tells the format, or else its content.
///
/// # Errors
/// Those of the medium and of the reader, with the name of the file.
pub fn read(path: &Path) -> anyhow::Result<Source> {
    let bytes = read_bytes(path)?;
    formats::read_bytes(&bytes, Format::from_path(path), "").with_context(|| name(path))
}

/// All bytes of a file or of standard input.
///
/// # Errors
/// Those of the medium, with the name of the file.
pub fn read_bytes(path: &Path) -> anyhow::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let outcome = if is_stream(path) {
        std::io::stdin().lock().read_to_end(&mut bytes)
    } else {
        std::fs::File::open(path).and_then(|mut file| file.read_to_end(&mut bytes))
    };
    outcome.with_context(|| name(path))?;
    Ok(bytes)
}
