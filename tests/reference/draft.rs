//! A file in parts, to be changed and sealed again with checksums that fit.

use super::container::{
    ATTRIBUTES, Atom, BASE, BIRTH, File, KEYFRAME, PRECISION, REFINEMENT, RESOURCE, checksum, crc32c,
};
use super::resources::Resource;

/// A file without the fields that follow from the others.
#[derive(Clone)]
pub struct Draft {
    /// Bytes 10 to 12 of the header.
    pub settings: [u8; 3],
    pub origin: [f64; 3],
    pub step: f64,
    pub bits: u8,
    pub maximum: [u64; 3],
    /// The entries of attributes, as bytes.
    pub attributes: Vec<u8>,
    pub resources: Vec<Resource>,
    /// The levels by number.
    pub levels: Vec<Shape>,
    /// By level what its entry tells of errors of attributes, as bytes.
    pub attribute_errors: Vec<Vec<u8>>,
    pub atoms: Vec<Atom>,
}

/// What the table says of a level, but for its atoms.
#[derive(Clone, Copy)]
pub struct Shape {
    pub vertices: u64,
    pub triangles: u64,
    pub shift: u32,
    /// Codes of its errors.
    pub errors: [u16; 2],
}

impl Draft {
    /// The parts of a sound file.
    pub fn of(bytes: &[u8]) -> Self {
        let file = File::read(bytes).expect("a sound file");
        let unit = if file.step > 0.0 { file.step } else { 1.0 };
        // What is read is a number of 16 bits times the unit: the quotient is nearer to it than to any other.
        let code = |error: f64| ((((error / unit) as f32).to_bits() + 0x8000) >> 16) as u16;
        let shape = |level: &super::container::Level| Shape {
            vertices: level.vertices,
            triangles: level.triangles,
            shift: level.shift,
            errors: [code(level.max_error), code(level.rms_error)],
        };
        Self {
            settings: [bytes[10], bytes[11], bytes[12]],
            origin: file.origin,
            step: file.step,
            bits: file.bits as u8,
            maximum: file.maximum,
            attributes: file.attributes.into_iter().flat_map(|attribute| attribute.bytes).collect(),
            resources: file.resources,
            levels: file.levels.iter().map(shape).collect(),
            attribute_errors: file
                .attribute_errors
                .iter()
                .map(|level| level.iter().flat_map(|error| error.bytes.clone()).collect())
                .collect(),
            atoms: file.atoms,
        }
    }

    /// The table of contents without its checksum; numbers that cannot be said become wrong ones.
    pub fn table(&self) -> Vec<u8> {
        let short = |x: &f64| f64::from(*x as f32).to_bits() == x.to_bits();
        let (short_origin, short_step) = (self.origin.iter().all(short), short(&self.step));
        let mut table = vec![self.bits + 32 * u8::from(short_origin) + 64 * u8::from(short_step)];
        for (x, short) in self.origin.map(|x| (x, short_origin)).into_iter().chain([(self.step, short_step)])
        {
            match short {
                true => table.extend((x as f32).to_le_bytes()),
                false => table.extend(x.to_le_bytes()),
            }
        }
        for maximum in self.maximum {
            varint(&mut table, (1u64 << self.bits).wrapping_sub(1 + maximum));
        }
        table.extend(&self.attributes);
        if self.settings[2] >= 128 {
            varint(&mut table, self.resources.len() as u64);
        }
        for (k, resource) in (0..).zip(&self.resources) {
            table.push(resource.kind);
            varint(&mut table, resource.place);
            let run = self.atoms.iter().filter(|atom| atom.kind == RESOURCE && atom.items == k);
            entries(&mut table, &run.collect::<Vec<_>>(), 0);
        }
        varint(&mut table, self.levels.len() as u64);
        for (j, level) in self.levels.iter().enumerate().rev() {
            match self.levels.get(j + 1) {
                None => {
                    for count in [level.vertices, level.triangles, level.shift.into()] {
                        varint(&mut table, count);
                    }
                    table.extend(level.errors.iter().flat_map(|code| code.to_le_bytes()));
                    table.extend(self.attribute_errors.get(j).into_iter().flatten());
                    self.run(&mut table, BASE, j as u64, 0);
                }
                Some(coarser) => {
                    let last = self.atoms.iter().rfind(|atom| (atom.kind, atom.level) == (BIRTH, j as u64));
                    let born = last.map_or([0; 2], |last| [last.items, last.triangles]);
                    if last.is_some() {
                        varint(&mut table, 0);
                        born.into_iter().for_each(|count| varint(&mut table, count));
                    }
                    let added = level.vertices.wrapping_sub(coarser.vertices).wrapping_sub(born[0]);
                    let triangles = level.triangles.wrapping_sub(coarser.triangles).wrapping_sub(born[1]);
                    let single = added.wrapping_mul(2).wrapping_sub(triangles);
                    let finer = coarser.shift.wrapping_sub(level.shift);
                    let marks = u64::from(single > 0) + 2 * u64::from(finer > 0);
                    varint(&mut table, added.wrapping_mul(4).wrapping_add(marks));
                    for more in [single, finer.into()].into_iter().filter(|more| *more > 0) {
                        varint(&mut table, more);
                    }
                    for (code, before) in level.errors.iter().zip(coarser.errors) {
                        let difference = i64::from(*code) - i64::from(before) + 48;
                        varint(
                            &mut table,
                            if difference < 0 { -2 * difference - 1 } else { 2 * difference } as u64,
                        );
                    }
                    table.extend(self.attribute_errors.get(j).into_iter().flatten());
                    if finer > 0 {
                        self.run(&mut table, PRECISION, j as u64, 0);
                    }
                    self.run(&mut table, REFINEMENT, j as u64, single);
                    self.run(&mut table, BIRTH, j as u64, 0);
                    if j > 0 {
                        self.run(&mut table, ATTRIBUTES, j as u64, 0);
                    }
                }
            }
        }
        let has_place = |atom: &&Atom| match atom.kind {
            ATTRIBUTES => atom.level > 0,
            kind => kind <= REFINEMENT || kind == BIRTH || kind == RESOURCE,
        };
        let mut behind = self.atoms.iter().filter(|atom| !has_place(atom)).peekable();
        while let Some(atom) = behind.next() {
            table.push(atom.kind);
            if atom.kind == KEYFRAME {
                varint(&mut table, atom.level);
            }
            let mut run = vec![atom];
            while let Some(next) = behind.next_if(|next| (next.kind, next.level) == (atom.kind, atom.level)) {
                run.push(next);
            }
            entries(&mut table, &run, 0);
        }
        table
    }

    fn run(&self, table: &mut Vec<u8>, kind: u8, level: u64, single: u64) {
        let run: Vec<_> = self.atoms.iter().filter(|atom| (atom.kind, atom.level) == (kind, level)).collect();
        entries(table, &run, single);
    }

    pub fn bytes(&self) -> Vec<u8> {
        self.with_table(&self.table())
    }

    /// The file with this table, whatever it says.
    pub fn with_table(&self, table: &[u8]) -> Vec<u8> {
        let mut bytes = b"\x89UWM\r\n\x1A\n\x01\x00".to_vec();
        bytes.extend(self.settings);
        bytes.extend(&(table.len() as u32 + 4).to_le_bytes()[..3]);
        bytes.extend(table);
        self.sealed(bytes)
    }

    /// Header and table, with their checksum and the atoms.
    fn sealed(&self, mut bytes: Vec<u8>) -> Vec<u8> {
        bytes.extend(crc32c(&bytes).to_le_bytes());
        bytes.extend(self.atoms.iter().flat_map(|a| &a.bytes));
        bytes
    }

    /// All files that differ from this one in the bits of `mask` in one byte and in what checksums follow from it.
    pub fn changed(&self, mask: u8) -> impl Iterator<Item = Vec<u8>> + '_ {
        let whole = self.bytes();
        let head = whole[..16 + self.table().len()].to_vec();
        let heads = (0..head.len()).map(move |i| {
            let mut head = head.clone();
            head[i] ^= mask;
            self.sealed(head)
        });
        let places = self.atoms.iter().enumerate().flat_map(|(k, a)| (0..a.bytes.len()).map(move |i| (k, i)));
        let atoms = places.map(move |(k, i)| {
            let mut draft = self.clone();
            draft.atoms[k].bytes[i] ^= mask;
            draft.bytes()
        });
        heads.chain(atoms)
    }
}

fn entries(table: &mut Vec<u8>, run: &[&Atom], mut single: u64) {
    for (k, atom) in run.iter().enumerate() {
        let more = k + 1 < run.len();
        varint(table, 2 * atom.bytes.len() as u64 + u64::from(more));
        if more && (atom.kind == PRECISION || atom.kind == REFINEMENT) {
            varint(table, atom.items);
            if single > 0 {
                let of_atom = (2 * atom.items).wrapping_sub(atom.triangles);
                varint(table, of_atom);
                single = single.wrapping_sub(of_atom);
            }
        }
        let sum = checksum(&atom.bytes).to_le_bytes();
        table.extend(&sum[..if atom.bytes.len() < 1024 { 2 } else { 4 }]);
    }
}

/// An atom without a checksum yet.
pub fn atom(kind: u8, level: u64, items: u64, triangles: u64, bytes: &[u8]) -> Atom {
    Atom { kind, level, items, triangles, length: bytes.len(), sum: 0, bytes: bytes.to_vec() }
}

fn varint(bytes: &mut Vec<u8>, mut value: u64) {
    while value >= 128 {
        bytes.push(value as u8 | 128);
        value >>= 7;
    }
    bytes.push(value as u8);
}
