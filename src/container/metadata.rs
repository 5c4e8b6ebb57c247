//! What is worth knowing about a file but not needed to decode it (spec §3.5).

use serde::{Deserialize, Serialize};

use crate::error::{Error, FormatError, Result};
use crate::limits::MAX_METADATA_BYTES;

/// Where a file comes from and what was done to the input on the way.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Metadata {
    /// The program that wrote the file, with its version.
    pub generator: String,
    /// The input file, as it was named to the encoder.
    pub source: String,
    /// The encoder's settings, name and value.
    pub settings: Vec<(String, String)>,
    /// What the input had and this file has not, such as `"normals"`.
    pub dropped: Vec<String>,
    /// How often each repair was made to the input, by name.
    pub conditioning: Vec<(String, u64)>,
    /// Diagonal of the input's bounding box, in its units; finite and at least 0.
    pub diagonal: f64,
    /// Whether the input's coordinates were binary32.
    pub source_float32: bool,
}

impl Metadata {
    /// The payload of the metadata atoms.
    ///
    /// # Errors
    /// [`Error::Limit`] above [`MAX_METADATA_BYTES`], [`Error::Parameter`] where the diagonal is out of range.
    pub fn encode(&self) -> Result<Vec<u8>> {
        self.check().map_err(|what| Error::Parameter(what.to_owned()))?;
        let bytes =
            bincode::serde::encode_to_vec(self, CONFIG).map_err(|e| Error::Parameter(e.to_string()))?;
        if bytes.len() > MAX_METADATA_BYTES {
            let (needed, allowed) = (bytes.len() as u64, MAX_METADATA_BYTES as u64);
            return Err(Error::Limit { what: "metadata in bytes", needed, allowed });
        }
        Ok(bytes)
    }

    /// Reads the payload of the metadata atoms, the first of which stands at `offset` in the file.
    ///
    /// # Errors
    /// [`FormatError`] where `bytes` is anything but what [`Metadata::encode`] makes.
    pub fn decode(bytes: &[u8], offset: u64) -> Result<Self, FormatError> {
        let refuse = |what: String| FormatError::new(offset, "3.5", what);
        if bytes.len() > MAX_METADATA_BYTES {
            return Err(refuse(format!("{} bytes of metadata, allowed {MAX_METADATA_BYTES}", bytes.len())));
        }
        let (metadata, used): (Self, usize) = bincode::serde::decode_from_slice(bytes, CONFIG)
            .map_err(|e| refuse(format!("the metadata cannot be read: {e}")))?;
        if used < bytes.len() {
            return Err(refuse(format!("{} bytes behind the metadata", bytes.len() - used)));
        }
        metadata.check().map_err(|what| refuse(what.to_owned()))?;
        // Integers have longer forms too; one value has one form.
        match bincode::serde::encode_to_vec(&metadata, CONFIG) {
            Ok(again) if again == bytes => Ok(metadata),
            _ => Err(refuse("the metadata is not in its shortest form".to_owned())),
        }
    }

    fn check(&self) -> Result<(), &'static str> {
        let fits = self.diagonal.is_finite() && self.diagonal >= 0.0;
        if fits { Ok(()) } else { Err("the diagonal in the metadata is negative or not finite") }
    }
}

const CONFIG: bincode::config::Configuration<
    bincode::config::LittleEndian,
    bincode::config::Varint,
    bincode::config::Limit<MAX_METADATA_BYTES>,
> = bincode::config::standard().with_limit::<MAX_METADATA_BYTES>();

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn example() -> Metadata {
        Metadata {
            generator: "u 1".to_owned(),
            source: "é".to_owned(),
            settings: vec![("a".to_owned(), String::new())],
            dropped: vec!["uv".to_owned()],
            conditioning: vec![("x".to_owned(), 251)],
            diagonal: 2.0,
            source_float32: true,
        }
    }

    /// Spec §3.5, byte by byte.
    const BYTES: &[u8] = &[
        3, b'u', b' ', b'1', 2, 0xC3, 0xA9, // generator, source
        1, 1, b'a', 0, // settings
        1, 2, b'u', b'v', // dropped
        1, 1, b'x', 251, 251, 0, // conditioning
        0, 0, 0, 0, 0, 0, 0, 0x40, // diagonal
        1,    // source_float32
    ];

    #[test]
    fn the_bytes_of_the_specification() {
        assert_eq!(example().encode().unwrap(), BYTES);
        assert_eq!(Metadata::decode(BYTES, 0).unwrap(), example());
    }

    #[test]
    fn anything_else_is_refused() {
        let refused = |bytes: &[u8], why: &str| {
            let fault = Metadata::decode(bytes, 77).unwrap_err();
            assert_eq!((fault.offset, fault.section), (77, "3.5"));
            assert!(fault.what.contains(why), "{fault}");
        };
        for cut in 0..BYTES.len() {
            refused(&BYTES[..cut], "cannot be read");
        }
        refused(&[BYTES, &[0]].concat(), "1 bytes behind");
        let mut long = BYTES.to_vec();
        long.splice(0..1, [251, 3, 0]);
        refused(&long, "shortest form");
        let mut bad = BYTES.to_vec();
        *bad.last_mut().unwrap() = 2;
        refused(&bad, "cannot be read");
        bad = BYTES.to_vec();
        bad[5] = 0xFF;
        refused(&bad, "cannot be read");
        bad = BYTES.to_vec();
        bad[28] = 0xC0;
        refused(&bad, "diagonal");
        refused(&[253, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF], "cannot be read");
        refused(&vec![0; MAX_METADATA_BYTES + 1], "allowed 1048576");
    }

    #[test]
    fn too_much_or_impossible_is_not_written() {
        let long = Metadata { source: "x".repeat(MAX_METADATA_BYTES), ..Metadata::default() };
        assert!(matches!(long.encode(), Err(Error::Limit { .. })));
        let bad = Metadata { diagonal: f64::NAN, ..Metadata::default() };
        assert!(matches!(bad.encode(), Err(Error::Parameter(_))));
    }

    proptest! {
        #[test]
        fn round_trip(
            texts in (".*", ".*"),
            settings: Vec<(String, String)>,
            dropped: Vec<String>,
            conditioning: Vec<(String, u64)>,
            diagonal in 0.0..f64::MAX,
            source_float32: bool,
        ) {
            let (generator, source) = texts;
            let metadata =
                Metadata { generator, source, settings, dropped, conditioning, diagonal, source_float32 };
            prop_assert_eq!(Metadata::decode(&metadata.encode().unwrap(), 0).unwrap(), metadata);
        }

        #[test]
        fn no_bytes_make_it_panic(bytes: Vec<u8>) {
            if let Ok(metadata) = Metadata::decode(&bytes, 0) {
                prop_assert_eq!(metadata.encode().unwrap(), bytes);
            }
        }
    }
}
