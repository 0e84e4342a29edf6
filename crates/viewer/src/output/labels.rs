//! Labels of a frame for machine learning: positions of devices, per pixel and without noise.

use serde::Serialize;

use super::{Image, Mask};
use crate::material::Material;
use crate::pushed::ShownDevice;
use crate::xray::Exposure;

/// Labels of one fluoroscopic frame. Pixel coordinates are those of [`crate::CArm::project`], lengths are in mm in patient axes.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Labels {
    /// Width and height of the frame.
    pub size_px: [u32; 2],
    /// [`crate::CArm::matrix`]: maps (x, y, z, 1) to pixel coordinates times the depth.
    pub camera_matrix: [[f64; 4]; 3],
    /// The exposure of the frame.
    pub exposure: Exposure,
    /// The devices in order.
    pub devices: Vec<DeviceLabel>,
    /// Contacts of devices with the wall.
    pub contacts: Vec<ContactLabel>,
    /// k + 1 where the pixel is in the mask of device k, the last of several; 0 elsewhere.
    #[serde(skip)]
    pub mask: Image,
    /// Pixels at least half of whose rays hit the lumen of the surface, without the ends added in images; absent if
    /// the wall is not closed.
    #[serde(skip)]
    pub vessel: Option<Mask>,
}

/// One device in a frame.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DeviceLabel {
    /// Which device it is, where the renderer's caller knows.
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    pub shown: Option<ShownDevice>,
    /// The projected centre line, the tip last: what of it is between source and detector.
    pub centre_line_px: Vec<[f64; 2]>,
    /// The same points in space.
    pub centre_line_mm: Vec<[f64; 3]>,
    /// Their depths from the source along the central ray.
    pub depth_mm: Vec<f64>,
    /// The projected shaft outside the vessel, from the picture's edge to the sheath's mouth: it is in the picture and in
    /// the masks, and is not simulated. Empty without a sheath, and where the mouth is outside the picture.
    pub shaft_px: Vec<[f64; 2]>,
    /// The projected tip; absent if it is not between source and detector.
    pub tip_px: Option<[f64; 2]>,
    /// The tip in space; absent if nothing is inserted.
    pub tip_mm: Option<[f64; 3]>,
    /// Whether the tip is on the detector and between the blades.
    pub tip_visible: bool,
    /// Its parts in order; empty for a solid rod.
    pub parts: Vec<PartLabel>,
    /// Pixels at least half covered by it, with its shaft outside the vessel, or crossed by its axis, not behind a
    /// blade.
    #[serde(skip)]
    pub mask: Mask,
}

/// One part of a device in a frame.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PartLabel {
    /// Its index among the parts of its device, including those not inserted.
    pub number: usize,
    /// Its material.
    pub material: Material,
    /// Its start and end, in arc length from the tip; absent: the whole device.
    pub from_tip_mm: Option<[f64; 2]>,
    /// Pixels at least half covered by it, or crossed by its axis, not behind a blade, whatever is in front or
    /// behind.
    #[serde(skip)]
    pub mask: Mask,
}

/// One contact in a frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ContactLabel {
    /// Its projection; absent if it is not between source and detector.
    pub pixel: Option<[f64; 2]>,
    /// Its position.
    pub position_mm: [f64; 3],
    /// Whether the projection is on the detector and between the blades.
    pub visible: bool,
}
