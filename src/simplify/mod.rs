//! Mesh -> history: vertex by vertex, level by level, down to the base.
//!
//! Two ways to choose the next vertex: `ffc`, Four-Face Clusters with a priority queue (Velho 2001), and `stellar`, the best of
//! d random vertices (Vieira, Velho, Lopes, Tavares, Lewiner 2003, after Wu and Kobbelt 2002). Everything else they share. Both work on
//! positions in full precision: on the lattice small triangles degenerate. Where the sampling is regular, levels follow its rows, so
//! that what is left is regular again.

mod births;
mod bodies;
mod covering;
mod fours;
mod frame;
mod level;
mod lines;
mod metric;
mod moved;
mod nearest;
mod parity;
mod paths;
mod polygon;
mod quadric;
mod removal;
mod rows;
mod seams;
mod seconds;
mod shadow;
mod star;
mod values;

pub use births::Births;
pub use bodies::Bodies;
pub use covering::{LevelError, Traces};
pub use fours::Fours;
pub use moved::Moved;
pub use seams::Features;
pub use seconds::Seconds;
pub use values::Values;

use crate::error::{Error, Result};
use crate::limits::max_walked;
use crate::mesh::random::SplitMix64;
use crate::mesh::{CornerTable, Lattice};
use crate::refine::History;
use crate::refine::labels::Slid;
use births::{Components, Lack};
use bitvec::vec::BitVec;
use frame::{Frame, Places};
use level::Allowance;
use removal::{Kept, Remover, vertices};
use rows::{Pattern, Rows};
use seconds::timed;
use values::Corners;

/// How the next vertex is chosen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Method {
    /// [`Method::Ffc`] but [`Method::Stellar`] at levels that take the rows of a regular sampling where corners have no values: there a queue
    /// would take what is left in another order than that of the rows. Where levels neither follow rows nor have values, shape has three
    /// quarters of its weight.
    #[default]
    Auto,
    /// The best of [`Options::choices`] random vertices.
    Stellar,
    /// The best of all, by a priority queue.
    Ffc,
}

/// What levels make of a sampling whose vertices stand in rows. To follow rows saves many bytes of a file; a level that errors alone decide is
/// nearer to the input where it is bent unevenly.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Regular {
    /// Nothing: errors alone decide.
    Ignored,
    /// They follow its rows where it is regular nearly everywhere, and straight lines on parts of planes and cylinders.
    Followed,
    /// So they do, and where it is regular in parts they prefer its rows.
    #[default]
    Preferred,
}

/// Settings of a simplification.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// How the next vertex is chosen.
    pub method: Method,
    /// Weight of the distortion C(v), over the fourth power of the mean edge length.
    pub alpha: f64,
    /// Weight of the shape S(v), over the mean edge length round v; [`Method::Auto`] takes less of it where there are no rows.
    pub beta: f64,
    /// d, the number of random vertices that a choice of [`Method::Stellar`] compares; at least 1.
    pub choices: u32,
    /// Vertices to stop at; where not given [`default_base_vertices`], or up to an eighth more if the level before has no more.
    pub base_vertices: Option<usize>,
    /// Largest share of a level's vertices that the level may remove, above 0 and at most 1. No level removes more than half of the
    /// triangles.
    pub level_share: f64,
    /// Vertices are candidates of a level from the cheapest on, until the roots of their costs add up to this share of those of all:
    /// the larger, the fewer levels and the smaller the file; the smaller, the nearer each level to the input. 1 and more for all.
    pub level_budget: f64,
    /// What the rows of a regular sampling mean to levels.
    pub regular: Regular,
    /// Which components coarse levels may lack.
    pub births: Births,
    /// Seed of the random choices.
    pub seed: u64,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            method: Method::Auto,
            alpha: 0.75,
            beta: 0.02,
            choices: 8,
            base_vertices: None,
            level_share: 1.0,
            level_budget: 0.6,
            regular: Regular::Preferred,
            births: Births::None,
            seed: 0,
        }
    }
}

impl Options {
    /// Settings that lean to small files: levels as large as they may be.
    pub fn small() -> Self {
        Self { level_budget: 0.8, ..Self::default() }
    }

    /// Settings that lean to good levels: small ones, that take what is flat wherever it is, unless nearly all of the sampling is regular.
    pub fn fine() -> Self {
        Self { level_budget: 0.3, regular: Regular::Followed, ..Self::default() }
    }

    /// The same for a mesh of so many vertices whose corners have values.
    ///
    /// What coarse levels lack of values is seen sooner than what they lack of the surface, and costs bits: each new vertex's values are told
    /// by how far they are off those around it. So small levels pay, the cheapest vertices first, and rows do not where they are but preferred;
    /// and as values tell what a poor triangle shows, its shape counts for little. Rows make the file smaller that goes on to the input: who
    /// asks for a base of many vertices wants it for itself, and there they are of no use, for whole rows are taken across whatever is seen.
    fn for_values(&self, vertices: usize) -> Self {
        let is_large = |base: usize| base.saturating_mul(FEW) > vertices;
        let regular = match self.regular {
            _ if self.base_vertices.is_some_and(is_large) => Regular::Ignored,
            Regular::Preferred => Regular::Followed,
            regular => regular,
        };
        let method = if self.method == Method::Auto { Method::Ffc } else { self.method };
        let level_budget = self.level_budget.min(Self::fine().level_budget);
        Self { method, level_budget, beta: SHAPE_BESIDE_VALUES * self.beta, regular, ..self.clone() }
    }
}

/// A base and the way back.
#[derive(Debug)]
pub struct Simplified {
    /// The base, on the vertex numbers of the input.
    pub base: CornerTable,
    /// All removals.
    pub history: History,
    /// For each level, finest first, the base last, its distance from the input.
    pub errors: Vec<LevelError>,
    /// For each level what tells of its error once its vertices have moved.
    pub traces: Vec<Traces>,
    /// Of each vertex of the input a third of the area round it.
    pub weights: Vec<f32>,
    /// The mesh as it was given.
    pub input: CornerTable,
    /// Which of its vertices are of which body.
    pub bodies: Bodies,
    /// Whether levels followed the rows of a regular sampling or of straight walls, not only by preference.
    pub has_rows: bool,
    /// Whether the first level followed the rows of a regular sampling, or corners have values: what lies far from its place costs more there.
    pub lies_close: bool,
    /// The vertices that have gone onto others, in the order of the history.
    pub slid: Vec<Slid>,
    /// The coarsest level at which no triangle mixes charts; all coarser ones know but of those that are kept at all levels.
    pub charts_to: usize,
    /// Where the time went.
    pub seconds: Seconds,
}

/// Simplifies down to the base.
///
/// `locked` vertices stay, no triangle mixes charts of `features` unless these are given up, and its values are part of what a removal costs. `progress` is called with the vertices
/// removed so far and the vertices to remove; it returns whether to go on.
///
/// # Errors
/// [`Error::Cancelled`] where `progress` said so, [`Error::Parameter`] where `features` are not of this table.
pub fn simplify(
    table: CornerTable,
    positions: &[[f64; 3]],
    locked: BitVec,
    features: Features,
    lattice: &Lattice,
    options: &Options,
    progress: &mut dyn FnMut(u64, u64) -> bool,
) -> Result<Simplified> {
    let begin = std::time::Instant::now();
    let places = Places { positions, frame: Frame::new(lattice) };
    let mut components = Components::new(&table, &places, options.births);
    let Features { binding, values, bodies } = features;
    let corners = Corners::new(&table, values)?;
    let gives_up = !binding && corners.as_ref().is_some_and(Corners::have_charts);
    let has_values = corners.as_ref().is_some_and(Corners::vary);
    let options = &if has_values { options.for_values(vertices(&table).count()) } else { options.clone() };
    let mut remover = Remover::new(table, places, Kept { locked, gives_up, corners, bodies }, options);
    let start = remover.vertices;
    let held = remover.held();
    let target = |held: usize, held_now: usize| {
        let vertices = start - held + held_now;
        options.base_vertices.unwrap_or_else(|| default_base_vertices(vertices, held_now, has_values))
    };
    let first_target = target(held, held);
    let few = options.base_vertices.unwrap_or((start / FEW).max(LEAST));
    let mut target_now = first_target;
    let mut random = SplitMix64::new(options.seed);
    let mut report = |vertices: usize| {
        let done = (start - vertices) as u64;
        if progress(done, start.saturating_sub(first_target) as u64) { Ok(()) } else { Err(Error::Cancelled) }
    };
    let (mut errors, mut traces) = (Vec::<LevelError>::new(), Vec::new());
    let mut measure = |remover: &mut Remover, errors: &mut Vec<LevelError>| {
        let (error, seconds) = timed(|| remover.covering.error(&remover.table, &remover.places));
        errors.push(error);
        traces.push(remover.covering.traces(&remover.table, &remover.places, &error));
        remover.watch.seconds.measure += seconds;
    };
    measure(&mut remover, &mut errors);
    let mut rows = Rows::new(options.regular);
    let mut along_lines = options.regular != Regular::Ignored;
    let mut budget = options.level_budget;
    // Each level will be walked, and a file of many levels that hardly differ is refused (spec §3.6).
    let allowed = max_walked(remover.table.triangle_count().try_into().unwrap_or(u32::MAX));
    let (mut walked, mut has_rows, mut in_rows, mut is_first) = (0, false, false, true);
    let (mut thins, mut charts_to, mut is_stuck) = (false, None, false);
    while walked + remover.table.triangle_count() as u64 <= allowed {
        // A level most of whose vertices are where charts meet has little of the surface.
        if remover.has_charts() && (is_stuck || 2 * remover.at_corners() > remover.vertices) {
            remover.drop_charts();
            charts_to = Some(remover.history.level_count());
            budget = options.level_budget;
            target_now = target(held, remover.held());
        }
        let half = remover.table.triangle_count() / 2;
        let error = errors.last().map_or(0.0, |error| error.max) / remover.places.frame.length(1.0);
        let mut may_go_on = false;
        // A last level of a few vertices would hardly differ from the base, and take as much of the table as another.
        if options.base_vertices.is_none() && remover.vertices <= most_base_vertices(target_now) {
            target_now = remover.vertices;
        }
        if remover.vertices > target_now {
            let size = error * error;
            let gone = components.leave(&mut remover, Lack { size, triangles: half, vertices: usize::MAX });
            let share = (remover.vertices as f64 * options.level_share) as usize;
            let quota = share.max(1).min(remover.vertices.saturating_sub(target_now));
            along_lines = along_lines && remover.follow_lines();
            if along_lines {
                // What remains of walls without their rows is no sampling of a surface.
                rows.end();
            }
            let pattern = rows.next_level(&mut remover);
            // None of the cheap ones may go, but another.
            may_go_on = budget < 1.0 || pattern.is_some() || along_lines;
            let follows = pattern.as_ref().is_some_and(Pattern::is_exact);
            has_rows |= follows || along_lines;
            in_rows |= is_first && follows;
            if is_first && !in_rows && options.method == Method::Auto {
                remover.weigh_shape(SHAPE_WITHOUT_ROWS);
            }
            is_first = false;
            remover.begin_level(pattern);
            if quota > 0 {
                let wanted = if has_values { remover.vertices - target_now } else { usize::MAX };
                let allowance = Allowance { quota, budget, gone, wanted };
                level::remove_level(&mut remover, allowance, options, &mut random, &mut report)?;
            }
        }
        let mut has_level = remover.history.end_level();
        let is_over = !has_level && !may_go_on;
        is_stuck = is_over && remover.has_charts() && remover.vertices > target_now;
        // Only where there are far too many: the base is not to lose a large part for a few vertices.
        thins |= is_over && !is_stuck && remover.vertices > few.saturating_mul(2);
        if is_over && !is_stuck && thins && remover.vertices > few {
            let size = components.smallest().map_or(0.0, |size| size.max(error * error) * GROWTH * GROWTH);
            let lack = Lack { size, triangles: half, vertices: remover.vertices - few };
            components.leave(&mut remover, lack);
            has_level = remover.history.end_level();
        }
        if has_level {
            target_now = target(held, remover.held());
            budget = options.level_budget;
            walked += remover.table.triangle_count() as u64;
            measure(&mut remover, &mut errors);
        } else if may_go_on {
            budget = 1.0;
            rows.end();
            along_lines = false;
            remover.end_lines();
        } else if !is_stuck {
            break;
        }
    }
    report(remover.vertices)?;
    let seconds = remover.watch.finish(begin.elapsed().as_secs_f64());
    let Remover { table: base, mut history, slid, covering, .. } = remover;
    history.shrink_to_fit();
    let (weights, input, bodies) = covering.into_parts();
    let charts_to = charts_to.unwrap_or(history.level_count());
    let lies_close = in_rows || has_values;
    Ok(Simplified {
        base,
        history,
        errors,
        traces,
        weights,
        input,
        bodies,
        has_rows,
        lies_close,
        slid,
        charts_to,
        seconds,
    })
}

/// What of the weight of shape is left where there are no rows: round triangles let levels be coded in fewer bytes, most of all of rows.
const SHAPE_WITHOUT_ROWS: f64 = 0.75;
/// What of the weight of shape is left where there are values: enough to choose between triangulations that show the same, not to let a vertex
/// go before one whose absence shows less.
const SHAPE_BESIDE_VALUES: f64 = 0.1;
/// Vertices of the input for each that a base may have before components are left out of it that are larger than its error, or it is a large
/// one.
const FEW: usize = 50;
/// So many it may have anyway.
const LEAST: usize = 150;
/// How much larger the components are that such a level lacks than those that the level before lacks, or than its error.
const GROWTH: f64 = 1.5;

/// Vertices to stop at for a mesh of so many vertices, some of them locked, where [`Options::base_vertices`] is not given: however many
/// are locked, as many others stay as of a mesh of the others, for locked ones lie where they must and tell nothing of what is between. Where
/// corners have values that vary a vertex of the base takes twice the bytes, and of a small mesh fewer stay: the base is to be a small
/// share of the file.
pub fn default_base_vertices(vertices: usize, locked: usize, has_values: bool) -> usize {
    let free = vertices.saturating_sub(locked);
    let least = if has_values { (free / FEW_WITH_VALUES).clamp(LEAST / 3, LEAST) } else { LEAST };
    locked + (free / 200).max(least)
}

/// Vertices of the input for each that stays in such a base.
const FEW_WITH_VALUES: usize = 32;

/// Vertices that a base may have where so many are to stop at by themselves: what is above would be a level of fewer than one in eight.
pub fn most_base_vertices(target: usize) -> usize {
    target + target / 8
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes;
    use bitvec::bitvec;

    fn simplified(mesh: &crate::mesh::IndexedMesh, options: &Options) -> (CornerTable, Simplified) {
        let table = CornerTable::from_triangles(mesh.positions.len(), &mesh.triangles).unwrap();
        let (min, max) = crate::mesh::lattice::bounds(mesh.positions.iter().copied()).unwrap();
        let lattice = Lattice::over(min, max, 14);
        let locked = bitvec![0; mesh.positions.len()];
        let done = simplify(
            table.clone(),
            &mesh.positions,
            locked,
            Features::default(),
            &lattice,
            options,
            &mut |_, _| true,
        );
        (table, done.unwrap())
    }

    #[test]
    fn no_level_more_than_doubles_the_triangles() {
        for mesh in [shapes::torus(24, 36), shapes::annulus(300), shapes::bumpy_sphere(4, 3)] {
            for options in [Options::default(), Options::small(), Options::fine()] {
                for method in [Method::Stellar, Method::Ffc] {
                    let options = Options { method, base_vertices: Some(20), ..options };
                    let (mut table, done) = simplified(&mesh, &options);
                    for j in 0..done.history.level_count() {
                        let before = table.triangle_count();
                        done.history.undo_level(&mut table, j).unwrap();
                        assert!(
                            2 * table.triangle_count() >= before,
                            "{before} to {}",
                            table.triangle_count()
                        );
                    }
                    // Places have been given back on the way; order and corners are as they were.
                    let mut base = done.base;
                    table.close_up();
                    base.close_up();
                    assert_eq!(table, base);
                    assert_eq!(done.errors.len(), done.history.level_count() + 1);
                }
            }
        }
    }

    /// A prism of eight sides, cut into many triangles, with a lid at either end.
    fn prism() -> crate::mesh::IndexedMesh {
        let (sides, rows, parts) = (8u32, 40u32, 3u32);
        let around = sides * parts;
        let corner = |k: u32| {
            let angle = f64::from(k) * std::f64::consts::TAU / f64::from(sides);
            [angle.cos(), angle.sin()]
        };
        let mut positions = Vec::new();
        for row in 0..=rows {
            for i in 0..around {
                let (a, b) = (corner(i / parts), corner(i / parts + 1));
                let t = f64::from(i % parts) / f64::from(parts);
                positions.push([a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), f64::from(row) * 0.1]);
            }
        }
        let ends = positions.len() as u32;
        positions.extend([[0.0, 0.0, 0.0], [0.0, 0.0, f64::from(rows) * 0.1]]);
        let mut triangles = Vec::new();
        for i in 0..around {
            let next = (i + 1) % around;
            for row in 0..rows {
                let [a, b, c, d] =
                    [(row, i), (row, next), (row + 1, i), (row + 1, next)].map(|(r, k)| r * around + k);
                // Diagonals in no order.
                if (7 * i + 5 * row) % 3 == 0 {
                    triangles.extend([[a, b, d], [a, d, c]]);
                } else {
                    triangles.extend([[a, b, c], [b, d, c]]);
                }
            }
            triangles.extend([[next, i, ends], [rows * around + i, rows * around + next, ends + 1]]);
        }
        crate::mesh::IndexedMesh::new(positions, triangles)
    }

    /// What consists of planes is the same with 40 vertices as with 1,000: no face is cut off, no triangle stands out.
    #[test]
    fn a_prism_stays_a_prism() {
        let mesh = prism();
        let (_, done) = simplified(&mesh, &Options { base_vertices: Some(40), ..Options::default() });
        let error = done.errors.last().unwrap();
        assert!(done.base.vertex_slots() > 900 && removal::vertices(&done.base).count() == 40);
        // Rounding to 14 bits of 4 units.
        assert!(error.max < 3e-4, "{error:?}");
    }

    /// No level is made of the last few vertices, but where a base of so many is asked for.
    #[test]
    fn the_last_level_is_no_small_one() {
        let mesh = shapes::sphere(2);
        let levels = |base_vertices: Option<usize>| {
            let (_, done) = simplified(&mesh, &Options { base_vertices, ..Options::default() });
            (removal::vertices(&done.base).count(), done.history.level_count())
        };
        assert!((150..162).contains(&default_base_vertices(162, 0, false)));
        assert_eq!(levels(None), (162, 0));
        assert_eq!(levels(Some(150)), (150, 1));
    }

    /// Locked vertices are no part of what a base is made of.
    #[test]
    fn however_many_are_locked_others_stay() {
        let mesh = shapes::torus(24, 36);
        let table = CornerTable::from_triangles(mesh.positions.len(), &mesh.triangles).unwrap();
        let (min, max) = crate::mesh::lattice::bounds(mesh.positions.iter().copied()).unwrap();
        let locked: BitVec = (0..mesh.positions.len()).map(|v| v % 4 == 0).collect();
        let held = locked.count_ones();
        assert!(held > 200);
        let done = simplify(
            table,
            &mesh.positions,
            locked,
            Features::default(),
            &Lattice::over(min, max, 14),
            &Options::default(),
            &mut |_, _| true,
        );
        assert_eq!(removal::vertices(&done.unwrap().base).count(), held + 150);
    }

    #[test]
    fn times_are_told_apart() {
        let (_, done) = simplified(
            &shapes::bumpy_sphere(4, 1),
            &Options { base_vertices: Some(50), ..Options::default() },
        );
        assert!(done.seconds.cost > 0.0 && done.seconds.assign > 0.0);
        assert!(done.seconds.parts().iter().all(|(_, seconds)| *seconds >= 0.0));
    }
}
