//! Reads the table of contents and checks it against every rule (spec §3.3).

use std::ops::Range;

use super::attributes::AttributeEntry;
use super::checksum::{self, SHORT};
use super::contents::{Atom, AtomKind, AttributeError, Contents, Level};
use super::errors::Codes;
use super::fields::{Fields, is_short};
use super::header::{Coding, Header, Start};
use super::magnitude;
use super::resources::ResourceEntry;
use crate::error::FormatError;
use crate::limits::{
    MAX_ATOM_BYTES, MAX_ATOMS, MAX_ELEMENTS, MAX_LEVELS, MAX_METADATA_BYTES, MAX_RESOURCES, max_walked,
};
use crate::mesh::lattice::Lattice;

/// Reads the `start.table_bytes` bytes behind the header.
pub(super) fn read(start: &Start, bytes: &[u8]) -> Result<Contents, FormatError> {
    let at = Header::SIZE as u64;
    let Some((body, checksum)) = bytes.split_last_chunk::<4>() else {
        return Err(FormatError::new(at, "3.3", "the table of contents has no room for its checksum"));
    };
    if checksum::append(checksum::append(0, &start.bytes), body).to_le_bytes() != *checksum {
        return Err(FormatError::new(0, "3.4", "header and table of contents do not match their checksum"));
    }
    let coding = start.coding()?;
    let mut table = Table {
        fields: Fields::new(body, at, "3.3"),
        attributes: Vec::new(),
        resources: Vec::new(),
        placed: 0,
        waiting: Vec::new().into_iter(),
        codes: Codes::default(),
        atoms: Vec::new(),
        offset: at + u64::from(start.table_bytes),
        counts: [0; 2],
    };
    let mut header = table.header(start, coding)?;
    let (levels, steps) = table.levels(&mut header)?;
    let mut contents = Contents {
        keyframes: vec![0..0; levels.len()],
        header,
        levels,
        attributes: std::mem::take(&mut table.attributes),
        resources: std::mem::take(&mut table.resources),
        atoms: Vec::new(),
        steps,
        residue: 0..0,
        attribute_atoms: 0..0,
        correction: 0..0,
        order: 0..0,
        metadata: 0..0,
    };
    while table.fields.left() > 0 {
        table.payload(&mut contents)?;
    }
    let (wanted, end) = (contents.births_at(0).count(), table.fields.offset());
    let told = contents.base_level() == 0 || !contents.attribute_atoms.is_empty();
    table.fields.require(wanted == 0 || told, end, || format!("{wanted} attributes without values"))?;
    contents.atoms = table.atoms;
    Ok(contents)
}

/// A table that is being read.
struct Table<'a> {
    fields: Fields<'a>,
    attributes: Vec<AttributeEntry>,
    resources: Vec<ResourceEntry>,
    /// How many of the resources have their atoms among the others.
    placed: usize,
    /// The atoms of those that have not.
    waiting: std::vec::IntoIter<Atom>,
    /// Errors of the attributes of the level before.
    codes: Codes,
    atoms: Vec<Atom>,
    /// Where the next atom starts.
    offset: u64,
    /// Vertices and triangles of the mesh as it will stand.
    counts: [u32; 2],
}

/// What the atoms of a pass share out between them.
struct Share {
    items: u64,
    /// How many operations add one triangle only.
    single: u32,
}

/// A level entry's numbers that the next one is told by.
struct Entry {
    level: Level,
    /// Codes of its errors.
    codes: [u16; 2],
}

impl Table<'_> {
    /// All but what the levels add.
    fn header(&mut self, start: &Start, coding: Coding) -> Result<Header, FormatError> {
        let (lattice, maximum) = self.lattice()?;
        if coding.lifting > 0 && lattice.bits == Lattice::MAX_BITS {
            let what = format!("a lattice of {} bits leaves no room for lifting", lattice.bits);
            return Err(FormatError::new(10, "3.2", what));
        }
        let fields = &mut self.fields;
        let mut starts = Vec::new();
        for _ in 0..start.attributes()? {
            starts.push(fields.offset());
            self.attributes.push(AttributeEntry::read(fields)?);
        }
        let places = if start.has_resources() { self.told_resources()? } else { Vec::new() };
        let fields = &mut self.fields;
        let at = fields.offset();
        let level_count = fields.count(MAX_LEVELS, "the number of levels")?;
        fields.require(level_count >= 1, at, || "a file without levels".to_owned())?;
        for (AttributeEntry { birth, constant, .. }, at) in self.attributes.iter_mut().zip(starts) {
            let base = level_count - 1;
            if constant.is_some() {
                *birth = base;
            }
            fields.require(*birth <= base, at, || {
                format!("an attribute is born at level {birth}, allowed 0 to {base}")
            })?;
        }
        let mut most = level_count - 1;
        for (&ResourceEntry { place, .. }, at) in self.resources.iter().zip(places) {
            fields.require(place <= most, at, || {
                format!("a resource stands behind level {place}, allowed 0 to {most}")
            })?;
            most = place;
        }
        self.codes = Codes::new(&self.attributes);
        let at = fields.offset();
        let vertices = fields.count(MAX_ELEMENTS, "the number of vertices of the base")?;
        let triangles = fields.count(MAX_ELEMENTS, "the number of triangles of the base")?;
        self.counts = [vertices, triangles];
        if let Some(what) = impossible(vertices, triangles) {
            return Err(FormatError::new(at, "3.6", format!("the base has {what}")));
        }
        if triangles == 0 && level_count > 1 {
            return Err(FormatError::new(at, "3.6", "nothing can be refined where there is no triangle"));
        }
        Ok(Header {
            vertices,
            triangles,
            base_vertices: vertices,
            base_triangles: triangles,
            level_count,
            lattice,
            coding,
            maximum,
            table_bytes: start.table_bytes,
        })
    }

    /// The resources, whose atoms wait until their places are reached; where the entry of each begins.
    fn told_resources(&mut self) -> Result<Vec<u64>, FormatError> {
        let at = self.fields.offset();
        let count = self.fields.count(MAX_RESOURCES, "the number of resources")?;
        self.fields.require(count >= 1, at, || "no resources where the header tells of some".to_owned())?;
        let first = self.offset;
        let mut starts = Vec::new();
        for number in 0..count as usize {
            starts.push(self.fields.offset());
            let entry = ResourceEntry::read(&mut self.fields, number)?;
            let (begin, place) = (self.offset, entry.place);
            let atoms = self.run(AtomKind::Resource, place, None)?;
            self.resources.push(ResourceEntry { atoms, bytes: self.offset - begin, ..entry });
        }
        self.waiting = std::mem::take(&mut self.atoms).into_iter();
        self.offset = first;
        Ok(starts)
    }

    /// Puts the resources that stand behind level `j` behind its atoms.
    fn place_resources(&mut self, j: u32) {
        let [vertices_after, triangles_after] = self.counts;
        while let Some(entry) = self.resources.get_mut(self.placed).filter(|entry| entry.place == j) {
            let first = self.atoms.len();
            for atom in self.waiting.by_ref().take(entry.atoms.len()) {
                self.atoms.push(Atom { offset: self.offset, vertices_after, triangles_after, ..atom });
                self.offset += u64::from(atom.length);
            }
            entry.atoms = first..self.atoms.len();
            self.placed += 1;
        }
    }

    fn lattice(&mut self) -> Result<(Lattice, [u32; 3]), FormatError> {
        let at = self.fields.offset();
        let form = self.fields.u8()?;
        let bits = u32::from(form & 31);
        self.fields.require(
            (Lattice::MIN_BITS..=Lattice::MAX_BITS).contains(&bits) && form < 128,
            at,
            || {
                format!(
                    "a lattice of {bits} bits, form {}; allowed {} to {}, form 0 to 3",
                    form >> 5,
                    Lattice::MIN_BITS,
                    Lattice::MAX_BITS
                )
            },
        )?;
        let mut origin = [0.0; 3];
        for x in &mut origin {
            *x = self.fields.real(form & ORIGIN_SHORT > 0, "the origin")?;
        }
        let step = self.fields.real(form & STEP_SHORT > 0, "the lattice step")?;
        self.fields.require(step >= 0.0, at, || "the lattice step is negative".to_owned())?;
        self.fields.require(form >> 5 == form_of(origin, step) >> 5, at, || {
            "the lattice is not in its shortest form".to_owned()
        })?;
        let at = self.fields.offset();
        let most = (1 << bits) - 1;
        let mut maximum = [0; 3];
        for m in &mut maximum {
            *m = most - self.fields.count(most, "what the bounding box lacks of the lattice")?;
        }
        let lattice = Lattice { origin, step, bits };
        let corner = lattice.position(maximum.map(|m| m as i32));
        self.fields.require(corner.iter().all(|x| x.is_finite()), at, || {
            "the bounding box is not finite".to_owned()
        })?;
        Ok((lattice, maximum))
    }

    /// The levels by number, and the atoms that lead to each. Adds to the header what they add.
    fn levels(&mut self, header: &mut Header) -> Result<(Vec<Level>, Vec<Range<usize>>), FormatError> {
        let unit = magnitude::unit(header.lattice.step);
        let mut entry = self.base(header, unit)?;
        let mut steps: Vec<_> = std::iter::once(0..self.atoms.len()).collect();
        self.place_resources(header.base_level());
        let mut levels = Vec::new();
        let mut walked = 0;
        for j in (0..header.base_level()).rev() {
            walked += u64::from(entry.level.triangles);
            let first = self.atoms.len();
            let finer = self.level(j, &entry, unit)?;
            levels.push(std::mem::replace(&mut entry, finer).level);
            steps.push(first..self.atoms.len());
            self.place_resources(j);
        }
        self.fields
            .require(entry.level.precision == 0, self.fields.offset(), || "level 0 lacks bits".to_owned())?;
        let allowed = max_walked(entry.level.triangles);
        if walked > allowed {
            let what =
                format!("the levels above level 0 have {walked} triangles together, allowed {allowed}");
            return Err(FormatError::new(self.fields.offset(), "3.6", what));
        }
        (header.vertices, header.triangles) = (entry.level.vertices, entry.level.triangles);
        levels.push(entry.level);
        levels.reverse();
        steps.reverse();
        Ok((levels, steps))
    }

    fn base(&mut self, header: &Header, unit: f64) -> Result<Entry, FormatError> {
        let precision = self.fields.count(header.lattice.bits, "the precision shift of the base")?;
        let mut codes = [0; 2];
        for code in &mut codes {
            let at = self.fields.offset();
            *code = self.fields.u16()?;
            self.fields.require(*code <= magnitude::MAX_CODE, at, || "an error is not finite".to_owned())?;
        }
        let attributes = self.codes.read(&mut self.fields, &self.attributes, header.base_level())?;
        let entry = self.entry(precision, codes, unit, attributes)?;
        self.run(AtomKind::Base, header.base_level(), None)?;
        Ok(entry)
    }

    /// The entry of level `j`, which is not the base, with its atoms.
    fn level(&mut self, j: u32, above: &Entry, unit: f64) -> Result<Entry, FormatError> {
        let at = self.fields.offset();
        let mut shape = self.fields.count(u32::MAX, "the number of vertices added")?;
        let mut born = [0; 2];
        if shape == 0 {
            born = self.born()?;
            shape = self.fields.count(u32::MAX, "the number of vertices added")?;
        }
        let (added, sharper, single) = (shape >> 2, shape & SHARPER > 0, shape & SINGLE > 0);
        self.fields.require(added >= 1 || born[0] > 0, at, || format!("level {j} adds nothing"))?;
        let single = if single { self.fields.count(added, "the number of single triangles")? } else { 0 };
        self.fields.require(single > 0 || shape & SINGLE == 0, at, || TOO_LONG.to_owned())?;
        let finer =
            if sharper { self.fields.count(above.level.precision, "the bits that are gained")? } else { 0 };
        self.fields.require(finer > 0 || !sharper, at, || TOO_LONG.to_owned())?;
        let codes = self.codes(above.codes)?;
        let of_attributes = self.codes.read(&mut self.fields, &self.attributes, j)?;
        let [vertices, triangles] = self.counts;
        let room = |count: u32, more: u32, born: u32| {
            count.checked_add(more)?.checked_add(born).filter(|&sum| sum <= MAX_ELEMENTS)
        };
        if room(vertices, added, born[0]).is_none() || room(triangles, 2 * added - single, born[1]).is_none()
        {
            return Err(FormatError::new(
                at,
                "3.6",
                format!("level {j} has more than {MAX_ELEMENTS} vertices or triangles"),
            ));
        }
        if finer > 0 {
            let items = u64::from(vertices) * u64::from(finer);
            self.run(AtomKind::Precision, j, Some(Share { items, single: 0 }))?;
        }
        if added > 0 {
            self.run(AtomKind::Refinement, j, Some(Share { items: added.into(), single }))?;
        }
        if born[0] > 0 {
            self.run(AtomKind::Birth, j, None)?;
            self.counts = [self.counts[0] + born[0], self.counts[1] + born[1]];
            if let Some(last) = self.atoms.last_mut() {
                [last.items, last.triangles] = born;
                [last.vertices_after, last.triangles_after] = self.counts;
            }
        }
        if tells_values(&self.attributes, j) {
            self.run(AtomKind::Attributes, j, None)?;
        }
        self.entry(above.level.precision - finer, codes, unit, of_attributes)
    }

    /// Vertices and triangles of components that are born.
    fn born(&mut self) -> Result<[u32; 2], FormatError> {
        let at = self.fields.offset();
        let vertices = self.fields.count(MAX_ELEMENTS, "the number of vertices born")?;
        let triangles = self.fields.count(MAX_ELEMENTS, "the number of triangles born")?;
        self.fields.require(triangles >= 1, at, || "a birth of nothing".to_owned())?;
        match impossible(vertices, triangles) {
            Some(what) => Err(FormatError::new(at, "3.6", format!("a birth has {what}"))),
            None => Ok([vertices, triangles]),
        }
    }

    fn codes(&mut self, before: [u16; 2]) -> Result<[u16; 2], FormatError> {
        let mut codes = before;
        for code in &mut codes {
            let at = self.fields.offset();
            let difference = self.fields.count(u32::MAX, "the difference of an error")?;
            *code = magnitude::behind(*code, difference)
                .ok_or_else(|| FormatError::new(at, "3.3", "an error is negative or not finite"))?;
        }
        Ok(codes)
    }

    fn entry(
        &self,
        precision: u32,
        codes: [u16; 2],
        unit: f64,
        attributes: Vec<AttributeError>,
    ) -> Result<Entry, FormatError> {
        let [max_error, rms_error] = codes.map(|code| magnitude::value(code, unit));
        self.fields.require(max_error.is_finite() && rms_error.is_finite(), self.fields.offset(), || {
            "an error is not finite".to_owned()
        })?;
        let [vertices, triangles] = self.counts;
        Ok(Entry { level: Level { vertices, triangles, precision, max_error, rms_error, attributes }, codes })
    }

    /// A payload behind level 0.
    fn payload(&mut self, contents: &mut Contents) -> Result<(), FormatError> {
        let at = self.fields.offset();
        let byte = self.fields.u8()?;
        let kind = AtomKind::from_byte(byte);
        let kind = kind.ok_or_else(|| FormatError::new(at, "3.3", format!("unknown kind of atom {byte}")))?;
        let base = contents.base_level();
        let level = match kind {
            AtomKind::Keyframe => self.fields.count(u32::MAX, "the level of a keyframe")?,
            _ => 0,
        };
        self.fields.require(kind != AtomKind::Keyframe || level < base, at, || {
            format!("a keyframe of level {level} in a file whose base is level {base}")
        })?;
        let rank = |atom: &Atom| atom.kind.rank(atom.level, contents.header.level_count);
        let before = self.atoms.iter().rev().find_map(rank);
        if let Some(rank) = kind.rank(level, contents.header.level_count) {
            self.fields
                .require(before < Some(rank), at, || format!("{kind:?} of level {level} is out of order"))?;
        }
        self.fields.require(kind != AtomKind::Attributes || !contents.attributes.is_empty(), at, || {
            "values of attributes where there are no attributes".to_owned()
        })?;
        let atoms = self.run(kind, level, None)?;
        match kind {
            AtomKind::Attributes => contents.attribute_atoms = atoms,
            AtomKind::Residue => contents.residue = atoms,
            AtomKind::Correction => contents.correction = atoms,
            AtomKind::Order => contents.order = atoms,
            AtomKind::Keyframe => {
                let whole = &contents.levels[level as usize];
                for atom in &mut self.atoms[atoms.clone()] {
                    (atom.vertices_after, atom.triangles_after) = (whole.vertices, whole.triangles);
                }
                contents.keyframes[level as usize] = atoms;
            }
            AtomKind::Metadata => {
                let bytes: usize = self.atoms[atoms.clone()].iter().map(|atom| atom.length as usize).sum();
                self.fields.require(bytes <= MAX_METADATA_BYTES, at, || {
                    format!("{bytes} bytes of metadata, allowed {MAX_METADATA_BYTES}")
                })?;
                contents.metadata = atoms;
            }
            _ => {}
        }
        Ok(())
    }

    /// The atoms of one payload or pass.
    fn run(&mut self, kind: AtomKind, level: u32, share: Option<Share>) -> Result<Range<usize>, FormatError> {
        let first = self.atoms.len();
        let mut left = share;
        let mut more = true;
        while more {
            let at = self.fields.offset();
            let word = self.fields.count(u32::MAX, "the length of an atom")?;
            let length = word >> 1;
            more = word & 1 > 0;
            self.fields.require(length >= 1, at, || "an empty atom".to_owned())?;
            if length > MAX_ATOM_BYTES {
                let what = format!("the length of an atom is {length}, allowed {MAX_ATOM_BYTES}");
                return Err(FormatError::new(at, "3.6", what));
            }
            let [items, triangles] = match &mut left {
                Some(left) => self.share(kind, left, more)?,
                None => [0; 2],
            };
            let crc = if length < SHORT { self.fields.u16()?.into() } else { self.fields.u32()? };
            if self.atoms.len() + self.waiting.len() == MAX_ATOMS as usize {
                return Err(FormatError::new(at, "3.6", format!("more than {MAX_ATOMS} atoms")));
            }
            if kind == AtomKind::Refinement {
                self.counts = [self.counts[0] + items, self.counts[1] + triangles];
            }
            let [vertices_after, triangles_after] = self.counts;
            let offset = self.offset;
            let last = !more;
            self.atoms.push(Atom {
                kind,
                level,
                offset,
                length,
                items,
                triangles,
                crc,
                vertices_after,
                triangles_after,
                last,
            });
            self.offset += u64::from(length);
        }
        Ok(first..self.atoms.len())
    }

    /// Items and triangles of the next atom of a pass: what its entry says, or all that is left.
    fn share(&mut self, kind: AtomKind, left: &mut Share, more: bool) -> Result<[u32; 2], FormatError> {
        let at = self.fields.offset();
        let (items, single) = if more {
            let items = self.fields.count(u32::MAX, "the number of items")?;
            let single = if left.single > 0 {
                self.fields.count(left.single, "the number of single triangles")?
            } else {
                0
            };
            (items, single)
        } else {
            let Ok(items) = u32::try_from(left.items) else {
                return Err(FormatError::new(at, "3.3", format!("{} items in one atom", left.items)));
            };
            (items, left.single)
        };
        let rest = left.items.checked_sub(items.into());
        let rest = rest.filter(|&rest| {
            items >= 1 && (rest > 0) == more && single <= items && u64::from(left.single - single) <= rest
        });
        let Some(rest) = rest else {
            let what = format!(
                "an atom has {items} items, {single} of them with one triangle; left are {} and {}",
                left.items, left.single
            );
            return Err(FormatError::new(at, "3.3", what));
        };
        (left.items, left.single) = (rest, left.single - single);
        Ok([items, if kind == AtomKind::Refinement { 2 * items - single } else { 0 }])
    }
}

/// Whether the entry of level `j`, which is not the base, has a payload of attributes (spec §3.3).
pub(super) fn tells_values(attributes: &[AttributeEntry], j: u32) -> bool {
    j > 0 && attributes.iter().any(|attribute| attribute.birth == j && attribute.constant.is_none())
}

/// What no manifold can have of so many vertices and triangles, if it is so (spec §3.6).
fn impossible(vertices: u32, triangles: u32) -> Option<&'static str> {
    let [v, t] = [vertices, triangles].map(u64::from);
    if v > 3 * t {
        return Some("more vertices than corners");
    }
    (3 * t > v * v.saturating_sub(1)).then_some("more triangles than its vertices can span")
}

/// How the numbers of a lattice are written: bits a coordinate, and which of them are binary32 because that is enough.
pub(super) fn form_of(origin: [f64; 3], step: f64) -> u8 {
    u8::from(origin.iter().all(|&x| is_short(x))) * ORIGIN_SHORT + u8::from(is_short(step)) * STEP_SHORT
}

/// Marks in the first byte of the lattice, beside its bits: numbers that are binary32.
pub(super) const ORIGIN_SHORT: u8 = 32;
pub(super) const STEP_SHORT: u8 = 64;
/// Marks in the first number of a level entry, beside four times the vertices added: that there are operations of one triangle, and that
/// bits are gained.
pub(super) const SINGLE: u32 = 1;
pub(super) const SHARPER: u32 = 2;

const TOO_LONG: &str = "a level entry is not in its shortest form";

#[cfg(test)]
mod tests;
