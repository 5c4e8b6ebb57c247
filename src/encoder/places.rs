//! Where the vertices of all levels are: level 0's on the lattice, those of coarser ones lifted (spec §5.4.5) and less precise (spec §5.6).
//!
//! What a split moves can be told from where it has moved it. So the levels are gone through from fine to coarse, the splits of each in
//! the reverse of the order in which a decoder will come to them; and that order follows from the walks of the levels, from coarse to fine.

use super::Options;
use super::options::{LIFTING, LIFTING_OF_ROWS};
use super::schedule::Schedule;
use crate::codec::lift::{Cells, plus};
use crate::codec::walk::Walk;
use crate::error::Result;
use crate::mesh::distance::point_triangle_distance_squared;
use crate::mesh::{CornerTable, Lattice, Vertex};
use crate::refine::{History, Operation, ProgressiveMesh, Roots, Site, from_cell};
use crate::simplify::{LevelError, Moved, Simplified, Traces};
use glam::DVec3;

/// The places, by vertex, and the cells, by level.
#[derive(Debug)]
pub struct Places {
    /// Where the split puts it that inserts it, or where the base has it; at full scale.
    pub born: Vec<[i32; 3]>,
    /// The bits that precision passes tell of it.
    pub lost: Vec<[i32; 3]>,
    /// How far splits move the ends of their edges, in 64ths.
    pub lifting: u8,
    /// The lattice's step, in the input's units.
    pub step: f64,
    bits: u32,
    /// The shifts of the levels, by number.
    shifts: Vec<u32>,
}

/// How far off a level is.
#[derive(Clone, Copy, Debug)]
struct Change {
    /// The largest distance, at most, in steps of the lattice.
    max: f64,
    /// The mean squared distance over what it was.
    squares: f64,
    /// The mean distance of the input's vertices, in steps of the lattice.
    mean: f64,
}

impl Places {
    /// Finds them, for the base with all vertices where level 0 has them; puts the base's where they belong, and the levels' errors right.
    ///
    /// # Errors
    /// [`Error::Memory`](crate::Error::Memory) where there is none for the mesh.
    pub fn of_all_levels(
        base: &mut ProgressiveMesh,
        simplified: &mut Simplified,
        lattice: &Lattice,
        options: &Options,
    ) -> Result<Self> {
        let finest = std::mem::take(&mut base.positions);
        let traces = std::mem::take(&mut simplified.traces);
        let usual = if simplified.lies_close { LIFTING_OF_ROWS } else { LIFTING };
        let wanted = options.lifting.unwrap_or(usual);
        let mut lifting = if lattice.bits < Lattice::MAX_BITS { wanted } else { 0 };
        let splits = if lifting > 0 { splits(&simplified.history, base)? } else { Vec::new() };
        let mut moved = (lifting > 0).then(|| {
            let input = std::mem::take(&mut simplified.input);
            Moved::new(input, std::mem::take(&mut simplified.bodies), &finest, lattice.bits)
        });
        let (places, changes) = loop {
            let schedule = Schedule::new(options, lattice, lifting > 0);
            let mut places = Self {
                born: finest.clone(),
                lost: Vec::new(),
                lifting,
                step: lattice.step,
                bits: lattice.bits,
                shifts: vec![0; simplified.history.level_count() + 1],
            };
            let moved = moved.as_mut().filter(|_| lifting > 0);
            match places.coarsen(&finest, simplified, &splits, &traces, schedule, moved) {
                // On thin walls and steps what is above an edge is not what the surface does beside it: then levels stay as they are.
                Some(changes) if lifting > 0 && leads_away(&changes) => lifting = 0,
                Some(changes) => break (places, changes),
                // A mesh of few vertices may be lifted beyond the margin: then less of it is.
                None => lifting /= 2,
            }
        };
        let changes = if lifting > 0 { changes } else { Vec::new() };
        for ((error, traces), change) in simplified.errors.iter_mut().zip(&traces).zip(changes) {
            if change.max > 0.0 {
                error.max = change.max * lattice.step;
            }
            // What is missing is not lifted.
            let there = (error.rms * error.rms - traces.missing).max(0.0);
            error.rms = if traces.missing > 0.0 {
                (there * change.squares + traces.missing).sqrt()
            } else {
                error.rms * change.squares.sqrt()
            };
        }
        drop(moved);
        base.positions = finest;
        base.positions.copy_from_slice(&places.born);
        Ok(places)
    }

    /// The side of the cells that the vertices of a level are somewhere in, less a step; in the input's units.
    pub fn blur_of(&self, level: usize) -> f64 {
        match self.shifts[level] {
            0 => 0.0,
            precision => f64::from((1u32 << precision) - 1) * self.step,
        }
    }

    /// The root mean square error of a level, of which `error` tells but for what precision it lacks.
    pub fn rms_error(&self, error: &LevelError, level: usize) -> f64 {
        let cell = self.blur_of(level);
        (error.rms * error.rms + cell * cell * 0.25).sqrt()
    }

    /// The cells of a level.
    pub fn cells(&self, level: usize) -> Cells {
        Cells { bits: self.bits, precision: self.shifts[level], lifting: self.lifting }
    }

    /// Goes from level 0 to the base; `None` where a vertex leaves the margin.
    fn coarsen(
        &mut self,
        finest: &[[i32; 3]],
        simplified: &Simplified,
        splits: &[Vec<Split>],
        traces: &[Traces],
        schedule: Schedule,
        mut moved: Option<&mut Moved<'_>>,
    ) -> Option<Vec<Change>> {
        let mut gone = vec![false; finest.len()];
        let mut changes = Vec::new();
        for (j, traces) in traces.iter().enumerate() {
            let change = self.change(finest, traces, &simplified.weights, &gone, moved.as_deref_mut());
            changes.push(change);
            if j > 0 {
                self.shifts[j] = schedule.shift(j, change.mean, self.shifts[j - 1]);
                self.blur(j, &gone)?;
            }
            let cells = self.cells(j);
            let operations = simplified.history.level(j);
            for split in splits.get(j).into_iter().flatten().rev() {
                let (vertex, [a, b, c, d]) = split.of(operations);
                let at = |v: Vertex| self.born[v.index()];
                let by = cells.lift([a, b, c, d].map(at), at(vertex));
                for w in [a, b, vertex] {
                    let place = plus(self.born[w.index()], by);
                    if !cells.hold_position(place) {
                        return None;
                    }
                    self.born[w.index()] = place;
                }
            }
            for operation in operations {
                gone[operation.vertex.index()] = true;
            }
            for v in simplified.history.birth(j).into_iter().flat_map(|birth| &birth.vertices) {
                gone[v.index()] = true;
            }
        }
        Some(changes)
    }

    /// Takes from the vertices of a level the bits that it lacks beside the next finer one.
    fn blur(&mut self, level: usize, gone: &[bool]) -> Option<()> {
        let [from, to] = [level - 1, level].map(|j| self.cells(j));
        if from.precision == to.precision {
            return Some(());
        }
        self.lost.resize(self.born.len(), [0; 3]);
        let there = self.born.iter_mut().zip(&mut self.lost).zip(gone).filter(|(_, gone)| !**gone);
        for ((place, lost), _) in there {
            // Bits that had been lost before stand below those that are lost now.
            let low = (1 << from.precision) - 1;
            *lost = [0, 1, 2].map(|k| lost[k] & low | place[k] & !low);
            *place = place.map(|x| from_cell(x >> to.precision, to.precision));
            if !to.hold_position(*place) {
                return None;
            }
        }
        Some(())
    }

    /// How far the level as it stands is from the input, beside the one of the same triangles with all vertices where level 0 has them.
    fn change(
        &self,
        finest: &[[i32; 3]],
        traces: &Traces,
        weights: &[f32],
        gone: &[bool],
        moved: Option<&mut Moved>,
    ) -> Change {
        let point = |p: [i32; 3]| DVec3::from_array(p.map(f64::from));
        let (mut before, mut after, mut mean, mut total) = (0.0, 0.0, 0.0, 0.0);
        for (k, [vertex, a, b, c]) in traces.probes.iter().enumerate() {
            let outline = traces.outline.get(k).copied().unwrap_or(0.0);
            let p = point(finest[vertex.index()]);
            let squared = |places: &[[i32; 3]]| {
                let [a, b, c] = [a, b, c].map(|v| point(places[v.index()]));
                point_triangle_distance_squared(p, a, b, c).max(outline.into())
            };
            let weight = f64::from(weights[vertex.index()]);
            let now = squared(&self.born);
            before += weight * squared(finest);
            after += weight * now;
            mean += weight * now.sqrt();
            total += weight;
        }
        // No point of a triangle has moved farther than its corners.
        let apart = |v: usize| point(finest[v]).distance_squared(point(self.born[v]));
        let farthest = (0..gone.len()).filter(|&v| !gone[v]).map(apart).fold(0.0, f64::max).sqrt();
        let max = moved.map_or(traces.most, |moved| moved.error(traces, &self.born, farthest));
        // What a lattice moves at random is in both.
        let rounding = total / 12.0;
        let (squares, mean) =
            if total > 0.0 { ((after + rounding) / (before + rounding), mean / total) } else { (1.0, 0.0) };
        Change { max, squares, mean }
    }
}

/// Whether levels are farther from the input than they would be without lifting, in the geometric mean over the levels.
fn leads_away(changes: &[Change]) -> bool {
    // A product of the squares, which spares logarithms: each is kept from being zero or infinite, and so is it on the way.
    let product = changes
        .iter()
        .fold(1.0f64, |product, change| (product * change.squares.clamp(1e-3, 1e3)).clamp(1e-200, 1e200));
    product > 1.0
}

/// A split of an interior edge that moves its ends.
#[derive(Clone, Copy, Debug)]
struct Split {
    /// Its number among the operations of its level, twice; one more where the walk has the edge the other way round.
    operation: u32,
    /// The vertices on the left and on the right of the edge, as the walk has it.
    wings: [Vertex; 2],
}

impl Split {
    /// Its vertex; the ends of the edge, as the walk has it, and the wings.
    fn of(&self, operations: &[Operation]) -> (Vertex, [Vertex; 4]) {
        let Operation { vertex, site, .. } = operations[self.operation as usize / 2];
        let (Site::Edge(a, b) | Site::Face(a, b, _) | Site::Attach(a, b)) = site;
        let [a, b] = if self.operation.is_multiple_of(2) { [a, b] } else { [b, a] };
        (vertex, [a, b, self.wings[0], self.wings[1]])
    }
}

/// The splits of each level that move the ends of their edges, in the order of the level's walk.
///
/// # Errors
/// [`Error::Memory`](crate::Error::Memory) where there is none for the mesh.
fn splits(history: &History, base: &ProgressiveMesh) -> Result<Vec<Vec<Split>>> {
    let mut mesh =
        ProgressiveMesh { table: base.table.clone(), positions: Vec::new(), roots: base.roots.clone() };
    mesh.make_room([0, history.most_triangles(base.table.slots())])?;
    let mut levels = vec![Vec::new(); history.level_count()];
    for j in (0..levels.len()).rev() {
        levels[j] = of_level(history, j, &mesh.table, &mesh.roots);
        for operation in history.level(j) {
            operation
                .apply(&mut mesh.table, history.flips(operation))
                .expect("the history leads back from the base");
            let (Site::Edge(beside, _) | Site::Face(beside, ..) | Site::Attach(beside, _)) = operation.site;
            mesh.roots.mend(&mesh.table, operation.vertex, beside);
        }
        if let Some(birth) = history.birth(j) {
            mesh.join(&birth.table, &Roots::choose(&birth.table), |v| birth.name(v));
        }
    }
    Ok(levels)
}

fn of_level(history: &History, j: usize, table: &CornerTable, roots: &Roots) -> Vec<Split> {
    let mut of_triangle = vec![u32::MAX; table.slots()];
    for (number, operation) in (0..).zip(history.level(j)) {
        let Site::Edge(a, b) = operation.site else { continue };
        if table.is_boundary(a) || table.is_boundary(b) {
            continue;
        }
        let k = table.find_directed_edge(a, b);
        for c in [k, table.opposite(k)] {
            of_triangle[c.triangle().index()] = number;
        }
    }
    let mut splits = Vec::with_capacity(history.level(j).len());
    for &k in &Walk::new(table, roots).edges {
        let o = table.opposite(k);
        if o.is_none() {
            continue;
        }
        // No two splits have a triangle in common: the edge is split where both triangles belong to the same one.
        let number = of_triangle[k.triangle().index()];
        if number != u32::MAX && number == of_triangle[o.triangle().index()] {
            let turned =
                history.level(j)[number as usize].site != Site::Edge(table.edge(k).0, table.edge(k).1);
            let operation = 2 * number + u32::from(turned);
            splits.push(Split { operation, wings: [k, o].map(|c| table.vertex(c)) });
        }
    }
    splits.shrink_to_fit();
    splits
}
