//! The memory of a mesh on the device.

use super::device::Device;
use super::kernels::{Items, Kernels};
use crate::error::{Error, Result};
use crate::reduce::removal::Surface;
use wgpu::{BindGroup, Buffer, BufferUsages, Limits};

/// What is known of a mesh, the mesh itself, and two that come of it in turns.
#[derive(Debug)]
pub(super) struct Buffers {
    pub(super) params: Buffer,
    pub(super) marks: Buffer,
    /// The surface's mesh, and the two others.
    pub(super) meshes: [Buffer; 3],
    pub(super) rings: [Buffer; 3],
    /// From each of the meshes to the next one.
    pub(super) steps: [BindGroup; 3],
    /// Memory that the processor reads.
    pub(super) counts: Buffer,
    pub(super) triangles: Buffer,
    pub(super) items: Items,
    /// Groups in a row of a step.
    pub(super) row: u32,
}

/// Which mesh is made of which.
pub(super) const NEXT: [usize; 3] = [1, 2, 1];
/// Numbers of the parameters, as `mesh.wgsl` has them.
pub(super) const PARAMS: usize = 16;
/// Counts behind the marks.
pub(super) const COUNTS: usize = 5;

impl Buffers {
    /// Copies a mesh.
    ///
    /// # Errors
    /// [`Error::Limit`] where it is larger than a buffer may be, or than so many groups are; [`Error::Memory`]; [`Error::Io`].
    pub(super) fn new(device: &Device, kernels: &Kernels, surface: &Surface) -> Result<Self> {
        let (starts, ring) = surface.rings();
        let limits = device.device.limits();
        let [vertices, triangles] = [surface.points().len(), surface.triangles().len()].map(|n| n as u64);
        let (words, items) = fitting(vertices, triangles, &limits)?;
        let row = limits.max_compute_workgroups_per_dimension;
        let points = points(surface);
        let mesh: Vec<[u32; 4]> =
            (0..).zip(surface.triangles()).map(|(t, &[a, b, c])| [a, b, c, t]).collect();
        device.checked("the memory of a mesh", |on| {
            let buffer = |words: u64, usage| {
                // None is empty.
                let size = 4 * words.max(4);
                on.create_buffer(&wgpu::BufferDescriptor {
                    label: None,
                    size,
                    usage,
                    mapped_at_creation: false,
                })
            };
            let storage = BufferUsages::STORAGE | BufferUsages::COPY_DST | BufferUsages::COPY_SRC;
            let read = BufferUsages::MAP_READ | BufferUsages::COPY_DST;
            let places = buffer(words.points, storage);
            let state = buffer(words.state, storage);
            let sums = buffer(words.sums, storage);
            let params = buffer(PARAMS as u64, BufferUsages::UNIFORM | BufferUsages::COPY_DST);
            let marks = buffer(words.marks, storage);
            let meshes = [0; 3].map(|_| buffer(words.mesh, storage));
            let rings = [0; 3].map(|_| buffer(words.rings, storage));
            let steps = [0, 1, 2].map(|from| {
                let to = NEXT[from];
                let (mesh, ring) = (&meshes, &rings);
                let all =
                    [&params, &places, &mesh[from], &ring[from], &state, &marks, &mesh[to], &ring[to], &sums];
                kernels.bind(on, all)
            });
            let counts = buffer(COUNTS as u64, read);
            let triangles = buffer(words.mesh, read);
            device.queue.write_buffer(&places, 0, bytemuck::cast_slice(&points));
            device.queue.write_buffer(&meshes[0], 0, bytemuck::cast_slice(&mesh));
            device.queue.write_buffer(&rings[0], 0, bytemuck::cast_slice(starts));
            device.queue.write_buffer(&rings[0], 4 * starts.len() as u64, bytemuck::cast_slice(ring));
            Self { params, marks, meshes, rings, steps, counts, triangles, items, row }
        })
    }
}

/// How many numbers the buffers of a mesh have.
#[derive(Debug)]
struct Words {
    points: u64,
    mesh: u64,
    rings: u64,
    state: u64,
    marks: u64,
    sums: u64,
}

/// The buffers of so many vertices and triangles.
///
/// # Errors
/// [`Error::Limit`] where they are larger than they may be.
fn fitting(vertices: u64, triangles: u64, limits: &Limits) -> Result<(Words, Items)> {
    let words = Words {
        points: 4 * vertices,
        mesh: 4 * triangles,
        rings: vertices + 1 + 3 * triangles,
        state: 6 * vertices,
        marks: vertices + COUNTS as u64,
        sums: Items::blocks(vertices, triangles),
    };
    let Words { points, mesh, rings, state, marks, sums } = words;
    let needed = 4 * points.max(mesh).max(rings).max(state).max(marks).max(sums);
    // Numbers of bytes have 32 bits in a shader.
    let allowed = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size).min(u64::from(u32::MAX));
    if needed > allowed {
        return Err(Error::Limit { what: "a buffer of the GPU in bytes", needed, allowed });
    }
    // So there are fewer than 2^32 of both.
    let items = Items { vertices: vertices as u32, triangles: triangles as u32 };
    let (needed, row) =
        (u64::from(items.most_groups()), u64::from(limits.max_compute_workgroups_per_dimension));
    if needed > row * row {
        return Err(Error::Limit { what: "groups of the GPU", needed, allowed: row * row });
    }
    Ok((words, items))
}

/// Where the vertices are, and their flags as `mesh.wgsl` has them.
fn points(surface: &Surface) -> Vec<[i32; 4]> {
    let (guaranteed, locked) = (surface.guaranteed(), surface.locked());
    let flags =
        |v: usize| [guaranteed[v] || locked[v], surface.auxiliary()[v], surface.boundary()[v], locked[v]];
    let point = |(v, &[x, y, z]): (usize, &[i32; 3])| {
        let flags = flags(v).iter().rev().fold(0, |bits, &flag| bits << 1 | i32::from(flag));
        [x, y, z, flags]
    };
    surface.points().iter().enumerate().map(point).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_too_large_for_a_gpu_is_refused() {
        let limits = Limits::downlevel_defaults();
        let told = |vertices, triangles, limits: &Limits| {
            fitting(vertices, triangles, limits).map(|_| ()).map_err(|e| e.to_string())
        };
        // 16 bytes a triangle; 128 MiB are allowed.
        assert_eq!(told(4_194_304, 8_388_608, &limits), Ok(()));
        let what = "limit reached: a buffer of the GPU in bytes needs";
        assert_eq!(told(4_194_304, 8_388_609, &limits), Err(format!("{what} 134217744, allowed 134217728")));
        let most =
            Limits { max_storage_buffer_binding_size: u64::MAX, max_buffer_size: u64::MAX, ..limits.clone() };
        assert_eq!(told(1 << 31, 10, &most), Err(format!("{what} {}, allowed 4294967295", 24u64 << 31)));
        let narrow = Limits { max_compute_workgroups_per_dimension: 3, ..limits };
        assert_eq!(told(300, 576, &narrow), Ok(()));
        let what = "limit reached: groups of the GPU needs";
        assert_eq!(told(300, 577, &narrow), Err(format!("{what} 10, allowed 9")));
    }
}
