//! What a frame shows, for learning: where devices are, to the pixel and without noise.

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
    /// [`crate::CArm::matrix`]: takes (x, y, z, 1) to pixel coordinates times the depth.
    pub camera_matrix: [[f64; 4]; 3],
    /// How the frame is exposed.
    pub exposure: Exposure,
    /// The devices in order.
    pub devices: Vec<DeviceLabel>,
    /// Places where the wall holds a device.
    pub contacts: Vec<ContactLabel>,
    /// Grey value k + 1 where the pixel is in the mask of device k, the last of several; 0 elsewhere.
    #[serde(skip)]
    pub mask: Image,
    /// Pixels at least half of whose rays meet the lumen that its surface has, without the ends that pictures add; absent where the wall is not closed.
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
    /// The projected tip; absent where it is not between source and detector.
    pub tip_px: Option<[f64; 2]>,
    /// The tip in space; absent where nothing is in.
    pub tip_mm: Option<[f64; 3]>,
    /// Whether the tip is on the detector and between the blades.
    pub tip_visible: bool,
    /// Its parts in order; none of a solid rod.
    pub parts: Vec<PartLabel>,
    /// Pixels that it covers by half or more, or that its axis runs through, under no blade.
    #[serde(skip)]
    pub mask: Mask,
}

/// One part of a device in a frame.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PartLabel {
    /// Its number among the parts of its device, also of those that are not in.
    pub number: usize,
    /// What it is made of.
    pub material: Material,
    /// Where it begins and ends, in arc length from the tip; absent: the whole device.
    pub from_tip_mm: Option<[f64; 2]>,
    /// Pixels that it covers by half or more, or that its axis runs through, under no blade, whatever is before or behind it.
    #[serde(skip)]
    pub mask: Mask,
}

/// One contact in a frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ContactLabel {
    /// Where it is projected; absent where it is not between source and detector.
    pub pixel: Option<[f64; 2]>,
    /// Where it is.
    pub position_mm: [f64; 3],
    /// Whether that is on the detector and between the blades.
    pub visible: bool,
}
