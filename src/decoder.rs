//! The decoder: bytes in any chunking go in, events come out, the mesh stands ready between them (spec §1).

mod finest;
mod foreign;
mod log;
mod resources;
mod session;

use crate::codec::attributes::Attributes;
use crate::codec::correction::Correction;
use crate::codec::order::Order;
use crate::codec::residue::Residue;
use crate::container::{Contents, Metadata, Parsed, Parser, Plan, ResourceEntry, Want, kept};
use crate::error::{Error, Result};
use crate::limits::Limits;
use crate::mesh::{IndexedMesh, Vertex};
use crate::refine::{ProgressiveMesh, Site};
use session::Session;
use std::collections::VecDeque;
use std::ops::Range;
use std::sync::Arc;

/// Where decoding stops: before the first operation beyond any of these.
///
/// A [`Plan`] is what is to be fetched for a [`Want`], in whole atoms; this is exact to the operation, and serves a decoder that is
/// given more than its plan. [`Until::of`] makes one of the other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Until {
    /// The finest level wanted.
    pub level: u32,
    /// Most operations from the start.
    pub operations: u64,
    /// Most triangles.
    pub triangles: u32,
}

impl Default for Until {
    /// As far as the file goes.
    fn default() -> Self {
        Self { level: 0, operations: u64::MAX, triangles: u32::MAX }
    }
}

impl Until {
    /// Where a decoder of this file stops for what is wanted; bytes are bounded by what it is given.
    pub fn of(want: Want, contents: &Contents) -> Self {
        let all = Self::default();
        match want {
            Want::Level(level) => Self { level, ..all },
            Want::Error(measure, most) => Self { level: contents.level_within(measure, most), ..all },
            Want::Triangles(triangles) => Self { triangles, ..all },
            Want::Bytes(_) | Want::All => all,
        }
    }
}

/// Settings of a decoder.
#[derive(Clone, Copy, Debug, Default)]
pub struct Options {
    /// Memory and work allowed.
    pub limits: Limits,
    /// How far to decode.
    pub until: Until,
    /// Whether to keep what it takes to go down again: see [`Decoder::coarsen`].
    pub undo: bool,
    /// Whether to tell of flips: see [`Delta::flips`].
    pub flips: bool,
    /// Whether resources are passed over as they come, neither told of nor kept.
    pub mesh_alone: bool,
}

/// What changed in the mesh since the event before. All numbers are those of [`Decoder::mesh`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Delta {
    /// Vertices appended.
    pub vertices: Range<u32>,
    /// Where each of them was inserted: on an edge, in a triangle, or outside a boundary edge. One of a component that is born at a level
    /// has no parents and stands for both ends of an edge itself.
    pub parents: Vec<Site>,
    /// With [`Options::flips`] the flips that followed, in order: the vertex inserted, and the start and end of the link edge that was
    /// flipped.
    pub flips: Vec<[Vertex; 3]>,
    /// Vertices moved, of those that were there before: by a precision pass, or as ends of split edges (spec §5.4.5). Ascending.
    pub moved: Vec<u32>,
    /// How far each of them has moved at most, in steps of the lattice.
    pub shift: f64,
    /// Wedges appended: see [`Decoder::attributes`]. Triangles that are rewritten or appended name others than before.
    pub wedges: Range<u32>,
    /// Triangles appended.
    pub triangles: Range<u32>,
    /// Triangles rewritten, each once, without those appended.
    pub rewritten: Vec<u32>,
}

impl Delta {
    /// Bytes that its lists take when each of them is next copied to one twice as long, and as much to spare.
    fn bytes(&self) -> usize {
        let bytes = self.parents.capacity() * size_of::<Site>()
            + self.flips.capacity() * size_of::<[Vertex; 3]>()
            + self.rewritten.capacity() * size_of::<u32>();
        4 * bytes
    }
}

/// What [`Decoder::poll`] tells.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Event {
    /// Header and table of contents are known.
    Contents(Arc<Contents>),
    /// A whole level is there, base or keyframe; everything is new.
    Whole {
        /// Its number.
        level: u32,
    },
    /// The mesh has been refined by one atom.
    Refined(Delta),
    /// A level is complete.
    Level {
        /// Its number.
        level: u32,
        /// How far its surface and the input's are apart at most, both ways: [`Level::max_error`](crate::container::Level::max_error).
        max_error: f64,
        /// Root mean square distance of the input's vertices from it: [`Level::rms_error`](crate::container::Level::rms_error).
        rms_error: f64,
    },
    /// Level 0's residue is known: see [`Decoder::assembled`].
    Residue,
    /// Attributes are born at a level: every corner and triangle of its mesh has got their values. See [`Decoder::attributes`] and
    /// [`Decoder::assembled`]. Those that the base has, or a keyframe, come with [`Event::Whole`].
    Attributes {
        /// Its number. At 0 the further triangles of the residue have got theirs, too.
        level: u32,
    },
    /// A resource is whole: see [`Decoder::resource`].
    Resource {
        /// Its place in [`Decoder::resources`].
        number: usize,
    },
    /// Level 0's coordinates are known exactly: see [`Decoder::assembled`].
    Correction,
    /// The order of the input's vertices and triangles is known: see [`Decoder::assembled`].
    Order,
    /// The metadata are known: see [`Decoder::metadata`].
    Metadata,
    /// [`Options::until`] has been reached; nothing more will be decoded.
    Stopped,
    /// The file is complete.
    End,
}

/// Decodes a file, or the parts of a [`Plan`], as bytes arrive.
///
/// However the bytes are cut, the events are the same, and so is the error that ends them.
///
/// ```
/// use unweld::decoder::{Decoder, Event, Options};
/// # #[cfg(feature = "encode")] {
/// # let file = unweld::encoder::Encoder::default().encode_to_vec(&unweld::mesh::shapes::sphere(4)).unwrap();
/// let mut decoder = Decoder::new(Options::default());
/// for packet in file.chunks(1000) {
///     decoder.push(packet);
///     while let Some(event) = decoder.poll()? {
///         if let Event::Level { level, max_error, .. } = event {
///             println!("level {level}: {} triangles, error {max_error}", decoder.mesh().table.triangle_count());
///         }
///     }
/// }
/// decoder.finish()?;
/// # }
/// # Ok::<(), unweld::Error>(())
/// ```
#[derive(Debug)]
pub struct Decoder {
    parsers: VecDeque<Parser>,
    pending: Vec<u8>,
    /// Bytes of `pending` already used.
    used: usize,
    session: Session,
    events: VecDeque<Event>,
    ended: bool,
    /// What ended decoding, if something did.
    fault: Option<Error>,
}

impl Decoder {
    /// Decodes a whole file from its first byte.
    pub fn new(options: Options) -> Self {
        Self::with(VecDeque::from([Parser::new()]), Session::new(options))
    }

    /// Decodes the parts of a plan, whose bytes are to be pushed one after the other.
    pub fn of_plan(contents: Arc<Contents>, plan: &Plan, options: Options) -> Self {
        let parts = plan.parts.iter().map(|part| Parser::of_atoms(contents.clone(), part.atoms.clone()));
        let parsers = parts.collect();
        let mut session = Session::new(options);
        session.begin(contents, plan.start);
        Self::with(parsers, session)
    }

    fn with(parsers: VecDeque<Parser>, session: Session) -> Self {
        #[cfg(unweld_surface)]
        crate::entropy::mix::tables::make();
        Self {
            parsers,
            pending: Vec::new(),
            used: 0,
            session,
            events: VecDeque::new(),
            ended: false,
            fault: None,
        }
    }

    /// Has the vertices of a member of a set be told by those of the one before it (spec §15.2): where these are, in their order in
    /// [`Decoder::mesh`]. To be called before any bytes are pushed.
    pub fn beside(&mut self, other: Arc<[[i32; 3]]>) {
        self.session.other = Some(other);
    }

    /// Hands over the next bytes. They wait until [`Decoder::poll`] comes to them.
    pub fn push(&mut self, bytes: &[u8]) {
        self.pending.drain(..self.used);
        self.used = 0;
        self.pending.extend_from_slice(bytes);
    }

    /// Decodes up to the next event; `None` where more bytes are needed, or none are expected.
    ///
    /// # Errors
    /// [`Error::Format`] where the file is damaged, [`Error::Limit`] where it asks for too much. The mesh stays as it was
    /// after the last whole operation, and every further call says the same.
    pub fn poll(&mut self) -> Result<Option<Event>> {
        let outcome = self.next_event();
        // The caller is answerable for other errors, and may call again.
        self.fault = match &outcome {
            Err(fault @ (Error::Format(_) | Error::Limit { .. } | Error::Memory { .. })) => {
                Some(fault.clone())
            }
            _ => return outcome,
        };
        // What was decoded before the fault is told first.
        self.next_event()
    }

    fn next_event(&mut self) -> Result<Option<Event>> {
        loop {
            if let Some(event) = self.events.pop_front() {
                return Ok(Some(event));
            }
            if let Some(fault) = &self.fault {
                return Err(fault.clone());
            }
            if self.ended {
                self.swallow_rest()?;
                return Ok(None);
            }
            if self.session.is_lowered() {
                return Err(Error::Parameter("the mesh was coarsened: restore it before decoding on".into()));
            }
            let others = self.parsers.len() > 1;
            let Some(parser) = self.parsers.front_mut() else {
                self.ended = true;
                return Ok(Some(Event::End));
            };
            let mut input = &self.pending[self.used..];
            let before = input.len();
            // Where a further part follows, bytes behind the last atom of this one are its own.
            let parsed =
                if others && parser.is_complete() { Parsed::End } else { parser.parse(&mut input)? };
            self.used += before - input.len();
            match parsed {
                Parsed::NeedMore(_) => return Ok(None),
                Parsed::Contents(contents) => {
                    let base = contents.base_level();
                    self.session.pay_for_contents(&contents)?;
                    self.session.begin(contents.clone(), base);
                    return Ok(Some(Event::Contents(contents)));
                }
                Parsed::Atom { index, payload } => {
                    self.session.atom(index, payload, &mut self.events)?;
                    self.ended = self.session.is_stopped();
                }
                Parsed::End => {
                    if self.parsers.len() == 1 {
                        self.ended = true;
                        return Ok(Some(Event::End));
                    }
                    self.parsers.pop_front();
                }
            }
        }
    }

    /// Bytes behind the end are counted, for [`Decoder::finish`] to tell, whichever push brought them.
    fn swallow_rest(&mut self) -> Result<()> {
        if let (false, Some(parser)) = (self.session.is_stopped(), self.parsers.front_mut()) {
            parser.parse(&mut &self.pending[self.used..])?;
            self.used = self.pending.len();
        }
        Ok(())
    }

    /// Says that no more bytes will come.
    ///
    /// # Errors
    /// [`Error::Format`] where bytes are missing or left over, unless decoding was stopped by [`Options::until`]; the error of
    /// [`Decoder::poll`], if there was one.
    pub fn finish(&self) -> Result<()> {
        if let Some(fault) = &self.fault {
            return Err(fault.clone());
        }
        if self.session.is_stopped() {
            return Ok(());
        }
        match self.parsers.front() {
            Some(parser) => Ok(parser.finish()?),
            None => Ok(()),
        }
    }

    /// The mesh as it stands; valid between any two events once the base is there.
    pub fn mesh(&self) -> &ProgressiveMesh {
        &self.session.mesh
    }

    /// The level that is complete, or `None` before the base is.
    pub fn level(&self) -> Option<u32> {
        self.session.level()
    }

    /// Header and table of contents, once known.
    pub fn contents(&self) -> Option<&Arc<Contents>> {
        self.session.contents.as_ref()
    }

    /// The residue of level 0, once known.
    pub fn residue(&self) -> Option<&Residue> {
        self.session.finest.residue.as_ref()
    }

    /// The attributes that the mesh has as it stands; `None` before the first of them is born.
    pub fn attributes(&self) -> Option<&Attributes> {
        self.session.attributes()
    }

    /// The input's coordinates, once known, where the file has them.
    pub fn correction(&self) -> Option<&Correction> {
        self.session.finest.correction.as_ref()
    }

    /// The order of the input's vertices and triangles, once known, where the file has it.
    pub fn order(&self) -> Option<&Order> {
        self.session.finest.order.as_ref()
    }

    /// The metadata, once known.
    pub fn metadata(&self) -> Option<&Metadata> {
        self.session.metadata.as_ref()
    }

    /// What the table of contents says of resources; none before it is known.
    pub fn resources(&self) -> &[ResourceEntry] {
        self.contents().map_or(&[], |contents| &contents.resources)
    }

    /// The bytes of a resource that is whole and has not been taken, of the scene its JSON. The levels that the mesh goes through do not
    /// change it.
    pub fn resource(&self, number: usize) -> Option<&[u8]> {
        self.session.resources.get(number)
    }

    /// Hands over a resource that is whole; its memory is counted no more.
    pub fn take_resource(&mut self, number: usize) -> Option<Vec<u8>> {
        self.session.take_resource(number)
    }

    /// The scene's JSON, once it is there and where there is one.
    pub fn scene(&self) -> Option<&[u8]> {
        self.resource(self.contents()?.scene()?)
    }

    /// Adds a resource whose bytes, all that it takes in the file, have come by another way than [`Decoder::push`]: one that was skipped, or
    /// that stands before the keyframe which decoding began at. No event tells of it.
    ///
    /// # Errors
    /// [`Error::Parameter`] before the table of contents is known or where there is no such resource, [`Error::Format`] where the bytes are not
    /// its own, [`Error::Limit`]. What has been decoded stays as it is.
    pub fn add_resource(&mut self, number: usize, bytes: &[u8]) -> Result<()> {
        self.session.add_resource(number, bytes)
    }

    /// Leaves out those resources of which `skipped` says so by their numbers, but for atoms that have begun: their bytes are not to be pushed.
    /// [`Decoder::missing`] tells which are.
    pub fn skip(&mut self, skipped: impl Fn(usize) -> bool) {
        let Some(contents) = self.contents().cloned() else { return };
        let mut there = self.waiting();
        for mut parser in std::mem::take(&mut self.parsers) {
            let (atoms, _) = parser.rest();
            let mut first = atoms.start;
            while first < atoms.end && there > 0 {
                there = there.saturating_sub(contents.atoms[first].length.into());
                first += 1;
            }
            let mut runs = VecDeque::from(kept(&contents, first..atoms.end, &skipped));
            parser.end_before(match runs.front() {
                Some(run) if run.start == first => runs.pop_front().map_or(first, |run| run.end),
                _ => first,
            });
            self.parsers.push_back(parser);
            self.parsers.extend(runs.into_iter().map(|run| Parser::of_atoms(contents.clone(), run)));
        }
    }

    /// The bytes of the file that are still to be pushed, in this order; none before the table of contents is known.
    pub fn missing(&self) -> Vec<Range<u64>> {
        let Some(contents) = self.contents() else { return Vec::new() };
        let mut there = self.waiting();
        let mut missing = Vec::new();
        for parser in &self.parsers {
            let Range { start, end } = contents.bytes(parser.rest().0);
            let from = end.min(start + there);
            there -= from - start;
            if from < end {
                missing.push(from..end);
            }
        }
        missing
    }

    /// Bytes that have been pushed of atoms that have not been decoded.
    fn waiting(&self) -> u64 {
        let held = self.parsers.front().map_or(0, |parser| parser.rest().1);
        held + (self.pending.len() - self.used) as u64
    }

    /// Operations carried out since the base or keyframe.
    pub fn operations(&self) -> u64 {
        self.session.operations
    }

    /// Units of work done so far: see [`Limits::work`].
    pub fn work(&self) -> u64 {
        self.session.work()
    }

    /// The mesh as positions and triangles; at level 0, once residue, attributes, correction and order are known, everything the
    /// input had: its coordinates bit for bit where the file has a correction, its lists of vertices and triangles where it
    /// has an order.
    ///
    /// # Errors
    /// [`Error::Parameter`] before the base is there; [`Error::Limit`] where it takes more memory than is left.
    pub fn assembled(&self) -> Result<IndexedMesh> {
        self.session.assembled()
    }

    /// Goes down to the next coarser level by the undo log. Returns the level reached, or `None` where the log ends.
    /// [`Decoder::restore`] goes up again; only then can bytes be decoded again.
    ///
    /// # Errors
    /// [`Error::Parameter`] where no log was kept.
    pub fn coarsen(&mut self) -> Result<Option<u32>> {
        self.session.coarsen()
    }

    /// Goes up again by one level that was left by [`Decoder::coarsen`]. Returns the level reached, or `None` at the top.
    ///
    /// # Errors
    /// [`Error::Parameter`] where no log was kept.
    pub fn restore(&mut self) -> Result<Option<u32>> {
        self.session.restore()
    }
}

/// Decodes a whole file at once.
///
/// # Errors
/// As [`Decoder::poll`] and [`Decoder::finish`].
pub fn decode(bytes: &[u8], options: Options) -> Result<Decoder> {
    let mut decoder = Decoder::new(options);
    // Nobody will look at the lists of what changed.
    decoder.session.tells = false;
    decoder.push(bytes);
    while decoder.poll()?.is_some() {}
    decoder.finish()?;
    Ok(decoder)
}
