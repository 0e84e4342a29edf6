//! The dose of a session, and what its beam shows. Both belong to its record, so they depend on neither whether nor how
//! large pictures are drawn: a few rays through the patient tell how thick it is in the measuring field.

use endowire_core::vessel::Wall;
use endowire_core::{Result, Vec3};
use endowire_viewer::{Backend, Exposure, Renderer, ViewSpec};

use crate::lab::Lab;

/// Rays across the field: 8 × 8 of them are in the measuring field, its middle ninth.
const SIDE_PX: u32 = 24;

/// Exposure of one fluoroscopic frame of all planes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Delivered {
    /// Revision of the room ([`Lab::revisions`]).
    pub(crate) revision: u64,
    /// Air kerma at the detectors, nGy.
    pub(crate) frame_ngy: f64,
    /// Air kerma at the entrance reference points, nGy.
    pub(crate) entrance_ngy: f64,
    /// Voltage of the first plane, kV.
    pub(crate) kvp: f64,
    /// Its current, with exposure control, mA.
    pub(crate) current_ma: Option<f64>,
}

/// Measures the beam of each plane.
#[derive(Debug, Default)]
pub(crate) struct Meter {
    /// The beam of each plane; made when the beam is first on.
    planes: Vec<Renderer>,
    /// Revision of the room that they were made for, and what they found.
    measured: Option<(u64, Option<Delivered>)>,
}

impl Meter {
    /// The exposure in a room, measured once for each; `None` if that has failed.
    ///
    /// # Errors
    /// As [`Renderer::of_wall`]. The room counts as measured.
    pub(crate) fn measure(&mut self, lab: &Lab, wall: &Wall) -> Result<Option<Delivered>> {
        let revision = lab.revisions()[0];
        if let Some((_, delivered)) = self.measured.filter(|(known, _)| *known == revision) {
            return Ok(delivered);
        }
        self.measured = Some((revision, None));
        let specs = lab.fluoro().planes();
        self.planes.truncate(specs.len());
        let mut each: Vec<Exposure> = Vec::with_capacity(specs.len());
        for (index, spec) in specs.into_iter().enumerate() {
            let spec = coarse(spec);
            match self.planes.get_mut(index) {
                Some(plane) => plane.change(&spec)?,
                None => self.planes.push(Renderer::of_wall(&spec, wall)?),
            }
            self.planes[index].prepare()?;
            each.extend(self.planes[index].exposure());
        }
        let delivered = each.first().map(|first| Delivered {
            revision,
            frame_ngy: each.iter().map(|one| one.dose_ngy).sum(),
            entrance_ngy: each.iter().map(|one| one.entrance_ngy).sum(),
            kvp: first.kvp,
            current_ma: first.pulse.map(|pulse| pulse.current_ma),
        });
        self.measured = Some((revision, delivered));
        Ok(delivered)
    }

    /// Whether a plane shows a place, between the blades; where nothing was measured, all is taken to be seen.
    pub(crate) fn shows(&self, place_mm: &Vec3) -> bool {
        let arms = || self.planes.iter().filter_map(Renderer::c_arm);
        arms().next().is_none() || arms().any(|arm| arm.sees(arm.project(place_mm)))
    }
}

/// The view with a few rays, on the processor, and without what changes neither dose nor geometry.
fn coarse(spec: ViewSpec) -> ViewSpec {
    ViewSpec { size_px: [SIDE_PX; 2], backend: Backend::Cpu, injection: vec![], ..spec }
}
