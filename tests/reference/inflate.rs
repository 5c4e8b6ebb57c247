//! Deflated data (RFC 1951), bit by bit.

use super::container::{Result, demand, refuse};

/// All that the data stand for; they end with their last block, but for the bits that fill up a byte.
pub fn inflate(bytes: &[u8]) -> Result<Vec<u8>> {
    let mut bits = Bits { bytes, at: 0 };
    let mut out = Vec::new();
    loop {
        let last = bits.number(1)? == 1;
        match bits.number(2)? {
            0 => {
                bits.at = bits.at.div_ceil(8) * 8;
                let (length, complement) = (bits.number(16)?, bits.number(16)?);
                demand(length ^ complement == 0xFFFF, "3.9: length of a stored block")?;
                for _ in 0..length {
                    out.push(bits.number(8)? as u8);
                }
            }
            1 => {
                let lengths = (0..288).map(|symbol| match symbol {
                    0..144 => 8,
                    144..256 => 9,
                    256..280 => 7,
                    _ => 8,
                });
                block(&mut bits, &mut out, &Code::new(lengths.collect())?, &Code::new(vec![5; 32])?)?;
            }
            2 => {
                let (literals, distances) = codes(&mut bits)?;
                block(&mut bits, &mut out, &literals, &distances)?;
            }
            _ => return refuse("3.9: a kind of block that there is not"),
        }
        if last {
            demand(bits.at.div_ceil(8) == bytes.len(), "3.9: bytes behind the last block")?;
            return Ok(out);
        }
    }
}

struct Bits<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl Bits<'_> {
    fn bit(&mut self) -> Result<u32> {
        let Some(byte) = self.bytes.get(self.at / 8) else { return refuse("3.9: bits are missing") };
        let bit = byte >> (self.at % 8) & 1;
        self.at += 1;
        Ok(bit.into())
    }

    /// A number of so many bits, low bits first.
    fn number(&mut self, count: u32) -> Result<u32> {
        let mut number = 0;
        for k in 0..count {
            number |= self.bit()? << k;
        }
        Ok(number)
    }
}

/// A prefix code: the lengths of the codes of its symbols, 0 of those that have none.
struct Code(Vec<u32>);

impl Code {
    fn new(lengths: Vec<u32>) -> Result<Self> {
        let used = lengths.iter().filter(|&&length| length > 0).count();
        let share =
            lengths.iter().filter(|&&length| length > 0).map(|&length| 1u32 << (15 - length)).sum::<u32>();
        demand(share == 1 << 15 || used <= 1, "3.9: codes that no tree has")?;
        Ok(Self(lengths))
    }

    /// Codes of one length are consecutive, in the order of the symbols; shorter ones come before longer ones.
    fn symbol(&self, bits: &mut Bits) -> Result<u32> {
        let (mut code, mut first) = (0, 0);
        for length in 1..16 {
            code = 2 * code + bits.bit()?;
            first *= 2;
            let mut own = (0..).zip(&self.0).filter(|&(_, &other)| other == length).map(|(symbol, _)| symbol);
            if code >= first
                && let Some(symbol) = own.clone().nth((code - first) as usize)
            {
                return Ok(symbol);
            }
            first += own.by_ref().count() as u32;
        }
        refuse("3.9: a code of no symbol")
    }
}

/// The codes of a block of its own.
fn codes(bits: &mut Bits) -> Result<(Code, Code)> {
    let counts = [bits.number(5)? + 257, bits.number(5)? + 1].map(|count| count as usize);
    let count = bits.number(4)? + 4;
    demand(counts[0] <= 286, "3.9: symbols that there are not")?;
    let mut lengths = vec![0; 19];
    for &symbol in &ORDER[..count as usize] {
        lengths[symbol] = bits.number(3)?;
    }
    let code = Code::new(lengths)?;
    let mut lengths: Vec<u32> = Vec::new();
    while lengths.len() < counts[0] + counts[1] {
        let (length, times) = match code.symbol(bits)? {
            16 => match lengths.last() {
                Some(&last) => (last, 3 + bits.number(2)?),
                None => return refuse("3.9: a repetition of nothing"),
            },
            17 => (0, 3 + bits.number(3)?),
            18 => (0, 11 + bits.number(7)?),
            length => (length, 1),
        };
        lengths.extend((0..times).map(|_| length));
    }
    demand(lengths.len() == counts[0] + counts[1], "3.9: more lengths than symbols")?;
    let distances = lengths.split_off(counts[0]);
    Ok((Code::new(lengths)?, Code::new(distances)?))
}

fn block(bits: &mut Bits, out: &mut Vec<u8>, literals: &Code, distances: &Code) -> Result<()> {
    loop {
        let symbol = literals.symbol(bits)?;
        let length = match symbol {
            0..256 => {
                out.push(symbol as u8);
                continue;
            }
            256 => return Ok(()),
            257..265 => symbol - 254,
            265..285 => {
                let extra = (symbol - 261) / 4;
                ((4 + (symbol - 265) % 4) << extra) + 3 + bits.number(extra)?
            }
            285 => 258,
            _ => return refuse("3.9: a length that there is not"),
        };
        let distance = match distances.symbol(bits)? {
            symbol @ 0..4 => symbol + 1,
            symbol @ 4..30 => {
                let extra = symbol / 2 - 1;
                ((2 + symbol % 2) << extra) + 1 + bits.number(extra)?
            }
            _ => return refuse("3.9: a distance that there is not"),
        };
        demand(distance as usize <= out.len(), "3.9: a match before the beginning")?;
        for _ in 0..length {
            out.push(out[out.len() - distance as usize]);
        }
    }
}

const ORDER: [usize; 19] = [16, 17, 18, 0, 8, 7, 9, 6, 10, 5, 11, 4, 12, 3, 13, 2, 14, 1, 15];

/// By hand: a stored block, a literal by the fixed codes, and a match that overlaps itself.
#[test]
fn blocks_by_hand() {
    assert_eq!(inflate(b"\x01\x02\x00\xFD\xFFhi"), Ok(b"hi".to_vec()));
    assert_eq!(inflate(b"\x4B\xC4\x02\x00"), Ok(vec![b'a'; 20]));
    assert_eq!(inflate(b"\x03\x00"), Ok(vec![]));
    assert_eq!(inflate(b"\x00\x01\x00\xFE\xFFx\x03\x00"), Ok(b"x".to_vec()));
    for bad in [
        &b"\x01\x02\x00\xFD\xFEhi"[..],
        b"\x01\x02\x00\xFD\xFFh",
        b"\x07",
        b"\x03\x02\x00",
        b"\x03\x00\x00",
        b"",
        b"\x03",
    ] {
        assert!(inflate(bad).is_err(), "{bad:?}");
    }
}
