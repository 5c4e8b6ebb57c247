//! What a request asks for, and what of it there is: names, queries, conditions, ranges (spec §12). Headers and queries are all this
//! file knows of HTTP.

use std::ops::Range;

use axum::http::{HeaderMap, StatusCode, header};
use headers::{ETag, HeaderMapExt, IfMatch, IfModifiedSince, IfNoneMatch, IfUnmodifiedSince};
use http_range_header::{EndPosition, StartPosition, parse_range_header};

use super::library::Unreadable;
use crate::container::{Contents, Measure, SetContents, Want, plan};
use crate::store::{Fault, Version, check_name};

/// Why a request is not answered as it was meant.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Refusal {
    /// As whom to blame.
    pub status: StatusCode,
    /// The part of the request that is at fault, where one is.
    pub field: Option<String>,
    /// What is wrong, in words.
    pub detail: String,
}

impl Refusal {
    /// No part of the request in particular is at fault.
    pub fn new(status: StatusCode, detail: impl Into<String>) -> Self {
        Self { status, field: None, detail: detail.into() }
    }

    fn field(name: &str, what: impl std::fmt::Display) -> Self {
        Self {
            status: StatusCode::BAD_REQUEST,
            field: Some(name.to_owned()),
            detail: format!("{name}: {what}"),
        }
    }
}

impl From<Fault> for Refusal {
    fn from(fault: Fault) -> Self {
        let status = match fault {
            Fault::Absent => StatusCode::NOT_FOUND,
            Fault::Refused(_) => StatusCode::BAD_GATEWAY,
            Fault::Changed | Fault::Unavailable(_) => StatusCode::SERVICE_UNAVAILABLE,
        };
        Self::new(status, fault.to_string())
    }
}

impl From<Unreadable> for Refusal {
    fn from(unreadable: Unreadable) -> Self {
        match unreadable {
            Unreadable::Store(fault) => fault.into(),
            Unreadable::Format(fault) if SetContents::is_fault_of_set(&fault) => {
                Self::new(StatusCode::NOT_FOUND, OF_SET)
            }
            Unreadable::Format(fault) => Self::new(StatusCode::INTERNAL_SERVER_ERROR, fault.to_string()),
        }
    }
}

/// What is wanted of a mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Target {
    /// Its bytes as they are.
    File,
    /// What is in it.
    Levels,
    /// Some of its atoms.
    Refine,
    /// The keyframe of a level, or the base.
    Keyframe(u32),
}

impl Target {
    /// Names of the queries it understands.
    pub fn queries(self) -> &'static [&'static str] {
        match self {
            Self::Refine => {
                &["v", "from", "after", "to", "max_error", "rms_error", "max_bytes", "triangles", "faces"]
            }
            _ => &["v"],
        }
    }
}

/// The name of the mesh and what is wanted of it, from what stands behind `/meshes/` in a path.
///
/// # Errors
/// [`Refusal`] where no mesh can have the name, or where nothing of the kind can be wanted.
pub fn target(path: &str) -> Result<(String, Target), Refusal> {
    let part = |raw| {
        let decoded = percent_encoding::percent_decode_str(raw).decode_utf8();
        let decoded = decoded.map_err(|_| Refusal::field("name", "is not UTF-8"))?;
        if decoded.contains('/') {
            return Err(Refusal::field("name", "has an encoded slash"));
        }
        Ok(decoded.into_owned())
    };
    let parts = path.split('/').map(part).collect::<Result<Vec<String>, _>>()?;
    let parts: Vec<&str> = parts.iter().map(String::as_str).collect();
    let (name, target) = match &parts[..] {
        [.., last] if last.ends_with(".uwm") => (parts.join("/"), Target::File),
        [name @ .., "levels"] => (name.join("/") + ".uwm", Target::Levels),
        [name @ .., "refine"] => (name.join("/") + ".uwm", Target::Refine),
        [name @ .., "keyframe", level] => {
            let level = level.parse().map_err(|_| Refusal::field("level", "is not the number of a level"))?;
            (name.join("/") + ".uwm", Target::Keyframe(level))
        }
        _ => {
            // A name that cannot be is told before a route that is none.
            check_name(&(parts.join("/") + ".uwm")).map_err(|what| Refusal::field("name", what))?;
            let what = "a mesh has NAME.uwm, NAME/levels, NAME/refine and NAME/keyframe/J";
            return Err(Refusal::new(StatusCode::NOT_FOUND, what));
        }
    };
    check_name(&name).map_err(|what| Refusal::field("name", what))?;
    Ok((name, target))
}

/// The values of a query.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Query {
    /// The only version that is wanted.
    pub version: Option<String>,
    /// The level that the client holds.
    pub from: Option<u32>,
    /// The last atom that the client has.
    pub after: Option<usize>,
    /// How far it wants to come; bytes are counted from where the answer begins.
    pub want: Want,
    /// Where a list goes on.
    pub names_after: Option<String>,
    /// Most entries of a list.
    pub limit: Option<usize>,
}

impl Query {
    /// Reads a query that may have these names.
    ///
    /// # Errors
    /// [`Refusal`] for a name that is unknown or there twice, a value that cannot be, and wants that contradict each other.
    pub fn parse(text: Option<&str>, known: &[&str]) -> Result<Self, Refusal> {
        let mut query = Self::default();
        let mut seen: Vec<String> = Vec::new();
        for (name, value) in url::form_urlencoded::parse(text.unwrap_or("").as_bytes()) {
            if !known.contains(&&*name) {
                let what = match known {
                    [] => "is unknown: no query is understood here".to_owned(),
                    _ => format!("is unknown; understood are {}", known.join(", ")),
                };
                return Err(Refusal::field(&name, what));
            }
            if seen.iter().any(|earlier| *earlier == name) {
                return Err(Refusal::field(&name, "is given twice"));
            }
            match &*name {
                "v" => query.version = Some(value.into_owned()),
                "from" => query.from = Some(number(&name, &value)?),
                "after" if known.contains(&"limit") => query.names_after = Some(value.into_owned()),
                "after" => query.after = Some(number(&name, &value)?),
                "limit" => match number(&name, &value)? {
                    limit @ 1..=MAX_LIST_NAMES => query.limit = Some(limit),
                    _ => return Err(Refusal::field("limit", "is not from 1 to 1,000")),
                },
                _ => {
                    let want = want(&name, &value)?;
                    if let Some(other) = seen.iter().find(|name| WANTS.contains(&name.as_str())) {
                        return Err(Refusal::field(
                            &name,
                            format!("contradicts {other}: one of them tells enough"),
                        ));
                    }
                    query.want = want;
                }
            }
            seen.push(name.into_owned());
        }
        Ok(query)
    }
}

fn want(name: &str, value: &str) -> Result<Want, Refusal> {
    Ok(match name {
        "to" => Want::Level(number(name, value)?),
        "max_bytes" => Want::Bytes(number(name, value)?),
        "triangles" | "faces" => Want::Triangles(number(name, value)?),
        "rms_error" => Want::Error(Measure::Rms, error(name, value)?),
        _ => Want::Error(Measure::Max, error(name, value)?),
    })
}

fn error(name: &str, value: &str) -> Result<f64, Refusal> {
    let error = value.parse::<f64>().ok().filter(|x| x.is_finite() && *x >= 0.0);
    error.ok_or_else(|| Refusal::field(name, "is not a number of at least 0"))
}

fn number<T: std::str::FromStr>(name: &str, value: &str) -> Result<T, Refusal> {
    let digits = value.bytes().all(|b| b.is_ascii_digit());
    let number = if digits { value.parse().ok() } else { None };
    number.ok_or_else(|| Refusal::field(name, "is not a whole number in range"))
}

/// Consecutive atoms of a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Slice {
    /// Places in the table of contents.
    pub atoms: Range<usize>,
    /// Bytes of the file; they begin with header and table of contents where the client has nothing yet.
    pub bytes: Range<u64>,
    /// The finest level that is complete once they are decoded.
    pub level: u32,
}

/// The atoms that carry a client from what it holds to what it wants, in the order of the file.
///
/// # Errors
/// [`Refusal`] where there is no such level or atom, or where the client holds more than it wants.
pub fn refine(contents: &Contents, query: &Query) -> Result<Slice, Refusal> {
    let base = contents.base_level();
    let finish = contents.prefix(0).end;
    let level = |name: &str, j: u32| match j > base {
        true => Err(Refusal::field(name, format!("there is no level {j}: the base is level {base}"))),
        false => Ok(j),
    };
    let least = match query.from {
        Some(j) => contents.resource_atoms(level("from", j)?).end,
        None => 0,
    };
    let next = match query.after {
        Some(atom) if atom >= finish => {
            return Err(Refusal::field(
                "after",
                format!("there is no atom {atom}: the last one is {}", finish - 1),
            ));
        }
        Some(atom) if atom + 1 < least => {
            return Err(Refusal::field("after", format!("atom {atom} is in a level before the one of from")));
        }
        Some(atom) => atom + 1,
        None => least,
    };
    let bare = query.from.is_none() && query.after.is_none();
    let first = if bare { 0 } else { starts(contents, next) };
    let want = match query.want {
        Want::Level(j) => {
            let j = level("to", j)?;
            if let Some(from) = query.from.filter(|&from| j > from) {
                return Err(Refusal::field("to", format!("level {j} is coarser than level {from} of from")));
            }
            Want::Level(j)
        }
        Want::Bytes(most) => Want::Bytes(first.saturating_add(most)),
        want => want,
    };
    let end = plan(contents, want).parts.first().map_or(0, |part| part.atoms.end);
    let end = end.max(next);
    let complete = (0..=base).find(|&j| contents.steps(j).end <= end).unwrap_or(base);
    let last = if end > next { starts(contents, end) } else { first };
    Ok(Slice { atoms: next..end, bytes: first..last, level: complete })
}

/// Where an atom starts, or where the file ends.
fn starts(contents: &Contents, atom: usize) -> u64 {
    contents.atoms.get(atom).map_or(contents.file_bytes(), |atom| atom.offset)
}

/// The atoms of a keyframe, or of the base.
///
/// # Errors
/// [`Refusal`] where the level is not there or has none.
pub fn keyframe(contents: &Contents, level: u32) -> Result<Slice, Refusal> {
    let base = contents.base_level();
    let own = || contents.steps(base).start..contents.resource_atoms(base).end;
    let atoms = if level == base { Some(own()) } else { contents.keyframe(level) };
    let Some(atoms) = atoms else {
        let some: Vec<String> = contents.segments().take(MANY).map(|j| j.to_string()).collect();
        let what = format!("level {level} has no keyframe; there is one of level {}", some.join(", "));
        return Err(Refusal { field: Some("level".to_owned()), ..Refusal::new(StatusCode::NOT_FOUND, what) });
    };
    Ok(Slice { bytes: contents.bytes(atoms.clone()), atoms, level })
}

/// Sees whether an object has all the bytes of a slice.
///
/// # Errors
/// [`Refusal`] that names the first atom which has not.
pub fn check_extent(contents: &Contents, slice: &Slice, bytes: u64) -> Result<(), Refusal> {
    if slice.bytes.end <= bytes {
        return Ok(());
    }
    let index = contents.atoms.partition_point(|atom| atom.end() <= bytes);
    let (kind, level) = contents.atoms.get(index).map_or((None, 0), |atom| (Some(atom.kind), atom.level));
    let kind = kind.map_or_else(String::new, |kind| format!(" ({kind:?}, level {level})"));
    let what =
        format!("atom {index}{kind} is cut off: the file has {bytes} of {} bytes", contents.file_bytes());
    Err(Refusal::new(StatusCode::INTERNAL_SERVER_ERROR, what))
}

/// What the conditions of a request say (RFC 9110 §13.2.2).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Condition {
    /// It is to be answered.
    Met,
    /// The client has this version.
    NotModified,
    /// The client wants another version.
    Failed,
}

/// Compares the conditions of a request with the version there is.
pub fn condition(headers: &HeaderMap, version: &Version) -> Condition {
    let Ok(tag) = format!("\"{}\"", version.tag).parse::<ETag>() else { return Condition::Met };
    let met = match headers.typed_get::<IfMatch>() {
        Some(tags) => tags.precondition_passes(&tag),
        None => headers
            .typed_get::<IfUnmodifiedSince>()
            .is_none_or(|since| since.precondition_passes(version.modified)),
    };
    if !met {
        return Condition::Failed;
    }
    let modified = match headers.typed_get::<IfNoneMatch>() {
        Some(tags) => tags.precondition_passes(&tag),
        None => {
            headers.typed_get::<IfModifiedSince>().is_none_or(|since| since.is_modified(version.modified))
        }
    };
    if modified { Condition::Met } else { Condition::NotModified }
}

/// What of an answer is wanted.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Wanted {
    /// All of it.
    Whole,
    /// These bytes, each range not empty.
    Ranges(Vec<Range<u64>>),
    /// Nothing that there is, or more ranges than a server will look for.
    Unsatisfiable,
}

/// The ranges of an answer of `length` bytes (RFC 9110 §14.2). Ranges that are malformed, or of another version, are left out of account.
pub fn wanted(headers: &HeaderMap, version: &Version, length: u64) -> Wanted {
    let mut lines = headers.get_all(header::RANGE).iter();
    let (Some(line), None) = (lines.next(), lines.next()) else { return Wanted::Whole };
    // A date is too coarse to tell versions apart.
    let same = |tag: &[u8]| tag == format!("\"{}\"", version.tag).as_bytes();
    if headers.get(header::IF_RANGE).is_some_and(|tag| !same(tag.as_bytes())) {
        return Wanted::Whole;
    }
    let text = line.to_str().unwrap_or("");
    if text.bytes().filter(|&b| b == b',').count() >= MAX_RANGES {
        return Wanted::Unsatisfiable;
    }
    let Ok(parsed) = parse_range_header(text) else { return Wanted::Whole };
    let mut ranges = Vec::new();
    for range in parsed.ranges {
        let (start, end) = match (range.start, range.end) {
            (StartPosition::Index(start), EndPosition::Index(end)) if end < start => return Wanted::Whole,
            (StartPosition::Index(start), EndPosition::Index(end)) => {
                (start, end.saturating_add(1).min(length))
            }
            (StartPosition::Index(start), EndPosition::LastByte) => (start, length),
            (StartPosition::FromLast(count), _) => (length.saturating_sub(count), length),
        };
        if start < end {
            ranges.push(start..end);
        }
    }
    // Ranges that overlap could make a small file a large answer.
    let total = ranges.iter().fold(0u64, |sum, range| sum.saturating_add(range.end - range.start));
    if ranges.is_empty() || total > length { Wanted::Unsatisfiable } else { Wanted::Ranges(ranges) }
}

const WANTS: [&str; 6] = ["to", "max_error", "rms_error", "max_bytes", "triangles", "faces"];
/// Most ranges of one request.
pub const MAX_RANGES: usize = 16;
/// Most entries of a list.
const MAX_LIST_NAMES: usize = 1000;
/// What a set has instead of levels.
const OF_SET: &str = "this is a set of meshes: it has no refinement and no keyframes; its members are ranges of NAME.uwm, which NAME/levels tells";
/// Most levels that a message names.
const MANY: usize = 32;

#[cfg(test)]
mod tests;
