//! Several meshes on one lattice in one file: framing only (spec §15.1).
//!
//! What stands in the table for each member, with what all of them share, is the table of contents of a file of its own with one level.

#[cfg(any(test, feature = "encode"))]
use std::io::Write;
use std::ops::Range;
use std::sync::Arc;

use super::checksum;
use super::contents::{Contents, Level};
use super::fields::Fields;
use super::header::{Header, MAGIC, SET, Start, VERSION};
use super::parse_contents;
use super::table::{ORIGIN_SHORT, STEP_SHORT};
use super::want::{Measure, Want};
#[cfg(any(test, feature = "encode"))]
use crate::entropy::varint;
use crate::error::FormatError;
#[cfg(any(test, feature = "encode"))]
use crate::error::{Error, Result};
use crate::limits::{MAX_LEVELS, MAX_TABLE_BYTES};
use crate::mesh::lattice::Lattice;

/// What a set holds.
#[derive(Clone, Debug, PartialEq)]
pub struct SetContents {
    /// The members by number: 0 is the finest.
    pub members: Vec<Member>,
    /// Whether the finest stands first in the file; else the coarsest.
    pub finest_first: bool,
    /// Bytes of the table, its checksum included.
    pub table_bytes: u32,
}

/// One mesh of a set.
#[derive(Clone, Debug, PartialEq)]
pub struct Member {
    /// Those of the file of one level that it would be; offsets count in that one.
    pub contents: Arc<Contents>,
    /// Header and table of contents of that file; behind them come the member's bytes.
    pub head: Vec<u8>,
    /// Where its atoms stand in the file of the set.
    pub bytes: Range<u64>,
    /// Whether its vertices are told by those of the member before it in the file.
    pub leans: bool,
}

impl Member {
    /// Its only level.
    pub fn level(&self) -> &Level {
        &self.contents.levels[0]
    }
}

impl SetContents {
    /// What reading a set as one mesh says.
    pub const NO_MESH: &str = "a set of meshes, not one mesh";

    /// Whether it is what reading a set as one mesh says.
    pub fn is_fault_of_set(fault: &FormatError) -> bool {
        fault.section == "15.1" && fault.what == Self::NO_MESH
    }

    /// Whether a file that begins with these bytes is a set; their first 16 tell.
    pub fn is_set(start: &[u8]) -> bool {
        start.starts_with(&MAGIC) && start.get(11) == Some(&SET)
    }

    /// How long header and table are, by the first 16 bytes.
    ///
    /// # Errors
    /// [`FormatError`] where they are no header of a set.
    pub fn head_bytes(start: &[u8; Header::SIZE]) -> std::result::Result<usize, FormatError> {
        Start::check(start)?;
        let [.., order, _, zero, low, middle, high] = *start;
        let refuse = |at, what: &str| Err(FormatError::new(at, "15.1", what));
        if start[11] != SET {
            return refuse(11, "not a set of meshes");
        }
        if order > 1 {
            return refuse(10, "an unknown order of the members");
        }
        if zero != 0 {
            return refuse(12, "a set has no attributes of its own");
        }
        Ok(Header::SIZE + u32::from_le_bytes([low, middle, high, 0]) as usize)
    }

    /// The lattice that all members are on.
    pub fn lattice(&self) -> &Lattice {
        &self.members[0].contents.header.lattice
    }

    /// Bytes of the whole file.
    pub fn file_bytes(&self) -> u64 {
        self.members.iter().map(|member| member.bytes.end).max().unwrap_or(0)
    }

    /// Where header and table end and the first member begins.
    pub fn head_end(&self) -> u64 {
        Header::SIZE as u64 + u64::from(self.table_bytes)
    }

    /// The numbers of the members in the order of the file.
    pub fn in_file_order(&self) -> Vec<u32> {
        let numbers = 0..self.members.len() as u32;
        if self.finest_first { numbers.collect() } else { numbers.rev().collect() }
    }

    /// The members that it takes to have one, in the order of the file: itself is the last. Empty where there is none of this number.
    pub fn chain(&self, number: u32) -> Vec<u32> {
        let order = self.in_file_order();
        let Some(end) = order.iter().position(|&other| other == number) else { return Vec::new() };
        let leans = |k: &usize| self.members[order[*k] as usize].leans;
        let start = (0..=end).rev().find(|k| !leans(k)).unwrap_or(0);
        order[start..=end].to_vec()
    }

    /// The member that is what is wanted: the coarsest within an error, the finest of so many triangles or such that header, table and all that
    /// it takes are so many bytes; else the coarsest, of an error the finest.
    pub fn wanted(&self, want: Want) -> u32 {
        let last = self.members.len() as u32 - 1;
        let finest = |fits: &dyn Fn(u32) -> bool| (0..=last).find(|&j| fits(j)).unwrap_or(last);
        let level = |j: u32| self.members[j as usize].level();
        match want {
            Want::Level(number) => number.min(last),
            Want::All => 0,
            Want::Error(measure, most) => {
                (0..=last).rev().find(|&j| level(j).error(measure) <= most).unwrap_or(0)
            }
            Want::Triangles(most) => finest(&|j| level(j).triangles <= most),
            Want::Bytes(most) => finest(&|j| self.cost(j) <= most),
        }
    }

    /// Bytes of header, table and all members that it takes to have one.
    pub fn cost(&self, number: u32) -> u64 {
        let chain = self.chain(number);
        let length = |&j: &u32| self.members[j as usize].bytes.clone();
        let bytes: u64 = chain.iter().map(length).map(|run| run.end - run.start).sum();
        self.head_end() + bytes
    }

    /// The largest of the errors of the members by a measure, in the units of the input.
    pub fn largest_error(&self, measure: Measure) -> f64 {
        self.members.iter().map(|member| member.level().error(measure)).fold(0.0, f64::max)
    }
}

/// Reads header and table of a set from the start of a file, or `None` where `bytes` ends inside them.
///
/// # Errors
/// [`FormatError`] where a rule of spec §15.1 is broken, or one of §3 by what is told of a member.
pub fn parse_set(bytes: &[u8]) -> std::result::Result<Option<SetContents>, FormatError> {
    let Some(start) = bytes.first_chunk::<{ Header::SIZE }>() else {
        return Start::check(bytes).map(|()| None);
    };
    let length = SetContents::head_bytes(start)?;
    let Some(head) = bytes.get(..length) else { return Ok(None) };
    let Some((before, checksum)) =
        head.split_last_chunk::<4>().filter(|(rest, _)| rest.len() >= Header::SIZE)
    else {
        return Err(FormatError::new(13, "15.1", "the table has no room for its checksum"));
    };
    if checksum::append(0, before).to_le_bytes() != *checksum {
        return Err(FormatError::new(0, "3.4", "header and table of the set do not match their checksum"));
    }
    let at = Header::SIZE as u64;
    let mut fields = Fields::new(&before[Header::SIZE..], at, "15.1");
    let lattice = lattice_bytes(fields.left_bytes())
        .ok_or_else(|| FormatError::new(at, "15.1", "the lattice is cut off"))?;
    let lattice = fields.bytes(lattice)?;
    let place = fields.offset();
    let count = fields.count(MAX_LEVELS, "the number of members")?;
    fields.require(count >= 1, place, || "a set without members".to_owned())?;
    let (mut members, mut end) = (Vec::new(), length as u64);
    for k in 0..count {
        let entry = fields.offset();
        let marks = fields.u8()?;
        let known = marks == 0 || marks == LEANS && k > 0;
        fields.require(known, entry, || format!("member {k} of the file has the marks {marks}"))?;
        let attributes = fields.u8()?;
        let table = fields.count(MAX_TABLE_BYTES, "the length of a member's table")?;
        let told = fields.offset();
        let table = fields.bytes(table as usize)?;
        let head = head_of(lattice, attributes, table);
        let here = |fault: FormatError| {
            let offset = match fault.offset {
                own if own >= at + lattice.len() as u64 => own - at - lattice.len() as u64 + told,
                own if own >= at => own,
                _ => entry,
            };
            FormatError { offset, ..fault }
        };
        let contents = parse_contents(&head).map_err(here)?;
        let contents =
            contents.ok_or_else(|| fields.fault(told, "a member's table is cut off".to_owned()))?;
        let one = contents.levels.len();
        fields.require(one == 1, told, || format!("a member of {one} levels"))?;
        let bytes = contents.file_bytes() - contents.header.table_end();
        let next = end.checked_add(bytes);
        let next = next.ok_or_else(|| fields.fault(told, "a file of too many bytes".to_owned()))?;
        members.push(Member { contents, head, bytes: end..next, leans: marks == LEANS });
        end = next;
    }
    let place = fields.offset();
    fields.require(fields.left() == 0, place, || "bytes behind the last member".to_owned())?;
    let finest_first = start[10] == 1;
    if !finest_first {
        members.reverse();
    }
    Ok(Some(SetContents { members, finest_first, table_bytes: (length - Header::SIZE) as u32 }))
}

/// Writes a set of files that have one level and one lattice, the finest first in the list or, where `finest_first` is false, the last: in the
/// order of the file to be; each with whether its vertices are told by those of the one before it.
///
/// # Errors
/// [`Error::Parameter`] where these are no such files; [`Error::Io`] where `out` fails.
#[cfg(any(test, feature = "encode"))]
pub fn write_set(finest_first: bool, files: &[(Vec<u8>, bool)], out: &mut impl Write) -> Result<SetContents> {
    let refused = |what: &str| Error::Parameter(what.to_owned());
    let mut table = Vec::new();
    let mut atoms = Vec::with_capacity(files.len());
    for (file, leans) in files {
        let contents = parse_contents(file).map_err(|fault| Error::Parameter(fault.what))?;
        let contents = contents.ok_or_else(|| refused("a member is cut off"))?;
        let (head, rest) = file.split_at(contents.header.table_end() as usize);
        let own = &head[Header::SIZE..head.len() - 4];
        let (lattice, own) = own.split_at(lattice_bytes(own).unwrap_or(0));
        if head[10..12] != [0, 0] {
            return Err(refused("a member that is lifted or has rich models"));
        }
        if atoms.is_empty() {
            table.extend_from_slice(lattice);
            varint::write(files.len() as u64, &mut table);
        } else if !table.starts_with(lattice) {
            return Err(refused("members on different lattices"));
        }
        table.extend([if *leans { LEANS } else { 0 }, head[12]]);
        varint::write(own.len() as u64, &mut table);
        table.extend_from_slice(own);
        atoms.push(rest);
    }
    let length = u32::try_from(table.len() + 4).ok().filter(|&length| length <= MAX_TABLE_BYTES);
    let length = length.ok_or_else(|| refused("a table of too many bytes"))?;
    let mut head = MAGIC.to_vec();
    head.extend(VERSION.to_le_bytes());
    head.extend([u8::from(finest_first), SET, 0]);
    head.extend(&length.to_le_bytes()[..3]);
    head.extend(table);
    head.extend(checksum::append(0, &head).to_le_bytes());
    let set = parse_set(&head).map_err(|fault| Error::Parameter(fault.what))?;
    let set = set.ok_or_else(|| refused("a set without members"))?;
    out.write_all(&head)?;
    for bytes in atoms {
        out.write_all(bytes)?;
    }
    out.flush()?;
    Ok(set)
}

/// Header and table of the file that a member would be.
fn head_of(lattice: &[u8], attributes: u8, table: &[u8]) -> Vec<u8> {
    let length = (lattice.len() + table.len() + 4) as u32;
    let mut head = Vec::with_capacity(Header::SIZE + length as usize);
    head.extend(MAGIC);
    head.extend(VERSION.to_le_bytes());
    head.extend([0, 0, attributes]);
    head.extend(&length.to_le_bytes()[..3]);
    head.extend(lattice);
    head.extend(table);
    head.extend(checksum::append(0, &head).to_le_bytes());
    head
}

/// How many bytes the lattice takes at the front of a table, if all of them are there.
fn lattice_bytes(table: &[u8]) -> Option<usize> {
    let form = *table.first()?;
    let [origin, step] = [ORIGIN_SHORT, STEP_SHORT].map(|short| if form & short > 0 { 4 } else { 8 });
    let mut end = 1 + 3 * origin + step;
    for _ in 0..3 {
        let rest = table.get(end..)?;
        end += 1 + rest.iter().position(|byte| byte & 128 == 0)?;
    }
    Some(end)
}

/// The mark of a member whose vertices are told by those of the one before it.
const LEANS: u8 = 1;
