//! A file in parts, to be changed and sealed again with checksums that fit.

use super::container::{Atom, File, crc32c};

/// A file without the fields that follow from the others.
#[derive(Clone)]
pub struct Draft {
    /// Bytes 0 to 79 of the header.
    pub header: Vec<u8>,
    /// The level entries as they stand in the table.
    pub levels: Vec<u8>,
    pub atoms: Vec<Atom>,
}

impl Draft {
    /// The parts of a sound file.
    pub fn of(bytes: &[u8]) -> Self {
        let file = File::read(bytes).expect("a sound file");
        let mut levels = Vec::new();
        for (j, level) in file.levels.iter().enumerate().rev() {
            if let Some(coarser) = file.levels.get(j + 1) {
                varint(&mut levels, level.vertices - coarser.vertices);
                varint(&mut levels, level.triangles - coarser.triangles);
            }
            levels.push(level.shift as u8);
            levels.extend(level.max_error.to_le_bytes());
            levels.extend(level.rms_error.to_le_bytes());
        }
        Self { header: bytes[..80].to_vec(), levels, atoms: file.atoms }
    }

    /// The table of contents without its checksum.
    pub fn table(&self) -> Vec<u8> {
        let mut table = self.levels.clone();
        varint(&mut table, self.atoms.len() as u64);
        for atom in &self.atoms {
            table.push(atom.kind);
            for field in [atom.level, atom.bytes.len() as u64, atom.items, atom.triangles] {
                varint(&mut table, field);
            }
            table.extend(crc32c(&atom.bytes).to_le_bytes());
        }
        table
    }

    pub fn bytes(&self) -> Vec<u8> {
        self.with_table(&self.table())
    }

    /// The file with this table, whatever it says.
    pub fn with_table(&self, table: &[u8]) -> Vec<u8> {
        let mut bytes = self.header.clone();
        bytes.extend((table.len() as u32 + 4).to_le_bytes());
        bytes.extend(crc32c(&bytes).to_le_bytes());
        bytes.extend(table);
        bytes.extend(crc32c(table).to_le_bytes());
        bytes.extend(self.atoms.iter().flat_map(|a| &a.bytes));
        bytes
    }

    /// All files that differ from this one in the bits of `mask` in one byte and in what checksums follow from it.
    pub fn changed(&self, mask: u8) -> impl Iterator<Item = Vec<u8>> + '_ {
        let table = self.table();
        let headers = (0..self.header.len()).map(move |i| {
            let mut draft = self.clone();
            draft.header[i] ^= mask;
            draft.bytes()
        });
        let tables = (0..table.len()).map(move |i| {
            let mut table = table.clone();
            table[i] ^= mask;
            self.with_table(&table)
        });
        let places = self.atoms.iter().enumerate().flat_map(|(k, a)| (0..a.bytes.len()).map(move |i| (k, i)));
        let atoms = places.map(move |(k, i)| {
            let mut draft = self.clone();
            draft.atoms[k].bytes[i] ^= mask;
            draft.bytes()
        });
        headers.chain(tables).chain(atoms)
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
