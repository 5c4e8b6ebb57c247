//! Chapter 3.5: the metadata, read only to be judged.

use super::container::{Fields, Result, demand};

pub fn check(payload: &[u8]) -> Result<()> {
    let mut fields = Fields(payload);
    string(&mut fields)?;
    string(&mut fields)?;
    for _ in 0..uint(&mut fields)? {
        string(&mut fields)?;
        string(&mut fields)?;
    }
    for _ in 0..uint(&mut fields)? {
        string(&mut fields)?;
    }
    for _ in 0..uint(&mut fields)? {
        uint(&mut fields)?;
        uint(&mut fields)?;
    }
    let told = fields.u8()?;
    demand(told <= 1, "3.5: whether there is a diagonal")?;
    let diagonal = if told == 1 { fields.f64()? } else { 0.0 };
    demand(diagonal.is_finite() && diagonal >= 0.0, "3.5: diagonal")?;
    demand(fields.u8()? <= 1, "3.5: binary32")?;
    if fields.0.is_empty() {
        return Ok(());
    }
    let mut strings = 0;
    for _ in 0..2 {
        let count = uint(&mut fields)?;
        strings += u128::from(count);
        for _ in 0..count {
            string(&mut fields)?;
        }
    }
    demand(strings > 0, "3.5: two empty lists at the end")?;
    demand(fields.0.is_empty(), "3.5: trailing bytes")
}

fn uint(fields: &mut Fields) -> Result<u64> {
    let (value, least) = match fields.u8()? {
        0xFB => (fields.u16()?, 251),
        0xFC => (fields.u32()?, 1 << 16),
        0xFD => (fields.u64()?, 1 << 32),
        byte => (u64::from(byte), 0),
    };
    demand(least > 0 || value < 251, "3.5: a uint's first byte")?;
    demand(value >= least, "3.5: a uint longer than needed")?;
    Ok(value)
}

fn string(fields: &mut Fields) -> Result<()> {
    let length = uint(fields)?;
    let bytes = fields.take(usize::try_from(length).unwrap_or(usize::MAX))?;
    demand(std::str::from_utf8(bytes).is_ok(), "3.5: a string that is not UTF-8")
}

#[test]
fn the_example_of_the_chapter() {
    let mut bytes = b"\x03u 1\x02\xC3\xA9\x01\x01a\x00\x01\x02uv\x02\x03\xFB\xFB\x00\x02\x02\x01".to_vec();
    bytes.extend(2.0f64.to_le_bytes());
    bytes.push(1);
    check(&bytes).unwrap();
    for length in 0..bytes.len() {
        assert!(check(&bytes[..length]).is_err());
    }
    let with = |more: &[u8]| check(&[&bytes[..], more].concat());
    with(b"\x02\x01p\x00\x01\x01m").unwrap();
    for bad in [&b"\x00"[..], b"\x00\x00", b"\x01\x01p", b"\x01\x00\x00\x07"] {
        assert!(with(bad).is_err());
    }
}
