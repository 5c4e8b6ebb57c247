//! Sets of meshes: the beginning of the file as it is, or the bytes that one member takes.

use super::super::failure::Usage;
use super::super::members;
use super::super::numbers::{count, of_diagonal};
use super::part::Wish;
use super::steps::Step;
use super::told::{Got, Of, Told};
use super::{Source, Wanted};
use anyhow::bail;
use serde_json::{Value, json};
use std::sync::Arc;
use unweld::client::{Begun, SetPiece, SetTransfer};
use unweld::container::SetContents;
use unweld::error::FormatError;
use unweld::{Error, Result};

/// Members that came.
pub struct Members {
    contents: Arc<SetContents>,
    /// In the order of the file; the last is the one that was wanted.
    numbers: Vec<u32>,
}

/// Fetches members of a set.
///
/// # Errors
/// Those of the server and of the file; where it has no such member, or what is wanted is nothing of a set.
pub async fn fetch(
    source: Begun<Source>,
    first: u64,
    wanted: Wanted,
    mut told: Told<'_>,
) -> anyhow::Result<Got> {
    if wanted.keyframe {
        return Err(Usage(
            "a set of meshes has no keyframes: --level J alone takes what member J needs".to_owned(),
        )
        .into());
    }
    let mut transfer = SetTransfer::new(source, first, |contents: &SetContents| wanted.members(contents));
    let Some(SetPiece::Head { contents, members: numbers, bytes }) = transfer.next().await? else {
        bail!("there is no table of the set");
    };
    let members = Members { contents, numbers };
    let (steps, diagonal) = (members.steps(), members.contents.members[0].contents.header.diagonal());
    let version = transfer.source().source().version();
    let line = members.head(&told.address);
    told.begin(&bytes, &version, &line)?;
    let (mut done, total) = (bytes.len() as u64, members.bytes());
    while let Some(piece) = transfer.next().await.map_err(|e| members.named(e))? {
        let SetPiece::Atom { member, index, offset, bytes } = piece else { continue };
        done += bytes.len() as u64;
        let place = members.numbers.iter().position(|&number| number == member);
        let step = place.and_then(|place| steps.get(place)).filter(|step| step.atoms.end == index + 1);
        told.atom(offset, &bytes, [done, total], step.map(|step| step.line(diagonal)))?;
    }
    told.end(Of::Set(members), steps, transfer.source().source())
}

/// Bytes of header and table of a set, and the atoms that are wanted of it.
///
/// # Errors
/// Where there is no such member.
pub fn wishes(contents: &SetContents, wanted: &Wanted) -> anyhow::Result<(u64, Vec<Wish>)> {
    let mut wishes = Vec::new();
    for number in wanted.members(contents)? {
        let member = &contents.members[number as usize];
        let shift = |at: u64| at - member.head.len() as u64 + member.bytes.start;
        for (index, atom) in member.contents.atoms.iter().enumerate() {
            let bytes = shift(atom.offset)..shift(atom.end());
            wishes.push(Wish { contents: member.contents.clone(), index, bytes });
        }
    }
    Ok((contents.head_end(), wishes))
}

impl Wanted {
    /// The members that are to come, in the order of the file: for a mesh those that it takes to have one; for the bytes as they are all up to that
    /// one, or all there are.
    fn members(&self, contents: &SetContents) -> Result<Vec<u32>> {
        if let (false, Some(most)) = (self.mesh, self.quality.max_bytes) {
            return Self::prefix(contents, most);
        }
        let number = members::wanted(contents, &self.quality);
        let last = contents.members.len() - 1;
        let chain = contents.chain(number);
        if chain.is_empty() {
            return Err(Error::Parameter(format!(
                "there is no member {number}: they are 0 (finest) to {last}"
            )));
        }
        if let Some(most) = self.quality.max_bytes.filter(|&most| contents.cost(number) > most) {
            let least = contents.cost(number);
            return Err(Error::Parameter(format!(
                "member {number} needs {least} bytes, --max-bytes allows {most}"
            )));
        }
        if self.mesh {
            return Ok(chain);
        }
        let mut order = contents.in_file_order();
        if !self.quality.is_all() {
            order.truncate(order.iter().position(|&other| other == number).map_or(0, |place| place + 1));
        }
        Ok(order)
    }

    /// The members that so many bytes of the file hold.
    fn prefix(contents: &SetContents, most: u64) -> Result<Vec<u32>> {
        let mut order = contents.in_file_order();
        let end = |number: u32| contents.members[number as usize].bytes.end;
        let first = order.first().copied().unwrap_or_default();
        order.retain(|&number| end(number) <= most);
        if order.is_empty() {
            let least = end(first);
            let what = format!("member {first}, the first, needs {least} bytes, --max-bytes allows {most}");
            return Err(Error::Parameter(what));
        }
        Ok(order)
    }
}

impl Members {
    /// The one that was wanted.
    pub fn wanted(&self) -> u32 {
        self.numbers.last().copied().unwrap_or_default()
    }

    /// Where they end in the file.
    pub fn end(&self) -> u64 {
        self.contents.members[self.wanted() as usize].bytes.end
    }

    /// Bytes of the whole file.
    pub fn file_bytes(&self) -> u64 {
        self.contents.file_bytes()
    }

    /// Bytes of header and table and of the members.
    fn bytes(&self) -> u64 {
        let first = self.numbers.first().copied().unwrap_or_default();
        self.contents.head_end() + self.end() - self.contents.members[first as usize].bytes.start
    }

    /// What there is, in words.
    pub fn reached(&self) -> String {
        let (number, last) = (self.wanted(), self.contents.members.len() - 1);
        let member = &self.contents.members[number as usize];
        let diagonal = member.contents.header.diagonal();
        let errors = [member.level().max_error, member.level().rms_error].map(|e| of_diagonal(e, diagonal));
        format!("member {number} of 0 to {last}, error at most {}, rms {}", errors[0], errors[1])
    }

    /// For programs.
    pub fn json(&self) -> Value {
        let number = self.wanted();
        let level = self.contents.members[number as usize].level();
        json!({
            "file_bytes": self.file_bytes(),
            "bytes": self.bytes(),
            "level": number,
            "members": self.numbers,
            "complete": true,
            "vertices": level.vertices,
            "triangles": level.triangles,
            "max_error": level.max_error,
        })
    }

    fn head(&self, address: &str) -> String {
        let order = if self.contents.finest_first { "the finest first" } else { "the coarsest first" };
        format!(
            "{address}: {}, a set of {}, {order}\n  table of the set: {}\n",
            count(self.file_bytes(), "byte"),
            count(self.contents.members.len() as u64, "mesh"),
            count(self.contents.head_end(), "byte"),
        )
    }

    fn steps(&self) -> Vec<Step> {
        let step = |&number: &u32| {
            let member = &self.contents.members[number as usize];
            let level = member.level();
            Step {
                what: format!("member {number}"),
                atoms: 0..member.contents.atoms.len(),
                bytes: member.bytes.end - member.bytes.start,
                mesh: Some((level.triangles, level.max_error)),
            }
        };
        self.numbers.iter().map(step).collect()
    }

    /// A damaged atom with the member that it is of.
    fn named(&self, error: Error) -> anyhow::Error {
        let Error::Format(FormatError { offset, .. }) = &error else { return error.into() };
        let member = self.numbers.iter().find(|&&j| self.contents.members[j as usize].bytes.contains(offset));
        match member {
            Some(number) => anyhow::Error::from(error).context(format!("member {number}")),
            None => error.into(),
        }
    }
}
