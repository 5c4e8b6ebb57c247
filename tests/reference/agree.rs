//! Both decoders on one file.

use std::collections::BTreeSet;
use std::sync::Arc;

use unweld::container::{AtomKind, Contents, Part, Plan, parse_contents};
use unweld::decoder::{Decoder, Event, Options};
use unweld::mesh::attributes::Domain;

use super::attribute::{Attribute, errors_read, errors_told};
use super::container::{File, KEYFRAME};
use super::decode::decode;
use super::residue::Whole;
use super::resources;

type Point = [i64; 3];

/// Where a corner is, and for each attribute the integers of its value: nothing where it is not alive, nor where it has none.
type Corner = (Point, Vec<Option<Vec<i32>>>);

/// What a decoder shows of a file, independent of how it numbers things.
#[derive(Debug, PartialEq)]
pub struct Seen {
    pub levels: Vec<Shown>,
    pub about: Vec<About>,
    pub whole: Whole,
    /// Those that were on the way: their bytes, of the scene its JSON.
    pub resources: Vec<Option<Vec<u8>>>,
}

/// A level.
#[derive(Debug, PartialEq)]
pub struct Shown {
    level: usize,
    errors: (f64, f64),
    /// Triangles, each from its smallest corner, sorted.
    triangles: Vec<[Corner; 3]>,
    roots: Vec<[Point; 2]>,
}

/// Sorts triangles, each turned to begin with its smallest corner.
pub fn sorted<P: Clone + PartialOrd>(triangles: impl Iterator<Item = [P; 3]>) -> Vec<[P; 3]> {
    let order = |a: &[P; 3], b: &[P; 3]| a.partial_cmp(b).expect("no coordinate is NaN");
    let turned = |[a, b, c]: [P; 3]| {
        let turns = [[a.clone(), b.clone(), c.clone()], [b.clone(), c.clone(), a.clone()], [c, a, b]];
        turns.into_iter().min_by(order).expect("a triangle has three rotations")
    };
    let mut all: Vec<_> = triangles.map(turned).collect();
    all.sort_by(order);
    all
}

/// Both decoders on this file, from the base and from every keyframe. They must agree, on the fault as well.
/// Returns what they show from the base, or `None` where they refuse it.
pub fn agree(bytes: &[u8]) -> Option<Seen> {
    let file = match File::read(bytes) {
        Ok(file) => file,
        Err(why) => {
            assert!(by_crate(bytes, None).is_err(), "only the reference refuses: {why}");
            return None;
        }
    };
    let told = parse_contents(bytes).ok().flatten().expect("the crate reads the table, too");
    assert_eq!(errors_told(&told), errors_read(&file.attribute_errors));
    let base = file.levels.len() - 1;
    let keyframes = file.atoms.iter().filter(|a| a.kind == KEYFRAME).map(|a| a.level as usize);
    for start in keyframes.collect::<BTreeSet<_>>() {
        same(by_reference(&file, start), by_crate(bytes, Some(start)), start);
    }
    same(by_reference(&file, base), by_crate(bytes, None), base)
}

fn same(ours: Result<Seen, String>, theirs: unweld::Result<Seen>, start: usize) -> Option<Seen> {
    match (ours, theirs) {
        (Ok(ours), Ok(theirs)) => {
            assert_eq!(ours.levels.len(), theirs.levels.len(), "from level {start}");
            for (ours, theirs) in ours.levels.iter().zip(&theirs.levels) {
                assert!(ours == theirs, "level {} from level {start} is not the same", ours.level);
            }
            // To the last bit: zeros have signs.
            let bits =
                |seen: &Seen| seen.whole.positions.iter().map(|p| p.map(f64::to_bits)).collect::<Vec<_>>();
            let same = bits(&ours) == bits(&theirs) && ours.whole.triangles == theirs.whole.triangles;
            assert!(same, "the whole from level {start} is not the same");
            assert_eq!(ours.about, theirs.about, "from level {start}");
            assert!(ours.resources == theirs.resources, "the resources from level {start} are not the same");
            for (t, (ours, theirs)) in ours.whole.values.iter().zip(&theirs.whole.values).enumerate() {
                assert_eq!(ours, theirs, "values of triangle {t} from level {start}");
            }
            assert_eq!(ours.whole.values.len(), theirs.whole.values.len());
            Some(ours)
        }
        // A decoder may give up for want of memory or time; the reference never does.
        (_, Err(unweld::Error::Limit { .. })) | (Err(_), Err(_)) => None,
        (Err(why), Ok(_)) => panic!("from level {start} only the reference refuses: {why}"),
        (Ok(_), Err(why)) => panic!("from level {start} only the crate refuses: {why}"),
    }
}

/// What the reference shows.
pub fn by_reference(file: &File, start: usize) -> Result<Seen, String> {
    let mut levels = Vec::new();
    let whole = decode(file, start, &mut |level, mesh, attributes| {
        let at = |v: usize| mesh.points[v];
        let corner = |c| -> Corner {
            let values = attributes.integers(mesh, c).into_iter().map(Option::flatten);
            (at(mesh.tip(c)), values.collect())
        };
        let about = file.levels[level];
        levels.push(Shown {
            level,
            errors: (about.max_error, about.rms_error),
            triangles: sorted(mesh.triangles().map(|[x, y, z]| [(y, z), (z, x), (x, y)].map(corner))),
            roots: mesh.roots.iter().map(|&(u, w)| [at(u), at(w)]).collect(),
        });
    })?;
    let about = file.attributes.iter().map(About::read).collect();
    Ok(Seen { levels, about, whole, resources: resources::read(file, start)? })
}

/// What the crate shows, from the base or from the keyframe of a level.
pub fn by_crate(bytes: &[u8], start: Option<usize>) -> unweld::Result<Seen> {
    let mut decoder = Decoder::new(Options::default());
    decoder.push(bytes);
    if let Some(start) = start {
        let Some(Event::Contents(contents)) = decoder.poll()? else {
            panic!("a file begins with its contents")
        };
        let plan = plan(&contents, start as u32);
        decoder = Decoder::of_plan(Arc::clone(&contents), &plan, Options::default());
        for part in &plan.parts {
            decoder.push(&bytes[part.bytes.start as usize..part.bytes.end as usize]);
        }
    }
    let mut levels = Vec::new();
    while let Some(event) = decoder.poll()? {
        let errors = match event {
            Event::Level { max_error, rms_error, .. } => (max_error, rms_error),
            // The level is shown again, with what is born there.
            Event::Attributes { level } if level > 0 => {
                levels.pop().map_or((0.0, 0.0), |shown: Shown| shown.errors)
            }
            _ => continue,
        };
        let mesh = decoder.mesh();
        let at = |v: unweld::mesh::Vertex| mesh.positions[v.index()].map(i64::from);
        let level = decoder.level().expect("one has been come to") as usize;
        levels.push(Shown {
            level,
            errors,
            triangles: sorted(
                mesh.table
                    .triangles()
                    .map(|t| t.corners().map(|c| (at(mesh.table.vertex(c)), integers(&decoder, c)))),
            ),
            roots: mesh.roots.edges().iter().map(|&(u, w)| [at(u), at(w)]).collect(),
        });
    }
    decoder.finish()?;
    let assembled = decoder.assembled()?;
    let triangles = assembled.triangles.iter().map(|t| t.map(|v| v as usize)).collect();
    let values = match assembled.attributes.is_empty() {
        true => vec![],
        false => (0..assembled.triangles.len())
            .map(|t| [0, 1, 2].map(|k| assembled.attributes.iter().map(|a| numbers(a, t, k)).collect()))
            .collect(),
    };
    let about = assembled.attributes.iter().map(About::of).collect();
    let resources = (0..decoder.resources().len()).map(|k| decoder.resource(k).map(<[u8]>::to_vec)).collect();
    let whole = Whole { positions: assembled.positions, triangles, values };
    Ok(Seen { levels, about, whole, resources })
}

/// The integers at a corner of a decoder's mesh.
fn integers(decoder: &Decoder, c: unweld::mesh::Corner) -> Vec<Option<Vec<i32>>> {
    let entries = &decoder.contents().expect("a level has been come to").attributes;
    let Some(attributes) = decoder.attributes() else { return vec![None; entries.len()] };
    let value = |(k, column): (usize, &unweld::codec::attributes::Column)| {
        let at = match entries[k].domain {
            Domain::Corner => attributes.wedges.of(c),
            Domain::Triangle => attributes.wedges.row(c.triangle()),
        };
        column.value(at).filter(|_| attributes.is_born(k)).map(<[i32]>::to_vec)
    };
    attributes.columns.iter().enumerate().map(value).collect()
}

/// The bits of the numbers at a corner of a mesh.
fn numbers(a: &unweld::mesh::Attribute, triangle: usize, corner: usize) -> Option<Vec<u64>> {
    let low =
        [0xFF, 0xFFFF, u64::from(u32::MAX), u64::MAX][[0, 0, 1, 1, 2, 2, 2, 3][a.values.stored() as usize]];
    let value = a.at(triangle, corner)?;
    Some((0..a.components).map(|k| a.values.bits(value * a.components + k) & low).collect())
}

/// What tells one attribute from another.
#[derive(Debug, PartialEq)]
pub struct About {
    semantic: u8,
    stored: u8,
    components: usize,
    of_triangles: bool,
    normalised: bool,
    set: u64,
    name: String,
}

impl About {
    fn of(a: &unweld::mesh::Attribute) -> Self {
        Self {
            semantic: a.semantic as u8,
            stored: a.values.stored() as u8,
            components: a.components,
            of_triangles: a.domain == Domain::Triangle,
            normalised: a.normalised,
            set: a.set.into(),
            name: a.name.clone(),
        }
    }

    fn read(a: &Attribute) -> Self {
        Self {
            semantic: a.semantic,
            stored: a.stored,
            components: a.components,
            of_triangles: a.marks % 2 == 1,
            normalised: a.marks / 2 % 2 == 1,
            set: a.set,
            name: a.name.clone(),
        }
    }
}

/// From the keyframe of level `start` to the end, keyframes of other levels left out.
fn plan(contents: &Contents, start: u32) -> Plan {
    let atoms = &contents.atoms;
    let part = |wanted: &dyn Fn(AtomKind, u32) -> bool| {
        let wanted: Vec<_> = (0..atoms.len()).filter(|&i| wanted(atoms[i].kind, atoms[i].level)).collect();
        let (&first, &last) = (wanted.first()?, wanted.last()?);
        let end = atoms[last].offset + u64::from(atoms[last].length);
        Some(Part { atoms: first..last + 1, bytes: atoms[first].offset..end })
    };
    let keyframe = part(&|kind, level| kind == AtomKind::Keyframe && level == start);
    let onwards = part(&|kind, level| match kind {
        AtomKind::Precision | AtomKind::Refinement | AtomKind::Birth => level < start,
        AtomKind::Attributes if level > 0 => level < start,
        AtomKind::Resource => level < start,
        AtomKind::Residue
        | AtomKind::Attributes
        | AtomKind::Correction
        | AtomKind::Order
        | AtomKind::Metadata => true,
        _ => false,
    });
    let parts: Vec<_> = keyframe.into_iter().chain(onwards).collect();
    let (vertices, triangles) = (contents.header.vertices, contents.header.triangles);
    Plan { start, level: 0, complete: true, vertices, triangles, parts }
}
