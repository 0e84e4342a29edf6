//! Frames through wgpu.
use crate::image::Image;
use crate::renderer::Engine;
use crate::scene::{RefinedDevice, Setup};
use endowire_core::Result;
pub(crate) struct GpuEngine;
impl GpuEngine {
    pub(crate) fn new(_: &Setup, _: bool) -> std::result::Result<Self, String> {
        Err("none".into())
    }
}
impl Engine for GpuEngine {
    fn describe(&self) -> String {
        String::new()
    }
    fn fluoro(&mut self, _: &[RefinedDevice]) -> Result<Option<Image>> {
        Ok(None)
    }
    fn three_d(&mut self, _: &[RefinedDevice]) -> Result<Option<Image>> {
        Ok(None)
    }
    fn lumen_path(&mut self, _: &Setup) -> Result<Vec<f32>> {
        Ok(vec![])
    }
    fn device_path(&mut self, _: &Setup, _: &RefinedDevice) -> Result<Vec<f32>> {
        Ok(vec![])
    }
}
