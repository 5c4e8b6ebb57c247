//! Chapter 3.3: entries of attributes.

use super::container::{Fields, Result, demand};

/// What the table tells of an attribute.
#[derive(Clone, Debug, PartialEq)]
pub struct Attribute {
    pub semantic: u8,
    pub stored: u8,
    pub components: usize,
    pub quantisation: u8,
    pub marks: u8,
    pub set: u64,
    /// The level at which it is born.
    pub birth: u64,
    pub name: String,
    pub bits: u8,
    pub origin: Vec<f64>,
    pub step: f64,
    pub error: f64,
    /// The integers of the value of a constant one.
    pub constant: Option<Vec<i32>>,
    /// The entry itself.
    pub bytes: Vec<u8>,
}

pub fn read_attributes(table: &mut Fields, count: usize) -> Result<Vec<Attribute>> {
    (0..count).map(|_| read(table)).collect()
}

fn read(table: &mut Fields) -> Result<Attribute> {
    let whole = table.0;
    let (types, shape, marks) = (table.u8()?, table.u8()?, table.u8()?);
    let (semantic, stored, components, quantisation) =
        (types % 16, types / 16, usize::from(shape % 16) + 1, shape / 16);
    demand(semantic < 8 && stored < 8 && quantisation < 4 && marks < 64, "3.3: form of an attribute")?;
    let is_integer = stored < 6;
    demand(is_integer == (quantisation == 0), "3.3: quantisation of an attribute")?;
    demand(
        quantisation != 2 || (semantic, components) == (0, 3) || (semantic, components) == (1, 4),
        "3.3: octahedral coordinates",
    )?;
    demand(semantic != 6 || (components == 1 && marks % 2 == 1 && is_integer), "3.3: parts")?;
    demand(marks / 2 % 2 == 0 || is_integer, "3.3: fractions")?;
    let is_constant = marks / 32 == 1;
    demand(!is_constant || marks / 4 % 2 == 0, "3.3: a constant that some have not")?;
    let has_lattice = quantisation == 1 && !is_constant;
    demand(marks / 8 % 4 == 0 || has_lattice, "3.3: marks of a lattice")?;
    let set = table.varint()?;
    demand(set < 1 << 32, "3.3: set of an attribute")?;
    let birth = if is_constant { u64::MAX } else { table.varint()? };
    let length = table.varint()?;
    demand(length <= 255, "3.6: name of an attribute")?;
    let name = std::str::from_utf8(table.take(length as usize)?);
    let name = name.map_err(|_| "§3.3: name of an attribute".to_owned())?.to_owned();
    let bits = if has_lattice || quantisation == 2 { table.u8()? } else { 0 };
    let allowed = [0..=0, 1..=24, 2..=16, 0..=0];
    let allowed =
        if is_constant && quantisation == 1 { 0..=0 } else { allowed[usize::from(quantisation)].clone() };
    demand(allowed.contains(&bits), "3.3: bits of an attribute")?;
    let (mut origin, mut step) = (vec![], 0.0);
    if has_lattice {
        let mut real = |short: bool| match short {
            true => Ok(f64::from(f32::from_bits(table.u32()? as u32))),
            false => table.f64(),
        };
        let (short_origin, short_step) = (marks / 8 % 2 == 1, marks / 16 % 2 == 1);
        for _ in 0..components {
            origin.push(real(short_origin)?);
        }
        step = real(short_step)?;
        demand(
            origin.iter().all(|x| x.is_finite()) && step.is_finite() && step >= 0.0,
            "3.3: lattice of an attribute",
        )?;
        let is_short = |x: &f64| f64::from(*x as f32).to_bits() == x.to_bits();
        demand(
            short_origin == origin.iter().all(is_short) && short_step == is_short(&step),
            "3.3: form of the lattice of an attribute",
        )?;
    }
    let constant = if is_constant {
        let (value, at) = read_constant(table, quantisation, stored, components)?;
        origin = at;
        Some(value)
    } else {
        None
    };
    let mut error = 0.0;
    if quantisation == 1 || quantisation == 2 {
        let code = table.u16()?;
        demand(code <= 0x7F7F, "3.3: error of an attribute")?;
        let unit = if step > 0.0 { step } else { 1.0 };
        error = f64::from(f32::from_bits((code as u32) << 16)) * unit;
        demand(error.is_finite(), "3.3: error of an attribute")?;
    }
    let bytes = whole[..whole.len() - table.0.len()].to_vec();
    Ok(Attribute {
        semantic,
        stored,
        components,
        quantisation,
        marks,
        set,
        birth,
        name,
        bits,
        origin,
        step,
        error,
        constant,
        bytes,
    })
}

/// How far an attribute of a level is off.
#[derive(Clone, Debug, PartialEq)]
pub struct AttributeError {
    /// Its place among the attributes.
    pub attribute: usize,
    /// Codes of the error, and but of parts of the high error.
    pub codes: Vec<i64>,
    /// What they stand for.
    pub values: Vec<f64>,
    /// The fields.
    pub bytes: Vec<u8>,
}

/// The errors of the attributes of level j; `coarser` are those of level j+1.
pub fn read_errors(
    table: &mut Fields,
    attributes: &[Attribute],
    j: u64,
    coarser: &[AttributeError],
) -> Result<Vec<AttributeError>> {
    let mut errors = vec![];
    for (k, attribute) in attributes.iter().enumerate() {
        let is_alive = attribute.birth >= j && attribute.constant.is_none();
        // Neither joints nor their weights.
        if j == 0 || !is_alive || attribute.semantic == 4 || attribute.semantic == 5 {
            continue;
        }
        let whole = table.0;
        let is_of_directions = attribute.semantic < 2 && attribute.components >= 3;
        let unit = if attribute.step > 0.0 && !is_of_directions { attribute.step } else { 1.0 };
        let (mut codes, mut values) = (vec![], vec![]);
        for i in 0..if attribute.semantic == 6 { 1 } else { 2 } {
            let code = if attribute.birth == j {
                table.u16()? as i64
            } else {
                let d = table.varint()?;
                demand(d < 1 << 32, "3.3: difference of an attribute's error")?;
                let before =
                    coarser.iter().find(|error| error.attribute == k).map_or(0, |error| error.codes[i]);
                before - 48 + if d % 2 == 0 { d as i64 / 2 } else { -(d as i64 / 2) - 1 }
            };
            demand((0..=0x7F7F).contains(&code), "3.3: code of an attribute's error")?;
            codes.push(code);
            values.push(f64::from(f32::from_bits((code as u32) << 16)) * unit);
        }
        demand(values.iter().all(|x| x.is_finite()), "3.3: an attribute's error")?;
        let bytes = whole[..whole.len() - table.0.len()].to_vec();
        errors.push(AttributeError { attribute: k, codes, values, bytes });
    }
    Ok(errors)
}

/// A signed varint.
fn signed(table: &mut Fields) -> Result<i64> {
    let x = table.varint()?;
    demand(x < 1 << 32, "3.3: a number of a constant")?;
    let x = x as i64;
    Ok(if x % 2 == 0 { x / 2 } else { -(x + 1) / 2 })
}

/// The integers of a constant, and on a lattice its origin.
fn read_constant(
    table: &mut Fields,
    quantisation: u8,
    stored: u8,
    components: usize,
) -> Result<(Vec<i32>, Vec<f64>)> {
    let count = match quantisation {
        2 => components - 1,
        3 if stored == 7 => 2 * components,
        _ => components,
    };
    let e = if quantisation == 1 { signed(table)? } else { 0 };
    demand((-1022..=1023).contains(&e), "3.3: exponent of a constant")?;
    let (mut numbers, mut before) = (vec![], 0);
    for _ in 0..count {
        before = (before + signed(table)?) as i32 as i64;
        numbers.push(before as i32);
    }
    if quantisation != 1 {
        return Ok((numbers, vec![]));
    }
    let is_largest =
        if numbers.iter().all(|&q| q == 0) { e == 0 } else { numbers.iter().any(|q| q % 2 != 0) };
    demand(is_largest, "3.3: exponent of a constant")?;
    let at: Vec<f64> = numbers.iter().map(|&q| f64::from(q) * 2f64.powi(e as i32)).collect();
    demand(at.iter().all(|x| x.is_finite()), "3.3: a constant")?;
    Ok((vec![0; count], at))
}

#[test]
fn constants_of_the_chapter() {
    let white = [3, 3, 0x22, 0, 0, 0xFE, 3, 0, 0, 0];
    let half = [0x62, 0x11, 0x20, 0, 0, 3, 4, 2, 0, 0];
    let read = read_attributes(&mut Fields(&[white, half].concat()), 2).unwrap();
    assert_eq!((&read[0].constant, read[0].semantic), (&Some(vec![255; 4]), 3));
    assert_eq!(
        (&read[1].constant, &read[1].origin[..], read[1].step),
        (&Some(vec![0; 2]), &[0.5, 0.75][..], 0.0)
    );
}

#[test]
fn the_example_of_the_chapter() {
    let bytes = [0x62, 0x11, 0x1C, 1, 0, 0, 0x0C, 0, 0, 0, 0, 0, 0, 0, 0x3F, 0, 0, 0x80, 0x39, 0, 0x3F];
    let read = read_attributes(&mut Fields(&bytes), 1).unwrap();
    let told = Attribute {
        semantic: 2,
        stored: 6,
        components: 2,
        quantisation: 1,
        marks: 4 + 8 + 16,
        set: 1,
        birth: 0,
        name: String::new(),
        bits: 12,
        origin: vec![0.0, 0.5],
        step: 2f64.powi(-12),
        error: 2f64.powi(-13),
        constant: None,
        bytes: bytes.to_vec(),
    };
    assert_eq!(read, [told]);
    for length in 0..bytes.len() {
        assert!(read_attributes(&mut Fields(&bytes[..length]), 1).is_err());
    }
}

#[test]
fn errors_of_the_chapter() {
    let uv = [0x62, 0x11, 0x1C, 1, 4, 0, 0x0C, 0, 0, 0, 0, 0, 0, 0, 0x3F, 0, 0, 0x80, 0x39, 0, 0x3F];
    let part = [0x46, 0, 1, 0, 3, 0];
    let attributes = read_attributes(&mut Fields(&[&uv[..], &part].concat()), 2).unwrap();
    let coarser = read_errors(&mut Fields(&[0, 0x41, 0xA0, 0x41]), &attributes, 4, &[]).unwrap();
    assert_eq!(coarser[0].values, [8.0 / 4096.0, 20.0 / 4096.0]);
    let errors = read_errors(&mut Fields(&[0x1F, 0, 0x80, 0x3C]), &attributes, 3, &coarser).unwrap();
    let told: Vec<_> = errors.iter().map(|error| (error.attribute, &error.values[..])).collect();
    assert_eq!(told, [(0, &[6.0 / 4096.0, 15.0 / 4096.0][..]), (1, &[1.0 / 64.0])]);
}

/// The library and this reader accept the same entries and understand the same by them.
#[test]
fn entries_with_any_byte_changed() {
    use super::container::{File, crc32c};
    use unweld::container::parse_contents;
    let entries: [&[u8]; 8] = [
        &[3, 3, 0x22, 0, 0, 0xFE, 3, 0, 0, 0],
        &[0x62, 0x11, 0x20, 0, 0, 3, 4, 2, 0, 0],
        &[0x73, 0x30, 0x20, 0, 0, 7, 9],
        &[0x60, 0x22, 0x20, 0, 0, 10, 3, 0x80, 1, 0x80, 0x3E],
        &[0x62, 0x11, 0x1C, 1, 0, 0, 0x0C, 0, 0, 0, 0, 0, 0, 0, 0x3F, 0, 0, 0x80, 0x39, 0, 0x3F],
        &[0x60, 0x22, 4, 0, 0, 0, 10, 0x80, 0x3E],
        &[0x46, 0x00, 1, 0, 0, 1, b'p'],
        &[0x77, 0x3F, 0, 0, 0, 2, 0xC3, 0xA9],
    ];
    let (mut sound, mut broken) = (0, 0);
    for entry in entries {
        for at in 0..entry.len() {
            for mask in 0..=255 {
                let mut entry = entry.to_vec();
                entry[at] ^= mask;
                // The lattice and the levels of §3.8, and one atom of values.
                let mut bytes = b"\x89UWM\r\n\x1A\n\x01\x00\x00\x00\x01\x00\x00\x00".to_vec();
                bytes.extend([
                    0x68, 0, 0, 0x80, 0xBF, 0, 0, 0, 0, 0, 0, 0, 0x40, 0, 0, 0, 0x3F, 0, 255, 1, 0xEF, 1,
                ]);
                bytes.extend(entry);
                bytes.extend([1, 4, 4, 0, 0x80, 0x3F, 0, 0x3F, 6, 0x4A, 0x51]);
                bytes.extend([8, 6, 0x4A, 0x51]);
                bytes[13] = (bytes.len() - 12) as u8;
                let sum = crc32c(&bytes);
                bytes.extend(sum.to_le_bytes());
                bytes.extend(b"abcabc");
                let told = parse_contents(&bytes);
                let read = File::read(&bytes);
                match (told, read) {
                    (Ok(Some(told)), Ok(read)) => {
                        let (told, read) = (&told.attributes[0], &read.attributes[0]);
                        assert_eq!((told.components, told.error), (read.components, read.error));
                        assert_eq!((told.set.into(), &told.name), (read.set, &read.name));
                        assert_eq!(told.partial, read.marks / 4 % 2 == 1);
                        sound += 1;
                    }
                    (Err(_), Err(_)) => broken += 1,
                    (told, read) => panic!("{bytes:?}: {told:?}, {:?}", read.err()),
                }
            }
        }
    }
    assert!(sound > 1000 && broken > 1000, "{sound} {broken}");
}

/// Attributes born at all levels, behind the birth of a component: both see the same atoms, and refuse the same tables.
#[test]
fn births_with_any_byte_of_the_table_changed() {
    use super::container::{ATTRIBUTES, File, crc32c};
    use unweld::container::{AtomKind, AttributeEntry, FileBuilder, Level, parse_contents};
    use unweld::mesh::attributes::{Quantisation, Semantic, Values};
    let level = |vertices, triangles| Level { vertices, triangles, ..Level::default() };
    let lattice = unweld::mesh::Lattice { origin: [0.0; 3], step: 1.0, bits: 8 };
    let mut file = FileBuilder::new(lattice, [1; 3], vec![level(10, 12), level(9, 10), level(4, 4)]);
    let color = unweld::mesh::Attribute::new(Semantic::Color, 3, Values::U8(vec![0; 3]), Vec::new());
    let born = |birth| AttributeEntry { birth, ..AttributeEntry::of(&color, Quantisation::Integer, 0.0) };
    file.attributes = [2, 1, 1, 0].map(born).to_vec();
    file.payload(AtomKind::Base, 2, b"base");
    file.atom(AtomKind::Refinement, 1, 1, 2, b"r".to_vec());
    file.birth(1, [4, 4], b"component");
    file.payload(AtomKind::Attributes, 1, b"coarse");
    file.atom(AtomKind::Refinement, 0, 1, 2, b"r".to_vec());
    file.payload(AtomKind::Attributes, 0, b"fine");
    let mut bytes = Vec::new();
    file.write(&mut bytes).unwrap();
    let read = File::read(&bytes).unwrap();
    let runs: Vec<_> = read.atoms.iter().map(|atom| (atom.kind, atom.level, &atom.bytes[..])).collect();
    assert_eq!(runs[3..], [(ATTRIBUTES, 1, &b"coarse"[..]), (2, 0, b"r"), (ATTRIBUTES, 0, b"fine")]);
    assert_eq!(read.attributes.iter().map(|attribute| attribute.birth).collect::<Vec<_>>(), [2, 1, 1, 0]);
    let table = 16 + usize::from(bytes[13]) - 4;
    let (mut sound, mut broken) = (0, 0);
    for at in 16..table {
        for mask in 1..=255 {
            let mut bytes = bytes.clone();
            bytes[at] ^= mask;
            let sum = crc32c(&bytes[..table]);
            bytes[table..table + 4].copy_from_slice(&sum.to_le_bytes());
            let told = parse_contents(&bytes).map(|told| told.unwrap());
            // The reader of the chapter wants the atoms too: they are there, and wrong, or the table is refused.
            match (told, File::read(&bytes).map(|file| (file.atoms, errors_read(&file.attribute_errors)))) {
                (Ok(told), Ok((read, errors))) => {
                    assert_eq!(told.atoms.len(), read.len(), "byte {at}");
                    let same = told.atoms.iter().zip(&read).all(|(told, read)| {
                        u64::from(told.level) == read.level && told.length as usize == read.length
                    });
                    assert!(same, "byte {at}");
                    assert_eq!(errors_told(&told), errors, "byte {at}, {mask}");
                    sound += 1;
                }
                (Err(told), Err(read)) => {
                    assert!(!read.contains("3.4") && !read.contains("3.1"), "byte {at}: {told}: {read}");
                    broken += 1;
                }
                (Ok(_), Err(read)) => assert!(
                    ["3.4: checksum of an atom", "3.1: trailing bytes", "3: bytes are missing"]
                        .iter()
                        .any(|why| read.contains(why)),
                    "byte {at}, {mask}: {read}"
                ),
                (Err(told), Ok(_)) => panic!("byte {at}, {mask}: {told}"),
            }
        }
    }
    assert!(sound > 1000 && broken > 1000, "{sound} {broken}");
}

/// By level the places of attributes and their errors.
type Told = Vec<Vec<(usize, Vec<f64>)>>;

/// As this reader has them.
pub fn errors_read(errors: &[Vec<AttributeError>]) -> Told {
    errors
        .iter()
        .map(|level| level.iter().map(|error| (error.attribute, error.values.clone())).collect())
        .collect()
}

/// As the library tells them.
pub fn errors_told(contents: &unweld::container::Contents) -> Told {
    let of = |error: &unweld::container::AttributeError| {
        (error.attribute, [Some(error.error), error.high].into_iter().flatten().collect())
    };
    contents.levels.iter().map(|level| level.attributes.iter().map(of).collect()).collect()
}
