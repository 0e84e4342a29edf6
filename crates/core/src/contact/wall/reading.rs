//! How near a point of a device stands to the wall, from what is known of its surroundings.
//!
//! Places here are material points of the vessel, which is not where the device is while the vessel is displaced ([`crate::contact::MovedWall`]).
//! So are lengths between them, and clearances that are remembered; a reading is a distance in space.
//!
//! On the way from a base what a point reads hangs on where it is alone, not on other steps that were tried: within half its radius of
//! where the wall was looked for at the base, it is read about the piece of wall that was found there.

use super::{SUNK, WallContact};
use crate::Vec3;
use crate::contact::cache::TakenReading;
use crate::contact::distance::{Distance, Nearness};
use crate::contact::point::{FOLLOW, LOOK_AGAIN};
use crate::contact::surface::Hint;

/// How near a point stands.
#[derive(Debug, Clone, Copy)]
pub(super) enum Reading {
    /// No wall is nearer than this, mm; or, where derivatives are not wanted, it is as near as this.
    Free(f64),
    /// It presses, or is as near as was asked.
    Pressed(Distance),
}

impl Reading {
    /// A distance with derivatives may have been asked for from farther away than `limit_mm` before.
    pub(super) fn of(nearness: Nearness, limit_mm: f64) -> Self {
        match nearness {
            Nearness::Within(d) if d.value_mm < limit_mm => Self::Pressed(d),
            near => Self::Free(near.value_mm()),
        }
    }

    /// Distance, mm, or less.
    pub(super) fn distance_mm(&self) -> f64 {
        match self {
            Self::Free(value_mm) | Self::Pressed(Distance { value_mm, .. }) => *value_mm,
        }
    }
}

impl WallContact<'_> {
    /// How near the wall point `index` would be at the material point `x`.
    pub(super) fn read(&mut self, index: usize, x: &Vec3) -> Reading {
        self.read_within(index, x, self.points[index].potential.radius_mm)
    }

    /// The same, with derivatives nearer than `limit_mm`.
    pub(super) fn read_within(&mut self, index: usize, x: &Vec3, limit_mm: f64) -> Reading {
        if let Some(side) = self.cache.points[index].side {
            let reading = self.read_from_side(index, x, side, limit_mm);
            // What has come back out has no side any more: what it is near to may be the other one.
            if reading.distance_mm() < SUNK * self.points[index].potential.radius_mm {
                return reading;
            }
            return self.read_anew(index, x, limit_mm);
        }
        self.read_known(index, x, limit_mm).unwrap_or_else(|| self.read_anew(index, x, limit_mm))
    }

    /// Below which distance a trial asks for derivatives: they serve the assembly that follows where friction acts; otherwise that
    /// was tried first.
    pub(super) fn asked_mm(&self, radius_mm: f64) -> f64 {
        if self.friction.acts() { radius_mm } else { f64::NEG_INFINITY }
    }

    /// The reading that was taken at `x` with that hint, if it says enough.
    pub(super) fn read_there(&self, index: usize, x: &Vec3, hint: Hint, limit_mm: f64) -> Option<Reading> {
        let TakenReading { at_mm, hint: taken, nearness } = self.cache.readings[index];
        let told = matches!(nearness, Nearness::Within(_)) || nearness.value_mm() >= limit_mm;
        (at_mm == *x && taken == hint && told).then(|| Reading::of(nearness, limit_mm))
    }

    /// Of a point that has sunk into the wall: followed from there along the surface.
    pub(super) fn read_from_side(&mut self, index: usize, x: &Vec3, side: u32, limit_mm: f64) -> Reading {
        let point = &self.points[index];
        let known = &mut self.cache.points[index];
        let piece = match known.base_piece {
            Some(piece) if (x - known.base_looked_at).norm() < LOOK_AGAIN * point.potential.radius_mm => {
                known.looked_at = known.base_looked_at;
                piece
            }
            _ => {
                known.looked_at = *x;
                self.surface.follow(side, x)
            }
        };
        known.from_tip_mm = point.from_tip_mm;
        (known.clearance_mm, known.piece, known.free_mm) = (0.0, Some(piece), 0.0);
        let hint = Hint::Side(piece);
        if let Some(reading) = self.read_there(index, x, hint, limit_mm) {
            self.counters.avoided += 1;
            return reading;
        }
        self.counters.near += 1;
        let nearness = self.surface.nearness(x, hint, limit_mm);
        self.cache.readings[index] = TakenReading { at_mm: *x, hint, nearness };
        Reading::of(nearness, limit_mm)
    }

    /// What clearances and the last piece say without a query.
    pub(super) fn read_known(&mut self, index: usize, x: &Vec3, limit_mm: f64) -> Option<Reading> {
        let radius = self.points[index].potential.radius_mm;
        let stretch = self.surface.stretch();
        let near = radius * (1.0 + FOLLOW) * stretch;
        let known = &mut self.cache.points[index];
        let moved = (x - known.base_looked_at).norm();
        if moved < known.base_free_mm {
            self.counters.avoided += 1;
            (known.looked_at, known.piece) = (known.base_looked_at, None);
            (known.clearance_mm, known.free_mm) = (known.base_looked_clearance_mm, known.base_free_mm);
            return Some(Reading::Free((known.clearance_mm - moved) / stretch));
        }
        let moved = (x - known.looked_at).norm();
        let free_mm = known.clearance_mm - near - self.surface.deepest_inset_mm();
        if moved < free_mm {
            self.counters.avoided += 1;
            known.free_mm = free_mm;
            return Some(Reading::Free((known.clearance_mm - moved) / stretch));
        }
        if (x - known.base_looked_at).norm() < LOOK_AGAIN * radius && known.base_piece.is_some() {
            (known.looked_at, known.piece) = (known.base_looked_at, known.base_piece);
            (known.clearance_mm, known.free_mm) = (known.base_looked_clearance_mm, 0.0);
        }
        let (hint, looked_at) = (Hint::Near(known.piece?), known.looked_at);
        // A ball that holds no wall holds none where the point has moved within it.
        if let TakenReading { at_mm, nearness: Nearness::Clear(ball_mm), .. } = self.cache.readings[index] {
            let left_mm = ball_mm - (x - at_mm).norm() * stretch;
            if left_mm >= limit_mm.max(radius) {
                self.counters.avoided += 1;
                return Some(Reading::Free(left_mm));
            }
        }
        if let Some(reading) = self.read_there(index, x, hint, limit_mm) {
            self.counters.avoided += 1;
            return Some(reading);
        }
        if (x - looked_at).norm() >= LOOK_AGAIN * radius {
            return None;
        }
        let nearness = self.surface.nearness(x, hint, limit_mm);
        if nearness.value_mm() <= 0.0 {
            return None;
        }
        self.counters.near += 1;
        self.cache.readings[index] = TakenReading { at_mm: *x, hint, nearness };
        Some(Reading::of(nearness, limit_mm))
    }

    /// From the piece that is nearest through space.
    pub(super) fn read_anew(&mut self, index: usize, x: &Vec3, limit_mm: f64) -> Reading {
        let radius = self.points[index].potential.radius_mm;
        let stretch = self.surface.stretch();
        let near = radius * (1.0 + FOLLOW) * stretch;
        let known = &mut self.cache.points[index];
        let proximity = &mut self.cache.proximity;
        let asked = proximity.queries;
        let place = proximity.around(&self.surface, x);
        self.counters.avoided += u64::from(proximity.queries == asked);
        (known.looked_at, known.from_tip_mm) = (place.middle, self.points[index].from_tip_mm);
        (known.clearance_mm, known.piece) = (place.clearance_mm, None);
        let clearance = place.clearance(x) / stretch;
        let Some(piece) = place.piece else {
            // Past an opening there is no wall.
            known.free_mm = (x - place.middle).norm() + LOOK_AGAIN * radius;
            return Reading::Free(clearance);
        };
        known.free_mm = place.clearance_mm - near - self.surface.inset_mm(piece);
        if (x - place.middle).norm() < known.free_mm {
            return Reading::Free(clearance);
        }
        (known.piece, known.free_mm) = (Some(piece), 0.0);
        let hint = Hint::Near(piece);
        let nearness = self.surface.nearness(x, hint, limit_mm);
        self.cache.readings[index] = TakenReading { at_mm: *x, hint, nearness };
        Reading::of(nearness, limit_mm)
    }
}
