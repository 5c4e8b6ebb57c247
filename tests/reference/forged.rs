//! Refinements that no encoder writes, behind bases that one wrote: stars as large as they may be, vertices anywhere and
//! nowhere. Both decoders read the same from them or refuse them.

use proptest::prelude::*;
use unweld::encoder::{Encoder, Options};
use unweld::mesh::{IndexedMesh, shapes};

use super::agree::{Seen, agree, by_reference};
use super::container::{BASE, File};
use super::draft::Draft;
use super::forge::{self, Forged};
use super::hostile::and_a_level;
use super::keyframe;
use super::residue::Whole;
use super::trace::Step;
use super::walk::Mesh;

/// A file that is a base alone.
struct Stage {
    file: File,
    draft: Draft,
}

impl Stage {
    fn of(mesh: &IndexedMesh, bits: u32) -> Self {
        Self::lifted(mesh, bits, 0)
    }

    fn lifted(mesh: &IndexedMesh, bits: u32, lifting: u8) -> Self {
        let mut options = Options {
            position_bits: bits,
            lifting: Some(lifting),
            rich_models: Some(false),
            ..Options::default()
        };
        options.simplify.base_vertices = Some(mesh.positions.len());
        let bytes = Encoder::new(options).encode_to_vec(mesh).unwrap();
        let mut draft = Draft::of(&bytes);
        draft.atoms.retain(|a| a.kind == BASE);
        let file = File::read(&draft.bytes()).unwrap();
        assert_eq!(file.levels.len(), 1);
        Self { file, draft }
    }

    fn mesh(&self) -> Mesh {
        keyframe::read(&self.file.payload(BASE, 0), self.file.levels[0], self.file.scale(0)).unwrap()
    }

    fn forge(&self, answers: &[u64], most: u64) -> Forged {
        forge::refinement(|| self.mesh(), answers, most, self.file.scale(0))
    }

    /// The base and this level.
    fn bytes(&self, level: &Forged) -> Vec<u8> {
        let (vertices, triangles) = (level.vertices as u32, level.triangles as u32);
        and_a_level(self.draft.clone(), vertices, triangles, &level.bytes).bytes()
    }

    /// Both decoders on the file, which the reference judges as it did while the level was forged.
    fn judge(&self, level: &Forged) -> Option<Seen> {
        let bytes = self.bytes(level);
        let verdict = by_reference(&File::read(&bytes).unwrap(), 1).err();
        assert_eq!(verdict, level.verdict.clone().err());
        agree(&bytes)
    }
}

/// An encoder stops at smaller stars; a reader that is told to flip goes on up to 64 triangles.
#[test]
fn the_largest_star() {
    let stage = Stage::of(&shapes::torus(16, 16), 8);
    // Yes to all questions, and each coordinate near where it is expected.
    let level = stage.forge(&[8; 100], 1);
    let seen = stage.judge(&level).expect("it is sound");
    let flips = level.steps.iter().filter(|step| matches!(step, Step::Flip(.., true))).count();
    assert_eq!(flips, 60);
    let largest = (0..seen.whole.positions.len()).map(|v| valence(&seen.whole, v)).max();
    assert_eq!(largest, Some(64));
}

fn valence(whole: &Whole, v: usize) -> usize {
    whole.triangles.iter().filter(|t| t.contains(&v)).count()
}

/// Bases with long and short edges, with edges of no length, and with triangles of no area.
fn stages() -> Vec<Stage> {
    let mut outlier = shapes::sphere(1);
    outlier.positions[5] = [1e5, 2e5, -1e5];
    let mut needles = shapes::grid(4, 4);
    for [x, y, z] in &mut needles.positions {
        let [along, aside] = [*x + 1e-2 * *y, 1e-6 * *y];
        [*x, *y, *z] = [along, along + aside, along - aside];
    }
    let meshes = [shapes::disc_with_ears(), shapes::tetrahedron(), outlier, needles];
    meshes.iter().flat_map(|mesh| [8, 16, 24].map(|bits| Stage::of(mesh, bits))).collect()
}

/// Answers to all questions up to the first one of a kind, with yes to that.
fn first(stage: &Stage, kind: fn(&Step) -> bool) -> Option<Vec<u64>> {
    let asked = stage.forge(&[], 1).steps;
    let place = asked.iter().position(kind)?;
    // Before all of them, which length splits go by.
    Some([vec![0; place + 1], vec![1]].concat())
}

/// A level of one vertex with its cell there, or as near to it as the code can say.
fn aim(stage: &Stage, mut answers: Vec<u64>, target: [i64; 3]) -> Forged {
    for axis in 0..3 {
        let steps = stage.forge(&answers, 1).steps;
        let mut read =
            steps.iter().filter_map(|s| if let Step::Coordinate(it) = s { Some(it) } else { None });
        let Some(read) = read.nth(axis) else { break };
        answers.extend(forge::coordinate(read, target[read.axis] - read.start));
    }
    stage.forge(&answers, 1)
}

const SITES: [fn(&Step) -> bool; 3] = [
    |step| matches!(step, Step::Split(..)),
    |step| matches!(step, Step::Face(..)),
    |step| matches!(step, Step::Attach(..)),
];

#[test]
fn anywhere_on_the_lattice() {
    let (mut far, mut shifts) = (0, vec![]);
    for stage in stages() {
        let most = (1 << stage.file.bits) - 1;
        for answers in SITES.iter().filter_map(|site| first(&stage, *site)) {
            for target in [[0, 0, 0], [most; 3], [0, most, most / 3], [most / 2, 1, most - 1]] {
                let level = aim(&stage, answers.clone(), target);
                let seen = stage.judge(&level).expect("it is sound");
                assert!(seen.whole.positions.contains(&stage.file.position(target)));
                for step in &level.steps {
                    if let Step::Coordinate(read) = step {
                        far = far.max(read.beyond);
                        shifts.push(read.shift);
                    }
                }
            }
        }
    }
    // The whole width of the finest lattice, in steps of one.
    assert!(far > 1 << 23, "{far}");
    assert!(shifts.contains(&0) && shifts.contains(&16));
}

#[test]
fn nowhere_else() {
    for stage in stages() {
        let most = (1i64 << stage.file.bits) - 1;
        for answers in SITES.iter().filter_map(|site| first(&stage, *site)) {
            // The last ones would be on the lattice if they were cut to 32 bits.
            for wrong in [-1, most + 1, -1 << 24, 1 << 31, 1 << 32, -1 << 32, 1 << 40] {
                for axis in 0..3 {
                    let mut target = [most / 2; 3];
                    target[axis] = wrong;
                    let level = aim(&stage, answers.clone(), target);
                    assert!(matches!(&level.verdict, Err(why) if !why.starts_with("§5.2")), "{wrong}");
                    assert!(stage.judge(&level).is_none());
                }
            }
        }
    }
}

/// With lifting there is a margin of a quarter on each side, for new vertices and for those that lifts move.
#[test]
fn nowhere_beyond_the_margin() {
    let (mut moved, mut refused) = (0, 0);
    for bits in [8, 16, 23] {
        let stage = Stage::lifted(&shapes::sphere(1), bits, 32);
        let (margin, last) = (1i64 << (bits - 2), (1i64 << bits) - 1);
        let answers = first(&stage, SITES[0]).expect("the first edge can be split");
        for axis in 0..3 {
            for wrong in [-margin - 1, last + margin + 1, -1 << 31] {
                let mut target = [last / 2; 3];
                target[axis] = wrong;
                let level = aim(&stage, answers.clone(), target);
                assert!(matches!(&level.verdict, Err(why) if !why.starts_with("§5.2")), "{wrong}");
                assert!(stage.judge(&level).is_none());
            }
            for target in [-margin, last + margin].map(|x| {
                let mut target = [last / 2; 3];
                target[axis] = x;
                target
            }) {
                // The ends fly the other way: from where they are, perhaps off the lattice.
                let level = aim(&stage, answers.clone(), target);
                match &level.verdict {
                    Err(why) => {
                        assert_eq!(why, "§5.4.5: off the lattice");
                        assert!(stage.judge(&level).is_none());
                        refused += 1;
                    }
                    Ok(()) => {
                        let seen = stage.judge(&level).expect("it is sound");
                        moved += usize::from(!seen.whole.positions.contains(&stage.file.position(target)));
                    }
                }
            }
        }
    }
    assert!(moved > 0 && refused > 0, "{moved} moved, {refused} refused");
}

#[test]
fn numbers_too_large() {
    for stage in stages() {
        for token in [0, 15] {
            for (beyond, why) in [
                (forge::number((1 << 28) - 1), "§5.4.4: off the lattice"),
                (forge::number(1 << 28), "§5.4.4: too far"),
                (forge::number((1 << 32) - 1), "§5.4.4: too far"),
                (vec![1; 33], "§6.3: a number of more than 32 bits"),
            ] {
                // By which length, then whether the first edge is split.
                let answers = [&[0, 1, token][..], &beyond].concat();
                let level = stage.forge(&answers, 1);
                assert_eq!(level.verdict, Err(why.into()));
                assert!(stage.judge(&level).is_none());
            }
        }
    }
}

#[test]
fn codes_of_any_length() {
    for stage in stages() {
        let mut level = stage.forge(&[8; 40], 3);
        let whole = level.bytes.clone();
        let sound = agree(&stage.bytes(&level)).is_some();
        for length in 1..whole.len() + 6 {
            level.bytes.resize(length, 0);
            level.bytes[..length.min(whole.len())].copy_from_slice(&whole[..length.min(whole.len())]);
            let seen = agree(&stage.bytes(&level));
            // An encoder of the whole may leave out four zeros at most, and these are at its end.
            assert!(
                !(sound && length > whole.len() + 4 && seen.is_some()),
                "{length} of {} bytes",
                whole.len()
            );
        }
    }
}

/// Runs of answers as they come together: no, yes, a token, a long number, anything.
fn answers() -> impl Strategy<Value = Vec<u64>> {
    let run = prop_oneof![
        4 => prop::collection::vec(Just(0), 1..4),
        4 => (5u64..12, 5u64..12, 5u64..12).prop_map(|(x, y, z)| vec![1, x, y, z]),
        2 => prop::collection::vec(0u64..16, 1..4),
        1 => prop::collection::vec(Just(1), 1..34),
        1 => prop::collection::vec(any::<u16>().prop_map(u64::from), 1..3),
    ];
    prop::collection::vec(run, 1..30).prop_map(|runs| runs.concat())
}

/// Shapes drawn out along a line, more or less.
fn drawn_out() -> impl Strategy<Value = IndexedMesh> {
    let shape =
        prop::sample::select(vec![shapes::disc_with_ears(), shapes::tetrahedron(), shapes::grid(4, 4)]);
    (shape, [-8..9i32, -8..9, -8..9], 0..9).prop_map(|(mut mesh, line, thin)| {
        for p in &mut mesh.positions {
            let along = p[0] + 0.01 * p[1];
            *p = [0, 1, 2].map(|k| along * f64::from(line[k]) + p[k] * 0.1f64.powi(thin));
        }
        mesh
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(600))]

    #[test]
    fn any_answers(mesh in drawn_out(), bits in 8..25u32, lifting in 0..33u8, answers in answers(), most in 1..40u64) {
        let stage = Stage::lifted(&mesh, bits, if bits < 24 { lifting } else { 0 });
        let level = stage.forge(&answers, most);
        prop_assert_eq!(stage.judge(&level).is_some(), level.verdict.is_ok());
    }
}
