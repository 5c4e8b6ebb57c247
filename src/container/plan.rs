//! From a wanted quality to the byte ranges that give it (spec §3.7).

use std::ops::Range;

use super::contents::{Atom, AtomKind, Contents};
use super::want::Want;

/// Consecutive atoms and the bytes they take.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Part {
    /// Places in [`Contents::atoms`].
    pub atoms: Range<usize>,
    /// Bytes from the start of the file.
    pub bytes: Range<u64>,
}

/// What to fetch and decode, and what comes of it. Header and table of contents are taken as known.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Plan {
    /// The level whose base or keyframe decoding starts from.
    pub start: u32,
    /// The finest level that is reached.
    pub level: u32,
    /// Whether that level is reached with all its vertices, and the values that it is told of beside them.
    pub complete: bool,
    /// Vertices of the mesh, without what the residue holds.
    pub vertices: u32,
    /// Triangles of the mesh, without what the residue holds.
    pub triangles: u32,
    /// What to decode, in this order; not empty.
    pub parts: Vec<Part>,
}

impl Plan {
    /// Where its last byte stands, plus one: the length of the prefix, if it starts from the base.
    pub fn end(&self) -> u64 {
        self.parts.last().map_or(0, |part| part.bytes.end)
    }

    /// Bytes of all its parts.
    pub fn byte_count(&self) -> u64 {
        self.parts.iter().map(|part| part.bytes.end - part.bytes.start).sum()
    }

    /// The same without those resources of which `skipped` says so by their numbers: originals of images that a client can do without, or what
    /// it has already.
    pub fn without(&self, contents: &Contents, skipped: impl Fn(usize) -> bool) -> Self {
        let parts = self.parts.iter().flat_map(|part| kept(contents, part.atoms.clone(), &skipped));
        let parts = parts.map(|atoms| part(contents, atoms));
        Self { parts: parts.collect(), ..self.clone() }
    }
}

/// The shortest prefix of the file that gives `want`. It always holds the base, the least that is a mesh,
/// and never a keyframe, which would repeat what is there. Where it leads to level 0 by a level or an error, it is [all](Want::All); by
/// triangles it ends with the mesh, since the table does not count those of the residue.
pub fn plan(contents: &Contents, want: Want) -> Plan {
    let atoms = &contents.atoms;
    let base = contents.base_level();
    let least = contents.steps(base).end;
    let end = match want {
        Want::Level(j) => contents.prefix(j).end,
        Want::Triangles(most) => {
            let sequence = &atoms[..contents.resource_atoms(0).end];
            let few = sequence.partition_point(|atom| atom.triangles_after <= most);
            let reached = sequence[few.max(least) - 1].triangles_after;
            let before = sequence.partition_point(|atom| atom.triangles_after < reached);
            let end = least.max(before + 1);
            // What belongs to the level that is reached adds no triangle.
            let belongs = |atom: &&Atom| matches!(atom.kind, AtomKind::Attributes | AtomKind::Resource);
            end + sequence[end..].iter().take_while(belongs).count()
        }
        Want::Error(measure, most) => contents.prefix(contents.level_within(measure, most)).end,
        Want::Bytes(most) => atoms[contents.prefix(0)].partition_point(|atom| atom.end() <= most).max(least),
        Want::All => contents.prefix(0).end,
    };
    let level = (0..=base).find(|&j| contents.steps(j).start < end).unwrap_or(base);
    let last = &atoms[end - 1];
    Plan {
        start: base,
        level,
        complete: contents.steps(level).end <= end,
        vertices: last.vertices_after,
        triangles: last.triangles_after,
        parts: vec![part(contents, 0..end)],
    }
}

/// The way to level `level` that skips most of the file: from the finest keyframe that is not finer, or from
/// the base where there is none. A level coarser than the base is taken for the base; level 0 comes with all that belongs to
/// it, as in [`plan`]. Resources that the way would pass by come first: see [`Plan::without`].
pub fn plan_from_keyframe(contents: &Contents, level: u32) -> Plan {
    let base = contents.base_level();
    let level = level.min(base);
    let start = (level..=base).find(|&j| contents.starts_segment(j)).unwrap_or(base);
    let mut parts = Vec::new();
    match contents.keyframe(start) {
        Some(keyframe) => {
            // At level 0 those that stand behind it come with all that is beyond the mesh.
            let passed = contents.resources.iter().filter(|entry| entry.place >= start.max(1));
            parts.extend(runs(passed.map(|entry| entry.atoms.clone())).map(|atoms| part(contents, atoms)));
            parts.push(part(contents, keyframe));
        }
        None if start > 0 => parts.push(part(contents, contents.prefix(start))),
        None => parts.push(part(contents, contents.steps(0))),
    }
    let beyond = if level == 0 { contents.beyond_mesh() } else { 0..0 };
    if start > level {
        let end = contents.resource_atoms(level).end.max(beyond.end);
        parts.push(part(contents, contents.steps(start - 1).start..end));
    } else if !beyond.is_empty() {
        parts.push(part(contents, beyond));
    }
    let reached = &contents.levels[level as usize];
    Plan { start, level, complete: true, vertices: reached.vertices, triangles: reached.triangles, parts }
}

/// What is left of some atoms without those of the resources that are skipped: ranges that are not empty.
pub(crate) fn kept(
    contents: &Contents,
    atoms: Range<usize>,
    skipped: impl Fn(usize) -> bool,
) -> Vec<Range<usize>> {
    let mut start = atoms.start;
    let mut kept = Vec::new();
    let [first, end] = [
        contents.resources.partition_point(|entry| entry.atoms.end <= atoms.start),
        contents.resources.partition_point(|entry| entry.atoms.start < atoms.end),
    ];
    for number in (first..end).filter(|&number| skipped(number)) {
        let entry = &contents.resources[number];
        kept.push(start..entry.atoms.start.max(start));
        start = entry.atoms.end.min(atoms.end);
    }
    kept.push(start..atoms.end);
    kept.retain(|atoms| !atoms.is_empty());
    kept
}

/// Ranges that follow each other as one.
fn runs(ranges: impl Iterator<Item = Range<usize>>) -> impl Iterator<Item = Range<usize>> {
    let mut runs: Vec<Range<usize>> = Vec::new();
    for range in ranges {
        match runs.last_mut().filter(|run| run.end == range.start) {
            Some(run) => run.end = range.end,
            None => runs.push(range),
        }
    }
    runs.into_iter()
}

fn part(contents: &Contents, atoms: Range<usize>) -> Part {
    Part { bytes: contents.bytes(atoms.clone()), atoms }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::container::{Measure, testing};

    /// Base of 6 triangles; level 1 adds 2 + 4, level 0 adds 8; keyframe of level 1.
    fn contents() -> Contents {
        testing::contents(&testing::small_file())
    }

    #[test]
    fn each_want() {
        let contents = contents();
        let reached = |want| {
            let plan = plan(&contents, want);
            (plan.level, plan.complete, plan.triangles)
        };
        assert_eq!(reached(Want::Level(9)), (2, true, 6));
        assert_eq!(reached(Want::Level(1)), (1, true, 12));
        assert_eq!(reached(Want::Level(0)), (0, true, 20));
        assert_eq!(reached(Want::Triangles(0)), (2, true, 6));
        assert_eq!(reached(Want::Triangles(7)), (2, true, 6), "precision alone is not worth it");
        assert_eq!(reached(Want::Triangles(11)), (1, false, 8));
        assert_eq!(reached(Want::Triangles(12)), (1, true, 12));
        assert_eq!(reached(Want::Triangles(u32::MAX)), (0, true, 20));
        assert_eq!(reached(Want::Error(Measure::Max, 0.5)), (2, true, 6));
        assert_eq!(reached(Want::Error(Measure::Max, 0.3)), (1, true, 12));
        assert_eq!(reached(Want::Error(Measure::Max, 0.0)), (0, true, 20));
        assert_eq!(reached(Want::Error(Measure::Max, f64::NAN)), (0, true, 20));
        assert_eq!(reached(Want::Bytes(0)), (2, true, 6));
        assert_eq!(reached(Want::All), (0, true, 20));
        assert_eq!(plan(&contents, Want::All).parts[0].atoms, 0..contents.metadata().end);
        let bare = plan(&contents, Want::Triangles(20));
        assert_eq!(bare.end(), contents.bytes(contents.steps(0)).end);
        assert_eq!(plan(&contents, Want::Bytes(bare.end())), bare);
        assert_eq!(reached(Want::Bytes(bare.end() - 1)), (0, false, 12), "precision fits");
    }

    /// Atoms: 0 base of level 2, 1 to 3 level 1, 4 to 6 level 0, 7 residue, 8 metadata, 9 keyframe of level 1, 10 and 11 optional.
    #[test]
    fn what_belongs_to_all() {
        let contents = contents();
        assert_eq!([9, 2, 1, 0].map(|j| contents.prefix(j)), [0..1, 0..1, 0..4, 0..9]);
        assert_eq!(contents.beyond_mesh(), 7..9);
        let all = plan(&contents, Want::All);
        assert_eq!(all.parts[0].atoms, 0..9);
        let small = Want::Error(Measure::Max, 0.2);
        for want in [Want::Level(0), small, Want::Error(Measure::Rms, 0.0), Want::Bytes(u64::MAX)] {
            assert_eq!(plan(&contents, want), all, "{want:?}");
        }
        assert_eq!(plan(&contents, Want::Triangles(u32::MAX)).parts[0].atoms, 0..7);
        // Each of the pieces is cut off where the bytes end.
        let cut = |atoms: usize, less: u64| plan(&contents, Want::Bytes(contents.atoms[atoms].end() - less));
        assert_eq!([cut(8, 1), cut(7, 0), cut(7, 1)].map(|plan| plan.parts[0].atoms.end), [8, 8, 7]);
        // From the keyframe of level 1, too.
        let atoms: Vec<_> =
            plan_from_keyframe(&contents, 0).parts.into_iter().map(|part| part.atoms).collect();
        assert_eq!(atoms, [9..10, 4..9]);
        // Without keyframes the prefix of level 0 is the file.
        let mut file = testing::small_file();
        file.pieces.remove(9);
        assert_eq!(testing::contents(&file).prefix(0), 0..11);
    }

    #[test]
    fn an_error_by_either_measure() {
        // Largest errors 1/2, 1/4, 3/32 from the base down; root mean squares 1/16, 1/32, 1/64.
        let mut file = testing::small_file();
        for (level, rms) in file.levels.iter_mut().zip([1.0 / 64.0, 1.0 / 32.0, 1.0 / 16.0]) {
            level.rms_error = rms;
        }
        let contents = testing::contents(&file);
        let reached = |measure, most| plan(&contents, Want::Error(measure, most)).level;
        let most = [1.0, 0.5, 0.25, 0.0625, 0.03125, 0.03, 0.0];
        assert_eq!(most.map(|most| reached(Measure::Max, most)), [2, 2, 1, 0, 0, 0, 0]);
        assert_eq!(most.map(|most| reached(Measure::Rms, most)), [2, 2, 2, 2, 1, 0, 0]);
    }

    #[test]
    fn a_keyframe_shortens_the_way() {
        let contents = contents();
        let plan = plan_from_keyframe(&contents, 0);
        assert_eq!((plan.start, plan.level, plan.triangles), (1, 0, 20));
        let runs: Vec<_> = plan.parts.iter().map(|part| part.atoms.clone()).collect();
        assert_eq!(runs, [contents.keyframe(1).unwrap(), contents.steps(0).start..contents.metadata().end]);
        assert_eq!(plan.byte_count(), testing::bytes_of(&contents, &runs));
        assert_eq!(plan_from_keyframe(&contents, 1).parts.len(), 1);
        let base = plan_from_keyframe(&contents, 7);
        assert_eq!((base.start, base.level), (2, 2));
        assert_eq!(base.parts[0].atoms, contents.steps(2));
    }

    proptest! {
        #[test]
        fn plans_keep_their_promise(file in testing::any_file(), n: u32, j in 0u32..8) {
            let contents = testing::contents(&file);
            let (least, most) = (contents.header.base_triangles, contents.header.triangles);
            let wanted = n % (most + 2);
            let by_triangles = plan(&contents, Want::Triangles(wanted));
            prop_assert!(by_triangles.triangles <= wanted.max(least));
            let more = contents.atoms[..contents.steps(0).end].iter().map(|atom| atom.triangles_after);
            prop_assert!(more.filter(|&n| n <= wanted).all(|n| n <= by_triangles.triangles));
            let budget = u64::from(n) % (contents.file_bytes() + 2);
            let by_bytes = plan(&contents, Want::Bytes(budget));
            prop_assert!(by_bytes.end() <= budget.max(contents.base_end()));
            for plan in [plan(&contents, Want::Level(j)), plan_from_keyframe(&contents, j)] {
                let level = contents.level(plan.level).unwrap();
                prop_assert_eq!(plan.level, j.min(contents.base_level()));
                prop_assert_eq!((plan.vertices, plan.triangles), (level.vertices, level.triangles));
                prop_assert!(plan.complete && contents.starts_segment(plan.start));
            }
        }
    }
}
