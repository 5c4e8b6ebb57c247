//! From atoms to the mesh: what a segment has to remember, and no more.

mod operations;

use super::finest::{Finest, Level0};
use super::log::Log;
use super::resources::Resources;
use super::{Delta, Event, Options};
use crate::codec::attributes::{Attributes, Ground, Nothing, RefinedModels};
use crate::codec::edgebreaker::ConnectivityError;
use crate::codec::keyframe::{self, Behind, Expected};
use crate::codec::lift::Cells;
use crate::codec::precision::PrecisionPass;
use crate::codec::refinement::{LevelPass, SegmentModels};
use crate::codec::walk::{Tour, Walk};
use crate::codec::whole::WholeError;
use crate::container::{Atom, AtomKind, AttributeEntry, Contents, Level, Metadata, ResourceEntry};
use crate::entropy::{CodingError, RangeDecoder};
use crate::error::{Error, FormatError, Result};
use crate::limits::{Budget, WORK_A_SLOT, WORK_A_STEP, make_room};
use crate::mesh::corner_table::MAX_TRIANGLES;
use crate::mesh::{CornerTable, IndexedMesh, Vertex};
use crate::refine::{ProgressiveMesh, Site, from_cell};
use std::collections::VecDeque;
use std::sync::Arc;

/// The passes of the level under way.
#[derive(Debug)]
enum Pass {
    /// Between levels, with the pass of the one before.
    None(Option<Box<LevelPass>>),
    Precision(PrecisionPass),
    Level(Box<LevelPass>),
}

/// A decoder without its parser.
#[derive(Debug)]
pub struct Session {
    pub contents: Option<Arc<Contents>>,
    pub mesh: ProgressiveMesh,
    pub finest: Finest,
    pub metadata: Option<Metadata>,
    pub resources: Resources,
    pub operations: u64,
    /// Where the vertices of the mesh are that a member of a set leans on.
    pub other: Option<Arc<[[i32; 3]]>>,
    attributes: Attributes,
    /// The models of what operations do to attributes, in this segment.
    refined: Option<Box<RefinedModels>>,
    refined_held: usize,
    options: Options,
    budget: Budget,
    models: SegmentModels,
    pass: Pass,
    /// The level whose base or keyframe decoding starts from.
    start: u32,
    /// The level complete.
    level: Option<u32>,
    /// The parts of a payload of several atoms.
    parts: Vec<u8>,
    /// Where the first of them stands in the file.
    parts_start: u64,
    log: Option<Log>,
    /// How many boundary edges the last complete level has.
    boundary: usize,
    /// How many triangles it has while a level is under way.
    walked: usize,
    /// Bytes debited: for the mesh, the pass, the parts, the log, and the event told last.
    mesh_held: usize,
    pass_held: usize,
    parts_held: usize,
    log_held: usize,
    told: usize,
    /// Whether deltas tell of flips.
    flips: bool,
    /// Whether anybody will look at the lists of deltas.
    pub tells: bool,
    stopped: bool,
}

impl Session {
    pub fn new(options: Options) -> Self {
        Self {
            contents: None,
            mesh: ProgressiveMesh::default(),
            finest: Finest::default(),
            metadata: None,
            resources: Resources::default(),
            operations: 0,
            other: None,
            attributes: Attributes::default(),
            refined: None,
            refined_held: 0,
            budget: Budget::new(options.limits),
            models: SegmentModels::default(),
            pass: Pass::None(None),
            start: 0,
            level: None,
            parts: Vec::new(),
            parts_start: 0,
            log: options.undo.then(Log::default),
            boundary: 0,
            walked: 0,
            mesh_held: 0,
            pass_held: 0,
            parts_held: 0,
            log_held: 0,
            told: 0,
            flips: options.flips,
            tells: true,
            stopped: false,
            options,
        }
    }

    /// Pays for the contents that a file begins with.
    pub fn pay_for_contents(&mut self, contents: &Contents) -> Result<()> {
        self.budget.take_memory(contents.atoms.len(), size_of::<Atom>())?;
        self.budget.take_memory(contents.resources.len(), BYTES_OF_RESOURCE)?;
        self.budget.take_memory(contents.levels.len(), BYTES_OF_LEVEL)
    }

    /// Sets out from the base or keyframe of level `start`.
    pub fn begin(&mut self, contents: Arc<Contents>, start: u32) {
        self.models = SegmentModels::new(contents.header.coding.rich_models);
        self.attributes = Attributes::new(contents.attributes.iter().map(AttributeEntry::kind));
        self.contents = Some(contents);
        self.start = start;
    }

    pub fn attributes(&self) -> Option<&Attributes> {
        Some(&self.attributes).filter(|attributes| !attributes.are_none())
    }

    /// Units of work done so far.
    pub fn work(&self) -> u64 {
        self.budget.work()
    }

    pub fn is_stopped(&self) -> bool {
        self.stopped
    }

    pub fn is_lowered(&self) -> bool {
        self.log.as_ref().is_some_and(|log| log.lowered().is_some())
    }

    pub fn level(&self) -> Option<u32> {
        self.log.as_ref().and_then(Log::lowered).or(self.level)
    }

    /// Takes up an atom whose checksum holds.
    pub fn atom(&mut self, index: usize, payload: &[u8], events: &mut VecDeque<Event>) -> Result<()> {
        let Some(contents) = self.contents.clone() else { return Ok(()) };
        let Some(&atom) = contents.atoms.get(index) else { return Ok(()) };
        self.budget.receive(payload.len());
        // What the atom before has told of has been seen.
        self.budget.hold(&mut self.told, 0)?;
        match atom.kind {
            AtomKind::Precision | AtomKind::Refinement => self.step(&contents, &atom, payload, events),
            AtomKind::Optional(_) => Ok(()),
            AtomKind::Resource => {
                if !self.options.mesh_alone {
                    let whole = self.resources.atom(&contents, index, payload, &mut self.budget)?;
                    events.extend(whole.map(|number| Event::Resource { number }));
                }
                let is_last = index + 1 == contents.resource_atoms(atom.level).end;
                if is_last && self.level == Some(atom.level) {
                    self.stop_where_reached(&contents, atom.level, events);
                }
                Ok(())
            }
            _ if atom.last && self.parts.is_empty() => {
                self.payload(&contents, &atom, payload, atom.offset, events)
            }
            _ => {
                self.gather(&atom, payload)?;
                if atom.last {
                    let parts = std::mem::take(&mut self.parts);
                    self.payload(&contents, &atom, &parts, self.parts_start, events)?;
                    self.budget.hold(&mut self.parts_held, 0)?;
                }
                Ok(())
            }
        }
    }

    /// Collects a payload of several atoms.
    fn gather(&mut self, atom: &Atom, payload: &[u8]) -> Result<()> {
        if self.parts.is_empty() {
            self.parts_start = atom.offset;
        }
        let (have, room) = (self.parts.len(), self.parts.capacity());
        if have + payload.len() > room {
            let more = payload.len().max(have);
            self.budget.exchange(&mut self.parts_held, have + more)?;
            make_room(&mut self.parts, more)?;
        }
        self.parts.extend_from_slice(payload);
        Ok(())
    }

    /// An atom that leads to the next level, or towards it.
    fn step(
        &mut self,
        contents: &Contents,
        atom: &Atom,
        payload: &[u8],
        events: &mut VecDeque<Event>,
    ) -> Result<()> {
        self.follows(atom)?;
        if atom.level < self.options.until.level {
            self.stop(events);
            Ok(())
        } else if atom.kind == AtomKind::Precision {
            self.sharpen(contents, atom, payload, events)
        } else {
            self.refine(contents, atom, payload, events)
        }
    }

    /// Whether an atom leads on from the level that is complete.
    fn follows(&self, atom: &Atom) -> Result<()> {
        if self.level.is_some_and(|level| level == atom.level + 1) {
            return Ok(());
        }
        let what = format!("a refinement to level {} does not follow", atom.level);
        Err(FormatError::new(atom.offset, "3.3", what).into())
    }

    /// A whole payload, the last part of which `atom` is; its first stands at `offset` in the file.
    fn payload(
        &mut self,
        contents: &Contents,
        atom: &Atom,
        payload: &[u8],
        offset: u64,
        events: &mut VecDeque<Event>,
    ) -> Result<()> {
        match atom.kind {
            AtomKind::Base | AtomKind::Keyframe if atom.level == self.start && self.level.is_none() => {
                self.start_from(contents, atom, offset, payload, events)?;
            }
            AtomKind::Birth => self.bear(contents, atom, offset, payload, events)?,
            AtomKind::Attributes if atom.level > 0 && self.level == Some(atom.level) && !self.stopped => {
                self.bear_attributes(contents, atom, offset, payload, events)?;
            }
            AtomKind::Attributes if atom.level > 0 => {}
            // A way in that was not taken.
            AtomKind::Base | AtomKind::Keyframe => {}
            AtomKind::Metadata => {
                self.budget.take_memory(payload.len(), BYTES_OF_METADATA)?;
                self.budget.take_work(payload.len() as u64)?;
                self.metadata = Some(Metadata::decode(payload, offset)?);
                events.push_back(Event::Metadata);
            }
            _ if self.level == Some(0) => {
                let lattice = &contents.header.lattice;
                let (mesh, boundary, entries) = (&self.mesh, self.boundary, &contents.attributes);
                let level0 = Level0 { mesh, boundary, lattice, entries };
                let (attributes, budget) = (&mut self.attributes, &mut self.budget);
                events.extend(self.finest.read(atom.kind, payload, offset, level0, attributes, budget)?);
            }
            _ => {}
        }
        Ok(())
    }

    /// Level 0, or a coarser one, with all that is known of it.
    ///
    /// # Errors
    /// [`Error::Parameter`] before the base is there, [`Error::Limit`] where it takes more memory than is left.
    pub fn assembled(&self) -> Result<IndexedMesh> {
        let (Some(contents), Some(level)) = (&self.contents, self.level()) else {
            return Err(Error::Parameter("there is no mesh before the end of the base".into()));
        };
        let lattice = &contents.header.lattice;
        let (mesh, mut boundary) = (&self.mesh, self.boundary);
        if self.is_lowered() || !matches!(self.pass, Pass::None(_)) {
            boundary = 3 * mesh.table.triangle_count(); // As many as there can be: they are not counted on the way.
        }
        let none = Finest::default();
        let finest = if level == 0 { &self.finest } else { &none };
        let level0 = Level0 { mesh, boundary, lattice, entries: &contents.attributes };
        let attributes = self.attributes().map(|attributes| (attributes, level));
        let mut mesh = finest.assembled(level0, attributes, &self.budget)?;
        if let (0, Some(metadata)) = (level, &self.metadata) {
            mesh.part_names.clone_from(&metadata.part_names);
            mesh.libraries.clone_from(&metadata.libraries);
        }
        Ok(mesh)
    }

    fn start_from(
        &mut self,
        contents: &Contents,
        atom: &Atom,
        offset: u64,
        payload: &[u8],
        events: &mut VecDeque<Event>,
    ) -> Result<()> {
        let entry = &contents.levels[atom.level as usize];
        let cells = cells(contents, atom.level);
        let expected = Expected { vertices: entry.vertices, triangles: entry.triangles, cells };
        // Those of level 0 come behind its residue.
        let born: Vec<usize> = contents.alive_at(atom.level.max(1)).collect();
        let attributes = &mut self.attributes;
        let behind = |behind: Behind, budget: &mut Budget| {
            let Behind { mesh, walk, coder } = behind;
            attributes.bear(Ground { mesh, walk, born: &born }, coder, &Nothing, budget)
        };
        let budget = &mut self.budget;
        let (mesh, section) = match &self.other {
            Some(other) => (keyframe::decode_beside(payload, expected, other, budget, behind), "15.2"),
            None => (keyframe::decode(payload, expected, budget, behind), "7"),
        };
        let mesh = mesh.map_err(|e| match e {
            ConnectivityError::Limit(limit) => limit,
            other => FormatError::new(offset, section, other.to_string()).into(),
        })?;
        let held = self.bytes_of(mesh.room());
        self.budget.hold(&mut self.mesh_held, held)?;
        let corners = mesh.table.triangles().flat_map(|t| t.corners());
        self.boundary = corners.filter(|&c| mesh.table.opposite(c).is_none()).count();
        self.mesh = mesh;
        events.push_back(Event::Whole { level: atom.level });
        self.complete(contents, atom.level, events)
    }

    /// Components are born, and with them the level is complete.
    fn bear(
        &mut self,
        contents: &Contents,
        atom: &Atom,
        offset: u64,
        payload: &[u8],
        events: &mut VecDeque<Event>,
    ) -> Result<()> {
        let fault = |what: String| Error::from(FormatError::new(offset, "7.4", what));
        self.follows(atom)?;
        let [v, t] = [self.mesh.positions.len(), self.mesh.table.slots()];
        let level = &contents.levels[atom.level as usize];
        if v + atom.items as usize != level.vertices as usize {
            return Err(fault("a birth before the operations of its level".into()));
        }
        if level.triangles >= MAX_TRIANGLES as u32 {
            let (needed, allowed) = (level.triangles.into(), MAX_TRIANGLES as u64 - 1);
            return Err(Error::Limit { what: "triangles", needed, allowed });
        }
        if atom.level < self.options.until.level || level.triangles > self.options.until.triangles {
            self.stop(events);
            return Ok(());
        }
        // The pass of the level knows nothing of them: the next one begins anew.
        self.pass = Pass::None(None);
        self.budget.hold(&mut self.pass_held, 0)?;
        let cells = cells(contents, atom.level);
        let expected = Expected { vertices: atom.items, triangles: atom.triangles, cells };
        let attributes = &mut self.attributes;
        let first_wedge = attributes.count;
        let behind = |behind: Behind, budget: &mut Budget| {
            let Behind { mesh, walk, coder } = behind;
            attributes.join(mesh, walk, coder, &Nothing, budget)
        };
        let born =
            keyframe::decode_birth(payload, expected, &mut self.budget, behind).map_err(|e| match e {
                ConnectivityError::Limit(limit) => limit,
                other => fault(other.to_string()),
            })?;
        let (count, mut held) = (born.positions.len(), 0);
        self.budget.hold(&mut held, ProgressiveMesh::bytes(born.room()))?;
        self.make_room(contents, count.max(born.table.slots().div_ceil(2)))?;
        self.mesh.positions.extend_from_slice(&born.positions);
        self.mesh.join(&born.table, &born.roots, |w| Vertex(w.0 + v as u32));
        let corners = born.table.triangles().flat_map(|t| t.corners());
        self.boundary += corners.filter(|&c| born.table.opposite(c).is_none()).count();
        let mut delta = Delta {
            vertices: v as u32..(v + count) as u32,
            wedges: first_wedge..self.attributes.count,
            triangles: t as u32..self.mesh.table.slots() as u32,
            ..Delta::default()
        };
        if self.tells {
            self.budget.hold(&mut self.told, count * size_of::<Site>())?;
            delta.parents.extend(delta.vertices.clone().map(Vertex).map(|w| Site::Edge(w, w)));
        }
        events.push_back(Event::Refined(delta));
        let births = if self.log.is_some() { Some(born.table) } else { None };
        self.budget.hold(&mut held, 0)?;
        self.complete_with(contents, atom.level, births, events)
    }

    /// A level is complete; where a segment begins, models start afresh.
    fn complete(&mut self, contents: &Contents, level: u32, events: &mut VecDeque<Event>) -> Result<()> {
        self.complete_with(contents, level, None, events)
    }

    /// A level is complete, with what is born at it.
    fn complete_with(
        &mut self,
        contents: &Contents,
        level: u32,
        births: Option<CornerTable>,
        events: &mut VecDeque<Event>,
    ) -> Result<()> {
        self.pass = Pass::None(match std::mem::replace(&mut self.pass, Pass::None(None)) {
            Pass::Level(pass) if level > 0 => Some(pass),
            _ => None,
        });
        if matches!(self.pass, Pass::None(None)) {
            self.budget.hold(&mut self.pass_held, 0)?;
        }
        if contents.starts_segment(level) {
            self.models = self.models.afresh();
            self.refined = None;
            self.budget.hold(&mut self.refined_held, 0)?;
        }
        let entry = &contents.levels[level as usize];
        if let Some(log) = &mut self.log {
            let of_mark = Log::bytes_of_mark(&self.mesh, births.as_ref());
            self.budget.hold(&mut self.log_held, log.bytes() + of_mark)?;
            log.end_level(&self.mesh, level, cells(contents, level), births);
        }
        self.level = Some(level);
        events.push_back(Event::Level { level, max_error: entry.max_error, rms_error: entry.rms_error });
        // What is born at a level belongs to it; a base or keyframe has it already.
        if level == 0 || level == self.start || contents.births_at(level).next().is_none() {
            self.stop_before_resources(contents, level, events);
        }
        Ok(())
    }

    /// Stops where enough is there, but for resources that stand behind the level. They do not stand behind a keyframe.
    fn stop_before_resources(&mut self, contents: &Contents, level: u32, events: &mut VecDeque<Event>) {
        let follow = level != self.start || level == contents.base_level();
        if !follow || contents.resource_atoms(level).is_empty() {
            self.stop_where_reached(contents, level, events);
        }
    }

    fn stop_where_reached(&mut self, contents: &Contents, level: u32, events: &mut VecDeque<Event>) {
        let until = self.options.until;
        let last = level == until.level && level > 0;
        let triangles = contents.levels[level as usize].triangles;
        if last || self.operations >= until.operations || triangles >= until.triangles {
            self.stop(events);
        }
    }

    /// Attributes are born at a level that is complete.
    fn bear_attributes(
        &mut self,
        contents: &Contents,
        atom: &Atom,
        offset: u64,
        payload: &[u8],
        events: &mut VecDeque<Event>,
    ) -> Result<()> {
        self.pay_for_walk()?;
        let mut held = 0;
        self.budget.hold(&mut held, Walk::bytes(self.mesh.table.triangle_count(), self.boundary))?;
        if let Some(log) = &mut self.log {
            self.budget.hold(&mut self.log_held, log.bytes() + size_of_val(self.attributes.wedges.all()))?;
            log.part(&self.attributes.wedges);
        }
        let walk = Walk::new(&self.mesh.table, &self.mesh.roots);
        let born: Vec<usize> = contents.births_at(atom.level).collect();
        let mut coder = RangeDecoder::new(payload);
        let ground = Ground { mesh: &self.mesh, walk: &walk, born: &born };
        let outcome = self.attributes.bear(ground, &mut coder, &Nothing, &mut self.budget);
        outcome.and_then(|()| Ok(coder.finish()?)).map_err(|e: WholeError| e.at(offset, "13.3"))?;
        self.budget.hold(&mut held, 0)?;
        events.push_back(Event::Attributes { level: atom.level });
        self.stop_before_resources(contents, atom.level, events);
        Ok(())
    }

    fn stop(&mut self, events: &mut VecDeque<Event>) {
        if !std::mem::replace(&mut self.stopped, true) {
            events.push_back(Event::Stopped);
        }
    }

    fn pay_for_walk(&mut self) -> Result<()> {
        self.budget.take_work(WORK_A_SLOT * self.mesh.table.slots() as u64)
    }

    /// Bytes of a mesh with room for so many vertices and triangles; and of what going down takes, if the log is kept.
    fn bytes_of(&self, room: [usize; 2]) -> usize {
        let down = if self.log.is_some() { BYTES_TO_GO_DOWN * room[0] } else { 0 };
        ProgressiveMesh::bytes(room) + down
    }

    /// Makes room in the mesh for so many more operations, and in the pass for as many as the mesh has room for.
    fn make_room(&mut self, contents: &Contents, ahead: usize) -> Result<()> {
        let (v, t) = (self.mesh.positions.len(), self.mesh.table.slots());
        let hoped = contents.levels.get(self.options.until.level as usize);
        let hoped = hoped.map_or([0; 2], |level| [level.vertices as usize, level.triangles as usize]);
        let Some([most, least]) = self.mesh.more_room([v + ahead, t + 2 * ahead], hoped) else {
            return Ok(());
        };
        let (most_held, least_held) = (self.bytes_of(most), self.bytes_of(least));
        let room = match self.budget.exchange(&mut self.mesh_held, most_held) {
            Ok(()) => most,
            Err(_) => {
                self.budget.exchange(&mut self.mesh_held, least_held)?;
                least
            }
        };
        self.mesh.make_room(room)?;
        if let Pass::Level(pass) = &mut self.pass {
            let held = LevelPass::bytes(self.mesh.room(), self.walked, self.boundary);
            self.budget.exchange(&mut self.pass_held, held)?;
            pass.make_room(&self.mesh)?;
        }
        Ok(())
    }

    fn sharpen(
        &mut self,
        contents: &Contents,
        atom: &Atom,
        payload: &[u8],
        events: &mut VecDeque<Event>,
    ) -> Result<()> {
        let fault = |e: CodingError| FormatError::new(atom.offset, "5.6", e.to_string());
        self.budget.take_work(WORK_A_STEP * u64::from(atom.items))?;
        if matches!(self.pass, Pass::None(_)) {
            self.pass = Pass::None(None);
            self.budget.hold(&mut self.pass_held, Tour::bytes(&self.mesh, self.boundary))?;
            let (from, to) = (
                contents.levels[atom.level as usize + 1].precision,
                contents.levels[atom.level as usize].precision,
            );
            self.pay_for_walk()?;
            let walk = Walk::new(&self.mesh.table, &self.mesh.roots);
            self.pass = Pass::Precision(PrecisionPass::new(&self.mesh, &walk, from, to));
        }
        let Pass::Precision(pass) = &mut self.pass else {
            return Err(FormatError::new(atom.offset, "5.6", "a precision pass behind operations").into());
        };
        let mut coder = RangeDecoder::new(payload);
        // Behind a whole round every vertex has moved.
        let most = if self.tells { self.mesh.positions.len().min(atom.items as usize) } else { 0 };
        self.budget.hold(&mut self.told, most * size_of::<u32>())?;
        let mut moved = Vec::new();
        make_room(&mut moved, most)?;
        for _ in 0..atom.items {
            let step = pass.step(&mut self.mesh, &mut self.models, &mut coder, |_| [0; 3]).map_err(fault)?;
            let Some(v) = step else {
                return Err(FormatError::new(atom.offset, "5.6", "more steps than vertices").into());
            };
            if moved.len() < most {
                moved.push(v.0);
            }
        }
        coder.finish().map_err(fault)?;
        if atom.last {
            self.pass = Pass::None(None);
        }
        moved.sort_unstable();
        moved.dedup();
        // From the middle of a cell to that of the lowest one in it.
        let middle = |j: u32| f64::from(from_cell(0, contents.levels[j as usize].precision));
        let shift = 3f64.sqrt() * (middle(atom.level + 1) - middle(atom.level));
        let (v, t) = (self.mesh.positions.len() as u32, self.mesh.table.slots() as u32);
        events.push_back(Event::Refined(Delta {
            vertices: v..v,
            triangles: t..t,
            moved,
            shift,
            ..Delta::default()
        }));
        Ok(())
    }

    pub fn take_resource(&mut self, number: usize) -> Option<Vec<u8>> {
        self.resources.take(number, &mut self.budget)
    }

    pub fn add_resource(&mut self, number: usize, bytes: &[u8]) -> Result<()> {
        let contents = self.contents.clone().filter(|contents| number < contents.resources.len());
        let contents = contents.ok_or_else(|| Error::Parameter(format!("there is no resource {number}")))?;
        self.resources.add(&contents, number, bytes, &mut self.budget)
    }

    pub fn coarsen(&mut self) -> Result<Option<u32>> {
        self.finest.forget(&mut self.budget);
        match &mut self.log {
            Some(log) => {
                let under_way = self.level.unwrap_or(0).saturating_sub(1);
                let cells = self.contents.as_deref().map(|contents| cells(contents, under_way));
                let attributes = &mut self.attributes.wedges;
                Ok(cells.and_then(|cells| log.coarsen(&mut self.mesh, attributes, cells)))
            }
            None => Err(no_log()),
        }
    }

    pub fn restore(&mut self) -> Result<Option<u32>> {
        match &mut self.log {
            Some(log) => Ok(log.restore(&mut self.mesh, &mut self.attributes.wedges)),
            None => Err(no_log()),
        }
    }
}

/// The cells of the vertices of a level of the file.
fn cells(contents: &Contents, level: u32) -> Cells {
    let header = &contents.header;
    let precision = contents.levels[level as usize].precision;
    Cells { bits: header.lattice.bits, precision, lifting: header.coding.lifting }
}

/// What going down takes for a vertex: two further positions; its component, and its place in the queue by which that is found.
const BYTES_TO_GO_DOWN: usize = 2 * 12 + 2 * 4;
/// What a level takes in the contents: its entry, and where its atoms and its keyframe are.
const BYTES_OF_LEVEL: usize = size_of::<Level>() + 2 * size_of::<std::ops::Range<usize>>();
/// What a resource takes in the contents, and as an entry of those that are there.
const BYTES_OF_RESOURCE: usize = 3 * size_of::<ResourceEntry>();
/// What a byte of metadata may become: an empty string, in a list that has just been copied to one twice as long.
const BYTES_OF_METADATA: usize = 3 * size_of::<String>();

fn no_log() -> Error {
    Error::Parameter("the decoder was not told to keep an undo log".into())
}
