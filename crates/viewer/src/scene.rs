//! Input of all engines: the wall, the patient, and the resolved set-up of each wanted view.

use std::sync::Arc;

use endowire_core::Result;
use endowire_core::vessel::{Displacement, SurfaceMesh};

use crate::c_arm::CArm;
use crate::contrast::Flow;
use crate::cpu::{check_closed, check_drawable};
use crate::device::{DeviceView, RefinedDevice};
use crate::patient::Patient;
use crate::shaft::Outside;
use crate::spec::{View, ViewSpec};
use crate::tails::Filled;
use crate::three_d::Camera;

/// Data for an engine, only those that the wanted views need.
#[derive(Debug)]
pub(crate) struct Setup {
    pub(crate) spec: ViewSpec,
    pub(crate) wall: Arc<SurfaceMesh>,
    /// The blood-filled lumen in the beam.
    pub(crate) filled: Arc<Filled>,
    pub(crate) patient: Arc<Patient>,
    /// The displaced vessel, if displaced; C-arm and camera refer to the vessel at rest.
    pub(crate) moved: Option<Arc<Moved>>,
    /// The flow that transports contrast medium, if any is injected.
    pub(crate) flow: Option<Arc<Flow>>,
    /// Whether the wall is closed, so that lengths inside it are defined; otherwise blood counts as surrounding
    /// tissue.
    pub(crate) lumen: bool,
    pub(crate) c_arm: Option<CArm>,
    /// The C-arm that the 3D view shows, whether or not fluoroscopy is wanted.
    pub(crate) shown_arm: Option<CArm>,
    pub(crate) camera: Option<Camera>,
}

/// A displaced vessel.
#[derive(Debug)]
pub(crate) struct Moved {
    pub(crate) displacement: Displacement,
    wall: Arc<SurfaceMesh>,
    filled: Arc<Filled>,
    /// The air of a generated body: diaphragm, borders of the heart and bowel move with the vessel.
    air: Option<SurfaceMesh>,
}

impl Setup {
    /// Displaces the vessel, and the air of a generated body, or returns them to rest.
    pub(crate) fn move_vessel(&mut self, displacement: Option<&Displacement>) {
        let moved = |mesh: &SurfaceMesh, displacement: &Displacement| SurfaceMesh {
            vertices_mm: mesh.vertices_mm.iter().map(|v| displacement.place(v)).collect(),
            triangles: mesh.triangles.clone(),
        };
        self.moved = displacement.map(|displacement| {
            let wall = Arc::new(moved(&self.wall, displacement));
            let surface = match Arc::ptr_eq(&self.wall, &self.filled.surface) {
                true => Arc::clone(&wall),
                false => Arc::new(moved(&self.filled.surface, displacement)),
            };
            let filled = Arc::new(Filled { surface, faded: moved(&self.filled.faded, displacement) });
            let air = self.patient.air().map(|air| moved(air, displacement));
            Arc::new(Moved { displacement: displacement.clone(), wall, filled, air })
        });
    }

    /// The displacement of the vessel.
    pub(crate) fn displacement(&self) -> Option<&Displacement> {
        self.moved.as_ref().map(|moved| &moved.displacement)
    }

    /// The wall at its displacement.
    pub(crate) fn wall_now(&self) -> &SurfaceMesh {
        self.moved.as_ref().map_or(&self.wall, |moved| &moved.wall)
    }

    /// The blood-filled lumen at its displacement.
    pub(crate) fn filled_now(&self) -> &Filled {
        self.moved.as_ref().map_or(&self.filled, |moved| &moved.filled)
    }

    /// The air of a generated body at its displacement.
    pub(crate) fn air_now(&self) -> Option<&SurfaceMesh> {
        match &self.moved {
            Some(moved) => moved.air.as_ref(),
            None => self.patient.air(),
        }
    }

    /// The devices in the beam, with their shafts outside the vessel.
    ///
    /// # Errors
    /// As [`RefinedDevice::all`].
    pub(crate) fn in_beam(&self, devices: &[DeviceView]) -> Result<Vec<RefinedDevice>> {
        let middle =
            |wall: &SurfaceMesh| wall.bounds_mm().map_or(0.0, |(low, high)| f64::midpoint(low.x, high.x));
        let outside = match (&self.c_arm, self.spec.patient.is_given()) {
            (Some(c_arm), false) => Outside::Air { beam: c_arm.beam() },
            _ => {
                let spine_mm = self.spec.patient.torso.as_ref().and_then(|torso| torso.spine_mm);
                Outside::Patient { middle_mm: spine_mm.map_or_else(|| middle(&self.wall), |[x, _]| x) }
            }
        };
        RefinedDevice::all_with_shafts(devices, outside)
    }

    /// A set-up with a closed wall, filled with blood to its ends.
    pub(crate) fn new(spec: &ViewSpec, wall: &SurfaceMesh) -> Result<Self> {
        let wall = Arc::new(wall.clone());
        let filled = Filled { surface: Arc::clone(&wall), ..Filled::default() };
        Self::filled(spec, wall, Arc::new(filled))
    }

    /// A set-up with a closed wall and a given blood-filled lumen.
    pub(crate) fn filled(spec: &ViewSpec, wall: Arc<SurfaceMesh>, filled: Arc<Filled>) -> Result<Self> {
        Self::made(spec, (wall, filled), None)
    }

    /// The set-up of another view of the same vessel, sharing common data.
    pub(crate) fn beside(&self, spec: &ViewSpec) -> Result<Self> {
        Self::made(spec, (Arc::clone(&self.wall), Arc::clone(&self.filled)), Some(self))
    }

    /// The same for a separate run: medium from a tip belongs to one run only.
    pub(crate) fn of_own_run(mut self) -> Self {
        self.flow = self.flow.map(|flow| if flow.follows_tip() { Arc::new(flow.anew()) } else { flow });
        self
    }

    fn made(
        spec: &ViewSpec,
        (wall, filled): (Arc<SurfaceMesh>, Arc<Filled>),
        other: Option<&Self>,
    ) -> Result<Self> {
        spec.validate()?;
        let mut setup = Self {
            spec: spec.clone(),
            wall: Arc::default(),
            filled: Arc::default(),
            patient: Arc::new(Patient::Slab { tissue_mm: spec.xray.tissue_mm }),
            moved: other.and_then(|other| other.moved.clone()),
            flow: None,
            lumen: true,
            c_arm: None,
            shown_arm: None,
            camera: None,
        };
        if spec.views.is_empty() {
            return Ok(setup);
        }
        let other = other.filter(|other| !other.spec.views.is_empty());
        if other.is_none() {
            check_drawable(&wall)?;
        }
        if spec.wants(View::Fluoro) {
            let other = other.filter(|other| other.c_arm.is_some());
            let known = other.is_some_and(|other| other.lumen);
            let closed = if known { Ok(()) } else { check_closed(&filled.surface) };
            // Only contrast medium shows the inside of the wall: blood resembles tissue, and a device is drawn
            // without it.
            if !spec.injection.is_empty() || spec.xray.contrast_fraction > 0.0 {
                closed?;
            } else {
                setup.lumen = closed.is_ok();
            }
            setup.c_arm = Some(placed(spec, &wall)?);
            let alike = |other: &&Self| {
                let slabs = [&other.spec, spec].map(|spec| spec.xray.tissue_mm);
                other.spec.patient == spec.patient && slabs[0] == slabs[1]
            };
            setup.patient = match other.filter(alike) {
                Some(other) => Arc::clone(&other.patient),
                None => Arc::new(Patient::new(spec, &wall)?),
            };
            setup.flow = flow(spec, &filled.surface, other)?;
        }
        if spec.wants(View::ThreeD) && spec.camera.c_arm {
            let own = || CArm::new(&spec.c_arm, spec.size_px, &wall);
            setup.shown_arm = Some(setup.c_arm.clone().map_or_else(own, Ok)?);
        }
        let beam: Vec<_> = match &setup.shown_arm {
            // Source and detector are a metre apart: in a frame containing both the vessel would be a speck.
            Some(c_arm) => c_arm.field_corners_mm(c_arm.sod_mm()).to_vec(),
            None => vec![],
        };
        setup.camera =
            spec.wants(View::ThreeD).then(|| Camera::new(&spec.camera, spec.size_px, &wall, &beam));
        (setup.wall, setup.filled) = (wall, filled);
        Ok(setup)
    }
}

/// The flow of a view, sharing data with that of another.
fn flow(spec: &ViewSpec, filled: &SurfaceMesh, other: Option<&Setup>) -> Result<Option<Arc<Flow>>> {
    let known = other.filter(|other| other.spec.flow == spec.flow && !spec.injection.is_empty());
    match known.and_then(|other| Some((other.flow.as_ref()?, &other.spec.injection))) {
        Some((flow, injection)) if *injection == spec.injection => Ok(Some(Arc::clone(flow))),
        Some((flow, _)) => Ok(Some(Arc::new(flow.injected(&spec.injection)))),
        None => Ok(Flow::of_view(spec, filled)?.map(Arc::new)),
    }
}

fn placed(spec: &ViewSpec, wall: &SurfaceMesh) -> Result<CArm> {
    let c_arm = CArm::new(&spec.c_arm, spec.size_px, wall)?;
    spec.detector.check_blur(c_arm.pixel_mm())?;
    Ok(c_arm)
}
