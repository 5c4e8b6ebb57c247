//! What computes the parallel removal: the processor, or a GPU where the program is built with the feature `gpu`.

use unweld::reduce::removal::{Options, Simplified, Surface, View};
#[cfg(feature = "gpu")]
use {
    crate::cli::failure::Usage,
    clap::ValueEnum,
    unweld::gpu::{Gpu, Loaded},
};

/// Which device is wanted.
#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Parallel removal (--method parallel)")]
pub struct Choice {
    /// What computes; the mesh is the same: cpu where not given
    #[cfg(feature = "gpu")]
    #[arg(long, value_enum)]
    device: Option<Wanted>,
}

/// What computes.
#[cfg(feature = "gpu")]
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Wanted {
    /// A GPU, or the processor where there is none
    Auto,
    /// The processor
    Cpu,
    /// A GPU, or what makes the processor look like one
    Gpu,
}

/// A device that is there.
pub struct Device {
    #[cfg(feature = "gpu")]
    gpu: Option<Gpu>,
}

/// A device with a mesh.
pub struct Loading<'a> {
    surface: &'a Surface,
    #[cfg(feature = "gpu")]
    gpu: Option<Loaded<'a>>,
}

/// The name of the processor.
pub const PROCESSOR: &str = "processor";

#[cfg(feature = "gpu")]
impl Choice {
    /// Whether one is asked for.
    pub fn is_given(&self) -> bool {
        self.device.is_some()
    }

    /// The device that is asked for, or a remark where it is another.
    ///
    /// # Errors
    /// [`Usage`] where there is no GPU and one is asked for.
    pub fn open(&self, remarks: &mut Vec<String>) -> anyhow::Result<Device> {
        let wanted = self.device.unwrap_or(Wanted::Cpu);
        let gpu = match wanted {
            Wanted::Cpu => None,
            Wanted::Auto | Wanted::Gpu => match Gpu::open() {
                Ok(gpu) if wanted == Wanted::Auto && gpu.is_software() => {
                    remarks.push(format!("the processor computes: {} is no GPU but a program", gpu.name()));
                    None
                }
                Ok(gpu) => Some(gpu),
                Err(e) if wanted == Wanted::Auto => {
                    remarks.push(format!("the processor computes: {e}"));
                    None
                }
                Err(unweld::Error::Parameter(e)) => return Err(Usage(format!("--device gpu: {e}")).into()),
                Err(e) => return Err(e.into()),
            },
        };
        Ok(Device { gpu })
    }
}

#[cfg(not(feature = "gpu"))]
impl Choice {
    /// Whether one is asked for.
    pub fn is_given(&self) -> bool {
        false
    }

    /// The processor.
    ///
    /// # Errors
    /// None: it is there.
    pub fn open(&self, _remarks: &mut Vec<String>) -> anyhow::Result<Device> {
        Ok(Device {})
    }
}

impl Device {
    /// What it calls itself.
    pub fn name(&self) -> &str {
        #[cfg(feature = "gpu")]
        if let Some(gpu) = &self.gpu {
            return gpu.name();
        }
        PROCESSOR
    }

    /// Gives it a mesh.
    ///
    /// # Errors
    /// Those of the device.
    pub fn load<'a>(&'a self, surface: &'a Surface) -> unweld::Result<Loading<'a>> {
        Ok(Loading {
            surface,
            #[cfg(feature = "gpu")]
            gpu: self.gpu.as_ref().map(|gpu| gpu.load(surface)).transpose()?,
        })
    }
}

impl Loading<'_> {
    /// Removes vertices for a view.
    ///
    /// # Errors
    /// Those of the library.
    pub fn simplify(&mut self, view: Option<&View>, options: Options) -> unweld::Result<Simplified> {
        #[cfg(feature = "gpu")]
        if let Some(gpu) = &mut self.gpu {
            return gpu.simplify(view, options);
        }
        self.surface.simplify(view, options)
    }
}
