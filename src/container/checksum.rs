//! Checksums (spec §3.4).

/// Atoms of fewer bytes have a checksum of two bytes, not four: it finds every change of up to three bits of them, and every run of changes
/// of up to 16 bits.
pub(super) const SHORT: u32 = 1024;

/// The checksum of an atom.
pub(super) fn of_atom(bytes: &[u8]) -> u32 {
    if bytes.len() < SHORT as usize { u32::from(crc16(bytes)) } else { append(0, bytes) }
}

/// CRC-32C of bytes behind others that have such a sum; that of none is 0.
#[cfg(not(target_family = "wasm"))]
pub(super) use crc32c::crc32c_append as append;
#[cfg(target_family = "wasm")]
pub(super) use small::append;

/// CRC-32C for the module that pages fetch: its table, which cannot be compressed, is made anew with each call.
#[cfg(any(test, target_family = "wasm"))]
mod small {
    pub fn append(sum: u32, bytes: &[u8]) -> u32 {
        let table = table();
        !bytes.iter().fold(!sum, |crc, &byte| crc >> 8 ^ table[usize::from(crc as u8 ^ byte)])
    }

    fn table() -> [u32; 256] {
        let mut table = [0; 256];
        let mut crc = 1;
        for bit in (0..8).rev() {
            crc = crc >> 1 ^ if crc & 1 == 1 { 0x82F6_3B78 } else { 0 };
            table[1 << bit] = crc;
        }
        // The sum of several bits is that of each alone.
        for k in 1..256usize {
            table[k] = table[k & (k - 1)] ^ table[k & k.wrapping_neg()];
        }
        table
    }
}

/// CRC-16 with the polynomial 1021, in the form of IBM 3740.
fn crc16(bytes: &[u8]) -> u16 {
    bytes.iter().fold(0xFFFF, |crc, &byte| {
        (0..8)
            .fold(crc ^ (u16::from(byte) << 8), |crc, _| (crc << 1) ^ if crc >> 15 == 1 { 0x1021 } else { 0 })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_sums() {
        assert_eq!(of_atom(b"123456789"), 0x29B1);
        let long = [b"123456789".as_slice(), &[0; 1024]].concat();
        assert_eq!(of_atom(&long), crc32c::crc32c(&long));
        assert_eq!(of_atom(&long[..1024]), crc32c::crc32c(&long[..1024]));
        let sums = [9, 1000].map(|at| small::append(small::append(0, &long[..at]), &long[at..]));
        assert_eq!(sums, [crc32c::crc32c(&long); 2]);
        assert_eq!(of_atom(&long[..1023]), u32::from(crc16(&long[..1023])));
    }

    /// A change is missed where the sums of its bits, each alone, cancel out.
    #[test]
    fn two_changed_bits_are_found_in_the_longest_atom_that_has_it() {
        let plain = [0; SHORT as usize - 1];
        let mut sums = std::collections::HashSet::from([0]);
        for bit in 0..8 * plain.len() {
            let mut changed = plain;
            changed[bit / 8] ^= 1 << (bit % 8);
            assert!(sums.insert(crc16(&changed) ^ crc16(&plain)), "bit {bit}");
        }
    }
}
