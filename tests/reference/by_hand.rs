//! A file that no encoder of this crate writes, put together from the examples of the specification.

use super::agree::{agree, sorted};
use super::container::{BASE, File, Level, PRECISION, REFINEMENT};
use super::draft::{Draft, Shape, atom};
use super::forge;
use super::golden::load;

/// The square of §7.3 and §5.7 with s(1) = 2, but
/// - the base's payload is cut in three, within the code as well;
/// - the eight vertex steps are cut into three and five, not between rounds, the split and the attachment into two atoms;
/// - two of these codes end in zeros that an encoder leaves out;
/// - optional atoms stand behind the others;
/// - there are no metadata.
///
/// The codes of its steps and operations that are not in the specification were computed apart from this crate, from §6.
pub fn file() -> Draft {
    let shape = |vertices, triangles, shift, errors| Shape { vertices, triangles, shift, errors };
    // Errors of 6 and 2 steps, and of none.
    let levels = vec![shape(6, 5, 0, [0; 2]), shape(4, 2, 2, [0x40C0, 0x4000])];
    let optional = |kind, bytes| atom(kind, 0, 0, 0, bytes);
    let atoms = vec![
        atom(BASE, 1, 0, 0, &[0x04, 0x6F, 0x5F]),
        atom(BASE, 1, 0, 0, &[0x4E]),
        atom(BASE, 1, 0, 0, &[0x2E, 0xE0]),
        atom(PRECISION, 0, 3, 0, &[0x1E, 0x40]),
        atom(PRECISION, 0, 5, 0, &[0x40, 0x70, 0, 0, 0]),
        atom(REFINEMENT, 0, 1, 2, &[0x61, 0x56, 0xD9, 0]),
        atom(REFINEMENT, 0, 1, 1, &[0xBF, 0x4C, 0x7F]),
        optional(200, b"in front of"),
        optional(255, &[0]),
        optional(255, b"behind the last level"),
    ];
    let (origin, maximum) = ([-8.0, 0.0, 1.0], [255, 255, 40]);
    Draft {
        settings: [0; 3],
        origin,
        step: 0.5,
        bits: 8,
        maximum,
        attributes: vec![],
        attribute_errors: vec![],
        resources: vec![],
        levels,
        atoms,
    }
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
    for (place, whole_length) in [(3, 5), (4, 5), (5, 6), (6, 6)] {
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
    (draft.origin, draft.maximum) = ([-1.0, 0.0, 2.0], [255, 0, 16]);
    let shape = |vertices, triangles, errors| Shape { vertices, triangles, shift: 0, errors };
    draft.levels = vec![shape(5, 6, [0; 2]), shape(4, 4, [0x3F80, 0x3F00])];
    draft.atoms = vec![atom(BASE, 1, 0, 0, b"abc"), atom(REFINEMENT, 0, 1, 2, b"de")];
    let bytes = draft.bytes();
    assert_eq!(bytes.len(), 68);
    assert_eq!(bytes[8..16], [1, 0, 0, 0, 0, 0x2F, 0, 0]);
    assert_eq!(bytes[49..63], [4, 0x9F, 0xFD, 1, 0x9F, 0xFB, 1, 4, 0xE2, 0xE6, 0xDF, 0xF8, 0x7B, 0x4D]);
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
