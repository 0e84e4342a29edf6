//! A graphics processor with asynchronous results, as in a browser.

use endowire_core::{Error, Result};

use super::Renderer;
use crate::cpu;
use crate::device::{DeviceView, RefinedDevice};
use crate::fluoro::Kept;
use crate::gpu::{Drawing, Graphics};
use crate::three_d::Solids;

impl Renderer {
    /// As [`Self::prepare`], with the rays cast asynchronously by a graphics processor; if it fails, by the
    /// processor. What each frame needs is computed by the processor in any case.
    ///
    /// # Errors
    /// As [`Self::render_at`].
    pub async fn prepare_on(&mut self, graphics: &Graphics) -> Result<()> {
        if let (Some(c_arm), None, None) = (&self.setup.c_arm, &self.fluoro, &self.kept) {
            match graphics.anatomy(&self.setup, c_arm).await {
                Ok(anatomy) => {
                    self.kept = Some(Kept::of(c_arm, anatomy));
                    self.engines.name = graphics.name().to_owned();
                }
                Err(error) => self.engines.name = format!("{} (adapter failed: {error})", cpu::NAME),
            }
        }
        self.prepare()
    }

    /// Lets a graphics processor draw the 3D view of devices; returns the pending frame.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a device with values that are not finite, or without the 3D view;
    /// [`Error::Computation`] if the graphics processor has failed.
    pub fn three_d_on(&mut self, graphics: &Graphics, devices: &[DeviceView]) -> Result<Drawing> {
        let Some(camera) = &self.setup.camera else {
            return Err(Error::parameter("view.views", "without 3d", "add \"3d\""));
        };
        let devices = RefinedDevice::all(devices)?;
        let solids = Solids {
            devices: &devices,
            contacts: &self.contacts,
            scale_n: self.setup.spec.camera.force_n,
            c_arm: self.setup.shown_arm.as_ref(),
        };
        let view = match &mut self.engines.later {
            Some(view) => view,
            none => none.insert(graphics.three_d(camera, self.setup.wall_now())?),
        };
        let reading = view.submit(&solids)?;
        let (camera, spec) = (camera.clone(), self.setup.spec.camera.clone());
        Ok(Drawing { reading, camera, spec, contacts: self.contacts.clone() })
    }
}
