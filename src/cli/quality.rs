//! How much of a `.uwm` file is wanted: the options that commands share.

use super::args::{Bound, Tolerance, bound, size};
use unweld::container::{Contents, Want};
use unweld::{Error, Result};

/// How much is wanted; everything, where nothing is said.
#[derive(Clone, Copy, Debug, Default, clap::Args)]
#[group(multiple = false)]
pub struct Quality {
    /// Level J, from 0, the finest, to the base's, which `info` tells; of a set, member J
    #[arg(long, visible_alias = "member", value_name = "J")]
    pub level: Option<u32>,
    /// As fine as possible with at most N triangles, 0 or more; the base at least
    #[arg(long, visible_alias = "faces", value_name = "N")]
    pub triangles: Option<u32>,
    /// The coarsest level with at most this error, 0 or more: a length, or a part of the diagonal such as 0.5%. It bounds the largest
    /// distance, so that nothing lies farther off; with rms: before it (rms:0.5%), the root mean square, which is often met by far
    /// fewer bytes
    #[arg(long, value_name = "[rms:|max:]E", value_parser = bound)]
    pub error: Option<Bound>,
    /// What the first B bytes of the file hold, in whole atoms; those of the base at least
    #[arg(long, visible_alias = "prefix-bytes", value_name = "B", value_parser = size)]
    pub max_bytes: Option<u64>,
}

impl Quality {
    /// Whether everything is wanted.
    pub fn is_all(&self) -> bool {
        matches!(self, Self { level: None, triangles: None, error: None, max_bytes: None })
    }

    /// What that is of a file; `diagonal` is asked for where an error is a part of it.
    ///
    /// # Errors
    /// [`Error::Parameter`] where the file has no such level, or a base of more bytes; those of `diagonal`.
    pub fn want(&self, contents: &Contents, diagonal: impl FnOnce() -> f64) -> Result<Want> {
        let (base, least) = (contents.base_level(), contents.base_end());
        Ok(match *self {
            Self { level: Some(level), .. } if level > base => {
                let what = format!("there is no level {level}: the levels are 0 (finest) to {base} (base)");
                return Err(Error::Parameter(what));
            }
            Self { level: Some(level), .. } => Want::Level(level),
            Self { triangles: Some(most), .. } => Want::Triangles(most),
            Self { error: Some(Bound { measure, most }), .. } => match most {
                Tolerance::Absolute(most) => Want::Error(measure, most),
                Tolerance::Percent(percent) => Want::Error(measure, percent / 100.0 * diagonal()),
            },
            Self { max_bytes: Some(most), .. } if most < least => {
                let what = format!("the base needs {least} bytes, --max-bytes allows {most}");
                return Err(Error::Parameter(what));
            }
            Self { max_bytes: Some(most), .. } => Want::Bytes(most),
            _ => Want::All,
        })
    }
}
