//! The encoder: simplify, code, write. Here these rooms meet, and only here.

mod alive;
mod attribute_errors;
mod attributes;
mod constant;
mod difference;
mod features;
mod finish;
mod grids;
mod labelling;
mod levels;
mod names;
mod options;
mod places;
mod report;
mod resources;
mod schedule;
mod set;
mod work;

use crate::codec::grid::Real;
use crate::container::{AtomKind, Coding, FileBuilder, Level, Metadata};
use crate::error::{Error, Result};
use crate::limits::MAX_LIFTING;
use crate::mesh::topology::{self, Conditioned, ConditioningReport, Manifold};
use crate::mesh::{IndexedMesh, Lattice, lattice};
use crate::refine::{ProgressiveMesh, Roots};
use crate::simplify::{self, Births, Features, Simplified};
use alive::Alive;
use finish::Finish;
use levels::Levels;
use places::Places;
use set::Membership;
use std::io::Write;
use std::time::Instant;

pub use options::{AttributeBirth, FEW, Keyframes, LatticeChoice, Options, Preview, Profile};
pub use report::{Joined, Report, Seconds};
pub use resources::{Place, Resource};
pub use set::{SetInput, SetMember, SetOrder, SetReport, encode_set};

/// What the encoder is doing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Stage {
    /// Making a manifold of the input.
    Condition,
    /// Removing vertices.
    Simplify,
    /// Writing refinements and keyframes.
    Code,
}

/// How far it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// The stage under way.
    pub stage: Stage,
    /// Vertices done in it.
    pub done: u64,
    /// Vertices to do in it.
    pub total: u64,
}

/// Encodes meshes.
///
/// ```
/// use unweld::encoder::{Encoder, Options};
/// let mesh = unweld::mesh::shapes::sphere(4);
/// let mut encoder = Encoder::new(Options { position_bits: 12, ..Options::default() });
/// encoder.on_progress(|progress| {
///     eprintln!("{:?}: {} of {}", progress.stage, progress.done, progress.total);
///     true // false would cancel
/// });
/// let mut file = Vec::new();
/// let report = encoder.encode(&mesh, &mut file)?;
/// assert_eq!(report.bytes, file.len() as u64);
/// # Ok::<(), unweld::Error>(())
/// ```
#[derive(Default)]
pub struct Encoder<'a> {
    options: Options,
    progress: Option<Box<dyn FnMut(Progress) -> bool + 'a>>,
    source: Source,
    resources: Vec<Resource>,
    membership: Option<Membership>,
}

/// What the metadata say of the input.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Source {
    /// The input's name.
    pub name: String,
    /// What was lost before there was a mesh.
    pub dropped: Vec<String>,
    /// Whether its coordinates were binary32.
    pub float32: bool,
    /// The settings as the user would name them.
    pub settings: Vec<(String, String)>,
}

impl<'a> Encoder<'a> {
    /// An encoder with these settings.
    pub fn new(options: Options) -> Self {
        Self { options, ..Self::default() }
    }

    /// Says where the input came from.
    pub fn source(&mut self, source: Source) -> &mut Self {
        self.source = source;
        self
    }

    /// Has these resources come with the mesh, in this order: each behind the same level as the one before it or behind a finer one.
    pub fn resources(&mut self, resources: Vec<Resource>) -> &mut Self {
        self.resources = resources;
        self
    }

    /// Has `callback` told of progress; encoding is cancelled when it returns false.
    pub fn on_progress(&mut self, callback: impl FnMut(Progress) -> bool + 'a) -> &mut Self {
        self.progress = Some(Box::new(callback));
        self
    }

    /// Encodes into memory.
    ///
    /// # Errors
    /// As [`Encoder::encode`].
    pub fn encode_to_vec(&mut self, mesh: &IndexedMesh) -> Result<Vec<u8>> {
        let mut file = Vec::new();
        self.encode(mesh, &mut file)?;
        Ok(file)
    }

    /// Encodes a mesh. The same mesh, settings and source give the same bytes.
    ///
    /// # Errors
    /// [`Error::Parameter`] for settings out of range or a mesh without triangles, with coordinates that are not finite or
    /// indices that are out of range; [`Error::Limit`] where `max_memory` would not do, or where decoding would take more work than
    /// decoders allow for so few bytes, as it may with millions of triangles in a perfect pattern, or the scene is too long; [`Error::Cancelled`];
    /// [`Error::Io`] where `out` fails.
    pub fn encode(&mut self, mesh: &IndexedMesh, out: &mut impl Write) -> Result<Report> {
        let start = Instant::now();
        self.check(mesh)?;
        attributes::check(mesh, &self.options)?;
        resources::check(&self.resources)?;
        let used = mesh.triangles.iter().flatten().map(|&v| mesh.positions[v as usize]);
        // Of a scene all may be points and lines.
        let is_scene =
            self.resources.first().is_some_and(|first| first.kind == crate::container::ResourceKind::Scene);
        let nothing = (is_scene && mesh.positions.is_empty()).then_some(([0.0; 3], [0.0; 3]));
        let (min, max) =
            lattice::bounds(used).or(nothing).ok_or_else(|| parameter("the mesh has no triangles"))?;
        let lattice = match &self.membership {
            Some(membership) => membership.lattice,
            None => self.options.lattice_over(min, max)?,
        };
        self.report_progress(Stage::Condition, 0, mesh.triangles.len() as u64)?;
        let conditioned = topology::condition_on(mesh, self.options.weld, &lattice);
        let joined = Joined::new(mesh, &conditioned, &lattice);
        let Conditioned { mut manifold, remainder, report: found } = conditioned;
        let mut finish = Finish::new(mesh, &manifold, remainder, &self.options);
        self.report_progress(Stage::Condition, 1, 1)?;
        let conditioning = start.elapsed();

        if self.options.lock_boundary {
            manifold.locked = manifold.locked_with_boundary();
        }
        let locked_vertices = manifold.locked.count_ones();
        let features = finish.features(&manifold, &self.options, &lattice);
        let (mut simplified, quantised) = self.simplify(manifold, features, &mesh.positions, &lattice)?;
        let simplifying = start.elapsed() - conditioning;

        // The places of removed triangles take far more memory than the base.
        simplified.base = simplified.base.compacted();
        let base = simplified.base.clone();
        let roots = Roots::choose(&base);
        let rich_models = self.options.has_rich_models(quantised.len());
        let options =
            Options { position_bits: lattice.bits, rich_models: Some(rich_models), ..self.options.clone() };
        let labelling = finish.label(&simplified, &quantised, &self.options);
        let measured = labelling.as_ref().map(|_| finish.measured(&simplified, &quantised));
        let mut mesh_at_base = ProgressiveMesh { table: base, positions: quantised, roots };
        let places = Places::of_all_levels(&mut mesh_at_base, &mut simplified, &lattice, &options)?;
        joined.add_to(&mut simplified.errors);
        let base_level = simplified.history.level_count();
        let entries = finish.entries();
        let alive = labelling.as_ref().zip(measured.as_ref());
        let alive = alive.map(|(labelling, measured)| Alive::new(labelling, measured, entries, base_level));
        if let Some(own) = &mut self.membership {
            own.places = set::places(&mesh_at_base);
        }
        let membership = self.membership.clone();
        let other = membership.as_ref().and_then(|own| own.other.as_deref());
        let mut levels = Levels::new(mesh_at_base, &simplified, &places, &options, alive, other)?;
        levels.code(&mut |done, total| self.report_progress(Stage::Code, done, total))?;
        let (finest, alive) = levels.finest();
        let payloads = finish.payloads(finest, alive, &lattice)?;

        let maximum = lattice.quantise(max).map(|x| x as u32);
        let maximum = membership.as_ref().map_or(maximum, |own| own.maximum);
        let mut entries = level_entries(&simplified, &levels, &places, &lattice);
        if let (Some([max, rms]), Some(level)) = (membership.and_then(|own| own.errors), entries.first_mut())
        {
            [level.max_error, level.rms_error] = [level.max_error + max, level.rms_error + rms];
        }
        let mut file = FileBuilder::new(lattice, maximum, entries);
        file.coding = Coding { lifting: places.lifting, rich_models };
        let mut report = Report::new(found, &simplified, mesh.diagonal());
        report.dropped = self.source.dropped.clone();
        report.locked_vertices = locked_vertices;
        report.joined = joined;
        report.lattice_is_exact = lattice.is_exact();
        report.residue = payloads.counts;
        let mut work = levels.work()?;
        levels.add_to(&mut file, &mut report);
        report.resource_bits = 8.0 * resources::add_to(&mut file, &self.resources, &mut work)? as f64;
        file.attributes = finish.entries().to_vec();
        report.attribute_bits += payloads.attributes.len() as f64 * 8.0;
        report.residue_bits = payloads.residue.len() as f64 * 8.0;
        report.correction_bits = payloads.correction.len() as f64 * 8.0;
        file.payload(AtomKind::Residue, 0, &payloads.residue);
        file.payload(AtomKind::Attributes, 0, &payloads.attributes);
        report.order_bits = payloads.order.len() as f64 * 8.0;
        file.payload(AtomKind::Correction, 0, &payloads.correction);
        file.payload(AtomKind::Order, 0, &payloads.order);
        let mut before = 0;
        let beyond = [&payloads.residue, &payloads.attributes, &payloads.correction, &payloads.order];
        for (payload, after) in
            beyond.into_iter().zip(payloads.work).filter(|(payload, _)| !payload.is_empty())
        {
            work.read(payload.len(), after - before)?;
            before = after;
        }
        let mut metadata = self.metadata(mesh, &report, payloads.copies);
        metadata.shorten(&file.header());
        let metadata = metadata.encode()?;
        work.read(metadata.len(), metadata.len() as u64)?;
        report.work = work.total();
        file.payload(AtomKind::Metadata, 0, &metadata);
        let contents = file.write(out)?;
        report.seconds = Seconds {
            condition: conditioning.as_secs_f64(),
            simplify: simplifying.as_secs_f64(),
            code: (start.elapsed() - conditioning - simplifying).as_secs_f64(),
        };
        report.finish(&contents);
        Ok(report)
    }

    fn check(&self, mesh: &IndexedMesh) -> Result<()> {
        let options = &self.options;
        options.check_lattice()?;
        if !(1..=60_000).contains(&options.atom_bytes) {
            return Err(parameter("atom bytes must be 1 to 60,000"));
        }
        let share = options.simplify.level_share;
        if !(share > 0.0 && share <= 1.0) || options.simplify.choices == 0 {
            return Err(parameter("the level share must be above 0 and at most 1, the choices at least 1"));
        }
        if options.simplify.level_budget.is_nan() || options.simplify.level_budget <= 0.0 {
            return Err(parameter("the level budget must be above 0"));
        }
        if !(options.simplify.alpha.is_finite() && options.simplify.beta.is_finite()) {
            return Err(parameter("alpha and beta must be finite"));
        }
        if let Keyframes::Every(0) = options.keyframes {
            return Err(parameter("every 0 levels is no distance of keyframes"));
        }
        if options.lifting.is_some_and(|lifting| lifting > MAX_LIFTING) {
            return Err(Error::Parameter(format!("the lifting must be at most {MAX_LIFTING} 64ths")));
        }
        if let Preview::Schedule(schedule) = &options.preview
            && !schedule.is_sorted()
        {
            return Err(parameter("a precision schedule must not fall from a level to a coarser one"));
        }
        if let Some(real) = options.exact
            && let Some(v) =
                mesh.positions.iter().position(|p| p.iter().any(|&x| x.is_finite() && !real.holds(x)))
        {
            return Err(Error::Parameter(format!("vertex {v} has a coordinate that is no {real} number")));
        }
        for (v, p) in mesh.positions.iter().enumerate() {
            if p.iter().any(|x| !x.is_finite()) {
                return Err(Error::Parameter(format!("vertex {v} has a coordinate that is not finite")));
            }
        }
        let count = mesh.positions.len();
        for (t, triangle) in mesh.triangles.iter().enumerate() {
            if let Some(v) = triangle.iter().find(|&&v| v as usize >= count) {
                return Err(Error::Parameter(format!("triangle {t} names vertex {v} of {count}")));
            }
        }
        let most = crate::limits::MAX_ELEMENTS as usize;
        if mesh.positions.len() > most / 4 || mesh.triangles.len() > most / 4 {
            return Err(Error::Parameter(format!("more than {} vertices or triangles", most / 4)));
        }
        let beyond = [(options.exact.is_some(), BYTES_EXACT), (options.keep_order, BYTES_IN_ORDER)];
        let attributes = if mesh.attributes.is_empty() { 0 } else { BYTES_OF_LABELS };
        let attributes = attributes + BYTES_OF_AN_ATTRIBUTE * mesh.attributes.len() as u64;
        let beyond: u64 = beyond.iter().filter(|(wanted, _)| *wanted).map(|(_, bytes)| bytes).sum();
        let needed = mesh.triangles.len() as u64 * (BYTES_A_TRIANGLE + beyond + attributes)
            + mesh.positions.len() as u64 * 24
            + self.resources.iter().map(|resource| 2 * resource.bytes.len() as u64).sum::<u64>();
        if needed > options.max_memory {
            return Err(Error::Limit { what: "memory in bytes", needed, allowed: options.max_memory });
        }
        Ok(())
    }

    /// Removes vertices; what comes of it, and the lattice points of all vertices of the manifold. `input` are the positions of the mesh.
    fn simplify(
        &mut self,
        manifold: Manifold,
        features: Features,
        input: &[[f64; 3]],
        lattice: &Lattice,
    ) -> Result<(Simplified, Vec<[i32; 3]>)> {
        let Manifold { table, positions, locked } = manifold;
        let births = match (self.options.births, self.options.lock_boundary) {
            (false, _) => Births::None,
            (true, true) => Births::Closed,
            (true, false) => Births::All,
        };
        let options = simplify::Options { births, ..self.options.simplify.clone() };
        // A copy of what is there anyway need not be kept.
        let own = (positions != input).then_some(positions);
        let positions = own.as_deref().unwrap_or(input);
        let mut progress = |done, total| self.report_progress(Stage::Simplify, done, total).is_ok();
        let simplified =
            simplify::simplify(table, positions, locked, features, lattice, &options, &mut progress)?;
        Ok((simplified, positions.iter().map(|&p| lattice.quantise(p)).collect()))
    }

    fn metadata(&self, mesh: &IndexedMesh, report: &Report, copies: usize) -> Metadata {
        let mut conditioning = report::conditioning_counts(&report.conditioning);
        if copies > 0 {
            conditioning.push(("copies".to_owned(), copies as u64));
        }
        Metadata {
            generator: concat!("unweld ", env!("CARGO_PKG_VERSION")).to_owned(),
            source: self.source.name.clone(),
            settings: self.settings(&report.conditioning),
            dropped: report.dropped.clone(),
            conditioning,
            part_names: mesh.part_names.clone(),
            libraries: mesh.libraries.clone(),
            diagonal: Some(report.diagonal.min(f64::MAX)),
            source_float32: self.options.exact.map_or(self.source.float32, |real| real == Real::Binary32),
        }
    }

    /// Those of the source, and the welding where it has joined what is not equal: [`Source::settings`] need not name it.
    fn settings(&self, found: &ConditioningReport) -> Vec<(String, String)> {
        let mut settings = self.source.settings.clone();
        if found.joined_vertices > 0 && settings.iter().all(|(name, _)| name != "weld") {
            settings.push(("weld".to_owned(), self.options.weld.to_string()));
        }
        settings
    }

    fn report_progress(&mut self, stage: Stage, done: u64, total: u64) -> Result<()> {
        let go_on = self.progress.as_mut().is_none_or(|callback| callback(Progress { stage, done, total }));
        if go_on { Ok(()) } else { Err(Error::Cancelled) }
    }
}

fn level_entries(simplified: &Simplified, levels: &Levels, places: &Places, lattice: &Lattice) -> Vec<Level> {
    let entries = levels.counts().iter().zip(&simplified.errors).zip(levels.attribute_errors()).enumerate();
    // Nothing of either surface is further from the other than the lattice is long, whatever numbers near the largest add up to.
    let most = (4.0 * f64::from(1u32 << lattice.bits) * lattice.step).min(f64::MAX / 2.0);
    entries
        .map(|(j, ((&(vertices, triangles), error), attributes))| {
            let precision = places.cells(j).precision;
            // A cell's middle is at most half a cell's diagonal from what it stands for.
            let max_error = (error.max + places.blur_of(j) * 0.75f64.sqrt()).min(most);
            let rms_error = places.rms_error(error, j).min(most);
            let attributes = attributes.clone();
            Level { vertices, triangles, precision, max_error, rms_error, attributes }
        })
        .collect()
}

/// What encoding takes at its peak for a triangle of the input, the input included, roughly.
const BYTES_A_TRIANGLE: u64 = 250;
/// What a correction and an order may take beyond that, roughly.
const BYTES_EXACT: u64 = 60;
const BYTES_IN_ORDER: u64 = 100;
/// What it takes to know which values corners have at every level, and what each attribute takes, roughly.
const BYTES_OF_LABELS: u64 = 100;
const BYTES_OF_AN_ATTRIBUTE: u64 = 40;

fn parameter(what: &str) -> Error {
    Error::Parameter(what.to_owned())
}
