//! The parallel removal of [`crate::reduce::removal`] on a GPU, as compute shaders of WGSL: the same decisions in the same integers, so
//! the same mesh, triangle by triangle.
//!
//! A mesh is made ready on the processor, once ([`Surface::new`]); each step of an iteration is the GPU's: which vertices are candidates,
//! where they would go, what is called off, the next mesh with its rings, and the look at what came of it. Which triangles are left is
//! numbered there, too, by prefix sums. After each iteration five counts come back, after the last one the triangles.
//!
//! What a shader writes has one owner, or is a flag that whoever likes may set, or a sum; rings are filled in no order, on which nothing
//! depends. No invocation has arrays of its own: it reads the rings again, and keeps prices where the rings of the next mesh will be.

mod buffers;
mod device;
mod frame;
mod kernels;

use crate::error::Result;
use crate::reduce::removal::{Options, Simplified, Surface, View};
use buffers::Buffers;
use device::Device;
use kernels::Kernels;

/// A GPU with the shaders.
#[derive(Debug)]
pub struct Gpu {
    device: Device,
    kernels: Kernels,
}

impl Gpu {
    /// The fastest that is here, over Vulkan, Metal or Direct3D 12. That may be a program that makes the processor look like one
    /// ([`Gpu::is_software`]).
    ///
    /// # Errors
    /// [`crate::Error::Parameter`] where there is none that will do; [`crate::Error::Io`] where it does not take the shaders.
    pub fn open() -> Result<Self> {
        let device = Device::open()?;
        let kernels = device.checked("its shaders", Kernels::new)?;
        Ok(Self { device, kernels })
    }

    /// What it calls itself.
    pub fn name(&self) -> &str {
        &self.device.name
    }

    /// Whether it is the processor after all.
    pub fn is_software(&self) -> bool {
        self.device.is_software
    }

    /// Copies a mesh to the memory of the GPU, for any number of views: 256 bytes a vertex of a closed mesh.
    ///
    /// # Errors
    /// [`crate::Error::Limit`] where the mesh is larger than the GPU's buffers may be; [`crate::Error::Memory`] where it has no memory
    /// for it; [`crate::Error::Io`] where it fails.
    pub fn load<'a>(&'a self, surface: &'a Surface) -> Result<Loaded<'a>> {
        Ok(Loaded { gpu: self, surface, buffers: Buffers::new(&self.device, &self.kernels, surface)? })
    }
}

/// A mesh in the memory of a GPU.
#[derive(Debug)]
pub struct Loaded<'a> {
    gpu: &'a Gpu,
    surface: &'a Surface,
    buffers: Buffers,
}

impl Loaded<'_> {
    /// As [`Surface::simplify`], with the same result. The number of threads does not matter here.
    ///
    /// # Errors
    /// [`crate::Error::Parameter`] for a view out of range; [`crate::Error::Io`] where the GPU fails, is taken away, or does not answer in five minutes.
    pub fn simplify(&mut self, view: Option<&View>, options: Options) -> Result<Simplified> {
        let sight = view.map(|view| view.on(self.surface)).transpose()?;
        frame::run(self, sight, options)
    }
}

#[cfg(test)]
mod tests;
