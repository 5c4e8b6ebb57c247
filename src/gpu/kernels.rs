//! The shaders, each with the number of its items, and how they are handed to the device.

use wgpu::{
    BindGroup, BindGroupLayout, BindGroupLayoutEntry, BindingType, Buffer, BufferBindingType, ComputePass,
    ComputePipeline, Device, ShaderStages,
};

/// A step, by the name of its entry point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kernel {
    Classify,
    FindNear,
    FindCandidates,
    Propose,
    Veto,
    Compare,
    FindMoving,
    FindLeft,
    AddLeft,
    AddLeftSums,
    SpreadLeft,
    Gather,
    AddRings,
    AddRingSums,
    SpreadRings,
    FillRings,
    Check,
}

/// Names in the order of [`Kernel`].
const NAMES: [&str; 17] = [
    "classify",
    "find_near",
    "find_candidates",
    "propose",
    "veto",
    "compare",
    "find_moving",
    "find_left",
    "add_left",
    "add_left_sums",
    "spread_left",
    "gather",
    "add_rings",
    "add_ring_sums",
    "spread_rings",
    "fill_rings",
    "check",
];

const SOURCE: &str = concat!(
    include_str!("integer.wgsl"),
    include_str!("mesh.wgsl"),
    include_str!("classify.wgsl"),
    include_str!("propose.wgsl"),
    include_str!("settle.wgsl"),
    include_str!("scan.wgsl"),
);

/// What is bound, in the order of the bindings of `mesh.wgsl`: the first one is uniform, these are only read, the others written, too.
const READ_ONLY: std::ops::RangeInclusive<u32> = 1..=3;
const BINDINGS: u32 = 9;

/// The shaders, compiled.
#[derive(Debug)]
pub(super) struct Kernels {
    layout: BindGroupLayout,
    pipelines: Vec<ComputePipeline>,
}

impl Kernels {
    pub(super) fn new(device: &Device) -> Self {
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("removal"),
            source: wgpu::ShaderSource::Wgsl(SOURCE.into()),
        });
        let entry = |binding| BindGroupLayoutEntry {
            binding,
            visibility: ShaderStages::COMPUTE,
            ty: BindingType::Buffer {
                ty: match binding {
                    0 => BufferBindingType::Uniform,
                    _ => BufferBindingType::Storage { read_only: READ_ONLY.contains(&binding) },
                },
                has_dynamic_offset: false,
                min_binding_size: None,
            },
            count: None,
        };
        let entries: Vec<_> = (0..BINDINGS).map(entry).collect();
        let layout = device
            .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: None, entries: &entries });
        let whole = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            bind_group_layouts: &[Some(&layout)],
            ..Default::default()
        });
        let pipeline = |name| {
            device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some(name),
                layout: Some(&whole),
                module: &module,
                entry_point: Some(name),
                compilation_options: Default::default(),
                cache: None,
            })
        };
        let pipelines = NAMES.map(pipeline).into();
        Self { layout, pipelines }
    }

    /// What the shaders see, in the order of the bindings.
    pub(super) fn bind(&self, device: &Device, buffers: [&Buffer; BINDINGS as usize]) -> BindGroup {
        let entries: Vec<_> = (0..)
            .zip(buffers)
            .map(|(binding, buffer)| wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() })
            .collect();
        device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &self.layout,
            entries: &entries,
        })
    }

    /// Hands in a step for so many vertices, or places of them, and triangles, with at most `most` groups in a row.
    pub(super) fn dispatch(&self, pass: &mut ComputePass, kernel: Kernel, items: Items, most: u32) {
        pass.set_pipeline(&self.pipelines[kernel as usize]);
        let groups = items.groups(kernel);
        let row = groups.min(most);
        pass.dispatch_workgroups(row, groups.div_ceil(row.max(1)), 1);
    }
}

/// How large the present mesh is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Items {
    pub(super) vertices: u32,
    pub(super) triangles: u32,
}

impl Items {
    fn groups(self, kernel: Kernel) -> u32 {
        use Kernel::*;
        match kernel {
            Classify | FindNear | FindCandidates | Propose | Compare | FindMoving | Check => {
                self.vertices.div_ceil(SIZE)
            }
            Veto | FindLeft | Gather | FillRings => self.triangles.div_ceil(SIZE),
            AddLeft | SpreadLeft => self.triangles.div_ceil(BLOCK),
            AddRings | SpreadRings => (self.vertices + 1).div_ceil(BLOCK),
            AddLeftSums | AddRingSums => 1,
        }
    }

    /// The groups of the largest step.
    pub(super) fn most_groups(self) -> u32 {
        self.vertices.max(self.triangles).div_ceil(SIZE)
    }

    /// Blocks of the longest sum.
    pub(super) fn blocks(vertices: u64, triangles: u64) -> u64 {
        (vertices + 1).max(triangles).div_ceil(u64::from(BLOCK))
    }
}

/// Invocations of a group, as `mesh.wgsl` has them.
const SIZE: u32 = 64;
/// Numbers that a group of `scan.wgsl` adds up.
const BLOCK: u32 = 1024;
