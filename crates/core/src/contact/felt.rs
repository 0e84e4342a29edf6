//! The vessel as a device feels it: extended beyond its openings, smooth, and ready for queries.

use super::SmoothWall;
use super::extension::extended;
use super::grading::{Grading, Stiffness};
use crate::device::Device;
use crate::insertion::WallProperties;
use crate::vessel::{Wall, WallQuery};
use crate::{Result, Vec3};

/// A wall prepared for the contact of one device.
#[derive(Debug, Clone)]
pub struct FeltWall {
    /// Its smooth distance.
    pub smooth: SmoothWall,
    /// Nearest triangles and clearances.
    pub query: WallQuery,
    /// Modulus and friction, where they are not the same everywhere.
    pub grading: Option<Grading>,
}

impl FeltWall {
    /// Prepares `wall` for `device`.
    ///
    /// # Errors
    /// A wall that has no triangles left to query.
    pub fn new(wall: &Wall, device: &Device, properties: &WallProperties) -> Result<Self> {
        let (thinnest_mm, thickest_mm) = (device.min_radius_mm(), device.max_radius_mm());
        let felt = Wall::from_surface(&extended(wall, thickest_mm))?;
        let smooth = SmoothWall::new(&felt, thinnest_mm, thickest_mm);
        let grading = if properties.region.is_empty() { None } else { Grading::new(&smooth, properties) };
        Ok(Self { smooth, query: WallQuery::new(&felt)?, grading })
    }

    /// The wall's modulus at `x`, whose nearest triangle is `triangle` or close to it; `softness` is the part of the stiffest
    /// that acts.
    pub(super) fn stiffness(&self, x: &Vec3, triangle: Option<u32>, softness: f64) -> Stiffness {
        match self.grading.as_ref().zip(triangle) {
            Some((grading, triangle)) => grading.stiffness(&self.smooth, x, triangle, softness),
            None => Stiffness { factor: softness, slope: None },
        }
    }

    /// Coefficient of friction there, over the largest of all.
    pub(super) fn rough(&self, x: &Vec3, triangle: Option<u32>) -> f64 {
        self.grading.as_ref().zip(triangle).map_or(1.0, |(g, triangle)| g.rough(&self.smooth, x, triangle))
    }
}
