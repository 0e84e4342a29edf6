//! What processors differ in: the two tasks that a graphics processor, or plain Rust, carries out.

use endowire_core::Result;
use endowire_core::vessel::SurfaceMesh;

use crate::c_arm::CArm;
use crate::output::Image;
use crate::three_d::Solids;

/// Computes lengths of rays inside things: the one task that processors differ in.
pub(crate) trait PathEngine: Send + Sync {
    /// Length inside a closed mesh of the central ray of each pixel of `view`, row by row.
    fn mesh(&mut self, view: &CArm, mesh: &SurfaceMesh) -> Result<Vec<f32>>;
}

/// Draws 3D frames of one set-up.
pub(crate) trait ThreeDEngine: Send + Sync {
    fn frame(&mut self, solids: &Solids) -> Result<Image>;
}

/// Number of this process. A web page is one that is never forked.
pub(crate) fn process() -> u32 {
    if cfg!(target_family = "wasm") { 0 } else { std::process::id() }
}

/// The engines of the wanted views, all on the same processor.
pub(crate) struct Engines {
    pub(crate) paths: Option<Box<dyn PathEngine>>,
    /// That of the CPU is made with the first frame.
    pub(crate) three_d: Option<Box<dyn ThreeDEngine>>,
    /// That of a graphics processor whose answers are waited for.
    #[cfg(feature = "gpu")]
    pub(crate) later: Option<Box<crate::gpu::GpuView3d>>,
    /// Name for people.
    pub(crate) name: String,
    /// The process that they were made in. One that is forked from it has neither the threads nor the device of a graphics processor.
    pub(crate) process: u32,
}

impl Engines {
    /// Has the 3D view made anew with its next frame: the wall has moved.
    pub(crate) fn forget_wall(&mut self) {
        self.three_d = None;
        #[cfg(feature = "gpu")]
        {
            self.later = None;
        }
    }

    /// Whether this process was forked from the one that made them.
    pub(crate) fn are_forked(&self) -> bool {
        self.process != process()
    }
}

impl Drop for Engines {
    fn drop(&mut self) {
        // A driver would wait for its threads, which are not there.
        if self.are_forked() {
            std::mem::forget((self.paths.take(), self.three_d.take()));
        }
    }
}
