//! What a frame shows, for learning: where devices are, to the pixel and without noise.

use serde::Serialize;

use super::Image;

/// Labels of one fluoroscopic frame. Pixel coordinates are those of [`crate::CArm::project`].
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Labels {
    /// Width and height of the frame.
    pub size_px: [u32; 2],
    /// The devices in order.
    pub devices: Vec<DeviceLabel>,
    /// Places where the wall holds a device.
    pub contacts: Vec<ContactLabel>,
    /// Grey value k + 1 where a ray of the pixel meets device k, 0 elsewhere.
    #[serde(skip)]
    pub mask: Image,
}

/// One device in a frame.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DeviceLabel {
    /// The projected centre line, the tip last: what of it is between source and detector.
    pub centre_line_px: Vec<[f64; 2]>,
    /// The projected tip; absent where it is not between source and detector.
    pub tip_px: Option<[f64; 2]>,
    /// Whether the tip is on the detector and between the blades.
    pub tip_visible: bool,
}

/// One contact in a frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ContactLabel {
    /// Where it is projected; absent where it is not between source and detector.
    pub pixel: Option<[f64; 2]>,
    /// Whether that is on the detector and between the blades.
    pub visible: bool,
}
