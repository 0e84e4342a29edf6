//! What all engines draw: the wall, the devices refined once, and the resolved set-up of each wanted view.

use std::sync::Arc;

use endowire_core::Result;
use endowire_core::vessel::SurfaceMesh;

use crate::c_arm::CArm;
use crate::cpu::{check_closed, check_drawable};
use crate::device::{DevicePoint, DeviceView};
use crate::spec::{View, ViewSpec};
use crate::three_d::Camera;
use crate::xray::{Beam, Material};

/// A device with its centre line refined.
#[derive(Debug, Clone)]
pub(crate) struct RefinedDevice {
    pub(crate) points: Vec<DevicePoint>,
    pub(crate) material: Option<Material>,
}

impl RefinedDevice {
    /// The devices that have something to draw.
    pub(crate) fn all(devices: &[DeviceView]) -> Result<Vec<Self>> {
        let mut refined = Vec::with_capacity(devices.len());
        for device in devices {
            let points = device.refined()?;
            if !points.is_empty() {
                refined.push(Self { points, material: device.material });
            }
        }
        Ok(refined)
    }
}

/// Geometry and physics of the fluoroscopic view.
#[derive(Debug, Clone)]
pub(crate) struct FluoroSetup {
    pub(crate) c_arm: CArm,
    pub(crate) beam: Beam,
}

/// All that an engine needs, and no more than the wanted views need.
#[derive(Debug)]
pub(crate) struct Setup {
    pub(crate) wall: Arc<SurfaceMesh>,
    pub(crate) fluoro: Option<FluoroSetup>,
    pub(crate) camera: Option<Camera>,
}

impl Setup {
    pub(crate) fn new(spec: &ViewSpec, wall: &SurfaceMesh) -> Result<Self> {
        spec.validate()?;
        if spec.views.is_empty() {
            return Ok(Self { wall: Arc::default(), fluoro: None, camera: None });
        }
        check_drawable(wall)?;
        let mut fluoro = None;
        if spec.wants(View::Fluoro) {
            check_closed(wall)?;
            let c_arm = CArm::new(&spec.c_arm, spec.size_px, wall)?;
            let beam = Beam::new(&spec.xray, &c_arm, wall)?;
            fluoro = Some(FluoroSetup { c_arm, beam });
        }
        let camera = spec.wants(View::ThreeD).then(|| Camera::new(&spec.camera, spec.size_px, wall));
        Ok(Self { wall: Arc::new(wall.clone()), fluoro, camera })
    }
}
