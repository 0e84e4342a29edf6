//! Distances of single points from a wall, for methods with contact at their nodes.

use super::proximity::{Proximity, ProximityCache};
use super::surface::Hint;
use super::{ContactSurface, Nearness};
use crate::Vec3;

/// Evaluates a [`ContactSurface`] at points, and caches the nearest pieces by position.
///
/// Results within the limit of a query depend on the point alone, not on earlier queries: a reader may be dropped and
/// recreated at any time.
#[derive(Debug, Clone)]
pub struct WallReader {
    proximity: ProximityCache,
    near_mm: f64,
    /// The last ball without wall: consecutive nodes often lie in the same one.
    wide: Option<Proximity>,
}

impl WallReader {
    /// A reader for this `surface` only, and for points of the devices that it was made for.
    pub fn new(surface: &ContactSurface) -> Self {
        let near_mm = surface.tuning.follow * surface.thinnest_mm;
        Self { proximity: ProximityCache::of(surface), near_mm, wide: None }
    }

    /// Distance of `x` from the wall, with derivatives below `limit_mm`, and the piece of wall nearest to its
    /// surroundings.
    ///
    /// Where the wall is farther than the limit, or the radius of the device, by more than half of that radius, no
    /// piece is returned, and the distance is only a lower bound; past the end of the vessel it is infinite.
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
            // The clearance that holds all around.
            return (Nearness::Beyond(place.clearance(x) - deepest_mm), None);
        }
        (surface.nearness(x, Hint::Near(piece), limit_mm), Some(piece))
    }
}
