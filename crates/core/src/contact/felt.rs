//! The vessel as a device feels it: extended beyond its openings, smooth, and ready for queries.

use super::SmoothWall;
use super::extension::extended;
use crate::Result;
use crate::device::Device;
use crate::vessel::{Wall, WallQuery};

/// A wall prepared for the contact of one device.
#[derive(Debug, Clone)]
pub struct FeltWall {
    /// Its smooth distance.
    pub smooth: SmoothWall,
    /// Nearest triangles and clearances.
    pub query: WallQuery,
}

impl FeltWall {
    /// Prepares `wall` for `device`.
    ///
    /// # Errors
    /// A wall that has no triangles left to query.
    pub fn new(wall: &Wall, device: &Device) -> Result<Self> {
        let (thinnest_mm, thickest_mm) = (device.min_radius_mm(), device.max_radius_mm());
        let felt = Wall::from_surface(&extended(wall, thickest_mm))?;
        Ok(Self { smooth: SmoothWall::new(&felt, thinnest_mm, thickest_mm), query: WallQuery::new(&felt)? })
    }
}
