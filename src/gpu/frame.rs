//! One view: the steps of an iteration as one submission, and after it a look at the counts.

use super::Loaded;
use super::buffers::{COUNTS, NEXT, PARAMS};
use super::kernels::{Items, Kernel};
use crate::error::Result;
use crate::reduce::removal::{
    Guard, Iteration, Options, Patience, Rule, Settled, Sight, Simplified, Steps, iterate,
};

/// Simplifies for a view, or as far as can be.
///
/// # Errors
/// [`crate::Error::Io`] where the GPU fails.
pub(super) fn run(loaded: &Loaded, sight: Option<Sight>, options: Options) -> Result<Simplified> {
    let Items { vertices, triangles } = loaded.buffers.items;
    if triangles == 0 {
        return Ok(Simplified::default());
    }
    let mut frame = Frame { loaded, sight, options, present: 0, triangles, next: 0, settled: None };
    let iterations = iterate(&mut frame, vertices as usize)?;
    let triangles = match frame.present {
        0 => loaded.surface.triangles().to_vec(),
        _ => frame.download()?,
    };
    Ok(Simplified { triangles, iterations })
}

/// What goes with one view.
struct Frame<'a> {
    loaded: &'a Loaded<'a>,
    sight: Option<Sight>,
    options: Options,
    /// Which of the meshes is the present one, and its triangles.
    present: usize,
    triangles: u32,
    /// Those of the mesh that has been made.
    next: u32,
    /// What came of the first round, which goes with the proposal.
    settled: Option<Settled>,
}

impl Frame<'_> {
    /// Does some steps; the counts after them.
    fn submit(
        &self,
        iteration: u32,
        patience: Patience,
        steps: impl Iterator<Item = Kernel>,
        proposes: bool,
    ) -> Result<[u32; COUNTS]> {
        let Loaded { gpu, buffers, .. } = self.loaded;
        let (device, queue) = (&gpu.device.device, &gpu.device.queue);
        queue.write_buffer(&buffers.params, 0, bytemuck::cast_slice(&self.params(iteration, patience)));
        let mut encoder = device.create_command_encoder(&Default::default());
        let vertices = u64::from(buffers.items.vertices);
        let cleared = if proposes { 0 } else { 4 * (vertices + KEPT_COUNTS) };
        encoder.clear_buffer(&buffers.marks, cleared, None);
        encoder.clear_buffer(&buffers.rings[NEXT[self.present]], 0, Some(4 * (vertices + 1)));
        {
            let mut pass = encoder.begin_compute_pass(&Default::default());
            pass.set_bind_group(0, &buffers.steps[self.present], &[]);
            let items = Items { triangles: self.triangles, ..buffers.items };
            for kernel in steps {
                gpu.kernels.dispatch(&mut pass, kernel, items, buffers.row);
            }
        }
        encoder.copy_buffer_to_buffer(
            &buffers.marks,
            4 * vertices,
            &buffers.counts,
            0,
            Some(4 * COUNTS as u64),
        );
        queue.submit([encoder.finish()]);
        let counts = gpu.device.read(buffers.counts.slice(..4 * COUNTS as u64))?;
        Ok(std::array::from_fn(|k| counts.get(k).copied().unwrap_or_default()))
    }

    /// As `mesh.wgsl` has them.
    fn params(&self, iteration: u32, patience: Patience) -> [u32; PARAMS] {
        let patience = match patience {
            Patience::Dearest => 0,
            Patience::All => 1,
            Patience::Still => 2,
        };
        let rule = match self.options.rule {
            Rule::Of2015 => 0,
            Rule::Of2016 => 1,
        };
        let guard = match self.options.guard {
            Guard::Veto => 0,
            Guard::Blind => 1,
            Guard::Independent => 2,
        };
        let [is_seen, slope] = self.sight.map_or([0; 2], |sight| [1, sight.slope]);
        let [eye, forward] = self.sight.map_or([[0; 3]; 2], |sight| [sight.eye, sight.forward]);
        let [x, y, z] = eye.map(|x| x as u32);
        let [p, q, r] = forward.map(|x| x as u32);
        let cosine = self.sight.map_or(0, |sight| sight.cosine as u32);
        let vertices = self.loaded.buffers.items.vertices;
        [
            [vertices, self.triangles, iteration, patience],
            [rule, guard, is_seen, slope],
            [x, y, z, 0],
            [p, q, r, cosine],
        ]
        .as_flattened()
        .try_into()
        .unwrap_or_default()
    }

    fn settle_by(
        &mut self,
        iteration: u32,
        patience: Patience,
        before: &[Kernel],
        proposes: bool,
    ) -> Result<(Iteration, Settled)> {
        let steps = before.iter().chain(SETTLE).copied();
        let [candidates, proposed, moving, disputed, next] =
            self.submit(iteration, patience, steps, proposes)?;
        self.next = next;
        let iteration =
            Iteration { candidates: candidates as usize, proposed: proposed as usize, removed: 0 };
        Ok((iteration, Settled { moving: moving as usize, is_disputed: disputed != 0 }))
    }

    /// The triangles of the present mesh.
    fn download(&self) -> Result<Vec<[u32; 3]>> {
        let Loaded { gpu, buffers, .. } = self.loaded;
        let size = 16 * u64::from(self.triangles);
        let mut encoder = gpu.device.device.create_command_encoder(&Default::default());
        encoder.copy_buffer_to_buffer(&buffers.meshes[self.present], 0, &buffers.triangles, 0, Some(size));
        gpu.device.queue.submit([encoder.finish()]);
        let words = gpu.device.read(buffers.triangles.slice(..size))?;
        Ok(words.as_chunks().0.iter().map(|&[a, b, c, _]| [a, b, c]).collect())
    }
}

impl Steps for Frame<'_> {
    fn propose(&mut self, iteration: u32) -> Result<Iteration> {
        let guard = match self.options.guard {
            Guard::Veto => Some(Kernel::Veto),
            Guard::Blind => None,
            Guard::Independent => Some(Kernel::Compare),
        };
        let steps: Vec<Kernel> = PROPOSE.iter().copied().chain(guard).collect();
        let (counted, settled) = self.settle_by(iteration, Patience::Dearest, &steps, true)?;
        self.settled = Some(settled);
        Ok(counted)
    }

    fn veto(&mut self, _iteration: u32) -> Result<()> {
        // It went with the proposal.
        Ok(())
    }

    fn settle(&mut self, iteration: u32, patience: Patience) -> Result<Settled> {
        match self.settled.take() {
            Some(settled) if patience == Patience::Dearest => Ok(settled),
            _ => Ok(self.settle_by(iteration, patience, &[], false)?.1),
        }
    }

    fn accept(&mut self) -> Result<()> {
        self.present = NEXT[self.present];
        self.triangles = self.next;
        Ok(())
    }
}

/// From a mesh to where its vertices would go.
const PROPOSE: &[Kernel] = &[Kernel::Classify, Kernel::FindNear, Kernel::FindCandidates, Kernel::Propose];

/// From moves to the next mesh, and the look at it.
const SETTLE: &[Kernel] = &[
    Kernel::FindMoving,
    Kernel::FindLeft,
    Kernel::AddLeft,
    Kernel::AddLeftSums,
    Kernel::SpreadLeft,
    Kernel::Gather,
    Kernel::AddRings,
    Kernel::AddRingSums,
    Kernel::SpreadRings,
    Kernel::FillRings,
    Kernel::Check,
];

/// Counts that a further round does not change.
const KEPT_COUNTS: u64 = 2;
