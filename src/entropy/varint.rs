//! Unsigned integers in LEB128: seven bits a byte, low bits first, the high bit set on all but the last byte
//! (spec §3). Every value has exactly one accepted form, its shortest.

/// Most bytes of one integer.
pub const MAX_BYTES: usize = 10;

/// Reads an integer off the front of `bytes`.
///
/// `None` where `bytes` ends inside it, where a shorter form exists, or where it exceeds 64 bits; `bytes` is
/// then left as it was.
pub fn read(bytes: &mut &[u8]) -> Option<u64> {
    let mut value = 0;
    for (i, &byte) in bytes.iter().take(MAX_BYTES).enumerate() {
        if i == MAX_BYTES - 1 && byte > 1 {
            return None;
        }
        value |= u64::from(byte & 0x7F) << (7 * i);
        if byte & 0x80 == 0 {
            if byte == 0 && i > 0 {
                return None;
            }
            *bytes = bytes.get(i + 1..)?;
            return Some(value);
        }
    }
    None
}

/// Appends the shortest form of `value`.
#[cfg(any(test, feature = "encode"))]
pub fn write(mut value: u64, out: &mut Vec<u8>) {
    while value >= 0x80 {
        out.push(value as u8 | 0x80);
        value >>= 7;
    }
    out.push(value as u8);
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn read_all(mut bytes: &[u8]) -> Option<(u64, usize)> {
        read(&mut bytes).map(|value| (value, bytes.len()))
    }

    #[test]
    fn known_forms() {
        assert_eq!(read_all(&[0]), Some((0, 0)));
        assert_eq!(read_all(&[0x7F, 9]), Some((127, 1)));
        assert_eq!(read_all(&[0x80, 0x01]), Some((128, 0)));
        assert_eq!(read_all(&[0xE5, 0x8E, 0x26]), Some((624_485, 0)));
        let mut most = [0xFF; 10];
        most[9] = 0x01;
        assert_eq!(read_all(&most), Some((u64::MAX, 0)));
    }

    #[test]
    fn other_forms_are_refused() {
        assert_eq!(read_all(&[]), None, "empty");
        assert_eq!(read_all(&[0x80]), None, "ends inside");
        assert_eq!(read_all(&[0x80, 0x00]), None, "overlong 0");
        assert_eq!(read_all(&[0xFF, 0x80, 0x00]), None, "overlong 127");
        let mut bytes = [0xFF; 10];
        bytes[9] = 0x02;
        assert_eq!(read_all(&bytes), None, "65 bits");
        assert_eq!(read_all(&[0x80; 11]), None, "no end");
        let mut kept: &[u8] = &[0x80, 0x00];
        assert_eq!((read(&mut kept), kept.len()), (None, 2));
    }

    proptest! {
        #[test]
        fn round_trip(value: u64, shift in 0u32..64, tail: Vec<u8>) {
            let value = value >> shift;
            let mut bytes = Vec::new();
            write(value, &mut bytes);
            prop_assert_eq!(bytes.len(), ((64 - value.leading_zeros()).max(1) as usize).div_ceil(7));
            bytes.extend(&tail);
            prop_assert_eq!(read_all(&bytes), Some((value, tail.len())));
        }

        #[test]
        fn what_is_read_is_what_would_be_written(bytes in proptest::collection::vec(any::<u8>(), 0..12)) {
            if let Some((value, rest)) = read_all(&bytes) {
                let mut again = Vec::new();
                write(value, &mut again);
                prop_assert_eq!(&bytes[..bytes.len() - rest], &again[..]);
            }
        }
    }
}
