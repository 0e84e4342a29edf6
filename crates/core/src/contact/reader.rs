//! How near single points of space are to a wall, for methods that feel it at their nodes.

use super::point::{FOLLOW, LOOK_AGAIN};
use super::proximity::{Proximity, ProximityCache};
use super::surface::Hint;
use super::{ContactSurface, Nearness};
use crate::Vec3;

/// Reads a [`ContactSurface`] at points, and remembers which pieces of it are nearest to places that were asked for.
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

    /// How near `x` is to the wall, with derivatives below `limit_mm`, and the piece of wall that is nearest to its surroundings.
    ///
    /// Where the wall is farther than the limit, or the radius of the device, by more than half of that radius, no piece is returned, and a
    /// distance that may be less than it is; past the end of the vessel that is infinite.
    pub fn read(&mut self, surface: &ContactSurface, x: &Vec3, limit_mm: f64) -> (Nearness, Option<u32>) {
        let near_mm = limit_mm.max(surface.thinnest_mm) + self.near_mm;
        let deepest_mm = surface.deepest_inset_mm();
        if let Some(place) = &self.wide {
            let clear_mm = place.clearance(x) - deepest_mm;
            if clear_mm > near_mm {
                return (Nearness::Beyond(clear_mm), None);
            }
        }
        let place = self.proximity.around(surface, x);
        let Some(piece) = place.piece else { return (Nearness::Beyond(f64::INFINITY), None) };
        let clear_mm = place.clearance(x) - surface.inset_mm(piece);
        if clear_mm > near_mm {
            self.wide = Some(place);
            // By as much as holds all around.
            return (Nearness::Beyond(place.clearance(x) - deepest_mm), None);
        }
        (surface.nearness(x, Hint::Near(piece), limit_mm), Some(piece))
    }
}
