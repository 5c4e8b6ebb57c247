//! What is worth knowing about a file but not needed to decode it (spec §3.5).

use serde::{Deserialize, Serialize};

use super::header::Header;
use crate::error::{Error, FormatError, Result};
use crate::limits::MAX_METADATA_BYTES;

/// Where a file comes from and what was done to the input on the way.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Metadata {
    /// The program that wrote the file, with its version.
    pub generator: String,
    /// The input file, as it was named to the encoder.
    pub source: String,
    /// The encoder's settings, name and value; those alone that are not what they are by default.
    pub settings: Vec<(String, String)>,
    /// What the input had and this file has not, such as `"normals"`.
    pub dropped: Vec<String>,
    /// What was found in the input, and how often: [names](FINDINGS) and counts, those alone that the file does not tell otherwise. See
    /// [`Metadata::findings`].
    pub conditioning: Vec<(String, u64)>,
    /// Diagonal of the input's bounding box, in its units; finite and at least 0. `None` where it is that of the file's. See
    /// [`Metadata::diagonal_of`].
    pub diagonal: Option<f64>,
    /// Whether the input's coordinates were binary32.
    pub source_float32: bool,
    /// Names of the mesh's parts, by number; parts beyond the list have none.
    pub part_names: Vec<String>,
    /// Files that say what its materials look like, as the source names them.
    pub libraries: Vec<String>,
}

/// Names of what is found in an input, in the order of their numbers in a file (spec §3.5).
pub const FINDINGS: [&str; 18] = [
    "input_vertices",
    "input_triangles",
    "components",
    "welded_vertices",
    "joined_vertices",
    "degenerate_triangles",
    "repeated_triangles",
    "isolated_vertices",
    "nonmanifold_edges",
    "nonorientable_edges",
    "cut_vertices",
    "nonmanifold_vertices",
    "reoriented_triangles",
    "locked_vertices",
    "boundary_loops",
    "boundary_edges",
    "handles",
    "copies",
];

/// The fields as they are written.
#[derive(Serialize, Deserialize)]
struct Written {
    generator: String,
    source: String,
    settings: Vec<(String, String)>,
    dropped: Vec<String>,
    conditioning: Vec<(u64, u64)>,
    diagonal: Option<f64>,
    source_float32: bool,
}

/// The lists behind them, left out where both are empty.
type Lists = (Vec<String>, Vec<String>);

impl Metadata {
    /// What was found in the input, all of [`FINDINGS`] first: what is not told is what `header` has, or 0, or one component.
    pub fn findings(&self, header: &Header) -> Vec<(String, u64)> {
        let known = FINDINGS.into_iter().map(|name| (name.to_owned(), self.finding(name, header)));
        let others = self.conditioning.iter().filter(|(name, _)| !FINDINGS.contains(&name.as_str()));
        known.chain(others.cloned()).collect()
    }

    /// How often `name` was found in the input.
    pub fn finding(&self, name: &str, header: &Header) -> u64 {
        let told = self.conditioning.iter().find(|(told, _)| told == name);
        told.map_or_else(|| untold(name, header), |&(_, count)| count)
    }

    /// Leaves out what a file with this header tells otherwise.
    #[cfg(any(test, feature = "encode"))]
    pub fn shorten(&mut self, header: &Header) {
        self.conditioning.retain(|(name, count)| *count != untold(name, header));
        // The file's box has its far end on the lattice: half a step away, an axis.
        let near = |diagonal: f64| (diagonal - header.diagonal()).abs() <= header.lattice.step;
        self.diagonal = self.diagonal.filter(|&diagonal| !near(diagonal));
    }

    /// Diagonal of the input's bounding box, in its units; that of the file's, which is as large to a step of the lattice, where it is not told.
    pub fn diagonal_of(&self, header: &Header) -> f64 {
        self.diagonal.unwrap_or_else(|| header.diagonal())
    }

    /// The payload of the metadata atoms.
    ///
    /// # Errors
    /// [`Error::Limit`] above [`MAX_METADATA_BYTES`], [`Error::Parameter`] where the diagonal is out of range, or a finding has
    /// no number.
    pub fn encode(&self) -> Result<Vec<u8>> {
        let parameter = |what: &str| Error::Parameter(what.to_owned());
        self.check().map_err(parameter)?;
        let numbers = self.conditioning.iter().map(|(name, count)| Some((number_of(name)?, *count)));
        let conditioning = numbers
            .collect::<Option<Vec<_>>>()
            .ok_or_else(|| parameter("a finding in the metadata has no number"))?;
        let Self { generator, source, settings, dropped, diagonal, source_float32, .. } = self.clone();
        let written =
            Written { generator, source, settings, dropped, conditioning, diagonal, source_float32 };
        let lists = (self.part_names.clone(), self.libraries.clone());
        let bytes = bytes_of(&written, &lists).map_err(|e| Error::Parameter(e.to_string()))?;
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
        let unreadable = |e| refuse(format!("the metadata cannot be read: {e}"));
        let (written, used): (Written, usize) =
            bincode::serde::decode_from_slice(bytes, CONFIG).map_err(unreadable)?;
        let mut rest = &bytes[used..];
        let mut lists = Lists::default();
        if !rest.is_empty() {
            let used;
            (lists, used) = bincode::serde::decode_from_slice(rest, CONFIG).map_err(unreadable)?;
            rest = &rest[used..];
        }
        if !rest.is_empty() {
            return Err(refuse(format!("{} bytes behind the metadata", rest.len())));
        }
        // Integers have longer forms too, and empty lists; one value has one form.
        if bytes_of(&written, &lists).is_ok_and(|again| again != bytes) {
            return Err(refuse("the metadata is not in its shortest form".to_owned()));
        }
        let Written { generator, source, settings, dropped, conditioning, diagonal, source_float32 } =
            written;
        let conditioning = conditioning.into_iter().map(|(number, count)| (name_of(number), count)).collect();
        let (part_names, libraries) = lists;
        let metadata = Self {
            generator,
            source,
            settings,
            dropped,
            conditioning,
            diagonal,
            source_float32,
            part_names,
            libraries,
        };
        metadata.check().map_err(|what| refuse(what.to_owned()))?;
        Ok(metadata)
    }

    fn check(&self) -> Result<(), &'static str> {
        let fits = self.diagonal.is_none_or(|diagonal| diagonal.is_finite() && diagonal >= 0.0);
        if fits { Ok(()) } else { Err("the diagonal in the metadata is negative or not finite") }
    }
}

fn bytes_of(written: &Written, lists: &Lists) -> std::result::Result<Vec<u8>, bincode::error::EncodeError> {
    let mut bytes = bincode::serde::encode_to_vec(written, CONFIG)?;
    if *lists != Lists::default() {
        bytes.extend(bincode::serde::encode_to_vec(lists, CONFIG)?);
    }
    Ok(bytes)
}

/// What a finding is where the metadata do not tell.
fn untold(name: &str, header: &Header) -> u64 {
    match name {
        "input_vertices" => header.vertices.into(),
        "input_triangles" => header.triangles.into(),
        "components" => 1,
        _ => 0,
    }
}

/// The name of a finding; its number in decimals, where this version has no name for it.
fn name_of(number: u64) -> String {
    let known = usize::try_from(number).ok().and_then(|number| FINDINGS.get(number));
    known.map_or_else(|| number.to_string(), |name| (*name).to_owned())
}

/// The inverse of [`name_of`].
fn number_of(name: &str) -> Option<u64> {
    let known = FINDINGS.iter().position(|known| *known == name).map(|number| number as u64);
    known.or_else(|| name.parse().ok().filter(|&number| name_of(number) == name))
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
    use crate::container::testing::{contents, small_file};

    fn example() -> Metadata {
        Metadata {
            generator: "u 1".to_owned(),
            source: "é".to_owned(),
            settings: vec![("a".to_owned(), String::new())],
            dropped: vec!["uv".to_owned()],
            conditioning: vec![("welded_vertices".to_owned(), 251), ("components".to_owned(), 2)],
            diagonal: Some(2.0),
            source_float32: true,
            ..Metadata::default()
        }
    }

    /// Spec §3.5, byte by byte.
    const BYTES: &[u8] = &[
        3, b'u', b' ', b'1', 2, 0xC3, 0xA9, // generator, source
        1, 1, b'a', 0, // settings
        1, 2, b'u', b'v', // dropped
        2, 3, 251, 251, 0, 2, 2, // conditioning
        1, 0, 0, 0, 0, 0, 0, 0, 0x40, // diagonal
        1,    // source_float32
    ];

    #[test]
    fn the_bytes_of_the_specification() {
        assert_eq!(example().encode().unwrap(), BYTES);
        assert_eq!(Metadata::decode(BYTES, 0).unwrap(), example());
        let none = Metadata { diagonal: None, ..example() };
        let bytes = [&BYTES[..22], &[0, 1]].concat();
        assert_eq!(none.encode().unwrap(), bytes);
        assert_eq!(Metadata::decode(&bytes, 0).unwrap(), none);
        let (part_names, libraries) = (vec!["p".to_owned(), String::new()], vec!["m".to_owned()]);
        let named = Metadata { part_names, libraries, ..example() };
        let bytes = [BYTES, &[2, 1, b'p', 0, 1, 1, b'm']].concat();
        assert_eq!(named.encode().unwrap(), bytes);
        assert_eq!(Metadata::decode(&bytes, 0).unwrap(), named);
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
        for (more, why) in [
            (&[0][..], "cannot be read"),
            (&[1, 1, b'p'], "cannot be read"),
            (&[1, 1, 0xFF, 0], "cannot be read"),
            (&[0, 0], "shortest form"),
            (&[251, 1, 0, 0, 0], "shortest form"),
            (&[1, 0, 0, 7], "1 bytes behind"),
        ] {
            refused(&[BYTES, more].concat(), why);
        }
        let changed = |at: usize, byte: u8| {
            let mut bytes = BYTES.to_vec();
            bytes[at] = byte;
            bytes
        };
        let mut long = BYTES.to_vec();
        long.splice(0..1, [251, 3, 0]);
        refused(&long, "shortest form");
        long = BYTES.to_vec();
        long.splice(16..17, [251, 3, 0]);
        refused(&long, "shortest form");
        for (at, byte, why) in [
            (BYTES.len() - 1, 2, "cannot be read"),
            (5, 0xFF, "cannot be read"),
            (22, 2, "cannot be read"),
            (30, 0xC0, "diagonal"),
        ] {
            refused(&changed(at, byte), why);
        }
        refused(&[253, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF], "cannot be read");
        refused(&vec![0; MAX_METADATA_BYTES + 1], "allowed 1048576");
    }

    #[test]
    fn too_much_or_impossible_is_not_written() {
        let long = Metadata { source: "x".repeat(MAX_METADATA_BYTES), ..Metadata::default() };
        assert!(matches!(long.encode(), Err(Error::Limit { .. })));
        let found = |name: &str| Metadata { conditioning: vec![(name.to_owned(), 1)], ..Metadata::default() };
        for bad in [
            Metadata { diagonal: Some(f64::NAN), ..Metadata::default() },
            Metadata { diagonal: Some(-1.0), ..Metadata::default() },
            found("cracks"),
            found("3"),
            found("018"),
        ] {
            assert!(matches!(bad.encode(), Err(Error::Parameter(_))), "{bad:?}");
        }
        // A number that a later version may have a name for.
        let later = found("18");
        assert_eq!(Metadata::decode(&later.encode().unwrap(), 0).unwrap(), later);
    }

    #[test]
    fn what_the_file_tells_need_not_be_told() {
        let header = contents(&small_file()).header;
        let told =
            |list: &[(&str, u64)]| list.iter().map(|&(name, n)| (name.to_owned(), n)).collect::<Vec<_>>();
        let all = [
            ("input_vertices", 12),
            ("components", 1),
            ("input_triangles", 21),
            ("handles", 0),
            ("copies", 3),
        ];
        // The box has 4095, 0 and 17 steps of a quarter.
        let diagonal = 0.25 * f64::from(4095 * 4095 + 17 * 17).sqrt();
        let whole =
            Metadata { conditioning: told(&all), diagonal: Some(diagonal + 0.2), ..Metadata::default() };
        let mut short = whole.clone();
        short.shorten(&header);
        assert_eq!(short.conditioning, told(&[("input_triangles", 21), ("copies", 3)]));
        assert_eq!((short.diagonal, short.diagonal_of(&header)), (None, diagonal));
        for (name, count) in all {
            assert_eq!(short.finding(name, &header), count, "{name}");
        }
        assert_eq!(short.findings(&header), whole.findings(&header));
        assert_eq!(short.findings(&header).len(), FINDINGS.len());
        let mut other = Metadata { diagonal: Some(diagonal + 0.3), ..whole };
        other.shorten(&header);
        assert_eq!(other.diagonal_of(&header), diagonal + 0.3);
    }

    proptest! {
        #[test]
        fn round_trip(
            texts in (".*", ".*"),
            settings: Vec<(String, String)>,
            dropped: Vec<String>,
            found in proptest::collection::vec((any::<u64>(), 0u32..64, any::<u64>()), 0..9),
            diagonal in proptest::option::of(0.0..f64::MAX),
            source_float32: bool,
            lists: (Vec<String>, Vec<String>),
        ) {
            let (generator, source) = texts;
            let conditioning = found.into_iter().map(|(number, shift, n)| (name_of(number >> shift), n)).collect();
            let (part_names, libraries) = lists;
            let metadata = Metadata {
                generator, source, settings, dropped, conditioning, diagonal, source_float32, part_names, libraries,
            };
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
