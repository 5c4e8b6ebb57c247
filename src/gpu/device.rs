//! The device, and what can go wrong with it: told as errors, never by a panic.

use crate::error::{Error, Result};
use std::fmt::Display;
use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Mutex, PoisonError, mpsc};
use std::time::Duration;
use wgpu::{BufferSlice, ErrorFilter, Limits, MapMode, PollType, PowerPreference};

/// A GPU and its queue.
#[derive(Debug)]
pub(super) struct Device {
    pub(super) device: wgpu::Device,
    pub(super) queue: wgpu::Queue,
    pub(super) name: String,
    pub(super) is_software: bool,
    fault: Fault,
}

/// The first thing that went wrong outside of [`Device::checked`].
#[derive(Clone, Debug, Default)]
struct Fault(Arc<Mutex<Option<String>>>);

impl Fault {
    fn tell(&self, what: String) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(what);
    }

    fn told(&self) -> Option<String> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

impl Device {
    /// The fastest that is here.
    ///
    /// # Errors
    /// [`Error::Parameter`] where there is none that will do.
    pub(super) fn open() -> Result<Self> {
        let none = |why: &dyn Display| Error::Parameter(format!("there is no GPU that can compute: {why}"));
        if wgpu::Instance::enabled_backend_features().is_empty() {
            return Err(none(&"nothing is known of GPUs on this system"));
        }
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
        let adapter = pollster::block_on(instance.request_adapter(&wgpu::RequestAdapterOptions {
            power_preference: PowerPreference::HighPerformance,
            ..Default::default()
        }))
        .map_err(|e| none(&e))?;
        let info = adapter.get_info();
        let there = adapter.limits();
        let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
            required_limits: Limits {
                max_storage_buffers_per_shader_stage: STORAGE_BUFFERS,
                max_storage_buffer_binding_size: there.max_storage_buffer_binding_size,
                max_buffer_size: there.max_buffer_size,
                max_compute_workgroups_per_dimension: there.max_compute_workgroups_per_dimension,
                ..Limits::downlevel_defaults()
            },
            ..Default::default()
        }))
        .map_err(|e| none(&format_args!("{}: {e}", info.name)))?;
        let fault = Fault::default();
        // Without these two the library would end the program.
        let (errors, losses) = (fault.clone(), fault.clone());
        device.on_uncaptured_error(Arc::new(move |e| errors.tell(e.to_string())));
        device.set_device_lost_callback(move |_, why| losses.tell(format!("it is lost: {why}")));
        let is_software = info.device_type == wgpu::DeviceType::Cpu;
        Ok(Self { device, queue, name: info.name, is_software, fault })
    }

    /// Does what makes things on the device.
    ///
    /// # Errors
    /// [`Error::Memory`] for `bytes` that it does not have; [`Error::Io`] where it refuses `what`.
    pub(super) fn checked<T>(&self, what: &str, make: impl FnOnce(&wgpu::Device) -> T) -> Result<T> {
        let scopes = [ErrorFilter::Internal, ErrorFilter::Validation, ErrorFilter::OutOfMemory]
            .map(|filter| self.device.push_error_scope(filter));
        let made = make(&self.device);
        // The last one first, and all of them.
        let [internal, validation, memory] = scopes;
        let errors = [memory.pop(), validation.pop(), internal.pop()].map(pollster::block_on);
        match errors.into_iter().flatten().next() {
            Some(e) => Err(self.failed(&format_args!("it refuses {what}: {e}"))),
            None => Ok(made),
        }
    }

    /// What the GPU has written to a part of a buffer, once all that was handed in is done.
    ///
    /// # Errors
    /// [`Error::Io`] where it fails or does not answer.
    pub(super) fn read(&self, part: BufferSlice) -> Result<Vec<u32>> {
        let (tell, told) = mpsc::channel();
        part.map_async(MapMode::Read, move |mapped| drop(tell.send(mapped)));
        let wait = PollType::Wait { submission_index: None, timeout: Some(PATIENCE) };
        // The library panics where the device is lost at this moment.
        let waited = catch_unwind(AssertUnwindSafe(|| self.device.poll(wait)));
        let told = told.try_recv();
        if let Some(fault) = self.fault.told() {
            return Err(self.failed(&fault));
        }
        match waited {
            Ok(Ok(_)) => {}
            Ok(Err(e)) => return Err(self.failed(&e)),
            Err(_) => return Err(self.failed(&"it is lost")),
        }
        match told {
            Ok(Ok(())) => {}
            Ok(Err(e)) => return Err(self.failed(&e)),
            Err(_) => return Err(self.failed(&"its memory cannot be read")),
        }
        let words = match part.get_mapped_range() {
            Ok(bytes) => bytemuck::pod_collect_to_vec(&bytes[..]),
            Err(e) => return Err(self.failed(&e)),
        };
        part.buffer().unmap();
        Ok(words)
    }

    fn failed(&self, why: &dyn Display) -> Error {
        io::Error::other(format!("the GPU {}: {why}", self.name)).into()
    }
}

/// Buffers that the shaders see: as many as WebGPU promises.
const STORAGE_BUFFERS: u32 = 8;
/// How long an answer may take.
const PATIENCE: Duration = Duration::from_secs(300);
