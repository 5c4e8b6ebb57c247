//! KTX 2.0 (Khronos): a picture with its coarsest mips alone, cut out of one without decoding any.

/// What the head of a file tells.
struct Head {
    pixels: [u32; 2],
    scheme: u32,
    /// Where the descriptor, the keys and the global data lie: begin and length.
    descriptor: [usize; 2],
    keys: [usize; 2],
    global: [usize; 2],
    levels: Vec<Level>,
}

#[derive(Clone, Copy)]
struct Level {
    begin: usize,
    length: usize,
    /// Bytes without supercompression; 0 where the scheme does not tell.
    unpacked: u64,
}

/// The width and the height that a file tells of; 0 where it ends before.
pub(super) fn pixels(bytes: &[u8]) -> [u32; 2] {
    [word(bytes, 20).unwrap_or(0), word(bytes, 24).unwrap_or(0)]
}

/// The same picture without the mips of which a side is longer than so many pixels: a file of its own, whose levels are those of `bytes`, byte for
/// byte. `None` where there are no such mips, or no larger ones; for layers, cubes and volumes; for what is not understood.
pub(super) fn smaller(bytes: &[u8], most: u32) -> Option<Vec<u8>> {
    let head = Head::of(bytes)?;
    let side = |k: usize, level: u32| (head.pixels[k] >> level.min(31)).max(1);
    let count = head.levels.len() as u32;
    let first = (0..count).find(|&level| side(0, level).max(side(1, level)) <= most)?;
    let [width, height] = [side(0, first), side(1, first)];
    // Blocks of four by four: WebGL wants whole ones at the first level.
    if first == 0 || width % BLOCK != 0 || height % BLOCK != 0 {
        return None;
    }
    let kept = &head.levels[first as usize..];
    // Levels that overlap would be more than there is.
    if kept.iter().map(|level| level.length).sum::<usize>() > bytes.len() {
        return None;
    }
    let part = |[begin, length]: [usize; 2]| bytes.get(begin..begin.checked_add(length)?);
    let (descriptor, keys) = (part(head.descriptor)?, part(head.keys)?);
    let global = match head.scheme {
        BASIS_LZ => basis_global(part(head.global)?, head.levels.len(), first as usize)?,
        _ if head.global[1] > 0 => return None,
        _ => Vec::new(),
    };
    let mut out = bytes.get(..INDEX)?.to_vec();
    put(&mut out, 20, &width.to_le_bytes());
    put(&mut out, 24, &height.to_le_bytes());
    put(&mut out, 40, &(kept.len() as u32).to_le_bytes());
    out.resize(INDEX + LEVEL * kept.len(), 0);
    let begin = out.len();
    out.extend_from_slice(descriptor);
    put(&mut out, 48, &(begin as u32).to_le_bytes());
    let begin = if keys.is_empty() { 0 } else { out.len() };
    out.extend_from_slice(keys);
    put(&mut out, 56, &(begin as u32).to_le_bytes());
    if !global.is_empty() {
        out.resize(out.len().next_multiple_of(8), 0);
        let begin = out.len() as u64;
        put(&mut out, 64, &begin.to_le_bytes());
        put(&mut out, 72, &(global.len() as u64).to_le_bytes());
        out.extend_from_slice(&global);
    }
    // Levels that are not packed begin at whole blocks of texels, and at words.
    let aligned = if head.scheme == 0 { whole_blocks(descriptor)? } else { 1 };
    for (k, level) in kept.iter().enumerate().rev() {
        out.resize(out.len().next_multiple_of(aligned), 0);
        let begin = out.len() as u64;
        out.extend_from_slice(part([level.begin, level.length])?);
        let entry = INDEX + LEVEL * k;
        put(&mut out, entry, &begin.to_le_bytes());
        put(&mut out, entry + 8, &(level.length as u64).to_le_bytes());
        put(&mut out, entry + 16, &level.unpacked.to_le_bytes());
    }
    Some(out)
}

impl Head {
    fn of(bytes: &[u8]) -> Option<Self> {
        let at = |at: usize| word(bytes, at);
        let pixels = [at(20)?, at(24)?];
        let [depth, layers, faces, levels, scheme] = [at(28)?, at(32)?, at(36)?, at(40)?, at(44)?];
        let is_flat = depth == 0 && layers <= 1 && faces == 1;
        if !is_flat || pixels.contains(&0) || !(1..=MOST_LEVELS).contains(&levels) || scheme > MOST_SCHEME {
            return None;
        }
        let short = |at: usize| Some([word(bytes, at)? as usize, word(bytes, at + 4)? as usize]);
        let level = |k: u32| {
            let at = INDEX + LEVEL * k as usize;
            let (begin, length) = (long(bytes, at)?, long(bytes, at + 8)?);
            let is_there = begin.checked_add(length).is_some_and(|end| end <= bytes.len() as u64);
            is_there.then_some(())?;
            Some(Level { begin: begin as usize, length: length as usize, unpacked: long(bytes, at + 16)? })
        };
        let levels = (0..levels).map(level).collect::<Option<Vec<_>>>()?;
        let global = [usize::try_from(long(bytes, 64)?).ok()?, usize::try_from(long(bytes, 72)?).ok()?];
        Some(Self { pixels, scheme, descriptor: short(48)?, keys: short(56)?, global, levels })
    }
}

/// The global data of Basis Universal's LZ for the levels from `first` on: a head, an entry for each level's picture, and the code books.
fn basis_global(global: &[u8], levels: usize, first: usize) -> Option<Vec<u8>> {
    let entries = global.get(BASIS_HEAD..)?.get(..levels.checked_mul(BASIS_ENTRY)?)?;
    let books = &global[BASIS_HEAD + entries.len()..];
    Some([&global[..BASIS_HEAD], &entries[first * BASIS_ENTRY..], books].concat())
}

/// The least common multiple of the bytes of a block of texels and of 4.
fn whole_blocks(descriptor: &[u8]) -> Option<usize> {
    let block = usize::from(*descriptor.get(20)?);
    (block > 0).then(|| (1..=4).map(|k| k * block).find(|size| size % 4 == 0)).flatten()
}

fn word(bytes: &[u8], at: usize) -> Option<u32> {
    Some(u32::from_le_bytes(*bytes.get(at..)?.first_chunk()?))
}

fn long(bytes: &[u8], at: usize) -> Option<u64> {
    Some(u64::from_le_bytes(*bytes.get(at..)?.first_chunk()?))
}

fn put(out: &mut [u8], at: usize, bytes: &[u8]) {
    out[at..at + bytes.len()].copy_from_slice(bytes);
}

/// Where the index of levels begins, and the bytes of an entry of it.
const INDEX: usize = 80;
const LEVEL: usize = 24;
const MOST_LEVELS: u32 = 32;
/// Pixels of a block's side.
const BLOCK: u32 = 4;
/// Schemes of supercompression: none, Basis Universal's LZ, Zstandard, and zlib, the last.
const BASIS_LZ: u32 = 1;
const MOST_SCHEME: u32 = 3;
const BASIS_HEAD: usize = 20;
const BASIS_ENTRY: usize = 20;

#[cfg(test)]
mod tests {
    use super::*;

    /// A file of so many pixels with all its mips, level k being of bytes k.
    fn picture(width: u32, height: u32, scheme: u32, block: u8) -> Vec<u8> {
        let levels = 32 - width.max(height).leading_zeros();
        let mut descriptor = vec![0; 44];
        descriptor[0] = 44;
        descriptor[20] = block;
        let keys = b"\x09\0\0\0k\0valuexx\0\0\0".to_vec();
        let global: Vec<u8> = match scheme {
            BASIS_LZ => {
                [vec![7; 20], (0..levels).flat_map(|k| [k as u8; 20]).collect(), vec![8; 30]].concat()
            }
            _ => vec![],
        };
        let mut out = b"\xabKTX 20\xbb\r\n\x1a\n".to_vec();
        let begin = INDEX + LEVEL * levels as usize;
        for word in [0, 1, width, height, 0, 0, 1, levels, scheme] {
            out.extend(word.to_le_bytes());
        }
        for word in [begin, descriptor.len(), begin + descriptor.len(), keys.len()] {
            out.extend((word as u32).to_le_bytes());
        }
        let at = (begin + descriptor.len() + keys.len()).next_multiple_of(8);
        out.extend((if global.is_empty() { 0 } else { at as u64 }).to_le_bytes());
        out.extend((global.len() as u64).to_le_bytes());
        out.resize(begin, 0);
        out.extend([descriptor, keys].concat());
        out.resize(at, 0);
        out.extend(&global);
        for k in (0..levels).rev() {
            out.resize(out.len().next_multiple_of(48), 0);
            let length = 100 * u64::from(levels - k);
            let begin = out.len() as u64;
            put(&mut out, INDEX + LEVEL * k as usize, &begin.to_le_bytes());
            put(&mut out, INDEX + LEVEL * k as usize + 8, &length.to_le_bytes());
            put(&mut out, INDEX + LEVEL * k as usize + 16, &(length + 1).to_le_bytes());
            out.resize(out.len() + length as usize, k as u8);
        }
        out
    }

    #[test]
    fn coarse_mips_are_a_picture() {
        for (scheme, block) in [(0, 16), (0, 3), (BASIS_LZ, 0), (2, 0)] {
            let bytes = picture(512, 256, scheme, block);
            let small = smaller(&bytes, 64).unwrap();
            assert_eq!((pixels(&bytes), pixels(&small)), ([512, 256], [64, 32]));
            let (before, after) = (Head::of(&bytes).unwrap(), Head::of(&small).unwrap());
            assert_eq!((before.levels.len(), after.levels.len(), after.scheme), (10, 7, scheme));
            for (k, (old, new)) in before.levels[3..].iter().zip(&after.levels).enumerate() {
                assert_eq!(small[new.begin..][..new.length], vec![k as u8 + 3; old.length]);
                assert_eq!(new.unpacked, old.unpacked);
                let aligned = [16, 12][usize::from(block == 3)];
                assert!(scheme != 0 || new.begin % aligned == 0, "{}", new.begin);
            }
            let part = |bytes: &[u8], [begin, length]: [usize; 2]| bytes[begin..][..length].to_vec();
            assert_eq!(part(&small, after.descriptor), part(&bytes, before.descriptor));
            assert_eq!(part(&small, after.keys), part(&bytes, before.keys));
            let global = part(&small, after.global);
            if scheme == BASIS_LZ {
                let entries: Vec<u8> = (3..10).flat_map(|k| [k; 20]).collect();
                assert_eq!(global, [vec![7; 20], entries, vec![8; 30]].concat());
                assert_eq!(after.global[0] % 8, 0);
            } else {
                assert!(global.is_empty());
            }
            // Of itself nothing is left out.
            assert_eq!(smaller(&small, 64), None);
            // All beginnings and all changes of a byte of the head are borne.
            for length in 0..bytes.len().min(400) {
                assert_eq!(smaller(&bytes[..length], 64), None);
            }
            for at in 12..INDEX + LEVEL * 10 {
                for value in [0, 1, 127, 255] {
                    let mut changed = bytes.clone();
                    changed[at] = value;
                    let _ = smaller(&changed, 64);
                }
            }
        }
    }

    #[test]
    fn what_has_none() {
        // Not of whole blocks; of one mip; a cube.
        assert_eq!(smaller(&picture(300, 300, 0, 16), 64), None);
        assert_eq!(smaller(&picture(64, 64, 0, 16), 64), None);
        let mut cube = picture(512, 512, 0, 16);
        put(&mut cube, 36, &6u32.to_le_bytes());
        assert_eq!(smaller(&cube, 64), None);
    }
}
