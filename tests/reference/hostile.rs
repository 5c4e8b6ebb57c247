//! Files with faults behind sound checksums: both decoders refuse them, or both read the same from them.

use proptest::prelude::*;
use unweld::codec::grid::Real;
use unweld::encoder::{Encoder, Keyframes, Options, Preview};

use super::agree::{agree, by_reference};
use super::container::{
    Atom, BASE, BIRTH, CORRECTION, File, KEYFRAME, Level, METADATA, ORDER, REFINEMENT, RESIDUE,
};
use super::draft::{Draft, Shape, atom};
use super::forge;
use super::golden::load;
use super::on_shapes::{every_shape, soup};

/// How many of these files are read, of how many.
fn judge(files: impl Iterator<Item = Vec<u8>>) -> (usize, usize) {
    files.fold((0, 0), |(read, all), bytes| (read + usize::from(agree(&bytes).is_some()), all + 1))
}

#[test]
fn a_draft_is_the_file_it_was_made_from() {
    for name in [
        "tetrahedron.uwm",
        "disc.uwm",
        "torus.uwm",
        "sphere.uwm",
        "exact.uwm",
        "order.uwm",
        "births.uwm",
        "values.uwm",
        "exact_values.uwm",
        "scene.uwm",
        "hand.uwm",
    ] {
        let bytes = load(name);
        assert!(Draft::of(&bytes).bytes() == bytes, "{name}");
    }
}

#[test]
fn single_bits_of_a_small_file() {
    for name in ["hand.uwm", "tetrahedron.uwm", "disc.uwm"] {
        let draft = Draft::of(&load(name));
        let (mut read, mut all) = (0, 0);
        for bit in 0..8 {
            let judged = judge(draft.changed(1 << bit));
            read += judged.0;
            all += judged.1;
        }
        // Errors, origin, optional atoms, names in the metadata and some payloads can be other than they are.
        assert!(read > all / 20 && read < all / 2 + all / 4, "{name}: {read} of {all} are read");
    }
}

#[test]
fn a_byte_of_a_larger_file() {
    for name in [
        "torus.uwm",
        "sphere.uwm",
        "exact.uwm",
        "order.uwm",
        "births.uwm",
        "values.uwm",
        "exact_values.uwm",
        "scene.uwm",
    ] {
        let (read, all) = judge(Draft::of(&load(name)).changed(0x55).step_by(3));
        assert!(read > 0 && read < all, "{name}: {read} of {all} are read");
    }
}

/// A file of one level with this payload, of so many vertices and triangles.
pub fn base_alone(vertices: u32, triangles: u32, atoms: Vec<Atom>) -> Draft {
    let mut draft = Draft::of(&load("tetrahedron.uwm"));
    (draft.bits, draft.maximum) = (8, [0; 3]);
    (draft.levels[0].vertices, draft.levels[0].triangles) = (vertices.into(), triangles.into());
    draft.atoms = atoms;
    draft
}

/// The same with a level 0 that adds these vertices and triangles.
pub fn and_a_level(mut draft: Draft, vertices: u32, triangles: u32, bytes: &[u8]) -> Draft {
    let base = draft.levels[0];
    let counts = (base.vertices + u64::from(vertices), base.triangles + u64::from(triangles));
    draft.levels.insert(0, Shape { vertices: counts.0, triangles: counts.1, shift: 0, errors: [0; 2] });
    for atom in &mut draft.atoms {
        atom.level = 1;
    }
    draft.atoms.push(atom(REFINEMENT, 0, vertices.into(), triangles.into(), bytes));
    draft
}

#[test]
fn two_triangles_back_to_back() {
    let shape = Level { vertices: 3, triangles: 2, shift: 0, max_error: 0.0, rms_error: 0.0 };
    // The second symbol is C, and all is glued; no caps, all three vertices in one place.
    let payload = [&[0], &forge::code(&[1], 0, shape)[..]].concat();
    let bytes = base_alone(3, 2, vec![atom(BASE, 0, 0, 0, &payload)]).bytes();
    let file = File::read(&bytes).unwrap();
    assert_eq!(by_reference(&file, 0).err().as_deref(), Some("§2.2: rule 4"));
    assert!(agree(&bytes).is_none());
}

/// Births that no mesh can have, or that are not what the level entry says.
#[test]
fn births_that_cannot_be() {
    let sound = Draft::of(&load("births.uwm"));
    assert!(agree(&sound.bytes()).is_some());
    let k = sound.atoms.iter().position(|atom| atom.kind == BIRTH).unwrap();
    let j = sound.atoms[k].level as usize;
    let recounted = |vertices: i64, triangles: i64| {
        let mut draft = sound.clone();
        let atom = &mut draft.atoms[k];
        atom.items = atom.items.wrapping_add_signed(vertices);
        atom.triangles = atom.triangles.wrapping_add_signed(triangles);
        for level in &mut draft.levels[..=j] {
            level.vertices = level.vertices.wrapping_add_signed(vertices);
            level.triangles = level.triangles.wrapping_add_signed(triangles);
        }
        draft.bytes()
    };
    let atom = &sound.atoms[k];
    let (v, t) = (atom.items as i64, atom.triangles as i64);
    assert!(File::read(&recounted(1, 0)).is_ok() || File::read(&recounted(-1, 0)).is_ok());
    for (vertices, triangles) in
        [(1, 0), (-1, 0), (0, 1), (0, -1), (-v, -t), (-v, 0), (0, -t), (1 << 29, 1 << 29), (1 << 31, 1 << 31)]
    {
        assert!(agree(&recounted(vertices, triangles)).is_none(), "{vertices} {triangles}");
    }
    // A payload cut anywhere else is the same; one cut short, or that of another level, is none.
    let mut cut = sound.clone();
    let mut head = cut.atoms[k].clone();
    head.bytes.truncate(2);
    (head.length, head.items, head.triangles) = (2, 0, 0);
    cut.atoms[k].bytes.drain(..2);
    cut.atoms[k].length -= 2;
    let mut short = cut.clone();
    cut.atoms.insert(k, head);
    assert!(agree(&cut.bytes()).is_some());
    assert!(agree(&short.bytes()).is_none());
    let other = sound.atoms.iter().rposition(|atom| atom.kind == BIRTH).unwrap();
    short.atoms[k].bytes = sound.atoms[other].bytes.clone();
    short.atoms[k].length = short.atoms[k].bytes.len();
    assert!(other == k || agree(&short.bytes()).is_none());
}

#[test]
fn a_code_of_nothing() {
    // A mesh without triangles asks for four bytes and makes no decision.
    for length in 0..7 {
        let draft = base_alone(0, 0, vec![atom(BASE, 0, 0, 0, &vec![0; 1 + length])]);
        assert_eq!(agree(&draft.bytes()).is_some(), length <= 4, "a code of {length} bytes");
    }
}

#[test]
fn positions_beyond_binary64() {
    let mut draft = Draft::of(&load("tetrahedron.uwm"));
    (draft.step, draft.maximum) = (1e306, [1; 3]);
    let seen = agree(&draft.bytes()).expect("the box alone must be finite, §3.2");
    assert!(seen.whole.positions.iter().flatten().any(|x| x.is_infinite()));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn a_few_bytes_of_any_payload(
        shape in 0..every_shape().len(),
        mesh in soup(),
        take_soup: bool,
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<prop::sample::Index>(), any::<u8>()), 1..3),
        cut in any::<prop::sample::Index>(),
        shorter: bool,
        exact: bool,
        keep_order: bool,
    ) {
        let mesh = if take_soup { mesh } else { every_shape().swap_remove(shape) };
        let mut options = Options { keyframes: Keyframes::Every(4), atom_bytes: 60, ..Options::default() };
        options.simplify.base_vertices = Some(8);
        options.exact = exact.then_some(Real::Binary64);
        options.keep_order = keep_order;
        let Ok(bytes) = Encoder::new(options).encode_to_vec(&mesh) else { return Ok(()) };
        let mut draft = Draft::of(&bytes);
        for (atom, place, value) in changes {
            let atom = atom.index(draft.atoms.len());
            let place = place.index(draft.atoms[atom].bytes.len());
            draft.atoms[atom].bytes[place] = value;
        }
        if shorter {
            let atom = cut.index(draft.atoms.len());
            let length = draft.atoms[atom].bytes.len();
            draft.atoms[atom].bytes.truncate(length.div_ceil(2));
        }
        agree(&draft.bytes());
    }
    #[test]
    fn any_base(triangles in 1..14u32, boundary in 0..9u8, code in prop::collection::vec(any::<u8>(), 1..24)) {
        let payload = [&[boundary], &code[..]].concat();
        for vertices in 3..=3 * triangles {
            agree(&base_alone(vertices, triangles, vec![atom(BASE, 0, 0, 0, &payload)]).bytes());
        }
    }

    /// Decisions changed, not bytes: what comes after them keeps its meaning.
    #[test]
    fn other_decisions_of_a_base(
        shape in 0..every_shape().len(),
        changes in prop::collection::vec((any::<prop::sample::Index>(), 0..3u8), 1..4),
        boundary in -1..2i64,
    ) {
        // As the bases made below: without shift and margin.
        let mut options =
            Options { position_bits: 8, lifting: Some(0), preview: Preview::Off, ..Options::default() };
        options.simplify.base_vertices = Some(4 + shape);
        let bytes = Encoder::new(options).encode_to_vec(&every_shape()[shape]).unwrap();
        let file = File::read(&bytes).unwrap();
        let base = file.levels[file.levels.len() - 1];
        let payload = file.payload(BASE, file.levels.len() - 1);
        let edges = u64::from(payload[0]);
        let mut answers = forge::answers(&payload[1..], edges, base);
        for (place, change) in changes {
            // The shape is told first.
            let place = place.index(answers.len().min(80));
            match change {
                0 => answers[place] ^= 1,
                1 => answers.insert(place, 1),
                _ => { answers.remove(place); }
            }
        }
        let edges = edges.saturating_add_signed(boundary);
        for vertices in base.vertices.saturating_sub(2)..=base.vertices + 2 {
            let level = Level { vertices, shift: 0, ..base };
            let payload = [&[edges as u8], &forge::code(&answers, edges, level)[..]].concat();
            agree(&base_alone(vertices as u32, base.triangles as u32, vec![atom(BASE, 0, 0, 0, &payload)]).bytes());
        }
    }

    #[test]
    fn any_refinement(vertices in 1..5u32, code in prop::collection::vec(any::<u8>(), 1..24), open: bool) {
        let name = if open { "hand.uwm" } else { "tetrahedron.uwm" };
        let file = File::read(&load(name)).unwrap();
        let base = file.levels[file.levels.len() - 1];
        let atoms = vec![atom(BASE, 0, 0, 0, &file.payload(BASE, file.levels.len() - 1))];
        let draft = base_alone(base.vertices as u32, base.triangles as u32, atoms);
        for triangles in vertices..=2 * vertices {
            agree(&and_a_level(draft.clone(), vertices, triangles, &code).bytes());
        }
    }

    #[test]
    fn any_residue(code in prop::collection::vec(any::<u8>(), 1..40)) {
        let mut draft = Draft::of(&load("tetrahedron.uwm"));
        draft.atoms.retain(|a| a.kind == BASE);
        draft.atoms.push(atom(RESIDUE, 0, 0, 0, &code));
        agree(&draft.bytes());
    }

    #[test]
    fn any_correction_and_order(
        correction in prop::collection::vec(any::<u8>(), 0..60),
        order in prop::collection::vec(any::<u8>(), 0..40),
        few: bool,
    ) {
        // Codes of small bytes answer no at first, and come further.
        let small = |bytes: &[u8]| -> Vec<u8> { bytes.iter().map(|x| if few { x >> 5 } else { *x }).collect() };
        let mut draft = Draft::of(&load("torus.uwm"));
        draft.atoms.retain(|a| a.kind != METADATA && a.kind != KEYFRAME);
        draft.atoms.extend((!correction.is_empty()).then(|| atom(CORRECTION, 0, 0, 0, &small(&correction))));
        draft.atoms.extend((!order.is_empty()).then(|| atom(ORDER, 0, 0, 0, &small(&order))));
        agree(&draft.bytes());
    }
}
