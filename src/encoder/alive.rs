//! Attributes in the replay from the base to level 0: where they are born, and behind operations since.

use super::attribute_errors::{AttributeErrors, LevelMesh};
use super::labelling::Labelling;
use crate::codec::attributes::{Attributes, Finest, Ground, Labelled, RefinedModels};
use crate::codec::refinement::Inserted;
use crate::codec::walk::Walk;
use crate::codec::whole::WholeError;
use crate::container::{AttributeEntry, AttributeError};
use crate::entropy::RangeEncoder;
use crate::limits::{Budget, MAX_ATOM_BYTES};
use crate::mesh::Corner;
use crate::mesh::attributes::{Domain, Kind, Quantisation, Stored};
use crate::refine::{Labels, ProgressiveMesh};

/// The attributes of the mesh as it stands.
#[derive(Debug)]
pub struct Alive<'a> {
    labelling: &'a Labelling,
    measured: &'a AttributeErrors,
    entries: &'a [AttributeEntry],
    /// The number of the base.
    base: usize,
    labels: Labels,
    attributes: Attributes,
    models: Option<RefinedModels>,
    ring: Vec<Corner>,
    /// Operations of which nothing has been coded, and bytes that each of them will take, as those before it did.
    owed: usize,
    each: f64,
    /// Bytes that one may take where all corners round it have values of their own, of which nothing before it told.
    most: usize,
    /// Bits of all that has been coded.
    pub bits: f64,
}

impl<'a> Alive<'a> {
    /// Before the base, the number of which is `base`.
    pub fn new(
        labelling: &'a Labelling,
        measured: &'a AttributeErrors,
        entries: &'a [AttributeEntry],
        base: usize,
    ) -> Self {
        Self {
            labelling,
            measured,
            entries,
            base,
            labels: labelling.base.clone(),
            attributes: Attributes::new(entries.iter().map(AttributeEntry::kind)),
            models: None,
            ring: Vec::new(),
            owed: 0,
            // Nothing is known of them: as if integers were of two bytes.
            each: entries.iter().map(|entry| 2.0 * entry.kind().integers() as f64).sum(),
            most: WEDGES * entries.iter().map(|entry| bytes_of_wedge(&entry.kind())).sum::<usize>(),
            bits: 0.0,
        }
    }

    /// Whether an atom of so many bytes has no room for what another operation may owe beside those there are.
    pub fn fill(&self, bytes: usize) -> bool {
        bytes + (self.owed + 1) * self.most >= MAX_ATOM_BYTES as usize
    }

    /// Bytes that will about be taken by what operations owe.
    pub fn owed_bytes(&self) -> usize {
        (self.owed as f64 * self.each) as usize
    }

    /// The attributes that are alive at a level, but those that are born at level 0.
    fn alive_at(&self, level: usize) -> Vec<usize> {
        (0..self.entries.len()).filter(|&k| self.entries[k].birth as usize >= level.max(1)).collect()
    }

    /// Whether some are born at a level finer than the base.
    pub fn are_born_at(&self, level: usize) -> bool {
        level < self.base && self.entries.iter().any(|entry| entry.birth as usize == level)
    }

    /// How far the attributes of a level, the mesh as it stands, are from those of the input; `rms` is its root mean square error of positions, in
    /// steps of the lattice.
    pub fn errors(&self, number: usize, mesh: &ProgressiveMesh, rms: f64) -> Vec<AttributeError> {
        let (labels, truth) = (&self.labels, &self.labelling.truth);
        self.measured.of_level(self.entries, LevelMesh { mesh, labels, truth, number, rms })
    }

    /// Codes the attributes of the base. Told is the work that reading them takes.
    pub fn base(&mut self, mesh: &ProgressiveMesh, walk: &Walk, coder: &mut RangeEncoder) -> u64 {
        let born = self.alive_at(self.base);
        self.bear(&born, mesh, walk, coder)
    }

    /// Codes the attributes of a keyframe of a level, the mesh as it stands.
    pub fn keyframe(
        &self,
        level: usize,
        mesh: &ProgressiveMesh,
        walk: &Walk,
        coder: &mut RangeEncoder,
    ) -> u64 {
        let mut afresh = Self::new(self.labelling, self.measured, self.entries, self.base);
        afresh.labels = self.labels.clone();
        let born = self.alive_at(level);
        afresh.bear(&born, mesh, walk, coder)
    }

    /// Codes those that are born at a level: the payload, and the work that reading it takes.
    pub fn birth(&mut self, level: usize, mesh: &ProgressiveMesh) -> (Vec<u8>, u64) {
        let born: Vec<usize> =
            (0..self.entries.len()).filter(|&k| self.entries[k].birth as usize == level).collect();
        let walk = Walk::new(&mesh.table, &mesh.roots);
        let mut coder = RangeEncoder::default();
        let work = self.bear(&born, mesh, &walk, &mut coder);
        (coder.finish(), work)
    }

    fn bear(&mut self, born: &[usize], mesh: &ProgressiveMesh, walk: &Walk, coder: &mut RangeEncoder) -> u64 {
        let mut budget = Budget::unlimited();
        let before = coder.bits();
        let known = Labelled { truth: &self.labelling.truth, labels: &self.labels, further: &[] };
        let outcome = self.attributes.bear(Ground { mesh, walk, born }, coder, &known, &mut budget);
        outcome.expect("a writer's numbers can be written");
        self.bits += coder.bits() - before;
        budget.work()
    }

    /// A segment begins.
    pub fn begin_segment(&mut self) {
        self.models = None;
    }

    /// An operation has been carried out. What it does to attributes is coded by [`Self::refine`], behind
    /// [`TOGETHER`](crate::codec::attributes::TOGETHER) operations at most.
    pub fn carry(&mut self, mesh: &ProgressiveMesh, inserted: &Inserted) {
        let v = inserted.vertex;
        self.labelling.apply(&mut self.labels, &mesh.table, v, &mut self.ring);
        if !self.attributes.wedges.is_empty() {
            let models = self.models.get_or_insert_with(|| self.attributes.models());
            self.attributes.carry(models, mesh, v, &inserted.carried());
            self.owed += 1;
        }
    }

    /// Codes what operations do to attributes, those since the last time. Told is the work that reading it takes.
    pub fn refine(&mut self, mesh: &ProgressiveMesh, coder: &mut RangeEncoder) -> u64 {
        let Some(models) = &mut self.models else { return 0 };
        let mut budget = Budget::unlimited();
        let before = coder.bits();
        let known = Labelled { truth: &self.labelling.truth, labels: &self.labels, further: &[] };
        let outcome = self.attributes.refine(models, mesh, coder, &known, &mut budget);
        outcome.expect("a writer's numbers can be written");
        let bits = coder.bits() - before;
        self.each = bits / 8.0 / std::mem::take(&mut self.owed).max(1) as f64;
        self.bits += bits;
        budget.work()
    }

    /// Codes the attributes of components that join behind the operations of a level.
    pub fn join(
        &mut self,
        level: usize,
        part: &ProgressiveMesh,
        walk: &Walk,
        coder: &mut RangeEncoder,
    ) -> u64 {
        let labels = self.labelling.birth(level);
        let mut budget = Budget::unlimited();
        let before = coder.bits();
        let known = Labelled { truth: &self.labelling.truth, labels, further: &[] };
        let outcome = self.attributes.join(part, walk, coder, &known, &mut budget);
        outcome.expect("a writer's numbers can be written");
        self.labels.append(labels);
        self.bits += coder.bits() - before;
        budget.work()
    }

    /// Codes what level 0 tells: the attributes that are born there, and those of further triangles, `further` by triangle of the input.
    /// Returned are the payload, empty where there is nothing to tell, and the units of work that reading it takes.
    ///
    /// # Errors
    /// [`WholeError`] where a number cannot be written.
    pub fn finish(
        &mut self,
        finest: Finest,
        further: impl Iterator<Item = usize>,
    ) -> Result<(Vec<u8>, u64), WholeError> {
        let told = |k: &usize| self.entries[*k].constant.is_none();
        let told: Vec<usize> = (0..self.entries.len()).filter(told).collect();
        let born: Vec<usize> = told.iter().copied().filter(|&k| self.entries[k].birth == 0).collect();
        let further: Vec<[u32; 4]> = further.map(|t| self.labelling.of_input[t]).collect();
        if told.is_empty() || (born.is_empty() && further.is_empty()) {
            return Ok((Vec::new(), 0));
        }
        let mut coder = RangeEncoder::default();
        let mut budget = Budget::unlimited();
        let known = Labelled { truth: &self.labelling.truth, labels: &self.labels, further: &further };
        self.attributes.finish(&born, finest, &mut coder, &known, &mut budget)?;
        Ok((coder.finish(), budget.work()))
    }
}

/// Wedges that an operation may tell of: those of its vertex, of valence six, and of both corners of each of its link.
const WEDGES: usize = 18;

/// Bytes that a value of a kind takes where nothing tells of it.
fn bytes_of_wedge(kind: &Kind) -> usize {
    if !kind.is_coded_at(Domain::Corner) {
        return 0;
    }
    let bits = match kind.quantisation {
        Quantisation::Lattice { bits, .. } | Quantisation::Octahedral { bits } => bits as usize,
        Quantisation::Integer if matches!(kind.stored, Stored::U8 | Stored::I8) => 8,
        Quantisation::Integer if matches!(kind.stored, Stored::U16 | Stored::I16) => 16,
        Quantisation::Integer | Quantisation::Raw => 32,
    };
    // The length of a number that is far off takes some bits, too.
    (kind.integers() * (bits + 4)).div_ceil(8)
}
