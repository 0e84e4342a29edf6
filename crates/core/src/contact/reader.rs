//! How near single points of space are to a wall, for methods that feel it at their nodes.

use super::point::{FOLLOW, LOOK_AGAIN};
use super::proximity::{Proximity, ProximityCache};
use super::{ContactSurface, Nearness};
use crate::Vec3;

/// Reads a [`ContactSurface`] at points, and remembers which triangles are nearest to places that were asked for.
///
/// What is within the limit of a question depends on the point alone, not on what was asked before: a reader may be dropped and made anew
/// at any moment.
#[derive(Debug, Clone)]
pub struct WallReader {
    proximity: ProximityCache,
    near_mm: f64,
    /// The last place around which the lumen was wide: nodes that follow each other lie in one such ball.
    wide: Option<Proximity>,
}

impl WallReader {
    /// A reader of `surface`, and of no other, for points of devices for which that was made.
    pub fn new(surface: &ContactSurface) -> Self {
        let radius_mm = surface.thinnest_mm;
        Self {
            proximity: ProximityCache::new(LOOK_AGAIN * radius_mm, surface.reach_mm),
            near_mm: FOLLOW * radius_mm,
            wide: None,
        }
    }

    /// How near `x` is to the wall, with derivatives below `limit_mm`, and the triangle of the felt mesh that is nearest to its surroundings;
    /// none past the end of the vessel, and where all is farther than the limit, or the radius of the device, by more than half of that
    /// radius.
    pub fn read(&mut self, surface: &ContactSurface, x: &Vec3, limit_mm: f64) -> Option<(Nearness, u32)> {
        let near_mm = limit_mm.max(surface.thinnest_mm) + self.near_mm;
        let deepest_mm = surface.smooth.deepest_inset_mm();
        if self.wide.is_some_and(|place| place.clearance(x) - deepest_mm > near_mm) {
            return None;
        }
        let place = self.proximity.around(&surface.query, x);
        let triangle = place.triangle?;
        if place.clearance(x) - surface.smooth.inset_mm(triangle) > near_mm {
            self.wide = Some(place);
            return None;
        }
        Some((surface.nearness(x, triangle, limit_mm), triangle))
    }
}
