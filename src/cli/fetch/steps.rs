//! What each step of a transfer brings.

use super::super::numbers::{count, of_diagonal};
use serde_json::{Value, json};
use std::ops::Range;
use unweld::container::{AtomKind, Contents, Plan};

/// Consecutive atoms of a plan that bring something together.
#[derive(Clone, Debug, PartialEq)]
pub struct Step {
    /// In words.
    pub what: String,
    /// Places in the table of contents.
    pub atoms: Range<usize>,
    /// What they take.
    pub bytes: u64,
    /// Triangles and error of the mesh behind them, where they change it.
    pub mesh: Option<(u32, f64)>,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Levels,
    Other(AtomKind, u32),
}

/// The steps of a plan. Levels are told together until they have doubled what is there.
pub fn steps(contents: &Contents, plan: &Plan) -> Vec<Step> {
    let mut steps = Vec::new();
    let mut sum = contents.header.table_end();
    for part in &plan.parts {
        let mut rest = part.atoms.clone();
        while let Some(&first) = contents.atoms.get(rest.start).filter(|_| !rest.is_empty()) {
            let kind = kind(first.kind, first.level);
            let (mut end, mut bytes) = (rest.start, 0);
            while let Some(atom) = contents.atoms.get(end).filter(|_| end < rest.end) {
                let same = match atom.kind {
                    AtomKind::Optional(_) => true,
                    other => self::kind(other, atom.level) == kind,
                };
                if !same {
                    break;
                }
                (end, bytes) = (end + 1, bytes + u64::from(atom.length));
                let complete = contents.steps(atom.level).end == end;
                if kind == Kind::Levels && complete && bytes >= sum {
                    break;
                }
            }
            sum += bytes;
            steps.push(step(contents, plan.start, kind, rest.start..end, bytes));
            rest.start = end;
        }
    }
    steps
}

fn kind(kind: AtomKind, level: u32) -> Kind {
    match kind {
        AtomKind::Precision | AtomKind::Refinement | AtomKind::Birth => Kind::Levels,
        AtomKind::Attributes if level > 0 => Kind::Levels,
        AtomKind::Keyframe => Kind::Other(kind, level),
        _ => Kind::Other(kind, 0),
    }
}

fn step(contents: &Contents, start: u32, kind: Kind, atoms: Range<usize>, bytes: u64) -> Step {
    let of_level = |j: u32| contents.level(j).map(|level| (level.triangles, level.max_error));
    let (what, mesh) = match kind {
        Kind::Levels => levels(contents, &atoms),
        Kind::Other(AtomKind::Base, _) => ("base".to_owned(), of_level(contents.base_level())),
        Kind::Other(AtomKind::Keyframe, j) => {
            // One that decoding does not start from repeats what is there.
            (format!("keyframe of level {j}"), of_level(j).filter(|_| j == start))
        }
        Kind::Other(AtomKind::Residue, _) => ("residue".to_owned(), None),
        Kind::Other(AtomKind::Attributes, _) => ("attributes".to_owned(), None),
        Kind::Other(AtomKind::Correction, _) => ("exact coordinates".to_owned(), None),
        Kind::Other(AtomKind::Order, _) => ("order".to_owned(), None),
        Kind::Other(AtomKind::Resource, _) => ("resources".to_owned(), None),
        Kind::Other(AtomKind::Metadata, _) => ("metadata".to_owned(), None),
        Kind::Other(..) => ("what this version does not know".to_owned(), None),
    };
    Step { what, atoms, bytes, mesh }
}

fn levels(contents: &Contents, atoms: &Range<usize>) -> (String, Option<(u32, f64)>) {
    let run = contents.atoms.get(atoms.clone()).unwrap_or_default();
    let known = || run.iter().filter(|atom| self::kind(atom.kind, atom.level) == Kind::Levels);
    let (Some(first), Some(last)) = (known().next(), known().next_back()) else {
        return (String::new(), None);
    };
    let complete = contents.steps(last.level).end <= atoms.end;
    let begun = contents.steps(first.level).start >= atoms.start;
    let reached = if complete { last.level } else { last.level + 1 };
    let error = contents.level(reached).map_or(0.0, |level| level.max_error);
    let what = match (first.level, last.level) {
        (a, b) if a == b && complete && begun => format!("level {a}"),
        (a, b) if a == b => format!("part of level {a}"),
        (a, b) if complete => format!("levels {a} to {b}"),
        (a, b) if a == b + 1 => format!("level {a} and part of level {b}"),
        (a, b) => format!("levels {a} to {} and part of level {b}", b + 1),
    };
    (what, Some((last.triangles_after, error)))
}

impl Step {
    /// One line.
    pub fn line(&self, diagonal: f64) -> String {
        let text = format!("  {}: {}", self.what, count(self.bytes, "byte"));
        match self.mesh {
            Some((triangles, error)) => {
                let error = of_diagonal(error, diagonal);
                format!("{text}; {}, error at most {error}\n", count(triangles, "triangle"))
            }
            None => text + "\n",
        }
    }

    /// One JSON object.
    pub fn json(&self) -> Value {
        json!({
            "what": self.what,
            "bytes": self.bytes,
            "triangles": self.mesh.map(|(triangles, _)| triangles),
            "max_error": self.mesh.map(|(_, error)| error),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use unweld::container::{AttributeEntry, FileBuilder, Level, Want, plan};
    use unweld::mesh::Lattice;
    use unweld::mesh::attributes::{Attribute, Quantisation, Semantic, Values};

    /// Values of attributes that are born at a level come with it; those of level 0 with what else it has.
    #[test]
    fn values_belong_to_their_level() {
        let level = |vertices, triangles| Level { vertices, triangles, ..Level::default() };
        let lattice = Lattice { origin: [0.0; 3], step: 1.0, bits: 8 };
        let mut file = FileBuilder::new(lattice, [1; 3], vec![level(6, 8), level(5, 6), level(4, 4)]);
        let color = Attribute::new(Semantic::Color, 3, Values::U8(vec![0; 3]), Vec::new());
        let born = |birth| AttributeEntry { birth, ..AttributeEntry::of(&color, Quantisation::Integer, 0.0) };
        file.attributes = vec![born(1), born(0)];
        file.payload(AtomKind::Base, 2, b"base");
        for j in [1, 0] {
            file.atom(AtomKind::Refinement, j, 1, 2, vec![0]);
            file.payload(AtomKind::Attributes, j, &[1; 300]);
        }
        let contents = file.write(&mut Vec::new()).unwrap();
        let told: Vec<_> = steps(&contents, &plan(&contents, Want::All))
            .into_iter()
            .map(|step| (step.what, step.bytes, step.mesh.map(|(triangles, _)| triangles)))
            .collect();
        let expected = [
            ("base", 4, Some(4)),
            ("level 1", 301, Some(6)),
            ("level 0", 1, Some(8)),
            ("attributes", 300, None),
        ];
        assert_eq!(told, expected.map(|(what, bytes, mesh)| (what.to_owned(), bytes, mesh)));
    }
}
