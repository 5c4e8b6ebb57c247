//! Chapter 3: from bytes to atoms.

use super::attribute::{Attribute, AttributeError, read_attributes};
use super::lifting::Scale;
use super::resources::{self, Resource};
use super::table;

/// A value, or why the file is refused: the section and the rule.
pub type Result<T> = std::result::Result<T, String>;

pub fn refuse<T>(why: &str) -> Result<T> {
    Err(format!("§{why}"))
}

pub fn demand(rule: bool, why: &str) -> Result<()> {
    if rule { Ok(()) } else { refuse(why) }
}

pub const BASE: u8 = 0;
pub const PRECISION: u8 = 1;
pub const REFINEMENT: u8 = 2;
/// No number of the format: births have their place in the level entry.
pub const BIRTH: u8 = 127;
/// Nor this: resources have theirs, too.
pub const RESOURCE: u8 = 126;
pub const RESIDUE: u8 = 3;
pub const METADATA: u8 = 4;
pub const KEYFRAME: u8 = 5;
pub const CORRECTION: u8 = 6;
pub const ORDER: u8 = 7;
pub const ATTRIBUTES: u8 = 8;

/// A file, cut into atoms.
pub struct File {
    pub origin: [f64; 3],
    pub step: f64,
    pub bits: u32,
    pub maximum: [u64; 3],
    /// f of §5.4.5.
    pub lifting: u8,
    pub rich_models: bool,
    pub attributes: Vec<Attribute>,
    pub resources: Vec<Resource>,
    /// The levels by number, the base last.
    pub levels: Vec<Level>,
    /// By level, how far its attributes are off.
    pub attribute_errors: Vec<Vec<AttributeError>>,
    pub atoms: Vec<Atom>,
}

#[derive(Clone, Copy)]
pub struct Level {
    pub vertices: u64,
    pub triangles: u64,
    pub shift: u32,
    pub max_error: f64,
    pub rms_error: f64,
}

#[derive(Clone, Debug, PartialEq)]
pub struct Atom {
    pub kind: u8,
    pub level: u64,
    pub items: u64,
    pub triangles: u64,
    pub length: usize,
    pub sum: u32,
    pub bytes: Vec<u8>,
}

impl File {
    pub fn read(bytes: &[u8]) -> Result<Self> {
        let (mut file, rest) = Self::head(bytes)?;
        let mut fields = Fields(rest);
        for atom in &mut file.atoms {
            atom.bytes = fields.take(atom.length)?.to_vec();
            demand(checksum(&atom.bytes) == atom.sum, "3.4: checksum of an atom")?;
        }
        demand(fields.0.is_empty(), "3.1: trailing bytes")?;
        Ok(file)
    }

    /// Header and table of contents, and the bytes behind them.
    pub fn head(bytes: &[u8]) -> Result<(Self, &[u8])> {
        let mut fields = Fields(bytes);
        demand(fields.take(8)? == b"\x89UWM\r\n\x1A\n", "3.2: magic")?;
        demand(fields.u16()? == 1, "3.2: version")?;
        let lifting = fields.u8()?;
        demand(lifting <= 32, "3.2: lifting")?;
        let models = fields.u8()?;
        demand(models <= 1, "3.2: set of models")?;
        let attributes = fields.u8()?;
        let (has_resources, attributes) = (attributes >= 128, attributes % 128);
        demand(attributes <= 64, "3.2: number of attributes")?;
        let length = fields.u24()? as usize;
        let table = fields.take(length)?;
        demand(table.len() >= 4, "3.3: table too short")?;
        let (table, sum) = table.split_at(table.len() - 4);
        demand(sum == crc32c(&bytes[..16 + table.len()]).to_le_bytes(), "3.4: checksum of the table")?;
        let mut table = Fields(table);
        let (origin, step, bits, maximum) = table::read_lattice(&mut table)?;
        let attributes = read_attributes(&mut table, attributes.into())?;
        let (resources, waiting) =
            if has_resources { resources::read_resources(&mut table)? } else { (vec![], vec![]) };
        let n = table.varint()?;
        demand((1..=4096).contains(&n), "3.3: number of levels")?;
        let told = attributes.iter().filter(|attribute| attribute.constant.is_none());
        let births: Vec<u64> = told.map(|attribute| attribute.birth).collect();
        demand(births.iter().all(|&birth| birth < n), "3.3: birth of an attribute")?;
        resources::check_places(&resources, n)?;
        let (levels, attribute_errors, mut atoms) =
            table::read_levels(&mut table, n as usize, bits, step, &attributes, &waiting)?;
        table::read_payloads(&mut table, n - 1, &mut atoms)?;
        let valued = atoms.iter().any(|atom| (atom.kind, atom.level) == (ATTRIBUTES, 0));
        demand(!valued || !attributes.is_empty(), "3.3: values without attributes")?;
        demand(valued || n == 1 || !births.contains(&0), "3.3: attributes without values")?;
        demand(atoms.len() <= 1 << 20, "3.6: number of atoms")?;
        let rich_models = models == 1;
        let file = Self {
            origin,
            step,
            bits,
            maximum,
            lifting,
            rich_models,
            attributes,
            resources,
            levels,
            attribute_errors,
            atoms,
        };
        Ok((file, fields.0))
    }

    /// Of a level.
    pub fn scale(&self, level: usize) -> Scale {
        Scale { bits: self.bits, shift: self.levels[level].shift, factor: self.lifting }
    }

    /// The atoms of one kind at one level.
    pub fn atoms_of(&self, kind: u8, level: usize) -> Vec<&Atom> {
        self.atoms.iter().filter(|a| a.kind == kind && a.level == level as u64).collect()
    }

    /// §3.1: their bytes, one after the other.
    pub fn payload(&self, kind: u8, level: usize) -> Vec<u8> {
        self.atoms_of(kind, level).iter().flat_map(|a| a.bytes.clone()).collect()
    }

    /// §2.4.
    pub fn position(&self, point: [i64; 3]) -> [f64; 3] {
        [0, 1, 2].map(|k| self.origin[k] + self.step * point[k] as f64)
    }
}

/// §3.4: the checksum of an atom.
pub fn checksum(bytes: &[u8]) -> u32 {
    if bytes.len() < 1024 { crc16(bytes) } else { crc32c(bytes) }
}

/// §3.4, as a division of polynomials: the bits from the highest on, 16 zeros behind them, the first 16 turned over.
fn crc16(bytes: &[u8]) -> u32 {
    let bits = bytes.iter().flat_map(|byte| (0..8).rev().map(move |i| u32::from(byte >> i & 1)));
    let turned = bits.chain([0; 16]).enumerate().map(|(i, bit)| bit ^ u32::from(i < 16));
    turned.fold(0, |rest, bit| {
        let rest = rest << 1 | bit;
        if rest >> 16 == 1 { rest ^ 0x1_1021 } else { rest }
    })
}

/// §3.4, bit by bit.
pub fn crc32c(bytes: &[u8]) -> u32 {
    let mut crc = 0xFFFF_FFFF;
    for &byte in bytes {
        crc ^= u32::from(byte);
        for _ in 0..8 {
            // 82F63B78 is 1EDC6F41 reflected.
            crc = if crc & 1 == 1 { crc >> 1 ^ 0x82F6_3B78 } else { crc >> 1 };
        }
    }
    !crc
}

/// Bytes not yet read.
pub struct Fields<'a>(pub &'a [u8]);

impl<'a> Fields<'a> {
    pub fn take(&mut self, count: usize) -> Result<&'a [u8]> {
        demand(count <= self.0.len(), "3: bytes are missing")?;
        let (head, tail) = self.0.split_at(count);
        self.0 = tail;
        Ok(head)
    }

    fn little_endian(&mut self, count: usize) -> Result<u64> {
        Ok(self.take(count)?.iter().rev().fold(0, |value, &byte| value << 8 | u64::from(byte)))
    }

    pub fn u8(&mut self) -> Result<u8> {
        Ok(self.little_endian(1)? as u8)
    }

    pub fn u16(&mut self) -> Result<u64> {
        self.little_endian(2)
    }

    pub fn u24(&mut self) -> Result<u64> {
        self.little_endian(3)
    }

    pub fn u32(&mut self) -> Result<u64> {
        self.little_endian(4)
    }

    pub fn u64(&mut self) -> Result<u64> {
        self.little_endian(8)
    }

    pub fn f64(&mut self) -> Result<f64> {
        Ok(f64::from_bits(self.u64()?))
    }

    pub fn varint(&mut self) -> Result<u64> {
        let mut value: u128 = 0;
        for shift in (0..70).step_by(7) {
            let byte = self.u8()?;
            value |= u128::from(byte & 127) << shift;
            if byte < 128 {
                demand(byte > 0 || shift == 0, "3: a varint longer than needed")?;
                return u64::try_from(value).or(refuse("3: a varint of more than 64 bits"));
            }
        }
        refuse("3: a varint of more than 64 bits")
    }
}
