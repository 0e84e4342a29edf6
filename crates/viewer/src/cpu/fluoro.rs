//! Path lengths in plain Rust: the exact reference, and the fast path without a graphics processor.

use endowire_core::Result;
use endowire_core::vessel::SurfaceMesh;

use crate::c_arm::CArm;
use crate::cpu::wall::wall_path_mm;
use crate::engine::PathEngine;

/// Casts rays one after the other.
#[derive(Debug)]
pub(crate) struct CpuPaths;

impl PathEngine for CpuPaths {
    fn mesh(&mut self, view: &CArm, mesh: &SurfaceMesh) -> Result<Vec<f32>> {
        Ok(wall_path_mm(view, mesh))
    }
}
