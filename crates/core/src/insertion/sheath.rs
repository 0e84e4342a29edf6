//! The introducer sheath: where the device comes out, and in which direction.

use crate::vessel::Wall;
use crate::{Error, Result, Vec3};

/// The mouth of the introducer sheath. It prescribes position and tangent of the device there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sheath {
    /// Mouth of the sheath, mm.
    pub position_mm: Vec3,
    /// Direction of insertion, unit length.
    pub direction: Vec3,
}

impl Sheath {
    /// A sheath at a point, pointing in a direction of any length.
    ///
    /// # Errors
    /// Names the value that is not finite, or a direction of zero length.
    pub fn new(position_mm: Vec3, direction: Vec3) -> Result<Self> {
        let show = |v: &Vec3| format!("[{}, {}, {}]", v.x, v.y, v.z);
        if !position_mm.iter().all(|c| c.is_finite()) {
            return Err(Error::parameter(
                "sheath.position_mm",
                show(&position_mm),
                "must be three finite numbers",
            ));
        }
        let length = direction.norm();
        if !(length.is_finite() && length > 0.0) {
            return Err(Error::parameter(
                "sheath.direction",
                show(&direction),
                "must be a direction, not all zero",
            ));
        }
        Ok(Self { position_mm, direction: direction / length })
    }

    /// A sheath in the middle of an opening of the wall, pointing into the vessel.
    ///
    /// `depth_mm` is how far inside the opening's plane the mouth lies.
    ///
    /// # Errors
    /// An opening that the wall does not have.
    pub fn at_opening(wall: &Wall, opening: usize, depth_mm: f64) -> Result<Self> {
        let openings = wall.openings();
        let Some(place) = openings.get(opening) else {
            return Err(Error::parameter(
                "sheath.opening",
                opening,
                format!("the vessel has {} openings, numbered from 0", openings.len()),
            ));
        };
        if !depth_mm.is_finite() {
            return Err(Error::parameter("sheath.depth_mm", depth_mm, "must be a finite number"));
        }
        Self::new(place.centre_mm - place.direction * depth_mm, -place.direction)
    }
}
