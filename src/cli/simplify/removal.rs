//! Vertices removed one by one, as the encoder does it: those that stay keep their positions.

use super::{Limit, Outcome, SAMPLES, distance};
use crate::cli::args::{Method, Removal};
use crate::cli::numbers::count;
use crate::cli::progress::Progress;
use anyhow::{anyhow, bail};
use std::time::Instant;
use unweld::encoder::Profile;
use unweld::mesh::topology::{Conditioned, condition};
use unweld::mesh::{CornerTable, IndexedMesh, Lattice, Vertex, lattice};
use unweld::refine::{History, OperationError};
use unweld::simplify::{self, Features, Regular, Simplified};

/// Removes vertices as far as the limit allows.
pub(super) fn simplified(
    input: &IndexedMesh,
    limit: Limit,
    method: Method,
    removal: &Removal,
    progress: &mut Progress,
) -> anyhow::Result<Outcome> {
    let start = Instant::now();
    let conditioned = &condition(input, removal.weld);
    let seconds = start.elapsed().as_secs_f64();
    let mesh = removed(input, conditioned, limit, method, removal, progress)?;
    Ok(Outcome {
        mesh,
        left_out: left_out(conditioned),
        joined_vertices: conditioned.report.joined_vertices,
        conditioning: seconds,
        obstacle: "no further vertex can go".to_owned(),
        passes: None,
        remarks: Vec::new(),
        frames: Vec::new(),
    })
}

fn removed(
    input: &IndexedMesh,
    conditioned: &Conditioned,
    limit: Limit,
    method: Method,
    removal: &Removal,
    progress: &mut Progress,
) -> anyhow::Result<IndexedMesh> {
    let table = &conditioned.manifold.table;
    let triangles = table.triangle_count();
    let used = conditioned.manifold.positions.iter().copied();
    let Some((min, max)) = lattice::bounds(used).filter(|_| triangles > 0) else {
        bail!("no triangle is left: all are degenerate");
    };
    let lattice = Lattice::over(min, max, Lattice::MAX_BITS);
    if !lattice.step.is_finite() {
        bail!("the mesh is larger than the largest number: its extent is infinite");
    }
    let least = match limit {
        Limit::Triangles(most) if triangles <= most => return Ok(sewn(table, conditioned)),
        // A vertex takes two triangles with it, or one where it was on the boundary, whose vertices are as many as its edges.
        Limit::Triangles(most) => {
            let surplus = triangles - most;
            let removals = (surplus + conditioned.report.census.boundary_edges).div_ceil(2).min(surplus);
            conditioned.manifold.positions.len().saturating_sub(removals)
        }
        Limit::Error(_) => 0,
    };
    let locked = if removal.lock_boundary {
        conditioned.manifold.locked_with_boundary()
    } else {
        conditioned.manifold.locked.clone()
    };
    // No bytes are to be saved here.
    let regular = Regular::Ignored;
    let options = simplify::Options { regular, ..removal.options(method, Profile::Default, Some(least)) };
    let mut tell = |done, total| {
        progress.update("simplify", done, total);
        true
    };
    let Simplified { base, history, .. } = simplify::simplify(
        table.clone(),
        &conditioned.manifold.positions,
        locked,
        Features::default(),
        &lattice,
        &options,
        &mut tell,
    )?;
    let mut way = Way { applied: 0, table: base, history };
    match limit {
        Limit::Triangles(most) => way.refine_while(|table| table.triangle_count() <= most)?,
        Limit::Error(most) => {
            way.refine_until(progress, |table| {
                let mesh = sewn(table, conditioned);
                // The vertices alone refuse most of what does not fit.
                let near = |samples| distance(input, &mesh, samples).is_some_and(|d| d.max <= most);
                [0, SAMPLES].into_iter().all(near)
            })?;
        }
    }
    Ok(sewn(&way.table, conditioned))
}

/// A mesh on the way from the base back to the input.
struct Way {
    table: CornerTable,
    history: History,
    /// Operations between the base and the mesh.
    applied: usize,
}

impl Way {
    /// To the last mesh that fits, when all before it do.
    fn refine_while(&mut self, fits: impl Fn(&CornerTable) -> bool) -> anyhow::Result<()> {
        while self.applied < self.history.operations().len() {
            self.go(self.applied + 1)?;
            if !fits(&self.table) {
                return self.go(self.applied - 1);
            }
        }
        Ok(())
    }

    /// To a mesh that fits, with as few operations as bisection finds; to all of them where it finds none.
    fn refine_until(
        &mut self,
        progress: &mut Progress,
        fits: impl Fn(&CornerTable) -> bool,
    ) -> anyhow::Result<()> {
        let all = self.history.operations().len();
        // Those that do not fit are below `low`, and `high` fits, if any does.
        let (mut low, mut high, mut steps) = (0, all, 0);
        while high - low > high / FINENESS {
            self.go((low + high) / 2)?;
            if fits(&self.table) {
                high = self.applied;
            } else {
                low = self.applied + 1;
            }
            steps += 1;
            progress.update("measure", steps, steps + u64::from((high - low).max(1).ilog2()));
        }
        self.go(high)
    }

    /// Applies or undoes operations until so many are applied.
    fn go(&mut self, to: usize) -> anyhow::Result<()> {
        let operations = self.history.operations();
        let told = |e: OperationError| anyhow!("{e}");
        // They were recorded in the order of removal.
        while self.applied < to {
            let operation = &operations[operations.len() - 1 - self.applied];
            operation.apply(&mut self.table, self.history.flips(operation)).map_err(told)?;
            self.applied += 1;
        }
        while self.applied > to {
            let operation = &operations[operations.len() - self.applied];
            operation.undo(&mut self.table, self.history.flips(operation)).map_err(told)?;
            self.applied -= 1;
        }
        Ok(())
    }
}

/// Positions and triangles, with the copies of cut vertices sewn together: they are all still there.
fn sewn(table: &CornerTable, conditioned: &Conditioned) -> IndexedMesh {
    let mut first: Vec<Vertex> = (0..table.vertex_slots() as u32).map(Vertex).collect();
    for group in &conditioned.remainder.stitches {
        for &copy in group {
            first[copy.index()] = group[0];
        }
    }
    let mut names = vec![u32::MAX; first.len()];
    let mut mesh = IndexedMesh::default();
    for t in table.triangles() {
        let triangle = table.triangle(t).map(|v| {
            let v = first[v.index()];
            let name = &mut names[v.index()];
            if *name == u32::MAX {
                *name = mesh.positions.len() as u32;
                mesh.positions.push(conditioned.manifold.positions[v.index()]);
            }
            *name
        });
        mesh.triangles.push(triangle);
    }
    mesh
}

/// What conditioning set aside: no manifold holds it.
fn left_out(conditioned: &Conditioned) -> Vec<String> {
    let report = &conditioned.report;
    let counts = [
        (report.degenerate_triangles, "degenerate triangle"),
        (report.repeated_triangles, "repeated triangle"),
        (report.isolated_vertices, "isolated vertex"),
    ];
    counts.iter().filter(|(n, _)| *n > 0).map(|(n, noun)| count(*n as u64, noun)).collect()
}

/// A search ends once one part of so many is left in which to look.
const FINENESS: usize = 256;
