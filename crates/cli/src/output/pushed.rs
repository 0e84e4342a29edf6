//! What is pushed, as the viewer sees it: the device, or each of several instruments.

use std::path::Path;

use endowire_core::device::{Device, Stack};
use endowire_core::shape::Shape;
use endowire_methods::Scene;
use endowire_viewer::{DevicePart, DeviceView, ViewSpec, device_parts, section_parts};

use crate::failure::Failure;

/// Instruments and what they are made of.
pub(crate) struct Pushed {
    stack: Stack,
    /// Parts to draw of each.
    parts: Vec<Vec<DevicePart>>,
}

impl Pushed {
    /// Those of the scene in a file. A device alone is made of what the `[view]` table says, if it says so, and else everything of what its file says.
    pub(crate) fn new(path: &Path, scene: &Scene, spec: &ViewSpec) -> Result<Self, Failure> {
        let in_scene = |e: endowire_core::Error| Failure::from(e).at(path.display());
        let stack = scene.stack().map_err(in_scene)?;
        let mut parts = Vec::new();
        for (file, device) in scene.device_files().map_err(in_scene)?.iter().zip(stack.devices()) {
            parts.push(match file {
                Some((path, file)) => device_parts(file).map_err(|e| Failure::from(e).at(path.display()))?,
                None => section_parts(device),
            });
        }
        match (spec.device.is_empty(), stack.is_several()) {
            (true, _) => {}
            (false, false) => parts[0].clone_from(&spec.device),
            (false, true) => {
                let text = "view.device describes one device, and the scene has several instruments: leave it out, and give materials in \
                            their files";
                return Err(Failure::Input(text.to_owned()).at(path.display()));
            }
        }
        Ok(Self { stack, parts })
    }

    /// Views of all that is in on this line, where these lengths are.
    pub(crate) fn views(&self, shape: &Shape, inserted_mm: &[f64]) -> Vec<DeviceView> {
        let line_mm = inserted_mm.iter().copied().fold(0.0, f64::max);
        let each = self.stack.devices().zip(&self.parts).zip(inserted_mm).filter(|(_, mm)| **mm > 0.0);
        let view = |((device, parts), mm): ((&Device, &Vec<DevicePart>), &f64)| {
            DeviceView::of_device(&shape.behind(line_mm - mm), device, parts)
        };
        each.map(view).collect()
    }
}
