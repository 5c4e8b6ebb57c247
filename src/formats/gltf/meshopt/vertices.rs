//! Vertices: differences of bytes, of 16 bits or of 32 bits, in blocks, in groups of 16 of which each has a width in bits.

use super::take;

/// Unpacks `count` vertices of `size` bytes, a multiple of four up to 256; nothing where the data are damaged or end early.
pub(super) fn unpack(packed: &[u8], count: usize, size: usize) -> Option<Vec<u8>> {
    let mut rest = packed;
    let header = *take(&mut rest, 1)?.first()?;
    let version = match header {
        0xa0 => 0,
        0xa1 => 1,
        _ => return None,
    };
    // The last bytes are the vertex that the first one differs from, and in version 1 how each four bytes differ.
    let tail = size + if version == 0 { 0 } else { size / 4 };
    let padded = tail.max(if version == 0 { 32 } else { 24 });
    let (mut rest, tail_bytes) = rest.split_at_checked(rest.len().checked_sub(padded)?)?;
    let (first, channels) = tail_bytes.get(padded - tail..)?.split_at_checked(size)?;
    let mut last = first.to_vec();
    let mut unpacked = vec![0; count * size];
    let block = ((BLOCK_BYTES / size) & !(GROUP - 1)).min(BLOCK);
    for vertices in unpacked.chunks_mut(block * size) {
        let count = vertices.len() / size;
        let controls = take(&mut rest, if version == 0 { 0 } else { size / 4 })?;
        for k in (0..size).step_by(4) {
            let control = controls.get(k / 4).copied().unwrap_or(0);
            let mut columns = [[0; BLOCK]; 4];
            for (j, column) in columns.iter_mut().enumerate() {
                match (version, control >> (2 * j) & 3) {
                    (0, _) => groups(&mut rest, column, count, [0, 2, 4, 8])?,
                    (_, 0) => groups(&mut rest, column, count, [0, 1, 2, 4])?,
                    (_, 1) => groups(&mut rest, column, count, [1, 2, 4, 8])?,
                    (_, 2) => {}
                    _ => column[..count].copy_from_slice(take(&mut rest, count)?),
                }
            }
            let channel = channels.get(k / 4).copied().unwrap_or(0);
            let mut before = [last[k], last[k + 1], last[k + 2], last[k + 3]];
            for (v, vertex) in vertices.chunks_exact_mut(size).enumerate() {
                before = next(before, columns.map(|column| column[v]), channel)?;
                vertex[k..k + 4].copy_from_slice(&before);
            }
        }
        last.copy_from_slice(&vertices[(count - 1) * size..]);
    }
    rest.is_empty().then_some(unpacked)
}

/// Packs vertices of `size` bytes, a multiple of four up to 256, in version 0, which all readers know.
pub(super) fn pack(bytes: &[u8], size: usize) -> Vec<u8> {
    let mut packed = vec![0xa0];
    let first = bytes.get(..size).unwrap_or_default();
    let mut last = first.to_vec();
    let block = ((BLOCK_BYTES / size) & !(GROUP - 1)).min(BLOCK);
    for vertices in bytes.chunks(block * size) {
        for (k, before) in last.iter_mut().enumerate() {
            let column: Vec<u8> = vertices
                .iter()
                .skip(k)
                .step_by(size)
                .map(|&byte| {
                    let by = byte.wrapping_sub(std::mem::replace(before, byte));
                    (by << 1) ^ (by >> 7).wrapping_neg()
                })
                .collect();
            pack_groups(&column, &mut packed);
        }
    }
    packed.resize(packed.len() + 32usize.saturating_sub(size), 0);
    packed.extend(first);
    packed
}

/// Four bytes of a vertex, from those of the vertex before and what differs.
#[inline]
fn next(before: [u8; 4], by: [u8; 4], channel: u8) -> Option<[u8; 4]> {
    let unzigzag_8 = |v: u8| (v & 1).wrapping_neg() ^ (v >> 1);
    let unzigzag_16 = |v: u16| (v & 1).wrapping_neg() ^ (v >> 1);
    Some(match channel & 3 {
        0 => [0, 1, 2, 3].map(|k| unzigzag_8(by[k]).wrapping_add(before[k])),
        1 => {
            let half = |x: [u8; 4], k: usize| u16::from_le_bytes([x[k], x[k + 1]]);
            let [a, b] = [0, 2].map(|k| unzigzag_16(half(by, k)).wrapping_add(half(before, k)).to_le_bytes());
            [a[0], a[1], b[0], b[1]]
        }
        2 => {
            let turned = u32::from_le_bytes(by).rotate_right(u32::from(channel >> 4));
            (turned ^ u32::from_le_bytes(before)).to_le_bytes()
        }
        _ => return None,
    })
}

/// Bytes in groups of 16, of which two bits each tell how wide they are.
fn groups(rest: &mut &[u8], column: &mut [u8; BLOCK], count: usize, widths: [usize; 4]) -> Option<()> {
    let groups = count.div_ceil(GROUP);
    let header = take(rest, groups.div_ceil(4))?;
    for (k, group) in column.chunks_exact_mut(GROUP).take(groups).enumerate() {
        let width = widths[usize::from(header[k / 4] >> (k % 4 * 2) & 3)];
        match width {
            0 => group.fill(0),
            8 => group.copy_from_slice(take(rest, GROUP)?),
            width => {
                let packed = take(rest, GROUP * width / 8)?;
                let escape = (1u8 << width) - 1;
                let each = 8 / width;
                for (at, value) in group.iter_mut().enumerate() {
                    // Single bits come from below, others from above.
                    let place = at % each;
                    let shift = if width == 1 { place } else { 8 - width * (place + 1) };
                    *value = packed[at / each] >> shift & escape;
                    if *value == escape {
                        *value = *take(rest, 1)?.first()?;
                    }
                }
            }
        }
    }
    Some(())
}

/// Each group with the width that takes the fewest bytes.
fn pack_groups(column: &[u8], packed: &mut Vec<u8>) {
    let header = packed.len();
    packed.resize(header + column.len().div_ceil(GROUP).div_ceil(4), 0);
    for (k, part) in column.chunks(GROUP).enumerate() {
        let mut group = [0; GROUP];
        group[..part.len()].copy_from_slice(part);
        let escapes = |width: usize| group.iter().filter(|&&value| value >= (1 << width) - 1).count();
        let bytes = |width: usize| GROUP * width / 8 + escapes(width);
        let (code, width) = match () {
            _ if group == [0; GROUP] => (0, 0),
            _ if bytes(2) <= bytes(4).min(GROUP) => (1, 2),
            _ if bytes(4) <= GROUP => (2, 4),
            _ => (3, 8),
        };
        packed[header + k / 4] |= code << (k % 4 * 2);
        match width {
            0 => {}
            8 => packed.extend(group),
            width => {
                let escape = (1u8 << width) - 1;
                let join = |values: &[u8]| values.iter().fold(0, |byte, &v| byte << width | v.min(escape));
                packed.extend(group.chunks(8 / width).map(join));
                packed.extend(group.iter().filter(|&&value| value >= escape));
            }
        }
    }
}

const BLOCK_BYTES: usize = 8192;
const BLOCK: usize = 256;
const GROUP: usize = 16;

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn what_is_packed_is_unpacked(
            words in 1usize..8, count in 0usize..600, seed in prop::collection::vec(any::<u8>(), 1..50), steps in 1u8..=255,
        ) {
            let size = 4 * words;
            // Smooth, wild and constant columns.
            let byte = |at: usize| match at % size % 3 {
                0 => (at / size * usize::from(seed[at % size % seed.len()] % steps)) as u8,
                1 => seed[at % seed.len()].wrapping_mul(at as u8),
                _ => seed[0],
            };
            let bytes: Vec<u8> = (0..count * size).map(byte).collect();
            prop_assert_eq!(unpack(&pack(&bytes, size), count, size), (count > 0).then_some(bytes));
        }
    }
}
