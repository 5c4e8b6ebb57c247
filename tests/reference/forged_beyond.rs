//! Corrections and orders that no encoder writes, behind bases that one wrote: both decoders read the same from them or refuse them.

use std::collections::BTreeMap;

use unweld::encoder::{Encoder, Options};
use unweld::mesh::{IndexedMesh, shapes};

use super::agree::agree;
use super::container::{BASE, CORRECTION, File, ORDER, Result};
use super::correction::read_correction;
use super::draft::{Draft, atom};
use super::entropy::{Code, Part};
use super::forge::{self, number};
use super::keyframe;
use super::on_shapes::cones;
use super::order::read_order;
use super::residue::{self, Origins, Whole};
use super::walk::Mesh;

/// A file that is a base alone.
struct Stage {
    file: File,
    draft: Draft,
    mesh: Mesh,
}

/// A payload that is read, and whether it is sound.
struct Read {
    parts: Vec<Part>,
    sound: bool,
}

impl Stage {
    fn of(mesh: &IndexedMesh) -> Self {
        let mut options = Options { position_bits: 8, ..Options::default() };
        options.simplify.base_vertices = Some(mesh.positions.len());
        let mut draft = Draft::of(&Encoder::new(options).encode_to_vec(mesh).unwrap());
        draft.atoms.retain(|a| a.kind == BASE);
        let file = File::read(&draft.bytes()).unwrap();
        let mesh = keyframe::read(&file.payload(BASE, 0), file.levels[0], file.scale(0)).unwrap();
        Self { file, draft, mesh }
    }

    fn whole(&self) -> (Whole, Origins) {
        residue::whole(&self.file, &self.mesh).unwrap()
    }

    /// What a reader of a correction finds: these answers, then zeros.
    fn correction(&self, answers: &[u64]) -> Read {
        let (mut whole, origins) = self.whole();
        read(answers, |code| read_correction(code, &self.file, &mut whole, &origins))
    }

    fn order(&self, answers: &[u64]) -> Read {
        let (whole, origins) = self.whole();
        read(answers, |code| read_order(code, &self.mesh, &whole, &origins).map(drop))
    }

    /// What both decoders make of the file with such a payload.
    fn judge(&self, kind: u8, read: &Read) -> Option<Whole> {
        let mut draft = self.draft.clone();
        draft.atoms.push(atom(kind, 0, 0, 0, &forge::encode(read.parts.iter().copied())));
        let seen = agree(&draft.bytes());
        assert_eq!(seen.is_some(), read.sound);
        seen.map(|seen| seen.whole)
    }
}

fn read(answers: &[u64], reader: impl FnOnce(&mut Code) -> Result<()>) -> Read {
    let tap = forge::scripted(answers);
    let sound = reader(&mut Code::tapped(&[], &tap)).is_ok();
    Read { parts: tap.into_inner().log.into_iter().map(|(part, _)| part).collect(), sound }
}

/// The decisions of a signed number (§6.3).
fn signed(value: i64) -> Vec<u64> {
    let mut answers = number(value.unsigned_abs());
    answers.extend((value != 0).then_some(u64::from(value < 0)));
    answers
}

/// Grids as large as they may be, and one larger: the answer is put into a sound code, so that a reader who lets it pass goes on to the end.
#[test]
fn the_last_grids() {
    let stage = Stage::of(&shapes::tetrahedron());
    // Type; of axis 0 how many grids, of which kind, and then the numbers of the grid.
    let binary32 = [0, 0, 0, 30];
    let binary64 = [1, 0, 0, 62];
    let decimal = [0, 0, 1, 15, 22];
    let least = [0, 0, 1, 1, 0];
    let cases: [(&[u64], usize, u64); 4] =
        [(&binary32, 3, 31), (&binary64, 3, 63), (&decimal, 4, 23), (&least, 3, 0)];
    for (sound, place, wrong) in cases {
        let mut read = stage.correction(sound);
        // The last word before the number of copies is 1, so that the code does not end in more zeros than one may.
        let word = read.parts.len() - 2;
        read.parts[word] = Part { parts: 1 << 16, start: 1, end: Some(2) };
        assert!(read.sound && stage.judge(CORRECTION, &read).is_some(), "{sound:?}");
        let parts = read.parts[place].parts;
        read.parts[place] = Part { parts, start: wrong, end: (wrong + 1 < parts).then_some(wrong + 1) };
        read.sound = false;
        assert!(stage.judge(CORRECTION, &read).is_none(), "{sound:?}: {wrong} in place {place}");
    }
}

/// A copy of vertex `v` beyond the one before, whose first coordinate is so many numbers away.
fn copy(v: u64, away: i64) -> Vec<u64> {
    let x = [vec![1, 1], signed(away)].concat();
    [number(v), x, vec![0, 0]].concat()
}

/// Copies come in order, each once, and none is its vertex over again.
#[test]
fn copies_in_order() {
    let stage = Stage::of(&shapes::tetrahedron());
    // No copies: the last decision says so.
    let before = stage.correction(&[]).parts.len() - 1;
    let told = |copies: &[(u64, i64)]| {
        let copies =
            [number(copies.len() as u64), copies.iter().flat_map(|&(v, away)| copy(v, away)).collect()];
        stage.correction(&[vec![0; before], copies.concat()].concat())
    };
    let cases: [(&[(u64, i64)], bool); 8] = [
        (&[(0, 1)], true),
        (&[(0, 0)], false),
        (&[(0, 1), (0, 2)], true),
        (&[(0, 2), (0, 2)], false),
        (&[(0, 2), (0, 1)], false),
        (&[(0, 2), (1, 1)], true),
        (&[(3, -1)], true),
        (&[(4, -1)], false),
    ];
    for (copies, sound) in cases {
        let read = told(copies);
        assert_eq!(read.sound, sound, "{copies:?}");
        let whole = stage.judge(CORRECTION, &read);
        assert_eq!(whole.map(|whole| whole.positions.len()), sound.then_some(4 + copies.len()), "{copies:?}");
    }
}

/// A corner is at its vertex, or at one of its copies.
#[test]
fn corners_at_copies() {
    let stage = Stage::of(&shapes::tetrahedron());
    let before = stage.correction(&[]).parts.len() - 1;
    let v = stage.whole().0.triangles[0][0];
    for (name, sound) in [(0, true), (1, true), (2, true), (3, false)] {
        let copies = [number(2), copy(v as u64, 1), copy(0, 2), number(name)].concat();
        let read = stage.correction(&[vec![0; before], copies].concat());
        assert_eq!(read.sound, sound, "copy {name}");
        let whole = stage.judge(CORRECTION, &read);
        let corner = if name == 0 { v } else { 3 + name as usize };
        assert_eq!(whole.map(|whole| whole.triangles[0][0]), sound.then_some(corner), "copy {name}");
    }
}

/// The tip of a cone gets some instances; the next corner that has it takes another one than the last, by its number.
#[test]
fn another_instance() {
    let stage = Stage::of(&cones(&[9]));
    let (whole, _) = stage.whole();
    let corners = whole.triangles.as_flattened();
    let tip = (0..10).max_by_key(|v| corners.iter().filter(|w| *w == v).count()).unwrap();
    for n in 2..=7 {
        for k in 0..n as u64 {
            // The triangles in the order of the walk; so many vertices more.
            let mut answers = vec![0; 3 * whole.triangles.len() - 1];
            answers.extend(number(n as u64 - 1));
            let mut met = BTreeMap::new();
            let mut asked = false;
            for &v in corners {
                let count = met.entry(v).or_insert(0);
                if *count == 0 {
                    *count = 1;
                } else if v != tip || asked {
                    // No fresh one, and no other one than the last.
                    answers.extend(vec![0; if *count > 1 { 2 } else { 1 }]);
                } else if *count < n {
                    answers.push(1);
                    *count += 1;
                } else {
                    answers.extend([0, 1]);
                    answers.extend(if n > 2 { number(k) } else { vec![] });
                    asked = true;
                }
            }
            let read = stage.order(&answers);
            // Of two there is but one other, which needs no number.
            assert_eq!(read.sound, n == 2 || k as usize <= n - 2, "{k} of {n}");
            let whole = stage.judge(ORDER, &read);
            assert_eq!(whole.map(|whole| whole.positions.len()), read.sound.then_some(9 + n), "{k} of {n}");
        }
    }
}
