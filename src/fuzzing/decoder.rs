//! The decoder on hostile files.

use std::sync::Arc;

use super::choices::Choices;
use super::container::mend;
use super::seeds;
use crate::codec::lift::Cells;
use crate::container::{Contents, Part, parse_contents, plan_from_keyframe};
use crate::decoder::{Decoder, Event, Options};
use crate::error::Result;
use crate::limits::Limits;
use crate::mesh::IndexedMesh;
use crate::refine::ProgressiveMesh;

/// Decodes `data` as a file, and as changes to a file; by way of its keyframes too.
pub fn fuzz_decode(data: &[u8]) {
    let mut bytes = data.to_vec();
    mend(&mut bytes);
    // Whether noise is accepted does not matter.
    let _ = decode(&bytes, &mut Choices(data));
    let Some(file) = seeds::changed(&mut Choices(data)) else { return };
    let outcome = decode(&file, &mut Choices(data));
    assert!(data.len() > 1 || outcome.is_ok(), "a file of the encoder: {outcome:?}");
    let contents = parse_contents(&file).ok().flatten().expect("the writer wrote it");
    for j in contents.segments() {
        let mut decoder = from_keyframe(&file, &contents, j, options());
        let outcome = run(&mut decoder, &mut Choices(&[]));
        assert!(data.len() > 1 || outcome.is_ok(), "a keyframe of the encoder: {outcome:?}");
    }
}

/// However a file is cut, its events, its mesh and its error are the same.
pub fn fuzz_chunks(data: &[u8]) {
    let mut bytes = data.to_vec();
    mend(&mut bytes);
    let changed = seeds::changed(&mut Choices(data));
    for file in [Some(bytes), changed].into_iter().flatten() {
        let whole = tell(&file, |left| left);
        let mut choices = Choices(data);
        assert_eq!(whole, tell(&file, |_| 1 + choices.below(64)), "irregular pieces");
        assert_eq!(whole, tell(&file, |_| 7), "pieces of seven bytes");
    }
}

/// A decoder that holds the way to level 0, residue and metadata that begins with the base or keyframe of level `j`.
pub(super) fn from_keyframe(file: &[u8], contents: &Arc<Contents>, j: u32, options: Options) -> Decoder {
    let mut plan = plan_from_keyframe(contents, j);
    plan.parts.truncate(1);
    let first = if j > 0 { contents.steps(j - 1).start } else { contents.steps(0).end };
    let atoms = first..contents.metadata().end;
    plan.parts.push(Part { bytes: contents.bytes(atoms.clone()), atoms });
    let mut decoder = Decoder::of_plan(contents.clone(), &plan, options);
    for part in &plan.parts {
        decoder.push(&file[part.bytes.start as usize..part.bytes.end as usize]);
    }
    decoder
}

fn options() -> Options {
    Options {
        limits: Limits { memory: 64 << 20, work: 1 << 22 },
        undo: true,
        flips: true,
        ..Options::default()
    }
}

fn decode(file: &[u8], choices: &mut Choices) -> Result<()> {
    let mut decoder = Decoder::new(options());
    decoder.push(file);
    run(&mut decoder, choices)
}

/// Polls to the end, and beyond an error. On the way it goes down and up the levels where a choice says so.
fn run(decoder: &mut Decoder, choices: &mut Choices) -> Result<()> {
    let mut outcome = Ok(());
    loop {
        match decoder.poll() {
            Ok(None) => break,
            Ok(Some(event)) => {
                check(decoder);
                check_level(decoder, &event);
                if choices.byte().is_some_and(|byte| byte % 8 == 1) {
                    go_down_and_up(decoder, choices.below(4));
                }
            }
            Err(fault) => {
                check(decoder);
                let again = decoder.poll().expect_err("decoding has ended");
                assert_eq!(again.to_string(), fault.to_string());
                outcome = Err(fault);
                break;
            }
        }
    }
    if decoder.level().is_some() {
        go_down_and_up(decoder, usize::MAX);
    }
    outcome.and(decoder.finish())
}

/// The mesh is a valid one on the lattice, and can be had as triangles.
fn check(decoder: &Decoder) {
    let mesh = decoder.mesh();
    mesh.table.check().expect("a mesh that can be seen is a manifold");
    let Some(contents) = decoder.contents().filter(|_| decoder.level().is_some()) else {
        assert!(decoder.assembled().is_err());
        return;
    };
    assert_eq!(mesh.positions.len(), mesh.table.vertex_slots());
    let header = &contents.header;
    let cells = Cells { bits: header.lattice.bits, precision: 0, lifting: header.coding.lifting };
    assert!(mesh.positions.iter().all(|&p| cells.hold_position(p)), "a position off the lattice");
    let assembled = decoder.assembled().expect("the base is there");
    check_indices(&assembled);
    let further = decoder.residue().filter(|_| decoder.level() == Some(0)).map_or(0, |r| r.triangles.len());
    assert_eq!(assembled.triangles.len(), mesh.table.triangle_count() + further);
}

pub(super) fn check_indices(mesh: &IndexedMesh) {
    assert!(mesh.triangles.iter().flatten().all(|&v| (v as usize) < mesh.positions.len()));
}

/// A level is as large as the table of contents says, and all of it is within reach of its roots.
fn check_level(decoder: &Decoder, event: &Event) {
    if let (Event::Level { level, .. }, Some(contents)) = (event, decoder.contents()) {
        let (mesh, entry) = (decoder.mesh(), &contents.levels[*level as usize]);
        let counts = (mesh.positions.len() as u32, mesh.table.triangle_count() as u32);
        assert_eq!(counts, (entry.vertices, entry.triangles), "level {level} {:?}", contents.atoms);
    }
}

/// Up to `most` levels down the undo log and up again changes nothing.
fn go_down_and_up(decoder: &mut Decoder, most: usize) {
    let before = State::of(decoder.mesh());
    let level = decoder.level();
    let mut down = 0;
    while down < most && decoder.coarsen().expect("a log is kept").is_some() {
        check(decoder);
        down += 1;
    }
    for _ in 0..down {
        assert!(decoder.restore().expect("a log is kept").is_some());
    }
    assert_eq!(decoder.level(), level);
    assert!(before == State::of(decoder.mesh()), "down {down} levels and up again is another mesh");
}

/// What two equal meshes agree in.
#[derive(Debug, PartialEq)]
struct State {
    triangles: Vec<[u32; 3]>,
    positions: Vec<[i32; 3]>,
    roots: Vec<(u32, u32)>,
}

impl State {
    fn of(mesh: &ProgressiveMesh) -> Self {
        Self {
            triangles: mesh.table.triangles().map(|t| mesh.table.triangle(t).map(|v| v.0)).collect(),
            positions: mesh.positions.clone(),
            roots: mesh.roots.edges().iter().map(|(u, w)| (u.0, w.0)).collect(),
        }
    }
}

/// Pushes the file in pieces and tells all events, the mesh at the end, and the error.
fn tell(mut file: &[u8], mut size: impl FnMut(usize) -> usize) -> (Vec<Event>, State, Option<String>) {
    let mut decoder = Decoder::new(Options { undo: false, ..options() });
    let mut events = Vec::new();
    while !file.is_empty() {
        let (piece, rest) = file.split_at(size(file.len()).min(file.len()));
        file = rest;
        decoder.push(piece);
        loop {
            match decoder.poll() {
                Ok(Some(event)) => events.push(event),
                Ok(None) => break,
                Err(fault) => return (events, State::of(decoder.mesh()), Some(fault.to_string())),
            }
        }
    }
    let outcome = decoder.finish().err().map(|fault| fault.to_string());
    (events, State::of(decoder.mesh()), outcome)
}
