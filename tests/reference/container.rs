//! Chapter 3: from bytes to atoms.

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
pub const RESIDUE: u8 = 3;
pub const METADATA: u8 = 4;
pub const KEYFRAME: u8 = 5;
pub const CORRECTION: u8 = 6;
pub const ORDER: u8 = 7;

/// A file, cut into atoms.
pub struct File {
    pub origin: [f64; 3],
    pub step: f64,
    pub bits: u32,
    pub rich_models: bool,
    /// The levels by number, the base last.
    pub levels: Vec<Level>,
    pub atoms: Vec<Atom>,
}

#[derive(Clone, Copy)]
pub struct Level {
    pub vertices: u64,
    pub triangles: u64,
    pub shift: u32,
    pub max_error: f64,
    pub rms_error: f32,
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
        let mut fields = Fields(bytes);
        demand(fields.take(8)? == b"\x89UWM\r\n\x1A\n", "3.2: magic")?;
        demand(fields.u16()? == 1, "3.2: version")?;
        demand(fields.u16()? == 0, "3.2: flags")?;
        let [v0, t0, vb, tb] = [fields.u32()?, fields.u32()?, fields.u32()?, fields.u32()?];
        demand([v0, t0, vb, tb].iter().all(|&count| count <= 1 << 30), "3.2: counts")?;
        let n = fields.u16()? as usize;
        demand((1..=4096).contains(&n), "3.2: number of levels")?;
        demand(fields.u16()? == 0, "3.2: reserved")?;
        let origin = [fields.f64()?, fields.f64()?, fields.f64()?];
        let step = fields.f64()?;
        demand(origin.iter().all(|x| x.is_finite()) && step.is_finite() && step >= 0.0, "3.2: lattice")?;
        let bits = u32::from(fields.u8()?);
        demand((8..=24).contains(&bits), "3.2: lattice bits")?;
        demand(fields.u8()? == 0, "3.2: reserved")?;
        let models = fields.u8()?;
        demand(models <= 1, "3.2: set of models")?;
        demand(fields.u8()? == 0, "3.2: reserved")?;
        for x in origin {
            let maximum = fields.u32()?;
            demand(maximum < 1 << bits && (x + step * maximum as f64).is_finite(), "3.2: bounding box")?;
        }
        let length = fields.u32()?;
        demand(length <= 1 << 26, "3.2: length of the table")?;
        demand(fields.u32()? == u64::from(crc32c(&bytes[..84])), "3.4: checksum of the header")?;

        demand(v0 >= vb && t0 >= tb && v0 - vb >= n as u64 - 1, "3.2: what is added")?;
        demand(n > 1 || (v0 == vb && t0 == tb), "3.2: n = 1 adds nothing")?;
        demand(n == 1 || tb > 0, "3.2: a base without triangles")?;
        demand(vb <= 3 * tb && 3 * tb <= vb * vb.saturating_sub(1), "3.6: counts of the base")?;

        let table = fields.take(length as usize)?;
        demand(table.len() >= 4, "3.3: table too short")?;
        let (table, sum) = table.split_at(table.len() - 4);
        demand(sum == crc32c(table).to_le_bytes(), "3.4: checksum of the table")?;
        let mut table = Fields(table);
        let levels = table::read_levels(&mut table, n, vb, tb, bits)?;
        demand(levels[0].vertices == v0 && levels[0].triangles == t0, "3.3: sums of counts")?;
        let mut atoms = table::read_atoms(&mut table, &levels)?;
        demand(table.0.is_empty(), "3.3: bytes behind the last entry")?;
        for atom in &mut atoms {
            atom.bytes = fields.take(atom.length)?.to_vec();
            demand(crc32c(&atom.bytes) == atom.sum, "3.4: checksum of an atom")?;
        }
        demand(fields.0.is_empty(), "3.1: trailing bytes")?;
        Ok(Self { origin, step, bits, rich_models: models == 1, levels, atoms })
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
