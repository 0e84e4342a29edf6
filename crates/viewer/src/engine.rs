//! The processor-dependent tasks, carried out by a graphics processor or plain Rust.

use endowire_core::Result;
use endowire_core::vessel::SurfaceMesh;

use crate::c_arm::CArm;
use crate::output::Image;
use crate::three_d::Solids;

/// Computes lengths of rays inside objects.
pub(crate) trait PathEngine: Send + Sync {
    /// Length inside a closed mesh of the central ray of each pixel of `view`, row by row.
    fn mesh(&mut self, view: &CArm, mesh: &SurfaceMesh) -> Result<Vec<f32>>;
}

/// Draws 3D frames of one set-up.
pub(crate) trait ThreeDEngine: Send + Sync {
    fn frame(&mut self, solids: &Solids) -> Result<Image>;
}

/// Identifier of this process. A web page is never forked and has a fixed one.
pub(crate) fn process() -> u32 {
    if cfg!(target_family = "wasm") { 0 } else { std::process::id() }
}

/// The engines of the wanted views, all on the same processor.
pub(crate) struct Engines {
    pub(crate) paths: Option<Box<dyn PathEngine>>,
    /// On the CPU it is created with the first frame.
    pub(crate) three_d: Option<Box<dyn ThreeDEngine>>,
    /// A graphics processor with asynchronous results.
    #[cfg(feature = "gpu")]
    pub(crate) later: Option<Box<crate::gpu::GpuView3d>>,
    /// Name for display.
    pub(crate) name: String,
    /// The process that created them. A process forked from it has neither the threads nor the device of a graphics
    /// processor.
    pub(crate) process: u32,
}

impl Engines {
    /// Recreates the 3D view with its next frame, because the wall has moved.
    pub(crate) fn forget_wall(&mut self) {
        self.three_d = None;
        #[cfg(feature = "gpu")]
        {
            self.later = None;
        }
    }

    /// Whether this process was forked from the one that created them.
    pub(crate) fn are_forked(&self) -> bool {
        self.process != process()
    }
}

impl Drop for Engines {
    fn drop(&mut self) {
        // A driver would wait for its threads, which do not exist here.
        if self.are_forked() {
            std::mem::forget((self.paths.take(), self.three_d.take()));
        }
    }
}
