//! What a browser needs of the decoder: bytes in, typed arrays and JSON out (feature `wasm`).
//!
//! Here is all that can be written without `unsafe`; the crate in `web/wasm` exports it from a WebAssembly module. Nothing in
//! it depends on the machine: the arrays are the same everywhere.

mod changes;
mod corners;
mod json;
mod jump;
mod report;
mod set;
mod surface;

use crate::codec::attributes::Attributes;
use crate::codec::residue::Residue;
use crate::container::{Atom, AtomKind, AttributeEntry, Contents, Plan, Want, plan};
use crate::decoder::{Decoder, Delta, Event, Options};
use crate::error::Result;
use crate::mesh::Vertex;
use crate::mesh::attributes::{Domain, Semantic};
use crate::refine::Site;
use changes::Marks;
pub use changes::{Changes, Field};
pub use corners::Corners;
use corners::Dressed;
use jump::Jumps;
use std::sync::Arc;
use surface::Surface;

/// Settings of a client.
#[derive(Clone, Copy, Debug, Default)]
pub struct Settings {
    /// How far to decode.
    pub want: Want,
    /// Whether positions are told relative to the origin of the lattice, the smallest corner of the bounding box, so that binary32
    /// is fine enough wherever the mesh lies.
    pub relative: bool,
    /// Whether [`Client::coarsen`] will be wanted.
    pub undo: bool,
    /// Whether [`Changes::jump`] is wanted.
    pub jumps: bool,
    /// Whether normals of the file are enough where it has them at every corner: those that triangles make are told as 0 then, and of none that has changed.
    pub own_normals: bool,
    /// Whether resources are wanted. Otherwise their bytes need not be pushed, and are passed over.
    pub resources: bool,
}

/// A decoder that collects what has changed until it is asked for it.
#[derive(Debug)]
pub struct Client {
    settings: Settings,
    decoder: Decoder,
    /// What the file is beside the member that [`Self::decoder`] has, where it is a set.
    set: Option<set::Members>,
    /// The first bytes, until header and table of contents are known: no more than have been pushed.
    head: Option<Vec<u8>>,
    plan: Option<Plan>,
    /// Bytes that the decoder has not been given, from [`Self::held_at`] in the file on: no more than have been pushed.
    held: Vec<u8>,
    held_at: u64,
    /// Whether it has been told that all that is wanted is there.
    ended: bool,
    /// What the residue adds to level 0.
    surface: Surface,
    /// Vertices and triangles that [`Client::take`] has told.
    told: [u32; 2],
    /// The attributes that it has told of, and how many wedges.
    told_alive: Vec<u32>,
    told_wedges: u32,
    /// Whether the residue waits for what attributes its triangles have.
    residue_waits: bool,
    moved: Marks,
    turned: Marks,
    rewritten: Marks,
    /// Where the vertices behind those told began: positions relative to the lattice, in its steps. A vertex has taken many times as much of
    /// the decoder's budget.
    from: Vec<[f32; 3]>,
    jumps: Jumps,
    reports: Vec<serde_json::Value>,
}

impl Client {
    /// A client of a file, from its first byte.
    pub fn new(settings: Settings) -> Self {
        Self {
            decoder: Decoder::new(settings.options()),
            settings,
            set: None,
            head: Some(Vec::new()),
            plan: None,
            held: Vec::new(),
            held_at: 0,
            ended: false,
            surface: Surface::default(),
            told: [0; 2],
            told_alive: Vec::new(),
            told_wedges: 0,
            residue_waits: false,
            moved: Marks::default(),
            turned: Marks::default(),
            rewritten: Marks::default(),
            from: Vec::new(),
            jumps: Jumps::default(),
            reports: Vec::new(),
        }
    }

    /// Hands over bytes of the file, from byte `at` on: where those before ended, or further on, where what lies between is not wanted. Those behind
    /// [`Client::end`] are not needed; they wait until they are wanted.
    pub fn push(&mut self, at: u64, bytes: &[u8]) {
        match &mut self.head {
            Some(head) => {
                head.extend_from_slice(bytes);
                if !self.is_set() {
                    self.decoder.push(bytes);
                }
            }
            None => {
                if at != self.held_at + self.held.len() as u64 {
                    self.held.clear();
                    self.held_at = at;
                }
                self.held.extend_from_slice(bytes);
                self.feed();
            }
        }
    }

    /// Leaves out resources, by their numbers in the table of contents: their bytes need not be pushed. What has come of them is forgotten with the next.
    pub fn skip(&mut self, numbers: &[u32]) {
        let mut numbers: Vec<usize> = numbers.iter().map(|&number| number as usize).collect();
        numbers.sort_unstable();
        self.decoder.skip(|number| numbers.binary_search(&number).is_ok());
        self.tell_wanted();
        self.feed();
    }

    /// Takes a resource that is whole; of the scene its JSON.
    pub fn take_resource(&mut self, number: u32) -> Option<Vec<u8>> {
        self.decoder.take_resource(number as usize)
    }

    /// Adds a resource that was skipped, from all bytes that it takes in the file.
    ///
    /// # Errors
    /// As [`Decoder::add_resource`]; the fault is reported too.
    pub fn add_resource(&mut self, number: u32, bytes: &[u8]) -> Result<()> {
        let outcome = self.decoder.add_resource(number as usize, bytes);
        self.reports.push(match &outcome {
            Ok(()) => report::resource(number as usize),
            Err(error) => report::fault(error, self.decoder.contents()),
        });
        outcome
    }

    /// Wants something else from now on. What has been decoded stays, be it more than that.
    pub fn want(&mut self, want: Want) {
        self.settings.want = want;
        if self.set.is_some() {
            return self.want_member();
        }
        if let (Some(contents), Some(_)) = (self.decoder.contents(), &self.plan) {
            let plan = plan(contents, want);
            if self.plan.as_ref() == Some(&plan) {
                return;
            }
            self.plan = Some(plan);
            self.ended = false;
            self.tell_wanted();
            self.feed();
        }
    }

    /// Decodes up to the next event; `false` where more bytes are needed, or none are expected.
    ///
    /// # Errors
    /// As [`Decoder::poll`]; the fault is reported too.
    pub fn poll(&mut self) -> Result<bool> {
        if self.is_set() {
            return self.poll_set();
        }
        match self.decoder.poll() {
            Ok(Some(event)) => self.note(event),
            Ok(None) => {
                if self.ended || !self.is_satisfied() {
                    return Ok(false);
                }
                self.ended = true;
                self.residue();
                self.reports.push(report::end());
            }
            Err(error) => {
                self.reports.push(report::fault(&error, self.decoder.contents()));
                return Err(error);
            }
        }
        Ok(true)
    }

    /// Says that no more bytes will come.
    ///
    /// # Errors
    /// As [`Decoder::finish`]; the fault is reported too.
    pub fn finish(&mut self) -> Result<()> {
        if self.is_satisfied() {
            return Ok(());
        }
        let outcome = if self.is_set() { Err(self.cut_set()) } else { self.decoder.finish() };
        if let Err(error) = &outcome {
            self.reports.push(report::fault(error, self.decoder.contents()));
        }
        outcome
    }

    /// The byte at which what is wanted ends, once the table of contents is known.
    pub fn end(&self) -> Option<u64> {
        if self.set.is_some() {
            return self.members_end();
        }
        let end = self.plan.as_ref()?.end();
        let missing = self.decoder.missing();
        let last = missing.iter().rfind(|range| range.start < end).map(|range| range.end.min(end));
        Some(last.unwrap_or_else(|| end.min(self.held_at)))
    }

    /// The decoder, with the mesh as it stands.
    pub fn decoder(&self) -> &Decoder {
        &self.decoder
    }

    /// About how many numbers [`Client::take`] would return now.
    pub fn waiting(&self) -> usize {
        let [vertices, triangles] = self.counts();
        let triangles = triangles.saturating_sub(self.told[1]) as usize + self.rewritten.list().len();
        let attributes = self.decoder.attributes();
        let wedges = attributes
            .map_or(0, |of| (of.count.saturating_sub(self.told_wedges)) as usize * (1 + of.columns.len()));
        6 * (vertices.saturating_sub(self.told[0]) as usize + self.moved.list().len())
            + if attributes.is_some() { 6 } else { 3 } * triangles
            + wedges
    }

    /// What has changed in the mesh since it was asked before.
    pub fn take(&mut self) -> Changes {
        let Some(contents) = self.decoder.contents().cloned() else { return Changes::default() };
        if !self.has_own_normals() {
            self.mark_turned();
        }
        let changes = self.changes(&contents);
        self.told = self.counts();
        let corners = &changes.corners;
        if !corners.alive.is_empty() {
            self.told_alive.clone_from(&corners.alive);
            self.told_wedges = corners.first_wedge + corners.vertices.len() as u32;
        }
        self.from.clear();
        self.jumps = Jumps::default();
        for marks in [&mut self.moved, &mut self.turned, &mut self.rewritten] {
            marks.clear();
        }
        changes
    }

    /// What has happened since it was asked before, as a JSON array of objects, each with a `type`: `contents`, `level`,
    /// `residue`, `metadata`, `end`, `fault`.
    pub fn report(&mut self) -> String {
        json::text(&serde_json::Value::Array(std::mem::take(&mut self.reports)))
    }

    /// Goes down to the next coarser level; see [`Decoder::coarsen`]. Returns the level reached.
    ///
    /// # Errors
    /// As [`Decoder::coarsen`].
    pub fn coarsen(&mut self) -> Result<Option<u32>> {
        if self.set.is_some() {
            return Ok(self.step(true));
        }
        let level = self.decoder.coarsen()?;
        self.tell_all_again();
        Ok(level)
    }

    /// Goes up again by a level; see [`Decoder::restore`]. Returns the level reached.
    ///
    /// # Errors
    /// As [`Decoder::restore`].
    pub fn restore(&mut self) -> Result<Option<u32>> {
        if self.set.is_some() {
            return Ok(self.step(false));
        }
        let level = self.decoder.restore()?;
        self.tell_all_again();
        Ok(level)
    }

    /// Vertices and triangles of the mesh, with those of the residue where it stands at level 0.
    fn counts(&self) -> [u32; 2] {
        let mesh = self.decoder.mesh();
        let more = if self.is_finest() { self.surface.counts() } else { [0; 2] };
        [
            mesh.positions.len().min(mesh.table.vertex_slots()) as u32 + more[0],
            mesh.table.slots() as u32 + more[1],
        ]
    }

    fn is_finest(&self) -> bool {
        self.decoder.residue().is_some() && self.decoder.level() == Some(0)
    }

    fn tell_all_again(&mut self) {
        self.told = [0; 2];
        self.told_alive.clear();
        self.told_wedges = 0;
        self.from.clear();
        for marks in [&mut self.moved, &mut self.turned, &mut self.rewritten] {
            marks.clear();
        }
    }

    fn note(&mut self, event: Event) {
        match event {
            Event::Contents(contents) => self.set_out(contents),
            Event::Whole { .. } => self.tell_all_again(),
            Event::Refined(delta) => self.refined(&delta),
            Event::Level { level, .. } => {
                let contents = self.decoder.contents().cloned();
                self.reports.extend(contents.map(|contents| report::level(&contents, level)));
                self.jumps.end_level();
            }
            Event::Residue => {
                self.residue_waits = true;
                if !self.residue_is_dressed() {
                    self.residue();
                }
            }
            // `take` looks for what is alive.
            Event::Attributes { level } => {
                if level == 0 {
                    self.residue();
                }
            }
            Event::Resource { number } => self.reports.push(report::resource(number)),
            // The page shows the surface: neither its last bits nor the input's order make a difference there.
            Event::Correction | Event::Order => {}
            Event::Metadata => {
                let told = self.decoder.metadata().zip(self.decoder.contents());
                self.reports
                    .extend(told.map(|(metadata, contents)| report::metadata(metadata, &contents.header)));
            }
            Event::Stopped | Event::End => {}
        }
    }

    /// Once it is known what the file holds, the decoder is told what to decode of it.
    fn set_out(&mut self, contents: Arc<Contents>) {
        self.plan = Some(plan(&contents, self.settings.want));
        self.held = self.head.take().unwrap_or_default();
        self.held_at = 0;
        let whole = plan(&contents, Want::All);
        self.decoder = Decoder::of_plan(contents.clone(), &whole, self.settings.options());
        if !self.settings.resources {
            self.decoder.skip(|_| true);
        }
        self.reports.push(report::contents(&contents, self.wanted()));
        self.feed();
    }

    /// Gives the decoder what is wanted of the bytes that wait; what is not wanted and lies before it is dropped.
    fn feed(&mut self) {
        let Some(end) = self.plan.as_ref().map(Plan::end) else { return };
        for range in self.decoder.missing() {
            let before = range.start.saturating_sub(self.held_at);
            let here = range.start < end && range.start >= self.held_at && before < self.held.len() as u64;
            if !here {
                return;
            }
            self.drop_held(before as usize);
            let count = (range.end.min(end) - range.start).min(self.held.len() as u64) as usize;
            self.decoder.push(&self.held[..count]);
            self.drop_held(count);
        }
    }

    fn drop_held(&mut self, count: usize) {
        self.held.drain(..count);
        self.held_at += count as u64;
    }

    /// Whether the decoder has been given all that is wanted. It ends with an atom, so that all of it is decoded once nothing more comes of it.
    fn is_satisfied(&self) -> bool {
        if self.set.is_some() {
            return self.has_members();
        }
        let is_behind = |end| self.decoder.missing().first().is_none_or(|range| range.start >= end);
        self.plan.as_ref().map(Plan::end).is_some_and(is_behind)
    }

    /// What will be decoded is something else now.
    fn tell_wanted(&mut self) {
        if self.plan.is_some() {
            let wanted = self.wanted();
            self.reports.push(report::other(wanted));
        }
    }

    /// What is wanted: where it ends, and where in it bytes are not wanted.
    fn wanted(&self) -> serde_json::Value {
        let (Some(plan), Some(end)) = (&self.plan, self.end()) else { return serde_json::Value::Null };
        let mut holes = Vec::new();
        let mut at = self.held_at + self.held.len() as u64;
        for range in self.decoder.missing().iter().take_while(|range| range.start < end) {
            if range.start > at {
                holes.push([at, range.start]);
            }
            at = at.max(range.end);
        }
        report::wanted(plan, end, &holes)
    }

    fn refined(&mut self, delta: &Delta) {
        let mesh = self.decoder.mesh();
        for site in &delta.parents {
            let middle = |parents: &[Vertex]| {
                let mut sum = [0.0; 3];
                for &v in parents {
                    let p = self.beginning(v);
                    sum = [0, 1, 2].map(|k| sum[k] + p[k] / parents.len() as f64);
                }
                sum.map(|x| x as f32)
            };
            let place = match *site {
                Site::Edge(a, b) | Site::Attach(a, b) => middle(&[a, b]),
                Site::Face(a, b, c) => middle(&[a, b, c]),
            };
            self.from.push(place);
        }
        if self.settings.jumps {
            let jump = jump::of_flips(&mesh.table, &delta.flips, |v| self.beginning(v));
            self.jumps.operations(jump);
        }
        if delta.vertices.is_empty() {
            self.jumps.precision(delta.shift);
        } else {
            self.jumps.lifts(delta.shift);
        }
        let [told_vertices, told_triangles] = self.told;
        let (table, is_plain) = (&mesh.table, !self.has_own_normals());
        for &t in &delta.rewritten {
            if t < told_triangles {
                self.rewritten.add(t);
            }
        }
        for &v in &delta.moved {
            if v < told_vertices {
                self.moved.add(v);
            }
            let link = if is_plain { table.link(Vertex(v)) } else { Vec::new() };
            for v in link.into_iter().chain([Vertex(v)]) {
                if v.0 < told_vertices {
                    self.turned.add(v.0);
                }
            }
        }
    }

    /// Where a vertex lies before those that have not been told set out: in steps of the lattice. Where all is new, nothing sets out.
    fn beginning(&self, v: Vertex) -> [f64; 3] {
        let [told, _] = self.told;
        let begun = v.0.checked_sub(told).filter(|_| told > 0).and_then(|k| self.from.get(k as usize));
        match begun {
            Some(place) => place.map(f64::from),
            None => self.decoder.mesh().positions[v.index()].map(f64::from),
        }
    }

    /// Whether normals that triangles make are of no use.
    fn has_own_normals(&self) -> bool {
        let (Some(contents), Some(attributes), Some(level)) =
            (self.decoder.contents(), self.decoder.attributes(), self.decoder.level())
        else {
            return false;
        };
        let entries = &contents.attributes;
        let is_whole = |entry: &AttributeEntry| {
            (entry.semantic, entry.domain, entry.partial) == (Semantic::Normal, Domain::Corner, false)
        };
        self.settings.own_normals
            && (0..entries.len()).any(|k| is_whole(&entries[k]) && is_alive(attributes, entries, level, k))
    }

    /// Whoever has gained or lost a triangle has one that is new or rewritten.
    fn mark_turned(&mut self) {
        let table = &self.decoder.mesh().table;
        let new = self.told[1]..table.slots() as u32;
        let rewritten = self.rewritten.list().iter().copied().filter(|&t| (t as usize) < table.slots());
        for t in rewritten.chain(new) {
            for v in table.triangle(crate::mesh::Triangle(t)) {
                if v.0 < self.told[0] {
                    self.turned.add(v.0);
                }
            }
        }
    }

    /// Whether what is alive is told of the residue's triangles, too, a payload later: until then nothing could be said of them.
    fn residue_is_dressed(&self) -> bool {
        let (Some(contents), Some(attributes)) = (self.decoder.contents(), self.decoder.attributes()) else {
            return false;
        };
        let mut columns = (0..).zip(&contents.attributes);
        let is_coded = columns.any(|(k, entry)| attributes.is_born(k) && entry.constant.is_none());
        let follows = |atom: &Atom| atom.kind == AtomKind::Attributes && atom.level == 0;
        let triangles = self.decoder.residue().is_some_and(|residue| !residue.triangles.is_empty());
        is_coded && triangles && contents.atoms.iter().any(follows)
    }

    /// The residue becomes part of the mesh, if it waits for that.
    fn residue(&mut self) {
        if !std::mem::take(&mut self.residue_waits) {
            return;
        }
        let none = Residue::default();
        let residue = self.decoder.residue().unwrap_or(&none);
        self.reports.push(report::residue(residue));
        self.surface = Surface::new(self.decoder.mesh(), residue);
        for t in self.surface.reversed().filter(|&t| t < self.told[1]) {
            self.rewritten.add(t);
        }
        for v in self.surface.turned().filter(|&v| v < self.told[0]) {
            self.turned.add(v);
        }
    }

    fn changes(&self, contents: &Contents) -> Changes {
        let mesh = self.decoder.mesh();
        let bare = Surface::default();
        let surface = if self.is_finest() { &self.surface } else { &bare };
        let lattice = &contents.header.lattice;
        let origin = if self.settings.relative { [0.0; 3] } else { lattice.origin };
        let place = |p: [f64; 3]| [0, 1, 2].map(|k| (origin[k] + p[k] * lattice.step) as f32);
        let position = |v: u32| place(surface.position(mesh, lattice, v));
        let [vertices, triangles] = self.counts();
        let [first_vertex, first_triangle] = self.told;
        let (none, has_own) = (Marks::default(), self.has_own_normals());
        let normal = |v: u32| if has_own { [0.0; 3] } else { surface.normal(mesh, v) };
        let turned = if has_own { &none } else { &self.turned };
        let indices = |t: u32| surface.triangle(mesh, t);
        let from = |v: u32| match self.from.get((v - first_vertex) as usize) {
            Some(p) if first_vertex > 0 => place(p.map(f64::from)),
            _ => position(v),
        };
        Changes {
            counts: [vertices, triangles],
            first_vertex,
            positions: flat(first_vertex..vertices, position),
            from: flat(first_vertex..vertices, from),
            normals: flat(first_vertex..vertices, normal),
            moved: self.moved.list().to_vec(),
            moved_positions: flat(self.moved.list().iter().copied(), position),
            turned: turned.list().to_vec(),
            turned_normals: flat(turned.list().iter().copied(), normal),
            first_triangle,
            indices: flat(first_triangle..triangles, indices),
            rewritten: self.rewritten.list().to_vec(),
            rewritten_indices: flat(self.rewritten.list().iter().copied(), indices),
            jump: if first_vertex > 0 { (self.jumps.sum() * lattice.step) as f32 } else { 0.0 },
            corners: self.corners(contents, surface),
        }
    }

    /// What is new of the attributes that the mesh has at its level.
    fn corners(&self, contents: &Contents, surface: &Surface) -> Corners {
        let Some((attributes, level)) = self.decoder.attributes().zip(self.decoder.level()) else {
            return Corners::default();
        };
        let entries = &contents.attributes;
        let alive: Vec<u32> =
            (0..entries.len() as u32).filter(|&k| is_alive(attributes, entries, level, k as usize)).collect();
        let told = if alive == self.told_alive { [self.told_wedges, self.told[1]] } else { [0; 2] };
        let rewritten = self.rewritten.list();
        let is_new = told[1] == 0 || told[1] < self.counts()[1] || !rewritten.is_empty();
        if alive.is_empty() || !is_new {
            return Corners::default();
        }
        let dressed = Dressed { mesh: self.decoder.mesh(), surface, attributes, entries };
        Corners::new(dressed, alive, told, rewritten)
    }
}

/// Whether the mesh has an attribute at a level.
fn is_alive(attributes: &Attributes, entries: &[AttributeEntry], level: u32, k: usize) -> bool {
    attributes.is_born(k) && (entries[k].birth >= level || entries[k].constant.is_some())
}

/// Three numbers of each, in room that is just enough.
fn flat<T>(list: impl ExactSizeIterator<Item = u32>, value: impl Fn(u32) -> [T; 3]) -> Vec<T> {
    let mut numbers = Vec::with_capacity(3 * list.len());
    for number in list {
        numbers.extend(value(number));
    }
    numbers
}

impl Settings {
    fn options(self) -> Options {
        Options { undo: self.undo, flips: self.jumps, mesh_alone: !self.resources, ..Options::default() }
    }
}
