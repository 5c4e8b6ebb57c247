//! From the history to payloads: the replay coarse to fine, with every level's refinements and keyframe.

use super::alive::Alive;
use super::places::Places;
use super::work::Work;
use super::{Options, Report};
use crate::codec::answers::LevelAnswers;
use crate::codec::attributes::TOGETHER;
use crate::codec::edgebreaker::ConnectivityError;
use crate::codec::keyframe::{self, Written};
use crate::codec::precision::PrecisionPass;
use crate::codec::refinement::{LevelPass, SegmentModels};
use crate::codec::walk::Walk;
use crate::container::{AtomKind, AttributeError, FileBuilder};
use crate::entropy::RangeEncoder;
use crate::error::Result;
use crate::limits::{Budget, WORK_A_SLOT, WORK_A_STEP, WORK_AN_OPERATION};
use crate::refine::{Birth, ProgressiveMesh, Roots};
use crate::simplify::Simplified;

/// One atom of refinements.
#[derive(Debug)]
struct Piece {
    kind: AtomKind,
    level: u32,
    items: u32,
    triangles: u32,
    bytes: Vec<u8>,
    /// Units of work that reading it takes, without the walk that its pass begins with.
    work: u64,
}

/// The replay.
#[derive(Debug)]
pub struct Levels<'a> {
    mesh: ProgressiveMesh,
    simplified: &'a Simplified,
    places: &'a Places,
    options: &'a Options,
    /// The attributes, where there are any.
    alive: Option<Alive<'a>>,
    pieces: Vec<Piece>,
    /// Bytes of the base and of the pieces.
    written: usize,
    keyframes: Vec<(u32, Written)>,
    /// Vertices and triangles of each level, by number.
    counts: Vec<(u32, u32)>,
    /// How far the attributes of each level are off, by number.
    attribute_errors: Vec<Vec<AttributeError>>,
    /// The pass of the level before.
    pass: Option<LevelPass>,
    birth_bits: f64,
    connectivity_bits: f64,
    position_bits: f64,
}

impl<'a> Levels<'a> {
    /// Sets out from the base; vertices keep the numbers of the input. Some of the base's are those of `other`, if that is given.
    ///
    /// # Errors
    /// [`Error::Limit`](crate::Error::Limit) where it takes too long to look for them.
    pub fn new(
        base: ProgressiveMesh,
        simplified: &'a Simplified,
        places: &'a Places,
        options: &'a Options,
        mut alive: Option<Alive<'a>>,
        other: Option<&[[i32; 3]]>,
    ) -> Result<Self> {
        let base_level = simplified.history.level_count();
        let history = &simplified.history;
        let born = |j: usize| history.birth(j).map_or(0, |birth| birth.vertices.len());
        let later = history.operations().len() + (0..base_level).map(born).sum::<usize>();
        let counts =
            vec![((base.positions.len() - later) as u32, base.table.triangle_count() as u32); base_level + 1];
        let behind = |walk: &Walk, coder: &mut RangeEncoder| {
            alive.as_mut().map_or(0, |alive| alive.base(&base, walk, coder))
        };
        let written = match other {
            None => keyframe::encode(&base, places.cells(base_level).precision, behind),
            Some(other) => beside(&base, other, behind)?,
        };
        Ok(Self {
            mesh: base,
            simplified,
            places,
            options,
            alive,
            pieces: Vec::new(),
            written: written.payload.len(),
            keyframes: vec![(base_level as u32, written)],
            counts,
            attribute_errors: vec![Vec::new(); base_level + 1],
            pass: None,
            birth_bits: 0.0,
            connectivity_bits: 0.0,
            position_bits: 0.0,
        })
    }

    /// Writes all levels. `progress` is called with the vertices done and to do.
    ///
    /// # Errors
    /// What `progress` returns; [`Error::Memory`](crate::Error::Memory) where there is none for the mesh.
    pub fn code(&mut self, progress: &mut dyn FnMut(u64, u64) -> Result<()>) -> Result<()> {
        let total = self.simplified.history.operations().len() as u64;
        let mut done = 0;
        let mut models = SegmentModels::new(self.options.rich_models == Some(true));
        // At once: what grows is there twice.
        let triangles = self.simplified.history.most_triangles(self.mesh.table.slots());
        self.mesh.make_room([0, triangles])?;
        self.compare(self.simplified.history.level_count());
        for j in (0..self.simplified.history.level_count()).rev() {
            progress(done, total)?;
            self.sharpen(j as u32, &mut models);
            if self.simplified.has_rows {
                self.rehearse(j, &mut models)?;
            }
            self.level(j, &mut models);
            done += self.simplified.history.level(j).len() as u64;
            self.counts[j].0 = self.counts[j + 1].0 + self.simplified.history.level(j).len() as u32;
            if let Some(birth) = self.simplified.history.birth(j) {
                self.bear(j, birth);
                self.counts[j].0 += birth.vertices.len() as u32;
            }
            self.counts[j].1 = self.mesh.table.triangle_count() as u32;
            self.bear_attributes(j);
            self.compare(j);
            if self.options.keyframes.contains(j as u32) {
                let (mesh, alive) = (&self.mesh, &mut self.alive);
                let written = keyframe::encode(mesh, self.places.cells(j).precision, |walk, coder| {
                    alive.as_mut().map_or(0, |alive| alive.keyframe(j, mesh, walk, coder))
                });
                self.keyframes.push((j as u32, written));
                models = models.afresh();
                if let Some(alive) = &mut self.alive {
                    alive.begin_segment();
                }
            }
        }
        progress(total, total)
    }

    /// The mesh as it stands: level 0 in the end; and its attributes.
    pub fn finest(&mut self) -> (&ProgressiveMesh, Option<&mut Alive<'a>>) {
        (&self.mesh, self.alive.as_mut())
    }

    /// Vertices and triangles of each level, by number.
    pub fn counts(&self) -> &[(u32, u32)] {
        &self.counts
    }

    /// How far the attributes of each level are off, by number.
    pub fn attribute_errors(&self) -> &[Vec<AttributeError>] {
        &self.attribute_errors
    }

    /// What reading all this takes.
    ///
    /// # Errors
    /// [`Error::Limit`](crate::Error::Limit) where decoders would refuse it for its work.
    pub fn work(&self) -> Result<Work> {
        let mut work = Work::default();
        let mut pieces = &self.pieces[..];
        for (k, (_, written)) in self.keyframes.iter().enumerate() {
            work.enter(written)?;
            let next = self.keyframes.get(k + 1).map_or(0, |&(level, _)| level);
            let (here, rest) = pieces.split_at(pieces.partition_point(|piece| piece.level >= next));
            for pass in here.chunk_by(|a, b| (a.kind, a.level) == (b.kind, b.level)) {
                let mut walk = WORK_A_SLOT * u64::from(self.counts[pass[0].level as usize + 1].1);
                for piece in pass {
                    // Nothing is walked over where components are born.
                    let walk = if piece.kind == AtomKind::Birth { 0 } else { std::mem::take(&mut walk) };
                    work.read(piece.bytes.len(), walk + piece.work)?;
                }
            }
            pieces = rest;
        }
        Ok(work)
    }

    /// Hands all payloads over, and tells the report what they took.
    pub fn add_to(&mut self, file: &mut FileBuilder, report: &mut Report) {
        let base_level = self.counts.len() as u32 - 1;
        for (level, written) in self.keyframes.drain(..) {
            let bits = written.payload.len() as f64 * 8.0 - written.attributes;
            if level == base_level {
                report.base_bits = bits;
                file.payload(AtomKind::Base, level, &written.payload);
            } else {
                report.keyframe_bits += bits;
                file.payload(AtomKind::Keyframe, level, &written.payload);
            }
            report.keyframe(level, &written, self.counts[level as usize].1);
        }
        for piece in self.pieces.drain(..) {
            if piece.kind == AtomKind::Attributes {
                file.payload(piece.kind, piece.level, &piece.bytes);
            } else if piece.kind == AtomKind::Birth {
                file.birth(piece.level, [piece.items, piece.triangles], &piece.bytes);
            } else {
                file.atom(piece.kind, piece.level, piece.items, piece.triangles, piece.bytes);
            }
        }
        report.birth_bits = self.birth_bits;
        report.attribute_bits += self.alive.as_ref().map_or(0.0, |alive| alive.bits);
        report.connectivity_bits = self.connectivity_bits;
        report.position_bits = self.position_bits;
    }

    /// Bytes after which the next atom ends: in proportion to those before it, since nothing is seen of an atom of which the end is missing,
    /// and that is to be a small share of a prefix whatever its length.
    fn atom_bytes(&self) -> usize {
        (self.written / BEFORE).max(LEAST_ATOM).min(self.options.atom_bytes)
    }

    fn push(&mut self, piece: Piece) {
        self.written += piece.bytes.len();
        self.pieces.push(piece);
    }

    fn sharpen(&mut self, j: u32, models: &mut SegmentModels) {
        let [from, to] = [j + 1, j].map(|j| self.places.cells(j as usize).precision);
        if from == to {
            return;
        }
        let walk = Walk::new(&self.mesh.table, &self.mesh.roots);
        let mut pass = PrecisionPass::new(&self.mesh, &walk, from, to);
        let places = self.places;
        let known = |v: crate::mesh::Vertex| places.lost[v.index()];
        let mut over = false;
        while !over {
            let atom_bytes = self.atom_bytes();
            let mut coder = RangeEncoder::default();
            let mut items = 0;
            while items == 0 || coder.size() < atom_bytes {
                let step = pass.step(&mut self.mesh, models, &mut coder, known);
                over = step.expect("a writer does not run out of bytes").is_none();
                if over {
                    break;
                }
                items += 1;
            }
            self.position_bits += coder.bits();
            if items > 0 {
                let bytes = coder.finish();
                let work = WORK_A_STEP * u64::from(items);
                self.push(Piece { kind: AtomKind::Precision, level: j, items, triangles: 0, bytes, work });
            }
        }
    }

    fn level(&mut self, j: usize, models: &mut SegmentModels) {
        let history = &self.simplified.history;
        if history.level(j).is_empty() {
            return;
        }
        let mut answers = LevelAnswers::new(&self.mesh.table, history, j, &self.places.born);
        let cells = self.places.cells(j);
        let mut pass = match self.pass.take() {
            Some(pass) => pass.next(&self.mesh, cells),
            None => LevelPass::new(&self.mesh, cells),
        };
        let mut left = history.level(j).len();
        while left > 0 {
            let atom_bytes = self.atom_bytes();
            let mut coder = RangeEncoder::default();
            let (mut items, before) = (0u32, self.mesh.table.triangle_count());
            let (mut of_attributes, mut bits) = (0, 0.0);
            loop {
                let inserted = pass
                    .step(&mut self.mesh, models, &mut coder, &mut answers)
                    .expect("a writer knows its positions to be on the lattice")
                    .expect("the walk of a level meets all its operations");
                if let Some(alive) = &mut self.alive {
                    alive.carry(&self.mesh, inserted);
                }
                items += 1;
                left -= 1;
                let is_full = |alive: &Alive| {
                    coder.size() + alive.owed_bytes() >= atom_bytes || alive.fill(coder.size())
                };
                let ends =
                    left == 0 || coder.size() >= atom_bytes || self.alive.as_ref().is_some_and(is_full);
                if let Some(alive) = &mut self.alive
                    && (ends || items.is_multiple_of(TOGETHER as u32))
                {
                    let before = alive.bits;
                    of_attributes += alive.refine(&self.mesh, &mut coder);
                    bits += alive.bits - before;
                }
                if ends {
                    break;
                }
            }
            let triangles = (self.mesh.table.triangle_count() - before) as u32;
            self.connectivity_bits += coder.bits() - bits;
            let bytes = coder.finish();
            let (kind, level) = (AtomKind::Refinement, j as u32);
            let work = WORK_AN_OPERATION * u64::from(items) + of_attributes;
            self.push(Piece { kind, level, items, triangles, bytes, work });
        }
        self.connectivity_bits -= pass.position_bits;
        self.position_bits += pass.position_bits;
        self.pass = Some(pass);
    }

    /// Tries what the splits of level `j` are told by. What was best at the levels before tells nothing of it: where vertices stand in rows, one
    /// level takes what the one before has left.
    ///
    /// # Errors
    /// [`Error::Memory`](crate::Error::Memory) where there is none for the mesh a second time.
    fn rehearse(&mut self, j: usize, models: &mut SegmentModels) -> Result<()> {
        let history = &self.simplified.history;
        let Some(mut tried) = models.on_trial().filter(|_| !history.level(j).is_empty()) else {
            return Ok(());
        };
        let mut mesh = self.mesh.clone();
        // At once: what grows is there twice.
        mesh.make_room([0, self.mesh.table.slots() + 2 * history.level(j).len()])?;
        let mut answers = LevelAnswers::new(&mesh.table, history, j, &self.places.born);
        let cells = self.places.cells(j);
        // The pass of the level before serves here; that of the level itself will be the same made anew.
        let mut pass = match self.pass.take() {
            Some(pass) => pass.next(&mesh, cells),
            None => LevelPass::new(&mesh, cells),
        };
        let mut coder = RangeEncoder::default();
        while let Ok(Some(_)) = pass.step(&mut mesh, &mut tried, &mut coder, &mut answers) {}
        models.find(&tried);
        Ok(())
    }

    /// Compares the attributes of level `j`, the mesh as it stands, with those of the input.
    fn compare(&mut self, j: usize) {
        let Some(alive) = &self.alive else { return };
        let rms = self.places.rms_error(&self.simplified.errors[j], j) / self.places.step;
        self.attribute_errors[j] = alive.errors(j, &self.mesh, rms);
    }

    /// Attributes are born at level `j`, behind all else; those of level 0 come with its residue.
    fn bear_attributes(&mut self, j: usize) {
        let Some(alive) = self.alive.as_mut().filter(|alive| j > 0 && alive.are_born_at(j)) else { return };
        let (bytes, work) = alive.birth(j, &self.mesh);
        let (kind, level) = (AtomKind::Attributes, j as u32);
        self.pieces.push(Piece { kind, level, items: 0, triangles: 0, bytes, work });
    }

    /// Components join the mesh behind the operations of level `j`.
    fn bear(&mut self, j: usize, birth: &Birth) {
        let roots = Roots::choose(&birth.table);
        let positions = birth.vertices.iter().map(|v| self.places.born[v.index()]).collect();
        let part = ProgressiveMesh { table: birth.table.clone(), positions, roots };
        let alive = &mut self.alive;
        let Written { payload: bytes, work, attributes, .. } =
            keyframe::encode_birth(&part, self.places.cells(j).precision, |walk, coder| {
                alive.as_mut().map_or(0, |alive| alive.join(j, &part, walk, coder))
            });
        self.birth_bits += bytes.len() as f64 * 8.0 - attributes;
        let [items, triangles] = [birth.vertices.len(), birth.table.triangle_count()].map(|n| n as u32);
        self.pieces.push(Piece { kind: AtomKind::Birth, level: j as u32, items, triangles, bytes, work });
        self.mesh.join(&part.table, &part.roots, |v| birth.name(v));
        self.pass = None;
    }
}

/// The base with the vertices of another mesh, unless a decoder would refuse that for its work.
fn beside(
    base: &ProgressiveMesh,
    other: &[[i32; 3]],
    behind: impl FnOnce(&Walk, &mut RangeEncoder) -> u64,
) -> Result<Written> {
    let mut budget = Budget::by_bytes();
    // It may take less than a byte a vertex, but seldom as little as that of work.
    budget.receive(base.positions.len());
    keyframe::encode_beside(base, other, &mut budget, behind).map_err(|e| match e {
        ConnectivityError::Limit(limit) => limit,
        other => crate::Error::Parameter(other.to_string()),
    })
}

/// How many times as many bytes an atom has before it.
const BEFORE: usize = 8;
/// Bytes that an atom has at least: its entry in the table and the coder's last bytes, about ten, are half a percent of them.
const LEAST_ATOM: usize = 2048;
