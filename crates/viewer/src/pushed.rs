//! What is pushed, as the viewer sees it: the device, or each of several instruments.

use endowire_core::device::{Device, Stack, line_mm};
use endowire_core::methods::MethodChoice;
use endowire_core::scene::SceneOf;
use endowire_core::shape::Shape;
use endowire_core::vessel::Displacement;
use endowire_core::{Error, Result, Vec3};
use serde::de::DeserializeOwned;

use crate::device::{DevicePart, DeviceView};
use crate::device_file::{device_parts, section_parts};
use crate::spec::ViewSpec;

/// Instruments of a scene and what they are made of.
#[derive(Debug, Clone)]
pub struct Pushed {
    stack: Stack,
    /// Parts to draw of each.
    parts: Vec<Vec<DevicePart>>,
}

impl Pushed {
    /// Those of a scene. A device alone is made of what the `[view]` table says, if it says so, and else everything of what its file says.
    ///
    /// # Errors
    /// As [`SceneOf::stack`]; materials of a device file that are not known; a `[view]` table that describes one device where there are several.
    pub fn new<M: MethodChoice + DeserializeOwned + Default>(
        scene: &SceneOf<M>,
        spec: &ViewSpec,
    ) -> Result<Self> {
        let stack = scene.stack()?;
        let mut parts = Vec::new();
        for (file, device) in scene.device_files()?.iter().zip(stack.devices()) {
            parts.push(match file {
                Some((path, file)) => {
                    device_parts(file).map_err(|error| Error::content(path, error.to_string()))?
                }
                None => section_parts(device),
            });
        }
        if let Some(own) = spec.own_parts(stack.is_several())? {
            parts[0] = own.to_vec();
        }
        Ok(Self { stack, parts })
    }

    /// The tip of the innermost instrument that is in on this line, where these lengths are, mm; in the vessel at rest, where that is
    /// displaced.
    pub fn tip_at_rest_mm(
        &self,
        shape: &Shape,
        inserted_mm: &[f64],
        displacement: Option<&Displacement>,
    ) -> Option<Vec3> {
        let first_mm = inserted_mm.iter().find(|mm| **mm > 0.0)?;
        let tip_mm = shape.position_at(line_mm(inserted_mm.iter().copied()) - first_mm)?;
        Some(displacement.map_or(tip_mm, |displacement| displacement.material(&tip_mm)))
    }

    /// Views of all that is in on this line, where these lengths are.
    pub fn views(&self, shape: &Shape, inserted_mm: &[f64]) -> Vec<DeviceView> {
        let line_mm = line_mm(inserted_mm.iter().copied());
        let behind = inserted_mm.iter().filter(|mm| **mm > 0.0).map(|mm| shape.behind(line_mm - mm));
        self.views_of(&behind.collect::<Vec<_>>(), inserted_mm)
    }

    /// Views of all that is in, on lines of their own.
    pub(crate) fn views_of(&self, shapes: &[Shape], inserted_mm: &[f64]) -> Vec<DeviceView> {
        let each = self.stack.devices().zip(&self.parts).zip(inserted_mm).filter(|(_, mm)| **mm > 0.0);
        let view = |(((device, parts), _), shape): (((&Device, &Vec<DevicePart>), &f64), &Shape)| {
            DeviceView::of_device(shape, device, parts)
        };
        each.zip(shapes).map(view).collect()
    }
}
