//! The scene's JSON as a resource has it: stored or deflated (spec §3.9).

use miniz_oxide::inflate::TINFLStatus;
use miniz_oxide::inflate::core::inflate_flags::TINFL_FLAG_USING_NON_WRAPPING_OUTPUT_BUF;
use miniz_oxide::inflate::core::{DecompressorOxide, decompress};

use super::fields::Fields;
#[cfg(any(test, feature = "encode"))]
use crate::entropy::varint;
#[cfg(any(test, feature = "encode"))]
use crate::error::Error;
use crate::error::{FormatError, Result};
use crate::limits::{MAX_SCENE_BYTES, make_room};

/// The bytes of a resource that is the scene's JSON, before they are inflated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PackedScene<'a> {
    /// Bytes of the JSON: 1 to [`MAX_SCENE_BYTES`], and no more than `packed` can stand for.
    pub length: u32,
    is_deflated: bool,
    packed: &'a [u8],
    /// Where the resource stands in the file.
    offset: u64,
}

impl<'a> PackedScene<'a> {
    /// Reads what stands in front of the JSON in the resource at `offset` in the file.
    ///
    /// # Errors
    /// [`FormatError`] where the form is unknown, or the JSON is empty, too long, or longer than so few bytes can say.
    pub fn read(bytes: &'a [u8], offset: u64) -> Result<Self, FormatError> {
        let mut fields = Fields::new(bytes, offset, SECTION);
        let form = fields.u8()?;
        fields.require(form <= DEFLATED, offset, || format!("unknown form of a scene {form}"))?;
        let at = fields.offset();
        let length = fields.count(MAX_SCENE_BYTES, "the length of the scene")?;
        fields.require(length >= 1, at, || "an empty scene".to_owned())?;
        let packed = fields.bytes(fields.left())?;
        let (is_deflated, bytes) = (form == DEFLATED, packed.len() as u64);
        let fits =
            if is_deflated { u64::from(length) <= MOST_A_BYTE * bytes } else { u64::from(length) == bytes };
        fields.require(fits, at, || format!("a scene of {length} bytes in {bytes}"))?;
        Ok(Self { length, is_deflated, packed, offset })
    }

    /// The JSON; `length` bytes are to be debited before.
    ///
    /// # Errors
    /// [`Error::Format`] where the bytes are no deflated data, or not of this length; [`Error::Memory`].
    pub fn json(self) -> Result<Vec<u8>> {
        let length = self.length as usize;
        let mut json = Vec::new();
        make_room(&mut json, length)?;
        if !self.is_deflated {
            json.extend_from_slice(self.packed);
            return Ok(json);
        }
        json.resize(length, 0);
        let flags = TINFL_FLAG_USING_NON_WRAPPING_OUTPUT_BUF;
        let (status, read, written) =
            decompress(&mut DecompressorOxide::new(), self.packed, &mut json, 0, flags);
        let what = match status {
            TINFLStatus::Done if written < json.len() => {
                format!("it has {written} bytes instead of {}", json.len())
            }
            TINFLStatus::Done if read < self.packed.len() => {
                format!("{} bytes behind its end", self.packed.len() - read)
            }
            TINFLStatus::Done => return Ok(json),
            TINFLStatus::HasMoreOutput => format!("it has more than {} bytes", json.len()),
            TINFLStatus::FailedCannotMakeProgress | TINFLStatus::NeedsMoreInput => {
                "its end is missing".to_owned()
            }
            _ => "it is no deflated data".to_owned(),
        };
        Err(FormatError::new(self.offset, SECTION, format!("the scene cannot be inflated: {what}")).into())
    }
}

/// The resource of a scene's JSON, deflated where that is shorter.
///
/// # Errors
/// [`Error::Parameter`] where there is none, [`Error::Limit`] above [`MAX_SCENE_BYTES`].
#[cfg(any(test, feature = "encode"))]
pub fn packed_scene(json: &[u8]) -> Result<Vec<u8>> {
    if json.is_empty() {
        return Err(Error::Parameter("an empty scene".to_owned()));
    }
    if json.len() > MAX_SCENE_BYTES as usize {
        let (needed, allowed) = (json.len() as u64, MAX_SCENE_BYTES.into());
        return Err(Error::Limit { what: "the scene in bytes", needed, allowed });
    }
    let deflated = miniz_oxide::deflate::compress_to_vec(json, EFFORT);
    let (form, packed) = if deflated.len() < json.len() { (DEFLATED, &deflated[..]) } else { (STORED, json) };
    let mut bytes = vec![form];
    varint::write(json.len() as u64, &mut bytes);
    bytes.extend(packed);
    Ok(bytes)
}

const SECTION: &str = "3.9";
#[cfg(any(test, feature = "encode"))]
const STORED: u8 = 0;
const DEFLATED: u8 = 1;
/// Bytes that one byte of deflated data can stand for at most: four matches of 258 bytes, of two bits each (RFC 1951).
const MOST_A_BYTE: u64 = 4 * 258;
/// Of 0 to 10.
#[cfg(any(test, feature = "encode"))]
const EFFORT: u8 = 9;

#[cfg(test)]
mod tests {
    use super::*;

    fn json_of(bytes: &[u8]) -> Result<Vec<u8>, String> {
        let told = |fault: Error| {
            let Error::Format(fault) = fault else { panic!("{fault}") };
            assert_eq!(fault.section, if fault.what.contains("allowed") { "3.6" } else { "3.9" });
            fault.what
        };
        PackedScene::read(bytes, 100).map_err(Error::Format).and_then(PackedScene::json).map_err(told)
    }

    /// Spec §3.9, byte by byte: {"a":1} stored; and deflated by the fixed codes, 20 times `a`, of which 19 are a match at distance 1.
    #[test]
    fn the_bytes_of_the_specification() {
        assert_eq!(json_of(b"\x00\x07{\"a\":1}"), Ok(b"{\"a\":1}".to_vec()));
        // Bits in the order of RFC 1951: 1 last block, 01 fixed codes (low bit first 10), a = 10010001, length 19 = code 269 (0001101) + 1
        // extra bit (0), distance 1 = 00000, end 0000000.
        let bits = "1 10 10010001 0001101 0 00000 0000000".replace(' ', "");
        let mut bytes = vec![1, 20];
        for (i, bit) in bits.bytes().enumerate() {
            if i % 8 == 0 {
                bytes.push(0);
            }
            *bytes.last_mut().unwrap() |= (bit - b'0') << (i % 8);
        }
        assert_eq!(json_of(&bytes), Ok(vec![b'a'; 20]));
        assert_eq!(bytes, [0x01, 0x14, 0x4B, 0xC4, 0x02, 0x00]);
    }

    #[test]
    fn what_is_written_is_read() {
        for json in [&b"{}"[..], &b"{\"nodes\":[0,0,0,0,0,0,0,0,0,0,0,0,0,0,0]}".repeat(100)] {
            let bytes = packed_scene(json).unwrap();
            assert!(bytes.len() <= json.len() + 3 && (json.len() < 100 || bytes.len() < json.len() / 10));
            assert_eq!(json_of(&bytes).as_deref(), Ok(json));
            for cut in 0..bytes.len() {
                assert!(json_of(&bytes[..cut]).is_err(), "cut at {cut} of {}", bytes.len());
            }
        }
        assert!(matches!(packed_scene(b""), Err(Error::Parameter(_))));
        assert!(matches!(packed_scene(&vec![0; (1 << 26) + 1]), Err(Error::Limit { .. })));
    }

    #[test]
    fn anything_else_is_refused() {
        let refused = |bytes: &[u8], why: &str| {
            let what = json_of(bytes).expect_err(why);
            assert!(what.contains(why), "{what}: not {why}");
        };
        refused(b"", "no room");
        refused(b"\x02\x01a", "unknown form of a scene 2");
        refused(b"\x00", "not an integer");
        refused(b"\x00\x81\x00a", "not an integer in its shortest form");
        refused(b"\x00\x00", "an empty scene");
        refused(b"\x01\x00\x03\x00", "an empty scene");
        refused(b"\x00\x02a", "a scene of 2 bytes in 1");
        refused(b"\x00\x01ab", "a scene of 1 bytes in 2");
        // 2^26 + 1, and a bomb that says so: 2^26 in a hundred bytes.
        refused(b"\x01\x81\x80\x80\x20aa", "allowed 67108864");
        refused(&[&b"\x01\x80\x80\x80\x20"[..], &[0; 100]].concat(), "a scene of 67108864 bytes in 100");
        // One that does not: as many zeros as it can, in less than it says.
        let zeros = miniz_oxide::deflate::compress_to_vec(&[0; 100_000], 9);
        let bomb = |length: u64| {
            let mut bytes = vec![1];
            varint::write(length, &mut bytes);
            [bytes, zeros.clone()].concat()
        };
        assert_eq!(json_of(&bomb(100_000)).map(|json| json.len()), Ok(100_000));
        refused(&bomb(99_999), "more than 99999 bytes");
        refused(&bomb(1), "more than 1 bytes");
        refused(&bomb(100_001), "it has 100000 bytes instead of 100001");
        refused(&[bomb(100_000), vec![0]].concat(), "1 bytes behind its end");
        // A block of the kind that there is not; a match that reaches behind the beginning.
        refused(&[1, 20, 0x07], "no deflated data");
        refused(&[1, 20, 0x03, 0x02, 0x00], "the scene cannot be inflated");
    }
}
