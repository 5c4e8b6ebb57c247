//! A file that no encoder of this crate writes, put together from the examples of the specification.

use super::agree::{agree, sorted};
use super::container::{BASE, File, Level, PRECISION, REFINEMENT};
use super::draft::{Draft, atom};
use super::forge;
use super::golden::load;

/// The square of §7.3 and §5.7 with s(1) = 2, but
/// - the base's payload is cut in three, within the code as well;
/// - the eight vertex steps are cut into three and five, not between rounds, the split and the attachment into two atoms;
/// - two of these codes end in zeros that an encoder leaves out;
/// - optional atoms stand before, among and behind the others, with fields that mean nothing;
/// - there are no metadata.
///
/// The codes of its steps and operations that are not in the specification were computed apart from this crate, from §6.
pub fn file() -> Draft {
    let mut header = b"\x89UWM\r\n\x1A\n".to_vec();
    header.extend([1, 0, 0, 0]);
    // Vertices and triangles, of level 0 and of the base; two levels.
    header.extend([6u32, 5, 4, 2].iter().flat_map(|count| count.to_le_bytes()));
    header.extend([2, 0, 0, 0]);
    header.extend([-8.0f64, 0.0, 1.0, 0.5].iter().flat_map(|x| x.to_le_bytes()));
    header.extend([8, 0, 0, 0]);
    header.extend([255u32, 255, 40].iter().flat_map(|maximum| maximum.to_le_bytes()));

    let mut levels = vec![2];
    levels.extend(3.0f64.to_le_bytes());
    levels.extend(1.0f32.to_le_bytes());
    levels.extend([2, 3, 0]);
    levels.extend([0; 12]);

    let optional = |kind, bytes| atom(kind, 0xFFFF_FFFF, 7, 0xFFFF_FFFF, bytes);
    let atoms = vec![
        optional(128, b"before all else"),
        atom(BASE, 1, 0, 0, &[0x04, 0x6F, 0x5F]),
        optional(200, b"within the base"),
        atom(BASE, 1, 0, 0, &[0x4E]),
        atom(BASE, 1, 0, 0, &[0x2E, 0xE0]),
        atom(PRECISION, 0, 3, 0, &[0x1E, 0x40]),
        optional(255, &[0]),
        atom(PRECISION, 0, 5, 0, &[0x40, 0x70, 0, 0, 0]),
        atom(REFINEMENT, 0, 1, 2, &[0x61, 0x56, 0xD9, 0]),
        optional(128, b"between operations"),
        atom(REFINEMENT, 0, 1, 1, &[0xBF, 0x4C, 0x7F]),
        optional(129, b"behind the last level"),
    ];
    Draft { header, levels, atoms }
}

#[test]
fn both_decoders_read_it() {
    let bytes = file().bytes();
    assert!(bytes == load("hand.uwm"), "the file in the repository is another one");
    let seen = agree(&bytes).expect("the file is sound");
    let [a, b, c, d] = [[0, 0], [255, 0], [255, 255], [0, 255]].map(|[x, y]| [x, y, 0]);
    let (v, w) = ([130, 120, 9], [128, 0, 40]);
    // C→A split by v, w attached to A→B.
    let expected = [[b, c, v], [b, v, a], [d, a, v], [d, v, c], [b, a, w]];
    let position =
        |[x, y, z]: [i32; 3]| [-8.0 + 0.5 * f64::from(x), 0.5 * f64::from(y), 1.0 + 0.5 * f64::from(z)];
    let whole = &seen.whole;
    let found = sorted(whole.triangles.iter().map(|t| t.map(|v| whole.positions[v])));
    assert_eq!(found, sorted(expected.into_iter().map(|t| t.map(position))));
}

#[test]
fn zeros_at_the_end_have_a_measure() {
    // By the place of its atom, the bytes each code has with all its zeros.
    for (place, whole_length) in [(5, 5), (7, 5), (8, 6), (10, 6)] {
        let mut draft = file();
        let bare = draft.atoms[place].bytes.clone();
        for length in bare.len()..=whole_length {
            draft.atoms[place].bytes.resize(length, 0);
            assert!(agree(&draft.bytes()).is_some(), "atom {place}, {length} bytes");
        }
        draft.atoms[place].bytes.push(0);
        assert!(agree(&draft.bytes()).is_none(), "atom {place}: a zero too many");
    }
}

#[test]
fn the_frame_of_the_example_in_chapter_3() {
    let mut draft = file();
    draft.header.splice(12..28, [5u32, 6, 4, 4].iter().flat_map(|count| count.to_le_bytes()));
    draft.header.splice(32..56, [-1.0f64, 0.0, 2.0].iter().flat_map(|x| x.to_le_bytes()));
    draft.header.splice(68..80, [255u32, 0, 16].iter().flat_map(|x| x.to_le_bytes()));
    draft.levels = vec![0];
    draft.levels.extend(0.5f64.to_le_bytes());
    draft.levels.extend(0.25f32.to_le_bytes());
    draft.levels.extend([1, 2, 0]);
    draft.levels.extend([0; 12]);
    draft.atoms = vec![atom(BASE, 1, 0, 0, b"abc"), atom(REFINEMENT, 0, 1, 2, b"de")];
    let bytes = draft.bytes();
    assert_eq!(bytes.len(), 144);
    assert_eq!(bytes[80..88], [0x33, 0, 0, 0, 0xD7, 2, 0x1E, 0x55]);
    assert_eq!(bytes[135..139], [0x3C, 0xCF, 0x0A, 0xE1]);
    assert_eq!(File::read(&bytes).map(|file| file.levels.len()), Ok(2));
    assert!(agree(&bytes).is_none(), "abc is no mesh");
}

/// The base of §7.3 holds the decisions that its table tells, and another encoder's code for them is read alike.
#[test]
fn the_example_of_chapter_7() {
    let square = Level { vertices: 4, triangles: 2, shift: 0, max_error: 0.0, rms_error: 0.0 };
    let answers = forge::answers(&[0x6F, 0x5F, 0x63, 0x8C, 0x82], 4, square);
    // R, C, R, C, C behind the first E: C? 0 and R? 1, or C? 1; then the one cap that needs telling.
    let connectivity = [[0, 1].as_slice(), &[1], &[0, 1], &[1], &[1], &[1]].concat();
    assert_eq!(answers[..connectivity.len()], connectivity);
    assert_eq!(forge::answers(&forge::code(&answers, 4, square), 4, square), answers);
}
